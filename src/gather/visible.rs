//! The visible polygon: what a point sees of its own plane. Rays in the plane end at walls, partitions and furniture.
//!
//! Inside the polygon of their ends photons can land; behind it they can't, or they are light of another place (the
//! next room, the other side of a partition). So the polygon is at once the area a density estimate may divide by (no
//! darkening along walls) and the gate for the photons it may count (no leaks through partitions).

use std::sync::LazyLock;

use glam::{DVec2, Vec2};

use super::receiver::Receiver;
use crate::embree::RayCaster;
use crate::photon_map::LANES;

/// Rays in the plane. They go to equally spaced points on a square about the eye, so that the sector of a photon is
/// found by one division.
pub const RAYS: usize = 4 * SIDE;
const SIDE: usize = 16;

/// Angles at which the kernel's integrals are taken within a sector that ends at an obstacle.
const STEPS: usize = 4;

/// How much farther the rays go than photons are searched for: a wall is met even by rays that run nearly along it.
const REACH: f32 = 4.0;

/// A ray that meets nothing within this many search radii leaves its sector open: the chord between the ends of two
/// rays comes nearer than both by less than 1 %, since sectors are at most 7.2° wide.
const OPEN_FROM: f32 = 1.01;

/// Least distance of an end, in search radii: sectors of no extent have no normal.
const NEAREST: f32 = 1e-6;

/// A plane is not fitted where its determinants are below these parts of what they would be in the open: it would turn
/// on the rounding of few photons.
const SINGULAR: f64 = 1e-3;
const NARROW: f64 = 1e-6;

/// Distance along each ray at which a point's view of its plane ends, m, or 4 search radii. `None`
/// where the search radius sees no end at all.
pub struct VisiblePolygon(Option<Box<[f32; RAYS]>>);

/// Integrals of kernel · {1, x, y, x², xy, y²} over the visible part of the unit disc.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct KernelMoments {
    /// ∫K.
    pub one: f64,
    /// ∫K x, ∫K y.
    pub first: [f64; 2],
    /// ∫K x², ∫K xy, ∫K y².
    pub second: [f64; 3],
}

impl KernelMoments {
    /// Adds the integral over a narrow sector about the unit vector `towards`, `width` wide, as far as `reach` ≤ 1.
    fn add_sector(&mut self, towards: DVec2, width: f64, reach: f64) {
        // ∫ (1 − r²) r^(m+1) dr from 0 to `reach`, m = 0, 1, 2.
        let (square, cube) = (reach * reach, reach * reach * reach);
        let zeroth = square * (1.0 / 2.0 - square / 4.0) * width;
        let first = cube * (1.0 / 3.0 - square / 5.0) * width;
        let second = square * square * (1.0 / 4.0 - square / 6.0) * width;
        self.one += zeroth;
        self.first[0] += first * towards.x;
        self.first[1] += first * towards.y;
        self.second[0] += second * towards.x * towards.x;
        self.second[1] += second * towards.x * towards.y;
        self.second[2] += second * towards.y * towards.y;
    }

    fn add(&mut self, other: &Self) {
        self.one += other.one;
        (0..2).for_each(|i| self.first[i] += other.first[i]);
        (0..3).for_each(|i| self.second[i] += other.second[i]);
    }

    /// First row of M⁻¹: what a photon at x counts, as a plane (c₀ + c₁ x + c₂ y). Where D is too narrow to fit a
    /// plane, that of the constant fit.
    pub(super) fn first_row_of_inverse(&self) -> [f64; 3] {
        let [mx, my] = self.first;
        let [mxx, mxy, myy] = self.second;
        let minor = mxx * myy - mxy * mxy;
        let det = self.one * minor - mx * (mx * myy - mxy * my) + my * (mx * mxy - mxx * my);
        if det <= SINGULAR * self.one * minor || minor <= NARROW * (mxx + myy).powi(2) {
            return self.constant_row();
        }
        [minor / det, (mxy * my - mx * myy) / det, (mx * mxy - mxx * my) / det]
    }

    /// The constant fit: 1/∫K.
    fn constant_row(&self) -> [f64; 3] {
        [if self.one > 1e-9 { 1.0 / self.one } else { 0.0 }, 0.0, 0.0]
    }
}

