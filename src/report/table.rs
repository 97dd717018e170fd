//! The summary for a person at a terminal.

use crate::results::{
    AreaFigures, CameraImage, IlluminanceMap, Results, Run, SensorReading, SurfaceMap, statistics, without,
};
use crate::text::number::{bytes, count, duration, fine_percent, long, percent, ratio_with_error, short, with_error};
use crate::units::Lumens;

/// The summary as text: how it was computed, a table of the planes, one of the sensors, flux balance, times.
pub fn table(results: &Results) -> String {
    let run = &results.run;
    let mut lines = vec![format!("{}: {}{}", run.scene, method(run), maintained(run))];
    if !results.maps.is_empty() {
        lines.push(String::new());
        let head = ["plane", "Ē, lx", "E_min, lx", "E_max, lx", "U₀", "U_d", "mean σ, lx", "mean σ, %", "cells"];
        lines.extend(columns(head, results.maps.iter().map(plane)));
    }
    if results.maps.iter().any(|map| !map.areas.is_empty()) {
        lines.push(String::new());
        let head = ["area", "Ē, lx", "E_min, lx", "E_max, lx", "U₀", "U_d", "cells", "required", ""];
        lines.extend(columns(
            head,
            results.maps.iter().flat_map(|map| &map.areas).map(|figures| area(figures, run.claim)),
        ));
    }
    if !results.surfaces.is_empty() {
        lines.push(String::new());
        let head = ["surface", "Ē, lx", "E_min, lx", "E_max, lx", "U₀", "U_d", "mean σ, lx", "area, m²", "samples"];
        lines.extend(columns(head, results.surfaces.iter().map(surface)));
    }
    if !results.sensors.is_empty() {
        lines.push(String::new());
        let head = ["sensor", "E, lx", "σ, lx", "target, lx", ""];
        lines.extend(columns(head, results.sensors.iter().map(|reading| sensor(reading, run.claim))));
    }
    let without = without::lines(results);
    if !without.is_empty() {
        lines.push(String::new());
        lines.push("without a value".into());
        lines.extend(without.iter().map(|line| format!("  {line}")));
    }
    if !results.images.is_empty() {
        lines.push(String::new());
        let head = ["camera", "Ē seen, lx", "σ of a pixel, %", "L̄, cd/m²", "L_max, cd/m²", "rays a pixel", "pixels"];
        lines.extend(columns(head, results.images.iter().map(camera)));
    }
    lines.push(String::new());
    if run.photons_emitted > 0 {
        lines.push(format!("flux  {}", flux_balance(run)));
    }
    lines.push(format!("time  {}", times(run)));
    if run.peak_memory > 0 {
        lines.push(format!("peak memory  {}", bytes(run.peak_memory)));
    }
    lines.join("\n") + "\n"
}

/// `, maintained illuminance (factor 0.8)`, where the scene gives a maintenance factor.
pub(crate) fn maintained(run: &Run) -> String {
    match run.maintenance_factor {
        None => String::new(),
        Some([least, most]) if least == most => format!(", maintained illuminance (factor {least})"),
        Some([least, most]) => format!(", maintained illuminance (factors {least} to {most})"),
    }
}

/// How it was computed, in one line, as `split, 1 200 000 photons in 12 passes, k = 100`.
pub(crate) fn method(run: &Run) -> String {
    if run.photons_emitted == 0 {
        return format!("{}, no photons needed", run.method);
    }
    let passes = if run.passes == 1 { "1 pass".into() } else { format!("{} passes", run.passes) };
    let photons = format!("{}, {} photons in {passes}", run.method, count(run.photons_emitted));
    if run.nearest > 0 { format!("{photons}, k = {}", run.nearest) } else { photons }
}

