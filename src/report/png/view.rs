//! Two pictures of what a camera saw: luminance as the eye takes it, illuminance in false colours.

use std::io;

use super::canvas::encode;
use super::*;
use crate::results::CameraImage;

/// Middle grey: where a scene's log-average luminance goes.
const KEY: f64 = 0.18;

/// The luminance image as a PNG file of as many pixels, tone-mapped by Reinhard's photographic operator without local
/// adaptation (Reinhard et al. 2002, eq. 1 to 4): L = 0.18/L̄ · luminance, L̄ the log-average of all that isn't dark;
/// display = L (1 + L/W²)/(1 + L), W the brightest L; sRGB. Colours keep their hue, where a channel doesn't end at 1.
///
/// # Errors
/// Where a value isn't finite.
pub fn tone_mapped(image: &CameraImage) -> io::Result<Vec<u8>> {
    image.check()?;
    let luminance = |pixel: usize| image.luminance.photometric(pixel).max(0.0);
    let (mut logs, mut lit, mut brightest) = (0.0, 0.0_f64, 0.0_f64);
    for value in (0..image.len()).map(luminance).filter(|&value| value > 0.0) {
        (logs, lit, brightest) = (logs + value.ln(), lit + 1.0, brightest.max(value));
    }
    let exposure = if lit > 0.0 { KEY / (logs / lit).exp() } else { 0.0 };
    let white = (exposure * brightest).max(1.0);
    let shown = |pixel: usize| {
        let scaled = exposure * luminance(pixel);
        let display = scaled * (1.0 + scaled / (white * white)) / (1.0 + scaled);
        let factor = if scaled > 0.0 { display / luminance(pixel) } else { 0.0 };
        image.luminance.rgb(pixel).map(|channel| srgb(channel.max(0.0) * factor))
    };
    let pixels: Vec<u8> = (0..image.len()).flat_map(shown).collect();
    let [width, height] = image.pixels.map(|side| u32::try_from(side).unwrap_or(u32::MAX));
    encode(width, height, &pixels)
}

/// Code value of a linear share of white (IEC 61966-2-1).
fn srgb(linear: f64) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (255.0 * encoded).round() as u8
}

/// E of what a camera sees in false colours, with a legend in lx, as a PNG file.
///
/// # Errors
/// Where a value isn't finite.
pub fn false_colour(image: &CameraImage, run: &Run) -> io::Result<Vec<u8>> {
    image.check()?;
    let map = image.map();
    let found = statistics(&map);
    let layout = Layout::new(&map, found.cells_without_value > 0);
    let scale = Scale::new(found.min.0, brightest_shown(&map, &found), f64::from(layout.bar) / TICK_DISTANCE_LEGEND);
    let mut canvas = Canvas::new(layout.width, layout.height, PAPER);
    title(&mut canvas, &layout, &map, run);
    let mut view = Canvas::new(layout.size[0], layout.size[1], PAPER);
    let grid = Grid::new(&map, layout.size.map(|side| side.unsigned_abs() as usize));
    paint_values(&mut view, &grid, &scale);
    canvas.paste(layout.map, &view);
    canvas.frame([layout.map[0] - 1, layout.map[1] - 1], [layout.size[0] + 2, layout.size[1] + 2], TEXT);
    if found.cells > 0 {
        legend(&mut canvas, &layout, &scale, found.max.0);
    }
    key(&mut canvas, &layout, &map, &found, scale.colour((scale.low + scale.high) / 2.0));
    let text = |canvas: &mut Canvas, line: i32, text: &str, font, ink| {
        canvas.text([32, layout.footer + line], text, font, ink);
    };
    canvas.rectangle([32, layout.footer - 18], [layout.width - 64, 1], HATCH[1]);
    let [mean, highest] = image.luminances().map(short);
    let light = format!("mean {} lx · luminance {mean} cd/m², up to {highest} cd/m²", short(image.mean_illuminance()));
    text(&mut canvas, 0, &light, BOLD, TEXT);
    text(&mut canvas, 32, &method(run), NORMAL, TEXT);
    let hash: String = run.scene_hash.chars().take(12).collect();
    let origin = format!(
        "standard error of a pixel {} % · {} rays a pixel · luxmap {} · scene {hash}",
        percent(image.claim),
        image.samples,
        env!("CARGO_PKG_VERSION")
    );
    text(&mut canvas, 62, &origin, SMALL, QUIET);
    canvas.encode()
}
