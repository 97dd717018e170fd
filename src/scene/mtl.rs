//! MTL files: what surfaces look like, as far as a program that wrote them knew.

use std::collections::HashMap;
use std::path::Path;

use super::fields::Placed;
use super::lines::{Feed, Lines, is_plain, keyword, text, words};
use super::obj::foreign;
use crate::error::{InputError, Location};
use crate::text::quoted;

/// A material of an MTL file, as written: ranges are checked where the values are used.
#[derive(Clone, Debug)]
pub(crate) struct MtlMaterial {
    pub(crate) name: String,
    /// Line of its `newmtl`.
    pub(crate) at: Location,
    /// `Kd`, Lambertian reflectance.
    pub(crate) diffuse: Option<Placed<[f64; 3]>>,
    /// `Ks`, a mirror's reflectance if `illum` says that it mirrors.
    pub(crate) specular: Option<Placed<[f64; 3]>>,
    /// `Ns`, exponent of the highlight.
    pub(crate) exponent: Option<f64>,
    /// `Ka`; Blender writes there how much of it is metal.
    pub(crate) ambient: Option<f64>,
    /// `Ke`, luminance in cd/m².
    pub(crate) emissive: Option<Placed<[f64; 3]>>,
    /// `Ni`, index of refraction.
    pub(crate) ior: Option<Placed<f64>>,
    /// `illum`, 0 … 10.
    pub(crate) illumination: Option<u8>,
    /// `d`, 1 where it is opaque.
    pub(crate) dissolve: Option<Placed<f64>>,
    /// `Tr`, 0 where it is opaque; some programs write it as `d`.
    pub(crate) transparency: Option<Placed<f64>>,
    /// `Tf`, the filter's transmittance; some programs write its opposite.
    pub(crate) filter: Option<Placed<[f64; 3]>>,
    /// File of `map_Kd`, as written.
    pub(crate) texture: Option<Placed<String>>,
    /// File of `map_d`, as written.
    pub(crate) cut_out: Option<Placed<String>>,
    /// Whether the file says that Blender wrote it.
    pub(crate) by_blender: bool,
}

/// Materials of the MTL file at `path`, in its order; of two with one name the later counts.
pub(crate) fn parse(path: &Path, bytes: &[u8]) -> Result<Vec<MtlMaterial>, InputError> {
    foreign::refuse(path, bytes, bytes.len() as u64, "an MTL file")?;
    let mut tidy = TidyMtl {
        path,
        lines: Lines::new(bytes),
        line: 0,
        refused: None,
        names: Vec::new(),
        places: HashMap::new(),
        textures: HashMap::new(),
        cut_outs: HashMap::new(),
        extras: HashMap::new(),
        by_blender: false,
    };
    let mut feed = Feed::new(|line: &mut Vec<u8>| tidy.next(line));
    let loaded = tobj::load_mtl_buf(&mut feed);
    let TidyMtl { refused, line, names, places, textures, cut_outs, extras, by_blender, .. } = tidy;
    if let Some(error) = refused {
        return Err(error);
    }
    let (materials, _) = loaded.map_err(|_| {
        let text_of = |line: usize| Lines::new(bytes).find(|(number, _)| *number == line).map(|(_, line)| text(&line));
        let found = quoted(&text_of(line).unwrap_or_default());
        InputError::new(Location::line(path, line), found, "a keyword and finite numbers, as in Kd 0.5 0.5 0.5")
    })?;
    let of_one = |(index, material): (usize, &tobj::Material)| {
        let place = |key: &str| places.get(&(index, key)).cloned().unwrap_or_else(|| Location::file(path));
        let named: &Placed<String> = &names[index];
        MtlMaterial {
            name: named.value.clone(),
            at: named.at.clone(),
            diffuse: material.diffuse.map(|value| Placed { value, at: place("Kd") }),
            specular: material.specular.map(|value| Placed { value, at: place("Ks") }),
            emissive: material.emissive.map(|value| Placed { value, at: place("Ke") }),
            ior: material.optical_density.map(|value| Placed { value, at: place("Ni") }),
            illumination: material.illumination_model,
            exponent: extras.get(&(index, "Ns")).copied(),
            ambient: extras.get(&(index, "Ka")).copied(),
            dissolve: material.dissolve.map(|value| Placed { value, at: place("d") }),
            transparency: numbers(material, "Tr").map(|[value]| Placed { value, at: place("Tr") }),
            filter: numbers(material, "Tf").map(|value| Placed { value, at: place("Tf") }),
            texture: textures.get(&index).cloned(),
            cut_out: cut_outs.get(&index).cloned(),
            by_blender,
        }
    };
    Ok(materials.iter().enumerate().filter(|(index, _)| *index < names.len()).map(of_one).collect())
}

/// What stands behind the options of a texture, which begin with a minus and take numbers or a word each.
fn file_name(line: &[u8]) -> &[u8] {
    let mut rest = line;
    while rest.starts_with(b"-") {
        let (option, behind) = keyword(rest);
        let (least, most) = match option {
            b"-o" | b"-s" | b"-t" => (1, 3),
            b"-mm" => (2, 2),
            b"-blendu" | b"-blendv" | b"-boost" | b"-bm" | b"-cc" | b"-clamp" | b"-colorspace" | b"-imfchan"
            | b"-texres" | b"-type" => (1, 1),
            _ => return rest,
        };
        rest = behind;
        for taken in 0..most {
            let (word, behind) = keyword(rest);
            let is_number = str::from_utf8(word).is_ok_and(|word| word.parse::<f64>().is_ok());
            if taken >= least && !is_number {
                break;
            }
            rest = behind;
        }
    }
    rest
}

