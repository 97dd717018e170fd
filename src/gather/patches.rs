//! Surface records of a photon map: illuminance of patches of the scene's larger triangles.
//!
//! The mean illuminance of a patch is exactly what landed on it over its area: no search radius, no boundary to
//! correct, and no photon lost. Final gathering needs nothing finer, since a point receives the mean over what it
//! sees. Three kinds of hits get no answer, and their rays go on instead (see `sight.rs`): those nearer than a patch
//! can resolve, those on triangles smaller than a patch (finely tessellated furniture: too few photons each), and those
//! on patches that something stands on or pierces, whose open area is not known. A fourth kind is bright patches of
//! which something hides a part from some points, as a shelf does with the ceiling over a cove: those points see what
//! is not as bright as the patch's mean. Photons sent ahead show which are bright.

use std::sync::atomic::{AtomicU8, Ordering};

use glam::Vec3;

use crate::embree::{Hit, RayCaster};
use crate::flux::{Flux, photometric};
use crate::geometry::Mesh;
use crate::luminaire::LightGroups;
use crate::photon::trace::{Flight, Recorder};
use crate::random::Stream;
use crate::scene::Near;

/// Hits nearer than this many patch sizes are too near for a patch's mean.
const NEAR: f32 = 2.0;
/// Triangles below this part of a patch's area get no record.
const SMALLEST: f32 = 0.25;
/// Lines over a patch along each of its sides, and probes down on it along each, that find things standing there.
const LINES: [f32; 3] = [1.0 / 6.0, 0.5, 5.0 / 6.0];
const PROBES: [f32; 3] = [1.0 / 12.0, 0.5, 11.0 / 12.0];
/// Lines end this part of a patch short of its edges, where things on its neighbours stand.
const MARGIN: f32 = 0.02;
/// Points of a patch whose barycentric coordinates add up to less than this lie in its triangle, not on its slanting
/// side.
const INSIDE: f32 = 0.999;
/// From this multiple of the mean illuminance on, it matters which part of a patch a point sees.
const BRIGHT: f64 = 2.5;
/// Directions in which rays from several points of a patch find what hides one and not another.
const WAYS: usize = 16;
/// More patches than this are not made: they become larger instead.
const MAX_PATCHES: f64 = 2e6;

/// No patch.
const NONE: u32 = u32::MAX;

/// How the scene's larger triangles are cut into patches, front and back apart.
pub struct PatchGrid {
    /// For each triangle, its entry in `cut`, or none.
    of_triangle: Vec<u32>,
    cut: Vec<CutTriangle>,
    /// Number of patches.
    patches: usize,
    /// Whether something stands on a patch; decided when it is first needed, and the same for every caller.
    state: Vec<AtomicU8>,
    /// Hits nearer than this have no patch that stands for them, m.
    near: f32,
    /// Height over the surface at which rays find things standing on it, m.
    height: f32,
    /// Whether each patch is bright; empty before [`Self::note_bright`].
    bright: Vec<bool>,
}

/// States of a patch.
const UNKNOWN: u8 = 0;
const CLEAR: u8 = 1;
const CROWDED: u8 = 2;

/// A triangle cut into a grid along two of its sides.
struct CutTriangle {
    corner: Vec3,
    /// Barycentric coordinates of p are (p − corner) · dual.
    dual: [Vec3; 2],
    sides: [Vec3; 2],
    /// Cells along each side.
    cells: [u32; 2],
    /// Its first patch: those of the front, then as many of the back.
    first: u32,
    /// Twice the triangle's area, m².
    double_area: f32,
    /// Largest side of a patch, m.
    size: f32,
}

impl CutTriangle {
    fn new(corners: [Vec3; 3], size: f32, first: u32) -> Self {
        let [corner, b, c] = corners;
        let (s, t) = (b - corner, c - corner);
        let normal = s.cross(t);
        let per_square = 1.0 / normal.length_squared();
        Self {
            corner,
            dual: [t.cross(normal) * per_square, normal.cross(s) * per_square],
            sides: [s, t],
            cells: [s, t].map(|side| (side.length() / size).ceil().max(1.0) as u32),
            first,
            double_area: normal.length(),
            size,
        }
    }

