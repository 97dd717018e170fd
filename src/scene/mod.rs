//! The scene: what stands in the room, what shines, where light is measured. Validated, in metres, recentred.
//!
//! Everything here is relative to [`Scene::centre`], the middle of the world's bounding box (or, where something lies
//! far off, of what is measured: see [`near`]): survey coordinates of 1e6 m would leave single precision a grid of 6
//! cm. World position = local position + centre.

pub mod areas;
mod assemble;
pub(crate) mod builder;
mod camera;
mod dialect;
mod double_faces;
pub(crate) mod emitters;
mod fallback;
pub(crate) mod fields;
pub mod file;
mod fixture;
mod glass;
pub mod glazing;
pub mod inventory;
mod lamps;
mod levels;
mod library;
mod lines;
pub mod material;
pub mod measure;
pub mod measured;
mod mtl;
mod mtl_files;
pub mod near;
mod obj;
mod parts;
mod placed;
mod read;
mod surface;
mod texture;

use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;

use crate::geometry::Mesh;
use crate::luminaire::Luminaire;
use crate::options::Options;
pub use areas::Areas;
pub use assemble::{Dimming, LoadOptions};
pub use builder::{Lamp, Reflectance, SceneBuilder};
pub use camera::Camera;
pub use glazing::Glazing;
pub use inventory::{MeshPart, Origin};
pub use levels::Levels;
pub use material::{Dielectric, Material, Sides};
pub use measure::Measure;
pub use measured::MeasuredSurface;
pub use near::Near;
#[doc(hidden)]
pub use obj::blocks::read_obj_both_ways;

/// A validated scene, ready to be traced.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Its name; the file's stem where the file gives none.
    pub name: String,
    /// The scene file.
    pub file: PathBuf,
    /// SHA-256 over the scene file and every file it names, hexadecimal.
    pub hash: String,
    /// World position of the local origin, m.
    pub centre: DVec3,
    /// The surroundings of what is measured, local: what counts for the scene's size.
    pub near: Near,
    /// Every triangle, bodies of luminaire openings included.
    pub mesh: Arc<Mesh>,
    /// What [`Mesh::material_of`] points to.
    pub materials: Vec<Material>,
    /// Who says what each of them is.
    pub origins: Vec<Origin>,
    /// The mesh files, and which triangles are theirs.
    pub parts: Vec<MeshPart>,
    /// What shines: the scene file's luminaires, arrays spread out, then emitting meshes.
    pub luminaires: Vec<Luminaire>,
    /// Measuring planes.
    pub planes: Vec<MeasuringPlane>,
    /// Measuring points.
    pub sensors: Vec<Sensor>,
    /// Cameras.
    pub cameras: Vec<Camera>,
    /// Faces of the mesh that are measured themselves.
    pub surfaces: Vec<MeasuredSurface>,
    /// Smallest and largest maintenance factor of the luminaires, which their flux includes; `None` where the file
    /// gives none: illuminance of the new installation.
    pub maintenance_factor: Option<[f64; 2]>,
    /// Options of `render` that the file sets.
    pub render: Options,
    /// What was dropped or looks wrong, in words.
    pub warnings: Vec<String>,
}

impl Scene {
    /// Diagonal of the box around the mesh, the luminaires, the measuring planes and the sensors, as far as they are
    /// [`near`](Self::near), m. Cost: O(vertices).
    pub fn diagonal(&self) -> f64 {
        let (low, high) = self.bounds();
        low.distance(high)
    }

    /// Largest local coordinate of what is [`near`](Self::near), m: what single precision has to resolve details
    /// against. Cost: O(vertices).
    pub fn half_extent(&self) -> f64 {
        let (low, high) = self.bounds();
        low.abs().max(high.abs()).max_element()
    }

    /// Smallest side of any opening or cell, m; infinite where there is neither.
    pub fn smallest_detail(&self) -> f64 {
        let cells = self.planes.iter().flat_map(|plane| {
            [plane.along.length() / plane.cells[0] as f64, plane.across.length() / plane.cells[1] as f64]
        });
        let openings = self.luminaires.iter().map(|luminaire| luminaire.opening.smallest_side());
        cells.chain(openings).fold(f64::INFINITY, f64::min)
    }

