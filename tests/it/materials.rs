//! Materials beyond Lambert's law, perfect mirrors and clear glass, each against what physics says of it.

use std::f64::consts::PI;
use std::fs;

use crate::common;
use crate::common::assert_close;
use crate::common::folder;
use crate::common::mean;
use crate::common::passes;
use crate::common::room;
use crate::common::run_with;
use crate::common::scene;
use crate::common::sensor;
use luxmap::render::Settings;
use luxmap::render::Stop;
use luxmap::render::plan::Method;
use luxmap::render::plan::Plan;
use luxmap::results::IlluminanceMap;
use luxmap::scene::Scene;

const ALL: [Method; 4] = [Method::Gather, Method::Path, Method::Split, Method::Photons];

/// √(mean σ²) over the mean.
fn claim(map: &IlluminanceMap) -> f64 {
    common::claim(map) / mean(map)
}

/// OBJ text of more corners and faces behind `obj`, which has `before` corners: each face four corners.
fn with_faces(obj: &str, before: usize, faces: &[(&str, [[f64; 3]; 4])]) -> String {
    let face = |(index, (material, corners)): (usize, &(&str, [[f64; 3]; 4]))| {
        let vertices: String = corners.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
        let first = before + 4 * index + 1;
        format!("{vertices}usemtl {material}\nf {} {} {} {}\n", first, first + 1, first + 2, first + 3)
    };
    obj.to_owned() + &faces.iter().enumerate().map(face).collect::<String>()
}

/// A furnace: where every surface of a closed room sends out (1 − R) of what it would if it were black and as hot, luminance
/// is the same everywhere and E = π L at every point, whatever the surfaces are made of and however the room is cut up.
/// Here walls are of six kinds, and a sheet, two rough metals and glass stand in the room that lose nothing (R = 1).
#[test]
fn a_furnace_of_all_materials_is_evenly_lit() {
    let luminance = 100.0;
    // (name, reflectance, specular, roughness) of the floor, the ceiling and the walls.
    let walls = [
        ("floor", 0.5, 0.0, 0.0),
        ("ceiling", 0.3, 0.4, 0.5),
        ("west", 0.0, 0.6, 0.1),
        ("east", 0.2, 0.3, 0.0),
        ("south", 0.0, 0.8, 1.0),
        ("north", 0.4, 0.4, 0.25),
    ];
    let mtl: String = walls
        .iter()
        .map(|(name, rho, specular, _)| format!("newmtl {name}\nKd 0\nKe {}\n", luminance * (1.0 - rho - specular)))
        .collect();
    fs::write(folder("furnace").join("furnace.mtl"), mtl).expect("writable");
    let wall = |(name, rho, specular, roughness): &(&str, f64, f64, f64)| {
        format!("[material.{name}]\nreflectance = {rho}\nspecular = {specular}\nroughness = {roughness}\n")
    };
    let toml = walls.iter().map(wall).collect::<String>()
        + "[material.sheet]\nreflectance = 0.4\ntransmittance = 0.6\n\
           [material.brushed]\nspecular = 1\nroughness = 0.4\n[material.fine]\nspecular = 1\nroughness = 0.08\n\
           [material.opal]\nreflectance = 0.1\nspecular = 0.2\nroughness = 0.6\ntransmittance = 0.7\n\
           [material.glass]\ndielectric = { ior = 1.5 }\n\
           [[plane]]\nname = \"floor\"\ncorner = [0,0,0]\nalong = [3,0,0]\nacross = [0,2.4,0]\ncells = [15,12]\non = \"surface\"\n\
           [[plane]]\nname = \"air\"\ncorner = [0,0,1.1]\nalong = [3,0,0]\nacross = [0,2.4,0]\ncells = [15,12]\non = \"air\"\n";
    let obj = room([0.0; 3], [3.0, 2.4, 2.5], walls.map(|wall| wall.0));
    let upright = |x: f64, low: f64, high: f64| [[x, low, 0.3], [x, high, 0.3], [x, high, 1.9], [x, low, 1.9]];
    let lying = |z: f64| [[2.0, 0.3, z], [2.8, 0.3, z], [2.8, 1.2, z + 0.3], [2.0, 1.2, z + 0.3]];
    let faces = [
        ("sheet", upright(1.01, 0.2, 1.3)),
        ("opal", upright(1.93, 1.45, 2.2)),
        ("brushed", lying(0.7)),
        ("fine", upright(0.31, 1.43, 2.2)),
    ];
    let mut obj = with_faces(&format!("mtllib furnace.mtl\n{obj}"), 8, &faces);
    // A box of glass, faces outwards.
    let corners = [[0.4, 0.3, 0.4], [0.8, 0.7, 0.9]];
    for corner in 0..8 {
        let pick = |axis: usize| corners[corner >> axis & 1][axis];
        obj += &format!("v {} {} {}\n", pick(0), pick(1), pick(2));
    }
    obj += "usemtl glass\nf 27 28 26 25\nf 29 30 32 31\nf 29 31 27 25\nf 26 28 32 30\nf 26 30 29 25\nf 31 32 28 27\n";
    let scene = scene("furnace", &toml, &obj);
    let expected = PI * luminance;
    for method in ALL {
        let results = passes(&scene, method, 4, 3);
        for map in &results.maps {
            let (claim, count) = (claim(map), map.illuminance.len() as f64);
            let off = mean(map) / expected - 1.0;
            let rms = (map.illuminance.iter().map(|e| (e / expected - 1.0).powi(2)).sum::<f64>() / count).sqrt();
            println!("{} {}: mean off {off:+.5}, RMS {rms:.5}, claimed {claim:.5}", method.name(), map.name);
            // Points share photons and rays: their common error is below the claim of one.
            assert!(off.abs() < claim.max(1e-3), "{} {}: mean off by {off}", method.name(), map.name);
            assert!(rms < 2.0 * claim, "{} {}: RMS {rms}, claimed {claim}", method.name(), map.name);
            assert!(claim < 0.03, "{} {}: the test must be able to fail: {claim}", method.name(), map.name);
        }
        let flux = results.run.flux;
        let kept = (flux.absorbed.0 + flux.escaped.0 + flux.cut_off.0) / flux.emitted.0.max(1e-9);
        assert!(method == Method::Path || (kept - 1.0).abs() < 1e-6, "flux in and out: {kept}");
    }
}

