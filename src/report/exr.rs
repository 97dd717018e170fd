//! Illuminance maps as OpenEXR: single part, ZIP, 32-bit float scanlines, values in lx.
//!
//! | channel | in which files | holds |
//! |---|---|---|
//! | `Y` | colourless scenes | E, lx |
//! | `R` `G` `B` | coloured scenes | E of each channel (linear Rec. 709), lx; E = 0.2126 R + 0.7152 G + 0.0722 B |
//! | `A` | maps with cells where no light can arrive | 0 there, as are all other channels; 1 elsewhere |
//! | `direct.Y` `indirect.Y` `stderr.Y` | where asked for | photometric parts of E and its standard error (1 σ), lx |
//! | `group.NAME.Y` | colourless scenes whose light groups are told apart | the group's part of E, lx |
//! | `group.NAME.R` `.G` `.B` | coloured ones | of each channel |
//!
//! Light groups add up to E but for rounding. Names of layers are of plain letters, digits, `-` and `_`; the attribute
//! `groups` is a JSON object that tells the group's own name for each. The other further layers are photometric in
//! coloured scenes too: the split and the error are known of E, not of its channels. The first image row is the far end
//! of `across`, so that a floor shows as a plan, y up. `corner`, `along` and `across` are attributes of text (x y z,
//! m), since survey coordinates need more than single precision.

mod view;

use std::collections::HashSet;
use std::io::{self, Seek, Write};
use std::path::Path;

use ::exr::meta::MetaData;
use ::exr::meta::attribute::Chromaticities;
use ::exr::meta::header::Header;
use ::exr::prelude::*;
use glam::DVec3;

use crate::error::invalid;
use crate::error::{Error, InputError, Location};
use crate::files;
use crate::files::limits::MOST_CELLS;
use crate::files::write::first_free;
use crate::results::{IlluminanceMap, Run};
use crate::text::listed;
use crate::units::luminance;
pub use view::write_view;

/// Layers to write beside E, each in lx.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExtraLayers {
    /// `direct.Y`, the part straight from luminaires; left out where the method doesn't know it.
    pub direct: bool,
    /// `indirect.Y` = E − direct; left out where the method doesn't know it.
    pub indirect: bool,
    /// `stderr.Y`, standard error (1 σ, statistical part).
    pub standard_error: bool,
}

/// An illuminance image, cells row by row from the plane's corner.
#[derive(Clone, Debug, PartialEq)]
pub struct IlluminanceImage {
    /// Columns and rows.
    pub cells: [usize; 2],
    /// E of each cell, lx; 0 where there is no value.
    pub illuminance: Vec<f64>,
    /// False where no light can arrive.
    pub has_value: Vec<bool>,
    /// Standard error of each cell (layer `stderr.Y`), lx, 0 where there is none; `None` without that layer.
    pub standard_error: Option<Vec<f64>>,
}

/// Writes a map as an EXR file.
///
/// # Errors
/// Where `out` fails, and where a value isn't finite or too large for single precision.
pub fn write(map: &IlluminanceMap, run: &Run, layers: &ExtraLayers, out: &mut (impl Write + Seek)) -> io::Result<()> {
    map.check()?;
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let groups = group_layers(&run.groups);
    let attributes = attributes(map, run, &groups);
    let layer = Layer::new((map.cells[0], map.cells[1]), attributes, encoding, channels(map, layers, &groups));
    let mut image = Image::from_layer(layer);
    image.attributes.pixel_aspect = pixel_aspect(map);
    image.attributes.chromaticities = map.rgb.as_ref().map(|_| rec709());
    image.write().to_buffered(out).map_err(io_error)
}

/// E of an EXR file's cells, lx, row by row from the plane's corner, with the numbers of columns and rows; 0 where
/// there is no value ([`read()`] tells which).
///
/// # Errors
/// As [`read()`].
pub fn read_illuminance(path: &Path) -> std::result::Result<(usize, usize, Vec<f64>), Error> {
    let IlluminanceImage { cells: [columns, rows], illuminance, .. } = read(path)?;
    Ok((columns, rows, illuminance))
}

