//! Two light groups told apart in one run, then the least power that gives a desk 200 lx.
//!
//! `cargo run --release --example 03_light_groups_and_dimming`

use luxmap::{Error, Goal, Job, Lamp, Scene, SceneBuilder};

fn room() -> Result<Scene, Error> {
    let level = |z: f64| [[0.0, 0.0, z], [6.0, 0.0, z], [6.0, 3.0, z], [0.0, 3.0, z]];
    let lamp = |name: &str, x: f64, group: &str| {
        Lamp::new(name, [x, 1.5, 2.5], 3000.0).rectangle([0.6, 0.6]).power(30.0).group(group)
    };
    SceneBuilder::new("two rows")
        .mesh(&level(0.0), &[[0, 1, 2], [0, 2, 3]], "floor")
        .mesh(&level(2.6), &[[0, 2, 1], [0, 3, 2]], "ceiling")
        .material("floor", 0.5)
        .material("ceiling", 0.8)
        .luminaire(lamp("west", 1.5, "west"))
        .luminaire(lamp("east", 4.5, "east"))
        .sensor_with_target("desk", [1.5, 1.0, 0.75], [0.0, 0.0, 1.0], 200.0)
        .build()
}

fn main() -> Result<(), Error> {
    let job = Job::new(room()?).photons(20_000).passes(4).seed(1);

    let results = job.clone().groups(true).run()?;
    let desk = &results.sensors[0];
    println!("{:.0} lx on the desk, of which:", desk.illuminance);
    for (group, part) in results.run.groups.iter().zip(&desk.groups) {
        println!("  {group}: {:.0} ± {:.1} lx", part.illuminance, part.standard_error);
    }

    let dimmed = job.dim(Goal::LeastPower, 95.0)?;
    println!("{:.1} {}, {} targets missed:", dimmed.power, dimmed.influence.power_unit(), dimmed.missed.len());
    for (luminaire, level) in &dimmed.levels.of {
        println!("  {luminaire}: {:.0} %", 100.0 * level);
    }
    println!("verified by {} renders", dimmed.renders);
    Ok(())
}
