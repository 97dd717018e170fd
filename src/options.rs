//! The options of a run, in one table: the command line, its help, the manual and the library all read it.

use std::num::NonZeroU32;
use std::time::Duration;

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
}

/// A command that takes options of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// `luxmap render`, and so `luxmap batch`.
    Render,
    /// `luxmap influence`.
    Influence,
    /// `luxmap dim`.
    Dim,
    /// `luxmap plan`.
    Plan,
    /// `luxmap converge`, which takes lists of some of them.
    Converge,
    /// `luxmap merge`.
    Merge,
}

impl Command {
    /// Every command, with its name.
    pub const ALL: [(&'static str, Self); 6] = [
        ("render", Self::Render),
        ("influence", Self::Influence),
        ("dim", Self::Dim),
        ("plan", Self::Plan),
        ("converge", Self::Converge),
        ("merge", Self::Merge),
    ];
}

/// What an option takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// One of these words.
    Word(&'static [&'static str]),
    /// On or off: a word on the command line, true or false in a file.
    OnOff,
    /// Given or not.
    Switch,
    /// A whole number.
    Count {
        /// The least.
        least: u64,
        /// The most.
        most: u64,
    },
    /// A finite number above 0.
    Amount {
        /// Its unit in words, such as "metres".
        units: &'static str,
        /// Its sign, such as "m".
        unit: &'static str,
    },
}

/// What an option is set to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// One of the words of [`Kind::Word`].
    Word(&'static str),
    /// Of [`Kind::OnOff`] and [`Kind::Switch`].
    Switch(bool),
    /// Of [`Kind::Count`].
    Count(u64),
    /// Of [`Kind::Amount`].
    Amount(f64),
}

/// One option of a run.
#[derive(Clone, Copy, Debug)]
pub struct RunOption {
    /// Its name, as on the command line after `--`.
    pub name: &'static str,
    /// What stands for its value in the help; empty for a switch.
    pub placeholder: &'static str,
    /// What it takes.
    pub kind: Kind,
    /// What it does, in a sentence.
    pub help: &'static str,
    /// What holds where nobody sets it, in words; empty where that is plain.
    pub default: &'static str,
    /// The methods to which it means something.
    pub methods: &'static [Method],
    /// The commands that take it.
    pub commands: &'static [Command],
    /// Whether states of runs that differ in it can't be added up: it is part of a checkpoint's [`Recipe`].
    pub in_recipe: bool,
}

const EVERY: &[Method] = &[Method::Gather, Method::Split, Method::Path, Method::Photons, Method::Seed];
const BY_PHOTONS: &[Method] = &[Method::Gather, Method::Split, Method::Photons, Method::Seed];
const BY_RAYS: &[Method] = &[Method::Gather, Method::Path];
const RUNS: &[Command] = &[Command::Render, Command::Influence, Command::Dim];
const RUNS_AND_CONVERGE: &[Command] = &[Command::Render, Command::Influence, Command::Dim, Command::Converge];
const MOST: u64 = u32::MAX as u64;

/// So many options, the first of [`TABLE`], may stand in `[render]` of a scene file.
pub const IN_SCENES: usize = 13;