/// Reads an illuminance image: channel `Y`, or `R G B` of linear Rec. 709, in lx, and `stderr.Y` where there. Cells
/// where `A` is 0, or E isn't finite (as some programs mark them), have no value. The first image row is the last of
/// the cells.
///
/// # Errors
/// [`Error::Input`] where the file can't be read, or has neither channel `Y` nor channels `R G B`.
pub fn read(path: &Path) -> std::result::Result<IlluminanceImage, Error> {
    let refuse = |found: String, expected: &str| InputError::new(Location::file(path), found, expected);
    size(path)?;
    let image = ::exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_file(path)
        .map_err(|error| refuse(error.to_string().replace(char::is_control, " "), "an OpenEXR image"))?;
    let layer = &image.layer_data;
    let Vec2(columns, rows) = layer.size;
    let channel = |name: &str| {
        let found = layer.channel_data.list.iter().find(|channel| channel.name == *name)?;
        Some(flipped(columns, found.sample_data.values_as_f32().map(f64::from).collect()))
    };
    let illuminance = match (channel("Y"), channel("R"), channel("G"), channel("B")) {
        (Some(y), ..) => y,
        (None, Some(r), Some(g), Some(b)) => {
            r.iter().zip(&g).zip(&b).map(|((&r, &g), &b)| luminance([r, g, b])).collect()
        }
        _ => {
            let names: Vec<_> = layer.channel_data.list.iter().map(|channel| channel.name.to_string()).collect();
            let found = format!("channels {}", listed(names.iter().map(String::as_str)));
            return Err(refuse(found, "a channel Y or channels R, G, B, in lx"))?;
        }
    };
    let alpha = channel("A").unwrap_or_else(|| vec![1.0; columns * rows]);
    let has_value: Vec<_> = illuminance.iter().zip(&alpha).map(|(e, &a)| a != 0.0 && e.is_finite()).collect();
    let illuminance = illuminance.iter().zip(&has_value).map(|(&e, &known)| if known { e } else { 0.0 }).collect();
    let standard_error = channel("stderr.Y").map(|errors| {
        let known = |(&error, &known): (&f64, &bool)| if known && error.is_finite() { error.max(0.0) } else { 0.0 };
        errors.iter().zip(&has_value).map(known).collect()
    });
    Ok(IlluminanceImage { cells: [columns, rows], illuminance, has_value, standard_error })
}

/// Columns and rows of an image, of which nothing but the head is read: what it promises is not believed beyond the
/// most that a scene can have.
///
/// # Errors
/// [`Error::Input`] where the file can't be read, or promises more.
pub(crate) fn size(path: &Path) -> std::result::Result<[usize; 2], Error> {
    let refuse = |found: String, expected: &str| InputError::new(Location::file(path), found, expected);
    let broken =
        |error: &dyn std::fmt::Display| refuse(error.to_string().replace(char::is_control, " "), "an OpenEXR image");
    let file = files::open(path, u64::MAX).map_err(|error| broken(&files::why(&error)))?;
    let head = MetaData::read_from_unbuffered(file, false).map_err(|error| broken(&error))?;
    let samples = |header: &Header| {
        let Vec2(columns, rows) = header.layer_size;
        (columns as u128 * rows as u128) * header.channels.list.len().max(1) as u128
    };
    let most = u128::from(MOST_CELLS);
    if head.headers.iter().any(|header| samples(header) > 8 * most || header.chunk_count as u128 > 8 * most) {
        return Err(refuse("more samples than memory holds".into(), "as many cells as a scene can have").into());
    }
    let Some(header) = head.headers.iter().find(|header| !header.deep) else {
        return Err(refuse("deep data only".into(), "an OpenEXR image").into());
    };
    let Vec2(columns, rows) = header.layer_size;
    Ok([columns, rows])
}

/// All channels of a file, in the order of their names, which the format wants.
fn channels(map: &IlluminanceMap, layers: &ExtraLayers, groups: &[String]) -> AnyChannels<FlatSamples> {
    let mut list = SmallVec::new();
    let mut add = |name: &str, value: &dyn Fn(usize) -> f64| {
        let value = |cell| if map.has_value[cell] { value(cell) as f32 } else { 0.0 };
        let samples = flipped(map.cells[0], (0..map.illuminance.len()).map(value).collect());
        list.push(AnyChannel::new(name, FlatSamples::F32(samples)));
    };
    match &map.rgb {
        None => add("Y", &|cell| map.illuminance[cell]),
        Some(rgb) => ["R", "G", "B"].iter().enumerate().for_each(|(i, name)| add(name, &|cell| rgb[cell][i])),
    }
    if let Some(direct) = &map.direct {
        if layers.direct {
            add("direct.Y", &|cell| direct[cell]);
        }
        if layers.indirect {
            add("indirect.Y", &|cell| map.illuminance[cell] - direct[cell]);
        }
    }
    if layers.standard_error {
        add("stderr.Y", &|cell| map.standard_error[cell]);
    }
    for (group, name) in map.groups.iter().zip(groups) {
        match &group.rgb {
            None => add(&format!("group.{name}.Y"), &|cell| f64::from(group.illuminance[cell])),
            Some(rgb) => ["R", "G", "B"]
                .iter()
                .enumerate()
                .for_each(|(i, channel)| add(&format!("group.{name}.{channel}"), &|cell| f64::from(rgb[cell][i]))),
        }
    }
    if map.has_value.contains(&false) {
        add("A", &|_| 1.0);
    }
    AnyChannels::sort(list)
}

