//! Scenes made in memory, checked by the same code as scene files.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::assemble::{self, Dimming, LoadOptions};
use super::{PlaneKind, Scene};
use crate::error::{Error, InputError, Location};

/// What stands for the file in messages about such a scene.
pub(crate) const IN_MEMORY: &str = "scene made in memory";

/// Makes a scene without files. What a scene file may hold and has no function here can be given as a
/// [`section`](Self::section).
///
/// ```
/// use luxmap::{Lamp, SceneBuilder};
/// let floor = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 3.0, 0.0], [0.0, 3.0, 0.0]];
/// let scene = SceneBuilder::new("yard")
///     .mesh(&floor, &[[0, 1, 2], [0, 2, 3]], "stone")
///     .material("stone", 0.3)
///     .luminaire(Lamp::new("L", [2.0, 1.5, 2.5], 3000.0).rectangle([0.6, 0.6]))
///     .sensor("middle", [2.0, 1.5, 0.8], [0.0, 0.0, 1.0])
///     .build()?;
/// assert_eq!(scene.mesh.triangles.len(), 2 + 2, "the floor, and the lamp's opening");
/// # Ok::<(), luxmap::Error>(())
/// ```
#[derive(Clone, Debug)]
#[must_use = "there is no scene before it is built"]
pub struct SceneBuilder {
    /// What a scene file would hold.
    top: Table,
    /// Sections in TOML, behind that.
    sections: String,
    /// Files that are none.
    files: HashMap<PathBuf, Vec<u8>>,
    options: LoadOptions,
    meshes: usize,
    /// The first mistake that no scene file could hold.
    mistake: Option<InputError>,
}

/// What a material reflects by Lambert's law: a number from 0 to 1, or one for red, green and blue each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflectance([f64; 3]);

impl From<f64> for Reflectance {
    fn from(grey: f64) -> Self {
        Self([grey; 3])
    }
}

impl From<[f64; 3]> for Reflectance {
    fn from(rgb: [f64; 3]) -> Self {
        Self(rgb)
    }
}

