//! `[[camera]]`: an image of the illuminance on what is seen.

use glam::DVec3;

use super::super::{Camera, MeasuringPlane};
use super::keys::{Key, Section, Table};
use super::kinds::{Direction, Metres, Number, Range, Text, WholePair};
use super::{TakenNames, whole_image};
use crate::error::InputError;
use crate::files::limits::MOST_PIXELS;

static NAME: Key<Text> = Key::needed("name", Text::FILE_NAME, "\"camera 1\"", "Its name, and that of its files.");
static EYE: Key<Metres> = Key::needed("eye", Metres, "[x, y, z] (m)", "Where it stands.");
static LOOK_AT: Key<Metres> =
    Key::needed("look_at", Metres, "[x, y, z] (m)", "A point that is seen in the middle of the image.");
static UP: Key<Direction> = Key::optional(
    "up",
    Direction,
    "z; y where it looks straight up or down",
    "Direction that points to the top of the image, as far as it can.",
);
static FOV: Key<Number> = Key::needed(
    "fov",
    Number::of(Range::between(0.01, 170.0), "°").said("degrees from bottom to top, from 0.01 to 170"),
    "60 (degrees from bottom to top)",
    "Angle of view from the bottom to the top of the image.",
);
static PIXELS: Key<WholePair> =
    Key::needed("pixels", WholePair(MOST_PIXELS), "[960, 540]", "Columns and rows of the image; pixels are square.");

pub(super) static CAMERA: Table = Table {
    head: "[[camera]]",
    about: "A pinhole camera: illuminance and luminance of what its pixels see. Results are written as `NAME.exr` and \
            `NAME.png`.",
    keys: &[&NAME, &EYE, &LOOK_AT, &UP, &FOV, &PIXELS],
    rules: &[
        "`look_at` differs from `eye`, and `up` is not along the view.",
        "No camera has the name of another, nor of a plane.",
        "All cameras together have at most 25,000,000 pixels.",
    ],
    example: "\
[[camera]]
name = \"view\"
eye = [0.4, 0.4, 1.7]
look_at = [4, 5, 1]
fov = 60
pixels = [960, 540]
",
};

/// Reads one; `left` are the pixels that earlier ones have left.
pub(super) fn read(
    section: &Section<'_>,
    names: &mut TakenNames,
    planes: &[MeasuringPlane],
    left: &mut u64,
) -> Result<Camera, InputError> {
    let name = names.take_file(section, &NAME, "exr")?;
    if planes.iter().any(|plane| plane.name.to_lowercase() == name.to_lowercase()) {
        let error = section.refusal(&NAME, "a name that no [[plane]] has");
        return Err(error.hint("both are written as NAME.exr"));
    }
    let eye = section.need(&EYE)?;
    let [forward, right, up] = view_axes(section, eye)?;
    let fov = section.need(&FOV)?;
    let pixels = whole_image(section, &PIXELS, MOST_PIXELS, left)?;
    Ok(Camera { name, eye, forward, right, up, fov, pixels })
}

/// Unit vectors forward, to the right and to the top of a camera's image. Without `up`, the world's z points to the
/// top; seen straight from above or below y does, as in a plan.
fn view_axes(section: &Section<'_>, eye: DVec3) -> Result<[DVec3; 3], InputError> {
    let look_at = section.need(&LOOK_AT)?;
    let Some(forward) = (look_at - eye).try_normalize().filter(|_| look_at.distance(eye) >= 1e-9) else {
        return Err(section.refusal(&LOOK_AT, "a point other than eye"));
    };
    let sides = match section.get(&UP)? {
        Some(up) => Camera::sides(forward, up)
            .ok_or_else(|| section.refusal(&UP, "a direction other than that from eye to look_at, or its opposite"))?,
        None => Camera::sides(forward, DVec3::Z)
            .or_else(|| Camera::sides(forward, DVec3::Y))
            .expect("no direction is parallel to both z and y"),
    };
    Ok([forward, sides[0], sides[1]])
}
