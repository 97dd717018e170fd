//! Looks for a private Embree 4, and makes it fit this system if it is a newer system's. Nothing is linked, and a build
//! without Embree succeeds: luxmap loads it when it runs (`src/embree/load.rs`), also from where this has found it.
//!
//! Looked for in this order: `EMBREE_DIR`, the project's own `.embree/` (made by `scripts/setup.sh`).

#[path = "src/embree/elf.rs"]
mod elf;
#[path = "src/embree/folders.rs"]
mod folders;

use std::env;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::Command;

fn main() {
    for file in ["build.rs", "src/embree/elf.rs", "src/embree/folders.rs"] {
        println!("cargo::rerun-if-changed={file}");
    }
    println!("cargo::rerun-if-env-changed=EMBREE_DIR");
    let Some((prefix, library)) = find() else { return };
    println!("cargo::rerun-if-changed={}", library.display());
    let Some(folder) = library.parent() else { return };
    let folder = if lacks_versions(&library) {
        fitted(&library, folder).unwrap_or_else(|why| {
            println!("cargo::warning={} can't be made to fit this system: {why}", library.display());
            folder.to_path_buf()
        })
    } else {
        folder.to_path_buf()
    };
    println!("cargo::rustc-env=LUXMAP_EMBREE_PREFIX={}", prefix.display());
    println!("cargo::rustc-env=LUXMAP_EMBREE_LIBRARIES={}", folder.display());
}

/// A private Embree: the folder looked under, and its library.
fn find() -> Option<(PathBuf, PathBuf)> {
    let project = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo names the package's folder"));
    if let Some(folder) = env::var_os("EMBREE_DIR").filter(|folder| !folder.is_empty()) {
        let folder = project.join(folder);
        let library = folders::library_under(&folder);
        if library.is_none() {
            let (folder, library) = (folder.display(), folders::LIBRARY[0]);
            println!("cargo::warning=EMBREE_DIR is {folder}, but {folder} holds no lib/{library}");
        }
        return Some((folder, library?));
    }
    let folder = project.join(".embree/usr");
    let library = folders::library_under(&folder)?;
    Some((folder, library))
}

/// Whether the system's libraries are older than those that a library was made for, as far as glibc's `ldd` can tell.
fn lacks_versions(library: &Path) -> bool {
    let Ok(answer) = Command::new("ldd").arg(library).env("LC_ALL", "C").output() else { return false };
    let says = |text: &[u8]| {
        String::from_utf8_lossy(text).lines().any(|line| line.contains("version `") && line.contains("not found"))
    };
    says(&answer.stdout) || says(&answer.stderr)
}

/// A folder of the build with copies of Embree, and of the TBB beside it, that fit this system.
fn fitted(library: &Path, folder: &Path) -> io::Result<PathBuf> {
    let fitted = Path::new(&env::var_os("OUT_DIR").expect("cargo names the output folder")).join("embree");
    fs::create_dir_all(&fitted)?;
    for (from, name) in [(library.to_path_buf(), folders::LIBRARY[0]), (folder.join(folders::TBB), folders::TBB)] {
        if !from.exists() {
            continue; // TBB: the system's then
        }
        let mut bytes = fs::read(from)?;
        elf::fit(&mut bytes).ok_or_else(|| io::Error::other("it is no ELF library as expected"))?;
        // Under another name first: a library that a running program has loaded must not change.
        let new = fitted.join(format!("{name}.new"));
        // In small pieces: the system keeps a file as it was written, and a program that loads one written at once has
        // 16 MB more of it mapped than it uses.
        let mut file = File::create(&new)?;
        bytes.chunks(1 << 16).try_for_each(|part| file.write_all(part))?;
        fs::rename(&new, fitted.join(name))?;
    }
    Ok(fitted)
}
