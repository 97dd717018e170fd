//! Every tree gives brute force's answers, or isn't timed: distances and sums, not indices, since of photons at equal
//! distance a tree may take any.

use rayon::prelude::*;

use crate::photon_map::{BruteForce, NearestPhotons};
use crate::study::trees::contender::{Call, Contender};
use crate::study::trees::{PhotonSample, Queries};

/// Points of each kind at which answers are compared.
const POINTS: usize = 16;

/// Farther than any photon, m.
const FARTHEST: f32 = 1e9;

/// Relative rounding of a squared distance: trees may add the three squares in another order.
const ROUNDING: f32 = 4.0 * f32::EPSILON;

/// Relative rounding of a sum of up to a few million photons; trees may add single-precision numbers by lanes.
const SUM_ROUNDING: f64 = 1e-5;

/// A tree that is wrong, and where.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Disagreement(String);

/// All photons by their squared distance from a point.
struct Truth {
    at: [f32; 3],
    /// Search radius, m.
    reach: f32,
    /// (d² in m², flux in lm).
    photons: Vec<(f32, f32)>,
}

/// Compares every tree's answers with brute force's at some points of each kind.
pub(super) fn check(
    set: &str,
    sample: &PhotonSample,
    trees: &[Box<dyn Contender>],
    calls: &[Call],
) -> Result<(), Disagreement> {
    let brute = BruteForce::build(&sample.photons.positions);
    let some = |points: &[[f32; 3]]| {
        let step = points.len().div_ceil(POINTS).max(1);
        points.iter().copied().step_by(step).collect::<Vec<_>>()
    };
    let points: Vec<[f32; 3]> = Queries::ALL.iter().flat_map(|&queries| some(sample.queries(queries))).collect();
    let first = points.par_iter().find_map_first(|&at| {
        let mut photons = Vec::with_capacity(sample.photons.flux.len());
        brute.visit_within(at, FARTHEST, &mut (), |photon, distance| {
            photons.push((distance, sample.photons.flux[photon].0[0]));
        });
        let mut truth = Truth { at, reach: sample.reach, photons };
        let wrong = |(call, tree): (&Call, &dyn Contender), truth: &mut Truth| {
            truth.compare(*call, tree).map(|what| {
                let [x, y, z] = at;
                Disagreement(format!("{} on {set} photons at ({x}, {y}, {z}) m: {what}", tree.tree().name()))
            })
        };
        calls
            .iter()
            .flat_map(|call| trees.iter().map(move |tree| (call, &**tree)))
            .find_map(|ask| wrong(ask, &mut truth))
    });
    first.map_or(Ok(()), Err)
}

impl Truth {
    /// What is wrong with a tree's answer, if anything.
    fn compare(&mut self, call: Call, tree: &dyn Contender) -> Option<String> {
        match call {
            Call::Visit(k) => self.compare_distances(k, &tree.distances(self.at, k, self.reach)),
            Call::Sum(k) => self.compare_sum(k, tree),
            Call::Within(radius) => {
                let per_area = 1.0 / (f64::from(radius) * f64::from(radius));
                let kernel = |distance: f32| (1.0 - f64::from(distance) * per_area).max(0.0);
                let expected: f64 = self.photons.iter().map(|&(d, flux)| f64::from(flux) * kernel(d)).sum();
                // 1 − d²/r² is rounded to the precision of 1, whatever it is.
                let reached = self.photons.iter().filter(|photon| photon.0 <= radius * radius);
                let room = SUM_ROUNDING * reached.map(|photon| f64::from(photon.1)).sum::<f64>();
                let found = tree.kernel_sum(self.at, radius);
                let same = (found - expected).abs() <= room;
                (!same).then(|| format!("found a kernel sum within {radius} m of {found} lm, expected {expected} lm"))
            }
        }
    }

    /// Whether so many may be found of the `k` nearest, else how many there should be: photons on the edge of the
    /// search radius may be counted or not.
    fn check_count(&self, k: usize, found: usize) -> Option<String> {
        let limit = self.reach * self.reach;
        let on_edge = |distance: f32| same_distance(distance, limit);
        let inside = self.photons.iter().filter(|photon| photon.0 < limit && !on_edge(photon.0)).count();
        let edge = self.photons.iter().filter(|photon| on_edge(photon.0)).count();
        let (least, most) = (k.min(inside), k.min(inside + edge));
        let expected = if least == most { least.to_string() } else { format!("{least} to {most}") };
        let same = (least..=most).contains(&found);
        (!same).then(|| format!("found {found} nearest photons within {} m, expected {expected}", self.reach))
    }

    /// Puts the `k` nearest first.
    fn select(&mut self, k: usize) {
        if (1..self.photons.len()).contains(&k) {
            self.photons.select_nth_unstable_by(k - 1, |a, b| a.0.total_cmp(&b.0));
        }
    }

    fn compare_distances(&mut self, k: usize, found: &[f32]) -> Option<String> {
        if let Some(wrong) = self.check_count(k, found.len()) {
            return Some(wrong);
        }
        self.select(found.len());
        let mut expected: Vec<f32> = self.photons[..found.len()].iter().map(|photon| photon.0).collect();
        expected.sort_by(f32::total_cmp);
        let wrong = found.iter().zip(&expected).position(|(&found, &expected)| !same_distance(found, expected))?;
        let (nth, found, expected) = (wrong + 1, found[wrong], expected[wrong]);
        Some(format!("found d² = {found} m² for photon {nth} of the nearest, expected {expected} m²"))
    }

    fn compare_sum(&mut self, k: usize, tree: &dyn Contender) -> Option<String> {
        let found = tree.sum(self.at, k, self.reach);
        if let Some(wrong) = self.check_count(k, found.count) {
            return Some(wrong);
        }
        let k = found.count;
        self.select(k);
        let radius_squared = self.photons[..k].iter().map(|photon| photon.0).fold(0.0, f32::max);
        if !same_distance(found.radius_squared, radius_squared) {
            let r = found.radius_squared;
            return Some(format!("found R² = {r} m² of the {k} nearest, expected {radius_squared} m²"));
        }
        // Of photons at the k-th's distance any may be taken: the sum lies between the darkest and the brightest
        // choice.
        let tied = |photon: &&(f32, f32)| same_distance(photon.0, radius_squared);
        let flux = |photon: &(f32, f32)| f64::from(photon.1);
        let nearer = || self.photons.iter().filter(|photon| photon.0 < radius_squared && !tied(photon));
        let inside: f64 = nearer().map(flux).sum();
        let mut edge: Vec<f64> = self.photons.iter().filter(tied).map(flux).collect();
        edge.sort_by(f64::total_cmp);
        let taken = k - nearer().count();
        let (darkest, brightest) = (&edge[..taken], &edge[edge.len() - taken..]);
        let [low, high] = [darkest, brightest].map(|choice| inside + choice.iter().sum::<f64>());
        let sum = found.flux[0];
        let same = low - SUM_ROUNDING * low <= sum && sum <= high + SUM_ROUNDING * high;
        (!same).then(|| format!("found Σ flux of the {k} nearest of {sum} lm, expected {low} to {high} lm"))
    }
}

fn same_distance(found: f32, expected: f32) -> bool {
    (found - expected).abs() <= ROUNDING * expected
}
