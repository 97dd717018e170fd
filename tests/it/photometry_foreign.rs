//! Photometric files as programs and makers write them, not as the standards say: read as what they mean where that is
//! beyond doubt, and told; else refused in one line.

use crate::common::eulumdat::Ldt;
use crate::common::hostile::gldf;

use std::f64::consts::{FRAC_1_SQRT_2, PI};
use std::fs;
use std::path::Path;

use crate::common::{assert_close, folder, run};
use luxmap::luminaire::photometry::{Format, Photometry, PlaneSystem, Shape, Symmetry};
use luxmap::render::plan::Method;
use luxmap::scene::Scene;
use zip::CompressionMethod;

/// γ from 0° to 90°.
fn angles() -> Vec<f64> {
    (0..=18).map(|i| 5.0 * f64::from(i)).collect()
}

fn list(numbers: &[f64]) -> String {
    numbers.iter().map(|number| format!("{:.3}", number + 0.0)).collect::<Vec<_>>().join(" ")
}

/// What stands above the angles of an LM-63 file of so many angles and planes, from `TILT=` on.
fn head(angles: usize, planes: usize, kind: u8) -> String {
    format!("TILT=NONE\n1 -1 1.0 {angles} {planes} {kind} 2 0.6 1.2 0.0\n1.0 1.0 10.5\n")
}

/// An LM-63 file of 2002 with a table of those planes, as they are listed.
fn ies_of(planes: &[f64], intensity: impl Fn(f64, f64) -> f64) -> String {
    let rows: String = planes
        .iter()
        .map(|&c| list(&angles().iter().map(|&gamma| intensity(c, gamma)).collect::<Vec<_>>()) + "\n")
        .collect();
    format!(
        "IESNA:LM-63-2002\n[MANUFAC] Maker\n{}{}\n{}\n{rows}",
        head(angles().len(), planes.len(), 1),
        list(&angles()),
        list(planes)
    )
}

/// 1000 cos γ cd.
fn cosine(_: f64, gamma: f64) -> f64 {
    1000.0 * gamma.to_radians().cos()
}

fn ies() -> String {
    ies_of(&[0.0], cosine)
}

/// A EULUMDAT file of Isym and planes; 1000 cos γ cd for lamps of 2000 lm, and sets of lamps (number, flux, power).
fn ldt(isym: u8, planes: &[f64], stored: usize, sets: &[[f64; 3]]) -> String {
    let file = Ldt {
        name: "Lamp",
        symmetry: isym,
        planes: planes.to_vec(),
        angles: angles(),
        area: [600.0, 300.0, 0.0, 0.0, 0.0, 0.0],
        ratios: [100.0, 100.0, 1.0, 0.0],
        lamps: sets.to_vec(),
        values: (0..stored).flat_map(|_| angles()).map(|gamma| cosine(0.0, gamma) / 2.0).collect(),
        digits: Some(4),
    };
    file.text()
}

fn parse(name: &str, content: impl AsRef<[u8]>) -> Photometry {
    Photometry::parse(Path::new(name), content.as_ref()).unwrap_or_else(|error| panic!("{error}"))
}

fn refusal(name: &str, content: impl AsRef<[u8]>) -> String {
    let error = Photometry::parse(Path::new(name), content.as_ref()).map(|_| ()).expect_err(name).to_string();
    assert!(!error.contains('\n'), "{error:?}");
    error
}

/// The flux of 1000 cos γ cd is 1000 π lm; linear steps of 5° lose max |f″| h²/8 ≈ h²/8 of it, and the rounding of
/// the numbers here 10⁻³ of a cd.
fn is_lambertian(found: &Photometry, what: &str) {
    let off = found.intensity.flux() / (1000.0 * PI) - 1.0;
    assert!(off.abs() < 5.0_f64.to_radians().powi(2) / 8.0 + 1e-5, "{what}: flux {off:+.5}");
    let at = found.intensity.at(123.0, 60.0);
    assert!((at - 500.0).abs() < 2e-3, "{what}: {at} cd at γ 60°");
}

// Commas

#[test]
fn decimal_commas_are_read_where_only_they_fit() {
    let points = ies().replace("TILT=NONE", "TILT=INCLUDE\n1\n2\n0.0 90.0\n1.0 0.5");
    let expected = parse("a.ies", &points);
    let (label, numbers) = points.split_once("INCLUDE").unwrap();
    let everywhere = format!("{label}INCLUDE{}", numbers.replace('.', ","));
    let mut in_intensities: Vec<String> = points.lines().map(str::to_owned).collect();
    let last = in_intensities.len() - 1;
    in_intensities[last] = in_intensities[last].replace('.', ",");
    let mut in_angles = in_intensities.clone();
    in_angles[last] = points.lines().last().unwrap().to_owned();
    in_angles[last - 2] = in_angles[last - 2].replace('.', ",");
    let in_sizes = points.replace("2 0.6 1.2 0.0", "2 0,6 1,2 0,0");
    for text in [everywhere, in_intensities.join("\n"), in_angles.join("\n"), in_sizes] {
        let found = parse("a.ies", &text);
        assert_eq!(found.intensity, expected.intensity, "{text}");
        assert_eq!((found.opening, &found.tilt, found.power), (expected.opening, &expected.tilt, expected.power));
        let told = found.notes.iter().filter(|note| note.contains("commas are decimal signs")).count();
        assert_eq!(told, 1, "{:?}", found.notes);
    }
    // Commas between numbers are as legal as blanks, and nothing to tell.
    for between in [",", ", ", " ,"] {
        let (label, numbers) = points.split_once("INCLUDE\n").unwrap();
        let lines = numbers.lines().map(|line| line.split(' ').collect::<Vec<_>>().join(between));
        let found = parse("a.ies", format!("{label}INCLUDE\n{}", lines.collect::<Vec<_>>().join("\n")));
        assert_eq!((found.intensity, found.notes), (expected.intensity.clone(), expected.notes.clone()), "{between:?}");
    }
}

