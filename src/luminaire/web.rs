//! A measured distribution made ready: intensity towards any direction, and directions drawn by it.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::frame::c0_direction;
use super::intensity::Intensity;
use crate::random::Stream;

/// Wedges by which a distribution of one plane is judged around its axis.
const WEDGES: usize = 24;
/// Halvings of an interval after which nothing of it is left in double precision.
const MOST_STEPS: usize = 64;

/// Luminous intensity per lumen over directions, with sums that let directions be drawn. Luminaires of one file share
/// it.
///
/// Directions are in the luminaire's frame: x along C0, y along C90, z along the aim (γ = 0).
/// Memory: two numbers for each intensity of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Web {
    /// Whence it is, in words.
    source: String,
    intensity: Intensity,
    /// Flux of the table, lm.
    flux: f64,
    /// For the cells of each wedge between two planes, γ after γ: running sum of their shares of the flux; the last is
    /// 1.
    shares: Vec<f64>,
    /// For each step in γ: ∫ (1 − t) sin γ dγ and ∫ t sin γ dγ, t running from 0 to 1 over it.
    hats: Vec<[f64; 2]>,
    /// For each step in γ the cosines of its ends, falling, and the largest intensity in it, cd/lm.
    peaks: Vec<([f64; 2], f64)>,
    /// Largest intensity, cd/lm.
    most: f64,
    /// Angle over which intensity may change by its largest value, rad.
    scale: f64,
}

impl Web {
    /// Prepares a table; nothing for one without light. Cost: O(table).
    pub fn new(intensity: Intensity) -> Option<Self> {
        let flux = intensity.flux();
        if !(flux > 0.0 && flux.is_finite()) {
            return None;
        }
        let hats: Vec<[f64; 2]> = intensity
            .angles()
            .windows(2)
            .map(|pair| {
                let [a, b] = [pair[0].to_radians(), pair[1].to_radians()];
                let slope = (b.sin() - a.sin()) / (b - a);
                [a.cos() - slope, slope - b.cos()]
            })
            .collect();
        let planes = intensity.planes().len();
        let mut shares = Vec::with_capacity(planes * hats.len());
        let mut sum = 0.0;
        for plane in 0..planes {
            let width = if planes == 1 { TAU } else { intensity.width(plane).to_radians() };
            let (from, to) = (intensity.plane(plane), intensity.plane((plane + 1) % planes));
            for (step, hat) in hats.iter().enumerate() {
                sum += width * (ring(from, step, hat) + ring(to, step, hat)) / 2.0;
                shares.push(sum);
            }
        }
        shares.iter_mut().for_each(|share| *share /= sum);
        let most = (0..planes).flat_map(|plane| intensity.plane(plane)).copied().fold(0.0, f64::max) / flux;
        let peak = |step: usize| {
            let cosines = [step, step + 1].map(|end| intensity.angles()[end].to_radians().cos());
            let largest = |plane: usize| intensity.plane(plane)[step].max(intensity.plane(plane)[step + 1]);
            (cosines, (0..planes).map(largest).fold(0.0, f64::max) / flux)
        };
        let peaks = (0..hats.len()).map(peak).collect();
        let mut web = Self { source: String::new(), intensity, flux, shares, hats, peaks, most, scale: PI };
        web.scale = (web.most / web.steepest()).min(PI);
        Some(web)
    }

    /// The same with words that say where it is from, such as a file's name.
    pub fn named(self, source: impl Into<String>) -> Self {
        Self { source: source.into(), ..self }
    }

    /// Whence it is, in words.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// Luminous flux of the table as it was given, lm.
    pub fn flux(&self) -> f64 {
        self.flux
    }

    /// The table as it was given.
    pub fn table(&self) -> &Intensity {
        &self.intensity
    }

    /// Largest intensity, cd/lm.
    pub fn most(&self) -> f64 {
        self.most
    }

