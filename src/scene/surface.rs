//! What a material is in the end: the scene file's word first, then the MTL's.

use std::sync::Arc;

use super::dialect::{self, Remarks};
use super::fields::{Placed, section as section_of};
use super::file::MaterialSection;
use super::glazing::Glazing;
use super::inventory::{MaterialSource, Origin};
use super::material::{Dielectric, Material, Sides};
use super::mtl::MtlMaterial;
use crate::error::{InputError, Location};
use crate::text::quoted;

/// A material, and the light its faces send out.
pub(crate) struct Surface {
    pub(crate) material: Material,
    /// cd/m² of each channel, where any is above 0.
    pub(crate) luminance: Option<[f64; 3]>,
    /// What it is where the mesh has sheets of it and no closed body: only glass of an MTL file has it.
    pub(crate) as_sheet: Option<Arc<Glazing>>,
    /// Where it is from, and how it was read.
    pub(crate) origin: Origin,
}

/// The texture that colours material `name`, if the scene file doesn't say what the material reflects.
pub(crate) fn texture<'a>(
    section: Option<&MaterialSection>,
    mtl: Option<&'a MtlMaterial>,
) -> Option<&'a Placed<String>> {
    let told = section.is_some_and(|section| {
        section.reflectance.is_some() || section.dielectric.is_some() || section.glazing.is_some()
    });
    let clear = |mtl| says_nothing(section) && matches!(dialect::clear(mtl, &mut Remarks::default()), Ok(Some(_)));
    mtl.filter(|mtl| !(told || clear(mtl)))?.texture.as_ref()
}

/// Whether the scene file leaves it to the MTL what becomes of light.
fn says_nothing(section: Option<&MaterialSection>) -> bool {
    section.is_none_or(|section| {
        let told = [&section.reflectance, &section.specular, &section.transmittance];
        told.iter().all(|share| share.is_none()) && section.glazing.is_none() && section.dielectric.is_none()
    })
}

/// The surface that scene file and MTL make of material `name` together; `None` if neither says what it reflects.
/// `texture` is the mean colour of its texture, if that could be read.
pub(crate) fn resolve(
    name: &str,
    section: Option<&MaterialSection>,
    mtl: Option<&MtlMaterial>,
    texture: Option<[f64; 3]>,
    warnings: &mut Vec<String>,
) -> Result<Option<Surface>, InputError> {
    let luminance = mtl.map(|mtl| luminance(name, mtl)).transpose()?.flatten();
    let mut told = Remarks::default();
    let roughness = section.and_then(|section| section.roughness.as_ref()).filter(|roughness| roughness.value > 0.0);
    let made = match clear(name, section, mtl, &mut told)? {
        Some(made) => Some(made),
        None => opaque(name, section, mtl, texture, &mut told)?,
    };
    warnings.append(&mut told.warnings);
    let Some(ResolvedMaterial { material, as_sheet, source }) = made else { return Ok(None) };
    if let Some(placed) = roughness.filter(|_| !material.mirrors()) {
        let why = if material.is_clear() { "it is smooth glass" } else { "it mirrors nothing" };
        warnings.push(format!("{}: roughness of material {} left out; {why}", placed.at, quoted(name)));
    }
    if luminance.is_some() && (material.mirrors() || material.is_clear()) {
        let does = if material.mirrors() { "mirrors" } else { "lets light pass" };
        warnings.push(format!("material {} both shines and {does}", quoted(name)));
    }
    Ok(Some(Surface { material, luminance, as_sheet, origin: Origin { source, notes: told.notes } }))
}

/// What becomes of light at a material, and where that is from.
struct ResolvedMaterial {
    material: Material,
    as_sheet: Option<Arc<Glazing>>,
    source: MaterialSource,
}

/// Glass or glazing, if the material is that.
fn clear(
    name: &str,
    section: Option<&MaterialSection>,
    mtl: Option<&MtlMaterial>,
    told: &mut Remarks,
) -> Result<Option<ResolvedMaterial>, InputError> {
    let black = Material::black(name);
    if let Some(section) = section.filter(|section| section.dielectric.is_some() || section.glazing.is_some()) {
        let glazing = section.glazing.clone().map(Arc::new);
        let material = Material { dielectric: section.dielectric, glazing, ..black };
        return Ok(Some(ResolvedMaterial { material, as_sheet: None, source: MaterialSource::Scene }));
    }
    let Some(mtl) = mtl.filter(|_| says_nothing(section)) else { return Ok(None) };
    let Some(clear) = dialect::clear(mtl, told)? else { return Ok(None) };
    let pane = Some(Arc::new(Glazing::clear(clear.transmittance)));
    let (material, as_sheet) = match clear.ior {
        Some(ior) => (Material { dielectric: Some(Dielectric { ior, absorption: [0.0; 3] }), ..black }, pane),
        None => (Material { glazing: pane, ..black }, None),
    };
    Ok(Some(ResolvedMaterial { material, as_sheet, source: MaterialSource::Mtl }))
}

