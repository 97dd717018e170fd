//! Maps too large to be worked on as a whole: band by band, in bounded memory.
//!
//! A cell in work takes some hundred bytes, its result a few. So a large measuring plane is cut into bands of rows,
//! each computed by itself with the same passes and photons, and with some rows of its neighbours around it, since
//! cells help each other; only results are kept.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::results::outlines;
use super::warning::Warning;
use super::{Keeping, Settings, Stages, Stop, render_part, start};
use crate::embree::RayCaster;
use crate::error::Error;
use crate::gather::smooth;
use crate::progress::Progress;
use crate::render::plan::Plan;
use crate::results::{Extremes, GroupMap, IlluminanceMap, Results, areas};
use crate::scene::{MeasuringPlane, Scene};

/// Rows of neighbours on each side.
const HALO: usize = smooth::REACH;

/// Cells worked on at once where it is not known how much memory there is.
pub const MOST_CELLS: usize = 1 << 22;

/// Rows of a plane that are computed together.
struct RowBand {
    /// Those that are its own.
    rows: [usize; 2],
    /// Those and their neighbours.
    around: [usize; 2],
}

/// How many rows of a plane's bands are their own, if it is cut at all.
fn band_rows(plane: &MeasuringPlane, most_cells: usize) -> Option<usize> {
    let [columns, rows] = plane.cells;
    let fit = most_cells / columns;
    (rows > fit).then(|| fit.saturating_sub(2 * HALO).max(HALO)).filter(|own| *own + 2 * HALO < rows)
}

/// Most cells of a plane that are worked on at once.
pub(super) fn cells_at_once(plane: &MeasuringPlane, most_cells: usize) -> usize {
    band_rows(plane, most_cells).map_or(plane.len(), |own| (own + 2 * HALO) * plane.cells[0])
}

/// Renders with at most about `most_cells` cells in work. Bits depend on where bands are cut.
///
/// Where passes are run until an error is reached, the middle band decides how many; all others have as many.
///
/// # Errors
/// Where states are to be merged of a plane that is cut.
pub fn render_in_bands(
    scene: &Scene,
    plan: &Plan,
    settings: &Settings,
    progress: &dyn Progress,
    keeping: &Keeping<'_>,
    most_cells: usize,
) -> Result<Option<Results>, Error> {
    settings.stop.check()?;
    let cut = |plane: &&MeasuringPlane| band_rows(plane, most_cells).is_some();
    let Some(first_cut) = scene.planes.iter().find(cut) else {
        return super::render_and_keep(scene, plan, settings, progress, keeping);
    };
    if !keeping.states.is_empty() {
        return Err(Error::Usage(format!(
            "plane \"{}\": found {} cells, which are computed in bands, expected at most {most_cells} where states are \
             merged",
            first_cut.name,
            first_cut.len(),
        )));
    }
    let (caster, seconds) = start(scene, progress)?;
    let mut work = Work { scene, plan, settings, progress, keeping, caster: &caster, seconds, all: None };
    let rest = Scene { planes: scene.planes.iter().filter(|plane| !cut(plane)).cloned().collect(), ..scene.clone() };
    if !(rest.planes.is_empty() && rest.sensors.is_empty() && rest.surfaces.is_empty() && rest.cameras.is_empty()) {
        work.part(&rest, settings, REST)?;
    }
    let mut maps = Vec::new();
    for (index, plane) in scene.planes.iter().enumerate().filter(|(_, plane)| cut(plane)) {
        maps.push(work.plane(index, plane, most_cells)?);
    }
    let Some(mut results) = work.all else { return Ok(None) };
    let mut whole = std::mem::take(&mut results.maps).into_iter();
    let mut cut_ones = maps.into_iter().flatten();
    results.maps =
        scene.planes.iter().filter_map(|plane| if cut(&plane) { cut_ones.next() } else { whole.next() }).collect();
    if let Some(percent) = settings.stop.error() {
        for map in &results.maps {
            let claim = claim(map);
            if settings.stop.passes().is_none() && 100.0 * claim > 1.05 * percent {
                let (plane, error, wanted) = (map.name.clone(), 100.0 * claim, percent);
                results.run.warnings.push(Warning::BandsUncertain { plane, error, wanted }.to_string());
            }
        }
    }
    Ok(Some(results))
}

/// Name of the part that is not cut.
const REST: &str = "rest";

/// Each part's state has a file of its own, whose name gives the plane and its rows: other cuts find none of theirs.
fn part_of(checkpoint: &Path, part: &str) -> PathBuf {
    let mut name = OsString::from(checkpoint);
    name.push(format!("-{part}"));
    name.into()
}

