use super::*;
use crate::gather::direct::polygon::projected_solid_angle;
use crate::random::Seed;

/// Bodies of all kinds, slender, flat and tilted.
fn bodies() -> Vec<Body> {
    let tilt = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -0.7, 1.1);
    [Solid::Box, Solid::Cylinder, Solid::Ellipsoid]
        .into_iter()
        .flat_map(|solid| {
            [[1.0, 1.0, 1.0], [0.6, 0.3, 0.02], [0.05, 0.05, 1.2]].map(|[a, b, c]| Body {
                solid,
                centre: DVec3::new(0.3, -0.2, 0.1),
                half_axes: [tilt * DVec3::X * a, tilt * DVec3::Y * b, tilt * DVec3::Z * c],
            })
        })
        .collect()
}

fn directions(count: u32) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |i| {
        let (z, phi) = (2.0 * (f64::from(i) + 0.5) / f64::from(count) - 1.0, 2.399_963 * f64::from(i));
        DVec3::new((1.0 - z * z).sqrt() * phi.cos(), (1.0 - z * z).sqrt() * phi.sin(), z)
    })
}

/// The mesh is closed and faces outward, and is seen as large as the solid: exactly for boxes; a cylinder's sides are
/// ½ w (1 + δ²/24 … 1 − δ²/12) wide, δ = 2π/48, and its ends smaller by δ²/12; the ball is 0.3 % off at worst.
#[test]
fn meshes_are_seen_as_large_as_their_solids() {
    for body in bodies() {
        let vector: DVec3 = body.triangles().map(|[a, b, c]| (b - a).cross(c - a)).sum();
        assert!(vector.length() < 1e-12, "{body:?} is open: {vector}");
        let (mut worst, mut mean) = (0.0_f64, 0.0);
        for d in directions(500) {
            let seen: f64 = body.triangles().map(|[a, b, c]| 0.5 * (b - a).cross(c - a).dot(d).max(0.0)).sum();
            let off = seen / body.projected_area(d) - 1.0;
            worst = worst.max(off.abs());
            mean += off / 500.0;
            assert!(body.projected_area(d) >= body.least_projected_area() * (1.0 - 1e-12));
        }
        println!(
            "{:?} {:?}: worst {:.4} %, mean {:+.4} %",
            body.solid,
            body.half_axes[2].length(),
            1e2 * worst,
            1e2 * mean
        );
        let bound = match body.solid {
            Solid::Box => 1e-12,
            Solid::Cylinder => (TAU / SIDES as f64).powi(2) / 12.0 * 1.01,
            Solid::Ellipsoid => 4e-3,
        };
        assert!(worst < bound, "{body:?}: {worst}");
    }
}

/// Projected solid angle of an outline against the directions of a fine grid whose rays meet the body: n² cells about
/// the up direction, by far enough for 2e-3 (edges cross √n · 4 of them). From afar it is area seen over distance
/// squared.
#[test]
fn outlines_hold_the_rays_that_meet_the_body() {
    let up = DVec3::Z;
    for body in bodies() {
        for eye in [DVec3::new(1.1, 0.2, -1.5), DVec3::new(-0.4, 0.9, -0.6), DVec3::new(0.3, -0.2, -1.3)] {
            let mut outline = Vec::new();
            body.outline(eye, &mut outline);
            if body.holds(eye) {
                assert!(outline.is_empty());
                continue;
            }
            let corners: Vec<DVec3> = outline.iter().map(|corner| eye + *corner).collect();
            let found = projected_solid_angle(&corners, eye, up);
            let n = 1600;
            let mut cells = 0_u32;
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let [x, y] = [i, j].map(|k| (2.0 * f64::from(k) + 1.0) / f64::from(n) - 1.0);
                let height = 1.0 - x * x - y * y;
                let direction = DVec3::new(x, y, height.max(0.0).sqrt());
                cells += u32::from(height > 0.0 && body.entry(eye, direction).is_some());
            }
            let expected = f64::from(cells) * 4.0 / f64::from(n * n);
            assert!((found - expected).abs() < 2e-3 * expected + 1e-4, "{body:?} from {eye}: {found}, rays {expected}");
        }
        for d in directions(40) {
            let mut outline = Vec::new();
            let distance = 1e4 * body.radius();
            body.outline(body.centre + d * distance, &mut outline);
            let area = projected_solid_angle(&outline, DVec3::ZERO, -d) * distance * distance;
            assert!((area / body.projected_area(d) - 1.0).abs() < 1e-6, "{body:?} towards {d}: {area}");
            assert!(lambert_is_positive(&outline, -d), "{body:?} towards {d} runs the wrong way");
        }
    }
}

