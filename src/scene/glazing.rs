//! Thin sheets of clear glass: a window pane drawn as one face.
//!
//! A pane lets light pass straight on, with a transmittance τ(θ) that depends on the angle of incidence θ, mirrors a
//! part ρ(θ), and absorbs the rest. Both sides are alike and the sheet has no thickness: there is no refraction, and
//! what passes is no caustic.
//!
//! ```toml
//! [material.window]
//! glazing = 0.88                        # τ at normal incidence, a number or [r, g, b] (linear Rec. 709)
//! [material.facade]
//! glazing = { transmittance = 0.6, reflectance = 0.15, curve = "clear" }
//! [material.tested]
//! glazing = { curve = [[0, 0.78], [40, 0.76], [60, 0.66], [75, 0.4], [90, 0]] }   # [θ in degrees, τ(θ)]
//! [material.cie171]
//! glazing = { curve = "cie171" }        # the 6 mm clear glass of CIE 171:2006
//! ```
//!
//! `curve = "clear"`, the default, is a pane of index 1.5 with all its inner reflections: Fresnel's formulas for either
//! polarisation, and the absorption that gives the transmittance asked for. Clear glass that absorbs nothing passes
//! 0.923; a pane that passes more is coated, and gets the index that goes with it. Without `reflectance` the pane
//! mirrors what this glass mirrors. A `reflectance` that is given rises to 1 at grazing incidence as that glass does,
//! as far as τ(θ) leaves room for it.

/// Index of refraction of window glass.
pub const WINDOW_GLASS: f64 = 1.5;

/// Transmittance of the 6 mm clear glass of CIE 171:2006 as a polynomial in cos θ (Tregenza and Sharples, algorithm
/// 2.34).
const CIE_171: [f64; 6] = [-0.028_378, 3.156_075, -3.058_376, -1.428_919, 4.014_235, -1.775_827];

/// A pane. Transmittance + reflectance ≤ 1 in each channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Glazing {
    /// Share of each channel (linear Rec. 709) that passes at normal incidence.
    pub transmittance: [f64; 3],
    /// Share that is mirrored at normal incidence.
    pub reflectance: [f64; 3],
    /// How τ falls with the angle of incidence.
    pub curve: Curve,
}

/// How transmittance falls with the angle of incidence θ, relative to that at normal incidence.
#[derive(Clone, Debug, PartialEq)]
pub enum Curve {
    /// As that of a clear pane of index 1.5.
    Clear,
    /// As that of the 6 mm glass of CIE 171:2006.
    Cie171,
    /// Linear between pairs of θ (degrees, ascending from 0) and τ; falls to 0 at 90°.
    Table(Vec<[f64; 2]>),
}

impl Curve {
    /// τ at normal incidence, where the curve tells it.
    pub fn at_normal(&self) -> Option<f64> {
        match self {
            Self::Clear => None,
            Self::Cie171 => Some(CIE_171.iter().sum()),
            Self::Table(_) => Some(self.absolute(1.0)),
        }
    }

    /// τ at an angle of incidence, by its cosine; of a clear pane that of glass that absorbs nothing.
    fn absolute(&self, cosine: f64) -> f64 {
        match self {
            Self::Clear => Pane::CLEAR.at(cosine)[0],
            Self::Cie171 => CIE_171.iter().rev().fold(0.0, |sum, factor| sum * cosine + factor).max(0.0),
            Self::Table(points) => {
                let degrees = cosine.clamp(0.0, 1.0).acos().to_degrees();
                let upper = points.partition_point(|[at, _]| *at <= degrees);
                let Some(&[from, before]) = points.get(upper.wrapping_sub(1)) else {
                    return points.first().map_or(0.0, |first| first[1]);
                };
                let [to, after] = points.get(upper).copied().unwrap_or([90.0, 0.0]);
                if to > from { before + (after - before) * ((degrees - from) / (to - from)) } else { before }
            }
        }
    }
}

impl Glazing {
    /// A pane of clear glass with this transmittance at normal incidence.
    pub fn clear(transmittance: [f64; 3]) -> Self {
        Self::new(transmittance, None, Curve::Clear)
    }

    /// A pane that mirrors, where nothing is said of that, what clear glass of its transmittance mirrors.
    pub fn new(transmittance: [f64; 3], reflectance: Option<[f64; 3]>, curve: Curve) -> Self {
        let mirrored = || transmittance.map(|share| Pane::passing(share).at(1.0)[1]);
        Self { transmittance, reflectance: reflectance.unwrap_or_else(mirrored), curve }
    }

