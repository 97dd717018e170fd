//! Images while they are computed: what the rays of every pixel have found so far.
//!
//! A pixel is the mean over its own square (a box filter): rays go through places spread evenly over it. Layers that
//! compositors mix are such means too, E and albedo and normal, times coverage as EXR's alpha has it; depth and
//! position are those of the ray through the pixel's middle, for a mean of two surfaces would lie where there is none.

use std::io;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use crate::embree::RayCaster;
use crate::flux::photometric;
use crate::gather::camera::{Draw, Eye, first_surface};
use crate::gather::sight::Sight;
use crate::gather::smooth::few;
use crate::random::{Seed, low_discrepancy};
use crate::results::{CameraImage, Layer};
use crate::scene::Camera;
use crate::state::Sum;
use crate::state::tape::Tape;

/// Depth of a pixel whose middle sees nothing, m: farther than all else, as Blender writes it.
const NOTHING: f32 = 1e10;

/// World coordinates up to this, m, are written as they are: single precision then tells half a millimetre.
const LARGEST_POSITION: f64 = 4096.0;

/// One camera's image while it is computed.
pub(super) struct View<'a, const C: usize> {
    camera: &'a Camera,
    pixels: Vec<Pixel<C>>,
    /// Z and P of each pixel, m, once it is known.
    places: Vec<(f32, [f32; 3])>,
    /// World position of P's origin, m.
    origin: DVec3,
    /// Rays of each pixel so far.
    samples: u64,
    /// Independent parts they came in.
    batches: u64,
    /// Whether the image is good enough, and rests while maps and sensors ask for more.
    pub(super) rests: bool,
}

/// Sums over the rays of a pixel.
#[derive(Clone, Copy)]
struct Pixel<const C: usize> {
    direct: [Sum; C],
    indirect: [Sum; C],
    luminance: [Sum; C],
    /// Of the batches' photometric E, lx, and of their squares.
    batches: Sum,
    squares: Sum,
    /// Of the squares of the batches' photometric luminance, (cd/m²)²; `luminance` has their sum.
    luminance_squares: Sum,
    /// Albedo, normal and coverage, whose parts are multiples of 2⁻²⁴: sums of half a billion of them need no rounding.
    albedo: [f64; C],
    normal: [f64; 3],
    coverage: f64,
}

/// A part of albedo or normal, rounded to a multiple of 2⁻²⁴.
fn multiple(part: f32) -> f64 {
    (f64::from(part) * f64::from(1 << 24)).round() / f64::from(1 << 24)
}

impl<const C: usize> Pixel<C> {
    const NEW: Self = Self {
        direct: [Sum::ZERO; C],
        indirect: [Sum::ZERO; C],
        luminance: [Sum::ZERO; C],
        batches: Sum::ZERO,
        squares: Sum::ZERO,
        luminance_squares: Sum::ZERO,
        albedo: [0.0; C],
        normal: [0.0; 3],
        coverage: 0.0,
    };
}

/// What one batch of rays may ask.
pub(super) struct Batch<'e, const C: usize> {
    pub(super) eye: &'e Eye<'e, C>,
    pub(super) seed: Seed,
    /// Rays a pixel.
    pub(super) rays: u64,
}

impl<'a, const C: usize> View<'a, C> {
    /// An image of nothing yet; `centre` is the world position of the scene's origin, m.
    pub(super) fn new(camera: &'a Camera, centre: DVec3, sight: &Sight<'_, C>, caster: &RayCaster) -> Self {
        let far = (centre + camera.eye).abs().max_element().max(centre.abs().max_element()) > LARGEST_POSITION;
        let origin = if far { centre.round() } else { DVec3::ZERO };
        let columns = camera.pixels[0];
        let place = |pixel: usize| {
            let middle = [pixel % columns, pixel / columns].map(|index| index as f64 + 0.5);
            let direction = camera.direction(middle).as_vec3();
            let Some((hit, _)) = first_surface(sight, caster, camera.eye.as_vec3(), direction) else {
                return (NOTHING, [0.0; 3]);
            };
            let position = hit.position.as_dvec3();
            let depth = (position - camera.eye).dot(camera.forward);
            (depth as f32, (position + (centre - origin)).as_vec3().to_array())
        };
        Self {
            camera,
            pixels: vec![Pixel::NEW; camera.len()],
            places: (0..camera.len()).into_par_iter().with_min_len(64).map(place).collect(),
            origin,
            samples: 0,
            batches: 0,
            rests: false,
        }
    }

