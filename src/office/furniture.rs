//! What stands in an office: each item made of closed shells about its own origin, on its own floor (z = 0), looking to
//! +y.
//!
//! Where parts of an item meet, one goes a few millimetres into the other, as joints do: no two faces lie in one plane,
//! and no light passes between. Items stand 1 mm above what carries them.

use std::f64::consts::PI;

use glam::DVec3;

use super::exact::circle;
use super::shapes::{Bent, Detail, RoundedBox, Sink, ball, lathe, outline, parabola, tube};

/// What surfaces are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "each is what it is called")]
pub enum Finish {
    Floor,
    Ceiling,
    Wall,
    Glass,
    Column,
    Door,
    Housing,
    Desk,
    Metal,
    Partition,
    Fabric,
    Plastic,
    Screen,
    Key,
    Cabinet,
    Paper,
    Cover,
    Ceramic,
    Leaf,
}

impl Finish {
    /// All of them.
    pub const ALL: [Self; 19] = [
        Self::Floor,
        Self::Ceiling,
        Self::Wall,
        Self::Glass,
        Self::Column,
        Self::Door,
        Self::Housing,
        Self::Desk,
        Self::Metal,
        Self::Partition,
        Self::Fabric,
        Self::Plastic,
        Self::Screen,
        Self::Key,
        Self::Cabinet,
        Self::Paper,
        Self::Cover,
        Self::Ceramic,
        Self::Leaf,
    ];

    /// Its name in the OBJ, and its Lambertian reflectance: usual values, none of them measured. Windows are seen at
    /// night.
    pub fn properties(self) -> (&'static str, f64) {
        match self {
            Self::Floor => ("floor", 0.2),
            Self::Ceiling => ("ceiling", 0.75),
            Self::Wall => ("wall", 0.5),
            Self::Glass => ("glass", 0.02),
            Self::Column => ("column", 0.5),
            Self::Door => ("door", 0.35),
            Self::Housing => ("housing", 0.7),
            Self::Desk => ("desk", 0.4),
            Self::Metal => ("metal", 0.3),
            Self::Partition => ("partition", 0.35),
            Self::Fabric => ("fabric", 0.08),
            Self::Plastic => ("plastic", 0.1),
            Self::Screen => ("screen", 0.04),
            Self::Key => ("key", 0.15),
            Self::Cabinet => ("cabinet", 0.45),
            Self::Paper => ("paper", 0.7),
            Self::Cover => ("cover", 0.25),
            Self::Ceramic => ("ceramic", 0.6),
            Self::Leaf => ("leaf", 0.15),
        }
    }
}

/// Triangles of some materials that share their vertices.
#[derive(Clone, Debug, Default)]
pub struct Item {
    /// Positions about the item's origin, m.
    pub vertices: Vec<DVec3>,
    /// Vertex numbers, counter-clockwise seen from the air.
    pub triangles: Vec<[u32; 3]>,
    /// Materials in turn, and the number of triangles up to where each ends.
    pub materials: Vec<(Finish, usize)>,
}

impl Sink for Item {
    fn vertex(&mut self, position: DVec3) -> u32 {
        self.vertices.push(position);
        self.vertices.len() as u32 - 1
    }

    fn triangle(&mut self, corners: [u32; 3]) {
        self.triangles.push(corners);
    }
}

impl Item {
    /// Adds what `draw` draws, made of `material`.
    pub(super) fn add(&mut self, material: Finish, draw: impl FnOnce(&mut dyn Sink)) {
        draw(self);
        match self.materials.last_mut() {
            Some((last, end)) if *last == material => *end = self.triangles.len(),
            _ => self.materials.push((material, self.triangles.len())),
        }
    }

    /// Adds a box from `low` to `high` with edges of `radius`, m, and `flat` segments at detail 1.
    fn add_box(&mut self, material: Finish, [low, high]: [[f64; 3]; 2], radius: f64, flat: [u32; 3], detail: Detail) {
        self.add_bent_box(material, [low, high], radius, flat, detail, |point| point);
    }

