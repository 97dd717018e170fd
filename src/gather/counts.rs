//! Photons counted where they are met: in cells of measuring planes, on samples of measured surfaces, and near measured
//! bodies.
//!
//! Illuminance is flux over area. A cell or a sample of a surface has an area, so the photons that cross it or land on
//! it are all that is needed: no search, no blur, no edge to correct, no light from behind. In cells light with edges
//! is counted, direct light and caustics; light that met a diffuse surface is smooth enough for a search over a wider
//! disc. A body gets the light that passes it: a flight closer than R, seen end on, crosses a disc of π R² about the
//! body, and counts by the body's kernel.

use std::io;

use glam::{DVec3, Vec3};

use super::cell_counts::Cells;
use super::density::Estimate;
use super::meter::MeasuredBody;
use super::receiver::{Keep, Receiver};
use crate::embree::RayCaster;
use crate::flux::{Flux, photometric};
use crate::geometry::Mesh;
use crate::luminaire::LightGroups;
use crate::photon::trace::{Flight, History, Recorder};
use crate::random::{Seed, Stream};
use crate::scene::MeasuredSurface;
use crate::state::Sum;
use crate::state::tape::Tape;

/// Rays that find the nearest surface about a body, whose disc must not reach it.
const RAYS: u64 = 256;
/// Part of that distance that the disc may have: the nearest point of a surface lies between rays.
const CLEARANCE: f32 = 0.9;

/// What photons brought to each point of a receiver.
pub struct Counts<const C: usize> {
    /// Σ φ, lm, and Σ φ² of the photometric flux, of each point.
    sums: Vec<([Sum; C], Sum)>,
    /// m².
    areas: Vec<f64>,
    /// Numbers in a row of light groups; 0 where they are not kept apart.
    width: usize,
    /// Rows of Σ φ, lm, of each point by light group.
    groups: Vec<Sum>,
}

impl<const C: usize> Counts<C> {
    /// None yet, of points that stand for these areas (m²), with rows of `width` numbers for light groups.
    pub fn new(areas: Vec<f64>, width: usize) -> Self {
        let groups = vec![Sum::ZERO; areas.len() * width];
        Self { sums: vec![([Sum::ZERO; C], Sum::ZERO); areas.len()], areas, width, groups }
    }

    /// Adds a photon; `groups` give the group of its luminaire.
    pub fn add(&mut self, met: &Met<C>, groups: Option<&LightGroups>) {
        let point = met.point as usize;
        let (sum, squares) = &mut self.sums[point];
        (0..C).for_each(|c| sum[c].add(f64::from(met.flux.0[c])));
        squares.add(photometric(met.flux.0.map(f64::from)).powi(2));
        if let (Some(groups), true) = (groups, self.width > 0) {
            let first = point * self.width + groups.group(met.luminaire) as usize * C;
            self.groups[first..][..C].iter_mut().zip(met.flux.0).for_each(|(sum, flux)| sum.add(f64::from(flux)));
        }
    }

    /// Writes its sums to `tape`, or reads them from it.
    pub fn exchange(&mut self, tape: &mut Tape<'_>) -> io::Result<()> {
        self.sums
            .iter_mut()
            .try_for_each(|(sum, squares)| sum.iter_mut().chain([squares]).try_for_each(|sum| tape.sum(sum)))?;
        tape.sums(&mut self.groups)
    }

    /// E of the light groups after `maps` sets of photons: a row of all for each point. None without groups.
    pub fn group_means(&self, maps: f64) -> Vec<f32> {
        let areas = self.areas.iter().flat_map(|area| std::iter::repeat_n(*area, self.width));
        let mean = |(sum, area): (&Sum, f64)| if area > 0.0 { (sum.value() / (maps * area)) as f32 } else { 0.0 };
        self.groups.iter().zip(areas).map(mean).collect()
    }

    /// Area of a point, m².
    pub fn area(&self, point: usize) -> f64 {
        self.areas[point]
    }

    /// E at a point after `maps` sets of photons, each of the luminaires' whole flux. Its variance is that of
    /// independent photons; with none it is 0 ± 0.
    pub fn estimate(&self, point: usize, maps: f64) -> Estimate<C> {
        let whole = maps * self.areas[point];
        if whole <= 0.0 {
            return Estimate::DARK;
        }
        let (sum, squares) = self.sums[point];
        Estimate { value: sum.map(|flux| flux.value() / whole), variance: squares.value() / (whole * whole) }
    }
}

