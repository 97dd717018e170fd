//! The table of stiff and extreme cases as documents: all rows in a CSV file, and a page that sums them up, `STABILITY.md`.

use std::fmt::Write as _;
use std::io;
use std::path::Path;

use serde_json::{Value, json};

use crate::error::{Error, OptionError};
use crate::files;
use crate::study::check::CaseResult;
use crate::study::check::cases::GROUPS;

/// What stands from here on in a page is kept when it is written anew: it was measured elsewhere.
pub const KEPT: &str = "## Fuzzing";

const HEAD: &str = "\
# Stability

What luxmap makes of stiff and extreme cases: closed rooms that absorb next to nothing, rooms of micrometres and of planets,
walls without thickness, luminaires inside of things. Each case has an exact answer: a closed form, the same answer as another
scene's, or a refusal. `luxmap check -o STABILITY.md` (or `make check`) computes all of them anew and writes this page, and a CSV
file of the same name with a row for each case; `luxmap check --quick` runs the short ones, as the tests do.

**Verdicts.** *Inside*: within the case's bound. *Warned*: the run says in words, with a number, why it can't be trusted.
*Refused*: it says why it does not begin. *Outside*: wrong, or more certain than it should be.

**Bounds.** *Off/σ* is the difference from the exact answer in units of the standard error that the run itself claims: 4 is the
most, somewhat more for the worst of many cells (√(16 + 2 ln n) of n). Where nothing is random no σ is claimed, and the difference
has to stay within the rounding of coordinates that the case allows. A σ too large to be of use is a fault too. At most 10⁻⁶ of
the emitted flux may be missing from the balance (absorbed + escaped + cut off), and at most 5·10⁻⁸ for each ray of a photon's life
may escape from a closed room.

**Rows of the CSV.** `exact` and `found` are those of the reading that came closest to its bound; `sigma` is what the run claims, 0
where nothing is random. `balance`, `escaped` and `cut_off` are parts of the emitted flux: missing, out of the scene, and still
under way after the most bounces a photon may make.
";

/// The columns of the CSV file.
const COLUMNS: [&str; 15] = [
    "group",
    "case",
    "why",
    "method",
    "reading",
    "exact",
    "found",
    "sigma",
    "off_over_sigma",
    "balance",
    "escaped",
    "cut_off",
    "seconds",
    "verdict",
    "reason",
];

/// What the page needs to know of a row of the CSV file.
#[derive(serde::Deserialize)]
pub struct Entry {
    /// The case's group.
    pub group: String,
    /// Its name.
    pub case: String,
    /// How far off it is, in claimed standard errors; `None` where none is claimed.
    pub off_over_sigma: Option<f64>,
    /// Wall time, s.
    pub seconds: f64,
    /// The word of the verdict.
    pub verdict: String,
    /// Why; empty where there is nothing to say.
    pub reason: String,
}

/// The rows as the text of a CSV file: numbers with six digits, empty cells where there is no number.
pub fn csv(rows: &[CaseResult]) -> String {
    let mut text = COLUMNS.join(",") + "\n";
    for row in rows {
        let cells = cells(row);
        let quoted = cells.iter().map(|cell| quoted(cell)).collect::<Vec<_>>();
        text += &(quoted.join(",") + "\n");
    }
    text
}

/// Reads what [`csv`] has written, in its order.
///
/// # Errors
///
/// A column is missing, or a number is none.
pub fn entries(csv: &str) -> io::Result<Vec<Entry>> {
    Ok(::csv::Reader::from_reader(csv.as_bytes()).deserialize().collect::<Result<_, _>>()?)
}

