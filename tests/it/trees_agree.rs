//! Every tree finds what brute force finds: distances, not indices, since photons at equal distance may be swapped.

use luxmap::flux::Flux;
use luxmap::photon_map::{BlockVisitor, BruteForce, KdTree, Kiddo, NearestPhotons, Paper, PhotonBlock, PhotonMap};
use luxmap::random::Seed;
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};

type Cloud = Vec<[f32; 3]>;

fn clouds() -> Vec<(&'static str, Cloud)> {
    let mut stream = Seed(4).stream(0);
    let mut point = |scale: [f32; 3]| scale.map(|s| s * stream.uniform());
    let cube: Cloud = (0..3000).map(|_| point([1.0; 3])).collect();
    let floor: Cloud = (0..3000).map(|_| point([6.0, 7.2, 0.0])).collect();
    let line: Cloud = (0..500).map(|_| point([0.0, 5.0, 0.0])).collect();
    let far: Cloud = floor.iter().map(|&[x, y, z]| [x + 1e4, y - 1e4, z]).collect();
    let half: Cloud = floor.iter().enumerate().map(|(i, &p)| if i % 2 == 0 { [1.0, 1.0, 0.0] } else { p }).collect();
    vec![
        ("empty", vec![]),
        ("one", vec![[0.5; 3]]),
        ("three", cube[..3].to_vec()),
        ("cube", cube),
        ("floor", floor),
        ("line", line),
        ("coincident", vec![[0.3, 0.4, 0.0]; 1000]),
        ("half coincident", half),
        ("far from the origin", far),
    ]
}

fn nearest<T: NearestPhotons>(cloud: &Cloud, at: [f32; 3], k: usize, radius: f32) -> Vec<f32> {
    let tree = T::build(cloud);
    let mut distances = Vec::new();
    tree.visit_nearest(at, k, radius, &mut tree.scratch(), |photon, distance| {
        let exact: f32 = (0..3).map(|axis| (cloud[photon][axis] - at[axis]).powi(2)).sum();
        assert!(
            (distance - exact).abs() <= 4.0 * f32::EPSILON * exact,
            "photon {photon} is {exact} away, not {distance}"
        );
        distances.push(distance);
    });
    distances.sort_by(f32::total_cmp);
    distances
}

fn within<T: NearestPhotons>(cloud: &Cloud, at: [f32; 3], radius: f32) -> Vec<usize> {
    let tree = T::build(cloud);
    let mut found = Vec::new();
    tree.visit_within(at, radius, &mut tree.scratch(), |photon, _| found.push(photon));
    found.sort_unstable();
    found
}

/// Squared distances agree to rounding: trees may add the three squares in another order.
fn assert_same(name: &str, found: &[f32], expected: &[f32]) {
    assert_eq!(found.len(), expected.len(), "{name}: photons found");
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= 4.0 * f32::EPSILON * expected, "{name}: {found}, expected {expected}");
    }
}

#[test]
fn every_tree_finds_the_distances_of_brute_force() {
    for (name, cloud) in clouds() {
        let queries = [[0.5, 0.5, 0.0], [0.0; 3], [3.1, 3.7, 0.0], [1.0, 1.0, 0.0], [1e4, -1e4, 0.0], [-5.0, 9.0, 2.0]];
        for at in queries {
            for k in [1, 2, 10, 100, 5000] {
                for radius in [0.05, 0.7, 1e6] {
                    let expected = nearest::<BruteForce>(&cloud, at, k, radius);
                    assert_same(&format!("kd, {name}"), &nearest::<KdTree>(&cloud, at, k, radius), &expected);
                    assert_same(&format!("kiddo, {name}"), &nearest::<Kiddo>(&cloud, at, k, radius), &expected);
                    assert_same(&format!("paper, {name}"), &nearest::<Paper>(&cloud, at, k, radius), &expected);
                }
            }
        }
    }
}

