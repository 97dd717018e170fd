//! The report for a person: one HTML file that needs nothing else, pictures included; dark and light, wide and narrow.

use std::fmt::Display;

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;

use crate::report::table::{maintained, method};
use crate::results::{
    AreaFigures, CameraImage, IlluminanceMap, Results, Run, SensorReading, SurfaceMap, Verdict, statistics, without,
};
use crate::text::number::{count, duration, fine_percent, long, percent, ratio_with_error, short, with_error};
use crate::units::Lumens;

/// Looks of the page.
const STYLE: &str = include_str!("report.css");

/// The report as HTML. `pictures`: a PNG file for each map, in the maps' order, then two for each camera, tone-mapped and in
/// false colours; what is beyond their number has none.
pub fn report(results: &Results, pictures: &[Vec<u8>]) -> String {
    let run = &results.run;
    let title = escape(&run.scene);
    let planes: String = results
        .maps
        .iter()
        .enumerate()
        .map(|(i, map)| plane(map, run.claim, pictures.get(i).map(Vec::as_slice)))
        .collect();
    let of_cameras = pictures.get(results.maps.len()..).unwrap_or(&[]);
    let parts = [
        format!("<header>\n<h1>{title}</h1>\n<p>{}{}</p>\n</header>\n", escape(&method(run)), maintained(run)),
        warnings(&run.warnings),
        overview(results),
        planes,
        results
            .images
            .iter()
            .enumerate()
            .map(|(i, image)| camera(image, of_cameras.get(2 * i..).unwrap_or(&[])))
            .collect(),
        surfaces(results),
        sensors(results),
        without_value(results),
        groups(results),
        flux_balance(run),
        times(run),
        computation(run),
    ];
    document(&title, "", &parts.concat())
}

/// A whole page that needs nothing else; `title` and `main` are HTML, `style` is added to the looks of every page.
pub(crate) fn document(title: &str, style: &str, main: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>{title} · luxmap</title>\n<style>\n{STYLE}{style}</style>\n</head>\n<body>\n<main>\n{main}</main>\n\
         <footer>luxmap {}</footer>\n</body>\n</html>\n",
        env!("CARGO_PKG_VERSION"),
    )
}

/// What the user ought to know.
pub(crate) fn warnings(warnings: &[String]) -> String {
    if warnings.is_empty() {
        return String::new();
    }
    let items: String = warnings.iter().map(|warning| format!("<li>{}</li>\n", escape(warning))).collect();
    format!("<section class=\"warning\">\n<h2>Warnings</h2>\n<ul>\n{items}</ul>\n</section>\n")
}

/// All planes in one table.
fn overview(results: &Results) -> String {
    if results.maps.len() < 2 {
        return String::new();
    }
    let head = ["Plane", "Ē, lx", "E<sub>min</sub>, lx", "E<sub>max</sub>, lx", "U<sub>0</sub>"];
    let rows = results.maps.iter().map(|map| {
        let found = statistics(map);
        let figures = [
            with_error(found.mean.0, found.errors.mean.0),
            with_error(found.min.0, found.errors.min.0),
            with_error(found.max.0, found.errors.max.0),
            ratio_with_error(found.uniformity, found.errors.uniformity),
        ];
        let name = escape(&map.name);
        let [mean, min, max, uniformity] =
            if found.cells > 0 { figures } else { std::array::from_fn(|_| "–".into()) };
        [name, mean, min, max, uniformity]
    });
    section("Measuring planes", &table(head, rows))
}

/// Picture and figures of a plane.
fn plane(map: &IlluminanceMap, claim: f64, picture: Option<&[u8]>) -> String {
    let name = escape(&map.name);
    let image = picture.map_or_else(String::new, |png| {
        let alt = format!("Illuminance on {name} in false colours, with isolux lines");
        format!("<figure><img src=\"data:image/png;base64,{}\" alt=\"{alt}\"></figure>\n", BASE64.encode(png))
    });
    section(
        &format!("Plane “{name}”"),
        &format!("<div class=\"plane\">\n{image}{}</div>\n{}", figures(map), areas(map, claim)),
    )
}

