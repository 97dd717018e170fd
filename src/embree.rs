//! Rays against triangles, by Embree.
//!
//! [`RayCaster::build`] checks a mesh, hands it to Embree and commits it. What comes back answers queries and nothing
//! else, so what Embree forbids (a query before the commit, a change after it) can't be written.
//!
//! A ray that starts on a surface must neither hit that surface again nor slip through it. A [`Hit`] therefore lies on
//! its triangle as exactly as `f32` can say, and [`Hit::leave`] steps off it along the normal, by a millionth of the
//! coordinates' size, to the side the ray goes; the ray itself then begins at distance 0.
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
#![allow(unsafe_code, reason = "Embree is a C library; every call to it is in this file")]

use std::ffi::{CString, c_void};
use std::ptr;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::error::Error;
use crate::geometry::Mesh;
use crate::scene::glazing::Curves;
use crate::scene::{Material, Near};

/// Step off a surface, relative to the largest coordinate of the triangle's vertices: 8 to 17 times the spacing of `f32`
/// numbers there. The hit's own coordinates won't do: on a tilted sheet whose corners lie far from the origin, 1 in 1000
/// rays that start near the origin passed through.
pub(crate) const RELATIVE_OFFSET: f32 = 1e-6;
/// Near the origin, coordinates say nothing about the scene's size: count them as this part of the extent at least. That is
/// the extent of what is [`Near`]; far triangles have coordinates that are large by themselves.
const EXTENT_FLOOR: f32 = 0.01;
/// Panes that a ray passes; behind more of them next to nothing is left of the light.
const MOST_PANES: u32 = 256;
/// Embree leaves out triangles with a coordinate beyond 1.844e18.
const LARGEST_COORDINATE: f32 = 1e18;

/// Triangles made ready for rays; any number of threads may ask at once.
///
/// Memory: the mesh itself (Embree reads its vertices and indices in place), 32 bytes a triangle of ours, and about 90 of
/// Embree's.
pub struct RayCaster {
    // Dropped in this order: the scene lives on the device, and reads the buffers as long as it lives.
    scene: Scene,
    device: Device,
    #[cfg_attr(not(test), expect(dead_code, reason = "Embree reads it"))]
    buffers: Buffers,
    /// One for each triangle.
    planes: Vec<Plane>,
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
    /// Embree silently leaves out a triangle whose index or coordinate is bad, and a missing wall only darkens the room;
    /// so such a mesh is refused here. A mesh without triangles is fine: no ray ever hits it.
    /// Cost: 3–5 s for 4.5 million triangles on two threads.
    pub fn build(mesh: &Arc<Mesh>, threads: usize) -> Result<Self, Error> {
        Self::build_near(mesh, &Near::everything(), threads)
    }