/// The Epanechnikov kernel 1 − r², for squared distance r² in units of the search radius.
#[inline]
pub fn kernel(radius_squared: f32) -> f32 {
    (1.0 - radius_squared).max(0.0)
}

/// Moments of the open disc: ∫K = π/2.
const OPEN: KernelMoments = {
    let pi = std::f64::consts::PI;
    KernelMoments { one: pi / 2.0, first: [0.0; 2], second: [pi / 12.0, 0.0, pi / 12.0] }
};

/// One sector between two rays: the ray it begins with, the angles of the quadrature, and its moments where it is open.
struct Sector {
    ray: Vec2,
    steps: [DVec2; STEPS],
    width: f64,
    open: KernelMoments,
}

static SECTORS: LazyLock<[Sector; RAYS]> = LazyLock::new(|| {
    std::array::from_fn(|sector| {
        let (from, to) = (ray(sector), ray((sector + 1) % RAYS));
        let (start, width) = (from.to_angle(), from.angle_to(to) / STEPS as f64);
        let steps = std::array::from_fn(|step| DVec2::from_angle(start + width * (step as f64 + 0.5)));
        let mut open = KernelMoments::default();
        steps.iter().for_each(|&towards| open.add_sector(towards, width, 1.0));
        Sector { ray: from.as_vec2(), steps, width, open }
    })
});

/// Unit vector of a ray, counter-clockwise from the corner (1, −1) of the square.
fn ray(index: usize) -> DVec2 {
    let t = -1.0 + 2.0 * (index % SIDE) as f64 / SIDE as f64;
    let corner = match index / SIDE {
        0 => DVec2::new(1.0, t),
        1 => DVec2::new(-t, 1.0),
        2 => DVec2::new(-1.0, -t),
        _ => DVec2::new(t, -1.0),
    };
    corner.normalize()
}

/// The sector that holds `offset`.
#[inline(always)]
fn sector_of(offset: Vec2) -> usize {
    // Without branches: vectors take both sides.
    let steep = offset.x.abs() < offset.y.abs();
    let (along, aside) = if steep { (offset.y, -offset.x) } else { (offset.x, offset.y) };
    let side = usize::from(steep) + 2 * usize::from(along <= 0.0);
    let step = ((aside / along + 1.0) * (SIDE as f32 / 2.0)) as i32;
    SIDE * side + step.clamp(0, SIDE as i32 - 1) as usize
}

impl VisiblePolygon {
    /// Casts rays around point `point` of the receiver, for photons within `radius` (m). Cost: [`RAYS`] rays.
    pub fn cast(receiver: &Receiver, point: usize, caster: &RayCaster, radius: f32) -> Self {
        let eye = receiver.position(point) + receiver.moved(point) + receiver.normal * receiver.tolerance;
        let far = REACH * radius;
        let distances = std::array::from_fn(|sector| {
            let towards = SECTORS[sector].ray;
            let direction = receiver.u * towards.x + receiver.v * towards.y;
            caster.closest_hit(eye, direction, far).map_or(far, |hit| hit.distance.max(NEAREST * radius))
        });
        Self::from_distances(distances, radius)
    }

    /// Of a point with nothing about it.
    pub fn open() -> Self {
        Self(None)
    }

    fn from_distances(distances: [f32; RAYS], radius: f32) -> Self {
        let open = distances.iter().all(|&distance| distance > OPEN_FROM * radius);
        Self((!open).then(|| Box::new(distances)))
    }

    /// What is seen within `radius` (m), at most the radius that [`Self::cast`] was given.
    pub fn view(&self, radius: f32) -> PlaneView {
        let Some(distances) = &self.0 else { return PlaneView(None) };
        let mut ends = [OPEN_END; RAYS];
        let mut open = true;
        for (sector, end) in ends.iter_mut().enumerate() {
            let next = (sector + 1) % RAYS;
            let (here, there) = (distances[sector] / radius, distances[next] / radius);
            if here.min(there) > OPEN_FROM {
                continue;
            }
            let (a, b) = (SECTORS[sector].ray * here, SECTORS[next].ray * there);
            let normal = -(b - a).perp();
            *end = (normal, normal.dot(a));
            open = false;
        }
        PlaneView((!open).then(|| Box::new(ends)))
    }
}