    /// The same, each point moved as `bend` says.
    fn add_bent_box(
        &mut self,
        material: Finish,
        [low, high]: [[f64; 3]; 2],
        radius: f64,
        flat: [u32; 3],
        detail: Detail,
        bend: impl Fn(DVec3) -> DVec3,
    ) {
        let (low, high) = (DVec3::from(low), DVec3::from(high));
        let (half, middle) = ((high - low) / 2.0, (low + high) / 2.0);
        let shell = RoundedBox { half, radius, flat };
        self.add(material, |sink| shell.shell(detail, &mut Bent::new(sink, |point| bend(point + middle))));
    }

    /// Adds a body turned about the upright through (x, y).
    fn add_turned(&mut self, material: Finish, [x, y]: [f64; 2], outline: &[[f64; 2]], around: usize) {
        let shift = DVec3::new(x, y, 0.0);
        self.add(material, |sink| lathe(outline, around, &mut Bent::new(sink, |point| point + shift)));
    }
}

/// Height of a desk's top, m: 20 mm below the measuring plane at 0.75 m.
pub const DESK_HEIGHT: f64 = 0.73;
/// Width and depth of a desk, m.
pub const DESK: [f64; 2] = [1.6, 0.8];

/// A desk: board with rounded edges, frame of tubes, feet, modesty panel.
pub fn desk(detail: Detail) -> Item {
    let mut item = Item::default();
    let [x, y] = DESK.map(|size| size / 2.0);
    let under = DESK_HEIGHT - 0.025;
    item.add_box(Finish::Desk, [[-x, -y, under], [x, y, DESK_HEIGHT]], 0.006, [4, 2, 1], detail);
    item.add_box(Finish::Desk, [[-0.66, 0.26, 0.32], [0.66, 0.276, under + 0.004]], 0.0, [2, 0, 1], detail);
    for side in [-1.0, 1.0] {
        let at = |y: f64, z: f64| DVec3::new(side * 0.68, y, z);
        item.add_box(
            Finish::Metal,
            [[side * 0.68 - 0.035, -0.36, 0.001], [side * 0.68 + 0.035, 0.36, 0.026]],
            0.008,
            [1, 2, 0],
            detail,
        );
        for y in [-0.2, 0.2] {
            let path = parabola([at(y, 0.02), at(y, 0.4), at(1.2 * y, under + 0.004)], 2 * detail.0.min(16) as usize);
            item.add(Finish::Metal, |sink| tube(&path, 0.022, detail.around(5, 0.022), sink));
        }
        item.add_box(
            Finish::Metal,
            [[side * 0.68 - 0.018, -0.3, under - 0.03], [side * 0.68 + 0.018, 0.3, under + 0.004]],
            0.0,
            [0, 1, 0],
            detail,
        );
    }
    item
}

/// A partition between facing desks, `DESK` wide, on two feet.
pub fn partition(detail: Detail) -> Item {
    let mut item = Item::default();
    let x = DESK[0] / 2.0;
    item.add_box(Finish::Partition, [[-x, -0.02, 0.03], [x, 0.02, 1.2]], 0.008, [3, 0, 2], detail);
    for foot in [-0.6, 0.6] {
        item.add_box(Finish::Metal, [[foot - 0.03, -0.19, 0.001], [foot + 0.03, 0.19, 0.036]], 0.01, [1, 2, 1], detail);
    }
    item
}

