//! Lamps that give less light when they are tilted: `TILT=` of LM-63.
//!
//! The table tells factors by the *lamp's* tilt, and the lamp-to-luminaire geometry how the lamp lies in the luminaire
//! (LM-63-1995, annex; Radiance's `ies2rad` and `tilt.cal` mean the same):
//! 1. upright, base up or down, while the luminaire looks straight down: the lamp's tilt is the angle between the
//!    luminaire's nadir and the vertical, whichever way it is tilted;
//! 2. level, and remaining so when the luminaire is turned about the zero-degree horizontal: it lies along C0, and its
//!    tilt is the angle by which C0 leaves the horizontal;
//! 3. level, and not remaining so: it lies along C90, and its tilt is the angle by which C90 leaves the horizontal.
//!
//! A table that ends at 90° to 179° means lamps upside down too: past 90° the angle is taken from the other end. Beyond
//! a table that ends earlier its last factor is taken, and that is told.

use std::path::{Component, Path};

use glam::DVec3;

use super::text::{self, Commas, WordReader, quoted};
use super::{Notes, angles};
use crate::error::{InputError, Location};

/// What tilting a luminaire does to the light of its lamps (LM-63, `TILT=`).
#[derive(Clone, Debug, PartialEq)]
pub struct Tilt {
    /// 1: lamps stand upright while the luminaire hangs as measured; 2: they lie along C0; 3: they lie along C90.
    pub geometry: u8,
    /// Tilts of the lamp, degrees, ascending.
    pub angles: Vec<f64>,
    /// What intensities are multiplied by at each angle.
    pub factors: Vec<f64>,
}

impl Tilt {
    /// Factor at a tilt of the lamp in degrees, linear between the angles; the first or last one beyond.
    pub fn factor(&self, angle: f64) -> f64 {
        let after = self.angles.partition_point(|&other| other <= angle);
        if after == 0 || after == self.angles.len() {
            return self.factors[after.min(self.angles.len() - 1)];
        }
        let share = (angle - self.angles[after - 1]) / (self.angles[after] - self.angles[after - 1]);
        self.factors[after - 1] + (self.factors[after] - self.factors[after - 1]) * share
    }

    /// Tilt of the lamp, degrees, in a luminaire whose nadir and C0 look along these unit vectors (world, z up).
    pub fn of_lamp(&self, nadir: DVec3, c0: DVec3) -> f64 {
        let last = self.angles[self.angles.len() - 1];
        let c90 = nadir.cross(c0);
        let off_level = |axis: DVec3| axis.z.abs().min(1.0).asin().to_degrees();
        let angle = match self.geometry {
            1 => (-nadir.z).clamp(-1.0, 1.0).acos().to_degrees(),
            2 => off_level(c0),
            // Turned over about C0, the lamp is level again, upside down.
            _ if nadir.z > 0.0 => 180.0 - off_level(c90),
            _ => off_level(c90),
        };
        // Angles that vectors in single steps miss by a hair are whole ones.
        let angle = if (angle - angle.round()).abs() < 1e-9 { angle.round() } else { angle };
        if angle > 90.0 && (90.0..180.0).contains(&last) { 180.0 - angle } else { angle }
    }

    /// Whether the table says nothing of that angle.
    pub fn is_beyond(&self, angle: f64) -> bool {
        !(self.angles[0]..=self.angles[self.angles.len() - 1]).contains(&angle)
    }

    /// In words, as `lamps that lie along C90, tilt factors 0.9 to 1`.
    pub(super) fn describe(&self) -> String {
        let low = self.factors.iter().fold(f64::INFINITY, |low, factor| low.min(*factor));
        let high = self.factors.iter().fold(0.0_f64, |high, factor| high.max(*factor));
        format!("{}, tilt factors {low} to {high}", self.lamps())
    }

    /// How the lamps are mounted, in words.
    pub fn lamps(&self) -> &'static str {
        match self.geometry {
            1 => "lamps that stand upright",
            2 => "lamps that lie along C0",
            _ => "lamps that lie along C90",
        }
    }

    /// What is said of the factors where the luminaire hangs as measured, and of those that can't be told apart.
    pub(super) fn note(&self, line: usize, hanging: f64, notes: &mut Notes) {
        notes.at(line, format!("{}; intensities are for 0°, factor {hanging}", self.describe()));
        let both = self.angles.iter().any(|&a| a < 0.0 && (self.factor(a) - self.factor(-a)).abs() > 1e-9);
        if both {
            notes.at(line, "which way angles below 0° tilt the lamp isn't said; those above are taken".to_owned());
        }
    }
}

/// What stands after `TILT=` in a line that begins so, in any case and with blanks anywhere.
pub(super) fn of_line(line: &str) -> Option<&str> {
    let line = line.trim();
    let word = line.get(..4).filter(|word| word.eq_ignore_ascii_case("TILT"))?;
    line[word.len()..].trim_start().strip_prefix('=').map(str::trim)
}

