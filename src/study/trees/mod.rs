//! kd-trees against each other: on a scene's real photons, and on photons that lie where trees have a hard time.
//!
//! First every tree has to give brute force's answers; then they take turns, and medians are compared. It's a tree's
//! *use* that is timed: (count, Σ flux, R²) of the k nearest, a visit of them, a kernel sum within a radius.

mod agreement;
mod contender;
mod doubling;
mod page;
pub mod report;
mod sets;
mod written;

use std::time::Instant;

use crate::error::{Error, OptionError};
use crate::gather::receiver::Photons;
use crate::photon_map::Tree;
use crate::progress::Progress;
pub use agreement::Disagreement;
pub use contender::{Call, kernel_sum};
use contender::{Contender, hold};
pub use doubling::{Doubling, Figure, Start};
pub use sets::{Landings, Set, built_in_scene};
pub use written::write;

/// Trees that can be compared.
pub const TREES: [Tree; 3] = [Tree::Kd, Tree::Kiddo, Tree::Paper];

/// Turns of each contender.
const ROUNDS: usize = 5;
/// What the slowest contender's turn may take, s: queries are left out where it would take longer.
const TURN: f64 = 0.06;
/// What any contender's turn takes at least, s.
const SHORTEST_TURN: f64 = 0.02;
/// Points of a grid asked for, at most: whole runs of it, in scan order.
const GRID_POINTS: usize = 4320;
/// Photons whose places are asked for.
const RANDOM_POINTS: usize = 4096;
/// Neighbours of a grid that stay together where not all points are asked for.
const RUN: usize = 72;

/// What is compared.
#[derive(Clone, Debug)]
pub struct ComparisonSettings {
    /// Kinds of photons.
    pub sets: Vec<Set>,
    /// Photons stored.
    pub photons: Vec<usize>,
    /// k of the sums over nearest photons. Visits take the middle one.
    pub nearest: Vec<usize>,
    /// Radii of the kernel sums, m.
    pub radii: Vec<f32>,
    /// The trees.
    pub trees: Vec<Tree>,
    /// Seed of all random streams.
    pub seed: u64,
}

/// Where trees are asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Queries {
    /// Points of a measuring plane, in scan order.
    Floor,
    /// Places of photons, in random order.
    Random,
}

impl Queries {
    /// Every kind.
    pub const ALL: [Self; 2] = [Self::Floor, Self::Random];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Floor => "floor",
            Self::Random => "random",
        }
    }
}

/// Photons and the points at which trees over them are asked, m.
#[derive(Clone, Debug)]
pub struct PhotonSample {
    /// Positions and flux.
    pub photons: Photons<1>,
    /// [`Queries::Floor`]
    pub floor: Vec<[f32; 3]>,
    /// [`Queries::Random`]
    pub random: Vec<[f32; 3]>,
    /// Search radius of the k nearest, m.
    pub reach: f32,
}

impl PhotonSample {
    fn queries(&self, queries: Queries) -> &[[f32; 3]] {
        match queries {
            Queries::Floor => &self.floor,
            Queries::Random => &self.random,
        }
    }
}

/// What one tree took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TreeTimes {
    /// Which tree.
    pub tree: Tree,
    /// From positions and flux to a photon map that can be asked, s.
    pub build_seconds: f64,
    /// Memory of the tree beside the flux, bytes a photon.
    pub bytes_per_photon: f64,
    /// Wall time of all queries ÷ their number, s.
    pub query_seconds: f64,
}

/// The same question to every tree.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeCase {
    /// Kind of photons.
    pub set: Set,
    /// Photons stored.
    pub photons: usize,
    /// Where.
    pub queries: Queries,
    /// What.
    pub call: Call,
    /// Search radius of the k nearest, m.
    pub reach: f32,
    /// Threads that build, and ask.
    pub threads: usize,
    /// One for each tree.
    pub entries: Vec<TreeTimes>,
}

