//! MTL files and meshes as other programs write them: what their materials become, and faces that are drawn twice.

use std::fs;

use crate::common::files::{Folder, stderr, stdout};
use luxmap::luminaire::Opening;
use luxmap::scene::glazing::Glazing;
use luxmap::scene::inventory::{Inventory, MaterialSource};
use luxmap::scene::material::Dielectric;
use luxmap::scene::{Material, Scene, Sides};

const LAMP: &str = "[[luminaire]]\nname = \"L\"\nposition = [0.2, 0.2, 0]\nflux = 1000\n";
const SENSOR: &str = "[[sensor]]\nname = \"S\"\nposition = [0.2, 0.2, 0]\nnormal = [0, 0, 1]\n";

/// The scene of an OBJ and an MTL file beside a lamp and a sensor.
fn load(test: &str, more: &str, obj: &str, mtl: &str) -> Scene {
    fs::write(crate::common::folder(test).join("mesh.mtl"), mtl).expect("the target folder is writable");
    crate::common::scene(test, &format!("{LAMP}{SENSOR}{more}"), &format!("mtllib mesh.mtl\n{obj}"))
}

/// What becomes of a material `m` that an MTL file describes by these lines, and what is said about it.
fn material(head: &str, lines: &str) -> (Material, Vec<String>) {
    material_with("", head, lines)
}

/// The faces are those of a tetrahedron: glass of it has an inside.
fn material_with(more: &str, head: &str, lines: &str) -> (Material, Vec<String>) {
    let test = format!("mtl_foreign_{:?}", std::thread::current().id());
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl m\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    let mtl = format!("{head}newmtl m\n{}\n", lines.replace(", ", "\n"));
    let mut scene = load(&test, more, obj, &mtl);
    (scene.materials.remove(0), scene.warnings)
}

/// The one warning there is, from its place on.
fn only(warnings: &[String]) -> &str {
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    warnings[0].split_once("mesh.mtl:").expect("a place in the MTL file").1
}

fn grey(share: f64) -> Material {
    Material { reflectance: [share; 3], ..Material::black("m") }
}

fn pane(share: [f64; 3]) -> Material {
    Material { glazing: Some(Glazing::clear(share).into()), ..Material::black("m") }
}

/// Maya writes illum 4, Tf 1 1 1 and Ni 1 for everything, 3ds Max illum 4 or 2 beside d 1, Tr 0 and Ni 1.5, other programs d 1
/// and Tr 1: all of it is opaque, which needs no warning.
#[test]
fn what_programs_write_for_everything_is_no_glass() {
    for lines in [
        "illum 4, Kd 0.5 0.5 0.5, Ka 0 0 0, Tf 1.00 1.00 1.00, Ni 1.00",
        "Ns 10.0000, Ni 1.5000, d 1.0000, Tr 0.0000, Tf 1.0000 1.0000 1.0000, illum 2, Ka 0.5 0.5 0.5, Kd 0.5 0.5 0.5, Ks 0 0 0",
        "Ns 10.0000, Ni 1.5000, d 1.0000, Tr 0.0000, Tf 1.0000 1.0000 1.0000, illum 4, Kd 0.5 0.5 0.5",
        "Kd 0.5 0.5 0.5, d 1.0, Tr 1.0, illum 2",
        "Kd 0.5, illum 9",
        "Kd 0.5, Ni 1.45, illum 2, d 1",
        "Kd 0.5, Ks 0.3, Ns 250, illum 2",
        "Kd 0.5, Tf 1 1 1",
    ] {
        assert_eq!(material("", lines), (grey(0.5), vec![]), "{lines}");
    }
}

