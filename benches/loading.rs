//! How fast and in how much memory large meshes are loaded: `cargo bench --bench loading`, for a mesh it makes itself, or
//! `cargo bench --bench loading -- scene.toml`, for a scene with a mesh of its own (then the last [[mesh]] named counts).
//!
//! `tobj` alone, on the same file, is the baseline; both take turns.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::hint::black_box;
use std::io::{BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::time::Instant;

use luxmap::embree::RayCaster;
use luxmap::scene::Scene;
use sha2::{Digest, Sha256};

const ROUNDS: usize = 3;
/// Cells along a side of the ground, and boxes above it: 4.5 million triangles, 170 MB.
const CELLS: usize = 1300;
const BOXES: usize = 95_000;

fn main() {
    let given = std::env::args().skip(1).find(|argument| !argument.starts_with('-'));
    let folder = std::env::temp_dir().join(format!("luxmap-loading-{}", std::process::id()));
    let scene = match &given {
        Some(path) => PathBuf::from(path),
        None => {
            fs::create_dir_all(&folder).expect("the folder for temporary files is writable");
            write_scene(&folder)
        }
    };
    let text = fs::read_to_string(&scene).expect("a scene file");
    let mesh = text.lines().filter_map(|line| line.strip_prefix("file")?.split('"').nth(1)).next_back();
    measure(&scene, &scene.with_file_name(mesh.expect("a scene with a mesh")));
    if given.is_none() {
        fs::remove_dir_all(&folder).expect("it was made above");
    }
}

fn measure(scene: &Path, mesh: &Path) {
    let bytes = fs::metadata(mesh).expect("the mesh is there").len();
    println!("{}: {:.0} MB, {} threads", mesh.display(), bytes as f64 / 1e6, rayon::current_num_threads());
    let timed = |what: &mut dyn FnMut()| {
        let started = Instant::now();
        what();
        started.elapsed().as_secs_f64()
    };
    // Memory first: a peak never falls again.
    let before = peak_memory();
    let mut loaded = None;
    let load = timed(&mut || loaded = Some(Scene::load(scene).expect("the scene is good")));
    let after_load = peak_memory();
    let loaded = loaded.expect("just set");
    let mut caster = None;
    let build = timed(&mut || {
        caster = Some(RayCaster::build_near(&loaded.mesh, &loaded.near, rayon::current_num_threads()).expect("good"))
    });
    let caster = caster.expect("just set");
    println!("{} triangles, {} vertices", loaded.mesh.triangles.len(), loaded.mesh.vertices.len());
    println!("scene loaded  {load:8.2} s  peak {:6.0} MB (before: {before:.0} MB)", after_load);
    println!(
        "BVH ready     {:8.2} s  peak {:6.0} MB, of which Embree's own {:.0} MB",
        load + build,
        peak_memory(),
        caster.peak_memory() as f64 / 1e6
    );
    drop((loaded, caster));

    let options = tobj::LoadOptions { single_index: true, ..Default::default() };
    let mut hash = || {
        let mut hash = Sha256::new();
        std::io::copy(&mut File::open(mesh).expect("the mesh is there"), &mut HashWriter(&mut hash)).expect("readable");
        black_box(hash.finalize());
    };
    let mut ours = || drop(black_box(Scene::load(scene).expect("the scene is good")));
    let mut tobjs = || {
        let mut file = BufReader::with_capacity(1 << 20, File::open(mesh).expect("the mesh is there"));
        let no_materials = |_: &Path| Ok(Default::default());
        drop(black_box(tobj::load_obj_buf(&mut file, &options, no_materials).expect("the mesh is good")));
    };
    let mut times = [const { Vec::new() }; 3];
    for _ in 0..ROUNDS {
        times[0].push(timed(&mut hash));
        times[1].push(timed(&mut ours));
        times[2].push(timed(&mut tobjs));
    }
    let medians = times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    });
    for (what, seconds) in ["reading and SHA-256", "Scene::load", "tobj alone"].iter().zip(medians) {
        let rate = bytes as f64 / 1e6 / seconds;
        println!("{what:<20} {seconds:8.2} s {rate:8.0} MB/s {:8.2} × Scene::load", seconds / medians[1]);
    }
    println!("peak {:.0} MB with tobj", peak_memory());
}