/// Fixed radius: the same photons, by index. The radius is no distance of any photon, so rounding decides nothing.
#[test]
fn every_tree_finds_the_photons_within_a_radius() {
    for (name, cloud) in clouds() {
        for at in [[0.5, 0.5, 0.0], [3.1, 3.7, 0.0], [1e4, -1e4, 0.0]] {
            for radius in [0.0503, 0.7001, 1e6] {
                let expected = within::<BruteForce>(&cloud, at, radius);
                assert_eq!(within::<KdTree>(&cloud, at, radius), expected, "kd, {name}");
                assert_eq!(within::<Kiddo>(&cloud, at, radius), expected, "kiddo, {name}");
                assert_eq!(within::<Paper>(&cloud, at, radius), expected, "paper, {name}");
            }
        }
    }
}

/// Sets of photons such as scenes make, and worse: up to 3000 in a cube, on a floor, on two walls, on a line, on a coarse
/// lattice (so that many are equally far), all in one place, half of them in one place, in clusters of all sizes; as they
/// are, or 1000 km from the origin.
fn any_cloud() -> impl Strategy<Value = Cloud> {
    let point = || prop::array::uniform3(0.0..1.0_f32);
    (0..8, prop::bool::ANY, point(), prop::collection::vec(point(), 0..3000)).prop_map(
        |(family, far, middle, cloud)| {
            let place = |(index, [x, y, z]): (usize, [f32; 3])| match family {
                0 => [x, y, z],
                1 => [6.0 * x, 7.2 * y, 0.0],
                2 => {
                    if z < 0.5 {
                        [0.0, y, 2.0 * z]
                    } else {
                        [x, y, 0.0]
                    }
                }
                3 => [middle[0], middle[1], z],
                4 => [x, y, z].map(|along| (8.0 * along).floor()),
                5 => middle,
                6 => {
                    if index % 2 == 0 {
                        middle
                    } else {
                        [x, y, 0.0]
                    }
                }
                _ => [0, 1, 2].map(|axis| middle[axis] + ([x, y, z][axis] - 0.5) * (-(index as f32) / 100.0).exp()),
            };
            let shift = if far { [1e6, -1e6, 0.0] } else { [0.0; 3] };
            cloud.into_iter().enumerate().map(place).map(|at| [0, 1, 2].map(|axis| at[axis] + shift[axis])).collect()
        },
    )
}

/// Where to ask: near a photon, or anywhere.
fn any_query(cloud: &Cloud) -> impl Strategy<Value = [f32; 3]> + use<> {
    let places = if cloud.is_empty() { vec![[0.0; 3]] } else { cloud.clone() };
    let offset = prop::array::uniform3(-1.0..1.0_f32);
    (prop::sample::select(places), offset, prop::sample::select(vec![0.0, 1e-3, 0.3, 20.0_f32]))
        .prop_map(|(place, offset, size)| [0, 1, 2].map(|axis| place[axis] + size * offset[axis]))
}

/// Σ φ within a radius.
struct FluxWithin {
    radius: f32,
    flux: f64,
}

impl BlockVisitor<1> for FluxWithin {
    fn visit(&mut self, block: &PhotonBlock<'_, 1>) {
        let photons = block.distance_squared.iter().zip(block.flux[0]);
        let within = photons.filter(|&(&distance, _)| distance <= (self.radius * self.radius).min(f32::MAX));
        self.flux += within.map(|(_, flux)| f64::from(flux)).sum::<f64>();
    }
}

