//! Light on surfaces of any form, on cylinders and spheres, and on the areas that standards name.

use std::f64::consts::PI;
use std::fmt::Write as _;

use crate::common::{assert_close, room, run, run_with, scene};
use glam::DVec3;
use luxmap::render::Settings;
use luxmap::render::plan::Method;
use luxmap::results::{Results, SurfaceMap};

/// 10,000 lm to all sides.
const LAMP: &str = "[[luminaire]]\nname = \"lamp\"\nflux = 10000\nposition = ";

fn centre(map: &SurfaceMap, sample: usize) -> DVec3 {
    map.corners[sample].iter().sum::<DVec3>() / 3.0
}

fn normal(map: &SurfaceMap, sample: usize) -> DVec3 {
    let [a, b, c] = map.corners[sample];
    (b - a).cross(c - a).normalize()
}

/// A sphere of radius 1 as OBJ: an octahedron whose faces are cut into n² and pushed out to the sphere; seen from inside.
fn sphere(n: u32) -> String {
    let mut obj = String::from("g ball\nusemtl wall\n");
    for octant in 0..8 {
        let sign = |axis: u32| if octant >> axis & 1 == 1 { -1.0 } else { 1.0 };
        let corner = |i: u32, j: u32| {
            let k = n - i - j;
            (DVec3::new(f64::from(i), f64::from(j), f64::from(k)) * DVec3::new(sign(0), sign(1), sign(2))).normalize()
        };
        let mut face = |corners: [DVec3; 3]| {
            let [a, b, c] = corners;
            let outward = (b - a).cross(c - a).dot(a) > 0.0;
            for p in if outward { [a, c, b] } else { [a, b, c] } {
                writeln!(obj, "v {} {} {}", p.x, p.y, p.z).expect("a string takes all");
            }
            obj.push_str("f -3 -2 -1\n");
        };
        for i in 0..n {
            for j in 0..n - i {
                face([corner(i, j), corner(i + 1, j), corner(i, j + 1)]);
                if i + j + 2 <= n {
                    face([corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)]);
                }
            }
        }
    }
    obj
}

/// A black sphere about a point source: every sample has E = I cos θ/d² (rounding: single precision at 1 m), which is I/r²
/// within what facets seen under a half angle δ < 0.13 can be off, 1/cos³ δ; and Σ E A is the lamp's flux. Samples are at
/// most 0.05 m wide, so that the midpoint rule is off by less than ½ · 0.05² · max |E''|/E = 3 · 0.05² / 2.
#[test]
fn a_sphere_about_a_point_source_is_evenly_lit() {
    let toml = format!(
        "{LAMP}[0, 0, 0]\n[[surface]]\nname = \"ball\"\ngroup = \"ball\"\nspacing = 0.05\n[material.wall]\nreflectance = 0\n"
    );
    let results = run(&scene("sphere_about_a_lamp", &toml, &sphere(10)), Method::Gather, 1000, 0);
    let map = &results.surfaces[0];
    let intensity = 10_000.0 / (4.0 * PI);
    for sample in 0..map.corners.len() {
        let at = centre(map, sample);
        let expected = intensity * -normal(map, sample).dot(at) / at.length().powi(3);
        assert!(
            (map.illuminance[sample] / expected - 1.0).abs() < 1e-5,
            "{} lx, {expected} lx",
            map.illuminance[sample]
        );
        assert!((map.illuminance[sample] / intensity - 1.0).abs() < 1.0 / 0.13_f64.cos().powi(3) - 1.0);
    }
    assert_close("flux", map.figures().flux.0, 10_000.0, 1.5 * 0.05 * 0.05);
    assert!(map.corners.len() > 4 * 800 && map.has_value.iter().all(|has| *has));
}

