//! Luminous bodies: boxes, cylinders and ellipsoids of any proportions.
//!
//! Each is the image of one canonical solid (the cube [−1, 1]³, the cylinder of radius 1 from z = −1 to 1, the unit
//! ball) stretched along three axes. Stretching keeps what matters here: parallel lines stay parallel and tangents stay
//! tangents, and all areas seen from one direction change by one factor. So outlines, areas and points are found on the
//! canonical solid, and luminaires hold no triangles of their own.

use std::f64::consts::{PI, TAU};
use std::sync::LazyLock;

use glam::DVec3;

use crate::random::Stream;

/// Kinds of bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solid {
    /// Six flat faces.
    Box,
    /// Two flat ends across the third axis, and a curved side.
    Cylinder,
    /// Curved all around.
    Ellipsoid,
}

/// A convex body: centre, and half of its size along three axes at right angles (right-handed), m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// What it is.
    pub solid: Solid,
    /// Its middle.
    pub centre: DVec3,
    /// From the middle to the surface along each axis; a cylinder runs along the third.
    pub half_axes: [DVec3; 3],
}

/// Flat sides of the cylinder in the mesh: seen from the side it is 0.15 % too narrow at worst, its ends are 0.15 % too
/// small.
const SIDES: usize = 48;
/// Times each triangle of an icosahedron is cut in four to make the ball of the mesh.
const REFINEMENTS: usize = 2;
/// Edges of an outline: along a half of a curved one, or all around.
const HALF_ROUND: usize = 16;
const ALL_ROUND: usize = 32;
/// Points thrown at a body before any facet that faces the right way will do; each is taken with a chance of 1/6 at
/// least.
const MOST_THROWS: usize = 256;

/// The canonical solid in triangles, as the scene's mesh has it.
pub(crate) struct Facets {
    pub(crate) corners: Vec<DVec3>,
    /// Counter-clockwise seen from outside.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Outward unit normals.
    pub(crate) normals: Vec<DVec3>,
    /// Running sum of the areas' shares of the whole; the last is 1.
    shares: Vec<f32>,
}

static CUBE: LazyLock<Facets> = LazyLock::new(|| {
    let corners = (0..8).map(|i| DVec3::from([0, 1, 2].map(|axis| sign(i >> axis & 1 == 1)))).collect();
    let faces = (0..3).flat_map(|axis| [false, true].map(|positive| face(axis, positive)));
    let halves = faces.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    Facets::new(corners, halves.map(|triangle| triangle.map(u32::from)).collect())
});

static CYLINDER: LazyLock<Facets> = LazyLock::new(|| {
    let step = TAU / SIDES as f64;
    // As wide as the cylinder in the mean over all sides: the perimeter is 2π.
    let radius = 0.5 * step / (0.5 * step).sin();
    let rim = |z: f64| {
        (0..SIDES).map(move |i| (step * i as f64).sin_cos()).map(move |(y, x)| DVec3::new(radius * x, radius * y, z))
    };
    let n = SIDES as u32;
    let ends = (1..n - 1).flat_map(|i| [[0, i + 1, i], [n, n + i, n + i + 1]]);
    let side = (0..n).map(|i| (i, (i + 1) % n)).flat_map(|(i, j)| [[i, j, n + j], [i, n + j, n + i]]);
    Facets::new(rim(-1.0).chain(rim(1.0)).collect(), ends.chain(side).collect())
});

