//! Receivers: the planes in which light is measured, and the photons that pass through them.
//!
//! A measuring plane counts the photons that cross it from the measured side, whether it lies on a floor or hangs in
//! the air: flux through the plane is what illuminance means, and a density of surface hits elsewhere is not. Light
//! that lands on a surface within [`Receiver::tolerance`] below the plane counts as crossing it, so a plane on a floor
//! works whatever the rounding of the mesh. Sensors that share a plane share a receiver.
//!
//! Samples of a surface, each with a normal of its own, and measured bodies make receivers too, which no photon
//! crosses: `counts.rs` counts theirs.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::meter::MeasuredBody;
use crate::embree::RayCaster;
use crate::flux::Flux;
use crate::photon::trace::{Flight, History, Recorder};
use crate::random::Stream;
use crate::scene::measured::Sample;
use crate::scene::{Measure, MeasuredSurface, MeasuringPlane, Scene, Sensor};

/// A plane through the scene, the points on it where illuminance is measured, and the region around them where
/// photons matter.
pub struct Receiver {
    /// Middle of the points, m; origin of the plane's coordinates.
    pub origin: Vec3,
    /// Unit vector of the first coordinate.
    pub u: Vec3,
    /// Unit vector of the second coordinate.
    pub v: Vec3,
    /// Unit normal of the measured side, u × v.
    pub normal: Vec3,
    /// Points in plane coordinates, m.
    pub points: Vec<[f32; 2]>,
    /// Columns and rows, where the points make a grid.
    pub grid: Option<[usize; 2]>,
    /// Whether light with edges is counted in the grid's cells.
    pub cells_count: bool,
    /// Sides of the grid's cells along u and v, m; 0 where there is no grid.
    pub cell: [f32; 2],
    /// How far below the plane a surface may lie and still count as the plane's, m.
    pub tolerance: f32,
    /// Where rays leave each point: just off the surface if one is there.
    starts: Vec<Vec3>,
    /// Points that touch a wall, in order, and how far their starts were moved off it, m.
    moved: Vec<(usize, Vec3)>,
    /// Whether each point has a surface within the tolerance.
    on_surface: Vec<bool>,
    exact: Exact,
    low: [f32; 2],
    high: [f32; 2],
    facing: Facing,
}

/// Where the points of a receiver are, to double precision and not lifted off any surface.
enum Exact {
    /// In a plane with this origin and these axes, m; and how far above it the surface of each lies, if any does, m;
    /// not a number where it lies aslant.
    Plane { origin: DVec3, axes: [DVec3; 2], heights: Vec<f32> },
    /// Each by itself, m.
    Each(Vec<DVec3>),
}

/// Where the points of a receiver face.
enum Facing {
    /// All along the plane's normal.
    Plane,
    /// Each along a normal of its own, on a surface.
    Each(Vec<Vec3>),
    /// All around.
    Bodies(Vec<MeasuredBody>),
}

/// Share of the middle point in the mean over a disc; the others have equal shares of the rest.
pub const MIDDLE_SHARE: f64 = 0.25;

/// Where the light of a sensor is measured: at its place, or at seven points of its disc, the middle first and the
/// others on the circle of √(2/3) of its radius. Their weighted mean is that of the disc for every polynomial up to
/// degree 5 (Albrecht & Collatz, as S2 5-1 in Stroud, Approximate Calculation of Multiple Integrals, 1971).
fn disc_points(sensor: &Sensor) -> Vec<DVec3> {
    let Some(diameter) = sensor.disc else { return vec![sensor.position] };
    let (u, v) = sensor.normal.any_orthonormal_pair();
    let radius = (2.0_f64 / 3.0).sqrt() * diameter / 2.0;
    let around = (0..6).map(|step| (f64::from(step) * std::f64::consts::TAU / 6.0).sin_cos());
    let around = around.map(|(sin, cos)| sensor.position + (u * cos + v * sin) * radius);
    std::iter::once(sensor.position).chain(around).collect()
}

