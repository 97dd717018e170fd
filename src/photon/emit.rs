//! Photons leave the luminaires, shared among them by their flux.

use glam::{DVec3, Vec3};

use crate::embree::{Hit, RayCaster};
use crate::flux::{Flux, channels};
use crate::geometry::body::Body;
use crate::luminaire::{Distribution, Luminaire, Opening, drawn_shares};
use crate::random::Stream;

/// All luminaires of a scene, ready to emit the photons of one pass.
pub struct Emission<'a, const C: usize> {
    luminaires: &'a [Luminaire],
    /// Running sum of the luminaires' shares of the photons, those of the flux but for faint ones; the last is 1.
    shares: Vec<f64>,
    /// What one photon of each luminaire carries.
    flux: Vec<Flux<C>>,
    fronts: Vec<Front>,
    /// The surface that a luminaire without extent lies on, if there is any.
    walls: Vec<Option<Hit>>,
    caster: &'a RayCaster,
}

/// A photon as it leaves its luminaire.
pub struct Emitted<const C: usize> {
    /// Start of its ray, m.
    pub origin: Vec3,
    /// Unit vector.
    pub direction: Vec3,
    /// What it carries.
    pub flux: Flux<C>,
    /// Number of its luminaire.
    pub luminaire: u32,
}

impl<'a, const C: usize> Emission<'a, C> {
    /// Prepares `photons` photons that carry equal luminous flux (less where a luminaire is much fainter than the
    /// others: see `drawn_shares`), to fly through what `caster` holds.
    pub fn new(luminaires: &'a [Luminaire], photons: u64, caster: &'a RayCaster) -> Self {
        let total: f64 = luminaires.iter().map(|luminaire| luminaire.flux.0).sum();
        let running = |sum: &mut f64, part: f64| {
            *sum += part;
            Some(*sum)
        };
        let drawn = drawn_shares(luminaires);
        let shares = drawn.iter().map(|(share, _)| *share).scan(0.0, running).collect();
        let each = total / photons as f64;
        let flux = luminaires
            .iter()
            .zip(&drawn)
            .map(|(luminaire, (_, times))| {
                Flux(channels::<C>(luminaire.colour).map(|channel| (channel * (each * times)) as f32))
            })
            .collect();
        let fronts = luminaires.iter().map(Front::of).collect();
        let walls = luminaires.iter().map(|luminaire| touched(&luminaire.opening, caster)).collect();
        Self { luminaires, shares, flux, fronts, walls, caster }
    }

    /// Start of a photon that leaves along `direction`: off the surface that a luminaire without extent lies on, to the
    /// side where it goes; there it would end as soon as it begins.
    #[inline]
    fn off_wall(&self, which: usize, origin: Vec3, direction: Vec3) -> Vec3 {
        self.walls[which].as_ref().map_or(origin, |wall| wall.leave(direction))
    }

    /// The photon whose place in the pass is `place` (0 ≤ place < 1): luminaires follow each other along it, each with
    /// its share of the flux. Equally spaced places so make a stratified choice, and rays that start together stay
    /// together in memory.
    #[inline]
    pub fn photon(&self, place: f64, stream: &mut Stream) -> Emitted<C> {
        let which = self.shares.partition_point(|&share| share <= place).min(self.luminaires.len() - 1);
        let front = &self.fronts[which];
        if let Distribution::Measured(measured) = &self.luminaires[which].distribution {
            let direction = measured.draw(stream);
            let origin = front.point_towards(direction, stream, self.caster);
            let origin = self.off_wall(which, origin, direction);
            return Emitted { origin, direction, flux: self.flux[which], luminaire: which as u32 };
        }
        let choice = if front.shares.len() > 1 { stream.uniform() } else { 0.0 };
        let at = if front.is_point() { [0.0; 2] } else { stream.uniform_pair() };
        let (origin, normal) = front.point_off(choice, at, Vec3::ZERO, self.caster);
        let direction = match self.luminaires[which].distribution {
            Distribution::Isotropic => stream.on_sphere(),
            Distribution::Lambertian | Distribution::Measured(_) => stream.cosine_about(normal),
        };
        let origin = self.off_wall(which, origin, direction);
        Emitted { origin, direction, flux: self.flux[which], luminaire: which as u32 }
    }
}

