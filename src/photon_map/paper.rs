//! The paper's tree: split at the median, axes in turn x → y → z, left child first, a list of k whose farthest member
//! is replaced. Kept as it is, so that its figures can be repeated; not a fast tree.

use super::{NearestPhotons, distance_squared};

/// Balanced kd-tree in place: the median of a range is its node, the halves left and right of it are its children.
pub struct Paper {
    nodes: Vec<([f32; 3], u32)>,
}

/// The list of nearest photons found so far: indices and squared distances, side by side.
#[derive(Default)]
pub struct List {
    photons: Vec<u32>,
    distances: Vec<f32>,
}

struct NearestList<'a> {
    at: [f32; 3],
    k: usize,
    /// Squared search radius: d² until the list is full, then the distance of its farthest member.
    radius_squared: f32,
    list: &'a mut List,
    farthest: usize,
}

impl NearestList<'_> {
    /// Takes a photon into the list, in the place of the farthest once the list is full.
    fn offer(&mut self, photon: u32, distance_squared: f32) {
        let List { photons, distances } = &mut *self.list;
        if photons.len() < self.k {
            if distance_squared > self.radius_squared {
                return;
            }
            photons.push(photon);
            distances.push(distance_squared);
        } else if distance_squared < self.radius_squared {
            (photons[self.farthest], distances[self.farthest]) = (photon, distance_squared);
        } else {
            return;
        }
        if photons.len() == self.k {
            self.radius_squared = largest(distances);
            self.farthest = distances.iter().position(|&distance| distance == self.radius_squared).unwrap_or(0);
        }
    }
}

/// The largest of a list, in eight lanes.
fn largest(distances: &[f32]) -> f32 {
    let larger = |a: f32, b: f32| if a > b { a } else { b };
    let mut lanes = [0.0_f32; 8];
    let chunks = distances.chunks_exact(8);
    let rest = chunks.remainder().iter().copied().fold(0.0, larger);
    for chunk in chunks {
        (0..8).for_each(|lane| lanes[lane] = larger(lanes[lane], chunk[lane]));
    }
    lanes.into_iter().fold(rest, larger)
}

impl NearestPhotons for Paper {
    type Scratch = List;

    fn build(positions: &[[f32; 3]]) -> Self {
        let mut nodes: Vec<_> = (0u32..).zip(positions).map(|(index, &position)| (position, index)).collect();
        split(&mut nodes, 0);
        Self { nodes }
    }

    fn scratch(&self) -> Self::Scratch {
        List::default()
    }

    fn memory(&self) -> usize {
        size_of_val(&*self.nodes)
    }

    fn visit_nearest(
        &self,
        at: [f32; 3],
        k: usize,
        radius: f32,
        scratch: &mut Self::Scratch,
        mut visit: impl FnMut(usize, f32),
    ) {
        scratch.photons.clear();
        scratch.distances.clear();
        if k == 0 {
            return;
        }
        let mut nearest = NearestList { at, k, radius_squared: radius * radius, list: scratch, farthest: 0 };
        search(&self.nodes, 0, &mut nearest);
        scratch
            .photons
            .iter()
            .zip(&scratch.distances)
            .for_each(|(&photon, &distance)| visit(photon as usize, distance));
    }

    fn visit_within(&self, at: [f32; 3], radius: f32, scratch: &mut Self::Scratch, visit: impl FnMut(usize, f32)) {
        self.visit_nearest(at, usize::MAX, radius, scratch, visit);
    }
}

/// Puts the median along the axis into the middle, and so on in both halves.
fn split(nodes: &mut [([f32; 3], u32)], axis: usize) {
    if nodes.len() < 2 {
        return;
    }
    let middle = nodes.len() / 2;
    nodes.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]));
    let (left, right) = nodes.split_at_mut(middle);
    split(left, (axis + 1) % 3);
    split(&mut right[1..], (axis + 1) % 3);
}

/// Visits the node in the middle, the left half if the search radius reaches it, then the right one likewise.
fn search(nodes: &[([f32; 3], u32)], axis: usize, nearest: &mut NearestList<'_>) {
    let Some(&(position, photon)) = nodes.get(nodes.len() / 2) else { return };
    let middle = nodes.len() / 2;
    nearest.offer(photon, distance_squared(nearest.at, position));
    let to_plane = nearest.at[axis] - position[axis];
    if to_plane <= 0.0 || to_plane * to_plane <= nearest.radius_squared {
        search(&nodes[..middle], (axis + 1) % 3, nearest);
    }
    if to_plane >= 0.0 || to_plane * to_plane <= nearest.radius_squared {
        search(&nodes[middle + 1..], (axis + 1) % 3, nearest);
    }
}
