//! Influence, and levels that reach what is asked for: light adds up, and the least power is the least.

use std::f64::consts::PI;

use crate::common::files::Folder;
use crate::common::{room, scene, sensor};
use luxmap::dimming::influence::{Dimmable, SensorRow, tell_apart};
use luxmap::dimming::sure::{Known, Readings, solve_surely, verify};
use luxmap::dimming::{Goal, Influence, solve};
use luxmap::luminaire::Supply;
use luxmap::random::{Seed, Stream};
use luxmap::render::plan::{Method, Plan};
use luxmap::render::{Settings, Stop, render};
use luxmap::results::Results;
use luxmap::results::met::sigmas;
use luxmap::scene::Levels;
use luxmap::scene::{Dimming, Scene};
use proptest::prelude::*;

/// A room with a mirror, four lamps in two groups, one of them dimmed, two desks and a face.
fn office(test: &str) -> Scene {
    let lamp = |name: &str, x: f64, y: f64, more: &str| {
        format!(
            "[[luminaire]]\nname = \"{name}\"\nposition = [{x}, {y}, 2.4]\nopening = {{ disc = 0.2 }}\nflux = 1500\n\
             group = \"row {y}\"\n{more}"
        )
    };
    let toml = [
        "[material.wall]\nreflectance = 0.6\n[material.end]\nreflectance = 0.2\nspecular = 0.5\n".to_owned(),
        lamp("a", 1.0, 1.0, "dimming = 0.5\n"),
        lamp("b", 3.0, 1.0, ""),
        lamp("c", 1.0, 2.0, "dimming = 0\n"),
        lamp("d", 3.0, 2.0, ""),
        sensor("left", [0.8, 1.2, 0.75], [0.0, 0.0, 1.0]),
        sensor("right", [3.1, 1.8, 0.75], [0.0, 0.0, 1.0]) + "disc = 0.2\n",
        sensor("wall", [2.0, 0.1, 1.2], [0.0, 1.0, 0.0]),
    ];
    let mesh = room([0.0; 3], [4.0, 3.0, 2.5], ["wall", "wall", "wall", "end", "wall", "wall"]);
    scene(test, &toml.concat(), &mesh)
}

fn settings(seed: u64) -> Settings {
    Settings { photons: 100_000, stop: Stop::after(2), seed, ..Settings::of(Method::Gather) }
}

fn run(scene: &Scene, settings: &Settings) -> Results {
    render(scene, &Plan::new(scene, Method::Gather), settings, &()).unwrap_or_else(|error| panic!("{error}"))
}

fn influence(test: &str) -> (Scene, Influence) {
    let file = office(test).file;
    let mut scene = Scene::load_with(&file, &[], &Dimming::Full).unwrap_or_else(|error| panic!("{error}"));
    let groups = tell_apart(&mut scene);
    assert_eq!(groups, ["row 1", "row 1", "row 2", "row 2"]);
    let results = run(&scene, &Settings { groups: true, ..settings(1) });
    let influence = Influence::of(&scene, groups, &results);
    // The parts are the whole, to the rounding of single precision, in which they are kept.
    for (row, reading) in influence.lux.iter().zip(&results.sensors) {
        let sum: f64 = row.iter().sum();
        assert!((sum / reading.illuminance - 1.0).abs() < 1e-5, "{sum} lx, {} lx", reading.illuminance);
    }
    (scene, influence)
}

fn at_levels(scene: &Scene, levels: &[(&str, f64)], seed: u64) -> Results {
    let levels = Levels::new(levels.iter().map(|(name, level)| ((*name).to_owned(), *level)));
    let dimmed = Scene::load_with(&scene.file, &[], &Dimming::Levels(levels)).unwrap_or_else(|error| panic!("{error}"));
    run(&dimmed, &settings(seed))
}

/// 4 σ of what two runs of other seeds claim: of some 15 comparisons one in a thousand tests would fail, had it been written
/// for another seed.
fn assert_agree(what: &str, found: [f64; 2], expected: [f64; 2]) {
    let bound = 4.0 * found[1].hypot(expected[1]) + 1e-9;
    let off = (found[0] - expected[0]).abs();
    assert!(off <= bound, "{what}: {} ± {}, expected {} ± {}", found[0], found[1], expected[0], expected[1]);
    // The claim is of use.
    assert!(bound < 0.2 * expected[0].max(5.0), "{what}: {bound} of {}", expected[0]);
}

