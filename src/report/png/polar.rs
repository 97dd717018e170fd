//! The polar diagram of a luminaire: intensity over γ in the sections C0/C180 and C90/C270, as SVG and as PNG.
//!
//! The nadir is below, C0 and C90 are to the right. Both formats are drawn from one list of lines and texts.

use std::fmt::Write as _;
use std::io;

use super::canvas::{BOLD, Canvas, Font, Ink, NORMAL, SMALL, TITLE};
use super::scale::Scale;
use crate::luminaire::intensity::Intensity;
use crate::luminaire::photometry::{Photometry, Symmetry};
use crate::report::html::escape;
use crate::report::luminaire::Figures;
use crate::report::number::short;

/// Width of the diagram, pixels.
const WIDTH: f64 = 860.0;
/// Radius of the outermost circle, pixels.
const RADIUS: f64 = 330.0;
/// Top of the circles.
const TOP: f64 = 150.0;
/// Height above the horizon that is shown where nothing shines up.
const SLIVER: f64 = 30.0;
/// Lengths of the dashes of the second section and of the gaps between them.
const DASH: [f64; 2] = [14.0, 7.0];

const PAPER: Ink = [255, 255, 255];
const TEXT: Ink = [28, 28, 30];
const QUIET: Ink = [105, 105, 112];
const GRID: Ink = [214, 214, 218];
/// Blue and orange, told apart by the colour-blind too.
const SECTIONS: [(&str, Ink); 2] = [("C0/C180", [0, 96, 176]), ("C90/C270", [200, 84, 0])];

/// Where a text stands at its place.
#[derive(Clone, Copy, PartialEq)]
enum Anchor {
    Start,
    Middle,
}

enum Item {
    Line {
        points: Vec<[f64; 2]>,
        closed: bool,
        width: f64,
        ink: Ink,
    },
    /// Its place is the left or middle of its centre line.
    Text {
        at: [f64; 2],
        text: String,
        font: Font,
        anchor: Anchor,
        ink: Ink,
    },
}

/// A diagram, ready for either format.
pub(in crate::report) struct Diagram {
    size: [f64; 2],
    items: Vec<Item>,
    /// What it shows, in words.
    description: String,
}

/// Draws a luminaire's diagram.
pub(in crate::report) fn diagram(photometry: &Photometry, figures: &Figures) -> Diagram {
    let up = figures.down < 0.999;
    let centre = [WIDTH / 2.0, TOP + if up { RADIUS } else { SLIVER }];
    let foot = centre[1] + RADIUS + 46.0;
    let name = if photometry.name.is_empty() { "luminaire" } else { &photometry.name };
    let mut diagram = Diagram {
        size: [WIDTH, foot + 96.0],
        items: Vec::new(),
        description: format!("Polar diagram of the luminous intensity of {name}"),
    };
    diagram.head(photometry, figures, name);
    let scale = Scale::new(0.0, figures.largest[0], 4.0);
    diagram.grid(centre, &scale, up);
    let sections = if photometry.symmetry == Symmetry::Rotational { 1 } else { 2 };
    for (section, (_, ink)) in SECTIONS.into_iter().enumerate().take(sections) {
        let curve = curve(&photometry.intensity, 90.0 * section as f64, centre, RADIUS / outermost(&scale));
        if section == 0 {
            diagram.line(curve, true, 3.0, ink);
        } else {
            dashes(&curve).into_iter().for_each(|dash| diagram.line(dash, false, 3.0, ink));
        }
    }
    diagram.key(figures, foot, sections);
    diagram
}

/// Value of the outermost circle: the first tick that is no less than the largest intensity.
fn outermost(scale: &Scale) -> f64 {
    (scale.high / scale.step - 1e-9).ceil() * scale.step
}

