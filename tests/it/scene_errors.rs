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
const CAMERA: &str =
    "[[camera]]\nname = \"view\"\neye = [0, 0, 1.5]\nlook_at = [4, 5, 1]\nfov = 60\npixels = [96, 54]\n";
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

/// What a sound scene says once its material has these lines (from line 12 on).
fn material_says(lines: &str) -> String {
    says(&format!("{MESH}{LAMP}{SENSOR}[material.floor]\n{lines}\n"))
}

#[test]
fn a_sound_scene_loads_without_a_word() {
    assert_eq!(says(&format!("{MESH}{LAMP}{SENSOR}")), "loaded: ");
    assert_eq!(says(&format!("{LAMP}{SENSOR}{PLANE}")), "loaded: ");
}

/// Text in memory is what a file `scene.toml` of its folder would be, hash and messages included.
#[test]
fn text_in_memory_is_read_as_a_file() {
    for toml in [format!("{MESH}{LAMP}{SENSOR}"), format!("{MESH}{LAMP}flow = 3\n{SENSOR}")] {
        let files = [("scene.toml", toml.as_str()), ("room.obj", OBJ), ("room.mtl", MTL)];
        let folder = Folder::with(&files.map(|(name, text)| (name, text.as_bytes())));
        let seen = |scene: Result<Scene, luxmap::error::Error>| {
            scene.map(|scene| (scene.hash, scene.file, scene.name)).map_err(|error| error.to_string())
        };
        let loaded = seen(Scene::load(&folder.0.join("scene.toml")));
        fs::remove_file(folder.0.join("scene.toml")).unwrap();
        assert_eq!(seen(Scene::parse(&toml, &folder.0)), loaded);
    }
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
        says(&format!("[[mesh]]\nfile = \".\"\n{LAMP}{SENSOR}")),
        "scene.toml:2: found file = \".\" (it is a folder), expected an OBJ file; its path starts from the scene file's \
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
         opening, photometry, lamp_set, variant, flux, dimming, color, cct, group, array, maintenance_factor, dimming_min, power, standby; did you mean color?"
    );
    assert_eq!(
        says("[[lamp]]\n"),
        "scene.toml:1: found unknown key \"lamp\" in the scene file, expected one of name, mesh, material, luminaire, \
         plane, sensor, surface, camera, render, maintenance_factor"
    );
    assert_eq!(
        luminaire_says("opening = { disk = 0.3 }"),
        "scene.toml:5: found unknown key \"disk\" in opening of [[luminaire]], expected one of rectangle, disc, \
         ellipse, box, cylinder, tube, sphere, ellipsoid; did you \
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
        "scene.toml: found neither a [[plane]] nor a [[sensor]], [[surface]] or [[camera]], expected at least one of them; \
         they say where illuminance is wanted"
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
        "scene.toml:5: found photometry = \"panel.ies\" (there is no such file), expected a photometric file (.ies, .ldt, .gldf, \
         TM-33), \"lambertian\" or \"isotropic\"; its path starts from the scene file's folder"
    );
    assert_eq!(
        luminaire_says("photometry = \"room.obj\""),
        "room.obj: found neither a line TILT= nor the numbers that begin a EULUMDAT file, expected a photometric file: \
         LM-63 (.ies), EULUMDAT (.ldt), TM-33 (.xml) or GLDF (.gldf)"
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
        "scene.toml:5: found count = [0, 5] in array of [[luminaire]], expected two whole numbers from 1 to 100000"
    );
    assert_eq!(
        luminaire_says("array = { count = [10000, 10000], pitch = [1, 1] }"),
        "scene.toml:5: found count = [10000, 10000] in array of [[luminaire]], expected at most 100000 luminaires"
    );
}

