//! Window panes: the same light whichever way they are drawn, and the transmittance that they were given, at every angle.

use std::f64::consts::PI;

use crate::common::assert_close;
use crate::common::mean;
use crate::common::run;
use crate::common::run_with;
use crate::common::scene;
use luxmap::render::Settings;
use luxmap::render::Stop;
use luxmap::render::plan::Method;
use luxmap::render::plan::Plan;
use luxmap::results::Results;
use luxmap::scene::glazing::Curve;
use luxmap::scene::{Glazing, Scene};
use luxmap::study::check::scenes::another_room;
use luxmap::study::check::scenes::diffuse;
use luxmap::study::check::scenes::panel;
use luxmap::study::check::scenes::point_lamp;
use luxmap::study::check::scenes::polygon;
use luxmap::study::check::scenes::room;
use luxmap::study::check::scenes::solid;

const ALL: [Method; 4] = [Method::Gather, Method::Path, Method::Split, Method::Photons];

/// Black box of 8 × 8 × 4 m with a horizontal pane at 2 m; plane of one cell below, off the axis of a lamp at 3 m.
fn over_a_pane(test: &str, pane: &str, lamp: &str, x: f64) -> Scene {
    let obj = room([-4.0, -4.0, 0.0], [4.0, 4.0, 4.0], ["black"; 6])
        + &polygon("pane", &[[-4.0, -4.0, 2.0], [4.0, -4.0, 2.0], [4.0, 4.0, 2.0], [-4.0, 4.0, 2.0]]);
    let toml = format!(
        "{}[material.pane]\n{pane}\n{lamp}[[plane]]\nname = \"floor\"\ncorner = [{}, -0.005, 0]\nalong = [0.01, 0, 0]\n\
         across = [0, 0.01, 0]\ncells = [1, 1]\non = \"surface\"\n",
        diffuse("black", 0.0),
        x - 0.005
    );
    scene(test, &toml, &obj)
}

/// τ by the cosine of the angle of incidence.
type Transmittance = fn(f64) -> f64;

/// E below a pane is I τ(θ) cos³θ/h² for a lamp without extent: cut exactly, so to single precision, with no photon.
#[test]
fn direct_light_passes_by_the_transmittance_at_its_angle() {
    let lamp = point_lamp("lamp", [0.0, 0.0, 3.0], 4000.0 * PI);
    let forms: [(&str, Transmittance); 4] = [
        ("glazing = 0.88", |cos| Glazing::clear([0.88; 3]).at(0, cos)[0]),
        ("glazing = { transmittance = 0.5, reflectance = 0.3 }", |cos| {
            Glazing::new([0.5; 3], Some([0.3; 3]), Curve::Clear).at(0, cos)[0]
        }),
        ("glazing = { curve = [[0, 0.8], [90, 0]] }", |cos| 0.8 * (1.0 - cos.acos().to_degrees() / 90.0)),
        ("glazing = { curve = \"cie171\" }", |c| {
            -0.028_378 + 3.156_075 * c - 3.058_376 * c * c - 1.428_919 * c.powi(3) + 4.014_235 * c.powi(4)
                - 1.775_827 * c.powi(5)
        }),
    ];
    for (number, (pane, transmittance)) in forms.iter().enumerate() {
        for x in [0.0, 1.5, 3.5_f64] {
            let scene = over_a_pane(&format!("pane_{number}_{x}"), pane, &lamp, x);
            let cos = 3.0 / 9.0_f64.mul_add(1.0, x * x).sqrt();
            let expected = 1000.0 * transmittance(cos) * cos.powi(3) / 9.0;
            let results = run(&scene, Method::Path, 1000, 1);
            // Single precision, and a cell of 1 cm: (0.01/3)² in second order.
            assert_close(&format!("{pane} at {x} m"), mean(&results.maps[0]), expected, 3e-5);
        }
    }
}

/// A large Lambertian panel close above a wide pane: E = ∫ L τ(θ) cos θ dω over the panel, by a fine sum. The pane's two
/// triangles, and the strip of another beside it, must share the panel without gap or overlap.
#[test]
fn a_wide_panel_is_seen_through_the_pane_part_by_part() {
    let (width, height) = (3.0, 2.2);
    let lamp = panel("lamp", [0.0, 0.0, height], [0.0, 0.0, -1.0], [width, width], 9000.0);
    let glazing = Glazing::clear([0.88; 3]);
    for x in [0.0, 1.2, 3.0_f64] {
        let scene = over_a_pane(&format!("wide_{x}"), "glazing = 0.88", &lamp, x);
        let luminance = 9000.0 / (PI * width * width);
        let steps = 600;
        let at = |i: usize| width * ((i as f64 + 0.5) / steps as f64 - 0.5);
        let mut expected = 0.0;
        for i in 0..steps {
            for j in 0..steps {
                let (dx, dy) = (at(i) - x, at(j));
                let squared = dx * dx + dy * dy + height * height;
                let cos = height / squared.sqrt();
                expected += glazing.at(0, cos)[0] * cos * cos / squared;
            }
        }
        expected *= luminance * (width / steps as f64).powi(2);
        let results = run(&scene, Method::Path, 1000, 1);
        // Parts are halved until τ varies by 0.02 within one; degree two leaves some 10⁻⁴ of that. The fine sum errs by 1e-6.
        assert_close(&format!("at {x} m"), mean(&results.maps[0]), expected, 5e-4);
    }
}