/// The curve of a section, from the zenith over the first plane's side and the nadir back, pixels.
fn curve(intensity: &Intensity, c: f64, centre: [f64; 2], pixels: f64) -> Vec<[f64; 2]> {
    let mut angles: Vec<f64> = intensity.angles().to_vec();
    angles.extend((0..=360).map(|half| 0.5 * f64::from(half)));
    let (first, last) = (intensity.angles()[0], intensity.angles()[intensity.angles().len() - 1]);
    angles.extend([first - 1e-6, last + 1e-6].into_iter().filter(|gamma| (0.0..=180.0).contains(gamma)));
    angles.sort_by(f64::total_cmp);
    let place = |c: f64, gamma: f64, side: f64| {
        let (sin, cos) = gamma.to_radians().sin_cos();
        let length = intensity.at(c, gamma) * pixels;
        [centre[0] + side * length * sin, centre[1] + length * cos]
    };
    let right = angles.iter().rev().map(|&gamma| place(c, gamma, 1.0));
    let left = angles.iter().map(|&gamma| place(c + 180.0, gamma, -1.0));
    let mut points: Vec<[f64; 2]> = right.chain(left).collect();
    points.dedup_by(|next, kept| (next[0] - kept[0]).hypot(next[1] - kept[1]) < 0.05);
    points
}

/// A closed curve cut into dashes.
fn dashes(curve: &[[f64; 2]]) -> Vec<Vec<[f64; 2]>> {
    let closed = curve.iter().chain(curve.first()).copied().collect::<Vec<_>>();
    let mut dashes: Vec<Vec<[f64; 2]>> = vec![closed.first().copied().into_iter().collect()];
    let (mut drawing, mut left) = (true, DASH[0]);
    for pair in closed.windows(2) {
        let ([x0, y0], [x1, y1]) = (pair[0], pair[1]);
        let length = (x1 - x0).hypot(y1 - y0);
        let mut done = 0.0;
        while length - done > left {
            done += left;
            let at = [x0 + (x1 - x0) * done / length, y0 + (y1 - y0) * done / length];
            match dashes.last_mut() {
                Some(dash) if drawing => dash.push(at),
                _ => dashes.push(vec![at]),
            }
            drawing = !drawing;
            left = DASH[usize::from(!drawing)];
        }
        left -= length - done;
        if let Some(dash) = dashes.last_mut().filter(|_| drawing) {
            dash.push([x1, y1]);
        }
    }
    dashes.retain(|dash| dash.len() > 1);
    dashes
}

impl Diagram {
    fn line(&mut self, points: Vec<[f64; 2]>, closed: bool, width: f64, ink: Ink) {
        self.items.push(Item::Line { points, closed, width, ink });
    }

    fn text(&mut self, at: [f64; 2], text: impl Into<String>, font: Font, anchor: Anchor, ink: Ink) {
        self.items.push(Item::Text { at, text: text.into(), font, anchor, ink });
    }

    /// Title, and the luminaire in a line.
    fn head(&mut self, photometry: &Photometry, figures: &Figures, name: &str) {
        let room = ((WIDTH - 64.0) / f64::from(TITLE.width("x"))) as usize;
        self.text([32.0, 44.0], shortened(name, room), TITLE, Anchor::Start, TEXT);
        let mut facts = vec![photometry.manufacturer.clone(), photometry.catalogue.clone()];
        facts.push(photometry.format.name().into());
        facts.push(format!("{} lm", short(figures.flux)));
        if let Some(power) = photometry.power {
            facts.push(format!("{} W, {} lm/W", short(power), short(figures.flux / power)));
        }
        facts.retain(|fact| !fact.is_empty());
        let room = ((WIDTH - 64.0) / f64::from(NORMAL.width("x"))) as usize;
        self.text([32.0, 84.0], shortened(&facts.join(" · "), room), NORMAL, Anchor::Start, QUIET);
    }

    /// Circles of equal intensity, rays of equal γ.
    fn grid(&mut self, [x, y]: [f64; 2], scale: &Scale, up: bool) {
        let highest = if up { 180 } else { 90 };
        let ticks = (1..=(outermost(scale) / scale.step).round() as usize).map(|tick| tick as f64 * scale.step);
        for tick in ticks.clone() {
            let radius = RADIUS * tick / outermost(scale);
            let arc = (-highest..=highest).map(|degree| {
                let (sin, cos) = f64::from(degree).to_radians().sin_cos();
                [x + radius * sin, y + radius * cos]
            });
            let points = arc.collect();
            self.line(points, up, 1.0, GRID);
        }
        for gamma in (0..=highest).step_by(30) {
            let (sin, cos) = f64::from(gamma).to_radians().sin_cos();
            let sides: &[f64] = if gamma % 180 == 0 { &[1.0] } else { &[1.0, -1.0] };
            for side in sides {
                self.line(vec![[x, y], [x + side * RADIUS * sin, y + RADIUS * cos]], false, 1.0, GRID);
                let [away, along] = [RADIUS + 32.0, RADIUS + 22.0];
                self.text([x + side * away * sin, y + along * cos], format!("{gamma}°"), NORMAL, Anchor::Middle, QUIET);
            }
        }
        for tick in ticks {
            let (sin, cos) = 15_f64.to_radians().sin_cos();
            let radius = RADIUS * tick / outermost(scale);
            let label = scale.label(tick);
            self.text([x + radius * sin + 4.0, y + radius * cos - 10.0], label, SMALL, Anchor::Start, TEXT);
        }
        self.text([32.0, y + RADIUS], "I, cd", BOLD, Anchor::Start, TEXT);
    }

