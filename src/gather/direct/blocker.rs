//! A triangle, or a part of one, that may stand between a point and an opening.

use glam::DVec3;

use super::emitter::{BodySource, LightSource, OpeningLight};
use crate::geometry::body::Body;

/// A triangle in front of an opening's plane, or what of it lies there.
#[derive(Clone, Copy)]
pub(super) struct Blocker {
    pub(super) corners: [DVec3; 4],
    pub(super) count: u32,
    pub(super) guard: Guard,
    pub(super) normal: DVec3,
    pub(super) area: f64,
    /// Material of a pane, which hides a part of the light only.
    pub(super) pane: Option<u32>,
}

/// From where a blocker hides a body. A plane keeps the two apart; it hides the body from points on its own side, and
/// from points on the body's side it is behind.
#[derive(Clone, Copy)]
pub(super) enum Guard {
    /// From everywhere: it lies in front of a flat opening.
    Always,
    /// Its own plane: it hides the body from the side of its normal, or from the other.
    Own(bool),
    /// The plane of a facet of the body.
    Facet(u16),
}

impl Blocker {
    /// The part of a triangle above the plane n · x = height.
    pub(super) fn above(triangle: [DVec3; 3], n: DVec3, height: f64) -> Option<Self> {
        let [a, b, c] = triangle;
        let cross = (b - a).cross(c - a);
        let length = cross.length();
        let above = triangle.map(|corner| corner.dot(n) - height);
        if length <= 0.0 || above.iter().all(|&above| above <= 0.0) {
            return None;
        }
        let (mut corners, mut count) = ([DVec3::ZERO; 4], 0_u32);
        let mut push = |corner: DVec3| {
            corners[count as usize] = corner;
            count += 1;
        };
        for i in 0..3 {
            let j = (i + 1) % 3;
            if above[i] >= 0.0 {
                push(triangle[i]);
            }
            if (above[i] > 0.0 && above[j] < 0.0) || (above[i] < 0.0 && above[j] > 0.0) {
                push(triangle[i] + (triangle[j] - triangle[i]) * (above[i] / (above[i] - above[j])));
            }
        }
        Some(Self { corners, count, guard: Guard::Always, normal: cross / length, area: length, pane: None })
    }

    /// What of a triangle is outside of a body.
    pub(super) fn around(body: &Body, triangle: [DVec3; 3], found: &mut Vec<Self>) {
        let Some(whole) = Self::above(triangle, DVec3::ZERO, -1.0) else { return };
        let height = whole.normal.dot(triangle[0]);
        if body.reach(whole.normal) <= height {
            found.push(Self { guard: Guard::Own(true), ..whole });
        } else if -body.reach(-whole.normal) >= height {
            found.push(Self { guard: Guard::Own(false), ..whole });
        } else {
            body.parts_outside(&triangle, |facet, part| {
                for i in (1..part.len() - 1).step_by(2) {
                    let mut corners = [DVec3::ZERO; 4];
                    let end = (i + 3).min(part.len());
                    corners[0] = part[0];
                    corners[1..=end - i].copy_from_slice(&part[i..end]);
                    found.push(Self { corners, count: (end - i) as u32 + 1, guard: Guard::Facet(facet), ..whole });
                }
            });
        }
    }

    /// Whether it is between `eye` and what it may hide.
    #[inline]
    pub(super) fn is_before(&self, source: &LightSource, eye: DVec3) -> bool {
        match (self.guard, source) {
            (Guard::Own(side), _) => ((eye - self.corners[0]).dot(self.normal) > 0.0) == side,
            (Guard::Facet(facet), LightSource::Body(body)) => body.body.is_above(facet, eye),
            _ => true,
        }
    }

    pub(super) fn corners(&self) -> &[DVec3] {
        &self.corners[..self.count as usize]
    }
}

impl LightSource {
    pub(super) fn light(&self) -> Option<&OpeningLight> {
        match self {
            Self::Polygon(polygon) => Some(&polygon.light),
            Self::Body(body) => Some(&body.light),
            Self::Point(_) | Self::Mesh(_) => None,
        }
    }

    /// What of a triangle may hide something of the source; `ahead` is the plane just in front of it, if it is flat.
    pub(super) fn blockers(
        &self,
        ahead: Option<(DVec3, f64)>,
        number: u32,
        triangle: [DVec3; 3],
        found: &mut Vec<Blocker>,
    ) {
        match self {
            Self::Body(BodySource { own, .. }) if own.contains(&number) => {}
            Self::Body(BodySource { body, .. }) => Blocker::around(body, triangle, found),
            _ => {
                let (normal, height) = ahead.unwrap_or((DVec3::ZERO, -1.0));
                found.extend(Blocker::above(triangle, normal, height));
            }
        }
    }
}
