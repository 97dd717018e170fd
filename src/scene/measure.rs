//! What a sensor measures: the light on a flat cell, or on a small body that light reaches from many sides.

use std::f64::consts::PI;

use glam::DVec3;

/// What the illuminance of a sensor is the mean over. With L the luminance, ω the direction it comes from, ε its angle
/// to the axis, and α its azimuth from the facing direction, each is E = ∫ L K dω with ∫ K dω = π: under a sky of even
/// luminance all read π L.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measure {
    /// A flat cell, as an illuminance meter has: K = cos θ, θ from the normal. With a level normal: vertical
    /// illuminance.
    Plane,
    /// The mantle of a small cylinder about the axis: K = sin ε / π. It is the mean of the vertical illuminances over
    /// all azimuths (EN 12464-1).
    Cylindrical,
    /// The mantle of a half cylinder about the axis that looks towards `facing`: K = sin ε (1 + cos α) / π, the mean of
    /// the vertical illuminances within 90° of `facing` (EN 13201-3).
    Semicylindrical {
        /// Unit vector at a right angle to the axis.
        facing: DVec3,
    },
    /// The dome of a small half sphere about the normal: K = (1 + cos θ) / 4 (EN 13201-3).
    Hemispherical,
    /// A small sphere: K = 1/4, mean spherical or scalar illuminance.
    Spherical,
}

impl Measure {
    /// Its word in scene files.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Plane => "plane",
            Self::Cylindrical => "cylindrical",
            Self::Semicylindrical { .. } => "semicylindrical",
            Self::Hemispherical => "hemispherical",
            Self::Spherical => "spherical",
        }
    }

    /// K of light from direction `towards` (unit), 1 for normal incidence on a flat cell.
    pub fn kernel(&self, axis: DVec3, towards: DVec3) -> f64 {
        let height = axis.dot(towards);
        let sine = || (1.0 - height * height).max(0.0).sqrt();
        match self {
            Self::Plane => height.max(0.0),
            Self::Cylindrical => sine() / PI,
            Self::Semicylindrical { facing } => (sine() + facing.dot(towards)).max(0.0) / PI,
            Self::Hemispherical => (1.0 + height).max(0.0) / 4.0,
            Self::Spherical => 0.25,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEMI: Measure = Measure::Semicylindrical { facing: DVec3::X };

    /// ∫ K dω = π, by the midpoint rule over colatitude and azimuth: 200 × 400 steps err by less than 1e-4.
    #[test]
    fn every_measure_reads_pi_l_under_even_luminance() {
        for measure in [Measure::Plane, Measure::Cylindrical, SEMI, Measure::Hemispherical, Measure::Spherical] {
            let mut sum = 0.0;
            for i in 0..200 {
                let polar = PI * (f64::from(i) + 0.5) / 200.0;
                for j in 0..400 {
                    let azimuth = 2.0 * PI * (f64::from(j) + 0.5) / 400.0;
                    let towards = DVec3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos());
                    sum += measure.kernel(DVec3::Z, towards) * polar.sin() * (PI / 200.0) * (2.0 * PI / 400.0);
                }
            }
            assert!((sum / PI - 1.0).abs() < 1e-4, "{}: {sum}", measure.name());
        }
    }

    /// The definitions: means of vertical illuminances over azimuth, here of one source at elevation 30°, azimuth 40°.
    #[test]
    fn cylinders_are_means_of_vertical_illuminances() {
        let (elevation, azimuth) = (30_f64.to_radians(), 40_f64.to_radians());
        let towards = DVec3::new(elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin());
        let mean = |from: f64, to: f64| {
            let steps = 100_000;
            let vertical = |step: i32| {
                let at = from + (to - from) * (f64::from(step) + 0.5) / f64::from(steps);
                Measure::Plane.kernel(DVec3::new(at.cos(), at.sin(), 0.0), towards)
            };
            (0..steps).map(vertical).sum::<f64>() / f64::from(steps)
        };
        let close = |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-6, "{found}, {expected}");
        close(Measure::Cylindrical.kernel(DVec3::Z, towards), mean(-PI, PI));
        close(SEMI.kernel(DVec3::Z, towards), mean(-PI / 2.0, PI / 2.0));
        close(SEMI.kernel(DVec3::Z, towards), elevation.cos() * (1.0 + azimuth.cos()) / PI);
    }
}
