//! Dimming levels in a file: `{"dimming": {"L[1,1]": 0.42}}`, as `luxmap dim` and the live page write them.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value;

use crate::error::{Error, InputError, Location};
use crate::files;

/// Largest file read, bytes.
const LARGEST: u64 = 64 << 20;

/// Levels of luminaires by name, 0 (off) … 1 (full output); others stay as the scene has them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Levels {
    /// By name.
    pub of: BTreeMap<String, f64>,
    /// Whence, for messages.
    from: Option<Location>,
    /// Line of each name.
    lines: BTreeMap<String, usize>,
}

impl Levels {
    /// These levels.
    pub fn new(of: impl IntoIterator<Item = (String, f64)>) -> Self {
        Self { of: of.into_iter().collect(), ..Default::default() }
    }

    /// Reads a file. Any mistake is refused in one line.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let refuse = |at: Location, found: String, expected: &str| InputError::new(at, found, expected);
        let form = "levels from 0 to 1 by luminaire, as {\"dimming\": {\"L[1,1]\": 0.42}}";
        let whole = Location::file(path);
        let bytes = files::read(path, LARGEST).map_err(|error| refuse(whole.clone(), files::why(&error), form))?;
        let text =
            String::from_utf8(bytes).map_err(|_| refuse(whole.clone(), "bytes that are no UTF-8".into(), form))?;
        let value: Value = serde_json::from_str(&text)
            .map_err(|error| refuse(Location::line(path, error.line().max(1)), format!("no JSON ({error})"), form))?;
        let Some(levels) = value.get("dimming").and_then(Value::as_object) else {
            return Err(refuse(whole, "no \"dimming\" with levels in it".into(), form).into());
        };
        let mut found = Self { from: Some(whole), ..Default::default() };
        for (name, level) in levels {
            let line = line_of(&text, name);
            match level.as_f64() {
                Some(level) if (0.0..=1.0).contains(&level) => {
                    found.of.insert(name.clone(), level);
                    found.lines.extend(line.map(|line| (name.clone(), line)));
                }
                _ => {
                    let at = line.map_or_else(|| Location::file(path), |line| Location::line(path, line));
                    return Err(refuse(at, format!("\"{name}\": {level}"), "a level from 0 (off) to 1").into());
                }
            }
        }
        Ok(found)
    }

    /// Where the file names a luminaire.
    pub(crate) fn place(&self, name: &str) -> Location {
        let at = self.from.clone().unwrap_or_else(|| Location::file(Path::new("levels")));
        Location { line: self.lines.get(name).copied(), ..at }
    }

    /// Writes a file, with what else there is to say of it.
    pub fn write(&self, path: &Path, more: &[(&str, Value)]) -> Result<(), Error> {
        let mut content = serde_json::Map::new();
        content.extend(more.iter().map(|(name, value)| ((*name).to_owned(), value.clone())));
        content.insert("dimming".into(), Value::from_iter(self.of.clone()));
        let text = serde_json::to_string_pretty(&Value::Object(content)).expect("levels are numbers");
        files::write_whole(path, &mut |out| std::io::Write::write_all(out, format!("{text}\n").as_bytes()))
    }
}

/// The line where a name stands before its level.
fn line_of(text: &str, name: &str) -> Option<usize> {
    let quoted = serde_json::to_string(name).ok()?;
    let at = text.match_indices(&quoted).find(|(at, _)| text[at + quoted.len()..].trim_start().starts_with(':'))?.0;
    Some(text[..at].matches('\n').count() + 1)
}