/// The page about these rows, with `kept` at its end.
pub fn markdown(entries: &[Entry], kept: &str) -> String {
    let mut text = HEAD.to_owned();
    let mut say = |words: std::fmt::Arguments<'_>| writeln!(text, "{words}").expect("a string takes all");
    say(format_args!("\n## Summary\n\n{}\n", totals(entries)));
    say(format_args!("| group | cases | inside | warned | refused | outside | worst off/σ | slowest |"));
    say(format_args!("|---|--:|--:|--:|--:|--:|---|---|"));
    let groups = || GROUPS.iter().filter(|(group, _)| entries.iter().any(|entry| entry.group == *group));
    for (group, _) in groups() {
        let rows: Vec<&Entry> = entries.iter().filter(|entry| entry.group == *group).collect();
        say(format_args!("{}", summary(group, &rows)));
    }
    say(format_args!("\n*Worst off/σ* is that of the cases that are neither warned nor refused.\n\n## The groups\n"));
    for (group, what) in groups() {
        say(format_args!("- **{}.** {what}", capital(group)));
    }
    let reasons = reasons(entries);
    if !reasons.is_empty() {
        say(format_args!("\n## What the runs say\n\nEach message once, as its first case has it.\n"));
    }
    for (entry, count) in reasons {
        let cases = if count == 1 { "1 case".to_owned() } else { format!("{count} cases") };
        say(format_args!("- {}, {cases} of {}: {}", entry.verdict, entry.group, entry.reason));
    }
    say(format_args!(""));
    if kept.is_empty() {
        say(format_args!("{KEPT}\n\nNot run yet."));
    } else {
        text.push_str(kept);
    }
    text
}

/// The part of a page that is kept.
pub fn kept(page: &str) -> &str {
    page.find(&format!("\n{KEPT}")).map_or("", |at| &page[at + 1..])
}

/// Refuses a path for the page at which the CSV file will lie.
///
/// # Errors
///
/// Its ending is that of the CSV file.
pub fn fits(path: &Path) -> Result<(), Error> {
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv")) {
        let expected = "a name for the page, such as STABILITY.md: the rows go into a CSV file beside it".into();
        return Err(OptionError::Value { option: "output", found: path.display().to_string(), expected }.into());
    }
    Ok(())
}

/// Writes the page, and the CSV file beside it; what stands at the end of the old page from [`KEPT`] on is kept.
///
/// # Errors
///
/// The path does not [fit](fits), or a file can't be written.
pub fn write(rows: &[CaseResult], path: &Path) -> Result<(), Error> {
    fits(path)?;
    let old = std::fs::read_to_string(path).unwrap_or_default();
    let csv = csv(rows);
    let entries = entries(&csv).expect("what was just written can be read");
    let page = markdown(&entries, kept(&old));
    files::write_whole(&path.with_extension("csv"), &mut |out| io::Write::write_all(out, csv.as_bytes()))?;
    files::write_whole(path, &mut |out| io::Write::write_all(out, page.as_bytes()))
}

/// How many cases there are, and how they ended.
fn totals(entries: &[Entry]) -> String {
    let [inside, warned, refused, outside] = counts(&entries.iter().collect::<Vec<_>>());
    let seconds: f64 = entries.iter().map(|entry| entry.seconds).sum();
    let count = entries.len();
    format!(
        "{count} cases: {inside} inside, {warned} warned, {refused} refused, {outside} outside; {seconds:.0} s in all."
    )
}

/// Inside, warned, refused, outside.
fn counts(entries: &[&Entry]) -> [usize; 4] {
    ["inside", "warned", "refused", "OUTSIDE"].map(|word| entries.iter().filter(|entry| entry.verdict == word).count())
}

/// The line of a group.
fn summary(group: &str, entries: &[&Entry]) -> String {
    let [inside, warned, refused, outside] = counts(entries);
    let outside = if outside > 0 { format!("**{outside}**") } else { "0".to_owned() };
    let trusted = entries.iter().filter(|entry| !["warned", "refused"].contains(&entry.verdict.as_str()));
    let rated = trusted.filter_map(|entry| Some((entry.off_over_sigma?, &entry.case)));
    let worst =
        rated.max_by(|a, b| a.0.total_cmp(&b.0)).map_or("–".into(), |(off, case)| format!("{off:.2}, {case}"));
    let slowest = entries.iter().max_by(|a, b| a.seconds.total_cmp(&b.seconds));
    let slowest = slowest.map_or("–".into(), |entry| format!("{:.1} s, {}", entry.seconds, entry.case));
    let (group, count) = (capital(group), entries.len());
    format!("| {group} | {count} | {inside} | {warned} | {refused} | {outside} | {worst} | {slowest} |")
}

