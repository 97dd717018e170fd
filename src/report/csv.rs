//! Maps and readings as CSV: comma-separated, one header line, points as decimal marks.
//!
//! Positions are exact to a micrometre, illuminances have six significant digits, so that equal results give equal
//! files.

use std::io::{self, Write};

use ::csv::{Writer, WriterBuilder};
use glam::DVec3;

use crate::error::invalid;
use crate::results::{GroupReading, IlluminanceMap, SensorReading};
use crate::text::number::round_to;

/// Columns of a plane's file.
const PLANE: [&str; 5] = ["x_m", "y_m", "z_m", "E_lx", "standard_error_lx"];

/// Columns of the sensors' file.
const SENSORS: [&str; 7] = ["name", "x_m", "y_m", "z_m", "E_lx", "standard_error_lx", "target_lx"];

/// Columns of the light groups' file.
const GROUPS: [&str; 4] = ["sensor", "group", "E_lx", "standard_error_lx"];

/// One line for each cell, row by row from the corner: world position of its centre, E and its standard error (1 σ),
/// both empty where no light can arrive.
///
/// # Errors
/// Where `out` fails, and where a value isn't finite.
pub fn write_plane(map: &IlluminanceMap, out: &mut impl Write) -> io::Result<()> {
    map.check()?;
    let mut table = table(out);
    table.write_record(PLANE)?;
    for cell in 0..map.illuminance.len() {
        let [x, y, z] = position(map.point(cell));
        let error = map.has_value[cell].then(|| map.standard_error[cell]);
        table.write_record([x, y, z, illuminance(map.value(cell)), illuminance(error)])?;
    }
    table.flush()
}

/// One line for each sensor; E and error are empty where no light can arrive, the target where none is asked for.
///
/// # Errors
/// Where `out` fails, and where a value isn't finite.
pub fn write_sensors(sensors: &[SensorReading], out: &mut impl Write) -> io::Result<()> {
    let mut table = table(out);
    table.write_record(SENSORS)?;
    for sensor in sensors {
        if sensor.has_value && !(sensor.illuminance + sensor.standard_error).is_finite() {
            return Err(invalid(format!("sensor \"{}\" reads {} lx", sensor.name, sensor.illuminance)));
        }
        let [x, y, z] = position(sensor.position);
        let value = |quantity: f64| illuminance(sensor.has_value.then_some(quantity));
        let (e, error) = (value(sensor.illuminance), value(sensor.standard_error));
        table.write_record([sensor.name.clone(), x, y, z, e, error, illuminance(sensor.target)])?;
    }
    table.flush()
}

/// One line for each sensor and light group, `groups` being their names; E and error are empty where no light can
/// arrive.
///
/// # Errors
/// Where `out` fails, and where a value isn't finite.
pub fn write_groups(sensors: &[SensorReading], groups: &[String], out: &mut impl Write) -> io::Result<()> {
    let mut table = table(out);
    table.write_record(GROUPS)?;
    for sensor in sensors {
        for (name, &GroupReading { illuminance: e, standard_error }) in groups.iter().zip(&sensor.groups) {
            if !(e + standard_error).is_finite() {
                return Err(invalid(format!("sensor \"{}\" reads {e} lx of group \"{name}\"", sensor.name)));
            }
            let value = |quantity: f64| illuminance(sensor.has_value.then_some(quantity));
            table.write_record([sensor.name.clone(), name.clone(), value(e), value(standard_error)])?;
        }
    }
    table.flush()
}

/// A buffered table; lines end in `\n` on every system.
fn table<W: Write>(out: W) -> Writer<W> {
    WriterBuilder::new().from_writer(out)
}

/// Coordinates in m, to the micrometre.
fn position(point: DVec3) -> [String; 3] {
    point.to_array().map(|metres| format!("{}", (metres * 1e6).round() / 1e6 + 0.0))
}

/// An illuminance in lx, or nothing.
fn illuminance(value: Option<f64>) -> String {
    value.map_or_else(String::new, |lux| round_to(lux, 6).to_string())
}
