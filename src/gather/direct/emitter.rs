//! Luminaires as direct light takes them: points, flat polygons, bodies, and meshes too fine to be taken piece by
//! piece.

use glam::{DVec3, Vec3};
use std::f64::consts::PI;
use std::ops::Range;

use super::blockers::{AxisBox, Blockers};
use super::polygon::{ConvexPieces, lambert};
use super::web::{SeenShape, WebLight, WebParts, most_towards};
use crate::embree::RayCaster;
use crate::flux::{channels, photometric};
use crate::gather::JUST_BEFORE;
use crate::geometry::body::Body;
use crate::luminaire::web::Measured;
use crate::luminaire::{Distribution, Luminaire, Opening};
use crate::photon::emit::{Front, triangle_area};
use crate::random::Stream;
use crate::units::luminance;

/// Strata of an emitting mesh for each point; two samples in each.
pub(super) const MESH_STRATA: u32 = 64;

/// Above this many triangles an emitting mesh is sampled as a whole instead of triangle by triangle.
pub(crate) const MAX_POLYGONS: usize = 256;
/// Corners of the polygon that stands for a disc of the same area.
const DISC_CORNERS: usize = 96;

/// A piece of a luminaire that is treated as one.
pub(super) struct EmittingPiece<const C: usize> {
    pub(super) source: LightSource,
    pub(super) bounds: AxisBox,
    /// What one lux of it counts in each channel.
    pub(super) colour: [f64; C],
    /// Photometric value of the colour.
    pub(super) brightness: f64,
    /// Number of its luminaire.
    pub(super) luminaire: u32,
}

impl<const C: usize> EmittingPiece<C> {
    /// Illuminance in each channel of what arrives as so much red, green and blue light (lx) if it were white.
    pub(super) fn tinted(&self, lux: [f64; 3]) -> [f64; C] {
        if C == 1 {
            return self.colour.map(|channel| channel * grey(lux));
        }
        std::array::from_fn(|c| self.colour[c] * lux[c])
    }
}

pub(super) enum LightSource {
    Point(PointSource),
    Polygon(Polygon),
    Body(BodySource),
    Mesh(MeshSource),
}

pub(super) struct PointSource {
    position: DVec3,
    aim: DVec3,
    /// Flux, lm.
    flux: f64,
    /// Along the aim, if it isn't measured, cd.
    intensity: f64,
    distribution: Distribution,
}

/// How an opening is bright.
pub(super) enum OpeningLight {
    /// The same luminance towards all directions, cd/m².
    Lambertian(f64),
    Web(WebLight),
}

/// A flat convex opening.
pub(super) struct Polygon {
    /// Counter-clockwise, seen from where light goes.
    pub(super) corners: Vec<DVec3>,
    pub(super) normal: DVec3,
    pub(super) light: OpeningLight,
    pub(super) front: Front,
    /// m².
    pub(super) area: f64,
    /// Whether points in its plane see it: intensity measured in that direction is of something that is not quite flat.
    pub(super) edge_on: bool,
}

/// A convex body.
pub(super) struct BodySource {
    pub(super) body: Body,
    pub(super) light: OpeningLight,
    /// Its triangles in the scene's mesh.
    pub(super) own: Range<u32>,
}

/// Many small triangles.
pub(super) struct MeshSource {
    triangles: Vec<Facet>,
    luminance: f64,
    front: Front,
}

struct Facet {
    bounds: AxisBox,
    normal: DVec3,
    height: f64,
    area: f64,
}

pub(super) fn emitters<const C: usize>(luminaires: &[Luminaire]) -> Vec<EmittingPiece<C>> {
    luminaires
        .iter()
        .enumerate()
        .flat_map(|(number, luminaire)| {
            let colour = channels::<C>(luminaire.colour);
            sources(luminaire).into_iter().map(move |source| {
                let bounds = match &source {
                    LightSource::Point(point) => AxisBox::around_exact([point.position]),
                    LightSource::Polygon(polygon) => AxisBox::around_exact(polygon.corners.iter().copied()),
                    LightSource::Body(body) => AxisBox::around_exact(body.body.bounds()),
                    LightSource::Mesh(mesh) => {
                        AxisBox::around(mesh.triangles.iter().flat_map(|f| [f.bounds.low, f.bounds.high]))
                    }
                };
                EmittingPiece { source, bounds, colour, brightness: photometric(colour), luminaire: number as u32 }
            })
        })
        .collect()
}

