//! What a run keeps: a run that goes on is the run that was never stopped, and parts that are merged are the whole.

use std::fs;

use crate::common::files::{Folder, assert_same, stderr};
use crate::common::{room, sensor};
use luxmap::state::file::Kept;

/// Scenes, and methods that suit them: paths find a lamp in a mirror by chance only, others than gather and path can't tell
/// light groups at round sensors, and seed knows none at all.
const CASES: [(&str, &[&str]); 3] =
    [("office", &["gather", "path"]), ("shine", &["gather", "split", "photons"]), ("cell", &["seed"])];

/// A folder with one of these scenes.
fn folder_of(test: &str, scene: &str) -> Folder {
    let folder = Folder::new("keeping", &format!("{test} {scene}"));
    match scene {
        "cell" => cell(&folder),
        _ => office(&folder, scene == "shine"),
    }
    folder
}

/// Coarse settings of all runs.
const COARSE: [&str; 4] = ["--photons=3000", "--rays=1", "--threads=1", "-q"];

/// A coloured room with a board across it: two light groups, a plane, an area of it, sensors flat and round, a measured
/// surface, a camera. One end is a mirror too, where `shine` says so: there are caustics then.
fn office(folder: &Folder, shine: bool) {
    let mut mesh = room([0.0; 3], [4.0, 3.0, 2.5], ["wall", "wall", "wall", "end", "wall", "wall"]);
    mesh.push_str("v 2 0.5 0.6\nv 2 2.5 0.6\nv 2 2.5 1.1\nv 2 0.5 1.1\nusemtl board\nf 9 10 11 12\n");
    folder.write("room.obj", &mesh);
    let toml = format!(
        "[[mesh]]\nfile = \"room.obj\"\n[material.wall]\nreflectance = [0.7, 0.5, 0.4]\n[material.board]\n\
         reflectance = 0.4\n[material.end]\nreflectance = 0.2\n{}\
         [[luminaire]]\nname = \"panel\"\nposition = [1, 1.5, 2.4]\nopening = {{ rectangle = [0.6, 0.6] }}\nflux = 3000\n\
         [[luminaire]]\nname = \"spot\"\nposition = [3, 0.5, 1.5]\nopening = \"point\"\nflux = 800\ngroup = \"spots\"\n\
         [[plane]]\nname = \"floor\"\ncorner = [0, 0, 0]\nalong = [4, 0, 0]\nacross = [0, 3, 0]\ncells = [12, 9]\n\
         [[surface]]\nname = \"board\"\nmaterial = \"board\"\nspacing = 0.5\n\
         [[camera]]\nname = \"view\"\neye = [0.3, 0.3, 1.6]\nlook_at = [4, 2, 0.8]\nfov = 60\npixels = [16, 12]\n\
         [render]\ngroups = true\n{}{}{}",
        if shine { "specular = 0.6\n" } else { "" },
        sensor("desk", [1.2, 1.5, 0.75], [0.0, 0.0, 1.0]),
        sensor("face", [3.2, 2.2, 1.2], [0.0, 0.0, 1.0]),
        if shine { "" } else { "measure = \"cylindrical\"\n" },
    );
    folder.write("scene.toml", &toml);
}

/// The smallest of rooms: a state of it is some kilobytes.
fn cell(folder: &Folder) {
    folder.write("room.obj", &room([0.0; 3], [4.0, 3.0, 2.5], ["wall"; 6]));
    folder.write(
        "scene.toml",
        "[[mesh]]\nfile = \"room.obj\"\n[material.wall]\nreflectance = 0.5\n[[luminaire]]\nname = \"L\"\n\
         position = [2, 1.5, 2]\nopening = \"point\"\nflux = 1000\n[[plane]]\nname = \"floor\"\ncorner = [0, 0, 0]\n\
         along = [4, 0, 0]\nacross = [0, 3, 0]\ncells = [2, 2]\n",
    );
}

/// Renders the folder's scene into `output`, coarsely.
fn render(folder: &Folder, output: &str, more: &[&str]) {
    folder.succeed(&[&["render", "scene.toml", "-o", output][..], &COARSE, more].concat());
}

