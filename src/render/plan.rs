//! The plan: what this scene and the outputs asked for need, and what is left out.

mod reason;

use std::fmt;

pub use self::reason::{Decision, Reason, SampledBy, Subject};
use super::composition::{Composition, Decided, Rays};
use crate::luminaire::{LightGroups, Luminaire};
pub use crate::options::Method;
use crate::scene::material::Material;
use crate::scene::{Measure, PlaneKind, Scene, emitters};

/// Photons light the whole scene, paths only what is looked at: below this share of the scene that the planes cover, a
/// photon's chance to matter is so small that paths are worth a try.
const SMALL_SHARE: f64 = 0.02;
/// Emitters that have a line each in the plan; the rest are told together.
const MOST_EMITTERS: usize = 12;

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
    /// What was decided, and why.
    pub reasons: Vec<Decision>,
}

impl Plan {
    /// Decides from the scene and the method; light groups are told apart if the scene file asks for it.
    pub fn new(scene: &Scene, method: Method) -> Self {
        Self::with_groups(scene, method, scene.render.groups == Some(true))
    }

    /// The same, with light groups told apart or not.
    pub fn with_groups(scene: &Scene, method: Method, groups: bool) -> Self {
        let bounces = !method.splits() || (!scene.mesh.triangles.is_empty() && bright(scene).is_some());
        let mut plan = Self {
            method,
            coloured: coloured(scene).is_some(),
            bounces,
            photons: bounces && method.traces_photons(),
            shadow_rays: method.splits(),
            caustics: bounces && specular(scene).is_some(),
            groups: groups && method.knows_groups() && LightGroups::of(&scene.luminaires).len() > 1,
            reasons: Vec::new(),
        };
        plan.reasons = Reasons::of(scene, &plan);
        plan
    }

    /// What its method asks of photons and rays in this scene.
    pub(super) fn composition(&self, scene: &Scene) -> Composition {
        let Self { method, bounces, photons, caustics, .. } = *self;
        Composition::of(Decided { method, bounces, photons, caustics }, !scene.cameras.is_empty())
    }

    /// Whether photons themselves tell light where it is measured, by their density or number: all that is left to passes
    /// where no rays look for it, else caustics.
    pub fn counts_photons(&self) -> bool {
        self.photons && (self.caustics || !self.method.sends_rays())
    }
}

/// Why the scene has three channels, if it has.
fn coloured(scene: &Scene) -> Option<Reason> {
    let is_coloured = |lamp: &&Luminaire| lamp.colour[0] != lamp.colour[1] || lamp.colour[1] != lamp.colour[2];
    let material = scene.materials.iter().find(|material| material.is_coloured());
    let of_material = material.map(|material| Reason::ColouredMaterial(material.name.clone()));
    let of_lamp = || scene.luminaires.iter().find(is_coloured).map(|lamp| Reason::ColouredLuminaire(lamp.name.clone()));
    of_material.or_else(of_lamp)
}

/// A material that light bounces off.
fn bright(scene: &Scene) -> Option<&Material> {
    scene.materials.iter().find(|material| !material.is_black())
}

/// A material that mirrors or refracts.
fn specular(scene: &Scene) -> Option<&Material> {
    scene.materials.iter().find(|material| material.is_specular())
}

/// The decisions of a plan, told in order.
struct Reasons<'s> {
    scene: &'s Scene,
    plan: &'s Plan,
    /// What the method asks of photons and rays here.
    composition: Composition,
    told: Vec<Decision>,
}

impl<'s> Reasons<'s> {
    /// Those of a plan that is settled but for them.
    fn of(scene: &'s Scene, plan: &'s Plan) -> Vec<Decision> {
        let composition = plan.composition(scene);
        let mut reasons = Self { scene, plan, composition, told: Vec::new() };
        reasons.colour();
        reasons.direct_light();
        reasons.luminaires();
        reasons.passes();
        reasons.rays();
        reasons.glass_and_mirrors();
        reasons.kept_photons();
        reasons.planes_and_sensors();
        reasons.surfaces();
        reasons.bodies();
        reasons.maintenance();
        reasons.cameras();
        reasons.groups();
        reasons.told
    }

