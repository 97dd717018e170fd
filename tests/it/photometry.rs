//! Photometric files: what is known about a distribution, written in every edition and symmetry, has to come out
//! again.

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::common::eulumdat::Ldt;
use luxmap::luminaire::photometry::{Format, Photometry, PlaneSystem, Shape, Symmetry};
use luxmap::random::{Seed, Stream};

/// Steps of the tables written here, degrees.
const STEP: [f64; 2] = [15.0, 5.0];

/// Error of reading between the entries, cd: linear interpolation errs by max |f″| h²/8 in each direction. |∂²I/∂γ²|
/// stays under 6000 cd/rad² and |∂²I/∂C²| under 1000.
fn between() -> f64 {
    (1000.0 * STEP[0].to_radians().powi(2) + 6000.0 * STEP[1].to_radians().powi(2)) / 8.0
}

/// Error of the flux, a part of it: as above, relative to cos γ alone, for waves over C have no flux, nor errors of
/// it.
fn of_flux() -> f64 {
    6.0 * STEP[1].to_radians().powi(2) / 8.0
}

/// A distribution of 1000 π lm that has exactly this symmetry; C and γ in degrees.
fn intensity(symmetry: Symmetry, c: f64, gamma: f64) -> f64 {
    let ((sin_c, cos_c), (sin, cos)) = (c.to_radians().sin_cos(), gamma.to_radians().sin_cos());
    let waves = match symmetry {
        Symmetry::Rotational => 0.0,
        Symmetry::Quadrant => 0.4 * (cos_c * cos_c - sin_c * sin_c) * sin * sin,
        Symmetry::AboutC0 => 0.5 * cos_c * sin,
        Symmetry::AboutC90 => 0.5 * sin_c * sin,
        Symmetry::None => 0.5 * (0.8 * cos_c + 0.6 * sin_c) * sin,
    };
    1000.0 * cos.max(0.0) * (1.0 + waves)
}

fn steps(from: f64, to: f64, step: f64) -> Vec<f64> {
    (0..=((to - from) / step).round() as usize).map(|i| from + step * i as f64).collect()
}

fn list(numbers: &[f64], between: &str) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(between)
}

/// An LM-63 file to be.
struct Ies {
    header: &'static str,
    tilt: &'static str,
    /// Lamps, lumens, multiplier.
    lamps: [f64; 3],
    kind: u8,
    /// Unit, width, length, height.
    opening: [f64; 4],
    /// Ballast factor, the number after it, power.
    ballast: [f64; 3],
    /// Planes, angles, intensities.
    planes: Vec<f64>,
    angles: Vec<f64>,
    values: Vec<f64>,
}

impl Ies {
    /// 1000 cos γ cd all around.
    fn new() -> Self {
        Self::of(Symmetry::Rotational, vec![0.0], 90.0)
    }

    /// A distribution on those planes, down to that γ.
    fn of(symmetry: Symmetry, planes: Vec<f64>, last: f64) -> Self {
        let angles = steps(0.0, last, STEP[1]);
        let values =
            planes.iter().flat_map(|&c| angles.iter().map(move |&gamma| intensity(symmetry, c, gamma))).collect();
        Self {
            header: "IESNA:LM-63-2002\n",
            tilt: "NONE\n",
            lamps: [1.0, -1.0, 1.0],
            kind: 1,
            opening: [2.0, 0.0, 0.0, 0.0],
            ballast: [1.0, 1.0, 0.0],
            planes,
            angles,
            values,
        }
    }

    fn text(&self) -> String {
        let [lamps, lumens, multiplier] = self.lamps;
        let mut text = format!(
            "{}[TEST] 7\n[MANUFAC] Maker\n[LUMCAT] 4711\n[LUMINAIRE] Lamp\n[MORE] of tests\n[LAMP] LED\nTILT={}",
            self.header, self.tilt
        );
        let counts = format!("{} {} {}", self.angles.len(), self.planes.len(), self.kind);
        let _ = writeln!(text, "{lamps} {lumens} {multiplier} {counts} {}", list(&self.opening, " "));
        let _ = writeln!(text, "{}\n{}", list(&self.ballast, " "), list(&self.angles, " "));
        let _ = writeln!(text, "{}", list(&self.planes, " "));
        for plane in self.values.chunks(self.angles.len()) {
            let _ = writeln!(text, "{}", list(plane, " "));
        }
        text
    }

    fn read(&self) -> Photometry {
        parse("lamp.ies", self.text().as_bytes())
    }
}

/// A EULUMDAT file of a distribution of [`intensity`] in cd, as cd/klm of 2000 lm.
fn ldt_of(kind: u8, planes: Vec<f64>, stored: &[f64]) -> Ldt {
    let symmetry = SYMMETRIES[usize::from(kind)];
    let angles = steps(0.0, 90.0, STEP[1]);
    let value = |c: f64, gamma: f64| intensity(symmetry, c, gamma) / 2.0;
    let values = stored.iter().flat_map(|&c| angles.iter().map(move |&gamma| value(c, gamma))).collect();
    Ldt {
        name: "Lamp of tests",
        symmetry: kind,
        planes,
        angles,
        area: [0.0; 6],
        ratios: [100.0, 50.0 * PI, 1.0, 0.0],
        lamps: vec![[1.0, 2000.0, 25.0]],
        values,
        digits: None,
    }
}