    /// Angle over which intensity may change by as much as its largest value, rad: how fine directions have to be told
    /// apart.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Intensity towards a direction (of any length), cd/lm. Cost: some 50 ns.
    #[inline]
    pub fn at(&self, direction: DVec3) -> f64 {
        let DVec3 { x, y, z } = direction;
        let gamma = x.hypot(y).atan2(z).to_degrees();
        let c = if self.intensity.planes().len() > 1 { y.atan2(x).to_degrees() } else { 0.0 };
        self.intensity.at(c, gamma) / self.flux
    }

    /// A direction of density I/Φ, from three numbers in 0 … 1: the first chooses a cell of the table by its flux, the
    /// others C and γ in it. Exact: C by the inverse of its (quadratic) sum, γ by Newton's method to rounding. Cost:
    /// some 150 ns.
    pub fn sample(&self, [choice, across, along]: [f64; 3]) -> DVec3 {
        let cell = self.shares.partition_point(|&share| share <= choice).min(self.shares.len() - 1);
        let (plane, step) = (cell / self.hats.len(), cell % self.hats.len());
        let (planes, angles) = (self.intensity.planes(), self.intensity.angles());
        let next = (plane + 1) % planes.len();
        let (from, to) = (self.intensity.plane(plane), self.intensity.plane(next));
        let (c, share) = if planes.len() == 1 {
            (360.0 * across, 0.0)
        } else {
            let hat = &self.hats[step];
            let share = on_line(ring(from, step, hat), ring(to, step, hat), across);
            (planes[plane] + self.intensity.width(plane) * share, share)
        };
        let ends = [step, step + 1].map(|step| from[step] + (to[step] - from[step]) * share);
        let gamma = on_ring(angles[step].to_radians(), angles[step + 1].to_radians(), ends, along);
        let ((sin_c, cos_c), (sin, cos)) = (c.to_radians().sin_cos(), gamma.sin_cos());
        DVec3::new(sin * cos_c, sin * sin_c, cos)
    }

    /// Largest intensity where the cosine of γ is in a range, cd/lm. Cost: O(angles).
    pub fn most_between(&self, least: f64, most: f64) -> f64 {
        let meets = |cosines: &[f64; 2]| cosines[1] <= most && cosines[0] >= least;
        self.peaks.iter().filter(|(cosines, _)| meets(cosines)).map(|(_, peak)| *peak).fold(0.0, f64::max)
    }

    /// Largest intensity of the table's cells that reach to the side of the unit vector `side` (luminaire's frame),
    /// cd/lm: 0 means that no light goes there.
    pub fn most_towards(&self, side: DVec3) -> f64 {
        let mut most = 0.0_f64;
        self.each_cell(|corners| {
            if corners.iter().any(|(direction, _)| direction.dot(side) > 1e-9) {
                most = corners.iter().fold(most, |most, (_, candela)| most.max(*candela));
            }
        });
        most / self.flux
    }

    /// Largest change of intensity with angle, cd/lm/rad.
    fn steepest(&self) -> f64 {
        let mut most = 0.0_f64;
        self.each_cell(|[a, b, c, d]| {
            let slope = |p: &(DVec3, f64), q: &(DVec3, f64)| (p.1 - q.1).abs() / p.0.distance(q.0).max(1e-3);
            // Along γ on both planes, and across where planes are farthest apart.
            let across = if a.0.distance(c.0) > b.0.distance(d.0) { slope(a, c) } else { slope(b, d) };
            most = most.max(slope(a, b)).max(slope(c, d)).max(across);
        });
        most / self.flux
    }

    /// Corners of every cell, direction and cd: both ends of γ in one plane, then in the next.
    fn each_cell(&self, mut visit: impl FnMut(&[(DVec3, f64); 4])) {
        let planes = self.intensity.planes();
        let wedges = if planes.len() == 1 { WEDGES } else { planes.len() };
        let angle = |wedge: usize| match planes.len() {
            1 => 360.0 * wedge as f64 / WEDGES as f64,
            count => planes[wedge % count],
        };
        for wedge in 0..wedges {
            for step in 0..self.hats.len() {
                let corner = |wedge: usize, step: usize| {
                    let (sin_c, cos_c) = angle(wedge).to_radians().sin_cos();
                    let (sin, cos) = self.intensity.angles()[step].to_radians().sin_cos();
                    let candela = self.intensity.plane(wedge % planes.len())[step];
                    (DVec3::new(sin * cos_c, sin * sin_c, cos), candela)
                };
                visit(
                    &[(wedge, step), (wedge, step + 1), (wedge + 1, step), (wedge + 1, step + 1)]
                        .map(|(wedge, step)| corner(wedge, step)),
                );
            }
        }
    }
}

