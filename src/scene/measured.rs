//! Surfaces of the mesh that are measured themselves, whatever their form: chosen by material or group, cut into
//! samples.

use std::collections::BTreeSet;
use std::ops::Range;

use glam::DVec3;

use super::fields::{Placed, closest};
use crate::error::{InputError, Location};
use crate::geometry::Mesh;
use crate::geometry::mesh::Bounds;
use crate::text::listed;
use crate::text::quoted;

/// Most samples of one surface: 1 GB while a run lasts.
const MOST_SAMPLES: usize = 1_000_000;
/// A side of a sample may be so many times as long as the spacing; its area is at most the spacing's square.
const LONGEST: f64 = 2.0;
/// Spacing as a part of the surface's largest extent, where the file gives none.
const DEFAULT_SHARE: f64 = 0.01;

/// Faces of the mesh where illuminance is asked for, cut into flat samples.
///
/// A triangle is halved across its longest side until no part is larger than the spacing allows; a smaller one is one
/// sample. A sample's normal is its triangle's: a curved surface is taken as the mesh has it.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredSurface {
    /// Its name, and its files'.
    pub name: String,
    /// Whether the side is measured from which the vertices run clockwise.
    pub back: bool,
    /// Side of the largest square that a sample stands for, m.
    pub spacing: f64,
    /// Samples of all triangles, those of one triangle together.
    pub samples: Vec<Sample>,
    /// Numbers of the mesh's triangles, ascending, whether each is measured from the other side than the rest, and the
    /// root of its tree.
    triangles: Vec<(u32, bool, u32)>,
    /// What a triangle or a part of it is cut into: each half is another node, or, with [`LEAF`], a sample.
    nodes: Vec<[u32; 2]>,
}

/// Marks a sample's number among nodes.
const LEAF: u32 = 1 << 31;

/// A flat piece of a measured surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Local, m, counter-clockwise seen from the measured side.
    pub corners: [DVec3; 3],
}

impl Sample {
    /// All of a triangle of the mesh, seen from its back or front.
    fn whole(triangle: u32, back: bool, mesh: &Mesh) -> Self {
        let [a, b, c] = mesh.corners(triangle as usize);
        Self { corners: if back { [a, c, b] } else { [a, b, c] } }
    }

    /// Where its illuminance is asked for, m.
    pub fn centre(&self) -> DVec3 {
        self.corners.iter().sum::<DVec3>() / 3.0
    }

    /// Area, m².
    pub fn area(&self) -> f64 {
        self.cross().length() / 2.0
    }

    /// Unit normal of the measured side.
    pub fn normal(&self) -> DVec3 {
        self.cross().normalize()
    }

    fn cross(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a)
    }

    /// Length of the longest side, and the corners from the one opposite to it on.
    fn longest(&self) -> (f64, [DVec3; 3]) {
        let from = |i: usize| [0, 1, 2].map(|step| self.corners[(i + step) % 3]);
        let length = |[_, p, q]: &[DVec3; 3]| p.distance(*q);
        let turned = [from(0), from(1), from(2)];
        // The first of equals, for a square's halves to be cut alike.
        let longest =
            turned.iter().fold(turned[0], |most, next| if length(next) > length(&most) { *next } else { most });
        (length(&longest), longest)
    }

    fn halves(&self) -> [Self; 2] {
        let (_, [apex, p, q]) = self.longest();
        let middle = (p + q) / 2.0;
        [Self { corners: [apex, p, middle] }, Self { corners: [apex, middle, q] }]
    }
}

impl MeasuredSurface {
    /// Cuts some triangles, each with whether it is measured from the other side than `back` says; `None` where that
    /// makes more than a million samples.
    fn new(name: String, back: bool, spacing: f64, triangles: &[(u32, bool)], mesh: &Mesh) -> Option<Self> {
        let mut surface = Self { name, back, spacing, samples: Vec::new(), triangles: Vec::new(), nodes: Vec::new() };
        for &(triangle, turned) in triangles {
            let whole = Sample::whole(triangle, back != turned, mesh);
            // No fewer than these, so that halving ends long before halves are all alike.
            let least = (whole.area() / spacing / spacing).max(whole.longest().0 / (LONGEST * spacing));
            if least.is_nan() || least > MOST_SAMPLES as f64 {
                return None;
            }
            let root = surface.cut(whole)?;
            surface.triangles.push((triangle, turned, root));
        }
        Some(surface)
    }

    fn cut(&mut self, piece: Sample) -> Option<u32> {
        let small = piece.longest().0 <= LONGEST * self.spacing * (1.0 + 1e-9)
            && piece.area() <= self.spacing * self.spacing * (1.0 + 1e-9);
        if small {
            self.samples.push(piece);
            return (self.samples.len() <= MOST_SAMPLES).then(|| (self.samples.len() as u32 - 1) | LEAF);
        }
        let node = self.nodes.len();
        self.nodes.push([0; 2]);
        let [first, second] = piece.halves();
        self.nodes[node] = [self.cut(first)?, self.cut(second)?];
        Some(node as u32)
    }

