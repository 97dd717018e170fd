//! What is written reads back, whatever the map; nothing leaves its folder or stays half-written.

use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

use glam::DVec3;

use super::*;
use crate::error::invalid;
use crate::files;
use crate::gather::reach::Standing;
use crate::results::*;
use crate::scene::Measure;
use crate::units::Lumens;
use crate::units::Lux;
use crate::units::luminance;
use glam::dvec3;

/// A map with a value for each (column, row), NaN for none; cells of 0.1 m × 0.2 m.
fn map(name: &str, cells: [usize; 2], value: impl Fn(usize, usize) -> f64) -> IlluminanceMap {
    let values: Vec<f64> = (0..cells[0] * cells[1]).map(|i| value(i % cells[0], i / cells[0])).collect();
    let known = |e: &f64| if e.is_nan() { 0.0 } else { *e };
    IlluminanceMap {
        name: name.into(),
        corner: dvec3(1.0, 2.0, 0.75),
        along: dvec3(0.1 * cells[0] as f64, 0.0, 0.0),
        across: dvec3(0.0, 0.2 * cells[1] as f64, 0.0),
        cells,
        illuminance: values.iter().map(known).collect(),
        rgb: None,
        direct: None,
        standard_error: values.iter().map(|e| 0.01 * known(e)).collect(),
        has_value: values.iter().map(|e| !e.is_nan()).collect(),
        standing: Vec::new(),
        outlines: vec![vec![[0.0, 0.0], [0.1, 0.0], [0.1, 0.1]]],
        groups: Vec::new(),
        extremes: None,
        areas: vec![],
    }
}

fn run() -> Run {
    Run {
        scene: "Büro <1> 事務所".into(),
        scene_hash: "9f86d081884c7d65".into(),
        method: "split".into(),
        photons_emitted: 5_000_000_000,
        passes: 2,
        seconds: vec![("trace", 1.5), ("gather", 0.5)],
        total_seconds: 2.1,
        flux: FluxBalance {
            emitted: Lumens(1000.0),
            absorbed: Lumens(990.0),
            escaped: Lumens(9.0),
            cut_off: Lumens(1.0),
        },
        warnings: vec!["a <b> & \"c\"".into()],
        ..Run::default()
    }
}

fn sensor(target: Option<f64>, has_value: bool) -> SensorReading {
    SensorReading {
        name: "desk, left".into(),
        position: dvec3(1.0e6 + 0.1, 0.2, 0.75),
        normal: DVec3::Z,
        measure: Measure::Plane,
        illuminance: 499.9,
        rgb: None,
        standard_error: 1.25,
        target,
        daylight: 0.0,
        has_value,
        standing: if has_value { Standing::Place } else { Standing::Dark },
        groups: Vec::new(),
    }
}

/// A new empty folder that is removed at the end of a test.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("luxmap-report-{}-{number}", std::process::id()));
        std::fs::create_dir(&path).unwrap();
        Self(path)
    }

    fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.0).unwrap();
        let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Writes a map as EXR and reads it back with its channels: names and values in the image's order of rows.
fn through_exr(map: &IlluminanceMap, layers: &ExtraLayers) -> (exr::IlluminanceImage, Vec<(String, Vec<f32>)>) {
    let folder = Folder::new();
    let path = folder.0.join("map.exr");
    files::write_whole(&path, &mut |out| exr::write(map, &run(), layers, out)).unwrap();
    let image = ::exr::prelude::read_first_flat_layer_from_file(&path).unwrap();
    let channels = image.layer_data.channel_data.list.iter();
    let channels = channels.map(|channel| (channel.name.to_string(), channel.sample_data.values_as_f32().collect()));
    (exr::read(&path).unwrap(), channels.collect())
}

#[test]
fn figures_of_a_known_map() {
    let found = statistics(&map("m", [5, 1], |x, _| [100.0, 400.0, 200.0, f64::NAN, 300.0][x]));
    assert_eq!((found.cells, found.cells_without_value), (4, 1));
    assert_eq!((found.mean, found.min, found.max, found.median), (Lux(250.0), Lux(100.0), Lux(400.0), Lux(250.0)));
    assert_eq!((found.uniformity, found.diversity), (0.4, 0.25));
    assert_eq!(found.deviation, Lux(12500f64.sqrt()));
    assert_eq!((found.mean_standard_error, found.largest_standard_error), (Lux(2.5), Lux(4.0)));
    assert_eq!(found.relative_error(), 0.01);
    assert_eq!(statistics(&map("m", [3, 1], |x, _| [3.0, 1.0, 2.0][x])).median, Lux(2.0));
}

