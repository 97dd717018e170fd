//! OBJ files: faces and the names of their materials.

pub(crate) mod blocks;
pub(crate) mod foreign;
mod number;

use std::collections::{BTreeSet, HashMap};
use std::io::Write as _;
use std::path::Path;

use glam::DVec3;
use rayon::prelude::*;

use self::blocks::CUT;
use super::fields::{FARTHEST, Placed};
use super::lines::{Lines, is_plain, keyword, text, without_comment, words};
use super::measured::Groups;
use crate::error::{InputError, Location};
use crate::geometry::polygon;
use crate::text::listed;
use crate::text::quoted;

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
    /// What was left out or guessed, in words.
    pub(crate) notes: Vec<String>,
}

/// Material of faces that stand before any `usemtl`, or below one without a name.
pub(crate) const DEFAULT_MATERIAL: &str = "default";

/// Most corners of a face: clipping ears takes time by their square.
const MOST_CORNERS: usize = 10_000;

impl Obj {
    fn new(vertices: Vec<DVec3>, triangles: Vec<[u32; 3]>, material_of: Vec<u32>, names: Names<'_>) -> Self {
        let notes = names.notes();
        let Names { used: materials, named, libraries, groups, .. } = names;
        Self { vertices, triangles, material_of, materials, named, libraries, groups, notes }
    }

    /// Takes the comments off names of materials that are unknown with them and known without.
    pub(crate) fn without_comments(&mut self, path: &Path, known: &dyn Fn(&str) -> bool) {
        let mut taken_off = Vec::new();
        let (mut materials, mut number_of) = (Vec::<Placed<String>>::new(), HashMap::new());
        let mut new_numbers = Vec::with_capacity(self.materials.len());
        for mut material in std::mem::take(&mut self.materials) {
            let plain = without_comment(&material.value).to_owned();
            if plain != material.value && !known(&material.value) && known(&plain) {
                taken_off.push(std::mem::replace(&mut material.value, plain.clone()));
                self.named.insert(plain);
            }
            let number = *number_of.entry(material.value.clone()).or_insert(materials.len() as u32);
            if number as usize == materials.len() {
                materials.push(material);
            }
            new_numbers.push(number);
        }
        self.materials = materials;
        if !taken_off.is_empty() {
            self.material_of.par_iter_mut().for_each(|material| *material = new_numbers[*material as usize]);
            let names = listed(taken_off.iter().map(String::as_str));
            self.notes.push(format!("{}: comments taken off the names of materials: {names}", Location::file(path)));
        }
    }

    /// Reads the OBJ file at `path`; `metres_per_unit` only serves to refuse what lies too far out. Of the groups only
    /// those `asked` for are kept.
    ///
    /// Cost: some 250 MB/s on two cores; a file with faults, or written in an unusual way, is read three times.
    pub(crate) fn parse(
        path: &Path,
        bytes: &[u8],
        metres_per_unit: f64,
        asked: &BTreeSet<String>,
    ) -> Result<Self, InputError> {
        foreign::refuse(path, bytes, bytes.len() as u64, "an OBJ file")?;
        let read = Self::read_blocks(path, bytes, bytes.len() as u64, CUT, metres_per_unit, asked);
        read.map_or_else(|| Self::parse_tidied(path, bytes, metres_per_unit, asked), Ok)
    }

