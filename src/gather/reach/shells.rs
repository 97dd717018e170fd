//! Closed bodies of opaque faces: no light passes them, whatever else is in the scene.
//!
//! Faces that share edges, every edge an even number of times, part space in two: a ray from a point crosses them an
//! odd number of times if the point is on another side than what is far away. Their winding does not matter. A sheet
//! that ends at such a body with a free rim is peeled off it first.

use std::sync::OnceLock;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::geometry::Mesh;
use crate::sets::Sets;

/// A triangle that is crossed nearer to its rim than this, as a part of its size, decides nothing: another direction is
/// tried.
const RIM: f64 = 1e-11;
/// Directions along which crossings are counted, until one of them meets no rim.
const DIRECTIONS: [[f64; 3]; 6] = [
    [0.182_574_185_8, 0.365_148_371_7, 0.912_870_929_2],
    [0.823_272_602_3, -0.219_539_360_6, 0.523_518_475_3],
    [-0.304_997_140_7, 0.864_158_565_4, -0.400_246_247_6],
    [-0.554_700_196_2, -0.792_430_995_1, 0.253_577_232_6],
    [0.409_878_030_6, -0.614_817_045_9, -0.673_789_901_4],
    [-0.911_922_3, 0.105_221_8, 0.396_6],
];
/// Triangles that may be tested to find whether a body holds all luminaires.
const MAX_WORK: usize = 1_000_000_000;
/// Cosine beyond which two faces count as one that goes on straight: no rim between them.
const STRAIGHT: f64 = 0.25;

/// Closed bodies, and the edges of all opaque faces.
pub(super) struct Shells<'a> {
    mesh: &'a Mesh,
    /// The smallest first.
    bodies: Vec<ClosedBody>,
    /// Middles of edges at which a face ends, and of those at which two meet at an angle; and the direction that leads
    /// away from the faces.
    pub(super) rims: Vec<(Vec3, Vec3)>,
}

struct ClosedBody {
    triangles: Vec<u32>,
    low: DVec3,
    high: DVec3,
    /// Whether it holds every luminaire.
    holds_lamps: OnceLock<bool>,
}

impl<'a> Shells<'a> {
    /// Finds the closed bodies among the faces whose material is opaque. Cost: that of sorting all edges.
    pub(super) fn of(mesh: &'a Mesh, is_opaque: impl Fn(usize) -> bool + Sync) -> Self {
        let welded = weld(mesh, is_opaque);
        let edges = FaceEdges::of(&welded);
        let rims = edges.rims(mesh, &welded);
        let mut bodies: Vec<ClosedBody> =
            edges.closed(&welded).into_iter().map(|faces| ClosedBody::new(mesh, &welded, &faces)).collect();
        bodies.sort_by_key(|body| body.triangles.len());
        Self { mesh, bodies, rims }
    }

    /// Whether some body stands between a point and all of the `lamps`.
    pub(super) fn shut_off(&self, point: Vec3, lamps: &[Vec3]) -> bool {
        self.bodies.iter().any(|body| match body.contains(self.mesh, point) {
            Some(true) => lamps.iter().all(|&lamp| body.contains(self.mesh, lamp) == Some(false)),
            // One thread computes it: a thread that waited here for others could be given the same task by the pool.
            Some(false) => *body.holds_lamps.get_or_init(|| {
                body.triangles.len().saturating_mul(lamps.len()) <= MAX_WORK
                    && lamps.iter().all(|&lamp| body.contains(self.mesh, lamp) == Some(true))
            }),
            None => false,
        })
    }
}

impl ClosedBody {
    fn new(mesh: &Mesh, welded: &[OpaqueFace], faces: &[u32]) -> Self {
        let triangles: Vec<u32> = faces.iter().map(|&face| welded[face as usize].number).collect();
        let corners = || triangles.iter().flat_map(|&number| mesh.corners(number as usize));
        let low = corners().fold(DVec3::INFINITY, DVec3::min);
        let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        Self { triangles, low, high, holds_lamps: OnceLock::new() }
    }

