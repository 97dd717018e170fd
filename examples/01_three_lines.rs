//! The shortest program: a scene file in, results of 5 % standard error in a folder.
//!
//! `cargo run --release --example 01_three_lines -- [FOLDER]`

fn main() -> Result<(), luxmap::Error> {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/box.toml");
    let folder = std::env::args().nth(1).unwrap_or_else(|| "out/01-three-lines".into());
    let results = luxmap::Job::load(scene)?.error(5.0).run()?;
    let written = results.write(&folder)?;
    println!("{} passes; {} files in {folder}", results.run.passes, written.len());
    Ok(())
}
