//! Sentences of physics, each with its closed form and a derived bound.

use std::f64::consts::PI;

use crate::common::assert_close;
use crate::common::mean;
use crate::common::room;
use crate::common::run;
use crate::common::run_with;
use crate::common::scene;
use crate::common::sensor;
use luxmap::photon_map::Tree;
use luxmap::render::Settings;
use luxmap::render::plan::Method;

/// Four times the distance to a small lamp, a sixteenth of the illuminance: exact but for single-precision positions.
#[test]
fn illuminance_falls_with_the_square_of_the_distance() {
    let sensors: String =
        [1.0, 2.0, 4.0, 8.0].map(|d| sensor(&format!("{d} m"), [0.0, 0.0, -d], [0.0, 0.0, 1.0])).concat();
    let toml = format!("[[luminaire]]\nname = \"lamp\"\nposition = [0, 0, 0]\nflux = 1000\n{sensors}");
    let results = run(&scene("inverse_square", &toml, ""), Method::Split, 1, 0);
    for (reading, d) in results.sensors.iter().zip([1.0, 2.0, 4.0, 8.0]) {
        assert_close(&reading.name, reading.illuminance, 1000.0 / (4.0 * PI * d * d), 1e-6);
    }
}

/// On the axis of a Lambertian disc, E = Φ/(π (r² + d²)), wherever the disc hangs and however it is tilted. In the middle
/// of the room its coordinates are small and the meter's are not: a shadow ray that ends on the disc must not take the
/// disc for an obstacle. Exact but for the 64 corners that stand for the circle (10⁻⁴ at r = 0.1 d).
#[test]
fn a_tilted_disc_in_the_middle_of_a_room_is_not_in_its_own_way() {
    let obj = format!("{}\n", room([0.0; 3], [4.0, 4.0, 4.0], ["black"; 6]));
    for (test, aim) in [[0.0, 0.0, -1.0], [0.3, 0.2, -0.9], [-0.7, 0.6, -1.0]].into_iter().enumerate() {
        for radius in [0.001, 0.05, 0.2] {
            let target = [2.0 - 2.0 * aim[0] / aim[2], 2.0 - 2.0 * aim[1] / aim[2], 0.0];
            let meter = sensor("meter", target, aim.map(|a: f64| -a));
            let toml = format!(
                "[material.black]\nreflectance = 0\n[[luminaire]]\nname = \"lamp\"\nposition = [2, 2, 2]\naim = {aim:?}\n\
                 opening = {{ disc = {} }}\nflux = 1000\n{meter}",
                2.0 * radius
            );
            let scene = scene(&format!("tilted_disc_{test}"), &toml, &obj);
            let squared = 4.0 * aim.map(|a| (a / aim[2]).powi(2)).iter().sum::<f64>();
            let found = run(&scene, Method::Split, 1, 0).sensors[0].illuminance;
            assert_close(&format!("{aim:?}, r = {radius}"), found, 1000.0 / (PI * (radius * radius + squared)), 1e-4);
        }
    }
}

/// An isotropic point source seen by photons alone: E = I cos θ/d² at every point of a plane in the air. Four in a
/// thousand million points may lie beyond 6 σ; the largest of 1600 must not.
#[test]
fn photons_alone_follow_the_inverse_square_law() {
    let toml = "[[luminaire]]\nname = \"lamp\"\nposition = [0, 0, 2]\nflux = 10000\n\
                [[plane]]\nname = \"plane\"\ncorner = [-1, -1, 0]\nalong = [2, 0, 0]\nacross = [0, 2, 0]\ncells = [40, 40]\non = \"air\"\n";
    let results = run(&scene("inverse_square_photons", toml, ""), Method::Photons, 2_000_000, 3);
    let map = &results.maps[0];
    let (mut exact, mut worst) = (0.0, 0.0_f64);
    for (index, (found, sigma)) in map.illuminance.iter().zip(&map.standard_error).enumerate() {
        let at = |i: usize| -1.0 + 2.0 * (i as f64 + 0.5) / 40.0;
        let (x, y) = (at(index % 40), at(index / 40));
        let expected = 10_000.0 / (4.0 * PI) * 2.0 / (x * x + y * y + 4.0).powf(1.5);
        exact += expected / 1600.0;
        worst = worst.max((found - expected).abs() / sigma);
    }
    // N photons cross with probability q, and count with relative error 1/√(qN).
    let crossing: f64 = exact * 4.0 / 10_000.0 * 2e6;
    assert_close("mean", mean(map), exact, 4.0 / crossing.sqrt());
    assert!(worst < 6.0, "worst point {worst} σ off");
}

