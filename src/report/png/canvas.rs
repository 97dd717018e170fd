//! A picture to draw on: filled rectangles, antialiased lines, text.

use std::io;

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};
use tiny_skia::{FillRule, Paint, PathBuilder, Pixmap, Rect, Stroke, Transform};

/// A colour: red, green, blue (sRGB).
pub(super) type Ink = [u8; 3];

/// Size and weight of a text.
#[derive(Clone, Copy)]
pub(super) struct Font {
    height: RasterHeight,
    weight: FontWeight,
}

/// For labels on lines.
pub(super) const SMALL: Font = Font { height: RasterHeight::Size16, weight: FontWeight::Regular };
/// For most texts.
pub(super) const NORMAL: Font = Font { height: RasterHeight::Size20, weight: FontWeight::Regular };
/// For what a reader looks for first.
pub(super) const BOLD: Font = Font { height: RasterHeight::Size20, weight: FontWeight::Bold };
/// For the title.
pub(super) const TITLE: Font = Font { height: RasterHeight::Size32, weight: FontWeight::Bold };

impl Font {
    /// Height of a line, pixels.
    pub(super) fn height(self) -> i32 {
        self.height as i32
    }

    /// Width of a text, pixels.
    pub(super) fn width(self, text: &str) -> i32 {
        (text.chars().count() * self.advance()) as i32
    }

    /// Whether its letters are bold.
    pub(super) fn is_bold(self) -> bool {
        matches!(self.weight, FontWeight::Bold)
    }

    /// Width of a character, pixels.
    fn advance(self) -> usize {
        get_raster_width(self.weight, self.height)
    }
}

/// An opaque picture; x to the right, y down, pixels. What lies outside isn't drawn.
pub(super) struct Canvas {
    pixmap: Pixmap,
}

impl Canvas {
    /// A picture in one colour; at least one pixel.
    pub(super) fn new(width: i32, height: i32, ink: Ink) -> Self {
        let [width, height] = [width, height].map(|side| side.max(1).unsigned_abs());
        let mut pixmap = Pixmap::new(width, height).expect("a picture of a few thousand pixels a side fits in memory");
        pixmap.fill(colour(ink, 1.0));
        Self { pixmap }
    }

    /// Width in pixels.
    pub(super) fn width(&self) -> i32 {
        self.pixmap.width() as i32
    }

    /// Height in pixels.
    pub(super) fn height(&self) -> i32 {
        self.pixmap.height() as i32
    }

    /// Mixes a pixel with a colour; `cover` 255 replaces it.
    pub(super) fn pixel(&mut self, x: i32, y: i32, ink: Ink, cover: u8) {
        if x < 0 || y < 0 || x >= self.width() || y >= self.height() {
            return;
        }
        let first = (y as usize * self.pixmap.width() as usize + x as usize) * 4;
        for (below, above) in self.pixmap.data_mut()[first..first + 3].iter_mut().zip(ink) {
            let mixed = u32::from(*below) * u32::from(255 - cover) + u32::from(above) * u32::from(cover);
            *below = ((mixed + 127) / 255) as u8;
        }
    }

    /// Fills a rectangle.
    pub(super) fn rectangle(&mut self, [x, y]: [i32; 2], [width, height]: [i32; 2], ink: Ink) {
        if let Some(rect) = Rect::from_xywh(x as f32, y as f32, width as f32, height as f32) {
            self.pixmap.fill_rect(rect, &paint(ink, 1.0), Transform::identity(), None);
        }
    }

    /// Draws the outline of a rectangle, one pixel wide, just inside it.
    pub(super) fn frame(&mut self, [x, y]: [i32; 2], [width, height]: [i32; 2], ink: Ink) {
        self.rectangle([x, y], [width, 1], ink);
        self.rectangle([x, y + height - 1], [width, 1], ink);
        self.rectangle([x, y], [1, height], ink);
        self.rectangle([x + width - 1, y], [1, height], ink);
    }

