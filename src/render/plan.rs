//! The plan: what this scene and the outputs asked for need, and what is left out.

use std::fmt;

use crate::luminaire::LightGroups;
pub use crate::options::Method;
use crate::scene::{Measure, PlaneKind, Scene, emitters};
use crate::text::listed;
use crate::text::number::short;

/// Photons light the whole scene, paths only what is looked at: below this share of the scene that the planes cover, a
/// photon's chance to matter is so small that paths are worth a try.
const SMALL_SHARE: f64 = 0.02;

/// What a run does and leaves out.
#[derive(Clone, Debug)]
pub struct Plan {
    /// How illuminance is computed.
    pub method: Method,
    /// Three channels, or one.
    pub coloured: bool,
    /// Whether anything is left to passes: light that has bounced, or all light where photons count it.
    pub bounces: bool,
    /// Whether photons are traced at all.
    pub photons: bool,
    /// Whether direct light is computed by shadow rays.
    pub shadow_rays: bool,
    /// Whether mirrors or glass make caustics.
    pub caustics: bool,
    /// Whether light groups are told apart.
    pub groups: bool,
    /// Why, in words: (used?, what, reason).
    pub reasons: Vec<(bool, String, String)>,
}

impl Plan {
    /// Decides from the scene and the method; light groups are told apart if the scene file asks for it.
    pub fn new(scene: &Scene, method: Method) -> Self {
        Self::with_groups(scene, method, scene.render.groups == Some(true))
    }

    /// The same, with light groups told apart or not.
    pub fn with_groups(scene: &Scene, method: Method, groups: bool) -> Self {
        let mut reasons = Vec::new();
        let mut decide = |used: bool, what: &str, why: String| {
            reasons.push((used, what.to_owned(), why));
            used
        };
        let coloured_material = scene.materials.iter().find(|material| material.is_coloured());
        let coloured_luminaire =
            scene.luminaires.iter().find(|l| l.colour[0] != l.colour[1] || l.colour[1] != l.colour[2]);
        let coloured = match (coloured_material, coloured_luminaire) {
            (Some(material), _) => decide(true, "three channels", format!("material {} is coloured", material.name)),
            (None, Some(lamp)) => decide(true, "three channels", format!("luminaire {} is coloured", lamp.name)),
            (None, None) => {
                decide(false, "three channels", "no material and no luminaire is coloured: one does".into())
            }
        };
        let name = method.name();
        let luminaires = scene.luminaires.len();
        let shadow_rays = if method.splits() {
            decide(true, "direct light by shadow rays", format!("method {name}, {luminaires} luminaires"))
        } else {
            decide(false, "direct light by shadow rays", format!("method {name} counts photons"))
        };
        for (source, count, flux) in measured(scene) {
            let luminaires = if count == 1 { "1 luminaire".into() } else { format!("{count} luminaires") };
            decide(true, "measured photometry", format!("{source}: {luminaires}, {flux:.0} lm in all"));
        }
        for why in emitting(scene) {
            decide(true, "emitting faces", why);
        }
        let bright = scene.materials.iter().find(|material| !material.is_black());
        let bounces = match bright {
            _ if !method.splits() => decide(true, "passes", format!("method {name}: all light by photons")),
            _ if scene.mesh.triangles.is_empty() => {
                decide(false, "passes", "no surface: light bounces off nothing".into())
            }
            None => decide(false, "passes", "every surface is black: light bounces off nothing".into()),
            Some(material) => {
                decide(true, "passes", format!("for light that has bounced, such as off {}", material.name))
            }
        };
        let photons = match method {
            Method::Path => decide(false, "photons", "method path follows light backwards only".into()),
            _ if bounces => decide(true, "photons", format!("method {name}")),
            _ => false,
        };
        if bounces {
            let why = |does: &str| format!("method {name} {does}");
            match method {
                Method::Path => decide(true, "rays from the points", why("goes on from surface to surface")),
                Method::Gather => decide(true, "rays from the points", why("ends them where photons know the light")),
                _ => decide(false, "rays from the points", why("takes the photons' density there")),
            };
            let share = scene.measured_share();
            if photons && share < SMALL_SHARE {
                let share = 100.0 * share;
                let why = format!(
                    "planes cover {share:.2} % of the scene: `method` path `smooth` on asks only for what they see"
                );
                decide(true, "photons of the whole scene", why);
            }
        }
        let shiny = scene.materials.iter().find(|material| material.is_specular());
        let caustics = match shiny {
            Some(material) if bounces => {
                decide(true, "specular paths", format!("{} mirrors or refracts", material.name))
            }
            Some(_) => false,
            None => decide(false, "specular paths", "no mirror and no glass".into()),
        };
        let panes: Vec<&str> =
            scene.materials.iter().filter(|m| m.glazing.is_some()).map(|m| m.name.as_str()).collect();
        match panes.as_slice() {
            [] => decide(false, "panes", "no thin sheet of clear glass".into()),
            names => decide(
                true,
                "panes",
                format!("{}: light passes straight, direct light too", listed(names.iter().copied())),
            ),
        };
        if photons {
            let receivers = scene.planes.len() + scene.sensors.len() + scene.surfaces.len();
            match method {
                Method::Seed => decide(true, "photons of every surface", "the paper keeps them all".into()),
                Method::Gather => decide(true, "photons of every surface", "as illuminance of patches".into()),
                _ => decide(
                    false,
                    "photons of other surfaces",
                    format!("kept only at one of {receivers} planes, sensors and surfaces"),
                ),
            };
        }
        let on = |kind| scene.planes.iter().filter(|plane| plane.kind == kind).count();
        decide(on(PlaneKind::Surface) > 0, "planes on surfaces", format!("{} in the scene", on(PlaneKind::Surface)));
        decide(on(PlaneKind::Air) > 0, "planes in the air", format!("{} in the scene", on(PlaneKind::Air)));
        decide(!scene.sensors.is_empty(), "sensors", format!("{} in the scene", scene.sensors.len()));
        let counted = photons && (caustics || !method.sends_rays());
        let how = match (method.sends_rays(), counted) {
            (true, false) => "rays from each sample",
            (true, true) => "rays from each sample; caustics as photons on it, over its area",
            (false, _) => "photons on each sample, over its area",
        };
        let surfaces = scene.surfaces.len();
        let samples: usize = scene.surfaces.iter().map(|surface| surface.samples.len()).sum();
        let why = match surfaces {
            0 => "0 in the scene".to_owned(),
            _ => format!("{surfaces} in the scene, {samples} samples; {how}"),
        };
        decide(surfaces > 0, "surfaces of the mesh", why);
        let bodies = scene.sensors.iter().filter(|sensor| sensor.measure != Measure::Plane).count();
        decide(bodies > 0, "cylinders and spheres", format!("{bodies} sensors"));
        match scene.maintenance_factor {
            None => decide(false, "maintenance factor", "none given: the installation is new".into()),
            Some([least, most]) if least == most => decide(true, "maintenance factor", least.to_string()),
            Some([least, most]) => decide(true, "maintenance factor", format!("{least} to {most}, by luminaire")),
        };
        match scene.cameras.len() {
            0 => decide(false, "camera rays", "no camera in the scene".into()),
            _ if bounces && method != Method::Gather => {
                decide(true, "camera rays", format!("go on from surface to surface with method {name}, as paths"))
            }
            cameras => {
                decide(true, "camera rays", format!("{cameras} in the scene; light is gathered only where they look"))
            }
        };
        let densities = photons && caustics && !scene.cameras.is_empty();
        if densities {
            decide(true, "densities of caustics", "at the surfaces that cameras see".into());
        }
        let number = LightGroups::of(&scene.luminaires).len();
        let groups = match (number, method, groups) {
            (0 | 1, ..) => decide(false, "light groups", "one group only: all light is its own".into()),
            (_, Method::Seed, _) => decide(false, "light groups", "method seed knows none".into()),
            (_, _, true) => {
                decide(true, "light groups", format!("{number}, told apart by the photons and rays of the whole"))
            }
            _ => decide(false, "light groups", format!("{number}, not asked for: `groups`")),
        };
        Self { method, coloured, bounces, photons, shadow_rays, caustics, groups, reasons }
    }