/// A closed room of glowing walls settles at E = M/(1 − ρ) at every point, whatever its shape: corners and edges included,
/// where an uncorrected density estimate reads low. Points: within 6 σ of their own claim; mean: 0.5 %.
#[test]
fn a_closed_room_of_glowing_walls_settles_at_m_over_one_minus_rho() {
    let (luminance, rho) = (100.0 / PI, 0.5);
    let mtl = format!("newmtl glow\nKd {rho} {rho} {rho}\nKe {luminance} {luminance} {luminance}\n");
    std::fs::write(crate::common::folder("glowing").join("mesh.mtl"), mtl).expect("the target folder is writable");
    let obj = format!("mtllib mesh.mtl\n{}", room([0.0; 3], [6.0, 4.0, 2.7], ["glow"; 6]));
    let toml = "[[plane]]\nname = \"floor\"\ncorner = [0, 0, 0]\nalong = [6, 0, 0]\nacross = [0, 4, 0]\ncells = [60, 40]\non = \"surface\"\n\
                [[plane]]\nname = \"air\"\ncorner = [0, 0, 1]\nalong = [6, 0, 0]\nacross = [0, 4, 0]\ncells = [60, 40]\non = \"air\"\n";
    let scene = scene("glowing", toml, &obj);
    for method in [Method::Split, Method::Photons] {
        let results = run(&scene, method, 1_000_000, 7);
        for map in &results.maps {
            assert_close(&format!("{} {}", method.name(), map.name), mean(map), 200.0, 5e-3);
            for (point, (found, sigma)) in map.illuminance.iter().zip(&map.standard_error).enumerate() {
                assert!((found - 200.0).abs() < 6.0 * sigma, "{} point {point}: {found} ± {sigma}", map.name);
            }
        }
    }
}

