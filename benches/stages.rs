//! How fast the stages are, as ratios between contenders that take turns in one run: `cargo bench`.
//!
//! Also writes `out/bench/stages.csv`: what, value, unit, ratio, baseline.

use std::fs;
use std::hint::black_box;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use glam::Vec3;
use luxmap::embree::RayCaster;
use luxmap::flux::Flux;
use luxmap::gather::receiver::{CrossingRecorder, Keep, LandingRecorder};
use luxmap::photon::trace::{Flight, Recorder, Tracer};
use luxmap::photon_map::Tree;
use luxmap::photon_map::{Kiddo, NearestPhotons, Paper, PhotonMap};
use luxmap::random::Seed;
use luxmap::render::plan::{Method, Plan};
use luxmap::render::{Settings, render};
use luxmap::scene::Scene;

const ROUNDS: usize = 7;
/// Search radius of the gather, m.
const RADIUS: f32 = 1.0;

fn main() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/seed-office.toml");
    let scene = Scene::load(file.as_ref()).expect("the shipped scene is good");
    println!("{}, {} threads, luxmap {}", processor(), rayon::current_num_threads(), env!("CARGO_PKG_VERSION"));
    let mut table = vec!["what,value,unit,ratio,baseline".to_owned()];
    trace(&scene, &mut table);
    gather(&scene, &mut table);
    seed_configuration(&scene, &mut table);
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/out/bench");
    fs::create_dir_all(folder).expect("out/ is writable");
    fs::write(format!("{folder}/stages.csv"), table.join("\n") + "\n").expect("out/ is writable");
}

/// Median time of each contender over some rounds; they take turns, so that a slow spell of the machine hits all.
fn medians<const N: usize>(mut contenders: [&mut dyn FnMut(); N]) -> [f64; N] {
    let mut times = [[Duration::ZERO; ROUNDS]; N];
    contenders.iter_mut().for_each(|contender| contender());
    for round in 0..ROUNDS {
        for (contender, times) in contenders.iter_mut().zip(&mut times) {
            let started = Instant::now();
            contender();
            times[round] = started.elapsed();
        }
    }
    times.map(|mut times| {
        times.sort();
        times[ROUNDS / 2].as_secs_f64()
    })
}

fn line(table: &mut Vec<String>, what: &str, value: f64, unit: &str, ratio: f64, baseline: &str) {
    println!("{what:<44} {value:>9.2} {unit:<12} {ratio:>7.3} × {baseline}");
    table.push(format!("{what},{value:.4},{unit},{ratio:.4},{baseline}"));
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be made")
}

/// Keeps the rays themselves.
struct Rays<'a>(&'a Mutex<Vec<(Vec3, Vec3)>>);

impl Recorder<1> for Rays<'_> {
    fn record(&mut self, flight: &Flight<'_>, _: Flux<1>) {
        self.0.lock().expect("no panic").push((flight.origin, flight.direction));
    }
}

/// Tracing (nothing stored) against Embree alone on the same rays, and one thread against all.
fn trace(scene: &Scene, table: &mut Vec<String>) {
    let photons = 1_000_000;
    let caster = RayCaster::build_near(&scene.mesh, &scene.near, rayon::current_num_threads())
        .expect("the shipped mesh is good");
    let tracer = Tracer::<1>::new(scene, &caster, photons);
    let rays = Mutex::new(Vec::new());
    let one = pool(1);
    one.install(|| tracer.trace(Seed(1), 0, || Rays(&rays), |_| {}));
    let rays = rays.into_inner().expect("no panic");

    let store_nothing = || CrossingRecorder::<1>::new(&[], Keep::All);
    let follow = || drop(black_box(tracer.trace(Seed(1), 0, store_nothing, |_| {})));
    let [bare, single, all] = medians([
        &mut || {
            for &(from, towards) in &rays {
                black_box(caster.closest_hit(from, towards, f32::INFINITY));
            }
        },
        &mut || one.install(follow),
        &mut || follow(),
    ]);
    let rate = |seconds: f64| photons as f64 / 1e6 / seconds;
    line(table, "closest hits alone, 1 thread", rays.len() as f64 / 1e6 / bare, "Mrays/s", 1.0, "itself");
    line(table, "trace, 1 thread", rate(single), "Mphotons/s", bare / single, "closest hits alone");
    line(table, "trace, all threads", rate(all), "Mphotons/s", single / all, "1 thread");
}