    /// Whether photons themselves tell light where it is measured, by their density or number: all that is left to passes
    /// where no rays look for it, else caustics.
    pub fn counts_photons(&self) -> bool {
        self.photons && (self.caustics || !self.method.sends_rays())
    }
}

/// Photometric files: what each is, how many luminaires shine by it, and their flux, lm.
fn measured(scene: &Scene) -> Vec<(&str, usize, f64)> {
    let mut files: Vec<(&str, usize, f64)> = Vec::new();
    for luminaire in &scene.luminaires {
        let Some(measured) = luminaire.measured() else { continue };
        let source = measured.web().source();
        match files.iter_mut().find(|file| file.0 == source) {
            Some(file) => *file = (source, file.1 + 1, file.2 + luminaire.flux.0),
            None => files.push((source, 1, luminaire.flux.0)),
        }
    }
    files
}

/// What the `Ke` of emitting faces came to; the brightest in a line each, the rest together.
fn emitting(scene: &Scene) -> Vec<String> {
    const MOST: usize = 12;
    let emitters = emitters::of(&scene.luminaires);
    let (first, rest) = emitters.split_at(emitters.len().min(MOST));
    let mut told: Vec<String> =
        first.iter().map(|emitter| format!("{}: Ke taken as {}", emitter.luminaire.name, emitter.told())).collect();
    if !rest.is_empty() {
        let flux: f64 = rest.iter().map(|emitter| emitter.luminaire.flux.0).sum();
        told.push(format!("{} more: {} lm in all", rest.len(), short(flux)));
    }
    told
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (used, what, why) in &self.reasons {
            writeln!(f, "{} {what:<28} {why}", if *used { "used    " } else { "left out" })?;
        }
        Ok(())
    }
}
