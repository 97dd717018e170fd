//! The script of a simulation: TOML in, a controller and a list of events out, every mistake named with its line.
//!
//! ```toml
//! controller = "ana-rc"     # or "uniform", "optimum"; parameters in a section of that name
//! duration = 1800           # s
//! step = 1.0                # s from one measurement to the next
//! seed = 0
//! level = 1.0               # of all luminaires at the start; else as the scene has them
//! noise = 0                 # of all sensors, lx (1 σ)
//! band = 50                 # lx: a target counts as met this close
//!
//! [ana-rc]
//! weight = 0.33
//!
//! [[event]]
//! at = 600                  # s
//! sensor = "desk 1"
//! target = 700              # lx; somebody sits there from now on
//! ```
//!
//! Other events of a sensor: `comes = true` (with the last target there was), `leaves = true`, `tolerance = 50` (beside a
//! target), `fails = true` (silent), `reads = 300` (whatever there is), `fails = false` (mended), `noise = 5`, `daylight = 120`;
//! the last two of all sensors where none is named. Of a luminaire: `fails = true` (off), `stuck = 0.4`, `fails = false`. Events
//! at 0 change how things begin.

use std::path::Path;

use toml::de::DeTable;

use super::{CONTROLLERS, Make};
use crate::dimming::Influence;
use crate::error::{InputError, Location};
use crate::scene::fields::{Fields, Placed, Source, closest};
use crate::text::listed;
use crate::text::number::{duration, short};
use crate::text::quoted;

/// Most rows × (sensors + luminaires) of a simulation.
const MOST_VALUES: f64 = 5e7;

/// What is to happen.
pub struct Script {
    /// Name of the controller.
    pub controller: String,
    /// Length, s.
    pub duration: f64,
    /// From one measurement to the next, s.
    pub step: f64,
    /// Seed of the controller's random numbers and of noise.
    pub seed: u64,
    /// Level of all luminaires at the start; those of the scene where it says nothing.
    pub level: Option<f64>,
    /// Noise of all sensors at the start, lx (1 σ).
    pub noise: f64,
    /// How close to a target counts as met, lx.
    pub band: f64,
    /// By time.
    pub events: Vec<Event>,
    /// Makes the controller.
    pub(super) make: Make,
}

/// Something that happens.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// Time since the start, s.
    pub at: f64,
    /// What it is in words.
    pub words: String,
    /// What changes.
    pub acts: Vec<Act>,
}

/// What changes in the room; sensors and luminaires by number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Act {
    /// A worker is there, with a target (lx) or the last one.
    Asks {
        /// Where.
        sensor: usize,
        /// For what; the last target where nothing is said.
        target: Option<f64>,
        /// How much more is welcome; as before where nothing is said.
        tolerance: Option<f64>,
    },
    /// Nobody is there any more.
    Leaves {
        /// Where.
        sensor: usize,
    },
    /// The sensor sends nothing.
    Silent {
        /// Which.
        sensor: usize,
    },
    /// The sensor reads the same whatever there is.
    Reads {
        /// Which.
        sensor: usize,
        /// What, lx.
        lux: f64,
    },
    /// The sensor works again.
    SensorMended {
        /// Which.
        sensor: usize,
    },
    /// Readings scatter.
    Noise {
        /// Which; all where nothing is said.
        sensor: Option<usize>,
        /// Standard deviation, lx.
        lux: f64,
    },
    /// Light besides the luminaires'.
    Daylight {
        /// Where; everywhere where nothing is said.
        sensor: Option<usize>,
        /// How much from now on, lx.
        lux: f64,
    },
    /// The luminaire stays at a level, whatever it is told.
    Stuck {
        /// Which.
        luminaire: usize,
        /// Where; 0 is off.
        level: f64,
    },
    /// The luminaire works again.
    LuminaireMended {
        /// Which.
        luminaire: usize,
    },
}

