//! What `luxmap control` leaves behind: `control.csv`, `control.html`, a table and JSON.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use maud::{Markup, html};
use serde::Serialize;

use crate::control::{HOLD, Phase, Script, Series, TimeStep, Turn, phases};
use crate::dimming::Influence;
use crate::error::Error;
use crate::error::invalid;
use crate::files;
use crate::report::html::{document, figure, section, table as html_table};
use crate::report::make_folder;
use crate::report::plot::{Axis, Chart};
use crate::report::table::columns;
use crate::text::number::{duration, round_to, short};

/// Looks that this page adds.
const STYLE: &str = include_str!("report.css");
/// Most points of a curve: two for each unit of a chart's width.
const MOST_POINTS: usize = 600;
/// Most charts of sensors, and rows of luminaires, on the page; the CSV file has all.
const MOST_SHOWN: usize = 60;
const MOST_ROWS: usize = 144;
/// Most letters of a luminaire's name beside its row.
const MOST_LETTERS: usize = 18;
/// Height of a luminaire's row, at least, and of the text beside it, in the chart's units.
const ROW: f64 = 5.0;
const TEXT: f64 = 14.0;

/// A simulation with what it is of.
pub struct Simulation<'a> {
    /// The room.
    pub influence: &'a Influence,
    /// What was to happen.
    pub script: &'a Script,
    /// Seed of the controller and of noise.
    pub seed: u64,
    /// What happened.
    pub series: &'a Series,
}

/// Writes `control.csv` and `control.html` into `folder`, making it where it's missing. Returns their paths.
///
/// # Errors
/// [`Error::Write`] where the folder or a file can't be written, and where a value isn't finite.
pub fn write(simulation: &Simulation<'_>, folder: &Path) -> Result<Vec<PathBuf>, Error> {
    make_folder(folder)?;
    let paths = ["control.csv", "control.html"].map(|name| folder.join(name));
    files::write_whole(&paths[0], &mut |out| write_csv(simulation, out))?;
    files::write_whole(&paths[1], &mut |out| out.write_all(page(simulation).as_bytes()))?;
    Ok(paths.into())
}

/// One line for each measurement: time (s), power and the optimum's (W, or lm where power isn't known), then of each
/// sensor the true E, what it read (empty when silent) and the target (empty where nobody is), lx, then the level of
/// each luminaire, 0 … 1. Six significant digits.
///
/// # Errors
/// Where `out` fails, and where a value isn't finite.
pub fn write_csv(simulation: &Simulation<'_>, out: &mut impl Write) -> io::Result<()> {
    let Simulation { influence, series, .. } = simulation;
    let mut table = ::csv::WriterBuilder::new().from_writer(out);
    let unit = influence.power_unit();
    let sensors = influence
        .sensors
        .iter()
        .flat_map(|sensor| ["E_lx", "reading_lx", "target_lx"].map(|quantity| format!("{quantity} {}", sensor.name)));
    let levels = influence.luminaires.iter().map(|luminaire| format!("level {}", luminaire.name));
    let head = ["time_s".to_owned(), format!("power_{unit}"), format!("optimum_{unit}")];
    table.write_record(head.into_iter().chain(sensors).chain(levels))?;
    let number = |value: f64| round_to(value, 6).to_string();
    let perhaps = |value: Option<f64>| value.map_or_else(String::new, number);
    for row in &series.rows {
        let whole = [row.time, row.power, row.optimum];
        if !whole.iter().chain(&row.lux).chain(&row.levels).all(|value| value.is_finite()) {
            return Err(invalid(format!("a value at {} s isn't finite", row.time)));
        }
        let sensors =
            row.lux.iter().zip(&row.seen).flat_map(|(lux, s)| [number(*lux), perhaps(s.reading), perhaps(s.target)]);
        table
            .write_record(whole.into_iter().map(number).chain(sensors).chain(row.levels.iter().copied().map(number)))?;
    }
    table.flush()
}