/// The files that hold a run's state: `checkpoint` itself, or one for each part of a run in bands.
pub fn checkpoint_files(checkpoint: &Path) -> Vec<PathBuf> {
    let part_names = |name: &str| name == REST || name.split('-').all(|number| number.parse::<usize>().is_ok());
    let is_part = |path: &Path| {
        let (name, whole) = (path.file_name()?.to_str()?, checkpoint.file_name()?.to_str()?);
        Some(name == whole || part_names(name.strip_prefix(whole)?.strip_prefix('-')?))
    };
    let beside = checkpoint.parent().into_iter().flat_map(std::fs::read_dir);
    beside.flatten().flatten().map(|entry| entry.path()).filter(|path| is_part(path) == Some(true)).collect()
}

/// Claimed standard error of a map, root mean square, relative to its mean.
fn claim(map: &IlluminanceMap) -> f64 {
    let (mut sum, mut variance, mut count) = (0.0, 0.0, 0.0_f64);
    for ((lux, error), _) in
        map.illuminance.iter().zip(&map.standard_error).zip(&map.has_value).filter(|(_, has)| **has)
    {
        (sum, variance, count) = (sum + lux, variance + error * error, count + 1.0);
    }
    if sum > 0.0 { (variance * count).sqrt() / sum } else { 0.0 }
}

/// What is done so far.
struct Work<'a> {
    scene: &'a Scene,
    plan: &'a Plan,
    settings: &'a Settings,
    progress: &'a dyn Progress,
    keeping: &'a Keeping<'a>,
    caster: &'a RayCaster,
    /// Wall time before the first part.
    seconds: Stages,
    /// Results of all parts, but for the maps of bands.
    all: Option<Results>,
}

impl Work<'_> {
    /// Computes a part of the scene, and returns the maps of its planes if it is a band.
    fn part(&mut self, scene: &Scene, settings: &Settings, name: &str) -> Result<Option<u32>, Error> {
        let started = Instant::now();
        let checkpoint = self.keeping.checkpoint.map(|path| part_of(path, name));
        let keeping = Keeping { checkpoint: checkpoint.as_deref(), states: &[], team: self.keeping.team };
        let seconds = std::mem::take(&mut self.seconds);
        let earlier: f64 = seconds.iter().map(|(_, seconds)| seconds).sum();
        let found = render_part(scene, self.plan, settings, self.progress, &keeping, self.caster, seconds)?;
        let Some(mut found) = found else { return Ok(None) };
        found.run.total_seconds = started.elapsed().as_secs_f64() + earlier;
        let passes = found.run.passes;
        match &mut self.all {
            None => self.all = Some(found),
            Some(all) => all.join(found),
        }
        Ok(Some(passes))
    }

    /// The map of a plane that is cut; `None` where another process leads.
    fn plane(
        &mut self,
        number: usize,
        plane: &MeasuringPlane,
        most_cells: usize,
    ) -> Result<Option<IlluminanceMap>, Error> {
        let [columns, rows] = plane.cells;
        let own = band_rows(plane, most_cells).unwrap_or(rows);
        let bands: Vec<RowBand> = (0..rows)
            .step_by(own)
            .map(|first| RowBand {
                rows: [first, (first + own).min(rows)],
                around: [first.saturating_sub(HALO), (first + own + HALO).min(rows)],
            })
            .collect();
        let middle = bands.len() / 2;
        let mut settings = self.settings.clone();
        if let Some(time) = settings.stop.time() {
            settings.stop = settings.stop.or_within(time / u32::try_from(bands.len()).unwrap_or(u32::MAX));
        }
        let mut found: Vec<Option<IlluminanceMap>> = bands.iter().map(|_| None).collect();
        for index in std::iter::once(middle).chain((0..bands.len()).filter(|&index| index != middle)) {
            let RowBand { around: [low, high], .. } = bands[index];
            let share = |row: usize| row as f64 / rows as f64;
            let band = MeasuringPlane {
                corner: plane.corner + plane.across * share(low),
                across: plane.across * share(high - low),
                cells: [columns, high - low],
                areas: Default::default(),
                ..plane.clone()
            };
            let scene = Scene {
                planes: vec![band],
                sensors: Vec::new(),
                surfaces: Vec::new(),
                cameras: Vec::new(),
                ..self.scene.clone()
            };
            let Some(passes) = self.part(&scene, &settings, &format!("{number}-{low}-{high}"))? else { continue };
            settings.stop = Stop::after(passes);
            let map = self.all.as_mut().and_then(|all| all.maps.pop());
            found[index] = map.map(|map| map.with_rows(bands[index].rows.map(|row| row - low)));
        }
        let mut parts = found.into_iter().flatten();
        let Some(mut map) = parts.next() else { return Ok(None) };
        parts.for_each(|part| map.append(part));
        map.corner = plane.corner + self.scene.centre;
        map.across = plane.across;
        map.cells = plane.cells;
        map.outlines = outlines(self.scene, plane);
        map.areas = areas::figures(&plane.areas, &map, &[]);
        Ok(Some(map))
    }
}

