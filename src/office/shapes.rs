//! Closed shells of triangles: boxes, rounded boxes, turned bodies and tubes, each finer with the detail.
//!
//! Every shape tells its vertices and triangles to a [`Sink`]; triangles run counter-clockwise seen from outside. A
//! shape between bent axes is the straight one told to a [`Bent`] sink.

use std::f64::consts::{FRAC_PI_4, TAU};

use glam::DVec3;

use super::exact::circle;

/// What takes a shape's vertices and triangles.
pub trait Sink {
    /// Takes a vertex, m, and tells its number: one more than the last one's.
    fn vertex(&mut self, position: DVec3) -> u32;
    /// Takes a triangle between vertices taken before.
    fn triangle(&mut self, corners: [u32; 3]);
    /// Takes a four-cornered face as two triangles.
    fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.triangle([a, b, c]);
        self.triangle([a, c, d]);
    }
}

/// A sink that moves every vertex before it passes it on. `bend` must keep outside outside, as rotations, shifts and
/// shears do; those keep the volume too.
pub struct Bent<'a, F> {
    sink: &'a mut dyn Sink,
    bend: F,
}

impl<'a, F: Fn(DVec3) -> DVec3> Bent<'a, F> {
    /// What is told to it arrives at `sink` as `bend` says.
    pub fn new(sink: &'a mut dyn Sink, bend: F) -> Self {
        Self { sink, bend }
    }
}

impl<F: Fn(DVec3) -> DVec3> Sink for Bent<'_, F> {
    fn vertex(&mut self, position: DVec3) -> u32 {
        self.sink.vertex((self.bend)(position))
    }

    fn triangle(&mut self, corners: [u32; 3]) {
        self.sink.triangle(corners);
    }
}

/// How finely curves and faces are cut: segments grow in proportion, triangles with the square.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Detail(pub u32);

/// No segment is shorter, m: coordinates are written to 10⁻⁵ m and read in single precision.
const SHORTEST: f64 = 1.5e-3;
/// Most segments around a circle: those of the innermost ring, `SHORTEST` from its axis, are then 0.07 mm long.
const MOST_AROUND: usize = 128;

impl Detail {
    /// Segments of an edge of `length` m that has `base` of them at detail 1.
    pub fn segments(self, base: u32, length: f64) -> usize {
        let most = (length / SHORTEST) as u32;
        (base * self.0).min(most).max(1) as usize
    }

    /// Segments around a circle of `radius` m that has `base` of them at detail 1, and never less; never so many that
    /// triangles about an axis become needles.
    pub fn around(self, base: u32, radius: f64) -> usize {
        self.segments(base, TAU * radius).clamp(base as usize, MOST_AROUND)
    }
}

/// A face of a box: its axis, and whether it is that at the high end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct BoxFace {
    pub(super) axis: usize,
    pub(super) high: bool,
}

/// Numbers of the lattice points on the six faces of a box that is cut into so many cells along each axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoxGrid {
    cells: [usize; 3],
}

impl BoxGrid {
    pub(super) fn new(cells: [usize; 3]) -> Self {
        Self { cells }
    }

    /// Calls `take` with every lattice point on the surface, in the order of their numbers: layers of z upwards, the
    /// first and the last with all their points, the others with their rim.
    pub(super) fn points(self, mut take: impl FnMut([usize; 3])) {
        let [nx, ny, nz] = self.cells;
        for k in 0..=nz {
            if k == 0 || k == nz {
                (0..=ny).for_each(|j| (0..=nx).for_each(|i| take([i, j, k])));
            } else {
                (0..nx).for_each(|i| take([i, 0, k]));
                (0..ny).for_each(|j| take([nx, j, k]));
                (0..nx).for_each(|i| take([nx - i, ny, k]));
                (0..ny).for_each(|j| take([0, ny - j, k]));
            }
        }
    }

    /// Number of a point that `points` tells.
    fn number(self, [i, j, k]: [usize; 3]) -> u32 {
        let [nx, ny, nz] = self.cells;
        let (layer, rim) = ((nx + 1) * (ny + 1), 2 * (nx + ny));
        let number = match k {
            0 => j * (nx + 1) + i,
            k if k == nz => layer + (nz - 1) * rim + j * (nx + 1) + i,
            _ => {
                let along = match (i, j) {
                    (i, 0) => i,
                    (i, j) if i == nx => nx + j,
                    (i, j) if j == ny => nx + ny + (nx - i),
                    (_, j) => 2 * nx + ny + (ny - j),
                };
                layer + (k - 1) * rim + along
            }
        };
        number as u32
    }

