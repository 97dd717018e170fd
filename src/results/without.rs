//! Cells, samples and sensors without a value, and why they have none.

use crate::gather::reach::Standing;
use crate::results::{Results, SensorReading};
use crate::text::number::count;

/// How many have no value for each reason, in the order of [`Standing::WITHOUT_VALUE`].
pub fn counts(standing: &[Standing]) -> [usize; 3] {
    Standing::WITHOUT_VALUE.map(|reason| standing.iter().filter(|standing| **standing == reason).count())
}

/// The reasons with their counts, as `12 shut off by a closed body, 4 covered`; empty where all have a value.
pub fn reasons(standing: &[Standing]) -> String {
    let told = Standing::WITHOUT_VALUE.iter().zip(counts(standing)).filter(|(_, number)| *number > 0);
    let told: Vec<String> =
        told.map(|(reason, number)| format!("{} {}", count(number as u64), reason.reason())).collect();
    told.join(", ")
}

/// A line for each plane and each surface of which some part has no value, and for each such sensor.
pub fn lines(results: &Results) -> Vec<String> {
    let line = |kind: &str, name: &str, parts: &str, standing: &[Standing]| {
        let without = counts(standing).iter().sum::<usize>();
        let (without, all) = (count(without as u64), count(standing.len() as u64));
        format!("{kind} \"{name}\": {without} of {all} {parts}: {}", reasons(standing))
    };
    let lacks = |standing: &[Standing]| standing.iter().any(|standing| !standing.is_place());
    let planes = results.maps.iter().filter(|map| lacks(&map.standing));
    let planes = planes.map(|map| line("plane", &map.name, "cells", &map.standing));
    let surfaces = results.surfaces.iter().filter(|map| lacks(&map.standing));
    let surfaces = surfaces.map(|map| line("surface", &map.name, "samples", &map.standing));
    let sensor = |sensor: &SensorReading| format!("sensor \"{}\": {}", sensor.name, sensor.standing.reason());
    let sensors = results.sensors.iter().filter(|reading| !reading.has_value).map(sensor);
    planes.chain(surfaces).chain(sensors).collect()
}
