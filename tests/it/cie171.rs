//! CIE 171:2006, the analytical cases for electric light, against their closed forms. Where CIE's printed table is rounded
//! or wrong (case 5.7, table 19), the closed form decides.

use std::f64::consts::PI;
use std::fmt::Write as _;

use crate::common::assert_close;
use crate::common::mean;
use crate::common::room;
use crate::common::run;
use crate::common::scene;
use crate::common::sensor;
use luxmap::render::plan::Method;

/// Case 5.2: a point source with I = 1000 cd · cos γ, 3 m above a plane; E = I₀ h²/(h² + x² + y²)². No error but
/// single-precision positions (10⁻⁷ of 3 m, to the fourth power).
#[test]
fn case_5_2_point_source() {
    let points = [
        ("A", 0.0, 0.0),
        ("B", 0.5, 0.0),
        ("C", 1.0, 0.0),
        ("D", 1.5, 0.0),
        ("E", 0.5, 0.5),
        ("F", 1.0, 0.5),
        ("G", 1.5, 0.5),
        ("H", 1.0, 1.0),
        ("I", 1.5, 1.0),
        ("J", 1.5, 1.5),
    ];
    let mut toml = format!(
        "[[luminaire]]\nname = \"source\"\nposition = [0, 0, 3]\nphotometry = \"lambertian\"\nopening = \"point\"\nflux = {}\n",
        1000.0 * PI
    );
    for (name, x, y) in points {
        toml += &sensor(name, [x, y, 0.0], [0.0, 0.0, 1.0]);
    }
    let results = run(&scene("cie_5_2", &toml, ""), Method::Split, 1, 0);
    for ((name, x, y), found) in points.into_iter().zip(&results.sensors) {
        let expected = 1000.0 * 9.0 / (9.0 + x * x + y * y).powi(2);
        assert_close(name, found.illuminance, expected, 4e-6);
    }
}

/// Case 5.3: a Lambertian square of 1 m in a black room's ceiling, L = 1000 cd/m². luxmap hangs an opening 10⁻⁵ of half
/// the room's extent (2·10⁻⁵ m) below the ceiling; the nearest point is 0.25 m below it, so at most about 2 · 2·10⁻⁵/0.25
/// of its light, and the expected values have five digits.
#[test]
fn case_5_3_area_source() {
    let wall = [32.677, 75.194, 81.323, 69.061, 53.404, 40.002];
    let floor = [61.424, 79.255, 95.667, 105.778, 105.778, 95.667, 79.255, 61.424];
    let mut toml = format!(
        "[material.black]\nreflectance = 0\n[[luminaire]]\nname = \"panel\"\nposition = [2, 2, 3]\nopening = {{ rectangle = [1, 1] }}\nflux = {}\n",
        1000.0 * PI
    );
    for step in 0..wall.len() {
        toml += &sensor(&format!("wall {step}"), [2.0, 0.0, 2.75 - 0.5 * step as f64], [0.0, 1.0, 0.0]);
    }
    for step in 0..floor.len() {
        toml += &sensor(&format!("floor {step}"), [2.0, 0.25 + 0.5 * step as f64, 0.0], [0.0, 0.0, 1.0]);
    }
    let obj = room([0.0; 3], [4.0, 4.0, 3.0], ["black"; 6]);
    let results = run(&scene("cie_5_3", &toml, &obj), Method::Split, 1, 0);
    for (expected, found) in wall.iter().chain(&floor).zip(&results.sensors) {
        assert_close(&found.name, found.illuminance, *expected, 2e-4);
    }
}

/// TOML of six measuring planes, one on each face of a room from the origin to `size`.
fn six_planes([x, y, z]: [f64; 3], cells: usize) -> String {
    let faces = [
        ("floor", [0.0, 0.0, 0.0], [x, 0.0, 0.0], [0.0, y, 0.0]),
        ("ceiling", [0.0, 0.0, z], [0.0, y, 0.0], [x, 0.0, 0.0]),
        ("x low", [0.0, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]),
        ("x high", [x, 0.0, 0.0], [0.0, 0.0, z], [0.0, y, 0.0]),
        ("y low", [0.0, 0.0, 0.0], [0.0, 0.0, z], [x, 0.0, 0.0]),
        ("y high", [0.0, y, 0.0], [x, 0.0, 0.0], [0.0, 0.0, z]),
    ];
    let mut toml = String::new();
    for (name, corner, along, across) in faces {
        writeln!(
            toml,
            "[[plane]]\nname = \"{name}\"\ncorner = {corner:?}\nalong = {along:?}\nacross = {across:?}\ncells = [{cells}, {cells}]\non = \"surface\""
        )
        .expect("a string takes all");
    }
    toml
}

