//! No place without a value that light can reach, by however narrow a way; no value where no light can be; and the reason told.

use crate::common::room;
use crate::common::run;
use crate::common::scene;
use crate::common::sensor;
use luxmap::gather::reach::Standing;
use luxmap::render::plan::Method;
use luxmap::report::{json, table};
use luxmap::results::{Results, without};
use luxmap::study::check::scenes::another_room;
use luxmap::study::check::scenes::polygon;
use luxmap::study::check::scenes::solid;

const MATERIALS: [(&str, &str); 4] = [
    ("wall", "reflectance = 0.6"),
    ("ceiling", "reflectance = 0.7"),
    ("opal", "reflectance = 0.3\ntransmittance = 0.6"),
    ("glass", "dielectric = { ior = 1.5 }"),
];

fn lamp(at: [f64; 3], up: f64, side: f64) -> String {
    format!(
        "[[luminaire]]\nname = \"lamp\"\nposition = {at:?}\nflux = 1000\naim = [0, 0, {up}]\n\
         opening = {{ rectangle = [{side}, {side}] }}\n"
    )
}

fn plane(name: &str, [x, y, z]: [f64; 3], [along, across]: [f64; 2], cells: [usize; 2]) -> String {
    format!(
        "[[plane]]\nname = \"{name}\"\ncorner = [{x}, {y}, {z}]\nalong = [{along}, 0, 0]\nacross = [0, {across}, 0]\n\
         cells = {cells:?}\non = \"air\"\n"
    )
}

fn look(name: &str, parts: &[String], obj: &str) -> Results {
    let used = MATERIALS.iter().filter(|(material, _)| obj.contains(&format!("usemtl {material}\n")));
    let materials: String = used.map(|(material, is)| format!("[material.{material}]\n{is}\n")).collect();
    run(&scene(&format!("reachable_{name}"), &(materials + &parts.concat()), obj), Method::Split, 2000, 0)
}

fn all_are_places(results: &Results) {
    for map in &results.maps {
        assert_eq!(without::counts(&map.standing), [0; 3], "{}", map.name);
        assert!(map.has_value.iter().all(|has_value| *has_value), "{}", map.name);
    }
    assert!(without::lines(results).is_empty());
}

/// A rectangle across x.
fn sheet(x: f64, [y, z]: [[f64; 2]; 2]) -> String {
    polygon("wall", &[[x, y[0], z[0]], [x, y[1], z[0]], [x, y[1], z[1]], [x, y[0], z[1]]])
}

/// A wall of 2 m × 2 m across x that has a square hole in its middle.
fn wall_with_hole(x: f64, half: f64) -> String {
    let (low, high) = (1.0 - half, 1.0 + half);
    let rest =
        [[[0.0, low], [0.0, 2.0]], [[high, 2.0], [0.0, 2.0]], [[low, high], [0.0, low]], [[low, high], [high, 2.0]]];
    rest.map(|part| sheet(x, part)).concat()
}

/// The five other sides of a room of 2 m × 2 m × 2 m.
fn sides_of_room(x: [f64; 2], closed_at: f64) -> String {
    let [a, b] = x;
    let across = |y: f64| polygon("wall", &[[a, y, 0.0], [b, y, 0.0], [b, y, 2.0], [a, y, 2.0]]);
    let level = |z: f64| polygon("wall", &[[a, 0.0, z], [b, 0.0, z], [b, 2.0, z], [a, 2.0, z]]);
    across(0.0) + &across(2.0) + &level(0.0) + &level(2.0) + &sheet(closed_at, [[0.0, 2.0]; 2])
}

#[test]
fn light_comes_through_a_slit_of_a_millimetre() {
    let obj = room([0.0; 3], [8.0, 4.0, 3.0], ["wall"; 6])
        + &sheet(4.0, [[0.0, 1.9995], [0.0, 3.0]])
        + &sheet(4.0, [[2.0005, 4.0], [0.0, 3.0]]);
    let toml = [lamp([1.0, 1.0, 2.98], -1.0, 0.6), plane("far", [4.0, 0.0, 0.5], [4.0, 4.0], [20, 20])];
    all_are_places(&look("slit", &toml, &obj));
}

