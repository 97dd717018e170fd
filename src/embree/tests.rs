//! Rays, leaks, refusals and memory.

use super::*;
use crate::random::{Seed, Stream};
use glam::{Quat, vec3};

fn mesh(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Arc<Mesh> {
    let material_of = vec![0; triangles.len()];
    Arc::new(Mesh { vertices: vertices.into_iter().map(Into::into).collect(), triangles, material_of })
}

/// The lower left half of a square of 1 m in the plane z = 0, front up.
fn half_a_square() -> Arc<Mesh> {
    mesh(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])
}

/// A closed box of the given size around the origin, turned, fronts inside.
fn closed_box(size: Vec3, turn: Quat) -> Arc<Mesh> {
    let side = |bit: u32, corner: u32| if corner >> bit & 1 == 1 { 0.5 } else { -0.5 };
    let corners = (0..8).map(|i| turn * (size * vec3(side(0, i), side(1, i), side(2, i)))).collect();
    let walls = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    mesh(corners, walls.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

/// Bounces a photon about, from `start` on, on the side of each surface it came from. Returns how many of `rays` met
/// nothing, or something that `allowed` says no photon can reach; after each such ray it starts anew.
fn lost(caster: &RayCaster, start: Vec3, rays: u32, allowed: impl Fn(&Hit) -> bool) -> u32 {
    let mut stream = Seed(7).stream(0);
    let begin = |stream: &mut Stream| (start, stream.cosine_about(Vec3::Z));
    let (mut lost, (mut origin, mut direction)) = (0, begin(&mut stream));
    for _ in 0..rays {
        (origin, direction) = match caster.closest_hit(origin, direction, f32::INFINITY) {
            Some(hit) if allowed(&hit) => {
                let back = stream.cosine_about(hit.normal * -hit.normal.dot(direction).signum());
                (hit.leave(back), back)
            }
            _ => {
                lost += 1;
                begin(&mut stream)
            }
        };
    }
    lost
}

#[test]
fn a_ray_meets_a_triangle_where_geometry_says() {
    let caster = RayCaster::build(&half_a_square(), 1).unwrap();
    let direction = vec3(0.0, 0.6, -0.8);
    let hit = caster.closest_hit(vec3(0.25, 0.0, 0.5), direction, 10.0).unwrap();
    assert_eq!((hit.triangle, hit.normal), (0, Vec3::Z));
    assert!((hit.distance - 0.625).abs() < 1e-6, "{hit:?}");
    assert!(hit.position.distance(vec3(0.25, 0.375, 0.0)) < 1e-6, "{hit:?}");
    // From behind too; the normal stays that of the front.
    let from_below = caster.closest_hit(vec3(0.25, 0.25, -1.0), Vec3::Z, 10.0).unwrap();
    assert_eq!((from_below.normal, from_below.distance), (Vec3::Z, 1.0));
    assert!(from_below.leave(Vec3::NEG_Z).z < 0.0 && from_below.leave(Vec3::Z).z > 0.0);
}

#[test]
fn a_ray_beside_behind_or_too_short_meets_nothing() {
    let caster = RayCaster::build(&half_a_square(), 1).unwrap();
    let above = vec3(0.25, 0.25, 1.0);
    for (origin, direction, max_distance) in
        [(vec3(0.75, 0.75, 1.0), Vec3::NEG_Z, 10.0), (above, Vec3::Z, 10.0), (above, Vec3::NEG_Z, 0.99)]
    {
        assert_eq!(caster.closest_hit(origin, direction, max_distance), None);
        assert!(!caster.is_occluded(origin, direction, max_distance));
    }
    assert!(caster.is_occluded(above, Vec3::NEG_Z, 1.01));
    assert!(caster.is_occluded(above, Vec3::NEG_Z, f32::INFINITY));
    assert!(!caster.is_occluded(above, Vec3::NEG_Z, -1e-6), "nothing lies on an empty segment");
}

/// Embree 4.3 writes 96 bytes where 4.2 wrote 80.
#[test]
fn a_query_writes_nothing_behind_its_struct() {
    #[repr(C)]
    struct Guarded {
        query: sys::RTCRayHit,
        guard: [u64; 8],
    }
    let caster = RayCaster::build(&half_a_square(), 1).unwrap();
    let guard = [0xdead_beef_dead_beef; 8];
    let ray = ray(vec3(0.25, 0.25, 1.0), Vec3::NEG_Z, 10.0);
    let mut guarded = Guarded { query: sys::RTCRayHit { ray, hit: Default::default() }, guard };
    guarded.query.hit.geomID = sys::RTC_INVALID_GEOMETRY_ID;
    caster.scene.closest_hit(&mut guarded.query);
    assert_eq!((guarded.query.hit.geomID, guarded.query.hit.primID), (0, 0));
    assert_eq!(guarded.guard, guard);
}

const RAYS: u32 = 1_000_000;
/// Measured over 2e7 rays: boxes lose 0 … 1.5e-7 a ray, sheets 0 … 3e-7 (at their sharp edges a step off one surface
/// can cross the other). So a million rays lose more than three by chance once in 3000 runs at most.
const MOST_LOST: u32 = 3;

#[test]
fn no_photon_escapes_from_a_closed_box_of_any_size() {
    let turned = Quat::from_rotation_x(0.5) * Quat::from_rotation_z(0.3);
    for (scale, turn) in [1e-3, 1.0, 1e3].into_iter().flat_map(|scale| [(scale, Quat::IDENTITY), (scale, turned)]) {
        let caster = RayCaster::build(&closed_box(scale * vec3(6.0, 7.2, 2.7), turn), 1).unwrap();
        let lost = lost(&caster, Vec3::ZERO, RAYS, |_| true);
        assert!(lost <= MOST_LOST, "{lost} of {RAYS} rays escaped at scale {scale}, turn {turn}");
    }
}

/// A sheet without thickness cuts the box in two, and sticks out of it: the half above must stay dark.
#[test]
fn no_photon_leaks_through_a_sheet_without_thickness() {
    for (scale, tilt) in [(1e-3, 0.4), (1.0, 0.0), (1.0, 0.4), (1e3, 0.4)] {
        let mut halves = closed_box(scale * vec3(6.0, 7.2, 2.7), Quat::IDENTITY);
        let turn = Quat::from_rotation_x(tilt) * Quat::from_rotation_y(tilt);
        let corner = |x, y| <[f32; 3]>::from(turn * (scale * vec3(x, y, 0.0)));
        let mesh = Arc::make_mut(&mut halves);
        mesh.vertices.extend([corner(-9.0, -9.0), corner(9.0, -9.0), corner(9.0, 9.0), corner(-9.0, 9.0)]);
        mesh.triangles.extend([[8, 9, 10], [8, 10, 11]]);
        mesh.material_of.extend([0, 0]);
        let caster = RayCaster::build(&halves, 1).unwrap();
        let up = turn * Vec3::Z;
        let lost = lost(&caster, -0.5 * scale * up, RAYS, |hit| hit.position.dot(up) < 1e-5 * scale);
        assert!(lost <= MOST_LOST, "{lost} of {RAYS} rays leaked at scale {scale}, tilt {tilt}");
    }
}

#[test]
fn a_mesh_that_embree_would_thin_out_is_refused() {
    let refused = |mesh: &Arc<Mesh>| RayCaster::build(mesh, 1).err().expect("the mesh is bad").to_string();
    let mut bad_index = half_a_square();
    Arc::make_mut(&mut bad_index).triangles.push([0, 1, 3]);
    Arc::make_mut(&mut bad_index).material_of.push(0);
    assert_eq!(refused(&bad_index), "Embree: triangle 1 names vertex 3, but the mesh has 3, counted from 0");
    for bad in [f32::NAN, f32::INFINITY, 1e30] {
        let mut mesh = half_a_square();
        Arc::make_mut(&mut mesh).vertices[2][1] = bad;
        let expected = format!("Embree: vertex 2 lies at (0, {bad}, 0); expected finite numbers up to 1e18 m");
        assert_eq!(refused(&mesh), expected);
    }
}

#[test]
fn an_empty_mesh_is_never_hit() {
    for mesh in [Arc::default(), mesh(vec![Vec3::X], vec![])] {
        let caster = RayCaster::build(&mesh, 2).unwrap();
        assert_eq!(caster.closest_hit(Vec3::ZERO, Vec3::X, f32::INFINITY), None);
        assert!(!caster.is_occluded(Vec3::ZERO, Vec3::X, f32::INFINITY));
    }
}

#[test]
fn two_threads_ask_at_once_and_get_the_same() {
    let caster = RayCaster::build(&closed_box(vec3(6.0, 7.2, 2.7), Quat::IDENTITY), 2).unwrap();
    let walk = || {
        let mut stream = Seed(3).stream(0);
        let mut ask = || caster.closest_hit(Vec3::ZERO, stream.cosine_about(Vec3::Z), f32::INFINITY).unwrap();
        (0..100_000).map(|_| ask()).collect::<Vec<_>>()
    };
    let (one, other) = std::thread::scope(|threads| {
        let (one, other) = (threads.spawn(walk), threads.spawn(walk));
        (one.join().unwrap(), other.join().unwrap())
    });
    assert!(one == other);
}

/// With room behind the last vertex, Embree reads the mesh in place; without, what it reads is a copy that has room.
#[test]
fn a_mesh_with_room_for_one_more_vertex_is_not_copied() {
    let mut mesh = Arc::unwrap_or_clone(half_a_square());
    mesh.vertices.shrink_to_fit();
    assert_eq!(mesh.vertices.capacity(), 3, "a Vec as the standard library makes it");
    assert_ne!(Buffers::of(&Arc::new(mesh.clone())).vertices().as_ptr(), mesh.vertices.as_ptr());
    mesh.vertices.reserve(1);
    let mesh = Arc::new(mesh);
    let caster = RayCaster::build(&mesh, 1).unwrap();
    assert_eq!(caster.buffers.vertices().as_ptr(), mesh.vertices.as_ptr());
    assert_eq!(caster.buffers.mesh.triangles.as_ptr(), mesh.triangles.as_ptr());
}

#[test]
fn memory_is_counted() {
    let small = RayCaster::build(&half_a_square(), 1).unwrap().peak_memory();
    let corner = |i: u32| vec3((i % 300) as f32, (i / 300) as f32, 0.0);
    let grid = (0..89_000).filter(|i| i % 300 < 299).map(|i| [i, i + 1, i + 300]).collect::<Vec<_>>();
    let large = RayCaster::build(&mesh((0..90_000).map(corner).collect(), grid.clone()), 2).unwrap().peak_memory();
    // A leaf of Embree's holds four triangles in 4 · 36 bytes at least.
    assert!(large > small + 36 * grid.len() as u64, "{small} B, {large} B");
}
