//! Each mistake in a scene yields its message, word for word: file:line, what was found, what was expected, what to do.

use std::fs;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use luxmap::scene::Scene;

/// A folder of files that goes away with its test.
struct Folder(PathBuf);

impl Folder {
    fn with(files: &[(&str, &[u8])]) -> Self {
        static NUMBER: AtomicUsize = AtomicUsize::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("luxmap-scene-errors-{}-{number}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        files.iter().for_each(|(name, bytes)| fs::write(folder.join(name), bytes).unwrap());
        Self(folder)
    }

    /// What loading `scene.toml` says, file names without the folder.
    fn message(&self) -> String {
        match Scene::load(&self.0.join("scene.toml")) {
            Ok(scene) => {
                format!("loaded: {}", scene.warnings.join(" | ")).replace(&format!("{}/", self.0.display()), "")
            }
            Err(error) => error.to_string().replace(&format!("{}/", self.0.display()), ""),
        }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

const MESH: &str = "[[mesh]]\nfile = \"room.obj\"\n";
const LAMP: &str = "[[luminaire]]\nname = \"L\"\nposition = [0.5, 0.5, 2]\nflux = 3000\n";
const SENSOR: &str = "[[sensor]]\nname = \"desk\"\nposition = [0.5, 0.5, 1]\nnormal = [0, 0, 1]\n";
const PLANE: &str =
    "[[plane]]\nname = \"floor\"\ncorner = [0, 0, 0]\nalong = [6, 0, 0]\nacross = [0, 7, 0]\ncells = [6, 7]\n";
const OBJ: &str = "mtllib room.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 3\nusemtl floor\nf 1 2 3 4\n";
const MTL: &str = "newmtl floor\nKd 0.2 0.2 0.2\n";

/// What the scene file `toml` says beside a sound room.
fn says(toml: &str) -> String {
    says_of(toml, OBJ, MTL)
}

fn says_of(toml: &str, obj: &str, mtl: &str) -> String {
    let files = [("scene.toml", toml), ("room.obj", obj), ("room.mtl", mtl)];
    let message = Folder::with(&files.map(|(name, text)| (name, text.as_bytes()))).message();
    assert!(!message.contains('\n'), "more than one line: {message}");
    message
}

/// What a sound scene says once its luminaire has one more line (line 5).
fn luminaire_says(line: &str) -> String {
    says(&format!("{LAMP}{line}\n{SENSOR}"))
}

/// What a sound scene says once its OBJ file is `obj`.
fn obj_says(obj: &str) -> String {
    says_of(&format!("{MESH}{LAMP}{SENSOR}"), obj, MTL)
}

/// What a sound scene says once its MTL file is `mtl`.
fn mtl_says(mtl: &str) -> String {
    says_of(&format!("{MESH}{LAMP}{SENSOR}"), OBJ, mtl)
}

#[test]
fn a_sound_scene_loads_without_a_word() {
    assert_eq!(says(&format!("{MESH}{LAMP}{SENSOR}")), "loaded: ");
    assert_eq!(says(&format!("{LAMP}{SENSOR}{PLANE}")), "loaded: ");
}

#[test]
fn files_that_can_t_be_read() {
    assert_eq!(
        Folder::with(&[]).message(),
        "scene.toml: found no scene (there is no such file), expected a scene file in TOML"
    );
    assert_eq!(
        Folder::with(&[("scene.toml", format!("{LAMP}{SENSOR}{MESH}").as_bytes())]).message(),
        "scene.toml:10: found file = \"room.obj\" (there is no such file), expected an OBJ file; its path starts from \
         the scene file's folder"
    );
    assert_eq!(
        says(&format!("[[mesh]]\nfile = \"..\"\n{LAMP}{SENSOR}")),
        "scene.toml:2: found file = \"..\" (it is a folder), expected an OBJ file; its path starts from the scene file's \
         folder"
    );
    assert_eq!(
        Folder::with(&[("scene.toml", b"name = \"A\"\n# \xff\n")]).message(),
        "scene.toml:2: found bytes that are no UTF-8, expected text in UTF-8"
    );
}

#[test]
fn broken_toml() {
    assert_eq!(
        says("name = \"A\"\n[[plane\n"),
        "scene.toml:2: found broken TOML (unclosed array table), expected `]]`"
    );
    assert_eq!(says("name = \"A\nb\"\n"), "scene.toml:1: found broken TOML (invalid basic string), expected `\"`");
    assert_eq!(
        says("\n\nname = A\n"),
        "scene.toml:3: found broken TOML (string values must be quoted), expected text in quotes"
    );
    assert_eq!(
        says("name = \"A\"\nname = \"B\"\n"),
        "scene.toml:2: found broken TOML (the same key twice), expected each key once"
    );
    assert_eq!(says("\nfov = 1.2.3\n"), "scene.toml:2: found broken TOML (invalid float), expected valid TOML");
    assert_eq!(
        says("\u{0}"),
        "scene.toml:1: found broken TOML (invalid unquoted key), expected letters, numbers, `-`, `_`"
    );
}

#[test]
fn keys_nobody_knows() {
    assert_eq!(
        luminaire_says("colour = [1, 1, 1]"),
        "scene.toml:5: found unknown key \"colour\" in [[luminaire]], expected one of name, position, aim, rotation, \
         opening, photometry, flux, dimming, color, cct, group, array; did you mean color?"
    );
    assert_eq!(
        says("[[lamp]]\n"),
        "scene.toml:1: found unknown key \"lamp\" in the scene file, expected one of name, mesh, material, luminaire, \
         plane, sensor, camera, render"
    );
    assert_eq!(
        luminaire_says("opening = { disk = 0.3 }"),
        "scene.toml:5: found unknown key \"disk\" in opening of [[luminaire]], expected one of rectangle, disc; did you \
         mean disc?"
    );
}

#[test]
fn values_of_another_kind() {
    assert_eq!(says("name = 3\n"), "scene.toml:1: found name = 3 in the scene file, expected text in quotes");
    assert_eq!(
        says("[plane]\nname = \"floor\"\n"),
        "scene.toml:1: found plane = a table, expected sections that begin with [[plane]]"
    );
    assert_eq!(
        says("[[material]]\nname = \"floor\"\n"),
        "scene.toml:1: found material = [a table], expected a section that begins with [material.NAME]"
    );
    assert_eq!(
        says("material.floor = 0.2\n"),
        "scene.toml:1: found material.floor = 0.2, expected a section that begins with [material.NAME]"
    );
    assert_eq!(
        luminaire_says("aim = \"down\""),
        "scene.toml:5: found aim = \"down\" in [[luminaire]], expected a direction [x, y, z]"
    );
    assert_eq!(
        luminaire_says("array = 3"),
        "scene.toml:5: found array = 3 in [[luminaire]], expected { count = [3, 5], pitch = [2.0, 1.44] }"
    );
}

#[test]
fn vectors_of_another_length_or_without_one() {
    assert_eq!(
        luminaire_says("aim = [0, -1]"),
        "scene.toml:5: found aim = [0, -1] in [[luminaire]], expected a direction [x, y, z]"
    );
    assert_eq!(
        luminaire_says("aim = [0, 0, 0]"),
        "scene.toml:5: found aim = [0.0, 0.0, 0.0] in [[luminaire]], expected a direction, which has a length above 0"
    );
    assert_eq!(
        says(&format!("{LAMP}[[sensor]]\nname = \"desk\"\nposition = [1, 2, inf]\nnormal = [0, 0, 1]\n")),
        "scene.toml:7: found position = [1, 2, inf] in [[sensor]], expected [x, y, z] in metres, each within ±1e9"
    );
}

#[test]
fn sections_that_lack_something() {
    assert_eq!(
        says("[[luminaire]]\nname = \"L\"\nposition = [0, 0, 2]\n"),
        "scene.toml:1: found [[luminaire]] without flux, expected flux = 3000 (lm)"
    );
    assert_eq!(
        says("\n[[mesh]]\nunit = \"m\"\n"),
        "scene.toml:2: found [[mesh]] without file, expected file = \"room.obj\""
    );
    assert_eq!(
        says(&format!("{LAMP}{MESH}")),
        "scene.toml: found neither a [[plane]] nor a [[sensor]], expected at least one of them; they say where illuminance \
         is wanted"
    );
    assert_eq!(
        says(&format!("{MESH}{SENSOR}")),
        "scene.toml: found nothing that shines, expected a [[luminaire]], or a material with Ke in an MTL file"
    );
    assert_eq!(
        luminaire_says("dimming = 0"),
        "scene.toml: found every luminaire dimmed to 0, expected a [[luminaire]], or a material with Ke in an MTL file"
    );
}

#[test]
fn luminaires_that_can_t_be() {
    assert_eq!(
        says("[[luminaire]]\nname = \"L\"\nposition = [0, 0, 2]\nflux = 0\n"),
        "scene.toml:4: found flux = 0 in [[luminaire]], expected a number above 0, lm; dimming = 0 switches a luminaire off"
    );
    assert_eq!(
        luminaire_says("dimming = 1.5"),
        "scene.toml:5: found dimming = 1.5 in [[luminaire]], expected a number from 0 (off) to 1"
    );
    assert_eq!(
        luminaire_says("photometry = \"panel.ies\""),
        "scene.toml:5: found photometry = \"panel.ies\" (there is no such file), expected a photometric file (.ies, .ldt), \
         \"lambertian\" or \"isotropic\"; its path starts from the scene file's folder"
    );
    assert_eq!(
        luminaire_says("photometry = \"room.obj\""),
        "room.obj: found neither a line TILT= nor the numbers that begin a EULUMDAT file, expected a photometric file, \
         LM-63 (.ies) or EULUMDAT (.ldt)"
    );
    assert_eq!(
        luminaire_says("opening = { sphere = 0.3, disc = 0.3 }"),
        "scene.toml:5: found opening = a table in [[luminaire]], expected \"point\", { rectangle = [a, b] }, { disc = \
         diameter }, { ellipse = [a, b] }, { box = [a, b, height] }, { cylinder = [diameter, height] }, { tube = [length, \
         diameter] }, { sphere = diameter } or { ellipsoid = [a, b, height] } (m)"
    );
    assert_eq!(
        luminaire_says("opening = { disc = 1 }\nphotometry = \"isotropic\""),
        "scene.toml:6: found photometry = \"isotropic\" in [[luminaire]], expected \"lambertian\" for an opening with an \
         area; only points shine alike in all directions"
    );
    assert_eq!(
        luminaire_says("opening = { rectangle = [0.6, 0] }"),
        "scene.toml:5: found rectangle = [0.6, 0] in opening of [[luminaire]], expected two sizes, each above 0, up to 1e6 m"
    );
    assert_eq!(
        luminaire_says("opening = \"sphere\""),
        "scene.toml:5: found opening = \"sphere\" in [[luminaire]], expected \"point\", { rectangle = [a, b] }, { disc = \
         diameter }, { ellipse = [a, b] }, { box = [a, b, height] }, { cylinder = [diameter, height] }, { tube = [length, \
         diameter] }, { sphere = diameter } or { ellipsoid = [a, b, height] } (m)"
    );
    assert_eq!(
        luminaire_says("color = [0, 0, 0]"),
        "scene.toml:5: found color = [0, 0, 0] in [[luminaire]], expected [r, g, b], none below 0 and not all of them 0"
    );
    assert_eq!(
        luminaire_says("color = [1, 1, 1]\ncct = 4000"),
        "scene.toml:6: found cct = 4000 in [[luminaire]], expected either color or cct"
    );
    assert_eq!(
        luminaire_says("cct = 300"),
        "scene.toml:5: found cct = 300 in [[luminaire]], expected a number from 1000 to 25000, K"
    );
    assert_eq!(
        luminaire_says("array = { count = [0, 5], pitch = [1, 1] }"),
        "scene.toml:5: found count = [0, 5] in array of [[luminaire]], expected two whole numbers from 1 to 1000000"
    );
    assert_eq!(
        luminaire_says("array = { count = [10000, 10000], pitch = [1, 1] }"),
        "scene.toml:5: found count = [10000, 10000] in array of [[luminaire]], expected at most 1000000 luminaires"
    );
}

#[test]
fn measuring_planes_that_can_t_be() {
    let plane_says = |old: &str, new: &str| says(&format!("{LAMP}{}", PLANE.replace(old, new)));
    assert_eq!(
        plane_says("cells = [6, 7]", "cells = [6, 0]"),
        "scene.toml:10: found cells = [6, 0] in [[plane]], expected two whole numbers from 1 to 25000000"
    );
    assert_eq!(
        plane_says("cells = [6, 7]", "cells = [100000, 100000]"),
        "scene.toml:10: found cells = [100000, 100000] in [[plane]], expected two whole numbers from 1 up, at most \
         25000000 cells in all"
    );
    assert_eq!(
        plane_says("across = [0, 7, 0]", "across = [1, 7, 0]"),
        "scene.toml:9: found across = [1, 7, 0] in [[plane]], expected a vector at a right angle to along; the angle is \
         81.8699°"
    );
    assert_eq!(
        plane_says("along = [6, 0, 0]", "along = [0, 0, 0]"),
        "scene.toml:8: found along = [0, 0, 0] in [[plane]], expected a side longer than 0"
    );
    assert_eq!(
        plane_says("\"floor\"", "\"../floor\""),
        "scene.toml:6: found name = \"../floor\" in [[plane]], expected a name that can be a file's; no / \\ : in it, no \
         dot in front; results are written as NAME.exr"
    );
    assert_eq!(
        plane_says("\"floor\"", "\" \""),
        "scene.toml:6: found name = \" \" in [[plane]], expected a name that can be printed"
    );
}

#[test]
fn names_given_twice() {
    assert_eq!(
        says(&format!("{LAMP}{PLANE}{PLANE}")),
        "scene.toml:12: found a second plane named \"floor\", expected a name of its own for each; the first is at \
         scene.toml:6"
    );
    assert_eq!(
        says(&format!("{LAMP}{SENSOR}{SENSOR}")),
        "scene.toml:10: found a second sensor named \"desk\", expected a name of its own for each; the first is at \
         scene.toml:6"
    );
    let array = LAMP.replace("\"L\"", "\"L[2,1]\"") + LAMP + "array = { count = [2, 1], pitch = [1, 1] }\n";
    assert_eq!(
        says(&format!("{array}{SENSOR}")),
        "scene.toml:6: found a second luminaire named \"L[2,1]\", expected a name of its own for each; the first is at \
         scene.toml:2"
    );
}

#[test]
fn materials_that_can_t_be() {
    let material_says = |lines: &str| says(&format!("{MESH}{LAMP}{SENSOR}[material.floor]\n{lines}\n"));
    assert_eq!(
        material_says("reflectance = 1.2"),
        "scene.toml:12: found reflectance = 1.2 in [material.floor], expected a number from 0 to 1, or three as [r, g, b]; \
         white paint: about 0.85"
    );
    assert_eq!(
        material_says("reflectance = [0.5, 0.5, -0.1]"),
        "scene.toml:12: found reflectance = [0.5, 0.5, -0.1] in [material.floor], expected a number from 0 to 1, or three \
         as [r, g, b]; white paint: about 0.85"
    );
    assert_eq!(
        material_says("reflectance = 0.5\nspecular = [0.1, 0.75, 0]"),
        "scene.toml:13: found reflectance + specular = 1.25 in material \"floor\", expected at most 1 in each channel"
    );
    assert_eq!(
        material_says("roughness = 0.2"),
        "scene.toml:12: found roughness = 0.2 in [material.floor], expected 0; rough mirrors aren't in this version yet"
    );
    assert_eq!(
        material_says("transmittance = [0, 0, 0.2]"),
        "scene.toml:12: found transmittance = [0, 0, 0.2] in [material.floor], expected 0; translucent materials aren't in \
         this version yet"
    );
    assert_eq!(material_says("roughness = 0\ntransmittance = 0.0"), "loaded: ");
    assert_eq!(
        material_says("dielectric = { ior = 0.9 }"),
        "scene.toml:12: found ior = 0.9 in dielectric of [material.floor], expected a number from 1 to 10 (window glass: 1.5)"
    );
    assert_eq!(
        material_says("dielectric = { ior = 1.5, absorption = -1 }"),
        "scene.toml:12: found absorption = -1 in dielectric of [material.floor], expected a number from 0 up, 1/m"
    );
    assert_eq!(
        material_says("dielectric = { ior = 1.5 }\nreflectance = 0.1"),
        "scene.toml:12: found dielectric = a table in [material.floor], expected no reflectance or specular beside it; what \
         glass reflects follows from its ior"
    );
}

#[test]
fn materials_that_no_mesh_has() {
    assert_eq!(
        says(&format!("{MESH}{LAMP}{SENSOR}[material.flor]\nreflectance = 0.2\n")),
        "scene.toml:11: found unknown material \"flor\", expected one that a mesh uses: \"floor\"; did you mean \"floor\"?"
    );
    assert_eq!(
        says(&format!("{LAMP}{SENSOR}[material.floor]\nreflectance = 0.2\n")),
        "scene.toml:9: found unknown material \"floor\", expected a [[mesh]] that uses it"
    );
}

#[test]
fn render_options_that_can_t_be() {
    let render_says = |line: &str| says(&format!("{LAMP}{SENSOR}[render]\n{line}\n"));
    assert_eq!(
        render_says("photons = 0"),
        "scene.toml:10: found photons = 0 in [render], expected a whole number from 1 to 1099511627776"
    );
    assert_eq!(
        render_says("nearest = 1"),
        "scene.toml:10: found nearest = 1 in [render], expected a whole number from 2 to 1000000000"
    );
    assert_eq!(
        render_says("radius = nan"),
        "scene.toml:10: found radius = nan in [render], expected a number above 0, m"
    );
    assert_eq!(
        render_says("method = \"path\""),
        "scene.toml:10: found method = \"path\" in [render], expected one of \"split\", \"photons\", \"seed\""
    );
    assert_eq!(
        render_says("tree = \"bvh\""),
        "scene.toml:10: found tree = \"bvh\" in [render], expected one of \"kd\", \"kiddo\", \"paper\", \"brute\""
    );
}

#[test]
fn cameras_are_still_to_come() {
    assert_eq!(
        says(&format!("{LAMP}{SENSOR}[[camera]]\nname = \"view\"\n")),
        "scene.toml:9: found a [[camera]], expected measuring planes and sensors; camera images aren't in this version yet; \
         measuring planes and sensors are"
    );
}

#[test]
fn obj_files_that_can_t_be() {
    assert_eq!(
        obj_says("v 0 0 0\n# nothing\n"),
        "room.obj: found an OBJ file without faces, expected lines that begin with f; is it an OBJ file, exported with its \
         faces?"
    );
    assert_eq!(
        obj_says(&OBJ.replace("v 1 1 0", "v 1 NaN 0")),
        "room.obj:4: found \"1 NaN 0\", expected three finite numbers; repair the vertex"
    );
    assert_eq!(
        obj_says(&OBJ.replace("v 1 1 0", "v 1 1e999 0")),
        "room.obj:4: found \"1 1e999 0\", expected finite coordinates within 1e9 m of the origin"
    );
    assert_eq!(
        obj_says(&OBJ.replace("v 1 1 0", "v 1 1e10 0")),
        "room.obj:4: found \"1 1e10 0\", expected finite coordinates within 1e9 m of the origin"
    );
    assert_eq!(
        obj_says(&OBJ.replace("v 1 1 0", "v 1 one 0")),
        "room.obj:4: found \"1 one 0\", expected three finite numbers; repair the vertex"
    );
    assert_eq!(
        obj_says(&OBJ.replace("v 1 1 0", "v 1 1")),
        "room.obj:4: found \"v 1 1\", expected v x y z, three finite numbers"
    );
    assert_eq!(
        obj_says(&OBJ.replace("v 1 1 0", "v 1 1 0 0")),
        "room.obj:4: found \"v 1 1 0 0\", expected v x y z, three finite numbers"
    );
    assert_eq!(
        obj_says(&OBJ.replace("f 1 2 3 4", "f 0 1 2")),
        "room.obj:7: found vertex 0 in a face, expected 1 … 4; OBJ counts from 1"
    );
    assert_eq!(
        obj_says(&OBJ.replace("f 1 2 3 4", "f 1/1/1 2/1/1 5/1/1")),
        "room.obj:7: found vertex 5 in a face, expected 1 … 4"
    );
    assert_eq!(
        obj_says(&OBJ.replace("f 1 2 3 4", "f -1 -2 -5")),
        "room.obj:7: found vertex -5 in a face, expected no less than -4, as 4 vertices stand above"
    );
    assert_eq!(
        obj_says(&OBJ.replace("f 1 2 3 4", "f 1 2")),
        "room.obj:7: found a face with 2 corners, expected from 3 to 10000"
    );
    assert_eq!(
        obj_says(&OBJ.replace("f 1 2 3 4", "f 1 2 x")),
        "room.obj:7: found \"f 1 2 x\", expected f and vertex numbers, as in f 1 2 3 or f 1/1/1 2/2/1 3/3/1"
    );
    assert_eq!(
        obj_says(&OBJ.replace("f 1 2 3 4", "f /1 2 3")),
        "room.obj:7: found the corner \"/1\" without a vertex, expected a vertex number, as in f 1/1/1 2/2/1 3/3/1"
    );
    assert_eq!(
        obj_says(&OBJ.replace("usemtl floor", "usemtl")),
        "room.obj:6: found usemtl without a name, expected usemtl NAME"
    );
}

#[test]
fn texture_and_normal_numbers_don_t_matter() {
    assert_eq!(obj_says(&OBJ.replace("f 1 2 3 4", "vt 0 0\nf 1/-9/9 2/0/0 3/99/x 4//")), "loaded: ");
}

#[test]
fn materials_without_a_reflectance() {
    assert_eq!(
        obj_says(&OBJ.replace("usemtl floor", "usemtl my floor")),
        "room.obj:6: found no reflectance for material \"my floor\", expected Kd in an MTL file, or a section in the scene \
         file; add [material.\"my floor\"] with reflectance = 0.5, say"
    );
    assert_eq!(
        obj_says(&OBJ.replace("usemtl floor\n", "").replace("f 1 2 3 4", "f 1 2 3\nusemtl wall\nf 1 3 4")),
        "room.obj:6: found no reflectance for materials \"default\", \"wall\", expected Kd in an MTL file, or a section in \
         the scene file; add [material.default] with reflectance = 0.5, say"
    );
    assert_eq!(
        obj_says(&OBJ.replace("room.mtl", "else.mtl")),
        "room.obj:6: found no reflectance for material \"floor\", expected Kd in an MTL file, or a section in the scene \
         file; add [material.floor] with reflectance = 0.5, say; the MTL file \"else.mtl\" is missing"
    );
    let named = format!("{MESH}{LAMP}{SENSOR}[material.floor]\nreflectance = 0.2\n");
    assert_eq!(
        says_of(&named, &OBJ.replace("room.mtl", "else.mtl"), MTL),
        "loaded: room.obj:1: MTL file \"else.mtl\" left out (there is no such file)"
    );
}

#[test]
fn mtl_files_that_can_t_be() {
    assert_eq!(
        mtl_says("newmtl floor\nKd 1.2 0.5 0.5\n"),
        "room.mtl:2: found Kd 1.2 0.5 0.5 in material \"floor\", expected numbers from 0 to 1; reflectance in \
         [material.floor] of the scene file overrides it"
    );
    assert_eq!(
        mtl_says("newmtl floor\nillum 3\nKd 0.7\nKs 0.5\n"),
        "room.mtl:4: found reflectance + specular = 1.2 in material \"floor\", expected at most 1 in each channel"
    );
    assert_eq!(
        mtl_says("newmtl floor\nKd 0.7 0.7\n"),
        "room.mtl:2: found \"Kd 0.7 0.7\", expected Kd and one or three numbers"
    );
    assert_eq!(
        mtl_says("newmtl floor\nKd 0.7 0.7 red\n"),
        "room.mtl:2: found \"Kd 0.7 0.7 red\", expected a keyword and finite numbers, as in Kd 0.5 0.5 0.5"
    );
    assert_eq!(
        mtl_says("newmtl floor\nKd 0.7 0.7 nan\n"),
        "room.mtl:2: found Kd 0.7 0.7 NaN in material \"floor\", expected numbers from 0 to 1; reflectance in \
         [material.floor] of the scene file overrides it"
    );
    assert_eq!(
        mtl_says("newmtl floor\nKd 0.7\nKe 100 -1 0\n"),
        "room.mtl:3: found Ke 100 -1 0 in material \"floor\", expected numbers from 0 up, cd/m²"
    );
    assert_eq!(
        mtl_says("newmtl floor\nillum 4\nNi 0.5\nd 0.5\n"),
        "room.mtl:3: found Ni 0.5 in material \"floor\", expected from 1 to 10; dielectric in [material.floor] of the scene \
         file overrides it"
    );
}

#[test]
fn warnings() {
    assert_eq!(
        mtl_says("newmtl floor\nKd 0.2\nmap_Kd wood.png\n"),
        "loaded: room.mtl:3: map_Kd of material \"floor\" left out; its Kd counts"
    );
    assert_eq!(
        mtl_says("newmtl floor\nKd 0.2\nKs 0.3\nKe 5\nillum 3\n"),
        "loaded: material \"floor\" both shines and mirrors"
    );
    assert_eq!(obj_says(&format!("{OBJ}f 1 2 2\nf 1 2 2\n")), "loaded: room.obj: 2 triangles without area left out");
    assert_eq!(
        says(&format!("{MESH}{LAMP}{}", PLANE.replace("[0, 0, 0]", "[0, 0, -5]"))),
        "loaded: plane \"floor\" is wholly outside the mesh's bounding box"
    );
}

/// Cutting a sound scene short anywhere, or spoiling any one byte of it, never panics and never takes more than one line.
#[test]
fn no_byte_makes_it_panic() {
    let toml = format!(
        "{MESH}{LAMP}opening = {{ rectangle = [1, 1] }}\narray = {{ count = [2, 2], pitch = [1, 1] }}\n{SENSOR}{PLANE}\
         [material.floor]\nreflectance = 0.2\n[render]\nphotons = 1e6\n"
    );
    let sound = [("scene.toml", toml.as_bytes()), ("room.obj", OBJ.as_bytes()), ("room.mtl", MTL.as_bytes())];
    for spoilt in 0..sound.len() {
        let folder = Folder::with(&sound);
        let (name, bytes) = sound[spoilt];
        let try_with = |bytes: &[u8]| {
            fs::write(folder.0.join(name), bytes).unwrap();
            let message = folder.message();
            assert!(
                !message.contains(['\n', '\r', '\0', '\u{1b}']),
                "{message:?} from {:?}",
                String::from_utf8_lossy(bytes)
            );
        };
        for at in 0..bytes.len() {
            try_with(&bytes[..at]);
            let mut bytes = bytes.to_vec();
            bytes[at] = b"\0\n\\\"-9 \x1b\xff"[at % 9];
            try_with(&bytes);
        }
    }
}
