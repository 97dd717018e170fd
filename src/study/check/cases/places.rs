//! Points on edges, in corners, inside of things, outside; one point, and very many.

use std::f64::consts::PI;

use crate::render::plan::Method::{Gather, Path, Photons, Split};
use crate::study::check::cases::FLUX;
use crate::study::check::cases::rooms::glowing;
use crate::study::check::forms::{glowing_room, point_source};
use crate::study::check::scenes::{diffuse, plane, point_lamp, polygon, room, sensor, solid};
use crate::study::check::{Case, Measurand, SceneText};

pub(super) const PLACES: &str = "places";

const RHO: f64 = 0.5;

/// Points of the glowing room of 6 × 4 × 2.7 m where surfaces meet, and the way each looks.
const MEETING: [(&str, [f64; 3], [f64; 3]); 8] = [
    ("floor at a wall", [0.0, 2.0, 0.0], [0.0, 0.0, 1.0]),
    ("floor in a corner", [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
    ("floor in the far corner", [6.0, 4.0, 0.0], [0.0, 0.0, 1.0]),
    ("wall at the floor", [0.0, 2.0, 0.0], [1.0, 0.0, 0.0]),
    ("wall in a corner", [6.0, 4.0, 1.0], [-1.0, 0.0, 0.0]),
    ("ceiling in a corner", [6.0, 0.0, 2.7], [0.0, 0.0, -1.0]),
    ("level at a wall", [6.0, 2.0, 1.0], [0.0, 0.0, 1.0]),
    ("level in a corner", [0.0, 4.0, 1.0], [0.0, 0.0, 1.0]),
];

fn edges() -> Vec<Case> {
    let exact = glowing_room(100.0, RHO);
    let mut cases = Vec::new();
    for method in [Gather, Split, Path, Photons] {
        let sensors: String = MEETING.iter().map(|(name, at, normal)| sensor(name, *at, *normal)).collect();
        let name = format!("edges and corners, {}", method.name());
        let case = Case::new(PLACES, name, "half of what a point sees lies in its own plane", glowing(RHO, sensors));
        let case = case.method(method).photons(if method == Gather { 100_000 } else { 300_000 });
        let case = MEETING.iter().fold(case, |case, (name, ..)| case.expects(Measurand::Sensor(name), exact, 0.0));
        cases.push(case.useful(if method == Photons { 0.5 } else { 0.2 }).closed().quick());
        let aslant = glowing(RHO, sensor("meter", [0.0; 3], [0.6, 0.48, 0.64]));
        let name = format!("aslant in a corner, {}", method.name());
        let case = Case::new(PLACES, name, "its plane meets the room in one point: no photon crosses it", aslant);
        let case = case.method(method).photons(100_000).expects(Measurand::Sensor("meter"), exact, 0.0);
        cases.push(case.useful(0.2).closed().excused("no photon").quick());
    }
    // Cells of 0.5 m whose middles lie on walls, and in corners.
    let on_walls = plane("plane", [-0.25, -0.25, 1.0], [6.5, 0.0, 0.0], [0.0, 4.5, 0.0], [13, 9], "air");
    let scene =
        glowing(RHO, on_walls.clone() + &on_walls.replace("plane\"", "floor\"").replace("1.0]\nalong", "0.0]\nalong"));
    let case = Case::new(PLACES, "cells whose middles lie on walls", "on which side are they?", scene).photons(100_000);
    let case = case.expects(Measurand::Worst("plane"), exact, 0.0).expects(Measurand::Worst("floor"), exact, 0.0);
    cases.push(case.expects(Measurand::Valued("plane"), 1.0, 0.0).useful(0.2).closed().quick());
    // A sheet through the middles of a column of cells parts two cubes that mirror each other: as at the wall of one
    // alone.
    let row = plane("row", [3.9, 0.0, 0.0], [0.2, 0.0, 0.0], [0.0, 4.0, 0.0], [1, 16], "surface");
    let lamps = [2.0, 6.0].map(|x| point_lamp(&format!("lamp {x}"), [x, 2.0, 2.0], FLUX));
    let alone = SceneText {
        toml: [&diffuse("wall", 0.5), &lamps[0], &row].map(String::as_str).concat(),
        obj: room([0.0; 3], [4.0; 3], ["wall"; 6]),
        mtl: String::new(),
    };
    let sheet = polygon("wall", &[[4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [4.0, 4.0, 4.0], [4.0, 0.0, 4.0]]);
    let two = SceneText {
        toml: alone.toml.clone() + &lamps[1],
        obj: room([0.0; 3], [8.0, 4.0, 4.0], ["wall"; 6]) + &sheet,
        mtl: String::new(),
    };
    for method in [Gather, Split] {
        let name = format!("a sheet through a row of cells, {}", method.name());
        let case = Case::new(PLACES, name, "the light of both its sides would be twice as much", two.clone());
        let case = case.method(method).photons(200_000).expects(Measurand::Valued("row"), 1.0, 0.0);
        let twin = case.expects_as(Measurand::Mean("row"), alone.clone(), 1.0, 0.0);
        cases.push(twin.useful(0.2).within(0.1).closed().quick());
    }
    cases
}

fn insides() -> Vec<Case> {
    let exact = glowing_room(100.0, RHO);
    let mut cases = Vec::new();
    let half = glowing(RHO, plane("plane", [-3.0, 0.0, 1.0], [6.0, 0.0, 0.0], [0.0, 4.0, 0.0], [12, 8], "air"));
    for method in [Gather, Photons] {
        let name = format!("a plane half outside, {}", method.name());
        let case =
            Case::new(PLACES, name, "outside a closed room is no light, and no place", half.clone()).method(method);
        let case = case.photons(200_000).expects(Measurand::Valued("plane"), 0.5, 0.0);
        cases.push(case.expects(Measurand::Worst("plane"), exact, 0.0).useful(0.5).closed().quick());
    }
    let inside = sensor("inside", [3.0, 2.0, 0.4], [0.0, 0.0, 1.0])
        + &sensor("on top", [3.0, 2.0, 0.8], [0.0, 0.0, 1.0])
        + &sensor("below its top", [3.0, 2.0, 0.8], [0.0, 0.0, -1.0])
        + &plane("floor", [0.0; 3], [6.0, 0.0, 0.0], [0.0, 4.0, 0.0], [12, 8], "surface");
    let mut solid_in = glowing(RHO, inside);
    solid_in.obj += &solid([2.5, 1.5, 0.1], [3.5, 2.5, 0.8], "glow");
    let case =
        Case::new(PLACES, "inside of a solid", "its inside shines too, but nothing gets in", solid_in).photons(100_000);
    let case = case.expects_none(Measurand::Sensor("inside")).expects(Measurand::Sensor("on top"), exact, 0.0);
    let case = case.expects_none(Measurand::Sensor("below its top")).expects(Measurand::Valued("floor"), 1.0, 0.0);
    cases.push(case.expects(Measurand::Worst("floor"), exact, 0.0).useful(0.2).closed().quick());
    let one = glowing(RHO, plane("plane", [1.0, 1.0, 1.0], [1e-3, 0.0, 0.0], [0.0, 1e-3, 0.0], [1, 1], "air"));
    for method in [Gather, Split, Photons] {
        let name = format!("one cell of 1 mm, {}", method.name());
        let case = Case::new(PLACES, name, "no neighbour helps", one.clone()).method(method).photons(200_000);
        cases.push(case.expects(Measurand::Mean("plane"), exact, 0.0).useful(0.5).closed().quick());
    }
    cases
}

/// Mean E (lx) on a rectangle of half sides a, b (m) at distance h (m) from a source over its middle: I Ω/(4ab), Ω its
/// solid angle 4 asin(ab/√((a² + h²)(b² + h²))).
fn mean_below(flux: f64, [a, b]: [f64; 2], h: f64) -> f64 {
    let solid_angle = 4.0 * (a * b / (a.hypot(h) * b.hypot(h))).asin();
    flux / (4.0 * PI) * solid_angle / (4.0 * a * b)
}

fn many() -> Vec<Case> {
    let planes = [("1 m below", 1.0), ("2 m below", 2.0), ("3 m below", 3.0), ("4 m below", 4.0)];
    let of = |cells: usize| {
        let plane_at = |(name, depth): &(&str, f64)| {
            plane(name, [-2.0, -2.0, -depth], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [cells, cells], "air")
        };
        let toml = point_lamp("lamp", [0.0; 3], FLUX) + &planes.iter().map(plane_at).collect::<String>();
        SceneText { toml, ..SceneText::default() }
    };
    let case = |name: &str, why, cells| {
        let case = Case::new(PLACES, name, why, of(cells));
        planes.iter().fold(case, |case, (name, depth)| {
            case.expects(Measurand::Mean(name), mean_below(FLUX, [2.0; 2], *depth), 1e-4)
        })
    };
    let beside = SceneText {
        toml: diffuse("wall", 0.5)
            + &point_lamp("lamp", [2.0, 2.0, 3.0], FLUX)
            + &plane("too many", [0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [20_000, 20_000], "air"),
        obj: room([0.0; 3], [4.0; 3], ["wall"; 6]),
        mtl: String::new(),
    };
    vec![
        case("160 thousand points", "the mean of a map is flux by solid angle", 200).quick(),
        case("100 million points", "four maps of 25 million, in bands of 4 million; 2.5 GB of results", 5000),
        Case::new(PLACES, "400 million points in one map", "its result alone would take 10 to 20 GB", beside)
            .refused("268435456 cells")
            .quick(),
        Case::new(
            PLACES,
            "a meter 40 km away",
            "a point seen from afar",
            SceneText {
                toml: point_lamp("lamp", [0.0; 3], FLUX) + &sensor("meter", [4e4, 0.0, 0.0], [-1.0, 0.0, 0.0]),
                ..SceneText::default()
            },
        )
        .expects(Measurand::Sensor("meter"), point_source(FLUX, 4e4, 1.0), 1e-5)
        .quick(),
    ]
}

pub(super) fn cases() -> Vec<Case> {
    [edges(), insides(), many()].concat()
}
