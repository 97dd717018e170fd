//! Connected faces of one glass: closed bodies, slabs, sheets.

use std::collections::HashMap;

use glam::DVec3;

use crate::sets::Sets;

/// A slab is no thicker than this part of its side, the root of its area, …
const THINNEST: f64 = 1.0 / 20.0;
/// … and than this, m.
const THICKEST: f64 = 0.1;
/// What is not one of a slab's two faces, as a part of both.
const MOST_RIM: f64 = 0.25;
/// Cosine between normals that count as parallel (0.8°).
const PARALLEL: f64 = 0.9999;
/// Faces of a slab have areas and middles that differ by no more than this part of the area, or side.
const ALIKE: f64 = 0.05;
/// How far corners of one flat face may lie off its plane, as a part of its side.
const FLAT: f64 = 1e-4;
/// Open edges whose length squared is a smaller part of the area than this are a hole in a body, not the rim of a
/// sheet: a disc has 4π, half a sphere 2π.
const HOLE: f64 = 1.0;

/// What connected faces of one glass are.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum PartKind {
    /// A closed body, its normals outwards.
    Solid,
    /// A closed body whose faces were turned to look outwards.
    Turned,
    /// A pane: the triangles kept of it, moved by `shift` (m); and the thickness of the slab that it was, m.
    Pane { kept: Vec<u32>, shift: DVec3, thickness: Option<f64> },
    /// Neither; why not, in words, and a place on it.
    Refused(&'static str, DVec3),
}

/// Connected faces.
#[derive(Clone, Debug)]
pub(crate) struct GlassPart {
    /// Numbers of its triangles.
    pub(crate) triangles: Vec<u32>,
    pub(crate) kind: PartKind,
}

/// Sorts out the faces of one glass: `chosen` are their numbers among `triangles`, which are turned where a body is
/// inside out.
pub(crate) fn parts(vertices: &[DVec3], triangles: &mut [[u32; 3]], chosen: &[u32]) -> Vec<GlassPart> {
    let welded = weld(vertices, triangles, chosen);
    let mut found: Vec<GlassPart> = Vec::new();
    let mut open: Vec<FlatFace> = Vec::new();
    let mut closed: Vec<ClosedBody> = Vec::new();
    for component in components(&welded) {
        let numbers: Vec<u32> = component.iter().map(|&face| welded[face].number).collect();
        let corners = |&number: &u32| triangles[number as usize].map(|corner| vertices[corner as usize]);
        let all: Vec<[DVec3; 3]> = numbers.iter().map(corners).collect();
        let refused = |why| PartKind::Refused(why, all[0].iter().sum::<DVec3>() / 3.0);
        match orient(vertices, &welded, &component) {
            Winding::Open { length } => {
                let area: f64 = all.iter().map(|&corners| doubled_area(corners).length() / 2.0).sum();
                if length * length < HOLE * area {
                    found.push(GlassPart { triangles: numbers, kind: refused("a body with a hole") });
                } else {
                    open.push(FlatFace::of(&numbers, &all));
                }
            }
            Winding::Tangled => {
                found.push(GlassPart { triangles: numbers, kind: refused("faces without a common winding") })
            }
            Winding::Closed { flipped } => {
                flipped.iter().for_each(|&face| triangles[welded[face].number as usize].swap(1, 2));
                closed.push(ClosedBody::new(vertices, triangles, numbers, !flipped.is_empty()));
            }
        }
    }
    outwards(vertices, triangles, &mut closed);
    for ClosedBody { triangles: numbers, turned, .. } in closed {
        let corners = |&number: &u32| triangles[number as usize].map(|corner| vertices[corner as usize]);
        let corners: Vec<[DVec3; 3]> = numbers.iter().map(corners).collect();
        let solid = if turned { PartKind::Turned } else { PartKind::Solid };
        let kind = slab(&numbers, &corners).unwrap_or(solid);
        found.push(GlassPart { triangles: numbers, kind });
    }
    found.extend(sheets(&open));
    found
}

/// A triangle between welded corners.
struct WeldedTriangle {
    number: u32,
    corners: [u32; 3],
}

/// Corners at the same place get the same number: that of the first vertex there. Triangles that have no three places
/// are left out.
fn weld(vertices: &[DVec3], triangles: &[[u32; 3]], chosen: &[u32]) -> Vec<WeldedTriangle> {
    let mut first: HashMap<[u64; 3], u32> = HashMap::new();
    let mut place = |corner: u32| {
        let key = vertices[corner as usize].to_array().map(|x| (x + 0.0).to_bits()); // −0 is 0
        *first.entry(key).or_insert(corner)
    };
    let weld = |&number: &u32| WeldedTriangle { number, corners: triangles[number as usize].map(&mut place) };
    let distinct = |&WeldedTriangle { corners: [a, b, c], .. }: &WeldedTriangle| a != b && b != c && c != a;
    chosen.iter().map(weld).filter(distinct).collect()
}

