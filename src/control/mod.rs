//! A room under control, step by step: sensors read, a [`Controller`] dims, workers come and go, things fail.
//!
//! The room is the [influence matrix](crate::dimming::Influence): E = R d + daylight. A controller sees what its
//! network would give it, readings, targets, what its luminaires are set to and the power meter, and nothing of R or of
//! what has failed. Beside it runs the optimum: the levels of least power for what is true at the time, found anew
//! after every event.
//!
//! A new controller is one file here with a type that implements [`Controller`], and one line in `CONTROLLERS`.

mod ana_rc;
mod optimum;
pub mod report;
mod script;
mod summary;
mod uniform;

use crate::dimming::influence::{Dimmable, SensorRow};
use crate::dimming::{Answer, Goal, Influence, solve};
use crate::error::{Error, InputError};
use crate::random::{Seed, Stream};
use crate::scene::fields::Fields;
pub use ana_rc::{AnaRc, AnaRcParameters};
pub use script::{Act, Event, Script};
pub use summary::{HOLD, Phase, phases};

/// What decides on levels.
pub trait Controller {
    /// The levels that luminaires are to have until the next measurement, one for each, 0 … 1. Values beyond are cut,
    /// values between off and a luminaire's lowest level go to the nearer of the two.
    fn step(&mut self, seen: &Observation<'_>, stream: &mut Stream) -> Vec<f64>;
}

/// Makes a controller for an installation.
pub type Make = Box<dyn Fn(&Installation<'_>) -> Box<dyn Controller> + Send + Sync>;

/// A controller that scripts can name.
pub(crate) struct Named {
    /// As the script has it, and the section with its parameters.
    pub(crate) name: &'static str,
    /// Keys of its section.
    pub(crate) keys: &'static [&'static str],
    /// Reads its section, where there is one.
    pub(crate) read: fn(Option<&Fields<'_>>) -> Result<Make, InputError>,
}

/// All there are.
pub(crate) const CONTROLLERS: [Named; 3] = [
    Named { name: "ana-rc", keys: &ana_rc::KEYS, read: ana_rc::read },
    Named { name: "uniform", keys: &uniform::KEYS, read: uniform::read },
    Named { name: "optimum", keys: &[], read: optimum::read },
];

/// What a controller knows of the room before it begins: all but what light does.
pub struct Installation<'a> {
    influence: &'a Influence,
}

impl<'a> Installation<'a> {
    /// That of a room.
    pub fn of(influence: &'a Influence) -> Self {
        Self { influence }
    }

    /// The luminaires, in the order of levels.
    pub fn luminaires(&self) -> &'a [Dimmable] {
        &self.influence.luminaires
    }

    /// The sensors, in the order of readings.
    pub fn sensors(&self) -> &'a [SensorRow] {
        &self.influence.sensors
    }

    /// What a luminaire draws at a level by its data sheet, in the unit of the power meter.
    pub fn power_of(&self, luminaire: usize, level: f64) -> f64 {
        self.influence.power_of(luminaire, level)
    }
}

/// What a controller gets to see at a measurement.
#[derive(Clone, Copy, Debug)]
pub struct Observation<'a> {
    /// Time since the start, s.
    pub time: f64,
    /// One for each sensor.
    pub sensors: &'a [SensorSignal],
    /// What luminaires were told to be at, while this was measured; one that has failed doesn't say so.
    pub levels: &'a [f64],
    /// The power meter, in [`Influence::power_unit`].
    pub power: f64,
    /// What each luminaire says it draws, in the same unit.
    pub draws: &'a [f64],
    /// Levels of the optimum: unknown in a real room, only for comparison.
    pub oracle: &'a [f64],
}

/// What comes from a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorSignal {
    /// E, lx, with noise; nothing from one that is silent.
    pub reading: Option<f64>,
    /// What the worker there asks for, lx; nothing where nobody is at work.
    pub target: Option<f64>,
    /// How much more is welcome, lx; any where nothing is said.
    pub tolerance: Option<f64>,
}

/// A measurement, and what was true at the time.
#[derive(Clone, Debug, PartialEq)]
pub struct TimeStep {
    /// Time since the start, s.
    pub time: f64,
    /// What is drawn, in [`Influence::power_unit`].
    pub power: f64,
    /// What the optimum would draw.
    pub optimum: f64,
    /// True E of each sensor, lx.
    pub lux: Vec<f64>,
    /// What came from each sensor, and what is asked for there.
    pub seen: Vec<SensorSignal>,
    /// True level of each luminaire.
    pub levels: Vec<f64>,
}

