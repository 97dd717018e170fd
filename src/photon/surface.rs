//! What a surface does with light: Lambertian, mirror, rough mirror, translucent sheet, clear pane, glass.

use std::sync::Arc;

use glam::Vec3;

use super::optics::{mirror, refract};
use super::rough::Microsurface;
use crate::flux::{Flux, channels};
use crate::random::Stream;
use crate::scene::Material;
use crate::scene::glazing::Curves;
use crate::scene::material::{SHARP, Sides};

/// A surface, in the channels of this run. Most surfaces are the first kind, so it carries nothing of the others.
#[derive(Clone, Debug)]
pub(crate) enum SurfaceOptics<const C: usize> {
    Opaque {
        diffuse: [f32; C],
        specular: [f32; C],
    },
    Layered(Layers<C>),
    /// Front and back.
    Sided(Box<[Layers<C>; 2]>),
    Glass {
        ior: f32,
        absorption: [f32; C],
    },
    /// A thin clear sheet.
    Pane(Arc<Curves>),
}

/// Shares of light that leave a surface each way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layers<const C: usize> {
    /// Lambertian, back to where it came from.
    pub(crate) diffuse: [f32; C],
    /// Lambertian, to the other side.
    pub(crate) transmitted: [f32; C],
    /// By a mirror,
    pub(crate) specular: [f32; C],
    /// which is perfect where this is `None`.
    pub(crate) rough: Option<Gloss>,
}

/// A rough mirror.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gloss {
    pub(crate) facets: Microsurface,
    /// Whether what it reflects is as sharp as a caustic.
    pub(crate) sharp: bool,
}

impl<const C: usize> From<&Material> for SurfaceOptics<C> {
    fn from(material: &Material) -> Self {
        if let Some(pane) = &material.glazing {
            return Self::Pane(Arc::new(Curves::of(pane)));
        }
        if let Some(glass) = material.dielectric {
            return Self::Glass { ior: glass.ior as f32, absorption: shares(glass.absorption) };
        }
        let front = Layers::of(material);
        match (&material.back, material.sides) {
            (Some(back), _) => Self::Sided(Box::new([front, Layers::of(back)])),
            (None, Sides::One) => Self::Sided(Box::new([front, Layers::black()])),
            _ if front.rough.is_some() || material.is_translucent() => Self::Layered(front),
            _ => Self::Opaque { diffuse: front.diffuse, specular: front.specular },
        }
    }
}

/// Shares of each channel of this run.
fn shares<const C: usize>(rgb: [f64; 3]) -> [f32; C] {
    channels::<C>(rgb).map(|share| share as f32)
}

/// How a photon goes on after a hit.
pub(crate) enum PhotonFate<const C: usize> {
    Absorbed,
    Diffused(Vec3, Flux<C>),
    /// By a rough mirror whose reflection is no caustic.
    Glossed(Vec3, Flux<C>),
    Mirrored(Vec3, Flux<C>),
    /// Through glass; whether into it.
    Refracted(Vec3, bool),
    /// Straight through a pane.
    Passed(Flux<C>),
}

impl<const C: usize> SurfaceOptics<C> {
    /// The shares of a surface that is not glass, on its front or back.
    #[inline]
    pub(crate) fn layers(&self, front: bool) -> Layers<C> {
        match self {
            Self::Layered(layers) => *layers,
            Self::Sided(sides) => sides[usize::from(!front)],
            &Self::Opaque { diffuse, specular } => Layers { diffuse, transmitted: [0.0; C], specular, rough: None },
            Self::Glass { .. } | Self::Pane(_) => Layers::black(),
        }
    }

    /// Whether light lands here: on anything but glass.
    #[inline]
    pub(crate) fn is_landed_on(&self) -> bool {
        !matches!(self, Self::Glass { .. } | Self::Pane(_))
    }

    /// Whether it bounds a solid of glass.
    #[inline]
    pub(crate) fn bounds_glass(&self) -> bool {
        matches!(self, Self::Glass { .. })
    }

    /// Index of refraction; 1 of what is not glass.
    #[inline]
    pub(crate) fn ior(&self) -> f32 {
        if let Self::Glass { ior, .. } = self { *ior } else { 1.0 }
    }

