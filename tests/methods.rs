//! Methods that find light that has bounced by rays from the points: right, in agreement, and honest about their error.

mod common;

use std::f64::consts::PI;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

use common::{mean, room, run_with, scene, sensor, shipped};
use luxmap::progress::Progress;
use luxmap::render::plan::{Method, Plan};
use luxmap::render::{Settings, Stop, render};
use luxmap::results::{IlluminanceMap, Results};
use luxmap::scene::Scene;

/// √(mean σ²) over the mean, %.
fn claim(map: &IlluminanceMap) -> f64 {
    let variance: Vec<f64> =
        map.standard_error.iter().zip(&map.has_value).filter(|(_, has)| **has).map(|(s, _)| s * s).collect();
    100.0 * (variance.iter().sum::<f64>() / variance.len() as f64).sqrt() / mean(map)
}

fn passes(scene: &Scene, method: Method, passes: u32, seed: u64) -> Results {
    let settings = Settings::for_plan(&Plan::new(scene, method));
    run_with(scene, method, &Settings { stop: Stop::after(passes), smooth: true, seed, ..settings })
}

/// A closed room of uniform ρ and a glowing ceiling, floor, walls: every point gets the same, E = M/(1 − ρ), whatever the
/// method and the place, next to edges and in corners too. Here ρ = 0.5 and M = π · 100 cd/m².
#[test]
fn a_glowing_room_is_evenly_lit_to_rays() {
    let mesh = room([0.0; 3], [3.0, 2.0, 2.5], ["glow"; 6]);
    let folder = common::folder("glow_rays");
    std::fs::write(folder.join("glow.mtl"), "newmtl glow\nKd 0.5 0.5 0.5\nKe 100 100 100\n").expect("writable");
    let planes = "[[plane]]\nname = \"floor\"\ncorner = [0,0,0]\nalong = [3,0,0]\nacross = [0,2,0]\ncells = [30,20]\n\
                  on = \"surface\"\n";
    let sensors = sensor("middle", [1.5, 1.0, 0.75], [0.0, 0.0, 1.0]);
    let scene = scene("glow_rays", &format!("{planes}{sensors}"), &format!("mtllib glow.mtl\n{mesh}"));
    let expected = 100.0 * PI / 0.5;
    for method in [Method::Gather, Method::Path] {
        let results = passes(&scene, method, 8, 3);
        let map = &results.maps[0];
        // 600 points that share photons; 4 standard errors of the claim, were all points one.
        common::assert_close(method.name(), mean(map), expected, 0.04 * claim(map));
        // So the error of each point, edges and corners included: a normal law exceeds 2.6 σ once in a hundred.
        let square: f64 = map.illuminance.iter().map(|e| (e - expected).powi(2)).sum();
        let rms = 100.0 * (square / 600.0).sqrt() / expected;
        assert!(rms < 2.6 * claim(map), "{}: RMS {rms} %, claimed {} %", method.name(), claim(map));
        let sensor = &results.sensors[0];
        assert!((sensor.illuminance - expected).abs() < 4.5 * sensor.standard_error, "{sensor:?}");
    }
}

/// Share of the cells whose difference is within `sigmas` of their common claim.
fn within(a: &IlluminanceMap, b: &IlluminanceMap, sigmas: f64) -> f64 {
    let (mut inside, mut count) = (0.0, 0.0);
    for cell in (0..a.illuminance.len()).filter(|&cell| a.has_value[cell] && b.has_value[cell]) {
        let sigma = a.standard_error[cell].hypot(b.standard_error[cell]);
        inside += f64::from(u8::from((a.illuminance[cell] - b.illuminance[cell]).abs() <= sigmas * sigma));
        count += 1.0;
    }
    inside / count
}

