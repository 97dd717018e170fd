//! What luxmap uses of Embree's C interface: the headers of 4.3 and 4.4 agree on all of it.
//!
//! Written by hand, so that a build needs neither those headers nor libclang. The test below holds all of it against
//! the header in `EMBREE_DIR`, `.embree/` or the system.
#![allow(non_camel_case_types, non_snake_case, reason = "the names are Embree's")]

use std::ffi::{c_char, c_uint, c_void};
use std::mem::offset_of;

use libloading::Library;

/// Embree's major release, and the minor ones whose headers this file was held against.
pub(super) const MAJOR: isize = 4;
pub(super) const MINORS: [isize; 2] = [3, 4];

/// What a handle points to; only Embree knows what is in there.
#[repr(C)]
pub(super) struct RTCDeviceTy([u8; 0]);
#[repr(C)]
pub(super) struct RTCSceneTy([u8; 0]);
#[repr(C)]
pub(super) struct RTCGeometryTy([u8; 0]);
pub(super) type RTCDevice = *mut RTCDeviceTy;
pub(super) type RTCScene = *mut RTCSceneTy;
pub(super) type RTCGeometry = *mut RTCGeometryTy;

/// C's enums are plain numbers here: a value that Rust's own enum lacked would be undefined behaviour.
pub(super) type RTCError = c_uint;
pub(super) const RTC_DEVICE_PROPERTY_VERSION_MAJOR: c_uint = 1;
pub(super) const RTC_DEVICE_PROPERTY_VERSION_MINOR: c_uint = 2;
pub(super) const RTC_SCENE_FLAG_ROBUST: c_uint = 1 << 2;
pub(super) const RTC_BUILD_QUALITY_MEDIUM: c_uint = 1;
pub(super) const RTC_GEOMETRY_TYPE_TRIANGLE: c_uint = 0;
pub(super) const RTC_BUFFER_TYPE_INDEX: c_uint = 0;
pub(super) const RTC_BUFFER_TYPE_VERTEX: c_uint = 1;
pub(super) const RTC_FORMAT_UINT3: c_uint = 0x5003;
pub(super) const RTC_FORMAT_FLOAT3: c_uint = 0x9003;
pub(super) const RTC_INVALID_GEOMETRY_ID: c_uint = c_uint::MAX;

/// A ray; Embree writes `tfar`.
#[repr(C, align(16))]
#[derive(Clone, Copy, Default)]
pub(super) struct RTCRay {
    pub org_x: f32,
    pub org_y: f32,
    pub org_z: f32,
    pub tnear: f32,
    pub dir_x: f32,
    pub dir_y: f32,
    pub dir_z: f32,
    pub time: f32,
    pub tfar: f32,
    pub mask: c_uint,
    pub id: c_uint,
    pub flags: c_uint,
}

/// What a ray met; Embree writes all of it. 4.2 had no `instPrimID`, and wrote 16 bytes less.
#[repr(C, align(16))]
#[derive(Clone, Copy, Default)]
pub(super) struct RTCHit {
    pub Ng_x: f32,
    pub Ng_y: f32,
    pub Ng_z: f32,
    pub u: f32,
    pub v: f32,
    pub primID: c_uint,
    pub geomID: c_uint,
    pub instID: [c_uint; 1],
    pub instPrimID: [c_uint; 1],
}

/// A ray and what it met.
#[repr(C)]
#[derive(Clone, Copy, Default)]
pub(super) struct RTCRayHit {
    pub ray: RTCRay,
    pub hit: RTCHit,
}

const _: () = {
    assert!(size_of::<RTCRay>() == 48 && align_of::<RTCRay>() == 16);
    assert!(size_of::<RTCHit>() == 48 && align_of::<RTCHit>() == 16);
    assert!(size_of::<RTCRayHit>() == 96 && align_of::<RTCRayHit>() == 16 && offset_of!(RTCRayHit, hit) == 48);
    assert!(offset_of!(RTCRay, tfar) == 32 && offset_of!(RTCHit, primID) == 20 && offset_of!(RTCHit, geomID) == 24);
};

/// Asked before Embree takes memory and told after it gave some back: user pointer, bytes, whether it has happened.
pub(super) type RTCMemoryMonitorFunction = unsafe extern "C" fn(*mut c_void, isize, bool) -> bool;

macro_rules! interface {
    ($($name:ident: fn($($argument:ty),*) $(-> $result:ty)?, $declared:literal;)+) => {
        /// Embree's functions, as found in a library.
        pub(super) struct Interface {
            $(pub $name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)+
        }

        impl Interface {
            /// Finds all functions; the error tells which is missing.
            ///
            /// # Safety
            /// The library is Embree 4, and stays loaded as long as any of the functions is called.
            #[allow(unsafe_code, reason = "a library's functions have the types that we give them")]
            pub(super) unsafe fn of(library: &Library) -> Result<Self, libloading::Error> {
                // SAFETY: Embree 4 declares these functions with these types; a test holds them against its header.
                unsafe { Ok(Self { $($name: *library.get(concat!(stringify!($name), "\0"))?,)+ }) }
            }
        }

        /// Each function's name, and its type as the header declares it.
        #[cfg(test)]
        const DECLARED: &[(&str, &str)] = &[$((stringify!($name), $declared),)+];
    };
}

