//! The paper's Figures 5 to 7: time against pixels, photons and k, each doubled while the others stay, on one thread
//! and on all.

use crate::gather::receiver::Photons;
use crate::photon_map::Tree;
use crate::progress::Progress;
use crate::study::trees::contender::{Call, Contender, hold};
use crate::study::trees::sets::{CELLS, Landings};
use crate::study::trees::{
    Disagreement, PhotonSample, Pools, Set, agreement, medians, pace, query_seconds, seconds, spread,
};

/// Turns of each contender.
const ROUNDS: usize = 3;
/// What a turn on one thread may take, s: where all pixels would take longer, evenly spread runs of them stand for all.
const TURN: f64 = 0.5;

/// What is doubled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Figure {
    /// Figure 5.
    Pixels,
    /// Figure 6.
    Photons,
    /// Figure 7.
    Nearest,
}

impl Figure {
    /// Every figure, in order.
    pub const ALL: [Self; 3] = [Self::Pixels, Self::Photons, Self::Nearest];

    /// Its number in the paper.
    pub fn number(self) -> u32 {
        match self {
            Self::Pixels => 5,
            Self::Photons => 6,
            Self::Nearest => 7,
        }
    }

    /// What is doubled, in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Pixels => "pixels",
            Self::Photons => "photons",
            Self::Nearest => "k",
        }
    }
}

/// Where the doubling begins, and how often it is done.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Columns and rows; pixels are doubled by columns and rows in turns.
    pub cells: [usize; 2],
    /// Photons stored.
    pub photons: usize,
    /// k, photons of an estimate.
    pub nearest: usize,
    /// Doublings of each.
    pub doublings: u32,
}

impl Start {
    /// The paper's: 120 × 144 pixels, 30,000 photons, k = 100.
    pub const PAPER: Self = Self { cells: CELLS, photons: 30_000, nearest: 100, doublings: 4 };

    /// The most photons needed.
    pub fn most_photons(&self) -> usize {
        self.photons << self.doublings
    }

    /// Columns, rows, photons and k of a step of a figure.
    fn step(&self, figure: Figure, step: u32) -> ([usize; 2], usize, usize) {
        let [columns, rows] = self.cells;
        match figure {
            Figure::Pixels => ([columns << step.div_ceil(2), rows << (step / 2)], self.photons, self.nearest),
            Figure::Photons => (self.cells, self.photons << step, self.nearest),
            Figure::Nearest => (self.cells, self.photons, self.nearest << step),
        }
    }
}

/// A point of a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Doubling {
    /// Of which figure.
    pub figure: Figure,
    /// Pixels asked for.
    pub pixels: usize,
    /// Photons stored.
    pub photons: usize,
    /// k, photons of an estimate.
    pub nearest: usize,
    /// Search radius, m.
    pub reach: f32,
    /// Threads.
    pub threads: usize,
    /// Which tree.
    pub tree: Tree,
    /// To build the photon map, s.
    pub build_seconds: f64,
    /// To sum the k nearest at every pixel, s; of a slow tree from a part of the pixels.
    pub gather_seconds: f64,
    /// One thread's gather time ÷ this one.
    pub speed_up: f64,
}

impl Doubling {
    /// What is doubled in its figure.
    pub fn size(&self) -> usize {
        match self.figure {
            Figure::Pixels => self.pixels,
            Figure::Photons => self.photons,
            Figure::Nearest => self.nearest,
        }
    }
}

pub(super) fn measure(
    trees: &[Tree],
    start: &Start,
    landings: &Landings,
    pools: &Pools,
    progress: &dyn Progress,
) -> Result<Vec<Doubling>, Disagreement> {
    let mut points = Vec::new();
    progress.stage("paper's figures", u64::from(3 * (start.doublings + 1)));
    for figure in Figure::ALL {
        for step in 0..=start.doublings {
            let (cells, photons, nearest) = start.step(figure, step);
            // As k grows, so does the area that holds the photons.
            let reach = landings.reach() * (nearest as f32 / start.nearest as f32).sqrt();
            points.extend(point(figure, trees, landings, pools, (cells, photons, nearest, reach))?);
            progress.advance(1);
        }
    }
    Ok(points)
}

/// Every tree on one thread and on all, in turns.
fn point(
    figure: Figure,
    trees: &[Tree],
    landings: &Landings,
    pools: &Pools,
    (cells, count, nearest, reach): ([usize; 2], usize, usize, f32),
) -> Result<Vec<Doubling>, Disagreement> {
    let (photons, floor) = (landings.spread(count), landings.grid(cells));
    let Photons { positions, flux } = &photons;
    let contenders: Vec<(&rayon::ThreadPool, Tree)> =
        trees.iter().flat_map(|&tree| pools.iter().map(move |pool| (pool, tree))).collect();
    let build = medians(&contenders, ROUNDS, |&(pool, tree)| {
        let (positions, flux) = (positions.clone(), flux.clone());
        seconds(|| pool.install(|| hold(tree, positions, flux)))
    });
    let maps: Vec<Box<dyn Contender>> =
        pools.all().install(|| trees.iter().map(|&tree| hold(tree, positions.clone(), flux.clone())).collect());
    let call = Call::Sum(nearest);
    let sample = PhotonSample { photons: photons.clone(), floor, random: Vec::new(), reach };
    pools.all().install(|| agreement::check(Set::Scene.name(), &sample, &maps, &[call]))?;

    let asked: Vec<Vec<[f32; 3]>> = maps
        .iter()
        .map(|map| {
            let slow = pools.one().install(|| pace(&**map, call, reach, &sample.floor));
            spread(&sample.floor, (TURN / slow) as usize)
        })
        .collect();
    let askers: Vec<_> =
        maps.iter().zip(&asked).flat_map(|(map, asked)| pools.iter().map(move |pool| (pool, &**map, asked))).collect();
    let gather = medians(&askers, ROUNDS, |&(pool, map, asked)| {
        pool.install(|| query_seconds(map, call, reach, asked)) * sample.floor.len() as f64
    });
    let one_thread = |place: usize| gather[place - place % pools.0.len()];
    let point = |(place, &(pool, tree)): (usize, &(&rayon::ThreadPool, Tree))| Doubling {
        figure,
        pixels: sample.floor.len(),
        photons: count,
        nearest,
        reach,
        threads: pool.current_num_threads(),
        tree,
        build_seconds: build[place],
        gather_seconds: gather[place],
        speed_up: one_thread(place) / gather[place],
    };
    Ok(contenders.iter().enumerate().map(point).collect())
}
