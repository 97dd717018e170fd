//! MTL files: where an OBJ's `mtllib` lines lead, and which of their materials a `usemtl` means.
//!
//! Programs write names that only they can find: folders of another machine, capitals that a Windows disk doesn't mind,
//! several files in a line, blanks within a name. What is taken in a name's place is told; what isn't found, where it
//! was looked for. An OBJ that names no MTL file at all goes with the one of its own name, as every program writes the
//! two.

use std::collections::{BTreeSet, HashMap};
use std::fs;
use std::path::{Path, PathBuf};

use super::fallback::ALL;
use super::fields::{Placed, closest, section};
use super::file::MaterialSection;
use super::lines::{text, without_comment};
use super::mtl::{self, MtlMaterial};
use super::obj::Obj;
use super::read::{OUTSIDE, Reader, Sections};
use crate::error::{InputError, Location};
use crate::files::limits::LARGEST_MTL;
use crate::text::listed;
use crate::text::quoted;

/// Longest name of a file that systems take, bytes; no longer one is looked for in other spellings.
const LONGEST_NAME: usize = 255;

/// What the MTL files of an OBJ say.
#[derive(Default)]
pub(super) struct Library {
    materials: HashMap<String, MtlMaterial>,
    /// Names by their lower case, with and without a comment; whether a comment was taken off comes first.
    spellings: HashMap<String, Vec<(bool, String)>>,
    /// MTL files that are named and not there.
    missing: Vec<String>,
    /// One that lies outside the folders allowed, and its folder.
    outside: Option<(String, PathBuf)>,
    /// The MTL file of the OBJ's own name, where others are named and missing.
    namesake: Option<PathBuf>,
}

impl Library {
    /// Whether it has a material of just this name.
    pub(super) fn holds(&self, name: &str) -> bool {
        self.materials.contains_key(name)
    }

    /// Names of its materials.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.materials.keys().map(String::as_str)
    }

    /// The material of this name; else the only one whose name differs by capitals or by a comment behind it.
    pub(super) fn find(&self, name: &str) -> Option<&MtlMaterial> {
        if let Some(material) = self.materials.get(name) {
            return Some(material);
        }
        let plain = without_comment(name);
        let of = |name: &str| self.spellings.get(&name.to_lowercase()).into_iter().flatten();
        // Two names that differ in what stands behind # are two names, as "Material #25" and "Material #26".
        let with_comment = of(plain).filter(|(commented, _)| plain != name && !commented);
        let near: BTreeSet<&str> = of(name).chain(with_comment).map(|(_, name)| name.as_str()).collect();
        let same_case: Vec<&str> = near.iter().copied().filter(|other| without_comment(other) == plain).collect();
        let only = match (same_case.as_slice(), near.len()) {
            ([only], _) => only,
            (_, 1) => near.first()?,
            _ => return None,
        };
        self.materials.get(*only)
    }

    fn add(&mut self, materials: Vec<MtlMaterial>) {
        for material in materials {
            let (name, plain) = (material.name.as_str(), without_comment(&material.name));
            for (commented, spelling) in [(false, name), (true, plain)] {
                if !commented || plain != name {
                    let all = self.spellings.entry(spelling.to_lowercase()).or_default();
                    if !all.iter().any(|(_, known)| known == name) {
                        all.push((commented, name.to_owned()));
                    }
                }
            }
            self.materials.insert(material.name.clone(), material);
        }
    }
}

impl Reader {
    /// The materials of all MTL files that an OBJ names.
    pub(super) fn library(&mut self, path: &Path, obj: &Obj, sections: &Sections<'_>) -> Result<Library, InputError> {
        let mut library = Library::default();
        if self.remembers(path) {
            return Ok(library);
        }
        let mut folders = Folders::default();
        let mut seen = BTreeSet::new();
        for request in &obj.libraries {
            for name in names_of(path, &request.value) {
                let Some(file) = self.locate(path, request, &name, &mut folders, &mut library) else { continue };
                if !seen.insert(file.clone()) {
                    continue;
                }
                match self.read(&file, LARGEST_MTL) {
                    Ok(bytes) => library.add(mtl::parse(&file, &bytes)?),
                    Err(why) => self.left_out(request, &name, &why, &mut library),
                }
            }
        }
        if library.materials.is_empty() {
            self.namesake(path, obj, sections, &mut folders, &mut library)?;
        }
        Ok(library)
    }

