//! Polygons into triangles.

use glam::{DVec2, DVec3};

/// Triangles of a flat polygon as corner numbers, in the polygon's own sense of rotation.
///
/// A triangle stays as it is, a convex polygon becomes a fan, any other loses its ears one after another (Meisters
/// 1975): corners whose triangle holds no other corner. A polygon that crosses itself has no such end; what is left of
/// it then becomes a fan. Slightly bent polygons are cut as they look along their mean normal. Cost: O(n) if convex,
/// O(n²) if not.
pub(crate) fn triangles_of(corners: &[DVec3]) -> Vec<[usize; 3]> {
    match corners.len() {
        0..=2 => Vec::new(),
        3 => vec![[0, 1, 2]],
        n => {
            let flat = flattened(corners);
            let turns = |i: usize| turn(flat[(i + n - 1) % n], flat[i], flat[(i + 1) % n]);
            let all = if (0..n).all(|i| turns(i) >= 0.0) { fan(&(0..n).collect::<Vec<_>>()) } else { clip_ears(&flat) };
            // Corners amid an edge leave triangles without area; they are no fault of the polygon's.
            let real: Vec<_> = all.iter().copied().filter(|triangle| has_area(triangle.map(|i| corners[i]))).collect();
            if real.is_empty() { all } else { real }
        }
    }
}

/// Whether a triangle is more than a point or a line: its height is above 1e-12 of its longest side.
pub(crate) fn has_area([a, b, c]: [DVec3; 3]) -> bool {
    let longest_squared = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    (b - a).cross(c - a).length() > 1e-12 * longest_squared
}

/// The polygon seen against its normal (Newell's, which counts every corner), so that it runs counter-clockwise.
fn flattened(corners: &[DVec3]) -> Vec<DVec2> {
    let next = |i: usize| corners[(i + 1) % corners.len()];
    let normal: DVec3 = (0..corners.len()).map(|i| (corners[i] - corners[0]).cross(next(i) - corners[0])).sum();
    let normal = normal.try_normalize().unwrap_or(DVec3::Z);
    let (u, v) = normal.any_orthonormal_pair();
    corners.iter().map(|&corner| DVec2::new((corner - corners[0]).dot(u), (corner - corners[0]).dot(v))).collect()
}

/// Twice the area of the triangle; positive if it runs counter-clockwise.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

fn fan(corners: &[usize]) -> Vec<[usize; 3]> {
    corners.windows(2).skip(1).map(|pair| [corners[0], pair[0], pair[1]]).collect()
}

fn clip_ears(flat: &[DVec2]) -> Vec<[usize; 3]> {
    let mut left: Vec<usize> = (0..flat.len()).collect();
    let mut is_left = vec![true; flat.len()];
    let mut doubts: Vec<Option<Doubt>> = vec![None; flat.len()];
    let mut triangles = Vec::with_capacity(flat.len() - 2);
    // Go round, cutting each ear met; after a whole round without one there is none.
    let (mut i, mut without) = (0, 0);
    while left.len() > 3 && without < left.len() {
        let n = left.len();
        i %= n;
        let ear = [left[(i + n - 1) % n], left[i], left[(i + 1) % n]];
        let known = doubts[ear[1]].filter(|doubt| doubt.beside == [ear[0], ear[2]]).map_or(0, |doubt| doubt.inside);
        match corner_inside(flat, &is_left, ear, known) {
            None => {
                triangles.push(ear);
                is_left[ear[1]] = false;
                left.remove(i);
                without = 0;
            }
            Some(inside) => {
                doubts[ear[1]] = Some(Doubt { beside: [ear[0], ear[2]], inside });
                i += 1;
                without += 1;
            }
        }
    }
    triangles.extend(fan(&left));
    triangles
}

/// Why a corner is no ear between two others: the first corner that its triangle holds. Kept, so that no corner is
/// looked at twice for one triangle, and even the worst polygon takes time by the square of its corners.
#[derive(Clone, Copy)]
struct Doubt {
    beside: [usize; 2],
    inside: usize,
}

/// The first corner from `from` on that keeps `ear` from being one; its number of corners where it turns the wrong way.
fn corner_inside(flat: &[DVec2], is_left: &[bool], ear: [usize; 3], from: usize) -> Option<usize> {
    let [a, b, c] = ear.map(|corner| flat[corner]);
    if from == flat.len() || turn(a, b, c) < 0.0 {
        return Some(flat.len());
    }
    let holds = |p: DVec2| {
        // A corner may be named twice, where a slit joins a hole to the outline.
        p != a && p != b && p != c && turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0
    };
    (from..flat.len()).find(|&corner| is_left[corner] && holds(flat[corner]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[DVec3]) -> f64 {
        let area = |[a, b, c]: [usize; 3]| (corners[b] - corners[a]).cross(corners[c] - corners[a]).length() / 2.0;
        triangles_of(corners).into_iter().map(area).sum()
    }

    fn outline(points: &[[f64; 2]]) -> Vec<DVec3> {
        points.iter().map(|&[x, y]| DVec3::new(x, y, 0.3 * x - 0.2 * y)).collect()
    }

    /// How much larger the tilted outline is than its view from above.
    const TILT: f64 = 1.063_014_581_273_465; // √(1 + 0.3² + 0.2²)

    #[test]
    fn an_l_keeps_its_area_from_whichever_corner_and_side_it_starts() {
        let l = [[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]];
        for start in 0..6 {
            let mut points = l;
            points.rotate_left(start);
            assert!((area(&outline(&points)) - 6.0 * TILT).abs() < 1e-12, "from corner {start}");
            points.reverse();
            assert!((area(&outline(&points)) - 6.0 * TILT).abs() < 1e-12, "reversed, from corner {start}");
        }
    }

    #[test]
    fn a_wall_with_a_window_joined_by_a_slit_keeps_its_area() {
        let wall = [
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 3.0],
            [0.0, 3.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 2.0],
            [2.0, 2.0],
            [2.0, 1.0],
            [1.0, 1.0],
        ];
        assert!((area(&outline(&wall)) - 11.0 * TILT).abs() < 1e-12, "{}", area(&outline(&wall)));
    }

    #[test]
    fn a_comb_of_many_teeth_keeps_its_area() {
        let teeth = (0..500).flat_map(|i| {
            let x = f64::from(i);
            [[x, 1.0], [x, 3.0], [x + 0.5, 3.0], [x + 0.5, 1.0]]
        });
        let mut points: Vec<[f64; 2]> = [[500.0, 0.0], [0.0, 0.0]].into_iter().chain(teeth).collect();
        points.push([500.0, 1.0]);
        assert!((area(&outline(&points)) / (1000.0 * TILT) - 1.0).abs() < 1e-12, "{}", area(&outline(&points)));
    }

    #[test]
    fn triangles_turn_as_their_polygon_does() {
        let l = outline(&[[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]]);
        assert!(triangles_of(&l).iter().all(|&[a, b, c]| (l[b] - l[a]).cross(l[c] - l[a]).z > 0.0));
    }

    #[test]
    fn every_polygon_ends_even_one_that_crosses_itself_or_is_a_point() {
        let bow = outline(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0], [0.5, 2.0]]);
        assert!(!triangles_of(&bow).is_empty());
        assert_eq!(triangles_of(&[DVec3::ONE; 9]).len(), 7);
        assert!(triangles_of(&[DVec3::ONE; 2]).is_empty());
    }
}
