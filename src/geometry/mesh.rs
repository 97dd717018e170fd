//! Triangle meshes, and how they are set up in the world.

use glam::DVec3;
use rayon::prelude::*;

use crate::geometry::sin_cos_degrees;

/// Triangles that share vertices.
///
/// [`RayCaster`](crate::embree::RayCaster) shares the mesh and reads all of it in place; only where `vertices` has no
/// room for one more (its capacity is its length) it needs a copy of them.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Local positions, m.
    pub vertices: Vec<[f32; 3]>,
    /// Vertex indices of each triangle, counter-clockwise seen from its front.
    pub triangles: Vec<[u32; 3]>,
    /// Material of each triangle.
    pub material_of: Vec<u32>,
}

impl Mesh {
    /// Corners of triangle `index`, local, m.
    pub fn corners(&self, index: usize) -> [DVec3; 3] {
        self.triangles[index].map(|vertex| DVec3::from(self.vertices[vertex as usize].map(f64::from)))
    }
}

/// How an OBJ file's coordinates become world coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    pub(crate) metres_per_unit: f64,
    /// The file's y points up, and its −z to the world's y.
    pub(crate) y_up: bool,
    /// Degrees about the file's own origin, after `y_up`.
    pub(crate) rotate_z: f64,
    /// Last of all, m.
    pub(crate) translate: DVec3,
}

impl Placement {
    /// A function, so that the sine is taken once and not for each vertex.
    pub(crate) fn transform(self) -> impl Fn(DVec3) -> DVec3 {
        let (sin, cos) = sin_cos_degrees(self.rotate_z);
        move |p| {
            let p = if self.y_up { DVec3::new(p.x, -p.z, p.y) } else { p } * self.metres_per_unit;
            DVec3::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y, p.z) + self.translate
        }
    }
}

/// A box along the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) least: DVec3,
    pub(crate) most: DVec3,
}

impl Bounds {
    /// The smallest box around `points`; `None` around nothing.
    pub(crate) fn around(points: impl IntoIterator<Item = DVec3>) -> Option<Self> {
        points.into_iter().fold(None, |bounds: Option<Self>, p| match bounds {
            None => Some(Self { least: p, most: p }),
            Some(Self { least, most }) => Some(Self { least: least.min(p), most: most.max(p) }),
        })
    }

    /// The smallest box around many points. The same bits for any number of threads: minimum and maximum don't round.
    pub(crate) fn around_all(points: &[DVec3]) -> Option<Self> {
        points.par_chunks(1 << 16).map(|points| Self::around(points.iter().copied())).reduce(|| None, Self::joined)
    }

    /// The smallest box around both.
    pub(crate) fn joined(one: Option<Self>, other: Option<Self>) -> Option<Self> {
        match (one, other) {
            (Some(one), Some(other)) => {
                Some(Self { least: one.least.min(other.least), most: one.most.max(other.most) })
            }
            (one, other) => one.or(other),
        }
    }

    pub(crate) fn centre(&self) -> DVec3 {
        self.least + (self.most - self.least) / 2.0
    }

    pub(crate) fn largest_extent(&self) -> f64 {
        (self.most - self.least).max_element()
    }

    pub(crate) fn diagonal(&self) -> f64 {
        (self.most - self.least).length()
    }

    /// Whether the two boxes share a point, give or take `slack` (m).
    pub(crate) fn meets(&self, other: &Self, slack: f64) -> bool {
        let slack = DVec3::splat(slack);
        (self.least - slack).cmple(other.most).all() && (self.most + slack).cmpge(other.least).all()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Placement = Placement { metres_per_unit: 1.0, y_up: false, rotate_z: 0.0, translate: DVec3::ZERO };

    #[test]
    fn feet_become_metres_before_the_translation() {
        let placement = Placement { metres_per_unit: 0.3048, translate: DVec3::X, ..PLAIN };
        assert_eq!(placement.transform()(DVec3::splat(10.0)), DVec3::new(4.048, 3.048, 3.048));
    }

    #[test]
    fn y_up_turns_the_file_upright_without_mirroring_it() {
        let place = Placement { y_up: true, ..PLAIN }.transform();
        assert_eq!(place(DVec3::Y), DVec3::Z);
        assert_eq!(place(DVec3::X).cross(place(DVec3::Y)), place(DVec3::Z));
    }

    #[test]
    fn a_quarter_turn_is_exact_and_comes_before_the_translation() {
        let placement = Placement { rotate_z: 90.0, translate: DVec3::new(100.0, 0.0, 0.0), ..PLAIN };
        assert_eq!(placement.transform()(DVec3::X), DVec3::new(100.0, 1.0, 0.0));
    }
}