#[test]
fn commas_that_may_mean_two_things_are_refused() {
    let expected = ies();
    // Both in one file.
    let mut mixed: Vec<String> = expected.lines().map(str::to_owned).collect();
    let last = mixed.len() - 1;
    mixed[last] = mixed[last].replace('.', ",");
    mixed[last - 2] = mixed[last - 2].replace(' ', ",");
    let error = refusal("a.ies", mixed.join("\n"));
    assert!(error.contains("fit neither as decimal signs nor between numbers"), "{error}");
    // Thousands, which are a thousand times as much.
    let thousands = ies_of(&[0.0], |_, gamma| (15_000.0 - 100.0 * gamma).round()).replace(".000", "");
    let (above, row) = thousands.trim_end().rsplit_once('\n').unwrap();
    let row: Vec<String> =
        row.split(' ').map(|word| format!("{},{}", &word[..word.len() - 3], &word[word.len() - 3..])).collect();
    let error = refusal("a.ies", format!("{above}\n{}\n", row.join(" ")));
    assert!(error.contains("found \"15,000\", which is 15.000 or 15000, expected a number without a comma"), "{error}");
    // Some that can't be thousands tell that the others aren't either.
    let row: Vec<String> = row.iter().map(|word| word.replace("14,000", "0,25")).collect();
    assert_eq!(parse("a.ies", format!("{above}\n{}\n", row.join(" "))).intensity.at(0.0, 0.0), 15.0);
    // EULUMDAT has one item a line: commas are decimal signs there, unless they may part thousands.
    let text = ldt(1, &[0.0], 1, &[[1.0, 2000.0, 10.0]]);
    let found = parse("a.ldt", text.replace('.', ",").replace("lamp,ldt", "lamp.ldt"));
    assert_eq!(found.intensity, parse("a.ldt", &text).intensity);
    assert!(found.notes.iter().all(|note| note.contains("commas are decimal signs")) && !found.notes.is_empty());
    let error = refusal("a.ldt", text.replace("\n2000\n", "\n2,000\n"));
    assert!(error.starts_with("a.ldt:29: found \"2,000\", which is 2.000 or 2000"), "{error}");
}

// Sizes

#[test]
fn openings_too_large_are_told_and_a_scene_can_set_them_right() {
    let feet = ies().replace("2 0.6 1.2 0.0", "1 24 24 0");
    let found = parse("a.ies", &feet);
    let note = found.opening_note.clone().expect("7.3 m are many");
    assert!(found.notes.contains(&note), "{:?}", found.notes);
    assert!(note.starts_with("line 4: a luminous opening of 7.315 m × 7.315 m, as the file counts in feet; in inches it would be 0.6096 m × 0.6096 m"), "{note}");
    let metres = parse("a.ies", ies().replace("2 0.6 1.2 0.0", "2 600 1200 0"));
    assert!(metres.opening_note.unwrap().contains("in mm it would be 1.2 m × 0.6 m"));
    assert_eq!(parse("a.ies", ies()).opening_note, None);

    let folder = folder("foreign_openings");
    fs::write(folder.join("a.ies"), &feet).unwrap();
    let warnings = |keys: &[&str]| {
        let luminaires: String =
            (0..).zip(keys).map(|(i, key)| luminaire(&format!("L{i}"), [0.0; 3], "a.ies", key)).collect();
        fs::write(folder.join("scene.toml"), format!("{luminaires}{}", sensor("s", [0.0, 0.0, -9.0]))).unwrap();
        Scene::load(&folder.join("scene.toml")).unwrap_or_else(|error| panic!("{error}")).warnings
    };
    let own = "opening = { rectangle = [0.61, 0.61] }\n";
    let doubts = |keys: &[&str]| warnings(keys).iter().filter(|warning| warning.contains("luminous opening")).count();
    assert_eq!([doubts(&[""]), doubts(&[own]), doubts(&[own, ""]), doubts(&[own, own])], [1, 0, 1, 0]);
}

fn luminaire(name: &str, [x, y, z]: [f64; 3], file: &str, keys: &str) -> String {
    format!("[[luminaire]]\nname = \"{name}\"\nposition = [{x}, {y}, {z}]\nphotometry = \"{file}\"\n{keys}\n")
}

fn sensor(name: &str, [x, y, z]: [f64; 3]) -> String {
    format!("[[sensor]]\nname = \"{name}\"\nposition = [{x}, {y}, {z}]\nnormal = [0, 0, 1]\n")
}

// Tilt

