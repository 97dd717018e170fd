//! `luxmap luminaire`: what photometric files say.

use std::collections::HashSet;
use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::progress::TerminalBar;
use super::{Outcome, complain, one_line, print};
use crate::error::{Error, InputError, Location};
use crate::files;
use crate::files::Claim;
use crate::files::limits::LARGEST_PHOTOMETRY;
use crate::luminaire::photometry::Photometry;
use crate::progress::Progress as _;
use crate::report::luminaire::{self, Entry, Figures, Sheet};

/// Read photometric files: flux, intensities, opening, how they lie in the room, with drawings; many as a list.
///
/// One file: a text, and in DIR luminaire.html, polar.svg, polar.png and luminaire.json.
///
/// Several files, or folders (with all folders in them): a table, and in DIR luminaires.csv,
/// luminaires.html (a contact sheet) and a folder for each file, named by it. A file that can't be
/// read has its row and card with the reason, and makes the exit code 2.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(super) struct Arguments {
    /// Photometric files, by content: LM-63 (.ies, editions 1986 to 2019), EULUMDAT (.ldt) and what else luxmap reads;
    /// or folders.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Folder for the results.
    #[arg(
        long,
        short,
        value_name = "DIR",
        help = "Folder for the results [default: out/<file with its ending>; of several: out/luminaires]"
    )]
    output: Option<PathBuf>,
    /// Print JSON instead of text; of several files an array.
    #[arg(long)]
    json: bool,
    /// No progress on stderr.
    #[arg(long, short)]
    quiet: bool,
}

/// Endings of photometric files in a folder, those too of formats that are refused by name.
const ENDINGS: [&str; 8] = ["ies", "ldt", "gldf", "uld", "rolf", "rolfz", "cib", "tm14"];

/// Endings of files that are photometric if their beginning says so.
const PERHAPS: [&str; 2] = ["xml", "json"];

/// What the beginning of a TM-33 or ATLA S001 file holds, in lower case.
const MARKS: [&str; 4] = ["tm33", "tm-33", "atla-s001", "luminaireopticaldata"];

/// Most files of a run.
const MOST_FILES: usize = 100_000;

pub(super) fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    match &arguments.files[..] {
        [file] if !file.is_dir() => one(file, arguments),
        several => many(several, arguments),
    }
}

fn one(file: &Path, arguments: &Arguments) -> Result<Outcome, Error> {
    let photometry = Photometry::read(file)?;
    let figures = Figures::new(&photometry.intensity);
    let own = || Path::new("out").join(file.file_name().unwrap_or("luminaire".as_ref()));
    let folder = arguments.output.clone().unwrap_or_else(own);
    let _claim = Claim::of(&folder)?;
    let written = luminaire::write(file, &photometry, &figures, &folder)?;
    if arguments.json {
        print(&luminaire::json(file, &photometry, &figures))?;
    } else {
        print(&luminaire::text(file, &photometry, &figures))?;
        print(&format!("wrote {} files to {}\n", written.len(), folder.display()))?;
    }
    Ok(Outcome::Done)
}

fn many(arguments: &[PathBuf], options: &Arguments) -> Result<Outcome, Error> {
    let files = listed(arguments)?;
    let home = options.output.clone().unwrap_or_else(|| Path::new("out").join("luminaires"));
    let _claim = Claim::of(&home)?;
    let names: Vec<String> = files.iter().map(|file| file.name.clone()).collect();
    let bar = TerminalBar::new(options.quiet);
    bar.stage("files", files.len() as u64);
    let entries = files.par_iter().zip(luminaire::folders(&names)).map(|(file, folder)| {
        let read = match &file.unread {
            None => Photometry::read(&file.path).map_err(|error| one_line(&error.to_string(), " ")),
            Some(error) => Err(error.clone()),
        };
        let entry = Entry::new(&file.path, read, folder, &home);
        bar.advance(1);
        entry
    });
    let sheet = Sheet(entries.collect::<Result<_, _>>()?);
    drop(bar);
    let written = sheet.write(&home)?;
    let unread: Vec<&str> = sheet.0.iter().filter_map(Entry::error).collect();
    unread.iter().for_each(|error| complain(&format!("luxmap: {error}")));
    if options.json {
        print(&sheet.json())?;
    } else {
        print(&sheet.text())?;
        let written: Vec<String> = written.iter().map(|path| path.display().to_string()).collect();
        print(&format!("wrote {}\n", written.join(" and ")))?;
    }
    Ok(if unread.is_empty() { Outcome::Done } else { Outcome::Refused })
}

