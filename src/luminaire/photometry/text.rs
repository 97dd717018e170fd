//! The text of a photometric file: bytes of any age become lines, lines become words with their line number.

use std::path::Path;

use super::Notes;
use crate::error::{InputError, Location};

/// Angles nearer than this are the same, degrees.
pub(super) const CLOSEST: f64 = 1e-6;

/// The text of a file without its end marks: UTF-16 by its byte order mark, or by every other byte being 0; UTF-8 (a
/// byte order mark is taken off), else Latin-1. A Ctrl-Z ends it, as in DOS, and so do bytes 0 up to the end of the
/// file, with which some programs fill a block.
pub(super) fn decode(path: &Path, content: &[u8]) -> Result<String, InputError> {
    if let Some(text) = utf_16(content) {
        return Ok(ended(&text).to_owned());
    }
    let content = content.strip_prefix(b"\xef\xbb\xbf").unwrap_or(content);
    let end = content.iter().position(|&byte| byte == 0x1a).unwrap_or(content.len());
    let mut content = &content[..end];
    let is_padding = |byte: &u8| *byte == 0 || byte.is_ascii_whitespace();
    let text = content.iter().rposition(|byte| !is_padding(byte)).map_or(0, |last| last + 1);
    if let Some(padding) = content[text..].iter().position(|&byte| byte == 0) {
        content = &content[..text + padding];
    }
    if let Some(at) = content.iter().position(|&byte| byte == 0) {
        let line = 1 + content[..at].iter().filter(|&&byte| byte == b'\n').count();
        return Err(InputError::new(Location::line(path, line), "a byte 0", "text"));
    }
    Ok(match std::str::from_utf8(content) {
        Ok(text) => text.to_owned(),
        Err(_) => content.iter().map(|&byte| char::from(byte)).collect(),
    })
}

/// Text up to a Ctrl-Z, without the bytes 0 that fill it up.
fn ended(text: &str) -> &str {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    text.split('\u{1a}').next().unwrap_or_default().trim_end_matches('\0')
}

/// Text in UTF-16: marked as such, or with a byte 0 in (nearly) every other place from the start.
fn utf_16(content: &[u8]) -> Option<String> {
    let looked_at = &content[..content.len().min(512) & !1];
    let zeros = |place: usize| looked_at.iter().skip(place).step_by(2).filter(|&&byte| byte == 0).count();
    let (half, [high, low]) = (looked_at.len() / 2, [zeros(0), zeros(1)]);
    let unit: fn([u8; 2]) -> u16 = match content {
        [0xff, 0xfe, ..] => u16::from_le_bytes,
        [0xfe, 0xff, ..] => u16::from_be_bytes,
        _ if half > 8 && low > half * 9 / 10 && high < half / 10 => u16::from_le_bytes,
        _ if half > 8 && high > half * 9 / 10 && low < half / 10 => u16::from_be_bytes,
        _ => return None,
    };
    let units = content.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
    Some(char::decode_utf16(units).map(|unit| unit.unwrap_or(char::REPLACEMENT_CHARACTER)).collect())
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

/// Words of the lines from one on, one after the other. None is empty.
#[derive(Clone)]
pub(super) struct WordReader<'a> {
    path: &'a Path,
    lines: &'a [&'a str],
    /// Index of the line that `rest` belongs to.
    line: usize,
    rest: &'a str,
    commas: Commas,
}

/// What commas mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Commas {
    /// They part numbers, as white space does.
    Part,
    /// Within a number they are its decimal sign; elsewhere they part numbers too.
    Decimal,
}

