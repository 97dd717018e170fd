//! From the scene file and the files it names to a [`Scene`].

use std::collections::{BTreeSet, HashMap};
use std::fs::{self, File};
use std::io::{self, Read, Seek};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;
use sha2::{Digest, Sha256};

use super::double_faces::{Becomes, Faces};
use super::emitters;
use super::fallback::Fallback;
use super::fields::{Placed, closest};
use super::file::{MaterialSection, MeshSection, SceneFile};
use super::fixture::{self, Fixture};
use super::glass;
use super::inventory::{MeshPart, Origin, Source, unit_in_doubt};
use super::library::{Library, check_names, unset};
use super::measured::{self, Groups, SurfaceSection};
use super::obj::Obj;
use super::obj::foreign::{self, HEAD};
use super::obj::large::CUT;
use super::placed::surroundings;
use super::surface::{self, Surface};
use super::texture;
use super::{Material, MeasuringPlane, Scene};
use crate::error::{Error, InputError, Location, OptionError};
use crate::files;
use crate::files::limits::{LARGEST_OBJ, LARGEST_SCENE, LARGEST_TEXTURE, Reach};
use crate::geometry::mesh::{Bounds, Mesh};
use crate::geometry::polygon::has_area;
use crate::luminaire::{Distribution, Luminaire, Opening, Supply, colour};
use crate::scene::Levels;
use crate::text::listed;
use crate::text::quoted;
use crate::units::{self, Lumens};

/// From this size on, bytes, an OBJ file is read in blocks and by all threads.
const LARGE_OBJ: u64 = 16 << 20;

impl Scene {
    /// Reads a scene file (TOML) and the meshes it names, checks them, and moves everything to the middle of its
    /// bounding box. Any mistake is refused in one line that says where it is, what is found there and what was expected.
    ///
    /// The files it names lie in its own folder or below; see [`limits`](super::limits).
    pub fn load(path: &Path) -> Result<Self, Error> {
        Self::load_with(path, &[], &Dimming::AsWritten)
    }

    /// The same, where files may also lie in the folders `include`, or below; with luminaires dimmed otherwise than the file
    /// has them.
    ///
    /// # Errors
    /// As [`Scene::load`]; also where a level is given to a luminaire that the scene doesn't have.
    pub fn load_with(path: &Path, include: &[PathBuf], dimming: &Dimming) -> Result<Self, Error> {
        let options = LoadOptions { include: include.to_vec(), dimming: dimming.clone(), reflectance: None };
        Self::load_as(path, &options)
    }

    /// The same, with all that the command line may add to a scene file.
    ///
    /// # Errors
    /// As [`Scene::load_with`]; also where the reflectance is none.
    pub fn load_as(path: &Path, options: &LoadOptions) -> Result<Self, Error> {
        if let Some(reflectance) = options.reflectance.filter(|rgb| !rgb.iter().all(|n| (0.0..=1.0).contains(n))) {
            let (found, expected) = (format!("{reflectance:?}"), "numbers from 0 to 1".into());
            return Err(OptionError::Value { option: "reflectance", found, expected }.into());
        }
        Ok(load(path, options)?)
    }
}

/// What is said of a scene beside its file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Folders whose files the scene may name, besides its own.
    pub include: Vec<PathBuf>,
    /// At which levels its luminaires are.
    pub dimming: Dimming,
    /// What those materials reflect by Lambert's law of which neither a section of the scene nor an MTL file says it: before
    /// what `[material."*"]` says of them. Part of the scene's hash.
    pub reflectance: Option<[f64; 3]>,
}

/// At which levels luminaires are.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Dimming {
    /// As the scene file has them.
    #[default]
    AsWritten,
    /// All at full output.
    Full,
    /// At these; those not named as the scene file has them.
    Levels(Levels),
}

impl Dimming {
    /// The level of a luminaire that the file has at `written`.
    pub(crate) fn level(&self, name: &str, written: f64) -> f64 {
        match self {
            Self::AsWritten => written,
            Self::Full => 1.0,
            Self::Levels(levels) => levels.of.get(name).copied().unwrap_or(written),
        }
    }

    /// What becomes part of the scene's hash: levels that the file doesn't hold.
    fn words(&self) -> String {
        match self {
            Self::AsWritten => String::new(),
            Self::Full => "full".to_owned(),
            Self::Levels(levels) => format!("{:?}", levels.of),
        }
    }

