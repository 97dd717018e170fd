//! Light that came by mirrors and glass, at the surfaces where it lands: rays from there do not find its luminaire, so
//! it is taken from the density of the photons.

use glam::Vec3;

use crate::embree::RayCaster;
use crate::flux::Flux;
use crate::gather::density::SearchLimits;
use crate::photon::trace::{Flight, History, Recorder};
use crate::photon_map::{self, KdTree, NearestPhotons};
use crate::random::Stream;

/// Rays in the surface about a point that find the walls around it, one for each sector.
const SECTORS: usize = 16;
/// Photons farther off the point's plane than this part of the search radius lie on another surface.
const THICKNESS: f32 = 0.1;
/// Photons whose surface is turned from the point's by more than 45° count as another's.
const ALIKE: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// Photons that landed by way of mirrors and glass only.
#[derive(Clone, Debug)]
pub struct Caustics<const C: usize> {
    positions: Vec<[f32; 3]>,
    landed: Vec<Landed<C>>,
}

/// What a photon brought, the unit normal of the side on which it landed, and the number of its luminaire.
#[derive(Clone, Copy, Debug)]
struct Landed<const C: usize> {
    flux: Flux<C>,
    normal: Vec3,
    luminaire: u32,
}

impl<const C: usize> Default for Caustics<C> {
    fn default() -> Self {
        Self { positions: Vec::new(), landed: Vec::new() }
    }
}

impl<const C: usize> Caustics<C> {
    /// Number of photons.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// One record out of many, in order.
    pub fn merge(records: impl IntoIterator<Item = Self>) -> Self {
        let mut merged = Self::default();
        for mut record in records {
            merged.positions.append(&mut record.positions);
            merged.landed.append(&mut record.landed);
        }
        merged
    }
}

impl<const C: usize> Recorder<C> for Caustics<C> {
    #[inline]
    fn record(&mut self, flight: &Flight<'_>, flux: Flux<C>) {
        if let (Some(hit), true, History::Specular) = (flight.hit, flight.lands, flight.history)
            && hit.position.is_finite()
        {
            let normal = if flight.direction.dot(hit.normal) < 0.0 { hit.normal } else { -hit.normal };
            self.positions.push(hit.position.to_array());
            self.landed.push(Landed { flux, normal, luminaire: flight.luminaire });
        }
    }
}

/// Caustic photons in a tree, ready for density estimates.
pub struct CausticMap<const C: usize> {
    tree: KdTree,
    photons: Caustics<C>,
    search: SearchLimits,
}

/// Memory a thread reuses from query to query.
pub struct CausticScratch {
    tree: photon_map::Scratch,
    found: Vec<(u32, f32)>,
}

impl<const C: usize> CausticMap<C> {
    /// Builds the tree over one set of photons.
    pub fn build(photons: Caustics<C>, search: SearchLimits) -> Self {
        Self { tree: KdTree::build(&photons.positions), photons, search }
    }

    /// Fresh memory for queries.
    pub fn scratch(&self) -> CausticScratch {
        CausticScratch { tree: self.tree.scratch(), found: Vec::new() }
    }

    /// Illuminance (lx) that the photons bring to the side `normal` (unit) of a surface at `at` (m), `above` being the
    /// same point just off the surface.
    ///
    /// E = Σ φᵢ K(dᵢ/R) / (R² ∫K) over the k nearest, K(t) = 2 (1 − t²)/π: the k-th lies on the rim and counts nothing,
    /// so no factor k/(k − 1) is left. ∫K is taken over the part of the disc that walls leave, and photons behind them,
    /// on the other side, or on a surface turned away do not count. Error: √(4/3)/√k of E in even light; blurred over
    /// R; dark by up to a half within R of a free edge of a surface, behind which nothing stands. Cost: 0.2 µs far from
    /// any caustic, some µs within one.
    pub fn illuminance(
        &self,
        at: Vec3,
        above: Vec3,
        normal: Vec3,
        caster: &RayCaster,
        stream: &mut Stream,
        scratch: &mut CausticScratch,
    ) -> [f64; C] {
        let mut sum = [0.0; C];
        self.each(at, above, normal, (caster, stream), scratch, |_, lux| (0..C).for_each(|c| sum[c] += lux[c]));
        sum
    }

