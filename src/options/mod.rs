//! The options of a run: the command line, its help, the manual and the library all read one table of them.

mod table;
#[cfg(test)]
mod tests;

use std::num::NonZeroU32;
use std::time::Duration;

pub use self::table::{Command, IN_SCENES, Kind, RunOption, TABLE, Value, manual};
use crate::error::OptionError;
use crate::photon_map::Tree;
use crate::state::file::Recipe;

/// How illuminance is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Direct light by shadow rays; what has bounced by rays from the measuring points to surfaces whose light the
    /// photons know.
    Gather,
    /// Direct light by shadow rays; what has bounced by the density of photons where it is measured.
    Split,
    /// Direct light by shadow rays; what has bounced by paths from the measuring points. No photons.
    Path,
    /// All light by photons, corrected for every known bias.
    Photons,
    /// The paper's estimator as printed, biases and all.
    Seed,
}

impl Method {
    /// Every method, by name.
    pub const ALL: [(&'static str, Self); 5] = [
        ("gather", Self::Gather),
        ("split", Self::Split),
        ("path", Self::Path),
        ("photons", Self::Photons),
        ("seed", Self::Seed),
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gather => "gather",
            Self::Split => "split",
            Self::Path => "path",
            Self::Photons => "photons",
            Self::Seed => "seed",
        }
    }

    /// The method of a name, if there is one.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|(known, _)| *known == name).map(|(_, method)| method)
    }

    /// Whether measuring points send rays to find what has bounced.
    pub fn sends_rays(self) -> bool {
        matches!(self, Self::Gather | Self::Path)
    }

    /// Whether direct light is computed by shadow rays.
    pub fn splits(self) -> bool {
        matches!(self, Self::Gather | Self::Path | Self::Split)
    }

    /// Whether photons are traced where light bounces.
    pub fn traces_photons(self) -> bool {
        self != Self::Path
    }

    /// Whether light groups can be told apart.
    pub fn knows_groups(self) -> bool {
        self != Self::Seed
    }
}

/// What someone chose for a run: the command line, a scene file or a program. What is `None` is left to others.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// How illuminance is computed.
    pub method: Option<Method>,
    /// Photons a pass.
    pub photons: Option<u64>,
    /// k, nearest photons of an estimate.
    pub nearest: Option<usize>,
    /// Largest search radius, m.
    pub radius: Option<f64>,
    /// Rays from each grid point a pass.
    pub rays: Option<u32>,
    /// Whether neighbouring grid points help each other to what rays found.
    pub smooth: Option<bool>,
    /// Stop at this standard error, % of the mean.
    pub error: Option<f64>,
    /// Stop before this wall time is over.
    pub time: Option<Duration>,
    /// Stop after so many passes.
    pub passes: Option<NonZeroU32>,
    /// Number of the first pass.
    pub first_pass: Option<u32>,
    /// Which tree holds the photons.
    pub tree: Option<Tree>,
    /// Seed of all random streams.
    pub seed: Option<u64>,
    /// Threads.
    pub threads: Option<u16>,
    /// Memory that may be taken, GB (10⁹ bytes).
    pub memory: Option<f64>,
    /// Whether light groups are told apart.
    pub groups: Option<bool>,
}

impl Options {
    /// These, and where they leave something open, those of `lower`.
    pub fn over(self, lower: Self) -> Self {
        Self {
            method: self.method.or(lower.method),
            photons: self.photons.or(lower.photons),
            nearest: self.nearest.or(lower.nearest),
            radius: self.radius.or(lower.radius),
            rays: self.rays.or(lower.rays),
            smooth: self.smooth.or(lower.smooth),
            error: self.error.or(lower.error),
            time: self.time.or(lower.time),
            passes: self.passes.or(lower.passes),
            first_pass: self.first_pass.or(lower.first_pass),
            tree: self.tree.or(lower.tree),
            seed: self.seed.or(lower.seed),
            threads: self.threads.or(lower.threads),
            memory: self.memory.or(lower.memory),
            groups: self.groups.or(lower.groups),
        }
    }

    /// Sets the option of a name to what a text says, as the command line would: `set("error", "0.5")`.
    ///
    /// # Errors
    /// Where there is no such option, or it doesn't take this.
    pub fn set(&mut self, name: &str, text: &str) -> Result<(), OptionError> {
        let option = RunOption::named(name).ok_or_else(|| unknown(name))?;
        self.put(option, option.parse(text)?)
    }

