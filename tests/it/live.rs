//! The live page, in the browser it is made for: what a person moves changes the map and the sensors to what Rust computes.
//!
//! Light is that of Lambertian point sources over a plane, E = I h² / (h² + r²)². Tests that need Chromium are left out by
//! `cargo test`; `make test-live` installs it where it may, and runs them.

use std::fs;
use std::path::{Path, PathBuf};

use luxmap::report::live::{LiveLamp, LiveSensor, MAP_ERROR, MOST_BYTES, Map, Page, SENSOR_ERROR};
use serde_json::{Value, json};

use crate::common::browser::Browser;

/// A desktop's window.
const WINDOW: [u32; 2] = [1280, 900];

/// Height of the luminaires, m.
const HEIGHT: f64 = 2.7;

/// A fresh folder for one test.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("live").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("the build folder can be written");
    folder
}

/// A scene of which everything is known: luminaires in rows, planes at two heights, sensors on the upper one.
struct Room {
    lamps: Vec<[f64; 2]>,
    intensity: f64,
    size: [f64; 2],
    cells: [usize; 2],
    sensors: Vec<[f64; 2]>,
}

impl Room {
    /// 15 luminaires over 6 m × 7.2 m in cells of 0.05 m, and six sensors.
    fn office() -> Self {
        let lamps = (0..15).map(|i| [1.0 + 2.0 * f64::from(i % 3), 0.8 + 1.4 * f64::from(i / 3)]).collect();
        let sensors = vec![[1.02, 1.37], [4.6, 1.1], [2.9, 3.3], [1.1, 5.2], [4.9, 4.6], [3.3, 6.6]];
        Self { lamps, intensity: 900.0, size: [6.0, 7.2], cells: [120, 144], sensors }
    }

    /// What luminaire `i` brings to a place at full output, lx.
    fn light(&self, i: usize, [x, y, z]: [f64; 3]) -> f64 {
        let [lx, ly] = self.lamps[i];
        let h2 = (HEIGHT - z).powi(2);
        self.intensity * h2 / (h2 + (x - lx).powi(2) + (y - ly).powi(2)).powi(2)
    }

    /// Light that does not dim: a window on the left.
    fn daylight([x, _, _]: [f64; 3]) -> f64 {
        60.0 * (-x / 1.5).exp()
    }

    /// Middle of a cell.
    fn place(&self, cell: usize, z: f64) -> [f64; 3] {
        let [columns, rows] = self.cells;
        let share = |i: usize, count: usize| (i as f64 + 0.5) / count as f64;
        [self.size[0] * share(cell % columns, columns), self.size[1] * share(cell / columns, rows), z]
    }

    fn map(&self, name: &str, z: f64, noise: f64) -> Map {
        let [columns, rows] = self.cells;
        let cells = columns * rows;
        let noisy = |i: usize, cell: usize| 1.0 + noise * scatter(i * cells + cell);
        let layer =
            |i: usize| (0..cells).map(|cell| (self.light(i, self.place(cell, z)) * noisy(i, cell)) as f32).collect();
        Map {
            name: name.into(),
            columns,
            rows,
            corner: [0.0, 0.0, z],
            along: [self.size[0], 0.0, 0.0],
            across: [0.0, self.size[1], 0.0],
            mask: vec![true; cells],
            layers: (0..self.lamps.len()).map(layer).collect(),
            offset: (0..cells).map(|cell| Self::daylight(self.place(cell, z)) as f32).collect(),
            error: vec![0.02; cells],
        }
    }

