//! The seed office against its converged map.

use crate::common::reference::compare;
use crate::common::{mean, run, shipped};
use luxmap::render::plan::Method;
use luxmap::results::Results;
use luxmap::scene::Scene;

/// Four standard errors of a plane's mean, as a part of it, where all light is found by photons.
///
/// A photon is one of N equal parts of the flux Φ. It arrives X times at a plane of area A, e = E A/Φ times on average. What
/// goes down through a plane comes back up by at most a half (the furniture's tops) and down again by at most 0.7 (the
/// ceiling), so it comes back with a chance r ≤ 0.35, and the mean of X² is at most e (1 + 2 r/(1 − r)) = 2.08 e. Photons are
/// independent, or spread more evenly than that: the variance of the mean of X is at most (2.08 e − e²)/N.
fn four_sigmas(scene: &Scene, results: &Results, number: usize) -> f64 {
    let (plane, map) = (&scene.planes[number], &results.maps[number]);
    let valid = map.has_value.iter().filter(|has| **has).count() as f64 / plane.len() as f64;
    let area = valid * plane.along.length() * plane.across.length();
    let arrivals = mean(map) * area / results.run.flux.emitted.0;
    let variance = (2.08 / arrivals - 1.0) / results.run.photons_emitted as f64;
    4.0 * variance.sqrt()
}

/// Holds a run of seed 0 against the reference. The claim is the error, from 0.8 to 1.25 of it. The error of the cells is at
/// most `most` (% of the mean, each plane): the mean of what seeds 0, 1 and 2 had when this was written, and four times their
/// scatter.
fn assert_agrees(results: &Results, most: [f64; 2]) {
    for (map, most) in results.maps.iter().zip(most) {
        let found = compare(map);
        println!("{}, {}: {found:.3?}", results.run.method, map.name);
        assert!(found.rmse <= most, "{}: {found:?}", map.name);
        assert!((0.8..=1.25).contains(&(found.claimed / found.rmse)), "{}: {found:?}", map.name);
    }
}

/// A bias of half a claim makes the error 12 % larger than its scatter, √(1 + ¼): half of what claims may be off.
fn assert_bias_is_covered(results: &Results, most: f64) {
    for found in results.maps.iter().map(compare) {
        assert!(found.bias.abs() <= (0.5 * found.claimed).min(most), "{found:?}");
    }
}

/// The default: a bias of 0.1 % was found, and half a percent would be half of what `--error` promises.
#[test]
fn gather_agrees_with_the_reference() {
    let results = run(&shipped("seed-office.toml"), Method::Gather, 1_000_000, 0);
    assert_agrees(&results, [0.98, 0.61]);
    assert_bias_is_covered(&results, 0.5);
}

/// Seeds 0, 1 and 2 have a bias of -0.33 % on the floor and -0.17 % above it, more than the noise of their photons leaves:
/// estimates lose a little at edges.
#[test]
fn split_agrees_with_the_reference() {
    let results = run(&shipped("seed-office.toml"), Method::Split, 1_000_000, 0);
    assert_agrees(&results, [1.75, 1.23]);
    assert_bias_is_covered(&results, 0.5);
}

/// All light by photons.
#[test]
fn photons_agree_with_the_reference() {
    let scene = shipped("seed-office.toml");
    let results = run(&scene, Method::Photons, 1_000_000, 0);
    assert_agrees(&results, [4.0, 3.35]);
    for (number, map) in results.maps.iter().enumerate() {
        let bound = 100.0 * four_sigmas(&scene, &results, number);
        let found = compare(map);
        println!("{}: bias {:+.3} %, bound {bound:.3} %", map.name, found.bias);
        assert!(found.bias.abs() <= bound, "{}: bound {bound} %, {found:?}", map.name);
    }
}
