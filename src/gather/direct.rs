//! Direct light: closed form × visibility.
//!
//! What an unobstructed Lambertian polygon sends to a point is known exactly (Lambert's polygon formula), so only the
//! part of it that is visible has to be found by shadow rays, stratified over its area. A first pass of 2 × 2 rays finds
//! where shadows' edges run; there, and beside them, 6 × 6 rays measure.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

use super::receiver::Receiver;
use crate::embree::RayCaster;
use crate::luminaire::emit::{Front, triangle_area};
use crate::luminaire::{Distribution, Luminaire, Opening};
use crate::photon::flux::{channels, photometric};
use crate::photon::random::{Seed, Stream};

/// Shadow rays along each side of an opening: where it is seen whole or not at all, and at shadows' edges.
const COARSE: u32 = 2;
const FINE: u32 = 6;
/// Shadow rays along each side for single points, which have no neighbours to tell of a shadow's edge.
const SINGLE: u32 = 16;
/// Above this many triangles an emitting mesh is sampled as a whole instead of triangle by triangle.
const MOST_POLYGONS: usize = 64;
/// Samples of such a mesh for each point.
const MESH_SAMPLES: u32 = 256;
/// Corners of the polygon that stands for a disc of the same area.
const DISC_CORNERS: usize = 96;

/// Direct light at the points of a receiver.
#[derive(Clone, Debug)]
pub struct DirectLight<const C: usize> {
    /// E of each point in each channel, lx.
    pub value: Vec<[f64; C]>,
    /// Variance of the photometric E of each point, lx²: partly seen openings only.
    pub variance: Vec<f64>,
    /// Shadow rays cast.
    pub rays: u64,
}

/// A piece of a luminaire's opening that is treated as one.
enum Emitter {
    Point {
        position: DVec3,
        aim: DVec3,
        intensity: f64,
        distribution: Distribution,
    },
    /// A flat piece: outline, normal, luminance (cd/m²), and what samples it.
    Polygon {
        corners: Vec<DVec3>,
        normal: DVec3,
        luminance: f64,
        front: Front,
    },
    /// Many triangles, sampled by area.
    Mesh {
        front: Front,
        flux: f64,
    },
}

/// Direct illuminance of every point of `receiver` by all luminaires. `progress` hears one step a luminaire.
///
/// Error: none where an opening is seen whole or not at all (but for a gap or object so small that all rays of the
/// first pass and of the neighbours miss it); at shadows' edges one standard deviation is about n^(−3/4)/√6 = 2.8 % of
/// that luminaire's light with n = 36 rays. Cost: 4 rays for a point and luminaire, 40 at shadows' edges.
pub fn direct_light<const C: usize>(
    luminaires: &[Luminaire],
    receiver: &Receiver,
    caster: &RayCaster,
    seed: Seed,
    progress: impl Fn(u64) + Sync,
) -> DirectLight<C> {
    let mut total = DirectLight { value: vec![[0.0; C]; receiver.len()], variance: vec![0.0; receiver.len()], rays: 0 };
    for (index, luminaire) in luminaires.iter().enumerate() {
        let colour = channels::<C>(luminaire.colour);
        let brightness = photometric(colour);
        for (part, emitter) in emitters(luminaire).iter().enumerate() {
            let shadows = Shadows { receiver, caster, seed: seed.branch(((index as u64) << 32) + part as u64) };
            let (found, rays) = shadows.illuminance(emitter);
            total.rays += rays;
            for ((value, variance), (lux, spread)) in total.value.iter_mut().zip(&mut total.variance).zip(found) {
                for (sum, share) in value.iter_mut().zip(colour) {
                    *sum += share * lux;
                }
                *variance += spread * brightness * brightness;
            }
        }
        progress(1);
    }
    total
}