/// Where light passes it is 1 − d of it, times Tf, and no more than a clear pane of its Ni lets pass: of n = 1.5 that is
/// (1 − r)/(1 + r) = 12/13, r = 0.04.
#[test]
fn what_lets_light_pass_is_a_pane_of_that_transmittance() {
    for (lines, share) in [
        ("Kd 0.1, Ks 0.5, Ni 1.0, d 0.3, illum 2", [0.7; 3]),
        ("Kd 0.8, d 0.3", [0.7; 3]),
        ("Kd 0.8, d 0.25, Tr 0.75, Ni 1.5, Tf 1 1 1, illum 2", [0.75; 3]),
        ("Kd 0.8, d 0.4, illum 4", [0.6; 3]),
        ("Kd 0.8, Tr 0.5, Tf 1 0.5 0.25", [0.5, 0.25, 0.125]),
        ("Kd 0.8, d 0, Ni 1.5, illum 2", [12.0 / 13.0; 3]),
        ("Kd 0.8, d 0, illum 2", [1.0; 3]),
    ] {
        let (found, warnings) = material("", lines);
        let glazing = found.glazing.as_ref().expect("a pane");
        for (found, expected) in glazing.transmittance.iter().zip(share) {
            assert!((found - expected).abs() < 1e-12, "{lines}: {found}");
        }
        assert_eq!(Material { glazing: None, ..found }, Material::black("m"), "{lines}");
        assert!(warnings.is_empty() || lines.contains("Tr 0.5"), "{lines}: {warnings:?}");
    }
}

/// Ni > 1 with illum 4, 6, 7 or 9 is glass with an inside, clear: what it absorbs belongs to no thickness.
#[test]
fn glass_that_refracts_keeps_its_index() {
    for (lines, ior) in [
        ("Kd 0.8, Ks 0.5, Ni 1.45, d 0.1, illum 9", 1.45),
        ("Kd 0.1, Ni 1.5, d 0.3, illum 4", 1.5),
        ("Ni 1.5, illum 7, Tf 0.5 0.9 0.5", 1.5),
        ("Ni 1.5, d 0.5, Tf 0.5 1 0.5, illum 6", 1.5),
    ] {
        let (found, warnings) = material("", lines);
        let glass = Dielectric { ior, absorption: [0.0; 3] };
        assert_eq!(found, Material { dielectric: Some(glass), ..Material::black("m") }, "{lines}");
        let expected = format!(
            "mesh.obj: 1 body of glass \"m\" taken for clear glass of index {ior}: d and Tf belong to no thickness; dielectric in \
             [material.m] gives it an absorption per metre"
        );
        assert!(warnings.len() == 1 && warnings[0].ends_with(&expected), "{lines}: {warnings:?}");
    }
    for lines in ["Ni 1.5, d 0, illum 9", "Ni 1.5, illum 7"] {
        let (found, warnings) = material("", lines);
        assert_eq!((found.dielectric.map(|glass| glass.ior), warnings), (Some(1.5), vec![]), "{lines}");
    }
}

/// Where programs mean opposite things by the same words, one is taken and the other told.
#[test]
fn guesses_are_told() {
    for (lines, expected, said) in [
        (
            "Kd 0.5, illum 4, Tf 0.3 0.3 0.3, Ni 1",
            grey(0.5),
            "1: Tf 0.3 0.3 0.3 without d in material \"m\": opaque, since programs mean opposite things by Tf; glazing = 0.3 \
             or 0.7 in [material.m] overrides it",
        ),
        (
            "Kd 0.5, d 0.2, Tr 0.2",
            pane([0.8; 3]),
            "1: d 0.2 and Tr 0.2 in material \"m\": d counts, and 0.8 passes; glazing in [material.m] overrides it",
        ),
        (
            "Kd 0.5, Tr 1",
            grey(0.5),
            "1: Tr 1 without d in material \"m\": opaque, as programs mean it that write Tr as d; glazing in [material.m] \
             overrides it",
        ),
        (
            "Kd 0.5, Tr 0.25",
            pane([0.25; 3]),
            "1: Tr 0.25 without d in material \"m\": the share that passes; some programs write d there; glazing in \
             [material.m] overrides it",
        ),
        (
            "Kd 0.5, d 1, Ni 1.5, illum 7",
            grey(0.5),
            "1: illum 7 and Ni beside d 1 in material \"m\": opaque; dielectric or glazing in [material.m] overrides it",
        ),
        (
            "d 0.3, Ni 0.5, illum 4",
            pane([0.7; 3]),
            "1: Ni 0.5 in material \"m\": no glass has that index, so it is a sheet; dielectric in [material.m] overrides it",
        ),
        (
            "Kd 0.5, map_d -s 2 2 leaf.png",
            grey(0.5),
            "1: map_d \"leaf.png\" in material \"m\": left out, and what it cuts away stays; glazing or reflectance in \
             [material.m] overrides it",
        ),
    ] {
        let (found, warnings) = material("", lines);
        assert_eq!(found, expected, "{lines}");
        assert_eq!(only(&warnings), said, "{lines}");
    }
}