impl Script {
    /// Reads the text of the script at `path` for the room that `influence` tells of.
    ///
    /// # Errors
    /// Where the text is no such script, or names what the room doesn't have.
    pub fn parse(path: &Path, text: &str, influence: &Influence) -> Result<Self, InputError> {
        let source = Source::new(path, text);
        let table = source.table(text)?;
        let names = CONTROLLERS.map(|controller| controller.name);
        let known: Vec<&str> = ["controller", "duration", "step", "seed", "level", "noise", "band", "event"]
            .into_iter()
            .chain(CONTROLLERS.iter().filter(|named| !named.keys.is_empty()).map(|named| named.name))
            .collect();
        let top = Fields::new(&source, "the script", Location::file(path), table.get_ref(), &known)?;
        let chosen = top.text("controller")?.unwrap_or(Placed { value: names[0].into(), at: Location::file(path) });
        let mut make = None;
        for named in &CONTROLLERS {
            // A section of a controller that isn't chosen is checked too.
            let section = top.table(named.name, &format!("a section [{}]", named.name), named.keys)?;
            let read = (named.read)(section.as_ref())?;
            if named.name == chosen.value {
                make = Some(read);
            }
        }
        let make = make.ok_or_else(|| unknown("controller", &chosen, names.into_iter()))?;

        let seconds = |key: &str, default: f64| {
            let found = top.number(key, "a number of seconds above 0", |n| n > 0.0 && n <= 1e9)?;
            Ok::<_, InputError>(found.map_or(default, |found| found.value))
        };
        let (duration, step) = (seconds("duration", 1800.0)?, seconds("step", 1.0)?);
        let values = (duration / step + 1.0) * (influence.sensors.len() + influence.luminaires.len()) as f64;
        if values > MOST_VALUES || step > duration {
            let expected = match step > duration {
                true => "at least a step".to_owned(),
                false => format!("at most {MOST_VALUES:e} values of sensors and luminaires; longer steps or less time"),
            };
            let found = format!("duration = {duration} (s) in steps of {step} s");
            return Err(InputError::new(Location::file(path), found, expected));
        }
        let lux = |key: &str, default: f64| {
            let found = top.number(key, "a number from 0 up, lx", |n| (0.0..=1e6).contains(&n))?;
            Ok::<_, InputError>(found.map_or(default, |found| found.value))
        };
        let mut script = Self {
            controller: chosen.value,
            duration,
            step,
            seed: top.whole("seed", 0, u64::MAX)?.map_or(0, |seed| seed.value),
            level: top.number("level", "a level from 0 to 1", |n| (0.0..=1.0).contains(&n))?.map(|level| level.value),
            noise: lux("noise", 0.0)?,
            band: lux("band", 50.0)?,
            events: Vec::new(),
            make,
        };
        let mut events = Vec::new();
        for (at, section) in top.sections("event")? {
            events.push((at.clone(), event(&source, at, section, influence, duration)?));
        }
        events.sort_by(|(_, a), (_, b)| a.at.total_cmp(&b.at));
        check_targets(&events, influence)?;
        script.events = events.into_iter().map(|(_, event)| event).collect();
        Ok(script)
    }

    /// Measurements from start to end, both included.
    pub(super) fn rows(&self) -> usize {
        // A duration of a whole number of steps has its last measurement, whatever rounding does.
        (self.duration / self.step + 1e-9).floor() as usize + 1
    }

    /// Time of a measurement, s.
    pub(super) fn time(&self, row: usize) -> f64 {
        row as f64 * self.step
    }
}

/// A refusal of a name that nothing has.
fn unknown<'a>(what: &str, name: &Placed<String>, known: impl Iterator<Item = &'a str> + Clone) -> InputError {
    let found = format!("{what} = {}, which there is none of", quoted(&name.value));
    let error = InputError::new(name.at.clone(), found, format!("one of {}", listed(known.clone())));
    match closest(&name.value, known) {
        Some(near) => error.hint(format!("did you mean {}?", quoted(near))),
        None => error,
    }
}

/// Keys of an `[[event]]`.
const KEYS: [&str; 12] = [
    "at",
    "sensor",
    "luminaire",
    "target",
    "tolerance",
    "comes",
    "leaves",
    "fails",
    "reads",
    "stuck",
    "noise",
    "daylight",
];

