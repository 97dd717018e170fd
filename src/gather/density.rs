//! Illuminance from the photons around a point.

use std::f64::consts::PI;
use std::io;

use super::visible::{PlaneView, VisiblePolygon, kernel};
use crate::flux::photometric;
use crate::photon_map::{BlockVisitor, LANES, MARKED, NearestPhotons, PhotonBlock, PhotonMap};
use crate::state::Sum;
use crate::state::tape::Tape;

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

    /// Adds an independent estimate.
    pub fn add(&mut self, other: &Self) {
        self.value.iter_mut().zip(other.value).for_each(|(sum, value)| *sum += value);
        self.variance += other.variance;
    }
}

/// Sum of independent estimates.
#[derive(Clone, Copy, Debug)]
pub struct EstimateSum<const C: usize> {
    value: [Sum; C],
    variance: Sum,
}

impl<const C: usize> EstimateSum<C> {
    /// None yet.
    pub const NONE: Self = Self { value: [Sum::ZERO; C], variance: Sum::ZERO };

    /// Adds an estimate.
    pub fn add(&mut self, estimate: &Estimate<C>) {
        self.value.iter_mut().zip(estimate.value).for_each(|(sum, value)| sum.add(value));
        self.variance.add(estimate.variance);
    }

    /// Mean of `count` estimates.
    pub fn mean(&self, count: f64) -> Estimate<C> {
        let value = self.value.map(|sum| sum.value() / count);
        Estimate { value, variance: self.variance.value() / (count * count) }
    }

    /// Writes its sums to `tape`, or reads them from it.
    pub fn exchange(&mut self, tape: &mut Tape<'_>) -> io::Result<()> {
        self.value.iter_mut().chain([&mut self.variance]).try_for_each(|sum| tape.sum(sum))
    }
}

/// Photons of the first query, at least: so many make R₀ known to 1/√31 = 18 %.
const PROBE: usize = 32;

/// Limits of the search for photons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchLimits {
    /// k, photons to be found.
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
    search: SearchLimits,
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
    search: SearchLimits,
    visible: &VisiblePolygon,
    scratch: &mut T::Scratch,
) -> Estimate<C> {
    local_linear_in_groups(map, at, search, visible, scratch, None)
}

/// What each light group adds to an estimate: rows of sums over the photons marked with its number.
pub struct GroupSums<'a> {
    /// E, lx: channel by channel, group by group.
    pub lux: &'a mut [f64],
    /// Variance of the photometric E, lx², group by group; empty where it is not wanted.
    pub variance: &'a mut [f64],
}

/// The same, and the share of each light group in it, if wanted: the same sum over the group's photons alone, so
/// that shares add up to the whole. A share may be below 0, as the sum gives some photons negative weights.
pub fn local_linear_in_groups<T: NearestPhotons, const C: usize>(
    map: &PhotonMap<T, C>,
    at: [f32; 2],
    search: SearchLimits,
    visible: &VisiblePolygon,
    scratch: &mut T::Scratch,
    groups: Option<GroupSums<'_>>,
) -> Estimate<C> {
    let point = [at[0], at[1], 0.0];
    let probe = (search.nearest / 16).max(PROBE);
    let found = map.sum_nearest(point, probe, search.radius, scratch);
    let (mut radius, mut rim) = (search.radius, None);
    if found.count == probe {
        let wider = (search.nearest as f64 / probe as f64).sqrt().max(1.0) as f32;
        radius = (found.radius_squared.sqrt() * wider).clamp(search.floor, search.radius);
        rim = (radius > search.floor).then_some(found.radius_squared);
    }
    if found.count == 0 {
        return Estimate::DARK;
    }
    sum_within(map, at, (radius, rim), visible, scratch, groups)
}

/// Radii of discs that stand side by side, each half of the one before.
pub const LADDER: usize = 8;

/// Local-linear estimate over the visible part of a disc of a given radius (m).
///
/// What a photon counts depends on its place alone, so estimates of many photon maps add up without bias wherever E is
/// linear over the disc, and their noise falls as 1/√(maps).
pub fn local_linear_within<T: NearestPhotons, const C: usize>(
    map: &PhotonMap<T, C>,
    at: [f32; 2],
    radius: f32,
    visible: &VisiblePolygon,
    scratch: &mut T::Scratch,
    groups: Option<GroupSums<'_>>,
) -> Estimate<C> {
    sum_within(map, at, (radius, None), visible, scratch, groups)
}