    fn page(&self, planes: &[(&str, f64)], noise: f64) -> Page<'static> {
        let lamp = |(i, &[x, y]): (usize, &[f64; 2])| LiveLamp {
            name: format!("L[{},{}]", i / 3 + 1, i % 3 + 1),
            group: format!("row {}", i / 3 + 1),
            outline: vec![[x - 0.3, y - 0.3], [x + 0.3, y - 0.3], [x + 0.3, y + 0.3], [x - 0.3, y + 0.3]],
            level: 1.0,
            least: 0.1,
            power: vec![[0.1, 6.0], [0.4, 15.0], [1.0, 38.0]],
            off: 0.5,
        };
        let sensor = |(j, &[x, y]): (usize, &[f64; 2])| LiveSensor {
            name: format!("desk {}", j + 1),
            position: [x, y, 0.75],
            plane: Some(0),
            influence: (0..self.lamps.len()).map(|i| self.light(i, [x, y, 0.75])).collect(),
            error: vec![0.0; self.lamps.len()],
            told: Vec::new(),
            noise: Some(0.0),
            offset: Self::daylight([x, y, 0.75]),
            target: Some([500.0, 300.0, 400.0, 250.0, 350.0, 450.0][j % 6]),
            tolerance: None,
        };
        Page {
            title: "Office & test <b>",
            about: "Closed forms.".into(),
            unit: "W",
            luminaires: self.lamps.iter().enumerate().map(lamp).collect(),
            planes: planes.iter().map(|&(name, z)| self.map(name, z, noise)).collect(),
            sensors: self.sensors.iter().enumerate().map(sensor).collect(),
            optimum: None,
            sigmas: 2.0,
        }
    }
}