    /// Refuses levels of luminaires that are not there.
    fn check(&self, known: &BTreeSet<&str>) -> Result<(), InputError> {
        let Self::Levels(levels) = self else { return Ok(()) };
        let Some(stranger) = levels.of.keys().find(|name| !known.contains(name.as_str())) else { return Ok(()) };
        let expected = format!("one of {}", listed(known.iter().copied()));
        let error = InputError::new(levels.place(stranger), format!("luminaire {}", quoted(stranger)), expected);
        Err(match closest(stranger, known.iter().copied()) {
            Some(near) => error.hint(format!("did you mean {}?", quoted(near))),
            None => error,
        })
    }
}

impl Scene {
    /// The same scene with other levels of those luminaires that are not off. What a file says is not asked again.
    ///
    /// # Errors
    /// Where a level is given to a luminaire that isn't there or is off, or none shines any more.
    pub(crate) fn dimmed(mut self, dimming: &Dimming) -> Result<Self, InputError> {
        dimming.check(&self.luminaires.iter().map(|luminaire| luminaire.name.as_str()).collect())?;
        for luminaire in &mut self.luminaires {
            let before = luminaire.supply.level;
            let level = dimming.level(&luminaire.name, before);
            luminaire.flux.0 *= level / before;
            luminaire.supply.level = level;
        }
        self.luminaires.retain(|luminaire| luminaire.flux.0 > 0.0);
        if self.luminaires.is_empty() {
            let at = Location::file(&self.file);
            return Err(InputError::new(at, "every luminaire dimmed to 0", "one that shines"));
        }
        let words = dimming.words();
        if !words.is_empty() {
            let digest = Sha256::new().chain_update(&self.hash).chain_update(words).finalize();
            self.hash = digest.iter().map(|byte| format!("{byte:02x}")).collect();
        }
        Ok(self)
    }
}

/// Why a file that is named can't be read, though it may be there.
pub(super) const OUTSIDE: &str = "it lies outside the scene's folder";
/// What to do about that.
const INCLUDE: &str = "--include DIR allows files of another folder";

fn load(path: &Path, options: &LoadOptions) -> Result<Scene, InputError> {
    let mut reader = Reader::new(path, HashMap::new(), options);
    let bytes = files::read(path, LARGEST_SCENE)
        .map(|bytes| reader.hashed(bytes))
        .map_err(|error| files::why(&error))
        .map_err(|why| InputError::new(Location::file(path), format!("no scene ({why})"), "a scene file in TOML"))?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let line =
            error.as_bytes()[..error.utf8_error().valid_up_to()].iter().filter(|&&byte| byte == b'\n').count() + 1;
        InputError::new(Location::line(path, line), "bytes that are no UTF-8", "text in UTF-8")
    })?;
    assemble(path, &text, reader, options)
}

/// A scene of no file but those in `memory`, which its text names.
pub(super) fn from_text(
    path: &Path,
    text: &str,
    memory: HashMap<PathBuf, Vec<u8>>,
    options: &LoadOptions,
) -> Result<Scene, InputError> {
    let mut reader = Reader::new(path, memory, options);
    reader.hash.update(text.as_bytes());
    assemble(path, text, reader, options)
}