/// Seen from behind the same sphere is dark, and no light can arrive there; a tilted face reads E = I cos θ/d².
#[test]
fn each_face_has_two_sides() {
    let toml = format!(
        "{LAMP}[0, 0, 0]\n[[surface]]\nname = \"back\"\nmaterial = \"wall\"\nspacing = 0.2\nside = \"back\"\n[material.wall]\nreflectance = 0.5\n"
    );
    let results = run(&scene("sphere_from_behind", &toml, &sphere(4)), Method::Gather, 10_000, 0);
    assert!(results.surfaces[0].has_value.iter().all(|has| !has));
    assert!(results.run.warnings.iter().any(|warning| warning.contains("no light can arrive at any sample")));

    let quad = "v 1 -0.5 -0.5\nv 1 0.5 -0.5\nv 1.8 0.5 0.5\nv 1.8 -0.5 0.5\nusemtl wall\nf 1 2 3 4\n";
    for (side, lit) in [("front", false), ("back", true)] {
        let toml = format!(
            "{LAMP}[0, 0, 0]\n[[surface]]\nname = \"s\"\nmaterial = \"wall\"\nspacing = 0.1\nside = \"{side}\"\n[material.wall]\nreflectance = 0.5\n"
        );
        let results = run(&scene(&format!("tilted_{side}"), &toml, quad), Method::Gather, 10_000, 0);
        let map = &results.surfaces[0];
        for sample in 0..map.corners.len() {
            let at = centre(map, sample);
            let cosine = -normal(map, sample).dot(at) / at.length();
            let expected = 10_000.0 / (4.0 * PI) * cosine.max(0.0) / at.length_squared();
            assert_eq!(expected > 0.0, lit, "{side}");
            assert!((map.illuminance[sample] - expected).abs() <= 1e-5 * expected, "{side}: {expected}");
        }
    }
}

const BOX: [f64; 3] = [4.0, 4.0, 3.0];

fn closed_room(test: &str, reflectance: f64, more: &str) -> luxmap::scene::Scene {
    let toml = format!(
        "{LAMP}[2, 2, 1.5]\n[[surface]]\nname = \"all\"\nmaterial = \"wall\"\nspacing = 0.2\n\
         [material.wall]\nreflectance = {reflectance}\n{more}"
    );
    scene(test, &toml, &room([0.0; 3], BOX, ["wall"; 6]))
}

/// CIE 171:2006, 5.4: in a black room Σ E A = Φ. The midpoint rule on samples of 0.2 m, 1.5 m away, is off by less than
/// 0.2² · 3/1.5²/12, as E'' ≤ 3 E/h² for a triangle of second moment ≤ 0.2²/6 along any direction, halved.
#[test]
fn a_black_rooms_walls_receive_all_flux() {
    let results = run(&closed_room("black_room", 0.0, ""), Method::Gather, 1000, 0);
    let found = results.surfaces[0].figures();
    assert_close("area", found.area, 80.0, 1e-6);
    assert_close("flux", found.flux.0, 10_000.0, 0.04 * 3.0 / 2.25 / 12.0);
}

/// Σ E A = Φ/(1 − ρ) in a closed room, by every method. N photons land N/(1 − ρ) times, with variance ρ/(1 − ρ)² a photon;
/// rays: the claims of independent samples; `gather` has the photons' own luck on top.
#[test]
fn a_closed_room_multiplies_its_flux() {
    let scene = closed_room("bright_room", 0.5, "");
    for (method, photons) in [
        (Method::Photons, 200_000),
        (Method::Split, 200_000),
        (Method::Seed, 200_000),
        (Method::Gather, 200_000),
        (Method::Path, 1),
    ] {
        let results = run(&scene, method, photons, 3);
        let map = &results.surfaces[0];
        let of_samples: f64 =
            map.standard_error.iter().enumerate().map(|(s, sigma)| (sigma * map.area(s)).powi(2)).sum::<f64>().sqrt();
        let of_photons = if method == Method::Path { 0.0 } else { (0.5_f64 / 0.25 / 200_000.0).sqrt() / 2.0 };
        let bound = 4.0 * (of_samples / 20_000.0).hypot(of_photons) + 0.04 * 3.0 / 2.25 / 12.0;
        assert_close(method.name(), map.figures().flux.0, 20_000.0, bound);
        assert!(bound < 0.02, "{bound}");
    }
}

