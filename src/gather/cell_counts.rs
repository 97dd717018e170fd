//! Cells of a measuring plane in which photons are counted.
//!
//! E over a cell is the flux that crosses it over its area: no search radius, so no blur, and photons need not be kept.
//! A cell that a wall, a partition or a column cuts counts only what its middle sees in the plane, over the area that
//! it sees. The same question, a ray from the middle, decides both, so what is left out of one is left out of the
//! other.

use glam::Vec3;
use rayon::prelude::*;

use super::receiver::Receiver;
use crate::embree::RayCaster;
use crate::random::low_discrepancy;

/// Points of a side of a cell's edge to which its middle casts rays: what cuts the cell stands before one of them.
const EDGE_POINTS: usize = 8;

/// Part of the way to the edge that these rays go: a wall along the edge does not cut the cell.
const TO_EDGE: f32 = 0.999;

/// Points of a cut cell of which the middle sees some: that share of its area is known within 0.03, mostly within 0.01.
const POINTS: u32 = 256;

/// The cells of a receiver with a grid.
pub struct Cells {
    /// Area that counts, m²; 0 where a cell has no value.
    areas: Vec<f64>,
    /// Whether something stands in a cell.
    cut: Vec<bool>,
}

impl Cells {
    /// Finds what stands in the cells that have a value. Cost: 32 short rays a cell, 256 more in those that are cut.
    pub fn measure(receiver: &Receiver, has_value: &[bool], caster: &RayCaster) -> Self {
        let [width, depth] = receiver.cell;
        let whole = f64::from(width) * f64::from(depth);
        let of = |point: usize| {
            if !has_value[point] {
                return (0.0, false);
            }
            let seen = |[x, y]: [f32; 2], share: f32| {
                let [a, b] = receiver.points[point];
                let at = [a + share * (x - 0.5) * width, b + share * (y - 0.5) * depth];
                sees(receiver, point, at, caster)
            };
            if (0..4 * EDGE_POINTS).all(|step| seen(on_edge(step), TO_EDGE)) {
                return (whole, false);
            }
            let free = (0..POINTS).filter(|&index| seen(spread(index), 1.0)).count();
            (whole * free as f64 / f64::from(POINTS), true)
        };
        let (areas, cut) = (0..receiver.len()).into_par_iter().with_min_len(64).map(of).unzip();
        Self { areas, cut }
    }

    /// Area of each cell that counts, m².
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// The cell that counts a photon that crosses the plane there (plane coordinates).
    #[inline]
    pub fn counting(&self, receiver: &Receiver, at: [f32; 2], caster: &RayCaster) -> Option<usize> {
        let cell = receiver.cell_at(at).filter(|&cell| self.areas[cell] > 0.0)?;
        (!self.cut[cell] || sees(receiver, cell, at, caster)).then_some(cell)
    }
}

/// Whether the middle of a cell sees a place in its plane.
fn sees(receiver: &Receiver, point: usize, [a, b]: [f32; 2], caster: &RayCaster) -> bool {
    let above: Vec3 = receiver.normal * receiver.tolerance;
    let eye = receiver.position(point) + receiver.moved(point) + above;
    let to = receiver.origin + receiver.u * a + receiver.v * b + above - eye;
    let distance = to.length();
    distance <= f32::MIN_POSITIVE || !caster.is_occluded(eye, to / distance, distance)
}

/// Points on the edge of the unit square, its corners among them.
fn on_edge(step: usize) -> [f32; 2] {
    let along = (step % EDGE_POINTS) as f32 / EDGE_POINTS as f32;
    match step / EDGE_POINTS {
        0 => [along, 0.0],
        1 => [1.0, along],
        2 => [1.0 - along, 1.0],
        _ => [0.0, 1.0 - along],
    }
}

/// Points that are even over the unit square whichever way an edge cuts it.
fn spread(index: u32) -> [f32; 2] {
    low_discrepancy(index.into(), [0.5; 2])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The share of the square on one side of a line through it is known within 0.03 at any place and angle: the error
    /// of a cut cell's illuminance.
    #[test]
    fn areas_are_known() {
        for degrees in 0..180 {
            let (sin, cos) = (degrees as f32).to_radians().sin_cos();
            for offset in [-0.4, -0.25, 0.0, 0.1, 0.33_f32] {
                let inside = |[x, y]: [f32; 2]| (x - 0.5) * cos + (y - 0.5) * sin < offset;
                let found = (0..POINTS).filter(|&index| inside(spread(index))).count() as f64 / f64::from(POINTS);
                let fine =
                    (0..250_000).filter(|i| inside([(i % 500) as f32 / 500.0 + 1e-3, (i / 500) as f32 / 500.0 + 1e-3]));
                let expected = fine.count() as f64 / 250_000.0;
                assert!((found - expected).abs() < 0.03, "{degrees}°, {offset}: {found} of {expected}");
            }
        }
    }
}