/// A point source of 1000 cos γ cd that is aimed at a sensor at distance d gives it 1000 f cos ε / d², f being the factor
/// of its lamp's tilt and ε the angle of incidence.
#[test]
fn tilted_lamps_give_what_their_table_says() {
    let folder = folder("foreign_tilt");
    let table = |geometry: u8| format!("INCLUDE\n{geometry}\n4\n0 30 45 60\n1.0 0.95 0.92 0.8");
    for geometry in [1, 2, 3] {
        let text = ies().replace("TILT=NONE", &format!("TILT={}", table(geometry)));
        fs::write(folder.join(format!("{geometry}.ies")), text.replace("2 0.6 1.2 0.0", "2 0 0 0")).unwrap();
    }
    let load = |luminaire: &str| {
        fs::write(folder.join("scene.toml"), format!("{luminaire}{}", sensor("s", [0.0, 0.0, -1.0]))).unwrap();
        Scene::load(&folder.join("scene.toml")).unwrap_or_else(|error| panic!("{error}"))
    };
    // Aimed by 45° towards x, which is C0, or y, which is C90; rotation −90 puts the one where the other was.
    let cases: [(&str, [f64; 3], &str, [f64; 3]); 5] = [
        ("towards C0", [1.0, 0.0, -1.0], "", [0.92, 0.92, 1.0]),
        ("towards C90", [0.0, 1.0, -1.0], "", [0.92, 1.0, 0.92]),
        ("towards C0, turned", [1.0, 0.0, -1.0], "rotation = 90\n", [0.92, 1.0, 0.92]),
        ("in between", [1.0, 0.0, -1.0], "rotation = 45\n", [0.92, 0.95, 0.95]),
        ("hanging", [0.0, 0.0, -1.0], "", [1.0; 3]),
    ];
    for (what, aim, rotation, factors) in cases {
        for (geometry, factor) in (1..).zip(factors) {
            let keys = format!("aim = {aim:?}\n{rotation}");
            let position = aim.map(|part| -part * FRAC_1_SQRT_2 * 3.0);
            let [x, y, z] = [position[0], position[1], position[2] - 1.0];
            let scene = load(&luminaire("L", [x, y, z], &format!("{geometry}.ies"), &keys));
            let results = run(&scene, Method::Split, 1, 0);
            let length = aim.iter().map(|part| part * part).sum::<f64>();
            let (d, incidence) = (3.0 * FRAC_1_SQRT_2 * length.sqrt(), 1.0 / length.sqrt());
            let name = format!("{what}, geometry {geometry}");
            assert_close(&name, results.sensors[0].illuminance, 1000.0 * factor * incidence / (d * d), 1e-6);
            let told =
                scene.warnings.iter().any(|warning| warning.contains("of the light it gives as it was measured"));
            assert_eq!(told, factor != 1.0, "{name}: {:?}", scene.warnings);
        }
    }
    // Beyond the table its last factor; where the scene tells the flux, that is the flux.
    let beyond = load(&luminaire("L", [0.0; 3], "1.ies", "aim = [1, 0, 0]\n"));
    let hanging = load(&luminaire("L", [0.0; 3], "1.ies", ""));
    let ratio = beyond.luminaires[0].flux.0 / hanging.luminaires[0].flux.0;
    assert!((ratio - 0.8).abs() < 1e-12, "{ratio}");
    let last = beyond.warnings.last().unwrap();
    assert!(last.ends_with("1.ies: luminaire \"L\" with lamps that stand upright, tilted by 90°: 0.8 of the light it gives as it was measured (TILT); the table ends there: 0° to 60°"), "{last}");
    let told = load(&luminaire("L", [0.0; 3], "1.ies", "aim = [1, 0, -1]\nflux = 500\n"));
    assert_eq!(told.luminaires[0].flux.0, 500.0);
    assert!(told.warnings.last().unwrap().ends_with("no tilt factor is applied, as flux tells what it gives"));
}

// Lamps

#[test]
fn a_set_of_lamps_is_chosen() {
    let folder = folder("foreign_lamps");
    let text = ldt(1, &[0.0], 1, &[[1.0, 2000.0, 20.0], [2.0, 5000.0, 50.0]]);
    fs::write(folder.join("a.ldt"), &text).unwrap();
    fs::write(folder.join("a.ies"), ies()).unwrap();
    let load = |file: &str, keys: &str| {
        let luminaire = luminaire("L", [0.0; 3], file, keys);
        fs::write(folder.join("scene.toml"), luminaire + &sensor("s", [0.0, 0.0, -1.0])).unwrap();
        Scene::load(&folder.join("scene.toml")).map_err(|error| error.to_string())
    };
    let flux = |keys: &str| load("a.ldt", keys).unwrap().luminaires[0].flux.0;
    let one = flux("lamp_set = 1");
    assert!((flux("lamp_set = 2") / one - 2.5).abs() < 1e-12 && (flux("") / one - 1.0).abs() < 1e-12);
    let warnings = |keys: &str| load("a.ldt", keys).unwrap().warnings;
    assert!(warnings("")[0].contains("2 sets of lamps, alternatives; the first is taken"));
    assert_eq!(warnings("lamp_set = 2"), [""; 0]);
    for (file, keys, says) in [
        ("a.ldt", "lamp_set = 3", "scene.toml:5: found lamp_set = 3, expected 1 to 2: \"a.ldt\" has 2 sets of lamps"),
        ("a.ies", "lamp_set = 2", "scene.toml:5: found lamp_set = 2, expected 1: \"a.ies\" has one set of lamps"),
        ("a.ies", "variant = \"x\"", "scene.toml:5: found variant = \"x\", expected no variant: \"a.ies\" has none"),
        ("a.ldt", "lamp_set = 0", "scene.toml:5: found lamp_set = 0 in [[luminaire]], expected a whole number from 1"),
        ("lambertian", "flux = 1\nlamp_set = 1", "expected a photometric file that lamp_set chooses from"),
    ] {
        let error = load(file, keys).map(|_| ()).unwrap_err();
        assert!(error.contains(says), "{error}");
    }
}