/// The pieces of a luminaire that are each treated as one.
fn sources(luminaire: &Luminaire) -> Vec<LightSource> {
    let flux = luminaire.flux.0;
    match &luminaire.opening {
        &Opening::Point { position, aim } => vec![LightSource::Point(point_source(luminaire, position, aim))],
        opening @ &Opening::Rectangle { centre, half_width, half_depth } => {
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(a, b)| centre + half_width * a + half_depth * b)
                .to_vec();
            if let Some(measured) = luminaire.measured() {
                let turned = Opening::Rectangle { centre, half_width: half_depth, half_depth: half_width };
                return both_sides(measured, flux, corners, [opening, &turned]);
            }
            let cross = half_width.cross(half_depth);
            vec![lambertian(flux, corners, cross.normalize(), [4.0 * cross.length(); 2], opening.clone())]
        }
        opening @ &Opening::Disc { centre, aim, radius } => {
            let (x, y) = aim.any_orthonormal_pair();
            let y = y * x.cross(y).dot(aim).signum();
            let corners = rim(centre, x, y, radius);
            if let Some(measured) = luminaire.measured() {
                let turned = Opening::Disc { centre, aim: -aim, radius };
                return both_sides(measured, flux, corners, [opening, &turned]);
            }
            vec![lambertian(flux, corners, aim, [PI * radius * radius; 2], opening.clone())]
        }
        opening @ &Opening::Ellipse { centre, half_width, half_depth } => {
            let corners = rim(centre, half_width, half_depth, 1.0);
            if let Some(measured) = luminaire.measured() {
                let turned = Opening::Ellipse { centre, half_width: half_depth, half_depth: half_width };
                return both_sides(measured, flux, corners, [opening, &turned]);
            }
            let cross = half_width.cross(half_depth);
            vec![lambertian(flux, corners, cross.normalize(), [PI * cross.length(); 2], opening.clone())]
        }
        &Opening::Body(body) => vec![LightSource::Body(body_source(luminaire, body))],
        opening @ Opening::Triangles(triangles) => mesh_sources(flux, opening, triangles),
    }
}

/// A luminaire without extent.
fn point_source(luminaire: &Luminaire, position: DVec3, aim: DVec3) -> PointSource {
    let flux = luminaire.flux.0;
    let intensity = match &luminaire.distribution {
        Distribution::Isotropic => flux / (4.0 * PI),
        Distribution::Lambertian => flux / PI,
        Distribution::Measured(_) => 0.0,
    };
    PointSource { position, aim, flux, intensity, distribution: luminaire.distribution.clone() }
}

/// A luminaire that is a convex body.
fn body_source(luminaire: &Luminaire, body: Body) -> BodySource {
    let flux = luminaire.flux.0;
    let light = match luminaire.measured() {
        Some(measured) => {
            let most = flux * measured.web().most();
            OpeningLight::Web(WebLight::new(measured, flux, most, SeenShape::Body(body)))
        }
        None => OpeningLight::Lambertian(flux / (PI * body.surface())),
    };
    let own = match luminaire.body.as_slice() {
        [first, .., last] => *first..last + 1,
        _ => 0..0,
    };
    BodySource { body, light, own }
}

/// A flat Lambertian opening of some area, m²; `flux` (lm) is that of the luminaire, `whole` the area of all its
/// pieces.
fn lambertian(flux: f64, corners: Vec<DVec3>, normal: DVec3, [area, whole]: [f64; 2], opening: Opening) -> LightSource {
    let light = OpeningLight::Lambertian(flux / (PI * whole));
    LightSource::Polygon(Polygon { corners, normal, light, front: Front::new(&opening), area, edge_on: false })
}