/// The results of a phase, cell by cell.
fn figures(phase: &Phase, influence: &Influence) -> [String; 9] {
    let what = if phase.what.is_empty() { "start".to_owned() } else { phase.what.join("; ") };
    let settled = phase.settled.map_or_else(|| "never".into(), |seconds| format!("{seconds:.0} s"));
    let power = |watts: f64| format!("{watts:.1}");
    let excess = match phase.excess() {
        _ if !phase.met => "targets missed".into(),
        None => "–".into(),
        // No levels that draw less than the optimum meet the targets themselves.
        Some(share) if share < -1e-3 => "within the band".into(),
        Some(share) => format!("{:+.1}", 100.0 * share.max(0.0)),
    };
    let names: Vec<&str> = phase.out_of_reach.iter().map(|&sensor| influence.sensors[sensor].name.as_str()).collect();
    [
        duration(phase.from),
        what,
        settled,
        power(phase.power),
        power(phase.optimum),
        excess,
        format!("{:.0}", phase.below),
        format!("{:.0}", phase.above),
        names.join(", "),
    ]
}

/// Heads of the table, for power in a unit.
fn head(unit: &str) -> [String; 9] {
    [
        "from".into(),
        "event".into(),
        "targets met after".into(),
        format!("power, {unit}"),
        format!("optimum, {unit}"),
        "more, %".into(),
        "below target, lx".into(),
        "above, lx".into(),
        "can't be met".into(),
    ]
}

/// The simulation for a person at a terminal.
pub fn table(simulation: &Simulation<'_>) -> String {
    let Simulation { influence, script, seed, series } = simulation;
    let head = head(influence.power_unit());
    let phases = phases(series, script);
    let mut lines = vec![format!("{}: {}, seed {seed}", influence.scene, script.controller), String::new()];
    lines.extend(columns(head.each_ref().map(String::as_str), phases.iter().map(|phase| figures(phase, influence))));
    lines.push(String::new());
    lines.push(
        "power and worst misses: of the last third of each phase; power is not compared where targets are missed"
            .into(),
    );
    lines.join("\n") + "\n"
}

#[derive(Serialize)]
struct ControlJson<'a> {
    luxmap: &'static str,
    scene: &'a str,
    scene_sha256: &'a str,
    controller: &'a str,
    seed: u64,
    power_unit: &'static str,
    phases: Vec<PhaseSummary>,
}

#[derive(Serialize)]
struct PhaseSummary {
    from_s: f64,
    to_s: f64,
    events: Vec<String>,
    settled_s: Option<f64>,
    power: f64,
    optimum: f64,
    /// Nothing where targets are missed: less power is no saving then.
    excess_percent: Option<f64>,
    targets_met: bool,
    below_lx: f64,
    above_lx: f64,
    mean_miss_lx: f64,
    out_of_reach: Vec<String>,
}

/// The simulation for programs: one JSON object.
pub fn json(simulation: &Simulation<'_>) -> String {
    let Simulation { influence, script, seed, series } = simulation;
    let phases = phases(series, script);
    let summarise = |phase: &Phase| PhaseSummary {
        from_s: phase.from,
        to_s: phase.to,
        events: phase.what.clone(),
        settled_s: phase.settled,
        power: phase.power,
        optimum: phase.optimum,
        excess_percent: phase.excess().filter(|_| phase.met).map(|share| 100.0 * share),
        targets_met: phase.met,
        below_lx: phase.below,
        above_lx: phase.above,
        mean_miss_lx: phase.mean_miss,
        out_of_reach: phase.out_of_reach.iter().map(|&sensor| influence.sensors[sensor].name.clone()).collect(),
    };
    let summary = ControlJson {
        luxmap: env!("CARGO_PKG_VERSION"),
        scene: &influence.scene,
        scene_sha256: &influence.scene_sha256,
        controller: &script.controller,
        seed: *seed,
        power_unit: influence.power_unit(),
        phases: phases.iter().map(summarise).collect(),
    };
    let mut text = serde_json::to_string_pretty(&summary).expect("numbers, texts and lists make JSON");
    text.push('\n');
    text
}

