//! Light by mirrors and glass: as bright as closed forms say, nothing beside its edge, with an error that falls as 1/√N and
//! is what it claims to be.

use std::f64::consts::PI;

use crate::common::assert_close;
use crate::common::run_with;
use crate::common::scene;
use luxmap::render::Settings;
use luxmap::render::Stop;
use luxmap::render::plan::Method;
use luxmap::results::IlluminanceMap;
use luxmap::results::Results;
use luxmap::scene::Scene;
use luxmap::study::check::scenes::diffuse;
use luxmap::study::check::scenes::floor;
use luxmap::study::check::scenes::point_lamp;
use luxmap::study::check::scenes::polygon;
use luxmap::study::check::scenes::room;
use luxmap::study::check::scenes::sensor;

/// Luminous intensity of the lamp, cd, and what the mirror reflects.
const INTENSITY: f64 = 5000.0;
const SPECULAR: f64 = 0.9;

/// The mirror hangs at this x, from y = 1.7 to 2.3 and z = 1 to 1.6, and shows the lamp at [1, 2, 2] here.
const MIRROR: f64 = 3.99;
const IMAGE: [f64; 3] = [2.0 * MIRROR - 1.0, 2.0, 2.0];
const CELLS: usize = 40;

/// A black room of 4 × 4 × 3 m, a lamp without extent, and a mirror that throws a sharp-edged beam on the floor.
fn beam(test: &str, more: &str) -> Scene {
    let mirror = [[MIRROR, 1.7, 1.0], [MIRROR, 1.7, 1.6], [MIRROR, 2.3, 1.6], [MIRROR, 2.3, 1.0]];
    let obj = room([0.0; 3], [4.0, 4.0, 3.0], ["black"; 6]) + &polygon("mirror", &mirror);
    let toml = format!(
        "{}[material.mirror]\nspecular = {SPECULAR}\n{}{}{more}",
        diffuse("black", 0.0),
        point_lamp("lamp", [1.0, 2.0, 2.0], 4.0 * PI * INTENSITY),
        floor([0.0; 3], [4.0, 4.0, 0.0], CELLS),
    );
    scene(test, &toml, &obj)
}

/// E on the floor by way of the mirror, lx: the lamp's image shines through the mirror's frame.
fn exact(x: f64, y: f64) -> f64 {
    let share = (IMAGE[0] - MIRROR) / (IMAGE[0] - x);
    let (across, up) = (2.0 + (y - 2.0) * share, IMAGE[2] * (1.0 - share));
    if !(1.7..2.3).contains(&across) || !(1.0..1.6).contains(&up) {
        return 0.0;
    }
    let squared = (x - IMAGE[0]).powi(2) + (y - IMAGE[1]).powi(2) + IMAGE[2].powi(2);
    SPECULAR * INTENSITY * IMAGE[2] / squared.powf(1.5)
}

/// Mean of that over a cell, by 64 × 64 points.
fn exact_mean(cell: usize) -> f64 {
    let side = 4.0 / CELLS as f64;
    let at = |index: usize, part: usize| (index as f64 + (part as f64 + 0.5) / 64.0) * side;
    let parts = (0..64 * 64).map(|part| exact(at(cell % CELLS, part % 64), at(cell / CELLS, part / 64)));
    parts.sum::<f64>() / 4096.0
}

fn exact_map() -> Vec<f64> {
    (0..CELLS * CELLS).map(exact_mean).collect()
}

/// What the mirror brings to each cell.
fn by_mirror(map: &IlluminanceMap, method: Method) -> Vec<f64> {
    let direct = map.direct.as_deref().filter(|_| method != Method::Photons);
    (0..map.illuminance.len()).map(|cell| map.illuminance[cell] - direct.map_or(0.0, |direct| direct[cell])).collect()
}

fn render(scene: &Scene, method: Method, photons: u64, passes: u32, seed: u64) -> Results {
    run_with(scene, method, &Settings { photons, stop: Stop::after(passes), seed, rays: 4, ..Settings::of(method) })
}

fn squares(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|value| value * value).sum()
}

/// Flux is counted where it lands: the mean is the closed form's within the noise of so many photons, and cells that the
/// beam's edge does not touch get none. (A search radius would carry light over the edge.)
#[test]
fn a_beam_keeps_its_flux_and_its_edge() {
    let scene = beam("caustics_beam", "");
    let exact = exact_map();
    let whole: f64 = exact.iter().sum();
    // The mirror's solid angle holds this part of all photons, and nine tenths of those are reflected.
    let (photons, passes) = (400_000, 4);
    let hits = whole * (4.0 / CELLS as f64).powi(2) / (4.0 * PI * INTENSITY) * (photons * u64::from(passes)) as f64;
    let dark = |cell: usize| {
        let near = (-3..=3).flat_map(|row| (-3..=3).map(move |column| [column, row]));
        near.map(|[column, row]: [i64; 2]| {
            let [x, y] =
                [(cell % CELLS) as i64 + column, (cell / CELLS) as i64 + row].map(|at| at.clamp(0, 39) as usize);
            exact[y * CELLS + x]
        })
        .all(|lux| lux == 0.0)
    };
    for method in [Method::Gather, Method::Split] {
        let results = render(&scene, method, photons, passes, 1);
        let found = by_mirror(&results.maps[0], method);
        assert_close(method.name(), found.iter().sum::<f64>(), whole, 4.0 / hits.sqrt() + 0.002);
        let stray = (0..exact.len()).filter(|&cell| dark(cell)).map(|cell| found[cell].abs()).fold(0.0, f64::max);
        assert!(stray < 1e-6, "{}: {stray} lx where no light falls", method.name());
    }
}

