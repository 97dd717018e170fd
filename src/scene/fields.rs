//! Sections of a TOML file read key by key, so that every refusal can name its line, what stands there and what could.
//!
//! `toml` keeps the place of each key and value ([`toml::Spanned`]); serde's derive would lose it in its messages, so
//! the tables are read directly.

use std::ops::Range;
use std::path::{Path, PathBuf};

use glam::DVec3;
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

use crate::error::{InputError, Location};
use crate::text::{escaped, listed, quoted};

/// Farthest coordinate from the world's origin, m: beyond it even f64 leaves no tenth of a millimetre to compute with.
pub(crate) const FARTHEST: f64 = 1e9;

/// A text file, and where its lines begin.
pub(crate) struct Source {
    path: PathBuf,
    line_starts: Vec<usize>,
}

impl Source {
    pub(crate) fn new(path: &Path, text: &str) -> Self {
        let line_starts = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        Self { path: path.to_owned(), line_starts }
    }

    /// The file, as the user named it.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The line in which `span` begins.
    pub(crate) fn at(&self, span: &Range<usize>) -> Location {
        Location::line(&self.path, self.line_starts.partition_point(|&start| start <= span.start))
    }

    /// What `text`, the file's own, says as TOML; else its first mistake.
    pub(crate) fn table<'a>(&self, text: &'a str) -> Result<Spanned<DeTable<'a>>, InputError> {
        // `DeTable::parse` would report the last error, often a mere consequence of the first.
        let (table, errors) = DeTable::parse_recoverable(text);
        match errors.iter().min_by_key(|error| error.span().map(|span| span.start)) {
            Some(error) => Err(self.syntax_error(error)),
            None => Ok(table),
        }
    }

    /// `toml`'s own message, which has several lines, as one.
    fn syntax_error(&self, error: &toml::de::Error) -> InputError {
        let at = self.at(&error.span().unwrap_or(0..0));
        let message = error.message().replace('\n', " ");
        let (found, expected) = match message.split_once(", expected ") {
            Some((found, "literal string")) => (found, "text in quotes"),
            Some((found, expected)) if expected != "nothing" => (found, expected),
            Some((found, _)) => (found, "valid TOML"),
            None if message == "duplicate key" => ("the same key twice", "each key once"),
            None => (message.as_str(), "valid TOML"),
        };
        InputError::new(at, format!("broken TOML ({found})"), expected)
    }
}

/// A value, and where it stands.
#[derive(Clone, Debug)]
pub(crate) struct Placed<T> {
    pub(crate) value: T,
    pub(crate) at: Location,
}

/// A value of one word.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Word {
    Text(String),
    /// In plain decimals where it is whole: 1e6 is 1000000.
    Number(String),
    Switch(bool),
}

/// Words, and whether they are a list.
pub(crate) type Words = (bool, Vec<Placed<Word>>);

/// The keys of one section, such as one `[[luminaire]]`.
pub(crate) struct Fields<'a> {
    source: &'a Source,
    section: String,
    /// Line of the section's head.
    pub(crate) at: Location,
    table: &'a DeTable<'a>,
}

impl<'a> Fields<'a> {
    /// A section that knows the keys `known` and refuses others. `section` is its name as the user writes it.
    pub(crate) fn new(
        source: &'a Source,
        section: impl Into<String>,
        at: Location,
        table: &'a DeTable<'a>,
        known: &[&str],
    ) -> Result<Self, InputError> {
        let section = section.into();
        let strangers = table.keys().filter(|key| !known.contains(&key.get_ref().as_ref()));
        if let Some(key) = strangers.min_by_key(|key| key.span().start) {
            let found = format!("unknown key {} in {section}", quoted(key.get_ref()));
            let error = InputError::new(source.at(&key.span()), found, format!("one of {}", known.join(", ")));
            return Err(match closest(key.get_ref(), known.iter().copied()) {
                Some(near) => error.hint(format!("did you mean {near}?")),
                None => error,
            });
        }
        Ok(Self { source, section, at, table })
    }

    fn get(&self, key: &str) -> Option<(&'a Spanned<DeString<'a>>, &'a Spanned<DeValue<'a>>)> {
        self.table.get_key_value(key)
    }