/// The simulation as one HTML file that needs nothing else.
pub fn page(simulation: &Simulation<'_>) -> String {
    let Simulation { influence, script, seed, series } = simulation;
    let scene = &influence.scene;
    let heads = head(influence.power_unit()).map(|text| {
        let mut letters = text.chars();
        letters.next().map(|first| first.to_uppercase().chain(letters).collect::<String>()).unwrap_or_default()
    });
    let rows = phases(series, script);
    let rows = rows.iter().map(|phase| figures(phase, influence));
    let phases = html! {
        (html_table(heads, rows))
        p {
            "Power and worst misses are of the last third of each phase. Targets count as met from when on every \
             sensor stays within " (short(script.band)) " lx of its target for " (HOLD.to_string()) " s. The optimum \
             is what least power could be with all that is true at the time known: the controller sees readings, \
             targets and power alone. Power is not compared where targets are missed. " (left_out(influence))
        }
    };
    let course = html! {
        div class="charts" {
            (figure("Power.", "Orange: the optimum. Dashed: events.", &power_chart(simulation)))
            (figure("Levels.", "A row for each luminaire; the stronger the colour, the brighter.", &levels(simulation)))
            @for (number, sensor) in influence.sensors.iter().enumerate().take(MOST_SHOWN) {
                (figure(&sensor.name, "Band: target and tolerance.", &lux_chart(simulation, number)))
            }
        }
    };
    let [duration, step] = [script.duration, script.step].map(duration);
    let main = html! {
        header {
            h1 { (scene) ": light under control" }
            p { (script.controller) ", " (duration) " with a measurement every " (step) ", seed " (seed) "." }
        }
        (section("Phases", phases))
        (section("Course", course))
    };
    document(&format!("{scene}, control"), &[STYLE], &main)
}

/// The axis of time, min.
fn time(series: &Series) -> Axis {
    Axis::linear("time", "min", 0.0, series.rows.last().map_or(1.0, |row| row.time / 60.0))
}

/// Marks the events.
fn events(chart: &mut Chart, series: &Series, [low, high]: [f64; 2]) {
    for turn in series.turns.iter().skip(1) {
        let minutes = turn.time / 60.0;
        chart.line([minutes, low], [minutes, high], "event");
    }
}

/// A curve over time: where there are too many points, least and largest of each stretch.
fn curve(series: &Series, value: impl Fn(&TimeStep) -> f64) -> Vec<[f64; 2]> {
    let stretch = (2 * series.rows.len()).div_ceil(MOST_POINTS).max(1);
    let point = |row: &TimeStep| [row.time / 60.0, value(row)];
    if stretch <= 2 {
        return series.rows.iter().map(point).collect();
    }
    let ends = |rows: &[TimeStep]| {
        let points: Vec<[f64; 2]> = rows.iter().map(point).collect();
        let least = *points.iter().min_by(|a, b| a[1].total_cmp(&b[1])).expect("a stretch has rows");
        let most = *points.iter().max_by(|a, b| a[1].total_cmp(&b[1])).expect("a stretch has rows");
        if least[0] <= most[0] { [least, most] } else { [most, least] }
    };
    series.rows.chunks(stretch).flat_map(ends).collect()
}

fn power_chart(simulation: &Simulation<'_>) -> Markup {
    let Simulation { influence, series, .. } = simulation;
    let most = series.rows.iter().map(|row| row.power.max(row.optimum)).fold(0.0, f64::max);
    let high = 1.05 * most;
    let mut chart = Chart::new(time(series), Axis::linear("power", influence.power_unit(), 0.0, high), 0);
    events(&mut chart, series, [0.0, high]);
    chart.trace(&curve(series, |row| row.power), "found");
    chart.trace(&steps(series, |row| row.optimum), "best");
    chart.svg("Power over time, and that of the optimum")
}

