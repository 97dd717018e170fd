//! What shines: its place, its opening, its flux and how that is spread over directions.

pub(crate) mod colour;
pub(crate) mod frame;
pub mod groups;
pub mod intensity;
pub(crate) mod outline;
pub mod photometry;
mod supply;
pub mod web;

use std::f64::consts::PI;

use glam::DVec3;

use self::web::Measured;
use crate::geometry::body::Body;
use crate::units::Lumens;
pub use groups::LightGroups;
pub use supply::Supply;
pub(crate) use supply::along;

/// A luminaire, or a material of the mesh that emits.
#[derive(Clone, Debug)]
pub struct Luminaire {
    /// Its name; `L[1,2]` for the members of an array.
    pub name: String,
    /// Its light group.
    pub group: String,
    /// Luminous flux as dimmed, lm; greater than 0.
    pub flux: Lumens,
    /// Linear Rec. 709 colour of luminance 1: channel c carries flux · colour\[c\].
    pub colour: [f64; 3],
    /// Whence light leaves.
    pub opening: Opening,
    /// How it spreads.
    pub distribution: Distribution,
    /// Triangles of the scene's mesh that stand for the opening; none for a point.
    pub body: Vec<u32>,
    /// What it draws, and how far it dims.
    pub supply: Supply,
}

/// The luminous opening, local coordinates, m. Light leaves the front only; where the distribution is measured, it
/// leaves flat openings on both sides, as it says.
#[derive(Clone, Debug)]
pub enum Opening {
    /// No extent.
    Point {
        /// Where.
        position: DVec3,
        /// Unit vector of the nadir.
        aim: DVec3,
    },
    /// A flat rectangle.
    Rectangle {
        /// Its middle.
        centre: DVec3,
        /// From the middle to the middle of one side.
        half_width: DVec3,
        /// From the middle to the middle of the next side; half_width × half_depth points where light goes.
        half_depth: DVec3,
    },
    /// A flat disc.
    Disc {
        /// Its middle.
        centre: DVec3,
        /// Unit vector where light goes.
        aim: DVec3,
        /// Radius, m.
        radius: f64,
    },
    /// A flat ellipse.
    Ellipse {
        /// Its middle.
        centre: DVec3,
        /// From the middle to the rim along one axis.
        half_width: DVec3,
        /// From the middle to the rim along the other; half_width × half_depth points where light goes.
        half_depth: DVec3,
    },
    /// A convex body that shines all around.
    Body(Body),
    /// Triangles of the scene's mesh, uniformly bright, counter-clockwise seen from where light goes.
    Triangles(Vec<[DVec3; 3]>),
}

impl Opening {
    /// Its middle, m; of a mesh, that of its first triangle.
    pub fn middle(&self) -> DVec3 {
        match self {
            Self::Point { position, .. } => *position,
            Self::Rectangle { centre, .. } | Self::Ellipse { centre, .. } | Self::Disc { centre, .. } => *centre,
            Self::Body(body) => body.centre,
            Self::Triangles(triangles) => {
                triangles.first().map_or(DVec3::ZERO, |corners| corners.iter().sum::<DVec3>() / 3.0)
            }
        }
    }

    /// Its smallest side, m; infinite for a point and a mesh.
    pub(crate) fn smallest_side(&self) -> f64 {
        match self {
            Self::Rectangle { half_width, half_depth, .. } | Self::Ellipse { half_width, half_depth, .. } => {
                2.0 * half_width.length().min(half_depth.length())
            }
            Self::Body(body) => 2.0 * body.half_axes.iter().map(|axis| axis.length()).fold(f64::INFINITY, f64::min),
            Self::Disc { radius, .. } => 2.0 * radius,
            Self::Point { .. } | Self::Triangles(_) => f64::INFINITY,
        }
    }

    /// Area of a flat opening and its unit normal; nothing for a point, a body and a mesh.
    pub(crate) fn flat(&self) -> Option<(f64, DVec3)> {
        let of = |cross: DVec3, times: f64| Some((times * cross.length(), cross.normalize()));
        match self {
            Self::Rectangle { half_width, half_depth, .. } => of(half_width.cross(*half_depth), 4.0),
            Self::Ellipse { half_width, half_depth, .. } => of(half_width.cross(*half_depth), PI),
            Self::Disc { aim, radius, .. } => Some((PI * radius * radius, *aim)),
            Self::Point { .. } | Self::Body(_) | Self::Triangles(_) => None,
        }
    }
}

/// Luminous intensity over directions.
#[derive(Clone, Debug, PartialEq)]
pub enum Distribution {
    /// The same intensity everywhere, Φ/(4π); points only.
    Isotropic,
    /// Intensity ∝ cos of the angle from the aim; bodies and meshes are uniformly bright.
    Lambertian,
    /// As measured. Towards each direction all of the opening that is seen from there has the same luminance: intensity
    /// over the area seen.
    Measured(Measured),
}

/// The least that a luminaire gets of all photons, as a part of an even share.
const LEAST_SHARE: f64 = 0.1;

/// The part of all photons, or of all points drawn on luminaires, that each luminaire gets; and what each of them is to
/// be multiplied by, so that its flux stays its own.
///
/// Shares are those of the flux, factors 1, where no luminaire has less than a tenth of the mean flux. Else none gets
/// less than that: a luminaire that is a thousand million times fainter than another may still be the only one in its
/// room.
pub(crate) fn drawn_shares(luminaires: &[Luminaire]) -> Vec<(f64, f64)> {
    let total: f64 = luminaires.iter().map(|luminaire| luminaire.flux.0).sum();
    let shares = luminaires.iter().map(|luminaire| luminaire.flux.0 / total);
    let least = LEAST_SHARE / luminaires.len() as f64;
    if shares.clone().all(|share| share >= least) {
        return shares.map(|share| (share, 1.0)).collect();
    }
    let whole: f64 = shares.clone().map(|share| share.max(least)).sum();
    shares.map(|share| (share.max(least) / whole, share / (share.max(least) / whole))).collect()
}

impl Luminaire {
    /// Its measured distribution, if it has one.
    pub fn measured(&self) -> Option<&Measured> {
        match &self.distribution {
            Distribution::Measured(measured) => Some(measured),
            _ => None,
        }
    }
}
