//! Parts of space: points of a receiver between which the straight way is free.

use rayon::prelude::*;

use super::{LightReach, SpacePart, Standing};
use crate::gather::receiver::Receiver;
use crate::sets::Sets;

impl LightReach<'_> {
    /// Joins the points of a receiver that are dark as yet with their neighbours; those connected to a place are
    /// places. Returns the rest, part by part. Cost: no more than two rays for each point that is dark as yet.
    pub(super) fn flood(&self, number: usize, receiver: &Receiver, found: &mut [Standing]) -> Vec<SpacePart> {
        let count = receiver.len();
        let columns = receiver.grid.map_or(count, |[columns, _]| columns);
        let open = |point: usize, next: usize| {
            let asked = match [found[point], found[next]] {
                [Standing::Dark, other] | [other, Standing::Dark] => other != Standing::Covered,
                _ => false,
            };
            asked && self.is_free(receiver.start(point), receiver.start(next))
        };
        let joined: Vec<[bool; 2]> = (0..count)
            .into_par_iter()
            .with_min_len(256)
            .map(|point| {
                let right = (point + 1) % columns != 0 && point + 1 < count && open(point, point + 1);
                [right, point + columns < count && open(point, point + columns)]
            })
            .collect();
        let mut sets = Sets::new(count);
        for (point, joined) in joined.iter().enumerate() {
            for (next, _) in [point + 1, point + columns].into_iter().zip(joined).filter(|(_, joined)| **joined) {
                let (a, b) = (sets.root(point as u32), sets.root(next as u32));
                // A place becomes the root, so that the root decides for all.
                let (low, high) = (a.min(b), a.max(b));
                let (root, child) = if found[high as usize].is_place() { (high, low) } else { (low, high) };
                sets.hang(child, root);
            }
        }
        let roots: Vec<u32> = (0..count as u32).map(|point| sets.root(point)).collect();
        let mut dark: Vec<(u32, u32)> = Vec::new();
        for (point, &root) in roots.iter().enumerate() {
            if found[point] == Standing::Dark {
                if found[root as usize].is_place() {
                    found[point] = Standing::Place;
                } else {
                    dark.push((root, point as u32));
                }
            }
        }
        dark.sort_unstable();
        let part = |points: &[(u32, u32)]| SpacePart {
            receiver: number,
            points: points.iter().map(|&(_, point)| point).collect(),
        };
        dark.chunk_by(|(a, _), (b, _)| a == b).map(part).collect()
    }
}