/// The paper's estimator at its word, in the glowing room whose true answer is 200 lx everywhere. Counting the k-th photon
/// reads k/(k − 1) too high: with k = 10, 222.2 lx. Beside a wall, at distance a, the sphere holds what is left of the
/// floor's disc and a half disc of the wall: (1 − s/πR² + (1 − a²/R²)/2) · 200 lx, s the disc's segment beyond the wall.
///
/// Neighbouring points share photons. Middle: the mean over 24 m² rests on 280,000 photons in discs of 10, of which each
/// counts about once: 1 % is 5 σ. Edge: 13 discs of 2000 side by side: 4/√26000 = 2.5 %.
#[test]
fn the_papers_estimator_keeps_its_bias() {
    let luminance = 100.0 / PI;
    let mtl = format!("newmtl glow\nKd .5 .5 .5\nKe {luminance} {luminance} {luminance}\n");
    std::fs::write(crate::common::folder("seed_bias").join("mesh.mtl"), mtl).expect("the target folder is writable");
    let obj = format!("mtllib mesh.mtl\n{}", room([0.0; 3], [8.0, 6.0, 2.7], ["glow"; 6]));
    let distance = 0.05_f64;
    let toml = format!(
        "[[plane]]\nname = \"middle\"\ncorner = [1, 1, 0]\nalong = [6, 0, 0]\nacross = [0, 4, 0]\ncells = [120, 80]\non = \"surface\"\n\
         [[plane]]\nname = \"edge\"\ncorner = [1, 0, 0]\nalong = [6, 0, 0]\nacross = [0, {}, 0]\ncells = [120, 1]\non = \"surface\"\n",
        2.0 * distance
    );
    let scene = scene("seed_bias", &toml, &obj);
    // Any tree gives the same answer; the paper's own takes minutes for so many photons.
    let tree = Tree::Kiddo;
    let settings = Settings { photons: 1_000_000, nearest: Some(10), seed: 2, tree, ..Settings::of(Method::Seed) };
    let results = run_with(&scene, Method::Seed, &settings);
    assert_close("middle", mean(&results.maps[0]), 200.0 * 10.0 / 9.0, 1e-2);

    let k = 2000;
    let results = run_with(&scene, Method::Seed, &Settings { nearest: Some(k), ..settings });
    // Share of the sphere's cross-section πR² that surfaces fill, and the R at which they hold k photons.
    let filled = |r: f64| {
        let segment = r * r * (distance / r).acos() - distance * (r * r - distance * distance).sqrt();
        1.0 - segment / (PI * r * r) + 0.5 * (1.0 - (distance / r).powi(2))
    };
    let density = 200.0 / (results.run.flux.emitted.0 / 1e6);
    let (mut low, mut high) = (distance, 2.0);
    for _ in 0..60 {
        let r = 0.5 * (low + high);
        if density * filled(r) * PI * r * r < k as f64 { low = r } else { high = r }
    }
    assert!(filled(low) > 1.1, "the bias must stand out of the noise");
    assert_close("edge", mean(&results.maps[1]), 200.0 * filled(low), 4.0 / 26_000.0_f64.sqrt());
}

/// Swapping a Lambertian lamp and a meter changes nothing (Helmholtz), bounces, mirror and glass included.
#[test]
fn swapping_lamp_and_meter_changes_nothing() {
    let obj = format!(
        "{}usemtl mirror\nv .5 2.9 .2\nv 2.5 2.9 .2\nv 2.5 2.9 2\nv .5 2.9 2\nf 9 10 11 12\n\
         usemtl block\nv 1 .5 0\nv 1.2 .5 0\nv 1.2 2 1.5\nv 1 2 1.5\nf 13 14 15 16\n",
        room([0.0; 3], [4.0, 3.0, 2.5], ["floor", "ceiling", "wall", "dark", "wall", "wall"])
    );
    let ends = [([0.4, 0.7, 0.3], [0.6, 0.0, 0.8]), ([3.1, 2.2, 2.1], [-0.8, 0.0, -0.6])];
    let reading = |lamp: ([f64; 3], [f64; 3]), meter: ([f64; 3], [f64; 3]), test: &str| {
        let toml = format!(
            "[material.floor]\nreflectance = 0.3\n[material.ceiling]\nreflectance = 0.8\n[material.wall]\nreflectance = 0.6\n\
             [material.dark]\nreflectance = 0.1\n[material.mirror]\nspecular = 0.9\n[material.block]\nreflectance = 0.5\n\
             [[luminaire]]\nname = \"lamp\"\nposition = {:?}\naim = {:?}\nopening = \"point\"\nphotometry = \"lambertian\"\nflux = 1000\n{}",
            lamp.0,
            lamp.1,
            sensor("meter", meter.0, meter.1)
        );
        run(&scene(test, &toml, &obj), Method::Split, 9_000_000, 11).sensors.remove(0)
    };
    let (there, back) = (reading(ends[0], ends[1], "there"), reading(ends[1], ends[0], "back"));
    let sigma = there.standard_error.hypot(back.standard_error);
    println!("{} ± {}, {} ± {}", there.illuminance, there.standard_error, back.illuminance, back.standard_error);
    assert!((there.illuminance - back.illuminance).abs() < 4.0 * sigma, "there and back differ by more than 4 σ");
    assert!(sigma < 0.04 * there.illuminance, "the comparison must be able to fail: σ = {sigma}");
}

