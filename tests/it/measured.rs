//! Luminaires of photometric files, from the scene file to the map.

use std::f64::consts::PI;
use std::fmt::Write as _;

use crate::common::{assert_close, claim, mean, room, run, run_with, scene, sensor};
use glam::DVec3;
use luxmap::luminaire::web::Web;
use luxmap::render::Settings;
use luxmap::render::Stop;
use luxmap::render::plan::Method;
use luxmap::render::plan::Plan;
use luxmap::results::Results;
use luxmap::scene::Scene;

/// An LM-63-2002 file, absolute photometry: horizontal angles, vertical angles, the opening's width, length and height, cd.
fn ies(planes: &[f64], angles: &[f64], opening: [f64; 3], candela: impl Fn(f64, f64) -> f64) -> String {
    let [width, length, height] = opening;
    let mut text = format!(
        "IESNA:LM-63-2002\n[TEST] none\n[TESTLAB] none\n[ISSUEDATE] none\n[MANUFAC] none\nTILT=NONE\n1 -1 1 {} {} 1 2 {width} {length} {height}\n1 1 10\n",
        angles.len(),
        planes.len()
    );
    let mut row = |numbers: &mut dyn Iterator<Item = f64>| {
        numbers.for_each(|number| writeln!(text, "{number}").expect("a string takes all"));
    };
    row(&mut angles.iter().copied());
    row(&mut planes.iter().copied());
    for &c in planes {
        row(&mut angles.iter().map(|&g| candela(c.to_radians(), g.to_radians())));
    }
    text
}

/// A distribution without symmetry: light down, less up, most towards C 60°.
fn lopsided(c: f64, g: f64) -> f64 {
    300.0 + 200.0 * g.cos() + 150.0 * g.sin() * (c - PI / 3.0).cos()
}

fn whole_turns(step: usize, upto: usize) -> Vec<f64> {
    (0..=upto).step_by(step).map(|c| c as f64).collect()
}

/// The scene of a test with its photometric file.
fn with_file(test: &str, file: &str, toml: &str, obj: &str) -> Scene {
    std::fs::write(crate::common::folder(test).join("lamp.ies"), file).expect("the target folder is writable");
    scene(test, toml, obj)
}

/// Intensity, cd, of C and γ, rad.
type Candela = fn(f64, f64) -> f64;

/// Every symmetry that a file can have, every opening that its three numbers can mean: E = I(C, γ) cos/d² at 40 m. The
/// front of a body of 0.1 m is up to 0.05 m nearer, 0.25 % more light at most (half of it in truth); a flat opening's angle of
/// 0.3° rounds the table's kinks, 0.05 % of it; its place is 10⁻⁵ of the scene's half size off.
#[test]
fn far_from_it_a_file_gives_its_own_intensities() {
    let angles = whole_turns(5, 180);
    let symmetries: [(&str, Vec<f64>, Candela); 4] = [
        ("rotational", vec![0.0], |_, g| 300.0 + 250.0 * g.cos()),
        ("quadrants", whole_turns(15, 90), |c, g| 300.0 + 200.0 * g.cos() + 90.0 * g.sin() * (2.0 * c).cos()),
        ("halves", whole_turns(15, 180), |c, g| 300.0 + 200.0 * g.cos() + 90.0 * g.sin() * c.cos()),
        ("none", whole_turns(15, 360), lopsided),
    ];
    let openings = [
        ("point", [0.0, 0.0, 0.0]),
        ("rectangle", [0.1, 0.2, 0.0]),
        ("disc", [-0.2, -0.2, 0.0]),
        ("ellipse", [-0.1, -0.2, 0.0]),
        ("box", [0.1, 0.2, 0.05]),
        ("cylinder", [-0.2, -0.2, 0.1]),
        ("tube", [-0.05, 0.2, -0.05]),
        ("sphere", [-0.2, -0.2, -0.2]),
    ];
    let places: Vec<[f64; 2]> = [0.0, 45.0, 90.0, 135.0, 180.0, 240.0, 315.0]
        .into_iter()
        .flat_map(|c| [0.0, 30.0, 75.0, 90.0, 105.0, 160.0, 180.0].map(|g| [c, g]))
        .collect();
    for (symmetry, planes, candela) in &symmetries {
        for (form, opening) in openings {
            let mut toml =
                String::from("[[luminaire]]\nname = \"L\"\nposition = [1, 2, 3]\nphotometry = \"lamp.ies\"\n");
            for (i, [c, g]) in places.iter().enumerate() {
                let (c, g) = (c.to_radians(), g.to_radians());
                let direction = DVec3::new(g.sin() * c.cos(), g.sin() * c.sin(), -g.cos());
                let at = DVec3::new(1.0, 2.0, 3.0) + direction * 40.0;
                toml += &sensor(&format!("{i}"), at.to_array(), (-direction).to_array());
            }
            let test = format!("measured_far_{symmetry}_{form}");
            let scene = with_file(&test, &ies(planes, &angles, opening, candela), &toml, "");
            let found = run(&scene, Method::Split, 1, 0);
            for ([c, g], found) in places.iter().zip(&found.sensors) {
                let expected = candela(c.to_radians(), g.to_radians()) / 1600.0;
                let off = found.illuminance / expected - 1.0;
                assert!(off.abs() < 5e-3, "{symmetry}, {form}, C {c} γ {g}: {} not {expected}", found.illuminance);
            }
        }
    }
}