/// The state of `count` passes from `first` on, in the file `state`.
fn keep(folder: &Folder, state: &str, method: &str, [first, count]: [u32; 2], more: &[&str]) {
    let (first, count) = (first.to_string(), count.to_string());
    let passes = ["--first-pass", &first, "--passes", &count, "--method", method, "--checkpoint", state];
    render(folder, "part", &[&passes, more].concat());
}

/// Everything random is dealt by the number of a pass, and everything that passes leave is in the file.
#[test]
fn a_run_that_goes_on_is_the_run_that_was_never_stopped() {
    for (scene, methods) in CASES {
        let folder = folder_of("resumed", scene);
        for method in methods {
            render(&folder, "whole", &["--method", method, "--passes", "3"]);
            for passes in ["1", "3", "3"] {
                render(&folder, "resumed", &["--method", method, "--passes", passes, "--checkpoint", method]);
            }
            assert_same(&format!("{method}, {scene}"), &folder.path("resumed"), &folder.path("whole"));
        }
    }
}

/// The shipped caustic, of glass and a mirror.
#[test]
fn a_caustic_goes_on() {
    let folder = Folder::new("keeping", "caustic");
    let scenes = std::path::PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("scenes");
    fs::copy(scenes.join("caustic.obj"), folder.path("caustic.obj")).expect("a scene");
    let toml = fs::read_to_string(scenes.join("caustic.toml")).expect("a scene");
    folder.write("scene.toml", &toml.replace("[150, 150]", "[12, 12]"));
    for method in ["gather", "split"] {
        render(&folder, "whole", &["--method", method, "--passes", "3"]);
        for passes in ["1", "3"] {
            render(&folder, "resumed", &["--method", method, "--passes", passes, "--checkpoint", method]);
        }
        assert_same(method, &folder.path("resumed"), &folder.path("whole"));
    }
}

/// The photons of caustics are counted and not kept, so the memory of long runs is bounded. In which run a pass was done makes
/// no difference.
#[test]
fn long_runs_keep_no_photons() {
    let folder = folder_of("long", "shine");
    let size = |state: &str| fs::metadata(folder.path(state)).expect("a state").len();
    keep(&folder, "most", "gather", [0, 60], &[]);
    keep(&folder, "rest", "gather", [60, 9], &[]);
    keep(&folder, "all", "gather", [0, 69], &[]);
    folder.succeed(&["merge", "-q", "--threads=1", "-o", "merged", "most", "rest"]);
    assert_same("merged", &folder.path("merged"), &folder.path("part"));
    // But for the words, that name the passes, all are the same sums.
    assert!(size("all").abs_diff(size("rest")) < 64, "{} and {} bytes", size("all"), size("rest"));
    // Of the photons counted none is forgotten.
    let stored = |state: &str| -> u64 {
        folder.succeed(&["merge", state, "-o", "told", "-q"]);
        let text = fs::read(folder.path("told/summary.json")).expect("a summary");
        let summary: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
        summary["photons_stored"].as_u64().expect("a number")
    };
    assert_eq!(stored("all"), stored("most") + stored("rest"));
}

/// When the error is asked for, and which cameras rest, is kept too. The first call has no time but for one pass.
#[test]
fn a_run_up_to_an_error_goes_on() {
    let folder = Folder::new("keeping", "error");
    office(&folder, false);
    render(&folder, "whole", &["--error", "6"]);
    render(&folder, "resumed", &["--error", "6", "--time", "1e-6", "--checkpoint", "state"]);
    let first = fs::read(folder.path("state")).expect("a state");
    render(&folder, "resumed", &["--error", "6", "--checkpoint", "state"]);
    assert_ne!(fs::read(folder.path("state")).expect("a state"), first, "one pass was enough");
    assert_same("--error", &folder.path("resumed"), &folder.path("whole"));
}

