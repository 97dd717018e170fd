//! What a photometric file is: by its content, by its ending only where content doesn't say.

use std::path::Path;

use super::text::{self, quoted};
use super::{Choice, Photometry, eulumdat, ies, tm33};
use crate::error::{InputError, Location};
use crate::files::limits::LARGEST_PHOTOMETRY;

/// What is read, in words.
pub(super) const READ: &str = "a photometric file: LM-63 (.ies), EULUMDAT (.ldt), TM-33 (.xml) or GLDF (.gldf)";
/// What to do with a file of another format.
const ELSEWHERE: &str = "export it as EULUMDAT (.ldt) or LM-63 (.ies), or get that file from the maker";

/// Endings of formats that aren't read, and their names.
const FOREIGN: [(&str, &str); 16] = [
    ("uld", "a ULD file, DIALux's own format"),
    ("dlx", "a DIALux project"),
    ("evo", "a DIALux evo project"),
    ("rolf", "a ROLF file, Relux's own format"),
    ("rdf", "a Relux project"),
    ("tm14", "a CIBSE TM14 file"),
    ("cib", "a CIBSE TM14 file"),
    ("cibse", "a CIBSE TM14 file"),
    ("ltli", "an LTLI file"),
    ("ltl", "an LTLI file"),
    ("lum", "a LUM file, a program's own format"),
    ("oxl", "an OXL file, LUMCat's own format"),
    ("l3d", "an L3D file, a luminaire's 3D model"),
    ("m3d", "an M3D file, a luminaire's 3D model"),
    ("r3d", "an R3D file, a luminaire's 3D model"),
    ("pdf", "a PDF"),
];

/// What a file's first bytes say of it, where it is nothing that is read.
const SIGNS: [(&[u8], &str, &str); 5] = [
    (b"\x1f\x8b", "a file compressed by gzip", "unpack it"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", "unpack it"),
    (b"Rar!", "a RAR archive", "unpack it"),
    (b"%PDF", "a PDF", ELSEWHERE),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "a compound file of Windows programs", ELSEWHERE),
];

/// Reads one that holds no other files.
pub(super) fn parse_plain(path: &Path, content: &[u8], choice: &Choice) -> Result<Photometry, InputError> {
    let refuse = |found: &str, hint: &str| Err(InputError::new(Location::file(path), found, READ).hint(hint));
    if content.len() as u64 > LARGEST_PHOTOMETRY {
        return refuse(&format!("{} MiB", content.len() >> 20), "16 MiB are the most that is read as one table");
    }
    if let Some((_, found, hint)) = SIGNS.iter().find(|(sign, ..)| content.starts_with(sign)) {
        return refuse(found, hint);
    }
    let ending = ending(path);
    let text = match (text::decode(path, content), foreign(path)) {
        (Err(_), Some(found)) => return refuse(found, ELSEWHERE),
        (text, _) => text?,
    };
    match text.trim_start().chars().next() {
        Some('<') => return tm33::parse_xml(path, &text, choice),
        Some('{') => return tm33::parse_json(path, &text, choice),
        _ => {}
    }
    let is_ies = ies::is_ies(&text);
    if !is_ies && (ending == "ldt" || eulumdat::is_eulumdat(&text)) {
        check_variant(path, choice)?;
        return eulumdat::parse(path, &text, choice);
    }
    if is_ies || ending == "ies" {
        check_variant(path, choice)?;
        choice.lamp_set.as_ref().map_or(Ok(0), |set| set.within(1, path))?;
        return ies::parse(path, &text);
    }
    match foreign(path) {
        Some(found) => refuse(found, ELSEWHERE),
        None => {
            let found = "neither a line TILT= nor the numbers that begin a EULUMDAT file";
            Err(InputError::new(Location::file(path), found, READ))
        }
    }
}

/// The file's ending in small letters.
fn ending(path: &Path) -> String {
    path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

/// Which other format the file's ending names.
pub(super) fn foreign(path: &Path) -> Option<&'static str> {
    let ending = ending(path);
    FOREIGN.iter().find(|(known, _)| *known == ending).map(|(_, name)| *name)
}

/// Refuses one of those, or anything else that is no photometric file.
pub(super) fn refuse(path: &Path, found: &str) -> InputError {
    match foreign(path) {
        Some(name) => InputError::new(Location::file(path), name, READ).hint(ELSEWHERE),
        None => InputError::new(Location::file(path), found, READ),
    }
}

/// Refuses a variant where the file has none.
fn check_variant(path: &Path, choice: &Choice) -> Result<(), InputError> {
    let Some(variant) = &choice.variant else { return Ok(()) };
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let found = format!("variant = {}", quoted(&variant.value));
    Err(InputError::new(variant.at.clone(), found, format!("no variant: {} has none", quoted(&file))))
}