/// A luminaire of triangles: each by itself, or all as one mesh if they are many.
fn mesh_sources(flux: f64, opening: &Opening, triangles: &[[DVec3; 3]]) -> Vec<LightSource> {
    let whole: f64 = triangles.iter().map(triangle_area).sum();
    let facing = |&[a, b, c]: &[DVec3; 3]| (b - a).cross(c - a).normalize_or_zero();
    if triangles.len() > MAX_POLYGONS {
        let facet = |triangle: &[DVec3; 3]| Facet {
            bounds: AxisBox::around_exact(*triangle),
            normal: facing(triangle),
            height: facing(triangle).dot(triangle[0]),
            area: triangle_area(triangle),
        };
        let triangles = triangles.iter().map(facet).collect();
        let (luminance, front) = (flux / (PI * whole), Front::new(opening));
        return vec![LightSource::Mesh(MeshSource { triangles, luminance, front })];
    }
    triangles
        .iter()
        .filter(|triangle| triangle_area(triangle) > 0.0)
        .map(|triangle| {
            let areas = [triangle_area(triangle), whole];
            lambertian(flux, triangle.to_vec(), facing(triangle), areas, Opening::Triangles(vec![*triangle]))
        })
        .collect()
}

/// Corners of a polygon that has the area of the ellipse with these half axes times `radius`.
fn rim(centre: DVec3, half_width: DVec3, half_depth: DVec3, radius: f64) -> Vec<DVec3> {
    let step = 2.0 * PI / DISC_CORNERS as f64;
    let rim = radius * (step / step.sin()).sqrt(); // equal areas: ½ n r² sin(2π/n) = π radius²
    (0..DISC_CORNERS)
        .map(|corner| {
            let angle = step * corner as f64;
            centre + (half_width * angle.cos() + half_depth * angle.sin()) * rim
        })
        .collect()
}

/// A flat opening as measured: its front, and its back where light leaves there; `openings` are the two.
fn both_sides(measured: &Measured, flux: f64, corners: Vec<DVec3>, openings: [&Opening; 2]) -> Vec<LightSource> {
    let mut turned = corners.clone();
    turned.reverse();
    let sides = [corners, turned].into_iter().zip(openings).enumerate();
    let side = |(index, (corners, opening)): (usize, (Vec<DVec3>, &Opening))| {
        let (area, normal) = opening.flat()?;
        let most = flux * measured.web().most_towards(measured.local(normal));
        let light = OpeningLight::Web(WebLight::new(measured, flux, most, SeenShape::flat(area, normal)));
        let front = Front::new(opening);
        let polygon = Polygon { corners, normal, light, front, area, edge_on: index == 0 };
        (most > 0.0).then_some(LightSource::Polygon(polygon))
    };
    sides.filter_map(side).collect()
}

impl OpeningLight {
    /// Illuminance (lx) at the origin from convex pieces of an opening, or of a body's outline, above the horizon;
    /// `whole` is what all of it brings, or 0 where that is to be found.
    pub(super) fn sum(&self, pieces: &ConvexPieces, up: DVec3, whole: f64, parts: &mut WebParts) -> f64 {
        match self {
            Self::Lambertian(luminance) => {
                luminance * pieces.iter().map(|piece| lambert(piece, up)).sum::<f64>().max(0.0)
            }
            Self::Web(web) => web.sum(pieces.iter(), up, whole, parts),
        }
    }

    /// The same for one piece that is all of it.
    pub(super) fn whole(&self, piece: &[DVec3], up: DVec3, parts: &mut WebParts) -> f64 {
        match self {
            Self::Lambertian(luminance) => luminance * lambert(piece, up).max(0.0),
            Self::Web(web) => web.sum(std::iter::once(piece), up, 0.0, parts),
        }
    }
}