/// The sum over a disc, but for a photon on its probe's `rim`. It may be below 0 where light is far from linear; a
/// bound here would lift the mean of many such sums.
fn sum_within<T: NearestPhotons, const C: usize>(
    map: &PhotonMap<T, C>,
    at: [f32; 2],
    (radius, rim): (f32, Option<f32>),
    visible: &VisiblePolygon,
    scratch: &mut T::Scratch,
    groups: Option<GroupSums<'_>>,
) -> Estimate<C> {
    let point = [at[0], at[1], 0.0];
    let view = visible.view(radius);
    let row = view.moments().first_row_of_inverse();
    let mut sum = DensitySum::new(&view, row, radius, rim);
    map.visit_blocks(point, radius, scratch, &mut sum);
    if let Some(groups) = groups {
        let sum = DensitySum::<C>::new(&view, row, radius, rim);
        map.visit_marked(point, radius, scratch, &mut SumInGroups { sum, groups });
    }
    sum.estimate()
}

/// Σ φᵢ K(xᵢ) (c · (1, xᵢ)) / R² over the photons seen, but for one whose squared distance is `rim`.
struct DensitySum<'a, const C: usize> {
    view: &'a PlaneView,
    row: [f64; 3],
    rim: Option<f32>,
    per_radius: f32,
    per_area: f64,
    values: [[f64; LANES]; C],
    squares: [f64; LANES],
}

impl<'a, const C: usize> DensitySum<'a, C> {
    fn new(view: &'a PlaneView, row: [f64; 3], radius: f32, rim: Option<f32>) -> Self {
        let per_radius = 1.0 / radius;
        let per_area = f64::from(per_radius * per_radius);
        Self { view, row, rim, per_radius, per_area, values: [[0.0; LANES]; C], squares: [0.0; LANES] }
    }

    fn estimate(&self) -> Estimate<C> {
        Estimate { value: self.values.map(|lanes| lanes.iter().sum()), variance: self.squares.iter().sum() }
    }
}

impl<const C: usize> DensitySum<'_, C> {
    /// What each photon of a block counts.
    #[inline(always)]
    fn weights<const D: usize>(&mut self, block: &PhotonBlock<'_, D>) -> [f64; LANES] {
        let (mut x, mut y, mut weight) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            (x[lane], y[lane]) = (block.offset[0][lane] * self.per_radius, block.offset[1][lane] * self.per_radius);
        }
        let seen = self.view.sees(&x, &y);
        for lane in 0..LANES {
            let plane = self.row[0] + self.row[1] * f64::from(x[lane]) + self.row[2] * f64::from(y[lane]);
            let near = x[lane] * x[lane] + y[lane] * y[lane];
            let counts = seen[lane] & (near < 1.0);
            weight[lane] = if counts { f64::from(kernel(near)) * plane * self.per_area } else { 0.0 };
        }
        if let Some(rim) = self.rim
            && let Some(lane) = block.distance_squared.iter().position(|&distance| distance == rim)
        {
            (weight[lane], self.rim) = (0.0, None);
        }
        weight
    }
}

impl<const C: usize> BlockVisitor<C> for DensitySum<'_, C> {
    #[inline(always)]
    fn visit(&mut self, block: &PhotonBlock<'_, C>) {
        let weight = self.weights(block);
        let mut photometric_flux = [0.0; LANES];
        for lane in 0..LANES {
            let mut flux = [0.0; C];
            for ((flux, lanes), sum) in flux.iter_mut().zip(block.flux).zip(&mut self.values) {
                *flux = f64::from(lanes[lane]);
                sum[lane] += *flux * weight[lane];
            }
            photometric_flux[lane] = photometric(flux);
        }
        for lane in 0..LANES {
            let part = photometric_flux[lane] * weight[lane];
            self.squares[lane] += part * part;
        }
    }
}

/// The same sum, apart for each light group.
struct SumInGroups<'a, const C: usize> {
    sum: DensitySum<'a, C>,
    groups: GroupSums<'a>,
}

impl<const C: usize> BlockVisitor<MARKED> for SumInGroups<'_, C> {
    #[inline(always)]
    fn visit(&mut self, block: &PhotonBlock<'_, MARKED>) {
        let weight = self.sum.weights(block);
        for lane in (0..LANES).filter(|&lane| weight[lane] != 0.0) {
            let group = block.flux[MARKED - 1][lane] as usize;
            let part: [f64; C] = std::array::from_fn(|c| f64::from(block.flux[c][lane]) * weight[lane]);
            self.groups.lux[group * C..][..C].iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
            if let Some(variance) = self.groups.variance.get_mut(group) {
                *variance += photometric(part).powi(2);
            }
        }
    }
}
