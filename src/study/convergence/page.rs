//! The study as a page for a person: findings, charts and a table of each plane.

use std::fmt::Write as _;

use maud::{Markup, html};

use crate::render::plan::Method;
use crate::report::html::{self, document, list, section, table, warnings};
use crate::report::plot::{Axis, Bar, Chart, ChartSeries, Mark, Side, shares};
use crate::study::convergence::report::{extent, figures, reference, rmse};
use crate::study::convergence::verdict::{GOAL, HONEST, figure, findings};
use crate::study::convergence::{EffortCurve, Point, Seconds, Study, curves};
use crate::text::number::{count, duration};

/// Looks of the charts.
const STYLE: &str = include_str!("page.css");

/// Colours there are for methods.
const HUES: usize = 5;

/// A bias below this, %, is drawn on a linear scale.
const SMALL_BIAS: f64 = 0.1;

/// The study as one HTML file that needs nothing else.
pub(super) fn page(study: &Study) -> String {
    let points = study.points();
    let scene = &study.scene;
    let main = html! {
        header { h1 { (scene) ": error against run time" } p { (extent(study, &points)) "." } }
        (headline(study, &points))
        (warnings(&study.warnings))
        @for plane in 0..study.planes.len() { (plane_section(study, &points, plane)) }
        (explanation(study))
    };
    document(&format!("{scene}, convergence"), &[STYLE], &main)
}

/// What the figures say.
fn headline(study: &Study, points: &[Point]) -> Markup {
    let items = findings(study, points).into_iter().map(|finding| match finding.split_once(": ") {
        Some((of, found)) => html! { b { (of) } ": " (found) },
        None => html! { (finding) },
    });
    html! { section class="findings" { (list(items)) } "\n" }
}

/// Charts and table of one plane.
fn plane_section(study: &Study, points: &[Point], plane: usize) -> Markup {
    let curves = curves(points, plane);
    let honest =
        format!("In the band the claim is honest, to {:.0} %; above it a run promises too much.", 100.0 * HONEST);
    let charts = [
        html::figure(
            "Error against time.",
            "Faint lines fall as 1/√t, as pure noise does: a curve that is flatter stops paying.",
            &error_chart(&curves),
        ),
        html::figure("Claimed and true error.", &honest, &claim_chart(&curves)),
        html::figure(
            "Bias.",
            "Mean error over the plane, ± its standard error from seed to seed. Further passes don’t average it away.",
            &bias_chart(&curves),
        ),
        html::figure(
            "Where the time goes.",
            "Share of each stage, and the whole run’s wall time.",
            &time_chart(&curves),
        ),
    ];
    let content = html! {
        p { "Reference: " (reference(study, points, plane)) "." }
        div class="charts" { @for chart in &charts { (chart) } }
        (figures_table(points, plane))
    };
    section(&format!("Plane “{}”", study.planes[plane].name), content)
}

fn figures_table(points: &[Point], plane: usize) -> Markup {
    let head = [
        "Method",
        "Photons a pass",
        "Passes",
        "k",
        "Time",
        "RMSE, %",
        "Bias, %",
        "Worst cell, %",
        "Claimed, %",
        "True / claimed",
        "Within 1 σ, %",
        "Within 2 σ, %",
    ];
    table(head, points.iter().filter(|point| point.plane == plane).map(figures))
}

fn explanation(study: &Study) -> Markup {
    let times = if study.repeats == 1 { "once".to_owned() } else { format!("{} times", study.repeats) };
    let content = html! {
        p {
            "All errors are in % of the reference’s mean, over the cells that have a value in both. RMSE is the root \
             mean square difference of a cell, with the reference’s own noise subtracted in quadrature; hollow marks, \
             and figures with “<”, are runs whose error is below half of that noise, too small for this reference to \
             tell. A run claims the quadratic mean of its cells’ σ. Within 1 σ and 2 σ, of run and reference together, \
             an honest normal error has 68.3 % and 95.4 % of the cells."
        }
        p {
            "Each setting ran " (times) " with seeds of its own, all settings in turns. Times are wall time of whole \
             runs, all planes together, scene loading and written files left out; median of the seeds. "
            code { "convergence.csv" } " has every run."
        }
    };
    section("How to read this", content)
}

/// Number of a method's colour and shape.
fn hue(method: Method) -> usize {
    Method::ALL.iter().position(|(_, known)| *known == method).unwrap_or(0) % HUES
}

/// What a mark says when pointed at.
fn hint(point: &Point) -> String {
    let rung = point.rung;
    let passes = if rung.passes > 1 { format!(" × {} passes", rung.passes) } else { String::new() };
    let nearest = if point.nearest > 0 { format!(", k = {}", point.nearest) } else { String::new() };
    format!(
        "{}, {} photons{passes}{nearest}: {}, RMSE {} %, claimed {} %, bias {:+.2} %",
        rung.method.name(),
        count(rung.photons),
        duration(point.seconds.total()),
        rmse(point),
        figure(point.claimed),
        point.bias,
    )
}

/// Curves as series; points that `place` has no place for are left out.
fn series(curves: &[EffortCurve<'_>], place: impl Fn(&Point) -> Option<[f64; 2]>) -> Vec<ChartSeries> {
    let nth = |index: usize| curves[..index].iter().filter(|curve| curve.method == curves[index].method).count();
    let marks = |curve: &EffortCurve<'_>| {
        let mark = |point: &&Point| {
            Some(Mark { at: place(point)?, spread: None, hollow: !point.is_resolved(), hint: hint(point) })
        };
        curve.points.iter().filter_map(mark).collect()
    };
    curves
        .iter()
        .enumerate()
        .map(|(index, curve)| ChartSeries {
            hue: hue(curve.method),
            dash: nth(index) % 4,
            label: curve.label.clone(),
            side: Side::Right,
            marks: marks(curve),
        })
        .collect()
}

