//! What runs are compared with: a file, the closed form where one holds, or the method nearest to the truth.

use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use glam::DVec3;

use crate::error::{Error, InputError, Location, OptionError};
use crate::files;
use crate::files::stems;
use crate::gather::direct::emitter::MAX_POLYGONS;
use crate::luminaire::{Luminaire, Opening};
use crate::progress::Progress;
use crate::render::plan::{Method, Plan};
use crate::render::{Settings, Stop, render};
use crate::report::exr;
use crate::results::IlluminanceMap;
use crate::scene::{MeasuringPlane, Scene};
use crate::text::listed;
use crate::text::quoted;

/// The truth of one plane, as well as it is known; cells row by row from the corner.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// Whence it is, in words.
    pub source: String,
    /// E of each cell, lx; 0 where there is no value.
    pub illuminance: Vec<f64>,
    /// Standard error of each cell, lx; 0 where it isn't known.
    pub standard_error: Vec<f64>,
    /// False where there is no value.
    pub has_value: Vec<bool>,
}

/// The method that stands for the truth where there is neither a file nor a closed form, and how long it runs. This is
/// the one place that decides: an unbiased method belongs here.
fn nearest_to_the_truth(seed: u64) -> (Method, Settings) {
    let method = Method::Path;
    let stop = Stop::at_error(0.3).or_within(Duration::from_secs(60));
    (method, Settings { stop, seed, ..Settings::of(method) })
}

/// References of all planes of a scene, in order: those given, and the computed for the rest. `seed` must be one that
/// no run to be compared draws from.
///
/// # Errors
/// What [`render()`] says.
pub fn complete(
    given: Vec<Option<Reference>>,
    scene: &Scene,
    seed: u64,
    progress: &dyn Progress,
) -> Result<Vec<Reference>, Error> {
    if given.iter().all(Option::is_some) {
        return Ok(given.into_iter().flatten().collect());
    }
    let mut rest = scene.clone();
    let mut missing = given.iter().map(Option::is_none);
    rest.planes.retain(|_| missing.next().unwrap_or(false));
    rest.sensors.clear();
    let mut computed = compute(&rest, seed, progress)?.into_iter();
    Ok(given.into_iter().filter_map(|reference| reference.or_else(|| computed.next())).collect())
}

/// References of all planes by computation: the closed form of direct light where nothing bounces and nothing is in the
/// way, else by the method nearest to the truth.
fn compute(scene: &Scene, seed: u64, progress: &dyn Progress) -> Result<Vec<Reference>, Error> {
    let closed = has_closed_form(scene);
    let (method, settings) = if closed {
        (Method::Split, Settings { seed, ..Settings::of(Method::Split) })
    } else {
        nearest_to_the_truth(seed)
    };
    let plan = Plan::new(scene, method);
    let results = render(scene, &plan, &settings, progress)?;
    let source = if closed {
        "closed form of direct light".to_owned()
    } else if plan.bounces {
        format!("method {}, {} passes", method.name(), results.run.passes)
    } else {
        "direct light: nothing bounces".to_owned()
    };
    Ok(results.maps.into_iter().map(|map| Reference::of(map, &source)).collect())
}

/// Whether direct light by closed form is all there is: no surface reflects, and none stands between an opening and a
/// measuring plane. Meshes of so many triangles that they are sampled have none, and no measured opening or body.
/// Surfaces count as between if their bounds reach into the box around openings and planes; openings don't shade each
/// other where all lie in one plane.
fn has_closed_form(scene: &Scene) -> bool {
    let sampled = |lamp: &Luminaire| match &lamp.opening {
        Opening::Triangles(all) => all.len() > MAX_POLYGONS,
        Opening::Body(_) => true,
        opening => lamp.measured().is_some() && opening.flat().is_some(),
    };
    if Plan::new(scene, Method::Split).photons || scene.luminaires.iter().any(sampled) {
        return false;
    }
    let shining: Vec<DVec3> = scene.luminaires.iter().flat_map(|luminaire| outline(&luminaire.opening)).collect();
    let measured = scene.planes.iter().flat_map(|plane| {
        [DVec3::ZERO, plane.along, plane.across, plane.along + plane.across].map(|side| plane.corner + side)
    });
    let Some((low, high)) = bounds(shining.iter().copied().chain(measured)) else { return false };
    // Luminaires stand 10⁻⁵ of the room at most off what they are mounted on.
    let slack = 1e-4 * low.distance(high).min(scene.near.horizon());
    let front = scene.luminaires.iter().find_map(|luminaire| front(&luminaire.opening));
    let in_front_plane =
        |points: &[DVec3]| front.is_none_or(|(at, normal)| points.iter().all(|p| (*p - at).dot(normal).abs() < slack));
    let clear = |triangle: usize| {
        let corners = scene.mesh.corners(triangle);
        let outside = bounds(corners.iter().copied())
            .is_none_or(|(least, most)| (most.cmplt(low + slack) | least.cmpgt(high - slack)).any());
        outside || (front.is_some() && in_front_plane(&corners))
    };
    in_front_plane(&shining) && (0..scene.mesh.triangles.len()).all(clear)
}

