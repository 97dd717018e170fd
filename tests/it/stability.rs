//! Stiff and extreme cases: those that take a moment, and the document that lists all.

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
}

/// STABILITY.md lists the cases of the code, all of them and no others, in their order; and none is outside.
#[test]
fn the_document_lists_every_case() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("STABILITY.md");
    let text = std::fs::read_to_string(&path).expect("`make check` writes it");
    let expected: Vec<(String, String)> = cases().into_iter().map(|case| (case.group.to_owned(), case.name)).collect();
    assert_eq!(document::listed(&text), expected, "out of date: run `make check`");
    assert!(!text.contains("**OUTSIDE** |"), "a case is outside its bound");
    assert!(text.contains("\n## Fuzzing\n"), "its last part is kept");
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
