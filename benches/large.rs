//! How near photon tracing and gather rays come to Embree alone in a large office: `cargo bench --bench large`, or
//! `cargo bench --bench large -- --workstations 330 --detail 2 --photons 1000000` for another size.
//!
//! The office is made by `luxmap office`'s own code in a temporary folder. All contenders take turns, on one thread and
//! on two, and do the same work: the rays of the baselines are those of the photons, in their order. Rates are medians;
//! those of emission count photons.

use std::fs;
use std::hint::black_box;
use std::time::Instant;

use glam::Vec3;
use luxmap::embree::RayCaster;
use luxmap::flux::Flux;
use luxmap::gather::patches::{PatchGrid, PatchLight, PatchRecorder};
use luxmap::gather::receiver::Receiver;
use luxmap::gather::sight::{Records, Sight};
use luxmap::office::{Office, Parameters, Windows};
use luxmap::photon::emit::Emission;
use luxmap::photon::trace::{Flight, Recorder, Tracer};
use luxmap::random::Seed;
use luxmap::scene::Scene;
use rayon::prelude::*;

const ROUNDS: usize = 7;
/// Rays from each point of the floor: the default of `luxmap render`, all in one round.
const RAYS: usize = 8;
/// Points of the floor that are asked together.
const POINTS: usize = 64;

fn main() {
    let workstations = option("--workstations", 330) as u32;
    let detail = option("--detail", 2) as u32;
    let photons = option("--photons", 1_000_000);
    let parameters = Parameters {
        workstations,
        detail,
        windows: Windows::Matte,
        luminaires: Some((workstations * 4 / 11).max(1)), // panels; downlights come on top
        cell: 0.4,
        ..Parameters::default()
    };
    let folder = std::env::temp_dir().join(format!("luxmap-large-{}", std::process::id()));
    Office::new(parameters)
        .and_then(|office| office.write(&folder))
        .expect("the folder for temporary files is writable");
    let started = Instant::now();
    let scene = Scene::load(&folder.join("office.toml")).expect("an office is a good scene");
    let load = started.elapsed().as_secs_f64();
    fs::remove_dir_all(&folder).expect("it was made above");
    let started = Instant::now();
    let caster = RayCaster::build_near(&scene.mesh, &scene.near, rayon::current_num_threads())
        .expect("an office's mesh is good");
    let (triangles, luminaires) = (scene.mesh.triangles.len(), scene.luminaires.len());
    println!("{triangles} triangles, {luminaires} luminaires, {photons} photons, load average {}", load_average());
    println!("loaded in {load:.2} s, BVH in {:.2} s", started.elapsed().as_secs_f64());
    measure(&scene, &caster, photons);
}

fn measure(scene: &Scene, caster: &RayCaster, photons: u64) {
    let tracer = Tracer::<1>::new(scene, caster, photons);
    let (rays, tally) = tracer.trace(Seed(1), 0, Rays::default, |_| {});
    let rays: Vec<Rays> = rays;
    assert_eq!(rays.iter().map(|rays| rays.0.len() as u64).sum::<u64>(), tally.rays);

    let floor = Receiver::of_plane(&scene.planes[0], caster, 2e-3, 1.0);
    let looks: Vec<(Vec3, Vec3)> = (0..floor.len() * RAYS).map(|ray| look(&floor, ray / RAYS, ray % RAYS)).collect();
    let seen = looks.iter().filter_map(|&(from, towards)| caster.closest_triangle(from, towards, f32::INFINITY));
    let (distance, hits) = seen.fold((0.0, 0), |(sum, hits), (_, distance)| (sum + f64::from(distance), hits + 1));
    let useful = |material: u32| scene.materials[material as usize].is_diffuse();
    // A tenth of how far points look, as `gather` chooses.
    let patch = 0.1 * distance / f64::from(hits);
    let grid = PatchGrid::new(&scene.mesh, useful, patch as f32, (&scene.near, 0.1), 2e-3);
    let light = PatchLight::new(&grid, &tracer.trace(Seed(1), 0, || PatchRecorder::new(&grid), |_| {}).0);
    let sight = Sight::new(scene, caster, false);
    let records = Some(Records { grid: &grid, light: &light, caustics: None });
    let gather = || -> u64 {
        let of_points = |(part, looks): (usize, &[(Vec3, Vec3)])| {
            let (mut stream, mut cast) = (Seed(2).stream(part as u64), 0);
            for &(from, towards) in looks {
                black_box(sight.incoming(from, towards, records, &mut stream, &mut cast));
            }
            cast
        };
        looks.par_chunks(POINTS * RAYS).enumerate().map(of_points).sum()
    };
    let gather_rays = gather();

    let over = |one: fn(&RayCaster, Vec3, Vec3)| {
        rays.par_iter().for_each(|rays| rays.0.iter().for_each(|&(from, towards)| one(caster, from, towards)));
    };
    let mut embree =
        || over(|caster, from, towards| _ = black_box(caster.closest_triangle(from, towards, f32::INFINITY)));
    let mut closest = || over(|caster, from, towards| _ = black_box(caster.closest_hit(from, towards, f32::INFINITY)));
    let emission = Emission::<1>::new(&scene.luminaires, photons, caster);
    let mut emit = || {
        (0..photons.div_ceil(8192)).into_par_iter().for_each(|chunk| {
            for photon in 8192 * chunk..photons.min(8192 * (chunk + 1)) {
                let place = (photon as f64 + 0.5) / photons as f64;
                black_box(emission.photon(place, &mut Seed(1).stream(photon)));
            }
        });
    };
    let mut trace = || drop(black_box(tracer.trace(Seed(1), 0, || Nothing, |_| {})));
    let mut patches = || drop(black_box(tracer.trace(Seed(1), 0, || PatchRecorder::new(&grid), |_| {})));
    let mut first = || {
        let bare =
            |&(from, towards): &(Vec3, Vec3)| _ = black_box(caster.closest_triangle(from, towards, f32::INFINITY));
        looks.par_chunks(POINTS * RAYS).for_each(|looks| looks.iter().for_each(bare));
    };
    let mut gather = || _ = black_box(gather());
    let names = [
        ("Embree alone, photons' rays", tally.rays, 0),
        ("closest hits, photons' rays", tally.rays, 0),
        ("photons emitted, none flown", photons, 0),
        ("photons, nothing kept", tally.rays, 0),
        ("photons, patch recorder", tally.rays, 0),
        ("Embree alone, first gather rays", looks.len() as u64, 5),
        ("gather rays to patches", gather_rays, 5),
    ];
    let mut contenders: [&mut (dyn FnMut() + Send); 7] =
        [&mut embree, &mut closest, &mut emit, &mut trace, &mut patches, &mut first, &mut gather];
    let pools = [1, 2].map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads"));
    let mut spent = [[[Spent::default(); ROUNDS]; 7]; 2];
    for round in 0..ROUNDS {
        for (contender, run) in contenders.iter_mut().enumerate() {
            for (pool, spent) in pools.iter().zip(&mut spent) {
                let before = Spent::now();
                pool.install(&mut **run);
                spent[contender][round] = Spent::now().since(before);
            }
        }
    }
    let spent = spent.map(|pool| pool.map(median));
    println!("{:.2} rays a photon; patches of {:.2} m", tally.rays as f64 / photons as f64, patch);
    println!(
        "{:<33}{:>10}{:>10}{:>10}{:>10}{:>12}{:>10}{:>10}",
        "", "Mrays/s", "Mrays/s", "× Embree", "× Embree", "2 threads", "by CPU", "Mphot./s"
    );
    println!(
        "{:<33}{:>10}{:>10}{:>10}{:>10}{:>12}{:>10}{:>10}",
        "", "1 thread", "2 threads", "1 thread", "by CPU", "÷ 1 thread", "time", "2 threads"
    );
    for (contender, (name, count, baseline)) in names.into_iter().enumerate() {
        let [one, two] = [0, 1].map(|pool| spent[pool][contender]);
        let base = spent[0][baseline];
        let per_base = names[baseline].1 as f64;
        let rate = |seconds: f64| count as f64 / 1e6 / seconds;
        let against = |own: f64, base: f64| (count as f64 / own) / (per_base / base);
        let photons =
            if count == tally.rays { format!("{:.2}", photons as f64 / 1e6 / two.wall) } else { String::new() };
        println!(
            "{name:<33}{:>10.3}{:>10.3}{:>10.3}{:>10.3}{:>12.3}{:>10.3}{photons:>10}",
            rate(one.wall),
            rate(two.wall),
            against(one.wall, base.wall),
            against(one.processor, base.processor),
            one.wall / two.wall,
            2.0 * one.processor / two.processor,
        );
    }
    println!("load average {}", load_average());
}