interface! {
    rtcNewDevice: fn(*const c_char) -> RTCDevice, "RTCDevice (*)(const char*)";
    rtcReleaseDevice: fn(RTCDevice), "void (*)(RTCDevice)";
    rtcGetDeviceProperty: fn(RTCDevice, c_uint) -> isize, "ssize_t (*)(RTCDevice, enum RTCDeviceProperty)";
    rtcGetDeviceError: fn(RTCDevice) -> RTCError, "enum RTCError (*)(RTCDevice)";
    rtcSetDeviceMemoryMonitorFunction: fn(RTCDevice, Option<RTCMemoryMonitorFunction>, *mut c_void),
        "void (*)(RTCDevice, bool (*)(void*, ssize_t, bool), void*)";
    rtcNewScene: fn(RTCDevice) -> RTCScene, "RTCScene (*)(RTCDevice)";
    rtcReleaseScene: fn(RTCScene), "void (*)(RTCScene)";
    rtcSetSceneFlags: fn(RTCScene, c_uint), "void (*)(RTCScene, enum RTCSceneFlags)";
    rtcSetSceneBuildQuality: fn(RTCScene, c_uint), "void (*)(RTCScene, enum RTCBuildQuality)";
    rtcCommitScene: fn(RTCScene), "void (*)(RTCScene)";
    rtcNewGeometry: fn(RTCDevice, c_uint) -> RTCGeometry, "RTCGeometry (*)(RTCDevice, enum RTCGeometryType)";
    rtcSetSharedGeometryBuffer: fn(RTCGeometry, c_uint, c_uint, c_uint, *const c_void, usize, usize, usize),
        "void (*)(RTCGeometry, enum RTCBufferType, unsigned, enum RTCFormat, const void*, size_t, size_t, size_t)";
    rtcCommitGeometry: fn(RTCGeometry), "void (*)(RTCGeometry)";
    rtcAttachGeometry: fn(RTCScene, RTCGeometry) -> c_uint, "unsigned (*)(RTCScene, RTCGeometry)";
    rtcReleaseGeometry: fn(RTCGeometry), "void (*)(RTCGeometry)";
    rtcIntersect1: fn(RTCScene, *mut RTCRayHit, *mut c_void),
        "void (*)(RTCScene, struct RTCRayHit*, struct RTCIntersectArguments*)";
    rtcOccluded1: fn(RTCScene, *mut RTCRay, *mut c_void),
        "void (*)(RTCScene, struct RTCRay*, struct RTCOccludedArguments*)";
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::env;
    use std::io::Write;
    use std::path::{Path, PathBuf};
    use std::process::{Command, Stdio};

    /// Asks a C compiler whether all sizes, offsets, numbers and types above are those of Embree's header.
    #[test]
    fn the_header_declares_what_is_written_here() {
        let project = Path::new(env!("CARGO_MANIFEST_DIR"));
        let named = env::var_os("EMBREE_DIR").map(|folder| project.join(folder));
        let folders = named.into_iter().chain([project.join(".embree/usr"), PathBuf::from("/usr")]);
        let Some(include) = folders.map(|at| at.join("include")).find(|at| at.join("embree4/rtcore.h").exists()) else {
            return eprintln!("left out: Embree's header is not here (libembree-dev has it)");
        };
        let compiler = Command::new("cc")
            .args(["-x", "c", "-std=c11", "-fsyntax-only", "-Werror", "-I"])
            .arg(&include)
            .arg("-")
            .stdin(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn();
        let Ok(mut compiler) = compiler else { return eprintln!("left out: there is no C compiler `cc`") };
        compiler.stdin.take().expect("it is piped").write_all(questions().as_bytes()).expect("the compiler reads");
        let answer = compiler.wait_with_output().expect("the compiler ends");
        assert!(answer.status.success(), "{}", String::from_utf8_lossy(&answer.stderr));
    }

    /// A C program that can be compiled only where everything agrees.
    fn questions() -> String {
        let mut facts = vec![
            format!("RTC_VERSION_MAJOR == {MAJOR}"),
            MINORS.map(|minor| format!("RTC_VERSION_MINOR == {minor}")).join(" || "),
        ];
        macro_rules! layouts {
            ($($struct:ident: $($field:ident)+;)+) => { $(
                facts.push(format!("sizeof(struct {0}) == {1}", stringify!($struct), size_of::<$struct>()));
                facts.push(format!("_Alignof(struct {0}) == {1}", stringify!($struct), align_of::<$struct>()));
                $(facts.push(format!(
                    "offsetof(struct {0}, {1}) == {2}",
                    stringify!($struct), stringify!($field), offset_of!($struct, $field)
                ));)+
            )+ };
        }
        layouts! {
            RTCRay: org_x org_y org_z tnear dir_x dir_y dir_z time tfar mask id flags;
            RTCHit: Ng_x Ng_y Ng_z u v primID geomID instID instPrimID;
            RTCRayHit: ray hit;
        }
        macro_rules! numbers {
            ($($number:ident)+) => { $(facts.push(format!("{} == {}u", stringify!($number), $number));)+ };
        }
        numbers! {
            RTC_DEVICE_PROPERTY_VERSION_MAJOR RTC_DEVICE_PROPERTY_VERSION_MINOR RTC_SCENE_FLAG_ROBUST
            RTC_BUILD_QUALITY_MEDIUM RTC_GEOMETRY_TYPE_TRIANGLE RTC_BUFFER_TYPE_INDEX RTC_BUFFER_TYPE_VERTEX
            RTC_FORMAT_UINT3 RTC_FORMAT_FLOAT3 RTC_INVALID_GEOMETRY_ID
        }
        facts.push(format!("sizeof(enum RTCError) == {}", size_of::<RTCError>()));
        facts.push(format!("sizeof(ssize_t) == {}", size_of::<isize>()));
        facts.extend(DECLARED.iter().map(|(name, declared)| {
            format!("__builtin_types_compatible_p(__typeof__(&{name}), __typeof__(({declared})0))")
        }));
        let asserts: String = facts.iter().map(|fact| format!("_Static_assert({fact}, \"differs\");\n")).collect();
        format!("#include <stddef.h>\n#include <embree4/rtcore.h>\n{asserts}")
    }
}