    /// Decides by roulette what becomes of a photon; `normal` is the geometric one, `ratio` gives n₁/n₂ of glass for
    /// light that enters it, or leaves.
    #[inline]
    pub(crate) fn meet(
        &self,
        direction: Vec3,
        normal: Vec3,
        flux: Flux<C>,
        ratio: impl FnOnce(bool) -> f32,
        stream: &mut Stream,
    ) -> PhotonFate<C> {
        match self {
            &Self::Opaque { diffuse, specular } => {
                let (diffused, mirrored) = (flux.filtered(diffuse), flux.filtered(specular));
                let (mut to_diffuse, mut to_mirror) = (chance(flux, diffuse), chance(flux, specular));
                let both = to_diffuse + to_mirror;
                if both > 1.0 {
                    (to_diffuse, to_mirror) = (to_diffuse / both, to_mirror / both);
                }
                let choice = stream.uniform();
                let facing = if direction.dot(normal) < 0.0 { normal } else { -normal };
                if choice < to_diffuse {
                    PhotonFate::Diffused(stream.cosine_about(facing), survivor(flux, diffused, to_diffuse))
                } else if choice < to_diffuse + to_mirror {
                    PhotonFate::Mirrored(mirror(direction, facing), survivor(flux, mirrored, to_mirror))
                } else {
                    PhotonFate::Absorbed
                }
            }
            Self::Layered(layers) => layers.meet(direction, normal, flux, stream),
            Self::Sided(sides) => {
                sides[usize::from(direction.dot(normal) >= 0.0)].meet(direction, normal, flux, stream)
            }
            Self::Pane(curves) => meet_pane(curves, direction, normal, flux, stream),
            Self::Glass { .. } => {
                let entering = direction.dot(normal) < 0.0;
                let facing = if entering { normal } else { -normal };
                match refract(direction, facing, ratio(entering)) {
                    Some((onward, reflected)) if stream.uniform() >= reflected => {
                        PhotonFate::Refracted(onward, entering)
                    }
                    _ => PhotonFate::Mirrored(mirror(direction, facing), flux),
                }
            }
        }
    }
}

/// What becomes of a photon at a pane.
#[inline(never)] // so that it costs the other surfaces nothing
fn meet_pane<const C: usize>(
    curves: &Curves,
    direction: Vec3,
    normal: Vec3,
    flux: Flux<C>,
    stream: &mut Stream,
) -> PhotonFate<C> {
    let [passed, mirrored] = pane_shares::<C>(curves, direction, normal);
    let (to_pass, to_mirror) = (chance(flux, passed), chance(flux, mirrored));
    let scale = 1.0 / (to_pass + to_mirror).max(1.0);
    let (to_pass, to_mirror) = (to_pass * scale, to_mirror * scale);
    let choice = stream.uniform();
    if choice < to_pass {
        PhotonFate::Passed(survivor(flux, flux.filtered(passed), to_pass))
    } else if choice < to_pass + to_mirror {
        PhotonFate::Mirrored(mirror(direction, normal), survivor(flux, flux.filtered(mirrored), to_mirror))
    } else {
        PhotonFate::Absorbed
    }
}

/// Shares of light that pass a pane and are mirrored by it.
#[inline]
pub(crate) fn pane_shares<const C: usize>(curves: &Curves, direction: Vec3, normal: Vec3) -> [[f32; C]; 2] {
    curves.at(direction.dot(normal)).map(|rgb| shares(rgb.map(f64::from)))
}

impl<const C: usize> Layers<C> {
    /// Those of a material's front.
    fn of(material: &Material) -> Self {
        let gloss = |facets| Gloss { facets, sharp: material.roughness < SHARP };
        Self {
            diffuse: shares(material.reflectance),
            transmitted: shares(material.transmittance),
            specular: shares(material.specular),
            rough: if material.mirrors() { Microsurface::new(material.roughness).map(gloss) } else { None },
        }
    }

    /// Absorbs all.
    pub(crate) fn black() -> Self {
        Self { diffuse: [0.0; C], transmitted: [0.0; C], specular: [0.0; C], rough: None }
    }