fn assemble(path: &Path, text: &str, mut reader: Reader, options: &LoadOptions) -> Result<Scene, InputError> {
    let LoadOptions { dimming, reflectance, .. } = options;
    let file = SceneFile::parse(path, text)?;
    reader.fallback = Fallback::of(&file.materials, *reflectance);
    let meshes = reader.meshes(path, &file)?;
    let lamps = reader.lamps(path, &file)?;
    let fixtures = fixture::spread(&file.luminaires, &lamps, dimming)?;

    let mesh_bounds = meshes.iter().map(|mesh| Bounds::around_all(&mesh.vertices)).fold(None, Bounds::joined);
    let bounds = world_bounds(mesh_bounds, &fixtures, &file);
    let near = surroundings(&meshes, &fixtures, &file, bounds);
    let centre = near.origin(bounds);

    let chosen = vec![Vec::new(); file.surfaces.len()];
    let mut parts = Parts { centre, chosen, ..Default::default() };
    let mut emitters = Vec::new();
    for mut mesh in meshes {
        mesh.cut_large(&near);
        parts.add_mesh(mesh, &file.surfaces, &mut emitters, &mut reader.warnings);
    }
    // An opening mounted flush with a ceiling shares its plane, and which of the two a ray then meets is arbitrary: a
    // seed office with such panels read 0.8 … 1.1 % too bright on the floor. So body and opening move together, along the
    // aim: by 36 µm in a room of 7 m, whatever lies about it, which is some 150 steps of f32 there, and nothing to the
    // illuminance.
    let shift = near.shift(bounds);
    for fixture in &fixtures {
        let fixture = fixture.shifted(shift, centre);
        let body = parts.add_body(&fixture);
        if fixture.lamp.flux * fixture.level > 0.0 {
            parts.luminaires.push(fixture.luminaire(body));
        }
    }
    let fixtures_shine = parts.luminaires.len();
    parts.add_emitters(emitters);
    let shining = parts.luminaires.iter().map(|luminaire| luminaire.name.as_str());
    dimming.check(&shining.chain(fixtures.iter().map(|fixture| fixture.name.as_str())).collect())?;
    for luminaire in &mut parts.luminaires[fixtures_shine..] {
        luminaire.supply.level = dimming.level(&luminaire.name, 1.0);
        luminaire.flux.0 *= file.maintenance.unwrap_or(1.0) * luminaire.supply.level;
    }
    parts.luminaires.retain(|luminaire| luminaire.flux.0 > 0.0);
    let maintenance_factor = maintenance(&file, &fixtures, parts.luminaires.len() > fixtures_shine);
    if parts.luminaires.is_empty() {
        let found = if file.luminaires.is_empty() { "nothing that shines" } else { "every luminaire dimmed to 0" };
        let expected = "a [[luminaire]], or a material with Ke in an MTL file";
        return Err(InputError::new(Location::file(path), found, expected));
    }
    let mut warnings = reader.warnings;
    warnings.extend(reader.fallback.as_ref().and_then(Fallback::told));
    emitters::warn(&parts.luminaires, &parts.mesh, &parts.materials, &mut warnings);
    if let Some(bounds) = mesh_bounds {
        warn_of_outsiders(&bounds, 1e-6 * near.extent(), &file, &fixtures, &mut warnings);
    }

    let surfaces = file.surfaces.iter().zip(&parts.chosen);
    let surfaces = surfaces.map(|(section, chosen)| section.measured(chosen, &parts.mesh)).collect::<Result<_, _>>()?;
    reader.hash.update(dimming.words());
    reader.hash.update(reflectance.map_or_else(String::new, |rgb| format!("reflectance {rgb:?}")));
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let mut scene = Scene {
        name: file.name.unwrap_or(stem),
        file: path.to_owned(),
        hash: reader.hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect(),
        centre,
        near: near.local(centre),
        mesh: Arc::new(parts.mesh),
        materials: parts.materials,
        origins: parts.origins,
        parts: parts.files,
        luminaires: parts.luminaires,
        planes: file.planes,
        sensors: file.sensors,
        cameras: file.cameras,
        surfaces,
        maintenance_factor,
        render: file.render,
        warnings,
    };
    scene.planes.iter_mut().for_each(|plane| plane.corner -= centre);
    scene.sensors.iter_mut().for_each(|sensor| sensor.position -= centre);
    scene.cameras.iter_mut().for_each(|camera| camera.eye -= centre);
    Ok(scene)
}

/// Smallest and largest maintenance factor of what shines, if any is given.
fn maintenance(file: &SceneFile, fixtures: &[Fixture], meshes_shine: bool) -> Option<[f64; 2]> {
    let own = fixtures.iter().filter(|fixture| fixture.level > 0.0).map(|fixture| fixture.section);
    let given = file.maintenance.is_some() || own.clone().any(|section| section.maintenance.is_some());
    let common = file.maintenance.unwrap_or(1.0);
    let all = own.map(|section| section.maintenance.unwrap_or(common)).chain(meshes_shine.then_some(common));
    given.then(|| all.fold([f64::INFINITY, 0.0_f64], |[least, most], factor| [least.min(factor), most.max(factor)]))
}

