//! From the scene file and the files it names to a [`Scene`].

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use sha2::{Digest, Sha256};

use super::emitters;
use super::fallback::Fallback;
use super::fields::closest;
use super::file::SceneFile;
use super::fixture::{self, Fixture, FixtureLight};
use super::parts::{EmittingFaces, Parts};
use super::placed::surroundings;
use super::read::{PlacedMesh, Reader};
use super::{MeasuringPlane, Scene};
use crate::error::{Error, InputError, Location, OptionError};
use crate::files;
use crate::files::limits::LARGEST_SCENE;
use crate::geometry::mesh::Bounds;
use crate::scene::Levels;
use crate::text::{listed, quoted};

impl Scene {
    /// Reads a scene file (TOML) and the meshes it names, checks them, and moves everything to the middle of its
    /// bounding box. Any mistake is refused in one line that says where it is, what is found there and what was
    /// expected.
    ///
    /// The files it names lie in its own folder or below; see [`limits`](crate::files::limits).
    pub fn load(path: &Path) -> Result<Self, Error> {
        Self::load_with(path, &[], &Dimming::AsWritten)
    }

    /// The same, where files may also lie in the folders `include`, or below; with luminaires dimmed otherwise than
    /// the file has them.
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
        options.check()?;
        Ok(of_text(path, &text_of(path)?, options)?)
    }

    /// A scene from text in memory, as if it stood in a file `scene.toml` in `folder`, where the files lie that it
    /// names. No such file is looked at. Cost: as [`Scene::load`].
    ///
    /// ```
    /// # use luxmap::scene::Scene;
    /// let text = r#"
    ///     [[luminaire]]
    ///     name = "L"
    ///     position = [0, 0, 3]
    ///     flux = 1000
    ///     [[sensor]]
    ///     name = "desk"
    ///     position = [0, 0, 1]
    ///     normal = [0, 0, 1]
    /// "#;
    /// assert_eq!(Scene::parse(text, ".".as_ref())?.sensors.len(), 1);
    /// # Ok::<(), luxmap::error::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn parse(text: &str, folder: &Path) -> Result<Self, Error> {
        Self::parse_as(text, folder, &LoadOptions::default())
    }

    /// The same, with all that the command line may add to a scene file.
    ///
    /// # Errors
    /// As [`Scene::load_as`].
    pub fn parse_as(text: &str, folder: &Path, options: &LoadOptions) -> Result<Self, Error> {
        options.check()?;
        Ok(of_text(&folder.join("scene.toml"), text, options)?)
    }
}

/// What is said of a scene beside its file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Folders whose files the scene may name, besides its own.
    pub include: Vec<PathBuf>,
    /// At which levels its luminaires are.
    pub dimming: Dimming,
    /// What those materials reflect by Lambert's law of which neither a section of the scene nor an MTL file says it:
    /// before what `[material."*"]` says of them. Part of the scene's hash.
    pub reflectance: Option<[f64; 3]>,
}

impl LoadOptions {
    /// Refuses a reflectance that is none.
    fn check(&self) -> Result<(), Error> {
        match self.reflectance.filter(|rgb| !rgb.iter().all(|n| (0.0..=1.0).contains(n))) {
            Some(found) => {
                let (found, expected) = (format!("{found:?}"), "numbers from 0 to 1".into());
                Err(OptionError::Value { option: "reflectance", found, expected }.into())
            }
            None => Ok(()),
        }
    }
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

/// The text of a scene file.
fn text_of(path: &Path) -> Result<String, InputError> {
    let bytes = files::read(path, LARGEST_SCENE)
        .map_err(|error| files::why(&error))
        .map_err(|why| InputError::new(Location::file(path), format!("no scene ({why})"), "a scene file in TOML"))?;
    String::from_utf8(bytes).map_err(|error| {
        let line =
            error.as_bytes()[..error.utf8_error().valid_up_to()].iter().filter(|&&byte| byte == b'\n').count() + 1;
        InputError::new(Location::line(path, line), "bytes that are no UTF-8", "text in UTF-8")
    })
}

/// Reads all that a scene file of this text names, then assembles it.
fn of_text(path: &Path, text: &str, options: &LoadOptions) -> Result<Scene, InputError> {
    from_text(path, text, HashMap::new(), options)
}

/// The same, where the text may also name files that are only in `memory`.
pub(super) fn from_text(
    path: &Path,
    text: &str,
    memory: HashMap<PathBuf, Vec<u8>>,
    options: &LoadOptions,
) -> Result<Scene, InputError> {
    let mut reader = Reader::of(path, memory, &options.include);
    reader.hash(text.as_bytes());
    let file = SceneFile::parse(path, text)?;
    reader.fallback = Fallback::of(&file.materials, options.reflectance);
    let meshes = reader.objs(path, &file)?;
    let meshes = reader.placed(&file, meshes)?;
    let lamps = reader.lamps(path, &file)?;
    let Reader { mut warnings, hash, fallback, .. } = reader;
    let scene = Ingredients { path, file, meshes, lamps, hash }.assembled(options, &mut warnings, fallback.as_ref())?;
    Ok(Scene { warnings, ..scene })
}

/// All that a scene is made of, once every file is read.
struct Ingredients<'a> {
    path: &'a Path,
    file: SceneFile,
    meshes: Vec<PlacedMesh>,
    /// One for each of the file's luminaires.
    lamps: Vec<FixtureLight>,
    /// Over all that was read.
    hash: Sha256,
}

