//! What a plan decided, and why: data, and the words for them.

use std::fmt;

use crate::options::Method;
use crate::text::listed;
use crate::text::number::short;

/// One decision of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// Whether the run does it.
    pub used: bool,
    /// What was decided on.
    pub subject: Subject,
    /// Why.
    pub reason: Reason,
}

/// `used`, or `left out`, what, and why, in columns.
impl fmt::Display for Decision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { used, subject, reason } = self;
        write!(f, "{} {:<28} {reason}", if *used { "used    " } else { "left out" }, subject.words())
    }
}

/// What a plan decides on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// Three colour channels instead of one.
    Channels,
    /// Direct light by shadow rays.
    ShadowRays,
    /// Luminaires with a photometric file.
    MeasuredPhotometry,
    /// Faces of the mesh that emit light.
    EmittingFaces,
    /// Passes of photons and rays.
    Passes,
    /// Photons.
    Photons,
    /// Rays from the measured points.
    Rays,
    /// Photons sent into a scene of which little is measured.
    WholeScene,
    /// Paths by mirrors and glass.
    SpecularPaths,
    /// Thin sheets of clear glass.
    Panes,
    /// Photons kept on every surface.
    EverySurface,
    /// Photons kept on surfaces that are not measured.
    OtherSurfaces,
    /// Measuring planes on surfaces.
    PlanesOnSurfaces,
    /// Measuring planes in the air.
    PlanesInAir,
    /// Sensors.
    Sensors,
    /// Measured surfaces of the mesh.
    MeasuredSurfaces,
    /// Sensors that measure on a body.
    Bodies,
    /// The maintenance factor.
    Maintenance,
    /// Rays of cameras.
    CameraRays,
    /// Densities of photons for caustics in images.
    CausticDensities,
    /// Light groups told apart.
    Groups,
}

impl Subject {
    /// Its words in the table of the plan.
    pub fn words(self) -> &'static str {
        match self {
            Self::Channels => "three channels",
            Self::ShadowRays => "direct light by shadow rays",
            Self::MeasuredPhotometry => "measured photometry",
            Self::EmittingFaces => "emitting faces",
            Self::Passes => "passes",
            Self::Photons => "photons",
            Self::Rays => "rays from the points",
            Self::WholeScene => "photons of the whole scene",
            Self::SpecularPaths => "specular paths",
            Self::Panes => "panes",
            Self::EverySurface => "photons of every surface",
            Self::OtherSurfaces => "photons of other surfaces",
            Self::PlanesOnSurfaces => "planes on surfaces",
            Self::PlanesInAir => "planes in the air",
            Self::Sensors => "sensors",
            Self::MeasuredSurfaces => "surfaces of the mesh",
            Self::Bodies => "cylinders and spheres",
            Self::Maintenance => "maintenance factor",
            Self::CameraRays => "camera rays",
            Self::CausticDensities => "densities of caustics",
            Self::Groups => "light groups",
        }
    }
}

/// Why something is used or left out. Materials and luminaires by name.
#[derive(Clone, Debug, PartialEq)]
pub enum Reason {
    /// This material is coloured.
    ColouredMaterial(String),
    /// This luminaire is coloured.
    ColouredLuminaire(String),
    /// No material and no luminaire is coloured.
    NothingColoured,
    /// The method computes the direct light of so many luminaires by shadow rays.
    LightSplit(Method, usize),
    /// The method counts photons for direct light, too.
    PhotonsCounted(Method),
    /// Luminaires shine by a photometric file.
    MeasuredFile {
        /// What the file is.
        source: String,
        /// How many luminaires.
        luminaires: usize,
        /// Their luminous flux, lm.
        flux: f64,
    },
    /// Faces of this material emit light.
    Emitter {
        /// Name of the luminaire that they are.
        name: String,
        /// Luminance, area and flux, in words.
        light: String,
    },
    /// So many more emitters, and their luminous flux, lm.
    MoreEmitters(usize, f64),
    /// The method leaves all light to photons.
    AllByPhotons(Method),
    /// The mesh is empty.
    NoSurface,
    /// Every surface absorbs all light.
    AllBlack,
    /// Light bounces off this material.
    LightBounces(String),
    /// The method follows light from the measured points only.
    BackwardsOnly(Method),
    /// The method has them.
    PartOf(Method),
    /// The method's rays go on from surface to surface.
    RaysGoOn(Method),
    /// The method's rays end where photons know the light.
    RaysEndOnPatches(Method),
    /// The method takes the density of photons at the points.
    DensityThere(Method),
    /// The planes cover only this share of the scene, from 0 to 1.
    SmallShare(f64),
    /// This material mirrors or refracts.
    Specular(String),
    /// No mirror and no glass.
    NothingSpecular,
    /// These materials are thin sheets of clear glass.
    PanesOf(Vec<String>),
    /// No thin sheet of clear glass.
    NoPane,
    /// The estimator of the paper keeps all photons.
    PaperKeepsAll,
    /// Photons tell the illuminance of patches.
    AsPatches,
    /// Photons are kept only at so many planes, sensors and surfaces.
    OnlyMeasured(usize),
    /// So many in the scene.
    InScene(usize),
    /// Samples on measured surfaces.
    Sampled {
        /// How many surfaces.
        surfaces: usize,
        /// How many samples on all of them.
        samples: usize,
        /// What tells their light.
        by: SampledBy,
    },
    /// So many sensors.
    SensorsWithBody(usize),
    /// No maintenance factor is given.
    NewInstallation,
    /// All luminaires have this maintenance factor.
    MaintenanceOfAll(f64),
    /// The least and the most maintenance factor of luminaires.
    MaintenanceByLuminaire([f64; 2]),
    /// No camera.
    NoCamera,
    /// Rays of cameras go on as paths with the method.
    CameraPaths(Method),
    /// Light is gathered where so many cameras look.
    GatheredWhereSeen(usize),
    /// At the surfaces that cameras see.
    SurfacesSeen,
    /// All luminaires are in one group.
    OneGroup,
    /// The method tells no groups apart.
    MethodHasNoGroups(Method),
    /// So many groups, told apart.
    GroupsApart(usize),
    /// So many groups, but nobody asked.
    GroupsNotAsked(usize),
}