/// The box around all that stands or shines; around the measuring points and cameras too, where there is no mesh.
fn world_bounds(mesh: Option<Bounds>, fixtures: &[Fixture], file: &SceneFile) -> Bounds {
    let shining = fixtures.iter().flat_map(Fixture::extremes);
    let bounds = match mesh {
        Some(mesh) => Bounds::around([mesh.least, mesh.most].into_iter().chain(shining)),
        None => {
            let planes = file.planes.iter().flat_map(plane_corners);
            let sensors = file.sensors.iter().map(|sensor| sensor.position);
            let eyes = file.cameras.iter().map(|camera| camera.eye);
            Bounds::around(shining.chain(planes).chain(sensors).chain(eyes))
        }
    };
    bounds.expect("a scene has a plane, a sensor, a camera, or a mesh that is measured")
}

pub(super) fn plane_corners(plane: &MeasuringPlane) -> [DVec3; 4] {
    let MeasuringPlane { corner, along, across, .. } = *plane;
    [corner, corner + along, corner + across, corner + along + across]
}

/// A mesh in world coordinates, m, with what its faces are made of.
pub(super) struct PlacedMesh {
    path: PathBuf,
    pub(super) vertices: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) material_of: Vec<u32>,
    pub(super) surfaces: Vec<Surface>,
    pub(super) groups: Groups,
    /// How many triangles the file has; pieces of large ones come behind.
    pub(super) faces: usize,
    /// How many of them a pane has no use for: they have no area any more.
    left_out: usize,
    metres_per_unit: f64,
}

/// Reads files, and remembers what they were.
pub(super) struct Reader {
    pub(super) reach: Reach,
    /// Files that are only here.
    memory: HashMap<PathBuf, Vec<u8>>,
    hash: Sha256,
    pub(super) warnings: Vec<String>,
    /// Mean colour of each texture read, or why there is none.
    textures: HashMap<PathBuf, Result<[f64; 3], String>>,
    /// What materials are that nothing is said of.
    fallback: Option<Fallback>,
}

/// What the scene file says of each material.
pub(super) type Sections<'a> = HashMap<&'a str, &'a MaterialSection>;

impl Reader {
    fn new(path: &Path, memory: HashMap<PathBuf, Vec<u8>>, options: &LoadOptions) -> Self {
        Self {
            reach: Reach::of(path, &options.include),
            memory,
            hash: Sha256::new(),
            warnings: Vec::new(),
            textures: HashMap::new(),
            fallback: None,
        }
    }

    /// Whether a file is only in memory, so that none lies beside it.
    pub(super) fn remembers(&self, path: &Path) -> bool {
        self.memory.contains_key(path)
    }

    /// The bytes of a file that the scene names, which become part of its hash; else why not, in words.
    pub(super) fn read(&mut self, path: &Path, largest: u64) -> Result<Vec<u8>, String> {
        if let Some(bytes) = self.memory.remove(path) {
            let bytes = self.hashed(bytes);
            self.memory.insert(path.to_owned(), bytes.clone());
            return Ok(bytes);
        }
        if !self.reach.holds(path) {
            return Err(OUTSIDE.to_owned());
        }
        files::read(path, largest).map(|bytes| self.hashed(bytes)).map_err(|error| files::why(&error))
    }

    fn hashed(&mut self, bytes: Vec<u8>) -> Vec<u8> {
        self.hash.update((bytes.len() as u64).to_le_bytes());
        self.hash.update(&bytes);
        bytes
    }