/// Sums that don't round until they are read add up in any order and grouping.
#[test]
fn merged_passes_are_one_run() {
    for (scene, methods) in CASES {
        let folder = folder_of("merged", scene);
        for method in methods {
            render(&folder, "whole", &["--method", method, "--passes", "4"]);
            for (state, passes) in [("a", [0, 2]), ("b", [2, 1]), ("c", [3, 1])] {
                keep(&folder, &format!("{state}-{method}"), method, passes, &[]);
            }
            let [a, b, c] = ["a", "b", "c"].map(|state| format!("{state}-{method}"));
            let merge = |states: &[&str], more: &[&str]| {
                folder.succeed(&[&["merge", "-q", "--threads=1", "-o", "merged"], states, more].concat());
            };
            merge(&[&c, &a, &b], &[]);
            assert_same(&format!("{method}, {scene}"), &folder.path("merged"), &folder.path("whole"));
            let both = format!("ac-{method}");
            merge(&[&a, &c], &["--state", &both]);
            merge(&[&b, &both], &[]);
            assert_same(&format!("{method}, {scene}, grouped"), &folder.path("merged"), &folder.path("whole"));
        }
    }
}

/// Two seeds are one experiment of twice the length. Without smoothing the mean of a cell is that of all its rays, so the
/// merged one is the mean of the two. Its variance is half of either's: Σσ² over N cells scatters, of variances from at
/// least ν = 7 degrees of freedom each, by √(2/νN) per run, and the two sides share their rays.
#[test]
fn two_seeds_are_half_the_variance() {
    let folder = Folder::new("keeping", "seeds");
    cell(&folder);
    let scene = fs::read_to_string(folder.path("scene.toml")).expect("a scene").replace("[2, 2]", "[24, 18]");
    folder.write("scene.toml", &scene);
    for seed in ["1", "2"] {
        let options = ["--method", "path", "--smooth", "off", "--passes", "2", "--layers", "stderr"];
        render(&folder, seed, &[&options, &["--seed", seed, "--checkpoint", &format!("state-{seed}")][..]].concat());
    }
    folder.succeed(&["merge", "-q", "-o", "merged", "--layers", "stderr", "state-1", "state-2"]);
    let layers = ["1", "2", "merged"].map(|output| {
        let image = luxmap::report::exr::read(&folder.path(output).join("floor.exr")).expect("an image");
        (image.illuminance, image.standard_error.expect("it was asked for"))
    });
    let [(one, errors), (other, other_errors), (merged, merged_errors)] = &layers;
    for ((a, b), found) in one.iter().zip(other).zip(merged) {
        // Each is rounded to single precision.
        assert!((found / (0.5 * (a + b)) - 1.0).abs() < 2e-7, "{found} of {a} and {b}");
    }
    let sum = |errors: &[f64]| errors.iter().map(|error| error * error).sum::<f64>();
    let expected = 0.25 * (sum(errors) + sum(other_errors));
    let bound = 4.0 * (2.0 / (7.0 * merged.len() as f64)).sqrt();
    crate::common::assert_close("variance", sum(merged_errors), expected, bound);
    assert!(one != other, "two seeds gave one map");
}

