//! What is sampled, what is left out and what is left to rays: within the claims.

use super::*;
use crate::gather::direct::visit::PROBES;

/// Small triangles of a few centimetres strewn through a box, by a fixed seed.
fn clutter(count: u64, low: DVec3, high: DVec3, size: f32) -> Mesh {
    let mut stream = Seed(9).stream(0);
    let mut mesh = Mesh::default();
    for _ in 0..count {
        let at = low + (high - low) * v(stream.uniform().into(), stream.uniform().into(), stream.uniform().into());
        let first = mesh.vertices.len() as u32;
        let corner = |stream: &mut crate::random::Stream| (at.as_vec3() + stream.on_sphere() * size).to_array();
        mesh.vertices.extend([corner(&mut stream), corner(&mut stream), corner(&mut stream)]);
        mesh.triangles.push([first, first + 1, first + 2]);
        mesh.material_of.push(0);
    }
    mesh
}

/// (E, variance) by plain sampling: jittered strata over every opening, two rays in each, weighed against the formula.
fn sampled(luminaires: &[Luminaire], start: Vec3, up: Vec3, caster: &RayCaster, side: usize, seed: Seed) -> (f64, f64) {
    let mut sum = (0.0, 0.0);
    for (index, luminaire) in luminaires.iter().enumerate() {
        let Opening::Rectangle { centre, half_width, half_depth } = luminaire.opening else { panic!("a rectangle") };
        let cross = half_width.cross(half_depth);
        let (normal, area) = (cross.normalize(), 4.0 * cross.length());
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corners = corners.map(|(a, b)| centre + half_width * a + half_depth * b);
        let eye = start.as_dvec3();
        let lux = luminaire.flux.0 / (PI * area) * projected_solid_angle(&corners, eye, up.as_dvec3());
        let mut stream = seed.branch(index as u64).stream(0);
        let mut cast = |stratum: usize| {
            let [a, b] = stream.uniform_pair();
            let at = [(stratum % side) as f32 + a, (stratum / side) as f32 + b];
            let [a, b] = at.map(|x| 2.0 * f64::from(x) / side as f64 - 1.0);
            let to = centre + half_width * a + half_depth * b + normal * 1e-5 - eye;
            let (distance, direction) = (to.length(), to.normalize());
            let weight = direction.dot(up.as_dvec3()).max(0.0) * (-direction.dot(normal)).max(0.0) / distance.powi(2);
            (weight, !caster.is_occluded(start, direction.as_vec3(), distance as f32))
        };
        let pairs: Vec<_> = (0..side * side).map(|stratum| [cast(stratum), cast(stratum)]).collect();
        let whole: f64 = pairs.iter().flatten().map(|ray| ray.0).sum();
        if whole > 0.0 {
            let share = pairs.iter().flatten().filter(|ray| ray.1).map(|ray| ray.0).sum::<f64>() / whole;
            let off = |(weight, seen): (f64, bool)| weight * (if seen { 1.0 - share } else { -share });
            let squares: f64 = pairs.iter().map(|&[a, b]| (off(a) - off(b)).powi(2)).sum();
            sum.0 += lux * share;
            // An edge that runs between rays shows in no pair: then a stratum's worst, 1/16 of its square, stands for
            // it.
            let least = if share > 0.0 && share < 1.0 { 1.0 / 16.0 / ((side * side) as f64).powi(2) } else { 0.0 };
            sum.1 += lux * lux * (squares / (whole * whole)).max(least);
        }
    }
    sum
}