/// Reads an `[[event]]`.
fn event(
    source: &Source,
    at: Location,
    section: &DeTable,
    influence: &Influence,
    end: f64,
) -> Result<Event, InputError> {
    let fields = Fields::new(source, "[[event]]", at, section, &KEYS)?;
    let within = format!("a time from 0 to {end} (the duration), s");
    let at = fields.number("at", &within, |n| (0.0..=end).contains(&n))?;
    let at = at.ok_or_else(|| fields.missing("at", "600 (s)"))?.value;
    let sensors: Vec<&str> = influence.sensors.iter().map(|sensor| sensor.name.as_str()).collect();
    let luminaires: Vec<&str> = influence.luminaires.iter().map(|luminaire| luminaire.name.as_str()).collect();
    let (sensor_name, luminaire_name) = (fields.text("sensor")?, fields.text("luminaire")?);
    let sensor = numbered("sensor", &sensors, sensor_name.as_ref())?;
    let luminaire = numbered("luminaire", &luminaires, luminaire_name.as_ref())?;
    check_subject(&fields, sensor.is_some(), luminaire.is_some())?;
    let changes = Changes::read(&fields)?;

    let (mut acts, mut words) = (Vec::new(), Vec::new());
    let of_sensor = sensor.into_iter().flat_map(|sensor| changes.of_sensor(sensor));
    let of_luminaire = luminaire.and_then(|luminaire| changes.of_luminaire(luminaire));
    for (act, text) in of_sensor.chain(of_luminaire).chain(changes.of_readings(sensor)) {
        acts.push(act);
        words.push(text);
    }
    if acts.is_empty() {
        let expected = "something that happens, as sensor = \"desk 1\" with target = 700, comes or leaves = true";
        return Err(InputError::new(fields.at.clone(), format!("[[event]] at {at} s without anything"), expected));
    }
    let subject = sensor_name.or(luminaire_name).map_or_else(String::new, |name| format!("{} ", name.value));
    Ok(Event { at, words: format!("{subject}{}", words.join(", ")), acts })
}

/// The number of what `key` names, if it names anything.
fn numbered(key: &str, names: &[&str], name: Option<&Placed<String>>) -> Result<Option<usize>, InputError> {
    let Some(name) = name else { return Ok(None) };
    let found = names.iter().position(|known| *known == name.value);
    found.map(Some).ok_or_else(|| unknown(key, name, names.iter().copied()))
}

/// Refuses keys that make no sense without their subject, or two subjects at once.
fn check_subject(fields: &Fields, sensor: bool, luminaire: bool) -> Result<(), InputError> {
    if sensor && luminaire {
        return Err(fields.refusal("luminaire", "either a sensor or a luminaire; two events for both"));
    }
    let of = |keys: &[&str], fits: bool, expected: &str| match keys.iter().find(|key| fields.keys().contains(key)) {
        Some(key) if !fits => Err(fields.refusal(key, expected)),
        _ => Ok(()),
    };
    of(&["target", "tolerance", "comes", "leaves", "reads"], sensor, "it beside sensor = \"…\"")?;
    of(&["stuck"], luminaire, "it beside luminaire = \"…\"")?;
    of(&["fails"], sensor || luminaire, "it beside sensor = \"…\" or luminaire = \"…\"")?;
    of(&["noise", "daylight"], !luminaire, "it beside sensor = \"…\", or alone for all sensors")
}

/// What the keys of an `[[event]]` change; lx.
struct Changes {
    target: Option<f64>,
    tolerance: Option<f64>,
    reads: Option<f64>,
    noise: Option<f64>,
    daylight: Option<f64>,
    comes: bool,
    leaves: bool,
    fails: Option<bool>,
    /// Level, from 0 to 1.
    stuck: Option<f64>,
}