    /// Number of pixels.
    pub(super) fn len(&self) -> usize {
        self.pixels.len()
    }

    /// Adds a batch of rays to every pixel, row by row; returns how many were cast in all.
    pub(super) fn look(&mut self, batch: &Batch<'_, C>, progress: impl Fn(u64) + Sync) -> u64 {
        let camera = self.camera;
        let columns = camera.pixels[0];
        let (origin, count) = (camera.eye.as_vec3(), batch.rays);
        self.samples += count;
        self.batches += 1;
        let cast = AtomicU64::new(0);
        let memory = || batch.eye.caustics.map(|caustics| caustics.scratch());
        self.pixels.par_chunks_mut(columns).enumerate().for_each_init(memory, |scratch, (row, pixels)| {
            let mut rays = 0;
            for (column, pixel) in pixels.iter_mut().enumerate() {
                let mut stream = batch.seed.stream((row * columns + column) as u64);
                let [place_shift, direction_shift] = [stream.uniform_pair(), stream.uniform_pair()];
                let lamp_shift = stream.uniform();
                let (mut sum, mut luminance_sum) = (0.0, 0.0);
                for ray in 0..count {
                    let [x, y] = low_discrepancy(ray, place_shift).map(f64::from);
                    let direction = camera.direction([column as f64 + x, row as f64 + y]).as_vec3();
                    let mut draw = Draw {
                        at: low_discrepancy(ray, direction_shift),
                        lamps: ((ray as f32 + lamp_shift) / count as f32).min(0.999_999_9),
                        caustics: if ray == 0 { count as f64 } else { 0.0 },
                        scratch: scratch.as_mut(),
                        stream: &mut stream,
                        rays: &mut rays,
                    };
                    let seen = batch.eye.observe(origin, direction, &mut draw);
                    let Pixel { direct, indirect, luminance, albedo, normal, coverage, .. } = pixel;
                    (0..C).for_each(|c| luminance[c].add(seen.luminance[c]));
                    luminance_sum += photometric(seen.luminance);
                    let Some(surface) = seen.surface else { continue };
                    for c in 0..C {
                        direct[c].add(surface.light.direct[c]);
                        indirect[c].add(surface.light.indirect[c]);
                        albedo[c] += multiple(surface.albedo[c]);
                    }
                    (0..3).for_each(|axis| normal[axis] += multiple(surface.normal[axis]));
                    *coverage += 1.0;
                    sum += photometric(surface.light.direct) + photometric(surface.light.indirect);
                }
                let found = sum / count as f64;
                pixel.batches.add(found);
                pixel.squares.add(found * found);
                pixel.luminance_squares.add((luminance_sum / count as f64).powi(2));
            }
            cast.fetch_add(rays, Ordering::Relaxed);
            progress(columns as u64);
        });
        cast.into_inner()
    }

    /// Hands its sums over.
    pub(super) fn exchange(&mut self, tape: &mut Tape<'_>) -> io::Result<()> {
        tape.count(&mut self.samples)?;
        tape.count(&mut self.batches)?;
        let mut rests = u64::from(self.rests);
        tape.number(&mut rests)?;
        self.rests |= rests > 0;
        for pixel in &mut self.pixels {
            let Pixel { direct, indirect, luminance, batches, squares, luminance_squares, albedo, normal, coverage } =
                pixel;
            let light = [direct, indirect, luminance].into_iter().flatten();
            light.chain([batches, squares, luminance_squares]).try_for_each(|sum| tape.sum(sum))?;
            albedo.iter_mut().chain(normal).chain([coverage]).try_for_each(|sum| tape.exact(sum))?;
        }
        Ok(())
    }