/// A point of a flat opening and its normal; of an emitting mesh, its first triangle's.
fn front(opening: &Opening) -> Option<(DVec3, DVec3)> {
    match opening {
        Opening::Point { .. } => None,
        Opening::Rectangle { centre, half_width, half_depth } | Opening::Ellipse { centre, half_width, half_depth } => {
            Some((*centre, half_width.cross(*half_depth).normalize()))
        }
        Opening::Body(_) => None,
        Opening::Disc { centre, aim, .. } => Some((*centre, *aim)),
        Opening::Triangles(triangles) => triangles.first().map(|&[a, b, c]| (a, (b - a).cross(c - a).normalize())),
    }
}

/// Points whose hull holds the opening.
fn outline(opening: &Opening) -> Vec<DVec3> {
    match opening {
        Opening::Point { position, .. } => vec![*position],
        Opening::Rectangle { centre, half_width: w, half_depth: d }
        | Opening::Ellipse { centre, half_width: w, half_depth: d } => {
            vec![*centre - *w - *d, *centre + *w - *d, *centre + *w + *d, *centre - *w + *d]
        }
        Opening::Disc { centre, aim, radius } => {
            let (x, y) = aim.any_orthonormal_pair();
            [-x - y, x - y, x + y, y - x].map(|corner| *centre + corner * *radius).to_vec()
        }
        Opening::Body(body) => body.triangles().flatten().collect(),
        Opening::Triangles(triangles) => triangles.concat(),
    }
}

/// Lowest and highest corner of the box around some points.
fn bounds(points: impl Iterator<Item = DVec3>) -> Option<(DVec3, DVec3)> {
    points.map(|point| (point, point)).reduce(|(low, high), (point, _)| (low.min(point), high.max(point)))
}

impl Reference {
    fn of(map: IlluminanceMap, source: &str) -> Self {
        let IlluminanceMap { illuminance, standard_error, has_value, .. } = map;
        Self { source: source.to_owned(), illuminance, standard_error, has_value }
    }

    /// Reads a plane's reference: EXR (channel `Y`, or `R G B`; its σ from `stderr.Y` if there) or CSV (column `E_lx`,
    /// its σ from `standard_error_lx` if there; NaN or nothing means no value). Cells are matched in order, row by row
    /// from the plane's corner; an EXR image's first row is the last of the cells.
    ///
    /// # Errors
    /// [`Error::Input`] where the file can't be read, holds something else, or has another number of cells.
    pub fn read(path: &Path, plane: &MeasuringPlane) -> Result<Self, Error> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
        match ending.as_str() {
            "exr" => Self::read_exr(path, plane),
            "csv" => Self::read_csv(path, plane),
            _ => Err(InputError::new(Location::file(path), format!("the ending \"{ending}\""), ".exr or .csv").into()),
        }
    }

    fn read_exr(path: &Path, plane: &MeasuringPlane) -> Result<Self, Error> {
        let [columns, rows] = exr::size(path)?;
        if [columns, rows] != plane.cells {
            return Err(InputError::new(Location::file(path), format!("{columns} × {rows} cells"), size(plane)).into());
        }
        let image = exr::read(path)?;
        let standard_error = image.standard_error.unwrap_or_else(|| vec![0.0; image.illuminance.len()]);
        Ok(Self {
            source: path.display().to_string(),
            illuminance: image.illuminance,
            standard_error,
            has_value: image.has_value,
        })
    }

    fn read_csv(path: &Path, plane: &MeasuringPlane) -> Result<Self, Error> {
        let refuse = |line: u64, found: String, expected: &str| {
            let at = Location { file: path.to_owned(), line: (line > 0).then_some(line as usize) };
            InputError::new(at, found, expected)
        };
        let broken = |error: csv::Error| {
            let line = error.position().map_or(0, csv::Position::line);
            match error.into_kind() {
                csv::ErrorKind::Io(error) => refuse(0, reason(&error), "a table of illuminances"),
                csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                    refuse(line, format!("{len} columns"), &format!("{expected_len}, as in the first line"))
                }
                csv::ErrorKind::Utf8 { .. } => refuse(line, "bytes that are no text".into(), "UTF-8"),
                _ => refuse(line, "no table".into(), "comma-separated values"),
            }
        };
        let file = files::open(path, u64::MAX).map_err(|error| refuse(0, reason(&error), "a table of illuminances"))?;
        let mut table = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(file);
        let header = table.headers().map_err(broken)?.clone();
        let column = |name: &str| header.iter().position(|title| title.trim_start_matches('\u{feff}') == name);
        let Some(e_column) = column("E_lx") else {
            // Names of bytes that are no text are long.
            let mut found = format!("columns {}", listed(header.iter()));
            if let Some((end, _)) = found.char_indices().nth(300) {
                found.truncate(end);
                found.push('…');
            }
            return Err(refuse(1, found, "a column E_lx, and standard_error_lx where that is known").into());
        };
        let error_column = column("standard_error_lx");
        let mut reference = Self {
            source: path.display().to_string(),
            illuminance: Vec::with_capacity(plane.len()),
            standard_error: Vec::with_capacity(plane.len()),
            has_value: Vec::with_capacity(plane.len()),
        };
        for record in table.records() {
            let record = record.map_err(broken)?;
            let line = record.position().map_or(0, csv::Position::line);
            if reference.illuminance.len() == plane.len() {
                return Err(refuse(line, "one more row".into(), &size(plane)).into());
            }
            let number = |column: usize, expected: &str| match &record[column] {
                "" => Ok(None),
                text => match text.parse::<f64>() {
                    Ok(number) if number.is_nan() => Ok(None),
                    Ok(number) if number.is_finite() => Ok(Some(number)),
                    _ => Err(refuse(line, format!("{} in column {}", quoted(text), &header[column]), expected)),
                },
            };
            let e = number(e_column, "a number of lux; NaN or nothing where there is no value")?;
            let expected = "a number of lux, at least 0; NaN or nothing where it is not known";
            let sigma = error_column.map_or(Ok(None), |column| number(column, expected))?.unwrap_or(0.0);
            if sigma < 0.0 {
                return Err(refuse(line, format!("a standard error of {sigma}"), expected).into());
            }
            reference.has_value.push(e.is_some());
            reference.illuminance.push(e.unwrap_or(0.0));
            reference.standard_error.push(if e.is_some() { sigma } else { 0.0 });
        }
        match reference.illuminance.len() {
            rows if rows == plane.len() => Ok(reference),
            rows => Err(refuse(0, format!("{rows} rows"), &size(plane)).into()),
        }
    }
}