/// Areas of a plane that have figures of their own.
fn areas(map: &IlluminanceMap, claim: f64) -> String {
    if map.areas.is_empty() {
        return String::new();
    }
    let [min, max, u0, ud] = ["E<sub>min</sub>, lx", "E<sub>max</sub>, lx", "U<sub>0</sub>", "U<sub>d</sub>"];
    table(
        ["Area", "Ē, lx", min, max, u0, ud, "Cells", "Required", ""],
        map.areas.iter().map(|figures| area(figures, claim)),
    )
}

/// An area's line.
fn area(area: &AreaFigures, claim: f64) -> [String; 9] {
    let [title, rest @ .., _] = crate::report::table::area(area, claim);
    let [mean, min, max, uniformity, diversity, cells, required] = rest;
    [escape(&title), mean, min, max, uniformity, diversity, cells, required, verdict(area.verdict(claim))]
}

/// All measured surfaces in one table.
fn surfaces(results: &Results) -> String {
    if results.surfaces.is_empty() {
        return String::new();
    }
    let [min, max, u0] = ["E<sub>min</sub>, lx", "E<sub>max</sub>, lx", "U<sub>0</sub>"];
    let head = ["Surface", "Ē, lx", min, max, u0, "Standard error of a sample, lx", "Area, m²", "Flux, lm", "Samples"];
    let note = "<p>Figures weigh each sample by its area. Values are in the surface’s CSV and PLY files.</p>\n";
    section("Surfaces", &(table(head, results.surfaces.iter().map(surface)) + note))
}