#[test]
fn columns_are_renders_with_one_luminaire_on() {
    let (scene, influence) = influence("one-on");
    for (column, luminaire) in influence.luminaires.iter().enumerate() {
        let level = |other: &luxmap::dimming::influence::Dimmable| f64::from(u8::from(other.name == luminaire.name));
        let levels: Vec<_> = influence.luminaires.iter().map(|other| (other.name.as_str(), level(other))).collect();
        let alone = at_levels(&scene, &levels, 2 + column as u64);
        for (row, reading) in alone.sensors.iter().enumerate() {
            let found = [influence.lux[row][column], influence.standard_error[row][column]];
            let what = format!("{} at {}", luminaire.name, reading.name);
            assert_agree(&what, found, [reading.illuminance, reading.standard_error]);
        }
    }
}

#[test]
fn levels_times_influence_is_a_render_with_them() {
    let (scene, influence) = influence("levels");
    let levels = [("a", 0.3), ("b", 0.0), ("c", 1.0), ("d", 0.75)];
    let dimmed = at_levels(&scene, &levels, 9);
    for (row, reading) in dimmed.sensors.iter().enumerate() {
        let shares = levels.map(|(_, level)| level);
        let found = influence.illuminance(row, &shares);
        // Errors of a row at worst point the same way.
        let error: f64 = influence.standard_error[row].iter().zip(shares).map(|(error, level)| error * level).sum();
        assert_agree(&reading.name, [found, error], [reading.illuminance, reading.standard_error]);
    }
    // As the scene file has them: a at half, c off.
    assert_eq!(influence.levels(), [1.0; 4], "at full output, as they were computed");
    let written = run(&office("levels"), &settings(10));
    for (row, reading) in written.sensors.iter().enumerate() {
        let found = influence.illuminance(row, &[0.5, 1.0, 0.0, 1.0]);
        let error: f64 = influence.standard_error[row].iter().sum();
        assert_agree(&reading.name, [found, error], [reading.illuminance, reading.standard_error]);
    }
}

/// Lux per candela times candela is lux; a flat Lambertian lamp has Φ/π along its aim.
#[test]
fn candelas_are_those_along_the_aim() {
    let (_, influence) = influence("candela");
    for luminaire in &influence.luminaires {
        let candela = luminaire.candela.expect("it shines along its aim");
        assert!((candela / (luminaire.flux / PI) - 1.0).abs() < 1e-12, "{candela} cd");
    }
}

/// Mean over a disc of radius R, h below a point lamp of intensity I: 2 I / R² (1 − h / √(h² + R²)). The seven points take
/// polynomials up to degree 5 exactly; what follows in R/h = 0.25 is (R/h)⁶ times a small number.
#[test]
fn a_disc_reads_its_mean() {
    let (height, radius, flux) = (2.0_f64, 0.5, 4.0 * PI * 1000.0);
    let toml = format!(
        "[[luminaire]]\nname = \"lamp\"\nposition = [0, 0, {height}]\nflux = {flux}\n{}disc = {}\n",
        sensor("disc", [0.0; 3], [0.0, 0.0, 1.0]),
        2.0 * radius
    );
    let results = run(&scene("disc", &toml, ""), &settings(0));
    let expected = 2000.0 / (radius * radius) * (1.0 - height / height.hypot(radius));
    let found = results.sensors[0].illuminance;
    assert!((found / expected - 1.0).abs() < (radius / height).powi(6), "{found} lx, expected {expected} lx");
    assert!(found < 0.97 * 1000.0 / (height * height), "the middle alone would read 250 lx");
}

/// Lamps and sensors of which only the matrix is known.
fn matrix(lux: Vec<Vec<f64>>, supplies: Vec<Supply>, asked: &[(f64, Option<f64>)]) -> Influence {
    let luminaires = supplies.into_iter().enumerate().map(|(number, supply)| Dimmable {
        name: format!("L{number}"),
        group: "all".into(),
        flux: 1000.0,
        candela: None,
        supply,
    });
    let sensors = asked.iter().enumerate().map(|(number, (target, tolerance))| SensorRow {
        name: format!("desk {number}"),
        position: [0.0; 3],
        normal: [0.0, 0.0, 1.0],
        target: Some(*target),
        tolerance: *tolerance,
        daylight: 10.0,
    });
    Influence {
        scene: "matrix".into(),
        scene_sha256: String::new(),
        luminaires: luminaires.collect(),
        sensors: sensors.collect(),
        standard_error: vec![vec![0.0; lux[0].len()]; lux.len()],
        lux,
    }
}