#[test]
fn light_comes_out_of_a_white_box_by_a_pinhole() {
    // The box has a hole of 2 mm in one side; its lamp looks away from it.
    let [low, high] = [[1.0, 1.0, 1.0], [2.0, 2.0, 2.0]];
    let side = |x: f64| sheet(x, [[1.0, 2.0], [1.0, 2.0]]);
    let hole = [[1.499, 1.501], [1.0, 1.499]];
    let rest = [[[1.0, 1.499], [1.0, 2.0]], [[1.501, 2.0], [1.0, 2.0]], hole, [[1.499, 1.501], [1.501, 2.0]]];
    let across = |y: f64| polygon("wall", &[[1.0, y, 1.0], [2.0, y, 1.0], [2.0, y, 2.0], [1.0, y, 2.0]]);
    let level = |z: f64| polygon("wall", &[[1.0, 1.0, z], [2.0, 1.0, z], [2.0, 2.0, z], [1.0, 2.0, z]]);
    let obj = room([0.0; 3], [4.0, 4.0, 3.0], ["wall"; 6])
        + &side(low[0])
        + &rest.map(|part| sheet(high[0], part)).concat()
        + &across(1.0)
        + &across(2.0)
        + &level(1.0)
        + &level(2.0);
    let toml = [lamp([1.2, 1.5, 1.5], 1.0, 0.1), plane("room", [0.0, 0.0, 0.5], [4.0, 4.0], [20, 20])];
    all_are_places(&look("pinhole", &toml, &obj));
}

#[test]
fn light_comes_through_a_long_narrow_pipe() {
    let (half, [near, far]) = (0.005, [2.0, 3.0]);
    let (low, high) = (1.0 - half, 1.0 + half);
    let across = |y: f64| polygon("wall", &[[near, y, low], [far, y, low], [far, y, high], [near, y, high]]);
    let level = |z: f64| polygon("wall", &[[near, low, z], [far, low, z], [far, high, z], [near, high, z]]);
    let pipe = across(low) + &across(high) + &level(low) + &level(high);
    let obj = sides_of_room([0.0, near], 0.0)
        + &wall_with_hole(near, half)
        + &pipe
        + &wall_with_hole(far, half)
        + &sides_of_room([far, 5.0], 5.0);
    let toml = [lamp([0.5, 0.5, 1.9], -1.0, 0.2), plane("far", [3.0, 0.0, 0.5], [2.0, 2.0], [10, 10])];
    all_are_places(&look("pipe", &toml, &obj));
}

#[test]
fn light_finds_its_way_through_six_rooms_with_doors_ajar() {
    let mut obj = room([0.0; 3], [12.0, 2.0, 2.5], ["wall"; 6]);
    for door in 1..6 {
        let y = if door % 2 == 0 { [0.01, 2.0] } else { [0.0, 1.99] };
        obj += &sheet(2.0 * f64::from(door), [y, [0.0, 2.5]]);
    }
    let toml = [lamp([0.4, 1.0, 2.4], -1.0, 0.2), plane("all", [0.0, 0.0, 0.5], [12.0, 2.0], [60, 10])];
    all_are_places(&look("maze", &toml, &obj));
}

#[test]
fn light_passes_opal_in_opal_and_glass_in_opal() {
    let room = room([0.0; 3], [4.0, 4.0, 3.0], ["wall"; 6]);
    let opal = room.clone()
        + &solid([1.0, 1.0, 2.0], [2.0, 2.0, 2.9], "opal")
        + &solid([1.4, 1.4, 2.4], [1.6, 1.6, 2.6], "opal");
    let toml = [lamp([1.5, 1.5, 2.5], 1.0, 0.05), plane("floor", [0.0; 3], [4.0, 4.0], [20, 20])];
    all_are_places(&look("opal", &toml, &opal));
    let bulb = room
        + &solid([1.0, 1.0, 2.0], [2.0, 2.0, 2.9], "opal")
        + &solid([1.4, 1.4, 2.4], [1.6, 1.6, 2.6], "glass")
        + &another_room([1.42, 1.42, 2.42], [1.58, 1.58, 2.58], ["glass"; 6]);
    all_are_places(&look("bulb", &toml, &bulb));
}

