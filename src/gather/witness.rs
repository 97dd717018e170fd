//! Photons as a second witness of the light that rays found.
//!
//! Rays that rarely meet a small bright opening give no sign of what they miss: their scatter is small as long as none
//! has met it. Photons go where the light goes. So some of them are counted where they cross the measuring planes, over
//! areas large enough for a small error. What rays found there is compared with it; the difference of the two, beyond
//! their noise, becomes part of the standard error, and light that hardly any ray has met is as uncertain as the
//! photons show.

use std::io;

use super::receiver::{Photons, Receiver};
use super::smooth::{Samples, Smoother};
use crate::embree::RayCaster;
use crate::flux::photometric;
use crate::random::{Seed, Stream};
use crate::state::Sum;
use crate::state::tape::Tape;

/// Sides of a region of a grid, in cells.
const BLOCK: usize = 16;
/// Both differ if they do by more than this many standard errors,
const SIGNIFICANT: f64 = 4.0;
/// and by this part of the larger: less may be what furniture covers of a block of cells, or how light changes about a
/// sensor.
const MIN_SHARE_OF_BLOCK: f64 = 0.05;
const MIN_SHARE_OF_DISC: f64 = 0.5;
/// The mean that rays found proves nothing where its square is less than this many times its variance: as if fewer than
/// four rays had met the light.
const EVIDENCE: f64 = 4.0;
/// Rays in the plane about a sensor that find the walls where its disc ends.
const RAYS: usize = 32;
/// Rays from a region that decide whether it sees any surface.
const SIGHT_RAYS: usize = 64;

/// Light at regions of a receiver, counted by photons.
pub struct Witness {
    regions: Regions,
    /// Area counted of each region, m².
    areas: Vec<f64>,
    /// Σ φ, lm, and Σ φ² of each region.
    sums: Vec<[Sum; 2]>,
    /// Sets of photons so far, each of all luminaires' flux.
    sets: u64,
    /// Whether rays from each region meet any surface at all: where none does, that they find nothing is no surprise.
    sees: Vec<bool>,
}

enum Regions {
    /// Blocks of the cells of a grid.
    Blocks(GridBlocks),
    /// Discs about points that may overlap: squares of their radii in each direction, m².
    Discs(Vec<[f32; RAYS]>),
}

/// How a grid is cut into blocks.
struct GridBlocks {
    columns: usize,
    rows: usize,
    /// The block of each cell.
    of_cell: Vec<u32>,
    /// Whether a cell is counted: nothing stands between it and its eight neighbours.
    open: Vec<bool>,
}

/// Illuminance of a region by photons and by rays, lx.
#[derive(Clone, Copy, Debug)]
pub struct Contradiction {
    /// Mean illuminance by photons.
    pub photons: f64,
    /// By rays.
    pub rays: f64,
}

impl Witness {
    /// Regions of a grid.
    pub fn of_grid(grid: [usize; 2], receiver: &Receiver, smoother: &Smoother, caster: &RayCaster) -> Self {
        let [columns, rows] = grid;
        let across = columns.div_ceil(BLOCK);
        let block = |cell: usize| (cell / columns / BLOCK * across + cell % columns / BLOCK) as u32;
        let of_cell: Vec<u32> = (0..columns * rows).map(block).collect();
        let open: Vec<bool> = (0..columns * rows).map(|cell| smoother.is_open(cell)).collect();
        let [width, height] = receiver.cell;
        let mut areas = vec![0.0; across * rows.div_ceil(BLOCK)];
        for (block, _) in of_cell.iter().zip(&open).filter(|(_, open)| **open) {
            areas[*block as usize] += f64::from(width) * f64::from(height);
        }
        Self::new(Regions::Blocks(GridBlocks { columns, rows, of_cell, open }), areas, receiver, caster)
    }

    /// Discs of `radius` (m) about points, as far as walls let them be.
    pub fn of_points(receiver: &Receiver, radius: f32, caster: &RayCaster) -> Self {
        let around = |point: usize| -> [f32; RAYS] {
            let eye = receiver.start(point);
            std::array::from_fn(|ray| {
                let (sin, cos) = (std::f32::consts::TAU * (ray as f32 + 0.5) / RAYS as f32).sin_cos();
                let direction = receiver.u * cos + receiver.v * sin;
                caster.closest_hit(eye, direction, radius).map_or(radius, |hit| hit.distance).powi(2)
            })
        };
        let squares: Vec<[f32; RAYS]> = (0..receiver.len()).map(around).collect();
        let area = |squares: &[f32; RAYS]| {
            std::f64::consts::PI * squares.iter().map(|&square| f64::from(square)).sum::<f64>() / RAYS as f64
        };
        let areas = squares.iter().map(area).collect();
        Self::new(Regions::Discs(squares), areas, receiver, caster)
    }

    fn new(regions: Regions, areas: Vec<f64>, receiver: &Receiver, caster: &RayCaster) -> Self {
        let sees = |region: usize| {
            let points = regions.points(region);
            let mut stream: Stream = Seed(0).stream(region as u64);
            (0..SIGHT_RAYS).any(|ray| {
                points.get(ray * points.len() / SIGHT_RAYS).is_some_and(|&point| {
                    let direction = receiver.direction(point, stream.uniform_pair());
                    caster.is_occluded(receiver.start(point), direction, f32::INFINITY)
                })
            })
        };
        let sees = (0..areas.len()).map(sees).collect();
        Self { sums: vec![[Sum::ZERO; 2]; areas.len()], regions, areas, sets: 0, sees }
    }