    #[inline(never)] // so that it costs the other surfaces nothing
    fn meet(&self, direction: Vec3, normal: Vec3, flux: Flux<C>, stream: &mut Stream) -> PhotonFate<C> {
        let front = direction.dot(normal) < 0.0;
        let shares = [self.diffuse, self.transmitted, self.specular];
        let chances = shares.map(|shares| chance(flux, shares));
        let all: f32 = chances.iter().sum();
        let [to_diffuse, to_other, to_mirror] = if all > 1.0 { chances.map(|chance| chance / all) } else { chances };
        let choice = stream.uniform();
        let facing = if front { normal } else { -normal };
        let left = |shares: [f32; C], chance: f32| survivor(flux, flux.filtered(shares), chance);
        if choice < to_diffuse {
            PhotonFate::Diffused(stream.cosine_about(facing), left(self.diffuse, to_diffuse))
        } else if choice < to_diffuse + to_other {
            PhotonFate::Diffused(stream.cosine_about(-facing), left(self.transmitted, to_other))
        } else if choice < to_diffuse + to_other + to_mirror {
            let left = left(self.specular, to_mirror);
            match self.rough {
                None => PhotonFate::Mirrored(mirror(direction, facing), left),
                Some(gloss) => {
                    let onward = gloss.facets.reflect(direction, facing, stream);
                    if gloss.sharp { PhotonFate::Mirrored(onward, left) } else { PhotonFate::Glossed(onward, left) }
                }
            }
        } else {
            PhotonFate::Absorbed
        }
    }
}

/// Part of a photon's brightest channel that goes one way; in one channel, that way's share.
#[inline]
fn chance<const C: usize>(flux: Flux<C>, shares: [f32; C]) -> f32 {
    if C == 1 { shares[0] } else { flux.filtered(shares).brightest() / flux.brightest() }
}

/// What of a photon's flux passes `distance` (m) of glass, by roulette over its brightest channel; `None` if it ends
/// there.
#[inline]
pub(crate) fn pass_glass<const C: usize>(
    flux: Flux<C>,
    absorption: [f32; C],
    distance: f32,
    stream: &mut Stream,
) -> Option<Flux<C>> {
    let passed = absorption.map(|per_metre| (-per_metre * distance).exp());
    let chance = chance(flux, passed);
    (stream.uniform() < chance).then(|| survivor(flux, flux.filtered(passed), chance))
}