/// ∫ I sin γ dγ over a step of a plane.
fn ring(plane: &[f64], step: usize, [near, far]: &[f64; 2]) -> f64 {
    plane[step] * near + plane[step + 1] * far
}

/// The place (0 … 1) below which the part `share` of a density lies that runs straight from `a` to `b`.
fn on_line(a: f64, b: f64, share: f64) -> f64 {
    let root = (a * a + share * (b * b - a * a)).max(0.0).sqrt();
    if a + root > 0.0 { (share * (a + b) / (a + root)).min(1.0) } else { share }
}

/// The angle between `a` and `b` (rad) below which the part `share` of ∫ I sin γ dγ lies, I running straight from one
/// of the `ends` to the other.
fn on_ring(a: f64, b: f64, [from, to]: [f64; 2], share: f64) -> f64 {
    let width = b - a;
    let (sin_a, cos_a) = a.sin_cos();
    let upto = |t: f64| {
        let (sin, cos) = (a + width * t).sin_cos();
        let value = from + (to - from) * t;
        // The integral, and its derivative by t.
        (from * cos_a - value * cos + (to - from) / width * (sin - sin_a), value * sin * width)
    };
    let wanted = share * upto(1.0).0;
    let (mut low, mut high) = (0.0, 1.0);
    let mut t = on_line(from * sin_a, to * b.sin(), share);
    for _ in 0..MOST_STEPS {
        let (found, slope) = upto(t);
        if found < wanted {
            low = t
        } else {
            high = t
        }
        let newton = t - (found - wanted) / slope;
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        let moved = (next - t).abs();
        t = next;
        if moved < 1e-14 {
            break;
        }
    }
    a + width * t
}

/// A web as a luminaire holds it in the room.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    web: Arc<Web>,
    /// C0, C90 and the aim.
    axes: [DVec3; 3],
}

impl Measured {
    /// A web whose γ = 0 looks along the unit vector `aim` and whose C0 lies as the luminaire's `rotation` (degrees)
    /// says.
    ///
    /// Hanging straight down with C0 towards +x it has C90 towards +y; `rotation` turns from C0 towards C90.
    pub fn new(web: Arc<Web>, aim: DVec3, rotation: f64) -> Self {
        let c0 = c0_direction(aim, rotation);
        Self { web, axes: [c0, c0.cross(aim), aim] }
    }

    /// The web.
    pub fn web(&self) -> &Web {
        &self.web
    }

    /// Intensity towards a direction of the room (of any length), cd/lm.
    #[inline]
    pub fn at(&self, direction: DVec3) -> f64 {
        self.web.at(self.local(direction))
    }

    /// A unit vector of the room, of density I/Φ.
    #[inline]
    pub fn draw(&self, stream: &mut Stream) -> Vec3 {
        let choice = f64::from(stream.uniform());
        let [across, along] = stream.uniform_pair().map(f64::from);
        let [x, y, z] = self.web.sample([choice, across, along]).to_array();
        (self.axes[0] * x + self.axes[1] * y + self.axes[2] * z).as_vec3().normalize()
    }

    /// Unit vector along γ = 0.
    pub fn aim(&self) -> DVec3 {
        self.axes[2]
    }