    fn tell(&mut self, used: bool, subject: Subject, reason: Reason) {
        self.told.push(Decision { used, subject, reason });
    }

    fn colour(&mut self) {
        self.tell(self.plan.coloured, Subject::Channels, coloured(self.scene).unwrap_or(Reason::NothingColoured));
    }

    fn direct_light(&mut self) {
        let method = self.plan.method;
        let reason = match self.plan.shadow_rays {
            true => Reason::LightSplit(method, self.scene.luminaires.len()),
            false => Reason::PhotonsCounted(method),
        };
        self.tell(self.plan.shadow_rays, Subject::ShadowRays, reason);
    }

    /// Photometric files, and what the `Ke` of emitting faces came to.
    fn luminaires(&mut self) {
        for (source, luminaires, flux) in measured(self.scene) {
            let source = source.to_owned();
            self.tell(true, Subject::MeasuredPhotometry, Reason::MeasuredFile { source, luminaires, flux });
        }
        let emitters = emitters::of(&self.scene.luminaires);
        let (first, rest) = emitters.split_at(emitters.len().min(MOST_EMITTERS));
        for emitter in first {
            let reason = Reason::Emitter { name: emitter.luminaire.name.clone(), light: emitter.told() };
            self.tell(true, Subject::EmittingFaces, reason);
        }
        if !rest.is_empty() {
            let flux = rest.iter().map(|emitter| emitter.luminaire.flux.0).sum();
            self.tell(true, Subject::EmittingFaces, Reason::MoreEmitters(rest.len(), flux));
        }
    }

    /// Passes, and photons in them.
    fn passes(&mut self) {
        let Plan { method, bounces, photons, .. } = *self.plan;
        let reason = match bright(self.scene) {
            _ if !method.splits() => Reason::AllByPhotons(method),
            _ if self.scene.mesh.triangles.is_empty() => Reason::NoSurface,
            None => Reason::AllBlack,
            Some(material) => Reason::LightBounces(material.name.clone()),
        };
        self.tell(bounces, Subject::Passes, reason);
        if photons {
            self.tell(true, Subject::Photons, Reason::PartOf(method));
        } else if !method.traces_photons() {
            self.tell(false, Subject::Photons, Reason::BackwardsOnly(method));
        }
    }

    /// Rays from the points; photons where hardly any matters.
    fn rays(&mut self) {
        let Plan { method, bounces, photons, .. } = *self.plan;
        if !bounces {
            return;
        }
        let rays = self.composition.rays;
        let reason = match rays {
            Some(Rays::AsPaths) => Reason::RaysGoOn(method),
            Some(Rays::OnPatches) => Reason::RaysEndOnPatches(method),
            None => Reason::DensityThere(method),
        };
        self.tell(rays.is_some(), Subject::Rays, reason);
        if photons {
            let share = self.scene.measured_share();
            if share < SMALL_SHARE {
                self.tell(true, Subject::WholeScene, Reason::SmallShare(share));
            }
        }
    }

    fn glass_and_mirrors(&mut self) {
        match specular(self.scene) {
            Some(material) if self.plan.caustics => {
                self.tell(true, Subject::SpecularPaths, Reason::Specular(material.name.clone()));
            }
            Some(_) => {} // no pass follows them
            None => self.tell(false, Subject::SpecularPaths, Reason::NothingSpecular),
        }
        let panes = self.scene.materials.iter().filter(|material| material.glazing.is_some());
        let panes: Vec<String> = panes.map(|material| material.name.clone()).collect();
        match panes.is_empty() {
            true => self.tell(false, Subject::Panes, Reason::NoPane),
            false => self.tell(true, Subject::Panes, Reason::PanesOf(panes)),
        }
    }

    /// Where photons are kept.
    fn kept_photons(&mut self) {
        if !self.plan.photons {
            return;
        }
        if self.composition.landings {
            self.tell(true, Subject::EverySurface, Reason::PaperKeepsAll);
        } else if self.composition.patches {
            self.tell(true, Subject::EverySurface, Reason::AsPatches);
        } else {
            let receivers = self.scene.planes.len() + self.scene.sensors.len() + self.scene.surfaces.len();
            self.tell(false, Subject::OtherSurfaces, Reason::OnlyMeasured(receivers));
        }
    }

