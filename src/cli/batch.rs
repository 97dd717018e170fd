//! `luxmap batch`: many runs, none twice, whatever comes in between.

use std::fs;
use std::path::{Path, PathBuf};

use super::common::flag;
use super::options::said;
use super::progress::TerminalBar;
use super::render::{self, stem};
use super::signals::{end_after_pass, interrupted};
use super::{Outcome, complain, one_line, print, sentence};
use crate::batch::done::{Done, Request};
use crate::batch::file::{is_batch, parse, plain};
use crate::batch::report::{RunFigures, RunRow, Status, in_short, json, text, write};
use crate::batch::{Arity, BatchOptions, BatchRun, caught};
use crate::error::{Error, InputError, Location};
use crate::files;
use crate::files::Claim;
use crate::files::limits::LARGEST_SCENE;
use crate::render::checkpoint_files;
use crate::report::{self};

/// Render many scenes, or one in many ways; the same command again goes on after any interruption.
///
/// FILE is a batch file (TOML), or there are several scene files:
///
///   [defaults]                 # options of luxmap render, by their long names
///   error = 0.5
///   layers = ["stderr"]
///   [[run]]
///   scene = "rooms/*.toml"     # a path, a pattern, or a list of such, relative to the batch file
///   method = "path"            # wins over the defaults
///   seed = [1, 2, 3]           # a list where an option takes one value: a run for each
///   name = "north"             # of the runs' folders; default: the scene's stem, and what differs
///
/// Each run has a folder DIR/NAME with its results, and its checkpoint as long as it is under
/// way; DIR/summary.csv and DIR/report.html sum up. A run that is done, of a scene and options
/// unchanged, is not repeated; one that was killed goes on after its last pass, to the same bits.
/// A broken scene does not stop the others.
///
/// Exit code: 0 all done; 1 a run failed, or misses what --check asks for; 2 bad batch file or
/// use; 130 interrupted by Ctrl-C, which ends the batch after the pass in hand and keeps the
/// checkpoint.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(super) struct Arguments {
    /// A batch file, or scene files.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Folder for the results.
    #[arg(
        long,
        short,
        value_name = "DIR",
        help = "Folder for the results [default: out/<batch>; of scenes: out/batch]"
    )]
    output: Option<PathBuf>,
    /// Keep the checkpoints of runs that are done, to be merged, or to go on from with a smaller error.
    #[arg(long)]
    keep_checkpoints: bool,
    /// Print the summary as JSON instead of the table.
    #[arg(long)]
    json: bool,
    /// No progress on stderr.
    #[arg(long, short)]
    quiet: bool,
    /// Options of luxmap render for all runs; they win over those of the batch file.
    #[arg(last = true, value_name = "OPTION")]
    options: Vec<String>,
}

/// Options of `luxmap render` that a batch decides itself.
const OWN: [&str; 4] = ["output", "checkpoint", "json", "quiet"];

pub(super) fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    end_after_pass();
    check_options(&arguments.options)?;
    let (title, runs) = read(&arguments.files)?;
    let folder = arguments.output.clone().unwrap_or_else(|| Path::new("out").join(&title));
    let _claim = Claim::of(&folder)?;
    let mut rows = Vec::new();
    for (index, run) in runs.iter().enumerate() {
        let row = row(run, &folder, arguments);
        if !arguments.quiet && row.status != Status::NotBegun {
            let because = row.message.as_ref().map_or_else(String::new, |message| format!(": {message}"));
            complain(&format!("run {} of {}: {}: {}{because}", index + 1, runs.len(), run.name, row.status.name()));
            row.warnings.iter().for_each(|warning| complain(&format!("warning: {}: {warning}", run.name)));
        }
        rows.push(row);
    }
    let written = write(&title, &rows, &folder);
    if arguments.json {
        print(&json(&rows))?;
    } else {
        print(&text(&rows))?;
        print(&format!("\n{}\n", in_short(&rows)))?;
        if let Ok([csv, html]) = &written {
            print(&format!("wrote {} and {}\n", csv.display(), html.display()))?;
        }
    }
    written?;
    Ok(match rows {
        rows if rows.iter().any(|row| matches!(row.status, Status::Interrupted | Status::NotBegun)) => {
            Outcome::Interrupted
        }
        rows if rows.iter().any(|row| row.message.is_some()) => Outcome::Missed,
        _ => Outcome::Done,
    })
}

/// The batch's name and runs.
fn read(files: &[PathBuf]) -> Result<(String, Vec<BatchRun>), Error> {
    for path in files {
        let text = files::read(path, LARGEST_SCENE).map_err(|error| {
            let found = if path.exists() { files::why(&error) } else { "no such file".into() };
            InputError::new(Location::file(path), found, "a batch file or a scene file, in TOML")
        })?;
        // A scene that is no text is a broken scene.
        let Some(text) = String::from_utf8(text).ok().filter(|text| is_batch(text)) else { continue };
        if files.len() > 1 {
            let found = format!("a batch file and {} more", files.len() - 1);
            return Err(InputError::new(Location::file(path), found, "one batch file, or scene files only").into());
        }
        let check = |argument: &str| check_argument(argument);
        let runs = parse(path, &text, &BatchOptions { known: known(), check: &check })?;
        return Ok((stem(path).to_string_lossy().into_owned(), runs));
    }
    Ok(("batch".into(), plain(files)))
}

/// The options of `luxmap render` that a batch may give.
fn known() -> Vec<(String, Arity)> {
    let command = render::command();
    let option = |argument: &clap::Arg| {
        let name = argument.get_long().filter(|name| !OWN.contains(name))?;
        let kind = match argument.get_action() {
            clap::ArgAction::SetTrue => Arity::Switch,
            clap::ArgAction::Append => Arity::List,
            _ => Arity::One,
        };
        Some((name.to_owned(), kind))
    };
    command.get_arguments().filter_map(option).collect()
}

