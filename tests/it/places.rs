//! Which grid points are places, where light can arrive, and which are the insides of things.

use std::fmt::Write as _;

use crate::common::folder;
use crate::common::room;
use crate::common::run;
use crate::common::scene;
use luxmap::render::plan::Method;

/// OBJ text of a ball of 8 × 16 facets that stands behind `obj`; its normals point outward, or inward for a cavity.
fn with_ball(mut obj: String, centre: [f64; 3], radius: f64, material: &str, inward: bool) -> String {
    let base = obj.lines().filter(|line| line.starts_with("v ")).count();
    for ring in 0..=8 {
        let (sin, cos) = (std::f64::consts::PI * f64::from(ring) / 8.0).sin_cos();
        for step in 0..16 {
            let (y, x) = (std::f64::consts::TAU * f64::from(step) / 16.0).sin_cos();
            let [a, b, c] = centre;
            writeln!(obj, "v {} {} {}", a + radius * sin * x, b + radius * sin * y, c + radius * cos)
                .expect("a string takes all");
        }
    }
    writeln!(obj, "usemtl {material}").expect("a string takes all");
    for ring in 0..8 {
        for step in 0..16 {
            let at = |ring: usize, step: usize| base + 1 + 16 * ring + step % 16;
            let corners = [at(ring, step), at(ring + 1, step), at(ring + 1, step + 1), at(ring, step + 1)];
            let [a, b, c, d] = if inward { [corners[3], corners[2], corners[1], corners[0]] } else { corners };
            for triangle in [[a, b, c], [a, c, d]] {
                if ring > 0 && ring < 7 || triangle.iter().any(|v| (base + 17..=base + 128).contains(v)) {
                    writeln!(obj, "f {} {} {}", triangle[0], triangle[1], triangle[2]).expect("a string takes all");
                }
            }
        }
    }
    obj
}

fn plane(name: &str, corner: [f64; 3]) -> String {
    format!(
        "[[plane]]\nname = \"{name}\"\ncorner = {corner:?}\nalong = [4, 0, 0]\nacross = [0, 3, 0]\ncells = [12, 9]\n"
    )
}

/// A lamp in a bulb of glass lights the whole room, though hardly any random walk finds its way into the bulb.
#[test]
fn a_lamp_in_a_small_bulb_reaches_the_whole_room() {
    let centre = [2.0, 1.5, 1.5];
    let bulb = with_ball(room([0.0; 3], [4.0, 3.0, 2.5], ["wall"; 6]), centre, 0.03, "glass", false);
    let bulb = with_ball(bulb, centre, 0.028, "glass", true);
    let toml = format!(
        "[material.wall]\nreflectance = 0.5\n[material.glass]\ndielectric = {{ ior = 1.5 }}\n\
         [[luminaire]]\nname = \"lamp\"\nposition = {centre:?}\nflux = 1000\n{}",
        plane("floor", [0.0; 3])
    );
    let results = run(&scene("bulb", &toml, &bulb), Method::Split, 10_000, 0);
    let floor = &results.maps[0];
    assert!(floor.has_value.iter().all(|has_value| *has_value), "every point of the floor is a place");
}

/// Two closed rooms whose lamps are made of one material are both lit: no triangle stands for all.
#[test]
fn each_room_is_lit_by_its_own_part_of_an_emitting_mesh() {
    let mtl = "newmtl glow\nKd 0\nKe 100\n";
    std::fs::write(folder("two_rooms").join("mesh.mtl"), mtl).expect("the target folder is writable");
    let rooms = room([0.0; 3], [14.0, 3.0, 2.5], ["wall"; 6]);
    let partition = "v 7 0 0\nv 7 3 0\nv 7 3 2.5\nv 7 0 2.5\nf -4 -3 -2 -1\n";
    let obj = format!("mtllib mesh.mtl\n{rooms}{partition}");
    let obj = with_ball(obj, [2.0, 1.5, 1.5], 0.2, "glow", false);
    let obj = with_ball(obj, [12.0, 1.5, 1.5], 0.2, "glow", false);
    let toml =
        format!("[material.wall]\nreflectance = 0.5\n{}{}", plane("near", [0.0; 3]), plane("far", [10.0, 0.0, 0.0]));
    let results = run(&scene("two_rooms", &toml, &obj), Method::Split, 10_000, 0);
    for map in &results.maps {
        assert!(map.has_value.iter().all(|has_value| *has_value), "every point of {} is a place", map.name);
    }
}