fn supply(least: f64, off: f64, power: &[[f64; 2]]) -> Supply {
    Supply { level: 1.0, least, off, power: Some(power.to_vec()) }
}

/// Every combination of `steps` levels of three lamps, off among them.
fn grid(influence: &Influence, steps: u32) -> impl Iterator<Item = Vec<f64>> {
    let of = |lamp: usize| -> Vec<f64> {
        let least = influence.luminaires[lamp].supply.least;
        let on = (0..=steps).map(|step| least + (1.0 - least) * f64::from(step) / f64::from(steps));
        std::iter::once(0.0).chain(on).collect()
    };
    let [a, b, c] = [of(0), of(1), of(2)];
    a.into_iter().flat_map(move |a| {
        let c = c.clone();
        b.clone().into_iter().flat_map(move |b| c.clone().into_iter().map(move |c| vec![a, b, c]))
    })
}

fn is_met(influence: &Influence, levels: &[f64], slack: f64) -> bool {
    (0..influence.sensors.len()).all(|sensor| {
        let place = &influence.sensors[sensor];
        let (found, target) = (influence.illuminance(sensor, levels), place.target.expect("each has one"));
        let most = place.tolerance.map_or(f64::INFINITY, |tolerance| target + tolerance);
        found >= target * (1.0 - slack) && found <= most * (1.0 + slack)
    })
}

fn is_possible(influence: &Influence, levels: &[f64]) -> bool {
    levels
        .iter()
        .zip(&influence.luminaires)
        .all(|(level, luminaire)| *level == 0.0 || (luminaire.supply.least - 1e-9..=1.0 + 1e-9).contains(level))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(7), ..ProptestConfig::default() })]

    /// Against every combination of 24 levels: nothing on the grid that meets all targets draws less, and what is found meets
    /// them. A target that the grid meets is never given up. Supplies: steplessly, with a gap, and bent the wrong way.
    #[test]
    fn nothing_on_a_grid_is_better(
        entries in proptest::collection::vec(20.0..400.0_f64, 6),
        targets in proptest::collection::vec(100.0..600.0_f64, 2),
        narrow in proptest::bool::ANY,
    ) {
        let supplies = vec![
            supply(0.0, 0.0, &[[0.0, 0.0], [1.0, 30.0]]),
            supply(0.2, 0.5, &[[0.2, 9.0], [1.0, 28.0]]),
            supply(0.1, 1.0, &[[0.1, 8.0], [0.5, 22.0], [1.0, 30.0]]),
        ];
        let tolerance = narrow.then_some(60.0);
        let asked = [(targets[0], tolerance), (targets[1], None)];
        let influence = matrix(vec![entries[..3].to_vec(), entries[3..].to_vec()], supplies, &asked);
        let answer = solve(&influence, Goal::LeastPower).expect("a problem");
        prop_assert!(is_possible(&influence, &answer.levels), "{:?}", answer.levels);
        let best = grid(&influence, 24)
            .filter(|levels| is_met(&influence, levels, 0.0))
            .map(|levels| influence.power(&levels))
            .fold(f64::INFINITY, f64::min);
        if answer.missed.is_empty() {
            prop_assert!(is_met(&influence, &answer.levels, 1e-5), "{:?}", answer);
            prop_assert!(answer.power <= best + 1e-4, "{} W, grid {} W", answer.power, best);
            prop_assert!(answer.bound.is_some_and(|bound| (answer.power - bound).abs() < 1e-9));
        } else {
            prop_assert!(best.is_infinite(), "the grid meets all with {} W: {:?}", best, answer);
            for missed in &answer.missed {
                let full = influence.illuminance(missed.sensor, &[1.0; 3]);
                prop_assert!((missed.most - full).abs() < 1e-9);
            }
        }
        // As close as can be: no grid point is closer.
        let apart = |levels: &[f64]| -> f64 {
            (0..2).map(|sensor| (influence.illuminance(sensor, levels) - targets[sensor]).powi(2)).sum()
        };
        let closest = solve(&influence, Goal::Closest).expect("a problem");
        prop_assert!(is_possible(&influence, &closest.levels), "{:?}", closest.levels);
        let on_grid = grid(&influence, 24).map(|levels| apart(&levels)).fold(f64::INFINITY, f64::min);
        // Power breaks ties at no more than 1e-4 of the squared targets.
        let ties = 1.1e-4 * targets.iter().map(|target| target * target).sum::<f64>();
        prop_assert!(apart(&closest.levels) <= on_grid + ties, "{} lx², grid {} lx²", apart(&closest.levels), on_grid);
    }
}

