//! A distribution in a few figures: flux, largest intensity, beam and field angles.

use crate::luminaire::intensity::Intensity;

/// Light of a luminaire in a few figures.
#[derive(Clone, Debug)]
pub struct Figures {
    /// Luminous flux, lm: the integral of intensity.
    pub flux: f64,
    /// Share of it below the horizon, 0 … 1.
    pub down: f64,
    /// Largest intensity, cd, and the first direction that has it: C and γ, degrees.
    pub largest: [f64; 3],
    /// Where intensity is at least half of the section's largest: in C0–C180 and C90–C270.
    pub beam: [Spread; 2],
    /// Where it is at least a tenth of that.
    pub field: [Spread; 2],
}

/// The outermost directions of a section that reach a share of its largest intensity, seen from the axis in whose
/// half space that largest is; degrees from it, positive towards the first plane of the section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// The one on the other side.
    pub from: f64,
    /// The one on the side of the first plane.
    pub to: f64,
}

impl Spread {
    /// The angle between both.
    pub fn angle(self) -> f64 {
        self.to - self.from
    }
}

impl Figures {
    /// Figures of a distribution. Cost: some passes over its table.
    pub fn new(intensity: &Intensity) -> Self {
        let mut largest = [f64::NEG_INFINITY, 0.0, 0.0];
        for (plane, &c) in intensity.planes().iter().enumerate() {
            for (&value, &gamma) in intensity.plane(plane).iter().zip(intensity.angles()) {
                if value > largest[0] {
                    largest = [value, c, gamma];
                }
            }
        }
        let flux = intensity.flux();
        let down = if flux > 0.0 { below(intensity).map_or(0.0, |part| part.flux()) / flux } else { 0.0 };
        let sections = [0.0, 90.0].map(|c| PlaneSection::new(intensity, c));
        let [beam, field] = [0.5, 0.1].map(|share| sections.each_ref().map(|section| section.spread(share)));
        Self { flux, down: down.clamp(0.0, 1.0), largest, beam, field }
    }
}

/// The part of a distribution below the horizon.
fn below(intensity: &Intensity) -> Option<Intensity> {
    let angles = intensity.angles();
    let last = angles[angles.len() - 1].min(90.0);
    let kept: Vec<f64> = angles.iter().copied().filter(|angle| *angle < last).chain([last]).collect();
    let planes = intensity.planes().to_vec();
    let candela = planes.iter().flat_map(|&c| kept.iter().map(move |&gamma| intensity.at(c, gamma))).collect();
    (angles[0] < 90.0).then(|| Intensity::new(planes, kept, candela))
}

/// Intensities in a plane and the one opposite, over the angle from the axis in whose half space the largest is.
struct PlaneSection {
    /// Angle and intensity, ascending from −180° to 180°.
    points: Vec<[f64; 2]>,
    largest: f64,
}

impl PlaneSection {
    fn new(intensity: &Intensity, c: f64) -> Self {
        let angles = intensity.angles();
        let both = |gamma: f64| [c, c + 180.0].map(|c| intensity.at(c, gamma));
        let peak = |keep: fn(f64) -> bool| {
            angles.iter().filter(|gamma| keep(**gamma)).flat_map(|&gamma| both(gamma)).fold(0.0, f64::max)
        };
        let (down, up) = (peak(|gamma| gamma <= 90.0), peak(|gamma| gamma > 90.0));
        let from_axis = |gamma: f64| if up > down { 180.0 - gamma } else { gamma };
        // Just beyond the table there is no light.
        let (first, last) = (angles[0], angles[angles.len() - 1]);
        let ends =
            [first - 1e-9, last + 1e-9, 0.0, 90.0, 180.0].into_iter().filter(|gamma| (0.0..=180.0).contains(gamma));
        let mut points: Vec<[f64; 2]> = angles
            .iter()
            .copied()
            .chain(ends)
            .flat_map(|gamma| {
                let [near, far] = both(gamma);
                [[from_axis(gamma), near], [-from_axis(gamma), far]]
            })
            .collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        Self { points, largest: down.max(up) }
    }

    /// Where intensity reaches a share of the largest: outermost within 90° of the axis, and on from there if it
    /// still does.
    fn spread(&self, share: f64) -> Spread {
        let (points, threshold) = (&self.points, share * self.largest);
        let reaches = |point: &[f64; 2]| point[1] >= threshold;
        let near = |point: &[f64; 2]| point[0].abs() <= 90.0;
        let (Some(mut low), Some(mut high)) = (
            points.iter().position(|point| near(point) && reaches(point)),
            points.iter().rposition(|point| near(point) && reaches(point)),
        ) else {
            return Spread { from: 0.0, to: 0.0 };
        };
        while low > 0 && reaches(&points[low - 1]) {
            low -= 1;
        }
        while high + 1 < points.len() && reaches(&points[high + 1]) {
            high += 1;
        }
        let crossing = |inside: usize, outside: Option<&[f64; 2]>| {
            let [angle, value] = points[inside];
            outside.map_or(angle, |[beyond, less]| angle + (beyond - angle) * (value - threshold) / (value - less))
        };
        let before = low.checked_sub(1).map(|index| &points[index]);
        Spread { from: crossing(low, before), to: crossing(high, points.get(high + 1)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// I(0) cosⁿ γ on every degree: half is left where cosⁿ γ = ½.
    fn lobe(power: i32, up: bool) -> Intensity {
        let angles: Vec<f64> = (0..=180).map(f64::from).collect();
        let value = |gamma: &f64| {
            let cos = gamma.to_radians().cos();
            1000.0 * (if up { -cos } else { cos }).max(0.0).powi(power)
        };
        let candela = angles.iter().map(value).collect();
        Intensity::new(vec![0.0], angles, candela)
    }

    /// Linear interpolation between degrees displaces a crossing by less than a hundredth of a degree here.
    #[test]
    fn beams_of_cosine_powers_are_as_wide_as_their_formula_says() {
        for (power, up) in [(1, false), (3, false), (20, false), (3, true)] {
            let figures = Figures::new(&lobe(power, up));
            for (share, spreads) in [(0.5_f64, figures.beam), (0.1, figures.field)] {
                let half = share.powf(1.0 / f64::from(power)).acos().to_degrees();
                for spread in spreads {
                    assert!(
                        (spread.to - half).abs() < 0.01 && (spread.from + half).abs() < 0.01,
                        "{power}: {spread:?}"
                    );
                }
            }
            assert_eq!(figures.down > 0.999, !up);
            assert_eq!((figures.largest[0], figures.largest[2]), (1000.0, if up { 180.0 } else { 0.0 }));
        }
    }

    #[test]
    fn an_isotropic_lamp_shines_half_down_and_all_around() {
        let figures = Figures::new(&Intensity::new(vec![0.0], vec![0.0, 180.0], vec![10.0; 2]));
        assert!((figures.down - 0.5).abs() < 1e-12);
        assert_eq!(figures.beam[0].angle(), 360.0);
    }

    /// Two planes with light from 20° to 40° in C0 only: full strength up to the edge of the table.
    #[test]
    fn lopsided_beams_have_their_own_sides() {
        let web = Intensity::new(vec![0.0, 180.0], vec![20.0, 40.0], vec![100.0, 100.0, 0.0, 0.0]);
        let beam = Figures::new(&web).beam[0];
        assert!((beam.from - 20.0).abs() < 1e-6 && (beam.to - 40.0).abs() < 1e-6, "{beam:?}");
    }
}
