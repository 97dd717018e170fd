//! The false-colour picture of a map: what a person looks at first.
//!
//! Colours run from the lowest to the highest value of the map (viridis, linear in lx; cut off above all but a
//! hundredth of the cells where those few are far brighter), isolux lines stand at the legend's ticks and carry their
//! value in lx, luminaires are outlined, cells where no light can arrive are hatched. The plane is seen from the
//! measured side, `along` to the right and `across` up, to scale unless it's thinner than 1 : 8. Maps of few cells show
//! them as squares; others are interpolated between the cells' centres, or averaged where there are more cells than
//! pixels.

mod canvas;
pub(super) mod drawing;
mod grid;
mod labels;
pub(super) mod orientation;
pub(super) mod polar;
mod scale;
mod view;

use std::io;

use glam::DVec3;

use crate::report::table::method;
use crate::results::{IlluminanceMap, Run, Statistics, statistics};
use crate::text::number::{percent, short};
use crate::units::Lux;
use canvas::{BOLD, Canvas, Ink, NORMAL, SMALL, TITLE};
use grid::{Grid, Isolux};
use labels::Line;
use scale::Scale;
pub use view::{false_colour, tone_mapped};

/// Longer side of the map, pixels.
const LONG_SIDE: f64 = 1000.0;
/// Shorter side of the map at least, pixels.
const SHORT_SIDE: f64 = LONG_SIDE / 8.0;
/// Width of the picture at least, pixels: room for the footer.
const LEAST_WIDTH: i32 = 920;
/// Height of the legend at least, pixels.
const LEGEND_HEIGHT: i32 = 340;
/// Cells on the longer side from which on they are interpolated.
const MANY_CELLS: usize = 24;
/// Columns and rows of cells that isolux lines are drawn through at most; more are averaged first, against noise.
const ISOLUX_CELLS: [usize; 2] = [360; 2];
/// Shortest isolux line, pixels: shorter ones are noise.
const SHORTEST_LINE: f32 = 40.0;
/// Distance of the axes' ticks, pixels.
const TICK_DISTANCE: f64 = 130.0;

/// Distance of the legend's ticks at least, pixels.
const TICK_DISTANCE_LEGEND: f64 = 80.0;

const PAPER: Ink = [255, 255, 255];
const TEXT: Ink = [28, 28, 30];
const QUIET: Ink = [105, 105, 112];
const HATCH: [Ink; 2] = [[226, 226, 228], [176, 176, 182]];

/// The picture of a map as a PNG file.
///
/// # Errors
/// Where a value isn't finite.
pub fn picture(map: &IlluminanceMap, run: &Run) -> io::Result<Vec<u8>> {
    map.check()?;
    let found = statistics(map);
    let layout = Layout::new(map, found.cells_without_value > 0);
    let scale = Scale::new(found.min.0, brightest_shown(map, &found), f64::from(layout.bar) / TICK_DISTANCE_LEGEND);
    let mut canvas = Canvas::new(layout.width, layout.height, PAPER);
    title(&mut canvas, &layout, map, run);
    canvas.paste(layout.map, &draw_map(map, layout.size, &scale, found.mean_standard_error));
    canvas.frame([layout.map[0] - 1, layout.map[1] - 1], [layout.size[0] + 2, layout.size[1] + 2], TEXT);
    axes(&mut canvas, &layout, map);
    if found.cells > 0 {
        legend(&mut canvas, &layout, &scale, found.max.0);
    }
    key(&mut canvas, &layout, map, &found, scale.colour((scale.low + scale.high) / 2.0));
    footer(&mut canvas, &layout, &found, run);
    canvas.encode()
}

/// The value at which the colours end: the highest, unless a few bright cells (a caustic, a lamp's foot) would leave
/// none for the others. Then it is what one cell in a hundred exceeds.
fn brightest_shown(map: &IlluminanceMap, found: &Statistics) -> f64 {
    let mut values: Vec<f64> = map.values().flatten().collect();
    let Some(rank) = values.len().checked_sub(1 + values.len() / 100) else { return found.max.0 };
    let (_, &mut common, _) = values.select_nth_unstable_by(rank, f64::total_cmp);
    if found.max.0 > 3.0 * common && common > found.min.0 { common } else { found.max.0 }
}

