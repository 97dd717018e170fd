//! Flat openings seen from a point: Lambert's formula for what they send there, and shadows cut out of them.
//!
//! Corners are relative to the point. A shadow is a cone with its apex there, so all cuts are made by planes through
//! the point, and nothing has to be projected.

use glam::DVec3;

/// Directions (in radians, about) closer than this to the plane of a cut count as on it. Rounding of corners that were
/// cut before is some 1e-16 of their distance; what is lost or won by it is at most that part of the opening's light.
const ON_PLANE: f64 = 1e-13;

/// Illuminance per luminance at `point` with unit normal `normal` from a Lambertian polygon that is seen whole:
/// Lambert's formula, ½ Σ βᵢ (n · γᵢ) over the edges, βᵢ the angle an edge subtends and γᵢ the unit normal of its plane
/// with the point, after clipping at the point's horizon. Its unit is sr; times cd/m² it is lx.
pub fn projected_solid_angle(corners: &[DVec3], point: DVec3, normal: DVec3) -> f64 {
    let mut above = Vec::with_capacity(corners.len() + 2);
    above_horizon(corners, point, normal, &mut above);
    lambert(&above, normal).abs()
}

/// The part of a polygon above the horizon of `point`, relative to it.
pub(super) fn above_horizon(corners: &[DVec3], point: DVec3, normal: DVec3, above: &mut Vec<DVec3>) {
    above.clear();
    let Some(&last) = corners.last() else { return };
    let mut before = last - point;
    let mut height_before = before.dot(normal);
    for &corner in corners {
        let here = corner - point;
        let height = here.dot(normal);
        if (height_before > 0.0 && height < 0.0) || (height_before < 0.0 && height > 0.0) {
            above.push(before + (here - before) * (height_before / (height_before - height)));
        }
        if height >= 0.0 {
            above.push(here);
        }
        (before, height_before) = (here, height);
    }
}

/// Lambert's formula for a polygon above the horizon; positive if it runs clockwise as seen from the point at the
/// origin.
pub(super) fn lambert(corners: &[DVec3], normal: DVec3) -> f64 {
    let Some(&last) = corners.last() else { return 0.0 };
    let mut before = last;
    let mut sum = 0.0;
    for &corner in corners {
        let cross = before.cross(corner);
        sum += angle_by_sine(cross.length_squared(), before.dot(corner)) * cross.dot(normal);
        before = corner;
    }
    -0.5 * sum
}

/// β / (r s sin β), where r s sin β is the root of `sine_squared` and r s cos β is `cosine`; 0 where the sine is 0.
#[inline]
fn angle_by_sine(sine_squared: f64, cosine: f64) -> f64 {
    let small = 1.0 / 16.0;
    if cosine > 0.0 && sine_squared < small * cosine * cosine {
        // atan t / t for t² < 1/16; the first term left out is t²⁰/21 < 5e-14.
        let square = sine_squared / (cosine * cosine);
        let series = (0..10).rev().fold(0.0, |sum, i| {
            let term = 1.0 / f64::from(2 * i + 1);
            sum * square + if i % 2 == 0 { term } else { -term }
        });
        return series / cosine;
    }
    let sine = sine_squared.sqrt();
    if sine > 0.0 { sine.atan2(cosine) / sine } else { 0.0 }
}

/// Convex polygons, corner after corner.
#[derive(Clone, Debug, Default)]
pub(super) struct ConvexPieces {
    corners: Vec<DVec3>,
    /// One behind the last corner of each.
    ends: Vec<usize>,
}

impl ConvexPieces {
    pub(super) fn clear(&mut self) {
        self.corners.clear();
        self.ends.clear();
    }

    pub(super) fn push(&mut self, piece: &[DVec3]) {
        self.corners.extend_from_slice(piece);
        self.ends.push(self.corners.len());
    }

    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }

    /// Takes the last one out; false if there is none.
    pub(super) fn pop(&mut self, piece: &mut Vec<DVec3>) -> bool {
        if self.ends.pop().is_none() {
            return false;
        }
        let start = self.ends.last().copied().unwrap_or(0);
        piece.clear();
        piece.extend(self.corners.drain(start..));
        true
    }

    /// Adds both parts of a piece that the plane n · x = height cuts.
    pub(super) fn push_halves(&mut self, piece: &[DVec3], n: DVec3, height: f64) {
        for (n, height) in [(n, height), (-n, -height)] {
            let start = self.corners.len();
            let above = |corner: DVec3| corner.dot(n) - height;
            let mut before = piece[piece.len() - 1];
            for &here in piece {
                let (a, b) = (above(before), above(here));
                if (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0) {
                    self.corners.push(before + (here - before) * (a / (a - b)));
                }
                if b >= 0.0 {
                    self.corners.push(here);
                }
                before = here;
            }
            if self.corners.len() - start >= 3 {
                self.ends.push(self.corners.len());
            } else {
                self.corners.truncate(start);
            }
        }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &[DVec3]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.corners[start..end])
    }
}

/// What a flat convex blocker hides: a cone, as the planes through the point and the blocker's edges.
pub(super) struct Shadow {
    /// Inward normals, of any length.
    planes: [DVec3; 4],
    count: usize,
}