/// The tilt factors of `TILT=` and the numbers after it, or those of the file it names.
pub(super) fn read(
    path: &Path,
    line: usize,
    what: &str,
    words: &mut WordReader,
    notes: &mut Notes,
) -> Result<Option<Tilt>, InputError> {
    if what.eq_ignore_ascii_case("NONE") {
        return Ok(None);
    }
    if what.eq_ignore_ascii_case("INCLUDE") {
        return factors(path, words).map(Some);
    }
    let at = || Location::line(path, line);
    let name = Path::new(what);
    let stays = name.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if what.is_empty() || !stays || what.contains(['\\', ':']) || what.contains(char::is_control) {
        let expected = "NONE, INCLUDE or the name of a file in the same folder";
        return Err(InputError::new(at(), format!("TILT={}", quoted(what)), expected));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let file = folder.join(name);
    // A link may lead elsewhere.
    if let (Ok(real), Ok(folder)) = (file.canonicalize(), Path::new(".").join(folder).canonicalize())
        && !real.starts_with(folder)
    {
        let found = format!("TILT={}, which lies in another folder", quoted(what));
        return Err(InputError::new(at(), found, "the name of a file in the same folder"));
    }
    let content = super::content(&file).map_err(|error| InputError {
        at: at(),
        found: format!("TILT={}, {} there", quoted(what), error.found),
        ..error
    })?;
    let text = text::decode(&file, &content)?;
    let lines = text::lines(&text);
    let all = WordReader::new(&file, &lines, 0, Commas::Decimal);
    let (tilt, note) =
        text::settle(&file, all, |commas| factors(&file, &mut WordReader::new(&file, &lines, 0, commas)))?;
    if let Some((other, sentence)) = note {
        notes.at(line, format!("line {other} of {}: {sentence}", quoted(what)));
    }
    Ok(Some(tilt))
}

/// Lamp-to-luminaire geometry, number of pairs, angles, factors.
fn factors(path: &Path, words: &mut WordReader) -> Result<Tilt, InputError> {
    let (_, geometry) = words.whole("lamp-to-luminaire geometry", 1, 3)?;
    let (_, count) = words.whole("number of tilt angles", 1, 721)?;
    let listed = angles::read(path, words, count as usize, "tilt angle", [-180.0, 180.0], &mut Notes::default())?;
    let mut factors = Vec::new();
    for _ in 0..count {
        let (line, factor) = words.number("a tilt factor")?;
        if !(0.0..=100.0).contains(&factor) {
            return Err(InputError::new(Location::line(path, line), format!("tilt factor {factor}"), "0 to 100"));
        }
        factors.push(factor);
    }
    if listed.fall {
        factors.reverse();
    }
    Ok(Tilt { geometry: geometry as u8, angles: listed.list, factors })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::luminaire::frame::c0_direction;

    fn tilt(geometry: u8, last: f64) -> Tilt {
        Tilt { geometry, angles: vec![0.0, last], factors: vec![1.0, 0.5] }
    }

    /// The lamp's tilt by closed form, for luminaires tilted by 30° towards C0 (about C90) and towards C90 (about C0).
    #[test]
    fn lamps_tilt_as_they_are_mounted() {
        let (sin, cos) = 30.0_f64.to_radians().sin_cos();
        for (aim, expected) in [
            (DVec3::new(sin, 0.0, -cos), [30.0, 30.0, 0.0]),
            (DVec3::new(0.0, sin, -cos), [30.0, 0.0, 30.0]),
            (DVec3::new(0.0, sin, cos), [30.0, 0.0, 30.0]),
            (DVec3::NEG_Z, [0.0; 3]),
            (DVec3::Z, [0.0; 3]),
        ] {
            let c0 = c0_direction(aim, 0.0);
            let found = [1, 2, 3].map(|geometry| tilt(geometry, 90.0).of_lamp(aim, c0));
            assert_eq!(found, expected, "{aim}");
        }
        // A table up to 180° tells base up from base down; one of 60° ends before.
        assert_eq!([1, 2, 3].map(|geometry| tilt(geometry, 180.0).of_lamp(DVec3::Z, DVec3::X)), [180.0, 0.0, 180.0]);
        let short = tilt(1, 60.0);
        let angle = short.of_lamp(DVec3::X, DVec3::Z);
        assert_eq!((angle, short.is_beyond(angle), short.factor(angle)), (90.0, true, 0.5));
    }

    /// Turned by 90° about its aim, a luminaire that is tilted towards C0 is one that is tilted towards C90.
    #[test]
    fn rotation_counts() {
        let aim = DVec3::new(1.0, 0.0, -1.0).normalize();
        let found = [2, 3].map(|geometry| tilt(geometry, 90.0).of_lamp(aim, c0_direction(aim, 90.0)));
        assert_eq!(found, [0.0, 45.0]);
    }
}