    /// Refuses the value of `key`, which stands at `value`.
    fn refuse(&self, key: &str, value: &Spanned<DeValue>, expected: impl Into<String>) -> InputError {
        let found = format!("{key} = {} in {}", described(value.get_ref()), self.section);
        InputError::new(self.source.at(&value.span()), found, expected)
    }

    /// Refuses a section that lacks `key`.
    pub(crate) fn missing(&self, key: &str, example: &str) -> InputError {
        InputError::new(self.at.clone(), format!("{} without {key}", self.section), format!("{key} = {example}"))
    }

    /// The file it stands in.
    pub(crate) fn source(&self) -> &'a Source {
        self.source
    }

    /// Line of the value of `key`.
    pub(crate) fn place(&self, key: &str) -> Option<Location> {
        self.get(key).map(|(_, value)| self.source.at(&value.span()))
    }

    /// Its name, as the user writes it.
    pub(crate) fn section(&self) -> &str {
        &self.section
    }

    /// Its keys, in the order of the file.
    pub(crate) fn keys(&self) -> Vec<&'a str> {
        let mut keys: Vec<_> = self.table.keys().collect();
        keys.sort_by_key(|key| key.span().start);
        keys.into_iter().map(|key| key.get_ref().as_ref()).collect()
    }

    /// Text, a number, or true or false: one of them, or a list. Whether it is a list comes first.
    pub(crate) fn words(&self, key: &str) -> Result<Option<Words>, InputError> {
        const EXPECTED: &str = "text in quotes, a number, true or false, or a list of such";
        let Some((_, value)) = self.get(key) else { return Ok(None) };
        let word = |item: &Spanned<DeValue>| {
            let word = word(item.get_ref()).ok_or_else(|| self.refuse(key, value, EXPECTED))?;
            Ok(self.placed(item, word))
        };
        Ok(Some(match value.get_ref() {
            DeValue::Array(items) => (true, items.iter().map(word).collect::<Result<_, InputError>>()?),
            _ => (false, vec![word(value)?]),
        }))
    }

    /// Text.
    pub(crate) fn text(&self, key: &str) -> Result<Option<Placed<String>>, InputError> {
        let Some((_, value)) = self.get(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::String(text) => Ok(Some(self.placed(value, text.to_string()))),
            _ => Err(self.refuse(key, value, "text in quotes")),
        }
    }

    /// A name: text with something to read in it, all of it printable.
    pub(crate) fn name(&self, key: &str) -> Result<Option<Placed<String>>, InputError> {
        let Some(text) = self.text(key)? else { return Ok(None) };
        if text.value.trim().is_empty() || text.value.contains(char::is_control) {
            let found = format!("{key} = {} in {}", quoted(&text.value), self.section);
            return Err(InputError::new(text.at, found, "a name that can be printed"));
        }
        Ok(Some(text))
    }

    /// One of a few words.
    pub(crate) fn word(&self, key: &str, words: &[&str]) -> Result<Option<Placed<String>>, InputError> {
        let Some(text) = self.text(key)? else { return Ok(None) };
        if words.contains(&text.value.as_str()) {
            return Ok(Some(text));
        }
        let found = format!("{key} = {} in {}", quoted(&text.value), self.section);
        Err(InputError::new(text.at, found, format!("one of {}", listed(words.iter().copied()))))
    }

    /// True or false.
    pub(crate) fn switch(&self, key: &str) -> Result<Option<Placed<bool>>, InputError> {
        let Some((_, value)) = self.get(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::Boolean(on) => Ok(Some(self.placed(value, *on))),
            _ => Err(self.refuse(key, value, "true or false")),
        }
    }

    /// A finite number for which `accept` holds; `expected` says which those are.
    pub(crate) fn number(
        &self,
        key: &str,
        expected: &str,
        accept: impl Fn(f64) -> bool,
    ) -> Result<Option<Placed<f64>>, InputError> {
        let Some((_, value)) = self.get(key) else { return Ok(None) };
        match number(value.get_ref()) {
            Some(number) if number.is_finite() && accept(number) => Ok(Some(self.placed(value, number))),
            _ => Err(self.refuse(key, value, expected)),
        }
    }

    /// A whole number from `least` to `most`.
    pub(crate) fn whole(&self, key: &str, least: u64, most: u64) -> Result<Option<Placed<u64>>, InputError> {
        let Some((_, value)) = self.get(key) else { return Ok(None) };
        match whole(value.get_ref()) {
            Some(number) if (least..=most).contains(&number) => Ok(Some(self.placed(value, number))),
            _ => Err(self.refuse(key, value, within("a whole number", least, most))),
        }
    }

    /// Two whole numbers from `least` to `most`.
    pub(crate) fn whole_pair(&self, key: &str, least: u64, most: u64) -> Result<Option<Placed<[u64; 2]>>, InputError> {
        let Some((_, value)) = self.get(key) else { return Ok(None) };
        let pair = list(value.get_ref()).and_then(|items| Some([whole(items.first()?)?, whole(items.get(1)?)?]));
        match (pair, list(value.get_ref()).map(|items| items.len())) {
            (Some(pair), Some(2)) if pair.iter().all(|number| (least..=most).contains(number)) => {
                Ok(Some(self.placed(value, pair)))
            }
            _ => Err(self.refuse(key, value, within("two whole numbers", least, most))),
        }
    }

    /// N finite numbers, each one such that `accept` holds.
    pub(crate) fn numbers<const N: usize>(
        &self,
        key: &str,
        expected: &str,
        accept: impl Fn(f64) -> bool,
    ) -> Result<Option<Placed<[f64; N]>>, InputError> {
        let Some((_, value)) = self.get(key) else { return Ok(None) };
        let numbers =
            list(value.get_ref()).and_then(|items| items.into_iter().map(number).collect::<Option<Vec<f64>>>());
        match numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok()) {
            Some(numbers) if numbers.iter().all(|&n| n.is_finite() && accept(n)) => {
                Ok(Some(self.placed(value, numbers)))
            }
            _ => Err(self.refuse(key, value, expected)),
        }
    }

    /// Pairs of finite numbers, each one such that `accept` holds; nothing where the key holds something other than a
    /// list.
    pub(crate) fn pairs(
        &self,
        key: &str,
        expected: &str,
        accept: impl Fn(f64) -> bool,
    ) -> Result<Option<Placed<Vec<[f64; 2]>>>, InputError> {
        let Some((_, value)) = self.get(key) else { return Ok(None) };
        let Some(items) = list(value.get_ref()) else { return Ok(None) };
        let pair = |item: &DeValue| {
            let numbers: Vec<f64> = list(item)?.into_iter().map(number).collect::<Option<_>>()?;
            <[f64; 2]>::try_from(numbers).ok().filter(|pair| pair.iter().all(|&n| n.is_finite() && accept(n)))
        };
        match items.into_iter().map(pair).collect() {
            Some(pairs) => Ok(Some(self.placed(value, pairs))),
            None => Err(self.refuse(key, value, expected)),
        }
    }

    /// A place or a length in space, m.
    pub(crate) fn metres(&self, key: &str) -> Result<Option<Placed<DVec3>>, InputError> {
        let vector = self.numbers(key, "[x, y, z] in metres, each within ±1e9", |n| n.abs() <= FARTHEST)?;
        Ok(vector.map(|placed| Placed { value: DVec3::from(placed.value), at: placed.at }))
    }

    /// A direction; its length doesn't matter, so it comes back as a unit vector.
    pub(crate) fn direction(&self, key: &str) -> Result<Option<Placed<DVec3>>, InputError> {
        let vector = self.numbers(key, "a direction [x, y, z]", |n| n.abs() <= FARTHEST)?;
        let Some(Placed { value, at }) = vector else { return Ok(None) };
        let longest = value.iter().fold(0.0_f64, |longest, n| longest.max(n.abs()));
        if longest < 1e-9 {
            let found = format!("{key} = {value:?} in {}", self.section);
            return Err(InputError::new(at, found, "a direction, which has a length above 0"));
        }
        // Divide first: the squares of lengths near 1e-9 and 1e9 are safe, but the rounding of tiny ones is not.
        Ok(Some(Placed { value: (DVec3::from(value) / longest).normalize(), at }))
    }

    /// One finite number for all channels or [r, g, b], each one such that `accept` holds.
    pub(crate) fn channels_within(
        &self,
        key: &str,
        expected: &str,
        accept: impl Fn(f64) -> bool,
    ) -> Result<Option<Placed<[f64; 3]>>, InputError> {
        let Some((_, value)) = self.get(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::Array(_) => self.numbers(key, expected, accept),
            _ => Ok(self.number(key, expected, accept)?.map(|Placed { value, at }| Placed { value: [value; 3], at })),
        }
    }

    /// A table within the section, such as `array = { … }`.
    pub(crate) fn table(&self, key: &str, expected: &str, known: &[&str]) -> Result<Option<Fields<'a>>, InputError> {
        let Some((_, value)) = self.get(key) else { return Ok(None) };
        let DeValue::Table(table) = value.get_ref() else { return Err(self.refuse(key, value, expected)) };
        let section = if key == "render" { "[render]".to_owned() } else { format!("{key} of {}", self.section) };
        Fields::new(self.source, section, self.source.at(&value.span()), table, known).map(Some)
    }

    /// The tables of `[[key]]`, each with the line of its head.
    pub(crate) fn sections(&self, key: &str) -> Result<Vec<(Location, &'a DeTable<'a>)>, InputError> {
        let Some((name, value)) = self.get(key) else { return Ok(Vec::new()) };
        let refuse = |value: &Spanned<DeValue>| {
            let found = format!("{key} = {}", described(value.get_ref()));
            InputError::new(self.source.at(&name.span()), found, format!("sections that begin with [[{key}]]"))
        };
        let DeValue::Array(items) = value.get_ref() else { return Err(refuse(value)) };
        let table = |item: &'a Spanned<DeValue<'a>>| match item.get_ref() {
            DeValue::Table(table) => Ok((self.source.at(&item.span()), table)),
            _ => Err(refuse(item)),
        };
        items.iter().map(table).collect()
    }

    /// The tables of `[key.NAME]`, by name, each with the line of its head.
    pub(crate) fn named_sections(&self, key: &str) -> Result<Vec<(&'a str, Location, &'a DeTable<'a>)>, InputError> {
        let Some((head, value)) = self.get(key) else { return Ok(Vec::new()) };
        let refuse = |name: &Spanned<DeString>, found: String| {
            InputError::new(self.source.at(&name.span()), found, format!("a section that begins with [{key}.NAME]"))
        };
        let DeValue::Table(named) = value.get_ref() else {
            return Err(refuse(head, format!("{key} = {}", described(value.get_ref()))));
        };
        let table = |(name, item): (&'a Spanned<DeString<'a>>, &'a Spanned<DeValue<'a>>)| match item.get_ref() {
            DeValue::Table(table) => Ok((name.get_ref().as_ref(), self.source.at(&name.span()), table)),
            other => Err(refuse(name, format!("{key}.{} = {}", plain(name.get_ref()), described(other)))),
        };
        named.iter().map(table).collect()
    }

    /// The value as `opening` takes it: a word, or a table.
    pub(crate) fn is_text(&self, key: &str) -> bool {
        matches!(self.get(key), Some((_, value)) if matches!(value.get_ref(), DeValue::String(_)))
    }

    /// Whether the value is a table.
    pub(crate) fn is_table(&self, key: &str) -> bool {
        matches!(self.get(key), Some((_, value)) if matches!(value.get_ref(), DeValue::Table(_)))
    }

    /// Whether the section has this key.
    pub(crate) fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    /// A refusal of what `key` says, in the words of the file.
    pub(crate) fn refusal(&self, key: &str, expected: impl Into<String>) -> InputError {
        match self.get(key) {
            Some((_, value)) => self.refuse(key, value, expected),
            None => self.missing(key, &expected.into()),
        }
    }

    fn placed<T>(&self, value: &Spanned<DeValue>, inner: T) -> Placed<T> {
        Placed { value: inner, at: self.source.at(&value.span()) }
    }
}

