//! Triangles, materials and what shines, put together from meshes and luminaires.

use std::collections::{BTreeSet, HashMap};

use glam::DVec3;
use rayon::prelude::*;

use super::Material;
use super::double_faces::{Becomes, DoubleFaces, Faces};
use super::fixture::Fixture;
use super::inventory::{MaterialSource, MeshPart, Origin, unit_in_doubt};
use super::measured::SurfaceSection;
use super::read::PlacedMesh;
use super::surface::Surface;
use crate::geometry::mesh::{Bounds, Mesh};
use crate::geometry::polygon::has_area;
use crate::luminaire::{Distribution, Luminaire, Opening, Supply, colour};
use crate::units::{self, Lumens};

/// The parts of a scene that share one list of triangles, local coordinates.
#[derive(Default)]
pub(super) struct Parts {
    pub(super) centre: DVec3,
    pub(super) mesh: Mesh,
    pub(super) materials: Vec<Material>,
    /// Who says what each of them is.
    pub(super) origins: Vec<Origin>,
    pub(super) files: Vec<MeshPart>,
    /// Those of a name.
    numbers: HashMap<String, Vec<u32>>,
    pub(super) luminaires: Vec<Luminaire>,
    /// Material of the luminaires' bodies, once there is one.
    black: Option<u32>,
    /// Triangles of each measured surface, and whether they are measured from behind what it says.
    pub(super) chosen: Vec<Vec<(u32, bool)>>,
}

/// Faces of one mesh that emit.
pub(super) struct EmittingFaces {
    material: String,
    /// cd/m².
    luminance: [f64; 3],
    triangles: Vec<[DVec3; 3]>,
    /// The same, as numbers of the scene's triangles.
    numbers: Vec<u32>,
}

impl Parts {
    /// Nothing yet, of a scene with its origin at `centre`, where so many surfaces are measured.
    pub(super) fn about(centre: DVec3, surfaces: usize) -> Self {
        Self { centre, chosen: vec![Vec::new(); surfaces], ..Default::default() }
    }

    fn add_material(&mut self, material: Material, origin: Origin) -> u32 {
        let alike = self.numbers.entry(material.name.clone()).or_default();
        if let Some(&known) = alike.iter().find(|&&number| self.materials[number as usize] == material) {
            let notes = &mut self.origins[known as usize].notes;
            origin.notes.into_iter().for_each(|note| {
                if !notes.contains(&note) {
                    notes.push(note)
                }
            });
            return known;
        }
        let number = u32::try_from(self.materials.len()).expect("a file of 16 GiB names fewer than 4e9 materials");
        alike.push(number);
        self.materials.push(material);
        self.origins.push(origin);
        number
    }

    /// Adds vertices, with room behind them for one more, as Embree wants it. Returns the number of the first.
    fn add_vertices(&mut self, vertices: &[DVec3]) -> u32 {
        let first = u32::try_from(self.mesh.vertices.len()).expect("fewer than 4e9 vertices: memory ends before");
        self.mesh.vertices.reserve(vertices.len() + 1);
        self.mesh.vertices.par_extend(vertices.par_iter().map(|vertex| vertex.as_vec3().to_array()));
        first
    }