/// The seed office against two rays in each of 32 × 32 strata of every opening, at points all over both planes:
/// differences have the size of the sampling's own standard error. Over n points the mean of their squares is 1 ±
/// √(2/n); at most 6 σ anywhere, since where an edge crosses few strata the spread is not normal.
#[test]
fn the_seed_office_agrees_with_plain_sampling() {
    let (side, step) = (32, 89);
    let scene = Scene::load(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/seed-office.toml"))).unwrap();
    let caster = RayCaster::build(&scene.mesh, 1).unwrap();
    let blockers = Blockers::new(&scene.mesh, &caster);
    for plane in &scene.planes {
        let receiver = Receiver::of_plane(plane, &caster, 1e-3, 1.0);
        let light: DirectLight<1> = direct_light(&scene.luminaires, &receiver, &blockers, Seed(1), |_| ());
        assert_eq!(light.rays, 0, "nothing in this office is too fine to be cut exactly");
        let points: Vec<usize> = (0..receiver.len()).step_by(step).collect();
        let references: Vec<(f64, f64)> = points
            .par_iter()
            .map(|&point| {
                let seed = Seed(7).branch(point as u64);
                sampled(&scene.luminaires, receiver.start(point), receiver.normal, &caster, side, seed)
            })
            .collect();
        let (mut squares, mut count, mut error, mut noise, mut mean) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (&point, (expected, variance)) in points.iter().zip(&references) {
            let found = light.value[point][0] + light.left_out[point] / 2.0;
            let off = (found - expected).abs();
            // Half of what was left out may be too much or too little; formula and rays differ by single precision.
            let slack = 0.5 * light.left_out[point] + 1e-5 * expected;
            // Strata of which both rays missed a sliver: up to 2e-4 of a luminaire, so 1e-4 of all at most.
            let most = 6.0 * variance.sqrt() + slack + 1e-4 * expected;
            assert!(off <= most, "{} {point}: {found}, expected {expected}", plane.name);
            if *variance > 0.0 {
                squares += (off - slack).max(0.0).powi(2) / variance;
                count += 1.0;
            }
            error += off * off;
            noise += variance;
            mean += expected;
        }
        let n = points.len() as f64;
        let percent = |squares: f64| 100.0 * (squares / n).sqrt() / (mean / n);
        println!(
            "{}: off by {:.4} % RMS, sampling's own {:.4} %, χ²/n {:.3} over {count}",
            plane.name,
            percent(error),
            percent(noise),
            squares / count
        );
        assert!(squares / count <= 1.0 + 5.0 * (2.0_f64 / count).sqrt(), "χ²/n = {}", squares / count);
    }
}

/// 200 panels in a row 600 m long: what far panels can add is left out, by less than the bound kept for each point,
/// which is less than 1e-4 of its light; and it is no more than that which makes the sum smaller than the exact one.
#[test]
fn what_is_left_out_is_bounded() {
    let lamps: Vec<Luminaire> =
        (0..200).map(|i| panel([3.0 * f64::from(i), 3.0 * f64::from(i) + 0.6], [-0.3, 0.3], 2.0)).collect();
    let first = v(-1.0, -2.0, 0.0);
    let light = at_grid(&lamps, &Mesh::default(), first, [200, 5], 1.0);
    let mut left_out = 0;
    for point in 0..1000 {
        let at = first + v((point % 200) as f64, (point / 200) as f64, 0.0);
        let all: f64 = (0..200)
            .map(|i| 3.0 * f64::from(i))
            .map(|x| projected_solid_angle(&rectangle([x, x + 0.6], [-0.3, 0.3], 2.0), at, DVec3::Z))
            .sum();
        let (found, most) = (light.value[point][0], light.left_out[point]);
        // Points are rounded to single precision, 6e-5 m at 600 m.
        let rounding = 1e-4 * all;
        assert!(all - found >= -rounding && all - found <= most + rounding, "{point}: {found} + {most}, exact {all}");
        assert!(most <= MAX_LEFT_OUT * found);
        left_out += usize::from(most > 0.0);
    }
    assert!(left_out > 900, "far panels matter at {} points", 1000 - left_out);
    let [mean, largest] = light.left_out_share();
    assert!(0.0 < mean && mean <= largest && largest <= MAX_LEFT_OUT);
}

/// A sheet in 20,000 triangles is too fine to cut: rays sample, and their claims are honest. Over 400 points the mean
/// square error is what was claimed on average, 1 ± 5 √(2/400) of it, or less, as the claim has a floor.
#[test]
fn what_is_too_fine_to_cut_is_sampled_honestly() {
    let cells = 100;
    let at = |i: usize, j: usize| v(2.0 * i as f64 / cells as f64, 4.0 * j as f64 / cells as f64 - 2.0, 1.0);
    let faces: Vec<[DVec3; 4]> = (0..cells * cells)
        .map(|cell| (cell % cells, cell / cells))
        .map(|(i, j)| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
        .collect();
    let mesh = quads(&faces);
    let lamp = panel([-1.0, 1.0], [-1.0, 1.0], 2.0);
    let first = v(-0.45, -0.45, 0.0);
    let light = at_grid(std::slice::from_ref(&lamp), &mesh, first, [20, 20], 0.045);
    let (mut squares, mut claimed) = (0.0, 0.0);
    for point in 0..400 {
        let eye = first + v((point % 20) as f64, (point / 20) as f64, 0.0) * 0.045;
        // The sheet's edge at x = 0, z = 1 casts its shadow from −x on.
        let lit = rectangle([-1.0, (-eye.x).clamp(-1.0, 1.0)], [-1.0, 1.0], 2.0);
        let expected = projected_solid_angle(&lit, eye, DVec3::Z);
        assert!(light.variance[point] > 0.0, "point {point} was cut");
        squares += (light.value[point][0] - expected).powi(2);
        claimed += light.variance[point];
    }
    println!("mean square error / claim = {:.3}", squares / claimed);
    assert!(squares < claimed * (1.0 + 5.0 * (2.0_f64 / 400.0).sqrt()), "{squares}, claimed {claimed}");
}

/// 20,000 triangles are too many to cut, but a plain sheet below them hides all: rays prove that, so the light is 0
/// without a doubt, for no more than the rays of a proof.
#[test]
fn what_is_hidden_behind_fine_things_is_dark_without_a_doubt() {
    let at = |i: i32, j: i32| v(f64::from(i) / 25.0 - 2.0, f64::from(j) / 25.0 - 2.0, 1.0);
    let cells = (0..10_000).map(|cell| (cell % 100, cell / 100));
    let mut faces: Vec<[DVec3; 4]> =
        cells.map(|(i, j)| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]).collect();
    faces.push(rectangle([-2.0, 2.0], [-2.0, 2.0], 0.5));
    let light = at_grid(&[panel([-1.0, 1.0], [-1.0, 1.0], 2.0)], &quads(&faces), v(-0.45, -0.45, 0.0), [20, 20], 0.045);
    assert!(light.value.iter().all(|value| value[0] == 0.0) && light.variance.iter().all(|variance| *variance == 0.0));
    assert!(light.rays <= 400 * u64::from(PROBES), "{} rays", light.rays);
}

/// A panel of 800 small triangles is sampled, and the closed form of its outline lies within the claims, as above: 2 m
/// below it and 20 cm below, where triangles near and far differ most.
#[test]
fn a_fine_emitting_mesh_has_the_light_of_its_outline() {
    let at = |i: u32, j: u32| v(0.1 * f64::from(i) - 1.0, 0.1 * f64::from(j) - 1.0, 2.0);
    let triangles = (0..400)
        .map(|cell| (cell % 20, cell / 20))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, c, b], [a, d, c]]
        })
        .collect();
    let lamp = Luminaire { opening: Opening::Triangles(triangles), ..panel([-1.0, 1.0], [-1.0, 1.0], 2.0) };
    for z in [0.0, 1.8] {
        let first = v(-1.5, -1.5, z);
        let light = at_grid(std::slice::from_ref(&lamp), &Mesh::default(), first, [40, 40], 0.075);
        let (mut squares, mut claimed, mut mean) = (0.0, 0.0, 0.0);
        for point in 0..1600 {
            let eye = first + v((point % 40) as f64, (point / 40) as f64, 0.0) * 0.075;
            let expected = projected_solid_angle(&rectangle([-1.0, 1.0], [-1.0, 1.0], 2.0), eye, DVec3::Z);
            squares += (light.value[point][0] - expected).powi(2);
            claimed += light.variance[point];
            mean += expected / 1600.0;
        }
        println!("{z} m: error / claim {:.3}, claim {:.3} %", squares / claimed, 2.5 * claimed.sqrt() / mean);
        assert!(squares < claimed * (1.0 + 5.0 * (2.0_f64 / 1600.0).sqrt()), "{squares}, claimed {claimed}");
        // By area, samples 20 cm below would scatter by √(4/(3 π 0.2²)/128) = 29 % of E = π lx.
        assert!((claimed / 1600.0).sqrt() < 0.1 * mean, "claimed {claimed}");
    }
}