/// Every option, in the order of the help.
pub static TABLE: [RunOption; 15] = [
    RunOption {
        name: "method",
        placeholder: "METHOD",
        kind: Kind::Word(&["gather", "split", "path", "photons", "seed"]),
        help: "gather: direct light by shadow rays, what has bounced by rays to surfaces whose light the photons know; \
               split: the same, what has bounced by the photons' density; path: no photons, paths from the points; \
               photons: all by photons; seed: the paper's estimator, biases and all",
        default: "gather",
        methods: EVERY,
        commands: &[Command::Render, Command::Influence, Command::Dim, Command::Plan, Command::Converge],
        in_recipe: true,
    },
    RunOption {
        name: "photons",
        placeholder: "N",
        kind: Kind::Count { least: 1, most: 1 << 40 },
        help: "Photons a pass",
        default: "gather 200000, with mirrors or glass 1000000; split and photons 1000000; seed 30000",
        methods: BY_PHOTONS,
        commands: &[Command::Render, Command::Influence, Command::Dim, Command::Plan, Command::Converge],
        in_recipe: true,
    },
    RunOption {
        name: "nearest",
        placeholder: "K",
        kind: Kind::Count { least: 2, most: MOST },
        help: "k, nearest photons of an estimate; more is smoother and less sharp",
        default: "grows with the photons; seed: 100",
        methods: BY_PHOTONS,
        commands: RUNS_AND_CONVERGE,
        in_recipe: true,
    },
    RunOption {
        name: "radius",
        placeholder: "M",
        kind: Kind::Amount { units: "metres", unit: "m" },
        help: "Largest search radius, m",
        default: "a tenth of the scene's diagonal",
        methods: BY_PHOTONS,
        commands: RUNS,
        in_recipe: true,
    },
    RunOption {
        name: "rays",
        placeholder: "N",
        kind: Kind::Count { least: 1, most: 65536 },
        help: "Rays from each grid point a pass; methods gather and path; a camera's pixel sends four times as many",
        default: "8",
        methods: BY_RAYS,
        commands: RUNS,
        in_recipe: true,
    },
    RunOption {
        name: "smooth",
        placeholder: "ON",
        kind: Kind::OnOff,
        help: "Whether neighbouring grid points help each other to what rays found, on or off; off, path has no bias \
               at all",
        default: "on for gather, off for path",
        methods: BY_RAYS,
        commands: RUNS,
        in_recipe: true,
    },
    RunOption {
        name: "error",
        placeholder: "PCT",
        kind: Kind::Amount { units: "percent", unit: "%" },
        help: "Stop when the standard error of every map is at most this, % of its mean, or that of every image where \
               there are only cameras",
        default: "1, images 5, unless `passes` or `time` is given; seed: one pass",
        methods: EVERY,
        commands: RUNS,
        in_recipe: false,
    },
    RunOption {
        name: "time",
        placeholder: "SECONDS",
        kind: Kind::Amount { units: "seconds", unit: "s" },
        help: "Stop before this time is over, s (the first pass is always done)",
        default: "",
        methods: EVERY,
        commands: RUNS,
        in_recipe: false,
    },
    RunOption {
        name: "passes",
        placeholder: "N",
        kind: Kind::Count { least: 1, most: MOST },
        help: "Stop after so many passes: independent photons and rays",
        default: "",
        methods: EVERY,
        commands: RUNS_AND_CONVERGE,
        in_recipe: false,
    },
    RunOption {
        name: "tree",
        placeholder: "TREE",
        kind: Kind::Word(&["kd", "kiddo", "paper", "brute"]),
        help: "Tree of the photon map: kd (luxmap's own), kiddo, paper (the paper's own) or brute (none)",
        default: "kd",
        methods: BY_PHOTONS,
        commands: RUNS,
        in_recipe: true,
    },
    RunOption {
        name: "seed",
        placeholder: "S",
        kind: Kind::Count { least: 0, most: u64::MAX },
        help: "Same seed, same bits, whatever the number of threads",
        default: "0",
        methods: EVERY,
        commands: RUNS_AND_CONVERGE,
        in_recipe: false,
    },
    RunOption {
        name: "memory",
        placeholder: "GB",
        kind: Kind::Amount { units: "gigabytes", unit: "GB" },
        help: "Take no more memory than this: large planes are computed in bands, and with methods that store photons \
               a pass has fewer",
        default: "planes of more than 4 million cells in bands",
        methods: EVERY,
        commands: &[Command::Render, Command::Influence, Command::Dim, Command::Plan],
        in_recipe: false,
    },
    RunOption {
        name: "groups",
        placeholder: "",
        kind: Kind::Switch,
        help: "Tell light groups apart: a layer group.NAME in the EXR files for each, groups.csv for sensors",
        default: "",
        methods: &[Method::Gather, Method::Split, Method::Path, Method::Photons],
        commands: &[Command::Render],
        in_recipe: true,
    },
    RunOption {
        name: "first-pass",
        placeholder: "N",
        kind: Kind::Count { least: 0, most: MOST },
        help: "Number of the first pass, so that runs of different passes can be merged",
        default: "0",
        methods: EVERY,
        commands: &[Command::Render],
        in_recipe: false,
    },
    RunOption {
        name: "threads",
        placeholder: "N",
        kind: Kind::Count { least: 1, most: 1024 },
        help: "Threads",
        default: "all",
        methods: EVERY,
        commands: &[Command::Render, Command::Influence, Command::Dim, Command::Converge, Command::Merge],
        in_recipe: false,
    },
];

