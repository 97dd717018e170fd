//! An opening as one point sees it: its outline above the point's horizon, and what shadows leave of it.

use glam::DVec3;

use super::MAX_CUTS;
use super::blocker::Blocker;
use super::emitter::{LightSource, OpeningLight};
use super::panes::PaneShadow;
use super::polygon::{ConvexPieces, Shadow, above_horizon};
use super::web::WebParts;

/// An opening as one point sees it.
#[derive(Default)]
pub(super) struct OpeningView {
    /// Relative to the point, above its horizon.
    pub(super) whole: Vec<DVec3>,
    /// Inward normals of the planes through the point and the edges.
    pub(super) edges: Vec<DVec3>,
    /// Largest coordinate of its corners.
    pub(super) size: f64,
    /// Height over a measured flat opening's plane, m.
    pub(super) flat_on: f64,
    /// What is still lit, and whether any shadow fell on it.
    pub(super) lit: ConvexPieces,
    pub(super) touched: bool,
    pub(super) cuts_done: usize,
    pub(super) next: ConvexPieces,
    pub(super) cuts: [Vec<DVec3>; 2],
    /// Outline of a body.
    pub(super) outline: Vec<DVec3>,
    /// Panes before the opening.
    pub(super) panes: Vec<PaneShadow>,
    pub(super) parts: WebParts,
}

impl OpeningView {
    /// Takes in an opening as a point sees it, and returns the illuminance by all of it, lx.
    pub(super) fn observe(&mut self, source: &LightSource, eye: DVec3, up: DVec3) -> f64 {
        self.flat_on = f64::INFINITY;
        let light = match source {
            LightSource::Polygon(polygon) => {
                let height = (eye - polygon.corners[0]).dot(polygon.normal);
                if height < 0.0 || (height == 0.0 && !polygon.edge_on) {
                    return 0.0;
                }
                if let OpeningLight::Web(_) = polygon.light {
                    self.flat_on = height;
                }
                above_horizon(&polygon.corners, eye, up, &mut self.whole);
                &polygon.light
            }
            LightSource::Body(body) => {
                body.body.outline(eye, &mut self.outline);
                above_horizon(&self.outline, DVec3::ZERO, up, &mut self.whole);
                &body.light
            }
            LightSource::Point(_) | LightSource::Mesh(_) => return 0.0,
        };
        if self.whole.len() < 3 { 0.0 } else { light.whole(&self.whole, up, &mut self.parts) }
    }

    /// Whether shadows can be cut out of the opening observed last: seen edge on it has no room for them.
    pub(super) fn has_room(&self) -> bool {
        self.flat_on == f64::INFINITY
            || self.flat_on
                > 1e-9 * self.whole.iter().fold(0.0_f64, |most, corner| most.max(corner.abs().max_element()))
    }

    /// Gets ready to cut shadows out of the opening observed last.
    pub(super) fn start(&mut self) {
        let Self { whole, edges, size, lit, cuts_done, touched, panes, .. } = self;
        edges.clear();
        let count = whole.len();
        edges.extend((0..count).map(|i| whole[(i + 1) % count].cross(whole[i])));
        *size = whole.iter().fold(0.0_f64, |most, corner| most.max(corner.abs().max_element()));
        lit.clear();
        lit.push(whole);
        panes.clear();
        (*cuts_done, *touched) = (0, false);
    }

    /// Cuts out the shadow of one blocker, or remembers that of a pane; whether it falls on the opening.
    pub(super) fn hide(&mut self, blocker: &Blocker, source: &LightSource, eye: DVec3) -> bool {
        let Self { whole, edges, size, lit, next, cuts, cuts_done, touched, panes, .. } = self;
        if !blocker.is_before(source, eye) {
            return false;
        }
        let mut corners = blocker.corners;
        corners.iter_mut().for_each(|corner| *corner -= eye);
        let corners = &corners[..blocker.count as usize];
        if edges.iter().any(|edge| corners.iter().all(|corner| edge.dot(*corner) <= 0.0)) {
            return false;
        }
        let Some(shadow) = Shadow::of(corners, blocker.normal) else { return false };
        if shadow.misses(whole, *size) {
            return false;
        }
        *touched = true;
        if let Some(material) = blocker.pane {
            panes.push(PaneShadow { shadow, normal: blocker.normal, material });
            return true;
        }
        next.clear();
        for piece in lit.iter() {
            shadow.cut(piece, *size, next, cuts);
        }
        *cuts_done += lit.len();
        std::mem::swap(lit, next);
        true
    }

    /// Cuts the shadows of some blockers out of the opening observed last, and returns whether any falls on it; nothing
    /// if that takes too many cuts.
    pub(super) fn cut(&mut self, blockers: &[Blocker], source: &LightSource, eye: DVec3) -> Option<bool> {
        self.start();
        for blocker in blockers {
            self.hide(blocker, source, eye);
            if self.lit.len() == 0 {
                return Some(true);
            }
            if self.cuts_done > MAX_CUTS {
                return None;
            }
        }
        Some(self.touched)
    }
}