    /// The file that a name of a `mtllib` line means; it may be one that can't be read.
    fn locate(
        &mut self,
        obj: &Path,
        request: &Placed<String>,
        name: &str,
        folders: &mut Folders,
        library: &mut Library,
    ) -> Option<PathBuf> {
        let paths = spellings(obj, name);
        if let Some(path) = paths.iter().find(|path| path.is_file() && self.reach.holds(path)) {
            return Some(path.clone());
        }
        let own = obj.parent().unwrap_or(Path::new(""));
        let named = paths[paths.len() - 1].parent().unwrap_or(own);
        let base = name.rsplit(['/', '\\']).next().unwrap_or(name);
        let outside = paths.iter().find(|path| !self.reach.holds(path));
        let places: Vec<&Path> = if named == own { vec![own] } else { vec![named, own] };
        let places = || places.iter().copied().filter(|folder| self.reach.holds(&Path::new(".").join(folder)));
        let instead = (base.len() <= LONGEST_NAME).then(|| places().find_map(|folder| folders.find(folder, base)));
        if let Some(instead) = instead.flatten() {
            let why = if outside.is_some() { OUTSIDE } else { "there is no such file" };
            let taken = instead.file_name().unwrap_or_default().to_string_lossy();
            let place = if instead.parent() == Some(own) { " beside the OBJ file" } else { "" };
            let (found, taken) = (quoted(name), quoted(&taken));
            self.warnings.push(format!("{}: MTL file {found}: {why}; {taken}{place} taken instead", request.at));
            return Some(instead);
        }
        if let Some(path) = outside {
            library.outside.get_or_insert_with(|| (name.to_owned(), folder_of(path)));
            let cure = format!("--include {} allows it", Location::file(&folder_of(path)));
            self.warnings.push(format!("{}: MTL file {} left out ({OUTSIDE}); {cure}", request.at, quoted(name)));
            return None;
        }
        let mut looked: Vec<String> = places().map(|folder| Location::file(&folder.join(base)).to_string()).collect();
        looked.truncate(if base.len() <= LONGEST_NAME { 2 } else { 0 });
        let looked = match looked.join(" and ") {
            nowhere if nowhere.is_empty() => String::new(),
            places => format!(": looked for {places}, in capitals or not"),
        };
        self.left_out(request, name, &format!("there is no such file{looked}"), library);
        None
    }

    fn left_out(&mut self, request: &Placed<String>, name: &str, why: &str, library: &mut Library) {
        self.warnings.push(format!("{}: MTL file {} left out ({why})", request.at, quoted(name)));
        library.missing.push(name.to_owned());
    }

    /// The MTL file of the OBJ's own name: taken where the OBJ names none and has materials of which nothing else is
    /// said, and a hint where it names others.
    fn namesake(
        &mut self,
        path: &Path,
        obj: &Obj,
        sections: &Sections<'_>,
        folders: &mut Folders,
        library: &mut Library,
    ) -> Result<(), InputError> {
        let told = |name: &str| sections.contains_key(name) || sections.contains_key(without_comment(name));
        let mut open = obj.materials.iter().filter(|material| !told(&material.value)).peekable();
        let stem = path.file_stem().map(|stem| text(stem.as_encoded_bytes())).filter(|_| open.peek().is_some());
        let own = path.parent().unwrap_or(Path::new(""));
        let Some(file) = stem.and_then(|stem| folders.find(own, &format!("{stem}.mtl"))) else { return Ok(()) };
        if !obj.libraries.is_empty() {
            library.namesake = Some(file);
            return Ok(());
        }
        let Ok(bytes) = self.read(&file, LARGEST_MTL) else { return Ok(()) };
        library.add(mtl::parse(&file, &bytes)?);
        if open.any(|material| library.find(&material.value).is_some()) {
            let taken = quoted(&file.file_name().unwrap_or_default().to_string_lossy());
            self.warnings.push(format!("{}: no mtllib line; {taken} beside it taken", Location::file(path)));
        }
        Ok(())
    }
}

/// The folder of a file, `..` and links followed as far as it exists.
fn folder_of(path: &Path) -> PathBuf {
    let folder = path.parent().unwrap_or(Path::new(""));
    fs::canonicalize(Path::new(".").join(folder)).unwrap_or_else(|_| folder.to_owned())
}

/// What lies in folders, by names in lower case.
#[derive(Default)]
struct Folders(HashMap<PathBuf, HashMap<String, Vec<PathBuf>>>);

impl Folders {
    /// Most files of a folder that are looked at.
    const MOST: usize = 100_000;

    /// The file of a name, else the only one whose name differs by capitals only.
    fn find(&mut self, folder: &Path, name: &str) -> Option<PathBuf> {
        let files = self.0.entry(folder.to_owned()).or_insert_with(|| {
            let mut files: HashMap<String, Vec<PathBuf>> = HashMap::new();
            let entries = fs::read_dir(Path::new(".").join(folder)).into_iter().flatten().flatten();
            for entry in entries.take(Self::MOST) {
                let name = entry.file_name();
                files.entry(text(name.as_encoded_bytes()).to_lowercase()).or_default().push(folder.join(name));
            }
            files
        });
        let alike = files.get(&name.to_lowercase())?;
        let exact =
            alike.iter().find(|path| path.file_name().is_some_and(|file| text(file.as_encoded_bytes()) == name));
        let only = if let [only] = alike.as_slice() { Some(only) } else { None };
        exact.or(only).filter(|path| path.is_file()).cloned()
    }
}