/// cd/klm of no lamps is no cd: refused, unless the scene says what the luminaire gives.
#[test]
fn no_lamps_are_no_light() {
    let folder = folder("foreign_no_lamps");
    let none = ldt(1, &[0.0], 1, &[]);
    let dark = ldt(1, &[0.0], 1, &[[-1.0, 0.0, 10.0]]);
    let error = refusal("a.ldt", &none);
    assert!(
        error.starts_with("a.ldt:26: found no set of lamps, expected more than 0 lm: intensities are cd per 1000 lm")
    );
    assert!(refusal("a.ldt", &dark).starts_with("a.ldt:29: found lamps without a luminous flux"));
    for text in [none, dark] {
        fs::write(folder.join("a.ldt"), text).unwrap();
        let luminaire = luminaire("L", [0.0; 3], "a.ldt", "flux = 3000\n");
        fs::write(folder.join("scene.toml"), luminaire + &sensor("s", [0.0, 0.0, -1.0])).unwrap();
        let scene = Scene::load(&folder.join("scene.toml")).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(scene.luminaires[0].flux.0, 3000.0);
    }
}

// Text

#[test]
fn headers_padding_and_encodings() {
    let of = |header: &str| parse("a.ies", ies().replace("IESNA:LM-63-2002", header));
    for (header, format) in [
        ("ANSI/IES LM-63-19", Format::Lm63_2019),
        ("IES:LM-63-2019", Format::Lm63_2019),
        ("LM-63-2002", Format::Lm63_2002),
        ("IESNA:LM-63-1995", Format::Lm63_1995),
        ("ANSI/IESNA LM-63-02", Format::Lm63_2002),
        ("IESNA91", Format::Lm63_1991),
    ] {
        let found = of(header);
        assert_eq!((found.format, found.notes.len()), (format, 0), "{header}: {:?}", found.notes);
    }
    assert_eq!(
        of("ANSI/IES TM-33-18").notes[0],
        "line 1: \"ANSI/IES TM-33-18\" is a format of its own, not LM-63; read as LM-63-2019"
    );
    let error = refusal("a.ies", "ANSI/IES TM-33-18\n1 2 3\n");
    assert!(error.starts_with("a.ies:1: found \"ANSI/IES TM-33-18\", and neither XML nor a line TILT="), "{error}");
    let simulated = ies().replace("IESNA:LM-63-2002", "IES:LM-63-2019").replace("1.0 1.0 10.5", "1.0 1.00010 10.5");
    assert!(
        parse("a", simulated).remarks.contains(&("file generation".into(), "computer simulation (1.00010)".into()))
    );

    let expected = parse("a.ies", ies());
    let units = || ies().encode_utf16().collect::<Vec<_>>();
    let little: Vec<u8> = units().into_iter().flat_map(u16::to_le_bytes).collect();
    let big: Vec<u8> = units().into_iter().flat_map(u16::to_be_bytes).collect();
    let padded = [ies().as_bytes(), &[0; 500]].concat();
    let ended = [ies().as_bytes(), b"\x1aEND\0\0 1 2 3"].concat();
    for content in
        [&[&b"\xff\xfe"[..], &little].concat(), &[&b"\xfe\xff"[..], &big].concat(), &little, &big, &padded, &ended]
    {
        let found = parse("a.ies", content);
        assert_eq!((found.intensity, found.notes.len()), (expected.intensity.clone(), 0));
    }
}

// Angles

/// Symmetrical about C90–C270, and about nothing else.
fn lopsided(c: f64, gamma: f64) -> f64 {
    let (sin_c, (sin, cos)) = (c.to_radians().sin(), gamma.to_radians().sin_cos());
    1000.0 * cos.max(0.0) * (1.0 + 0.5 * sin_c * sin)
}

/// The same distribution, however its planes are listed: the intensities at the planes come out again, to the three
/// digits that are written here.
#[test]
fn planes_run_any_way_round() {
    let around: Vec<f64> = (0..12).map(|i| 30.0 * f64::from(i)).collect();
    let shifted: Vec<f64> = (0..8).map(|i| 22.5 + 45.0 * f64::from(i)).collect();
    let falling: Vec<f64> = around.iter().rev().copied().collect();
    let anew = [&around[5..], &around[..5]].concat();
    for (planes, symmetry, notes) in [
        (vec![270.0, 300.0, 330.0, 360.0, 390.0, 420.0, 450.0], Symmetry::AboutC90, 0),
        (vec![270.0, 300.0, 330.0, 0.0, 30.0, 60.0, 90.0], Symmetry::AboutC90, 1),
        (vec![90.0, 60.0, 30.0, 0.0, 330.0, 300.0, 270.0], Symmetry::AboutC90, 2),
        (vec![270.0, 240.0, 210.0, 180.0, 150.0, 120.0, 90.0], Symmetry::AboutC90, 1),
        (around, Symmetry::None, 0),
        (falling, Symmetry::None, 1),
        (anew, Symmetry::None, 1),
        (shifted, Symmetry::None, 0),
    ] {
        let found = parse("a.ies", ies_of(&planes, lopsided));
        assert_eq!((found.symmetry, found.notes.len()), (symmetry, notes), "{planes:?}: {:?}", found.notes);
        for &c in &planes {
            for c in [c, 180.0 - c] {
                let is_listed = planes.iter().any(|other| (other - c).rem_euclid(360.0) < 1e-9);
                if is_listed || symmetry == Symmetry::AboutC90 {
                    let off = found.intensity.at(c, 40.0) - lopsided(c, 40.0);
                    assert!(off.abs() < 1e-3, "{planes:?}: C {c}: off by {off} cd");
                }
            }
        }
        // The wave over C has no flux.
        let flux = found.intensity.flux() / (1000.0 * PI) - 1.0;
        assert!(flux.abs() < 5.0_f64.to_radians().powi(2) / 8.0 + 1e-5, "{planes:?}: {flux:+.5}");
    }
    // Between planes 22.5° and 337.5° the grid closes around 0°.
    let shifted = parse("a.ies", ies_of(&[22.5, 112.5, 202.5, 292.5], lopsided));
    let mean = (lopsided(292.5, 40.0) + lopsided(22.5, 40.0)) / 2.0;
    assert!((shifted.intensity.at(337.5, 40.0) - mean).abs() < 1e-3);
    let error = refusal("a.ies", ies_of(&[10.0, 50.0, 100.0], cosine));
    assert!(error.contains("found horizontal angles from 10° to 100°, expected 0° alone"), "{error}");
}

