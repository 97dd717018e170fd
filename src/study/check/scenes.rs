//! Scenes as text, as a user would write them: rooms, luminaires, measuring planes and sensors.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::error::Error;
use crate::scene::Scene;

/// A scene file and its mesh, as text.
#[derive(Clone, Debug, Default)]
pub struct SceneText {
    /// The scene file, but for its `[[mesh]]`.
    pub toml: String,
    /// OBJ text; no mesh where empty.
    pub obj: String,
    /// Text of the mesh's MTL file, `mesh.mtl`; none where empty.
    pub mtl: String,
}

impl SceneText {
    /// Writes the files into `folder`, which is made where it's missing, and reads them as any scene is read.
    pub fn load(&self, folder: &Path) -> Result<Scene, Error> {
        let write = |name: &str, text: &str| {
            let path = folder.join(name);
            fs::write(&path, text).map_err(|source| Error::Write { path, source })
        };
        fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.to_owned(), source })?;
        let library = if self.mtl.is_empty() { "" } else { "mtllib mesh.mtl\n" };
        let mesh = if self.obj.is_empty() { "" } else { "[[mesh]]\nfile = \"mesh.obj\"\n" };
        write("mesh.mtl", &self.mtl)?;
        write("mesh.obj", &format!("{library}{}", self.obj))?;
        write("scene.toml", &format!("{mesh}{}", self.toml))?;
        Scene::load(&folder.join("scene.toml"))
    }
}

/// Faces of a box by corner number from 1 on (corner = 1 + x high + 2 · y high + 4 · z high), seen from inside.
const FACES: [[usize; 4]; 6] = [[1, 2, 4, 3], [7, 8, 6, 5], [1, 3, 7, 5], [6, 8, 4, 2], [1, 5, 6, 2], [3, 4, 8, 7]];

/// OBJ text of a box from `low` to `high`, faces seen from inside, materials in the order floor (z low), ceiling, and
/// the walls at x low, x high, y low, y high.
pub fn room(low: [f64; 3], high: [f64; 3], materials: [&str; 6]) -> String {
    faces(low, high, materials, |corners| corners.map(|corner| corner as i64))
}

/// The same, behind any other text.
pub fn another_room(low: [f64; 3], high: [f64; 3], materials: [&str; 6]) -> String {
    faces(low, high, materials, |corners| corners.map(|corner| corner as i64 - 9))
}

fn faces(low: [f64; 3], high: [f64; 3], materials: [&str; 6], numbers: fn([usize; 4]) -> [i64; 4]) -> String {
    let mut obj = corners(low, high);
    for (material, face) in materials.iter().zip(FACES) {
        let [a, b, c, d] = numbers(face);
        line(&mut obj, format_args!("usemtl {material}\nf {a} {b} {c} {d}"));
    }
    obj
}

/// OBJ text of a box seen from outside, all of one material; it may stand behind any other text.
pub fn solid(low: [f64; 3], high: [f64; 3], material: &str) -> String {
    faces(low, high, [material; 6], |[a, b, c, d]| [d, c, b, a].map(|corner| corner as i64 - 9))
}

fn corners(low: [f64; 3], high: [f64; 3]) -> String {
    let mut obj = String::new();
    for corner in 0..8 {
        let pick = |axis: usize| if corner >> axis & 1 == 1 { high[axis] } else { low[axis] };
        line(&mut obj, format_args!("v {} {} {}", pick(0), pick(1), pick(2)));
    }
    obj
}

/// OBJ text of one polygon; it may stand behind any other text.
pub fn polygon(material: &str, points: &[[f64; 3]]) -> String {
    let mut obj = String::new();
    for [x, y, z] in points {
        line(&mut obj, format_args!("v {x} {y} {z}"));
    }
    let numbers: Vec<String> = (1..=points.len()).rev().map(|back| format!("-{back}")).collect();
    line(&mut obj, format_args!("usemtl {material}\nf {}", numbers.join(" ")));
    obj
}

/// TOML of a material that reflects ρ by Lambert's law.
pub fn diffuse(name: &str, rho: f64) -> String {
    format!("[material.{name}]\nreflectance = {rho}\n")
}

/// TOML of a luminaire without extent that shines alike all about.
pub fn point_lamp(name: &str, position: [f64; 3], flux: f64) -> String {
    format!("[[luminaire]]\nname = \"{name}\"\nposition = {position:?}\nflux = {flux:?}\n")
}

/// TOML of a Lambertian rectangle.
pub fn panel(name: &str, position: [f64; 3], aim: [f64; 3], size: [f64; 2], flux: f64) -> String {
    format!(
        "[[luminaire]]\nname = \"{name}\"\nposition = {position:?}\naim = {aim:?}\nopening = {{ rectangle = {size:?} }}\n\
         flux = {flux:?}\n"
    )
}

/// TOML of a measuring plane; `on` is `air` or `surface`.
pub fn plane(
    name: &str,
    corner: [f64; 3],
    along: [f64; 3],
    across: [f64; 3],
    [columns, rows]: [usize; 2],
    on: &str,
) -> String {
    format!(
        "[[plane]]\nname = \"{name}\"\ncorner = {corner:?}\nalong = {along:?}\nacross = {across:?}\n\
         cells = [{columns}, {rows}]\non = \"{on}\"\n"
    )
}

/// TOML of a measuring plane that covers the floor of a room.
pub fn floor(low: [f64; 3], high: [f64; 3], cells: usize) -> String {
    let [width, depth] = [high[0] - low[0], high[1] - low[1]];
    plane("floor", low, [width, 0.0, 0.0], [0.0, depth, 0.0], [cells, cells], "surface")
}

/// TOML of six measuring planes, one on each face of a room.
pub fn six_planes(low: [f64; 3], high: [f64; 3], cells: usize) -> String {
    let [a, b, c] = low;
    let [x, y, z] = [0, 1, 2].map(|axis| high[axis] - low[axis]);
    [
        ("floor", low, [x, 0.0, 0.0], [0.0, y, 0.0]),
        ("ceiling", [a, b, high[2]], [0.0, y, 0.0], [x, 0.0, 0.0]),
        ("x low", [a, b, c], [0.0, y, 0.0], [0.0, 0.0, z]),
        ("x high", [high[0], b, c], [0.0, 0.0, z], [0.0, y, 0.0]),
        ("y low", [a, b, c], [0.0, 0.0, z], [x, 0.0, 0.0]),
        ("y high", [a, high[1], c], [x, 0.0, 0.0], [0.0, 0.0, z]),
    ]
    .map(|(name, corner, along, across)| plane(name, corner, along, across, [cells, cells], "surface"))
    .concat()
}

/// TOML of a sensor.
pub fn sensor(name: &str, position: [f64; 3], normal: [f64; 3]) -> String {
    format!("[[sensor]]\nname = \"{name}\"\nposition = {position:?}\nnormal = {normal:?}\n")
}

fn line(text: &mut String, words: std::fmt::Arguments<'_>) {
    writeln!(text, "{words}").expect("a string takes all");
}
