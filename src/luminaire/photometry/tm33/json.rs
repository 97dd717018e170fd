//! TM-33 as JSON (ATLA S001): the names of the XML in camelCase.

use std::path::Path;

use serde_json::Value;

use super::super::text::label;
use super::super::{Choice, Photometry, formats};
use super::{Document, Raw, Tm33Emitter, plain};
use crate::error::{InputError, Location};

/// Reads text that begins as JSON.
pub(in super::super) fn parse(path: &Path, text: &str, choice: &Choice) -> Result<Photometry, InputError> {
    let value: Value = serde_json::from_str(text).map_err(|error| {
        let at = Location::line(path, error.line().max(1));
        InputError::new(at, "broken JSON", "JSON of a photometric file (ATLA S001)")
    })?;
    // The document may lie in an object of its name.
    let inner = value.as_object().filter(|object| object.len() == 1).and_then(|object| object.values().next());
    let root = inner.filter(|inner| get(inner, &["emitters", "emitter"]).is_some()).unwrap_or(&value);
    if get(root, &["emitters", "emitter"]).is_none() {
        return Err(formats::refuse(path, "JSON without emitters"));
    }
    document(path, root)?.photometry(path, choice)
}

/// The member of an object that has one of those names, whatever their case.
fn get<'a>(value: &'a Value, names: &[&str]) -> Option<&'a Value> {
    let object = value.as_object()?;
    let found = names.iter().find_map(|name| object.iter().find(|(key, _)| plain(key) == *name));
    found.map(|(_, value)| value).filter(|value| !value.is_null())
}

fn text(value: &Value, names: &[&str]) -> Option<String> {
    match get(value, names)? {
        Value::String(text) => Some(label(text)).filter(|text| !text.is_empty()),
        Value::Number(number) => Some(number.to_string()),
        Value::Bool(word) => Some(word.to_string()),
        _ => None,
    }
}

/// A number, or a text that holds one.
fn as_number(value: &Value) -> Option<f64> {
    let number = match value {
        Value::String(text) => text.trim().parse().ok(),
        other => other.as_f64(),
    };
    number.filter(|number| number.is_finite())
}

fn number(path: &Path, value: &Value, names: &[&str]) -> Result<Option<f64>, InputError> {
    let Some(found) = get(value, names) else { return Ok(None) };
    match as_number(found) {
        Some(number) => Ok(Some(number)),
        None => Err(InputError::new(Location::file(path), format!("{} that is no number", names[0]), "a number")),
    }
}

fn list<'a>(value: &'a Value, names: &[&str]) -> &'a [Value] {
    match get(value, names) {
        Some(Value::Array(items)) => items,
        Some(one) => std::slice::from_ref(one),
        None => &[],
    }
}

fn document(path: &Path, root: &Value) -> Result<Document, InputError> {
    let nothing = Value::Null;
    let header = get(root, &["header"]).unwrap_or(&nothing);
    let luminaire = get(root, &["luminaire"]).unwrap_or(&nothing);
    let known = ["description", "catalognumber", "manufacturer"];
    let remarks = header.as_object().into_iter().flatten().filter(|(key, _)| !known.contains(&plain(key).as_str()));
    let remarks = remarks.filter_map(|(key, _)| Some((label(key).to_lowercase(), text(header, &[&plain(key)])?)));
    let size = |of: &Value, names: &[&str]| Ok::<_, InputError>(number(path, of, names)?.unwrap_or(0.0));
    let dimensions = match get(luminaire, &["dimensions"]) {
        Some(sizes) => Some([size(sizes, &["length"])?, size(sizes, &["width"])?, size(sizes, &["height"])?]),
        None => None,
    };
    let openings = list(luminaire, &["luminousopenings", "luminousopening"]);
    let area = match openings.first() {
        Some(area) => {
            let round = get(area, &["diameter"]).is_some() || text(area, &["circular"]).as_deref() == Some("true");
            Some(([size(area, &["length", "diameter"])?, size(area, &["width", "diameter"])?], round))
        }
        None => None,
    };
    let equipment = get(root, &["equipment"]).unwrap_or(&nothing);
    let goniometer = get(equipment, &["gonioradiometer", "goniometer"]);
    Ok(Document {
        line: 1,
        name: text(header, &["description"]).unwrap_or_default(),
        catalogue: text(header, &["catalognumber"]).unwrap_or_default(),
        manufacturer: text(header, &["manufacturer"]).unwrap_or_default(),
        remarks: remarks.collect(),
        dimensions,
        area,
        more_areas: openings.len() > 1,
        goniometer: goniometer.and_then(|value| text(value, &["type", "goniometertype"])),
        emitters: list(root, &["emitters", "emitter"])
            .iter()
            .map(|value| emitter(path, value))
            .collect::<Result<_, _>>()?,
    })
}