/// Our tree against brute force on sets nobody thought of: the same distances, the same photons within a radius, and sums
/// over exactly the photons it lists.
#[test]
fn our_tree_agrees_with_brute_force_on_any_set() {
    let config =
        ProptestConfig { cases: 400, rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Default::default() };
    let sets = any_cloud().prop_flat_map(|cloud| {
        let k = prop::sample::select(vec![0_usize, 1, 2, 7, 31, 32, 33, 100, 500, 2999, 5000]);
        let radius = prop::sample::select(vec![1e-3_f32, 0.0503, 0.3001, 3.003, 1e7, 1e30]);
        (any_query(&cloud), Just(cloud), k, radius)
    });
    let agree = |(at, cloud, k, radius): ([f32; 3], Cloud, usize, f32)| {
        let expected = nearest::<BruteForce>(&cloud, at, k, radius);
        let found = nearest::<KdTree>(&cloud, at, k, radius);
        prop_assert_eq!(&found, &expected);
        prop_assert_eq!(within::<KdTree>(&cloud, at, radius), within::<BruteForce>(&cloud, at, radius));

        // Powers of two: sums are exact, whatever the order.
        let flux: Vec<Flux<1>> = (0..cloud.len()).map(|photon| Flux([[1.0, 0.25, 4.0][photon % 3]])).collect();
        let map = PhotonMap::<KdTree, 1>::build(cloud.clone(), flux.clone());
        let mut scratch = map.scratch();
        let (mut listed, mut farthest) = (0.0, 0.0_f32);
        map.tree().visit_nearest(at, k, radius, &mut scratch, |photon, distance| {
            listed += f64::from(flux[photon].0[0]);
            farthest = farthest.max(distance);
        });
        let sum = map.sum_nearest(at, k, radius, &mut scratch);
        prop_assert_eq!((sum.count, sum.flux, sum.radius_squared), (expected.len(), [listed], farthest));

        let mut in_blocks = FluxWithin { radius, flux: 0.0 };
        map.visit_blocks(at, radius, &mut scratch, &mut in_blocks);
        let expected: f64 =
            within::<BruteForce>(&cloud, at, radius).iter().map(|&photon| f64::from(flux[photon].0[0])).sum();
        prop_assert_eq!(in_blocks.flux, expected);
        Ok(())
    };
    TestRunner::new(config).run(&sets, agree).unwrap();
}

/// Photons that lie nowhere are refused by name.
#[test]
fn positions_that_are_not_finite_are_refused() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 2e18] {
        let map = PhotonMap::<KdTree, 1>::checked(vec![[0.0; 3], [1.0, bad, 0.0]], vec![Flux([1.0]); 2]);
        let message = map.map(|_| ()).expect_err("a photon lies nowhere").to_string();
        assert!(message.starts_with("photon 1: found position [1.0, "), "{message}");
        assert!(message.ends_with("expected finite coordinates up to 1e18 m"), "{message}");
    }
    assert!(PhotonMap::<KdTree, 1>::checked(vec![[1e18; 3]; 40], vec![Flux([1.0]); 40]).is_ok());
}

/// What a thread asked before must not show in a result.
#[test]
fn a_used_scratch_gives_the_same_bits() {
    for (name, cloud) in clouds() {
        let flux = vec![Flux([0.1, 0.7, 1.3]); cloud.len()];
        let map = PhotonMap::<KdTree, 3>::build(cloud, flux);
        let mut used = map.scratch();
        for k in [1000, 1, 100, 10] {
            for at in [[0.5, 0.5, 0.0], [3.1, 3.7, 0.0], [1.0, 1.0, 0.0]] {
                let fresh = map.sum_nearest(at, k, 1.0, &mut map.scratch());
                assert_eq!(map.sum_nearest(at, k, 1.0, &mut used), fresh, "{name}, k = {k}");
            }
        }
    }
}

/// The tree does not depend on how many threads build it.
#[test]
fn one_thread_and_four_build_the_same_tree() {
    let mut stream = Seed(9).stream(0);
    let cloud: Cloud = (0..60_000).map(|_| [6.0 * stream.uniform(), 7.0 * stream.uniform(), 0.0]).collect();
    let order = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be made");
        let tree: KdTree = pool.install(|| NearestPhotons::build(&cloud));
        let mut order = Vec::new();
        tree.visit_within([3.0, 3.5, 0.0], 20.0, &mut tree.scratch(), |photon, _| order.push(photon));
        order
    };
    assert_eq!(order(1), order(4));
}