#[test]
fn a_map_without_values_or_light_has_figures_without_nan() {
    let none = statistics(&map("m", [2, 2], |_, _| f64::NAN));
    assert_eq!(none, Statistics { cells_without_value: 4, ..Statistics::default() });
    let dark = statistics(&map("m", [2, 2], |_, _| 0.0));
    assert_eq!((dark.uniformity, dark.diversity, dark.relative_error()), (0.0, 0.0, 0.0));
}

/// Every value keeps its 32 bits and its place, whatever the size: less than, equal to and more than a block of 16
/// rows.
#[test]
fn exr_reads_back_bit_by_bit() {
    for cells in [[1, 1], [3, 3], [33, 33], [1, 500], [500, 1], [16, 16], [17, 32]] {
        let map = map("m", cells, |x, y| (x as f64 + 1000.0 * y as f64).sqrt() + 0.1);
        let (read, channels) = through_exr(&map, &ExtraLayers::default());
        assert_eq!(read.cells, cells);
        assert!(read.has_value.iter().all(|&has_value| has_value));
        let bits = |values: &[f64]| values.iter().map(|&e| (e as f32).to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&read.illuminance), bits(&map.illuminance), "{cells:?}");
        assert_eq!(channels.len(), 1, "only Y");
    }
}

#[test]
fn the_first_image_row_is_the_far_end_of_across() {
    let (_, channels) = through_exr(&map("m", [2, 3], |x, y| (10 * y + x) as f64), &ExtraLayers::default());
    assert_eq!(channels, [("Y".to_owned(), vec![20.0, 21.0, 10.0, 11.0, 0.0, 1.0])]);
}

#[test]
fn exr_marks_cells_without_value_and_holds_the_layers_asked_for() {
    let mut map = map("m", [2, 1], |x, _| [80.0, f64::NAN][x]);
    map.illuminance[1] = 7.0; // what stands in a cell without value doesn't matter
    map.standard_error[1] = f64::NAN;
    map.direct = Some(vec![60.0, f64::INFINITY]);
    let (read, channels) = through_exr(&map, &ExtraLayers { direct: true, indirect: true, standard_error: true });
    assert_eq!((read.has_value, read.illuminance), (vec![true, false], vec![80.0, 0.0]));
    let expected = [("A", 1.0), ("Y", 80.0), ("direct.Y", 60.0), ("indirect.Y", 20.0), ("stderr.Y", 0.8)];
    assert_eq!(channels, expected.map(|(name, value)| (name.to_owned(), vec![value, 0.0])));
}

#[test]
fn a_coloured_map_has_three_channels_and_reads_back_as_its_luminance() {
    let rgb = [100.0, 200.0, 50.0];
    let mut map = map("m", [2, 2], |_, _| luminance(rgb));
    map.rgb = Some(vec![rgb; 4]);
    let (read, channels) = through_exr(&map, &ExtraLayers { standard_error: true, ..ExtraLayers::default() });
    let names: Vec<_> = channels.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["B", "G", "R", "stderr.Y"]);
    assert!(read.illuminance.iter().all(|&e| (e - luminance(rgb)).abs() < 1e-9));
}

#[test]
fn exr_says_what_it_holds() {
    let folder = Folder::new();
    let path = folder.0.join("map.exr");
    files::write_whole(&path, &mut |out| {
        exr::write(&map("m", [4, 4], |_, _| 1.0), &run(), &ExtraLayers::default(), out)
    })
    .unwrap();
    let image = ::exr::prelude::read_first_flat_layer_from_file(&path).unwrap();
    let layer = &image.layer_data.attributes;
    let all = layer.other.iter().chain(&image.attributes.other);
    let find = |name: &str| all.clone().find(|(key, _)| **key == *name).map(|(_, value)| value.clone()).unwrap();
    assert_eq!(find("unit").to_text().unwrap(), "lx");
    assert_eq!(find("scene").to_text().unwrap().as_slice(), run().scene.as_bytes());
    assert_eq!(find("corner").to_text().unwrap(), "1 2 0.75");
    assert_eq!(find("photons"), ::exr::prelude::AttributeValue::F64(5e9));
    assert_eq!(image.attributes.pixel_aspect, 0.5);
    assert_eq!(image.layer_data.encoding.compression, ::exr::prelude::Compression::ZIP16);
}

