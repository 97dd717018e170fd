//! OBJ files that others wrote to try their own readers (tests/material, with licences): each loads whole or is refused in
//! one line, and none panics.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use luxmap::scene::{Dimming, Scene};

/// Files that must not load, and what is said about them beside a full set of materials.
const REFUSED: [(&str, &str); 9] = [
    (
        "tinyobjloader/invalid-face-definition.obj",
        ": found an OBJ file without faces that have three different corners, expected lines that begin with f; is it an OBJ \
         file, exported with its faces?",
    ),
    (
        "tinyobjloader/invalid-relative-texture-index.obj",
        ": found an OBJ file without faces that have three different corners, expected lines that begin with f; is it an OBJ \
         file, exported with its faces?",
    ),
    (
        "tinyobjloader/invalid-relative-vertex-index.obj",
        ":1: found vertex -4 in a face, expected a vertex of this file, which has none",
    ),
    ("tinyobjloader/issue-140-zero-face-idx.obj", ":16: found vertex 0 in a face, expected 1 … 4; OBJ counts from 1"),
    ("tinyobjloader/issue-356-leading-spaces-newmtl.obj", NO_FACES),
    ("tinyobjloader/line-prim.obj", NO_FACES),
    ("tinyobjloader/test-nan.obj", ":12: found \"nan -nan nan\", expected three finite numbers; repair the vertex"),
    ("tobj/invalid_index.obj", ":12: found vertex 7 in a face, expected 1 … 6"),
    ("tobj/lines.obj", NO_FACES),
];
const NO_FACES: &str = ": found an OBJ file without faces, expected lines that begin with f; is it an OBJ file, exported with \
                        its faces?";

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/material")
}

/// Every OBJ file there, as `project/file`.
fn objs() -> Vec<String> {
    let files = |project: &str| {
        let entries = fs::read_dir(folder().join(project))
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap());
        entries.filter(|name| name.ends_with(".obj")).map(|name| format!("{project}/{name}")).collect::<Vec<_>>()
    };
    let mut all = [files("tinyobjloader"), files("tobj")].concat();
    all.sort();
    all
}

/// A scene around an OBJ file, with a reflectance for each of its materials or with none.
fn load(obj: &str, with_reflectances: bool) -> Result<Scene, String> {
    let path = folder().join(obj);
    let text = String::from_utf8_lossy(&fs::read(&path).unwrap()).into_owned();
    let used = text.lines().filter_map(|line| line.trim().strip_prefix("usemtl")).map(|name| name.trim().to_owned());
    let mut materials: BTreeSet<String> = used.collect();
    if text
        .lines()
        .map(str::trim)
        .find(|line| line.starts_with("usemtl") || line.starts_with("f "))
        .is_some_and(|line| line.starts_with('f'))
    {
        materials.insert("default".to_owned());
    }
    let mut toml = format!("[[mesh]]\nfile = '{}'\n", path.display());
    toml += "[[luminaire]]\nname = \"L\"\nposition = [0, 0, 0]\nflux = 1\n";
    toml += "[[sensor]]\nname = \"S\"\nposition = [0, 0, 0]\nnormal = [0, 0, 1]\n";
    if with_reflectances {
        materials.iter().for_each(|name| toml += &format!("[material.\"{name}\"]\nreflectance = 0.5\n"));
    }
    // Tests run at the same time, some on the same file.
    let (process, thread) = (std::process::id(), std::thread::current().id());
    let name =
        format!("luxmap-material-{process}-{thread:?}-{}-{with_reflectances}.toml", obj.replace(['/', ' '], "-"));
    let scene = std::env::temp_dir().join(name);
    fs::write(&scene, toml).unwrap();
    let loaded = Scene::load_with(&scene, &[folder()], &Dimming::AsWritten).map_err(|error| error.to_string());
    fs::remove_file(scene).unwrap();
    loaded
}

/// Triangles that the faces of an OBJ file hold: n − 2 in a face of n corners.
fn triangles(obj: &str) -> usize {
    // One of its faces names the same place twice (vertices 19 and 20).
    let doubled = usize::from(obj == "tinyobjloader/issue-319-002.obj");
    let text = String::from_utf8_lossy(&fs::read(folder().join(obj)).unwrap()).into_owned();
    let faces = text.lines().filter_map(|line| line.trim().strip_prefix("f "));
    faces.map(|corners| corners.split_whitespace().count() - 2).sum::<usize>() - doubled
}

#[test]
fn every_obj_file_loads_whole_or_is_refused_in_a_line() {
    for obj in objs() {
        let refusal = REFUSED.iter().find(|(name, _)| *name == obj).map(|(_, message)| message);
        match (load(&obj, true), refusal) {
            (Ok(scene), None) => {
                // tobj's square stands there in several ways of writing it.
                let found = scene.mesh.triangles.len() + scene.parts[0].repeated;
                assert_eq!(found, triangles(&obj), "{obj}: {:?}", scene.warnings);
                assert_eq!(scene.parts[0].repeated > 0, obj == "tobj/quad.obj", "{obj}: {:?}", scene.warnings);
            }
            (Err(message), Some(refusal)) => assert_eq!(message, format!("{}{refusal}", folder().join(&obj).display())),
            (Ok(_), Some(_)) => panic!("{obj} loaded"),
            (Err(message), None) => panic!("{message}"),
        }
    }
}

#[test]
fn without_the_scene_file_s_word_the_mtl_s_counts_or_a_line_asks_for_it() {
    for obj in objs() {
        match load(&obj, false) {
            Ok(scene) => assert!(scene.materials.iter().all(|m| m.reflectance.iter().all(|r| (0.0..=1.0).contains(r)))),
            Err(message) => {
                assert!(message.starts_with(&format!("{}:", folder().join(&obj).display())), "{message}");
                assert!(!message.contains('\n'), "{message}");
            }
        }
    }
}

#[test]
fn the_cornell_box_has_its_colours_and_its_light_from_mtl_files() {
    let scene = load("tobj/cornell_box.obj", false).unwrap();
    let reflectance = |name: &str| scene.materials.iter().find(|m| m.name == name).unwrap().reflectance;
    assert_eq!((reflectance("red"), reflectance("green")), ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]));
    let white = scene.materials.iter().position(|m| m.name == "white").unwrap();
    let area = |t: usize| {
        let [a, b, c] = scene.mesh.corners(t);
        (b - a).cross(c - a).length() / 2.0
    };
    let is_white = |&t: &usize| scene.mesh.material_of[t] as usize == white;
    let white_area: f64 = (0..scene.mesh.triangles.len()).filter(is_white).map(area).sum();
    // Ke 1 1 1: its walls shine.
    let lamp = scene.luminaires.iter().find(|luminaire| luminaire.name == "white").unwrap();
    assert!((lamp.flux.0 / (std::f64::consts::PI * white_area) - 1.0).abs() < 1e-12, "{}", lamp.flux);
    assert_eq!(lamp.colour, [1.0; 3]);
}

#[test]
fn mtl_files_are_found_behind_blanks_and_behind_missing_ones() {
    for obj in
        ["tinyobjloader/mtl filename with whitespace issue46.obj", "tinyobjloader/mtllib-multiple-files-issue-112.obj"]
    {
        let scene = load(obj, false).unwrap();
        assert!(
            scene
                .warnings
                .iter()
                .filter(|warning| warning.contains("MTL file") && warning.contains("there is no such file"))
                .count()
                == 2,
            "{:?}",
            scene.warnings
        );
    }
}