/// A wall measured as surface and as plane: the same light. Both means are over independent noise, as path without
/// smoothing has it, and midpoint rules of 0.1 m, 1.5 m from the lamp.
#[test]
fn a_wall_reads_alike_as_surface_and_as_plane() {
    let toml = format!(
        "{LAMP}[2, 1.5, 2]\n[[surface]]\nname = \"wall\"\nmaterial = \"measured\"\nspacing = 0.1\n\
         [[plane]]\nname = \"plane\"\ncorner = [0, 0, 0]\nalong = [0, 0, 3]\nacross = [4, 0, 0]\ncells = [30, 40]\n\
         [material.wall]\nreflectance = 0.6\n[material.measured]\nreflectance = 0.3\n"
    );
    let obj = room([0.0; 3], BOX, ["wall", "wall", "wall", "wall", "measured", "wall"]);
    let settings = Settings { smooth: false, rays: 64, seed: 5, ..Settings::of(Method::Path) };
    let results = run_with(&scene("wall_twice", &toml, &obj), Method::Path, &settings);
    let (surface, plane) = (&results.surfaces[0], &results.maps[0]);
    assert!((normal(surface, 0) - DVec3::Y).length() < 1e-6);
    let squares = |errors: &[f64]| errors.iter().map(|sigma| sigma * sigma).sum::<f64>();
    let (n, m) = (surface.corners.len() as f64, plane.illuminance.len() as f64);
    let noise = (squares(&surface.standard_error) / (n * n) + squares(&plane.standard_error) / (m * m)).sqrt();
    let bound = 4.0 * noise / crate::common::mean(plane) + 0.01 * 3.0 / 2.25 / 12.0;
    assert!(bound < 0.01);
    assert_close("mean", surface.figures().mean.0, crate::common::mean(plane), bound);
}

/// The four bodies at `at`, cylinders about z, the half cylinder and the dome looking to +x.
fn bodies(at: [f64; 3]) -> String {
    let sensor = |name: &str, more: &str| {
        format!("[[sensor]]\nname = \"{name}\"\nposition = {at:?}\nmeasure = \"{name}\"\n{more}\n")
    };
    [
        sensor("cylindrical", ""),
        sensor("semicylindrical", "facing = [1, 0, 0]"),
        sensor("hemispherical", "normal = [1, 0, 0]"),
        sensor("spherical", ""),
    ]
    .concat()
}

/// A point source of intensity I at distance d, at the angle ε to the axis, azimuth α from the facing direction:
/// E_z = I sin ε/(π d²), E_sz = I sin ε (1 + cos α)/(π d²) (EN 13201-3), E_hs = I (1 + cos θ)/(4 d²), E_o = I/(4 d²).
/// Direct light is the mean of many flat cells: 2.1·10⁻⁴ of E_z, 7·10⁻⁴ of E_o at most.
#[test]
fn bodies_read_a_point_source_by_their_closed_forms() {
    for (i, lamp) in [[1.0, 0.0, 1.0], [-2.0, 0.3, 1.5], [0.2, 1.0, 3.0], [0.0, -1.0, -0.7]].into_iter().enumerate() {
        let results = run(
            &scene(&format!("bodies_{i}"), &format!("{LAMP}{lamp:?}\n{}", bodies([0.0; 3])), ""),
            Method::Gather,
            1,
            0,
        );
        let to = DVec3::from(lamp);
        let e0 = 10_000.0 / (4.0 * PI) / to.length_squared();
        let towards = to.normalize();
        let sine = towards.truncate().length();
        let cos_alpha = towards.x / sine;
        let cylinder = e0 * sine / PI;
        let expected = [
            (cylinder, 2.1e-4 * cylinder),
            (cylinder * (1.0 + cos_alpha), 2.1e-4 * cylinder),
            (e0 * (1.0 + towards.x) / 4.0, 7e-4 * e0 / 4.0),
            (e0 / 4.0, 7e-4 * e0 / 4.0),
        ];
        for (reading, (lux, most)) in results.sensors.iter().zip(expected) {
            let off = (reading.illuminance - lux).abs();
            assert!(off <= most + 1e-6 * lux, "{}: {} lx, expected {lux}", reading.name, reading.illuminance);
            assert!(off <= 6.0 * reading.standard_error + 1e-6 * lux, "claims {}", reading.standard_error);
        }
    }
}

