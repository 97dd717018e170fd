//! Flat faces that lie back to back but are cut into triangles along other diagonals.
//!
//! Where two of them share an edge, they are folded over it: both lie on the same side of it, in one plane, and look
//! opposite ways. No other geometry does that, so without such a fold there is nothing to do. From the triangles at
//! folds patches grow over the edges to neighbours in the same plane that look the same way. Two patches are front and
//! back of one face if they look opposite ways and have the same area and the same corners along their rim.

use std::collections::{BTreeMap, HashMap};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::super::inventory::{mixed, place_key};

/// Meshes of more triangles are not looked through: only exact doubles are found in them.
const MOST_TRIANGLES: usize = 1_000_000;
/// Sine of the angle up to which triangles count as parts of one plane.
const FLAT: f64 = 1e-3;
/// Most triangles at one edge.
const MOST_AT_EDGE: usize = 64;
/// Most entries of the grid in which triangles are looked up, as a multiple of their number.
const MOST_ENTRIES: usize = 64;
/// Most comparisons of a patch.
const MOST_PAIRS: usize = 1_000_000_000;

/// Front and back of a face; numbers of triangles, ascending.
#[derive(Debug, PartialEq)]
pub(super) struct Patch {
    pub(super) front: Vec<u32>,
    pub(super) back: Vec<u32>,
    /// For each triangle of the front, the one of the back behind its middle.
    pub(super) behind: Vec<u32>,
    /// For each triangle of the back, the one of the front before its middle.
    pub(super) before: Vec<u32>,
}

/// Finds patches among `candidates`, ascending numbers of triangles. Cost: O(n log n).
pub(super) fn find(vertices: &[[f32; 3]], triangles: &[[u32; 3]], candidates: &[u32]) -> Vec<Patch> {
    if candidates.len() > MOST_TRIANGLES {
        return Vec::new();
    }
    let surface = PatchMesh::new(vertices, triangles, candidates);
    let mut patches = surface.grown_from(surface.folds());
    patches.sort_by_key(|grown| grown.members[0]);
    let mut fronts: HashMap<u64, Vec<Grown>> = HashMap::new();
    let mut found = Vec::new();
    for patch in patches {
        let waiting = fronts.entry(patch.rim).or_default();
        match waiting.iter().position(|front| front.is_front_of(&patch)) {
            Some(index) => found.extend(surface.patch(waiting.remove(index), patch)),
            None => waiting.push(patch),
        }
    }
    found.sort_by_key(|patch: &Patch| patch.front[0]);
    found
}

/// Triangles of one plane that hang together and look the same way.
struct Grown {
    /// Ascending.
    members: Vec<u32>,
    area: f64,
    normal: DVec3,
    /// A number for the set of corners along the rim.
    rim: u64,
}

impl Grown {
    fn is_front_of(&self, other: &Self) -> bool {
        self.normal.dot(other.normal) < -0.999 && (self.area - other.area).abs() < 1e-4 * self.area
    }
}

/// An edge as triangles have it.
#[derive(Clone, Copy)]
struct Edge {
    /// The same for both directions.
    key: u64,
    triangle: u32,
    /// Which of the triangle's sides: from this corner to the next.
    side: u8,
}

struct PatchMesh<'a> {
    vertices: &'a [[f32; 3]],
    triangles: &'a [[u32; 3]],
    /// Sorted by key, then by triangle.
    edges: Vec<Edge>,
}

impl<'a> PatchMesh<'a> {
    fn new(vertices: &'a [[f32; 3]], triangles: &'a [[u32; 3]], candidates: &[u32]) -> Self {
        let mut surface = Self { vertices, triangles, edges: Vec::new() };
        let of = |&triangle: &u32| {
            let keys = surface.keys(triangle);
            [0_u8, 1, 2].map(|side| {
                let key = edge_key(keys[usize::from(side)], keys[usize::from(side + 1) % 3]);
                Edge { key, triangle, side }
            })
        };
        let mut edges: Vec<Edge> = candidates.par_iter().flat_map_iter(of).collect();
        edges.par_sort_unstable_by_key(|edge| (edge.key, edge.triangle, edge.side));
        surface.edges = edges;
        surface
    }

