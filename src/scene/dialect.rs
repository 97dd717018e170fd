//! What programs mean by the materials of their MTL files.
//!
//! `illum` alone says little: Maya writes `illum 4` and `Tf 1 1 1` for everything (its `Tf` is the opposite of what the
//! format says), 3ds Max `illum 4` beside `d 1`, Blender `illum 9` or 2 for glass, and some write `Tr` as `d`. So what
//! counts is what is physically said, all of it together:
//!
//! | said | means |
//! |---|---|
//! | `d` < 1 or `Tr` > 0 | light passes: (1 − `d`) × `Tf`; `d` counts where `Tr` contradicts it |
//! | … and `illum` 4, 6, 7 or 9 with `Ni` > 1 | glass of that index; a sheet of it is a pane |
//! | neither `d` nor `Tr`, but such an `illum` and `Ni` | the same, passing `Tf` |
//! | `Tf` alone, or `illum` alone | nothing: opaque |
//! | `Tr 1` alone | opaque: programs that write `Tr` as `d` |
//! | `illum` 3 or 5 with `Ks` | a mirror of that share, as rough as `Ns` says: GGX α = √(2/(`Ns` + 2)) |
//! | `Kd` + `Ks` > 1 | `Ks` is a highlight, and left out |
//! | `illum` 3 from Blender | a metal: of `Kd` the share `Ka` is mirrored, `Ns` = 1000 (1 − roughness)², α = roughness² |

use super::fields::{Placed, section};
use super::mtl::MtlMaterial;
use crate::error::InputError;
use crate::text::quoted;

/// What is said about a reading: all of it in the plan, guesses also as warnings.
#[derive(Default)]
pub(crate) struct Remarks {
    /// Short remarks.
    pub(crate) notes: Vec<String>,
    /// Whole sentences with their place.
    pub(crate) warnings: Vec<String>,
}

impl Remarks {
    fn note(&mut self, note: impl Into<String>) {
        self.notes.push(note.into());
    }

    /// A guess about a material that a section of the scene file can overrule by `cure`.
    fn guess(&mut self, mtl: &MtlMaterial, said: &str, taken: &str, cure: &str) {
        let (name, section) = (quoted(&mtl.name), section(&mtl.name));
        self.warnings.push(format!("{}: {said} in material {name}: {taken}; {cure} in {section} overrides it", mtl.at));
        self.notes.push(format!("{said}: {taken}"));
    }
}

/// A material that light passes without being scattered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Clear {
    /// Share of each channel that a sheet of it passes at normal incidence.
    pub(crate) transmittance: [f64; 3],
    /// Index of refraction, where a body of it refracts.
    pub(crate) ior: Option<f64>,
}

/// What is said of transparency.
struct Sayings {
    /// `illum` 4, 6, 7 or 9: light is refracted.
    refracts: bool,
    /// `Ni`, where it bends light.
    ior: Option<f64>,
    /// Share that passes by `d` or `Tr`, where either is given.
    through: Option<f64>,
    /// `Tf`, where each part is from 0 to 1.
    filter: Option<[f64; 3]>,
}

/// How light passes a material, if it does.
pub(crate) fn clear(mtl: &MtlMaterial, told: &mut Remarks) -> Result<Option<Clear>, InputError> {
    let refracts = matches!(mtl.illumination, Some(4 | 6 | 7 | 9));
    let bends = |ior: &f64| *ior > 1.0 || ior.is_nan(); // what is no number is refused below
    let ior = mtl.ior.as_ref().map(|ior| ior.value).filter(bends);
    let filter = mtl.filter.as_ref().map(|filter| filter.value);
    let filter = filter.filter(|filter| filter.iter().all(|part| (0.0..=1.0).contains(part)));
    let sayings = Sayings { refracts, ior, through: through(mtl, refracts && ior.is_some(), told)?, filter };
    if let Some(file) = &mtl.cut_out {
        let said = format!("map_d {}", quoted(&file.value));
        told.guess(mtl, &said, "left out, and what it cuts away stays", "glazing or reflectance");
    }
    let Some(passed) = passed(mtl, &sayings, told) else { return Ok(None) };
    if let Some((ior, placed)) = sayings.ior.zip(mtl.ior.as_ref()).filter(|(ior, _)| !(1.0..=10.0).contains(ior)) {
        let found = format!("Ni {ior} in material {}", quoted(&mtl.name));
        let error = InputError::new(placed.at.clone(), found, "from 1 to 10");
        return Err(error.hint(format!("dielectric in {} of the scene file overrides it", section(&mtl.name))));
    }
    if let Some(ior) = mtl.ior.as_ref().map(|ior| ior.value).filter(|ior| *ior < 1.0) {
        told.guess(mtl, &format!("Ni {ior}"), "no glass has that index, so it is a sheet", "dielectric");
    }
    let most = sayings.ior.map_or(1.0, |ior| {
        let face = ((ior - 1.0) / (ior + 1.0)).powi(2);
        (1.0 - face) / (1.0 + face)
    });
    match (&mtl.diffuse, mtl.specular.as_ref().filter(|specular| specular.value != [0.0; 3])) {
        (Some(_), Some(_)) => told.note("Kd and Ks left out"),
        (Some(_), None) => told.note("Kd left out"),
        (None, Some(_)) => told.note("Ks left out"),
        (None, None) => {}
    }
    Ok(Some(Clear { transmittance: passed.map(|share| share.min(most)), ior: sayings.ior.filter(|_| refracts) }))
}

