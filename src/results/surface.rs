//! Measured surfaces and their figures.

use std::io;

use glam::DVec3;

use super::statistics::as_read;
use super::{Errors, Extremes};
use crate::error::invalid;
use crate::gather::reach::Standing;
use crate::units::{Lumens, Lux};

/// Illuminance over one measured surface, sample by sample; world coordinates.
#[derive(Clone, Debug)]
pub struct SurfaceMap {
    /// Name of the surface.
    pub name: String,
    /// Side of the largest square that a sample stands for, m.
    pub spacing: f64,
    /// Corners of each sample, m, counter-clockwise seen from the measured side.
    pub corners: Vec<[DVec3; 3]>,
    /// E in the middle of each sample, lx.
    pub illuminance: Vec<f64>,
    /// E of each channel (linear Rec. 709), lx; only in coloured scenes.
    pub rgb: Option<Vec<[f64; 3]>>,
    /// Standard error of each sample (1 σ), lx.
    pub standard_error: Vec<f64>,
    /// False where no light can arrive: such samples have no value.
    pub has_value: Vec<bool>,
    /// Why each sample has a value, or none; empty where that is not known.
    pub standing: Vec<Standing>,
    /// What is known of its mean and extremes beyond the samples.
    pub extremes: Option<Extremes>,
}

/// Figures of a measured surface, over the samples that have a value, each by its area; zeros where none has.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceFigures {
    /// Samples that have a value.
    pub samples: usize,
    /// Samples that have none.
    pub samples_without_value: usize,
    /// Area of those with a value, m².
    pub area: f64,
    /// Flux that they receive, lm: Σ E A.
    pub flux: Lumens,
    /// Ē = Σ E A / Σ A.
    pub mean: Lux,
    /// Darkest sample.
    pub min: Lux,
    /// Brightest sample.
    pub max: Lux,
    /// U₀ = E_min / Ē; 0 in the dark.
    pub uniformity: f64,
    /// U_d = E_min / E_max; 0 in the dark.
    pub diversity: f64,
    /// Mean of the samples' standard errors.
    pub mean_standard_error: Lux,
    /// Largest of them.
    pub largest_standard_error: Lux,
    /// Standard errors (1 σ) of Ē, E_min, E_max, U₀ and U_d.
    pub errors: Errors,
}

impl SurfaceMap {
    /// Area of a sample, m².
    pub fn area(&self, sample: usize) -> f64 {
        self.cross(sample).length() / 2.0
    }

    pub(crate) fn cross(&self, sample: usize) -> DVec3 {
        let [a, b, c] = self.corners[sample];
        (b - a).cross(c - a)
    }

    /// The surface's figures.
    pub fn figures(&self) -> SurfaceFigures {
        let mut found = SurfaceFigures::default();
        let (mut values, mut own_errors) = (Vec::new(), Vec::new());
        let mut errors = 0.0;
        for sample in (0..self.corners.len()).filter(|&sample| self.has_value[sample]) {
            let (area, lux, error) = (self.area(sample), self.illuminance[sample], self.standard_error[sample]);
            found.samples += 1;
            found.area += area;
            found.flux.0 += lux * area;
            errors += error * area;
            values.push(lux);
            own_errors.push(error);
            found.largest_standard_error.0 = found.largest_standard_error.0.max(error);
        }
        found.samples_without_value = self.corners.len() - found.samples;
        if found.samples == 0 {
            return SurfaceFigures { samples_without_value: found.samples_without_value, ..SurfaceFigures::default() };
        }
        let ratio = |part: f64, whole: f64| if whole == 0.0 { 0.0 } else { part / whole };
        found.mean = Lux(found.flux.0 / found.area);
        found.mean_standard_error = Lux(errors / found.area);
        let known = Extremes { mean_error: found.mean_standard_error.0, ..as_read(&values, &own_errors) };
        let known = self.extremes.unwrap_or(known);
        (found.min, found.max) = (Lux(known.min.lux), Lux(known.max.lux));
        found.errors = Errors::of(found.mean.0, &known);
        found.uniformity = ratio(found.min.0, found.mean.0);
        found.diversity = ratio(found.min.0, found.max.0);
        found
    }

    /// Says which sample is not a finite number.
    pub(crate) fn check(&self) -> io::Result<()> {
        let bad = |&sample: &usize| {
            self.has_value[sample] && !((self.illuminance[sample] + self.standard_error[sample]) as f32).is_finite()
        };
        (0..self.corners.len()).find(bad).map_or(Ok(()), |sample| {
            let lux = self.illuminance[sample];
            Err(invalid(format!("E of sample {sample} of \"{}\" is {lux} lx, expected a finite number", self.name)))
        })
    }
}
