//! How much memory a run will take, told before it begins.
//!
//! Counted from what is kept for each cell, pixel, photon and triangle, and fitted to what runs took on Linux (VmHWM)
//! where a library's share can't be counted. A test holds it to a fifth; photons of methods that store them are those
//! of the seed office, where most cross the floor.

use super::Settings;
use super::bands::{MOST_CELLS, cells_at_once};
use super::composition::{Composition, Density};
use crate::error::OptionError;
use crate::gather::bandwidth::SCALES;
use crate::gather::parts;
use crate::luminaire::LightGroups;
use crate::render::plan::Plan;
use crate::scene::Scene;

/// The program itself, with Embree and its threads, bytes.
const PROGRAM: u64 = 21_000_000;
/// A triangle: mesh and Embree's tree at its peak, planes, blockers, patches, bytes; and a vertex.
const TRIANGLE: u64 = 141;
const VERTEX: u64 = 12;
/// A photon on its way to a map: stored, sorted, and in the tree, bytes; and one whose landings only light patches.
const PHOTON: u64 = 28;
const LANDING: u64 = 4;
/// Triangles from which on luminaires may be faint behind them, and luminaires.
const CLUTTER: usize = 20_000;
const MANY: usize = 16;
/// The part of a budget that the photons of one pass may take.
const PHOTONS_SHARE: f64 = 0.25;

/// Memory that a run will take at its peak, bytes, by what takes it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Memory {
    /// The program.
    pub program: u64,
    /// Mesh and tree of triangles.
    pub triangles: u64,
    /// Photons of one pass.
    pub photons: u64,
    /// Cells in work.
    pub cells: u64,
    /// Results, until they are written.
    pub results: u64,
    /// Cameras.
    pub pixels: u64,
}

impl Memory {
    /// All together.
    pub fn peak(&self) -> u64 {
        self.program + self.triangles + self.photons + self.cells + self.results + self.pixels
    }

    /// What a run will take with at most `most_cells` cells of a plane in work.
    pub fn of(scene: &Scene, plan: &Plan, settings: &Settings, most_cells: usize) -> Self {
        let cell = CellBytes::of(scene, plan, settings);
        let cut = |cells: &usize, at_once: usize| at_once < *cells;
        let planes: Vec<(usize, usize)> =
            scene.planes.iter().map(|plane| (plane.len(), cells_at_once(plane, most_cells))).collect();
        // Planes that are cut are worked on one after the other, all others together.
        let together: usize =
            planes.iter().filter(|(cells, at_once)| !cut(cells, *at_once)).map(|(cells, _)| cells).sum();
        let single = planes.iter().map(|(_, at_once)| *at_once).max().unwrap_or(0);
        let band = planes.iter().filter(|(cells, at_once)| cut(cells, *at_once)).map(|(_, at_once)| *at_once).max();
        let points = together + scene.surfaces.iter().map(|surface| surface.samples.len()).sum::<usize>();
        let kept = (points as u64 * cell.kept).max(band.unwrap_or(0) as u64 * cell.kept);
        let all: usize = planes.iter().map(|(cells, _)| cells).sum();
        let pixels: usize = scene.cameras.iter().map(|camera| camera.len()).sum();
        let photons = if plan.photons { settings.photons * photon(plan, scene) } else { 0 };
        Self {
            program: PROGRAM,
            triangles: scene.mesh.triangles.len() as u64 * TRIANGLE + scene.mesh.vertices.len() as u64 * VERTEX,
            photons,
            cells: kept + single as u64 * cell.passing,
            results: if band.is_some() { all as u64 * cell.result } else { 0 },
            pixels: pixels as u64 * pixel(plan),
        }
    }
}

/// Bytes of a photon.
fn photon(plan: &Plan, scene: &Scene) -> u64 {
    if plan.composition(scene).density.is_some() { PHOTON } else { LANDING }
}

/// Bytes of a camera's pixel.
fn pixel(plan: &Plan) -> u64 {
    let channels = channels(plan);
    (3 * channels + 2) * 16 + (channels + 4) * 8 + 16 + (5 * channels + 8) * 4
}

fn channels(plan: &Plan) -> u64 {
    if plan.coloured { 3 } else { 1 }
}

/// Bytes of a cell.
struct CellBytes {
    /// As long as its plane is in work.
    kept: u64,
    /// While its plane is smoothed or written.
    passing: u64,
    /// Its result.
    result: u64,
}

impl CellBytes {
    fn of(scene: &Scene, plan: &Plan, settings: &Settings) -> Self {
        let channels = channels(plan);
        let estimate = 8 * channels + 8;
        let composition = plan.composition(scene);
        let Composition { density, counts_sharp: counted, rays, .. } = composition;
        let smooth = rays.is_some() && settings.smooth;
        let mut kept = 23 + estimate;
        if plan.shadow_rays {
            kept += parts::direct::bytes_per_point(channels);
        }
        if rays.is_some() {
            kept += parts::rays::bytes_per_point(channels);
            let faint = scene.mesh.triangles.len() >= CLUTTER && scene.luminaires.len() >= MANY;
            if smooth && faint && !settings.groups {
                kept += parts::faint::bytes_per_point(channels);
            }
        }
        let is_paper = density == Some(Density::Paper);
        if density.is_some() {
            kept += parts::density::bytes_per_point(channels, is_paper);
        }
        if counted {
            kept += parts::counted::bytes_per_point(channels);
        }
        let scales = if is_paper { 1 } else { SCALES.len() as u64 };
        let result = 25 + if plan.coloured { 24 } else { 0 };
        let chosen = if density.is_some() { (scales + 2) * estimate + scales * 24 } else { 0 };
        let smoothed = if smooth || counted { 3 * estimate + 9 * (4 * channels + 8) + 120 } else { 0 };
        let smoothed = smoothed + if counted { 9 * 8 + estimate } else { 0 };
        let written = 16 * channels + 8 + result + 24;
        let mut passing = if smooth { smoothed } else { chosen.max(smoothed).max(written) };
        if settings.groups {
            let row = LightGroups::of(&scene.luminaires).len() as u64 * channels;
            kept += row * if counted { 40 } else { 24 };
            passing += row * 12;
        }
        Self { kept, passing, result }
    }
}

/// Fits a run into `budget` GB, where there is one: lowers its photons a pass where they are too many, and returns how
/// many cells of a plane may be in work at once.
///
/// # Errors
/// Where it does not fit at all.
pub fn fit(scene: &Scene, plan: &Plan, settings: &mut Settings, budget: Option<f64>) -> Result<usize, OptionError> {
    let Some(budget) = budget.map(|gigabytes| (gigabytes * 1e9) as u64) else { return Ok(MOST_CELLS) };
    let photons = (budget as f64 * PHOTONS_SHARE / photon(plan, scene) as f64) as u64;
    if plan.photons {
        settings.photons = settings.photons.min(photons.max(1000));
    }
    let needed = |most_cells: usize| Memory::of(scene, plan, settings, most_cells).peak();
    let (mut low, mut high) = (1, MOST_CELLS);
    if needed(low) > budget {
        return Err(OptionError::Memory { found: budget, needed: needed(low) });
    }
    if needed(high) <= budget {
        return Ok(high);
    }
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if needed(middle) <= budget { low = middle } else { high = middle }
    }
    Ok(low)
}
