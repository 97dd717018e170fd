//! Direct light against closed forms, and against plain sampling.

use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

use super::polygon::projected_solid_angle;
use super::*;
use crate::embree::RayCaster;
use crate::geometry::Mesh;
use crate::geometry::body::{Body, Solid};
use crate::luminaire::intensity::Intensity;
use crate::luminaire::web::{Measured, Web};
use crate::luminaire::{Distribution, Opening};
use crate::scene::{MeasuringPlane, PlaneKind, Scene};
use crate::units::Lumens;

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A mesh of quadrilaterals, each as two triangles.
fn quads(quads: &[[DVec3; 4]]) -> Mesh {
    let mut mesh = Mesh::default();
    for quad in quads {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(quad.map(|corner| corner.as_vec3().to_array()));
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        mesh.material_of.extend([0, 0]);
    }
    mesh
}

/// The six sides of a box.
fn sides(low: DVec3, high: DVec3) -> Vec<[DVec3; 4]> {
    let corner = |i: usize| {
        v(
            if i & 1 == 0 { low.x } else { high.x },
            if i & 2 == 0 { low.y } else { high.y },
            if i & 4 == 0 { low.z } else { high.z },
        )
    };
    [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
        .map(|side| side.map(corner))
        .to_vec()
}

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

/// A luminaire of luminance 1 cd/m², shining down from a height on the rectangle between two corners.
fn panel([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], height: f64) -> Luminaire {
    Luminaire {
        name: "panel".into(),
        group: "panel".into(),
        flux: Lumens(PI * (x1 - x0) * (y1 - y0)),
        colour: [1.0; 3],
        opening: Opening::Rectangle {
            centre: v((x0 + x1) / 2.0, (y0 + y1) / 2.0, height),
            half_width: v((x1 - x0) / 2.0, 0.0, 0.0),
            half_depth: v(0.0, (y0 - y1) / 2.0, 0.0),
        },
        distribution: Distribution::Lambertian,
        body: Vec::new(),
        supply: Default::default(),
    }
}

/// The part of a panel's plane between four lines, as a polygon.
fn rectangle([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], height: f64) -> [DVec3; 4] {
    [v(x0, y0, height), v(x1, y0, height), v(x1, y1, height), v(x0, y1, height)]
}

/// Direct light at the points of a horizontal grid whose cells are `cell` wide and whose first point is `first`.
fn at_grid(luminaires: &[Luminaire], mesh: &Mesh, first: DVec3, cells: [usize; 2], cell: f64) -> DirectLight<1> {
    let caster = RayCaster::build(&Arc::new(mesh.clone()), 1).unwrap();
    at_grid_of(luminaires, &Blockers::new(mesh, &caster), first, cells, cell)
}

/// The same with a scene that is ready.
fn at_grid_of(
    luminaires: &[Luminaire],
    blockers: &Blockers<'_>,
    first: DVec3,
    cells: [usize; 2],
    cell: f64,
) -> DirectLight<1> {
    let plane = MeasuringPlane {
        name: "plane".into(),
        corner: first - v(cell, cell, 0.0) / 2.0,
        along: v(cell * cells[0] as f64, 0.0, 0.0),
        across: v(0.0, cell * cells[1] as f64, 0.0),
        cells,
        kind: PlaneKind::Air,
        areas: Default::default(),
    };
    let receiver = Receiver::of_plane(&plane, blockers.caster, 1e-4, 1.0);
    direct_light(luminaires, &receiver, blockers, Seed(1), |_| ())
}

/// Direct light at the origin, facing up; nothing may have been sampled.
fn at_origin(luminaire: Luminaire, mesh: &Mesh) -> f64 {
    let light = at_grid(&[luminaire], mesh, DVec3::ZERO, [1, 1], 0.5);
    assert_eq!((light.rays, light.variance[0]), (0, 0.0));
    light.value[0][0]
}

fn seen(corners: &[DVec3]) -> f64 {
    projected_solid_angle(corners, DVec3::ZERO, DVec3::Z)
}

/// A sheet's edge runs past the point's zenith, so half of an opening above it is hidden; all numbers are exact in single
/// precision, so only the arithmetic's rounding is left.
#[test]
fn a_sheet_halves_an_opening() {
    let sheet = quads(&[[v(0.0, -9.0, 1.0), v(9.0, -9.0, 1.0), v(9.0, 9.0, 1.0), v(0.0, 9.0, 1.0)]]);
    let (found, expected) =
        (at_origin(panel([-1.0, 2.0], [-1.0, 1.0], 2.0), &sheet), seen(&rectangle([-1.0, 0.0], [-1.0, 1.0], 2.0)));
    assert!((found / expected - 1.0).abs() < 1e-11, "{found}, expected {expected}");
}

/// The shadow of a box above the point is that of its lower face; that of a box aside is the hull of its two horizontal
/// faces' shadows. Twelve triangles hide parts of each other's shadows, and none may count twice.
#[test]
fn a_box_hides_its_outline() {
    let wide = |x| panel([-4.0, 4.0], [-4.0, 4.0], x);
    let all = seen(&rectangle([-4.0, 4.0], [-4.0, 4.0], 2.0));
    let above = quads(&sides(v(-0.25, -0.25, 0.5), v(0.25, 0.25, 1.0)));
    let aside = quads(&sides(v(0.25, -0.25, 0.5), v(0.75, 0.25, 1.0)));
    let hull = [[0.5, -0.5], [1.0, -1.0], [3.0, -1.0], [3.0, 1.0], [1.0, 1.0], [0.5, 0.5]].map(|[x, y]| v(x, y, 2.0));
    for (mesh, hidden) in [(above, seen(&rectangle([-1.0, 1.0], [-1.0, 1.0], 2.0))), (aside, seen(&hull))] {
        let (found, expected) = (at_origin(wide(2.0), &mesh), all - hidden);
        assert!((found / expected - 1.0).abs() < 1e-11, "{found}, expected {expected}");
    }
    // All of the opening lies in the shadow.
    let around = quads(&sides(v(-1.0, -1.0, 0.5), v(1.0, 1.0, 1.0)));
    assert_eq!(at_origin(panel([-0.5, 0.5], [-0.5, 0.5], 2.0), &around), 0.0);
}

/// A partition that stands on the point's plane, even one 0.1 mm from the point, or that hangs from the opening's plane or
/// joins the two: light passes above its edge, at x = distance · 2/height, and nowhere else.
#[test]
fn a_partition_may_touch_the_point_s_plane_and_the_opening_s() {
    let upright = |x: f64, low: f64, high: f64| {
        quads(&[[v(x, -99.0, low), v(x, 99.0, low), v(x, 99.0, high), v(x, -99.0, high)]])
    };
    let step = f64::from(2.0_f32.powi(-13));
    for (mesh, lit) in [
        (upright(0.25, 0.0, 1.0), [[-1.0, 0.5], [0.0; 2]]),
        (upright(0.25, -1.0, 1.0), [[-1.0, 0.5], [0.0; 2]]),
        (upright(step, 0.0, 1.0), [[-1.0, 2.0 * step], [0.0; 2]]),
        (upright(0.25, 0.0, 2.0), [[-1.0, 0.25], [0.0; 2]]),
        (upright(0.25, 0.0, 3.0), [[-1.0, 0.25], [0.0; 2]]),
        (upright(0.25, 1.0, 2.0), [[-1.0, 0.25], [0.5, 1.0]]),
        (upright(-step, -1.0, 1.0), [[-2.0 * step, 1.0], [0.0; 2]]),
    ] {
        let found = at_origin(panel([-1.0, 1.0], [-1.0, 1.0], 2.0), &mesh);
        let expected: f64 = lit.map(|x| seen(&rectangle(x, [-1.0, 1.0], 2.0))).iter().sum();
        // What rises above the plane 99e-6 m before the opening is cut off.
        assert!((found / expected - 1.0).abs() < 2e-4, "{found}, expected {expected}");
    }
    // A point in the partition is moved to one side of it, by 2e-6 of the mesh's 99 m, and sees that half of the opening: its
    // light changes by less than that over a quarter of the distance.
    let found = at_origin(panel([-1.0, 1.0], [-1.0, 1.0], 2.0), &upright(0.0, 0.0, 1.0));
    let expected = seen(&rectangle([-1.0, 0.0], [-1.0, 1.0], 2.0));
    assert!((found / expected - 1.0).abs() < 4.0 * 2e-4, "{found}, expected {expected}");
}

/// What lies in the plane of an opening or behind it hides nothing: its own body, a ceiling, another luminaire.
#[test]
fn what_lies_in_the_opening_s_plane_or_behind_hides_nothing() {
    let body = rectangle([-1.0, 1.0], [-1.0, 1.0], 2.0);
    let mesh = quads(&[body, rectangle([-9.0, 9.0], [-9.0, 9.0], 2.0), rectangle([-9.0, 9.0], [-9.0, 9.0], 2.5)]);
    let found = at_origin(panel([-1.0, 1.0], [-1.0, 1.0], 2.0), &mesh);
    assert!((found / seen(&body) - 1.0).abs() < 1e-12, "{found}, expected {}", seen(&body));
}

/// On the axis of a disc E = π L r²/(r² + h²), and a sheet whose edge runs past the zenith leaves half of it. The 96-gon of
/// equal area is off by 1e-6 at h = r, less farther away.
#[test]
fn a_disc_half_hidden_by_a_sheet_has_half_its_light() {
    let disc = Luminaire {
        opening: Opening::Disc { centre: v(0.0, 0.0, 2.0), aim: DVec3::NEG_Z, radius: 1.0 },
        ..panel([0.0, 1.0], [0.0, 1.0], 2.0)
    };
    let disc = Luminaire { flux: Lumens(PI * PI), ..disc }; // 1 cd/m²
    let sheet = quads(&[[v(0.0, -9.0, 1.0), v(9.0, -9.0, 1.0), v(9.0, 9.0, 1.0), v(0.0, 9.0, 1.0)]]);
    let expected = PI / 5.0 / 2.0;
    let found = at_origin(disc, &sheet);
    assert!((found / expected - 1.0).abs() < 1e-6, "{found}, expected {expected}");
}

/// Blocks and parts must find the same as each point alone: a grid over a table, four legs and a box, cell by cell. With
/// one cell there is no block to speak of.
#[test]
fn points_together_see_what_each_sees_alone() {
    let mut faces = sides(v(-0.8, -0.4, 0.7), v(0.8, 0.4, 0.73));
    for (x, y) in [(-0.7, -0.3), (0.7, -0.3), (-0.7, 0.3), (0.7, 0.3)] {
        faces.extend(sides(v(x, y, 0.0), v(x + 0.05, y + 0.05, 0.7)));
    }
    faces.extend(sides(v(0.3, 0.5, 0.0), v(0.6, 0.9, 0.4)));
    let mesh = quads(&faces);
    let lamps: Vec<Luminaire> =
        [-2.0, 0.0, 2.0].map(|x| panel([x - 0.3, x + 0.3], [-0.3, 0.3], 2.6)).into_iter().collect();
    let first = v(-1.5, -1.5, 0.0);
    let together = at_grid(&lamps, &mesh, first, [37, 41], 0.08);
    for index in (0..37 * 41).step_by(11) {
        let at = first + v((index % 37) as f64, (index / 37) as f64, 0.0) * 0.08;
        let alone = at_grid(&lamps, &mesh, at, [1, 1], 0.08).value[0][0];
        let found = together.value[index][0];
        // The points' coordinates are rounded to single precision twice, and edges of shadows move as far.
        assert!(
            (found - alone).abs() <= 1e-5 * lamps.len() as f64 * 0.36 / 6.8,
            "point {index}: {found}, alone {alone}"
        );
    }
    assert_eq!(together.rays, 0);
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
            // An edge that runs between rays shows in no pair: then a stratum's worst, 1/16 of its square, stands for it.
            let least = if share > 0.0 && share < 1.0 { 1.0 / 16.0 / ((side * side) as f64).powi(2) } else { 0.0 };
            sum.1 += lux * lux * (squares / (whole * whole)).max(least);
        }
    }
    sum
}

