//! The comparison as a page for a person: findings, charts and a table of each set, the paper's figures.

use maud::{Markup, html};

use crate::photon_map::Tree;
use crate::report::html::{document, figure, list, own, section, table};
use crate::report::plot::{Axis, Chart, ChartSeries, Mark, Side};
use crate::study::trees::report::{build_row, builds, figure_row, heads, query, question, question_row, three_digits};
use crate::study::trees::{Call, Comparison, Doubling, Figure, Queries, Set, TREES, TreeCase};
use crate::text::number::{count, duration, round_to};

/// Looks of the charts, and what this page adds to them.
const STYLE: [&str; 2] = [include_str!("../convergence/page.css"), include_str!("page.css")];

/// The comparison as one HTML file that needs nothing else.
pub(super) fn page(comparison: &Comparison) -> String {
    let cases = &comparison.cases;
    let main = html! {
        header { h1 { "kd-trees against each other" } p { (extent(comparison)) "." } }
        (findings(cases))
        (figures(&comparison.figures))
        @for (_, set) in Set::ALL { (set_section(cases, set)) }
        (section("How to read this", own(EXPLANATION)))
    };
    document("kd-trees", &STYLE, &main)
}

/// What was compared, in one line.
fn extent(comparison: &Comparison) -> String {
    let threads = comparison.cases.iter().map(|case| case.threads);
    let threads = threads.chain(comparison.figures.iter().map(|point| point.threads)).max().unwrap_or(1);
    let threads = if threads > 1 { format!("1 and {threads} threads") } else { "1 thread".to_owned() };
    let scene = comparison.scene.as_ref().map_or_else(String::new, |scene| format!("photons of {scene}, "));
    let machine = comparison.machine.as_ref().map_or_else(String::new, |machine| format!(", {machine}"));
    format!("{scene}{threads}{machine}")
}

/// The most photons of a set.
fn most(cases: &[TreeCase], set: Set) -> Option<usize> {
    cases.iter().filter(|case| case.set == set).map(|case| case.photons).max()
}

/// What the figures say: each tree's times, of kiddo's, on one thread and with the most photons.
fn findings(cases: &[TreeCase]) -> Markup {
    let mut items = Vec::new();
    for (name, set) in Set::ALL {
        let Some(photons) = most(cases, set) else { continue };
        let asked: Vec<&TreeCase> =
            cases.iter().filter(|case| case.set == set && case.photons == photons && case.threads == 1).collect();
        for tree in TREES.into_iter().filter(|tree| *tree != Tree::Kiddo) {
            let ratios = |time: fn(&crate::study::trees::TreeTimes) -> f64| {
                let ratio = |case: &&TreeCase| {
                    case.entries.iter().find(|entry| entry.tree == tree).and_then(|entry| case.ratio(entry, time))
                };
                asked.iter().filter_map(ratio).collect::<Vec<f64>>()
            };
            let (queries, build) = (ratios(query), ratios(|entry| entry.build_seconds));
            let ends = [f64::min as fn(f64, f64) -> f64, f64::max].map(|pick| queries.iter().copied().reduce(pick));
            let ([Some(low), Some(high)], Some(build)) = (ends, build.first()) else { continue };
            let [low, high, build] = [low, high, *build].map(|ratio| round_to(ratio, 2).to_string());
            items.push(html! {
                b { (name) ", " (count(photons as u64)) " photons" } ": " (tree.name()) " takes " (low) " to " (high)
                " of kiddo’s time for a query, " (build) " for its build."
            });
        }
    }
    html! {
        @if !items.is_empty() {
            section class="findings" { p { "One thread, the most photons of each set:" } (list(items)) } "\n"
        }
    }
}

