//! The summary for programs: one JSON object, keys in a fixed order, each with its unit in its name.
//!
//! `luxmap`, `scene`, `scene_sha256`, `method`, `tree`, `seed`, `passes`, `nearest`, `radius_m`, `photons_emitted`,
//! `photons_stored`, `photon_rays`, `gather_rays`, `left_out_mean` and `left_out_max` (share of a point's light that
//! weak luminaires may have brought), `threads`, `triangles`, `luminaires`, `maintenance_factor` (smallest and largest
//! of the luminaires, null where the scene gives none: the installation is new), then
//! - `planes`: `name`, `corner_m`, `along_m`, `across_m`, `cells`, and the figures of [`Statistics`]; those in lx are
//!   null where no cell has a value; `without_value`: how many cells have none because they are `shut_off` by a closed
//!   body, `covered`, or because there was `no_way_found` for light; `groups`: `name`, `mean_lx` and `share` of the
//!   plane's mean of each light group, where they are told apart; `areas` where the scene asks for some: `name`,
//!   `kind`, figures as above, `required_mean_lx` and `required_u0` (null where nothing is required), `required_met`
//!   (null where that isn't decided, too), `required_verdict` (in words); keys with `error` are standard errors (1 σ)
//!   of the figures;
//! - `surfaces`: `name`, `spacing_m`, `samples_with_value`, `samples_without_value`, `area_m2`, `flux_lm` (Σ E A), and
//!   figures weighed by area, null where no sample has a value; `without_value` as above;
//! - `sensors`: `name`, `measure`, `position_m`, `normal`, `illuminance_lx` and `standard_error_lx` (null where no
//!   light can arrive; `no_value_because` says why), `target_lx`, `target_met` (whether it reads as much; null without
//!   a target), `target_verdict` (in words, with what the error leaves open); `rgb_lx` in coloured scenes; `groups`:
//!   `name`, `illuminance_lx` and `standard_error_lx` of each light group, where they are told apart;
//! - `cameras`: `name`, `eye_m`, `forward`, `up`, `fov_degrees`, `pixels`, `rays_per_pixel`, `mean_lx` (of what is
//!   seen), `relative_standard_error` (of a pixel's E), `mean_luminance_cd_m2`, `max_luminance_cd_m2`;
//! - `flux`: `emitted_lm`, `absorbed_lm`, `escaped_lm`, `cut_off_lm`;
//! - `stages`: `name` and `seconds` in the order they ran; `total_s`; `peak_memory_bytes` (null where unknown);
//!   `bvh_memory_bytes`;
//! - `warnings`: sentences.

use serde::Serialize;

use crate::gather::reach::Standing;
use crate::results::{
    AreaFigures, CameraImage, FluxBalance, GroupMap, GroupReading, IlluminanceMap, Results, Run, SensorReading,
    Statistics, SurfaceMap, Verdict, statistics, without,
};

/// The summary as JSON, indented, with a line end: what `summary.json` holds and `--json` prints. Numbers have all
/// their digits; one that isn't finite is null.
pub fn summary(results: &Results) -> String {
    let mut text =
        serde_json::to_string_pretty(&SummaryJson::new(results)).expect("numbers, texts and lists make JSON");
    text.push('\n');
    text
}

#[derive(Serialize)]
struct SummaryJson<'a> {
    luxmap: &'static str,
    scene: &'a str,
    scene_sha256: &'a str,
    method: &'a str,
    tree: &'a str,
    seed: u64,
    passes: u32,
    nearest: usize,
    radius_m: f64,
    photons_emitted: u64,
    photons_stored: u64,
    photon_rays: u64,
    gather_rays: u64,
    left_out_mean: f64,
    left_out_max: f64,
    threads: usize,
    triangles: usize,
    luminaires: usize,
    maintenance_factor: Option<[f64; 2]>,
    planes: Vec<PlaneJson<'a>>,
    surfaces: Vec<SurfaceJson<'a>>,
    sensors: Vec<SensorJson<'a>>,
    cameras: Vec<CameraJson<'a>>,
    flux: FluxJson,
    stages: Vec<StageJson>,
    total_s: f64,
    peak_memory_bytes: Option<u64>,
    bvh_memory_bytes: u64,
    warnings: &'a [String],
}