fn number(value: &DeValue) -> Option<f64> {
    match value {
        DeValue::Float(float) => float.as_str().parse().ok(),
        #[allow(
            clippy::cast_precision_loss,
            reason = "a length written as a whole number of more than 2⁵³ is rounded like any"
        )]
        DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|n| n as f64),
        _ => None,
    }
}

fn whole(value: &DeValue) -> Option<u64> {
    match value {
        DeValue::Integer(integer) => u64::from_str_radix(integer.as_str(), integer.radix()).ok(),
        // 1e6 photons is how people write it.
        DeValue::Float(_) => number(value).filter(|n| n.fract() == 0.0 && (0.0..=9e15).contains(n)).map(|n| n as u64),
        _ => None,
    }
}

fn word(value: &DeValue) -> Option<Word> {
    match value {
        DeValue::String(text) => Some(Word::Text(text.to_string())),
        DeValue::Boolean(on) => Some(Word::Switch(*on)),
        _ => match whole(value) {
            Some(whole) => Some(Word::Number(whole.to_string())),
            None => number(value).map(|number| Word::Number(number.to_string())),
        },
    }
}

fn list<'a>(value: &'a DeValue<'a>) -> Option<Vec<&'a DeValue<'a>>> {
    match value {
        DeValue::Array(items) => Some(items.iter().map(Spanned::get_ref).collect()),
        _ => None,
    }
}

