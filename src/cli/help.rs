//! `luxmap help`: of a command, or of the scene file.

use clap::Parser as _;

use super::{Outcome, print, sentence};
use crate::error::Error;
use crate::scene::file::reference::{self, CONVENTIONS, ReferencePage};

/// Print this message, the help of a command, or with scene every key of the scene file.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// A command, or scene.
    topic: Option<String>,
    /// Print the keys of the scene file as Markdown: docs/SCENE.md.
    #[arg(long)]
    markdown: bool,
}

/// Widest line, as of all help.
pub(super) const WIDEST: usize = 110;

pub(super) fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    match (arguments.topic.as_deref(), arguments.markdown) {
        (Some("scene"), true) => print(&reference::markdown())?,
        (Some("scene"), false) => print(&scene())?,
        (_, true) => return Err(Error::Usage("--markdown: expected luxmap help scene --markdown".to_owned())),
        (topic, false) => {
            let words = std::iter::once("luxmap").chain(topic).chain(["--help"]);
            if let Err(error) = super::Arguments::try_parse_from(words) {
                if error.use_stderr() {
                    return Err(Error::Usage(format!("{}; try --help", sentence(&error))));
                }
                let _ = error.print(); // nobody listens: nothing left to say it to
            }
        }
    }
    Ok(Outcome::Done)
}

/// Every key of the scene file, as wide as the terminal.
fn scene() -> String {
    let conventions = CONVENTIONS.iter().map(|(title, words)| format!("{title}. {words}")).collect::<Vec<_>>();
    let conventions = clap::Command::new("scene")
        .max_term_width(WIDEST)
        .about(without_code(&conventions.join("\n\n")))
        .help_template("{about}")
        .render_help();
    let sections: Vec<String> = reference::pages().iter().map(section).collect();
    format!("Scene files: every key\n\n{}\n{}", conventions.to_string().trim_end(), sections.concat())
}

/// A section. clap sets keys in two columns as it does with subcommands, and knows how wide the terminal is.
fn section(page: &ReferencePage) -> String {
    let keys = page.keys().enumerate();
    let keys = keys.map(|(at, (name, words))| clap::Command::new(name).about(without_code(&words)).display_order(at));
    let mut end: String = page.rules().iter().map(|rule| format!("- {}\n", without_code(rule))).collect();
    if !page.example().is_empty() {
        let lines = page.example().lines().map(|line| format!("    {line}").trim_end().to_owned() + "\n");
        end += &format!("\n{}", lines.collect::<String>());
    }
    let help = clap::Command::new("scene")
        .disable_help_flag(true)
        .disable_help_subcommand(true)
        .max_term_width(WIDEST)
        .about(without_code(page.about()))
        .after_help(end)
        .subcommands(keys)
        .help_template("{about}\n\n{subcommands}{after-help}")
        .render_help()
        .to_string();
    let title = page.title();
    let line = "=".repeat(title.chars().count());
    format!("\n{title}\n{line}\n{}\n", help.trim_end())
}

/// Text for the terminal: without the backquotes of Markdown.
fn without_code(text: &str) -> String {
    text.replace('`', "")
}
