//! Finds Embree 4, tells the linker where it is, and reads from *its* header the layouts that change between releases.
//!
//! Looked for in this order: `EMBREE_DIR`, the project's own `.embree/` (made by `scripts/setup.sh`), the system.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

/// Structs whose size depends on Embree's minor release, and the release the header belongs to.
const LAYOUTS: &str = "RTCHit|RTCRay|RTCRayHit|RTCRayQueryContext";
const RELEASE: &str = "RTC_VERSION(_MAJOR|_MINOR|_PATCH)?";

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=EMBREE_DIR");
    if let Err(sentence) = find_embree().and_then(|embree| {
        embree.link()?;
        embree.write_layouts()
    }) {
        println!("cargo::error={sentence}");
    }
}

/// An Embree 4 found on this machine.
struct Embree {
    /// The folder that holds `embree4/rtcore.h`.
    include: PathBuf,
    /// Where `libembree4.so` lies; none for the system's own, which the linker and the loader find by themselves.
    library: Option<PathBuf>,
}

fn find_embree() -> Result<Embree, String> {
    let project = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo names the package's folder"));
    if let Some(folder) = env::var_os("EMBREE_DIR").filter(|folder| !folder.is_empty()) {
        let folder = project.join(folder);
        return Embree::under(&folder).ok_or_else(|| {
            format!(
                "EMBREE_DIR is {0}, but {0} holds no include/embree4/rtcore.h and lib/libembree4.so",
                folder.display()
            )
        });
    }
    let system = || ["/usr", "/usr/local"].iter().find_map(|prefix| Embree::of_the_system(Path::new(prefix)));
    Embree::under(&project.join(".embree/usr")).or_else(system).ok_or_else(|| {
        "Embree 4 is missing: run `make setup`, or set EMBREE_DIR to the folder that holds its include and lib".into()
    })
}

impl Embree {
    /// An unpacked release, or what a package unpacks under `usr`: headers in `include`, library in `lib`, `lib64` or
    /// Debian's `lib/<architecture>`.
    fn under(prefix: &Path) -> Option<Self> {
        let include = header_folder(prefix)?;
        let debian = fs::read_dir(prefix.join("lib")).into_iter().flatten().flatten().map(|entry| entry.path());
        let library = [prefix.join("lib"), prefix.join("lib64")]
            .into_iter()
            .chain(debian.filter(|folder| folder.to_string_lossy().ends_with("-linux-gnu")))
            .find(|folder| ["so", "dylib"].iter().any(|end| folder.join(format!("libembree4.{end}")).exists()))?;
        Some(Self { include, library: Some(library) })
    }

    fn of_the_system(prefix: &Path) -> Option<Self> {
        Some(Self { include: header_folder(prefix)?, library: None })
    }

    /// Tells cargo how to link, and how the loader finds the library when a program of this package starts.
    fn link(&self) -> Result<(), String> {
        println!("cargo::rerun-if-changed={}", self.include.join("embree4").display());
        let Some(folder) = &self.library else { return Ok(()) };
        println!("cargo::rustc-link-search=native={}", folder.display());
        // Programs keep what they need beside them: where a private folder is moved away, they still start. It is no folder
        // to search for libraries: cargo would tell all programs that tests start to look there.
        let folder = &if private_loader(folder).is_some() { kept(folder)? } else { folder.clone() };
        let library = folder.display();
        let mut arguments = vec![format!("-Wl,-rpath,{library}")];
        // Debian 13's Embree needs Debian 13's C library. Where both lie in one private folder, programs start with that
        // folder's loader, and RPATH (not RUNPATH) passes the folder on to the libraries that libembree4 itself needs.
        if let Some(loader) = private_loader(folder) {
            arguments.push(format!("-Wl,--dynamic-linker={}", loader.display()));
            arguments.push(format!("-Wl,--disable-new-dtags,-rpath-link,{library}"));
        }
        arguments.iter().for_each(|argument| println!("cargo::rustc-link-arg={argument}"));
        // Arguments reach this package's programs only; those of others that depend on it pass them on (`fuzz/build.rs`).
        println!("cargo::metadata=link_arguments={}", arguments.join("\x1f"));
        Ok(())
    }

    /// Writes `embree.rs` into `OUT_DIR`: the layouts as the header found declares them.
    fn write_layouts(&self) -> Result<(), String> {
        let target = Path::new(&env::var_os("OUT_DIR").expect("cargo names the output folder")).join("embree.rs");
        bindgen::builder()
            .header_contents("embree.h", "#include <embree4/rtcore.h>")
            .clang_arg(format!("-I{}", self.include.display()))
            .allowlist_type(LAYOUTS)
            .allowlist_var(RELEASE)
            .derive_default(true)
            .formatter(bindgen::Formatter::None)
            .generate()
            .map_err(|why| format!("bindgen can't read {}/embree4/rtcore.h: {why}", self.include.display()))?
            .write_to_file(&target)
            .map_err(|why| format!("{}: can't be written: {why}", target.display()))
    }
}

/// A folder of the build with the files of a private folder: hard links where that is possible, else copies.
fn kept(folder: &Path) -> Result<PathBuf, String> {
    let kept = Path::new(&env::var_os("OUT_DIR").expect("cargo names the output folder")).join("embree");
    let fill = || {
        if kept.exists() {
            fs::remove_dir_all(&kept)?;
        }
        fs::create_dir_all(&kept)?;
        for entry in fs::read_dir(folder)? {
            let entry = entry?.path();
            // Names of libraries are links to others: what they lead to is kept under each name.
            let file = fs::canonicalize(&entry).unwrap_or_else(|_| entry.clone());
            if let (true, Some(name)) = (file.is_file(), entry.file_name()) {
                let place = kept.join(name);
                fs::hard_link(&file, &place).or_else(|_| fs::copy(&file, &place).map(drop))?;
            }
        }
        Ok(())
    };
    fill().map_err(|why: std::io::Error| format!("{}: can't be filled: {why}", kept.display()))?;
    Ok(kept)
}

fn header_folder(prefix: &Path) -> Option<PathBuf> {
    Some(prefix.join("include")).filter(|include| include.join("embree4/rtcore.h").exists())
}

/// The program loader beside a private C library, as in `.embree/`; none in the system's own folders.
fn private_loader(library: &Path) -> Option<PathBuf> {
    let entries = fs::read_dir(library).ok().filter(|_| !library.starts_with("/usr/lib"))?;
    entries
        .flatten()
        .map(|entry| entry.path())
        .find(|path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("ld-linux")))
}