    /// The sample on which a point `at` (m) of the mesh's triangle number `triangle` lies; `None` if that is not part
    /// of the surface. Cost: O(log samples).
    pub fn sample_at(&self, triangle: u32, at: DVec3, mesh: &Mesh) -> Option<usize> {
        let (_, turned, mut node) = *self.of(triangle)?;
        let mut piece = Sample::whole(triangle, self.back != turned, mesh);
        while node & LEAF == 0 {
            let halves = piece.halves();
            let [apex, middle, _] = halves[1].corners;
            let in_second = (middle - apex).cross(at - apex).dot(piece.cross()) > 0.0;
            node = self.nodes[node as usize][usize::from(in_second)];
            piece = halves[usize::from(in_second)];
        }
        Some((node & !LEAF) as usize)
    }

    /// Whether light that flies along `direction` meets the measured side of a triangle of this number and normal.
    pub fn faces(&self, triangle: u32, normal: DVec3, direction: DVec3) -> bool {
        let meets = |&(_, turned, _): &(u32, bool, u32)| (normal.dot(direction) < 0.0) != (self.back != turned);
        self.of(triangle).is_some_and(meets)
    }

    /// A triangle of the mesh, if it is part of the surface.
    fn of(&self, triangle: u32) -> Option<&(u32, bool, u32)> {
        let (&(least, ..), &(most, ..)) = self.triangles.first().zip(self.triangles.last())?;
        if triangle < least || most < triangle {
            return None;
        }
        let index = self.triangles.binary_search_by_key(&triangle, |&(number, ..)| number).ok()?;
        Some(&self.triangles[index])
    }

    /// Area of all samples, m².
    pub fn area(&self) -> f64 {
        self.samples.iter().map(Sample::area).sum()
    }
}

/// A `[[surface]]`.
pub(crate) struct SurfaceSection {
    pub(crate) name: String,
    pub(crate) at: Location,
    pub(crate) material: Option<Placed<String>>,
    pub(crate) group: Option<Placed<String>>,
    pub(crate) back: bool,
    pub(crate) spacing: Option<Placed<f64>>,
}

/// Every group that some surface asks for.
pub(crate) fn groups_asked(sections: &[SurfaceSection]) -> BTreeSet<String> {
    sections.iter().filter_map(|section| Some(section.group.as_ref()?.value.clone())).collect()
}

/// Refuses a surface whose material or group no mesh has.
pub(crate) fn check_names(
    sections: &[SurfaceSection],
    materials: &BTreeSet<String>,
    groups: &BTreeSet<String>,
) -> Result<(), InputError> {
    let check = |kind: &str, name: &Option<Placed<String>>, known: &BTreeSet<String>| match name {
        Some(name) if !known.contains(&name.value) => {
            let found = format!("unknown {kind} {}", quoted(&name.value));
            let names = || known.iter().map(String::as_str);
            let expected = match known.is_empty() {
                true => format!("a [[mesh]] with a {kind} of that name"),
                false => format!("one that a mesh has: {}", listed(names())),
            };
            let error = InputError::new(name.at.clone(), found, expected);
            Err(match closest(&name.value, names()) {
                Some(near) => error.hint(format!("did you mean {}?", quoted(near))),
                None => error,
            })
        }
        _ => Ok(()),
    };
    sections.iter().try_for_each(|section| {
        check("material", &section.material, materials)?;
        check("group", &section.group, groups)
    })
}

impl SurfaceSection {
    /// The surface that `triangles` (ascending, each with whether it is measured from behind) of the mesh make.
    pub(crate) fn measured(&self, triangles: &[(u32, bool)], mesh: &Mesh) -> Result<MeasuredSurface, InputError> {
        let corners = triangles.iter().flat_map(|&(triangle, _)| mesh.corners(triangle as usize));
        let Some(bounds) = Bounds::around(corners) else {
            let found = format!("no face for surface {}", quoted(&self.name));
            return Err(InputError::new(self.at.clone(), found, "faces of that material and group, with an area"));
        };
        let spacing = self.spacing.as_ref().map_or(DEFAULT_SHARE * bounds.largest_extent(), |n| n.value);
        MeasuredSurface::new(self.name.clone(), self.back, spacing, triangles, mesh).ok_or_else(|| {
            let at = self.spacing.as_ref().map_or(&self.at, |n| &n.at);
            let found = format!(
                "more than {MOST_SAMPLES} samples for surface {}: {} triangles, spacing = {spacing}",
                quoted(&self.name),
                triangles.len(),
            );
            let error = InputError::new(at.clone(), found, format!("at most {MOST_SAMPLES}"));
            error.hint("a wider spacing, or a part of the mesh: a triangle is one sample at least")
        })
    }
}

/// Ranges of an OBJ file's triangles that belong to each of the groups asked for.
#[derive(Default)]
pub(crate) struct Groups {
    asked: BTreeSet<String>,
    /// Every name that `g` and `o` give, if any group is asked for.
    pub(crate) named: BTreeSet<String>,
    /// The names in force, of `g` and of `o`.
    current: [Vec<String>; 2],
    /// From which face on (counted from 0) which of the asked groups hold.
    changes: Vec<(usize, Vec<String>)>,
    /// Number of the first triangle of each change, once faces are triangles.
    starts: Vec<usize>,
}

