//! What a run found: maps, readings, images, and how they came about.
//!
//! Illuminance is in lx, coordinates are the world's, in m. Everything that is written or shown comes from here.

pub mod areas;
pub mod image;
pub mod met;
pub mod statistics;
mod surface;
pub mod verdict;
pub mod without;

use glam::DVec3;

use crate::error::invalid;
use crate::gather::reach::Standing;
use crate::scene::Measure;
use crate::units::Lumens;
pub use areas::AreaFigures;
pub use image::{CameraImage, Layer};
pub use statistics::{Errors, Extremes, Reading, Statistics, statistics};
pub use surface::{SurfaceFigures, SurfaceMap};
pub use verdict::Verdict;

/// Everything a run found, ready to be written.
#[derive(Clone, Debug)]
pub struct Results {
    /// How it was found.
    pub run: Run,
    /// One map for each measuring plane.
    pub maps: Vec<IlluminanceMap>,
    /// One reading for each sensor.
    pub sensors: Vec<SensorReading>,
    /// One image for each camera.
    pub images: Vec<CameraImage>,
    /// One map for each measured surface.
    pub surfaces: Vec<SurfaceMap>,
}

/// Illuminance over one measuring plane. Cells are row by row from `corner`; world coordinates.
#[derive(Clone, Debug)]
pub struct IlluminanceMap {
    /// Name of the measuring plane.
    pub name: String,
    /// World corner, m.
    pub corner: DVec3,
    /// Whole extent of image x, m.
    pub along: DVec3,
    /// Whole extent of image y, m.
    pub across: DVec3,
    /// Columns and rows.
    pub cells: [usize; 2],
    /// E of each cell, lx.
    pub illuminance: Vec<f64>,
    /// E of each channel (linear Rec. 709), lx; only in coloured scenes.
    pub rgb: Option<Vec<[f64; 3]>>,
    /// The part that came straight from luminaires, lx; where the method knows it.
    pub direct: Option<Vec<f64>>,
    /// Standard error of each cell (1 σ), lx: noise, and the bias of smoothing where there is some.
    pub standard_error: Vec<f64>,
    /// False where no light can arrive, as inside a solid: such cells have no value.
    pub has_value: Vec<bool>,
    /// Why each cell has a value, or none; empty where that is not known.
    pub standing: Vec<Standing>,
    /// Outlines of the luminaires in plane coordinates (m along, m across), closed polygons.
    pub outlines: Vec<Vec<[f64; 2]>>,
    /// What is known of its mean and extremes beyond the cells.
    pub extremes: Option<Extremes>,
    /// Figures of parts of the plane, where the scene asks for some.
    pub areas: Vec<AreaFigures>,
    /// The part of each light group, in the order of [`Run::groups`]; none where they are not told apart. They add up
    /// to E, and a part may read a little below 0.
    pub groups: Vec<GroupMap>,
}

/// The part of one light group in a map.
#[derive(Clone, Debug, Default)]
pub struct GroupMap {
    /// E of each cell, lx; 0 where there is no value.
    pub illuminance: Vec<f32>,
    /// E of each channel, lx; only in coloured scenes.
    pub rgb: Option<Vec<[f32; 3]>>,
}

/// The part of one light group in what a sensor reads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroupReading {
    /// E, lx.
    pub illuminance: f64,
    /// Standard error (1 σ), lx; those of several groups are not independent, as they share photons and rays.
    pub standard_error: f64,
}

/// What a sensor reads.
#[derive(Clone, Debug)]
pub struct SensorReading {
    /// Its name.
    pub name: String,
    /// World position, m.
    pub position: DVec3,
    /// Unit normal of the measured side; the axis of a measured body.
    pub normal: DVec3,
    /// What E is the mean over.
    pub measure: Measure,
    /// E, lx.
    pub illuminance: f64,
    /// E of each channel, lx; only in coloured scenes.
    pub rgb: Option<[f64; 3]>,
    /// Standard error (1 σ), lx.
    pub standard_error: f64,
    /// What the user there asks for, lx.
    pub target: Option<f64>,
    /// What arrives besides the luminaires' light, lx; not in E.
    pub daylight: f64,
    /// False where no light can arrive.
    pub has_value: bool,
    /// Why so.
    pub standing: Standing,
    /// The part of each light group, in the order of [`Run::groups`]; none where they are not told apart.
    pub groups: Vec<GroupReading>,
}