/// The surface that passes through an opening without extent, if there is any.
fn touched(opening: &Opening, caster: &RayCaster) -> Option<Hit> {
    let Opening::Point { position, .. } = opening else { return None };
    let at = position.as_vec3();
    let step = caster.longest_step(at);
    let across = |axis: &Vec3| caster.closest_hit(at - *axis * step, *axis, 2.0 * step);
    [Vec3::X, Vec3::Y, Vec3::Z].iter().find_map(across)
}

/// The front of an opening, ready to be sampled: rectangles, ellipses and points as they are, meshes and bodies
/// triangle by triangle.
pub struct Front {
    shape: PieceShape,
    /// Whether a flat opening shines from both sides.
    two_sided: bool,
    /// None for a body, whose pieces come from its canonical solid.
    pieces: Vec<Piece>,
    /// Running sums of the pieces' areas as shares of the whole.
    shares: Vec<f32>,
}

/// How the unit square is laid over a piece.
#[derive(Clone, Copy, PartialEq)]
enum PieceShape {
    Point,
    Square,
    Disc,
    Triangle,
    Body(Body),
}

/// A flat piece: origin, two sides, the unit normal and the largest coordinate of its corners, m.
#[derive(Clone, Copy)]
struct Piece {
    origin: Vec3,
    sides: [Vec3; 2],
    normal: Vec3,
    largest_coordinate: f32,
}

impl Front {
    /// Prepares the opening of a luminaire.
    pub fn of(luminaire: &Luminaire) -> Self {
        let two_sided = luminaire.measured().is_some() && luminaire.opening.flat().is_some();
        Self { two_sided, ..Self::new(&luminaire.opening) }
    }

    /// Prepares an opening that shines from its front.
    pub fn new(opening: &Opening) -> Self {
        let piece = |origin: DVec3, a: DVec3, b: DVec3, normal: DVec3| Piece {
            origin: origin.as_vec3(),
            sides: [a.as_vec3(), b.as_vec3()],
            normal: normal.as_vec3(),
            largest_coordinate: [origin, origin + a, origin + b, origin + a + b]
                .map(|corner| corner.abs().max_element() as f32)
                .into_iter()
                .fold(0.0, f32::max),
        };
        let (shape, pieces) = match opening {
            Opening::Point { position, aim } => {
                (PieceShape::Point, vec![piece(*position, DVec3::ZERO, DVec3::ZERO, *aim)])
            }
            Opening::Rectangle { centre, half_width, half_depth } => {
                let normal = half_width.cross(*half_depth).normalize();
                let corner = *centre - *half_width - *half_depth;
                (PieceShape::Square, vec![piece(corner, *half_width * 2.0, *half_depth * 2.0, normal)])
            }
            Opening::Disc { centre, aim, radius } => {
                let (x, y) = aim.any_orthonormal_pair();
                (PieceShape::Disc, vec![piece(*centre, x * *radius, y * *radius, *aim)])
            }
            Opening::Ellipse { centre, half_width, half_depth } => {
                let normal = half_width.cross(*half_depth).normalize();
                (PieceShape::Disc, vec![piece(*centre, *half_width, *half_depth, normal)])
            }
            Opening::Body(body) => (PieceShape::Body(*body), Vec::new()),
            Opening::Triangles(triangles) => {
                let of = |&[a, b, c]: &[DVec3; 3]| piece(a, b - a, c - a, (b - a).cross(c - a).normalize_or_zero());
                (PieceShape::Triangle, triangles.iter().map(of).collect())
            }
        };
        let areas: Vec<f64> = match opening {
            Opening::Triangles(triangles) => triangles.iter().map(triangle_area).collect(),
            Opening::Body(body) => body.triangles().map(|triangle| triangle_area(&triangle)).collect(),
            _ => vec![1.0],
        };
        let whole: f64 = areas.iter().sum();
        let shares = areas.iter().scan(0.0, |sum, area| {
            *sum += area / whole;
            Some(*sum as f32)
        });
        Self { shape, two_sided: false, pieces, shares: shares.collect() }
    }

    /// Number of flat pieces.
    pub fn pieces(&self) -> usize {
        self.shares.len()
    }

    /// Whether the opening has no extent.
    pub fn is_point(&self) -> bool {
        self.shape == PieceShape::Point
    }

