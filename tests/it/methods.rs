//! Methods that find light that has bounced by rays from the points: right, in agreement, and honest about their error.

use std::f64::consts::PI;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::common::reference::{Found, compare};
use crate::common::{self, mean, passes, room, run_with, scene, sensor, shipped};
use luxmap::progress::Progress;
use luxmap::render::plan::{Method, Plan};
use luxmap::render::{Settings, Stop, render};
use luxmap::results::{IlluminanceMap, Results};

/// √(mean σ²) over the mean, %.
fn claim(map: &IlluminanceMap) -> f64 {
    100.0 * common::claim(map) / mean(map)
}

/// A closed room of uniform ρ and a glowing ceiling, floor, walls: every point gets the same, E = M/(1 − ρ), whatever the
/// method and the place, next to edges and in corners too. Here ρ = 0.5 and M = π · 100 cd/m².
#[test]
fn a_glowing_room_is_evenly_lit_to_rays() {
    let mesh = room([0.0; 3], [3.0, 2.0, 2.5], ["glow"; 6]);
    let folder = crate::common::folder("glow_rays");
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
        crate::common::assert_close(method.name(), mean(map), expected, 0.04 * claim(map));
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

/// The claims of two maps over the root mean square of their differences, cell by cell.
fn claimed_over_found(a: &IlluminanceMap, b: &IlluminanceMap) -> f64 {
    let cells = (0..a.illuminance.len()).filter(|&cell| a.has_value[cell] && b.has_value[cell]);
    let (claimed, found) = cells.fold((0.0, 0.0), |(claimed, found), cell| {
        let sigmas = [a, b].map(|map| map.standard_error[cell].powi(2));
        (claimed + sigmas[0] + sigmas[1], found + (a.illuminance[cell] - b.illuminance[cell]).powi(2))
    });
    f64::sqrt(claimed / found)
}

/// Runs of several seeds as one: of each map the mean of its cells with the error of that mean, and the mean of all cells
/// with the variance that their scatter between seeds gives it.
fn pooled(runs: &[Results]) -> Vec<(IlluminanceMap, f64, f64)> {
    let count = runs.len() as f64;
    let pool = |number: usize| {
        let maps: Vec<&IlluminanceMap> = runs.iter().map(|run| &run.maps[number]).collect();
        let mut pooled = maps[0].clone();
        for cell in 0..pooled.illuminance.len() {
            pooled.illuminance[cell] = maps.iter().map(|map| map.illuminance[cell]).sum::<f64>() / count;
            let variance: f64 = maps.iter().map(|map| map.standard_error[cell].powi(2)).sum();
            pooled.standard_error[cell] = variance.sqrt() / count;
        }
        let of_all = mean(&pooled);
        let scatter: f64 = maps.iter().map(|map| (mean(map) - of_all).powi(2)).sum();
        (pooled, of_all, scatter / (count - 1.0) / count)
    };
    (0..runs[0].maps.len()).map(pool).collect()
}

/// `gather`, `path` and `split` know nothing of each other's errors: they agree in a coloured room.
///
/// Cells: nine of ten differences are within 2 σ of the common claim (95 % of a normal law), and the claims are no less than
/// 0.8 of the root mean square of the differences, as `a_maps_claim_is_its_error` asks of known light. In this room they are
/// larger, 1.4 times on the floor: that claims aren't too large is asked where the light is known.
///
/// Means over all cells: cells share photons, so the claims of cells don't tell how well the mean is known, but the scatter
/// between seeds does. Of two means of four seeds each the difference is Student's t of 6 degrees of freedom, if they are one:
/// more than 6.0 standard errors once in a thousand.
#[test]
fn methods_agree_within_their_claims() {
    let scene = shipped("box.toml");
    let [gather, path, split] = [Method::Gather, Method::Path, Method::Split].map(|method| {
        let runs: Vec<Results> = (0..4).map(|seed| passes(&scene, method, 1, 5 + seed)).collect();
        pooled(&runs)
    });
    for (a, b) in [(&gather, &path), (&split, &path), (&gather, &split)] {
        for ((a, mean_a, variance_a), (b, mean_b, variance_b)) in a.iter().zip(b) {
            let (inside, claimed) = (within(a, b, 2.0), claimed_over_found(a, b));
            let (off, sigma) = (mean_a - mean_b, (variance_a + variance_b).sqrt());
            println!(
                "{}: within 2 σ {inside:.3}, claimed over found {claimed:.3}, means off {:+.3} %, σ {:.3} %",
                a.name,
                100.0 * off / mean_b,
                100.0 * sigma / mean_b
            );
            assert!(inside > 0.90, "{}: {inside}", a.name);
            assert!(claimed >= 0.8, "{}: {claimed}", a.name);
            assert!(off.abs() < 6.0 * sigma, "{}: means off by {off} lx, σ {sigma} lx", a.name);
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
            let found = compare(&passes(&alone, Method::Gather, 2, seed).maps[0]);
            let figures = [found.rmse, found.claimed, found.within[0], found.within[1]];
            total.iter_mut().zip(figures).for_each(|(sum, part)| *sum += part / f64::from(seeds as u32));
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
        let Found { rmse, claimed, .. } = compare(map);
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
        crate::common::assert_close(&format!("channel {channel}"), mean(&part), mean(alone), 0.01 * claim(alone));
    }
}
