//! What a photometric file says, for a person and for a program, and the polar diagram.
//!
//! `luminaire.json` is one object, keys in a fixed order, each with its unit in its name: `luxmap`, `file`, `format`,
//! `name`, `catalogue`, `manufacturer`, `remarks`, `lamps` (`count`, `name`, `flux_lm`, `power_w`, `colour`,
//! `rendering`, `absolute`), `type`, `symmetry`, `planes`, `angles`, `opening` (`shape`, `c0_m`, `c90_m`, `height_m`,
//! `sides_m`), `flux_lm` (computed), `declared_flux_lm`, `declared_share_down`, `share_down`, `power_w`,
//! `efficacy_lm_per_w`, `max_cd`, `max_c_deg`, `max_gamma_deg`, `beam_deg` and `field_deg` (in C0/C180 and C90/C270:
//! from, to and the angle between), `notes`. What a file doesn't tell is null or empty.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::{file, make_folder, png};
use crate::error::Error;
use crate::luminaire::intensity::Intensity;
use crate::luminaire::photometry::{Kind, Lamps, LuminousOpening, Photometry, Shape, Symmetry};
use crate::report::number::{percent, round_to, short};

/// Difference of computed and declared flux up to which a file is at one with itself: rounding of its intensities.
const ROUNDING: f64 = 0.01;
/// Difference up to which coarse angles explain it.
const COARSE: f64 = 0.05;

/// Light of a luminaire in a few figures.
#[derive(Clone, Debug)]
pub struct Figures {
    /// Luminous flux, lm: the integral of intensity.
    pub flux: f64,
    /// Share of it below the horizon, 0 … 1.
    pub down: f64,
    /// Largest intensity, cd, and the first direction that has it: C and γ, degrees.
    pub largest: [f64; 3],
    /// Where intensity is at least half of the section's largest: in C0–C180 and C90–C270.
    pub beam: [Spread; 2],
    /// Where it is at least a tenth of that.
    pub field: [Spread; 2],
}

/// The outermost directions of a section that reach a share of its largest intensity, seen from the axis in whose
/// half space that largest is; degrees from it, positive towards the first plane of the section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// The one on the other side.
    pub from: f64,
    /// The one on the side of the first plane.
    pub to: f64,
}

impl Spread {
    /// The angle between both.
    pub fn angle(self) -> f64 {
        self.to - self.from
    }
}

impl Figures {
    /// Figures of a distribution. Cost: some passes over its table.
    pub fn new(intensity: &Intensity) -> Self {
        let mut largest = [f64::NEG_INFINITY, 0.0, 0.0];
        for (plane, &c) in intensity.planes().iter().enumerate() {
            for (&value, &gamma) in intensity.plane(plane).iter().zip(intensity.angles()) {
                if value > largest[0] {
                    largest = [value, c, gamma];
                }
            }
        }
        let flux = intensity.flux();
        let down = if flux > 0.0 { below(intensity).map_or(0.0, |part| part.flux()) / flux } else { 0.0 };
        let sections = [0.0, 90.0].map(|c| Section::new(intensity, c));
        let [beam, field] = [0.5, 0.1].map(|share| sections.each_ref().map(|section| section.spread(share)));
        Self { flux, down: down.clamp(0.0, 1.0), largest, beam, field }
    }
}

/// The part of a distribution below the horizon.
fn below(intensity: &Intensity) -> Option<Intensity> {
    let angles = intensity.angles();
    let last = angles[angles.len() - 1].min(90.0);
    let kept: Vec<f64> = angles.iter().copied().filter(|angle| *angle < last).chain([last]).collect();
    let planes = intensity.planes().to_vec();
    let candela = planes.iter().flat_map(|&c| kept.iter().map(move |&gamma| intensity.at(c, gamma))).collect();
    (angles[0] < 90.0).then(|| Intensity::new(planes, kept, candela))
}

/// Intensities in a plane and the one opposite, over the angle from the axis in whose half space the largest is.
struct Section {
    /// Angle and intensity, ascending from −180° to 180°.
    points: Vec<[f64; 2]>,
    largest: f64,
}

