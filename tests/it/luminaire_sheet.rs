//! `luxmap luminaire` with many files: the list, the contact sheet, the folders.

use std::f64::consts::PI;
use std::fs;
use std::path::Path;

use crate::common::files::{Folder, stderr, stdout};
use serde_json::Value;

/// Degrees between the angles of a file here.
const STEP: usize = 5;

/// I = `candela` · cos γ, on every fifth degree to 90°.
fn cosine(candela: f64, before: &str, between: &str) -> String {
    let angles: Vec<String> = (0..=90).step_by(STEP).map(|gamma| gamma.to_string()).collect();
    let value = |gamma: usize| (candela * (gamma as f64).to_radians().cos()).to_string();
    let values: Vec<String> = (0..=90).step_by(STEP).map(value).collect();
    format!("{before}{}{between}{}\n", angles.join("\n") + "\n", values.join("\n"))
}

/// An LM-63 file of a disc of 0.2 m.
fn ies(candela: f64, maker: &str, name: &str) -> String {
    let head = format!("IESNA:LM-63-2002\n[MANUFAC] {maker}\n[LUMINAIRE] {name}\nTILT=NONE\n");
    cosine(candela, &format!("{head}1 -1 1 {} 1 1 2 -0.2 -0.2 0\n1 1 20\n", 90 / STEP + 1), "0\n")
}

/// A EULUMDAT file of 1.2 m × 0.2 m and 1000 lm of lamps, of which 1000 cd/klm · π come out by `lorl` %.
fn ldt(lorl: f64) -> String {
    let angles = 90 / STEP + 1;
    let head = format!(
        "Maker\n2\n1\n1\n0\n{angles}\n{STEP}\nreport\nLamp\nL1\nfile\ndate\n1200\n200\n50\n1200\n200\n0\n0\n0\n0\n100\n{lorl}\n1\n0\n\
         1\n1\nlamp\n1000\n3000\n80\n20\n{}0\n",
        "0\n".repeat(10)
    );
    cosine(1000.0 / PI, &head, "")
}

/// Header and rows of the list.
fn list(path: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let text = fs::read_to_string(path).unwrap();
    let text = text.strip_prefix('\u{feff}').expect("a byte order mark, for spreadsheets");
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let texts = |record: &csv::StringRecord| record.iter().map(String::from).collect::<Vec<_>>();
    let head = texts(reader.headers().unwrap());
    (head, reader.records().map(|record| texts(&record.unwrap())).collect())
}

/// A cell of a row, by its column.
fn cell<'a>(head: &[String], row: &'a [String], column: &str) -> &'a str {
    &row[head.iter().position(|name| name == column).expect(column)]
}

/// Files of two formats and of the same name, in folders within each other, one of them broken, and much that isn't photometric.
fn mixed(test: &str) -> Folder {
    let folder = Folder::new("luminaire_sheet", test);
    for inner in ["files/deep/deeper", "files/.hidden"] {
        fs::create_dir_all(folder.path(inner)).unwrap();
    }
    folder.write("files/a.ies", &ies(1000.0, "Maker", "A"));
    folder.write("files/a.ldt", &ldt(100.0));
    folder.write("files/deep/a.IES", &ies(500.0, "=HYPERLINK(\"http://x\")", "<script>alert(1)</script>"));
    folder.write("files/deep/deeper/b.ldt", &ldt(50.0));
    folder.write("files/deep/broken.ies", &ies(1000.0, "", "")[..100]);
    folder.write("files/.hidden/h.ies", "");
    folder.write("files/readme.txt", "");
    folder.write("files/data.json", "{}");
    #[cfg(unix)]
    std::os::unix::fs::symlink(".", folder.path("files/loop")).unwrap();
    folder
}

