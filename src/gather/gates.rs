//! Between which grid points light's edges run: walls, partitions and furniture that stand through a measuring plane.
//!
//! A ray from each point to its neighbours on the right and above finds whether something stands between the two; a
//! point sees another if the way there, cell by cell, is free. That costs two rays a point where a visible polygon
//! costs 64, and is as good for points that lie on a grid anyway.

use rayon::prelude::*;

use super::receiver::Receiver;
use crate::embree::RayCaster;

/// Free ways between the points of a grid.
pub struct Gates {
    columns: usize,
    rows: usize,
    /// Which of the eight [`Step`]s from each point are free.
    free: Vec<u8>,
    /// Sums of what is not free over all cells left of and below each: four of them decide whether a window is open.
    closed: Vec<u32>,
}

impl Gates {
    /// Casts rays between the grid points of a receiver; those without a value are shut off. Cost: two rays a point.
    pub fn new(receiver: &Receiver, [columns, rows]: [usize; 2], has_value: &[bool], caster: &RayCaster) -> Self {
        let eye = |point: usize| receiver.position(point) + receiver.normal * receiver.tolerance;
        let free_between = |point: usize, next: usize| {
            let (from, to) = (eye(point), eye(next));
            let distance = from.distance(to);
            has_value[point] && has_value[next] && !caster.is_occluded(from, (to - from) / distance, distance)
        };
        let free: Vec<[bool; 2]> = (0..columns * rows)
            .into_par_iter()
            .with_min_len(64)
            .map(|point| {
                let right = point % columns + 1 == columns || free_between(point, point + 1);
                let above = point / columns + 1 == rows || free_between(point, point + columns);
                [right, above]
            })
            .collect();
        let ways =
            (0..columns * rows).into_par_iter().with_min_len(1024).map(|point| ways(&free, point, columns, rows));
        let ways: Vec<u8> = ways.collect();
        let mut closed = vec![0; (columns + 1) * (rows + 1)];
        for row in 0..rows {
            let mut sum = 0;
            for column in 0..columns {
                let point = row * columns + column;
                sum += u32::from(free[point] != [true; 2] || !has_value[point]);
                closed[(row + 1) * (columns + 1) + column + 1] = closed[row * (columns + 1) + column + 1] + sum;
            }
        }
        Self { columns, rows, free: ways, closed }
    }

    /// Whether every point of the window `columns` and `rows` to each side of a point lies on the grid, has a value and
    /// is seen.
    pub fn open(&self, point: usize, [columns, rows]: [usize; 2]) -> bool {
        let (column, row) = (point % self.columns, point / self.columns);
        if column < columns || row < rows || column + columns >= self.columns || row + rows >= self.rows {
            return false;
        }
        let at = |column: usize, row: usize| self.closed[row * (self.columns + 1) + column];
        let (left, right) = (column - columns, column + columns + 1);
        let (low, high) = (row - rows, row + rows + 1);
        at(right, high) + at(left, low) == at(left, high) + at(right, low)
    }

    /// The grid point one step on, if the way is free.
    #[inline]
    pub fn step(&self, point: usize, step: Step) -> Option<usize> {
        let onward = point as i64 + i64::from(step.columns) + i64::from(step.rows) * self.columns as i64;
        (self.free[point] & step.bit != 0).then_some(onward as usize)
    }
}

/// A step to one of the eight neighbours of a grid point.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    columns: i32,
    rows: i32,
    bit: u8,
}

impl Step {
    /// One step to the right (1), left (−1) or neither, and up, down or neither; not neither twice.
    pub fn new(columns: i32, rows: i32) -> Self {
        let index = EIGHT.iter().position(|&step| step == [columns, rows]);
        Self { columns, rows, bit: index.map_or(0, |index| 1 << index) }
    }
}

/// The eight steps, in the order of their bits.
const EIGHT: [[i32; 2]; 8] = [[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, 1], [1, -1], [-1, -1]];

/// Which steps from a point are free, one bit each, where `free` holds those to the right and up of every point. A
/// diagonal step is free if one of the two ways about the corner is.
fn ways(free: &[[bool; 2]], point: usize, columns: usize, rows: usize) -> u8 {
    let straight = |point: usize, [across, up]: [i32; 2]| {
        let (column, row) = (point % columns, point / columns);
        match (across, up) {
            (1, _) => (column + 1 < columns && free[point][0]).then(|| point + 1),
            (-1, _) => (column > 0 && free[point - 1][0]).then(|| point - 1),
            (_, 1) => (row + 1 < rows && free[point][1]).then(|| point + columns),
            _ => (row > 0 && free[point - columns][1]).then(|| point - columns),
        }
    };
    let about = |first: [i32; 2], second: [i32; 2]| straight(point, first).and_then(|corner| straight(corner, second));
    let open = |[across, up]: [i32; 2]| match (across, up) {
        (0, _) | (_, 0) => straight(point, [across, up]).is_some(),
        _ => about([across, 0], [0, up]).or_else(|| about([0, up], [across, 0])).is_some(),
    };
    EIGHT.iter().enumerate().fold(0, |bits, (index, &step)| bits | u8::from(open(step)) << index)
}
