//! Where everything stands.
//!
//! The floor is a grid of modules of 7.2 × 4.8 m. Each holds an island of six desks, three facing three across
//! partitions, or a meeting table where there are more modules than islands. Panels of 0.6 m hang 2.4 m apart,
//! downlights over the aisles between the modules, where every other crossing has a column. Both long walls are
//! windows, both short ones have doors.

use glam::DVec3;

use super::exact::circle;
use super::furniture::{self, Finish, Item};
use super::shapes::{BoxFace, BoxGrid, Detail};
use super::{Parameters, Windows};
use crate::error::Error;
use crate::random::{Seed, Stream};

/// Sizes of a module along x and y, m.
const MODULE: [f64; 2] = [7.2, 4.8];
/// From a window to the next, m; also the grid of floor, ceiling and short walls.
const BAY: f64 = 1.2;
/// Height of the windows' sills, and how far panes stand back, m.
const SILL: f64 = 0.9;
const RECESS: f64 = 0.12;
/// Desks stand this far apart along x, and their middles this far from the island's, m.
const DESK_PITCH: f64 = 1.61;
const DESK_MIDDLE: f64 = 0.43;
/// Items on a desk stand 1 mm above it.
const ON_DESK: f64 = furniture::DESK_HEIGHT;
/// From the short walls to the middles of the downlights there, m.
const FROM_WALL: f64 = 0.3;
/// Most sensors.
const MOST_SENSORS: u32 = 48;

/// What desks ask for, in the mean illuminance at 0.75 m. Of some twenty offices of 1 to 300 workstations, of all
/// heights, windows and numbers of luminaires, rendered at full output, the darkest desk of the worst had 0.61: one
/// that stands between columns and cupboards, or far from the next of few panels.
const ASKED: f64 = 0.55;

/// Luminous flux of a downlight in that of a panel.
const DOWNLIGHT_SHARE: f64 = 0.5;

/// Illuminance at 0.75 m over luminous flux per floor area, for a room index k = L·W/(h·(L + W)), h being the height of
/// the openings over that plane: fitted to six offices that this command made and luxmap rendered, 6 to 216
/// workstations under ceilings of 2.8 and 4 m, k = 0.9 … 9.2. Those are met within 2 %.
fn utilisation(room_index: f64) -> f64 {
    room_index / (0.96 * room_index + 0.98)
}

/// Items of one kind that look alike are made once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ItemKind {
    Desk,
    Partition,
    Chair,
    FlatMonitor,
    CurvedMonitor,
    Keyboard,
    Mouse,
    Pedestal,
    Lamp,
    DeskPlant,
    FloorPlant,
    Books(u32),
    Cup,
    Table,
    Cupboard,
    Column,
    Door,
    Panel,
    Downlight,
}

/// Every kind; its place here is its item's number.
const KINDS: [ItemKind; 22] = [
    ItemKind::Desk,
    ItemKind::Partition,
    ItemKind::Chair,
    ItemKind::FlatMonitor,
    ItemKind::CurvedMonitor,
    ItemKind::Keyboard,
    ItemKind::Mouse,
    ItemKind::Pedestal,
    ItemKind::Lamp,
    ItemKind::DeskPlant,
    ItemKind::FloorPlant,
    ItemKind::Books(2),
    ItemKind::Books(3),
    ItemKind::Books(4),
    ItemKind::Books(5),
    ItemKind::Cup,
    ItemKind::Table,
    ItemKind::Cupboard,
    ItemKind::Column,
    ItemKind::Door,
    ItemKind::Panel,
    ItemKind::Downlight,
];

