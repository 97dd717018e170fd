//! Shadows that are cut out exactly, against closed forms.

use super::*;

/// A sheet's edge runs past the point's zenith, so half of an opening above it is hidden; all numbers are exact in
/// single precision, so only the arithmetic's rounding is left.
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

/// A partition that stands on the point's plane, even one 0.1 mm from the point, or that hangs from the opening's plane
/// or joins the two: light passes above its edge, at x = distance · 2/height, and nowhere else.
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
    // A point in the partition is moved to one side of it, by 2e-6 of the mesh's 99 m, and sees that half of the
    // opening: its light changes by less than that over a quarter of the distance.
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

/// On the axis of a disc E = π L r²/(r² + h²), and a sheet whose edge runs past the zenith leaves half of it. The
/// 96-gon of equal area is off by 1e-6 at h = r, less farther away.
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

/// Blocks and parts must find the same as each point alone: a grid over a table, four legs and a box, cell by cell.
/// With one cell there is no block to speak of.
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