impl Section {
    fn new(intensity: &Intensity, c: f64) -> Self {
        let angles = intensity.angles();
        let both = |gamma: f64| [c, c + 180.0].map(|c| intensity.at(c, gamma));
        let peak = |keep: fn(f64) -> bool| {
            angles.iter().filter(|gamma| keep(**gamma)).flat_map(|&gamma| both(gamma)).fold(0.0, f64::max)
        };
        let (down, up) = (peak(|gamma| gamma <= 90.0), peak(|gamma| gamma > 90.0));
        let from_axis = |gamma: f64| if up > down { 180.0 - gamma } else { gamma };
        // Just beyond the table there is no light.
        let (first, last) = (angles[0], angles[angles.len() - 1]);
        let ends =
            [first - 1e-9, last + 1e-9, 0.0, 90.0, 180.0].into_iter().filter(|gamma| (0.0..=180.0).contains(gamma));
        let mut points: Vec<[f64; 2]> = angles
            .iter()
            .copied()
            .chain(ends)
            .flat_map(|gamma| {
                let [near, far] = both(gamma);
                [[from_axis(gamma), near], [-from_axis(gamma), far]]
            })
            .collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        Self { points, largest: down.max(up) }
    }

    /// Where intensity reaches a share of the largest: outermost within 90° of the axis, and on from there if it
    /// still does.
    fn spread(&self, share: f64) -> Spread {
        let (points, threshold) = (&self.points, share * self.largest);
        let reaches = |point: &[f64; 2]| point[1] >= threshold;
        let near = |point: &[f64; 2]| point[0].abs() <= 90.0;
        let (Some(mut low), Some(mut high)) = (
            points.iter().position(|point| near(point) && reaches(point)),
            points.iter().rposition(|point| near(point) && reaches(point)),
        ) else {
            return Spread { from: 0.0, to: 0.0 };
        };
        while low > 0 && reaches(&points[low - 1]) {
            low -= 1;
        }
        while high + 1 < points.len() && reaches(&points[high + 1]) {
            high += 1;
        }
        let crossing = |inside: usize, outside: Option<&[f64; 2]>| {
            let [angle, value] = points[inside];
            outside.map_or(angle, |[beyond, less]| angle + (beyond - angle) * (value - threshold) / (value - less))
        };
        let before = low.checked_sub(1).map(|index| &points[index]);
        Spread { from: crossing(low, before), to: crossing(high, points.get(high + 1)) }
    }
}

/// What the file says and what was computed from it, in lines of a name and a text.
pub fn text(path: &Path, photometry: &Photometry, figures: &Figures) -> String {
    let mut rows: Vec<(&str, String)> = vec![("format", photometry.format.name().to_owned())];
    let texts =
        [("luminaire", &photometry.name), ("catalogue", &photometry.catalogue), ("maker", &photometry.manufacturer)];
    rows.extend(texts.into_iter().filter(|(_, text)| !text.is_empty()).map(|(name, text)| (name, text.clone())));
    rows.extend(photometry.lamps.iter().map(|set| ("lamps", lamps(set))));
    let [planes, angles] = photometry.tabulated;
    let (kind, symmetry) = (kind(photometry.kind), symmetry(photometry.symmetry));
    rows.push(("table", format!("type {kind}, {planes} × {angles} angles, {symmetry}")));
    rows.push(("opening", opening(&photometry.opening)));
    rows.push(("flux", flux(photometry, figures)));
    let declared = photometry.downward.map_or_else(String::new, |share| format!(" (declared {} %)", percent(share)));
    let [down, up] = [figures.down, 1.0 - figures.down].map(percent);
    rows.push(("direction", format!("{down} % down{declared}, {up} % up")));
    if let Some(power) = photometry.power {
        rows.push(("power", format!("{} W, {} lm/W", short(power), short(figures.flux / power))));
    }
    let [largest, c, gamma] = figures.largest;
    let plane = if photometry.symmetry == Symmetry::Rotational { "any C".into() } else { format!("C {}°", short(c)) };
    rows.push(("largest", format!("{} cd at {plane}, γ {}°", short(largest), short(gamma))));
    rows.push(("beam", format!("{} (half of the largest)", spreads(&figures.beam))));
    rows.push(("field", format!("{} (a tenth of the largest)", spreads(&figures.field))));
    rows.extend(photometry.notes.iter().map(|note| ("note", note.clone())));
    let width = rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    let lines = rows.into_iter().map(|(name, text)| format!("{name:<width$}  {text}\n"));
    format!("{}\n", path.display()) + &lines.collect::<String>()
}

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

