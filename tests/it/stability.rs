//! Stiff and extreme cases: those that take a moment, and the documents that list all.

use std::fs;
use std::path::Path;

use luxmap::study::check::{cases, document};

/// Every quick case is inside its bound, or refused or warned of as it should be. What `luxmap check` runs beyond them takes
/// minutes.
#[test]
fn quick_cases_are_inside_their_bounds() {
    let folder = crate::common::folder("stability");
    let quick: Vec<_> = cases().into_iter().filter(|case| case.quick).collect();
    assert!(quick.len() > 100, "{} cases", quick.len());
    let rows: Vec<_> = quick.iter().map(|case| case.run(&folder)).collect();
    rows.iter().for_each(|row| print!("{}", document::brief(row)));
    let outside: Vec<String> = rows.iter().filter(|row| row.verdict.is_outside()).map(document::brief).collect();
    assert!(outside.is_empty(), "{}", outside.concat());
    // What is written of them can be read again, whatever commas and quotation marks there are in names and reasons.
    let entries = document::entries(&document::csv(&rows)).expect("the columns that were written");
    assert_eq!(entries.len(), rows.len());
    for (entry, row) in entries.iter().zip(&rows) {
        let word = row.verdict.word();
        assert_eq!(
            [&entry.group, &entry.case, &entry.verdict],
            [row.group, &row.name, word].map(str::to_owned).each_ref()
        );
        assert_eq!(entry.reason, row.verdict.reason());
    }
}

/// STABILITY.csv lists the cases of the code, all of them and no others, in their order, and none is outside; STABILITY.md sums
/// these rows up, and keeps its last part. With LUXMAP_WRITE_DOCS set, this test writes the latter anew.
#[test]
fn the_documents_list_every_case() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |name: &str| fs::read_to_string(root.join(name)).expect("`make check` writes it");
    let entries = document::entries(&read("STABILITY.csv")).expect("`make check` writes it");
    let listed: Vec<(&str, &str)> = entries.iter().map(|entry| (entry.group.as_str(), entry.case.as_str())).collect();
    let cases = cases();
    let expected: Vec<(&str, &str)> = cases.iter().map(|case| (case.group, case.name.as_str())).collect();
    assert_eq!(listed, expected, "out of date: run `make check`");
    let outside: Vec<&str> =
        entries.iter().filter(|entry| entry.verdict == "OUTSIDE").map(|e| e.case.as_str()).collect();
    assert!(outside.is_empty(), "outside of their bounds: {outside:?}");
    let page = read("STABILITY.md");
    let kept = document::kept(&page);
    assert!(!kept.is_empty(), "its last part is kept");
    let expected = document::markdown(&entries, kept);
    if std::env::var_os("LUXMAP_WRITE_DOCS").is_some() {
        fs::write(root.join("STABILITY.md"), &expected).expect("the project's folder is writable");
    } else {
        assert!(page == expected, "STABILITY.md is out of date: LUXMAP_WRITE_DOCS=1 cargo test stability writes it");
    }
}

/// Page and rows have different names, or one would overwrite the other.
#[test]
fn the_page_is_no_csv_file() {
    assert!(document::fits(Path::new("STABILITY.md")).is_ok());
    let message = document::fits(Path::new("out/rows.CSV")).expect_err("it would be overwritten").to_string();
    assert!(message.starts_with("output: found out/rows.CSV, expected a name for the page"), "{message}");
}

/// No two cases have the same name; names go into a table.
#[test]
fn cases_have_names_of_their_own() {
    let mut titles: Vec<String> = cases().iter().map(|case| case.title()).collect();
    assert!(titles.iter().all(|title| !title.contains('|')));
    titles.sort();
    let count = titles.len();
    titles.dedup();
    assert_eq!(titles.len(), count);
}