/// Sixteen times the passes, a quarter of the error, claimed and true; no number of passes is special.
#[test]
fn the_error_of_a_caustic_falls_as_the_root_of_passes() {
    let scene = beam("caustics_root", "");
    let exact = exact_map();
    let errors = |passes: u32| {
        let results = render(&scene, Method::Gather, 200_000, passes, 7);
        let map = &results.maps[0];
        let found = by_mirror(map, Method::Gather);
        let off = squares(found.iter().zip(&exact).map(|(found, exact)| found - exact));
        (squares(map.standard_error.iter().copied()).sqrt(), off.sqrt())
    };
    let few = errors(4);
    for passes in [16, 63, 64, 65] {
        let many = errors(passes);
        let root = (f64::from(passes) / 4.0).sqrt();
        println!("{passes} passes: claim falls by {:.2}, error by {:.2}, √ {root:.2}", few.0 / many.0, few.1 / many.1);
        // Between N^(-1/2) of noise and N^(-1/3) of edges that are smoothed as far as noise hides them (16^(1/3) of 16^(1/2) is
        // 0.63); one seed's error scatters by a tenth.
        assert!(few.0 / many.0 > 0.5 * root && few.1 / many.1 > 0.5 * root);
    }
}

/// Over many seeds the claim is the true error, within a fourth, for some ten photons a cell; not too small for less than one.
#[test]
fn claims_of_caustics_are_true() {
    let more: String = [[0.3, 2.0], [0.6, 1.8], [0.93, 2.1], [0.2, 2.4]]
        .iter()
        .map(|[x, y]| sensor(&format!("at {x} {y}"), [*x, *y, 0.001], [0.0, 0.0, 1.0]))
        .collect();
    let scene = beam("caustics_claims", &more);
    let exact_cells = exact_map();
    for (photons, seeds) in [(60_000, 12), (1_000_000, 12)] {
        let (mut claimed, mut true_error) = (0.0, 0.0);
        let mut inside = [0.0; 2];
        for seed in 0..seeds {
            let results = render(&scene, Method::Gather, photons, 1, seed);
            let map = &results.maps[0];
            let found = by_mirror(map, Method::Gather);
            true_error += squares(found.iter().zip(&exact_cells).map(|(found, exact)| found - exact));
            claimed += squares(map.standard_error.iter().copied());
            for reading in &results.sensors {
                let [x, y] = [reading.position.x, reading.position.y];
                let direct = 2.0 * INTENSITY / ((x - 1.0).powi(2) + (y - 2.0).powi(2) + 2.0_f64.powi(2)).powf(1.5);
                let z = (reading.illuminance - direct - exact(x, y)) / reading.standard_error;
                println!(
                    "{photons}, sensor {}: {:.2} ± {:.2}, {:.2} σ",
                    reading.name,
                    reading.illuminance - direct,
                    reading.standard_error,
                    z
                );
                inside[0] += f64::from(u8::from(z.abs() <= 2.0));
                inside[1] += 1.0;
            }
        }
        let ratio = (claimed / true_error).sqrt();
        println!("{photons} photons: claim/RMSE {ratio:.3}, sensors within 2 σ {:.3}", inside[0] / inside[1]);
        // With less than a photon a cell, dark cells beside the beam can't be told from lit ones that none has met: the claim is
        // that of either.
        let most = if photons < 100_000 { 1.5 } else { 1.25 };
        assert!(ratio > 0.8 && ratio < most, "claim/RMSE is {ratio}");
        // 95 % less three times the scatter of 48: 9 %.
        assert!(inside[0] / inside[1] > 0.86, "{inside:?}");
    }
}

/// A sheet that stands in the middle of a column of cells: light on the one side is not counted on the other, and is over the
/// half cell's area.
#[test]
fn a_cut_cell_counts_what_its_middle_sees() {
    // Sheet at x = 0.53, inside the cells from 0.5 to 0.6, whose middles lie on its bright side (the beam comes from x high).
    let sheet = [[0.53, 0.0, 0.0], [0.53, 4.0, 0.0], [0.53, 4.0, 0.05], [0.53, 0.0, 0.05]];
    let mirror = [[MIRROR, 1.7, 1.0], [MIRROR, 1.7, 1.6], [MIRROR, 2.3, 1.6], [MIRROR, 2.3, 1.0]];
    let obj = room([0.0; 3], [4.0, 4.0, 3.0], ["black"; 6]) + &polygon("mirror", &mirror) + &polygon("black", &sheet);
    let toml = format!(
        "{}[material.mirror]\nspecular = {SPECULAR}\n{}{}",
        diffuse("black", 0.0),
        point_lamp("lamp", [1.0, 2.0, 2.0], 4.0 * PI * INTENSITY),
        floor([0.0; 3], [4.0, 4.0, 0.0], CELLS),
    );
    let scene = scene("caustics_cut", &toml, &obj);
    for method in [Method::Gather, Method::Split] {
        let results = render(&scene, method, 1_000_000, 2, 3);
        let found = by_mirror(&results.maps[0], method);
        let middle = |column: usize| (15..25).map(|row| found[row * CELLS + column]).sum::<f64>() / 10.0;
        let expected = (0..40).map(|y| exact(0.565, 1.5 + 0.0125 + 0.025 * f64::from(y))).sum::<f64>() / 40.0;
        // 10 cells of 70 cm² and 2·10⁶ photons: 370 photons.
        assert_close(method.name(), middle(5), expected, 4.0 / 370.0_f64.sqrt());
        // Its shadow is 0.05 · (6.98 − 0.53)/(2 − 0.05) = 0.165 m long.
        assert!(middle(4) < 1e-6, "{}: {} lx in the sheet's shadow", method.name(), middle(4));
    }
}