/// Uses of an edge by faces: (face, whether it runs from the smaller to the larger corner).
type Edges = HashMap<[u32; 2], Vec<(usize, bool)>>;

fn edges<'a>(faces: impl Iterator<Item = (usize, &'a WeldedTriangle)>) -> Edges {
    let mut edges: Edges = HashMap::new();
    for (face, welded) in faces {
        for i in 0..3 {
            let (from, to) = (welded.corners[i], welded.corners[(i + 1) % 3]);
            edges.entry([from.min(to), from.max(to)]).or_default().push((face, from < to));
        }
    }
    edges
}

/// Faces that hang together by edges which two of them share; in the order of their first faces. Bodies that touch
/// along an edge, which then has four uses, stay apart.
fn components(welded: &[WeldedTriangle]) -> Vec<Vec<usize>> {
    let mut sets = Sets::new(welded.len());
    for uses in edges(welded.iter().enumerate()).values() {
        if let [(a, _), (b, _)] = uses[..] {
            sets.join(a as u32, b as u32);
        }
    }
    let mut number: HashMap<u32, usize> = HashMap::new();
    let mut found: Vec<Vec<usize>> = Vec::new();
    for face in 0..welded.len() {
        let root = sets.root(face as u32);
        let at = *number.entry(root).or_insert_with(|| {
            found.push(Vec::new());
            found.len() - 1
        });
        found[at].push(face);
    }
    found
}

/// What the edges of connected faces show.
enum Winding {
    /// Some edges are used an odd number of times: their length, m.
    Open { length: f64 },
    /// Every edge is used as often one way as the other, after these faces are flipped.
    Closed { flipped: Vec<usize> },
    /// Closed, but no flipping makes it so.
    Tangled,
}

fn orient(vertices: &[DVec3], welded: &[WeldedTriangle], component: &[usize]) -> Winding {
    let edges = edges(component.iter().map(|&face| (face, &welded[face])));
    let open = edges.iter().filter(|(_, uses)| uses.len() % 2 == 1);
    let length: f64 = open.map(|(edge, _)| vertices[edge[0] as usize].distance(vertices[edge[1] as usize])).sum();
    if length > 0.0 {
        return Winding::Open { length };
    }
    let balanced = |uses: &[(usize, bool)], flip: &dyn Fn(usize) -> bool| {
        2 * uses.iter().filter(|&&(face, forward)| forward != flip(face)).count() == uses.len()
    };
    if edges.values().all(|uses| balanced(uses, &|_| false)) {
        return Winding::Closed { flipped: Vec::new() };
    }
    // Walk from face to face over edges that two share, so that each edge is run both ways.
    let mut flip: HashMap<usize, bool> = HashMap::from([(component[0], false)]);
    let mut open = vec![component[0]];
    while let Some(face) = open.pop() {
        let turned = flip[&face];
        for i in 0..3 {
            let (from, to) = (welded[face].corners[i], welded[face].corners[(i + 1) % 3]);
            let uses = &edges[&[from.min(to), from.max(to)]];
            let [(a, a_forward), (b, b_forward)] = uses[..] else { continue };
            let other = if a == face { b } else { a };
            flip.entry(other).or_insert_with(|| {
                open.push(other);
                turned != (a_forward == b_forward)
            });
        }
    }
    let flips = |face: usize| flip.get(&face).copied().unwrap_or(false);
    if !edges.values().all(|uses| balanced(uses, &flips)) {
        return Winding::Tangled;
    }
    Winding::Closed { flipped: component.iter().copied().filter(|&face| flips(face)).collect() }
}

/// A closed body.
struct ClosedBody {
    triangles: Vec<u32>,
    turned: bool,
    /// Positive where normals point outwards, m³.
    volume: f64,
    bounds: [DVec3; 2],
}

impl ClosedBody {
    fn new(vertices: &[DVec3], all: &[[u32; 3]], triangles: Vec<u32>, turned: bool) -> Self {
        let corners = |&number: &u32| all[number as usize].map(|corner| vertices[corner as usize]);
        let low = triangles.iter().flat_map(corners).fold(DVec3::INFINITY, DVec3::min);
        let high = triangles.iter().flat_map(corners).fold(DVec3::NEG_INFINITY, DVec3::max);
        let of = |[a, b, c]: [DVec3; 3]| (a - low).dot((b - low).cross(c - low)) / 6.0;
        let volume = triangles.iter().map(corners).map(of).sum();
        Self { triangles, turned, volume, bounds: [low, high] }
    }
}

