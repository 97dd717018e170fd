//! Files that are whole or not there, under names that stay in their folder.

use std::collections::HashSet;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::error::Error;

/// What a file's content is written to.
pub(crate) type Writer = BufWriter<File>;

/// Names that belong to other results, and those Windows keeps for devices.
const RESERVED: [&str; 11] =
    ["sensors", "groups", "summary", "report", "con", "prn", "aux", "nul", "convergence", "trees", "paper"];

/// Longest file name without its ending, characters.
const LONGEST: usize = 60;

/// File names (without ending) for things named by a user: letters, digits, `-`, `_`, `.` and spaces stay, anything
/// else becomes `_`. No name leaves the folder, is hidden, or equals another in any case of letters; a second one gets
/// `-2`.
pub fn stems(names: &[&str]) -> Vec<String> {
    stems_with_cameras(names, &[]).0
}

/// The same for planes and for cameras, which also write a file `<stem>-lux`.
pub fn stems_with_cameras(planes: &[&str], cameras: &[&str]) -> (Vec<String>, Vec<String>) {
    let mut taken: HashSet<String> = RESERVED.iter().map(|&name| name.into()).collect();
    let planes = planes.iter().map(|name| first_free(&safe(name, LONGEST), &[""], &mut taken)).collect();
    let cameras = cameras.iter().map(|name| first_free(&safe(name, LONGEST), &["", "-lux"], &mut taken)).collect();
    (planes, cameras)
}

/// A name made of harmless characters, at most so many.
pub(crate) fn safe(name: &str, longest: usize) -> String {
    let harmless = |c: char| if c.is_alphanumeric() || " -_.".contains(c) { c } else { '_' };
    let name: String = name.chars().take(longest).map(harmless).collect();
    let name = name.trim().trim_start_matches('.').trim_end_matches('.').trim();
    if name.is_empty() { "plane".into() } else { name.into() }
}

/// `stem`, or `stem-2`, `stem-3` … where that with one of the `endings` is taken.
pub(crate) fn first_free(stem: &str, endings: &[&str], taken: &mut HashSet<String>) -> String {
    let numbered = (2..).map(|number: u32| format!("{stem}-{number}"));
    let files =
        |name: &str| -> Vec<String> { endings.iter().map(|ending| format!("{name}{ending}").to_lowercase()).collect() };
    let free = std::iter::once(stem.to_owned())
        .chain(numbered)
        .find(|name| files(name).iter().all(|file| !taken.contains(file)))
        .expect("there is no end of numbers");
    taken.extend(files(&free));
    free
}

/// Writes a file under a temporary name beside `path` and renames it; on an error neither remains.
pub(crate) fn write_whole(path: &Path, content: &mut dyn FnMut(&mut Writer) -> io::Result<()>) -> Result<(), Error> {
    let mut attempt = || {
        let (temporary, file) = Temporary::beside(path)?;
        let mut out = BufWriter::new(file);
        content(&mut out)?;
        out.flush()?;
        drop(out);
        temporary.rename(path)
    };
    attempt().map_err(|source| Error::Write { path: path.to_owned(), source })
}

/// A folder that one command has for itself, until this is dropped or the process ends, in any way.
#[must_use = "the folder is free as soon as this is dropped"]
pub struct Claim {
    _locked: Option<File>,
}

impl Claim {
    /// Makes `folder` where it's missing, keeps other commands out of it, and checks that files can be made in it, so
    /// that a long run doesn't end in an error that could have come first. Where the system can't lock folders, nothing
    /// does.
    pub fn of(folder: &Path) -> Result<Self, Error> {
        let refused = |source| Error::Write { path: folder.to_owned(), source };
        std::fs::create_dir_all(folder).map_err(refused)?;
        let locked = File::open(folder).ok();
        if let Some(Err(TryLockError::WouldBlock)) = locked.as_ref().map(File::try_lock) {
            return Err(Error::Usage(format!(
                "{}: found another luxmap at work, expected a folder at rest; wait, or choose another with `output`",
                folder.display()
            )));
        }
        remove_leftovers(folder);
        Temporary::beside(&folder.join("check")).map_err(refused)?;
        Ok(Self { _locked: locked })
    }
}

/// Temporary files that are being written.
static UNDER_WAY: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn under_way() -> MutexGuard<'static, Vec<PathBuf>> {
    UNDER_WAY.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes all files that are not whole yet: the process ends. Threads that begin another file from now on wait for
/// ever.
pub(crate) fn remove_temporaries() {
    let paths = under_way();
    paths.iter().for_each(|path| remove(path));
    std::mem::forget(paths);
}