#[test]
fn a_value_that_is_not_finite_is_refused_by_name_and_leaves_nothing() {
    for bad in [f64::NAN, f64::INFINITY, 1e39] {
        let folder = Folder::new();
        let mut map = map("floor", [3, 2], |_, _| 1.0);
        map.illuminance[4] = bad;
        let results = Results { run: run(), maps: vec![map], sensors: vec![], surfaces: vec![], images: vec![] };
        let message = write(&results, &folder.0, &ExtraLayers::default()).unwrap_err().to_string();
        assert!(message.contains("E of cell 1, row 1 of \"floor\""), "{message}");
        assert!(folder.names().is_empty());
    }
}

#[test]
fn an_exr_without_illuminance_is_refused_with_what_it_holds() {
    let folder = Folder::new();
    let path = folder.0.join("depth.exr");
    let channels = ::exr::prelude::SpecificChannels::build().with_channel("Z").with_pixel_fn(|_| (1.0f32,));
    ::exr::prelude::WritableImage::write(&::exr::prelude::Image::from_channels((2, 2), channels))
        .to_file(&path)
        .unwrap();
    let message = exr::read(&path).unwrap_err().to_string();
    assert!(message.ends_with("found channels \"Z\", expected a channel Y or channels R, G, B, in lx"), "{message}");
    std::fs::write(&path, "no image").unwrap();
    assert!(matches!(exr::read(&path), Err(Error::Input(_))));
}

#[test]
fn any_map_becomes_a_readable_picture() {
    let maps = [
        map("constant", [20, 10], |_, _| 500.0),
        map("dark", [40, 40], |_, _| 0.0),
        map("one", [1, 1], |_, _| 321.0),
        map("thin", [1, 500], |_, y| y as f64),
        map("long", [3000, 20], |x, y| (x + y) as f64),
        map("huge", [33, 33], |x, y| 1e9 * (x * y) as f64),
        map("tiny", [33, 33], |x, y| 1e-9 * (x * y) as f64),
        map("nothing", [9, 9], |_, _| f64::NAN),
        map("gaps", [30, 30], |x, y| if (x / 3 + y / 5) % 2 == 0 { f64::NAN } else { (x + y) as f64 }),
        map("noise", [60, 60], |x, y| ((x * 7919 + y * 104_729) % 101) as f64),
        map("largest", [4, 4], |x, _| [0.0, f64::from(f32::MAX), 1e-40, 1.0][x]),
        map(&"a long name ".repeat(40), [2, 2], |_, _| 1.0),
        IlluminanceMap { along: DVec3::ZERO, across: DVec3::ZERO, ..map("no extent", [2, 2], |x, _| x as f64) },
    ];
    for map in &maps {
        let picture = png::picture(map, &run()).unwrap();
        let decoder = ::png::Decoder::new(std::io::Cursor::new(&picture));
        let info = decoder.read_info().unwrap().info().size();
        assert!((600..2000).contains(&info.0.max(info.1)), "{}: {info:?}", map.name);
        assert_eq!(picture, png::picture(map, &run()).unwrap(), "{}: the same each time", map.name);
    }
}

#[test]
fn csv_reads_back_with_world_positions_and_empty_cells() {
    let mut text = Vec::new();
    csv::write_plane(&map("m", [2, 2], |x, y| [[123.456_789, f64::NAN], [1e9, 1e-6]][y][x]), &mut text).unwrap();
    let text = String::from_utf8(text).unwrap();
    let expected = "x_m,y_m,z_m,E_lx,standard_error_lx\n1.05,2.1,0.75,123.457,1.23457\n1.15,2.1,0.75,,\n\
                    1.05,2.3,0.75,1000000000,10000000\n1.15,2.3,0.75,0.000001,0.00000001\n";
    assert_eq!(text, expected);
    let mut table = ::csv::Reader::from_reader(text.as_bytes());
    let second: [Option<f64>; 5] = table.deserialize().nth(1).unwrap().unwrap();
    assert_eq!(second, [Some(1.15), Some(2.1), Some(0.75), None, None]);
}

