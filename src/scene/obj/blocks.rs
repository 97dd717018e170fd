//! OBJ files block by block: lines parsed by all threads, joined in the order of the file.
//!
//! Each run of faces of one material has vertices of its own, in the order in which its faces first name them. Whatever is
//! wrong or unusual ends the reading with `None`; [`Obj::parse`] then finds words for it, or a tidier way to write the file.
//! Unusual is: a vertex number of more than 18 digits, a line of more than 64 MiB, a file of an old Mac, whose lines end with
//! `\r` alone.
//!
//! Three batches of blocks are in work at once: while one is read and hashed, the one before is parsed and the one
//! before that joined to the mesh. So memory holds the mesh and some 30 MB of the file. Where a face stands above one
//! of its vertices, it and all that follows wait for the file's end, as numbers.

use std::collections::BTreeSet;
use std::io::Read;
use std::path::Path;

use glam::DVec3;
use rayon::prelude::*;

use super::super::fields::{FARTHEST, Placed};
use super::super::lines::{Lines, keyword, text, words};
use super::super::measured::Groups;
use super::foreign::{self, HEAD};
use super::{MOST_CORNERS, Names, Obj, number, spans};
use crate::error::InputError;

/// How the file is cut.
#[derive(Clone, Copy)]
pub(crate) struct Cut {
    /// Bytes of a block.
    pub(crate) block: usize,
    /// Blocks of a batch.
    pub(crate) blocks: usize,
}

/// Small enough for a processor's cache, large enough that the work for a block outweighs that of handing it over.
pub(crate) const CUT: Cut = Cut { block: 1 << 20, blocks: 8 };

/// Longest line, bytes.
const LONGEST_LINE: usize = 64 << 20;

impl Obj {
    /// Reads an OBJ file of `length` bytes from `source`; `None` if something is wrong with it, or unusual.
    pub(crate) fn read_blocks(
        path: &Path,
        mut source: impl Read + Send,
        length: u64,
        cut: Cut,
        metres_per_unit: f64,
        asked: &BTreeSet<String>,
    ) -> Option<Self> {
        let with_groups = !asked.is_empty();
        let mut head = Vec::with_capacity(HEAD);
        source.by_ref().take(HEAD as u64).read_to_end(&mut head).ok()?;
        foreign::refuse(path, &head, length, "").ok()?;
        let source = head.as_slice().chain(source);
        let mut source = BlockReader { source, cut, rest: Vec::new(), first: true, ended: false };
        let mut joined = Joined::new(path, FARTHEST / metres_per_unit, Groups::asking(asked), cut.blocks);
        let mut texts = source.batch()?;
        let mut blocks = Vec::new();
        while !(texts.is_empty() && blocks.is_empty()) {
            let (next, (parsed, added)) = rayon::join(
                || source.batch(),
                || {
                    let parse = || texts.par_iter().map(|text| Block::parse(text, with_groups)).collect::<Option<_>>();
                    rayon::join(parse, || joined.add(blocks))
                },
            );
            added?;
            (texts, blocks) = (next?, parsed?);
        }
        joined.finish()
    }
}

/// The file as blocks of whole lines.
struct BlockReader<R> {
    source: R,
    cut: Cut,
    /// What is read already of the next block.
    rest: Vec<u8>,
    first: bool,
    ended: bool,
}

impl<R: Read> BlockReader<R> {
    /// The next blocks; none at the end.
    fn batch(&mut self) -> Option<Vec<Vec<u8>>> {
        let mut batch = Vec::with_capacity(self.cut.blocks);
        while batch.len() < self.cut.blocks && !self.ended {
            batch.push(self.block()?);
        }
        Some(batch)
    }

