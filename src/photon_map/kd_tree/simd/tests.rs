//! Every instruction set computes the same bits.

use std::cell::Cell;

use super::super::KdTree;
use super::*;
use crate::flux::Flux;
use crate::photon_map::{BlockVisitor, NearestPhotons, PhotonBlock, PhotonMap};
use crate::random::Seed;

#[cfg(target_arch = "x86_64")]
const ALL: [Level; 3] = [Level::Portable, Level::Avx2, Level::Avx512];
#[cfg(not(target_arch = "x86_64"))]
const ALL: [Level; 1] = [Level::Portable];

thread_local! {
    /// The best set a test lets its thread use.
    pub(super) static LIMIT: Cell<Level> = const { Cell::new(ALL[ALL.len() - 1]) };
}

/// Bits of the squared distances and of the flux.
type Bits = ([u32; LANES], [[u32; LANES]; 3]);

struct KeepBits<'a>(&'a mut Vec<Bits>);

impl BlockVisitor<3> for KeepBits<'_> {
    fn visit(&mut self, block: &PhotonBlock<'_, 3>) {
        let flux = block.flux.map(|flux| flux.map(f32::to_bits));
        self.0.push((block.distance_squared.map(f32::to_bits), flux));
    }
}

/// Trees built and asked by each instruction set: the same order of photons, the same sums to the last bit.
#[test]
fn all_instruction_sets_give_the_same_bits() {
    let mut stream = Seed(5).stream(0);
    let cloud: Vec<[f32; 3]> = (0..10_000)
        .map(|photon| {
            let [x, y] = stream.uniform_pair();
            // Floor, wall, lattice (photons on the cuts, photons equally far) and one crowded place.
            match photon % 4 {
                0 => [6.0 * x, 7.0 * y, 0.0],
                1 => [0.0, 7.0 * x, 2.7 * y],
                2 => [(6.0 * x).floor(), (7.0 * y).floor(), 0.0],
                _ if photon % 8 == 3 => [1.0, 1.0, 0.5],
                _ => [6.0 * x, 3.0, 2.7 * y],
            }
        })
        .collect();
    let flux: Vec<Flux<3>> = (0..cloud.len()).map(|_| Flux([0.1, 0.7, 1.3].map(|c| c * stream.uniform()))).collect();
    let queries: Vec<[f32; 3]> = (0..300).map(|i| cloud[31 * i]).chain([[-3.0, 2.0, 1.0], [1.0, 1.0, 0.5]]).collect();
    let answers = |level: Level| {
        LIMIT.set(level);
        let map = PhotonMap::<KdTree, 3>::build(cloud.clone(), flux.clone());
        let mut scratch = map.scratch();
        let (mut sums, mut visited, mut blocks) = (Vec::new(), Vec::new(), Vec::new());
        for &at in &queries {
            for k in [1, 10, 100, 1000] {
                let sum = map.sum_nearest(at, k, 1.5, &mut scratch);
                sums.push((sum.count, sum.flux.map(f64::to_bits), sum.radius_squared.to_bits()));
                let visit = |photon, distance: f32| visited.push((photon, distance.to_bits()));
                map.tree().visit_nearest(at, k, 1.5, &mut scratch, visit);
            }
            map.tree().visit_within(at, 0.3, &mut scratch, |photon, d| visited.push((photon, d.to_bits())));
            map.visit_blocks(at, 0.3, &mut scratch, &mut KeepBits(&mut blocks));
        }
        (sums, visited, blocks)
    };
    let expected = answers(Level::Portable);
    for level in ALL.into_iter().filter(|&level| level <= Level::best()) {
        assert!(answers(level) == expected, "{level:?} differs from plain Rust");
    }
}
