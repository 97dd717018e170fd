//! What a photometric file says, as a page that needs nothing else.

use std::path::Path;

use maud::{Markup, html};

use super::figures::Figures;
use super::text::{rows, warnings};
use crate::luminaire::photometry::Photometry;
use crate::report::html::{self, definitions, document, own, section};
use crate::report::png::{drawing, orientation, polar};

/// Looks of the page beside those of its drawings.
const STYLE: &str = include_str!("page.css");

/// The page of a file.
pub(super) fn page(path: &Path, photometry: &Photometry, figures: &Figures) -> String {
    let title = title(path, photometry);
    let facts = [photometry.manufacturer.as_str(), &photometry.catalogue, photometry.format.name()];
    let facts = facts.into_iter().filter(|fact| !fact.is_empty()).collect::<Vec<_>>().join(" · ");
    let main = html! {
        header { h1 { (title) } p { (facts) br; (path.display().to_string()) } }
        (html::warnings(&warnings(photometry, figures)))
        (section("Intensity", figure(&polar::diagram(photometry, figures, false).element())))
        (section("What the file says", definitions(rows(photometry, figures))))
        (section("How it lies in the room", html! {
            (figure(&orientation::drawing(photometry).element())) (own(ORIENTATION))
        }))
        @if !photometry.remarks.is_empty() {
            (section("Remarks", definitions(photometry.remarks.iter().map(|(name, text)| (name, text)))))
        }
    };
    document(&title, &[drawing::STYLE, STYLE], &main)
}

/// What a luminaire is called: its name, else its catalogue number, else the file's name.
pub(super) fn title(path: &Path, photometry: &Photometry) -> String {
    let file = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    [&photometry.name, &photometry.catalogue].into_iter().find(|name| !name.is_empty()).cloned().unwrap_or(file)
}

fn figure(drawing: &Markup) -> Markup {
    html! { figure { "\n" (drawing) } "\n" }
}

/// What the drawing doesn't say.
const ORIENTATION: &str = "<p>With <code>rotation = 0</code> and without <code>aim</code> a luminaire looks down, with \
    C0 towards +x and C90 towards +y. <code>aim</code> tilts it the shortest way from there. Positive \
    <code>rotation</code> turns it from C0 towards C90: counter-clockwise for whoever stands behind it and looks where \
    it looks, so counter-clockwise on a plan where it looks down. LM-63’s <i>length</i> lies along C0 and its \
    <i>width</i> along C90; EULUMDAT’s <i>length</i> lies along C90 and its <i>width</i> along C0.</p>\n";
