//! `[material.NAME]`: what a surface does with light; [`material`](crate::scene::material) tells the model.

use super::super::fields::{Placed, plain};
use super::super::glazing::{Curve, Glazing};
use super::super::material::{Dielectric, Sides};
use super::keys::{Key, Section, Table};
use super::kinds::{Channels, Inner, Number, OneOf, Range, Several};
use crate::error::{InputError, Location};

/// A `[material.NAME]`.
#[derive(Clone)]
pub(crate) struct MaterialSection {
    pub(crate) name: String,
    pub(crate) at: Location,
    pub(crate) reflectance: Option<Placed<[f64; 3]>>,
    pub(crate) specular: Option<Placed<[f64; 3]>>,
    pub(crate) roughness: Option<Placed<f64>>,
    pub(crate) transmittance: Option<Placed<[f64; 3]>>,
    pub(crate) sides: Sides,
    pub(crate) dielectric: Option<Dielectric>,
    pub(crate) glazing: Option<Glazing>,
}

impl MaterialSection {
    /// A section that says nothing but what is reflected by Lambert's law.
    pub(crate) fn reflecting(name: &str, at: Location, reflectance: [f64; 3]) -> Self {
        Self {
            name: name.to_owned(),
            reflectance: Some(Placed { value: reflectance, at: at.clone() }),
            at,
            specular: None,
            roughness: None,
            transmittance: None,
            sides: Sides::Two,
            dielectric: None,
            glazing: None,
        }
    }
}

static REFLECTANCE: Key<Channels> = Key::optional(
    "reflectance",
    Channels::of(Range::SHARE, "").hint("white paint: about 0.85"),
    "the MTL file's Kd",
    "Share of the light that is reflected diffusely, by Lambert's law.",
);
static SPECULAR: Key<Channels> = Key::optional(
    "specular",
    Channels::of(Range::SHARE, "").hint("a good mirror: about 0.9"),
    "the MTL file's Ks where its illum is 3 or 5, else 0",
    "Share of the light that is mirrored, the same at every angle.",
);
static ROUGHNESS: Key<Number> = Key::optional(
    "roughness",
    Number::of(Range::SHARE, "").said("a number from 0 (a perfect mirror) to 1").hint("brushed metal: about 0.3"),
    "from the MTL file's Ns where its Ks counts, else 0",
    "Roughness of the mirror: 0 is a perfect one, above it is α of a GGX distribution of facets.",
);
static TRANSMITTANCE: Key<Channels> = Key::optional(
    "transmittance",
    Channels::of(Range::SHARE, "").hint("opal glass: about 0.5"),
    "0",
    "Share of the light that leaves the other side diffusely, by Lambert's law: blinds, opal glass.",
);
static SIDES: Key<OneOf<Sides>> = Key::optional(
    "sides",
    OneOf(&[("one", Sides::One), ("two", Sides::Two)]),
    "\"two\"",
    "Whether both sides are alike, or the back absorbs all light; the front is where vertices run counter-clockwise.",
);
static DIELECTRIC: Key<Inner<Dielectric>> = Key::optional(
    "dielectric",
    Inner { form: "{ ior = 1.5, absorption = 0.0 }", table: &GLASS, read: dielectric },
    "none",
    "A solid body of smooth clear glass that refracts light.",
);
static GLAZING: Key<Several<Glazing>> = Key::optional(
    "glazing",
    Several { unit: "", forms: PANE_FORM, tables: &[&PANE], read: glazing },
    "none",
    "A window pane drawn as one face: light passes straight on; a number is the transmittance at normal incidence.",
);