/// One lamp for two desks: 100 lx and at most 200 lx cannot both be had where one desk gets thrice the other's light.
#[test]
fn targets_that_contradict_each_other_are_named() {
    let lamp = || supply(0.0, 0.0, &[[0.0, 0.0], [1.0, 30.0]]);
    let asked = [(310.0, None), (110.0, Some(40.0))];
    let influence = matrix(vec![vec![300.0], vec![250.0]], vec![lamp()], &asked);
    let answer = solve(&influence, Goal::LeastPower).expect("a problem");
    assert!(!answer.missed.is_empty() && answer.missed.iter().all(|missed| missed.sensor < 2), "{answer:?}");
    // 310 lx is what full output and daylight give: asked for alone, it is met to the last.
    let alone = matrix(vec![vec![300.0]], vec![lamp()], &asked[..1]);
    let answer = solve(&alone, Goal::LeastPower).expect("a problem");
    assert!(answer.missed.is_empty() && (answer.levels[0] - 1.0).abs() < 1e-6, "{answer:?}");
    let more = matrix(vec![vec![300.0]], vec![lamp()], &[(311.0, None)]);
    let answer = solve(&more, Goal::LeastPower).expect("a problem");
    assert_eq!(answer.missed.len(), 1, "{answer:?}");
    assert!((answer.missed[0].most - 310.0).abs() < 1e-9 && (answer.levels[0] - 1.0).abs() < 1e-5);
}

const SCENE: &str = "[[mesh]]\nfile = \"room.obj\"\n[material.wall]\nreflectance = 0.5\n[[luminaire]]\nname = \"L\"\n\
                     position = [1, 1.5, 2.2]\nopening = { disc = 0.3 }\nflux = 3000\npower = 30\nstandby = 0.5\n\
                     dimming_min = 0.1\narray = { count = [2, 1], pitch = [2, 0] }\n[[plane]]\nname = \"desk\"\n\
                     corner = [0, 0, 0.75]\nalong = [4, 0, 0]\nacross = [0, 3, 0]\ncells = [16, 12]\non = \"air\"\n\
                     [[sensor]]\nname = \"left\"\nposition = [0.8, 1.5, 0.75]\nnormal = [0, 0, 1]\ntarget = 300\n\
                     [[sensor]]\nname = \"right\"\nposition = [3, 1.2, 0.75]\nnormal = [0, 0, 1]\ndaylight = 50\n\
                     array = { count = [1, 2], pitch = [0, 0.6] }\n";

fn place(test: &str) -> Folder {
    let folder = Folder::new("dimming", test);
    folder.write("room.obj", &room([0.0; 3], [4.0, 3.0, 2.5], ["wall"; 6]));
    folder.write("room.toml", SCENE);
    folder
}

/// The commands, as a user calls them: the file of levels goes back into `render`, and the desk has what it asked for.
#[test]
fn dim_finds_levels_that_render_confirms() {
    let folder = place("commands");
    folder.succeed(&["influence", "room.toml", "-o", "influence", "-q"]);
    let csv = std::fs::read_to_string(folder.path("influence/influence.csv")).expect("a table");
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("sensor,\"L[1,1]\",\"L[2,1]\""));
    assert_eq!(lines.clone().count(), 3);
    let matrix = Influence::read(&folder.path("influence/influence.json")).unwrap_or_else(|error| panic!("{error}"));
    for (line, row) in lines.zip(&matrix.lux) {
        let numbers: Vec<f64> = line.rsplit(',').take(2).map(|number| number.parse().expect("a number")).collect();
        assert_eq!([numbers[1], numbers[0]], [row[0], row[1]]);
    }
    let npy = std::fs::read(folder.path("influence/influence.npy")).expect("an array");
    let last = f64::from_le_bytes(npy[npy.len() - 8..].try_into().expect("eight bytes"));
    assert_eq!(last, matrix.lux[2][1]);

    let said =
        folder.succeed(&["dim", "room.toml", "-o", "dim", "-q", "--influence", "influence/influence.json", "--json"]);
    let found: serde_json::Value = serde_json::from_str(&said).expect("JSON");
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    let (power, full) = (number(&found["power"]), number(&found["power_full"]));
    assert_eq!((full, found["power_unit"].as_str()), (60.0, Some("W")));
    assert!(power > 0.5 && power < full, "{power} W");
    // By a margin: what is known of it, and the noise of a render, each at most 2.5 σ of 1 %.
    let sensor = &found["sensors"][0];
    let lux = number(&sensor["lux"]);
    assert!((300.0..315.0).contains(&lux) && sensor["verdict"] == "met", "{sensor}");
    let (verified, error) = (number(&sensor["verified"]), number(&sensor["verified_stderr"]));
    assert!((verified - lux).abs() < 4.0 * error.hypot(number(&sensor["stderr"])), "{verified} ± {error} lx");
    let bare = number(&found["power_without_margin"]);
    assert!(bare < power && power < 1.05 * bare, "{bare} W, with the margin {power} W");

    let seed = found["renders"].to_string();
    folder.succeed(&["render", "room.toml", "-o", "again", "-q", "--dimming", "dim/dimming.json", "--seed", &seed]);
    let read = |path: &str| -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(folder.path(path)).expect("a summary")).expect("JSON")
    };
    assert_eq!(
        read("again/summary.json")["sensors"],
        read("dim/summary.json")["sensors"],
        "the same levels, the same bits"
    );
}

