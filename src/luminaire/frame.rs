//! How a luminaire stands in the room: its aim and its C0 plane.
//!
//! Looking down, with `rotation = 0`, a luminaire has C0 towards +x and C90 towards +y: seen from above C-planes follow
//! each other counter-clockwise, as LM-63's horizontal angles of type C and CIE 121's C-planes do. `rotation` turns in
//! the same sense, from C0 towards C90, whatever the aim.

use glam::DVec3;

use crate::geometry::sin_cos_degrees;

/// The direction of the C0 plane (the first size of a rectangle) for a luminaire that looks along the unit vector
/// `aim`, turned by `rotation` degrees.
///
/// Hang the luminaire straight down with C0 towards +x, then tilt it the shortest way until it looks along `aim`: that
/// is rotation 0. Straight up is the one aim without a shortest way (no frame is continuous everywhere); there C0 is +x
/// again, but next to it C0 follows the direction of the tilt.
///
/// Positive rotations follow the right hand about −`aim`: they bring C0 to where C90 was, counter-clockwise for whoever
/// stands behind the luminaire and looks where it looks. One that looks down so turns counter-clockwise seen from
/// above, as plans in CAD and lighting programs have it; one that looks up, counter-clockwise seen from below. This
/// sense is the luminaire's own: it doesn't change while the luminaire is tilted from down over level to up, as "seen
/// from above" would.
pub(crate) fn c0_direction(aim: DVec3, rotation: f64) -> DVec3 {
    let down = DVec3::NEG_Z;
    let cosine = 1.0 + aim.dot(down);
    // Rodrigues' rotation of +x that takes `down` to `aim`, simplified by x ⟂ down.
    let untwisted = if cosine < 1e-12 { DVec3::X } else { DVec3::X - (aim + down) * (aim.x / cosine) };
    let (sin, cos) = sin_cos_degrees(-rotation);
    (untwisted * cos + aim.cross(untwisted) * sin).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_rotation_0_c0_is_x_up_and_down() {
        assert_eq!(c0_direction(DVec3::NEG_Z, 0.0), DVec3::X);
        assert_eq!(c0_direction(DVec3::Z, 0.0), DVec3::X);
    }

    #[test]
    fn c0_stays_a_unit_vector_at_a_right_angle_to_the_aim() {
        for i in 0..1000 {
            let (z, phi) = (f64::from(i) / 500.0 - 1.0, 2.399_963 * f64::from(i));
            let aim = DVec3::new((1.0 - z * z).sqrt() * phi.cos(), (1.0 - z * z).sqrt() * phi.sin(), z).normalize();
            let c0 = c0_direction(aim, 0.37 * f64::from(i));
            assert!((c0.length() - 1.0).abs() < 1e-12 && c0.dot(aim).abs() < 1e-9, "{aim} {c0}");
        }
    }

    /// Seen from above, +y is a quarter turn counter-clockwise from +x.
    #[test]
    fn a_luminaire_that_looks_down_turns_counter_clockwise_seen_from_above() {
        assert_eq!(c0_direction(DVec3::NEG_Z, 90.0), DVec3::Y);
        assert_eq!(c0_direction(DVec3::NEG_Z, -90.0), DVec3::NEG_Y);
        assert_eq!(c0_direction(DVec3::NEG_Z, -270.0), DVec3::Y);
        assert_eq!(c0_direction(DVec3::Z, 90.0), DVec3::NEG_Y);
    }

    /// C90 of the luminaire as it hung, C0 × aim, is where a quarter turn brings C0; half way it is 45° from both.
    #[test]
    fn whatever_the_aim_c0_turns_towards_c90() {
        for i in 0..1000 {
            let (z, phi) = (f64::from(i) / 500.0 - 1.0, 2.399_963 * f64::from(i));
            let aim = DVec3::new((1.0 - z * z).sqrt() * phi.cos(), (1.0 - z * z).sqrt() * phi.sin(), z).normalize();
            let c0 = c0_direction(aim, 0.0);
            let c90 = c0.cross(aim);
            assert!((c0_direction(aim, 90.0) - c90).length() < 1e-12, "{aim}");
            assert!((c0_direction(aim, 45.0) - (c0 + c90).normalize()).length() < 1e-12, "{aim}");
        }
    }

    #[test]
    fn tilting_the_luminaire_towards_x_lifts_c0() {
        assert!((c0_direction(DVec3::X, 0.0) - DVec3::Z).length() < 1e-15);
        assert!((c0_direction(DVec3::Y, 0.0) - DVec3::X).length() < 1e-15);
    }

    #[test]
    fn a_small_change_of_aim_is_a_small_change_of_c0() {
        for aim in [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Z, DVec3::new(1.0, 1.0, 1.0).normalize()] {
            for push in [DVec3::X, DVec3::Y, DVec3::Z] {
                let moved = c0_direction((aim + 1e-6 * push).normalize(), 0.0);
                assert!((moved - c0_direction(aim, 0.0)).length() < 1e-5, "{aim} {push}");
            }
        }
    }
}