/// Case 5.4: all of a source's flux arrives on the walls of a closed black room, ΣE·A = Φ. For `split` the error is the
/// grid's: the midpoint rule on cells of h = 0.1 m misses h²/24 · ∇²E, and ∇²E/E < 10/d² with d ≥ 1.5 m: 0.2 %. For
/// `photons` it is the estimate's smoothing; 400,000 photons leave a mean no noise to speak of, as each lands once.
#[test]
fn case_5_4_flux_is_conserved() {
    let toml = format!(
        "[material.black]\nreflectance = 0\n[[luminaire]]\nname = \"source\"\nposition = [2, 2, 1.5]\nflux = 10000\n{}",
        six_planes([4.0, 4.0, 3.0], 40)
    );
    let scene = scene("cie_5_4", &toml, &room([0.0; 3], [4.0, 4.0, 3.0], ["black"; 6]));
    for (method, bound) in [(Method::Split, 2e-3), (Method::Photons, 5e-3)] {
        let results = run(&scene, method, 400_000, 1);
        let areas = results.maps.iter().map(|map| map.along.length() * map.across.length());
        let flux: f64 = results.maps.iter().zip(areas).map(|(map, area)| mean(map) * area).sum();
        assert_close(method.name(), flux, 10_000.0, bound);
    }
}

/// Cases 5.6 and 5.7 measure E/M, a configuration factor: what a uniform Lambertian surface of exitance M sends to a
/// point. The surface's uniform exitance is given as emission, 3.142 lm/m² for L = 1 cd/m², since there is no parallel
/// light to make it by reflection.
fn emitting(test: &str, obj: &str, points: &[([f64; 3], [f64; 3])], method: Method, photons: u64) -> Vec<(f64, f64)> {
    let mtl = "newmtl bright\nKd 0 0 0\nKe 1 1 1\nnewmtl black\nKd 0 0 0\n";
    std::fs::write(crate::common::folder(test).join("mesh.mtl"), mtl).expect("the target folder is writable");
    let sensors = points.iter().enumerate().map(|(i, (position, normal))| sensor(&format!("{i}"), *position, *normal));
    let scene = scene(test, &sensors.collect::<String>(), &format!("mtllib mesh.mtl\n{obj}"));
    let results = run(&scene, method, photons, 5);
    results.sensors.iter().map(|found| (found.illuminance / PI, found.standard_error / PI)).collect()
}

/// Case 5.6, scenario 2 (CIE table 17, equal to the closed form to all digits printed): a horizontal square of 4 m sends
/// light to a wall and a ceiling in open, black surroundings.
#[test]
fn case_5_6_reflection_over_a_diffuse_surface() {
    let obj = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nusemtl bright\nf 1 2 3 4\n\
               v 0 0 .5\nv 4 0 .5\nv 4 0 3\nv 0 0 3\nusemtl black\nf 5 6 7 8\n\
               v 0 0 3\nv 4 0 3\nv 4 4 3\nv 0 4 3\nf 9 10 11 12\n";
    let wall = [0.75, 1.25, 1.75, 2.25, 2.75].map(|z| ([2.0, 0.0, z], [0.0, 1.0, 0.0]));
    let ceiling = [0.25, 0.75, 1.25, 1.75].map(|y| ([2.0, y, 3.0], [0.0, 0.0, -1.0]));
    let points: Vec<_> = wall.into_iter().chain(ceiling).collect();
    let expected = [35.901, 27.992, 21.639, 16.716, 12.967, 26.80, 30.94, 33.98, 35.57];
    // Four or five digits are printed.
    for ((found, _), expected) in emitting("cie_5_6", obj, &points, Method::Split, 1).iter().zip(expected) {
        assert_close("split", 100.0 * found, expected, 2e-4);
    }
    // By photons alone: 4 σ of the estimate's own claim.
    for ((found, sigma), expected) in
        emitting("cie_5_6_photons", obj, &points, Method::Photons, 2_000_000).iter().zip(expected)
    {
        assert_close("photons", 100.0 * found, expected, 4.0 * sigma / found);
    }
}