/// A surface's line.
fn surface(map: &SurfaceMap) -> [String; 9] {
    let found = map.figures();
    let known = |text: String| if found.samples > 0 { text } else { "–".into() };
    [
        escape(&map.name),
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
fn verdict(verdict: Option<Verdict>) -> String {
    match verdict {
        Some(Verdict::Met) => "<span class=\"met\">✓ met</span>".into(),
        Some(Verdict::Missed) => "<span class=\"missed\">✗ missed</span>".into(),
        Some(undecided) => format!("<span class=\"missed\">? {undecided}</span>"),
        None => String::new(),
    }
}

/// Pictures and figures of a camera.
fn camera(image: &CameraImage, pictures: &[Vec<u8>]) -> String {
    let name = escape(&image.name);
    let kinds = ["Luminance, tone-mapped, seen by", "Illuminance in false colours, seen by"];
    let figure = |(png, kind): (&Vec<u8>, &str)| {
        let data = BASE64.encode(png);
        format!("<figure><img src=\"data:image/png;base64,{data}\" alt=\"{kind} {name}\"></figure>\n")
    };
    let shown: String = pictures.iter().zip(kinds).map(figure).collect();
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
    let facts = definitions(facts.map(|(name, value)| (name.to_owned(), value)));
    section(&format!("Camera “{name}”"), &format!("{shown}{facts}"))
}

/// Figures of a plane, one on each line.
fn figures(map: &IlluminanceMap) -> String {
    let found = statistics(map);
    let [columns, rows] = map.cells;
    let size = format!("{} m × {} m", short(map.along.length()), short(map.across.length()));
    let place = [
        ("Size".to_owned(), size),
        (
            "Corner".to_owned(),
            format!("({}, {}, {}) m", metres(map.corner.x), metres(map.corner.y), metres(map.corner.z)),
        ),
        ("Cells".to_owned(), format!("{columns} × {rows}, {} without a value", found.cells_without_value)),
    ];
    if found.cells == 0 {
        return definitions(place) + "<p>No light can arrive anywhere on this plane.</p>\n";
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
    definitions(light.map(|(name, value)| (name.to_owned(), value)).into_iter().chain(place))
}

/// Readings of all sensors.
fn sensors(results: &Results) -> String {
    if results.sensors.is_empty() {
        return String::new();
    }
    let head = ["Sensor", "Position, m", "E, lx", "Standard error, lx", "Target, lx", ""];
    section("Sensors", &table(head, results.sensors.iter().map(|reading| sensor(reading, results.run.claim))))
}

/// A sensor's line.
fn sensor(sensor: &SensorReading, claim: f64) -> [String; 6] {
    let value = |lux: f64| if sensor.has_value { short(lux) } else { "–".into() };
    let at = sensor.position;
    [
        escape(&sensor.title()),
        format!("({}, {}, {})", metres(at.x), metres(at.y), metres(at.z)),
        value(sensor.illuminance),
        value(sensor.standard_error),
        sensor.target.map_or_else(String::new, short),
        sensor.judged(claim).map_or_else(String::new, |words| {
            let [class, mark] = if sensor.meets_target() == Some(true) { ["met", "✓"] } else { ["missed", "✗"] };
            format!("<span class=\"{class}\">{mark} {words}</span>")
        }),
    ]
}

/// Which cells, samples and sensors have no value, and why; nothing where all have one.
fn without_value(results: &Results) -> String {
    let lines = without::lines(results);
    if lines.is_empty() {
        return String::new();
    }
    let items: String = lines.iter().map(|line| format!("<li>{}</li>\n", escape(line))).collect();
    let note = "<p>Covered: something opaque lies on the place, nearer than a hundredth of the spacing. Shut off by a closed \
                body: the place is inside one, or all luminaires are. None of them counts in any figure.</p>\n";
    section("Without a value", &format!("<ul>\n{items}</ul>\n{note}"))
}

/// What each light group brings to the planes; nothing where groups are not told apart.
fn groups(results: &Results) -> String {
    let rows: Vec<[String; 4]> = results
        .maps
        .iter()
        .flat_map(|map| {
            let whole = statistics(map).mean.0;
            results.run.groups.iter().zip(&map.groups).map(move |(name, group)| {
                let mean = group.mean(&map.has_value);
                let share = if whole > 0.0 { percent(mean / whole) } else { "–".into() };
                [escape(name), escape(&map.name), short(mean), share]
            })
        })
        .collect();
    if rows.is_empty() {
        return String::new();
    }
    section("Light groups", &table(["Group", "Plane", "Ē, lx", "% of the plane’s"], rows.into_iter()))
}

/// A coordinate to the millimetre.
fn metres(coordinate: f64) -> f64 {
    (coordinate * 1e3).round() / 1e3 + 0.0
}

/// Where the photons' flux went.
fn flux_balance(run: &Run) -> String {
    let flux = &run.flux;
    let share = |part: Lumens| if flux.emitted.0 > 0.0 { part / flux.emitted } else { 0.0 };
    let parts =
        [("Emitted", flux.emitted), ("Absorbed", flux.absorbed), ("Escaped", flux.escaped), ("Cut off", flux.cut_off)];
    let rows = parts.map(|(name, part)| [name.to_owned(), long(part.0), fine_percent(share(part))]);
    let note = "<p>Emitted = absorbed + escaped + cut off. Absorbed: by surfaces and inside glass. Escaped: left the scene \
                without meeting anything. Cut off: still under way at the safety cap on bounces.</p>\n";
    section("Flux balance", &(table(["", "Φ, lm", "%"], rows.into_iter()) + note))
}

/// Time of each stage, and rates.
fn times(run: &Run) -> String {
    let share =
        |seconds: f64| if run.total_seconds > 0.0 { percent(seconds / run.total_seconds) } else { "–".into() };
    let stages = run.seconds.iter().map(|&(name, seconds)| [escape(name), duration(seconds), share(seconds)]);
    let total = ["Whole run".to_owned(), duration(run.total_seconds), share(run.total_seconds)];
    section("Time", &table(["Stage", "Time", "%"], stages.chain([total])))
}

/// How the results came about.
fn computation(run: &Run) -> String {
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
        ("Method", escape(&run.method)),
        ("Photons emitted", count(run.photons_emitted)),
        ("Photons stored", count(run.photons_stored)),
        ("Passes", run.passes.to_string()),
        ("Nearest photons k", run.nearest.to_string()),
        ("Largest search radius", format!("{} m", short(run.radius))),
        ("Photon map’s tree", escape(&run.tree)),
        ("Seed", run.seed.to_string()),
        ("Threads", run.threads.to_string()),
        ("Rays of photons", count(run.photon_rays)),
        ("Rays from the points", count(run.gather_rays)),
        ("Light of weak luminaires left out, at most", fine_percent(run.left_out[1])),
        ("Triangles", count(run.triangles as u64)),
        ("Luminaires", count(run.luminaires as u64)),
        ("Peak memory", memory),
        ("Scene (SHA-256)", format!("<code>{}</code>", escape(&run.scene_hash))),
        ("luxmap", env!("CARGO_PKG_VERSION").to_owned()),
    ];
    let facts = definitions(facts.map(|(name, value)| (name.to_owned(), value)));
    section("How it was computed", &format!("<p>{}</p>\n{facts}", explanation(&run.method)))
}

/// What a method does, in words.
fn explanation(method: &str) -> &'static str {
    match method {
        "split" => {
            "Direct light is sampled by shadow rays to the luminaires; light that has bounced, or passed a mirror or glass, \
             comes from photon maps. Standard errors are statistical (1 σ), from the spread between independent passes; \
             they don’t include the bias of density estimation."
        }
        "photons" => {
            "All light comes from photon maps, with corrections for edges, the side of a surface and the k-th photon. \
             Standard errors are statistical (1 σ), from the spread between independent passes; they don’t include the \
             bias of density estimation."
        }
        "seed" => {
            "All light comes from photons: E = Σφ / (πr²) over the k nearest. Readings are low near walls and edges, and \
             about k / (k − 1) high elsewhere; standard errors are statistical (1 σ) and don’t include that."
        }
        "path" => {
            "Light is followed backwards from the measuring points, without bias; standard errors are statistical (1 σ)."
        }
        _ => "Standard errors are statistical (1 σ).",
    }
}

/// A headline and what belongs to it.
pub(crate) fn section(headline: &str, content: &str) -> String {
    format!("<section>\n<h2>{headline}</h2>\n{content}</section>\n")
}

/// A table; cells are HTML.
pub(crate) fn table<const N: usize>(head: [&str; N], rows: impl Iterator<Item = [String; N]>) -> String {
    let line = |tag: &str, cells: &[String]| {
        let cells: String = cells.iter().map(|cell| format!("<{tag}>{cell}</{tag}>")).collect();
        format!("<tr>{cells}</tr>\n")
    };
    let body: String = rows.map(|row| line("td", &row)).collect();
    let head = line("th", &head.map(String::from));
    format!("<div class=\"scroll\"><table>\n<thead>{head}</thead>\n<tbody>\n{body}</tbody>\n</table></div>\n")
}

/// Names and values, one pair on each line; both are HTML.
pub(crate) fn definitions<V: Display>(pairs: impl IntoIterator<Item = (String, V)>) -> String {
    let rows = pairs.into_iter().map(|(name, value)| format!("<tr><th>{name}</th><td>{value}</td></tr>\n"));
    format!("<div class=\"scroll\"><table class=\"facts\">\n{}</table></div>\n", rows.collect::<String>())
}

/// Text made harmless in HTML, also within quotes.
pub(crate) fn escape(text: &str) -> String {
    text.chars().fold(String::with_capacity(text.len()), |mut html, character| {
        match character {
            '&' => html.push_str("&amp;"),
            '<' => html.push_str("&lt;"),
            '>' => html.push_str("&gt;"),
            '"' => html.push_str("&quot;"),
            '\'' => html.push_str("&#39;"),
            other => html.push(other),
        }
        html
    })
}
