//! The light of one emitter at the points of a block: what may stand in the way is searched for once for many points,
//! shadows are cut out for each point, and rays sample where there is too much to cut or too little to gain.

use glam::DVec3;

use super::blocker::Blocker;
use super::blockers::AxisBox;
use super::blocks::PointBlock;
use super::emitter::{EmittingPiece, LightSource, MESH_STRATA, MeshSource, OpeningLight, PointSource};
use super::panes::Shaded;
use super::sample::{self, Target};
use super::view::OpeningView;
use super::{DirectScratch, Gather, InTheWay, MAX_BLOCKERS, PointSum};

/// Where an opening can bring no more than this part of a point's light and more than [`MAX_BLOCKERS_IF_WEAK`]
/// triangles are in its way, a single ray decides; but not where such rays would make a standard deviation above
/// [`MAX_GLIMPSED`] of the point's light in all.
const WEAK: f64 = 3e-4;
/// See [`WEAK`].
const MAX_BLOCKERS_IF_WEAK: usize = 8;
/// See [`WEAK`].
const MAX_GLIMPSED: f64 = 1e-3;
/// Rays that try to prove that nothing is seen of an opening before a point searches on its own.
pub(super) const PROBES: u32 = 6;
/// Triangles kept from such proofs for the next points.
const MAX_SUSPECTS: usize = 12;

/// One emitter at the points of a block.
pub(super) struct Visit<'v, 'a, const C: usize> {
    pub(super) gather: &'v Gather<'a, C>,
    /// Number of the emitter, and the emitter.
    pub(super) number: usize,
    pub(super) emitter: &'v EmittingPiece<C>,
    /// What it brings to a point of the block at most, lx.
    pub(super) most: f64,
    /// The box around the block's points.
    pub(super) bounds: &'v AxisBox,
}

/// What is known to stand between an opening and a part of a block; `None` before a point needs it.
type ForPart = Option<InTheWay>;

impl<const C: usize> Visit<'_, '_, C> {
    /// Adds the emitter's light to the points of the block that are open.
    pub(super) fn add_to(&self, block: &PointBlock, sums: &mut [PointSum<C>], scratch: &mut DirectScratch) {
        match &self.emitter.source {
            LightSource::Mesh(mesh) => self.add_mesh(mesh, block, sums, scratch),
            LightSource::Point(point) => self.add_point(point, block, sums, scratch),
            LightSource::Polygon(_) | LightSource::Body(_) => self.add_opening(block, sums, scratch),
        }
    }

    /// A fine mesh, which is sampled.
    fn add_mesh(&self, mesh: &MeshSource, block: &PointBlock, sums: &mut [PointSum<C>], scratch: &mut DirectScratch) {
        let (gather, seed) = (self.gather, self.gather.seed.branch(self.number as u64));
        for range in block.parts() {
            let (points, sums) = (&block.points[range.clone()], &mut sums[range]);
            scratch.shares.clear();
            if !sums.iter().any(|sum| sum.open) || !mesh.shares(&gather.bounds(points), gather.up, &mut scratch.shares)
            {
                continue;
            }
            for (&point, sum) in points.iter().zip(sums).filter(|(_, sum)| sum.open) {
                let mut stream = seed.stream(point as u64);
                let start = gather.receiver.start(point);
                let normal = gather.up.as_vec3();
                sum.add(self.emitter, mesh.sample(start, normal, &scratch.shares, gather.blockers, &mut stream));
                scratch.rays += 2 * u64::from(MESH_STRATA);
            }
        }
    }

    /// A luminaire without extent: seen or not, from each point.
    fn add_point(
        &self,
        source: &PointSource,
        block: &PointBlock,
        sums: &mut [PointSum<C>],
        scratch: &mut DirectScratch,
    ) {
        let gather = self.gather;
        let hidden = gather.search(self.emitter, self.bounds, 1, &mut scratch.block) != InTheWay::Nothing;
        for (&point, sum) in block.points.iter().zip(sums).filter(|(_, sum)| sum.open) {
            let lux = source.illuminance(gather.place(point), gather.up);
            if lux > 0.0 {
                let passed = if hidden { source.passed(gather.eye(point), gather.blockers.caster) } else { [1.0; 3] };
                sum.add(self.emitter, (passed.map(|passed| passed * lux), 0.0));
                scratch.rays += u64::from(hidden);
            }
        }
    }

