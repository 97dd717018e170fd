//! The live page: one HTML file, without a network, in which luminaires are dimmed and the map follows.
//!
//! The map is the sum of the luminaires' layers, each times its dimming, and what does not dim. [`Page::write`] packs
//! the layers into the page (`live/layers.rs`); its script adds them up, draws, reads the sensors and finds the dimming
//! of least power (`live/*.js`, plain JavaScript, no library).

mod layers;
mod units;

use std::io::Write as _;
use std::path::Path;

use maud::Render;
use serde::Serialize;

use crate::error::Error;
use crate::files;
use layers::Packer;
use units::Unit;

/// A page is no larger, bytes, unless names and outlines alone fill it.
pub const MOST_BYTES: usize = 3_000_000;

/// Most by which the page's map differs from the sum of the layers given it, lx, at any cell and any dimming.
pub const MAP_ERROR: f64 = 0.5;

/// The same for a sensor in its own place, lx.
pub const SENSOR_ERROR: f64 = 0.01;

/// Steps of standard errors: of sensors, in the largest; of cells, in their light.
const ERROR_STEP: f64 = 1e-3;
const CELL_ERROR_STEP: f64 = 5e-3;

/// Cells along the longer side that a map keeps before luminaires are put together.
const FEWEST_CELLS: usize = 30;

const PAGE: &str = include_str!("live/page.html");
const STYLE: &str = include_str!("live/page.css");
const SCRIPT: [&str; 4] = [
    include_str!("live/data.js"),
    include_str!("live/solve.js"),
    include_str!("live/map.js"),
    include_str!("live/page.js"),
];

/// What a live page shows.
#[derive(Clone, Debug)]
pub struct Page<'a> {
    /// Headline.
    pub title: &'a str,
    /// How the layers were computed, in a sentence.
    pub about: String,
    /// Unit of what luminaires draw: W, or what stands for it.
    pub unit: &'a str,
    /// What can be dimmed.
    pub luminaires: Vec<LiveLamp>,
    /// Measuring planes; the first is shown first.
    pub planes: Vec<Map>,
    /// Illuminance sensors.
    pub sensors: Vec<LiveSensor>,
    /// Level of each luminaire in the command's solution for the sensors' targets. “Meet the targets” takes it as long
    /// as targets and places are those of the file; for others the page solves.
    pub optimum: Option<Vec<f64>>,
    /// σ by which a sensor must be on the right side of its target to be called met.
    pub sigmas: f64,
}

/// A luminaire that can be dimmed.
#[derive(Clone, Debug)]
pub struct LiveLamp {
    /// Its name, by which dimming is saved and loaded.
    pub name: String,
    /// Its light group.
    pub group: String,
    /// Corners in the plan, world x and y, m; a single one is drawn as a dot.
    pub outline: Vec<[f64; 2]>,
    /// Dimming at the start, 0 … 1 of full output.
    pub level: f64,
    /// Lowest level that is not off; 0 if there is none.
    pub least: f64,
    /// Levels, rising from `least` to 1, and power there, W; straight lines in between. At least one.
    pub power: Vec<[f64; 2]>,
    /// Power when off, W.
    pub off: f64,
}

/// Layers of a measuring plane. Cells are row by row from the corner, along first.
#[derive(Clone, Debug)]
pub struct Map {
    /// Name of the plane.
    pub name: String,
    /// Cells along.
    pub columns: usize,
    /// Cells across.
    pub rows: usize,
    /// Corner of the first cell, world, m.
    pub corner: [f64; 3],
    /// The plane's side along the columns, m.
    pub along: [f64; 3],
    /// The plane's side across, m.
    pub across: [f64; 3],
    /// Whether a cell has a value.
    pub mask: Vec<bool>,
    /// For each luminaire its light at full output, lx.
    pub layers: Vec<Vec<f32>>,
    /// Light that does not dim, lx: daylight, luminaires that are not in the list.
    pub offset: Vec<f32>,
    /// Standard error (1 σ) of a cell's light as a share of it.
    pub error: Vec<f32>,
}

/// An illuminance sensor.
#[derive(Clone, Debug)]
pub struct LiveSensor {
    /// Its name.
    pub name: String,
    /// Where it is, world, m.
    pub position: [f64; 3],
    /// The plane it lies on, along which it may be dragged.
    pub plane: Option<usize>,
    /// For each luminaire what it brings at full output, lx.
    pub influence: Vec<f64>,
    /// Standard error (1 σ) of that, lx; independent from luminaire to luminaire.
    pub error: Vec<f64>,
    /// What renders took from the covariance of the influence, as vectors u of Σ − u uᵀ: see [`crate::dimming::sure`].
    pub told: Vec<Vec<f64>>,
    /// Standard error (1 σ) of a render that checks it, lx; as of the influence where nothing is said.
    pub noise: Option<f64>,
    /// Light that does not dim, lx.
    pub offset: f64,
    /// Illuminance asked for, lx.
    pub target: Option<f64>,
    /// How far above the target it may be, lx; any far without.
    pub tolerance: Option<f64>,
}

