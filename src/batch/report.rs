//! What became of a batch: `summary.csv`, `report.html`, a table for a terminal, JSON.
//!
//! A line of the CSV is one place of one run (`kind`: plane, surface, sensor or camera); a run without results has one
//! line with neither. JSON has the same under `runs`, places within their run.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use ::csv::WriterBuilder;
use maud::{Markup, Render, html};
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::files;
use crate::report::html::{document, list, own, section, table, warnings};
use crate::report::table::columns;
use crate::results::{Results, statistics};
use crate::text::number::{count, duration, percent, round_to, short};

/// Looks that this page adds.
const STYLE: &str = include_str!("report.css");

/// Columns of the CSV file.
const HEAD: [&str; 18] = [
    "run",
    "scene",
    "options",
    "status",
    "method",
    "seed",
    "passes",
    "photons",
    "seconds",
    "peak_memory_bytes",
    "kind",
    "place",
    "mean_lx",
    "min_lx",
    "u0",
    "standard_error_percent",
    "warnings",
    "message",
];

/// Most places of a run on the page and in the table; the CSV has all.
const MOST_PLACES: usize = 8;

/// What became of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// Done, all of it this time.
    Done,
    /// Done, from a checkpoint on.
    Resumed,
    /// Done by an earlier call, and not repeated.
    DoneBefore,
    /// Ended by the user; its checkpoint has all passes so far.
    Interrupted,
    /// Not begun when the user ended the batch.
    NotBegun,
    /// Without results; see its message.
    Failed,
}

impl Status {
    /// Every one, with its name.
    pub const ALL: [(&'static str, Self); 6] = [
        ("done", Self::Done),
        ("resumed", Self::Resumed),
        ("done before", Self::DoneBefore),
        ("interrupted", Self::Interrupted),
        ("not begun", Self::NotBegun),
        ("failed", Self::Failed),
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::ALL.into_iter().find(|(_, status)| *status == self).map_or("", |(name, _)| name)
    }
}

/// One run of a batch.
#[derive(Clone, Debug, Serialize)]
pub struct RunRow {
    /// Its name, and that of its folder.
    pub name: String,
    /// Its scene file.
    pub scene: PathBuf,
    /// Its options, as `luxmap render` takes them.
    pub options: Vec<String>,
    /// What became of it.
    pub status: Status,
    /// What it found.
    pub figures: Option<RunFigures>,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Why it failed, or which requirement it misses.
    pub message: Option<String>,
}

/// What a run found, in short.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunFigures {
    /// How it was computed.
    pub method: String,
    /// Seed of the random streams.
    pub seed: u64,
    /// Passes, those of a checkpoint included.
    pub passes: u32,
    /// Photons emitted, all passes together.
    pub photons: u64,
    /// Wall time, s; of a resumed run since it was resumed.
    pub seconds: f64,
    /// Peak memory, bytes, where the system tells.
    pub peak_memory_bytes: Option<u64>,
    /// Where light was measured.
    pub places: Vec<PlaceFigures>,
}

/// What was found at a place; lx where light can arrive at all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaceFigures {
    /// `plane`, `surface`, `sensor` or `camera`.
    pub kind: String,
    /// Its name.
    pub name: String,
    /// Ē; of a camera, of what it sees.
    pub mean_lx: Option<f64>,
    /// E_min.
    pub min_lx: Option<f64>,
    /// U₀ = E_min / Ē.
    pub u0: Option<f64>,
    /// Claimed standard error (1 σ) of a point, % of the mean.
    pub standard_error_percent: Option<f64>,
}

impl RunFigures {
    /// Those of a run's results.
    pub fn of(results: &Results) -> Self {
        let run = &results.run;
        let place = |kind: &str, name: &str, known: bool, [mean, min, u0, error]: [Option<f64>; 4]| PlaceFigures {
            kind: kind.into(),
            name: name.into(),
            mean_lx: mean.filter(|_| known),
            min_lx: min.filter(|_| known),
            u0: u0.filter(|_| known),
            standard_error_percent: error.filter(|error| known && error.is_finite()).map(|error| 100.0 * error),
        };
        let planes = results.maps.iter().map(|map| {
            let found = statistics(map);
            let figures = [found.mean.0, found.min.0, found.uniformity, found.relative_error()].map(Some);
            place("plane", &map.name, found.cells > 0, figures)
        });
        let surfaces = results.surfaces.iter().map(|map| {
            let found = map.figures();
            let error = (found.mean.0 > 0.0).then(|| found.mean_standard_error / found.mean);
            let figures = [Some(found.mean.0), Some(found.min.0), Some(found.uniformity), error];
            place("surface", &map.name, found.samples > 0, figures)
        });
        let sensors = results.sensors.iter().map(|sensor| {
            let e = sensor.illuminance;
            let error = (e > 0.0).then(|| sensor.standard_error / e);
            place("sensor", &sensor.name, sensor.has_value, [Some(e), None, None, error])
        });
        let cameras = results.images.iter().map(|image| {
            place("camera", &image.name, true, [Some(image.mean_illuminance()), None, None, Some(image.claim)])
        });
        Self {
            method: run.method.clone(),
            seed: run.seed,
            passes: run.passes,
            photons: run.photons_emitted,
            seconds: run.total_seconds,
            peak_memory_bytes: (run.peak_memory > 0).then_some(run.peak_memory),
            places: planes.chain(surfaces).chain(cameras).chain(sensors).collect(),
        }
    }
}