/// A mirror shows a second source at its image: under a meter that looks down from 3 m, a source at 1 m gives I/2², its
/// image I/4². The mirror is perfect and reaches 40 m, beyond which it would bring less than 10⁻³ of its light.
#[test]
fn a_mirror_shows_a_second_source() {
    let obj = "usemtl mirror\nv -20 -20 0\nv 20 -20 0\nv 20 20 0\nv -20 20 0\nf 1 2 3 4\n";
    let toml = "[material.mirror]\nspecular = 1.0\n[[luminaire]]\nname = \"lamp\"\nposition = [0, 0, 1]\nflux = 12566.37\n\
                [[plane]]\nname = \"above\"\ncorner = [-0.5, -0.5, 3]\nalong = [0, 1, 0]\nacross = [1, 0, 0]\ncells = [20, 20]\non = \"air\"\n";
    let results = run(&scene("mirror", toml, obj), Method::Split, 2_000_000, 4);
    let cell = |i: usize| -0.5 + (i as f64 + 0.5) / 20.0;
    let from = |h: f64| {
        (0..400)
            .map(|i| 1000.0 * h / (cell(i % 20).powi(2) + cell(i / 20).powi(2) + h * h).powf(1.5) / 400.0)
            .sum::<f64>()
    };
    let image = from(4.0);
    let reflected = 2e6 * image / 12566.37; // photons on the plane's 1 m², all of the image's
    let direct = results.maps[0].direct.as_ref().expect("split knows direct light");
    assert_close("direct", direct.iter().sum::<f64>() / 400.0, from(2.0), 1e-5);
    assert_close("by the mirror", mean(&results.maps[0]) - from(2.0), image, 4.0 / reflected.sqrt());
}

/// A glass slab between lamp and plane: Fresnel at both faces with all reflections between them passes
/// (1 − R)/(1 + R), and Snell brings the lamp nearer by t(1 − 1/n) for the middle rays. Flux through the plane within
/// polar angle θ: ∫ I T(θ) 2π sin θ dθ, and ray θ lands at x = (d − t) tan θ + t tan θ′: compared as the mean over a disc's
/// bounding square by the same formula, cell by cell.
#[test]
fn a_glass_slab_transmits_by_snell_and_fresnel() {
    let (n, thickness, height) = (1.5_f64, 0.2, 1.0);
    let obj = room([-30.0, -30.0, 0.4], [30.0, 30.0, 0.6], ["glass"; 6]);
    let outward = obj
        .lines()
        .map(|line| match line.strip_prefix("f ") {
            Some(face) => format!("f {}", face.split(' ').rev().collect::<Vec<_>>().join(" ")),
            None => line.to_owned(),
        })
        .collect::<Vec<_>>()
        .join("\n");
    let toml = "[material.glass]\ndielectric = { ior = 1.5 }\n[[luminaire]]\nname = \"lamp\"\nposition = [0, 0, 1]\nflux = 12566.37\n\
                [[plane]]\nname = \"below\"\ncorner = [-0.6, -0.6, 0]\nalong = [1.2, 0, 0]\nacross = [0, 1.2, 0]\ncells = [24, 24]\non = \"air\"\n";
    let results = run(&scene("slab", toml, &outward), Method::Split, 1_000_000, 9);
    let (angle_inside, position) = {
        let inside = move |theta: f64| (theta.sin() / n).asin();
        (inside, move |theta: f64| (height - thickness) * theta.tan() + thickness * inside(theta).tan())
    };
    let transmitted = |theta: f64| {
        let (cos, cos_in) = (theta.cos(), angle_inside(theta).cos());
        let through = |r: f64| (1.0 - r * r) / (1.0 + r * r);
        0.5 * (through((cos - n * cos_in) / (cos + n * cos_in)) + through((n * cos - cos_in) / (n * cos + cos_in)))
    };
    let expected_at = |x: f64| {
        let (mut low, mut high) = (0.0_f64, 1.5_f64);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if position(middle) < x { low = middle } else { high = middle }
        }
        let slope = (position(low + 1e-6) - position((low - 1e-6).max(0.0))) / (low + 1e-6 - (low - 1e-6).max(0.0));
        1000.0 * transmitted(low) * low.sin() / (x * slope)
    };
    let cell = |i: usize| -0.6 + 1.2 * (i as f64 + 0.5) / 24.0;
    let expected = (0..576).map(|i| expected_at(cell(i % 24).hypot(cell(i / 24)))).sum::<f64>() / 576.0;
    let photons = 1e6 * expected * 1.44 / 12566.37;
    assert_close("through the slab", mean(&results.maps[0]), expected, 4.0 / photons.sqrt());
    // Without Fresnel the plane would read 8 % more: the bound above is far below that.
    assert!(4.0 / photons.sqrt() < 0.02);
}

