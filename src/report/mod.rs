//! What a run leaves behind: EXR, PNG, CSV, JSON, HTML and a table.
//!
//! [`write()`] puts everything into a folder; each format has a module of its own, which writes to memory or to any
//! writer. Numbers meant for a person (PNG, HTML, table) have four significant digits, numbers meant for a program
//! (EXR, CSV, JSON) all that single precision holds, or more. Nothing here writes NaN or infinity: a map with one is
//! refused.

pub mod csv;
pub mod exr;
pub mod html;
pub mod inventory;
pub mod json;
pub mod live;
pub mod luminaire;
pub(crate) mod npy;
pub(crate) mod plot;
pub mod png;
pub mod surface;
pub mod table;

use std::io::Write as _;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::error::Error;
use crate::files;
use crate::files::stems_with_cameras;
use crate::results::{CameraImage, IlluminanceMap, Results, Run};
pub use exr::ExtraLayers;

/// Makes `folder` where it's missing.
pub(crate) fn make_folder(folder: &Path) -> Result<(), Error> {
    std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.to_owned(), source })
}

/// Writes every result into `folder`, making it where it's missing: `<plane>.exr`, `.png` and `.csv` for each measuring
/// plane, `<surface>.ply` and `.csv` for each measured surface, `<camera>.exr`, `.png` (tone-mapped) and `-lux.png`
/// (false colours) for each camera, `sensors.csv` where the scene has sensors, `groups.csv` where their light groups
/// are told apart, `summary.json` and `report.html`.
///
/// All are written elsewhere first and then renamed, so that a file under its own name is whole, and on an error those
/// of an earlier run stay as they are. Returns the paths in the order they were written. Planes, surfaces and cameras
/// get their file names from [`stems_with_cameras`].
///
/// # Errors
/// [`Error::Write`] where the folder or a file can't be written, and where a result is NaN or infinite.
pub fn write(results: &Results, folder: &Path, layers: &ExtraLayers) -> Result<Vec<PathBuf>, Error> {
    make_folder(folder)?;
    files::write_together(folder, &mut |folder| write_into(results, folder, layers))
}

impl Results {
    /// Writes every result into `folder`, as the command does; see [`write()`].
    ///
    /// # Errors
    /// As [`write()`].
    pub fn write(&self, folder: impl AsRef<Path>) -> Result<Vec<PathBuf>, Error> {
        write(self, folder.as_ref(), &ExtraLayers::default())
    }
}

fn write_into(results: &Results, folder: &Path, layers: &ExtraLayers) -> Result<Vec<PathBuf>, Error> {
    let planes = results.maps.iter().map(|map| map.name.as_str());
    let names: Vec<_> = planes.chain(results.surfaces.iter().map(|map| map.name.as_str())).collect();
    let views: Vec<_> = results.images.iter().map(|image| image.name.as_str()).collect();
    let (stems, view_stems) = stems_with_cameras(&names, &views);
    let of_planes: Vec<(Vec<PathBuf>, Vec<u8>)> = results
        .maps
        .par_iter()
        .zip(&stems)
        .map(|(map, stem)| write_plane(map, &results.run, layers, &folder.join(stem)))
        .collect::<Result<_, Error>>()?;
    let of_cameras: Vec<(Vec<PathBuf>, [Vec<u8>; 2])> = results
        .images
        .par_iter()
        .zip(&view_stems)
        .map(|(image, stem)| write_view(image, &results.run, &folder.join(stem)))
        .collect::<Result<_, Error>>()?;
    let (written, mut pictures): (Vec<_>, Vec<_>) = of_planes.into_iter().unzip();
    let (of_cameras, views): (Vec<_>, Vec<_>) = of_cameras.into_iter().unzip();
    pictures.extend(views.into_iter().flatten());
    let mut written = [written, of_cameras].concat().concat();
    let mut save = |name: &str, content: &mut dyn FnMut(&mut files::Writer) -> std::io::Result<()>| {
        let path = folder.join(name);
        files::write_whole(&path, content)?;
        written.push(path);
        Ok::<(), Error>(())
    };
    for (map, stem) in results.surfaces.iter().zip(&stems[results.maps.len()..]) {
        save(&format!("{stem}.ply"), &mut |out| surface::write_ply(map, out))?;
        save(&format!("{stem}.csv"), &mut |out| surface::write_csv(map, out))?;
    }
    if !results.sensors.is_empty() {
        save("sensors.csv", &mut |out| csv::write_sensors(&results.sensors, out))?;
    }
    if !results.sensors.is_empty() && !results.run.groups.is_empty() {
        save("groups.csv", &mut |out| csv::write_groups(&results.sensors, &results.run.groups, out))?;
    }
    save("summary.json", &mut |out| out.write_all(json::summary(results).as_bytes()))?;
    save("report.html", &mut |out| out.write_all(html::report(results, &pictures).as_bytes()))?;
    Ok(written)
}

/// Writes `<stem>.exr`, `.png` and `.csv` of one plane; returns their paths and the picture.
fn write_plane(
    map: &IlluminanceMap,
    run: &Run,
    layers: &ExtraLayers,
    stem: &Path,
) -> Result<(Vec<PathBuf>, Vec<u8>), Error> {
    let files = [".exr", ".png", ".csv"].map(|ending| with_ending(stem, ending));
    let mut picture = Vec::new();
    files::write_whole(&files[0], &mut |out| exr::write(map, run, layers, out))?;
    files::write_whole(&files[1], &mut |out| {
        picture = png::picture(map, run)?;
        out.write_all(&picture)
    })?;
    files::write_whole(&files[2], &mut |out| csv::write_plane(map, out))?;
    Ok((files.into(), picture))
}

/// Writes `<stem>.exr`, `.png` and `-lux.png` of one camera; returns their paths and the two pictures.
fn write_view(image: &CameraImage, run: &Run, stem: &Path) -> Result<(Vec<PathBuf>, [Vec<u8>; 2]), Error> {
    let files = [".exr", ".png", "-lux.png"].map(|ending| with_ending(stem, ending));
    files::write_whole(&files[0], &mut |out| exr::write_view(image, run, out))?;
    let mut pictures = [Vec::new(), Vec::new()];
    files::write_whole(&files[1], &mut |out| {
        pictures[0] = png::tone_mapped(image)?;
        out.write_all(&pictures[0])
    })?;
    files::write_whole(&files[2], &mut |out| {
        pictures[1] = png::false_colour(image, run)?;
        out.write_all(&pictures[1])
    })?;
    Ok((files.into(), pictures))
}

/// The path `stem` with an ending added, dots in it or not.
fn with_ending(stem: &Path, ending: &str) -> PathBuf {
    let mut name = stem.as_os_str().to_owned();
    name.push(ending);
    PathBuf::from(name)
}

#[cfg(test)]
mod tests;