/// Each reason once, and how many cases have it; reasons that differ in their numbers only are one.
fn reasons(entries: &[Entry]) -> Vec<(&Entry, usize)> {
    let form = |entry: &Entry| -> (String, String, String) {
        let mut words = entry.reason.replace(|c: char| c.is_ascii_digit(), "0");
        while words.contains("00") || words.contains("0.0") {
            words = words.replace("0.0", "0").replace("00", "0");
        }
        (entry.group.clone(), entry.verdict.clone(), words)
    };
    let mut found: Vec<(&Entry, usize)> = Vec::new();
    for entry in entries.iter().filter(|entry| !entry.reason.is_empty()) {
        match found.iter_mut().find(|(first, _)| form(first) == form(entry)) {
            Some((_, count)) => *count += 1,
            None => found.push((entry, 1)),
        }
    }
    found
}

/// The rows for programs.
pub fn json(rows: &[CaseResult]) -> String {
    let row = |row: &CaseResult| -> Value {
        json!({
            "group": row.group, "name": row.name, "why": row.why, "method": row.method, "reading": row.reading,
            "exact": row.exact, "found": row.found, "off": row.off(), "claimed": row.claimed, "allowed": row.allowed,
            "ratio": row.ratio(), "balance": row.balance, "escaped": row.escapes, "cut_off": row.cut_off,
            "seconds": row.seconds, "warnings": row.warnings, "verdict": row.verdict.word(),
            "reason": row.verdict.reason(),
        })
    };
    let all = json!({ "luxmap": env!("CARGO_PKG_VERSION"), "rows": rows.iter().map(row).collect::<Vec<_>>() });
    serde_json::to_string_pretty(&all).expect("numbers, texts and lists make JSON") + "\n"
}

/// A row for a person at a terminal.
pub fn brief(row: &CaseResult) -> String {
    let head = format!("{:<8} {:>6.1} s  {}: {}", row.verdict.word(), row.seconds, row.group, row.name);
    let numbers = match (row.exact, row.found) {
        (Some(exact), Some(found)) => {
            let ratio = row.ratio().map_or(String::new(), |ratio| format!(", {ratio:.1} σ off"));
            format!("  {}: exact {}, found {}{ratio}", row.reading, figure(exact), figure(found))
        }
        _ => String::new(),
    };
    let reason = row.verdict.reason();
    let reason = if reason.is_empty() { String::new() } else { format!("\n         {reason}") };
    format!("{head}{numbers}{reason}\n")
}

/// The cells of a row, in the order of [`COLUMNS`].
fn cells(row: &CaseResult) -> [String; COLUMNS.len()] {
    let number = |number: Option<f64>, text: fn(f64) -> String| number.map_or(String::new(), text);
    [
        row.group.to_owned(),
        row.name.clone(),
        row.why.to_owned(),
        row.method.clone(),
        row.reading.clone(),
        number(row.exact, figure),
        number(row.found, figure),
        number(row.claimed, figure),
        number(row.ratio(), |ratio| format!("{ratio:.2}")),
        number(row.balance, tiny),
        number(row.escapes, tiny),
        number(row.cut_off, tiny),
        format!("{:.1}", row.seconds),
        row.verdict.word().to_owned(),
        row.verdict.reason().to_owned(),
    ]
}

/// A cell of a CSV file, in quotation marks where it has to be.
fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n', '\r']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.to_owned() }
}

/// A number with six digits.
fn figure(number: f64) -> String {
    let size = number.abs();
    if number == 0.0 {
        "0".into()
    } else if (1e-3..1e7).contains(&size) {
        let digits = (5 - size.log10().floor() as i32).clamp(0, 8) as usize;
        let text = format!("{number:.digits$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
    } else {
        format!("{number:.5e}")
    }
}

/// A small share.
fn tiny(share: f64) -> String {
    match share {
        0.0 => "0".into(),
        _ if share >= 1e-3 => format!("{share:.4}"),
        _ => format!("{share:.0e}"),
    }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}