    fn keys(&self, triangle: u32) -> [u64; 3] {
        self.triangles[triangle as usize].map(|vertex| place_key(self.vertices[vertex as usize]))
    }

    fn corners(&self, triangle: u32) -> [DVec3; 3] {
        let place = |vertex: u32| DVec3::from(self.vertices[vertex as usize].map(f64::from));
        self.triangles[triangle as usize].map(place)
    }

    /// Twice its area times its unit normal.
    fn cross(&self, triangle: u32) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a)
    }

    /// Where an edge begins, where it ends, and the third corner.
    fn along(&self, edge: Edge) -> [DVec3; 3] {
        let corners = self.corners(edge.triangle);
        [0, 1, 2].map(|step| corners[(usize::from(edge.side) + step) % 3])
    }

    /// Whether two triangles at an edge run along it in opposite directions and lie in one plane; and if so, whether on
    /// the same side of it.
    fn folded(&self, one: Edge, other: Edge) -> Option<bool> {
        let ([a, b, c], [d, e, f]) = (self.along(one), self.along(other));
        if a != e || b != d {
            return None;
        }
        let along = (b - a).try_normalize()?;
        let off = |corner: DVec3| ((corner - a) - along * (corner - a).dot(along)).try_normalize();
        let (first, second) = (off(c)?, off(f)?);
        (first.cross(second).length() < FLAT).then(|| first.dot(second) > 0.0)
    }

    /// Triangles at folds.
    fn folds(&self) -> Vec<u32> {
        let of_run = |run: &[Edge]| {
            let mut folds = Vec::new();
            if (2..=MOST_AT_EDGE).contains(&run.len()) {
                for (index, &one) in run.iter().enumerate() {
                    let others = run[index + 1..].iter().filter(|&&other| self.folded(one, other) == Some(true));
                    folds.extend(others.flat_map(|other| [one.triangle, other.triangle]));
                }
            }
            folds
        };
        let runs = self.edges.par_chunk_by(|one, other| one.key == other.key);
        let mut folds: Vec<u32> = runs.flat_map_iter(of_run).collect();
        folds.sort_unstable();
        folds.dedup();
        folds
    }

    /// All triangles at the edge of this key.
    fn at(&self, key: u64) -> &[Edge] {
        let first = self.edges.partition_point(|edge| edge.key < key);
        let end = first + self.edges[first..].iter().take_while(|edge| edge.key == key).take(MOST_AT_EDGE + 1).count();
        if end - first > MOST_AT_EDGE { &[] } else { &self.edges[first..end] }
    }

    fn grown_from(&self, seeds: Vec<u32>) -> Vec<Grown> {
        let mut seen: HashMap<u32, ()> = HashMap::new();
        let mut patches = Vec::new();
        for seed in seeds {
            if seen.insert(seed, ()).is_some() {
                continue;
            }
            let (mut members, mut next) = (vec![seed], 0);
            while next < members.len() {
                let triangle = members[next];
                next += 1;
                let keys = self.keys(triangle);
                for side in [0_u8, 1, 2] {
                    let key = edge_key(keys[usize::from(side)], keys[usize::from(side + 1) % 3]);
                    let own = Edge { key, triangle, side };
                    for &other in self.at(key) {
                        let goes_on = other.triangle != triangle && self.folded(own, other) == Some(false);
                        if goes_on && seen.insert(other.triangle, ()).is_none() {
                            members.push(other.triangle);
                        }
                    }
                }
            }
            members.sort_unstable();
            patches.extend(self.grown(members));
        }
        patches
    }

    /// Area, normal and rim of a patch; `None` if it isn't flat.
    fn grown(&self, members: Vec<u32>) -> Option<Grown> {
        let sum: DVec3 = members.iter().map(|&triangle| self.cross(triangle)).sum();
        let normal = sum.try_normalize()?;
        let start = self.corners(members[0])[0];
        let offs = || members.iter().flat_map(|&triangle| self.corners(triangle)).map(|corner| corner - start);
        let extent = offs().map(|off| off.length()).fold(0.0, f64::max);
        if offs().any(|off| off.dot(normal).abs() > FLAT * extent) {
            return None;
        }
        // Edges along the rim are those whose other direction is no one's.
        let mut rim: BTreeMap<[u64; 2], DVec3> = BTreeMap::new();
        for &triangle in &members {
            let (keys, corners) = (self.keys(triangle), self.corners(triangle));
            for side in 0..3 {
                let (from, to) = (keys[side], keys[(side + 1) % 3]);
                if rim.remove(&[to, from]).is_none() {
                    rim.insert([from, to], corners[(side + 1) % 3] - corners[side]);
                }
            }
        }
        let mut ends: HashMap<u64, (DVec3, usize)> = HashMap::new();
        for ([from, to], along) in &rim {
            let along = along.normalize_or_zero();
            for (place, sign) in [(from, 1.0), (to, -1.0)] {
                let (turn, count) = ends.entry(*place).or_default();
                (*turn, *count) = (*turn + along * sign, *count + 1);
            }
        }
        // A place amid a straight side is no corner.
        let turns = |(turn, count): &(DVec3, usize)| *count != 2 || turn.length() > FLAT;
        let corners = ends.iter().filter(|(_, end)| turns(end)).map(|(place, _)| mixed(*place));
        let rim = corners.fold(0_u64, u64::wrapping_add);
        Some(Grown { members, area: sum.length() / 2.0, normal, rim })
    }

    /// Front and back; `None` where it would take too long to find out what lies behind what.
    fn patch(&self, front: Grown, back: Grown) -> Option<Patch> {
        let (axes, front, back) = (front.normal.any_orthonormal_pair(), front.members, back.members);
        let flat = |triangles: &[u32]| -> Vec<[DVec2; 3]> {
            let flat = |corner: DVec3| DVec2::new(corner.dot(axes.0), corner.dot(axes.1));
            triangles.iter().map(|&triangle| self.corners(triangle).map(flat)).collect()
        };
        let (fronts, backs) = (flat(&front), flat(&back));
        let numbers = |found: Vec<usize>, of: &[u32]| found.into_iter().map(|index| of[index]).collect();
        let behind = numbers(CellGrid::new(&backs)?.under(&fronts)?, &back);
        let before = numbers(CellGrid::new(&fronts)?.under(&backs)?, &front);
        Some(Patch { front, back, behind, before })
    }
}