    /// Whether a point is on another side of the body than what is far away; `None` if it is on the body itself.
    fn contains(&self, mesh: &Mesh, point: Vec3) -> Option<bool> {
        let point = point.as_dvec3();
        if !(point.cmpge(self.low).all() && point.cmple(self.high).all()) {
            return Some(false);
        }
        DIRECTIONS.iter().find_map(|&direction| {
            let towards = DVec3::from(direction);
            self.triangles.iter().try_fold(false, |odd, &number| {
                Some(odd != crosses(mesh.corners(number as usize).map(|corner| corner - point), towards)?)
            })
        })
    }
}

/// Whether a ray from the origin crosses a triangle; `None` if it meets its rim, or starts on it.
fn crosses([a, b, c]: [DVec3; 3], towards: DVec3) -> Option<bool> {
    let normals = [a.cross(b), b.cross(c), c.cross(a)];
    let sides = normals.map(|normal| normal.dot(towards));
    let size = a.length_squared().max(b.length_squared()).max(c.length_squared());
    let rim = RIM * size;
    if sides.iter().any(|&side| side > rim) && sides.iter().any(|&side| side < -rim) {
        return Some(false);
    }
    if sides.iter().any(|side| side.abs() <= rim) {
        return None;
    }
    let normal: DVec3 = normals.iter().sum();
    let along = a.dot(normal) / sides.iter().sum::<f64>();
    (along * along > RIM * RIM * size).then_some(along > 0.0)
}

/// An opaque triangle between welded corners, and its number in the mesh.
struct OpaqueFace {
    number: u32,
    corners: [u32; 3],
}

/// Opaque faces; corners at the same place get the same number. Triangles that have no three places are left out.
fn weld(mesh: &Mesh, is_opaque: impl Fn(usize) -> bool + Sync) -> Vec<OpaqueFace> {
    let key = |vertex: u32| mesh.vertices[vertex as usize].map(|x| (x + 0.0).to_bits()); // −0 is 0
    let mut order: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
    order.par_sort_unstable_by_key(|&vertex| (key(vertex), vertex));
    let mut first: Vec<u32> = vec![0; order.len()];
    for same in order.chunk_by(|&a, &b| key(a) == key(b)) {
        same.iter().for_each(|&vertex| first[vertex as usize] = same[0]);
    }
    let face = |number: usize| {
        let corners = mesh.triangles[number].map(|vertex| first[vertex as usize]);
        let [a, b, c] = corners;
        let counts = a != b && b != c && c != a && is_opaque(mesh.material_of[number] as usize);
        counts.then_some(OpaqueFace { number: number as u32, corners })
    };
    (0..mesh.triangles.len()).into_par_iter().filter_map(face).collect()
}

/// Every edge with the faces that use it.
struct FaceEdges {
    /// Corners of the edge and a face, sorted.
    uses: Vec<([u32; 2], u32)>,
    /// Where the uses of each edge start, and their end.
    starts: Vec<u32>,
}

impl FaceEdges {
    fn of(faces: &[OpaqueFace]) -> Self {
        let mut uses: Vec<([u32; 2], u32)> = faces
            .par_iter()
            .enumerate()
            .flat_map_iter(|(face, OpaqueFace { corners: [a, b, c], .. })| {
                [[a, b], [b, c], [c, a]].map(|[from, to]| ([*from.min(to), *from.max(to)], face as u32))
            })
            .collect();
        uses.par_sort_unstable();
        let mut starts: Vec<u32> =
            (0..uses.len()).filter(|&i| i == 0 || uses[i].0 != uses[i - 1].0).map(|i| i as u32).collect();
        starts.push(uses.len() as u32);
        Self { uses, starts }
    }

    fn len(&self) -> usize {
        self.starts.len() - 1
    }

    fn uses(&self, edge: usize) -> &[([u32; 2], u32)] {
        &self.uses[self.starts[edge] as usize..self.starts[edge + 1] as usize]
    }

