//! OBJ and MTL files line by line. MTL lines go on to `tobj`.
//!
//! `tobj` knows the parameters of materials, but names no line in its errors, forgets the name of a material that no MTL
//! defines, and panics on `Kd 0.5`. So it is fed one tidied line at a time, and no more than what a scene needs: where it
//! stops is the line at fault.

use std::borrow::Cow;
use std::io::{self, BufRead, Read};

use encoding_rs::{SHIFT_JIS, WINDOWS_1252};

/// Logical lines of a file. A backslash at the end of a statement of numbers joins the next line, as OBJ allows, where
/// that line goes on with a number. Any other is part of a name, a Windows folder's or a Japanese character's second
/// byte, and joins nothing.
pub(crate) struct Lines<'a> {
    rest: &'a [u8],
    next_number: usize,
    /// What ends a line: `\n`, or `\r` in files of old Macs, which hold no other.
    end: u8,
}

impl<'a> Lines<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let end = if memchr::memchr(b'\n', bytes).is_some() { b'\n' } else { b'\r' };
        Self { end, ..Self::continued(bytes) }
    }

    /// A part of a file that isn't its beginning; its first line gets the number 1.
    pub(crate) fn continued(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, next_number: 1, end: b'\n' }
    }

    /// How many lines have been read.
    pub(crate) fn count_so_far(&self) -> usize {
        self.next_number - 1
    }

    fn physical(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let end = memchr::memchr(self.end, self.rest).unwrap_or(self.rest.len());
        let line = &self.rest[..end];
        self.rest = self.rest.get(end + 1..).unwrap_or_default();
        self.next_number += 1;
        Some(line.trim_ascii())
    }

    /// A line that ends with a backslash, with those that go on with it.
    #[cold]
    fn joined(&mut self, line: &'a [u8]) -> Cow<'a, [u8]> {
        if !takes_numbers(keyword(&line[..line.len() - 1]).0) {
            return Cow::Borrowed(line);
        }
        let mut joined = line.to_vec();
        while joined.ends_with(b"\\") {
            joined.pop();
            if !begins_with_number(self.rest) {
                // Nothing goes on: the next line is a statement of its own.
                joined.truncate(joined.trim_ascii_end().len());
                break;
            }
            joined.push(b' ');
            joined.extend_from_slice(self.physical().unwrap_or_default());
        }
        Cow::Owned(joined)
    }
}

impl<'a> Iterator for Lines<'a> {
    /// Number of the (first) line, and its text without blanks around.
    type Item = (usize, Cow<'a, [u8]>);

    fn next(&mut self) -> Option<Self::Item> {
        let number = self.next_number;
        let line = self.physical()?;
        Some((number, if line.ends_with(b"\\") { self.joined(line) } else { Cow::Borrowed(line) }))
    }
}

/// Whether a statement holds numbers, in OBJ or MTL, which may go on in the next line; all others hold names.
fn takes_numbers(key: &[u8]) -> bool {
    const GEOMETRY: [&[u8]; 9] = [b"v", b"f", b"vt", b"vn", b"vp", b"l", b"p", b"fo", b"con"];
    const CURVES: [&[u8]; 10] =
        [b"curv", b"curv2", b"surf", b"parm", b"trim", b"hole", b"scrv", b"sp", b"bmat", b"step"];
    const MATERIAL: [&[u8]; 10] = [b"Kd", b"Ks", b"Ke", b"Ka", b"Tf", b"Tr", b"Ni", b"Ns", b"d", b"illum"];
    [&GEOMETRY[..], &CURVES, &MATERIAL].iter().any(|keys| keys.contains(&key))
}

/// Whether the first line of a text begins with a number, which no statement does.
fn begins_with_number(text: &[u8]) -> bool {
    let start = text.iter().position(|byte| !matches!(byte, b' ' | b'\t')).unwrap_or(text.len());
    let word = &text[start..];
    let unsigned = word.strip_prefix(b"-").or_else(|| word.strip_prefix(b"+")).unwrap_or(word);
    unsigned.strip_prefix(b".").unwrap_or(unsigned).first().is_some_and(u8::is_ascii_digit)
}

/// The first word of a line, and what follows it.
pub(crate) fn keyword(line: &[u8]) -> (&[u8], &[u8]) {
    let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
    (&line[..end], line[end..].trim_ascii())
}

/// Words of a line up to a comment.
pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = line;
    std::iter::from_fn(move || {
        rest = rest.trim_ascii_start();
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        let (word, behind) = rest.split_at(end);
        rest = if word.starts_with(b"#") { &[] } else { behind };
        (end > 0 && !word.starts_with(b"#")).then_some(word)
    })
}

/// Whether a word can be a number, for `tobj` as for us: it parts words at Unicode's blanks too, such as a vertical tab
/// or a no-break space, and then finds fewer or more of them.
pub(crate) fn is_plain(word: &[u8]) -> bool {
    word.iter().all(u8::is_ascii_graphic)
}

