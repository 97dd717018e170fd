//! Rays against triangles, by Embree.
//!
//! [`RayCaster::build`] checks a mesh, gives it to Embree and commits it. What comes back answers queries and nothing
//! else, so what Embree forbids (a query before the commit, a change after it) can't be written.
//!
//! A ray that starts on a surface must neither hit that surface again nor slip through it. A [`Hit`] therefore lies on
//! its triangle as exactly as `f32` can say, and [`Hit::leave`] steps off it along the normal, by a millionth of the
//! coordinates' size, to the side the ray goes; the ray itself then begins at distance 0.
//!
//! Embree's library, release 4.3 or 4.4, is loaded when a `RayCaster` is first built: from the folder that `EMBREE_DIR`
//! names, if it is set; else from `../lib/luxmap` beside the program (or the shared library that luxmap is part of),
//! from the program's own folder, from where luxmap's build has found it, or from the system. Nothing is linked: what
//! depends on luxmap needs nothing to build.
//!
//! ```
//! use std::sync::Arc;
//!
//! use glam::Vec3;
//! use luxmap::embree::RayCaster;
//! use luxmap::geometry::Mesh;
//!
//! let floor = Arc::new(Mesh {
//!     vertices: vec![[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]],
//!     triangles: vec![[0, 1, 2]],
//!     material_of: vec![0],
//! });
//! let caster = RayCaster::build(&floor, 1)?;
//! let hit = caster.closest_hit(Vec3::new(1.0, 1.0, 2.7), Vec3::NEG_Z, f32::INFINITY).expect("the floor lies below");
//! assert_eq!((hit.distance, hit.normal), (2.7, Vec3::Z));
//! assert!(!caster.is_occluded(hit.leave(Vec3::Z), Vec3::Z, f32::INFINITY));
//! # Ok::<(), luxmap::error::Error>(())
//! ```

mod device;
#[cfg(test)]
mod elf;
mod folders;
mod load;
mod sys;
#[cfg(test)]
mod tests;

use std::path::Path;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use self::device::{Buffers, CommittedScene, Device};
use crate::error::Error;
use crate::geometry::Mesh;
use crate::scene::glazing::Curves;
use crate::scene::{Material, Near};

/// Step off a surface, relative to the largest coordinate of the triangle's vertices: 8 to 17 times the spacing of
/// `f32` numbers there. The hit's own coordinates won't do: on a tilted sheet whose corners lie far from the origin, 1
/// in 1000 rays that start near the origin passed through.
pub(crate) const RELATIVE_OFFSET: f32 = 1e-6;
/// Near the origin, coordinates say nothing about the scene's size: count them as this part of the extent at least.
/// That is the extent of what is [`Near`]; far triangles have coordinates that are large by themselves.
const EXTENT_FLOOR: f32 = 0.01;
/// Panes that a ray passes; behind more of them next to nothing is left of the light.
const MOST_PANES: u32 = 256;
/// Embree leaves out triangles with a coordinate beyond 1.844e18.
const LARGEST_COORDINATE: f32 = 1e18;

/// Triangles made ready for rays; any number of threads may ask at once.
///
/// Memory: the mesh itself (Embree reads its vertices and indices in place), 32 bytes a triangle of ours, and about 90
/// of Embree's.
pub struct RayCaster {
    // Dropped in this order: the scene lives on the device, and reads the buffers as long as it lives.
    scene: CommittedScene,
    device: Device,
    #[cfg_attr(not(test), expect(dead_code, reason = "Embree reads it"))]
    buffers: Buffers,
    /// One for each triangle.
    planes: Vec<TrianglePlane>,
    /// What coordinates count as at least, m, when a ray start steps off a surface.
    smallest_coordinate: f32,
    /// The largest of the mesh or, where something is far, of the triangles that come near what is measured, m.
    largest_coordinate: f32,
    /// Of each material that is a pane its transmittance; empty where there is none.
    panes: Vec<Option<Arc<Curves>>>,
}

/// Where a ray met a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index into [`Mesh::triangles`].
    pub triangle: u32,
    /// The triangle's entry in [`Mesh::material_of`].
    pub material: u32,
    /// Distance from the ray's origin, m.
    pub distance: f32,
    /// The point met, m, on the triangle's plane as exactly as `f32` can say: origin + distance · direction may be off
    /// by several times as much.
    pub position: Vec3,
    /// Unit normal of the triangle; it points to where the vertices run counter-clockwise.
    pub normal: Vec3,
    /// How far off the surface a ray starts that leaves here, m.
    pub offset: f32,
}

