//! What a user ought to know about a run: data, and the words for them.

use std::fmt;

use crate::gather::witness::Contradiction;
use crate::text::number::fine_percent;

/// A warning of a run. Names are those of the scene.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Warning {
    /// Found elsewhere, in words.
    InWords(String),
    /// Points of a plane on surfaces have no surface there.
    NoSurface { plane: String, missed: usize, of: usize, tolerance: f32 },
    /// No point of a plane has a value.
    DarkPlane { plane: String, points: usize },
    /// No sample of a surface has a value.
    DarkSurface { surface: String },
    /// No photon came near some points; `radius` is how far they were looked for, m.
    NoPhoton { at: At, points: usize, of: usize, radius: f32 },
    /// Photons bring light that rays hardly find, lx.
    Contradicted { at: At, photons: f64, rays: f64 },
    /// Paths never meet a luminaire without extent.
    PathsMissPoints,
    /// Paths meet small luminaires by chance.
    PathsByChance,
    /// Single precision is too coarse for the scene: its reach, how far rays start off surfaces, smallest detail, m.
    CoarseRays { reach: f64, step: f64, detail: f64 },
    /// The same for one luminaire: how far away it is, how far rays start off surfaces there, its opening, m.
    FarLuminaire { luminaire: String, away: f64, step: f64, size: f64 },
    /// This part of the flux was cut off after so many bounces.
    CutOff { part: f64, bounces: u32, in_glass: bool },
    /// Too few photons to tell an error.
    FewPhotons(u64),
    /// A luminaire without extent is so near to what is measured, m.
    LuminaireAtPoint { luminaire: String, distance: f64 },
    /// Direct light alone has a larger standard error than `wanted`, both %.
    DirectUncertain { wanted: f64, error: f64 },
    /// A checkpoint could not be written, and why.
    Checkpoint(String),
    /// A plane in bands has a larger standard error than `wanted`, both %.
    BandsUncertain { plane: String, error: f64, wanted: f64 },
}

/// Where something was found.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum At {
    Plane(String),
    Sensors,
    Surface(String),
}

impl Warning {
    /// That photons and rays contradict each other.
    pub(super) fn of(at: At, contradiction: Contradiction) -> Self {
        let Contradiction { photons, rays } = contradiction;
        Self::Contradicted { at, photons, rays }
    }
}

impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plane(name) => write!(f, "plane \"{name}\""),
            Self::Sensors => f.write_str("sensors"),
            Self::Surface(name) => write!(f, "surface \"{name}\""),
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::InWords(words) => f.write_str(words),
            Self::NoSurface { plane, missed, of, tolerance } => write!(
                f,
                "plane \"{plane}\": {missed} of {of} points have no surface within {:.1} mm; expected on = \"air\" \
                 there",
                1e3 * tolerance,
            ),
            Self::DarkPlane { plane, points } => write!(
                f,
                "plane \"{plane}\": no light can arrive at any of its {points} points; along × across points to the \
                 measured side, and some luminaire has to shine into the same space",
            ),
            Self::DarkSurface { surface } => write!(
                f,
                "surface \"{surface}\": no light can arrive at any sample; side = \"front\" is the one from which \
                 vertices run counter-clockwise, and some luminaire has to shine into the same space",
            ),
            Self::NoPhoton { at, points, of, radius } => no_photon(f, at, *points, *of, *radius),
            Self::Contradicted { at, photons, rays } => write!(
                f,
                "{at}: photons bring {photons:.3e} lx to a part of it where rays found {rays:.3e} lx: light comes \
                 through openings, or from places, that rays rarely meet; the standard errors there hold the \
                 difference; method split finds such light",
            ),
            Self::PathsMissPoints => f.write_str(
                "method path never meets a luminaire without extent in a mirror or behind glass: that light is \
                 missing; expected another method, or an opening",
            ),
            Self::PathsByChance => f.write_str(
                "method path meets small luminaires in mirrors and glass only by chance: caustics may be wrong by more \
                 than is claimed; expected another method",
            ),
            Self::CoarseRays { reach, step, detail } => write!(
                f,
                "the scene reaches {reach:.3e} m from its middle, so rays start {step:.1e} m off surfaces; expected \
                 less than a tenth of the smallest opening or cell, {detail:.1e} m: is something far away, or a unit \
                 wrong?",
            ),
            Self::FarLuminaire { luminaire, away, step, size } => write!(
                f,
                "luminaire \"{luminaire}\" hangs {away:.3e} m from what is measured, where rays start {step:.1e} m off \
                 surfaces; expected less than a tenth of its opening, {size:.1e} m: is it too far away, or a unit \
                 wrong?",
            ),
            Self::CutOff { part, bounces, in_glass } => cut_off(f, *part, *bounces, *in_glass),
            Self::FewPhotons(photons) => write!(
                f,
                "light that has bounced rests on {photons} photons: what errors are claimed can't be trusted; expected \
                 some thousands at least",
            ),
            Self::LuminaireAtPoint { luminaire, distance } => write!(
                f,
                "luminaire \"{luminaire}\" has no extent and hangs {distance:.1e} m from a point that is measured: \
                 illuminance there has no bound, and what is found depends on rounding; expected an opening, or \
                 another place",
            ),
            Self::DirectUncertain { wanted, error } => write!(
                f,
                "`error` {wanted}: direct light at shadows' edges alone is uncertain by {error:.3} %, and passes do \
                 not mend it",
            ),
            Self::Checkpoint(error) => {
                write!(f, "checkpoint: {error}; should the run end early, passes since the last one are lost")
            }
            Self::BandsUncertain { plane, error, wanted } => write!(
                f,
                "plane \"{plane}\": the passes that its middle needs leave a standard error of {error:.2} % in all, \
                 asked for {wanted} %; more come with `passes`",
            ),
        }
    }
}

/// That photons are missing at points, in words.
fn no_photon(f: &mut fmt::Formatter<'_>, at: &At, points: usize, of: usize, radius: f32) -> fmt::Result {
    const DARK: &str = "that part of their light reads 0; expected more photons or a";
    match at {
        At::Plane(_) => {
            write!(f, "{at}: {points} of {of} points have no photon within {radius} m: {DARK} larger radius")
        }
        At::Sensors => write!(f, "{points} of {of} sensors have no photon within {radius} m: {DARK} larger radius"),
        At::Surface(_) => write!(f, "{at}: no photon landed on {points} of {of} samples: {DARK} wider spacing"),
    }
}

/// That flux was cut off, in words.
fn cut_off(f: &mut fmt::Formatter<'_>, part: f64, bounces: u32, in_glass: bool) -> fmt::Result {
    let percent = fine_percent(part);
    write!(f, "{percent} % of the flux was still under way after {bounces} bounces and was cut off: ")?;
    f.write_str(match in_glass {
        true => "nearly all of it is trapped in glass that absorbs nothing, where it lights nothing",
        false => "illuminance is too low",
    })
}
