//! Measured luminaires seen from a point: luminance times projected solid angle, summed over what is seen of the
//! opening.
//!
//! No formula gives this sum. It is taken over convex parts: of a flat opening itself, of a body its outline as seen
//! from the point, since all of the body has one luminance towards one direction. Each part has five nodes: its
//! centroid, and four that share its area, centroid and second moments, so that polynomials of degree two come out
//! exactly. Where both answers differ too much, light falls off steeply across a skew part, or the part is wide, it is
//! halved.

use glam::DVec3;

use super::blockers::AxisBox;
use super::polygon::{ConvexPieces, lambert};
use crate::geometry::body::Body;
use crate::luminaire::web::Measured;

/// The part of an opening's light by which a part's four nodes and its centroid may differ is the root of this times
/// the part of the light that comes from there. The error of four nodes is about the square of that difference.
const DIFFERENCE: f64 = 4e-4;
/// What skewness may bring by estimate, as part of an opening's light.
const LOPSIDED: f64 = 2e-4;
/// A difference below this part of an opening's light never matters.
const TOO_LITTLE: f64 = 1e-6;
/// Parts are no wider than this part of the angle over which intensity may change by its largest value, within bounds
/// (rad).
const PART_OF_SCALE: f64 = 0.6;
const WIDTHS: [f64; 2] = [0.02, 0.25];
/// Wide parts are not halved where they can bring no more than this part of the opening's light.
const WIDE_BUT_WEAK: f64 = 2e-3;
/// Parts treated for one opening and point; each further one is taken as seen in its mean direction.
const MAX_PARTS: usize = 400;
/// Corners of a cone this near (cosine) to its middle are put on one plane.
const NARROW: f64 = 0.5;
/// A flat opening that is seen under a smaller cosine than this counts as seen under it: intensity measured there is of
/// something that is not flat, and flat it would be infinitely bright.
pub(in crate::gather) const FLATTEST: f64 = 1e-3;

/// A measured luminaire, or one side of it.
pub(super) struct WebLight {
    measured: Measured,
    /// Flux, lm.
    flux: f64,
    /// Largest intensity, cd.
    most: f64,
    /// Width of parts, rad.
    width: f64,
    shape: SeenShape,
}

/// What is seen.
pub(super) enum SeenShape {
    /// A flat opening: its area, normal, and two axes in it.
    Flat {
        area: f64,
        normal: DVec3,
        axes: [DVec3; 2],
    },
    Body(Body),
}

impl SeenShape {
    pub(super) fn flat(area: f64, normal: DVec3) -> Self {
        Self::Flat { area, normal, axes: normal.any_orthonormal_pair().into() }
    }
}

/// Memory reused from sum to sum.
#[derive(Default)]
pub(super) struct WebParts {
    open: ConvexPieces,
    part: Vec<DVec3>,
    flattened: Vec<DVec3>,
}

/// What becomes of a part.
enum PartFate {
    /// Its illuminance, lx.
    Done(f64),
    /// To be halved along the plane n · x = height.
    Halve(DVec3, f64),
}

impl WebLight {
    /// `most` is the largest intensity (cd) towards where it shines.
    pub(super) fn new(measured: &Measured, flux: f64, most: f64, shape: SeenShape) -> Self {
        let width = (PART_OF_SCALE * measured.web().scale()).clamp(WIDTHS[0], WIDTHS[1]);
        Self { measured: measured.clone(), flux, most, width, shape }
    }