/// The same of Isym 1.
fn ldt() -> Ldt {
    ldt_of(1, vec![0.0], &[0.0])
}

fn parse(name: &str, content: &[u8]) -> Photometry {
    Photometry::parse(Path::new(name), content).unwrap_or_else(|error| panic!("{error}"))
}

/// Whether a file says 1000 π lm in the right directions, all of them at `scale`.
fn check(found: &Photometry, symmetry: Symmetry, scale: f64, what: &str) {
    for (c, gamma) in (0..72).flat_map(|c| (0..18).map(move |g| (5.0 * f64::from(c), 5.0 * f64::from(g) + 1.0))) {
        let [at, expected] = [found.intensity.at(c, gamma) / scale, intensity(symmetry, c, gamma)];
        assert!(
            (at - expected).abs() < between(),
            "{what}: C {c} γ {gamma}: {at} cd, expected {expected} ± {}",
            between()
        );
    }
    let flux = found.intensity.flux() / scale / (1000.0 * PI);
    assert!((flux - 1.0).abs() < of_flux(), "{what}: flux {flux} of what it is");
}

/// Planes that LM-63 asks for, by symmetry.
fn planes_of_ies() -> [(Symmetry, Vec<f64>); 8] {
    [
        (Symmetry::Rotational, vec![0.0]),
        (Symmetry::Quadrant, steps(0.0, 90.0, STEP[0])),
        (Symmetry::AboutC0, steps(0.0, 180.0, STEP[0])),
        (Symmetry::AboutC90, steps(90.0, 270.0, STEP[0])),
        (Symmetry::AboutC90, steps(-90.0, 90.0, STEP[0])),
        (Symmetry::None, steps(0.0, 360.0, STEP[0])),
        (Symmetry::None, steps(0.0, 345.0, STEP[0])),
        (Symmetry::None, steps(-180.0, 180.0, STEP[0])),
    ]
}

const EDITIONS: [(&str, Format); 8] = [
    ("", Format::Lm63_1986),
    ("IESNA91\n", Format::Lm63_1991),
    ("IESNA:LM-63-1991\n", Format::Lm63_1991),
    ("IESNA:LM-63-1995\n", Format::Lm63_1995),
    ("IESNA:LM-63-2002\n", Format::Lm63_2002),
    ("IESNA: LM-63-2002\n", Format::Lm63_2002),
    ("iesna:lm-63-2002 \n", Format::Lm63_2002),
    ("IES:LM-63-2019\n", Format::Lm63_2019),
];

#[test]
fn every_edition_and_symmetry_of_lm63_says_the_same() {
    for (header, format) in EDITIONS {
        for (symmetry, planes) in planes_of_ies() {
            for last in [90.0, 180.0] {
                let count = planes.len();
                let file = Ies { header, ..Ies::of(symmetry, planes.clone(), last) };
                let found = file.read();
                let what = format!("{header:?} {symmetry:?} {count} planes to γ {last}");
                assert_eq!((found.format, found.symmetry, found.kind), (format, symmetry, PlaneSystem::C), "{what}");
                assert_eq!(found.tabulated, [count, file.angles.len()], "{what}");
                assert_eq!(found.notes, [""; 0], "{what}");
                check(&found, symmetry, 1.0, &what);
            }
        }
    }
}

/// Multiplier and ballast factor count in every edition, the number after them in the first two only.
#[test]
fn factors_count_as_each_edition_says() {
    for (header, format) in EDITIONS {
        let found = Ies { header, lamps: [2.0, 500.0, 3.0], ballast: [0.9, 0.7, 40.0], ..Ies::new() }.read();
        let old = matches!(format, Format::Lm63_1986 | Format::Lm63_1991);
        check(&found, Symmetry::Rotational, if old { 3.0 * 0.9 * 0.7 } else { 3.0 * 0.9 }, header);
        assert_eq!((found.flux, found.lamps[0].flux, found.power), (None, Some(1000.0), Some(40.0)), "{header}");
        assert!(!found.lamps[0].absolute);
        let noted = matches!(format, Format::Lm63_1995 | Format::Lm63_2002);
        assert_eq!(found.notes.len(), usize::from(noted), "{:?}", found.notes);
    }
    let generation = Ies { header: "IES:LM-63-2019\n", ballast: [1.0, 1.100_01, 40.0], ..Ies::new() };
    assert_eq!(generation.read().notes, [""; 0]);
}

#[test]
fn names_are_where_keywords_say() {
    let file = Ies { header: "IES:LM-63-2019\n", ..Ies::new() };
    let found =
        parse("x", file.text().replace("[LUMINAIRE]", " [Luminaire]").replace("[MANUFAC]", "[manufac]").as_bytes());
    let names = [&found.name, &found.manufacturer, &found.catalogue, &found.lamps[0].name];
    assert_eq!(names, ["Lamp of tests", "Maker", "4711", "LED"]);
    let generation = "test in no accredited laboratory (1.00000)";
    let remarks = [("test", "7"), ("file generation", generation)].map(|(key, text)| (key.into(), text.into()));
    assert_eq!(found.remarks, remarks);
    let old = parse("x", file.text().replacen("IES:LM-63-2019\n[TEST] 7", "A lamp of 1986", 1).as_bytes());
    assert_eq!((old.format, old.name.as_str()), (Format::Lm63_1986, "A lamp of 1986"));
}

