//! Cylindrical, semi-cylindrical, hemispherical and spherical illuminance: light on a small body (see [`Measure`]).
//!
//! Rays are drawn by the body's own kernel, so what they find needs no weights and has no bias. Direct light is taken
//! on many flat cells about the body, each exactly as on any flat cell, and their mean is the body's.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use crate::scene::Measure;

/// Cells about a cylinder. An odd number n resolves the corner of max(0, cos φ) as 2n would: one source is read to
/// π²/(12 n²) = 2.1·10⁻⁴ at most, [`ROUND_ERROR`] root mean square over its azimuth; one with extent more nearly.
pub(super) const ROUND: usize = 63;
const ROUND_ERROR: f64 = 1e-4;
/// Cells about a sphere, on a Fibonacci lattice: one source is read to 7·10⁻⁴ at most (tested), [`BALL_ERROR`] root
/// mean square.
pub(super) const BALL: usize = 1024;
const BALL_ERROR: f64 = 1.5e-4;

/// A small body that is measured.
#[derive(Clone, Copy, Debug)]
pub struct MeasuredBody {
    /// Which.
    pub measure: Measure,
    /// Unit vector of its axis or normal.
    pub axis: DVec3,
}

impl MeasuredBody {
    /// The direction that belongs to a point of the unit square when directions have the density K/π.
    pub fn direction(&self, [a, b]: [f32; 2]) -> Vec3 {
        let (a, b) = (f64::from(a), f64::from(b));
        let (x, y) = match self.measure {
            Measure::Semicylindrical { facing } => (facing, self.axis.cross(facing)),
            _ => self.axis.any_orthonormal_pair(),
        };
        let (height, radius) = match self.measure {
            Measure::Plane => ((1.0 - a).sqrt(), a.sqrt()),
            // Density of the colatitude ∝ sin² ε: its share below ε is (2 ε − sin 2 ε)/2π.
            Measure::Cylindrical | Measure::Semicylindrical { .. } => {
                let polar = 0.5 * kepler(a);
                (polar.cos(), polar.sin())
            }
            Measure::Hemispherical => {
                let height = 2.0 * a.sqrt() - 1.0;
                (height, (1.0 - height * height).max(0.0).sqrt())
            }
            Measure::Spherical => (1.0 - 2.0 * a, 2.0 * (a * (1.0 - a)).sqrt()),
        };
        let azimuth = match self.measure {
            // Density ∝ 1 + cos α: with β = α + π, the share below is (β − sin β)/2π.
            Measure::Semicylindrical { .. } => kepler(b) - PI,
            _ => TAU * b,
        };
        let (sin, cos) = azimuth.sin_cos();
        (x * (radius * cos) + y * (radius * sin) + self.axis * height).normalize().as_vec3()
    }

    /// The flat cells that stand for the body.
    pub(super) fn cells(&self) -> FlatCells {
        let (x, y) = self.axis.any_orthonormal_pair();
        let mut cells = Vec::new();
        let is_round = matches!(self.measure, Measure::Cylindrical | Measure::Semicylindrical { .. });
        if is_round {
            cells.extend((0..ROUND).map(|i| {
                let (sin, cos) = (TAU * i as f64 / ROUND as f64).sin_cos();
                (x * cos + y * sin, 1.0 / ROUND as f64)
            }));
        } else {
            cells.extend((0..BALL).map(|i| {
                let height = 1.0 - (2 * i + 1) as f64 / BALL as f64;
                let (sin, cos) = (TAU * (i as f64 * 0.618_033_988_749_894_9).fract()).sin_cos();
                let radius = (1.0 - height * height).sqrt();
                ((x * cos + y * sin) * radius + self.axis * height, 1.0 / BALL as f64)
            }));
        }
        // sin ε (1 + cos α)/π = sin ε/π + (cos⁺ − cos⁻)/π, and (1 + cos θ)/4 = 1/4 + (cos⁺ − cos⁻)/4, with the cosine's
        // positive part on one cell and its negative part on the opposite.
        match self.measure {
            Measure::Semicylindrical { facing } => cells.extend([(facing, 1.0 / PI), (-facing, -1.0 / PI)]),
            Measure::Hemispherical => cells.extend([(self.axis, 0.25), (-self.axis, -0.25)]),
            _ => {}
        }
        let (about, error) = if is_round { (ROUND, ROUND_ERROR) } else { (BALL, BALL_ERROR) };
        FlatCells { weighted: cells, about, error }
    }
}

