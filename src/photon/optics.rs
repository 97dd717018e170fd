//! Mirror directions, and refraction with Fresnel's reflectance.

use glam::Vec3;

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