impl Hit {
    /// Start of a ray that leaves along `direction` (any length): off the surface, on the side `direction` points to.
    #[inline]
    pub fn leave(&self, direction: Vec3) -> Vec3 {
        self.position + self.normal * self.offset.copysign(self.normal.dot(direction))
    }
}

impl RayCaster {
    /// Makes a mesh ready for rays, with `threads` (at least 1) of Embree's own build threads.
    ///
    /// Embree silently leaves out a triangle whose index or coordinate is bad, and a missing wall only darkens the
    /// room; so such a mesh is refused here. A mesh without triangles is fine: no ray ever hits it. Cost: 3–5 s for 4.5
    /// million triangles on two threads.
    pub fn build(mesh: &Arc<Mesh>, threads: usize) -> Result<Self, Error> {
        Self::build_near(mesh, &Near::everything(), threads)
    }

    /// The same, where only what is `near` tells how large the scene is.
    pub fn build_near(mesh: &Arc<Mesh>, near: &Near, threads: usize) -> Result<Self, Error> {
        check(mesh)?;
        let device = Device::new(threads.max(1))?;
        let buffers = Buffers::of(mesh);
        let scene = CommittedScene::commit(&device, &buffers)?;
        let smallest = EXTENT_FLOOR * extent(mesh, near);
        let planes = mesh.triangles.par_iter().zip(&mesh.material_of).map(|(triangle, &material)| {
            TrianglePlane::through(
                triangle.map(|vertex| Vec3::from(mesh.vertices[vertex as usize])),
                smallest,
                material,
            )
        });
        let planes = planes.collect();
        let largest_coordinate = largest_coordinate(mesh, near);
        let (smallest_coordinate, panes) = (smallest, Vec::new());
        Ok(Self { scene, device, buffers, planes, smallest_coordinate, largest_coordinate, panes })
    }

    /// The same, knowing which of the mesh's materials are panes that light passes straight.
    pub fn with_panes(mut self, materials: &[Material]) -> Self {
        let curves = |material: &Material| material.glazing.as_ref().map(|pane| Arc::new(Curves::of(pane)));
        self.panes = materials.iter().map(curves).collect();
        if self.panes.iter().all(Option::is_none) {
            self.panes.clear();
        }
        self
    }

    /// Transmittance of a material that is a pane.
    #[inline]
    pub(crate) fn pane(&self, material: u32) -> Option<&Curves> {
        self.panes.get(material as usize)?.as_deref()
    }

    /// Whether any material is a pane.
    pub(crate) fn has_panes(&self) -> bool {
        !self.panes.is_empty()
    }

    /// First surface met from `origin` (m) along the unit vector `direction`, no farther than `max_distance` (m).
    /// Both sides of a triangle count. Cost: 0.15–0.2 µs in a room of some hundred triangles.
    #[inline]
    pub fn closest_hit(&self, origin: Vec3, direction: Vec3, max_distance: f32) -> Option<Hit> {
        self.query(origin, direction, max_distance).map(|query| self.hit(&query))
    }

    /// The same by Embree's own answer alone: the triangle's index and the distance from `origin`, m. Cost: what Embree
    /// takes; `benches/large.rs` holds everything else against it.
    #[inline]
    pub fn closest_triangle(&self, origin: Vec3, direction: Vec3, max_distance: f32) -> Option<(u32, f32)> {
        self.query(origin, direction, max_distance).map(|query| (query.hit.primID, query.ray.tfar))
    }

    /// Whether anything lies between `origin` (m) and the point `max_distance` (m) away along the unit vector
    /// `direction`. To ask for a point that lies on a surface, stop a little before it. Cost: below that of
    /// [`closest_hit`](Self::closest_hit).
    #[inline]
    pub fn is_occluded(&self, origin: Vec3, direction: Vec3, max_distance: f32) -> bool {
        let mut query = ray(origin, direction, max_distance);
        self.scene.occluded(&mut query);
        query.tfar == f32::NEG_INFINITY // Embree's sign for "something was hit"
    }

