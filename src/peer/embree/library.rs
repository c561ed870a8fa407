//! Finding and loading Embree, and the devices it makes.

use super::denormals::AsZero;
use super::ffi::{Api, Calls, Handle, One, Packet, property};
use super::records::LARGEST_HIT;
use super::trace;
use crate::error::{Error, Result};
use libloading::Library;
use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicIsize, Ordering};
use std::sync::{Arc, OnceLock};

/// The environment variable that names a library file.
pub const VARIABLE: &str = "COMBER_EMBREE";

/// How to get it.
pub const HOW_TO_GET: &str = "install Debian's or Ubuntu's libembree-dev (version 3 or 4), or PyPI's embreex (version 4), \
     or name the library file: --peer-library FILE or the environment variable COMBER_EMBREE";

/// Libraries to try: the one asked for, or all that are installed in the usual places.
///
/// # Errors
/// None found.
pub fn find(asked: Option<&Path>) -> Result<Vec<PathBuf>> {
    let asked = asked.map(Path::to_path_buf).or_else(|| std::env::var_os(VARIABLE).map(PathBuf::from));
    if let Some(file) = asked {
        return Ok(vec![file]);
    }
    let mut found: Vec<PathBuf> = Vec::new();
    for folder in folders() {
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        let mut names: Vec<PathBuf> =
            entries.flatten().map(|entry| entry.path()).filter(|path| is_embree(path)).collect();
        names.sort();
        for path in names {
            // Names of one library are links to one file.
            let real = path.canonicalize().unwrap_or(path);
            if !found.contains(&real) {
                found.push(real);
            }
        }
    }
    match found.is_empty() {
        true => Err(Error::Scene(format!("no Embree found: {HOW_TO_GET}"))),
        false => Ok(found),
    }
}

/// `libembree4.so`, `libembree3.so.3`, `libembree4-4aef3270.so.4` and so on.
fn is_embree(path: &Path) -> bool {
    let Some(name) = path.file_name().and_then(|name| name.to_str()) else { return false };
    let library = |version| {
        name.strip_prefix("lib").unwrap_or(name).strip_prefix(version).is_some_and(|rest| {
            rest.starts_with(['.', '-']) && [".so", ".dylib", ".dll"].iter().any(|suffix| rest.contains(suffix))
        })
    };
    library("embree3") || library("embree4")
}

/// Where libraries are: what the loader is told, the system's folders, and the packages of Python.
fn folders() -> Vec<PathBuf> {
    let variables = ["LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH"];
    let told =
        variables.iter().filter_map(std::env::var_os).flat_map(|all| std::env::split_paths(&all).collect::<Vec<_>>());
    let usual = [
        "/usr/local/lib",
        "/usr/local/lib64",
        "/usr/lib/x86_64-linux-gnu",
        "/usr/lib/aarch64-linux-gnu",
        "/usr/lib64",
        "/usr/lib",
        "/opt/homebrew/lib",
    ];
    told.chain(usual.map(PathBuf::from)).chain(python_packages()).collect()
}

/// The folders `embreex.libs` beside the packages of every Python that is on the path or active.
fn python_packages() -> Vec<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let mut prefixes: Vec<PathBuf> = std::env::var_os("VIRTUAL_ENV").map(PathBuf::from).into_iter().collect();
    prefixes.extend(std::env::split_paths(&path).filter_map(|bin| bin.parent().map(Path::to_path_buf)));
    if let Some(home) = std::env::var_os("HOME").map(PathBuf::from) {
        prefixes.push(home.join(".local"));
        let versions = std::fs::read_dir(home.join(".pyenv/versions"));
        prefixes.extend(versions.into_iter().flatten().flatten().map(|entry| entry.path()));
    }
    let mut folders = Vec::new();
    for prefix in prefixes {
        for lib in ["lib", "local/lib"] {
            let Ok(entries) = std::fs::read_dir(prefix.join(lib)) else { continue };
            let pythons = entries.flatten().map(|entry| entry.path());
            let pythons = pythons
                .filter(|path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("python")));
            folders.extend(pythons.flat_map(|python| {
                ["site-packages", "dist-packages"].map(|packages| python.join(packages).join("embreex.libs"))
            }));
        }
    }
    folders.sort();
    folders.dedup();
    folders
}

