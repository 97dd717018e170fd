//! The plan: what this scene and the outputs asked for need, and what is left out.

use std::fmt;

use super::{PlaneKind, Scene};

/// How illuminance is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Direct light by shadow rays, photons for what has bounced.
    Split,
    /// All light by photons, corrected for every known bias.
    Photons,
    /// The paper's estimator as printed, biases and all.
    Seed,
}

impl Method {
    /// Every method, by name.
    pub const ALL: [(&'static str, Self); 3] =
        [("split", Self::Split), ("photons", Self::Photons), ("seed", Self::Seed)];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Split => "split",
            Self::Photons => "photons",
            Self::Seed => "seed",
        }
    }
}

/// What a run does and leaves out.
#[derive(Clone, Debug)]
pub struct Plan {
    /// How illuminance is computed.
    pub method: Method,
    /// Three channels, or one.
    pub coloured: bool,
    /// Whether photons are traced at all.
    pub photons: bool,
    /// Whether direct light is computed by shadow rays.
    pub shadow_rays: bool,
    /// Whether mirrors or glass make caustics.
    pub caustics: bool,
    /// Why, in words: (used?, what, reason).
    pub reasons: Vec<(bool, String, String)>,
}

impl Plan {
    /// Decides from the scene and the method.
    pub fn new(scene: &Scene, method: Method) -> Self {
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
        let shadow_rays = match method {
            Method::Split => decide(
                true,
                "direct light by shadow rays",
                format!("method split, {} luminaires", scene.luminaires.len()),
            ),
            _ => decide(false, "direct light by shadow rays", format!("method {} counts photons", method.name())),
        };
        let bright = scene.materials.iter().find(|material| !material.is_black());
        let photons = match bright {
            _ if method != Method::Split => decide(true, "photons", format!("method {}", method.name())),
            _ if scene.mesh.triangles.is_empty() => {
                decide(false, "photons", "no surface: light bounces off nothing".into())
            }
            None => decide(false, "photons", "every surface is black: light bounces off nothing".into()),
            Some(material) => {
                decide(true, "photons", format!("for light that has bounced, such as off {}", material.name))
            }
        };
        let shiny = scene.materials.iter().find(|material| material.is_specular());
        let caustics = match shiny {
            Some(material) if photons => {
                decide(true, "specular paths", format!("{} is a mirror or glass", material.name))
            }
            Some(_) => false,
            None => decide(false, "specular paths", "no mirror and no glass".into()),
        };
        if photons {
            let receivers = scene.planes.len() + scene.sensors.len();
            match method {
                Method::Seed => decide(true, "photons of every surface", "the paper keeps them all".into()),
                _ => decide(
                    false,
                    "photons of other surfaces",
                    format!("kept only where they cross one of {receivers} planes and sensors"),
                ),
            };
        }
        let on = |kind| scene.planes.iter().filter(|plane| plane.kind == kind).count();
        decide(on(PlaneKind::Surface) > 0, "planes on surfaces", format!("{} in the scene", on(PlaneKind::Surface)));
        decide(on(PlaneKind::Air) > 0, "planes in the air", format!("{} in the scene", on(PlaneKind::Air)));
        decide(!scene.sensors.is_empty(), "sensors", format!("{} in the scene", scene.sensors.len()));
        Self { method, coloured, photons, shadow_rays, caustics, reasons }
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (used, what, why) in &self.reasons {
            writeln!(f, "{} {what:<28} {why}", if *used { "used    " } else { "left out" })?;
        }
        Ok(())
    }
}