    /// Draws a line through points; `opacity` from 0 to 1.
    pub(super) fn line(&mut self, points: &[[f32; 2]], closed: bool, width: f32, ink: Ink, opacity: f32) {
        if let Some(path) = path(points, closed) {
            let stroke = Stroke { width, line_join: tiny_skia::LineJoin::Round, ..Stroke::default() };
            self.pixmap.stroke_path(&path, &paint(ink, opacity), &stroke, Transform::identity(), None);
        }
    }

    /// Fills a polygon; `opacity` from 0 to 1.
    pub(super) fn polygon(&mut self, points: &[[f32; 2]], ink: Ink, opacity: f32) {
        if let Some(path) = path(points, true) {
            self.pixmap.fill_path(&path, &paint(ink, opacity), FillRule::Winding, Transform::identity(), None);
        }
    }

    /// Writes a line of text from its top left corner; returns where it ends. Characters the font lacks become `?`.
    pub(super) fn text(&mut self, [x, y]: [i32; 2], text: &str, font: Font, ink: Ink) -> i32 {
        let mut x = x;
        for character in text.chars() {
            let character = if character == '\u{a0}' { ' ' } else { character };
            let glyph = get_raster(character, font.weight, font.height);
            if let Some(glyph) = glyph.or_else(|| get_raster('?', font.weight, font.height)) {
                for (row, covers) in (y..).zip(glyph.rows()) {
                    (x..).zip(covers).for_each(|(column, &cover)| self.pixel(column, row, ink, cover));
                }
            }
            x += font.advance() as i32;
        }
        x
    }

    /// Writes a symbol with the part after `_` as a small subscript: `E_min`, `U_0`; returns where it ends.
    pub(super) fn symbol(&mut self, [x, y]: [i32; 2], symbol: &str, font: Font, ink: Ink) -> i32 {
        let (letter, index) = symbol.split_once('_').unwrap_or((symbol, ""));
        let end = self.text([x, y], letter, font, ink);
        self.text([end, y + font.height() - SMALL.height() + 3], index, SMALL, ink)
    }

    /// Copies a picture into this one.
    pub(super) fn paste(&mut self, [x, y]: [i32; 2], picture: &Self) {
        let paint = tiny_skia::PixmapPaint::default();
        self.pixmap.draw_pixmap(x, y, picture.pixmap.as_ref(), &paint, Transform::identity(), None);
    }

    /// The picture as a PNG file.
    pub(super) fn encode(&self) -> io::Result<Vec<u8>> {
        let mut file = Vec::new();
        let mut encoder = ::png::Encoder::new(&mut file, self.pixmap.width(), self.pixmap.height());
        encoder.set_color(::png::ColorType::Rgb);
        encoder.set_depth(::png::BitDepth::Eight);
        encoder.set_compression(::png::Compression::Fast); // best would take longer than a small run itself
        let rgb: Vec<u8> = self.pixmap.data().chunks_exact(4).flat_map(|rgba| &rgba[..3]).copied().collect();
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&rgb)?;
        writer.finish()?;
        Ok(file)
    }
}

/// A path through points, if there are two or more and all are finite.
fn path(points: &[[f32; 2]], closed: bool) -> Option<tiny_skia::Path> {
    let (first, rest) = points.split_first()?;
    let mut path = PathBuilder::new();
    path.move_to(first[0], first[1]);
    rest.iter().for_each(|point| path.line_to(point[0], point[1]));
    if closed {
        path.close();
    }
    path.finish()
}

fn paint(ink: Ink, opacity: f32) -> Paint<'static> {
    Paint { shader: tiny_skia::Shader::SolidColor(colour(ink, opacity)), anti_alias: true, ..Paint::default() }
}

fn colour([r, g, b]: Ink, opacity: f32) -> tiny_skia::Color {
    let alpha = (opacity.clamp(0.0, 1.0) * 255.0).round() as u8;
    tiny_skia::Color::from_rgba8(r, g, b, alpha)
}
