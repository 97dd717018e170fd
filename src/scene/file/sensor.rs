//! `[[sensor]]`: single points, or small bodies, where illuminance is measured.

use std::path::Path;

use glam::DVec3;

use super::super::Sensor;
use super::super::fields::{FARTHEST, Placed};
use super::super::measure::Measure;
use super::TakenNames;
use super::array::{self, Array};
use super::keys::{Key, Section, Table};
use super::kinds::{Direction, Inner, Metres, Number, OneOf, Range, Text};
use crate::error::{InputError, Location};
use crate::files::limits::MOST_SENSORS;

/// What light is measured: [`Measure`] without its directions.
#[derive(Clone, Copy, PartialEq)]
enum MeasuredLight {
    Plane,
    Cylindrical,
    Semicylindrical,
    Hemispherical,
    Spherical,
}

const LUX: Range = Range::between(0.0, 1e12);

static NAME: Key<Text> = Key::needed("name", Text::NAME, "\"sensor 1\"", "Its name in results.");
static POSITION: Key<Metres> = Key::needed("position", Metres, "[x, y, z] (m)", "Where it is; of an array, its first.");
static NORMAL: Key<Direction> = Key::needed_unless(
    "normal",
    Direction,
    "[0, 0, 1]; required where measure is \"plane\"",
    "[0, 0, 1]",
    "Normal of the measured side; the axis of a cylinder or half sphere.",
);
static MEASURE: Key<OneOf<MeasuredLight>> = Key::optional(
    "measure",
    OneOf(&[
        ("plane", MeasuredLight::Plane),
        ("cylindrical", MeasuredLight::Cylindrical),
        ("semicylindrical", MeasuredLight::Semicylindrical),
        ("hemispherical", MeasuredLight::Hemispherical),
        ("spherical", MeasuredLight::Spherical),
    ]),
    "\"plane\"",
    "Which illuminance: on a flat cell, or the mean over a small body; under even luminance L all read π L.",
);
static FACING: Key<Direction> = Key::needed_unless(
    "facing",
    Direction,
    "required where measure is \"semicylindrical\"",
    "[1, 0, 0]",
    "Direction into which the half cylinder looks, at a right angle to the axis.",
);
static TARGET: Key<Number> = Key::optional(
    "target",
    Number::of(LUX, "lx").said("a number from 0 up, lx"),
    "none",
    "Illuminance that the person there asks for: `luxmap dim` reaches it, `luxmap render --check` tests it.",
);
static TOLERANCE: Key<Number> = Key::optional(
    "tolerance",
    Number::of(LUX, "lx").said("a number from 0 up, above the target, lx"),
    "any amount",
    "How much more than `target` is still welcome.",
);
static DAYLIGHT: Key<Number> = Key::optional(
    "daylight",
    Number::of(LUX, "lx").said("a number from 0 up, beside the luminaires' light, lx"),
    "0",
    "Illuminance from elsewhere that `luxmap dim` counts on; it is in no result of a render.",
);
static DISC: Key<Number> = Key::optional(
    "disc",
    Number::of(Range::above_to(0.0, 1e6), "m").said("a diameter above 0, up to 1e6 m"),
    "a point",
    "Diameter of a flat disc that the illuminance is the mean over.",
);
static ARRAY: Key<Inner<Array>> = Key::optional("array", array::SENSORS, "a single sensor", "Rows of equal sensors.");

pub(super) static SENSOR: Table = Table {
    head: "[[sensor]]",
    about: "A point where illuminance is measured as by a meter. Results are lines of `sensors.csv`.",
    keys: &[&NAME, &POSITION, &NORMAL, &MEASURE, &FACING, &TARGET, &TOLERANCE, &DAYLIGHT, &DISC, &ARRAY],
    rules: &[
        "`facing` goes with `measure = \"semicylindrical\"` only, `disc` with `\"plane\"` only; `\"spherical\"` has \
         no `normal`.",
        "`tolerance` needs a `target`.",
        "No two sensors have the same name, members of arrays included; arrays make at most 100,000.",
    ],
    example: "\
[[sensor]]
name = \"desk\"
position = [1.5, 1.2, 0.75]
normal = [0, 0, 1]
target = 500
tolerance = 100
array = { count = [3, 2], pitch = [1.6, 2.4] }

[[sensor]]
name = \"face, standing\"
position = [3.0, 3.6, 1.6]
measure = \"cylindrical\"

[[sensor]]
name = \"face, towards the desk\"
position = [1.6, 2.3, 1.2]
measure = \"semicylindrical\"
facing = [0, -1, 0]
",
};