    /// Area of all measuring planes and surfaces as a share of the largest face of the box around everything
    /// [`near`](Self::near). Cost: O(vertices).
    pub fn measured_share(&self) -> f64 {
        let (low, high) = self.bounds();
        let size = high - low;
        let face = (size.x * size.y).max(size.y * size.z).max(size.z * size.x);
        let planes: f64 = self.planes.iter().map(|plane| plane.along.cross(plane.across).length()).sum();
        let surfaces: f64 = self.surfaces.iter().map(MeasuredSurface::area).sum();
        let measured = planes + surfaces;
        if face > 0.0 && measured > 0.0 { measured / face } else { 1.0 }
    }

    /// Lowest and highest corner of the box around everything, where what is far counts as at the surroundings' end;
    /// zeros for a scene of nothing.
    fn bounds(&self) -> (DVec3, DVec3) {
        let vertices = self.mesh.vertices.iter().map(|&[x, y, z]| DVec3::new(x.into(), y.into(), z.into()));
        let planes = self.planes.iter().flat_map(|plane| {
            [DVec3::ZERO, plane.along, plane.across, plane.along + plane.across].map(|side| plane.corner + side)
        });
        let sensors = self.sensors.iter().map(|sensor| sensor.position);
        let luminaires = self.luminaires.iter().map(|luminaire| luminaire.opening.middle());
        let all = vertices.chain(planes).chain(luminaires).chain(sensors);
        all.map(|point| self.near.clamp(point))
            .map(|point| (point, point))
            .reduce(|(low, high), (point, _)| (low.min(point), high.max(point)))
            .unwrap_or_default()
    }
}

/// Where the light of a measuring plane is met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlaneKind {
    /// The plane lies on geometry.
    Surface,
    /// The plane is virtual: photons pass through it.
    Air,
}

/// A rectangle of grid points; the light measured is what arrives on the side of along × across.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuringPlane {
    /// Name of the plane and of its files.
    pub name: String,
    /// Corner of the first cell, local, m.
    pub corner: DVec3,
    /// Whole length of the columns' direction (image x), m.
    pub along: DVec3,
    /// Whole length of the rows' direction (image y), m; at a right angle to `along`.
    pub across: DVec3,
    /// Number of cells along and across; the grid points are their centres.
    pub cells: [usize; 2],
    /// On geometry or in the air.
    pub kind: PlaneKind,
    /// Parts of it that have figures of their own.
    pub areas: Areas,
}

impl MeasuringPlane {
    /// Its corners, m.
    pub(crate) fn corners(&self) -> [DVec3; 4] {
        let Self { corner, along, across, .. } = *self;
        [corner, corner + along, corner + across, corner + along + across]
    }

    /// Unit normal of the measured side.
    pub fn normal(&self) -> DVec3 {
        self.along.cross(self.across).normalize()
    }

    /// Number of grid points.
    pub fn len(&self) -> usize {
        self.cells[0] * self.cells[1]
    }

    /// Whether the plane has no grid point; a validated one always has.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Grid point `index` (row by row from the corner), local, m.
    pub fn point(&self, index: usize) -> DVec3 {
        let (column, row) = (index % self.cells[0], index / self.cells[0]);
        let share = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
        self.corner + self.along * share(column, self.cells[0]) + self.across * share(row, self.cells[1])
    }
}

/// A measuring point with a direction, such as a lux meter on a desk.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// Its name.
    pub name: String,
    /// Local position, m.
    pub position: DVec3,
    /// Unit normal of the measured side; the axis where a body is measured.
    pub normal: DVec3,
    /// What the illuminance is the mean over.
    pub measure: Measure,
    /// Diameter of the flat disc that E is the mean over, m; a point where not given.
    pub disc: Option<f64>,
    /// Illuminance the user there asks for, lx.
    pub target: Option<f64>,
    /// How much above the target is still welcome, lx; any amount where not given.
    pub tolerance: Option<f64>,
    /// What arrives there besides the luminaires' light, lx: dimming takes it into account, no result of a render
    /// contains it.
    pub daylight: f64,
}
