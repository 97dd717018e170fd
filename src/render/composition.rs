//! What each method is made of. But for names, defaults and words, this is the only place where methods differ.

use crate::gather::receiver::Keep;
use crate::options::Method;

/// What a plan has decided of passes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Decided {
    /// How illuminance is computed.
    pub(super) method: Method,
    /// Whether anything is left to passes.
    pub(super) bounces: bool,
    /// Whether photons are traced.
    pub(super) photons: bool,
    /// Whether mirrors or glass make caustics.
    pub(super) caustics: bool,
}

/// Parts of a pass with photons and rays of their own, so that even one pass knows its scatter.
pub(super) const ROUNDS: u64 = 4;

/// Where rays from the points end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rays {
    /// On surfaces whose light the photons know: final gather.
    OnPatches,
    /// Where roulette lets them: paths.
    AsPaths,
}

/// How the density of photons tells light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Density {
    /// Corrected for every known bias, smooth light apart from light with edges.
    LocalLinear,
    /// As printed in the paper.
    Paper,
}

/// What a method asks of photons and rays, in one scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct Composition {
    /// Rays from the points, if it sends any.
    pub(super) rays: Option<Rays>,
    /// Whether rays that meet a surface go on even where photons know its light.
    pub(super) paths: bool,
    /// Densities of photons where they cross planes, if it takes any.
    pub(super) density: Option<Density>,
    /// Which photons are kept where they cross planes, if any.
    pub(super) crossings: Option<Keep>,
    /// Which photons are counted in cells, on samples and about bodies, if any.
    pub(super) counted: Option<Keep>,
    /// Whether light with edges is told by photons: counted in the cells of grids, over discs about single points.
    pub(super) counts_sharp: bool,
    /// Whether photons are kept where they land.
    pub(super) landings: bool,
    /// Whether the light of surfaces is found by photons, patch by patch; others then check what rays find.
    pub(super) patches: bool,
    /// Whether rays or cameras ask for caustics where they meet surfaces.
    pub(super) caustic_maps: bool,
    /// Parts of a pass with photons of their own.
    pub(super) rounds: u64,
    /// Stages of a pass, for the record of times.
    pub(super) stages: &'static [&'static str],
}

impl Composition {
    /// That of a plan's decisions; `cameras` tells whether there are any.
    pub(super) fn of(plan: Decided, cameras: bool) -> Self {
        let none = Self {
            rays: None,
            paths: false,
            density: None,
            crossings: None,
            counted: None,
            counts_sharp: false,
            landings: false,
            patches: false,
            caustic_maps: plan.caustics && cameras,
            rounds: if plan.method.sends_rays() { ROUNDS } else { 1 },
            stages: &["trace photons", "build trees", "gather"],
        };
        // Photons of methods without them, or of scenes without passes, are not asked for anything.
        let photons = |keep: Keep| plan.photons.then_some(keep);
        let density = plan.photons.then_some(Density::LocalLinear);
        match plan.method {
            Method::Gather => {
                let caustics = if plan.caustics { photons(Keep::Caustics) } else { None };
                Self {
                    rays: plan.bounces.then_some(Rays::OnPatches),
                    crossings: caustics,
                    counted: caustics,
                    counts_sharp: caustics.is_some(),
                    patches: plan.photons,
                    caustic_maps: plan.caustics,
                    stages: &["trace photons", "build records", "gather rays"],
                    ..none
                }
            }
            Method::Path => {
                let rays = plan.bounces.then_some(Rays::AsPaths);
                Self { rays, paths: true, stages: &["gather rays"], ..none }
            }
            Method::Split => {
                let bounced = photons(Keep::Bounced);
                let counts_sharp = plan.photons && plan.caustics;
                Self { density, crossings: bounced, counted: bounced, counts_sharp, ..none }
            }
            Method::Photons => {
                let all = photons(Keep::All);
                Self { density, crossings: all, counted: all, counts_sharp: plan.photons, ..none }
            }
            Method::Seed => {
                let all = photons(Keep::All);
                let density = plan.photons.then_some(Density::Paper);
                Self { density, crossings: all, counted: all, landings: plan.photons, ..none }
            }
        }
    }
}
