//! OBJ and MTL files as other programs write them: the room they mean, whatever the spelling, and a word on all that is guessed.

use std::fs;
use std::path::PathBuf;

use crate::common::files::{Folder, stderr, stdout};
use luxmap::luminaire::Opening;
use luxmap::render::plan::{Method, Plan};
use luxmap::scene::{Dimming, LoadOptions, Material, Scene};

/// A room of 4 m × 4 m × 3 m whose materials have names that can be replaced.
const VERTICES: &str = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 0 0 3\nv 4 0 3\nv 4 4 3\nv 0 4 3\n";
const FACES: &str =
    "usemtl floor\nf 1 2 3 4\nusemtl ceil\nf 5 8 7 6\nusemtl wall\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";
const MTL: &str = "newmtl floor\nKd 0.2 0.2 0.2\nnewmtl ceil\nKd 0.7 0.7 0.7\nnewmtl wall\nKd 0.5 0.5 0.5\n";
const SCENE: &str = "[[mesh]]\nfile = \"r.obj\"\n[[luminaire]]\nname = \"L\"\nposition = [2.0, 2.0, 2.5]\n\
                     opening = { rectangle = [0.4, 0.4] }\nflux = 3000\n\
                     [[sensor]]\nname = \"S\"\nposition = [2, 2, 1]\nnormal = [0, 0, 1]\n";

/// Files in a folder of their own, which goes away with them.
struct Files(PathBuf);

impl Files {
    fn new(files: &[(&str, &[u8])]) -> Self {
        static NUMBER: std::sync::atomic::AtomicUsize = std::sync::atomic::AtomicUsize::new(0);
        let number = NUMBER.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("luxmap-obj-foreign-{}-{number}", std::process::id()));
        for (name, bytes) in files {
            let path = folder.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, bytes).unwrap();
        }
        Self(folder)
    }

    fn load(&self, options: &LoadOptions) -> Result<Scene, String> {
        let without_folder = |text: String| {
            let real = fs::canonicalize(&self.0).unwrap();
            [&real, &self.0].iter().fold(text, |text, folder| text.replace(&format!("{}/", folder.display()), ""))
        };
        match Scene::load_as(&self.0.join("s.toml"), options) {
            Ok(mut scene) => {
                scene.warnings = scene.warnings.into_iter().map(without_folder).collect();
                scene.warnings.iter().for_each(|line| assert!(!line.contains(char::is_control), "{line:?}"));
                Ok(scene)
            }
            Err(error) => Err(without_folder(error.to_string())),
        }
    }
}

