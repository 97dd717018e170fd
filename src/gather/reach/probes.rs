//! Narrow openings, found where they are: at the rims of faces.
//!
//! A point just beside a rim sees what is on both sides of the face, however small the opening is of which that rim is
//! a part. If some of what it sees is lit, all of it is.

use glam::Vec3;
use rayon::prelude::*;

use super::LightReach;
use super::shells::Shells;

/// Rims that are examined, and the distance of the point beside them, in the longest steps that rays start off
/// surfaces.
const MAX_RIMS: usize = 4096;
const OFF: f32 = 4.0;
/// Rays from a point beside a rim, and how many of them must agree: more than can slip through cracks.
const RAYS: usize = 32;
const AGREE: usize = 3;
/// Attempts to see light from where such a ray ends; more where it matters.
const TRIES: u32 = 8;
const MORE_TRIES: u32 = 32;
/// Openings that light passes one after the other.
const ROUNDS: u64 = 6;
/// Points behind openings that are kept.
const MAX_POINTS: usize = 8192;

/// What is seen from beside a rim.
enum RimView {
    /// No light.
    Dark,
    /// Light: and these points, which were not known to be lit; and whether the ways out of the scene are.
    Lit(Vec<Vec3>, bool),
}

impl LightReach<'_> {
    /// Follows light through openings too narrow for walks.
    pub(super) fn follow_gaps(&mut self, shells: &Shells<'_>) {
        let stride = shells.rims.len().div_ceil(MAX_RIMS).max(1);
        let mut left: Vec<(usize, Vec3)> = shells
            .rims
            .iter()
            .step_by(stride)
            .map(|(middle, away)| *middle + *away * (OFF * self.caster.longest_step(*middle)))
            .enumerate()
            .collect();
        for round in 0..ROUNDS {
            let views: Vec<RimView> = left.par_iter().map(|&(rim, point)| self.view(rim, point, round)).collect();
            let (mut new, mut dark) = (Vec::new(), Vec::new());
            let was_open = self.open;
            for (rim, view) in left.into_iter().zip(views) {
                match view {
                    RimView::Dark => dark.push(rim),
                    RimView::Lit(points, open) => {
                        new.extend(points);
                        self.open |= open;
                    }
                }
            }
            let changed = !new.is_empty() || self.open != was_open;
            self.through_gaps.extend(new);
            self.through_gaps.truncate(MAX_POINTS);
            left = dark;
            if !changed {
                break;
            }
        }
    }

    fn view(&self, rim: usize, point: Vec3, round: u64) -> RimView {
        let mut stream = self.seed.branch(5).branch(round).stream(rim as u64);
        let ends: Vec<Option<Vec3>> = (0..RAYS).map(|_| self.landing(point, stream.on_sphere())).collect();
        let out = ends.iter().filter(|end| end.is_none()).count();
        let mut unlit = Vec::new();
        let mut lit = if self.open { out } else { 0 };
        for end in ends.into_iter().flatten() {
            if (0..TRIES).any(|attempt| self.sees_light(end, attempt, &mut stream)) {
                lit += 1;
            } else {
                unlit.push(end);
            }
        }
        if lit < AGREE {
            return RimView::Dark;
        }
        unlit.retain(|&end| !(0..MORE_TRIES).any(|attempt| self.sees_light(end, attempt, &mut stream)));
        let new = if unlit.len() < AGREE { Vec::new() } else { unlit };
        RimView::Lit(new, out >= AGREE)
    }
}
