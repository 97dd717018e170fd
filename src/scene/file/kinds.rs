//! Forms of values: numbers, vectors, words, tables.

use glam::DVec3;

use super::keys::{Form, KeyKind, Section, Table};
use crate::error::InputError;

/// Numbers between two bounds.
#[derive(Clone, Copy)]
pub(crate) struct Range {
    low: f64,
    /// Whether the bounds are part of it.
    with: [bool; 2],
    high: f64,
}

impl Range {
    /// From 0 to 1.
    pub(crate) const SHARE: Self = Self::between(0.0, 1.0);

    /// From `low` to `high`, both included.
    pub(crate) const fn between(low: f64, high: f64) -> Self {
        Self { low, with: [true; 2], high }
    }

    /// From `low` up.
    pub(crate) const fn from(low: f64) -> Self {
        Self { low, with: [true, false], high: f64::INFINITY }
    }

    /// Above `low`.
    pub(crate) const fn above(low: f64) -> Self {
        Self { low, with: [false; 2], high: f64::INFINITY }
    }

    /// Above `low`, up to `high`.
    pub(crate) const fn above_to(low: f64, high: f64) -> Self {
        Self { low, with: [false, true], high }
    }

    /// From `low` to below `high`.
    pub(crate) const fn to_below(low: f64, high: f64) -> Self {
        Self { low, with: [true, false], high }
    }

    /// Whether a number lies in it.
    pub(crate) fn holds(&self, n: f64) -> bool {
        let [from, to] = self.with;
        (if from { self.low <= n } else { self.low < n }) && (if to { n <= self.high } else { n < self.high })
    }

    fn words(&self) -> String {
        let [low, high] = [self.low, self.high].map(plain);
        match self.with {
            [true, true] if self.low == -self.high => format!("within ±{high}"),
            [true, _] if self.high.is_infinite() => format!("from {low} up"),
            [false, _] if self.high.is_infinite() => format!("above {low}"),
            [true, true] => format!("from {low} to {high}"),
            [true, false] => format!("from {low} to below {high}"),
            [false, true] => format!("above {low}, up to {high}"),
            [false, false] => format!("above {low}, below {high}"),
        }
    }
}

/// A number as people write it.
fn plain(n: f64) -> String {
    if n.abs() >= 1e6 { format!("{n:e}") } else { n.to_string() }
}

/// A number, or several in a list.
#[derive(Clone, Copy)]
pub(crate) struct Numbers<const N: usize> {
    range: Range,
    unit: &'static str,
    /// What messages expect instead of the words made of range and unit.
    words: &'static str,
    /// What to do about another value.
    hint: &'static str,
    /// Names of the numbers of a list.
    list: &'static str,
}

/// One number.
pub(crate) type Number = Numbers<1>;

impl<const N: usize> Numbers<N> {
    pub(crate) const fn of(range: Range, unit: &'static str) -> Self {
        Self { range, unit, words: "", hint: "", list: if N == 2 { "[a, b]" } else { "[a, b, c]" } }
    }

    /// The same, where the reference shows a list as `list`.
    pub(crate) const fn shown(self, list: &'static str) -> Self {
        Self { list, ..self }
    }

    /// The same, where messages expect `words`.
    pub(crate) const fn said(self, words: &'static str) -> Self {
        Self { words, ..self }
    }

    /// The same, where messages add `hint`.
    pub(crate) const fn hint(self, hint: &'static str) -> Self {
        Self { hint, ..self }
    }

    fn expected(&self) -> String {
        match (self.words, self.unit) {
            ("", "") => format!("a number {}", self.range.words()),
            ("", "°") => format!("degrees, {}", self.range.words()),
            ("", unit) => format!("a number {}, {unit}", self.range.words()),
            (words, _) => words.to_owned(),
        }
    }

    fn hinted(&self, error: InputError) -> InputError {
        if self.hint.is_empty() { error } else { error.hint(self.hint) }
    }
}

impl Form for Number {
    fn unit(&self) -> &'static str {
        self.unit
    }

    fn range(&self) -> String {
        self.range.words()
    }
}