impl<'a> WordReader<'a> {
    /// Words from the line of that index on.
    pub(super) fn new(path: &'a Path, lines: &'a [&'a str], first: usize, commas: Commas) -> Self {
        Self { path, lines, line: first, rest: lines.get(first).copied().unwrap_or(""), commas }
    }

    /// The next number and its line.
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

    /// How many words are left.
    pub(super) fn left(&self) -> usize {
        self.clone().count()
    }

    /// Number of the line where the next word stands, or the last line.
    pub(super) fn at(&self) -> usize {
        self.clone().next().map_or(self.lines.len().max(1), |(line, _)| line)
    }
}

impl<'a> Iterator for WordReader<'a> {
    /// Number of the line, from 1, and the word.
    type Item = (usize, &'a str);

    fn next(&mut self) -> Option<Self::Item> {
        let parts = |c: char| c.is_whitespace() || (self.commas == Commas::Part && c == ',');
        loop {
            let mut rest = self.rest.trim_start_matches(parts);
            // A comma may begin a decimal: ,5 is 0.5.
            while rest.starts_with(',') && !rest[1..].starts_with(|c: char| c.is_ascii_digit()) {
                rest = rest[1..].trim_start_matches(parts);
            }
            if rest.is_empty() {
                self.line += 1;
                self.rest = self.lines.get(self.line)?;
                continue;
            }
            let end = rest.find(parts).unwrap_or(rest.len());
            self.rest = &rest[end..];
            return Some((self.line + 1, rest[..end].trim_end_matches(',')));
        }
    }
}

/// Numbers read by both meanings of commas, where the two differ: the meaning by which they fit what the file says of
/// their number, and a remark about it. `words` are all that are numbers, with their lines.
///
/// # Errors
/// Where they fit by neither, or by both with different numbers; and where commas that could be decimal signs could as
/// well part thousands.
pub(super) fn settle<'a, T: PartialEq>(
    path: &Path,
    words: impl Iterator<Item = (usize, &'a str)>,
    read: impl Fn(Commas) -> Result<T, InputError>,
) -> Result<(T, Option<(usize, String)>), InputError> {
    let telling: Vec<(usize, &str)> = words.filter(|(_, word)| tells(word)).collect();
    let Some(&(line, example)) = telling.iter().find(|(_, word)| !groups_thousands(word)).or(telling.first()) else {
        return Ok((read(Commas::Part)?, None));
    };
    let hint = "write decimal points, and blanks between numbers";
    let refuse =
        |found: String, expected: &str| Err(InputError::new(Location::line(path, line), found, expected).hint(hint));
    let point = example.replacen(',', ".", 1);
    match (read(Commas::Part), read(Commas::Decimal)) {
        (Ok(parted), Ok(decimal)) if parted == decimal => Ok((parted, None)),
        (Ok(_), Ok(_)) => refuse(
            format!("{}, by which the file fits its counts as one number and as two", quoted(example)),
            "commas of one meaning",
        ),
        (Ok(parted), Err(_)) => Ok((parted, None)),
        (Err(_), Ok(_)) if groups_thousands(example) => refuse(
            format!("{}, which is {point} or {}", quoted(example), example.replace(',', "")),
            "a number without a comma",
        ),
        (Err(_), Ok(decimal)) => {
            let sentence = format!("commas are decimal signs ({example} is {point}): only so the numbers fit");
            Ok((decimal, Some((line, sentence))))
        }
        (Err(parted), Err(decimal)) => {
            let error = if decimal.at.line > parted.at.line { decimal } else { parted };
            let sentence = format!("commas as in {example} fit neither as decimal signs nor between numbers");
            Err(match &error.hint {
                Some(own) => InputError { hint: Some(format!("{own} {sentence}; {hint}")), ..error },
                None => error.hint(format!("{sentence}; {hint}")),
            })
        }
    }
}

/// Whether it matters what a comma in the word means: where a digit follows it.
fn tells(word: &str) -> bool {
    word.split(',').skip(1).any(|part| part.starts_with(|c: char| c.is_ascii_digit()))
        && word.starts_with(|c: char| c.is_ascii_digit() || "+-.,".contains(c))
}

/// Whether the word's commas could part thousands, as in 12,500.
fn groups_thousands(word: &str) -> bool {
    let mut groups = word.trim_start_matches(['+', '-']).split(',');
    let is_digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    let first = groups.next().unwrap_or_default();
    (1..=3).contains(&first.len())
        && is_digits(first)
        && !first.starts_with('0')
        && groups.all(|part| part.len() == 3 && is_digits(part))
}

/// Whether commas of numbers are decimal signs, where nothing but that is possible; a line with one, and a remark.
///
/// # Errors
/// Where each could part thousands as well.
pub(super) fn decimals<'a>(
    path: &Path,
    words: impl Iterator<Item = (usize, &'a str)>,
) -> Result<Option<(usize, String)>, InputError> {
    let mut telling = words.filter(|(_, word)| tells(word) && parse(word).is_some()).peekable();
    let Some(&first) = telling.peek() else { return Ok(None) };
    let Some((line, example)) = telling.find(|(_, word)| !groups_thousands(word)) else {
        let (line, word) = first;
        let found = format!("{}, which is {} or {}", quoted(word), word.replacen(',', ".", 1), word.replace(',', ""));
        let error = InputError::new(Location::line(path, line), found, "a number without a comma");
        return Err(error.hint("write decimal points"));
    };
    Ok(Some((line, format!("commas are decimal signs ({example} is {})", example.replacen(',', ".", 1)))))
}

/// Refuses numbers after the last that belongs somewhere; text there is passed over with a note.
pub(super) fn check_end(path: &Path, words: &WordReader, counted: &str, notes: &mut Notes) -> Result<(), InputError> {
    let Some((line, word)) = words.clone().next() else { return Ok(()) };
    let left = words.clone().take_while(|(_, word)| parse(word).is_some()).count();
    if left == 0 {
        notes.at(line, format!("{} and what follows isn't read: all intensities are there", quoted(word)));
        return Ok(());
    }
    let found = match left {
        1 => format!("{} left over after the last intensity", quoted(word)),
        more => format!("{more} numbers left over after the last intensity, {} and on", quoted(word)),
    };
    let error = InputError::new(Location::line(path, line), found, format!("nothing more: {counted}"));
    Err(error.hint("are the numbers of angles right?"))
}

/// A finite number; its decimal sign may be a comma.
pub(super) fn parse(word: &str) -> Option<f64> {
    let number =
        if word.contains(',') && !word.contains('.') { word.replacen(',', ".", 1).parse() } else { word.parse() };
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
        let words = WordReader::new(Path::new("x"), &lines, 0, Commas::Part);
        assert_eq!(words.collect::<Vec<_>>(), [(1, "1"), (1, "2"), (3, "3"), (3, "4"), (4, "5")]);
        let mut words = WordReader::new(Path::new("x"), &lines, 0, Commas::Decimal);
        assert_eq!(words.number("").unwrap(), (1, 1.2));
    }

