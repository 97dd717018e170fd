//! What the tables say is what the parser does, and what docs/SCENE.md says.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

use super::SceneFile;
use super::keys::asked;
use super::reference::{markdown, pages};
use crate::options::{Method, Options};
use crate::photon_map::Tree;

/// Reads an example of the reference; a sensor is added where it measures nothing.
fn parse(example: &str) -> SceneFile {
    let measures = ["[[plane]]", "[[sensor]]", "[[surface]]", "[[camera]]"].iter().any(|head| example.contains(head));
    let sensor = "\n[[sensor]]\nname = \"added\"\nposition = [0, 0, 1]\nnormal = [0, 0, 1]\n";
    let text = format!("{example}{}", if measures { "" } else { sensor });
    SceneFile::parse(Path::new("scene.toml"), &text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// The parser can't ask for a key that is in no table: a section asserts it. Here: no table has a key that it doesn't
/// ask for.
#[test]
fn every_example_parses_and_every_key_is_asked_for() {
    asked::all(); // what other tests of this thread left
    let pages = pages();
    pages.iter().map(|page| page.example()).filter(|example| !example.is_empty()).for_each(|text| drop(parse(text)));
    let known: BTreeSet<_> =
        pages.iter().flat_map(|page| page.keys().map(|(key, _)| (page.table().head, key))).collect();
    assert_eq!(asked::all(), known);
}

#[test]
fn every_section_has_an_example_and_every_key_once() {
    for page in pages() {
        let names: BTreeSet<_> = page.keys().map(|(name, _)| name).collect();
        assert_eq!(names.len(), page.keys().count(), "{}", page.title());
        assert_eq!(page.example().is_empty(), !page.table().head.contains(['[', ' ']), "{}", page.title());
    }
}

#[test]
fn the_written_reference_is_current() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/SCENE.md");
    let written = std::fs::read_to_string(path).unwrap_or_default();
    let what_to_do = "docs/SCENE.md is not current: write it with `cargo run -- help scene --markdown > docs/SCENE.md`";
    assert!(written == markdown(), "{what_to_do}");
}

#[test]
fn render_takes_every_method_and_tree() {
    let render = |line: &str| parse(&format!("[render]\n{line}\n")).render;
    for (name, _) in Method::ALL {
        assert_eq!(render(&format!("method = \"{name}\"")).method.map(Method::name), Some(name));
    }
    for (name, _) in Tree::ALL {
        assert_eq!(render(&format!("tree = \"{name}\"")).tree.map(Tree::name), Some(name));
    }
    let smooth = |on| Options { smooth: Some(on), ..Default::default() };
    assert_eq!(render("smooth = \"off\""), smooth(false));
    assert_eq!(render("smooth = true"), smooth(true));
    let all = "rays = 3\nerror = 0.5\ntime = 60\nmemory = 1.5";
    let expected = Options {
        rays: Some(3),
        error: Some(0.5),
        time: Some(Duration::from_secs(60)),
        memory: Some(1.5),
        ..Default::default()
    };
    assert_eq!(render(all), expected);
}