/// What happened, from the start to the end.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// One for each measurement.
    pub rows: Vec<TimeStep>,
    /// Events that came about together: the time, s, in words, and whether all targets can be met from then on. The
    /// first is the start.
    pub turns: Vec<Turn>,
}

/// A time from which another optimum holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Turn {
    /// Since the start, s.
    pub time: f64,
    /// What happened.
    pub what: Vec<String>,
    /// Number of its first row.
    pub row: usize,
    /// Sensors whose targets no levels reach then.
    pub out_of_reach: Vec<usize>,
}

/// How a sensor fails.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    Silent,
    Stuck(f64),
}

/// The room as it is.
struct Room {
    /// Targets and daylight are those of the time.
    influence: Influence,
    /// The last target of each sensor, also of one whose worker has left.
    targets: Vec<Option<f64>>,
    faults: Vec<Option<Fault>>,
    noise: Vec<f64>,
    /// Levels at which luminaires are stuck.
    stuck: Vec<Option<f64>>,
}

impl Room {
    fn new(influence: &Influence, noise: f64) -> Self {
        let (sensors, luminaires) = (influence.sensors.len(), influence.luminaires.len());
        Self {
            influence: influence.clone(),
            targets: influence.sensors.iter().map(|sensor| sensor.target).collect(),
            faults: vec![None; sensors],
            noise: vec![noise; sensors],
            stuck: vec![None; luminaires],
        }
    }

    fn apply(&mut self, act: &Act) {
        match *act {
            Act::Asks { sensor, target, tolerance } => {
                self.targets[sensor] = target.or(self.targets[sensor]);
                let place = &mut self.influence.sensors[sensor];
                place.target = self.targets[sensor];
                place.tolerance = tolerance.or(place.tolerance);
            }
            Act::Leaves { sensor } => self.influence.sensors[sensor].target = None,
            Act::Silent { sensor } => self.faults[sensor] = Some(Fault::Silent),
            Act::Reads { sensor, lux } => self.faults[sensor] = Some(Fault::Stuck(lux)),
            Act::SensorMended { sensor } => self.faults[sensor] = None,
            Act::Noise { sensor: Some(sensor), lux } => self.noise[sensor] = lux,
            Act::Noise { sensor: None, lux } => self.noise.fill(lux),
            Act::Daylight { sensor: Some(sensor), lux } => self.influence.sensors[sensor].daylight = lux,
            Act::Daylight { sensor: None, lux } => {
                self.influence.sensors.iter_mut().for_each(|place| place.daylight = lux);
            }
            Act::Stuck { luminaire, level } => self.stuck[luminaire] = Some(level),
            Act::LuminaireMended { luminaire } => self.stuck[luminaire] = None,
        }
    }

    /// Levels as luminaires have them that were told these.
    fn true_levels(&self, told: &[f64]) -> Vec<f64> {
        told.iter().zip(&self.stuck).map(|(&told, stuck)| stuck.unwrap_or(told)).collect()
    }

    /// What all sensors send: random numbers are drawn for each of them, failed or not.
    fn seen(&self, lux: &[f64], stream: &mut Stream) -> Vec<SensorSignal> {
        let see = |(sensor, &lux): (usize, &f64)| {
            let noise = self.noise[sensor] * normal(stream);
            let place = &self.influence.sensors[sensor];
            let reading = match self.faults[sensor] {
                None => Some((lux + noise).max(0.0)),
                Some(Fault::Silent) => None,
                Some(Fault::Stuck(lux)) => Some(lux),
            };
            SensorSignal { reading, target: place.target, tolerance: place.tolerance }
        };
        lux.iter().enumerate().map(see).collect()
    }