    /// A direction of the room in the luminaire's frame.
    #[inline]
    pub fn local(&self, direction: DVec3) -> DVec3 {
        DVec3::from(self.axes.map(|axis| axis.dot(direction)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Seed;

    /// Tables of every kind: one plane or several, uneven steps, dark cells, light upwards, a jump, a narrow spot.
    fn tables() -> Vec<(&'static str, Intensity)> {
        let lambert: Vec<f64> = (0..=18).map(|i| (f64::from(5 * i)).to_radians().cos().max(0.0)).collect();
        let uneven = vec![0.0, 1.0, 4.0, 30.0, 31.0, 90.0, 170.0, 180.0];
        let spot: Vec<f64> = (0..=180).map(|g| (-0.5 * f64::from(g * g) / 9.0).exp()).collect();
        vec![
            ("isotropic", Intensity::new(vec![0.0], vec![0.0, 180.0], vec![1.0; 2])),
            ("lambert", Intensity::new(vec![0.0], (0..=18).map(|i| f64::from(5 * i)).collect(), lambert)),
            ("spot", Intensity::new(vec![0.0], (0..=180).map(f64::from).collect(), spot)),
            ("up", Intensity::new(vec![0.0], vec![90.0, 120.0, 180.0], vec![0.0, 5.0, 1.0])),
            (
                "uneven",
                Intensity::new(
                    vec![0.0, 10.0, 90.0, 200.0, 350.0],
                    uneven.clone(),
                    (0..40).map(|i| f64::from((i * 7 + i / 8 * 3) % 11) * f64::from(u8::from(i % 5 > 0))).collect(),
                ),
            ),
            ("turned", Intensity::new(vec![-90.0, 0.0, 90.0], uneven, (0..24).map(f64::from).collect())),
        ]
    }

    /// χ² of drawn directions over 24 × 36 fields of (C, γ): expected shares by a fine midpoint rule of the bilinear
    /// table, which knows nothing of the sampler. For n fields the sum is n ± √(2n); 5 σ allowed. Fields of fewer than
    /// ten expected directions are put together.
    #[test]
    fn directions_follow_the_table() {
        let (sectors, zones, fine, count) = (24, 36, 40, 400_000);
        for (name, table) in tables() {
            let web = Web::new(table).expect("light");
            let mut expected = vec![0.0; sectors * zones];
            for sector in 0..sectors * fine {
                for zone in 0..zones * fine {
                    let c = 360.0 * (sector as f64 + 0.5) / (sectors * fine) as f64;
                    let gamma = 180.0 * (zone as f64 + 0.5) / (zones * fine) as f64;
                    let solid_angle = gamma.to_radians().sin() * TAU * PI / (sectors * zones * fine * fine) as f64;
                    expected[sector / fine * zones + zone / fine] += web.table().at(c, gamma) * solid_angle;
                }
            }
            let whole: f64 = expected.iter().sum();
            assert!((whole / web.flux() - 1.0).abs() < 1e-3, "{name}: midpoint rule {whole}, exact {}", web.flux());
            let mut found = vec![0.0; sectors * zones];
            let mut stream = Seed(1).stream(7);
            for _ in 0..count {
                let [a, b] = stream.uniform_pair().map(f64::from);
                let d = web.sample([f64::from(stream.uniform()), a, b]);
                assert!((d.length() - 1.0).abs() < 1e-12);
                let turn = d.y.atan2(d.x).rem_euclid(TAU) / TAU;
                let zone = d.x.hypot(d.y).atan2(d.z) / PI;
                let place = |part: f64, of: usize| ((part * of as f64) as usize).min(of - 1);
                found[place(turn, sectors) * zones + place(zone, zones)] += 1.0;
            }
            let (mut square, mut fields, mut rest) = (0.0, 0.0, (0.0, 0.0));
            for (found, expected) in found.iter().zip(&expected) {
                let expected = expected / whole * f64::from(count);
                if expected < 10.0 {
                    rest = (rest.0 + found, rest.1 + expected);
                } else {
                    square += (found - expected).powi(2) / expected;
                    fields += 1.0;
                }
            }
            // The midpoint rule's own error of 1e-3 of a field's share would show as up to count · 1e-6.
            let bound = fields + 5.0 * (2.0_f64 * fields).sqrt() + 1e-6 * f64::from(count);
            println!("{name}: χ² {square:.1} over {fields} fields, rest {rest:?}");
            assert!(square < bound, "{name}: χ² {square} over {fields} fields");
            assert!((rest.0 - rest.1).abs() <= 5.0 * (rest.1 + 1.0_f64).sqrt(), "{name}: {rest:?}");
        }
    }

    /// The inverse of ∫ I sin γ dγ, put back into the integral by Simpson's rule, gives the share back.
    #[test]
    fn the_inverse_along_a_ring_is_exact() {
        for (a, b, ends) in
            [(0.0, 0.1, [1.0, 0.0]), (0.0, PI, [1.0, 1.0]), (1.5, 1.6, [0.0, 3.0]), (3.0, PI, [2.0, 5.0])]
        {
            let integral = |upto: f64| -> f64 {
                let steps = 2000;
                let h = (upto - a) / f64::from(steps);
                let f = |i: i32| {
                    let gamma = a + h * f64::from(i);
                    (ends[0] + (ends[1] - ends[0]) * (gamma - a) / (b - a)) * gamma.sin()
                };
                (0..steps).step_by(2).map(|i| h / 3.0 * (f(i) + 4.0 * f(i + 1) + f(i + 2))).sum()
            };
            for share in [0.0, 1e-6, 0.1, 0.5, 0.9, 1.0 - 1e-6, 1.0] {
                let found = integral(on_ring(a, b, ends, share)) / integral(b);
                assert!((found - share).abs() < 1e-9, "{a} … {b}, {ends:?}: {share}, got {found}");
            }
        }
    }

    /// Hanging straight down C0 is +x and C90 is +y; looking along +x, the web has γ = 0 there and C0 up.
    #[test]
    fn planes_lie_where_the_frame_says() {
        let table = Intensity::new(
            vec![0.0, 90.0, 180.0, 270.0],
            vec![0.0, 90.0, 180.0],
            vec![1.0, 10.0, 3.0, 1.0, 20.0, 3.0, 1.0, 30.0, 3.0, 1.0, 40.0, 3.0],
        );
        let web = Arc::new(Web::new(table).expect("light"));
        let candela = |aim: DVec3, rotation: f64, direction: DVec3| {
            Measured::new(Arc::clone(&web), aim, rotation).at(direction) * web.flux()
        };
        let expect = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found} cd, not {expected}");
        let down = DVec3::NEG_Z;
        for (direction, expected) in
            [(down, 1.0), (DVec3::X, 10.0), (DVec3::Y, 20.0), (DVec3::NEG_X, 30.0), (DVec3::NEG_Y, 40.0), (-down, 3.0)]
        {
            expect(candela(down, 0.0, direction), expected);
        }
        expect(candela(down, 90.0, DVec3::Y), 10.0); // seen from above, turned counter-clockwise
        expect(candela(DVec3::X, 0.0, DVec3::X), 1.0);
        expect(candela(DVec3::X, 0.0, DVec3::Z), 10.0);
        expect(candela(DVec3::X, 0.0, DVec3::Y), 20.0);
    }

    #[test]
    fn only_sides_with_light_have_some() {
        let down = Web::new(Intensity::new(vec![0.0], vec![0.0, 45.0, 90.0], vec![3.0, 2.0, 1.0])).expect("light");
        assert!(down.most_towards(DVec3::NEG_Z) == 0.0 && down.most_towards(DVec3::Z) == down.most());
        let side = Intensity::new(
            vec![0.0, 90.0, 180.0, 270.0],
            vec![0.0, 90.0],
            [[0.0, 0.0], [0.0, 5.0], [0.0; 2], [0.0; 2]].concat(),
        );
        let side = Web::new(side).expect("light");
        assert!(side.most_towards(DVec3::Y) > 0.0);
        assert_eq!(side.most_towards(DVec3::NEG_Y), 0.0);
        assert!(Web::new(Intensity::new(vec![0.0], vec![0.0, 90.0], vec![0.0; 2])).is_none());
    }
}