    /// Calls `take` with every cell of every face: where it is, counted along the next axis and the one after it, and
    /// the numbers of its corners, counter-clockwise seen from outside.
    pub(super) fn quads(self, mut take: impl FnMut(BoxFace, [usize; 2], [u32; 4])) {
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for high in [false, true] {
                for b in 0..self.cells[v] {
                    for a in 0..self.cells[u] {
                        let corner = |du: usize, dv: usize| {
                            let mut point = [0; 3];
                            point[axis] = if high { self.cells[axis] } else { 0 };
                            (point[u], point[v]) = (a + du, b + dv);
                            self.number(point)
                        };
                        let [p, q] = if high { [(1, 0), (0, 1)] } else { [(0, 1), (1, 0)] };
                        let corners = [corner(0, 0), corner(p.0, p.1), corner(1, 1), corner(q.0, q.1)];
                        take(BoxFace { axis, high }, [a, b], corners);
                    }
                }
            }
        }
    }
}

/// A box about the origin whose edges and corners are rounded.
#[derive(Clone, Copy, Debug)]
pub struct RoundedBox {
    /// Half its sizes, m.
    pub half: DVec3,
    /// Of edges and corners, m; 0: sharp. At most the least of `half`. At detail 1 all are sharp.
    pub radius: f64,
    /// Segments of the flat part along each axis at detail 1; 0: one segment at any detail.
    pub flat: [u32; 3],
}

impl RoundedBox {
    /// The shell, an eighth of a circle cut into detail − 1 segments: triangles ∝ detail².
    pub fn shell(&self, detail: Detail, sink: &mut dyn Sink) {
        let radius = if detail > Detail(1) { self.radius } else { 0.0 };
        let inner = self.half - DVec3::splat(radius);
        let rounds = if radius > 0.0 { Detail(detail.0 - 1).segments(1, radius * FRAC_PI_4) } else { 0 };
        let axes: [Vec<f64>; 3] = std::array::from_fn(|axis| {
            let (inner, flat) = (inner[axis], 2.0 * inner[axis]);
            let segments = if self.flat[axis] == 0 { 1 } else { detail.segments(self.flat[axis], flat) };
            let round = |step: usize| inner + radius * step as f64 / rounds as f64;
            let below = (1..=rounds).rev().map(|step| -round(step));
            let above = (1..=rounds).map(round);
            let between = (0..=segments).map(|step| flat * (step as f64 / segments as f64) - inner);
            // A box that is round all along an axis has no flat part there: its two ends are one point.
            let between = between.take(if flat > SHORTEST { segments + 1 } else { 1 });
            below.chain(between).chain(above).collect()
        });
        let rounded = |point: DVec3| {
            let within = point.clamp(-inner, inner);
            let out = point - within;
            if radius > 0.0 { within + out * (radius / out.length()) } else { point }
        };
        let grid = BoxGrid::new(std::array::from_fn(|axis| axes[axis].len() - 1));
        let mut first = None;
        grid.points(|[i, j, k]| {
            let number = sink.vertex(rounded(DVec3::new(axes[0][i], axes[1][j], axes[2][k])));
            first.get_or_insert(number);
        });
        let first = first.unwrap_or(0);
        grid.quads(|_, _, corners| sink.quad(corners.map(|corner| first + corner)));
    }

    /// Volume of the smooth body, m³: box, slabs, quarter cylinders and ball.
    pub fn volume(&self) -> f64 {
        let (r, a) = (self.radius, 2.0 * (self.half - DVec3::splat(self.radius)));
        a.x * a.y * a.z
            + 2.0 * r * (a.x * a.y + a.y * a.z + a.z * a.x)
            + TAU / 2.0 * r * r * (a.x + a.y + a.z)
            + 2.0 / 3.0 * TAU * r * r * r
    }
}