    /// Least power with what works, and sensors that can't have what they ask for.
    fn optimum(&self) -> Result<(Vec<f64>, Vec<usize>), Error> {
        let mut free = self.influence.clone();
        let mut out_of_reach = Vec::new();
        for (sensor, row) in free.lux.iter_mut().enumerate() {
            for (lux, level) in row.iter_mut().zip(&self.stuck) {
                if let Some(level) = level {
                    free.sensors[sensor].daylight += *lux * level;
                    *lux = 0.0;
                }
            }
            let place = &mut free.sensors[sensor];
            if place.target > Some(place.daylight) && row.iter().all(|lux| *lux <= 0.0) {
                out_of_reach.push(sensor);
                place.target = None;
            }
        }
        let off = vec![0.0; self.stuck.len()];
        let asked = free.sensors.iter().any(|place| place.target.is_some());
        let levels = if asked {
            let Answer { levels, missed, .. } = solve(&free, Goal::LeastPower)?;
            out_of_reach.extend(missed.iter().map(|missed| missed.sensor));
            levels
        } else {
            off
        };
        out_of_reach.sort_unstable();
        Ok((self.true_levels(&levels), out_of_reach))
    }
}

/// A standard normal deviate (Box and Muller).
fn normal(stream: &mut Stream) -> f64 {
    let [radius, turn] = [stream.uniform(), stream.uniform()].map(f64::from);
    (-2.0 * (1.0 - radius).ln()).sqrt() * (std::f64::consts::TAU * turn).cos()
}

/// The level that a luminaire takes which is told this one.
fn possible(luminaire: &Dimmable, told: f64) -> f64 {
    let least = luminaire.supply.least;
    match told {
        told if told.is_nan() || told <= 0.0 => 0.0,
        told if told >= least => told.min(1.0),
        told if told >= 0.5 * least => least,
        _ => 0.0,
    }
}

/// Lets the script's controller run from its start to its end. Same seed, same bits.
///
/// Cost: of each step O(sensors × luminaires) and what the controller takes; of each event a linear program.
///
/// # Errors
/// Where there is no luminaire or sensor.
pub fn simulate(influence: &Influence, script: &Script, seed: u64) -> Result<Series, Error> {
    let mut controller = (script.make)(&Installation::of(influence));
    simulate_with(influence, script, seed, &mut *controller)
}

/// The same with a controller of one's own.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_with(
    influence: &Influence,
    script: &Script,
    seed: u64,
    controller: &mut dyn Controller,
) -> Result<Series, Error> {
    if influence.luminaires.is_empty() || influence.sensors.is_empty() {
        return Err(Error::Usage("found a room without luminaires or sensors, expected both to control light".into()));
    }
    let mut room = Room::new(influence, script.noise);
    let mut own = Seed(seed).branch(1).stream(0);
    let noise = Seed(seed).branch(2);
    let mut told: Vec<f64> = match script.level {
        Some(level) => influence.luminaires.iter().map(|luminaire| possible(luminaire, level)).collect(),
        None => influence.levels(),
    };
    let mut events = script.events.iter().peekable();
    let mut series = Series { rows: Vec::with_capacity(script.rows()), turns: Vec::new() };
    let (mut best, mut best_power) = (Vec::new(), 0.0);
    for number in 0..script.rows() {
        let time = script.time(number);
        let mut what = Vec::new();
        while let Some(event) = events.next_if(|event| event.at <= time) {
            event.acts.iter().for_each(|act| room.apply(act));
            what.push(event.words.clone());
        }
        if number == 0 || !what.is_empty() {
            let (levels, out_of_reach) = room.optimum()?;
            best_power = influence.power(&levels);
            best = levels;
            series.turns.push(Turn { time, what, row: number, out_of_reach });
        }
        let levels = room.true_levels(&told);
        let lux: Vec<f64> = (0..room.faults.len()).map(|sensor| room.influence.illuminance(sensor, &levels)).collect();
        let seen = room.seen(&lux, &mut noise.stream(number as u64));
        let draws: Vec<f64> = levels.iter().enumerate().map(|(lamp, level)| influence.power_of(lamp, *level)).collect();
        let power = draws.iter().sum();
        let observation = Observation { time, sensors: &seen, levels: &told, power, draws: &draws, oracle: &best };
        let next = controller.step(&observation, &mut own);
        series.rows.push(TimeStep { time, power, optimum: best_power, lux, seen, levels });
        // Where a controller says too little, luminaires stay as they are.
        for ((told, next), luminaire) in told.iter_mut().zip(next).zip(&influence.luminaires) {
            *told = possible(luminaire, next);
        }
    }
    Ok(series)
}
