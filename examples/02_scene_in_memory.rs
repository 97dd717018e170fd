//! A room made by a program, without a file: how does the light on a desk change with the walls' paint?
//!
//! `cargo run --release --example 02_scene_in_memory`

use luxmap::{Error, Job, Lamp, Method, SceneBuilder};

/// Corners of a room of 4 m × 3 m × 2.5 m, and its faces as seen from inside.
const CORNERS: [[f64; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [4.0, 0.0, 0.0],
    [4.0, 3.0, 0.0],
    [0.0, 3.0, 0.0],
    [0.0, 0.0, 2.5],
    [4.0, 0.0, 2.5],
    [4.0, 3.0, 2.5],
    [0.0, 3.0, 2.5],
];
const FLOOR: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];
const CEILING: [[u32; 3]; 2] = [[4, 6, 5], [4, 7, 6]];
const WALLS: [[u32; 3]; 8] = [[0, 5, 1], [0, 4, 5], [1, 6, 2], [1, 5, 6], [2, 7, 3], [2, 6, 7], [3, 4, 0], [3, 7, 4]];

fn main() -> Result<(), Error> {
    for reflectance in [0.2, 0.5, 0.8] {
        let scene = SceneBuilder::new("room")
            .mesh(&CORNERS, &FLOOR, "carpet")
            .mesh(&CORNERS, &CEILING, "white")
            .mesh(&CORNERS, &WALLS, "paint")
            .material("carpet", 0.2)
            .material("white", 0.8)
            .material("paint", reflectance)
            .luminaire(Lamp::new("panel", [2.0, 1.5, 2.49], 3000.0).rectangle([0.6, 0.6]))
            .sensor("desk", [1.0, 1.0, 0.75], [0.0, 0.0, 1.0])
            .build()?;
        let results = Job::new(scene).method(Method::Gather).photons(20_000).passes(1).seed(1).run()?;
        let desk = &results.sensors[0];
        println!("walls of {reflectance}: {:.0} ± {:.0} lx on the desk", desk.illuminance, desk.standard_error);
    }
    Ok(())
}
