//! A table of intensities as it stands in a file, on its way to C-planes all around.
//!
//! **Type C** is kept as it is; symmetries are unfolded.
//!
//! **Type A and B** (LM-63-2002, chapter 3). Photometric zero (the nadir) is V 0°, H 0° in type B and V −90° in type
//! A, photometric horizontal (90° up in the plane C0) is V 90°, H 0° in type B and V 0°, H 0° in type A; H runs
//! clockwise seen from above, against C. So with x along C0, y along C90 and z up,
//! - type A looks at (cos V cos H, −cos V sin H, sin V): C = −H and γ = 90° + V, the same planes under other names;
//! - type B looks at (cos H sin V, −sin H, −cos H cos V): its planes turn about the axis along C90, and
//!   tan V = cos C tan γ, sin H = −sin C sin γ. It is resampled.
//!
//! Radiance turns the same way (`srcB_vert` towards +x, `srcB_horiz` towards −y), and so does glTF's `EXT_lights_ies`
//! (H 90° where type C has 270°).

use super::Symmetry;
use super::text::CLOSEST;
use crate::luminaire::intensity::Intensity;

/// Steps in the planes of a table that was one plane about the horizontal axis, degrees.
const AROUND: f64 = 1.0;

/// Intensities, plane by plane: C or horizontal angles, then γ or vertical angles, degrees, each ascending.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct IntensityTable {
    pub(super) planes: Vec<f64>,
    pub(super) angles: Vec<f64>,
    /// cd.
    pub(super) candela: Vec<f64>,
}

/// Width of the step to darkness where a table of type A or B ends in light, degrees.
const EDGE: f64 = 0.01;

/// Steps of a resampled table of type B: half the file's, but within these, degrees.
const STEPS: [f64; 2] = [0.25, 1.0];

impl IntensityTable {
    fn plane(&self, plane: usize) -> &[f64] {
        &self.candela[plane * self.angles.len()..][..self.angles.len()]
    }

    /// Turns round what the file lists downwards: planes, angles, or both; the lists themselves ascend already.
    pub(super) fn turn(&mut self, planes: bool, angles: bool) {
        let count = self.angles.len();
        if angles {
            self.candela.chunks_mut(count).for_each(<[f64]>::reverse);
        }
        if planes {
            self.candela = self.candela.chunks(count).rev().flatten().copied().collect();
        }
    }

    /// Leaves out the last plane where it is the first again, a turn later; whether the two differ.
    pub(super) fn close(&mut self) -> bool {
        let count = self.planes.len();
        if count < 2 || self.planes[count - 1] - self.planes[0] < 360.0 - CLOSEST {
            return false;
        }
        let largest = self.candela.iter().fold(0.0, |a: f64, b| a.max(*b));
        let pairs = self.plane(0).iter().zip(self.plane(count - 1));
        let differ = pairs.into_iter().any(|(a, b)| (a - b).abs() > 0.01 * largest);
        self.planes.pop();
        self.candela.truncate((count - 1) * self.angles.len());
        differ
    }

    /// The table of the whole circle, with planes where the symmetry says so; planes of type C.
    pub(super) fn unfold(self, symmetry: Symmetry) -> Intensity {
        if symmetry == Symmetry::Rotational {
            let candela = self.plane(0).to_vec();
            return Intensity::new(vec![0.0], self.angles, candela);
        }
        let images: &[fn(f64) -> f64] = match symmetry {
            Symmetry::None | Symmetry::Rotational => &[|c| c],
            Symmetry::AboutC0 => &[|c| c, |c| -c],
            Symmetry::AboutC90 => &[|c| c, |c| 180.0 - c],
            Symmetry::Quadrant => &[|c| c, |c| -c, |c| 180.0 - c, |c| 180.0 + c],
        };
        let places = self.planes.iter().enumerate();
        let all = places.flat_map(|(plane, &c)| images.iter().map(move |image| (within_turn(image(c)), plane)));
        self.around(all.collect())
    }

    /// Planes of this table at their places about the aim; where two share a place, the first of them.
    fn around(&self, mut places: Vec<(f64, usize)>) -> Intensity {
        places.sort_by(|a, b| a.0.total_cmp(&b.0));
        places.dedup_by(|next, kept| next.0 - kept.0 < CLOSEST);
        let planes = places.iter().map(|(c, _)| *c).collect();
        let candela = places.iter().flat_map(|(_, plane)| self.plane(*plane)).copied().collect();
        Intensity::new(planes, self.angles.clone(), candela)
    }

