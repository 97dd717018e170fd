//! Where a scene's light is asked for, and how large the surroundings are that matter to it.
//!
//! A room keeps its size when somebody lays a ground of 20 km beneath it, or forgets a triangle at the other end of the
//! country. So what depends on size (where single precision is finest, how far rays start off surfaces, how wide
//! photons are searched for) is taken from the surroundings of what is measured and not from the box around everything.
//! Both are the same in any room: only what lies more than `SURROUNDINGS` times as far as the measured is wide counts
//! as far.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use crate::geometry::mesh::Bounds;

/// The surroundings reach so many times the core's largest extent beyond the core, on every side.
const SURROUNDINGS: f64 = 2.0;
/// A luminaire belongs to the core unless that would make it so many times as large: a sky of 20 km over a yard is
/// none.
const WIDER: f64 = 10.0;
/// Rays that look how wide the room is, and how many rays times triangles that may take: a second or less.
const LOOKS: usize = 128;
const MOST_TESTS: usize = 100_000_000;
/// Large triangles may become so many pieces for each triangle of their mesh, and so many more.
const PIECES: [usize; 2] = [2, 100_000];

/// The part of a scene that its light is asked for in.
#[derive(Clone, Copy, Debug)]
pub struct Near {
    /// Around what is measured and the luminaires near it.
    core: Bounds,
    /// How wide the room is, m: the core's largest extent, or more where one sees farther from it.
    size: f64,
    /// What the core has about it: everything, but for what is far.
    around: Bounds,
    /// Whether anything is far.
    cut: bool,
}

impl Near {
    /// Where all matters alike.
    pub(crate) fn everything() -> Self {
        let all = Bounds { least: DVec3::NEG_INFINITY, most: DVec3::INFINITY };
        Self { core: all, size: f64::INFINITY, around: all, cut: false }
    }

    /// The surroundings of what is `measured` (if nothing is, of where cameras stand) by the light of what is
    /// `shining`; `whole` is the box around everything that stands or shines. Where something may be far, `sight` is
    /// asked how wide the room is that one sees (m): a meter of 1 mm stands in a room.
    pub(super) fn of(measured: Bounds, shining: &[Bounds], whole: Bounds, sight: impl FnOnce() -> f64) -> Self {
        let near = Self::as_wide(measured, shining, whole, 0.0);
        if near.cut { Self::as_wide(measured, shining, whole, sight()) } else { near }
    }