    /// Sets an option to a value.
    ///
    /// # Errors
    /// Where the option doesn't take it.
    pub fn put(&mut self, option: &RunOption, value: Value) -> Result<(), OptionError> {
        if !option.takes(value) {
            return Err(option.refusal(format!("{value:?}")));
        }
        match (option.name, value) {
            ("method", Value::Word(word)) => self.method = Method::named(word),
            ("photons", Value::Count(count)) => self.photons = Some(count),
            ("nearest", Value::Count(count)) => self.nearest = usize::try_from(count).ok(),
            ("radius", Value::Amount(amount)) => self.radius = Some(amount),
            ("rays", Value::Count(count)) => self.rays = u32::try_from(count).ok(),
            ("smooth", Value::Switch(on)) => self.smooth = Some(on),
            ("error", Value::Amount(amount)) => self.error = Some(amount),
            ("time", Value::Amount(amount)) => self.time = Some(seconds(amount)),
            ("passes", Value::Count(count)) => self.passes = u32::try_from(count).ok().and_then(NonZeroU32::new),
            ("first-pass", Value::Count(count)) => self.first_pass = u32::try_from(count).ok(),
            ("tree", Value::Word(word)) => {
                self.tree = Tree::ALL.into_iter().find(|(name, _)| *name == word).map(|(_, tree)| tree);
            }
            ("seed", Value::Count(count)) => self.seed = Some(count),
            ("threads", Value::Count(count)) => self.threads = u16::try_from(count).ok(),
            ("memory", Value::Amount(amount)) => self.memory = Some(amount),
            ("groups", Value::Switch(on)) => self.groups = Some(on),
            _ => return Err(unknown(option.name)),
        }
        Ok(())
    }

    /// What an option is set to, if it is.
    pub fn get(&self, option: &RunOption) -> Option<Value> {
        match option.name {
            "method" => self.method.map(|method| Value::Word(method.name())),
            "photons" => self.photons.map(Value::Count),
            "nearest" => self.nearest.map(|k| Value::Count(k as u64)),
            "radius" => self.radius.map(Value::Amount),
            "rays" => self.rays.map(|rays| Value::Count(rays.into())),
            "smooth" => self.smooth.map(Value::Switch),
            "error" => self.error.map(Value::Amount),
            "time" => self.time.map(|time| Value::Amount(time.as_secs_f64())),
            "passes" => self.passes.map(|passes| Value::Count(passes.get().into())),
            "first-pass" => self.first_pass.map(|pass| Value::Count(pass.into())),
            "tree" => self.tree.map(|tree| Value::Word(tree.name())),
            "seed" => self.seed.map(Value::Count),
            "threads" => self.threads.map(|threads| Value::Count(threads.into())),
            "memory" => self.memory.map(Value::Amount),
            "groups" => self.groups.map(Value::Switch),
            _ => None,
        }
    }

    /// Refuses values that their options don't take: fields can be set to any.
    pub(crate) fn check(&self) -> Result<(), OptionError> {
        for option in &TABLE {
            if let Some(value) = self.get(option).filter(|value| !option.takes(*value)) {
                let found = match value {
                    Value::Word(word) => word.to_owned(),
                    Value::Switch(on) => on.to_string(),
                    Value::Count(count) => count.to_string(),
                    Value::Amount(amount) => amount.to_string(),
                };
                return Err(option.refusal(found));
            }
        }
        Ok(())
    }

    /// What made a state. It says nothing of when to stop.
    pub(crate) fn of_recipe(recipe: &Recipe) -> Self {
        let tree = Tree::ALL.into_iter().find(|(name, _)| *name == recipe.tree).map(|(_, tree)| tree);
        Self {
            method: Method::named(&recipe.method),
            photons: Some(recipe.photons),
            nearest: recipe.nearest,
            radius: recipe.radius,
            rays: Some(recipe.rays),
            smooth: Some(recipe.smooth),
            tree,
            groups: Some(recipe.groups),
            ..Self::default()
        }
    }
}

fn unknown(name: &str) -> OptionError {
    OptionError::Unknown { found: name.to_owned(), known: TABLE.map(|option| option.name).to_vec() }
}

/// So many seconds, as far as a [`Duration`] goes.
fn seconds(amount: f64) -> Duration {
    Duration::try_from_secs_f64(amount).unwrap_or(Duration::MAX)
}
