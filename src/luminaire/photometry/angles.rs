//! Lists of angles as files write them, and the symmetry that their ends show.
//!
//! Lists ascend as a rule. Some files list downwards, and some count planes past 360° (270 … 450) or begin anew at 0°
//! (270 … 350, 0 … 90): the order of the directions is the same, so both are read, with a note.

use std::path::Path;

use super::text::{CLOSEST, WordReader};
use super::{Notes, Symmetry};
use crate::error::{InputError, Location};

/// Where planes about the vertical axis may lie, degrees: a turn to either side.
pub(super) const TURNS: [f64; 2] = [-360.0, 720.0];

/// Most planes, and most angles in one.
pub(super) const MOST: i64 = 7201;

/// A list of angles.
pub(super) struct Angles {
    /// Line of the first.
    pub(super) line: usize,
    /// Ascending, degrees.
    pub(super) list: Vec<f64>,
    /// Whether the file lists them downwards.
    pub(super) fall: bool,
}

/// Reads `count` angles within a range.
pub(super) fn read(
    path: &Path,
    words: &mut WordReader,
    count: usize,
    what: &str,
    [low, high]: [f64; 2],
    notes: &mut Notes,
) -> Result<Angles, InputError> {
    let mut listed: Vec<(usize, f64)> = Vec::with_capacity(count);
    for number in 1..=count {
        let (line, angle) = words.number(&format!("{what} {number} of {count}, degrees"))?;
        if !(low..=high).contains(&angle) {
            let found = format!("{what} {angle}");
            return Err(InputError::new(Location::line(path, line), found, format!("{low}° to {high}°")));
        }
        listed.push((line, angle));
    }
    let line = listed.first().map_or(words.at(), |(line, _)| *line);
    let mut list: Vec<f64> = listed.iter().map(|(_, angle)| *angle).collect();
    let begins_anew = [low, high] == TURNS && unwrap(&mut list);
    if begins_anew {
        notes.at(line, format!("{what}s run past 360° and begin anew at 0°"));
    }
    let fall = list.len() > 1 && list[list.len() - 1] < list[0];
    let sign = if fall { -1.0 } else { 1.0 };
    if let Some(place) = list.windows(2).position(|pair| sign * (pair[1] - pair[0]) < CLOSEST) {
        let than = if fall { "less" } else { "more" };
        let found = format!("{what} {}", listed[place + 1].1);
        let expected = format!("{than} than the one before, {}", listed[place].1);
        return Err(InputError::new(Location::line(path, listed[place + 1].0), found, expected));
    }
    if fall {
        notes.at(line, format!("{what}s in descending order"));
        list.reverse();
    }
    if list.len() > 1 && list[list.len() - 1] - list[0] > 360.0 + CLOSEST {
        let found = format!("{what}s from {}° to {}°", list[0], list[list.len() - 1]);
        return Err(InputError::new(Location::line(path, line), found, "one turn at most"));
    }
    Ok(Angles { line, list, fall })
}

/// Counts on past 360° (or below 0°) where a list begins anew once; whether it does.
fn unwrap(list: &mut [f64]) -> bool {
    for sign in [1.0, -1.0] {
        let breaks = |list: &[f64]| list.windows(2).filter(|pair| sign * (pair[1] - pair[0]) < CLOSEST).count();
        if breaks(list) != 1 || sign * (list[list.len() - 1] - list[0]) > 0.0 {
            continue;
        }
        let Some(place) = list.windows(2).position(|pair| sign * (pair[1] - pair[0]) < CLOSEST) else { continue };
        let step = sign * (list[place + 1] - list[place]) + 360.0;
        let span = sign * (list[list.len() - 1] - list[0]) + 360.0;
        if list.len() > 2 && step > CLOSEST && step < 180.0 && span <= 360.0 + CLOSEST {
            list[place + 1..].iter_mut().for_each(|angle| *angle += sign * 360.0);
            return true;
        }
    }
    false
}

