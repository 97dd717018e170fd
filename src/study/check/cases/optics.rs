//! Glass, mirrors, colours.

use std::f64::consts::{PI, TAU};

use crate::render::plan::Method::{Gather, Path, Photons, Split};
use crate::study::check::cases::{CUBE, FLUX};
use crate::study::check::forms::{closed_room, trapped_in_cube};
use crate::study::check::scenes::{diffuse, floor, plane, point_lamp, polygon, room, sensor, six_planes, solid};
use crate::study::check::{Case, Measurand, SceneText};

pub(super) const GLASS: &str = "glass and caustics";
pub(super) const COLOURS: &str = "colours and mirrors";

fn glass(name: &str, ior: f64, absorption: f64) -> String {
    format!("[material.{name}]\ndielectric = {{ ior = {ior:?}, absorption = {absorption:?} }}\n")
}

/// A black cube of 4 m about the origin with six maps, a source in its middle, and what else `obj` says.
fn black_cube(toml: &str, obj: &str) -> SceneText {
    SceneText {
        toml: [&diffuse("black", 0.0), toml, &point_lamp("lamp", [0.0; 3], FLUX), &six_planes([-2.0; 3], [2.0; 3], 16)]
            .concat(),
        obj: room([-2.0; 3], [2.0; 3], ["black"; 6]) + obj,
        mtl: String::new(),
    }
}

/// A bowl: the lower half of a sphere with radius 1, a mirror inside, in facets whose corners lie on the sphere.
fn bowl() -> String {
    let (rings, sides) = (24, 48);
    let at = |ring: usize, side: usize| {
        let (sin, cos) = (0.5 * PI * ring as f64 / rings as f64).sin_cos();
        let (y, x) = (TAU * (side % sides) as f64 / sides as f64).sin_cos();
        // The lowest ring is one point: its facets are triangles.
        [sin * x, sin * y, if ring == rings { 0.0 } else { -cos }]
    };
    let facet = |ring: usize, side: usize| {
        let corners = [at(ring + 1, side), at(ring + 1, side + 1), at(ring, side + 1), at(ring, side)];
        polygon("mirror", if ring == 0 { &corners[..3] } else { &corners })
    };
    (0..rings).flat_map(|ring| (0..sides).map(move |side| facet(ring, side))).collect()
}

