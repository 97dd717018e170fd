//! Light groups: parts that add up to the whole, each right by itself, at no cost to what they are parts of.

use crate::common::{room, run_with, scene, sensor, shipped};
use luxmap::luminaire::Luminaire;
use luxmap::render::plan::{Method, Plan};
use luxmap::render::{Settings, Stop, render};
use luxmap::report::exr::group_layers;
use luxmap::report::{ExtraLayers, write};
use luxmap::results::{IlluminanceMap, Results};
use luxmap::scene::Scene;

const METHODS: [Method; 4] = [Method::Gather, Method::Split, Method::Path, Method::Photons];

/// A room of 4 × 3 × 2.5 m with a board across it: two panels of one group, a lamp near a wall, a panel on the other wall;
/// two sensors that share a plane and one on its own.
fn office(test: &str, wall: &str, extra: &str) -> Scene {
    let mut mesh = room([0.0; 3], [4.0, 3.0, 2.5], ["floor", "ceiling", "wall", "wall", "end", "end"]);
    mesh.push_str("v 2 0.5 0.6\nv 2 2.5 0.6\nv 2 2.5 1.1\nv 2 0.5 1.1\nusemtl board\nf 9 10 11 12\n");
    let toml = format!(
        "[material.floor]\nreflectance = 0.3\n[material.ceiling]\nreflectance = 0.7\n[material.wall]\n{wall}\n\
         [material.end]\nreflectance = 0.5\n[material.board]\nreflectance = 0.4\n\
         [[luminaire]]\nname = \"P\"\nposition = [1, 1.5, 2.45]\nopening = {{ rectangle = [0.6, 0.6] }}\nflux = 3000\n\
         group = \"row 1\"\narray = {{ count = [2, 1], pitch = [2, 0] }}\n\
         [[luminaire]]\nname = \"spot\"\nposition = [0.4, 0.5, 1.5]\nopening = \"point\"\nflux = 800\n{extra}\
         [[luminaire]]\nname = \"washer\"\nposition = [3.9, 1.5, 1.6]\naim = [-1, 0, 0]\nopening = {{ disc = 0.3 }}\n\
         flux = 1500\n\
         [[plane]]\nname = \"floor\"\ncorner = [0,0,0]\nalong = [4,0,0]\nacross = [0,3,0]\ncells = [40,30]\n\
         on = \"surface\"\n{}{}{}",
        sensor("desk", [1.2, 1.5, 0.75], [0.0, 0.0, 1.0]),
        sensor("far desk", [3.2, 2.2, 0.75], [0.0, 0.0, 1.0]),
        sensor("eye", [2.6, 0.6, 1.2], [0.0, 1.0, 0.0]),
    );
    scene(test, &toml, &mesh)
}

fn grey(test: &str) -> Scene {
    office(test, "reflectance = 0.5", "")
}

fn coloured(test: &str) -> Scene {
    office(test, "reflectance = [0.7, 0.3, 0.2]", "cct = 2700\n")
}

/// Its walls are mirrors as well: what they throw on the floor are caustics.
fn shiny(test: &str) -> Scene {
    office(test, "reflectance = 0.2\nspecular = 0.6", "")
}

fn settings(method: Method, passes: u32, groups: bool) -> Settings {
    Settings { photons: 100_000, stop: Stop::after(passes), seed: 11, groups, ..Settings::of(method) }
}

/// Largest difference between the sum of a map's groups and the map, in parts of what is added up.
fn gap(map: &IlluminanceMap) -> f64 {
    let off = |whole: f64, parts: Vec<f64>| {
        let size: f64 = parts.iter().map(|part| part.abs()).sum();
        if size > 0.0 { (parts.iter().sum::<f64>() - whole).abs() / size } else { whole.abs() }
    };
    let cells = 0..map.illuminance.len();
    let of_cell = |cell: usize| {
        let parts = map.groups.iter().map(|group| f64::from(group.illuminance[cell])).collect();
        let channel = |c: usize| {
            let parts = map.groups.iter().filter_map(|group| Some(f64::from(group.rgb.as_ref()?[cell][c]))).collect();
            map.rgb.as_ref().map_or(0.0, |rgb| off(rgb[cell][c], parts))
        };
        (0..3).map(channel).fold(off(map.illuminance[cell], parts), f64::max)
    };
    cells.map(of_cell).fold(0.0, f64::max)
}

