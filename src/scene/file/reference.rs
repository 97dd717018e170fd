//! The reference of all keys, printed from the tables that parse them: `luxmap help scene`, and docs/SCENE.md.

use super::SCENE;
use super::keys::{AnyKey, Table};

/// What holds for all sections: a title and paragraphs, `code` in backquotes.
pub(crate) const CONVENTIONS: &[(&str, &str)] = &[
    (
        "Form",
        "A scene file is TOML in UTF-8. A key that is in none of the tables below is refused. So is a value of another \
              form, with its line, what stands there and what could.",
    ),
    (
        "Units",
        "Lengths in metres (m), angles in degrees (°), luminous flux in lumens (lm), illuminance in lux (lx), power in \
               watts (W), time in seconds (s). Only an OBJ file may have another unit of length, which `unit` tells.",
    ),
    (
        "Axes",
        "World coordinates [x, y, z] are right-handed, z points up. An OBJ file with `up = \"y\"` is turned: its x \
              stays x, its −z becomes y, its y becomes z. A direction may have any length above 0.",
    ),
    (
        "Azimuth",
        "A luminaire that looks straight down with `rotation = 0` has its plane C0 towards +x and C90 towards +y; \
                 γ = 0 lies along `aim`. A positive `rotation` turns from C0 towards C90: counter-clockwise seen \
                 from above. The length of an LM-63 file lies along C0, that of a EULUMDAT file along C90; `luxmap \
                 luminaire FILE` draws it.",
    ),
    (
        "Colours and shares",
        "A share such as a reflectance is one number from 0 to 1 for all channels, or [r, g, b] with linear \
                            Rec. 709 primaries. Illuminance and luminance are photometric whatever the colours.",
    ),
    (
        "Files",
        "Paths start from the scene file's folder. A file lies there or in a folder below; `--include DIR` allows \
         another.",
    ),
    (
        "Materials that a scene leaves open",
        "For each material of a mesh the first counts that says something: its section \
        `[material.NAME]`, its MTL file, `--reflectance` of the command line, `[material.\"*\"]`; `[material.NAME]` \
        and an MTL file may share the work, key by key. The MTL file is looked for as the OBJ file names it, then \
        beside the OBJ by name, and without `mtllib` the one with the OBJ's stem is taken; docs/FILES.md tells what \
         is made of its lines, and every \
        guess is a warning.",
    ),
];

/// A section's part of the reference.
pub(crate) struct ReferencePage {
    table: &'static Table,
    /// Heads of the sections of which it is the value of a key; none for one with a head of its own.
    within: Vec<&'static str>,
}

impl ReferencePage {
    /// Its title, without backquotes.
    pub(crate) fn title(&self) -> String {
        match self.within.as_slice() {
            [] if self.is_whole() => "The scene file as a whole".to_owned(),
            [] => self.table.head.to_owned(),
            owners => format!("{} of {}", self.table.head, owners.join(" and ")),
        }
    }

    fn is_whole(&self) -> bool {
        std::ptr::eq(self.table, &SCENE)
    }

    /// What the section is.
    pub(crate) fn about(&self) -> &'static str {
        self.table.about
    }

    /// Names of keys, and what there is to say of each in one paragraph.
    pub(crate) fn keys(&self) -> impl Iterator<Item = (&'static str, String)> {
        self.table.keys.iter().map(|key| (key.name(), paragraph(*key)))
    }

    /// Rules between keys.
    pub(crate) fn rules(&self) -> &'static [&'static str] {
        self.table.rules
    }

    /// TOML that parses; empty where the section is shown in another's.
    pub(crate) fn example(&self) -> &'static str {
        self.table.example
    }

    /// Its table.
    #[cfg(test)]
    pub(super) fn table(&self) -> &'static Table {
        self.table
    }
}

/// Meaning, unit, range and default of a key.
fn paragraph(key: &dyn AnyKey) -> String {
    let unit = if key.unit().is_empty() { String::new() } else { format!(" Unit: {}.", key.unit()) };
    let default = match key.default() {
        "" => String::new(),
        "required" => " Required.".to_owned(),
        words => format!(" Default: {words}."),
    };
    format!("{}{unit} Values: {}.{default}", key.meaning(), key.range())
}

/// All sections in the order of the reference, each followed by those within its values.
pub(crate) fn pages() -> Vec<ReferencePage> {
    let mut pages = vec![ReferencePage { table: &SCENE, within: Vec::new() }];
    SCENE.keys.iter().for_each(|key| key.tables().into_iter().for_each(|table| add(table, None, &mut pages)));
    pages
}

fn add(table: &'static Table, owner: Option<&'static str>, pages: &mut Vec<ReferencePage>) {
    let owner = owner.filter(|_| !table.head.starts_with('['));
    if let Some(page) = pages.iter_mut().find(|page| std::ptr::eq(page.table, table)) {
        page.within.extend(owner.filter(|owner| !page.within.contains(owner)));
        return;
    }
    pages.push(ReferencePage { table, within: owner.into_iter().collect() });
    table.keys.iter().for_each(|key| {
        key.tables().into_iter().for_each(|inner| add(inner, Some(table.head), pages));
    });
}

/// docs/SCENE.md.
pub(crate) fn markdown() -> String {
    let mut text = "\
# The scene file: every key

Printed by `luxmap help scene --markdown` from the tables that luxmap parses by; `luxmap help scene` prints the same for
the terminal. [FILES.md](FILES.md) tells what becomes of the meshes, materials and photometric files that a scene names.

## Conventions

"
    .to_owned();
    CONVENTIONS.iter().for_each(|(title, words)| text += &item(&format!("**{title}.** {words}")));
    for page in pages() {
        let depth = if page.within.is_empty() && page.table.head != "[[plane.task]]" { "##" } else { "###" };
        let title = match page.within.as_slice() {
            [] if page.is_whole() => page.title(),
            [] => format!("`{}`", page.table.head),
            owners => format!("`{}` of `{}`", page.table.head, owners.join("` and `")),
        };
        text += &format!("\n{depth} {title}\n\n{}", wrapped(page.about(), ["", ""]));
        if !page.example().is_empty() {
            text += &format!("\n```toml\n{}```\n", page.example());
        }
        text += "\n| key | unit | values | default | meaning |\n|---|---|---|---|---|\n";
        for key in page.table.keys {
            let or = |words: &'static str, nothing: &'static str| if words.is_empty() { nothing } else { words };
            let (unit, default) = (or(key.unit(), "–"), or(key.default(), "–"));
            let range = key.range();
            text += &format!("| `{}` | {unit} | {range} | {default} | {} |\n", key.name(), key.meaning());
        }
        if !page.rules().is_empty() {
            text += "\n";
            page.rules().iter().for_each(|rule| text += &item(rule));
        }
    }
    text
}

/// An item of a list.
fn item(words: &str) -> String {
    wrapped(words, ["- ", "  "])
}

/// Text in lines of at most 120 columns; the first and the others begin with what `starts` has for them.
fn wrapped(text: &str, starts: [&str; 2]) -> String {
    const WIDEST: usize = 120;
    let (mut all, mut line) = (String::new(), starts[0].to_owned());
    for (at, word) in text.split(' ').enumerate() {
        if at > 0 && line.chars().count() + 1 + word.chars().count() > WIDEST {
            all += &(std::mem::replace(&mut line, starts[1].to_owned()) + "\n");
        } else if at > 0 {
            line.push(' ');
        }
        line += word;
    }
    all + &line + "\n"
}