impl Receiver {
    /// The receiver of a measuring plane; `margin` (m) beyond it photons still matter.
    pub fn of_plane(plane: &MeasuringPlane, caster: &RayCaster, tolerance: f32, margin: f32) -> Self {
        let origin = plane.corner + (plane.along + plane.across) * 0.5;
        let points: Vec<DVec3> = (0..plane.len()).map(|index| plane.point(index)).collect();
        let axes = [plane.along.normalize(), plane.across.normalize()];
        let mut receiver = Self::new(origin, axes, &points, caster, tolerance, margin);
        receiver.grid = Some(plane.cells);
        let side = |length: f64, cells: usize| (length / cells as f64) as f32;
        receiver.cell = [side(plane.along.length(), plane.cells[0]), side(plane.across.length(), plane.cells[1])];
        receiver
    }

    /// The receivers of the scene's sensors, each with the sensor that each of its points serves: one for all that
    /// share a plane. A sensor with a disc has the points of `disc_points`, one after the other.
    pub fn of_sensors(scene: &Scene, caster: &RayCaster, tolerance: f32, margin: f32) -> Vec<(Self, Vec<usize>)> {
        let same_plane = |a: &Sensor, b: &Sensor| {
            a.normal.distance(b.normal) < 1e-9
                && (a.position - b.position).dot(a.normal).abs() < 1e-3 * f64::from(tolerance)
        };
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for (index, sensor) in scene.sensors.iter().enumerate() {
            if sensor.measure != Measure::Plane {
                continue;
            }
            match groups.iter_mut().find(|group| same_plane(&scene.sensors[group[0]], sensor)) {
                Some(group) => group.push(index),
                None => groups.push(vec![index]),
            }
        }
        groups
            .into_iter()
            .map(|group| {
                let of =
                    |&index: &usize| disc_points(&scene.sensors[index]).into_iter().map(move |point| (point, index));
                let (points, group): (Vec<DVec3>, Vec<usize>) = group.iter().flat_map(of).unzip();
                let middle = points.iter().sum::<DVec3>() / points.len() as f64;
                let normal = scene.sensors[group[0]].normal;
                let u = normal.any_orthonormal_vector();
                (Self::new(middle, [u, normal.cross(u)], &points, caster, tolerance, margin), group)
            })
            .collect()
    }

    /// The receiver of the scene's measured bodies, and which sensors they are, if there are any.
    pub fn of_bodies(scene: &Scene, caster: &RayCaster, tolerance: f32) -> Option<(Self, Vec<usize>)> {
        let served: Vec<usize> =
            (0..scene.sensors.len()).filter(|&index| scene.sensors[index].measure != Measure::Plane).collect();
        let of = |&index: &usize| &scene.sensors[index];
        let starts = served.iter().map(of).map(|sensor| {
            let (at, axis) = (sensor.position.as_vec3(), sensor.normal.as_vec3());
            match caster.closest_hit(at + axis * tolerance, -axis, 2.0 * tolerance) {
                Some(hit) => hit.leave(axis),
                None => at,
            }
        });
        let bodies = served.iter().map(of).map(|sensor| MeasuredBody { measure: sensor.measure, axis: sensor.normal });
        let receiver = Self::apart(starts.collect(), Facing::Bodies(bodies.collect()));
        (!served.is_empty()).then_some((receiver, served))
    }

    /// The receiver of a measured surface: a point at the middle of each sample, just off the surface.
    pub fn of_surface(surface: &MeasuredSurface, caster: &RayCaster) -> Self {
        let face = |sample: &Sample| {
            let largest = sample.corners.iter().fold(0.0_f64, |most, corner| most.max(corner.abs().max_element()));
            let normal = sample.normal().as_vec3();
            (caster.step_off(sample.centre().as_vec3(), normal, largest as f32), normal)
        };
        let mut receiver = Self::of_faces(surface.samples.iter().map(face));
        receiver.exact = Exact::Each(surface.samples.iter().map(Sample::centre).collect());
        receiver.on_surface.fill(true);
        receiver
    }

    /// Points that each have a normal of their own.
    pub fn of_faces(faces: impl Iterator<Item = (Vec3, Vec3)>) -> Self {
        let (starts, normals) = faces.unzip();
        Self::apart(starts, Facing::Each(normals))
    }