/// Every method's groups add up to its whole, cell by cell and channel by channel, to single precision: each of the parts
/// is rounded to 6·10⁻⁸ of itself when it is added up from its samples, smoothed, and written. Mirrors, colours and fits beside the
/// board included.
#[test]
fn groups_add_up_to_the_whole() {
    for (scene, names) in [(grey("sum_grey"), 3), (coloured("sum_coloured"), 3), (shiny("sum_shiny"), 3)] {
        for method in METHODS {
            let results = run_with(&scene, method, &settings(method, 2, true));
            assert_eq!(results.run.groups.len(), names);
            assert_eq!(results.run.groups, ["row 1", "spot", "washer"]);
            let found = gap(&results.maps[0]);
            println!("{}: {} gap {found:.2e}", scene.name, method.name());
            assert!(found < 1e-6, "{}: {found}", method.name());
            for sensor in &results.sensors {
                let sum: f64 = sensor.groups.iter().map(|group| group.illuminance).sum();
                assert!((sum / sensor.illuminance - 1.0).abs() < 1e-6, "{}: {sum}, {sensor:?}", method.name());
            }
        }
    }
}

fn bits(results: &Results) -> Vec<u64> {
    let maps = results.maps.iter().flat_map(|map| map.illuminance.iter().chain(&map.standard_error));
    let sensors = results.sensors.iter().flat_map(|sensor| [&sensor.illuminance, &sensor.standard_error]);
    maps.chain(sensors).map(|value| value.to_bits()).collect()
}

fn group_bits(results: &Results) -> Vec<u64> {
    let of_map = |map: &IlluminanceMap| -> Vec<u64> {
        let groups = map.groups.iter().flat_map(|group| group.illuminance.iter().map(|lux| u64::from(lux.to_bits())));
        groups.collect()
    };
    let of_sensors = results.sensors.iter().flat_map(|sensor| &sensor.groups);
    let of_sensors = of_sensors.flat_map(|group| [group.illuminance.to_bits(), group.standard_error.to_bits()]);
    results.maps.iter().flat_map(of_map).chain(of_sensors).collect()
}

/// Who asks for groups gets the same whole, to the bit, by the same photons and rays.
#[test]
fn groups_change_nothing_and_trace_nothing_more() {
    for (scene, method) in [grey("same_grey"), shiny("same_shiny"), coloured("same_coloured")]
        .iter()
        .flat_map(|scene| METHODS.map(|method| (scene, method)))
    {
        let [plain, groups] = [false, true].map(|groups| run_with(scene, method, &settings(method, 2, groups)));
        assert!(bits(&plain) == bits(&groups), "{}", method.name());
        let work = |results: &Results| (results.run.photon_rays, results.run.gather_rays, results.run.photons_stored);
        assert_eq!(work(&plain), work(&groups), "{}", method.name());
        assert!(plain.run.groups.is_empty() && plain.maps[0].groups.is_empty() && plain.sensors[0].groups.is_empty());
    }
}

/// The scene with the luminaires of one group only.
fn alone(scene: &Scene, group: &str) -> Scene {
    let mut alone = scene.clone();
    alone.luminaires.retain(|luminaire| luminaire.group == group);
    alone
}

/// Each group is what its luminaires bring by themselves. Sensors know their standard errors: from eight batches of rays or
/// from photons counted; Student's t with 7 degrees of freedom exceeds 7.1 once in 5,000, and there are 9 pairs of each. A map's mean is known
/// to what its photons scatter, N · share · ½ of which reach the floor: 4 standard errors of a difference.
#[test]
fn each_group_is_its_luminaires_alone() {
    for (scene, name) in [(grey("alone_grey"), "grey"), (coloured("alone_rgb"), "rgb"), (shiny("alone_shiny"), "shiny")]
    {
        for method in METHODS {
            let run = settings(method, if method == Method::Photons { 8 } else { 2 }, true);
            let all = run_with(&scene, method, &run);
            let flux: f64 = scene.luminaires.iter().map(|luminaire| luminaire.flux.0).sum();
            for (group, name_of_group) in all.run.groups.iter().enumerate() {
                let alone = alone(&scene, name_of_group);
                let share = alone.luminaires.iter().map(|luminaire| luminaire.flux.0).sum::<f64>() / flux;
                let solo = run_with(&alone, method, &Settings { seed: 12, groups: false, ..run.clone() });
                for (sensor, expected) in all.sensors.iter().zip(&solo.sensors) {
                    let found = sensor.groups[group];
                    let sigma = found.standard_error.hypot(expected.standard_error);
                    let off = (found.illuminance - expected.illuminance) / sigma;
                    println!(
                        "{name} {} {name_of_group} {}: {:.2} ± {:.2}, alone {:.2} ± {:.2}: {off:+.1} σ",
                        method.name(),
                        sensor.name,
                        found.illuminance,
                        found.standard_error,
                        expected.illuminance,
                        expected.standard_error
                    );
                    assert!(off.abs() < 7.1, "{name} {}: {found:?}, {expected:?}", method.name());
                }
                let [map, expected] = [&all, &solo].map(|results| &results.maps[0]);
                let [found, expected] = [map.groups[group].mean(&map.has_value), crate::common::mean(expected)];
                let photons = 1e5 * f64::from(run.stop.passes().unwrap_or(1));
                let bound = 4.0 * ((1.0 + 1.0 / share) / (0.5 * photons)).sqrt();
                crate::common::assert_close(
                    &format!("{name} {} {name_of_group}", method.name()),
                    found,
                    expected,
                    bound,
                );
            }
        }
    }
}