    /// A pane of clear glass of index `ior` whose glass passes the share `inside` of each channel from face to face.
    pub fn of_index(ior: f64, inside: [f64; 3]) -> Self {
        let faces = inside.map(|inside| Pane { ior, inside }.at(1.0));
        Self {
            transmittance: faces.map(|[passed, _]| passed),
            reflectance: faces.map(|[_, mirrored]| mirrored),
            curve: Curve::Clear,
        }
    }

    /// τ and ρ of one channel at an angle of incidence, by its cosine.
    pub fn at(&self, channel: usize, cosine: f64) -> [f64; 2] {
        let (passed, mirrored) = (self.transmittance[channel], self.reflectance[channel]);
        let pane = Pane::like(passed, mirrored);
        let ([passes, mirrors], [passes_normal, mirrors_normal]) = (pane.at(cosine), pane.at(1.0));
        let rise = if mirrors_normal < 1.0 { (mirrors - mirrors_normal) / (1.0 - mirrors_normal) } else { 0.0 };
        let mirrors_now = mirrored + (1.0 - mirrored) * rise;
        let times = |now: f64, before: f64| if before > 0.0 { now / before } else { 0.0 };
        let passes_now = match &self.curve {
            // Of what is not mirrored, the part that glass does not absorb.
            Curve::Clear => {
                let kept = times(times(passes, 1.0 - mirrors), times(passes_normal, 1.0 - mirrors_normal));
                passed * kept * times(1.0 - mirrors_now, 1.0 - mirrored)
            }
            curve => passed * times(curve.absolute(cosine), curve.absolute(1.0)),
        };
        let passes_now = passes_now.clamp(0.0, 1.0);
        [passes_now, mirrors_now.clamp(0.0, 1.0 - passes_now)]
    }

    /// τ of light that arrives from all directions alike, in one channel: 2 ∫ τ cos θ d cos θ.
    pub fn diffuse_transmittance(&self, channel: usize) -> f64 {
        let steps = 200;
        let term = |i: usize| {
            let cosine = (i as f64 + 0.5) / steps as f64;
            self.at(channel, cosine)[0] * cosine
        };
        2.0 * (0..steps).map(term).sum::<f64>() / steps as f64
    }
}

/// A plane-parallel pane of smooth glass.
#[derive(Clone, Copy)]
struct Pane {
    ior: f64,
    /// Share of light that passes the glass from face to face, at normal incidence.
    inside: f64,
}

impl Pane {
    const CLEAR: Self = Self { ior: WINDOW_GLASS, inside: 1.0 };

    /// The pane that passes this share at normal incidence: of index 1.5, or less where that would mirror too much.
    fn passing(share: f64) -> Self {
        let face = |ior: f64| ((ior - 1.0) / (ior + 1.0)).powi(2);
        let r = face(WINDOW_GLASS);
        if share >= (1.0 - r) / (1.0 + r) {
            // (1 − r)/(1 + r) = share, of glass that absorbs nothing.
            let root = ((1.0 - share.min(1.0)) / (1.0 + share)).sqrt();
            return Self { ior: (1.0 + root) / (1.0 - root), inside: 1.0 };
        }
        // share = (1 − r)² a / (1 − r² a²), solved for a; written so that nothing cancels where the share is small.
        let b = (1.0 - r) * (1.0 - r);
        Self { ior: WINDOW_GLASS, inside: 2.0 * share / (b + (b * b + 4.0 * share * share * r * r).sqrt()) }
    }

    /// The pane with this transmittance and reflectance at normal incidence, if that takes no higher index than 1.5;
    /// else the pane of index 1.5 that absorbs as much of what it doesn't mirror, since a coating mirrors the rest.
    fn like(passed: f64, mirrored: f64) -> Self {
        let share = if mirrored < 1.0 { (passed / (1.0 - mirrored)).min(1.0) } else { 0.0 };
        let highest = ((WINDOW_GLASS - 1.0) / (WINDOW_GLASS + 1.0)).powi(2);
        // share = (1 − r) a / (1 − r a²), solved for a as above.
        let inside = |r: f64| 2.0 * share / ((1.0 - r) + ((1.0 - r) * (1.0 - r) + 4.0 * share * share * r).sqrt());
        // mirrored = r (1 + a passed): settles within 10⁻¹⁵ of r, as r is small.
        let mut r = mirrored.min(highest);
        for _ in 0..12 {
            r = (mirrored / (1.0 + inside(r) * passed)).min(highest);
        }
        let root = r.sqrt();
        Self { ior: (1.0 + root) / (1.0 - root), inside: inside(r) }
    }