    fn patches_of_a_side(&self) -> u32 {
        self.cells[0] * self.cells[1]
    }

    /// Index of the patch at a point of the triangle.
    #[inline]
    fn patch(&self, at: Vec3, front: bool) -> usize {
        let offset = at - self.corner;
        let cell = |axis: usize| {
            let along = offset.dot(self.dual[axis]) * self.cells[axis] as f32;
            (along.max(0.0) as u32).min(self.cells[axis] - 1)
        };
        let side = if front { 0 } else { self.patches_of_a_side() };
        (self.first + side + cell(1) * self.cells[0] + cell(0)) as usize
    }

    /// Barycentric corner (low, high) of a cell of the grid.
    fn cell(&self, index: u32) -> [[f32; 2]; 2] {
        let [columns, rows] = self.cells;
        let (column, row) = (index % columns, index / columns);
        let edge = |i: u32, n: u32| i as f32 / n as f32;
        [[edge(column, columns), edge(row, rows)], [edge(column + 1, columns), edge(row + 1, rows)]]
    }

    /// The part of a cell that lies in the triangle, m².
    fn area(&self, index: u32) -> f64 {
        let [low, high] = self.cell(index).map(|corner| corner.map(f64::from));
        let below = |x: f64, y: f64| 0.5 * (1.0 - x - y).max(0.0).powi(2);
        let share = below(low[0], low[1]) - below(high[0], low[1]) - below(low[0], high[1]) + below(high[0], high[1]);
        share.max(0.0) * f64::from(self.double_area)
    }

    fn point(&self, at: [f32; 2]) -> Vec3 {
        self.corner + self.sides[0] * at[0] + self.sides[1] * at[1]
    }
}