impl Drop for Files {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn try_load(toml: &str, obj: &[u8], mtl: &[u8]) -> Result<Scene, String> {
    Files::new(&[("s.toml", toml.as_bytes()), ("r.obj", obj), ("r.mtl", mtl)]).load(&LoadOptions::default())
}

fn load(obj: &[u8], mtl: &[u8]) -> Scene {
    try_load(SCENE, obj, mtl).unwrap_or_else(|error| panic!("{error}\n{}", String::from_utf8_lossy(obj)))
}

/// The room as anybody would write it.
fn plain() -> Scene {
    let scene = load(format!("mtllib r.mtl\n{VERTICES}{FACES}").as_bytes(), MTL.as_bytes());
    assert_eq!(scene.warnings, [""; 0]);
    scene
}

/// Same room to the bit, materials by their order and not by their names.
fn assert_plain(what: &str, scene: &Scene) {
    let plain = plain();
    assert_eq!(scene.mesh.vertices, plain.mesh.vertices, "{what}");
    assert_eq!(scene.mesh.triangles, plain.mesh.triangles, "{what}");
    assert_eq!(scene.mesh.material_of, plain.mesh.material_of, "{what}");
    let nameless = |scene: &Scene| -> Vec<Material> {
        scene.materials.iter().map(|material| Material { name: String::new(), ..material.clone() }).collect()
    };
    assert_eq!(nameless(scene), nameless(&plain), "{what}");
}

/// A text with a name of bytes in place of the material `wall`.
fn renamed(text: &str, name: &[u8]) -> Vec<u8> {
    text.split("wall").map(str::as_bytes).collect::<Vec<_>>().join(name)
}

#[test]
fn a_final_backslash_swallows_no_line() {
    let with = |line: &str| FACES.replace("usemtl wall\n", &format!("{line}\nusemtl wall\n"));
    for obj in [
        with("g C:\\models\\"),
        with("o \\"),
        with("# C:\\"),
        with("s off\\"),
        with("map_Kd C:\\tex\\"),
        FACES.replace("f 2 6 7 3\n", "f 2 6 7 3\\\n"),
        FACES.replace("f 4 8 5 1\n", "f 4 8 5 1 \\"),
        FACES.replace("f 2 6 7 3", "f 2 6\\\n 7\\\n3"),
        FACES.replace("f 2 6 7 3", "f \\\r\n2/1 6/1\\\r\n\t7/2 3/2"),
    ] {
        let scene = load(format!("mtllib r.mtl\n{VERTICES}{obj}").as_bytes(), MTL.as_bytes());
        assert_plain(&obj, &scene);
        assert_eq!(scene.warnings, [""; 0]);
    }
    let mtl = MTL.replace("Kd 0.5 0.5 0.5", "map_Ka C:\\tex\\\nKd 0.5 \\\n0.5 0.5");
    assert_plain(&mtl, &load(format!("mtllib r.mtl\n{VERTICES}{FACES}").as_bytes(), mtl.as_bytes()));
    let spelt = [VERTICES.replace("v 4 4 3", "v 4\\\n4 \\\n 3"), format!("{VERTICES}vn 0 0 \\\n1\n")];
    for vertices in spelt {
        assert_plain(&vertices, &load(format!("mtllib r.mtl\n{vertices}{FACES}").as_bytes(), MTL.as_bytes()));
    }
}

/// Names match by their bytes, in any encoding and in none, be their last one a backslash or not.
#[test]
fn names_match_whatever_their_encoding() {
    let names: [&[u8]; 6] = [
        b"x\\",
        b"\x8aw\x82\xcc\x95\x5c",     // Shift-JIS, ending in a backslash's byte
        b"W\xe4nde",                  // Latin-1
        "W\u{e4}nde #2".as_bytes(),   // UTF-8
        b"\xff\xfe\x00\xc3\x28 \x81", // nothing at all
        b"\xc7\xbd",                  // GBK
    ];
    for name in names {
        let obj = [b"mtllib r.mtl\n", VERTICES.as_bytes(), &renamed(FACES, name)].concat();
        let groups = [&obj, &b"g "[..], name, b"\nf 1 2 7\n"].concat();
        let scene = load(&obj, &renamed(MTL, name));
        assert_plain("names", &scene);
        assert_eq!(scene.warnings, [""; 0]);
        assert_eq!(load(&groups, &renamed(MTL, name)).mesh.triangles.len(), scene.mesh.triangles.len() + 1);
    }
    // The scene file says them as they read, and an MTL file in another encoding too.
    for (name, read) in [(&b"\x8aw\x82\xcc\x95\x5c"[..], "\u{5b66}\u{306e}\u{8868}"), (b"W\xe4nde", "W\u{e4}nde")] {
        let obj = [b"mtllib r.mtl\n", VERTICES.as_bytes(), &renamed(FACES, name)].concat();
        assert_plain(read, &load(&obj, &renamed(MTL, read.as_bytes())));
        let toml = format!("{SCENE}[material.\"{read}\"]\nreflectance = 0.5\n");
        assert_plain(read, &try_load(&toml, &obj, &renamed(MTL, b"other")).unwrap());
    }
}

#[test]
fn faces_may_stand_above_their_vertices() {
    for obj in [
        format!("mtllib r.mtl\n{FACES}{VERTICES}"),
        format!("{}mtllib r.mtl\n{FACES}{}", &VERTICES[..24], &VERTICES[24..]),
        format!("{FACES}{VERTICES}mtllib r.mtl\n"),
    ] {
        let scene = load(obj.as_bytes(), MTL.as_bytes());
        assert_plain(&obj, &scene);
        assert_eq!(scene.warnings, [""; 0]);
    }
    // Negative numbers count from the line they stand in, and nothing stands above the first.
    let relative = FACES.replace("f 1 2 3 4", "f -8 -7 -6 -5");
    assert_plain("relative", &load(format!("mtllib r.mtl\n{VERTICES}{relative}").as_bytes(), MTL.as_bytes()));
    let above = format!("f -1 -2 -3\n{VERTICES}");
    assert_eq!(
        try_load(SCENE, above.as_bytes(), b"").unwrap_err(),
        "r.obj:1: found vertex -1 in a face, expected 1 … 8, as no vertex stands above"
    );
}

#[test]
fn faces_without_an_area_are_counted_and_left_out() {
    let obj = format!("mtllib r.mtl\n{VERTICES}f 1 2\nf 3\n{FACES}f 1 1 2 1\nl 1 2\n");
    let scene = load(obj.as_bytes(), MTL.as_bytes());
    assert_plain("few corners", &scene);
    let told = "r.obj:10: 3 faces with fewer than three different corners left out, the first of them here";
    assert_eq!(scene.warnings, [told]);
}

#[test]
fn lines_of_old_macs_are_lines() {
    let obj = format!("mtllib r.mtl\n{VERTICES}{FACES}").replace('\n', "\r");
    assert_plain("carriage returns", &load(obj.as_bytes(), MTL.replace('\n', "\r").as_bytes()));
}

#[test]
fn usemtl_without_a_name_is_the_default_material() {
    let obj = format!("mtllib r.mtl\n{VERTICES}usemtl \nusemtl\t\n{FACES}usemtl\n");
    let scene = load(obj.as_bytes(), MTL.as_bytes());
    assert_plain("no face has it", &scene);
    assert_eq!(scene.warnings, [""; 0]);
    for nameless in ["usemtl", "usemtl \t", "usemtl # nothing"] {
        let obj = format!("mtllib r.mtl\n{VERTICES}{}", FACES.replace("usemtl wall", nameless));
        let scene = load(obj.as_bytes(), MTL.replace("wall", "default").as_bytes());
        assert_plain(nameless, &scene);
        assert_eq!(scene.warnings, ["r.obj:14: usemtl without a name: the faces below are of material \"default\""]);
    }
}

#[test]
fn comments_and_capitals_of_names() {
    let load = |in_obj: &str, in_mtl: &str| {
        let obj = format!("mtllib r.mtl\n{VERTICES}{}", FACES.replace("wall", in_obj));
        load(obj.as_bytes(), MTL.replace("wall", in_mtl).as_bytes())
    };
    for (in_obj, in_mtl, told) in [
        ("wall # painted", "wall # painted", None),
        ("Material #26", "Material #26", None),
        ("wall\t# painted", "wall", Some("r.obj: comments taken off the names of materials: \"wall\\t# painted\"")),
        ("wall", "wall # painted", Some("r.obj: materials that its MTL files spell otherwise: \"wall # painted\"")),
        ("Wall", "wALL", Some("r.obj: materials that its MTL files spell otherwise: \"wALL\"")),
        ("  wall \t", "wall", None),
    ] {
        let scene = load(in_obj, in_mtl);
        assert_plain(in_obj, &scene);
        assert_eq!(scene.warnings, told.into_iter().collect::<Vec<_>>());
    }
    // Two that differ in their numbers are two, and of two that differ in capitals neither is meant.
    let room = |name: &str| format!("mtllib r.mtl\n{VERTICES}{}", FACES.replace("wall", name));
    for (in_obj, mtl) in
        [("Material #26", MTL.replace("wall", "Material #25")), ("Wall", format!("{MTL}newmtl WALL\nKd 0.1\n"))]
    {
        let error = try_load(SCENE, room(in_obj).as_bytes(), mtl.as_bytes()).unwrap_err();
        assert!(error.starts_with(&format!("r.obj:14: found no reflectance for material \"{in_obj}\"")), "{error}");
    }
    // The scene file speaks of the name that the OBJ or the MTL file gives.
    for name in ["Wall", "wall"] {
        let toml = format!("{SCENE}[material.{name}]\nreflectance = 0.25\n");
        let scene = try_load(&toml, room("Wall").as_bytes(), MTL.as_bytes()).unwrap();
        assert_eq!(scene.materials[2].reflectance, [0.25; 3], "{name}");
    }
}

/// Where a `mtllib` line leads, and what is said about it.
#[test]
fn mtl_files_are_found_where_programs_mean_them() {
    let beside = |found: &str, why: &str| {
        format!("r.obj:1: MTL file \"{found}\": {why}; \"r.mtl\" beside the OBJ file taken instead")
    };
    const GONE: &str = "there is no such file";
    const OUTSIDE: &str = "it lies outside the scene's folder";
    for (line, file, told) in [
        ("R.MTL", "r.mtl", vec![beside("R.MTL", GONE)]),
        ("C:\\Users\\me\\r.mtl", "r.mtl", vec![beside("C:\\Users\\me\\r.mtl", GONE)]),
        ("/home/me/R.mtl", "r.mtl", vec![beside("/home/me/R.mtl", OUTSIDE)]),
        ("../r.mtl", "r.mtl", vec![beside("../r.mtl", OUTSIDE)]),
        ("no/r.mtl", "r.mtl", vec![beside("no/r.mtl", GONE)]),
        ("mats\\r.mtl", "mats/r.mtl", vec![]),
        (
            "mats/R.MTL",
            "mats/r.mtl",
            vec!["r.obj:1: MTL file \"mats/R.MTL\": there is no such file; \"r.mtl\" taken instead".to_owned()],
        ),
        ("my room.mtl", "my room.mtl", vec![]),
        ("\"my room.mtl\"", "my room.mtl", vec![]),
        ("my\\ room.mtl", "my room.mtl", vec![]),
        ("r.mtl # materials", "r.mtl", vec![]),
        ("r.mtl \t", "r.mtl", vec![]),
        (
            "a.mtl r.mtl",
            "r.mtl",
            vec![
                "r.obj:1: MTL file \"a.mtl\" left out (there is no such file: looked for a.mtl, in capitals or not)"
                    .to_owned(),
            ],
        ),
    ] {
        // Written with two backslashes, as files of another system hold them, is what Windows finds itself.
        if cfg!(windows) && line.contains(['\\', '/']) {
            continue;
        }
        let obj = format!("mtllib {line}\n{VERTICES}{FACES}");
        let files = Files::new(&[("s.toml", SCENE.as_bytes()), ("r.obj", obj.as_bytes()), (file, MTL.as_bytes())]);
        let scene = files.load(&LoadOptions::default()).unwrap_or_else(|error| panic!("{line}: {error}"));
        assert_plain(line, &scene);
        if cfg!(target_os = "linux") {
            assert_eq!(scene.warnings, told, "{line}");
        }
    }
    // Two files in one line, blanks in both.
    let (one, two) = MTL.split_at(MTL.find("newmtl wall").unwrap());
    let obj = format!("mtllib room one.mtl room two.mtl\n{VERTICES}{FACES}");
    let files: [(&str, &[u8]); 4] = [
        ("s.toml", SCENE.as_bytes()),
        ("r.obj", obj.as_bytes()),
        ("room one.mtl", one.as_bytes()),
        ("room two.mtl", two.as_bytes()),
    ];
    assert_plain("two files", &Files::new(&files).load(&LoadOptions::default()).unwrap());
}

/// An MTL file that isn't found is told with where it was looked for; one that lies outside with what would allow it.
#[test]
fn mtl_files_that_are_not_found() {
    let toml = SCENE.replace("r.obj", "parts/r.obj");
    let obj = |line: &str| format!("mtllib {line}\n{VERTICES}{FACES}");
    let look = |line: &str, own: bool, options: &LoadOptions| {
        let obj = obj(line);
        let scene = if own { "own/s.toml" } else { "s.toml" };
        let files: [(&str, &[u8]); 4] = [
            (scene, toml.as_bytes()),
            (if own { "own/parts/r.obj" } else { "parts/r.obj" }, obj.as_bytes()),
            ("else/m.mtl", MTL.as_bytes()),
            ("own/parts/unused", b""),
        ];
        let files = Files::new(&files);
        if !own {
            return files.load(options).map(|_| ());
        }
        let message = Scene::load_as(&files.0.join("own/s.toml"), options).map(|_| ());
        let real = fs::canonicalize(&files.0).unwrap();
        message.map_err(|error| error.to_string().replace(&real.display().to_string(), "TOP"))
    };
    let error = look("none.mtl", false, &LoadOptions::default()).unwrap_err();
    assert!(error.ends_with("speaks for all that are left; the MTL file \"none.mtl\" is missing"), "{error}");
    let error = look("../../else/m.mtl", true, &LoadOptions::default()).unwrap_err();
    let allowed = "the MTL file \"../../else/m.mtl\" lies outside the scene's folder: --include TOP/else allows it";
    assert!(error.ends_with(allowed), "{error}");
}

/// The MTL file of the OBJ's own name is taken where the OBJ names none and leaves materials open, as the two are written
/// together; where it names another, that is a hint.
#[test]
fn the_mtl_file_of_the_obj_s_own_name() {
    let obj = format!("{VERTICES}{FACES}");
    let scene = load(obj.as_bytes(), MTL.as_bytes());
    assert_plain("no mtllib", &scene);
    assert_eq!(scene.warnings, ["r.obj: no mtllib line; \"r.mtl\" beside it taken"]);
    let said =
        "[material.floor]\nreflectance = 0.2\n[material.ceil]\nreflectance = 0.7\n[material.wall]\nreflectance = 0.5\n";
    let scene = try_load(&format!("{SCENE}{said}"), obj.as_bytes(), b"newmtl wall\nKd 9\n").unwrap();
    assert_plain("all is said", &scene);
    assert_eq!(scene.warnings, [""; 0]);
    let error = try_load(SCENE, format!("mtllib q.mtl\n{obj}").as_bytes(), MTL.as_bytes()).unwrap_err();
    let hint = "the MTL file \"q.mtl\" is missing; is it \"r.mtl\", which lies beside the OBJ file?";
    assert!(error.ends_with(hint), "{error}");
}

/// Nasty `mtllib` lines end in one line each, and read nothing from elsewhere.
#[test]
fn nasty_libraries() {
    let long = "a".repeat(5000);
    for line in [
        "",
        "\"",
        "..",
        ".",
        "/",
        "\\",
        "\\ ",
        "# only",
        "a\u{7}b.mtl",
        &long,
        "/etc/passwd",
        "../r.mtl",
        "*.mtl",
        "//",
    ] {
        let obj = format!("mtllib {line}\n{VERTICES}{FACES}");
        let toml = format!("{SCENE}[material.\"*\"]\nreflectance = 0.5\n");
        let files = Files::new(&[("s.toml", toml.as_bytes()), ("r.obj", obj.as_bytes())]);
        let scene = files.load(&LoadOptions::default()).unwrap_or_else(|error| panic!("{line}: {error}"));
        assert!(scene.materials[..3].iter().all(|material| material.reflectance == [0.5; 3]), "{line}");
        assert!(scene.warnings.iter().all(|warning| warning.len() < 1000), "{:?}", scene.warnings);
    }
}

#[test]
fn illum_may_have_a_point() {
    let mirror = |illum: &str| {
        let mtl = MTL.replace("newmtl floor\n", &format!("newmtl floor\nKs 0.3 0.3 0.3\nillum {illum}\n"));
        load(format!("mtllib r.mtl\n{VERTICES}{FACES}").as_bytes(), mtl.as_bytes()).materials[0].specular[0]
    };
    assert_eq!((mirror("2.0"), mirror("3.000"), mirror("3.")), (mirror("2"), mirror("3"), mirror("3")));
    assert_eq!(mirror("3"), 0.3);
}

#[test]
fn files_of_other_formats_are_named() {
    let utf_16: Vec<u8> = format!("\u{feff}{VERTICES}").encode_utf16().flat_map(u16::to_le_bytes).collect();
    let zip = b"PK\x03\x04\x14\0\0\0".as_slice();
    for (bytes, said) in [
        (&utf_16[..], "r.obj: found text in UTF-16, expected an OBJ file; save it as UTF-8"),
        (b"\x1f\x8b\x08\0", "r.obj: found a file compressed by gzip, expected an OBJ file; unpack it first"),
        (
            zip,
            "r.obj: found a ZIP archive (.zip, .skp, .3mf, .usdz), expected an OBJ file; unpack it and name the OBJ file in it, \
             or export one",
        ),
        (
            b"BLENDER-v405",
            "r.obj: found a Blender file (.blend), expected an OBJ file; export it as OBJ from the program that made it",
        ),
    ] {
        assert_eq!(try_load(SCENE, bytes, b"").unwrap_err(), said);
    }
    let obj = format!("mtllib r.mtl\n{VERTICES}{FACES}");
    assert_eq!(
        try_load(SCENE, obj.as_bytes(), &utf_16).unwrap_err(),
        "r.mtl: found text in UTF-16, expected an MTL file; save it as UTF-8"
    );
}

fn reflecting(reflectance: [f64; 3]) -> LoadOptions {
    LoadOptions { reflectance: Some(reflectance), ..LoadOptions::default() }
}

/// Section, then MTL file, then the command line, then `[material."*"]`: the first that says something counts.
#[test]
fn materials_that_nothing_is_said_of() {
    let obj = format!("mtllib r.mtl\n{VERTICES}{FACES}usemtl desk\nf 1 2 3\nusemtl glow\nf 1 2 4\n");
    let mtl = "newmtl floor\nKd 0.2 0.2 0.2\nnewmtl glow\nKe 500 500 500\n";
    let own = "[material.wall]\nreflectance = 0.6\n[material.desk]\nsides = \"one\"\n";
    let star = "[material.\"*\"]\nreflectance = [0.3, 0.4, 0.5]\nspecular = 0.1\n";
    let load = |sections: &str, options: &LoadOptions| {
        let toml = format!("{SCENE}{sections}");
        Files::new(&[("s.toml", toml.as_bytes()), ("r.obj", obj.as_bytes()), ("r.mtl", mtl.as_bytes())]).load(options)
    };
    let of = |scene: &Scene, name: &str| {
        let material = scene.materials.iter().find(|material| material.name == name).unwrap();
        (material.reflectance, material.specular[0], material.sides)
    };
    use luxmap::scene::Sides::{One, Two};

    let by_file = load(&format!("{own}{star}"), &LoadOptions::default()).unwrap();
    let rgb = [0.3, 0.4, 0.5];
    assert_eq!((of(&by_file, "floor"), of(&by_file, "wall")), (([0.2; 3], 0.0, Two), ([0.6; 3], 0.0, Two)));
    assert_eq!((of(&by_file, "ceil"), of(&by_file, "desk")), ((rgb, 0.1, Two), (rgb, 0.1, One)));
    assert_eq!((of(&by_file, "glow"), by_file.luminaires.len()), ((rgb, 0.1, Two), 2));
    let told = "materials \"ceil\", \"desk\", \"glow\": reflectance 0.3, 0.4, 0.5 from [material.\"*\"]";
    assert!(by_file.warnings.iter().any(|warning| warning == told), "{:?}", by_file.warnings);

    let by_option = load(&format!("{own}{star}"), &reflecting([0.5; 3])).unwrap();
    assert_eq!((of(&by_option, "floor"), of(&by_option, "wall")), (of(&by_file, "floor"), of(&by_file, "wall")));
    assert_eq!((of(&by_option, "ceil"), of(&by_option, "desk")), (([0.5; 3], 0.0, Two), ([0.5; 3], 0.0, One)));
    let told = "materials \"ceil\", \"desk\", \"glow\": reflectance 0.5 from --reflectance";
    assert!(by_option.warnings.iter().any(|warning| warning == told), "{:?}", by_option.warnings);

    // What is guessed is part of what a state is of.
    let other = load(&format!("{own}{star}"), &reflecting([0.4; 3])).unwrap();
    assert!(by_file.hash != by_option.hash && by_option.hash != other.hash);
    assert_eq!(by_option.hash, load(&format!("{own}{star}"), &reflecting([0.5; 3])).unwrap().hash);
    // A section for all that are left is no material of the mesh, nor is it needed.
    assert_eq!(
        of(&load("[material.\"*\"]\nreflectance = 0.5\n", &LoadOptions::default()).unwrap(), "wall").0,
        [0.5; 3]
    );
    assert!(load(own, &reflecting([1.1; 3])).is_err() && load(own, &reflecting([f64::NAN; 3])).is_err());
    assert!(
        load(own, &LoadOptions::default())
            .unwrap_err()
            .contains("no reflectance for materials \"ceil\", \"desk\", \"glow\"")
    );
}

/// By the command line, with every command that loads a scene; a run goes on and is merged with the same value only.
#[test]
fn reflectance_on_the_command_line() {
    let folder = Folder::new("obj_foreign", "reflectance");
    folder.write("r.obj", &format!("{VERTICES}{FACES}"));
    folder.write("s.toml", SCENE);
    folder.write(
        "batch.toml",
        "[[run]]\nscene = \"s.toml\"\nreflectance = [0.5, \"0.5,0.4,0.3\"]\nphotons = 1000\npasses = 1\n",
    );
    assert!(folder.refused(&["plan", "s.toml"]).contains("or --reflectance 0.5 speaks for all that are left"));
    for wrong in ["1.5", "-0.1", "0.5,0.5", "grey", "nan"] {
        let said = folder.refused(&["plan", "s.toml", "--reflectance", wrong]);
        assert!(said.contains("expected a number from 0 to 1, or three as r,g,b"), "{said}");
    }
    let plan = folder.luxmap(&["plan", "s.toml", "--reflectance", "0.5"]);
    assert_eq!(plan.status.code(), Some(0));
    let told = "warning: materials \"ceil\", \"floor\", \"wall\": reflectance 0.5 from --reflectance\n";
    assert_eq!(stderr(&plan), told);

    let run = |more: &[&str]| {
        let coarse = ["s.toml", "--photons=1000", "--threads=1", "-q"];
        folder.luxmap(&[&["render"], &coarse[..], more].concat())
    };
    let kept = ["--checkpoint", "state", "--reflectance=0.5"];
    assert_eq!(run(&[&kept[..], &["--passes=1"]].concat()).status.code(), Some(0));
    assert_eq!(run(&[&kept[..], &["--passes=2"]].concat()).status.code(), Some(0));
    let other = run(&["--checkpoint", "state", "--reflectance=0.4", "--passes=3"]);
    assert_eq!(other.status.code(), Some(2));
    assert!(stderr(&other).contains("only states of the same scene and settings add up"), "{}", stderr(&other));
    let merge = |value: &str| folder.luxmap(&["merge", "state", "-q", "--reflectance", value]).status.code();
    assert_eq!((merge("0.5"), merge("0.4")), (Some(0), Some(2)));
    let batch = folder.luxmap(&["batch", "batch.toml", "-q"]);
    assert_eq!(batch.status.code(), Some(0), "{}{}", stdout(&batch), stderr(&batch));
}

/// A lamp of 1 m² below the ceiling of the plain room, at this height and with these corners.
fn with_lamp(height: f64, corners: &str, ke: &str, more: &str) -> Scene {
    let lamp = format!("v 1 1 {height}\nv 2 1 {height}\nv 2 2 {height}\nv 1 2 {height}\nusemtl lamp\nf {corners}\n");
    let obj = format!("mtllib r.mtl\n{VERTICES}{FACES}{lamp}{more}");
    let mtl = format!("{MTL}newmtl lamp\nKd 0\nKe {ke}\nnewmtl pane\nNi 1.5\nillum 7\nd 0.1\n");
    load(obj.as_bytes(), mtl.as_bytes())
}

const DOWN: &str = "9 12 11 10";
const UP: &str = "9 10 11 12";

#[test]
fn emitters_are_told_in_the_plan() {
    let scene = with_lamp(2.5, DOWN, "1000 1000 1000", "");
    assert_eq!(scene.warnings, [""; 0]);
    // π · 1000 cd/m² · 1 m²
    let plan = Plan::new(&scene, Method::Gather).to_string();
    assert!(plan.contains("lamp: Ke taken as 1000 cd/m² on 1 m²: 3142 lm"), "{plan}");
}

/// Exporters write Ke 1 or a strength, without a unit: a lamp of less light than a wall has is told.
#[test]
fn emitters_dimmer_than_any_lamp_are_told() {
    let told = |ke: &str| with_lamp(2.5, DOWN, ke, "").warnings;
    assert_eq!(
        told("1 1 1"),
        [
            "material \"lamp\" shines less than any lamp, 1 cd/m² on 1 m²: 3.142 lm: programs write Ke without a unit; here it is \
          cd/m², a lit panel has some 3000"
        ]
    );
    assert_eq!(told("9.9").len(), 1);
    assert_eq!(told("10.1"), [""; 0]);
    // 0.3 and 2.8 of 3000 lm on 0.01 m²: of a screen's luminance it may be a sign, of less it lights nothing.
    let small = |ke: f64| {
        let obj = format!("mtllib r.mtl\n{VERTICES}{FACES}v 1 1 2\nv 1.1 1 2\nv 1.1 1.1 2\nusemtl lamp\nf 9 10 11\n");
        load(obj.as_bytes(), format!("{MTL}newmtl lamp\nKd 0\nKe {ke}\n").as_bytes()).warnings.len()
    };
    assert_eq!((small(60.0), small(110.0)), (1, 0));
    // Dimming is no fault of the file.
    let levels = [("lamp".to_owned(), 0.001)].into_iter();
    let dimming = Dimming::Levels(luxmap::scene::Levels::new(levels));
    let obj = format!("mtllib r.mtl\n{VERTICES}{FACES}v 1 1 2\nv 2 1 2\nv 2 2 2\nusemtl lamp\nf 9 10 11\n");
    let mtl = format!("{MTL}newmtl lamp\nKd 0\nKe 1000\n");
    let files = Files::new(&[("s.toml", SCENE.as_bytes()), ("r.obj", obj.as_bytes()), ("r.mtl", mtl.as_bytes())]);
    let scene = files.load(&LoadOptions { dimming, ..LoadOptions::default() }).unwrap();
    assert_eq!(scene.warnings, [""; 0]);
}

/// A lamp that shines at a wall at hand is turned the wrong way; one that a pane covers, or a wall behind it, is not.
#[test]
fn emitters_that_face_a_wall_are_told() {
    let turned = with_lamp(2.99, UP, "1000", "");
    assert_eq!(
        turned.warnings,
        [
            "material \"lamp\" shines at \"ceil\", less than 20 mm before it: is it turned? turn its faces, whose vertices run \
          counter-clockwise seen from the front, or move it"
        ]
    );
    assert_eq!(turned.luminaires.len(), 2);
    assert!(matches!(turned.luminaires[1].opening, Opening::Triangles(_)));
    for (what, scene) in [
        ("down from the ceiling", with_lamp(2.99, DOWN, "1000", "")),
        ("up from below", with_lamp(2.9, UP, "1000", "")),
        ("flush with the ceiling", with_lamp(3.0, DOWN, "1000", "")),
    ] {
        assert_eq!(scene.warnings, [""; 0], "{what}");
    }
    let cover = |material: &str, share: f64| {
        let end = 1.0 + share;
        let plate =
            format!("v 1 1 2.49\nv {end} 1 2.49\nv {end} 2 2.49\nv 1 2 2.49\nusemtl {material}\nf 13 14 15 16\n");
        let scene = with_lamp(2.5, DOWN, "1000", &plate);
        scene.warnings.iter().filter(|warning| warning.contains("is it turned?")).count()
    };
    assert_eq!((cover("wall", 1.0), cover("wall", 0.6), cover("wall", 0.4)), (1, 1, 0));
    assert_eq!(cover("pane", 1.0), 0);
}
