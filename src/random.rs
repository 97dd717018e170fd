//! Randomness, dealt by index: photon i of a pass draws from stream i, so no result depends on which thread traces it,
//! or when.

use glam::Vec3;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// What a run's random streams start from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seed(pub u64);

impl Seed {
    /// Stream `index` of this seed. Different indices never share a starting state: the map from index to state is
    /// one to one. Cost: a few ns.
    #[inline]
    pub fn stream(self, index: u64) -> Stream {
        // An odd factor far from the golden ratio, which SplitMix64 (it fills the generator's state) steps by.
        let start = mix(self.0).wrapping_add(index.wrapping_mul(0xd134_2543_de82_ef95));
        Stream(Xoshiro256PlusPlus::seed_from_u64(start))
    }

    /// A seed of its own for a named purpose, so that photons and shadow rays never draw the same numbers.
    pub fn branch(self, purpose: u64) -> Self {
        Self(mix(self.0 ^ mix(purpose.wrapping_add(1))))
    }
}

/// Stafford's 13th mixer, as in SplitMix64: every bit of the input reaches every bit of the output.
fn mix(mut bits: u64) -> u64 {
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

/// A stream of random numbers.
#[derive(Clone, Debug)]
pub struct Stream(Xoshiro256PlusPlus);

impl Stream {
    /// Uniform in [0, 1), 24 bits.
    #[inline]
    pub fn uniform(&mut self) -> f32 {
        (self.0.next_u64() >> 40) as f32 * (1.0 / 16_777_216.0)
    }

    /// Two independent uniforms from one draw.
    #[inline]
    pub fn uniform_pair(&mut self) -> [f32; 2] {
        let bits = self.0.next_u64();
        [(bits >> 40) as f32 * (1.0 / 16_777_216.0), ((bits >> 8) & 0xff_ffff) as f32 * (1.0 / 16_777_216.0)]
    }

    /// Unit vector, uniform over the sphere.
    #[inline]
    pub fn on_sphere(&mut self) -> Vec3 {
        let [a, b] = self.uniform_pair();
        let radius = 2.0 * (a * (1.0 - a)).sqrt();
        let [x, y] = on_circle(b);
        Vec3::new(radius * x, radius * y, 1.0 - 2.0 * a)
    }

    /// Unit vector about the unit `normal` with density cos θ/π: a Lambertian direction, never below the horizon.
    #[inline]
    pub fn cosine_about(&mut self, normal: Vec3) -> Vec3 {
        Self::cosine_at(normal, self.uniform_pair())
    }

    /// The direction of [`cosine_about`](Self::cosine_about) that belongs to a point of the unit square.
    #[inline]
    pub fn cosine_at(normal: Vec3, [a, b]: [f32; 2]) -> Vec3 {
        let (x, y) = normal.any_orthonormal_pair();
        let [cos, sin] = on_circle(b);
        let radius = a.sqrt();
        x * (radius * cos) + y * (radius * sin) + normal * (1.0 - a).sqrt()
    }
}

/// (cos, sin) of the part `turn` (0 … 1) of a full turn, to 3·10⁻⁷: Taylor series within an eighth of a turn of the
/// nearest quarter, since directions are a tenth of tracing's time.
#[inline]
pub(crate) fn on_circle(turn: f32) -> [f32; 2] {
    let quarter = (4.0 * turn + 0.5) as i32;
    let angle = (4.0 * turn - quarter as f32) * std::f32::consts::FRAC_PI_2;
    let square = angle * angle;
    let fourth = square * square;
    let sin = angle
        * ((1.0 - square * (1.0 / 6.0))
            + fourth * ((1.0 / 120.0 - square * (1.0 / 5040.0)) + fourth * (1.0 / 362_880.0)));
    let cos = (1.0 - 0.5 * square) + fourth * ((1.0 / 24.0 - square * (1.0 / 720.0)) + fourth * (1.0 / 40_320.0));
    // Turned by whole quarters, without a branch, which could not be predicted.
    let quarter = quarter as u32;
    let (x, y) = if quarter & 1 == 0 { (cos, sin) } else { (sin, cos) };
    let negate_if = |value: f32, bit: u32| f32::from_bits(value.to_bits() ^ ((bit & 2) << 30));
    [negate_if(x, quarter + 1), negate_if(y, quarter)]
}

/// Point `index` of the R₂ sequence (Roberts 2018), shifted about the unit square.
pub fn low_discrepancy(index: u64, [u, v]: [f32; 2]) -> [f32; 2] {
    let along = |shift: f32, step: f64| ((f64::from(shift) + index as f64 * step).fract() as f32).min(0.999_999_9);
    [along(u, 0.754_877_666_246_692_8), along(v, 0.569_840_290_998_053_3)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lambert's law: the mean of cos θ over the hemisphere is ∫cos²θ dω/π = 2/3, its variance 1/2 − 4/9 = 1/18.
    #[test]
    fn lambertian_directions_have_mean_cosine_two_thirds() {
        let normal = Vec3::new(1.0, 2.0, -2.0) / 3.0;
        let (count, mut stream) = (200_000, Seed(1).stream(0));
        let mean =
            (0..count).map(|_| f64::from(stream.cosine_about(normal).dot(normal))).sum::<f64>() / f64::from(count);
        let bound = 4.0 * (1.0 / 18.0 / f64::from(count)).sqrt();
        assert!((mean - 2.0 / 3.0).abs() < bound, "mean cosine {mean}, expected 2/3 ± {bound}");
    }

    #[test]
    fn points_of_the_circle_are_exact_to_single_precision() {
        for step in 0..10_000 {
            let turn = step as f32 / 10_000.0;
            let (sin, cos) = (std::f64::consts::TAU * f64::from(turn)).sin_cos();
            let [x, y] = on_circle(turn).map(f64::from);
            assert!((x - cos).abs() < 3e-7 && (y - sin).abs() < 3e-7, "{turn}: ({x}, {y}), expected ({cos}, {sin})");
        }
    }

    /// Neighbouring streams are uncorrelated: products of their first deviates average to 1/4, σ = √(7/144/n).
    #[test]
    fn neighbouring_streams_are_independent() {
        let count = 100_000u32;
        let first = |i: u32| f64::from(Seed(3).stream(u64::from(i)).uniform());
        let mean = (0..count).map(|i| first(i) * first(i + 1)).sum::<f64>() / f64::from(count);
        // Each product shares a factor with the next: var of the mean ≤ (7/144 + 2·(1/12·1/4))/n.
        let bound = 4.0 * ((7.0 / 144.0 + 1.0 / 24.0) / f64::from(count)).sqrt();
        assert!((mean - 0.25).abs() < bound, "mean product {mean}, expected 1/4 ± {bound}");
    }
}