impl TreeCase {
    /// A tree's time ÷ kiddo's, by `time`; `None` where kiddo is no contender.
    pub fn ratio(&self, entry: &TreeTimes, time: impl Fn(&TreeTimes) -> f64) -> Option<f64> {
        self.entries.iter().find(|entry| entry.tree == Tree::Kiddo).map(|kiddo| time(entry) / time(kiddo))
    }
}

/// All that was measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The scene the real photons are from, where there are any.
    pub scene: Option<String>,
    /// The processor, where the system tells.
    pub machine: Option<String>,
    /// What was asked, in the order it was asked.
    pub cases: Vec<TreeCase>,
    /// The paper's Figures 5 to 7, where asked for.
    pub figures: Vec<Doubling>,
}

/// Thread pools of one thread and, where there are more, of all.
pub struct Pools(Vec<rayon::ThreadPool>);

impl Pools {
    /// Pools of one thread and of `threads` (0: as many as the machine has).
    ///
    /// # Errors
    /// Where the system does not allow so many threads.
    pub fn new(threads: usize) -> Result<Self, Error> {
        let pool = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.map_err(|error| OptionError::Threads { why: error.to_string() })
        };
        let all = pool(threads)?;
        Ok(Self(if all.current_num_threads() > 1 { vec![pool(1)?, all] } else { vec![all] }))
    }

    /// The pool of all threads.
    pub fn all(&self) -> &rayon::ThreadPool {
        &self.0[self.0.len() - 1]
    }

    /// The pool of one thread, or of all where that is one.
    fn one(&self) -> &rayon::ThreadPool {
        &self.0[0]
    }

    fn iter(&self) -> impl Iterator<Item = &rayon::ThreadPool> {
        self.0.iter()
    }
}

impl ComparisonSettings {
    /// Photons of a set with the points to ask at.
    ///
    /// # Panics
    /// Where `landings` are too few for [`Set::Scene`].
    pub fn sample(&self, set: Set, count: usize, landings: &Landings) -> PhotonSample {
        let (photons, grid, reach) = match set {
            Set::Scene => (landings.spread(count), landings.grid(landings.cells()), landings.reach()),
            _ => {
                let photons = set.photons(count, self.seed);
                (photons, set.floor(), sets::REACH)
            }
        };
        let random = sets::at_photons(&photons.positions, RANDOM_POINTS, self.seed);
        PhotonSample { photons, floor: spread(&grid, GRID_POINTS), random, reach }
    }

    /// The questions.
    fn calls(&self) -> Vec<Call> {
        let mut sorted = self.nearest.clone();
        sorted.sort_unstable();
        let sums = self.nearest.iter().map(|&k| Call::Sum(k));
        let visit = sorted.get(sorted.len() / 2).map(|&k| Call::Visit(k));
        sums.chain(visit).chain(self.radii.iter().map(|&radius| Call::Within(radius))).collect()
    }

    /// Checks and times every tree on one sample.
    ///
    /// # Errors
    /// A tree that doesn't give brute force's answers, before anything is timed.
    pub fn compare(
        &self,
        set: Set,
        sample: &PhotonSample,
        pools: &Pools,
        progress: &dyn Progress,
    ) -> Result<Vec<TreeCase>, Disagreement> {
        let Photons { positions, flux } = &sample.photons;
        let calls = self.calls();
        progress.stage(set.name(), (pools.0.len() * Queries::ALL.len() * calls.len()) as u64);
        let trees: Vec<Box<dyn Contender>> = pools
            .all()
            .install(|| self.trees.iter().map(|&tree| hold(tree, positions.clone(), flux.clone())).collect());
        pools.all().install(|| agreement::check(set.name(), sample, &trees, &calls))?;
        let mut cases = Vec::new();
        for pool in pools.iter() {
            let build = pool.install(|| build_seconds(&self.trees, &sample.photons));
            for queries in Queries::ALL {
                for &call in &calls {
                    let seconds = pool.install(|| compare_queries(&trees, call, sample.reach, sample.queries(queries)));
                    let entry = |(tree, (build, query)): (&dyn Contender, (&f64, f64))| TreeTimes {
                        tree: tree.tree(),
                        build_seconds: *build,
                        bytes_per_photon: tree.memory() as f64 / positions.len() as f64,
                        query_seconds: query,
                    };
                    cases.push(TreeCase {
                        set,
                        photons: positions.len(),
                        queries,
                        call,
                        reach: sample.reach,
                        threads: pool.current_num_threads(),
                        entries: trees.iter().map(|tree| &**tree).zip(build.iter().zip(seconds)).map(entry).collect(),
                    });
                    progress.advance(1);
                }
            }
        }
        Ok(cases)
    }

