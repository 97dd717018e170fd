//! Charts as inline SVG, drawn to be read on a phone as well; colours come from the page's style.

use maud::{Markup, Render, html};

use crate::text::number::round_to;

/// Size of a chart in its own units; text is 13 of them high.
const WIDTH: f64 = 430.0;
const HEIGHT: f64 = 330.0;
const LEFT: f64 = 54.0;
const TOP: f64 = 30.0;
const BOTTOM: f64 = 44.0;
/// Height of a line of text, and mean width of a letter.
const LINE: f64 = 15.0;
const LETTER: f64 = 7.7;
/// Width of a digit.
const DIGIT: f64 = 8.3;

/// How values become places.
#[derive(Clone, Copy)]
pub(crate) enum AxisScale {
    Linear,
    Logarithmic,
    /// Linear around 0, logarithmic beyond the threshold.
    Symmetric(f64),
}

impl AxisScale {
    fn apply(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Logarithmic => value.ln(),
            Self::Symmetric(threshold) => (value / threshold).asinh(),
        }
    }
}

/// One axis of a chart.
pub(crate) struct Axis {
    title: String,
    unit: &'static str,
    scale: AxisScale,
    low: f64,
    high: f64,
}

impl Axis {
    /// A linear axis from `low` to `high`; without a unit it has no ticks.
    pub(crate) fn linear(title: &str, unit: &'static str, low: f64, high: f64) -> Self {
        let high = if high > low { high } else { low + 1.0 };
        Self { title: title.into(), unit, scale: AxisScale::Linear, low, high }
    }

