//! What may stand between points and an opening: all triangles that meet the shaft between the two.
//!
//! A shaft is the convex hull of two boxes, one around the points and one around the opening (Haines & Wallace 1994). A
//! tree of boxes finds the triangles that reach into it. Unlike shadow rays, such a search misses nothing: where it
//! finds no triangle, all of the opening is seen from every one of the points.

use glam::{DVec3, Vec3};

use crate::embree::RayCaster;
use crate::geometry::Mesh;

/// Triangles in a leaf of the tree, at most.
const LEAF: usize = 4;

/// The triangles of a scene, made ready for searches along shafts and for shadow rays.
///
/// Memory: 4 bytes a triangle and 24 bytes a box, 12 to 24 bytes a triangle. Cost: O(n log n), n triangles.
pub struct Blockers<'a> {
    mesh: &'a Mesh,
    /// The same triangles, for rays.
    pub caster: &'a RayCaster,
    /// Triangles in the order of the leaves.
    order: Vec<u32>,
    /// A full binary tree: the children of box i are 2 i + 1 and 2 i + 2, and the boxes of the last level bound the
    /// leaves.
    boxes: Vec<AxisBox>,
}

/// A box along the axes, m.
#[derive(Clone, Copy, Debug)]
pub(super) struct AxisBox {
    pub(super) low: Vec3,
    pub(super) high: Vec3,
}

impl AxisBox {
    const EMPTY: Self = Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };

    /// The smallest box around some points.
    pub(super) fn around(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |all, point| all.with(Self { low: point, high: point }))
    }

    /// The smallest box around points given in double precision.
    pub(super) fn around_exact(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |all, point| {
            let near = point.as_vec3();
            let [low, high] = [f32::next_down, f32::next_up].map(|next| Vec3::from(near.to_array().map(next)));
            all.with(Self { low, high })
        })
    }

    /// The smallest box around both.
    pub(super) fn with(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Distance between the two boxes, m.
    pub(super) fn distance(&self, other: &Self) -> f64 {
        let gap = |low: Vec3, high: Vec3| (low.as_dvec3() - high.as_dvec3()).max(DVec3::ZERO);
        gap(self.low, other.high).max(gap(other.low, self.high)).length()
    }

    /// No point of one box is farther than this from any of the other, m.
    pub(super) fn farthest(&self, other: &Self) -> f64 {
        let reach = (other.high - self.low).abs().max((self.high - other.low).abs());
        reach.as_dvec3().length()
    }

    /// Largest coordinate, m.
    pub(super) fn largest_coordinate(&self) -> f32 {
        self.low.abs().max(self.high.abs()).max_element()
    }

    /// The largest and smallest n · x in the box.
    pub(super) fn along(&self, n: DVec3) -> [f64; 2] {
        let (a, b) = (self.low.as_dvec3() * n, self.high.as_dvec3() * n);
        [a.min(b).element_sum(), a.max(b).element_sum()]
    }
}

/// The part of space where something can stand between the points of one box and the points of another.
#[derive(Clone, Debug)]
pub(super) struct Shaft {
    whole: AxisBox,
    /// Nothing in the shaft has n · x above the limit.
    planes: Vec<(DVec3, f64)>,
}

impl Shaft {
    /// The shaft between two boxes.
    pub(super) fn between(a: &AxisBox, b: &AxisBox) -> Self {
        let mut planes = Vec::with_capacity(14);
        // Seen along each axis the hull of two rectangles has, besides sides of theirs, edges from a corner of one to
        // the same corner of the other: where one reaches farther along one axis and the other along the other.
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            for (sign_i, sign_j) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
                let corner = |bounds: &AxisBox, axis: usize, sign: f64| {
                    f64::from(if sign > 0.0 { bounds.high[axis] } else { bounds.low[axis] })
                };
                let at = [corner(a, i, sign_i), corner(a, j, sign_j)];
                let step_i = (corner(b, i, sign_i) - at[0]) * sign_i;
                let step_j = (corner(b, j, sign_j) - at[1]) * sign_j;
                if step_i * step_j < 0.0 {
                    let mut normal = DVec3::ZERO;
                    normal[i] = step_j.abs() * sign_i;
                    normal[j] = step_i.abs() * sign_j;
                    planes.push((normal, normal[i] * at[0] + normal[j] * at[1]));
                }
            }
        }
        Self { whole: a.with(*b), planes }
    }

    /// Leaves out what lies behind the plane n · x = height.
    pub(super) fn in_front_of(&mut self, normal: DVec3, height: f64) {
        self.planes.push((-normal, -height));
    }

    fn meets_box(&self, bounds: &AxisBox) -> bool {
        bounds.low.cmple(self.whole.high).all()
            && self.whole.low.cmple(bounds.high).all()
            && self.planes.iter().all(|&(normal, limit)| bounds.along(normal)[0] <= limit)
    }

    /// Whether a convex polygon may reach into the shaft.
    pub(super) fn meets(&self, corners: &[DVec3]) -> bool {
        let (low, high) = (self.whole.low.as_dvec3(), self.whole.high.as_dvec3());
        let beside = |axis: usize| {
            corners.iter().all(|corner| corner[axis] < low[axis])
                || corners.iter().all(|corner| corner[axis] > high[axis])
        };
        !(0..3).any(beside)
            && self.planes.iter().all(|&(normal, limit)| corners.iter().any(|corner| corner.dot(normal) <= limit))
    }
}