    #[test]
    fn old_and_new_bytes_are_text() {
        let path = Path::new("x");
        assert_eq!(decode(path, b"\xef\xbb\xbfB\xc3\xbcro\x1atrash").unwrap(), "Büro");
        assert_eq!(decode(path, b"B\xfcro").unwrap(), "Büro");
        assert!(decode(path, b"a\nb\0c").unwrap_err().to_string().starts_with("x:2: found a byte 0"));
        assert_eq!(decode(path, b"a\nb\r\n\0\0 \n\0").unwrap(), "a\nb\r\n");
        assert_eq!(decode(path, b"\0").unwrap(), "");
    }

    #[test]
    fn utf_16_is_text_marked_or_not() {
        let text = "Büro 1,5 and so on\r\n";
        let little: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
        let marked = [&b"\xff\xfe"[..], &little, b"\x1a\0x\0"].concat();
        for content in [&little, &big, &marked, &[&b"\xfe\xff"[..], &big, b"\0\0"].concat()] {
            assert_eq!(decode(Path::new("x"), content).unwrap(), text);
        }
    }

    #[test]
    fn only_finite_numbers_count() {
        assert_eq!(["1", ".5", "-2.", "+1e3", "0,25"].map(|word| parse(word).unwrap()), [1.0, 0.5, -2.0, 1e3, 0.25]);
        assert!(["nan", "inf", "1e999", "", "1,2,3", "0x10", "--1"].iter().all(|word| parse(word).is_none()));
    }

    /// Words that are `count` numbers, by one meaning of commas or by the other; and whether that is told.
    fn counted(line: &str, count: usize) -> Result<(Vec<f64>, bool), String> {
        let (path, lines) = (Path::new("x"), [line]);
        let read = |commas| {
            let words = WordReader::new(path, &lines, 0, commas);
            let numbers: Option<Vec<f64>> = words.map(|(_, word)| parse(word)).collect();
            let numbers = numbers.filter(|numbers| numbers.len() == count);
            numbers.ok_or_else(|| InputError::new(Location::line(path, 1), "a count", format!("{count}")))
        };
        let settled = settle(path, WordReader::new(path, &lines, 0, Commas::Decimal), read);
        settled.map(|(numbers, note)| (numbers, note.is_some())).map_err(|error| error.to_string())
    }

    #[test]
    fn commas_mean_what_fits() {
        assert_eq!(counted("1,5 2 3,25", 3), Ok((vec![1.5, 2.0, 3.25], true)));
        assert_eq!(counted("1,5 2 3,25", 5), Ok((vec![1.0, 5.0, 2.0, 3.0, 25.0], false)));
        assert_eq!(counted("1, 2,3", 3), Ok((vec![1.0, 2.0, 3.0], false)));
        assert_eq!(counted(",5 0,25", 2), Ok((vec![0.5, 0.25], true)));
        assert_eq!(counted("1,500 0,250", 2), Ok((vec![1.5, 0.25], true)));
        for (line, count, says) in [
            ("1 ,5", 2, "\",5\", by which the file fits its counts as one number and as two"),
            ("1,5 2", 7, "commas as in 1,5 fit neither"),
            ("1,500 12,250", 2, "\"1,500\", which is 1.500 or 1500"),
        ] {
            let error = counted(line, count).unwrap_err();
            assert!(error.contains(says), "{line}: {error}");
        }
    }
}
