//! What stands above `TILT=` in an LM-63 file: the line that tells its edition, and labels.

use super::text::{self, quoted};
use super::{Format, Lamps, Notes};

/// The edition, and the index of the line after the one that tells it.
pub(super) fn edition(lines: &[&str], notes: &mut Notes) -> (Format, usize) {
    let Some(line) = lines.iter().position(|line| !line.trim().is_empty()) else { return (Format::Lm63_1986, 0) };
    match edition_of(lines[line]) {
        Some(Some(format)) => (format, line + 1),
        Some(None) => {
            let what =
                if names_tm33(lines[line]) { "a format of its own, not LM-63" } else { "an edition unknown here" };
            notes.at(line + 1, format!("{} is {what}; read as LM-63-2019", quoted(lines[line].trim())));
            (Format::Lm63_2019, line + 1)
        }
        None => (Format::Lm63_1986, line),
    }
}

/// Edition that a first line tells, `Some(None)` where it is unknown: `IESNA91`, `IESNA:LM-63-1995`, `LM-63-2002`,
/// `IES:LM-63-2019`, `ANSI/IES LM-63-19`, in any case and with blanks, colons, hyphens and slashes anywhere.
pub(super) fn edition_of(line: &str) -> Option<Option<Format>> {
    let signs = |c: &char| c.is_alphanumeric();
    let line = line.chars().filter(signs).take(40).collect::<String>().to_ascii_uppercase();
    let line = line.strip_prefix("ANSI").unwrap_or(&line);
    let society = line.strip_prefix("IESNA").or_else(|| line.strip_prefix("IES"));
    let rest = society.unwrap_or(line);
    let year = match rest.strip_prefix("LM63") {
        Some(year) => year,
        None if society.is_some() && (rest.starts_with(|c: char| c.is_ascii_digit()) || names_tm33(rest)) => rest,
        None => return None,
    };
    let digits: String = year.chars().take_while(char::is_ascii_digit).collect();
    Some(match digits.as_str() {
        "86" | "1986" => Some(Format::Lm63_1986),
        "91" | "1991" => Some(Format::Lm63_1991),
        "95" | "1995" => Some(Format::Lm63_1995),
        "02" | "2002" => Some(Format::Lm63_2002),
        "19" | "2019" => Some(Format::Lm63_2019),
        _ => None,
    })
}

/// Whether a line names TM-33, which is XML.
pub(super) fn names_tm33(line: &str) -> bool {
    line.chars().filter(|c| c.is_alphanumeric()).take(40).collect::<String>().to_ascii_uppercase().contains("TM33")
}

/// How a file of 2019 came about, by the number after the ballast factor (LM-63-2019, 5.13): a digit each for an
/// accredited laboratory, interpolated angles, scaled flux, a simulation, and for nothing known.
pub(super) fn generation(number: f64) -> Option<String> {
    let digits = ((number - 1.0) * 1e5).round();
    if !(0.0..=11_111.0).contains(&digits) || ((number - 1.0) * 1e5 - digits).abs() > 0.01 {
        return None;
    }
    let digit = |place: u32| (digits as u32 / 10_u32.pow(place)) % 10;
    if (0..5).any(|place| digit(place) > 1) {
        return None;
    }
    let told = match () {
        () if digit(0) == 1 => "unknown".to_owned(),
        () if digit(1) == 1 => "computer simulation".to_owned(),
        () => {
            let laboratory = if digit(4) == 1 { "an accredited" } else { "no accredited" };
            let also = [(3, ", angles interpolated"), (2, ", flux scaled")]
                .map(|(place, also)| if digit(place) == 1 { also } else { "" });
            format!("test in {laboratory} laboratory{}", also.concat())
        }
    };
    Some(format!("{told} ({number:.5})"))
}

/// What the lines between the edition and `TILT=` say.
#[derive(Default)]
pub(super) struct Labels {
    pub(super) name: String,
    pub(super) catalogue: String,
    pub(super) manufacturer: String,
    lamp: String,
    colour: String,
    rendering: String,
    pub(super) remarks: Vec<(String, String)>,
}