impl<'a> Blockers<'a> {
    /// Sorts the triangles of `mesh`, which `caster` holds too.
    pub fn new(mesh: &'a Mesh, caster: &'a RayCaster) -> Self {
        let corner = |vertex: u32| Vec3::from(mesh.vertices[vertex as usize]);
        let middles: Vec<Vec3> = mesh.triangles.iter().map(|t| t.iter().map(|&v| corner(v)).sum()).collect();
        let mut order: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let leaves = order.len().div_ceil(LEAF).next_power_of_two();
        sort(&mut order, &middles, leaves);
        let mut boxes = vec![AxisBox::EMPTY; 2 * leaves - 1];
        for leaf in 0..leaves {
            let triangles = &order[range(leaf, leaves, order.len())];
            let corners = triangles.iter().flat_map(|&triangle| mesh.triangles[triangle as usize]).map(corner);
            boxes[leaves - 1 + leaf] = AxisBox::around(corners);
        }
        for parent in (0..leaves - 1).rev() {
            boxes[parent] = boxes[2 * parent + 1].with(boxes[2 * parent + 2]);
        }
        Self { mesh, caster, order, boxes }
    }

    /// Corners of a triangle, m.
    pub(super) fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.mesh.corners(triangle as usize)
    }

    /// Material of a triangle that is a pane.
    #[inline]
    pub(super) fn pane(&self, triangle: u32) -> Option<u32> {
        if !self.caster.has_panes() {
            return None;
        }
        let material = self.mesh.material_of[triangle as usize];
        self.caster.pane(material).map(|_| material)
    }

    /// Calls `found` with the triangles (and their numbers) that may reach into the shaft, until it returns false.
    pub(super) fn search(&self, shaft: &Shaft, mut found: impl FnMut(u32, [DVec3; 3]) -> bool) {
        let leaves = self.boxes.len().div_ceil(2);
        let mut open = [0_usize; 64];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let node = open[count];
            if !shaft.meets_box(&self.boxes[node]) {
                continue;
            }
            if node + 1 < leaves {
                open[count] = 2 * node + 2;
                open[count + 1] = 2 * node + 1;
                count += 2;
                continue;
            }
            for &triangle in &self.order[range(node + 1 - leaves, leaves, self.order.len())] {
                let corners = self.corners(triangle);
                if shaft.meets(&corners) && !found(triangle, corners) {
                    return;
                }
            }
        }
    }
}

/// The triangles of a leaf. Both factors are below 2³².
fn range(leaf: usize, leaves: usize, triangles: usize) -> std::ops::Range<usize> {
    let start = |leaf: usize| (leaf as u64 * triangles as u64 / leaves as u64) as usize;
    start(leaf)..start(leaf + 1)
}

/// Halves the triangles along the longest side of the box around their middles, again and again, to one part a leaf.
fn sort(order: &mut [u32], middles: &[Vec3], leaves: usize) {
    let count = order.len();
    sort_part(order, middles, 0..leaves, &|leaf| range(leaf, leaves, count).start);
}

fn sort_part(
    order: &mut [u32],
    middles: &[Vec3],
    leaves: std::ops::Range<usize>,
    start: &(impl Fn(usize) -> usize + Sync),
) {
    if leaves.len() < 2 || order.len() < 2 {
        return;
    }
    let size = {
        let bounds = AxisBox::around(order.iter().map(|&triangle| middles[triangle as usize]));
        bounds.high - bounds.low
    };
    let axis = size.max_position();
    let middle = leaves.start + leaves.len() / 2;
    let split = start(middle) - start(leaves.start);
    let place = |&triangle: &u32| middles[triangle as usize][axis];
    if split < order.len() {
        // Ties by number, so that the order is always the same.
        order.select_nth_unstable_by(split, |a, b| place(a).total_cmp(&place(b)).then(a.cmp(b)));
    }
    let (left, right) = order.split_at_mut(split);
    rayon::join(
        || sort_part(left, middles, leaves.start..middle, start),
        || sort_part(right, middles, middle..leaves.end, start),
    );
}