#[test]
fn measuring_planes_that_can_t_be() {
    let plane_says = |old: &str, new: &str| says(&format!("{LAMP}{}", PLANE.replace(old, new)));
    assert_eq!(
        plane_says("cells = [6, 7]", "cells = [6, 0]"),
        "scene.toml:10: found cells = [6, 0] in [[plane]], expected two whole numbers from 1 to 268435456"
    );
    assert_eq!(
        plane_says("cells = [6, 7]", "cells = [100000, 100000]"),
        "scene.toml:10: found cells = [100000, 100000] in [[plane]], expected two whole numbers from 1 up, at most \
         268435456 cells in all"
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
        material_says("reflectance = 0.5\nspecular = 0.2\ntransmittance = [0.1, 0.1, 0.375]"),
        "scene.toml:14: found reflectance + specular + transmittance = 1.075 in material \"floor\", expected at most 1 in each \
         channel"
    );
    assert_eq!(
        material_says("transmittance = 0.9"), // beside the MTL's Kd 0.2
        "scene.toml:12: found reflectance + specular + transmittance = 1.1 in material \"floor\", expected at most 1 in each \
         channel"
    );
    assert_eq!(
        material_says("transmittance = [0, 0, 2]"),
        "scene.toml:12: found transmittance = [0, 0, 2] in [material.floor], expected a number from 0 to 1, or three as \
         [r, g, b]; opal glass: about 0.5"
    );
    assert_eq!(
        material_says("specular = 0.5\nroughness = 1.5"),
        "scene.toml:13: found roughness = 1.5 in [material.floor], expected a number from 0 (a perfect mirror) to 1; \
         brushed metal: about 0.3"
    );
    assert_eq!(
        material_says("specular = 0.5\nroughness = [0.1, 0.2, 0.3]"),
        "scene.toml:13: found roughness = [0.1, 0.2, 0.3] in [material.floor], expected a number from 0 (a perfect mirror) \
         to 1; brushed metal: about 0.3"
    );
    assert_eq!(
        material_says("roughness = 0.2"),
        "loaded: scene.toml:12: roughness of material \"floor\" left out; it mirrors nothing"
    );
    assert_eq!(
        material_says("sides = \"front\""),
        "scene.toml:12: found sides = \"front\" in [material.floor], expected one of \"one\", \"two\""
    );
    assert_eq!(
        material_says("transmittance = 0.1\nsides = \"one\""),
        "scene.toml:13: found sides = \"one\" in [material.floor], expected \"two\" where there is a transmittance; a sheet \
         that light passes has two sides"
    );
    assert_eq!(material_says("roughness = 0\ntransmittance = 0.0\nsides = \"one\""), "loaded: ");
    assert_eq!(
        material_says("dielectric = { ior = 0.9 }"),
        "scene.toml:12: found ior = 0.9 in dielectric of [material.floor], expected a number from 1 to 10 (window glass: 1.5)"
    );
    assert_eq!(
        material_says("dielectric = { ior = 1.5, absorption = -1 }"),
        "scene.toml:12: found absorption = -1 in dielectric of [material.floor], expected a number from 0 up, 1/m, or three \
         as [r, g, b]"
    );
    assert_eq!(
        material_says("dielectric = { ior = 1.5, absorption = [1, 2] }"),
        "scene.toml:12: found absorption = [1, 2] in dielectric of [material.floor], expected a number from 0 up, 1/m, or \
         three as [r, g, b]"
    );
    assert_eq!(
        material_says("dielectric = { ior = 1.5 }\nreflectance = 0.1"),
        "scene.toml:12: found dielectric = a table in [material.floor], expected no other key beside it; what glass \
         reflects follows from its ior"
    );
    assert_eq!(
        material_says("roughness = 0.3\ndielectric = { ior = 1.5 }"),
        "scene.toml:13: found dielectric = a table in [material.floor], expected no other key beside it; what glass \
         reflects follows from its ior"
    );
}

