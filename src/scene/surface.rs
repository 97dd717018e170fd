//! What a material is in the end: the scene file's word first, then the MTL's.

use std::sync::Arc;

use super::fields::{Placed, quoted, toml_key};
use super::file::MaterialSection;
use super::material::{Dielectric, Material, Sides};
use super::mtl::MtlMaterial;
use crate::error::{InputError, Location};

/// A material, and the light its faces send out.
pub(crate) struct Surface {
    pub(crate) material: Material,
    /// cd/m² of each channel, where any is above 0.
    pub(crate) luminance: Option<[f64; 3]>,
}

/// The texture that colours material `name`, if the scene file doesn't say what the material reflects.
pub(crate) fn texture<'a>(
    section: Option<&MaterialSection>,
    mtl: Option<&'a MtlMaterial>,
) -> Option<&'a Placed<String>> {
    let told = section.is_some_and(|section| {
        section.reflectance.is_some() || section.dielectric.is_some() || section.glazing.is_some()
    });
    let glass = |mtl: &MtlMaterial| mtl.is_glass() && says_nothing(section);
    mtl.filter(|mtl| !(told || glass(mtl)))?.texture.as_ref()
}

/// Whether the scene file leaves it to the MTL what becomes of light.
fn says_nothing(section: Option<&MaterialSection>) -> bool {
    section.is_none_or(|section| {
        let told = [&section.reflectance, &section.specular, &section.transmittance];
        told.iter().all(|share| share.is_none()) && section.glazing.is_none()
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
    let black = Material::black(name);
    if let Some(pane) = section.and_then(|section| section.glazing.clone()) {
        return Ok(Some(Surface { material: Material { glazing: Some(Arc::new(pane)), ..black }, luminance }));
    }
    let glass = match (section, mtl) {
        (Some(MaterialSection { dielectric: Some(glass), .. }), _) => Some(*glass),
        (section, Some(mtl)) if says_nothing(section) => glass(name, mtl, warnings)?,
        _ => None,
    };
    let roughness = section.and_then(|section| section.roughness.as_ref()).filter(|roughness| roughness.value > 0.0);
    let mut no_mirror = |why: &str| {
        let left_out = |r: &Placed<f64>| format!("{}: roughness of material {} left out; {why}", r.at, quoted(name));
        warnings.extend(roughness.map(left_out));
    };
    if glass.is_some() {
        no_mirror("it is smooth glass");
        return Ok(Some(Surface { material: Material { dielectric: glass, ..black }, luminance }));
    }

    let told = |part: fn(&MaterialSection) -> &Option<Placed<[f64; 3]>>| part(section?).as_ref().map(Part::told);
    let (mirror, sheet) = (told(|section| &section.specular), told(|section| &section.transmittance));
    let diffuse = match told(|section| &section.reflectance) {
        Some(reflectance) => Some(reflectance),
        None => {
            let kd = mtl.and_then(|mtl| mtl.diffuse.as_ref());
            let kd = kd.map(|kd| Part::of_mtl(name, "Kd", "reflectance", kd)).transpose()?;
            match (kd, mtl.and_then(|mtl| mtl.texture.as_ref()).zip(texture)) {
                (Some(kd), Some((_, colour))) => Some(kd.times(colour)),
                // Without Kd the texture counts as it is.
                (None, Some((at, colour))) => Some(Part { value: colour, at: at.at.clone(), told: false }),
                (kd, None) => kd,
            }
        }
    };
    // A section that speaks of a mirror or a sheet and of nothing else means that and nothing else.
    let nothing_else = || mirror.as_ref().or(sheet.as_ref()).map(|part| Part { value: [0.0; 3], ..part.clone() });
    let Some(diffuse) = diffuse.or_else(nothing_else) else { return Ok(None) };
    let mirror = match mirror {
        Some(mirror) => Some(mirror),
        None => {
            let mirrors = mtl.filter(|mtl| matches!(mtl.illumination, Some(3 | 5)));
            let ks = mirrors.and_then(|mtl| mtl.specular.as_ref());
            ks.map(|ks| Part::of_mtl(name, "Ks", "specular", ks)).transpose()?
        }
    };
    let share = |part: &Option<Part>| part.as_ref().map_or([0.0; 3], |part| part.value);
    let (reflectance, specular, transmittance) = (diffuse.value, share(&mirror), share(&sheet));
    let sums = [0, 1, 2].map(|channel| reflectance[channel] + specular[channel] + transmittance[channel]);
    if let Some(&sum) = sums.iter().find(|&&sum| sum > 1.0 + 1e-9) {
        let sheets = if sheet.is_some() { " + transmittance" } else { "" };
        let found = format!("reflectance + specular{sheets} = {sum} in material {}", quoted(name));
        let at = Part::to_blame([Some(diffuse), mirror, sheet]);
        return Err(InputError::new(at, found, "at most 1 in each channel"));
    }
    if specular == [0.0; 3] {
        no_mirror("it mirrors nothing");
    }
    if luminance.is_some() && specular != [0.0; 3] {
        warnings.push(format!("material {} both shines and mirrors", quoted(name)));
    }
    let material = Material {
        reflectance,
        specular,
        roughness: roughness.map_or(0.0, |roughness| roughness.value),
        transmittance,
        sides: section.map_or(Sides::Two, |section| section.sides),
        ..black
    };
    Ok(Some(Surface { material, luminance }))
}

/// A share of light, and who says so.
#[derive(Clone)]
struct Part {
    value: [f64; 3],
    at: Location,
    /// Whether it is the scene file's word.
    told: bool,
}

impl Part {
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
        Err(error.hint(format!("{scene_key} in [material.{}] of the scene file overrides it", toml_key(name))))
    }

    fn times(self, colour: [f64; 3]) -> Self {
        Self { value: [0, 1, 2].map(|channel| self.value[channel] * colour[channel]), ..self }
    }

    /// Of shares that add up to too much, the place of the last; in the scene file, if any is: there the user can mend it.
    fn to_blame(parts: [Option<Self>; 3]) -> Location {
        let mut all: Vec<&Self> = parts.iter().flatten().filter(|part| part.value != [0.0; 3]).collect();
        all.sort_by_key(|part| part.told);
        let last = all.last();
        last.expect("a sum above 0 has a part above 0").at.clone()
    }
}

/// Glass, if the MTL says so.
fn glass(name: &str, mtl: &MtlMaterial, warnings: &mut Vec<String>) -> Result<Option<Dielectric>, InputError> {
    if !mtl.is_glass() {
        return Ok(None);
    }
    let ior = mtl.ior.as_ref().map_or(1.0, |ior| ior.value);
    let section = || format!("[material.{}]", toml_key(name));
    if let Some(placed) = mtl.ior.as_ref().filter(|_| !(1.0..=10.0).contains(&ior)) {
        let error =
            InputError::new(placed.at.clone(), format!("Ni {ior} in material {}", quoted(name)), "from 1 to 10");
        return Err(error.hint(format!("dielectric in {} of the scene file overrides it", section())));
    }
    if mtl.ior.is_none() {
        warnings.push(format!("{}: glass {} without Ni taken for index 1: it bends nothing", mtl.at, quoted(name)));
    }
    if mtl.coloured_filter {
        let name = quoted(name);
        let cure = format!("its glass is clear; dielectric in {} gives it an absorption per metre", section());
        warnings.push(format!("{}: Tf of glass {name} left out, since it belongs to no thickness; {cure}", mtl.at));
    }
    Ok(Some(Dielectric { ior, absorption: [0.0; 3] }))
}

/// What is said of a texture that can't be read.
pub(crate) fn unread(name: &str, texture: &Placed<String>, mtl: &MtlMaterial, why: &str) -> String {
    let (at, file) = (&texture.at, quoted(&texture.value));
    let instead = if mtl.diffuse.is_some() { "its Kd counts; " } else { "" };
    let cure = format!("reflectance in [material.{}] overrides it", toml_key(name));
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
