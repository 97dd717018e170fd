//! Finds Embree's library and loads it: once, when it is first needed, and for as long as the program runs.
//!
//! Nothing is linked, so that programs and other crates build and start without Embree; only rays need it.
#![allow(unsafe_code, reason = "loading a library runs its code")]

use std::env;
use std::ffi::c_void;
use std::fs;
use std::mem;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use libloading::Library;

use super::folders::{LIBRARY, TBB, library_in, library_under};
use super::sys::Interface;
use crate::error::Error;

/// Embree as loaded into this process.
pub(super) struct Embree {
    pub(super) interface: Interface,
    /// The library's file; a bare name where the system has found it.
    pub(super) file: PathBuf,
}

/// Embree; looked for once, so a failure stays. Cost: some 10 ms the first time.
pub(super) fn embree() -> Result<&'static Embree, Error> {
    static LOADED: OnceLock<Result<Embree, String>> = OnceLock::new();
    let loaded = LOADED.get_or_init(|| Places::of_this_program().load());
    loaded.as_ref().map_err(|why| Error::Embree(why.clone()))
}

/// Where to look.
struct Places {
    /// What the user says: `EMBREE_DIR`.
    named: Option<PathBuf>,
    /// The folder of the program, or of the shared library that luxmap is part of.
    beside: Option<PathBuf>,
    /// What `build.rs` found: the folder that it looked under, and the one that holds what fits this system.
    built: Option<(PathBuf, PathBuf)>,
}

impl Places {
    fn of_this_program() -> Self {
        let built = option_env!("LUXMAP_EMBREE_PREFIX").zip(option_env!("LUXMAP_EMBREE_LIBRARIES"));
        Self {
            named: env::var_os("EMBREE_DIR").filter(|folder| !folder.is_empty()).map(PathBuf::from),
            beside: own_file().and_then(|file| Some(file.parent()?.to_path_buf())),
            built: built.map(|(prefix, libraries)| (prefix.into(), libraries.into())),
        }
    }

    /// The library in `EMBREE_DIR`, which stands alone if it is set.
    fn named(&self) -> Option<Result<PathBuf, String>> {
        let named = self.named.as_ref()?;
        let is_named =
            |prefix: &Path| fs::canonicalize(prefix).is_ok_and(|at| fs::canonicalize(named).is_ok_and(|to| at == to));
        let fitted =
            self.built.as_ref().filter(|(prefix, _)| is_named(prefix)).and_then(|(_, folder)| library_in(folder));
        let missing = || format!("EMBREE_DIR is {0}, but {0} holds no lib/{1}", named.display(), LIBRARY[0]);
        Some(fitted.or_else(|| library_under(named)).ok_or_else(missing))
    }

    /// The folders to look in otherwise, in this order; the system's come last.
    fn folders(&self) -> Vec<PathBuf> {
        let beside = self.beside.iter().flat_map(|folder| [folder.join("../lib/luxmap"), folder.clone()]);
        beside.chain(self.built.iter().map(|(_, libraries)| libraries.clone())).collect()
    }

    /// The first library that can be loaded; else why none can.
    fn load(&self) -> Result<Embree, String> {
        if let Some(file) = self.named() {
            let file = file?;
            return load(&file).map_err(|why| format!("{} can't be loaded: {why}", file.display()));
        }
        let folders = self.folders();
        let files = folders.iter().filter_map(|folder| library_in(folder)).chain(LIBRARY.map(PathBuf::from));
        let mut reasons = Vec::new();
        for file in files {
            match load(&file) {
                Ok(embree) => return Ok(embree),
                // What the loader says of a name that it does not know.
                Err(why) if why.starts_with(&format!("{}: cannot open", file.display())) => (),
                Err(why) => reasons.push(format!("{} can't be loaded: {why}; ", file.display())),
            }
        }
        let folders: String = folders.iter().map(|folder| format!("{}, ", folder.display())).collect();
        Err(format!(
            "{}found no {} to use in {folders}the system's folders; run `make setup` in luxmap's sources, install it, \
             or set EMBREE_DIR to the folder that holds its lib",
            reasons.concat(),
            LIBRARY[0]
        ))
    }
}