/// `gather`, `path` and `split` know nothing of each other's errors: they agree within their claims in a coloured room,
/// and means agree within four standard errors of the common part, a third of the claim at most.
#[test]
fn methods_agree_within_their_claims() {
    let scene = shipped("box.toml");
    let [gather, path, split] =
        [(Method::Gather, 4), (Method::Path, 4), (Method::Split, 1)].map(|(method, n)| passes(&scene, method, n, 5));
    for (a, b) in [(&gather, &path), (&split, &path), (&gather, &split)] {
        for (a, b) in a.maps.iter().zip(&b.maps) {
            let claims = claim(a).hypot(claim(b));
            let off = 100.0 * (mean(a) / mean(b) - 1.0);
            println!("{}: means off {off:+.3} %, claims {claims:.2} %, within 2 σ {:.3}", a.name, within(a, b, 2.0));
            assert!(within(a, b, 2.0) > 0.90, "{}: {}", a.name, within(a, b, 2.0));
            assert!(off.abs() < 1.3 * claims, "{}: {off} %", a.name);
        }
    }
}

/// Caustics are the photons' part in `gather`: what a glass sphere gathers is there, and as bright as `split` has it.
#[test]
fn gather_leaves_caustics_to_photons() {
    let scene = shipped("caustic.toml");
    let [gather, split] = [Method::Gather, Method::Split].map(|method| passes(&scene, method, 1, 2));
    let (a, b) = (&gather.maps[0], &split.maps[0]);
    let off = mean(a) / mean(b) - 1.0;
    assert!(off.abs() < 0.03, "means off by {off}");
    let peak = |map: &IlluminanceMap| map.illuminance.iter().copied().fold(0.0, f64::max);
    assert!(peak(a) > 20.0 * mean(a) && peak(b) > 20.0 * mean(b), "peaks {} and {}", peak(a), peak(b));
}

/// (RMSE against the converged map less its own noise, σ claimed, share within 1 σ, within 2 σ), first two in %.
fn honesty(map: &IlluminanceMap) -> [f64; 4] {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/reference/seed-office.{}.csv", map.name));
    let mut reader = csv::Reader::from_path(file).expect("the reference is in the repository");
    let [mut count, mut sum, mut square, mut claimed, mut one, mut two] = [0.0; 6];
    for (cell, row) in reader.records().enumerate() {
        let number = |column: usize| row.as_ref().expect("a row")[column].parse::<f64>().expect("a number");
        let (expected, noise) = (number(2), number(3));
        if !expected.is_finite() {
            continue;
        }
        let (off, sigma) = (map.illuminance[cell] - expected, map.standard_error[cell]);
        count += 1.0;
        sum += expected;
        square += off * off - noise * noise;
        claimed += sigma * sigma;
        let common = sigma.hypot(noise);
        one += f64::from(u8::from(off.abs() <= common));
        two += f64::from(u8::from(off.abs() <= 2.0 * common));
    }
    let mean = sum / count;
    [100.0 * (square / count).sqrt() / mean, 100.0 * (claimed / count).sqrt() / mean, one / count, two / count]
}

/// The claim is honest: over the seed office's points errors lie within 1 σ and 2 σ as often as a normal law says, 68 and
/// 95 %, give or take five points, mean over five seeds; and the claimed RMSE is within a fifth of the true one.
#[test]
fn claims_are_honest_in_the_seed_office() {
    let scene = shipped("seed-office.toml");
    let seeds = 5;
    for plane in 0..2 {
        let mut total = [0.0; 4];
        for seed in 0..seeds {
            let mut alone = scene.clone();
            alone.planes = vec![scene.planes[plane].clone()];
            let found = honesty(&passes(&alone, Method::Gather, 2, seed).maps[0]);
            total.iter_mut().zip(found).for_each(|(sum, part)| *sum += part / f64::from(seeds as u32));
        }
        let [rmse, claimed, one, two] = total;
        println!("{}: RMSE {rmse:.3} %, claimed {claimed:.3} %, 1 σ {one:.3}, 2 σ {two:.3}", scene.planes[plane].name);
        assert!((claimed / rmse - 1.0).abs() < 0.2, "RMSE {rmse} %, claimed {claimed} %");
        assert!((one - 0.683).abs() < 0.05 && (two - 0.954).abs() < 0.05, "1 σ {one}, 2 σ {two}");
    }
}

