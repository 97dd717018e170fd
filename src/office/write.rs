//! An office as files: mesh (OBJ), materials (MTL), photometry (LM-63) and scene (TOML), each written as it is made up.

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::Path;

use super::exact::circle;
use super::furniture::{self, Finish, Item};
use super::plan::{Office, Pose};
use super::{Parameters, Windows};
use crate::error::Error;
use crate::files::write::write_whole;
use crate::report;

/// Luminous efficacy of the luminaires at full output, lm/W, and what each draws when it is off, W.
const EFFICACY: f64 = 120.0;
const STANDBY: f64 = 0.3;

/// Coordinates are written in this many parts of a metre.
const PER_METRE: f64 = 1e5;

/// What was written.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Written {
    /// Triangles of the mesh.
    pub triangles: u64,
    /// Luminaires.
    pub luminaires: u32,
    /// Their luminous flux in all, lm.
    pub flux: f64,
    /// Of all files.
    pub bytes: u64,
}

impl Office {
    /// Writes `office.obj`, `office.mtl`, `downlight.ies` and, last, `office.toml` into `folder`, which is made if it
    /// is not there. Each file is whole or not there. Memory does not grow with the mesh.
    pub fn write(&self, folder: &Path) -> Result<Written, Error> {
        report::make_folder(folder)?;
        let mut written = Written::default();
        for row in self.rows() {
            let luminaires = row.count[0] * row.count[1];
            written.luminaires += luminaires;
            written.flux += row.flux * f64::from(luminaires);
        }
        write_whole(&folder.join("office.obj"), &mut |out| {
            let mut lines = ObjWriter::new(out);
            self.obj(&mut lines)?;
            lines.flush()?;
            (written.triangles, written.bytes) = (lines.triangles, lines.bytes);
            Ok(())
        })?;
        let texts = [("office.mtl", self.mtl()), ("downlight.ies", self.ies()), ("office.toml", self.toml())];
        for (name, text) in texts {
            write_whole(&folder.join(name), &mut |out| out.write_all(text.as_bytes()))?;
            written.bytes += text.len() as u64;
        }
        Ok(written)
    }

    /// The mesh, item by item: vertices, then faces.
    fn obj<W: Write>(&self, lines: &mut ObjWriter<W>) -> io::Result<()> {
        lines.text(&format!("# {}\n", self.made_by()))?;
        lines.text("# Unit: m, z up. Faces counter-clockwise seen from the air.\nmtllib office.mtl\n")?;
        lines.item("building", &self.building, Pose { origin: Default::default(), turn: [1.0, 0.0] })?;
        let mut result = Ok(());
        self.furnish(|name, item, place| {
            if result.is_ok() {
                result = lines.item(name, item, place);
            }
        });
        result
    }

    /// The command line that makes this office.
    fn made_by(&self) -> String {
        let Parameters { workstations, detail, seed, height, windows, luminaires, illuminance, cell } =
            &self.parameters;
        let luminaires = luminaires.map_or(String::new(), |count| format!(" --luminaires {count}"));
        format!(
            "Made by luxmap {}: luxmap office --workstations {workstations} --detail {detail} --seed {seed} \
             --height {height} --windows {}{luminaires} --illuminance {illuminance} --cell {cell}",
            env!("CARGO_PKG_VERSION"),
            windows.name()
        )
    }

    fn mtl(&self) -> String {
        let mut text = format!("# {}\n", self.made_by());
        for material in Finish::ALL {
            let (name, reflectance) = self.properties(material);
            let mirror = self.mirror(material);
            let illumination =
                if mirror > 0.0 { format!("Ks {mirror} {mirror} {mirror}\nillum 3") } else { "illum 1".into() };
            let _ = write!(text, "\nnewmtl {name}\nKd {reflectance} {reflectance} {reflectance}\n{illumination}\n");
        }
        text
    }

    /// A material's name and reflectance in this office.
    fn properties(&self, material: Finish) -> (&'static str, f64) {
        match (material, self.parameters.windows) {
            (Finish::Glass, Windows::Matte) => ("glass", 0.1),
            _ => material.properties(),
        }
    }

    /// What a material mirrors.
    fn mirror(&self, material: Finish) -> f64 {
        if material == Finish::Glass && self.parameters.windows == Windows::Glass { 0.08 } else { 0.0 }
    }