    fn block(&mut self) -> Option<Vec<u8>> {
        let mut block = Vec::with_capacity(self.cut.block.max(self.rest.len()));
        block.append(&mut self.rest);
        loop {
            // As long as no line ends, twice as much.
            let wanted = if block.len() < self.cut.block { self.cut.block } else { 2 * block.len() };
            let missing = wanted - block.len();
            let read = self.source.by_ref().take(missing as u64).read_to_end(&mut block).ok()?;
            self.ended = read < missing;
            let end = if self.ended { Some(block.len()) } else { last_line_end(&block) };
            if let Some(end) = end {
                self.rest = block[end..].to_vec();
                block.truncate(end);
                break;
            }
            if block.len() > LONGEST_LINE {
                return None;
            }
        }
        if std::mem::take(&mut self.first) {
            if self.ended && !block.contains(&b'\n') && block.contains(&b'\r') {
                return None;
            }
            if block.starts_with(b"\xef\xbb\xbf") {
                block.drain(..3);
            }
        }
        Some(block)
    }
}

/// Behind the last line that no backslash may join to the next.
fn last_line_end(block: &[u8]) -> Option<usize> {
    let mut end = block.len();
    loop {
        end = block[..end].iter().rposition(|&byte| byte == b'\n')?;
        let joined = block[..end].iter().rfind(|&&byte| byte == b'\n' || !byte.is_ascii_whitespace()) == Some(&b'\\');
        if !joined {
            return Some(end + 1);
        }
    }
}

/// What the lines of a block say.
#[derive(Default)]
struct Block {
    positions: Vec<DVec3>,
    faces: Vec<FaceLine>,
    /// Corners of all faces, one after another.
    corners: Vec<Corner>,
    /// How many vertices there must be for those corners that count from the file's beginning.
    needed: i64,
    /// Whether a face counts some vertices from the file's beginning and some from below: only once the block's place
    /// is known can be said whether they differ.
    mixed: bool,
    /// Lines of faces left out for want of three different corners, ascending.
    dropped: Vec<u32>,
    orders: Vec<Order>,
    lines: usize,
    /// Vertices before the block, once that is known.
    before: usize,
}

struct FaceLine {
    corners: u32,
    /// In its block.
    line: u32,
}

/// A vertex number from 0 on: within the file, or, less [`IN_BLOCK`], within the block, negative above its beginning.
#[derive(Clone, Copy, PartialEq)]
struct Corner(i64);

/// Far from any number a file may hold.
const IN_BLOCK: i64 = 1 << 62;

/// A line that isn't geometry.
struct Order {
    kind: StatementKind,
    text: String,
    line: usize,
    /// Faces above it in its block.
    faces: usize,
}

enum StatementKind {
    Material,
    Library,
    Group,
    Object,
}

impl Block {
    fn parse(bytes: &[u8], with_groups: bool) -> Option<Self> {
        let mut block = Self::default();
        let mut lines = Lines::continued(bytes);
        for (line, content) in lines.by_ref() {
            let (key, rest) = keyword(&content);
            let kind = match key {
                b"v" => {
                    block.positions.push(position(rest)?);
                    continue;
                }
                b"f" => {
                    block.face(rest, line as u32)?;
                    continue;
                }
                b"usemtl" => StatementKind::Material,
                b"mtllib" => StatementKind::Library,
                b"g" if with_groups => StatementKind::Group,
                b"o" if with_groups => StatementKind::Object,
                _ => continue,
            };
            block.orders.push(Order { kind, text: text(rest), line, faces: block.faces.len() });
        }
        block.lines = lines.count_so_far();
        Some(block)
    }

    fn face(&mut self, rest: &[u8], line: u32) -> Option<()> {
        let before = self.corners.len();
        let above = self.positions.len() as i64;
        let (mut needed, mut from_below) = (0, 0);
        for word in words(rest) {
            let corner = Corner::parse(word, above)?;
            if corner.counts_from_below() {
                from_below += 1;
            } else {
                needed = needed.max(corner.0 + 1);
            }
            self.corners.push(corner);
        }
        let own = &self.corners[before..];
        if own.len() > MOST_CORNERS {
            return None;
        }
        if !spans(own) {
            self.corners.truncate(before);
            self.dropped.push(line);
            return Some(());
        }
        self.mixed |= from_below > 0 && from_below < own.len();
        self.needed = self.needed.max(needed);
        self.faces.push(FaceLine { corners: own.len() as u32, line });
        Some(())
    }

