//! What looks wrong about a mesh: edges that end nowhere, bodies turned inside out, slivers.
//!
//! Corners at the same place count as one, whatever their numbers in the file.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::MeshPart;
use super::unit::unit_in_doubt;
use crate::geometry::mesh::Mesh;
use crate::scene::Scene;
use crate::sets::Sets;

/// A triangle whose longest side is more than so many times its height is a sliver.
const SLIVER: f64 = 1000.0;

/// A mesh file, looked through.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshCheck {
    /// The file, and what was left out of it.
    pub part: MeshPart,
    /// Edges of one triangle only. Solids have none, rooms drawn as sheets have many.
    pub open_edges: usize,
    /// Edges of more than two triangles.
    pub shared_edges: usize,
    /// Closed bodies: parts that hang together and have neither open nor shared edges.
    pub bodies: usize,
    /// Of these, those whose fronts look inwards: rooms, cavities, or bodies inside out; glass is turned before.
    pub inwards: usize,
    /// Triangles a thousand times as long as high.
    pub slivers: usize,
    /// A question about its unit.
    pub unit: Option<String>,
}

impl MeshCheck {
    pub(super) fn of(part: &MeshPart, scene: &Scene) -> Self {
        let mesh = &*scene.mesh;
        let triangles = &mesh.triangles[part.triangles.clone()];
        let welded = WeldedVertices::new(mesh, triangles);
        let edges = welded.edges(triangles);
        let mut pieces = welded.pieces(triangles);
        let (open_edges, shared_edges) = pieces.open(&edges);
        drop(edges);
        let [bodies, inwards] = pieces.bodies(scene, part.triangles.clone(), &welded);
        let is_sliver = |triangle: &&[u32; 3]| {
            let [a, b, c] = triangle.map(|vertex| mesh.place(vertex));
            let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
            longest > SLIVER * (b - a).cross(c - a).length()
        };
        Self {
            part: part.clone(),
            open_edges,
            shared_edges,
            bodies,
            inwards,
            slivers: triangles.par_iter().filter(is_sliver).count(),
            unit: unit_in_doubt(&part.file.display().to_string(), part.size().to_array(), part.metres_per_unit),
        }
    }
}

/// Vertices by place.
struct WeldedVertices {
    /// Number of the first vertex that the triangles use.
    first: u32,
    /// Number of each vertex's place, counted from `first`.
    place_of: Vec<u32>,
}

impl WeldedVertices {
    fn new(mesh: &Mesh, triangles: &[[u32; 3]]) -> Self {
        let used = || triangles.par_iter().flatten().copied();
        let (Some(first), Some(last)) = (used().min(), used().max()) else {
            return Self { first: 0, place_of: Vec::new() };
        };
        let vertices = &mesh.vertices[first as usize..=last as usize];
        let key = |index: u32| place_key(vertices[index as usize]);
        let mut order: Vec<(u64, u32)> = (0..vertices.len() as u32).into_par_iter().map(|i| (key(i), i)).collect();
        order.par_sort_unstable();
        let mut place_of = vec![0; vertices.len()];
        for run in order.chunk_by(|(one, _), (other, _)| one == other) {
            run.iter().for_each(|&(_, vertex)| place_of[vertex as usize] = run[0].1);
        }
        Self { first, place_of }
    }

    fn place(&self, vertex: u32) -> u32 {
        self.place_of[(vertex - self.first) as usize]
    }

    /// Every triangle's edges, sorted: both places, the lower first, and whether the edge runs from the lower one.
    fn edges(&self, triangles: &[[u32; 3]]) -> Vec<u64> {
        let edge = |from: u32, to: u32| {
            let (low, high) = (u64::from(from.min(to)), u64::from(from.max(to)));
            low << 33 | high << 1 | u64::from(from < to)
        };
        let of = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|vertex| self.place(vertex));
            [edge(a, b), edge(b, c), edge(c, a)]
        };
        let mut edges: Vec<u64> = triangles.par_iter().flat_map_iter(of).collect();
        edges.par_sort_unstable();
        edges
    }

    /// What hangs together by common corners.
    fn pieces(&self, triangles: &[[u32; 3]]) -> Pieces {
        let mut pieces = Pieces { sets: Sets::new(self.place_of.len()), open: Vec::new() };
        for triangle in triangles {
            let [a, b, c] = triangle.map(|vertex| self.place(vertex));
            pieces.sets.join(a, b);
            pieces.sets.join(b, c);
        }
        pieces
    }
}

/// A number that stands for a place: equal for equal places, and hardly ever for others.
pub(crate) fn place_key(position: [f32; 3]) -> u64 {
    // −0 is 0.
    position.iter().fold(0x9e37_79b9_7f4a_7c15, |key: u64, x| mixed(key ^ u64::from((x + 0.0).to_bits())))
}

/// Spreads the bits of a number over all 64 (the finaliser of splitmix64).
pub(crate) fn mixed(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Places joined to pieces.
struct Pieces {
    sets: Sets,
    /// Pieces that have an edge of one triangle, or of more than two.
    open: Vec<bool>,
}

impl Pieces {
    /// Numbers of edges of one triangle, and of more than two; marks the pieces that have any.
    fn open(&mut self, edges: &[u64]) -> (usize, usize) {
        self.open = vec![false; self.sets.len()];
        let (mut once, mut often) = (0, 0);
        for run in edges.chunk_by(|one, other| one >> 1 == other >> 1) {
            let there = run.iter().filter(|edge| **edge & 1 == 1).count();
            if run.len() == 2 && there == 1 {
                continue;
            }
            once += usize::from(run.len() == 1);
            often += usize::from(run.len() > 2);
            let root = self.sets.root((run[0] >> 33) as u32);
            self.open[root as usize] = true;
        }
        (once, often)
    }

    /// Closed bodies; and of these, those whose fronts look inwards.
    fn bodies(&mut self, scene: &Scene, range: Range<usize>, welded: &WeldedVertices) -> [usize; 2] {
        let mesh = &*scene.mesh;
        let mut hulls = vec![Hull::default(); self.sets.len()];
        for triangle in &mesh.triangles[range] {
            let root = self.sets.root(welded.place(triangle[0]));
            if self.open[root as usize] {
                continue;
            }
            let about = mesh.place(welded.first + root);
            let [a, b, c] = triangle.map(|vertex| mesh.place(vertex) - about);
            let hull = &mut hulls[root as usize];
            let volume = a.dot(b.cross(c));
            hull.volume += volume;
            hull.swept += volume.abs();
        }
        let bodies = hulls.into_iter().filter(|hull| hull.volume.abs() > 1e-6 * hull.swept);
        bodies.fold([0; 2], |[all, inwards], hull| [all + 1, inwards + usize::from(hull.volume < 0.0)])
    }
}

/// What a closed piece encloses.
#[derive(Clone, Copy, Default)]
struct Hull {
    /// Six times its volume, m³; below 0 where fronts look inwards.
    volume: f64,
    /// The same of its parts without their signs.
    swept: f64,
}

impl Mesh {
    fn place(&self, vertex: u32) -> DVec3 {
        DVec3::from(self.vertices[vertex as usize].map(f64::from))
    }
}
