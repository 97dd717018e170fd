//! The marker of a run that is done: what was asked for, and what each result file holds.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::batch::report::RunFigures;
use crate::error::Error;
use crate::files;
use crate::render::Settings;
use crate::report::ExtraLayers;
use crate::state::file::Recipe;

/// Name of the marker in a run's folder.
const NAME: &str = "done.json";

/// What a run was asked for: results of equal ones are equal to the bit, but for a limit of time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    recipe: Recipe,
    seed: u64,
    first_pass: u32,
    passes: Option<u32>,
    error: Option<f64>,
    time: Option<f64>,
    /// Where large planes are cut.
    most_cells: usize,
    /// Direct light, indirect light, standard error.
    layers: [bool; 3],
}

impl Request {
    /// What makes the states, when to stop, and what to write.
    pub fn new(recipe: Recipe, settings: &Settings, most_cells: usize, layers: &ExtraLayers) -> Self {
        let Settings { seed, first_pass, stop, .. } = *settings;
        let (passes, error, time) = (stop.passes(), stop.error(), stop.time().map(|time| time.as_secs_f64()));
        let layers = [layers.direct, layers.indirect, layers.standard_error];
        Self { recipe, seed, first_pass, passes, error, time, most_cells, layers }
    }
}

/// A run that is done.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Done {
    asked: Request,
    /// What the run found, in short.
    pub figures: RunFigures,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Whether a sensor misses its target, or an area what is required of it.
    pub missed: bool,
    files: Vec<WrittenFile>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenFile {
    name: PathBuf,
    sha256: String,
}

impl Done {
    /// The run in `folder`, if it was asked the same and each of its results is whole. Cost: reading them.
    pub fn read(folder: &Path, asked: &Request) -> Option<Self> {
        let text = std::fs::read(folder.join(NAME)).ok()?;
        let done: Self = serde_json::from_slice(&text).ok()?;
        let whole =
            |written: &WrittenFile| digest(&folder.join(&written.name)).is_ok_and(|digest| digest == written.sha256);
        (done.asked == *asked && done.files.iter().all(whole)).then_some(done)
    }

    /// Hands the results `written` to the disk, then says that the run is done.
    pub fn write(
        folder: &Path,
        asked: Request,
        figures: RunFigures,
        warnings: Vec<String>,
        missed: bool,
        written: &[PathBuf],
    ) -> Result<Self, Error> {
        let file = |path: &PathBuf| {
            let name = path.strip_prefix(folder).unwrap_or(path).to_owned();
            let kept = File::options().write(true).open(path).and_then(|file| file.sync_all());
            let digest =
                kept.and_then(|()| digest(path)).map_err(|source| Error::Write { path: path.clone(), source })?;
            Ok(WrittenFile { name, sha256: digest })
        };
        let files = written.iter().map(file).collect::<Result<_, Error>>()?;
        let done = Self { asked, figures, warnings, missed, files };
        files::write_whole(&folder.join(NAME), &mut |out| {
            out.write_all(&serde_json::to_vec_pretty(&done)?)?;
            out.flush()?;
            out.get_ref().sync_all()
        })?;
        Ok(done)
    }
}

/// SHA-256 of a file.
fn digest(path: &Path) -> io::Result<String> {
    let mut file = File::open(path)?;
    let (mut hash, mut block) = (Sha256::new(), vec![0; 1 << 18]);
    loop {
        match file.read(&mut block)? {
            0 => return Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()),
            read => hash.update(&block[..read]),
        }
    }
}
