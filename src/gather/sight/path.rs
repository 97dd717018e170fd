//! One path, followed backwards from a point from surface to surface.

use glam::Vec3;

use super::super::caustics::CausticMap;
use super::{Last, Origins, Records, Sight, cross_glass, cross_pane};
use crate::embree::Hit;
use crate::flux::{Flux, photometric};
use crate::photon::media::Media;
use crate::photon::optics::mirror;
use crate::photon::surface::{Gloss, Layers, SurfaceOptics};
use crate::photon::trace::BOUNCE_CAP;
use crate::random::Stream;
use crate::scene::glazing::Curves;

/// Russian roulette lets a path go on with this many times the share of light that it still brings, if that is below 1:
/// 1.6 to 2 times as efficient as a factor of 1, in an office.
pub(in crate::gather) const SURVIVAL: f32 = 4.0;

/// A path under way.
pub(super) struct Path<'s, 'a, const C: usize> {
    sight: &'s Sight<'a, C>,
    records: Option<Records<'s, C>>,
    stream: &'s mut Stream,
    /// Counts rays.
    rays: &'s mut u64,
    origin: Vec3,
    direction: Vec3,
    /// What the path has found, lx.
    found: [f64; C],
    /// What light that it meets now counts.
    weight: Flux<C>,
    /// The glass that it is in, and its absorption coefficient, 1/m.
    media: Media,
    absorption: [f32; C],
    last: Last,
    /// Whether photons count the caustics at the start of the path or at its last diffuse surface: then the path must
    /// not.
    counted: bool,
    /// Whether a luminaire that the path meets now would be seen there as a caustic.
    caustic: bool,
    /// Distance flown before panes that the ray passed since it left anything else, m.
    before_panes: f32,
}

/// Adds light to what a path found, and returns it by its weight.
#[inline(always)]
fn add<const C: usize>(found: &mut [f64; C], weight: Flux<C>, lux: [f32; C]) -> [f64; C] {
    let part = std::array::from_fn(|c| f64::from(weight.0[c]) * f64::from(lux[c]));
    (0..C).for_each(|c| found[c] += part[c]);
    part
}

impl<'s, 'a, const C: usize> Path<'s, 'a, C> {
    /// A path that starts with a ray from `origin` (m) along the unit vector `direction`.
    #[inline]
    pub(super) fn new(
        sight: &'s Sight<'a, C>,
        (origin, direction): (Vec3, Vec3),
        records: Option<Records<'s, C>>,
        stream: &'s mut Stream,
        rays: &'s mut u64,
    ) -> Self {
        Self {
            sight,
            records,
            stream,
            rays,
            origin,
            direction,
            found: [0.0; C],
            weight: Flux([1.0; C]),
            media: Media::AIR,
            absorption: [0.0; C],
            last: Last::Point,
            counted: !sight.caustics,
            caustic: false,
            before_panes: 0.0,
        }
    }

    /// π times the radiance (lx) that the path finds; `near` gets what luminaires bring straight that are left to rays.
    #[inline]
    pub(super) fn follow(mut self, mut near: Option<&mut [f64; C]>, origins: &mut impl Origins<C>) -> [f64; C] {
        let sight = self.sight;
        for _ in 0..BOUNCE_CAP {
            *self.rays += 1;
            let Some(mut hit) = sight.caster.closest_hit(self.origin, self.direction, f32::INFINITY) else { break };
            if self.absorption.iter().any(|&per_metre| per_metre > 0.0) {
                self.weight = self.weight.filtered(self.absorption.map(|per_metre| (-per_metre * hit.distance).exp()));
            }
            let front = self.direction.dot(hit.normal) < 0.0;
            let facing = if front { hit.normal } else { -hit.normal };
            hit.distance += self.before_panes;
            self.before_panes = 0.0;
            let goes_on = match &sight.surfaces[hit.material as usize] {
                SurfaceOptics::Pane(curves) => self.meet_pane(curves, &hit, facing),
                SurfaceOptics::Glass { .. } => {
                    self.direction =
                        cross_glass(&sight.surfaces, &hit, self.direction, facing, &mut self.media, self.stream);
                    self.absorption = self.media.absorption(&sight.surfaces);
                    (self.last, self.caustic) = (Last::Mirror, true);
                    true
                }
                surface => {
                    let layers = surface.layers(front);
                    self.meet_luminaire(&hit, front, near.as_deref_mut(), origins);
                    self.meet_layers(&hit, facing, layers, origins) && self.survives()
                }
            };
            if !goes_on {
                break;
            }
            self.origin = hit.leave(self.direction);
        }
        debug_assert!(photometric(self.found).is_finite());
        self.found
    }

