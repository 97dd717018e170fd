//! `array`: rows of equal luminaires or sensors.

use super::super::fields::FARTHEST;
use super::keys::{Key, Section, Table};
use super::kinds::{Inner, Numbers, Range, WholePair};
use crate::error::{InputError, Location};
use crate::files::limits::{MOST_LUMINAIRES, MOST_SENSORS};

/// Rows of equal luminaires or sensors, along world x and y.
pub(crate) struct Array {
    pub(crate) count: [u64; 2],
    /// m.
    pub(crate) pitch: [f64; 2],
    pub(crate) at: Location,
}

/// Most members of an array, of either kind.
const MOST: u64 = MOST_LUMINAIRES;
const _: () = assert!(MOST_LUMINAIRES == MOST_SENSORS, "one table of keys serves both");

static COUNT: Key<WholePair> =
    Key::needed("count", WholePair(MOST), "[3, 5]", "How many stand along x, and how many along y.");
static PITCH: Key<Numbers<2>> = Key::needed(
    "pitch",
    Numbers::of(Range::between(-FARTHEST, FARTHEST), "m").said("two distances in metres, within ±1e9"),
    "[2.0, 1.44] (m)",
    "Distance from one to the next, along x and along y.",
);

static ARRAY: Table = Table {
    head: "array",
    about: "Rows of equal luminaires or sensors along the world's x and y; `position` is that of the first. The one \
            in column i and row j, counted from 1, is named `NAME[i,j]`.",
    keys: &[&COUNT, &PITCH],
    rules: &[],
    example: "",
};

const FORM: &str = "{ count = [3, 5], pitch = [2.0, 1.44] }";

pub(super) const LUMINAIRES: Inner<Array> =
    Inner { form: FORM, table: &ARRAY, read: |array| read(array, "luminaires") };
pub(super) const SENSORS: Inner<Array> = Inner { form: FORM, table: &ARRAY, read: |array| read(array, "sensors") };

fn read(array: &Section<'_>, what: &str) -> Result<Array, InputError> {
    let count = array.need(&COUNT)?;
    let pitch = array.need(&PITCH)?;
    if count[0] * count[1] > MOST {
        return Err(array.refusal(&COUNT, format!("at most {MOST} {what}")));
    }
    Ok(Array { count, pitch, at: array.at().clone() })
}
