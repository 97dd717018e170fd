//! What a surface does with light: Lambertian, mirror, glass.

use glam::Vec3;

use super::flux::{Flux, channels};
use super::random::Stream;
use crate::scene::Material;

/// A surface, in the channels of this run.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Surface<const C: usize> {
    Opaque { diffuse: [f32; C], specular: [f32; C] },
    Glass { ior: f32, absorption: f32 },
}

impl<const C: usize> From<&Material> for Surface<C> {
    fn from(material: &Material) -> Self {
        let shares = |rgb| channels::<C>(rgb).map(|share| share as f32);
        match material.dielectric {
            Some(glass) => Self::Glass { ior: glass.ior as f32, absorption: glass.absorption as f32 },
            None => Self::Opaque { diffuse: shares(material.reflectance), specular: shares(material.specular) },
        }
    }
}

/// How a photon goes on after a hit.
pub(crate) enum Fate<const C: usize> {
    Absorbed,
    Diffused(Vec3, Flux<C>),
    Mirrored(Vec3, Flux<C>),
    Refracted(Vec3, f32),
}

impl<const C: usize> Surface<C> {
    /// Decides by roulette what becomes of a photon; `normal` is the geometric one.
    #[inline]
    pub(crate) fn meet(&self, direction: Vec3, normal: Vec3, flux: Flux<C>, stream: &mut Stream) -> Fate<C> {
        match *self {
            Self::Opaque { diffuse, specular } => {
                let (diffused, mirrored) = (flux.filtered(diffuse), flux.filtered(specular));
                let chance = |part: Flux<C>, shares: [f32; C]| {
                    if C == 1 { shares[0] } else { part.brightest() / flux.brightest() }
                };
                let (mut to_diffuse, mut to_mirror) = (chance(diffused, diffuse), chance(mirrored, specular));
                let both = to_diffuse + to_mirror;
                if both > 1.0 {
                    (to_diffuse, to_mirror) = (to_diffuse / both, to_mirror / both);
                }
                let choice = stream.uniform();
                let facing = if direction.dot(normal) < 0.0 { normal } else { -normal };
                if choice < to_diffuse {
                    Fate::Diffused(stream.cosine_about(facing), survivor(flux, diffused, to_diffuse))
                } else if choice < to_diffuse + to_mirror {
                    Fate::Mirrored(mirror(direction, facing), survivor(flux, mirrored, to_mirror))
                } else {
                    Fate::Absorbed
                }
            }
            Self::Glass { ior, absorption } => {
                let entering = direction.dot(normal) < 0.0;
                let (facing, ratio) = if entering { (normal, 1.0 / ior) } else { (-normal, ior) };
                match refract(direction, facing, ratio) {
                    Some((onward, reflected)) if stream.uniform() >= reflected => {
                        Fate::Refracted(onward, if entering { absorption } else { 0.0 })
                    }
                    _ => Fate::Mirrored(mirror(direction, facing), flux),
                }
            }
        }
    }
}

/// Flux after winning a roulette of probability `chance`; in one channel that is the flux before, to the bit.
#[inline]
fn survivor<const C: usize>(before: Flux<C>, reflected: Flux<C>, chance: f32) -> Flux<C> {
    if C == 1 { before } else { reflected.scaled(1.0 / chance) }
}

/// Mirror direction about the unit normal.
#[inline]
pub(crate) fn mirror(direction: Vec3, normal: Vec3) -> Vec3 {
    (direction - normal * (2.0 * direction.dot(normal))).normalize()
}

/// Direction of the refracted ray by Snell's law and the unpolarised Fresnel reflectance; `None` at total reflection.
///
/// `facing` is the unit normal against `direction`, `ratio` = n₁/n₂.
#[inline]
pub(crate) fn refract(direction: Vec3, facing: Vec3, ratio: f32) -> Option<(Vec3, f32)> {
    let cos_in = (-direction.dot(facing)).clamp(0.0, 1.0);
    let sin2_out = ratio * ratio * (1.0 - cos_in * cos_in);
    if sin2_out >= 1.0 {
        return None;
    }
    let cos_out = (1.0 - sin2_out).sqrt();
    let onward = (direction * ratio + facing * (ratio * cos_in - cos_out)).normalize();
    let across = (ratio * cos_in - cos_out) / (ratio * cos_in + cos_out);
    let along = (cos_in - ratio * cos_out) / (cos_in + ratio * cos_out);
    Some((onward, 0.5 * (across * across + along * along)))
}

#[cfg(test)]
mod tests {
    use super::*;

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