    /// Faces that are connected by their edges and use each an even number of times, once those with a free edge are
    /// peeled off, one after the other.
    fn closed(&self, faces: &[OpaqueFace]) -> Vec<Vec<u32>> {
        let stays = self.peeled(faces.len());
        let mut sets = Sets::new(faces.len());
        let left = |edge: usize| self.uses(edge).iter().map(|&(_, face)| face).filter(|&face| stays[face as usize]);
        for edge in 0..self.len() {
            let mut of_edge = left(edge);
            let Some(one) = of_edge.next() else { continue };
            of_edge.for_each(|other| sets.join(one, other));
        }
        let mut is_closed = vec![true; faces.len()];
        for edge in (0..self.len()).filter(|&edge| left(edge).count() % 2 == 1) {
            left(edge).for_each(|face| is_closed[sets.root(face) as usize] = false);
        }
        let mut members: Vec<(u32, u32)> = (0..faces.len() as u32)
            .filter(|&face| stays[face as usize])
            .map(|face| (sets.root(face), face))
            .filter(|(root, _)| is_closed[*root as usize])
            .collect();
        members.sort_unstable();
        let body = |faces: &[(u32, u32)]| faces.iter().map(|&(_, face)| face).collect();
        members.chunk_by(|(a, _), (b, _)| a == b).map(body).collect()
    }

    /// Which faces are left when those with an edge of their own are taken off as long as there are any.
    fn peeled(&self, faces: usize) -> Vec<bool> {
        let mut edges_of: Vec<[u32; 3]> = vec![[0; 3]; faces];
        let mut known = vec![0_u8; faces];
        let mut count: Vec<u32> = (0..self.len()).map(|edge| self.uses(edge).len() as u32).collect();
        for edge in 0..self.len() {
            for &(_, face) in self.uses(edge) {
                edges_of[face as usize][usize::from(known[face as usize])] = edge as u32;
                known[face as usize] += 1;
            }
        }
        let mut stays = vec![true; faces];
        let mut free: Vec<u32> = (0..self.len() as u32).filter(|&edge| count[edge as usize] == 1).collect();
        while let Some(edge) = free.pop() {
            let last = self.uses(edge as usize).iter().map(|&(_, face)| face as usize).find(|&face| stays[face]);
            let Some(face) = last else { continue };
            stays[face] = false;
            for edge in edges_of[face] {
                count[edge as usize] -= 1;
                if count[edge as usize] == 1 {
                    free.push(edge);
                }
            }
        }
        stays
    }

    /// See [`Shells::rims`]; free edges first.
    fn rims(&self, mesh: &Mesh, faces: &[OpaqueFace]) -> Vec<(Vec3, Vec3)> {
        let place = |corner: u32| DVec3::from(mesh.vertices[corner as usize].map(f64::from));
        let rim = |edge: usize| {
            let uses = self.uses(edge);
            let ([from, to], _) = uses[0];
            let (start, end) = (place(from), place(to));
            let along = (end - start).normalize_or_zero();
            let into = |&(_, face): &([u32; 2], u32)| {
                let corners = faces[face as usize].corners;
                let third = corners.into_iter().find(|&corner| corner != from && corner != to).unwrap_or(from);
                let to_third = place(third) - start;
                (to_third - along * to_third.dot(along)).normalize_or_zero()
            };
            let sum: DVec3 = uses.iter().map(into).sum();
            let is_rim = uses.len() <= 2 && sum.length() > STRAIGHT;
            is_rim.then(|| (uses.len(), ((start + end) / 2.0).as_vec3(), -sum.normalize().as_vec3()))
        };
        let mut rims: Vec<(usize, Vec3, Vec3)> = (0..self.len()).into_par_iter().filter_map(rim).collect();
        rims.sort_by_key(|(uses, ..)| *uses); // the order of equals is kept
        rims.into_iter().map(|(_, middle, away)| (middle, away)).collect()
    }
}