static BALL: LazyLock<Facets> = LazyLock::new(|| {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut corners: Vec<DVec3> = Vec::new();
    for (a, b) in [(-1.0, -golden), (1.0, -golden), (-1.0, golden), (1.0, golden)] {
        corners.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)].map(DVec3::normalize));
    }
    // The faces are the triples of corners at the length of an edge from each other.
    let edge = 2.0 / (1.0 + golden * golden).sqrt();
    let near = |i: usize, j: usize| corners[i].distance(corners[j]) < 1.1 * edge;
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for (a, b, c) in (0..12).flat_map(|a| (a + 1..12).flat_map(move |b| (b + 1..12).map(move |c| (a, b, c)))) {
        if near(a, b) && near(b, c) && near(c, a) {
            let outward = (corners[b] - corners[a]).cross(corners[c] - corners[a]).dot(corners[a]) > 0.0;
            triangles.push(if outward { [a, b, c] } else { [a, c, b] }.map(|i| i as u32));
        }
    }
    for _ in 0..REFINEMENTS {
        let mut middles = std::collections::HashMap::new();
        triangles = triangles
            .into_iter()
            .flat_map(|[a, b, c]| {
                let [p, q, r] = [(a, b), (b, c), (c, a)].map(|(i, j)| {
                    *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                        corners.push((corners[i as usize] + corners[j as usize]).normalize());
                        corners.len() as u32 - 1
                    })
                });
                [[a, p, r], [p, b, q], [r, q, c], [p, q, r]]
            })
            .collect();
    }
    // As large as the ball in the mean over all directions: by Cauchy's formula that is a quarter of the surface.
    let at = |i: u32| corners[i as usize];
    let surface: f64 = triangles.iter().map(|&[a, b, c]| 0.5 * (at(b) - at(a)).cross(at(c) - at(a)).length()).sum();
    let radius = (4.0 * PI / surface).sqrt();
    corners.iter_mut().for_each(|corner| *corner *= radius);
    Facets::new(corners, triangles)
});

fn sign(positive: bool) -> f64 {
    if positive { 1.0 } else { -1.0 }
}

/// Corners of a face of the cube, counter-clockwise seen from outside; bit `axis` of a corner's number is its side.
fn face(axis: usize, positive: bool) -> [u8; 4] {
    let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
    let base = u8::from(positive) << axis;
    if positive { [base, base | u, base | u | v, base | v] } else { [base, base | v, base | u | v, base | u] }
}

impl Facets {
    fn new(corners: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Self {
        let crosses: Vec<DVec3> = triangles
            .iter()
            .map(|triangle| triangle.map(|corner| corners[corner as usize]))
            .map(|[a, b, c]| (b - a).cross(c - a))
            .collect();
        let whole: f64 = crosses.iter().map(|cross| cross.length()).sum();
        let shares = crosses.iter().scan(0.0, |sum, cross| {
            *sum += cross.length() / whole;
            Some(*sum as f32)
        });
        Self {
            shares: shares.collect(),
            normals: crosses.iter().map(|cross| cross.normalize()).collect(),
            corners,
            triangles,
        }
    }

    fn plane(&self, which: usize) -> FacetPlane {
        let normal = self.normals[which];
        FacetPlane { normal, height: normal.dot(self.triangle(which)[0]) }
    }

    fn planes(&self) -> impl Iterator<Item = FacetPlane> {
        (0..self.normals.len()).map(|which| self.plane(which))
    }

    pub(crate) fn triangle(&self, which: usize) -> [DVec3; 3] {
        self.triangles[which].map(|corner| self.corners[corner as usize])
    }
}

impl Body {
    /// Its surface in triangles, canonical: [`Body::point`] puts their corners where they are.
    pub(crate) fn facets(&self) -> &'static Facets {
        match self.solid {
            Solid::Box => &CUBE,
            Solid::Cylinder => &CYLINDER,
            Solid::Ellipsoid => &BALL,
        }
    }

    /// Where a canonical point is, m.
    #[inline]
    pub(crate) fn point(&self, canonical: DVec3) -> DVec3 {
        self.centre + self.vector(canonical)
    }

    fn vector(&self, canonical: DVec3) -> DVec3 {
        let [a, b, c] = self.half_axes;
        a * canonical.x + b * canonical.y + c * canonical.z
    }

    /// A vector in the canonical frame.
    #[inline]
    fn canonical(&self, vector: DVec3) -> DVec3 {
        DVec3::from(self.half_axes.map(|axis| axis.dot(vector) / axis.length_squared()))
    }

    /// Outward unit normal of a canonical facet's image.
    fn normal(&self, canonical: DVec3) -> DVec3 {
        let [a, b, c] = self.half_axes.map(|axis| axis / axis.length_squared());
        (a * canonical.x + b * canonical.y + c * canonical.z).normalize()
    }

    /// Triangles of its surface, counter-clockwise seen from outside, m.
    pub fn triangles(&self) -> impl Iterator<Item = [DVec3; 3]> {
        let facets = self.facets();
        (0..facets.triangles.len()).map(move |which| facets.triangle(which).map(|corner| self.point(corner)))
    }

