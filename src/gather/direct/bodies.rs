//! Direct light on small bodies: on many flat cells about each, exactly as on any flat cell; their mean is the body's.

use super::blockers::Blockers;
use super::{DirectGroups, DirectLight, Request, direct_light_for};
use crate::flux::photometric;
use crate::gather::meter::{FlatCells, MeasuredBody};
use crate::gather::receiver::Receiver;
use crate::luminaire::{LightGroups, Luminaire};
use crate::random::Seed;

/// Direct illuminance of every body of `receiver` by all luminaires. `progress` is called with steps that add up to one
/// for each luminaire.
///
/// Error: that of flat cells (see `direct_light`), and that of taking the mean over so many of them, which is part of
/// the variance. Cost: that of 63 to 1026 flat cells each.
pub fn direct_on_bodies<const C: usize>(
    luminaires: &[Luminaire],
    receiver: &Receiver,
    bodies: &[MeasuredBody],
    blockers: &Blockers<'_>,
    seed: Seed,
    progress: impl Fn(u64) + Sync,
    groups: Option<&LightGroups>,
) -> DirectLight<C> {
    let cells: Vec<FlatCells> = bodies.iter().map(MeasuredBody::cells).collect();
    let faces = cells.iter().enumerate().flat_map(|(body, cells)| {
        cells.weighted.iter().map(move |(normal, _)| (receiver.start(body), normal.as_vec3()))
    });
    let faces = Receiver::of_faces(faces);
    let asked = Request { groups, faint: false };
    let (flat, _): (DirectLight<C>, _) = direct_light_for(luminaires, &faces, blockers, seed, progress, asked);
    let mut light =
        DirectLight { value: Vec::new(), variance: Vec::new(), left_out: Vec::new(), rays: flat.rays, groups: None };
    let mut parts = groups.map(|_| DirectGroups { value: Vec::new(), variance: Vec::new() });
    let mut first = 0;
    for FlatCells { weighted, about, error } in &cells {
        let (mut value, mut variance, mut left_out, mut mean) = ([0.0; C], 0.0, 0.0, 0.0);
        for (cell, &(_, weight)) in (first..).zip(weighted) {
            (0..C).for_each(|c| value[c] += weight * flat.value[cell][c]);
            variance += weight * weight * flat.variance[cell];
            left_out += weight.abs() * flat.left_out[cell];
            if cell - first < *about {
                mean += weight * photometric(flat.value[cell]);
            }
        }
        if let (Some(parts), Some(rows), Some(groups)) = (&mut parts, &flat.groups, groups) {
            let own = |row: &[f32], width: usize, power: i32| -> Vec<f32> {
                let of_column = |column| {
                    let cells = (first..).zip(weighted);
                    let part = cells.map(|(cell, (_, w))| w.powi(power) * f64::from(row[cell * width + column]));
                    part.sum::<f64>() as f32
                };
                (0..width).map(of_column).collect()
            };
            let (lux, scatter) = (own(&rows.value, groups.width::<C>(), 1), own(&rows.variance, groups.len(), 2));
            let resolved = lux.chunks_exact(C).zip(scatter).map(|(lux, scatter)| {
                let lux = photometric::<C>(std::array::from_fn(|c| f64::from(lux[c])));
                scatter + (error * lux).powi(2) as f32
            });
            parts.variance.extend(resolved);
            parts.value.extend(lux);
        }
        first += weighted.len();
        light.value.push(value.map(|value| value.max(0.0)));
        light.variance.push(variance + (error * mean).powi(2));
        light.left_out.push(left_out);
    }
    light.groups = parts;
    light
}
