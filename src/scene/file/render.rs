//! `[render]`: options of a run that a scene brings along, out of the one table of options.

use super::keys::{AnyKey, KeyKind as _, Section, Table};
use super::kinds::{Number, Range, Switch, Whole};
use crate::error::InputError;
use crate::options::{IN_SCENES, Kind, Options, RunOption, TABLE, Value};

/// The options that a scene may bring along, as keys.
static KEYS: [&dyn AnyKey; IN_SCENES] = {
    let mut keys: [&dyn AnyKey; IN_SCENES] = [&TABLE[0]; IN_SCENES];
    let mut index = 0;
    while index < IN_SCENES {
        keys[index] = &TABLE[index];
        index += 1;
    }
    keys
};

pub(super) static RENDER: Table = Table {
    head: "[render]",
    about: "Options of `luxmap render` for this scene. The command line wins over them; `luxmap render --help` \
         tells more.",
    keys: &KEYS,
    rules: &[
        "Where several of `error`, `time` and `passes` are given, a run stops at the first that is reached.",
        "An option of the command line replaces the key of its own name, no other.",
    ],
    example: "\
[render]
method = \"gather\"
error = 0.5
time = 600
seed = 1
",
};

impl AnyKey for RunOption {
    fn name(&self) -> &'static str {
        self.name
    }

    fn unit(&self) -> &'static str {
        match self.kind {
            Kind::Amount { unit, .. } => unit,
            Kind::Word(_) | Kind::OnOff | Kind::Switch | Kind::Count { .. } => "",
        }
    }

    fn range(&self) -> String {
        match self.kind {
            Kind::Word(words) => words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(", "),
            Kind::OnOff => ON_OFF.to_owned(),
            Kind::Amount { .. } => "above 0".to_owned(),
            Kind::Switch | Kind::Count { .. } => self.expected(),
        }
    }

    fn default(&self) -> &'static str {
        match (self.kind, self.default) {
            (Kind::Switch, "") => "false",
            (_, "") => "none",
            (_, default) => default,
        }
    }

    fn example(&self) -> &'static str {
        ""
    }

    fn meaning(&self) -> &'static str {
        self.help
    }

    fn tables(&self) -> Vec<&'static Table> {
        Vec::new()
    }
}

const ON_OFF: &str = "true, false, \"on\" or \"off\"";

/// What a section says of an option.
fn value(section: &Section<'_>, option: &'static RunOption) -> Result<Option<Value>, InputError> {
    let key = option.name;
    section.asked(option);
    Ok(match option.kind {
        Kind::Word(words) => section.fields.word(key, words)?.and_then(|found| option.parse(&found.value).ok()),
        Kind::Count { least, most } => Whole::between(least, most).read(section, key)?.map(Value::Count),
        Kind::Amount { unit, .. } => Number::of(Range::above(0.0), unit).read(section, key)?.map(Value::Amount),
        Kind::Switch => Switch.read(section, key)?.map(Value::Switch),
        Kind::OnOff if !section.fields.is_text(key) => {
            let on = section.fields.switch(key).map_err(|error| InputError { expected: ON_OFF.to_owned(), ..error });
            on?.map(|on| Value::Switch(on.value))
        }
        Kind::OnOff => match section.fields.text(key)?.as_ref().map(|word| word.value.as_str()) {
            Some(word @ ("on" | "off")) => Some(Value::Switch(word == "on")),
            _ => return Err(section.fields.refusal(key, ON_OFF)),
        },
    })
}

pub(super) fn read(section: &Section<'_>) -> Result<Options, InputError> {
    let mut options = Options::default();
    for option in &TABLE[..IN_SCENES] {
        if let Some(value) = value(section, option)? {
            options.put(option, value).map_err(|_| section.fields.refusal(option.name, option.expected()))?;
        }
    }
    Ok(options)
}