/// In a closed room of even luminance, self-emission L₀ on walls of reflectance ρ, every body reads π L₀/(1 − ρ), whatever it
/// is, wherever it is, by every method; within the errors claimed.
#[test]
fn every_body_reads_the_same_in_a_furnace() {
    let toml = bodies([0.7, 0.9, 1.1]) + "[material.wall]\nreflectance = 0.5\n";
    let obj = format!("mtllib glow.mtl\n{}", room([0.0; 3], [2.0; 3], ["wall"; 6]));
    let folder = crate::common::folder("furnace_of_bodies");
    std::fs::write(folder.join("glow.mtl"), "newmtl wall\nKd 0.5 0.5 0.5\nKe 100 100 100\n").expect("writable");
    let scene = scene("furnace_of_bodies", &toml, &obj);
    let expected = PI * 100.0 / 0.5;
    for method in [Method::Gather, Method::Path, Method::Split, Method::Photons, Method::Seed] {
        let results = run(&scene, method, 400_000, 11);
        for reading in &results.sensors {
            let (lux, sigma) = (reading.illuminance, reading.standard_error);
            println!("{} {}: {lux:.2} ± {sigma:.2}, expected {expected:.2}", method.name(), reading.name);
            // Patches hold photons of their own, which sensors can't know of: 1/√N of the whole at most.
            let photons = if method == Method::Gather { expected / 400_000_f64.sqrt() } else { 0.0 };
            assert!((lux - expected).abs() < 4.0 * sigma.hypot(photons), "{}: {lux} ± {sigma}", reading.name);
            assert!(sigma < 0.05 * expected, "{}: {sigma}", reading.name);
        }
    }
}

/// Light by way of a mirror comes from the lamp's image, 2 m below it: what a half cylinder and a board overhead read on top
/// of direct light is the image's, within the photons' noise; bodies count within 0.2 m, over which E'' R²/8 ≤ 1 % of E.
#[test]
fn mirrored_light_reaches_surfaces_and_bodies() {
    let toml = format!(
        "{LAMP}[0, 0, 2]\n[material.mirror]\nspecular = 1.0\n[material.board]\nreflectance = 0\n\
         [[surface]]\nname = \"board\"\nmaterial = \"board\"\nspacing = 0.5\n\
         [[sensor]]\nname = \"s\"\nposition = [1, 0, 1.5]\nmeasure = \"semicylindrical\"\nfacing = [-1, 0, 0]\n"
    );
    let obj = "v -5 -5 0\nv 5 -5 0\nv 5 5 0\nv -5 5 0\nusemtl mirror\nf 1 2 3 4\n\
               v 0.5 -0.5 2.5\nv 0.5 0.5 2.5\nv 1.5 0.5 2.5\nv 1.5 -0.5 2.5\nusemtl board\nf 5 6 7 8\n";
    let scene = scene("mirrored_light", &toml, obj);
    let intensity = 10_000.0 / (4.0 * PI);
    for method in [Method::Gather, Method::Split, Method::Photons] {
        let results = run(&scene, method, 2_000_000, 2);
        let map = &results.surfaces[0];
        // The board faces down, so the lamp below it and its image both light it.
        let of = |sample: usize, lamp: f64| {
            let to = DVec3::new(0.0, 0.0, lamp) - centre(map, sample);
            intensity * normal(map, sample).dot(to).max(0.0) / to.length().powi(3)
        };
        let expected: f64 = (0..map.corners.len()).map(|s| map.area(s) * (of(s, 2.0) + of(s, -2.0))).sum();
        let noise: f64 =
            map.standard_error.iter().enumerate().map(|(s, e)| (e * map.area(s)).powi(2)).sum::<f64>().sqrt();
        assert!(noise > 0.0 && noise < 0.01 * expected);
        assert!((map.figures().flux.0 - expected).abs() < 4.0 * noise + 0.002 * expected, "{}", method.name());

        let of = |lamp: f64| {
            let to = DVec3::new(-1.0, 0.0, lamp - 1.5);
            intensity * 2.0 / (PI * to.length().powi(3))
        };
        let reading = &results.sensors[0];
        let (lux, expected) = (reading.illuminance, of(2.0) + of(-2.0));
        println!("{}: {lux:.2} ± {:.2}, expected {expected:.2}", method.name(), reading.standard_error);
        let blur = 0.01 * if method == Method::Photons { expected } else { of(-2.0) };
        assert!((lux - expected).abs() < 4.0 * reading.standard_error + blur, "{lux}, expected {expected}");
    }
}