fn lambert_is_positive(outline: &[DVec3], up: DVec3) -> bool {
    (0..outline.len()).map(|i| outline[(i + 1) % outline.len()].cross(outline[i]).dot(up)).sum::<f64>() > 0.0
}

/// Points drawn for a direction lie on the surface, face it, and fill the outline evenly: bodies are their own mirror
/// images about their centre, so the mean is the centre as seen, within 5 σ of the points' own spread.
#[test]
fn points_fill_what_is_seen_evenly() {
    for body in bodies() {
        for (number, d) in directions(7).enumerate() {
            let (mut stream, count) = (Seed(5).stream(number as u64), 4000);
            let (mut mean, mut square) = (DVec3::ZERO, 0.0);
            for _ in 0..count {
                let (point, normal) = body.point_seen(d, &mut stream);
                assert!(normal.dot(d) > 0.0 && (normal.length() - 1.0).abs() < 1e-12);
                let p = body.canonical(point - body.centre);
                let off = match body.solid {
                    Solid::Box => p.abs().max_element(),
                    Solid::Cylinder => p.x.hypot(p.y).max(p.z.abs()),
                    Solid::Ellipsoid => p.length(),
                };
                assert!((off - 1.0).abs() < 0.02, "{body:?}: {point}");
                let flat = point - body.centre;
                let flat = flat - d * d.dot(flat);
                mean += flat / f64::from(count);
                square += flat.length_squared() / f64::from(count);
            }
            let bound = 5.0 * (square / f64::from(count)).sqrt();
            assert!(mean.length() < bound, "{body:?} towards {d}: off by {mean}, allowed {bound}");
        }
    }
}

/// A sheet through the middle of a body loses the section and keeps the rest, whatever the parts.
#[test]
fn a_sheet_keeps_what_is_outside() {
    for solid in [Solid::Box, Solid::Cylinder, Solid::Ellipsoid] {
        let body = Body { solid, centre: DVec3::ZERO, half_axes: [DVec3::X, DVec3::Y, DVec3::Z] };
        let sheet = [DVec3::new(-9.0, -9.0, 0.1), DVec3::new(9.0, -9.0, 0.1), DVec3::new(0.0, 9.0, 0.1)];
        let mut outside = 0.0;
        body.parts_outside(&sheet, |facet, part| {
            assert!(part.iter().all(|corner| body.facets().plane(usize::from(facet)).above(*corner) > -1e-9));
            let fan = (1..part.len() - 1).map(|i| (part[i] - part[0]).cross(part[i + 1] - part[0]).z / 2.0);
            outside += fan.sum::<f64>();
        });
        let section = match solid {
            Solid::Box => 4.0,
            Solid::Cylinder => PI,
            Solid::Ellipsoid => PI * (1.0 - 0.01),
        };
        let found = 162.0 - outside;
        assert!((found / section - 1.0).abs() < 0.02, "{solid:?}: section {found}, expected {section}");
        if solid != Solid::Ellipsoid {
            let aside = sheet.map(|corner| corner + DVec3::Z);
            let mut whole = Vec::new();
            body.parts_outside(&aside, |_, part| whole.push(part.to_vec()));
            assert_eq!(whole, [aside.to_vec()], "the upper end tells them apart");
        }
    }
}