#[derive(Serialize)]
struct PlaneJson<'a> {
    name: &'a str,
    corner_m: [f64; 3],
    along_m: [f64; 3],
    across_m: [f64; 3],
    cells: [usize; 2],
    cells_with_value: usize,
    cells_without_value: usize,
    without_value: Without,
    mean_lx: Option<f64>,
    min_lx: Option<f64>,
    max_lx: Option<f64>,
    mean_error_lx: Option<f64>,
    min_error_lx: Option<f64>,
    max_error_lx: Option<f64>,
    median_lx: Option<f64>,
    deviation_lx: Option<f64>,
    mean_standard_error_lx: Option<f64>,
    largest_standard_error_lx: Option<f64>,
    uniformity_u0: Option<f64>,
    diversity_ud: Option<f64>,
    uniformity_error: Option<f64>,
    diversity_error: Option<f64>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    areas: Vec<AreaJson<'a>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    groups: Vec<PlaneGroup<'a>>,
}

/// How many cells or samples have no value for each reason.
#[derive(Serialize)]
struct Without {
    shut_off: usize,
    covered: usize,
    no_way_found: usize,
}

impl Without {
    fn of(standing: &[Standing]) -> Self {
        let [shut_off, covered, no_way_found] = without::counts(standing);
        Self { shut_off, covered, no_way_found }
    }
}

#[derive(Serialize)]
struct PlaneGroup<'a> {
    name: &'a str,
    mean_lx: Option<f64>,
    share: Option<f64>,
}

#[derive(Serialize)]
struct AreaJson<'a> {
    name: &'a str,
    kind: &'static str,
    cells_with_value: usize,
    cells_without_value: usize,
    mean_lx: Option<f64>,
    min_lx: Option<f64>,
    max_lx: Option<f64>,
    mean_error_lx: Option<f64>,
    min_error_lx: Option<f64>,
    max_error_lx: Option<f64>,
    uniformity_u0: Option<f64>,
    diversity_ud: Option<f64>,
    uniformity_error: Option<f64>,
    diversity_error: Option<f64>,
    required_mean_lx: Option<f64>,
    required_u0: Option<f64>,
    required_met: Option<bool>,
    required_verdict: Option<String>,
}

#[derive(Serialize)]
struct SurfaceJson<'a> {
    name: &'a str,
    spacing_m: f64,
    samples_with_value: usize,
    samples_without_value: usize,
    without_value: Without,
    area_m2: f64,
    flux_lm: f64,
    mean_lx: Option<f64>,
    min_lx: Option<f64>,
    max_lx: Option<f64>,
    mean_error_lx: Option<f64>,
    min_error_lx: Option<f64>,
    max_error_lx: Option<f64>,
    mean_standard_error_lx: Option<f64>,
    largest_standard_error_lx: Option<f64>,
    uniformity_u0: Option<f64>,
    diversity_ud: Option<f64>,
    uniformity_error: Option<f64>,
    diversity_error: Option<f64>,
}

#[derive(Serialize)]
struct SensorJson<'a> {
    name: &'a str,
    measure: &'static str,
    position_m: [f64; 3],
    normal: [f64; 3],
    illuminance_lx: Option<f64>,
    standard_error_lx: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    no_value_because: Option<&'static str>,
    target_lx: Option<f64>,
    target_met: Option<bool>,
    target_verdict: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rgb_lx: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    groups: Vec<SensorGroup<'a>>,
}

#[derive(Serialize)]
struct SensorGroup<'a> {
    name: &'a str,
    illuminance_lx: Option<f64>,
    standard_error_lx: Option<f64>,
}

#[derive(Serialize)]
struct CameraJson<'a> {
    name: &'a str,
    eye_m: [f64; 3],
    forward: [f64; 3],
    up: [f64; 3],
    fov_degrees: f64,
    pixels: [usize; 2],
    rays_per_pixel: u64,
    mean_lx: f64,
    relative_standard_error: f64,
    mean_luminance_cd_m2: f64,
    max_luminance_cd_m2: f64,
}