const FLOOR: &str = "[[plane]]\nname = \"floor\"\ncorner = [0, 0, 0]\nalong = [4, 0, 0]\nacross = [0, 4, 0]\ncells = [20, 20]\non = \"surface\"\n";

fn lamp(more: &str) -> String {
    format!("[[luminaire]]\nname = \"L\"\nposition = [2, 2, 2.5]\nphotometry = \"lamp.ies\"\n{more}")
}

/// A luminaire turned by a quarter turns its map by a quarter: seen from above it turns counter-clockwise, so what was at +x
/// comes to +y, and (x, y) to (−y, x). Positions are single precision.
#[test]
fn turning_the_luminaire_turns_its_light() {
    let file = ies(&whole_turns(15, 360), &whole_turns(5, 180), [0.3, 0.6, 0.0], lopsided);
    let map = |name: &str, more: &str| {
        let toml = format!("[material.black]\nreflectance = 0\n{}{FLOOR}", lamp(more));
        let scene = with_file(name, &file, &toml, &room([0.0; 3], [4.0, 4.0, 3.0], ["black"; 6]));
        run(&scene, Method::Split, 1, 0).maps.remove(0).illuminance
    };
    let (straight, turned) = (map("measured_turn_0", ""), map("measured_turn_90", "rotation = 90\n"));
    let mut different = false;
    for (row, column) in (0..20).flat_map(|row| (0..20).map(move |column| (row, column))) {
        let (here, there) = (straight[row * 20 + column], turned[column * 20 + 19 - row]);
        assert!((there / here - 1.0).abs() < 1e-4, "cell {column}, {row}: {here} lx, turned {there} lx");
        different |= (turned[row * 20 + column] / here - 1.0).abs() > 0.05;
    }
    assert!(different, "the distribution has no symmetry");
}

/// Six planes on the inner faces of a room from the origin to 4 × 4 × 3 m.
fn six_planes(cells: usize) -> String {
    let faces = [
        ("floor", [0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]),
        ("ceiling", [0.0, 0.0, 3.0], [0.0, 4.0, 0.0], [4.0, 0.0, 0.0]),
        ("x low", [0.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 3.0]),
        ("x high", [4.0, 0.0, 0.0], [0.0, 0.0, 3.0], [0.0, 4.0, 0.0]),
        ("y low", [0.0, 0.0, 0.0], [0.0, 0.0, 3.0], [4.0, 0.0, 0.0]),
        ("y high", [0.0, 4.0, 0.0], [4.0, 0.0, 0.0], [0.0, 0.0, 3.0]),
    ];
    let plane = |(name, corner, along, across): (&str, [f64; 3], [f64; 3], [f64; 3])| {
        format!(
            "[[plane]]\nname = \"{name}\"\ncorner = {corner:?}\nalong = {along:?}\nacross = {across:?}\ncells = [{cells}, {cells}]\non = \"surface\"\n"
        )
    };
    faces.map(plane).concat()
}

