//! Shadow rays, where too many triangles are in the way of an opening to cut each shadow out of it, or it matters too
//! little.

use glam::{DVec3, Vec3};

use super::emitter::{BodySource, OpeningLight, Polygon, grey};
use crate::embree::RayCaster;
use crate::random::Stream;

/// Strata along each side of an opening: of a first set with one ray each, and of a second with two each where the
/// first saw some of it, not all.
const FIRST: u32 = 4;
const SECOND: u32 = 8;

/// What shadow rays saw of an opening.
pub(super) struct VisibleShare {
    /// Share of its red, green and blue light that arrives, and the variance of the photometric share.
    pub(super) share: [f64; 3],
    pub(super) variance: f64,
    pub(super) rays: u64,
}

/// The most that the variance of one ray's yes or no can be: a share p seen has p (1 − p).
pub(super) const GLIMPSE: f64 = 0.25;

/// Where rays to an opening end.
pub(super) enum Target<'a> {
    /// On a flat opening.
    Flat(&'a Polygon),
    /// On a body, which has an outline as seen from the point; towards unit vectors that are its corners and its
    /// middle.
    Body { source: &'a BodySource, corners: Vec<DVec3>, middle: DVec3, shares: Vec<f64> },
}

/// A ray to an opening.
pub(super) struct OpeningRay {
    pub(super) direction: Vec3,
    pub(super) distance: f32,
    /// What the opening brings from there: of a Lambertian flat one per unit of luminance and area, of a measured flat
    /// one in lx if all of it shone from there, else in any unit.
    pub(super) weight: f64,
}

impl<'a> Target<'a> {
    /// A body, by its outline relative to the point.
    pub(super) fn body(source: &'a BodySource, outline: &[DVec3]) -> Self {
        let corners: Vec<DVec3> = outline.iter().map(|corner| corner.normalize_or_zero()).collect();
        let middle = corners.iter().sum::<DVec3>().normalize_or_zero();
        let shares = (0..corners.len()).scan(0.0, |sum, i| {
            *sum += (corners[i] - middle).cross(corners[(i + 1) % corners.len()] - middle).length();
            Some(*sum)
        });
        Self::Body { source, shares: shares.collect(), corners, middle }
    }

    /// A ray from `start`, whose surface has the unit normal `normal`, to a point of the opening: equal areas of the
    /// unit square for equal areas of it, or of the triangles from the middle of an outline to its corners.
    pub(super) fn aim(&self, at: [f32; 2], start: Vec3, normal: Vec3, caster: &RayCaster) -> OpeningRay {
        match self {
            Self::Flat(polygon) => {
                let (target, facing) = polygon.front.point_off(0.0, at, start, caster);
                let to = target - start;
                let distance = to.length();
                let direction = to / distance;
                let weight = match &polygon.light {
                    OpeningLight::Lambertian(_) => {
                        let weight = direction.dot(normal).max(0.0) * (-direction.dot(facing)).max(0.0);
                        f64::from(weight / (distance * distance))
                    }
                    OpeningLight::Web(web) => {
                        let weight = direction.dot(normal).max(0.0) / (distance * distance);
                        f64::from(weight) * web.intensity(-direction.as_dvec3())
                    }
                };
                OpeningRay { direction, distance, weight }
            }
            Self::Body { source, corners, middle, shares } => {
                let whole = shares.last().copied().unwrap_or(0.0);
                let [choice, v] = at.map(f64::from);
                let i = shares.partition_point(|&share| share <= choice * whole).min(corners.len() - 1);
                let before = if i == 0 { 0.0 } else { shares[i - 1] };
                let root = ((choice * whole - before) / (shares[i] - before)).clamp(0.0, 1.0).sqrt();
                let (a, b) = (corners[i] - middle, corners[(i + 1) % corners.len()] - middle);
                let to = *middle + a * (root * (1.0 - v)) + b * (root * v);
                let direction = to.normalize_or_zero();
                // As far as the body's surface, or through it where the outline is a little larger.
                let eye = start.as_dvec3();
                let reach = (source.body.centre - eye).length() + source.body.radius();
                let distance = source.body.entry(eye, direction).unwrap_or(reach);
                let luminance = match &source.light {
                    OpeningLight::Lambertian(luminance) => *luminance,
                    OpeningLight::Web(web) => web.luminance(-direction),
                };
                let solid_angle = a.cross(b).normalize_or_zero().dot(direction).abs() / to.length_squared();
                let weight = luminance * direction.dot(normal.as_dvec3()).max(0.0) * solid_angle;
                OpeningRay { direction: direction.as_vec3(), distance: distance as f32, weight }
            }
        }
    }

    /// Share of the light (red, green, blue) along a ray that passes what is in the way: panes, and the body itself,
    /// which is not quite the solid it stands for.
    fn passed(&self, ray: &OpeningRay, start: Vec3, caster: &RayCaster) -> [f64; 3] {
        let passed = match self {
            Self::Flat(_) => caster.transmittance(start, ray.direction, ray.distance),
            Self::Body { source, .. } => match caster.through_panes(start, ray.direction, ray.distance) {
                (Some(hit), _) if !source.own.contains(&hit.triangle) => [0.0; 3],
                (_, passed) => passed,
            },
        };
        passed.map(f64::from)
    }
}

/// An estimate by one ray to any point of an opening.
pub(super) fn glimpse(
    target: &Target<'_>,
    start: Vec3,
    normal: Vec3,
    caster: &RayCaster,
    stream: &mut Stream,
) -> VisibleShare {
    let ray = target.aim(stream.uniform_pair(), start, normal, caster);
    VisibleShare { share: target.passed(&ray, start, caster), variance: GLIMPSE, rays: 1 }
}

/// An estimate by rays to strata of an opening.
///
/// Two rays in each stratum give its variance without bias. Where the first set saw all of it or nothing, one stratum
/// of n may still hold a part q of another kind that its ray met with probability q only: (1 − q) q² ≤ 4/27 of its
/// square.
pub(super) fn stratified(
    target: &Target<'_>,
    start: Vec3,
    normal: Vec3,
    caster: &RayCaster,
    stream: &mut Stream,
) -> VisibleShare {
    let mut rays = 0;
    // Weight of a ray, and what of it gets through.
    let mut cast = |stratum: u32, side: u32| {
        let [a, b] = stream.uniform_pair();
        let at = [(stratum % side) as f32 + a, (stratum / side) as f32 + b].map(|x| x / side as f32);
        let ray = target.aim(at, start, normal, caster);
        if !(ray.weight > 0.0 && ray.weight.is_finite()) {
            return (0.0, [0.0; 3]);
        }
        rays += 1;
        (ray.weight, target.passed(&ray, start, caster))
    };
    // A sliver above the horizon that no ray met: anything is possible.
    let anything = |rays| VisibleShare { share: [0.5; 3], variance: 0.25, rays };
    let first: Vec<(f64, [f64; 3])> = (0..FIRST * FIRST).map(|stratum| cast(stratum, FIRST)).collect();
    let (whole, clear) = totals(&first);
    if whole <= 0.0 {
        return anything(rays);
    }
    if clear == [0.0; 3] || clear == [whole; 3] {
        let strata = f64::from(FIRST * FIRST);
        let share = clear.map(|clear| clear / whole);
        return VisibleShare { share, variance: 4.0 / 27.0 / (strata * strata), rays };
    }
    let pairs: Vec<[(f64, [f64; 3]); 2]> =
        (0..SECOND * SECOND).map(|stratum| [cast(stratum, SECOND), cast(stratum, SECOND)]).collect();
    let (whole, clear) = totals(pairs.as_flattened());
    if whole <= 0.0 {
        return anything(rays);
    }
    let share = clear.map(|clear| clear / whole);
    let off = |(weight, seen): (f64, [f64; 3])| weight * (grey(seen) - grey(share));
    let squares: f64 = pairs.iter().map(|&[a, b]| (off(a) - off(b)).powi(2)).sum();
    let strata = f64::from(SECOND * SECOND);
    VisibleShare { share, variance: (squares / (whole * whole)).max(1.0 / 16.0 / (strata * strata)), rays }
}

/// Sum of the rays' weights, and of what gets through.
fn totals(rays: &[(f64, [f64; 3])]) -> (f64, [f64; 3]) {
    rays.iter().fold((0.0, [0.0; 3]), |(whole, clear), (weight, seen)| {
        (whole + weight, [0, 1, 2].map(|c| clear[c] + weight * seen[c]))
    })
}
