//! Embree's device and scene, and what they read; every call to Embree is in this file.
#![allow(unsafe_code, reason = "Embree is a C library")]

use std::ffi::{CString, c_void};
use std::path::Path;
use std::ptr;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use super::load::{Embree, embree};
use super::sys::{self, Interface};
use crate::error::Error;
use crate::geometry::Mesh;

/// What Embree reads in place: checked by [`super::check`], and never changed or moved as long as it is shared.
pub(super) struct Buffers {
    pub(super) mesh: Arc<Mesh>,
    /// The vertices once more, where those of the mesh end with their allocation: Embree reads vertices 16 bytes at a
    /// time, so 4 bytes past the last must be readable.
    vertices: Option<Vec<[f32; 3]>>,
}

impl Buffers {
    pub(super) fn of(mesh: &Arc<Mesh>) -> Self {
        let copy = || {
            let mut vertices = Vec::with_capacity(mesh.vertices.len() + 1);
            vertices.extend_from_slice(&mesh.vertices);
            vertices
        };
        let vertices = (mesh.vertices.capacity() == mesh.vertices.len()).then(copy);
        Self { mesh: Arc::clone(mesh), vertices }
    }

    /// Never full: there is room for one vertex behind the last.
    pub(super) fn vertices(&self) -> &Vec<[f32; 3]> {
        let vertices = self.vertices.as_ref().unwrap_or(&self.mesh.vertices);
        assert!(vertices.capacity() > vertices.len(), "either the mesh's have room or the copy has");
        vertices
    }
}

/// File of the Embree library in use; a bare name where the system has found it.
pub(super) fn library() -> Result<&'static Path, Error> {
    embree().map(|embree| embree.file.as_path())
}

/// Bytes that Embree holds, as it reports them.
#[derive(Default)]
struct MemoryCount {
    now: AtomicI64,
    peak: AtomicI64,
}

/// Called by Embree, from any of its threads, whenever it takes or gives back memory. Never says no.
extern "C" fn watch_memory(memory: *mut c_void, bytes: isize, _after: bool) -> bool {
    // SAFETY: `Device::new` registered a pointer to a `MemoryCount` that outlives the device, and only atomics are
    // written.
    let memory = unsafe { &*memory.cast::<MemoryCount>() };
    let bytes = bytes as i64;
    let now = memory.now.fetch_add(bytes, Ordering::Relaxed) + bytes;
    memory.peak.fetch_max(now, Ordering::Relaxed);
    true
}

/// An Embree device, of a release whose interface is known.
pub(super) struct Device {
    embree: &'static Embree,
    handle: sys::RTCDevice,
    /// Boxed: Embree keeps its address.
    memory: Box<MemoryCount>,
}

impl Device {
    pub(super) fn new(threads: usize) -> Result<Self, Error> {
        let embree = embree()?;
        let settings = CString::new(format!("threads={threads}")).expect("the text holds no NUL");
        // SAFETY: the settings are a C string that outlives the call.
        let handle = unsafe { (embree.interface.rtcNewDevice)(settings.as_ptr()) };
        if handle.is_null() {
            let why = last_error(&embree.interface, handle).unwrap_or("no reason given");
            return Err(Error::Embree(format!("no device: {why}")));
        }
        let device = Self { embree, handle, memory: Box::default() };
        device.check_release()?;
        // SAFETY: the device is valid; the function reads the pointer as the `MemoryCount` it is, which is dropped
        // after the device is released.
        unsafe {
            let memory = ptr::from_ref::<MemoryCount>(&device.memory).cast_mut().cast();
            (embree.interface.rtcSetDeviceMemoryMonitorFunction)(handle, Some(watch_memory), memory);
        }
        Ok(device)
    }

    /// Structs change their size between minor releases: the library must be of one whose header is known.
    fn check_release(&self) -> Result<(), Error> {
        let [major, minor] =
            [sys::RTC_DEVICE_PROPERTY_VERSION_MAJOR, sys::RTC_DEVICE_PROPERTY_VERSION_MINOR].map(|part| {
                // SAFETY: the device is valid, and both properties can be read.
                unsafe { (self.embree.interface.rtcGetDeviceProperty)(self.handle, part) }
            });
        if major == sys::MAJOR && sys::MINORS.contains(&minor) {
            return Ok(());
        }
        let known = sys::MINORS.map(|minor| format!("{}.{minor}", sys::MAJOR)).join(" or ");
        let file = self.embree.file.display();
        Err(Error::Embree(format!("{file} is release {major}.{minor}; expected {known}")))
    }

    /// The most bytes that Embree has held at any time since the device was made.
    pub(super) fn peak_memory(&self) -> u64 {
        u64::try_from(self.memory.peak.load(Ordering::Relaxed)).unwrap_or(0)
    }