    /// Area of its outline as seen from far away in the direction of the unit vector `direction`, m²; exact.
    #[inline]
    pub fn projected_area(&self, direction: DVec3) -> f64 {
        let d = self.canonical(direction);
        let canonical = match self.solid {
            Solid::Box => 4.0 * d.abs().element_sum(),
            Solid::Cylinder => PI * d.z.abs() + 4.0 * d.x.hypot(d.y),
            Solid::Ellipsoid => PI * d.length(),
        };
        // Area × length of a prism along the direction is its volume, which stretching multiplies by the stretches.
        let [a, b, c] = self.half_axes.map(DVec3::length);
        a * b * c * canonical
    }

    /// No direction sees less of it than this, m²: the smallest middle section of the ellipsoid inside.
    pub(crate) fn least_projected_area(&self) -> f64 {
        let [a, b, c] = self.half_axes.map(DVec3::length);
        PI * (a * b).min(b * c).min(c * a)
    }

    /// Area of its surface in the mesh, m².
    pub(crate) fn surface(&self) -> f64 {
        self.triangles().map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum()
    }

    /// Radius of a ball around its centre that holds it, m.
    pub(crate) fn radius(&self) -> f64 {
        self.half_axes.iter().map(|axis| axis.length_squared()).sum::<f64>().sqrt()
    }

    /// How far it reaches along a vector: the largest n · x.
    pub(crate) fn reach(&self, n: DVec3) -> f64 {
        let [a, b, c] = self.half_axes.map(|axis| axis.dot(n));
        let reach = match self.solid {
            Solid::Box => a.abs() + b.abs() + c.abs(),
            Solid::Cylinder => a.hypot(b) + c.abs(),
            Solid::Ellipsoid => (a * a + b * b + c * c).sqrt(),
        };
        self.centre.dot(n) + reach
    }

    /// Lowest and highest corner of the box along the axes around it, m.
    pub(crate) fn bounds(&self) -> [DVec3; 2] {
        let high = [DVec3::X, DVec3::Y, DVec3::Z].map(|n| self.reach(n));
        let low = [DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z].map(|n| -self.reach(n));
        [DVec3::from(low), DVec3::from(high)]
    }

    /// Whether a point is in it, on its surface included.
    pub(crate) fn holds(&self, point: DVec3) -> bool {
        let p = self.canonical(point - self.centre);
        match self.solid {
            Solid::Box => p.abs().max_element() <= 1.0,
            Solid::Cylinder => p.x.hypot(p.y) <= 1.0 && p.z.abs() <= 1.0,
            Solid::Ellipsoid => p.length_squared() <= 1.0,
        }
    }

    /// Its outline as seen from `eye` (m), relative to it: a cone's corners, convex, counter-clockwise. Curved outlines
    /// are polygons of the same area. Nothing from inside.
    pub(crate) fn outline(&self, eye: DVec3, outline: &mut Vec<DVec3>) {
        outline.clear();
        if self.holds(eye) {
            return;
        }
        let e = self.canonical(eye - self.centre);
        match self.solid {
            Solid::Box => box_outline(e, outline),
            Solid::Cylinder => cylinder_outline(e, outline),
            Solid::Ellipsoid => ball_outline(e, outline),
        }
        outline.iter_mut().for_each(|corner| *corner = self.vector(*corner - e));
        let middle: DVec3 = outline.iter().map(|corner| corner.normalize_or_zero()).sum();
        let count = outline.len();
        let turn: DVec3 = (0..count).map(|i| outline[(i + 1) % count].cross(outline[i])).sum();
        if turn.dot(middle) < 0.0 {
            outline.reverse();
        }
    }