/// A surface that light doesn't pass straight; `None` if nothing is said of it.
fn opaque(
    name: &str,
    section: Option<&MaterialSection>,
    mtl: Option<&MtlMaterial>,
    texture: Option<[f64; 3]>,
    told: &mut Remarks,
) -> Result<Option<ResolvedMaterial>, InputError> {
    let word = |part: fn(&MaterialSection) -> &Option<Placed<[f64; 3]>>| part(section?).as_ref().map(LightShare::told);
    let (mirror, sheet) = (word(|section| &section.specular), word(|section| &section.transmittance));
    let diffuse = match word(|section| &section.reflectance) {
        Some(reflectance) => Some(reflectance),
        None => mtl.map(|mtl| kd(name, mtl, texture)).transpose()?.flatten(),
    };
    // A section that speaks of a mirror or a sheet and of nothing else means that and nothing else.
    let nothing_else = || mirror.as_ref().or(sheet.as_ref()).map(|part| LightShare { value: [0.0; 3], ..part.clone() });
    let Some(mut diffuse) = diffuse.or_else(nothing_else) else { return Ok(None) };
    let mirror = match (mirror, mtl) {
        (None, Some(mtl)) => mtl_mirror(mtl, &mut diffuse, sheet.as_ref(), told)?,
        (mirror, _) => mirror,
    };
    let share = |part: &Option<LightShare>| part.as_ref().map_or([0.0; 3], |part| part.value);
    let (reflectance, specular, transmittance) = (diffuse.value, share(&mirror), share(&sheet));
    let sums = [0, 1, 2].map(|channel| reflectance[channel] + specular[channel] + transmittance[channel]);
    let words = [Some(&diffuse), mirror.as_ref(), sheet.as_ref()];
    let source = MaterialSource::of(words.map(|part| part.map(|part| part.told)));
    let of_ns = mtl.filter(|_| mirror.as_ref().is_some_and(|mirror| !mirror.told)).map(dialect::roughness);
    if let Some(&sum) = sums.iter().find(|&&sum| sum > 1.0 + 1e-9) {
        let sheets = if sheet.is_some() { " + transmittance" } else { "" };
        let found = format!("reflectance + specular{sheets} = {sum} in material {}", quoted(name));
        let at = LightShare::to_blame([Some(diffuse), mirror, sheet]);
        return Err(InputError::new(at, found, "at most 1 in each channel"));
    }
    let roughness = section.and_then(|section| section.roughness.as_ref()).map(|roughness| roughness.value).or(of_ns);
    let material = Material {
        reflectance,
        specular,
        roughness: roughness.filter(|_| specular != [0.0; 3]).unwrap_or(0.0),
        transmittance,
        sides: section.map_or(Sides::Two, |section| section.sides),
        ..Material::black(name)
    };
    Ok(Some(ResolvedMaterial { material, as_sheet: None, source }))
}

/// `Kd`, times the colour of a texture; without `Kd` that counts as it is.
fn kd(name: &str, mtl: &MtlMaterial, texture: Option<[f64; 3]>) -> Result<Option<LightShare>, InputError> {
    let kd = mtl.diffuse.as_ref().map(|kd| LightShare::of_mtl(name, "Kd", "reflectance", kd)).transpose()?;
    Ok(match (kd, mtl.texture.as_ref().zip(texture)) {
        (Some(kd), Some((_, colour))) => Some(kd.times(colour)),
        (None, Some((at, colour))) => Some(LightShare { value: colour, at: at.at.clone(), told: false }),
        (kd, None) => kd,
    })
}

/// What an MTL file's word makes a mirror of: `Ks`, or `diffuse` where it is a metal.
fn mtl_mirror(
    mtl: &MtlMaterial,
    diffuse: &mut LightShare,
    sheet: Option<&LightShare>,
    told: &mut Remarks,
) -> Result<Option<LightShare>, InputError> {
    if let Some(metal) = dialect::metal(mtl).filter(|_| !diffuse.told) {
        told.notes.push(format!("a metal of Blender's: {metal} of Kd mirrors, as rough as Ns; Ks left out"));
        let mirror = diffuse.clone().times([metal; 3]);
        diffuse.value = diffuse.value.map(|share| share * (1.0 - metal));
        return Ok(Some(mirror));
    }
    let Some(ks) = mtl.specular.as_ref().filter(|_| dialect::mirrors(mtl)) else { return Ok(None) };
    let mirror = LightShare::of_mtl(&mtl.name, "Ks", "specular", ks)?;
    let most = (0..3).map(|c| diffuse.value[c] + mirror.value[c] + sheet.map_or(0.0, |sheet| sheet.value[c]));
    let most = most.fold(0.0, f64::max);
    if most <= 1.0 + 1e-9 {
        if mirror.value != [0.0; 3] {
            told.notes.push(format!("illum {}: Ks mirrors", mtl.illumination.unwrap_or(0)));
        }
        return Ok(Some(mirror));
    }
    let diffusely = if diffuse.told { "reflectance" } else { "Kd" };
    let sum = (1e6 * most).round() / 1e6;
    let [r, g, b] = diffuse.value.map(|share| (1e4 * share).round() / 1e4);
    let colour = if r == g && g == b { r.to_string() } else { format!("[{r}, {g}, {b}]") };
    let alpha = (1e3 * dialect::roughness(mtl)).round() / 1e3;
    told.warnings.push(format!(
        "{}: {diffusely} + Ks = {sum} in material {}, more light than arrives: Ks taken for a highlight and left out; for a \
         metal write reflectance = 0, specular = {colour}, roughness = {alpha} in {}",
        ks.at,
        quoted(&mtl.name),
        section_of(&mtl.name),
    ));
    told.notes.push(format!("{diffusely} + Ks = {sum}: Ks left out"));
    Ok(None)
}

