//! Levels, held against renders with them.

use super::influence::SensorRow;
use super::sure::{self, Known, Readings, Sure};
use super::{Goal, Influence};
use crate::error::Error;
use crate::results::Results;
use crate::scene::Levels;

/// Levels that renders have verified.
pub struct Verified {
    /// The levels, and what being sure of them costs.
    pub sure: Sure,
    /// How many renders there were.
    pub renders: u64,
    /// What the last of them found; nothing where there were none.
    pub results: Option<Results>,
}

/// Renders a scene at some levels, with random numbers that belong to the number given; also says whether another
/// render is allowed.
pub type Render<'a> = &'a mut dyn FnMut(Levels, u64) -> Result<(Results, bool), Error>;

/// Verifies levels by renders, and mends them; see [`sure::verify`]. Where every luminaire is off there is nothing to
/// render.
///
/// # Errors
/// As [`sure::verify`].
pub fn verify(known: &mut Known, goal: Goal, z: f64, sure: Sure, render: Render<'_>) -> Result<Verified, Error> {
    if sure.is_dark() {
        return Ok(Verified { sure, renders: 0, results: None });
    }
    let matrix = known.mean.clone();
    let mut last = None;
    let mut read = |levels: &[f64], number: u64| {
        let (results, go_on) = render(named(&matrix, levels), number)?;
        let reading = |place: &SensorRow| {
            let reading = results.sensor(&place.name).filter(|reading| reading.has_value)?;
            Some((reading.illuminance, reading.standard_error))
        };
        let of = matrix.sensors.iter().map(reading).collect();
        last = Some(results);
        Ok(Readings { of, go_on })
    };
    let (sure, renders) = sure::verify(known, goal, z, sure, &mut read)?;
    Ok(Verified { sure, renders, results: last })
}

/// Levels by the luminaires' names.
pub fn named(matrix: &Influence, levels: &[f64]) -> Levels {
    let names = matrix.luminaires.iter().map(|luminaire| luminaire.name.clone());
    Levels::new(names.zip(levels.iter().copied()))
}
