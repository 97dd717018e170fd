//! `[[luminaire]]`: what shines, where, and how.

use glam::DVec3;

use super::super::fields::Placed;
use super::array::{self, Array};
use super::keys::{Key, Section, Table};
use super::kinds::{Direction, Inner, Metres, Number, Numbers, Range, Text, Whole};
use super::opening::{OPENING, OpeningShape};
use super::supply::{self, DIMMING, DIMMING_MIN, POWER, STANDBY};
use super::{MAINTENANCE_FACTOR, keys};
use crate::error::InputError;
use crate::luminaire::photometry::{Choice, Chosen};
use crate::luminaire::{Supply, colour};

/// A `[[luminaire]]`.
pub(crate) struct LuminaireSection {
    pub(crate) name: Placed<String>,
    pub(crate) position: DVec3,
    /// Where γ = 0 looks; straight down where the section says nothing.
    pub(crate) aim: DVec3,
    /// `rotation`, degrees. At 0, looking down, C0 (the first size of an opening) lies towards +x and C90 towards +y.
    /// Positive turns from C0 towards C90: counter-clockwise seen from above where the luminaire looks down,
    /// counter-clockwise seen from behind it whatever it looks at.
    pub(crate) rotation: f64,
    /// Where the section says it.
    pub(crate) shape: Option<OpeningShape>,
    pub(crate) spread: SpreadKey,
    /// Undimmed and new, lm, where the section says it.
    pub(crate) flux: Option<f64>,
    /// Level as the file has it, 0 where it is switched off; and what it draws.
    pub(crate) supply: Supply,
    /// Maintenance factor; the scene's where the section gives none.
    pub(crate) maintenance: Option<f64>,
    pub(crate) colour: [f64; 3],
    pub(crate) group: Option<String>,
    pub(crate) array: Option<Array>,
}

/// How light spreads.
pub(crate) enum SpreadKey {
    Isotropic,
    Lambertian,
    /// As this photometric file has it, and what is chosen of it.
    File(Placed<String>, Choice),
}

static NAME: Key<Text> =
    Key::needed("name", Text::NAME, "\"L\"", "Its name, in results, in dimming files and as its light group.");
static POSITION: Key<Metres> =
    Key::needed("position", Metres, "[x, y, z] (m)", "Middle of the luminous opening; of an array, that of its first.");
static AIM: Key<Direction> =
    Key::optional("aim", Direction, "[0, 0, -1]", "Direction into which γ = 0 points: straight down if not given.");
static ROTATION: Key<Number> = Key::optional(
    "rotation",
    Number::of(Range::between(-36_000.0, 36_000.0), "°"),
    "0",
    "Turn about `aim`, from C0 towards C90: counter-clockwise seen from behind the luminaire.",
);
static PHOTOMETRY: Key<Text> = Key::optional(
    "photometry",
    Text("path of a photometric file, \"lambertian\" or \"isotropic\""),
    "\"isotropic\" for a point, else \"lambertian\"",
    "How the light spreads: as a file of LM-63 (.ies), EULUMDAT (.ldt), GLDF or TM-33 tells, or by one of two words.",
);
static LAMP_SET: Key<Whole> = Key::optional(
    "lamp_set",
    Whole::between(1, 1000),
    "1",
    "Which of the lamp sets of a EULUMDAT file, counted from 1.",
);
static VARIANT: Key<Text> =
    Key::optional("variant", Text::NAME, "the only one", "Which variant of a GLDF file, or emitter of a TM-33 file.");
static FLUX: Key<Number> = Key::needed_unless(
    "flux",
    Number::of(Range::above_to(0.0, 1e15), "lm")
        .said("a number above 0, lm")
        .hint("dimming = 0 switches a luminaire off"),
    "that of the photometric file; required without one",
    "3000 (lm)",
    "Luminous flux of the luminaire, new and undimmed.",
);
static COLOR: Key<Numbers<3>> = Key::optional(
    "color",
    Numbers::of(Range::between(0.0, 1e15), "").said(COLOR_FORM).shown("[r, g, b]"),
    "white",
    "Colour of its light, linear Rec. 709; its brightness is left out.",
);
static CCT: Key<Number> = Key::optional(
    "cct",
    Number::of(Range::between(1000.0, 25_000.0), "K"),
    "white",
    "Colour of its light as the temperature of a black body.",
);
static GROUP: Key<Text> = Key::optional("group", Text::NAME, "its name", "Light group that `--groups` tells it with.");
static ARRAY: Key<Inner<Array>> =
    Key::optional("array", array::LUMINAIRES, "a single luminaire", "Rows of equal luminaires.");

