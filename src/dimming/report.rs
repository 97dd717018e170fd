//! The influence matrix and dimming levels for a person at a terminal.

use crate::dimming::Influence;
use crate::dimming::sure::{Known, Sure};
use crate::report::table::columns;
use crate::results::Verdict;
use crate::results::{Results, SensorReading};
use crate::text::number::{percent, short};

/// Of each sensor: what it reads with all luminaires at full output, and which of them bring most of that.
pub fn influence(matrix: &Influence) -> String {
    let count = matrix.luminaires.len();
    let mut lines =
        vec![format!("{}: influence of {count} luminaires on {} sensors", matrix.scene, matrix.sensors.len())];
    lines.push(String::new());
    let head = [
        "sensor",
        "E at full output, lx",
        "daylight, lx",
        "first",
        "lx",
        "σ, lx",
        "lx/cd",
        "second",
        "lx",
        "third",
        "lx",
    ];
    let row = |sensor: usize| {
        let (lux, errors) = (&matrix.lux[sensor], &matrix.standard_error[sensor]);
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|&a, &b| lux[b].total_cmp(&lux[a]));
        let place = &matrix.sensors[sensor];
        let name = |rank: usize| order.get(rank).map_or_else(String::new, |&lamp| matrix.luminaires[lamp].name.clone());
        let of = |rank: usize, table: &[f64]| order.get(rank).map_or_else(String::new, |&lamp| short(table[lamp]));
        let candela = order.first().and_then(|&lamp| Some(lux[lamp] / matrix.luminaires[lamp].candela?));
        [
            place.name.clone(),
            short(matrix.most(sensor) - place.daylight),
            short(place.daylight),
            name(0),
            of(0, lux),
            of(0, errors),
            candela.map_or_else(|| "–".into(), short),
            name(1),
            of(1, lux),
            name(2),
            of(2, lux),
        ]
    };
    lines.extend(columns(head, (0..matrix.sensors.len()).map(row)));
    lines.join("\n") + "\n"
}

/// Levels, and all there is to say of them.
pub struct DimmingResult<'a> {
    /// The matrix, and what renders said of it.
    pub known: &'a Known,
    /// The levels.
    pub sure: &'a Sure,
    /// What can be said of each sensor's target.
    pub verdicts: Vec<Option<Verdict>>,
    /// The last render that verified them.
    pub verified: Option<&'a Results>,
    /// How many renders there were.
    pub renders: u64,
    /// How sure targets are met together, %.
    pub confidence: f64,
}

impl DimmingResult<'_> {
    /// Whether each target is surely met.
    fn all_met(&self) -> bool {
        self.verdicts.iter().flatten().all(|verdict| *verdict == Verdict::Met)
    }

    /// Power, what the margin costs, and what is saved, if that may be called so.
    fn power(&self) -> Vec<String> {
        let (matrix, answer) = (&self.known.mean, &self.sure.answer);
        let (unit, full) = (matrix.power_unit(), matrix.full_power());
        let saved = if full > 0.0 { 1.0 - answer.power / full } else { 0.0 };
        let met = if self.all_met() { "saved" } else { "less, but not all targets are surely met" };
        let mut lines = vec![format!(
            "power  {} {unit} of {} {unit} at full output: {} % {met}",
            short(answer.power),
            short(full),
            percent(saved)
        )];
        let margin = answer.power - self.sure.bare;
        if margin > 1e-4 * full {
            let by = match self.renders {
                0 => "the matrix alone".to_owned(),
                1 => "matrix and a render".to_owned(),
                renders => format!("matrix and {renders} renders"),
            };
            let confidence = short(self.confidence);
            lines.push(format!(
                "       {} {unit} of it are the margin for {confidence} % confidence, by {by}",
                short(margin)
            ));
        }
        if unit == "lm" {
            lines.push("       no power is given for some luminaire: luminous flux stands for it".into());
        }
        if let Some(bound) = answer.bound.filter(|bound| answer.power - bound > 1e-4 * full) {
            lines.push(format!("       the search was cut short: no levels need less than {} {unit}", short(bound)));
        }
        lines
    }
}

/// Levels found, what they reach and what they save.
pub fn dimming(found: &DimmingResult<'_>) -> String {
    let (matrix, levels) = (&found.known.mean, &found.sure.answer.levels);
    let unit = matrix.power_unit();
    let mut lines =
        vec![format!("{}: {} luminaires, {} sensors", matrix.scene, matrix.luminaires.len(), matrix.sensors.len())];
    lines.extend(found.power());
    lines.push(String::new());
    let head = ["sensor", "target, lx", "E, lx", "σ, lx", "last render, lx", "σ, lx", "at full output, lx", ""];
    let row = |number: usize| {
        let place = &matrix.sensors[number];
        let reading = found.verified.and_then(|results| results.sensor(&place.name));
        let read =
            |value: &dyn Fn(&SensorReading) -> f64| reading.map_or_else(|| "–".into(), |reading| short(value(reading)));
        let target = match (place.target, place.tolerance) {
            (Some(target), Some(tolerance)) => format!("{} … {}", short(target), short(target + tolerance)),
            (target, _) => target.map_or_else(String::new, short),
        };
        [
            place.name.clone(),
            target,
            short(matrix.illuminance(number, levels)),
            short(found.known.error(number, levels)),
            read(&|reading| reading.illuminance + place.daylight),
            read(&|reading| reading.standard_error),
            short(matrix.most(number)),
            found.verdicts[number].map_or("", Verdict::word).into(),
        ]
    };
    lines.extend(columns(head, (0..matrix.sensors.len()).map(row)));
    lines.push(String::new());
    let row = |lamp: usize| {
        let level = levels[lamp];
        let luminaire = &matrix.luminaires[lamp];
        let state = if level <= 0.0 { "off".into() } else { format!("{:.1}", 100.0 * level) };
        [luminaire.name.clone(), luminaire.group.clone(), state, short(matrix.power_of(lamp, level))]
    };
    let head = ["luminaire", "group", "level, %", if unit == "W" { "power, W" } else { "flux, lm" }];
    lines.extend(columns(head, (0..matrix.luminaires.len()).map(row)));
    lines.join("\n") + "\n"
}