/// A share of light, and where it is from.
#[derive(Clone)]
struct LightShare {
    value: [f64; 3],
    at: Location,
    /// Whether it is the scene file's word.
    told: bool,
}

impl LightShare {
    fn told(part: &Placed<[f64; 3]>) -> Self {
        Self { value: part.value, at: part.at.clone(), told: true }
    }

    /// A share from the MTL, each channel from 0 to 1.
    fn of_mtl(name: &str, key: &str, scene_key: &str, rgb: &Placed<[f64; 3]>) -> Result<Self, InputError> {
        if rgb.value.iter().all(|channel| (0.0..=1.0).contains(channel)) {
            return Ok(Self { value: rgb.value, at: rgb.at.clone(), told: false });
        }
        let [r, g, b] = rgb.value;
        let found = format!("{key} {r} {g} {b} in material {}", quoted(name));
        let error = InputError::new(rgb.at.clone(), found, "numbers from 0 to 1");
        Err(error.hint(format!("{scene_key} in {} of the scene file overrides it", section_of(name))))
    }

    fn times(self, colour: [f64; 3]) -> Self {
        Self { value: [0, 1, 2].map(|channel| self.value[channel] * colour[channel]), ..self }
    }

    /// Of shares that add up to too much, the place of the last; in the scene file, if any is: there the user can
    /// correct it.
    fn to_blame(parts: [Option<Self>; 3]) -> Location {
        let mut all: Vec<&Self> = parts.iter().flatten().filter(|part| part.value != [0.0; 3]).collect();
        all.sort_by_key(|part| part.told);
        let last = all.last();
        last.expect("a sum above 0 has a part above 0").at.clone()
    }
}

/// What is said of a texture that can't be read.
pub(crate) fn unread(name: &str, texture: &Placed<String>, mtl: &MtlMaterial, why: &str) -> String {
    let (at, file) = (&texture.at, quoted(&texture.value));
    let instead = if mtl.diffuse.is_some() { "its Kd counts; " } else { "" };
    let cure = format!("reflectance in {} overrides it", section_of(name));
    format!("{at}: map_Kd {file} of material {} left out ({why}); {instead}{cure}", quoted(name))
}

/// `Ke`, where it is above 0.
fn luminance(name: &str, mtl: &MtlMaterial) -> Result<Option<[f64; 3]>, InputError> {
    let Some(ke) = &mtl.emissive else { return Ok(None) };
    if ke.value.iter().all(|channel| (0.0..=1e15).contains(channel)) {
        return Ok((ke.value != [0.0; 3]).then_some(ke.value));
    }
    let [r, g, b] = ke.value;
    let found = format!("Ke {r} {g} {b} in material {}", quoted(name));
    Err(InputError::new(ke.at.clone(), found, "numbers from 0 up, cd/m²"))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::mtl;
    use super::*;

    fn resolved(lines: &str) -> Surface {
        let mtl = mtl::parse(Path::new("a.mtl"), format!("newmtl a\n{lines}\n").as_bytes()).expect("an MTL file");
        resolve("a", None, Some(&mtl[0]), None, &mut Vec::new()).expect("sound").expect("said")
    }

    /// Glass of an MTL file is a pane of 1 − d, times Tf, where the mesh has sheets of it: at most 12/13, as n = 1.5
    /// lets pass.
    #[test]
    fn glass_knows_what_it_is_as_a_sheet() {
        for (lines, share) in [
            ("Ni 1.5\nd 0.3\nillum 9", [0.7; 3]),
            ("Ni 1.5\nd 0.5\nTf 1 0.5 0.25\nillum 4", [0.5, 0.25, 0.125]),
            ("Ni 1.5\nillum 7", [12.0 / 13.0; 3]),
        ] {
            let surface = resolved(lines);
            assert!(surface.material.dielectric.is_some() && surface.material.glazing.is_none(), "{lines}");
            let sheet = surface.as_sheet.expect("a pane");
            for (found, expected) in sheet.transmittance.iter().zip(share) {
                assert!((found - expected).abs() < 1e-12, "{lines}: {found}");
            }
        }
        assert!(resolved("Kd 0.5\nd 0.3").as_sheet.is_none(), "a pane already");
    }
}