/// A name as text: UTF-8, else what a Japanese program writes (Shift-JIS), else a Western one (Windows-1252, Latin-1).
///
/// The same bytes are the same text always, so that names match by their bytes, whatever they are. The first bytes of
/// Japanese characters from 0x81 to 0x9f are control characters in Latin-1 and hardly ever stand in a Western name.
pub(crate) fn text(bytes: &[u8]) -> String {
    if let Ok(text) = str::from_utf8(bytes) {
        return text.to_owned();
    }
    let japanese = bytes.iter().any(|byte| (0x81..=0x9f).contains(byte));
    let japanese = japanese.then(|| SHIFT_JIS.decode_without_bom_handling_and_without_replacement(bytes)).flatten();
    japanese.unwrap_or_else(|| WINDOWS_1252.decode_without_bom_handling(bytes).0).into_owned()
}

/// A name without the comment that stands behind it, as some programs write them: "wall" of "wall # painted".
pub(crate) fn without_comment(name: &str) -> &str {
    let is_comment = |&(at, _): &(usize, &str)| at == 0 || name[..at].ends_with([' ', '\t']);
    name.match_indices('#').find(is_comment).map_or(name, |(at, _)| name[..at].trim_end())
}

/// Gives `tobj` what `next` writes into the buffer, one call at a time; `next` returns false at the end.
pub(crate) struct Feed<F> {
    next: F,
    buffer: Vec<u8>,
    read: usize,
}

impl<F: FnMut(&mut Vec<u8>) -> bool> Feed<F> {
    pub(crate) fn new(next: F) -> Self {
        Self { next, buffer: Vec::new(), read: 0 }
    }
}

impl<F: FnMut(&mut Vec<u8>) -> bool> BufRead for Feed<F> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        while self.read == self.buffer.len() {
            self.buffer.clear();
            self.read = 0;
            if !(self.next)(&mut self.buffer) {
                break;
            }
        }
        Ok(&self.buffer[self.read..])
    }

    fn consume(&mut self, amount: usize) {
        self.read += amount;
    }
}

impl<F: FnMut(&mut Vec<u8>) -> bool> Read for Feed<F> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let read = self.fill_buf()?.read(out)?;
        self.consume(read);
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(bytes: &[u8]) -> Vec<(usize, String)> {
        Lines::new(bytes).map(|(number, line)| (number, text(&line))).collect()
    }

    #[test]
    fn joined_lines_keep_the_number_of_the_first() {
        let found = lines(b"\xef\xbb\xbfv 1\\\r\n 2\\\r\n-3\r\n# c\\\n\nf 1\\");
        let expected = [(1, "v 1 2 -3"), (4, "# c\\"), (5, ""), (6, "f 1")].map(|(n, line)| (n, line.to_owned()));
        assert_eq!(found, expected);
    }

    /// Only a line that begins with a number goes on with a statement of numbers.
    #[test]
    fn a_backslash_that_nothing_goes_on_from_swallows_no_line() {
        for (first, second) in [
            ("g C:\\models\\", "1 2 3"),
            ("usemtl x\\", "f 1 2 3"),
            ("map_Kd C:\\tex\\", "Kd 0.5"),
            ("newmtl \\", "0.5"),
            ("mtllib a\\", "-1"),
            ("# C:\\", "1"),
        ] {
            let found = lines(format!("{first}\n{second}\n").as_bytes());
            assert_eq!(found, [(1, first.to_owned()), (2, second.to_owned())]);
        }
        let found = lines(b"f 1 2 3 \\\nf 2 3 4\\ \n.5 6\\\n\n7");
        let expected = [(1, "f 1 2 3"), (2, "f 2 3 4 .5 6"), (4, ""), (5, "7")].map(|(n, line)| (n, line.to_owned()));
        assert_eq!(found, expected);
    }

    #[test]
    fn carriage_returns_alone_end_lines() {
        assert_eq!(lines(b"v 1\rf 1\\\r2\r"), [(1, "v 1".to_owned()), (2, "f 1 2".to_owned())]);
    }

    #[test]
    fn names_of_older_programs_are_read() {
        assert_eq!((text(b"W\xe4nde"), text("Wände".as_bytes())), ("Wände".to_owned(), "Wände".to_owned()));
        // Shift-JIS, its second byte a backslash's.
        assert_eq!(text(b"\x8aw\x82\xcc\x95\x5c"), "学の表");
        assert_eq!(text(b"\x95\xff\xff"), "•ÿÿ", "no Shift-JIS");
    }

    #[test]
    fn a_comment_stands_behind_a_blank() {
        for (name, plain) in
            [("wall", "wall"), ("wall # a # b", "wall"), ("wall\t#a", "wall"), ("a#1", "a#1"), ("# a", "")]
        {
            assert_eq!(without_comment(name), plain);
        }
    }
}
