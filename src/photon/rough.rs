//! Rough mirrors: what light does among the facets of a GGX microsurface.
//!
//! The surface is made of tiny perfect mirrors whose normals follow the GGX law (Trowbridge & Reitz 1975; Walter et al.
//! 2007) and whose heights do not depend on their slopes (Smith 1967). Light bounces from facet to facet until it gets
//! out, as a random walk (Heitz et al. 2016): so every lumen that goes in comes out, at any roughness and angle, where
//! the usual formula, which follows one bounce only, loses up to half of it. Its first bounce is that formula, with
//! height-correlated masking and shadowing. The walk needs no law of heights: it only needs which share of the surface
//! lies below where the light is, and a flight multiplies that share by v^(−1/Λ), v uniform (from Heitz et al., G₁ =
//! C₁^Λ).
//!
//! The material's `specular` multiplies what comes out, once: it is the share reflected at any angle, whatever the
//! roughness. Directions here are in the frame of the surface, whose normal is z, unless they come with a normal.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::optics::mirror;
use crate::random::{Stream, on_circle};

/// Roughness below this counts as this: single precision resolves no finer facets.
const FINEST: f32 = 1e-4;
/// Facets that light meets at most; it then leaves as from the first. GGX of roughness 1 lets more than half of the
/// light go at each.
const MAX_FACETS: u32 = 1000;
/// Light flying so near the normal that it would meet another facet less often than this gets out.
const STEEPEST: f32 = 1e-6;
/// Least cosine of what leaves: rounding must not carry it through the surface.
const SHALLOWEST: f32 = 1e-6;

/// A rough mirror that loses nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Microsurface {
    /// GGX's α.
    alpha: f32,
}

impl Microsurface {
    /// One of GGX roughness α; `None` at 0, a perfect mirror.
    pub(crate) fn new(roughness: f64) -> Option<Self> {
        (roughness > 0.0).then(|| Self { alpha: (roughness as f32).max(FINEST) })
    }

    /// Where light goes that arrives along `direction` at a surface whose unit normal `facing` is against it. Never
    /// below the horizon. Cost: some 50 ns.
    pub(crate) fn reflect(self, direction: Vec3, facing: Vec3, stream: &mut Stream) -> Vec3 {
        let frame = Frame::about(facing);
        let arriving = frame.local(direction);
        let (mut onward, mut below) = (arriving, 1.0);
        for _ in 0..MAX_FACETS {
            match self.fly(below, onward, stream) {
                Some(next) => below = next,
                None => return frame.world(onward.with_z(onward.z.max(SHALLOWEST)).normalize()),
            }
            onward = mirror(onward, self.visible_normal(-onward, stream));
        }
        mirror(direction, facing)
    }

    /// About the density (1/sr) with which [`reflect`](Self::reflect) sends light from `eye` to `light` (unit vectors
    /// away from the surface): its first bounce exactly, the others as if they left by Lambert's law. Never 0 above the
    /// horizon, so that it can stand for the density in multiple importance sampling. Symmetric but for the cosine of
    /// `light`.
    pub(crate) fn lobe(self, eye: Vec3, light: Vec3, facing: Vec3) -> f32 {
        let frame = Frame::about(facing);
        self.local_lobe(frame.local(eye), frame.local(light))
    }

    fn local_lobe(self, eye: Vec3, light: Vec3) -> f32 {
        if light.z <= 0.0 {
            return 0.0;
        }
        self.first_bounce(eye, light) + 0.5 * self.alpha * self.alpha * light.z * FRAC_1_PI
    }

    /// An estimate without bias of that density: the reflected radiance per radiance and solid angle of light from
    /// `light`, cosine included. Only bounces after the first are drawn.
    pub(crate) fn scattered(self, eye: Vec3, light: Vec3, facing: Vec3, stream: &mut Stream) -> f32 {
        let frame = Frame::about(facing);
        let (eye, light) = (frame.local(eye), frame.local(light));
        if light.z <= 0.0 {
            return 0.0;
        }
        let mut found = self.first_bounce(eye, light);
        let (mut onward, mut below) = (-eye, 1.0);
        for facet in 0..MAX_FACETS {
            match self.fly(below, onward, stream) {
                Some(next) => below = next,
                None => break,
            }
            if facet > 0 {
                found += self.facet_lobe(-onward, light) * below.powf(self.lambda(light));
            }
            onward = mirror(onward, self.visible_normal(-onward, stream));
        }
        found
    }

    /// f cos θ of one bounce, D(m) G₂ / (4 cos θ) with G₂ of correlated heights.
    fn first_bounce(self, eye: Vec3, light: Vec3) -> f32 {
        let cos = eye.z.max(SHALLOWEST);
        self.facets(eye + light) / (4.0 * cos * (1.0 + self.lambda(eye) + self.lambda(light)))
    }

