//! The files that a scene names, read and hashed, up to meshes that stand in the world.
//!
//! [`Reader::objs`] looks at files, [`Reader::placed`] at none but textures: a mesh from elsewhere enters between
//! them, as a [`ReadMesh`].

use std::collections::{BTreeSet, HashMap};
use std::fs::{self, File};
use std::io::{self, Read, Seek};
use std::path::{Path, PathBuf};

use glam::DVec3;
use rayon::prelude::*;
use sha2::{Digest, Sha256};

use super::fallback::Fallback;
use super::fields::Placed;
use super::file::{MaterialSection, MeshSection, SceneFile};
use super::glass;
use super::inventory::MaterialSource;
use super::library::{Library, check_names, unset};
use super::measured::{self, Groups};
use super::obj::Obj;
use super::obj::blocks::CUT;
use super::obj::foreign::{self, HEAD};
use super::surface::{self, Surface};
use super::texture;
use crate::error::{InputError, Location};
use crate::files;
use crate::files::limits::{AllowedFolders, LARGEST_OBJ, LARGEST_TEXTURE};
use crate::geometry::mesh::Placement;
use crate::text::{listed, quoted};

/// From this size on, bytes, an OBJ file is read in blocks and by all threads.
const LARGE_OBJ: u64 = 16 << 20;

/// Why a file that is named can't be read, though it may be there.
pub(super) const OUTSIDE: &str = "it lies outside the scene's folder";
/// What to do about that.
const INCLUDE: &str = "--include DIR allows files of another folder";

/// A mesh as its file has it, with the materials of its MTL files.
pub(super) struct ReadMesh<'a> {
    placement: &'a Placement,
    path: PathBuf,
    obj: Obj,
    library: Library,
}

/// A mesh in world coordinates, m, with what its faces are made of.
pub(super) struct PlacedMesh {
    pub(super) path: PathBuf,
    pub(super) vertices: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) material_of: Vec<u32>,
    pub(super) surfaces: Vec<Surface>,
    pub(super) groups: Groups,
    /// How many triangles the file has; pieces of large ones come behind.
    pub(super) faces: usize,
    /// How many of them a pane has no use for: they have no area any more.
    pub(super) left_out: usize,
    pub(super) metres_per_unit: f64,
}

/// Reads files, and remembers what they were.
pub(super) struct Reader {
    pub(super) reach: AllowedFolders,
    /// Files that are only here.
    memory: HashMap<PathBuf, Vec<u8>>,
    /// Over all that is read.
    pub(super) hash: Sha256,
    pub(super) warnings: Vec<String>,
    /// Mean colour of each texture read, or why there is none.
    textures: HashMap<PathBuf, Result<[f64; 3], String>>,
    /// What materials are that nothing is said of.
    pub(super) fallback: Option<Fallback>,
}

/// What the scene file says of each material.
pub(super) type Sections<'a> = HashMap<&'a str, &'a MaterialSection>;

fn sections(file: &SceneFile) -> Sections<'_> {
    file.materials.iter().map(|section| (section.name.as_str(), section)).collect()
}

impl Reader {
    /// The bytes of a file that the scene names, which become part of its hash; else why not, in words.
    pub(super) fn read(&mut self, path: &Path, largest: u64) -> Result<Vec<u8>, String> {
        if let Some(bytes) = self.memory.get(path).cloned() {
            self.hash(&bytes);
            return Ok(bytes);
        }
        if !self.reach.holds(path) {
            return Err(OUTSIDE.to_owned());
        }
        let bytes = files::read(path, largest).map_err(|error| files::why(&error))?;
        self.hash(&bytes);
        Ok(bytes)
    }

    /// Whether a file is only in memory, so that none lies beside it.
    pub(super) fn remembers(&self, path: &Path) -> bool {
        self.memory.contains_key(path)
    }

    /// Makes bytes part of the scene's hash.
    pub(super) fn hash(&mut self, bytes: &[u8]) {
        self.hash.update((bytes.len() as u64).to_le_bytes());
        self.hash.update(bytes);
    }

