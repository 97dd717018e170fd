//! Words and numbers of messages, for people and for programs.

pub(crate) mod number;

use std::fmt;

/// Names in quotes, at most twelve of them.
pub(crate) fn listed<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let all: Vec<&str> = names.into_iter().collect();
    let mut text = all.iter().take(12).map(|name| quoted(*name)).collect::<Vec<_>>().join(", ");
    if all.len() > 12 {
        text += &format!(" and {} more", all.len() - 12);
    }
    text
}

/// Text in quotes, on one line, cut where it is long.
pub(crate) fn quoted(text: &(impl fmt::Display + ?Sized)) -> String {
    let text = text.to_string();
    let mut short: String = text.chars().take(60).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    format!("\"{}\"", short.chars().flat_map(escaped).collect::<String>())
}

/// A character as it can stand in a line of a message.
pub(crate) fn escaped(c: char) -> Vec<char> {
    if c.is_control() || c == '"' { c.escape_default().collect() } else { vec![c] }
}