impl Page<'_> {
    /// Writes the page, no larger than [`MOST_BYTES`].
    ///
    /// The map errs by [`MAP_ERROR`] at most, sensors by [`SENSOR_ERROR`], as long as nothing has to be left out. Where
    /// the page would be too large, blocks of 2 × 2, 4 × 4 … cells become one, as long as 30 remain along the longer
    /// side; then the luminaires of a group are put together under one slider, and cells again. The page says so.
    ///
    /// # Panics
    /// If a layer, mask or influence has another length than its plane or luminaires, or a value is not finite.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        let html = self.html();
        files::write_whole(path, &mut |out| out.write_all(html.as_bytes()))
    }

    /// The page as HTML; see [`Page::write`].
    pub fn html(&self) -> String {
        self.check();
        let single = units::single(&self.luminaires);
        let groups = units::groups(&self.luminaires);
        let most = self.planes.iter().map(|plane| plane.columns.max(plane.rows)).max().unwrap_or(1);
        let blocks = || std::iter::successors(Some(1), |block| Some(block * 2)).take_while(|&block| block < 2 * most);
        let fine =
            blocks().take_while(|&block| block == 1 || most / block >= FEWEST_CELLS).map(|block| (&single, block));
        let coarse = blocks().map(|block| (&groups, block));
        let mut html = String::new();
        for (units, block) in fine.chain(coarse) {
            html = self.packed(units, block);
            if html.len() <= MOST_BYTES {
                break;
            }
        }
        html
    }

    /// What callers promise.
    fn check(&self) {
        let lamps = self.luminaires.len();
        for plane in &self.planes {
            let cells = plane.columns * plane.rows;
            assert!(cells > 0, "plane {} has cells", plane.name);
            assert_eq!(plane.layers.len(), lamps, "layers of plane {}", plane.name);
            assert_eq!(plane.mask.len(), cells, "mask of plane {}", plane.name);
            for layer in plane.layers.iter().chain([&plane.offset, &plane.error]) {
                assert_eq!(layer.len(), cells, "a layer of plane {}", plane.name);
                let known = layer.iter().zip(&plane.mask).filter(|&(_, &has_value)| has_value);
                assert!(known.into_iter().all(|(e, _)| e.is_finite()), "a layer of plane {} is finite", plane.name);
            }
        }
        for sensor in &self.sensors {
            for row in sensor.told.iter().chain([&sensor.influence, &sensor.error]) {
                assert!(row.len() == lamps && row.iter().all(|e| e.is_finite()), "influence on {}", sensor.name);
            }
        }
        for lamp in &self.luminaires {
            assert!(!lamp.power.is_empty() && !lamp.outline.is_empty(), "power and outline of {}", lamp.name);
        }
    }

    /// The page with these units for luminaires and blocks of so many cells.
    fn packed(&self, units: &[Unit<'_>], block: usize) -> String {
        let mut packer = Packer::default();
        let planes = self.planes.iter().map(|plane| PlaneData::pack(plane, units, block, &mut packer)).collect();
        let step = layers::step(SENSOR_ERROR, units.len());
        let influence: Vec<f64> =
            self.sensors.iter().flat_map(|sensor| units::sums(units, &sensor.influence)).collect();
        if !influence.is_empty() {
            packer.add(&influence, units.len(), step, |_| true);
        }
        let (error_step, renders) = self.pack_errors(units, &mut packer);
        let merged = units.len() < self.luminaires.len();
        let scene = SceneData {
            about: &self.about,
            unit: self.unit,
            notes: self.notes(units.len(), block),
            luminaires: units,
            planes,
            sensors: self.sensors.iter().map(SensorData::of).collect(),
            influence_step: step,
            error_step,
            renders,
            sigmas: self.sigmas,
            optimum: self.optimum.as_deref().filter(|_| !merged),
            colours: colours(),
        };
        let json = serde_json::to_string(&scene).expect("finite numbers and text").replace('<', "\\u003c");
        PAGE.replace("/*style*/", &[include_str!("report.css"), STYLE].concat())
            .replace("/*script*/", &SCRIPT.concat())
            .replace("<!--title-->", &self.title.render().into_string())
            .replace("<!--version-->", env!("CARGO_PKG_VERSION"))
            .replace("<!--scene-->", &json)
            .replace("<!--layers-->", &packer.finish())
    }

    /// Packs the sensors' errors, then what each render took from them; returns their step and the number of renders.
    fn pack_errors(&self, units: &[Unit<'_>], packer: &mut Packer) -> (f64, usize) {
        let renders = self.sensors.iter().map(|sensor| sensor.told.len()).max().unwrap_or(0);
        let errors = self.sensors.iter().flat_map(|sensor| {
            let squares: Vec<f64> = sensor.error.iter().map(|error| error * error).collect();
            units::sums(units, &squares).map(f64::sqrt).collect::<Vec<f64>>()
        });
        let told = |render: usize| -> Vec<f64> {
            let none = || vec![0.0; units.len()];
            let of = |told: &Vec<f64>| units::sums(units, told).collect::<Vec<f64>>();
            self.sensors.iter().flat_map(|sensor| sensor.told.get(render).map_or_else(none, of)).collect()
        };
        let all: Vec<Vec<f64>> = std::iter::once(errors.collect()).chain((0..renders).map(told)).collect();
        let largest = all.iter().flatten().fold(0.0_f64, |most, error| most.max(error.abs()));
        let step = if largest > 0.0 { largest * ERROR_STEP } else { 1.0 };
        if !self.sensors.is_empty() {
            all.iter().for_each(|rows| packer.add(rows, units.len(), step, |_| true));
        }
        (step, renders)
    }

    /// What was left out for the page's size.
    fn notes(&self, units: usize, block: usize) -> Vec<String> {
        let mut notes = Vec::new();
        if units < self.luminaires.len() {
            let lamps = self.luminaires.len();
            notes.push(format!(
                "{lamps} luminaires are too many for this page: it has layers of their {units} groups, and the luminaires \
                 of a group are dimmed alike. They start from their mean."
            ));
        }
        if block > 1 {
            notes.push(format!(
                "For the page’s size, {block} × {block} cells of the map are shown as one, their mean. Sensors in their own \
                 places are as computed."
            ));
        }
        notes
    }
}

/// What the script finds in the page.
#[derive(Serialize)]
struct SceneData<'a> {
    about: &'a str,
    unit: &'a str,
    notes: Vec<String>,
    luminaires: &'a [Unit<'a>],
    planes: Vec<PlaneData<'a>>,
    sensors: Vec<SensorData<'a>>,
    influence_step: f64,
    error_step: f64,
    /// Vectors that each sensor has beside its errors.
    renders: usize,
    sigmas: f64,
    optimum: Option<&'a [f64]>,
    colours: String,
}

