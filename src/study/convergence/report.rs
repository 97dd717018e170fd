//! What `luxmap converge` leaves behind: `convergence.csv`, `report.html`, a table and JSON.

use std::io::{self, Write};

use serde::Serialize;

use crate::error::invalid;
use crate::report::table::columns;
use crate::study::convergence::verdict::{GOAL, figure, findings, race, ratio};
use crate::study::convergence::{PlaneRun, Point, Seconds, Study, curves};
use crate::text::number::{count, duration, round_to};

/// Columns of `convergence.csv`: one line for each run and plane; errors are in % of the reference's mean.
const COLUMNS: [&str; 23] = [
    "scene",
    "plane",
    "method",
    "photons",
    "nearest",
    "passes",
    "seed",
    "seconds_total",
    "seconds_trace",
    "seconds_build",
    "seconds_direct",
    "seconds_gather",
    "seconds_look_around",
    "seconds_other",
    "cells",
    "rmse_percent",
    "bias_percent",
    "worst_percent",
    "claimed_percent",
    "within_1_sigma_percent",
    "within_2_sigma_percent",
    "difference_percent",
    "reference_error_percent",
];

/// One line for each trial; numbers have six significant digits. `rmse_percent` is `difference_percent` without
/// `reference_error_percent`, in quadrature.
///
/// # Errors
/// Where `out` fails, and where a figure isn't finite.
pub fn write_csv(study: &Study, out: &mut impl Write) -> io::Result<()> {
    let mut table = ::csv::WriterBuilder::new().from_writer(out);
    table.write_record(COLUMNS)?;
    for trial in &study.trials {
        let PlaneRun { plane, rung, nearest, seed, seconds, errors } = trial;
        let names = [study.scene.clone(), study.planes[*plane].name.clone(), rung.method.name().into()];
        let whole = [rung.photons, *nearest as u64, rung.passes.into(), *seed].map(|number| number.to_string());
        let errors = [
            errors.rmse(),
            errors.bias,
            errors.worst,
            errors.claimed,
            errors.within_1_sigma,
            errors.within_2_sigma,
            errors.difference,
            errors.reference,
        ];
        let seconds = [seconds.total()].into_iter().chain(seconds.parts());
        if !seconds.clone().chain(errors).all(f64::is_finite) {
            return Err(invalid(format!("a figure of {} on plane \"{}\" isn't finite", names[2], names[1])));
        }
        let six = |number: f64| round_to(number, 6).to_string();
        let line = names.into_iter().chain(whole).chain(seconds.map(six)).chain([trial.errors.cells.to_string()]);
        table.write_record(line.chain(errors.map(six)))?;
    }
    table.flush()
}

/// The study for a person at a terminal: findings, then a table of each plane.
pub fn table(study: &Study) -> String {
    let points = study.points();
    let mut lines = vec![format!("{}: {}", study.scene, extent(study, &points)), String::new()];
    lines.extend(findings(study, &points));
    for (plane, studied) in study.planes.iter().enumerate() {
        let of_plane = || points.iter().filter(|point| point.plane == plane);
        let head = [
            studied.name.as_str(),
            "photons",
            "passes",
            "k",
            "time",
            "RMSE, %",
            "bias, %",
            "worst, %",
            "claimed, %",
            "true/claimed",
            "in 1 σ, %",
            "in 2 σ, %",
        ];
        lines.push(String::new());
        lines.extend(columns(head, of_plane().map(|point| figures(point).map(|text| text.replace('\u{a0}', " ")))));
        lines.push(format!("reference: {}", reference(study, &points, plane)));
    }
    lines.join("\n") + "\n"
}

/// `45 runs, 3 of each setting, 2 threads; errors in % of the reference's mean`
pub(crate) fn extent(study: &Study, points: &[Point]) -> String {
    let rungs = points.iter().filter(|point| point.plane == 0).count();
    let plural = |number: usize, what: &str| format!("{number} {what}{}", if number == 1 { "" } else { "s" });
    let runs = plural(rungs * study.repeats as usize, "run");
    let seeds = plural(study.repeats as usize, "seed");
    format!(
        "{runs}: {} with {seeds} each, {}; errors in % of the reference's mean",
        plural(rungs, "setting"),
        plural(study.threads, "thread")
    )
}

/// `tests/reference/seed-office.floor.csv, own error 0.17 %`
pub(crate) fn reference(study: &Study, points: &[Point], plane: usize) -> String {
    let source = &study.planes[plane].reference;
    match own_error(points, plane) {
        0.0 => format!("{source}, taken as exact"),
        error => format!("{source}, own error {} %", figure(error)),
    }
}