/// `--error 1` means it: the run ends by itself, claims at most 1 %, and is within 1 % of the converged map in truth.
#[test]
fn a_run_ends_when_its_error_is_small_enough() {
    let scene = shipped("seed-office.toml");
    let settings = Settings { stop: Stop::at_error(1.0), ..Settings::of(Method::Gather) };
    let results = run_with(&scene, Method::Gather, &settings);
    for map in &results.maps {
        let [rmse, claimed, ..] = honesty(map);
        println!("{}: {} passes, RMSE {rmse:.2} %, claimed {claimed:.2} %", map.name, results.run.passes);
        assert!(claim(map) <= 1.0 && rmse <= 1.0 && claimed <= 1.0, "{}: {rmse} %, claimed {claimed} %", map.name);
    }
    let half = run_with(&scene, Method::Gather, &Settings { stop: Stop::at_error(0.5), ..settings });
    assert!(half.run.passes > results.run.passes && half.maps.iter().all(|map| claim(map) <= 0.5));
}

/// Stops the run after some passes, as Ctrl-C would.
struct Impatient(AtomicU32);

impl Progress for Impatient {
    fn stage(&self, name: &'static str, _: u64) {
        self.0.fetch_add(u32::from(name == "build records"), Ordering::Relaxed);
    }
    fn advance(&self, _: u64) {}
    fn interrupted(&self) -> bool {
        self.0.load(Ordering::Relaxed) >= 8 // two passes of four rounds
    }
}

/// An interrupted run ends after the pass in hand, with the bits of a run of so many passes.
#[test]
fn an_interrupted_run_keeps_what_it_has() {
    let mut scene = shipped("seed-office.toml");
    scene.planes.iter_mut().for_each(|plane| plane.cells = [12, 14]);
    let plan = Plan::new(&scene, Method::Gather);
    let endless = Settings { stop: Stop::at_error(1e-6), ..Settings::of(Method::Gather) };
    let ended = render(&scene, &plan, &endless, &Impatient(AtomicU32::new(0))).expect("a result");
    assert_eq!(ended.run.passes, 2);
    let two = passes(&scene, Method::Gather, 2, 0);
    for (a, b) in ended.maps.iter().zip(&two.maps) {
        assert_eq!(a.illuminance, b.illuminance);
        assert_eq!(a.standard_error, b.standard_error);
    }
}

/// Time is a limit too, but for the first pass.
#[test]
fn a_run_without_time_does_one_pass() {
    let mut scene = shipped("seed-office.toml");
    scene.planes.truncate(1);
    scene.planes[0].cells = [12, 14];
    let settings = Settings {
        stop: Stop::at_error(1e-6).or_within(std::time::Duration::from_nanos(1)),
        ..Settings::of(Method::Gather)
    };
    assert_eq!(run_with(&scene, Method::Gather, &settings).run.passes, 1);
}

/// Each channel of a coloured room is a room of its own: a colourless one with that channel's reflectances and flux. σ of
/// the coloured run is that of its photometric value; the red channel alone, of a room with a red wall, scatters about as
/// much, so three channels' cells lie within 2 σ of their own (95 % of a normal law) nine times out of ten.
#[test]
fn a_coloured_room_is_three_rooms() {
    let coloured = shipped("box.toml");
    let whole = passes(&coloured, Method::Gather, 4, 11);
    let map = &whole.maps[0];
    let rgb = map.rgb.as_ref().expect("the box is coloured");
    for channel in 0..3 {
        let mut scene = coloured.clone();
        for material in &mut scene.materials {
            material.reflectance = [material.reflectance[channel]; 3];
        }
        for luminaire in &mut scene.luminaires {
            luminaire.flux.0 *= luminaire.colour[channel];
            luminaire.colour = [1.0; 3];
        }
        let alone = &passes(&scene, Method::Gather, 4, 12).maps[0];
        let of_channel: Vec<f64> = rgb.iter().map(|rgb| rgb[channel]).collect();
        let scale = of_channel.iter().sum::<f64>() / map.illuminance.iter().sum::<f64>();
        let standard_error = map.standard_error.iter().map(|error| error * scale).collect();
        let part = IlluminanceMap { illuminance: of_channel, standard_error, ..map.clone() };
        let inside = within(&part, alone, 2.0);
        println!("channel {channel}: {inside:.3} within 2 σ, ratio of means {:.4}", mean(&part) / mean(alone));
        assert!(inside > 0.9, "channel {channel}: {inside} within 2 σ");
        // All cells share their photons: the means differ by less than a cell's own claim.
        common::assert_close(&format!("channel {channel}"), mean(&part), mean(alone), 0.01 * claim(alone));
    }
}