/// `17280 rows for the 120 × 144 cells of plane "floor"`
fn size(plane: &MeasuringPlane) -> String {
    let [columns, rows] = plane.cells;
    format!("{} for the {columns} × {rows} cells of plane \"{}\"", columns * rows, plane.name)
}

fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "no such file".to_owned(),
        io::ErrorKind::PermissionDenied => "a file that may not be read".to_owned(),
        _ => error.to_string(),
    }
}

/// Reads the references a user gives, one for each plane of the scene, in order; `None` where none is given. Each is
/// `PLANE=FILE`, a file (of the only plane, or of the plane it is named after), or a folder that holds `<plane>.exr`,
/// `<plane>.csv`, or either with `<scene>.` before it.
///
/// # Errors
/// [`Error::Usage`] where it isn't clear which plane is meant, else as [`Reference::read`].
pub fn given(arguments: &[String], scene: &Scene) -> Result<Vec<Option<Reference>>, Error> {
    let names: Vec<&str> = scene.planes.iter().map(|plane| plane.name.as_str()).collect();
    let stems = stems(&names);
    let mut files: Vec<Option<PathBuf>> = vec![None; names.len()];
    for argument in arguments {
        let named = names.iter().position(|name| argument.strip_prefix(name).is_some_and(|rest| rest.starts_with('=')));
        let found: Vec<(usize, PathBuf)> = match named {
            Some(plane) => vec![(plane, PathBuf::from(&argument[names[plane].len() + 1..]))],
            None if Path::new(argument).is_dir() => in_folder(Path::new(argument), &stems, scene),
            None => of_file(Path::new(argument), &stems).map(|plane| (plane, argument.into())).into_iter().collect(),
        };
        if found.is_empty() {
            let expected = if Path::new(argument).is_dir() {
                format!("a file in it, such as {}.exr or {}.csv", stems[0], stems[0])
            } else {
                format!("PLANE=FILE with one of {}", names.join(", "))
            };
            return Err(refused(format!("\"{argument}\""), expected));
        }
        for (plane, file) in found {
            if let Some(first) = files[plane].replace(file) {
                let found = format!("\"{argument}\" and {} for plane \"{}\"", first.display(), names[plane]);
                return Err(refused(found, "one".into()));
            }
        }
    }
    let read = |(file, plane): (Option<PathBuf>, &MeasuringPlane)| file.map(|file| Reference::read(&file, plane));
    files.into_iter().zip(&scene.planes).map(|file| read(file).transpose()).collect()
}

fn refused(found: String, expected: String) -> Error {
    OptionError::Value { option: "reference", found, expected }.into()
}

/// Files of a folder that are named after planes.
fn in_folder(folder: &Path, stems: &[String], scene: &Scene) -> Vec<(usize, PathBuf)> {
    let scene = scene.file.file_stem().unwrap_or_default().to_string_lossy();
    let file = |stem: &String| {
        [format!("{stem}.exr"), format!("{stem}.csv"), format!("{scene}.{stem}.exr"), format!("{scene}.{stem}.csv")]
            .into_iter()
            .map(|name| folder.join(name))
            .find(|path| path.is_file())
    };
    stems.iter().enumerate().filter_map(|(plane, stem)| Some((plane, file(stem)?))).collect()
}

/// The plane a file is named after (`floor.csv`, `seed-office.floor.csv`), or the only one.
fn of_file(path: &Path, stems: &[String]) -> Option<usize> {
    let name = path.file_stem()?.to_string_lossy();
    let after = |stem: &String| *name == **stem || name.ends_with(&format!(".{stem}"));
    stems.iter().position(after).or_else(|| (stems.len() == 1).then_some(0))
}