    /// Leaves out the faces whose corners turn out to be the same, once it is known how many vertices stand before the
    /// block.
    fn settle(&mut self) {
        let faces = std::mem::take(&mut self.faces);
        let corners = std::mem::take(&mut self.corners);
        let mut rest = corners.as_slice();
        let mut orders = self.orders.iter_mut().peekable();
        for (index, face) in faces.into_iter().enumerate() {
            while let Some(order) = orders.next_if(|order| order.faces == index) {
                order.faces = self.faces.len();
            }
            let (own, others) = rest.split_at(face.corners as usize);
            rest = others;
            let numbers: Vec<i64> = own.iter().map(|corner| corner.within_file(self.before)).collect();
            if spans(&numbers) {
                self.corners.extend_from_slice(own);
                self.faces.push(face);
            } else {
                self.dropped.push(face.line);
            }
        }
        orders.for_each(|order| order.faces = self.faces.len());
        self.dropped.sort_unstable();
    }
}

/// x y z, divided by w where that stands alone behind them.
fn position(rest: &[u8]) -> Option<DVec3> {
    let mut numbers = words(rest).map(number::parse);
    let position = DVec3::new(numbers.next()??, numbers.next()??, numbers.next()??);
    let Some(w) = numbers.next() else { return Some(position) };
    match numbers.next() {
        None => Some(position / w.filter(|&w| w != 0.0)?),
        Some(more) => {
            w.and(more)?;
            numbers.all(|number| number.is_some()).then_some(position)
        }
    }
}

impl Corner {
    /// `7`, `-7`, `7/1`, `7/1/2` or `7//2`, with so many vertices above it in its block.
    fn parse(word: &[u8], above: i64) -> Option<Self> {
        let (negative, digits) = match word {
            [b'-', digits @ ..] => (true, digits),
            [b'+', digits @ ..] => (false, digits),
            digits => (false, digits),
        };
        let (mut number, mut count) = (0_i64, 0);
        for &byte in digits.iter().take_while(|&&byte| byte != b'/') {
            if !byte.is_ascii_digit() || count == 18 {
                return None;
            }
            number = 10 * number + i64::from(byte - b'0');
            count += 1;
        }
        // Vertex 0 doesn't exist.
        match (number, negative) {
            (0, _) => None,
            (_, true) => Some(Self(IN_BLOCK + above - number)),
            (_, false) => Some(Self(number - 1)),
        }
    }

    /// Whether it counts from below: `-1` is the vertex last read.
    #[inline]
    fn counts_from_below(self) -> bool {
        self.0 > IN_BLOCK / 2
    }

    /// Number of the vertex within the file, be it there or not, with `before` vertices before the block.
    #[inline]
    fn within_file(self, before: usize) -> i64 {
        if self.counts_from_below() { self.0 - IN_BLOCK + before as i64 } else { self.0 }
    }
}

/// The mesh so far.
struct Joined<'a> {
    /// Largest coordinate allowed.
    farthest: f64,
    /// The vertices of the file.
    positions: Vec<DVec3>,
    /// Where each of them stands in `vertices`, for the last run of faces that names it.
    new_number: Vec<u32>,
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    material_of: Vec<u32>,
    /// Material of the run of faces, and its first vertex.
    run: Option<(u32, usize)>,
    faces: usize,
    lines: usize,
    names: Names<'a>,
    /// From the first block on that names vertices which stand below it.
    waiting: Vec<Block>,
    /// Blocks that are joined at once.
    batch: usize,
}

/// The faces of a block, their corners numbered as the mesh does.
struct BlockFaces {
    arities: Vec<FaceLine>,
    corners: Vec<u32>,
    /// How many faces have which material, one after another.
    stretches: Vec<(usize, u32)>,
}

/// Marks a vertex that no face has named yet.
const NONE: u32 = u32::MAX;