/// A point's line: method, photons, passes, k, time, RMSE, bias, worst, claimed, true/claimed, within 1 σ, within 2 σ.
pub(crate) fn figures(point: &Point) -> [String; 12] {
    let rung = point.rung;
    let signed = |value: f64| {
        let text = figure(value.abs());
        let sign = if text.bytes().all(|c| matches!(c, b'0' | b'.')) {
            ""
        } else if value < 0.0 {
            "−"
        } else {
            "+"
        };
        format!("{sign}{text}")
    };
    let bias = match point.bias_error {
        Some(error) => format!("{} ± {}", signed(point.bias), figure(error)),
        None => signed(point.bias),
    };
    let claimed = if point.claimed > 0.0 { figure(point.claimed) } else { "none".into() };
    let nearest = if point.nearest > 0 { point.nearest.to_string() } else { "–".into() };
    [
        rung.method.name().to_owned(),
        count(rung.photons),
        rung.passes.to_string(),
        nearest,
        duration(point.seconds.total()),
        rmse(point),
        bias,
        figure(point.worst),
        claimed,
        point.true_over_claimed().map_or_else(|| "–".into(), ratio),
        format!("{:.1}", point.within_1_sigma),
        format!("{:.1}", point.within_2_sigma),
    ]
}

/// The error as far as the reference can tell it.
pub(crate) fn rmse(point: &Point) -> String {
    if point.rmse == 0.0 && point.reference == 0.0 || point.is_resolved() {
        figure(point.rmse)
    } else {
        format!("< {}", figure(0.5 * point.reference))
    }
}

#[derive(Serialize)]
struct StudyJson<'a> {
    luxmap: &'static str,
    scene: &'a str,
    scene_sha256: &'a str,
    threads: usize,
    repeats: u32,
    findings: Vec<String>,
    planes: Vec<PlaneSummary<'a>>,
    points: Vec<PointSummary<'a>>,
    warnings: &'a [String],
}

#[derive(Serialize)]
struct PlaneSummary<'a> {
    name: &'a str,
    cells: [usize; 2],
    reference: &'a str,
    reference_error_percent: f64,
    goal_percent: f64,
    race: Vec<Racer>,
}

#[derive(Serialize)]
struct Racer {
    method: &'static str,
    seconds_to_goal: Option<f64>,
}

#[derive(Serialize)]
struct PointSummary<'a> {
    plane: &'a str,
    method: &'static str,
    photons: u64,
    nearest: usize,
    passes: u32,
    seconds: f64,
    stages: Vec<StageSeconds>,
    rmse_percent: f64,
    bias_percent: f64,
    bias_standard_error_percent: Option<f64>,
    worst_percent: f64,
    claimed_percent: f64,
    true_over_claimed: Option<f64>,
    within_1_sigma_percent: f64,
    within_2_sigma_percent: f64,
}

#[derive(Serialize)]
struct StageSeconds {
    name: &'static str,
    seconds: f64,
}

/// The study for programs: one JSON object, units in its keys. `race`: when each method first gets to `goal_percent`,
/// null where it doesn't.
pub fn json(study: &Study) -> String {
    let points = study.points();
    let planes = study.planes.iter().enumerate().map(|(index, plane)| PlaneSummary {
        name: &plane.name,
        cells: plane.cells,
        reference: &plane.reference,
        reference_error_percent: own_error(&points, index),
        goal_percent: GOAL,
        race: race(&curves(&points, index))
            .into_iter()
            .map(|(method, reached)| Racer { method: method.name(), seconds_to_goal: reached.map(|r| r.seconds) })
            .collect(),
    });
    let summary = StudyJson {
        luxmap: env!("CARGO_PKG_VERSION"),
        scene: &study.scene,
        scene_sha256: &study.scene_hash,
        threads: study.threads,
        repeats: study.repeats,
        findings: findings(study, &points),
        planes: planes.collect(),
        points: points.iter().map(|point| PointSummary::new(study, point)).collect(),
        warnings: &study.warnings,
    };
    let mut text = serde_json::to_string_pretty(&summary).expect("numbers, texts and lists make JSON");
    text.push('\n');
    text
}

/// The standard error of a plane's reference, %.
fn own_error(points: &[Point], plane: usize) -> f64 {
    points.iter().filter(|point| point.plane == plane).map(|point| point.reference).fold(0.0, f64::max)
}

impl<'a> PointSummary<'a> {
    fn new(study: &'a Study, point: &Point) -> Self {
        let stages =
            Seconds::NAMES.iter().zip(point.seconds.parts()).map(|(&name, seconds)| StageSeconds { name, seconds });
        Self {
            plane: &study.planes[point.plane].name,
            method: point.rung.method.name(),
            photons: point.rung.photons,
            nearest: point.nearest,
            passes: point.rung.passes,
            seconds: point.seconds.total(),
            stages: stages.collect(),
            rmse_percent: point.rmse,
            bias_percent: point.bias,
            bias_standard_error_percent: point.bias_error,
            worst_percent: point.worst,
            claimed_percent: point.claimed,
            true_over_claimed: point.true_over_claimed(),
            within_1_sigma_percent: point.within_1_sigma,
            within_2_sigma_percent: point.within_2_sigma,
        }
    }
}