    /// Illuminance (lx) at the origin, facing `up`, from convex parts of the opening or of its outline, all above the
    /// horizon; `whole` is what all of it brings, 0 if that isn't known yet. Error: at most some 1e-3 of it, 1e-4 as a
    /// rule (tests compare with a thousand times as many nodes). Cost: 5 intensities where the opening is seen under up
    /// to a quarter of its distance, and some tens next to it.
    pub(super) fn sum<'a>(
        &self,
        pieces: impl Iterator<Item = &'a [DVec3]>,
        up: DVec3,
        whole: f64,
        parts: &mut WebParts,
    ) -> f64 {
        let WebParts { open, part, flattened } = parts;
        open.clear();
        pieces.for_each(|piece| open.push(piece));
        let (mut sum, mut treated) = (0.0, 0);
        while open.pop(part) {
            treated += 1;
            if treated > MAX_PARTS {
                sum += self.as_whole(part, up);
                continue;
            }
            match self.part(part, up, whole, sum, flattened) {
                PartFate::Done(lux) => sum += lux,
                PartFate::Halve(normal, height) => open.push_halves(part, normal, height),
            }
        }
        sum.max(0.0)
    }

    /// Intensity over distance squared, times cos, per area of the plane a part lies in: without the intensity, and
    /// that.
    #[inline]
    fn kernel(&self, to: DVec3, up: DVec3) -> (f64, f64) {
        let square = to.length_squared();
        let area = match &self.shape {
            SeenShape::Flat { area, .. } => *area,
            // The plane is at distance 1, and solid angle on it 1/d³; the area seen is for a vector of length d.
            SeenShape::Body(body) => body.projected_area(to),
        };
        let times = to.dot(up) / (square * square.sqrt() * area);
        if times.is_finite() { (times, self.flux * self.measured.at(-to)) } else { (0.0, 0.0) }
    }

    fn part(&self, part: &[DVec3], up: DVec3, whole: f64, sum: f64, flattened: &mut Vec<DVec3>) -> PartFate {
        let (corners, axes) = match &self.shape {
            SeenShape::Flat { axes, .. } => (part, *axes),
            SeenShape::Body(_) => {
                let count = part.len();
                let middle: DVec3 =
                    (0..count).map(|i| part[(i + 1) % count].normalize().cross(part[i].normalize())).sum();
                let Some(middle) = middle.try_normalize() else { return PartFate::Done(0.0) };
                let cosine = |corner: &DVec3| corner.dot(middle) / corner.length();
                let farthest = part.iter().min_by(|a, b| cosine(a).total_cmp(&cosine(b)));
                if let Some(farthest) = farthest.filter(|corner| cosine(corner) < NARROW) {
                    return PartFate::Halve(farthest - middle * middle.dot(*farthest), 0.0);
                }
                flattened.clear();
                flattened.extend(part.iter().map(|corner| corner / corner.dot(middle)));
                (flattened.as_slice(), middle.any_orthonormal_pair().into())
            }
        };
        let Some(PolygonMoments { area, centre, spread: [long, short] }) = PolygonMoments::of(corners, axes) else {
            return PartFate::Done(0.0);
        };
        let (times, candela) = self.kernel(centre, up);
        let by_centre = area * times * candela;
        let node = |offset: DVec3| {
            let (times, candela) = self.kernel(centre + offset, up);
            times * candela
        };
        let [a, b, c, d] = [node(long), node(-long), node(short), node(-short)];
        let by_nodes = 0.25 * area * (a + b + c + d);
        let lopsided = skewness(corners, centre, long) * fall(a, b) + skewness(corners, centre, short) * fall(c, d);
        let light = whole.max(sum + by_nodes.abs());
        let (radius, distance) = (std::f64::consts::SQRT_2 * long.length(), centre.length());
        let could_bring = self.most * area * times.abs();
        let wide = radius > 0.5 * distance || (radius > self.width * distance && could_bring > WIDE_BUT_WEAK * light);
        let difference = (by_nodes - by_centre).abs();
        let even = difference * difference <= DIFFERENCE * by_nodes.abs() * light
            && lopsided * by_nodes.abs() <= LOPSIDED * light;
        let settled = difference <= TOO_LITTLE * light || even;
        if !wide && settled {
            return PartFate::Done(by_nodes);
        }
        let across = long.normalize_or_zero();
        match &self.shape {
            SeenShape::Flat { .. } => PartFate::Halve(across, across.dot(centre)),
            // Through the point and the centroid, across the longer axis.
            SeenShape::Body(_) => {
                PartFate::Halve(across - centre * (across.dot(centre) / centre.length_squared()), 0.0)
            }
        }
    }

    /// A part as if it had one luminance, that towards the mean direction in which it is seen.
    fn as_whole(&self, part: &[DVec3], up: DVec3) -> f64 {
        let vector = DVec3::from([DVec3::X, DVec3::Y, DVec3::Z].map(|axis| lambert(part, axis)));
        let Some(direction) = vector.try_normalize() else { return 0.0 };
        (vector.dot(up) * self.luminance(-direction)).max(0.0)
    }

    /// Luminance towards a unit vector, cd/m².
    pub(super) fn luminance(&self, direction: DVec3) -> f64 {
        let area = match &self.shape {
            SeenShape::Flat { area, normal, .. } => area * normal.dot(direction).abs().max(FLATTEST),
            SeenShape::Body(body) => body.projected_area(direction),
        };
        self.flux * self.measured.at(direction) / area
    }

    /// Largest intensity towards points of a box from one that holds the luminaire, cd.
    pub(super) fn most(&self, shining: &AxisBox, points: &AxisBox) -> f64 {
        self.most.min(self.flux * most_towards(&self.measured, shining, points))
    }

    /// Intensity towards a direction, cd.
    pub(super) fn intensity(&self, direction: DVec3) -> f64 {
        self.flux * self.measured.at(direction)
    }
}