/// A loaded library that has made a device.
pub struct Device {
    api: Api,
    handle: Handle,
    /// The file.
    pub path: PathBuf,
    /// As in "4.4.0".
    pub version: String,
    /// Words of a hit record, once known.
    hit_words: OnceLock<usize>,
    /// Bytes that the device holds, by its own account.
    bytes: Box<AtomicIsize>,
}

// SAFETY: Embree's devices and scenes may be used from all threads; the count of bytes is atomic.
unsafe impl Send for Device {}
// SAFETY: as above.
unsafe impl Sync for Device {}

impl Device {
    /// Loads the library at `path` and makes a device that builds with `threads` threads, restricted to the instruction set
    /// `isa` (as Embree spells it: `sse2`, `avx2`, …).
    ///
    /// # Errors
    /// A file that is no Embree of version 3 or 4, or one whose records are of a shape that comber does not know.
    pub fn open(path: &Path, threads: usize, isa: Option<&str>) -> Result<Arc<Device>> {
        let refuse = |why: String| Error::Scene(format!("{}: {why}", path.display()));
        // SAFETY: runs the initialisers of a library that the user has installed or named as Embree.
        let library = unsafe { Library::new(path) };
        let library = library.map_err(|e| refuse(format!("cannot be loaded: {e}; {HOW_TO_GET}")))?;
        let api =
            api(&library).map_err(|symbol| refuse(format!("is no Embree of version 3 or 4: it has no {symbol}")))?;
        // Its worker threads may outlive every device: code that they run must stay.
        std::mem::forget(library);
        let isa = isa.map(|isa| format!(",isa={isa},max_isa={isa}")).unwrap_or_default();
        let config =
            CString::new(format!("threads={threads},verbose=0{isa}")).map_err(|_| refuse("bad --peer-isa".into()))?;
        // SAFETY: the string ends with a zero and outlives the call.
        let handle = unsafe { (api.new_device)(config.as_ptr()) };
        if handle.is_null() {
            // SAFETY: without a device, the error is that of this thread.
            let error = unsafe { (api.device_error)(handle) };
            return Err(refuse(format!(
                "makes no device (error {error}) with the configuration '{}'",
                config.to_string_lossy()
            )));
        }
        let bytes = Box::new(AtomicIsize::new(0));
        let mut device =
            Device { api, handle, path: path.into(), version: String::new(), hit_words: OnceLock::new(), bytes };
        let counter: *const AtomicIsize = &*device.bytes;
        // SAFETY: the counter is boxed and lives as long as the device, which is released before it.
        unsafe { (device.api.set_memory_monitor)(handle, count_bytes, counter.cast_mut().cast()) };
        let part = |part| device.property(part);
        let version = [property::VERSION_MAJOR, property::VERSION_MINOR, property::VERSION_PATCH].map(part);
        if !matches!(version[0], 3 | 4) {
            return Err(refuse(format!("is Embree {}; comber knows versions 3 and 4", version[0])));
        }
        device.version = version.map(|number| number.to_string()).join(".");
        let device = Arc::new(device);
        let words = trace::hit_words(&device).map_err(refuse)?;
        device.hit_words.get_or_init(|| words);
        Ok(device)
    }

    /// The functions.
    pub(super) fn api(&self) -> &Api {
        &self.api
    }

    /// For the functions.
    pub(super) fn handle(&self) -> Handle {
        self.handle
    }

    /// Words of a hit record; the most there can be while that is not known.
    pub(super) fn hit_words(&self) -> usize {
        self.hit_words.get().copied().unwrap_or(LARGEST_HIT)
    }

    /// A property; see [`property`].
    pub(super) fn property(&self, property: i32) -> isize {
        // SAFETY: the device is alive.
        unsafe { (self.api.device_property)(self.handle, property) }
    }