/// The numbers of a parameter that `tobj` knows nothing of.
fn numbers<const N: usize>(material: &tobj::Material, key: &str) -> Option<[f64; N]> {
    let numbers: Vec<f64> = material.unknown_param.get(key)?.split(' ').filter_map(|word| word.parse().ok()).collect();
    numbers.try_into().ok()
}

/// The lines that `tobj` gets to see: materials by number, one number spelt out for three channels, nothing it isn't
/// asked for.
struct TidyMtl<'a> {
    path: &'a Path,
    lines: Lines<'a>,
    /// Number of the line last read.
    line: usize,
    /// Why reading ended early.
    refused: Option<InputError>,
    names: Vec<Placed<String>>,
    /// Where a material's parameters stand.
    places: HashMap<(usize, &'static str), Location>,
    /// Their textures.
    textures: HashMap<usize, Placed<String>>,
    /// Their textures of opacity.
    cut_outs: HashMap<usize, Placed<String>>,
    /// First numbers of parameters that only say what others mean; a word that is no number is skipped.
    extras: HashMap<(usize, &'static str), f64>,
    by_blender: bool,
}

impl TidyMtl<'_> {
    fn next(&mut self, out: &mut Vec<u8>) -> bool {
        let Some((number, line)) = self.lines.next() else { return false };
        self.line = number;
        let (key, rest) = keyword(&line);
        if key == b"newmtl" {
            out.extend_from_slice(format!("newmtl {}\n", self.names.len()).as_bytes());
            self.names.push(Placed { value: text(rest), at: Location::line(self.path, number) });
            return true;
        }
        let Some(material) = self.names.len().checked_sub(1) else {
            self.by_blender |= line.starts_with(b"# Blender");
            return true;
        };
        if key == b"map_Kd" || key == b"map_d" {
            let texture = Placed { value: text(file_name(rest)), at: Location::line(self.path, number) };
            let textures = if key == b"map_d" { &mut self.cut_outs } else { &mut self.textures };
            textures.insert(material, texture);
            return true;
        }
        if let Some(extra) = ["Ns", "Ka"].into_iter().find(|extra| extra.as_bytes() == key) {
            let number = words(rest).next().and_then(|word| str::from_utf8(word).ok()?.parse().ok());
            if let Some(number) = number.filter(|number: &f64| number.is_finite()) {
                self.extras.insert((material, extra), number);
            }
            return true;
        }
        const KEYS: [&str; 8] = ["Kd", "Ks", "Ke", "Tf", "Ni", "d", "Tr", "illum"];
        let Some(key) = KEYS.into_iter().find(|known| known.as_bytes() == key) else { return true };
        self.places.insert((material, key), Location::line(self.path, number));
        self.refused = self.parameter(key, rest, out).err();
        self.refused.is_none()
    }

    fn parameter(&self, key: &str, rest: &[u8], out: &mut Vec<u8>) -> Result<(), InputError> {
        let words: Vec<&[u8]> = words(rest).collect();
        let values: &[&[u8]] = match (key, words.as_slice()) {
            ("Kd" | "Ks" | "Ke" | "Tf", &[grey]) => &[grey, grey, grey],
            ("Kd" | "Ks" | "Ke" | "Tf", rgb) if rgb.len() >= 3 => &rgb[..3],
            // d may carry -halo before its number.
            ("d", [.., number]) => &[number],
            ("Ni" | "Tr", [number, ..]) => &[number],
            // Some programs write 2.0 for 2.
            ("illum", [number, ..]) => &[whole(number)],
            _ => {
                let found = quoted(&format!("{key} {}", text(rest)));
                let count = if key.starts_with('K') || key == "Tf" { "one or three numbers" } else { "a number" };
                return Err(InputError::new(Location::line(self.path, self.line), found, format!("{key} and {count}")));
            }
        };
        if !values.iter().all(|value| is_plain(value)) {
            let found = quoted(&format!("{key} {}", text(rest)));
            let expected = "a keyword and finite numbers, as in Kd 0.5 0.5 0.5";
            return Err(InputError::new(Location::line(self.path, self.line), found, expected));
        }
        out.extend_from_slice(key.as_bytes());
        for value in values {
            out.push(b' ');
            out.extend_from_slice(value);
        }
        out.push(b'\n');
        Ok(())
    }
}

/// A number without the zeros behind its point.
fn whole(number: &[u8]) -> &[u8] {
    match number.iter().position(|&byte| byte == b'.') {
        Some(point) if point > 0 && number[point + 1..].iter().all(|&byte| byte == b'0') => &number[..point],
        _ => number,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_texture_s_name_stands_behind_its_options_and_may_hold_blanks() {
        for (line, name) in [
            ("wood.png", "wood.png"),
            ("old wood #3.jpg", "old wood #3.jpg"),
            ("-clamp on -s 2 2 1 -o 0.5 oak.png", "oak.png"),
            ("-s 2 -mm 0 1 -bm 0.3 3d wood.png", "3d wood.png"),
            ("-odd.png", "-odd.png"),
            ("-s 1 1", ""),
        ] {
            assert_eq!(text(file_name(line.as_bytes())), name);
        }
    }
}
