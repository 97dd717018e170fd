//! How the points of a receiver are cut into blocks whose points are near each other: one search for what stands in the
//! way serves them all.

use std::ops::Range;

use super::Gather;

/// Sides of a block of grid points, and of its parts: the largest that is no wider than 1.5 times the height of the
/// lowest luminaire above the plane, so that bounds on what luminaires can bring are near the truth.
const BLOCKS: [(usize, usize); 3] = [(16, 4), (8, 4), (4, 2)];
/// Points of a surface in a block, and in its parts: neighbours by how their triangle was halved.
const RUN: usize = 16;
const RUN_PART: usize = 4;

/// Points that are close to each other.
pub(super) struct PointBlock {
    pub(super) points: Vec<usize>,
    /// Where each of its parts ends among the points.
    ends: Vec<usize>,
}

impl PointBlock {
    /// Where the parts lie among the points.
    pub(super) fn parts(&self) -> impl Iterator<Item = Range<usize>> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| start..end)
    }
}

/// Ranges of columns and rows, cut into squares.
fn squares([columns, rows]: [(usize, usize); 2], side: usize) -> impl Iterator<Item = [(usize, usize); 2]> {
    let cut = move |(start, end): (usize, usize)| {
        (start..end).step_by(side).map(move |start| (start, (start + side).min(end)))
    };
    cut(rows).flat_map(move |rows| cut(columns).map(move |columns| [columns, rows]))
}

impl<const C: usize> Gather<'_, C> {
    /// The grid in squares of points, each in smaller squares. Without a grid, points that follow one another and face
    /// the same way, as samples of a triangle do; each sensor on its own.
    pub(super) fn blocks(&self) -> Vec<PointBlock> {
        let receiver = self.receiver;
        let Some([columns, rows]) = receiver.grid else {
            let most = if receiver.is_plane() { 1 } else { RUN };
            let mut blocks: Vec<PointBlock> = Vec::new();
            for point in 0..receiver.len() {
                match blocks.last_mut() {
                    Some(PointBlock { points, ends })
                        if points.len() < most && receiver.normal_at(points[0]) == receiver.normal_at(point) =>
                    {
                        points.push(point);
                        match ends.last_mut() {
                            Some(end) if points.len() % RUN_PART != 1 => *end = points.len(),
                            _ => ends.push(points.len()),
                        }
                    }
                    _ => blocks.push(PointBlock { points: vec![point], ends: vec![1] }),
                }
            }
            return blocks;
        };
        let plane = receiver.origin.as_dvec3().dot(self.up);
        let heights = self.emitters.iter().map(|emitter| emitter.bounds.along(self.up)[1] - plane);
        let lowest = heights.filter(|height| *height > 0.0).fold(f64::INFINITY, f64::min);
        let cell = match receiver.points.as_slice() {
            [first, .., last] => {
                let size = |axis: usize, count: usize| (last[axis] - first[axis]).abs() / count.max(2) as f32;
                f64::from(size(0, columns).max(size(1, rows)))
            }
            _ => 0.0,
        };
        let fits = |side: usize| cell * side as f64 <= 1.5 * lowest;
        let (block, part) = BLOCKS.into_iter().find(|(side, _)| fits(*side)).unwrap_or(BLOCKS[2]);
        squares([(0, columns), (0, rows)], block)
            .map(|ranges| {
                let mut block = PointBlock { points: Vec::with_capacity(block * block), ends: Vec::new() };
                for [across, along] in squares(ranges, part) {
                    for row in along.0..along.1 {
                        block.points.extend((across.0..across.1).map(|column| row * columns + column));
                    }
                    block.ends.push(block.points.len());
                }
                block
            })
            .collect()
    }
}