    /// Passes a pane or is mirrored by it; false where neither brings anything.
    #[inline(always)]
    fn meet_pane(&mut self, curves: &Curves, hit: &Hit, facing: Vec3) -> bool {
        match cross_pane(curves, self.direction, hit.normal, self.weight, self.stream) {
            Some((true, left)) => (self.weight, self.before_panes) = (left, hit.distance),
            Some((false, left)) => {
                (self.weight, self.direction) = (left, mirror(self.direction, facing));
                (self.last, self.caustic) = (Last::Mirror, true);
            }
            None => return false,
        }
        true
    }

    /// Adds the light of a luminaire that the ray met, as far as it is left to rays.
    #[inline(always)]
    fn meet_luminaire(&mut self, hit: &Hit, front: bool, near: Option<&mut [f64; C]>, origins: &mut impl Origins<C>) {
        let (sight, direction, weight) = (self.sight, self.direction, self.weight);
        if !(self.caustic && self.counted)
            && let Some(glow) = sight.glow(hit.triangle)
            && let Some(times) = sight.brightness(glow, direction, front)
        {
            let exitance = glow.exitance.map(|channel| channel * times);
            let left = sight.left_to(glow, self.last, direction, hit);
            if left > 0.0 {
                origins.luminaire(glow.luminaire, add(&mut self.found, weight.scaled(left), exitance));
            } else if let (Last::Point, Some(near)) = (self.last, near) {
                let left = sight.left_to(glow, Last::Diffuse, direction, hit);
                (0..C).for_each(|c| near[c] += f64::from(left * weight.0[c]) * f64::from(exitance[c]));
            }
        }
    }

    /// Goes on by one of a surface's layers, drawn by what each still brings; false where the path ends here.
    #[inline(always)]
    fn meet_layers(&mut self, hit: &Hit, facing: Vec3, layers: Layers<C>, origins: &mut impl Origins<C>) -> bool {
        let Layers { diffuse, transmitted, specular, rough } = layers;
        let (diffused, mirrored) = (self.weight.filtered(diffuse), self.weight.filtered(specular));
        let passed = self.weight.filtered(transmitted);
        let (to_diffuse, to_mirror, to_other) = (diffused.brightest(), mirrored.brightest(), passed.brightest());
        let any = to_diffuse + to_mirror + to_other;
        if any <= 0.0 {
            return false;
        }
        if to_mirror > 0.0 && self.stream.uniform() * any < to_mirror {
            self.weight = mirrored.scaled(any / to_mirror);
            self.reflect(hit, facing, rough, origins);
            return true;
        }
        let scale = any / (to_diffuse + to_other);
        self.scatter(hit, facing, [diffused.scaled(scale), passed.scaled(scale)], [to_diffuse, to_other], origins)
    }

    /// Goes on by a mirror, perfect or rough.
    #[inline(always)]
    fn reflect(&mut self, hit: &Hit, facing: Vec3, rough: Option<Gloss>, origins: &mut impl Origins<C>) {
        let direction = self.direction;
        self.caustic |= rough.is_none_or(|gloss| gloss.sharp);
        let Some(Gloss { facets, .. }) = rough else {
            self.direction = mirror(direction, facing);
            self.last = Last::Mirror;
            return;
        };
        if !(self.caustic && self.counted) {
            *self.rays += 1;
            let (lux, luminaire) = self.sight.glossed(facets, hit.leave(facing), -direction, facing, self.stream);
            origins.luminaire(luminaire, add(&mut self.found, self.weight, lux));
        }
        self.direction = facets.reflect(direction, facing, self.stream);
        self.last = Last::Gloss(facets.lobe(-direction, self.direction, facing));
    }