    /// Counts the photons of one set that crossed the receiver.
    pub fn add<const C: usize>(&mut self, receiver: &Receiver, photons: [&Photons<C>; 2]) {
        self.sets += 1;
        let Self { regions, sums, .. } = self;
        let all = photons.into_iter().flat_map(|photons| photons.positions.iter().zip(&photons.flux));
        for (position, flux) in all {
            let flux = photometric(flux.0.map(f64::from));
            let mut count = |region: usize| {
                sums[region][0].add(flux);
                sums[region][1].add(flux * flux);
            };
            match regions {
                Regions::Blocks(blocks) => {
                    if let Some(block) = blocks.at(receiver, *position) {
                        count(block);
                    }
                }
                Regions::Discs(squares) => {
                    for (point, (at, square)) in receiver.points.iter().zip(squares).enumerate() {
                        let (x, y) = (position[0] - at[0], position[1] - at[1]);
                        let turn = (y.atan2(x) / std::f32::consts::TAU).rem_euclid(1.0);
                        if x * x + y * y < square[((turn * RAYS as f32) as usize).min(RAYS - 1)] {
                            count(point);
                        }
                    }
                }
            }
        }
    }

    /// Writes its sums to `tape`, or reads them from it.
    pub fn exchange(&mut self, tape: &mut Tape<'_>) -> io::Result<()> {
        tape.count(&mut self.sets)?;
        tape.sums(self.sums.as_flattened_mut())
    }

    /// Variance (lx²) to be added at each point to what rays found there, and where they contradict photons most.
    /// `flux` is that of one photon, lm.
    pub fn doubt<const C: usize>(&self, samples: &Samples<C>, flux: f64) -> (Vec<f64>, Option<Contradiction>) {
        let (mut worst, mut most) = (None, 0.0);
        let of_region: Vec<f64> = (0..self.areas.len())
            .map(|region| {
                let Some(comparison) = self.compare(region, samples, flux) else { return 0.0 };
                let RegionCheck { contradiction, doubt, significant } = comparison;
                let larger = contradiction.photons.max(contradiction.rays);
                if significant && doubt.sqrt() / larger > most {
                    (worst, most) = (Some(contradiction), doubt.sqrt() / larger);
                }
                doubt
            })
            .collect();
        let points = match &self.regions {
            Regions::Blocks(blocks) => blocks.of_cell.iter().map(|&block| of_region[block as usize]).collect(),
            Regions::Discs(_) => of_region,
        };
        (points, worst)
    }

    fn compare<const C: usize>(&self, region: usize, samples: &Samples<C>, flux: f64) -> Option<RegionCheck> {
        let (area, [sum, squares]) = (self.areas[region], self.sums[region]);
        if area <= 0.0 || self.sets == 0 {
            return None;
        }
        let least = if matches!(self.regions, Regions::Blocks(_)) { MIN_SHARE_OF_BLOCK } else { MIN_SHARE_OF_DISC };
        let found = samples.together(&self.regions.points(region));
        let whole = area * self.sets as f64;
        let photons = sum.value() / whole;
        // Of no photon little more is known than that it was not there.
        let variance = squares.value().max(flux * flux) / (whole * whole);
        let off = photons - found.mean;
        let larger = photons.max(found.mean);
        let noise = (variance + found.variance).sqrt();
        let significant = off.abs() > SIGNIFICANT * noise && off.abs() > least * larger;
        let doubt = if significant {
            off * off
        } else if self.sees[region] && found.mean * found.mean <= EVIDENCE * found.variance {
            variance.max(off * off)
        } else {
            0.0
        };
        Some(RegionCheck { contradiction: Contradiction { photons, rays: found.mean }, doubt, significant })
    }
}

/// Photons and rays of one region compared.
struct RegionCheck {
    contradiction: Contradiction,
    /// Variance to be added, lx².
    doubt: f64,
    /// Whether they contradict each other, rather than that one of them has too few samples.
    significant: bool,
}

impl Regions {
    /// The points that are counted of a region.
    fn points(&self, region: usize) -> Vec<usize> {
        match self {
            Self::Blocks(blocks) => blocks.counted(region),
            Self::Discs(_) => vec![region],
        }
    }
}

impl GridBlocks {
    /// The block of a photon, if it is counted.
    fn at(&self, receiver: &Receiver, position: [f32; 3]) -> Option<usize> {
        let cell = receiver.cell_at([position[0], position[1]])?;
        self.open[cell].then(|| self.of_cell[cell] as usize)
    }

    /// The cells of a block that are counted.
    fn counted(&self, block: usize) -> Vec<usize> {
        let across = self.columns.div_ceil(BLOCK);
        let (left, low) = (block % across * BLOCK, block / across * BLOCK);
        let rows = low..(low + BLOCK).min(self.rows);
        let cells = rows
            .flat_map(|row| (left..(left + BLOCK).min(self.columns)).map(move |column| row * self.columns + column));
        cells.filter(|&cell| self.open[cell]).collect()
    }
}
