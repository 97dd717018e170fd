//! Faces that are drawn twice.
//!
//! Some programs, SketchUp above all, write each face twice: the front with its material and, the other way round, the
//! back with another. Light would meet the one or the other by chance. Here they become one face, the first of them in
//! the file, with what the other is on its [back](Material::back). A face that is repeated the same way round is left
//! out.

mod find;
mod patches;

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use rayon::prelude::*;

use super::inventory::Origin;
use super::material::{Material, Sides};
use super::surface::Surface;
use crate::text::quoted;
use patches::Patch;

/// What is made of the triangles of a mesh.
#[derive(Default)]
pub(crate) struct DoubleFaces {
    /// Those that are left out, ascending.
    pub(crate) left_out: Vec<usize>,
    /// Number of those that are repetitions.
    pub(crate) repeated: usize,
    /// A triangle that stays and the one behind it that is left out, ascending.
    pub(crate) backs: Vec<[u32; 2]>,
    /// What the triangles of `backs` are now.
    pub(crate) becomes: Vec<Becomes>,
    /// Materials with a back of their own.
    pub(crate) two_sided: Vec<(Material, Origin)>,
}

/// The material of a face that was drawn twice.
#[derive(Clone, Copy)]
pub(crate) enum Becomes {
    /// One of the mesh's own.
    Own(u32),
    /// One of [`DoubleFaces::two_sided`].
    TwoSided(u32),
}

/// What two faces back to back make together.
#[derive(Clone, Copy)]
enum FacePair {
    One(Becomes),
    /// They stay as they are.
    Two,
}

/// A mesh's triangles and what they are made of.
pub(crate) struct Faces<'a> {
    /// Local positions.
    pub(crate) vertices: &'a [[f32; 3]],
    pub(crate) triangles: &'a [[u32; 3]],
    /// Number in `surfaces` of each triangle's.
    pub(crate) material_of: &'a [u32],
    pub(crate) surfaces: &'a [Surface],
    /// Triangles without area, ascending: they are no one's double.
    pub(crate) flat: &'a [usize],
}

impl Faces<'_> {
    /// Makes one face of each that is drawn twice; `file` is the mesh's. Cost: O(n log n), by all threads.
    pub(crate) fn single(&self, file: &str, warnings: &mut Vec<String>) -> DoubleFaces {
        let is_flat = |index: u32| self.flat.binary_search(&(index as usize)).is_ok();
        let exact = find::find(self.vertices, self.triangles, is_flat);
        let mut doubled: Vec<u32> = exact.repeated.iter().map(|[again, _]| *again).collect();
        doubled.extend(exact.backs.iter().flatten());
        doubled.sort_unstable();
        let alone = |index: &u32| doubled.binary_search(index).is_err() && !is_flat(*index);
        let rest: Vec<u32> = (0..self.triangles.len() as u32).into_par_iter().filter(alone).collect();
        let patches = patches::find(self.vertices, self.triangles, &rest);

        let mut settled = Settled { faces: self, known: BTreeMap::new(), shining: 0, doubles: DoubleFaces::default() };
        settled.look_for_whole_sheets(&exact.backs, &patches);
        for &[front, back] in &exact.backs {
            settled.pair(&[front], &[back], &[back], &[front]);
        }
        for patch in &patches {
            settled.pair(&patch.front, &patch.back, &patch.behind, &patch.before);
        }
        settled.tell(file, &exact.repeated, warnings);
        let mut doubles = settled.doubles;
        doubles.repeated = exact.repeated.len();
        doubles.left_out.extend(exact.repeated.iter().map(|[again, _]| *again as usize));
        doubles.left_out.sort_unstable();
        let mut order: Vec<usize> = (0..doubles.backs.len()).collect();
        order.sort_unstable_by_key(|&index| doubles.backs[index]);
        doubles.backs = order.iter().map(|&index| doubles.backs[index]).collect();
        doubles.becomes = order.iter().map(|&index| doubles.becomes[index]).collect();
        doubles
    }

    fn surface(&self, triangle: u32) -> u32 {
        self.material_of[triangle as usize]
    }

    fn shines(&self, triangles: &[u32]) -> bool {
        triangles.iter().any(|&triangle| self.surfaces[self.surface(triangle) as usize].luminance.is_some())
    }
}