    /// Density (1/sr) with which a facet met sends light from `eye`, above the horizon or below, to `light`.
    fn facet_lobe(self, eye: Vec3, light: Vec3) -> f32 {
        let half = eye + light;
        let seen = self.projected_area(eye);
        if half.z > 0.0 && seen > 0.0 { self.facets(half) / (4.0 * seen) } else { 0.0 }
    }

    /// D: area of facets with normals along `half` (any length), per solid angle and area of the surface.
    fn facets(self, half: Vec3) -> f32 {
        let square = self.alpha * self.alpha;
        let stretched = half.z * half.z + (half.x * half.x + half.y * half.y) / square;
        let ratio = half.length_squared() / stretched;
        ratio * ratio * FRAC_1_PI / square
    }

    /// (x, √(1 + x)) with x = α² tan² θ.
    fn slope(self, direction: Vec3) -> (f32, f32) {
        let across = direction.x * direction.x + direction.y * direction.y;
        let x = self.alpha * self.alpha * across / (direction.z * direction.z).max(1e-20);
        (x, (1.0 + x).sqrt())
    }

    /// Smith's Λ: at least 0 for directions that go up, at most −1 for those that go down.
    fn lambda(self, direction: Vec3) -> f32 {
        let (x, root) = self.slope(direction);
        if direction.z > 0.0 { x / (2.0 * (1.0 + root)) } else { -0.5 * (1.0 + root) }
    }

    /// Area of all facets seen from a direction, above the horizon or below, per area of the surface: ∫ D (w·m)⁺ dm.
    fn projected_area(self, from: Vec3) -> f32 {
        let (x, root) = self.slope(from);
        if from.z > 0.0 { 0.5 * (1.0 + root) * from.z } else { -from.z * x / (2.0 * (1.0 + root)) }
    }

    /// Share of the surface that lies below the next facet met by light that flies `onward` from where `below` of it
    /// does; `None` if the light gets out.
    fn fly(self, below: f32, onward: Vec3, stream: &mut Stream) -> Option<f32> {
        let lambda = self.lambda(onward);
        if (0.0..STEEPEST).contains(&lambda) {
            return None;
        }
        let next = below * (1.0 - stream.uniform()).powf(-1.0 / lambda);
        (lambda < 0.0 || next < 1.0).then_some(next)
    }

    /// Normal of a facet, drawn among those seen from a direction, above the horizon or below, by the area it shows: on
    /// a stretched hemisphere, mirrored directions are uniform over a cap of the sphere (Dupuy & Benyoub 2023).
    fn visible_normal(self, from: Vec3, stream: &mut Stream) -> Vec3 {
        let from = Vec3::new(self.alpha * from.x, self.alpha * from.y, from.z).normalize();
        // Height of the cap, 1 + z; the second form keeps its digits where z is near −1.
        let across = from.x * from.x + from.y * from.y;
        let cap = if from.z > -0.5 { 1.0 + from.z } else { across / (1.0 - from.z) };
        let [a, b] = stream.uniform_pair();
        let [cos, sin] = on_circle(b);
        let radius = (a * cap * (2.0 - a * cap)).max(0.0).sqrt();
        let half = Vec3::new(from.x + radius * cos, from.y + radius * sin, (1.0 - a) * cap);
        Vec3::new(self.alpha * half.x, self.alpha * half.y, half.z).normalize()
    }
}

/// Axes with a surface's normal as z.
struct Frame {
    x: Vec3,
    y: Vec3,
    z: Vec3,
}

impl Frame {
    fn about(normal: Vec3) -> Self {
        let (x, y) = normal.any_orthonormal_pair();
        Self { x, y, z: normal }
    }