impl RunOption {
    /// The option of a name, if there is one.
    pub fn named(name: &str) -> Option<&'static Self> {
        TABLE.iter().find(|option| option.name == name)
    }

    /// What it does and what holds without it, as the help says.
    pub fn sentence(&self) -> String {
        match self.default {
            "" => self.help.to_owned(),
            default => format!("{} [default: {default}]", self.help),
        }
    }

    /// What it takes, in words.
    pub fn expected(&self) -> String {
        match self.kind {
            Kind::Word(words) => format!("one of {}", words.join(", ")),
            Kind::OnOff => "on or off".into(),
            Kind::Switch => "true or false".into(),
            Kind::Count { least: 0, most: u64::MAX } => "a whole number".into(),
            Kind::Count { least, most: MOST } => format!("a whole number from {least} up"),
            Kind::Count { least, most } => format!("a whole number from {least} to {most}"),
            Kind::Amount { unit, .. } => format!("a number above 0, {unit}"),
        }
    }

    /// The value that a text says.
    ///
    /// # Errors
    /// Where it says none that the option takes.
    pub fn parse(&self, text: &str) -> Result<Value, OptionError> {
        let value = match self.kind {
            Kind::Word(words) => words.iter().find(|word| **word == text).map(|word| Value::Word(word)),
            Kind::OnOff | Kind::Switch => match text {
                "on" | "true" => Some(Value::Switch(true)),
                "off" | "false" => Some(Value::Switch(false)),
                _ => None,
            },
            Kind::Count { .. } => text.parse().ok().map(Value::Count),
            Kind::Amount { .. } => text.parse().ok().map(Value::Amount),
        };
        value.filter(|value| self.takes(*value)).ok_or_else(|| self.refusal(text))
    }

    /// Whether a value is one that the option takes.
    pub fn takes(&self, value: Value) -> bool {
        match (self.kind, value) {
            (Kind::Word(words), Value::Word(word)) => words.contains(&word),
            (Kind::OnOff | Kind::Switch, Value::Switch(_)) => true,
            (Kind::Count { least, most }, Value::Count(count)) => (least..=most).contains(&count),
            (Kind::Amount { .. }, Value::Amount(amount)) => amount > 0.0 && amount.is_finite(),
            _ => false,
        }
    }

    fn refusal(&self, found: impl Into<String>) -> OptionError {
        OptionError::Value { option: self.name, found: found.into(), expected: self.expected() }
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

/// The manual's table of options, in Markdown.
pub fn manual() -> String {
    let mut text = String::from(
        "# Options of a run\n\n\
         Made from the table in `src/options.rs`; a test compares. The command line wins over `[render]` of the scene \
         file, which wins over the defaults. In a program they are the fields of `luxmap::Options`.\n\n\
         | option | value | what it does | default | methods | commands |\n|---|---|---|---|---|---|\n",
    );
    for option in &TABLE {
        let methods = match option.methods.len() {
            5 => "all".to_owned(),
            _ => option.methods.iter().map(|method| method.name()).collect::<Vec<_>>().join(", "),
        };
        let takes = Command::ALL.into_iter().filter(|(_, command)| option.commands.contains(command));
        let commands: Vec<&str> = takes.map(|(name, _)| name).collect();
        let value = if option.kind == Kind::Switch { String::new() } else { option.expected() };
        text += &format!(
            "| `--{}` | {value} | {} | {} | {methods} | {} |\n",
            option.name,
            option.help,
            option.default,
            commands.join(", "),
        );
    }
    text += "\n`luxmap batch` takes those of render. `luxmap converge` takes `--methods`, and lists of photons, k and \
             passes.\n";
    text
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// A text that each kind takes, and one that it doesn't.
    fn samples(option: &RunOption) -> [String; 2] {
        match option.kind {
            Kind::Word(words) => [words[words.len() - 1].into(), "oak".into()],
            Kind::OnOff | Kind::Switch => ["off".into(), "maybe".into()],
            Kind::Count { least, most } => [least.max(2).to_string(), (u128::from(most) + 1).to_string()],
            Kind::Amount { .. } => ["0.5".into(), "-1".into()],
        }
    }

    #[test]
    fn every_option_can_be_set_got_and_layered() {
        let (mut upper, mut all) = (Options::default(), Options::default());
        for option in &TABLE {
            let [good, bad] = samples(option);
            assert_eq!(upper.get(option), None, "{} is open at first", option.name);
            upper.set(option.name, &good).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(upper.get(option), option.parse(&good).ok(), "{}", option.name);
            let refused = all.set(option.name, &bad).expect_err("it is bad").to_string();
            assert_eq!(refused, format!("{}: found {bad}, expected {}", option.name, option.expected()));
            all.set(option.name, &good).expect("it is good");
            // Only this one is set above: all others come from below.
            let mut one = Options::default();
            one.set(option.name, &good).expect("it is good");
            let layered = one.over(upper.clone());
            assert!(TABLE.iter().all(|other| layered.get(other) == upper.get(other)), "{}", option.name);
        }
        assert_eq!(Options::default().over(all.clone()), all);
        assert!(all.set("flavour", "1").is_err());
    }

    #[test]
    fn upper_layers_win() {
        let upper = Options { seed: Some(2), ..Default::default() };
        let lower = Options { seed: Some(1), photons: Some(5), ..Default::default() };
        assert_eq!(upper.over(lower), Options { seed: Some(2), photons: Some(5), ..Default::default() });
    }

    #[test]
    fn words_of_the_table_are_those_of_the_types() {
        let words = |name: &str| match RunOption::named(name).map(|option| option.kind) {
            Some(Kind::Word(words)) => words.to_vec(),
            _ => Vec::new(),
        };
        assert_eq!(words("method"), Method::ALL.map(|(name, _)| name));
        assert_eq!(words("tree"), Tree::ALL.map(|(name, _)| name));
    }

    /// A checkpoint's recipe has a word for each option that makes its sums, by the option's name.
    #[test]
    fn recipes_hold_what_the_table_says() {
        let recipe = Recipe {
            luxmap: String::new(),
            scene_sha256: String::new(),
            planes: Vec::new(),
            cameras: Vec::new(),
            method: "path".into(),
            tree: "paper".into(),
            photons: 3,
            rays: 4,
            smooth: true,
            nearest: Some(5),
            radius: Some(0.5),
            groups: true,
        };
        let json = serde_json::to_value(&recipe).expect("words");
        let of_scene = ["luxmap", "scene_sha256", "planes", "cameras"];
        let words: BTreeSet<&str> = json
            .as_object()
            .expect("an object")
            .keys()
            .map(String::as_str)
            .filter(|key| !of_scene.contains(key))
            .collect();
        let named: BTreeSet<&str> = TABLE.iter().filter(|option| option.in_recipe).map(|option| option.name).collect();
        assert_eq!(words, named);
        let options = Options::of_recipe(&recipe);
        assert!(TABLE.iter().all(|option| options.get(option).is_some() == option.in_recipe));
    }
}
