//! OBJ and MTL files line by line, on their way to `tobj`.
//!
//! `tobj` parses numbers and resolves indices, but names no line in its errors, takes `l 1 2 3` for a triangle, forgets
//! the name of a material that no MTL defines, and panics on `Kd 0.5` and (where overflow is checked) on `f 1/-9 2/-9 3/-9`.
//! So it is fed one tidied line at a time, and no more than what a scene needs: where it stops is the line at fault.

use std::borrow::Cow;
use std::io::{self, BufRead, Read};

/// Logical lines of a file: a backslash at the end joins the next one, as OBJ allows.
pub(crate) struct Lines<'a> {
    rest: &'a [u8],
    next_number: usize,
}

impl<'a> Lines<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self::continued(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes))
    }

    /// A part of a file that isn't its beginning; its first line gets the number 1.
    pub(crate) fn continued(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, next_number: 1 }
    }

    /// How many lines have been read.
    pub(crate) fn count_so_far(&self) -> usize {
        self.next_number - 1
    }

    fn physical(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let end = memchr::memchr(b'\n', self.rest).unwrap_or(self.rest.len());
        let line = &self.rest[..end];
        self.rest = self.rest.get(end + 1..).unwrap_or_default();
        self.next_number += 1;
        Some(line.trim_ascii())
    }
}

impl<'a> Iterator for Lines<'a> {
    /// Number of the (first) line, and its text without blanks around.
    type Item = (usize, Cow<'a, [u8]>);

    fn next(&mut self) -> Option<Self::Item> {
        let number = self.next_number;
        let mut line = Cow::Borrowed(self.physical()?);
        while line.ends_with(b"\\") && !line.starts_with(b"#") {
            let Some(more) = self.physical() else { break };
            let joined = line.to_mut();
            joined.pop();
            joined.push(b' ');
            joined.extend_from_slice(more);
        }
        Some((number, line))
    }
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

/// Whether a word can be a number, for `tobj` as for us: it parts words at Unicode's blanks too, such as a vertical tab or a
/// no-break space, and then finds fewer or more of them.
pub(crate) fn is_plain(word: &[u8]) -> bool {
    word.iter().all(u8::is_ascii_graphic)
}

/// A name as text: UTF-8, else taken for Latin-1, as older Windows programs write it.
pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap_or_else(|_| bytes.iter().map(|&byte| char::from(byte)).collect())
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

    #[test]
    fn joined_lines_keep_the_number_of_the_first() {
        let found: Vec<_> =
            Lines::new(b"\xef\xbb\xbfv 1\\\r\n 2\r\n# c\\\n\nf 1\\").map(|(n, line)| (n, text(&line))).collect();
        let expected = [(1, "v 1 2"), (3, "# c\\"), (4, ""), (5, "f 1\\")].map(|(n, line)| (n, line.to_owned()));
        assert_eq!(found, expected);
    }

    #[test]
    fn latin_1_names_are_read() {
        assert_eq!((text(b"W\xe4nde"), text("Wände".as_bytes())), ("Wände".to_owned(), "Wände".to_owned()));
    }
}