/// Writes `summary.csv` and `report.html` into `folder`; returns their paths.
///
/// # Errors
/// [`Error::Write`] where one can't be written.
pub fn write(title: &str, rows: &[RunRow], folder: &Path) -> Result<[PathBuf; 2], Error> {
    let files = ["summary.csv", "report.html"].map(|name| folder.join(name));
    files::write_whole(&files[0], &mut |out| write_csv(rows, out))?;
    files::write_whole(&files[1], &mut |out| out.write_all(page(title, rows).as_bytes()))?;
    Ok(files)
}

/// The summary as CSV.
///
/// # Errors
/// Where `out` fails.
pub fn write_csv(rows: &[RunRow], out: &mut impl Write) -> io::Result<()> {
    let mut table = WriterBuilder::new().from_writer(out);
    table.write_record(HEAD)?;
    let six = |value: Option<f64>| value.map_or_else(String::new, |value| round_to(value, 6).to_string());
    for row in rows {
        let start =
            [row.name.clone(), row.scene.display().to_string(), row.options.join(" "), row.status.name().into()];
        let run = row.figures.as_ref().map_or_else(Default::default, |found| {
            let memory = found.peak_memory_bytes.map_or_else(String::new, |bytes| bytes.to_string());
            let (seed, passes, photons) = (found.seed, found.passes, found.photons);
            let seconds = six(Some(found.seconds));
            [found.method.clone(), seed.to_string(), passes.to_string(), photons.to_string(), seconds, memory]
        });
        let end = [row.warnings.join("; "), row.message.clone().unwrap_or_default()];
        let mut line = |place: [String; 6]| table.write_record(start.iter().chain(&run).chain(&place).chain(&end));
        match row.figures.as_ref().map_or(&[][..], |found| &found.places) {
            [] => line(Default::default())?,
            places => places.iter().try_for_each(|place| {
                let [mean, min] = [place.mean_lx, place.min_lx].map(six);
                let [u0, error] = [place.u0, place.standard_error_percent].map(six);
                line([place.kind.clone(), place.name.clone(), mean, min, u0, error])
            })?,
        }
    }
    table.flush()
}

/// The summary as JSON, indented, with a line end.
pub fn json(rows: &[RunRow]) -> String {
    #[derive(Serialize)]
    struct RunsJson<'a> {
        luxmap: &'static str,
        runs: &'a [RunRow],
    }
    let batch = RunsJson { luxmap: env!("CARGO_PKG_VERSION"), runs: rows };
    serde_json::to_string_pretty(&batch).expect("numbers, texts and lists make JSON") + "\n"
}

/// What became of the runs, in one line: `5 runs: 3 done, 2 failed`.
pub fn in_short(rows: &[RunRow]) -> String {
    let parts = Status::ALL.into_iter().filter_map(|(name, status)| {
        let count = rows.iter().filter(|row| row.status == status).count();
        (count > 0).then(|| format!("{count} {name}"))
    });
    let runs = if rows.len() == 1 { "1 run".into() } else { format!("{} runs", rows.len()) };
    format!("{runs}: {}", parts.collect::<Vec<_>>().join(", "))
}

/// The summary for a terminal.
pub fn text(rows: &[RunRow]) -> String {
    let head = ["run", "status", "passes", "time", "place", "Ē, lx", "E_min, lx", "U₀", "σ, %"];
    let lines = rows.iter().flat_map(|row| {
        let (passes, time) = row
            .figures
            .as_ref()
            .map_or_else(Default::default, |found| (found.passes.to_string(), duration(found.seconds)));
        let mut start = Some([row.name.clone(), row.status.name().into(), passes, time]);
        let mut places = shown(row);
        if places.is_empty() {
            places.push(Default::default());
        }
        let line = move |[place, mean, min, u0, error]: [String; 5]| {
            let [name, status, passes, time] = start.take().unwrap_or_default();
            [name, status, passes, time, place, mean, min, u0, error]
        };
        places.into_iter().map(line).collect::<Vec<_>>()
    });
    let mut lines = columns(head, lines);
    let messages = rows.iter().filter_map(|row| Some(format!("{}: {}", row.name, row.message.as_ref()?)));
    let messages: Vec<String> = messages.collect();
    if !messages.is_empty() {
        lines.push(String::new());
        lines.extend(messages);
    }
    lines.join("\n") + "\n"
}

