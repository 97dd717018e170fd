//! A drawing of lines, areas and texts, as SVG and as PNG: both are made from one list.
//!
//! Colours are named by what they are for ([`Role`]), so that a page can give them others in the dark.

use std::io;

use maud::{Markup, html};

use super::canvas::{Canvas, Font, Ink};

/// Looks of drawings within a page: `fill-…` and `stroke-…` for each role.
pub(crate) const STYLE: &str = include_str!("drawing.css");

const PAPER: Ink = [255, 255, 255];

/// What a colour is for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Role {
    /// What is read first.
    Text,
    /// What is read next.
    Quiet,
    /// Circles and rays.
    Grid,
    /// The section C0/C180; blue and orange are told apart by the colour-blind too.
    First,
    /// The section C90/C270.
    Second,
    /// Where light leaves.
    Opening,
}

impl Role {
    /// On white paper.
    fn ink(self) -> Ink {
        match self {
            Self::Text => [28, 28, 30],
            Self::Quiet => [105, 105, 112],
            Self::Grid => [214, 214, 218],
            Self::First => [0, 96, 176],
            Self::Second => [200, 84, 0],
            Self::Opening => [255, 205, 64],
        }
    }

    /// The class that draws a line in it, in a page that has [`STYLE`].
    pub(super) fn stroke(self) -> String {
        format!("stroke-{}", self.name())
    }

    fn name(self) -> &'static str {
        match self {
            Self::Text => "text",
            Self::Quiet => "quiet",
            Self::Grid => "grid",
            Self::First => "first",
            Self::Second => "second",
            Self::Opening => "opening",
        }
    }
}

/// Where a text stands at its place.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

enum Primitive {
    Line {
        points: Vec<[f64; 2]>,
        closed: bool,
        width: f64,
        role: Role,
    },
    Area {
        points: Vec<[f64; 2]>,
        role: Role,
    },
    /// Its place is the left, middle or right of its centre line.
    Text {
        at: [f64; 2],
        text: String,
        font: Font,
        anchor: Anchor,
        role: Role,
    },
}

/// A drawing, ready for either format; x to the right, y down, pixels.
pub(crate) struct Drawing {
    pub(super) size: [f64; 2],
    items: Vec<Primitive>,
    /// What it shows, in words.
    description: String,
}

/// Where an SVG stands.
#[derive(Clone, Copy, PartialEq)]
enum Medium {
    /// A file of its own, on white paper.
    File,
    /// In a page that has [`STYLE`].
    Page,
}

impl Drawing {
    /// Nothing yet.
    pub(super) fn new(size: [f64; 2], description: String) -> Self {
        Self { size, items: Vec::new(), description }
    }

    pub(super) fn line(&mut self, points: Vec<[f64; 2]>, closed: bool, width: f64, role: Role) {
        self.items.push(Primitive::Line { points, closed, width, role });
    }

    pub(super) fn area(&mut self, points: Vec<[f64; 2]>, role: Role) {
        self.items.push(Primitive::Area { points, role });
    }

    pub(super) fn text(&mut self, at: [f64; 2], text: impl Into<String>, font: Font, anchor: Anchor, role: Role) {
        self.items.push(Primitive::Text { at, text: text.into(), font, anchor, role });
    }

    /// A line that ends in an arrow's head.
    pub(super) fn arrow(&mut self, points: Vec<[f64; 2]>, width: f64, role: Role) {
        if let [.., [x0, y0], [x, y]] = points[..] {
            let length = (x - x0).hypot(y - y0).max(1e-9);
            let [dx, dy] = [(x - x0) / length, (y - y0) / length];
            let at = |along: f64, aside: f64| [x + dx * along - dy * aside, y + dy * along + dx * aside];
            self.area(vec![at(9.0, 0.0), at(-4.0, 6.0), at(-4.0, -6.0)], role);
        }
        self.line(points, false, width, role);
    }

    /// This drawing with another below it.
    pub(crate) fn above(mut self, below: Self) -> Self {
        let [width, height] = self.size;
        let moved = |points: Vec<[f64; 2]>| points.into_iter().map(|[x, y]| [x, y + height]).collect();
        self.items.extend(below.items.into_iter().map(|item| match item {
            Primitive::Line { points, closed, width, role } => {
                Primitive::Line { points: moved(points), closed, width, role }
            }
            Primitive::Area { points, role } => Primitive::Area { points: moved(points), role },
            Primitive::Text { at: [x, y], text, font, anchor, role } => {
                Primitive::Text { at: [x, y + height], text, font, anchor, role }
            }
        }));
        self.size = [width.max(below.size[0]), height + below.size[1]];
        self.description = format!("{}; {}", self.description, below.description);
        self
    }