/// The scene file's word wins, and then nothing is guessed.
#[test]
fn a_section_silences_the_guess() {
    let section = "[material.m]\nreflectance = 0.3\n";
    for lines in ["Kd 0.5, d 0.2, Tr 0.2", "d 7", "Ks 0.9, Kd 0.9, illum 2", "Ni 99, illum 7"] {
        assert_eq!(material_with(section, "", lines), (grey(0.3), vec![]), "{lines}");
    }
}

/// Ks with illum 3 or 5 mirrors as sharply as Ns says: GGX α = √(2/(Ns + 2)); without Ns it is a perfect mirror.
#[test]
fn a_highlight_s_exponent_is_a_mirror_s_roughness() {
    for (lines, alpha) in [
        ("Kd 0.1, Ks 0.8, illum 3", 0.0),
        ("Kd 0.1, Ks 0.8, Ns 10, illum 5", (2.0_f64 / 12.0).sqrt()),
        ("Kd 0.1, Ks 0.8, Ns 998, illum 3", 0.002_f64.sqrt()),
        ("Kd 0.1, Ks 0.8, Ns 0, illum 3", 1.0),
    ] {
        let expected = Material { specular: [0.8; 3], roughness: alpha, ..grey(0.1) };
        assert_eq!(material("", lines), (expected, vec![]), "{lines}");
    }
    let smoother = Material { specular: [0.8; 3], roughness: 0.05, ..grey(0.1) };
    let section = "[material.m]\nroughness = 0.05\n";
    assert_eq!(material_with(section, "", "Kd 0.1, Ks 0.8, Ns 10, illum 5"), (smoother, vec![]));
}

/// Blender's metals and 3ds Max's highlights add up to more light than arrives. Kd is the whole reflectance in both.
#[test]
fn a_highlight_makes_no_light() {
    for (lines, reflectance, sum, alpha) in [
        ("Ns 250, Ka 1 1 1, Kd 0.8 0.8 0.8, Ks 0.5 0.5 0.5, Ke 0 0 0, Ni 1.45, d 1.0, illum 3", 0.8, 1.3, 0.089),
        ("Kd 0.588 0.588 0.588, Ks 0.9 0.9 0.9, Ns 10, Tr 0.0, Tf 1.0 1.0 1.0, illum 5", 0.588, 1.488, 0.408),
    ] {
        let (found, warnings) = material("", lines);
        assert_eq!(found, grey(reflectance), "{lines}");
        let said = format!(
            ": Kd + Ks = {sum} in material \"m\", more light than arrives: Ks taken for a highlight and left out; for a metal \
             write reflectance = 0, specular = {reflectance}, roughness = {alpha} in [material.m]"
        );
        assert!(only(&warnings).ends_with(&said), "{warnings:?}");
    }
}

/// Where the file says that Blender wrote it, it is known what illum 3 means: of the base colour Kd the share Ka is a metal's,
/// its roughness is 1 − √(Ns/1000), and α is that squared: ½² = 0.25 of Ns 250.
#[test]
fn a_metal_of_blender_s_mirrors_its_colour() {
    let head = "# Blender 3.6.0 MTL File: 'room.blend'\n# www.blender.org\n\n";
    let lines = "Ns 250, Ka 1 1 1, Kd 0.8 0.4 0.4, Ks 0.5 0.5 0.5, Ke 0 0 0, Ni 1.45, d 1.0, illum 3";
    let (found, warnings) = material(head, lines);
    assert_eq!(warnings, Vec::<String>::new());
    assert_eq!((found.reflectance, found.specular), ([0.0; 3], [0.8, 0.4, 0.4]));
    assert!((found.roughness - 0.25).abs() < 1e-12, "{}", found.roughness);
    let (half, _) = material(head, &lines.replace("Ka 1 1 1", "Ka 0.5 0.5 0.5"));
    assert_eq!((half.reflectance, half.specular), ([0.4, 0.2, 0.2], [0.4, 0.2, 0.2]));
    assert_eq!(material(head, &lines.replace("illum 3", "illum 2")).0.specular, [0.0; 3]);
}

