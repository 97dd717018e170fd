//! Error measures against cases worked out by hand, and against noise of known size.

use glam::DVec3;

use crate::random::{Seed, Stream};
use crate::study::convergence::verdict::{Reached, findings, honesty, race, time_to};
use crate::study::convergence::*;

/// A map of one row; NaN for no value.
fn map(illuminance: &[f64], standard_error: &[f64]) -> IlluminanceMap {
    let known = |e: &f64| if e.is_nan() { 0.0 } else { *e };
    IlluminanceMap {
        name: "floor".into(),
        corner: DVec3::ZERO,
        along: DVec3::X,
        across: DVec3::Y,
        cells: [illuminance.len(), 1],
        illuminance: illuminance.iter().map(known).collect(),
        rgb: None,
        direct: None,
        standard_error: standard_error.to_vec(),
        has_value: illuminance.iter().map(|e| !e.is_nan()).collect(),
        standing: Vec::new(),
        outlines: Vec::new(),
        groups: Vec::new(),
        extremes: None,
        areas: Vec::new(),
    }
}

fn reference(illuminance: &[f64], standard_error: &[f64]) -> Reference {
    let IlluminanceMap { illuminance, standard_error, has_value, .. } = map(illuminance, standard_error);
    Reference { source: "truth".into(), illuminance, standard_error, has_value }
}

fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-9 * expected.abs().max(1.0), "found {found}, expected {expected}");
}

const NONE: f64 = f64::NAN;

/// Differences of +10, −10 and +30 lx from 100 lx; two more cells are known to one side only.
#[test]
fn three_cells_by_hand() {
    let run = map(&[110.0, 90.0, 130.0, 7.0, NONE], &[10.0, 10.0, 20.0, 999.0, 0.0]);
    let truth = reference(&[100.0, 100.0, 100.0, NONE, 7.0], &[3.0, 3.0, 3.0, 0.0, 999.0]);
    let errors = Deviation::between(&run, &truth).unwrap();
    assert_eq!((errors.cells, errors.unmatched), (3, 2));
    close(errors.difference, (1100.0_f64 / 3.0).sqrt());
    close(errors.reference, 3.0);
    close(errors.rmse(), (1100.0_f64 / 3.0 - 9.0).sqrt());
    close(errors.bias, 10.0);
    close(errors.worst, 30.0);
    close(errors.claimed, 100.0 * 200.0_f64.sqrt() / 110.0); // of the run's own mean
    close(errors.within_1_sigma, 200.0 / 3.0); // 30 is beyond √(20² + 3²) = 20.2, within twice that
    close(errors.within_2_sigma, 100.0);
}

/// A run without noise that equals its reference up to the digits of a file is within any σ, and no more than noise is
/// found where the reference is noisier than the difference.
#[test]
fn no_error_is_found_where_there_is_none() {
    let exact =
        Deviation::between(&map(&[100.0, 300.0], &[0.0; 2]), &reference(&[100.0004, 300.0], &[0.0; 2])).unwrap();
    assert_eq!((exact.within_1_sigma, exact.within_2_sigma, exact.claimed), (100.0, 100.0, 0.0));
    assert!(exact.rmse() < 2e-4);
    let noisy = Deviation::between(&map(&[101.0, 99.0], &[1.0; 2]), &reference(&[100.0; 2], &[5.0; 2])).unwrap();
    assert_eq!((noisy.rmse(), noisy.bias), (0.0, 0.0));
    let point = Point::of(&[&trial(1000, 1.0, noisy)]);
    assert_eq!((point.is_resolved(), point.true_over_claimed(), point.bias_error), (false, None, None));
}

#[test]
fn a_dark_reference_or_none_in_common_is_no_comparison() {
    assert_eq!(Deviation::between(&map(&[1.0, 2.0], &[0.0; 2]), &reference(&[0.0; 2], &[0.0; 2])), None);
    assert_eq!(Deviation::between(&map(&[1.0, NONE], &[0.0; 2]), &reference(&[NONE, 1.0], &[0.0; 2])), None);
    let dark = Deviation::between(&map(&[0.0; 2], &[0.0; 2]), &reference(&[1.0; 2], &[0.0; 2])).unwrap();
    assert_eq!((dark.difference, dark.bias, dark.claimed), (100.0, -100.0, 0.0));
}