/// From a point of the floor along one of its rays.
fn look(floor: &Receiver, point: usize, ray: usize) -> (Vec3, Vec3) {
    let mut stream = Seed(3).branch(ray as u64).stream(point as u64);
    (floor.start(point), floor.direction(point, stream.uniform_pair()))
}

/// Keeps nothing.
struct Nothing;

impl Recorder<1> for Nothing {
    #[inline]
    fn record(&mut self, _: &Flight<'_>, _: Flux<1>) {}
}

/// Keeps the rays themselves.
#[derive(Default)]
struct Rays(Vec<(Vec3, Vec3)>);

impl Recorder<1> for Rays {
    fn record(&mut self, flight: &Flight<'_>, _: Flux<1>) {
        self.0.push((flight.origin, flight.direction));
    }
}

/// Time by the clock, and of all threads, s.
#[derive(Clone, Copy, Default)]
struct Spent {
    wall: f64,
    processor: f64,
}

impl Spent {
    /// Since some moment in the past; processor time is what the system books for each thread, NaN where it doesn't tell.
    fn now() -> Self {
        static START: std::sync::LazyLock<Instant> = std::sync::LazyLock::new(Instant::now);
        let wall = START.elapsed().as_secs_f64();
        let of_thread = |entry: std::io::Result<fs::DirEntry>| {
            let text = fs::read_to_string(entry.ok()?.path().join("schedstat")).ok()?;
            text.split_whitespace().next()?.parse::<f64>().ok()
        };
        let processor = fs::read_dir("/proc/self/task").map_or(f64::NAN, |threads| threads.filter_map(of_thread).sum());
        Self { wall, processor: 1e-9 * processor }
    }

    fn since(self, before: Self) -> Self {
        Self { wall: self.wall - before.wall, processor: self.processor - before.processor }
    }
}

fn median(spent: [Spent; ROUNDS]) -> Spent {
    let of = |part: fn(&Spent) -> f64| {
        let mut parts = spent.each_ref().map(part);
        parts.sort_by(f64::total_cmp);
        parts[ROUNDS / 2]
    };
    Spent { wall: of(|spent| spent.wall), processor: of(|spent| spent.processor) }
}

/// A number given on the command line.
fn option(name: &str, default: u64) -> u64 {
    let given = std::env::args().skip_while(|argument| argument != name).nth(1);
    given.map_or(default, |text| text.parse().unwrap_or_else(|_| panic!("{name}: found {text}, expected a number")))
}

/// What else the machine does, where the system tells it.
fn load_average() -> String {
    fs::read_to_string("/proc/loadavg")
        .ok()
        .and_then(|text| Some(text.split(' ').next()?.to_owned()))
        .unwrap_or_default()
}
