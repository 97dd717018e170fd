//! What shines: its place, its opening, its flux and how that is spread over directions.

pub(crate) mod colour;
pub mod emit;
pub(crate) mod frame;
pub mod intensity;
pub mod photometry;

use glam::DVec3;

use crate::units::Lumens;

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
}

/// The luminous opening, local coordinates, m. Light leaves the front only.
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
    /// Triangles of the scene's mesh, uniformly bright, counter-clockwise seen from where light goes.
    Triangles(Vec<[DVec3; 3]>),
}

impl Opening {
    /// Its middle, m; of a mesh, that of its first triangle.
    pub fn middle(&self) -> DVec3 {
        match self {
            Self::Point { position, .. } => *position,
            Self::Rectangle { centre, .. } | Self::Disc { centre, .. } => *centre,
            Self::Triangles(triangles) => {
                triangles.first().map_or(DVec3::ZERO, |corners| corners.iter().sum::<DVec3>() / 3.0)
            }
        }
    }
}

/// Luminous intensity over directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distribution {
    /// The same intensity everywhere, Φ/(4π); points only.
    Isotropic,
    /// Intensity ∝ cos of the angle from the aim.
    Lambertian,
}
