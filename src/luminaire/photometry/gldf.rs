//! GLDF (gldf.io, 1.0): a zip archive of `product.xml` and of the files that it names.
//!
//! A product has **variants**; a variant's geometry names emitters, an emitter a photometry, a photometry a file of the
//! archive (EULUMDAT, LM-63 or TM-33), which is read as if it stood alone.
//!
//! - A variant is chosen by its name in any language, its product number or its id; a file of the archive by its name,
//!   which then counts as it stands. No choice is needed where all variants have the same light.
//! - Several light emitters in one `Emitter` are alternatives (`lamp_set` chooses; the first otherwise, and one for
//!   emergencies only last). Several light outputs of one variant stand in places that only its 3D model tells:
//!   refused, as are emitters that the product turns, and lamps of several channels.
//! - **Flux**: a fixed emitter's `RatedLuminousFlux` is what the luminaire gives, and intensities are scaled to it,
//!   unless it is the flux of the file's lamps. An equipment's lamps replace those of a relative file.

mod product;

use std::borrow::Cow;
use std::io::{Cursor, Read as _};
use std::path::Path;

use zip::ZipArchive;

use self::product::{ArchiveContent, Product};
use super::text::{decode, quoted};
use super::{Choice, Photometry, formats, tm33};
use crate::error::{InputError, Location};
use crate::files::limits::{LARGEST_GLDF, LARGEST_PHOTOMETRY, MOST_FILES};

/// Share by which two fluxes of the same thing may differ.
const ROUNDING: f64 = 2e-3;

/// Reads a zip archive that should be a GLDF.
pub(super) fn parse(path: &Path, content: &[u8], choice: &Choice) -> Result<Photometry, InputError> {
    let refuse = |found: String, expected: &str| Err(InputError::new(Location::file(path), found, expected));
    if content.len() as u64 > LARGEST_GLDF {
        return refuse(format!("a GLDF file of {} MiB", content.len() >> 20), "128 MiB at most");
    }
    let mut archive = match ZipArchive::new(Cursor::new(content)) {
        Ok(archive) => Archive { path, archive },
        Err(error) => return refuse(format!("a zip archive that can't be read ({})", told(&error)), "a GLDF file"),
    };
    if archive.archive.len() > MOST_FILES {
        let found = format!("an archive of {} files", archive.archive.len());
        return refuse(found, &format!("{MOST_FILES} at most"));
    }
    let Some(index) = archive.find("product.xml") else {
        let error = formats::refuse(path, "a zip archive without product.xml");
        return Err(InputError { expected: "a GLDF file, or what the archive holds".into(), ..error });
    };
    let xml_path = path.join("product.xml");
    let text = decode(&xml_path, &archive.unpack(index)?)?;
    let tree = tm33::tree(&xml_path, &text)?;
    let product = Product::read(&xml_path, &tree)?;
    let output = product.choose(path, choice)?;
    let Some(index) = archive.find(&output.file) else {
        return refuse(format!("no file {} in the archive", quoted(&output.file)), "the file that product.xml names");
    };
    let inner_choice = Choice {
        lamp_set: choice.lamp_set.clone().filter(|_| !output.set_is_chosen),
        variant: None,
        flux_is_told: choice.flux_is_told || output.flux.is_some() || output.lamp_flux.is_some(),
    };
    let bytes = archive.unpack(index)?;
    let inner = path.join(archive.name(index));
    let photometry = formats::parse_plain(&inner, &bytes, &inner_choice)?;
    Ok(finished(photometry, &product, &output))
}

/// A photometry with what the product says of it.
fn finished(mut photometry: Photometry, product: &Product, output: &ArchiveContent) -> Photometry {
    let computed = photometry.intensity.flux();
    let lamps = photometry.lamps.get(photometry.lamp_set);
    let of_lamps = lamps.and_then(|lamps| lamps.flux).filter(|flux| *flux > 0.0);
    let absolute = lamps.is_none_or(|lamps| lamps.absolute);
    let near = |a: f64, b: f64| (a / b - 1.0).abs() < ROUNDING;
    let factor = match (output.flux, output.lamp_flux, of_lamps) {
        (Some(rated), _, Some(lamps)) if near(rated, lamps) => 1.0,
        (Some(rated), ..) if computed > 0.0 => rated / computed,
        (None, Some(flux), Some(lamps)) if !absolute => flux / lamps,
        _ => 1.0,
    };
    let mut notes = output.notes.clone();
    if !near(factor, 1.0) && factor > 0.0 && factor.is_finite() {
        let flux = crate::text::number::short(computed * factor);
        notes.push(format!("intensities are scaled to the variant's flux: {flux} lm of the luminaire"));
        photometry.intensity = photometry.intensity.scaled(factor);
        photometry.flux = photometry.flux.map(|flux| flux * factor);
        let set = photometry.lamp_set;
        if let Some(lamps) = photometry.lamps.get_mut(set) {
            lamps.flux = lamps.flux.map(|flux| flux * factor);
        }
    }
    photometry.notes.splice(0..0, notes);
    if !output.variant.is_empty() {
        photometry.remarks.insert(0, ("variant".to_owned(), output.variant.clone()));
    }
    photometry.remarks.insert(0, ("file in the GLDF".to_owned(), output.file.clone()));
    for (own, of_product) in [(&mut photometry.name, &product.name), (&mut photometry.manufacturer, &product.maker)] {
        if own.is_empty() {
            own.clone_from(of_product);
        }
    }
    photometry
}

/// Files of the archive, unpacked one by one.
struct Archive<'a> {
    path: &'a Path,
    archive: ZipArchive<Cursor<&'a [u8]>>,
}

impl Archive<'_> {
    fn name(&self, index: usize) -> String {
        self.archive.name_for_index(index).and_then(Result::ok).map(Cow::into_owned).unwrap_or_default()
    }

    /// Index of a file, by its name without folders and without regard to case.
    fn find(&self, wanted: &str) -> Option<usize> {
        let plain = |name: &str| name.replace('\\', "/").rsplit('/').next().unwrap_or_default().to_lowercase();
        let wanted = plain(wanted);
        let place = |index: &usize| self.name(*index).matches('/').count();
        let all = (0..self.archive.len()).filter(|index| plain(&self.name(*index)) == wanted);
        all.min_by_key(place)
    }

    fn unpack(&mut self, index: usize) -> Result<Vec<u8>, InputError> {
        let name = self.name(index);
        let at = || Location::file(self.path);
        let refuse = |why: String| {
            InputError::new(at(), format!("{} in the archive, {why}", quoted(&name)), "a file that can be unpacked")
        };
        let file = self.archive.by_index(index).map_err(|error| refuse(told(&error)))?;
        let mut content = Vec::new();
        let read = file.take(LARGEST_PHOTOMETRY + 1).read_to_end(&mut content);
        read.map_err(|error| refuse(told(&error)))?;
        if content.len() as u64 > LARGEST_PHOTOMETRY {
            return Err(refuse("more than 16 MiB when unpacked".to_owned()));
        }
        Ok(content)
    }
}

/// Another library's words, in one line.
fn told(error: &impl std::fmt::Display) -> String {
    error.to_string().chars().map(|c| if c.is_control() { ' ' } else { c }).take(120).collect()
}