/// The seed office against two rays in each of 32 × 32 strata of every opening, at points all over both planes: differences
/// have the size of the sampling's own standard error. Over n points the mean of their squares is 1 ± √(2/n); at most 6 σ
/// anywhere, since where an edge crosses few strata the spread is not normal.
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

/// 200 panels in a row 600 m long: what far panels can add is left out, by less than the bound kept for each point, which
/// is less than 1e-4 of its light; and it is no more than that which makes the sum smaller than the exact one.
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
        assert!(most <= MOST_LEFT_OUT * found);
        left_out += usize::from(most > 0.0);
    }
    assert!(left_out > 900, "far panels matter at {} points", 1000 - left_out);
    let [mean, largest] = light.left_out_share();
    assert!(0.0 < mean && mean <= largest && largest <= MOST_LEFT_OUT);
}

/// A sheet in 20,000 triangles is too fine to cut: rays sample, and their claims are honest. Over 400 points the mean square
/// error is what was claimed on average, 1 ± 5 √(2/400) of it, or less, as the claim has a floor.
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

/// 20,000 triangles are too many to cut, but a plain sheet below them hides all: rays prove that, so the light is 0 without
/// a doubt, for no more than the rays of a proof.
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

/// A panel of 800 small triangles is sampled, and the closed form of its outline lies within the claims, as above: 2 m below
/// it and 20 cm below, where triangles near and far differ most.
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