fn kind(kind: Kind) -> &'static str {
    match kind {
        Kind::C => "C",
        Kind::B => "B",
        Kind::A => "A",
    }
}

fn symmetry(symmetry: Symmetry) -> &'static str {
    match symmetry {
        Symmetry::None => "no symmetry",
        Symmetry::Rotational => "the same all around",
        Symmetry::AboutC0 => "symmetrical about C0–C180",
        Symmetry::AboutC90 => "symmetrical about C90–C270",
        Symmetry::Quadrant => "symmetrical about C0–C180 and C90–C270",
    }
}

fn shape(shape: Shape) -> &'static str {
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
fn opening(opening: &LuminousOpening) -> String {
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
                _ => "the file contradicts itself",
            };
            format!("{computed}, {size} than the {} lm declared: {verdict}", short(declared))
        }
        (None, Some(lamps)) => {
            let share = figures.flux / lamps;
            let verdict =
                if share > 1.0 + ROUNDING { ", more than they can give: the file contradicts itself" } else { "" };
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

#[derive(Serialize)]
struct Summary<'a> {
    luxmap: &'static str,
    file: String,
    format: &'static str,
    name: &'a str,
    catalogue: &'a str,
    manufacturer: &'a str,
    remarks: &'a [(String, String)],
    lamps: Vec<LampsOut<'a>>,
    r#type: &'static str,
    symmetry: &'static str,
    planes: usize,
    angles: usize,
    opening: OpeningOut,
    flux_lm: f64,
    declared_flux_lm: Option<f64>,
    declared_share_down: Option<f64>,
    share_down: f64,
    power_w: Option<f64>,
    efficacy_lm_per_w: Option<f64>,
    max_cd: f64,
    max_c_deg: f64,
    max_gamma_deg: f64,
    beam_deg: [[f64; 3]; 2],
    field_deg: [[f64; 3]; 2],
    notes: &'a [String],
}

#[derive(Serialize)]
struct LampsOut<'a> {
    count: u32,
    name: &'a str,
    flux_lm: Option<f64>,
    power_w: Option<f64>,
    colour: &'a str,
    rendering: &'a str,
    absolute: bool,
}

impl<'a> LampsOut<'a> {
    fn new(set: &'a Lamps) -> Self {
        let Lamps { count, name, flux, power, colour, rendering, absolute } = set;
        Self { count: *count, name, flux_lm: *flux, power_w: *power, colour, rendering, absolute: *absolute }
    }
}

#[derive(Serialize)]
struct OpeningOut {
    shape: &'static str,
    c0_m: f64,
    c90_m: f64,
    height_m: f64,
    sides_m: [f64; 4],
}

/// The same as JSON, indented, with a line end: what `luminaire.json` holds and `--json` prints.
pub fn json(path: &Path, photometry: &Photometry, figures: &Figures) -> String {
    let LuminousOpening { shape: form, c0, c90, height, sides } = photometry.opening;
    let spread = |spread: Spread| [spread.from, spread.to, spread.angle()];
    let [max_cd, max_c_deg, max_gamma_deg] = figures.largest;
    let summary = Summary {
        luxmap: env!("CARGO_PKG_VERSION"),
        file: path.display().to_string(),
        format: photometry.format.name(),
        name: &photometry.name,
        catalogue: &photometry.catalogue,
        manufacturer: &photometry.manufacturer,
        remarks: &photometry.remarks,
        lamps: photometry.lamps.iter().map(LampsOut::new).collect(),
        r#type: kind(photometry.kind),
        symmetry: symmetry(photometry.symmetry),
        planes: photometry.tabulated[0],
        angles: photometry.tabulated[1],
        opening: OpeningOut { shape: shape(form), c0_m: c0, c90_m: c90, height_m: height, sides_m: sides },
        flux_lm: figures.flux,
        declared_flux_lm: photometry.flux,
        declared_share_down: photometry.downward,
        share_down: figures.down,
        power_w: photometry.power,
        efficacy_lm_per_w: photometry.power.map(|power| figures.flux / power),
        max_cd,
        max_c_deg,
        max_gamma_deg,
        beam_deg: figures.beam.map(spread),
        field_deg: figures.field.map(spread),
        notes: &photometry.notes,
    };
    let mut text = serde_json::to_string_pretty(&summary).expect("numbers, texts and lists make JSON");
    text.push('\n');
    text
}