    /// The scene: mesh, luminaires by rows, measuring planes, sensors.
    fn toml(&self) -> String {
        let Parameters { workstations, windows, cell, .. } = self.parameters;
        let [x, y, z] = self.size.to_array().map(decimals);
        let mut text = format!("# {}\n", self.made_by());
        let rows = self.rows();
        let luminaires: u32 = rows.iter().map(|row| row.count[0] * row.count[1]).sum();
        let _ = write!(
            text,
            "# An open-plan office of {x} × {y} × {z} m: {workstations} workstations, {} triangles, {luminaires} luminaires.\n\
             # Geometry, reflectances (office.mtl) and downlight.ies are made up by rule; nothing was measured.\n\
             name = \"Open-plan office\"\n\n[[mesh]]\nfile = \"office.obj\"\n",
            self.triangles(),
        );
        if windows == Windows::Glass {
            let [reflectance, specular] = [self.properties(Finish::Glass).1, self.mirror(Finish::Glass)];
            let _ = write!(
                text,
                "\n[material.glass]                    # a window at night\nreflectance = {reflectance}\nspecular = {specular}\n"
            );
        }
        for row in &rows {
            let [px, py, pz] = row.first.to_array().map(decimals);
            let light = match row.downlights {
                true => format!("photometry = \"downlight.ies\"\nopening = {{ disc = {} }}", furniture::DOWNLIGHT),
                false => format!("opening = {{ rectangle = [{0}, {0}] }}", furniture::PANEL),
            };
            let _ = write!(
                text,
                "\n[[luminaire]]\nname = \"{name}\"\ngroup = \"{name}\"\nposition = [{px}, {py}, {pz}]\n{light}\nflux = {}\n\
                 power = {}\nstandby = {STANDBY}\n\
                 array = {{ count = [{}, {}], pitch = [{}, {}] }}\n",
                row.flux,
                (row.flux / EFFICACY * 10.0 + 0.5).floor() / 10.0,
                row.count[0],
                row.count[1],
                decimals(row.pitch[0]),
                decimals(row.pitch[1]),
                name = row.name,
            );
        }
        let cells = [self.size.x, self.size.y].map(|size| ((size / cell + 0.5).floor() as u64).max(1));
        for (name, z, on) in [("floor", "0", "surface"), ("workplane", "0.75", "air")] {
            let _ = write!(
                text,
                "\n[[plane]]\nname = \"{name}\"\ncorner = [0, 0, {z}]\nalong = [{x}, 0, 0]\nacross = [0, {y}, 0]\n\
                 cells = [{}, {}]\non = \"{on}\"\n",
                cells[0], cells[1],
            );
        }
        for sensor in self.sensors() {
            let [x, y, z] = sensor.position.to_array().map(decimals);
            let _ = write!(
                text,
                "\n[[sensor]]\nname = \"{}\"\nposition = [{x}, {y}, {z}]\nnormal = [0, 0, 1]\ntarget = {}\n",
                sensor.name,
                self.target(),
            );
        }
        text
    }

    /// A low-glare downlight after LM-63-2002: I(γ) = I₀ cos γ/(1 + (tan γ/tan 45°)⁸), so that past 65° next to nothing
    /// is left. I₀ gives the flux that the scene asks for.
    fn ies(&self) -> String {
        const STEP: f64 = 2.5;
        let shape = |angle: f64| {
            let [cos, sin] = circle(angle / 360.0);
            let tan = sin / cos;
            let fourth = tan * tan * tan * tan;
            if angle < 90.0 { cos / (1.0 + fourth * fourth) } else { 0.0 }
        };
        // Φ = 2π ∫ I sin γ dγ by the midpoint rule, a hundredth of a step wide: 10⁻⁷ off.
        let width = STEP / 100.0;
        let strips = (90.0 / width) as u32;
        let strip = |number: u32| {
            let angle = (f64::from(number) + 0.5) * width;
            shape(angle) * circle(angle / 360.0)[1]
        };
        let solid_angle = 2.0 * PI * (0..strips).map(strip).sum::<f64>() * width * PI / 180.0;
        let flux = self.rows().iter().find(|row| row.downlights).map_or(1000.0, |row| row.flux);
        let peak = flux / solid_angle;

        let angles: Vec<f64> = (0..=36).map(|step| f64::from(step) * STEP).collect();
        let mut text = format!(
            "IESNA:LM-63-2002\n[TEST] none: computed, no luminaire was measured\n[TESTLAB] luxmap\n[ISSUEDATE] 2026-11-22\n\
             [MANUFAC] none\n[LUMCAT] made-up low-glare downlight\n\
             [LUMINAIRE] Downlight of {} m, I = I0 cos(g)/(1 + tan(g)^8)\n[LAMP] LED, absolute photometry\nTILT=NONE\n\
             1 -1 1 {} 1 1 2 -{2} -{2} 0\n1 1 0\n",
            furniture::DOWNLIGHT,
            angles.len(),
            furniture::DOWNLIGHT,
        );
        let mut row = |numbers: Vec<String>| {
            for line in numbers.chunks(12) {
                let _ = writeln!(text, "{}", line.join(" "));
            }
        };
        row(angles.iter().map(|angle| format!("{angle}")).collect());
        row(vec!["0".into()]);
        row(angles.iter().map(|&angle| format!("{:.2}", peak * shape(angle))).collect());
        text
    }
}

/// A length with at most five decimals.
fn decimals(metres: f64) -> f64 {
    (metres * PER_METRE + 0.5).floor() / PER_METRE
}

