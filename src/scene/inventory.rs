//! What a scene is made of, for people to check: its materials with their areas, and what looks wrong about its meshes.

mod mesh;
mod unit;

use std::collections::HashMap;
use std::ops::Range;
use std::path::PathBuf;

use glam::DVec3;

pub use mesh::MeshCheck;
pub(crate) use mesh::{mixed, place_key};
pub(crate) use unit::unit_in_doubt;

use super::{Material, Scene, Sides};
use crate::luminaire::Opening;

/// Where a material is from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MaterialSource {
    /// A section of the scene file.
    #[default]
    Scene,
    /// An MTL file.
    Mtl,
    /// The scene file where it speaks, an MTL file for the rest.
    SceneAndMtl,
    /// What is said of every material that nothing else speaks of.
    Default,
    /// luxmap itself: the bodies of luminaires.
    Luminaire,
}

impl MaterialSource {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scene => "scene file",
            Self::Mtl => "MTL",
            Self::SceneAndMtl => "scene file, MTL",
            Self::Default => "default",
            Self::Luminaire => "luminaire",
        }
    }

    /// Of parts each of which, where there is one, is the scene file's word or not.
    pub(crate) fn of<const N: usize>(parts: [Option<bool>; N]) -> Self {
        match (parts.contains(&Some(true)), parts.contains(&Some(false))) {
            (true, true) => Self::SceneAndMtl,
            (_, false) => Self::Scene,
            (false, true) => Self::Mtl,
        }
    }
}

/// Where a material comes from, and what was made of what is said there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Origin {
    /// Who says what it is.
    pub source: MaterialSource,
    /// Remarks, such as what was left out.
    pub notes: Vec<String>,
}

/// A mesh file in a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshPart {
    /// The file.
    pub file: PathBuf,
    /// Its unit, m.
    pub metres_per_unit: f64,
    /// Lowest and highest corner of the box around it in the world, m.
    pub bounds: [DVec3; 2],
    /// Its triangles in [`Scene::mesh`].
    pub triangles: Range<usize>,
    /// Triangles left out because they have no area.
    pub flat: usize,
    /// Triangles left out because another lies there the same way round.
    pub repeated: usize,
    /// Triangles left out because they are the back of another.
    pub backs: usize,
}

impl MeshPart {
    /// Its size along world x, y and z, m.
    pub fn size(&self) -> DVec3 {
        self.bounds[1] - self.bounds[0]
    }
}

/// A material of a scene, with all its faces.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialUse {
    /// What it is.
    pub material: Material,
    /// Where it is from.
    pub origin: Origin,
    /// Area of its faces, m², one side.
    pub area: f64,
    /// Number of its triangles.
    pub triangles: usize,
    /// What its faces send out, lm, if they shine.
    pub flux: Option<f64>,
}

/// What a scene is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Inventory {
    /// The materials that have faces, the largest area first.
    pub materials: Vec<MaterialUse>,
    /// The mesh files, in the scene file's order.
    pub meshes: Vec<MeshCheck>,
}

impl Inventory {
    /// Looks through a whole scene. Cost: O(n log n) of its triangles, by all threads.
    pub fn of(scene: &Scene) -> Self {
        let meshes = scene.parts.iter().map(|part| MeshCheck::of(part, scene)).collect();
        Self { materials: materials(scene), meshes }
    }
}

fn materials(scene: &Scene) -> Vec<MaterialUse> {
    let mut sums = vec![(0.0_f64, 0_usize); scene.materials.len()];
    for (triangle, &material) in scene.mesh.material_of.iter().enumerate() {
        let [a, b, c] = scene.mesh.corners(triangle);
        let sum = &mut sums[material as usize];
        *sum = (sum.0 + (b - a).cross(c - a).length() / 2.0, sum.1 + 1);
    }
    let mut flux: HashMap<&str, f64> = HashMap::new();
    for luminaire in &scene.luminaires {
        if matches!(luminaire.opening, Opening::Triangles(_)) {
            *flux.entry(&luminaire.group).or_default() += luminaire.flux.0;
        }
    }
    let mut all: Vec<MaterialUse> = scene
        .materials
        .iter()
        .zip(&scene.origins)
        .zip(sums)
        .filter(|(_, (_, triangles))| *triangles > 0)
        .map(|((material, origin), (area, triangles))| MaterialUse {
            flux: flux.get(front_name(material)).copied(),
            material: material.clone(),
            origin: origin.clone(),
            area,
            triangles,
        })
        .collect();
    all.sort_by(|one, other| other.area.total_cmp(&one.area).then_with(|| one.material.name.cmp(&other.material.name)));
    all
}

/// The name of its front alone: what shines goes by it.
fn front_name(material: &Material) -> &str {
    let back = material.back.as_ref().and_then(|back| material.name.strip_suffix(back.name.as_str()));
    back.and_then(|name| name.strip_suffix(" / ")).unwrap_or(&material.name)
}

/// What a material does with light, in words, as `luxmap plan` shows it.
pub fn what_it_is(material: &Material) -> String {
    let mut parts = Vec::new();
    if let Some(glass) = material.dielectric {
        parts.push(format!("glass n {}", three(glass.ior)));
        if glass.absorption != [0.0; 3] {
            parts.push(format!("absorbs {} /m", rgb(glass.absorption)));
        }
    } else if let Some(pane) = &material.glazing {
        parts.push(format!("glazing τ {}", rgb(pane.transmittance)));
        parts.push(format!("mirrors {}", rgb(pane.reflectance)));
    } else if material.is_black() {
        parts.push("ρ 0".to_owned());
    } else {
        if material.reflectance != [0.0; 3] || !material.mirrors() {
            parts.push(format!("ρ {}", rgb(material.reflectance)));
        }
        if material.mirrors() {
            parts.push(format!("mirrors {}", rgb(material.specular)));
            if material.roughness > 0.0 {
                parts.push(format!("rough {}", three(material.roughness)));
            }
        }
        if material.is_translucent() {
            parts.push(format!("τ {}", rgb(material.transmittance)));
        }
    }
    if let Some(back) = &material.back {
        parts.push(format!("back: {}", what_it_is(back)));
    } else if material.sides == Sides::One {
        parts.push("back black".to_owned());
    }
    parts.join(", ")
}

fn rgb([r, g, b]: [f64; 3]) -> String {
    if r == g && g == b { three(r) } else { [r, g, b].map(three).join(" ") }
}

/// At most three places behind the point.
fn three(x: f64) -> String {
    ((1e3 * x).round() / 1e3).to_string()
}
