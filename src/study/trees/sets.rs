//! The photons: of a scene, and of places where trees have a hard time.

use std::fs;
use std::path::{Path, PathBuf};

use crate::embree::RayCaster;
use crate::error::Error;
use crate::flux::Flux;
use crate::gather::receiver::{LandingRecorder, Photons};
use crate::photon::trace::Tracer;
use crate::progress::Progress;
use crate::random::{Seed, Stream};
use crate::scene::{MeasuringPlane, Scene};

/// Size of the made-up sets, m: the seed office's.
const ROOM: [f32; 3] = [6.0, 7.2, 2.7];
/// Where [`Set::Offset`] begins along each axis, m.
const OFFSET: f32 = 1e6;
/// Search radius there, m: a tenth of its diagonal, as `luxmap render` takes it.
pub(super) const REACH: f32 = 0.975;
/// Columns and rows of the grid asked for where no measuring plane is.
pub(super) const CELLS: [usize; 2] = [120, 144];
/// Times as many photons as wanted that are emitted at most, to find those that land.
const MOST_EMITTED: u64 = 64;
/// What random streams are for.
const PURPOSE_TRACE: u64 = 1;
const PURPOSE_SETS: u64 = 2;
const PURPOSE_QUERIES: u64 = 3;

/// Where photons lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Set {
    /// Where they land on the surfaces of a scene.
    Scene,
    /// Anywhere in a box of 6.0 × 7.2 × 2.7 m.
    Uniform,
    /// On its floor.
    Plane,
    /// Nine tenths in twenty clouds of σ = 5 cm, the rest anywhere.
    Clustered,
    /// All in one place.
    Coincident,
    /// Half of them in one place, half on the floor.
    HalfCoincident,
    /// On one line along an axis.
    Collinear,
    /// Anywhere in the box, 10⁶ m from the origin: single precision leaves a grid of 6 cm.
    Offset,
}

impl Set {
    /// Every set, by name.
    pub const ALL: [(&'static str, Self); 8] = [
        ("scene", Self::Scene),
        ("uniform", Self::Uniform),
        ("plane", Self::Plane),
        ("clustered", Self::Clustered),
        ("coincident", Self::Coincident),
        ("half-coincident", Self::HalfCoincident),
        ("collinear", Self::Collinear),
        ("offset", Self::Offset),
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::ALL.into_iter().find(|(_, set)| *set == self).map_or("", |(name, _)| name)
    }

    /// What it is, in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Scene => "photons where they land on the scene’s surfaces",
            Self::Uniform => "photons anywhere in a box of 6.0 × 7.2 × 2.7 m",
            Self::Plane => "photons anywhere on a floor of 6.0 × 7.2 m",
            Self::Clustered => "nine tenths of the photons in twenty clouds of σ = 5 cm",
            Self::Coincident => "all photons in one place",
            Self::HalfCoincident => "half of the photons in one place, half on a floor",
            Self::Collinear => "all photons on one line along an axis",
            Self::Offset => "photons in a box 10⁶ m from the origin, where single precision leaves a grid of 6 cm",
        }
    }

    /// `count` made-up photons, none for [`Set::Scene`]; each carries between 0.5 and 1.5 lm, so that no sum hides a
    /// swapped photon.
    pub(super) fn photons(self, count: usize, seed: u64) -> Photons<1> {
        let seed = Seed(seed).branch(PURPOSE_SETS);
        let mut clouds = seed.stream(u64::MAX);
        let clouds: Vec<[f32; 3]> = (0..20).map(|_| in_room(&mut clouds)).collect();
        let position = |photon: usize, stream: &mut Stream| {
            let anywhere = in_room(stream);
            let [x, y, _] = anywhere;
            match self {
                Self::Scene | Self::Uniform => anywhere,
                Self::Plane => [x, y, 0.0],
                Self::Clustered if photon % 10 == 9 => anywhere,
                Self::Clustered => clouds[photon % clouds.len()].map(|along| along + 0.05 * normal(stream)),
                Self::HalfCoincident if photon % 2 == 1 => [x, y, 0.0],
                Self::Coincident | Self::HalfCoincident => [2.0, 3.0, 0.0],
                Self::Collinear => [3.0, y, 0.0],
                Self::Offset => anywhere.map(|along| along + OFFSET),
            }
        };
        let count = if self == Self::Scene { 0 } else { count };
        let (positions, flux) = (0..count)
            .map(|photon| {
                let mut stream = seed.stream(photon as u64);
                (position(photon, &mut stream), Flux([0.5 + stream.uniform()]))
            })
            .unzip();
        Photons { positions, flux }
    }

    /// The grid of a made-up set's floor, in scan order, m.
    pub(super) fn floor(self) -> Vec<[f32; 3]> {
        let low = if self == Self::Offset { OFFSET } else { 0.0 };
        floor_of([[low; 3], ROOM.map(|length| low + length)], CELLS)
    }
}

fn in_room(stream: &mut Stream) -> [f32; 3] {
    ROOM.map(|length| length * stream.uniform())
}

/// Standard normal deviate: Box–Muller.
fn normal(stream: &mut Stream) -> f32 {
    let [a, b] = stream.uniform_pair();
    (-2.0 * (1.0 - a).ln()).sqrt() * (std::f32::consts::TAU * b).cos()
}

