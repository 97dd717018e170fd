//! Where a folder holds Embree's library; `build.rs` looks there as well.

use std::fs;
use std::path::{Path, PathBuf};

/// Names of Embree's library: as programs ask the system for it, and as a release's folder may have it.
pub(crate) const LIBRARY: [&str; 2] = if cfg!(target_os = "macos") {
    ["libembree4.4.dylib", "libembree4.dylib"]
} else if cfg!(windows) {
    ["embree4.dll", "libembree4.dll"]
} else {
    ["libembree4.so.4", "libembree4.so"]
};

/// Name of TBB's library, which Embree needs, beside it.
pub(crate) const TBB: &str = if cfg!(target_os = "macos") {
    "libtbb.12.dylib"
} else if cfg!(windows) {
    "tbb12.dll"
} else {
    "libtbb.so.12"
};

/// Embree's library in a folder itself.
pub(crate) fn library_in(folder: &Path) -> Option<PathBuf> {
    LIBRARY.iter().map(|name| folder.join(name)).find(|file| file.exists())
}

/// Embree's library under a folder that holds an unpacked release, or what a package unpacks under `usr`: in `lib`,
/// `lib64` or Debian's `lib/<architecture>`; on Windows in `bin`.
pub(crate) fn library_under(prefix: &Path) -> Option<PathBuf> {
    let inner = fs::read_dir(prefix.join("lib")).into_iter().flatten().flatten().map(|entry| entry.path());
    let debian = inner.filter(|folder| folder.to_string_lossy().ends_with("-linux-gnu"));
    let places = ["lib", "lib64", "bin"].map(|name| prefix.join(name)).into_iter().chain(debian);
    places.filter_map(|folder| library_in(&folder)).next()
}
