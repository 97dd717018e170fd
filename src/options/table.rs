//! The table of options: name, kind, range, unit, default, help, methods and commands of each.

use super::Method;
use crate::error::OptionError;

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
    /// Whether states of runs that differ in it can't be added up: it is part of a checkpoint's
    /// [`Recipe`](crate::state::file::Recipe).
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
        help: "Whether neighbouring grid points help each other to what rays found, on or off; off, path has no bias at \
               all",
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
        help: "Take no more memory than this: large planes are computed in bands, and with methods that store photons a \
               pass has fewer",
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

    pub(super) fn refusal(&self, found: impl Into<String>) -> OptionError {
        OptionError::Value { option: self.name, found: found.into(), expected: self.expected() }
    }
}

/// The manual's table of options, in Markdown.
pub fn manual() -> String {
    let mut text = String::from(
        "# Options of a run\n\n\
         Made from the table in `src/options/table.rs`; a test compares. The command line wins over `[render]` of the \
         scene file, which wins over the defaults. In a program they are the fields of `luxmap::Options`.\n\n\
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
    text += "\n`luxmap batch` takes those of render. `luxmap converge` takes `--methods`, and lists of photons, k and passes.\n";
    text
}
