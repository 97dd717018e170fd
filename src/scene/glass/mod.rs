//! What the meshes of a `dielectric` are in space: solids, panes, or neither.
//!
//! Snell's law needs to know which side of a face is glass. A closed body tells; a window drawn as one face doesn't,
//! and would be a half-space of glass. So the faces of each glass are looked at by connected parts:
//!
//! - A **closed body** is a solid. One that is inside out is turned, unless it is a cavity of a solid of the same
//!   glass.
//! - A **thin flat slab** (no thicker than 1/20 of its side, 0.1 m at most), or two opposite faces of one without its
//!   rim, is a pane: one sheet in the middle that lets through what both faces and the glass between them do. It is
//!   displaced light that is given up (by at most a third of the thickness up to 60°); direct light behind it becomes
//!   exact.
//! - An **open sheet** is a pane, as thick as window glass where its absorption asks for that.
//! - Faces that are panes already, by `glazing` or by the MTL, are looked at too: a slab of them is one pane, not two.
//! - A body with a hole, or one whose faces can't be given one winding, is refused.

mod parts;

use std::collections::{HashMap, HashSet};
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use self::parts::{GlassPart, PartKind};
use super::Material;
use super::fields::{Placed, section};
use super::glazing::Glazing;
use super::material::Dielectric;
use super::surface::Surface;
use crate::error::InputError;
use crate::text::quoted;

/// Thickness of a sheet that absorbs per metre, m: window glass.
const WINDOW: f64 = 0.006;

/// A mesh whose glass is to be settled.
pub(crate) struct GlassMesh<'a> {
    pub(crate) vertices: &'a mut Vec<DVec3>,
    pub(crate) triangles: &'a mut [[u32; 3]],
    pub(crate) material_of: &'a mut [u32],
    pub(crate) surfaces: &'a mut Vec<Surface>,
}

/// Makes panes of sheets and slabs, and turns solids that are inside out; says so in `warnings`. Triangles that a pane
/// has no use for lose their area; returns how many. `names` tells where the materials of the mesh at `path` are first
/// used.
pub(crate) fn settle(
    path: &Path,
    names: &[Placed<String>],
    mut faces: GlassMesh<'_>,
    warnings: &mut Vec<String>,
) -> Result<usize, InputError> {
    let glasses: Vec<usize> =
        (0..faces.surfaces.len()).filter(|&number| faces.surfaces[number].material.is_clear()).collect();
    let mut left_out = 0;
    for number in glasses {
        let of_this = |&triangle: &usize| faces.material_of[triangle] as usize == number;
        let chosen: Vec<u32> =
            (0..faces.triangles.len()).into_par_iter().filter(of_this).map(|triangle| triangle as u32).collect();
        let parts = parts::parts(faces.vertices, faces.triangles, &chosen);
        let refracts = faces.surfaces[number].material.dielectric.is_some();
        if let Some((why, at)) = parts.iter().find_map(GlassPart::refused).filter(|_| refracts) {
            return Err(refusal(&names[number], why, at));
        }
        let mut told = PartCounts::default();
        for part in &parts {
            told.hear(part, refracts);
            left_out += faces.make(number, part);
        }
        let (path, name) = (path.display().to_string(), &names[number].value);
        warnings.extend(told.warnings(&path, name, faces.pane_of(number)));
        warnings.extend(faces.unfiltered(number).filter(|_| told.solids > 0).map(|ior| told.clear(&path, name, ior)));
        faces.note(number, told.notes());
        faces.tidy(number, &chosen);
    }
    Ok(left_out)
}

fn refusal(name: &Placed<String>, why: &str, at: DVec3) -> InputError {
    let DVec3 { x, y, z } = at;
    let found = format!("glass {} with {why}, near ({x:.3}, {y:.3}, {z:.3}) m", quoted(&name.value));
    let error = InputError::new(name.at.clone(), found, "closed bodies, or open sheets");
    error.hint(format!("close it, or write glazing = 0.88 in {}: thin panes", section(&name.value)))
}

impl GlassPart {
    fn refused(&self) -> Option<(&'static str, DVec3)> {
        match self.kind {
            PartKind::Refused(why, at) => Some((why, at)),
            _ => None,
        }
    }
}