/// What is promised: renders with other seeds find every target reached, as surely as was asked. Nine checks at 99.9 %: one in
/// a hundred tests would fail, had it been written for other seeds. The desk's target goes without daylight, the other's with it.
#[test]
fn levels_hold_in_renders_with_other_seeds() {
    let folder = place("seeds");
    let asked = SCENE.replace("daylight = 50", "daylight = 50\ntarget = 320\ntolerance = 60");
    folder.write("room.toml", &asked);
    for seed in ["1", "2", "3"] {
        let out = format!("dim-{seed}");
        folder.succeed(&["dim", "room.toml", "-o", &out, "-q", "--seed", seed, "--confidence", "99.9"]);
        for check in 0..3 {
            let (levels, check) = (format!("{out}/dimming.json"), format!("{seed}0{check}"));
            folder.succeed(&[
                "render",
                "room.toml",
                "-o",
                "check",
                "-q",
                "--dimming",
                &levels,
                "--check",
                "--seed",
                &check,
            ]);
        }
    }
    // No levels give a desk more than all luminaires do: it is named, and the exit code says so.
    folder.write("room.toml", &SCENE.replace("target = 300", "target = 3000"));
    let output = folder.luxmap(&["dim", "room.toml", "-o", "beyond", "-q"]);
    let (said, complaint) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(
        complaint.contains("sensor \"left\": target 3000 lx is not met") && complaint.lines().count() == 1,
        "{complaint}"
    );
    assert!(said.contains("missed") && !said.contains("saved"), "{said}");
}

/// A normal deviate of a test's own stream (Box and Muller).
fn normal(stream: &mut Stream) -> f64 {
    let [radius, turn] = [stream.uniform(), stream.uniform()].map(f64::from);
    (-2.0 * (1.0 - radius).ln()).sqrt() * (2.0 * PI * turn).cos()
}

/// The promise over many rooms: a matrix with errors of 2 %, renders with 1 %, and further renders that check. The share of those
/// that find every target reached is 95 % or more; of 300 it is lower than 91 % by chance in one of a thousand tests. Without the
/// margin, each of two desks that get no more than they must is below its target in every other render.
#[test]
fn the_margin_covers_what_is_not_known() {
    let truth = vec![vec![300.0, 120.0, 40.0], vec![60.0, 150.0, 250.0]];
    let supplies = || (0..3).map(|_| supply(0.0, 0.0, &[[0.0, 0.0], [1.0, 30.0]])).collect::<Vec<_>>();
    let asked = [(350.0, None), (330.0, Some(100.0))];
    let exact = matrix(truth.clone(), supplies(), &asked);
    let z = sigmas(0.95, 2);
    let (mut held, mut bare_held, mut cost) = (0, 0, 0.0);
    for trial in 0..300 {
        let mut stream = Seed(trial).stream(0);
        let mut found = exact.clone();
        for (row, errors) in found.lux.iter_mut().zip(&mut found.standard_error) {
            for (lux, error) in row.iter_mut().zip(errors) {
                *error = 0.02 * *lux;
                *lux += *error * normal(&mut stream);
            }
        }
        let read = |levels: &[f64], stream: &mut Stream| -> Vec<Option<(f64, f64)>> {
            let of = |sensor: usize| {
                let light = exact.illuminance(sensor, levels) - exact.sensors[sensor].daylight;
                Some((light * (1.0 + 0.01 * normal(stream)), 0.01 * light))
            };
            (0..2).map(of).collect()
        };
        let mut known = Known::new(&found);
        let sure = solve_surely(&known, Goal::LeastPower, z).expect("a problem");
        let mut render = |levels: &[f64], _: u64| Ok(Readings { of: read(levels, &mut stream), go_on: true });
        let (sure, renders) = verify(&mut known, Goal::LeastPower, z, sure, &mut render).expect("no error");
        assert!((1..=6).contains(&renders));
        let mut check = |levels: &[f64]| {
            let reading = read(levels, &mut stream);
            (0..2).all(|sensor| reading[sensor].expect("a value").0 + 10.0 >= asked[sensor].0)
        };
        held += u32::from(check(&sure.answer.levels));
        bare_held += u32::from(check(&solve(&found, Goal::LeastPower).expect("a problem").levels));
        cost += (sure.answer.power / solve(&exact, Goal::LeastPower).expect("a problem").power - 1.0) / 300.0;
    }
    println!("targets held in {held} of 300, without a margin in {bare_held}; margin {:.1} %", 100.0 * cost);
    assert!(held >= 273, "{held} of 300");
    assert!(bare_held < 150, "{bare_held} of 300 without a margin");
    // At most z times both errors, 2 % and 1 %, doubled.
    assert!(cost < 2.0 * z * 0.03, "{cost}");
}

