//! The command: parse → validate → run. Every failure is printed here, as one line.

mod plan;
mod progress;
mod render;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::error::Error;

/// How bright is a room: photon-mapped illuminance in lux.
#[derive(Parser)]
#[command(version, about, max_term_width = 110)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Render(render::Arguments),
    Plan(plan::Arguments),
}

/// What a command that ran found out.
enum Outcome {
    /// Done: exit code 0.
    Done,
    /// Ran, but a required value was missed: exit code 1.
    Missed,
}

/// Runs the command line; exit code 0: done, 1: ran, but a required value was missed, 2: bad input or use.
pub fn main() -> ExitCode {
    let outcome = match Arguments::parse().command {
        Command::Render(arguments) => render::run(&arguments),
        Command::Plan(arguments) => plan::run(&arguments),
    };
    match outcome {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Missed) => ExitCode::from(1),
        Err(error) => {
            eprintln!("luxmap: {}", one_line(&error));
            ExitCode::from(2)
        }
    }
}

/// The error's message without line breaks, whatever a file name or a parser put into it.
fn one_line(error: &Error) -> String {
    error.to_string().split(['\n', '\r']).map(str::trim).filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" ")
}

/// Prints to stdout; a reader that has gone (`| head`) is no error.
fn print(text: &str) {
    use std::io::Write;
    let _ = std::io::stdout().lock().write_all(text.as_bytes());
}
