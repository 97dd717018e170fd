//! `[[plane]]`: a rectangle of grid points, and the areas of it that standards look at.

use glam::DVec3;

use super::super::areas::{Areas, Band, Required, Task, centres};
use super::super::{MeasuringPlane, PlaneKind};
use super::keys::{Key, Section, Sections, Table};
use super::kinds::{Inner, Metres, Number, Numbers, OneOf, Range, Text, WholePair};
use super::{TakenNames, whole_image};
use crate::error::InputError;
use crate::files::limits::MOST_CELLS;

static NAME: Key<Text> = Key::needed("name", Text::FILE_NAME, "\"plane 1\"", "Its name, and that of its files.");
static CORNER: Key<Metres> = Key::needed("corner", Metres, "[x, y, z] (m)", "Corner of the first cell.");
static ALONG: Key<Metres> = Key::needed(
    "along",
    Metres,
    "[x, y, z] (m)",
    "Whole side of the plane from `corner` on, along which columns count.",
);
static ACROSS: Key<Metres> =
    Key::needed("across", Metres, "[x, y, z] (m)", "The other side from `corner` on, along which rows count.");
static CELLS: Key<WholePair> = Key::needed(
    "cells",
    WholePair(MOST_CELLS),
    "[120, 144]",
    "Number of cells along and across; grid points are their centres.",
);
static ON: Key<OneOf<PlaneKind>> = Key::optional(
    "on",
    OneOf(&[("surface", PlaneKind::Surface), ("air", PlaneKind::Air)]),
    "\"surface\"",
    "Whether it lies on a surface, or is a virtual plane that light passes.",
);
static MARGIN: Key<Number> = Key::optional(
    "margin",
    Number::of(Range::from(0.0), "m"),
    "0",
    "Width of the band along the rim that figures leave out: 0.5 m beside walls in EN 12464-1.",
);
const REQUIRED_FIGURES: Inner<Required> =
    Inner { form: "{ mean = 500, uniformity = 0.6 }", table: &FIGURES, read: figures };
static REQUIRED: Key<Inner<Required>> =
    Key::optional("required", REQUIRED_FIGURES, "nothing", "What is required of the plane without its margin.");
static TASK: Key<Sections> = Key::optional(
    "task",
    Sections(&TASK_AREA),
    "none",
    "Task areas with their surroundings, below the plane's own keys.",
);

pub(super) static PLANE: Table = Table {
    head: "[[plane]]",
    about: "A rectangle of grid points where illuminance is computed. The side is measured towards which `along` × \
            `across` points: along = +x and across = +y measure light from above. Results are written as `NAME.exr`, \
            `NAME.png` and `NAME.csv`.",
    keys: &[&NAME, &CORNER, &ALONG, &ACROSS, &CELLS, &ON, &MARGIN, &REQUIRED, &TASK],
    rules: &[
        "`along` and `across` are at a right angle.",
        "`margin` is less than half of the shorter side, and leaves the centre of a cell.",
        "No two planes have the same name; all together have at most 268,435,456 cells.",
    ],
    example: "\
[[plane]]
name = \"workplane\"
corner = [0, 0, 0.75]
along = [6.0, 0, 0]
across = [0, 7.2, 0]
cells = [120, 144]
on = \"air\"
margin = 0.5
required = { mean = 300 }
",
};

static TASK_NAME: Key<Text> = Key::needed("name", Text::NAME, "\"desk\"", "Its name.");
static TASK_CORNER: Key<Numbers<2>> = Key::needed(
    "corner",
    Numbers::of(Range::from(0.0), "m").said("two numbers in metres, along and across the plane, from 0 up"),
    "[0.8, 1.25] (m along and across)",
    "First corner, measured from the plane's corner along and across it.",
);
static TASK_SIZE: Key<Numbers<2>> = Key::needed(
    "size",
    Numbers::of(Range::above(0.0), "m").said("two numbers in metres, along and across the plane, above 0"),
    "[1.6, 0.8] (m along and across)",
    "Size along and across the plane.",
);
static TASK_REQUIRED: Key<Inner<Required>> =
    Key::optional("required", REQUIRED_FIGURES, "nothing", "What is required of the task area.");