/// A thousand panels behind four thousand pickets: those that matter little get a ray each. Against every panel on its own,
/// which is cut exactly, errors are within the claims (as above), and these within 0.1 %.
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

/// Tables of a downlight, of a batwing with four different planes, and of an uplight that shines all around; finely
/// tabulated, as kinks of the table are no fault of the sum.
fn tables() -> [(&'static str, Intensity); 3] {
    let angles: Vec<f64> = (0..=180).map(f64::from).collect();
    let of = |planes: &[f64], candela: &dyn Fn(f64, f64) -> f64| {
        let candela = planes.iter().flat_map(|&c| angles.iter().map(move |&g| candela(c.to_radians(), g.to_radians())));
        Intensity::new(planes.to_vec(), angles.clone(), candela.collect())
    };
    let quarters: Vec<f64> = (0..24).map(|i| 15.0 * f64::from(i)).collect();
    [
        ("downlight", of(&[0.0], &|_, g| 900.0 * g.cos().max(0.0).powi(6) + 20.0 * g.cos().max(0.0))),
        (
            "batwing",
            of(&quarters, &|c, g| {
                (1.0 + g.sin() * (0.7 * c.cos() + 0.2 * (2.0 * c).sin())) * (0.2 + g.sin().powi(2)) * 100.0
            }),
        ),
        ("uplight", of(&quarters, &|c, g| 50.0 + 40.0 * (-g.cos()) * (1.0 + 0.3 * (c - 1.0).cos() * g.sin()))),
    ]
}

/// A luminaire at the origin that looks along `aim` and shines by a table.
fn measured(table: &Intensity, opening: Opening, aim: DVec3, rotation: f64) -> Luminaire {
    let web = Arc::new(Web::new(table.clone()).expect("light"));
    Luminaire {
        flux: Lumens(table.flux()),
        opening,
        distribution: Distribution::Measured(Measured::new(web, aim, rotation)),
        ..panel([0.0, 1.0], [0.0, 1.0], 0.0)
    }
}

/// Openings of every form around the origin, some `size` across; the last three are bodies.
fn openings(aim: DVec3, size: f64) -> [Opening; 7] {
    let centre = DVec3::ZERO;
    let u = crate::luminaire::frame::c0_direction(aim, 0.0);
    let (u, v, w) = (u * (0.5 * size), aim.cross(u) * (0.5 * size), aim * (0.5 * size));
    let body = |solid, half_axes| Opening::Body(Body { solid, centre, half_axes });
    [
        Opening::Point { position: centre, aim },
        Opening::Rectangle { centre, half_width: u, half_depth: v * 0.6 },
        Opening::Disc { centre, aim, radius: 0.5 * size },
        Opening::Ellipse { centre, half_width: u * 0.5, half_depth: v },
        body(Solid::Box, [u, v, w * 0.3]),
        body(Solid::Cylinder, [v * 0.2, w * 0.2, u]),
        body(Solid::Ellipsoid, [u, v * 0.5, w * 0.4]),
    ]
}

/// Direct light at a point of a surface with normal `up`, and its rays.
fn at_point(luminaire: &Luminaire, mesh: &Mesh, at: DVec3, up: DVec3) -> (f64, u64) {
    let caster = RayCaster::build(&Arc::new(mesh.clone()), 1).unwrap();
    let (u, v) = up.any_orthonormal_pair();
    let v = v * u.cross(v).dot(up).signum();
    let plane = MeasuringPlane {
        name: "point".into(),
        corner: at - (u + v) * 5e-4,
        along: u * 1e-3,
        across: v * 1e-3,
        cells: [1, 1],
        kind: PlaneKind::Air,
        areas: Default::default(),
    };
    let receiver = Receiver::of_plane(&plane, &caster, 1e-6, 1.0);
    let blockers = Blockers::new(mesh, &caster);
    let light: DirectLight<1> = direct_light(std::slice::from_ref(luminaire), &receiver, &blockers, Seed(1), |_| ());
    (light.value[0][0], light.rays)
}

/// Far from a luminaire E = I(C, γ) cos/d², whatever its opening and symmetry and however it is turned, downwards, upwards and
/// in the plane of a flat opening. At 200 times its size a flat opening is off by (1/400)² and kinks of 1° steps; a body's
/// front is nearer than its middle.
#[test]
fn far_away_a_measured_luminaire_is_its_intensity() {
    for (name, table) in tables() {
        for (aim, rotation) in [(DVec3::NEG_Z, 0.0), (v(0.6, 0.0, -0.8), 30.0), (DVec3::Y, 0.0)] {
            for opening in openings(aim, 0.1) {
                let lamp = measured(&table, opening, aim, rotation);
                let Distribution::Measured(web) = &lamp.distribution else { unreachable!() };
                let horizon = crate::luminaire::frame::c0_direction(aim, 77.0);
                let around = (0..40).map(|i| {
                    let (z, phi) = ((f64::from(i) + 0.5) / 20.0 - 1.0, 2.399_963 * f64::from(i));
                    v((1.0 - z * z).sqrt() * phi.cos(), (1.0 - z * z).sqrt() * phi.sin(), z)
                });
                for direction in around.chain([horizon, aim, -aim]) {
                    let at = direction * 20.0;
                    let up = (-direction + 0.4 * direction.any_orthonormal_vector()).normalize();
                    let expected = lamp.flux.0 * web.at(direction) * -direction.dot(up) / 400.0;
                    let (found, _) = at_point(&lamp, &Mesh::default(), at, up);
                    // Beside a kink (that of a cosine at 90°) half of the opening's angle sees the other side of it.
                    let nearer = if let Opening::Body(body) = &lamp.opening { 2.0 * body.radius() / 20.0 } else { 0.0 };
                    let slack = (5e-4 + nearer) * expected + 2e-5 * lamp.flux.0 * web.web().most() / 400.0;
                    assert!(
                        (found - expected).abs() < slack,
                        "{name}, {:?} to {direction}: {found}, expected {expected}",
                        lamp.opening
                    );
                }
            }
        }
    }
}

/// Surface of an opening in small vector areas (both sides of flat ones): parameters of 0 … 1, `n` steps of each.
fn elements(opening: &Opening, n: usize) -> Vec<(DVec3, DVec3)> {
    let patch = |f: &dyn Fn(f64, f64) -> DVec3| -> Vec<(DVec3, DVec3)> {
        let at = |i: usize, j: usize| f(i as f64 / n as f64, j as f64 / n as f64);
        let cells = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        let cell = |(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            ((a + b + c + d) / 4.0, (c - a).cross(d - b) / 2.0)
        };
        cells.map(cell).collect()
    };
    let outward = |centre: DVec3, mut all: Vec<(DVec3, DVec3)>| {
        all.iter_mut().filter(|(at, area)| area.dot(*at - centre) < 0.0).for_each(|(_, area)| *area = -*area);
        all
    };
    let circle = |turn: f64| (2.0 * PI * turn).sin_cos();
    match opening {
        Opening::Rectangle { centre, half_width: w, half_depth: d } => {
            patch(&|a, b| *centre + *w * (2.0 * a - 1.0) + *d * (2.0 * b - 1.0))
        }
        Opening::Ellipse { centre, half_width: w, half_depth: d } => patch(&|a, b| {
            let (sin, cos) = circle(b);
            *centre + (*w * cos + *d * sin) * a.sqrt()
        }),
        Opening::Body(Body { solid: Solid::Box, centre, half_axes: [u, v, w] }) => {
            let face =
                |u: DVec3, v: DVec3, w: DVec3| patch(&|a, b| *centre + w + u * (2.0 * a - 1.0) + v * (2.0 * b - 1.0));
            let all = [(u, v, w), (v, w, u), (w, u, v)].map(|(u, v, w)| [face(*u, *v, *w), face(*u, *v, -*w)].concat());
            outward(*centre, all.concat())
        }
        Opening::Body(Body { solid: Solid::Cylinder, centre, half_axes: [u, v, w] }) => {
            let rim = |turn: f64| *u * circle(turn).1 + *v * circle(turn).0;
            let end = |w: DVec3| patch(&|a, b| *centre + w + rim(b) * a.sqrt());
            let side = patch(&|a, b| *centre + rim(b) + *w * (2.0 * a - 1.0));
            outward(*centre, [end(*w), end(-*w), side].concat())
        }
        Opening::Body(Body { solid: Solid::Ellipsoid, centre, half_axes: [u, v, w] }) => outward(
            *centre,
            patch(&|a, b| {
                let z = 2.0 * a - 1.0;
                let (sin, cos) = circle(b);
                *centre + (*u * cos + *v * sin) * (1.0 - z * z).sqrt() + *w * z
            }),
        ),
        _ => panic!("no surface"),
    }
}

/// E at a point by the definition: every element of the surface has the luminance I/A towards each direction that it faces.
/// `open` tells which of them the point sees.
fn by_definition(lamp: &Luminaire, n: usize, at: DVec3, up: DVec3, open: impl Fn(DVec3) -> bool) -> f64 {
    let Distribution::Measured(web) = &lamp.distribution else { unreachable!() };
    let flat = lamp.opening.flat();
    let element = |&(from, area): &(DVec3, DVec3)| {
        let to = at - from;
        let distance = to.length();
        let d = to / distance;
        let seen = match (&lamp.opening, flat) {
            (Opening::Body(body), _) => area.dot(d).max(0.0) / body.projected_area(d),
            (_, Some((whole, _))) => area.length() / whole,
            _ => 0.0,
        };
        let cosine = (-d.dot(up)).max(0.0);
        if open(from) { lamp.flux.0 * web.at(d) * seen * cosine / (distance * distance) } else { 0.0 }
    };
    elements(&lamp.opening, n).iter().map(element).sum()
}

/// Next to a luminaire and at some distance the sum is that of a fine grid over its surface: seven times of eight by a
/// thousandth, by three at worst, of its light or a tenth of what an even luminaire would bring.
#[test]
fn near_a_measured_luminaire_the_sum_is_that_of_its_surface() {
    let aim = DVec3::NEG_Z;
    let (mut worst, mut far) = (0.0_f64, 0);
    for (name, table) in tables() {
        for opening in openings(aim, 0.6)
            .into_iter()
            .filter(|opening| !matches!(opening, Opening::Point { .. } | Opening::Disc { .. }))
        {
            let lamp = measured(&table, opening, aim, 20.0);
            for (at, up) in [
                (v(0.1, 0.05, -0.2), DVec3::Z),
                (v(0.2, -0.3, -0.6), v(0.3, 0.2, 1.0).normalize()),
                (v(0.9, 0.4, -0.05), DVec3::NEG_X),
                (v(-0.3, 1.0, -1.7), DVec3::Z),
                (v(0.2, -0.1, 0.4), DVec3::NEG_Z),
                (v(0.5, 0.2, -0.7), DVec3::NEG_X),
            ] {
                let expected = by_definition(&lamp, 500, at, up, |_| true);
                let (found, _) = at_point(&lamp, &Mesh::default(), at, up);
                let even = 0.1 * lamp.flux.0 / at.length_squared() / (4.0 * PI);
                let off = (found - expected) / expected.max(even);
                worst = worst.max(off.abs());
                println!("{name}, {:?} at {at}: off {:+.4} %", std::mem::discriminant(&lamp.opening), 100.0 * off);
                far += usize::from(off.abs() > 1e-3);
                assert!(off.abs() < 3e-3, "{name}, {:?} at {at}: {found}, expected {expected}", lamp.opening);
            }
        }
    }
    println!("worst {:.4} %, {far} of 90 beyond 0.1 %", 100.0 * worst);
    assert!(far <= 12, "{far} of 90 beyond 0.1 %");
}

/// A ball of the same luminance everywhere, said in two ways, brings E = Φ/(4π d²) at any distance; its outline is a polygon of
/// 32 corners that has the circle's area on its plane, not on the sphere: right to 1e-3 next to it.
#[test]
fn an_even_ball_is_a_point_at_any_distance() {
    let table = Intensity::new(vec![0.0], vec![0.0, 180.0], vec![1.0; 2]);
    let body = Body { solid: Solid::Ellipsoid, centre: v(0.0, 0.0, 2.0), half_axes: [DVec3::X, DVec3::Y, DVec3::Z] };
    for distribution in
        [measured(&table, Opening::Body(body), DVec3::NEG_Z, 0.0).distribution, Distribution::Lambertian]
    {
        for distance in [1.05, 1.3, 2.0, 10.0] {
            let centre = v(0.0, 0.0, distance);
            let lamp = Luminaire {
                flux: Lumens(4.0 * PI),
                opening: Opening::Body(Body { centre, ..body }),
                distribution: distribution.clone(),
                ..panel([0.0, 1.0], [0.0, 1.0], 0.0)
            };
            let found = at_origin(lamp, &Mesh::default()) * distance * distance;
            assert!((found - 1.0).abs() < 2e-3, "at {distance}: {found}");
        }
    }
}

/// A body's own triangles hide nothing; a ceiling that it is let into hides what of it is above; a sheet to its middle hides
/// half; in and on the body there is no light and no nonsense.
#[test]
fn bodies_are_hidden_by_what_is_before_them_only() {
    let (_, table) = tables()[2].clone();
    for opening in openings(DVec3::NEG_Z, 0.6).into_iter().skip(4) {
        let Opening::Body(body) = opening else { unreachable!() };
        let facets = body.facets();
        let own = Mesh {
            vertices: facets.corners.iter().map(|&corner| body.point(corner).as_vec3().to_array()).collect(),
            triangles: facets.triangles.clone(),
            material_of: vec![0; facets.triangles.len()],
        };
        let mut lamp = measured(&table, opening.clone(), DVec3::NEG_Z, 0.0);
        let at = v(0.4, -0.3, -1.1);
        let (free, _) = at_point(&lamp, &Mesh::default(), at, DVec3::Z);
        lamp.body = (0..facets.triangles.len() as u32).collect();
        assert_eq!(at_point(&lamp, &own, at, DVec3::Z), (free, 0), "{opening:?}");

        let with = |quad: [DVec3; 4]| {
            let mut mesh = own.clone();
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend(quad.map(|corner| corner.as_vec3().to_array()));
            mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
            mesh.material_of.extend([0, 0]);
            at_point(&lamp, &mesh, at, DVec3::Z)
        };
        let ceiling = |z: f64| rectangle([-9.0, 9.0], [-9.0, 9.0], z);
        assert_eq!(with(ceiling(0.5)), (free, 0), "a ceiling above hides nothing");
        assert_eq!(with(ceiling(-0.5)).0, 0.0, "a ceiling below hides all");
        let height = -0.02;
        let (found, rays) = with(ceiling(height));
        let expected = by_definition(&lamp, 500, at, DVec3::Z, |from| from.z < height);
        println!("{:?}: free {free}, below the ceiling {found}, expected {expected}", body.solid);
        assert!(
            rays == 0 && (found - expected).abs() < 6e-3 * free,
            "{body:?}: {found}, expected {expected} of {free}"
        );
    }
    // A sheet whose edge runs through the zenith, below a body right above: half of it, as the table and the body are their
    // own mirror images there.
    let (_, table) = tables()[0].clone();
    let sheet = quads(&[[v(0.0, -9.0, 1.0), v(9.0, -9.0, 1.0), v(9.0, 9.0, 1.0), v(0.0, 9.0, 1.0)]]);
    for opening in openings(DVec3::NEG_Z, 0.6).into_iter().skip(4) {
        let Opening::Body(body) = opening else { unreachable!() };
        let body = Body { centre: v(0.0, 0.0, 2.0), ..body };
        let lamp = |_| measured(&table, Opening::Body(body), DVec3::NEG_Z, 0.0);
        let (half, whole) = (at_origin(lamp(()), &sheet), at_origin(lamp(()), &Mesh::default()));
        assert!((2.0 * half / whole - 1.0).abs() < 2e-3, "{body:?}: {half} of {whole}");
        for at in [v(0.0, 0.0, 2.0), body.centre + body.half_axes[0], body.centre - body.half_axes[2]] {
            let (found, _) = at_point(&lamp(()), &Mesh::default(), at, DVec3::Z);
            assert!(found.is_finite() && found >= 0.0, "{body:?} at {at}: {found}");
        }
    }
}

/// Under clutter, the luminaires overhead are cut out exactly, the many farther ones are left to rays: the
/// two add up to what cutting and sampling all of them finds. Mean of n samples, so within five standard errors, those of the
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
    let asked = Asked { faint: true, groups: None };
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