/// Triangles of a plane by square cells.
struct CellGrid<'a> {
    triangles: &'a [[DVec2; 3]],
    corner: DVec2,
    cell: f64,
    /// Cells along either axis.
    count: usize,
    /// Numbers of the triangles whose bounding box meets a cell.
    cells: Vec<Vec<u32>>,
}

impl<'a> CellGrid<'a> {
    /// As many cells as triangles, fewer where these are long.
    fn new(triangles: &'a [[DVec2; 3]]) -> Option<Self> {
        let corners = || triangles.iter().flatten();
        let least = corners().copied().reduce(DVec2::min)?;
        let extent = (corners().copied().reduce(DVec2::max)? - least).max_element().max(f64::MIN_POSITIVE);
        let mut grid = Self { triangles, corner: least, cell: extent, count: 1, cells: Vec::new() };
        let mut count = (triangles.len() as f64).sqrt().ceil() as usize;
        loop {
            (grid.count, grid.cell) = (count, extent / count as f64);
            let area = |triangle: &[DVec2; 3]| {
                let [[left, low], [right, high]] = grid.around(triangle);
                (right - left + 1) * (high - low + 1)
            };
            if triangles.iter().map(area).sum::<usize>() <= MOST_ENTRIES * triangles.len() {
                break;
            }
            count /= 2;
        }
        grid.cells = vec![Vec::new(); count * count];
        for (number, triangle) in triangles.iter().enumerate() {
            let [[left, low], [right, high]] = grid.around(triangle);
            for (x, y) in (low..=high).flat_map(|y| (left..=right).map(move |x| (x, y))) {
                grid.cells[y * count + x].push(number as u32);
            }
        }
        Some(grid)
    }

    /// Lowest and highest cell of the box around a triangle.
    fn around(&self, [a, b, c]: &[DVec2; 3]) -> [[usize; 2]; 2] {
        [self.place(a.min(*b).min(*c)), self.place(a.max(*b).max(*c))]
    }

