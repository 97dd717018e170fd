//! Looks for what a user ought to know about a run.

use glam::DVec3;

use super::Rendering;
use super::composition::Rays;
use super::place::Place;
use super::warning::{At, Warning};
use crate::embree::RELATIVE_OFFSET;
use crate::flux::photometric;
use crate::luminaire::{Luminaire, Opening};
use crate::results::areas;
use crate::scene::{MeasuringPlane, PlaneKind};

/// Photons, all passes together, below which the scatter of their batches tells little.
const FEWEST_PHOTONS: u64 = 1000;
/// The part of the flux that may be cut off without a word: far below any error that photons claim.
const MOST_CUT_OFF: f64 = 1e-5;

impl<const C: usize> Rendering<'_, C> {
    /// Says what a user ought to know about this run.
    pub(super) fn warn(&mut self, places: &[Place<C>]) {
        let scene = self.scene;
        let (planes, rest) = places.split_at(scene.planes.len());
        let (sensors, surfaces) = rest.split_at(rest.len() - scene.surfaces.len());
        for (plane, place) in scene.planes.iter().zip(planes) {
            self.warn_of_plane(plane, place);
        }
        sensors.iter().for_each(|place| self.warn_of_contradiction(At::Sensors, place));
        self.warn_of_missing_photons(At::Sensors, sensors, scene.sensors.len());
        for (surface, place) in scene.surfaces.iter().zip(surfaces) {
            if has_no_value(place) {
                self.record.warn(Warning::DarkSurface { surface: surface.name.clone() });
            }
            let at = At::Surface(surface.name.clone());
            self.warn_of_missing_photons(at, std::slice::from_ref(place), surface.samples.len());
        }
        let coarse = scene.planes.iter().flat_map(areas::too_coarse);
        self.record.warnings.extend(coarse.map(Warning::InWords));
        self.warn_of_paths();
        let step = f64::from(RELATIVE_OFFSET) * scene.half_extent();
        self.warn_of_coarse_rays(step);
        self.warn_of_far_lamps();
        self.warn_of_photons();
        self.warn_of_lamps_at_points(places, step);
    }

    fn warn_of_plane(&mut self, plane: &MeasuringPlane, place: &Place<C>) {
        let (site, of) = (&place.site, plane.len());
        let missed = |point: &usize| site.has_value[*point] && !site.receiver.is_on_surface(*point);
        let missed = (0..of).filter(missed).count();
        if plane.kind == PlaneKind::Surface && missed > 0 {
            let (plane, tolerance) = (plane.name.clone(), site.receiver.tolerance);
            self.record.warn(Warning::NoSurface { plane, missed, of, tolerance });
        }
        if has_no_value(place) {
            self.record.warn(Warning::DarkPlane { plane: plane.name.clone(), points: of });
        }
        self.warn_of_contradiction(At::Plane(plane.name.clone()), place);
        self.warn_of_missing_photons(At::Plane(plane.name.clone()), std::slice::from_ref(place), of);
    }

    /// Rays and photons that contradict each other.
    fn warn_of_contradiction(&mut self, at: At, place: &Place<C>) {
        if let Some(contradiction) = place.parts.iter().find_map(|part| part.contradiction()) {
            self.record.warn(Warning::of(at, contradiction));
        }
    }

    /// Points, `of` in all, whose light densities should tell, but no photon came near.
    fn warn_of_missing_photons(&mut self, at: At, places: &[Place<C>], of: usize) {
        let points = places.iter().map(points_without_photons).sum();
        if self.composition.density.is_some() && points > 0 {
            self.record.warn(Warning::NoPhoton { at, points, of, radius: self.searches.smooth.radius });
        }
    }

    /// Paths that hardly meet luminaires by mirrors and glass.
    fn warn_of_paths(&mut self) {
        if self.composition.rays == Some(Rays::AsPaths) && self.plan.caustics {
            let point = |luminaire: &Luminaire| matches!(luminaire.opening, Opening::Point { .. });
            let points = self.scene.luminaires.iter().any(point);
            self.record.warn(if points { Warning::PathsMissPoints } else { Warning::PathsByChance });
        }
    }

    /// Details of the scene that single precision blurs, where rays start `step` (m) off surfaces.
    fn warn_of_coarse_rays(&mut self, step: f64) {
        let (reach, detail) = (self.scene.half_extent(), self.scene.smallest_detail());
        if step > 0.1 * detail {
            self.record.warn(Warning::CoarseRays { reach, step, detail });
        }
    }

    /// Luminaires so far from what is measured that single precision blurs their openings.
    fn warn_of_far_lamps(&mut self) {
        if !self.scene.near.is_cut() {
            return; // `half_extent` tells
        }
        for luminaire in &self.scene.luminaires {
            let away = luminaire.opening.middle().length();
            let (step, size) = (f64::from(RELATIVE_OFFSET) * away, luminaire.opening.smallest_side());
            if step > 0.1 * size {
                self.record.warn(Warning::FarLuminaire { luminaire: luminaire.name.clone(), away, step, size });
            }
        }
    }

    /// Flux that was cut off, and too few photons.
    fn warn_of_photons(&mut self) {
        let flux = self.record.flux.mean(1.0);
        let part = photometric(flux.cut_off) / photometric(flux.emitted).max(f64::MIN_POSITIVE);
        if part > MOST_CUT_OFF {
            let (bounces, in_glass) = (self.trial.most_bounces(), self.trial.in_glass > 0.0);
            self.record.warn(Warning::CutOff { part, bounces, in_glass });
        }
        if self.plan.photons && self.record.photons_emitted < FEWEST_PHOTONS {
            self.record.warn(Warning::FewPhotons(self.record.photons_emitted));
        }
    }

    /// A luminaire without extent has no bound on its illuminance where it is.
    fn warn_of_lamps_at_points(&mut self, places: &[Place<C>], step: f64) {
        let scene = self.scene;
        let lamps = scene.luminaires.iter().filter_map(|luminaire| match luminaire.opening {
            Opening::Point { position, .. } => Some((&luminaire.name, position)),
            _ => None,
        });
        let lamps: Vec<(&String, DVec3)> = lamps.collect();
        for place in places {
            let receiver = &place.site.receiver;
            for (name, lamp) in &lamps {
                let height = (*lamp - receiver.origin.as_dvec3()).dot(receiver.normal.as_dvec3());
                if receiver.is_plane() && height.abs() > 8.0 * step {
                    continue;
                }
                let distances = (0..receiver.len()).map(|point| receiver.start(point).as_dvec3().distance(*lamp));
                let distance = distances.fold(f64::INFINITY, f64::min);
                if distance <= 4.0 * step {
                    self.record.warn(Warning::LuminaireAtPoint { luminaire: (*name).clone(), distance });
                }
            }
        }
    }
}

/// Whether light can arrive at none of the points.
fn has_no_value<const C: usize>(place: &Place<C>) -> bool {
    place.site.has_value.iter().all(|has_value| !has_value)
}

/// Points that have a value, but where no pass found any light.
fn points_without_photons<const C: usize>(place: &Place<C>) -> usize {
    let is_dark = |point: &usize| place.bounced[*point].value.iter().all(|&lux| lux == 0.0);
    (0..place.len()).filter(|point| place.site.has_value[*point] && is_dark(point)).count()
}