impl ItemKind {
    fn item(self, height: f64, detail: Detail) -> Item {
        match self {
            Self::Desk => furniture::desk(detail),
            Self::Partition => furniture::partition(detail),
            Self::Chair => furniture::chair(detail),
            Self::FlatMonitor => furniture::monitor(0.0, detail),
            Self::CurvedMonitor => furniture::monitor(0.8, detail),
            Self::Keyboard => furniture::keyboard(detail),
            Self::Mouse => furniture::mouse(detail),
            Self::Pedestal => furniture::pedestal(detail),
            Self::Lamp => furniture::lamp(detail),
            Self::DeskPlant => furniture::plant(0.32, 12, detail),
            Self::FloorPlant => furniture::plant(1.3, 24, detail),
            Self::Books(count) => furniture::books(count, detail),
            Self::Cup => furniture::cup(detail),
            Self::Table => furniture::table(detail),
            Self::Cupboard => furniture::cupboard(detail),
            Self::Column => furniture::column(height, detail),
            Self::Door => furniture::door(detail),
            Self::Panel => furniture::panel(detail),
            Self::Downlight => furniture::downlight(detail),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Desk => "desk",
            Self::Partition => "partition",
            Self::Chair => "chair",
            Self::FlatMonitor | Self::CurvedMonitor => "monitor",
            Self::Keyboard => "keyboard",
            Self::Mouse => "mouse",
            Self::Pedestal => "pedestal",
            Self::Lamp => "lamp",
            Self::DeskPlant | Self::FloorPlant => "plant",
            Self::Books(_) => "books",
            Self::Cup => "cup",
            Self::Table => "table",
            Self::Cupboard => "cupboard",
            Self::Column => "column",
            Self::Door => "door",
            Self::Panel => "panel",
            Self::Downlight => "downlight",
        }
    }
}

/// A place on the floor or above, and a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Of the item's origin, m.
    pub origin: DVec3,
    /// (cos, sin) of the turn about the upright.
    pub turn: [f64; 2],
}

impl Pose {
    fn new(x: f64, y: f64, z: f64, turns: f64) -> Self {
        Self { origin: DVec3::new(x, y, z), turn: circle(turns) }
    }

    /// Where a point of the item is, m.
    #[inline]
    pub fn at(&self, p: DVec3) -> DVec3 {
        let [cos, sin] = self.turn;
        DVec3::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y, p.z) + self.origin
    }

    /// A place told relative to this one.
    fn on(&self, x: f64, y: f64, z: f64, turns: f64) -> Self {
        let ([cos, sin], [c, s]) = (self.turn, circle(turns));
        Self { origin: self.at(DVec3::new(x, y, z)), turn: [cos * c - sin * s, sin * c + cos * s] }
    }
}

/// Luminaires in a row, equally far apart.
#[derive(Clone, Debug, PartialEq)]
pub struct LuminaireRow {
    /// Name, and light group.
    pub name: String,
    /// Whether they are downlights, else panels.
    pub downlights: bool,
    /// Middle of the first one's luminous opening, m.
    pub first: DVec3,
    /// How many there are along x and along y.
    pub count: [u32; 2],
    /// How far apart, m.
    pub pitch: [f64; 2],
    /// Luminous flux of each, lm.
    pub flux: f64,
}

/// A sensor on a desk.
#[derive(Clone, Debug, PartialEq)]
pub struct DeskSensor {
    /// `desk r.c`, row and column counted from the origin.
    pub name: String,
    /// At 0.75 m, 20 mm above the desk, m.
    pub position: DVec3,
}

/// An office: what it is made of and where that stands.
#[derive(Debug)]
pub struct Office {
    /// What it was made from.
    pub parameters: Parameters,
    /// Inner sizes of the room, m; one corner is the origin.
    pub size: DVec3,
    modules: [u32; 2],
    /// Floor, ceiling, walls and windows: one closed shell, seen from inside.
    pub building: Item,
    /// One of each of [`KINDS`].
    items: Vec<Item>,
    /// Panels along x and y in each module.
    panels: [u32; 2],
}

impl Office {
    /// Lays the office out and makes one of each piece of furniture. Memory: some 60 MB at detail 32.
    pub fn new(parameters: Parameters) -> Result<Self, Error> {
        parameters.check()?;
        let modules = grid_of(parameters.workstations.div_ceil(6));
        let count = modules[0] * modules[1];
        let size = DVec3::new(f64::from(modules[0]) * MODULE[0], f64::from(modules[1]) * MODULE[1], parameters.height);
        let detail = Detail(parameters.detail);
        Ok(Self {
            modules,
            size,
            building: building(modules, parameters.height, parameters.windows),
            items: KINDS.map(|kind| kind.item(parameters.height, detail)).into(),
            panels: panels(parameters.luminaires.map(|wanted| f64::from(wanted) / f64::from(count))),
            parameters,
        })
    }