/// A black room with a metal panel beside the floor, lit by a lamp that sees both.
fn panel(test: &str, roughness: f64, lamp: &str) -> Scene {
    let obj = room([0.0; 3], [3.0, 3.0, 2.5], ["black"; 6]);
    // It leans over the floor.
    let corners = [[2.9, 0.5, 0.1], [2.9, 2.5, 0.1], [2.4, 2.5, 1.6], [2.4, 0.5, 1.6]];
    let obj = with_faces(&obj, 8, &[("metal", corners)]);
    let toml = format!(
        "[material.black]\nreflectance = 0\n[material.metal]\nspecular = 0.9\nroughness = {roughness}\n\
         [[luminaire]]\nname = \"lamp\"\nposition = [0.9, 1.4, 2.2]\naim = [0.3, 0, -1]\nflux = 5000\n{lamp}\n\
         [[plane]]\nname = \"floor\"\ncorner = [0.5, 0.5, 0]\nalong = [2, 0, 0]\nacross = [0, 2, 0]\ncells = [20, 20]\non = \"surface\"\n"
    );
    scene(&format!("panel_{test}_{roughness}"), &toml, &obj)
}

/// A rough metal panel throws the same light on the floor whether it is found by rays or by photons, be the lamp a point, a
/// disc or a rectangle, and the mirror sharp or blunt. Compared are means of what is reflected (direct light is exact). Their
/// errors: n photons that land know it by 1/√n; unsmoothed points of `path` are independent, so their mean's error is a
/// twentieth of a point's; `gather` is `path` on blunt metal, as nothing here is diffuse, and counts photons on sharp metal.
/// 4.5 σ, and 1 % for the photon density's bias beside the panel's foot.
#[test]
fn rays_and_photons_agree_on_rough_metal() {
    for (name, lamp) in
        [("point", ""), ("disc", "opening = { disc = 0.3 }"), ("square", "opening = { rectangle = [0.6, 0.6] }")]
    {
        for roughness in [0.1, 0.4] {
            let scene = panel(name, roughness, lamp);
            let run = |method, passes| {
                let settings = Settings::for_plan(&Plan::new(&scene, method));
                let settings = Settings { stop: Stop::after(passes), smooth: false, seed: 5, ..settings };
                let results = run_with(&scene, method, &settings);
                (mean(&results.maps[0]), claim(&results.maps[0]), results)
            };
            let (split, _, results) = run(Method::Split, 3);
            let direct = results.maps[0].direct.as_ref().expect("split knows direct light");
            let direct = direct.iter().sum::<f64>() / direct.len() as f64;
            let reflected = split - direct;
            assert!(reflected > 0.02 * direct, "the panel must matter");
            // Error of a mean of which `photons` photons tell `lux`, as a share of what is reflected.
            let counted =
                |lux: f64, photons: f64| (lux * 4.0 / 5000.0 * photons).sqrt() / (reflected * 4.0 / 5000.0 * photons);
            for (method, passes) in [(Method::Gather, 8), (Method::Path, 16), (Method::Photons, 2)] {
                let (found, claim, _) = run(method, passes);
                let sigma = match method {
                    Method::Photons => counted(direct + reflected, 2e6),
                    Method::Gather if roughness < 0.2 => counted(reflected, 8e6),
                    _ => claim * found / 20.0 / reflected,
                };
                let bound = 4.5 * sigma.hypot(counted(reflected, 3e6)) + 0.01;
                assert_close(&format!("{name} {roughness} {}", method.name()), found - direct, reflected, bound);
                assert!(bound < 0.35, "the test must be able to fail");
            }
        }
    }
}

