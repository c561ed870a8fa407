//! Embree's C interface: types, constants and the functions that comber calls.
//!
//! Versions 3 and 4 differ in what trace calls take: 3 has a context before the rays, 4 has optional arguments behind them.

use std::ffi::{c_char, c_int, c_uint, c_void};

/// A device, scene or geometry.
pub type Handle = *mut c_void;

/// `RTCDeviceProperty`.
pub mod property {
    pub const VERSION_MAJOR: i32 = 1;
    pub const VERSION_MINOR: i32 = 2;
    pub const VERSION_PATCH: i32 = 3;
    /// Packets of sixteen are traced as such, not as smaller ones.
    pub const NATIVE_RAY16: i32 = 34;
    /// Version 3 only.
    pub const RAY_STREAM: i32 = 35;
}

/// `RTC_GEOMETRY_TYPE_TRIANGLE`.
pub const TRIANGLES: c_int = 0;
/// `RTC_GEOMETRY_TYPE_SPHERE_POINT`.
pub const SPHERES: c_int = 50;
/// `RTC_BUFFER_TYPE_INDEX`.
pub const INDICES: c_int = 0;
/// `RTC_BUFFER_TYPE_VERTEX`.
pub const VERTICES: c_int = 1;
/// `RTC_FORMAT_UINT3`.
pub const UINT3: c_int = 0x5003;
/// `RTC_FORMAT_FLOAT3`.
pub const FLOAT3: c_int = 0x9003;
/// `RTC_FORMAT_FLOAT4`.
pub const FLOAT4: c_int = 0x9004;
/// `RTC_SCENE_FLAG_ROBUST`.
pub const ROBUST: c_int = 1 << 2;
/// `RTC_INVALID_GEOMETRY_ID`.
pub const NOTHING: u32 = u32::MAX;

/// `RTCIntersectContext` of version 3, with room to spare for builds with several levels of instances.
#[repr(C)]
pub struct Context3 {
    pub flags: u32,
    pub filter: *const c_void,
    pub instances: [u32; 16],
}

impl Context3 {
    pub fn new(coherent: bool) -> Context3 {
        Context3 { flags: u32::from(coherent), filter: std::ptr::null(), instances: [NOTHING; 16] }
    }
}

/// `RTCIntersectArguments` and `RTCOccludedArguments` of version 4, which are laid out alike.
#[repr(C)]
pub struct Arguments4 {
    pub flags: u32,
    pub features: u32,
    pub context: *const c_void,
    pub filter: *const c_void,
    pub intersect: *const c_void,
    pub min_width_distance_factor: f32,
}

impl Arguments4 {
    pub fn new(coherent: bool) -> Arguments4 {
        let null = std::ptr::null();
        let flags = u32::from(coherent) << 16;
        let (features, min_width_distance_factor) = (u32::MAX, 0.0);
        Arguments4 { flags, features, context: null, filter: null, intersect: null, min_width_distance_factor }
    }
}

/// `RTCRayHitNp` of version 3: where the columns of a ray (12) and of a hit (8) are.
#[repr(C)]
pub struct Columns(pub [*mut u32; 20]);

/// `rtcIntersect1`, `rtcOccluded1`.
#[derive(Clone, Copy)]
pub enum One {
    V3(unsafe extern "C" fn(Handle, *mut Context3, *mut u32)),
    V4(unsafe extern "C" fn(Handle, *mut u32, *mut Arguments4)),
}

/// `rtcIntersect4` and so on.
#[derive(Clone, Copy)]
pub enum Packet {
    V3(unsafe extern "C" fn(*const u32, Handle, *mut Context3, *mut u32)),
    V4(unsafe extern "C" fn(*const u32, Handle, *mut u32, *mut Arguments4)),
}

/// `rtcIntersect1M`, `rtcOccluded1M`.
pub type Many = unsafe extern "C" fn(Handle, *mut Context3, *mut u32, c_uint, usize);
/// `rtcIntersectNp`, `rtcOccludedNp`.
pub type Spread = unsafe extern "C" fn(Handle, *mut Context3, *const Columns, c_uint);

/// The trace calls for one question: closest hit, or any hit.
pub struct Calls {
    pub one: One,
    /// Of 4, 8 and 16.
    pub packets: [Packet; 3],
    /// Version 3 only.
    pub streams: Option<(Many, Spread)>,
}

/// `RTCMemoryMonitorFunction`.
pub type MemoryMonitor = unsafe extern "C" fn(*mut c_void, isize, bool) -> bool;

/// Everything else.
pub struct Api {
    pub new_device: unsafe extern "C" fn(*const c_char) -> Handle,
    pub release_device: unsafe extern "C" fn(Handle),
    pub device_property: unsafe extern "C" fn(Handle, c_int) -> isize,
    pub device_error: unsafe extern "C" fn(Handle) -> c_int,
    pub set_memory_monitor: unsafe extern "C" fn(Handle, MemoryMonitor, *mut c_void),
    pub new_scene: unsafe extern "C" fn(Handle) -> Handle,
    pub release_scene: unsafe extern "C" fn(Handle),
    pub set_scene_flags: unsafe extern "C" fn(Handle, c_int),
    pub set_scene_build_quality: unsafe extern "C" fn(Handle, c_int),
    pub commit_scene: unsafe extern "C" fn(Handle),
    pub new_geometry: unsafe extern "C" fn(Handle, c_int) -> Handle,
    pub release_geometry: unsafe extern "C" fn(Handle),
    /// Geometry, type, slot, format, bytes from item to item, items.
    pub new_buffer: unsafe extern "C" fn(Handle, c_int, c_uint, c_int, usize, usize) -> *mut c_void,
    pub commit_geometry: unsafe extern "C" fn(Handle),
    pub attach_geometry: unsafe extern "C" fn(Handle, Handle) -> c_uint,
    pub closest: Calls,
    pub any: Calls,
}