    /// Adds a mesh; what of it shines goes to `emitters`.
    pub(super) fn add_mesh(
        &mut self,
        mesh: PlacedMesh,
        measured: &[SurfaceSection],
        emitters: &mut Vec<EmittingFaces>,
        warnings: &mut Vec<String>,
    ) {
        let chosen: Vec<Vec<usize>> = measured.iter().map(|section| mesh.chosen(section)).collect();
        let PlacedMesh {
            path, mut vertices, mut triangles, mut material_of, surfaces, left_out, metres_per_unit, ..
        } = mesh;
        let (centre, file) = (self.centre, path.display().to_string());
        let bounds = Bounds::around_all(&vertices).map_or([DVec3::ZERO; 2], |bounds| [bounds.least, bounds.most]);
        let doubt = unit_in_doubt(&file, (bounds[1] - bounds[0]).to_array(), metres_per_unit);
        warnings.extend(doubt.filter(|doubt| !warnings.contains(doubt)));
        vertices.par_iter_mut().for_each(|vertex| *vertex -= centre);
        let first = self.add_vertices(&vertices);
        drop(vertices);
        if first > 0 {
            triangles.par_iter_mut().flatten().for_each(|vertex| *vertex += first);
        }
        let add = |surface: &Surface| self.add_material(surface.material.clone(), surface.origin.clone());
        let numbers: Vec<u32> = surfaces.iter().map(add).collect();
        let is_flat = |&index: &usize| !has_area(self.corners(&triangles[index]));
        let flat: Vec<usize> = (0..triangles.len()).into_par_iter().filter(is_flat).collect();
        let faces = Faces {
            vertices: &self.mesh.vertices,
            triangles: &triangles,
            material_of: &material_of,
            surfaces: &surfaces,
            flat: &flat,
        };
        let doubles = faces.single(&file, warnings);
        let kept = KeptTriangles { left_out: merged(&flat, &doubles.left_out), before: self.mesh.triangles.len() };

        // What is measured or shines: most triangles of most scenes do neither.
        for (of_surface, chosen) in chosen.iter().zip(&mut self.chosen) {
            kept.choose(of_surface, &doubles.backs, chosen);
        }
        emitters.extend(self.shining(&surfaces, &triangles, &material_of, &kept));
        let without_area = flat.len() - left_out;
        self.files.push(MeshPart {
            file: path,
            metres_per_unit,
            bounds,
            triangles: kept.before..kept.before + triangles.len() - kept.left_out.len(),
            flat: without_area,
            repeated: doubles.repeated,
            backs: doubles.left_out.len() - doubles.repeated,
        });
        self.number_materials(&mut material_of, &numbers, doubles);
        self.add_triangles(triangles, material_of, &kept);
        if without_area > 0 {
            let triangles = if without_area == 1 { "1 triangle" } else { &format!("{without_area} triangles") };
            warnings.push(format!("{file}: {triangles} without area left out"));
        }
    }

    /// Corners as rounded: what rays will meet.
    fn corners(&self, triangle: &[u32; 3]) -> [DVec3; 3] {
        triangle.map(|vertex| DVec3::from(self.mesh.vertices[vertex as usize].map(f64::from)))
    }

    /// What shines of a mesh.
    fn shining(
        &self,
        surfaces: &[Surface],
        triangles: &[[u32; 3]],
        material_of: &[u32],
        kept: &KeptTriangles,
    ) -> impl Iterator<Item = EmittingFaces> + use<> {
        let mut shining: Vec<Option<EmittingFaces>> = surfaces.iter().map(EmittingFaces::of).collect();
        if shining.iter().any(Option::is_some) {
            for index in (0..triangles.len()).filter(|&index| kept.stays(index)) {
                if let Some(emitter) = &mut shining[material_of[index] as usize] {
                    emitter.triangles.push(self.corners(&triangles[index]));
                    emitter.numbers.push(kept.number(index));
                }
            }
        }
        shining.into_iter().flatten().filter(|emitter| !emitter.triangles.is_empty())
    }

    /// Turns numbers of a mesh's materials, which are `numbers` in the scene, into the scene's.
    fn number_materials(&mut self, material_of: &mut [u32], numbers: &[u32], doubles: DoubleFaces) {
        material_of.par_iter_mut().for_each(|material| *material = numbers[*material as usize]);
        let add = |(material, origin)| self.add_material(material, origin);
        let two_sided: Vec<u32> = doubles.two_sided.into_iter().map(add).collect();
        for (&[front, _], becomes) in doubles.backs.iter().zip(&doubles.becomes) {
            material_of[front as usize] = match *becomes {
                Becomes::Own(surface) => numbers[surface as usize],
                Becomes::TwoSided(material) => two_sided[material as usize],
            };
        }
    }

    /// Adds the triangles of a mesh that are kept.
    fn add_triangles(&mut self, mut triangles: Vec<[u32; 3]>, mut material_of: Vec<u32>, kept: &KeptTriangles) {
        without(&mut triangles, &kept.left_out);
        without(&mut material_of, &kept.left_out);
        // The first mesh, most often the only one, is taken as it is.
        if self.mesh.triangles.is_empty() {
            (self.mesh.triangles, self.mesh.material_of) = (triangles, material_of);
        } else {
            self.mesh.triangles.append(&mut triangles);
            self.mesh.material_of.append(&mut material_of);
        }
    }

