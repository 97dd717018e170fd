//! What a scene may ask for at most, and which files it may name.
//!
//! A scene of a few lines must not fill memory or keep the machine busy for hours before it is refused. Everything else
//! is bounded by the size of the files.
//!
//! | What | At most | Why |
//! |---|---|---|
//! | cells of all planes | 268 million (2²⁸) | results of bands stay in memory, 25 to 49 bytes a cell: up to 13 GB |
//! | pixels of all cameras | 25 million | a pixel takes some 200 bytes while a run lasts |
//! | luminaires | 100,000 | a line of TOML may ask for an array of them; a million took 0.6 GB |
//! | sensors of arrays | 100,000 | as luminaires |
//! | triangles of all openings | 2 million | a ball has 320: mesh and BVH take some 150 bytes each |
//! | samples of a surface | 1 million | some 1 kB each while a run lasts |
//! | corners of a face | 10,000 | ears are clipped in time by their square |
//! | angles of a photometric file | 7201 in each direction | tables are no larger than what follows in the file |
//! | nesting of lists and tables | 80 | the reader of TOML is recursive |
//! | scene file, MTL file | 64 MiB each | a million sensors fit |
//! | OBJ file | 16 GiB | read in blocks |
//! | photometric file | 16 MiB, also within a GLDF | a table of a quarter of a degree in both directions has less |
//! | GLDF file | 128 MiB, 10,000 files in it | it holds pictures too; no more than two of its files are unpacked |
//! | XML | 2 million elements and texts | a table of a quarter of a degree has as many |
//! | texture | 256 MiB, 67 million pixels (2²⁶) | small files may promise many; a JPEG takes up to 9 bytes a pixel |
//!
//! A file that a scene names is a regular file in the folder of the scene file, or in a folder below it; `..`, links
//! and absolute paths count by where they lead. Further folders are those the user gives ([`Scene::load_with`],
//! `--include`). So a scene from elsewhere can't read what nobody pointed to, nor quote it in a message. The same holds
//! for what the files name in turn: MTL files and textures. A file of tilt factors lies in its photometric file's own
//! folder.
//!
//! [`Scene::load_with`]: crate::scene::Scene::load_with

use std::fs;
use std::path::{Component, Path, PathBuf};

/// Most cells of all measuring planes together.
pub(crate) const MOST_CELLS: u64 = 1 << 28;
/// Most pixels of all cameras together.
pub(crate) const MOST_PIXELS: u64 = 25_000_000;
/// Most luminaires.
pub(crate) const MOST_LUMINAIRES: u64 = 100_000;
/// Most sensors of arrays.
pub(crate) const MOST_SENSORS: u64 = 100_000;
/// Most triangles of all luminous openings together.
pub(crate) const MOST_OPENING_TRIANGLES: usize = 2_000_000;
/// Largest files read, bytes.
pub(crate) const LARGEST_SCENE: u64 = 64 << 20;
pub(crate) const LARGEST_MTL: u64 = 64 << 20;
pub(crate) const LARGEST_TEXTURE: u64 = 256 << 20;
pub(crate) const LARGEST_PHOTOMETRY: u64 = 16 << 20;
pub(crate) const LARGEST_GLDF: u64 = 128 << 20;
/// Most files in a GLDF, and most elements and texts of an XML file.
pub(crate) const MOST_FILES: usize = 10_000;
pub(crate) const MOST_NODES: u32 = 2_000_000;
pub(crate) const LARGEST_OBJ: u64 = 16 << 30;

/// The folders whose files a scene may name.
pub(crate) struct AllowedFolders {
    /// Without links and `..`.
    folders: Vec<PathBuf>,
}

impl AllowedFolders {
    /// The scene file's own folder, and those the user gives.
    pub(crate) fn of(scene: &Path, include: &[PathBuf]) -> Self {
        let own = scene.parent().unwrap_or(Path::new(""));
        let folders = std::iter::once(own).chain(include.iter().map(PathBuf::as_path));
        Self { folders: folders.filter_map(|folder| fs::canonicalize(Path::new(".").join(folder)).ok()).collect() }
    }

    /// Whether a file lies in one of them, wherever links lead; a file that isn't there, by its name.
    pub(crate) fn holds(&self, file: &Path) -> bool {
        let real = fs::canonicalize(file).unwrap_or_else(|_| by_name(file));
        self.folders.iter().any(|folder| real.starts_with(folder))
    }
}

/// Where a file that isn't there would lie: `..` taken back, links of its folder followed as far as that exists.
fn by_name(file: &Path) -> PathBuf {
    let folder = file.parent().unwrap_or(Path::new(""));
    if let (Ok(folder), Some(name)) = (fs::canonicalize(Path::new(".").join(folder)), file.file_name()) {
        return folder.join(name);
    }
    let mut whole = PathBuf::new();
    for part in std::path::absolute(file).unwrap_or_else(|_| file.to_owned()).components() {
        match part {
            Component::ParentDir => drop(whole.pop()),
            part => whole.push(part),
        }
    }
    whole
}