/// `emitted 45000 lm = absorbed 44990 lm (99.9778 %) + escaped 10 lm (0.0222 %) + cut off 0 lm (0 %)`
fn flux_balance(run: &Run) -> String {
    let flux = &run.flux;
    let part = |part: Lumens| {
        let share = if flux.emitted.0 > 0.0 { part / flux.emitted } else { 0.0 };
        format!("{} lm ({} %)", long(part.0), fine_percent(share))
    };
    format!(
        "emitted {} lm = absorbed {} + escaped {} + cut off {}",
        long(flux.emitted.0),
        part(flux.absorbed),
        part(flux.escaped),
        part(flux.cut_off)
    )
}

/// `trace 1.2 s, build 0.3 s; 3.42 s in all`
fn times(run: &Run) -> String {
    let stages: Vec<_> = run.seconds.iter().map(|(name, seconds)| format!("{name} {}", duration(*seconds))).collect();
    let total = format!("{} in all", duration(run.total_seconds));
    if stages.is_empty() { total } else { format!("{}; {total}", stages.join(", ")) }
}

/// A plane's line.
fn plane(map: &IlluminanceMap) -> [String; 9] {
    let found = statistics(map);
    let cells = format!("{} × {}", map.cells[0], map.cells[1]);
    if found.cells == 0 {
        return [
            map.name.clone(),
            "–".into(),
            "–".into(),
            "–".into(),
            "–".into(),
            "–".into(),
            "–".into(),
            "–".into(),
            cells,
        ];
    }
    [
        map.name.clone(),
        with_error(found.mean.0, found.errors.mean.0),
        with_error(found.min.0, found.errors.min.0),
        with_error(found.max.0, found.errors.max.0),
        ratio_with_error(found.uniformity, found.errors.uniformity),
        ratio_with_error(found.diversity, found.errors.diversity),
        short(found.mean_standard_error.0),
        percent(found.relative_error()),
        cells,
    ]
}

/// An area's line.
pub(super) fn area(area: &AreaFigures, claim: f64) -> [String; 9] {
    let found = &area.figures;
    let known = |text: String| if found.cells > 0 { text } else { "–".into() };
    [
        area.title(),
        known(with_error(found.mean.0, found.errors.mean.0)),
        known(with_error(found.min.0, found.errors.min.0)),
        known(with_error(found.max.0, found.errors.max.0)),
        known(ratio_with_error(found.uniformity, found.errors.uniformity)),
        known(ratio_with_error(found.diversity, found.errors.diversity)),
        found.cells.to_string(),
        area.required_in_words(),
        area.verdict(claim).map_or_else(String::new, |verdict| verdict.to_string()),
    ]
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
        known(ratio_with_error(found.diversity, found.errors.diversity)),
        known(short(found.mean_standard_error.0)),
        known(short(found.area)),
        map.corners.len().to_string(),
    ]
}

/// A sensor's line.
fn sensor(sensor: &SensorReading, claim: f64) -> [String; 5] {
    let value = |lux: f64| if sensor.has_value { short(lux) } else { "–".into() };
    [
        sensor.title(),
        value(sensor.illuminance),
        value(sensor.standard_error),
        sensor.target.map_or_else(String::new, short),
        sensor.judged(claim).unwrap_or_default(),
    ]
}

/// A camera's line.
fn camera(image: &CameraImage) -> [String; 7] {
    let [mean, highest] = image.luminances().map(short);
    [
        image.name.clone(),
        short(image.mean_illuminance()),
        percent(image.claim),
        mean,
        highest,
        image.samples.to_string(),
        format!("{} × {}", image.pixels[0], image.pixels[1]),
    ]
}

/// Lines of a table: the first column to the left, the others to the right, two spaces between.
pub(crate) fn columns<const N: usize>(head: [&str; N], rows: impl Iterator<Item = [String; N]>) -> Vec<String> {
    let rows: Vec<_> = std::iter::once(head.map(String::from)).chain(rows).collect();
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; N] = std::array::from_fn(width);
    let line = |row: &[String; N]| {
        let cell = |i: usize| match i {
            0 => format!("{:<1$}", row[0], widths[0]),
            _ => format!("  {:>1$}", row[i], widths[i]),
        };
        (0..N).map(cell).collect::<String>().trim_end().to_owned()
    };
    rows.iter().map(line).collect()
}