/// A thousand panels behind four thousand pickets: those that matter little get a ray each. Against every panel on its
/// own, which is cut exactly, errors are within the claims (as above), and these within 0.1 %.
#[test]
fn what_matters_little_is_sampled_honestly() {
    let lamps: Vec<Luminaire> = (0..1000)
        .map(|i| (2.0 * f64::from(i % 40), 2.0 * f64::from(i / 40)))
        .map(|(x, y)| panel([x, x + 0.6], [y, y + 0.6], 3.0))
        .collect();
    let pickets: Vec<[DVec3; 4]> = (0..4000)
        .map(|i| (f64::from(i % 80), f64::from(i / 80)))
        .map(|(x, y)| [v(x, y, 0.0), v(x + 0.1, y + 0.6, 0.0), v(x + 0.1, y + 0.6, 1.5), v(x, y, 1.5)])
        .collect();
    let mesh = Arc::new(quads(&pickets));
    let caster = RayCaster::build(&mesh, 1).unwrap();
    let blockers = Blockers::new(&mesh, &caster);
    let (mut squares, mut claimed, mut rays) = (0.0, 0.0, 0);
    for (x, y) in (0..12).map(|i| (3.0 + 6.3 * f64::from(i), 1.0 + 4.1 * f64::from(i))) {
        let first = v(x, y, 0.0);
        let light = at_grid_of(&lamps, &blockers, first, [1, 1], 0.1);
        let alone =
            |lamp: &Luminaire| at_grid_of(std::slice::from_ref(lamp), &blockers, first, [1, 1], 0.1).value[0][0];
        let expected: f64 = lamps.iter().map(alone).sum();
        let found = light.value[0][0] + 0.5 * light.left_out[0];
        assert!(light.variance[0].sqrt() < 1e-3 * expected, "claimed ± {}", light.variance[0].sqrt() / expected);
        squares += ((found - expected).abs() - 0.5 * light.left_out[0]).max(0.0).powi(2);
        claimed += light.variance[0];
        rays += light.rays;
    }
    println!("{rays} rays, mean square error / claim = {:.3}", squares / claimed);
    assert!(rays > 1000 && squares < claimed * (1.0 + 5.0 * (2.0_f64 / 12.0).sqrt()), "{squares}, claimed {claimed}");
}