#[derive(Serialize)]
struct FluxJson {
    emitted_lm: f64,
    absorbed_lm: f64,
    escaped_lm: f64,
    cut_off_lm: f64,
}

#[derive(Serialize)]
struct StageJson {
    name: &'static str,
    seconds: f64,
}

impl<'a> SummaryJson<'a> {
    fn new(results: &'a Results) -> Self {
        let run = &results.run;
        Self {
            luxmap: env!("CARGO_PKG_VERSION"),
            scene: &run.scene,
            scene_sha256: &run.scene_hash,
            method: &run.method,
            tree: &run.tree,
            seed: run.seed,
            passes: run.passes,
            nearest: run.nearest,
            radius_m: run.radius,
            photons_emitted: run.photons_emitted,
            photons_stored: run.photons_stored,
            photon_rays: run.photon_rays,
            gather_rays: run.gather_rays,
            left_out_mean: run.left_out[0],
            left_out_max: run.left_out[1],
            threads: run.threads,
            triangles: run.triangles,
            luminaires: run.luminaires,
            maintenance_factor: run.maintenance_factor,
            planes: results.maps.iter().map(|map| PlaneJson::new(map, run)).collect(),
            surfaces: results.surfaces.iter().map(SurfaceJson::new).collect(),
            sensors: results.sensors.iter().map(|sensor| SensorJson::new(sensor, run)).collect(),
            cameras: results.images.iter().map(CameraJson::new).collect(),
            flux: FluxJson::new(&run.flux),
            stages: stages(run),
            total_s: run.total_seconds,
            peak_memory_bytes: (run.peak_memory > 0).then_some(run.peak_memory),
            bvh_memory_bytes: run.bvh_memory,
            warnings: &run.warnings,
        }
    }
}

impl<'a> PlaneJson<'a> {
    fn new(map: &'a IlluminanceMap, run: &'a Run) -> Self {
        let found = statistics(map);
        let known = |figure: fn(&Statistics) -> f64| (found.cells > 0).then(|| figure(&found));
        let group = |(group, name): (&GroupMap, &'a String)| {
            let mean = group.mean(&map.has_value);
            let share = (found.mean.0 > 0.0).then(|| mean / found.mean.0);
            PlaneGroup { name, mean_lx: (found.cells > 0).then_some(mean), share }
        };
        Self {
            name: &map.name,
            corner_m: map.corner.to_array(),
            along_m: map.along.to_array(),
            across_m: map.across.to_array(),
            cells: map.cells,
            cells_with_value: found.cells,
            cells_without_value: found.cells_without_value,
            without_value: Without::of(&map.standing),
            mean_lx: known(|s| s.mean.0),
            min_lx: known(|s| s.min.0),
            max_lx: known(|s| s.max.0),
            mean_error_lx: known(|s| s.errors.mean.0),
            min_error_lx: known(|s| s.errors.min.0),
            max_error_lx: known(|s| s.errors.max.0),
            median_lx: known(|s| s.median.0),
            deviation_lx: known(|s| s.deviation.0),
            mean_standard_error_lx: known(|s| s.mean_standard_error.0),
            largest_standard_error_lx: known(|s| s.largest_standard_error.0),
            uniformity_u0: known(|s| s.uniformity),
            diversity_ud: known(|s| s.diversity),
            uniformity_error: known(|s| s.errors.uniformity),
            diversity_error: known(|s| s.errors.diversity),
            groups: map.groups.iter().zip(&run.groups).map(group).collect(),
            areas: map.areas.iter().map(|area| AreaJson::new(area, run.claim)).collect(),
        }
    }
}

