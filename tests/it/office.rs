//! Made-up offices: closed furniture, the same bytes for the same seed, and a scene that says what it is.

use std::collections::HashMap;
use std::f64::consts::PI;
use std::fs;
use std::process::Command;

use crate::common::{assert_close, folder, mean, run};
use glam::DVec3;
use luxmap::office::furniture::Item;
use luxmap::office::shapes::{Bent, Detail, RoundedBox, Sink, ball, lathe, outline, parabola, tube};
use luxmap::office::write::Written;
use luxmap::office::{Office, Parameters, Windows};
use luxmap::render::plan::Method;
use luxmap::scene::Scene;

const FILES: [&str; 4] = ["office.obj", "office.mtl", "downlight.ies", "office.toml"];

fn small() -> Parameters {
    Parameters { workstations: 4, detail: 1, cell: 0.2, ..Parameters::default() }
}

/// Writes an office into a folder of its own and reads it back.
fn written(test: &str, parameters: Parameters) -> (Office, Written, Scene) {
    let office = Office::new(parameters).unwrap_or_else(|error| panic!("{error}"));
    let folder = folder(test);
    let written = office.write(&folder).unwrap_or_else(|error| panic!("{error}"));
    let scene = Scene::load(&folder.join("office.toml")).unwrap_or_else(|error| panic!("{error}"));
    (office, written, scene)
}

/// Six times the signed volume, m³.
fn six_volumes(item: &Item, triangles: &[[u32; 3]]) -> f64 {
    let corner = |corner: u32| item.vertices[corner as usize];
    triangles.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c)))).sum()
}

/// The shells of an item: triangles that hang together.
fn shells(item: &Item) -> Vec<Vec<[u32; 3]>> {
    let mut parent: Vec<u32> = (0..item.vertices.len() as u32).collect();
    fn root(parent: &mut [u32], mut vertex: u32) -> u32 {
        while parent[vertex as usize] != vertex {
            parent[vertex as usize] = parent[parent[vertex as usize] as usize];
            vertex = parent[vertex as usize];
        }
        vertex
    }
    for &[a, b, c] in &item.triangles {
        for other in [b, c] {
            let (a, other) = (root(&mut parent, a), root(&mut parent, other));
            parent[other as usize] = a;
        }
    }
    let mut shells: HashMap<u32, Vec<[u32; 3]>> = HashMap::new();
    for &triangle in &item.triangles {
        shells.entry(root(&mut parent, triangle[0])).or_default().push(triangle);
    }
    shells.into_values().collect()
}

/// Asserts that a shell is closed, turned one way and has no handles: each edge is run through once in each direction, and
/// V − E + F = 2.
fn assert_closed(what: &str, shell: &[[u32; 3]]) {
    let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
    for &[a, b, c] in shell {
        [(a, b), (b, c), (c, a)].into_iter().for_each(|edge| *edges.entry(edge).or_default() += 1);
    }
    for (&(a, b), &times) in &edges {
        assert!(times == 1 && edges.contains_key(&(b, a)), "{what}: edge {a}–{b} has no other side, or two");
    }
    let vertices: std::collections::HashSet<u32> = shell.iter().flatten().copied().collect();
    let euler = vertices.len() as i64 - edges.len() as i64 / 2 + shell.len() as i64;
    assert_eq!(euler, 2, "{what}: V − E + F of a ball is 2");
}

/// Least height of the triangles, m.
fn least_height(item: &Item) -> f64 {
    let height = |&[a, b, c]: &[u32; 3]| {
        let [a, b, c] = [a, b, c].map(|corner| item.vertices[corner as usize]);
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        (b - a).cross(c - a).length() / longest
    };
    item.triangles.iter().map(height).fold(f64::INFINITY, f64::min)
}

/// Coordinates are written to 10⁻⁵ m: a corner moves by at most √3/2 of that, so a triangle higher than twice as much stays
/// one. Single precision adds 2⁻²⁴ of 210 m, half the largest office there may be: 1.3·10⁻⁵ m for each coordinate.
const LEAST_HEIGHT: f64 = 2.0 * 0.87 * (1e-5 + 2.0 * 1.3e-5);

