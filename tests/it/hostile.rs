//! Unbreakable by bad input: hostile files are refused in one line or give a right result, names lead nowhere else, and
//! nothing that is no file is read. `fuzz/` looks for more of the kind; what it found stands in `tests/hostile/`.

use crate::common::hostile;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};

use crate::common::files::Folder;
use hostile::Outcome;
use luxmap::random::Seed;
use luxmap::random::Stream;
use luxmap::scene::{Dimming, Scene};

/// Readers have one folder each.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// What reads an input.
type Read = fn(&[u8]) -> Outcome;

/// Every kind of input, the ending of its files, and what reads it.
const TARGETS: [(&str, &str, Read); 9] = [
    ("scene", "toml", hostile::scene),
    ("obj", "obj", hostile::obj),
    ("mtl", "mtl", hostile::mtl),
    ("ies", "ies", hostile::ies),
    ("ldt", "ldt", hostile::ldt),
    ("reference", "", hostile::reference),
    ("checkpoint", "", hostile::checkpoint),
    ("gldf", "gldf", hostile::gldf),
    ("tm33", "xml", hostile::tm33),
];

fn tests() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests")
}

/// Files of a folder and those below it that end so, in order.
fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().map(|entry| entry.expect("a readable folder").path());
    let mut found: Vec<PathBuf> = entries
        .flat_map(|path| match path.is_dir() {
            true => files(&path, ending),
            false => Vec::from_iter(path.to_string_lossy().ends_with(ending).then_some(path)),
        })
        .collect();
    found.sort();
    found
}