fn within(what: &str, least: u64, most: u64) -> String {
    match most {
        u64::MAX if least == 0 => what.to_owned(),
        u64::MAX => format!("{what} from {least} up"),
        _ => format!("{what} from {least} to {most}"),
    }
}

/// A value in the words of the file, short enough for one line.
fn described(value: &DeValue) -> String {
    cut(&match value {
        DeValue::String(text) => quoted(text),
        DeValue::Integer(integer) => integer.to_string(),
        DeValue::Float(float) => float.as_str().to_owned(),
        DeValue::Boolean(truth) => truth.to_string(),
        DeValue::Datetime(_) => "a date".to_owned(),
        DeValue::Table(_) => "a table".to_owned(),
        DeValue::Array(items) if items.len() <= 4 => {
            format!("[{}]", items.iter().map(|item| described(item.get_ref())).collect::<Vec<_>>().join(", "))
        }
        DeValue::Array(items) => format!("a list of {}", items.len()),
    })
}

/// The beginning of a text, where it is long.
fn cut(text: &str) -> String {
    const LONGEST: usize = 100;
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

/// A name that stands in a message as it is, without quotes.
pub(crate) fn plain(name: &str) -> String {
    cut(&cut(name).chars().flat_map(escaped).collect::<String>())
}

/// Head of a material's section in the scene file: its name in quotes only where it needs them.
pub(crate) fn section(name: &str) -> String {
    let bare = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c));
    if bare { format!("[material.{name}]") } else { format!("[material.{}]", quoted(name)) }
}