    /// The same, photon by photon: `meet` is called with the number of its luminaire and what it brings, lx.
    pub fn each(
        &self,
        at: Vec3,
        above: Vec3,
        normal: Vec3,
        (caster, stream): (&RayCaster, &mut Stream),
        scratch: &mut CausticScratch,
        mut meet: impl FnMut(u32, [f64; C]),
    ) {
        let CausticScratch { tree, found } = scratch;
        found.clear();
        let SearchLimits { nearest, radius, floor } = self.search;
        let mut farthest = 0.0_f32;
        self.tree.visit_nearest(at.to_array(), nearest, radius, tree, |photon, distance_squared| {
            farthest = farthest.max(distance_squared);
            found.push((photon as u32, distance_squared));
        });
        let radius = if found.len() == nearest { farthest.sqrt().max(floor) } else { radius };
        let thickness = THICKNESS * radius;
        found.retain(|&(photon, _)| {
            let photon = photon as usize;
            let offset = Vec3::from(self.photons.positions[photon]) - at;
            self.photons.landed[photon].normal.dot(normal) > ALIKE && offset.dot(normal).abs() <= thickness
        });
        if found.is_empty() {
            return;
        }
        let sectors = OpenSectors::cast(above, normal, radius, caster, stream);
        let area = std::f64::consts::PI * f64::from(radius * radius);
        let per_share = 2.0 / (area * sectors.open);
        for &(photon, distance_squared) in found.iter() {
            let offset = Vec3::from(self.photons.positions[photon as usize]) - at;
            let share = f64::from(1.0 - distance_squared / (radius * radius));
            if share > 0.0 && sectors.sees(offset) {
                let Landed { flux, luminaire, .. } = self.photons.landed[photon as usize];
                meet(luminaire, flux.0.map(|flux| share * per_share * f64::from(flux)));
            }
        }
    }
}

/// How far a point sees in its plane, in sectors.
struct OpenSectors {
    axes: [Vec3; 2],
    /// Where the first sector begins, in turns.
    start: f32,
    /// Squared distance of what stands in each sector, m²; infinite where nothing does.
    squared: [f32; SECTORS],
    /// ∫K over what is open of the disc: 1 in the open.
    open: f64,
}

impl OpenSectors {
    fn cast(from: Vec3, normal: Vec3, radius: f32, caster: &RayCaster, stream: &mut Stream) -> Self {
        let (x, y) = normal.any_orthonormal_pair();
        let mut sectors = Self { axes: [x, y], start: stream.uniform(), squared: [f32::INFINITY; SECTORS], open: 0.0 };
        for sector in 0..SECTORS {
            let angle = std::f32::consts::TAU * (sectors.start + (sector as f32 + 0.5) / SECTORS as f32);
            let direction = x * angle.cos() + y * angle.sin();
            let mut share = 1.0;
            if let Some(hit) = caster.closest_hit(from, direction, radius) {
                sectors.squared[sector] = hit.distance * hit.distance;
                share = f64::from(hit.distance / radius).min(1.0).powi(2);
            }
            // ∫K over a sector up to s: (2 s² − s⁴) / SECTORS.
            sectors.open += share * (2.0 - share) / SECTORS as f64;
        }
        // A point in a crack sees nothing around it; its photons came through the crack.
        sectors.open = sectors.open.max(1.0 / SECTORS as f64);
        sectors
    }

    fn sees(&self, offset: Vec3) -> bool {
        let [x, y] = self.axes.map(|axis| offset.dot(axis));
        let turn = (y.atan2(x) / std::f32::consts::TAU - self.start).rem_euclid(1.0);
        let sector = ((turn * SECTORS as f32) as usize).min(SECTORS - 1);
        x * x + y * y <= self.squared[sector]
    }
}
