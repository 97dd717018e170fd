//! A state in a file: what made it, in words (JSON), then its sums, then a checksum over both.
//!
//! ```text
//! luxmap state 4\n         magic and number of this format
//! length of the words      8 bytes, little-endian, as all numbers
//! words                    JSON, see `StateHeader`
//! sums                     in the order in which the run writes them; see `Tape`
//! checksum                 SHA-256 of all before, 32 bytes
//! ```
//!
//! The file is written under a temporary name, handed to the disk, and only then renamed: under its own name it is
//! always whole, and of some finished pass. Nothing of a file is believed before its checksum.

use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::{Passes, tape::Tape};
use crate::error::{Error, InputError, Location};
use crate::files;

const MAGIC: &[u8] = b"luxmap state 4\n";
const CHECKSUM: usize = 32;
/// Longest words believed, bytes.
const LONGEST: u64 = 16 << 20;

/// What a state is made by: states of equal recipes add up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Version of luxmap.
    pub luxmap: String,
    /// SHA-256 of the scene and its files.
    pub scene_sha256: String,
    /// Planes and surfaces measured.
    pub planes: Vec<String>,
    /// Cameras.
    pub cameras: Vec<String>,
    /// `gather`, `split`, `path`, `photons` or `seed`.
    pub method: String,
    /// Tree of the photon map.
    pub tree: String,
    /// Photons a pass.
    pub photons: u64,
    /// Rays of a point and pass.
    pub rays: u32,
    /// Whether neighbours help each other.
    pub smooth: bool,
    /// k, where it was given.
    pub nearest: Option<usize>,
    /// Largest search radius where it was given, m.
    pub radius: Option<f64>,
    /// Whether light groups are told apart.
    pub groups: bool,
}

impl Recipe {
    /// What another one differs in: its name, what stands here, and what there.
    pub fn difference(&self, other: &Self) -> Option<(String, String, String)> {
        let fields = |recipe: &Self| match serde_json::to_value(recipe) {
            Ok(serde_json::Value::Object(fields)) => fields,
            _ => serde_json::Map::new(),
        };
        let (here, there) = (fields(self), fields(other));
        let differs = here.into_iter().find(|(name, value)| there.get(name) != Some(value))?;
        let (name, value) = differs;
        let other = there.get(&name).map_or_else(String::new, ToString::to_string);
        Some((name, value.to_string(), other))
    }
}

/// What a file says of its state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StateHeader {
    /// The scene file, where it was.
    pub scene: PathBuf,
    /// What made the state.
    pub recipe: Recipe,
    /// Which passes it holds.
    pub passes: Passes,
    /// When the error is asked for next: the one aimed at, %, and the number of passes.
    pub next_check: Option<(f64, u32)>,
}

/// Writes a state and has the system put it on the disk. Cost: some 1 s a gigabyte.
pub fn write(
    path: &Path,
    words: &StateHeader,
    sums: &mut dyn FnMut(&mut Tape<'_>) -> io::Result<()>,
) -> Result<(), Error> {
    files::write_whole(path, &mut |out| {
        let mut out = Hashing { inner: out, hash: Sha256::new() };
        let text = serde_json::to_vec(words)?;
        out.write_all(MAGIC)?;
        out.write_all(&(text.len() as u64).to_le_bytes())?;
        out.write_all(&text)?;
        sums(&mut Tape::Out(&mut out))?;
        let Hashing { inner, hash } = out;
        inner.write_all(&hash.finalize())?;
        inner.flush()?;
        inner.get_ref().sync_all()
    })
}

/// A state in a file whose checksum is right.
pub struct Kept {
    path: PathBuf,
    file: BufReader<io::Take<File>>,
    /// What it says of itself.
    pub words: StateHeader,
}

impl Kept {
    /// Opens a file and checks it. Cost: that of reading it once.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let refuse = |found: String| {
            let error = InputError::new(Location::file(path), found, "a state that luxmap has written");
            Error::Input(error.hint("a checkpoint that is not whole can only be deleted"))
        };
        Self::read(path).map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => Error::Input(InputError::new(
                Location::file(path),
                "no such file",
                "a state that luxmap render --checkpoint has written",
            )),
            io::ErrorKind::UnexpectedEof => refuse("a file that ends too early".into()),
            _ => refuse(error.to_string()),
        })
    }

    fn read(path: &Path) -> io::Result<Self> {
        let mut file = files::open(path, u64::MAX)?;
        let whole = file.metadata()?.len();
        let Some(content) = whole.checked_sub(CHECKSUM as u64).filter(|&content| content >= MAGIC.len() as u64) else {
            return Err(io::ErrorKind::UnexpectedEof.into());
        };
        let mut hash = Sha256::new();
        let mut block = vec![0; 1 << 18];
        let mut left = content;
        let mut first = true;
        while left > 0 {
            let part = &mut block[..usize::try_from(left).unwrap_or(usize::MAX).min(1 << 18)];
            file.read_exact(part)?;
            if std::mem::take(&mut first) && !part.starts_with(MAGIC) {
                return Err(crate::error::invalid("something else than a state of this version".into()));
            }
            hash.update(&*part);
            left -= part.len() as u64;
        }
        let mut checksum = [0; CHECKSUM];
        file.read_exact(&mut checksum)?;
        if hash.finalize()[..] != checksum {
            return Err(crate::error::invalid("a checksum that does not fit the content".into()));
        }
        file.seek(SeekFrom::Start(MAGIC.len() as u64))?;
        let mut file = BufReader::new(file.take(content - MAGIC.len() as u64));
        let mut length = [0; 8];
        file.read_exact(&mut length)?;
        let length = u64::from_le_bytes(length);
        if length > LONGEST {
            return Err(crate::error::invalid(format!("words of {length} bytes")));
        }
        let mut text = vec![0; length as usize];
        file.read_exact(&mut text)?;
        let words: StateHeader = serde_json::from_slice(&text)?;
        if !words.passes.is_valid() {
            return Err(crate::error::invalid(format!("impossible passes ({})", words.passes)));
        }
        Ok(Self { path: path.to_owned(), file, words })
    }

    /// Adds its sums to those that `sums` passes to the tape.
    pub fn add_to(mut self, sums: &mut dyn FnMut(&mut Tape<'_>) -> io::Result<()>) -> Result<(), Error> {
        let mut all = || {
            sums(&mut Tape::In(&mut self.file))?;
            match self.file.read(&mut [0])? {
                0 => Ok(()),
                _ => Err(crate::error::invalid("more than this scene has".into())),
            }
        };
        all().map_err(|error| {
            let found = match error.kind() {
                io::ErrorKind::UnexpectedEof => "less than this scene has".into(),
                _ => error.to_string(),
            };
            Error::Input(InputError::new(
                Location::file(&self.path),
                found,
                "the state of this scene and these settings",
            ))
        })
    }
}

/// Hashes what is written.
struct Hashing<'a> {
    inner: &'a mut BufWriter<File>,
    hash: Sha256,
}

impl Write for Hashing<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(bytes)?;
        self.hash.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}