impl Changes {
    /// Reads them, and refuses those that contradict each other.
    fn read(fields: &Fields) -> Result<Self, InputError> {
        let lux = |key: &str| {
            let found = fields.number(key, "a number from 0 up, lx", |n| (0.0..=1e6).contains(&n))?;
            Ok::<_, InputError>(found.map(|found| found.value))
        };
        let only_true = |key: &str| match fields.switch(key)? {
            Some(Placed { value: false, .. }) => Err(fields.refusal(key, "true, or nothing")),
            found => Ok(found.is_some()),
        };
        let level = |key: &str| {
            let found = fields.number(key, "a level from 0 to 1", |n| (0.0..=1.0).contains(&n))?;
            Ok::<_, InputError>(found.map(|level| level.value))
        };
        // In this order: the first mistake is told.
        let changes = Self {
            target: lux("target")?,
            tolerance: lux("tolerance")?,
            reads: lux("reads")?,
            noise: lux("noise")?,
            daylight: lux("daylight")?,
            comes: only_true("comes")?,
            leaves: only_true("leaves")?,
            fails: fields.switch("fails")?.map(|fails| fails.value),
            stuck: level("stuck")?,
        };
        let Self { target, tolerance, reads, comes, leaves, fails, stuck, .. } = changes;
        if leaves && (comes || target.is_some() || tolerance.is_some()) {
            return Err(fields.refusal("leaves", "somebody who comes or leaves, not both"));
        }
        if tolerance.is_some() && target.is_none() {
            return Err(fields.refusal("tolerance", "it beside a target"));
        }
        if fails.is_some() && (reads.is_some() || stuck.is_some()) {
            return Err(fields.refusal("fails", "it without reads or stuck, which say how it fails"));
        }
        Ok(changes)
    }

    /// Who is at a sensor, and whether it works; with words.
    fn of_sensor(&self, sensor: usize) -> Vec<(Act, String)> {
        let Self { target, tolerance, .. } = *self;
        let who = match target {
            Some(lux) => Some((Act::Asks { sensor, target, tolerance }, format!("asks for {} lx", short(lux)))),
            None if self.comes => Some((Act::Asks { sensor, target, tolerance }, "comes".into())),
            None if self.leaves => Some((Act::Leaves { sensor }, "leaves".into())),
            None => None,
        };
        let works = match (self.reads, self.fails) {
            (Some(lux), _) => Some((Act::Reads { sensor, lux }, format!("reads {} lx, whatever there is", short(lux)))),
            (None, Some(true)) => Some((Act::Silent { sensor }, "falls silent".into())),
            (None, Some(false)) => Some((Act::SensorMended { sensor }, "works again".into())),
            (None, None) => None,
        };
        who.into_iter().chain(works).collect()
    }

    /// Whether a luminaire works; with words.
    fn of_luminaire(&self, luminaire: usize) -> Option<(Act, String)> {
        match (self.stuck, self.fails) {
            (Some(level), _) => {
                Some((Act::Stuck { luminaire, level }, format!("is stuck at {} %", short(100.0 * level))))
            }
            (None, Some(true)) => Some((Act::Stuck { luminaire, level: 0.0 }, "fails".into())),
            (None, Some(false)) => Some((Act::LuminaireMended { luminaire }, "works again".into())),
            (None, None) => None,
        }
    }

    /// Noise and daylight of a sensor, or of all; with words.
    fn of_readings(&self, sensor: Option<usize>) -> impl Iterator<Item = (Act, String)> {
        let noise = self.noise.map(|lux| (Act::Noise { sensor, lux }, format!("noise of {} lx", short(lux))));
        let daylight =
            self.daylight.map(|lux| (Act::Daylight { sensor, lux }, format!("daylight of {} lx", short(lux))));
        noise.into_iter().chain(daylight)
    }
}

/// Refuses somebody who comes, by `comes` alone, to where there has never been a target.
fn check_targets(events: &[(Location, Event)], influence: &Influence) -> Result<(), InputError> {
    let mut known: Vec<bool> = influence.sensors.iter().map(|sensor| sensor.target.is_some()).collect();
    for (location, event) in events {
        for act in &event.acts {
            if let Act::Asks { sensor, target, .. } = act {
                known[*sensor] |= target.is_some();
                if !known[*sensor] {
                    let name = quoted(&influence.sensors[*sensor].name);
                    let found = format!("comes = true at {} at sensor {name}, which has no target", duration(event.at));
                    return Err(InputError::new(location.clone(), found, "a target beside it, as target = 500 (lx)"));
                }
            }
        }
    }
    Ok(())
}