    /// Every mesh of the scene, in world coordinates.
    fn meshes(&mut self, path: &Path, file: &SceneFile) -> Result<Vec<PlacedMesh>, InputError> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let (mut known, mut groups) = (BTreeSet::new(), BTreeSet::new());
        let asked = measured::groups_asked(&file.surfaces);
        let sections: Sections = file.materials.iter().map(|m| (m.name.as_str(), m)).collect();
        let mut objs = Vec::new();
        for section in &file.meshes {
            let obj_path = folder.join(&section.file.value);
            let mut obj = match self.large_obj(&obj_path, section, &asked)? {
                Some(obj) => obj,
                None => self.obj(&obj_path, section, &asked)?,
            };
            let library = self.library(&obj_path, &obj, &sections)?;
            obj.without_comments(&obj_path, &|name| sections.contains_key(name) || library.holds(name));
            self.warnings.append(&mut obj.notes);
            known.extend(obj.named.iter().cloned());
            known.extend(obj.materials.iter().map(|material| material.value.clone()));
            known.extend(library.names().map(str::to_owned));
            groups.extend(obj.groups.named.iter().cloned());
            objs.push((section, obj_path, obj, library));
        }
        check_names(&file.materials, &known)?;
        measured::check_names(&file.surfaces, &known, &groups)?;
        objs.into_iter()
            .map(|(section, path, obj, library)| self.place(section, path, obj, &library, &sections))
            .collect()
    }

    fn obj(&mut self, path: &Path, section: &MeshSection, asked: &BTreeSet<String>) -> Result<Obj, InputError> {
        let bytes = self.read(path, LARGEST_OBJ).map_err(|why| {
            let found = format!("file = {} ({why})", quoted(&section.file.value));
            InputError::new(section.file.at.clone(), found, "an OBJ file").hint(path_hint(&why))
        })?;
        Obj::parse(path, &bytes, section.placement.metres_per_unit, asked)
    }

    /// A large OBJ file, if it is one without faults; then its bytes become part of the scene's hash as in `read`.
    ///
    /// # Errors
    /// Where it is a file of another format, which need not be read whole.
    fn large_obj(
        &mut self,
        path: &Path,
        section: &MeshSection,
        asked: &BTreeSet<String>,
    ) -> Result<Option<Obj>, InputError> {
        let metadata = fs::metadata(path).ok().filter(fs::Metadata::is_file);
        let Some(length) = metadata.map(|metadata| metadata.len()).filter(|n| (LARGE_OBJ..=LARGEST_OBJ).contains(n))
        else {
            return Ok(None);
        };
        let Some(mut file) = self.reach.holds(path).then(|| File::open(path).ok()).flatten() else { return Ok(None) };
        let mut head = Vec::new();
        if file.by_ref().take(HEAD as u64).read_to_end(&mut head).is_err() || file.rewind().is_err() {
            return Ok(None);
        }
        foreign::refuse(path, &head, length, "an OBJ file")?;
        let mut hash = self.hash.clone();
        hash.update(length.to_le_bytes());
        let mut source = Hashed { file, hash, bytes: 0 };
        let obj = Obj::read_large(path, &mut source, length, CUT, section.placement.metres_per_unit, asked);
        let obj = obj.filter(|_| source.bytes == length);
        if obj.is_some() {
            self.hash = source.hash;
        }
        Ok(obj)
    }

    /// Mean colour of a texture that an MTL file names.
    fn texture(&mut self, file: &Placed<String>) -> Result<[f64; 3], String> {
        let folder = file.at.file.parent().unwrap_or(Path::new(""));
        // Some programs write a blank as "\\ ", Windows programs folders with backslashes.
        let names = [file.value.clone(), file.value.replace("\\ ", " "), file.value.replace('\\', "/")];
        let paths = names.map(|name| folder.join(name));
        let path = paths.iter().find(|path| path.is_file()).unwrap_or(&paths[0]);
        if let Some(known) = self.textures.get(path) {
            return known.clone();
        }
        let colour = self.read(path, LARGEST_TEXTURE).and_then(|bytes| texture::mean_colour(&bytes));
        self.textures.insert(path.clone(), colour.clone());
        colour
    }

    /// Sets a mesh up in the world and settles what its materials are.
    fn place(
        &mut self,
        section: &MeshSection,
        path: PathBuf,
        obj: Obj,
        library: &Library,
        sections: &Sections<'_>,
    ) -> Result<PlacedMesh, InputError> {
        let mut surfaces = Vec::with_capacity(obj.materials.len());
        let (mut left, mut other_names) = (Vec::new(), Vec::new());
        for name in &obj.materials {
            let mtl = library.find(&name.value);
            let mtl_name = mtl.map(|mtl| mtl.name.as_str()).filter(|other| *other != name.value);
            other_names.extend(mtl_name);
            let section = sections.get(name.value.as_str()).or_else(|| sections.get(mtl_name?)).copied();
            let texture = match (surface::texture(section, mtl), mtl) {
                (Some(file), Some(mtl)) => {
                    let colour = self.texture(file);
                    let unread = |why: &String| self.warnings.push(surface::unread(&name.value, file, mtl, why));
                    colour.inspect_err(unread).ok()
                }
                _ => None,
            };
            let mut surface = surface::resolve(&name.value, section, mtl, texture, &mut self.warnings)?;
            if let (None, Some(fallback)) = (&surface, &mut self.fallback) {
                let section = fallback.section_of(&name.value, section);
                surface = surface::resolve(&name.value, Some(&section), mtl, None, &mut self.warnings)?;
                surface.iter_mut().for_each(|surface| surface.origin.source = Source::Default);
            }
            match surface {
                Some(surface) => surfaces.push(surface),
                None => left.push(name.clone()),
            }
        }
        if !left.is_empty() {
            return Err(unset(&left, library));
        }
        if !other_names.is_empty() {
            let (at, names) = (Location::file(&path), listed(other_names));
            self.warnings.push(format!("{at}: materials that its MTL files spell otherwise: {names}"));
        }
        let transform = section.placement.transform();
        let Obj { mut vertices, mut triangles, mut material_of, groups, materials, .. } = obj;
        vertices.par_iter_mut().for_each(|vertex| *vertex = transform(*vertex));
        let faces = glass::Faces {
            vertices: &mut vertices,
            triangles: &mut triangles,
            material_of: &mut material_of,
            surfaces: &mut surfaces,
        };
        let left_out = glass::settle(&path, &materials, faces, &mut self.warnings)?;
        let (faces, metres_per_unit) = (triangles.len(), section.placement.metres_per_unit);
        Ok(PlacedMesh { path, vertices, triangles, material_of, surfaces, groups, faces, left_out, metres_per_unit })
    }
}