impl Shadow {
    /// The shadow of a polygon of three or four corners (relative to the point) in a plane with unit normal `normal`;
    /// nothing if the point lies in that plane, as it then hides nothing.
    #[inline]
    pub(super) fn of(corners: &[DVec3], normal: DVec3) -> Option<Self> {
        let height = corners[0].dot(normal);
        let size = corners.iter().fold(0.0_f64, |most, corner| most.max(corner.abs().max_element()));
        if height.abs() <= 1e-12 * size {
            return None;
        }
        let mut planes = [DVec3::ZERO; 4];
        for (i, plane) in planes.iter_mut().enumerate().take(corners.len()) {
            let next = corners[(i + 1) % corners.len()];
            *plane = if height > 0.0 { corners[i].cross(next) } else { next.cross(corners[i]) };
        }
        Some(Self { planes, count: corners.len() })
    }

    fn planes(&self) -> &[DVec3] {
        &self.planes[..self.count]
    }

    /// How far inside a plane a corner has to lie to count as inside, for corners of coordinates up to `size`.
    #[inline]
    fn tolerance(plane: DVec3, size: f64) -> f64 {
        ON_PLANE * size * plane.abs().element_sum()
    }

    /// Whether all of a polygon lies outside one of the planes.
    #[inline]
    pub(super) fn misses(&self, piece: &[DVec3], size: f64) -> bool {
        self.planes().iter().any(|&plane| {
            let tolerance = Self::tolerance(plane, size);
            piece.iter().all(|corner| corner.dot(plane) <= tolerance)
        })
    }

    /// Cuts this shadow out of `piece` and adds to `lit` what is left: at most one convex part for each plane.
    pub(super) fn cut(&self, piece: &[DVec3], size: f64, lit: &mut ConvexPieces, scratch: &mut [Vec<DVec3>; 2]) {
        let (corners_before, pieces_before) = (lit.corners.len(), lit.ends.len());
        let [rest, inside] = scratch;
        rest.clear();
        rest.extend_from_slice(piece);
        for &plane in self.planes() {
            let tolerance = Self::tolerance(plane, size);
            inside.clear();
            let outside_starts = lit.corners.len();
            let (mut is_out, mut is_in) = (false, false);
            let mut before = rest[rest.len() - 1];
            let mut depth_before = before.dot(plane);
            for &here in rest.iter() {
                let depth = here.dot(plane);
                if (depth_before > tolerance && depth < -tolerance) || (depth_before < -tolerance && depth > tolerance)
                {
                    let crossing = before + (here - before) * (depth_before / (depth_before - depth));
                    inside.push(crossing);
                    lit.corners.push(crossing);
                }
                if depth >= -tolerance {
                    inside.push(here);
                    is_in |= depth > tolerance;
                }
                if depth <= tolerance {
                    lit.corners.push(here);
                    is_out |= depth < -tolerance;
                }
                (before, depth_before) = (here, depth);
            }
            if !is_in {
                // All of the rest is outside: the shadow misses the piece, which stays as it was.
                lit.corners.truncate(corners_before);
                lit.ends.truncate(pieces_before);
                lit.push(piece);
                return;
            }
            if is_out {
                lit.ends.push(lit.corners.len());
                std::mem::swap(rest, inside);
            } else {
                lit.corners.truncate(outside_starts);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An element opposite a corner of a parallel rectangle: Howell's configuration factor C-11, times π.
    #[test]
    fn polygon_formula_matches_the_configuration_factor_of_a_parallel_rectangle() {
        for (a, b, c) in [(1.0_f64, 1.0_f64, 1.0_f64), (0.5, 0.5, 3.0), (10.0, 0.1, 0.2), (1e3, 1e3, 1.0)] {
            let corners = [DVec3::new(0.0, 0.0, c), DVec3::new(a, 0.0, c), DVec3::new(a, b, c), DVec3::new(0.0, b, c)];
            let (x, y) = (a / c, b / c);
            let term = |x: f64, y: f64| x / (1.0 + x * x).sqrt() * (y / (1.0 + x * x).sqrt()).atan();
            let expected = 0.5 * (term(x, y) + term(y, x));
            let found = projected_solid_angle(&corners, DVec3::ZERO, DVec3::Z);
            assert!((found / expected - 1.0).abs() < 1e-12, "{a} × {b} at {c}: {found}, expected {expected}");
        }
    }

    /// The part of an opening below the point's horizon brings nothing: half of a rectangle that stands across it is
    /// Howell's C-12 (an element perpendicular to the rectangle's plane), times π, on either side.
    #[test]
    fn the_part_below_the_horizon_is_clipped() {
        let (a, b, c) = (2.0_f64, 3.0_f64, 1.5_f64); // height above the horizon, width, distance
        let corners = [DVec3::new(c, 0.0, -7.0), DVec3::new(c, b, -7.0), DVec3::new(c, b, a), DVec3::new(c, 0.0, a)];
        let (x, y) = (a / b, c / b);
        let root = (x * x + y * y).sqrt();
        let expected = 0.5 * ((1.0 / y).atan() - y / root * (1.0 / root).atan());
        let found = projected_solid_angle(&corners, DVec3::ZERO, DVec3::Z);
        assert!((found / expected - 1.0).abs() < 1e-12, "{found}, expected {expected}");
    }
}
