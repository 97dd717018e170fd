//! Textures: the mean colour of an image file, which is what a room's light needs to know of a carpet's pattern.

use std::io::Cursor;

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Most pixels of a texture: as many as a square of 8192. A file of some kilobytes may promise them; a progressive JPEG
/// file of so many takes 0.6 GB and 2 s.
const MOST_PIXELS: u64 = 1 << 26;

/// Mean of an image's pixels, linear Rec. 709 from 0 to 1, or why there is none. Pixels are taken for sRGB and decoded
/// before they are averaged: it is light that adds up. Transparent pixels count by their opacity. The whole image
/// counts once, whatever part of it the faces show. Cost: some 10 ns a pixel.
pub(crate) fn mean_colour(bytes: &[u8]) -> Result<[f64; 3], String> {
    let mut mean = Mean::default();
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => of_png(bytes, &mut mean)?,
        [0xff, 0xd8, 0xff, ..] => of_jpeg(bytes, &mut mean)?,
        _ => return Err("it is neither PNG nor JPEG".to_owned()),
    }
    mean.value().ok_or_else(|| "every pixel of it is transparent".to_owned())
}

fn of_png(bytes: &[u8], mean: &mut Mean) -> Result<(), String> {
    let broken = |error: png::DecodingError| format!("broken PNG: {}", one_line(&error));
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::STRIP_16);
    let mut reader = decoder.read_info().map_err(broken)?;
    check_size(reader.info().width.into(), reader.info().height.into())?;
    let samples = reader.output_color_type().0.samples();
    while let Some(row) = reader.next_row().map_err(broken)? {
        row.data().chunks_exact(samples).for_each(|pixel| mean.add(pixel));
    }
    Ok(())
}

fn of_jpeg(bytes: &[u8], mean: &mut Mean) -> Result<(), String> {
    let broken = |error: zune_jpeg::errors::DecodeErrors| format!("broken JPEG: {}", one_line(&error));
    let options = DecoderOptions::default()
        .set_max_width(usize::MAX)
        .set_max_height(usize::MAX)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(broken)?;
    let (width, height) = decoder.dimensions().unwrap_or_default();
    check_size(width as u64, height as u64)?;
    decoder.decode().map_err(broken)?.chunks_exact(3).for_each(|pixel| mean.add(pixel));
    Ok(())
}

fn check_size(width: u64, height: u64) -> Result<(), String> {
    if width * height <= MOST_PIXELS { Ok(()) } else { Err(format!("{width} × {height} pixels are too many")) }
}

fn one_line(error: &impl std::fmt::Display) -> String {
    error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Light of each level of sRGB (IEC 61966-2-1).
fn decoded() -> [f64; 256] {
    std::array::from_fn(|level| {
        let level = level as f64 / 255.0;
        if level <= 0.04045 { level / 12.92 } else { ((level + 0.055) / 1.055).powf(2.4) }
    })
}

/// A mean of the pixels added so far.
struct Mean {
    decoded: [f64; 256],
    sums: [f64; 3],
    weight: f64,
}

impl Default for Mean {
    fn default() -> Self {
        Self { decoded: decoded(), sums: [0.0; 3], weight: 0.0 }
    }
}

impl Mean {
    /// Takes in a pixel of grey, grey and opacity, red green blue, or those and opacity.
    fn add(&mut self, pixel: &[u8]) {
        let (rgb, opacity) = match *pixel {
            [grey] => ([grey; 3], 255),
            [grey, opacity] => ([grey; 3], opacity),
            [r, g, b] => ([r, g, b], 255),
            [r, g, b, opacity] => ([r, g, b], opacity),
            _ => return,
        };
        let weight = f64::from(opacity) / 255.0;
        self.weight += weight;
        self.sums.iter_mut().zip(rgb).for_each(|(sum, level)| *sum += weight * self.decoded[usize::from(level)]);
    }

    fn value(&self) -> Option<[f64; 3]> {
        (self.weight > 0.0).then(|| self.sums.map(|sum| (sum / self.weight).clamp(0.0, 1.0)))
    }
}