pub(super) static MATERIAL: Table = Table {
    head: "[material.NAME]",
    about: "What the faces do with light that an OBJ file gives this material (`usemtl NAME`). A name of other \
            characters than letters, digits, - and _ stands in quotes. What the section says wins over the MTL \
            file; what it leaves open, the \
            MTL file says. `[material.\"*\"]` speaks for all materials that have neither.",
    keys: &[&REFLECTANCE, &SPECULAR, &ROUGHNESS, &TRANSMITTANCE, &SIDES, &DIELECTRIC, &GLAZING],
    rules: &[
        "`reflectance` + `specular` + `transmittance` is at most 1 in each channel; the rest is absorbed.",
        "`dielectric` and `glazing` stand alone in their section: what glass reflects follows from them.",
        "`sides = \"one\"` and a `transmittance` above 0 exclude each other.",
        "The name is one that an OBJ file or its MTL file has.",
    ],
    example: "\
[material.floor]
reflectance = 0.2
specular = 0.04
roughness = 0.3

[material.blind]
reflectance = 0.5
transmittance = 0.2

[material.backdrop]
reflectance = [0.8, 0.7, 0.6]
sides = \"one\"

[material.window]
glazing = 0.88

[material.facade]
glazing = { transmittance = 0.6, reflectance = 0.15, curve = \"clear\" }

[material.lens]
dielectric = { ior = 1.5, absorption = [4.0, 1.0, 3.0] }

[material.\"*\"]
reflectance = 0.5
",
};

static IOR: Key<Number> = Key::needed(
    "ior",
    Number::of(Range::between(1.0, 10.0), "").said("a number from 1 to 10 (window glass: 1.5)"),
    "1.5",
    "Index of refraction relative to air; window glass has 1.5.",
);
static ABSORPTION: Key<Channels> = Key::optional(
    "absorption",
    Channels::of(Range::from(0.0), "1/m"),
    "0",
    "Absorption coefficient a of the glass: the share exp(−a d) of the light is left after d metres.",
);

static GLASS: Table = Table {
    head: "dielectric",
    about: "A solid of glass.",
    keys: &[&IOR, &ABSORPTION],
    rules: &["Closed faces make a solid; open sheets and flat slabs become panes (docs/FILES.md)."],
    example: "",
};

static PANE_TRANSMITTANCE: Key<Channels> = Key::needed_unless(
    "transmittance",
    Channels::of(Range::SHARE, ""),
    "that of curve at 0°; required where curve is \"clear\"",
    "0.88, that at normal incidence",
    "Share of the light that passes at normal incidence.",
);
static PANE_REFLECTANCE: Key<Channels> = Key::optional(
    "reflectance",
    Channels::of(Range::SHARE, ""),
    "that of clear glass of this transmittance",
    "Share of the light that is mirrored at normal incidence; it rises to 1 at grazing incidence.",
);
static CURVE: Key<Several<Curve>> = Key::optional(
    "curve",
    Several { unit: "°, 1", forms: CURVE_FORM, tables: &[], read: curve },
    "\"clear\"",
    "How the transmittance falls with the angle of incidence: as that of clear glass of index 1.5, as the 6 mm glass \
     of CIE 171:2006, or as measured.",
);

static PANE: Table = Table {
    head: "glazing",
    about: "A pane that is known better than by one number.",
    keys: &[&PANE_TRANSMITTANCE, &PANE_REFLECTANCE, &CURVE],
    rules: &[
        "`transmittance` + `reflectance` is at most 1 in each channel.",
        "Pairs of `curve` begin at 0° with a transmittance above 0, angles ascend; between pairs it is linear, \
         beyond the last it falls to 0 at 90°.",
    ],
    example: "",
};

const PANE_FORM: &str =
    "a number from 0 to 1, three as [r, g, b], or { transmittance = 0.88 } with reflectance and curve";
const CURVE_FORM: &str = "\"clear\", \"cie171\", or [angle, transmittance] pairs with angles from 0 up to 90, as in \
                          [[0, 0.8], [60, 0.65], [90, 0]]";
const OWN_REFLECTANCE: &str = "a pane has its own: glazing = { transmittance = 0.7, reflectance = 0.2 }";

/// Name of a material's section in messages.
pub(super) fn head(name: &str) -> String {
    format!("[material.{}]", plain(name))
}

pub(super) fn read(name: &str, section: &Section<'_>) -> Result<MaterialSection, InputError> {
    let reflectance = section.placed(&REFLECTANCE)?;
    let specular = section.placed(&SPECULAR)?;
    let transmittance = section.placed(&TRANSMITTANCE)?;
    let roughness = section.placed(&ROUGHNESS)?;
    let sides = section.get(&SIDES)?.unwrap_or_default();
    if sides == Sides::One && transmittance.as_ref().is_some_and(|part| part.value != [0.0; 3]) {
        let error = section.refusal(&SIDES, "\"two\" where there is a transmittance");
        return Err(error.hint("a sheet that light passes has two sides"));
    }
    let (dielectric, glazing) = (section.get(&DIELECTRIC)?, section.get(&GLAZING)?);
    if section.has(&DIELECTRIC) && section.len() > 1 {
        let error = section.refusal(&DIELECTRIC, "no other key beside it");
        return Err(error.hint("what glass reflects follows from its ior"));
    }
    if section.has(&GLAZING) && section.len() > 1 {
        return Err(section.refusal(&GLAZING, "no other key beside it").hint(OWN_REFLECTANCE));
    }
    let (name, at) = (name.to_owned(), section.at().clone());
    Ok(MaterialSection { name, at, reflectance, specular, roughness, transmittance, sides, dielectric, glazing })
}

fn dielectric(glass: &Section<'_>) -> Result<Dielectric, InputError> {
    let ior = glass.get(&IOR)?;
    let absorption = glass.get(&ABSORPTION)?.unwrap_or([0.0; 3]);
    Ok(Dielectric { ior: ior.ok_or_else(|| glass.missing(&IOR))?, absorption })
}

fn glazing(section: &Section<'_>, key: &str) -> Result<Option<Glazing>, InputError> {
    if !section.fields.has(key) {
        return Ok(None);
    }
    if !section.fields.is_table(key) {
        let share = section.fields.channels_within(key, PANE_FORM, |n| Range::SHARE.holds(n));
        return Ok(share.map_err(|error| error.hint("a clear pane: about 0.88"))?.map(|rgb| Glazing::clear(rgb.value)));
    }
    let Some(pane) = section.inner(key, PANE_FORM, &PANE)? else { return Ok(None) };
    let curve = pane.get(&CURVE)?.unwrap_or(Curve::Clear);
    let transmittance = pane.get(&PANE_TRANSMITTANCE)?.or_else(|| Some([curve.at_normal()?; 3]));
    let transmittance = transmittance.ok_or_else(|| pane.missing(&PANE_TRANSMITTANCE))?;
    let reflectance = pane.placed(&PANE_REFLECTANCE)?;
    let glazing = Glazing::new(transmittance, reflectance.as_ref().map(|share| share.value), curve);
    let sums = [0, 1, 2].map(|channel| glazing.transmittance[channel] + glazing.reflectance[channel]);
    match (sums.iter().find(|&&sum| sum > 1.0 + 1e-9), reflectance) {
        (Some(sum), Some(Placed { at, .. })) => {
            let found = format!("transmittance + reflectance = {sum} in {}", section.head());
            Err(InputError::new(at, found, "at most 1 in each channel"))
        }
        _ => Ok(Some(glazing)),
    }
}

/// How a pane's transmittance falls with the angle of incidence.
fn curve(pane: &Section<'_>, key: &str) -> Result<Option<Curve>, InputError> {
    let refusal = || pane.fields.refusal(key, CURVE_FORM);
    if !pane.fields.has(key) {
        return Ok(None);
    }
    if pane.fields.is_text(key) {
        return match pane.fields.text(key)?.as_ref().map(|word| word.value.as_str()) {
            Some("clear") => Ok(Some(Curve::Clear)),
            Some("cie171") => Ok(Some(Curve::Cie171)),
            _ => Err(refusal()),
        };
    }
    let Some(Placed { value: points, .. }) = pane.fields.pairs(key, CURVE_FORM, |n| (0.0..=90.0).contains(&n))? else {
        return Err(refusal());
    };
    let ascending = points.windows(2).all(|pair| pair[0][0] < pair[1][0]);
    let from_normal = points.first().is_some_and(|first| first[0] == 0.0 && first[1] > 0.0);
    if !ascending || !from_normal || points.iter().any(|point| point[1] > 1.0) {
        return Err(refusal());
    }
    Ok(Some(Curve::Table(points)))
}
