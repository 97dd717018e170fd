//! OBJ files: faces and the names of their materials.

pub(crate) mod large;
mod number;

use std::collections::{BTreeSet, HashMap};
use std::path::Path;

use glam::DVec3;

use super::fields::{FARTHEST, Placed, quoted};
use super::lines::{Feed, Lines, is_plain, keyword, text, words};
use super::measured::Groups;
use super::polygon;
use crate::error::{InputError, Location};

/// What an OBJ file holds, in its own unit and axes.
pub(crate) struct Obj {
    pub(crate) vertices: Vec<DVec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Number in `materials` of each triangle's material.
    pub(crate) material_of: Vec<u32>,
    /// Names of the materials that faces use, and where they first do.
    pub(crate) materials: Vec<Placed<String>>,
    /// Every name that `usemtl` gives, with or without faces.
    pub(crate) named: BTreeSet<String>,
    /// What `mtllib` asks for.
    pub(crate) libraries: Vec<Placed<String>>,
    /// The groups asked for, and their triangles.
    pub(crate) groups: Groups,
}

/// Material of faces that stand before any `usemtl`.
pub(crate) const DEFAULT_MATERIAL: &str = "default";

/// Most corners of a face: clipping ears takes time by their square.
const MOST_CORNERS: usize = 10_000;

impl Obj {
    fn new(vertices: Vec<DVec3>, triangles: Vec<[u32; 3]>, material_of: Vec<u32>, names: Names<'_>) -> Self {
        let Names { used: materials, named, libraries, groups, .. } = names;
        Self { vertices, triangles, material_of, materials, named, libraries, groups }
    }

    /// Reads the OBJ file at `path`; `metres_per_unit` only serves to refuse what lies too far out. Of the groups only
    /// those `asked` for are kept.
    pub(crate) fn parse(
        path: &Path,
        bytes: &[u8],
        metres_per_unit: f64,
        asked: &BTreeSet<String>,
    ) -> Result<Self, InputError> {
        let mut tidy = Tidy::new(path, bytes, Groups::asking(asked));
        let options = tobj::LoadOptions { single_index: true, ..Default::default() };
        let mut feed = Feed::new(|line: &mut Vec<u8>| tidy.next(line));
        let loaded = tobj::load_obj_buf(&mut feed, &options, one_material);
        let Tidy { refused, line, faces, names, .. } = tidy;
        if let Some(error) = refused {
            return Err(error);
        }
        let (models, _) = loaded.map_err(|error| at_fault(path, bytes, error, line))?;
        if faces == 0 {
            let error = InputError::new(Location::file(path), "an OBJ file without faces", "lines that begin with f");
            return Err(error.hint("is it an OBJ file, exported with its faces?"));
        }

        let mut obj = Self::new(Vec::new(), Vec::with_capacity(faces), Vec::with_capacity(faces), names);
        let mut face = 0;
        for tobj::Model { mesh, .. } in models {
            obj.append(path, bytes, &mesh, FARTHEST / metres_per_unit, &mut face)?;
        }
        Ok(obj)
    }

    /// Adds faces of one material; `number` counts the faces of the file.
    fn append(
        &mut self,
        path: &Path,
        bytes: &[u8],
        mesh: &tobj::Mesh,
        farthest: f64,
        number: &mut usize,
    ) -> Result<(), InputError> {
        if mesh.positions.iter().any(|x| x.is_nan() || x.abs() > farthest) {
            return Err(bad_vertex(path, bytes, farthest));
        }
        let too_many =
            || InputError::new(Location::file(path), "more than 4e9 vertices", "a mesh that fits into memory");
        let first = u32::try_from(self.vertices.len()).map_err(|_| too_many())?;
        self.vertices.extend(mesh.positions.chunks_exact(3).map(DVec3::from_slice));
        u32::try_from(self.vertices.len()).map_err(|_| too_many())?;

        let material = mesh.material_id.and_then(|id| u32::try_from(id).ok()).unwrap_or(0);
        let mut corners = mesh.indices.as_slice();
        let mut arities = mesh.face_arities.iter();
        while !corners.is_empty() {
            let arity = arities.next().map_or(3, |&n| n as usize).min(corners.len());
            let (face, rest) = corners.split_at(arity);
            corners = rest;
            self.groups.face(*number, self.triangles.len());
            *number += 1;
            add_face(face, first, &self.vertices, &mut self.triangles);
            self.material_of.resize(self.triangles.len(), material);
        }
        Ok(())
    }
}

/// What could stand in the lines of vertices and faces.
const POSITION: &str = "v x y z, three finite numbers";
const CORNERS: &str = "f and vertex numbers, as in f 1 2 3 or f 1/1/1 2/2/1 3/3/1";

