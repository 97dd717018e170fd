//! Where programs find Embree: it is loaded when rays need it, not linked.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use crate::common::{folder, room};

/// Renders a small scene with the given program.
fn render(program: &Path, test: &str, settings: &[(&str, &str)]) -> Output {
    let folder = folder(test);
    fs::write(folder.join("room.obj"), room([0.0; 3], [4.0, 3.0, 2.5], ["wall"; 6])).expect("writable");
    let scene = "[[mesh]]\nfile = \"room.obj\"\n[material.wall]\nreflectance = 0.5\n\
                 [[luminaire]]\nname = \"L\"\nposition = [2, 1.5, 2.4]\n\
                 opening = { rectangle = [0.6, 0.6] }\nflux = 3000\n\
                 [[plane]]\nname = \"floor\"\ncorner = [0, 0, 0]\n\
                 along = [4, 0, 0]\nacross = [0, 3, 0]\ncells = [4, 3]\n";
    fs::write(folder.join("scene.toml"), scene).expect("writable");
    let mut command = Command::new(program);
    command.current_dir(folder).args(["render", "scene.toml", "-o", "out", "--photons", "3000", "--passes", "1"]);
    command.envs(settings.iter().copied()).output().expect("luxmap starts")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Else what depends on luxmap would have to be linked and started in some way of its own.
#[test]
fn a_program_is_linked_as_any_other() {
    let program = env!("CARGO_BIN_EXE_luxmap");
    let Ok(answer) = Command::new("readelf").args(["--dynamic", "--program-headers", "--wide", program]).output()
    else {
        return eprintln!("left out: there is no readelf");
    };
    let answer = String::from_utf8_lossy(&answer.stdout);
    let of = |what: &str| answer.lines().filter(|line| line.contains(what)).collect::<Vec<_>>();
    assert!(!of("(NEEDED)").is_empty(), "{answer}");
    for line in of("(NEEDED)") {
        assert!(!line.contains("embree") && !line.contains("tbb"), "{line}");
    }
    for line in of("program interpreter") {
        assert!(line.contains(": /lib"), "{line}");
    }
    assert_eq!((of("(RPATH)"), of("(RUNPATH)")), (vec![], vec![]));
}

#[test]
fn a_folder_without_embree_is_told_in_one_line() {
    let output = render(Path::new(env!("CARGO_BIN_EXE_luxmap")), "embree/missing", &[("EMBREE_DIR", "nowhere")]);
    assert_eq!(output.status.code(), Some(2));
    let expected = format!("EMBREE_DIR is nowhere, but nowhere holds no lib/{}", library_name());
    let said = stderr(&output);
    assert!(said.lines().count() == 1 && said.ends_with(&format!("Embree: {expected}\n")), "{said}");
}

fn library_name() -> &'static str {
    if cfg!(target_os = "macos") { "libembree4.4.dylib" } else { "libembree4.so.4" }
}

/// A program moved elsewhere takes the Embree in `../lib/luxmap` beside it, before that of the build.
#[test]
fn a_program_takes_the_embree_beside_it() {
    let library = luxmap::embree::library().unwrap_or_else(|error| panic!("{error}"));
    if !cfg!(all(target_os = "linux", target_env = "gnu")) || library.parent() == Some(Path::new("")) {
        return eprintln!("left out: only glibc tells what it loads, and the system's own Embree has no known place");
    }
    let place = folder("embree/beside");
    let [program, beside] = [place.join("bin/luxmap"), place.join("lib/luxmap")];
    let _ = fs::remove_dir_all(&place); // of an earlier run
    fs::create_dir_all(place.join("bin")).expect("writable");
    fs::create_dir_all(&beside).expect("writable");
    let put = |from: &Path, to: &Path| {
        fs::hard_link(from, to)
            .or_else(|_| fs::copy(from, to).map(drop))
            .unwrap_or_else(|why| panic!("{from:?}: {why}"));
    };
    put(Path::new(env!("CARGO_BIN_EXE_luxmap")), &program);
    for file in [library.to_path_buf(), library.with_file_name("libtbb.so.12")].iter().filter(|file| file.exists()) {
        put(&fs::canonicalize(file).expect("it exists"), &beside.join(file.file_name().expect("a file")));
    }
    let output = render(&program, "embree/moved", &[("LD_DEBUG", "files"), ("EMBREE_DIR", "")]);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(0), "{said}");
    let loaded = |name: &str| said.lines().any(|line| line.contains("lib/luxmap") && line.contains(name));
    assert!(loaded("libembree4.so"), "{}", said.lines().filter(|line| line.contains("embree")).collect::<String>());
}