/// Lines of an OBJ file, collected into large blocks.
struct ObjWriter<W> {
    out: W,
    block: Vec<u8>,
    vertices: u64,
    triangles: u64,
    bytes: u64,
}

/// A block is written once it has this many bytes; a line has fewer than `LONGEST`.
const BLOCK: usize = 1 << 18;
const LONGEST: usize = 128;

impl<W: Write> ObjWriter<W> {
    fn new(out: W) -> Self {
        Self { out, block: Vec::with_capacity(BLOCK + LONGEST), vertices: 0, triangles: 0, bytes: 0 }
    }

    fn text(&mut self, text: &str) -> io::Result<()> {
        self.block.extend_from_slice(text.as_bytes());
        self.make_room()
    }

    /// Writes the block if it is full.
    #[inline]
    fn make_room(&mut self) -> io::Result<()> {
        if self.block.len() < BLOCK { Ok(()) } else { self.flush() }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.bytes += self.block.len() as u64;
        self.out.write_all(&self.block)?;
        self.block.clear();
        Ok(())
    }

    /// An item where it stands: its vertices, then its faces, material by material.
    fn item(&mut self, name: &str, item: &Item, place: Pose) -> io::Result<()> {
        self.text(&format!("o {name}\n"))?;
        for &vertex in &item.vertices {
            self.block.push(b'v');
            for metres in place.at(vertex).to_array() {
                self.block.push(b' ');
                push_metres(&mut self.block, metres);
            }
            self.block.push(b'\n');
            self.make_room()?;
        }
        let mut from = 0;
        for &(material, end) in &item.materials {
            self.text(&format!("usemtl {}\n", material.properties().0))?;
            for corners in &item.triangles[from..end] {
                self.block.push(b'f');
                for &corner in corners {
                    self.block.push(b' ');
                    push_whole(&mut self.block, self.vertices + u64::from(corner) + 1);
                }
                self.block.push(b'\n');
                self.make_room()?;
            }
            from = end;
        }
        self.vertices += item.vertices.len() as u64;
        self.triangles += item.triangles.len() as u64;
        Ok(())
    }
}

/// "00", "01" … "99".
const PAIRS: [[u8; 2]; 100] = {
    let mut pairs = [[0; 2]; 100];
    let mut number = 0;
    while number < 100 {
        pairs[number] = [b'0' + (number / 10) as u8, b'0' + (number % 10) as u8];
        number += 1;
    }
    pairs
};

/// Puts the digits of `number` before `end`; tells where they begin.
#[inline]
fn digits(mut number: u64, text: &mut [u8; 20], mut end: usize) -> usize {
    while number >= 100 {
        end -= 2;
        text[end..end + 2].copy_from_slice(&PAIRS[(number % 100) as usize]);
        number /= 100;
    }
    if number >= 10 {
        end -= 2;
        text[end..end + 2].copy_from_slice(&PAIRS[number as usize]);
    } else {
        end -= 1;
        text[end] = b'0' + number as u8;
    }
    end
}

/// Appends a whole number.
#[inline]
fn push_whole(block: &mut Vec<u8>, number: u64) {
    let mut text = [0; 20];
    let start = digits(number, &mut text, 20);
    block.extend_from_slice(&text[start..]);
}

/// Appends a length with five decimals, rounded to nearest.
#[inline]
fn push_metres(block: &mut Vec<u8>, metres: f64) {
    let units = (metres * PER_METRE + 0.5_f64.copysign(metres)) as i64;
    if units < 0 {
        block.push(b'-');
    }
    let units = units.unsigned_abs();
    let (whole, mut part) = (units / 100_000, units % 100_000);
    let mut text = [0; 20];
    for at in [18, 16] {
        text[at..at + 2].copy_from_slice(&PAIRS[(part % 100) as usize]);
        part /= 100;
    }
    text[15] = b'0' + part as u8;
    text[14] = b'.';
    let start = digits(whole, &mut text, 14);
    block.extend_from_slice(&text[start..]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_the_library_writes_them() {
        let mut random = 1_u64;
        for step in 0..20_000 {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let number = random >> (step % 64);
            let mut text = Vec::new();
            push_whole(&mut text, number);
            assert_eq!(text, number.to_string().into_bytes());
            // Whole units, so that nothing lies between two texts.
            let units = (random as i64) >> (24 + step % 40);
            text.clear();
            push_metres(&mut text, units as f64 / PER_METRE);
            let expected = format!("{:.5}", units as f64 / PER_METRE);
            assert_eq!(String::from_utf8_lossy(&text), expected);
        }
    }

    #[test]
    fn a_length_is_rounded_to_the_nearest_and_zero_has_no_sign() {
        for (metres, expected) in
            [(0.000_004, "0.00000"), (-0.000_004, "0.00000"), (-0.000_006, "-0.00001"), (1.999_996, "2.00000")]
        {
            let mut text = Vec::new();
            push_metres(&mut text, metres);
            assert_eq!(String::from_utf8_lossy(&text), expected);
        }
    }
}