    /// τ and ρ with all inner reflections, the mean of both polarisations.
    fn at(self, cosine: f64) -> [f64; 2] {
        let cos = cosine.clamp(0.0, 1.0);
        let cos_in = (1.0 - (1.0 - cos * cos) / (self.ior * self.ior)).max(0.0).sqrt();
        if cos_in <= 0.0 {
            return [1.0, 0.0]; // index 1 at grazing incidence: there is no pane
        }
        let across = (cos - self.ior * cos_in) / (cos + self.ior * cos_in);
        let along = (self.ior * cos - cos_in) / (self.ior * cos + cos_in);
        let inside = self.inside.powf(1.0 / cos_in);
        let of = |amplitude: f64| {
            let r = amplitude * amplitude;
            let rest = 1.0 - r * r * inside * inside;
            let passed = if rest > 0.0 { (1.0 - r) * (1.0 - r) * inside / rest } else { 0.0 };
            [passed, r * (1.0 + passed * inside)]
        };
        let ([a, b], [c, d]) = (of(across), of(along));
        [0.5 * (a + c), 0.5 * (b + d)]
    }
}

/// Steps of [`Curves`]: τ cos θ comes out within 10⁻⁵, τ itself within 10⁻³, where light grazes the pane.
const STEPS: usize = 256;

/// A pane's τ and ρ, tabulated over cos θ for rays that ask millions of times.
#[derive(Debug)]
pub(crate) struct Curves {
    /// τ and ρ of each channel at cos θ = i / [`STEPS`].
    nodes: Vec<[[f32; 3]; 2]>,
}

impl Curves {
    pub(crate) fn of(glazing: &Glazing) -> Self {
        let node = |i: usize| {
            let channels = [0, 1, 2].map(|channel| glazing.at(channel, i as f64 / STEPS as f64).map(|x| x as f32));
            [0, 1].map(|way| channels.map(|ways| ways[way]))
        };
        Self { nodes: (0..=STEPS).map(node).collect() }
    }

