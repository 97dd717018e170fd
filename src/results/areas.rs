//! Figures of parts of a measuring plane, as EN 12464-1 asks for them: task areas, their immediate surroundings and
//! backgrounds, and the plane without the band along its rim.

use crate::results::statistics::of_cells;
use crate::results::{Extremes, IlluminanceMap, Statistics, Verdict};
use crate::scene::MeasuringPlane;
use crate::scene::areas::{Areas, Required, holds};

/// Which part of a plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AreaKind {
    /// All of it but for the margin.
    WithinMargin,
    /// A task area.
    Task,
    /// The band around a task.
    Surrounding,
    /// The band around that.
    Background,
}

impl AreaKind {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::WithinMargin => "within margin",
            Self::Task => "task",
            Self::Surrounding => "surrounding",
            Self::Background => "background",
        }
    }
}

/// Figures of one area: over the cells whose centres lie in it.
#[derive(Clone, Debug, PartialEq)]
pub struct AreaFigures {
    /// Name of the task, or of the plane.
    pub name: String,
    /// Which part.
    pub kind: AreaKind,
    /// The figures; zeros where no cell of it has a value.
    pub figures: Statistics,
    /// What is asked of it.
    pub required: Required,
}

impl AreaFigures {
    /// Whether the figures reach what is required; `None` where nothing is. An area without a value misses it. `claim`
    /// is that of the run.
    pub fn verdict(&self, claim: f64) -> Option<Verdict> {
        let Required { mean, uniformity } = self.required;
        let Statistics { errors, .. } = self.figures;
        let judged = |least: Option<f64>, found: f64, error: f64| {
            least.map_or(Verdict::Met, |least| Verdict::of(found, error, least, claim))
        };
        (!self.required.is_empty()).then(|| match self.figures.cells {
            0 => Verdict::Missed,
            _ => judged(mean, self.figures.mean.0, errors.mean.0).and(judged(
                uniformity,
                self.figures.uniformity,
                errors.uniformity,
            )),
        })
    }

    /// Its title in tables.
    pub(crate) fn title(&self) -> String {
        format!("{}, {}", self.name, self.kind.name())
    }

    /// What is required, in words: `≥ 500 lx, U₀ ≥ 0.6`.
    pub(crate) fn required_in_words(&self) -> String {
        let mean = self.required.mean.map(|mean| format!("≥ {mean} lx"));
        let uniformity = self.required.uniformity.map(|least| format!("U₀ ≥ {least}"));
        mean.into_iter().chain(uniformity).collect::<Vec<_>>().join(", ")
    }
}

/// A rectangle, m along and across: first and last corner.
#[derive(Clone, Copy)]
struct Rectangle([[f64; 2]; 2]);

impl Rectangle {
    fn holds(&self, [x, y]: [f64; 2]) -> bool {
        let Self([low, high]) = self;
        holds(low[0], x, high[0]) && holds(low[1], y, high[1])
    }

    fn widened(&self, by: f64) -> Self {
        let Self([low, high]) = self;
        Self([low.map(|x| x - by), high.map(|x| x + by)])
    }
}

/// A part of a plane that has figures of its own.
pub(crate) struct AreaPart {
    name: String,
    kind: AreaKind,
    required: Required,
    /// The cells whose centres lie in it, in order.
    pub(crate) cells: Vec<usize>,
}