/// A number between −1 and 1 that looks random (SplitMix64).
fn scatter(index: usize) -> f64 {
    let mut z = (index as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    2.0 * ((z ^ (z >> 31)) as f64 / u64::MAX as f64) - 1.0
}

/// Opens a page that was written to a file.
fn open(page: &Page<'_>, name: &str, size: [u32; 2]) -> (Browser, PathBuf) {
    let folder = folder(name);
    let file = folder.join("live.html");
    page.write(&file).expect("room for a page");
    (Browser::open(&file, &folder, size), folder)
}

/// What the map ought to show at these levels.
fn sum(map: &Map, levels: &[f64]) -> Vec<f64> {
    let mut sum: Vec<f64> = map.offset.iter().map(|&e| f64::from(e)).collect();
    for (layer, level) in map.layers.iter().zip(levels) {
        sum.iter_mut().zip(layer).for_each(|(sum, &e)| *sum += level * f64::from(e));
    }
    sum
}

fn reading(sensor: &LiveSensor, levels: &[f64]) -> f64 {
    sensor.offset + sensor.influence.iter().zip(levels).map(|(e, level)| e * level).sum::<f64>()
}

/// Checks levels, map, readings, power and figures on the screen against Rust; returns the levels.
fn check(browser: &mut Browser, page: &Page<'_>) -> Vec<f64> {
    browser.settle();
    let levels = browser.numbers("scene.levels");
    let plane = browser.evaluate("scene.planes.indexOf(plane)").as_u64().expect("a plane is shown") as usize;
    let expected = sum(&page.planes[plane], &levels);
    let found = browser.numbers("plane.sum");
    // Layers are single precision in the page; that is 3·10⁻⁸ of 1,000 lx each.
    for (cell, (found, expected)) in found.iter().zip(&expected).enumerate() {
        assert!((found - expected).abs() <= MAP_ERROR + 1e-3, "cell {cell} has {found} lx, not {expected}");
    }
    let shown =
        browser.evaluate("[...document.querySelectorAll('#sensors td:nth-child(2)')].map(td => td.textContent)");
    for (sensor, shown) in page.sensors.iter().zip(shown.as_array().expect("a list")) {
        let shown: f64 = shown.as_str().and_then(|lux| lux.parse().ok()).expect("a number");
        let expected = reading(sensor, &levels);
        assert!((shown - expected).abs() <= 0.5 + SENSOR_ERROR, "{} shows {shown} lx, not {expected}", sensor.name);
    }
    let mean = expected.iter().sum::<f64>() / expected.len() as f64;
    let shown = text(browser, "mean").trim_end_matches(" lx").parse::<f64>().expect("a number");
    assert!((shown - mean).abs() <= 0.5 + MAP_ERROR, "Ē shows {shown} lx, not {mean}");
    let watts: f64 = page.luminaires.iter().zip(&levels).map(|(lamp, &level)| power(lamp, level)).sum();
    let shown = text(browser, "watts").trim_end_matches(" W").parse::<f64>().expect("a number");
    assert!((shown - watts).abs() <= 0.5, "{shown} W shown, not {watts}");
    levels
}

/// Power of a luminaire, W.
fn power(lamp: &LiveLamp, level: f64) -> f64 {
    if level == 0.0 {
        return lamp.off;
    }
    let pair = lamp.power.windows(2).find(|pair| level <= pair[1][0]).expect("a level up to 1");
    let [[a, low], [b, high]] = [pair[0], pair[1]];
    low + (high - low) * (level - a) / (b - a)
}

fn text(browser: &mut Browser, id: &str) -> String {
    browser.evaluate(&format!("document.getElementById('{id}').textContent")).as_str().expect("text").to_owned()
}

/// A luminaire's slider and switch, as the page builds them.
fn slider(lamp: usize) -> String {
    format!("rows[{lamp}].slider")
}

#[test]
#[ignore = "needs Chromium: make test-live"]
fn what_is_moved_changes_map_and_sensors_to_what_rust_computes() {
    let room = Room::office();
    let page = room.page(&[("desk", 0.75), ("floor", 0.0)], 0.0);
    let (mut browser, folder) = open(&page, "moving", WINDOW);
    assert_eq!(check(&mut browser, &page), vec![1.0; 15]);

    // A slider, by mouse and by key.
    let at = browser.place(&slider(4), [0.3, 0.5]);
    browser.click_at(at);
    let levels = check(&mut browser, &page);
    assert!((levels[4] - 0.3).abs() < 0.06, "clicked at 30 %, level {}", levels[4]);
    browser.key("ArrowLeft");
    let after = check(&mut browser, &page);
    assert!((levels[4] - 0.01 - after[4]).abs() < 1e-9, "one key is 1 %: {} to {}", levels[4], after[4]);
    browser.key("Home");
    assert_eq!(check(&mut browser, &page)[4], 0.0);
    browser.key("ArrowRight");
    assert_eq!(check(&mut browser, &page)[4], 0.1, "the first step is the lowest level");

    // A switch there and back; a group; all of it back.
    browser.click("rows[0].toggle");
    assert_eq!(check(&mut browser, &page)[0], 0.0);
    browser.click("rows[0].toggle");
    assert_eq!(check(&mut browser, &page)[0], 1.0);
    let at = browser.place("groupRows[4].slider", [0.6, 0.5]);
    browser.click_at(at);
    let levels = check(&mut browser, &page);
    assert!(levels[12] < 0.7 && levels[12] > 0.5 && levels[12..].iter().all(|&level| level == levels[12]));
    browser.click("groupRows[4].toggle");
    assert_eq!(check(&mut browser, &page)[12..], [0.0; 3]);
    browser.click("document.getElementById('undo')");
    assert_eq!(check(&mut browser, &page), levels);

    // Keep proportions: twice the highest is twice of each.
    browser.evaluate("dim([[12, 0.2], [13, 0.4], [14, 0.3]])");
    browser.settle();
    browser.click("document.getElementById('proportions')");
    browser.evaluate("groupRows[4].slider.focus()");
    browser.key("End");
    browser.settle();
    let levels = check(&mut browser, &page);
    for (level, expected) in levels[12..].iter().zip([0.5, 1.0, 0.75]) {
        assert!((level - expected).abs() < 1e-9, "{level}, not {expected}");
    }

    // The other plane follows what happened before it was shown.
    browser.evaluate("document.activeElement.blur()");
    browser.key("p");
    browser.settle();
    assert_eq!(browser.evaluate("plane.name"), json!("floor"));
    check(&mut browser, &page);
    browser.key("p");

    // A luminaire clicked in the plan is chosen, clicked again switched.
    browser.settle();
    let lamp = "outlines[7].querySelector('.body')";
    let before = check(&mut browser, &page);
    browser.click(lamp);
    assert_eq!(browser.evaluate("chosen"), json!(7));
    assert_eq!(check(&mut browser, &page), before);
    browser.click(lamp);
    assert_eq!(check(&mut browser, &page)[7], 0.0);
    browser.screenshot(&folder.join("page.png"));
    finish(&browser);
}

/// No request but for the page itself, and no error.
fn finish(browser: &Browser) {
    let requests = browser.requests();
    assert!(requests.iter().any(|url| url.starts_with("file://")), "the page itself was asked for: {requests:?}");
    let own = |url: &String| url.starts_with("file://") && url.ends_with("/live.html");
    let inner = |url: &String| url.starts_with("data:") || url.starts_with("blob:");
    assert!(requests.iter().all(|url| own(url) || inner(url)), "asked for {requests:?}");
    assert!(browser.exceptions().is_empty(), "{:?}", browser.exceptions());
    assert!(browser.complaints().is_empty(), "{:?}", browser.complaints());
}

/// Colours on the canvas are those of the values, before and after a change.
#[test]
#[ignore = "needs Chromium: make test-live"]
fn the_canvas_shows_the_values() {
    let room = Room::office();
    let page = room.page(&[("desk", 0.75)], 0.0);
    let (mut browser, _) = open(&page, "colours", WINDOW);
    browser.click("document.getElementById('lines')");
    for levels in [[1.0; 15], std::array::from_fn(|i| if i % 2 == 0 { 0.3 } else { 0.9 })] {
        browser.evaluate(&format!("dim({:?}.map((level, i) => [i, level]))", levels));
        browser.settle();
        let values = sum(&page.planes[0], &levels);
        let top = browser.evaluate("scale.top").as_f64().expect("a number");
        for cell in [3 * 120 + 4, 70 * 120 + 61, 100 * 120 + 110, 143 * 120 + 119] {
            let [u, v] = [(cell % 120) as f64 + 0.5, (cell / 120) as f64 + 0.5];
            let pixel = browser.numbers(&format!(
                "(([x, y]) => canvas.getContext('2d').getImageData(Math.floor(x), Math.floor(y), 1, 1).data)\
                 (view.at([{u} / 120, {v} / 144]))"
            ));
            // Neighbouring colours differ by up to 4 in a channel; a pixel lies up to half a cell beside the middle.
            let near = |value: f64| {
                let colour = colorous::VIRIDIS.eval_continuous((value / top).clamp(0.0, 1.0)).as_array();
                pixel.iter().zip(colour).all(|(&found, expected)| (found - f64::from(expected)).abs() <= 6.0)
            };
            assert!(near(values[cell]), "cell {cell} of {} lx has the colour {pixel:?}", values[cell]);
        }
    }
    finish(&browser);
}

#[test]
#[ignore = "needs Chromium: make test-live"]
fn a_dragged_sensor_reads_the_map_and_at_home_its_own_influence() {
    let room = Room::office();
    let page = room.page(&[("desk", 0.75), ("floor", 0.0)], 0.0);
    let (mut browser, _) = open(&page, "dragging", WINDOW);
    browser.evaluate("dim(scene.luminaires.map((lamp, i) => [i, 0.2 + 0.05 * i]))");
    let levels = check(&mut browser, &page);
    let own = reading(&page.sensors[2], &levels);

    let mark = "marks[2].mark";
    let from = browser.place(mark, [0.5, 0.5]);
    browser.drag(from, [from[0] + 90.0, from[1] - 70.0]);
    moved_reads_the_map(&mut browser, &room, &levels, 90.0, 70.0);
    browser.evaluate("marks[2].group.focus()");
    browser.key("ArrowRight");
    browser.settle();
    let scale = browser.evaluate("view.scale").as_f64().expect("a number");
    moved_reads_the_map(&mut browser, &room, &levels, 90.0 + 0.1 * scale, 70.0);

    browser.key("Escape");
    browser.settle();
    let shown = browser.evaluate("reading(scene.sensors[2], scene.levels)").as_f64().expect("a number");
    assert!((shown - own).abs() <= SENSOR_ERROR, "{shown} lx at home, not {own}");
    check(&mut browser, &page);
    finish(&browser);
}

/// Sensor 2 was moved by so many pixels to the right and up, and reads what light there is.
fn moved_reads_the_map(browser: &mut Browser, room: &Room, levels: &[f64], right: f64, up: f64) {
    let scale = browser.evaluate("view.scale").as_f64().expect("pixels per metre");
    let share = browser.numbers("scene.sensors[2].moved");
    let [x, y] = [share[0] * room.size[0], share[1] * room.size[1]];
    let home = room.sensors[2];
    assert!((x - home[0] - right / scale).abs() < 0.01 && (y - home[1] - up / scale).abs() < 0.01, "moved to {x}, {y}");
    let light: f64 = levels.iter().enumerate().map(|(i, level)| level * room.light(i, [x, y, 0.75])).sum();
    let expected = light + Room::daylight([x, y, 0.75]);
    let shown = browser.evaluate("Number(sensorRows[2].value.textContent)").as_f64().expect("a number");
    // Bilinear between cells of c = 0.05 m errs by c²/8 · (|E_xx| + |E_yy|); with s = h² + r², a source has
    // |E_xx| + |E_yy| ≤ I h² (8 s⁻³ + 24 r² s⁻⁴), and daylight 60/1.5² lx/m². Twice that, for the change within a cell.
    let curvature = |(i, level): (usize, &f64)| {
        let h2 = (HEIGHT - 0.75).powi(2);
        let r2 = (x - room.lamps[i][0]).powi(2) + (y - room.lamps[i][1]).powi(2);
        level * room.intensity * h2 * (8.0 / (h2 + r2).powi(3) + 24.0 * r2 / (h2 + r2).powi(4))
    };
    let curvature: f64 = levels.iter().enumerate().map(curvature).sum::<f64>() + 60.0 / 1.5_f64.powi(2);
    let bilinear = 2.0 * 0.05_f64.powi(2) / 8.0 * curvature;
    assert!((shown - expected).abs() <= 0.5 + MAP_ERROR + bilinear, "{shown} lx at ({x}, {y}), not {expected}");
}

#[test]
#[ignore = "needs Chromium: make test-live"]
fn meet_the_targets_takes_the_files_solution_and_solves_for_others() {
    let room = Room::office();
    let mut page = room.page(&[("desk", 0.75)], 0.0);
    let optimum: Vec<f64> = (0..15).map(|i| if i % 4 == 3 { 0.0 } else { 0.3 + 0.04 * f64::from(i) }).collect();
    for sensor in &mut page.sensors {
        sensor.target = Some((reading(sensor, &optimum) - 1.0).floor());
    }
    page.optimum = Some(optimum.clone());
    let (mut browser, _) = open(&page, "targets", WINDOW);
    browser.key("m");
    browser.until("document.getElementById('message').className === 'good'");
    assert_eq!(check(&mut browser, &page), optimum);

    // Another target, typed in: solved in the page, by no more power than the file's solution scaled up.
    let raised = page.sensors[0].target.expect("set above") + 40.0;
    page.sensors[0].target = Some(raised);
    browser.click("sensorRows[0].target");
    browser.evaluate("sensorRows[0].target.select()");
    browser.type_text(&raised.to_string());
    browser.click("document.getElementById('meet')");
    browser.until("document.getElementById('message').className === 'good'");
    let levels = check(&mut browser, &page);
    assert_ne!(levels, optimum);
    for sensor in &page.sensors {
        let short = sensor.target.expect("set above") - reading(sensor, &levels);
        assert!(short <= SENSOR_ERROR + 1e-3, "{} is {short} lx short", sensor.name);
    }

    // What nobody can reach is said, with what can be had.
    browser.evaluate("sensorRows[1].target.focus(); sensorRows[1].target.select()");
    browser.type_text("5000");
    browser.click("document.getElementById('meet')");
    browser.until("document.getElementById('message').className === 'bad'");
    let most = reading(&page.sensors[1], &[1.0; 15]);
    let said = text(&mut browser, "message");
    assert!(said.contains("desk 2") && said.contains(&format!("at most {most:.0}")), "{said}");
    finish(&browser);
}

/// The page's solution of a small case against all levels in steps of 1 %.
#[test]
#[ignore = "needs Chromium: make test-live"]
fn the_pages_solution_is_the_least_power() {
    let mut room = Room::office();
    room.lamps.truncate(3);
    room.sensors.truncate(2);
    room.cells = [12, 14];
    let mut page = room.page(&[("desk", 0.75)], 0.0);
    // One whose power bends down, one that bends up, one that is a line: hulls, intervals and off all matter.
    page.luminaires[0].power = vec![[0.1, 9.0], [0.3, 24.0], [1.0, 40.0]];
    page.luminaires[2].power = vec![[0.1, 7.0], [1.0, 38.0]];
    let (mut browser, _) = open(&page, "least", WINDOW);
    let step = 0.01;
    let choices: Vec<f64> = [0.0].into_iter().chain((10..=100).map(|i| f64::from(i) * step)).collect();
    for (targets, tolerance) in
        [([150.0, 120.0], None), ([100.0, 60.0], None), ([170.0, 170.0], None), ([140.0, 60.0], Some(25.0))]
    {
        for (sensor, target) in page.sensors.iter_mut().zip(targets) {
            (sensor.target, sensor.tolerance) = (Some(target), tolerance);
        }
        let asked = json!([targets, tolerance]);
        let set = "([targets, tolerance]) => targets.forEach((target, i) => Object.assign(scene.sensors[i], { target, tolerance }))";
        browser.evaluate(&format!("({set})({asked})"));
        browser.evaluate("meet()");
        let levels = check(&mut browser, &page);
        assert_eq!(browser.evaluate("document.getElementById('message').className"), json!("good"), "{targets:?}");
        let watts = |levels: &[f64]| page.luminaires.iter().zip(levels).map(|(lamp, &l)| power(lamp, l)).sum::<f64>();
        let meets = |levels: &[f64], slack: f64| {
            page.sensors.iter().all(|sensor| {
                let (e, target) = (reading(sensor, levels), sensor.target.expect("set above"));
                e >= target - slack && tolerance.is_none_or(|most| e <= target + most + slack)
            })
        };
        assert!(meets(&levels, SENSOR_ERROR + 1e-3), "{targets:?} at {levels:?}");
        let mut least = f64::INFINITY;
        for &a in &choices {
            for &b in &choices {
                for &c in &choices {
                    if watts(&[a, b, c]) < least && meets(&[a, b, c], 0.0) {
                        least = watts(&[a, b, c]);
                    }
                }
            }
        }
        // Up: levels of the grid are levels; the sensors' rounding in the page is worth SENSOR_ERROR of light, at most
        // 1 W per lx here. Down, without an upper limit: the optimum raised to the grid meets all, a step of 40 W/level each.
        let found = watts(&levels);
        assert!(found <= least + SENSOR_ERROR + 1e-4, "{found} W, grid {least} W for {targets:?}");
        if tolerance.is_none() {
            assert!(found >= least - 3.0 * step * 75.0 - SENSOR_ERROR, "{found} W, grid {least} W for {targets:?}");
        }
    }
    finish(&browser);
}

/// Sensors' errors are those of the matrix, less what a render said; targets are met by as many σ as the page was given.
#[test]
#[ignore = "needs Chromium: make test-live"]
fn errors_decide_what_is_met() {
    let room = Room::office();
    let mut page = room.page(&[("desk", 0.75)], 0.0);
    for sensor in &mut page.sensors {
        sensor.error = sensor.influence.iter().map(|lux| 0.02 * lux + 0.1).collect();
    }
    let levels: Vec<f64> = (0..15).map(|i| 0.3 + 0.04 * f64::from(i)).collect();
    let variance =
        |sensor: &LiveSensor| sensor.error.iter().zip(&levels).map(|(e, level)| (e * level).powi(2)).sum::<f64>();
    // A render as sure as the matrix at these levels halves the variance there.
    let sensor = &mut page.sensors[2];
    let whole = variance(sensor);
    let told = sensor.error.iter().zip(&levels).map(|(error, level)| error * error * level / (2.0 * whole).sqrt());
    sensor.told = vec![told.collect()];
    let (mut browser, _) = open(&page, "errors", WINDOW);
    browser.evaluate(&format!("dim({levels:?}.map((level, i) => [i, level]))"));
    check(&mut browser, &page);
    for (number, sensor) in page.sensors.iter().enumerate() {
        let expected = (variance(sensor) * if number == 2 { 0.5 } else { 1.0 }).sqrt();
        let found = browser.evaluate(&format!("errorOf(scene.sensors[{number}], scene.levels)")).as_f64().expect("lx");
        // Entries are kept in thousandths of the largest: 15 of them, each off by half of one.
        assert!((found - expected).abs() < 0.01 * expected, "{found} lx, not {expected}");
    }
    for (asked, state) in [(-20.0, "met"), (0.0, "open"), (20.0, "low")] {
        let value = reading(&page.sensors[0], &levels) + asked * page.sigmas * variance(&page.sensors[0]).sqrt() / 10.0;
        browser.evaluate(&format!("scene.sensors[0].target = {value}"));
        assert_eq!(browser.evaluate("state(scene.sensors[0], scene.levels)"), json!(state), "{value} lx");
    }
    browser.evaluate("scene.sensors[0].target = 400");
    browser.click("document.getElementById('meet')");
    browser.until("document.getElementById('message').className === 'good'");
    let low =
        "scene.sensors.every(s => reading(s, scene.levels) - scene.sigmas * errorOf(s, scene.levels) > s.target - 0.1)";
    assert_eq!(browser.evaluate(low), json!(true));
    assert_eq!(browser.evaluate("scene.sensors.every(s => state(s, scene.levels) === 'met')"), json!(true));
    // A tenth of the margin would not do, nor is there more than the margin: least power.
    let tight =
        "scene.sensors.some(s => reading(s, scene.levels) - 1.2 * scene.sigmas * errorOf(s, scene.levels) < s.target)";
    assert_eq!(browser.evaluate(tight), json!(true));
    finish(&browser);
}

/// Whatever went before, all off is dark: no light is left, and no ratio of nothing. A target below 0 is refused.
#[test]
#[ignore = "needs Chromium: make test-live"]
fn all_off_is_dark_and_no_target_is_negative() {
    let room = Room::office();
    let mut page = room.page(&[("desk", 0.75)], 0.01);
    page.planes[0].offset.fill(0.0);
    let (mut browser, folder) = open(&page, "dark", WINDOW);
    for turn in 0..40 {
        browser.evaluate(&format!("dim(scene.luminaires.map((_, i) => [i, 0.1 + (7 * i + 3 * {turn}) % 10 / 11]))"));
        browser.settle();
    }
    browser.click("document.getElementById('all-off')");
    browser.settle();
    assert!(browser.numbers("plane.sum").iter().all(|lux| *lux == 0.0));
    assert_eq!([text(&mut browser, "mean"), text(&mut browser, "uniformity")], ["0.0 lx", "–"]);
    browser.evaluate("sensorRows[1].target.focus(); sensorRows[1].target.select()");
    browser.type_text("-5");
    browser.settle();
    assert_eq!(browser.evaluate("scene.sensors[1].target"), json!(300));
    assert!(text(&mut browser, "message").contains("found -5, expected 0 lx or more"));
    browser.screenshot(&folder.join("dark.png"));
    finish(&browser);

    page.sensors.clear();
    let (mut browser, _) = open(&page, "bare", WINDOW);
    browser.key("m");
    browser.settle();
    assert_eq!(text(&mut browser, "message"), "There is no sensor, so there is no target to meet.");
    finish(&browser);
}

#[test]
#[ignore = "needs Chromium: make test-live"]
fn dimming_is_saved_and_loaded_and_bad_files_change_nothing() {
    let room = Room::office();
    let page = room.page(&[("desk", 0.75)], 0.0);
    let (mut browser, folder) = open(&page, "files", WINDOW);
    let levels: Vec<f64> = (0..15).map(|i| if i == 3 { 0.0 } else { 0.1 + f64::from(i) / 17.0 }).collect();
    browser.evaluate(&format!("dim({levels:?}.map((level, i) => [i, level]))"));
    browser.key("s");
    while browser.event("Browser.downloadProgress")["state"] != "completed" {}
    let saved = folder.join("dimming.json");
    let json: Value = serde_json::from_slice(&fs::read(&saved).expect("it was saved")).expect("JSON");
    for (lamp, &level) in page.luminaires.iter().zip(&levels) {
        assert_eq!(json["dimming"][&lamp.name].as_f64(), Some(level), "{}", lamp.name);
    }

    browser.click("document.getElementById('all-on')");
    assert_eq!(check(&mut browser, &page), vec![1.0; 15]);
    browser.choose_file("#file", &saved);
    browser.until("document.getElementById('message').textContent.startsWith('Loaded')");
    assert_eq!(check(&mut browser, &page), levels);

    let bad = [
        (r#"{"dimming": {"L[9,9]": 0.5}}"#, "found “L[9,9]”, expected a luminaire"),
        (r#"{"dimming": {"L[1,1]": 1.5}}"#, "found 1.5 for “L[1,1]”, expected a level from 0 to 1"),
        (r#"{"dimming": {"L[1,1]": "full"}}"#, "found \"full\" for “L[1,1]”"),
        (r#"{"dimming": {"L[1,1]": 0.05}}"#, "expected 0 or at least 0.1"),
        (r#"{"L[1,1]": 0.5}"#, "found no \"dimming\""),
        ("{\"dimming\":\n oops", "found no JSON"),
    ];
    for (i, (content, message)) in bad.into_iter().enumerate() {
        let file = folder.join(format!("bad-{i}.json"));
        fs::write(&file, content).expect("room for a file");
        if i % 2 == 0 {
            browser.choose_file("#file", &file);
        } else {
            browser.drop_file(&file, [300.0, 300.0]);
        }
        browser.until(&format!("document.getElementById('message').textContent.startsWith('bad-{i}.json')"));
        let said = text(&mut browser, "message");
        assert!(said.contains(message) && !said.contains('\n'), "{said}");
        assert_eq!(check(&mut browser, &page), levels, "{content} changed something");
    }
    finish(&browser);
}

/// On a phone, in the dark, nothing is wider than the screen, and every control can be reached by Tab.
#[test]
#[ignore = "needs Chromium: make test-live"]
fn a_phone_shows_it_all() {
    let room = Room::office();
    let page = room.page(&[("desk", 0.75), ("floor", 0.0)], 0.0);
    let (mut browser, folder) = open(&page, "phone", [360, 740]);
    let dark = json!({ "features": [{ "name": "prefers-color-scheme", "value": "dark" }] });
    browser.call("Emulation.setEmulatedMedia", dark);
    browser.settle();
    assert_eq!(browser.evaluate("document.documentElement.scrollWidth"), json!(360));
    let background = "getComputedStyle(document.body).backgroundColor";
    assert_eq!(browser.evaluate(background), json!("rgb(22, 22, 24)"));
    browser.screenshot(&folder.join("phone-dark.png"));
    browser.click("document.getElementById('theme')");
    assert_eq!(browser.evaluate(background), json!("rgb(251, 251, 250)"));
    browser.screenshot(&folder.join("phone-light.png"));

    let mut reached = std::collections::BTreeSet::new();
    browser.evaluate("document.activeElement.blur(); document.body.focus()");
    for _ in 0..90 {
        browser.key("Tab");
        let name = "(e => e.id || e.getAttribute('aria-label') || e.textContent)(document.activeElement)";
        reached.insert(browser.evaluate(name).as_str().unwrap_or_default().to_owned());
    }
    let sensor = |name: &String| name.starts_with("Sensor desk 6: ");
    assert!(reached.iter().any(sensor), "the last sensor is in {reached:?}");
    for name in ["meet", "save", "load", "plane", "top", "L[5,3], dimming", "L[1,1] on", "Group row 2, dimming"] {
        assert!(reached.contains(name), "{name} is not in {reached:?}");
    }
    finish(&browser);
}

/// The scene of the issue, with noise as photons leave it, in a page of no more than 3 MB, whole.
#[test]
fn fifteen_luminaires_on_two_planes_fit_as_they_are() {
    let html = Room::office().page(&[("desk", 0.75), ("floor", 0.0)], 0.01).html();
    assert!(html.len() <= MOST_BYTES, "{} bytes", html.len());
    assert!(html.contains("\"notes\":[]") && html.contains("\"columns\":120,\"rows\":144"));
    assert!(html.contains("<h1>Office &amp; test &lt;b&gt;</h1>"));
    println!("15 luminaires, 2 planes: {} bytes", html.len());
}

/// Hundreds of luminaires: coarser, and the page says so.
#[test]
fn hundreds_of_luminaires_fit_coarser() {
    let mut room = Room::office();
    room.lamps = (0..300).map(|i| [f64::from(i % 15) * 0.4, f64::from(i / 15) * 0.36]).collect();
    room.sensors = (0..500).map(|j| [f64::from(j % 20) * 0.3, f64::from(j / 20) * 0.28]).collect();
    room.intensity = 60.0;
    let html = room.page(&[("desk", 0.75)], 0.01).html();
    assert!(html.len() <= MOST_BYTES, "{} bytes", html.len());
    assert!(html.contains("2 × 2 cells of the map are shown as one"));
    println!("300 luminaires, 500 sensors: {} bytes", html.len());
}

/// Thousands: their groups.
#[test]
fn thousands_of_luminaires_are_dimmed_by_groups() {
    let mut room = Room::office();
    room.lamps = (0..3000).map(|i| [f64::from(i % 50) * 0.12, f64::from(i / 50) * 0.12]).collect();
    (room.intensity, room.cells) = (6.0, [30, 35]);
    let mut page = room.page(&[("desk", 0.75)], 0.01);
    for (i, lamp) in page.luminaires.iter_mut().enumerate() {
        lamp.group = format!("area {}", i % 24);
        lamp.level = if i % 48 < 24 { 0.2 } else { 0.4 };
    }
    let html = page.html();
    assert!(html.len() <= MOST_BYTES, "{} bytes", html.len());
    assert!(html.contains("layers of their 24 groups") && html.contains("3000 luminaires"));
}
