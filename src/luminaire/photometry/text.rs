//! The text of a photometric file: bytes of any age become lines, lines become words with their line number.

use std::path::Path;

use crate::error::{InputError, Location};

/// Angles nearer than this are the same, degrees.
pub(super) const CLOSEST: f64 = 1e-6;

/// The text of a file without its end marks: UTF-8 (a byte order mark is taken off), else Latin-1. A Ctrl-Z ends it,
/// as in DOS.
pub(super) fn decode(path: &Path, content: &[u8]) -> Result<String, InputError> {
    if content.starts_with(b"\xff\xfe") || content.starts_with(b"\xfe\xff") {
        let error = InputError::new(Location::file(path), "text in UTF-16", "UTF-8 or Latin-1");
        return Err(error.hint("save it as UTF-8"));
    }
    let content = content.strip_prefix(b"\xef\xbb\xbf").unwrap_or(content);
    let end = content.iter().position(|&byte| byte == 0x1a).unwrap_or(content.len());
    let content = &content[..end];
    if let Some(at) = content.iter().position(|&byte| byte == 0) {
        let line = 1 + content[..at].iter().filter(|&&byte| byte == b'\n').count();
        return Err(InputError::new(Location::line(path, line), "a byte 0", "text"));
    }
    Ok(match std::str::from_utf8(content) {
        Ok(text) => text.to_owned(),
        Err(_) => content.iter().map(|&byte| char::from(byte)).collect(),
    })
}

/// Lines without their ends, which may be CR LF, LF or CR.
pub(super) fn lines(text: &str) -> Vec<&str> {
    let mut lines = Vec::new();
    let mut rest = text;
    while let Some(end) = rest.find(['\r', '\n']) {
        lines.push(&rest[..end]);
        let after = &rest[end..];
        rest = after.strip_prefix("\r\n").unwrap_or(&after[1..]);
    }
    if !rest.is_empty() {
        lines.push(rest);
    }
    lines
}

/// Words of the lines from one on, one after the other.
#[derive(Clone)]
pub(super) struct Words<'a> {
    path: &'a Path,
    lines: &'a [&'a str],
    /// Index of the line that `rest` belongs to.
    line: usize,
    rest: &'a str,
    /// Whether commas part words too.
    commas: bool,
}