    /// The opening of a luminaire is also a thing in the way of light, and black.
    /// Returns its triangles.
    pub(super) fn add_body(&mut self, fixture: &Fixture) -> Vec<u32> {
        let (corners, triangles) = fixture.body();
        if triangles.is_empty() {
            return Vec::new();
        }
        let black = match self.black {
            Some(black) => black,
            None => {
                let origin = Origin { source: MaterialSource::Luminaire, notes: Vec::new() };
                self.add_material(Material::black("luminaire opening"), origin)
            }
        };
        self.black = Some(black);
        let first = self.add_vertices(&corners);
        let before = self.mesh.triangles.len() as u32;
        self.mesh.material_of.extend(triangles.iter().map(|_| black));
        self.mesh.triangles.extend(triangles.into_iter().map(|triangle| triangle.map(|corner| first + corner)));
        (before..self.mesh.triangles.len() as u32).collect()
    }

    pub(super) fn add_emitters(&mut self, emitters: Vec<EmittingFaces>) {
        let mut names: BTreeSet<String> = self.luminaires.iter().map(|luminaire| luminaire.name.clone()).collect();
        for emitter in emitters {
            // Meshes may share a material's name: the second lamp is "lamp (2)", its light group is "lamp" all the
            // same.
            let mut name = emitter.material.clone();
            for number in 2.. {
                if names.insert(name.clone()) {
                    break;
                }
                name = format!("{} ({number})", emitter.material);
            }
            self.luminaires.push(emitter.luminaire(name));
        }
    }
}

/// The triangles of a mesh file that become the scene's.
struct KeptTriangles {
    /// Those that don't, ascending.
    left_out: Vec<usize>,
    /// Triangles that the scene had before.
    before: usize,
}

impl KeptTriangles {
    /// Number in the scene of a triangle of the file.
    fn number(&self, index: usize) -> u32 {
        (self.before + index - self.left_out.partition_point(|&out| out < index)) as u32
    }

    fn stays(&self, index: usize) -> bool {
        self.left_out.is_empty() || self.left_out.binary_search(&index).is_err()
    }

    /// Adds a file's part of a measured surface, ascending, to its triangles; `backs` are triangles and the ones that
    /// were behind them.
    fn choose(&self, of_surface: &[usize], backs: &[[u32; 2]], chosen: &mut Vec<(u32, bool)>) {
        let own = chosen.len();
        let fronts = of_surface.iter().filter(|&&index| self.stays(index));
        chosen.extend(fronts.map(|&index| (self.number(index), false)));
        // Faces that are the back of others now are measured there, unless their fronts are measured already.
        let is_in = |index: u32| of_surface.binary_search(&(index as usize)).is_ok();
        let behind = backs.iter().filter(|&&[front, back]| is_in(back) && !is_in(front));
        chosen.extend(behind.map(|&[front, _]| (self.number(front as usize), true)));
        chosen[own..].sort_unstable();
    }
}

/// Both lists, ascending; they have nothing in common.
fn merged(one: &[usize], other: &[usize]) -> Vec<usize> {
    let mut all = [one, other].concat();
    all.sort_unstable();
    all
}

/// Takes the items of some places, ascending, out of a list.
fn without<T>(items: &mut Vec<T>, places: &[usize]) {
    if places.is_empty() {
        return;
    }
    let (mut index, mut places) = (0, places.iter().peekable());
    items.retain(|_| {
        let out = places.next_if(|&&place| place == index).is_some();
        index += 1;
        !out
    });
}

impl EmittingFaces {
    fn of(surface: &Surface) -> Option<Self> {
        let luminance = surface.luminance?;
        Some(Self { material: surface.material.name.clone(), luminance, triangles: Vec::new(), numbers: Vec::new() })
    }

    /// A Lambertian surface of luminance L and area A sends out Φ = π L A.
    fn luminaire(self, name: String) -> Luminaire {
        let area: f64 = self.triangles.iter().map(|&[a, b, c]| (b - a).cross(c - a).length() / 2.0).sum();
        Luminaire {
            name,
            group: self.material,
            flux: Lumens(std::f64::consts::PI * units::luminance(self.luminance) * area),
            colour: colour::normalised(self.luminance),
            opening: Opening::Triangles(self.triangles),
            distribution: Distribution::Lambertian,
            body: self.numbers,
            supply: Supply::default(),
        }
    }
}
