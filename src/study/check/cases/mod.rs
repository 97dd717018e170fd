//! The cases, group by group.

mod frames;
mod geometry;
mod luminaires;
mod optics;
mod photons;
mod places;
mod rooms;

use crate::study::check::scenes::{diffuse, floor, point_lamp, room};
use crate::study::check::{Case, SceneText};

/// All of them, in the order of the table.
pub fn cases() -> Vec<Case> {
    [
        rooms::cases(),
        frames::cases(),
        geometry::cases(),
        luminaires::cases(),
        photons::cases(),
        places::cases(),
        optics::cases(),
    ]
    .concat()
}

/// The names of the groups and what each asks, in the order of the table.
pub(super) const GROUPS: [(&str, &str); 11] = [
    (
        rooms::ROOMS,
        "Closed rooms that absorb next to nothing: light bounces ten to ten thousand times. A limit on bounces \
                    would leave the room dark, a leak at an edge as well.",
    ),
    (frames::SCALE, "The same room from micrometres to thousands of kilometres: illuminance times size² stays."),
    (frames::OFFSET, "The same room far from the origin of the world's coordinates, as in survey data."),
    (
        geometry::WALLS,
        "Walls thinner than a ray's step off a surface, a million times as much light on one side as on the other.",
    ),
    (
        geometry::MESHES,
        "Meshes as they come: slivers, corners that don't meet, cracks, faces twice or the wrong way round.",
    ),
    (luminaires::LUMINAIRES, "Luminaires where they tie with surfaces, are walled in, or are where light is measured."),
    (luminaires::GRAZING, "Light that arrives nearly level: a micrometre of height matters."),
    (photons::PHOTONS, "Far too few photons, photons in one place, light shared very unevenly."),
    (
        places::PLACES,
        "Points exactly on edges, in corners, inside of things, outside; one point, and a hundred million.",
    ),
    (
        optics::GLASS,
        "Glass that absorbs nothing, traps light or holds other glass; light that mirrors bring to a point.",
    ),
    (optics::COLOURS, "Channels without light, and mirrors that face each other."),
];

/// A closed cube with sides of 4 m times `scale` about `centre`, all of one material, and a source in its middle.
fn cube(rho: f64, scale: f64, centre: [f64; 3], cells: usize) -> SceneText {
    let (low, high) = (centre.map(|c| c - 2.0 * scale), centre.map(|c| c + 2.0 * scale));
    SceneText {
        toml: [diffuse("wall", rho), point_lamp("lamp", centre, FLUX), floor(low, high, cells)].concat(),
        obj: room(low, high, ["wall"; 6]),
        mtl: String::new(),
    }
}

/// Of the source in the middle of the cube, lm.
const FLUX: f64 = 10_000.0;
/// Area of the cube, m².
const CUBE: f64 = 96.0;