/// Flat cells that stand for a body.
pub(super) struct FlatCells {
    /// Normal of each, and what it counts.
    pub(super) weighted: Vec<(DVec3, f64)>,
    /// How many of them, the first, stand evenly all about.
    pub(super) about: usize,
    /// Relative error of what those say.
    pub(super) error: f64,
}

/// x of x − sin x = 2π `share`, 0 ≤ x ≤ 2π.
fn kepler(share: f64) -> f64 {
    if share > 0.5 {
        return TAU - kepler(1.0 - share);
    }
    if share <= 0.0 {
        return 0.0;
    }
    let mean = TAU * share;
    // From below the root, since x − sin x ≤ x³/6; Newton's step overshoots once, then falls, as the curve is convex.
    let mut x = (6.0 * mean).cbrt();
    for _ in 0..5 {
        x -= (x - x.sin() - mean) / (1.0 - x.cos());
    }
    x.clamp(0.0, PI)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Seed;

    const ALL: [Measure; 4] = [
        Measure::Cylindrical,
        Measure::Semicylindrical { facing: DVec3::Y },
        Measure::Hemispherical,
        Measure::Spherical,
    ];

    fn body(measure: Measure) -> MeasuredBody {
        MeasuredBody { measure, axis: DVec3::X }
    }

    /// Against the kernel itself, for sources all around: the cells' mean is as near as their stated error.
    #[test]
    fn cells_stand_for_their_body() {
        let mut stream = Seed(7).stream(0);
        for measure in ALL {
            let body = body(measure);
            let FlatCells { weighted, about, error } = body.cells();
            let (most, round) = match about {
                ROUND => (2.1e-4, Measure::Cylindrical),
                _ => (7e-4, Measure::Spherical),
            };
            let (mut worst, mut squares) = (0.0_f64, 0.0);
            for _ in 0..4000 {
                let towards = stream.on_sphere().as_dvec3().normalize();
                let found: f64 = weighted.iter().map(|(normal, weight)| weight * normal.dot(towards).max(0.0)).sum();
                let scale = round.kernel(body.axis, towards);
                let off = (found - measure.kernel(body.axis, towards)) / scale;
                worst = worst.max(off.abs());
                squares += off * off;
            }
            let rms = (squares / 4000.0).sqrt();
            println!("{}: worst {worst:.2e}, rms {rms:.2e}", measure.name());
            assert!(worst < most && rms < error, "{}: worst {worst}, rms {rms}", measure.name());
        }
    }

    /// Directions have the density K/π: the mean of any function f is ∫ f K dω/π. Here f = the components and their
    /// squares, against the kernel summed over the sphere; n = 40,000 on a grid of the unit square.
    #[test]
    fn directions_follow_the_kernel() {
        for measure in [ALL.as_slice(), &[Measure::Plane]].concat() {
            let body = body(measure);
            let moments = |towards: DVec3| [towards, towards * towards];
            let (mut found, mut expected) = ([DVec3::ZERO; 2], [DVec3::ZERO; 2]);
            for i in 0..200 {
                for j in 0..200 {
                    let at = [(i as f32 + 0.5) / 200.0, (j as f32 + 0.5) / 200.0];
                    let drawn = moments(body.direction(at).as_dvec3());
                    let (polar, azimuth) = (PI * f64::from(at[0]), TAU * f64::from(at[1]));
                    let towards = DVec3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos());
                    let weight = measure.kernel(DVec3::X, towards) * polar.sin() * 2.0 * PI / 40_000.0;
                    for (k, moment) in moments(towards).into_iter().enumerate() {
                        found[k] += drawn[k] / 40_000.0;
                        expected[k] += moment * weight;
                    }
                }
            }
            for k in 0..2 {
                assert!(found[k].distance(expected[k]) < 1e-3, "{}: {found:?}, {expected:?}", measure.name());
            }
        }
    }

    #[test]
    fn keplers_equation_is_solved() {
        for step in 0..=1000 {
            let share = f64::from(step) / 1000.0;
            let x = kepler(share);
            assert!((x - x.sin() - TAU * share).abs() < 1e-9, "{share}: {x}");
        }
        assert!(kepler(1e-12) > 0.0);
    }
}