impl KeyKind for Number {
    type Value = f64;

    fn read(&self, section: &Section<'_>, key: &str) -> Result<Option<f64>, InputError> {
        let number = section.fields.number(key, &self.expected(), |n| self.range.holds(n));
        Ok(number.map_err(|error| self.hinted(error))?.map(|number| number.value))
    }
}

macro_rules! several {
    ($($count:literal)*) => {$(
        impl Form for Numbers<$count> {
            fn unit(&self) -> &'static str {
                self.unit
            }

            fn range(&self) -> String {
                format!("{}, each {}", self.list, self.range.words())
            }
        }

        impl KeyKind for Numbers<$count> {
            type Value = [f64; $count];

            fn read(&self, section: &Section<'_>, key: &str) -> Result<Option<[f64; $count]>, InputError> {
                let numbers = section.fields.numbers(key, &self.expected(), |n| self.range.holds(n));
                Ok(numbers.map_err(|error| self.hinted(error))?.map(|numbers| numbers.value))
            }
        }
    )*};
}

several!(2 3);

/// One number for all channels, or [r, g, b].
pub(crate) struct Channels {
    range: Range,
    unit: &'static str,
    hint: &'static str,
}

impl Channels {
    pub(crate) const fn of(range: Range, unit: &'static str) -> Self {
        Self { range, unit, hint: "" }
    }

    /// The same, where messages add `hint`.
    pub(crate) const fn hint(self, hint: &'static str) -> Self {
        Self { hint, ..self }
    }
}

impl Form for Channels {
    fn unit(&self) -> &'static str {
        self.unit
    }

    fn range(&self) -> String {
        format!("a number {}, or [r, g, b]", self.range.words())
    }
}

impl KeyKind for Channels {
    type Value = [f64; 3];

    fn read(&self, section: &Section<'_>, key: &str) -> Result<Option<[f64; 3]>, InputError> {
        let unit = if self.unit.is_empty() { String::new() } else { format!(", {}", self.unit) };
        let expected = format!("a number {}{unit}, or three as [r, g, b]", self.range.words());
        let channels = section.fields.channels_within(key, &expected, |n| self.range.holds(n));
        let hinted = |error: InputError| if self.hint.is_empty() { error } else { error.hint(self.hint) };
        Ok(channels.map_err(hinted)?.map(|channels| channels.value))
    }
}

/// A whole number.
pub(crate) struct Whole {
    least: u64,
    most: u64,
}

impl Whole {
    pub(crate) const fn between(least: u64, most: u64) -> Self {
        Self { least, most }
    }
}

impl Form for Whole {
    fn range(&self) -> String {
        match (self.least, self.most) {
            (0, u64::MAX) => "a whole number".to_owned(),
            (least, most) => format!("a whole number from {least} to {most}"),
        }
    }
}

impl KeyKind for Whole {
    type Value = u64;

    fn read(&self, section: &Section<'_>, key: &str) -> Result<Option<u64>, InputError> {
        Ok(section.fields.whole(key, self.least, self.most)?.map(|number| number.value))
    }
}

/// Two whole numbers from 1 to this.
pub(crate) struct WholePair(pub(crate) u64);

impl Form for WholePair {
    fn range(&self) -> String {
        format!("[a, b], whole numbers from 1 up, a × b at most {}", self.0)
    }
}

impl KeyKind for WholePair {
    type Value = [u64; 2];

    fn read(&self, section: &Section<'_>, key: &str) -> Result<Option<[u64; 2]>, InputError> {
        Ok(section.fields.whole_pair(key, 1, self.0)?.map(|pair| pair.value))
    }
}

/// A place or a length in space, m.
pub(crate) struct Metres;

impl Form for Metres {
    fn unit(&self) -> &'static str {
        "m"
    }

    fn range(&self) -> String {
        "[x, y, z], each within ±1e9".to_owned()
    }
}

impl KeyKind for Metres {
    type Value = DVec3;