const OPENINGS: [(&str, &str); 5] = [
    ("rectangle", "opening = { rectangle = [0.6, 0.3] }\n"),
    ("box", "opening = { box = [0.6, 0.3, 0.1] }\n"),
    ("tube", "opening = { tube = [1.2, 0.04] }\n"),
    ("sphere", "opening = { sphere = 0.4 }\n"),
    ("point", "opening = \"point\"\n"),
];

/// All flux of the file arrives on the walls of a closed black room, ΣE A = Φ: by exact direct light (midpoint rule on cells
/// of 7.5 to 10 cm: 0.2 %, see case 5.4 of `cie171.rs`; polygons for bodies) and by photons, whose count is Φ by construction
/// and whose density leaves 0.5 %. Every point has the same light both ways, within the photons' claim; 2400 points of which
/// one in 15,000 would exceed 4 σ, were each claim that of its own cell.
#[test]
fn all_light_of_a_file_arrives() {
    let (planes, angles) = (whole_turns(15, 360), whole_turns(5, 180));
    let file = ies(&planes, &angles, [0.0; 3], lopsided);
    for (form, opening) in OPENINGS {
        let toml = format!(
            "[material.black]\nreflectance = 0\n[[luminaire]]\nname = \"L\"\nposition = [2, 2, 1.6]\naim = [0.3, 0, -1]\nphotometry = \"lamp.ies\"\n{opening}{}",
            six_planes(40)
        );
        let scene =
            with_file(&format!("measured_flux_{form}"), &file, &toml, &room([0.0; 3], [4.0, 4.0, 3.0], ["black"; 6]));
        let flux = scene.luminaires[0].flux.0;
        let web = scene.luminaires[0].measured().expect("measured").web();
        assert_close("flux of the table", flux, web.flux(), 1e-12);
        let total = |results: &Results| -> f64 {
            results.maps.iter().map(|map| mean(map) * map.along.length() * map.across.length()).sum()
        };
        let split = run(&scene, Method::Split, 400_000, 1);
        assert_close(&format!("{form}, direct"), total(&split), flux, 4e-3);
        let photons = run(&scene, Method::Photons, 400_000, 1);
        assert_close(&format!("{form}, photons"), total(&photons), flux, 5e-3);
        for (a, b) in split.maps.iter().zip(&photons.maps) {
            let (mut far, mut square, mut claimed) = (0, 0.0, 0.0);
            for i in 0..a.illuminance.len() {
                let off = a.illuminance[i] - b.illuminance[i];
                far += usize::from(off.abs() > 4.0 * b.standard_error[i] + 1e-3 * a.illuminance[i]);
                square += off * off;
                claimed += b.standard_error[i].powi(2);
            }
            println!("{form} {}: error / claim {:.3}, {far} beyond 4 σ", a.name, (square / claimed).sqrt());
            assert!(far <= 24, "{form} {}: {far} of 1600 cells beyond 4 σ", a.name);
        }
    }
}