/// Adds the triangles of a face whose corners are numbered from the vertex `first` on.
fn add_face(corners: &[u32], first: u32, vertices: &[DVec3], triangles: &mut Vec<[u32; 3]>) {
    if let &[a, b, c] = corners {
        triangles.push([a, b, c].map(|corner| first + corner));
        return;
    }
    let places: Vec<DVec3> = corners.iter().map(|corner| vertices[(first + corner) as usize]).collect();
    triangles.extend(polygon::triangles_of(&places).into_iter().map(|triangle| triangle.map(|i| first + corners[i])));
}

/// What the lines say that aren't geometry.
struct Names<'a> {
    path: &'a Path,
    /// What the last `usemtl` says.
    current: Placed<String>,
    /// The materials that faces have.
    used: Vec<Placed<String>>,
    number_of: HashMap<String, u32>,
    named: BTreeSet<String>,
    libraries: Vec<Placed<String>>,
    groups: Groups,
}

impl<'a> Names<'a> {
    fn new(path: &'a Path, groups: Groups) -> Self {
        Self {
            path,
            current: Placed { value: DEFAULT_MATERIAL.to_owned(), at: Location::file(path) },
            used: Vec::new(),
            number_of: HashMap::new(),
            named: BTreeSet::new(),
            libraries: Vec::new(),
            groups,
        }
    }

    /// A line `usemtl`; whether it is another material than before.
    fn material(&mut self, name: String, line: usize) -> bool {
        let other = self.current.value != name;
        self.current = Placed { value: name.clone(), at: Location::line(self.path, line) };
        self.named.insert(name);
        other
    }

    /// A line `mtllib`.
    fn library(&mut self, request: String, line: usize) {
        self.libraries.push(Placed { value: request, at: Location::line(self.path, line) });
    }

    /// Number in `used` of the material of a face that stands in this line.
    fn number(&mut self, line: usize) -> u32 {
        if let Some(&number) = self.number_of.get(&self.current.value) {
            return number;
        }
        let mut first = self.current.clone();
        first.at = first.at.line.map_or_else(|| Location::line(self.path, line), |_| first.at);
        let number = u32::try_from(self.used.len()).expect("a file of 16 GiB names fewer than 4e9 materials");
        self.number_of.insert(first.value.clone(), number);
        self.used.push(first);
        number
    }
}

/// The lines that `tobj` gets to see: vertices without colours, faces without textures and normals, materials by number.
struct Tidy<'a> {
    path: &'a Path,
    lines: Lines<'a>,
    /// Number of the line last read.
    line: usize,
    /// Why reading ended early.
    refused: Option<InputError>,
    faces: usize,
    /// Whether `tobj` knows what the last `usemtl` says.
    told: bool,
    names: Names<'a>,
}

impl<'a> Tidy<'a> {
    fn new(path: &'a Path, bytes: &'a [u8], groups: Groups) -> Self {
        Self {
            path,
            lines: Lines::new(bytes),
            line: 0,
            refused: None,
            faces: 0,
            told: false,
            names: Names::new(path, groups),
        }
    }

    fn next(&mut self, out: &mut Vec<u8>) -> bool {
        let Some((number, line)) = self.lines.next() else { return false };
        self.line = number;
        let (key, rest) = keyword(&line);
        let tidied = match key {
            b"v" => self.vertex(rest, out),
            b"f" => self.face(rest, out),
            b"usemtl" => self.material(rest),
            b"mtllib" => {
                self.names.library(text(rest), number);
                Ok(())
            }
            b"g" | b"o" => {
                self.names.groups.line(usize::from(key == b"o"), &text(rest), self.faces);
                Ok(())
            }
            _ => Ok(()),
        };
        self.refused = tidied.err();
        self.refused.is_none()
    }

    fn here(&self) -> Location {
        Location::line(self.path, self.line)
    }

    /// x y z, and w where it stands alone: six or seven numbers are a position and a colour.
    fn vertex(&mut self, rest: &[u8], out: &mut Vec<u8>) -> Result<(), InputError> {
        if rest.iter().any(|byte| b"nNiI".contains(byte)) && words(rest).any(|word| !is_finite_number(word)) {
            return Err(
                InputError::new(self.here(), quoted(&text(rest)), "three finite numbers").hint("repair the vertex")
            );
        }
        if !words(rest).all(is_plain) {
            return Err(InputError::new(self.here(), quoted(&format!("v {}", text(rest))), POSITION));
        }
        let count = words(rest).count();
        out.push(b'v');
        for word in words(rest).take(if count == 4 { 4 } else { 3 }) {
            out.push(b' ');
            out.extend_from_slice(word);
        }
        out.push(b'\n');
        Ok(())
    }

