//! Areas of a measuring plane that lighting standards look at one by one: task, surrounding, background, and what is
//! left beside the walls.

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
    /// Width of the band along the plane's rim that its figures leave out, m: 0.5 m beside walls (EN 12464-1). Tasks
    /// may reach into it, surroundings and backgrounds may not.
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

/// Number of cells, of a plane of `sides` m, whose centres lie in a rectangle. Cost: O(log cells).
pub(crate) fn centres(low: [f64; 2], high: [f64; 2], sides: [f64; 2], cells: [usize; 2]) -> usize {
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