impl BodySource {
    /// What the body, which is in a box, brings at most, lx, to points of another that see it under a cosine of at most
    /// `cosine`.
    ///
    /// Of luminance L it brings E ≤ πL, and E ≤ L cos S/d², S its surface. Measured, L ≤ I/A, A the smallest area seen,
    /// and E ≤ I cos/d² if all of it were seen in one direction; directions differ by ε ≤ r/d, which changes n · d by ε
    /// at most, so the area seen by ε S/2.
    fn most(&self, bounds: &AxisBox, points: &AxisBox, cosine: f64) -> f64 {
        let distance = bounds.distance(points);
        let per_square = cosine / (distance * distance);
        match &self.light {
            OpeningLight::Lambertian(luminance) => luminance * (self.body.surface() * per_square).min(PI),
            OpeningLight::Web(web) => {
                let least = self.body.least_projected_area();
                let spread = 0.5 * self.body.surface() * self.body.radius() / distance;
                let whole = if spread < least { (least + spread) / (least - spread) } else { f64::INFINITY };
                web.most(bounds, points) * (whole * per_square).min(PI / least)
            }
        }
    }
}

impl<const C: usize> EmittingPiece<C> {
    /// What the emitter brings to any point of a box at most if nothing is in the way, lx; `up` is the points' normal.
    pub(super) fn most(&self, points: &AxisBox, up: DVec3) -> f64 {
        let lux = match &self.source {
            LightSource::Point(point) => {
                let aim = (point.distribution == Distribution::Lambertian)
                    .then(|| (point.aim, point.aim.dot(point.position)));
                let candela = match &point.distribution {
                    Distribution::Measured(measured) => point.flux * most_towards(measured, &self.bounds, points),
                    _ => point.intensity,
                };
                times(candela, most_per_area(&self.bounds, aim, points, up))
            }
            LightSource::Polygon(polygon) => {
                let plane = (polygon.normal, polygon.normal.dot(polygon.corners[0]));
                match &polygon.light {
                    OpeningLight::Lambertian(luminance) => {
                        luminance * (polygon.area * most_per_area(&self.bounds, Some(plane), points, up)).min(PI)
                    }
                    OpeningLight::Web(_) if points.along(plane.0)[1] < plane.1 => 0.0,
                    OpeningLight::Web(web) => {
                        times(web.most(&self.bounds, points), most_per_area(&self.bounds, None, points, up))
                    }
                }
            }
            LightSource::Body(body) => {
                let cosine = cosine_above(&self.bounds, points, up);
                if cosine > 0.0 { body.most(&self.bounds, points, cosine) } else { 0.0 }
            }
            LightSource::Mesh(mesh) => {
                mesh.luminance * mesh.triangles.iter().map(|facet| facet.most(points, up)).sum::<f64>()
            }
        };
        lux * self.brightness
    }

    /// Height n · x of a flat opening's plane.
    pub(super) fn height(&self, normal: DVec3) -> f64 {
        match &self.source {
            LightSource::Polygon(polygon) => polygon.corners[0].dot(normal),
            _ => 0.0,
        }
    }
}

/// Photometric value of red, green and blue light: that of any channel, to the bit, where all are alike.
pub(super) fn grey(rgb: [f64; 3]) -> f64 {
    if rgb[0] == rgb[1] && rgb[1] == rgb[2] { rgb[0] } else { luminance(rgb) }
}

/// An intensity over squared distance, 0 where the intensity is, even at no distance.
fn times(candela: f64, per_square: f64) -> f64 {
    if candela > 0.0 { candela * per_square } else { 0.0 }
}

/// The largest cosine with `up` under which points of one box can see points of another.
fn cosine_above(shining: &AxisBox, points: &AxisBox, up: DVec3) -> f64 {
    let above = shining.along(up)[1] - points.along(up)[0];
    if above <= 0.0 { 0.0 } else { (above / shining.distance(points)).min(1.0) }
}

