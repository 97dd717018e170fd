//! The parts of the light that passes find at a receiver, and the search limits of densities.

use super::composition::Density;
use super::settings::{SENSOR_RAYS, Settings};
use super::{PURPOSE_SIGHT, Rendering};
use crate::embree::RayCaster;
use crate::gather::density::SearchLimits;
use crate::gather::parts::counted::CountedLight;
use crate::gather::parts::density::{Discs, PaperDensity, SmoothDensity};
use crate::gather::parts::{LightPart, Site, rays};
use crate::random::Seed;

/// What parts of the light are made from at a receiver.
pub(super) struct MadeFrom<'r, 'a, const C: usize> {
    pub(super) run: &'r Rendering<'a, C>,
    /// Number of the receiver.
    pub(super) index: usize,
    /// Areas of its points where photons are counted there, m².
    pub(super) counted: Option<Vec<f64>>,
    pub(super) caster: &'r RayCaster,
}

/// The parts of the light that passes find at a receiver. A new part has its line here.
pub(super) fn parts<const C: usize>(
    site: &Site,
    in_groups: bool,
    made_from: MadeFrom<'_, '_, C>,
) -> Vec<Box<dyn LightPart<C>>> {
    let MadeFrom { run, index, counted, caster } = made_from;
    let (composition, settings, searches) = (&run.composition, run.settings, &run.searches);
    let receiver = &site.receiver;
    let (points, is_plane) = (receiver.len(), receiver.is_plane());
    let groups = run.groups.as_ref().filter(|_| in_groups);
    // Variances of groups are kept of single points only.
    let with_variances = groups.map(|groups| (groups, if receiver.grid.is_some() { 0 } else { groups.len() }));

    let mut parts: Vec<Box<dyn LightPart<C>>> = Vec::new();
    if composition.rays.is_some() {
        let seed = Seed(settings.seed).branch(PURPOSE_SIGHT).branch(index as u64);
        let times = if receiver.grid.is_some() { 1 } else { u64::from(SENSOR_RAYS) };
        let witness = run.witness(site, caster);
        parts.push(Box::new(rays::RayLight::new(receiver, seed, times, settings.smooth, witness, groups)));
    }
    if let Some(areas) = counted {
        parts.push(Box::new(CountedLight::new(areas, groups.map_or(0, |groups| groups.width::<C>()))));
    }
    if composition.counts_sharp && is_plane && !receiver.cells_count {
        let SearchLimits { radius, floor, .. } = searches.sharp;
        parts.push(Box::new(Discs::new(points, radius, floor, with_variances)));
    }
    match composition.density.filter(|_| is_plane) {
        Some(Density::LocalLinear) => {
            parts.push(Box::new(SmoothDensity::new(points, settings.nearest.is_some(), with_variances)));
        }
        Some(Density::Paper) => parts.push(Box::new(PaperDensity::new(points))),
        None => {}
    }
    parts
}

/// Search limits of the two kinds of light; see [`Crossings`](crate::gather::receiver::Crossings).
#[derive(Clone, Copy)]
pub(super) struct Searches {
    pub(super) sharp: SearchLimits,
    pub(super) smooth: SearchLimits,
}

impl Searches {
    /// Those of one map of `photons` photons; `diagonal` is that of the scene, m.
    pub(super) fn new(density: Option<Density>, settings: &Settings, diagonal: f64, photons: f64) -> Self {
        let radius = settings.radius.unwrap_or(0.1 * diagonal) as f32;
        let floor = (SMALLEST_DISC * diagonal) as f32;
        // Variance falls as 1/k, squared bias grows as (k/N)²: the best k grows as N^(2/3).
        let growing = |at_a_million: f64| {
            let k = at_a_million * (photons / 1e6).powf(2.0 / 3.0);
            settings.nearest.unwrap_or((k as usize).clamp(LEAST_NEAREST, MOST_NEAREST))
        };
        let (sharp, smooth) = match density {
            Some(Density::Paper) => {
                let paper = settings.nearest.unwrap_or(PAPERS_NEAREST);
                (paper, paper)
            }
            _ => (growing(SHARP_NEAREST), growing(SMOOTH_NEAREST)),
        };
        let search = |nearest| SearchLimits { nearest, radius, floor };
        Self { sharp: search(sharp), smooth: search(smooth) }
    }

    /// Those of pass `pass` (from 0 on): discs shrink from pass to pass, so that their bias vanishes with their noise.
    /// R²ₙ₊₁ = R²ₙ (n + α)/(n + 1) with α = 2/3, the rate at which both vanish together (Knaus & Zwicker 2011).
    pub(super) fn of_pass(self, pass: u32) -> Self {
        let shrunk: f64 = (1..=pass).map(|n| (f64::from(n) + 2.0 / 3.0) / (f64::from(n) + 1.0)).product();
        let shrink = |search: SearchLimits| SearchLimits {
            nearest: ((search.nearest as f64 * shrunk) as usize).max(search.nearest.min(20)),
            radius: search.radius * shrunk.sqrt() as f32,
            ..search
        };
        Self { sharp: shrink(self.sharp), smooth: shrink(self.smooth) }
    }
}

/// k of a million photons: few for light with edges, many for smooth light, as measured on the seed office.
const SHARP_NEAREST: f64 = 200.0;
const SMOOTH_NEAREST: f64 = 1000.0;
/// Bounds of k: fewer know no scatter, more cost time for nothing.
const LEAST_NEAREST: usize = 30;
const MOST_NEAREST: usize = 5000;
/// k of the paper.
const PAPERS_NEAREST: usize = 100;
/// Radius of the smallest disc, as a part of the scene's diagonal: coincident photons stay finite.
const SMALLEST_DISC: f64 = 1e-4;
