//! Shadow rays, where too many triangles are in the way of an opening to cut each shadow out of it, or it matters too little.

use glam::Vec3;

use crate::embree::RayCaster;
use crate::luminaire::emit::Front;
use crate::photon::random::Stream;

/// Strata along each side of an opening: of a first look with one ray each, and of a second with two each where the first
/// saw a mixture.
const FIRST: u32 = 4;
const SECOND: u32 = 8;
/// Strata of an emitting mesh for each point; two samples in each.
pub(super) const MESH_STRATA: u32 = 64;

/// What shadow rays saw of an opening.
pub(super) struct Seen {
    /// Visible share of its light, and the variance of that.
    pub(super) share: f64,
    pub(super) variance: f64,
    pub(super) rays: u64,
}

/// The most that the variance of one ray's yes or no can be: a share p seen has p (1 − p).
pub(super) const GLIMPSE: f64 = 0.25;

/// What one ray to anywhere on an opening tells of it.
pub(super) fn glimpse(front: &Front, start: Vec3, caster: &RayCaster, stream: &mut Stream) -> Seen {
    let (target, _) = front.point_off(0.0, stream.uniform_pair(), start, caster);
    let to = target - start;
    let distance = to.length();
    let share = if caster.is_occluded(start, to / distance, distance) { 0.0 } else { 1.0 };
    Seen { share, variance: GLIMPSE, rays: 1 }
}

/// What is visible of an opening.
///
/// Two rays in each stratum tell its variance without bias. Where a first look saw all of it or nothing, one stratum of n
/// may still hold a part q of another kind that its ray met with probability q only: (1 − q) q² ≤ 4/27 of its square.
pub(super) fn look(front: &Front, start: Vec3, normal: Vec3, caster: &RayCaster, stream: &mut Stream) -> Seen {
    let mut rays = 0;
    // Weight of a ray, and whether it gets through.
    let mut cast = |stratum: u32, side: u32| {
        let [a, b] = stream.uniform_pair();
        let at = [(stratum % side) as f32 + a, (stratum / side) as f32 + b].map(|x| x / side as f32);
        let (target, facing) = front.point_off(0.0, at, start, caster);
        let to = target - start;
        let distance = to.length();
        let direction = to / distance;
        let weight = direction.dot(normal).max(0.0) * (-direction.dot(facing)).max(0.0) / (distance * distance);
        if !(weight > 0.0 && weight.is_finite()) {
            return (0.0, 0.0);
        }
        rays += 1;
        (f64::from(weight), if caster.is_occluded(start, direction, distance) { 0.0 } else { 1.0 })
    };
    let (mut whole, mut clear) = (0.0, 0.0);
    for stratum in 0..FIRST * FIRST {
        let (weight, seen) = cast(stratum, FIRST);
        whole += weight;
        clear += weight * seen;
    }
    if whole <= 0.0 {
        // A sliver above the horizon that no ray met: anything is possible.
        return Seen { share: 0.5, variance: 0.25, rays };
    }
    if clear == 0.0 || clear == whole {
        let strata = f64::from(FIRST * FIRST);
        return Seen { share: clear / whole, variance: 4.0 / 27.0 / (strata * strata), rays };
    }
    let pairs: Vec<[(f64, f64); 2]> =
        (0..SECOND * SECOND).map(|stratum| [cast(stratum, SECOND), cast(stratum, SECOND)]).collect();
    let whole: f64 = pairs.iter().flatten().map(|(weight, _)| weight).sum();
    let clear: f64 = pairs.iter().flatten().map(|(weight, seen)| weight * seen).sum();
    if whole <= 0.0 {
        return Seen { share: 0.5, variance: 0.25, rays };
    }
    let share = clear / whole;
    let off = |(weight, seen): (f64, f64)| weight * (seen - share);
    let squares: f64 = pairs.iter().map(|&[a, b]| (off(a) - off(b)).powi(2)).sum();
    let strata = f64::from(SECOND * SECOND);
    Seen { share, variance: (squares / (whole * whole)).max(1.0 / 16.0 / (strata * strata)), rays }
}
