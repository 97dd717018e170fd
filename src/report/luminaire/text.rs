//! What a photometric file says, in words.

use std::path::Path;

use super::figures::{Figures, Spread};
use crate::luminaire::photometry::{Lamps, LuminousOpening, Photometry, PlaneSystem, Shape, Symmetry};
use crate::text::number::{percent, round_to, short};

/// Difference of computed and declared flux up to which a file is at one with itself: rounding of its intensities.
const ROUNDING: f64 = 0.01;
/// Difference up to which coarse angles explain it.
const COARSE: f64 = 0.05;

/// How C-planes and `rotation` count, in words.
pub(super) const ROTATION: &str =
    "positive turns from C0 towards C90, counter-clockwise seen from behind (from above where it looks down)";

/// What the file says and what was computed from it, in lines of a name and a text.
pub fn text(path: &Path, photometry: &Photometry, figures: &Figures) -> String {
    let mut rows = rows(photometry, figures);
    rows.extend(photometry.notes.iter().map(|note| ("note", note.clone())));
    let width = rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    let lines = rows.into_iter().map(|(name, text)| format!("{name:<width$}  {text}\n"));
    format!("{}\n", path.display()) + &lines.collect::<String>()
}

/// The same as pairs, without the reader's notes.
pub(super) fn rows(photometry: &Photometry, figures: &Figures) -> Vec<(&'static str, String)> {
    let mut rows: Vec<(&str, String)> = vec![("format", photometry.format.name().to_owned())];
    let texts =
        [("luminaire", &photometry.name), ("catalogue", &photometry.catalogue), ("maker", &photometry.manufacturer)];
    rows.extend(texts.into_iter().filter(|(_, text)| !text.is_empty()).map(|(name, text)| (name, text.clone())));
    rows.extend(photometry.lamps.iter().map(|set| ("lamps", lamps(set))));
    let [planes, angles] = photometry.tabulated;
    let (kind, symmetry) = (kind(photometry.kind), symmetry(photometry.symmetry));
    rows.push(("table", format!("type {kind}, {planes} × {angles} angles, {symmetry}")));
    rows.push(("opening", opening(&photometry.opening)));
    rows.push(("axes", axes(photometry)));
    rows.push(("rotation", ROTATION.into()));
    rows.push(("flux", flux(photometry, figures)));
    let declared = photometry.downward.map_or_else(String::new, |share| format!(" (declared {} %)", percent(share)));
    let [down, up] = [figures.down, 1.0 - figures.down].map(percent);
    rows.push(("direction", format!("{down} % down{declared}, {up} % up")));
    if let Some(power) = photometry.power {
        rows.push(("power", format!("{} W, {} lm/W", short(power), short(figures.flux / power))));
    }
    rows.push(("largest", largest(photometry, figures)));
    rows.push(("beam", format!("{} (half of the largest)", spreads(&figures.beam))));
    rows.push(("field", format!("{} (a tenth of the largest)", spreads(&figures.field))));
    rows
}

/// `1000 cd at C 90°, γ 0°`
fn largest(photometry: &Photometry, figures: &Figures) -> String {
    let [largest, c, gamma] = figures.largest;
    let plane = if photometry.symmetry == Symmetry::Rotational { "any C".into() } else { format!("C {}°", short(c)) };
    format!("{} cd at {plane}, γ {}°", short(largest), short(gamma))
}

/// Where C0 and C90 lie, and along which of them the format's *length* runs.
fn axes(photometry: &Photometry) -> String {
    let format = photometry.format.name();
    let length = if format.contains("LM-63") {
        "; the file's length lies along C0, its width along C90"
    } else if format.contains("EULUMDAT") {
        "; the file's length lies along C90, its width along C0"
    } else {
        ""
    };
    format!("looking down with rotation 0: C0 towards +x, C90 towards +y{length}")
}

/// What a user should know about a file: the reader's notes, and where it contradicts itself.
pub(super) fn warnings(photometry: &Photometry, figures: &Figures) -> Vec<String> {
    let mut warnings = photometry.notes.clone();
    let flux = flux(photometry, figures);
    if flux.ends_with(CONTRADICTION) {
        warnings.push(flux);
    }
    warnings
}

/// What is said of a file whose declared flux is not that of its intensities.
const CONTRADICTION: &str = "the file contradicts itself";