/// Charts and tables of one set.
fn set_section(cases: &[TreeCase], set: Set) -> Markup {
    let cases: Vec<TreeCase> = cases.iter().filter(|case| case.set == set).cloned().collect();
    let Some(photons) = most(&cases, set) else { return Markup::default() };
    let one = |case: &&TreeCase| case.threads == 1;
    let mut charts = Vec::new();
    let sums = |case: &TreeCase| match case.call {
        Call::Sum(k) if case.photons == photons => Some(k as f64),
        _ => None,
    };
    charts.push(figure(
        "Time against k.",
        &format!(
            "Sum over the k nearest of {} photons, one thread; at the floor’s points, dashed at random photons.",
            count(photons as u64)
        ),
        &query_chart("k", &cases.iter().filter(one).collect::<Vec<_>>(), sums),
    ));
    let visited = cases.iter().find_map(|case| match case.call {
        Call::Visit(k) => Some(k),
        _ => None,
    });
    let middle =
        |case: &TreeCase| (matches!(case.call, Call::Sum(k) if Some(k) == visited)).then_some(case.photons as f64);
    if cases.iter().any(|case| case.photons != photons) {
        charts.push(figure(
            "Time against photons.",
            &format!(
                "Sum over the {} nearest, one thread; at the floor’s points, dashed at random photons.",
                visited.unwrap_or(0)
            ),
            &query_chart("photons", &cases.iter().filter(one).collect::<Vec<_>>(), middle),
        ));
        charts.push(figure(
            "Build.",
            "From positions and flux to a photon map that can be asked; dashed on all threads.",
            &build_chart(&builds(&cases).collect::<Vec<_>>()),
        ));
    }
    let [build, memory, asked] = ["ms", "B/photon", "ns"].map(|unit| heads(&cases, unit));
    let head = ["Build of", "photons", "threads"];
    let head = [head[0], head[1], head[2], &build[0], &build[1], &build[2], &memory[0], &memory[1], &memory[2]];
    let builds = table(head, builds(&cases).map(build_row));
    let head = ["Set", "photons", "at", "question", "threads", &asked[0], &asked[1], &asked[2]];
    let questions = table(head, cases.iter().map(question_row));
    let content = html! {
        p { (capital(set.words())) "." }
        div class="charts" { @for chart in &charts { (chart) } }
        details {
            summary { "All figures; in brackets: time ÷ kiddo’s" }
            (builds) (questions)
        }
    };
    section(set.name(), content)
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Number of a tree's colour and shape.
fn hue(tree: Tree) -> usize {
    TREES.iter().position(|known| *known == tree).unwrap_or(0)
}

/// Time a query of each tree against what `place` tells of a case; cases without a place are left out.
fn query_chart(title: &str, cases: &[&TreeCase], place: impl Fn(&TreeCase) -> Option<f64>) -> Markup {
    let mut all = Vec::new();
    for tree in TREES {
        for queries in Queries::ALL {
            let mark = |case: &&TreeCase| {
                let entry = case.entries.iter().find(|entry| entry.tree == tree)?;
                let time = 1e6 * entry.query_seconds;
                let (name, at) = (tree.name(), queries.name());
                let of = count(case.photons as u64);
                let hint = format!("{name}, {} at {at}, {of} photons: {} µs", question(case.call), three_digits(time));
                Some(Mark { at: [place(case)?, time], spread: None, hollow: false, hint })
            };
            let marks: Vec<Mark> = cases.iter().filter(|case| case.queries == queries).filter_map(mark).collect();
            let dashed = queries == Queries::Random;
            all.push(series(tree, dashed, if dashed { String::new() } else { tree.name().into() }, marks));
        }
    }
    chart(title, "", "time a query", "µs", all)
}

fn build_chart(cases: &[&TreeCase]) -> Markup {
    let most = cases.iter().map(|case| case.threads).max().unwrap_or(1);
    let mut all = Vec::new();
    for tree in TREES {
        for threads in if most > 1 { vec![1, most] } else { vec![1] } {
            let mark = |case: &&TreeCase| {
                let entry = case.entries.iter().find(|entry| entry.tree == tree)?;
                let time = entry.build_seconds;
                let of = count(case.photons as u64);
                let hint = format!("{}, {of} photons, {threads} threads: {}", tree.name(), duration(time));
                Some(Mark { at: [case.photons as f64, 1e3 * time], spread: None, hollow: false, hint })
            };
            let marks: Vec<Mark> = cases.iter().filter(|case| case.threads == threads).filter_map(mark).collect();
            all.push(series(tree, threads > 1, if threads > 1 { String::new() } else { tree.name().into() }, marks));
        }
    }
    chart("photons", "", "build", "ms", all)
}

fn series(tree: Tree, dashed: bool, label: String, mut marks: Vec<Mark>) -> ChartSeries {
    marks.sort_by(|a, b| a.at[0].total_cmp(&b.at[0]));
    ChartSeries { hue: hue(tree), dash: usize::from(dashed), label, side: Side::Outside, marks }
}

/// A chart with both axes logarithmic.
fn chart(x: &str, x_unit: &'static str, y: &str, y_unit: &'static str, all: Vec<ChartSeries>) -> Markup {
    let all: Vec<ChartSeries> = all.into_iter().filter(|series| !series.marks.is_empty()).collect();
    let values = |axis: usize| all.iter().flat_map(|series| &series.marks).map(move |mark| mark.at[axis]);
    let axes = (Axis::logarithmic(x, x_unit, values(0)), Axis::logarithmic(y, y_unit, values(1)));
    let letters = all.iter().map(|series| series.label.chars().count()).max().unwrap_or(0);
    let mut chart = Chart::new(axes.0, axes.1, letters);
    chart.series(&all);
    chart.svg(&format!("{y} against {x}, both logarithmic"))
}

/// The paper's figures: time and speed-up of each, and a table.
fn figures(points: &[Doubling]) -> Markup {
    if points.is_empty() {
        return Markup::default();
    }
    let most = points.iter().map(|point| point.threads).max().unwrap_or(1);
    let mut charts = Vec::new();
    for of in Figure::ALL {
        let points: Vec<&Doubling> = points.iter().filter(|point| point.figure == of).collect();
        let curve = |tree: Tree, threads: usize, value: fn(&Doubling) -> f64, text: fn(&Doubling) -> String| {
            let own = points.iter().filter(|point| point.tree == tree && point.threads == threads);
            let mark = |point: &&Doubling| {
                let (name, size) = (tree.name(), count(point.size() as u64));
                let hint = format!("{name}, {size} {}, {threads} threads: {}", of.words(), text(point));
                Mark { at: [point.size() as f64, value(point)], spread: None, hollow: false, hint }
            };
            own.map(mark).collect::<Vec<_>>()
        };
        let time = |point: &Doubling| point.gather_seconds;
        let both = if most > 1 { vec![1, most] } else { vec![1] };
        let times = TREES.into_iter().flat_map(|tree| {
            let curve = &curve;
            both.iter().map(move |&threads| {
                let label = if threads > 1 { String::new() } else { tree.name().to_owned() };
                series(tree, threads > 1, label, curve(tree, threads, time, |point| duration(point.gather_seconds)))
            })
        });
        let (number, words) = (of.number(), of.words());
        let dashed = if most > 1 { format!("; dashed on {most} threads") } else { String::new() };
        charts.push(figure(
            &format!("Figure {number}: time against {words}."),
            &format!("Sums of the k nearest at all pixels, one thread{dashed}."),
            &chart(words, "", "gather", "s", times.collect()),
        ));
        if most > 1 {
            let speed_up = |point: &Doubling| format!("{:.2} ×", point.speed_up);
            let curves = TREES.into_iter().map(|tree| {
                series(tree, false, tree.name().into(), curve(tree, most, |point| point.speed_up, speed_up))
            });
            charts.push(figure(
                &format!("Figure {number}: speed-up against {words}."),
                &format!("One thread’s time ÷ that of {most} threads."),
                &chart(words, "", "speed-up", "×", curves.collect()),
            ));
        }
    }
    let head = ["Figure", "pixels", "photons", "k", "threads", "tree", "gather, ms", "speed-up"];
    let content = html! {
        p {
            "Pixels, photons and k are doubled one at a time, on the scene’s photons; the search radius is a tenth of \
             the room’s diagonal, and grows with k as the area does that holds k photons."
        }
        div class="charts" { @for chart in &charts { (chart) } }
        details { summary { "All figures" } (table(head, points.iter().map(figure_row))) }
    };
    section("The paper’s Figures 5 to 7", content)
}

const EXPLANATION: &str = "\
<p>Trees: <b>kd</b> is luxmap’s own, <b>kiddo</b> the library’s immutable one, <b>paper</b> that of the paper luxmap \
follows. Before anything was timed, each gave brute force’s answers at a sample of the points: the same distances, and \
the same sums where no photons are equally far.</p>
<p>A sum of k is (count, Σ flux, R²) of the k nearest photons within a tenth of the room’s diagonal; a visit shows \
each of them; within r is Σ φ (1 − d²/r²). Trees take turns, all with the same points, and the median of the turns \
counts; where a tree is slow, fewer points are asked for. Build times include the flux laid out as the tree reads it; \
bytes a photon don’t. <code>trees.csv</code> and <code>paper.csv</code> have every figure.</p>
";