    /// Points that share no plane, which nothing crosses.
    fn apart(starts: Vec<Vec3>, facing: Facing) -> Self {
        Self {
            origin: Vec3::ZERO,
            u: Vec3::X,
            v: Vec3::Y,
            normal: Vec3::Z,
            points: Vec::new(),
            grid: None,
            cells_count: false,
            cell: [0.0; 2],
            tolerance: 0.0,
            moved: Vec::new(),
            on_surface: vec![false; starts.len()],
            exact: Exact::Each(starts.iter().map(|start| start.as_dvec3()).collect()),
            starts,
            low: [f32::INFINITY; 2],
            high: [f32::NEG_INFINITY; 2],
            facing,
        }
    }

    fn new(
        origin: DVec3,
        [u, v]: [DVec3; 2],
        points: &[DVec3],
        caster: &RayCaster,
        tolerance: f32,
        margin: f32,
    ) -> Self {
        let (normal, axes) = (u.cross(v).as_vec3(), [u.as_vec3(), v.as_vec3()]);
        let starts: Vec<(Vec3, Vec3, Option<f32>)> = points
            .par_iter()
            .map(|exact| {
                let point = exact.as_vec3();
                let (start, height) = match caster.closest_hit(point + normal * tolerance, -normal, 2.0 * tolerance) {
                    // What a point lies on aslant it can't be put on exactly: light is measured where rays start then.
                    Some(hit) if hit.normal.dot(normal).abs() < PARALLEL => (hit.leave(normal), Some(f32::NAN)),
                    Some(hit) => {
                        let height = (hit.position.as_dvec3() - *exact).dot(u.cross(v));
                        // Less is the rounding of the hit.
                        let matters = height.abs() > f64::from(ROUNDING * hit.position.abs().max_element());
                        (hit.leave(normal), Some(if matters { height as f32 } else { 0.0 }))
                    }
                    None => (point, None),
                };
                let moved = off_walls(start, normal, axes, height.map_or(0.0, |_| tolerance), caster);
                (moved, moved - start, height)
            })
            .collect();
        let heights: Vec<f32> = starts.iter().map(|(.., height)| height.unwrap_or(0.0)).collect();
        let is_flat = heights.iter().all(|&height| height == 0.0);
        let exact = Exact::Plane { origin, axes: [u, v], heights: if is_flat { Vec::new() } else { heights } };
        let off = starts.iter().map(|(_, off, _)| *off).enumerate().filter(|(_, off)| *off != Vec3::ZERO);
        let moved = off.collect();
        let (starts, on_surface) = starts.into_iter().map(|(start, _, height)| (start, height.is_some())).unzip();
        let points: Vec<[f32; 2]> =
            points.iter().map(|&p| [(p - origin).dot(u) as f32, (p - origin).dot(v) as f32]).collect();
        let bound = |axis: usize, pick: fn(f32, f32) -> f32, start: f32| {
            points.iter().map(|point| point[axis]).fold(start, pick)
        };
        let low = [0, 1].map(|axis| bound(axis, f32::min, f32::INFINITY) - margin);
        let high = [0, 1].map(|axis| bound(axis, f32::max, f32::NEG_INFINITY) + margin);
        Self {
            origin: origin.as_vec3(),
            u: u.as_vec3(),
            v: v.as_vec3(),
            normal,
            points,
            grid: None,
            cells_count: false,
            cell: [0.0; 2],
            tolerance,
            starts,
            moved,
            on_surface,
            exact,
            low,
            high,
            facing: Facing::Plane,
        }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.starts.len()
    }

    /// Whether it has no points.
    pub fn is_empty(&self) -> bool {
        self.starts.is_empty()
    }

    /// Whether its points share a plane, whose crossings measure their light.
    pub fn is_plane(&self) -> bool {
        matches!(self.facing, Facing::Plane)
    }

    /// The bodies it measures, one at each point; none on planes and surfaces.
    pub fn bodies(&self) -> &[MeasuredBody] {
        if let Facing::Bodies(bodies) = &self.facing { bodies } else { &[] }
    }