    /// τ and ρ in each channel where light arrives under this cosine.
    #[inline]
    pub(crate) fn at(&self, cosine: f32) -> [[f32; 3]; 2] {
        let place = cosine.abs().min(1.0) * STEPS as f32;
        let below = (place as usize).min(STEPS - 1);
        let share = place - below as f32;
        let (low, high) = (&self.nodes[below], &self.nodes[below + 1]);
        [0, 1].map(|way| [0, 1, 2].map(|c| low[way][c] + (high[way][c] - low[way][c]) * share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Closed forms at normal incidence: r = 0.04, so τ = (1 − r)/(1 + r) = 12/13 and ρ = 1/13 of glass that absorbs
    /// nothing; grazing light is mirrored; nothing is lost in between.
    #[test]
    fn a_clear_pane_follows_fresnel_with_inner_reflections() {
        let pane = Glazing::of_index(1.5, [1.0; 3]);
        assert!(
            (pane.transmittance[0] - 12.0 / 13.0).abs() < 1e-12 && (pane.reflectance[0] - 1.0 / 13.0).abs() < 1e-12
        );
        assert_eq!(pane.at(0, 0.0), [0.0, 1.0]);
        // Brewster's angle: what vibrates along the plane passes whole, what vibrates across it has r = ((n² − 1)/(n² +
        // 1))².
        let r = ((2.25_f64 - 1.0) / (2.25 + 1.0)).powi(2);
        let [passed, mirrored] = pane.at(0, 1.5_f64.atan().cos());
        assert!((passed - 0.5 * (1.0 + (1.0 - r) / (1.0 + r))).abs() < 1e-12);
        assert!((passed + mirrored - 1.0).abs() < 1e-12);
    }

    /// The pane that is made for a transmittance has it, and its own reflectance: r (1 + τ a), with τ = (1 − r)² a/(1 −
    /// r² a²).
    #[test]
    fn a_pane_passes_what_it_was_made_for() {
        for share in [0.0, 1e-12, 0.05, 0.3, 0.88, 0.923, 0.924, 0.98, 1.0] {
            let pane = Glazing::clear([share; 3]);
            let [passed, mirrored] = pane.at(1, 1.0);
            assert!((passed - share).abs() < 1e-12, "{share}: {passed}");
            assert!(mirrored >= 0.0 && passed + mirrored <= 1.0 + 1e-12, "{share}: {mirrored}");
            for i in 0..=90 {
                let cosine = f64::from(i).to_radians().cos();
                let [passed, mirrored] = pane.at(1, cosine);
                assert!(passed >= 0.0 && mirrored >= 0.0 && passed + mirrored <= 1.0 + 1e-12, "{share} at {i}°");
                assert!(passed <= share + 1e-12, "no angle passes more than the normal: {share} at {i}°");
            }
        }
        assert_eq!(Glazing::clear([1.0; 3]).at(0, 0.01), [1.0, 0.0], "a pane that passes all is no pane");
        // Coated glass that loses nothing at normal incidence absorbs nothing at any angle.
        let coated = Glazing::new([0.7; 3], Some([0.3; 3]), Curve::Clear);
        for cosine in [1.0, 0.7, 0.3, 0.05, 0.0] {
            let [passed, mirrored] = coated.at(0, cosine);
            assert!((passed + mirrored - 1.0).abs() < 1e-12, "{cosine}: {passed} + {mirrored}");
        }
    }

    /// CIE 171's polynomial, by its values: T(0°) = 0.87881, and at 60° the sum of its terms.
    #[test]
    fn the_glass_of_cie_171_is_its_polynomial() {
        let normal = Curve::Cie171.at_normal().unwrap();
        assert!((normal - 0.878_81).abs() < 1e-9);
        let glass = Glazing::new([normal; 3], None, Curve::Cie171);
        let c: f64 = 0.5;
        let expected = -0.028_378 + 3.156_075 * c - 3.058_376 * c * c - 1.428_919 * c.powi(3) + 4.014_235 * c.powi(4)
            - 1.775_827 * c.powi(5);
        assert!((glass.at(2, c)[0] - expected).abs() < 1e-12);
        assert_eq!(glass.at(2, 0.0)[0], 0.0, "the polynomial is below 0 at grazing incidence");
    }

    #[test]
    fn a_table_is_read_linearly_and_scaled_to_its_transmittance() {
        let curve = Curve::Table(vec![[0.0, 0.8], [60.0, 0.6], [80.0, 0.2]]);
        let glass = Glazing::new([0.8, 0.4, 0.2], Some([0.1; 3]), curve);
        let at = |channel, degrees: f64| glass.at(channel, degrees.to_radians().cos())[0];
        for (degrees, expected) in [(0.0, 0.8), (30.0, 0.7), (60.0, 0.6), (70.0, 0.4), (85.0, 0.1), (90.0, 0.0)] {
            assert!((at(0, degrees) - expected).abs() < 1e-9, "{degrees}°");
            assert!((at(1, degrees) - expected / 2.0).abs() < 1e-9 && (at(2, degrees) - expected / 4.0).abs() < 1e-9);
        }
        assert!((glass.at(0, 1.0)[1] - 0.1).abs() < 1e-12);
    }

    /// Light that falls on a pane is weighed by cos θ, and so is the error of the tables.
    #[test]
    fn tabulated_curves_are_the_pane_s_own() {
        for glazing in [Glazing::clear([0.88, 0.5, 0.1]), Glazing::of_index(1.5, [1.0; 3])] {
            let curves = Curves::of(&glazing);
            for i in 0..=10_000 {
                let cosine = f64::from(i) / 10_000.0;
                let found = curves.at(cosine as f32);
                for (way, found) in found.iter().enumerate() {
                    for (channel, &found) in found.iter().enumerate() {
                        let off = f64::from(found) - glazing.at(channel, cosine)[way];
                        assert!(off.abs() * cosine < 1e-5 && off.abs() < 1e-3, "{cosine}, {channel}, {way}: {off}");
                    }
                }
            }
        }
    }

    /// Hemispherical transmittance of a clear pane of index 1.5: 0.8446 (mean of both polarisations over cos² weights),
    /// by an integral with a hundred times as many nodes.
    #[test]
    fn diffuse_light_passes_by_the_mean_over_the_hemisphere() {
        let pane = Glazing::of_index(1.5, [1.0; 3]);
        let steps = 20_000;
        let fine: f64 = (0..steps)
            .map(|i| {
                let angle = std::f64::consts::FRAC_PI_2 * (f64::from(i) + 0.5) / f64::from(steps);
                pane.at(0, angle.cos())[0] * (2.0 * angle).sin()
            })
            .sum();
        let expected = fine * std::f64::consts::FRAC_PI_2 / f64::from(steps);
        assert!((pane.diffuse_transmittance(0) - expected).abs() < 1e-4);
    }
}
