//! Emitting faces of a mesh: what is odd about them.
//!
//! `Ke` is a luminance in cd/m² here, and in the programs that write it a colour, or a strength without a unit. So what
//! it came to is told in the plan, and a warning where it can hardly be meant.

use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;

use super::material::Material;
use crate::geometry::mesh::{Bounds, Mesh};
use crate::luminaire::{Luminaire, Opening};
use crate::text::listed;
use crate::text::number::short;
use crate::text::quoted;

/// Below it nothing is a lamp, cd/m²: a white wall at 30 lx has as much, a dimmed screen twenty times, a lit panel
/// 3000.
const DIM: f64 = 10.0;
/// Below it nothing lights a room in which other lamps give a thousand times its light, cd/m²; screens and signs begin
/// there.
const FAINT: f64 = 100.0;
/// The part of all light below which a faint emitter is reported.
const PART: f64 = 1e-3;
/// Something opaque so near before a lamp leaves it a gap to light, m; a board behind a diffuser stands as near, but
/// that lets light through.
const AT_HAND: f64 = 0.02;
/// The same as a part of the lamp's size (root of its area): small lamps have walls nearer. Of the light between two
/// plates a tenth of their side apart, 83 % goes from one to the other.
const AT_HAND_PART: f64 = 0.1;
/// Points of an emitter at which it is asked what stands before it.
const PROBES: usize = 64;
/// Emitters that are asked, those of most flux first: more are hardly ever there.
const MOST: usize = 256;

/// A luminaire that is faces of a mesh, and what came of its `Ke`.
#[derive(Clone, Copy)]
pub(crate) struct Emitter<'a> {
    pub(crate) luminaire: &'a Luminaire,
    triangles: &'a [[DVec3; 3]],
    /// m².
    pub(crate) area: f64,
    /// At full output, cd/m².
    pub(crate) luminance: f64,
}

/// All emitting faces among luminaires, those of most flux first.
pub(crate) fn of(luminaires: &[Luminaire]) -> Vec<Emitter<'_>> {
    let mut all: Vec<Emitter> = luminaires.iter().filter_map(Emitter::new).collect();
    all.sort_by(|a, b| b.luminaire.flux.0.total_cmp(&a.luminaire.flux.0));
    all
}

impl<'a> Emitter<'a> {
    fn new(luminaire: &'a Luminaire) -> Option<Self> {
        let Opening::Triangles(triangles) = &luminaire.opening else { return None };
        let area: f64 = triangles.iter().map(area).sum();
        let luminance = luminaire.flux.0 / luminaire.supply.level / (PI * area);
        Some(Self { luminaire, triangles, area, luminance })
    }

    /// What became of it, in words.
    pub(crate) fn told(&self) -> String {
        let Self { luminaire, area, luminance, .. } = self;
        format!("{} cd/m² on {} m²: {} lm", short(*luminance), short(*area), short(luminaire.flux.0))
    }
}

fn area(&[a, b, c]: &[DVec3; 3]) -> f64 {
    (b - a).cross(c - a).length() / 2.0
}

/// Warns of emitters that are dimmer than any lamp, or face a wall.
pub(crate) fn warn(luminaires: &[Luminaire], mesh: &Mesh, materials: &[Material], warnings: &mut Vec<String>) {
    let emitters = of(luminaires);
    let all: f64 = luminaires.iter().map(|luminaire| luminaire.flux.0 / luminaire.supply.level).sum();
    let faint = |emitter: &&Emitter| {
        let part = PI * emitter.luminance * emitter.area / all;
        emitter.luminance < DIM || (emitter.luminance < FAINT && part < PART)
    };
    let dim: Vec<&Emitter> = emitters.iter().filter(faint).collect();
    const CURE: &str = "programs write Ke without a unit; here it is cd/m², a lit panel has some 3000";
    match dim.as_slice() {
        [] => {}
        [one] => {
            warnings.push(format!(
                "material {} shines less than any lamp, {}: {CURE}",
                quoted(&one.luminaire.name),
                one.told()
            ));
        }
        more => {
            let names = listed(more.iter().map(|emitter| emitter.luminaire.name.as_str()));
            let most = more.iter().map(|emitter| emitter.luminance).fold(0.0, f64::max);
            let flux: f64 = more.iter().map(|emitter| emitter.luminaire.flux.0).sum();
            let what = format!("{} cd/m² at most, {} lm in all", short(most), short(flux));
            warnings.push(format!("materials {names} shine less than any lamp, {what}: {CURE}"));
        }
    }
    for (emitter, wall) in facing_walls(&emitters[..emitters.len().min(MOST)], mesh, materials) {
        let (name, wall) = (quoted(&emitter.luminaire.name), quoted(wall));
        let reach = short(1e3 * emitter.reach());
        let cure = "turn its faces, whose vertices run counter-clockwise seen from the front, or move it";
        warnings
            .push(format!("material {name} shines at {wall}, less than {reach} mm before it: is it turned? {cure}"));
    }
}

