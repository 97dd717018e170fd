//! Direct light through panes: what is lit of an opening is cut along the panes' shadows, and each part counts by the
//! transmittance of the panes before it, at the angle under which light passes them.

use glam::DVec3;

use super::emitter::{OpeningLight, grey};
use super::polygon::{ConvexPieces, Shadow};
use super::web::WebParts;
use crate::embree::RayCaster;

/// A part is halved where the transmittance of its corners is farther than this from that of its middle: then what is
/// left of the variation within it, taken by a rule of degree two, is some 10⁻⁴.
const MAX_VARIATION: f64 = 0.004;
/// Halvings of a part at most, which make it 2⁸ times as small.
const MAX_HALVINGS: u32 = 8;

/// What a triangle of a pane covers, as seen from a point.
pub(super) struct PaneShadow {
    pub(super) shadow: Shadow,
    pub(super) normal: DVec3,
    pub(super) material: u32,
}

/// An opening behind panes.
pub(super) struct Shaded<'a> {
    pub(super) panes: &'a [PaneShadow],
    /// Largest coordinate of the opening's corners.
    pub(super) size: f64,
    pub(super) light: &'a OpeningLight,
    pub(super) up: DVec3,
    pub(super) caster: &'a RayCaster,
    /// What all of it brings without panes, lx.
    pub(super) whole: f64,
    pub(super) parts: &'a mut WebParts,
}

impl Shaded<'_> {
    /// Illuminance (lx) in red, green and blue by the lit pieces of an opening.
    pub(super) fn sum(&mut self, lit: &ConvexPieces) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let mut before = Vec::new();
        for piece in lit.iter() {
            self.part(piece, 0, &mut before, &mut sum);
        }
        sum
    }

    /// Adds a part of the opening that the panes `before` cover, and of the others none up to number `next`.
    fn part(&mut self, part: &[DVec3], next: usize, before: &mut Vec<usize>, sum: &mut [f64; 3]) {
        for (number, pane) in self.panes.iter().enumerate().skip(next) {
            if pane.shadow.misses(part, self.size) {
                continue;
            }
            let mut outside = ConvexPieces::default();
            let mut scratch = [Vec::new(), Vec::new()];
            pane.shadow.cut(part, self.size, &mut outside, &mut scratch);
            let [inside, _] = scratch;
            let missed = outside.len() == 1 && outside.iter().next() == Some(part);
            if missed {
                continue;
            }
            for part in outside.iter() {
                self.part(part, number + 1, before, sum);
            }
            before.push(number);
            self.part(&inside, number + 1, before, sum);
            before.pop();
            return;
        }
        self.add(part, before, MAX_HALVINGS, sum);
    }

    /// Adds the light of a part that all of the panes `before` cover.
    fn add(&mut self, part: &[DVec3], before: &[usize], halvings: u32, sum: &mut [f64; 3]) {
        let mut pieces = ConvexPieces::default();
        if before.is_empty() {
            pieces.push(part);
            let lux = self.light.sum(&pieces, self.up, self.whole, self.parts);
            (0..3).for_each(|c| sum[c] += lux);
            return;
        }
        let middle = self.passed(part.iter().map(|corner| corner.normalize_or_zero()).sum(), before);
        let corners: Vec<[f64; 3]> = part.iter().map(|&corner| self.passed(corner, before)).collect();
        let varies = corners.iter().any(|&corner| (grey(corner) - grey(middle)).abs() > MAX_VARIATION);
        if varies && halvings > 0 {
            let (a, b) = farthest(part);
            pieces.push_halves(part, (a - b).normalize_or_zero(), 0.0);
            let halves: Vec<Vec<DVec3>> = pieces.iter().map(<[DVec3]>::to_vec).collect();
            halves.iter().for_each(|half| self.add(half, before, halvings - 1, sum));
            return;
        }
        pieces.push(part);
        let lux = self.light.sum(&pieces, self.up, self.whole, self.parts);
        for c in 0..3 {
            // Of a triangle exact where transmittance is a polynomial of degree two.
            let mean = corners.iter().map(|corner| corner[c]).sum::<f64>() / corners.len() as f64;
            sum[c] += lux * (0.75 * middle[c] + 0.25 * mean);
        }
    }

    /// What some panes together let pass from a direction.
    fn passed(&self, towards: DVec3, before: &[usize]) -> [f64; 3] {
        let towards = towards.normalize_or_zero();
        before.iter().fold([1.0; 3], |passed, &number| {
            let PaneShadow { normal, material, .. } = &self.panes[number];
            let through = self.caster.pane(*material).map(|curves| curves.at(towards.dot(*normal) as f32)[0]);
            let through = through.unwrap_or([0.0; 3]);
            [0, 1, 2].map(|c| passed[c] * f64::from(through[c]))
        })
    }
}

/// Unit vectors to the two corners of a part that are farthest apart as seen from the point.
fn farthest(part: &[DVec3]) -> (DVec3, DVec3) {
    let mut found = (DVec3::ZERO, DVec3::ZERO);
    let mut least = f64::INFINITY;
    for (i, a) in part.iter().enumerate() {
        for b in &part[i + 1..] {
            let (a, b) = (a.normalize_or_zero(), b.normalize_or_zero());
            if a.dot(b) < least {
                (least, found) = (a.dot(b), (a, b));
            }
        }
    }
    found
}