    fn local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.x), v.dot(self.y), v.dot(self.z))
    }

    fn world(&self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    use crate::random::Seed;

    const ROUGHNESSES: [f32; 6] = [0.05, 0.1, 0.25, 0.5, 0.8, 1.0];
    const ANGLES: [f32; 8] = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0, 89.0];

    /// Unit vector at `degrees` from the normal.
    fn at(degrees: f32) -> Vec3 {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Vec3::new(sin, 0.0, cos)
    }

    /// Mean of samples, and its standard error.
    #[derive(Default)]
    struct SampleMean {
        count: f64,
        sum: f64,
        square: f64,
    }

    impl SampleMean {
        fn add(&mut self, value: f32) {
            let value = f64::from(value);
            (self.count, self.sum, self.square) = (self.count + 1.0, self.sum + value, self.square + value * value);
        }

        fn value(&self) -> f64 {
            self.sum / self.count
        }

        fn error(&self) -> f64 {
            ((self.square / self.count - self.value().powi(2)).max(0.0) / self.count).sqrt()
        }
    }

    /// A direction for light that reflects to `eye`, and its density: by the visible facets or by the cosine, evenly.
    fn proposal(facets: Microsurface, eye: Vec3, stream: &mut Stream) -> (Vec3, f32) {
        let light = if stream.uniform() < 0.5 {
            mirror(-eye, facets.visible_normal(eye, stream))
        } else {
            stream.cosine_about(Vec3::Z)
        };
        (light, 0.5 * facets.facet_lobe(eye, light) + 0.5 * light.z.max(0.0) * FRAC_1_PI)
    }

    /// White furnace: what a lossless surface sends to an eye from all around is what arrives, ∫ f cos θ dω = 1, at any
    /// angle and roughness. Tests the evaluation, which does not depend on the walk's own bookkeeping. 48 cases: 4.5
    /// σ.
    #[test]
    fn a_white_furnace_gives_one_at_all_angles() {
        for alpha in ROUGHNESSES {
            let facets = Microsurface { alpha };
            for degrees in ANGLES {
                let (eye, mut stream, mut mean) = (at(degrees), Seed(1).stream(degrees as u64), SampleMean::default());
                for _ in 0..40_000 {
                    let (light, density) = proposal(facets, eye, &mut stream);
                    mean.add(if light.z > 0.0 {
                        facets.scattered(eye, light, Vec3::Z, &mut stream) / density
                    } else {
                        0.0
                    });
                }
                println!("α {alpha}, {degrees}°: {:.4} ± {:.4}", mean.value(), mean.error());
                assert!((mean.value() - 1.0).abs() < 4.5 * mean.error(), "α {alpha}, {degrees}°: {}", mean.value());
                assert!(mean.error() < 0.02, "α {alpha}, {degrees}°: the test must be able to fail");
            }
        }
    }

    /// Directions that are drawn follow the law that is evaluated: moments of both agree within 4.5 σ.
    #[test]
    fn drawn_directions_follow_the_evaluated_law() {
        let moments: [fn(Vec3) -> f32; 4] = [|d| d.z, |d| d.x, |d| d.x * d.x - d.y * d.y, |d| f32::from(d.z > 0.5)];
        for alpha in ROUGHNESSES {
            let facets = Microsurface { alpha };
            for degrees in ANGLES {
                let (eye, mut stream) = (at(degrees), Seed(2).stream(degrees as u64));
                let (mut drawn, mut evaluated) =
                    ([0; 4].map(|_| SampleMean::default()), [0; 4].map(|_| SampleMean::default()));
                for _ in 0..30_000 {
                    let onward = facets.reflect(-eye, Vec3::Z, &mut stream);
                    assert!(onward.z > 0.0 && (onward.length() - 1.0).abs() < 1e-5, "{onward}");
                    let (light, density) = proposal(facets, eye, &mut stream);
                    let weight = match light.z > 0.0 {
                        true => facets.scattered(eye, light, Vec3::Z, &mut stream) / density,
                        false => 0.0,
                    };
                    for (moment, (drawn, evaluated)) in moments.iter().zip(drawn.iter_mut().zip(&mut evaluated)) {
                        drawn.add(moment(onward));
                        evaluated.add(if weight > 0.0 { weight * moment(light) } else { 0.0 });
                    }
                }
                for (drawn, evaluated) in drawn.iter().zip(&evaluated) {
                    let error = drawn.error().hypot(evaluated.error());
                    let off = drawn.value() - evaluated.value();
                    assert!(off.abs() < 4.5 * error + 1e-6, "α {alpha}, {degrees}°: off {off}, σ {error}");
                }
            }
        }
    }

    /// Helmholtz: lamp and eye may change places. Under even light (drawn by the cosine) as much goes from one part of
    /// the hemisphere to another as comes back, so counts n of the two ways differ by less than 4.5 √(n + n′); 450
    /// pairs.
    #[test]
    fn lamp_and_eye_may_change_places() {
        let part = |direction: Vec3| {
            let height = ((1.0 - direction.z * direction.z) * 3.0) as usize; // equal shares of the cosine
            let turn = ((direction.y.atan2(direction.x) / std::f32::consts::TAU + 0.5) * 5.0) as usize;
            height.min(2) * 5 + turn.min(4)
        };
        for alpha in ROUGHNESSES {
            let facets = Microsurface { alpha };
            let (mut stream, mut counts) = (Seed(3).stream((alpha * 100.0) as u64), [[0_i64; 15]; 15]);
            for _ in 0..200_000 {
                let from = stream.cosine_about(Vec3::Z);
                let to = facets.reflect(-from, Vec3::Z, &mut stream);
                counts[part(from)][part(to)] += 1;
            }
            for (a, row) in counts.iter().enumerate() {
                for (b, &there) in row.iter().enumerate().take(a) {
                    let back = counts[b][a];
                    let sigma = ((there + back) as f64).sqrt();
                    assert!(((there - back) as f64).abs() < 4.5 * sigma + 0.5, "α {alpha}: {there} there, {back} back");
                }
            }
        }
        // And the evaluated law: f is the same from both ends.
        for alpha in ROUGHNESSES {
            let facets = Microsurface { alpha };
            let mut stream = Seed(4).stream(0);
            for (a, b) in [(at(20.0), Vec3::new(-0.3, 0.5, 0.8)), (at(80.0), Vec3::new(-0.6, 0.7, 0.1))] {
                let b = b.normalize();
                let (mut there, mut back) = (SampleMean::default(), SampleMean::default());
                for _ in 0..100_000 {
                    there.add(facets.scattered(a, b, Vec3::Z, &mut stream) / b.z);
                    back.add(facets.scattered(b, a, Vec3::Z, &mut stream) / a.z);
                }
                let error = there.error().hypot(back.error());
                assert!((there.value() - back.value()).abs() < 4.5 * error + 1e-6 * there.value(), "α {alpha}");
            }
        }
    }

    /// ∫ D (w·m)⁺ g(m) dm by quadrature: normals of u and φ have D cos θ dm = du dφ/2π with tan²θ = α² u/(1 − u); u = 1
    /// − (1 − s)² spreads the steep ones out, and from below the horizon only those steep enough to be seen are taken.
    fn integral(alpha: f32, from: Vec3, g: impl Fn(Vec3) -> f64) -> f64 {
        let (steps, mut sum) = (600, 0.0);
        let steepness = f64::from(-from.z).max(0.0) / f64::from(alpha * from.x).max(1e-9);
        let unseen = 1.0 - 1.0 / (1.0 + steepness * steepness).sqrt();
        for i in 0..steps {
            let s = unseen + (1.0 - unseen) * (f64::from(i) + 0.5) / f64::from(steps);
            let tan = f64::from(alpha) * ((1.0 - (1.0 - s).powi(2)) / (1.0 - s).powi(2)).sqrt();
            let cos = 1.0 / (1.0 + tan * tan).sqrt();
            for j in 0..steps {
                let turn = 2.0 * PI * (f64::from(j) + 0.5) / f64::from(steps);
                let normal = Vec3::new((tan * cos * turn.cos()) as f32, (tan * cos * turn.sin()) as f32, cos as f32);
                sum += f64::from(normal.dot(from).max(0.0)) / cos * g(normal) * 2.0 * (1.0 - s) * (1.0 - unseen);
            }
        }
        sum / f64::from(steps * steps)
    }

    /// Facets cover the surface once: seen from straight above, ∫ D cos θ dm = 1. Seen from anywhere, those that can be
    /// seen show (1 + Λ) cos θ, and are drawn by what they show; both above the horizon and, for light on its way out,
    /// below.
    #[test]
    fn facets_are_drawn_by_the_area_they_show() {
        let moments: [fn(Vec3) -> f32; 3] = [|m| m.z, |m| m.x, |m| m.y * m.y];
        for alpha in [0.05, 0.3, 1.0] {
            let facets = Microsurface { alpha };
            assert!((integral(alpha, Vec3::Z, |_| 1.0) - 1.0).abs() < 1e-5);
            for degrees in [0.0, 40.0, 75.0, 89.0, 95.0, 130.0, 170.0_f32] {
                let (from, mut stream) = (at(degrees), Seed(5).stream(degrees as u64));
                let seen = integral(alpha, from, |_| 1.0);
                let expected = f64::from(facets.projected_area(from));
                assert!((seen - expected).abs() < 1e-3 * expected, "α {alpha}, {degrees}°: {seen}, {expected}");
                for moment in moments {
                    let mut mean = SampleMean::default();
                    (0..40_000).for_each(|_| mean.add(moment(facets.visible_normal(from, &mut stream))));
                    let expected = integral(alpha, from, |m| f64::from(moment(m))) / seen;
                    let off = mean.value() - expected;
                    let bound = 4.5 * mean.error() + 1e-3 * expected.abs() + 1e-6;
                    assert!(off.abs() < bound, "α {alpha}, {degrees}°: {} for {expected}", mean.value());
                }
            }
        }
    }

    /// The finest roughness is as good as none: reflected light stays within a few α of the mirror's direction.
    #[test]
    fn fine_facets_make_a_mirror() {
        let facets = Microsurface::new(1e-9).expect("rough");
        let mut stream = Seed(6).stream(0);
        for degrees in ANGLES {
            let expected = mirror(-at(degrees), Vec3::Z);
            let count = (0..1000)
                .filter(|_| (facets.reflect(-at(degrees), Vec3::Z, &mut stream) - expected).length() < 100.0 * FINEST);
            assert!(count.count() > 980, "{degrees}°");
        }
    }
}