/// Letters of the longest name at a curve's end.
fn letters(curves: &[EffortCurve<'_>]) -> usize {
    curves.iter().map(|curve| curve.label.chars().count()).max().unwrap_or(0)
}

fn all<'a>(curves: &'a [EffortCurve<'a>]) -> impl Iterator<Item = &'a Point> {
    curves.iter().flat_map(|curve| curve.points.iter().copied())
}

/// A note in place of a chart that would be empty.
fn nothing(text: &str) -> Markup {
    html! { p class="nothing" { (text) } }
}

fn error_chart(curves: &[EffortCurve<'_>]) -> Markup {
    let place = |point: &Point| (point.rmse > 0.0).then(|| [point.seconds.total(), point.rmse]);
    if all(curves).filter_map(place).next().is_none() {
        return nothing("No run differs from the reference by more than the reference’s own error.");
    }
    let x = Axis::logarithmic("wall time of a run", "s", all(curves).map(|point| point.seconds.total()));
    let y = Axis::logarithmic("RMSE, % of the mean", "%", all(curves).map(|point| point.rmse));
    let ([start, end], [low, high]) = (x.ends(), y.ends());
    let own = all(curves).map(|point| point.reference).fold(0.0, f64::max);
    let mut chart = Chart::new(x, y, letters(curves));
    if own > low {
        chart.area(&[[start, own], [end, own], [end, low], [start, low]], "unknown");
        chart.note([start, own.min(high)], [6.0, 14.0], false, "below the reference’s own error");
    }
    // Lines of error · √time = constant, half a decade apart, across the frame.
    let (least, most) = ((low * start.sqrt()).log10(), (high * end.sqrt()).log10());
    for half in (2.0 * least).ceil() as i32..=(2.0 * most).floor() as i32 {
        let constant = 10f64.powf(0.5 * f64::from(half));
        chart.line([start, constant / start.sqrt()], [end, constant / end.sqrt()], "guide");
    }
    if (low..high).contains(&GOAL) {
        chart.line([start, GOAL], [end, GOAL], "goal");
    }
    chart.series(&series(curves, place));
    chart.svg("Root mean square error of each run against its wall time, both logarithmic")
}

fn claim_chart(curves: &[EffortCurve<'_>]) -> Markup {
    let place = |point: &Point| (point.rmse > 0.0 && point.claimed > 0.0).then_some([point.claimed, point.rmse]);
    if all(curves).filter_map(place).next().is_none() {
        return nothing("No run claims an error that this reference could check.");
    }
    let values = || all(curves).filter_map(place).flatten();
    let x = Axis::logarithmic("claimed error, % of the mean", "%", values());
    let y = Axis::logarithmic("RMSE, % of the mean", "%", values());
    let [low, high] = x.ends();
    let mut chart = Chart::new(x, y, letters(curves));
    let band = |side: f64| [[low, low * (1.0 + side)], [high, high * (1.0 + side)]];
    let ([a, b], [c, d]) = (band(HONEST), band(-HONEST));
    chart.area(&[a, b, d, c], "band");
    chart.line([low, low], [high, high], "diagonal");
    chart.note([high, low], [-8.0, -10.0], true, "claim too high");
    chart.note([low, high], [8.0, 18.0], false, "claim too low");
    let mut series = series(curves, place);
    for line in &mut series {
        if line.marks.last().is_some_and(|mark| mark.at[1] > mark.at[0]) {
            line.side = Side::Left;
        }
    }
    chart.series(&series);
    chart.svg("True error of each run against the error it claimed, both logarithmic, with the diagonal")
}

fn bias_chart(curves: &[EffortCurve<'_>]) -> Markup {
    let x = Axis::logarithmic("wall time of a run", "s", all(curves).map(|point| point.seconds.total()));
    let ends = all(curves).flat_map(|point| {
        let error = point.bias_error.unwrap_or(0.0);
        [point.bias - error, point.bias + error]
    });
    let y = Axis::symmetric("bias, % of the mean", "%", SMALL_BIAS, ends);
    let mut chart = Chart::new(x, y, letters(curves));
    let mut series = series(curves, |point| Some([point.seconds.total(), point.bias]));
    for (series, curve) in series.iter_mut().zip(curves) {
        series.side = Side::Outside;
        for (mark, point) in series.marks.iter_mut().zip(&curve.points) {
            mark.spread = point.bias_error;
            mark.hollow = false;
        }
    }
    chart.series(&series);
    chart.svg("Mean error over the plane against wall time")
}

fn time_chart(curves: &[EffortCurve<'_>]) -> Markup {
    let effort = |point: &Point| {
        let mut text = format!("{} {}", point.rung.method.name(), short_count(point.rung.photons));
        if point.rung.passes > 1 {
            let _ = write!(text, " × {}", point.rung.passes);
        }
        if let Some(nearest) = point.rung.nearest {
            let _ = write!(text, ", k {nearest}");
        }
        text
    };
    let bars: Vec<Bar> = all(curves)
        .map(|point| Bar {
            hue: hue(point.rung.method),
            label: effort(point),
            parts: point.seconds.parts().to_vec(),
            total: duration(point.seconds.total()),
        })
        .collect();
    shares(&Seconds::NAMES, &bars, "Share of each stage in the time of each run")
}

/// `30 k`, `1.5 M`
fn short_count(number: u64) -> String {
    match number {
        0..1000 => number.to_string(),
        1000..1_000_000 => format!("{} k", number as f64 / 1e3),
        _ => format!("{} M", number as f64 / 1e6),
    }
}