/// What tells the light of samples on surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampledBy {
    /// Rays from each sample.
    Rays,
    /// Rays, and photons for caustics.
    RaysAndCaustics,
    /// Photons that land there.
    Photons,
}

impl SampledBy {
    fn words(self) -> &'static str {
        match self {
            Self::Rays => "rays from each sample",
            Self::RaysAndCaustics => "rays from each sample; caustics as photons on it, over its area",
            Self::Photons => "photons on each sample, over its area",
        }
    }
}

/// So many luminaires.
fn luminaires(count: usize) -> String {
    if count == 1 { "1 luminaire".into() } else { format!("{count} luminaires") }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let by = |f: &mut fmt::Formatter<'_>, method: Method, does: &str| write!(f, "method {} {does}", method.name());
        match self {
            Self::ColouredMaterial(name) => write!(f, "material {name} is coloured"),
            Self::ColouredLuminaire(name) => write!(f, "luminaire {name} is coloured"),
            Self::NothingColoured => f.write_str("no material and no luminaire is coloured: one does"),
            Self::LightSplit(method, number) => write!(f, "method {}, {number} luminaires", method.name()),
            Self::PhotonsCounted(method) => by(f, *method, "counts photons"),
            Self::MeasuredFile { source, luminaires: number, flux } => {
                write!(f, "{source}: {}, {flux:.0} lm in all", luminaires(*number))
            }
            Self::Emitter { name, light } => write!(f, "{name}: Ke taken as {light}"),
            Self::MoreEmitters(number, flux) => write!(f, "{number} more: {} lm in all", short(*flux)),
            Self::AllByPhotons(method) => write!(f, "method {}: all light by photons", method.name()),
            Self::NoSurface => f.write_str("no surface: light bounces off nothing"),
            Self::AllBlack => f.write_str("every surface is black: light bounces off nothing"),
            Self::LightBounces(name) => write!(f, "for light that has bounced, such as off {name}"),
            Self::BackwardsOnly(method) => by(f, *method, "follows light backwards only"),
            Self::PartOf(method) => write!(f, "method {}", method.name()),
            Self::RaysGoOn(method) => by(f, *method, "goes on from surface to surface"),
            Self::RaysEndOnPatches(method) => by(f, *method, "ends them where photons know the light"),
            Self::DensityThere(method) => by(f, *method, "takes the photons' density there"),
            Self::SmallShare(share) => {
                let share = 100.0 * share;
                write!(
                    f,
                    "planes cover {share:.2} % of the scene: `method` path `smooth` on asks only for what they see"
                )
            }
            Self::Specular(name) => write!(f, "{name} mirrors or refracts"),
            Self::NothingSpecular => f.write_str("no mirror and no glass"),
            Self::PanesOf(names) => {
                let names = listed(names.iter().map(String::as_str));
                write!(f, "{names}: light passes straight, direct light too")
            }
            Self::NoPane => f.write_str("no thin sheet of clear glass"),
            Self::PaperKeepsAll => f.write_str("the paper keeps them all"),
            Self::AsPatches => f.write_str("as illuminance of patches"),
            Self::OnlyMeasured(number) => write!(f, "kept only at one of {number} planes, sensors and surfaces"),
            Self::InScene(number) => write!(f, "{number} in the scene"),
            Self::Sampled { surfaces, samples, by } => {
                write!(f, "{surfaces} in the scene, {samples} samples; {}", by.words())
            }
            Self::SensorsWithBody(number) => write!(f, "{number} sensors"),
            Self::NewInstallation => f.write_str("none given: the installation is new"),
            Self::MaintenanceOfAll(factor) => write!(f, "{factor}"),
            Self::MaintenanceByLuminaire([least, most]) => write!(f, "{least} to {most}, by luminaire"),
            Self::NoCamera => f.write_str("no camera in the scene"),
            Self::CameraPaths(method) => {
                write!(f, "go on from surface to surface with method {}, as paths", method.name())
            }
            Self::GatheredWhereSeen(number) => {
                write!(f, "{number} in the scene; light is gathered only where they look")
            }
            Self::SurfacesSeen => f.write_str("at the surfaces that cameras see"),
            Self::OneGroup => f.write_str("one group only: all light is its own"),
            Self::MethodHasNoGroups(method) => by(f, *method, "knows none"),
            Self::GroupsApart(number) => write!(f, "{number}, told apart by the photons and rays of the whole"),
            Self::GroupsNotAsked(number) => write!(f, "{number}, not asked for: `groups`"),
        }
    }
}