    /// Claimed standard error of a pixel, root mean square, relative to the image's mean E; 0 in the dark.
    pub(super) fn claim(&self) -> f64 {
        let (mut sum, mut variance, mut count) = (0.0, 0.0, 0.0_f64);
        for pixel in self.pixels.iter().filter(|pixel| pixel.coverage > 0.0) {
            sum += pixel.batches.value() / self.batches as f64;
            variance += self.variance(pixel);
            count += 1.0;
        }
        if sum > 0.0 { (variance * count).sqrt() / sum } else { 0.0 }
    }

    /// Variance of a pixel's photometric E, lx².
    fn variance(&self, pixel: &Pixel<C>) -> f64 {
        self.variance_of_mean(pixel.batches.value(), pixel.squares.value())
    }

    /// Variance of a pixel's photometric luminance, (cd/m²)².
    fn luminance_variance(&self, pixel: &Pixel<C>) -> f64 {
        let per_batch = self.batches as f64 / self.samples.max(1) as f64;
        let sum = photometric(pixel.luminance.map(Sum::value)) * per_batch;
        self.variance_of_mean(sum, pixel.luminance_squares.value())
    }

    /// Variance of the mean of the batches, of which the sum and that of the squares are known.
    fn variance_of_mean(&self, sum: f64, squares: f64) -> f64 {
        let batches = self.batches as f64;
        // Σ (x − x̄)² = Σ x² − x̄ Σ x; rounding may leave it a little below 0.
        let scatter = (squares - sum * sum / batches).max(0.0);
        scatter / (batches * (batches - 1.0)).max(1.0)
    }

    /// The image, `centre` being the world position of the scene's origin, m.
    pub(super) fn image(&self, centre: DVec3) -> CameraImage {
        let per_sample = 1.0 / self.samples.max(1) as f64;
        let each = |value: &dyn Fn(&Pixel<C>) -> f64| -> Vec<f32> {
            self.pixels.iter().map(|pixel| value(pixel) as f32).collect()
        };
        let mean = |sums: &dyn Fn(&Pixel<C>) -> [f64; C]| {
            Layer((0..C).map(|c| each(&|pixel| sums(pixel)[c] * per_sample)).collect())
        };
        // A pixel has nothing but its own batches to know its scatter by.
        let alone = few(self.batches as f64);
        let camera = self.camera;
        let normal = |axis: usize| each(&|pixel| pixel.normal[axis] * per_sample);
        let position = |axis: usize| self.places.iter().map(|(_, position)| position[axis]).collect();
        CameraImage {
            name: camera.name.clone(),
            // To a nanometre: moving the scene to its middle and back has left a rounding error.
            eye: ((camera.eye + centre) * 1e9).round() / 1e9,
            forward: camera.forward,
            up: camera.up,
            fov: camera.fov,
            screen_width: camera.screen_width(),
            pixels: camera.pixels,
            samples: self.samples,
            claim: self.claim(),
            illuminance: mean(&|pixel| std::array::from_fn(|c| pixel.direct[c].value() + pixel.indirect[c].value())),
            direct: mean(&|pixel| pixel.direct.map(Sum::value)),
            indirect: mean(&|pixel| pixel.indirect.map(Sum::value)),
            luminance: mean(&|pixel| pixel.luminance.map(Sum::value)),
            standard_error: each(&|pixel| (alone * self.variance(pixel)).sqrt()),
            luminance_standard_error: each(&|pixel| (alone * self.luminance_variance(pixel)).sqrt()),
            albedo: mean(&|pixel| pixel.albedo),
            normal: Layer((0..3).map(normal).collect()),
            depth: self.places.iter().map(|(depth, _)| *depth).collect(),
            position: Layer((0..3).map(position).collect()),
            position_origin: self.origin,
            coverage: each(&|pixel| pixel.coverage * per_sample),
        }
    }
}
