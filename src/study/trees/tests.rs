use crate::photon_map::{BruteForce, NearestPhotons};
use crate::study::trees::contender::Holding;
use crate::study::trees::*;

/// What is wrong with a tree.
trait Fault: Send + Sync + 'static {
    /// The photon shown in the place of one found: index and squared distance, or none.
    fn show(nth: usize, photon: usize, distance_squared: f32) -> Option<(usize, f32)>;
}

/// Brute force with a fault.
struct Faulty<F>(BruteForce, std::marker::PhantomData<F>);

impl<F: Fault> NearestPhotons for Faulty<F> {
    type Scratch = ();

    fn build(positions: &[[f32; 3]]) -> Self {
        Self(BruteForce::build(positions), std::marker::PhantomData)
    }

    fn scratch(&self) {}

    fn memory(&self) -> usize {
        self.0.memory()
    }

    fn visit_nearest(&self, at: [f32; 3], k: usize, radius: f32, (): &mut (), mut visit: impl FnMut(usize, f32)) {
        let mut nth = 0;
        self.0.visit_nearest(at, k, radius, &mut (), |photon, distance| {
            if let Some((photon, distance)) = F::show(nth, photon, distance) {
                visit(photon, distance);
            }
            nth += 1;
        });
    }

    fn visit_within(&self, at: [f32; 3], radius: f32, (): &mut (), visit: impl FnMut(usize, f32)) {
        self.visit_nearest(at, usize::MAX, radius, &mut (), visit);
    }
}

struct Nothing;
struct MissesTheNearest;
struct TooFar;
struct SwapsPhotons;

impl Fault for Nothing {
    fn show(_: usize, photon: usize, distance: f32) -> Option<(usize, f32)> {
        Some((photon, distance))
    }
}

impl Fault for MissesTheNearest {
    fn show(nth: usize, photon: usize, distance: f32) -> Option<(usize, f32)> {
        (nth > 0).then_some((photon, distance))
    }
}

impl Fault for TooFar {
    fn show(_: usize, photon: usize, distance: f32) -> Option<(usize, f32)> {
        Some((photon, 1.001 * distance))
    }
}

impl Fault for SwapsPhotons {
    fn show(nth: usize, photon: usize, distance: f32) -> Option<(usize, f32)> {
        Some((if nth == 0 { (photon + 1) % 1000 } else { photon }, distance))
    }
}

fn settings() -> ComparisonSettings {
    ComparisonSettings {
        sets: vec![Set::Uniform],
        photons: vec![1000],
        nearest: vec![5, 40],
        radii: vec![0.5],
        trees: TREES.to_vec(),
        seed: 1,
    }
}

fn checked<F: Fault>(set: Set, calls: &[Call]) -> Result<(), Disagreement> {
    let sample = settings().sample(set, 1000, &Landings::default());
    let Photons { positions, flux } = sample.photons.clone();
    let tree: Box<dyn Contender> = Box::new(Holding::<Faulty<F>>::new(Tree::Kd, positions, flux));
    agreement::check(set.name(), &sample, &[tree], calls)
}

#[test]
fn a_wrong_tree_is_found_by_every_question_it_answers_wrongly() {
    let questions = [Call::Sum(5), Call::Visit(5), Call::Within(0.5)];
    for question in questions {
        assert_eq!(checked::<Nothing>(Set::Uniform, &[question]), Ok(()));
        assert!(checked::<MissesTheNearest>(Set::Uniform, &[question]).is_err(), "{question:?}");
        assert!(checked::<TooFar>(Set::Uniform, &[question]).is_err(), "{question:?}");
    }
    // Visits don't give flux.
    assert!(checked::<SwapsPhotons>(Set::Uniform, &[Call::Sum(5)]).is_err());
    assert!(checked::<SwapsPhotons>(Set::Uniform, &[Call::Within(0.5)]).is_err());
    let message = checked::<MissesTheNearest>(Set::Uniform, &[Call::Visit(5)]).expect_err("wrong").to_string();
    assert!(message.starts_with("kd on uniform photons at ("), "{message}");
    let counts = message
        .split_once(" m: found ")
        .and_then(|(_, rest)| rest.split_once(" nearest photons within 0.975 m, expected "));
    let (found, expected) = counts.expect("what was found and expected");
    let [found, expected] = [found, expected].map(|count| count.parse::<u32>().expect("a number"));
    assert_eq!(found + 1, expected, "{message}");
}

/// Of photons that are equally far any may be taken, but no others: in one place, a sum of 5 lies between the five
/// darkest and the five brightest of all, whatever photon stands for another.
#[test]
fn photons_equally_far_may_be_swapped() {
    assert_eq!(checked::<SwapsPhotons>(Set::Coincident, &[Call::Sum(5)]), Ok(()));
    assert!(checked::<MissesTheNearest>(Set::Coincident, &[Call::Sum(5)]).is_err());
}

