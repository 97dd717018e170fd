//! What each `[[luminaire]]` gives: its own keys and its photometric file together.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::fields::Placed;
use super::file::{LuminaireSection, OpeningShape, SceneFile, SpreadKey};
use super::fixture::{FixtureLight, LampSpread};
use super::read::{Reader, path_hint};
use crate::error::{InputError, Location};
use crate::files::limits::LARGEST_GLDF;
use crate::geometry::body::Solid;
use crate::luminaire::frame;
use crate::luminaire::photometry::{Choice, LuminousOpening, Photometry, Shape, Tilt};
use crate::luminaire::web::Web;
use crate::text::listed;
use crate::text::number::{round_to, short};
use crate::text::quoted;

impl Reader {
    /// What each [[luminaire]] is, photometric files read once each.
    pub(super) fn lamps(&mut self, path: &Path, file: &SceneFile) -> Result<Vec<FixtureLight>, InputError> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut known = Photometries::default();
        let mut tilts = Tilts::default();
        let mut lamps = Vec::with_capacity(file.luminaires.len());
        for section in &file.luminaires {
            let (spread, shape, flux) = match &section.spread {
                SpreadKey::Isotropic => (LampSpread::Isotropic, OpeningShape::Point, 0.0),
                SpreadKey::Lambertian => (LampSpread::Lambertian, OpeningShape::Point, 0.0),
                SpreadKey::File(named, choice) => {
                    let measured = known.get(self, &folder.join(&named.value), named, choice, &file.luminaires)?;
                    measured.opening_counts |= section.shape.is_none();
                    let tilted = tilts.factor(section, measured);
                    let spread = LampSpread::Web(Arc::clone(&measured.web));
                    (spread, measured.shape, measured.web.flux() * tilted)
                }
            };
            let maintained = section.maintenance.or(file.maintenance).unwrap_or(1.0);
            let flux = section.flux.unwrap_or(flux) * maintained;
            if flux <= 0.0 {
                let found = format!("luminaire {} tilted so that it gives no light", quoted(&section.name.value));
                return Err(InputError::new(section.name.at.clone(), found, "a tilt factor above 0"));
            }
            lamps.push(FixtureLight { shape: section.shape.unwrap_or(shape), spread, flux });
        }
        self.warnings.extend(known.doubts());
        self.warnings.extend(tilts.warnings());
        Ok(lamps)
    }

    /// Reads a photometric file that the scene names.
    fn photometry(
        &mut self,
        path: &Path,
        named: &Placed<String>,
        choice: &Choice,
        bytes: &mut HashMap<PathBuf, Vec<u8>>,
    ) -> Result<Measurement, InputError> {
        if !bytes.contains_key(path) {
            let content = self.read(path, LARGEST_GLDF).map_err(|why| {
                let found = format!("photometry = {} ({why})", quoted(&named.value));
                let expected = "a photometric file (.ies, .ldt, .gldf, TM-33), \"lambertian\" or \"isotropic\"";
                InputError::new(named.at.clone(), found, expected).hint(path_hint(&why))
            })?;
            bytes.insert(path.to_owned(), content);
        }
        let photometry = Photometry::parse_chosen(path, &bytes[path], choice)?;
        let doubt = photometry.opening_note;
        for note in photometry.notes.iter().filter(|note| Some(*note) != doubt.as_ref()) {
            let warning = format!("{}: {note}", path.display());
            if !self.warnings.contains(&warning) {
                self.warnings.push(warning);
            }
        }
        let shape = opening_of(&photometry.opening);
        let source = format!("{} ({})", named.value, photometry.format.name());
        let web = Web::new(photometry.intensity).ok_or_else(|| {
            InputError::new(Location::file(path), "no luminous intensity above 0", "a luminaire that shines")
        })?;
        let doubt = doubt.map(|doubt| format!("{}: {doubt}", path.display()));
        let (file, web) = (path.to_owned(), Arc::new(web.named(source)));
        Ok(Measurement { file, web, shape, tilt: photometry.tilt, doubt, opening_counts: false })
    }
}

/// What a photometric file tells.
struct Measurement {
    file: PathBuf,
    web: Arc<Web>,
    shape: OpeningShape,
    tilt: Option<Tilt>,
    /// What is doubtful about its opening.
    doubt: Option<String>,
    /// Whether a luminaire takes its opening from it.
    opening_counts: bool,
}

/// Photometric files that were read, one for each choice of what they hold.
#[derive(Default)]
struct Photometries {
    bytes: HashMap<PathBuf, Vec<u8>>,
    places: HashMap<(PathBuf, Option<usize>, Option<String>), usize>,
    read: Vec<Measurement>,
}