/// Direct light is exact, so a group's is that of its luminaires alone at every cell, but for what weak luminaires may be left
/// out for: 10⁻⁴ of the whole.
#[test]
fn direct_light_of_a_group_is_exact() {
    let mut scene = grey("direct");
    scene.materials.iter_mut().for_each(|material| material.reflectance = [0.0; 3]);
    let all = run_with(&scene, Method::Gather, &settings(Method::Gather, 1, true));
    assert_eq!(all.run.photons_emitted, 0);
    for (group, name) in all.run.groups.iter().enumerate() {
        let solo = run_with(&alone(&scene, name), Method::Gather, &settings(Method::Gather, 1, false));
        for (cell, whole) in all.maps[0].illuminance.iter().enumerate() {
            let [found, expected] =
                [f64::from(all.maps[0].groups[group].illuminance[cell]), solo.maps[0].illuminance[cell]];
            assert!((found - expected).abs() <= 1.1e-4 * whole, "{name}, cell {cell}: {found}, expected {expected}");
        }
        for (sensor, expected) in all.sensors.iter().zip(&solo.sensors) {
            let off = sensor.groups[group].illuminance - expected.illuminance;
            assert!(off.abs() <= 1.1e-4 * sensor.illuminance, "{name}: {sensor:?}");
        }
    }
}

/// Standard errors of groups are honest: over 40 seeds the errors of three sensors' groups have mean squares of σ² within
/// a fifth of one. Each of 360 squares has the relative variance 2 + 6/3 of Student's t² with 7 degrees of freedom, and three
/// in a run have photons in common: σ of the mean is at most √(4 · 3/360) = 0.18; the bound is 3 of these.
#[test]
fn errors_of_groups_are_honest() {
    let mut scene = grey("honest");
    scene.planes.clear();
    let runs: Vec<Results> = (0..40)
        .map(|seed| {
            run_with(&scene, Method::Gather, &Settings { photons: 20_000, seed, ..settings(Method::Gather, 2, true) })
        })
        .collect();
    let (mut square, mut count) = (0.0, 0.0);
    for (sensor, group) in (0..3).flat_map(|sensor| (0..3).map(move |group| (sensor, group))) {
        let readings: Vec<_> = runs.iter().map(|run| run.sensors[sensor].groups[group]).collect();
        let mean = readings.iter().map(|reading| reading.illuminance).sum::<f64>() / 40.0;
        for reading in readings {
            // 40/39: the mean was taken from the same numbers. 7/5: mean of the square of Student's t.
            square +=
                (reading.illuminance - mean).powi(2) / reading.standard_error.powi(2) * (40.0 / 39.0) * (5.0 / 7.0);
            count += 1.0;
        }
    }
    let found = square / count;
    println!("mean of (error / σ)²: {found:.3}, expected 1");
    assert!((found - 1.0).abs() < 3.0 * 0.18, "{found}");
}

/// One group is the whole: asking for it costs nothing and changes nothing.
#[test]
fn one_group_costs_nothing() {
    let scene = shipped("box.toml");
    let [plain, asked] = [false, true]
        .map(|groups| run_with(&scene, Method::Gather, &Settings { groups, ..settings(Method::Gather, 1, false) }));
    assert!(bits(&plain) == bits(&asked));
    assert_eq!(plain.run.gather_rays, asked.run.gather_rays);
    assert!(asked.run.groups.is_empty() && asked.maps[0].groups.is_empty());
    let mut wished = scene.clone();
    wished.render.groups = Some(true);
    let plan = Plan::new(&wished, Method::Gather).to_string();
    assert!(plan.contains("left out light groups") && plan.contains("one group only"), "{plan}");
}

