//! The trees against each other on the seed office's photons, one thread: `cargo bench --bench trees`.
//!
//! First every tree has to agree with brute force; then they take turns. Prints time and how many times faster than kiddo,
//! and writes `out/bench/trees.csv`: photons, what, tree, value, unit, ratio.

use std::fs;
use std::hint::black_box;
use std::time::Instant;

use luxmap::embree::RayCaster;
use luxmap::gather::receiver::{LandingRecorder, Photons};
use luxmap::photon::trace::Tracer;
use luxmap::photon_map::{BruteForce, KdTree, Kiddo, NearestPhotons, NearestSum, Paper, PhotonMap};
use luxmap::random::{Seed, Stream};
use luxmap::scene::Scene;
use luxmap::study::trees::kernel_sum;

const ROUNDS: usize = 5;
/// Largest search radius, m.
const RADIUS: f32 = 1.0;
/// Radii of the sums within a fixed radius, m.
const FIXED: [f32; 2] = [0.05, 0.2];

type Table = Vec<String>;

fn main() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/seed-office.toml");
    let scene = Scene::load(file.as_ref()).expect("the shipped scene is good");
    let mut table = vec!["photons,what,tree,value,unit,ratio".to_owned()];
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread can be made");
    one.install(|| {
        for count in [30_000, 300_000, 3_000_000] {
            compare(&scene, count, &mut table);
        }
        crowded(&mut table);
    });
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/out/bench");
    fs::create_dir_all(folder).expect("out/ is writable");
    fs::write(format!("{folder}/trees.csv"), table.join("\n") + "\n").expect("out/ is writable");
}

/// `count` photons that landed on the office's surfaces, of all luminaires.
fn landings(scene: &Scene, count: usize) -> Photons<1> {
    let caster = RayCaster::build_near(&scene.mesh, &scene.near, 1).expect("the shipped mesh is good");
    let tracer = Tracer::<1>::new(scene, &caster, count as u64);
    let all = LandingRecorder::merge(tracer.trace(Seed(1), 0, LandingRecorder::new, |_| {}).0);
    let landed = all.positions.len();
    assert!(landed >= count, "each photon lands at least once");
    let kept = (0..count).map(|photon| photon * landed / count);
    let (positions, flux) = kept.map(|photon| (all.positions[photon], all.flux[photon])).unzip();
    Photons { positions, flux }
}