    /// Which line is which section, and its angles.
    fn key(&mut self, figures: &Figures, top: f64, sections: usize) {
        for (section, (name, ink)) in SECTIONS.into_iter().enumerate().take(sections) {
            let y = top + 20.0 + 32.0 * section as f64;
            if section == 0 {
                self.line(vec![[32.0, y], [80.0, y]], false, 3.0, ink);
            } else {
                for x in [32.0, 66.0] {
                    self.line(vec![[x, y], [x + DASH[0], y]], false, 3.0, ink);
                }
            }
            let name = if sections == 1 { "all C" } else { name };
            let [beam, field] =
                [figures.beam[section], figures.field[section]].map(|spread| short(spread.angle().round()));
            let text = format!("{name}: beam {beam}° (50 %), field {field}° (10 %)");
            self.text([96.0, y], text, NORMAL, Anchor::Start, TEXT);
        }
    }

    /// The diagram as an SVG file.
    pub(in crate::report) fn svg(&self) -> String {
        let [width, height] = self.size;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
             role=\"img\" aria-label=\"{0}\" font-family=\"system-ui, 'Segoe UI', Roboto, Arial, sans-serif\">\n\
             <title>{0}</title>\n<rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n",
            escape(&self.description)
        );
        for item in &self.items {
            let _ = match item {
                Item::Line { points, closed, width, ink } => {
                    let points: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
                    let element = if *closed { "polygon" } else { "polyline" };
                    writeln!(
                        svg,
                        "<{element} points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" \
                         stroke-linejoin=\"round\"/>",
                        points.join(" "),
                        hex(*ink)
                    )
                }
                Item::Text { at: [x, y], text, font, anchor, ink } => {
                    let size = 0.85 * f64::from(font.height());
                    let anchor = if *anchor == Anchor::Start { "start" } else { "middle" };
                    let weight = if font.is_bold() { " font-weight=\"600\"" } else { "" };
                    writeln!(
                        svg,
                        "<text x=\"{x:.1}\" y=\"{:.1}\" font-size=\"{size:.1}\" text-anchor=\"{anchor}\" fill=\"{}\"{weight}>{}\
                         </text>",
                        y + 0.35 * size,
                        hex(*ink),
                        escape(text)
                    )
                }
            };
        }
        svg + "</svg>\n"
    }

    /// The diagram as a PNG file.
    pub(in crate::report) fn png(&self) -> io::Result<Vec<u8>> {
        let [width, height] = self.size.map(|side| side.ceil() as i32);
        let mut canvas = Canvas::new(width, height, PAPER);
        for item in &self.items {
            match item {
                Item::Line { points, closed, width, ink } => {
                    let points: Vec<[f32; 2]> = points.iter().map(|point| point.map(|side| side as f32)).collect();
                    canvas.line(&points, *closed, *width as f32, *ink, 1.0);
                }
                Item::Text { at: [x, y], text, font, anchor, ink } => {
                    let left = if *anchor == Anchor::Start { 0 } else { font.width(text) / 2 };
                    canvas.text([x.round() as i32 - left, y.round() as i32 - font.height() / 2], text, *font, *ink);
                }
            }
        }
        canvas.encode()
    }
}

/// A text of so many letters at most.
fn shortened(text: &str, letters: usize) -> String {
    if text.chars().count() <= letters {
        return text.to_owned();
    }
    text.chars().take(letters.saturating_sub(3)).collect::<String>() + "..."
}

fn hex([r, g, b]: Ink) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}