#[test]
fn sensors_read_back_with_their_names() {
    let mut text = Vec::new();
    csv::write_sensors(&[sensor(Some(500.0), true), sensor(None, false)], &mut text).unwrap();
    let expected = "name,x_m,y_m,z_m,E_lx,standard_error_lx,target_lx\n\
                    \"desk, left\",1000000.1,0.2,0.75,499.9,1.25,500\n\"desk, left\",1000000.1,0.2,0.75,,,\n";
    assert_eq!(String::from_utf8(text).unwrap(), expected);
}

#[test]
fn a_sensor_in_the_dark_misses_its_target() {
    // 499.9 ± 1.25 lx: 1.645 σ are 2.06 lx.
    let judged = |target, has_value| sensor(target, has_value).verdict(0.01);
    assert_eq!(judged(None, true), None);
    assert_eq!(judged(Some(497.8), true), Some(Verdict::Met));
    assert_eq!(judged(Some(499.0), true), Some(Verdict::Undecided { needs: Some(0.43) }));
    assert_eq!(judged(Some(502.0), true), Some(Verdict::Missed));
    assert_eq!(judged(Some(100.0), false), Some(Verdict::Missed));
}

#[test]
fn the_summary_is_json_with_units_in_its_keys_and_null_for_nothing() {
    let maps = vec![map("floor", [2, 1], |x, _| [100.0, 300.0][x]), map("none", [1, 1], |_, _| f64::NAN)];
    let results = Results {
        run: run(),
        maps,
        sensors: vec![sensor(Some(500.0), true), sensor(None, false)],
        surfaces: vec![],
        images: vec![],
    };
    let text = json::summary(&results);
    let summary: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(summary["planes"][0]["mean_lx"], 200.0);
    assert_eq!(summary["planes"][0]["uniformity_u0"], 0.5);
    assert!(summary["planes"][1]["mean_lx"].is_null());
    assert_eq!(summary["sensors"][0]["target_met"], false);
    assert!(summary["sensors"][1]["illuminance_lx"].is_null());
    assert_eq!(summary["flux"]["absorbed_lm"], 990.0);
    assert_eq!(summary["stages"][0]["name"], "trace");
    assert!(text.find("\"luxmap\"") < text.find("\"planes\"") && text.find("\"planes\"") < text.find("\"warnings\""));
}

#[test]
fn the_table_aligns_and_balances() {
    let maps = vec![map("floor", [2, 1], |x, _| [100.0, 300.0][x]), map("dark room", [1, 1], |_, _| f64::NAN)];
    let results =
        Results { run: run(), maps, sensors: vec![sensor(Some(500.0), true)], surfaces: vec![], images: vec![] };
    let text = table::table(&results);
    // Cells without anything further known: U₀ = 0.5 errs by √(0.01² + 0.01²) of itself.
    let head = concat!(
        "plane            Ē, lx    E_min, lx    E_max, lx            ",
        "   U₀              U_d  mean σ, lx  mean σ, %  cells"
    );
    let floor = concat!(
        "floor      200.0 ± 2.0  100.0 ± 1.0  300.0 ± 3.0  0.5000 ± 0",
        ".0071  0.3333 ± 0.0047           2          1  2 × 1"
    );
    assert!(text.contains(&format!("\n{head}\n{floor}\n")), "{text}");
    let balance = "flux  emitted 1000 lm = absorbed 990 lm (99 %) + escaped 9 lm (0.9 %) + cut off 1 lm (0.1 %)";
    assert!(text.contains(balance), "{text}");
    assert!(text.contains("missed") && text.contains("time  trace 1.5 s, gather 500 ms; 2.1 s in all"), "{text}");
}

#[test]
fn the_page_needs_nothing_else_and_shows_names_as_they_are() {
    let maps = vec![map("<script>alert(1)</script>", [3, 3], |x, _| x as f64)];
    let results =
        Results { run: run(), maps, sensors: vec![sensor(Some(500.0), true)], surfaces: vec![], images: vec![] };
    let page = html::report(&results, &[b"png".to_vec()]);
    assert!(!page.contains("<script") && page.contains("&lt;script&gt;"));
    assert!(!page.contains("http:") && !page.contains("https:"));
    assert!(page.contains("data:image/png;base64,cG5n") && page.contains("missed"));
    assert!(!page.contains("NaN"));
}

