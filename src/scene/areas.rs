//! Areas of a measuring plane that lighting standards look at one by one: task, surrounding, background, and what is left
//! beside the walls.

use super::fields::Fields;
use crate::error::InputError;

/// What a standard asks of an area.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Required {
    /// Least Ē, lx.
    pub mean: Option<f64>,
    /// Least U₀ = E_min / Ē.
    pub uniformity: Option<f64>,
}

impl Required {
    /// Whether nothing is asked.
    pub fn is_empty(&self) -> bool {
        self.mean.is_none() && self.uniformity.is_none()
    }
}

/// A task area, and the bands around it.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    /// Its name.
    pub name: String,
    /// First corner, m along and across the plane.
    pub corner: [f64; 2],
    /// Size, m along and across the plane.
    pub size: [f64; 2],
    /// Asked of the task area.
    pub required: Required,
    /// Immediate surrounding area.
    pub surrounding: Band,
    /// Background area, which begins where the immediate surrounding ends.
    pub background: Band,
}

/// A band around an area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// Width, m.
    pub width: f64,
    /// Asked of it.
    pub required: Required,
}

/// The areas of a measuring plane.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Areas {
    /// Width of the band along the plane's rim that its figures leave out, m: 0.5 m beside walls (EN 12464-1). Tasks may
    /// reach into it, surroundings and backgrounds may not.
    pub margin: f64,
    /// Asked of what the margin leaves.
    pub required: Required,
    /// Task areas.
    pub tasks: Vec<Task>,
}

impl Areas {
    /// Whether nothing is asked beyond the whole plane's figures.
    pub fn is_empty(&self) -> bool {
        self.margin == 0.0 && self.required.is_empty() && self.tasks.is_empty()
    }
}

/// Widths that EN 12464-1 gives: immediate surrounding at least 0.5 m, background at least 3 m.
const SURROUNDING: f64 = 0.5;
const BACKGROUND: f64 = 3.0;

/// The keys `margin`, `required` and `task` of a plane of `sides` m and `cells`.
pub(crate) fn areas(fields: &Fields, sides: [f64; 2], cells: [usize; 2]) -> Result<Areas, InputError> {
    let narrow = sides[0].min(sides[1]) / 2.0;
    let expected = format!("a number from 0 to less than half of the plane's shorter side, {narrow} m");
    let margin = fields.number("margin", &expected, |n| (0.0..narrow).contains(&n))?.map_or(0.0, |n| n.value);
    if centres([margin; 2], [0, 1].map(|axis| sides[axis] - margin), sides, cells) == 0 {
        return Err(fields.refusal("margin", "a margin that leaves the centre of a cell"));
    }
    const KNOWN: [&str; 6] = ["name", "corner", "size", "required", "surrounding", "background"];
    let task = |(at, table)| task(&fields.within("[[plane.task]]", at, table, &KNOWN)?, sides, cells);
    let sections = fields
        .sections("task")
        .map_err(|error| InputError { expected: "sections that begin with [[plane.task]]".to_owned(), ..error })?;
    Ok(Areas { margin, required: required(fields)?, tasks: sections.into_iter().map(task).collect::<Result<_, _>>()? })
}

/// Number of cells whose centres lie in a rectangle.
fn centres(low: [f64; 2], high: [f64; 2], sides: [f64; 2], cells: [usize; 2]) -> usize {
    let inside = |axis: usize| {
        let at = |cell: usize| sides[axis] * (cell as f64 + 0.5) / cells[axis] as f64;
        let before = first(cells[axis], |cell| holds(low[axis], at(cell), f64::INFINITY));
        first(cells[axis], |cell| !holds(f64::NEG_INFINITY, at(cell), high[axis])).saturating_sub(before)
    };
    inside(0) * inside(1)
}

/// The first of so many numbers for which `is_so` holds, as it does for all after it; their count if for none.
fn first(count: usize, is_so: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut high) = (0, count);
    while low < high {
        let middle = low + (high - low) / 2;
        if is_so(middle) { high = middle } else { low = middle + 1 }
    }
    low
}

/// Whether `at` lies between two bounds, m, on which a millionth of a millimetre doesn't matter.
pub(crate) fn holds(low: f64, at: f64, high: f64) -> bool {
    low - 1e-9 <= at && at <= high + 1e-9
}

fn task(fields: &Fields, sides: [f64; 2], cells: [usize; 2]) -> Result<Task, InputError> {
    let name = fields.name("name")?.ok_or_else(|| fields.missing("name", "\"desk\""))?.value;
    let plain = "two numbers in metres, along and across the plane";
    let corner = fields.numbers::<2>("corner", &format!("{plain}, from 0 up"), |n| n >= 0.0)?;
    let corner = corner.ok_or_else(|| fields.missing("corner", "[0.8, 1.25] (m along and across)"))?.value;
    let size = fields.numbers::<2>("size", &format!("{plain}, above 0"), |n| n > 0.0)?;
    let size = size.ok_or_else(|| fields.missing("size", "[1.6, 0.8] (m along and across)"))?.value;
    let end = [corner[0] + size[0], corner[1] + size[1]];
    if (0..2).any(|axis| end[axis] > sides[axis] + 1e-9) {
        let expected = format!("a task within the plane of {} m × {} m", sides[0], sides[1]);
        return Err(fields.refusal("size", expected).hint(format!("it ends at {} m, {} m", end[0], end[1])));
    }
    if centres(corner, end, sides, cells) == 0 {
        return Err(fields.refusal("size", "a task that holds the centre of a cell").hint("give the plane more cells"));
    }
    Ok(Task {
        name,
        corner,
        size,
        required: required(fields)?,
        surrounding: band(fields, "surrounding", SURROUNDING)?,
        background: band(fields, "background", BACKGROUND)?,
    })
}

fn required(fields: &Fields) -> Result<Required, InputError> {
    match fields.table("required", "{ mean = 500, uniformity = 0.6 }", &["mean", "uniformity"])? {
        Some(table) => figures(&table),
        None => Ok(Required::default()),
    }
}

fn figures(fields: &Fields) -> Result<Required, InputError> {
    let mean = fields.number("mean", "a number from 0 up, lx", |n| n >= 0.0)?.map(|n| n.value);
    let share = |n: f64| (0.0..=1.0).contains(&n);
    Ok(Required { mean, uniformity: fields.number("uniformity", "a number from 0 to 1", share)?.map(|n| n.value) })
}

fn band(fields: &Fields, key: &str, width: f64) -> Result<Band, InputError> {
    let form = format!("{{ width = {width}, mean = 300, uniformity = 0.4 }}");
    let Some(table) = fields.table(key, &form, &["width", "mean", "uniformity"])? else {
        return Ok(Band { width, required: Required::default() });
    };
    let width = table.number("width", "a number above 0, m", |n| n > 0.0)?.map_or(width, |n| n.value);
    Ok(Band { width, required: figures(&table)? })
}