impl PatchGrid {
    /// Cuts the triangles of a scene into patches of `size` (m) at most, and where they are far from all points, of as
    /// much as a part of their distance (`far` holds both): no larger as the points see them. `height` (m) over a
    /// surface is where rays find things standing on it. Cost: O(triangles + patches), 5 bytes a patch, and 4 more for
    /// each channel.
    pub fn new(mesh: &Mesh, useful: impl Fn(u32) -> bool, size: f32, far: (&Near, f64), height: f32) -> Self {
        let corners = |triangle: &[u32; 3]| triangle.map(|vertex| Vec3::from(mesh.vertices[vertex as usize]));
        let doubled = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a).length();
        // By how many times its patches are larger than those of others.
        let wider = |[a, b, c]: [Vec3; 3], size: f32| {
            let distance = far.0.distance([a, b, c].map(Vec3::as_dvec3));
            (far.1 * distance / f64::from(size)).max(1.0)
        };
        let patches = |corners: [Vec3; 3]| f64::from(doubled(corners)) / wider(corners, size).powi(2);
        let total: f64 = mesh.triangles.iter().map(|triangle| patches(corners(triangle))).sum();
        let size = size.max((total / MAX_PATCHES).sqrt() as f32);
        let mut grid = Self {
            of_triangle: Vec::with_capacity(mesh.triangles.len()),
            cut: Vec::new(),
            patches: 0,
            state: Vec::new(),
            near: NEAR * size,
            height,
            bright: Vec::new(),
        };
        for (triangle, &material) in mesh.triangles.iter().zip(&mesh.material_of) {
            let corners = corners(triangle);
            let size = size * wider(corners, size) as f32;
            let large = doubled(corners) > 2.0 * SMALLEST * size * size;
            if !(large && useful(material)) || grid.patches as f64 > 8.0 * MAX_PATCHES {
                grid.of_triangle.push(NONE);
                continue;
            }
            grid.of_triangle.push(grid.cut.len() as u32);
            let cut = CutTriangle::new(corners, size, grid.patches as u32);
            grid.patches += 2 * cut.patches_of_a_side() as usize;
            grid.cut.push(cut);
        }
        grid.state.resize_with(grid.patches, || AtomicU8::new(UNKNOWN));
        grid
    }

    /// The patch a ray along `direction` met, if its mean illuminance stands for that of the point met.
    #[inline]
    pub fn patch(&self, hit: &Hit, direction: Vec3, caster: &RayCaster) -> Option<usize> {
        if hit.distance < self.near {
            return None;
        }
        let cut = self.cut.get(self.of_triangle[hit.triangle as usize] as usize)?;
        if hit.distance < NEAR * cut.size {
            return None;
        }
        let front = direction.dot(hit.normal) < 0.0;
        let patch = cut.patch(hit.position, front);
        let state = match self.state[patch].load(Ordering::Relaxed) {
            UNKNOWN => {
                let state = self.examine(cut, patch, front, hit, caster);
                self.state[patch].store(state, Ordering::Relaxed);
                state
            }
            state => state,
        };
        (state == CLEAR).then_some(patch)
    }

    /// Finds things on a patch: rays over it along its lines, and down on it. Cost: 10 rays.
    fn examine(&self, cut: &CutTriangle, patch: usize, front: bool, hit: &Hit, caster: &RayCaster) -> u8 {
        let index = (patch as u32 - cut.first) % cut.patches_of_a_side();
        let [low, high] = cut.cell(index);
        let up = if front { hit.normal } else { -hit.normal };
        let at = |share: [f32; 2]| [0, 1].map(|axis| low[axis] + (high[axis] - low[axis]) * share[axis]);
        let lifted = |at: [f32; 2]| cut.point(at) + up * self.height;
        let crossed = |axis: usize, line: f32| {
            let (mut from, mut to) = ([line; 2], [line; 2]);
            (from[axis], to[axis]) = (MARGIN, 1.0 - MARGIN);
            let (from, mut to) = (at(from), at(to));
            to[axis] = to[axis].min(INSIDE - to[1 - axis]);
            let way = lifted(to) - lifted(from);
            let length = way.length();
            to[axis] > from[axis] && length > 0.0 && caster.is_occluded(lifted(from), way / length, length)
        };
        let covered = |share: [f32; 2]| {
            let at = at(share);
            let from = cut.point(at) + up * cut.size;
            at[0] + at[1] < INSIDE
                && caster
                    .closest_hit(from, -up, cut.size + self.height)
                    .is_none_or(|below| below.triangle != hit.triangle)
        };
        let standing = (0..2).any(|axis| LINES.iter().any(|&line| crossed(axis, line)));
        let lying = || PROBES.iter().any(|&a| PROBES.iter().any(|&b| covered([a, b])));
        let hidden = || self.bright.get(patch) == Some(&true) && self.is_seen_in_part(cut, [low, high], up, caster);
        if standing || lying() || hidden() { CROWDED } else { CLEAR }
    }

    /// Whether something stands before a part of a patch only: rays in the same direction from several of its points
    /// end at very different distances. Cost: [`WAYS`] · 9 rays.
    fn is_seen_in_part(&self, cut: &CutTriangle, [low, high]: [[f32; 2]; 2], up: Vec3, caster: &RayCaster) -> bool {
        let points: Vec<Vec3> = LINES
            .iter()
            .flat_map(|&a| LINES.iter().map(move |&b| [a, b]))
            .map(|share| [0, 1].map(|axis| low[axis] + (high[axis] - low[axis]) * share[axis]))
            .filter(|at| at[0] + at[1] < INSIDE)
            .map(|at| cut.point(at) + up * self.height)
            .collect();
        let far = 1e3 * cut.size;
        (0..WAYS).any(|way| {
            // Spread over the hemisphere by the cosine, the golden angle apart.
            let at = [(way as f32 + 0.5) / WAYS as f32, (way as f32 * 0.618_034).fract()];
            let direction = Stream::cosine_at(up, at);
            let ends =
                points.iter().map(|&from| caster.closest_hit(from, direction, far).map_or(far, |hit| hit.distance));
            let [nearest, farthest] =
                ends.fold([f32::INFINITY, 0.0], |[low, high]: [f32; 2], end| [low.min(end), high.max(end)]);
            farthest > 2.0 * nearest && farthest - nearest > NEAR * cut.size
        })
    }

    /// Takes note of which patches are bright in the light of photons sent ahead.
    pub fn note_bright<const C: usize>(&mut self, light: &PatchLight<C>) {
        let lux: Vec<f64> = light.0.iter().map(|lux| photometric(lux.map(f64::from))).collect();
        let (mut flux, mut lit) = (0.0, 0.0);
        for cut in &self.cut {
            let cells = cut.patches_of_a_side();
            for patch in (cut.first..cut.first + 2 * cells).filter(|&patch| lux[patch as usize] > 0.0) {
                let area = cut.area((patch - cut.first) % cells);
                flux += area * lux[patch as usize];
                lit += area;
            }
        }
        self.bright = lux.into_iter().map(|lux| lux * lit > BRIGHT * flux).collect();
    }

    /// Where a landing photon is recorded.
    #[inline]
    fn landing(&self, hit: &Hit, direction: Vec3) -> Option<u32> {
        let cut = self.cut.get(self.of_triangle[hit.triangle as usize] as usize)?;
        Some(cut.patch(hit.position, direction.dot(hit.normal) < 0.0) as u32)
    }
}