#[test]
fn every_item_is_made_of_closed_shells_that_face_outwards_at_any_detail() {
    for detail in [1, 2, 3, 4, 5, 7, 8, 11, 16, 23, 32] {
        let office = Office::new(Parameters { detail, ..small() }).unwrap_or_else(|error| panic!("{error}"));
        for (name, item) in office.items() {
            let what = format!("{name} at detail {detail}");
            let height = least_height(item);
            assert!(height > LEAST_HEIGHT, "{what}: a triangle of {height} m height");
            for shell in shells(item) {
                assert_closed(&what, &shell);
                let volume = six_volumes(item, &shell);
                assert!(volume > 0.0, "{what}: a shell turned inside out, of {volume} m³");
            }
            assert_eq!(item.materials.last().map(|&(_, end)| end), Some(item.triangles.len()), "{what}");
        }
    }
}

/// The building is one shell that faces inwards: minus the room, minus the windows' recesses of 0.96 × 1.5 × 0.12 m, six in
/// each long wall of a module.
#[test]
fn the_building_is_closed_and_as_large_as_told() {
    for (workstations, windows) in [(1, Windows::Glass), (30, Windows::Matte), (100, Windows::None)] {
        let office =
            Office::new(Parameters { workstations, windows, ..small() }).unwrap_or_else(|error| panic!("{error}"));
        let shells = shells(&office.building);
        assert_eq!(shells.len(), 1);
        assert_closed("building", &shells[0]);
        let panes = if windows == Windows::None { 0.0 } else { 2.0 * office.size.x / 1.2 };
        let expected = -(office.area() * office.size.z + panes * 0.96 * 1.5 * 0.12);
        assert_close("volume", six_volumes(&office.building, &shells[0]) / 6.0, expected, 1e-12);
    }
}