/// Symmetry that planes of type C, ascending, show by where they begin and end.
///
/// LM-63 knows 0° alone, 0° to 90°, 0° to 180°, 90° to 270° and 0° to 360°. Halves and quarters elsewhere between C0,
/// C90, C180 and C270 can mean nothing else than those; and planes at equal steps all around need none at 0°.
pub(super) fn symmetry(path: &Path, line: usize, planes: &[f64], notes: &mut Notes) -> Result<Symmetry, InputError> {
    let (first, last) = (planes[0], planes[planes.len() - 1]);
    if planes.len() == 1 {
        return Ok(Symmetry::Rotational);
    }
    let (span, start) = (last - first, super::table::within_turn(first));
    let widest = planes.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    let gap = 360.0 - span;
    let is = |angle: f64, other: f64| (angle - other).abs() < CLOSEST;
    let starts = |angles: &[f64]| angles.iter().any(|angle| is(start, *angle));
    let mut unusual = |symmetry: Symmetry, about: &str| {
        notes.at(line, format!("planes from {first}° to {last}°, taken as symmetrical about {about}"));
        Ok(symmetry)
    };
    if is(span, 90.0) {
        match () {
            () if starts(&[0.0]) => return Ok(Symmetry::Quadrant),
            () if starts(&[90.0, 180.0, 270.0]) => return unusual(Symmetry::Quadrant, "C0–C180 and C90–C270"),
            () => {}
        }
    }
    if is(span, 180.0) {
        match () {
            () if starts(&[0.0]) => return Ok(Symmetry::AboutC0),
            () if starts(&[90.0, 270.0]) => return Ok(Symmetry::AboutC90),
            () if starts(&[180.0]) => return unusual(Symmetry::AboutC0, "C0–C180"),
            () => {}
        }
    }
    if gap <= 180.0 && gap <= 1.5 * widest {
        return Ok(Symmetry::None);
    }
    if starts(&[0.0]) && span > 180.0 {
        let sentence = format!("no plane between {last}° and 360°; intensities run straight from one to the other");
        notes.at(line, sentence);
        return Ok(Symmetry::None);
    }
    let found = format!("horizontal angles from {first}° to {last}°");
    let expected = "0° alone, 0° to 90°, 0° to 180°, 90° to 270° or 0° to 360°";
    Err(InputError::new(Location::line(path, line), found, expected))
}

#[cfg(test)]
mod tests {
    use super::super::text::Commas;
    use super::*;

    fn planes(text: &str) -> Result<(Vec<f64>, bool), String> {
        let lines = [text];
        let path = Path::new("x");
        let mut words = WordReader::new(path, &lines, 0, Commas::Part);
        let count = words.left();
        read(path, &mut words, count, "plane", TURNS, &mut Notes::default())
            .map(|angles| (angles.list, angles.fall))
            .map_err(|error| error.to_string())
    }

    #[test]
    fn lists_run_either_way_and_past_360() {
        let past: Vec<f64> = vec![270.0, 330.0, 360.0, 390.0, 450.0];
        assert_eq!(planes("270 330 360 390 450"), Ok((past.clone(), false)));
        assert_eq!(planes("270 330 0 30 90"), Ok((past.clone(), false)));
        assert_eq!(planes("270 330 360 30 90"), Ok((past, false)));
        assert_eq!(planes("90 30 0 330 270"), Ok((vec![-90.0, -30.0, 0.0, 30.0, 90.0], true)));
        assert_eq!(planes("30 20 0"), Ok((vec![0.0, 20.0, 30.0], true)));
        assert_eq!(planes("7"), Ok((vec![7.0], false)));
        for (wrong, says) in [
            ("0 10 5", "found plane 5, expected more than the one before, 10"),
            ("10 20 5", "found plane 20, expected less than the one before, 10"),
            ("0 90 45 180", "found plane 45, expected more than the one before, 90"),
            ("0 0", "found plane 0, expected more than the one before, 0"),
            ("0 180 370", "found planes from 0° to 370°, expected one turn at most"),
        ] {
            let error = planes(wrong).unwrap_err();
            assert!(error.contains(says), "{wrong}: {error}");
        }
    }

    #[test]
    fn ends_tell_the_symmetry() {
        let of = |planes: &[f64]| symmetry(Path::new("x"), 1, planes, &mut Notes::default()).ok();
        assert_eq!(of(&[0.0, 45.0, 90.0]), Some(Symmetry::Quadrant));
        assert_eq!(of(&[270.0, 360.0]), Some(Symmetry::Quadrant));
        assert_eq!(of(&[180.0, 270.0, 360.0]), Some(Symmetry::AboutC0));
        assert_eq!([of(&[270.0, 360.0, 450.0]), of(&[-90.0, 0.0, 90.0])], [Some(Symmetry::AboutC90); 2]);
        assert_eq!(of(&[22.5, 112.5, 202.5, 292.5]), Some(Symmetry::None));
        assert_eq!([of(&[0.0, 80.0]), of(&[10.0, 100.0]), of(&[30.0, 60.0, 90.0, 120.0])], [None; 3]);
    }
}
