//! Outlines of luminous openings.

use glam::DVec3;

use super::Opening;

/// Polygons that bound an opening as seen from far away in direction `from`, local coordinates, m; none of a point.
pub(crate) fn corners(opening: &Opening, from: DVec3) -> Vec<Vec<DVec3>> {
    match opening {
        Opening::Point { .. } => Vec::new(),
        Opening::Rectangle { centre, half_width: w, half_depth: d } => {
            vec![vec![*centre - *w - *d, *centre + *w - *d, *centre + *w + *d, *centre - *w + *d]]
        }
        Opening::Disc { centre, aim, radius } => {
            let (x, y) = aim.any_orthonormal_pair();
            vec![rim(*centre, x * *radius, y * *radius)]
        }
        Opening::Ellipse { centre, half_width, half_depth } => vec![rim(*centre, *half_width, *half_depth)],
        Opening::Body(body) => {
            // As seen from so far that rays are parallel.
            let eye = body.centre + from * (1e7 * body.radius());
            let mut outline = Vec::new();
            body.outline(eye, &mut outline);
            vec![outline.into_iter().map(|corner| eye + corner).collect()]
        }
        Opening::Triangles(triangles) => triangles.iter().map(|corners| corners.to_vec()).collect(),
    }
}

/// An ellipse in 48 corners.
fn rim(centre: DVec3, half_width: DVec3, half_depth: DVec3) -> Vec<DVec3> {
    let corner = |(sin, cos): (f64, f64)| centre + half_width * cos + half_depth * sin;
    (0..48).map(|step| corner((std::f64::consts::TAU * f64::from(step) / 48.0).sin_cos())).collect()
}
