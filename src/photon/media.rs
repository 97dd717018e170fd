//! Which glass light is in: solids of glass may hold others.

use glam::Vec3;

use super::surface::SurfaceOptics;
use crate::embree::RayCaster;

/// Solids inside of each other that are remembered; of more, the outermost are forgotten.
const MAX_NESTED: usize = 4;
/// Surfaces along a ray that finds what its start is in.
const MAX_SURFACES: u32 = 256;

/// The solids of glass that hold a point, by their materials: the innermost last. Where solids overlap, that which was
/// entered last counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Media {
    materials: [u32; MAX_NESTED],
    depth: u8,
}

impl Media {
    /// In no glass.
    pub(crate) const AIR: Self = Self { materials: [0; MAX_NESTED], depth: 0 };

    /// What holds `point` (m). Rays in six directions count what they leave without having entered it; where they
    /// disagree, as about a sheet that encloses nothing, the point is in the air.
    pub(crate) fn around<const C: usize>(point: Vec3, caster: &RayCaster, surfaces: &[SurfaceOptics<C>]) -> Self {
        if !surfaces.iter().any(SurfaceOptics::bounds_glass) {
            return Self::AIR;
        }
        let axes = [Vec3::new(0.48, 0.6, 0.64), Vec3::new(-0.64, 0.0, 0.768_374_9), Vec3::new(0.28, -0.96, 0.0)];
        let seen = axes.map(|axis| {
            [Self::left_along(point, axis, caster, surfaces), Self::left_along(point, -axis, caster, surfaces)]
        });
        let first = seen[0][0];
        let mut sorted = first.materials;
        sorted[..first.depth as usize].sort_unstable();
        let agrees = |other: &Self| {
            let mut materials = other.materials;
            materials[..other.depth as usize].sort_unstable();
            other.depth == first.depth && materials == sorted
        };
        if seen.as_flattened().iter().all(agrees) { first } else { Self::AIR }
    }

    /// The solids that a ray leaves without having entered them, the first it leaves last.
    fn left_along<const C: usize>(
        mut origin: Vec3,
        direction: Vec3,
        caster: &RayCaster,
        surfaces: &[SurfaceOptics<C>],
    ) -> Self {
        let (mut entered, mut left): (Vec<u32>, Vec<u32>) = (Vec::new(), Vec::new());
        for _ in 0..MAX_SURFACES {
            let Some(hit) = caster.closest_hit(origin, direction, f32::INFINITY) else { break };
            if surfaces[hit.material as usize].bounds_glass() {
                if direction.dot(hit.normal) < 0.0 {
                    entered.push(hit.material);
                } else if let Some(at) = entered.iter().rposition(|&material| material == hit.material) {
                    entered.remove(at);
                } else {
                    left.push(hit.material);
                }
            }
            origin = hit.leave(direction);
        }
        left.iter().rev().fold(Self::AIR, |media, &material| media.with(material))
    }

    /// What holds light that has crossed a surface of `material`.
    #[inline]
    pub(crate) fn beyond(self, material: u32, entering: bool) -> Self {
        if entering { self.with(material) } else { self.without(material) }
    }

    /// n₁/n₂ at a surface of `material`.
    #[inline]
    pub(crate) fn ratio<const C: usize>(self, surfaces: &[SurfaceOptics<C>], material: u32, entering: bool) -> f32 {
        let known = entering || self.holds(material);
        let before = if known { self.ior(surfaces) } else { surfaces[material as usize].ior() };
        before / self.beyond(material, entering).ior(surfaces)
    }

    /// Absorption coefficient of the innermost, 1/m.
    #[inline]
    pub(crate) fn absorption<const C: usize>(self, surfaces: &[SurfaceOptics<C>]) -> [f32; C] {
        match self.innermost().map(|material| &surfaces[material as usize]) {
            Some(&SurfaceOptics::Glass { absorption, .. }) => absorption,
            _ => [0.0; C],
        }
    }

    fn ior<const C: usize>(self, surfaces: &[SurfaceOptics<C>]) -> f32 {
        self.innermost().map_or(1.0, |material| surfaces[material as usize].ior())
    }

    fn innermost(self) -> Option<u32> {
        self.inside().last().copied()
    }

    fn inside(&self) -> &[u32] {
        &self.materials[..self.depth as usize]
    }

    fn holds(self, material: u32) -> bool {
        self.inside().contains(&material)
    }

    fn with(mut self, material: u32) -> Self {
        if self.depth as usize == MAX_NESTED {
            self.materials.rotate_left(1);
            self.depth -= 1;
        }
        self.materials[self.depth as usize] = material;
        self.depth += 1;
        self
    }

    fn without(mut self, material: u32) -> Self {
        if let Some(at) = self.inside().iter().rposition(|&inside| inside == material) {
            self.materials[at..self.depth as usize].rotate_left(1);
            self.depth -= 1;
            self.materials[self.depth as usize] = 0;
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaving_undoes_entering() {
        let in_two = Media::AIR.beyond(3, true).beyond(7, true);
        assert_eq!(in_two.innermost(), Some(7));
        assert_eq!(in_two.beyond(7, false), Media::AIR.beyond(3, true));
        // Overlapping solids: the other one remains.
        assert_eq!(in_two.beyond(3, false), Media::AIR.beyond(7, true));
        // What was never entered can be left all the same.
        assert_eq!(Media::AIR.beyond(5, false), Media::AIR);
        let deep = (0..6).fold(Media::AIR, |media, material| media.beyond(material, true));
        assert_eq!(deep.inside(), [2, 3, 4, 5]);
    }

    #[test]
    fn indices_are_those_of_both_sides() {
        let glass = |ior: f32| SurfaceOptics::<1>::Glass { ior, absorption: [ior] };
        let surfaces = [glass(1.5), glass(1.33)];
        let ratio = |media: Media, material, entering| media.ratio(&surfaces, material, entering);
        let outer = Media::AIR.beyond(0, true);
        assert_eq!(ratio(Media::AIR, 0, true), 1.0 / 1.5);
        assert_eq!(ratio(outer, 1, true), 1.5 / 1.33);
        assert_eq!(ratio(outer.beyond(1, true), 1, false), 1.33 / 1.5);
        assert_eq!(ratio(outer, 0, false), 1.5);
        assert_eq!(ratio(Media::AIR, 0, false), 1.5, "a sheet from behind");
        assert_eq!(outer.beyond(1, true).absorption(&surfaces), [1.33]);
        assert_eq!(outer.absorption(&surfaces), [1.5]);
        assert_eq!(Media::AIR.absorption(&surfaces), [0.0]);
    }
}