    /// A flat opening or a body.
    fn add_opening(&self, block: &PointBlock, sums: &mut [PointSum<C>], scratch: &mut DirectScratch) {
        let gather = self.gather;
        let source = &self.emitter.source;
        let Some(light) = source.light() else { return };
        let matters = sums.iter().any(|sum| sum.open && !self.is_weak(sum));
        let limit = if matters { MAX_BLOCKERS } else { MAX_BLOCKERS_IF_WEAK };
        let for_block = gather.search(self.emitter, self.bounds, limit, &mut scratch.block);
        for range in block.parts() {
            let (points, sums) = (&block.points[range.clone()], &mut sums[range]);
            if !sums.iter().any(|sum| sum.open) {
                continue;
            }
            let mut for_part = self.narrow(for_block, points, scratch);
            scratch.suspects.clear();
            for (&point, sum) in points.iter().zip(sums).filter(|(_, sum)| sum.open) {
                let lux = scratch.view.observe(source, gather.place(point), gather.up);
                if lux <= 0.0 {
                    continue;
                }
                let weak = self.is_weak(sum);
                let Some(in_the_way) = self.search_for(point, points, weak, &mut for_part, scratch) else { continue };
                let exact = self.exact(point, weak, in_the_way, (light, lux), scratch);
                let found = exact.map_or_else(|| self.sample_instead(point, lux, weak, scratch), |lux| (lux, 0.0));
                let before = sum.variance;
                sum.add(self.emitter, found);
                if weak {
                    sum.glimpsed += sum.variance - before;
                }
            }
        }
    }

    /// Whether the opening matters so little at a point that a single ray may decide; see [`WEAK`].
    #[inline]
    fn is_weak(&self, sum: &PointSum<C>) -> bool {
        let most = self.most;
        most <= WEAK * sum.lux && sum.glimpsed + sample::GLIMPSE * most * most <= (MAX_GLIMPSED * sum.lux).powi(2)
    }

    /// Of what is in the way of a block, what is in the way of a part of it.
    fn narrow(&self, for_block: InTheWay, points: &[usize], scratch: &mut DirectScratch) -> ForPart {
        match for_block {
            InTheWay::Nothing => Some(InTheWay::Nothing),
            InTheWay::Few => {
                let DirectScratch { block, part, .. } = scratch;
                let shaft = self.gather.shaft(self.emitter, &self.gather.bounds(points));
                part.clear();
                part.extend(block.iter().filter(|blocker| shaft.meets(blocker.corners())));
                Some(if part.is_empty() { InTheWay::Nothing } else { InTheWay::Few })
            }
            InTheWay::Many => None,
        }
    }

    /// What is in the way of one point of a part, and whether it was searched for this point alone (then it is in
    /// `scratch.point`, else in `scratch.part`); nothing where rays prove that the opening is hidden.
    #[inline]
    fn search_for(
        &self,
        point: usize,
        points: &[usize],
        weak: bool,
        for_part: &mut ForPart,
        scratch: &mut DirectScratch,
    ) -> Option<(InTheWay, bool)> {
        let gather = self.gather;
        if !weak && !matches!(for_part, Some(InTheWay::Nothing | InTheWay::Few)) {
            if self.is_hidden(point, scratch) {
                return None;
            }
            if for_part.is_none() {
                *for_part = Some(gather.search(self.emitter, &gather.bounds(points), MAX_BLOCKERS, &mut scratch.part));
            }
        }
        Some(match for_part.unwrap_or(InTheWay::Many) {
            InTheWay::Many if !weak => {
                (gather.search(self.emitter, &gather.bounds(&[point]), MAX_BLOCKERS, &mut scratch.point), true)
            }
            other => (other, false),
        })
    }

    /// Illuminance (lx) by the opening observed last, of which all brings `lux`, with the shadows of what is in the way
    /// cut out; nothing where that is too much to cut.
    #[inline]
    fn exact(
        &self,
        point: usize,
        weak: bool,
        (in_the_way, alone): (InTheWay, bool),
        (light, lux): (&OpeningLight, f64),
        scratch: &mut DirectScratch,
    ) -> Option<[f64; 3]> {
        let DirectScratch { part, point: own, view, .. } = scratch;
        let list = if alone { own } else { part };
        match in_the_way {
            InTheWay::Nothing => Some([lux; 3]),
            InTheWay::Few if (!weak || list.len() <= MAX_BLOCKERS_IF_WEAK) && view.has_room() => {
                let touched = view.cut(list, &self.emitter.source, self.gather.eye(point));
                touched.map(|touched| if touched { self.lit(view, light, lux) } else { [lux; 3] })
            }
            InTheWay::Few | InTheWay::Many => None,
        }
    }