#[test]
fn white_space_and_encoding_mean_nothing() {
    let plain = Ies::of(Symmetry::AboutC0, steps(0.0, 180.0, STEP[0]), 90.0);
    let (label, numbers) = plain.text().split_once("TILT=NONE\n").map(|(a, b)| (a.to_owned(), b.to_owned())).unwrap();
    let words: Vec<&str> = numbers.split_whitespace().collect();
    let wrapped = |every: usize, between: &str, end: &str| {
        let lines = words.chunks(every).map(|line| line.join(between)).collect::<Vec<_>>();
        format!("{}TILT=NONE{end}{}{end}", label.replace('\n', end), lines.join(end))
    };
    let expected = plain.read();
    for (name, text) in [
        ("a word a line", wrapped(1, "", "\n")),
        ("all in one line", wrapped(usize::MAX, " ", "\n")),
        ("CR LF", wrapped(10, " ", "\r\n")),
        ("CR", wrapped(7, " ", "\r")),
        ("tabs", wrapped(13, "\t", "\n")),
        ("commas", wrapped(13, ",", "\n")),
        ("commas and blanks", wrapped(9, " , ", "\r\n")),
        ("blank lines", wrapped(9, "  ", "\n\n")),
        ("tilt in other letters", wrapped(9, " ", "\n").replace("TILT=NONE", "  Tilt = None ")),
    ] {
        let latin: Vec<u8> = text.replace("Maker", "L\u{fc}x").chars().map(|c| c as u8).collect();
        let utf8 = format!("\u{feff}{}\u{1a}", text.replace("Maker", "L\u{fc}x"));
        for bytes in [latin.as_slice(), utf8.as_bytes()] {
            let found = parse("lamp.ies", bytes);
            assert_eq!(found.intensity, expected.intensity, "{name}");
            assert_eq!((found.manufacturer.as_str(), found.format), ("Lüx", Format::Lm63_2002), "{name}");
        }
    }
}

#[test]
fn openings_are_metres() {
    let found = Ies { opening: [1.0, 1.0, 2.0, 0.5], ..Ies::new() }.read().opening;
    let expected = [0.6096, 0.3048, 0.1524, 0.1524];
    let sizes = [found.c0, found.c90, found.height, found.sides[2]];
    assert!(sizes.iter().zip(expected).all(|(size, expected)| (size - expected).abs() < 1e-12), "{sizes:?}");
    assert_eq!(found.shape, Shape::Box);
    let disc = Ies { opening: [2.0, -0.3, 0.0, 0.0], ..Ies::new() }.read();
    assert_eq!((disc.opening.shape, disc.opening.c0, disc.opening.c90), (Shape::Ellipse, 0.3, 0.3));
    assert_eq!(disc.notes, ["line 9: luminous opening -0.3 0 0 is a code of LM-63-1995, not of LM-63-2002"]);
    let long = Ldt { area: [1200.0, 200.0, 10.0, 20.0, 30.0, 40.0], ..ldt() }.read().opening;
    let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
    assert!(close(long.c0, 0.2) && close(long.c90, 1.2) && close(long.height, 0.04) && close(long.sides[1], 0.02));
}

/// Type B and A have to agree with what type C says of the same directions.
#[test]
fn floodlights_and_headlights_become_type_c() {
    let (h, v) = (steps(-90.0, 90.0, 2.5), steps(-90.0, 90.0, 2.5));
    let of = |kind: u8, direction: fn(f64, f64) -> [f64; 3]| {
        let value = |h: f64, v: f64| {
            let [x, y, z] = direction(h.to_radians(), v.to_radians());
            let (c, gamma) = (y.atan2(x).to_degrees(), (-z).clamp(-1.0, 1.0).acos().to_degrees());
            intensity(Symmetry::None, c, gamma)
        };
        let values = h.iter().flat_map(|&h| v.iter().map(move |&v| value(h, v))).collect();
        Ies { kind, planes: h.clone(), angles: v.clone(), values, ..Ies::new() }.read()
    };
    let flood = of(2, |h, v| [h.cos() * v.sin(), -h.sin(), -h.cos() * v.cos()]);
    assert_eq!((flood.kind, flood.symmetry), (PlaneSystem::B, Symmetry::None));
    check(&flood, Symmetry::None, 1.0, "type B");
    // A headlight sees x > 0 only: the half of the directions it has.
    let head = of(3, |h, v| [v.cos() * h.cos(), -v.cos() * h.sin(), v.sin()]);
    assert_eq!(head.kind, PlaneSystem::A);
    for (c, gamma) in [(0.0, 30.0), (60.0, 45.0), (-60.0, 45.0), (80.0, 70.0)] {
        let [found, expected] = [head.intensity.at(c, gamma), intensity(Symmetry::None, c, gamma)];
        assert!((found - expected).abs() < between(), "C {c} γ {gamma}: {found}, expected {expected}");
    }
    assert_eq!(head.intensity.at(180.0, 45.0), 0.0);
}