impl<'a> AreaJson<'a> {
    fn new(area: &'a AreaFigures, claim: f64) -> Self {
        let found = &area.figures;
        let known = |figure: f64| (found.cells > 0).then_some(figure);
        Self {
            name: &area.name,
            kind: area.kind.name(),
            cells_with_value: found.cells,
            cells_without_value: found.cells_without_value,
            mean_lx: known(found.mean.0),
            min_lx: known(found.min.0),
            max_lx: known(found.max.0),
            mean_error_lx: known(found.errors.mean.0),
            min_error_lx: known(found.errors.min.0),
            max_error_lx: known(found.errors.max.0),
            uniformity_u0: known(found.uniformity),
            diversity_ud: known(found.diversity),
            uniformity_error: known(found.errors.uniformity),
            diversity_error: known(found.errors.diversity),
            required_mean_lx: area.required.mean,
            required_u0: area.required.uniformity,
            required_met: area.verdict(claim).and_then(Verdict::met),
            required_verdict: area.verdict(claim).map(|verdict| verdict.to_string()),
        }
    }
}

impl<'a> SurfaceJson<'a> {
    fn new(map: &'a SurfaceMap) -> Self {
        let found = map.figures();
        let known = |figure: f64| (found.samples > 0).then_some(figure);
        Self {
            name: &map.name,
            spacing_m: map.spacing,
            samples_with_value: found.samples,
            samples_without_value: found.samples_without_value,
            without_value: Without::of(&map.standing),
            area_m2: found.area,
            flux_lm: found.flux.0,
            mean_lx: known(found.mean.0),
            min_lx: known(found.min.0),
            max_lx: known(found.max.0),
            mean_error_lx: known(found.errors.mean.0),
            min_error_lx: known(found.errors.min.0),
            max_error_lx: known(found.errors.max.0),
            mean_standard_error_lx: known(found.mean_standard_error.0),
            largest_standard_error_lx: known(found.largest_standard_error.0),
            uniformity_u0: known(found.uniformity),
            diversity_ud: known(found.diversity),
            uniformity_error: known(found.errors.uniformity),
            diversity_error: known(found.errors.diversity),
        }
    }
}

impl<'a> SensorJson<'a> {
    fn new(sensor: &'a SensorReading, run: &'a Run) -> Self {
        let group = |(group, name): (&GroupReading, &'a String)| SensorGroup {
            name,
            illuminance_lx: sensor.has_value.then_some(group.illuminance),
            standard_error_lx: sensor.has_value.then_some(group.standard_error),
        };
        Self {
            name: &sensor.name,
            measure: sensor.measure.name(),
            position_m: sensor.position.to_array(),
            normal: sensor.normal.to_array(),
            illuminance_lx: sensor.has_value.then_some(sensor.illuminance),
            standard_error_lx: sensor.has_value.then_some(sensor.standard_error),
            no_value_because: (!sensor.has_value).then(|| sensor.standing.reason()),
            target_lx: sensor.target,
            target_met: sensor.meets_target(),
            target_verdict: sensor.judged(run.claim),
            rgb_lx: sensor.rgb.filter(|_| sensor.has_value),
            groups: sensor.groups.iter().zip(&run.groups).map(group).collect(),
        }
    }
}

impl<'a> CameraJson<'a> {
    fn new(image: &'a CameraImage) -> Self {
        let [mean_luminance, max_luminance] = image.luminances();
        Self {
            name: &image.name,
            eye_m: image.eye.to_array(),
            forward: image.forward.to_array(),
            up: image.up.to_array(),
            fov_degrees: image.fov,
            pixels: image.pixels,
            rays_per_pixel: image.samples,
            mean_lx: image.mean_illuminance(),
            relative_standard_error: image.claim,
            mean_luminance_cd_m2: mean_luminance,
            max_luminance_cd_m2: max_luminance,
        }
    }
}

impl FluxJson {
    fn new(flux: &FluxBalance) -> Self {
        Self {
            emitted_lm: flux.emitted.0,
            absorbed_lm: flux.absorbed.0,
            escaped_lm: flux.escaped.0,
            cut_off_lm: flux.cut_off.0,
        }
    }
}

/// Wall time of each stage.
fn stages(run: &Run) -> Vec<StageJson> {
    run.seconds.iter().map(|&(name, seconds)| StageJson { name, seconds }).collect()
}
