//! Thin walls, and meshes as they come.

use crate::render::plan::Method::{Gather, Path, Photons, Split};
use crate::study::check::cases::{CUBE, FLUX, cube};
use crate::study::check::forms::{closed_room, closed_room_noise};
use crate::study::check::scenes::{diffuse, floor, plane, point_lamp, polygon, room, solid};
use crate::study::check::{Case, Measurand, SceneText};

pub(super) const WALLS: &str = "thin walls";
pub(super) const MESHES: &str = "meshes";

const SIDE: [f64; 3] = [4.0; 3];

/// Two closed cubes side by side with one wall between them, `thick` (m): a lamp of 10⁶ lm in the one, of 1 lm in the
/// other.
fn two_rooms(thick: f64, dark_flux: f64) -> SceneText {
    let far = [4.0 + thick, 0.0, 0.0];
    let end = [8.0 + thick, 4.0, 4.0];
    // One room of two cubes' length with a wall in it: a sheet, or a slab.
    let wall = if thick > 0.0 {
        solid([4.0, 0.0, 0.0], [4.0 + thick, 4.0, 4.0], "wall")
    } else {
        polygon("wall", &[[4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [4.0, 4.0, 4.0], [4.0, 0.0, 4.0]])
    };
    let lamps = point_lamp("bright", [2.0; 3], 1e6)
        + &if dark_flux > 0.0 { point_lamp("dim", [6.0 + thick, 2.0, 2.0], dark_flux) } else { String::new() };
    let floors = plane("bright side", [0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [16, 16], "surface")
        + &plane("dark side", far, [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [16, 16], "surface");
    SceneText {
        toml: [diffuse("wall", 0.5), lamps, floors].concat(),
        obj: room([0.0; 3], end, ["wall"; 6]) + &wall,
        mtl: String::new(),
    }
}

/// A cube whose floor is something else: OBJ text.
fn with_floor(new: &str, rho: f64) -> SceneText {
    let whole = room([0.0; 3], SIDE, ["wall"; 6]);
    let obj =
        whole.lines().filter(|line| *line != "f 1 2 4 3").map(|line| format!("{line}\n")).collect::<String>() + new;
    around(obj, rho)
}

/// The lamp and the meters of a cube from the origin to 4 m.
fn around(obj: String, rho: f64) -> SceneText {
    let toml = [diffuse("wall", rho), point_lamp("lamp", [2.0; 3], FLUX), floor([0.0; 3], SIDE, 16)].concat();
    SceneText { toml, obj, mtl: String::new() }
}

/// A floor in strips between the given places along x.
fn strips(edges: &[f64], (from, to): (f64, f64)) -> String {
    let strip = |pair: &[f64]| {
        polygon("wall", &[[pair[0], from, 0.0], [pair[1], from, 0.0], [pair[1], to, 0.0], [pair[0], to, 0.0]])
    };
    edges.windows(2).map(strip).collect()
}

fn walls() -> Vec<Case> {
    let mut cases = Vec::new();
    for (thick, name) in [(1e-3, "1 mm"), (1e-4, "0.1 mm"), (0.0, "a sheet")] {
        for method in [Gather, Split, Photons, Path] {
            let why = "a million times as much light behind the wall";
            let mut case = Case::new(WALLS, format!("{name}, {}", method.name()), why, two_rooms(thick, 1.0))
                .method(method)
                .photons(100_000)
                .expects(Measurand::Mean("bright side"), closed_room(1e6, 0.5, CUBE), 2e-3)
                .expects(Measurand::Mean("dark side"), closed_room(1.0, 0.5, CUBE), 2e-3)
                .useful(if method == Gather { 0.05 } else { 0.25 })
                // The dim lamp gets a twentieth of the photons.
                .within(4.0 * closed_room_noise(0.5, 5e3) + 5e-3)
                .closed();
            if method == Path {
                case = case.rays(64).within(0.1);
            }
            cases.push(if method == Gather { case.quick() } else { case });
        }
        let case = Case::new(WALLS, format!("{name}, no light behind"), "what is dark is dark", two_rooms(thick, 0.0));
        let case = case.photons(100_000).expects_none(Measurand::Mean("dark side"));
        cases.push(case.expects(Measurand::Mean("bright side"), closed_room(1e6, 0.5, CUBE), 2e-3).closed().quick());
    }
    cases
}

fn meshes() -> Vec<Case> {
    let fan = |count: usize| {
        let edge = |i: usize| 4.0 * i as f64 / count as f64;
        let triangle = |i: usize| polygon("wall", &[[0.0; 3], [4.0, edge(i), 0.0], [4.0, edge(i + 1), 0.0]]);
        let other = |i: usize| polygon("wall", &[[0.0; 3], [edge(i + 1), 4.0, 0.0], [edge(i), 4.0, 0.0]]);
        (0..count).map(triangle).chain((0..count).map(other)).collect::<String>()
    };
    let thirds = [0.0, 4.0 / 3.0, 8.0 / 3.0, 4.0];
    let sevenths: Vec<f64> = (0..=7).map(|i| 4.0 * f64::from(i) / 7.0).collect();
    let whole = room([0.0; 3], SIDE, ["wall"; 6]);
    let faces = |keep: fn(usize) -> bool, turn: bool| -> String {
        let turned = |line: &str| {
            let corners: Vec<&str> = line[2..].split(' ').rev().collect();
            format!("f {}\n", corners.join(" "))
        };
        let faces = whole.lines().filter(|line| line.starts_with("f ")).enumerate().filter(|(i, _)| keep(*i));
        faces.map(|(_, line)| if turn { turned(line) } else { format!("{line}\n") }).collect()
    };
    let head: String = whole.lines().filter(|line| line.starts_with('v')).map(|line| format!("{line}\n")).collect();
    let flipped = |turned: fn(usize) -> bool, rest: fn(usize) -> bool| {
        format!("{head}usemtl wall\n{}{}", faces(turned, true), faces(rest, false))
    };
    let odd = |i: usize| i % 2 == 1;
    let even = |i: usize| i.is_multiple_of(2);
    let tables = [
        ("needles, 1 : 1000", "2000 triangles of 4 m × 4 mm that meet in one corner", with_floor(&fan(1000), 0.8)),
        (
            "needles, 1 : 10⁶",
            "a strip of 4 µm in the floor",
            with_floor(&strips(&[0.0, 2.0, 2.0 + 4e-6, 4.0], (0.0, 4.0)), 0.8),
        ),
        (
            "T-junctions",
            "thirds against sevenths along a seam",
            with_floor(&(strips(&thirds, (0.0, 2.0)) + &strips(&sevenths, (2.0, 4.0))), 0.8),
        ),
        ("faces twice", "every wall of two coincident polygons", around(whole.clone() + &faces(|_| true, false), 0.8)),
        ("faces twice, back to back", "coincident and turned", around(whole.clone() + &faces(|_| true, true), 0.8)),
        ("faces turned", "all normals outward", around(flipped(|_| true, |_| false), 0.8)),
        ("every other face turned", "normals as they come", around(flipped(odd, even), 0.8)),
        (
            "degenerate triangles",
            "of no area, and with a corner twice: nothing to hit",
            around(whole.clone() + "v 1 1 1\nv 2 2 2\nv 3 3 3\nf 9 10 11\nf 9 9 10\n", 0.8),
        ),
    ];
    let mut cases: Vec<Case> = tables
        .into_iter()
        .flat_map(|(name, why, scene)| {
            let exact = closed_room(FLUX, 0.8, CUBE);
            let of = |method, name: String| {
                let case = Case::new(MESHES, name, why, scene.clone()).method(method).photons(100_000);
                let case = case.expects(Measurand::Mean("floor"), exact, 2e-3).useful(0.2);
                case.within(4.0 * closed_room_noise(0.8, 1e5) + 5e-3).closed()
            };
            [of(Gather, name.into()).quick(), of(Split, format!("{name}, split"))]
        })
        .collect();
    // The cracks are 10 µm wide along the floor's four edges: of the light, their part of the surface gets out, at
    // every bounce.
    let crack = 1e-5;
    let inner = strips(&[crack, 4.0 - crack], (crack, 4.0 - crack));
    let lost = 4.0 * 4.0 * crack / (0.2 * CUBE);
    cases.push(
        Case::new(MESHES, "cracks of 10 µm", "a floor that doesn't reach the walls", with_floor(&inner, 0.8))
            .photons(1_000_000)
            .expects(Measurand::Mean("floor"), closed_room(FLUX, 0.8, CUBE), 2e-3)
            // Of a million photons, 8.3 ± 2.9 get out.
            .expects(Measurand::Escaped, lost, 4.0 / (lost * 1e6).sqrt()),
    );
    let mut bad = cube(0.8, 1.0, [0.0; 3], 4);
    bad.obj += "v nan 0 0\nf 1 2 9\n";
    cases.push(Case::new(MESHES, "a vertex that is no number", "found while loading", bad).refused("expected").quick());
    let mut bad = cube(0.8, 1.0, [0.0; 3], 4);
    bad.obj += "f 1 2 99\n";
    cases.push(Case::new(MESHES, "a face without a corner", "found while loading", bad).refused("expected").quick());
    cases
}

pub(super) fn cases() -> Vec<Case> {
    [walls(), meshes()].concat()
}