    /// The same where the room is `width` (m) wide at least.
    fn as_wide(measured: Bounds, shining: &[Bounds], whole: Bounds, width: f64) -> Self {
        let with = |core: Bounds, lamp: &Bounds| Bounds::joined(Some(core), Some(*lamp)).unwrap_or(core);
        let mut shining: Vec<(f64, &Bounds)> =
            shining.iter().map(|lamp| (with(measured, lamp).largest_extent(), lamp)).collect();
        shining.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut core, mut size) = (measured, measured.largest_extent().max(width));
        for (_, lamp) in shining {
            let wider = with(core, lamp);
            if size > 0.0 && wider.largest_extent() > WIDER * size {
                break;
            }
            (core, size) = (wider, size.max(wider.largest_extent()));
        }
        let margin = DVec3::splat(SURROUNDINGS * size);
        let (least, most) = (core.least - margin, core.most + margin);
        let cut = size > 0.0 && !(whole.least.cmpge(least).all() && whole.most.cmple(most).all());
        let all = with(whole, &core);
        let around = if cut { Bounds { least: all.least.max(least), most: all.most.min(most) } } else { all };
        Self { core, size, around, cut }
    }

    /// Where the local origin belongs: in the middle of `whole`, or of the core where that is far smaller. Coordinates
    /// are exact to 6·10⁻⁸ of their distance from there.
    pub(super) fn origin(&self, whole: Bounds) -> DVec3 {
        if self.cut { self.core.centre() } else { whole.centre() }
    }

    /// How far openings move off what they may be flush with, m: 10⁻⁵ of half of `whole`'s extent, some 150 steps of
    /// `f32` there, but no more than the surroundings' and than 10⁻⁵ of the room's. That moves illuminance by less than
    /// 10⁻⁴, and clears what rays start off the pieces of a large ceiling.
    pub(super) fn shift(&self, whole: Bounds) -> f64 {
        let half = whole.largest_extent().min(self.around.largest_extent()) / 2.0;
        1e-5 * if self.size > 0.0 { half.min(self.size) } else { half }
    }

    /// The same in coordinates about `origin`.
    pub(super) fn local(self, origin: DVec3) -> Self {
        let moved = |Bounds { least, most }: Bounds| Bounds { least: least - origin, most: most - origin };
        Self { core: moved(self.core), around: moved(self.around), ..self }
    }

    /// Largest extent of the surroundings, m.
    pub(super) fn extent(&self) -> f64 {
        self.around.largest_extent()
    }

    /// Whether anything is far: if not, all that follows is as if there were no core.
    pub(crate) fn is_cut(&self) -> bool {
        self.cut
    }

    /// A point as it counts for the scene's size: what is far counts as at the surroundings' end.
    pub(crate) fn clamp(&self, point: DVec3) -> DVec3 {
        if self.cut { point.clamp(self.around.least, self.around.most) } else { point }
    }

    /// Whether the box around some points comes as near as the core.
    pub(crate) fn reaches_core(&self, points: [DVec3; 3]) -> bool {
        let slack = DVec3::splat(1e-3 * self.size);
        let Some(Bounds { least, most }) = Bounds::around(points) else { return false };
        !self.cut || (least.cmple(self.core.most + slack).all() && most.cmpge(self.core.least - slack).all())
    }

    /// Distance of the box around some points from the core, m; 0 where nothing is far.
    pub(crate) fn distance(&self, points: [DVec3; 3]) -> f64 {
        if self.cut { Bounds::around(points).map_or(0.0, |bounds| self.gap(bounds)) } else { 0.0 }
    }

    /// Length that everything in the core stays below, m.
    fn width(&self) -> f64 {
        self.core.diagonal().max(self.size)
    }

    fn gap(&self, bounds: Bounds) -> f64 {
        let gap = (bounds.least - self.core.most).max(self.core.least - bounds.most);
        gap.max(DVec3::ZERO).length()
    }

    /// How far looking counts, m: across the room; without end where nothing is far.
    pub(crate) fn horizon(&self) -> f64 {
        if self.cut { self.width() } else { f64::INFINITY }
    }

    /// Cuts triangles of a mesh in world coordinates that are far larger than the room, so that a piece is no larger
    /// than the room, or than its distance from the core. How exactly rays meet a triangle, and how far off it they
    /// start, goes by the size of its corners' coordinates: on a ground of 20 km that would be 1 cm, beneath a desk as
    /// anywhere.
    ///
    /// The first piece takes its triangle's place, the others follow behind all triangles. Edges are halved by their
    /// own length and place, so pieces of neighbours meet without a crack; flat ground stays flat. Triangles of
    /// materials that `stay` are left alone.
    pub(super) fn cut_large(&self, mesh: Triangles<'_>, stay: impl Fn(u32) -> bool + Sync) {
        if !self.cut {
            return;
        }
        let Triangles { vertices, triangles, material_of } = mesh;
        let large =
            |index: &usize| !stay(material_of[*index]) && self.long(triangles[*index], vertices, 1.0).contains(&true);
        let large: Vec<usize> = (0..triangles.len()).into_par_iter().filter(large).collect();
        let most = PIECES[0] * triangles.len() + PIECES[1];
        let before = vertices.len();
        let mut coarse = 1.0;
        let pieces = loop {
            let mut cutting = Cutting { near: self, coarse, vertices, middles: HashMap::new(), left: most };
            match large.iter().map(|&index| cutting.pieces(triangles[index])).collect::<Option<Vec<_>>>() {
                Some(pieces) => break pieces,
                // Too many: coarser ones. From some size on nothing is cut at all.
                None => coarse *= 2.0,
            }
            vertices.truncate(before);
        };
        for (index, pieces) in large.into_iter().zip(pieces) {
            triangles[index] = pieces[0];
            triangles.extend(&pieces[1..]);
            material_of.resize(triangles.len(), material_of[index]);
        }
    }

    /// Which edges of a triangle are longer than `coarse` times the room's width, and than as many times
    /// their distance from the core.
    fn long(&self, triangle: [u32; 3], vertices: &[DVec3], coarse: f64) -> [bool; 3] {
        [0, 1, 2].map(|edge| {
            let [a, b] = [edge, (edge + 1) % 3].map(|corner| vertices[triangle[corner] as usize]);
            let middle = (a + b) / 2.0;
            // A millionth more, so that what is measured, which makes the core, stays whole.
            let least = self.width() * (1.0 + 1e-6);
            a.distance(b) > coarse * least.max(self.gap(Bounds { least: middle, most: middle }))
        })
    }
}