/// Impossible shares are refused with their line, where they matter.
#[test]
fn impossible_transparency_is_refused() {
    let folder = Folder::new("mtl_foreign", "impossible");
    let scene = format!("[[mesh]]\nfile = \"mesh.obj\"\n{LAMP}{SENSOR}");
    folder.write("mesh.obj", "mtllib mesh.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n");
    folder.write("scene.toml", &scene);
    for (line, found) in [("d 1.5", "d 1.5"), ("Tr -1", "Tr -1"), ("d nan", "d NaN")] {
        folder.write("mesh.mtl", &format!("newmtl m\nKd 0.5\n{line}\n"));
        let expected = format!(
            "luxmap: mesh.mtl:3: found {found} in material \"m\", expected a number from 0 to 1; glazing or reflectance in \
             [material.m] of the scene file overrides it"
        );
        assert_eq!(folder.refused(&["plan", "scene.toml"]), expected);
    }
}

/// Corners of a room of 4 × 4 × 3 m.
const CORNERS: &str = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 0 0 3\nv 4 0 3\nv 4 4 3\nv 0 4 3\n";
/// Its faces, fronts inwards.
const FRONTS: [&str; 6] = ["1 2 3 4", "5 8 7 6", "1 5 6 2", "2 6 7 3", "3 7 8 4", "4 8 5 1"];
const TWO_SIDED: &str = "newmtl wall\nKd 0.5\nnewmtl back\nKd 0.1\n";

/// A statement of faces, those cut into triangles along the diagonal from their corner number `first`, where one is given.
fn faces(material: &str, faces: &[&str], reversed: bool, first: Option<usize>) -> String {
    let face = |face: &&str| {
        let mut corners: Vec<&str> = face.split(' ').collect();
        if reversed {
            corners.reverse();
        }
        match first {
            None => format!("f {}\n", corners.join(" ")),
            Some(first) => {
                corners.rotate_left(first);
                let [a, b, c, d] = corners[..] else { panic!("four corners") };
                format!("f {a} {b} {c}\nf {a} {c} {d}\n")
            }
        }
    };
    format!("usemtl {material}\n{}", faces.iter().map(face).collect::<String>())
}

/// Places of the corners of all triangles.
fn corners(scene: &Scene) -> Vec<[glam::DVec3; 3]> {
    (0..scene.mesh.triangles.len()).map(|triangle| scene.mesh.corners(triangle)).collect()
}

/// Each face of a room is written twice with a material for either side, as polygons or triangles, cut along the same diagonals
/// or the others, fronts first or last, with corners of their own or shared: it is the room of the sides written first, with
/// the others on the back.
#[test]
fn faces_written_twice_are_one_with_two_sides() {
    let single = load("twice_single", "", &(CORNERS.to_owned() + &faces("wall", &FRONTS, false, None)), TWO_SIDED);
    let outwards = load("twice_outwards", "", &(CORNERS.to_owned() + &faces("back", &FRONTS, true, None)), TWO_SIDED);
    let two_sided = |front: &Material, back: &Material| Material {
        name: format!("{} / {}", front.name, back.name),
        back: Some(back.clone().into()),
        ..front.clone()
    };
    let (wall, back) = (&single.materials[0], &outwards.materials[0]);
    for (number, first) in [None, Some(0), Some(1), Some(3)].into_iter().enumerate() {
        for own_corners in [false, true] {
            let moved: Vec<String> = FRONTS
                .iter()
                .map(|face| {
                    face.split(' ').map(|i| (i.parse::<usize>().unwrap() + 8).to_string()).collect::<Vec<_>>().join(" ")
                })
                .collect();
            let moved: Vec<&str> = moved.iter().map(String::as_str).collect();
            let behind = if own_corners { &moved[..] } else { &FRONTS[..] };
            let vertices = CORNERS.repeat(2);
            let fronts_first =
                format!("{vertices}{}{}", faces("wall", &FRONTS, false, None), faces("back", behind, true, first));
            let scene = load(&format!("twice_{number}_{own_corners}"), "", &fronts_first, TWO_SIDED);
            assert_eq!(corners(&scene), corners(&single), "{first:?}");
            assert!(scene.mesh.material_of.iter().all(|&m| scene.materials[m as usize] == two_sided(wall, back)));
            assert_eq!(scene.warnings, Vec::<String>::new());
            assert_eq!(scene.parts[0].backs, 12);
        }
        let backs_first =
            format!("{CORNERS}{}{}", faces("back", &FRONTS, true, None), faces("wall", &FRONTS, false, first));
        let scene = load(&format!("twice_back_{number}"), "", &backs_first, TWO_SIDED);
        assert_eq!(corners(&scene), corners(&outwards), "{first:?}");
        assert!(scene.mesh.material_of.iter().all(|&m| scene.materials[m as usize] == two_sided(back, wall)));
    }
}