#[test]
fn angles_in_falling_order_mean_the_same() {
    let text = ies();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let count = lines.len();
    for line in [count - 3, count - 1] {
        lines[line] = lines[line].split(' ').rev().collect::<Vec<_>>().join(" ");
    }
    let found = parse("a.ies", lines.join("\n"));
    assert_eq!(found.intensity, parse("a.ies", text).intensity);
    assert_eq!(found.notes, ["line 6: vertical angles in descending order"]);
}

#[test]
fn eulumdat_lists_planes_any_way_round_too() {
    let lamps = [[1.0, 2000.0, 10.0]];
    let half = [270.0, 300.0, 330.0, 0.0, 30.0, 60.0, 90.0];
    let around: Vec<f64> = (0..12).map(|i| (270.0 + 30.0 * f64::from(i)) % 360.0).collect();
    for (isym, planes, stored) in
        [(3, half.to_vec(), 7), (3, around.clone(), 7), (0, around.clone(), 12), (2, around, 7)]
    {
        is_lambertian(&parse("a.ldt", ldt(isym, &planes, stored, &lamps)), &format!("Isym {isym}, {planes:?}"));
    }
}

/// One plane of type B says 1000 cos γ about the nadir, of type A about the horizon.
#[test]
fn one_plane_of_a_floodlight_holds_all_around() {
    let of = |kind: u8| {
        let text = ies().replace(&head(19, 1, 1), &head(19, 1, kind));
        parse("a.ies", text)
    };
    let flood = of(2);
    is_lambertian(&flood, "type B");
    assert_eq!(
        (flood.kind, flood.symmetry, flood.notes.len()),
        (PlaneSystem::B, Symmetry::Rotational, 1),
        "{:?}",
        flood.notes
    );
    let head = of(3);
    assert!((head.intensity.at(0.0, 90.0) - 1000.0).abs() < 1.0 && head.intensity.at(180.0, 80.0) == 0.0);
    assert!((head.intensity.flux() / flood.intensity.flux() - 1.0).abs() < 1e-9);
}

// TM-33

const POINTS: [(f64, f64); 4] = [(0.0, 300.0), (30.0, 250.0), (60.0, 120.0), (90.0, 0.0)];

/// Flux of those about the nadir: 2π ∫ I sin γ dγ, in steps of a hundredth of a degree.
fn flux_of_points() -> f64 {
    let at = |gamma: f64| {
        let pair = POINTS.windows(2).find(|pair| gamma <= pair[1].0).unwrap();
        let [(from, a), (to, b)] = [pair[0], pair[1]];
        a + (b - a) * (gamma - from) / (to - from)
    };
    let step = 0.01_f64;
    let sum: f64 = (0..9000).map(|i| (f64::from(i) + 0.5) * step).map(|g| at(g) * g.to_radians().sin()).sum();
    2.0 * PI * step.to_radians() * sum
}

fn points(form: impl Fn(f64, f64) -> String) -> String {
    POINTS.iter().map(|(gamma, candela)| form(*gamma, *candela)).collect()
}

fn tm33(inner: &str) -> String {
    format!(
        "\u{feff}<?xml version=\"1.0\"?>\n<IESTM33-22><Version>1.1</Version><Header><Manufacturer>Maker</Manufacturer>\
         <CatalogNumber>47</CatalogNumber><Description>Lamp</Description><Laboratory>Lab</Laboratory></Header>{inner}\
         </IESTM33-22>"
    )
}

