//! The report for a person: one HTML file that needs nothing else, pictures included; dark and light, wide and narrow.
//!
//! Pages are written with `maud`: text and numbers are escaped wherever they stand; only `own` leaves HTML as it is.

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use maud::{DOCTYPE, Markup, PreEscaped, Render, html};

use crate::report::table::{maintained, method};
use crate::results::{
    AreaFigures, CameraImage, IlluminanceMap, Results, Run, SensorReading, SurfaceMap, Verdict, statistics, without,
};
use crate::text::number::{count, duration, fine_percent, long, percent, ratio_with_error, short, with_error};
use crate::units::Lumens;

/// Looks of the page.
const STYLE: &str = include_str!("report.css");

/// HTML that is part of the program, as it is. Texts of a scene can't be: they don't live so long.
pub(crate) fn own(html: &'static str) -> PreEscaped<&'static str> {
    PreEscaped(html)
}

/// The report as HTML. `pictures`: a PNG file for each map, in the maps' order, then two for each camera, tone-mapped
/// and in false colours; what is beyond their number has none.
pub fn report(results: &Results, pictures: &[Vec<u8>]) -> String {
    let run = &results.run;
    let of_cameras = pictures.get(results.maps.len()..).unwrap_or(&[]);
    let main = html! {
        header { h1 { (run.scene) } p { (method(run)) (maintained(run)) } }
        (warnings(&run.warnings))
        (overview(results))
        @for (i, map) in results.maps.iter().enumerate() {
            (plane(map, run.claim, pictures.get(i).map(Vec::as_slice)))
        }
        @for (i, image) in results.images.iter().enumerate() {
            (camera(image, of_cameras.get(2 * i..).unwrap_or(&[])))
        }
        (surfaces(results))
        (sensors(results))
        (without_value(results))
        (groups(results))
        (flux_balance(run))
        (times(run))
        (computation(run))
    };
    document(&run.scene, &[], &main)
}

/// A whole page that needs nothing else; `styles` are added to the looks of every page.
pub(crate) fn document(title: &str, styles: &[&'static str], main: &Markup) -> String {
    let page = html! {
        (DOCTYPE) "\n"
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) " · luxmap" } "\n"
                style { "\n" (own(STYLE)) @for &style in styles { (own(style)) } }
            }
            "\n"
            body { "\n" main { "\n" (main) } footer { "luxmap " (env!("CARGO_PKG_VERSION")) } }
        }
        "\n"
    };
    page.into_string()
}

/// What the user should know.
pub(crate) fn warnings(warnings: &[String]) -> Markup {
    html! {
        @if !warnings.is_empty() {
            section class="warning" { h2 { "Warnings" } (list(warnings)) } "\n"
        }
    }
}

/// All planes in one table.
fn overview(results: &Results) -> Markup {
    if results.maps.len() < 2 {
        return Markup::default();
    }
    let head = ["Plane", "Ē, lx", "E<sub>min</sub>, lx", "E<sub>max</sub>, lx", "U<sub>0</sub>"].map(own);
    let rows = results.maps.iter().map(|map| {
        let found = statistics(map);
        let figures = [
            with_error(found.mean.0, found.errors.mean.0),
            with_error(found.min.0, found.errors.min.0),
            with_error(found.max.0, found.errors.max.0),
            ratio_with_error(found.uniformity, found.errors.uniformity),
        ];
        let [mean, min, max, uniformity] =
            if found.cells > 0 { figures } else { std::array::from_fn(|_| "–".into()) };
        [map.name.clone(), mean, min, max, uniformity]
    });
    section("Measuring planes", table(head, rows))
}

/// Picture and figures of a plane.
fn plane(map: &IlluminanceMap, claim: f64, picture: Option<&[u8]>) -> Markup {
    let content = html! {
        div class="plane" {
            @if let Some(png) = picture {
                (embedded(png, &format!("Illuminance on {} in false colours, with isolux lines", map.name)))
            }
            (figures(map))
        }
        (areas(map, claim))
    };
    section(&format!("Plane “{}”", map.name), content)
}

/// A PNG file within the page.
fn embedded(png: &[u8], description: &str) -> Markup {
    html! { figure { img src={ "data:image/png;base64," (BASE64.encode(png)) } alt=(description); } "\n" }
}