/// Polygons of more corners, from whichever corner their backs start, and one side in several materials.
#[test]
fn polygons_and_parts_of_them_find_their_backs() {
    let obj = "v 0 0 0\nv 4 0 0\nv 5 2 0\nv 4 4 0\nv 0 4 0\nv 2 0 0\nv 2 4 0\n";
    let mtl = "newmtl wall\nKd 0.5\nnewmtl back\nKd 0.1\nnewmtl tile\nKd 0.3\n";
    let names = |obj: &str, test: &str| {
        let scene = load(test, "", obj, mtl);
        let name = |&material: &u32| scene.materials[material as usize].name.clone();
        scene.mesh.material_of.iter().map(name).collect::<Vec<_>>()
    };
    for (start, back) in ["5 4 3 2 1", "4 3 2 1 5", "3 2 1 5 4", "2 1 5 4 3", "1 5 4 3 2"].iter().enumerate() {
        let pentagon = format!("{obj}usemtl wall\nf 1 2 3 4 5\nusemtl back\nf {back}\n");
        assert_eq!(names(&pentagon, &format!("pentagon_{start}")), ["wall / back"; 3]);
    }
    // Two quadrangles of the front, of two materials, and one pentagon's worth of back.
    let parts = format!("{obj}usemtl wall\nf 1 6 7 5\nusemtl tile\nf 6 2 3 4 7\nusemtl back\nf 7 4 3 2 6\nf 5 7 6 1\n");
    assert_eq!(
        names(&parts, "polygon_parts"),
        ["wall / back", "wall / back", "tile / back", "tile / back", "tile / back"]
    );
}

/// One square with what lies on it.
const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn what_is_repeated_the_same_way_round_is_left_out_and_counted() {
    let obj = format!("{SQUARE}usemtl wall\nf 1 2 3 4\nf 1 2 3 4\nusemtl back\nf 1 2 3\nf 4 3 2 1\nf 4 3 2 1\n");
    let scene = load("repeated", "", &obj, TWO_SIDED);
    let part = &scene.parts[0];
    assert_eq!((scene.mesh.triangles.len(), part.repeated, part.backs), (2, 5, 2));
    assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
    let said = "mesh.obj: 5 triangles that lie on others the same way round left out; the first in the file counts, such as \
                \"wall\" over \"back\"";
    assert!(scene.warnings[0].ends_with(said), "{:?}", scene.warnings);
}

/// One material on both sides needs no back: light meets it from either side; that of a single side has two now.
#[test]
fn the_same_material_on_both_sides_stays_itself() {
    let obj = format!("{SQUARE}usemtl wall\nf 1 2 3 4\nf 4 3 2 1\n");
    for section in ["", "[material.wall]\nreflectance = 0.5\nsides = \"one\"\n"] {
        let scene = load(&format!("same_{}", section.len()), section, &obj, TWO_SIDED);
        let material = &scene.materials[scene.mesh.material_of[0] as usize];
        assert_eq!((scene.mesh.triangles.len(), material.sides, &material.back), (2, Sides::Two, &None));
        assert_eq!(scene.warnings, Vec::<String>::new());
    }
}

/// A pane painted on one side only is a pane; glass drawn on both sides is one sheet; both are told.
#[test]
fn glass_with_something_on_its_back_is_told() {
    let mtl = "newmtl wall\nKd 0.5\nnewmtl pane\nd 0.3\nnewmtl solid\nNi 1.5\nd 0\nillum 9\nnewmtl water\nNi 1.33\nd 0\nillum 9\n";
    let of = |front: &str, back: &str| {
        let obj = format!("{SQUARE}usemtl {front}\nf 1 2 3 4\nusemtl {back}\nf 4 3 2 1\n");
        load(&format!("glass_{front}_{back}"), "", &obj, mtl)
    };
    for (front, back) in [("wall", "pane"), ("pane", "wall")] {
        let scene = of(front, back);
        let name = |&material: &u32| scene.materials[material as usize].name.as_str();
        assert_eq!(scene.mesh.material_of.iter().map(name).collect::<Vec<_>>(), ["pane", "pane"]);
        let said = format!(
            "mesh.obj: 2 triangles of \"{front}\" and \"{back}\" back to back: both sides taken for \"pane\", which light passes"
        );
        assert!(scene.warnings.len() == 1 && scene.warnings[0].ends_with(&said), "{:?}", scene.warnings);
    }
    for (front, back, triangles, warnings) in [("pane", "pane", 2, 0), ("solid", "solid", 2, 1)] {
        let scene = of(front, back);
        let found = (scene.mesh.triangles.len(), scene.warnings.len());
        assert_eq!(found, (triangles, warnings), "{front}, {back}: {:?}", scene.warnings);
    }
}