/// Case 5.7 with the corrected reference values (CIE's table 19 used another geometry): a bright wall, and a black box on
/// the floor that hides part of it. Shadows are cut exactly, so the bound is that of five printed digits: half of the last.
#[test]
fn case_5_7_diffuse_reflection_with_an_obstruction() {
    let mut obj = String::from(
        "v 0 4 0\nv 4 4 0\nv 4 4 3\nv 0 4 3\nusemtl bright\nf 1 2 3 4\n\
         usemtl black\nv 0 0 0\nv 4 0 0\nv 4 0 3\nv 0 0 3\nf 5 6 7 8\nv 0 0 0\nv 4 0 0\nv 4 2.5 0\nv 0 2.5 0\nf 9 10 11 12\n",
    );
    for [x, y, z] in (0..8).map(|i| [4 * (i & 1), i >> 1 & 1, i >> 2]) {
        writeln!(obj, "v {x} {} {z}", 2.5 + 0.2 * f64::from(y)).expect("a string takes all");
    }
    for face in
        [[13, 14, 16, 15], [17, 18, 20, 19], [13, 14, 18, 17], [15, 16, 20, 19], [13, 15, 19, 17], [14, 16, 20, 18]]
    {
        writeln!(obj, "f {} {} {} {}", face[0], face[1], face[2], face[3]).expect("a string takes all");
    }
    let wall = [2.75, 2.25, 1.75, 1.25, 0.75, 0.25].map(|z| ([2.0, 0.0, z], [0.0, 1.0, 0.0]));
    let floor = [0.25, 0.75, 1.25, 1.75, 2.25].map(|y| ([2.0, y, 0.0], [0.0, 0.0, 1.0]));
    let points: Vec<_> = wall.into_iter().chain(floor).collect();
    let expected = [16.071, 16.330, 15.399, 13.322, 10.317, 7.079, 3.382, 3.629, 3.013, 0.0, 0.0];
    for ((found, _), expected) in emitting("cie_5_7", &obj, &points, Method::Split, 1).iter().zip(expected) {
        println!("found {:.4} %, expected {expected:.3} %", 100.0 * found);
        assert!((100.0 * found - expected).abs() <= 0.000_6, "found {} %, expected {expected} %", 100.0 * found);
    }
}

/// Case 5.8: a closed cube of uniform ρ; the walls' mean is E = Φ/((1 − ρ)S) by energy alone, and by symmetry every
/// wall's. Of a photon's L landings (geometric, mean 1/(1 − ρ), variance ρ/(1 − ρ)²) about one in six falls on the floor:
/// variance 5/36 · mean + variance/36, less for the direct part, which `split` knows. Bound: 4 σ, and 0.2 % for the grid.
#[test]
fn case_5_8_internal_reflections() {
    let photons = 400_000;
    for rho in [0.0_f64, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95] {
        let toml = format!(
            "[material.wall]\nreflectance = {rho}\n[[luminaire]]\nname = \"source\"\nposition = [2, 2, 2]\nflux = 10000\n\
             [[plane]]\nname = \"floor\"\ncorner = [0, 0, 0]\nalong = [4, 0, 0]\nacross = [0, 4, 0]\ncells = [40, 40]\non = \"surface\"\n"
        );
        let scene = scene("cie_5_8", &toml, &room([0.0; 3], [4.0; 3], ["wall"; 6]));
        let results = run(&scene, Method::Split, photons, 8);
        let (landings, spread) = (1.0 / (1.0 - rho), rho / (1.0 - rho).powi(2));
        let sigma = (5.0 / 36.0 * landings + spread / 36.0).sqrt() / (photons as f64).sqrt() / (landings / 6.0);
        let expected = 10_000.0 / ((1.0 - rho) * 96.0);
        assert_close(&format!("ρ = {rho}"), mean(&results.maps[0]), expected, 4.0 * sigma + 2e-3);
        let flux = results.run.flux;
        let accounted = flux.absorbed + flux.escaped + flux.cut_off;
        if rho > 0.0 {
            assert_close("flux balance", accounted.0, flux.emitted.0, 1e-9);
            assert!(flux.escaped.0 <= 1e-6 * flux.emitted.0, "a closed room lost {}", flux.escaped);
        }
    }
}