    /// The same by shadow rays, and its variance, lx².
    fn sample_instead(&self, point: usize, lux: f64, weak: bool, scratch: &mut DirectScratch) -> ([f64; 3], f64) {
        let gather = self.gather;
        let mut stream = gather.seed.branch(self.number as u64).stream(point as u64);
        let (start, caster) = (gather.receiver.start(point), gather.blockers.caster);
        let normal = gather.up.as_vec3();
        let target = match &self.emitter.source {
            LightSource::Body(body) => Target::body(body, &scratch.view.whole),
            LightSource::Polygon(polygon) => Target::Flat(polygon),
            LightSource::Point(_) | LightSource::Mesh(_) => return ([0.0; 3], 0.0),
        };
        let seen = if weak {
            sample::glimpse(&target, start, normal, caster, &mut stream)
        } else {
            sample::stratified(&target, start, normal, caster, &mut stream)
        };
        scratch.rays += seen.rays;
        (seen.share.map(|share| lux * share), lux * lux * seen.variance)
    }

    /// Whether it can be shown that all of the opening observed last is hidden: rays to what is still lit find
    /// triangles, whose shadows are cut out, until nothing is lit or a ray gets through.
    fn is_hidden(&self, point: usize, scratch: &mut DirectScratch) -> bool {
        let gather = self.gather;
        let DirectScratch { suspects, view, rays, .. } = scratch;
        let source = &self.emitter.source;
        let ahead = gather.ahead(self.emitter, self.bounds);
        let start = gather.receiver.start(point);
        let eye = start.as_dvec3();
        // The opening was observed from the point itself, which lies lower than where its rays start.
        let lowered = gather.place(point) - eye;
        view.start();
        for suspect in suspects.iter() {
            view.hide(suspect, source, eye);
        }
        let mut found = Vec::new();
        for _ in 0..PROBES {
            let Some(piece) = view.lit.iter().next() else { return true };
            *rays += 1;
            let to = piece.iter().sum::<DVec3>() / piece.len() as f64 + lowered;
            let reach = match (source, ahead) {
                // As far as just before the opening's plane.
                (_, Some((normal, front))) => {
                    let [here, there] = [eye.dot(normal), (eye + to).dot(normal)];
                    to.length() * ((here - front) / (here - there)).clamp(0.0, 1.0)
                }
                (LightSource::Body(body), None) => body.body.entry(eye, to.normalize()).unwrap_or(0.0),
                _ => 0.0,
            };
            let caster = gather.blockers.caster;
            let Some(hit) = caster.through_panes(start, to.normalize().as_vec3(), reach as f32).0 else {
                return false;
            };
            found.clear();
            source.blockers(ahead, hit.triangle, gather.blockers.corners(hit.triangle), &mut found);
            if !hide_all(&found, source, eye, view, suspects) {
                return false;
            }
        }
        view.lit.len() == 0
    }

    /// Illuminance (lx) by what is still lit of the opening observed last, through panes.
    fn lit(&self, view: &mut OpeningView, light: &OpeningLight, whole: f64) -> [f64; 3] {
        let gather = self.gather;
        if view.panes.is_empty() {
            return [light.sum(&view.lit, gather.up, whole, &mut view.parts); 3];
        }
        let OpeningView { panes, lit, size, parts, .. } = view;
        Shaded { panes, size: *size, light, up: gather.up, caster: gather.blockers.caster, whole, parts }.sum(lit)
    }
}

/// Cuts the shadows of blockers out of the opening observed last, and keeps those that hide some of it for the next
/// points; whether there is any.
fn hide_all(
    found: &[Blocker],
    source: &LightSource,
    eye: DVec3,
    view: &mut OpeningView,
    suspects: &mut Vec<Blocker>,
) -> bool {
    let mut hides = false;
    for blocker in found {
        if view.hide(blocker, source, eye) {
            hides = true;
            if suspects.len() < MAX_SUSPECTS {
                suspects.push(*blocker);
            }
        }
    }
    hides
}