    /// A logarithmic axis with room around the positive ones of `values`.
    pub(crate) fn logarithmic(title: &str, unit: &'static str, values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = values
            .filter(|value| *value > 0.0 && value.is_finite())
            .fold((f64::INFINITY, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
        let (low, high) = if high > 0.0 { (low, high) } else { (1.0, 1.0) };
        let room = (2.0 / (high / low).sqrt()).max(1.3); // at least a factor of four in all
        Self { title: title.into(), unit, scale: AxisScale::Logarithmic, low: low / room, high: high * room }
    }

    /// An axis of both signs around 0.
    pub(crate) fn symmetric(
        title: &str,
        unit: &'static str,
        threshold: f64,
        values: impl Iterator<Item = f64>,
    ) -> Self {
        let (low, high) = values
            .filter(|value| value.is_finite())
            .fold((-2.0 * threshold, 2.0 * threshold), |(low, high), value| (low.min(value), high.max(value)));
        Self { title: title.into(), unit, scale: AxisScale::Symmetric(threshold), low: 1.4 * low, high: 1.4 * high }
    }

    /// The least and the largest value that has a place.
    pub(crate) fn ends(&self) -> [f64; 2] {
        [self.low, self.high]
    }

    /// Place of a value between 0 and 1, beyond them outside the axis.
    fn share(&self, value: f64) -> f64 {
        let [low, high] = [self.low, self.high].map(|end| self.scale.apply(end));
        (self.scale.apply(value) - low) / (high - low)
    }

    /// Round values on the axis, and whether there is room for their text: 1, 2 and 5 in every decade.
    fn ticks(&self, length: f64, gap: f64) -> Vec<(f64, bool)> {
        if matches!(self.scale, AxisScale::Linear) {
            if self.unit.is_empty() {
                return Vec::new();
            }
            // The smallest of 1, 2 and 5 times a power of ten that leaves room between.
            let least = (self.high - self.low) * gap / length;
            let decade = 10f64.powf(least.log10().floor());
            let step = [1.0, 2.0, 5.0, 10.0].map(|digit| digit * decade).into_iter().find(|step| *step >= least);
            let step = step.unwrap_or(10.0 * decade);
            let numbers = (self.low / step - 1e-9).ceil() as i64..=(self.high / step + 1e-9).floor() as i64;
            return numbers.map(|number| (round_to(number as f64 * step, 6), true)).collect();
        }
        let (signs, least): (&[f64], f64) = match self.scale {
            AxisScale::Linear => (&[], 0.0),
            AxisScale::Logarithmic => (&[1.0], self.low),
            AxisScale::Symmetric(threshold) => (&[1.0, -1.0], threshold),
        };
        let decades = least.log10().floor() as i32 - 1..=self.high.abs().max(self.low.abs()).log10().ceil() as i32;
        let zero = matches!(self.scale, AxisScale::Symmetric(_)).then_some(0.0);
        let candidates = zero.into_iter().chain([1.0, 5.0, 2.0].into_iter().flat_map(|digit| {
            decades
                .clone()
                .flat_map(move |decade| signs.iter().map(move |sign| sign * round_to(digit * 10f64.powi(decade), 1)))
        }));
        let mut ticks: Vec<(f64, bool)> = Vec::new();
        for value in candidates.filter(|value| (0.0..=1.0).contains(&self.share(*value))) {
            let near = |other: f64| (self.share(other) - self.share(value)).abs() * length < gap;
            let room = !ticks.iter().any(|&(other, labelled)| labelled && near(other));
            ticks.push((value, room));
        }
        ticks
    }

    /// A tick's text, in plain decimals.
    fn text(&self, value: f64) -> String {
        let sign = match self.scale {
            AxisScale::Symmetric(_) if value > 0.0 => "+",
            _ if value < 0.0 => "−",
            _ => "",
        };
        format!("{sign}{} {}", value.abs(), self.unit)
    }
}

/// A point of a series.
pub(crate) struct Mark {
    pub(crate) at: [f64; 2],
    /// Half the length of the bar up and down, in units of y.
    pub(crate) spread: Option<f64>,
    /// Not to be trusted as much as others.
    pub(crate) hollow: bool,
    /// What a pointer that rests on it gets to read.
    pub(crate) hint: String,
}

/// Where a series' name stands.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Side {
    /// Left of its last point.
    Left,
    /// Right of its last point.
    Right,
    /// Right of the frame, as high as its last point.
    Outside,
}

/// Points joined by a line, with their name at the end.
pub(crate) struct ChartSeries {
    /// Number of its colour and shape.
    pub(crate) hue: usize,
    /// Number among the series of that colour.
    pub(crate) dash: usize,
    pub(crate) label: String,
    pub(crate) side: Side,
    pub(crate) marks: Vec<Mark>,
}

/// Axes, what lies under the curves, and the curves.
pub(crate) struct Chart {
    x: Axis,
    y: Axis,
    left: f64,
    right: f64,
    height: f64,
    under: Elements,
    over: Elements,
}

/// Elements of a drawing, one on each line.
#[derive(Default)]
struct Elements(String);

impl Elements {
    fn add(&mut self, element: &Markup) {
        self.0.push_str(&element.0);
        self.0.push('\n');
    }
}

impl Render for Elements {
    fn render_to(&self, page: &mut String) {
        page.push_str(&self.0);
    }
}

/// A length with one decimal.
fn tenth(length: f64) -> String {
    format!("{length:.1}")
}

/// Places of a curve's or polygon's corners.
fn corners(places: &[[f64; 2]]) -> String {
    places.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ")
}

/// A straight line from one place to another.
fn straight(class: &str, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2]) -> Markup {
    html! { line class=(class) x1=(tenth(x1)) y1=(tenth(y1)) x2=(tenth(x2)) y2=(tenth(y2)) {} }
}

/// Text at a place that it begins at, ends at or has in its middle.
fn label(class: Option<&str>, [x, y]: [f64; 2], anchor: Option<&str>, text: &str) -> Markup {
    html! { text class=[class] x=(tenth(x)) y=(tenth(y)) text-anchor=[anchor] { (text) } }
}

impl Chart {
    /// An empty chart with room for names of so many letters at its right.
    pub(crate) fn new(x: Axis, y: Axis, letters: usize) -> Self {
        let right = (14.0 + LETTER * letters as f64).clamp(28.0, 130.0);
        let ticks = y.ticks(HEIGHT - TOP - BOTTOM, 18.0);
        let texts = ticks.iter().filter(|(_, labelled)| *labelled).map(|(value, _)| y.text(*value).chars().count());
        let left = (12.0 + DIGIT * texts.max().unwrap_or(0) as f64).max(LEFT);
        Self { x, y, left, right, height: HEIGHT, under: Elements::default(), over: Elements::default() }
    }

    /// The same with room for names of so many letters at its left, and so high between its axes.
    pub(crate) fn with_rows(self, letters: usize, height: f64) -> Self {
        Self { left: (10.0 + LETTER * letters as f64).max(LEFT), height: TOP + height + BOTTOM, ..self }
    }

