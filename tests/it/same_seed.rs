//! Same seed, same bits: results depend on nothing else.

use crate::common::run;
use crate::common::shipped;
use luxmap::render::plan::Method;
use luxmap::results::Results;

fn bits(results: &Results) -> Vec<u64> {
    let of_map = |map: &luxmap::results::IlluminanceMap| {
        let rgb = map.rgb.iter().flatten().flatten().copied().collect::<Vec<_>>();
        [map.illuminance.clone(), map.standard_error.clone(), rgb].concat()
    };
    let flux = results.run.flux;
    results
        .maps
        .iter()
        .flat_map(of_map)
        .chain([flux.emitted.0, flux.absorbed.0, flux.escaped.0])
        .map(f64::to_bits)
        .collect()
}

/// Photon i draws from stream i, records keep the photons' order, and no sum crosses threads.
#[test]
fn one_two_and_seven_threads_give_the_same_bits() {
    for (scene, method) in [
        ("seed-office.toml", Method::Split),
        ("seed-office.toml", Method::Seed),
        ("caustic.toml", Method::Photons),
        ("box.toml", Method::Split),
        ("seed-office.toml", Method::Gather),
        ("caustic.toml", Method::Gather),
        ("box.toml", Method::Path),
    ] {
        let scene = shipped(scene);
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
            pool.install(|| bits(&run(&scene, method, 30_000, 5)))
        };
        let one = on(1);
        assert!(one == on(2) && one == on(7), "{} {}: threads change the result", scene.name, method.name());
    }
}

/// Another seed is another experiment: if it weren't, the seed would not reach the photons.
#[test]
fn another_seed_gives_another_map_of_the_same_room() {
    let scene = shipped("box.toml");
    let [a, b] = [1, 2].map(|seed| run(&scene, Method::Photons, 200_000, seed));
    assert!(bits(&a) != bits(&b));
    let (a, b) = (crate::common::mean(&a.maps[0]), crate::common::mean(&b.maps[0]));
    // Each of 200,000 photons lands on the floor 0.5 times or so: the means differ by less than 4 √2/√100000.
    crate::common::assert_close("mean", a, b, 4.0 * (2.0_f64 / 1e5).sqrt());
}
