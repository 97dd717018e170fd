//! The floors of the house: a module imports only from its own floor's rooms below it, so that no two rooms need each other.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The top modules of `src/`, lowest first. Each may use what stands before it, and nothing after it. Modules in one row don't
/// know each other.
const FLOORS: &[&[&str]] = &[
    &["error", "sets", "units"],
    &["files", "flux", "progress", "random", "text"],
    &["geometry", "photon_map", "state"],
    &["luminaire", "options"],
    &["scene"],
    &["embree"],
    &["photon"],
    &["gather"],
    &["results"],
    &["render"],
    &["report"],
    &["dimming", "batch", "study", "office"],
    &["control"],
    &["job"],
    &["cli"],
];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the sources are there").flatten() {
        let path = entry.path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found.push(path);
        }
    }
}

/// The source without tests and comments.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).expect("a source can be read");
    let end = text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.len());
    text[..end].lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// Top modules named after `crate::`, whole groups in braces included.
fn named(code: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + "crate::".len()..];
        let parts = if let Some(group) = rest.strip_prefix('{') {
            let end = group.find('}').unwrap_or(group.len());
            group[..end].split(',').map(|part| part.trim().to_owned()).collect()
        } else {
            vec![rest.to_owned()]
        };
        found.extend(
            parts
                .iter()
                .map(|part| part.chars().take_while(|c| c.is_ascii_lowercase() || *c == '_').collect::<String>()),
        );
    }
    found.retain(|name| !name.is_empty());
    found
}

#[test]
fn modules_import_only_from_floors_below() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let floor = |name: &str| FLOORS.iter().position(|floor| floor.contains(&name));
    let mut files = Vec::new();
    sources(&root, &mut files);
    let (mut wrong, mut checked) = (Vec::new(), 0);
    for path in files {
        let inside = path.strip_prefix(&root).expect("it is inside");
        let room = inside.iter().next().expect("a name").to_string_lossy().replace(".rs", "");
        if ["lib", "main"].contains(&room.as_str()) || inside.file_name().is_some_and(|name| name == "tests.rs") {
            continue;
        }
        let Some(own) = floor(&room) else {
            wrong.push(format!("{room} has no floor"));
            continue;
        };
        for name in named(&code(&path)).iter().filter(|name| **name != room) {
            checked += 1;
            if floor(name).is_none_or(|other| other >= own) {
                wrong.push(format!("{} imports crate::{name}", inside.display()));
            }
        }
    }
    assert!(checked > 300, "only {checked} imports were found: does this test read sources at all?");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