/// The share that `d` or `Tr` lets pass. `glass`: whether `illum` and `Ni` say that light is refracted.
fn through(mtl: &MtlMaterial, glass: bool, told: &mut Remarks) -> Result<Option<f64>, InputError> {
    let share = |key: &str, placed: &Option<Placed<f64>>| {
        let Some(Placed { value, at }) = placed else { return Ok(None) };
        // Programs round.
        if (-1e-3..=1.001).contains(value) {
            return Ok(Some(value.clamp(0.0, 1.0)));
        }
        let found = format!("{key} {value} in material {}", quoted(&mtl.name));
        let error = InputError::new(at.clone(), found, "a number from 0 to 1");
        Err(error.hint(format!("glazing or reflectance in {} of the scene file overrides it", section(&mtl.name))))
    };
    let cure = "glazing";
    Ok(match (share("d", &mtl.dissolve)?, share("Tr", &mtl.transparency)?) {
        (Some(d), Some(tr)) => {
            let said = format!("d {d} and Tr {tr}");
            if d == 1.0 && tr == 1.0 {
                told.note(format!("{said}: opaque, Tr is written as d"));
            } else if (tr - (1.0 - d)).abs() > 0.01 {
                told.guess(mtl, &said, &format!("d counts, and {} passes", rounded(1.0 - d)), cure);
            }
            Some(1.0 - d)
        }
        (Some(d), None) => Some(1.0 - d),
        (None, Some(1.0)) if !glass => {
            told.guess(mtl, "Tr 1 without d", "opaque, as programs mean it that write Tr as d", cure);
            Some(0.0)
        }
        (None, Some(tr)) => {
            if tr > 0.0 {
                told.guess(
                    mtl,
                    &format!("Tr {tr} without d"),
                    "the share that passes; some programs write d there",
                    cure,
                );
            }
            Some(tr)
        }
        (None, None) => None,
    })
}

/// The share of each channel that all keys together let pass, if any.
fn passed(mtl: &MtlMaterial, sayings: &Sayings, told: &mut Remarks) -> Option<[f64; 3]> {
    let &Sayings { refracts, ior, through, filter } = sayings;
    let (glass, illum) = (refracts && ior.is_some(), mtl.illumination.unwrap_or(0));
    let coloured = filter.filter(|filter| *filter != [1.0; 3]);
    let tf = coloured.map_or(String::new(), |[r, g, b]| format!("Tf {r} {g} {b}"));
    match (through, coloured) {
        (Some(share), _) if share > 0.0 => {
            let what = if glass { format!("illum {illum}, Ni {}", ior.unwrap_or(1.0)) } else { "a clear sheet".into() };
            match coloured {
                Some([0.0, 0.0, 0.0]) => {
                    let taken = format!("Tf left out, and {} passes", rounded(share));
                    told.guess(mtl, &format!("{tf} beside 1 - d = {}", rounded(share)), &taken, "glazing");
                    Some([share; 3])
                }
                Some(filter) => {
                    told.note(format!("{what}: (1 - d) Tf passes"));
                    Some(filter.map(|part| part * share))
                }
                None => {
                    told.note(format!("{what}: 1 - d passes"));
                    Some([share; 3])
                }
            }
        }
        (_, Some(filter)) if glass && filter != [0.0; 3] => {
            if through.is_some() {
                told.guess(mtl, &format!("illum {illum} and {tf} beside d 1"), "glass that passes Tf", "reflectance");
            } else {
                told.note(format!("illum {illum}, Ni {}: glass that passes Tf", ior.unwrap_or(1.0)));
            }
            Some(filter)
        }
        (None, None) if glass => {
            told.note(format!("illum {illum}, Ni {}: clear glass", ior.unwrap_or(1.0)));
            Some([1.0; 3])
        }
        // The opposite of what the format says is what Maya writes.
        (None, Some([r, ..])) => {
            let cure = format!("glazing = {} or {}", rounded(r), rounded(1.0 - r));
            told.guess(mtl, &format!("{tf} without d"), "opaque, since programs mean opposite things by Tf", &cure);
            None
        }
        (Some(_), _) if glass && illum != 4 => {
            told.guess(mtl, &format!("illum {illum} and Ni beside d 1"), "opaque", "dielectric or glazing");
            None
        }
        _ => {
            if refracts {
                told.note(format!("illum {illum}, but neither d < 1 nor Tr > 0: opaque"));
            }
            None
        }
    }
}

/// As people write it.
fn rounded(share: f64) -> f64 {
    (1e6 * share).round() / 1e6
}

/// A metal of Blender's: the share of `Kd` that it mirrors.
pub(crate) fn metal(mtl: &MtlMaterial) -> Option<f64> {
    (mtl.by_blender && mtl.illumination == Some(3)).then(|| mtl.ambient.unwrap_or(1.0).clamp(0.0, 1.0))
}

/// Whether `illum` says that `Ks` mirrors.
pub(crate) fn mirrors(mtl: &MtlMaterial) -> bool {
    matches!(mtl.illumination, Some(3 | 5))
}

/// GGX's α of what mirrors: 0 where nothing is said of the highlight's width.
pub(crate) fn roughness(mtl: &MtlMaterial) -> f64 {
    let alpha = |exponent: f64| {
        if mtl.by_blender {
            (1.0 - (exponent / 1000.0).min(1.0).sqrt()).powi(2)
        } else {
            (2.0 / (exponent + 2.0)).sqrt()
        }
    };
    mtl.exponent.filter(|exponent| *exponent >= 0.0).map_or(0.0, alpha)
}