static SURROUNDING: Key<Inner<Band>> = Key::optional(
    "surrounding",
    Inner {
        form: "{ width = 0.5, mean = 300, uniformity = 0.4 }",
        table: &SURROUNDING_BAND,
        read: |table| Ok(Band { width: table.get(&SURROUNDING_WIDTH)?.unwrap_or(NEAR), required: figures(table)? }),
    },
    "0.5 m, nothing required",
    "Immediate surrounding area: a band around the task area.",
);
static BACKGROUND: Key<Inner<Band>> = Key::optional(
    "background",
    Inner {
        form: "{ width = 3, mean = 300, uniformity = 0.4 }",
        table: &BACKGROUND_BAND,
        read: |table| Ok(Band { width: table.get(&BACKGROUND_WIDTH)?.unwrap_or(FAR), required: figures(table)? }),
    },
    "3 m, nothing required",
    "Background area: a band around the immediate surrounding area.",
);

static TASK_AREA: Table = Table {
    head: "[[plane.task]]",
    about: "A task area of the `[[plane]]` above it, as EN 12464-1 has it, with the bands around it. Tasks may reach \
            into the plane's margin, surroundings and backgrounds don't.",
    keys: &[&TASK_NAME, &TASK_CORNER, &TASK_SIZE, &TASK_REQUIRED, &SURROUNDING, &BACKGROUND],
    rules: &["The area lies within its plane and holds the centre of a cell."],
    example: "\
[[plane]]
name = \"workplane\"
corner = [0, 0, 0.75]
along = [6.0, 0, 0]
across = [0, 7.2, 0]
cells = [60, 72]
on = \"air\"

[[plane.task]]
name = \"desk 0\"
corner = [0.8, 1.25]
size = [1.4, 0.7]
required = { mean = 500, uniformity = 0.6 }
surrounding = { width = 0.5, mean = 300, uniformity = 0.4 }
background = { width = 3.0, mean = 100, uniformity = 0.1 }
",
};

static MEAN: Key<Number> =
    Key::optional("mean", Number::of(Range::from(0.0), "lx"), "nothing", "Least mean illuminance Ē.");
static UNIFORMITY: Key<Number> =
    Key::optional("uniformity", Number::of(Range::SHARE, ""), "nothing", "Least uniformity U₀ = E_min / Ē.");

static FIGURES: Table = Table {
    head: "required",
    about: "What a standard requires of an area; `luxmap render --check` fails where it is missed.",
    keys: &[&MEAN, &UNIFORMITY],
    rules: &[],
    example: "",
};

/// Widths that EN 12464-1 gives, m: immediate surrounding at least 0.5 m, background at least 3 m.
const NEAR: f64 = 0.5;
const FAR: f64 = 3.0;

static SURROUNDING_WIDTH: Key<Number> =
    Key::optional("width", Number::of(Range::above(0.0), "m"), "0.5", "Width of the band.");
static BACKGROUND_WIDTH: Key<Number> =
    Key::optional("width", Number::of(Range::above(0.0), "m"), "3", "Width of the band.");

static SURROUNDING_BAND: Table = Table {
    head: "surrounding",
    about: "The band around a task area.",
    keys: &[&SURROUNDING_WIDTH, &MEAN, &UNIFORMITY],
    rules: &[],
    example: "",
};
static BACKGROUND_BAND: Table = Table {
    head: "background",
    about: "The band around the immediate surrounding area.",
    keys: &[&BACKGROUND_WIDTH, &MEAN, &UNIFORMITY],
    rules: &[],
    example: "",
};