/// A closed cupboard, a closed leg and a tube that stands on the floor: nothing in them has a value, and all around them has.
#[test]
fn what_is_shut_off_has_no_value_and_is_told() {
    let tube = {
        let across = |y: f64| polygon("wall", &[[3.0, y, 0.0], [3.4, y, 0.0], [3.4, y, 1.0], [3.0, y, 1.0]]);
        let lid = polygon("wall", &[[3.0, 3.0, 1.0], [3.4, 3.0, 1.0], [3.4, 3.4, 1.0], [3.0, 3.4, 1.0]]);
        across(3.0)
            + &across(3.4)
            + &sheet(3.0, [[3.0, 3.4], [0.0, 1.0]])
            + &sheet(3.4, [[3.0, 3.4], [0.0, 1.0]])
            + &lid
    };
    let obj = room([0.0; 3], [4.0, 4.0, 3.0], ["wall"; 6])
        + &solid([0.0, 0.0, 0.0], [1.0, 0.6, 2.0], "wall")
        + &solid([2.0, 2.0, 0.0], [2.1, 2.1, 0.7], "wall")
        + &tube;
    let toml = [
        lamp([2.0, 2.0, 2.98], -1.0, 0.6),
        plane("low", [0.0, 0.0, 0.5], [4.0, 4.0], [40, 40]),
        sensor("in the cupboard", [0.5, 0.3, 1.0], [0.0, 0.0, 1.0]),
        sensor("beside it", [0.5, 0.8, 1.0], [0.0, 0.0, 1.0]),
    ];
    let results = look("shut_off", &toml, &obj);
    let map = &results.maps[0];
    // Cells of 0.1 m: 10 × 6 in the cupboard, one in the leg, 4 × 4 in the tube.
    assert_eq!(without::counts(&map.standing), [61, 0, 16]);
    for cell in 0..map.standing.len() {
        let at = map.point(cell);
        let inside =
            |low: [f64; 2], high: [f64; 2]| (low[0]..high[0]).contains(&at.x) && (low[1]..high[1]).contains(&at.y);
        let expected = if inside([0.0; 2], [1.0, 0.6]) || inside([2.0; 2], [2.1; 2]) {
            Standing::Inside
        } else if inside([3.0; 2], [3.4; 2]) {
            Standing::Dark
        } else {
            Standing::Place
        };
        assert_eq!((map.standing[cell], map.has_value[cell]), (expected, expected.is_place()), "{at}");
    }
    let reading = results.sensor("in the cupboard").expect("a sensor");
    assert_eq!((reading.has_value, reading.standing), (false, Standing::Inside));
    assert!(results.sensor("beside it").expect("a sensor").has_value);
    let told = table::table(&results);
    assert!(told.contains("cells: 61 shut off by a closed body, 16 no way for light found"), "{told}");
    assert!(told.contains("sensor \"in the cupboard\": shut off by a closed body"), "{told}");
    let summary: serde_json::Value = serde_json::from_str(&json::summary(&results)).expect("JSON");
    let plane = &summary["planes"][0]["without_value"];
    assert_eq!((&plane["shut_off"], &plane["covered"], &plane["no_way_found"]), (&61.into(), &0.into(), &16.into()));
    assert_eq!(summary["sensors"][0]["no_value_because"], "shut off by a closed body");
}

/// Cells beyond the walls of a closed room have no value, also those a millimetre behind a wall; nor have those within a wall.
#[test]
fn a_plane_wider_than_the_room_has_values_in_the_room_alone() {
    let inner = room([0.0; 3], [2.0, 2.0, 2.0], ["wall"; 6]);
    let thin = inner.clone() + &solid([-0.002; 3], [2.002; 3], "wall");
    for (name, obj) in [("wide", inner), ("thin", thin)] {
        // Cells of 2 mm along x: their middles lie 1 mm beside the walls on either side.
        let toml = [
            lamp([1.0, 1.0, 1.98], -1.0, 0.3),
            plane("left", [-0.01, 0.3, 0.5], [0.02, 1.4], [10, 7]),
            plane("wide", [-1.0, -1.0, 0.5], [4.0, 4.0], [40, 40]),
        ];
        let results = look(name, &toml, &obj);
        for map in &results.maps {
            for cell in 0..map.standing.len() {
                let at = map.point(cell);
                let in_room = (0.0..2.0).contains(&at.x) && (0.0..2.0).contains(&at.y);
                let expected = if in_room { Standing::Place } else { Standing::Inside };
                assert_eq!(map.standing[cell], expected, "{name}, {}: {at}", map.name);
            }
        }
    }
}

/// Samples of a ceiling that panels cover, flush with it or 4 mm below, are no places of it: its darkest sample is one that light
/// reaches.
#[test]
fn a_ceiling_above_panels_counts_without_them() {
    let obj = room([0.0; 3], [4.0, 4.0, 3.0], ["wall", "ceiling", "wall", "wall", "wall", "wall"]);
    for height in [3.0, 2.996] {
        let toml = [
            lamp([1.3, 2.0, height], -1.0, 0.6),
            lamp([2.7, 2.0, height], -1.0, 0.6).replace("lamp", "other"),
            "[[surface]]\nname = \"above\"\nmaterial = \"ceiling\"\nspacing = 0.1\n".to_owned(),
            plane("floor", [0.0; 3], [4.0, 4.0], [8, 8]),
        ];
        let results = look(&format!("panels_{height}"), &toml, &obj);
        let ceiling = &results.surfaces[0];
        for sample in 0..ceiling.corners.len() {
            let at = ceiling.corners[sample].iter().sum::<glam::DVec3>() / 3.0;
            let under = [1.3, 2.7].iter().any(|x| (at.x - x).abs() < 0.3) && (at.y - 2.0).abs() < 0.3;
            let expected = if under { Standing::Covered } else { Standing::Place };
            assert_eq!(ceiling.standing[sample], expected, "{height} m, {at}");
        }
        let figures = ceiling.figures();
        assert!(figures.samples_without_value > 0 && figures.samples > 10 * figures.samples_without_value);
    }
}