struct HashWriter<'a>(&'a mut Sha256);

impl std::io::Write for HashWriter<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// The most memory this process has held so far, MB; NaN where the system doesn't tell.
fn peak_memory() -> f64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.parse().ok());
    peak.map_or(f64::NAN, |kilobytes: f64| kilobytes * 1024.0 / 1e6)
}

/// Uneven ground under many boxes of quadrangles, in some fifty objects of twelve materials.
fn write_scene(folder: &Path) -> PathBuf {
    let mut obj = std::io::BufWriter::new(File::create(folder.join("large.obj")).expect("writable"));
    let mut text = String::new();
    let side = CELLS + 1;
    for (row, column) in (0..side).flat_map(|row| (0..side).map(move |column| (row, column))) {
        let (x, y) = (60.0 * column as f64 / CELLS as f64, 50.0 * row as f64 / CELLS as f64);
        writeln!(text, "v {x:.6} {y:.6} {:.6}", 0.02 * (9.0 * x).sin() * (7.0 * y).cos()).expect("memory");
    }
    for row in 0..CELLS {
        if row % (CELLS / 25) == 0 {
            writeln!(text, "o ground{row}\nusemtl m{}", row % 12).expect("memory");
        }
        for column in 0..CELLS {
            let a = row * side + column + 1;
            let [b, c, d] = [a + 1, a + side + 1, a + side];
            writeln!(text, "f {a} {b} {c}\nf {a} {c} {d}").expect("memory");
        }
        obj.write_all(text.as_bytes()).expect("writable");
        text.clear();
    }
    for number in 0..BOXES {
        // A low-discrepancy sequence (Roberts 2018) scatters them.
        let place = [0.819_172_5, 0.671_043_6, 0.549_700_5].map(|step: f64| (step * number as f64).fract());
        let (x, y, z, half) = (60.0 * place[0], 50.0 * place[1], 0.2 + 2.3 * place[2], 0.02 + 0.03 * place[0]);
        if number % (BOXES / 25) == 0 {
            writeln!(text, "o boxes{number}\nusemtl m{}", number % 12).expect("memory");
        }
        for corner in 0..8 {
            let at = |bit: usize, middle: f64| if corner >> bit & 1 == 1 { middle + half } else { middle - half };
            writeln!(text, "v {:.5} {:.5} {:.5}", at(0, x), at(1, y), at(2, z)).expect("memory");
        }
        text += "f -8/1 -6/1 -5/1 -7/1\nf -4/1 -3/1 -1/1 -2/1\nf -8 -7 -3 -4\nf -6 -2 -1 -5\nf -8 -4 -2 -6\nf -7 -5 -1 -3\n";
        obj.write_all(text.as_bytes()).expect("writable");
        text.clear();
    }
    obj.flush().expect("writable");
    let mut scene = String::from(
        "[[mesh]]\nfile = \"large.obj\"\n\
         [[luminaire]]\nname = \"L\"\nposition = [1.5, 1.6, 2.69]\nopening = { rectangle = [0.6, 0.6] }\nflux = 3000\n\
         array = { count = [20, 15], pitch = [3.0, 3.3] }\n\
         [[plane]]\nname = \"work\"\ncorner = [10, 10, 0.75]\nalong = [12, 0, 0]\nacross = [0, 10, 0]\ncells = [60, 50]\n\
         on = \"air\"\n",
    );
    for material in 0..12 {
        writeln!(scene, "[material.m{material}]\nreflectance = 0.{}", 2 + material % 6).expect("memory");
    }
    let path = folder.join("large.toml");
    fs::write(&path, scene).expect("writable");
    path
}