impl<'a> Joined<'a> {
    fn new(path: &'a Path, farthest: f64, groups: Groups, batch: usize) -> Self {
        Self {
            farthest,
            positions: Vec::new(),
            new_number: Vec::new(),
            vertices: Vec::new(),
            triangles: Vec::new(),
            material_of: Vec::new(),
            run: None,
            faces: 0,
            lines: 0,
            names: Names::new(path, groups),
            waiting: Vec::new(),
            batch,
        }
    }

    /// Adds blocks, in the order of the file.
    fn add(&mut self, blocks: Vec<Block>) -> Option<()> {
        let mut ready = Vec::with_capacity(blocks.len());
        for mut block in blocks {
            block.before = self.positions.len();
            self.positions.extend_from_slice(&std::mem::take(&mut block.positions));
            if self.waiting.is_empty() && block.needed <= self.positions.len() as i64 {
                ready.push(block);
            } else {
                self.waiting.push(block);
            }
        }
        self.new_number.resize(self.positions.len(), NONE);
        self.join(ready)
    }

    /// Adds the faces of blocks whose vertices are known.
    fn join(&mut self, blocks: Vec<Block>) -> Option<()> {
        let (first_face, first_vertex) = (self.faces, self.vertices.len());
        let faces = blocks.into_iter().map(|block| self.number(block)).collect::<Option<Vec<_>>>()?;
        let inside = |vertex: &DVec3| vertex.abs().max_element() <= self.farthest;
        if !self.vertices[first_vertex..].par_iter().all(inside) {
            return None;
        }
        let triangles: Vec<_> = faces.par_iter().map(|faces| faces.triangles(&self.vertices)).collect();

        let mut face = first_face;
        for (faces, (triangles, counts)) in faces.iter().zip(triangles) {
            self.triangles.extend_from_slice(&triangles);
            for (&(count, material), triangles) in faces.stretches.iter().zip(counts) {
                self.names.groups.face(face, self.material_of.len());
                self.material_of.resize(self.material_of.len() + triangles, material);
                face += count;
            }
        }
        Some(())
    }

    /// Adds a block's names, and numbers the corners of its faces.
    fn number(&mut self, mut block: Block) -> Option<BlockFaces> {
        if block.mixed {
            block.settle();
        }
        if let Some(&first) = block.dropped.first() {
            self.names.drop_faces(block.dropped.len(), self.lines + first as usize);
        }
        let mut corners = Vec::with_capacity(block.corners.len());
        let mut stretches = Vec::new();
        let mut rest = block.corners.as_slice();
        let mut orders = block.orders.into_iter().peekable();
        let mut face = 0;
        loop {
            while let Some(order) = orders.next_if(|order| order.faces == face) {
                self.take(order, face);
            }
            let end = orders.peek().map_or(block.faces.len(), |order| order.faces);
            if end == face {
                break;
            }
            let material = self.names.number(self.lines + block.faces[face].line as usize);
            if self.run.is_none_or(|(current, _)| current != material) {
                self.run = Some((material, self.vertices.len()));
            }
            let first_of_run = self.run.map_or(0, |(_, first)| first);
            stretches.push((end - face, material));
            for FaceLine { corners: count, .. } in &block.faces[face..end] {
                let (own, others) = rest.split_at(*count as usize);
                rest = others;
                for corner in own {
                    let number = usize::try_from(corner.within_file(block.before)).ok()?;
                    let known = self.new_number.get_mut(number)?;
                    if *known == NONE || (*known as usize) < first_of_run {
                        *known = u32::try_from(self.vertices.len()).ok().filter(|&number| number != NONE)?;
                        self.vertices.push(self.positions[number]);
                    }
                    corners.push(*known);
                }
            }
            face = end;
        }
        self.lines += block.lines;
        self.faces += block.faces.len();
        Some(BlockFaces { arities: block.faces, corners, stretches })
    }