    /// The same table with its mirror images where it begins at 0: planes to both sides, and angles up and down.
    fn mirrored(mut self) -> Self {
        if self.angles[0].abs() < CLOSEST {
            let count = self.angles.len();
            let order: Vec<usize> = (1..count).rev().chain(0..count).collect();
            self.candela = self
                .candela
                .chunks(count)
                .flat_map(|plane| order.iter().map(|&i| plane[i]).collect::<Vec<_>>())
                .collect();
            self.angles = (1..count).rev().map(|i| -self.angles[i]).chain(self.angles.iter().copied()).collect();
        }
        if self.planes[0].abs() < CLOSEST {
            let count = self.planes.len();
            let order: Vec<usize> = (1..count).rev().chain(0..count).collect();
            self.candela = order.iter().flat_map(|&plane| self.plane(plane).to_vec()).collect();
            self.planes = (1..count).rev().map(|i| -self.planes[i]).chain(self.planes.iter().copied()).collect();
        }
        self
    }

    /// Type A as type C; exact, but for a step of a hundredth of a degree where light ends at full strength.
    /// Horizontal angles are within ±180°, vertical ones within ±90°.
    pub(super) fn type_a_to_c(self) -> Intensity {
        let mut table = self.mirrored();
        table.angles.iter_mut().for_each(|angle| *angle += 90.0);
        let mut places: Vec<(f64, usize)> =
            table.planes.iter().enumerate().map(|(plane, h)| (within_turn(-h), plane)).collect();
        let (first, last) = (table.planes[0], table.planes[table.planes.len() - 1]);
        if last - first < 360.0 - 2.0 * EDGE {
            let dark = table.planes.len();
            let lit = |plane: usize| table.plane(plane).iter().any(|&value| value > 0.0);
            let ends = [(0, first - EDGE), (dark - 1, last + EDGE)];
            places.extend(ends.into_iter().filter(|(plane, _)| lit(*plane)).map(|(_, h)| (within_turn(-h), dark)));
            table.candela.resize((dark + 1) * table.angles.len(), 0.0);
        }
        table.around(places)
    }

    /// Type B as type C, resampled at half its steps (0.25° to 1°) and scaled so that the flux stays exactly what the
    /// table says; tests tell the error in directions. Horizontal angles are within ±90°, vertical ones within ±180°.
    pub(super) fn type_b_to_c(self) -> Intensity {
        let table = self.mirrored();
        let narrowest = |angles: &[f64]| angles.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
        let step = (narrowest(&table.planes).min(narrowest(&table.angles)) / 2.0).clamp(STEPS[0], STEPS[1]);
        let reach = table.angles.iter().fold(0.0_f64, |reach, angle| reach.max(angle.abs()));
        let end = if reach <= 90.0 + CLOSEST { 90.0 } else { 180.0 };
        let grid = |turn: f64| -> (usize, f64) {
            let count = (turn / step).ceil();
            (count as usize, turn / count)
        };
        let ((planes, plane_step), (angles, angle_step)) = (grid(360.0), grid(end));
        let planes: Vec<f64> = (0..planes).map(|i| i as f64 * plane_step).collect();
        let angles: Vec<f64> = (0..=angles).map(|i| i as f64 * angle_step).collect();
        let at = |c: f64, gamma: f64| {
            let ((sin_c, cos_c), (sin, cos)) = (c.to_radians().sin_cos(), gamma.to_radians().sin_cos());
            let h = -(sin_c * sin).clamp(-1.0, 1.0).asin();
            table.at(h.to_degrees(), (cos_c * sin).atan2(cos).to_degrees())
        };
        let mut candela: Vec<f64> = planes.iter().flat_map(|&c| angles.iter().map(move |&g| at(c, g))).collect();
        let sampled = Intensity::new(planes.clone(), angles.clone(), candela.clone()).flux();
        if sampled > 0.0 {
            let factor = table.flux_of_type_b() / sampled;
            candela.iter_mut().for_each(|value| *value *= factor);
        }
        Intensity::new(planes, angles, candela)
    }

