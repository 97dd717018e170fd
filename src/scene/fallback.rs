//! What materials reflect of which nothing else says it: models from elsewhere often leave some of them open.
//!
//! ```toml
//! [material."*"]          # any keys of a material's section
//! reflectance = 0.5
//! ```
//!
//! Order, the first that says something counts: the material's own section, its MTL file, `--reflectance` of the
//! command line, `[material."*"]`. Which materials it was is told, as they are guesses.

use std::collections::BTreeSet;
use std::path::Path;

use super::file::MaterialSection;
use crate::error::Location;
use crate::text::quoted;

/// Name of the section that speaks of all materials that are left.
pub(super) const ALL: &str = "*";

/// What is said of materials that are left, and which those are.
pub(super) struct Fallback {
    section: MaterialSection,
    source: &'static str,
    taken: BTreeSet<String>,
}

impl Fallback {
    /// What the scene's sections or the command line say.
    pub(super) fn of(sections: &[MaterialSection], reflectance: Option<[f64; 3]>) -> Option<Self> {
        let (section, source) = match (reflectance, sections.iter().find(|section| section.name == ALL)) {
            (Some(rgb), _) => {
                let option = "--reflectance";
                (MaterialSection::reflecting(ALL, Location::file(Path::new(option)), rgb), option)
            }
            (None, Some(section)) => (section.clone(), "[material.\"*\"]"),
            (None, None) => return None,
        };
        Some(Self { section, source, taken: BTreeSet::new() })
    }

    /// The section of a material that is left; what its own one says goes before.
    pub(super) fn section_of(&mut self, name: &str, own: Option<&MaterialSection>) -> MaterialSection {
        self.taken.insert(name.to_owned());
        let mut section = MaterialSection { name: name.to_owned(), ..self.section.clone() };
        if let Some(own) = own {
            section.roughness = own.roughness.clone().or(section.roughness);
            section.sides = own.sides;
        }
        section
    }

    /// The materials it was used for, in one line.
    pub(super) fn told(&self) -> Option<String> {
        /// Bytes of names that a line may hold and still be read.
        const LONGEST: usize = 1200;
        if self.taken.is_empty() {
            return None;
        }
        let mut names: Vec<String> = Vec::new();
        for name in &self.taken {
            if names.iter().map(String::len).sum::<usize>() > LONGEST {
                break;
            }
            names.push(quoted(name));
        }
        let more = match self.taken.len() - names.len() {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let names = names.join(", ");
        let kind = if self.taken.len() == 1 { "material" } else { "materials" };
        let what = match self.section.reflectance.as_ref().map(|rgb| rgb.value) {
            Some([r, g, b]) if r == g && g == b => format!("reflectance {r}"),
            Some([r, g, b]) => format!("reflectance {r}, {g}, {b}"),
            None => "all".to_owned(),
        };
        Some(format!("{kind} {names}{more}: {what} from {}", self.source))
    }
}
