//! What a camera saw, ready to be written.

use glam::DVec3;

use crate::error::invalid;
use crate::results::IlluminanceMap;
use crate::units::luminance;

/// The image of one camera. Pixels are row by row from the top left; world coordinates. Light, albedo and normal are
/// means over a pixel's square, times the share of it that is covered (as EXR's alpha has it); depth and position are
/// those of the ray through its middle.
#[derive(Clone, Debug)]
pub struct CameraImage {
    /// Name of the camera.
    pub name: String,
    /// Where it stands, m.
    pub eye: DVec3,
    /// Unit vector along the view axis.
    pub forward: DVec3,
    /// Unit vector to the top of the image.
    pub up: DVec3,
    /// Angle of view from bottom to top, degrees.
    pub fov: f64,
    /// Width of the image plane at distance 1.
    pub screen_width: f64,
    /// Columns and rows.
    pub pixels: [usize; 2],
    /// Rays of each pixel.
    pub samples: u64,
    /// Claimed standard error of a pixel's E, root mean square, relative to the mean E.
    pub claim: f64,
    /// E at the first opaque surface, on the side seen, lx.
    pub illuminance: Layer,
    /// The part straight from luminaires, lx.
    pub direct: Layer,
    /// All other, lx.
    pub indirect: Layer,
    /// Luminance towards the eye, cd/m², by way of mirrors and glass too.
    pub luminance: Layer,
    /// Standard error (1 σ) of the photometric E, lx.
    pub standard_error: Vec<f32>,
    /// Standard error (1 σ) of the photometric luminance, cd/m².
    pub luminance_standard_error: Vec<f32>,
    /// Diffuse reflectance.
    pub albedo: Layer,
    /// Unit normal of the side seen; shorter where a pixel sees several.
    pub normal: Layer,
    /// Distance along the view axis, m; 10¹⁰ where nothing is seen.
    pub depth: Vec<f32>,
    /// Position relative to `position_origin`, m.
    pub position: Layer,
    /// World position of the positions' origin, m: 0 unless the scene is kilometres away from the world's.
    pub position_origin: DVec3,
    /// Share of a pixel that sees an opaque surface.
    pub coverage: Vec<f32>,
}

/// One quantity of every pixel, channel by channel: one channel, three of linear Rec. 709, or x, y, z.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer(pub Vec<Vec<f32>>);

impl Layer {
    /// The photometric value of a pixel.
    pub fn photometric(&self, pixel: usize) -> f64 {
        match self.0.as_slice() {
            [r, g, b] => luminance([r, g, b].map(|channel| f64::from(channel[pixel]))),
            channels => channels.first().map_or(0.0, |channel| f64::from(channel[pixel])),
        }
    }

    /// The linear Rec. 709 value of a pixel.
    pub fn rgb(&self, pixel: usize) -> [f64; 3] {
        std::array::from_fn(|c| f64::from(self.0[if self.0.len() == 3 { c } else { 0 }][pixel]))
    }
}

impl CameraImage {
    /// Number of pixels.
    pub fn len(&self) -> usize {
        self.pixels[0] * self.pixels[1]
    }

    /// Whether there is no pixel.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Mean E of what is seen, lx; 0 where nothing is.
    pub fn mean_illuminance(&self) -> f64 {
        let covered: f64 = self.coverage.iter().map(|&share| f64::from(share)).sum();
        let sum: f64 = (0..self.len()).map(|pixel| self.illuminance.photometric(pixel)).sum();
        if covered > 0.0 { sum / covered } else { 0.0 }
    }

    /// Mean and highest luminance, cd/m².
    pub fn luminances(&self) -> [f64; 2] {
        let values = (0..self.len()).map(|pixel| self.luminance.photometric(pixel));
        let [sum, highest] = values.fold([0.0, 0.0_f64], |[sum, most], value| [sum + value, most.max(value)]);
        [sum / self.len().max(1) as f64, highest]
    }

    /// E of what each pixel sees as a map, for pictures and figures: coverage divided out, first row at the bottom.
    pub(crate) fn map(&self) -> IlluminanceMap {
        let [columns, rows] = self.pixels;
        let order = || (0..rows).rev().flat_map(move |row| (0..columns).map(move |column| row * columns + column));
        let covered = |pixel: usize| f64::from(self.coverage[pixel]).max(f64::MIN_POSITIVE);
        IlluminanceMap {
            name: self.name.clone(),
            corner: DVec3::ZERO,
            along: DVec3::X * columns as f64,
            across: DVec3::Y * rows as f64,
            cells: self.pixels,
            illuminance: order().map(|pixel| self.illuminance.photometric(pixel) / covered(pixel)).collect(),
            rgb: None,
            groups: Vec::new(),
            extremes: None,
            areas: Vec::new(),
            direct: None,
            standard_error: order().map(|pixel| f64::from(self.standard_error[pixel]) / covered(pixel)).collect(),
            has_value: order().map(|pixel| self.coverage[pixel] > 0.0).collect(),
            standing: Vec::new(),
            outlines: Vec::new(),
        }
    }

    /// Every layer with its name, as EXR has it: the root's is empty.
    pub(crate) fn layers(&self) -> [(&'static str, Vec<&[f32]>); 11] {
        fn whole(layer: &Layer) -> Vec<&[f32]> {
            layer.0.iter().map(Vec::as_slice).collect()
        }
        [
            ("", whole(&self.illuminance)),
            ("A", vec![&self.coverage]),
            ("Z", vec![&self.depth]),
            ("direct", whole(&self.direct)),
            ("indirect", whole(&self.indirect)),
            ("stderr", vec![&self.standard_error]),
            ("luminance", whole(&self.luminance)),
            ("luminance_stderr", vec![&self.luminance_standard_error]),
            ("albedo", whole(&self.albedo)),
            ("N", whole(&self.normal)),
            ("P", whole(&self.position)),
        ]
    }

    /// Says why this image can't be written: a layer that isn't whole, or a value that isn't finite.
    pub(crate) fn check(&self) -> std::io::Result<()> {
        let lights = [&self.illuminance, &self.direct, &self.indirect, &self.luminance, &self.albedo];
        let channels = self.illuminance.0.len();
        let spatial = [&self.normal, &self.position];
        let whole = matches!(channels, 1 | 3)
            && lights.iter().all(|layer| layer.0.len() == channels)
            && spatial.iter().all(|layer| layer.0.len() == 3);
        let name = &self.name;
        for (layer, channels) in self.layers() {
            for values in channels {
                if !whole || values.len() != self.len() || self.is_empty() {
                    return Err(invalid(format!("the image \"{name}\" of {:?} pixels is incomplete", self.pixels)));
                }
                if let Some(pixel) = values.iter().position(|value| !value.is_finite()) {
                    let (column, row) = (pixel % self.pixels[0], pixel / self.pixels[0]);
                    let layer = if layer.is_empty() { "E" } else { layer };
                    return Err(invalid(format!(
                        "{layer} of pixel {column}, row {row} of \"{name}\" is {}, expected a finite number",
                        values[pixel]
                    )));
                }
            }
        }
        Ok(())
    }
}