/// Areas of a plane that have figures of their own.
fn areas(map: &IlluminanceMap, claim: f64) -> Markup {
    if map.areas.is_empty() {
        return Markup::default();
    }
    let [min, max, u0, ud] = ["E<sub>min</sub>, lx", "E<sub>max</sub>, lx", "U<sub>0</sub>", "U<sub>d</sub>"];
    table(
        ["Area", "Ē, lx", min, max, u0, ud, "Cells", "Required", ""].map(own),
        map.areas.iter().map(|figures| area(figures, claim)),
    )
}

/// An area's line.
fn area(area: &AreaFigures, claim: f64) -> [Markup; 9] {
    let mut cells = crate::report::table::area(area, claim).map(|cell| cell.render());
    cells[8] = verdict(area.verdict(claim));
    cells
}

/// All measured surfaces in one table.
fn surfaces(results: &Results) -> Markup {
    if results.surfaces.is_empty() {
        return Markup::default();
    }
    let [min, max, u0] = ["E<sub>min</sub>, lx", "E<sub>max</sub>, lx", "U<sub>0</sub>"];
    let head = ["Surface", "Ē, lx", min, max, u0, "Standard error of a sample, lx", "Area, m²", "Flux, lm", "Samples"];
    let content = html! {
        (table(head.map(own), results.surfaces.iter().map(surface)))
        p { "Figures weigh each sample by its area. Values are in the surface’s CSV and PLY files." }
    };
    section("Surfaces", content)
}

/// A surface's line.
fn surface(map: &SurfaceMap) -> [String; 9] {
    let found = map.figures();
    let known = |text: String| if found.samples > 0 { text } else { "–".into() };
    [
        map.name.clone(),
        known(with_error(found.mean.0, found.errors.mean.0)),
        known(with_error(found.min.0, found.errors.min.0)),
        known(with_error(found.max.0, found.errors.max.0)),
        known(ratio_with_error(found.uniformity, found.errors.uniformity)),
        known(short(found.mean_standard_error.0)),
        known(short(found.area)),
        known(short(found.flux.0)),
        format!("{}, {} without a value", count(map.corners.len() as u64), found.samples_without_value),
    ]
}

/// Whether something required is reached.
fn verdict(verdict: Option<Verdict>) -> Markup {
    html! {
        @match verdict {
            Some(Verdict::Met) => span class="met" { "✓ met" },
            Some(Verdict::Missed) => span class="missed" { "✗ missed" },
            Some(undecided) => span class="missed" { "? " (undecided.to_string()) },
            None => {},
        }
    }
}

/// Pictures and figures of a camera.
fn camera(image: &CameraImage, pictures: &[Vec<u8>]) -> Markup {
    let kinds = ["Luminance, tone-mapped, seen by", "Illuminance in false colours, seen by"];
    let [columns, rows] = image.pixels;
    let [mean, highest] = image.luminances().map(short);
    let eye = image.eye;
    let facts = [
        ("Mean E of what is seen", format!("{} lx", short(image.mean_illuminance()))),
        ("Standard error of a pixel’s E, root mean square", format!("{} %", percent(image.claim))),
        ("Luminance, mean", format!("{mean} cd/m²")),
        ("Luminance, highest", format!("{highest} cd/m²")),
        ("Eye", format!("({}, {}, {}) m", metres(eye.x), metres(eye.y), metres(eye.z))),
        ("Field of view from bottom to top", format!("{}°", short(image.fov))),
        ("Pixels", format!("{columns} × {rows}, {} rays each", image.samples)),
    ];
    let content = html! {
        @for (png, kind) in pictures.iter().zip(kinds) { (embedded(png, &format!("{kind} {}", image.name))) }
        (definitions(facts))
    };
    section(&format!("Camera “{}”", image.name), content)
}

