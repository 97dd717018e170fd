//! Luminous intensity over directions, as photometric files tabulate it.

use std::f64::consts::PI;

/// Luminous intensity over directions, cd: tabulated on C-planes and γ angles, bilinear in both between.
///
/// γ is the angle from the aim (0° … 180°), C the angle about it: seen from above, a luminaire that looks straight down
/// with C0 towards +x has C90 towards +y.
#[derive(Clone, Debug, PartialEq)]
pub struct Intensity {
    /// C-planes, degrees, ascending, all within one turn; a single one stands for all.
    planes: Vec<f64>,
    /// γ, degrees, ascending within 0 … 180; beyond the first and the last there is no light.
    angles: Vec<f64>,
    /// cd; plane by plane.
    candela: Vec<f64>,
}

impl Intensity {
    /// A distribution of `candela`, plane by plane. `planes` are ascending and span less than 360°, `angles` are two or
    /// more, ascending within 0 … 180°; intensities are finite and not negative. Symmetries are unfolded already.
    pub fn new(planes: Vec<f64>, angles: Vec<f64>, candela: Vec<f64>) -> Self {
        debug_assert!(planes.len() * angles.len() == candela.len() && angles.len() > 1);
        Self { planes, angles, candela }
    }

    /// The same with every intensity multiplied.
    pub(crate) fn scaled(mut self, factor: f64) -> Self {
        self.candela.iter_mut().for_each(|candela| *candela *= factor);
        self
    }

    /// C-planes, degrees.
    pub fn planes(&self) -> &[f64] {
        &self.planes
    }

    /// γ angles, degrees.
    pub fn angles(&self) -> &[f64] {
        &self.angles
    }

    /// Intensities of one plane, cd.
    pub fn plane(&self, plane: usize) -> &[f64] {
        &self.candela[plane * self.angles.len()..][..self.angles.len()]
    }

    /// Intensity towards (C, γ), degrees, cd.
    pub fn at(&self, c: f64, gamma: f64) -> f64 {
        let angles = &self.angles;
        if !(angles[0]..=angles[angles.len() - 1]).contains(&gamma) {
            return 0.0;
        }
        let upper = angles.partition_point(|&angle| angle <= gamma).clamp(1, angles.len() - 1);
        let along = (gamma - angles[upper - 1]) / (angles[upper] - angles[upper - 1]);
        let of_plane = |plane: usize| {
            let values = self.plane(plane);
            values[upper - 1] + (values[upper] - values[upper - 1]) * along
        };
        let planes = &self.planes;
        if planes.len() == 1 {
            return of_plane(0);
        }
        let c = planes[0] + (c - planes[0]).rem_euclid(360.0);
        let before = planes.partition_point(|&plane| plane <= c).clamp(1, planes.len()) - 1;
        let after = (before + 1) % planes.len();
        let (from, width) = (planes[before], self.width(before));
        let (a, b) = (of_plane(before), of_plane(after));
        a + (b - a) * ((c - from) / width).min(1.0)
    }

    /// Luminous flux of the bilinear distribution, lm; exact.
    pub fn flux(&self) -> f64 {
        // In each plane ∫ I sin γ dγ with I linear between angles; across planes the trapezoid is exact.
        let zonal = |plane: usize| -> f64 {
            let pairs = self.angles.windows(2).zip(self.plane(plane).windows(2));
            pairs
                .map(|(angle, value)| {
                    let [a, b] = [angle[0].to_radians(), angle[1].to_radians()];
                    let slope = (value[1] - value[0]) / (b - a);
                    value[0] * a.cos() - value[1] * b.cos() + slope * (b.sin() - a.sin())
                })
                .sum()
        };
        let count = self.planes.len();
        if count == 1 {
            return 2.0 * PI * zonal(0);
        }
        let wedge = |plane: usize| (zonal(plane) + zonal((plane + 1) % count)) / 2.0 * self.width(plane).to_radians();
        (0..count).map(wedge).sum()
    }

    /// Degrees from a plane to the next.
    pub(crate) fn width(&self, plane: usize) -> f64 {
        match self.planes.get(plane + 1) {
            Some(next) => next - self.planes[plane],
            None => self.planes[0] + 360.0 - self.planes[plane],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A Lambertian 1000 cd gives π · 1000 lm, an isotropic one 4π · 1000; chords between 1° steps lose under 1e-4.
    #[test]
    fn flux_of_known_distributions() {
        let angles: Vec<f64> = (0..=180).map(f64::from).collect();
        let lambert: Vec<f64> = angles.iter().map(|g| 1000.0 * g.to_radians().cos().max(0.0)).collect();
        let one = Intensity::new(vec![0.0], angles.clone(), lambert.clone());
        assert!((one.flux() / (1000.0 * PI) - 1.0).abs() < 1e-4);
        let four = Intensity::new(vec![0.0, 90.0, 180.0, 270.0], angles, lambert.repeat(4));
        assert!((four.flux() / one.flux() - 1.0).abs() < 1e-12);
        let isotropic = Intensity::new(vec![0.0], vec![0.0, 180.0], vec![1000.0; 2]);
        assert!((isotropic.flux() / (4000.0 * PI) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn planes_are_joined_around_the_circle() {
        let web = Intensity::new(vec![0.0, 120.0, 240.0], vec![0.0, 90.0], vec![10.0, 10.0, 20.0, 20.0, 40.0, 40.0]);
        for (c, expected) in
            [(0.0, 10.0), (60.0, 15.0), (300.0, 25.0), (-60.0, 25.0), (359.999_999, 10.0), (720.0, 10.0)]
        {
            assert!((web.at(c, 45.0) - expected).abs() < 1e-6, "C {c}: {}", web.at(c, 45.0));
        }
        assert_eq!(web.at(0.0, 90.001), 0.0);
    }
}