impl<'a> Words<'a> {
    /// Words from the line of that index on.
    pub(super) fn new(path: &'a Path, lines: &'a [&'a str], first: usize, commas: bool) -> Self {
        Self { path, lines, line: first, rest: lines.get(first).copied().unwrap_or(""), commas }
    }

    /// The next number and its line. A decimal comma counts as a point where commas don't part words.
    pub(super) fn number(&mut self, what: &str) -> Result<(usize, f64), InputError> {
        let Some((line, word)) = self.next() else {
            let at = Location::line(self.path, self.lines.len().max(1));
            return Err(InputError::new(at, "the end of the file", what));
        };
        match parse(word) {
            Some(number) => Ok((line, number)),
            None => Err(InputError::new(Location::line(self.path, line), quoted(word), what)),
        }
    }

    /// The next number, which is a whole one from `low` to `high`, and its line.
    pub(super) fn whole(&mut self, what: &str, low: i64, high: i64) -> Result<(usize, i64), InputError> {
        let expected = format!("{what}, {low} to {high}");
        let (line, number) = self.number(&expected)?;
        if number.fract() == 0.0 && (low as f64..=high as f64).contains(&number) {
            Ok((line, number as i64))
        } else {
            Err(InputError::new(Location::line(self.path, line), format!("{number}"), expected))
        }
    }

    /// Angles in ascending order from `low` to `high`, and the line of the first.
    pub(super) fn angles(
        &mut self,
        count: usize,
        what: &str,
        range: [f64; 2],
    ) -> Result<(usize, Vec<f64>), InputError> {
        self.ordered(count, what, range, 1.0)
    }

    /// Angles in ascending or descending order, and whether they descend; they come back as they stand.
    pub(super) fn angles_either_way(
        &mut self,
        count: usize,
        what: &str,
        range: [f64; 2],
    ) -> Result<(usize, Vec<f64>, bool), InputError> {
        let mut ahead = self.clone();
        let first_two = [ahead.next(), ahead.next()].map(|word| word.and_then(|(_, word)| parse(word)));
        let down = count > 1 && matches!(first_two, [Some(first), Some(second)] if second < first);
        let (line, angles) = self.ordered(count, what, range, if down { -1.0 } else { 1.0 })?;
        Ok((line, angles, down))
    }

    /// Angles that grow (`sign` 1) or fall (−1) from one to the next.
    fn ordered(
        &mut self,
        count: usize,
        what: &str,
        [low, high]: [f64; 2],
        sign: f64,
    ) -> Result<(usize, Vec<f64>), InputError> {
        let mut angles: Vec<f64> = Vec::with_capacity(count);
        let mut first = 0;
        for number in 1..=count {
            let (line, angle) = self.number(&format!("{what} {number} of {count}, degrees"))?;
            let refuse = |expected: String| {
                Err(InputError::new(Location::line(self.path, line), format!("{what} {angle}"), expected))
            };
            if !(low..=high).contains(&angle) {
                return refuse(format!("{low}° to {high}°"));
            }
            if let Some(before) = angles.last().filter(|before| sign * (angle - **before) < CLOSEST) {
                let than = if sign > 0.0 { "more" } else { "less" };
                return refuse(format!("{than} than the one before, {before}"));
            }
            if number == 1 {
                first = line;
            }
            angles.push(angle);
        }
        Ok((first, angles))
    }

    /// How many words are left.
    pub(super) fn left(&self) -> usize {
        self.clone().count()
    }

    /// Number of the line where the next word stands, or the last line.
    pub(super) fn at(&self) -> usize {
        self.clone().next().map_or(self.lines.len().max(1), |(line, _)| line)
    }
}

impl<'a> Iterator for Words<'a> {
    /// Number of the line, from 1, and the word.
    type Item = (usize, &'a str);

    fn next(&mut self) -> Option<Self::Item> {
        let commas = self.commas;
        let parts = |c: char| c.is_whitespace() || (commas && c == ',');
        loop {
            let rest = self.rest.trim_start_matches(parts);
            if rest.is_empty() {
                self.line += 1;
                self.rest = self.lines.get(self.line)?;
                continue;
            }
            let end = rest.find(parts).unwrap_or(rest.len());
            let word = &rest[..end];
            self.rest = &rest[end..];
            return Some((self.line + 1, word));
        }
    }
}

/// A finite number; its decimal sign may be a comma.
pub(super) fn parse(word: &str) -> Option<f64> {
    let number = if word.contains(',') { word.replacen(',', ".", 1).parse() } else { word.parse() };
    number.ok().filter(|number: &f64| number.is_finite())
}

/// A name or remark as one line of plain text: what would steer a terminal becomes a blank.
pub(super) fn label(text: &str) -> String {
    text.trim().chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// What a file says, short enough for one line and without anything that would break it.
pub(super) fn quoted(word: &str) -> String {
    const LONGEST: usize = 40;
    let mut text: String = word.chars().take(LONGEST).map(|c| if c.is_control() { '?' } else { c }).collect();
    if word.chars().nth(LONGEST).is_some() {
        text.push('…');
    }
    format!("\"{text}\"")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_end_counts_once() {
        assert_eq!(lines("a\r\nb\nc\rd\n\ne"), ["a", "b", "c", "d", "", "e"]);
        assert_eq!(lines("a\r\n"), ["a"]);
        assert!(lines("").is_empty());
    }

    #[test]
    fn words_keep_their_line() {
        let lines = ["1,2", "", " 3 ,\t4,", "5"];
        let words = Words::new(Path::new("x"), &lines, 0, true);
        assert_eq!(words.collect::<Vec<_>>(), [(1, "1"), (1, "2"), (3, "3"), (3, "4"), (4, "5")]);
        let mut words = Words::new(Path::new("x"), &lines, 0, false);
        assert_eq!(words.number("").unwrap(), (1, 1.2));
    }

    #[test]
    fn old_and_new_bytes_are_text() {
        let path = Path::new("x");
        assert_eq!(decode(path, b"\xef\xbb\xbfB\xc3\xbcro\x1atrash").unwrap(), "Büro");
        assert_eq!(decode(path, b"B\xfcro").unwrap(), "Büro");
        assert!(decode(path, b"a\nb\0").unwrap_err().to_string().starts_with("x:2: found a byte 0"));
        assert!(decode(path, b"\xff\xfea\0").is_err());
    }

    #[test]
    fn only_finite_numbers_count() {
        assert_eq!(["1", ".5", "-2.", "+1e3", "0,25"].map(|word| parse(word).unwrap()), [1.0, 0.5, -2.0, 1e3, 0.25]);
        assert!(["nan", "inf", "1e999", "", "1,2,3", "0x10", "--1"].iter().all(|word| parse(word).is_none()));
    }
}
