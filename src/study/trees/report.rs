//! What `luxmap trees` leaves behind: `trees.csv`, `paper.csv`, `trees.html`, a table and NumPy files.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::error::Error;
use crate::files;
use crate::photon_map::Tree;
use crate::report::npy;
use crate::report::table::columns;
use crate::study::trees::{Call, Comparison, Doubling, PhotonSample, TREES, TreeCase, TreeTimes};
use crate::text::number::{count, round_to};

/// Columns of `trees.csv`: one line for each question and tree.
const COLUMNS: [&str; 11] = [
    "set",
    "photons",
    "queries",
    "k",
    "radius_m",
    "threads",
    "tree",
    "build_ms",
    "bytes_per_photon",
    "ns_per_query",
    "ratio_to_kiddo",
];

/// Columns of `paper.csv`: one line for each point of a curve.
const FIGURE_COLUMNS: [&str; 10] =
    ["figure", "pixels", "photons", "k", "radius_m", "threads", "tree", "build_ms", "gather_ms", "speed_up"];

/// One line for each question and tree; numbers have six significant digits.
///
/// `queries` says where trees are asked, with ` visit` where the k nearest are visited instead of summed. A line with k
/// is of the k nearest within the radius (m), one without of a kernel sum within it. `ratio_to_kiddo` is the query's
/// time ÷ kiddo's, empty where kiddo is no contender.
///
/// # Errors
/// Where `out` fails.
pub fn write_csv(cases: &[TreeCase], out: &mut impl Write) -> io::Result<()> {
    let mut table = ::csv::WriterBuilder::new().from_writer(out);
    table.write_record(COLUMNS)?;
    for case in cases {
        let (suffix, k, radius) = match case.call {
            Call::Sum(k) => ("", k.to_string(), case.reach),
            Call::Visit(k) => (" visit", k.to_string(), case.reach),
            Call::Within(radius) => ("", String::new(), radius),
        };
        for entry in &case.entries {
            table.write_record([
                case.set.name().to_owned(),
                case.photons.to_string(),
                case.queries.name().to_owned() + suffix,
                k.clone(),
                six_digits(radius.into()),
                case.threads.to_string(),
                entry.tree.name().to_owned(),
                six_digits(1e3 * entry.build_seconds),
                six_digits(entry.bytes_per_photon),
                six_digits(1e9 * entry.query_seconds),
                case.ratio(entry, query).map_or_else(String::new, six_digits),
            ])?;
        }
    }
    table.flush()
}

/// One line for each point of a curve; numbers have six significant digits. `gather_ms` is the time to sum the k
/// nearest at all pixels, `speed_up` one thread's ÷ this one's.
///
/// # Errors
/// Where `out` fails.
pub fn write_figures(points: &[Doubling], out: &mut impl Write) -> io::Result<()> {
    let mut table = ::csv::WriterBuilder::new().from_writer(out);
    table.write_record(FIGURE_COLUMNS)?;
    for point in points {
        table.write_record([
            point.figure.number().to_string(),
            point.pixels.to_string(),
            point.photons.to_string(),
            point.nearest.to_string(),
            six_digits(point.reach.into()),
            point.threads.to_string(),
            point.tree.name().to_owned(),
            six_digits(1e3 * point.build_seconds),
            six_digits(1e3 * point.gather_seconds),
            six_digits(point.speed_up),
        ])?;
    }
    table.flush()
}

/// Writes photons and the points asked at for programs in any language, as NumPy files of single precision: positions
/// (N × 3, m) to `path`, and beside it, for `path` = `photons.npy`, their flux (N, lm) to `photons.flux.npy` and the
/// points (M × 3, m) to `photons.floor.npy` and `photons.random.npy`. Returns the paths.
///
/// # Errors
/// [`Error::Write`] where a file can't be written.
pub fn dump(sample: &PhotonSample, path: &Path) -> Result<Vec<PathBuf>, Error> {
    let beside = |what: &str| path.with_extension(format!("{what}.npy"));
    let paths = vec![path.to_owned(), beside("flux"), beside("floor"), beside("random")];
    let points =
        |points: &[[f32; 3]], path: &Path| files::write_whole(path, &mut |out| npy::write(points.iter().copied(), out));
    points(&sample.photons.positions, &paths[0])?;
    files::write_whole(&paths[1], &mut |out| npy::write(sample.photons.flux.iter().map(|flux| flux.0), out))?;
    points(&sample.floor, &paths[2])?;
    points(&sample.random, &paths[3])?;
    Ok(paths)
}