#[test]
fn panes_that_cannot_be() {
    let form = "a number from 0 to 1, three as [r, g, b], or { transmittance = 0.88 } with reflectance and curve; a clear pane: \
                about 0.88";
    for (line, found) in [("1.2", "1.2"), ("\"clear\"", "\"clear\""), ("[0.5, 0.5]", "[0.5, 0.5]")] {
        let said = format!("scene.toml:12: found glazing = {found} in [material.floor], expected {form}");
        assert_eq!(material_says(&format!("glazing = {line}")), said);
    }
    assert_eq!(
        material_says("glazing = { reflectance = 0.2 }"),
        "scene.toml:12: found glazing of [material.floor] without transmittance, expected transmittance = 0.88, that at normal \
         incidence"
    );
    assert_eq!(
        material_says("glazing = { transmittance = 0.9, reflectance = 0.2 }"),
        "scene.toml:12: found transmittance + reflectance = 1.1 in [material.floor], expected at most 1 in each channel"
    );
    assert_eq!(
        material_says("glazing = 0.8\nreflectance = 0.1"),
        "scene.toml:12: found glazing = 0.8 in [material.floor], expected no other key beside it; a pane has its own: glazing = \
         { transmittance = 0.7, reflectance = 0.2 }"
    );
    for curve in
        ["[[10, 0.8]]", "[[0, 0]]", "[[0, 0.5], [95, 0]]", "[[0, 0.5], [0, 0.4]]", "[[0, 1.5]]", "3", "\"dark\""]
    {
        let said = format!(
            "scene.toml:12: found curve = {curve} in glazing of [material.floor], expected \"clear\", \"cie171\", or [angle, \
             transmittance] pairs with angles from 0 up to 90, as in [[0, 0.8], [60, 0.65], [90, 0]]"
        );
        assert_eq!(material_says(&format!("glazing = {{ transmittance = 0.5, curve = {curve} }}")), said);
    }
    for sound in
        ["0.88", "[0.8, 0.5, 0]", "{ curve = \"cie171\" }", "{ curve = [[0, 0.8], [60, 0.6]], reflectance = 0.2 }"]
    {
        assert_eq!(material_says(&format!("glazing = {sound}")), "loaded: ", "{sound}");
    }
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
        "scene.toml:10: found nearest = 1 in [render], expected a whole number from 2 to 4294967295"
    );
    assert_eq!(
        render_says("radius = nan"),
        "scene.toml:10: found radius = nan in [render], expected a number above 0, m"
    );
    assert_eq!(
        render_says("method = \"walk\""),
        "scene.toml:10: found method = \"walk\" in [render], expected one of \"gather\", \"split\", \"path\", \"photons\", \
         \"seed\""
    );
    assert_eq!(
        render_says("tree = \"bvh\""),
        "scene.toml:10: found tree = \"bvh\" in [render], expected one of \"kd\", \"kiddo\", \"paper\", \"brute\""
    );
}

#[test]
fn limits_of_a_run_that_can_t_be() {
    let render_says = |line: &str| says(&format!("{LAMP}{SENSOR}[render]\n{line}\n"));
    assert_eq!(render_says("error = 0"), "scene.toml:10: found error = 0 in [render], expected a number above 0, %");
    assert_eq!(render_says("time = -1"), "scene.toml:10: found time = -1 in [render], expected a number above 0, s");
    assert_eq!(render_says("memory = 0"), "scene.toml:10: found memory = 0 in [render], expected a number above 0, GB");
    assert_eq!(
        render_says("rays = 0"),
        "scene.toml:10: found rays = 0 in [render], expected a whole number from 1 to 65536"
    );
    assert_eq!(
        render_says("smooth = 1"),
        "scene.toml:10: found smooth = 1 in [render], expected true, false, \"on\" or \"off\""
    );
    assert_eq!(
        render_says("smooth = \"yes\""),
        "scene.toml:10: found smooth = \"yes\" in [render], expected true, false, \"on\" or \"off\""
    );
    assert_eq!(
        render_says("ray = 3"),
        "scene.toml:10: found unknown key \"ray\" in [render], expected one of method, photons, nearest, radius, \
         rays, smooth, error, time, passes, tree, seed, memory, groups; did you mean rays?"
    );
}