/// Files in `tests/hostile/`, and what is said of them; nothing where they are sound.
const SAID: &[(&str, &str)] = &[
    (
        "scene/array-of-a-billion.toml",
        "found count = [1e6, 1e6] in array of [[luminaire]], expected two whole numbers from 1 to 100000",
    ),
    ("scene/array-of-spheres.toml", "found openings of 32000000 triangles and more in all"),
    ("scene/byte-order-mark-and-crlf.toml", ""),
    ("scene/camera-of-a-billion-pixels.toml", "found pixels = [100000, 10000] in [[camera]]"),
    ("scene/empty.toml", "found neither a [[plane]] nor a [[sensor]], [[surface]] or [[camera]]"),
    ("scene/every-key.toml", ""),
    ("scene/flux-of-1e999.toml", "found flux = 1e999 in [[luminaire]]"),
    ("scene/heading-as-deep-as-the-file.toml", "found broken TOML (recursion limit), expected valid TOML"),
    ("scene/integer-of-64-bits.toml", "found count = [18446744073709551615, 1] in array of [[luminaire]]"),
    ("scene/integer-of-a-thousand-digits.toml", "found name ="),
    ("scene/key-as-deep-as-the-file.toml", "found broken TOML (recursion limit), expected valid TOML"),
    (
        "scene/list-as-deep-as-the-file.toml",
        "found broken TOML (cannot recurse further; max recursion depth met), expected valid TOML",
    ),
    ("scene/mesh-of-itself.toml", "found an OBJ file without faces"),
    ("scene/name-absolute.toml", "found name = \"/etc/x\" in [[plane]]"),
    ("scene/name-empty.toml", "found name = \"\" in [[plane]], expected a name that can be printed"),
    ("scene/name-of-a-dot.toml", "found name = \".\" in [[plane]]"),
    (
        "scene/name-of-a-thousand-letters.toml",
        "found name = \"xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx…\" in [[plane]]",
    ),
    ("scene/name-of-folders.toml", "found name = \"../../etc/x\" in [[plane]]"),
    ("scene/not-utf-8.toml", "found bytes that are no UTF-8, expected text in UTF-8"),
    (
        "scene/nul-escaped-in-a-name.toml",
        "found name = \"L\\u{0}\" in [[luminaire]], expected a name that can be printed",
    ),
    (
        "scene/nul-in-a-name.toml",
        "found broken TOML (invalid basic string), expected non-double-quote visible characters, `\\`",
    ),
    (
        "scene/plane-of-1e18-cells.toml",
        "found cells = [1e9, 1e9] in [[plane]], expected two whole numbers from 1 to 268435456",
    ),
    ("scene/plane-of-a-billion-cells.toml", "found cells = [40000, 30000] in [[plane]]"),
    ("scene/planes-of-many-cells-together.toml", "found cells = [10000, 10000] in [[plane]]"),
    ("scene/position-not-a-number.toml", "found position = [nan, 1, 2] in [[luminaire]]"),
    ("scene/sizes-at-the-limits.toml", ""),
    ("scene/spacing-of-nothing.toml", "found more than 1000000 samples for surface \"f\": 2 triangles, spacing ="),
    (
        "scene/table-as-deep-as-the-file.toml",
        "found broken TOML (cannot recurse further; max recursion depth met), expected valid TOML",
    ),
    (
        "scene/terminal-codes-in-a-name.toml",
        "found name = \"\\u{1b}[2J\" in [[plane]], expected a name that can be printed",
    ),
    ("scene/utf-16.toml", "found bytes that are no UTF-8, expected text in UTF-8"),
    ("obj/backslash-at-the-end.obj", ""),
    ("obj/byte-order-mark-crlf-and-tabs.obj", ""),
    ("obj/compressed.obj", "found a file compressed by gzip, expected an OBJ file; unpack it first"),
    ("obj/faces-above-their-vertices.obj", ""),
    ("obj/faces-of-few-corners.obj", "found an OBJ file without faces that have three different corners"),
    ("obj/index-0.obj", "found vertex 0 in a face, expected 1 … 3; OBJ counts from 1"),
    (
        "obj/index-before-the-first.obj",
        "found vertex -4 in a face, expected no less than -3, as 3 vertices stand above",
    ),
    ("obj/index-of-63-bits.obj", "found vertex 9223372036854775807 in a face, expected 1 … 3"),
    ("obj/index-of-64-bits-and-more.obj", "found vertex 99999999999999999999999 in a face, expected 1 … 3"),
    ("obj/index-out-of-range.obj", "found vertex 4 in a face, expected 1 … 3"),
    ("obj/more-corners-than-allowed.obj", "found a face with 12000 corners, expected from 3 to 10000"),
    (
        "obj/no-break-space-for-a-corner.obj",
        "found \"f 1 2 \u{a0}\", expected f and vertex numbers, as in f 1 2 3 or f 1/1/1 2/2/1 3/3/1",
    ),
    ("obj/no-line-ends.obj", "found an OBJ file without faces"),
    ("obj/nul-bytes.obj", "found \"v 0 0 0\\u{0}\", expected v x y z, three finite numbers"),
    ("obj/number-of-1e999.obj", "found \"1e999 0 0\", expected finite coordinates within 1e9 m of the origin"),
    ("obj/only-backslashes.obj", "found an OBJ file without faces"),
    ("obj/spiral-of-thousands-of-corners.obj", ""),
    ("obj/star-of-thousands-of-corners.obj", ""),
    ("obj/tangle-of-thousands-of-corners.obj", ""),
    ("obj/utf-16.obj", "found text in UTF-16, expected an OBJ file; save it as UTF-8"),
    ("obj/vertical-tab-between-numbers.obj", "found \"v 0\\u{b}0 0 0\", expected v x y z, three finite numbers"),
    (
        "obj/weight-next-to-nothing.obj",
        "found \"1 1 1 1e-320\", expected finite coordinates within 1e9 m of the origin",
    ),
    ("obj/weight-of-nothing.obj", "found \"v 1 1 1 0\", expected v x y z, three finite numbers"),
    ("mtl/blinding.mtl", "found Ke"),
    ("mtl/glass-of-no-index.mtl", ""),
    ("mtl/negative.mtl", "found Kd -0.5 -1"),
    (
        "mtl/no-break-space-for-a-number.mtl",
        "found \"Kd 0.5 0.5 \u{a0}\", expected a keyword and finite numbers, as in Kd 0.5 0.5 0.5",
    ),
    (
        "mtl/nul-bytes.mtl",
        "found \"Kd 0.5\\u{0} 0.5 0.5\", expected a keyword and finite numbers, as in Kd 0.5 0.5 0.5",
    ),
    ("mtl/numbers-that-are-none.mtl", "found Kd NaN inf inf in material \"a\""),
    ("mtl/shares-above-1.mtl", ""),
    ("mtl/ten-thousand-materials.mtl", "found no reflectance for material \"a\""),
    ("mtl/texture-is-itself.mtl", "found no reflectance for material \"a\""),
    ("mtl/texture-outside.mtl", ""),
    (
        "mtl/vertical-tab-for-a-number.mtl",
        "found \"Ks 0 0  \\u{b}\", expected a keyword and finite numbers, as in Kd 0.5 0.5 0.5",
    ),
    ("ies/angles-of-1e999.ies", "found \"1e999\", expected number of vertical angles, 2 to 7201"),
    ("ies/angles-promised-at-the-limit.ies", "found 7201 × 7201 angles, but 5 numbers after them"),
    ("ies/angles-promised-by-the-billion.ies", "found 1000000000, expected number of vertical angles, 2 to 7201"),
    ("ies/empty.ies", "found the end of the file"),
    ("ies/intensity-of-1e308.ies", "found an intensity of"),
    ("ies/least-light.ies", "no light"),
    ("ies/light-at-one-angle.ies", "no light"),
    ("ies/no-light.ies", "found intensities that are all 0, expected some light"),
    ("ies/nul-bytes.ies", "found a byte 0, expected text"),
    ("ies/tilt-of-a-billion.ies", "found 1000000000, expected number of tilt angles, 1 to 721"),
    ("ies/tilt-of-a-folder.ies", "found TILT=\".\", no file that can be read (it is a folder) there"),
    ("ies/tilt-of-another-folder.ies", "found TILT=\"../../etc/passwd\""),
    (
        "ldt/angles-promised-at-the-limit.ldt",
        "found 721 planes × 721 angles (lines 3, 4 and 6), but 4 numbers for them",
    ),
    ("ldt/angles-promised-by-the-billion.ldt", "found \"1000000000\", expected number of C-planes (Mc), 1 to 7201"),
    ("ldt/flux-of-1e999.ldt", "found \"1e999\", expected luminous flux of the lamps, lm"),
    ("ldt/lamps-promised-by-the-billion.ldt", "found \"1000000000\", expected number of sets of lamps, 0 to 1000"),
    ("gldf/a-thousand-variants.xml", ""),
    ("gldf/archive-that-promises-a-billion-files.gldf", "found a zip archive that can't be read"),
    ("gldf/elements-as-deep-as-the-file.xml", "found broken XML (the root node was opened but never closed)"),
    ("gldf/emitters-of-nothing.xml", "found a product without photometry, expected a GLDF file of a luminaire"),
    ("gldf/empty.xml", "found broken XML (the document does not have a root node)"),
    ("gldf/end-of-an-archive-alone.gldf", "found a zip archive that can't be read"),
    ("gldf/flux-of-1e999.xml", "found RatedLuminousFlux \"1e999\", expected lm, from 0 up"),
    ("gldf/product-of-itself.xml", "found the product.xml of a GLDF file"),
    ("gldf/url.xml", "with a photometry that isn't in the archive but at \"http://example.org/lamp.ldt\""),
    ("tm33/a-pair-of-angles-missing.xml", "found no intensity at h 90°, v 45°, expected one for each of 2 planes × 3"),
    ("tm33/angle-not-a-number.xml", "found \"nan\", expected a horizontal angle, a number"),
    ("tm33/elements-as-deep-as-the-file.xml", "found broken XML (the root node was opened but never closed)"),
    ("tm33/entities-of-entities.xml", "found broken XML (XML with DTD detected)"),
    ("tm33/every-intensity-at-angles-of-its-own.xml", "found 300 planes × 300 angles, but 300 intensities"),
    ("tm33/intensity-of-1e308.xml", "found an intensity of 1"),
    ("tm33/lists-as-deep-as-the-file.xml", "found broken JSON, expected JSON of a photometric file"),
    ("tm33/no-light.xml", "found intensities that are all 0, expected some light"),
    ("tm33/poles-in-one-plane.xml", ""),
    ("reference/a-number-of-1e999.csv", "found \"1e999\" in column E_lx"),
    (
        "reference/a-title-as-long-as-the-file.csv",
        "found columns \"xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx…\"",
    ),
    ("reference/more-rows-than-cells.csv", "found one more row, expected 12 for the 4 × 3 cells of plane \"floor\""),
    ("reference/no-columns.csv", "found columns , expected a column E_lx, and standard_error_lx where that is known"),
    ("reference/not-an-image.exr", "found not supported: too new file feature flags, expected an OpenEXR image"),
    ("reference/nul-in-a-title.csv", "found columns \"index\", \"E_l\\u{0}\", \"standard_error_lx\""),
    ("reference/titles-of-control-bytes.csv", "found columns \"index\", \"E_"),
    (
        "reference/thousands-of-columns.csv",
        "found columns \"\", \"\", \"\", \"\", \"\", \"\", \"\", \"\", \"\", \"\", \"\",",
    ),
];

