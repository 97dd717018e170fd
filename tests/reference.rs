//! The seed office against its converged map.

mod common;

use std::path::Path;

use common::{run, shipped};
use luxmap::render::plan::Method;
use luxmap::results::IlluminanceMap;

/// (RMSE, bias) in % of the reference's mean, over the points both have a value at; all points of the reference must.
fn against_reference(map: &IlluminanceMap) -> (f64, f64) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/reference/seed-office.{}.csv", map.name));
    let mut reader = csv::Reader::from_path(file).expect("the reference is in the repository");
    let (mut count, mut sum, mut difference, mut square) = (0.0, 0.0, 0.0, 0.0);
    for ((row, found), has_value) in reader.records().zip(&map.illuminance).zip(&map.has_value) {
        let expected: f64 = row.expect("a row")[2].parse().expect("a number");
        assert_eq!(*has_value, expected.is_finite(), "luxmap and the reference disagree on what is inside furniture");
        if expected.is_finite() {
            count += 1.0;
            sum += expected;
            difference += found - expected;
            square += (found - expected).powi(2);
        }
    }
    assert!(count > 17_000.0);
    let mean = sum / count;
    (100.0 * (square / count).sqrt() / mean, 100.0 * difference / count / mean)
}

/// A million photons: RMSE at most 3 % of the mean on the floor and 2 % at 0.75 m, bias at most 0.5 %.
#[test]
fn split_agrees_with_the_reference() {
    let results = run(&shipped("seed-office.toml"), Method::Split, 1_000_000, 0);
    for (map, most) in results.maps.iter().zip([3.0, 2.0]) {
        let (rmse, bias) = against_reference(map);
        println!("split, {}: RMSE {rmse:.2} %, bias {bias:+.3} %", map.name);
        assert!(rmse <= most && bias.abs() <= 0.5, "{}: RMSE {rmse} %, bias {bias} %", map.name);
    }
}

/// All light by photons: bias at most 1 %.
#[test]
fn photons_agree_with_the_reference() {
    let results = run(&shipped("seed-office.toml"), Method::Photons, 1_000_000, 0);
    for map in &results.maps {
        let (rmse, bias) = against_reference(map);
        println!("photons, {}: RMSE {rmse:.2} %, bias {bias:+.3} %", map.name);
        assert!(bias.abs() <= 1.0, "{}: bias {bias} %", map.name);
    }
}