    fn planes_and_sensors(&mut self) {
        let scene = self.scene;
        let on = |kind| scene.planes.iter().filter(|plane| plane.kind == kind).count();
        for (number, subject) in [
            (on(PlaneKind::Surface), Subject::PlanesOnSurfaces),
            (on(PlaneKind::Air), Subject::PlanesInAir),
            (scene.sensors.len(), Subject::Sensors),
        ] {
            self.tell(number > 0, subject, Reason::InScene(number));
        }
    }

    fn surfaces(&mut self) {
        let surfaces = self.scene.surfaces.len();
        let samples = self.scene.surfaces.iter().map(|surface| surface.samples.len()).sum();
        let by = match (self.plan.method.sends_rays(), self.plan.counts_photons()) {
            (true, false) => SampledBy::Rays,
            (true, true) => SampledBy::RaysAndCaustics,
            (false, _) => SampledBy::Photons,
        };
        let reason = match surfaces {
            0 => Reason::InScene(0),
            _ => Reason::Sampled { surfaces, samples, by },
        };
        self.tell(surfaces > 0, Subject::MeasuredSurfaces, reason);
    }

    fn bodies(&mut self) {
        let bodies = self.scene.sensors.iter().filter(|sensor| sensor.measure != Measure::Plane).count();
        self.tell(bodies > 0, Subject::Bodies, Reason::SensorsWithBody(bodies));
    }

    fn maintenance(&mut self) {
        let factors = self.scene.maintenance_factor;
        let reason = match factors {
            None => Reason::NewInstallation,
            Some([least, most]) if least == most => Reason::MaintenanceOfAll(least),
            Some(range) => Reason::MaintenanceByLuminaire(range),
        };
        self.tell(factors.is_some(), Subject::Maintenance, reason);
    }

    fn cameras(&mut self) {
        let cameras = self.scene.cameras.len();
        let reason = match cameras {
            0 => Reason::NoCamera,
            // Where photons tell no light of surfaces, rays have to go on.
            _ if self.plan.bounces && !self.composition.patches => Reason::CameraPaths(self.plan.method),
            _ => Reason::GatheredWhereSeen(cameras),
        };
        self.tell(cameras > 0, Subject::CameraRays, reason);
        if self.plan.photons && self.plan.caustics && cameras > 0 {
            self.tell(true, Subject::CausticDensities, Reason::SurfacesSeen);
        }
    }

    fn groups(&mut self) {
        let number = LightGroups::of(&self.scene.luminaires).len();
        let reason = match number {
            0 | 1 => Reason::OneGroup,
            _ if !self.plan.method.knows_groups() => Reason::MethodHasNoGroups(self.plan.method),
            _ if self.plan.groups => Reason::GroupsApart(number),
            _ => Reason::GroupsNotAsked(number),
        };
        self.tell(self.plan.groups, Subject::Groups, reason);
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

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.reasons.iter().try_for_each(|decision| writeln!(f, "{decision}"))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn decisions_say_what_the_plan_does() {
        for name in ["box", "box-view", "caustic", "seed-office"] {
            let scene = Scene::load(Path::new(&format!("scenes/{name}.toml"))).expect("a shipped scene");
            for (method, groups) in Method::ALL.into_iter().flat_map(|(_, method)| [(method, false), (method, true)]) {
                let plan = Plan::with_groups(&scene, method, groups);
                let used = |subject| -> Vec<bool> {
                    plan.reasons.iter().filter(|made| made.subject == subject).map(|made| made.used).collect()
                };
                let what = format!("{name}, {method:?}, {groups}");
                assert_eq!(used(Subject::Channels), [plan.coloured], "{what}");
                assert_eq!(used(Subject::ShadowRays), [plan.shadow_rays], "{what}");
                assert_eq!(used(Subject::Passes), [plan.bounces], "{what}");
                assert_eq!(used(Subject::Groups), [plan.groups], "{what}");
                assert_eq!(used(Subject::Photons).contains(&true), plan.photons, "{what}");
                assert_eq!(used(Subject::SpecularPaths).contains(&true), plan.caustics, "{what}");
                let composition = plan.composition(&scene);
                assert_eq!(composition.counted.is_some(), plan.counts_photons(), "{what}");
            }
        }
    }
}