/// Name, Ē, E_min, U₀ and σ of a run's places, as people read them.
fn shown(row: &RunRow) -> Vec<[String; 5]> {
    let places = row.figures.as_ref().map_or(&[][..], |found| &found.places);
    let known = |value: Option<f64>, text: fn(f64) -> String| value.map_or_else(|| "–".into(), text);
    let line = |place: &PlaceFigures| {
        let [mean, min] = [place.mean_lx, place.min_lx].map(|lux| known(lux, short));
        let u0 = known(place.u0, |u0| format!("{u0:.2}"));
        [place.name.clone(), mean, min, u0, known(place.standard_error_percent, |error| percent(error / 100.0))]
    };
    let mut lines: Vec<_> = places.iter().take(MOST_PLACES).map(line).collect();
    if places.len() > MOST_PLACES {
        let mut more: [String; 5] = Default::default();
        more[0] = format!("and {} more", places.len() - MOST_PLACES);
        lines.push(more);
    }
    lines
}

/// The summary as one HTML file that needs nothing else, and links to each run's report.
pub fn page(title: &str, rows: &[RunRow]) -> String {
    let said = |row: &RunRow| row.warnings.iter().map(|warning| format!("{}: {warning}", row.name)).collect::<Vec<_>>();
    let main = html! {
        header { h1 { (title) } p { (in_short(rows)) } }
        (messages(rows))
        (warnings(&rows.iter().flat_map(said).collect::<Vec<_>>()))
        (runs(rows))
    };
    document(title, &[STYLE], &main)
}

/// Why runs failed, and what others miss.
fn messages(rows: &[RunRow]) -> Markup {
    let said = rows.iter().filter_map(|row| Some((&row.name, row.message.as_ref()?)));
    let items: Vec<Markup> = said.map(|(name, message)| html! { b { (name) } ": " (message) }).collect();
    html! {
        @if !items.is_empty() {
            section class="failed" { h2 { "Not as asked for" } (list(items)) } "\n"
        }
    }
}

/// All runs in one table.
fn runs(rows: &[RunRow]) -> Markup {
    let head = [
        "Run",
        "Status",
        "Place",
        "Ē, lx",
        "E<sub>min</sub>, lx",
        "U<sub>0</sub>",
        "σ, %",
        "Method",
        "Passes",
        "Photons",
        "Time",
        "Memory, MB",
    ]
    .map(own);
    let content = html! {
        (table(head, rows.iter().map(run)))
        p {
            "σ is the claimed standard error of a point, in per cent of the mean. The time of a resumed run counts \
             from when it was resumed. " code { "summary.csv" } " has every place."
        }
    };
    section("Runs", content)
}

/// A run's line.
fn run(row: &RunRow) -> [Markup; 12] {
    let class = match row.status {
        Status::Done | Status::Resumed | Status::DoneBefore if row.message.is_none() => "met",
        Status::Interrupted | Status::NotBegun => "open",
        _ => "missed",
    };
    let name = html! {
        @if row.figures.is_some() {
            a href={ (row.name.replace(' ', "%20")) "/report.html" } { (row.name) }
        } @else {
            (row.name)
        }
        small { (row.scene.display().to_string()) br; @for option in &row.options { span { (option) } " " } }
    };
    let places = shown(row);
    let column = |at: usize| {
        html! { @for (number, place) in places.iter().enumerate() { @if number > 0 { br; } (place[at]) } }
    };
    let [method, passes, photons, time, memory] = row.figures.as_ref().map_or_else(Default::default, |found| {
        let memory = found.peak_memory_bytes.map_or_else(String::new, |bytes| short(bytes as f64 / 1e6));
        [found.method.clone(), found.passes.to_string(), count(found.photons), duration(found.seconds), memory]
    });
    [
        name,
        html! { span class=(class) { (row.status.name()) } },
        column(0),
        column(1),
        column(2),
        column(3),
        column(4),
        method.render(),
        passes.render(),
        photons.render(),
        time.render(),
        memory.render(),
    ]
}
