//! E_min, E_max and U₀: without bias, and with a standard error that is right.

use crate::common::room;
use crate::common::run;
use crate::common::run_with;
use crate::common::scene;
use luxmap::render::Settings;
use luxmap::render::Stop;
use luxmap::render::plan::Method;
use luxmap::results::Results;
use luxmap::results::Statistics;
use luxmap::results::statistics;
use luxmap::scene::Scene;
use luxmap::study::check::scenes::solid;

/// A room of 4 × 3 × 2.5 m with a lamp, and a table top 2 cm thick that shades the middle of the floor: there is next to no
/// direct light under it, so E_min is a matter of what bounces.
fn table(test: &str, more: &str) -> Scene {
    let top = solid([1.2, 0.9, 0.70], [2.8, 2.1, 0.72], "wood");
    let toml = format!(
        "[material.white]\nreflectance = 0.6\n[material.wood]\nreflectance = 0.3\n\
         [[luminaire]]\nname = \"L\"\nposition = [2, 1.5, 2.49]\nopening = {{ rectangle = [0.4, 0.4] }}\nflux = 3000\n{more}\
         [[plane]]\nname = \"floor\"\ncorner = [0, 0, 0]\nalong = [4, 0, 0]\nacross = [0, 3, 0]\ncells = [40, 30]\n\
         on = \"surface\"\n"
    );
    scene(test, &toml, &(room([0.0; 3], [4.0, 3.0, 2.5], ["white"; 6]) + &top))
}

fn floor(results: &Results) -> Statistics {
    statistics(&results.maps[0])
}

/// Each figure's value and claimed standard error.
fn figures(found: &Statistics) -> [[f64; 2]; 4] {
    [
        [found.mean.0, found.errors.mean.0],
        [found.min.0, found.errors.min.0],
        [found.max.0, found.errors.max.0],
        [found.uniformity, found.errors.uniformity],
    ]
}

/// 24 seeds of one small pass against one run of 60: no figure is off by more than three of its mean's standard errors and
/// half a claim (the choice among cells that are nearly as dark; the least of the cells is two claims off), and none claims
/// less than 0.6 of its true root mean square error (χ² of 24: 0.6 is 4 standard deviations away).
#[test]
fn extremes_have_no_bias_and_claim_what_they_err() {
    let scene = table("extremes_bias", "");
    let settings = Settings { photons: 50_000, ..Settings::of(Method::Gather) };
    let long = Settings { stop: Stop::after(60), seed: 1000, ..settings.clone() };
    let expected = figures(&floor(&run_with(&scene, Method::Gather, &long)));
    let seeds: Vec<_> = (0..24)
        .map(|seed| figures(&floor(&run_with(&scene, Method::Gather, &Settings { seed, ..settings.clone() }))))
        .collect();
    let count = seeds.len() as f64;
    for (figure, name) in ["mean", "E_min", "E_max", "U_0"].iter().enumerate() {
        let [truth, known] = expected[figure];
        let off = |found: &[[f64; 2]; 4]| found[figure][0] - truth;
        let bias = seeds.iter().map(off).sum::<f64>() / count;
        let rmse = (seeds.iter().map(|found| off(found).powi(2)).sum::<f64>() / count).sqrt();
        let claim = (seeds.iter().map(|found| found[figure][1].powi(2)).sum::<f64>() / count).sqrt();
        println!("{name}: {truth:.4} ± {known:.4}, bias {bias:.4}, rmse {rmse:.4}, claim {claim:.4}");
        assert!(bias.abs() < 3.0 * rmse / count.sqrt() + 0.5 * claim + 2.0 * known, "{name} is biased by {bias}");
        assert!(claim > 0.6 * (rmse - 2.0 * known), "{name} errs by {rmse}, claims {claim}");
    }
}

/// What the least of the cells says is the figure's own value: no cell of a smoothed map reads below E_min or above E_max but
/// where light is even.
#[test]
fn no_cell_reads_below_the_least() {
    let results = run(&table("extremes_cells", ""), Method::Gather, 50_000, 3);
    let (map, found) = (&results.maps[0], floor(&results));
    let least = map.values().flatten().fold(f64::INFINITY, f64::min);
    assert!((least / found.min.0 - 1.0).abs() < 1e-6, "cells {least}, E_min {}", found.min.0);
    assert!((found.uniformity - found.min.0 / found.mean.0).abs() < 1e-12);
}

/// Light groups add up in the cells that were read again, too: parts are single precision.
#[test]
fn groups_add_up_in_cells_read_again() {
    let lamp = "group = \"a\"\n[[luminaire]]\nname = \"M\"\nposition = [0.5, 0.5, 2.4]\nopening = { rectangle = [0.2, 0.2] }\n\
                flux = 500\ngroup = \"b\"\n";
    let scene = table("extremes_groups", lamp);
    let settings = Settings { photons: 50_000, groups: true, ..Settings::of(Method::Gather) };
    let results = run_with(&scene, Method::Gather, &settings);
    let map = &results.maps[0];
    assert_eq!(map.groups.len(), 2);
    for cell in 0..map.illuminance.len() {
        let sum: f64 = map.groups.iter().map(|group| f64::from(group.illuminance[cell])).sum();
        let off = sum / map.illuminance[cell] - 1.0;
        assert!(off.abs() < 1e-4, "cell {cell}: groups {sum} lx, whole {} lx", map.illuminance[cell]);
    }
}

/// The same bits for one thread and for five.
#[test]
fn extremes_do_not_depend_on_threads() {
    let scene = table("extremes_threads", "");
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        pool.install(|| run(&scene, Method::Gather, 20_000, 2)).maps.remove(0)
    };
    let (one, five) = (on(1), on(5));
    assert!(one.extremes.is_some() && one.extremes == five.extremes);
    assert_eq!(one.illuminance, five.illuminance);
}

/// Methods that follow photons only have E_min read by rays, too: as `gather` has it within three errors of both.
#[test]
fn photon_methods_agree_on_the_least() {
    let scene = table("extremes_methods", "");
    let gather = floor(&run(&scene, Method::Gather, 200_000, 5));
    for method in [Method::Split, Method::Photons, Method::Path] {
        let other = floor(&run(&scene, method, 400_000, 6));
        let bound = 3.0 * gather.errors.min.0.hypot(other.errors.min.0);
        let off = other.min.0 - gather.min.0;
        assert!(off.abs() < bound, "{}: {} lx, gather {} lx, bound {bound}", method.name(), other.min.0, gather.min.0);
    }
}
