//! A camera's image as OpenEXR, for compositing: single part, ZIP, 32-bit float scanlines, `layer.channel`.
//!
//! | channel | holds |
//! |---|---|
//! | `Y`; `R` `G` `B` in coloured scenes | E at the first opaque surface, lx, times coverage |
//! | `A` | share of the pixel that sees an opaque surface |
//! | `Z` | distance along the view axis, m, of the ray through the pixel's middle; 10¹⁰ where it meets nothing |
//! | `direct.*` `indirect.*` | parts of E, lx |
//! | `stderr.Y` | standard error (1 σ) of the photometric E, lx |
//! | `luminance.*` | luminance towards the eye, cd/m² |
//! | `albedo.*` | diffuse reflectance, times coverage |
//! | `N.X` `N.Y` `N.Z` | unit normal of the side seen, world axes, times coverage |
//! | `P.X` `P.Y` `P.Z` | position, m, of the ray through the pixel's middle: world − attribute `positionOrigin` |
//!
//! `*` stands for `Y`, or `R`, `G`, `B`. Data window and display window are the whole image, pixels are square, colours
//! linear Rec. 709. Attributes `eye`, `forward` and `up` are texts (x y z), `verticalFieldOfView` is in degrees.

use super::*;
use crate::results::CameraImage;

/// Writes a camera's image as an EXR file.
///
/// # Errors
/// Where `out` fails, and where a value isn't finite.
pub fn write_view(image: &CameraImage, run: &Run, out: &mut (impl Write + Seek)) -> io::Result<()> {
    image.check()?;
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let size = (image.pixels[0], image.pixels[1]);
    let layer = Layer::new(size, view_attributes(image, run), encoding, view_channels(image));
    let mut file = Image::from_layer(layer);
    file.attributes.chromaticities = Some(rec709());
    file.write().to_buffered(out).map_err(io_error)
}

/// All channels, in the order of their names, which the format wants.
fn view_channels(image: &CameraImage) -> AnyChannels<FlatSamples> {
    let mut list = SmallVec::new();
    for (layer, channels) in image.layers() {
        let names: &[&str] = match (layer, channels.len()) {
            ("A" | "Z", _) => &[""],
            ("N" | "P", _) => &["X", "Y", "Z"],
            (_, 1) => &["Y"],
            _ => &["R", "G", "B"],
        };
        for (name, values) in names.iter().zip(channels) {
            let dot = if layer.is_empty() || name.is_empty() { "" } else { "." };
            let name = format!("{layer}{dot}{name}");
            list.push(AnyChannel::new(name.as_str(), FlatSamples::F32(values.to_vec())));
        }
    }
    AnyChannels::sort(list)
}

/// What the file says about itself.
fn view_attributes(image: &CameraImage, run: &Run) -> LayerAttributes {
    let own = [
        ("camera", text(&image.name)),
        ("eye", vector(image.eye)),
        ("forward", vector(image.forward)),
        ("up", vector(image.up)),
        ("verticalFieldOfView", AttributeValue::F64(image.fov)),
        ("positionOrigin", vector(image.position_origin)),
        ("luminanceUnit", text("cd/m²")),
        ("raysPerPixel", AttributeValue::F64(image.samples as f64)),
    ];
    LayerAttributes { screen_window_width: image.screen_width as f32, ..with_provenance(own, run) }
}