/// Under clutter, the luminaires overhead are cut out exactly, the many farther ones are left to rays: the two add up
/// to what cutting and sampling all of them finds. Mean of n samples, so within five standard errors, those of the
/// other's own sampling included.
#[test]
fn faint_luminaires_are_left_to_rays_without_bias() {
    let around = |i: i32| [2.0 * f64::from(i) - 0.3, 2.0 * f64::from(i) + 0.3];
    let row = |j: i32| (-6..=6).map(move |i| panel(around(i), around(j), 2.7));
    let luminaires: Vec<Luminaire> = (-6..=6).flat_map(row).collect();
    let mesh = clutter(200_000, v(-13.0, -13.0, 0.3), v(13.0, 13.0, 1.2), 0.012);
    let caster = RayCaster::build(&Arc::new(mesh.clone()), 1).unwrap();
    let blockers = Blockers::new(&mesh, &caster);
    let plane = MeasuringPlane {
        name: "plane".into(),
        corner: v(-0.4, -0.4, 0.0),
        along: v(0.8, 0.0, 0.0),
        across: v(0.0, 0.8, 0.0),
        cells: [4, 4],
        kind: PlaneKind::Air,
        areas: Default::default(),
    };
    let receiver = Receiver::of_plane(&plane, &caster, 1e-4, 1.0);
    let whole: DirectLight<1> = direct_light(&luminaires, &receiver, &blockers, Seed(1), |_| ());
    let asked = Request { faint: true, groups: None };
    let (strong, faint) = direct_light_for::<1>(&luminaires, &receiver, &blockers, Seed(1), |_| (), asked);
    assert!(!faint.is_empty());
    let count = 20_000_u32;
    for point in 0..receiver.len() {
        let (start, normal) = (receiver.start(point), receiver.normal);
        let mut stream = Seed(2).stream(point as u64);
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..count {
            let share = stream.uniform();
            let ([lux], _) = faint.sample(point, share, start, normal, &caster, &mut stream);
            (sum, squares) = (sum + lux, squares + lux * lux);
        }
        let mean = sum / f64::from(count);
        let variance = (squares / f64::from(count) - mean * mean) / f64::from(count);
        let error = 5.0 * (variance + whole.variance[point] + strong.variance[point]).sqrt();
        let (found, expected) = (strong.value[point][0] + mean, whole.value[point][0]);
        let off = (found - expected).abs();
        let allowed = error + whole.left_out[point] + strong.left_out[point];
        assert!(off <= allowed, "point {point}: {found} lx, cut {expected} lx, allowed {allowed}");
        assert!(mean > 3.0 * allowed, "point {point}: a bound of {allowed} tells nothing of {mean} lx");
    }
}
