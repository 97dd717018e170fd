//! Every tree finds what brute force finds: distances, not indices, since photons at equal distance may be swapped.

use luxmap::photon::random::Seed;
use luxmap::photon_map::{BruteForce, Kiddo, NearestPhotons, Paper};

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
                assert_eq!(within::<Kiddo>(&cloud, at, radius), expected, "kiddo, {name}");
                assert_eq!(within::<Paper>(&cloud, at, radius), expected, "paper, {name}");
            }
        }
    }
}