/// Flux after winning a roulette of probability `chance`; in one channel that is the flux before, to the bit.
#[inline]
fn survivor<const C: usize>(before: Flux<C>, reflected: Flux<C>, chance: f32) -> Flux<C> {
    if C == 1 { before } else { reflected.scaled(1.0 / chance) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Seed;

    /// White furnace: of light that arrives at any angle, each way gets its share and no more, in every channel, on the
    /// right side. 4.5 σ of 40,000 photons; six materials at nine angles from either side.
    #[test]
    fn every_share_is_kept_at_all_angles() {
        let black = Material::black("test");
        let glossy = |roughness| Material {
            reflectance: [0.2, 0.3, 0.1],
            specular: [0.7, 0.4, 0.5],
            roughness,
            ..black.clone()
        };
        let sheet = Material { reflectance: [0.4; 3], transmittance: [0.1, 0.3, 0.6], ..black.clone() };
        let opal = Material { specular: [0.05; 3], roughness: 0.3, ..sheet.clone() };
        let materials = [glossy(0.0), glossy(0.05), glossy(0.4), glossy(1.0), sheet, opal];
        for (material, flux) in materials.iter().zip([Flux([1.0, 1.0, 1.0]), Flux([1.5, 0.8, 0.2])].iter().cycle()) {
            let surface = SurfaceOptics::<3>::from(material);
            for degrees in [0.0, 20.0, 40.0, 60.0, 75.0, 85.0, 89.0, 120.0, 150.0_f32] {
                let (sin, cos) = degrees.to_radians().sin_cos();
                let arriving = -Vec3::new(sin, 0.0, cos);
                let facing = if cos > 0.0 { Vec3::Z } else { -Vec3::Z };
                let (count, mut stream) = (40_000, Seed(1).stream(degrees as u64));
                // Diffused back, diffused through, mirrored: sums and sums of squares.
                let (mut sums, mut squares) = ([[0.0; 3]; 3], [[0.0; 3]; 3]);
                for _ in 0..count {
                    let (way, left) = match surface.meet(arriving, Vec3::Z, *flux, |_| 1.0, &mut stream) {
                        PhotonFate::Absorbed => continue,
                        PhotonFate::Diffused(onward, left) => (usize::from(onward.dot(facing) < 0.0), left),
                        PhotonFate::Mirrored(onward, left) | PhotonFate::Glossed(onward, left) => {
                            assert!(onward.dot(facing) > 0.0);
                            (2, left)
                        }
                        PhotonFate::Refracted(..) | PhotonFate::Passed(_) => panic!("no glass here"),
                    };
                    for c in 0..3 {
                        sums[way][c] += f64::from(left.0[c]);
                        squares[way][c] += f64::from(left.0[c]).powi(2);
                    }
                }
                for (way, shares) in
                    [material.reflectance, material.transmittance, material.specular].iter().enumerate()
                {
                    for c in 0..3 {
                        let (mean, count) = (sums[way][c] / f64::from(count), f64::from(count));
                        let sigma = ((squares[way][c] / count - mean * mean).max(0.0) / count).sqrt();
                        let expected = shares[c] * f64::from(flux.0[c]);
                        assert!(
                            (mean - expected).abs() <= 4.5 * sigma + 1e-6,
                            "{degrees}°, {way}, {c}: {mean}, {expected}"
                        );
                    }
                }
            }
        }
    }

    /// Beer–Lambert in each channel: e^(−a d), by roulette and weights together; 4.5 σ.
    #[test]
    fn glass_lets_each_channel_pass_by_its_own_law() {
        let (flux, absorption, distance) = (Flux([1.0, 0.6, 2.0]), [3.0, 0.0, 8.0], 0.4_f32);
        let (count, mut stream) = (100_000, Seed(2).stream(0));
        let (mut sums, mut squares) = ([0.0; 3], [0.0; 3]);
        for left in (0..count).filter_map(|_| pass_glass(flux, absorption, distance, &mut stream)) {
            for c in 0..3 {
                sums[c] += f64::from(left.0[c]);
                squares[c] += f64::from(left.0[c]).powi(2);
            }
        }
        for c in 0..3 {
            let (mean, count) = (sums[c] / f64::from(count), f64::from(count));
            let expected = f64::from(flux.0[c]) * f64::from(-absorption[c] * distance).exp();
            let sigma = ((squares[c] / count - mean * mean).max(0.0) / count).sqrt();
            assert!((mean - expected).abs() <= 4.5 * sigma + 1e-6, "channel {c}: {mean}, expected {expected}");
        }
    }

    /// Snell: n₁ sin θ₁ = n₂ sin θ₂; Fresnel at normal incidence: ((n − 1)/(n + 1))²; no p-reflection at Brewster's
    /// angle, where the unpolarised reflectance is half of ((n² − 1)/(n² + 1))².
    #[test]
    fn glass_follows_snell_and_fresnel() {
        let (n, up) = (1.5_f32, Vec3::Z);
        let at = |angle: f32| refract(Vec3::new(angle.sin(), 0.0, -angle.cos()), up, 1.0 / n).expect("enters");
        for degrees in [0.0_f32, 10.0, 45.0, 80.0, 89.0] {
            let angle = degrees.to_radians();
            let (onward, _) = at(angle);
            assert!((onward.x * n - angle.sin()).abs() < 1e-6, "Snell at {degrees}°: {onward}");
        }
        assert!((at(0.0).1 - 0.04).abs() < 1e-6);
        let expected = 0.5 * ((n * n - 1.0) / (n * n + 1.0)).powi(2);
        assert!((at(n.atan()).1 - expected).abs() < 1e-6);
        // From inside, total reflection begins at sin θ = 1/n.
        let inside = |sin: f32| refract(Vec3::new(sin, 0.0, -(1.0 - sin * sin).sqrt()), up, n);
        assert!(inside(0.99 / n).is_some() && inside(1.01 / n).is_none());
    }

    /// Reciprocity of Fresnel: the same share is reflected from either side of the surface along the same path.
    #[test]
    fn fresnel_reflectance_is_the_same_from_both_sides() {
        for degrees in [0.0_f32, 20.0, 50.0, 75.0, 88.0] {
            let angle = degrees.to_radians();
            let (onward, outside) =
                refract(Vec3::new(angle.sin(), 0.0, -angle.cos()), Vec3::Z, 1.0 / 1.5).expect("enters");
            let (_, inside) = refract(-onward, -Vec3::Z, 1.5).expect("leaves");
            assert!((outside - inside).abs() < 1e-5, "{degrees}°: {outside} against {inside}");
        }
    }
}