/// Two rooms with a window between them, drawn in every way that programs have.
fn two_rooms(test: &str, window: &str, glass: &str) -> Scene {
    let obj = room([0.0; 3], [4.0, 4.0, 3.0], ["floor", "ceiling", "wall", "out", "wall", "wall"])
        + &another_room([4.0, 0.0, 0.0], [8.0, 4.0, 3.0], ["floor", "ceiling", "out", "wall", "wall", "wall"])
        + &[[0.0, 1.0, 0.0, 3.0], [3.0, 4.0, 0.0, 3.0], [1.0, 3.0, 0.0, 0.5], [1.0, 3.0, 2.5, 3.0]]
            .map(|[a, b, low, high]| polygon("wall", &[[4.0, a, low], [4.0, b, low], [4.0, b, high], [4.0, a, high]]))
            .concat();
    // The rooms' own walls between them are left out.
    let mut kept = String::new();
    let mut skip = false;
    for line in obj.lines() {
        if let Some(name) = line.strip_prefix("usemtl ") {
            skip = name == "out";
        }
        if !(skip && line.starts_with("f ")) && line != "usemtl out" {
            kept += &format!("{line}\n");
        }
    }
    let toml = format!(
        "{}{}{}{glass}{}[[plane]]\nname = \"floorB\"\ncorner = [4, 0, 0]\nalong = [4, 0, 0]\nacross = [0, 4, 0]\ncells = [8, 8]\n\
         [[plane]]\nname = \"vertB\"\ncorner = [6, 0, 0]\nalong = [0, 0, 3]\nacross = [0, 4, 0]\ncells = [6, 8]\non = \"air\"\n",
        diffuse("floor", 0.2),
        diffuse("ceiling", 0.7),
        diffuse("wall", 0.5),
        panel("lamp", [1.0, 2.0, 2.0], [1.0, 0.0, 0.0], [0.2, 0.2], 10_000.0),
    );
    scene(test, &toml, &(kept + window))
}

fn passes(scene: &Scene, method: Method, passes: u32) -> Results {
    let settings = Settings::for_plan(&Plan::new(scene, method));
    run_with(scene, method, &Settings { stop: Stop::after(passes), photons: 200_000, ..settings })
}

/// A sheet either way round, a closed slab either way round, its two faces alone, and a sheet that is said to be glazing are
/// all the same pane to the last photon: what is measured differs by no more than the few mm between them.
#[test]
fn a_pane_is_the_same_however_it_is_drawn() {
    let sheet = |x: f64| [[x, 1.0, 0.5], [x, 3.0, 0.5], [x, 3.0, 2.5], [x, 1.0, 2.5]];
    let back = |x: f64| {
        let mut points = sheet(x);
        points.reverse();
        points
    };
    let slab = solid([3.995, 1.0, 0.5], [4.005, 3.0, 2.5], "glass");
    let inside_out = another_room([3.995, 1.0, 0.5], [4.005, 3.0, 2.5], ["glass"; 6]);
    let dielectric = "[material.glass]\ndielectric = { ior = 1.5 }\n";
    let glazing = "[material.glass]\nglazing = 0.9230769230769231\n";
    let windows = [
        ("said", polygon("glass", &sheet(4.0)), glazing, 0),
        ("sheet", polygon("glass", &sheet(4.0)), dielectric, 1),
        ("turned sheet", polygon("glass", &back(4.0)), dielectric, 1),
        ("two faces", polygon("glass", &sheet(4.005)) + &polygon("glass", &back(3.995)), dielectric, 0),
        ("two faces turned", polygon("glass", &back(4.005)) + &polygon("glass", &sheet(3.995)), dielectric, 0),
        ("slab of panes", slab.clone(), glazing, 0),
        ("double face", polygon("glass", &sheet(4.0)) + &polygon("glass", &back(4.0)), glazing, 0),
    ];
    let mut expected: Option<[f64; 2]> = None;
    for (name, window, glass, warnings) in windows {
        let scene = two_rooms(&format!("rooms_{}", name.replace(' ', "_")), &window, glass);
        assert_eq!(scene.warnings.len(), warnings, "{name}: {:?}", scene.warnings);
        let results = passes(&scene, Method::Split, 4);
        let found = [mean(&results.maps[0]), mean(&results.maps[1])];
        println!("{name}: {found:?}");
        let expected = *expected.get_or_insert(found);
        assert_close(&format!("floorB, {name}"), found[0], expected[0], 2e-3);
        assert_close(&format!("vertB, {name}"), found[1], expected[1], 2e-3);
    }
    for (name, window) in [("slab", slab), ("slab inside out", inside_out)] {
        let scene = two_rooms(&format!("rooms_{}", name.replace(' ', "_")), &window, dielectric);
        let results = passes(&scene, Method::Split, 4);
        let expected = expected.unwrap();
        assert_close(&format!("floorB, {name}"), mean(&results.maps[0]), expected[0], 2e-3);
        assert_close(&format!("vertB, {name}"), mean(&results.maps[1]), expected[1], 2e-3);
    }
}