fn emitters(luminaire: &Luminaire) -> Vec<Emitter> {
    let flux = luminaire.flux.0;
    let pi = std::f64::consts::PI;
    let flat = |corners: Vec<DVec3>, normal: DVec3, area: f64, opening: Opening| Emitter::Polygon {
        corners,
        normal,
        luminance: flux / (pi * area),
        front: Front::new(&opening),
    };
    match &luminaire.opening {
        &Opening::Point { position, aim } => {
            let solid_angle = if luminaire.distribution == Distribution::Isotropic { 4.0 * pi } else { pi };
            let intensity = flux / solid_angle;
            vec![Emitter::Point { position, aim, intensity, distribution: luminaire.distribution }]
        }
        opening @ &Opening::Rectangle { centre, half_width, half_depth } => {
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(a, b)| centre + half_width * a + half_depth * b)
                .to_vec();
            let cross = half_width.cross(half_depth);
            vec![flat(corners, cross.normalize(), 4.0 * cross.length(), opening.clone())]
        }
        opening @ &Opening::Disc { centre, aim, radius } => {
            let (x, y) = aim.any_orthonormal_pair();
            let step = 2.0 * pi / DISC_CORNERS as f64;
            let rim = radius * (step / step.sin()).sqrt(); // equal areas: ½ n r² sin(2π/n) = π radius²
            let corners = (0..DISC_CORNERS)
                .map(|corner| centre + (x * (step * corner as f64).cos() + y * (step * corner as f64).sin()) * rim)
                .collect();
            vec![flat(corners, aim, pi * radius * radius, opening.clone())]
        }
        opening @ Opening::Triangles(triangles) => {
            let areas: Vec<f64> = triangles.iter().map(triangle_area).collect();
            let whole: f64 = areas.iter().sum();
            if triangles.len() > MOST_POLYGONS {
                return vec![Emitter::Mesh { front: Front::new(opening), flux }];
            }
            triangles
                .iter()
                .map(|&[a, b, c]| {
                    let normal = (b - a).cross(c - a).normalize();
                    flat(vec![a, b, c], normal, whole, Opening::Triangles(vec![[a, b, c]]))
                })
                .collect()
        }
    }
}

/// Illuminance per luminance at `point` with unit normal `normal` from a Lambertian polygon that is seen whole: Lambert's
/// formula, ½ Σ βᵢ (n · γᵢ) over the edges, βᵢ the angle an edge subtends and γᵢ the unit normal of its plane with the
/// point, after clipping at the point's horizon. Its unit is sr; times cd/m² it is lx.
pub fn projected_solid_angle(corners: &[DVec3], point: DVec3, normal: DVec3) -> f64 {
    let relative = |corner: &DVec3| *corner - point;
    let mut above: Vec<DVec3> = Vec::with_capacity(corners.len() + 2);
    for (i, corner) in corners.iter().enumerate() {
        let (a, b) = (relative(corner), relative(&corners[(i + 1) % corners.len()]));
        let (height_a, height_b) = (a.dot(normal), b.dot(normal));
        if height_a >= 0.0 {
            above.push(a);
        }
        if (height_a > 0.0 && height_b < 0.0) || (height_a < 0.0 && height_b > 0.0) {
            above.push(a + (b - a) * (height_a / (height_a - height_b)));
        }
    }
    let mut sum = 0.0;
    for (i, a) in above.iter().enumerate() {
        let b = above[(i + 1) % above.len()];
        let cross = a.cross(b);
        let length = cross.length();
        if length > 0.0 {
            sum += length.atan2(a.dot(b)) * cross.dot(normal) / length;
        }
    }
    0.5 * sum.abs()
}

/// Finds what of an emitter the points of a receiver see.
struct Shadows<'a> {
    receiver: &'a Receiver,
    caster: &'a RayCaster,
    seed: Seed,
}

/// What one set of shadow rays found of an opening.
#[derive(Clone, Copy, Debug)]
struct Seen {
    /// Visible share, weighted by what each ray would bring.
    share: f64,
    /// Rays that could bring light, and those of them that did.
    rays: u32,
    clear: u32,
}

impl Seen {
    fn mixed(&self) -> bool {
        0 < self.clear && self.clear < self.rays
    }
}