    /// Where a ray from outside meets it first: distance in lengths of `direction`.
    pub(crate) fn entry(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let (o, d) = (self.canonical(origin - self.centre), self.canonical(direction));
        // Between two planes, or within a circle or sphere: from … to.
        let slab = |o: f64, d: f64| {
            let (a, b) = ((-1.0 - o) / d, (1.0 - o) / d);
            if d == 0.0 {
                if o.abs() <= 1.0 { [f64::NEG_INFINITY, f64::INFINITY] } else { [f64::INFINITY, f64::NEG_INFINITY] }
            } else {
                [a.min(b), a.max(b)]
            }
        };
        let round = |o: DVec3, d: DVec3| {
            let (a, b, c) = (d.length_squared(), o.dot(d), o.length_squared() - 1.0);
            let root = (b * b - a * c).sqrt();
            if a == 0.0 && c <= 0.0 {
                [f64::NEG_INFINITY, f64::INFINITY]
            } else if root.is_nan() || a == 0.0 {
                [f64::INFINITY, f64::NEG_INFINITY]
            } else {
                [(-b - root) / a, (-b + root) / a]
            }
        };
        let flat = |v: DVec3| DVec3::new(v.x, v.y, 0.0);
        let common = |a: [f64; 2], b: [f64; 2]| [a[0].max(b[0]), a[1].min(b[1])];
        let [from, to] = match self.solid {
            Solid::Box => common(common(slab(o.x, d.x), slab(o.y, d.y)), slab(o.z, d.z)),
            Solid::Cylinder => common(round(flat(o), flat(d)), slab(o.z, d.z)),
            Solid::Ellipsoid => round(o, d),
        };
        (from <= to && to > 0.0).then_some(from.max(0.0))
    }

    /// A point of its mesh's surface, m, uniform in the area seen from far away in the direction of the unit vector
    /// `direction`, with the unit normal there. Cost: 4 to 6 throws of some 15 ns.
    #[inline]
    pub(crate) fn point_seen(&self, direction: DVec3, stream: &mut Stream) -> (DVec3, DVec3) {
        let (facets, towards) = (self.facets(), self.canonical(direction).normalize());
        // Seen from one direction, areas of the body are those of the canonical solid times one factor.
        let throw = |stream: &mut Stream| {
            let [choice, chance] = stream.uniform_pair();
            let which = facets.shares.partition_point(|&share| share <= choice).min(facets.shares.len() - 1);
            (which, chance)
        };
        let mut which = 0;
        for _ in 0..MOST_THROWS {
            let (thrown, chance) = throw(stream);
            which = thrown;
            if f64::from(chance) < facets.normals[which].dot(towards) {
                break;
            }
        }
        let [u, v] = stream.uniform_pair();
        self.point_of_facet(which, [u, v])
    }

    /// A point of a facet, m, with the unit normal there: equal areas of the unit square give equal areas.
    pub(crate) fn point_of_facet(&self, which: usize, [u, v]: [f32; 2]) -> (DVec3, DVec3) {
        let facets = self.facets();
        let [a, b, c] = facets.triangle(which);
        let (root, v) = (f64::from(u).sqrt(), f64::from(v));
        let point = self.point(a + (b - a) * (root * (1.0 - v)) + (c - a) * (root * v));
        (point, self.normal(facets.normals[which]))
    }

    /// Cuts a convex polygon into parts that lie outside of the body, and drops what is inside. With each part goes the
    /// facet whose plane keeps it from the body.
    pub(crate) fn parts_outside(&self, corners: &[DVec3], mut part: impl FnMut(u16, &[DVec3])) {
        let facets = self.facets();
        let mut rest: Vec<DVec3> = corners.iter().map(|&corner| self.canonical(corner - self.centre)).collect();
        if let Some(which) = facets.planes().position(|plane| rest.iter().all(|&corner| plane.above(corner) >= 0.0)) {
            return part(which as u16, corners);
        }
        let (mut inside, mut outside) = (Vec::new(), Vec::new());
        for (which, plane) in facets.planes().enumerate() {
            inside.clear();
            outside.clear();
            for (i, &here) in rest.iter().enumerate() {
                let next = rest[(i + 1) % rest.len()];
                let (a, b) = (plane.above(here), plane.above(next));
                if a >= 0.0 {
                    outside.push(self.point(here));
                }
                if a <= 0.0 {
                    inside.push(here);
                }
                if (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0) {
                    let crossing = here + (next - here) * (a / (a - b));
                    inside.push(crossing);
                    outside.push(self.point(crossing));
                }
            }
            if outside.len() >= 3 {
                part(which as u16, &outside);
            }
            if inside.len() < 3 {
                return;
            }
            std::mem::swap(&mut rest, &mut inside);
        }
    }

