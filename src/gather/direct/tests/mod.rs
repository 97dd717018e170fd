//! Direct light against closed forms, and against plain sampling: scenes that the tests share.

mod measured;
mod sampling;
mod shadows;

use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

use super::polygon::projected_solid_angle;
use super::*;
use crate::embree::RayCaster;
use crate::geometry::Mesh;
use crate::geometry::body::{Body, Solid};
use crate::luminaire::intensity::Intensity;
use crate::luminaire::web::{Measured, Web};
use crate::luminaire::{Distribution, Opening};
use crate::scene::{MeasuringPlane, PlaneKind, Scene};
use crate::units::Lumens;

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A mesh of quadrilaterals, each as two triangles.
fn quads(quads: &[[DVec3; 4]]) -> Mesh {
    let mut mesh = Mesh::default();
    for quad in quads {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(quad.map(|corner| corner.as_vec3().to_array()));
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        mesh.material_of.extend([0, 0]);
    }
    mesh
}

/// The six sides of a box.
fn sides(low: DVec3, high: DVec3) -> Vec<[DVec3; 4]> {
    let corner = |i: usize| {
        v(
            if i & 1 == 0 { low.x } else { high.x },
            if i & 2 == 0 { low.y } else { high.y },
            if i & 4 == 0 { low.z } else { high.z },
        )
    };
    [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
        .map(|side| side.map(corner))
        .to_vec()
}

/// A luminaire of luminance 1 cd/m², shining down from a height on the rectangle between two corners.
fn panel([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], height: f64) -> Luminaire {
    Luminaire {
        name: "panel".into(),
        group: "panel".into(),
        flux: Lumens(PI * (x1 - x0) * (y1 - y0)),
        colour: [1.0; 3],
        opening: Opening::Rectangle {
            centre: v((x0 + x1) / 2.0, (y0 + y1) / 2.0, height),
            half_width: v((x1 - x0) / 2.0, 0.0, 0.0),
            half_depth: v(0.0, (y0 - y1) / 2.0, 0.0),
        },
        distribution: Distribution::Lambertian,
        body: Vec::new(),
        supply: Default::default(),
    }
}

/// The part of a panel's plane between four lines, as a polygon.
fn rectangle([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], height: f64) -> [DVec3; 4] {
    [v(x0, y0, height), v(x1, y0, height), v(x1, y1, height), v(x0, y1, height)]
}

/// Direct light at the points of a horizontal grid whose cells are `cell` wide and whose first point is `first`.
fn at_grid(luminaires: &[Luminaire], mesh: &Mesh, first: DVec3, cells: [usize; 2], cell: f64) -> DirectLight<1> {
    let caster = RayCaster::build(&Arc::new(mesh.clone()), 1).unwrap();
    at_grid_of(luminaires, &Blockers::new(mesh, &caster), first, cells, cell)
}

/// The same with a scene that is ready.
fn at_grid_of(
    luminaires: &[Luminaire],
    blockers: &Blockers<'_>,
    first: DVec3,
    cells: [usize; 2],
    cell: f64,
) -> DirectLight<1> {
    let plane = MeasuringPlane {
        name: "plane".into(),
        corner: first - v(cell, cell, 0.0) / 2.0,
        along: v(cell * cells[0] as f64, 0.0, 0.0),
        across: v(0.0, cell * cells[1] as f64, 0.0),
        cells,
        kind: PlaneKind::Air,
        areas: Default::default(),
    };
    let receiver = Receiver::of_plane(&plane, blockers.caster, 1e-4, 1.0);
    direct_light(luminaires, &receiver, blockers, Seed(1), |_| ())
}

/// Direct light at the origin, facing up; nothing may have been sampled.
fn at_origin(luminaire: Luminaire, mesh: &Mesh) -> f64 {
    let light = at_grid(&[luminaire], mesh, DVec3::ZERO, [1, 1], 0.5);
    assert_eq!((light.rays, light.variance[0]), (0, 0.0));
    light.value[0][0]
}

fn seen(corners: &[DVec3]) -> f64 {
    projected_solid_angle(corners, DVec3::ZERO, DVec3::Z)
}