/// A slab of glass with another inside, and a plane below, 3 m under a lamp.
fn slabs(outer: f64, inner: Option<f64>) -> SceneText {
    let mut obj = solid([-3.0, -3.0, 0.4], [3.0, 3.0, 1.4], "outer");
    let mut toml = glass("outer", 1.5, outer)
        + &point_lamp("lamp", [0.0, 0.0, 3.0], FLUX)
        + &plane("below", [-0.5, -0.5, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [8, 8], "air");
    if let Some(inner) = inner {
        obj += &solid([-2.5, -2.5, 0.7], [2.5, 2.5, 1.1], "inner");
        toml += &glass("inner", 1.5, inner);
    }
    SceneText { toml, obj, mtl: String::new() }
}

fn glasses() -> Vec<Case> {
    let mut cases = Vec::new();
    let sheet = solid([-1.9, -1.9, 0.8], [1.9, 1.9, 1.0], "glass");
    let why = "all of the light lands on the walls, wherever glass sends it";
    for method in [Gather, Photons] {
        let name = format!("absorption 0, {}", method.name());
        let case = Case::new(GLASS, name, why, black_cube(&glass("glass", 1.5, 0.0), &sheet)).method(method);
        let case = case.photons(200_000).expects(Measurand::AllPlanes, closed_room(FLUX, 0.0, CUBE), 5e-3);
        cases.push(case.useful(0.3).within(0.02).closed().quick());
    }
    let block = solid([-0.5; 3], [0.5; 3], "glass");
    let trapped = trapped_in_cube(1.5);
    for method in [Gather, Photons] {
        let name = format!("total reflection, {}", method.name());
        let why = "a lamp in a cube of clear glass: 23.6 % of its light never gets out";
        let case = Case::new(GLASS, name, why, black_cube(&glass("glass", 1.5, 0.0), &block)).method(method);
        let spread = ((1.0 - trapped) / trapped / 10_000.0).sqrt();
        let case = case
            .photons(10_000)
            .expects(Measurand::AllPlanes, (1.0 - trapped) * closed_room(FLUX, 0.0, CUBE), 5e-3)
            .expects(Measurand::CutOff, trapped, 4.0 * spread)
            .warned("trapped")
            .useful(0.3)
            .within(0.03)
            .closed();
        cases.push(if method == Gather { case.quick() } else { case });
    }
    let why = "glass in glass of the same kind: nothing is to be seen of it";
    let case = Case::new(GLASS, "nested, the same glass", why, slabs(0.0, Some(0.0))).method(Split).photons(1_000_000);
    cases.push(case.expects_as(Measurand::Mean("below"), slabs(0.0, None), 1.0, 0.0).useful(0.2).within(0.07));
    // 0.6 m of the outer and 0.4 m of the inner glass, at nearly normal incidence: ways are up to 1.1 % longer.
    let why = "e^(−0.6 a − 0.4 b): leaving the inner glass leads back into the outer";
    for (outer, inner) in [(1.0, 3.0), (2.0, 0.0), (0.0, 3.0)] {
        let name = format!("nested, {outer}/m around {inner}/m");
        let passed = (-0.6_f64 * outer - 0.4 * inner).exp();
        let case = Case::new(GLASS, name, why, slabs(outer, Some(inner))).method(Split).photons(1_000_000);
        let case = case.expects_as(Measurand::Mean("below"), slabs(0.0, None), passed, 0.0);
        // Of a million photons some 1300 get there.
        cases.push(case.useful(0.3).within(0.12));
    }
    // In the middle of a cube of side 1 m with ior 1, 0.5 m below its top, on the way straight up.
    let tinted = SceneText {
        toml: glass("glass", 1.000_001, 2.0)
            + &point_lamp("lamp", [0.0; 3], FLUX)
            + &plane("above", [-0.1, -0.1, 2.0], [0.0, 0.2, 0.0], [0.2, 0.0, 0.0], [2, 2], "air"),
        obj: block,
        mtl: String::new(),
    };
    let exact = FLUX / (4.0 * PI) / 4.0 * (-1.0_f64).exp();
    let case = Case::new(GLASS, "a lamp in tinted glass", "its light begins inside: e^(−1) of it gets out", tinted);
    cases.push(
        case.method(Split).photons(1_000_000).expects(Measurand::Mean("above"), exact, 5e-3).useful(0.2).within(0.25),
    );
    let focus = SceneText {
        toml: "[material.mirror]\nspecular = 1.0\n".to_owned()
            + &point_lamp("lamp", [0.2, 0.0, -0.1], FLUX)
            + &plane("mouth", [-1.0, -1.0, 0.0], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0], [80, 80], "air"),
        obj: bowl(),
        mtl: String::new(),
    };
    for method in [Gather, Photons] {
        let name = format!("focus of a concave mirror, {}", method.name());
        let why = "all of the light leaves by the bowl's mouth, much of it through one spot";
        let case = Case::new(GLASS, name, why, focus.clone()).method(method).photons(500_000);
        cases.push(case.expects(Measurand::Flux("mouth"), FLUX, 0.01).useful(0.3).within(0.02));
    }
    cases
}

