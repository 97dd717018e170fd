//! Closed rooms that absorb next to nothing.

use std::f64::consts::PI;

use crate::render::plan::Method::{Gather, Path, Photons, Seed, Split};
use crate::study::check::cases::{CUBE, FLUX, cube};
use crate::study::check::forms::{closed_room, closed_room_noise, glowing_room};
use crate::study::check::scenes::{floor, plane, room, sensor};
use crate::study::check::{Case, Measurand, SceneText};

pub(super) const ROOMS: &str = "high reflectance";

/// Of the walls that glow, lx.
const EXITANCE: f64 = 100.0;

/// A room whose surfaces all glow alike: E is the same at every point.
pub(super) fn glowing(rho: f64, toml: String) -> SceneText {
    let luminance = EXITANCE / PI;
    SceneText {
        toml,
        obj: room([0.0; 3], [6.0, 4.0, 2.7], ["glow"; 6]),
        mtl: format!("newmtl glow\nKd {rho} {rho} {rho}\nKe {luminance} {luminance} {luminance}\n"),
    }
}

fn glowing_places(rho: f64) -> SceneText {
    let planes = floor([0.0; 3], [6.0, 4.0, 2.7], 12)
        + &plane("air", [0.0, 0.0, 1.0], [6.0, 0.0, 0.0], [0.0, 4.0, 0.0], [12, 8], "air");
    glowing(rho, planes + &sensor("corner", [0.01, 0.01, 0.01], [0.0, 0.0, 1.0]))
}

pub(super) fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    // Photons for about as many rays each, and the rounding of one's share: the flux of all photons together is known
    // to 1/√N, since a photon's landings come to 1/(1 − ρ) with a spread of as much.
    for (rho, photons) in [(0.9, 100_000), (0.95, 100_000), (0.99, 40_000), (0.999, 10_000), (0.9999, 4000)] {
        let exact = closed_room(FLUX, rho, CUBE);
        let why = "E = Φ/((1 − ρ)S), the mean of a cube's face";
        for method in [Gather, Split, Photons] {
            if rho > 0.9995 && method == Photons {
                continue;
            }
            let case =
                Case::new(ROOMS, format!("cube, ρ = {rho}, {}", method.name()), why, cube(rho, 1.0, [0.0; 3], 16))
                    .method(method)
                    .photons(photons)
                    .expects(Measurand::Mean("floor"), exact, 2e-3)
                    .useful(if method == Gather { 0.05 } else { 0.2 })
                    .within(4.0 * closed_room_noise(rho, photons as f64) + 5e-3)
                    .closed();
            cases.push(if rho < 0.995 && method == Gather { case.quick() } else { case });
        }
        let exact = glowing_room(EXITANCE, rho);
        let case =
            Case::new(ROOMS, format!("glowing room, ρ = {rho}"), "E = M/(1 − ρ) at every point", glowing_places(rho))
                .photons(photons)
                .expects(Measurand::Mean("floor"), exact, 0.0)
                .expects(Measurand::Worst("floor"), exact, 0.0)
                .expects(Measurand::Mean("air"), exact, 0.0)
                .expects(Measurand::Worst("air"), exact, 0.0)
                .expects(Measurand::Sensor("corner"), exact, 0.0)
                .useful(0.1)
                .closed();
        cases.push(if rho < 0.92 { case.quick() } else { case });
    }
    for (rho, rays) in [(0.9, 8), (0.99, 8), (0.999, 2)] {
        let scene = glowing(rho, sensor("middle", [3.0, 2.0, 0.0], [0.0, 0.0, 1.0]));
        let case = Case::new(ROOMS, format!("glowing room, ρ = {rho}, path"), "paths end by roulette only", scene);
        let case = case.method(Path).rays(rays).expects(Measurand::Sensor("middle"), glowing_room(EXITANCE, rho), 0.0);
        cases.push(case.useful(0.1));
    }
    let scene = glowing(0.9, plane("middle", [2.0, 1.5, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [20, 10], "surface"));
    cases.push(
        Case::new(
            ROOMS,
            "glowing room, ρ = 0.9, seed",
            "the paper's estimator reads k/(k − 1) too high, as printed",
            scene,
        )
        .method(Seed)
        .photons(200_000)
        .nearest(200)
        .expects(Measurand::Mean("middle"), glowing_room(EXITANCE, 0.9) * 200.0 / 199.0, 0.0)
        .useful(0.1)
        .closed(),
    );
    let why = "light has no end: no illuminance to settle at";
    for method in [Gather, Path, Photons] {
        let case = Case::new(ROOMS, format!("cube, ρ = 1, {}", method.name()), why, cube(1.0, 1.0, [0.0; 3], 4));
        let case = case.method(method).refused("under way");
        cases.push(if method == Gather { case.quick() } else { case });
    }
    let why = "mean of 100,000 bounces, as many as a photon may make";
    cases.push(Case::new(ROOMS, "cube, ρ = 0.99999", why, cube(0.99999, 1.0, [0.0; 3], 4)).refused("under way"));
    let mut open = cube(1.0, 1.0, [0.0; 3], 16);
    open.obj = open.obj.lines().filter(|line| *line != "f 7 8 6 5").collect::<Vec<_>>().join("\n");
    // Whatever goes in comes out by the opening, once.
    cases.push(
        Case::new(ROOMS, "cube, ρ = 1, without a ceiling", "nothing is absorbed, all light gets out", open)
            .photons(20_000)
            .expects(Measurand::Escaped, 1.0, 1e-6)
            .quick(),
    );
    cases
}