/// A swivel chair: curved seat and back, arms, five-star base on castors.
pub fn chair(detail: Detail) -> Item {
    let mut item = Item::default();
    // The seat is a shallow trough that falls away in front; shears keep its volume.
    let seat = |p: DVec3| p + DVec3::Z * (0.35 * p.x * p.x - 0.5 * p.y.max(0.0) * p.y.max(0.0));
    item.add_bent_box(Finish::Fabric, [[-0.25, -0.24, 0.42], [0.25, 0.24, 0.48]], 0.022, [4, 4, 1], detail, seat);
    let back = |p: DVec3| {
        let z = p.z - 0.62;
        p + DVec3::Y * (0.55 * p.x * p.x - 0.1 * z + 0.25 * z * z)
    };
    item.add_bent_box(Finish::Fabric, [[-0.23, -0.28, 0.52], [0.23, -0.235, 1.02]], 0.016, [4, 1, 4], detail, back);
    let path =
        parabola([(0.0, -0.1, 0.425), (0.0, -0.31, 0.36), (0.0, -0.268, 0.62)].map(DVec3::from), 4 * detail.0 as usize);
    item.add(Finish::Plastic, |sink| tube(&path, 0.018, detail.around(5, 0.018), sink));
    for side in [-1.0, 1.0] {
        let at = |x: f64, y: f64, z: f64| DVec3::new(side * x, y, z);
        let path = parabola([at(0.2, 0.0, 0.45), at(0.36, 0.0, 0.4), at(0.29, 0.0, 0.63)], 4 * detail.0 as usize);
        item.add(Finish::Plastic, |sink| tube(&path, 0.014, detail.around(5, 0.014), sink));
        let pad = [[side * 0.29 - 0.035, -0.14, 0.62], [side * 0.29 + 0.035, 0.12, 0.65]];
        item.add_bent_box(Finish::Plastic, pad, 0.012, [1, 3, 1], detail, |p| p - DVec3::Z * (0.6 * p.y * p.y));
    }
    let column = [[0.0, 0.07], [0.03, 0.07], [0.03, 0.28], [0.018, 0.285], [0.018, 0.424], [0.0, 0.424]];
    item.add_turned(Finish::Metal, [0.0; 2], &outline(&column, 1, detail), detail.around(8, 0.03));
    for leg in 0..5 {
        let [cos, sin] = circle(f64::from(leg) / 5.0 + 0.05);
        let turned = |p: DVec3| {
            let z = p.z - 0.12 * (p.x - 0.01);
            DVec3::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y, z)
        };
        let arm = [[0.01, -0.02, 0.08], [0.31, 0.02, 0.11]];
        item.add_bent_box(Finish::Plastic, arm, 0.008, [3, 1, 1], detail, turned);
        let wheel = ball(0.027, 0.028, detail.segments(3, 0.027 * PI));
        item.add_turned(Finish::Plastic, [0.29 * cos, 0.29 * sin], &wheel, detail.around(5, 0.027));
    }
    item
}

/// A monitor on a stand, its foot at the origin, its screen towards −y; `curvature` in 1/m.
pub fn monitor(curvature: f64, detail: Detail) -> Item {
    let mut item = Item::default();
    let foot = [[0.0, 0.001], [0.11, 0.001], [0.11, 0.006], [0.107, 0.009], [0.0, 0.009]];
    item.add_turned(Finish::Plastic, [0.0; 2], &outline(&foot, 1, detail), detail.around(10, 0.11));
    item.add_box(Finish::Plastic, [[-0.03, 0.012, 0.005], [0.03, 0.03, 0.36]], 0.004, [1, 0, 3], detail);
    // Bent towards the viewer at both sides; the neck ends within the body's middle.
    let bend = |p: DVec3| p - DVec3::Y * (curvature / 2.0 * p.x * p.x);
    item.add_bent_box(Finish::Plastic, [[-0.3, -0.025, 0.13], [0.3, 0.018, 0.48]], 0.008, [6, 1, 3], detail, bend);
    item.add_bent_box(Finish::Screen, [[-0.29, -0.026, 0.142], [0.29, -0.015, 0.47]], 0.0, [6, 0, 3], detail, bend);
    item
}

/// A keyboard; from detail 3 on with its keys.
pub fn keyboard(detail: Detail) -> Item {
    let mut item = Item::default();
    item.add_box(Finish::Plastic, [[-0.22, -0.07, 0.001], [0.22, 0.07, 0.011]], 0.003, [2, 1, 0], detail);
    if detail >= Detail(3) {
        let rows = [(-0.043, 8), (-0.0215, 20), (0.0, 20), (0.0215, 20), (0.043, 20)];
        for (y, keys) in rows {
            let pitch = 0.42 / f64::from(keys);
            for key in 0..keys {
                let x = (f64::from(key) + 0.5) * pitch - 0.21;
                let cap = [[x - pitch / 2.0 + 0.0015, y - 0.009, 0.009], [x + pitch / 2.0 - 0.0015, y + 0.009, 0.016]];
                let radius = if detail >= Detail(8) { 0.0025 } else { 0.0 };
                item.add_box(Finish::Key, cap, radius, [0; 3], detail);
            }
        }
    }
    item
}