/// Every dialect says the same light.
#[test]
fn tm33_is_read_in_every_dialect() {
    let examples = points(|v, cd| format!("<IntensityData horz=\"0\" vert=\"{v}\">{}</IntensityData>", cd / 2.0));
    let schema = points(|v, cd| format!("<IntData h=\"0\" v=\"{v}\">{}</IntData>", cd / 2.0));
    let emitter = |data: &str| {
        format!(
            "<Emitter><Quantity>1</Quantity><Description>LED</Description><RatedLumens>700</RatedLumens>\
                 <InputWattage>8</InputWattage>{data}</Emitter>"
        )
    };
    let of_examples = format!(
        "<LuminousData><PhotometryType>CIE _ C</PhotometryType><SymmType>Symm_Full</SymmType>\
                               <Multiplier>2</Multiplier>{examples}</LuminousData>"
    );
    let of_schema = format!(
        "<LuminousData><LuminousIntensity><AbsolutePhotometry>true</AbsolutePhotometry>\
                             <Symm>Symm _ Full</Symm><Multiplier>2.0</Multiplier><NumberMeasured>4</NumberMeasured>\
                             <NumberHorz>1</NumberHorz><NumberVert>4</NumberVert>{schema}</LuminousIntensity>\
                             <LuminousFlux>450</LuminousFlux></LuminousData>"
    );
    let gonio = "<Equipment><Gonioradiometer><Type>IES _ C</Type></Gonioradiometer></Equipment>";
    let old = points(|v, cd| format!("<IntensityData horz=\"0\" vert=\"{v}\">{cd}</IntensityData>"));
    let of_old = format!(
        "<LuminaireOpticalData version=\"1.0\" xmlns=\"http://www.ies.org/tm-33\"><Header><Description>Lamp</Description>\
         </Header>{}</LuminaireOpticalData>",
        emitter(&format!("<IntensityDistribution><PhotometryType>C</PhotometryType>{old}</IntensityDistribution>"))
    );
    let [angles, values] = [0, 1]
        .map(|part| POINTS.iter().map(|point| [point.0, point.1][part].to_string()).collect::<Vec<_>>().join(", "));
    let json = format!(
        "{{\"version\": \"1.0\", \"header\": {{\"description\": \"Lamp\"}}, \"emitters\": [{{\"id\": \"LED\", \
         \"quantity\": 1, \"ratedLumens\": 700, \"inputWatts\": 8, \"intensityDistribution\": {{\"photometryType\": \"C\", \
         \"metric\": \"Luminous\", \"horizontalAngles\": [0], \"verticalAngles\": [{angles}], \"intensities\": [{values}]}}}}]}}"
    );
    for (name, text) in [
        ("a.xml", tm33(&emitter(&of_examples))),
        ("b.xml", tm33(&format!("{gonio}{}", emitter(&of_schema)))),
        ("c.xml", of_old),
        ("d.json", json),
    ] {
        let found = parse(name, &text);
        let flux = found.intensity.flux();
        assert!((flux / flux_of_points() - 1.0).abs() < 1e-6, "{name}: {flux} lm");
        assert_eq!(
            (found.format, found.kind, found.symmetry),
            (Format::Tm33, PlaneSystem::C, Symmetry::Rotational),
            "{name}"
        );
        assert_eq!((found.name.as_str(), found.power, found.lamps[0].flux), ("Lamp", Some(8.0), Some(700.0)), "{name}");
        assert_eq!(found.intensity.at(77.0, 30.0), 250.0, "{name}");
        let notes = ["no luminous area is told, taken for a point; opening = … in [[luminaire]] sets one"];
        assert_eq!(found.notes, notes, "{name}");
    }
}

#[test]
fn tm33_tells_openings_symmetry_and_several_emitters() {
    let table = |planes: &[f64], symmetry: &str, factor: f64| {
        let all = planes.iter().flat_map(|h| POINTS.iter().map(move |(v, cd)| (h, v, cd * factor)));
        let data: String =
            all.map(|(h, v, cd)| format!("<IntensityData horz=\"{h}\" vert=\"{v}\">{cd}</IntensityData>")).collect();
        format!(
            "<LuminousData><PhotometryType>CIE_C</PhotometryType><SymmType>{symmetry}</SymmType>{data}</LuminousData>"
        )
    };
    let luminaire =
        "<Luminaire><Dimensions><Length>1200</Length><Width>300</Width><Height>50</Height></Dimensions></Luminaire>";
    let emitter = |name: &str, inner: &str| {
        format!("<Emitter><Quantity>1</Quantity><Description>{name}</Description>{inner}</Emitter>")
    };
    for (planes, told, symmetry) in [
        (vec![0.0], "Symm_Full", Symmetry::Rotational),
        (vec![0.0, 90.0], "Symm_Quad", Symmetry::Quadrant),
        (vec![0.0, 90.0, 180.0], "Symm_Bi_0", Symmetry::AboutC0),
        (vec![90.0, 180.0, 270.0], "Symm _ Bi _90", Symmetry::AboutC90),
        (vec![0.0, 90.0, 180.0, 270.0, 360.0], "Symm_None", Symmetry::None),
        (vec![0.0, 90.0, 180.0, 270.0], "Symm_Bi_0", Symmetry::None),
    ] {
        let found = parse("a.xml", tm33(&format!("{luminaire}{}", emitter("LED", &table(&planes, told, 1.0)))));
        assert_eq!(found.symmetry, symmetry, "{told}");
        assert!((found.intensity.flux() / flux_of_points() - 1.0).abs() < 1e-6, "{told}");
        let opening = found.opening;
        assert_eq!((opening.shape, opening.c0, opening.c90), (Shape::Rectangle, 1.2, 0.3));
        assert_eq!(found.notes.len(), 1, "{:?}", found.notes);
    }
    // Round, in the bottom face.
    let area = "<EmissionAreas><BottomFace><NumberBottom>1</NumberBottom><BottomArea><Length>200</Length><Width>200</Width>\
                <LengthOffset>0</LengthOffset><WidthOffset>0</WidthOffset><Circular>true</Circular></BottomArea></BottomFace>\
                </EmissionAreas>";
    let one = table(&[0.0], "Symm_Full", 1.0);
    let found = parse("a.xml", tm33(&emitter("LED", &format!("{one}{area}"))));
    assert_eq!(
        (found.opening.shape, found.opening.c0, found.notes.len()),
        (Shape::Ellipse, 0.2, 0),
        "{:?}",
        found.notes
    );
    // Two kinds of emitters shine together.
    let two = tm33(&[emitter("warm", &one), emitter("cold", &table(&[0.0], "Symm_Full", 2.0))].concat());
    let found = parse("a.xml", &two);
    assert!((found.intensity.flux() / flux_of_points() - 3.0).abs() < 1e-6);
    assert!(found.notes.contains(&"2 kinds of emitters, added: all of them shine".to_owned()), "{:?}", found.notes);
    for (text, says) in [
        (
            tm33(&emitter("LED", &table(&[0.0, 90.0], "Symm_Bi_0", 1.0))),
            "found symmetry \"Symm_Bi_0\", but 2 planes from 0° to 90°",
        ),
        (
            tm33(&emitter("LED", &one.replace("CIE_C", "CIE_B"))),
            "found photometry of type \"CIE_B\", expected CIE_C, IES_C, IES_B or IES_A",
        ),
        (tm33(&emitter("LED", &one.replace(">250<", ">x<"))), "a.xml:2: found \"x\", expected an intensity, a number"),
        (
            tm33(&emitter("LED", &one.replace("vert=\"30\"", "vert=\"60\""))),
            "found two intensities at h 0°, v 60°: 250 and 120",
        ),
        (tm33(&emitter("LED", "<SpectralData/>")), "found a TM-33 file with spectra, but without luminous intensities"),
        (tm33(""), "found a TM-33 file without luminous intensities"),
        (tm33("<Emitter>"), "found broken XML ("),
        ("<svg/>".into(), "a.xml: found XML that begins with \"svg\""),
        ("<!DOCTYPE html><html></html>".into(), "a.xml: found a page of HTML"),
        ("{\"a\": 1}".into(), "a.xml: found JSON without emitters"),
        ("{\"a\": ".into(), "a.xml:1: found broken JSON"),
    ] {
        let error = refusal("a.xml", &text);
        assert!(error.contains(says), "{says}\n  but: {error}");
    }
}

