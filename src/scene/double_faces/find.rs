//! Which triangles lie on one another: the same three corners, whichever comes first.

use rayon::prelude::*;

use super::super::inventory::place_key;

/// Triangles that lie on others.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Duplicates {
    /// A triangle and an earlier one that lies there the same way round.
    pub(super) repeated: Vec<[u32; 2]>,
    /// The first triangle at its place, and the first that lies there the other way round.
    pub(super) backs: Vec<[u32; 2]>,
}

/// Looks for triangles with the same corners (single precision); `skipped` are left out. Cost: O(n log n), by all
/// threads.
pub(super) fn find(vertices: &[[f32; 3]], triangles: &[[u32; 3]], skipped: impl Fn(u32) -> bool + Sync) -> Duplicates {
    let place = |vertex: u32| vertices[vertex as usize];
    let key = |index: u32| {
        let corners = triangles[index as usize].map(|vertex| place_key(place(vertex)));
        (corners.iter().fold(0_u64, |sum, corner| sum.wrapping_add(*corner)), index)
    };
    let count = u32::try_from(triangles.len()).expect("fewer than 4e9 triangles: memory ends before");
    let mut keys: Vec<(u64, u32)> = (0..count).into_par_iter().map(key).collect();
    keys.par_sort_unstable();
    let mut found = Duplicates::default();
    for run in keys.chunk_by(|(one, _), (other, _)| one == other).filter(|run| run.len() > 1) {
        // One place, but for the rarest chance.
        let first = run[0].1;
        let corners = triangles[first as usize].map(place);
        let mut back = None;
        for &(_, index) in run[1..].iter().filter(|(_, index)| !skipped(*index)) {
            match (way_round(corners, triangles[index as usize].map(place)), back) {
                (Some(true), _) => found.repeated.push([index, first]),
                (Some(false), None) => {
                    back = Some(index);
                    found.backs.push([first, index]);
                }
                (Some(false), Some(back)) => found.repeated.push([index, back]),
                (None, _) => {}
            }
        }
    }
    found.repeated.sort_unstable();
    found.backs.sort_unstable();
    found
}

/// Whether two triangles with the same corners run the same way round; `None` if they have others.
fn way_round(one: [[f32; 3]; 3], other: [[f32; 3]; 3]) -> Option<bool> {
    let [a, b, c] = other;
    let turned = [[a, b, c], [b, c, a], [c, a, b]];
    let back = [[c, b, a], [b, a, c], [a, c, b]];
    if turned.contains(&one) { Some(true) } else { back.contains(&one).then_some(false) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_are_found_by_place_and_not_by_number() {
        let mut vertices = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        vertices.extend(vertices.clone());
        vertices[4] = [-0.0, 0.0, -0.0];
        let triangles =
            [[0, 1, 2], [0, 1, 3], [5, 6, 4], [6, 5, 0], [2, 4, 1], [4, 6, 5], [3, 0, 1], [1, 2, 3], [0, 0, 0]];
        let found = find(&vertices, &triangles, |index| index == 8);
        assert_eq!(found.repeated, [[2, 0], [4, 0], [5, 3], [6, 1]]);
        assert_eq!(found.backs, [[0, 3]]);
    }
}
