//! How a luminaire's planes and its opening lie in the room: a plan seen from above, and a side.
//!
//! Both show a luminaire that looks down with `rotation = 0`: C0 towards +x, C90 towards +y.

use super::canvas::{BOLD, NORMAL, SMALL};
use super::drawing::{Anchor, Drawing, Role};
use crate::luminaire::photometry::{LuminousOpening, Photometry, Shape};
use crate::text::number::{round_to, short};

/// Size of the drawing, pixels: as wide as the polar diagram.
const SIZE: [f64; 2] = [860.0, 430.0];
/// Middles of the plan and of the side.
const CENTRES: [[f64; 2]; 2] = [[215.0, 222.0], [645.0, 222.0]];
/// Half the length of an axis.
const AXIS: f64 = 122.0;
/// Half of the opening's largest size.
const HALF: f64 = 66.0;
/// What has no extent is drawn so thick.
const THIN: f64 = 3.0;
/// Radius of a point.
const DOT: f64 = 7.0;
/// Radius of the arcs that tell how an angle counts.
const ARC: f64 = 98.0;

/// Draws a luminaire's axes, its opening to scale, and the senses of C, `rotation` and γ.
pub(crate) fn drawing(photometry: &Photometry) -> Drawing {
    let description = "How it lies in the room looking down with rotation 0. Plan seen from above: C0 to the right is +x, \
                       C90 up is +y, C180 left, C270 down; C and positive rotation count counter-clockwise. Side: gamma 0 \
                       is down, 90 level, 180 up";
    let mut drawing = Drawing::new(SIZE, description.into());
    plan(&mut drawing, &photometry.opening);
    side(&mut drawing, &photometry.opening);
    drawing
}

/// Pixels a metre: the largest size of the opening is as long in both views.
fn scale(opening: &LuminousOpening) -> f64 {
    2.0 * HALF / opening.c0.max(opening.c90).max(opening.height).max(1e-12)
}

fn plan(drawing: &mut Drawing, opening: &LuminousOpening) {
    let [x, y] = CENTRES[0];
    drawing.text([x, 20.0], "Plan, seen from above", BOLD, Anchor::Middle, Role::Text);
    drawing.text([x, 44.0], "looking down, rotation = 0", SMALL, Anchor::Middle, Role::Quiet);
    let round = matches!(opening.shape, Shape::Ellipse | Shape::VerticalCylinder | Shape::Ellipsoid);
    outline(drawing, CENTRES[0], [opening.c0, opening.c90], round, scale(opening));
    drawing.line(vec![[x - AXIS, y], [x, y]], false, 1.0, Role::Quiet);
    drawing.line(vec![[x, y + AXIS], [x, y]], false, 1.0, Role::Quiet);
    drawing.arrow(vec![[x, y], [x + AXIS, y]], 2.0, Role::First);
    drawing.arrow(vec![[x, y], [x, y - AXIS]], 2.0, Role::Second);
    drawing.text([x + AXIS + 16.0, y], "C0, +x", NORMAL, Anchor::Start, Role::First);
    drawing.text([x, y - AXIS - 22.0], "C90, +y", NORMAL, Anchor::Middle, Role::Second);
    drawing.text([x - AXIS - 10.0, y], "C180", NORMAL, Anchor::End, Role::Quiet);
    drawing.text([x, y + AXIS + 16.0], "C270", NORMAL, Anchor::Middle, Role::Quiet);
    // Up the picture is +y: counter-clockwise.
    drawing.arrow(arc(CENTRES[0], |sin, cos| [cos, -sin], [22.0, 66.0]), 2.0, Role::Text);
    drawing.text([x + 78.0, y - 84.0], "+ rotation", NORMAL, Anchor::Start, Role::Text);
    let sizes = if opening.shape == Shape::Point {
        "opening: a point".into()
    } else {
        format!("opening: {} m along x, {} m along y", metres(opening.c0), metres(opening.c90))
    };
    drawing.text([x, SIZE[1] - 34.0], sizes, SMALL, Anchor::Middle, Role::Text);
}