#[test]
fn a_folder_becomes_a_list_a_contact_sheet_and_a_folder_for_each_file() {
    let folder = mixed("many");
    let output = folder.luxmap(&["luminaire", "files"]);
    let (message, text) = (stderr(&output), stdout(&output));
    assert_eq!(output.status.code(), Some(2), "one file can't be read: {message}");
    let lines: Vec<&str> = message.lines().collect();
    assert!(lines[0] == "note: 1 .xml or .json file passed over: neither TM-33 nor ATLA S001", "{message}");
    assert!(lines.len() == 2 && lines[1].starts_with("luxmap: files/deep/broken.ies:"), "{message}");
    assert!(text.contains("5 files, 1 with warnings, 1 not read\n"), "{text}");

    let out = folder.path("out/luminaires");
    let (head, rows) = list(&out.join("luminaires.csv"));
    let column = |name: &str| rows.iter().map(|row| cell(&head, row, name)).collect::<Vec<_>>();
    assert_eq!(
        column("file"),
        ["files/a.ies", "files/a.ldt", "files/deep/a.IES", "files/deep/broken.ies", "files/deep/deeper/b.ldt"]
    );
    assert_eq!(column("folder"), ["a.ies", "a.ldt", "deep_a.IES", "", "deep_deeper_b.ldt"]);
    assert_eq!(column("format"), ["LM-63-2002", "EULUMDAT", "LM-63-2002", "", "EULUMDAT"]);
    assert_eq!(column("maker"), ["Maker", "Maker", "'=HYPERLINK(\"http://x\")", "", "Maker"]);
    // Φ = π I(0) for I(0) cos γ; linear interpolation over 5° takes less than h²/8 = 0.1 %.
    for (found, expected) in column("flux_computed_lm").iter().zip([1000.0 * PI, 1000.0, 500.0 * PI, 0.0, 1000.0]) {
        let found: f64 = found.parse().unwrap_or(0.0);
        assert!((found - expected).abs() <= 1e-3 * expected, "{found} lm, expected {expected}");
    }
    assert_eq!(column("flux_declared_lm"), ["", "1000", "", "", "500"]);
    assert!((cell(&head, &rows[4], "flux_ratio").parse::<f64>().unwrap() - 2.0).abs() < 2e-3);
    assert!(cell(&head, &rows[4], "warnings").ends_with("the file contradicts itself"));
    // cos γ is a half at 60°, a tenth at acos 0.1 = 84.26°; chords of 5° move that by less than 0.1°.
    for (name, expected) in [("beam_c0_deg", 120.0), ("beam_c90_deg", 120.0), ("field_c0_deg", 168.52)] {
        let found: f64 = column(name)[0].parse().unwrap();
        assert!((found - expected).abs() < 0.2, "{name} {found}");
    }
    assert_eq!([column("opening")[0], column("opening_c0_m")[0], column("power_w")[0]], ["ellipse", "0.2", "20"]);
    assert_eq!([column("opening_c0_m")[1], column("opening_c90_m")[1]], ["0.2", "1.2"]);
    assert!(cell(&head, &rows[3], "error").starts_with("files/deep/broken.ies:"));

    let page = fs::read_to_string(out.join("luminaires.html")).unwrap();
    assert_eq!(page.matches("<article").count(), 5);
    assert!(page.contains("&lt;script&gt;alert(1)") && !page.contains("<script>alert"));
    assert!(!page.contains("src=") && page.contains("href=\"deep_deeper_b.ldt/luminaire.html\""));
    for name in ["a.ies", "a.ldt", "deep_a.IES", "deep_deeper_b.ldt"] {
        for file in ["luminaire.html", "luminaire.json", "polar.png", "polar.svg"] {
            assert!(out.join(name).join(file).is_file(), "{name}/{file}");
        }
    }
    let mut written: Vec<String> =
        fs::read_dir(&out).unwrap().flatten().map(|entry| entry.file_name().into_string().unwrap()).collect();
    written.sort_unstable();
    let folders = ["a.ies", "a.ldt", "deep_a.IES", "deep_deeper_b.ldt"];
    assert_eq!(written, [&folders[..], &["luminaires.csv", "luminaires.html"]].concat(), "and nothing else");
}

/// What was written before isn't read as input, and the order of the output is that of the files, whatever the threads.
#[test]
fn json_is_an_array_in_the_files_order_for_any_number_of_threads() {
    let folder = mixed("json");
    let run = |threads: &str| {
        let arguments = ["luminaire", "--json", "-o", "files/out", "files/deep", "files/a.ldt", "files", "missing.ies"];
        let output = folder.command(&arguments).env("RAYON_NUM_THREADS", threads).output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        let csv = fs::read(folder.path("files/out/luminaires.csv")).unwrap();
        let page = fs::read(folder.path("files/out/luminaires.html")).unwrap();
        (stdout(&output), csv, page)
    };
    let (json, csv, page) = run("1");
    assert!(run("3") == (json.clone(), csv, page));
    let found: Vec<Value> = serde_json::from_str(&json).unwrap();
    let files: Vec<&str> = found.iter().map(|object| object["file"].as_str().unwrap()).collect();
    let deep = ["files/deep/a.IES", "files/deep/broken.ies", "files/deep/deeper/b.ldt"];
    assert_eq!(files, [&deep[..], &["files/a.ldt", "files/a.ies", "missing.ies"]].concat());
    let read = |name: &str| fs::read_to_string(folder.path("files/out").join(name).join("luminaire.json")).unwrap();
    assert_eq!(found[0], serde_json::from_str::<Value>(&read("a.IES")).unwrap());
    for unread in [&found[1], &found[5]] {
        let keys: Vec<&String> = unread.as_object().unwrap().keys().collect();
        assert_eq!(keys, ["error", "file"]);
    }
}

#[test]
fn equal_names_with_other_endings_keep_their_results() {
    let folder = mixed("single");
    folder.succeed(&["luminaire", "files/a.ies"]);
    folder.succeed(&["luminaire", "files/a.ldt"]);
    let format = |name: &str| {
        let text = fs::read_to_string(folder.path("out").join(name).join("luminaire.json")).unwrap();
        serde_json::from_str::<Value>(&text).unwrap()["format"].as_str().unwrap().to_owned()
    };
    assert_eq!([format("a.ies"), format("a.ldt")], ["LM-63-2002", "EULUMDAT"]);
}

#[test]
fn a_folder_without_photometric_files_is_refused() {
    let folder = mixed("empty");
    fs::create_dir(folder.path("none")).unwrap();
    let message = folder.refused(&["luminaire", "files", "none"]);
    assert!(
        message.starts_with("luxmap: none: found no photometric file in it or in its folders, expected "),
        "{message}"
    );
    assert!(!folder.path("out").exists());
}