fn normal(stream: &mut Stream) -> f64 {
    let [a, b] = stream.uniform_pair().map(f64::from);
    (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos()
}

/// Normal noise of 2 % on the run and of 1.5 % on the reference, both honestly claimed: the run's own 2 % is found,
/// with 68.27 % and 95.45 % of the cells within 1 and 2 σ. Bounds are 4 standard errors: a mean square of n normal
/// numbers has the relative error √(2/n), a share p has √(p(1 − p)/n).
#[test]
fn honest_noise_is_found_honest() {
    let (n, truth, ours, theirs) = (40_000, 500.0, 10.0, 7.5);
    let mut stream = Seed(11).stream(0);
    let run: Vec<f64> = (0..n).map(|_| truth + ours * normal(&mut stream)).collect();
    let known: Vec<f64> = (0..n).map(|_| truth + theirs * normal(&mut stream)).collect();
    let errors = Deviation::between(&map(&run, &vec![ours; n]), &reference(&known, &vec![theirs; n])).unwrap();
    let cells = n as f64;
    let mean_square = 4.0 * (2.0 / cells).sqrt() * (ours * ours + theirs * theirs); // ± lx² of the difference
    let bound = 100.0 * mean_square / (2.0 * ours) / truth;
    assert!((errors.rmse() - 2.0).abs() < bound, "RMSE {} %, expected 2 % ± {bound}", errors.rmse());
    for (found, share) in [(errors.within_1_sigma, 0.682_689_f64), (errors.within_2_sigma, 0.954_500)] {
        let bound = 400.0 * (share * (1.0 - share) / cells).sqrt();
        assert!((found - 100.0 * share).abs() < bound, "{found} %, expected {} % ± {bound}", 100.0 * share);
    }
    let bound = 400.0 * ours.hypot(theirs) / cells.sqrt() / truth;
    assert!(errors.bias.abs() < bound, "bias {} %, expected 0 ± {bound}", errors.bias);
}

fn errors(difference: f64, bias: f64, claimed: f64) -> Deviation {
    Deviation {
        cells: 1,
        unmatched: 0,
        difference,
        reference: 0.0,
        bias,
        worst: difference,
        claimed,
        within_1_sigma: 60.0,
        within_2_sigma: 90.0,
    }
}

fn trial(photons: u64, seconds: f64, errors: Deviation) -> PlaneRun {
    let rung = Rung { method: Method::Split, photons, nearest: None, passes: 1 };
    let seconds = Seconds { gather: seconds, ..Seconds::default() };
    PlaneRun { plane: 0, rung, nearest: 100, seed: 0, seconds, errors }
}

/// Errors add up as squares, biases as they are, times by their median: 3 and 4 give √12.5, ±1 of scatter about +2
/// gives ±1 for two trials.
#[test]
fn trials_make_a_point() {
    let trials = [trial(1000, 5.0, errors(3.0, 1.0, 2.0)), trial(1000, 1.0, errors(4.0, 3.0, 2.0))];
    let point = Point::of(&trials.iter().collect::<Vec<_>>());
    close(point.rmse, 12.5_f64.sqrt());
    close(point.bias, 2.0);
    close(point.bias_error.unwrap(), 1.0);
    close(point.worst, 4.0);
    close(point.seconds.total(), 1.0);
    close(point.true_over_claimed().unwrap(), 12.5_f64.sqrt() / 2.0);
    let three = [trials[0].clone(), trials[1].clone(), trial(1000, 2.0, errors(3.0, 2.0, 2.0))];
    close(Point::of(&three.iter().collect::<Vec<_>>()).seconds.total(), 2.0);
}

#[test]
fn stages_add_up_to_the_whole_run() {
    let seconds = vec![("build BVH", 1.0), ("look around", 2.0), ("gather", 4.0), ("gather rays", 8.0), ("new", 16.0)];
    let found = Seconds::of(&Run { seconds, total_seconds: 40.0, ..Run::default() });
    assert_eq!((found.look_around, found.gather, found.other, found.total()), (2.0, 12.0, 26.0, 40.0));
}

fn point(photons: u64, seconds: f64, rmse: f64) -> Point {
    Point::of(&[&trial(photons, seconds, errors(rmse, 0.0, rmse))])
}

/// Error ∝ 1/√t between the points: 4 % at 1 s and 0.5 % at 64 s make 1 % at 16 s.
#[test]
fn the_time_to_an_error_follows_the_power_between_points() {
    let (slow, fast) = (point(1, 1.0, 4.0), point(64, 64.0, 0.5));
    let reached = time_to(&[&slow, &fast], 1.0).unwrap();
    close(reached.seconds, 16.0);
    assert!(!reached.at_once);
    assert_eq!(time_to(&[&slow], 1.0), None);
    assert_eq!(time_to(&[], 1.0), None);
    assert_eq!(time_to(&[&fast], 1.0), Some(Reached { seconds: 64.0, at_once: true }));
    let exact = point(64, 9.0, 0.0);
    assert_eq!(time_to(&[&slow, &exact], 1.0), Some(Reached { seconds: 9.0, at_once: false }));
}

fn rungs(methods: &[Method], photons: &[u64], nearest: &[Option<usize>], passes: &[u32]) -> Vec<Point> {
    let mut points = Vec::new();
    for &method in methods {
        for &nearest in nearest {
            for &passes in passes {
                for &photons in photons {
                    let rung = Rung { method, photons, nearest, passes };
                    points.push(Point { rung, ..point(1, 1.0, 1.0) });
                }
            }
        }
    }
    points
}

/// Along a curve the photons vary, else the passes, else k; what else varies tells curves apart.
#[test]
fn curves_vary_in_effort_only() {
    let labels = |points: &[Point]| {
        curves(points, 0).into_iter().map(|curve| (curve.label, curve.points.len())).collect::<Vec<_>>()
    };
    let named = |names: &[(&str, usize)]| names.iter().map(|(name, n)| ((*name).to_owned(), *n)).collect::<Vec<_>>();
    let (split, photons) = (Method::Split, Method::Photons);
    let both = rungs(&[split, photons], &[1, 2, 3], &[None], &[1]);
    assert_eq!(labels(&both), named(&[("split", 3), ("photons", 3)]));
    let three = rungs(&[split], &[1, 2], &[Some(50), Some(100)], &[1]);
    assert_eq!(labels(&three), named(&[("split, k 50", 2), ("split, k 100", 2)]));
    let passes = rungs(&[split], &[1], &[Some(50), Some(100)], &[1, 4]);
    assert_eq!(labels(&passes), named(&[("split, k 50", 2), ("split, k 100", 2)]));
    let nearest = rungs(&[split], &[1], &[Some(50), Some(100)], &[1]);
    assert_eq!(labels(&nearest), named(&[("split", 2)]));
    let all = rungs(&[split], &[1, 2], &[None], &[1, 4]);
    assert_eq!(labels(&all), named(&[("split, 1 ×", 2), ("split, 4 ×", 2)]));
    assert!(labels(&[]).is_empty());
}

fn study(trials: Vec<PlaneRun>) -> Study {
    let plane = StudiedPlane { name: "floor".into(), cells: [1, 1], reference: "truth".into() };
    Study {
        scene: "Büro <1>".into(),
        scene_hash: String::new(),
        threads: 2,
        repeats: 1,
        planes: vec![plane],
        trials,
        warnings: Vec::new(),
    }
}

/// The headline says which method is first, which isn't there, and which claims too little.
#[test]
fn findings_follow_from_the_figures() {
    let by = |method: Method, trial: PlaneRun| PlaneRun { rung: Rung { method, ..trial.rung }, ..trial };
    let trials = vec![
        by(Method::Split, trial(1, 1.0, errors(4.0, 0.0, 4.0))),
        by(Method::Split, trial(2, 64.0, errors(0.5, 0.0, 0.45))),
        by(Method::Photons, trial(1, 1.0, errors(9.0, 0.0, 9.0))),
        by(Method::Photons, trial(2, 8.0, errors(7.0, 0.0, 3.5))),
    ];
    let found = study(trials.clone());
    let points = found.points();
    assert_eq!(
        findings(&found, &points),
        [
            "floor: split is first to 1 %, after 16 s; not there: photons (7.00 % at best).",
            "Claims of split: honest, the true error is 1.00 … 1.11 × the claim.",
            "Claims of photons: too low in part, the true error is 1.00 … 2.00 × the claim.",
        ]
    );
    assert_eq!(honesty(&points[2..]), Some([1.0, 2.0]));
    assert_eq!(race(&curves(&points, 0))[1], (Method::Photons, None));
    let missed = study(trials[2..].to_vec());
    let first = &findings(&missed, &missed.points())[0];
    assert_eq!(first, "floor: no method gets to 1 %; nearest: photons (7.00 % after 8 s).");
    let exact = study(vec![trial(1, 0.3, errors(0.0, 0.0, 0.0))]);
    let found = findings(&exact, &exact.points());
    assert_eq!(found, ["floor: split is exact, as far as the reference tells, after 300 ms."]);
}

/// Whatever the figures, the page has no NaN, nothing from elsewhere, and names as they are.
#[test]
fn the_page_stands_alone_whatever_the_figures() {
    for trials in [
        vec![trial(1, 0.3, errors(0.0, 0.0, 0.0))],
        vec![trial(1, 0.3, errors(1e-9, 1e-9, 1e9)), trial(2, 3e5, errors(1e6, -1e6, 0.0))],
        (1..40).map(|n| trial(n, n as f64, errors(10.0 / n as f64, 0.0, 3.0))).collect(),
    ] {
        let study = study(trials);
        let page = crate::study::convergence::page::page(&study);
        for alien in ["http:", "https:", "src=", "href=", "url(", "@import", "<script", "NaN", "inf"] {
            assert!(!page.contains(alien), "{alien} in {page}");
        }
        assert!(page.contains("Büro &lt;1&gt;") && page.ends_with("</html>\n"));
        assert_eq!(page.matches("<svg").count(), page.matches("</svg>").count());
    }
}