/// A mouse.
pub fn mouse(detail: Detail) -> Item {
    let mut item = Item::default();
    let hump = |p: DVec3| {
        let up = p.z / 0.03;
        p - DVec3::Z * (up * (3.0 * p.x * p.x + 2.0 * p.y * p.y))
    };
    item.add_bent_box(Finish::Plastic, [[-0.03, -0.05, 0.001], [0.03, 0.05, 0.034]], 0.013, [1, 2, 0], detail, hump);
    item
}

/// A pedestal on castors, its three drawers towards −y.
pub fn pedestal(detail: Detail) -> Item {
    let mut item = Item::default();
    item.add_box(Finish::Cabinet, [[-0.2, -0.25, 0.06], [0.2, 0.25, 0.6]], 0.004, [1, 1, 2], detail);
    for drawer in 0..3 {
        let z = 0.075 + 0.173 * f64::from(drawer);
        item.add_box(Finish::Cabinet, [[-0.19, -0.266, z], [0.19, -0.24, z + 0.165]], 0.005, [1, 0, 1], detail);
        let at = |x: f64, y: f64| DVec3::new(x, y, z + 0.13);
        let path = parabola([at(-0.06, -0.262), at(0.0, -0.31), at(0.06, -0.262)], 2 * detail.0 as usize);
        item.add(Finish::Metal, |sink| tube(&path, 0.005, detail.around(5, 0.005), sink));
    }
    for [x, y] in [[-0.16, -0.2], [0.16, -0.2], [-0.16, 0.2], [0.16, 0.2]] {
        let wheel = ball(0.032, 0.033, detail.segments(3, 0.032 * PI));
        item.add_turned(Finish::Plastic, [x, y], &wheel, detail.around(5, 0.032));
    }
    item
}

/// A desk lamp, switched off.
pub fn lamp(detail: Detail) -> Item {
    let mut item = Item::default();
    let foot = [[0.0, 0.001], [0.08, 0.001], [0.08, 0.012], [0.074, 0.018], [0.0, 0.018]];
    item.add_turned(Finish::Metal, [0.0; 2], &outline(&foot, 1, detail), detail.around(10, 0.08));
    let path = parabola(
        [(0.0, 0.0, 0.012), (0.0, 0.1, 0.5), (0.1, -0.05, 0.42)].map(DVec3::from),
        8 * detail.0.min(16) as usize,
    );
    item.add(Finish::Metal, |sink| tube(&path, 0.007, detail.around(5, 0.007), sink));
    // A bell with a wall of its own: inside and outside are one closed shell.
    let bell =
        [[0.0, 0.417], [0.03, 0.414], [0.072, 0.352], [0.078, 0.35], [0.078, 0.354], [0.034, 0.424], [0.0, 0.427]];
    item.add_turned(Finish::Metal, [0.1, -0.05], &outline(&bell, 1, detail), detail.around(10, 0.078));
    item
}