/// The comparison as text: what building takes, then what the questions take.
pub fn table(comparison: &Comparison) -> String {
    let cases = &comparison.cases;
    let mut lines = Vec::new();
    if !cases.is_empty() {
        let [build, memory, asked] = ["ms", "B/photon", "ns"].map(|unit| heads(cases, unit));
        let head = ["build of", "photons", "threads"];
        let head = [head[0], head[1], head[2], &build[0], &build[1], &build[2], &memory[0], &memory[1], &memory[2]];
        lines.extend(columns(head, builds(cases).map(build_row)));
        lines.push(String::new());
        let head = ["set", "photons", "at", "question", "threads", &asked[0], &asked[1], &asked[2]];
        lines.extend(columns(head, cases.iter().map(question_row)));
        if cases[0].entries.iter().any(|entry| entry.tree == Tree::Kiddo) {
            lines.push("in brackets: time ÷ kiddo’s".into());
        }
    }
    if !comparison.figures.is_empty() {
        let gap = if lines.is_empty() { "" } else { "\n" };
        lines.push(format!("{gap}the paper’s figures: all pixels’ gather"));
        let head = ["figure", "pixels", "photons", "k", "threads", "tree", "ms", "speed-up"];
        lines.extend(columns(head, comparison.figures.iter().map(figure_row)));
    }
    lines.join("\n") + "\n"
}

/// A column's head for each tree, empty for those that are no contender.
pub(crate) fn heads(cases: &[TreeCase], unit: &str) -> [String; 3] {
    let present = |tree| cases.iter().any(|case| case.entries.iter().any(|entry| entry.tree == tree));
    TREES.map(|tree| if present(tree) { format!("{}, {unit}", tree.name()) } else { String::new() })
}

/// The first question to each build.
pub(crate) fn builds(cases: &[TreeCase]) -> impl Iterator<Item = &TreeCase> {
    let same = |a: &TreeCase, b: &TreeCase| (a.set, a.photons, a.threads) == (b.set, b.photons, b.threads);
    cases.iter().enumerate().filter(move |&(i, case)| i == 0 || !same(&cases[i - 1], case)).map(|(_, case)| case)
}

/// A cell for each tree, empty for those that are no contender.
fn cells(case: &TreeCase, text: impl Fn(&TreeTimes) -> String) -> [String; 3] {
    let entry = |tree| case.entries.iter().find(|entry| entry.tree == tree);
    TREES.map(|tree| entry(tree).map_or_else(String::new, &text))
}

/// A time in a unit, and its ratio to kiddo's.
fn timed(case: &TreeCase, entry: &TreeTimes, time: impl Fn(&TreeTimes) -> f64, unit: f64) -> String {
    let value = three_digits(unit * time(entry));
    match case.ratio(entry, time) {
        Some(ratio) if entry.tree != Tree::Kiddo => format!("{value} ({})", round_to(ratio, 2)),
        _ => value,
    }
}

pub(crate) fn build_row(case: &TreeCase) -> [String; 9] {
    let [kd, kiddo, paper] = cells(case, |entry| timed(case, entry, |entry| entry.build_seconds, 1e3));
    let [kd_bytes, kiddo_bytes, paper_bytes] = cells(case, |entry| three_digits(entry.bytes_per_photon));
    let of = [case.set.name().to_owned(), count(case.photons as u64), case.threads.to_string()];
    let [set, photons, threads] = of;
    [set, photons, threads, kd, kiddo, paper, kd_bytes, kiddo_bytes, paper_bytes]
}

pub(crate) fn question_row(case: &TreeCase) -> [String; 8] {
    let [kd, kiddo, paper] = cells(case, |entry| timed(case, entry, query, 1e9));
    let (set, at) = (case.set.name().to_owned(), case.queries.name().to_owned());
    [set, count(case.photons as u64), at, question(case.call), case.threads.to_string(), kd, kiddo, paper]
}

pub(crate) fn figure_row(point: &Doubling) -> [String; 8] {
    [
        point.figure.number().to_string(),
        count(point.pixels as u64),
        count(point.photons as u64),
        point.nearest.to_string(),
        point.threads.to_string(),
        point.tree.name().to_owned(),
        three_digits(1e3 * point.gather_seconds),
        format!("{:.2}", point.speed_up),
    ]
}

/// `sum of 100`, `visit of 100`, `within 0.2 m`
pub(crate) fn question(call: Call) -> String {
    match call {
        Call::Sum(k) => format!("sum of {k}"),
        Call::Visit(k) => format!("visit of {k}"),
        Call::Within(radius) => format!("within {radius} m"),
    }
}

pub(crate) fn query(entry: &TreeTimes) -> f64 {
    entry.query_seconds
}

fn six_digits(value: f64) -> String {
    round_to(value, 6).to_string()
}

pub(crate) fn three_digits(value: f64) -> String {
    round_to(value, 3).to_string()
}
