//! What the MTL files of an OBJ say, and which of their materials a `usemtl` means.

use std::collections::{BTreeSet, HashMap};
use std::path::PathBuf;

use super::fallback::ALL;
use super::fields::{Placed, closest, section};
use super::file::MaterialSection;
use super::lines::without_comment;
use super::mtl::MtlMaterial;
use crate::error::{InputError, Location};
use crate::text::listed;
use crate::text::quoted;

/// What the MTL files of an OBJ say.
#[derive(Default)]
pub(super) struct Library {
    pub(super) materials: HashMap<String, MtlMaterial>,
    /// Names by their lower case, with and without a comment; whether a comment was taken off comes first.
    spellings: HashMap<String, Vec<(bool, String)>>,
    /// MTL files that are named and not there.
    pub(super) missing: Vec<String>,
    /// One that lies outside the folders allowed, and its folder.
    pub(super) outside: Option<(String, PathBuf)>,
    /// The MTL file of the OBJ's own name, where others are named and missing.
    pub(super) namesake: Option<PathBuf>,
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

    pub(super) fn add(&mut self, materials: Vec<MtlMaterial>) {
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
