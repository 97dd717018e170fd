//! The kd-tree without a scene: points of your own, the nearest of them, and what these carry.
//!
//! `cargo run --release --example 04_photon_tree_alone`

use luxmap::photon_map::{BruteForce, Flux, KdTree, Misplaced, NearestPhotons, PhotonMap};

/// Points on a spiral, each with the same flux, lm.
fn points(count: u32) -> (Vec<[f32; 3]>, Vec<Flux<1>>) {
    let point = |i: u32| {
        let (turn, radius) = (2.4 * i as f32, (i as f32 / count as f32).sqrt());
        [radius * turn.cos(), radius * turn.sin(), 0.0]
    };
    ((0..count).map(point).collect(), vec![Flux([1e-3]); count as usize])
}

fn main() -> Result<(), Misplaced> {
    let (positions, flux) = points(100_000);
    let map = PhotonMap::<KdTree, 1>::checked(positions.clone(), flux.clone())?;
    let mut scratch = map.scratch();
    let at = [0.1, 0.2, 0.0];

    // Density of flux from the 100 nearest within half a metre: Φ / (π R²).
    let sum = map.sum_nearest(at, 100, 0.5, &mut scratch);
    let area = std::f64::consts::PI * f64::from(sum.radius_squared);
    println!("{} points, {:.3} lm, {:.2} lm/m²", sum.count, sum.flux[0], sum.flux[0] / area);

    // All points within 1 cm, one by one.
    let mut near = Vec::new();
    map.tree().visit_within(at, 0.01, &mut scratch, |index, _| near.push(index));
    println!("{} points within 1 cm", near.len());

    // Looking at every point gives the same answer.
    let all = PhotonMap::<BruteForce, 1>::checked(positions, flux)?;
    let same = all.sum_nearest(at, 100, 0.5, &mut all.scratch());
    assert_eq!((same.count, same.radius_squared), (sum.count, sum.radius_squared));
    Ok(())
}
