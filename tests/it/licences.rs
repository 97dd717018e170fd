//! The licences of what luxmap is built of.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// Licences that ask for no more than a notice, or, as MPL-2.0, for the source of the files that are under it.
const ALLOWED: [&str; 15] = [
    "0BSD",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "ISC",
    "MIT",
    "MIT-0",
    "MPL-2.0",
    "Unicode-3.0",
    "Unicode-DFS-2016",
    "Unlicense",
    "Zlib",
];

/// Whether an SPDX expression leaves a choice of allowed licences. AND binds closer than OR; an old form of OR is a slash.
fn is_allowed(expression: &str) -> bool {
    let spaced = expression.replace('/', " OR ").replace('(', " ( ").replace(')', " ) ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut rest = &words[..];
    either(&mut rest) && rest.is_empty()
}

fn either(words: &mut &[&str]) -> bool {
    let mut found = both(words);
    while words.first() == Some(&"OR") {
        *words = &words[1..];
        found |= both(words);
    }
    found
}

fn both(words: &mut &[&str]) -> bool {
    let mut found = one(words);
    while words.first() == Some(&"AND") {
        *words = &words[1..];
        found &= one(words);
    }
    found
}

fn one(words: &mut &[&str]) -> bool {
    match **words {
        ["(", ..] => {
            *words = &words[1..];
            let found = either(words);
            let closed = words.first() == Some(&")");
            *words = words.get(1..).unwrap_or_default();
            found && closed
        }
        [licence, "WITH", exception, ..] => {
            *words = &words[3..];
            ALLOWED.contains(&format!("{licence} WITH {exception}").as_str())
        }
        [licence, ..] => {
            *words = &words[1..];
            ALLOWED.contains(&licence)
        }
        [] => false,
    }
}

#[test]
fn expressions_are_understood() {
    for (expression, expected) in [
        ("MIT", true),
        ("MIT/Apache-2.0", true),
        ("GPL-3.0-only OR MIT", true),
        ("GPL-3.0-only AND MIT", false),
        ("(MIT OR GPL-3.0-only) AND Unicode-3.0", true),
        ("MIT OR GPL-3.0-only AND Unicode-3.0", true),
        ("Apache-2.0 WITH LLVM-exception", true),
        ("GPL-2.0-only WITH Classpath-exception-2.0", false),
        ("(MIT", false),
        ("MIT MIT", false),
        ("", false),
    ] {
        assert_eq!(is_allowed(expression), expected, "{expression:?}");
    }
}

/// What this machine's cargo says of luxmap's packages; nothing, and said so, where there is no cargo.
fn metadata() -> Option<Value> {
    let project = env!("CARGO_MANIFEST_DIR");
    if !Path::new(project).join("Cargo.lock").exists() {
        println!("licences are not tested: there is no Cargo.lock");
        return None;
    }
    let Ok(rustc) = Command::new("rustc").arg("-vV").output() else {
        println!("licences are not tested: there is no rustc");
        return None;
    };
    let rustc = String::from_utf8(rustc.stdout).expect("text");
    let host = rustc.lines().find_map(|line| line.strip_prefix("host: ")).expect("rustc names its host");
    // Only what this build needed is sure to be there without a network.
    let features: &[&str] = if cfg!(feature = "mpi") { &["--features", "mpi"] } else { &[] };
    let output = Command::new("cargo")
        .current_dir(project)
        .args(["metadata", "--offline", "--locked", "--format-version", "1", "--filter-platform", host])
        .args(features)
        .output();
    let Ok(output) = output else {
        println!("licences are not tested: there is no cargo");
        return None;
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(serde_json::from_slice(&output.stdout).expect("cargo writes JSON"))
}

/// Whether a package may be shipped by the expression in its manifest or, where there is none, by the text it names.
fn may_be_shipped(package: &Value) -> bool {
    if let Some(expression) = package["license"].as_str() {
        return is_allowed(expression);
    }
    let manifest = Path::new(package["manifest_path"].as_str().expect("a path"));
    let Some(file) = package["license_file"].as_str() else { return false };
    let text = std::fs::read_to_string(manifest.with_file_name(file)).unwrap_or_default();
    text.trim_start().starts_with("MIT License") && text.contains("Permission is hereby granted, free of charge")
}

/// Every package that luxmap's programs are built of, those of the build script included, may be shipped with it. Packages of
/// tests alone are not shipped.
#[test]
fn every_package_may_be_shipped() {
    let Some(metadata) = metadata() else { return };
    let text = |value: &Value| value.as_str().expect("a text").to_owned();
    let list = |value: &Value| value.as_array().expect("a list").clone();
    let packages: BTreeMap<String, Value> =
        list(&metadata["packages"]).into_iter().map(|package| (text(&package["id"]), package)).collect();
    let nodes: BTreeMap<String, Value> =
        list(&metadata["resolve"]["nodes"]).into_iter().map(|node| (text(&node["id"]), node)).collect();
    let mut shipped = BTreeSet::new();
    let mut open = vec![text(&metadata["resolve"]["root"])];
    while let Some(package) = open.pop() {
        if shipped.contains(&package) {
            continue;
        }
        for dependency in list(&nodes[&package]["deps"]) {
            let for_tests_alone = list(&dependency["dep_kinds"]).iter().all(|kind| kind["kind"] == "dev");
            if !for_tests_alone {
                open.push(text(&dependency["pkg"]));
            }
        }
        shipped.insert(package);
    }
    assert!(shipped.len() > 50, "{} packages: fewer than luxmap names in Cargo.toml", shipped.len());
    let refused: Vec<String> = shipped
        .iter()
        .map(|package| &packages[package])
        .filter(|package| !may_be_shipped(package))
        .map(|package| format!("{} {}: {}", package["name"], package["version"], package["license"]))
        .collect();
    assert!(refused.is_empty(), "{refused:#?}");
}