    /// Floor area, m².
    pub fn area(&self) -> f64 {
        self.size.x * self.size.y
    }

    /// Calls `take` with every item that stands in the room, its name, and where it stands. The building is not among
    /// them: it is where it is.
    pub fn furnish(&self, mut take: impl FnMut(&str, &Item, Pose)) {
        let mut put = |kind: ItemKind, [row, column]: [u32; 2], place: Pose| {
            if let Some(number) = KINDS.iter().position(|known| *known == kind) {
                take(&format!("{}_{row}_{column}", kind.name()), &self.items[number], place);
            }
        };
        for module in 0..self.modules[0] * self.modules[1] {
            self.furnish_module(module, &mut put);
        }
        self.furnish_building(&mut put);
        for row in self.rows() {
            let kind = if row.downlights { ItemKind::Downlight } else { ItemKind::Panel };
            for (j, i) in (0..row.count[1]).flat_map(|j| (0..row.count[0]).map(move |i| (j, i))) {
                let [x, y] = [f64::from(i) * row.pitch[0], f64::from(j) * row.pitch[1]];
                // Rows are told apart by their number, which ends their name.
                let number = row.name.rsplit(' ').next().and_then(|number| number.parse().ok()).unwrap_or(0);
                put(kind, [number, i + j + 1], Pose::new(row.first.x + x, row.first.y + y, self.size.z, 0.0));
            }
        }
    }

    /// Triangles in all, luminous openings not among them.
    pub fn triangles(&self) -> u64 {
        let mut triangles = self.building.triangles.len() as u64;
        self.furnish(|_, item, _| triangles += item.triangles.len() as u64);
        triangles
    }

    /// One of each item that may stand in the room, and its name.
    pub fn items(&self) -> impl Iterator<Item = (&'static str, &Item)> {
        KINDS.iter().map(|kind| kind.name()).zip(&self.items)
    }

    /// A workstation's desk, its row and column; `None` from the last one on.
    fn desk(&self, number: u32) -> Option<(Pose, [u32; 2])> {
        (number < self.parameters.workstations).then(|| {
            let (module, slot) = (number / 6, number % 6);
            let [i, j] = [module % self.modules[0], module / self.modules[0]];
            let (along, side) = (slot / 2, slot % 2);
            let middle = self.middle(module);
            let x = middle.x + (f64::from(along) - 1.0) * DESK_PITCH;
            let (y, turns) = if side == 0 { (-DESK_MIDDLE, 0.0) } else { (DESK_MIDDLE, 0.5) };
            (Pose::new(x, middle.y + y, 0.0, turns), [2 * j + side + 1, 3 * i + along + 1])
        })
    }

    /// Middle of a module, on the floor.
    fn middle(&self, module: u32) -> DVec3 {
        let [i, j] = [module % self.modules[0], module / self.modules[0]].map(f64::from);
        DVec3::new((i + 0.5) * MODULE[0], (j + 0.5) * MODULE[1], 0.0)
    }

    /// The random numbers of a purpose's `index`th thing.
    fn random(&self, purpose: u64, index: u32) -> Random {
        Random(Seed(self.parameters.seed).branch(purpose).stream(u64::from(index)))
    }