#[test]
fn cameras_that_can_t_be() {
    let camera_says = |old: &str, new: &str| says(&format!("{LAMP}{}", CAMERA.replace(old, new)));
    assert_eq!(camera_says("", ""), "loaded: ");
    assert_eq!(
        camera_says("fov = 60\n", ""),
        "scene.toml:5: found [[camera]] without fov, expected fov = 60 (degrees from bottom to top)"
    );
    assert_eq!(
        camera_says("fov = 60", "fov = 180"),
        "scene.toml:9: found fov = 180 in [[camera]], expected degrees from bottom to top, from 0.01 to 170"
    );
    assert_eq!(
        camera_says("[4, 5, 1]", "[0, 0, 1.5]"),
        "scene.toml:8: found look_at = [0, 0, 1.5] in [[camera]], expected a point other than eye"
    );
    assert_eq!(
        camera_says("pixels = [96, 54]", "pixels = [96000, 54000]"),
        "scene.toml:10: found pixels = [96000, 54000] in [[camera]], expected two whole numbers from 1 up, at most 25000000 \
         pixels in all"
    );
    assert_eq!(
        camera_says("fov = 60", "up = [8, 10, -1]\nfov = 60"),
        "scene.toml:9: found up = [8, 10, -1] in [[camera]], expected a direction other than that from eye to look_at, or \
         its opposite"
    );
    assert_eq!(
        camera_says("fov = 60", "angle = 60"),
        "scene.toml:9: found unknown key \"angle\" in [[camera]], expected one of name, eye, look_at, up, fov, pixels"
    );
    assert_eq!(
        says(&format!("{LAMP}{PLANE}{}", CAMERA.replace("view", "Floor"))),
        "scene.toml:12: found name = \"Floor\" in [[camera]], expected a name that no [[plane]] has; both are written as \
         NAME.exr"
    );
    assert_eq!(
        says(&format!("{LAMP}{CAMERA}{CAMERA}")),
        "scene.toml:12: found a second camera named \"view\", expected a name of its own for each; the first is at \
         scene.toml:6"
    );
    // Straight down and straight up: the image's top is then the world's y, as in a plan.
    assert_eq!(camera_says("[4, 5, 1]", "[0, 0, 0]"), "loaded: ");
    assert_eq!(camera_says("[4, 5, 1]", "[0, 0, 3]"), "loaded: ");
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
        "room.obj: found an OBJ file without faces that have three different corners, expected lines that begin with f; is it an OBJ \
         file, exported with its faces?"
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
        "room.obj:6: found no reflectance for material \"default\", expected Kd in an MTL file, or a section in the scene file; \
         add [material.default] with reflectance = 0.5, say; [material.\"*\"] or --reflectance 0.5 speaks for all that are left"
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
         file; add [material.\"my floor\"] with reflectance = 0.5, say; [material.\"*\"] or --reflectance 0.5 speaks for all \
         that are left"
    );
    assert_eq!(
        obj_says(&OBJ.replace("usemtl floor\n", "").replace("f 1 2 3 4", "f 1 2 3\nusemtl wall\nf 1 3 4")),
        "room.obj:6: found no reflectance for materials \"default\", \"wall\", expected Kd in an MTL file, or a section in \
         the scene file; add [material.default] with reflectance = 0.5, say; [material.\"*\"] or --reflectance 0.5 speaks for \
         all that are left"
    );
    assert_eq!(
        obj_says(&OBJ.replace("room.mtl", "else.mtl")),
        "room.obj:6: found no reflectance for material \"floor\", expected Kd in an MTL file, or a section in the scene \
         file; add [material.floor] with reflectance = 0.5, say; [material.\"*\"] or --reflectance 0.5 speaks for all that are \
         left; the MTL file \"else.mtl\" is missing; is it \"room.mtl\", which lies beside the OBJ file?"
    );
    let named = format!("{MESH}{LAMP}{SENSOR}[material.floor]\nreflectance = 0.2\n");
    assert_eq!(
        says_of(&named, &OBJ.replace("room.mtl", "else.mtl"), MTL),
        "loaded: room.obj:1: MTL file \"else.mtl\" left out (there is no such file: looked for else.mtl, in capitals or not)"
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
        says_of(&format!("{MESH}{LAMP}{SENSOR}[material.floor]\nspecular = 0.5\n"), OBJ, "newmtl floor\nKd 0.7\n"),
        "scene.toml:12: found reflectance + specular = 1.2 in material \"floor\", expected at most 1 in each channel"
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
        mtl_says("newmtl floor\nillum 4\nNi 50\nd 0.5\n"),
        "room.mtl:3: found Ni 50 in material \"floor\", expected from 1 to 10; dielectric in [material.floor] of the scene \
         file overrides it"
    );
}

