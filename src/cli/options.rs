//! Options of a run on the command line: as the table of [`crate::options`] has them.

use std::marker::PhantomData;

use clap::builder::{PossibleValuesParser, RangedI64ValueParser, RangedU64ValueParser, ValueParser};
use clap::{Arg, ArgAction, ArgMatches, Args, FromArgMatches};

use crate::error::Error;
use crate::options::{Command, Kind, Options, RunOption, TABLE, Value};

/// A command whose options these are.
pub(super) trait Taker {
    /// Which.
    const COMMAND: Command;
}

/// The options that a command takes, as they were given.
pub(super) struct RunOptions<T> {
    given: Options,
    taker: PhantomData<T>,
}

impl<T> RunOptions<T> {
    /// What was given.
    pub(super) fn given(&self) -> &Options {
        &self.given
    }
}

/// Those that a command takes.
fn of<T: Taker>() -> impl Iterator<Item = &'static RunOption> {
    TABLE.iter().filter(|option| option.commands.contains(&T::COMMAND))
}

impl<T: Taker> Args for RunOptions<T> {
    fn augment_args(command: clap::Command) -> clap::Command {
        of::<T>().fold(command, |command, option| command.arg(argument(option)))
    }

    fn augment_args_for_update(command: clap::Command) -> clap::Command {
        Self::augment_args(command)
    }
}

impl<T: Taker> FromArgMatches for RunOptions<T> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut options = Self { given: Options::default(), taker: PhantomData };
        options.update_from_arg_matches(matches)?;
        Ok(options)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        for option in of::<T>() {
            let Some(value) = value(option, matches) else { continue };
            let refused = |error| clap::Error::raw(clap::error::ErrorKind::ValueValidation, error);
            self.given.put(option, value).map_err(refused)?;
        }
        Ok(())
    }
}

/// What an option was given, if it was.
fn value(option: &RunOption, matches: &ArgMatches) -> Option<Value> {
    let name = option.name;
    match option.kind {
        Kind::Word(words) => {
            let given = matches.get_one::<String>(name)?;
            words.iter().find(|word| *word == given).map(|word| Value::Word(word))
        }
        Kind::OnOff => matches.get_one::<String>(name).map(|word| Value::Switch(word == "on")),
        Kind::Switch => matches.get_flag(name).then_some(Value::Switch(true)),
        Kind::Count { most, .. } if is_short(most) => {
            matches.get_one::<u32>(name).map(|count| Value::Count((*count).into()))
        }
        Kind::Count { .. } => matches.get_one::<u64>(name).copied().map(Value::Count),
        Kind::Amount { .. } => matches.get_one::<f64>(name).copied().map(Value::Amount),
    }
}

/// Whether numbers up to this are parsed as 32 bits.
fn is_short(most: u64) -> bool {
    most <= u64::from(u32::MAX)
}

/// The argument of an option.
fn argument(option: &RunOption) -> Arg {
    let argument = Arg::new(option.name).long(option.name).help(flagged(&option.sentence()));
    match option.kind {
        Kind::Switch => argument.action(ArgAction::SetTrue),
        kind => argument
            .value_name(option.placeholder)
            .value_parser(parser(kind))
            .hide_possible_values(true)
            .allow_negative_numbers(matches!(kind, Kind::Amount { .. })),
    }
}

fn parser(kind: Kind) -> ValueParser {
    match kind {
        Kind::Word(words) => PossibleValuesParser::new(words).into(),
        Kind::OnOff => PossibleValuesParser::new(["on", "off"]).into(),
        Kind::Switch => ValueParser::bool(),
        Kind::Count { least, most } if is_short(most) => {
            RangedI64ValueParser::<u32>::new().range(least as i64..=most as i64).into()
        }
        Kind::Count { least, most } => RangedU64ValueParser::<u64>::new().range(least..=most).into(),
        Kind::Amount { units, unit } => {
            let parse = move |text: &str| amount(text, units, unit);
            ValueParser::new(parse)
        }
    }
}

/// The parser of an option's values, for commands that take lists of them: of `String`, `u32`, `u64` or `f64`.
pub(super) fn values_of(name: &str) -> ValueParser {
    RunOption::named(name).map_or_else(ValueParser::string, |option| parser(option.kind))
}

/// A number above 0.
fn amount(text: &str, units: &str, unit: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("expected a number of {units}"))?;
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err(format!("expected more than 0 {unit}")) }
}

/// A length, m.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    amount(text, "metres", "m")
}

/// Options of commands that are no options of a run, as the library's messages name them.
const OTHERS: [&str; 8] = ["output", "include", "reflectance", "materials", "sets", "dimming", "plane", "camera"];

/// What the library says, with options as they stand on the command line: it writes `error` where a user types --error.
pub(super) fn flagged(message: &str) -> String {
    let names = TABLE.iter().map(|option| option.name).chain(OTHERS);
    names.fold(message.to_owned(), |text, name| text.replace(&format!("`{name}`"), &format!("--{name}")))
}

/// What an error says, with options as they stand on the command line.
pub(super) fn said(error: &Error) -> String {
    match error {
        Error::Option(error) if error.option().is_some() => format!("--{}", flagged(&error.to_string())),
        error => flagged(&error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::OptionError;

    #[test]
    fn options_get_their_dashes_where_they_are_marked() {
        assert_eq!(flagged("`error` 0.5: more with `passes`, no error"), "--error 0.5: more with --passes, no error");
        assert_eq!(flagged("found `]`"), "found `]`");
        let error = Error::Option(OptionError::GroupsOfSeed);
        assert!(said(&error).starts_with("--groups: found method seed"), "{}", said(&error));
    }
}