impl Emitter<'_> {
    /// How near something has to stand to be at hand, m.
    fn reach(&self) -> f64 {
        AT_HAND.min(AT_HAND_PART * self.area.sqrt())
    }

    /// Points all over it, and the outward normals there.
    fn probes(&self) -> Vec<(DVec3, DVec3)> {
        let mut triangles = self.triangles.iter();
        let (mut current, mut passed) = (triangles.next(), 0.0);
        let mut probes = Vec::with_capacity(PROBES);
        for number in 0..PROBES {
            let at = (number as f64 + 0.5) / PROBES as f64 * self.area;
            while let Some(triangle) = current.filter(|triangle| passed + area(triangle) < at) {
                let Some(next) = triangles.next() else { break };
                passed += area(triangle);
                current = Some(next);
            }
            let Some(&[a, b, c]) = current else { break };
            // A low-discrepancy sequence (Roberts 2018), folded into the triangle.
            let [u, v] = [0.754_877_67, 0.569_840_29].map(|step: f64| (0.5 + step * number as f64).fract());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let normal = (b - a).cross(c - a).normalize_or_zero();
            probes.push((a + (b - a) * u + (c - a) * v, normal));
        }
        probes
    }
}

/// A short way forward from a point of an emitter.
struct Probe {
    emitter: usize,
    number: usize,
    from: DVec3,
    to: DVec3,
}

impl Probe {
    /// Whether it meets a triangle, but for those that touch its emitter: a hit behind a fiftieth of the way.
    fn meets(&self, &[a, b, c]: &[DVec3; 3]) -> bool {
        let (way, ab, ac) = (self.to - self.from, b - a, c - a);
        let p = way.cross(ac);
        let determinant = ab.dot(p);
        let start = self.from - a;
        let q = start.cross(ab);
        let [u, v, t] = [start.dot(p), way.dot(q), ac.dot(q)].map(|part| part / determinant);
        // Parallel ones give NaN or infinity, which meets nothing.
        u >= 0.0 && v >= 0.0 && u + v <= 1.0 && (0.02..=1.0).contains(&t)
    }
}

/// Emitters with something opaque at hand before most of their front, and what that is made of.
/// Cost: some nanoseconds a triangle of the scene.
fn facing_walls<'a>(
    emitters: &'a [Emitter<'a>],
    mesh: &Mesh,
    materials: &'a [Material],
) -> Vec<(&'a Emitter<'a>, &'a str)> {
    let mut probes: Vec<Probe> = Vec::new();
    for (index, emitter) in emitters.iter().enumerate() {
        let reach = emitter.reach();
        let own = emitter.probes().into_iter().enumerate();
        probes.extend(own.map(|(number, (from, normal))| Probe {
            emitter: index,
            number,
            from,
            to: from + normal * reach,
        }));
    }
    let Some(around) = Bounds::around(probes.iter().flat_map(|probe| [probe.from, probe.to])) else {
        return Vec::new();
    };
    // By their lowest x, so that a triangle finds those near it.
    probes.sort_by(|a, b| a.from.x.min(a.to.x).total_cmp(&b.from.x.min(b.to.x)));
    let lowest: Vec<f64> = probes.iter().map(|probe| probe.from.x.min(probe.to.x)).collect();
    let opaque: Vec<bool> = materials.iter().map(is_opaque).collect();
    let slack = 1e-6 * AT_HAND;
    let hits = |index: usize| {
        let (corners, material) = (mesh.corners(index), mesh.material_of[index]);
        let bounds = Bounds::around(corners).filter(|bounds| opaque[material as usize] && around.meets(bounds, slack));
        let range = bounds.map_or(0..0, |bounds| {
            let first = lowest.partition_point(|&low| low < bounds.least.x - AT_HAND);
            first..lowest.partition_point(|&low| low <= bounds.most.x)
        });
        let near = probes[range].iter().filter(move |probe| {
            let bounds = bounds.expect("a range that is not empty has bounds");
            Bounds { least: probe.from.min(probe.to), most: probe.from.max(probe.to) }.meets(&bounds, slack)
        });
        near.filter(move |probe| probe.meets(&corners)).map(move |probe| (probe.emitter, probe.number, material))
    };
    let mut hits: Vec<(usize, usize, u32)> = (0..mesh.triangles.len()).into_par_iter().flat_map_iter(hits).collect();
    hits.sort_unstable();
    hits.dedup_by_key(|&mut (emitter, number, _)| (emitter, number));
    let of_each = hits.chunk_by(|a, b| a.0 == b.0).filter(|hits| 2 * hits.len() > PROBES);
    of_each.map(|hits| (&emitters[hits[0].0], materials[hits[0].2 as usize].name.as_str())).collect()
}

/// Whether no light passes a surface.
fn is_opaque(material: &Material) -> bool {
    !material.is_clear() && !material.is_translucent()
}