/// Mean illuminance of every patch from one set of photons, lx.
pub struct PatchLight<const C: usize>(Vec<[f32; C]>);

impl<const C: usize> PatchLight<C> {
    /// Adds up what landed, in the photons' order.
    pub fn new(grid: &PatchGrid, records: &[PatchRecorder<'_, C>]) -> Self {
        let mut light = vec![[0.0; C]; grid.patches];
        for (patch, flux) in records.iter().flat_map(|record| &record.landings) {
            light[*patch as usize].iter_mut().zip(flux.0).for_each(|(sum, flux)| *sum += flux);
        }
        for cut in &grid.cut {
            let cells = cut.patches_of_a_side();
            for index in 0..cells {
                let area = cut.area(index);
                let per_area = if area > 0.0 { (1.0 / area) as f32 } else { 0.0 };
                for patch in [cut.first + index, cut.first + cells + index] {
                    light[patch as usize].iter_mut().for_each(|channel| *channel *= per_area);
                }
            }
        }
        Self(light)
    }

    /// E of a patch, lx.
    #[inline]
    pub fn illuminance(&self, patch: usize) -> [f32; C] {
        self.0[patch]
    }
}

/// The same by light group: few of many groups have photons on any one patch, and only these are kept.
pub struct PatchGroups<const C: usize> {
    /// Where the parts of each patch lie.
    ranges: Vec<[usize; 2]>,
    /// Groups and their illuminance, lx.
    parts: Vec<(u32, [f32; C])>,
}

impl<const C: usize> PatchGroups<C> {
    /// Adds up what landed, as `light` did. Memory: that of the landings, however many groups there are.
    /// Cost: O(landings + patches).
    pub fn new(
        grid: &PatchGrid,
        records: &[PatchRecorder<'_, C>],
        groups: &LightGroups,
        light: &PatchLight<C>,
    ) -> Self {
        let mut ranges = vec![[0; 2]; grid.patches];
        records.iter().flat_map(|record| &record.landings).for_each(|(patch, _)| ranges[*patch as usize][1] += 1);
        let mut landings = 0;
        for [start, end] in &mut ranges {
            (*start, landings) = (landings, landings + *end);
            *end = *start;
        }
        // Photons come luminaire by luminaire, so those of a group mostly follow each other.
        let mut parts = vec![(0, [0.0; C]); landings];
        for (patch, flux, luminaire) in records.iter().flat_map(PatchRecorder::by_source) {
            let [start, end] = &mut ranges[patch as usize];
            let group = groups.group(luminaire);
            if *end == *start || parts[*end - 1].0 != group {
                parts[*end].0 = group;
                *end += 1;
            }
            parts[*end - 1].1.iter_mut().zip(flux.0).for_each(|(sum, flux)| *sum += flux);
        }
        // So that they add up to the whole, the rounding of its sum included.
        for ([start, end], whole) in ranges.iter().zip(&light.0) {
            let parts = &mut parts[*start..*end];
            for (c, whole) in whole.iter().enumerate() {
                let sum: f64 = parts.iter().map(|(_, lux)| f64::from(lux[c])).sum();
                let share = if sum > 0.0 { f64::from(*whole) / sum } else { 0.0 };
                parts.iter_mut().for_each(|(_, lux)| lux[c] = (f64::from(lux[c]) * share) as f32);
            }
        }
        Self { ranges, parts }
    }

    /// Groups and what they bring to a patch, lx.
    #[inline]
    pub fn parts(&self, patch: usize) -> &[(u32, [f32; C])] {
        let [start, end] = self.ranges[patch];
        &self.parts[start..end]
    }
}

/// Records where photons land.
pub struct PatchRecorder<'a, const C: usize> {
    grid: &'a PatchGrid,
    landings: Vec<(u32, Flux<C>)>,
    /// Where the landings of each luminaire begin, if that matters: photons come luminaire by luminaire.
    sources: Option<Vec<(usize, u32)>>,
}

impl<'a, const C: usize> PatchRecorder<'a, C> {
    /// An empty record.
    pub fn new(grid: &'a PatchGrid) -> Self {
        Self { grid, landings: Vec::new(), sources: None }
    }