impl Groups {
    /// Listens for the groups asked for, and for nothing where there is none.
    pub(crate) fn asking(asked: &BTreeSet<String>) -> Self {
        Self { asked: asked.clone(), ..Self::default() }
    }

    /// A line `g` (0) or `o` (1): `g a b` puts faces into both groups, and "a b" is a name too, as programs write
    /// blanks.
    pub(crate) fn line(&mut self, kind: usize, rest: &str, faces: usize) {
        if self.asked.is_empty() {
            return;
        }
        let words = rest.split_whitespace().map(str::to_owned);
        let mut names: Vec<String> = if kind == 0 { words.collect() } else { Vec::new() };
        if !names.iter().any(|name| name == rest) && !rest.is_empty() {
            names.push(rest.to_owned());
        }
        self.named.extend(names.iter().cloned());
        self.current[kind] = names;
        let all = self.current.iter().flatten().filter(|name| self.asked.contains(*name)).cloned().collect();
        if self.changes.last().is_none_or(|(_, before)| *before != all) {
            self.changes.push((faces, all));
        }
    }

    /// Face number `face` is about to become triangles, from number `triangle` on.
    pub(crate) fn face(&mut self, face: usize, triangle: usize) {
        while self.changes.get(self.starts.len()).is_some_and(|(start, _)| *start <= face) {
            self.starts.push(triangle);
        }
    }

    /// Ranges of triangles, of `count` in all, that belong to a group.
    pub(crate) fn ranges(&self, group: &str, count: usize) -> Vec<Range<usize>> {
        let end = |change: usize| self.starts.get(change + 1).copied().unwrap_or(count);
        let holds = |change: &usize| self.changes[*change].1.iter().any(|name| name == group);
        (0..self.starts.len()).filter(holds).map(|change| self.starts[change]..end(change)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh() -> Mesh {
        Mesh {
            vertices: vec![[0.0, 0.0, 0.0], [3.0, 0.1, 0.0], [0.2, 0.5, 1.0], [9.0, 0.0, 0.0], [9.0, 0.01, 0.0]],
            triangles: vec![[0, 1, 2], [0, 3, 4]],
            material_of: vec![0, 0],
        }
    }

    /// Halves keep area, plane and orientation, and none is larger than asked; slivers are cut across their length.
    #[test]
    fn samples_tile_their_triangles_and_none_is_too_large() {
        let mesh = mesh();
        for back in [false, true] {
            let surface =
                MeasuredSurface::new("s".into(), back, 0.1, &[(0, false), (1, false)], &mesh).expect("few samples");
            let whole: f64 = (0..2).map(|t| Sample { corners: mesh.corners(t) }.area()).sum();
            assert!((surface.area() / whole - 1.0).abs() < 1e-12);
            let normals = [0, 1].map(|t| Sample { corners: mesh.corners(t) }.normal() * if back { -1.0 } else { 1.0 });
            for sample in &surface.samples {
                assert!(sample.area() <= 0.01 * 1.001 && sample.longest().0 <= 0.2 * 1.001, "{sample:?}");
                assert!(normals.iter().any(|normal| normal.distance(sample.normal()) < 1e-9));
            }
        }
    }

    /// The sample found at a sample's centre is that sample, and its triangle's tree knows no other triangle.
    #[test]
    fn a_point_is_found_in_its_sample() {
        let mesh = mesh();
        let surface =
            MeasuredSurface::new("s".into(), true, 0.07, &[(0, false), (1, false)], &mesh).expect("few samples");
        let of_first = surface.triangles[1].2;
        assert!(of_first > 0 && surface.samples.len() > 100);
        for (index, sample) in surface.samples.iter().enumerate() {
            let triangle = u32::from(sample.normal().distance(surface.samples[0].normal()) > 1e-6);
            assert_eq!(surface.sample_at(triangle, sample.centre(), &mesh), Some(index));
        }
        assert_eq!(surface.sample_at(2, DVec3::ZERO, &mesh), None);
    }

    #[test]
    fn too_many_samples_are_noticed_before_memory_ends() {
        assert!(MeasuredSurface::new("s".into(), false, 1e-5, &[(0, false)], &mesh()).is_none());
    }

    #[test]
    fn groups_hold_until_the_next_line_of_their_kind() {
        let mut groups = Groups::asking(&["a", "b", "long name"].map(String::from).into());
        groups.line(1, "long name", 0);
        groups.line(0, "a b", 1);
        groups.line(0, "c", 3);
        // Face 1 is a quadrangle.
        for (face, triangle) in [(0, 0), (1, 1), (2, 3), (3, 4)] {
            groups.face(face, triangle);
        }
        for name in ["a", "b"] {
            let ranges = groups.ranges(name, 5);
            assert_eq!((ranges.len(), ranges[0].clone()), (1, 1..4));
        }
        assert_eq!(groups.ranges("long name", 5).iter().map(Range::len).sum::<usize>(), 5);
        assert!(groups.named.contains("c"));
    }
}