    /// The same for a file that the reader of blocks refuses, with words for what is wrong; if nothing is, the file is only
    /// written in an unusual way, and is read once more in a tidier one.
    fn parse_tidied(
        path: &Path,
        bytes: &[u8],
        metres_per_unit: f64,
        asked: &BTreeSet<String>,
    ) -> Result<Self, InputError> {
        let mut tidy = TidyObj::new(path, bytes, !asked.is_empty());
        let mut tidied = Vec::with_capacity(bytes.len());
        while tidy.next(&mut tidied) {}
        let TidyObj { refused, faces, names, .. } = tidy;
        if let Some(error) = refused {
            return Err(error);
        }
        if faces == 0 {
            let few = if names.dropped > 0 { " that have three different corners" } else { "" };
            let found = format!("an OBJ file without faces{few}");
            let error = InputError::new(Location::file(path), found, "lines that begin with f");
            return Err(error.hint("is it an OBJ file, exported with its faces?"));
        }
        let read = Self::read_blocks(path, &tidied[..], tidied.len() as u64, CUT, metres_per_unit, asked);
        let Self { vertices, triangles, material_of, groups, .. } =
            read.ok_or_else(|| bad_vertex(path, bytes, FARTHEST / metres_per_unit))?;
        // The lines of the names are those of the file as it is.
        Ok(Self { groups, ..Self::new(vertices, triangles, material_of, names) })
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
    /// Line of the first `usemtl` without a name.
    nameless: Option<usize>,
    /// Faces left out since they have no area whatever their vertices, and the line of the first.
    dropped: usize,
    first_dropped: usize,
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
            nameless: None,
            dropped: 0,
            first_dropped: 0,
        }
    }

    /// A line `usemtl`; whether it is another material than before.
    fn material(&mut self, mut name: String, line: usize) -> bool {
        if name.is_empty() || name == "#" || name.starts_with("# ") {
            self.nameless.get_or_insert(line);
            DEFAULT_MATERIAL.clone_into(&mut name);
        }
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

    /// Faces with fewer than three different corners, the first of them in this line.
    fn drop_faces(&mut self, count: usize, line: usize) {
        if self.dropped == 0 && count > 0 {
            self.first_dropped = line;
        }
        self.dropped += count;
    }

    /// What was left out or guessed.
    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if self.dropped > 0 {
            let (faces, first) = match self.dropped {
                1 => ("1 face".to_owned(), ""),
                faces => (format!("{faces} faces"), ", the first of them here"),
            };
            let at = Location::line(self.path, self.first_dropped);
            notes.push(format!("{at}: {faces} with fewer than three different corners left out{first}"));
        }
        if let (Some(line), true) = (self.nameless, self.number_of.contains_key(DEFAULT_MATERIAL)) {
            let at = Location::line(self.path, line);
            let material = quoted(DEFAULT_MATERIAL);
            notes.push(format!("{at}: usemtl without a name: the faces below are of material {material}"));
        }
        notes
    }
}

/// Whether corners are enough for a face: three that differ.
#[inline]
fn spans<T: PartialEq>(corners: &[T]) -> bool {
    let Some((first, rest)) = corners.split_first() else { return false };
    let mut others = rest.iter().filter(|corner| *corner != first);
    let second = others.next();
    second.is_some_and(|second| others.any(|corner| corner != second))
}

/// A file in a tidier way: vertices without colours, all of them first, as faces may stand above theirs; then faces without
/// textures and normals, counted from the file's beginning, and materials by number. What can't be read is refused in words.
struct TidyObj<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    lines: Lines<'a>,
    /// Number of the line last read.
    line: usize,
    /// Why reading ended early.
    refused: Option<InputError>,
    /// Vertices of the file, once all are read.
    vertices: Option<usize>,
    /// Vertices that stand above the line.
    above: usize,
    faces: usize,
    /// Corners of the current face, vertices counted from 0.
    corners: Vec<i128>,
    /// Whether what the last `usemtl` says is written.
    material_written: bool,
    with_groups: bool,
    names: Names<'a>,
}

impl<'a> TidyObj<'a> {
    fn new(path: &'a Path, bytes: &'a [u8], with_groups: bool) -> Self {
        Self {
            path,
            bytes,
            lines: Lines::new(bytes),
            line: 0,
            refused: None,
            vertices: None,
            above: 0,
            faces: 0,
            corners: Vec::new(),
            material_written: false,
            with_groups,
            names: Names::new(path, Groups::asking(&BTreeSet::new())),
        }
    }

    /// Writes what the next line comes to; false at the end.
    fn next(&mut self, out: &mut Vec<u8>) -> bool {
        let Some((number, line)) = self.lines.next() else { return self.rewind() };
        self.line = number;
        let (key, rest) = keyword(&line);
        let tidied = match (key, self.vertices) {
            (b"v", known) => {
                self.above += 1;
                if known.is_none() { self.vertex(rest, out) } else { Ok(()) }
            }
            (_, None) => Ok(()),
            (b"f", Some(vertices)) => self.face(rest, vertices, out),
            (b"usemtl", _) => {
                self.material_written &= !self.names.material(text(rest), number);
                Ok(())
            }
            (b"mtllib", _) => {
                self.names.library(text(rest), number);
                Ok(())
            }
            (b"g" | b"o", _) if self.with_groups => {
                out.extend_from_slice(key);
                out.push(b' ');
                out.extend_from_slice(rest);
                out.push(b'\n');
                Ok(())
            }
            _ => Ok(()),
        };
        self.refused = tidied.err();
        self.refused.is_none()
    }