#[test]
fn tilt_is_that_of_a_luminaire_that_hangs() {
    let include = Ies { tilt: "INCLUDE\n3\n4\n-90 0\n45 90\n0.5 0.8\n0.9 1\n", ..Ies::new() }.read();
    check(&include, Symmetry::Rotational, 0.8, "factor 0.8 at 0°");
    let tilt = include.tilt.expect("tilt factors");
    assert_eq!(
        (tilt.geometry, tilt.factor(22.5), tilt.factor(-180.0), tilt.factor(180.0)),
        (3, 0.8500000000000001, 0.5, 1.0)
    );
    assert_eq!(include.notes.len(), 2);
    assert!(include.notes[1].ends_with("which way angles below 0° tilt the lamp isn't said; those above are taken"));

    let folder = folder("tilt");
    fs::write(folder.join("my lamp.tlt"), "1\r\n2\r\n0 90\r\n1 .7\r\n").unwrap();
    let named =
        |tilt: &'static str| Photometry::parse(&folder.join("lamp.ies"), Ies { tilt, ..Ies::new() }.text().as_bytes());
    check(&named("my lamp.tlt\n").unwrap(), Symmetry::Rotational, 1.0, "tilt file");
    for (tilt, says) in [
        ("../my lamp.tlt\n", "expected NONE, INCLUDE or the name of a file in the same folder"),
        ("/etc/passwd\n", "expected NONE, INCLUDE or the name of a file in the same folder"),
        ("..\\x\n", "expected NONE, INCLUDE or the name of a file in the same folder"),
        ("\n", "expected NONE, INCLUDE or the name of a file in the same folder"),
        ("none.tlt\n", "no file that can be read"),
        ("INCLUDE\n4\n1\n0\n1\n", "found 4, expected lamp-to-luminaire geometry, 1 to 3"),
        ("INCLUDE\n1\n2\n0 0\n1 1\n", "found tilt angle 0, expected more than the one before, 0"),
        ("INCLUDE\n1\n1\n0\n0\n", "found tilt factor 0 at 0°, expected more than 0"),
    ] {
        let error = named(tilt).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(says), "{tilt:?}: {error}");
    }
}

/// Planes that EULUMDAT lists, and those that have intensities, by Isym.
fn planes_of_ldt(kind: u8) -> (Vec<f64>, Vec<f64>) {
    let all = steps(0.0, 345.0, STEP[0]);
    let stored = match kind {
        0 => all.clone(),
        1 => vec![0.0],
        2 => steps(0.0, 180.0, STEP[0]),
        3 => [steps(270.0, 345.0, STEP[0]), steps(0.0, 90.0, STEP[0])].concat(),
        _ => steps(0.0, 90.0, STEP[0]),
    };
    (all, stored)
}

const SYMMETRIES: [Symmetry; 5] =
    [Symmetry::None, Symmetry::Rotational, Symmetry::AboutC0, Symmetry::AboutC90, Symmetry::Quadrant];

#[test]
fn every_symmetry_of_eulumdat_says_the_same() {
    for (kind, symmetry) in (0..).zip(SYMMETRIES) {
        let (planes, stored) = planes_of_ldt(kind);
        let file = ldt_of(kind, planes.clone(), &stored);
        let found = file.read();
        check(&found, symmetry, 1.0, &format!("Isym {kind}"));
        assert_eq!(
            (found.format, found.symmetry, found.notes.len()),
            (Format::Eulumdat, symmetry, 0),
            "{:?}",
            found.notes
        );
        assert_eq!(found.tabulated, [24, 19]);
        assert_eq!((found.name.as_str(), found.catalogue.as_str(), found.power), ("Lamp of tests", "4711", Some(25.0)));
        // The flux declared: 2000 lm × LORL.
        assert!((found.flux.unwrap() / (1000.0 * PI) - 1.0).abs() < 1e-12 && found.downward == Some(1.0));
        if kind > 1 {
            let whole = ldt_of(kind, planes.clone(), &planes).read();
            check(&whole, symmetry, 1.0, &format!("Isym {kind}, all planes stored"));
            assert_eq!(whole.notes.len(), 1, "{:?}", whole.notes);
        }
    }
}