    /// Column and row of a point's cell.
    fn place(&self, at: DVec2) -> [usize; 2] {
        ((at - self.corner) / self.cell).to_array().map(|steps| (steps.max(0.0) as usize).min(self.count - 1))
    }

    /// For each of some triangles the number of the one in the grid that its middle lies in; `None` if that takes too
    /// long.
    fn under(&self, others: &[[DVec2; 3]]) -> Option<Vec<usize>> {
        let most = self.cells.iter().map(Vec::len).max().unwrap_or(0);
        if most.saturating_mul(others.len()) > MOST_PAIRS {
            return None;
        }
        // How far inside a triangle a point is, as a share of its height.
        let inside = |at: DVec2, [a, b, c]: [DVec2; 3]| {
            let whole = (b - a).perp_dot(c - a);
            let part = |p: DVec2, q: DVec2| (q - p).perp_dot(at - p) / whole;
            part(a, b).min(part(b, c)).min(part(c, a))
        };
        let of = |[a, b, c]: &[DVec2; 3]| {
            let middle = (*a + *b + *c) / 3.0;
            let [x, y] = self.place(middle);
            let near = self.cells[y * self.count + x].iter().map(|&number| number as usize);
            let all = near.map(|number| (inside(middle, self.triangles[number]), number));
            all.fold((f64::NEG_INFINITY, 0), |most, next| if next.0 > most.0 { next } else { most }).1
        };
        Some(others.iter().map(of).collect())
    }
}

/// The same for both directions.
fn edge_key(from: u64, to: u64) -> u64 {
    mixed(from).wrapping_add(mixed(to))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [[f32; 3]; 5] = [[0., 0., 1.], [2., 0., 1.], [2., 2., 1.], [0., 2., 1.], [0.5, 0., 1.]];

    fn all(triangles: &[[u32; 3]], vertices: &[[f32; 3]]) -> Vec<Patch> {
        find(vertices, triangles, &(0..triangles.len() as u32).collect::<Vec<_>>())
    }

    #[test]
    fn a_square_and_its_back_cut_along_the_other_diagonal_are_one_patch() {
        let triangles = [[0, 1, 2], [0, 2, 3], [3, 2, 1], [3, 1, 0]];
        let found = all(&triangles, &SQUARE);
        assert_eq!(found.len(), 1);
        assert_eq!((&found[0].front[..], &found[0].back[..]), (&[0, 1][..], &[2, 3][..]));
    }

    /// The front's cut has no triangle with the corner amid the side; the back's has.
    #[test]
    fn a_corner_amid_a_side_makes_no_difference() {
        let triangles = [[0, 1, 2], [0, 2, 3], [2, 1, 4], [2, 4, 3], [3, 4, 0]];
        let found = all(&triangles, &SQUARE);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!((found[0].front.len(), found[0].back.len()), (2, 3));
        // The back's cut from (½, 0) to (2, 2) passes between the middles of 0 1 2, at (4/3, 2/3), and 0 2 3, at (2/3,
        // 4/3).
        assert_eq!(found[0].behind, [2, 3]);
        assert_eq!(found[0].before, [0, 1, 1]);
    }

    #[test]
    fn what_only_looks_like_it_is_left_alone() {
        // The same way round; a back that is only half of the front; a flat tetrahedron; two sides of a blade.
        let mut bent = SQUARE;
        bent[3][2] = 1.1;
        let blade = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.001], [0., 1., 0.001], [1., 1., -0.001], [0., 1., -0.001]];
        for (triangles, vertices) in [
            (vec![[0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]], &SQUARE[..]),
            (vec![[0, 1, 2], [0, 2, 3], [3, 1, 0]], &SQUARE[..]),
            (vec![[0, 1, 2], [0, 2, 3], [3, 2, 1], [3, 1, 0]], &bent[..]),
            (vec![[0, 1, 2], [0, 2, 3], [0, 5, 4], [0, 4, 1]], &blade[..]),
        ] {
            assert_eq!(all(&triangles, vertices), [], "{triangles:?}");
        }
    }
}
