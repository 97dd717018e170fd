//! Both readers of OBJ files on texts made up and damaged.

use proptest::prelude::*;

use super::*;

/// Whether the large reader took a text, and whether it had to.
fn compare(text: &[u8]) -> (bool, bool) {
    let (usual, taken) = read_obj_both_ways(text);
    (taken, usual.is_ok())
}

fn coordinate() -> impl Strategy<Value = String> {
    prop_oneof![
        4 => (-3_i32..4).prop_map(|n| n.to_string()),
        2 => "[+-]?[0-9]{1,8}\\.[0-9]{0,9}",
        1 => "-?[0-9]{1,3}\\.[0-9]{1,18}",
        1 => "-?[0-9]\\.[0-9]{1,6}[eE][+-]?[0-8]",
    ]
}

/// One line, for each number of vertices that stand above it.
#[derive(Clone, Debug)]
enum ObjLine {
    Vertex(Vec<String>),
    /// Corners as parts of the vertices above, or of all where they may stand below, whether counted from below, and
    /// what stands behind the slash.
    Face(bool, Vec<(f64, bool, &'static str)>),
    Other(&'static str),
}

fn line() -> impl Strategy<Value = ObjLine> {
    let behind = prop::sample::select(vec!["", "", "/1", "/1/2", "//2", "/"]);
    let other = prop::sample::select(vec![
        "usemtl wall",
        "usemtl  floor tiles ",
        "usemtl wall",
        "usemtl",
        "usemtl # nothing",
        "usemtl wall\\",
        "usemtl W\u{e4}nde",
        "mtllib some.mtl",
        "g a",
        "g c a",
        "g b c",
        "g C:\\models\\",
        "g",
        "o b c",
        "o d",
        "vn 0 0 1",
        "vt 0.5 0.5",
        "s off",
        "# v 1 2 3",
        "# comment \\",
        "",
        "l 1 2 3",
        "f",
        "f 2",
        "f 1 3/2",
        "f -1 1 -1 1",
        "\u{feff}v 1 2 3",
    ]);
    prop_oneof![
        5 => prop::collection::vec(coordinate(), 3..8).prop_map(ObjLine::Vertex),
        4 => (prop::bool::weighted(0.1), prop::collection::vec((0.0..1.0, any::<bool>(), behind), 3..7))
            .prop_map(|(forward, corners)| ObjLine::Face(forward, corners)),
        2 => other.prop_map(ObjLine::Other),
    ]
}

/// A text, with three vertices at its beginning, so that every face has some to name.
fn text_of(lines: &[ObjLine], ends: &[u8]) -> String {
    let mut text = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    let mut above = 3;
    let all = 3 + lines.iter().filter(|line| matches!(line, ObjLine::Vertex(_))).count() as i32;
    for (number, line) in lines.iter().enumerate() {
        let end = ends[number % ends.len()];
        // Between words of a line: blanks, or a backslash that joins two lines.
        let between = if end & 4 != 0 { " \\\n\t" } else { "  " };
        match line {
            ObjLine::Vertex(words) => {
                let mut words: Vec<&str> = words.iter().map(String::as_str).collect();
                if let [_, _, _, w] = words.as_mut_slice() {
                    // Neither 0 nor so small that the vertex lies too far out.
                    *w = ["1", "2.5", "-3e0", "0.5"][number % 4];
                }
                text += &format!("v {}", words.join(between));
                above += 1;
            }
            ObjLine::Face(forward, corners) => {
                text += "f";
                for &(part, from_below, behind) in corners {
                    let named = if *forward { all } else { above };
                    let vertex = 1 + (part * f64::from(named)) as i32;
                    let vertex = if from_below && !forward { vertex - 1 - above } else { vertex };
                    text += &format!("{between}{vertex}{behind}");
                }
            }
            ObjLine::Other(other) => text += other,
        }
        if end & 2 != 0 && !matches!(line, ObjLine::Other(_)) {
            text += " # nice";
        }
        text += if end & 1 != 0 { "\r\n" } else { "\n" };
    }
    text
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn both_readers_tell_the_same(
        lines in prop::collection::vec(line(), 1..40),
        ends in prop::collection::vec(0_u8..8, 1..9),
    ) {
        let text = text_of(&lines, &ends);
        let (taken, good) = compare(text.as_bytes());
        prop_assert_eq!(taken, good, "{}", text);
        // Faces may all turn out to have too few corners that differ.
        prop_assert!(!good || lines.iter().any(|line| matches!(line, ObjLine::Face(..))));
    }

    /// Whatever a few wrong bytes do, the large reader takes no file that the other refuses, nor reads it otherwise.
    #[test]
    fn damaged_files_are_never_read_otherwise(
        lines in prop::collection::vec(line(), 1..12),
        ends in prop::collection::vec(0_u8..8, 1..9),
        damage in prop::collection::vec((any::<prop::sample::Index>(), prop::sample::select(b"-+.09eE/ \\#\nvfn\xc3\0".to_vec())), 1..5),
    ) {
        let mut text = text_of(&lines, &ends).into_bytes();
        for (place, byte) in damage {
            let place = place.index(text.len());
            text[place] = byte;
        }
        compare(&text);
    }
}

#[test]
fn odd_files_are_left_to_the_other_reader() {
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for odd in [
        "f 1 2 5\nv 1 1 1\n",
        "f 1 2 0\n",
        "f 0 1\n",
        "f 1 2 -9\n",
        "f 1 /2 3\n",
        "f 1 2 9999999999999999999\n",
        "v 1 2\n",
        "v 1 2 nan\n",
        "v 1 2 3 0\n",
        "v 1 2 1e999\n",
        "v 1 2 3 x\n",
        "v 1e12 0 0\nf 1 2 4\n",
    ] {
        assert!(!compare(format!("{triangle}{odd}").as_bytes()).0, "{odd}");
    }
    assert_eq!(compare(b"v 0 0 0\n"), (false, false), "no faces");
    assert_eq!(compare(format!("\u{feff}{triangle}").as_bytes()), (true, true), "a byte order mark");
    assert_eq!(compare(format!("{triangle}v 1e12 0 0").as_bytes()), (true, true), "far out, but no face's");
}

/// Where faces name vertices that stand below them, in their block or in a later one, the mesh is that of the plain
/// order.
#[test]
fn faces_may_stand_above_their_vertices() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 2 1\n";
    let faces = "usemtl a\nf 1 2 3\nf 2 4 3\nusemtl b\nf 1 3 4 2\nf 1 2 4\n";
    let mesh = |text: &str| {
        let obj = Obj::parse(Path::new("mesh.obj"), text.as_bytes(), 1.0, &BTreeSet::new()).expect("a sound file");
        (obj.vertices, obj.triangles, obj.material_of)
    };
    let plain = mesh(&format!("{vertices}{faces}"));
    for text in [format!("{faces}{vertices}"), format!("v 0 0 0\n{faces}{}", &vertices[8..])] {
        assert_eq!(compare(text.as_bytes()), (true, true), "{text}");
        assert_eq!(mesh(&text), plain);
    }
}

/// Faces that have no area whatever their vertices are left out as if they weren't there, and reported.
#[test]
fn faces_of_two_corners_are_left_out() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let read = |faces: &str| {
        let text = format!("{vertices}{faces}");
        assert_eq!(compare(text.as_bytes()), (true, true), "{text}");
        Obj::parse(Path::new("mesh.obj"), text.as_bytes(), 1.0, &BTreeSet::new()).expect("a sound file")
    };
    let plain = read("f 1 2 3\n");
    for few in ["f 1 2", "f 3", "f", "f 1 2 2", "f 2 -2 3", "f 1 -3 1 1/7", "f -1 3 -3 1 -1"] {
        let obj = read(&format!("usemtl unused\n{few}\nusemtl default\nf 1 2 3\n{few}\n"));
        assert_eq!((&obj.vertices, &obj.triangles, obj.materials.len()), (&plain.vertices, &plain.triangles, 1));
        let note = "mesh.obj:5: 2 faces with fewer than three different corners left out, the first of them here";
        assert_eq!(obj.notes, [note], "{few}");
    }
}

/// The oracle: `tobj` finds the same places of corners, to the bit, and the same area.
#[test]
fn tobj_finds_the_same_mesh() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let files = ["scenes/seed-office.obj", "scenes/box.obj", "tests/material/tobj/cornell_box.obj"];
    for file in files.map(|file| root.join(file)) {
        let bytes = std::fs::read(&file).expect("it is there");
        let ours = Obj::parse(&file, &bytes, 1.0, &BTreeSet::new()).expect("it is good");
        let options = tobj::LoadOptions { single_index: true, triangulate: true, ..Default::default() };
        let (models, _) =
            tobj::load_obj_buf(&mut &bytes[..], &options, |_| Ok(Default::default())).expect("it is good");
        let theirs: Vec<DVec3> = models
            .iter()
            .flat_map(|model| {
                let at = |&index: &u32| DVec3::from_slice(&model.mesh.positions[3 * index as usize..][..3]);
                model.mesh.indices.iter().map(at)
            })
            .collect();
        let ours: Vec<DVec3> = ours.triangles.as_flattened().iter().map(|&i| ours.vertices[i as usize]).collect();
        let places = |corners: &[DVec3]| -> BTreeSet<[u64; 3]> {
            corners.iter().map(|corner| corner.to_array().map(f64::to_bits)).collect()
        };
        assert_eq!(places(&ours), places(&theirs), "{}", file.display());
        let area = |corners: &[DVec3]| -> f64 {
            corners.as_chunks().0.iter().map(|[a, b, c]| 0.5 * (*b - *a).cross(*c - *a).length()).sum()
        };
        assert_eq!(ours.len(), theirs.len());
        assert!((area(&ours) / area(&theirs) - 1.0).abs() < 1e-12, "{}", file.display());
    }
}