fn bits(results: &Results) -> Vec<u64> {
    let of_surface = |map: &SurfaceMap| [map.illuminance.clone(), map.standard_error.clone()].concat();
    let sensors = results.sensors.iter().flat_map(|reading| [reading.illuminance, reading.standard_error]);
    results.surfaces.iter().flat_map(of_surface).chain(sensors).map(f64::to_bits).collect()
}

#[test]
fn one_and_two_threads_give_the_same_bits() {
    let scene = closed_room("bits_of_surfaces", 0.5, &bodies([1.0, 1.0, 1.2]));
    for method in [Method::Gather, Method::Split] {
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
            pool.install(|| bits(&run(&scene, method, 50_000, 1)))
        };
        assert!(on(1) == on(2), "{}: threads change the result", method.name());
    }
}

/// A factor of 0.8 leaves 0.8 of the light; a luminaire's own factor takes the scene's place. Photons are the same, so all
/// is to the rounding of single precision.
#[test]
fn maintenance_factors_scale_the_light() {
    let of = |name: &str, scenes: &str, own: &str| {
        let toml =
            format!("{scenes}{LAMP}[2, 2, 1.5]\n{own}{}[material.wall]\nreflectance = 0.5\n", bodies([1.0, 1.0, 1.0]));
        let toml = format!("{toml}[[mesh]]\nfile = \"mesh.obj\"\n");
        let folder = crate::common::folder(name);
        std::fs::write(folder.join("mesh.obj"), room([0.0; 3], BOX, ["wall"; 6])).expect("writable");
        std::fs::write(folder.join("scene.toml"), toml).expect("writable");
        let scene = luxmap::scene::Scene::load(&folder.join("scene.toml")).unwrap_or_else(|error| panic!("{error}"));
        let results = run(&scene, Method::Split, 20_000, 4);
        (results.sensors[0].illuminance, results.run.maintenance_factor)
    };
    let (new, none) = of("maintenance_new", "", "");
    let (by_scene, factor) = of("maintenance_scene", "maintenance_factor = 0.8\n", "");
    let (by_own, own) = of("maintenance_own", "maintenance_factor = 0.8\n", "maintenance_factor = 0.5\n");
    assert_eq!((none, factor, own), (None, Some([0.8; 2]), Some([0.5; 2])));
    assert_close("scene's", by_scene, 0.8 * new, 1e-6);
    assert_close("its own", by_own, 0.5 * new, 1e-6);
}

/// Faces are chosen by group, by object, by material, or by both: here by hand.
#[test]
fn surfaces_are_chosen_by_group_and_material() {
    let quad = |z: f64| format!("v 0 0 {z}\nv 1 0 {z}\nv 1 1 {z}\nv 0 1 {z}\nf -4 -3 -2 -1\n");
    let obj = format!(
        "o Table\ng top left\nusemtl oak\n{}usemtl steel\n{}g\n{}o Other thing\ng right\nusemtl oak\n{}",
        quad(0.0),
        quad(1.0),
        quad(2.0),
        quad(3.0)
    );
    let heights = |choice: &str| {
        let toml = format!(
            "{LAMP}[5, 5, 5]\n[material.oak]\nreflectance = 0.5\n[material.steel]\nreflectance = 0.5\n\
             [[surface]]\nname = \"s\"\nspacing = 1\n{choice}"
        );
        let scene = scene("surface_choice", &toml, &obj);
        let mut heights: Vec<f64> =
            scene.surfaces[0].samples.iter().map(|s| (s.centre() + scene.centre).z.round()).collect();
        heights.dedup();
        heights
    };
    assert_eq!(heights("group = \"top\"\n"), [0.0, 1.0]);
    assert_eq!(heights("group = \"left\"\n"), [0.0, 1.0]);
    assert_eq!(heights("group = \"Table\"\n"), [0.0, 1.0, 2.0]);
    assert_eq!(heights("group = \"Other thing\"\n"), [3.0]);
    assert_eq!(heights("material = \"oak\"\n"), [0.0, 3.0]);
    assert_eq!(heights("material = \"oak\"\ngroup = \"Table\"\n"), [0.0]);
}
