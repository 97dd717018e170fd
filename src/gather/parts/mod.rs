//! The parts of the light at the points of a receiver.
//!
//! What arrives at a point is a sum: light straight from luminaires, cut exactly or sampled; light that has bounced,
//! found by rays or by the density of photons; caustics, counted in cells or over discs. Each part knows its light
//! better with every round of photons and rays, and keeps for itself what it needs for that: its sums, their light
//! groups, the choices it made. A new part is one file here with a type that implements [`LightPart`], and one line
//! where a method lists its parts (`render/method.rs`).

pub mod counted;
pub mod density;
pub mod direct;
pub mod faint;
pub mod rays;

use std::io;

use super::counts::Met;
use super::density::{Estimate, SearchLimits};
use super::direct::DirectGroups;
use super::patches::PatchGroups;
use super::reach::Standing;
use super::receiver::{Crossings, Receiver};
use super::sight::{Records, Sight};
use super::smooth::Smoother;
use super::visible::VisiblePolygon;
use super::witness::Contradiction;
use crate::embree::RayCaster;
use crate::luminaire::LightGroups;
use crate::photon_map::ChosenMap;
use crate::random::Seed;
use crate::state::tape::Tape;

/// A receiver, and what all parts of its light share: facts of the scene, found before the first pass.
pub struct Site {
    /// Its points.
    pub receiver: Receiver,
    /// Whether it is a measuring plane on a surface.
    pub on_surface: bool,
    /// Which points have a value: light can arrive there.
    pub has_value: Vec<bool>,
    /// Why, or why not.
    pub standing: Vec<Standing>,
    /// Areas of the points, m²: of a measured surface only.
    pub areas: Vec<f64>,
    /// What each point sees around itself in the plane; empty where no density of photons is taken.
    pub visible: Vec<VisiblePolygon>,
    /// How neighbours on a grid are smoothed together, where they are.
    pub smoother: Option<Smoother>,
}

/// Where the light of a part comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightOrigin {
    /// Straight from luminaires.
    Luminaires,
    /// From surfaces that rays from the points would meet.
    Surfaces,
    /// By mirrors and glass, where such rays would hardly find it; all light, where it is found by photons only.
    PhotonsOnly,
}

/// What the photons of one round left at one receiver.
pub struct Arrived<const C: usize> {
    /// Light with edges, and light that met a diffuse surface; all of it in the first for the paper's estimator.
    pub maps: [ChosenMap<C>; 2],
    /// Photons that are counted.
    pub met: Vec<Met<C>>,
    /// Photons of light that rays find, too; none in rounds that do without.
    pub witnessed: Option<Crossings<C>>,
}

/// What the photons of one round left everywhere.
pub struct PhotonRound<'a, const C: usize> {
    /// At this receiver.
    pub arrived: &'a Arrived<C>,
    /// On all surfaces; empty but for the paper's estimator.
    pub landed: &'a ChosenMap<C>,
    /// Limits of the search in densities.
    pub search: SearchLimits,
    /// Light groups that are kept apart.
    pub groups: Option<&'a LightGroups>,
}

/// What rays of one round may use.
pub struct RayRound<'a, const C: usize> {
    /// Number of the round, all passes counted.
    pub number: u64,
    /// Rays from each point of a grid.
    pub rays: u64,
    /// Finds the light that comes along a ray.
    pub sight: &'a Sight<'a, C>,
    /// Illuminance of surfaces by this round's photons, where rays end there.
    pub records: Option<Records<'a, C>>,
    /// The same by light group.
    pub patches: Option<&'a PatchGroups<C>>,
    /// Light groups that are kept apart.
    pub groups: Option<&'a LightGroups>,
}

/// How much is known when a part concludes.
#[derive(Clone, Copy)]
pub struct PhotonTotal {
    /// Sets of photons in its sums, each of the luminaires' whole flux.
    pub sets: f64,
    /// Flux of a photon, lm.
    pub photon: f64,
}

/// Light by group at the points of a receiver. Rows are laid out as [`LightGroups`] says.
pub struct GroupRows {
    /// Numbers in a row.
    pub width: usize,
    /// Groups whose variance is kept: all of sensors, none of maps.
    pub variances: usize,
    /// E, lx: a row for each point.
    pub light: Vec<f32>,
    /// Variance of the photometric E, lx²: for each point, of each group.
    pub variance: Vec<f64>,
}

impl GroupRows {
    /// No light at `points` points.
    pub fn dark(points: usize, width: usize, variances: usize) -> Self {
        Self { width, variances, light: vec![0.0; points * width], variance: vec![0.0; points * variances] }
    }
}

/// One part of the light at the points of a receiver, known better with every round.
///
/// Values are E in lx, variances lx². A method that a part does not implement adds nothing.
pub trait LightPart<const C: usize>: Send + Sync {
    /// Where its light comes from.
    fn source(&self) -> LightOrigin;

    /// Adds the photons of a round.
    fn add_photons(&mut self, _round: &PhotonRound<'_, C>, _site: &Site) {}

    /// Adds what rays of a round find; returns how many were cast.
    fn add_rays(&mut self, _round: &RayRound<'_, C>, _site: &Site) -> u64 {
        0
    }

    /// The estimate of all rounds so far of light at each point that was not straight from luminaires, and its error:
    /// noise, and bias where there is some. Empty where there is none.
    fn conclude(&mut self, _known: PhotonTotal, _site: &Site) -> Vec<Estimate<C>> {
        Vec::new()
    }

    /// Light straight from luminaires at a point, as far as it is known.
    fn straight(&self, _point: usize) -> Estimate<C> {
        Estimate::DARK
    }

    /// The same by light group.
    fn straight_groups(&self) -> Option<&DirectGroups> {
        None
    }

    /// Adds the light of each group, by the choices that the last [`Self::conclude`] made for the whole.
    fn add_groups(&self, _known: PhotonTotal, _site: &Site, _rows: &mut GroupRows) {}

    /// Moves all sums to or from a checkpoint, another run's state or another process.
    fn exchange(&mut self, _tape: &mut Tape<'_>) -> io::Result<()> {
        Ok(())
    }

    /// Variance of Σ weight · E over points, where the part can estimate what its points have in common.
    fn variance_of_sum(&self, _weighted: &[(usize, f64)]) -> Option<f64> {
        None
    }

    /// Variance that is added at each point where photons contradict this part; empty without such photons.
    fn doubt(&self) -> &[f64] {
        &[]
    }

    /// Where it is contradicted most.
    fn contradiction(&self) -> Option<Contradiction> {
        None
    }

    /// Whether [`Self::sample_again`] finds its light.
    fn can_sample_again(&self) -> bool {
        false
    }

    /// The sum of `count` samples of its light at a point that owe nothing to what is known, and the rays they took.
    fn sample_again(
        &self,
        _point: usize,
        _count: u64,
        _site: &Site,
        _caster: &RayCaster,
        _seed: Seed,
    ) -> ([f64; C], u64) {
        ([0.0; C], 0)
    }

    /// Puts another estimate in the place of its own at a point.
    fn replace_straight(&mut self, _point: usize, _light: Estimate<C>) {}

    /// Mean and largest share of the points' light that it left out, as it was too weak to matter.
    fn left_out_share(&self) -> Option<[f64; 2]> {
        None
    }
}
