//! Receivers before the first pass: where their points are, which are places at all, what is in their neighbours' way,
//! and the light that comes straight from luminaires.

use rayon::prelude::*;

use super::composition::{Composition, Density};
use super::place::Place;
use super::{PURPOSE_FAINT, PURPOSE_REACH, PURPOSE_SHADOWS, Rendering, surface_tolerance};
use crate::embree::RayCaster;
use crate::flux::photometric;
use crate::gather::density::Estimate;
use crate::gather::direct::blockers::Blockers;
use crate::gather::direct::bodies::direct_on_bodies;
use crate::gather::direct::{DirectLight, Request, direct_light_for};
use crate::gather::parts::faint::FaintLight;
use crate::gather::parts::{GroupRows, Site};
use crate::gather::reach::{LightReach, Points, Standing};
use crate::gather::receiver::Receiver;
use crate::gather::smooth::{Smoother, WIDEST};
use crate::gather::visible::{RAYS, VisiblePolygon};
use crate::gather::witness::Witness;
use crate::random::Seed;
use crate::scene::measured::Sample;
use crate::scene::{Material, PlaneKind};

impl<const C: usize> Rendering<'_, C> {
    /// Every receiver: the planes in the scene's order, the sensors' with the sensors each serves, then the surfaces.
    pub(super) fn places(&self, caster: &RayCaster) -> (Vec<Place<C>>, Vec<Vec<usize>>) {
        let scene = self.scene;
        let tolerance = surface_tolerance(self.diagonal) as f32;
        let radius = self.searches.smooth.radius;
        let mut sensors = Vec::new();
        let planes = scene
            .planes
            .iter()
            .map(|plane| (Receiver::of_plane(plane, caster, tolerance, radius), plane.kind == PlaneKind::Surface));
        let mut receivers: Vec<(Receiver, bool)> = planes.collect();
        for (receiver, served) in Receiver::of_sensors(scene, caster, tolerance, radius) {
            receivers.push((receiver, false));
            sensors.push(served);
        }
        if let Some((receiver, served)) = Receiver::of_bodies(scene, caster, tolerance) {
            receivers.push((receiver, false));
            sensors.push(served);
        }
        receivers.extend(scene.surfaces.iter().map(|surface| (Receiver::of_surface(surface, caster), false)));
        let counts_sharp = self.composition.counts_sharp;
        let place = |(mut receiver, on_surface): (Receiver, bool)| {
            // Cells so small that even the widest window over them holds few photons are asked by discs, as single
            // points are.
            let [width, height] = receiver.cell;
            receiver.cells_count =
                counts_sharp && receiver.grid.is_some() && (2.0 * WIDEST + 1.0) * width.min(height) >= radius;
            let points = receiver.len();
            let in_groups = receiver.is_plane() || !receiver.bodies().is_empty();
            let groups = self.groups.as_ref().filter(|_| in_groups).map(|groups| {
                let variances = if receiver.grid.is_some() { 0 } else { groups.len() };
                GroupRows { width: groups.width::<C>(), variances, light: Vec::new(), variance: Vec::new() }
            });
            Place {
                site: Site {
                    on_surface,
                    has_value: vec![true; points],
                    standing: vec![Standing::Place; points],
                    areas: Vec::new(),
                    visible: Vec::new(),
                    smoother: None,
                    receiver,
                },
                parts: Vec::new(),
                bounced: vec![Estimate::DARK; points],
                rest: Vec::new(),
                groups,
                extremes: Vec::new(),
                scaled: Vec::new(),
            }
        };
        let mut places: Vec<Place<C>> = receivers.into_iter().map(place).collect();
        let first = places.len() - scene.surfaces.len();
        for (place, surface) in places[first..].iter_mut().zip(&scene.surfaces) {
            place.site.areas = surface.samples.iter().map(Sample::area).collect();
        }
        (places, sensors)
    }

    /// Direct light of every receiver, for good, but for what is faint.
    pub(super) fn direct(&mut self, places: &mut [Place<C>], caster: &RayCaster) {
        let steps = (places.len() * self.scene.luminaires.len()) as u64;
        self.timed("direct light", steps, |this| {
            let blockers = Blockers::new(&this.scene.mesh, caster);
            for (index, place) in places.iter_mut().enumerate() {
                let seed = Seed(this.settings.seed).branch(PURPOSE_SHADOWS).branch(index as u64);
                let advance = |steps| this.progress.advance(steps);
                let (luminaires, receiver) = (&this.scene.luminaires, &place.site.receiver);
                let groups = place.groups.as_ref().and(this.groups.as_ref());
                // Where rays come anyway, and neighbours help each other, faint luminaires are left to them.
                let sampled = this.composition.rays.is_some();
                let faint = this.settings.smooth && receiver.grid.is_some() && sampled && groups.is_none();
                let (light, faint): (DirectLight<C>, _) = match receiver.bodies() {
                    [] => {
                        let asked = Request { groups, faint };
                        let (light, faint) = direct_light_for(luminaires, receiver, &blockers, seed, advance, asked);
                        let seed = Seed(this.settings.seed).branch(PURPOSE_FAINT).branch(index as u64);
                        let faint = (!faint.is_empty()).then(|| FaintLight::new(faint, receiver.len(), seed));
                        (light, faint)
                    }
                    bodies => (direct_on_bodies(luminaires, receiver, bodies, &blockers, seed, advance, groups), None),
                };
                this.record.prepared_rays += light.rays;
                place.parts.push(Box::new(light));
                if let Some(faint) = faint {
                    place.parts.push(Box::new(faint));
                }
            }
        });
    }

    /// Finds which points are places at all. That is a fact of the scene: all seeds agree on it, so that their results
    /// can be merged.
    fn find_standings(&self, places: &mut [Place<C>], caster: &RayCaster) {
        let points = places.iter().map(|place| Points { receiver: &place.site.receiver, areas: &place.site.areas });
        let points: Vec<Points<'_>> = points.collect();
        // Cutting leaves slivers of what is hidden: light that is real comes by some other way, too.
        let lux = |place: &Place<C>, point: usize| {
            place.straight().map(|part| photometric(part.straight(point).value)).sum::<f64>()
        };
        let of_place = |place: &Place<C>| (0..place.len()).map(|point| lux(place, point)).fold(0.0, f64::max);
        let sliver = 1e-5 * places.iter().map(of_place).fold(0.0, f64::max);
        let is_lit = |place: usize, point: usize| lux(&places[place], point) > sliver;
        let mut reach = LightReach::new(self.scene, caster, Seed(0).branch(PURPOSE_REACH));
        let found = reach.standings(&points, is_lit);
        for (place, standing) in places.iter_mut().zip(found) {
            place.site.has_value = standing.iter().map(|standing| standing.is_place()).collect();
            place.site.standing = standing;
        }
    }

    /// Finds which points are places at all, and what is in their neighbours' way.
    pub(super) fn look_around(&mut self, places: &mut [Place<C>], caster: &RayCaster) {
        let radius = self.searches.smooth.radius;
        let Composition { density, counts_sharp, rays, .. } = self.composition;
        let helped = if rays.is_some() { self.settings.smooth } else { counts_sharp };
        self.timed("look around", places.len() as u64, |this| {
            this.find_standings(places, caster);
            for Site { receiver, has_value, visible, smoother, .. } in places.iter_mut().map(|place| &mut place.site) {
                let has_discs = counts_sharp && !receiver.cells_count;
                if receiver.is_plane() && (density == Some(Density::LocalLinear) || has_discs) {
                    let points = (0..receiver.len()).into_par_iter();
                    *visible = points.map(|point| VisiblePolygon::cast(receiver, point, caster, radius)).collect();
                    this.record.prepared_rays += (RAYS * visible.len()) as u64;
                }
                if let (Some(grid), true) = (receiver.grid, helped) {
                    *smoother = Some(Smoother::new(receiver, grid, has_value, caster));
                    this.record.prepared_rays += 2 * receiver.len() as u64;
                }
                this.progress.advance(1);
            }
        });
    }

    /// Photons that hold their word against what rays find at a receiver, where rays rely on photons.
    pub(super) fn witness(&self, site: &Site, caster: &RayCaster) -> Option<Witness> {
        let receiver = &site.receiver;
        let diffuse = self.scene.materials.iter().any(Material::is_diffuse);
        if !self.composition.patches || !receiver.is_plane() || !diffuse {
            return None;
        }
        match (receiver.grid, &site.smoother) {
            (Some(grid), Some(smoother)) => Some(Witness::of_grid(grid, receiver, smoother, caster)),
            (None, _) => Some(Witness::of_points(receiver, 0.5 * self.searches.smooth.radius, caster)),
            _ => None,
        }
    }
}