    fn furnish_module(&self, module: u32, put: &mut impl FnMut(ItemKind, [u32; 2], Pose)) {
        let desks = (6 * module..6 * module + 6).filter_map(|number| self.desk(number).map(|desk| (number, desk)));
        for (number, (desk, name)) in desks {
            self.furnish_desk(number, desk, name, put);
            if number % 2 == 0 {
                put(ItemKind::Partition, name, desk.on(0.0, DESK_MIDDLE, 0.0, 0.0));
            }
        }
        let middle = self.middle(module);
        let mut random = self.random(1, module);
        let name = [module / self.modules[0] + 1, module % self.modules[0] + 1];
        if 6 * module >= self.parameters.workstations {
            put(ItemKind::Table, name, Pose::new(middle.x, middle.y, 0.0, random.within(0.005)));
            for chair in 0..6 {
                let (along, side) = (f64::from(chair / 2) - 1.0, f64::from(chair % 2) - 0.5);
                let (x, y) = (0.72 * along + random.within(0.04), side * 1.9 + random.within(0.05));
                let turns = if side < 0.0 { 0.0 } else { 0.5 };
                let place = Pose::new(middle.x + x, middle.y + y, 0.0, turns + random.within(0.06));
                put(ItemKind::Chair, [2 * name[0] + chair % 2 - 1, 3 * name[1] + chair / 2 - 2], place);
            }
        } else if random.happens(0.4) {
            let x = middle.x + if random.happens(0.5) { 3.05 } else { -3.05 };
            put(ItemKind::FloorPlant, name, Pose::new(x, middle.y + random.within(0.3), 0.0, random.within(0.5)));
        }
    }

    /// A desk and what belongs to it. Its own axes: x to the right of who sits there, y away from them.
    fn furnish_desk(&self, number: u32, desk: Pose, name: [u32; 2], put: &mut impl FnMut(ItemKind, [u32; 2], Pose)) {
        let mut random = self.random(0, number);
        let random = &mut random;
        put(ItemKind::Desk, name, desk);
        let chair = desk.on(random.within(0.1), -0.82 + random.within(0.12), 0.0, random.within(0.11));
        put(ItemKind::Chair, name, chair);
        if random.happens(0.8) {
            put(ItemKind::Pedestal, name, desk.on(0.42 + random.within(0.02), -0.02 + random.within(0.02), 0.0, 0.0));
        }
        let two_monitors = random.happens(0.3);
        let monitor = if random.happens(0.4) { ItemKind::CurvedMonitor } else { ItemKind::FlatMonitor };
        if two_monitors {
            for side in [-1.0, 1.0] {
                let (x, y) = (side * 0.325 + random.within(0.008), 0.16 + random.within(0.01));
                put(monitor, name, desk.on(x, y, ON_DESK, side * (random.within(0.008) - 0.022)));
            }
        } else {
            let (x, y) = (random.within(0.04), 0.16 + random.within(0.03));
            put(monitor, name, desk.on(x, y, ON_DESK, random.within(0.02)));
        }
        let keyboard = desk.on(-0.04 + random.within(0.03), -0.22 + random.within(0.03), ON_DESK, random.within(0.012));
        put(ItemKind::Keyboard, name, keyboard);
        put(
            ItemKind::Mouse,
            name,
            desk.on(0.29 + random.within(0.02), -0.2 + random.within(0.03), ON_DESK, random.within(0.03)),
        );
        let left = desk.on(-0.66 + random.within(0.02), 0.06 + random.within(0.04), ON_DESK, random.within(0.06));
        match random.below(4) {
            0 => put(ItemKind::Lamp, name, left),
            1 if !two_monitors => put(ItemKind::DeskPlant, name, left.on(0.04, 0.08, 0.0, random.within(0.5))),
            2 => put(ItemKind::Cup, name, desk.on(-0.45 + random.within(0.05), -0.12, ON_DESK, random.within(0.5))),
            _ => {}
        }
        if random.happens(0.5) {
            let books = ItemKind::Books(2 + random.below(4));
            put(
                books,
                name,
                desk.on(0.64 + random.within(0.03), 0.1 + random.within(0.05), ON_DESK, random.within(0.04)),
            );
        }
    }