impl SceneBuilder {
    /// A scene of nothing yet.
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            top: Table::from_iter([("name".to_owned(), Value::String(name.into()))]),
            sections: String::new(),
            files: HashMap::new(),
            options: LoadOptions::default(),
            meshes: 0,
            mistake: None,
        }
    }

    /// Triangles of one material: vertices in metres, z up; numbers of vertices from 0 on. Cost: a copy, as text.
    pub fn mesh(mut self, vertices: &[[f64; 3]], triangles: &[[u32; 3]], material: &str) -> Self {
        use std::fmt::Write as _;
        self.meshes += 1;
        let far = triangles.iter().position(|corners| corners.iter().any(|&n| n as usize >= vertices.len()));
        let open = vertices.iter().position(|vertex| !vertex.iter().all(|x| x.is_finite()));
        let bad_name = material.is_empty() || material.trim() != material || material.contains(char::is_control);
        if bad_name {
            self.refuse(format!("a mesh of material {material:?}"), "a name of visible characters");
        } else if let Some(vertex) = open {
            self.refuse(format!("vertex {vertex} at {:?} in a mesh", vertices[vertex]), "finite numbers, m");
        } else if let Some(triangle) = far {
            let (corners, count) = (triangles[triangle], vertices.len());
            self.refuse(
                format!("triangle {triangle} with vertices {corners:?} in a mesh of {count} vertices"),
                "fewer",
            );
        }
        let mut obj = format!("usemtl {material}\n");
        for [x, y, z] in vertices {
            let _ = writeln!(obj, "v {x} {y} {z}"); // a String takes all
        }
        for corners in triangles {
            let [a, b, c] = corners.map(|corner| u64::from(corner) + 1);
            let _ = writeln!(obj, "f {a} {b} {c}");
        }
        let name = format!("mesh {} of the {IN_MEMORY}.obj", self.meshes);
        self.add("mesh", [("file", Value::String(name.clone()))]);
        self.file(name, obj)
    }

    /// What a material reflects by Lambert's law; of others than that, see [`section`](Self::section).
    pub fn material(mut self, name: impl Into<String>, reflectance: impl Into<Reflectance>) -> Self {
        let Reflectance(rgb) = reflectance.into();
        let section = Table::from_iter([("reflectance".to_owned(), numbers(&rgb))]);
        let name = name.into();
        let materials = self.top.entry("material").or_insert_with(|| Value::Table(Table::new()));
        let twice = materials.as_table_mut().and_then(|all| all.insert(name.clone(), Value::Table(section))).is_some();
        if twice {
            self.refuse(format!("material {name:?} twice"), "each material once");
        }
        self
    }

    /// A luminaire.
    pub fn luminaire(mut self, lamp: Lamp) -> Self {
        self.options.include.extend(lamp.folder);
        self.push("luminaire", lamp.keys);
        self
    }

    /// A rectangle of measuring points: world position of its corner, m; its sides, m, at a right angle; how many
    /// points along each. What arrives on the side of along × across is measured.
    pub fn plane(
        mut self,
        name: impl Into<String>,
        corner: [f64; 3],
        [along, across]: [[f64; 3]; 2],
        [columns, rows]: [u32; 2],
        kind: PlaneKind,
    ) -> Self {
        let on = match kind {
            PlaneKind::Surface => "surface",
            PlaneKind::Air => "air",
        };
        let cells = Value::Array(vec![Value::Integer(columns.into()), Value::Integer(rows.into())]);
        self.add(
            "plane",
            [
                ("name", Value::String(name.into())),
                ("corner", numbers(&corner)),
                ("along", numbers(&along)),
                ("across", numbers(&across)),
                ("cells", cells),
                ("on", Value::String(on.into())),
            ],
        );
        self
    }

    /// A measuring point: world position, m, and the direction it looks in.
    pub fn sensor(mut self, name: impl Into<String>, position: [f64; 3], normal: [f64; 3]) -> Self {
        let name = Value::String(name.into());
        self.add("sensor", [("name", name), ("position", numbers(&position)), ("normal", numbers(&normal))]);
        self
    }

    /// A sensor with a target illuminance, lx.
    pub fn sensor_with_target(
        mut self,
        name: impl Into<String>,
        position: [f64; 3],
        normal: [f64; 3],
        target: f64,
    ) -> Self {
        let name = Value::String(name.into());
        let target = Value::Float(target);
        let place = [("position", numbers(&position)), ("normal", numbers(&normal))];
        self.add("sensor", place.into_iter().chain([("name", name), ("target", target)]));
        self
    }

    /// Sections as a scene file has them, such as `"[[camera]]\nname = …"` or `"[material.glass]\nglazing = 0.88"`.
    pub fn section(mut self, toml: &str) -> Self {
        self.sections += toml;
        self.sections.push('\n');
        self
    }

    /// A file that sections may name, and that is only here: a mesh (OBJ), or a photometric file.
    pub fn file(mut self, name: impl Into<PathBuf>, bytes: impl Into<Vec<u8>>) -> Self {
        self.files.insert(name.into(), bytes.into());
        self
    }

    /// Levels of the luminaires.
    pub fn dimming(mut self, dimming: Dimming) -> Self {
        self.options.dimming = dimming;
        self
    }

    /// Checks it all, and makes the scene.
    ///
    /// # Errors
    /// As [`Scene::load`]; the place told is the "scene made in memory".
    pub fn build(self) -> Result<Scene, Error> {
        if let Some(mistake) = self.mistake {
            return Err(mistake.into());
        }
        let text = format!("{}\n{}", self.top, self.sections);
        let path = Path::new(IN_MEMORY);
        let made: Vec<PathBuf> = self.files.keys().cloned().chain([path.to_owned()]).collect();
        let scene = assemble::from_text(path, &text, self.files, &self.options);
        Ok(scene.map_err(|error| match made.contains(&error.at.file) {
            true => InputError { at: Location::file(path), ..error },
            false => error,
        })?)
    }

    fn add(&mut self, section: &str, keys: impl IntoIterator<Item = (&'static str, Value)>) {
        self.push(section, keys.into_iter().map(|(key, value)| (key.to_owned(), value)).collect());
    }

    fn push(&mut self, section: &str, keys: Table) {
        let all = self.top.entry(section).or_insert_with(|| Value::Array(Vec::new()));
        if let Value::Array(all) = all {
            all.push(Value::Table(keys));
        }
    }

    fn refuse(&mut self, found: impl Into<String>, expected: &str) {
        let at = Location::file(Path::new(IN_MEMORY));
        self.mistake.get_or_insert_with(|| InputError::new(at, found, expected));
    }
}

/// A luminaire to be built in: a point, unless an opening is given.
#[derive(Clone, Debug)]
pub struct Lamp {
    keys: Table,
    /// Where its photometric file lies.
    folder: Option<PathBuf>,
}

impl Lamp {
    /// A luminaire of so many lumens, at full output and new; position in the world, m. It shines straight down.
    pub fn new(name: impl Into<String>, position: [f64; 3], flux: f64) -> Self {
        Self::at(name, position).with("flux", Value::Float(flux))
    }

    /// A luminaire whose light a photometric file gives (IES, EULUMDAT, GLDF, TM-33).
    pub fn measured(name: impl Into<String>, position: [f64; 3], file: impl AsRef<Path>) -> Self {
        let file = file.as_ref();
        let folder = file.parent().map(Path::to_owned);
        let lamp = Self::at(name, position).with("photometry", Value::String(file.to_string_lossy().into_owned()));
        Self { folder, ..lamp }
    }

    fn at(name: impl Into<String>, position: [f64; 3]) -> Self {
        let lamp = Self { keys: Table::new(), folder: None };
        lamp.with("name", Value::String(name.into())).with("position", numbers(&position))
    }

    /// A rectangle that shines, m: along x and y where it looks down.
    pub fn rectangle(self, size: [f64; 2]) -> Self {
        self.with("opening", Value::Table(Table::from_iter([("rectangle".to_owned(), numbers(&size))])))
    }