/// What each hostile file comes to, by the table above; none is left out of it.
#[test]
fn hostile_files_come_to_what_they_should() {
    let _alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let mut wrong = Vec::new();
    let mut met = BTreeSet::new();
    for (target, _, read) in TARGETS {
        for path in files(&tests().join("hostile").join(target), "") {
            let name = format!("{target}/{}", path.file_name().expect("a file").to_string_lossy());
            let outcome = read(&fs::read(&path).expect("a readable file"));
            let said = outcome.err().unwrap_or_default();
            let expected = SAID.iter().find(|(known, _)| *known == name);
            let right =
                expected.is_some_and(|(_, part)| if part.is_empty() { said.is_empty() } else { said.contains(part) });
            if !right {
                wrong.push(format!("    (\"{name}\", {said:?}),"));
            }
            met.insert(name);
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(SAID.iter().all(|(name, _)| met.contains(*name)), "a file is missing");
}

/// Words that break readers: numbers at the limits, what looks like structure, bytes that are no text.
const NASTY: [&[u8]; 24] = [
    b"0",
    b"-1",
    b"1e999",
    b"-1e308",
    b"nan",
    b"inf",
    b"9223372036854775807",
    b"4294967296",
    b"1e-320",
    b"\0",
    b"\n",
    b"\r",
    b"\xff\xfe",
    b"\xef\xbb\xbf",
    b"\"",
    b"'",
    b"[",
    b"]",
    b"{",
    b"}",
    b"[[plane]]\n",
    b"\\\n",
    b"/",
    b"..",
];

fn pick(random: &mut Stream, count: usize) -> usize {
    ((f64::from(random.uniform()) * count as f64) as usize).min(count.max(1) - 1)
}

/// An input as it is hurt in the wild: cut off, bytes changed, parts left out, said twice, or put in from another.
fn hurt(input: &[u8], other: &[u8], random: &mut Stream) -> Vec<u8> {
    let mut bytes = input.to_vec();
    for _ in 0..=pick(random, 3) {
        let (at, length) = (pick(random, bytes.len()), 1 + pick(random, 40));
        let end = (at + length).min(bytes.len());
        match pick(random, 10) {
            0 => bytes.truncate(at),
            1 if at < bytes.len() => bytes[at] ^= 1 << pick(random, 8),
            2 if at < bytes.len() => bytes[at] = pick(random, 256) as u8,
            3 => drop(bytes.drain(at..end)),
            4 => drop(bytes.splice(at..at, bytes[at..end].to_vec())),
            5..8 => {
                // Another digit: what stays readable gets farther.
                let digit = bytes[at..].iter().position(u8::is_ascii_digit);
                digit.into_iter().for_each(|further| bytes[at + further] = b'0' + pick(random, 10) as u8);
            }
            8 => drop(bytes.splice(at..end, NASTY[pick(random, NASTY.len())].iter().copied())),
            _ => {
                let from = pick(random, other.len());
                let part = &other[from..(from + length).min(other.len())];
                drop(bytes.splice(at..end, part.iter().copied()));
            }
        }
    }
    bytes
}

/// Whatever happens to an input, it is read as something that makes sense or refused in one line. The targets in `fuzz/` ask
/// the same of inputs that are looked for, not drawn.
#[test]
fn hurt_inputs_are_read_or_refused() {
    let _alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    for (number, (target, ending, read)) in TARGETS.into_iter().enumerate() {
        let sound = hostile::made_up(target);
        sound.iter().for_each(|sound| read(sound).unwrap_or_else(|why| panic!("{target}: {why}")));
        let mut inputs: Vec<Vec<u8>> = std::iter::repeat_n(&sound, 5).flatten().cloned().collect();
        let mut folders = vec![tests().join("hostile").join(target)];
        if !ending.is_empty() {
            folders.extend([tests().join("material"), tests().join("../scenes")]);
        }
        let known = folders.iter().flat_map(|folder| files(folder, ending));
        let small = known.filter(|path| path.metadata().is_ok_and(|metadata| metadata.len() < 8000));
        inputs.extend(small.map(|path| fs::read(path).expect("a readable file")));
        // States are read in milliseconds, all else in much less.
        let cases = if target == "checkpoint" { 150 } else { 900 };
        let mut taken = 0;
        for case in 0..cases {
            let mut random = Seed(171 + number as u64).stream(case as u64);
            let other = &inputs[pick(&mut random, inputs.len())];
            let input = hurt(&inputs[case % inputs.len()], other, &mut random);
            taken += usize::from(read(&input).is_ok());
        }
        println!("{target}: {taken} of {cases} taken");
        assert!((1..cases).contains(&taken), "{target}: {taken} of {cases} taken: that tells nothing");
    }
}

const SENSOR: &str = "[[sensor]]\nname = \"s\"\nposition = [1, 1, 1]\nnormal = [0, 0, 1]\n";
const LAMP: &str = "[[luminaire]]\nname = \"L\"\nposition = [1, 1, 2]\nflux = 3000\n";
const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

/// A scene of one mesh.
fn scene_with(mesh: &str) -> String {
    format!("[[mesh]]\nfile = '{mesh}'\n[material.wall]\nreflectance = 0.5\n{LAMP}{SENSOR}")
}

/// What a scene may name lies in its own folder or below, or in a folder that the user gives: by `..`, by an absolute name, by
/// a link, and by what its files name in turn.
#[test]
fn names_do_not_lead_out_of_the_scene_s_folder() {
    let folder = Folder::new("hostile", "names");
    fs::create_dir_all(folder.path("own/parts")).expect("a folder");
    fs::create_dir_all(folder.path("own-secret")).expect("a folder");
    let mesh = format!("{TRIANGLE}usemtl wall\nf 1 2 3\n");
    ["own/room.obj", "own/parts/room.obj", "shared.obj", "own-secret/room.obj"]
        .iter()
        .for_each(|name| folder.write(name, &mesh));
    folder.write("shared.mtl", "newmtl wall\nKd 0.3 0.3 0.3\n");
    folder.write("own/names-outside.obj", &format!("mtllib ../shared.mtl\n{mesh}"));
    let scene = folder.path("own/scene.toml");
    let load = |mesh: &str, include: &[PathBuf]| {
        fs::write(&scene, scene_with(mesh)).expect("the folder is writable");
        Scene::load_with(&scene, include, &Dimming::AsWritten).map_err(|error| error.to_string())
    };
    for inside in [
        "room.obj",
        "./parts/../room.obj",
        "parts/room.obj",
        "../own/room.obj",
        &folder.path("own/room.obj").display().to_string(),
    ] {
        load(inside, &[]).unwrap_or_else(|error| panic!("{inside}: {error}"));
    }
    let absolute = folder.path("shared.obj").display().to_string();
    let mut outside = vec![
        "../shared.obj",
        "parts/../../shared.obj",
        &absolute,
        "../own-secret/room.obj",
        "../not-there.obj",
        "/etc/passwd",
    ];
    if cfg!(unix) {
        #[cfg(unix)]
        std::os::unix::fs::symlink("../shared.obj", folder.path("own/link.obj")).expect("a link");
        outside.push("link.obj");
    }
    for outside in outside {
        let message = load(outside, &[]).expect_err(outside);
        assert!(
            message.contains("(it lies outside the scene's folder), expected an OBJ file; --include DIR"),
            "{message}"
        );
    }
    for (mesh, include) in
        [("../shared.obj", ""), (&absolute, ""), ("link.obj", ""), ("../own-secret/room.obj", "own-secret")]
    {
        load(mesh, &[folder.path(include)]).unwrap_or_else(|error| panic!("{mesh}: {error}"));
    }
    let warned = load("names-outside.obj", &[]).expect("the scene tells its material").warnings;
    assert!(warned[0].contains("shared.mtl\" left out (it lies outside the scene's folder)"), "{warned:?}");

    // The same by the command line, where a batch passes it on.
    fs::write(&scene, scene_with("../shared.obj")).expect("the folder is writable");
    assert!(folder.refused(&["plan", "own/scene.toml"]).contains("it lies outside"));
    assert!(
        folder
            .refused(&["plan", "own/scene.toml", "--include", "none"])
            .contains("--include: found none, expected a folder")
    );
    assert!(folder.luxmap(&["plan", "own/scene.toml", "--include", "."]).status.success());
    let batch = ["batch", "own/scene.toml", "-q", "--", "--photons=1000", "--passes=1"];
    assert_eq!(folder.luxmap(&batch).status.code(), Some(1));
    assert_eq!(folder.luxmap(&[&batch[..], &["--include=."]].concat()).status.code(), Some(0));
}

/// Devices, pipes and folders are no files: they are refused before they are opened, where a pipe would wait for its writer and
/// a device never end.
#[test]
#[cfg(unix)]
fn what_is_no_file_is_not_read() {
    let folder = Folder::new("hostile", "no files");
    let made = Command::new("mkfifo").arg(folder.path("pipe.obj")).status().expect("mkfifo is there");
    assert!(made.success());
    let pipe = folder.path("pipe.obj");
    for (mesh, found) in
        [("/dev/zero", "it is not a regular file"), ("pipe.obj", "it is not a regular file"), (".", "it is a folder")]
    {
        folder.write("scene.toml", &scene_with(mesh));
        let error = Scene::load_with(&folder.path("scene.toml"), &["/dev".into()], &Dimming::AsWritten)
            .expect_err("no file")
            .to_string();
        assert!(error.contains(found), "{error}");
    }
    folder.write("scene.toml", &format!("{LAMP}{SENSOR}"));
    let pipe = pipe.to_str().expect("text");
    for command in ["plan", "render", "luminaire", "batch", "merge"] {
        for path in [pipe, "/dev/zero", "."] {
            let message = folder.luxmap(&[command, path]);
            assert!(matches!(message.status.code(), Some(1 | 2)), "{command} {path}: {message:?}");
        }
    }
    let plane = "[[plane]]\nname = \"p\"\ncorner = [0, 0, 0]\nalong = [1, 0, 0]\nacross = [0, 1, 0]\ncells = [2, 2]\n";
    folder.write("plane.toml", &format!("{LAMP}{plane}"));
    for (name, target) in
        [("zero.csv", "/dev/zero"), ("zero.exr", "/dev/zero"), ("pipe.csv", "pipe.obj"), ("pipe.exr", "pipe.obj")]
    {
        std::os::unix::fs::symlink(target, folder.path(name)).expect("a link");
        let message = folder.refused(&["converge", "plane.toml", "--reference", name]);
        assert!(message.contains("it is not a regular file"), "{message}");
    }
}

/// Results stay under the output folder, and none takes another's place, whatever planes, surfaces and cameras are called.
#[test]
fn results_stay_in_their_folder() {
    let folder = Folder::new("hostile", "results");
    let long = "x".repeat(199);
    let planes = [
        "summary",
        "report",
        "sensors",
        "Floor",
        "floor",
        "flo_or",
        "flo*or",
        "con",
        "a b",
        "b.exr",
        "checkpoint",
        &long,
        "floor-2",
    ];
    let refused = ["../x", "/etc/x", "a/b", "", ".", "..", "a\\\\b", "c:x", ".hidden", "a\\u0000b", &"x".repeat(300)];
    let plane = |name: &str| {
        format!(
            "[[plane]]\nname = \"{name}\"\ncorner = [0, 0, 0]\nalong = [1, 0, 0]\nacross = [0, 1, 0]\ncells = [2, 2]\non = \"air\"\n"
        )
    };
    for name in refused {
        folder.write("scene.toml", &format!("{LAMP}{}", plane(name)));
        folder.refused(&["render", "scene.toml"]);
    }
    folder.write("scene.toml", &format!("{LAMP}{SENSOR}{}", planes.map(plane).concat()));
    folder.succeed(&["render", "scene.toml", "-o", "results", "-q", "--json"]);
    let all = files(&folder.0, "");
    let names: BTreeSet<String> = all.iter().map(|path| path.to_string_lossy().to_lowercase()).collect();
    // Three files of each plane, summary.json, report.html, sensors.csv; and the scene.
    assert_eq!((all.len(), names.len()), (3 * planes.len() + 4, 3 * planes.len() + 4), "{all:?}");
    let results = folder.path("results");
    assert!(all.iter().all(|path| path.parent() == Some(&results) || path.ends_with("scene.toml")), "{all:?}");
}

/// An image whose head promises a million times a million pixels: nothing of that is believed.
#[test]
fn an_image_s_promises_are_not_believed() {
    let _alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    for image in hostile::made_up("reference") {
        let window = image.windows(10).position(|part| part == b"dataWindow").expect("each has one") + 10 + 1 + 6 + 4;
        for most in [999_999, i32::MAX - 1, -1, i32::MIN] {
            let mut hurt = image.clone();
            hurt[window + 8..window + 12].copy_from_slice(&most.to_le_bytes());
            hurt[window + 12..window + 16].copy_from_slice(&most.to_le_bytes());
            hostile::reference(&hurt).expect_err("it has 4 × 3 pixels");
        }
    }
}