/// Turns bodies that are inside out, cavities aside.
fn outwards(vertices: &[DVec3], triangles: &mut [[u32; 3]], bodies: &mut [ClosedBody]) {
    let place = |corner: u32| vertices[corner as usize];
    let inside_out: Vec<usize> = (0..bodies.len()).filter(|&body| bodies[body].volume < 0.0).collect();
    for body in inside_out {
        let [low, high] = bodies[body].bounds;
        let point = triangles[bodies[body].triangles[0] as usize].map(place).iter().sum::<DVec3>() / 3.0;
        let holds = |other: &ClosedBody| {
            let [outer_low, outer_high] = other.bounds;
            let around = outer_low.cmple(low).all() && outer_high.cmpge(high).all();
            let corners = other.triangles.iter().map(|&number| triangles[number as usize].map(place));
            around && winding_number(point, corners).abs() > 0.5
        };
        let holders = bodies.iter().enumerate().filter(|(other, outer)| *other != body && holds(outer)).count();
        if holders % 2 == 0 {
            bodies[body].triangles.iter().for_each(|&number| triangles[number as usize].swap(1, 2));
            bodies[body].turned = true;
        }
    }
}

/// How often a surface winds about a point: the solid angles of its triangles (Van Oosterom & Strackee 1983) over 4π.
fn winding_number(point: DVec3, triangles: impl Iterator<Item = [DVec3; 3]>) -> f64 {
    let angle = |corners: [DVec3; 3]| {
        let [a, b, c] = corners.map(|corner| corner - point);
        let [x, y, z] = [a.length(), b.length(), c.length()];
        let below = x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y;
        2.0 * a.dot(b.cross(c)).atan2(below)
    };
    triangles.map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

/// Twice the area of a triangle, along its normal.
fn doubled_area([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// The longest of some vectors; of equal ones the first.
fn largest(vectors: impl Iterator<Item = DVec3>) -> DVec3 {
    vectors
        .reduce(|most, one| if one.length_squared() > most.length_squared() { one } else { most })
        .unwrap_or_default()
}

/// Faces in one plane, or, where they are not, of no direction.
struct FlatFace {
    triangles: Vec<u32>,
    area: f64,
    middle: DVec3,
    /// Unit normal, where the face is flat.
    normal: Option<DVec3>,
}

impl FlatFace {
    fn of(numbers: &[u32], corners: &[[DVec3; 3]]) -> Self {
        let doubled = || corners.iter().map(|&corners| doubled_area(corners));
        let area = doubled().map(DVec3::length).sum::<f64>() / 2.0;
        let weighted =
            |&corners: &[DVec3; 3]| corners.iter().sum::<DVec3>() / 3.0 * doubled_area(corners).length() / 2.0;
        let middle = corners.iter().map(weighted).sum::<DVec3>() / area;
        let normal = largest(doubled()).try_normalize();
        let off = FLAT * area.sqrt();
        let is_flat =
            |normal: &DVec3| corners.iter().flatten().all(|&corner| (corner - middle).dot(*normal).abs() <= off);
        Self { triangles: numbers.to_vec(), area, middle, normal: normal.filter(is_flat) }
    }

    /// Thickness of the slab whose opposite face the other is.
    fn thickness_to(&self, other: &Self) -> Option<f64> {
        let (normal, facing) = (self.normal?, other.normal?);
        let apart = other.middle - self.middle;
        let thickness = apart.dot(normal).abs();
        let aside = (apart - normal * apart.dot(normal)).length();
        let (area, side) = (self.area, self.area.sqrt());
        let alike = (other.area - area).abs() <= ALIKE * area && aside <= ALIKE * side;
        let opposite = normal.dot(facing) <= -PARALLEL;
        (opposite && alike && is_thin(thickness, side)).then_some(thickness)
    }

    /// Whether the other is the same face drawn again.
    fn coincides(&self, other: &Self) -> bool {
        let off = FLAT * self.area.sqrt();
        self.normal.is_some() && other.normal.is_some() && self.middle.distance(other.middle) <= off
    }
}

fn is_thin(thickness: f64, side: f64) -> bool {
    thickness > FLAT * side && thickness <= THICKEST && thickness <= THINNEST * side
}

/// The pane that a closed body is, if it is a thin flat slab.
fn slab(numbers: &[u32], corners: &[[DVec3; 3]]) -> Option<PartKind> {
    let normals: Vec<DVec3> = corners.iter().map(|&corners| doubled_area(corners)).collect();
    let normal = largest(normals.iter().copied()).try_normalize()?;
    let side = |sign: f64| {
        let chosen: Vec<usize> =
            (0..normals.len()).filter(|&i| normals[i].normalize_or_zero().dot(normal) * sign > PARALLEL).collect();
        let of = |i: &usize| corners[*i];
        let all: Vec<[DVec3; 3]> = chosen.iter().map(of).collect();
        FlatFace::of(&chosen.iter().map(|&i| numbers[i]).collect::<Vec<_>>(), &all)
    };
    let (front, back) = (side(1.0), side(-1.0));
    let thickness = front.thickness_to(&back).or_else(|| front.coincides(&back).then_some(0.0))?;
    let whole: f64 = normals.iter().map(|normal| normal.length() / 2.0).sum();
    let rim = whole - front.area - back.area;
    let shift = -normal * thickness / 2.0;
    let thickness = (thickness > 0.0).then_some(thickness);
    (rim <= MOST_RIM * (front.area + back.area)).then_some(PartKind::Pane { kept: front.triangles, shift, thickness })
}

/// Panes that open sheets are: opposite faces of a slab make one.
fn sheets(open: &[FlatFace]) -> Vec<GlassPart> {
    let mut taken = vec![false; open.len()];
    let mut found = Vec::new();
    for (i, face) in open.iter().enumerate() {
        if taken[i] {
            continue;
        }
        let partner = (i + 1..open.len()).filter(|&j| !taken[j]).find_map(|j| Some((j, face.thickness_to(&open[j])?)));
        let kept = face.triangles.clone();
        let mut triangles = kept.clone();
        let kind = match partner {
            Some((j, thickness)) => {
                taken[j] = true;
                triangles.extend(&open[j].triangles);
                let towards = (open[j].middle - face.middle) / 2.0;
                let normal = face.normal.unwrap_or_default();
                PartKind::Pane { kept, shift: normal * towards.dot(normal), thickness: Some(thickness) }
            }
            None => PartKind::Pane { kept, shift: DVec3::ZERO, thickness: None },
        };
        found.push(GlassPart { triangles, kind });
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Corners and faces of a box, counter-clockwise seen from outside, two triangles a face.
    fn box_of(low: [f64; 3], high: [f64; 3]) -> Vec<[DVec3; 3]> {
        let corner =
            |i: usize| DVec3::from([0, 1, 2].map(|axis| if i >> axis & 1 == 0 { low[axis] } else { high[axis] }));
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).map(|face| face.map(corner)).collect()
    }

    fn turned(mut faces: Vec<[DVec3; 3]>) -> Vec<[DVec3; 3]> {
        faces.iter_mut().for_each(|face| face.swap(0, 1));
        faces
    }

    /// What the faces are, each triangle with vertices of its own, and the triangles afterwards.
    fn parts_of(faces: &[[DVec3; 3]]) -> (Vec<GlassPart>, Vec<[DVec3; 3]>) {
        let vertices: Vec<DVec3> = faces.as_flattened().to_vec();
        let mut triangles: Vec<[u32; 3]> = (0..faces.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let chosen: Vec<u32> = (0..faces.len() as u32).collect();
        let found = parts(&vertices, &mut triangles, &chosen);
        (found, triangles.iter().map(|triangle| triangle.map(|corner| vertices[corner as usize])).collect())
    }

    fn kinds(faces: &[[DVec3; 3]]) -> Vec<PartKind> {
        parts_of(faces).0.into_iter().map(|part| part.kind).collect()
    }

    fn volume(faces: &[[DVec3; 3]]) -> f64 {
        faces.iter().map(|[a, b, c]| a.dot(b.cross(*c)) / 6.0).sum()
    }

    #[test]
    fn a_closed_body_is_a_solid_and_looks_outwards() {
        let cube = box_of([1.0; 3], [2.0; 3]);
        assert_eq!(kinds(&cube), [PartKind::Solid]);
        let (parts, faces) = parts_of(&turned(cube.clone()));
        assert_eq!(parts[0].kind, PartKind::Turned);
        assert!((volume(&faces) - 1.0).abs() < 1e-12);
        // Faces of either winding: three of twelve the wrong way.
        let mut mixed = cube;
        [1, 4, 9].iter().for_each(|&face: &usize| mixed[face].swap(0, 1));
        let (parts, faces) = parts_of(&mixed);
        assert_eq!(parts[0].kind, PartKind::Turned);
        assert!((volume(&faces) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_cavity_stays_and_bodies_that_touch_along_an_edge_are_two() {
        let outer = box_of([0.0; 3], [3.0; 3]);
        let hollow = [outer.clone(), turned(box_of([1.0; 3], [2.0; 3]))].concat();
        let (parts, faces) = parts_of(&hollow);
        assert!(parts.iter().all(|part| part.kind == PartKind::Solid));
        assert!((volume(&faces) - 26.0).abs() < 1e-12);
        let beside = box_of([3.0, 3.0, 0.0], [5.0, 5.0, 3.0]);
        assert_eq!(kinds(&[outer, beside].concat()), [PartKind::Solid, PartKind::Solid]);
    }

    #[test]
    fn a_thin_slab_is_a_pane_in_its_middle_whatever_its_winding() {
        let slab = box_of([0.0; 3], [2.0, 1.5, 0.01]);
        for faces in [slab.clone(), turned(slab)] {
            let (parts, triangles) = parts_of(&faces);
            let [GlassPart { triangles: all, kind: PartKind::Pane { kept, shift, thickness } }] = &parts[..] else {
                panic!("{parts:?}")
            };
            assert_eq!((all.len(), kept.len()), (12, 2));
            assert!((thickness.unwrap() - 0.01).abs() < 1e-12);
            let middle = kept.iter().flat_map(|&face| triangles[face as usize]).map(|corner| corner.z + shift.z);
            middle.for_each(|z| assert!((z - 0.005).abs() < 1e-12));
        }
        // An aquarium's wall is no window: 15 cm of glass; nor is a cube.
        assert_eq!(kinds(&box_of([0.0; 3], [4.0, 4.0, 0.15])), [PartKind::Solid]);
        // Its two faces without the rim, looking away from each other or towards each other.
        let faces = box_of([0.0; 3], [2.0, 1.5, 0.01])[..4].to_vec();
        for faces in [faces.clone(), turned(faces)] {
            let kinds = kinds(&faces);
            let [PartKind::Pane { kept, shift, thickness: Some(_) }] = &kinds[..] else { panic!("{kinds:?}") };
            assert!(kept.len() == 2 && (shift.z.abs() - 0.005).abs() < 1e-12);
        }
    }

    #[test]
    fn sheets_are_panes_one_by_one() {
        let sheet = |z: f64| box_of([0.0, 0.0, z], [2.0, 1.5, z + 1.0])[..2].to_vec();
        let single = [PartKind::Pane { kept: vec![0, 1], shift: DVec3::ZERO, thickness: None }];
        assert_eq!(kinds(&sheet(0.0)), single);
        assert_eq!(kinds(&turned(sheet(0.0))), single);
        // Two panes of insulating glass, drawn with one winding.
        assert_eq!(kinds(&[sheet(0.0), sheet(0.016)].concat()).len(), 2);
        // The same face drawn twice, once for each side, with the other diagonal: one pane.
        let [a, b, c] = sheet(0.0)[0];
        let d = sheet(0.0)[1][2];
        let twice = [[a, b, c], [a, c, d], [d, c, b], [d, b, a]];
        assert_eq!(kinds(&twice), [PartKind::Pane { kept: vec![0, 1], shift: DVec3::ZERO, thickness: None }]);
    }

    #[test]
    fn a_body_with_a_hole_is_refused() {
        // A fine sphere without one of its triangles.
        let (rings, steps) = (24, 48);
        let point = |ring: usize, step: usize| {
            let (theta, phi) = (ring as f64 / rings as f64, 2.0 * (step % steps) as f64 / steps as f64);
            let ((sin, cos), (y, x)) =
                ((theta * std::f64::consts::PI).sin_cos(), (phi * std::f64::consts::PI).sin_cos());
            let sin = if ring == 0 || ring == rings { 0.0 } else { sin };
            DVec3::new(sin * x, sin * y, cos)
        };
        let mut faces = Vec::new();
        for ring in 0..rings {
            for step in 0..steps {
                let [a, b] = [point(ring, step), point(ring, step + 1)];
                let [c, d] = [point(ring + 1, step), point(ring + 1, step + 1)];
                faces.extend([[a, c, d], [a, d, b]]);
            }
        }
        assert_eq!(kinds(&faces), [PartKind::Solid]);
        faces.remove(600);
        assert!(matches!(kinds(&faces)[..], [PartKind::Refused("a body with a hole", _)]));
    }
}