/// A body turned about the z axis: `outline` are (radius, z) in m, from the axis (radius 0) below around to the axis
/// above, with `segments` around.
pub fn lathe(outline: &[[f64; 2]], segments: usize, sink: &mut dyn Sink) {
    let ring: Vec<[f64; 2]> = (0..segments).map(|step| circle(step as f64 / segments as f64)).collect();
    let [below, rings @ .., above] = outline else { return };
    let bottom = sink.vertex(DVec3::new(0.0, 0.0, below[1]));
    for &[radius, z] in rings {
        for [cos, sin] in &ring {
            sink.vertex(DVec3::new(radius * cos, radius * sin, z));
        }
    }
    let top = sink.vertex(DVec3::new(0.0, 0.0, above[1]));
    rings_between(bottom, rings.len(), segments, top, sink);
}

/// A round tube of `radius` m along a path of at least two points, with `segments` around; its ends are flat.
pub fn tube(path: &[DVec3], radius: f64, segments: usize, sink: &mut dyn Sink) {
    let ring: Vec<[f64; 2]> = (0..segments).map(|step| circle(step as f64 / segments as f64)).collect();
    let [start, .., end] = path else { return };
    let direction = |at: usize| {
        let before = if at > 0 { (path[at] - path[at - 1]).normalize() } else { DVec3::ZERO };
        let after = path.get(at + 1).map_or(DVec3::ZERO, |next| (next - path[at]).normalize());
        (before + after).normalize()
    };
    let bottom = sink.vertex(*start);
    let mut across = direction(0).any_orthonormal_vector();
    for (at, &point) in path.iter().enumerate() {
        // The ring turns with the path, and no more than the path does.
        let along = direction(at);
        across = (across - along * across.dot(along)).normalize();
        let up = along.cross(across);
        for [cos, sin] in &ring {
            sink.vertex(point + (across * *cos + up * *sin) * radius);
        }
    }
    let top = sink.vertex(*end);
    rings_between(bottom, path.len(), segments, top, sink);
}

/// Faces of a body of `rings` between its first vertex and its last.
fn rings_between(bottom: u32, rings: usize, segments: usize, top: u32, sink: &mut dyn Sink) {
    let at = |ring: usize, step: usize| bottom + 1 + (ring * segments + step % segments) as u32;
    for step in 0..segments {
        sink.triangle([bottom, at(0, step + 1), at(0, step)]);
    }
    for ring in 1..rings {
        for step in 0..segments {
            sink.quad([at(ring - 1, step), at(ring - 1, step + 1), at(ring, step + 1), at(ring, step)]);
        }
    }
    for step in 0..segments {
        sink.triangle([at(rings - 1, step), at(rings - 1, step + 1), top]);
    }
}

/// Outline for [`lathe`]: the `corners`, (radius, z) in m from the axis below to the axis above, joined by straight
/// lines, each with `base` segments at detail 1.
pub fn outline(corners: &[[f64; 2]], base: u32, detail: Detail) -> Vec<[f64; 2]> {
    let mut points = vec![corners[0]];
    for pair in corners.windows(2) {
        let [[r0, z0], [r1, z1]] = [pair[0], pair[1]];
        let length = ((r1 - r0) * (r1 - r0) + (z1 - z0) * (z1 - z0)).sqrt();
        let segments = detail.segments(base, length);
        points.extend((1..=segments).map(|step| {
            let part = step as f64 / segments as f64;
            [r0 + (r1 - r0) * part, z0 + (z1 - z0) * part]
        }));
    }
    points
}

/// Outline for [`lathe`] of a ball of `radius` m about height `z`, with `segments` (at least 2) from pole to pole.
pub fn ball(radius: f64, z: f64, segments: usize) -> Vec<[f64; 2]> {
    let segments = segments.max(2);
    let point = |step: usize| {
        let [cos, sin] = circle(step as f64 / (2 * segments) as f64);
        [radius * sin, z - radius * cos]
    };
    (0..=segments).map(point).collect()
}

/// Points of the parabola from `start` to `end` whose tangents there meet in `middle`.
pub fn parabola([start, middle, end]: [DVec3; 3], segments: usize) -> Vec<DVec3> {
    let point = |step: usize| {
        let t = step as f64 / segments as f64;
        start * ((1.0 - t) * (1.0 - t)) + middle * (2.0 * t * (1.0 - t)) + end * (t * t)
    };
    (0..=segments).map(point).collect()
}