/// Largest intensity from points of one box towards points of another, cd/lm.
pub(super) fn most_towards(measured: &Measured, shining: &AxisBox, points: &AxisBox) -> f64 {
    let aim = measured.aim();
    let ([from_low, from_high], [to_low, to_high]) = (shining.along(aim), points.along(aim));
    let (low, high) = (to_low - from_high, to_high - from_low);
    let (near, far) = (shining.distance(points), shining.farthest(points));
    // A positive height has its largest cosine nearby, a negative one far off. 0/0 is anything.
    let cosine = |height: f64, distance: f64| (height / distance).clamp(-1.0, 1.0);
    let least = cosine(low, if low > 0.0 { far } else { near });
    let most = cosine(high, if high > 0.0 { near } else { far });
    let within = |cosine: f64, otherwise: f64| if cosine.is_nan() { otherwise } else { cosine };
    measured.web().most_between(within(least, -1.0) - 1e-6, within(most, 1.0) + 1e-6)
}

/// A skew polygon has third moments, which its four nodes don't have: how far its centroid is off its middle along an
/// axis, by length. Halved ellipses, whose third moment is about 0.2 of the second's root cubed, have 0.16.
fn skewness(corners: &[DVec3], centre: DVec3, axis: DVec3) -> f64 {
    let along = corners.iter().map(|corner| (*corner - centre).dot(axis));
    let [low, high] = along.fold([0.0_f64; 2], |[low, high], x| [low.min(x), high.max(x)]);
    if high > low { (high + low).abs() / (high - low) } else { 0.0 }
}

/// The share of light that its third derivative would bring to a part of skewness 1 if light fell exponentially from
/// one node to the other.
fn fall(a: f64, b: f64) -> f64 {
    let slope = (a - b) / (a + b);
    if slope.is_finite() { 0.125 * slope.abs().powi(3) } else { 0.0 }
}

/// A convex polygon's area, centroid, and the axes of its spread: centroid ± each are four nodes with its second
/// moments.
struct PolygonMoments {
    area: f64,
    centre: DVec3,
    /// The longer first.
    spread: [DVec3; 2],
}