/// A file to be read.
struct Listed {
    path: PathBuf,
    /// What its folder of results is named by: where it lies in the folder that was asked for, with `/` between.
    name: String,
    /// Why it can't be, where that is known already.
    unread: Option<String>,
}

/// All files that are asked for, those of a folder in the order of their paths; each once.
fn listed(arguments: &[PathBuf]) -> Result<Vec<Listed>, Error> {
    let (mut files, mut passed_over) = (Vec::new(), 0);
    for argument in arguments {
        if argument.is_dir() {
            let before = files.len();
            passed_over += in_folder(argument, &mut files)?;
            if files.len() == before {
                let found = "no photometric file in it or in its folders";
                let expected = format!("files that end in .{} or .{}", ENDINGS.join(", ."), PERHAPS.join(", ."));
                return Err(InputError::new(Location::file(argument), found, expected).into());
            }
        } else {
            let name = argument.file_name().unwrap_or(argument.as_os_str()).to_string_lossy().into_owned();
            files.push(Listed { path: argument.clone(), name, unread: None });
        }
    }
    let mut taken = HashSet::new();
    files.retain(|file| fs::canonicalize(&file.path).map_or(true, |whole| taken.insert(whole)));
    if passed_over > 0 {
        let files = if passed_over == 1 { "file" } else { "files" };
        complain(&format!("note: {passed_over} .xml or .json {files} passed over: neither TM-33 nor ATLA S001"));
    }
    Ok(files)
}

/// Adds the photometric files in a folder and its folders, hidden ones and links to folders left out; returns how many
/// files that might have been photometric are not.
fn in_folder(folder: &Path, files: &mut Vec<Listed>) -> Result<usize, Error> {
    let name = |path: &Path| {
        let parts: Vec<_> =
            path.strip_prefix(folder).unwrap_or(path).iter().map(|part| part.to_string_lossy()).collect();
        parts.join("/")
    };
    let (mut found, mut passed_over, mut folders) = (Vec::new(), 0, vec![folder.to_owned()]);
    while let Some(inner) = folders.pop() {
        let entries = match fs::read_dir(&inner) {
            Ok(entries) => entries,
            Err(error) => {
                let unread = InputError::new(
                    Location::file(&inner),
                    format!("a folder that can't be read ({})", files::why(&error)),
                    "a folder of photometric files",
                );
                found.push(Listed { name: name(&inner), path: inner, unread: Some(unread.to_string()) });
                continue;
            }
        };
        for entry in entries.flatten() {
            let path = entry.path();
            if entry.file_name().to_string_lossy().starts_with('.') {
                continue;
            }
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                folders.push(path);
            } else if !path.is_dir() {
                match is_photometric(&path) {
                    Some(true) => found.push(Listed { name: name(&path), path, unread: None }),
                    Some(false) => passed_over += 1,
                    None => {}
                }
            }
        }
        if files.len() + found.len() > MOST_FILES {
            let at = Location::file(folder);
            return Err(InputError::new(at, format!("more than {MOST_FILES} files"), "no more in a run").into());
        }
    }
    found.sort_by(|a, b| a.path.cmp(&b.path));
    files.extend(found);
    Ok(passed_over)
}

/// Whether a file in a folder is photometric; nothing where its ending leaves no doubt that it isn't.
fn is_photometric(path: &Path) -> Option<bool> {
    let ending = path.extension()?.to_string_lossy().to_ascii_lowercase();
    if ENDINGS.contains(&ending.as_str()) {
        return Some(true);
    }
    PERHAPS.contains(&ending.as_str()).then(|| {
        let mut beginning = Vec::new();
        let read = files::open(path, LARGEST_PHOTOMETRY).map(|file| file.take(4096).read_to_end(&mut beginning));
        // Whatever the encoding: letters of UTF-16 are those of ASCII with zeros between them.
        let letters: Vec<u8> = beginning.into_iter().filter(|byte| *byte != 0).collect();
        let text = String::from_utf8_lossy(&letters).to_ascii_lowercase();
        // A luminaire.json of this command's own names the format it read.
        read.is_ok() && !text.contains("\"luxmap\"") && MARKS.iter().any(|mark| text.contains(mark))
    })
}