impl Photometries {
    /// What the file says, read where it is new.
    fn get(
        &mut self,
        reader: &mut Reader,
        path: &Path,
        named: &Placed<String>,
        choice: &Choice,
        luminaires: &[LuminaireSection],
    ) -> Result<&mut Measurement, InputError> {
        let part = |choice: &Choice| {
            let variant = choice.variant.as_ref().map(|variant| variant.value.clone());
            (choice.lamp_set.as_ref().map(|set| set.value), variant)
        };
        let (set, variant) = part(choice);
        let key = (path.to_owned(), set, variant);
        let place = match self.places.get(&key) {
            Some(place) => *place,
            None => {
                // A file without a flux will do where every luminaire of it has its own.
                let same = |section: &&LuminaireSection| matches!(&section.spread, SpreadKey::File(other, of) if other.value == named.value && part(of) == part(choice));
                let flux_is_told = luminaires.iter().filter(same).all(|section| section.flux.is_some());
                let choice = Choice { flux_is_told, ..choice.clone() };
                self.read.push(reader.photometry(path, named, &choice, &mut self.bytes)?);
                self.places.insert(key, self.read.len() - 1);
                self.read.len() - 1
            }
        };
        Ok(&mut self.read[place])
    }

    /// Doubts about openings that luminaires have from files.
    fn doubts(self) -> impl Iterator<Item = String> {
        self.read.into_iter().filter(|measured| measured.opening_counts).filter_map(|measured| measured.doubt)
    }
}

/// The luminous opening that a photometric file tells. A line becomes as wide as a thousandth of its length.
fn opening_of(opening: &LuminousOpening) -> OpeningShape {
    let LuminousOpening { c0, c90, height, .. } = *opening;
    let least = 1e-3 * c0.max(c90).max(height);
    let [a, b, c] = [c0, c90, height].map(|size| size.max(least));
    match opening.shape {
        Shape::Point => OpeningShape::Point,
        Shape::Rectangle => OpeningShape::Rectangle([a, b]),
        Shape::Ellipse if a == b => OpeningShape::Disc { diameter: a },
        Shape::Ellipse => OpeningShape::Ellipse([a, b]),
        Shape::UprightEllipse => OpeningShape::Upright([b, c]),
        Shape::Box => OpeningShape::Solid(Solid::Box, [a, b, c], 2),
        Shape::VerticalCylinder => OpeningShape::Solid(Solid::Cylinder, [a, b, c], 2),
        Shape::CylinderAlongC0 => OpeningShape::Solid(Solid::Cylinder, [a, b, c], 0),
        Shape::CylinderAlongC90 => OpeningShape::Solid(Solid::Cylinder, [a, b, c], 1),
        Shape::Ellipsoid => OpeningShape::Solid(Solid::Ellipsoid, [a, b, c], 2),
    }
}

/// Most luminaires that a warning names.
const MOST_NAMES: usize = 8;

/// What was done about tilted lamps: sentences, and the luminaires that each is about.
#[derive(Default)]
struct Tilts(Vec<(String, String, Vec<String>)>);

impl Tilts {
    /// What the light of a luminaire that hangs is multiplied by, as this one is turned.
    fn factor(&mut self, section: &LuminaireSection, measured: &Measurement) -> f64 {
        let Some(tilt) = &measured.tilt else { return 1.0 };
        let angle = tilt.of_lamp(section.aim, frame::c0_direction(section.aim, section.rotation));
        let factor = tilt.factor(angle) / tilt.factor(0.0);
        let beyond = tilt.is_beyond(angle);
        if factor == 1.0 && !beyond {
            return 1.0;
        }
        let told = |value: f64| short(round_to(value, 4));
        let mut sentence = format!("{}, tilted by {}°: ", tilt.lamps(), told(angle));
        sentence += &match section.flux {
            Some(_) => "no tilt factor is applied, as flux tells what it gives".to_owned(),
            None => format!("{} of the light it gives as it was measured (TILT)", told(factor)),
        };
        if beyond {
            let ends = [tilt.angles[0], tilt.angles[tilt.angles.len() - 1]].map(told);
            sentence += &format!("; the table ends there: {}° to {}°", ends[0], ends[1]);
        }
        let (file, name) = (measured.file.display().to_string(), section.name.value.clone());
        match self.0.iter_mut().find(|(known, said, _)| *known == file && *said == sentence) {
            Some((.., names)) => names.push(name),
            None => self.0.push((file, sentence, vec![name])),
        }
        factor
    }

    /// A warning for each sentence.
    fn warnings(self) -> impl Iterator<Item = String> {
        self.0.into_iter().map(|(file, sentence, names)| {
            let who = match names.as_slice() {
                [one] => format!("luminaire {}", quoted(one)),
                more if more.len() <= MOST_NAMES => format!("luminaires {}", listed(more.iter().map(String::as_str))),
                more => format!("{} luminaires, among them {}", more.len(), quoted(&more[0])),
            };
            format!("{file}: {who} with {sentence}")
        })
    }
}