/// Where everything is, pixels.
struct Layout {
    /// Width of the picture.
    width: i32,
    /// Height of the picture.
    height: i32,
    /// Top left corner of the map.
    map: [i32; 2],
    /// Width and height of the map.
    size: [i32; 2],
    /// Left side of the legend.
    legend: i32,
    /// Height of the legend's bar.
    bar: i32,
    /// Top of the footer.
    footer: i32,
}

impl Layout {
    fn new(map: &IlluminanceMap, gaps: bool) -> Self {
        let size = map_size(map);
        let corner = [112, 128];
        let content = size[1].max(LEGEND_HEIGHT);
        let legend = corner[0] + size[0] + 44;
        let footer = corner[1] + content + 104;
        let keys = i32::from(gaps) + i32::from(!map.outlines.is_empty());
        Self {
            width: (legend + 190).max(LEAST_WIDTH),
            height: footer + 116,
            map: corner,
            size,
            legend,
            bar: content - if keys > 0 { 20 + 34 * keys } else { 0 },
            footer,
        }
    }
}

/// Width and height of the plane in the picture.
fn map_size(map: &IlluminanceMap) -> [i32; 2] {
    let extent = [map.along.length(), map.across.length()];
    let longer = extent[0].max(extent[1]);
    let side = |metres: f64| {
        let share = metres / longer;
        if share.is_finite() { (LONG_SIDE * share).max(SHORT_SIDE).round() as i32 } else { LONG_SIDE as i32 }
    };
    extent.map(side)
}

/// Whether a metre is as long across as along in the picture, to 2 %.
fn to_scale(map: &IlluminanceMap, size: [i32; 2]) -> bool {
    let sides = map.along.length() * f64::from(size[1]) / (map.across.length() * f64::from(size[0]));
    (sides - 1.0).abs() < 0.02
}

/// The map alone: colours, isolux lines, outlines, labels.
fn draw_map(map: &IlluminanceMap, size: [i32; 2], scale: &Scale, noise: Lux) -> Canvas {
    let mut canvas = Canvas::new(size[0], size[1], PAPER);
    let grid = Grid::new(map, size.map(|side| side.unsigned_abs() as usize));
    paint_values(&mut canvas, &grid, scale);
    let lines = isolux_lines(map, size, scale, noise);
    for line in &lines {
        canvas.line(&line.points, line.closed, 1.8, scale.ink(line.level), 0.85);
    }
    for outline in &map.outlines {
        let points: Vec<_> = outline.iter().map(|&point| outline_point(map, point, size)).collect();
        canvas.line(&points, true, 3.5, [0, 0, 0], 0.35);
        canvas.line(&points, true, 1.5, PAPER, 0.95);
    }
    labels::place(&mut canvas, &lines, scale, &|x, y| grid.between(share([x, y], size)));
    canvas
}

/// Colours every pixel by its value.
fn paint_values(canvas: &mut Canvas, grid: &Grid, scale: &Scale) {
    let size = [canvas.width(), canvas.height()];
    let coarse = is_coarse([grid.columns, grid.rows]);
    for (x, y) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))) {
        let at = share([x as f32 + 0.5, y as f32 + 0.5], size);
        let value = if coarse { grid.nearest(at) } else { grid.between(at) };
        canvas.pixel(x, y, value.map_or_else(|| hatch(x, y), |e| scale.colour(e)), 255);
    }
}

/// Whether there are so few cells that they are shown one by one.
fn is_coarse(cells: [usize; 2]) -> bool {
    cells[0].max(cells[1]) < MANY_CELLS
}

/// Colour of a pixel where there is no value.
fn hatch(x: i32, y: i32) -> Ink {
    HATCH[usize::from((x + y).rem_euclid(12) < 2)]
}

/// Isolux lines at the legend's ticks.
fn isolux_lines(map: &IlluminanceMap, size: [i32; 2], scale: &Scale, noise: Lux) -> Vec<Line> {
    let in_pixels = |line: Isolux| {
        let points: Vec<_> = line.points.iter().map(|&share| pixel(share, size)).collect();
        Line { level: line.level, points: labels::refined(&points), closed: line.closed }
    };
    let passes = if is_coarse(map.cells) { 0 } else { smoothing(noise, scale.step) };
    let lines = Grid::new(map, ISOLUX_CELLS).isolux(&scale.ticks(), passes);
    lines.into_iter().map(in_pixels).filter(|line| labels::length(&line.points) >= SHORTEST_LINE).collect()
}