/// A plant in its pot: `height` in m from floor to the tips, about; leaves spread as sunflower seeds do.
pub fn plant(height: f64, leaves: u32, detail: Detail) -> Item {
    let mut item = Item::default();
    let pot = 0.32 * height;
    let wide = 0.17 * height;
    let shape = [[0.0, 0.001], [0.75 * wide, 0.001], [wide, pot], [0.9 * wide, pot], [0.86 * wide, 0.88 * pot]];
    let shape: Vec<_> = shape.into_iter().chain([[0.0, 0.88 * pot]]).collect();
    item.add_turned(Finish::Ceramic, [0.0; 2], &outline(&shape, 1, detail), detail.around(10, wide));
    for leaf in 0..leaves {
        // The golden angle, and a steeper rise the later a leaf grew.
        let [cos, sin] = circle(0.381_966 * f64::from(leaf));
        let age = (f64::from(leaf) + 0.5) / f64::from(leaves);
        let (reach, rise) = ((0.45 - 0.33 * age) * height, (0.35 + 0.45 * age) * height);
        // A blade along x, bent over by its weight, narrow at both ends.
        let grow = |p: DVec3| {
            let t = p.x + 0.5;
            let width = 0.25 + 3.0 * t * (1.0 - t);
            let (x, y) = (0.02 * height + reach * t, 0.3 * wide * width * p.y);
            let z = 0.75 * pot + rise * t * (1.9 - 1.1 * t) + 0.012 * height * p.z - y * y / height;
            DVec3::new(cos * x - sin * y, sin * x + cos * y, z)
        };
        item.add_bent_box(Finish::Leaf, [[-0.5; 3], [0.5; 3]], 0.0, [4, 2, 0], leaf_detail(detail, height), grow);
    }
    item
}

/// A leaf is made in a box of 1 m: as fine as if it had that size, but no finer than `height` allows.
fn leaf_detail(detail: Detail, height: f64) -> Detail {
    Detail(detail.0.min((8.0 * height * 4.0) as u32).max(1))
}

/// A pile of `count` books, none on the other without 1 mm of air.
pub fn books(count: u32, detail: Detail) -> Item {
    let mut item = Item::default();
    let mut z = 0.001;
    for book in 0..count {
        let [cos, sin] = circle(0.03 * f64::from((book * 7 + count) % 5) - 0.06);
        let (x, y) = (0.075 + 0.005 * f64::from((book * 3) % 4), 0.105 + 0.006 * f64::from((book * 5) % 4));
        let thick = 0.014 + 0.005 * f64::from((book * 3 + count) % 4);
        let turned = |p: DVec3| DVec3::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y, p.z);
        let pages = [[-x + 0.004, -y + 0.005, z + 0.0015], [x - 0.005, y - 0.005, z + thick - 0.0015]];
        item.add_bent_box(Finish::Paper, pages, 0.0, [1, 1, 0], detail, turned);
        for cover in [z, z + thick - 0.003] {
            let cover = [[-x, -y, cover], [x, y, cover + 0.003]];
            item.add_bent_box(Finish::Cover, cover, 0.0, [1, 1, 0], detail, turned);
        }
        let spine = [[-x - 0.002, -y + 0.001, z + 0.001], [-x + 0.006, y - 0.001, z + thick - 0.001]];
        item.add_bent_box(Finish::Cover, spine, 0.0, [0, 1, 0], detail, turned);
        z += thick + 0.001;
    }
    item
}

/// A cup with a handle.
pub fn cup(detail: Detail) -> Item {
    let mut item = Item::default();
    let wall = [[0.0, 0.001], [0.033, 0.001], [0.04, 0.09], [0.036, 0.09], [0.03, 0.008], [0.0, 0.008]];
    item.add_turned(Finish::Ceramic, [0.0; 2], &outline(&wall, 1, detail), detail.around(10, 0.04));
    let path = parabola(
        [(0.037, 0.0, 0.075), (0.09, 0.0, 0.07), (0.034, 0.0, 0.025)].map(DVec3::from),
        4 * detail.0.min(8) as usize,
    );
    item.add(Finish::Ceramic, |sink| tube(&path, 0.004, detail.around(5, 0.004), sink));
    item
}

/// A meeting table for six, 2.4 × 1.1 m.
pub fn table(detail: Detail) -> Item {
    let mut item = Item::default();
    // A boat: wider in the middle.
    let boat = |p: DVec3| DVec3::new(p.x, p.y * (1.0 - 0.12 * p.x * p.x), p.z);
    let top = [[-1.2, -0.55, DESK_HEIGHT - 0.03], [1.2, 0.55, DESK_HEIGHT]];
    item.add_bent_box(Finish::Desk, top, 0.01, [6, 3, 1], detail, boat);
    for x in [-0.7, 0.7] {
        let leg = [[0.0, 0.001], [0.28, 0.001], [0.28, 0.008], [0.05, 0.03], [0.04, 0.706], [0.0, 0.706]];
        item.add_turned(Finish::Metal, [x, 0.0], &outline(&leg, 1, detail), detail.around(12, 0.28));
    }
    item
}