/// Helmholtz, with a rough mirror and a sheet in the light's way: lamp and meter swapped, the meter reads the same.
#[test]
fn lamp_and_meter_change_places_beside_rough_mirrors_and_sheets() {
    let obj = with_faces(
        &room([0.0; 3], [4.0, 3.0, 2.5], ["floor", "ceiling", "wall", "dark", "wall", "wall"]),
        8,
        &[
            ("metal", [[0.5, 2.9, 0.2], [2.5, 2.9, 0.2], [2.5, 2.9, 2.0], [0.5, 2.9, 2.0]]),
            ("sheet", [[1.9, 0.2, 0.2], [2.1, 2.4, 0.2], [2.1, 2.4, 2.2], [1.9, 0.2, 2.2]]),
        ],
    );
    let ends = [([0.4, 0.7, 0.3], [0.6, 0.0, 0.8]), ([3.1, 2.2, 2.1], [-0.8, 0.0, -0.6])];
    let reading = |lamp: ([f64; 3], [f64; 3]), meter: ([f64; 3], [f64; 3]), test: &str, method| {
        let toml = format!(
            "[material.floor]\nreflectance = 0.2\nspecular = 0.2\nroughness = 0.3\n[material.ceiling]\nreflectance = 0.8\n\
             [material.wall]\nreflectance = 0.6\n[material.dark]\nreflectance = 0.1\n\
             [material.metal]\nspecular = 0.9\nroughness = 0.35\n[material.sheet]\nreflectance = 0.3\ntransmittance = 0.5\n\
             [[luminaire]]\nname = \"lamp\"\nposition = {:?}\naim = {:?}\nopening = \"point\"\nphotometry = \"lambertian\"\nflux = 1000\n{}",
            lamp.0,
            lamp.1,
            sensor("meter", meter.0, meter.1)
        );
        let count = if method == Method::Path { 120 } else { 8 };
        passes(&scene(test, &toml, &obj), method, count, 11).sensors.remove(0)
    };
    for method in [Method::Gather, Method::Path, Method::Split] {
        let there = reading(ends[0], ends[1], "rough_there", method);
        let back = reading(ends[1], ends[0], "rough_back", method);
        let sigma = there.standard_error.hypot(back.standard_error);
        println!("{}: {} and {}, σ {sigma}", method.name(), there.illuminance, back.illuminance);
        assert!((there.illuminance - back.illuminance).abs() < 4.0 * sigma, "there and back differ by more than 4 σ");
        assert!(sigma < 0.03 * there.illuminance, "the comparison must be able to fail: σ = {sigma}");
    }
}