    /// One plane of type A or B (H = 0) as the same all around its axis, V = 0: that is the nadir in type B, and the
    /// horizon in type A. Nothing where both halves of the plane are told and differ by more than a hundredth.
    pub(super) fn about_axis(mut self, horizontal: bool) -> Option<Intensity> {
        let largest = self.candela.iter().fold(0.0, |a: f64, b| a.max(*b));
        if self.angles[0] < 0.0 {
            self.planes = vec![0.0, 1.0];
            self.candela = self.candela.repeat(2);
            let differs = self.angles.iter().any(|v| (self.at(0.0, *v) - self.at(0.0, -v)).abs() > 0.01 * largest);
            if differs {
                return None;
            }
            let kept = self.angles.iter().position(|v| *v >= -CLOSEST)?;
            self.candela = self.plane(0)[kept..].to_vec();
            self.angles.drain(..kept);
            self.angles.iter_mut().for_each(|angle| *angle = angle.max(0.0));
        }
        if self.angles.len() < 2 {
            return None;
        }
        let about = Intensity::new(vec![0.0], self.angles, self.candela);
        if !horizontal {
            return Some(about);
        }
        let count = (360.0 / AROUND) as usize;
        let planes: Vec<f64> = (0..count).map(|i| i as f64 * AROUND).collect();
        let angles: Vec<f64> = (0..=count / 2).map(|i| i as f64 * AROUND).collect();
        let at = |c: f64, gamma: f64| {
            about.at(0.0, (gamma.to_radians().sin() * c.to_radians().cos()).clamp(-1.0, 1.0).acos().to_degrees())
        };
        let mut candela: Vec<f64> = planes.iter().flat_map(|&c| angles.iter().map(move |&g| at(c, g))).collect();
        let sampled = Intensity::new(planes.clone(), angles.clone(), candela.clone()).flux();
        if sampled > 0.0 {
            candela.iter_mut().for_each(|value| *value *= about.flux() / sampled);
        }
        Some(Intensity::new(planes, angles, candela))
    }

    /// Intensity between the entries, bilinear, cd; none outside.
    fn at(&self, plane: f64, angle: f64) -> f64 {
        let place = |angles: &[f64], angle: f64| -> Option<(usize, f64)> {
            let (low, high) = (angles[0], angles[angles.len() - 1]);
            let angle =
                if (low - CLOSEST..=high + CLOSEST).contains(&angle) { angle.clamp(low, high) } else { return None };
            let upper = angles.partition_point(|&other| other <= angle).clamp(1, angles.len() - 1);
            Some((upper - 1, (angle - angles[upper - 1]) / (angles[upper] - angles[upper - 1])))
        };
        let (Some((p, u)), Some((a, v))) = (place(&self.planes, plane), place(&self.angles, angle)) else { return 0.0 };
        let along = |plane: usize| self.plane(plane)[a] * (1.0 - v) + self.plane(plane)[a + 1] * v;
        along(p) * (1.0 - u) + along(p + 1) * u
    }

    /// Flux of the bilinear table over H and V of type B, where the solid angle is cos H dH dV, lm; exact.
    fn flux_of_type_b(&self) -> f64 {
        let zonal: Vec<f64> = (0..self.angles.len())
            .map(|angle| {
                let pair = |p: usize| {
                    let [a, b] = [self.planes[p].to_radians(), self.planes[p + 1].to_radians()];
                    let [from, to] = [self.plane(p)[angle], self.plane(p + 1)[angle]];
                    to * b.sin() - from * a.sin() + (to - from) / (b - a) * (b.cos() - a.cos())
                };
                (0..self.planes.len() - 1).map(pair).sum()
            })
            .collect();
        let steps = self.angles.windows(2).zip(zonal.windows(2));
        steps.map(|(angle, flux)| (angle[1] - angle[0]).to_radians() * (flux[0] + flux[1]) / 2.0).sum()
    }
}