/// A plane without its layers. Packed in this order: whether cells have a value, the light that does not dim, cells'
/// errors, each unit's light.
#[derive(Serialize)]
struct PlaneData<'a> {
    name: &'a str,
    columns: usize,
    rows: usize,
    corner: [f64; 3],
    along: [f64; 3],
    across: [f64; 3],
    step: f64,
    error_step: f64,
}

impl<'a> PlaneData<'a> {
    fn pack(plane: &'a Map, units: &[Unit<'_>], block: usize, packer: &mut Packer) -> Self {
        let [columns, rows] = [plane.columns, plane.rows].map(|cells| cells.div_ceil(block));
        let blocks = layers::Blocks { cells: [plane.columns, plane.rows], blocks: [columns, rows], mask: &plane.mask };
        let step = layers::step(MAP_ERROR, units.len() + 1);
        let has_value = blocks.mask();
        let numbers: Vec<f64> = has_value.iter().map(|&has_value| f64::from(u8::from(has_value))).collect();
        packer.add(&numbers, columns, 1.0, |_| true);
        packer.add(&blocks.means(&[&plane.offset]), columns, step, |cell| has_value[cell]);
        packer.add(&blocks.means(&[&plane.error]), columns, CELL_ERROR_STEP, |cell| has_value[cell]);
        for unit in units {
            let members: Vec<&[f32]> = unit.members.iter().map(|&lamp| plane.layers[lamp].as_slice()).collect();
            packer.add(&blocks.means(&members), columns, step, |cell| has_value[cell]);
        }
        let Map { name, corner, along, across, .. } = plane;
        Self { name, columns, rows, corner: *corner, along: *along, across: *across, step, error_step: CELL_ERROR_STEP }
    }
}

/// A sensor without its influence.
#[derive(Serialize)]
struct SensorData<'a> {
    name: &'a str,
    position: [f64; 3],
    plane: Option<usize>,
    noise: Option<f64>,
    offset: f64,
    target: Option<f64>,
    tolerance: Option<f64>,
}

impl<'a> SensorData<'a> {
    fn of(sensor: &'a LiveSensor) -> Self {
        let LiveSensor { name, position, plane, noise, offset, target, tolerance, .. } = sensor;
        Self {
            name,
            position: *position,
            plane: *plane,
            noise: *noise,
            offset: *offset,
            target: *target,
            tolerance: *tolerance,
        }
    }
}

/// Viridis in 256 steps, `rrggbb` each.
fn colours() -> String {
    (0..256).map(|i| format!("{:x}", colorous::VIRIDIS.eval_rational(i, 256))).collect()
}