    /// After the vertices all the rest; whether there is more to come.
    fn rewind(&mut self) -> bool {
        let first_time = self.vertices.is_none();
        if first_time {
            self.vertices = Some(std::mem::take(&mut self.above));
            self.lines = Lines::new(self.bytes);
        }
        first_time
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
        let taken = if words(rest).count() == 4 { 4 } else { 3 };
        let numbers: Option<Vec<f64>> = words(rest).take(taken).map(|word| text(word).parse().ok()).collect();
        let [x, y, z] = match numbers.as_deref() {
            Some(&[x, y, z]) => [x, y, z],
            Some(&[x, y, z, w]) if w != 0.0 => [x / w, y / w, z / w],
            _ => return Err(InputError::new(self.here(), quoted(&format!("v {}", text(rest))), POSITION)),
        };
        // A vertex at infinity is refused where a face has it.
        let [x, y, z] = [x, y, z].map(|x| if x.is_finite() { x } else { f64::MAX });
        writeln!(out, "v {x:e} {y:e} {z:e}").expect("memory takes it");
        Ok(())
    }

    fn face(&mut self, rest: &[u8], vertices: usize, out: &mut Vec<u8>) -> Result<(), InputError> {
        let count = words(rest).count();
        if count > MOST_CORNERS {
            let found = format!("a face with {count} corners");
            return Err(InputError::new(self.here(), found, format!("from 3 to {MOST_CORNERS}")));
        }
        self.corners.clear();
        for word in words(rest) {
            let corner = self.corner(word, rest, vertices)?;
            self.corners.push(corner);
        }
        if !spans(&self.corners) {
            self.names.drop_faces(1, self.line);
            return Ok(());
        }
        if let Some(corner) = self.corners.iter().position(|corner| !(0..vertices as i128).contains(corner)) {
            return Err(self.no_vertex(words(rest).nth(corner).unwrap_or_default(), vertices));
        }
        self.faces += 1;
        if !self.material_written {
            self.material_written = true;
            let number = self.names.number(self.line);
            writeln!(out, "usemtl {number}").expect("memory takes it");
        }
        out.push(b'f');
        for corner in &self.corners {
            write!(out, " {}", corner + 1).expect("memory takes it");
        }
        out.push(b'\n');
        Ok(())
    }

    /// The vertex that a corner names, counted from 0, be it there or not.
    fn corner(&self, word: &[u8], rest: &[u8], vertices: usize) -> Result<i128, InputError> {
        let vertex = vertex_of(word);
        if vertex.is_empty() {
            let found = format!("the corner {} without a vertex", quoted(&text(word)));
            return Err(InputError::new(self.here(), found, "a vertex number, as in f 1/1/1 2/2/1 3/3/1"));
        }
        match str::from_utf8(vertex).ok().and_then(|vertex| vertex.parse::<i128>().ok()) {
            Some(0) => Err(self.no_vertex(word, vertices)),
            Some(number) if number > 0 => Ok(number - 1),
            Some(number) => Ok(self.above as i128 + number),
            None => Err(InputError::new(self.here(), quoted(&format!("f {}", text(rest))), CORNERS)),
        }
    }

    /// Refuses a corner that names no vertex.
    fn no_vertex(&self, word: &[u8], vertices: usize) -> InputError {
        let index = text(vertex_of(word));
        let below = index.starts_with('-');
        let digits = index.trim_start_matches(['-', '+', '0']);
        let expected = match self.above {
            _ if vertices == 0 => "a vertex of this file, which has none".to_owned(),
            0 if below => format!("1 … {vertices}, as no vertex stands above"),
            above if below && !digits.is_empty() => format!("no less than -{above}, as {above} vertices stand above"),
            _ => format!("1 … {vertices}"),
        };
        let error = InputError::new(self.here(), format!("vertex {index} in a face"), expected);
        if vertices > 0 && digits.is_empty() {
            return error.hint("OBJ counts from 1");
        }
        error
    }
}

fn is_finite_number(word: &[u8]) -> bool {
    str::from_utf8(word).is_ok_and(|word| word.parse::<f64>().is_ok_and(f64::is_finite))
}

/// The vertex number of a corner, such as the first of `1/2/3`.
fn vertex_of(corner: &[u8]) -> &[u8] {
    corner.split(|&byte| byte == b'/').next().unwrap_or_default()
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