fn load(file: &Path) -> Result<Embree, String> {
    // The loader looks for TBB in the system's folders only, but one of that name that is loaded already will do.
    let tbb = file.parent().map(|folder| folder.join(TBB)).filter(|tbb| tbb.exists());
    if let Some(tbb) = tbb {
        // SAFETY: TBB's start-up code asks nothing of its caller.
        let tbb = unsafe { Library::new(&tbb) }.map_err(|why| one_line(&why))?;
        start_streams(&tbb);
        mem::forget(tbb); // never unloaded
    }
    // SAFETY: as for TBB.
    let library = unsafe { Library::new(file) }.map_err(|why| one_line(&why))?;
    // SAFETY: its name says that it is Embree 4; the device tells its minor release before anything is asked of it. It
    // stays loaded.
    let interface = unsafe { Interface::of(&library) }.map_err(|why| one_line(&why))?;
    mem::forget(library);
    Ok(Embree { interface, file: file.to_path_buf() })
}

/// Has C++'s standard library make `std::cout` and its like, which Embree writes to where its own settings say so. From
/// GCC 13 on, the standard library does that by itself; an older one waits for each program or library to ask for it,
/// which one compiled by a newer GCC no longer does (see `elf.rs`).
fn start_streams(library: &Library) {
    static INIT: [u64; 2] = [0; 2];
    // SAFETY: std::ios_base::Init::Init() has this type. What it makes has no members: it counts, in the library's own
    // memory and atomically, and may run any number of times.
    unsafe {
        if let Ok(init) = library.get::<unsafe extern "C" fn(*mut c_void)>("_ZNSt8ios_base4InitC1Ev\0") {
            init((&raw const INIT).cast_mut().cast());
        }
    }
}

/// What the loader says.
fn one_line(why: &libloading::Error) -> String {
    why.to_string().replace('\n', " ")
}

/// The file that holds this very function: a program, or a shared library such as a Python module.
fn own_file() -> Option<PathBuf> {
    let here = own_file as fn() -> Option<PathBuf> as usize;
    let holds = |line: &str| {
        let (from, to) = line.split_whitespace().next()?.split_once('-')?;
        let range = usize::from_str_radix(from, 16).ok()?..usize::from_str_radix(to, 16).ok()?;
        range.contains(&here).then(|| line.find('/').map(|path| PathBuf::from(&line[path..])))?
    };
    let maps = fs::read_to_string("/proc/self/maps").ok();
    maps.and_then(|maps| maps.lines().find_map(holds)).or_else(|| env::current_exe().ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder of its own with empty files.
    fn folder(name: &str, files: &[&str]) -> PathBuf {
        let folder = env::temp_dir().join(format!("luxmap-load-{}-{name}", std::process::id()));
        for file in files {
            let file = folder.join(file);
            fs::create_dir_all(file.parent().expect("a folder")).expect("can be made");
            fs::write(file, "").expect("can be written");
        }
        folder
    }

    #[test]
    fn folders_are_searched_in_the_order_told() {
        let library = LIBRARY[0];
        let files = ["bin/", "built/", "named/lib64/"].map(|folder| format!("{folder}{library}"));
        let at = folder("order", &files.each_ref().map(String::as_str));
        let built = Some((at.join("from"), at.join("built")));
        let mut places = Places { named: None, beside: Some(at.join("bin")), built };
        assert_eq!(places.named(), None);
        assert_eq!(places.folders(), [at.join("bin/../lib/luxmap"), at.join("bin"), at.join("built")]);

        places.named = Some(at.join("named"));
        assert_eq!(places.named(), Some(Ok(at.join("named/lib64").join(library))));

        // The folder that the build looked under: what was made to fit, not the library as it is.
        places.built = Some((at.join("bin/../named"), at.join("built")));
        assert_eq!(places.named(), Some(Ok(at.join("built").join(library))));

        places.named = Some(at.join("bin"));
        let missing = format!("EMBREE_DIR is {0}, but {0} holds no lib/{library}", at.join("bin").display());
        assert_eq!(places.named(), Some(Err(missing)));
        fs::remove_dir_all(at).expect("it is ours");
    }

    #[test]
    fn what_is_no_library_is_told_in_one_line() {
        let library = LIBRARY[0];
        let at = folder("broken", &[&format!("lib/{library}")]);
        let places = Places { named: Some(at.clone()), beside: None, built: None };
        let why = places.load().err().expect("the file is empty");
        assert!(why.starts_with(&format!("{} can't be loaded: ", at.join("lib").join(library).display())), "{why}");
        assert!(!why.contains('\n'), "{why}");
        fs::remove_dir_all(at).expect("it is ours");
    }

    #[test]
    fn a_program_finds_its_own_file() {
        let [own, program] = [own_file(), env::current_exe().ok()].map(|file| fs::canonicalize(file.expect("known")));
        assert_eq!(own.expect("is there"), program.expect("is there"));
    }
}