    /// Ends at a diffuse surface whose light photons recorded, and returns false; else adds the light that comes
    /// straight from luminaires and as caustics, and goes on in a direction drawn by the cosine. `here` and `there` are
    /// the weights of light that arrives on this side and on the other, `shares` what they may bring.
    #[inline(always)]
    fn scatter(
        &mut self,
        hit: &Hit,
        facing: Vec3,
        [mut here, there]: [Flux<C>; 2],
        [to_diffuse, to_other]: [f32; 2],
        origins: &mut impl Origins<C>,
    ) -> bool {
        if self.is_recorded(hit, [here, there], to_other > 0.0, origins) {
            return false;
        }
        if to_diffuse > 0.0 {
            self.add_direct(hit, facing, here, origins);
        }
        let caustics = self.records.and_then(|records| records.caustics);
        if let Some(caustics) = caustics {
            self.add_caustics(caustics, hit, [(here, facing), (there, -facing)], origins);
        }
        let mut side = facing;
        if to_other > 0.0 {
            self.add_direct(hit, -facing, there, origins);
            let chance = to_other / (to_diffuse + to_other);
            if self.stream.uniform() < chance {
                (here, side) = (there.scaled(1.0 / chance), -facing);
            } else {
                here = here.scaled(1.0 / (1.0 - chance));
            }
        }
        self.weight = here;
        self.direction = self.stream.cosine_about(side);
        (self.last, self.caustic, self.counted) = (Last::Diffuse, false, caustics.is_some());
        true
    }

    /// Whether photons recorded the light that arrives at a surface, on both sides if it is `translucent`; then it is
    /// added.
    #[inline(always)]
    fn is_recorded(
        &mut self,
        hit: &Hit,
        [here, there]: [Flux<C>; 2],
        translucent: bool,
        origins: &mut impl Origins<C>,
    ) -> bool {
        let Some(Records { grid, light, .. }) = self.records else { return false };
        let Some(patch) = grid.patch(hit, self.direction, self.sight.caster) else { return false };
        let behind = if translucent { grid.patch(hit, -self.direction, self.sight.caster) } else { None };
        if translucent && behind.is_none() {
            return false;
        }
        add(&mut self.found, here, light.illuminance(patch));
        origins.patch(patch, here);
        if let Some(behind) = behind {
            add(&mut self.found, there, light.illuminance(behind));
            origins.patch(behind, there);
        }
        true
    }

    /// Adds the light that arrives straight from luminaires on one side of a surface.
    #[inline(always)]
    fn add_direct(&mut self, hit: &Hit, side: Vec3, weight: Flux<C>, origins: &mut impl Origins<C>) {
        *self.rays += 1;
        let (lux, luminaire) = self.sight.lamps.direct(hit.leave(side), side, self.stream);
        origins.luminaire(luminaire, add(&mut self.found, weight, lux));
    }

    /// Adds the caustics on both sides of a surface.
    #[inline(always)]
    fn add_caustics(
        &mut self,
        caustics: &CausticMap<C>,
        hit: &Hit,
        sides: [(Flux<C>, Vec3); 2],
        origins: &mut impl Origins<C>,
    ) {
        let Self { found, stream, sight, .. } = self;
        for (weight, normal) in sides {
            if weight.brightest() > 0.0 {
                let above = hit.leave(normal);
                let meet = |luminaire, lux: [f64; C]| {
                    origins.luminaire(luminaire, add(found, weight, lux.map(|lux| lux as f32)));
                };
                let mut scratch = caustics.scratch();
                caustics.each(hit.position, above, normal, (sight.caster, stream), &mut scratch, meet);
            }
        }
    }

    /// Russian roulette by what the path still brings.
    #[inline(always)]
    fn survives(&mut self) -> bool {
        let chance = (SURVIVAL * self.weight.brightest()).min(1.0);
        if chance < 1.0 {
            if self.stream.uniform() >= chance {
                return false;
            }
            self.weight = self.weight.scaled(1.0 / chance);
        }
        true
    }
}