/// The most that cos θ cos θ' / d² can be between a box of points facing `up` and a box that shines, 1/m²; `plane` is
/// the shining side's normal and height, if it has any.
fn most_per_area(shining: &AxisBox, plane: Option<(DVec3, f64)>, points: &AxisBox, up: DVec3) -> f64 {
    let distance = shining.distance(points);
    let cosine = |height: f64| (height / distance).clamp(0.0, 1.0); // NaN for 0/0 only, and then the height is 0
    let above = shining.along(up)[1] - points.along(up)[0];
    let before = plane.map_or(f64::INFINITY, |(normal, height)| points.along(normal)[1] - height);
    if above <= 0.0 || before <= 0.0 {
        return 0.0;
    }
    cosine(above) * cosine(before) / (distance * distance)
}

impl Facet {
    /// Projected solid angle at most, sr.
    fn most(&self, points: &AxisBox, up: DVec3) -> f64 {
        (self.area * most_per_area(&self.bounds, Some((self.normal, self.height)), points, up)).min(PI)
    }
}

impl PointSource {
    /// Unobstructed illuminance, lx.
    pub(super) fn illuminance(&self, start: DVec3, normal: DVec3) -> f64 {
        let to = self.position - start;
        let distance = to.length();
        let direction = to / distance;
        let candela = match &self.distribution {
            Distribution::Isotropic => self.intensity,
            Distribution::Lambertian => self.intensity * (-direction.dot(self.aim)).max(0.0),
            Distribution::Measured(measured) => self.flux * measured.at(-direction),
        };
        let lux = candela * direction.dot(normal).max(0.0) / (distance * distance);
        if lux.is_finite() { lux } else { 0.0 }
    }

    /// Share of its light (red, green, blue) that passes what is in the way.
    pub(super) fn passed(&self, start: DVec3, caster: &RayCaster) -> [f64; 3] {
        let to = self.position - start;
        let distance = to.length();
        let reach = (distance * JUST_BEFORE) as f32;
        caster.transmittance(start.as_vec3(), (to / distance).as_vec3(), reach).map(f64::from)
    }
}

impl MeshSource {
    /// Running sum of what each triangle can bring to some points at most; false if none can bring anything.
    pub(super) fn shares(&self, points: &AxisBox, up: DVec3, shares: &mut Vec<f64>) -> bool {
        let mut sum = 0.0;
        shares.extend(self.triangles.iter().map(|facet| {
            sum += facet.most(points, up);
            sum
        }));
        sum > 0.0
    }

    /// E of red, green and blue light at a point, lx, and the variance of their photometric sum, lx²: the mean of
    /// samples spread over the triangles by `shares`, two a stratum so that their variance is estimated without bias.
    pub(super) fn sample(
        &self,
        start: Vec3,
        normal: Vec3,
        shares: &[f64],
        blockers: &Blockers<'_>,
        stream: &mut Stream,
    ) -> ([f64; 3], f64) {
        let whole = shares[shares.len() - 1];
        let strata = f64::from(MESH_STRATA);
        let mut cast = |stratum: u32| {
            let choice = whole * (f64::from(stratum) + f64::from(stream.uniform())) / strata;
            let which = shares.partition_point(|&share| share <= choice).min(shares.len() - 1);
            let share = shares[which] - if which > 0 { shares[which - 1] } else { 0.0 };
            let (target, facing) = self.front.point_of(which, stream.uniform_pair(), start, blockers.caster);
            let to = target - start;
            let distance = to.length();
            let direction = to / distance;
            let weight = direction.dot(normal).max(0.0) * (-direction.dot(facing)).max(0.0) / (distance * distance);
            let counts = weight > 0.0 && weight.is_finite() && share > 0.0;
            if !counts {
                return [0.0; 3];
            }
            let lux = self.luminance * f64::from(weight) * self.triangles[which].area * whole / share;
            blockers.caster.transmittance(start, direction, distance).map(|passed| f64::from(passed) * lux)
        };
        let (mut sum, mut squares) = ([0.0; 3], 0.0);
        for stratum in 0..MESH_STRATA {
            let (a, b) = (cast(stratum), cast(stratum));
            (0..3).for_each(|c| sum[c] += a[c] + b[c]);
            squares += grey([0, 1, 2].map(|c| a[c] - b[c])).powi(2);
        }
        (sum.map(|sum| sum / (2.0 * strata)), squares / (4.0 * strata * strata))
    }
}