// GLDF

/// The cosine in EULUMDAT (3142 lm) and LM-63, in an archive.
fn archive(product: &str) -> Vec<u8> {
    let text = ldt(1, &[0.0], 1, &[[1.0, 2000.0, 10.0]]);
    let files = [("product.xml", product.as_bytes()), ("ldc/a.ldt", text.as_bytes()), ("ldc/b.ies", ies().as_bytes())]
        .map(|(name, content)| (name, content.to_vec()));
    let files: Vec<(&str, &[u8])> = files.iter().map(|(name, content)| (*name, content.as_slice())).collect();
    gldf::archive(&files, CompressionMethod::Deflated)
}

const FILES: [(&str, &str, &str); 2] = [("a", "ldc/eulumdat", "a.ldt"), ("b", "ldc/ies", "b.ies")];

#[test]
fn a_gldf_of_one_light_needs_no_choice() {
    let (fixed, shows) = (gldf::fixed("a", 4000.0), gldf::shows("e"));
    let product = gldf::product(&FILES, &[("e", &fixed)], &[("v1", "White", &shows), ("v2", "Black", &shows)], "");
    for name in ["a.gldf", "a.zip"] {
        let found = parse(name, archive(&product));
        assert!((found.intensity.flux() - 4000.0).abs() < 1e-6, "{} lm", found.intensity.flux());
        assert_eq!((found.format, found.manufacturer.as_str(), found.opening.c90), (Format::Eulumdat, "Maker", 0.6));
        assert!(found.remarks.contains(&("file in the GLDF".into(), "a.ldt".into())), "{:?}", found.remarks);
    }
    // A lamp's flux in place of the file's, as many lamps as the equipment holds.
    let sources = "<LightSources><ChangeableLightSource id=\"s\"><RatedLuminousFlux>500</RatedLuminousFlux>\
                   </ChangeableLightSource></LightSources><Equipments><Equipment id=\"q\"><LightSourceReference \
                   changeableLightSourceId=\"s\" lightSourceCount=\"2\"/></Equipment></Equipments>";
    let emitter = "<ChangeableLightEmitter emergencyBehaviour=\"EmergencyOnly\"><PhotometryReference photometryId=\"p_b\"/>\
                   </ChangeableLightEmitter><ChangeableLightEmitter><PhotometryReference photometryId=\"p_a\"/>\
                   <EquipmentReference equipmentId=\"q\"/></ChangeableLightEmitter>";
    let product = gldf::product(&FILES, &[("e", emitter)], &[("v", "Only", &shows)], sources);
    let half = parse("a.gldf", archive(&product));
    let whole = parse("a.ldt", ldt(1, &[0.0], 1, &[[1.0, 2000.0, 10.0]]));
    assert!((half.intensity.flux() / whole.intensity.flux() - 0.5).abs() < 1e-12);
    assert!(
        half.notes[0].contains("2 light emitters of variant \"Only\", alternatives; the first is taken"),
        "{:?}",
        half.notes
    );
}