/// Where a file may lie that an OBJ names: as it stands there, or with a Windows program's backslashes.
fn spellings(obj: &Path, name: &str) -> Vec<PathBuf> {
    let folder = obj.parent().unwrap_or(Path::new(""));
    let mut paths = vec![folder.join(name)];
    if name.contains('\\') {
        paths.push(folder.join(name.replace('\\', "/")));
    }
    paths
}

/// The names of a `mtllib` line: the whole line as one, which may hold blanks, where there is such a file; else one
/// after another, each in quotes, up to `.mtl`, or a word.
fn names_of(obj: &Path, line: &str) -> Vec<String> {
    let is_there = |name: &str| spellings(obj, name).iter().any(|path| path.is_file());
    // Some programs write a blank within a name as "\\ ".
    let unescaped = line.replace("\\ ", " ");
    for whole in [line, &unescaped, line.trim_matches('"'), without_comment(line)] {
        if is_there(whole) {
            return vec![whole.to_owned()];
        }
    }
    let mut names = Vec::new();
    let escaped = without_comment(line).replace("\\ ", "\0");
    let mut rest = escaped.trim();
    while !rest.is_empty() {
        let (name, behind) = match rest.strip_prefix('"').and_then(|quoted| quoted.split_once('"')) {
            Some(parts) => parts,
            None => rest.split_at(end_of_name(rest)),
        };
        names.push(name.trim().replace('\0', " "));
        rest = behind.trim_start();
    }
    names
}

/// Where an unquoted name ends: behind the first word that ends with `.mtl`; where there is none, behind the first
/// word.
fn end_of_name(line: &str) -> usize {
    let mut start = 0;
    for word in line.split([' ', '\t']) {
        let end = start + word.len();
        if word.get(word.len().saturating_sub(4)..).is_some_and(|ending| ending.eq_ignore_ascii_case(".mtl")) {
            return end;
        }
        start = end + 1;
    }
    line.find([' ', '\t']).unwrap_or(line.len())
}

/// Refuses a `[material.NAME]` that no mesh knows.
pub(super) fn check_names(sections: &[MaterialSection], known: &BTreeSet<String>) -> Result<(), InputError> {
    let is_strange = |section: &&MaterialSection| section.name != ALL && !known.contains(&section.name);
    let Some(stranger) = sections.iter().find(is_strange) else { return Ok(()) };
    let found = format!("unknown material {}", quoted(&stranger.name));
    let names = || known.iter().map(String::as_str);
    if known.is_empty() {
        return Err(InputError::new(stranger.at.clone(), found, "a [[mesh]] that uses it"));
    }
    let error = InputError::new(stranger.at.clone(), found, format!("one that a mesh uses: {}", listed(names())));
    Err(match closest(&stranger.name, names()) {
        Some(near) => error.hint(format!("did you mean {}?", quoted(near))),
        None => error,
    })
}

/// Nothing says what these materials reflect.
pub(super) fn unset(names: &[Placed<String>], library: &Library) -> InputError {
    let first = &names[0];
    let found = match names {
        [one] => format!("no reflectance for material {}", quoted(&one.value)),
        _ => format!("no reflectance for materials {}", listed(names.iter().map(|name| name.value.as_str()))),
    };
    let expected = "Kd in an MTL file, or a section in the scene file";
    let mut hint = format!("add {} with reflectance = 0.5, say", section(&first.value));
    hint += "; [material.\"*\"] or --reflectance 0.5 speaks for all that are left";
    if !library.missing.is_empty() {
        hint += &format!("; the MTL file {} is missing", listed(library.missing.iter().map(String::as_str)));
    }
    if let Some((name, folder)) = &library.outside {
        let (name, folder) = (quoted(name), Location::file(folder));
        hint += &format!("; the MTL file {name} lies outside the scene's folder: --include {folder} allows it");
    }
    if let Some(namesake) = library.namesake.as_ref().and_then(|path| path.file_name()) {
        hint += &format!("; is it {}, which lies beside the OBJ file?", quoted(&namesake.to_string_lossy()));
    }
    InputError::new(first.at.clone(), found, expected).hint(hint)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_may_name_several_files() {
        for (line, names) in [
            ("a.mtl", vec!["a.mtl"]),
            ("a.mtl b.MTL", vec!["a.mtl", "b.MTL"]),
            ("my room.mtl other one.mtl", vec!["my room.mtl", "other one.mtl"]),
            ("\"my room.mtl\" b.mtl # both", vec!["my room.mtl", "b.mtl"]),
            ("my\\ room.mtl", vec!["my room.mtl"]),
            ("C:\\a b\\room.mtl", vec!["C:\\a b\\room.mtl"]),
            ("one two", vec!["one", "two"]),
            ("a.mtl\tb", vec!["a.mtl", "b"]),
            ("", vec![]),
            ("\"", vec!["\""]),
            ("\u{e4}\u{fc}\u{e4}", vec!["\u{e4}\u{fc}\u{e4}"]),
        ] {
            assert_eq!(names_of(Path::new("no such folder/room.obj"), line), names, "{line}");
        }
    }
}