pub(super) static LUMINAIRE: Table = Table {
    head: "[[luminaire]]",
    about: "A luminaire: its luminous opening, how its light spreads, its flux, and what power it draws. Light \
            leaves from all of the opening alike. An opening with a size also stands in the way of light, and \
            absorbs it.",
    keys: &[
        &NAME,
        &POSITION,
        &AIM,
        &ROTATION,
        &OPENING,
        &PHOTOMETRY,
        &LAMP_SET,
        &VARIANT,
        &FLUX,
        &DIMMING,
        &COLOR,
        &CCT,
        &GROUP,
        &ARRAY,
        &MAINTENANCE_FACTOR,
        &DIMMING_MIN,
        &POWER,
        &STANDBY,
    ],
    rules: &[
        "Give either `flux` or a photometric file that tells it; `flux` wins over the file's.",
        "`lamp_set` and `variant` choose from a photometric file, so they need one.",
        "`\"isotropic\"` is for points only.",
        "Give either `color` or `cct`, not both.",
        "`standby` needs `power`; `dimming_min` is at least the first level that `power` is given for.",
        "No two luminaires have the same name, members of arrays included; a scene has at most 100,000.",
    ],
    example: "\
[[luminaire]]
name = \"L\"
position = [1.0, 0.72, 2.69]
opening = { rectangle = [0.6, 0.6] }
flux = 3000
cct = 4000
power = 24
array = { count = [3, 5], pitch = [2.0, 1.44] }

[[luminaire]]
name = \"washer\"
position = [2.0, 2.3, 2.7]
aim = [0, 0.5, -1]
photometry = \"wall-washer.ies\"
dimming = 0.8
dimming_min = 0.1
power = [[0.1, 5], [1, 30]]
standby = 0.4
group = \"walls\"
",
};

const COLOR_FORM: &str = "[r, g, b], none below 0 and not all of them 0";

pub(super) fn read(section: &Section<'_>) -> Result<LuminaireSection, InputError> {
    let shape = section.get(&OPENING)?;
    let spread = spread(section, shape)?;
    let flux = section.get(&FLUX)?;
    if flux.is_none() && !matches!(spread, SpreadKey::File(..)) {
        return Err(section.missing(&FLUX));
    }
    Ok(LuminaireSection {
        name: section.need_placed(&NAME)?,
        position: section.need(&POSITION)?,
        aim: section.get(&AIM)?.unwrap_or(DVec3::NEG_Z),
        rotation: section.get(&ROTATION)?.unwrap_or(0.0),
        shape,
        spread,
        flux,
        supply: supply::read(section)?,
        maintenance: section.get(&MAINTENANCE_FACTOR)?,
        colour: light_colour(section)?,
        group: section.get(&GROUP)?,
        array: section.get(&ARRAY)?,
    })
}

/// How light spreads: a photometric file, or one of the built-in kinds.
fn spread(section: &Section<'_>, shape: Option<OpeningShape>) -> Result<SpreadKey, InputError> {
    let photometry = section.placed(&PHOTOMETRY)?;
    let is_point = matches!(shape, None | Some(OpeningShape::Point));
    let lamp_set = section.placed(&LAMP_SET)?;
    let variant = section.placed(&VARIANT)?;
    let built_in = photometry.as_ref().is_none_or(|word| ["lambertian", "isotropic"].contains(&word.value.as_str()));
    let choosing: [&dyn keys::AnyKey; 2] = [&LAMP_SET, &VARIANT];
    if let Some(key) = choosing.into_iter().find(|key| built_in && section.has(*key)) {
        return Err(section.refusal(key, format!("a photometric file that {} chooses from", key.name())));
    }
    match photometry {
        None if is_point => Ok(SpreadKey::Isotropic),
        None => Ok(SpreadKey::Lambertian),
        Some(word) if word.value == "lambertian" => Ok(SpreadKey::Lambertian),
        Some(word) if word.value == "isotropic" && is_point => Ok(SpreadKey::Isotropic),
        Some(word) if word.value == "isotropic" => Err(section
            .refusal(&PHOTOMETRY, "\"lambertian\" for an opening with an area")
            .hint("only points shine alike in all directions")),
        Some(file) => {
            let choice = Choice {
                lamp_set: lamp_set.map(|set| Chosen { value: set.value as usize, at: set.at }),
                variant: variant.map(|name| Chosen { value: name.value, at: name.at }),
                flux_is_told: false,
            };
            Ok(SpreadKey::File(file, choice))
        }
    }
}

fn light_colour(section: &Section<'_>) -> Result<[f64; 3], InputError> {
    let (color, cct) = (section.get(&COLOR)?, section.get(&CCT)?);
    match (color, cct) {
        (Some(_), Some(_)) => Err(section.refusal(&CCT, "either color or cct")),
        (Some([0.0, 0.0, 0.0]), None) => Err(section.refusal(&COLOR, COLOR_FORM)),
        (Some(color), None) => Ok(colour::normalised(color)),
        (None, Some(cct)) => Ok(colour::black_body(cct)),
        (None, None) => Ok([1.0; 3]),
    }
}