/// A mesh in world coordinates that may be cut.
pub(super) struct Triangles<'m> {
    pub(super) vertices: &'m mut Vec<DVec3>,
    pub(super) triangles: &'m mut Vec<[u32; 3]>,
    pub(super) material_of: &'m mut Vec<u32>,
}

/// Parts cut so far, and what is left to cut.
struct Cutting<'m> {
    near: &'m Near,
    /// Pieces may be so many times as large as they should be.
    coarse: f64,
    vertices: &'m mut Vec<DVec3>,
    /// The vertex in the middle of each edge that was halved.
    middles: HashMap<[u32; 2], u32>,
    /// Pieces that may still be made.
    left: usize,
}

impl Cutting<'_> {
    /// The pieces of a triangle, which turn as it does; `None` where they would be too many.
    fn pieces(&mut self, triangle: [u32; 3]) -> Option<Vec<[u32; 3]>> {
        let (mut open, mut pieces) = (vec![triangle], Vec::new());
        while let Some(piece) = open.pop() {
            let long = self.near.long(piece, self.vertices, self.coarse);
            // Turned so that the edges to be halved come first.
            let turn = match long {
                [false, true, _] => 1,
                [_, false, true] => 2,
                _ => 0,
            };
            let [a, b, c] = [0, 1, 2].map(|corner| piece[(corner + turn) % 3]);
            match long.iter().filter(|long| **long).count() {
                0 => {
                    self.left = self.left.checked_sub(1)?;
                    pieces.push(piece);
                }
                1 => {
                    let ab = self.middle(a, b);
                    open.extend([[a, ab, c], [ab, b, c]]);
                }
                2 => {
                    let [ab, bc] = [self.middle(a, b), self.middle(b, c)];
                    open.extend([[ab, b, bc], [a, ab, bc], [a, bc, c]]);
                }
                _ => {
                    let [ab, bc, ca] = [self.middle(a, b), self.middle(b, c), self.middle(c, a)];
                    open.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
                }
            }
            if open.len() > self.left {
                return None;
            }
        }
        Some(pieces)
    }

    fn middle(&mut self, a: u32, b: u32) -> u32 {
        let vertices = &mut *self.vertices;
        *self.middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
            vertices.push((vertices[a as usize] + vertices[b as usize]) / 2.0);
            vertices.len() as u32 - 1
        })
    }
}

/// How wide the room is that one sees from places with a direction each, m: twice the median distance at which rays
/// about the directions end; 0 where fewer than a quarter of them end at all. Meshes are vertices and triangles.
pub(super) fn sight(places: &[(DVec3, DVec3)], meshes: &[(&[DVec3], &[[u32; 3]])]) -> f64 {
    let triangles: usize = meshes.iter().map(|(_, triangles)| triangles.len()).sum();
    let rays = (MOST_TESTS / triangles.max(1)).clamp(LOOKS / 8, LOOKS);
    let look = |ray: usize| {
        let (from, normal) = *places.get(ray * places.len() / rays)?;
        // Points that fill the square evenly (Roberts's R₂), by the cosine.
        let [share, turn] = [0.754_877_666, 0.569_840_291].map(|step| (0.5 + step * ray as f64).fract());
        let ((x, y), (sin, cos)) = (normal.any_orthonormal_pair(), (turn * std::f64::consts::TAU).sin_cos());
        let towards = (x * cos + y * sin) * f64::sqrt(share) + normal * (1.0 - share).sqrt();
        let of = |(vertices, triangles): &(&[DVec3], &[[u32; 3]])| {
            let corners = |triangle: &[u32; 3]| triangle.map(|vertex| vertices[vertex as usize]);
            let ends = triangles.par_iter().filter_map(|triangle| meeting(from, towards, corners(triangle)));
            ends.reduce(|| f64::INFINITY, f64::min)
        };
        meshes.iter().map(of).reduce(f64::min).filter(|end| end.is_finite())
    };
    let mut ends: Vec<f64> = (0..rays).filter_map(look).collect();
    ends.sort_by(f64::total_cmp);
    if ends.len() < rays / 4 { 0.0 } else { ends.get(ends.len() / 2).map_or(0.0, |median| 2.0 * median) }
}