impl Results {
    /// Adds what a further part of the scene found; its maps come last.
    fn join(&mut self, other: Self) {
        self.maps.extend(other.maps);
        let (run, part) = (&mut self.run, other.run);
        run.photons_emitted += part.photons_emitted;
        run.photons_stored += part.photons_stored;
        run.photon_rays += part.photon_rays;
        run.gather_rays += part.gather_rays;
        run.passes = run.passes.max(part.passes);
        run.claim = run.claim.max(part.claim);
        run.total_seconds += part.total_seconds;
        run.peak_memory = run.peak_memory.max(part.peak_memory);
        run.left_out = [0, 1].map(|index| run.left_out[index].max(part.left_out[index]));
        for (stage, seconds) in part.seconds {
            match run.seconds.iter_mut().find(|(known, _)| *known == stage) {
                Some((_, sum)) => *sum += seconds,
                None => run.seconds.push((stage, seconds)),
            }
        }
        part.warnings.into_iter().for_each(|warning| {
            if !run.warnings.contains(&warning) {
                run.warnings.push(warning);
            }
        });
    }
}

impl IlluminanceMap {
    /// The same map of some of its rows; geometry is left to the caller.
    fn with_rows(mut self, [first, end]: [usize; 2]) -> Self {
        let range = first * self.cells[0]..end * self.cells[0];
        fn keep<T>(cells: &mut Vec<T>, range: &std::ops::Range<usize>) {
            cells.truncate(range.end);
            cells.drain(..range.start);
            cells.shrink_to_fit();
        }
        // All fields by name: one that has a value in each cell must not be forgotten.
        let Self {
            name: _,
            corner: _,
            along: _,
            across: _,
            cells: _,
            illuminance,
            rgb,
            direct,
            standard_error,
            has_value,
            standing,
            outlines: _,
            extremes: _,
            areas: _,
            groups,
        } = &mut self;
        keep(illuminance, &range);
        keep(standard_error, &range);
        keep(has_value, &range);
        keep(standing, &range);
        rgb.iter_mut().for_each(|rgb| keep(rgb, &range));
        direct.iter_mut().for_each(|direct| keep(direct, &range));
        for GroupMap { illuminance, rgb } in groups {
            keep(illuminance, &range);
            rgb.iter_mut().for_each(|rgb| keep(rgb, &range));
        }
        self.cells[1] = end - first;
        self
    }

    /// Puts the rows of another map behind these.
    fn append(&mut self, mut other: Self) {
        self.extremes = join(self, &other);
        self.illuminance.append(&mut other.illuminance);
        self.standard_error.append(&mut other.standard_error);
        self.has_value.append(&mut other.has_value);
        self.standing.append(&mut other.standing);
        if let (Some(all), Some(part)) = (&mut self.rgb, &mut other.rgb) {
            all.append(part);
        }
        if let (Some(all), Some(part)) = (&mut self.direct, &mut other.direct) {
            all.append(part);
        }
        for (all, part) in self.groups.iter_mut().zip(&mut other.groups) {
            all.illuminance.append(&mut part.illuminance);
            if let (Some(all), Some(part)) = (&mut all.rgb, &mut part.rgb) {
                all.append(part);
            }
        }
    }
}

/// What is known of two maps' extremes together. Their means err together: bands share their photons.
fn join(a: &IlluminanceMap, b: &IlluminanceMap) -> Option<Extremes> {
    let (one, other) = (a.extremes?, b.extremes?);
    let cells = [a, b].map(|map| map.has_value.iter().filter(|has_value| **has_value).count() as f64);
    let error = (one.mean_error * cells[0] + other.mean_error * cells[1]) / (cells[0] + cells[1]).max(1.0);
    Some(Extremes {
        mean_error: error,
        min: if other.min.lux < one.min.lux { other.min } else { one.min },
        max: if other.max.lux > one.max.lux { other.max } else { one.max },
    })
}