    /// Columns at every other crossing of aisles, doors and cupboards along the short walls.
    fn furnish_building(&self, put: &mut impl FnMut(ItemKind, [u32; 2], Pose)) {
        for (j, i) in (1..self.modules[1]).step_by(2).flat_map(|j| (1..self.modules[0]).map(move |i| (j, i))) {
            let place = Pose::new(f64::from(i) * MODULE[0], f64::from(j) * MODULE[1], 0.0, 0.0);
            put(ItemKind::Column, [j, i], place);
        }
        for (end, x, inwards) in [(1_u32, 0.0, 1.0), (2, self.size.x, -1.0)] {
            // A quarter turn lets −y, where doors and cupboards have their fronts, look into the room.
            let turns = 0.25 * inwards;
            for j in 0..self.modules[1] {
                let mut random = self.random(2 + u64::from(end), j);
                let y = (f64::from(j) + 0.5) * MODULE[1];
                if j % 4 == 0 {
                    put(ItemKind::Door, [end, j + 1], Pose::new(x, y, 0.0, turns));
                }
                for side in [-1.0, 1.0] {
                    if random.happens(0.5) {
                        let place = Pose::new(x + 0.235 * inwards, y + side * 1.75, 0.0, turns);
                        put(ItemKind::Cupboard, [end, 2 * j + if side < 0.0 { 1 } else { 2 }], place);
                    }
                }
            }
        }
    }

    /// Panels row by row, then downlights aisle by aisle.
    pub fn rows(&self) -> Vec<LuminaireRow> {
        let [panels, downlights] = self.fluxes();
        let z = self.size.z - furniture::OPENING_DEPTH;
        let count: [u32; 2] = std::array::from_fn(|axis| self.modules[axis] * self.panels[axis]);
        let pitch: [f64; 2] = std::array::from_fn(|axis| MODULE[axis] / f64::from(self.panels[axis]));
        let panels = (0..count[1]).map(|j| LuminaireRow {
            name: format!("row {}", j + 1),
            downlights: false,
            first: DVec3::new(pitch[0] / 2.0, (f64::from(j) + 0.5) * pitch[1], z),
            count: [count[0], 1],
            pitch,
            flux: panels,
        });
        let along = 2 * self.modules[1];
        let aisles = (0..=self.modules[0]).map(|i| LuminaireRow {
            name: format!("aisle {}", i + 1),
            downlights: true,
            first: DVec3::new((f64::from(i) * MODULE[0]).clamp(FROM_WALL, self.size.x - FROM_WALL), 1.2, z),
            count: [1, along],
            pitch: [1.0, 2.4],
            flux: downlights,
        });
        panels.chain(aisles).collect()
    }

    /// Luminous flux of a panel and of a downlight, lm, to 10 lm.
    fn fluxes(&self) -> [f64; 2] {
        let [nx, ny] = self.modules.map(f64::from);
        let panels = nx * ny * f64::from(self.panels[0] * self.panels[1]);
        let downlights = (nx + 1.0) * 2.0 * ny;
        let over_plane = self.size.z - furniture::OPENING_DEPTH - 0.75;
        let room_index = self.area() / (over_plane * (self.size.x + self.size.y));
        let total = self.parameters.illuminance * self.area() / utilisation(room_index);
        let panel = total / (panels + DOWNLIGHT_SHARE * downlights);
        [panel, DOWNLIGHT_SHARE * panel].map(|flux| ((flux / 10.0 + 0.5).floor() * 10.0).max(10.0))
    }

    /// What each desk asks for, lx: what luminaires at full output reach on all of them.
    pub fn target(&self) -> f64 {
        (ASKED * self.parameters.illuminance * 10.0 + 0.5).floor() / 10.0
    }

    /// Sensors on the desks, on some of them in a large office.
    pub fn sensors(&self) -> Vec<DeskSensor> {
        let desks = self.parameters.workstations;
        let sensors = desks.min(MOST_SENSORS);
        let chosen = (0..sensors).map(|sensor| (u64::from(sensor) * u64::from(desks) / u64::from(sensors)) as u32);
        let sensor = |(desk, [row, column]): (Pose, [u32; 2])| DeskSensor {
            name: format!("desk {row}.{column}"),
            position: desk.at(DVec3::new(0.45, -0.25, 0.75)),
        };
        chosen.filter_map(|number| self.desk(number)).map(sensor).collect()
    }
}

/// Deviates of one thing.
struct Random(Stream);

impl Random {
    /// From −`most` to `most`.
    fn within(&mut self, most: f64) -> f64 {
        (2.0 * f64::from(self.0.uniform()) - 1.0) * most
    }

