//! The influence matrix: what each luminaire brings to each sensor. Light adds up, so it is all that one has to know of
//! a room for dimming: E = R d + daylight.

use std::f64::consts::PI;
use std::io::{self, Write};
use std::path::Path;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::error::invalid;
use crate::error::{Error, InputError, Location};
use crate::files;
use crate::luminaire::{Distribution, Luminaire, Opening, Supply};
use crate::report::npy;
use crate::results::Results;
use crate::scene::Scene;

/// Largest file read, bytes.
const LARGEST: u64 = 1 << 30;

/// What each luminaire at full output brings to each sensor, lx, and how sure that is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Influence {
    /// Name of the scene.
    pub scene: String,
    /// SHA-256 of the scene and its files, all luminaires at full output.
    pub scene_sha256: String,
    /// Columns.
    pub luminaires: Vec<Dimmable>,
    /// Rows.
    pub sensors: Vec<SensorRow>,
    /// E at full output, lx: a row for each sensor.
    pub lux: Vec<Vec<f64>>,
    /// Standard error (1 σ) of each entry, lx. Those of a row are not independent: they share photons and rays.
    pub standard_error: Vec<Vec<f64>>,
}

/// A luminaire to dim.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dimmable {
    /// Its name.
    pub name: String,
    /// Its light group.
    pub group: String,
    /// Luminous flux at full output, maintained, lm.
    pub flux: f64,
    /// Luminous intensity along its aim at full output, cd: what lx/cd refers to. Bodies and meshes: of the side that
    /// shines most. None where that is 0.
    pub candela: Option<f64>,
    /// Level in the scene file, how far it dims, what it draws.
    pub supply: Supply,
}

/// A sensor to serve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorRow {
    /// Its name.
    pub name: String,
    /// World position, m.
    pub position: [f64; 3],
    /// Unit normal of the measured side.
    pub normal: [f64; 3],
    /// What is asked for there, lx.
    pub target: Option<f64>,
    /// How much more is still welcome, lx.
    pub tolerance: Option<f64>,
    /// What arrives besides the luminaires' light, lx.
    pub daylight: f64,
}

impl SensorRow {
    /// Least and most E that is welcome there, lx; nothing where none is asked for.
    pub fn band(&self) -> Option<[f64; 2]> {
        let target = self.target?;
        Some([target, self.tolerance.map_or(f64::INFINITY, |tolerance| target + tolerance)])
    }
}

/// Makes each luminaire of a scene a light group of its own; returns the groups they were in.
pub fn tell_apart(scene: &mut Scene) -> Vec<String> {
    let own = |luminaire: &mut Luminaire| std::mem::replace(&mut luminaire.group, luminaire.name.clone());
    scene.luminaires.iter_mut().map(own).collect()
}

impl Influence {
    /// What a run has found of a scene whose luminaires are told apart; `groups` are those they were in. Where a
    /// luminaire was dimmed, what it would bring at full output.
    pub fn of(scene: &Scene, groups: Vec<String>, results: &Results) -> Self {
        let count = scene.luminaires.len();
        let dimmable = |(luminaire, group): (&Luminaire, String)| Dimmable {
            name: luminaire.name.clone(),
            group,
            flux: luminaire.flux.0 / luminaire.supply.level,
            candela: Some(axial_intensity(luminaire) / luminaire.supply.level).filter(|candela| *candela > 0.0),
            supply: luminaire.supply.clone(),
        };
        let sensors = scene.sensors.iter().map(|sensor| SensorRow {
            name: sensor.name.clone(),
            position: (sensor.position + scene.centre).to_array(),
            normal: sensor.normal.to_array(),
            target: sensor.target,
            tolerance: sensor.tolerance,
            daylight: sensor.daylight,
        });
        // A single luminaire is the whole; groups of one are not told apart.
        let at_full = |i: usize, lux: f64| lux / scene.luminaires[i].supply.level;
        let row = |value: &dyn Fn(usize) -> f64| (0..count).map(|i| at_full(i, value(i))).collect::<Vec<f64>>();
        let (lux, standard_error) = results
            .sensors
            .iter()
            .map(|reading| match reading.groups.as_slice() {
                [] => (row(&|_| reading.illuminance), row(&|_| reading.standard_error)),
                groups => (row(&|i| groups[i].illuminance), row(&|i| groups[i].standard_error)),
            })
            .unzip();
        Self {
            scene: scene.name.clone(),
            scene_sha256: scene.hash.clone(),
            luminaires: scene.luminaires.iter().zip(groups).map(dimmable).collect(),
            sensors: sensors.collect(),
            lux,
            standard_error,
        }
    }

