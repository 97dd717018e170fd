//! What a run found, put into words and maps.

use glam::DVec3;

use super::Rendering;
use super::place::{Cell, Place, left_out, worst_of};
use super::warning::Warning;
use crate::flux::photometric;
use crate::gather::reach::Standing;
use crate::gather::receiver::MIDDLE_SHARE;
use crate::luminaire::Luminaire;
use crate::luminaire::outline::corners;
use crate::photon::trace::Tally;
use crate::results::{CameraImage, FluxBalance, IlluminanceMap, Results, Run, SensorReading, SurfaceMap, areas};
use crate::scene::{MeasuredSurface, MeasuringPlane, Scene};
use crate::units::Lumens;

impl<const C: usize> Rendering<'_, C> {
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
            photons_emitted: self.record.photons_emitted,
            photons_stored: self.record.photons_stored,
            passes: self.done.len(),
            nearest: self.searches.smooth.nearest,
            radius: f64::from(self.searches.smooth.radius),
            seed: self.settings.seed,
            threads: rayon::current_num_threads(),
            seconds: self.record.seconds.clone(),
            total_seconds: self.record.started.elapsed().as_secs_f64(),
            photon_rays: flux.rays,
            gather_rays: self.record.prepared_rays + self.record.gather_rays,
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
            warnings: self.record.warnings.iter().map(Warning::to_string).collect(),
        };
        Results { run, maps, sensors: readings, surfaces, images }
    }

    /// Flux balance, the mean over all rounds of all passes: each sends out the flux of all luminaires.
    fn mean_balance(&self) -> Tally<C> {
        self.record.flux.mean((u64::from(self.done.len().max(1)) * self.rounds()) as f64)
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