/// Every area of a plane with these sides (m) and cells, in its order: within the margin, then each task with its
/// bands. Surrounding and background end at the margin; a band without any cell in it is left out.
pub(crate) fn parts(areas: &Areas, name: &str, sides: [f64; 2], cells: [usize; 2]) -> Vec<AreaPart> {
    if areas.is_empty() {
        return Vec::new();
    }
    let centre = |cell: usize| {
        let at = [cell % cells[0], cell / cells[0]];
        [0, 1].map(|axis| sides[axis] * (at[axis] as f64 + 0.5) / cells[axis] as f64)
    };
    let part = |name: &str, kind, required, belongs: &dyn Fn([f64; 2]) -> bool| AreaPart {
        name: name.to_owned(),
        kind,
        required,
        cells: (0..cells[0] * cells[1]).filter(|&cell| belongs(centre(cell))).collect(),
    };
    let inner = Rectangle([[0.0; 2], sides]).widened(-areas.margin);
    let mut found = vec![part(name, AreaKind::WithinMargin, areas.required, &|at| inner.holds(at))];
    for task in &areas.tasks {
        let area = Rectangle([task.corner, [0, 1].map(|axis| task.corner[axis] + task.size[axis])]);
        let near = area.widened(task.surrounding.width);
        let far = near.widened(task.background.width);
        let in_near = |at| near.holds(at) && !area.holds(at) && inner.holds(at);
        let in_far = |at| far.holds(at) && !near.holds(at) && inner.holds(at);
        found.push(part(&task.name, AreaKind::Task, task.required, &|at| area.holds(at)));
        let bands = [
            part(&task.name, AreaKind::Surrounding, task.surrounding.required, &in_near),
            part(&task.name, AreaKind::Background, task.background.required, &in_far),
        ];
        found.extend(bands.into_iter().filter(|band| !band.cells.is_empty()));
    }
    found
}

/// Figures of every area of a plane; `known` of each in turn, or of none.
pub fn figures(areas: &Areas, map: &IlluminanceMap, known: &[Extremes]) -> Vec<AreaFigures> {
    let parts = parts(areas, &map.name, [map.along.length(), map.across.length()], map.cells);
    let of_part = |(index, part): (usize, AreaPart)| AreaFigures {
        figures: of_cells(map, part.cells.into_iter(), known.get(index)),
        name: part.name,
        kind: part.kind,
        required: part.required,
    };
    parts.into_iter().enumerate().map(of_part).collect()
}

/// Largest cell that EN 12464-1 (4.4) allows on an area of these sides, m: p = 0.2 · 5^(lg d), at most 10 m. d is the
/// longer side, but the shorter one where the longer is twice as long or more.
pub fn grid_spacing(sides: [f64; 2]) -> f64 {
    let (short, long) = (sides[0].min(sides[1]), sides[0].max(sides[1]));
    let d = if long >= 2.0 * short { short } else { long };
    (0.2 * 5_f64.powf(d.log10())).min(10.0)
}

