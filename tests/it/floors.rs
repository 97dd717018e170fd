//! The floors of the house: a module imports only from floors below it, and no two files need each other.

use std::collections::{BTreeMap, BTreeSet};
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
    &["dimming", "batch", "office"],
    &["job", "control"],
    &["study"],
    &["cli"],
];

/// Every source file by its module's path, `render::place`, say, with its code: no tests, no comments.
fn sources() -> BTreeMap<String, String> {
    fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).expect("the sources are there").flatten() {
            let path = entry.path();
            if path.is_dir() { walk(&path, found) } else { found.push(path) }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    walk(&root, &mut files);
    let is_test = |path: &Path| path.iter().any(|part| part == "tests.rs" || part == "tests");
    files.retain(|path| path.extension().is_some_and(|ending| ending == "rs") && !is_test(path));
    let module = |path: &Path| {
        let inside = path.strip_prefix(&root).expect("it is inside").with_extension("");
        let parts: Vec<String> = inside.iter().map(|part| part.to_string_lossy().into_owned()).collect();
        parts.join("::").trim_end_matches("::mod").to_owned()
    };
    let code = |path: &Path| {
        let text = fs::read_to_string(path).expect("a source can be read");
        let end = text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.len());
        text[..end].lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
    };
    files.iter().map(|path| (module(path), code(path))).filter(|(name, _)| name != "lib" && name != "main").collect()
}

/// The paths that a tree of a `use` names: `a::{b, c::d}` names `a::b` and `a::c::d`.
fn leaves(tree: &str, found: &mut Vec<String>) {
    let Some((before, group)) = tree.split_once('{') else {
        let path = tree.split(" as ").next().unwrap_or_default().trim();
        found.push(path.trim_end_matches("::self").to_owned());
        return;
    };
    let group = group.rsplit_once('}').map_or(group, |(group, _)| group);
    let (mut depth, mut start) = (0, 0);
    for (at, c) in group.char_indices().chain([(group.len(), ',')]) {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                if !group[start..at].trim().is_empty() {
                    leaves(&format!("{}{}", before.trim(), group[start..at].trim()), found);
                }
                start = (at + 1).min(group.len());
            }
            _ => {}
        }
    }
}

/// What a module's code names of the crate, from the root on: `scene::Scene`.
fn named(module: &str, code: &str) -> BTreeSet<String> {
    let mut paths = Vec::new();
    for (at, _) in code.match_indices("use ") {
        if code[..at].ends_with(['\n', ' ', ')']) || at == 0 {
            leaves(code[at + 4..].split(';').next().unwrap_or_default(), &mut paths);
        }
    }
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == ':';
    for (at, _) in code.match_indices("crate::") {
        paths.push(code[at..].chars().take_while(|c| is_name(*c)).collect());
    }
    let from_root = |path: &str| {
        let mut own: Vec<&str> = module.split("::").collect();
        let mut rest = path;
        if let Some(path) = path.strip_prefix("crate::") {
            return Some(path.to_owned());
        }
        let is_relative = ["super::", "self::"].iter().any(|start| path.starts_with(start));
        while let Some(path) = rest.strip_prefix("super::") {
            own.pop();
            rest = path;
        }
        rest = rest.strip_prefix("self::").unwrap_or(rest);
        is_relative.then(|| own.into_iter().chain([rest]).collect::<Vec<_>>().join("::"))
    };
    paths.iter().filter_map(|path| from_root(path)).collect()
}

#[test]
fn modules_import_only_from_floors_below() {
    let floor = |name: &str| FLOORS.iter().position(|floor| floor.contains(&name));
    let (mut wrong, mut checked) = (Vec::new(), 0);
    for (module, code) in sources() {
        let room = module.split("::").next().expect("a name");
        let Some(own) = floor(room) else {
            wrong.push(format!("{room} has no floor"));
            continue;
        };
        for path in named(&module, &code) {
            let other = path.split("::").next().expect("a name");
            if other == room || !other.starts_with(|c: char| c.is_ascii_lowercase()) {
                continue;
            }
            checked += 1;
            if floor(other).is_none_or(|floor| floor >= own) {
                wrong.push(format!("{module} imports crate::{other}"));
            }
        }
    }
    assert!(checked > 300, "only {checked} imports were found: does this test read sources at all?");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A module and those within it may know each other; any other two files may not, whatever stands between them.
#[test]
fn no_circle_of_files() {
    let sources = sources();
    let file_of = |path: &str| {
        let mut path = path;
        loop {
            if sources.contains_key(path) {
                return Some(path.to_owned());
            }
            path = path.rsplit_once("::")?.0;
        }
    };
    let within = |a: &str, b: &str| a == b || a.starts_with(&format!("{b}::"));
    let edges = |module: &str, code: &str| -> BTreeSet<String> {
        let files = named(module, code).into_iter().filter_map(|path| file_of(&path));
        files.filter(|file| !within(file, module) && !within(module, file)).collect()
    };
    let mut graph: BTreeMap<String, BTreeSet<String>> =
        sources.iter().map(|(module, code)| (module.clone(), edges(module, code))).collect();
    assert!(graph.values().map(BTreeSet::len).sum::<usize>() > 300, "does this test read sources at all?");
    // Files that need nothing that is left stand on their own: what can't be taken away is in a circle, or above one.
    while let Some(free) = graph.iter().find(|(_, needs)| needs.is_empty()).map(|(name, _)| name.clone()) {
        graph.remove(&free);
        for needs in graph.values_mut() {
            needs.remove(&free);
        }
    }
    // And what nobody left needs is only above one.
    loop {
        let needed: BTreeSet<String> = graph.values().flatten().cloned().collect();
        let before = graph.len();
        graph.retain(|name, _| needed.contains(name));
        if graph.len() == before {
            break;
        }
    }
    assert!(graph.is_empty(), "circles: {graph:#?}");
}