#[test]
fn everything_is_written_under_safe_names_and_nothing_else() {
    let folder = Folder::new();
    let inner = folder.0.join("made/on the way");
    let maps = ["../x", "x", "sensors"].map(|name| map(name, [3, 3], |x, y| (x + y) as f64)).to_vec();
    let results = Results { run: run(), maps, sensors: vec![sensor(None, true)], surfaces: vec![], images: vec![] };
    let written = write(&results, &inner, &ExtraLayers::default()).unwrap();
    assert_eq!(write(&results, &inner, &ExtraLayers::default()).unwrap(), written, "again, over the old files");
    let mut names: Vec<_> = written.iter().map(|path| path.file_name().unwrap().to_str().unwrap().to_owned()).collect();
    names.sort();
    assert_eq!(names.len(), 3 * 3 + 3);
    assert!(written.iter().all(|path| path.parent() == Some(Path::new(&inner))));
    assert_eq!(Folder(inner).names(), names);
}

#[test]
fn a_folder_that_cannot_be_made_is_named() {
    let folder = Folder::new();
    let file = folder.0.join("file");
    std::fs::write(&file, "").unwrap();
    let results = Results { run: run(), maps: vec![], sensors: vec![], surfaces: vec![], images: vec![] };
    let error = write(&results, &file.join("out"), &ExtraLayers::default()).unwrap_err();
    assert!(matches!(error, Error::Write { path, .. } if path == file.join("out")));
}

#[test]
fn a_failed_write_leaves_the_old_file_and_no_other() {
    let folder = Folder::new();
    let path = folder.0.join("summary.json");
    std::fs::write(&path, "old").unwrap();
    let failure = files::write_whole(&path, &mut |out| {
        out.write_all(b"half")?;
        Err(invalid("the disc is full".into()))
    });
    assert!(failure.unwrap_err().to_string().contains("the disc is full"));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
    assert_eq!(folder.names(), ["summary.json"]);
}

/// The image of a camera: `columns` × `rows` pixels, each value its pixel's number plus a layer's own; `channels` of
/// light.
fn view(channels: usize) -> CameraImage {
    let [columns, rows] = [5, 3];
    let layer = |channels: usize, first: f32| {
        Layer((0..channels).map(|c| (0..15).map(|pixel| first + c as f32 * 100.0 + pixel as f32).collect()).collect())
    };
    CameraImage {
        name: "view".into(),
        eye: DVec3::new(0.3, 0.25, 1.6),
        forward: DVec3::Y,
        up: DVec3::Z,
        fov: 60.0,
        screen_width: 1.9,
        pixels: [columns, rows],
        samples: 32,
        claim: 0.05,
        illuminance: layer(channels, 1000.0),
        direct: layer(channels, 600.0),
        indirect: layer(channels, 400.0),
        luminance: layer(channels, 50.0),
        standard_error: vec![3.0; 15],
        luminance_standard_error: vec![0.2; 15],
        albedo: layer(channels, 0.0),
        normal: layer(3, 0.0),
        depth: vec![2.0; 15],
        position: layer(3, 7.0),
        position_origin: DVec3::new(2.6e6, 1.2e6, 0.0),
        coverage: vec![1.0; 15],
    }
}

