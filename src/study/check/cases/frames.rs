//! Sizes and places of the world's coordinates.

use crate::render::plan::Method::{Gather, Photons, Split};
use crate::study::check::cases::{CUBE, FLUX, cube};
use crate::study::check::forms::{closed_room, closed_room_noise, parallel_panel};
use crate::study::check::scenes::{diffuse, floor, panel, point_lamp, room, sensor, solid};
use crate::study::check::{Case, Measurand, SceneText};

pub(super) const SCALE: &str = "scale";
pub(super) const OFFSET: &str = "offset";

/// A black room with a panel in its ceiling and meters on its floor: 4 × 4 × 3 m times `scale`, its corner at `at`.
fn panel_room(scale: f64, at: [f64; 3]) -> SceneText {
    let place = |local: [f64; 3]| [0, 1, 2].map(|axis| at[axis] + scale * local[axis]);
    let mut toml = diffuse("black", 0.0) + &panel("panel", place([2.0, 2.0, 3.0]), [0.0, 0.0, -1.0], [scale; 2], FLUX);
    for (name, y) in METERS {
        toml += &sensor(name, place([2.0, y, 0.0]), [0.0, 0.0, 1.0]);
    }
    SceneText { toml, obj: room(place([0.0; 3]), place([4.0, 4.0, 3.0]), ["black"; 6]), mtl: String::new() }
}

const METERS: [(&str, f64); 3] = [("y = 0.25", 0.25), ("y = 1", 1.0), ("y = 2", 2.0)];

/// A closed room with a block on its floor that throws a shadow.
fn furnished(scale: f64) -> SceneText {
    let size = [5.0 * scale, 4.0 * scale, 2.7 * scale];
    let block = solid([2.0 * scale, 1.0 * scale, 0.0], [3.0 * scale, 2.0 * scale, 0.8 * scale], "block");
    SceneText {
        toml: [
            diffuse("wall", 0.5),
            diffuse("block", 0.3),
            panel("panel", [2.5 * scale, 2.5 * scale, 2.7 * scale], [0.0, 0.0, -1.0], [0.8 * scale, 0.6 * scale], FLUX),
            floor([0.0; 3], size, 20),
        ]
        .concat(),
        obj: room([0.0; 3], size, ["wall"; 6]) + &block,
        mtl: String::new(),
    }
}

pub(super) fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    let panel = |y: f64| parallel_panel(FLUX, [1.0; 2], [0.0, y - 2.0], 3.0);
    for scale in [1e-6, 1e-3, 1.0, 1e3, 1e6] {
        let mut case =
            Case::new(SCALE, format!("panel, × {scale:e}"), "direct light, closed form", panel_room(scale, [0.0; 3]));
        for (name, y) in METERS {
            case = case.expects(Measurand::Sensor(name), panel(y) / (scale * scale), 2e-4);
        }
        cases.push(case.quick());
        for method in [Gather, Split, Photons] {
            let exact = closed_room(FLUX, 0.8, CUBE) / (scale * scale);
            let name = format!("cube, ρ = 0.8, × {scale:e}, {}", method.name());
            let case =
                Case::new(SCALE, name, "no leak, no ray that meets its own start", cube(0.8, scale, [0.0; 3], 16))
                    .method(method)
                    .photons(100_000)
                    .expects(Measurand::Mean("floor"), exact, 2e-3)
                    .useful(if method == Gather { 0.05 } else { 0.2 })
                    .within(4.0 * closed_room_noise(0.8, 1e5) + 5e-3)
                    .closed();
            cases.push(if method == Gather { case.quick() } else { case });
        }
        if scale != 1.0 {
            let case = Case::new(SCALE, format!("furnished room, × {scale:e}"), "E s² as at scale 1", furnished(scale));
            let case =
                case.photons(100_000).expects_as(Measurand::Mean("floor"), furnished(1.0), 1.0 / (scale * scale), 1e-3);
            cases.push(case.closed());
        }
    }
    for offset in [1e3, 1e4, 1e5, 1e6, 1e7] {
        let at = [offset, -offset, 0.5 * offset];
        let mut case =
            Case::new(OFFSET, format!("panel, {offset:e} m away"), "direct light, closed form", panel_room(1.0, at));
        for (name, y) in METERS {
            case = case.expects(Measurand::Sensor(name), panel(y), 2e-4);
        }
        cases.push(case.quick());
        let scene = cube(0.8, 1.0, at, 16);
        let case =
            Case::new(OFFSET, format!("cube, ρ = 0.8, {offset:e} m away"), "single precision ends at 1e5 m", scene);
        let case = case.photons(100_000).expects(Measurand::Mean("floor"), closed_room(FLUX, 0.8, CUBE), 2e-3);
        cases.push(if offset > 5e6 { case.closed().quick() } else { case.closed() });
    }
    // A speck so far from the room that single precision would have no place left for the room's details, were it to
    // count.
    let mut far = panel_room(1.0, [0.0; 3]);
    far.obj += &solid([1e6, 0.0, 0.0], [1e6 + 1.0, 1.0, 1.0], "black");
    let why = "a forgotten block 1000 km away counts for nothing";
    let mut case = Case::new(OFFSET, "something far away", why, far);
    for (name, y) in METERS {
        case = case.expects(Measurand::Sensor(name), panel(y), 2e-4);
    }
    cases.push(case.quick());
    let mut far = panel_room(1.0, [0.0; 3]);
    far.toml += &sensor("far meter", [1e6, 0.0, 0.0], [0.0, 0.0, 1.0]);
    let why = "meters 1000 km from each other: rays start 1 m off surfaces";
    cases.push(Case::new(OFFSET, "a meter far away", why, far).warned("is something far away").quick());
    let far = SceneText {
        toml: point_lamp("lamp", [2e9, 0.0, 0.0], 1.0) + &sensor("meter", [0.0; 3], [0.0, 0.0, 1.0]),
        ..SceneText::default()
    };
    let why = "beyond 1e9 m even double precision ends";
    cases.push(Case::new(OFFSET, "2e9 m away", why, far).refused("within ±1e9").quick());
    cases
}