/// Figures of a plane, one on each line.
fn figures(map: &IlluminanceMap) -> Markup {
    let found = statistics(map);
    let [columns, rows] = map.cells;
    let size = format!("{} m × {} m", short(map.along.length()), short(map.across.length()));
    let corner = format!("({}, {}, {}) m", metres(map.corner.x), metres(map.corner.y), metres(map.corner.z));
    let place = [
        ("Size", size),
        ("Corner", corner),
        ("Cells", format!("{columns} × {rows}, {} without a value", found.cells_without_value)),
    ];
    if found.cells == 0 {
        return html! { (definitions(place)) p { "No light can arrive anywhere on this plane." } };
    }
    let lux = |value: f64| format!("{} lx", short(value));
    let read = |value: f64, error: f64| format!("{} lx", with_error(value, error));
    let noise = format!("{} ({} %)", lux(found.mean_standard_error.0), percent(found.relative_error()));
    let light = [
        ("Mean Ē", read(found.mean.0, found.errors.mean.0)),
        ("Minimum E<sub>min</sub>", read(found.min.0, found.errors.min.0)),
        ("Maximum E<sub>max</sub>", read(found.max.0, found.errors.max.0)),
        ("Median", lux(found.median.0)),
        ("Uniformity U<sub>0</sub> = E<sub>min</sub> / Ē", ratio_with_error(found.uniformity, found.errors.uniformity)),
        (
            "Diversity U<sub>d</sub> = E<sub>min</sub> / E<sub>max</sub>",
            ratio_with_error(found.diversity, found.errors.diversity),
        ),
        ("Standard error of a cell, mean", noise),
        ("Standard error of a cell, largest", lux(found.largest_standard_error.0)),
    ];
    definitions(light.into_iter().chain(place).map(|(name, value)| (own(name), value)))
}

/// Readings of all sensors.
fn sensors(results: &Results) -> Markup {
    if results.sensors.is_empty() {
        return Markup::default();
    }
    let head = ["Sensor", "Position, m", "E, lx", "Standard error, lx", "Target, lx", ""];
    section("Sensors", table(head, results.sensors.iter().map(|reading| sensor(reading, results.run.claim))))
}

/// A sensor's line.
fn sensor(sensor: &SensorReading, claim: f64) -> [Markup; 6] {
    let value = |lux: f64| if sensor.has_value { short(lux) } else { "–".into() };
    let at = sensor.position;
    let [class, mark] = if sensor.meets_target() == Some(true) { ["met", "✓"] } else { ["missed", "✗"] };
    [
        sensor.title().render(),
        format!("({}, {}, {})", metres(at.x), metres(at.y), metres(at.z)).render(),
        value(sensor.illuminance).render(),
        value(sensor.standard_error).render(),
        sensor.target.map(short).unwrap_or_default().render(),
        html! { @if let Some(words) = sensor.judged(claim) { span class=(class) { (mark) " " (words) } } },
    ]
}

/// Which cells, samples and sensors have no value, and why; nothing where all have one.
fn without_value(results: &Results) -> Markup {
    let lines = without::lines(results);
    if lines.is_empty() {
        return Markup::default();
    }
    let content = html! {
        (list(&lines))
        p {
            "Covered: something opaque lies on the place, nearer than a hundredth of the spacing. Shut off by a closed \
             body: the place is inside one, or all luminaires are. None of them counts in any figure."
        }
    };
    section("Without a value", content)
}

/// What each light group brings to the planes; nothing where groups are not told apart.
fn groups(results: &Results) -> Markup {
    let rows: Vec<[String; 4]> = results
        .maps
        .iter()
        .flat_map(|map| {
            let whole = statistics(map).mean.0;
            results.run.groups.iter().zip(&map.groups).map(move |(name, group)| {
                let mean = group.mean(&map.has_value);
                let share = if whole > 0.0 { percent(mean / whole) } else { "–".into() };
                [name.clone(), map.name.clone(), short(mean), share]
            })
        })
        .collect();
    if rows.is_empty() {
        return Markup::default();
    }
    section("Light groups", table(["Group", "Plane", "Ē, lx", "% of the plane’s"], rows.into_iter()))
}

/// A coordinate to the millimetre.
fn metres(coordinate: f64) -> f64 {
    (coordinate * 1e3).round() / 1e3 + 0.0
}

/// Where the photons' flux went.
fn flux_balance(run: &Run) -> Markup {
    let flux = &run.flux;
    let share = |part: Lumens| if flux.emitted.0 > 0.0 { part / flux.emitted } else { 0.0 };
    let parts =
        [("Emitted", flux.emitted), ("Absorbed", flux.absorbed), ("Escaped", flux.escaped), ("Cut off", flux.cut_off)];
    let rows = parts.map(|(name, part)| [name.to_owned(), long(part.0), fine_percent(share(part))]);
    let content = html! {
        (table(["", "Φ, lm", "%"], rows.into_iter()))
        p {
            "Emitted = absorbed + escaped + cut off. Absorbed: by surfaces and inside glass. Escaped: left the scene \
             without meeting anything. Cut off: still under way at the safety cap on bounces."
        }
    };
    section("Flux balance", content)
}