/// `2 × LED Module, 500 lm of the luminaire (absolute photometry), 15 W, 3000, 90`
fn lamps(set: &Lamps) -> String {
    let name = if set.name.is_empty() { "lamps of unknown type" } else { &set.name };
    let mut text = format!("{} × {name}", set.count);
    text += &match (set.flux, set.absolute) {
        (Some(flux), true) => format!(", {} lm from the luminaire (absolute photometry)", short(flux)),
        (Some(flux), false) => format!(", {} lm in all", short(flux)),
        (None, _) => ", absolute photometry".to_owned(),
    };
    if let Some(power) = set.power {
        text += &format!(", {} W", short(power));
    }
    for more in [&set.colour, &set.rendering].into_iter().filter(|more| !more.is_empty()) {
        text += &format!(", {more}");
    }
    text
}

pub(super) fn kind(kind: PlaneSystem) -> &'static str {
    match kind {
        PlaneSystem::C => "C",
        PlaneSystem::B => "B",
        PlaneSystem::A => "A",
    }
}

pub(super) fn symmetry(symmetry: Symmetry) -> &'static str {
    match symmetry {
        Symmetry::None => "no symmetry",
        Symmetry::Rotational => "the same all around",
        Symmetry::AboutC0 => "symmetrical about C0–C180",
        Symmetry::AboutC90 => "symmetrical about C90–C270",
        Symmetry::Quadrant => "symmetrical about C0–C180 and C90–C270",
    }
}

pub(super) fn shape(shape: Shape) -> &'static str {
    match shape {
        Shape::Point => "point",
        Shape::Rectangle => "rectangle",
        Shape::Ellipse => "ellipse",
        Shape::Box => "box",
        Shape::VerticalCylinder => "vertical cylinder",
        Shape::CylinderAlongC0 => "cylinder along C0",
        Shape::CylinderAlongC90 => "cylinder along C90",
        Shape::Ellipsoid => "ellipsoid",
        Shape::UprightEllipse => "upright ellipse facing C0",
    }
}

/// `rectangle, 0.34 m along C0 and 0.12 m along C90`
pub(super) fn opening(opening: &LuminousOpening) -> String {
    let LuminousOpening { c0, c90, height, sides, .. } = *opening;
    let metres = |size: f64| short(round_to(size, 6));
    let name = match opening.shape {
        Shape::Point => return "point".into(),
        Shape::Ellipse if c0 == c90 => return format!("disc, {} m across", metres(c0)),
        Shape::Ellipsoid if c0 == c90 && c90 == height => return format!("sphere, {} m across", metres(c0)),
        other => shape(other),
    };
    let mut text = format!("{name}, {} m along C0 and {} m along C90", metres(c0), metres(c90));
    if sides.iter().any(|side| *side != height) {
        let sides = sides.map(metres);
        text += &format!(", sides {} m high towards C0, C90, C180, C270", sides.join(", "));
    } else if height > 0.0 {
        text += &format!(", {} m high", metres(height));
    }
    text
}

/// Computed flux beside what the file declares, in words.
fn flux(photometry: &Photometry, figures: &Figures) -> String {
    let computed = format!("{} lm computed", short(figures.flux));
    let lamps = photometry.lamps.first();
    match (photometry.flux, lamps.and_then(|lamps| lamps.flux)) {
        (Some(declared), _) if declared > 0.0 => {
            let difference = figures.flux / declared - 1.0;
            let more = if difference < 0.0 { "less" } else { "more" };
            let size = format!("{} % {more}", short(100.0 * difference.abs()));
            let verdict = match difference.abs() {
                size if size <= ROUNDING => "they agree",
                size if size <= COARSE => "as close as coarse angles may be",
                _ => CONTRADICTION,
            };
            format!("{computed}, {size} than the {} lm declared: {verdict}", short(declared))
        }
        (None, Some(lamps)) => {
            let share = figures.flux / lamps;
            let verdict = if share > 1.0 + ROUNDING {
                format!(", more than they can give: {CONTRADICTION}")
            } else {
                String::new()
            };
            format!("{computed}, {} % of the lamps' {} lm{verdict}", short(100.0 * share), short(lamps))
        }
        _ => format!("{computed}; the file declares none"),
    }
}

/// `62.4° in C0/C180 (-31.2° to 31.2°), 60° in C90/C270 (-30° to 30°)`
fn spreads(spreads: &[Spread; 2]) -> String {
    let degrees = |angle: f64| short((10.0 * angle).round() / 10.0 + 0.0);
    let one = |spread: &Spread| {
        let [angle, from, to] = [spread.angle(), spread.from, spread.to].map(degrees);
        (angle, format!("({from}° to {to}°)"))
    };
    let [(a, from_a), (b, from_b)] = [one(&spreads[0]), one(&spreads[1])];
    format!("{a}° in C0/C180 {from_a}, {b}° in C90/C270 {from_b}")
}
