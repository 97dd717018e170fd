//! All luminaires at one level, which follows the sensor that lacks most: what a room without zones can do.

use super::{Controller, Installation, Make, Observation};
use crate::error::InputError;
use crate::random::Stream;
use crate::scene::fields::Fields;

/// Keys of `[uniform]`.
pub(super) const KEYS: [&str; 1] = ["gain"];

/// Integral control of one level for all.
struct Uniform {
    /// Share of the relative difference that is made up for at a step.
    gain: f64,
    level: Option<f64>,
}

impl Controller for Uniform {
    fn step(&mut self, seen: &Observation<'_>, _: &mut Stream) -> Vec<f64> {
        let count = seen.levels.len();
        let level = self.level.unwrap_or_else(|| seen.levels.iter().sum::<f64>() / count as f64);
        let asked = seen.sensors.iter().filter(|sensor| sensor.target.is_some());
        let lacks = asked.filter_map(|sensor| Some(sensor.target? / sensor.reading?.max(1.0)));
        let worst = lacks.fold(f64::NEG_INFINITY, f64::max);
        let nobody = seen.sensors.iter().all(|sensor| sensor.target.is_none());
        let next = match worst {
            _ if nobody => 0.0,
            // Sensors of those who are there say nothing: no reason to change.
            worst if worst == f64::NEG_INFINITY => level,
            // From off on, a hundredth is where growth begins.
            worst => (level.max(0.01) * (1.0 + self.gain * (worst - 1.0))).clamp(0.0, 1.0),
        };
        self.level = Some(next);
        vec![next; count]
    }
}

/// Reads `[uniform]`.
pub(super) fn read(fields: Option<&Fields<'_>>) -> Result<Make, InputError> {
    let gain = match fields {
        Some(fields) => fields.number("gain", "a number above 0, up to 1", |n| n > 0.0 && n <= 1.0)?,
        None => None,
    };
    let gain = gain.map_or(0.2, |gain| gain.value);
    Ok(Box::new(move |_: &Installation<'_>| Box::new(Uniform { gain, level: None })))
}