    fn face(&mut self, rest: &[u8], out: &mut Vec<u8>) -> Result<(), InputError> {
        let corners = words(rest).count();
        if !(3..=MOST_CORNERS).contains(&corners) {
            let expected = format!("from 3 to {MOST_CORNERS}");
            return Err(InputError::new(self.here(), format!("a face with {corners} corners"), expected));
        }
        self.faces += 1;
        if !self.told {
            self.tell_material(out);
        }
        out.push(b'f');
        for word in words(rest) {
            let vertex = word.split(|&byte| byte == b'/').next().unwrap_or_default();
            if vertex.is_empty() {
                let found = format!("the corner {} without a vertex", quoted(&text(word)));
                return Err(InputError::new(self.here(), found, "a vertex number, as in f 1/1/1 2/2/1 3/3/1"));
            }
            if !is_plain(vertex) {
                return Err(InputError::new(self.here(), quoted(&format!("f {}", text(rest))), CORNERS));
            }
            out.push(b' ');
            out.extend_from_slice(vertex);
        }
        out.push(b'\n');
        Ok(())
    }

    fn material(&mut self, rest: &[u8]) -> Result<(), InputError> {
        if rest.is_empty() {
            return Err(InputError::new(self.here(), "usemtl without a name", "usemtl NAME"));
        }
        if self.names.material(text(rest), self.line) {
            self.told = false;
        }
        Ok(())
    }

    /// Makes `tobj` give the material's number in `used` to the faces that follow.
    fn tell_material(&mut self, out: &mut Vec<u8>) {
        self.told = true;
        let known = self.names.used.len();
        let number = self.names.number(self.line);
        if self.names.used.len() > known {
            out.extend_from_slice(format!("mtllib {number}\n").as_bytes());
        }
        out.extend_from_slice(format!("usemtl {number}\n").as_bytes());
    }
}

/// The material library that holds nothing but a material named as it is.
fn one_material(path: &Path) -> tobj::MTLLoadResult {
    let name = path.to_string_lossy().into_owned();
    let material = tobj::Material { name: name.clone(), ..Default::default() };
    Ok((vec![material], [(name, 0)].into_iter().collect()))
}

fn is_finite_number(word: &[u8]) -> bool {
    str::from_utf8(word).is_ok_and(|word| word.parse::<f64>().is_ok_and(f64::is_finite))
}

/// What is wrong with the line at which `tobj` stopped, or with the first index out of range.
fn at_fault(path: &Path, bytes: &[u8], error: tobj::LoadError, stopped_at: usize) -> InputError {
    if error == tobj::LoadError::FaceVertexOutOfBounds {
        return bad_index(path, bytes);
    }
    let line = Lines::new(bytes).find(|&(number, _)| number == stopped_at).map(|(_, line)| line).unwrap_or_default();
    let expected = match keyword(&line).0 {
        b"v" => POSITION,
        b"f" => CORNERS,
        _ => "a line of an OBJ file",
    };
    InputError::new(Location::line(path, stopped_at), quoted(&text(&line)), expected)
}

/// The first vertex number that names no vertex. Only called once it is known that there is one.
fn bad_index(path: &Path, bytes: &[u8]) -> InputError {
    let is_vertex = |line: &[u8]| keyword(line).0 == b"v";
    let count = Lines::new(bytes).filter(|(_, line)| is_vertex(line)).count();
    let mut so_far = 0;
    for (number, line) in Lines::new(bytes) {
        so_far += usize::from(is_vertex(&line));
        if keyword(&line).0 != b"f" {
            continue;
        }
        for corner in words(keyword(&line).1) {
            let index = text(corner.split(|&byte| byte == b'/').next().unwrap_or_default());
            let refuse = |expected: String| {
                InputError::new(Location::line(path, number), format!("vertex {index} in a face"), expected)
            };
            let (last, before) = (count as i128, so_far as i128);
            match index.parse::<i128>() {
                Ok(_) if count == 0 => return refuse("a vertex of this file, which has none".to_owned()),
                Ok(0) => return refuse(format!("1 … {last}")).hint("OBJ counts from 1"),
                Ok(i) if i > last => return refuse(format!("1 … {last}")),
                Ok(i) if i < -before => {
                    return refuse(format!("no less than -{before}, as {before} vertices stand above"));
                }
                _ => {}
            }
        }
    }
    InputError::new(Location::file(path), "a face whose vertex doesn't exist", "vertex numbers within the file")
}

/// The first vertex that is not finite, or too far out. Only called once it is known that there is one.
fn bad_vertex(path: &Path, bytes: &[u8], farthest: f64) -> InputError {
    let expected = "finite coordinates within 1e9 m of the origin";
    for (number, line) in Lines::new(bytes) {
        let (key, rest) = keyword(&line);
        let numbers: Vec<f64> = words(rest).map(|word| text(word).parse().unwrap_or(f64::NAN)).collect();
        let w = if numbers.len() == 4 { numbers[3] } else { 1.0 };
        let inside = |x: &f64| (x / w).abs() <= farthest;
        if key == b"v" && !numbers.iter().take(3).all(inside) {
            return InputError::new(Location::line(path, number), quoted(&text(rest)), expected);
        }
    }
    InputError::new(Location::file(path), "a vertex that is not finite", expected)
}