    fn happens(&mut self, probability: f64) -> bool {
        f64::from(self.0.uniform()) < probability
    }

    /// A whole number below `count`.
    fn below(&mut self, count: u32) -> u32 {
        (f64::from(self.0.uniform()) * f64::from(count)) as u32
    }
}

/// Modules along x and y for so many islands: nearly a square, and few left over.
fn grid_of(islands: u32) -> [u32; 2] {
    let cost = |nx: &u32| {
        let ny = islands.div_ceil(*nx);
        let ratio = f64::from(*nx) * MODULE[0] / (f64::from(ny) * MODULE[1]);
        ratio.max(1.0 / ratio) + 2.0 * f64::from(nx * ny - islands) / f64::from(islands)
    };
    let nx = (1..=islands).min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap_or(1);
    [nx, islands.div_ceil(nx)]
}

/// Panels along x and y in a module, nearest to `wanted` in all: as a ratio, then as nearly square a grid as there is.
fn panels(wanted: Option<f64>) -> [u32; 2] {
    let wanted = wanted.unwrap_or(6.0);
    let cost = |[nx, ny]: &[u32; 2]| {
        let ratio = f64::from(nx * ny) / wanted;
        let shape = f64::from(*ny) * MODULE[0] / (f64::from(*nx) * MODULE[1]);
        ratio.max(1.0 / ratio) + 0.01 * shape.max(1.0 / shape)
    };
    let all = (1..=5).flat_map(|nx| (1..=4).map(move |ny| [nx, ny]));
    all.min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap_or([3, 2])
}

/// Floor, ceiling and walls as one closed shell that faces the room; windows stand back in both long walls.
fn building(modules: [u32; 2], height: f64, windows: Windows) -> Item {
    let bays = modules[0] * (MODULE[0] / BAY) as u32;
    let mut xs = vec![0.0];
    for bay in 0..bays {
        let x = f64::from(bay) * BAY;
        xs.extend([x + 0.1 * BAY, x + 0.9 * BAY]);
    }
    xs.push(f64::from(modules[0]) * MODULE[0]);
    let ys: Vec<f64> = (0..=modules[1] * 4).map(|step| f64::from(step) * MODULE[1] / 4.0).collect();
    let zs = [0.0, SILL, (height - 0.35).min(2.4), height];

    let mut item = Item::default();
    let grid = BoxGrid::new([xs.len() - 1, ys.len() - 1, zs.len() - 1]);
    grid.points(|[i, j, k]| item.vertices.push(DVec3::new(xs[i], ys[j], zs[k])));
    let mut faces: [Vec<[u32; 4]>; 4] = Default::default();
    let [floor, ceiling, walls, panes] = &mut faces;
    grid.quads(|BoxFace { axis, high }, [a, b], [p, q, r, s]| {
        let seen_from_inside = [p, s, r, q];
        match (axis, high) {
            (2, false) => floor.push(seen_from_inside),
            (2, true) => ceiling.push(seen_from_inside),
            // On the walls along x, cells count along z, then x: the middle one of three, and every other.
            (1, _) if windows != Windows::None && a == 1 && b % 2 == 1 => {
                let out = DVec3::Y * if high { RECESS } else { -RECESS };
                let pane = seen_from_inside.map(|corner| {
                    item.vertices.push(item.vertices[corner as usize] + out);
                    item.vertices.len() as u32 - 1
                });
                panes.push(pane);
                for edge in 0..4 {
                    let next = (edge + 1) % 4;
                    walls.push([seen_from_inside[edge], seen_from_inside[next], pane[next], pane[edge]]);
                }
            }
            _ => walls.push(seen_from_inside),
        }
    });
    let materials = [Finish::Floor, Finish::Ceiling, Finish::Wall, Finish::Glass];
    for (material, faces) in materials.into_iter().zip(&faces).filter(|(_, faces)| !faces.is_empty()) {
        item.add(material, |sink| faces.iter().for_each(|&face| sink.quad(face)));
    }
    item
}