    fn plot_width(&self) -> f64 {
        WIDTH - self.left - self.right
    }

    /// Place of a point.
    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let height = self.height - TOP - BOTTOM;
        [self.left + self.plot_width() * self.x.share(x), TOP + height * (1.0 - self.y.share(y))]
    }

    /// A straight line between two points, cut at the frame.
    pub(crate) fn line(&mut self, from: [f64; 2], to: [f64; 2], class: &str) {
        self.under.add(&straight(class, self.place(from), self.place(to)));
    }

    /// A filled polygon, cut at the frame.
    pub(crate) fn area(&mut self, points: &[[f64; 2]], class: &str) {
        let points = corners(&points.iter().map(|&point| self.place(point)).collect::<Vec<_>>());
        self.under.add(&html! { polygon class=(class) points=(points) {} });
    }

    /// A thin line without marks, cut at the frame.
    pub(crate) fn trace(&mut self, points: &[[f64; 2]], class: &str) {
        let points = corners(&points.iter().map(|&point| self.place(point)).collect::<Vec<_>>());
        self.under.add(&html! { polyline class=(class) points=(points) {} });
    }

    /// A rectangle between two corners, cut at the frame, filled as much as `share` says.
    pub(crate) fn cell(&mut self, from: [f64; 2], to: [f64; 2], share: f64, class: &str) {
        let ([x1, y1], [x2, y2]) = (self.place(from), self.place(to));
        let (x, y) = (tenth(x1.min(x2)), tenth(y1.min(y2)));
        let [width, height, share] = [(x2 - x1).abs(), (y2 - y1).abs(), share].map(|value| format!("{value:.2}"));
        self.under.add(&html! { rect class=(class) x=(x) y=(y) width=(width) height=(height) fill-opacity=(share) {} });
    }

    /// Text `offset` right of and below a point, which it ends at or begins with.
    pub(crate) fn note(&mut self, at: [f64; 2], offset: [f64; 2], ends: bool, text: &str) {
        let [x, y] = self.place(at);
        let anchor = if ends { "end" } else { "start" };
        self.over.add(&label(Some("note"), [x + offset[0], y + offset[1]], Some(anchor), text));
    }

    /// Draws all series, then their names, so that no name hides under a curve or on another name.
    pub(crate) fn series(&mut self, all: &[ChartSeries]) {
        let mut names: Vec<Name> = Vec::new();
        for series in all {
            let places: Vec<[f64; 2]> = series.marks.iter().map(|mark| self.place(mark.at)).collect();
            let mut elements = Elements::default();
            elements.add(&html! { polyline class="curve" points=(corners(&places)) {} });
            for (mark, &[x, y]) in series.marks.iter().zip(&places) {
                if let Some(spread) = mark.spread {
                    let end = |y: f64| [x, self.place([mark.at[0], y])[1]];
                    elements.add(&straight("spread", end(mark.at[1] + spread), end(mark.at[1] - spread)));
                }
                let class = if mark.hollow { "mark hollow" } else { "mark" };
                let moved = format!("translate({x:.1} {y:.1})");
                elements.add(&html! {
                    path class=(class) transform=(moved) d=(shape(series.hue)) { title { (mark.hint) } }
                });
            }
            self.over.add(&html! { g class={ "m" (series.hue) " d" (series.dash) } { "\n" (elements) } });
            if let Some(&[x, y]) = places.last() {
                let width = LETTER * series.label.chars().count() as f64;
                let x = match series.side {
                    Side::Left if x - 10.0 - width > self.left => x - 10.0 - width,
                    Side::Left | Side::Right => x + 10.0,
                    Side::Outside => self.left + self.plot_width() + 8.0,
                };
                names.push(Name { x, y: y + 4.5, width, hue: series.hue, text: series.label.clone() });
            }
        }
        for Name { x, y, hue, text, .. } in apart(names) {
            self.over.add(&label(Some(&format!("name m{hue}")), [x, y], None, &text));
        }
    }

    /// The lines across the frame at the axes' ticks, with their texts.
    fn grid(&self) -> Elements {
        let (left, width, height) = (self.left, self.plot_width(), self.height - TOP - BOTTOM);
        let (right, bottom) = (left + width, TOP + height);
        let mut grid = Elements::default();
        for (value, labelled) in self.x.ticks(width, 46.0) {
            let x = left + width * self.x.share(value);
            grid.add(&straight(if labelled { "grid" } else { "grid fine" }, [x, TOP], [x, bottom]));
            if labelled {
                grid.add(&label(None, [x, bottom + 17.0], Some("middle"), &self.x.text(value)));
            }
        }
        for (value, labelled) in self.y.ticks(height, 18.0) {
            let y = TOP + height * (1.0 - self.y.share(value));
            let class = match labelled {
                _ if value == 0.0 => "grid zero",
                true => "grid",
                false => "grid fine",
            };
            grid.add(&straight(class, [left, y], [right, y]));
            if labelled {
                grid.add(&label(None, [left - 6.0, y + 4.5], Some("end"), &self.y.text(value)));
            }
        }
        grid
    }

    /// The chart, with what it shows in words.
    pub(crate) fn svg(&self, description: &str) -> Markup {
        let (left, width, height) = (self.left, self.plot_width(), self.height - TOP - BOTTOM);
        let (right, foot) = (left + width, self.height - 8.0);
        // An inner picture with the same coordinates cuts what lies under the curves.
        html! {
            svg viewBox=(format!("0 0 {WIDTH} {}", self.height)) role="img" aria-label=(description) {
                "\n" (self.grid())
                (label(Some("axis"), [4.0, 16.0], None, &self.y.title)) "\n"
                (label(Some("axis"), [right, foot], Some("end"), &self.x.title)) "\n"
                svg x=(left.to_string()) y=(TOP.to_string()) width=(tenth(width)) height=(height.to_string())
                    viewBox=(format!("{left} {TOP} {width:.1} {height}")) { "\n" (self.under) }
                "\n" (self.over)
            }
            "\n"
        }
    }
}