    /// E at a sensor, daylight included, lx. Cost: O(luminaires).
    pub fn illuminance(&self, sensor: usize, levels: &[f64]) -> f64 {
        let light = self.lux[sensor].iter().zip(levels).map(|(lux, level)| lux * level);
        self.sensors[sensor].daylight + light.sum::<f64>()
    }

    /// The same with every luminaire at full output: the most there can be.
    pub fn most(&self, sensor: usize) -> f64 {
        self.illuminance(sensor, &vec![1.0; self.luminaires.len()])
    }

    /// What all luminaires draw at full output.
    pub fn full_power(&self) -> f64 {
        self.power(&vec![1.0; self.luminaires.len()])
    }

    /// Whether every luminaire's power is known.
    pub fn knows_power(&self) -> bool {
        self.luminaires.iter().all(|luminaire| luminaire.supply.power.is_some())
    }

    /// Unit of [`Self::power`].
    pub fn power_unit(&self) -> &'static str {
        if self.knows_power() { "W" } else { "lm" }
    }

    /// What a luminaire draws at a level, W; where some luminaire's power is not known, the flux it emits, lm.
    pub fn power_of(&self, luminaire: usize, level: f64) -> f64 {
        let luminaire = &self.luminaires[luminaire];
        let watts = luminaire.supply.power_at(level).filter(|_| self.knows_power());
        watts.unwrap_or(luminaire.flux * level)
    }

    /// The same of all together.
    pub fn power(&self, levels: &[f64]) -> f64 {
        (0..self.luminaires.len()).map(|luminaire| self.power_of(luminaire, levels[luminaire])).sum()
    }

    /// Power over level of a luminaire as corners of a curve, from its lowest level above off to full output; off
    /// apart.
    pub fn curve(&self, luminaire: usize) -> Vec<[f64; 2]> {
        let Dimmable { flux, supply, .. } = &self.luminaires[luminaire];
        match &supply.power {
            Some(points) if self.knows_power() => points.clone(),
            _ => vec![[supply.least, supply.least * flux], [1.0, *flux]],
        }
    }

    /// Levels of the scene file.
    pub fn levels(&self) -> Vec<f64> {
        self.luminaires.iter().map(|luminaire| luminaire.supply.level).collect()
    }

    /// All there is, as `influence.json` has it.
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).expect("numbers and names")
    }

    /// Reads the JSON file that [`Self::write`] has written. Anything else is refused in one line.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let refuse = |at: Location, found: String| {
            Error::Input(InputError::new(at, found, "an influence.json that luxmap influence has written"))
        };
        let text = files::read(path, LARGEST).map_err(|error| refuse(Location::file(path), files::why(&error)))?;
        let influence: Self = serde_json::from_slice(&text)
            .map_err(|error| refuse(Location::line(path, error.line().max(1)), error.to_string()))?;
        match influence.fault() {
            Some(fault) => Err(refuse(Location::file(path), fault)),
            None => Ok(influence),
        }
    }

    /// What contradicts itself.
    fn fault(&self) -> Option<String> {
        let (rows, columns) = (self.sensors.len(), self.luminaires.len());
        let fits = |table: &[Vec<f64>]| table.len() == rows && table.iter().all(|row| row.len() == columns);
        if !fits(&self.lux) || !fits(&self.standard_error) {
            return Some(format!("tables that are not {rows} sensors × {columns} luminaires"));
        }
        let supply = |luminaire: &Dimmable| {
            let Supply { level, least, off, power } = &luminaire.supply;
            let rises = |points: &Vec<[f64; 2]>| {
                points.len() > 1
                    && points.windows(2).all(|pair| pair[0][0] < pair[1][0])
                    && points[0][0] == *least
                    && points[points.len() - 1][0] == 1.0
                    && points.iter().all(|[_, watts]| *watts >= 0.0)
            };
            let sound = (0.0..=1.0).contains(level) && (0.0..1.0).contains(least) && *off >= 0.0;
            sound && power.as_ref().is_none_or(rises) && luminaire.flux > 0.0
        };
        let odd = self.luminaires.iter().find(|luminaire| !supply(luminaire));
        odd.map(|luminaire| format!("luminaire \"{}\" with levels or powers that can't be", luminaire.name))
    }

    /// Writes `influence.json` with all there is, `influence.npy` (R, lx, rows are sensors), and tables of rows for
    /// sensors and columns for luminaires: `influence.csv` (lx at full output), `influence-per-cd.csv` (lx/cd), and of
    /// each the standard errors, `-stderr.csv`. Returns their paths.
    pub fn write(&self, folder: &Path) -> Result<Vec<std::path::PathBuf>, Error> {
        let per_candela = |table: &[Vec<f64>]| -> Vec<Vec<Option<f64>>> {
            let of = |(lux, luminaire): (&f64, &Dimmable)| luminaire.candela.map(|candela| lux / candela);
            table.iter().map(|row| row.iter().zip(&self.luminaires).map(of).collect()).collect()
        };
        let plain = |table: &[Vec<f64>]| table.iter().map(|row| row.iter().copied().map(Some).collect()).collect();
        let mut written = Vec::new();
        let mut save = |name: &str, content: &mut dyn FnMut(&mut files::Writer) -> io::Result<()>| {
            let path = folder.join(name);
            files::write_whole(&path, content)?;
            written.push(path);
            Ok::<(), Error>(())
        };
        if self.lux.iter().chain(&self.standard_error).flatten().any(|lux| !lux.is_finite()) {
            let source = invalid("an entry is not finite".into());
            return Err(Error::Write { path: folder.join("influence.csv"), source });
        }
        save("influence.csv", &mut |out| self.table(plain(&self.lux), out))?;
        save("influence-stderr.csv", &mut |out| self.table(plain(&self.standard_error), out))?;
        save("influence-per-cd.csv", &mut |out| self.table(per_candela(&self.lux), out))?;
        save("influence-per-cd-stderr.csv", &mut |out| self.table(per_candela(&self.standard_error), out))?;
        save("influence.npy", &mut |out| npy::write_matrix(&self.lux, self.luminaires.len(), out))?;
        save("influence.json", &mut |out| {
            out.write_all(self.json().as_bytes())?;
            out.write_all(b"\n")
        })?;
        Ok(written)
    }

    fn table(&self, rows: Vec<Vec<Option<f64>>>, out: &mut impl Write) -> io::Result<()> {
        let mut table = csv::Writer::from_writer(out);
        table.write_record(std::iter::once("sensor").chain(self.luminaires.iter().map(|lamp| lamp.name.as_str())))?;
        for (sensor, row) in self.sensors.iter().zip(rows) {
            let row = row.into_iter().map(|value| value.map_or_else(String::new, |value| value.to_string()));
            table.write_record(std::iter::once(sensor.name.clone()).chain(row))?;
        }
        table.flush()
    }
}