/// Decides about doubles, one after the other.
struct Settled<'a> {
    faces: &'a Faces<'a>,
    /// What two surfaces make together, front and back, and how often.
    known: BTreeMap<[u32; 2], (FacePair, usize)>,
    /// Triangles that shine, with others that shine behind them.
    shining: usize,
    doubles: DoubleFaces,
}

impl Settled<'_> {
    /// Glass whose every triangle has a back is no body but sheets.
    fn look_for_whole_sheets(&mut self, backs: &[[u32; 2]], patches: &[Patch]) {
        let faces = self.faces;
        // The glass that all of some triangles are.
        let glass = |front: &[u32], back: &[u32]| {
            let first = faces.surface(*front.first()?);
            let is_glass = faces.surfaces[first as usize].material.dielectric.is_some();
            let alike = || front.iter().chain(back).all(|&triangle| faces.surface(triangle) == first);
            (is_glass && alike()).then_some(first)
        };
        let mut left: HashMap<u32, i64> = HashMap::new();
        for [front, back] in backs {
            if let Some(surface) = glass(&[*front], &[*back]) {
                *left.entry(surface).or_default() -= 2;
            }
        }
        for Patch { front, back, .. } in patches {
            if let Some(surface) = glass(front, back) {
                *left.entry(surface).or_default() -= (front.len() + back.len()) as i64;
            }
        }
        if left.is_empty() {
            return;
        }
        for (index, surface) in faces.material_of.iter().enumerate() {
            if let Some(count) = left.get_mut(surface).filter(|_| faces.flat.binary_search(&index).is_err()) {
                *count += 1;
            }
        }
        let whole = left.into_iter().filter(|(_, count)| *count == 0).map(|(surface, _)| surface);
        self.known.extend(whole.map(|surface| ([surface; 2], (FacePair::One(Becomes::Own(surface)), 0))));
    }

    /// Settles triangles back to back: `behind` are the backs of each of the front, `before` the other way.
    fn pair(&mut self, front: &[u32], back: &[u32], behind: &[u32], before: &[u32]) {
        let (kept, left, behind) = match (self.faces.shines(front), self.faces.shines(back)) {
            (true, true) => {
                self.shining += front.len();
                return;
            }
            // What shines stays where it is, with its front.
            (false, true) => (back, front, before),
            _ => (front, back, behind),
        };
        let outcomes: Vec<FacePair> =
            kept.iter().zip(behind).map(|(&front, &back)| self.outcome(front, back)).collect();
        if outcomes.iter().any(|outcome| matches!(outcome, FacePair::Two)) {
            return;
        }
        for ((&front, &back), outcome) in kept.iter().zip(behind).zip(outcomes) {
            if let FacePair::One(becomes) = outcome {
                self.doubles.backs.push([front, back]);
                self.doubles.becomes.push(becomes);
            }
        }
        self.doubles.left_out.extend(left.iter().map(|&triangle| triangle as usize));
    }

    fn outcome(&mut self, front: u32, back: u32) -> FacePair {
        let key = [self.faces.surface(front), self.faces.surface(back)];
        if let Some((known, count)) = self.known.get_mut(&key) {
            *count += 1;
            return *known;
        }
        let [front, back] = key.map(|surface| &self.faces.surfaces[surface as usize]);
        let outcome = match made_of(&front.material, &back.material) {
            Made::Front => FacePair::One(Becomes::Own(key[0])),
            Made::Back => FacePair::One(Becomes::Own(key[1])),
            Made::New(material) => {
                let mut origin = front.origin.clone();
                if key[0] != key[1] {
                    origin.notes.extend(back.origin.notes.iter().map(|note| format!("back: {note}")));
                }
                self.doubles.two_sided.push((material, origin));
                FacePair::One(Becomes::TwoSided(self.doubles.two_sided.len() as u32 - 1))
            }
            Made::Both => FacePair::Two,
        };
        self.known.insert(key, (outcome, 1));
        outcome
    }

    /// One line for each guess, and one for what is repeated.
    fn tell(&self, file: &str, repeated: &[[u32; 2]], warnings: &mut Vec<String>) {
        let triangles = |count: usize| if count == 1 { "1 triangle".to_owned() } else { format!("{count} triangles") };
        if !repeated.is_empty() {
            let name = |triangle: u32| &self.faces.surfaces[self.faces.surface(triangle) as usize].material.name;
            let mut others = repeated.iter().map(|&[again, first]| [name(first), name(again)]).filter(|[a, b]| a != b);
            let over = others.next().map_or(String::new(), |[first, again]| {
                format!("; the first in the file counts, such as {} over {}", quoted(first), quoted(again))
            });
            warnings.push(format!(
                "{file}: {} that lie on others the same way round left out{over}",
                triangles(repeated.len())
            ));
        }
        if self.shining > 0 {
            let what = "light that meets them meets either by chance: keep one";
            warnings.push(format!("{file}: {} shine back to back with others: {what}", triangles(self.shining)));
        }
        let said = |(&key, &(outcome, count)): (&[u32; 2], &(FacePair, usize))| {
            let [front, back] = key.map(|surface| &self.faces.surfaces[surface as usize].material);
            Some(format!("{file}: {} of {}", triangles(count), guess(front, back, outcome, key)?))
        };
        let guesses: Vec<String> = self.known.iter().filter_map(said).collect();
        warnings.extend(guesses.iter().take(MOST_LINES).cloned());
        if let Some(more) = guesses.len().checked_sub(MOST_LINES).filter(|more| *more > 0) {
            warnings.push(format!("{file}: {more} more pairs of materials back to back of which light passes one"));
        }
    }
}