    /// Unit normal of the measured side at a point; the axis of a body.
    #[inline]
    pub fn normal_at(&self, point: usize) -> Vec3 {
        match &self.facing {
            Facing::Plane => self.normal,
            Facing::Each(normals) => normals[point],
            Facing::Bodies(bodies) => bodies[point].axis.as_vec3(),
        }
    }

    /// The direction that belongs to a point of the unit square when directions are drawn as `point` weighs light: on a
    /// flat cell with density cos θ/π.
    #[inline]
    pub fn direction(&self, point: usize, at: [f32; 2]) -> Vec3 {
        match &self.facing {
            Facing::Plane => Stream::cosine_at(self.normal, at),
            Facing::Each(normals) => Stream::cosine_at(normals[point], at),
            Facing::Bodies(bodies) => bodies[point].direction(at),
        }
    }

    /// Whether a point has a surface within the tolerance.
    pub fn is_on_surface(&self, point: usize) -> bool {
        self.on_surface[point]
    }

    /// Where a point is, m: on its surface, if it has one. Cosines and distances are taken from here.
    pub fn place(&self, point: usize) -> DVec3 {
        match &self.exact {
            Exact::Each(places) => places[point],
            Exact::Plane { origin, axes: [u, v], heights } => {
                let [a, b] = self.points[point].map(f64::from);
                let height = heights.get(point).map_or(0.0, |height| f64::from(*height));
                // In the air rays start at the point itself, and aslant it can't be put on a surface exactly.
                if !self.on_surface[point] || height.is_nan() {
                    return self.starts[point].as_dvec3();
                }
                *origin + *u * a + *v * b + u.cross(*v) * height + self.moved(point).as_dvec3()
            }
        }
    }

    /// Where rays leave a point towards the measured side, m.
    pub fn start(&self, point: usize) -> Vec3 {
        self.starts[point]
    }

    /// How far off a point its rays start where it touches a wall, m.
    pub fn moved(&self, point: usize) -> Vec3 {
        self.moved.binary_search_by_key(&point, |(point, _)| *point).map_or(Vec3::ZERO, |at| self.moved[at].1)
    }

    /// A point, m, in the scene's coordinates.
    pub fn position(&self, point: usize) -> Vec3 {
        let [a, b] = self.points[point];
        self.origin + self.u * a + self.v * b
    }

    /// The grid cell that a place (plane coordinates) lies in; none off the grid.
    #[inline]
    pub fn cell_at(&self, at: [f32; 2]) -> Option<usize> {
        let [columns, rows] = self.grid?;
        let index = |axis: usize, count: usize| {
            let place = (at[axis] / self.cell[axis] + 0.5 * count as f32).floor();
            (0.0 <= place && place < count as f32).then_some(place as usize)
        };
        Some(index(1, rows)? * columns + index(0, columns)?)
    }

    /// Where a flight crosses the plane from the measured side, in plane coordinates, if it does so near the points.
    #[inline]
    pub(super) fn crossing(&self, flight: &Flight<'_>) -> Option<[f32; 2]> {
        let slope = flight.direction.dot(self.normal);
        if slope >= 0.0 {
            return None;
        }
        let from = flight.origin - self.origin;
        let start = from.dot(self.normal);
        if start <= self.tolerance {
            return None;
        }
        let at = match flight.hit {
            Some(hit) => {
                let to = hit.position - self.origin;
                let end = to.dot(self.normal);
                // What lands on the foot of a wall stays above the floor: it would count on both sides of a thin one.
                let steep = hit.normal.dot(self.normal).abs() < STEEP;
                if end > self.tolerance || (steep && end >= 0.0) {
                    return None;
                }
                if end >= 0.0 { to } else { from + (to - from) * (start / (start - end)) }
            }
            None => from + flight.direction * (-start / slope),
        };
        let at = [at.dot(self.u), at.dot(self.v)];
        let inside = |axis: usize| self.low[axis] <= at[axis] && at[axis] <= self.high[axis];
        (inside(0) && inside(1)).then_some(at)
    }
}

/// A surface within a quarter of a degree of a plane is parallel to it, by the cosine.
const PARALLEL: f32 = 0.99999;