    /// The first error since the last call, if there is one.
    pub(super) fn error(&self) -> std::result::Result<(), String> {
        // SAFETY: the device is alive.
        match unsafe { (self.api.device_error)(self.handle) } {
            0 => Ok(()),
            4 => Err(format!("Embree {} is out of memory", self.version)),
            code => Err(format!("Embree {} reports error {code}", self.version)),
        }
    }

    /// Bytes that the device holds now.
    pub fn bytes(&self) -> u64 {
        self.bytes.load(Ordering::Relaxed).max(0) as u64
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        let _zero = AsZero::new();
        // SAFETY: made by `new_device`, released once. Scenes hold the device, so none is left.
        unsafe { (self.api.release_device)(self.handle) };
    }
}

/// Adds up what Embree takes and gives back; always lets it go on.
unsafe extern "C" fn count_bytes(counter: *mut std::ffi::c_void, bytes: isize, _after: bool) -> bool {
    // SAFETY: the pointer that `open` handed over, alive as long as the device that calls this.
    unsafe { &*counter.cast::<AtomicIsize>() }.fetch_add(bytes, Ordering::Relaxed);
    true
}

/// Looks up all functions; the name of one that is missing otherwise.
fn api(library: &Library) -> std::result::Result<Api, String> {
    macro_rules! function {
        ($name:expr) => {{
            let name = $name;
            // SAFETY: Embree's headers declare the function of this name with the type it is assigned to.
            *unsafe { library.get(name.as_bytes()) }.map_err(|_| name.to_string())?
        }};
    }
    // The only function whose name tells the versions apart before a device is made: 4 dropped streams of pointers.
    // SAFETY: only asks whether the symbol is there.
    let third = unsafe { library.get::<*const ()>(b"rtcIntersect1M") }.is_ok();
    let calls = |kind: &str| -> std::result::Result<Calls, String> {
        let packet = |width: usize| -> std::result::Result<Packet, String> {
            let name = format!("{kind}{width}");
            Ok(if third { Packet::V3(function!(name)) } else { Packet::V4(function!(name)) })
        };
        let one = format!("{kind}1");
        Ok(Calls {
            one: if third { One::V3(function!(one)) } else { One::V4(function!(one)) },
            packets: [packet(4)?, packet(8)?, packet(16)?],
            streams: match third {
                true => Some((function!(format!("{kind}1M")), function!(format!("{kind}Np")))),
                false => None,
            },
        })
    };
    Ok(Api {
        new_device: function!("rtcNewDevice"),
        release_device: function!("rtcReleaseDevice"),
        device_property: function!("rtcGetDeviceProperty"),
        device_error: function!("rtcGetDeviceError"),
        set_memory_monitor: function!("rtcSetDeviceMemoryMonitorFunction"),
        new_scene: function!("rtcNewScene"),
        release_scene: function!("rtcReleaseScene"),
        set_scene_flags: function!("rtcSetSceneFlags"),
        set_scene_build_quality: function!("rtcSetSceneBuildQuality"),
        commit_scene: function!("rtcCommitScene"),
        new_geometry: function!("rtcNewGeometry"),
        release_geometry: function!("rtcReleaseGeometry"),
        new_buffer: function!("rtcSetNewGeometryBuffer"),
        commit_geometry: function!("rtcCommitGeometry"),
        attach_geometry: function!("rtcAttachGeometry"),
        closest: calls("rtcIntersect")?,
        any: calls("rtcOccluded")?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn libraries_are_known_by_their_names() {
        for name in
            ["libembree3.so", "libembree3.so.3.13.5", "libembree4-4aef3270.so.4", "embree4.dll", "libembree4.4.dylib"]
        {
            assert!(is_embree(Path::new(name)), "{name}");
        }
        for name in ["libembree2.so", "embree4.lib", "libembree4", "libembree40.so", "libm.so.6"] {
            assert!(!is_embree(Path::new(name)), "{name}");
        }
    }
}