/// The end of a sector: seen is what has normal · offset ≤ the limit.
type SectorEnd = (Vec2, f32);
const OPEN_END: SectorEnd = (Vec2::ZERO, f32::INFINITY);

/// The visible part of the disc of one search radius, which is its unit of length. `None`: all of it.
pub struct PlaneView(Option<Box<[SectorEnd; RAYS]>>);

impl PlaneView {
    /// Which of some offsets from the point (plane coordinates, in search radii) are seen.
    #[inline(always)]
    pub fn sees(&self, x: &[f32; LANES], y: &[f32; LANES]) -> [bool; LANES] {
        let mut seen = [true; LANES];
        if let Some(ends) = &self.0 {
            for lane in 0..LANES {
                let offset = Vec2::new(x[lane], y[lane]);
                let (normal, limit) = ends[sector_of(offset) % RAYS];
                seen[lane] = normal.dot(offset) <= limit;
            }
        }
        seen
    }

    /// Integrals of the kernel over what is seen. Exact for straight walls but for the quadrature over angles, whose
    /// error is below 3·10⁻³ of ∫K (tested).
    pub fn moments(&self) -> KernelMoments {
        let Some(ends) = &self.0 else { return OPEN };
        let mut moments = KernelMoments::default();
        for (sector, (normal, limit)) in SECTORS.iter().zip(ends.iter()) {
            if limit.is_infinite() {
                moments.add(&sector.open);
                continue;
            }
            for &towards in &sector.steps {
                let slope = normal.as_dvec2().dot(towards);
                let reach = if slope > 0.0 { (f64::from(*limit) / slope).min(1.0) } else { 1.0 };
                moments.add_sector(towards, sector.width, reach);
            }
        }
        moments
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A straight wall at distance h from the point: ∫K over x < h is ∫ (4/3)(1 − x²)^(3/2) dx.
    #[test]
    fn moments_beside_a_wall_match_the_closed_form() {
        for h in [0.05_f64, 0.3, 0.7, 0.95] {
            let to_wall = |index: usize| (h / ray(index).x.max(1e-9)).min(f64::from(REACH)) as f32;
            let found = VisiblePolygon::from_distances(std::array::from_fn(to_wall), 1.0).view(1.0).moments();
            let (steps, mut expected) = (200_000, 0.0);
            for step in 0..steps {
                let x = -1.0 + (h + 1.0) * (f64::from(step) + 0.5) / f64::from(steps);
                expected += 4.0 / 3.0 * (1.0 - x * x).powf(1.5) * (h + 1.0) / f64::from(steps);
            }
            let off = found.one / expected - 1.0;
            assert!(off.abs() < 3e-3, "h = {h}: ∫K = {}, expected {expected}", found.one);
        }
    }

    /// With nothing in the way the quadrature gives the open disc's moments: π/2, 0, π/12.
    #[test]
    fn the_sectors_add_up_to_the_disc() {
        let mut whole = KernelMoments::default();
        SECTORS.iter().for_each(|sector| whole.add(&sector.open));
        assert!((whole.one - OPEN.one).abs() < 1e-9, "{whole:?}");
        assert!((whole.second[0] - OPEN.second[0]).abs() < 1e-3 && (whole.second[2] - OPEN.second[2]).abs() < 1e-3);
        assert!(whole.first[0].abs() < 1e-9 && whole.first[1].abs() < 1e-9 && whole.second[1].abs() < 1e-9);
    }

    /// Every direction lies between the ray its sector begins with and the next.
    #[test]
    fn a_direction_lies_in_its_sector() {
        for degrees in 0..3600 {
            let towards = Vec2::from_angle((f64::from(degrees) / 10.0 + 0.03).to_radians() as f32) * 0.37;
            let sector = sector_of(towards);
            let (from, to) = (ray(sector).as_vec2(), ray((sector + 1) % RAYS).as_vec2());
            assert!(from.perp_dot(towards) >= -1e-6 && towards.perp_dot(to) >= -1e-6, "{towards} in sector {sector}");
        }
    }
}
