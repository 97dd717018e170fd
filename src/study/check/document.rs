//! The table of stiff and extreme cases as a document: `STABILITY.md`.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Value, json};

use crate::error::Error;
use crate::files;
use crate::study::check::CaseResult;
use crate::study::check::cases::GROUPS;

/// What stands from here on in a document is kept when it is written anew: it was measured elsewhere.
pub const KEPT: &str = "## Fuzzing";

const HEAD: &str = "\
# Stability

What luxmap makes of stiff and extreme cases: closed rooms that absorb next to nothing, rooms of micrometres and of planets,
walls without thickness, luminaires inside of things. Each case has an exact answer: a closed form, the same answer as another
scene's, or a refusal. `luxmap check -o STABILITY.md` (or `make check`) computes all of it anew and writes this file;
`luxmap check --quick` takes a part of it, as do the tests.

**How to read a row.** *Exact* is what must come out, *found* what did, of the reading that came closest to its bound where a case
has several. *Off/σ* is the difference in units of the error that the run itself claims: 4 is the most, somewhat more for the
worst of many cells (√(16 + 2 ln n) of n). Where nothing is left to chance, no σ is claimed, and the difference has to stay within
the rounding of coordinates that the case allows. A claim so large that it would excuse anything is a fault too. *Balance* is the
part of the emitted flux that is missing from the books (absorbed + escaped + cut off); up to 10⁻⁶ is allowed. *Escaped* is the
part of the light that left the scene; of closed rooms at most 5·10⁻⁸ for each ray of a photon's life. *Cut off* is light still
under way after the most bounces a photon may make. *Verdict*: **inside** its bound; **warned**: the run says in words, with a
number, why it can't be trusted; **refused**: it says why it does not begin; **OUTSIDE**: wrong, or surer than it should be.
";

/// The document, with `kept` at its end.
pub fn markdown(rows: &[CaseResult], kept: &str) -> String {
    let mut text = HEAD.to_owned();
    let count = |word: &str| rows.iter().filter(|row| row.verdict.word() == word).count();
    let seconds: f64 = rows.iter().map(|row| row.seconds).sum();
    let mut say = |words: std::fmt::Arguments<'_>| writeln!(text, "{words}").expect("a string takes all");
    say(format_args!(
        "\nluxmap {}: {} cases, {} inside, {} warned, {} refused, {} outside; {seconds:.0} s.",
        env!("CARGO_PKG_VERSION"),
        rows.len(),
        count("inside"),
        count("warned"),
        count("refused"),
        count("OUTSIDE"),
    ));
    for (group, what) in GROUPS {
        if !rows.iter().any(|row| row.group == group) {
            continue;
        }
        say(format_args!("\n## {}\n\n{what}\n", capital(group)));
        say(format_args!(
            "| case | what is hard | method | reading | exact | found | σ | off/σ | balance | escaped | cut off | s | verdict |"
        ));
        say(format_args!("|---|---|---|---|---|---|---|---|---|---|---|---|---|"));
        for row in rows.iter().filter(|row| row.group == group) {
            say(format_args!("{}", line(row)));
        }
        let reasons: Vec<&CaseResult> =
            rows.iter().filter(|row| row.group == group && !row.verdict.reason().is_empty()).collect();
        if !reasons.is_empty() {
            say(format_args!(""));
        }
        for row in reasons {
            say(format_args!("- {}, {}: {}", row.name, row.verdict.word(), row.verdict.reason()));
        }
    }
    say(format_args!(""));
    if kept.is_empty() {
        say(format_args!("{KEPT}\n\nNot run yet."));
    } else {
        text.push_str(kept);
    }
    text
}

/// Names of the cases that a document lists: (group, case).
pub fn listed(document: &str) -> Vec<(String, String)> {
    let mut group = String::new();
    let mut listed = Vec::new();
    for line in document.lines().take_while(|line| *line != KEPT) {
        if let Some(title) = line.strip_prefix("## ") {
            group = title.to_lowercase();
        } else if let Some(case) = line.strip_prefix("| ").and_then(|line| line.split(" | ").next())
            && case != "case"
        {
            listed.push((group.clone(), case.to_owned()));
        }
    }
    listed
}

/// Writes the document; what stands at the end of the old one from [`KEPT`] on is kept.
pub fn write(rows: &[CaseResult], path: &Path) -> Result<(), Error> {
    let old = std::fs::read_to_string(path).unwrap_or_default();
    let kept = old.find(&format!("\n{KEPT}")).map_or("", |at| &old[at + 1..]);
    let text = markdown(rows, kept);
    files::write_whole(path, &mut |out| std::io::Write::write_all(out, text.as_bytes()))
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

fn line(row: &CaseResult) -> String {
    let known = |number: Option<f64>, text: fn(f64) -> String| number.map_or("–".to_owned(), text);
    let exact = if row.reading.is_empty() { "–".into() } else { row.exact.map_or("no value".into(), figure) };
    let found = match (row.found, row.reading.is_empty()) {
        (Some(found), _) => figure(found),
        (None, true) => "–".into(),
        (None, false) => "no value".into(),
    };
    let cells = [
        row.name.clone(),
        row.why.to_owned(),
        row.method.clone(),
        if row.reading.is_empty() { "–".into() } else { row.reading.clone() },
        exact,
        found,
        known(row.claimed, |sigma| if sigma > 0.0 { figure(sigma) } else { "none".into() }),
        known(row.ratio(), |ratio| format!("{ratio:.2}")),
        known(row.balance, tiny),
        known(row.escapes, tiny),
        known(row.cut_off, tiny),
        format!("{:.1}", row.seconds),
        match row.verdict.is_outside() {
            true => format!("**{}**", row.verdict.word()),
            false => row.verdict.word().to_owned(),
        },
    ];
    format!("| {} |", cells.join(" | "))
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