impl PolygonMoments {
    /// Of a polygon in the plane of two axes at right angles; nothing if it has no area.
    fn of(corners: &[DVec3], [u, v]: [DVec3; 2]) -> Option<Self> {
        let &[first, second, ref rest @ ..] = corners else { return None };
        let at = |corner: DVec3| ((corner - first).dot(u), (corner - first).dot(v));
        // Twice the area, and moments about the first corner, triangle by triangle of the fan.
        let [mut double, mut sx, mut sy, mut sxx, mut sxy, mut syy] = [0.0; 6];
        let (mut ax, mut ay) = at(second);
        for &corner in rest {
            let (bx, by) = at(corner);
            let cross = ax * by - bx * ay;
            double += cross;
            sx += cross * (ax + bx);
            sy += cross * (ay + by);
            sxx += cross * (ax * ax + ax * bx + bx * bx);
            syy += cross * (ay * ay + ay * by + by * by);
            sxy += cross * (2.0 * (ax * ay + bx * by) + ax * by + bx * ay);
            (ax, ay) = (bx, by);
        }
        let per_area = 1.0 / double;
        if !per_area.is_finite() {
            return None;
        }
        let (x, y) = (sx * per_area / 3.0, sy * per_area / 3.0);
        let (xx, yy) = (sxx * per_area / 6.0 - x * x, syy * per_area / 6.0 - y * y);
        let xy = sxy * per_area / 12.0 - x * y;
        let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        let root = half.hypot(xy);
        // Direction of the larger eigenvalue, from whichever column cancels less.
        let (cos, sin) = if half >= 0.0 { (half + root, xy) } else { (xy, root - half) };
        let length = cos.hypot(sin);
        let (cos, sin) = if length > 0.0 { (cos / length, sin / length) } else { (1.0, 0.0) };
        let [long, short] = [mean + root, mean - root].map(|square| (2.0 * square.max(0.0)).sqrt());
        Some(Self {
            area: 0.5 * double.abs(),
            centre: first + u * x + v * y,
            spread: [(u * cos + v * sin) * long, (v * cos - u * sin) * short],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four nodes of a rectangle, a triangle and a skew quadrilateral give x², xy and y² exactly: against a fan of
    /// triangles with the rule of the sides' middles, which is exact for degree two.
    #[test]
    fn four_nodes_have_the_moments_of_their_polygon() {
        let plane = [DVec3::new(0.6, 0.8, 0.0), DVec3::new(0.0, 0.0, 1.0)];
        let at = |x: f64, y: f64| DVec3::new(3.0, -2.0, 1.0) + plane[0] * x + plane[1] * y;
        for corners in [
            vec![at(0.0, 0.0), at(2.0, 0.0), at(2.0, 0.5), at(0.0, 0.5)],
            vec![at(0.0, 0.0), at(1.0, 0.2), at(-0.3, 2.0)],
            vec![at(0.1, 0.1), at(0.4, -1.0), at(3.0, 2.0), at(0.0, 1.0)],
        ] {
            let PolygonMoments { area, centre, spread: [a, b] } = PolygonMoments::of(&corners, plane).expect("an area");
            let functions: [fn(DVec3) -> f64; 6] =
                [|_| 1.0, |p| p.x, |p| p.z, |p| p.x * p.x, |p| p.x * p.z, |p| p.z * p.z];
            for f in functions {
                let found = 0.25 * area * [a, -a, b, -b].map(|offset| f(centre + offset)).iter().sum::<f64>();
                let expected: f64 = (1..corners.len() - 1)
                    .map(|i| [corners[0], corners[i], corners[i + 1]])
                    .map(|[a, b, c]| {
                        let area = 0.5 * (b - a).cross(c - a).length();
                        area / 3.0 * (f((a + b) / 2.0) + f((b + c) / 2.0) + f((c + a) / 2.0))
                    })
                    .sum();
                assert!((found - expected).abs() < 1e-12 * expected.abs().max(1.0), "{found}, expected {expected}");
            }
            assert!(a.length() >= b.length() && a.dot(b).abs() < 1e-12);
        }
    }
}