/// Glass absorbs by Beer–Lambert: a slab of 0.2 m with 2/m passes e^(−0.4) of what a clear one does, at normal incidence
/// but for the second and later reflections inside (R² < 0.2 %).
#[test]
fn glass_absorbs_exponentially() {
    let obj: String = room([-3.0, -3.0, 0.4], [3.0, 3.0, 0.6], ["glass"; 6])
        .lines()
        .map(|line| match line.strip_prefix("f ") {
            Some(face) => format!("f {}\n", face.split(' ').rev().collect::<Vec<_>>().join(" ")),
            None => format!("{line}\n"),
        })
        .collect();
    let reading = |absorption: f64| {
        let toml = format!(
            "[material.glass]\ndielectric = {{ ior = 1.5, absorption = {absorption} }}\n[[luminaire]]\nname = \"lamp\"\nposition = [0, 0, 4]\nflux = 1000\n\
             [[plane]]\nname = \"below\"\ncorner = [-0.3, -0.3, 0]\nalong = [0.6, 0, 0]\nacross = [0, 0.6, 0]\ncells = [12, 12]\non = \"air\"\n"
        );
        let results = run(&scene(&format!("beer_{absorption}"), &toml, &obj), Method::Split, 4_000_000, 6);
        (mean(&results.maps[0]), results.run.photons_stored as f64)
    };
    let ((clear, _), (tinted, _)) = (reading(0.0), reading(2.0));
    // Photons on 0.36 m² at 4 m: 4·10⁶ · 0.36/(4π · 15.2) = 7500, 5000 with absorption; and 0.2 % from above.
    assert_close("ratio", tinted / clear, (-0.4_f64).exp(), 4.0 * (1.0 / 7500.0 + 1.0 / 5000.0_f64).sqrt() + 2e-3);
}

/// At a fixed radius four times the photons halve the spread: the claimed error follows 1/√N, and so does the scatter of
/// the map about its smooth mean in the glowing room's middle.
#[test]
fn four_times_the_photons_halve_the_claimed_error() {
    let toml = "[material.wall]\nreflectance = 0.8\n[[luminaire]]\nname = \"source\"\nposition = [2, 2, 2]\nflux = 10000\n\
                [[plane]]\nname = \"floor\"\ncorner = [0, 0, 0]\nalong = [4, 0, 0]\nacross = [0, 4, 0]\ncells = [40, 40]\non = \"surface\"\n";
    let scene = scene("fixed_radius", toml, &room([0.0; 3], [4.0; 3], ["wall"; 6]));
    let claimed = |photons| {
        let settings =
            Settings { photons, nearest: Some(usize::MAX), radius: Some(0.3), ..Settings::of(Method::Split) };
        let map = run_with(&scene, Method::Split, &settings).maps.remove(0);
        map.standard_error.iter().sum::<f64>() / map.standard_error.len() as f64
    };
    // σ is itself estimated from about 10⁴ photons around each point: better than 1 % for the mean over the map.
    assert_close("σ(N)/σ(4N)", claimed(50_000) / claimed(200_000), 2.0, 0.02);
}