/// Single part, first row on top, windows that begin at (0, 0), square pixels, primaries of Rec. 709, channels as
/// `layer.channel`: what compositors ask for. Each channel keeps its bits.
#[test]
fn an_image_for_compositing_has_every_layer_and_says_how_it_was_taken() {
    let light = |layer: &str, channels: usize| -> Vec<String> {
        let names: &[&str] = if channels == 1 { &["Y"] } else { &["B", "G", "R"] };
        let dot = if layer.is_empty() { "" } else { "." };
        names.iter().map(|name| format!("{layer}{dot}{name}")).collect()
    };
    for channels in [1, 3] {
        let (folder, image) = (Folder::new(), view(channels));
        let path = folder.0.join("view.exr");
        files::write_whole(&path, &mut |out| exr::write_view(&image, &run(), out)).unwrap();
        let read = ::exr::prelude::read_first_flat_layer_from_file(&path).unwrap();
        let found = &read.layer_data.channel_data.list;
        let mut expected: Vec<String> = ["", "direct", "indirect", "luminance", "albedo"]
            .iter()
            .flat_map(|layer| light(layer, channels))
            .chain(
                ["A", "Z", "stderr.Y", "luminance_stderr.Y", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z"]
                    .map(String::from),
            )
            .collect();
        expected.sort();
        assert_eq!(found.iter().map(|channel| channel.name.to_string()).collect::<Vec<_>>(), expected);
        let values = |name: &str| -> Vec<f32> {
            let channel = found.iter().find(|channel| channel.name == *name).expect(name);
            channel.sample_data.values_as_f32().collect()
        };
        assert_eq!(values("P.Z"), image.position.0[2]);
        assert_eq!(values(&light("luminance", channels)[0]), *image.luminance.0.last().unwrap());
        let attributes = &read.attributes;
        assert_eq!(attributes.display_window.size, ::exr::prelude::Vec2(5, 3));
        assert_eq!(attributes.display_window.position, ::exr::prelude::Vec2(0, 0));
        assert_eq!(read.layer_data.attributes.layer_position, ::exr::prelude::Vec2(0, 0));
        assert_eq!((attributes.pixel_aspect, read.layer_data.attributes.screen_window_width), (1.0, 1.9));
        assert_eq!(attributes.chromaticities.unwrap().red, ::exr::prelude::Vec2(0.64, 0.33));
        let origin = read.layer_data.attributes.other.iter().find(|(key, _)| **key == *"positionOrigin");
        assert_eq!(origin.unwrap().1.to_text().unwrap(), "2600000 1200000 0");
    }
}

#[test]
fn an_image_with_a_value_that_is_not_finite_is_refused_by_layer_and_pixel() {
    let mut image = view(1);
    image.luminance.0[0][7] = f32::NAN;
    let error = exr::write_view(&image, &run(), &mut std::io::Cursor::new(Vec::new())).unwrap_err();
    assert_eq!(error.to_string(), "luminance of pixel 2, row 1 of \"view\" is NaN, expected a finite number");
    image.luminance.0[0].pop();
    assert!(png::tone_mapped(&image).unwrap_err().to_string().contains("incomplete"));
}

/// Reinhard's operator: the log-average luminance L̄ is shown at 0.18 (1 + 0.18/W²)/1.18 of white, the brightest at
/// white, nothing at black; W = 0.18 · 1600/L̄.
#[test]
fn the_tone_mapped_picture_shows_middle_grey_and_white_where_reinhard_puts_them() {
    let mut image = view(1);
    image.luminance.0[0] = vec![100.0; 15];
    (image.luminance.0[0][0], image.luminance.0[0][1], image.luminance.0[0][2]) = (0.0, 1600.0, 6.25);
    let file = png::tone_mapped(&image).unwrap();
    let mut reader = ::png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!([info.width, info.height], [5, 3]);
    let white: f64 = 0.18 * 16.0;
    let grey = 0.18 * (1.0 + 0.18 / (white * white)) / 1.18;
    let code = (255.0 * (1.055 * grey.powf(1.0 / 2.4) - 0.055)).round() as u8;
    assert_eq!((pixels[0], pixels[3], pixels[9]), (0, 255, code));
}

#[test]
fn cameras_have_three_files_each_and_stand_in_every_summary() {
    let folder = Folder::new();
    let maps = vec![map("view-lux", [3, 3], |x, y| (x + y) as f64)];
    let results = Results { run: run(), maps, sensors: vec![], surfaces: vec![], images: vec![view(3)] };
    write(&results, &folder.0, &ExtraLayers::default()).unwrap();
    let names = folder.names();
    assert!(
        ["view-2.exr", "view-2.png", "view-2-lux.png"].iter().all(|name| names.iter().any(|n| n == name)),
        "{names:?}"
    );
    let summary: serde_json::Value = serde_json::from_str(&json::summary(&results)).unwrap();
    assert_eq!(summary["cameras"][0]["rays_per_pixel"], 32);
    assert_eq!(summary["cameras"][0]["pixels"][0], 5);
    assert!(table::table(&results).contains("5 × 3"));
    assert!(html::report(&results, &[vec![1], vec![2], vec![3]]).matches("<img").count() == 3);
}