    /// Share of light of each channel (linear Rec. 709) that passes straight from `origin` (m) to the point
    /// `max_distance` (m) away along the unit vector `direction`: 0 where something opaque is in between, 1 where
    /// nothing is. Cost: that of [`is_occluded`](Self::is_occluded), and behind panes a
    /// [`closest_hit`](Self::closest_hit) each.
    #[inline]
    pub fn transmittance(&self, origin: Vec3, direction: Vec3, max_distance: f32) -> [f32; 3] {
        if !self.is_occluded(origin, direction, max_distance) {
            return [1.0; 3];
        }
        if self.panes.is_empty() {
            return [0.0; 3];
        }
        let (opaque, passed) = self.through_panes(origin, direction, max_distance);
        if opaque.is_some() { [0.0; 3] } else { passed }
    }

    /// First surface met that is not a pane, and the share of light that the panes before it let pass.
    pub(crate) fn through_panes(
        &self,
        mut origin: Vec3,
        direction: Vec3,
        max_distance: f32,
    ) -> (Option<Hit>, [f32; 3]) {
        let (mut left, mut passed) = (max_distance, [1.0; 3]);
        for _ in 0..MOST_PANES {
            let Some(hit) = self.closest_hit(origin, direction, left) else { return (None, passed) };
            let Some(curves) = self.pane(hit.material) else { return (Some(hit), passed) };
            let [through, _] = curves.at(direction.dot(hit.normal));
            (0..3).for_each(|c| passed[c] *= through[c]);
            left -= hit.distance;
            origin = hit.leave(direction);
        }
        (None, [0.0; 3])
    }

    /// A point (m) of a surface, moved off it along its unit `normal` as [`Hit::leave`] would. `largest_coordinate` (m)
    /// is that of the surface's corners and of the other end of the ray: either's rounding can put the surface in the
    /// way.
    #[inline]
    pub fn step_off(&self, point: Vec3, normal: Vec3, largest_coordinate: f32) -> Vec3 {
        point + normal * (RELATIVE_OFFSET * largest_coordinate.max(self.smallest_coordinate))
    }

    /// How far rays start off any surface at most, m, at a point or near what is measured.
    pub fn longest_step(&self, point: Vec3) -> f32 {
        let largest = self.largest_coordinate.max(self.smallest_coordinate);
        RELATIVE_OFFSET * largest.max(point.abs().max_element())
    }

    /// The most memory Embree has held at any time since the build began, bytes. Vertices and indices come on top.
    pub fn peak_memory(&self) -> u64 {
        self.device.peak_memory()
    }

    /// What Embree answers, if anything was hit.
    #[inline]
    fn query(&self, origin: Vec3, direction: Vec3, max_distance: f32) -> Option<sys::RTCRayHit> {
        let mut query = sys::RTCRayHit { ray: ray(origin, direction, max_distance), hit: sys::RTCHit::default() };
        query.hit.geomID = sys::RTC_INVALID_GEOMETRY_ID;
        query.hit.instID[0] = sys::RTC_INVALID_GEOMETRY_ID;
        self.scene.closest_hit(&mut query);
        (query.hit.geomID != sys::RTC_INVALID_GEOMETRY_ID).then_some(query)
    }

    #[inline]
    fn hit(&self, query: &sys::RTCRayHit) -> Hit {
        let sys::RTCRay { org_x, org_y, org_z, dir_x, dir_y, dir_z, tfar, .. } = query.ray;
        let plane = &self.planes[query.hit.primID as usize];
        Hit {
            triangle: query.hit.primID,
            material: plane.material,
            distance: tfar,
            position: plane.snap(Vec3::new(org_x, org_y, org_z) + tfar * Vec3::new(dir_x, dir_y, dir_z)),
            normal: plane.normal,
            offset: plane.offset,
        }
    }
}

/// File of the Embree library that rays use; a bare name where the system has found it. Loads it, if that was not done.
pub fn library() -> Result<&'static Path, Error> {
    device::library()
}

/// What a hit needs to know of its triangle, in half a cache line: fetching index and vertices instead makes rays about
/// a tenth slower.
#[repr(align(32))]
struct TrianglePlane {
    /// Unit normal.
    normal: Vec3,
    /// How far off the triangle a ray starts, m.
    offset: f32,
    /// Of the plane along `normal` as rounded to `f32`, mean of the three vertices, m.
    height: f64,
    material: u32,
}