/// A cupboard of 0.9 × 0.45 × 1.25 m, its doors towards −y.
pub fn cupboard(detail: Detail) -> Item {
    let mut item = Item::default();
    item.add_box(Finish::Cabinet, [[-0.45, -0.225, 0.001], [0.45, 0.2, 1.25]], 0.003, [2, 1, 3], detail);
    for (low, high, handle) in [(-0.444, -0.002, -0.04), (0.002, 0.444, 0.04)] {
        item.add_box(Finish::Cabinet, [[low, -0.243, 0.06], [high, -0.22, 1.24]], 0.003, [1, 0, 3], detail);
        let at = |y: f64, z: f64| DVec3::new(handle, y, z);
        let path = parabola([at(-0.24, 0.55), at(-0.29, 0.65), at(-0.24, 0.75)], 4 * detail.0 as usize);
        item.add(Finish::Metal, |sink| tube(&path, 0.006, detail.around(5, 0.006), sink));
    }
    item
}

/// Radius of a column, m.
pub const COLUMN: f64 = 0.225;

/// A round column, 10 mm into the floor and into a ceiling at `height` m.
pub fn column(height: f64, detail: Detail) -> Item {
    let mut item = Item::default();
    let shaft = [[0.0, -0.01], [COLUMN, -0.01], [COLUMN, height + 0.01], [0.0, height + 0.01]];
    item.add_turned(Finish::Column, [0.0; 2], &outline(&shaft, 1, detail), detail.around(12, COLUMN));
    item
}

/// A door in a wall at y = 0, the room on its −y side: leaf, frame and handle, all a little into the wall.
pub fn door(detail: Detail) -> Item {
    let mut item = Item::default();
    item.add_box(Finish::Door, [[-0.45, -0.02, 0.006], [0.45, 0.03, 2.08]], 0.003, [1, 0, 2], detail);
    for [low, high] in [
        [[-0.52, -0.035, 0.001], [-0.447, 0.04, 2.15]],
        [[0.447, -0.035, 0.001], [0.52, 0.04, 2.15]],
        [[-0.451, -0.033, 2.077], [0.451, 0.035, 2.148]],
    ] {
        item.add_box(Finish::Metal, [low, high], 0.002, [0; 3], detail);
    }
    let path = [(0.36, -0.01, 1.05), (0.36, -0.1, 1.05), (0.23, -0.07, 1.05)].map(DVec3::from);
    let path = parabola(path, 4 * detail.0 as usize);
    item.add(Finish::Metal, |sink| tube(&path, 0.01, detail.around(5, 0.01), sink));
    item
}

/// Sides of a panel's luminous opening, m.
pub const PANEL: f64 = 0.6;
/// Diameter of a downlight's luminous opening, m.
pub const DOWNLIGHT: f64 = 0.16;
/// How far below the ceiling luminous openings are, m: 1 mm below their housings.
pub const OPENING_DEPTH: f64 = 0.036;

/// Housing of a panel luminaire under a ceiling at z = 0: a rim of 10 mm around the opening.
pub fn panel(detail: Detail) -> Item {
    let mut item = Item::default();
    let x = PANEL / 2.0 + 0.01;
    item.add_box(Finish::Housing, [[-x, -x, 1e-3 - OPENING_DEPTH], [x, x, 0.01]], 0.002, [0; 3], detail);
    item
}

/// Housing of a downlight under a ceiling at z = 0.
pub fn downlight(detail: Detail) -> Item {
    let mut item = Item::default();
    let (radius, low) = (DOWNLIGHT / 2.0 + 0.012, 1e-3 - OPENING_DEPTH);
    let can = [[0.0, low], [radius, low], [radius, 0.01], [0.0, 0.01]];
    item.add_turned(Finish::Housing, [0.0; 2], &outline(&can, 1, detail), detail.around(12, radius));
    item
}