fn emitter(path: &Path, value: &Value) -> Result<Tm33Emitter, InputError> {
    let nothing = Value::Null;
    let names = ["description", "id", "catalognumber"].map(|name| text(value, &[name]));
    let temperature = get(value, &["colortemperature"]).unwrap_or(value);
    let rendering = get(value, &["colorrendering"]).unwrap_or(&nothing);
    let data = get(value, &["intensitydistribution", "luminousdata"]);
    Ok(Tm33Emitter {
        line: 1,
        names: names.into_iter().flatten().collect(),
        quantity: number(path, value, &["quantity"])?,
        rated: number(path, value, &["ratedlumens", "measuredlumens"])?,
        power: number(path, value, &["inputwatts", "inputwattage"])?,
        ballast: number(path, value, &["ballastfactor"])?,
        colour: text(temperature, &["fixedcct", "cct"]).unwrap_or_default(),
        rendering: text(rendering, &["ra"]).unwrap_or_default(),
        has_tilt: get(value, &["tiltangles"]).is_some(),
        has_spectrum: get(value, &["spectraldistribution", "spectraldata", "angularspectral"]).is_some(),
        table: data.map(|data| table(path, data)).transpose()?,
    })
}

fn table(path: &Path, data: &Value) -> Result<Raw, InputError> {
    let inner = get(data, &["luminousintensity"]).unwrap_or(data);
    let word = |names: &[&str]| text(inner, names).or_else(|| text(data, names));
    let points = match list(inner, &["intensitydata", "intdata"]) {
        [] => grid(path, inner)?,
        listed => listed.iter().map(|point| of_point(path, point)).collect::<Result<_, _>>()?,
    };
    Ok(Raw {
        line: 1,
        kind: word(&["photometrytype"]),
        metric: word(&["metric"]),
        units: word(&["units"]),
        symmetry: word(&["symmtype", "symmetry", "symm"]),
        absolute: word(&["absolutephotometry"]).map(|word| word == "true"),
        multiplier: number(path, inner, &["multiplier"])?,
        flux: number(path, data, &["luminousflux"])?,
        points,
    })
}

/// An object of two angles and an intensity.
fn of_point(path: &Path, point: &Value) -> Result<[f64; 3], InputError> {
    let part = |names: &[&str]| {
        let number = get(point, names).and_then(as_number);
        number.ok_or_else(|| {
            InputError::new(Location::file(path), "an intensity without angles", "horz, vert and value, numbers")
        })
    };
    Ok([part(&["horz", "h", "horizontal"])?, part(&["vert", "v", "vertical"])?, part(&["value", "intensity", "text"])?])
}

/// Lists of angles, and intensities plane after plane: in one list, or a list for each plane.
fn grid(path: &Path, data: &Value) -> Result<Vec<[f64; 3]>, InputError> {
    let refuse = |found: String, expected: String| InputError::new(Location::file(path), found, expected);
    let numbers = |items: &[Value], what: &str| -> Result<Vec<f64>, InputError> {
        match items.iter().map(as_number).collect::<Option<Vec<f64>>>() {
            Some(numbers) => Ok(numbers),
            None => Err(refuse(format!("{what} that are no numbers"), "numbers".into())),
        }
    };
    let planes = numbers(list(data, &["horizontalangles"]), "horizontal angles")?;
    let angles = numbers(list(data, &["verticalangles"]), "vertical angles")?;
    let listed = list(data, &["intensities", "intensity", "values"]);
    let rows: Vec<&[Value]> = listed.iter().filter_map(Value::as_array).map(Vec::as_slice).collect();
    let values = if rows.is_empty() {
        numbers(listed, "intensities")?
    } else if rows.len() == planes.len() && rows.iter().all(|row| row.len() == angles.len()) {
        numbers(&rows.concat(), "intensities")?
    } else {
        let found = format!("{} lists of intensities", rows.len());
        return Err(refuse(found, format!("{}, one for each plane, of {} each", planes.len(), angles.len())));
    };
    if values.len() != planes.len() * angles.len() {
        let found = format!("{} planes × {} angles, but {} intensities", planes.len(), angles.len(), values.len());
        return Err(refuse(found, "one for each pair of angles".into()));
    }
    let pairs = planes.iter().flat_map(|&h| angles.iter().map(move |&v| [h, v]));
    Ok(pairs.zip(values).map(|([h, v], value)| [h, v, value]).collect())
}