/// How a result came about.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// Name of the scene.
    pub scene: String,
    /// SHA-256 of the scene and its files.
    pub scene_hash: String,
    /// `gather`, `split`, `path`, `photons` or `seed`.
    pub method: String,
    /// The photon map's tree: `kd`, `kiddo`, `paper` or `brute`.
    pub tree: String,
    /// Photons emitted, all passes together.
    pub photons_emitted: u64,
    /// Photons stored for the measuring planes and sensors, all passes together.
    pub photons_stored: u64,
    /// Independent passes.
    pub passes: u32,
    /// k, nearest photons of an estimate.
    pub nearest: usize,
    /// Largest search radius, m.
    pub radius: f64,
    /// Seed of the random streams.
    pub seed: u64,
    /// Threads used.
    pub threads: usize,
    /// Wall time of each stage, s, in the order they ran.
    pub seconds: Vec<(&'static str, f64)>,
    /// Wall time of the whole run, s.
    pub total_seconds: f64,
    /// Rays cast by the photons.
    pub photon_rays: u64,
    /// Rays cast from the measuring points: for what has bounced, for shadows, and in the plane.
    pub gather_rays: u64,
    /// Share of a point's light that luminaires left out for their weakness may have brought at most: mean, and
    /// largest.
    pub left_out: [f64; 2],
    /// Where the photons' flux went.
    pub flux: FluxBalance,
    /// Peak memory of the process, bytes; 0 where the system doesn't say.
    pub peak_memory: u64,
    /// The most that Embree held of it, bytes.
    pub bvh_memory: u64,
    /// Number of triangles.
    pub triangles: usize,
    /// Number of luminaires.
    pub luminaires: usize,
    /// Names of the light groups, where they are told apart.
    pub groups: Vec<String>,
    /// Smallest and largest maintenance factor in the luminaires' flux; `None` where the scene gives none.
    pub maintenance_factor: Option<[f64; 2]>,
    /// Standard error of the cells of the worst map, or of the worst sensor where there is no map, as a part of its
    /// mean: what `--error` bounds.
    pub claim: f64,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Emitted = absorbed + escaped + cut off, up to rounding.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FluxBalance {
    /// Flux of all photons emitted, a pass's mean.
    pub emitted: Lumens,
    /// Absorbed by surfaces and inside glass.
    pub absorbed: Lumens,
    /// Left the scene without meeting anything.
    pub escaped: Lumens,
    /// Still not absorbed at the safety cap on bounces.
    pub cut_off: Lumens,
}

impl IlluminanceMap {
    /// World position of the centre of cell `index` (row by row from the corner), m.
    pub fn point(&self, index: usize) -> DVec3 {
        let share = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
        let (column, row) = (index % self.cells[0], index / self.cells[0]);
        self.corner + self.along * share(column, self.cells[0]) + self.across * share(row, self.cells[1])
    }

    /// E of cell `index`, lx; `None` where no light can arrive.
    pub fn value(&self, index: usize) -> Option<f64> {
        self.has_value[index].then(|| self.illuminance[index])
    }

    /// E of each cell, lx, row by row; `None` where no light can arrive.
    pub fn values(&self) -> impl Iterator<Item = Option<f64>> {
        self.illuminance.iter().zip(&self.has_value).map(|(&e, &has_value)| has_value.then_some(e))
    }

    /// Says why this map can't be written: a length that isn't the number of cells, or a value that isn't finite.
    pub(crate) fn check(&self) -> std::io::Result<()> {
        let cells = self.cells[0] * self.cells[1];
        let lengths = [Some(&self.illuminance), Some(&self.standard_error), self.direct.as_ref()];
        if cells == 0
            || lengths.iter().flatten().any(|values| values.len() != cells)
            || self.rgb.as_ref().is_some_and(|values| values.len() != cells)
            || self.has_value.len() != cells
            || self.groups.iter().any(|group| !group.is_of(cells))
        {
            return Err(invalid(format!("the map of {} × {} cells is incomplete", self.cells[0], self.cells[1])));
        }
        (0..cells).filter(|&cell| self.has_value[cell]).try_for_each(|cell| self.check_cell(cell))
    }

    /// Says which quantity of a cell isn't a finite number in single precision, which EXR files hold.
    fn check_cell(&self, cell: usize) -> std::io::Result<()> {
        let rgb = self.rgb.iter().flat_map(|rgb| rgb[cell]).map(|e| ("E of a channel", e));
        let direct = self.direct.iter().map(|direct| ("direct E", direct[cell]));
        let groups = self.groups.iter().map(|group| ("E of a light group", f64::from(group.illuminance[cell])));
        let both = [("E", self.illuminance[cell]), ("standard error", self.standard_error[cell])];
        match both.into_iter().chain(rgb).chain(direct).chain(groups).find(|(_, value)| !(*value as f32).is_finite()) {
            None => Ok(()),
            Some((quantity, value)) => Err(invalid(format!(
                "{quantity} of cell {}, row {} of \"{}\" is {value} lx, expected a finite number",
                cell % self.cells[0],
                cell / self.cells[0],
                self.name
            ))),
        }
    }
}

impl GroupMap {
    /// Whether it has so many cells.
    fn is_of(&self, cells: usize) -> bool {
        self.illuminance.len() == cells && self.rgb.as_ref().is_none_or(|rgb| rgb.len() == cells)
    }

    /// Mean E of the cells that have a value, lx; 0 where none has.
    pub fn mean(&self, has_value: &[bool]) -> f64 {
        let values = self.illuminance.iter().zip(has_value).filter(|(_, has_value)| **has_value);
        let (sum, count) = values.fold((0.0, 0), |(sum, count), (lux, _)| (sum + f64::from(*lux), count + 1));
        sum / f64::from(count.max(1))
    }
}

impl Results {
    /// What a sensor reads, by its name.
    pub fn sensor(&self, name: &str) -> Option<&SensorReading> {
        self.sensors.iter().find(|reading| reading.name == name)
    }

    /// Whether a sensor reads less than its target, or an area does not surely have what is required of it.
    pub fn misses_target(&self) -> bool {
        let claim = self.run.claim;
        let mut areas = self.maps.iter().flat_map(|map| &map.areas).filter_map(|area| area.verdict(claim));
        let mut sensors = self.sensors.iter().filter_map(SensorReading::meets_target);
        areas.any(|verdict| verdict != Verdict::Met) || sensors.any(|met| !met)
    }
}

impl SensorReading {
    /// Whether E and daylight read as much as the target; `None` without a target. A sensor where no light can arrive
    /// misses it.
    pub fn meets_target(&self) -> Option<bool> {
        self.target.map(|target| self.has_value && met::reaches(self.illuminance + self.daylight, target))
    }

    /// The same in words, with what the error leaves open; `claim` is that of the run.
    pub(crate) fn judged(&self, claim: f64) -> Option<String> {
        let (reads, verdict) = self.meets_target().zip(self.verdict(claim))?;
        let reads = if reads { "met" } else { "missed" };
        Some(match verdict {
            Verdict::Undecided { .. } => format!("{reads}; {verdict}"),
            _ => reads.to_owned(),
        })
    }

    /// Whether E and daylight surely reach the target; `None` without a target. `claim` is that of the run.
    pub fn verdict(&self, claim: f64) -> Option<Verdict> {
        self.target.map(|target| match self.has_value {
            true => Verdict::of(self.illuminance + self.daylight, self.standard_error, target, claim),
            false => Verdict::Missed,
        })
    }

    /// Its name, with what it measures if that isn't a flat cell.
    pub(crate) fn title(&self) -> String {
        match self.measure {
            Measure::Plane => self.name.clone(),
            measure => format!("{}, {}", self.name, measure.name()),
        }
    }
}
