//! What a run found, put into words and maps.

use glam::DVec3;

use super::Rendering;
use super::method::Rays;
use super::place::{Cell, Place, left_out, worst_of};
use crate::embree::RELATIVE_OFFSET;
use crate::flux::photometric;
use crate::gather::density::Estimate;
use crate::gather::reach::Standing;
use crate::gather::receiver::MIDDLE_SHARE;
use crate::gather::witness::Contradiction;
use crate::luminaire::outline::corners;
use crate::luminaire::{Luminaire, Opening};
use crate::photon::trace::Tally;
use crate::results::{CameraImage, FluxBalance, IlluminanceMap, Results, Run, SensorReading, SurfaceMap, areas};
use crate::scene::{MeasuredSurface, MeasuringPlane, PlaneKind, Scene};
use crate::text::number::fine_percent;
use crate::units::Lumens;

/// Photons, all passes together, below which the scatter of their batches tells little.
const FEWEST_PHOTONS: u64 = 1000;
/// The part of the flux that may be cut off without a word: far below any error that photons claim.
const MOST_CUT_OFF: f64 = 1e-5;

impl<const C: usize> Rendering<'_, C> {
    /// Says what a user ought to know about this run.
    pub(super) fn warn(&mut self, places: &[Place<C>]) {
        for (plane, place) in self.scene.planes.iter().zip(places) {
            let missed = |point: &usize| place.site.has_value[*point] && !place.site.receiver.is_on_surface(*point);
            let missed = (0..plane.len()).filter(missed).count();
            if plane.kind == PlaneKind::Surface && missed > 0 {
                self.warnings.push(format!(
                    "plane \"{}\": {missed} of {} points have no surface within {:.1} mm; expected on = \"air\" there",
                    plane.name,
                    plane.len(),
                    1e3 * place.site.receiver.tolerance,
                ));
            }
            if place.site.has_value.iter().all(|has_value| !has_value) {
                self.warnings.push(format!(
                    "plane \"{}\": no light can arrive at any of its {} points; along × across points to the measured side, and \
                     some luminaire has to shine into the same space",
                    plane.name,
                    plane.len(),
                ));
            }
            self.warn_of_contradiction(&format!("plane \"{}\"", plane.name), place);
            let unmet = |point: &usize| place.site.has_value[*point] && is_dark(&place.bounced[*point]);
            let unmet = (0..plane.len()).filter(unmet).count();
            if self.composition.density.is_some() && unmet > 0 {
                self.warnings.push(format!(
                    "plane \"{}\": {unmet} of {} points have no photon within {} m: that part of their light reads 0; \
                     expected more photons or a larger radius",
                    plane.name,
                    plane.len(),
                    self.searches.smooth.radius,
                ));
            }
        }
        let first = places.len() - self.scene.surfaces.len();
        let unmet = |place: &Place<C>| {
            let dark = |point: &usize| place.site.has_value[*point] && is_dark(&place.bounced[*point]);
            (0..place.len()).filter(dark).count()
        };
        for place in &places[self.scene.planes.len()..first] {
            self.warn_of_contradiction("sensors", place);
        }
        let unmet: usize = places[self.scene.planes.len()..first].iter().map(unmet).sum();
        if self.composition.density.is_some() && unmet > 0 {
            self.warnings.push(format!(
                "{unmet} of {} sensors have no photon within {} m: that part of their light reads 0; expected more photons \
                 or a larger radius",
                self.scene.sensors.len(),
                self.searches.smooth.radius,
            ));
        }
        for (surface, place) in self.scene.surfaces.iter().zip(&places[first..]) {
            if place.site.has_value.iter().all(|has_value| !has_value) {
                self.warnings.push(format!(
                    "surface \"{}\": no light can arrive at any sample; side = \"front\" is the one from which vertices run \
                     counter-clockwise, and some luminaire has to shine into the same space",
                    surface.name
                ));
            }
            let unmet = |point: &usize| place.site.has_value[*point] && is_dark(&place.bounced[*point]);
            let unmet = (0..surface.samples.len()).filter(unmet).count();
            if self.composition.density.is_some() && unmet > 0 {
                self.warnings.push(format!(
                    "surface \"{}\": no photon landed on {unmet} of {} samples: that part of their light reads 0; \
                     expected more photons or a wider spacing",
                    surface.name,
                    surface.samples.len(),
                ));
            }
        }
        let coarse: Vec<String> = self.scene.planes.iter().flat_map(areas::too_coarse).collect();
        self.warnings.extend(coarse);
        if self.composition.rays == Some(Rays::AsPaths) && self.plan.caustics {
            let point = |luminaire: &Luminaire| matches!(luminaire.opening, Opening::Point { .. });
            self.warnings.push(if self.scene.luminaires.iter().any(point) {
                "method path never meets a luminaire without extent in a mirror or behind glass: that light is missing; \
                 expected another method, or an opening".to_owned()
            } else {
                "method path meets small luminaires in mirrors and glass only by chance: caustics may be wrong by more than \
                 is claimed; expected another method".to_owned()
            });
        }
        let (reach, detail) = (self.scene.half_extent(), self.scene.smallest_detail());
        let step = f64::from(RELATIVE_OFFSET) * reach;
        if step > 0.1 * detail {
            self.warnings.push(format!(
                "the scene reaches {reach:.3e} m from its middle, so rays start {step:.1e} m off surfaces; expected less than a \
                 tenth of the smallest opening or cell, {detail:.1e} m: is something far away, or a unit wrong?"
            ));
        }
        self.warn_of_far_lamps();
        let flux = self.flux.mean(1.0);
        let cut_off = photometric(flux.cut_off) / photometric(flux.emitted).max(f64::MIN_POSITIVE);
        let most = self.trial.most_bounces();
        if cut_off > MOST_CUT_OFF && self.trial.in_glass > 0.0 {
            self.warnings.push(format!(
                "{} % of the flux was still under way after {most} bounces and was cut off: nearly all of it is trapped in \
                 glass that absorbs nothing, where it lights nothing",
                fine_percent(cut_off),
            ));
        } else if cut_off > MOST_CUT_OFF {
            self.warnings.push(format!(
                "{} % of the flux was still under way after {most} bounces and was cut off: illuminance is too low",
                fine_percent(cut_off),
            ));
        }
        if self.plan.photons && self.photons_emitted < FEWEST_PHOTONS {
            self.warnings.push(format!(
                "light that has bounced rests on {} photons: what errors are claimed can't be trusted; expected some \
                 thousands at least",
                self.photons_emitted,
            ));
        }
        self.warn_of_lamps_at_points(places, step);
    }

    /// Rays and photons that contradict each other.
    fn warn_of_contradiction(&mut self, what: &str, place: &Place<C>) {
        let contradiction = place.parts.iter().find_map(|part| part.contradiction());
        if let Some(Contradiction { photons, rays }) = contradiction {
            self.warnings.push(format!(
                "{what}: photons bring {photons:.3e} lx to a part of it where rays found {rays:.3e} lx: light comes through \
                 openings, or from places, that rays rarely meet; the standard errors there hold the difference; method \
                 split finds such light"
            ));
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
                self.warnings.push(format!(
                    "luminaire \"{}\" hangs {away:.3e} m from what is measured, where rays start {step:.1e} m off surfaces; \
                     expected less than a tenth of its opening, {size:.1e} m: is it too far away, or a unit wrong?",
                    luminaire.name,
                ));
            }
        }
    }

    /// A luminaire without extent has no bound on its illuminance where it is.
    fn warn_of_lamps_at_points(&mut self, places: &[Place<C>], step: f64) {
        let lamps: Vec<(&str, DVec3)> = self
            .scene
            .luminaires
            .iter()
            .filter_map(|luminaire| match luminaire.opening {
                Opening::Point { position, .. } => Some((luminaire.name.as_str(), position)),
                _ => None,
            })
            .collect();
        for place in places {
            let receiver = &place.site.receiver;
            for (name, lamp) in &lamps {
                let height = (*lamp - receiver.origin.as_dvec3()).dot(receiver.normal.as_dvec3());
                if receiver.is_plane() && height.abs() > 8.0 * step {
                    continue;
                }
                let distances = (0..receiver.len()).map(|point| receiver.start(point).as_dvec3().distance(*lamp));
                let nearest = distances.fold(f64::INFINITY, f64::min);
                if nearest <= 4.0 * step {
                    self.warnings.push(format!(
                        "luminaire \"{name}\" has no extent and hangs {nearest:.1e} m from a point that is measured: illuminance \
                         there has no bound, and what is found depends on rounding; expected an opening, or another place"
                    ));
                }
            }
        }
    }

    pub(super) fn results(
        self,
        places: &[Place<C>],
        sensors: &[Vec<usize>],
        images: Vec<CameraImage>,
        bvh_memory: u64,
    ) -> Results {
        let flux = self.mean_balance();
        let scene = self.scene;
        let maps = scene.planes.iter().zip(places).map(|(plane, place)| self.map(plane, place)).collect();
        let surfaces = scene.surfaces.iter().zip(&places[scene.planes.len() + sensors.len()..]);
        let surfaces = surfaces.map(|(surface, place)| self.surface(surface, place)).collect();
        let mut readings: Vec<(usize, SensorReading)> = places[scene.planes.len()..]
            .iter()
            .zip(sensors)
            .flat_map(|(place, served)| served.iter().enumerate().map(move |(point, &sensor)| (sensor, place, point)))
            .map(|(sensor, place, point)| (sensor, self.reading(sensor, place, point)))
            .collect();
        readings.sort_by_key(|(sensor, _)| *sensor);
        let readings = readings.chunk_by(|(a, _), (b, _)| a == b).map(mean_over_disc).collect();
        let lumens = |channels| Lumens(photometric(channels));
        let run = Run {
            scene: scene.name.clone(),
            scene_hash: scene.hash.clone(),
            method: self.plan.method.name().into(),
            tree: self.settings.tree.name().into(),
            photons_emitted: self.photons_emitted,
            photons_stored: self.photons_stored,
            passes: self.done.len(),
            nearest: self.searches.smooth.nearest,
            radius: f64::from(self.searches.smooth.radius),
            seed: self.settings.seed,
            threads: rayon::current_num_threads(),
            seconds: self.seconds.clone(),
            total_seconds: self.started.elapsed().as_secs_f64(),
            photon_rays: flux.rays,
            gather_rays: self.prepared_rays + self.gather_rays,
            left_out: left_out(places),
            flux: FluxBalance {
                emitted: lumens(flux.emitted),
                absorbed: lumens(flux.absorbed),
                escaped: lumens(flux.escaped),
                cut_off: lumens(flux.cut_off),
            },
            peak_memory: peak_memory(),
            bvh_memory,
            triangles: scene.mesh.triangles.len(),
            luminaires: scene.luminaires.len(),
            groups: self.group_names().to_vec(),
            maintenance_factor: scene.maintenance_factor,
            claim: worst_of(places, Cell::of),
            warnings: self.warnings.clone(),
        };
        Results { run, maps, sensors: readings, surfaces, images }
    }

    /// Flux balance, the mean over all rounds of all passes: each sends out the flux of all luminaires.
    fn mean_balance(&self) -> Tally<C> {
        self.flux.mean((u64::from(self.done.len().max(1)) * self.rounds()) as f64)
    }

    fn map(&self, plane: &MeasuringPlane, place: &Place<C>) -> IlluminanceMap {
        let cells: Vec<Cell<C>> = (0..plane.len()).map(|point| Cell::of(place, point)).collect();
        let origin = plane.corner + self.scene.centre;
        let mut map = IlluminanceMap {
            name: plane.name.clone(),
            corner: origin,
            along: plane.along,
            across: plane.across,
            cells: plane.cells,
            illuminance: cells.iter().map(|cell| photometric(cell.value)).collect(),
            rgb: self.plan.coloured.then(|| cells.iter().map(|cell| cell.rgb()).collect()),
            direct: place
                .straight()
                .next()
                .is_some()
                .then(|| cells.iter().map(|cell| photometric(cell.direct)).collect()),
            standard_error: cells.iter().map(|cell| cell.variance.sqrt()).collect(),
            has_value: place.site.has_value.clone(),
            standing: place.site.standing.clone(),
            outlines: outlines(self.scene, plane),
            groups: (0..self.group_names().len()).map(|group| self.group_map(place, group)).collect(),
            extremes: place.extremes.first().copied(),
            areas: Vec::new(),
        };
        map.areas = areas::figures(&plane.areas, &map, place.extremes.get(1..).unwrap_or(&[]));
        map
    }

    fn surface(&self, surface: &MeasuredSurface, place: &Place<C>) -> SurfaceMap {
        let cells: Vec<Cell<C>> = (0..place.len()).map(|point| Cell::of(place, point)).collect();
        let world = |corner| corner + self.scene.centre;
        SurfaceMap {
            name: surface.name.clone(),
            spacing: surface.spacing,
            corners: surface.samples.iter().map(|sample| sample.corners.map(world)).collect(),
            illuminance: cells.iter().map(|cell| photometric(cell.value)).collect(),
            rgb: self.plan.coloured.then(|| cells.iter().map(|cell| cell.rgb()).collect()),
            standard_error: cells.iter().map(|cell| cell.variance.sqrt()).collect(),
            has_value: place.site.has_value.clone(),
            standing: place.site.standing.clone(),
            extremes: place.extremes.first().copied(),
        }
    }

    fn reading(&self, sensor: usize, place: &Place<C>, point: usize) -> SensorReading {
        let cell = Cell::of(place, point);
        let sensor = &self.scene.sensors[sensor];
        SensorReading {
            name: sensor.name.clone(),
            position: sensor.position + self.scene.centre,
            normal: sensor.normal,
            measure: sensor.measure,
            illuminance: photometric(cell.value),
            rgb: self.plan.coloured.then(|| cell.rgb()),
            standard_error: cell.variance.sqrt(),
            target: sensor.target,
            daylight: sensor.daylight,
            has_value: place.site.has_value[point],
            standing: place.site.standing[point],
            groups: (0..self.group_names().len()).map(|group| place.group_reading(point, group)).collect(),
        }
    }
}

