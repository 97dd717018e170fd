//! `luxmap check`: stiff and extreme cases against their exact answers.

use std::path::PathBuf;

use super::{Outcome, print};
use crate::error::Error;
use crate::job::pool;
use crate::study::check::{Case, cases, document};

/// Run stiff and extreme cases, each against its exact answer: is what is found right, and as sure as it says? Exit
/// code 1 if any is not.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Only the cases that take a moment: 20 s in all instead of minutes.
    #[arg(long)]
    quick: bool,
    /// Only the cases whose group or name holds this; repeatable.
    #[arg(long, value_name = "WORDS")]
    only: Vec<String>,
    /// List the cases, run none.
    #[arg(long)]
    list: bool,
    /// Write a summary to this Markdown file, and all rows to a CSV file beside it; what the former holds from "## Fuzzing" on
    /// is kept.
    #[arg(long, short, value_name = "FILE", visible_alias = "markdown")]
    output: Option<PathBuf>,
    /// Threads [default: all].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Print the rows as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let chosen = choose(arguments)?;
    arguments.output.as_deref().map_or(Ok(()), document::fits)?;
    if arguments.list {
        let titles: String = chosen.iter().map(|case| case.title() + "\n").collect();
        return print(&titles).map(|()| Outcome::Done);
    }
    let pool = pool(arguments.threads)?;
    let folder = std::env::temp_dir().join(format!("luxmap-check-{}", std::process::id()));
    let mut rows = Vec::with_capacity(chosen.len());
    for case in &chosen {
        let row = pool.install(|| case.run(&folder));
        if !arguments.json {
            print(&document::brief(&row))?;
        }
        rows.push(row);
    }
    // Nothing of it is of use to anybody.
    let _ = std::fs::remove_dir_all(&folder);
    if let Some(path) = &arguments.output {
        document::write(&rows, path)?;
    }
    let outside = rows.iter().filter(|row| row.verdict.is_outside()).count();
    if arguments.json {
        print(&document::json(&rows))?;
    } else {
        print(&format!("{} cases, {outside} outside of their bounds\n", rows.len()))?;
    }
    Ok(if outside > 0 { Outcome::Missed } else { Outcome::Done })
}

fn choose(arguments: &Arguments) -> Result<Vec<Case>, Error> {
    let named = |case: &Case| {
        let title = case.title().to_lowercase();
        arguments.only.is_empty() || arguments.only.iter().any(|words| title.contains(&words.to_lowercase()))
    };
    let all = cases().into_iter();
    let chosen: Vec<Case> = all.filter(|case| named(case) && (case.quick || !arguments.quick)).collect();
    if chosen.is_empty() {
        let words = arguments.only.join("\", \"");
        return Err(Error::Usage(format!("--only: found no case with \"{words}\", expected words of --list")));
    }
    Ok(chosen)
}