/// What shines keeps its front, whichever of the two stands first.
#[test]
fn a_face_that_shines_keeps_shining_to_its_front() {
    let mtl = "newmtl lamp\nKd 0\nKe 100\nnewmtl back\nKd 0.5\n";
    for (number, diagonal) in ["4 3 2 1", "3 2 1 4"].iter().enumerate() {
        let obj = format!("{SQUARE}usemtl back\nf {diagonal}\nusemtl lamp\nf 1 2 3 4\n");
        let scene = load(&format!("lamp_front_{number}"), "", &obj, mtl);
        let lamp = scene.luminaires.iter().find(|luminaire| luminaire.name == "lamp").expect("it shines");
        let Opening::Triangles(triangles) = &lamp.opening else { panic!("faces stay faces") };
        assert_eq!(*triangles, corners(&scene));
        assert!(triangles.iter().all(|[a, b, c]| (*b - *a).cross(*c - *a).z > 0.0));
        assert!((lamp.flux.0 / (std::f64::consts::PI * 100.0) - 1.0).abs() < 1e-6, "1 m² of 100 cd/m²: {}", lamp.flux);
        assert_eq!(scene.materials[scene.mesh.material_of[0] as usize].name, "lamp / back");
        assert_eq!(Inventory::of(&scene).materials[0].flux, Some(lamp.flux.0));
    }
}

/// A measured side is that of the material or group asked for, whether or not its faces are the ones that stay.
#[test]
fn the_side_measured_is_the_one_asked_for() {
    let mtl = "newmtl wall\nKd 0\nnewmtl back\nKd 0\n";
    let surfaces = "[[surface]]\nname = \"up\"\nmaterial = \"wall\"\n[[surface]]\nname = \"down\"\nmaterial = \"back\"\n\
                    [[surface]]\nname = \"down again\"\nmaterial = \"wall\"\nside = \"back\"\n\
                    [[surface]]\nname = \"group\"\ngroup = \"sheet\"\n";
    for (number, (one, other)) in
        [("wall\nf 1 2 3 4", "back\nf 3 2 1 4"), ("back\nf 4 3 2 1", "wall\nf 2 3 4 1")].iter().enumerate()
    {
        let obj = format!("{SQUARE}g sheet\nusemtl {one}\nusemtl {other}\n");
        let scene = load(&format!("measured_{number}"), surfaces, &obj, mtl);
        assert_eq!(scene.mesh.triangles.len(), 2);
        for (surface, up) in scene.surfaces.iter().zip([true, false, false, number == 0]) {
            assert!((surface.area() - 1.0).abs() < 1e-9, "{}: each place once", surface.name);
            assert!(surface.samples.iter().all(|sample| (sample.normal().z > 0.0) == up), "{} {number}", surface.name);
            let down = glam::DVec3::new(0.1, 0.2, -1.0);
            let normal = |[a, b, c]: [glam::DVec3; 3]| (b - a).cross(c - a);
            for triangle in 0..2 {
                let meets = surface.faces(triangle, normal(scene.mesh.corners(triangle as usize)), down);
                assert_eq!(meets, up, "{} {number}", surface.name);
            }
        }
    }
}