fn side(drawing: &mut Drawing, opening: &LuminousOpening) {
    let [x, y] = CENTRES[1];
    drawing.text([x, 20.0], "Side, seen towards +y", BOLD, Anchor::Middle, Role::Text);
    drawing.text([x, 44.0], "gamma, from where it looks", SMALL, Anchor::Middle, Role::Quiet);
    let round = matches!(opening.shape, Shape::Ellipsoid | Shape::CylinderAlongC90);
    outline(drawing, CENTRES[1], [opening.c0, opening.height], round, scale(opening));
    drawing.line(vec![[x - AXIS, y], [x, y]], false, 1.0, Role::Quiet);
    drawing.line(vec![[x, y - AXIS], [x, y]], false, 1.0, Role::Quiet);
    drawing.arrow(vec![[x, y], [x + AXIS, y]], 2.0, Role::First);
    drawing.arrow(vec![[x, y], [x, y + AXIS]], 2.0, Role::Text);
    drawing.text([x + AXIS + 16.0, y - 12.0], "90°", NORMAL, Anchor::Start, Role::Text);
    drawing.text([x + AXIS + 16.0, y + 12.0], "C0", NORMAL, Anchor::Start, Role::First);
    drawing.text([x - AXIS - 10.0, y - 12.0], "90°", NORMAL, Anchor::End, Role::Text);
    drawing.text([x - AXIS - 10.0, y + 12.0], "C180", NORMAL, Anchor::End, Role::Quiet);
    drawing.text([x, y - AXIS - 16.0], "180°", NORMAL, Anchor::Middle, Role::Text);
    drawing.text([x, y + AXIS + 22.0], "0°, aim", NORMAL, Anchor::Middle, Role::Text);
    drawing.arrow(arc(CENTRES[1], |sin, cos| [sin, cos], [22.0, 66.0]), 2.0, Role::Text);
    drawing.text([x + 78.0, y + 84.0], "gamma", NORMAL, Anchor::Start, Role::Text);
    if opening.height > 0.0 {
        let height = format!("{} m high", metres(opening.height));
        drawing.text([x, SIZE[1] - 34.0], height, SMALL, Anchor::Middle, Role::Text);
    }
}

/// The outline of an opening of these sizes, m.
fn outline(drawing: &mut Drawing, [x, y]: [f64; 2], sizes: [f64; 2], round: bool, scale: f64) {
    let point = sizes == [0.0; 2];
    let [a, b] = sizes.map(|size| (0.5 * size * scale).max(if point { DOT } else { THIN }));
    let points: Vec<[f64; 2]> = if round || point {
        let corner = |i: i32| (f64::from(i) * 5.0).to_radians().sin_cos();
        (0..72).map(corner).map(|(sin, cos)| [x + a * cos, y + b * sin]).collect()
    } else {
        vec![[x - a, y - b], [x + a, y - b], [x + a, y + b], [x - a, y + b]]
    };
    drawing.area(points.clone(), Role::Opening);
    drawing.line(points, true, 1.5, Role::Text);
}

/// An arc from one angle to another, degrees; `place` makes its direction of their sines and cosines.
fn arc([x, y]: [f64; 2], place: fn(f64, f64) -> [f64; 2], [from, to]: [f64; 2]) -> Vec<[f64; 2]> {
    let steps = 16;
    let direction = |i: i32| {
        let (sin, cos) = (from + (to - from) * f64::from(i) / f64::from(steps)).to_radians().sin_cos();
        place(sin, cos)
    };
    (0..=steps).map(direction).map(|[u, v]| [x + ARC * u, y + ARC * v]).collect()
}

fn metres(size: f64) -> String {
    short(round_to(size, 6))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On a plan +y is up: an angle grows from the right to the top. On the side γ grows from below to the right.
    #[test]
    fn arcs_turn_as_the_angles_do() {
        let plan = arc([0.0; 2], |sin, cos| [cos, -sin], [0.0, 90.0]);
        let side = arc([0.0; 2], |sin, cos| [sin, cos], [0.0, 90.0]);
        let close = |[x, y]: [f64; 2], [u, v]: [f64; 2]| (x - ARC * u).hypot(y - ARC * v) < 1e-9;
        assert!(close(plan[0], [1.0, 0.0]) && close(plan[16], [0.0, -1.0]));
        assert!(close(side[0], [0.0, 1.0]) && close(side[16], [1.0, 0.0]));
    }

    /// 1.2 m along C90 by 0.2 m along C0: upright, six times as high as wide; a ball as high as wide.
    #[test]
    fn openings_are_drawn_to_scale() {
        let extent = |sizes: [f64; 2], round: bool| {
            let mut drawing = Drawing::new([1.0; 2], String::new());
            outline(&mut drawing, [0.0; 2], sizes, round, 100.0);
            let points = drawing.outlines().concat();
            [0, 1].map(|axis| points.iter().map(|point| point[axis]).fold(0.0, f64::max))
        };
        assert_eq!(extent([0.2, 1.2], false), [10.0, 60.0]);
        assert_eq!(extent([1.0, 1.0], true), [50.0, 50.0]);
        assert_eq!(extent([0.0, 0.0], false), [DOT, DOT]);
    }
}