/// A room with a mirror for a wall shows the luminaire: `gather` meets it with rays through the mirror, `split` has photons
/// that came by the mirror, `path` knows no photons. The means agree within what is claimed of a single cell, and within 2 %;
/// what `path` claims is wide, as it meets small lamps by chance. Bodies shine sideways into it.
#[test]
fn a_mirror_shows_the_luminaire_to_every_method() {
    let file = ies(&whole_turns(15, 360), &whole_turns(5, 180), [0.0; 3], lopsided);
    for (form, opening) in &OPENINGS[..4] {
        let toml = format!(
            "[material.wall]\nreflectance = 0.4\n[material.mirror]\nreflectance = 0\nspecular = 0.9\n{}{FLOOR}",
            lamp(opening)
        );
        let obj = room([0.0; 3], [4.0, 4.0, 3.0], ["wall", "wall", "mirror", "wall", "wall", "wall"]);
        let scene = with_file(&format!("measured_mirror_{form}"), &file, &toml, &obj);
        let of = |method: Method| {
            let settings = Settings::for_plan(&Plan::new(&scene, method));
            let settings = Settings { stop: Stop::after(4), smooth: true, seed: 3, ..settings };
            run_with(&scene, method, &settings).maps.remove(0)
        };
        let [gather, split, path] = [Method::Gather, Method::Split, Method::Path].map(of);
        for (a, b) in [(&gather, &split), (&gather, &path)] {
            let claims = claim(a).hypot(claim(b));
            let off = mean(a) - mean(b);
            println!("{form}: means {:.2} and {:.2} lx, claims {claims:.3} lx", mean(a), mean(b));
            assert!(
                off.abs() < claims.min(0.02 * mean(a)) && claims < 0.3 * mean(a),
                "{form}: off by {off}, claims {claims}"
            );
        }
    }
}

/// Same seed, same bits, for 1 and 2 threads, with all kinds of openings at once.
#[test]
fn measured_luminaires_give_the_same_bits_on_any_number_of_threads() {
    let file = ies(&whole_turns(15, 360), &whole_turns(5, 180), [0.0; 3], lopsided);
    let lamps: String = OPENINGS
        .iter()
        .enumerate()
        .map(|(i, (name, opening))| {
            format!(
                "[[luminaire]]\nname = \"{name}\"\nposition = [{}, 2, 2.5]\nphotometry = \"lamp.ies\"\n{opening}",
                0.5 + 0.7 * i as f64
            )
        })
        .collect();
    let toml = format!("[material.wall]\nreflectance = 0.5\nspecular = 0.2\n{lamps}{FLOOR}");
    let scene = with_file("measured_threads", &file, &toml, &room([0.0; 3], [4.0, 4.0, 3.0], ["wall"; 6]));
    for method in [Method::Gather, Method::Photons] {
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
            pool.install(|| run(&scene, method, 20_000, 5).maps.remove(0))
        };
        let (one, two) = (on(1), on(2));
        assert!(one.illuminance == two.illuminance && one.standard_error == two.standard_error, "{}", method.name());
    }
}

/// `flux` scales the file, `dimming` scales both, `opening` overrides the file's, an array shares one table, the plan names
/// the file, and its bytes are part of the scene's hash.
#[test]
fn a_scene_file_says_what_becomes_of_a_photometric_file() {
    let file = ies(&[0.0], &[0.0, 45.0, 90.0], [-0.2, -0.2, 0.0], |_, g| 100.0 * g.cos());
    let load = |name: &str, file: &str, more: &str| with_file(name, file, &format!("{}{FLOOR}", lamp(more)), "");
    let plain = load("measured_file", &file, "");
    let table = luxmap::luminaire::photometry::Photometry::parse("lamp.ies".as_ref(), file.as_bytes()).expect("a file");
    let flux = Web::new(table.intensity).expect("light").flux();
    assert_close("the file's flux", plain.luminaires[0].flux.0, flux, 1e-12);
    let scaled = load("measured_file", &file, "flux = 1000\ndimming = 0.25\nopening = { box = [0.2, 0.1, 0.05] }\n");
    assert_close("scaled", scaled.luminaires[0].flux.0, 250.0, 1e-12);
    assert!(plain.hash != scaled.hash);
    let other = ies(&[0.0], &[0.0, 45.0, 90.0], [-0.2, -0.2, 0.0], |_, g| 101.0 * g.cos());
    assert!(load("measured_file", &other, "").hash != plain.hash, "the file's bytes are part of the hash");
    let many = load("measured_file", &file, "array = { count = [20, 10], pitch = [1, 1] }\n");
    let web = |i: usize| std::ptr::from_ref(many.luminaires[i].measured().expect("measured").web());
    assert!((0..200).all(|i| web(i) == web(0)), "one table for all");
    let plan = Plan::new(&many, Method::Gather).to_string();
    assert!(plan.contains("measured photometry") && plan.contains("lamp.ies (LM-63-2002): 200 luminaires"), "{plan}");
}