#[test]
fn every_tree_agrees_on_every_made_up_set() {
    let settings = settings();
    for (name, set) in Set::ALL.into_iter().filter(|(_, set)| *set != Set::Scene) {
        let sample = settings.sample(set, 2000, &Landings::default());
        assert_eq!((sample.photons.positions.len(), sample.random.len()), (2000, RANDOM_POINTS), "{name}");
        let Photons { positions, flux } = &sample.photons;
        let trees: Vec<_> = TREES.iter().map(|&tree| hold(tree, positions.clone(), flux.clone())).collect();
        assert_eq!(agreement::check(name, &sample, &trees, &settings.calls()), Ok(()));
    }
}

#[test]
fn every_case_is_timed_once_with_every_tree() {
    let (settings, pools) = (settings(), Pools::new(2).expect("two threads"));
    let sample = settings.sample(Set::Plane, 1000, &Landings::default());
    let cases = settings.compare(Set::Plane, &sample, &pools, &()).expect("trees agree");
    let calls = [Call::Sum(5), Call::Sum(40), Call::Visit(40), Call::Within(0.5)];
    let expected: Vec<_> = [1, 2]
        .into_iter()
        .flat_map(|threads| Queries::ALL.map(|queries| calls.map(|call| (threads, queries, call))))
        .flatten()
        .collect();
    let found: Vec<_> = cases.iter().map(|case| (case.threads, case.queries, case.call)).collect();
    assert_eq!(found, expected);
    for case in &cases {
        assert_eq!(case.entries.iter().map(|entry| entry.tree).collect::<Vec<_>>(), TREES);
        assert!(case.entries.iter().all(|entry| entry.query_seconds > 0.0 && entry.build_seconds > 0.0));
        // Every tree keeps at least the coordinates: 12 bytes.
        assert!(case.entries.iter().all(|entry| entry.bytes_per_photon >= 12.0), "{:?}", case.entries);
    }
}

#[test]
fn the_papers_figures_double_one_thing_at_a_time() {
    let scene = built_in_scene().expect("the shipped scene is good");
    let start = Start { cells: [6, 4], photons: 300, nearest: 3, doublings: 2 };
    let (settings, pools) = (settings(), Pools::new(2).expect("two threads"));
    let landings = Landings::trace(&scene, start.most_photons(), 1, &()).expect("photons land");
    let points = settings.repeat_figures(&start, &landings, &pools, &()).expect("trees agree");
    assert_eq!(points.len(), 3 * 3 * 3 * 2, "figures × steps × trees × threads");
    let kd: Vec<_> = points.iter().filter(|point| (point.tree, point.threads) == (Tree::Kd, 2)).collect();
    let sizes: Vec<_> = kd.iter().map(|point| (point.pixels, point.photons, point.nearest)).collect();
    let expected = [
        [(24, 300, 3), (48, 300, 3), (96, 300, 3)],
        [(24, 300, 3), (24, 600, 3), (24, 1200, 3)],
        [(24, 300, 3), (24, 300, 6), (24, 300, 12)],
    ];
    assert_eq!(sizes, expected.concat());
    assert!(points.iter().all(|point| point.gather_seconds > 0.0 && (point.threads > 1 || point.speed_up == 1.0)));
    for point in &kd {
        let one = points
            .iter()
            .find(|one| (one.figure, one.size(), one.tree, one.threads) == (point.figure, point.size(), Tree::Kd, 1));
        let one = one.expect("one thread was measured too");
        assert_eq!(point.speed_up, one.gather_seconds / point.gather_seconds);
    }
}

/// Photons of the scene lie on its surfaces: in the box 6.0 × 7.2 × 2.7 m around the origin.
#[test]
fn photons_of_the_scene_lie_in_it_and_so_does_the_grid() {
    let scene = built_in_scene().expect("the shipped scene is good");
    let landings = Landings::trace(&scene, 3000, 1, &()).expect("photons land");
    let sample = settings().sample(Set::Scene, 3000, &landings);
    assert_eq!(sample.photons.positions.len(), 3000);
    let half = [3.0, 3.6, 1.35].map(|half: f32| half + 1e-3);
    let inside = |point: &[f32; 3]| (0..3).all(|axis| point[axis].abs() <= half[axis]);
    assert!(sample.photons.positions.iter().chain(&sample.floor).chain(&sample.random).all(inside));
    assert!(sample.floor.iter().all(|point| (point[2] + 1.35).abs() < 1e-3), "the floor plane");
}

#[test]
fn a_part_of_the_points_is_runs_in_order() {
    let points: Vec<[f32; 3]> = (0..17_280).map(|i| [i as f32, 0.0, 0.0]).collect();
    let part = spread(&points, 4320);
    assert_eq!(part.len(), 4320);
    assert!(part.windows(2).all(|pair| pair[0][0] < pair[1][0]));
    let steps = part.windows(2).filter(|pair| pair[1][0] - pair[0][0] > 1.0).count();
    assert_eq!(steps, 4320 / RUN - 1, "runs stay together");
    assert_eq!(spread(&points, 20_000).len(), 17_280);
    assert_eq!(spread(&points, 0).len(), RUN, "never nothing");
    assert!(spread(&[], 5).is_empty());
}