/// Distance along a ray of unit direction at which it meets a triangle, if it does (Möller & Trumbore 1997).
fn meeting(from: DVec3, towards: DVec3, [a, b, c]: [DVec3; 3]) -> Option<f64> {
    let (s, t) = (b - a, c - a);
    let across = towards.cross(t);
    let volume = s.dot(across);
    let to = from - a;
    let over = to.cross(s);
    let [u, v, distance] = [to.dot(across), towards.dot(over), t.dot(over)].map(|part| part / volume);
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0).then_some(distance)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bounds(least: [f64; 3], most: [f64; 3]) -> Bounds {
        Bounds { least: least.into(), most: most.into() }
    }

    const ROOM: Bounds = Bounds { least: DVec3::ZERO, most: DVec3::new(6.0, 7.0, 2.7) };

    /// A room of 6 × 7 m about a floor that is measured, with two lamps.
    fn of(whole: Bounds) -> Near {
        let lamps = vec![bounds([1.0, 1.0, 2.7], [1.6, 1.6, 2.7]), bounds([4.0, 4.0, 2.7], [4.6, 4.6, 2.7])];
        Near::of(bounds([0.0; 3], [6.0, 7.0, 0.0]), &lamps, whole, || 5.0)
    }

    fn ground(half: f64, z: f64) -> Bounds {
        bounds([-half, -half, z], [half, half, z])
    }

    fn joined(a: Bounds, b: Bounds) -> Bounds {
        Bounds::joined(Some(a), Some(b)).expect("two boxes")
    }

    /// In a room, and with some ground about it, everything is as the box around everything says.
    #[test]
    fn nothing_is_far_in_a_room() {
        for whole in [ROOM, joined(ROOM, ground(10.0, -1.0))] {
            let near = of(whole);
            assert!(!near.is_cut());
            assert_eq!(near.origin(whole), whole.centre());
            assert_eq!(near.clamp(DVec3::splat(1e6)), DVec3::splat(1e6));
            assert_eq!((near.distance([DVec3::splat(1e6); 3]), near.horizon()), (0.0, f64::INFINITY));
        }
        assert_eq!(of(ROOM).shift(ROOM), 1e-5 * 3.5);
    }

    /// However large the ground, and wherever the speck, the origin is the room's, and openings move by less than 10⁻⁵
    /// of it.
    #[test]
    fn what_is_far_moves_nothing() {
        for half in [100.0, 1e4, 1e5, 1e8] {
            for far in [ground(half, -1.0), bounds([half; 3], [half; 3])] {
                let whole = joined(ROOM, far);
                let near = of(whole);
                assert!(near.is_cut());
                assert_eq!(near.origin(whole), DVec3::new(3.0, 3.5, 1.35));
                assert!((1e-5 * 3.5..=1e-5 * 7.0).contains(&near.shift(whole)), "{}", near.shift(whole));
            }
        }
    }

    /// A sky that shines on a yard doesn't belong to it; the lamps of a hall belong to the desk lit by them.
    #[test]
    fn lamps_belong_to_what_they_light_unless_they_are_far_larger() {
        let sky = bounds([-1e4, -1e4, 1e3], [1e4, 1e4, 1e3]);
        let yard = bounds([0.0; 3], [6.0, 7.0, 0.0]);
        assert_eq!(Near::of(yard, &[sky], joined(yard, sky), || 20.0).core, yard);
        let desk = bounds([0.0, 0.0, 0.75], [1.6, 0.8, 0.75]);
        let lamp = |x: f64| bounds([x, 0.0, 3.0], [x + 1.0, 0.3, 3.0]);
        let lamps: Vec<Bounds> = (0..50).rev().map(|i| lamp(2.0 * f64::from(i))).collect();
        assert_eq!(Near::of(desk, &lamps, desk, || 0.0).core.most.x, 99.0);
    }

    /// The size of a meter doesn't say how wide the room around it is; what one sees from it does. Here the walls of a
    /// cube of 4 m, from the middle of its floor: a quarter to a half of it.
    #[test]
    fn a_meter_stands_in_a_room() {
        let side = |bit: u32, corner: u32| if corner >> bit & 1 == 1 { 4.0 } else { 0.0 };
        let vertices: Vec<DVec3> = (0..8).map(|i| DVec3::new(side(0, i), side(1, i), side(2, i))).collect();
        let walls = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        let triangles: Vec<[u32; 3]> = walls.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let meter = [(DVec3::new(2.0, 2.0, 0.0), DVec3::Z)];
        let width = sight(&meter, &[(&vertices, &triangles)]);
        assert!((4.0..9.0).contains(&width), "{width}");
        assert_eq!(
            sight(&meter, &[(&vertices, &triangles[2..3])]),
            0.0,
            "most rays miss half a ceiling: there is no room"
        );
        let [cell, room] = [bounds([2.0, 2.0, 0.0], [2.001, 2.001, 0.0]), bounds([0.0; 3], [4.0; 3])];
        assert!(!Near::of(cell, &[], room, || width).is_cut());
        let near = Near::of(cell, &[], joined(room, ground(1e5, -1.0)), || width);
        assert!(near.is_cut() && near.clamp(DVec3::splat(4.0)) == DVec3::splat(4.0));
    }

    /// A ground of two triangles, cut: area, sense and material are kept, pieces are small where it matters, edges of
    /// neighbours are the same (each inner edge is run both ways), and they are few.
    #[test]
    fn pieces_tile_a_large_ground_and_fit_each_other() {
        for half in [1e3, 1e5, 1e8] {
            let near = of(joined(ROOM, ground(half, -1.0)));
            let corner = |x: f64, y: f64| DVec3::new(x * half, y * half, -1.0);
            let mut vertices = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            let (mut triangles, mut material_of) = (vec![[0, 1, 2], [0, 2, 3]], vec![7, 7]);
            let mut cut = |stay: bool| {
                let (vertices, triangles, material_of) = (&mut vertices, &mut triangles, &mut material_of);
                near.cut_large(Triangles { vertices, triangles, material_of }, |_| stay);
            };
            cut(true);
            cut(false);
            assert!(triangles.len() > 10 && triangles.len() < 1500, "{}", triangles.len());
            assert_eq!(material_of, vec![7; triangles.len()]);
            let corners = |triangle: &[u32; 3]| triangle.map(|corner| vertices[corner as usize]);
            let doubled = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
            let area: f64 = triangles.iter().map(|triangle| doubled(corners(triangle)).z / 2.0).sum();
            assert!((area / (4.0 * half * half) - 1.0).abs() < 1e-12, "{area}");
            let mut edges: HashMap<[u32; 2], i32> = HashMap::new();
            for triangle in &triangles {
                assert!(doubled(corners(triangle)).z > 0.0);
                let [a, b, c] = *triangle;
                for [from, to] in [[a, b], [b, c], [c, a]] {
                    *edges.entry([from.min(to), from.max(to)]).or_default() += if from < to { 1 } else { -1 };
                }
                if near.distance(corners(triangle)) < 10.0 {
                    let largest = corners(triangle).iter().fold(0.0_f64, |most, p| most.max(p.abs().max_element()));
                    assert!(largest < 60.0, "{largest}");
                }
            }
            let rim = edges.iter().filter(|(_, count)| **count != 0);
            assert!(rim.clone().all(|([a, b], _)| {
                let [a, b] = [a, b].map(|&corner| vertices[corner as usize]);
                (a.x == b.x && a.x.abs() == half) || (a.y == b.y && a.y.abs() == half)
            }));
        }
    }

    /// Many triangles that all cross the room end as a bounded number of pieces.
    #[test]
    fn pieces_are_bounded() {
        let half = 1e6;
        let near = of(joined(ROOM, bounds([-half; 3], [half; 3])));
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for i in 0..5000 {
            let z = 1e-4 * f64::from(i);
            let first = vertices.len() as u32;
            vertices.extend([DVec3::new(-half, -half, z), DVec3::new(half, -half, z), DVec3::new(0.0, half, z)]);
            triangles.push([first, first + 1, first + 2]);
        }
        let mut material_of = vec![0; triangles.len()];
        let mesh = Triangles { vertices: &mut vertices, triangles: &mut triangles, material_of: &mut material_of };
        near.cut_large(mesh, |_| false);
        assert!(triangles.len() > 5000 && triangles.len() <= 3 * 5000 + 100_000, "{}", triangles.len());
        assert_eq!(material_of.len(), triangles.len());
    }
}
