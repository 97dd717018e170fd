//! Meshes where they stand in the world: which faces are measured or emit, and which are too large.

use glam::DVec3;

use super::file::SceneFile;
use super::fixture::Fixture;
use super::measured::SurfaceSection;
use super::near::{self, Triangles};
use super::read::PlacedMesh;
use super::surface::Surface;
use super::{MeasuringPlane, Near};
use crate::geometry::mesh::Bounds;

impl PlacedMesh {
    /// The file's triangles that a measured surface is made of, ascending.
    pub(super) fn chosen(&self, section: &SurfaceSection) -> Vec<usize> {
        let is_wanted =
            |surface: &Surface| section.material.as_ref().is_none_or(|name| name.value == surface.material.name);
        let wanted: Vec<bool> = self.surfaces.iter().map(is_wanted).collect();
        if !wanted.contains(&true) {
            return Vec::new();
        }
        let ranges = match &section.group {
            Some(group) => self.groups.ranges(&group.value, self.faces),
            None => std::iter::once(0..self.faces).collect(),
        };
        ranges.into_iter().flatten().filter(|&index| wanted[self.material_of[index] as usize]).collect()
    }

    /// The box around the faces of each material that emits.
    fn emitting(&self) -> Vec<Bounds> {
        let mut boxes = vec![None; self.surfaces.len()];
        if self.surfaces.iter().any(|surface| surface.luminance.is_some()) {
            for (triangle, &material) in self.triangles.iter().zip(&self.material_of) {
                if self.surfaces[material as usize].luminance.is_some() {
                    let around = Bounds::around(triangle.map(|vertex| self.vertices[vertex as usize]));
                    boxes[material as usize] = Bounds::joined(boxes[material as usize], around);
                }
            }
        }
        boxes.into_iter().flatten().collect()
    }

    fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|vertex| self.vertices[vertex as usize])
    }

    /// Cuts what is far larger than the scene's core; emitting faces stay whole, so that they are as few as in the
    /// file.
    pub(super) fn cut_large(&mut self, near: &Near) {
        let Self { vertices, triangles, material_of, surfaces, .. } = self;
        near.cut_large(Triangles { vertices, triangles, material_of }, |material| {
            surfaces[material as usize].luminance.is_some()
        });
    }
}

/// What is measured with its surroundings, world coordinates; `whole` is the box around everything.
pub(super) fn surroundings(meshes: &[PlacedMesh], fixtures: &[Fixture], file: &SceneFile, whole: Bounds) -> Near {
    let planes = file.planes.iter().flat_map(MeasuringPlane::corners);
    let sensors = file.sensors.iter().map(|sensor| sensor.position);
    let faces = || {
        let all = meshes.iter().flat_map(|mesh| file.surfaces.iter().map(move |section| (mesh, section)));
        all.flat_map(|(mesh, section)| mesh.chosen(section).into_iter().map(|index| mesh.corners(index)))
    };
    let measured = Bounds::around(planes.chain(sensors).chain(faces().flatten()));
    let eyes = || Bounds::around(file.cameras.iter().map(|camera| camera.eye));
    let Some(measured) = measured.or_else(eyes) else { return Near::everything() };
    let lamps = fixtures.iter().filter_map(|fixture| Bounds::around(fixture.extremes()));
    let shining: Vec<Bounds> = lamps.chain(meshes.iter().flat_map(PlacedMesh::emitting)).collect();
    Near::of(measured, &shining, whole, || {
        let planes =
            file.planes.iter().map(|plane| (plane.corner + (plane.along + plane.across) / 2.0, plane.normal()));
        let sensors = file.sensors.iter().map(|sensor| (sensor.position, sensor.normal));
        let cameras = file.cameras.iter().map(|camera| (camera.eye, camera.forward));
        // Which side of a face is measured doesn't matter here: it may see either room.
        let faces = faces().map(|[a, b, c]| ((a + b + c) / 3.0, (b - a).cross(c - a).normalize_or(DVec3::Z)));
        let places: Vec<(DVec3, DVec3)> = planes.chain(sensors).chain(cameras).chain(faces).collect();
        let meshes: Vec<_> = meshes.iter().map(|mesh| (&*mesh.vertices, &*mesh.triangles)).collect();
        near::sight(&places, &meshes)
    })
}