impl Shadows<'_> {
    /// (E, variance) of each point, lx and lx², and the rays that took.
    fn illuminance(&self, emitter: &Emitter) -> (Vec<(f64, f64)>, u64) {
        let points = 0..self.receiver.len();
        match emitter {
            Emitter::Point { position, aim, intensity, distribution } => {
                let lux = points.into_par_iter().map(|point| {
                    let start = self.receiver.start(point).as_dvec3();
                    let normal = self.receiver.normal.as_dvec3();
                    (self.point_light(start, normal, *position, *aim, *distribution) * intensity, 0.0)
                });
                (lux.collect(), self.receiver.len() as u64)
            }
            Emitter::Polygon { corners, normal, luminance, front } => {
                self.polygon_light(corners, *normal, *luminance, front)
            }
            Emitter::Mesh { front, flux } => {
                let lux = points.into_par_iter().map(|point| self.mesh_light(point, front, *flux));
                (lux.collect(), u64::from(MESH_SAMPLES) * self.receiver.len() as u64)
            }
        }
    }

    /// Illuminance per candela: cos θ / d², times the distribution, if nothing is in the way.
    fn point_light(&self, start: DVec3, normal: DVec3, position: DVec3, aim: DVec3, distribution: Distribution) -> f64 {
        let to = position - start;
        let distance = to.length();
        let direction = to / distance;
        let spread = match distribution {
            Distribution::Isotropic => 1.0,
            Distribution::Lambertian => (-direction.dot(aim)).max(0.0),
        };
        let per_candela = spread * direction.dot(normal).max(0.0) / (distance * distance);
        let blocked = || {
            let reach = (distance * (1.0 - 1e-5)) as f32; // short of what the luminaire may be mounted on
            self.caster.is_occluded(start.as_vec3(), direction.as_vec3(), reach)
        };
        if per_candela.is_finite() && per_candela > 0.0 && !blocked() { per_candela } else { 0.0 }
    }

    fn polygon_light(&self, corners: &[DVec3], normal: DVec3, luminance: f64, front: &Front) -> (Vec<(f64, f64)>, u64) {
        let rays = AtomicU64::new(0);
        let count = |seen: &Seen| rays.fetch_add(u64::from(seen.rays), Ordering::Relaxed);
        let up = self.receiver.normal.as_dvec3();
        // What each point would get from the whole opening; none from behind it.
        let unobstructed = |point: usize| {
            let at = self.receiver.start(point).as_dvec3();
            let in_front = (at - corners[0]).dot(normal) > 0.0;
            if in_front { luminance * projected_solid_angle(corners, at, up) } else { 0.0 }
        };
        let first: Vec<(f64, Seen)> = (0..self.receiver.len())
            .into_par_iter()
            .map(|point| {
                let lux = unobstructed(point);
                let side = if self.receiver.grid.is_some() { COARSE } else { SINGLE };
                let mut stream = self.seed.stream(point as u64);
                let seen = if lux > 0.0 {
                    self.look(point, front, side, &mut stream)
                } else {
                    Seen { share: 0.0, rays: 0, clear: 0 }
                };
                count(&seen);
                (lux, seen)
            })
            .collect();
        let found = (0..self.receiver.len())
            .into_par_iter()
            .map(|point| {
                let (lux, mut seen) = first[point];
                if lux > 0.0 && self.at_shadow_edge(point, &first) {
                    let mut stream = self.seed.branch(1).stream(point as u64);
                    seen = self.look(point, front, FINE, &mut stream);
                    count(&seen);
                }
                // A shadow's edge crosses about √n of n strata, each of variance 1/6 on average over its position.
                let spread = if seen.mixed() { f64::from(seen.rays).powf(-1.5) / 6.0 } else { 0.0 };
                (lux * seen.share, lux * lux * spread)
            })
            .collect();
        (found, rays.into_inner())
    }

    /// Whether the first pass saw a mixture at this grid point, or something else than at one of its eight neighbours.
    fn at_shadow_edge(&self, point: usize, first: &[(f64, Seen)]) -> bool {
        let Some([columns, rows]) = self.receiver.grid else { return false };
        let here = first[point].1;
        let (column, row) = (point % columns, point / columns);
        here.mixed()
            || (row.saturating_sub(1)..(row + 2).min(rows)).any(|row| {
                (column.saturating_sub(1)..(column + 2).min(columns)).any(|column| {
                    let (_, there) = first[row * columns + column];
                    there.rays > 0 && (there.mixed() || (there.clear == 0) != (here.clear == 0))
                })
            })
    }

    /// Casts side × side shadow rays to jittered strata of an opening.
    fn look(&self, point: usize, front: &Front, side: u32, stream: &mut Stream) -> Seen {
        let start = self.receiver.start(point);
        let up = self.receiver.normal;
        let (mut whole, mut visible) = (0.0_f64, 0.0_f64);
        let (mut rays, mut clear) = (0, 0);
        for stratum in 0..side * side {
            let [a, b] = stream.uniform_pair();
            let at = [(stratum % side) as f32 + a, (stratum / side) as f32 + b];
            let (target, facing) = front.point_off(0.0, at.map(|x| x / side as f32), start, self.caster);
            let to = target - start;
            let distance = to.length();
            let direction = to / distance;
            let weight = direction.dot(up).max(0.0) * (-direction.dot(facing)).max(0.0) / (distance * distance);
            if !(weight > 0.0 && weight.is_finite()) {
                continue;
            }
            rays += 1;
            whole += f64::from(weight);
            if !self.caster.is_occluded(start, direction, distance) {
                clear += 1;
                visible += f64::from(weight);
            }
        }
        // All strata below the horizon or edge-on: the sliver the closed form still sees is taken as visible.
        Seen { share: if whole > 0.0 { visible / whole } else { 1.0 }, rays, clear }
    }

    /// (E, variance) at a point from an emitting mesh: the mean of samples stratified by area.
    fn mesh_light(&self, point: usize, front: &Front, flux: f64) -> (f64, f64) {
        let start: Vec3 = self.receiver.start(point);
        let mut stream = self.seed.stream(point as u64);
        let (mut sum, mut squares) = (0.0, 0.0);
        let count = f64::from(MESH_SAMPLES);
        for sample in 0..MESH_SAMPLES {
            let choice = (sample as f32 + stream.uniform()) / MESH_SAMPLES as f32;
            let (target, normal) = front.point_off(choice, stream.uniform_pair(), start, self.caster);
            let to = target - start;
            let distance = to.length();
            let direction = to / distance;
            let weight = direction.dot(self.receiver.normal).max(0.0) * (-direction.dot(normal)).max(0.0)
                / (distance * distance);
            if weight > 0.0 && weight.is_finite() && !self.caster.is_occluded(start, direction, distance) {
                let lux = f64::from(weight) * flux / std::f64::consts::PI;
                sum += lux;
                squares += lux * lux;
            }
        }
        let mean = sum / count;
        (mean, (squares / count - mean * mean).max(0.0) / (count - 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An element opposite a corner of a parallel rectangle: Howell's configuration factor C-11, times π.
    #[test]
    fn polygon_formula_matches_the_configuration_factor_of_a_parallel_rectangle() {
        for (a, b, c) in [(1.0_f64, 1.0_f64, 1.0_f64), (0.5, 0.5, 3.0), (10.0, 0.1, 0.2), (1e3, 1e3, 1.0)] {
            let corners = [DVec3::new(0.0, 0.0, c), DVec3::new(a, 0.0, c), DVec3::new(a, b, c), DVec3::new(0.0, b, c)];
            let (x, y) = (a / c, b / c);
            let term = |x: f64, y: f64| x / (1.0 + x * x).sqrt() * (y / (1.0 + x * x).sqrt()).atan();
            let expected = 0.5 * (term(x, y) + term(y, x));
            let found = projected_solid_angle(&corners, DVec3::ZERO, DVec3::Z);
            assert!((found / expected - 1.0).abs() < 1e-12, "{a} × {b} at {c}: {found}, expected {expected}");
        }
    }

    /// The part of an opening below the point's horizon brings nothing: half of a rectangle that stands across it is
    /// Howell's C-12 (an element perpendicular to the rectangle's plane), times π, on either side.
    #[test]
    fn the_part_below_the_horizon_is_clipped() {
        let (a, b, c) = (2.0_f64, 3.0_f64, 1.5_f64); // height above the horizon, width, distance
        let corners = [DVec3::new(c, 0.0, -7.0), DVec3::new(c, b, -7.0), DVec3::new(c, b, a), DVec3::new(c, 0.0, a)];
        let (x, y) = (a / b, c / b);
        let root = (x * x + y * y).sqrt();
        let expected = 0.5 * ((1.0 / y).atan() - y / root * (1.0 / root).atan());
        let found = projected_solid_angle(&corners, DVec3::ZERO, DVec3::Z);
        assert!((found / expected - 1.0).abs() < 1e-12, "{found}, expected {expected}");
    }
}