/// Heights below this part of the coordinates are rounding, that of four operations in single precision.
const ROUNDING: f32 = 4.0 * f32::EPSILON;

/// Surfaces that lean more than 60° from a measuring plane are no floor of it, by the cosine.
const STEEP: f32 = 0.5;

/// How near a wall a point may be, and how far it is moved off, in the longest steps that rays start off surfaces.
const TOUCHING: f32 = 0.75;
const CLEAR: f32 = 2.0;

/// A start that lies in a wall as well, at the edge of a floor or where a sheet cuts through a grid, moved off that
/// wall: to the side where the floor goes on (`tolerance` is how far that may lie below, 0 in the air), or else where
/// another surface faces the wall. Half of what such a point sees lies in its wall's own plane, where rays slip by on
/// either side and shadows have no edge: it would get the light of both sides, or of none.
fn off_walls(start: Vec3, normal: Vec3, axes: [Vec3; 2], tolerance: f32, caster: &RayCaster) -> Vec3 {
    let step = caster.longest_step(start);
    let touched = |at: Vec3| {
        let across = |axis: &Vec3| caster.closest_hit(at - *axis * (TOUCHING * step), *axis, 2.0 * TOUCHING * step);
        axes.iter().find_map(across)
    };
    let mut at = start;
    // As many walls as meet in a corner.
    for _ in 0..4 {
        let Some(wall) = touched(at) else { break };
        let side = wall.normal;
        let moved = |side: Vec3| at + side * (CLEAR * step - (at - wall.position).dot(side));
        let is_inside = |side: Vec3| {
            let beside = moved(side);
            let floor = tolerance > 0.0 && caster.is_occluded(beside, -normal, tolerance);
            u8::from(floor) + u8::from(caster.is_occluded(beside, side, f32::INFINITY))
        };
        at = if is_inside(side) >= is_inside(-side) { moved(side) } else { moved(-side) };
    }
    at
}

/// Photons stored for one query structure: positions (m) and flux (lm), side by side.
#[derive(Clone, Debug)]
pub struct Photons<const C: usize> {
    /// Where they crossed or landed.
    pub positions: Vec<[f32; 3]>,
    /// What they carry.
    pub flux: Vec<Flux<C>>,
}

impl<const C: usize> Default for Photons<C> {
    fn default() -> Self {
        Self { positions: Vec::new(), flux: Vec::new() }
    }
}

impl<const C: usize> Photons<C> {
    #[inline]
    fn push(&mut self, position: [f32; 3], flux: Flux<C>) {
        self.positions.push(position);
        self.flux.push(flux);
    }

    /// Moves the photons of `other` behind these.
    pub fn append(&mut self, other: &mut Self) {
        self.positions.append(&mut other.positions);
        self.flux.append(&mut other.flux);
    }
}

/// The photons that crossed one receiver, in plane coordinates (third coordinate 0).
///
/// Light that met no diffuse surface has edges (shadows, caustics) and wants few, near photons; diffused light is
/// smooth and takes many. So they are kept apart.
#[derive(Clone, Debug)]
pub struct Crossings<const C: usize> {
    /// Direct light and caustics.
    pub sharp: Photons<C>,
    /// Light that met a diffuse surface, or was spread by rough mirrors.
    pub smooth: Photons<C>,
    /// Luminaires of the sharp and the smooth photons, where they matter; else none.
    pub sources: [Vec<u32>; 2],
}

impl<const C: usize> Default for Crossings<C> {
    fn default() -> Self {
        Self { sharp: Photons::default(), smooth: Photons::default(), sources: Default::default() }
    }
}

impl<const C: usize> Crossings<C> {
    /// Whether there is no photon.
    pub fn is_empty(&self) -> bool {
        self.sharp.positions.is_empty() && self.smooth.positions.is_empty()
    }

    /// Moves the photons of `other` behind these.
    pub fn append(&mut self, other: &mut Self) {
        self.sharp.append(&mut other.sharp);
        self.smooth.append(&mut other.smooth);
        self.sources.iter_mut().zip(&mut other.sources).for_each(|(all, part)| all.append(part));
    }
}