/// Centres of cells over the lower side of a box, in scan order, m.
fn floor_of([low, high]: [[f32; 3]; 2], cells: [usize; 2]) -> Vec<[f32; 3]> {
    let along =
        |axis: usize, cell: usize| low[axis] + (high[axis] - low[axis]) * (cell as f32 + 0.5) / cells[axis] as f32;
    (0..cells[0] * cells[1]).map(|i| [along(0, i % cells[0]), along(1, i / cells[0]), low[2]]).collect()
}

/// Places of `count` photons, drawn at random, m.
pub(super) fn at_photons(positions: &[[f32; 3]], count: usize, seed: u64) -> Vec<[f32; 3]> {
    let mut stream = Seed(seed).branch(PURPOSE_QUERIES).stream(0);
    let mut place = || (f64::from(stream.uniform()) * positions.len() as f64) as usize;
    (0..count).filter_map(|_| positions.get(place()).copied()).collect()
}

/// Photons where they land on a scene's opaque surfaces, and the measuring plane at which they are asked for.
#[derive(Clone, Debug, Default)]
pub struct Landings {
    photons: Photons<1>,
    /// The scene's first measuring plane, if it has one.
    plane: Option<MeasuringPlane>,
    /// A tenth of the scene's diagonal, m.
    reach: f32,
}

impl Landings {
    /// Traces photons until at least `count` have landed.
    ///
    /// # Errors
    /// Where Embree is missing, and where too few photons land.
    pub fn trace(scene: &Scene, count: usize, seed: u64, progress: &dyn Progress) -> Result<Self, Error> {
        let caster = RayCaster::build_near(&scene.mesh, &scene.near, rayon::current_num_threads())?;
        let mut emitted = count as u64;
        loop {
            progress.stage("trace photons", emitted);
            let tracer = Tracer::<1>::new(scene, &caster, emitted);
            let seed = Seed(seed).branch(PURPOSE_TRACE);
            let photons =
                LandingRecorder::merge(tracer.trace(seed, 0, LandingRecorder::new, |steps| progress.advance(steps)).0);
            let landed = photons.positions.len();
            if landed >= count {
                let (plane, reach) = (scene.planes.first().cloned(), (0.1 * scene.diagonal()) as f32);
                return Ok(Self { photons, plane, reach });
            }
            if emitted >= MOST_EMITTED * count as u64 {
                let found = format!("{}: found {landed} landings of {emitted} photons", scene.file.display());
                return Err(Error::Usage(format!(
                    "{found}, expected {count}; ask for fewer `photons` or other `sets`"
                )));
            }
            emitted = (4 * emitted).min(MOST_EMITTED * count as u64);
        }
    }

    /// Search radius of the k nearest, m: a tenth of the scene's diagonal, as `luxmap render` takes it.
    pub(super) fn reach(&self) -> f32 {
        self.reach
    }

    /// Columns and rows of the measuring plane.
    pub(super) fn cells(&self) -> [usize; 2] {
        self.plane.as_ref().map_or(CELLS, |plane| plane.cells)
    }

    /// `count` of them, evenly spread over all that have landed, and so over all luminaires.
    pub(super) fn spread(&self, count: usize) -> Photons<1> {
        let landed = self.photons.positions.len();
        assert!(landed >= count, "as many photons were traced as are needed");
        let chosen = (0..count).map(|photon| (photon as u64 * landed as u64 / count as u64) as usize);
        let (positions, flux) =
            chosen.map(|photon| (self.photons.positions[photon], self.photons.flux[photon])).unzip();
        Photons { positions, flux }
    }

    /// The box around the photons, m.
    fn bounds(&self) -> [[f32; 3]; 2] {
        let first = self.photons.positions.first().copied().unwrap_or_default();
        self.photons.positions.iter().fold([first; 2], |[low, high], at| {
            [[0, 1, 2].map(|i| low[i].min(at[i])), [0, 1, 2].map(|i| high[i].max(at[i]))]
        })
    }

    /// Centres of so many cells of the measuring plane, or of the photons' lowest z where there is none, in scan order.
    pub(super) fn grid(&self, cells: [usize; 2]) -> Vec<[f32; 3]> {
        let Some(plane) = &self.plane else { return floor_of(self.bounds(), cells) };
        let plane = MeasuringPlane { cells, ..plane.clone() };
        (0..plane.len()).map(|index| plane.point(index).as_vec3().to_array()).collect()
    }
}

/// The scene where none is named: the seed office, as shipped in `scenes/`.
///
/// # Errors
/// Where the system's temporary folder can't be written: meshes are read from files.
pub fn built_in_scene() -> Result<Scene, Error> {
    let folder = std::env::temp_dir().join(format!("luxmap-{}", std::process::id()));
    let written = write_office(&folder);
    let scene = written.and_then(|()| Scene::load(&folder.join("seed-office.toml")));
    let _ = fs::remove_dir_all(&folder); // what is left there harms nobody
    scene.map(|scene| Scene { file: PathBuf::from("seed-office.toml"), ..scene })
}

fn write_office(folder: &Path) -> Result<(), Error> {
    let files = [
        ("seed-office.toml", include_str!("../../../scenes/seed-office.toml")),
        ("seed-office.obj", include_str!("../../../scenes/seed-office.obj")),
        ("seed-office.mtl", include_str!("../../../scenes/seed-office.mtl")),
    ];
    let write = || {
        fs::create_dir(folder)?;
        files.iter().try_for_each(|(name, text)| fs::write(folder.join(name), text))
    };
    write().map_err(|source| Error::Write { path: folder.to_owned(), source })
}
