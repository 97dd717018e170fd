//! Illuminance from the photons around a point.

use std::f64::consts::PI;

use glam::Vec2;

use super::surroundings::{Moments, Surroundings, View, kernel};
use crate::photon::flux::{accumulate, photometric};
use crate::photon_map::{NearestPhotons, PhotonMap};

/// An estimate and its variance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate<const C: usize> {
    /// E of each channel, lx.
    pub value: [f64; C],
    /// Variance of the photometric E, lx²: the photons' shot noise.
    pub variance: f64,
}

impl<const C: usize> Estimate<C> {
    /// No light.
    pub const DARK: Self = Self { value: [0.0; C], variance: 0.0 };
}

/// Photons of the first query, at least: so many make R₀ known to 1/√31 = 18 %.
const PROBE: usize = 32;

/// Limits of the search for photons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// k, photons asked for.
    pub nearest: usize,
    /// Largest search radius, m.
    pub radius: f32,
    /// Smallest disc the flux is spread over, m: coincident photons stay finite, as under a lux meter's head.
    pub floor: f32,
}

/// The paper's estimator as printed, equation 1: E = Σ φ / (π R²) over the k nearest photons within d.
///
/// Its errors are the paper's: k/(k − 1) too high since the farthest photon lies on the disc's rim; low within R of an
/// edge, high beside a wall whose photons fall into the sphere; light of both sides of a partition counted together.
/// Relative standard error 1/√(k − 2) in uniform light.
pub fn paper<T: NearestPhotons, const C: usize>(
    map: &PhotonMap<T, C>,
    at: [f32; 3],
    search: Search,
    scratch: &mut T::Scratch,
) -> Estimate<C> {
    let found = map.sum_nearest(at, search.nearest, search.radius, scratch);
    let full = found.count == search.nearest;
    let radius_squared = if full { found.radius_squared } else { search.radius * search.radius };
    let area = PI * f64::from(radius_squared.max(search.floor * search.floor));
    let value = found.flux.map(|flux| flux / area);
    let relative_variance = 1.0 / (found.count.max(3) - 2) as f64;
    Estimate { value, variance: photometric(value).powi(2) * relative_variance }
}

/// Local-linear estimate over the visible part of a disc that holds about k photons.
///
/// Fits E(x) ≈ a + b·x to the photons by least squares under the kernel K, over the region D that the point sees:
/// M (a, b) = Σᵢ K(xᵢ) (1, xᵢ) φᵢ with M = ∫_D K (1, x)(1, x)ᵀ; E = a. Where E is linear over D the estimate has no
/// bias, at walls and edges included; elsewhere it is about R²/12 · ∇²E. Standard error: √(4/3)/√k of E in the open, up
/// to about three times that in a corner. Cost: the queries, plus a few ns a photon.
///
/// The radius comes from the k₀ = k/16 nearest photons, R² = R₀² · k/k₀: trees find all within a radius several times
/// sooner than the k nearest. The k₀-th photon lies on the rim that chose R₀, not inside: it is left out, as García
/// Hernández et al. (2012) leave out the k-th, or the estimate would read 1/k high.
pub fn local_linear<T: NearestPhotons, const C: usize>(
    map: &PhotonMap<T, C>,
    at: [f32; 2],
    search: Search,
    surroundings: &Surroundings,
    scratch: &mut (T::Scratch, Vec<u32>),
) -> Estimate<C> {
    let (query, found) = scratch;
    let point = [at[0], at[1], 0.0];
    let probe = (search.nearest / 16).max(PROBE);
    let (mut count, mut rim, mut farthest) = (0, None, 0.0_f32);
    map.tree().visit_nearest(point, probe, search.radius, query, |photon, distance_squared| {
        count += 1;
        if distance_squared >= farthest {
            (rim, farthest) = (Some(photon as u32), distance_squared);
        }
    });
    let mut radius = search.radius;
    if count == probe {
        let wider = (search.nearest as f64 / probe as f64).sqrt().max(1.0) as f32;
        radius = (farthest.sqrt() * wider).clamp(search.floor, search.radius);
    } else {
        rim = None; // the radius was not any photon's choice
    }
    found.clear();
    map.tree().visit_within(point, radius, query, |photon, _| found.push(photon as u32));
    if radius > search.floor {
        found.retain(|&photon| Some(photon) != rim);
    }
    if found.is_empty() {
        return Estimate::DARK;
    }
    let view = surroundings.view(radius);
    let linear = sum(map, at, radius, &view, found, view.moments().first_row_of_inverse());
    if photometric(linear.value) >= 0.0 {
        return linear;
    }
    sum(map, at, radius, &view, found, view.moments().constant_row())
}

/// Σ φᵢ K(xᵢ) (c · (1, xᵢ)) / R² over the photons seen.
fn sum<T: NearestPhotons, const C: usize>(
    map: &PhotonMap<T, C>,
    at: [f32; 2],
    radius: f32,
    view: &View,
    found: &[u32],
    row: [f64; 3],
) -> Estimate<C> {
    let mut estimate = Estimate::DARK;
    let per_radius = 1.0 / radius;
    let per_area = f64::from(per_radius * per_radius);
    for &photon in found {
        let [x, y, _] = map.position(photon as usize);
        let near = Vec2::new(x - at[0], y - at[1]) * per_radius;
        if !view.sees(near) {
            continue;
        }
        let plane = row[0] + row[1] * f64::from(near.x) + row[2] * f64::from(near.y);
        let weight = f64::from(kernel(near.length_squared())) * plane * per_area;
        let flux = map.flux(photon as usize);
        accumulate(&mut estimate.value, flux, weight);
        estimate.variance += (photometric(flux.0.map(f64::from)) * weight).powi(2);
    }
    estimate
}

impl Moments {
    /// First row of M⁻¹: what a photon at x counts, as a plane (c₀ + c₁ x + c₂ y). Where D is too narrow to fit a plane,
    /// that of the constant fit.
    fn first_row_of_inverse(&self) -> [f64; 3] {
        let [mx, my] = self.first;
        let [mxx, mxy, myy] = self.second;
        let minor = mxx * myy - mxy * mxy;
        let det = self.one * minor - mx * (mx * myy - mxy * my) + my * (mx * mxy - mxx * my);
        if det <= 1e-3 * self.one * minor || minor <= 1e-6 * (mxx + myy).powi(2) {
            return self.constant_row();
        }
        [minor / det, (mxy * my - mx * myy) / det, (mx * mxy - mxx * my) / det]
    }

    /// The constant fit: 1/∫K.
    fn constant_row(&self) -> [f64; 3] {
        [if self.one > 1e-9 { 1.0 / self.one } else { 0.0 }, 0.0, 0.0]
    }
}