/// Reads one; `left` are the cells that earlier ones have left.
pub(super) fn read(
    section: &Section<'_>,
    names: &mut TakenNames,
    left: &mut u64,
) -> Result<MeasuringPlane, InputError> {
    let name = names.take_file(section, &NAME, "exr")?;
    let [along, across] = sides(section)?;
    let cells = whole_image(section, &CELLS, MOST_CELLS, left)?;
    Ok(MeasuringPlane {
        name,
        corner: section.need(&CORNER)?,
        areas: areas(section, [along.length(), across.length()], cells)?,
        along,
        across,
        cells,
        kind: section.get(&ON)?.unwrap_or(PlaneKind::Surface),
    })
}

/// The two sides of a measuring plane.
fn sides(section: &Section<'_>) -> Result<[DVec3; 2], InputError> {
    let side = |key: &Key<Metres>| {
        let side = section.need(key)?;
        if side.length() < 1e-9 {
            return Err(section.refusal(key, "a side longer than 0"));
        }
        Ok(side)
    };
    let (along, across) = (side(&ALONG)?, side(&ACROSS)?);
    if along.normalize().dot(across.normalize()).abs() > 1e-6 {
        let error = section.refusal(&ACROSS, "a vector at a right angle to along");
        return Err(error.hint(format!("the angle is {:.4}°", along.angle_between(across).to_degrees())));
    }
    Ok([along, across])
}

/// The areas of a plane of `sides` m and `cells`.
fn areas(section: &Section<'_>, sides: [f64; 2], cells: [usize; 2]) -> Result<Areas, InputError> {
    let narrow = sides[0].min(sides[1]) / 2.0;
    let expected = || format!("a number from 0 to less than half of the plane's shorter side, {narrow} m");
    let margin = section.get(&MARGIN).map_err(|error| InputError { expected: expected(), ..error })?.unwrap_or(0.0);
    if margin >= narrow {
        return Err(section.refusal(&MARGIN, expected()));
    }
    if centres([margin; 2], [0, 1].map(|axis| sides[axis] - margin), sides, cells) == 0 {
        return Err(section.refusal(&MARGIN, "a margin that leaves the centre of a cell"));
    }
    let tasks = section.sections(&TASK)?;
    let required = section.get(&REQUIRED)?.unwrap_or_default();
    let tasks = tasks.map(|area| task(&area?, sides, cells)).collect::<Result<_, _>>()?;
    Ok(Areas { margin, required, tasks })
}

fn task(section: &Section<'_>, sides: [f64; 2], cells: [usize; 2]) -> Result<Task, InputError> {
    let name = section.need(&TASK_NAME)?;
    let corner = section.need(&TASK_CORNER)?;
    let size = section.need(&TASK_SIZE)?;
    let end = [corner[0] + size[0], corner[1] + size[1]];
    if (0..2).any(|axis| end[axis] > sides[axis] + 1e-9) {
        let expected = format!("a task within the plane of {} m × {} m", sides[0], sides[1]);
        return Err(section.refusal(&TASK_SIZE, expected).hint(format!("it ends at {} m, {} m", end[0], end[1])));
    }
    if centres(corner, end, sides, cells) == 0 {
        let error = section.refusal(&TASK_SIZE, "a task that holds the centre of a cell");
        return Err(error.hint("give the plane more cells"));
    }
    Ok(Task {
        name,
        corner,
        size,
        required: section.get(&TASK_REQUIRED)?.unwrap_or_default(),
        surrounding: section.get(&SURROUNDING)?.unwrap_or(Band { width: NEAR, required: Required::default() }),
        background: section.get(&BACKGROUND)?.unwrap_or(Band { width: FAR, required: Required::default() }),
    })
}

fn figures(table: &Section<'_>) -> Result<Required, InputError> {
    Ok(Required { mean: table.get(&MEAN)?, uniformity: table.get(&UNIFORMITY)? })
}
