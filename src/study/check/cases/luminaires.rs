//! Luminaires in unlikely places, and light that arrives nearly level.

use std::f64::consts::PI;

use crate::render::plan::Method::{Gather, Path, Photons, Split};
use crate::study::check::cases::FLUX;
use crate::study::check::forms::{closed_room, closed_room_noise, parallel_panel, point_source};
use crate::study::check::scenes::{
    another_room, diffuse, floor, panel, plane, point_lamp, polygon, room, sensor, six_planes, solid,
};
use crate::study::check::{Case, Measurand, SceneText};

pub(super) const LUMINAIRES: &str = "luminaires";
pub(super) const GRAZING: &str = "grazing light";

const UP: [f64; 3] = [0.0, 0.0, 1.0];
const DOWN: [f64; 3] = [0.0, 0.0, -1.0];
const SIZE: [f64; 3] = [4.0, 4.0, 3.0];

/// A black room of 4 × 4 × 3 m with a panel.
fn black_room(panel: &str, more: &str) -> SceneText {
    SceneText {
        toml: [&diffuse("black", 0.0), panel, more].concat(),
        obj: room([0.0; 3], SIZE, ["black"; 6]),
        mtl: String::new(),
    }
}

/// Nothing but what the text says.
fn open(toml: String) -> SceneText {
    SceneText { toml, ..SceneText::default() }
}