/// Median seconds of each contender over some rounds; they take turns, so that a slow spell of the machine hits all.
fn medians(contenders: &mut [Box<dyn FnMut() + '_>], rounds: usize) -> Vec<f64> {
    let mut times = vec![Vec::new(); contenders.len()];
    contenders.iter_mut().for_each(|contender| contender());
    for _ in 0..rounds {
        for (contender, times) in contenders.iter_mut().zip(&mut times) {
            let started = Instant::now();
            contender();
            times.push(started.elapsed().as_secs_f64());
        }
    }
    let median = |mut times: Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    times.into_iter().map(median).collect()
}

/// One line for all trees; the second is the baseline.
fn line(table: &mut Table, photons: usize, what: &str, unit: &str, values: &[f64]) {
    let names = ["kd", "kiddo", "paper"];
    let ratios: Vec<f64> = values.iter().map(|value| values[1] / value).collect();
    let cells = names.iter().zip(values).zip(&ratios);
    let text: Vec<String> =
        cells.map(|((name, value), ratio)| format!("{name} {value:>9.1} ({ratio:>5.2} ×)")).collect();
    println!("{photons:>9} {what:<34} {unit:<11} {}", text.join("  "));
    for ((name, value), ratio) in names.iter().zip(values).zip(&ratios) {
        table.push(format!("{photons},{what},{name},{value:.2},{unit},{ratio:.3}"));
    }
}

struct Maps {
    kd: PhotonMap<KdTree, 1>,
    kiddo: PhotonMap<Kiddo, 1>,
    paper: PhotonMap<Paper, 1>,
}

fn compare(scene: &Scene, count: usize, table: &mut Table) {
    let photons = landings(scene, count);
    let map = || (photons.positions.clone(), photons.flux.clone());
    fn built<T: NearestPhotons>((positions, flux): (Vec<[f32; 3]>, Vec<luxmap::flux::Flux<1>>)) -> PhotonMap<T, 1> {
        PhotonMap::build(positions, flux)
    }
    let maps = Maps { kd: built(map()), kiddo: built(map()), paper: built(map()) };
    let floor = &scene.planes[0];
    let grid: Vec<[f32; 3]> = (0..floor.len()).map(|i| floor.point(i).as_vec3().to_array()).collect();
    let mut stream = Seed(2).stream(0);
    let random: Vec<[f32; 3]> = (0..4000).map(|_| near_a_photon(&photons.positions, &mut stream)).collect();
    // A strip in the middle of the floor, in scan order.
    let strip = &grid[grid.len() * 9 / 20..][..grid.len() / 10];

    agree(&maps, &built::<BruteForce>(map()), strip.iter().chain(&random).copied().step_by(count / 700 + 1));

    let build = medians(
        &mut [
            Box::new(|| drop(black_box(KdTree::build(&photons.positions)))),
            Box::new(|| drop(black_box(Kiddo::build(&photons.positions)))),
            Box::new(|| drop(black_box(Paper::build(&photons.positions)))),
        ],
        if count > 1_000_000 { 3 } else { 9 },
    );
    line(table, count, "build", "ms", &build.iter().map(|seconds| 1e3 * seconds).collect::<Vec<_>>());
    let bytes = [maps.kd.memory(), maps.kiddo.memory(), maps.paper.memory()].map(|bytes| bytes as f64 / count as f64);
    line(table, count, "memory beside the flux", "bytes/photon", &bytes);
    for (name, points) in [("floor", strip), ("random", &random)] {
        for k in [10, 100, 500] {
            time(table, count, &format!("sum of the {k} nearest, {name}"), &maps, points, Ask::Sum(k));
        }
        for k in [10, 100, 500] {
            time(table, count, &format!("visit of the {k} nearest, {name}"), &maps, points, Ask::Visit(k));
        }
        for radius in FIXED {
            time(table, count, &format!("kernel sum within {radius} m, {name}"), &maps, points, Ask::Kernel(radius));
        }
    }
}

fn near_a_photon(positions: &[[f32; 3]], stream: &mut Stream) -> [f32; 3] {
    let photon = (stream.uniform() * positions.len() as f32) as usize;
    positions[photon.min(positions.len() - 1)].map(|along| along + 1e-3 * (stream.uniform() - 0.5))
}

/// What a query asks for.
#[derive(Clone, Copy)]
enum Ask {
    Sum(usize),
    Visit(usize),
    Kernel(f32),
}

impl Ask {
    fn of<T: NearestPhotons>(self, map: &PhotonMap<T, 1>, points: &[[f32; 3]], scratch: &mut T::Scratch) {
        for &at in points {
            match self {
                Self::Sum(k) => drop(black_box(map.sum_nearest(at, k, RADIUS, scratch))),
                Self::Visit(k) => map.tree().visit_nearest(at, k, RADIUS, scratch, |photon, distance| {
                    black_box((photon, distance));
                }),
                Self::Kernel(radius) => drop(black_box(kernel_sum(map, at, radius, scratch))),
            }
        }
    }
}

fn time(table: &mut Table, count: usize, what: &str, maps: &Maps, points: &[[f32; 3]], ask: Ask) {
    let few = &points[..points.len() / 16]; // it takes a hundred times as long
    let (mut kd, mut kiddo, mut paper) = (maps.kd.scratch(), maps.kiddo.scratch(), maps.paper.scratch());
    let seconds = medians(
        &mut [
            Box::new(|| ask.of(&maps.kd, points, &mut kd)),
            Box::new(|| ask.of(&maps.kiddo, points, &mut kiddo)),
            Box::new(|| ask.of(&maps.paper, few, &mut paper)),
        ],
        ROUNDS,
    );
    let lengths = [points.len(), points.len(), few.len()];
    let each: Vec<f64> = seconds.iter().zip(lengths).map(|(seconds, length)| 1e9 * seconds / length as f64).collect();
    line(table, count, what, "ns/query", &each);
}

/// Every tree gives brute force's answers.
fn agree(maps: &Maps, brute: &PhotonMap<BruteForce, 1>, points: impl Iterator<Item = [f32; 3]>) {
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-5 * b.abs();
    for at in points {
        for k in [10, 100, 500] {
            let expected = brute.sum_nearest(at, k, RADIUS, &mut ());
            let check = |name: &str, found: NearestSum<1>| {
                let same = found.count == expected.count
                    && close(found.radius_squared.into(), expected.radius_squared.into())
                    && close(found.flux[0], expected.flux[0]);
                assert!(same, "{name} at {at:?}, k = {k}: {found:?}, expected {expected:?}");
            };
            check("kd", maps.kd.sum_nearest(at, k, RADIUS, &mut maps.kd.scratch()));
            check("kiddo", maps.kiddo.sum_nearest(at, k, RADIUS, &mut maps.kiddo.scratch()));
            check("paper", maps.paper.sum_nearest(at, k, RADIUS, &mut maps.paper.scratch()));
        }
        for radius in FIXED {
            let expected = kernel_sum(brute, at, radius, &mut ());
            let found = kernel_sum(&maps.kd, at, radius, &mut maps.kd.scratch());
            assert!(close(found, expected), "kd at {at:?} within {radius} m: {found}, expected {expected}");
        }
    }
}

/// All photons in one place, asked for from half a metre away and from within, against as many spread over a floor.
fn crowded(table: &mut Table) {
    let (count, k) = (1_000_000, 100);
    let mut stream = Seed(3).stream(0);
    let spread: Vec<[f32; 3]> = (0..count).map(|_| [6.0 * stream.uniform(), 7.2 * stream.uniform(), 0.0]).collect();
    let (spread, one) = (KdTree::build(&spread), KdTree::build(&vec![[1.0, 1.0, 0.0]; count]));
    let points: Vec<[f32; 3]> = (0..1000).map(|_| [6.0 * stream.uniform(), 7.2 * stream.uniform(), 0.0]).collect();
    fn all(tree: &KdTree, points: &[[f32; 3]], k: usize) {
        let mut scratch = tree.scratch();
        for &at in points {
            tree.visit_nearest(at, k, 10.0, &mut scratch, |photon, distance| {
                black_box((photon, distance));
            });
        }
    }
    let within = vec![[1.0, 1.0, 0.0]; 1000];
    let seconds = medians(
        &mut [
            Box::new(|| all(&spread, &points, k)),
            Box::new(|| all(&one, &points, k)),
            Box::new(|| all(&one, &within, k)),
        ],
        ROUNDS,
    );
    let sets = ["spread over a floor", "in one place, from afar", "in one place, from there"];
    for (what, time) in sets.iter().zip(&seconds) {
        let (each, ratio) = (1e9 * time / 1000.0, seconds[0] / time);
        println!("{count:>9} kd, visit of the {k} nearest, {what:<26} {each:>9.1} ns/query");
        table.push(format!("{count},visit of the {k} nearest {what},kd,{each:.2},ns/query,{ratio:.3}"));
    }
    println!("{:>9} in one place / spread: {:.2} and {:.2}", "", seconds[1] / seconds[0], seconds[2] / seconds[0]);
}