#[test]
fn eulumdat_may_look_different_and_say_the_same() {
    let (planes, stored) = planes_of_ldt(2);
    let file = ldt_of(2, planes, &stored);
    let expected = file.read();
    for text in [
        file.text().replace('\n', "\r\n"),
        file.text().replace('.', ",").replace("lamp,ldt", "lamp.ldt"),
        file.text().trim_end().to_owned(),
        file.text() + "\n\n\r\n\u{1a}",
    ] {
        assert_eq!(parse("x", text.as_bytes()).intensity, expected.intensity);
    }
    // Planes and angles listed downwards.
    let up = ldt_of(0, planes_of_ldt(0).0, &planes_of_ldt(0).1);
    let turned = |list: &[f64]| list.iter().rev().copied().collect::<Vec<_>>();
    let down = Ldt { planes: turned(&up.planes), angles: turned(&up.angles), values: turned(&up.values), ..up };
    check(&down.read(), Symmetry::None, 1.0, "downwards");
    assert_eq!(down.read().notes.len(), 2);
    // Planes and angles at unequal distances.
    let planes = vec![0.0, 20.0, 35.0, 90.0, 145.0, 160.0, 180.0, 200.0, 215.0, 270.0, 325.0, 340.0];
    let sparse = ldt_of(2, planes.clone(), &planes[..7]).read();
    assert_eq!(sparse.intensity.planes(), planes);
    for &c in &planes {
        assert!((sparse.intensity.at(c, 45.0) - intensity(Symmetry::AboutC0, c, 45.0)).abs() < 1e-9, "C {c}");
    }
}

#[test]
fn lamps_and_factors_of_eulumdat() {
    let double = Ldt { ratios: [100.0, 50.0, 2.0, 0.0], ..ldt() }.read();
    check(&double, Symmetry::Rotational, 2.0, "conversion factor 2");
    let absolute = Ldt { lamps: vec![[-3.0, 4000.0, 30.0]], ..ldt() }.read();
    check(&absolute, Symmetry::Rotational, 2.0, "4000 lm of the luminaire");
    assert!(absolute.lamps[0].absolute && absolute.lamps[0].count == 3);
    let sets = Ldt { lamps: vec![[2.0, 2000.0, 25.0], [1.0, 9000.0, 90.0]], ..ldt() }.read();
    check(&sets, Symmetry::Rotational, 1.0, "first set");
    assert_eq!((sets.lamps.len(), sets.power), (2, Some(25.0)));
    assert_eq!(sets.notes, ["line 26: 2 sets of lamps, alternatives; the first is taken"]);
}

/// Files with a mistake, and what is said about it.
#[test]
fn mistakes_are_told_with_their_line() {
    let ies = Ies::of(Symmetry::Quadrant, vec![0.0, 45.0, 90.0], 90.0).text();
    let ldt = ldt().text();
    let lined = |text: &str, line: usize, new: &str| {
        let mut lines: Vec<&str> = text.lines().collect();
        lines[line - 1] = new;
        lines.join("\n")
    };
    for (name, text, says) in [
        ("a.ies", String::new(), "a.ies:1: found the end of the file, expected a line TILT=NONE"),
        ("a.txt", "hello\n".into(), "a.txt: found neither a line TILT= nor"),
        ("a.ldt", "hello\n".into(), "a.ldt:1: found the end of the file, expected symmetry (Isym), 0 to 4"),
        (
            "a.ies",
            ies.replace("0 45 90\n", "0 45 45\n"),
            "a.ies:12: found horizontal angle 45, expected more than the one",
        ),
        (
            "a.ies",
            ies.replace("0 45 90\n", "0 45 80\n"),
            "a.ies:12: found horizontal angles from 0° to 80°, expected 0° alone",
        ),
        (
            "a.ies",
            ies.replace("0 5 10", "5 0 10"),
            "a.ies:11: found vertical angle 0, expected more than the one before, 5",
        ),
        ("a.ies", ies.replace("85 90\n", "85 190\n"), "a.ies:11: found vertical angle 190, expected 0° to 180°"),
        (
            "a.ies",
            ies.replace("1 -1 1 19 3", "1 -1 1 7000 7000"),
            "a.ies:9: found 7000 × 7000 angles, but 79 numbers after",
        ),
        (
            "a.ies",
            ies.replace("1 -1 1 19 3", "1 -1 1 99999999 3"),
            "a.ies:9: found 99999999, expected number of vertical",
        ),
        ("a.ies", ies.replace("1 -1 1 19 3", "1 -1 0 19 3"), "a.ies:9: found multiplier 0, expected more than 0"),
        (
            "a.ies",
            ies.replace("1 -1 1 19 3", "1 -1 1 19.5 3"),
            "a.ies:9: found 19.5, expected number of vertical angles",
        ),
        ("a.ies", ies.replace("1 -1 1 19 3 1", "1 -1 1 19 3 4"), "a.ies:9: found 4, expected photometric type, 1 to 3"),
        (
            "a.ies",
            ies.replace("1 -1 1 19 3 1 2 0 0 0", "1 -1 1 19 3 1 2 0 0 -1"),
            "a.ies:9: found luminous opening 0 0 -1",
        ),
        ("a.ies", ies.replace("1 -1 1 19 3 1 2 0 0 0", "1 -1 1 19 3 1 2 9e9 1 0"), "10000 m at most"),
        (
            "a.ies",
            lined(&ies, 13, &format!("-500 {}", "1 ".repeat(18))),
            "a.ies:13: found an intensity of -500 cd, expected 0",
        ),
        (
            "a.ies",
            lined(&ies, 13, &format!("nan {}", "1 ".repeat(18))),
            "a.ies:13: found \"nan\", expected intensity 1 of 57",
        ),
        ("a.ies", lined(&ies, 13, &format!("1e300 {}", "1 ".repeat(18))), "a.ies:13: found an intensity of 1"),
        ("a.ies", lined(&ies, 15, ""), "found 3 × 19 angles, but 60 numbers after them, expected 79 numbers"),
        ("a.ldt", lined(&ldt, 3, "5"), "a.ldt"),
        ("a.ldt", lined(&ldt, 4, "0"), "a.ldt:4: found \"0\", expected number of C-planes (Mc), 1 to 7201"),
        ("a.ldt", lined(&ldt, 6, "7000"), "found 1 planes × 7000 angles (lines 3, 4 and 6), but 39 numbers for them"),
        ("a.ldt", lined(&ldt, 26, "-1"), "a.ldt:26: found \"-1\", expected number of sets of lamps, 0 to 1000"),
        (
            "a.ies",
            ies.clone() + "1 2 3\n",
            "a.ies:16: found 3 numbers left over after the last intensity, \"1\" and on",
        ),
        (
            "a.ldt",
            ldt.clone() + "7\n",
            "a.ldt:82: found \"7\" left over after the last intensity, expected nothing more",
        ),
        ("a.ldt", lined(&ldt, 29, "0"), "a.ldt:29: found lamps without a luminous flux"),
        ("a.ldt", lined(&ldt, 17, "-1"), "a.ldt:17: found width of the luminous area -1 mm"),
        ("a.ldt", lined(&ldt, 45, "0"), "a.ldt:45: found γ angle 0, expected more than the one before, 0"),
        ("a.ldt", ldt.lines().take(50).collect::<Vec<_>>().join("\n"), "is the file cut off?"),
        ("a.ldt", ldt.lines().take(20).collect::<Vec<_>>().join("\n"), "a.ldt:20: found the end of the file"),
    ] {
        let error = Photometry::parse(Path::new(name), text.as_bytes()).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(says), "{says}\n  but: {error}");
        assert!(!error.contains('\n'));
    }
}