fn in_ceiling() -> Vec<Case> {
    let ceiling = |aim| panel("panel", [2.0, 2.0, 3.0], aim, [1.0; 2], FLUX);
    let exact = parallel_panel(FLUX, [1.0; 2], [0.0, -1.0], 3.0);
    let meter = sensor("meter", [2.0, 1.0, 0.0], UP);
    let cell = plane("cell", [1.9, 0.9, 0.0], [0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [2, 2], "surface");
    let mut cases = Vec::new();
    for method in [Gather, Photons] {
        let name = format!("coplanar with the ceiling, {}", method.name());
        let why = "which of the two a ray meets would be arbitrary";
        let case = Case::new(LUMINAIRES, name, why, black_room(&ceiling(DOWN), &(meter.clone() + &cell)));
        let case = case.method(method).photons(1_000_000).expects(Measurand::Sensor("meter"), exact, 2e-4).useful(0.2);
        cases.push(case.expects(Measurand::Mean("cell"), exact, 2e-3).closed().quick());
    }
    let grey = SceneText {
        toml: [
            diffuse("wall", 0.8),
            panel("panel", [2.0, 2.0, 4.0], DOWN, [0.01; 2], FLUX),
            six_planes([0.0; 3], [4.0; 3], 12),
        ]
        .concat(),
        obj: room([0.0; 3], [4.0; 3], ["wall"; 6]),
        mtl: String::new(),
    };
    cases.push(
        Case::new(LUMINAIRES, "coplanar, ρ = 0.8", "the mean of all six faces is Φ/((1 − ρ)S)", grey)
            .photons(100_000)
            .expects(Measurand::AllPlanes, closed_room(FLUX, 0.8, 96.0), 2e-3)
            .closed(),
    );
    let why = "a panel that shines into the ceiling it lies on";
    let case = Case::new(LUMINAIRES, "face to face with the ceiling", why, black_room(&ceiling(UP), &meter));
    cases.push(case.expects_none(Measurand::Sensor("meter")).photons(10_000).quick());
    cases
}

fn in_the_way() -> Vec<Case> {
    let lamp = point_lamp("lamp", [2.0, 2.0, 1.5], FLUX);
    let mut walled = black_room(&lamp, &(diffuse("wall", 0.5) + &floor([0.0; 3], SIZE, 8)));
    walled.obj = room([0.0; 3], SIZE, ["wall"; 6]) + &solid([1.9, 1.9, 1.4], [2.1, 2.1, 1.6], "wall");
    walled.toml = walled.toml.replace("[material.black]\nreflectance = 0\n", "");
    let mut cases = Vec::new();
    for method in [Gather, Photons] {
        let name = format!("inside of a solid, {}", method.name());
        let case =
            Case::new(LUMINAIRES, name, "its light stays in there", walled.clone()).method(method).photons(50_000);
        cases.push(case.expects_none(Measurand::Mean("floor")).closed().warned("no light can arrive").quick());
    }
    // On the wall x = 0; the meter on the floor sees all of it.
    let wall = [0.0, 2.0, 1.5];
    let meter = sensor("meter", [1.0, 2.0, 0.0], UP);
    let air = plane("air", [0.9, 1.9, 0.5], [0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [1, 1], "air");
    let distance = |height: f64| 1.0_f64.hypot(height);
    for method in [Gather, Photons] {
        let name = format!("a point on a wall, {}", method.name());
        let why = "which side of the wall is it on?";
        let case =
            Case::new(LUMINAIRES, name, why, black_room(&point_lamp("lamp", wall, FLUX), &(meter.clone() + &air)));
        let exact = |height: f64| point_source(FLUX, distance(height), height / distance(height));
        cases.push(
            case.method(method)
                .photons(1_000_000)
                .expects(Measurand::Sensor("meter"), exact(1.5), 1e-4)
                .expects(Measurand::Mean("air"), exact(1.0), 1e-3)
                .useful(0.2)
                .quick(),
        );
    }
    // A panel that stands on the floor with an edge, its back to the wall.
    let standing = panel("panel", [0.0, 2.0, 0.5], [1.0, 0.0, 0.0], [1.0; 2], FLUX);
    let meter = sensor("meter", [3.0, 2.0, 0.5], [-1.0, 0.0, 0.0]);
    let case = Case::new(LUMINAIRES, "touching wall and floor", "ties on two sides", black_room(&standing, &meter));
    cases.push(case.expects(Measurand::Sensor("meter"), parallel_panel(FLUX, [1.0; 2], [0.0; 2], 3.0), 2e-4).quick());
    cases
}

fn strange() -> Vec<Case> {
    let meter = |position| sensor("meter", position, UP);
    let disc = |size: &str| {
        open(
            format!("[[luminaire]]\nname = \"lamp\"\nposition = [0, 0, 2]\nopening = {{ {size} }}\nflux = 1000\n")
                + &meter([0.0; 3]),
        )
    };
    let mut cases = vec![
        Case::new(LUMINAIRES, "a rectangle of no width", "exitance without bound", disc("rectangle = [1, 0]"))
            .refused("above 0")
            .quick(),
        Case::new(LUMINAIRES, "a disc of no size", "exitance without bound", disc("disc = 0"))
            .refused("above 0")
            .quick(),
        Case::new(LUMINAIRES, "a disc of 1 µm", "as bright as a point", disc("disc = 1e-6"))
            .expects(Measurand::Sensor("meter"), 1000.0 / (4.0 * PI), 1e-4)
            .quick(),
    ];
    let glow = SceneText {
        toml: meter([0.5, 0.5, -1.0]),
        obj: polygon("glow", &[[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]),
        mtl: "newmtl glow\nKd 0 0 0\nKe 100 100 100\n".into(),
    };
    cases.push(
        Case::new(LUMINAIRES, "a mesh of no area that shines", "nothing shines", glow)
            .refused("nothing that shines")
            .quick(),
    );
    let behind = open(
        point_lamp("lamp", [0.5, 0.5, -1.0], FLUX)
            + &plane("plane", [0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [8, 8], "air"),
    );
    for method in [Gather, Photons] {
        let name = format!("behind the plane, {}", method.name());
        let case = Case::new(LUMINAIRES, name, "light arrives at its back only", behind.clone()).method(method);
        cases.push(
            case.photons(10_000)
                .expects(Measurand::Worst("plane"), 0.0, 0.0)
                .excused(if method == Gather { "no light can arrive" } else { "no photon" })
                .quick(),
        );
    }
    let near = |height: f64| open(point_lamp("lamp", [0.0, 0.0, height], FLUX) + &meter([0.0; 3]));
    let case = Case::new(LUMINAIRES, "1 µm above a meter", "8·10¹⁴ lx", near(1e-6));
    cases.push(case.expects(Measurand::Sensor("meter"), point_source(FLUX, 1e-6, 1.0), 1e-4).quick());
    let case = Case::new(LUMINAIRES, "a point where a meter is", "illuminance without bound", near(0.0));
    cases.push(case.warned("no bound").quick());
    let in_plane = open(
        point_lamp("lamp", [0.5, 0.5, 0.0], FLUX)
            + &plane("plane", [0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [5, 5], "air"),
    );
    let case = Case::new(LUMINAIRES, "a point in the middle of a cell", "illuminance without bound", in_plane);
    cases.push(case.warned("no bound").quick());
    cases.extend(unequal());
    cases
}

/// A luminaire a thousand million times as bright as another, in two closed cubes: each is lit by its own.
fn unequal() -> impl Iterator<Item = Case> {
    let two = |flux: f64| {
        let floors = plane("first", [0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [16, 16], "surface")
            + &plane("second", [10.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [16, 16], "surface");
        let lamps = point_lamp("bright", [2.0; 3], flux) + &point_lamp("dim", [12.0, 2.0, 2.0], 1.0);
        let far = another_room([10.0, 0.0, 0.0], [14.0, 4.0, 4.0], ["wall"; 6]);
        SceneText {
            toml: [diffuse("wall", 0.5), lamps, floors].concat(),
            obj: room([0.0; 3], [4.0; 3], ["wall"; 6]) + &far,
            mtl: String::new(),
        }
    };
    [Gather, Split, Photons, Path].into_iter().map(move |method| {
        let name = format!("10⁹ : 1, {}", method.name());
        let case =
            Case::new(LUMINAIRES, name, "shares by flux leave the dim one without a photon", two(1e9)).method(method);
        let case = case
            .photons(100_000)
            .rays(if method == Path { 64 } else { 8 })
            .expects(Measurand::Mean("first"), closed_room(1e9, 0.5, 96.0), 2e-3)
            .expects(Measurand::Mean("second"), closed_room(1.0, 0.5, 96.0), 2e-3)
            .useful(if method == Gather { 0.05 } else { 0.25 })
            .within(if method == Path { 0.1 } else { 4.0 * closed_room_noise(0.5, 5e3) + 5e-3 })
            .closed();
        if method == Gather { case.quick() } else { case }
    })
}

fn grazing() -> Vec<Case> {
    let meter = sensor("meter", [0.0; 3], UP);
    let mut cases = Vec::new();
    for height in [1e-1, 1e-2, 1e-3, 1e-4] {
        let exact = point_source(FLUX, 1.0_f64.hypot(height), height / 1.0_f64.hypot(height));
        let lamp = point_lamp("lamp", [1.0, 0.0, height], FLUX);
        let case = Case::new(GRAZING, format!("{height:e} rad, in the air"), "E = I h/d³", open(lamp.clone() + &meter));
        cases.push(case.expects(Measurand::Sensor("meter"), exact, 1e-4).quick());
        let on_floor = SceneText {
            toml: [diffuse("floor", 0.5), lamp, meter.clone()].concat(),
            obj: polygon("floor", &[[-4.0, -4.0, 0.0], [4.0, -4.0, 0.0], [4.0, 4.0, 0.0], [-4.0, 4.0, 0.0]]),
            mtl: String::new(),
        };
        let case =
            Case::new(GRAZING, format!("{height:e} rad, on a floor"), "a micrometre of height matters", on_floor);
        cases.push(case.expects(Measurand::Sensor("meter"), exact, 1e-4).photons(10_000).quick());
    }
    let level = open(point_lamp("lamp", [1.0, 0.0, 0.0], FLUX) + &meter);
    let case = Case::new(GRAZING, "level", "none arrives", level);
    cases.push(case.expects(Measurand::Sensor("meter"), 0.0, 0.0).quick());
    cases
}

pub(super) fn cases() -> Vec<Case> {
    [in_ceiling(), in_the_way(), strange(), grazing()].concat()
}