/// Reads one, or all of its array, behind those there are.
pub(super) fn read(section: &Section<'_>, names: &mut TakenNames, sensors: &mut Vec<Sensor>) -> Result<(), InputError> {
    let name = names.take(section, &NAME)?;
    let position = section.need(&POSITION)?;
    let (measure, normal) = measure(section)?;
    let disc = section.get(&DISC)?;
    if disc.is_some() && measure != Measure::Plane {
        return Err(section.refusal(&DISC, "disc beside measure = \"plane\" only"));
    }
    let sensor = Sensor {
        name,
        position,
        normal,
        measure,
        disc,
        target: section.get(&TARGET)?,
        tolerance: section.get(&TOLERANCE)?,
        daylight: section.get(&DAYLIGHT)?.unwrap_or(0.0),
    };
    if sensor.tolerance.is_some() && sensor.target.is_none() {
        return Err(section.refusal(&TOLERANCE, "tolerance beside target only"));
    }
    spread_out(sensor, section, names, sensors)
}

/// What is measured, and the normal or axis.
fn measure(section: &Section<'_>) -> Result<(Measure, DVec3), InputError> {
    let light = section.get(&MEASURE)?.unwrap_or(MeasuredLight::Plane);
    let normal = section.get(&NORMAL)?;
    let facing = section.get(&FACING)?;
    if facing.is_some() && light != MeasuredLight::Semicylindrical {
        return Err(section.refusal(&FACING, "facing beside measure = \"semicylindrical\" only"));
    }
    let axis = normal.unwrap_or(DVec3::Z);
    Ok(match light {
        MeasuredLight::Plane => (Measure::Plane, normal.ok_or_else(|| section.missing(&NORMAL))?),
        MeasuredLight::Cylindrical => (Measure::Cylindrical, axis),
        MeasuredLight::Semicylindrical => {
            let facing = facing.ok_or_else(|| section.missing(&FACING))?;
            if facing.dot(axis).abs() > 1e-6 {
                let error = section.refusal(&FACING, "a direction at a right angle to the axis");
                let angle = facing.angle_between(axis).to_degrees();
                return Err(error.hint(format!("the axis is normal, [0, 0, 1] if not given; the angle is {angle:.4}°")));
            }
            (Measure::Semicylindrical { facing }, axis)
        }
        MeasuredLight::Hemispherical => (Measure::Hemispherical, axis),
        MeasuredLight::Spherical if normal.is_some() => {
            return Err(section.refusal(&NORMAL, "no normal beside measure = \"spherical\""));
        }
        MeasuredLight::Spherical => (Measure::Spherical, axis),
    })
}

/// A sensor, or all of its array: rows along world x and y.
fn spread_out(
    sensor: Sensor,
    section: &Section<'_>,
    names: &mut TakenNames,
    sensors: &mut Vec<Sensor>,
) -> Result<(), InputError> {
    let Some(Array { count, pitch, .. }) = section.get(&ARRAY)? else {
        sensors.push(sensor);
        return Ok(());
    };
    if sensors.len() as u64 + count[0] * count[1] > MOST_SENSORS {
        return Err(section.refusal(&ARRAY, format!("at most {MOST_SENSORS} sensors in all")));
    }
    let at = section.placed(&NAME)?.map_or_else(|| Location::file(Path::new("")), |name| name.at);
    for (row, column) in (0..count[1]).flat_map(|row| (0..count[0]).map(move |column| (row, column))) {
        let name = format!("{}[{},{}]", sensor.name, column + 1, row + 1);
        let position = sensor.position + DVec3::new(column as f64 * pitch[0], row as f64 * pitch[1], 0.0);
        if position.abs().max_element() > FARTHEST {
            return Err(section.refusal(&ARRAY, "an array within 1e9 m of the origin"));
        }
        let name = names.add(Placed { value: name, at: at.clone() })?;
        sensors.push(Sensor { name, position, ..sensor.clone() });
    }
    Ok(())
}
