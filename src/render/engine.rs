//! What a run keeps from pass to pass: rays, patches, what photons are counted for.

use super::method::{self, MadeFrom};
use super::place::Place;
use super::{PURPOSE_BRIGHT, PURPOSE_SIGHT, Rendering, surface_tolerance};
use crate::embree::RayCaster;
use crate::gather::camera::first_surface;
use crate::gather::cell_counts::Cells;
use crate::gather::counts::Watched;
use crate::gather::parts::Site;
use crate::gather::patches::{PatchGrid, PatchLight, PatchRecorder};
use crate::gather::sight::Sight;
use crate::photon::emit::triangle_area;
use crate::photon::trace::Tracer;
use crate::random::Seed;

/// A patch's size as a part of the mean distance that points look: as fine as their mean over a hemisphere needs.
const PATCH_SHARE: f64 = 1.0 / 10.0;

/// Radius of the disc about a body in which photons are counted, in largest search radii.
const DISC_SHARE: f32 = 0.2;

/// What rays of a point look at before patches are cut: tells how far they look.
const SCOUTS: u64 = 4096;

/// What a run keeps from pass to pass.
pub(super) struct Engine<'a, const C: usize> {
    pub(super) caster: &'a RayCaster,
    /// Of all surfaces that are near, m².
    pub(super) area: f64,
    pub(super) tracer: Option<Tracer<'a, C>>,
    pub(super) sight: Option<Sight<'a, C>>,
    pub(super) grid: Option<PatchGrid>,
    /// What photons are counted for at each receiver.
    pub(super) watched: Vec<Watched<'a>>,
}

impl<'a, const C: usize> Engine<'a, C> {
    pub(super) fn new(run: &Rendering<'a, C>, places: &mut [Place<C>], caster: &'a RayCaster) -> Self {
        let (scene, composition) = (run.scene, &run.composition);
        let photons = run.settings.photons.div_ceil(run.rounds());
        let tracer = run.plan.photons.then(|| {
            let most_bounces = run.trial.most_bounces();
            Tracer::new(scene, caster, photons).with_most_bounces(most_bounces)
        });
        let looks = composition.rays.is_some() || !scene.cameras.is_empty();
        let sight = looks.then(|| Sight::new(scene, caster, composition.paths));
        let mut grid = composition.patches.then(|| {
            let size = PATCH_SHARE * mean_sight(run, places, sight.as_ref(), caster);
            let height = surface_tolerance(run.diagonal);
            let useful = |material: u32| scene.materials[material as usize].is_diffuse();
            PatchGrid::new(&scene.mesh, useful, size as f32, (&scene.near, PATCH_SHARE), height as f32)
        });
        if let (Some(grid), Some(tracer)) = (&mut grid, &tracer) {
            // A fact of the scene, as whether light can arrive somewhere.
            let seed = Seed(0).branch(PURPOSE_BRIGHT);
            let (records, _) = tracer.trace(seed, 0, || PatchRecorder::new(grid), |_| ());
            let light: PatchLight<C> = PatchLight::new(grid, &records);
            drop(records);
            grid.note_bright(&light);
        }
        let looked_at = if composition.caustic_maps { scene.mesh.triangles.len() } else { 0 };
        let corners = (0..looked_at).map(|triangle| scene.mesh.corners(triangle));
        let near = corners.filter(|corners| scene.near.distance(*corners) <= scene.near.horizon());
        let area = near.map(|corners| triangle_area(&corners)).sum();
        let watched = watched(run, places, caster);
        for (index, place) in places.iter_mut().enumerate() {
            let counted = watched.get(index).filter(|watched| !matches!(watched, Watched::Nothing));
            let made_from = MadeFrom { run, index, counted: counted.map(Watched::areas), caster };
            let parts = method::parts(&place.site, place.groups.is_some(), made_from);
            place.parts.extend(parts);
        }
        Self { caster, area, tracer, sight, grid, watched }
    }
}

/// What photons are to be counted for at each receiver; empty where they are nowhere.
fn watched<'a, const C: usize>(run: &Rendering<'a, C>, places: &[Place<C>], caster: &RayCaster) -> Vec<Watched<'a>> {
    let is_apart = |place: &Place<C>| !place.site.receiver.is_plane() || place.site.receiver.cells_count;
    if run.composition.counted.is_none() || !places.iter().any(is_apart) {
        return Vec::new();
    }
    let first = places.len() - run.scene.surfaces.len();
    let of = |(index, place): (usize, &Place<C>)| {
        let Site { receiver, has_value, .. } = &place.site;
        match (receiver.bodies(), index.checked_sub(first)) {
            ([], None) if receiver.cells_count => Watched::Cells(Cells::measure(receiver, has_value, caster)),
            ([], None) => Watched::Nothing,
            ([], Some(surface)) => Watched::Surface(&run.scene.surfaces[surface]),
            _ => {
                let (radius, floor) = (DISC_SHARE * run.searches.smooth.radius, run.searches.smooth.floor);
                Watched::bodies(receiver, radius, floor, caster)
            }
        }
    };
    places.iter().enumerate().map(of).collect()
}

/// Mean distance of what the points of all receivers, and those that cameras see, look at, m; the scene's diagonal
/// where they see nothing. What is far counts as near: a glimpse of ground 10 km off must not make the patches of the
/// room coarse.
fn mean_sight<const C: usize>(
    run: &Rendering<'_, C>,
    places: &[Place<C>],
    sight: Option<&Sight<'_, C>>,
    caster: &RayCaster,
) -> f64 {
    let seed = Seed(run.settings.seed).branch(PURPOSE_SIGHT);
    let cameras = &run.scene.cameras;
    let (mut sum, mut count) = (0.0, 0.0);
    for scout in 0..SCOUTS {
        let mut stream = seed.stream(scout);
        let from = (scout % (places.len() + cameras.len()) as u64) as usize;
        let start = if let Some(place) = places.get(from) {
            let points = place.site.receiver.len();
            let point = ((f64::from(stream.uniform()) * points as f64) as usize).min(points - 1);
            let direction = place.site.receiver.direction(point, stream.uniform_pair());
            place.site.has_value[point].then(|| (place.site.receiver.start(point), direction))
        } else {
            let camera = &cameras[from - places.len()];
            let at = [0, 1].map(|axis| f64::from(stream.uniform()) * camera.pixels[axis] as f64);
            let (eye, direction) = (camera.eye.as_vec3(), camera.direction(at).as_vec3());
            sight.and_then(|sight| first_surface(sight, caster, eye, direction)).map(|(hit, direction)| {
                let normal = if direction.dot(hit.normal) < 0.0 { hit.normal } else { -hit.normal };
                (hit.leave(normal), stream.cosine_about(normal))
            })
        };
        let hit = start.and_then(|(start, direction)| caster.closest_hit(start, direction, f32::INFINITY));
        if let Some(hit) = hit {
            sum += f64::from(hit.distance).min(run.scene.near.horizon());
            count += 1.0;
        }
    }
    if count > 0.0 { sum / count } else { run.diagonal }
}