    /// A point of the opening, m, and its unit normal there: equal areas of the unit square give equal areas of a
    /// piece; `choice` (0 … 1) picks the piece by its area. The point is the start of a ray or, seen from `eye` (m),
    /// its end: off the opening on the side of its front, where it has a surface. Where the ray starts here, `eye` is
    /// zero.
    #[inline]
    pub fn point_off(&self, choice: f32, at: [f32; 2], eye: Vec3, caster: &RayCaster) -> (Vec3, Vec3) {
        let which = if self.pieces.len() == 1 { 0 } else { self.shares.partition_point(|&share| share <= choice) };
        self.point_of(which.min(self.shares.len() - 1), at, eye, caster)
    }

    /// The same for an opening that may shine from both sides: off the one that `eye` sees.
    #[inline]
    pub fn point_seen(&self, choice: f32, at: [f32; 2], eye: Vec3, caster: &RayCaster) -> (Vec3, Vec3) {
        let (point, normal) = self.point_off(choice, at, eye, caster);
        if self.two_sided && (eye - point).dot(normal) < 0.0 {
            return self.on_back(point, normal, eye, caster);
        }
        (point, normal)
    }

    /// From just off the front of a flat opening to just off its back.
    fn on_back(&self, point: Vec3, normal: Vec3, eye: Vec3, caster: &RayCaster) -> (Vec3, Vec3) {
        let largest = self.pieces[0].largest_coordinate.max(eye.abs().max_element());
        let on_it = caster.step_off(point, -normal, largest);
        (caster.step_off(on_it, -normal, largest), -normal)
    }

    /// Start of a ray (m) that leaves along `direction`, uniform in the area of the opening seen from there.
    #[inline]
    fn point_towards(&self, direction: Vec3, stream: &mut Stream, caster: &RayCaster) -> Vec3 {
        if let PieceShape::Body(body) = &self.shape {
            return off_body(body, body.point_seen(direction.as_dvec3(), stream), Vec3::ZERO, caster).0;
        }
        let at = if self.is_point() { [0.0; 2] } else { stream.uniform_pair() };
        let (point, normal) = self.point_of(0, at, Vec3::ZERO, caster);
        if self.two_sided && direction.dot(normal) < 0.0 {
            return self.on_back(point, normal, Vec3::ZERO, caster).0;
        }
        point
    }

    /// The same for a given piece.
    #[inline]
    pub fn point_of(&self, piece: usize, [u, v]: [f32; 2], eye: Vec3, caster: &RayCaster) -> (Vec3, Vec3) {
        if let PieceShape::Body(body) = &self.shape {
            let (point, normal) = off_body(body, body.point_of_facet(piece, [u, v]), eye, caster);
            return (point, normal.as_vec3());
        }
        let Piece { origin, sides: [a, b], normal, largest_coordinate } = self.pieces[piece];
        let [s, t] = match self.shape {
            PieceShape::Point => [0.0; 2],
            PieceShape::Square => [u, v],
            PieceShape::Disc => concentric_disc([u, v]),
            PieceShape::Triangle | PieceShape::Body(_) => [u.sqrt() * (1.0 - v), u.sqrt() * v],
        };
        let point = origin + a * s + b * t;
        if self.is_point() {
            return (point, normal);
        }
        (caster.step_off(point, normal, largest_coordinate.max(eye.abs().max_element())), normal)
    }
}

/// From a point of a body's surface, m, to just off it, with the unit normal there. `eye` (m) is the other end of the
/// ray if it does not start here, else zero.
pub(crate) fn off_body(body: &Body, (point, normal): (DVec3, DVec3), eye: Vec3, caster: &RayCaster) -> (Vec3, DVec3) {
    let largest = (body.centre.abs() + DVec3::splat(body.radius())).max_element() as f32;
    (caster.step_off(point.as_vec3(), normal.as_vec3(), largest.max(eye.abs().max_element())), normal)
}

/// Area of a triangle, m².
pub fn triangle_area(&[a, b, c]: &[DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

/// The unit square onto the unit disc: equal areas stay equal, squares about the middle become circles
/// (Shirley & Chiu 1997).
fn concentric_disc([u, v]: [f32; 2]) -> [f32; 2] {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if a == 0.0 && b == 0.0 {
        return [0.0; 2];
    }
    let quarter = std::f32::consts::FRAC_PI_4;
    let (radius, angle) =
        if a.abs() > b.abs() { (a, quarter * (b / a)) } else { (b, 2.0 * quarter - quarter * (a / b)) };
    [radius * angle.cos(), radius * angle.sin()]
}