    /// What is read by now as a scene of `path` and folders the user gives: nothing.
    pub(super) fn of(path: &Path, memory: HashMap<PathBuf, Vec<u8>>, include: &[PathBuf]) -> Self {
        Self {
            reach: AllowedFolders::of(path, include),
            memory,
            hash: Sha256::new(),
            warnings: Vec::new(),
            textures: HashMap::new(),
            fallback: None,
        }
    }

    /// All meshes that a scene names, as their files have them, with their MTL files. Further ones may join them.
    ///
    /// # Errors
    /// Where a file can't be read, or is none.
    pub(super) fn objs<'a>(&mut self, path: &Path, file: &'a SceneFile) -> Result<Vec<ReadMesh<'a>>, InputError> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let asked = measured::groups_asked(&file.surfaces);
        let sections = sections(file);
        let mut all = Vec::with_capacity(file.meshes.len());
        for section in &file.meshes {
            let path = folder.join(&section.file.value);
            let mut obj = match self.large_obj(&path, section, &asked)? {
                Some(obj) => obj,
                None => self.obj(&path, section, &asked)?,
            };
            let library = self.library(&path, &obj, &sections)?;
            obj.without_comments(&path, &|name| sections.contains_key(name) || library.holds(name));
            self.warnings.append(&mut obj.notes);
            all.push(ReadMesh { placement: &section.placement, path, obj, library });
        }
        Ok(all)
    }

    /// Sets meshes up in the world, and settles what their materials are.
    ///
    /// # Errors
    /// Where the scene names a material or group that no mesh has, or nothing defines a material.
    pub(super) fn placed(
        &mut self,
        file: &SceneFile,
        meshes: Vec<ReadMesh<'_>>,
    ) -> Result<Vec<PlacedMesh>, InputError> {
        let (mut known, mut groups) = (BTreeSet::new(), BTreeSet::new());
        for ReadMesh { obj, library, .. } in &meshes {
            known.extend(obj.named.iter().cloned());
            known.extend(obj.materials.iter().map(|material| material.value.clone()));
            known.extend(library.names().map(str::to_owned));
            groups.extend(obj.groups.named.iter().cloned());
        }
        check_names(&file.materials, &known)?;
        measured::check_names(&file.surfaces, &known, &groups)?;
        let sections = sections(file);
        meshes.into_iter().map(|mesh| self.place(mesh, &sections)).collect()
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
        let obj = Obj::read_blocks(path, &mut source, length, CUT, section.placement.metres_per_unit, asked);
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
    fn place(&mut self, mesh: ReadMesh<'_>, sections: &Sections<'_>) -> Result<PlacedMesh, InputError> {
        let mut surfaces = self.surfaces(&mesh, sections)?;
        let ReadMesh { placement, path, obj, .. } = mesh;
        let transform = placement.transform();
        let Obj { mut vertices, mut triangles, mut material_of, groups, materials, .. } = obj;
        vertices.par_iter_mut().for_each(|vertex| *vertex = transform(*vertex));
        let faces = glass::GlassMesh {
            vertices: &mut vertices,
            triangles: &mut triangles,
            material_of: &mut material_of,
            surfaces: &mut surfaces,
        };
        let left_out = glass::settle(&path, &materials, faces, &mut self.warnings)?;
        let (faces, metres_per_unit) = (triangles.len(), placement.metres_per_unit);
        Ok(PlacedMesh { path, vertices, triangles, material_of, surfaces, groups, faces, left_out, metres_per_unit })
    }

    /// What each material of a mesh is.
    fn surfaces(&mut self, mesh: &ReadMesh<'_>, sections: &Sections<'_>) -> Result<Vec<Surface>, InputError> {
        let ReadMesh { path, obj, library, .. } = mesh;
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
                surface.iter_mut().for_each(|surface| surface.origin.source = MaterialSource::Default);
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
            let (at, names) = (Location::file(path), listed(other_names));
            self.warnings.push(format!("{at}: materials that its MTL files spell otherwise: {names}"));
        }
        Ok(surfaces)
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