/// A furnace: luminance is the same everywhere in a closed room whose surfaces send out 1 − R, panes that lose nothing
/// (τ + ρ = 1) among them, so E = π L on both sides of the panes, by every method.
#[test]
fn a_furnace_with_panes_is_evenly_lit() {
    let luminance = 100.0;
    let folder = crate::common::folder("pane_furnace");
    std::fs::write(folder.join("furnace.mtl"), format!("newmtl wall\nKd 0\nKe {}\n", 0.5 * luminance)).unwrap();
    let pane = |x: f64| polygon("pane", &[[x, 0.2, 0.1], [x, 1.9, 0.3], [x + 0.3, 1.9, 2.2], [x + 0.3, 0.2, 2.0]]);
    let obj = format!("mtllib furnace.mtl\n{}{}{}", room([0.0; 3], [3.0, 2.0, 2.5], ["wall"; 6]), pane(0.8), pane(1.7));
    let toml = "[material.wall]\nreflectance = 0.5\n[material.pane]\nglazing = { transmittance = 0.7, reflectance = 0.3 }\n\
                [[plane]]\nname = \"floor\"\ncorner = [0,0,0]\nalong = [3,0,0]\nacross = [0,2,0]\ncells = [12,8]\non = \"surface\"\n\
                [[plane]]\nname = \"air\"\ncorner = [0,0,1.1]\nalong = [3,0,0]\nacross = [0,2,0]\ncells = [12,8]\non = \"air\"\n";
    let scene = scene("pane_furnace", toml, &obj);
    for method in ALL {
        let results = passes(&scene, method, 4);
        for map in &results.maps {
            let claim = (map.standard_error.iter().map(|s| s * s).sum::<f64>()).sqrt() / map.illuminance.len() as f64;
            let what = format!("{}, {}", method.name(), map.name);
            // Cells are not independent: four times what they claim, and 1 % for what densities blur at edges.
            assert_close(&what, mean(map), PI * luminance, 4.0 * claim / mean(map) + 1e-2);
        }
    }
}

/// A coloured pane filters each channel by its own share, twice where there are two: normal incidence, so τ² of each.
#[test]
fn coloured_panes_filter_each_channel() {
    let pane = |z: f64| polygon("pane", &[[-4.0, -4.0, z], [4.0, -4.0, z], [4.0, 4.0, z], [-4.0, 4.0, z]]);
    let obj = room([-4.0, -4.0, 0.0], [4.0, 4.0, 4.0], ["black"; 6]) + &pane(2.0) + &pane(2.5);
    let toml = format!(
        "{}[material.pane]\nglazing = {{ transmittance = [0.8, 0.5, 0.1], reflectance = 0 }}\n{}[[plane]]\nname = \"floor\"\n\
         corner = [-0.005, -0.005, 0]\nalong = [0.01, 0, 0]\nacross = [0, 0.01, 0]\ncells = [1, 1]\non = \"surface\"\n",
        diffuse("black", 0.0),
        point_lamp("lamp", [0.0, 0.0, 3.0], 4000.0 * PI),
    );
    let scene = scene("coloured_panes", &toml, &obj);
    let plan = Plan::new(&scene, Method::Gather);
    assert!(plan.coloured && !plan.caustics);
    let map = run(&scene, Method::Gather, 1000, 1).maps.remove(0);
    let rgb = map.rgb.as_ref().expect("three channels");
    for (channel, share) in [0.8, 0.5, 0.1_f64].into_iter().enumerate() {
        assert_close("channel", rgb[0][channel], share * share * 1000.0 / 9.0, 1e-4);
    }
}