#[test]
fn states_that_don_t_add_up_are_refused() {
    let folder = Folder::new("keeping", "refused");
    cell(&folder);
    keep(&folder, "a", "gather", [0, 2], &[]);
    let merge = |states: &[&str]| folder.refused(&[&["merge", "-o", "merged"], states].concat());
    let refused = |states: &[&str], message: &str| {
        let found = merge(states);
        assert!(found.contains(message), "{found}");
    };

    refused(&["a", "a"], "a: found pass 0 of seed 0 a second time, expected passes that no other state holds");
    keep(&folder, "b", "gather", [1, 1], &[]);
    refused(&["a", "b"], "b: found pass 1 of seed 0 a second time");
    keep(&folder, "path", "path", [2, 1], &[]);
    refused(&["a", "path"], "path: found a state of method \"path\", expected \"gather\"");
    keep(&folder, "far", "gather", [2, 1], &["--radius", "0.5"]);
    refused(&["a", "far"], "far: found a state of radius 0.5, expected null");
    folder.write("text", "Not a state at all, but long enough to have the length of a checksum behind it.");
    refused(&["a", "text"], "text: found something else than a state of this version");
    refused(&["none"], "none: found no such file");

    // As a checkpoint: what is there stays as it is.
    let kept = fs::read(folder.path("a")).expect("a state");
    let go_on = |more: &[&str]| {
        let options = ["render", "scene.toml", "-o", "part", "--checkpoint", "a", "--photons", "3000", "--passes", "3"];
        folder.refused(&[&options, more].concat())
    };
    let found = go_on(&["--rays", "2"]);
    assert!(found.contains("a: found a state of rays 1, expected 2; only states of the same scene"), "{found}");
    let found = go_on(&["--rays", "1", "--seed", "3"]);
    assert!(found.contains("a: found passes 0 … 1 of seed 0, expected passes from 0 on of seed 3"), "{found}");
    let scene = fs::read_to_string(folder.path("scene.toml")).expect("a scene");
    folder.write("scene.toml", &scene.replace("flux = 1000", "flux = 1001"));
    let found = go_on(&["--rays", "1"]);
    assert!(found.contains("a: found a state of scene_sha256 \""), "{found}");
    refused(&["a"], "a: found a state of scene_sha256 \"");
    assert_eq!(fs::read(folder.path("a")).expect("it stays"), kept);

    // The scene is elsewhere now.
    folder.write("scene.toml", &scene);
    folder.succeed(&["merge", "-q", "a", "-o", "merged"]);
    fs::create_dir_all(folder.path("moved")).expect("a folder");
    for name in ["scene.toml", "room.obj"] {
        fs::rename(folder.path(name), folder.path("moved").join(name)).expect("it moves");
    }
    refused(&["a"], "scene.toml, expected that scene file; --scene says where it is now");
    folder.succeed(&["merge", "-q", "a", "-o", "moved/merged", "--scene", "moved/scene.toml"]);
    assert_same("moved", &folder.path("moved/merged"), &folder.path("merged"));
}

/// The checksum covers all bytes, its own included: none can change, none can be missing or too many.
#[test]
fn a_torn_state_is_refused() {
    let folder = Folder::new("keeping", "torn");
    cell(&folder);
    keep(&folder, "whole", "gather", [0, 1], &[]);
    let whole = fs::read(folder.path("whole")).expect("a state");
    Kept::open(&folder.path("whole")).expect("it is whole");
    let torn = folder.path("torn");
    let refused = |bytes: &[u8], what: &str| {
        fs::write(&torn, bytes).expect("the target folder is writable");
        let error = Kept::open(&torn).err().unwrap_or_else(|| panic!("{what}: taken for whole"));
        assert!(error.to_string().contains("torn: found ") && !error.to_string().contains('\n'), "{error}");
    };
    for at in 0..whole.len() {
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (at % 8);
        refused(&bytes, &format!("byte {at} of {}", whole.len()));
        refused(&whole[..at], &format!("cut off at {at} of {}", whole.len()));
    }
    refused(&[whole.as_slice(), &[0]].concat(), "a byte more");
    // The command says it in a line, as a checkpoint and as a part.
    fs::write(&torn, &whole[..whole.len() / 2]).expect("the target folder is writable");
    let as_checkpoint = ["render", "scene.toml", "-o", "part", "--passes", "2", "--checkpoint", "torn"];
    for arguments in [&["merge", "torn"][..], &as_checkpoint] {
        let message = folder.refused(arguments);
        assert!(message.contains("torn: found a checksum that does not fit the content"), "{message}");
    }
}

#[test]
fn a_checkpoint_that_can_t_be_written_ends_nothing() {
    let folder = Folder::new("keeping", "unwritable");
    cell(&folder);
    let passes = ["render", "scene.toml", "-q", "--photons", "3000", "--rays", "1", "--passes", "2", "-o"];
    folder.succeed(&[&passes[..], &["whole"]].concat());
    let output = folder.luxmap(&[&passes[..], &["part", "--checkpoint", "nowhere/state"]].concat());
    let warning = stderr(&output);
    assert_eq!(output.status.code(), Some(0), "{warning}");
    assert!(warning.starts_with("warning: checkpoint: nowhere/state: can't be written: "), "{warning}");
    assert_eq!(warning.lines().count(), 1, "{warning}");
    let values = |folder: &Folder, output: &str| fs::read(folder.path(output).join("floor.csv")).expect("results");
    assert_eq!(values(&folder, "part"), values(&folder, "whole"));
}
