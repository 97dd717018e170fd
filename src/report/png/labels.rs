//! Values on isolux lines, where they can be read.

use super::canvas::{Canvas, SMALL};
use super::scale::Scale;

/// An isolux line in the picture.
pub(super) struct Line {
    /// Its illuminance, lx.
    pub(super) level: f64,
    /// Its course, pixels.
    pub(super) points: Vec<[f32; 2]>,
    /// Whether its end meets its beginning.
    pub(super) closed: bool,
}

/// A rectangle: left, top, right, bottom, pixels.
type Area = [f32; 4];

/// Length of line that earns one more label, pixels.
const LINE_FOR_A_LABEL: f32 = 1400.0;
/// Shortest line that gets one, in widths of the label.
const SHORTEST: f32 = 4.0;
/// Space between labels at least, pixels.
const SPACE: f32 = 40.0;
/// Distance of points on a line at most, pixels.
const POINT_DISTANCE: f32 = 8.0;
/// Space around a text, pixels.
const PADDING: [f32; 2] = [4.0, 0.0];

/// Writes the level on each line long enough, where it runs flattest, apart from the edge and from other labels.
/// `value`: E at a place of the picture, to keep labels off slopes where they would cover other lines.
pub(super) fn place(canvas: &mut Canvas, lines: &[Line], scale: &Scale, value: &dyn Fn(f32, f32) -> Option<f64>) {
    let mut taken: Vec<Area> = Vec::new();
    let mut longest_first: Vec<_> = lines.iter().collect();
    longest_first.sort_by(|a, b| length(&b.points).total_cmp(&length(&a.points)));
    for Line { level, points, .. } in longest_first {
        let text = scale.label(*level);
        let size = [SMALL.width(&text) as f32 + 2.0 * PADDING[0], SMALL.height() as f32 + 2.0 * PADDING[1]];
        let long = length(points);
        if long < SHORTEST * size[0] {
            continue;
        }
        let edge = [canvas.width() as f32, canvas.height() as f32];
        for _ in 0..=(long / LINE_FOR_A_LABEL) as usize {
            let calm = |area: &Area| is_calm(area, *level, 0.8 * scale.step, value);
            let Some(place) = flattest(points, size, edge, &taken, &calm) else { break };
            taken.push(place);
            write(canvas, place, &text, *level, scale);
        }
    }
}

/// Writes a label on the colour of its own level, so that the line seems to pause.
fn write(canvas: &mut Canvas, [left, top, right, bottom]: Area, text: &str, level: f64, scale: &Scale) {
    let corners = [[left, top], [right, top], [right, bottom], [left, bottom]];
    canvas.polygon(&corners, scale.colour(level), 1.0);
    let at = [left + PADDING[0], top + PADDING[1]].map(|side| side.round() as i32);
    canvas.text(at, text, SMALL, scale.ink(level));
}

/// The free place for a label of this size, centred on a point of the line, where the line rises least across its
/// width.
fn flattest(
    line: &[[f32; 2]],
    size: [f32; 2],
    edge: [f32; 2],
    taken: &[Area],
    calm: &dyn Fn(&Area) -> bool,
) -> Option<Area> {
    let around = |[x, y]: [f32; 2]| [x - size[0] / 2.0, y - size[1] / 2.0, x + size[0] / 2.0, y + size[1] / 2.0];
    let inside = |b: &Area| {
        b[0] > SPACE / 8.0 && b[1] > SPACE / 8.0 && b[2] < edge[0] - SPACE / 8.0 && b[3] < edge[1] - SPACE / 8.0
    };
    let free = |b: &Area| taken.iter().all(|other| apart(b, other));
    let candidates = (0..line.len()).map(|i| (rise(line, i, size[0]), around(line[i])));
    let possible = candidates.filter(|(_, place)| inside(place) && free(place) && calm(place));
    possible.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, place)| place)
}

/// Whether E differs from `level` by no more than `most` all over an area, and has a value there.
fn is_calm(area: &Area, level: f64, most: f64, value: &dyn Fn(f32, f32) -> Option<f64>) -> bool {
    let middle = (area[0] + area[2]) / 2.0;
    let mut places = [area[0], middle, area[2]].into_iter().flat_map(|x| [(x, area[1]), (x, area[3])]);
    places.all(|(x, y)| value(x, y).is_some_and(|e| (e - level).abs() <= most))
}

/// How far a line leaves the height of its point `i` within half a label's width to both sides, pixels.
fn rise(line: &[[f32; 2]], i: usize, width: f32) -> f32 {
    let [x, y] = line[i];
    let near = |point: &&[f32; 2]| (point[0] - x).hypot(point[1] - y) < width / 2.0;
    let after = line[i..].iter().take_while(near);
    let before = line[..i].iter().rev().take_while(near);
    after.chain(before).map(|point| (point[1] - y).abs()).fold(0.0, f32::max)
}

/// Whether two rectangles keep their distance.
fn apart(a: &Area, b: &Area) -> bool {
    a[2] + SPACE < b[0] || b[2] + SPACE < a[0] || a[3] + SPACE < b[1] || b[3] + SPACE < a[1]
}

/// The line with further points where two are more than a few pixels apart, so that labels can stand anywhere on it.
pub(super) fn refined(line: &[[f32; 2]]) -> Vec<[f32; 2]> {
    let between = |pair: &[[f32; 2]]| {
        let ([x0, y0], [x1, y1]) = (pair[0], pair[1]);
        let pieces = ((x1 - x0).hypot(y1 - y0) / POINT_DISTANCE).clamp(1.0, 1e3).ceil();
        (0..pieces as usize).map(move |i| i as f32 / pieces).map(move |t| [x0 + t * (x1 - x0), y0 + t * (y1 - y0)])
    };
    line.windows(2).flat_map(between).chain(line.last().copied()).collect()
}

/// Length of a line, pixels.
pub(super) fn length(line: &[[f32; 2]]) -> f32 {
    line.windows(2).map(|pair| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1])).sum()
}
