//! The command: parse → validate → run. Every failure is printed here, as one line.

mod batch;
mod check;
mod common;
mod control;
mod converge;
mod dim;
mod help;
mod influence;
mod luminaire;
mod merge;
mod office;
mod options;
mod plan;
mod progress;
mod render;
mod signals;
mod trees;

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::error::{Error, OptionError};
use crate::job::Job;
use crate::scene::{Dimming, LoadOptions, Scene};

/// How bright is a room: photon-mapped illuminance in lux.
#[derive(Parser)]
#[command(version, about, max_term_width = help::WIDEST, disable_help_subcommand = true)]
struct Arguments {
    #[command(subcommand)]
    command: CommandArguments,
}

#[derive(Subcommand)]
enum CommandArguments {
    Render(render::Arguments),
    Plan(plan::Arguments),
    Converge(converge::Arguments),
    Trees(trees::Arguments),
    Luminaire(luminaire::Arguments),
    Merge(merge::Arguments),
    Office(office::Arguments),
    Batch(batch::Arguments),
    Influence(influence::Arguments),
    Control(control::Arguments),
    Dim(dim::Arguments),
    Check(check::Arguments),
    Help(help::Arguments),
}

/// What the command line adds to a scene: where files may lie that it names, and what materials reflect that it leaves
/// open.
#[derive(clap::Args)]
struct Include {
    /// Let the scene name files in this folder, not only in the scene file's own; repeatable.
    #[arg(long = "include", value_name = "DIR")]
    folders: Vec<PathBuf>,
    /// Reflectance of materials that neither the scene file nor an MTL file gives one: a number or r,g,b; wins over the
    /// scene file's [material."*"].
    #[arg(long, value_name = "RHO", value_parser = reflectance, allow_negative_numbers = true)]
    reflectance: Option<[f64; 3]>,
}

/// One number for all channels, or one each.
fn reflectance(text: &str) -> Result<[f64; 3], String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|word| word.trim().parse().ok()).collect();
    let rgb = match numbers.as_deref() {
        Some(&[grey]) => Some([grey; 3]),
        Some(&[r, g, b]) => Some([r, g, b]),
        _ => None,
    };
    let rgb = rgb.filter(|rgb| rgb.iter().all(|part| (0.0..=1.0).contains(part)));
    rgb.ok_or_else(|| "expected a number from 0 to 1, or three as r,g,b".to_owned())
}

impl Include {
    fn load(&self, scene: &Path) -> Result<Scene, Error> {
        Scene::load_as(scene, &self.options(Dimming::AsWritten)?)
    }

    fn job(&self, scene: &Path, dimming: Dimming) -> Result<Job<'static>, Error> {
        Job::load_as(scene, self.options(dimming)?)
    }

    fn options(&self, dimming: Dimming) -> Result<LoadOptions, Error> {
        let no_folder = |folder: &&PathBuf| !folder.is_dir();
        if let Some(folder) = self.folders.iter().find(no_folder) {
            let (found, expected) = (folder.display().to_string(), "a folder".into());
            return Err(OptionError::Value { option: "include", found, expected }.into());
        }
        Ok(LoadOptions { include: self.folders.clone(), dimming, reflectance: self.reflectance })
    }
}

/// The value named, of a list whose names clap has checked.
fn named<T: Copy, const N: usize>(name: &str, all: [(&'static str, T); N]) -> Option<T> {
    all.into_iter().find(|(known, _)| *known == name).map(|(_, value)| value)
}

/// What a command that ran found out.
enum Outcome {
    /// Done: exit code 0.
    Done,
    /// Ran, but a required value was missed, or a run of a batch failed: exit code 1.
    Missed,
    /// Ran, but some of what it was given could not be read, and it has said so: exit code 2.
    Refused,
    /// Another process says why not: exit code 2.
    #[cfg(feature = "mpi")]
    Failed,
    /// Ended by a signal before all was done: exit code 130, as a shell would say.
    Interrupted,
}

/// Where results go: as asked, else `out/<scene>` with an `ending`.
fn results_folder(asked: Option<&PathBuf>, scene: &Path, ending: &str) -> PathBuf {
    asked.cloned().unwrap_or_else(|| {
        let mut name = render::stem(scene).into_os_string();
        name.push(ending);
        Path::new("out").join(name)
    })
}

impl Outcome {
    /// Done, unless a signal has ended it.
    fn of_interruption() -> Self {
        if signals::interrupted() { Self::Interrupted } else { Self::Done }
    }
}

/// Runs the command line; exit code 0: done, 1: ran, but a required value was missed or a run of a batch
/// failed, 130: interrupted, 2: bad input or use.
pub fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return refuse(&error),
    };
    signals::listen();
    let outcome = match arguments.command {
        CommandArguments::Render(arguments) => render::run(&arguments),
        CommandArguments::Plan(arguments) => plan::run(&arguments),
        CommandArguments::Converge(arguments) => converge::run(&arguments),
        CommandArguments::Trees(arguments) => trees::run(&arguments),
        CommandArguments::Luminaire(arguments) => luminaire::run(&arguments),
        CommandArguments::Merge(arguments) => merge::run(&arguments),
        CommandArguments::Office(arguments) => office::run(&arguments),
        CommandArguments::Batch(arguments) => batch::run(&arguments),
        CommandArguments::Influence(arguments) => influence::run(&arguments),
        CommandArguments::Control(arguments) => control::run(&arguments),
        CommandArguments::Dim(arguments) => dim::run(&arguments),
        CommandArguments::Check(arguments) => check::run(&arguments),
        CommandArguments::Help(arguments) => help::run(&arguments),
    };
    match outcome {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Missed) => ExitCode::from(1),
        Ok(Outcome::Refused) => ExitCode::from(2),
        #[cfg(feature = "mpi")]
        Ok(Outcome::Failed) => ExitCode::from(2),
        Ok(Outcome::Interrupted) => ExitCode::from(130),
        Err(error) => {
            complain(&format!("luxmap: {}", one_line(&options::said(&error), " ")));
            ExitCode::from(2)
        }
    }
}

/// What the command line's own parser has to say: help and version as they are, a mistake as one line.
fn refuse(error: &clap::Error) -> ExitCode {
    use clap::error::ErrorKind;
    let help = error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand;
    if help || !error.use_stderr() {
        let _ = error.print(); // nobody listens: nothing left to say it to
        return ExitCode::from(if help { 2 } else { 0 });
    }
    complain(&format!("luxmap: {}; try --help", sentence(error)));
    ExitCode::from(2)
}

/// A mistake on the command line as one line.
fn sentence(error: &clap::Error) -> String {
    let text = error.to_string();
    let sentence = text.split("\n\nUsage:").next().and_then(|text| text.split("\n\nFor more").next()).unwrap_or(&text);
    one_line(sentence.trim_start_matches("error: "), "; ").replace(":; ", ": ")
}

/// A message without line breaks, whatever a file name or a parser put into it.
fn one_line(message: &str, between: &str) -> String {
    message.split(['\n', '\r']).map(str::trim).filter(|part| !part.is_empty()).collect::<Vec<_>>().join(between)
}

/// Prints to stdout; a reader that has gone (`| head`) is no error, a full disk is.
fn print(text: &str) -> Result<(), Error> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(source) if source.kind() != io::ErrorKind::BrokenPipe => {
            Err(Error::Write { path: "standard output".into(), source })
        }
        _ => Ok(()),
    }
}

/// Prints a line to stderr. If that fails, there is nowhere left to say so; `eprintln!` would panic.
fn complain(line: &str) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}