/// Whether no light was found.
fn is_dark<const C: usize>(found: &Estimate<C>) -> bool {
    found.value.iter().all(|&lux| lux == 0.0)
}

/// What a sensor reads: at its one point, or the mean of those of its disc that have a value, the middle first. Their errors
/// are taken as one: points so near each other share photons and shadows.
fn mean_over_disc(points: &[(usize, SensorReading)]) -> SensorReading {
    let mut mean = points[0].1.clone();
    if points.len() == 1 {
        return mean;
    }
    let rest = (1.0 - MIDDLE_SHARE) / (points.len() - 1) as f64;
    let weighted =
        points.iter().enumerate().map(|(point, (_, reading))| (if point == 0 { MIDDLE_SHARE } else { rest }, reading));
    let weighted: Vec<(f64, &SensorReading)> = weighted.filter(|(_, reading)| reading.has_value).collect();
    let total: f64 = weighted.iter().map(|(weight, _)| weight).sum();
    let of = |value: &dyn Fn(&SensorReading) -> f64| -> f64 {
        weighted.iter().map(|(weight, reading)| weight / total * value(reading)).sum()
    };
    mean.has_value = !weighted.is_empty();
    mean.standing = if mean.has_value { Standing::Place } else { points[0].1.standing };
    mean.illuminance = of(&|reading| reading.illuminance);
    mean.standard_error = of(&|reading| reading.standard_error);
    mean.rgb = mean.rgb.map(|_| std::array::from_fn(|c| of(&|reading| reading.rgb.map_or(0.0, |rgb| rgb[c]))));
    for (number, group) in mean.groups.iter_mut().enumerate() {
        group.illuminance = of(&|reading| reading.groups[number].illuminance);
        group.standard_error = of(&|reading| reading.groups[number].standard_error);
    }
    mean
}

/// Outlines of the flat openings, in metres along and across the plane.
pub(super) fn outlines(scene: &Scene, plane: &MeasuringPlane) -> Vec<Vec<[f64; 2]>> {
    let (along, across) = (plane.along.normalize(), plane.across.normalize());
    let flat = |corner: DVec3| [(corner - plane.corner).dot(along), (corner - plane.corner).dot(across)];
    let of = |luminaire: &Luminaire| corners(&luminaire.opening, plane.normal());
    scene.luminaires.iter().flat_map(of).map(|outline| outline.into_iter().map(flat).collect()).collect()
}

/// Peak memory of this process, bytes; 0 where the system doesn't say.
fn peak_memory() -> u64 {
    let kilobytes = |status: String| {
        let line = status.lines().find(|line| line.starts_with("VmHWM:"))?.to_owned();
        line.split_whitespace().nth(1)?.parse::<u64>().ok()
    };
    std::fs::read_to_string("/proc/self/status").ok().and_then(kilobytes).map_or(0, |kb| kb * 1024)
}