fn colours() -> Vec<Case> {
    let coloured = |reflectance: &str, colour: &str| SceneText {
        toml: format!("[material.wall]\nreflectance = {reflectance}\n")
            + &point_lamp("lamp", [0.0; 3], FLUX)
            + &format!("color = {colour}\n")
            + &floor([-2.0; 3], [2.0; 3], 16),
        obj: room([-2.0; 3], [2.0; 3], ["wall"; 6]),
        mtl: String::new(),
    };
    let mut cases = Vec::new();
    let at = |rho: f64| closed_room(FLUX, rho, CUBE);
    for method in [Gather, Split, Photons, Path] {
        let of = |name: &str, why, scene| {
            let case = Case::new(COLOURS, format!("{name}, {}", method.name()), why, scene).method(method);
            case.photons(100_000).rays(16).useful(0.3).within(0.05)
        };
        let rho = coloured("[0.8, 0.5, 0.0]", "[1, 1, 1]");
        let case = of("walls without blue", "no blue bounces", rho);
        let case = (0..3)
            .zip([0.8, 0.5, 0.0])
            .fold(case, |case, (channel, rho)| case.expects(Measurand::Channel("floor", channel), at(rho), 0.01));
        cases.push(case.closed().quick());
        // Red of luminance 1: 1/0.2126 in its channel.
        let case = of("a red lamp", "two channels of nothing", coloured("0.8", "[1, 0, 0]"));
        let case = case.expects(Measurand::Channel("floor", 0), at(0.8) / 0.2126, 0.01);
        let case =
            case.expects(Measurand::Channel("floor", 1), 0.0, 0.0).expects(Measurand::Channel("floor", 2), 0.0, 0.0);
        cases.push(case.closed().quick());
        let case = of("a red lamp, walls without red", "0/0 in each survival", coloured("[0, 0.8, 0.8]", "[1, 0, 0]"));
        let case = case.expects(Measurand::Channel("floor", 0), at(0.0) / 0.2126, 0.01);
        let case =
            case.expects(Measurand::Channel("floor", 1), 0.0, 0.0).expects(Measurand::Channel("floor", 2), 0.0, 0.0);
        cases.push(case.closed().quick());
    }
    cases
}

fn mirrors() -> Vec<Case> {
    let all = SceneText {
        toml: "[material.mirror]\nspecular = 0.999\n".to_owned()
            + &point_lamp("lamp", [0.1, 0.2, 0.3], FLUX)
            + &six_planes([-2.0; 3], [2.0; 3], 8),
        obj: room([-2.0; 3], [2.0; 3], ["mirror"; 6]),
        mtl: String::new(),
    };
    let mut cases = Vec::new();
    for method in [Gather, Photons] {
        let name = format!("a room of mirrors, {}", method.name());
        let case =
            Case::new(COLOURS, name, "1000 bounces from mirror to mirror, ρ = 0.999", all.clone()).method(method);
        let case = case.photons(4000).expects(Measurand::AllPlanes, closed_room(FLUX, 0.999, CUBE), 0.01);
        cases.push(case.useful(0.3).within(0.07).closed());
    }
    // Images at 0.5, 1.5, 2.5 … m: E = I Σ 1/(n + ½)² = I π²/2 below the lamp; the most upright of a million photons
    // bounce thousands of times. The cells are so small (0.05 m) that they read 0.5 % less than the point below the
    // lamp.
    let sheet = |z: f64| polygon("mirror", &[[-2.0, -2.0, z], [2.0, -2.0, z], [2.0, 2.0, z], [-2.0, 2.0, z]]);
    let facing = SceneText {
        toml: "[material.mirror]\nspecular = 1.0\n".to_owned()
            + &point_lamp("lamp", [0.0, 0.0, 0.5], FLUX)
            + &plane("below", [-0.05, -0.05, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [2, 2], "surface")
            + &sensor("meter", [0.0; 3], [0.0, 0.0, 1.0]),
        obj: sheet(0.0) + &sheet(1.0),
        mtl: String::new(),
    };
    for method in [Gather, Photons] {
        let name = format!("perfect mirrors face to face, {}", method.name());
        let case = Case::new(COLOURS, name, "a lamp between: endless images", facing.clone()).method(method);
        let exact = FLUX / (4.0 * PI) * PI * PI / 2.0;
        let case = case.photons(1_000_000).expects(Measurand::Sensor("meter"), exact, 0.01);
        cases.push(case.expects(Measurand::Mean("below"), exact, 0.01).useful(0.2));
    }
    cases
}

pub(super) fn cases() -> Vec<Case> {
    [glasses(), colours(), mirrors()].concat()
}