#[test]
fn a_variant_of_a_gldf_is_chosen_by_name() {
    let folder = folder("foreign_gldf");
    let emitters = [gldf::fixed("a", 1000.0), gldf::fixed("a", 2500.0), gldf::fixed("b", 1000.0)];
    let [small, large, other] = ["small", "large", "other"].map(gldf::shows);
    let product = gldf::product(
        &FILES,
        &[("small", &emitters[0]), ("large", &emitters[1]), ("other", &emitters[2])],
        &[
            ("v1", "Small", &small),
            ("v2", "Large", &large),
            ("v3", "Other", &other),
            ("v4", "Both", &format!("{small}{other}")),
        ],
        "",
    );
    fs::write(folder.join("a.gldf"), archive(&product)).unwrap();
    let load = |keys: &str| {
        let luminaire = luminaire("L", [0.0; 3], "a.gldf", keys);
        fs::write(folder.join("scene.toml"), luminaire + &sensor("s", [0.0, 0.0, -1.0])).unwrap();
        Scene::load(&folder.join("scene.toml")).map_err(|error| error.to_string())
    };
    let flux = |keys: &str| load(keys).unwrap_or_else(|error| panic!("{error}")).luminaires[0].flux.0;
    assert!((flux("variant = \"Small\"") - 1000.0).abs() < 1e-6 && (flux("variant = \"large\"") - 2500.0).abs() < 1e-6);
    assert!((flux("variant = \"v3\"") - 1000.0).abs() < 1e-6);
    // A file counts as it stands: 1000 π lm to the coarseness of its angles.
    assert!((flux("variant = \"b.ies\"") / (1000.0 * PI) - 1.0).abs() < 1e-3);
    for (keys, says) in [
        (
            "",
            "a.gldf: found 4 variants of different light, expected a choice of one: \"Small\", \"Large\", \"Other\", \"Both\"; variant = \"…\"",
        ),
        (
            "variant = \"Tiny\"",
            "scene.toml:5: found variant = \"Tiny\", expected one of \"Small\", \"Large\", \"Other\", \"Both\"",
        ),
        (
            "variant = \"Both\"",
            "found variant \"Both\", which has 2 light outputs in places of its 3D model, expected one; variant may name one of the files, which then counts as it stands: \"a.ldt\", \"b.ies\"",
        ),
    ] {
        let error = load(keys).map(|_| ()).unwrap_err();
        assert!(error.contains(says), "{says}\n  but: {error}");
    }
}

#[test]
fn archives_that_are_none_of_that_are_refused() {
    let one = |geometry: &str, emitter: &str, files: &[(&str, &str, &str)]| {
        archive(&gldf::product(files, &[("e", emitter)], &[("v", "V", geometry)], ""))
    };
    let (fixed, shows) = (gldf::fixed("a", 10.0), gldf::shows("e"));
    let turned = fixed.replace("<Photo", "<Rotation><X>0</X><Y>90</Y><Z>0</Z><G0>0</G0></Rotation><Photo");
    let bomb = gldf::archive(&[("product.xml", &vec![b' '; 17 << 20])], CompressionMethod::Deflated);
    assert!(bomb.len() < 1 << 20, "a small file that unpacks to a large one");
    let mut cut = one(&shows, &fixed, &FILES);
    cut.truncate(cut.len() / 2);
    let inner = gldf::archive(&[("x", b"y")], CompressionMethod::Stored);
    let nested = gldf::product(&[("a", "ldc/eulumdat", "a.ldt")], &[("e", &fixed)], &[("v", "V", &shows)], "");
    let nested = gldf::archive(&[("product.xml", nested.as_bytes()), ("ldc/a.ldt", &inner)], CompressionMethod::Stored);
    for (name, content, says) in [
        ("a.gldf", one(&shows, &turned, &FILES), "found variant \"V\", whose emitter is turned"),
        (
            "a.gldf",
            one(&shows, &fixed, &[("a", "ldc/eulumdat", "gone.ldt")]),
            "found no file \"gone.ldt\" in the archive",
        ),
        ("a.gldf", bomb, "found \"product.xml\" in the archive, more than 16 MiB when unpacked"),
        ("a.gldf", cut, "found a zip archive that can't be read"),
        ("a.gldf", nested, "a.gldf/ldc/a.ldt"),
        ("a.zip", inner.clone(), "a.zip: found a zip archive without product.xml"),
        ("a.uld", inner, "a.uld: found a ULD file, DIALux's own format"),
    ] {
        let error = refusal(name, content);
        assert!(error.contains(says), "{says}\n  but: {error}");
    }
}

/// What isn't read is named, with the way round.
#[test]
fn formats_that_are_not_read_are_named() {
    for (name, says) in [
        ("a.rolf", "a ROLF file, Relux's own format"),
        ("a.ULD", "a ULD file, DIALux's own format"),
        ("a.tm14", "a CIBSE TM14 file"),
        ("a.cibse", "a CIBSE TM14 file"),
        ("a.lum", "a LUM file"),
    ] {
        for content in [&b"some text\n1 2 3\n"[..], b"\x01\x00\x02\x00\x00\x00 bytes"] {
            let error = refusal(name, content);
            let expected = format!("{name}: found {says}");
            assert!(
                error.starts_with(&expected)
                    && error.ends_with("export it as EULUMDAT (.ldt) or LM-63 (.ies), or get that file from the maker"),
                "{error}"
            );
        }
    }
    assert!(refusal("a.ies", b"\x1f\x8b\x08abc").contains("a file compressed by gzip"));
    // Content comes before the ending.
    is_lambertian(&parse("a.uld", ies()), "LM-63 by its content");
}