#[test]
fn groups_have_the_same_bits_on_any_number_of_threads() {
    let scene = shiny("threads");
    for method in METHODS {
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
            pool.install(|| group_bits(&run_with(&scene, method, &settings(method, 2, true))))
        };
        assert!(on(1) == on(2), "{}", method.name());
    }
}

/// The paper's estimator knows no groups, and says so.
#[test]
fn the_papers_estimator_refuses_groups() {
    let scene = grey("refused");
    let refused = render(&scene, &Plan::new(&scene, Method::Seed), &settings(Method::Seed, 1, true), &());
    let message = refused.expect_err("no groups").to_string();
    assert!(message.starts_with("groups: found method seed, expected gather, split, path or photons"), "{message}");
}

/// More groups at more points than memory can hold are refused before anything is computed.
#[test]
fn too_many_groups_are_refused() {
    let mut scene = grey("too_many");
    scene.planes[0].cells = [5000, 5000];
    let lamp = scene.luminaires[0].clone();
    scene.luminaires = (0..20).map(|number| Luminaire { group: format!("lamp {number}"), ..lamp.clone() }).collect();
    let plan = Plan::new(&scene, Method::Gather);
    let message = render(&scene, &plan, &settings(Method::Gather, 1, true), &()).expect_err("too much").to_string();
    assert!(message.contains("20 light groups at 25000003 points") && message.contains("at most 4 GB"), "{message}");
}

/// Layers of the EXR file have names any program can read, each once; the file tells what they stand for, and CSV and JSON have the
/// names as they are.
#[test]
fn files_name_the_groups() {
    let names: Vec<String> =
        ["L[1,1]", "L[1,2]", "Büro.1", "Büro 1", "row 1", "灯", "Row-1", "row_1"].map(String::from).into();
    let layers = group_layers(&names);
    assert_eq!(layers, ["L_1_1", "L_1_2", "B_ro_1", "B_ro_1-2", "row_1", "group", "Row-1", "row_1-2"]);

    let mut scene = coloured("files");
    scene.luminaires[2].group = "spot[1].é".into();
    let folder = crate::common::folder("files").join("out");
    let results = run_with(&scene, Method::Gather, &settings(Method::Gather, 1, true));
    write(&results, &folder, &ExtraLayers::default()).expect("written");
    let image = exr::prelude::read_first_flat_layer_from_file(folder.join("floor.exr")).expect("an EXR file");
    let channels: Vec<String> =
        image.layer_data.channel_data.list.iter().map(|channel| channel.name.to_string()).collect();
    let of_group = |name: &str| ["B", "G", "R"].map(|channel| format!("group.{name}.{channel}"));
    let expected = [["B", "G", "R"].map(String::from), of_group("row_1"), of_group("spot_1"), of_group("washer")];
    assert_eq!(channels, expected.concat());
    let values = |name: &str| -> Vec<f32> {
        let channel = image.layer_data.channel_data.list.iter().find(|channel| channel.name == *name);
        channel.expect("the channel").sample_data.values_as_f32().collect()
    };
    let parts = ["group.row_1.G", "group.spot_1.G", "group.washer.G"].map(values);
    for (cell, whole) in values("G").iter().enumerate() {
        let sum: f32 = parts.iter().map(|part| part[cell]).sum();
        assert!((sum - whole).abs() <= 1e-6 * whole.abs(), "{sum}, expected {whole}");
    }
    let names =
        &image.layer_data.attributes.other.iter().find(|(name, _)| **name == *"groups").expect("an attribute").1;
    let names = names.to_text().expect("text").to_string();
    let read: serde_json::Value = serde_json::from_str(&names).unwrap_or_else(|error| panic!("{error}: {names}"));
    assert_eq!(read["row_1"], "row 1");

    let table = std::fs::read_to_string(folder.join("groups.csv")).expect("groups.csv");
    assert!(table.starts_with("sensor,group,E_lx,standard_error_lx\ndesk,row 1,"), "{table}");
    assert_eq!(table.lines().count(), 1 + 3 * 3);
    let summary = std::fs::read_to_string(folder.join("summary.json")).expect("summary.json");
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    assert_eq!(summary["planes"][0]["groups"][1]["name"], "spot[1].é");
    let shares: f64 = (0..3).filter_map(|g| summary["planes"][0]["groups"][g]["share"].as_f64()).sum();
    assert!((shares - 1.0).abs() < 1e-6, "{shares}");
    assert_eq!(summary["sensors"][2]["groups"].as_array().map(Vec::len), Some(3));
    let report = std::fs::read_to_string(folder.join("report.html")).expect("report.html");
    assert!(report.contains("Light groups") && report.contains("spot[1].é"));
}
