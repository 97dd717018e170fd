//! The documents: links lead somewhere, paths and options that they name are there, the manual has all of its pages.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// All documents: those of the root, of `docs/` and of the benches.
fn documents() -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    for folder in ["", "docs", "benches/rivals", "benches/other_trees"] {
        for path in fs::read_dir(root.join(folder)).into_iter().flatten().flatten().map(|entry| entry.path()) {
            if path.extension().is_some_and(|ending| ending == "md") {
                let text = fs::read_to_string(&path).expect("a document is UTF-8");
                found.push((path, text));
            }
        }
    }
    assert!(found.len() > 10, "only {} documents were found", found.len());
    found
}

/// What stands between every `before` and the next `after` of a line.
fn between<'a>(line: &'a str, before: &str, after: char) -> Vec<&'a str> {
    let ends = |rest: &'a str| rest.find(after).map(|end| &rest[..end]);
    line.match_indices(before).filter_map(|(at, _)| ends(&line[at + before.len()..])).collect()
}

/// Text in code: the odd parts between backticks, and lines of fenced blocks.
fn code(text: &str) -> Vec<&str> {
    let (mut found, mut fenced) = (Vec::new(), false);
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            fenced = !fenced;
        } else if fenced {
            found.push(line.trim());
        } else {
            found.extend(line.split('`').skip(1).step_by(2));
        }
    }
    found
}

#[test]
fn links_lead_to_files_that_are_there() {
    let (mut checked, mut missing) = (0, Vec::new());
    for (path, text) in documents() {
        let folder = path.parent().expect("a document is in a folder");
        for link in text.lines().flat_map(|line| between(line, "](", ')')) {
            let file = link.split('#').next().unwrap_or(link);
            if file.is_empty() || link.contains("://") || link.starts_with("mailto:") {
                continue;
            }
            checked += 1;
            if !folder.join(file).exists() {
                missing.push(format!("{}: {link}", path.display()));
            }
        }
    }
    assert!(checked > 40, "only {checked} links were found");
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

/// A path of the project that a document names in code is there. The changelog may name what has gone.
#[test]
fn paths_in_code_are_there() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mut checked, mut missing) = (0, Vec::new());
    for (path, text) in documents().into_iter().filter(|(path, _)| !path.ends_with("CHANGELOG.md")) {
        for span in code(&text) {
            let rooms = ["src/", "tests/", "docs/", "benches/", "scripts/", "examples/", "scenes/", "fuzz/"];
            let is_path = rooms.iter().any(|room| span.starts_with(room));
            if !is_path || span.contains([' ', '*', '{', '…', '<']) {
                continue;
            }
            checked += 1;
            if !root.join(span).exists() {
                missing.push(format!("{}: {span}", path.display()));
            }
        }
    }
    assert!(checked > 40, "only {checked} paths were found");
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

/// Every option in a command line of the documents is one that the command lists in its help.
#[test]
fn options_in_command_lines_are_those_of_the_command() {
    let mut help: BTreeMap<String, String> = BTreeMap::new();
    let (mut checked, mut unknown) = (0, Vec::new());
    for (path, text) in documents().into_iter().filter(|(path, _)| !path.ends_with("CHANGELOG.md")) {
        for line in code(&text) {
            let line = line.split(" #").next().unwrap_or(line);
            let mut words = line.split_whitespace();
            let is_luxmap = words.next().is_some_and(|first| first == "luxmap" || first.ends_with("/luxmap"));
            let Some(command) = words.next().filter(|word| is_luxmap && !word.starts_with('-')) else { continue };
            let known = help.entry(command.to_owned()).or_insert_with(|| {
                let run = Command::new(env!("CARGO_BIN_EXE_luxmap")).args([command, "--help"]).output();
                String::from_utf8(run.expect("it starts").stdout).expect("help is UTF-8")
            });
            checked += 1;
            if known.is_empty() {
                unknown.push(format!("{}: {line}: no such command", path.display()));
            }
            for option in words.filter(|word| word.starts_with("--")) {
                let option = option.split('=').next().unwrap_or(option).trim_end_matches([',', ';', '.', ':']);
                if !known.split(|c: char| c.is_whitespace() || ",[]".contains(c)).any(|word| word == option) {
                    unknown.push(format!("{}: {line}: {option}", path.display()));
                }
            }
        }
    }
    assert!(checked > 30, "only {checked} command lines were found");
    assert!(unknown.is_empty(), "{}", unknown.join("\n"));
}

/// The manual's contents list every page of `docs/`.
#[test]
fn the_manual_has_all_its_pages() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let contents = fs::read_to_string(docs.join("SUMMARY.md")).expect("the contents are there");
    let listed: Vec<&str> = contents.lines().flat_map(|line| between(line, "](", ')')).collect();
    let pages = documents().into_iter().map(|(path, _)| path).filter(|path| path.parent() == Some(&docs));
    let names = pages.map(|path| path.file_name().expect("a file").to_string_lossy().into_owned());
    let missing: Vec<String> = names.filter(|name| name != "SUMMARY.md" && !listed.contains(&name.as_str())).collect();
    assert!(missing.is_empty(), "docs/SUMMARY.md lacks {missing:?}");
}