/// Which photons are kept, by what they have met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// All of them.
    All,
    /// All but direct light.
    Bounced,
    /// Those that came by mirrors and glass only.
    Caustics,
    /// What rays from a point find: those that met a diffuse surface, or rough mirrors only.
    FoundByRays,
}

impl Keep {
    /// Whether a photon of this history is kept.
    #[inline]
    pub fn keeps(self, history: History) -> bool {
        match self {
            Self::All => true,
            Self::Bounced => history != History::Direct,
            Self::Caustics => history == History::Specular,
            Self::FoundByRays => matches!(history, History::Diffused | History::Glossy),
        }
    }
}

/// Keeps the photons that cross the receivers, and none else.
pub struct CrossingRecorder<'a, const C: usize> {
    receivers: &'a [&'a Receiver],
    keep: Keep,
    /// Whether luminaires matter.
    sources: bool,
    crossings: Vec<Crossings<C>>,
}

impl<'a, const C: usize> CrossingRecorder<'a, C> {
    /// An empty record for `receivers`.
    pub fn new(receivers: &'a [&'a Receiver], keep: Keep) -> Self {
        Self { receivers, keep, sources: false, crossings: vec![Crossings::default(); receivers.len()] }
    }

    /// The same, which keeps the luminaires too, if they matter.
    pub fn with_sources(self, matter: bool) -> Self {
        Self { sources: matter, ..self }
    }

    /// One record out of many, in order.
    pub fn merge(records: Vec<Self>) -> Vec<Crossings<C>> {
        let count = records.first().map_or(0, |record| record.crossings.len());
        let mut merged = vec![Crossings::default(); count];
        for mut record in records {
            merged.iter_mut().zip(&mut record.crossings).for_each(|(all, part)| all.append(part));
        }
        merged
    }
}

impl<const C: usize> Recorder<C> for CrossingRecorder<'_, C> {
    #[inline]
    fn record(&mut self, flight: &Flight<'_>, flux: Flux<C>) {
        if !self.keep.keeps(flight.history) {
            return;
        }
        for (receiver, crossings) in self.receivers.iter().zip(&mut self.crossings) {
            let smooth = matches!(flight.history, History::Diffused | History::Glossy);
            if receiver.cells_count && !smooth && self.keep != Keep::FoundByRays {
                continue;
            }
            if let Some([a, b]) = receiver.crossing(flight) {
                let kept = if smooth { &mut crossings.smooth } else { &mut crossings.sharp };
                kept.push([a, b, 0.0], flux);
                if self.sources {
                    crossings.sources[usize::from(smooth)].push(flight.luminaire);
                }
            }
        }
    }
}

/// Keeps every photon that lands on an opaque surface, as the paper does.
pub struct LandingRecorder<const C: usize>(Photons<C>);

impl<const C: usize> LandingRecorder<C> {
    /// An empty record.
    pub fn new() -> Self {
        Self(Photons::default())
    }

    /// One record out of many, in order.
    pub fn merge(records: Vec<Self>) -> Photons<C> {
        let mut merged = Photons::default();
        records.into_iter().for_each(|mut record| merged.append(&mut record.0));
        merged
    }
}

impl<const C: usize> Default for LandingRecorder<C> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const C: usize> Recorder<C> for LandingRecorder<C> {
    #[inline]
    fn record(&mut self, flight: &Flight<'_>, flux: Flux<C>) {
        // Embree's hits are finite; trees rely on it. (Crossings lie within the receiver's bounds.)
        if let (Some(hit), true) = (flight.hit, flight.lands)
            && hit.position.is_finite()
        {
            self.0.push(hit.position.to_array(), flux);
        }
    }
}

/// Both records at once: `seed` reads surfaces from landings and planes in the air from crossings.
impl<const C: usize, A: Recorder<C>, B: Recorder<C>> Recorder<C> for (A, B) {
    #[inline]
    fn record(&mut self, flight: &Flight<'_>, flux: Flux<C>) {
        self.0.record(flight, flux);
        self.1.record(flight, flux);
    }
}