    /// The first thing that went wrong on this thread since the last call.
    fn check(&self, doing: &str) -> Result<(), Error> {
        last_error(&self.embree.interface, self.handle)
            .map_or(Ok(()), |why| Err(Error::Embree(format!("{doing}: {why}"))))
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: `new` made this handle, checked it, and holds its one reference; `memory` is dropped after this.
        unsafe { (self.embree.interface.rtcReleaseDevice)(self.handle) }
    }
}

/// Reads and clears this thread's error; a null device tells why none could be made.
fn last_error(interface: &Interface, device: sys::RTCDevice) -> Option<&'static str> {
    // SAFETY: the device is valid or null, and both are allowed; the code is read as a plain number.
    match unsafe { (interface.rtcGetDeviceError)(device) } {
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
pub(super) struct CommittedScene {
    interface: &'static Interface,
    handle: sys::RTCScene,
}

// SAFETY: the queries rtcIntersect1 and rtcOccluded1 may run on a committed scene from any thread at once, and nothing
// changes the scene after `CommittedScene::commit`.
unsafe impl Sync for CommittedScene {}
// SAFETY: Embree's handles belong to no thread: reference counts are atomic, and any thread may release them.
unsafe impl Send for CommittedScene {}
// SAFETY: as for `CommittedScene`; shared, a device is only kept alive and its `MemoryCount` read, which is atomic.
unsafe impl Sync for Device {}
// SAFETY: as for `CommittedScene`.
unsafe impl Send for Device {}

impl CommittedScene {
    /// One geometry with all triangles; robust, so that no ray slips through between two of them.
    pub(super) fn commit(device: &Device, buffers: &Buffers) -> Result<Self, Error> {
        let interface = &device.embree.interface;
        // SAFETY: the device is valid. A null scene (out of memory) is caught before it is used.
        let scene = unsafe { Self { interface, handle: (interface.rtcNewScene)(device.handle) } };
        device.check("making a scene")?;
        // SAFETY: scene and device are valid.
        unsafe {
            (interface.rtcSetSceneFlags)(scene.handle, sys::RTC_SCENE_FLAG_ROBUST);
            (interface.rtcSetSceneBuildQuality)(scene.handle, sys::RTC_BUILD_QUALITY_MEDIUM);
        }
        let triangles = &buffers.mesh.triangles;
        if !triangles.is_empty() {
            let vertices = buffers.vertices();
            let (vertex_count, stride) = (vertices.len(), size_of::<[f32; 3]>());
            let (vertices, triangle_count) = (vertices.as_ptr().cast(), triangles.len());
            // SAFETY: both buffers hold as many items as named, 12 bytes each, aligned to 4; behind the last vertex the
            // same allocation has room for another, so that 16 bytes can be read there (Embree makes nothing of the
            // last 4). They stay in place and unchanged longer than the scene: nobody can change a `Mesh` that is
            // shared, and `RayCaster` drops the scene first. Indices were checked. The scene takes its own reference to
            // the geometry; ours is released.
            unsafe {
                let geometry = (interface.rtcNewGeometry)(device.handle, sys::RTC_GEOMETRY_TYPE_TRIANGLE);
                device.check("making a geometry")?;
                let share = |kind, format, data, count| {
                    (interface.rtcSetSharedGeometryBuffer)(geometry, kind, 0, format, data, 0, stride, count);
                };
                share(sys::RTC_BUFFER_TYPE_VERTEX, sys::RTC_FORMAT_FLOAT3, vertices, vertex_count);
                share(sys::RTC_BUFFER_TYPE_INDEX, sys::RTC_FORMAT_UINT3, triangles.as_ptr().cast(), triangle_count);
                (interface.rtcCommitGeometry)(geometry);
                (interface.rtcAttachGeometry)(scene.handle, geometry);
                (interface.rtcReleaseGeometry)(geometry);
            }
        }
        // SAFETY: the scene is valid, and no other thread knows it yet.
        unsafe { (interface.rtcCommitScene)(scene.handle) };
        device.check("building")?;
        Ok(scene)
    }

    /// rtcIntersect1 with default arguments: writes what the ray meets.
    #[inline]
    pub(super) fn closest_hit(&self, query: &mut sys::RTCRayHit) {
        // SAFETY: the scene is committed. `query` has the layout that Embree writes, of the releases `Device::new` lets
        // through; it is initialised and aligned by its type. Null arguments mean defaults.
        unsafe { (self.interface.rtcIntersect1)(self.handle, query, ptr::null_mut()) }
    }

    /// rtcOccluded1 with default arguments: writes -∞ to `tfar` where anything is met.
    #[inline]
    pub(super) fn occluded(&self, query: &mut sys::RTCRay) {
        // SAFETY: as in `closest_hit`.
        unsafe { (self.interface.rtcOccluded1)(self.handle, query, ptr::null_mut()) }
    }
}

impl Drop for CommittedScene {
    fn drop(&mut self) {
        // SAFETY: `commit` made this handle and holds its one reference; null is refused without harm.
        unsafe { (self.interface.rtcReleaseScene)(self.handle) }
    }
}