    fn read(&self, section: &Section<'_>, key: &str) -> Result<Option<DVec3>, InputError> {
        Ok(section.fields.metres(key)?.map(|vector| vector.value))
    }
}

/// A direction, which is read as a unit vector.
pub(crate) struct Direction;

impl Form for Direction {
    fn range(&self) -> String {
        "[x, y, z] of any length above 0".to_owned()
    }
}

impl KeyKind for Direction {
    type Value = DVec3;

    fn read(&self, section: &Section<'_>, key: &str) -> Result<Option<DVec3>, InputError> {
        Ok(section.fields.direction(key)?.map(|vector| vector.value))
    }
}

/// A name, or the path of a file: printable text.
pub(crate) struct Text(pub(crate) &'static str);

impl Text {
    /// Any name.
    pub(crate) const NAME: Self = Self("text");
    /// The name of something whose results are files.
    pub(crate) const FILE_NAME: Self = Self("text without / \\ :, no dot in front, at most 200 bytes");
}

impl Form for Text {
    fn range(&self) -> String {
        self.0.to_owned()
    }
}

impl KeyKind for Text {
    type Value = String;

    fn read(&self, section: &Section<'_>, key: &str) -> Result<Option<String>, InputError> {
        Ok(section.fields.name(key)?.map(|name| name.value))
    }
}

/// One of a few words, each with what it stands for.
pub(crate) struct OneOf<T: 'static>(pub(crate) &'static [(&'static str, T)]);

impl<T: Sync> Form for OneOf<T> {
    fn range(&self) -> String {
        self.0.iter().map(|(word, _)| format!("\"{word}\"")).collect::<Vec<_>>().join(", ")
    }
}

impl<T: Copy + Sync> KeyKind for OneOf<T> {
    type Value = T;

    fn read(&self, section: &Section<'_>, key: &str) -> Result<Option<T>, InputError> {
        let words: Vec<&str> = self.0.iter().map(|(word, _)| *word).collect();
        let Some(found) = section.fields.word(key, &words)? else { return Ok(None) };
        Ok(self.0.iter().find(|(word, _)| *word == found.value).map(|(_, value)| *value))
    }
}

/// True or false.
pub(crate) struct Switch;

impl Form for Switch {
    fn range(&self) -> String {
        "true, false".to_owned()
    }
}

impl KeyKind for Switch {
    type Value = bool;

    fn read(&self, section: &Section<'_>, key: &str) -> Result<Option<bool>, InputError> {
        Ok(section.fields.switch(key)?.map(|on| on.value))
    }
}

/// A table within the section, such as `array = { … }`.
pub(crate) struct Inner<T> {
    /// What messages expect.
    pub(crate) form: &'static str,
    pub(crate) table: &'static Table,
    pub(crate) read: fn(&Section<'_>) -> Result<T, InputError>,
}

impl<T> Form for Inner<T> {
    fn range(&self) -> String {
        self.form.to_owned()
    }

    fn tables(&self) -> Vec<&'static Table> {
        vec![self.table]
    }
}

impl<T> KeyKind for Inner<T> {
    type Value = T;

    fn read(&self, section: &Section<'_>, key: &str) -> Result<Option<T>, InputError> {
        section.inner(key, self.form, self.table)?.as_ref().map(self.read).transpose()
    }
}

/// A value that may be written in several forms, with a reader of its own.
pub(crate) struct Several<T> {
    pub(crate) unit: &'static str,
    /// The forms, in words.
    pub(crate) forms: &'static str,
    pub(crate) tables: &'static [&'static Table],
    pub(crate) read: fn(&Section<'_>, &str) -> Result<Option<T>, InputError>,
}

impl<T> Form for Several<T> {
    fn unit(&self) -> &'static str {
        self.unit
    }

    fn range(&self) -> String {
        self.forms.to_owned()
    }

    fn tables(&self) -> Vec<&'static Table> {
        self.tables.to_vec()
    }
}

impl<T> KeyKind for Several<T> {
    type Value = T;

    fn read(&self, section: &Section<'_>, key: &str) -> Result<Option<T>, InputError> {
        (self.read)(section, key)
    }
}