    /// Whether a point is above the plane of a facet, on the side away from the body.
    pub(crate) fn is_above(&self, facet: u16, point: DVec3) -> bool {
        self.facets().plane(usize::from(facet)).above(self.canonical(point - self.centre)) > 0.0
    }
}

/// The plane of a facet.
struct FacetPlane {
    normal: DVec3,
    height: f64,
}

impl FacetPlane {
    fn above(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.height
    }
}

/// The cube's outline from `eye`: edges between a face that is seen and one that is not.
fn box_outline(eye: DVec3, outline: &mut Vec<DVec3>) {
    let mut edges: Vec<(u8, u8)> = Vec::with_capacity(12);
    for axis in 0..3 {
        if eye[axis].abs() > 1.0 {
            let face = face(axis, eye[axis] > 0.0);
            for i in 0..4 {
                let (a, b) = (face[i], face[(i + 1) % 4]);
                match edges.iter().position(|&edge| edge == (b, a)) {
                    Some(inner) => {
                        edges.swap_remove(inner);
                    }
                    None => edges.push((a, b)),
                }
            }
        }
    }
    let Some(&(first, mut next)) = edges.first() else { return };
    let corner = |number: u8| DVec3::from([0, 1, 2].map(|axis| sign(number >> axis & 1 == 1)));
    outline.push(corner(first));
    while next != first {
        outline.push(corner(next));
        match edges.iter().find(|&&(from, _)| from == next) {
            Some(&(_, to)) => next = to,
            None => return,
        }
    }
}

/// The cylinder's outline from `eye`: of each end that is seen the far rim, of the other the near one; all of the rim
/// where the side isn't seen.
fn cylinder_outline(eye: DVec3, outline: &mut Vec<DVec3>) {
    let distance = eye.x.hypot(eye.y);
    let towards = eye.y.atan2(eye.x);
    if distance <= 1.0 + 1e-12 && eye.z.abs() > 1.0 {
        let step = TAU / ALL_ROUND as f64;
        let radius = (step / step.sin()).sqrt();
        let z = eye.z.signum();
        outline.extend(
            (0..ALL_ROUND).map(|i| (step * i as f64).sin_cos()).map(|(y, x)| DVec3::new(radius * x, radius * y, z)),
        );
        return;
    }
    // Half of what is seen of a rim's turn.
    let near = (1.0 / distance).min(1.0).acos().max(1e-6);
    // From one end of the near rim to the other, above and then back below: by the far rim where that end face is seen.
    for z in [1.0, -1.0] {
        let turn = if eye.z * z > 1.0 { 2.0 * near - TAU } else { 2.0 * near };
        arc(towards - near * z, turn * z, z, outline);
    }
}

/// An arc of the unit circle at height `z` from an angle on, both ends included, in [`HALF_ROUND`] edges. Its ends are
/// on the circle and the corners between a little outside, so that the area is the sector's.
fn arc(from: f64, turn: f64, z: f64, outline: &mut Vec<DVec3>) {
    let (edges, step) = (HALF_ROUND as f64, turn.abs() / HALF_ROUND as f64);
    // ½ sin δ ((m − 2) f² + 2 f) = ½ m δ for m edges of δ each.
    let radius = (((edges - 2.0) * edges * step / step.sin() + 1.0).sqrt() - 1.0) / (edges - 2.0);
    for i in 0..=HALF_ROUND {
        let (y, x) = (from + turn * i as f64 / edges).sin_cos();
        let radius = if i == 0 || i == HALF_ROUND { 1.0 } else { radius };
        outline.push(DVec3::new(radius * x, radius * y, z));
    }
}

/// The unit ball's outline from `eye`: the circle where tangents touch it.
fn ball_outline(eye: DVec3, outline: &mut Vec<DVec3>) {
    let square = eye.length_squared();
    let (u, v) = (eye / square.sqrt()).any_orthonormal_pair();
    let step = TAU / ALL_ROUND as f64;
    let radius = (1.0 - 1.0 / square).max(0.0).sqrt() * (step / step.sin()).sqrt();
    let corner = |(sin, cos): (f64, f64)| eye / square + u * (radius * cos) + v * (radius * sin);
    outline.extend((0..ALL_ROUND).map(|i| corner((step * i as f64).sin_cos())));
}

#[cfg(test)]
mod tests;