impl Labels {
    pub(super) fn read(lines: &[&str], format: Format) -> Self {
        let mut pairs: Vec<(String, String)> = Vec::new();
        for line in lines.iter().map(|line| line.trim()).filter(|line| !line.is_empty()) {
            let keyed = line.strip_prefix('[').and_then(|line| line.split_once(']'));
            let (key, value) = keyed.map_or(("", line), |(key, value)| (key.trim(), value.trim()));
            let key = key.to_ascii_uppercase();
            match pairs.last_mut() {
                Some((_, before)) if key == "MORE" => {
                    before.push(' ');
                    before.push_str(&text::label(value));
                }
                _ => pairs.push((text::label(&key), text::label(value))),
            }
        }
        let mut labels = Self::default();
        for (key, text) in pairs.into_iter().filter(|(_, text)| !text.is_empty()) {
            let known = match key.as_str() {
                "LUMINAIRE" => &mut labels.name,
                "LUMCAT" => &mut labels.catalogue,
                "MANUFAC" => &mut labels.manufacturer,
                "LAMP" => &mut labels.lamp,
                "COLORTEMP" => &mut labels.colour,
                "CRI" => &mut labels.rendering,
                // Without keywords the first line is what the file is about.
                "" if format == Format::Lm63_1986 => &mut labels.name,
                _ => {
                    labels.remarks.push((key.to_ascii_lowercase(), text));
                    continue;
                }
            };
            if known.is_empty() {
                *known = text;
            } else {
                labels.remarks.push((key.to_ascii_lowercase(), text));
            }
        }
        labels
    }

    /// The lamps, with what the numbers say of them.
    pub(super) fn lamps(&self, count: u32, flux: Option<f64>, power: Option<f64>) -> Lamps {
        Lamps {
            count,
            name: self.lamp.clone(),
            flux,
            power,
            colour: self.colour.clone(),
            rendering: self.rendering.clone(),
            absolute: flux.is_none(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn editions_are_spelled_in_many_ways() {
        use Format::{Lm63_1986, Lm63_1991, Lm63_1995, Lm63_2002, Lm63_2019};
        for (line, expected) in [
            ("IESNA91", Some(Some(Lm63_1991))),
            ("IESNA:LM-63-1995", Some(Some(Lm63_1995))),
            ("IESNA: LM-63-95", Some(Some(Lm63_1995))),
            ("iesna lm-63-2002 ", Some(Some(Lm63_2002))),
            ("LM-63-2002", Some(Some(Lm63_2002))),
            ("LM63-02", Some(Some(Lm63_2002))),
            ("ANSI/IESNA LM-63-02", Some(Some(Lm63_2002))),
            ("ANSI/IES LM-63-19", Some(Some(Lm63_2019))),
            ("IES:LM-63-2019", Some(Some(Lm63_2019))),
            ("IES LM-63-19 file", Some(Some(Lm63_2019))),
            ("IESNA86", Some(Some(Lm63_1986))),
            ("IES:LM-63-2031", Some(None)),
            ("ANSI/IES TM-33-18", Some(None)),
            ("LM-79 report 1991", None),
            ("A luminaire", None),
        ] {
            assert_eq!(edition_of(line), expected, "{line}");
        }
    }

    #[test]
    fn how_a_file_came_about_stands_in_its_digits() {
        for (number, expected) in [
            (1.0, Some("test in no accredited laboratory (1.00000)")),
            (1.1, Some("test in an accredited laboratory (1.10000)")),
            (1.111, Some("test in an accredited laboratory, angles interpolated, flux scaled (1.11100)")),
            (1.0001, Some("computer simulation (1.00010)")),
            (1.00001, Some("unknown (1.00001)")),
            (0.7, None),
            (1.5, None),
            (2.0, None),
        ] {
            assert_eq!(generation(number).as_deref(), expected);
        }
    }
}