    /// Corners of its areas.
    #[cfg(test)]
    pub(super) fn outlines(&self) -> Vec<Vec<[f64; 2]>> {
        let corners =
            |item: &Primitive| if let Primitive::Area { points, .. } = item { Some(points.clone()) } else { None };
        self.items.iter().filter_map(corners).collect()
    }

    /// As an SVG file.
    pub(crate) fn svg(&self) -> String {
        self.drawn(Medium::File).into_string()
    }

    /// As an element of a page that has [`STYLE`]: it takes the width it gets, and the page's colours.
    pub(crate) fn element(&self) -> Markup {
        self.drawn(Medium::Page)
    }

    fn drawn(&self, place: Medium) -> Markup {
        let [width, height] = self.size.map(|side| side.to_string());
        let in_file = place == Medium::File;
        html! {
            svg xmlns=[in_file.then_some("http://www.w3.org/2000/svg")] class=[(!in_file).then_some("drawing")]
                viewBox={ "0 0 " (width) " " (height) }
                width=[in_file.then_some(&width)] height=[in_file.then_some(&height)]
                font-family=[in_file.then_some("system-ui, 'Segoe UI', Roboto, Arial, sans-serif")]
                role="img" aria-label=(self.description) {
                "\n" title { (self.description) } "\n"
                @if in_file { rect width=(width) height=(height) fill="#fff" {} "\n" }
                @for item in &self.items { (item.element(place)) "\n" }
            }
            "\n"
        }
    }

    /// As a PNG file.
    pub(crate) fn png(&self) -> io::Result<Vec<u8>> {
        let [width, height] = self.size.map(|side| side.ceil() as i32);
        let mut canvas = Canvas::new(width, height, PAPER);
        let single = |points: &[[f64; 2]]| -> Vec<[f32; 2]> {
            points.iter().map(|point| point.map(|side| side as f32)).collect()
        };
        for item in &self.items {
            match item {
                Primitive::Line { points, closed, width, role } => {
                    canvas.line(&single(points), *closed, *width as f32, role.ink(), 1.0);
                }
                Primitive::Area { points, role } => canvas.polygon(&single(points), role.ink(), 1.0),
                Primitive::Text { at: [x, y], text, font, anchor, role } => {
                    let left = match anchor {
                        Anchor::Start => 0,
                        Anchor::Middle => font.width(text) / 2,
                        Anchor::End => font.width(text),
                    };
                    let at = [x.round() as i32 - left, y.round() as i32 - font.height() / 2];
                    canvas.text(at, text, *font, role.ink());
                }
            }
        }
        canvas.encode()
    }
}

impl Primitive {
    /// Its SVG element.
    fn element(&self, place: Medium) -> Markup {
        let class = |kind: &str, role: Role| (place == Medium::Page).then(|| format!("{kind}-{}", role.name()));
        let colour = |role: Role| {
            let [r, g, b] = role.ink();
            (place == Medium::File).then(|| format!("#{r:02x}{g:02x}{b:02x}"))
        };
        match self {
            Self::Line { points, closed, width, role } => {
                let (points, width) = (corners(points), width.to_string());
                let (class, colour) = (class("stroke", *role), colour(*role));
                html! {
                    @if *closed {
                        polygon points=(points) fill="none" class=[class] stroke=[colour] stroke-width=(width)
                            stroke-linejoin="round" {}
                    } @else {
                        polyline points=(points) fill="none" class=[class] stroke=[colour] stroke-width=(width)
                            stroke-linejoin="round" {}
                    }
                }
            }
            Self::Area { points, role } => {
                html! { polygon points=(corners(points)) class=[class("fill", *role)] fill=[colour(*role)] {} }
            }
            Self::Text { at: [x, y], text, font, anchor, role } => {
                let size = 0.85 * f64::from(font.height());
                let anchor = match anchor {
                    Anchor::Start => "start",
                    Anchor::Middle => "middle",
                    Anchor::End => "end",
                };
                let [x, y, size] = [*x, y + 0.35 * size, size].map(|length| format!("{length:.1}"));
                html! {
                    text x=(x) y=(y) font-size=(size) text-anchor=(anchor) class=[class("fill", *role)]
                        fill=[colour(*role)] font-weight=[font.is_bold().then_some("600")] { (text) }
                }
            }
        }
    }
}

/// Corners as an attribute's value, pixels.
pub(super) fn corners(points: &[[f64; 2]]) -> String {
    points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ")
}