/// Volumes against closed forms, in which the polygons that stand for circles are taken as they are.
#[test]
fn shapes_have_the_volumes_of_what_they_stand_for() {
    let volume = |draw: &dyn Fn(&mut dyn Sink)| {
        let mut item = Item::default();
        draw(&mut item);
        assert_closed("shape", &item.triangles);
        six_volumes(&item, &item.triangles) / 6.0
    };
    let around = 24;
    // Area of a regular polygon over that of its circle.
    let polygon = f64::from(around) / (2.0 * PI) * (2.0 * PI / f64::from(around)).sin();

    let sharp = RoundedBox { half: DVec3::new(0.5, 0.3, 0.1), radius: 0.0, flat: [3, 2, 1] };
    assert_close("box", volume(&|sink| sharp.shell(Detail(2), sink)), 0.12, 1e-12);
    // At detail 8 an eighth of the circle has n = 7 segments: the farthest chord spans less than 1.28/n·π/4 (the steps are even in the
    // tangent), and a chord of angle a lies a²/8 of the radius inside at most. Less than the whole of what is rounded is lost.
    let round = RoundedBox { radius: 0.05, ..sharp };
    let chord: f64 = 1.28 / 7.0 * PI / 4.0;
    let skin = round.volume() - RoundedBox { half: round.half - 0.05, radius: 0.0, ..round }.volume();
    let found = volume(&|sink| round.shell(Detail(8), sink));
    assert!(
        found < round.volume() && found > round.volume() - skin * chord * chord / 4.0,
        "{found}, {}",
        round.volume()
    );
    // A shear keeps volumes; the surface z = f(x, y) is sampled on both sides alike.
    let sheared = volume(&|sink| {
        sharp.shell(Detail(2), &mut Bent::new(sink, |p| p + DVec3::Z * (0.7 * p.x * p.x + 0.2 * p.y)));
    });
    assert_close("sheared box", sheared, 0.12, 1e-12);

    let cylinder = [[0.0, 0.0], [0.2, 0.0], [0.2, 0.7], [0.0, 0.7]];
    let expected = polygon * PI * 0.04 * 0.7;
    assert_close("cylinder", volume(&|sink| lathe(&outline(&cylinder, 2, Detail(3)), 24, sink)), expected, 1e-12);
    let cone = [[0.0, 0.0], [0.2, 0.0], [0.0, 0.6]];
    assert_close("cone", volume(&|sink| lathe(&cone, 24, sink)), polygon * PI * 0.04 * 0.2, 1e-12);
    // Cones inscribed in a ball in n steps from pole to pole: Σ of frusta is 4/3 π r³ cos(π/2n)² by summing the sines.
    let n = 40;
    let frusta = (0..n).map(|step| {
        let [a, b] = [step, step + 1].map(|step| PI * f64::from(step) / f64::from(n));
        let (r, s) = (a.sin(), b.sin());
        PI / 3.0 * (a.cos() - b.cos()) * (r * r + r * s + s * s)
    });
    assert_close("ball", volume(&|sink| lathe(&ball(1.0, 3.0, 40), 24, sink)), polygon * frusta.sum::<f64>(), 1e-12);

    let straight = [DVec3::ZERO, DVec3::new(1.0, 2.0, 2.0)];
    let expected = polygon * PI * 0.01 * 3.0;
    assert_close("straight tube", volume(&|sink| tube(&straight, 0.1, 24, sink)), expected, 1e-12);
    // Pappus: area times length; rings stand on the bisectors, which loses 1 − cos of half the turn between segments: the
    // parabola turns by a right angle in 64 of them, at most 3.2 times faster than on the average (at its middle).
    let path = parabola([DVec3::X, DVec3::ZERO, DVec3::Y], 64);
    let length: f64 = path.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    let bound = (3.2 * PI / 2.0 / 64.0_f64 / 2.0).powi(2);
    assert_close("bent tube", volume(&|sink| tube(&path, 0.05, 24, sink)), polygon * PI * 0.0025 * length, bound);
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_another_office() {
    let read = |test: &str, parameters: Parameters| {
        let (office, _, _) = written(test, parameters);
        drop(office);
        FILES.map(|file| fs::read(folder(test).join(file)).unwrap_or_else(|error| panic!("{file}: {error}")))
    };
    let (once, again) = (read("office_once", small()), read("office_again", small()));
    assert!(once == again);
    let other = read("office_other", Parameters { seed: 1, ..small() });
    assert!(once[0] != other[0]);
    assert!(
        fs::read_dir(folder("office_once")).is_ok_and(|entries| entries.count() == FILES.len()),
        "nothing else is left"
    );
}

#[test]
fn the_scene_is_what_was_told() {
    for (number, windows) in [(0, Windows::Glass), (1, Windows::Matte), (2, Windows::None)] {
        let parameters = Parameters { workstations: 31, seed: number, windows, luminaires: Some(40), ..small() };
        let (office, written, scene) = written(&format!("office_told_{number}"), parameters);
        assert_eq!(scene.warnings, Vec::<String>::new());
        // A panel's opening is two triangles more, a downlight's a polygon.
        let openings: usize = scene.luminaires.iter().map(|luminaire| luminaire.body.len()).sum();
        assert_eq!(scene.mesh.triangles.len() - openings, written.triangles as usize);
        assert_eq!(written.triangles, office.triangles());
        assert_eq!(scene.luminaires.len(), written.luminaires as usize);
        let flux: f64 = scene.luminaires.iter().map(|luminaire| luminaire.flux.0).sum();
        assert_close("flux", flux, written.flux, 1e-12);
        let names: Vec<&str> = scene.planes.iter().map(|plane| plane.name.as_str()).collect();
        assert_eq!(names, ["floor", "workplane"]);
        assert_eq!(scene.sensors.len(), 31);
        assert_eq!(scene.sensors.iter().filter(|sensor| sensor.target == Some(275.0)).count(), 31);
        let bytes: u64 = FILES
            .iter()
            .map(|file| {
                fs::metadata(folder(&format!("office_told_{number}")).join(file)).map_or(0, |metadata| metadata.len())
            })
            .sum();
        assert_eq!(written.bytes, bytes);
        let mirrors = scene.materials.iter().any(|material| material.specular[0] > 0.0);
        assert_eq!(mirrors, windows == Windows::Glass);
    }
}

/// The file's own flux is what the scene asks for: intensities are rounded to 0.01 cd of several hundred, and read back as
/// straight lines between angles 2.5° apart. The shape's second derivative times the solid angle, h²/12 ∫|I''| 2π sin γ dγ,
/// is below 1 % of the flux.
#[test]
fn the_photometric_file_agrees_with_the_scene() {
    let (office, _, _) = written("office_ies", small());
    let file = folder("office_ies").join("downlight.ies");
    let photometry = luxmap::luminaire::photometry::Photometry::read(&file).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(photometry.notes, Vec::<String>::new());
    let rows = office.rows();
    let expected = rows.iter().find(|row| row.downlights).map(|row| row.flux).expect("every office has downlights");
    assert_close("flux", photometry.intensity.flux(), expected, 0.01);
}

#[test]
fn triangles_asked_for_are_met_as_near_as_details_go() {
    for wanted in [1, 40_000, 400_000, u64::MAX] {
        let parameters = Parameters { workstations: 6, ..small() }.with_triangles(wanted);
        let detail = parameters.unwrap_or_else(|error| panic!("{error}")).detail;
        let ratio = |detail: u32| {
            let parameters = Parameters { workstations: 6, detail, ..small() };
            let found = Office::new(parameters).unwrap_or_else(|error| panic!("{error}")).triangles() as f64;
            (found / wanted as f64).max(wanted as f64 / found)
        };
        for other in [detail - 1, detail + 1].into_iter().filter(|other| Parameters::DETAIL.contains(other)) {
            assert!(ratio(detail) <= ratio(other), "{wanted}: detail {detail}, but {other} is nearer");
        }
    }
}

/// All light ends in the closed building; photons carry single precision. At 0.75 m arrives what the command chose the flux
/// for, which is fitted to offices from six workstations on: here it has four, so within a tenth.
#[test]
fn a_small_office_is_as_bright_as_its_flux_allows_and_keeps_its_light() {
    let (office, written, scene) = written("office_rendered", small());
    let results = run(&scene, Method::Gather, 60_000, 1);
    let flux = &results.run.flux;
    assert!(flux.escaped.0 == 0.0, "{} of {} escaped", flux.escaped, flux.emitted);
    assert_close("flux", flux.absorbed.0 + flux.cut_off.0, written.flux, 1e-5);
    let workplane = mean(&results.maps[1]);
    let direct = written.flux / office.area();
    println!("workplane: {workplane} lx, flux over area: {direct} lx");
    let asked = office.parameters.illuminance;
    assert!((workplane / asked - 1.0).abs() < 0.1, "{workplane} lx, asked for {asked} lx");
    assert_eq!(results.sensors.len(), 4);
    assert!(results.sensors.iter().all(|reading| reading.illuminance > 0.1 * direct));
}

/// An example must be feasible: at full output each desk has what its sensor asks for, by more than 4 σ of what is claimed (32
/// such readings: one in 30 000 that chance alone misses); and each luminaire says what it draws.
#[test]
fn every_desk_can_have_what_it_asks_for() {
    for (workstations, luminaires, height) in [(1, None, 2.8), (7, Some(6), 2.4), (24, None, 3.5)] {
        let parameters = Parameters { workstations, luminaires, height, cell: 1.0, detail: 1, ..small() };
        let (office, _, mut scene) = written(&format!("office_feasible_{workstations}"), parameters);
        scene.planes.retain(|plane| plane.name == "workplane");
        assert!(scene.luminaires.iter().all(|luminaire| luminaire.supply.power.is_some()));
        let results = run(&scene, Method::Gather, 30_000, 1);
        assert_eq!(results.sensors.len(), workstations as usize);
        for reading in &results.sensors {
            let least = reading.illuminance - 4.0 * reading.standard_error;
            let name = &reading.name;
            assert!(
                least > office.target(),
                "{workstations} workstations, {name}: {least} lx of {} lx",
                office.target()
            );
            assert_eq!(reading.target, Some(office.target()));
        }
    }
}

#[test]
fn mistakes_get_one_line_and_exit_code_2() {
    let folder = folder("office_mistakes");
    fs::write(folder.join("file"), "").unwrap_or_else(|error| panic!("{error}"));
    for (arguments, expected) in [
        (&["--workstations", "0"][..], "0 is not in 1..=10000"),
        (&["--detail", "33"], "33 is not in 1..=32"),
        (&["--detail", "2", "--triangles", "5"], "cannot be used with"),
        (&["--windows", "open"], "invalid value 'open'"),
        (&["--height", "NaN"], "--height: found NaN, expected a number from 2.4 to 6"),
        (&["--cell", "-1"], "--cell: found -1, expected a number from 0.01 to 1.2"),
        (&["-o", "file/office"], "can't be written"),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_luxmap"));
        let output = command.current_dir(&folder).arg("office").args(arguments).output().expect("luxmap starts");
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(message.contains(expected) && message.lines().count() == 1, "{arguments:?}: {message}");
    }
    assert!(!folder.join("out").exists());
}