/// Longest name of a light group's layer, characters.
const LONGEST: usize = 60;

/// Names of the light groups' layers: letters, digits, `-` and `_` of ASCII stay, anything else between them becomes
/// one `_`, as dots part layers from channels. No two are equal in any case of letters; a second one gets `-2`.
pub fn group_layers(groups: &[String]) -> Vec<String> {
    let mut taken = HashSet::new();
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    let name = |group: &String| {
        let parts: Vec<&str> = group.split(|c| !plain(c)).filter(|part| !part.is_empty()).collect();
        let name: String = parts.join("_").chars().take(LONGEST).collect();
        first_free(if name.is_empty() { "group" } else { &name }, &[""], &mut taken)
    };
    groups.iter().map(name).collect()
}

/// What the file says about itself; `groups` are the names of the light groups' layers.
fn attributes(map: &IlluminanceMap, run: &Run, groups: &[String]) -> LayerAttributes {
    let names = groups.iter().cloned().zip(run.groups.iter().map(|name| name.as_str().into()));
    let names = serde_json::Value::Object(names.collect()).to_string();
    let groups = (!groups.is_empty()).then(|| ("groups", text(&names)));
    let own = [
        ("plane", text(&map.name)),
        ("corner", vector(map.corner)),
        ("along", vector(map.along)),
        ("across", vector(map.across)),
    ];
    with_provenance(own.into_iter().chain(groups), run)
}

/// Text, in UTF-8 as others write it.
fn text(text: &str) -> AttributeValue {
    AttributeValue::Text(Text::from_slice_unchecked(text.as_bytes()))
}

/// A vector as text, which loses no digit.
fn vector(v: DVec3) -> AttributeValue {
    text(&format!("{} {} {}", v.x, v.y, v.z))
}

/// Attributes of a file's own and those of the run that it comes from.
fn with_provenance<'a>(own: impl IntoIterator<Item = (&'a str, AttributeValue)>, run: &Run) -> LayerAttributes {
    let count = |count: u64| AttributeValue::F64(count as f64); // exact up to 2⁵³; a 32-bit integer isn't
    let whole = |number: usize| AttributeValue::I32(i32::try_from(number).unwrap_or(i32::MAX));
    let software = concat!("luxmap ", env!("CARGO_PKG_VERSION"));
    let of_run = [
        ("unit", text("lx")),
        ("scene", text(&run.scene)),
        ("sceneHash", text(&run.scene_hash)),
        ("method", text(&run.method)),
        ("tree", text(&run.tree)),
        ("photons", count(run.photons_emitted)),
        ("nearest", whole(run.nearest)),
        ("radius", AttributeValue::F64(run.radius)),
        ("seed", text(&run.seed.to_string())),
        ("passes", whole(run.passes as usize)),
        ("seconds", AttributeValue::F64(run.total_seconds)),
    ];
    LayerAttributes {
        software_name: Some(software.into()),
        other: own.into_iter().chain(of_run).map(|(name, value)| (name.into(), value)).collect(),
        ..LayerAttributes::default()
    }
}

/// Width of a cell over its height; 1 beyond what the format allows.
fn pixel_aspect(map: &IlluminanceMap) -> f32 {
    let [columns, rows] = map.cells.map(|cells| cells as f64);
    let aspect = ((map.along.length() / columns) / (map.across.length() / rows)) as f32;
    if (1e-6..=1e6).contains(&aspect) { aspect } else { 1.0 }
}

/// Primaries and white of Rec. 709.
fn rec709() -> Chromaticities {
    Chromaticities {
        red: Vec2(0.64, 0.33),
        green: Vec2(0.30, 0.60),
        blue: Vec2(0.15, 0.06),
        white: Vec2(0.3127, 0.3290),
    }
}

/// Rows from the plane's order (corner first) into the image's (far end first), or back.
fn flipped<T>(columns: usize, mut values: Vec<T>) -> Vec<T> {
    let rows = values.len() / columns;
    for row in 0..rows / 2 {
        let (head, tail) = values.split_at_mut((rows - 1 - row) * columns);
        head[row * columns..][..columns].swap_with_slice(&mut tail[..columns]);
    }
    values
}

/// The system's error as it is, the format's with its message.
fn io_error(error: ::exr::error::Error) -> io::Error {
    match error {
        ::exr::error::Error::Io(error) => error,
        other => invalid(other.to_string()),
    }
}