    /// Takes up what a line says of the faces below it; `face` of its block stand above.
    fn take(&mut self, order: Order, face: usize) {
        let line = self.lines + order.line;
        match order.kind {
            StatementKind::Material => drop(self.names.material(order.text, line)),
            StatementKind::Library => self.names.library(order.text, line),
            StatementKind::Group => self.names.groups.line(0, &order.text, self.faces + face),
            StatementKind::Object => self.names.groups.line(1, &order.text, self.faces + face),
        }
    }

    fn finish(mut self) -> Option<Obj> {
        let mut waiting = std::mem::take(&mut self.waiting).into_iter();
        while waiting.len() > 0 {
            self.join(waiting.by_ref().take(self.batch).collect())?;
        }
        let Self { vertices, triangles, material_of, names, .. } = self;
        (self.faces > 0).then(|| Obj::new(vertices, triangles, material_of, names))
    }
}

impl BlockFaces {
    /// All triangles, and how many each stretch has.
    fn triangles(&self, vertices: &[DVec3]) -> (Vec<[u32; 3]>, Vec<usize>) {
        let mut triangles = Vec::with_capacity(self.corners.len() - 2 * self.arities.len());
        let mut counts = Vec::with_capacity(self.stretches.len());
        let mut arities = self.arities.iter();
        let mut rest = self.corners.as_slice();
        for &(count, _) in &self.stretches {
            let before = triangles.len();
            for face in arities.by_ref().take(count) {
                let (corners, others) = rest.split_at(face.corners as usize);
                rest = others;
                super::add_face(corners, 0, vertices, &mut triangles);
            }
            counts.push(triangles.len() - before);
        }
        (triangles, counts)
    }
}

/// Reads a text as it is, cut in several ways, and tidied: how many triangles it has, or why it is refused, and whether it was
/// read as it is. For tests and fuzz targets.
///
/// # Panics
/// Where the readers don't agree.
#[doc(hidden)]
pub fn read_obj_both_ways(text: &[u8]) -> (Result<usize, InputError>, bool) {
    const ASKED: [&str; 2] = ["a", "b c"];
    // Everything that both readers find, coordinates as bits.
    let told = |obj: &Obj| {
        let bits: Vec<[u64; 3]> = obj.vertices.iter().map(|vertex| vertex.to_array().map(f64::to_bits)).collect();
        let places = |names: &[Placed<String>]| -> Vec<String> {
            names.iter().map(|name| format!("{}: {}", name.at, name.value)).collect()
        };
        let ranges = ASKED.map(|group| obj.groups.ranges(group, obj.triangles.len()));
        (
            (bits, obj.triangles.clone(), obj.material_of.clone()),
            (places(&obj.materials), places(&obj.libraries), obj.named.clone()),
            (ranges, obj.groups.named.clone(), obj.notes.clone()),
        )
    };
    let path = Path::new("mesh.obj");
    let asked = ASKED.map(str::to_owned).into();
    let tidied = foreign::refuse(path, text, text.len() as u64, "an OBJ file");
    let tidied = tidied.and_then(|()| Obj::parse_tidied(path, text, 0.5, &asked));
    let cuts: &[_] = if text.len() < 4096 { &[(1, 1), (7, 3), (64, 2), (1 << 20, 1)] } else { &[(1000, 3)] };
    let taken = cuts.iter().map(|&(block, blocks)| {
        let read = Obj::read_blocks(path, text, text.len() as u64, Cut { block, blocks }, 0.5, &asked);
        if let Some(read) = &read {
            let tidied = tidied.as_ref().expect("only a good file is taken");
            assert!(told(read) == told(tidied), "the readers differ on {}", String::from_utf8_lossy(text));
        }
        read.is_some()
    });
    let taken: Vec<bool> = taken.collect();
    assert!(taken.iter().all(|&now| now == taken[0]), "how a file is cut makes no difference");
    if let Ok(obj) = &tidied {
        let corners = obj.triangles.as_flattened();
        assert!(
            corners.iter().all(|&corner| (corner as usize) < obj.vertices.len())
                && obj.vertices.iter().all(|v| v.is_finite())
        );
    }
    (tidied.map(|obj| obj.triangles.len()), taken[0])
}

#[cfg(test)]
mod tests;