/// An angle as 0° … 360°, the end not included.
pub(super) fn within_turn(angle: f64) -> f64 {
    let angle = angle.rem_euclid(360.0) + 0.0; // no −0
    if 360.0 - angle < CLOSEST { 0.0 } else { angle }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn steps(low: f64, high: f64, step: f64) -> Vec<f64> {
        (0..=((high - low) / step).round() as usize).map(|i| low + step * i as f64).collect()
    }

    /// A table of `intensity`(direction), directions by `direction`(plane, angle) in radians.
    fn tabulate(
        planes: Vec<f64>,
        angles: Vec<f64>,
        direction: fn(f64, f64) -> [f64; 3],
        intensity: fn([f64; 3]) -> f64,
    ) -> IntensityTable {
        let of = |&h: &f64, &v: &f64| intensity(direction(h.to_radians(), v.to_radians()));
        let candela = planes.iter().flat_map(|h| angles.iter().map(move |v| of(h, v))).collect();
        IntensityTable { planes, angles, candela }
    }

    fn type_a(h: f64, v: f64) -> [f64; 3] {
        [v.cos() * h.cos(), -v.cos() * h.sin(), v.sin()]
    }

    fn type_b(h: f64, v: f64) -> [f64; 3] {
        [h.cos() * v.sin(), -h.sin(), -h.cos() * v.cos()]
    }

    fn type_c(c: f64, gamma: f64) -> [f64; 3] {
        [gamma.sin() * c.cos(), gamma.sin() * c.sin(), -gamma.cos()]
    }

    /// Lopsided, so that no wrong sign goes unseen: the largest lies between C0 and C90 (about C 34°), below.
    fn lopsided([x, y, z]: [f64; 3]) -> f64 {
        (600.0 + 300.0 * x + 200.0 * y - 400.0 * z) * (-z).max(0.0)
    }

    /// Every direction of the sphere, 7° apart.
    fn directions() -> impl Iterator<Item = (f64, f64)> {
        (0..52).flat_map(|c| (0..26).map(move |g| (7.0 * f64::from(c), 7.0 * f64::from(g))))
    }

    /// Linear interpolation of f over steps of h errs by max |f″| h²/8 in each direction; |f″| is under 2000 cd/rad²
    /// here and interpolation happens twice, at 2° and 1°.
    #[test]
    fn type_b_keeps_every_direction_and_its_flux() {
        let table = tabulate(steps(-90.0, 90.0, 2.0), steps(-90.0, 90.0, 2.0), type_b, lopsided);
        let flux = table.flux_of_type_b();
        let web = table.type_b_to_c();
        let bound = 2.0 * 2000.0 * (2.0_f64.to_radians().powi(2) + 1.0_f64.to_radians().powi(2)) / 8.0;
        for (c, gamma) in directions().filter(|(_, gamma)| *gamma < 90.0) {
            let [found, expected] = [web.at(c, gamma), lopsided(type_c(c.to_radians(), gamma.to_radians()))];
            assert!((found - expected).abs() < bound, "C {c} γ {gamma}: {found}, expected {expected} ± {bound}");
        }
        assert!((web.flux() / flux - 1.0).abs() < 1e-12);
        // ∫ (600 + 400 cos γ) cos γ over the hemisphere; x and y cancel.
        let closed = 600.0 * PI + 400.0 * 2.0 * PI / 3.0;
        assert!((flux / closed - 1.0).abs() < 2.0 * 2.0_f64.to_radians().powi(2) / 8.0, "{flux}, expected {closed}");
    }

    #[test]
    fn type_a_is_type_c_under_other_names() {
        let bulge: fn([f64; 3]) -> f64 = |[x, y, z]| (500.0 + 200.0 * y + 100.0 * z) * x.max(0.0);
        let web = tabulate(steps(-90.0, 90.0, 2.0), steps(-90.0, 90.0, 2.0), type_a, bulge).type_a_to_c();
        let bound = 2.0 * 1500.0 * 2.0_f64.to_radians().powi(2) / 8.0;
        for (c, gamma) in directions() {
            let [found, expected] = [web.at(c, gamma), bulge(type_c(c.to_radians(), gamma.to_radians()))];
            assert!((found - expected).abs() < bound, "C {c} γ {gamma}: {found}, expected {expected} ± {bound}");
        }
        let closed = 500.0 * PI;
        assert!((web.flux() / closed - 1.0).abs() < 2.0 * 2.0_f64.to_radians().powi(2) / 8.0, "{}", web.flux());
    }

    /// Light of full strength up to the edge of the table: half of the sphere is lit, the other half isn't.
    #[test]
    fn a_table_of_type_a_ends_where_it_ends() {
        let web = tabulate(vec![-90.0, 90.0], vec![-90.0, 90.0], type_a, |_| 100.0).type_a_to_c();
        assert!((web.flux() / (200.0 * PI) - 1.0).abs() < 1.01 * EDGE / 180.0, "{}", web.flux());
        assert_eq!((web.at(89.0, 90.0), web.at(271.0, 90.0), web.at(180.0, 90.0)), (100.0, 100.0, 0.0));
    }

    /// 1000 cos θ about the nadir or the horizon is 1000 π lm; at steps of 1° linear interpolation errs by under
    /// max |f″| h²/8 = 1000 · 3·10⁻⁴ / 8 in each direction.
    #[test]
    fn one_plane_is_the_same_about_its_axis() {
        let of = |from: f64, value: fn(f64) -> f64| {
            let angles = steps(from, 90.0, 1.0);
            let candela = angles.iter().map(|v| value(v.to_radians())).collect();
            IntensityTable { planes: vec![0.0], angles, candela }
        };
        let cosine: fn(f64) -> f64 = |v| 1000.0 * v.cos();
        for table in [of(0.0, cosine), of(-90.0, cosine)] {
            let down = table.clone().about_axis(false).unwrap();
            let out = table.about_axis(true).unwrap();
            for (c, gamma) in directions() {
                let [x, _, z] = type_c(c.to_radians(), gamma.to_radians());
                assert!((down.at(c, gamma) - 1000.0 * (-z).max(0.0)).abs() < 0.1, "C {c} γ {gamma}");
                let error = (out.at(c, gamma) - 1000.0 * x.max(0.0)).abs();
                assert!(error < 9.0, "C {c} γ {gamma}: {error}"); // a step of 1° across the edge of darkness: 17 cd / 2
            }
            assert!([down, out].iter().all(|web| (web.flux() / (1000.0 * PI) - 1.0).abs() < 1e-4));
        }
        assert!(of(-90.0, |v| 1000.0 * v.cos() * (1.0 + v.sin())).about_axis(false).is_none());
    }

    /// A quarter of a table that is symmetrical about both of its axes says as much as the whole.
    #[test]
    fn mirror_images_are_as_good_as_the_whole() {
        let even: fn([f64; 3]) -> f64 = |[x, y, z]| 100.0 + 50.0 * x.abs() + 70.0 * y * y - 10.0 * z;
        let whole = tabulate(steps(-90.0, 90.0, 5.0), steps(-90.0, 90.0, 5.0), type_b, even).type_b_to_c();
        let quarter = tabulate(steps(0.0, 90.0, 5.0), steps(0.0, 90.0, 5.0), type_b, even).type_b_to_c();
        for (c, gamma) in directions() {
            let [found, expected] = [quarter.at(c, gamma), whole.at(c, gamma)];
            assert!((found - expected).abs() < 1e-9 * 200.0, "C {c} γ {gamma}: {found}, expected {expected}");
        }
    }

    #[test]
    fn planes_are_where_symmetry_puts_them() {
        let table = |planes: &[f64]| IntensityTable {
            planes: planes.to_vec(),
            angles: vec![0.0, 90.0],
            candela: planes.iter().flat_map(|c| [*c + 1.0; 2]).collect(),
        };
        let quadrant = table(&[0.0, 30.0, 90.0]).unfold(Symmetry::Quadrant);
        assert_eq!(quadrant.planes(), [0.0, 30.0, 90.0, 150.0, 180.0, 210.0, 270.0, 330.0]);
        assert_eq!([150.0, 210.0, 330.0, 180.0, 270.0].map(|c| quadrant.at(c, 45.0)), [31.0, 31.0, 31.0, 1.0, 91.0]);
        let half = table(&[0.0, 45.0, 180.0]).unfold(Symmetry::AboutC0);
        assert_eq!(half.planes(), [0.0, 45.0, 180.0, 315.0]);
        assert_eq!(half.at(315.0, 0.0), 46.0);
        let other = table(&[90.0, 120.0, 270.0]).unfold(Symmetry::AboutC90);
        assert_eq!(other.planes(), [60.0, 90.0, 120.0, 270.0]);
        assert_eq!(other.at(60.0, 0.0), 121.0);
        let one = table(&[0.0]).unfold(Symmetry::Rotational);
        assert_eq!((one.planes(), one.at(123.0, 10.0)), (&[0.0][..], 1.0));
        assert!([-0.0, 0.0, 360.0, -720.0].iter().all(|angle| within_turn(*angle).is_sign_positive()));
    }
}
