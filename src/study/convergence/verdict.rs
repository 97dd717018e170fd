//! What the figures say: which method is the first to a given error, and whether claims are honest.

use crate::render::plan::Method;
use crate::study::convergence::{EffortCurve, Point, Study, curves};
use crate::text::number::{duration, plain_or_scientific, round_to};

/// The error that methods race to, % of the mean.
pub const GOAL: f64 = 1.0;

/// A claim is honest where the true error is within this part of it.
pub const HONEST: f64 = 0.2;

/// When a curve reaches an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reached {
    /// Wall time, s; between two points as a power of the error.
    pub seconds: f64,
    /// Whether the cheapest point is there already, so that less time might do.
    pub at_once: bool,
}

/// When a curve first gets down to `percent`; `None` where it doesn't.
pub fn time_to(points: &[&Point], percent: f64) -> Option<Reached> {
    let first = points.first()?;
    if first.rmse <= percent {
        return Some(Reached { seconds: first.seconds.total(), at_once: true });
    }
    let (before, after) = points.windows(2).map(|pair| (pair[0], pair[1])).find(|(_, after)| after.rmse <= percent)?;
    let (t0, t1) = (before.seconds.total(), after.seconds.total());
    let share = if after.rmse > 0.0 { (before.rmse / percent).ln() / (before.rmse / after.rmse).ln() } else { 1.0 };
    let seconds = if t0 > 0.0 && t1 > 0.0 { t0 * (t1 / t0).powf(share) } else { t1 };
    Some(Reached { seconds, at_once: false })
}

/// When each method first gets to [`GOAL`] on a plane, the best of its curves; methods in the order of their curves.
pub fn race(curves: &[EffortCurve<'_>]) -> Vec<(Method, Option<Reached>)> {
    let mut methods: Vec<(Method, Option<Reached>)> = Vec::new();
    for curve in curves {
        let reached = time_to(&curve.points, GOAL);
        match methods.iter_mut().find(|(method, _)| *method == curve.method) {
            None => methods.push((curve.method, reached)),
            Some((_, best)) => {
                *best = [*best, reached].into_iter().flatten().min_by(|a, b| a.seconds.total_cmp(&b.seconds));
            }
        }
    }
    methods
}

/// Least and largest of true over claimed error, over the points where it is known.
pub fn honesty<'a>(points: impl IntoIterator<Item = &'a Point>) -> Option<[f64; 2]> {
    points
        .into_iter()
        .filter_map(Point::true_over_claimed)
        .map(|ratio| [ratio, ratio])
        .reduce(|[least, most], [ratio, _]| [least.min(ratio), most.max(ratio)])
}

/// The study's findings, a sentence each: the race on each plane, then the claims of each method.
pub fn findings(study: &Study, points: &[Point]) -> Vec<String> {
    let races = study.planes.iter().enumerate().map(|(plane, studied)| {
        let curves = curves(points, plane);
        format!("{}: {}.", studied.name, outcome(&curves))
    });
    let mut methods: Vec<Method> = Vec::new();
    for point in points {
        if !methods.contains(&point.rung.method) {
            methods.push(point.rung.method);
        }
    }
    let claims = methods.into_iter().filter_map(|method| {
        let of_method = points.iter().filter(|point| point.rung.method == method);
        Some(format!("Claims of {}: {}.", method.name(), claim(honesty(of_method)?)))
    });
    races.chain(claims).collect()
}

/// `split is first to 1 %, after 2.31 s; not there: photons (6.8 % at best), seed (13 %)`
fn outcome(curves: &[EffortCurve<'_>]) -> String {
    let best = |method: Method| {
        let points = curves.iter().filter(|curve| curve.method == method).flat_map(|curve| &curve.points);
        points.copied().min_by(|a, b| a.rmse.total_cmp(&b.rmse)).expect("a method with a curve has points")
    };
    let race = race(curves);
    let mut there: Vec<(Method, Reached)> = race.iter().filter_map(|&(m, reached)| Some((m, reached?))).collect();
    there.sort_by(|(_, a), (_, b)| a.seconds.total_cmp(&b.seconds));
    let mut missed: Vec<Method> = race.iter().filter(|(_, reached)| reached.is_none()).map(|&(m, _)| m).collect();
    missed.sort_by(|&a, &b| best(a).rmse.total_cmp(&best(b).rmse));
    let Some(((first, reached), others)) = there.split_first() else {
        let figures = missed.iter().map(|&method| {
            let point = best(method);
            let seconds = duration(point.seconds.total());
            format!("{} ({} % after {seconds})", method.name(), figure(point.rmse))
        });
        return format!("no method gets to {GOAL} %; nearest: {}", figures.collect::<Vec<_>>().join(", "));
    };
    let mut text = match (reached.at_once, best(*first).rmse) {
        (_, 0.0) => {
            format!("{} is exact, as far as the reference tells, after {}", first.name(), duration(reached.seconds))
        }
        (true, _) => format!("{} is first to {GOAL} %, within {} or less", first.name(), duration(reached.seconds)),
        (false, _) => format!("{} is first to {GOAL} %, after {}", first.name(), duration(reached.seconds)),
    };
    for (method, reached) in others {
        text += &format!("; {} after {}", method.name(), duration(reached.seconds));
    }
    if !missed.is_empty() {
        let missed: Vec<String> = missed
            .iter()
            .map(|&method| format!("{} ({} % at best)", method.name(), figure(best(method).rmse)))
            .collect();
        text += &format!("; not there: {}", missed.join(", "));
    }
    text
}

/// `honest, the true error is 0.96 … 1.08 × the claim`
fn claim([least, most]: [f64; 2]) -> String {
    let (too_high, too_low) = (1.0 - HONEST, 1.0 + HONEST); // where the true error is below or above
    let verdict = match (least < too_high, most > too_low) {
        (false, false) => "honest",
        (false, true) if least > too_low => "too low",
        (true, false) if most < too_high => "too high",
        (false, true) => "too low in part",
        (true, false) => "too high in part",
        (true, true) => "too low in part, too high in part",
    };
    format!("{verdict}, the true error is {} … {} × the claim", ratio(least), ratio(most))
}

/// A ratio near 1, to a hundredth; larger ones to two digits.
pub(crate) fn ratio(value: f64) -> String {
    if value < 9.95 { format!("{value:.2}") } else { plain_or_scientific(round_to(value, 2), 2) }
}

/// A per cent figure, to a hundredth below 10 %, then to three digits.
pub(crate) fn figure(percent: f64) -> String {
    match percent.abs() {
        size if size < 9.995 => format!("{percent:.2}"),
        size if size < 99.95 => format!("{percent:.1}"),
        _ => plain_or_scientific(round_to(percent, 3), 3),
    }
}