#[test]
fn oddities_are_noted_and_taken() {
    let file = Ies::of(Symmetry::AboutC0, vec![0.0, 90.0, 180.0], 90.0);
    let low = Ies { values: file.values.iter().map(|v| if *v < 1e-9 { -5.0 } else { *v }).collect(), ..file };
    let found = low.read();
    assert_eq!(found.notes, ["line 13: negative intensities, down to -5 cd, taken for 0"]);
    assert_eq!(found.intensity.at(0.0, 90.0), 0.0);
    let more = parse("x.ies", (Ies::new().text() + "END of 1 2 3\n").as_bytes());
    assert_eq!(more.notes, ["line 14: \"END\" and what follows isn't read: all intensities are there"]);
    let gap = Ies::of(Symmetry::Rotational, steps(0.0, 195.0, STEP[0]), 90.0).read();
    assert!(gap.notes[0].starts_with("line 12: no plane between 195° and 360°"), "{:?}", gap.notes);
    check(&gap, Symmetry::Rotational, 1.0, "gap");
}

const NASTY: [&str; 16] = [
    "",
    "0",
    "-1",
    "1e308",
    "-1e308",
    "1e-308",
    "nan",
    "inf",
    "99999999999",
    "2147483648",
    "4294967297",
    "0.5",
    "360",
    "x",
    "\u{0}",
    "½",
];

/// Files as they are hurt in the wild: cut off, words replaced, left out, said twice, bytes changed.
fn hurt(text: &str, random: &mut Stream) -> Vec<u8> {
    let pick =
        |random: &mut Stream, count: usize| ((random.uniform() as f64 * count as f64) as usize).min(count.max(1) - 1);
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..=pick(random, 3) {
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let words: Vec<(usize, &str)> =
            text.split_whitespace().map(|word| (word.as_ptr() as usize - text.as_ptr() as usize, word)).collect();
        let Some(&(at, word)) = words.get(pick(random, words.len())) else { return bytes };
        let replace = |by: &str| [&text[..at], by, &text[at + word.len()..]].concat().into_bytes();
        bytes = match pick(random, 6) {
            0 => text.as_bytes()[..pick(random, text.len())].to_vec(),
            1 | 2 => replace(NASTY[pick(random, NASTY.len())]),
            3 => replace(&format!("{word} {word}")),
            4 => replace(words[pick(random, words.len())].1),
            _ => {
                let mut bytes = text.clone().into_bytes();
                let at = pick(random, bytes.len());
                bytes[at] = (random.uniform() * 256.0) as u8;
                bytes
            }
        };
    }
    bytes
}