/// Most warnings about materials back to back.
const MOST_LINES: usize = 8;

/// What a front and a back make together.
enum Made {
    /// A face of the front's material.
    Front,
    /// A face of the back's material.
    Back,
    New(Material),
    /// Nothing that one face could be.
    Both,
}

/// Whether two materials do the same, whatever their names.
fn alike(one: &Material, other: &Material) -> bool {
    Material { name: one.name.clone(), ..other.clone() } == *one
}

fn made_of(front: &Material, back: &Material) -> Made {
    let alike = alike(front, back);
    // On bodies of glass it matters which side is which.
    match (front.dielectric.is_some() || back.dielectric.is_some(), alike) {
        (true, _) => return Made::Both,
        (_, true) if front.sides == Sides::One => return Made::New(Material { sides: Sides::Two, ..front.clone() }),
        (_, true) => return Made::Front,
        _ => {}
    }
    match [front, back].map(|side| (side.glazing.is_some(), side.is_translucent())) {
        [(true, _), _] => Made::Front,
        [_, (true, _)] => Made::Back,
        [(_, true), _] => Made::Front,
        [_, (_, true)] => Made::Back,
        _ => Made::New(Material {
            name: format!("{} / {}", front.name, back.name),
            sides: Sides::Two,
            back: Some(Arc::new(Material { sides: Sides::Two, ..back.clone() })),
            ..front.clone()
        }),
    }
}

/// What is to be said of faces back to back where it isn't plain what they mean.
fn guess(front: &Material, back: &Material, outcome: FacePair, key: [u32; 2]) -> Option<String> {
    let names = format!("{} and {} back to back", quoted(&front.name), quoted(&back.name));
    let passes = |side: &Material| side.glazing.is_some() || side.is_translucent();
    let [one, _] = key;
    match outcome {
        FacePair::Two => Some(format!(
            "{names}, one of them glass with an inside: light meets either by chance; take one away, or make it glazing"
        )),
        FacePair::One(Becomes::Own(taken)) if !alike(front, back) && (passes(front) || passes(back)) => {
            let taken = if taken == one { front } else { back };
            Some(format!("{names}: both sides taken for {}, which light passes", quoted(&taken.name)))
        }
        FacePair::One(_) => None,
    }
}
