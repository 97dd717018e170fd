//! What a material is in the end: the scene file's word first, then the MTL's.

use super::fields::{Placed, listed, quoted};
use super::file::MaterialSection;
use super::material::{Dielectric, Material};
use super::mtl::MtlMaterial;
use crate::error::{InputError, Location};

/// A material, and the light its faces send out.
pub(crate) struct Surface {
    pub(crate) material: Material,
    /// cd/m² of each channel, where any is above 0.
    pub(crate) luminance: Option<[f64; 3]>,
}

/// The surface that scene file and MTL make of material `name` together; `None` if neither says what it reflects.
pub(crate) fn resolve(
    name: &str,
    section: Option<&MaterialSection>,
    mtl: Option<&MtlMaterial>,
    warnings: &mut Vec<String>,
) -> Result<Option<Surface>, InputError> {
    let luminance = mtl.map(|mtl| luminance(name, mtl)).transpose()?.flatten();
    let black = Material::black(name);
    let glass = match (section, mtl) {
        (Some(MaterialSection { dielectric: Some(glass), .. }), _) => Some(*glass),
        (Some(section), _) if section.reflectance.is_some() || section.specular.is_some() => None,
        (_, Some(mtl)) => glass(name, mtl, warnings)?,
        _ => None,
    };
    if glass.is_some() {
        return Ok(Some(Surface { material: Material { dielectric: glass, ..black }, luminance }));
    }

    let told = |part: Option<&Placed<[f64; 3]>>| part.map(|placed| (placed.value, placed.at.clone()));
    let diffuse = match told(section.and_then(|section| section.reflectance.as_ref())) {
        Some(reflectance) => Some(reflectance),
        None => {
            if let Some(texture) = mtl.and_then(|mtl| mtl.texture.as_ref()) {
                warnings.push(format!("{texture}: map_Kd of material {} left out; its Kd counts", quoted(name)));
            }
            mtl.and_then(|mtl| mtl.diffuse.as_ref()).map(|kd| share(name, "Kd", "reflectance", kd)).transpose()?
        }
    };
    // A section that speaks of a mirror and of nothing else means a mirror and nothing else.
    let only_mirror = || section?.specular.as_ref().map(|specular| ([0.0; 3], specular.at.clone()));
    let Some((reflectance, reflectance_at)) = diffuse.or_else(only_mirror) else { return Ok(None) };
    let mirror = match told(section.and_then(|section| section.specular.as_ref())) {
        Some(specular) => Some(specular),
        None => {
            let mirrors = mtl.filter(|mtl| matches!(mtl.illumination, Some(3 | 5)));
            mirrors.and_then(|mtl| mtl.specular.as_ref()).map(|ks| share(name, "Ks", "specular", ks)).transpose()?
        }
    };
    let specular = mirror.as_ref().map_or([0.0; 3], |mirror| mirror.0);
    let sums = [0, 1, 2].map(|channel| reflectance[channel] + specular[channel]);
    if let Some(&sum) = sums.iter().find(|&&sum| sum > 1.0 + 1e-9) {
        // Blame the scene file's line if there is one: that is where the user can mend it.
        let in_scene = section.is_some_and(|section| section.specular.is_none() && section.reflectance.is_some());
        let at = mirror.filter(|_| !in_scene).map_or(reflectance_at, |mirror| mirror.1);
        let found = format!("reflectance + specular = {sum} in material {}", quoted(name));
        return Err(InputError::new(at, found, "at most 1 in each channel"));
    }
    if luminance.is_some() && specular != [0.0; 3] {
        warnings.push(format!("material {} both shines and mirrors", quoted(name)));
    }
    Ok(Some(Surface { material: Material { reflectance, specular, ..black }, luminance }))
}

/// A share of light from the MTL, each channel from 0 to 1.
fn share(name: &str, key: &str, scene_key: &str, rgb: &Placed<[f64; 3]>) -> Result<([f64; 3], Location), InputError> {
    if rgb.value.iter().all(|channel| (0.0..=1.0).contains(channel)) {
        return Ok((rgb.value, rgb.at.clone()));
    }
    let [r, g, b] = rgb.value;
    let error = InputError::new(
        rgb.at.clone(),
        format!("{key} {r} {g} {b} in material {}", quoted(name)),
        "numbers from 0 to 1",
    );
    Err(error.hint(format!("{scene_key} in [material.{}] of the scene file overrides it", toml_key(name))))
}

/// Glass, if `illum` says so and something in the MTL lets light through or bends it.
fn glass(name: &str, mtl: &MtlMaterial, warnings: &mut Vec<String>) -> Result<Option<Dielectric>, InputError> {
    let ior = mtl.ior.as_ref().map_or(1.0, |ior| ior.value);
    if !matches!(mtl.illumination, Some(4 | 6 | 7)) || !(mtl.lets_light_through || ior > 1.0) {
        return Ok(None);
    }
    if let Some(placed) = mtl.ior.as_ref().filter(|_| !(1.0..=10.0).contains(&ior)) {
        let error =
            InputError::new(placed.at.clone(), format!("Ni {ior} in material {}", quoted(name)), "from 1 to 10");
        return Err(error.hint(format!("dielectric in [material.{}] of the scene file overrides it", toml_key(name))));
    }
    if mtl.ior.is_none() {
        warnings.push(format!("{}: glass {} without Ni taken for index 1: it bends nothing", mtl.at, quoted(name)));
    }
    if mtl.coloured_filter {
        warnings.push(format!("{}: Tf of glass {} left out; its glass is clear", mtl.at, quoted(name)));
    }
    Ok(Some(Dielectric { ior, absorption: 0.0 }))
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

/// Nothing says what these materials reflect.
pub(crate) fn unset(names: &[Placed<String>], missing_libraries: &[String]) -> InputError {
    let first = &names[0];
    let found = match names {
        [one] => format!("no reflectance for material {}", quoted(&one.value)),
        _ => format!("no reflectance for materials {}", listed(names.iter().map(|name| name.value.as_str()))),
    };
    let expected = "Kd in an MTL file, or a section in the scene file";
    let cure = format!("add [material.{}] with reflectance = 0.5, say", toml_key(&first.value));
    let hint = match missing_libraries {
        [] => cure,
        files => format!("{cure}; the MTL file {} is missing", listed(files.iter().map(String::as_str))),
    };
    InputError::new(first.at.clone(), found, expected).hint(hint)
}

/// A name as a key of TOML, in quotes only where it needs them.
fn toml_key(name: &str) -> String {
    let bare = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c));
    if bare { name.to_owned() } else { quoted(name) }
}