/// Whatever happens to a file, it is read as light that makes sense or refused in one line.
#[test]
fn hurt_files_are_read_or_refused() {
    let tilt =
        Ies { tilt: "INCLUDE\n1\n2\n0 90\n1 0.9\n", ..Ies::of(Symmetry::AboutC90, steps(90.0, 270.0, 45.0), 180.0) };
    let square = |kind: u8| {
        let sides = steps(-90.0, 90.0, 30.0);
        Ies { kind, planes: sides.clone(), angles: sides.clone(), values: vec![7.0; 49], ..Ies::new() }.text()
    };
    let mut files = vec![Ies::new().text(), tilt.text(), square(2), square(3)];
    files.extend((0..5).map(|kind| {
        let (planes, stored) = planes_of_ldt(kind);
        ldt_of(kind, planes, &stored).text()
    }));
    let mut read = 0;
    for case in 0..3000_usize {
        let mut random = Seed(63).stream(case as u64);
        let bytes = hurt(&files[case % files.len()], &mut random);
        let path = Path::new(if case % 2 == 0 { "hurt.ies" } else { "hurt.ldt" });
        match Photometry::parse(path, &bytes) {
            Ok(found) => {
                read += 1;
                let web = &found.intensity;
                assert!(web.flux().is_finite() && web.flux() >= 0.0, "case {case}: {} lm", web.flux());
                assert!(
                    web.planes().windows(2).chain(web.angles().windows(2)).all(|pair| pair[0] < pair[1]),
                    "case {case}"
                );
                let values = (0..web.planes().len()).flat_map(|plane| web.plane(plane));
                assert!(values.into_iter().all(|value| value.is_finite() && *value >= 0.0), "case {case}");
                let opening = found.opening;
                let sizes = [opening.c0, opening.c90, opening.height];
                assert!(sizes.iter().all(|size| (0.0..=1e4).contains(size)), "case {case}: {opening:?}");
            }
            Err(error) => {
                let error = error.to_string();
                assert!(error.starts_with("hurt.") && !error.contains(['\n', '\r']), "case {case}: {error}");
            }
        }
    }
    assert!((300..2700).contains(&read), "{read} of 3000 files read: too few or too many to tell anything");
}

/// Flux of the one plane that all LM-63 files of photometric-viewer share, integrated in steps of a thousandth of a
/// degree.
fn flux_of_viewer(values: &[f64]) -> f64 {
    let at = |gamma: f64| {
        let i = ((gamma / 2.5) as usize).min(values.len() - 2);
        values[i] + (values[i + 1] - values[i]) * (gamma / 2.5 - i as f64)
    };
    let steps = (0..90_000).map(|i| (f64::from(i) + 0.5) / 1000.0);
    2.0 * PI * 0.001_f64.to_radians() * steps.map(|gamma| at(gamma) * gamma.to_radians().sin()).sum::<f64>()
}

/// Files that others wrote to try their own reader (tests/material/photometric-viewer, with licence).
#[test]
fn files_of_others_load() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/material/photometric-viewer");
    let read = |name: &str| Photometry::read(&folder.join(name)).unwrap_or_else(|error| panic!("{error}"));
    let relative = read("relative_photometry.ies");
    let whole = flux_of_viewer(relative.intensity.plane(0));
    for (name, flux, shape, sizes) in [
        ("relative_photometry.ies", whole, Shape::Ellipse, [0.12, 0.12, 0.0]),
        ("absolute_photometry_with_multiplier.ies", 1.5 * whole, Shape::Ellipse, [0.12, 0.12, 0.0]),
        ("imperial_units.ies", whole, Shape::Box, [0.34 * 0.3048, 0.12 * 0.3048, 0.56 * 0.3048]),
        ("label_lines.ies", whole, Shape::Box, [0.34 * 0.3048, 0.12 * 0.3048, 0.56 * 0.3048]),
        ("ellipsoid_opening_along_width.ies", whole, Shape::Ellipsoid, [0.34, 0.12, 0.56]),
        ("horizontal_cylinder_opening_along_length.ies", whole, Shape::CylinderAlongC0, [0.12, 0.34, 0.34]),
        ("sphere_opening.ies", whole, Shape::Ellipsoid, [0.12, 0.12, 0.12]),
        ("relative.ldt", 0.5 * whole, Shape::Point, [0.0; 3]),
        ("multiple_lamp_sets.ldt", 0.5 * whole, Shape::Point, [0.0; 3]),
        (
            "rectangular_luminaire_rectangular_luminous_opening_with_heights.ldt",
            0.5 * whole,
            Shape::Box,
            [0.04, 0.05, 0.014],
        ),
    ] {
        let found = read(name);
        let computed = found.intensity.flux();
        assert!((computed / flux - 1.0).abs() < 1e-6, "{name}: {computed} lm, expected {flux}");
        let opening = found.opening;
        let close = [opening.c0, opening.c90, opening.height].iter().zip(sizes).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(opening.shape == shape && close, "{name}: {opening:?}");
    }
    // Values at the nadir count up by 37 cd/klm from plane to plane, at 1000 lm.
    let nadir = |name: &str, c: f64| read(name).intensity.at(c, 0.0);
    assert_eq!([0.0, 15.0, 345.0].map(|c| nadir("no_symmetry.ldt", c)), [2200.0, 2237.0, 3051.0]);
    assert_eq!(
        [270.0, 280.0, 90.0, 260.0, 100.0].map(|c| nadir("symmetry_to_c90c270.ldt", c).round()),
        [2200.0, 2237.0, 2866.0, 2237.0, 2829.0]
    );
    assert_eq!(
        [0.0, 10.0, 350.0, 180.0].map(|c| nadir("symmetry_to_c0c180.ldt", c).round()),
        [2200.0, 2237.0, 2237.0, 2866.0]
    );
    let quadrant = "symmetry_to_c0c90c180c270.ldt";
    assert_eq!(
        [0.0, 10.0, 170.0, 190.0, 90.0].map(|c| nadir(quadrant, c).round()),
        [2200.0, 2237.0, 2237.0, 2237.0, 2533.0]
    );
}