    /// The same, where only what is `near` tells how large the scene is.
    pub fn build_near(mesh: &Arc<Mesh>, near: &Near, threads: usize) -> Result<Self, Error> {
        check(mesh)?;
        let device = Device::new(threads.max(1))?;
        let buffers = Buffers::of(mesh);
        let scene = Scene::commit(&device, &buffers)?;
        let smallest = EXTENT_FLOOR * extent(mesh, near);
        let planes = mesh.triangles.par_iter().zip(&mesh.material_of).map(|(triangle, &material)| {
            Plane::through(triangle.map(|vertex| Vec3::from(mesh.vertices[vertex as usize])), smallest, material)
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
        // SAFETY: the scene is committed for as long as `self` lives.
        unsafe { sys::occluded(self.scene.0, &mut query) };
        query.tfar == f32::NEG_INFINITY // Embree's sign for "something was hit"
    }

    /// Share of light of each channel (linear Rec. 709) that passes straight from `origin` (m) to the point `max_distance` (m)
    /// away along the unit vector `direction`: 0 where something opaque is in between, 1 where nothing is. Cost: that of
    /// [`is_occluded`](Self::is_occluded), and behind panes a [`closest_hit`](Self::closest_hit) each.
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

    /// A point (m) of a surface, moved off it along its unit `normal` as [`Hit::leave`] would. `largest_coordinate` (m) is
    /// that of the surface's corners and of the other end of the ray: either's rounding can put the surface in the way.
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
        u64::try_from(self.device.memory.peak.load(Ordering::Relaxed)).unwrap_or(0)
    }

    /// What Embree answers, if anything was hit.
    #[inline]
    fn query(&self, origin: Vec3, direction: Vec3, max_distance: f32) -> Option<sys::RTCRayHit> {
        let mut query = sys::RTCRayHit { ray: ray(origin, direction, max_distance), hit: sys::RTCHit::default() };
        query.hit.geomID = sys::RTC_INVALID_GEOMETRY_ID;
        query.hit.instID[0] = sys::RTC_INVALID_GEOMETRY_ID;
        // SAFETY: the scene is committed for as long as `self` lives.
        unsafe { sys::closest_hit(self.scene.0, &mut query) };
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

/// What a hit needs to know of its triangle, in half a cache line: fetching index and vertices instead makes rays about
/// a tenth slower.
#[repr(align(32))]
struct Plane {
    /// Unit normal.
    normal: Vec3,
    /// How far off the triangle a ray starts, m.
    offset: f32,
    /// Of the plane along `normal` as rounded to `f32`, mean of the three vertices, m.
    height: f64,
    material: u32,
}

impl Plane {
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

/// What Embree reads in place: checked by [`check`], and never changed or moved as long as it is shared.
struct Buffers {
    mesh: Arc<Mesh>,
    /// The vertices once more, where those of the mesh end with their allocation: Embree reads vertices 16 bytes at a time,
    /// so 4 bytes past the last must be readable.
    vertices: Option<Vec<[f32; 3]>>,
}

impl Buffers {
    fn of(mesh: &Arc<Mesh>) -> Self {
        let copy = || {
            let mut vertices = Vec::with_capacity(mesh.vertices.len() + 1);
            vertices.extend_from_slice(&mesh.vertices);
            vertices
        };
        let vertices = (mesh.vertices.capacity() == mesh.vertices.len()).then(copy);
        Self { mesh: Arc::clone(mesh), vertices }
    }

    /// Never full: there is room for one vertex behind the last.
    fn vertices(&self) -> &Vec<[f32; 3]> {
        let vertices = self.vertices.as_ref().unwrap_or(&self.mesh.vertices);
        assert!(vertices.capacity() > vertices.len(), "either the mesh's have room or the copy has");
        vertices
    }
}

/// Bytes that Embree holds, as it reports them.
#[derive(Default)]
struct Memory {
    now: AtomicI64,
    peak: AtomicI64,
}

/// Called by Embree, from any of its threads, whenever it takes or gives back memory. Never says no.
extern "C" fn watch_memory(memory: *mut c_void, bytes: isize, _after: bool) -> bool {
    // SAFETY: `Device::new` registered a pointer to a `Memory` that outlives the device, and only atomics are written.
    let memory = unsafe { &*memory.cast::<Memory>() };
    let bytes = bytes as i64;
    let now = memory.now.fetch_add(bytes, Ordering::Relaxed) + bytes;
    memory.peak.fetch_max(now, Ordering::Relaxed);
    true
}

/// An Embree device, of the release luxmap was built against.
struct Device {
    handle: sys::RTCDevice,
    /// Boxed: Embree keeps its address.
    memory: Box<Memory>,
}

impl Device {
    fn new(threads: usize) -> Result<Self, Error> {
        let settings = CString::new(format!("threads={threads}")).expect("the text holds no NUL");
        // SAFETY: the settings are a C string that outlives the call.
        let handle = unsafe { sys::rtcNewDevice(settings.as_ptr()) };
        if handle.is_null() {
            return Err(Error::Embree(format!("no device: {}", last_error(handle).unwrap_or("no reason given"))));
        }
        let device = Self { handle, memory: Box::default() };
        device.check_release()?;
        // SAFETY: the device is valid; the function reads the pointer as the `Memory` it is, which is dropped after the
        // device is released.
        unsafe {
            let memory = ptr::from_ref::<Memory>(&device.memory).cast_mut().cast();
            sys::rtcSetDeviceMemoryMonitorFunction(handle, Some(watch_memory), memory);
        }
        Ok(device)
    }

    /// Structs change their size between minor releases: the library must be of the release whose header was read.
    fn check_release(&self) -> Result<(), Error> {
        use sys::RTCDeviceProperty::{VERSION_MAJOR, VERSION_MINOR};
        // SAFETY: the device is valid, and both properties can be read.
        let library =
            [VERSION_MAJOR, VERSION_MINOR].map(|part| unsafe { sys::rtcGetDeviceProperty(self.handle, part) });
        let header = [sys::RTC_VERSION_MAJOR as isize, sys::RTC_VERSION_MINOR as isize];
        if library == header {
            return Ok(());
        }
        let ([major, minor], [built_major, built_minor]) = (library, header);
        Err(Error::Embree(format!(
            "the library is {major}.{minor}, but luxmap was built with the header of {built_major}.{built_minor}; build it again"
        )))
    }

    /// The first thing that went wrong on this thread since the last call.
    fn check(&self, doing: &str) -> Result<(), Error> {
        last_error(self.handle).map_or(Ok(()), |why| Err(Error::Embree(format!("{doing}: {why}"))))
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: `new` made this handle, checked it, and holds its one reference; `memory` is dropped after this.
        unsafe { sys::rtcReleaseDevice(self.handle) }
    }
}

/// Reads and clears this thread's error; a null device tells why none could be made.
fn last_error(device: sys::RTCDevice) -> Option<&'static str> {
    // SAFETY: the device is valid or null, and both are allowed; the code is read as a plain number.
    match unsafe { sys::rtcGetDeviceError(device) } {
        0 => None,
        2 => Some("invalid argument"),
        3 => Some("invalid operation"),
        4 => Some("out of memory"),
        5 => Some("this processor is not supported"),
        6 => Some("cancelled"),
        _ => Some("unknown error"),
    }
}

/// A committed scene.
struct Scene(sys::RTCScene);

// SAFETY: the queries rtcIntersect1 and rtcOccluded1 may run on a committed scene from any thread at once, and nothing
// changes the scene after `Scene::commit`.
unsafe impl Sync for Scene {}
// SAFETY: Embree's handles belong to no thread: reference counts are atomic, and any thread may release them.
unsafe impl Send for Scene {}
// SAFETY: as for `Scene`; shared, a device is only kept alive and its `Memory` read, which is atomic.
unsafe impl Sync for Device {}
// SAFETY: as for `Scene`.
unsafe impl Send for Device {}

impl Scene {
    /// One geometry with all triangles; robust, so that no ray slips through between two of them.
    fn commit(device: &Device, buffers: &Buffers) -> Result<Self, Error> {
        use sys::{RTCBufferType as Buffer, RTCFormat as Format, RTCGeometryType as Geometry};
        // SAFETY: the device is valid. A null scene (out of memory) is caught before it is used.
        let scene = unsafe { Self(sys::rtcNewScene(device.handle)) };
        device.check("making a scene")?;
        // SAFETY: scene and device are valid.
        unsafe {
            sys::rtcSetSceneFlags(scene.0, sys::RTCSceneFlags::ROBUST);
            sys::rtcSetSceneBuildQuality(scene.0, sys::RTCBuildQuality::MEDIUM);
        }
        let triangles = &buffers.mesh.triangles;
        if !triangles.is_empty() {
            let vertices = buffers.vertices();
            let (vertex_count, stride) = (vertices.len(), size_of::<[f32; 3]>());
            let (vertices, triangle_count) = (vertices.as_ptr().cast(), triangles.len());
            // SAFETY: both buffers hold as many items as named, 12 bytes each, aligned to 4; behind the last vertex the
            // same allocation has room for another, so that 16 bytes can be read there (Embree makes nothing of the last
            // 4). They stay in place and unchanged longer than the scene: nobody can change a `Mesh` that is shared, and
            // `RayCaster` drops the scene first. Indices were checked. The scene takes its own reference to the geometry;
            // ours is released.
            unsafe {
                let geometry = sys::rtcNewGeometry(device.handle, Geometry::TRIANGLE);
                device.check("making a geometry")?;
                let share = |kind, format, data, count| {
                    sys::rtcSetSharedGeometryBuffer(geometry, kind, 0, format, data, 0, stride, count);
                };
                share(Buffer::VERTEX, Format::FLOAT3, vertices, vertex_count);
                share(Buffer::INDEX, Format::UINT3, triangles.as_ptr().cast(), triangle_count);
                sys::rtcCommitGeometry(geometry);
                sys::rtcAttachGeometry(scene.0, geometry);
                sys::rtcReleaseGeometry(geometry);
            }
        }
        // SAFETY: the scene is valid, and no other thread knows it yet.
        unsafe { sys::rtcCommitScene(scene.0) };
        device.check("building")?;
        Ok(scene)
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: `commit` made this handle and holds its one reference; null is refused without harm.
        unsafe { sys::rtcReleaseScene(self.0) }
    }
}

/// Embree's C interface: functions, handles and constants from `embree4-sys`, which knows the header of 4.2; the structs
/// that grew since then from the header this machine has (see `build.rs`).
#[allow(non_camel_case_types, non_snake_case, non_upper_case_globals, reason = "the names are Embree's")]
#[allow(dead_code, unreachable_pub, reason = "generated, and private to this file")]
mod sys {
    use std::ffi::c_uint;
    use std::mem::offset_of;
    use std::ptr;

    pub use embree4_sys::{
        RTC_INVALID_GEOMETRY_ID, RTCBufferType, RTCBuildQuality, RTCDevice, RTCDeviceProperty, RTCFormat,
        RTCGeometryType, RTCScene, RTCSceneFlags, rtcAttachGeometry, rtcCommitGeometry, rtcCommitScene,
        rtcGetDeviceProperty, rtcNewDevice, rtcNewGeometry, rtcNewScene, rtcReleaseDevice, rtcReleaseGeometry,
        rtcReleaseScene, rtcSetDeviceMemoryMonitorFunction, rtcSetSceneBuildQuality, rtcSetSceneFlags,
        rtcSetSharedGeometryBuffer,
    };

    include!(concat!(env!("OUT_DIR"), "/embree.rs"));

    unsafe extern "C" {
        /// Declared anew: `embree4-sys` returns a Rust enum, and a code it doesn't know would be undefined behaviour.
        pub fn rtcGetDeviceError(device: RTCDevice) -> c_uint;
    }

    /// rtcIntersect1 with default arguments. This function and the next are the only places that cast a struct.
    ///
    /// # Safety
    /// The scene is committed.
    #[inline]
    pub unsafe fn closest_hit(scene: RTCScene, query: &mut RTCRayHit) {
        // SAFETY: `query` has the layout of the installed header, which is that of the library (`Device::check_release`);
        // it is initialised and aligned by its type. Null arguments mean defaults.
        unsafe { embree4_sys::rtcIntersect1(scene, ptr::from_mut(query).cast(), ptr::null_mut()) }
    }

    /// rtcOccluded1 with default arguments.
    ///
    /// # Safety
    /// The scene is committed.
    #[inline]
    pub unsafe fn occluded(scene: RTCScene, query: &mut RTCRay) {
        // SAFETY: as in `closest_hit`.
        unsafe { embree4_sys::rtcOccluded1(scene, ptr::from_mut(query).cast(), ptr::null_mut()) }
    }

    /// The fields used here lie where `embree4-sys` has them: releases of Embree 4 only ever append.
    macro_rules! same_offsets {
        ($($struct:ident: $($($field:ident).+),+;)+) => {
            const _: () = { $($(
                assert!(offset_of!($struct, $($field).+) == offset_of!(embree4_sys::$struct, $($field).+));
            )+)+ };
        };
    }
    same_offsets! {
        RTCRay: org_x, org_y, org_z, tnear, dir_x, dir_y, dir_z, time, tfar, mask, id, flags;
        RTCHit: Ng_x, Ng_y, Ng_z, u, v, primID, geomID, instID;
        RTCRayHit: ray, hit, hit.primID;
    }
    const _: () = {
        assert!(RTC_VERSION_MAJOR == 4);
        assert!(size_of::<RTCRay>() == 48 && align_of::<RTCRay>() == 16);
        assert!(size_of::<RTCHit>() >= size_of::<embree4_sys::RTCHit>() && align_of::<RTCHit>() == 16);
        assert!(size_of::<RTCRayHit>() == size_of::<RTCRay>() + size_of::<RTCHit>() && align_of::<RTCRayHit>() == 16);
        assert!(size_of::<RTCRayQueryContext>() >= size_of::<embree4_sys::RTCRayQueryContext>());
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Seed, Stream};
    use glam::{Quat, vec3};

    fn mesh(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Arc<Mesh> {
        let material_of = vec![0; triangles.len()];
        Arc::new(Mesh { vertices: vertices.into_iter().map(Into::into).collect(), triangles, material_of })
    }

    /// The lower left half of a square of 1 m in the plane z = 0, front up.
    fn half_a_square() -> Arc<Mesh> {
        mesh(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])
    }

    /// A closed box of the given size around the origin, turned, fronts inside.
    fn closed_box(size: Vec3, turn: Quat) -> Arc<Mesh> {
        let side = |bit: u32, corner: u32| if corner >> bit & 1 == 1 { 0.5 } else { -0.5 };
        let corners = (0..8).map(|i| turn * (size * vec3(side(0, i), side(1, i), side(2, i)))).collect();
        let walls = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        mesh(corners, walls.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
    }

    /// Bounces a photon about, from `start` on, on the side of each surface it came from. Returns how many of `rays` met
    /// nothing, or something that `allowed` says no photon can reach; after each such ray it starts anew.
    fn lost(caster: &RayCaster, start: Vec3, rays: u32, allowed: impl Fn(&Hit) -> bool) -> u32 {
        let mut stream = Seed(7).stream(0);
        let begin = |stream: &mut Stream| (start, stream.cosine_about(Vec3::Z));
        let (mut lost, (mut origin, mut direction)) = (0, begin(&mut stream));
        for _ in 0..rays {
            (origin, direction) = match caster.closest_hit(origin, direction, f32::INFINITY) {
                Some(hit) if allowed(&hit) => {
                    let back = stream.cosine_about(hit.normal * -hit.normal.dot(direction).signum());
                    (hit.leave(back), back)
                }
                _ => {
                    lost += 1;
                    begin(&mut stream)
                }
            };
        }
        lost
    }

    #[test]
    fn a_ray_meets_a_triangle_where_geometry_says() {
        let caster = RayCaster::build(&half_a_square(), 1).unwrap();
        let direction = vec3(0.0, 0.6, -0.8);
        let hit = caster.closest_hit(vec3(0.25, 0.0, 0.5), direction, 10.0).unwrap();
        assert_eq!((hit.triangle, hit.normal), (0, Vec3::Z));
        assert!((hit.distance - 0.625).abs() < 1e-6, "{hit:?}");
        assert!(hit.position.distance(vec3(0.25, 0.375, 0.0)) < 1e-6, "{hit:?}");
        // From behind too; the normal stays that of the front.
        let from_below = caster.closest_hit(vec3(0.25, 0.25, -1.0), Vec3::Z, 10.0).unwrap();
        assert_eq!((from_below.normal, from_below.distance), (Vec3::Z, 1.0));
        assert!(from_below.leave(Vec3::NEG_Z).z < 0.0 && from_below.leave(Vec3::Z).z > 0.0);
    }

    #[test]
    fn a_ray_beside_behind_or_too_short_meets_nothing() {
        let caster = RayCaster::build(&half_a_square(), 1).unwrap();
        let above = vec3(0.25, 0.25, 1.0);
        for (origin, direction, max_distance) in
            [(vec3(0.75, 0.75, 1.0), Vec3::NEG_Z, 10.0), (above, Vec3::Z, 10.0), (above, Vec3::NEG_Z, 0.99)]
        {
            assert_eq!(caster.closest_hit(origin, direction, max_distance), None);
            assert!(!caster.is_occluded(origin, direction, max_distance));
        }
        assert!(caster.is_occluded(above, Vec3::NEG_Z, 1.01));
        assert!(caster.is_occluded(above, Vec3::NEG_Z, f32::INFINITY));
        assert!(!caster.is_occluded(above, Vec3::NEG_Z, -1e-6), "nothing lies on an empty segment");
    }

    /// Embree 4.3 writes 96 bytes where 4.2 wrote 80.
    #[test]
    fn a_query_writes_nothing_behind_its_struct() {
        #[repr(C)]
        struct Guarded {
            query: sys::RTCRayHit,
            guard: [u64; 8],
        }
        let caster = RayCaster::build(&half_a_square(), 1).unwrap();
        let guard = [0xdead_beef_dead_beef; 8];
        let ray = ray(vec3(0.25, 0.25, 1.0), Vec3::NEG_Z, 10.0);
        let mut guarded = Guarded { query: sys::RTCRayHit { ray, hit: Default::default() }, guard };
        guarded.query.hit.geomID = sys::RTC_INVALID_GEOMETRY_ID;
        // SAFETY: the scene is committed.
        unsafe { sys::closest_hit(caster.scene.0, &mut guarded.query) };
        assert_eq!((guarded.query.hit.geomID, guarded.query.hit.primID), (0, 0));
        assert_eq!(guarded.guard, guard);
    }

    const RAYS: u32 = 1_000_000;
    /// Measured over 2e7 rays: boxes lose 0 … 1.5e-7 a ray, sheets 0 … 3e-7 (at their sharp edges a step off one surface
    /// can cross the other). So a million rays lose more than three by chance once in 3000 runs at most.
    const MOST_LOST: u32 = 3;

    #[test]
    fn no_photon_escapes_from_a_closed_box_of_any_size() {
        let turned = Quat::from_rotation_x(0.5) * Quat::from_rotation_z(0.3);
        for (scale, turn) in [1e-3, 1.0, 1e3].into_iter().flat_map(|scale| [(scale, Quat::IDENTITY), (scale, turned)]) {
            let caster = RayCaster::build(&closed_box(scale * vec3(6.0, 7.2, 2.7), turn), 1).unwrap();
            let lost = lost(&caster, Vec3::ZERO, RAYS, |_| true);
            assert!(lost <= MOST_LOST, "{lost} of {RAYS} rays escaped at scale {scale}, turn {turn}");
        }
    }

    /// A sheet without thickness cuts the box in two, and sticks out of it: the half above must stay dark.
    #[test]
    fn no_photon_leaks_through_a_sheet_without_thickness() {
        for (scale, tilt) in [(1e-3, 0.4), (1.0, 0.0), (1.0, 0.4), (1e3, 0.4)] {
            let mut halves = closed_box(scale * vec3(6.0, 7.2, 2.7), Quat::IDENTITY);
            let turn = Quat::from_rotation_x(tilt) * Quat::from_rotation_y(tilt);
            let corner = |x, y| <[f32; 3]>::from(turn * (scale * vec3(x, y, 0.0)));
            let mesh = Arc::make_mut(&mut halves);
            mesh.vertices.extend([corner(-9.0, -9.0), corner(9.0, -9.0), corner(9.0, 9.0), corner(-9.0, 9.0)]);
            mesh.triangles.extend([[8, 9, 10], [8, 10, 11]]);
            mesh.material_of.extend([0, 0]);
            let caster = RayCaster::build(&halves, 1).unwrap();
            let up = turn * Vec3::Z;
            let lost = lost(&caster, -0.5 * scale * up, RAYS, |hit| hit.position.dot(up) < 1e-5 * scale);
            assert!(lost <= MOST_LOST, "{lost} of {RAYS} rays leaked at scale {scale}, tilt {tilt}");
        }
    }

    #[test]
    fn a_mesh_that_embree_would_thin_out_is_refused() {
        let refused = |mesh: &Arc<Mesh>| RayCaster::build(mesh, 1).err().expect("the mesh is bad").to_string();
        let mut bad_index = half_a_square();
        Arc::make_mut(&mut bad_index).triangles.push([0, 1, 3]);
        Arc::make_mut(&mut bad_index).material_of.push(0);
        assert_eq!(refused(&bad_index), "Embree: triangle 1 names vertex 3, but the mesh has 3, counted from 0");
        for bad in [f32::NAN, f32::INFINITY, 1e30] {
            let mut mesh = half_a_square();
            Arc::make_mut(&mut mesh).vertices[2][1] = bad;
            let expected = format!("Embree: vertex 2 lies at (0, {bad}, 0); expected finite numbers up to 1e18 m");
            assert_eq!(refused(&mesh), expected);
        }
    }

    #[test]
    fn an_empty_mesh_is_never_hit() {
        for mesh in [Arc::default(), mesh(vec![Vec3::X], vec![])] {
            let caster = RayCaster::build(&mesh, 2).unwrap();
            assert_eq!(caster.closest_hit(Vec3::ZERO, Vec3::X, f32::INFINITY), None);
            assert!(!caster.is_occluded(Vec3::ZERO, Vec3::X, f32::INFINITY));
        }
    }

    #[test]
    fn two_threads_ask_at_once_and_get_the_same() {
        let caster = RayCaster::build(&closed_box(vec3(6.0, 7.2, 2.7), Quat::IDENTITY), 2).unwrap();
        let walk = || {
            let mut stream = Seed(3).stream(0);
            let mut ask = || caster.closest_hit(Vec3::ZERO, stream.cosine_about(Vec3::Z), f32::INFINITY).unwrap();
            (0..100_000).map(|_| ask()).collect::<Vec<_>>()
        };
        let (one, other) = std::thread::scope(|threads| {
            let (one, other) = (threads.spawn(walk), threads.spawn(walk));
            (one.join().unwrap(), other.join().unwrap())
        });
        assert!(one == other);
    }

    /// With room behind the last vertex, Embree reads the mesh in place; without, what it reads is a copy that has room.
    #[test]
    fn a_mesh_with_room_for_one_more_vertex_is_not_copied() {
        let mut mesh = Arc::unwrap_or_clone(half_a_square());
        mesh.vertices.shrink_to_fit();
        assert_eq!(mesh.vertices.capacity(), 3, "a Vec as the standard library makes it");
        assert_ne!(Buffers::of(&Arc::new(mesh.clone())).vertices().as_ptr(), mesh.vertices.as_ptr());
        mesh.vertices.reserve(1);
        let mesh = Arc::new(mesh);
        let caster = RayCaster::build(&mesh, 1).unwrap();
        assert_eq!(caster.buffers.vertices().as_ptr(), mesh.vertices.as_ptr());
        assert_eq!(caster.buffers.mesh.triangles.as_ptr(), mesh.triangles.as_ptr());
    }

    #[test]
    fn memory_is_counted() {
        let small = RayCaster::build(&half_a_square(), 1).unwrap().peak_memory();
        let corner = |i: u32| vec3((i % 300) as f32, (i / 300) as f32, 0.0);
        let grid = (0..89_000).filter(|i| i % 300 < 299).map(|i| [i, i + 1, i + 300]).collect::<Vec<_>>();
        let large = RayCaster::build(&mesh((0..90_000).map(corner).collect(), grid.clone()), 2).unwrap().peak_memory();
        // A leaf of Embree's holds four triangles in 4 · 36 bytes at least.
        assert!(large > small + 36 * grid.len() as u64, "{small} B, {large} B");
    }
}