/// Under a sheet that a point source lights from above, E(y) = ∫ τ E(x)/π · cos θ cos θ′/r² dA, where E(x) is what arrives
/// on the sheet's upper side; above it, the same with ρ. The rest of the room is black. The integrals are sums over 400 × 400
/// cells, right to 10⁻⁴ here.
#[test]
fn a_sheet_shines_on_both_sides() {
    let (rho, tau, flux) = (0.3, 0.45, 5000.0);
    let obj = with_faces(
        &room([-2.0, -2.0, 0.0], [2.0, 2.0, 3.0], ["black"; 6]),
        8,
        &[("sheet", [[-0.8, -0.8, 1.2], [0.8, -0.8, 1.2], [0.8, 0.8, 1.2], [-0.8, 0.8, 1.2]])],
    );
    let meters = [("below", [0.1, 0.2, 0.0], [0.0, 0.0, 1.0]), ("above", [0.3, -0.2, 3.0], [0.0, 0.0, -1.0])];
    let toml = format!(
        "[material.black]\nreflectance = 0\n[material.sheet]\nreflectance = {rho}\ntransmittance = {tau}\n\
         [[luminaire]]\nname = \"lamp\"\nposition = [0, 0, 2]\nflux = {flux}\n"
    ) + &meters.map(|(name, position, normal)| sensor(name, position, normal)).concat();
    let scene = scene("sheet", &toml, &obj);
    let steps = 400;
    let cell = |i: usize| -0.8 + 1.6 * (i as f64 + 0.5) / steps as f64;
    let expected = |share: f64, [x, y, z]: [f64; 3]| {
        let mut sum = 0.0;
        for (a, b) in (0..steps * steps).map(|i| (cell(i % steps), cell(i / steps))) {
            let arriving = flux / (4.0 * PI) * 0.8 / (a * a + b * b + 0.64).powf(1.5);
            let squared = (a - x).powi(2) + (b - y).powi(2) + (z - 1.2).powi(2);
            sum += share * arriving / PI * (z - 1.2).powi(2) / (squared * squared);
        }
        sum * (1.6 / steps as f64).powi(2)
    };
    let direct = |[x, y, z]: [f64; 3]| flux / (4.0 * PI) * (z - 2.0) / (x * x + y * y + (z - 2.0).powi(2)).powf(1.5);
    let expected = [expected(tau, meters[0].1), expected(rho, meters[1].1) + direct(meters[1].1)];
    for method in ALL {
        for (reading, expected) in passes(&scene, method, 8, 2).sensors.iter().zip(expected) {
            let (found, sigma) = (reading.illuminance, reading.standard_error);
            println!("{} {}: {found} ± {sigma}, expected {expected}", method.name(), reading.name);
            assert!((found - expected).abs() < 4.5 * sigma + 1e-4 * expected, "{} {}", method.name(), reading.name);
            assert!(sigma < 0.06 * expected, "the test must be able to fail");
        }
    }
}