/// What to do where a file that the scene names can't be read.
pub(super) fn path_hint(why: &str) -> &'static str {
    if why == OUTSIDE { INCLUDE } else { "its path starts from the scene file's folder" }
}

/// A file whose bytes are hashed as they are read.
struct Hashed {
    file: File,
    hash: Sha256,
    bytes: u64,
}

impl Read for Hashed {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(out)?;
        self.hash.update(&out[..count]);
        self.bytes += count as u64;
        Ok(count)
    }
}

/// The parts of a scene that share one list of triangles, local coordinates.
#[derive(Default)]
struct Parts {
    centre: DVec3,
    mesh: Mesh,
    materials: Vec<Material>,
    /// Who says what each of them is.
    origins: Vec<Origin>,
    files: Vec<MeshPart>,
    /// Those of a name.
    numbers: HashMap<String, Vec<u32>>,
    luminaires: Vec<Luminaire>,
    /// Material of the luminaires' bodies, once there is one.
    black: Option<u32>,
    /// Triangles of each measured surface, and whether they are measured from behind what it says.
    chosen: Vec<Vec<(u32, bool)>>,
}

/// Faces of one mesh that emit.
struct Emitter {
    material: String,
    /// cd/m².
    luminance: [f64; 3],
    triangles: Vec<[DVec3; 3]>,
    /// The same, as numbers of the scene's triangles.
    numbers: Vec<u32>,
}

impl Parts {
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

    fn add_mesh(
        &mut self,
        mesh: PlacedMesh,
        measured: &[SurfaceSection],
        emitters: &mut Vec<Emitter>,
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
        // Judge and emit from the rounded corners: they are what rays will meet.
        let corners = |triangle: &[u32; 3]| {
            triangle.map(|vertex| DVec3::from(self.mesh.vertices[vertex as usize].map(f64::from)))
        };
        let is_flat = |&index: &usize| !has_area(corners(&triangles[index]));
        let flat: Vec<usize> = (0..triangles.len()).into_par_iter().filter(is_flat).collect();
        let faces = Faces {
            vertices: &self.mesh.vertices,
            triangles: &triangles,
            material_of: &material_of,
            surfaces: &surfaces,
            flat: &flat,
        };
        let doubles = faces.single(&file, warnings);
        let kept = Kept { left_out: merged(&flat, &doubles.left_out), before: self.mesh.triangles.len() };

        // What is measured or shines: most triangles of most scenes do neither.
        for (of_surface, chosen) in chosen.iter().zip(&mut self.chosen) {
            kept.choose(of_surface, &doubles.backs, chosen);
        }
        let mut shining: Vec<Option<Emitter>> = surfaces.iter().map(Emitter::of).collect();
        if shining.iter().any(Option::is_some) {
            for index in (0..triangles.len()).filter(|&index| kept.stays(index)) {
                if let Some(emitter) = &mut shining[material_of[index] as usize] {
                    emitter.triangles.push(corners(&triangles[index]));
                    emitter.numbers.push(kept.number(index));
                }
            }
        }
        emitters.extend(shining.into_iter().flatten().filter(|emitter| !emitter.triangles.is_empty()));

        material_of.par_iter_mut().for_each(|material| *material = numbers[*material as usize]);
        let add = |(material, origin)| self.add_material(material, origin);
        let two_sided: Vec<u32> = doubles.two_sided.into_iter().map(add).collect();
        for (&[front, _], becomes) in doubles.backs.iter().zip(&doubles.becomes) {
            material_of[front as usize] = match *becomes {
                Becomes::Own(surface) => numbers[surface as usize],
                Becomes::TwoSided(material) => two_sided[material as usize],
            };
        }
        without(&mut triangles, &kept.left_out);
        without(&mut material_of, &kept.left_out);
        self.files.push(MeshPart {
            file: path,
            metres_per_unit,
            bounds,
            triangles: kept.before..kept.before + triangles.len(),
            flat: flat.len() - left_out,
            repeated: doubles.repeated,
            backs: doubles.left_out.len() - doubles.repeated,
        });
        // The first mesh, most often the only one, is taken as it is.
        if self.mesh.triangles.is_empty() {
            (self.mesh.triangles, self.mesh.material_of) = (triangles, material_of);
        } else {
            self.mesh.triangles.append(&mut triangles);
            self.mesh.material_of.append(&mut material_of);
        }
        let without_area = flat.len() - left_out;
        if without_area > 0 {
            let triangles = if without_area == 1 { "1 triangle" } else { &format!("{without_area} triangles") };
            warnings.push(format!("{file}: {triangles} without area left out"));
        }
    }