/// A warning for each area whose cells are larger than the standard's.
pub(crate) fn too_coarse(plane: &MeasuringPlane) -> Vec<String> {
    if plane.areas.is_empty() {
        return Vec::new();
    }
    let sides = [plane.along.length(), plane.across.length()];
    let cell = (sides[0] / plane.cells[0] as f64).max(sides[1] / plane.cells[1] as f64);
    let whole = ("within its margin".to_owned(), sides.map(|side| side - 2.0 * plane.areas.margin));
    let tasks = plane.areas.tasks.iter().map(|task| (format!("in task \"{}\"", task.name), task.size));
    let coarse = |(place, sides): (String, [f64; 2])| {
        let most = grid_spacing(sides);
        (cell > most * (1.0 + 1e-9)).then(|| {
            format!(
                "plane \"{}\": cells of {cell:.3} m; EN 12464-1 asks for {most:.3} m at most {place}: expected more cells",
                plane.name
            )
        })
    };
    std::iter::once(whole).chain(tasks).filter_map(coarse).collect()
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, dvec3};

    use super::*;
    use crate::scene::areas::{Band, Task};

    /// 8 × 6 cells of 0.5 m: E = column + 10 · row, but cell (3, 2) has no value.
    fn map() -> IlluminanceMap {
        let values: Vec<f64> = (0..48).map(|i| f64::from(i % 8 + 10 * (i / 8))).collect();
        IlluminanceMap {
            name: "plane".into(),
            corner: DVec3::ZERO,
            along: dvec3(4.0, 0.0, 0.0),
            across: dvec3(0.0, 3.0, 0.0),
            cells: [8, 6],
            rgb: None,
            direct: None,
            standard_error: vec![0.0; 48],
            has_value: (0..48).map(|i| i != 2 * 8 + 3).collect(),
            standing: Vec::new(),
            illuminance: values,
            outlines: Vec::new(),
            groups: vec![],
            extremes: None,
            areas: Vec::new(),
        }
    }

    fn areas() -> Areas {
        let band = |width| Band { width, required: Required::default() };
        let task = Task {
            name: "desk".into(),
            corner: [1.0, 1.0],
            size: [1.0, 0.5],
            required: Required { mean: Some(22.0), uniformity: Some(0.9) },
            surrounding: band(0.5),
            background: band(3.0),
        };
        Areas { margin: 0.5, required: Required::default(), tasks: vec![task] }
    }

    /// Counted by hand: the task holds columns 2 and 3 of row 2, one of which has no value; its surrounding the ring of
    /// columns 1…4, rows 1…3; margin leaves columns 1…6 and rows 1…4, and the background what of that lies beyond.
    #[test]
    fn areas_hold_the_cells_counted_by_hand() {
        let found = figures(&areas(), &map(), &[]);
        let kinds: Vec<AreaKind> = found.iter().map(|area| area.kind).collect();
        assert_eq!(kinds, [AreaKind::WithinMargin, AreaKind::Task, AreaKind::Surrounding, AreaKind::Background]);
        let cells: Vec<_> = found.iter().map(|area| (area.figures.cells, area.figures.cells_without_value)).collect();
        assert_eq!(cells, [(23, 1), (1, 1), (10, 0), (12, 0)]);
        let bounds: Vec<_> = found.iter().map(|area| (area.figures.min.0, area.figures.max.0)).collect();
        assert_eq!(bounds, [(11.0, 46.0), (22.0, 22.0), (11.0, 34.0), (15.0, 46.0)]);
        // Ring: rows 1 and 3, columns 1…4 (means 12.5 and 32.5), and columns 1 and 4 of row 2 (21 and 24).
        assert!((found[2].figures.mean.0 - (4.0 * 12.5 + 4.0 * 32.5 + 21.0 + 24.0) / 10.0).abs() < 1e-12);
        assert_eq!(found[1].verdict(0.0), Some(Verdict::Met));
        assert_eq!(found[0].verdict(0.0), None);
    }

    #[test]
    fn what_is_required_is_missed_by_either_figure_and_without_a_value() {
        let judged = |mean, uniformity, has_value| {
            let mut areas = areas();
            areas.tasks[0].required = Required { mean: Some(mean), uniformity: Some(uniformity) };
            let mut map = map();
            map.has_value[2 * 8 + 2] = has_value;
            figures(&areas, &map, &[])[1].verdict(0.0).and_then(Verdict::met)
        };
        assert_eq!(judged(22.0, 1.0, true), Some(true));
        assert_eq!(judged(22.1, 0.5, true), Some(false));
        assert_eq!(judged(22.0, 0.5, false), Some(false));
    }

    /// The standard's own table: 0.2 m for 1 m, 0.6 m for 5 m, 1 m for 10 m, to its rounding.
    #[test]
    fn grid_spacing_is_the_standards() {
        for (side, spacing) in [(0.4, 0.11), (1.0, 0.2), (5.0, 0.62), (10.0, 1.0), (50.0, 3.1), (100.0, 5.0)] {
            let found = grid_spacing([side, side]);
            assert!((found / spacing - 1.0).abs() < 0.05, "{side} m: {found}");
        }
        assert_eq!(grid_spacing([100.0, 1.0]), grid_spacing([1.0, 1.0]));
        assert_eq!(grid_spacing([1000.0, 1000.0]), 10.0);
    }
}