/// What photons are watched for at one receiver.
pub enum Watched<'a> {
    /// Nothing: its light is known from other records.
    Nothing,
    /// Cells of a plane, where light has edges.
    Cells(Cells),
    /// Samples of a surface.
    Surface(&'a MeasuredSurface),
    /// Bodies, where they are, and the squares of their discs' radii, m².
    Bodies(Vec<(MeasuredBody, Vec3, f32)>),
}

impl Watched<'_> {
    /// Bodies at the points of a receiver; their discs have the radius `radius` (m), less where a surface is nearer.
    pub fn bodies(receiver: &Receiver, radius: f32, floor: f32, caster: &RayCaster) -> Self {
        let around = |(point, &body): (usize, &MeasuredBody)| {
            let at = receiver.start(point);
            let mut stream: Stream = Seed(0).stream(point as u64);
            let ends = (0..RAYS).filter_map(|_| caster.closest_hit(at, stream.on_sphere(), radius));
            let nearest = ends.map(|hit| CLEARANCE * hit.distance).fold(radius, f32::min).max(floor);
            (body, at, nearest * nearest)
        };
        Self::Bodies(receiver.bodies().iter().enumerate().map(around).collect())
    }

    /// What the discs' areas are, m².
    pub fn areas(&self) -> Vec<f64> {
        match self {
            Self::Nothing => Vec::new(),
            Self::Cells(cells) => cells.areas().to_vec(),
            Self::Surface(surface) => surface.samples.iter().map(|sample| sample.area()).collect(),
            Self::Bodies(bodies) => bodies.iter().map(|body| std::f64::consts::PI * f64::from(body.2)).collect(),
        }
    }
}

/// A photon where it is counted.
pub struct Met<const C: usize> {
    /// Number of the receiver.
    pub receiver: u32,
    /// Number of its point.
    pub point: u32,
    /// lm, by the kernel.
    pub flux: Flux<C>,
    /// Number of the luminaire that sent it.
    pub luminaire: u32,
}

/// Keeps the photons that are counted.
pub struct CountRecorder<'a, const C: usize> {
    watched: &'a [Watched<'a>],
    receivers: &'a [&'a Receiver],
    mesh: &'a Mesh,
    caster: &'a RayCaster,
    keep: Keep,
    met: Vec<Met<C>>,
}

impl<'a, const C: usize> CountRecorder<'a, C> {
    /// An empty record for what is `watched` at each receiver.
    pub fn new(
        watched: &'a [Watched<'a>],
        receivers: &'a [&'a Receiver],
        mesh: &'a Mesh,
        caster: &'a RayCaster,
        keep: Keep,
    ) -> Self {
        Self { watched, receivers, mesh, caster, keep, met: Vec::new() }
    }

    /// One record out of many, in order.
    pub fn merge(records: Vec<Self>) -> Vec<Met<C>> {
        records.into_iter().flat_map(|record| record.met).collect()
    }
}

impl<const C: usize> Recorder<C> for CountRecorder<'_, C> {
    #[inline]
    fn record(&mut self, flight: &Flight<'_>, flux: Flux<C>) {
        if !self.keep.keeps(flight.history) {
            return;
        }
        let luminaire = flight.luminaire;
        for (index, (watched, receiver)) in self.watched.iter().zip(self.receivers).enumerate() {
            let mut meet = |point: usize, flux| {
                self.met.push(Met { receiver: index as u32, point: point as u32, flux, luminaire });
            };
            match watched {
                Watched::Nothing => {}
                Watched::Cells(cells) => {
                    if !matches!(flight.history, History::Diffused | History::Glossy)
                        && let Some(at) = receiver.crossing(flight)
                        && let Some(cell) = cells.counting(receiver, at, self.caster)
                    {
                        meet(cell, flux);
                    }
                }
                Watched::Surface(surface) => {
                    if let Some(hit) = flight.hit
                        && surface.faces(hit.triangle, hit.normal.as_dvec3(), flight.direction.as_dvec3())
                        && let Some(sample) = surface.sample_at(hit.triangle, hit.position.as_dvec3(), self.mesh)
                    {
                        meet(sample, flux);
                    }
                }
                Watched::Bodies(bodies) => {
                    let end = flight.hit.map_or(f32::INFINITY, |hit| hit.distance);
                    for (point, (body, at, radius_squared)) in bodies.iter().enumerate() {
                        let to = *at - flight.origin;
                        let along = to.dot(flight.direction);
                        let off = to - flight.direction * along;
                        if 0.0 < along && along < end && off.length_squared() < *radius_squared {
                            let towards: DVec3 = -flight.direction.as_dvec3();
                            let kernel = body.measure.kernel(body.axis, towards) as f32;
                            meet(point, flux.scaled(kernel));
                        }
                    }
                }
            }
        }
    }
}