/// A curve that jumps at turns and is level between.
fn steps(series: &Series, value: impl Fn(&TimeStep) -> f64) -> Vec<[f64; 2]> {
    let ends = series.turns.iter().skip(1).map(|turn| turn.row).chain([series.rows.len()]);
    let level = |(turn, end): (&Turn, usize)| {
        let value = value(&series.rows[turn.row]);
        [[turn.time / 60.0, value], [series.rows[end.min(series.rows.len() - 1)].time / 60.0, value]]
    };
    series.turns.iter().zip(ends).flat_map(level).collect()
}

fn levels(simulation: &Simulation<'_>) -> Markup {
    let Simulation { influence, series, .. } = simulation;
    let count = influence.luminaires.len().min(MOST_ROWS);
    let names: Vec<String> = influence.luminaires[..count].iter().map(|lamp| shortened(&lamp.name)).collect();
    let letters = names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let height = (ROW * count as f64).max(256.0);
    let axis = Axis::linear("luminaire", "", 0.0, count as f64);
    let mut chart = Chart::new(time(series), axis, 0).with_rows(letters, height);
    let stretch = series.rows.len().div_ceil(120);
    let each = (TEXT * count as f64 / height).ceil().max(1.0) as usize;
    for (lamp, name) in names.iter().enumerate() {
        if lamp % each == 0 {
            chart.note([0.0, (count - lamp) as f64 - 0.5], [-4.0, 4.5], true, name);
        }
        let (top, bottom) = ((count - lamp) as f64, (count - lamp - 1) as f64 + 0.08);
        for (number, rows) in series.rows.chunks(stretch).enumerate() {
            let mean = rows.iter().map(|row| row.levels[lamp]).sum::<f64>() / rows.len() as f64;
            let end = series.rows.get((number + 1) * stretch).map_or(rows[rows.len() - 1].time, |row| row.time);
            if mean >= 0.005 {
                chart.cell([rows[0].time / 60.0, bottom], [end / 60.0, top], mean, "lamp");
            }
        }
    }
    events(&mut chart, series, [0.0, count as f64]);
    chart.svg("Level of each luminaire over time")
}

/// A name that fits beside its row: what tells it from its neighbours is mostly at its end.
fn shortened(name: &str) -> String {
    let letters: Vec<char> = name.chars().collect();
    if letters.len() <= MOST_LETTERS {
        return name.to_owned();
    }
    let (start, end) = (MOST_LETTERS / 3, MOST_LETTERS - MOST_LETTERS / 3 - 1);
    letters[..start].iter().chain(&['…']).chain(&letters[letters.len() - end..]).collect()
}

/// What the page leaves out, in a sentence.
fn left_out(influence: &Influence) -> String {
    let of = |count: usize, most: usize, what: &str| {
        (count > most).then(|| format!("The page shows the first {most} of {count} {what}; control.csv has all. "))
    };
    let parts =
        [of(influence.luminaires.len(), MOST_ROWS, "luminaires"), of(influence.sensors.len(), MOST_SHOWN, "sensors")];
    parts.into_iter().flatten().collect()
}

fn lux_chart(simulation: &Simulation<'_>, sensor: usize) -> Markup {
    let Simulation { series, script, .. } = simulation;
    let targets = series.rows.iter().filter_map(|row| row.seen[sensor].target);
    let most = series.rows.iter().map(|row| row.lux[sensor]).chain(targets).fold(0.0, f64::max);
    let high = 1.08 * most.max(1.0);
    let mut chart = Chart::new(time(series), Axis::linear("E", "lx", 0.0, high), 0);
    let ends = series.turns.iter().skip(1).map(|turn| turn.time).chain(series.rows.last().map(|row| row.time));
    for (turn, end) in series.turns.iter().zip(ends) {
        let seen = &series.rows[turn.row].seen[sensor];
        let Some(target) = seen.target else { continue };
        let (from, to) = (turn.time / 60.0, end / 60.0);
        let top = target + seen.tolerance.unwrap_or(script.band);
        chart.area(&[[from, target], [to, target], [to, top], [from, top]], "band");
        chart.line([from, target], [to, target], "target");
    }
    events(&mut chart, series, [0.0, high]);
    chart.trace(&curve(series, |row| row.lux[sensor]), "found");
    chart.svg("Illuminance over time, and the target")
}