/// The name that differs least from `word`, if at most a third of it differs.
pub(crate) fn closest<'a>(word: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let far = (word.chars().count() / 3).max(1);
    let near = names.into_iter().map(|name| (edits(word, name), name)).min_by_key(|&(edits, _)| edits);
    near.filter(|&(edits, _)| edits <= far).map(|(_, name)| name)
}

/// Letters to insert, delete or replace to turn one word into the other (Levenshtein's distance), capitals not counted.
fn edits(from: &str, to: &str) -> usize {
    let (from, to) = (from.to_lowercase(), to.to_lowercase());
    let to: Vec<char> = to.chars().take(100).collect();
    let mut row: Vec<usize> = (0..=to.len()).collect();
    for (i, a) in from.chars().take(100).enumerate() {
        let mut corner = std::mem::replace(&mut row[0], i + 1);
        for (j, &b) in to.iter().enumerate() {
            let replaced = corner + usize::from(a != b);
            corner = row[j + 1];
            row[j + 1] = replaced.min(corner + 1).min(row[j] + 1);
        }
    }
    row[to.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_of_the_pen_finds_the_word_meant() {
        assert_eq!(closest("celing", ["floor", "ceiling", "wall"]), Some("ceiling"));
        assert_eq!(closest("Floor", ["floor", "ceiling"]), Some("floor"));
        assert_eq!(closest("xyz", ["floor", "ceiling"]), None);
    }

    #[test]
    fn a_quotation_stays_on_one_line() {
        assert_eq!(quoted("a\nb\u{1b}[31m"), "\"a\\nb\\u{1b}[31m\"");
        assert_eq!(quoted(&"é".repeat(70)).chars().count(), 63);
    }
}
