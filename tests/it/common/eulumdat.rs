//! EULUMDAT files made up.

use std::path::Path;

use luxmap::luminaire::photometry::Photometry;

/// A EULUMDAT file to be.
pub struct Ldt {
    /// Name of the luminaire.
    pub name: &'static str,
    /// Isym.
    pub symmetry: u8,
    /// C planes, °.
    pub planes: Vec<f64>,
    /// γ, °.
    pub angles: Vec<f64>,
    /// Length, width and four heights of the luminous area, mm.
    pub area: [f64; 6],
    /// Downward flux fraction and light output ratio, %; conversion factor; tilt.
    pub ratios: [f64; 4],
    /// Number, flux, power of each set.
    pub lamps: Vec<[f64; 3]>,
    /// Intensities in cd/klm, plane by plane.
    pub values: Vec<f64>,
    /// Digits after the point of planes, angles and values; none for as many as they need.
    pub digits: Option<usize>,
}

impl Ldt {
    /// The file.
    pub fn text(&self) -> String {
        let number = |number: &f64| match self.digits {
            Some(digits) => format!("{number:.digits$}"),
            None => number.to_string(),
        };
        let mut lines: Vec<String> = vec!["Maker".into(), "3".into(), self.symmetry.to_string()];
        lines.extend([self.planes.len().to_string(), "0".into(), self.angles.len().to_string(), "0".into()]);
        lines.extend(["R1", self.name, "4711", "lamp.ldt", "today", "0", "0", "0"].map(String::from));
        lines.extend(self.area.iter().chain(&self.ratios).map(f64::to_string));
        lines.push(self.lamps.len().to_string());
        for [number, flux, power] in self.lamps.iter().map(|set| set.map(|part| part.to_string())) {
            lines.extend([number, "LED".into(), flux, "3000".into(), "80".into(), power]);
        }
        lines.extend(vec!["0.5".to_owned(); 10]);
        lines.extend(self.planes.iter().chain(&self.angles).chain(&self.values).map(number));
        lines.join("\n") + "\n"
    }

    /// The file, read.
    pub fn read(&self) -> Photometry {
        Photometry::parse(Path::new("lamp.ldt"), self.text().as_bytes()).unwrap_or_else(|error| panic!("{error}"))
    }
}
