//! Light groups: which of the luminaires brings what, told by the photons and rays of the whole.
//!
//! Every estimate here is a sum, with weights, over photons and rays that each know their luminaire. So a group's light
//! is the same sum over its own part, with the weights chosen for the whole (windows of the smoothing, k of the
//! densities): a run traces nothing more for its groups, and they add up to the whole. A group's part may read a little
//! below 0 where the whole does not, since weights of polynomial fits may.

use super::Rendering;
use super::place::Place;
use crate::error::OptionError;
use crate::flux::photometric;
use crate::gather::density::LADDER;
use crate::gather::parts::PhotonTotal;
use crate::gather::parts::density::SmoothDensity;
use crate::gather::smooth::POINT_BATCHES;
use crate::luminaire::LightGroups;
use crate::render::composition::Density;
use crate::results::GroupMap;
use crate::scene::Measure;

/// Most memory that light groups may take, bytes.
const MOST_MEMORY: f64 = 4e9;

impl<const C: usize> Rendering<'_, C> {
    /// The groups to be told apart, if asked for and if there are several.
    ///
    /// # Errors
    /// Where the method knows of none, or they would take too much memory.
    pub(super) fn choose_groups(&mut self) -> Result<(), OptionError> {
        let groups = LightGroups::of(&self.scene.luminaires);
        if !self.settings.groups || groups.len() < 2 {
            return Ok(());
        }
        if self.composition.density == Some(Density::Paper) {
            return Err(OptionError::GroupsOfSeed);
        }
        let scene = self.scene;
        let body = scene.sensors.iter().find(|sensor| sensor.measure != Measure::Plane);
        if let (true, Some(sensor)) = (self.composition.counted.is_some(), body) {
            let (sensor, measure) = (sensor.name.clone(), sensor.measure.name());
            return Err(OptionError::GroupsOnBody { sensor, measure });
        }
        let of_points = |points: usize, variances: usize| {
            let grid = variances == 0;
            let estimates =
                self.discs(grid) + self.smooth_scales() + usize::from(grid && self.composition.counts_sharp);
            let densities = estimates * (groups.width::<C>() + variances);
            let rows = if variances > 0 { POINT_BATCHES } else { 1 };
            // Direct light, samples, their means, what smoothing makes of them, the map itself; densities.
            let row = groups.width::<C>() * (4 + 16 * rows + 4 + 4 + 4) + 8 * variances + 16 * densities;
            points as f64 * row as f64
        };
        let cells: usize = scene.planes.iter().map(|plane| plane.len()).sum();
        let bytes = of_points(cells, 0) + of_points(scene.sensors.len(), groups.len());
        if bytes > MOST_MEMORY {
            let points = cells + scene.sensors.len();
            return Err(OptionError::GroupsTooLarge { groups: groups.len(), points, bytes, most: MOST_MEMORY });
        }
        self.groups = Some(groups);
        Ok(())
    }

    /// Estimates over discs at a point.
    fn discs(&self, in_cells: bool) -> usize {
        if self.composition.counts_sharp && !in_cells { LADDER } else { 0 }
    }

    /// Estimates of smooth light at a point.
    fn smooth_scales(&self) -> usize {
        let scales = SmoothDensity::<C>::scales(self.settings.nearest.is_some()).len();
        self.composition.density.map_or(0, |_| scales)
    }

    /// Their names; none where groups are not told apart.
    pub(super) fn group_names(&self) -> &[String] {
        self.groups.as_ref().map_or(&[], |groups| groups.names())
    }

    /// The part of a light group in a map.
    pub(super) fn group_map(&self, place: &Place<C>, group: usize) -> GroupMap {
        let values: Vec<[f64; C]> = (0..place.len()).map(|point| place.group_value(point, group)).collect();
        let rgb = |value: &[f64; C]| std::array::from_fn(|c| value[if C == 1 { 0 } else { c }] as f32);
        GroupMap {
            illuminance: values.iter().map(|value| photometric(*value) as f32).collect(),
            rgb: self.plan.coloured.then(|| values.iter().map(rgb).collect()),
        }
    }

    /// Sets of photons in the sums of parts, each of the luminaires' whole flux, and the flux of a photon.
    pub(super) fn known(&self) -> PhotonTotal {
        let sets = (u64::from(self.done.len()) * self.rounds()) as f64;
        let emitted = photometric(self.record.flux.mean(sets.max(1.0)).emitted);
        PhotonTotal { sets, photon: emitted * sets / self.record.photons_emitted.max(1) as f64 }
    }

    /// What all passes say of each group's light that has bounced, by the choices made for the whole.
    pub(super) fn conclude_groups(&mut self, places: &mut [Place<C>]) {
        if self.groups.is_none() {
            return;
        }
        let known = self.known();
        self.timed("light groups", places.len() as u64, |this| {
            for place in places {
                place.conclude_groups(known);
                this.progress.advance(1);
            }
        });
    }
}
