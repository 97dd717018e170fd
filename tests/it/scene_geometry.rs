//! Where things stand once a scene is loaded: units, axes, the centre, openings and what they send out.

use std::f64::consts::PI;
use std::fs;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use luxmap::luminaire::{Distribution, Opening};
use luxmap::scene::{Scene, material::Dielectric};
use luxmap::units;
use sha2::{Digest, Sha256};

/// The scene of three files in a folder of their own.
fn load(toml: &str, obj: &str, mtl: &str) -> Scene {
    load_files(&[("scene.toml", toml.as_bytes()), ("room.obj", obj.as_bytes()), ("room.mtl", mtl.as_bytes())])
}

fn load_files(files: &[(&str, &[u8])]) -> Scene {
    static NUMBER: AtomicUsize = AtomicUsize::new(0);
    let number = NUMBER.fetch_add(1, Ordering::Relaxed);
    let folder = std::env::temp_dir().join(format!("luxmap-scene-geometry-{}-{number}", std::process::id()));
    for (name, bytes) in files {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
    let scene = Scene::load(&folder.join("scene.toml"));
    fs::remove_dir_all(folder).unwrap();
    scene.unwrap()
}

const SENSOR: &str = "[[sensor]]\nname = \"S\"\nposition = [0, 0, 0]\nnormal = [0, 0, 2]\n";
const LAMP: &str = "[[luminaire]]\nname = \"L\"\nposition = [0, 0, 0]\nflux = 1000\n";
const GREY: &str = "newmtl a\nKd 0.5\n";
/// A triangle of 3 × 4 units in the file's xy plane.
const TRIANGLE: &str = "mtllib room.mtl\nusemtl a\nv 0 0 0\nv 3 0 0\nv 0 4 0\nf 1 2 3\n";

fn world_vertices(scene: &Scene) -> Vec<DVec3> {
    scene.mesh.vertices.iter().map(|vertex| DVec3::from(vertex.map(f64::from)) + scene.centre).collect()
}

#[test]
fn unit_axis_rotation_and_translation_act_in_this_order() {
    let mesh = "[[mesh]]\nfile = \"room.obj\"\nunit = \"cm\"\nup = \"y\"\nrotate_z = 90\ntranslate = [10, 0, 0]\n";
    let vertices = world_vertices(&load(&format!("{mesh}{LAMP}{SENSOR}"), TRIANGLE, GREY));
    for (found, expected) in vertices.iter().zip([DVec3::ZERO, DVec3::Y * 0.03, DVec3::Z * 0.04]) {
        assert!((*found - expected - DVec3::X * 10.0).length() < 1e-6, "{found}");
    }
}

#[test]
fn a_millimetre_survives_at_survey_coordinates() {
    let obj = "usemtl a\nv 1000000 2000000 50\nv 1000000.001 2000000 50\nv 1000000 2000000.001 50\nf 1 2 3\n";
    let toml = "[[mesh]]\nfile = \"room.obj\"\ntranslate = [3000000, 0, 0]\n[[luminaire]]\nname = \"L\"\n\
                position = [4000000, 2000000, 51]\nflux = 1000\n[material.a]\nreflectance = 0.5\n";
    let sensor = "[[sensor]]\nname = \"S\"\nposition = [4000000, 2000000, 50.001]\nnormal = [0, 0, 1]\n";
    let scene = load(&format!("{toml}{sensor}"), obj, "");
    let [a, b, c] =
        scene.mesh.triangles[0].map(|vertex| DVec3::from(scene.mesh.vertices[vertex as usize].map(f64::from)));
    // f64 keeps 1e6 m to 1e-10 m; f32 keeps the half metre around the centre to 3e-8 m.
    assert!((b - a - DVec3::X * 1e-3).length() < 1e-7 && (c - a - DVec3::Y * 1e-3).length() < 1e-7, "{a} {b} {c}");
    assert!((scene.centre - DVec3::new(4e6 + 5e-4, 2e6 + 5e-4, 50.5)).length() < 1e-8, "{}", scene.centre);
    assert!((scene.sensors[0].position + scene.centre - DVec3::new(4e6, 2e6, 50.001)).length() < 1e-9);
}

#[test]
fn without_a_mesh_planes_and_sensors_count_for_the_centre() {
    let scene = load(&format!("{LAMP}{}", SENSOR.replace("[0, 0, 0]", "[0, 0, -3]")), "", "");
    assert_eq!(scene.centre, DVec3::new(0.0, 0.0, -1.5));
    assert_eq!((scene.sensors[0].normal, scene.sensors[0].position), (DVec3::Z, DVec3::new(0.0, 0.0, -1.5)));
    assert!(scene.mesh.triangles.is_empty());
}

#[test]
fn emitting_faces_send_out_pi_times_luminance_times_area() {
    let mtl = "newmtl a\nKd 0\nKe 100 200 300\n";
    let scene = load(&format!("[[mesh]]\nfile = \"room.obj\"\n{SENSOR}"), TRIANGLE, mtl);
    let lamp = &scene.luminaires[0];
    let luminance = units::luminance([100.0, 200.0, 300.0]);
    assert!((lamp.flux.0 / (PI * luminance * 6.0) - 1.0).abs() < 1e-6, "{}", lamp.flux);
    assert!(
        (units::luminance(lamp.colour) - 1.0).abs() < 1e-12 && (lamp.colour[1] / lamp.colour[0] - 2.0).abs() < 1e-12
    );
    assert_eq!((lamp.name.as_str(), lamp.group.as_str(), &lamp.distribution), ("a", "a", &Distribution::Lambertian));
    let Opening::Triangles(triangles) = &lamp.opening else { panic!("faces stay faces") };
    assert_eq!(*triangles, [scene.mesh.corners(0)]);
}

#[test]
fn a_lamp_set_up_twice_is_two_luminaires_of_one_group() {
    let mesh = "[[mesh]]\nfile = \"room.obj\"\n";
    let mtl = "newmtl a\nKd 0\nKe 100\n";
    let scene = load(&format!("{mesh}{mesh}translate = [0, 0, 5]\n{SENSOR}"), TRIANGLE, mtl);
    let names: Vec<_> = scene.luminaires.iter().map(|lamp| (lamp.name.as_str(), lamp.group.as_str())).collect();
    assert_eq!(names, [("a", "a"), ("a (2)", "a")]);
    assert_eq!((scene.materials.len(), scene.mesh.triangles.len()), (1, 2));
}

#[test]
fn an_opening_and_its_body_stand_together_a_hair_off_the_ceiling() {
    let lamp = LAMP.replace("flux", "opening = { rectangle = [2, 1] }\nrotation = 90\nflux");
    let scene = load(&format!("[[mesh]]\nfile = \"room.obj\"\n{lamp}{SENSOR}"), TRIANGLE, GREY);
    let Opening::Rectangle { centre, half_width, half_depth } = scene.luminaires[0].opening else {
        panic!("a rectangle")
    };
    // At most 10⁻⁵ of half the scene, which runs from −1 to 4 in y, and not below what single precision tells apart there.
    let shift = centre + scene.centre;
    assert!(shift.x.abs() < 1e-12 && shift.y.abs() < 1e-12 && (-2.5e-5..-1e-6).contains(&(shift.z + 1e-12)), "{shift}");
    // Turned counter-clockwise seen from above: the first size, 2 m, runs towards +y.
    assert!((half_width - DVec3::Y).length() < 1e-12 && (half_depth - DVec3::X * 0.5).length() < 1e-12);
    let body: Vec<usize> = (0..3).filter(|&t| scene.materials[scene.mesh.material_of[t] as usize].is_black()).collect();
    assert_eq!(body, [1, 2]);
    for triangle in body {
        let [a, b, c] = scene.mesh.corners(triangle);
        let normal = (b - a).cross(c - a);
        assert!((normal - DVec3::NEG_Z * 2.0).length() < 1e-5, "{normal}");
        assert!(((a - centre).dot(normal)).abs() < 1e-6);
    }
}

#[test]
fn a_luminaire_switched_off_still_stands_in_the_way() {
    let off = LAMP.replace("\"L\"", "\"off\"") + "opening = { disc = 0.3 }\ndimming = 0\n";
    let scene = load(&format!("{LAMP}{off}{SENSOR}"), "", "");
    assert_eq!((scene.luminaires.len(), scene.mesh.triangles.len()), (1, 62));
}

#[test]
fn dimming_array_group_and_colour_reach_the_luminaires() {
    let lamp =
        format!("{LAMP}dimming = 0.5\ngroup = \"row\"\ncct = 3000\narray = {{ count = [2, 2], pitch = [1.5, 2] }}\n");
    let scene = load(&format!("{lamp}{SENSOR}"), "", "");
    let names: Vec<&str> = scene.luminaires.iter().map(|lamp| lamp.name.as_str()).collect();
    assert_eq!(names, ["L[1,1]", "L[2,1]", "L[1,2]", "L[2,2]"]);
    let Opening::Point { position, aim } = scene.luminaires[3].opening else { panic!("a point") };
    assert_eq!((position + scene.centre, aim), (DVec3::new(1.5, 2.0, 0.0), DVec3::NEG_Z));
    for lamp in &scene.luminaires {
        assert_eq!((lamp.flux.0, lamp.group.as_str(), &lamp.distribution), (500.0, "row", &Distribution::Isotropic));
        assert!(lamp.colour[0] > lamp.colour[2] && (units::luminance(lamp.colour) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn mtl_materials_become_mirrors_and_glass_and_the_scene_file_overrides_them() {
    let surface = |mtl: &str, section: &str| {
        // A tetrahedron: glass of it has an inside.
        let obj = "mtllib room.mtl\nusemtl a\nv 0 0 0\nv 3 0 0\nv 0 4 0\nv 0 0 5\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
        let scene = load(&format!("[[mesh]]\nfile = \"room.obj\"\n{LAMP}{SENSOR}{section}"), obj, mtl);
        let material = &scene.materials[0];
        (material.reflectance[0], material.specular[0], material.dielectric.map(|Dielectric { ior, .. }| ior))
    };
    assert_eq!(surface("newmtl a\nKd 0.1\nKs 0.8\nillum 2\n", ""), (0.1, 0.0, None));
    assert_eq!(surface("newmtl a\nKd 0.1\nKs 0.8\nillum 3\n", ""), (0.1, 0.8, None));
    assert_eq!(surface("newmtl a\nKd 0.1\nNi 1.5\nd 0.1\nillum 7\n", ""), (0.0, 0.0, Some(1.5)));
    assert_eq!(surface("newmtl a\nKd 0.1\nNi 1.0\nd 1\nillum 4\n", ""), (0.1, 0.0, None));
    assert_eq!(surface("newmtl a\nNi 1.5\nillum 7\n", "[material.a]\nreflectance = 0.3\n"), (0.3, 0.0, None));
    assert_eq!(surface("newmtl a\nNi 1.5\nillum 7\n", "[material.a]\ntransmittance = 0.3\n"), (0.0, 0.0, None));
    assert_eq!(surface("newmtl a\nNi 1.5\nillum 7\n", "[material.a]\nspecular = 0.3\n"), (0.0, 0.3, None));
    assert_eq!(surface("newmtl a\nKd 2\n", "[material.a]\ndielectric = { ior = 1.3 }\n"), (0.0, 0.0, Some(1.3)));
}

#[test]
fn polylines_and_points_are_no_triangles() {
    let obj = format!("{TRIANGLE}l 1 2 3\np 1\nl 1 2 3 1\n");
    assert_eq!(load(&format!("[[mesh]]\nfile = \"room.obj\"\n{LAMP}{SENSOR}"), &obj, GREY).mesh.triangles.len(), 1);
}

#[test]
fn the_hash_changes_with_each_file_and_with_nothing_else() {
    let toml = format!("[[mesh]]\nfile = \"room.obj\"\n{LAMP}{SENSOR}");
    let hash = |toml: &str, obj: &str, mtl: &str| load(toml, obj, mtl).hash;
    let first = hash(&toml, TRIANGLE, GREY);
    assert_eq!((first.len(), hash(&toml, TRIANGLE, GREY)), (64, first.clone()));
    assert_ne!(hash(&format!("{toml}\n"), TRIANGLE, GREY), first);
    assert_ne!(hash(&toml, &format!("{TRIANGLE}\n"), GREY), first);
    assert_ne!(hash(&toml, TRIANGLE, &format!("{GREY}\n")), first);
}

/// A PNG file of 8 bits a channel, and with transparency where pixels have four channels.
fn png<const N: usize>(width: u32, pixels: &[[u8; N]]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, pixels.len() as u32 / width);
    encoder.set_color([png::ColorType::Grayscale, png::ColorType::Rgb, png::ColorType::Rgba][N / 2]);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header().unwrap().write_image_data(pixels.as_flattened()).unwrap();
    bytes
}

/// A JPEG file of two blocks of 8 × 8 grey pixels, a black and a white one, written by hand: every quantum is 8, the code of
/// a difference of 8 bits and that of the block's end are each the bit 0; −128 and +255 follow theirs.
fn jpeg() -> Vec<u8> {
    let mut bytes = vec![0xff, 0xd8, 0xff, 0xdb, 0, 67, 0];
    bytes.extend([8; 64]);
    bytes.extend([0xff, 0xc0, 0, 11, 8, 0, 8, 0, 16, 1, 1, 0x11, 0]);
    for (table, symbol) in [(0x00, 8), (0x10, 0)] {
        bytes.extend([0xff, 0xc4, 0, 20, table, 1]);
        bytes.extend([0; 15]);
        bytes.push(symbol);
    }
    bytes.extend([0xff, 0xda, 0, 8, 1, 1, 0, 0, 63, 0, 0b0011_1111, 0b1001_1111, 0b1110_1111, 0xff, 0xd9]);
    bytes
}

/// Textures count with the mean of their light, times Kd: black and white in equal parts reflect half, not the 21.6 % of the
/// level between them. Files are found behind options and blanks, and belong to the scene's hash.
#[test]
fn textures_count_with_the_mean_of_their_light() {
    let toml = format!("[[mesh]]\nfile = \"room.obj\"\n{LAMP}{SENSOR}");
    let found = |mtl: &str, image: &[u8]| {
        let files = [
            ("scene.toml", toml.as_bytes()),
            ("room.obj", TRIANGLE.as_bytes()),
            ("room.mtl", mtl.as_bytes()),
            ("textures/old wood.png", image),
        ];
        let scene = load_files(&files);
        assert_eq!(scene.warnings, [""; 0]);
        (scene.materials[0].reflectance.map(|part| (part * 1e4).round() / 1e4), scene.hash)
    };
    let chequered = png(2, &[[0], [255], [255], [0]]);
    let (half, hash) = found("newmtl a\nKd 0.8\nmap_Kd textures/old wood.png\n", &chequered);
    assert_eq!(half, [0.4; 3]);
    assert_eq!(found("newmtl a\nmap_Kd -clamp on -s 2 2 2 textures\\old wood.png\n", &chequered).0, [0.5; 3]);
    let (white, other) = found("newmtl a\nKd 0.8\nmap_Kd textures/old wood.png\n", &png(1, &[[255]]));
    assert_eq!(white, [0.8; 3]);
    assert_ne!(hash, other);
    // sRGB 188 is light of 0.5029, and 64 of 0.0513 (IEC 61966-2-1).
    assert_eq!(
        found("newmtl a\nKd 1\nmap_Kd textures/old wood.png\n", &png(1, &[[255, 188, 64]])).0,
        [1.0, 0.5029, 0.0513]
    );
    let half_clear = png(3, &[[255, 0, 0, 255], [0, 255, 0, 51], [0, 0, 255, 0]]);
    assert_eq!(found("newmtl a\nKd 1\nmap_Kd textures/old wood.png\n", &half_clear).0, [0.8333, 0.1667, 0.0]);
    assert_eq!(found("newmtl a\nKd 1 0.5 0\nmap_Kd textures/old wood.png\n", &jpeg()).0, [0.5, 0.25, 0.0]);
}

/// Textures cut short anywhere, or with any byte spoilt, never panic.
#[test]
fn no_byte_of_a_texture_makes_it_panic() {
    let toml = format!("[[mesh]]\nfile = \"room.obj\"\n{LAMP}{SENSOR}");
    for image in [png(2, &[[0, 1, 2], [255, 9, 8]]), jpeg()] {
        for at in 0..image.len() {
            let mut spoilt = image.clone();
            spoilt[at] ^= [0xff, 0x01, 0x80][at % 3];
            for bytes in [&image[..at], &spoilt] {
                let files = [
                    ("scene.toml", toml.as_bytes()),
                    ("room.obj", TRIANGLE.as_bytes()),
                    ("room.mtl", b"newmtl a\nKd 0.5\nmap_Kd wood.png\n"),
                    ("wood.png", bytes),
                ];
                let scene = load_files(&files);
                assert!(scene.materials[0].reflectance.iter().all(|part| (0.0..=0.5).contains(part)));
                assert!(scene.warnings.iter().all(|warning| !warning.contains('\n')), "{:?}", scene.warnings);
            }
        }
    }
}

/// From 16 MiB on an OBJ file is read in blocks, by all threads. Room, hash and errors are those of a small file.
#[test]
fn a_large_file_is_the_same_room_as_a_small_one() {
    let toml = format!("[[mesh]]\nfile = \"room.obj\"\n{LAMP}{SENSOR}");
    let remark = format!("# {}\n", "long remark ".repeat(100));
    let padding = remark.repeat((17 << 20) / remark.len());
    // A face may come before one of its vertices; a number of many digits is what the reader of large files leaves to the other.
    for rest in ["v 3 4 0\nf -1 3 2\n", "f 2 4 3\nv 3 4 0\n", "v 3 4 0\nf 00000000000000000002 4 3\n"] {
        let small = load(&toml, &format!("{TRIANGLE}{rest}"), GREY);
        let obj = format!("{TRIANGLE}{padding}{rest}");
        let large = load(&toml, &obj, GREY);
        assert_eq!(large.mesh.triangles, small.mesh.triangles);
        assert_eq!(large.mesh.vertices, small.mesh.vertices);
        assert!(large.mesh.vertices.capacity() > large.mesh.vertices.len(), "Embree wants room for one more");
        let mut hash = Sha256::new();
        for bytes in [toml.as_bytes(), obj.as_bytes(), GREY.as_bytes()] {
            hash.update((bytes.len() as u64).to_le_bytes());
            hash.update(bytes);
        }
        assert_eq!(large.hash, hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect::<String>());
    }
}