    /// The same, which keeps the luminaires too, if they matter.
    pub fn with_sources(self, matter: bool) -> Self {
        Self { sources: matter.then(Vec::new), ..self }
    }

    /// Patch, flux and luminaire of each landing, in order; none without sources.
    fn by_source(&self) -> impl Iterator<Item = (u32, Flux<C>, u32)> {
        let sources = self.sources.as_deref().unwrap_or_default();
        let ends = sources.iter().skip(1).map(|&(start, _)| start).chain([self.landings.len()]);
        sources.iter().zip(ends).flat_map(|(&(start, luminaire), end)| {
            self.landings[start..end].iter().map(move |&(patch, flux)| (patch, flux, luminaire))
        })
    }
}

impl<const C: usize> Recorder<C> for PatchRecorder<'_, C> {
    #[inline]
    fn record(&mut self, flight: &Flight<'_>, flux: Flux<C>) {
        if let (Some(hit), true) = (flight.hit, flight.lands)
            && let Some(patch) = self.grid.landing(hit, flight.direction)
        {
            if let Some(sources) = &mut self.sources
                && sources.last().is_none_or(|&(_, luminaire)| luminaire != flight.luminaire)
            {
                sources.push((self.landings.len(), flight.luminaire));
            }
            self.landings.push((patch, flux));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cells of a cut triangle tile it: their areas add up to its own, and each point lies in the cell it is said to.
    #[test]
    fn patches_tile_their_triangle() {
        let corners = [Vec3::new(1.0, 2.0, 0.5), Vec3::new(4.0, 2.5, 0.5), Vec3::new(1.5, 2.6, 2.0)];
        let cut = CutTriangle::new(corners, 0.3, 7);
        let area: f64 = (0..cut.patches_of_a_side()).map(|cell| cut.area(cell)).sum();
        assert!((area / (0.5 * f64::from(cut.double_area)) - 1.0).abs() < 1e-6, "{area}");
        for step in 0..1000 {
            let [a, b] = [0.618_034, 0.754_878].map(|factor: f32| (step as f32 * factor).fract());
            let at = if a + b < 1.0 { [a, b] } else { [1.0 - a, 1.0 - b] };
            let patch = cut.patch(cut.point(at), true) as u32 - cut.first;
            let [low, high] = cut.cell(patch);
            let inside = (0..2).all(|axis| low[axis] - 1e-4 <= at[axis] && at[axis] <= high[axis] + 1e-4);
            assert!(inside, "{at:?} in {low:?} … {high:?}");
            assert_eq!(cut.patch(cut.point(at), false) as u32 - cut.first, patch + cut.patches_of_a_side());
        }
    }
}