/// A folder of its own for a test.
fn folder(test: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("photometry").join(test);
    let _ = fs::remove_dir_all(&folder); // of an earlier run
    fs::create_dir_all(&folder).expect("the target folder is writable");
    folder
}

fn luxmap(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_luxmap")).current_dir(folder).args(arguments).output().expect("luxmap starts")
}

#[test]
fn the_command_tells_and_draws() {
    let folder = folder("command");
    let file = Ldt { area: [1200.0, 200.0, 0.0, 0.0, 0.0, 0.0], ..ldt() };
    fs::write(folder.join("lamp.ldt"), file.text()).unwrap();
    let output = luxmap(&folder, &["luminaire", "lamp.ldt"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!((output.status.code(), output.stderr.as_slice()), (Some(0), &b""[..]), "{text}");
    for line in [
        "format     EULUMDAT\n",
        "luminaire  Lamp of tests\n",
        "table      type C, 1 × 19 angles, the same all around\n",
        "opening    rectangle, 0.2 m along C0 and 1.2 m along C90\n",
        "axes       looking down with rotation 0: C0 towards +x, C90 towards +y; the file's length lies along C90, its width \
         along C0\n",
        "rotation   positive turns from C0 towards C90, counter-clockwise seen from behind (from above where it looks down)\n",
        "than the 3142 lm declared: they agree\n",
        "direction  100 % down (declared 100 %), 0 % up\n",
        "power      25 W, 125.6 lm/W\n",
        "largest    1000 cd at any C, γ 0°\n",
        "beam       120° in C0/C180 (-60° to 60°), 120° in C90/C270 (-60° to 60°) (half of the largest)\n",
        "wrote 4 files to out/lamp.ldt\n",
    ] {
        assert!(text.contains(line), "{line}\n  is not in\n{text}");
    }
    let results = folder.join("out/lamp.ldt");
    let svg = fs::read_to_string(results.join("polar.svg")).unwrap();
    assert!(svg.starts_with("<svg xmlns=") && svg.ends_with("</svg>\n") && !svg.contains("NaN"));
    let page = fs::read_to_string(results.join("luminaire.html")).unwrap();
    for drawing in [&svg, &page] {
        for text in
            ["Plan, seen from above", "C0, +x", "C90, +y", "C180", "C270", "+ rotation", "0.2 m along x, 1.2 m along y"]
        {
            assert!(drawing.contains(&format!(">{text}<")) || drawing.contains(&format!(": {text}<")), "{text}");
        }
    }
    let picture = fs::read(results.join("polar.png")).unwrap();
    assert!(picture.starts_with(b"\x89PNG\r\n"));
    let json = luxmap(&folder, &["luminaire", "lamp.ldt", "--json", "-o", "elsewhere"]).stdout;
    assert_eq!(json, fs::read(folder.join("elsewhere/luminaire.json")).unwrap());
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(
        (&json["format"], &json["max_cd"], &json["opening"]["c90_m"]),
        (&"EULUMDAT".into(), &1000.0.into(), &1.2.into())
    );

    fs::write(folder.join("cut.ies"), &Ies::new().text()[..200]).unwrap();
    let refused = luxmap(&folder, &["luminaire", "cut.ies"]);
    let line = String::from_utf8(refused.stderr).unwrap();
    assert_eq!((refused.status.code(), refused.stdout.as_slice()), (Some(2), &b""[..]));
    assert!(line.starts_with("luxmap: cut.ies:9: found 1 × 19 angles, but ") && line.lines().count() == 1, "{line}");
    assert!(!folder.join("out/cut.ies").exists());
}

/// A file that contradicts itself is taken, and told so.
#[test]
fn a_file_that_contradicts_itself_is_told_so() {
    let folder = folder("contradiction");
    fs::write(folder.join("a.ldt"), Ldt { ratios: [100.0, 80.0, 1.0, 0.0], ..ldt() }.text()).unwrap();
    fs::write(folder.join("b.ies"), Ies { lamps: [1.0, 2000.0, 1.0], ..Ies::new() }.text()).unwrap();
    fs::write(folder.join("c.ies"), Ies { lamps: [1.0, 4000.0, 1.0], ..Ies::new() }.text()).unwrap();
    let flux = |file: &str| {
        let text = String::from_utf8(luxmap(&folder, &["luminaire", file]).stdout).unwrap();
        text.lines().find(|line| line.starts_with("flux")).unwrap_or_default().to_owned()
    };
    assert!(
        flux("a.ldt").ends_with("% more than the 1600 lm declared: the file contradicts itself"),
        "{}",
        flux("a.ldt")
    );
    assert!(flux("b.ies").ends_with("of the lamps' 2000 lm, more than they can give: the file contradicts itself"));
    assert!(flux("c.ies").ends_with("78.49 % of the lamps' 4000 lm"), "{}", flux("c.ies"));
}
