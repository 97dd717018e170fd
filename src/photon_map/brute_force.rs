//! The oracle: looks at every photon. Slow, and hard to get wrong.

use super::{NearestPhotons, distance_squared};

/// No structure at all.
pub struct BruteForce {
    positions: Vec<[f32; 3]>,
}

impl NearestPhotons for BruteForce {
    type Scratch = ();

    fn build(positions: &[[f32; 3]]) -> Self {
        Self { positions: positions.to_vec() }
    }

    fn scratch(&self) -> Self::Scratch {}

    fn memory(&self) -> usize {
        size_of_val(&*self.positions)
    }

    fn visit_nearest(&self, at: [f32; 3], k: usize, radius: f32, (): &mut (), mut visit: impl FnMut(usize, f32)) {
        let mut found = Vec::new();
        self.visit_within(at, radius, &mut (), |photon, distance| found.push((photon, distance)));
        found.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        found.iter().take(k).for_each(|&(photon, distance)| visit(photon, distance));
    }

    fn visit_within(&self, at: [f32; 3], radius: f32, (): &mut (), mut visit: impl FnMut(usize, f32)) {
        for (photon, &position) in self.positions.iter().enumerate() {
            let distance = distance_squared(at, position);
            if distance <= radius * radius {
                visit(photon, distance);
            }
        }
    }
}