/// Luminous intensity along the aim, cd; of a body or a mesh towards the side that shines most.
fn axial_intensity(luminaire: &Luminaire) -> f64 {
    let flux = luminaire.flux.0;
    match (&luminaire.distribution, &luminaire.opening) {
        (Distribution::Measured(measured), _) => flux / measured.web().flux() * measured.web().table().at(0.0, 0.0),
        (Distribution::Isotropic, _) => flux / (4.0 * PI),
        (Distribution::Lambertian, Opening::Triangles(triangles)) => {
            // L times the area seen along the mean normal; Φ = π L A.
            let areas: Vec<DVec3> = triangles.iter().map(|&[a, b, c]| (b - a).cross(c - a) / 2.0).collect();
            let whole: f64 = areas.iter().map(|area| area.length()).sum();
            let towards = areas.iter().sum::<DVec3>().normalize_or_zero();
            flux / (PI * whole) * areas.iter().map(|area| area.dot(towards).max(0.0)).sum::<f64>()
        }
        (Distribution::Lambertian, Opening::Body(body)) => {
            let [a, b, c] = body.half_axes.map(|axis| axis.normalize_or_zero());
            let seen = [a, b, c].map(|side| body.projected_area(side)).into_iter().fold(0.0, f64::max);
            flux / (PI * body.surface()) * seen
        }
        (Distribution::Lambertian, _) => flux / PI,
    }
}