    /// A disc that shines, m.
    pub fn disc(self, diameter: f64) -> Self {
        self.with("opening", Value::Table(Table::from_iter([("disc".to_owned(), Value::Float(diameter))])))
    }

    /// Where it looks.
    pub fn aim(self, direction: [f64; 3]) -> Self {
        self.with("aim", numbers(&direction))
    }

    /// Its light group; without one it is its own.
    pub fn group(self, name: impl Into<String>) -> Self {
        self.with("group", Value::String(name.into()))
    }

    /// Its level, 0 (off) to 1.
    pub fn level(self, level: f64) -> Self {
        self.with("dimming", Value::Float(level))
    }

    /// What it draws at full output, W.
    pub fn power(self, watts: f64) -> Self {
        self.with("power", Value::Float(watts))
    }

    /// Its colour, linear red, green and blue: of these only the ratio counts.
    pub fn color(self, rgb: [f64; 3]) -> Self {
        self.with("color", numbers(&rgb))
    }

    fn with(mut self, key: &str, value: Value) -> Self {
        self.keys.insert(key.to_owned(), value);
        self
    }
}

fn numbers(all: &[f64]) -> Value {
    Value::Array(all.iter().map(|number| Value::Float(*number)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLOOR: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 3.0, 0.0], [0.0, 3.0, 0.0]];
    const HALVES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

    fn yard() -> SceneBuilder {
        SceneBuilder::new("yard \"1\"")
            .mesh(&FLOOR, &HALVES, "wall")
            .material("wall", 0.5)
            .luminaire(Lamp::new("L", [2.0, 1.5, 2.4], 3000.0).rectangle([0.6, 0.6]).group("a"))
            .plane("floor", [0.0; 3], [[4.0, 0.0, 0.0], [0.0, 3.0, 0.0]], [4, 3], PlaneKind::Surface)
            .sensor_with_target("desk", [1.0, 1.0, 0.8], [0.0, 0.0, 1.0], 300.0)
    }

    #[test]
    fn a_scene_in_memory_is_that_of_its_files() {
        let folder = std::env::temp_dir().join(format!("luxmap-builder-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder for the test");
        let obj = "usemtl wall\nv 0 0 0\nv 4 0 0\nv 4 3 0\nv 0 3 0\nf 1 2 3\nf 1 3 4\n";
        std::fs::write(folder.join("yard.obj"), obj).expect("a mesh");
        let toml = r#"
            name = 'yard "1"'
            [[mesh]]
            file = "yard.obj"
            [material.wall]
            reflectance = 0.5
            [[luminaire]]
            name = "L"
            position = [2, 1.5, 2.4]
            opening = { rectangle = [0.6, 0.6] }
            flux = 3000
            group = "a"
            [[plane]]
            name = "floor"
            corner = [0, 0, 0]
            along = [4, 0, 0]
            across = [0, 3, 0]
            cells = [4, 3]
            [[sensor]]
            name = "desk"
            position = [1, 1, 0.8]
            normal = [0, 0, 1]
            target = 300
        "#;
        std::fs::write(folder.join("yard.toml"), toml).expect("a scene");
        let read = Scene::load(&folder.join("yard.toml")).unwrap_or_else(|error| panic!("{error}"));
        let made = yard().build().unwrap_or_else(|error| panic!("{error}"));
        let parts = |scene: &Scene| {
            let mesh = (scene.mesh.vertices.clone(), scene.mesh.triangles.clone(), scene.mesh.material_of.clone());
            let places = (scene.planes.clone(), scene.sensors.clone(), format!("{:?}", scene.luminaires));
            (scene.name.clone(), mesh, format!("{:?}", scene.materials), places)
        };
        assert_eq!(parts(&made), parts(&read));
        let _ = std::fs::remove_dir_all(&folder);
    }

    #[test]
    fn mistakes_are_told_as_of_files() {
        let said = |builder: SceneBuilder| builder.build().expect_err("a mistake").to_string();
        for (builder, message) in [
            (
                yard().material("paint", 1.5),
                "scene made in memory: found reflectance = [1.5, 1.5, 1.5] in [material.paint]",
            ),
            (yard().material("wall", 0.2), "scene made in memory: found material \"wall\" twice"),
            (
                yard().mesh(&FLOOR, &[[0, 1, 4]], "wall"),
                "scene made in memory: found triangle 0 with vertices [0, 1, 4]",
            ),
            (yard().mesh(&[[f64::NAN; 3]; 3], &[[0, 1, 2]], "wall"), "scene made in memory: found vertex 0"),
            (yard().mesh(&FLOOR, &HALVES, "a\nb"), "scene made in memory: found a mesh of material \"a\\nb\""),
            (
                yard().mesh(&FLOOR, &HALVES, "stone"),
                "scene made in memory: found no reflectance for material \"stone\"",
            ),
            (yard().section("[[camera]\n"), "scene made in memory: found broken TOML"),
            (
                yard().luminaire(Lamp::measured("M", [0.0; 3], "none.ies")),
                "scene made in memory: found photometry = \"none",
            ),
        ] {
            let said = said(builder);
            assert!(said.starts_with(message), "{said}");
        }
    }
}