    /// The opening of a luminaire is also a thing in the way of light, and black.
    /// Returns its triangles.
    fn add_body(&mut self, fixture: &Fixture) -> Vec<u32> {
        let (corners, triangles) = fixture.body();
        if triangles.is_empty() {
            return Vec::new();
        }
        let black = match self.black {
            Some(black) => black,
            None => {
                let origin = Origin { source: Source::Luminaire, notes: Vec::new() };
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

    fn add_emitters(&mut self, emitters: Vec<Emitter>) {
        let mut names: BTreeSet<String> = self.luminaires.iter().map(|luminaire| luminaire.name.clone()).collect();
        for emitter in emitters {
            // Meshes may share a material's name: the second lamp is "lamp (2)", its light group is "lamp" all the same.
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
struct Kept {
    /// Those that don't, ascending.
    left_out: Vec<usize>,
    /// Triangles that the scene had before.
    before: usize,
}

impl Kept {
    /// Number in the scene of a triangle of the file.
    fn number(&self, index: usize) -> u32 {
        (self.before + index - self.left_out.partition_point(|&out| out < index)) as u32
    }

    fn stays(&self, index: usize) -> bool {
        self.left_out.is_empty() || self.left_out.binary_search(&index).is_err()
    }

    /// Adds a file's part of a measured surface, ascending, to its triangles; `backs` are triangles and the ones that were
    /// behind them.
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

impl Emitter {
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

/// Planes, sensors and luminaires away from the mesh are allowed, and often a slip of unit or axis.
/// `slack` (m) is what doesn't matter.
fn warn_of_outsiders(mesh: &Bounds, slack: f64, file: &SceneFile, fixtures: &[Fixture], warnings: &mut Vec<String>) {
    let outside =
        |points: &[DVec3]| Bounds::around(points.iter().copied()).is_some_and(|bounds| !mesh.meets(&bounds, slack));
    let mut warn = |kind: &str, names: Vec<&str>| match names.as_slice() {
        [] => {}
        [one] => warnings.push(format!("{kind} {} is wholly outside the mesh's bounding box", quoted(*one))),
        more => warnings.push(format!(
            "{} {kind}s are wholly outside the mesh's bounding box: {}",
            more.len(),
            listed(more.iter().copied())
        )),
    };
    let planes = file.planes.iter().filter(|plane| outside(&plane_corners(plane)));
    warn("plane", planes.map(|plane| plane.name.as_str()).collect());
    let sensors = file.sensors.iter().filter(|sensor| outside(&[sensor.position]));
    warn("sensor", sensors.map(|sensor| sensor.name.as_str()).collect());
    let luminaires = fixtures.iter().filter(|fixture| outside(&fixture.extremes()));
    warn("luminaire", luminaires.map(|fixture| fixture.name.as_str()).collect());
}