/// Two rooms with a sheet between them: in each, what arrives on its walls and its side of the sheet is what the lamp, the
/// walls and the two sides of the sheet send there. Exact, whatever the shapes: (1 − ρ) Φ_walls + (1 − ρ_s) Φ_here − τ Φ_there
/// is the lamp's flux in its room and nothing in the other. All fluxes are measured, over every face.
#[test]
fn flux_balances_on_both_sides_of_a_sheet() {
    let (rho, sheet_rho, tau, flux) = (0.6, 0.35, 0.4, 10_000.0);
    let (x, [dx, dy, dz]) = (1.7, [4.0, 3.0, 2.5]);
    let obj = room([0.0; 3], [dx, dy, dz], ["wall"; 6]);
    let sheet = [[x, 0.0, 0.0], [x, dy, 0.0], [x, dy, dz], [x, 0.0, dz]];
    let mut toml = format!(
        "[material.wall]\nreflectance = {rho}\n[material.sheet]\nreflectance = {sheet_rho}\ntransmittance = {tau}\n\
         [[luminaire]]\nname = \"lamp\"\nposition = [0.6, 1.2, 1.9]\nflux = {flux}\n"
    );
    // Every face of a room from x = a to b, seen from inside; the sheet's is the last.
    let mut faces = |a: f64, b: f64, sheet_at_b: bool| {
        let w = b - a;
        let ends = [([a, 0.0, 0.0], [0.0, dy, 0.0], [0.0, 0.0, dz]), ([b, 0.0, 0.0], [0.0, 0.0, dz], [0.0, dy, 0.0])];
        let [wall, sheet] = if sheet_at_b { ends } else { [ends[1], ends[0]] };
        let all = [
            ([a, 0.0, 0.0], [w, 0.0, 0.0], [0.0, dy, 0.0]),
            ([a, 0.0, dz], [0.0, dy, 0.0], [w, 0.0, 0.0]),
            ([a, 0.0, 0.0], [0.0, 0.0, dz], [w, 0.0, 0.0]),
            ([a, dy, 0.0], [w, 0.0, 0.0], [0.0, 0.0, dz]),
            wall,
            sheet,
        ];
        for (number, (corner, along, across)) in all.iter().enumerate() {
            toml += &format!(
                "[[plane]]\nname = \"{a} {number}\"\ncorner = {corner:?}\nalong = {along:?}\nacross = {across:?}\n\
                 cells = [24, 24]\non = \"surface\"\n"
            );
        }
    };
    faces(0.0, x, true);
    faces(x, dx, false);
    let scene = scene("two_rooms", &toml, &with_faces(&obj, 8, &[("sheet", sheet)]));
    let areas: Vec<f64> = scene.planes.iter().map(|plane| plane.along.cross(plane.across).length()).collect();
    for method in [Method::Gather, Method::Path, Method::Split] {
        let results = passes(&scene, method, 4, 8);
        let arriving = |plane: usize| mean(&results.maps[plane]) * areas[plane];
        let sigma = |plane: usize| claim(&results.maps[plane]) * arriving(plane);
        let walls = |first: usize| (first..first + 5).map(arriving).sum::<f64>();
        let error: f64 = (0..12).map(sigma).sum::<f64>();
        for (first, here, there, expected) in [(0, 5, 11, flux), (6, 11, 5, 0.0)] {
            let kept = (1.0 - rho) * walls(first) + (1.0 - sheet_rho) * arriving(here) - tau * arriving(there);
            println!("{}: {kept:.1} lm, expected {expected} ± {:.1}", method.name(), 0.5 * error);
            // The mean of a map is known better than its points are, but not by a factor that anyone promised. 24 cells
            // resolve E near the lamp to 0.2 %.
            assert!((kept - expected).abs() < 0.5 * error + 2e-3 * flux, "{}: {kept} lm", method.name());
            assert!(error < 0.06 * flux, "{}: the test must be able to fail: {error}", method.name());
        }
        assert!(walls(6) > 0.1 * walls(0), "light must get through");
    }
}

/// A one-sided wall is as good as a two-sided one from its front, to the bit, and as a black one from its back.
#[test]
fn one_sided_surfaces_are_black_behind() {
    let reading = |material: &str, face: &str| {
        let obj = format!("v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nusemtl panel\nf {face}\n");
        let toml = format!(
            "[material.panel]\n{material}\n[[luminaire]]\nname = \"lamp\"\nposition = [0, 0, 1]\nflux = 1000\n{}",
            sensor("meter", [0.5, 0.0, 1.5], [0.0, 0.0, -1.0])
        );
        let scene = scene(&format!("one_sided_{}_{}", material.len(), &face[..1]), &toml, &obj);
        [Method::Split, Method::Gather].map(|method| passes(&scene, method, 1, 1).sensors[0].illuminance)
    };
    for surface in ["reflectance = 0.8", "specular = 0.8", "specular = 0.8\nroughness = 0.3"] {
        let one = format!("{surface}\nsides = \"one\"");
        let (front, back) = (reading(&one, "1 2 3 4"), reading(&one, "4 3 2 1"));
        assert_eq!(front, reading(&format!("{surface}\nsides = \"two\""), "1 2 3 4"));
        assert_eq!(back, reading("reflectance = 0", "1 2 3 4"));
        assert!(front[0] > 1.02 * back[0] && front[1] > 1.02 * back[1], "{surface}: {front:?}, {back:?}");
    }
}