/// A name with its place: left end of the baseline.
pub(crate) struct Name {
    x: f64,
    y: f64,
    width: f64,
    hue: usize,
    text: String,
}

/// Moves names down until none covers another.
fn apart(mut names: Vec<Name>) -> Vec<Name> {
    names.sort_by(|a, b| a.y.total_cmp(&b.y));
    let mut placed: Vec<Name> = Vec::new();
    for mut name in names {
        let covers = |name: &Name, other: &Name| {
            name.x < other.x + other.width && other.x < name.x + name.width && (name.y - other.y).abs() < LINE - 0.01
        };
        while let Some(other) = placed.iter().find(|other| covers(&name, other)) {
            name.y = other.y + LINE;
        }
        placed.push(name);
    }
    placed
}

/// Outline of a mark around the origin: colour alone must not tell methods apart.
fn shape(hue: usize) -> &'static str {
    match hue % 5 {
        0 => "M-4.5,0a4.5,4.5 0 1,0 9,0a4.5,4.5 0 1,0 -9,0z",
        1 => "M-4,-4h8v8h-8z",
        2 => "M0,-5.5L5.5,0L0,5.5L-5.5,0z",
        3 => "M0,-5.2L5,4L-5,4z",
        _ => "M0,5.2L5,-4L-5,-4z",
    }
}

/// A bar of parts that add up to a whole.
pub(crate) struct Bar {
    /// Number of its group's colour.
    pub(crate) hue: usize,
    pub(crate) label: String,
    pub(crate) parts: Vec<f64>,
    /// What stands right of it.
    pub(crate) total: String,
}