impl TrianglePlane {
    /// The plane of a triangle whose coordinates count as `smallest` (m) at least.
    fn through([a, b, c]: [Vec3; 3], smallest: f32, material: u32) -> Self {
        let size = a.abs().max(b.abs()).max(c.abs()).max_element().max(smallest);
        let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
        // A triangle too thin for a normal is a line: any direction across it will do.
        let along = if b == a { c - a } else { b - a }.normalize_or(DVec3::X);
        let normal = (b - a).cross(c - a).normalize_or(along.any_orthonormal_vector()).as_vec3();
        Self { normal, offset: RELATIVE_OFFSET * size, height: normal.as_dvec3().dot(a + b + c) / 3.0, material }
    }

    /// The point of the plane nearest to a point beside it.
    #[inline]
    fn snap(&self, point: Vec3) -> Vec3 {
        let above = self.normal.as_dvec3().dot(point.as_dvec3()) - self.height;
        point - self.normal * above as f32
    }
}

/// A ray as Embree wants it, from distance 0 on.
#[inline]
fn ray(origin: Vec3, direction: Vec3, max_distance: f32) -> sys::RTCRay {
    sys::RTCRay {
        org_x: origin.x,
        org_y: origin.y,
        org_z: origin.z,
        dir_x: direction.x,
        dir_y: direction.y,
        dir_z: direction.z,
        tfar: max_distance,
        mask: u32::MAX,
        ..Default::default() // zeros: tnear, time, id and flags
    }
}

/// Refuses what Embree would leave out without a word.
fn check(mesh: &Mesh) -> Result<(), Error> {
    let refuse = |sentence| Err(Error::Embree(sentence));
    let usable = |coordinate: &f32| coordinate.abs() <= LARGEST_COORDINATE; // false for NaN
    if let Some(bad) = mesh.vertices.par_iter().position_first(|vertex| !vertex.iter().all(usable)) {
        let [x, y, z] = mesh.vertices[bad];
        return refuse(format!(
            "vertex {bad} lies at ({x}, {y}, {z}); expected finite numbers up to {LARGEST_COORDINATE:e} m"
        ));
    }
    if mesh.vertices.len() > u32::MAX as usize || mesh.triangles.len() >= u32::MAX as usize {
        let (vertices, triangles) = (mesh.vertices.len(), mesh.triangles.len());
        return refuse(format!("found {vertices} vertices and {triangles} triangles; expected fewer than 2³² of each"));
    }
    if mesh.material_of.len() != mesh.triangles.len() {
        let (materials, triangles) = (mesh.material_of.len(), mesh.triangles.len());
        return refuse(format!("found materials of {materials} triangles; expected of {triangles}"));
    }
    let known = mesh.vertices.len();
    let outside = |&vertex: &u32| vertex as usize >= known;
    let stranger = |corners: &[u32; 3]| corners.iter().copied().find(outside);
    match mesh.triangles.par_iter().enumerate().find_map_first(|(i, corners)| Some((i, stranger(corners)?))) {
        Some((triangle, vertex)) => {
            refuse(format!("triangle {triangle} names vertex {vertex}, but the mesh has {known}, counted from 0"))
        }
        None => Ok(()),
    }
}

/// Longest side of the box around all vertices, as far as they are near, m; 0 if there are none.
fn extent(mesh: &Mesh, near: &Near) -> f32 {
    let vertices = || mesh.vertices.iter().map(|&vertex| near.clamp(Vec3::from(vertex).as_dvec3()).as_vec3());
    let highest = vertices().reduce(Vec3::max).unwrap_or_default();
    let lowest = vertices().reduce(Vec3::min).unwrap_or_default();
    (highest - lowest).max_element()
}

/// Largest coordinate of the mesh or, where something is far, of the triangles that come near what is measured, m.
fn largest_coordinate(mesh: &Mesh, near: &Near) -> f32 {
    let largest = |corner: Vec3| corner.abs().max_element();
    if !near.is_cut() {
        return mesh.vertices.iter().map(|&vertex| largest(Vec3::from(vertex))).fold(0.0, f32::max);
    }
    let comes_near = (0..mesh.triangles.len()).filter(|&triangle| near.reaches_core(mesh.corners(triangle)));
    let corners = comes_near.flat_map(|triangle| mesh.corners(triangle));
    corners.map(|corner| largest(corner.as_vec3())).fold(0.0, f32::max)
}
