//! The live page of a scene: its maps as layers of luminaires, its sensors, and what each luminaire draws.

use std::path::Path;

use glam::DVec3;

use super::Answer;
use super::sure::Known;
use crate::error::Error;
use crate::luminaire::outline::corners;
use crate::luminaire::{Luminaire, Opening};
use crate::report::live::{LiveLamp, LiveSensor, Map, Page};
use crate::report::table;
use crate::results::{GroupMap, IlluminanceMap, Results};
use crate::scene::Scene;

/// How far from a plane a sensor may be and still move along it, m.
const NEAR: f64 = 1e-3;

/// Writes the live page of what a run found of luminaires told apart; see [`Page::write`]. It begins with the levels of
/// `optimum`, or as they are; targets are met where a sensor is so many `sigmas` on the right side.
pub fn write(
    scene: &Scene,
    known: &Known,
    sigmas: f64,
    results: &Results,
    optimum: Option<&Answer>,
    path: &Path,
) -> Result<(), Error> {
    let matrix = &known.mean;
    // Planes along which sensors move come first: that is where people look.
    let serves = |map: &&IlluminanceMap| {
        let on = |place: &super::influence::SensorRow| lies_on(map, place.position.into(), place.normal.into());
        !matrix.sensors.iter().any(on)
    };
    let mut maps: Vec<&IlluminanceMap> = results.maps.iter().collect();
    maps.sort_by_key(serves);
    let level = |lamp: usize| matrix.luminaires[lamp].supply.level;
    let lamp = |(number, luminaire): (usize, &Luminaire)| {
        let dimmable = &matrix.luminaires[number];
        LiveLamp {
            name: dimmable.name.clone(),
            group: dimmable.group.clone(),
            outline: outline(luminaire, scene.centre),
            level: optimum.map_or(level(number), |answer| answer.levels[number]),
            least: dimmable.supply.least,
            power: matrix.curve(number),
            off: matrix.power_of(number, 0.0),
        }
    };
    let map = |map: &IlluminanceMap| Map {
        name: map.name.clone(),
        columns: map.cells[0],
        rows: map.cells[1],
        corner: map.corner.to_array(),
        along: map.along.to_array(),
        across: map.across.to_array(),
        mask: map.has_value.clone(),
        layers: layers(map, level),
        offset: vec![0.0; map.illuminance.len()],
        error: map.illuminance.iter().zip(&map.standard_error).map(|(lux, error)| share(*lux, *error)).collect(),
    };
    let sensor = |number: usize| {
        let place = &matrix.sensors[number];
        let (position, normal) = (DVec3::from(place.position), DVec3::from(place.normal));
        LiveSensor {
            name: place.name.clone(),
            position: place.position,
            plane: maps.iter().position(|map| lies_on(map, position, normal)),
            influence: matrix.lux[number].clone(),
            error: matrix.standard_error[number].clone(),
            told: known.told[number].clone(),
            noise: known.noise_of_renders(number),
            offset: place.daylight,
            target: place.target,
            tolerance: place.tolerance,
        }
    };
    let unit = if matrix.knows_power() {
        ""
    } else {
        " No power is given for some luminaire: its luminous flux stands for it."
    };
    let page = Page {
        title: &matrix.scene,
        about: format!("{}; daylight is in the sensors only.{unit}", table::method(&results.run)),
        unit: matrix.power_unit(),
        luminaires: scene.luminaires.iter().enumerate().map(lamp).collect(),
        planes: maps.iter().map(|plane| map(plane)).collect(),
        sensors: (0..matrix.sensors.len()).map(sensor).collect(),
        optimum: optimum.filter(|answer| answer.missed.is_empty()).map(|answer| answer.levels.clone()),
        sigmas,
    };
    page.write(path)
}

/// The light of each luminaire at full output, lx, of a map computed with them at some levels.
fn layers(map: &IlluminanceMap, level: impl Fn(usize) -> f64) -> Vec<Vec<f32>> {
    if map.groups.is_empty() {
        return vec![map.illuminance.iter().map(|lux| (lux / level(0)) as f32).collect()];
    }
    let part = |(number, group): (usize, &GroupMap)| {
        let full = (1.0 / level(number)) as f32;
        group.illuminance.iter().map(|lux| lux * full).collect()
    };
    map.groups.iter().enumerate().map(part).collect()
}

/// A standard error as a share of what it is of, at most all of it.
fn share(lux: f64, error: f64) -> f32 {
    if error < lux { (error / lux) as f32 } else { 1.0 }
}

/// Corners in the plan, world, m: of the largest part, where there are several.
fn outline(luminaire: &Luminaire, centre: DVec3) -> Vec<[f64; 2]> {
    let plan = |corner: DVec3| [corner.x + centre.x, corner.y + centre.y];
    if let Opening::Triangles(triangles) = &luminaire.opening {
        // A mesh may have thousands: the box around it tells where it is.
        let points = || triangles.iter().flatten();
        let low = points().fold(DVec3::INFINITY, |low, point| low.min(*point));
        let high = points().fold(DVec3::NEG_INFINITY, |high, point| high.max(*point));
        return [[low.x, low.y], [high.x, low.y], [high.x, high.y], [low.x, high.y]]
            .map(|[x, y]| [x + centre.x, y + centre.y])
            .to_vec();
    }
    match corners(&luminaire.opening, DVec3::Z).pop() {
        Some(outline) => outline.into_iter().map(plan).collect(),
        None => vec![plan(luminaire.opening.middle())],
    }
}

/// Whether a sensor measures what the cells of a map do.
fn lies_on(map: &IlluminanceMap, position: DVec3, normal: DVec3) -> bool {
    let away = position - map.corner;
    let share = |side: DVec3| away.dot(side) / side.length_squared();
    let within = |share: f64| (0.0..=1.0).contains(&share);
    let up = map.along.cross(map.across).normalize();
    within(share(map.along)) && within(share(map.across)) && away.dot(up).abs() <= NEAR && up.dot(normal) > 1.0 - 1e-9
}