/// Bars of equal length, one below the other, each divided into the shares of its parts.
pub(crate) fn shares(names: &[&str], bars: &[Bar], description: &str) -> Markup {
    const STEP: f64 = 21.0;
    let letters = bars.iter().map(|bar| bar.label.chars().count()).max().unwrap_or(0) as f64;
    let (left, right) = ((8.0 + LETTER * letters).min(180.0), 60.0);
    let used: Vec<usize> = (0..names.len()).filter(|&i| bars.iter().any(|bar| bar.parts[i] > 0.0)).collect();
    let mut elements = Elements::default();
    let first = key(names, &used, &mut elements) + 12.0;
    let mut gaps = 0.0;
    for (row, bar) in bars.iter().enumerate() {
        if row > 0 && bar.hue != bars[row - 1].hue {
            gaps += 7.0;
        }
        let y = first + STEP * row as f64 + gaps;
        let baseline = y + 13.5;
        elements.add(&label(Some(&format!("row m{}", bar.hue)), [4.0, baseline], None, &bar.label));
        let whole: f64 = bar.parts.iter().sum();
        let mut x = left;
        for &part in &used {
            let length = if whole > 0.0 { (WIDTH - left - right) * bar.parts[part] / whole } else { 0.0 };
            if length > 0.0 {
                let name = names[part];
                let hint = format!("{name} {:.0} %", 100.0 * bar.parts[part] / whole);
                elements.add(&html! {
                    rect class={ "s" (part) } x=(tenth(x)) y=(tenth(y)) width=(tenth(length)) height="18" {
                        title { (hint) }
                    }
                });
                if length > 14.0 + 6.2 * name.chars().count() as f64 {
                    elements.add(&label(Some("part"), [x + length / 2.0, baseline], Some("middle"), name));
                }
            }
            x += length;
        }
        elements.add(&label(None, [WIDTH, baseline], Some("end"), &bar.total));
    }
    let height = first + STEP * bars.len() as f64 + gaps;
    html! {
        svg viewBox=(format!("0 0 {WIDTH} {height:.0}")) role="img" aria-label=(description) { "\n" (elements) } "\n"
    }
}

/// Colours and names of the parts that are used, above the bars; returns the last line's height.
fn key(names: &[&str], used: &[usize], elements: &mut Elements) -> f64 {
    let (mut x, mut y) = (4.0, 14.0);
    for &part in used {
        let needed = 30.0 + LETTER * names[part].chars().count() as f64;
        if x + needed > WIDTH {
            (x, y) = (4.0, y + 19.0);
        }
        elements.add(&html! {
            rect class={ "s" (part) } x=(tenth(x)) y=(tenth(y - 10.0)) width="11" height="11" {}
            (label(None, [x + 16.0, y], None, names[part]))
        });
        x += needed;
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis, length: f64, gap: f64) -> Vec<String> {
        let mut ticks: Vec<f64> =
            axis.ticks(length, gap).into_iter().filter(|tick| tick.1).map(|tick| tick.0).collect();
        ticks.sort_by(f64::total_cmp);
        ticks.into_iter().map(|value| axis.text(value)).collect()
    }

    #[test]
    fn ticks_are_plain_decimals_with_room_between() {
        let seconds = Axis::logarithmic("t", "s", [0.19, 4.0].into_iter());
        assert_eq!(labels(&seconds, 300.0, 40.0), ["0.2 s", "0.5 s", "1 s", "2 s", "5 s"]);
        let decades = Axis::logarithmic("t", "s", [0.01, 1000.0].into_iter());
        assert_eq!(labels(&decades, 300.0, 40.0), ["0.01 s", "0.1 s", "1 s", "10 s", "100 s", "1000 s"]);
        let bias = Axis::symmetric("b", "%", 0.1, [-0.3, 8.0].into_iter());
        assert_eq!(
            labels(&bias, 256.0, 18.0),
            ["−0.2 %", "−0.1 %", "0 %", "+0.1 %", "+0.2 %", "+0.5 %", "+1 %", "+2 %", "+5 %", "+10 %"]
        );
    }

    #[test]
    fn an_axis_of_no_or_one_value_still_has_room() {
        for values in [vec![], vec![0.0], vec![3.0]] {
            let axis = Axis::logarithmic("t", "s", values.into_iter());
            let [low, high] = axis.ends();
            assert!((high / low - 4.0).abs() < 1e-9 && low > 0.0, "{low} … {high}");
        }
    }

    #[test]
    fn names_do_not_cover_each_other() {
        let name = |x, y| Name { x, y, width: 40.0, hue: 0, text: String::new() };
        let placed = apart(vec![name(0.0, 10.0), name(10.0, 12.0), name(30.0, 20.0), name(100.0, 11.0)]);
        for (i, a) in placed.iter().enumerate() {
            for b in &placed[..i] {
                assert!((a.x - b.x).abs() >= 40.0 || (a.y - b.y).abs() >= LINE - 0.01);
            }
        }
        assert!(placed.iter().any(|name| (name.x, name.y) == (100.0, 11.0)), "one that has room stays");
    }
}