/// The k nearest photons to points of the floor in the order of its grid, one thread.
fn gather(scene: &Scene, table: &mut Vec<String>) {
    let caster = RayCaster::build_near(&scene.mesh, &scene.near, rayon::current_num_threads())
        .expect("the shipped mesh is good");
    for photons in [30_000, 100_000] {
        let tracer = Tracer::<1>::new(scene, &caster, photons);
        let landed = LandingRecorder::merge(tracer.trace(Seed(1), 0, LandingRecorder::new, |_| {}).0);
        let kiddo = PhotonMap::<Kiddo, 1>::build(landed.positions.clone(), landed.flux.clone());
        let paper = PhotonMap::<Paper, 1>::build(landed.positions.clone(), landed.flux.clone());
        let floor = &scene.planes[0];
        let points: Vec<[f32; 3]> = (0..floor.len()).step_by(8).map(|i| floor.point(i).as_vec3().to_array()).collect();
        for k in [30, 100] {
            let (mut a, mut b) = (kiddo.scratch(), paper.scratch());
            for &point in &points {
                let (a, b) = (kiddo.sum_nearest(point, k, RADIUS, &mut a), paper.sum_nearest(point, k, RADIUS, &mut b));
                let agree = a.count == b.count && (a.radius_squared / b.radius_squared - 1.0).abs() < 1e-5;
                assert!(agree, "trees disagree at {point:?}: {a:?}, {b:?}");
            }
            fn all<T: NearestPhotons>(map: &PhotonMap<T, 1>, points: &[[f32; 3]], k: usize, scratch: &mut T::Scratch) {
                for &point in points {
                    black_box(map.sum_nearest(point, k, RADIUS, scratch));
                }
            }
            let [base, papers] =
                medians([&mut || all(&kiddo, &points, k, &mut a), &mut || all(&paper, &points, k, &mut b)]);
            let each = |seconds: f64| 1e6 * seconds / points.len() as f64;
            let of = format!("{} k photons, k = {k}", photons / 1000);
            line(table, &format!("kiddo, {of}"), each(base), "µs/query", 1.0, "itself");
            line(table, &format!("the paper's tree, {of}"), each(papers), "µs/query", papers / base, "kiddo");
        }
    }
}

/// The paper's configuration, one map of 120 × 144 points, 30,000 photons, k = 100, from the loaded scene to the numbers.
fn seed_configuration(scene: &Scene, table: &mut Vec<String>) {
    let mut scene = scene.clone();
    scene.planes.truncate(1);
    let plan = Plan::new(&scene, Method::Seed);
    let (one, all) = (pool(1), pool(0));
    let run = |tree, pool: &rayon::ThreadPool| {
        let settings = Settings { tree, ..Settings::of(Method::Seed) };
        drop(black_box(pool.install(|| render(&scene, &plan, &settings, &())).expect("the shipped scene is good")));
    };
    let [single, parallel, paper_single, paper_parallel] = medians([
        &mut || run(Tree::Kiddo, &one),
        &mut || run(Tree::Kiddo, &all),
        &mut || run(Tree::Paper, &one),
        &mut || run(Tree::Paper, &all),
    ]);
    line(table, "seed configuration, kiddo, 1 thread", 1e3 * single, "ms", 1.0, "itself");
    line(table, "seed configuration, kiddo, all threads", 1e3 * parallel, "ms", parallel / single, "1 thread");
    line(table, "seed configuration, paper's tree, 1 thread", 1e3 * paper_single, "ms", paper_single / single, "kiddo");
    line(
        table,
        "seed configuration, paper's tree, all",
        1e3 * paper_parallel,
        "ms",
        paper_parallel / paper_single,
        "1 thread",
    );
}

/// Name of the processor, where the system tells it.
fn processor() -> String {
    let about = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = about.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    name.map_or_else(|| "unknown processor".into(), |(_, name)| name.to_owned())
}