/// Coloured glass absorbs each channel by its own Beer–Lambert law: a slab of 0.2 m with [4, 1, 0]/m passes e^(−0.8), e^(−0.2)
/// and all of what a clear one does, at normal incidence but for second reflections inside (R² < 0.2 %). By photons from a
/// point, and by rays of `path` from a square.
#[test]
fn coloured_glass_absorbs_each_channel_by_its_own_law() {
    let obj: String = room([-3.0, -3.0, 0.4], [3.0, 3.0, 0.6], ["glass"; 6])
        .lines()
        .map(|line| match line.strip_prefix("f ") {
            Some(face) => format!("f {}\n", face.split(' ').rev().collect::<Vec<_>>().join(" ")),
            None => format!("{line}\n"),
        })
        .collect();
    for (method, opening, photons) in
        [(Method::Split, "", 4_000_000), (Method::Path, "opening = { rectangle = [1, 1] }", 1)]
    {
        let reading = |absorption: &str| {
            // The lamp's colour makes both runs coloured.
            let toml = format!(
                "[material.glass]\ndielectric = {{ ior = 1.5, absorption = {absorption} }}\n\
                 [[luminaire]]\nname = \"lamp\"\nposition = [0, 0, 4]\nflux = 1000\ncolor = [1, 1.1, 0.9]\n{opening}\n\
                 [[plane]]\nname = \"below\"\ncorner = [-0.3, -0.3, 0]\nalong = [0.6, 0, 0]\nacross = [0, 0.6, 0]\ncells = [12, 12]\non = \"air\"\n"
            );
            let scene = scene(&format!("colours_{}_{}", method.name(), absorption.len()), &toml, &obj);
            let settings = Settings { photons, rays: 512, seed: 6, ..Settings::of(method) };
            let results = run_with(&scene, method, &settings);
            let rgb = results.maps[0].rgb.clone().expect("a coloured scene");
            let mean = [0, 1, 2].map(|c| rgb.iter().map(|cell| cell[c]).sum::<f64>() / 144.0);
            (mean, claim(&results.maps[0]))
        };
        let ((clear, _), (tinted, noise)) = (reading("0"), reading("[4, 1, 0]"));
        for (channel, expected) in [-0.8_f64, -0.2, 0.0].map(f64::exp).into_iter().enumerate() {
            // Photons: 7500 on the plane and fewer by half with absorption; rays: 144 points of 512, of which one in 16 · π
            // meets the lamp: 1470.
            let count: f64 = if method == Method::Split { 7500.0 * 0.45 } else { 1470.0 };
            let bound = 4.0 * (2.0 / count).sqrt() + 2e-3;
            assert_close(
                &format!("{} channel {channel} (σ {noise})", method.name()),
                tinted[channel] / clear[channel],
                expected,
                bound,
            );
        }
    }
}

/// Materials draw from the photon's own stream, as all else does.
#[test]
fn threads_change_nothing() {
    let obj = with_faces(
        &room([0.0; 3], [3.0, 2.4, 2.5], ["floor", "plain", "metal", "plain", "plain", "fine"]),
        8,
        &[("sheet", [[1.0, 0.2, 0.3], [1.0, 1.3, 0.3], [1.0, 1.3, 1.9], [1.0, 0.2, 1.9]])],
    );
    let toml = "[material.floor]\nreflectance = [0.3, 0.2, 0.1]\nspecular = 0.2\nroughness = 0.3\n[material.plain]\nreflectance = 0.6\n\
                [material.metal]\nspecular = [0.9, 0.7, 0.4]\nroughness = 0.5\n[material.fine]\nspecular = 0.8\nroughness = 0.05\n\
                [material.sheet]\nreflectance = 0.3\ntransmittance = [0.2, 0.3, 0.6]\n\
                [[luminaire]]\nname = \"lamp\"\nposition = [0.6, 1.2, 1.9]\nopening = { disc = 0.2 }\nflux = 1000\n\
                [[plane]]\nname = \"floor\"\ncorner = [0,0,0]\nalong = [3,0,0]\nacross = [0,2.4,0]\ncells = [15,12]\non = \"surface\"\n";
    let scene = scene("material_threads", toml, &obj);
    for method in ALL {
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
            let results = pool
                .install(|| run_with(&scene, method, &Settings { photons: 30_000, seed: 5, ..Settings::of(method) }));
            let map = &results.maps[0];
            [map.illuminance.clone(), map.standard_error.clone()]
                .concat()
                .into_iter()
                .map(f64::to_bits)
                .collect::<Vec<_>>()
        };
        let one = on(1);
        assert!(one == on(2) && one == on(7), "{}: threads change the result", method.name());
    }
}