/// Whether `luxmap render` takes this; else what it expects.
fn check_argument(argument: &str) -> Result<(), String> {
    use clap::error::{ContextKind, ContextValue};
    let Err(error) = render::parse(&[argument.to_owned()], Path::new("scene")) else { return Ok(()) };
    if let Some(ContextValue::Strings(words)) = error.get(ContextKind::ValidValue) {
        return Err(format!("one of {}", words.join(", ")));
    }
    let why = std::error::Error::source(&error).map_or_else(|| sentence(&error), ToString::to_string);
    Err(match why.strip_prefix("expected ") {
        Some(expected) => expected.to_owned(),
        None => {
            let name = argument.split('=').next().unwrap_or_default();
            format!("what {name} takes ({})", one_line(&why, "; "))
        }
    })
}

/// Refuses options after `--` that make no sense, before any run begins.
fn check_options(options: &[String]) -> Result<(), Error> {
    render::parse(options, Path::new("scene")).map_err(|error| Error::Usage(sentence(&error)))?;
    let own = |option: &String| {
        let name = option.split('=').next().unwrap_or_default();
        OWN.iter().find(|own| name.strip_prefix("--") == Some(own)).copied().or(match name {
            name if name.starts_with("-o") => Some("output"),
            name if name.starts_with("-q") => Some("quiet"),
            _ => None,
        })
    };
    match options.iter().find_map(own) {
        Some(name) => Err(Error::Usage(format!("found --{name} after --, expected options of single runs"))),
        None => Ok(()),
    }
}

/// Brings a run as far as it goes, and says how far.
fn row(run: &BatchRun, folder: &Path, arguments: &Arguments) -> RunRow {
    let options = [run.options.as_slice(), &arguments.options].concat();
    let mut row = RunRow {
        name: run.name.clone(),
        scene: run.scene.clone(),
        options,
        status: Status::NotBegun,
        figures: None,
        warnings: Vec::new(),
        message: None,
    };
    if interrupted() {
        return row;
    }
    let attempt = caught(|| attempt(run, &folder.join(&run.name), &row.options, arguments));
    match attempt.unwrap_or_else(|panic| Err(Error::Usage(panic))) {
        Ok(RunResult { status, figures, warnings, missed }) => {
            row.message = missed.then(|| "misses a target or requirement".into());
            RunRow { status, figures: Some(figures), warnings, ..row }
        }
        Err(error) => RunRow { status: Status::Failed, message: Some(one_line(&said(&error), " ")), ..row },
    }
}

/// The result of a run that didn't fail.
struct RunResult {
    status: Status,
    figures: RunFigures,
    warnings: Vec<String>,
    /// Whether it misses what `--check` asks for.
    missed: bool,
}

/// Does a run that isn't done yet: from its checkpoint on, if there is one that fits.
fn attempt(run: &BatchRun, folder: &Path, options: &[String], arguments: &Arguments) -> Result<RunResult, Error> {
    let own = render::parse(options, &run.scene).map_err(|error| Error::Usage(sentence(&error)))?;
    forget_peak_memory();
    let bar = TerminalBar::new(arguments.quiet);
    let checkpoint = folder.join("checkpoint");
    let planned = own.job(&bar)?.checkpoint(&checkpoint).planned()?;
    let layers = own.common.layers();
    let asked = Request::new(planned.recipe(), &planned.settings, planned.most_cells, &layers);
    if let Some(Done { figures, warnings, missed, .. }) = Done::read(folder, &asked) {
        discard(&checkpoint, arguments);
        return Ok(RunResult { status: Status::DoneBefore, figures, warnings, missed: missed && own.check });
    }
    let _claim = Claim::of(folder)?;
    let mut status = if checkpoint_files(&checkpoint).is_empty() { Status::Done } else { Status::Resumed };
    let mut warnings = Vec::new();
    let mut results = loop {
        let found = planned.alone();
        bar.clear();
        match found {
            Err(Error::Input(error)) if checkpoint_files(&checkpoint).contains(&error.at.file) => {
                let aside = folder.join("checkpoint-refused");
                fs::rename(&error.at.file, &aside).map_err(|source| Error::Write { path: aside.clone(), source })?;
                warnings.push(format!("{error}; now {}, and the run began anew", aside.display()));
                status = Status::Done;
            }
            results => break results?,
        }
    };
    flag(&mut results);
    let files = report::write(&results, folder, &layers)?;
    warnings.extend(results.run.warnings.iter().cloned());
    let (figures, missed) = (RunFigures::of(&results), results.misses_target());
    if interrupted() {
        return Ok(RunResult { status: Status::Interrupted, figures, warnings, missed: missed && own.check });
    }
    let Done { figures, warnings, .. } = Done::write(folder, asked, figures, warnings, missed, &files)?;
    discard(&checkpoint, arguments);
    Ok(RunResult { status, figures, warnings, missed: missed && own.check })
}

/// Removes the checkpoint of a run that is done, unless it is to be kept.
fn discard(checkpoint: &Path, arguments: &Arguments) {
    if !arguments.keep_checkpoints {
        for file in checkpoint_files(checkpoint) {
            // One that can't be removed does no harm.
            let _ = fs::remove_file(file);
        }
    }
}

/// Lets the system count this process's peak memory anew: each run reports its own, not that of the run before. Linux
/// only.
fn forget_peak_memory() {
    let _ = fs::write("/proc/self/clear_refs", "5");
}
