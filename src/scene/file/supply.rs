//! How far a luminaire dims, and what power it draws.

use super::super::fields::Placed;
use super::keys::{Key, Section};
use super::kinds::{Number, Range, Several};
use crate::error::InputError;
use crate::luminaire::Supply;

pub(super) static DIMMING: Key<Number> = Key::optional(
    "dimming",
    Number::of(Range::SHARE, "").said("a number from 0 (off) to 1"),
    "1",
    "Level it is dimmed to, as a share of its flux.",
);
pub(super) static DIMMING_MIN: Key<Number> = Key::optional(
    "dimming_min",
    Number::of(Range::to_below(0.0, 1.0), "").said("the lowest level above off, from 0 to below 1"),
    "the first level of power, else 0",
    "Lowest level above off that `luxmap dim` and controllers may choose.",
);
pub(super) static POWER: Key<Several<Vec<[f64; 2]>>> = Key::optional(
    "power",
    Several { unit: "W", forms: WATTS, tables: &[], read: power },
    "unknown",
    "Electric power at full output, or at several levels: straight lines lie between them.",
);
pub(super) static STANDBY: Key<Number> = Key::optional(
    "standby",
    Number::of(Range::between(0.0, 1e9), "W").said("a number from 0 up, W when off"),
    "0",
    "Electric power it draws when it is off.",
);

const WATTS: &str =
    "the power at full output, W, or [level, W] pairs with levels ascending to 1, as [[0.1, 5], [1, 30]]";

/// Pairs of level and power, W.
fn power(section: &Section<'_>, key: &str) -> Result<Option<Vec<[f64; 2]>>, InputError> {
    let accept = |n: f64| (0.0..=1e9).contains(&n);
    let Some(Placed { value: points, .. }) = section.fields.pairs(key, WATTS, accept)? else {
        let full = section.fields.number(key, WATTS, accept)?;
        return Ok(full.map(|full| vec![[0.0, 0.0], [1.0, full.value]]));
    };
    let levels = || points.iter().map(|[level, _]| *level);
    let ascending = levels().zip(levels().skip(1)).all(|(lower, upper)| lower < upper);
    if points.len() < 2 || !ascending || levels().next_back() != Some(1.0) {
        return Err(section.fields.refusal(key, WATTS));
    }
    Ok(Some(points))
}

pub(super) fn read(section: &Section<'_>) -> Result<Supply, InputError> {
    let level = section.get(&DIMMING)?;
    let least = section.get(&DIMMING_MIN)?;
    let off = section.placed(&STANDBY)?;
    let power = section.get(&POWER)?;
    let first = power.as_ref().map_or(0.0, |points| points[0][0]);
    if least.is_some_and(|least| least < first) {
        let expected = format!("at least {first}, the first level that power is given for");
        return Err(section.refusal(&DIMMING_MIN, expected));
    }
    let least = least.unwrap_or(first);
    if let (Some(off), None) = (&off, &power) {
        let expected = "power too: what it draws at full output, W";
        return Err(InputError::new(off.at.clone(), "standby without power", expected));
    }
    let whole = Supply { level: 1.0, least, off: off.map_or(0.0, |n| n.value), power };
    // What is drawn below the lowest level is never drawn.
    let power = whole.power.as_ref().map(|points| {
        let start = whole.power_at(least).filter(|_| least > 0.0).unwrap_or(points[0][1]);
        let above = points.iter().filter(|[level, _]| *level > least);
        std::iter::once([least, start]).chain(above.copied()).collect()
    });
    Ok(Supply { level: level.unwrap_or(1.0), power, ..whole })
}