#[test]
fn warnings() {
    assert_eq!(
        mtl_says("newmtl floor\nKd 0.2\nmap_Kd wood.png\n"),
        "loaded: room.mtl:3: map_Kd \"wood.png\" of material \"floor\" left out (there is no such file); its Kd counts; \
         reflectance in [material.floor] overrides it"
    );
    assert_eq!(
        mtl_says("newmtl floor\nKd 0.2\nmap_Kd -s 2 2 2 room.obj\n"),
        "loaded: room.mtl:3: map_Kd \"room.obj\" of material \"floor\" left out (it is neither PNG nor JPEG); its Kd \
         counts; reflectance in [material.floor] overrides it"
    );
    assert_eq!(
        mtl_says("newmtl floor\nmap_Kd wood.png\n"),
        "room.obj:6: found no reflectance for material \"floor\", expected Kd in an MTL file, or a section in the scene \
         file; add [material.floor] with reflectance = 0.5, say; [material.\"*\"] or --reflectance 0.5 speaks for all that are \
         left"
    );
    assert_eq!(
        says_of(
            &format!("{MESH}{LAMP}{SENSOR}[material.floor]\nreflectance = 0.4\n"),
            OBJ,
            "newmtl floor\nKd 0.2\nmap_Kd wood.png\n"
        ),
        "loaded: "
    );
    assert_eq!(
        mtl_says("newmtl floor\nNi 1.5\nillum 4\nTf 0.5 0.9 0.5\n"),
        "loaded: room.obj: 1 open sheet of glass \"floor\", no solid: taken for thin panes that pass [0.500, 0.900, 0.500]; \
         glazing = … in [material.floor] tells another share"
    );
    assert_eq!(
        mtl_says("newmtl floor\nillum 3\nKd 0.7\nKs 0.5\n"),
        "loaded: room.mtl:4: Kd + Ks = 1.2 in material \"floor\", more light than arrives: Ks taken for a highlight and left \
         out; for a metal write reflectance = 0, specular = 0.7, roughness = 0 in [material.floor]"
    );
    assert_eq!(
        says_of(
            &format!("{MESH}{LAMP}{SENSOR}[material.floor]\nroughness = 0.4\n"),
            OBJ,
            "newmtl floor\nNi 1.5\nillum 7\n"
        ),
        "loaded: scene.toml:12: roughness of material \"floor\" left out; it is smooth glass | room.obj: 1 open sheet of glass \
         \"floor\", no solid: taken for thin panes that pass 0.923; glazing = … in [material.floor] tells another share"
    );
    assert_eq!(
        mtl_says("newmtl floor\nKd 0.2\nKs 0.3\nKe 500\nillum 3\n"),
        "loaded: material \"floor\" both shines and mirrors"
    );
    assert_eq!(
        obj_says(&format!("{OBJ}v 2 0 0\nf 1 2 5\nf 5 2 1\n")),
        "loaded: room.obj: 2 triangles without area left out"
    );
    assert_eq!(
        obj_says(&format!("{OBJ}f 1 2 2\nf 1 2\n")),
        "loaded: room.obj:8: 2 faces with fewer than three different corners left out, the first of them here"
    );
    assert_eq!(
        says(&format!("{MESH}{LAMP}{}", PLANE.replace("[0, 0, 0]", "[0, 0, -5]"))),
        "loaded: plane \"floor\" is wholly outside the mesh's bounding box"
    );
}