/// The plan says of each material what it became and why, the largest first, and of each mesh what looks wrong.
#[test]
fn the_plan_lists_materials_and_what_is_wrong_with_meshes() {
    let folder = Folder::new("mtl_foreign", "plan");
    let mtl = "newmtl wall\nKd 0.5\nnewmtl back\nKd 0.1\nnewmtl pane\nKd 1\nd 0.3\nnewmtl lamp\nKd 0\nKe 100\n";
    folder.write("room.mtl", mtl);
    // A room of 4 × 4 × 3 m, twice, without its floor; a pane of 1 m² and a lamp of 4 m² in it.
    let mut obj =
        format!("mtllib room.mtl\n{CORNERS}v 1 1 1\nv 2 1 1\nv 2 2 1\nv 1 2 1\nv 1 1 2\nv 3 1 2\nv 3 3 2\nv 1 3 2\n");
    obj += &faces("wall", &FRONTS[1..], false, None);
    obj += &faces("back", &FRONTS[1..], true, None);
    obj += "usemtl pane\nf 9 10 11 12\nusemtl lamp\nf 16 15 14 13\n";
    folder.write("room.obj", &obj);
    folder.write("scene.toml", &format!("[[mesh]]\nfile = \"room.obj\"\n{LAMP}{SENSOR}"));
    let output = folder.luxmap(&["plan", "scene.toml"]);
    assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), ""));
    // The pane mirrors r (1 + 0.7 a) = 0.061: r = 0.04, and its glass passes a = 0.759, as 0.7 = (1 − r)² a/(1 − r² a²).
    let plan = stdout(&output);
    let table: Vec<&str> = plan.lines().skip_while(|line| !line.starts_with("material ")).collect();
    let expected = [
        "material     area, m²  triangles  what it is                    from  remarks",
        "wall / back        64         10  ρ 0.5, back: ρ 0.1            MTL",
        "lamp                4          2  ρ 0, shines 1257 lm           MTL",
        "pane                1          2  glazing τ 0.7, mirrors 0.061  MTL   a clear sheet: 1 - d passes; Kd left out",
        "",
        "mesh room.obj: 4 × 4 × 3 m, 14 triangles, 12 open edges, 10 backs of other triangles",
    ];
    assert_eq!(table, expected, "{plan}");
}

/// Open edges, bodies and their sense, slivers: of a cube, one inside out, one with a hole, and a needle.
#[test]
fn meshes_are_looked_through() {
    let cube = |at: usize, faces: &[&str], reversed: bool| {
        let vertices: String = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
            .map(|[x, y, z]| format!("v {} {y} {z}\n", x + 2 * at))
            .concat();
        let face = |face: &&str| {
            let mut corners: Vec<usize> = face.split(' ').map(|i| i.parse::<usize>().unwrap() + 8 * at).collect();
            if reversed {
                corners.reverse();
            }
            format!("f {} {} {} {}\n", corners[0], corners[1], corners[2], corners[3])
        };
        vertices + &faces.iter().map(face).collect::<String>()
    };
    // FRONTS look inwards.
    let obj = format!(
        "usemtl wall\n{}{}{}v 0 0 9\nv 1 0 9\nv 1 0.0001 9\nf 25 26 27\n",
        cube(0, &FRONTS, true),
        cube(1, &FRONTS, false),
        cube(2, &FRONTS[1..], true)
    );
    // Bodies of glass are turned.
    for (section, inwards) in [("", 1), ("[material.wall]\ndielectric = { ior = 1.5 }\n", 0)] {
        let scene = load(&format!("looked_through_{inwards}"), section, &obj, TWO_SIDED);
        let check = &Inventory::of(&scene).meshes[0];
        assert_eq!((check.bodies, check.inwards), (2, inwards));
        // Four of the hole and three of the needle.
        assert_eq!((check.open_edges, check.shared_edges, check.slivers), (7, 0, 1));
    }
}

/// A room that is 2700 "m" high was drawn in millimetres, which every run says; and the sources of materials are told apart.
#[test]
fn a_room_in_millimetres_is_asked_about() {
    let obj = "v 0 0 0\nv 4000 0 0\nv 4000 5000 2700\nv 0 5000 2700\nusemtl wall\nf 1 2 3\nusemtl back\nf 1 3 4\n";
    let section = "[material.back]\nreflectance = 0.2\n";
    let scene = load("millimetres", section, obj, TWO_SIDED);
    let said =
        "mesh.obj is 4000 × 5000 m and 2700 m high: is it in mm? unit = \"mm\" in its [[mesh]] makes it 2.70 m high";
    let asked = scene.warnings.iter().filter(|warning| warning.ends_with(said)).count();
    assert_eq!(asked, 1, "{:?}", scene.warnings);
    let sources: Vec<_> =
        scene.materials.iter().zip(&scene.origins).map(|(m, o)| (m.name.as_str(), o.source)).collect();
    assert_eq!(sources, [("wall", MaterialSource::Mtl), ("back", MaterialSource::Scene)]);
}