impl GlassMesh<'_> {
    /// Makes a pane of a part of glass number `glass`, if it is one; returns how many of its triangles that leaves out.
    fn make(&mut self, glass: usize, part: &GlassPart) -> usize {
        let PartKind::Pane { kept, shift, thickness } = &part.kind else { return 0 };
        let pane = self.pane(glass, *thickness);
        let stays: HashSet<u32> = kept.iter().copied().collect();
        for triangle in part.triangles.iter().filter(|triangle| !stays.contains(triangle)) {
            let corner = self.triangles[*triangle as usize][0];
            self.triangles[*triangle as usize] = [corner; 3];
            self.material_of[*triangle as usize] = pane;
        }
        let mut moved: HashMap<u32, u32> = HashMap::new();
        for &triangle in kept {
            self.material_of[triangle as usize] = pane;
            if *shift == DVec3::ZERO {
                continue;
            }
            for corner in &mut self.triangles[triangle as usize] {
                *corner = *moved.entry(*corner).or_insert_with(|| {
                    self.vertices.push(self.vertices[*corner as usize] + *shift);
                    self.vertices.len() as u32 - 1
                });
            }
        }
        part.triangles.len() - kept.len()
    }

    /// Number of the surface that is glass number `glass` as a pane.
    fn pane(&mut self, glass: usize, thickness: Option<f64>) -> u32 {
        let Surface { material, luminance, as_sheet, origin } = &self.surfaces[glass];
        let Some(dielectric) = material.dielectric else { return glass as u32 };
        let glazing = as_sheet.clone().unwrap_or_else(|| Arc::new(between_faces(dielectric, thickness)));
        let material = Material { glazing: Some(glazing), ..Material::black(material.name.clone()) };
        let alike = self.surfaces.iter().position(|surface| surface.material == material);
        let number = alike.unwrap_or(self.surfaces.len());
        if alike.is_none() {
            let (luminance, origin) = (*luminance, origin.clone());
            self.surfaces.push(Surface { material, luminance, as_sheet: None, origin });
        }
        number as u32
    }

    /// The first pane that was made of a glass.
    fn pane_of(&self, glass: usize) -> Option<&Glazing> {
        let name = &self.surfaces[glass].material.name;
        let alike = self.surfaces.iter().filter(|surface| surface.material.name == *name);
        alike.filter_map(|surface| surface.material.glazing.as_deref()).next()
    }

    /// Index of a glass that filters light as a sheet, by its MTL, and not as a body.
    fn unfiltered(&self, glass: usize) -> Option<f64> {
        let Surface { material, as_sheet: Some(sheet), .. } = &self.surfaces[glass] else { return None };
        let ior = material.dielectric?.ior;
        let clear = Glazing::of_index(ior, [1.0; 3]).transmittance;
        (0..3).any(|c| sheet.transmittance[c] < clear[c] - 1e-9).then_some(ior)
    }

    /// Adds to what is said of the panes of a glass.
    fn note(&mut self, glass: usize, notes: Vec<String>) {
        let name = self.surfaces[glass].material.name.clone();
        let is_pane = |surface: &&mut Surface| surface.material.name == name && surface.material.glazing.is_some();
        for surface in self.surfaces.iter_mut().filter(is_pane) {
            surface.origin.notes.extend(notes.iter().cloned());
        }
    }

    /// Where no solid of a glass is left, what it was is forgotten: the scene has no use for it.
    fn tidy(&mut self, glass: usize, chosen: &[u32]) {
        let solid = chosen.iter().any(|&triangle| self.material_of[triangle as usize] as usize == glass);
        let pane =
            chosen.iter().map(|&triangle| self.material_of[triangle as usize]).find(|&pane| pane as usize != glass);
        if let (false, Some(pane)) = (solid, pane) {
            let Surface { material, origin, .. } = &self.surfaces[pane as usize];
            let (material, origin) = (material.clone(), origin.clone());
            (self.surfaces[glass].material, self.surfaces[glass].origin) = (material, origin);
        }
    }
}

/// The pane that glass of this thickness (m) between two faces is.
fn between_faces(glass: Dielectric, thickness: Option<f64>) -> Glazing {
    let metres = thickness.unwrap_or(WINDOW);
    Glazing::of_index(glass.ior, glass.absorption.map(|per_metre| (-per_metre * metres).exp()))
}

/// How many parts of a glass are what.
#[derive(Default)]
struct PartCounts {
    solids: usize,
    /// Those of the solids that were inside out.
    turned: usize,
    sheets: usize,
    slabs: usize,
    thinnest: f64,
    thickest: f64,
}

impl PartCounts {
    fn hear(&mut self, part: &GlassPart, refracts: bool) {
        match part.kind {
            PartKind::Turned => {
                self.solids += 1;
                self.turned += usize::from(refracts);
            }
            PartKind::Pane { thickness: None, .. } => self.sheets += usize::from(refracts),
            PartKind::Pane { thickness: Some(thickness), .. } => {
                self.thinnest = if self.slabs == 0 { thickness } else { self.thinnest.min(thickness) };
                self.thickest = self.thickest.max(thickness);
                self.slabs += 1;
            }
            PartKind::Solid => self.solids += 1,
            PartKind::Refused(..) => {}
        }
    }

    /// What is a guess.
    fn warnings(&self, path: &str, name: &str, pane: Option<&Glazing>) -> Vec<String> {
        let (glass, section) = (quoted(name), section(name));
        let passes = pane.map_or_else(String::new, |pane| {
            let [r, g, b] = pane.transmittance;
            if r == g && g == b { format!("{r:.3}") } else { format!("[{r:.3}, {g:.3}, {b:.3}]") }
        });
        let mut lines = Vec::new();
        if self.turned > 0 {
            let bodies = count(self.turned, "body", "bodies");
            lines.push(format!("{path}: {bodies} of glass {glass} inside out: turned, normals outwards"));
        }
        if self.sheets > 0 {
            let sheets = count(self.sheets, "open sheet", "open sheets");
            lines.push(format!(
                "{path}: {sheets} of glass {glass}, no solid: taken for thin panes that pass {passes}; glazing = … in {section} \
                 tells another share"
            ));
        }
        lines
    }

    /// That solids of a glass don't filter light as its sheets do.
    fn clear(&self, path: &str, name: &str, ior: f64) -> String {
        let (bodies, glass, section) = (count(self.solids, "body", "bodies"), quoted(name), section(name));
        format!(
            "{path}: {bodies} of glass {glass} taken for clear glass of index {ior}: d and Tf belong to no thickness; dielectric in \
             {section} gives it an absorption per metre"
        )
    }

    /// What the plan says of panes.
    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if self.sheets > 0 {
            notes.push(format!("{}: panes", count(self.sheets, "open sheet", "open sheets")));
        }
        if self.slabs > 0 {
            let [from, to] = [self.thinnest, self.thickest].map(|metres| format!("{:.1}", 1e3 * metres));
            let thick = if from == to { from } else { format!("{from} to {to}") };
            notes.push(format!("{} of {thick} mm: panes", count(self.slabs, "slab", "slabs")));
        }
        notes
    }
}

fn count(number: usize, one: &str, more: &str) -> String {
    if number == 1 { format!("1 {one}") } else { format!("{number} {more}") }
}