/// Cutting a sound scene short anywhere, or spoiling any one byte of it, never panics and never takes more than one line.
#[test]
fn no_byte_makes_it_panic() {
    let toml = format!(
        "{MESH}{LAMP}opening = {{ rectangle = [1, 1] }}\narray = {{ count = [2, 2], pitch = [1, 1] }}\n{SENSOR}{PLANE}{CAMERA}\
         [material.floor]\nreflectance = 0.2\nspecular = 0.1\nroughness = 0.3\ntransmittance = [0.1, 0, 0]\n[render]\nphotons = 1e6\n"
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

/// What a sound scene says once its sensor has more lines (line 5 on) and no normal.
fn body_says(lines: &str) -> String {
    says(&format!("[[sensor]]\nname = \"S\"\nposition = [0, 0, 1]\n\n{lines}\n{LAMP}"))
}

#[test]
fn measures_that_can_t_be() {
    assert_eq!(
        body_says("measure = \"cubic\""),
        "scene.toml:5: found measure = \"cubic\" in [[sensor]], expected one of \"plane\", \"cylindrical\", \
         \"semicylindrical\", \"hemispherical\", \"spherical\""
    );
    assert_eq!(
        body_says("measure = \"plane\""),
        "scene.toml:1: found [[sensor]] without normal, expected normal = [0, 0, 1]"
    );
    assert_eq!(
        body_says("measure = \"semicylindrical\""),
        "scene.toml:1: found [[sensor]] without facing, expected facing = [1, 0, 0]"
    );
    assert_eq!(
        body_says("measure = \"semicylindrical\"\nfacing = [1, 0, 1]"),
        "scene.toml:6: found facing = [1, 0, 1] in [[sensor]], expected a direction at a right angle to the axis; the axis is \
         normal, [0, 0, 1] if not given; the angle is 45.0000°"
    );
    assert_eq!(
        body_says("measure = \"cylindrical\"\nfacing = [1, 0, 0]"),
        "scene.toml:6: found facing = [1, 0, 0] in [[sensor]], expected facing beside measure = \"semicylindrical\" only"
    );
    assert_eq!(
        body_says("measure = \"spherical\"\nnormal = [0, 0, 1]"),
        "scene.toml:6: found normal = [0, 0, 1] in [[sensor]], expected no normal beside measure = \"spherical\""
    );
}

/// What a sound scene says that measures a surface with these lines (line 9 on).
fn surface_says(lines: &str) -> String {
    says_of(
        &format!("{MESH}{LAMP}[[surface]]\nname = \"s\"\n{lines}\n"),
        &OBJ.replace("usemtl", "g desk top\nusemtl"),
        MTL,
    )
}

#[test]
fn surfaces_that_can_t_be() {
    assert_eq!(surface_says("group = \"desk\""), "loaded: ");
    assert_eq!(
        surface_says(""),
        "scene.toml:7: found [[surface]] without material or group, expected material or group = \"desk\"; the faces of a \
         material, of a group or object (g or o) of the OBJ file, or of both"
    );
    assert_eq!(
        surface_says("material = \"flor\""),
        "scene.toml:9: found unknown material \"flor\", expected one that a mesh has: \"floor\"; did you mean \"floor\"?"
    );
    assert_eq!(
        surface_says("group = \"desktop\""),
        "scene.toml:9: found unknown group \"desktop\", expected one that a mesh has: \"desk\", \"desk top\", \"top\"; did you \
         mean \"desk top\"?"
    );
    assert_eq!(
        surface_says("material = \"floor\"\nside = \"top\""),
        "scene.toml:10: found side = \"top\" in [[surface]], expected one of \"front\", \"back\""
    );
    assert_eq!(
        surface_says("material = \"floor\"\nspacing = 0"),
        "scene.toml:10: found spacing = 0 in [[surface]], expected a number above 0, m"
    );
    assert_eq!(
        surface_says("material = \"floor\"\nspacing = 1e-4"),
        "scene.toml:10: found more than 1000000 samples for surface \"s\": 2 triangles, spacing = 0.0001, expected at most \
         1000000; a wider spacing, or a part of the mesh: a triangle is one sample at least"
    );
    assert_eq!(
        says(&format!("{LAMP}[[surface]]\nname = \"s\"\nmaterial = \"floor\"\n")),
        "scene.toml:7: found unknown material \"floor\", expected a [[mesh]] with a material of that name"
    );
    assert_eq!(
        surface_says("material = \"floor\"\n[[surface]]\nname = \"s\"\nmaterial = \"floor\""),
        "scene.toml:11: found a second surface named \"s\", expected a name of its own for each; the first is at scene.toml:8"
    );
    assert_eq!(
        says_of(
            &format!("{MESH}{LAMP}[[surface]]\nname = \"s\"\nmaterial = \"floor\"\ngroup = \"other\"\n"),
            &format!("g desk\n{OBJ}g other\nusemtl steel\nf 1 2 3\n"),
            &format!("{MTL}newmtl steel\nKd 0.5 0.5 0.5\n"),
        ),
        "scene.toml:7: found no face for surface \"s\", expected faces of that material and group, with an area"
    );
}

/// What a sound scene says once its plane of 6 m × 7 m and 6 × 7 cells has more lines (line 13 on).
fn plane_says(lines: &str) -> String {
    says(&format!("{MESH}{LAMP}{PLANE}{lines}\n"))
}

#[test]
fn areas_that_can_t_be() {
    assert_eq!(
        plane_says("margin = 3"),
        "scene.toml:13: found margin = 3 in [[plane]], expected a number from 0 to less than half of the plane's shorter \
         side, 3 m"
    );
    assert_eq!(
        plane_says("margin = 2.9"),
        "scene.toml:13: found margin = 2.9 in [[plane]], expected a margin that leaves the centre of a cell"
    );
    assert_eq!(
        plane_says("required = { mean = 500, u0 = 0.6 }"),
        "scene.toml:13: found unknown key \"u0\" in required of [[plane]], expected one of mean, uniformity"
    );
    assert_eq!(
        plane_says("[[plane.task]]\nname = \"desk\"\ncorner = [1, 1]"),
        "scene.toml:13: found [[plane.task]] without size, expected size = [1.6, 0.8] (m along and across)"
    );
    assert_eq!(
        plane_says("[[plane.task]]\nname = \"desk\"\ncorner = [5, 1]\nsize = [1.5, 1]"),
        "scene.toml:16: found size = [1.5, 1] in [[plane.task]], expected a task within the plane of 6 m × 7 m; it ends at \
         6.5 m, 2 m"
    );
    assert_eq!(
        plane_says("[[plane.task]]\nname = \"desk\"\ncorner = [1, 1]\nsize = [0.4, 0.4]"),
        "scene.toml:16: found size = [0.4, 0.4] in [[plane.task]], expected a task that holds the centre of a cell; give the \
         plane more cells"
    );
    assert_eq!(
        plane_says("[[plane.task]]\nname = \"d\"\ncorner = [1, 1]\nsize = [1, 1]\nrequired = { uniformity = 2 }"),
        "scene.toml:17: found uniformity = 2 in required of [[plane.task]], expected a number from 0 to 1"
    );
    assert_eq!(
        plane_says("task = 3"),
        "scene.toml:13: found task = 3, expected sections that begin with [[plane.task]]"
    );
}

#[test]
fn maintenance_factors_that_can_t_be() {
    let expected = "expected a number above 0, at most 1 (a clean office: about 0.8)";
    assert_eq!(
        says(&format!("maintenance_factor = 80\n{LAMP}{SENSOR}")),
        format!("scene.toml:1: found maintenance_factor = 80 in the scene file, {expected}")
    );
    assert_eq!(
        luminaire_says("maintenance_factor = 0"),
        format!("scene.toml:5: found maintenance_factor = 0 in [[luminaire]], {expected}")
    );
}