impl Ingredients<'_> {
    /// Puts the scene together; no file is looked at. Its warnings are left to the caller.
    fn assembled(
        self,
        options: &LoadOptions,
        warnings: &mut Vec<String>,
        fallback: Option<&Fallback>,
    ) -> Result<Scene, InputError> {
        let Self { path, file, meshes, lamps, mut hash } = self;
        let LoadOptions { dimming, reflectance, .. } = options;
        let fixtures = fixture::spread(&file.luminaires, &lamps, dimming)?;
        let mesh_bounds = meshes.iter().map(|mesh| Bounds::around_all(&mesh.vertices)).fold(None, Bounds::joined);
        let bounds = world_bounds(mesh_bounds, &fixtures, &file);
        let near = surroundings(&meshes, &fixtures, &file, bounds);
        let centre = near.origin(bounds);

        let mut parts = Parts::about(centre, file.surfaces.len());
        let mut emitters = Vec::new();
        for mut mesh in meshes {
            mesh.cut_large(&near);
            parts.add_mesh(mesh, &file.surfaces, &mut emitters, warnings);
        }
        let maintenance_factor = shine(&mut parts, emitters, &fixtures, &file, dimming, near.shift(bounds))?;
        if parts.luminaires.is_empty() {
            let found = if file.luminaires.is_empty() { "nothing that shines" } else { "every luminaire dimmed to 0" };
            let expected = "a [[luminaire]], or a material with Ke in an MTL file";
            return Err(InputError::new(Location::file(path), found, expected));
        }
        warnings.extend(fallback.and_then(Fallback::told));
        emitters::warn(&parts.luminaires, &parts.mesh, &parts.materials, warnings);
        if let Some(bounds) = mesh_bounds {
            warn_of_outsiders(&bounds, 1e-6 * near.extent(), &file, &fixtures, warnings);
        }

        let surfaces = file.surfaces.iter().zip(&parts.chosen);
        let surfaces =
            surfaces.map(|(section, chosen)| section.measured(chosen, &parts.mesh)).collect::<Result<_, _>>()?;
        hash.update(dimming.words());
        hash.update(reflectance.map_or_else(String::new, |rgb| format!("reflectance {rgb:?}")));
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let mut scene = Scene {
            name: file.name.unwrap_or(stem),
            file: path.to_owned(),
            hash: hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect(),
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
            warnings: Vec::new(),
        };
        scene.planes.iter_mut().for_each(|plane| plane.corner -= centre);
        scene.sensors.iter_mut().for_each(|sensor| sensor.position -= centre);
        scene.cameras.iter_mut().for_each(|camera| camera.eye -= centre);
        Ok(scene)
    }
}

/// Adds the luminaires and the meshes that shine, at their levels, without those that are off. Returns the scene's
/// smallest and largest maintenance factor.
fn shine(
    parts: &mut Parts,
    emitters: Vec<EmittingFaces>,
    fixtures: &[Fixture],
    file: &SceneFile,
    dimming: &Dimming,
    shift: f64,
) -> Result<Option<[f64; 2]>, InputError> {
    // An opening mounted flush with a ceiling shares its plane, and which of the two a ray then meets is arbitrary: a
    // seed office with such panels read 0.8 … 1.1 % too bright on the floor. So body and opening move together, along
    // the aim: by 36 µm in a room of 7 m, whatever lies about it, which is some 150 steps of f32 there, and nothing to
    // the illuminance.
    for fixture in fixtures {
        let fixture = fixture.shifted(shift, parts.centre);
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
    Ok(maintenance(file, fixtures, parts.luminaires.len() > fixtures_shine))
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
            let planes = file.planes.iter().flat_map(MeasuringPlane::corners);
            let sensors = file.sensors.iter().map(|sensor| sensor.position);
            let eyes = file.cameras.iter().map(|camera| camera.eye);
            Bounds::around(shining.chain(planes).chain(sensors).chain(eyes))
        }
    };
    bounds.expect("a scene has a plane, a sensor, a camera, or a mesh that is measured")
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
    let planes = file.planes.iter().filter(|plane| outside(&plane.corners()));
    warn("plane", planes.map(|plane| plane.name.as_str()).collect());
    let sensors = file.sensors.iter().filter(|sensor| outside(&[sensor.position]));
    warn("sensor", sensors.map(|sensor| sensor.name.as_str()).collect());
    let luminaires = fixtures.iter().filter(|fixture| outside(&fixture.extremes()));
    warn("luminaire", luminaires.map(|fixture| fixture.name.as_str()).collect());
}