    /// The paper's Figures 5 to 7 on the scene's photons; see [`Doubling`].
    ///
    /// # Errors
    /// A tree that doesn't give brute force's answers, before anything is timed.
    pub fn repeat_figures(
        &self,
        start: &Start,
        landings: &Landings,
        pools: &Pools,
        progress: &dyn Progress,
    ) -> Result<Vec<Doubling>, Disagreement> {
        doubling::measure(&self.trees, start, landings, pools, progress)
    }
}

/// Median seconds to build each tree; they take turns.
fn build_seconds(trees: &[Tree], photons: &Photons<1>) -> Vec<f64> {
    let turn = |&tree: &Tree| {
        let (positions, flux) = (photons.positions.clone(), photons.flux.clone());
        seconds(|| hold(tree, positions, flux))
    };
    medians(trees, ROUNDS, turn)
}

/// Median seconds a query; the trees take turns.
fn compare_queries(trees: &[Box<dyn Contender>], call: Call, reach: f32, points: &[[f32; 3]]) -> Vec<f64> {
    let slowest = trees.iter().map(|tree| pace(&**tree, call, reach, points)).fold(f64::MIN_POSITIVE, f64::max);
    let points = spread(points, (TURN / slowest) as usize);
    medians(trees, ROUNDS, |tree| query_seconds(&**tree, call, reach, &points))
}

/// Seconds a query, about: a short turn, which also fills the caches.
fn pace(tree: &dyn Contender, call: Call, reach: f32, points: &[[f32; 3]]) -> f64 {
    let few = spread(points, RUN);
    seconds(|| tree.answer(call, reach, &few)).max(1e-9) / few.len() as f64
}

/// Seconds a query in one turn: the points are asked for again and again until [`SHORTEST_TURN`] is over, and what
/// threads need to wake up hardly counts.
fn query_seconds(tree: &dyn Contender, call: Call, reach: f32, points: &[[f32; 3]]) -> f64 {
    let started = Instant::now();
    for times in 1_usize.. {
        tree.answer(call, reach, points);
        let taken = started.elapsed().as_secs_f64();
        if taken >= SHORTEST_TURN {
            return taken / (times * points.len()) as f64;
        }
    }
    unreachable!("the clock advances")
}

/// Wall time of some work, s; what comes of it is dropped afterwards.
fn seconds<R>(work: impl FnOnce() -> R) -> f64 {
    let started = Instant::now();
    let result = work();
    let seconds = started.elapsed().as_secs_f64();
    drop(result);
    seconds
}

/// Median of what each contender's turns took; a slow spell of the machine hits all of them.
fn medians<C>(contenders: &[C], rounds: usize, turn: impl Fn(&C) -> f64) -> Vec<f64> {
    let mut times = vec![Vec::new(); contenders.len()];
    for _ in 0..rounds {
        contenders.iter().zip(&mut times).for_each(|(contender, times)| times.push(turn(contender)));
    }
    let median = |mut times: Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    times.into_iter().map(median).collect()
}

/// About `wanted` of the points: runs of neighbours, evenly spread, in their order; all where there are no more.
fn spread(points: &[[f32; 3]], wanted: usize) -> Vec<[f32; 3]> {
    if points.len() <= wanted.max(RUN) {
        return points.to_vec();
    }
    let runs = wanted.div_ceil(RUN).max(1);
    let run = |run: usize| {
        let first = run * points.len() / runs;
        &points[first..(first + RUN).min((run + 1) * points.len() / runs)]
    };
    (0..runs).flat_map(run).copied().collect()
}

#[cfg(test)]
mod tests;