/// Time of each stage, and rates.
fn times(run: &Run) -> Markup {
    let share =
        |seconds: f64| if run.total_seconds > 0.0 { percent(seconds / run.total_seconds) } else { "–".into() };
    let stages = run.seconds.iter().map(|&(name, seconds)| [name.to_owned(), duration(seconds), share(seconds)]);
    let total = ["Whole run".to_owned(), duration(run.total_seconds), share(run.total_seconds)];
    section("Time", table(["Stage", "Time", "%"], stages.chain([total])))
}

/// How the results came about.
fn computation(run: &Run) -> Markup {
    let memory = match run.peak_memory {
        0 => "unknown".to_owned(),
        bytes => format!("{} MB", short(bytes as f64 / 1e6)),
    };
    let factor = match run.maintenance_factor {
        None => "none: illuminance of the new installation".to_owned(),
        Some([least, most]) if least == most => least.to_string(),
        Some([least, most]) => format!("{least} to {most}, by luminaire"),
    };
    let facts = [
        ("Maintenance factor", factor),
        ("Method", run.method.clone()),
        ("Photons emitted", count(run.photons_emitted)),
        ("Photons stored", count(run.photons_stored)),
        ("Passes", run.passes.to_string()),
        ("Nearest photons k", run.nearest.to_string()),
        ("Largest search radius", format!("{} m", short(run.radius))),
        ("Photon map’s tree", run.tree.clone()),
        ("Seed", run.seed.to_string()),
        ("Threads", run.threads.to_string()),
        ("Rays of photons", count(run.photon_rays)),
        ("Rays from the points", count(run.gather_rays)),
        ("Light of weak luminaires left out, at most", fine_percent(run.left_out[1])),
        ("Triangles", count(run.triangles as u64)),
        ("Luminaires", count(run.luminaires as u64)),
        ("Peak memory", memory),
    ];
    let facts = facts.into_iter().map(|(name, value)| (name, value.render())).chain([
        ("Scene (SHA-256)", html! { code { (run.scene_hash) } }),
        ("luxmap", env!("CARGO_PKG_VERSION").render()),
    ]);
    section("How it was computed", html! { p { (explanation(&run.method)) } (definitions(facts)) })
}

/// What a method does, in words.
fn explanation(method: &str) -> &'static str {
    match method {
        "split" => {
            "Direct light is sampled by shadow rays to the luminaires; light that has bounced, or passed a mirror or \
             glass, comes from photon maps. Standard errors are statistical (1 σ), from the spread between independent \
             passes; they don’t include the bias of density estimation."
        }
        "photons" => {
            "All light comes from photon maps, with corrections for edges, the side of a surface and the k-th photon. \
             Standard errors are statistical (1 σ), from the spread between independent passes; they don’t include the \
             bias of density estimation."
        }
        "seed" => {
            "All light comes from photons: E = Σφ / (πr²) over the k nearest. Readings are low near walls and edges, \
             and about k / (k − 1) high elsewhere; standard errors are statistical (1 σ) and don’t include that."
        }
        "path" => {
            "Light is followed backwards from the measuring points, without bias; standard errors are statistical (1 σ)."
        }
        _ => "Standard errors are statistical (1 σ).",
    }
}

/// A headline and what belongs to it.
pub(crate) fn section(headline: &str, content: impl Render) -> Markup {
    html! { section { h2 { (headline) } "\n" (content) } "\n" }
}

/// A list with points.
pub(crate) fn list(items: impl IntoIterator<Item = impl Render>) -> Markup {
    html! { ul { "\n" @for item in items { li { (item) } "\n" } } "\n" }
}

/// A drawing or chart with what it shows.
pub(crate) fn figure(title: &str, text: &str, drawing: &Markup) -> Markup {
    html! { figure { figcaption { b { (title) } " " (text) } "\n" (drawing) } "\n" }
}

/// A table.
pub(crate) fn table<const N: usize>(head: [impl Render; N], rows: impl Iterator<Item = [impl Render; N]>) -> Markup {
    html! {
        div class="scroll" {
            table {
                thead { tr { @for cell in head { th { (cell) } } } } "\n"
                tbody { "\n" @for row in rows { tr { @for cell in row { td { (cell) } } } "\n" } }
            }
        }
        "\n"
    }
}

/// Names and values, one pair on each line.
pub(crate) fn definitions(pairs: impl IntoIterator<Item = (impl Render, impl Render)>) -> Markup {
    html! {
        div class="scroll" {
            table class="facts" {
                "\n" @for (name, value) in pairs { tr { th { (name) } td { (value) } } "\n" }
            }
        }
        "\n"
    }
}