#[test]
fn bad_input_is_one_line() {
    let folder = place("refused");
    for (file, text, message) in [
        (
            "levels.json",
            "{\n\"dimming\": {\n\"L[1,2]\": 0.5}}",
            "levels.json:3: found luminaire \"L[1,2]\", expected one of",
        ),
        (
            "levels.json",
            "{\"dimming\": {\"L[1,1]\": 1.5}}",
            "levels.json:1: found \"L[1,1]\": 1.5, expected a level from 0",
        ),
        (
            "levels.json",
            "{\"dimming\": {\"L[1,1]\": \"half\"}}",
            "levels.json:1: found \"L[1,1]\": \"half\", expected a level",
        ),
        ("levels.json", "{\"levels\": {}}", "levels.json: found no \"dimming\" with levels in it"),
        ("levels.json", "{\n\"dimming\": ", "levels.json:2: found no JSON ("),
    ] {
        folder.write(file, text);
        let found = folder.refused(&["render", "room.toml", "--dimming", file]);
        assert!(found.contains(message), "{found}");
    }
    for (from, to, message) in [
        ("dimming_min = 0.1", "dimming_min = 1", "found dimming_min = 1 in [[luminaire]], expected the lowest level"),
        ("power = 30", "power = [[0.1, 5], [0.9, 30]]", "expected the power at full output, W, or [level, W] pairs"),
        (
            "power = 30",
            "power = [[0.5, 5], [0.2, 6], [1, 30]]",
            "expected the power at full output, W, or [level, W] pairs",
        ),
        ("power = 30\n", "", "found standby without power, expected power too"),
        ("dimming_min = 0.1", "dimming_min = 0.1\ndimming = 2", "found dimming = 2 in [[luminaire]]"),
        ("target = 300", "tolerance = 30", "expected tolerance beside target only"),
        ("target = 300", "target = 300\ndisc = 0", "expected a diameter above 0"),
        ("daylight = 50", "daylight = -1", "found daylight = -1 in [[sensor]]"),
        ("count = [1, 2]", "count = [2000, 2000]", "expected at most 100000"),
    ] {
        folder.write("bad.toml", &SCENE.replace(from, to));
        let found = folder.refused(&["dim", "bad.toml"]);
        assert!(found.starts_with("luxmap: bad.toml:") && found.contains(message), "{found}");
    }
    // A desk under the floor asks for light that never comes.
    folder.write("bad.toml", &SCENE.replace("position = [0.8, 1.5, 0.75]", "position = [0.8, 1.5, -1]"));
    let found = folder.refused(&["dim", "bad.toml", "-q"]);
    assert!(found.contains("sensor \"left\": found target = 300 where no luminaire's light arrives"), "{found}");
    let found = folder.refused(&["dim", "room.toml", "-q", "--confidence", "100"]);
    assert!(found.contains("expected 50 % to 99.9999 %"), "{found}");
    folder.write("bad.toml", &SCENE.replace("target = 300\n", ""));
    let found = folder.refused(&["dim", "bad.toml", "-q"]);
    assert!(found.contains("found no target, expected a [[sensor]] with target = 500 (lx)"), "{found}");
}