/// How often to smooth the values that isolux lines are drawn through, so that their noise is a thirtieth of a step.
///
/// A pass of weights 1 : 2 : 1 in both directions widens the kernel's variance by 1/2 cell², so n passes leave
/// σ / √(2πn) of independent noise. At most 8: beyond, edges would move visibly.
fn smoothing(noise: Lux, step: f64) -> usize {
    let passes = (30.0 * noise.0 / step).powi(2) / (2.0 * std::f64::consts::PI);
    passes.ceil().clamp(0.0, 8.0) as usize
}

/// Place in the picture of a point given as shares of the plane's extent.
fn pixel([u, v]: [f64; 2], size: [i32; 2]) -> [f32; 2] {
    [(u * f64::from(size[0])) as f32, ((1.0 - v) * f64::from(size[1])) as f32]
}

/// Shares of the plane's extent of a place in the picture.
fn share([x, y]: [f32; 2], size: [i32; 2]) -> [f64; 2] {
    [f64::from(x) / f64::from(size[0]), 1.0 - f64::from(y) / f64::from(size[1])]
}

/// Place in the picture of a point given in m along and across.
fn outline_point(map: &IlluminanceMap, [along, across]: [f64; 2], size: [i32; 2]) -> [f32; 2] {
    pixel([along / map.along.length(), across / map.across.length()], size)
}

/// Scene and plane, as far as there is room.
fn title(canvas: &mut Canvas, layout: &Layout, map: &IlluminanceMap, run: &Run) {
    let text = if run.scene.is_empty() { map.name.clone() } else { format!("{} · {}", run.scene, map.name) };
    let room = layout.width - 2 * 32;
    let mut shown: String = text.chars().take((room / TITLE.width("x")) as usize).collect();
    if shown != text {
        shown.replace_range(shown.char_indices().rev().nth(2).map_or(0, |(i, _)| i).., "...");
    }
    canvas.text([32, 28], &shown, TITLE, TEXT);
}

/// An axis of the picture: metres in world coordinates where it runs along one, else metres from the corner.
struct PictureAxis {
    label: String,
    scale: Scale,
}

impl PictureAxis {
    fn new(name: &str, extent: DVec3, corner: DVec3, pixels: i32) -> Self {
        let length = if extent.length() > 0.0 { extent.length() } else { 1.0 };
        let world =
            ["x", "y", "z"].into_iter().zip(DVec3::AXES).find(|(_, axis)| axis.dot(extent) > length * (1.0 - 1e-9));
        let (label, start) = match world {
            Some((letter, axis)) if axis.dot(corner).abs() < 1e3 => (letter, axis.dot(corner)),
            _ => (name, 0.0),
        };
        let scale = Scale::new(start, start + length, f64::from(pixels) / TICK_DISTANCE);
        Self { label: format!("{label}, m"), scale }
    }
}

/// Metres along both axes.
fn axes(canvas: &mut Canvas, layout: &Layout, map: &IlluminanceMap) {
    let ([left, top], [width, height]) = (layout.map, layout.size);
    let (bottom, half_line) = (top + height, NORMAL.height() / 2);
    let horizontal = PictureAxis::new("along", map.along, map.corner, width);
    for tick in horizontal.scale.ticks() {
        let x = left + (horizontal.scale.share(tick) * f64::from(width)).round() as i32;
        let label = horizontal.scale.label(tick);
        canvas.rectangle([x, bottom], [1, 9], TEXT);
        canvas.text([x - NORMAL.width(&label) / 2, bottom + 12], &label, NORMAL, TEXT);
    }
    let label = if to_scale(map, layout.size) { horizontal.label } else { horizontal.label + " (not to scale)" };
    let end = left + width - NORMAL.width(&label);
    canvas.text([end.max(left), bottom + 40], &label, NORMAL, QUIET);
    let vertical = PictureAxis::new("across", map.across, map.corner, height);
    for tick in vertical.scale.ticks() {
        let y = bottom - (vertical.scale.share(tick) * f64::from(height)).round() as i32;
        let label = vertical.scale.label(tick);
        canvas.rectangle([left - 9, y], [9, 1], TEXT);
        canvas.text([left - 16 - NORMAL.width(&label), y - half_line], &label, NORMAL, TEXT);
    }
    canvas.text([left - 16 - NORMAL.width(&vertical.label).min(left - 32), top - 40], &vertical.label, NORMAL, QUIET);
}