/// Writes `polar.svg`, `polar.png` and `luminaire.json` into a folder, making it where it's missing; returns their
/// paths.
///
/// # Errors
/// [`Error::Write`] where the folder or a file can't be written.
pub fn write(path: &Path, photometry: &Photometry, figures: &Figures, folder: &Path) -> Result<Vec<PathBuf>, Error> {
    make_folder(folder)?;
    let diagram = png::polar::diagram(photometry, figures);
    let mut written = Vec::new();
    let mut save = |name: &str, content: &[u8]| {
        let path = folder.join(name);
        file::write_whole(&path, &mut |out| out.write_all(content))?;
        written.push(path);
        Ok::<(), Error>(())
    };
    save("polar.svg", diagram.svg().as_bytes())?;
    let picture = diagram.png().map_err(|source| Error::Write { path: folder.join("polar.png"), source })?;
    save("polar.png", &picture)?;
    save("luminaire.json", json(path, photometry, figures).as_bytes())?;
    Ok(written)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// I(0) cosⁿ γ on every degree: half is left where cosⁿ γ = ½.
    fn lobe(power: i32, up: bool) -> Intensity {
        let angles: Vec<f64> = (0..=180).map(f64::from).collect();
        let value = |gamma: &f64| {
            let cos = gamma.to_radians().cos();
            1000.0 * (if up { -cos } else { cos }).max(0.0).powi(power)
        };
        let candela = angles.iter().map(value).collect();
        Intensity::new(vec![0.0], angles, candela)
    }

    /// Linear interpolation between degrees displaces a crossing by less than a hundredth of a degree here.
    #[test]
    fn beams_of_cosine_powers_are_as_wide_as_their_formula_says() {
        for (power, up) in [(1, false), (3, false), (20, false), (3, true)] {
            let figures = Figures::new(&lobe(power, up));
            for (share, spreads) in [(0.5_f64, figures.beam), (0.1, figures.field)] {
                let half = share.powf(1.0 / f64::from(power)).acos().to_degrees();
                for spread in spreads {
                    assert!(
                        (spread.to - half).abs() < 0.01 && (spread.from + half).abs() < 0.01,
                        "{power}: {spread:?}"
                    );
                }
            }
            assert_eq!(figures.down > 0.999, !up);
            assert_eq!((figures.largest[0], figures.largest[2]), (1000.0, if up { 180.0 } else { 0.0 }));
        }
    }

    #[test]
    fn an_isotropic_lamp_shines_half_down_and_all_around() {
        let figures = Figures::new(&Intensity::new(vec![0.0], vec![0.0, 180.0], vec![10.0; 2]));
        assert!((figures.down - 0.5).abs() < 1e-12);
        assert_eq!(figures.beam[0].angle(), 360.0);
    }

    /// Two planes with light from 20° to 40° in C0 only: full strength up to the edge of the table.
    #[test]
    fn lopsided_beams_have_their_own_sides() {
        let web = Intensity::new(vec![0.0, 180.0], vec![20.0, 40.0], vec![100.0, 100.0, 0.0, 0.0]);
        let beam = Figures::new(&web).beam[0];
        assert!((beam.from - 20.0).abs() < 1e-6 && (beam.to - 40.0).abs() < 1e-6, "{beam:?}");
    }
}