/// Writes files that belong together: `write` puts them into a folder of its own inside `folder` and returns their
/// paths; only when all are whole they get their places in `folder`. On an error none does, and what was there stays.
pub(crate) fn write_together(
    folder: &Path,
    write: &mut dyn FnMut(&Path) -> Result<Vec<PathBuf>, Error>,
) -> Result<Vec<PathBuf>, Error> {
    let at_home = |path: &Path| path.file_name().map_or_else(|| folder.to_owned(), |name| folder.join(name));
    let stage = Temporary::folder(folder).map_err(|source| Error::Write { path: folder.to_owned(), source })?;
    let written = write(&stage.path).map_err(|error| match error {
        Error::Write { path, source } => Error::Write { path: at_home(&path), source },
        other => other,
    })?;
    if let Some(home) = written.iter().map(|path| at_home(path)).find(|home| home.is_dir()) {
        return Err(Error::Write { path: home, source: io::ErrorKind::IsADirectory.into() });
    }
    let place = |path: PathBuf| {
        let home = at_home(&path);
        match std::fs::rename(path, &home) {
            Ok(()) => Ok(home),
            Err(source) => Err(Error::Write { path: home, source }),
        }
    };
    written.into_iter().map(place).collect()
}

/// Removes what processes that were killed have left in `folder` on their way to a whole file. Where the system doesn't
/// say which processes live, nothing is removed.
fn remove_leftovers(folder: &Path) {
    let processes = Path::new("/proc");
    if !processes.join("self").exists() {
        return;
    }
    let is_left = |name: &str| {
        let numbers = name.strip_prefix(".luxmap-")?.strip_suffix(".tmp")?.split_once('-')?;
        let (process, _): (u32, u32) = (numbers.0.parse().ok()?, numbers.1.parse().ok()?);
        Some(process == std::process::id() || !processes.join(process.to_string()).exists())
    };
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_name().to_str().and_then(is_left) == Some(true) {
            remove(&entry.path());
        }
    }
}

/// Removes a temporary file or folder. One that can't be removed does no harm.
fn remove(path: &Path) {
    if std::fs::remove_file(path).is_err() {
        let _ = std::fs::remove_dir_all(path);
    }
}

/// A file, or a folder, that is removed unless it gets its final name.
struct Temporary {
    path: PathBuf,
    renamed: bool,
}

impl Temporary {
    /// A new file in the folder of `path`.
    fn beside(path: &Path) -> io::Result<(Self, File)> {
        Self::make(path, &|path| OpenOptions::new().write(true).create_new(true).open(path))
    }

    /// A new folder in `parent`.
    fn folder(parent: &Path) -> io::Result<Self> {
        Ok(Self::make(&parent.join("folder"), &|path| std::fs::create_dir(path))?.0)
    }

    /// What `make` makes under the first name that is free.
    fn make<T>(path: &Path, make: &dyn Fn(&Path) -> io::Result<T>) -> io::Result<(Self, T)> {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        loop {
            let number = NUMBER.fetch_add(1, Ordering::Relaxed);
            let temporary = path.with_file_name(format!(".luxmap-{}-{number}.tmp", std::process::id()));
            let mut under_way = under_way();
            match make(&temporary) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                made => {
                    let made = made?;
                    under_way.push(temporary.clone());
                    return Ok((Self { path: temporary, renamed: false }, made));
                }
            }
        }
    }

    /// Gives the file its name, replacing an older one.
    fn rename(mut self, path: &Path) -> io::Result<()> {
        let _kept = under_way();
        std::fs::rename(&self.path, path)?;
        self.renamed = true;
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.renamed {
            remove(&self.path);
        }
        under_way().retain(|path| *path != self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A child that has ended is no process any more; that of the tests' own parent lives.
    #[cfg(target_os = "linux")]
    #[test]
    fn only_leftovers_of_the_dead_are_removed() {
        let folder = std::env::temp_dir().join(format!("luxmap-leftovers-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder for temporary files");
        let mut child = std::process::Command::new("true").spawn().expect("a process");
        let dead = child.id();
        child.wait().expect("it ends");
        let (alive, own) = (std::os::unix::process::parent_id(), std::process::id());
        let kept = [format!(".luxmap-{alive}-0.tmp"), format!(".luxmap-{dead}.tmp"), format!("x.luxmap-{dead}-0.tmp")];
        let left = [format!(".luxmap-{dead}-3.tmp"), format!(".luxmap-{own}-0.tmp")];
        kept.iter().chain(&left).for_each(|name| std::fs::write(folder.join(name), "").expect("room for a file"));
        remove_leftovers(&folder);
        assert!(kept.iter().all(|name| folder.join(name).exists()));
        assert!(left.iter().all(|name| !folder.join(name).exists()));
        std::fs::remove_dir_all(&folder).expect("it is ours");
    }

    #[test]
    fn no_name_leaves_the_folder_or_meets_another() {
        let names =
            ["../x", "/etc/passwd", "..", "", "a/b", "a\\b", "A_b", "a_b-2", "sensors", "NUL", "Büro 1", "x\0y"];
        let stems = stems(&names);
        let expected = [
            "_x",
            "_etc_passwd",
            "plane",
            "plane-2",
            "a_b",
            "a_b-2",
            "A_b-3",
            "a_b-2-2",
            "sensors-2",
            "NUL-2",
            "Büro 1",
            "x_y",
        ];
        assert_eq!(stems, expected);
        let (planes, cameras) = stems_with_cameras(&["floor", "view-lux"], &["View", "Floor", "view-2-lux"]);
        assert_eq!(planes, ["floor", "view-lux"]);
        assert_eq!(cameras, ["View-2", "Floor-2", "view-2-lux-2"]);
    }
}