/// The colour bar with its ticks; where it ends below the `highest` value, it says so.
fn legend(canvas: &mut Canvas, layout: &Layout, scale: &Scale, highest: f64) {
    let ([left, top], [width, height]) = ([layout.legend, layout.map[1]], [30, layout.bar]);
    for y in 0..height {
        let share = 1.0 - (f64::from(y) + 0.5) / f64::from(height);
        canvas.rectangle([left, top + y], [width, 1], scale.colour(scale.low + share * (scale.high - scale.low)));
    }
    canvas.frame([left - 1, top - 1], [width + 2, height + 2], TEXT);
    for tick in scale.ticks() {
        let y = top + ((1.0 - scale.share(tick)) * f64::from(height - 1)).round() as i32;
        canvas.rectangle([left, y], [width, 1], scale.ink(tick));
        canvas.rectangle([left + width, y], [9, 1], TEXT);
        canvas.text([left + width + 15, y - NORMAL.height() / 2], &scale.label(tick), NORMAL, TEXT);
    }
    canvas.text([left, top - 40], "E, lx", BOLD, TEXT);
    if highest > scale.high {
        canvas.text([left, top - 20], &format!("top: up to {}", short(highest)), SMALL, QUIET);
    }
}

/// What outlines and hatching mean, below the colour bar.
fn key(canvas: &mut Canvas, layout: &Layout, map: &IlluminanceMap, found: &Statistics, middle: Ink) {
    let mut y = layout.map[1] + layout.bar + 20;
    let size = [30, 20];
    let entries = [("luminaire", !map.outlines.is_empty()), ("no value", found.cells_without_value > 0)];
    for (label, _) in entries.into_iter().filter(|(_, shown)| *shown) {
        for (dx, dy) in (0..size[1]).flat_map(|dy| (0..size[0]).map(move |dx| (dx, dy))) {
            let hatched = label == "no value";
            let ink = if hatched { hatch(layout.legend + dx, y + dy) } else { middle };
            canvas.pixel(layout.legend + dx, y + dy, ink, 255);
        }
        if label == "luminaire" {
            canvas.frame([layout.legend, y], size, PAPER);
        }
        canvas.frame([layout.legend - 1, y - 1], [size[0] + 2, size[1] + 2], QUIET);
        canvas.text([layout.legend + size[0] + 12, y + 1], label, SMALL, TEXT);
        y += 34;
    }
}

/// Figures of the map, and how they were found.
fn footer(canvas: &mut Canvas, layout: &Layout, found: &Statistics, run: &Run) {
    let mut at = [32, layout.footer];
    canvas.rectangle([32, at[1] - 18], [layout.width - 64, 1], HATCH[1]);
    let lux = |value: f64| format!("{} lx", short(value));
    let figures = [
        ("Ē", lux(found.mean.0)),
        ("E_min", lux(found.min.0)),
        ("E_max", lux(found.max.0)),
        ("U_0", format!("{:.2}", found.uniformity)),
    ];
    for (symbol, value) in figures.iter().filter(|_| found.cells > 0) {
        let end = canvas.symbol(at, symbol, NORMAL, QUIET);
        at[0] = canvas.text([end + 10, at[1]], value, BOLD, TEXT) + 36;
    }
    if found.cells == 0 {
        canvas.text(at, "No light can arrive anywhere on this plane.", BOLD, TEXT);
    }
    canvas.text([32, at[1] + 32], &method(run), NORMAL, TEXT);
    let noise =
        format!("mean standard error {} ({} %)", lux(found.mean_standard_error.0), percent(found.relative_error()));
    let hash: String = run.scene_hash.chars().take(12).collect();
    let origin = format!("{noise} · luxmap {} · scene {hash}", env!("CARGO_PKG_VERSION"));
    canvas.text([32, at[1] + 62], &origin, SMALL, QUIET);
}
