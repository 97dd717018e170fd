//! Files of other formats that are given as OBJ or MTL: known by how they begin, so that a refusal can name them.

use std::path::Path;

use crate::error::{InputError, Location};

/// Bytes from the beginning of a file that tell what it is.
pub(crate) const HEAD: usize = 4096;

/// What a file begins with that is no OBJ file, what it then is, and what to do. Longer beginnings stand first.
const BEGINNINGS: [(&[u8], &str, &str); 26] = [
    // A length and UTF-16 text, so it must stand before UTF-16.
    (b"\xff\xfe\xff\x0e", "a SketchUp model (.skp)", EXPORT),
    (b"\xff\xfe", "text in UTF-16", RECODE),
    (b"\xfe\xff", "text in UTF-16", RECODE),
    (b"\x1f\x8b", "a file compressed by gzip", UNPACK),
    (b"BZh", "a file compressed by bzip2", UNPACK),
    (b"\x28\xb5\x2f\xfd", "a file compressed by zstd, as .blend files are", EXPORT),
    (b"\xfd7zXZ\0", "a file compressed by xz", UNPACK),
    (b"7z\xbc\xaf\x27\x1c", "a 7-Zip archive", UNPACK),
    (b"Rar!\x1a\x07", "a RAR archive", UNPACK),
    (b"PK\x03\x04", "a ZIP archive (.zip, .skp, .3mf, .usdz)", "unpack it and name the OBJ file in it, or export one"),
    (b"BLENDER", "a Blender file (.blend)", EXPORT),
    (b"glTF", "a glTF model (.glb)", EXPORT),
    (b"Kaydara FBX Binary", "an FBX model", EXPORT),
    (b"; FBX ", "an FBX model", EXPORT),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "a Revit or 3ds Max file (.rvt, .rfa, .max)", EXPORT),
    (b"AutoCAD Binary DXF", "a DXF drawing", EXPORT),
    (b"3D Geometry File Format", "a Rhino model (.3dm)", EXPORT),
    (b"PXR-USDC", "a USD model", EXPORT),
    (b"#usda 1", "a USD model", EXPORT),
    (b"#VRML V", "a VRML model", EXPORT),
    (b"//Maya ASCII", "a Maya scene (.ma)", EXPORT),
    (b"FOR4", "a Maya scene (.mb)", EXPORT),
    (b"FOR8", "a Maya scene (.mb)", EXPORT),
    (b"%PDF-", "a PDF document", EXPORT),
    (b"\x89PNG\r\n", "an image", EXPORT),
    (b"version https://git-lfs", "a pointer to a file in Git LFS", "fetch the file itself: git lfs pull"),
];

const EXPORT: &str = "export it as OBJ from the program that made it";
const UNPACK: &str = "unpack it first";
const RECODE: &str = "save it as UTF-8";

/// What a file of another format is, by its first bytes (up to [`HEAD`]) and its length, and what to do about it.
fn kind(head: &[u8], length: u64) -> Option<(&'static str, &'static str)> {
    if let Some(&(_, what, cure)) = BEGINNINGS.iter().find(|(beginning, ..)| head.starts_with(beginning)) {
        return Some((what, cure));
    }
    let found = |what| Some((what, EXPORT));
    let number =
        |at: usize| head.get(at..at + 4).map(|bytes| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
    // A chunk as long as the file.
    if head.starts_with(b"MM") && number(2).is_some_and(|size| u64::from(size) == length) {
        return found("a 3D Studio model (.3ds)");
    }
    // 80 bytes of anything, the number of triangles, and 50 bytes each.
    if number(80).is_some_and(|triangles| length == 84 + 50 * u64::from(triangles)) && head[..84].contains(&0) {
        return found("an STL model");
    }
    if is_utf_16(head) {
        return Some(("text in UTF-16", RECODE));
    }
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
    let holds = |word: &str| text.windows(word.len()).any(|part| part.eq_ignore_ascii_case(word.as_bytes()));
    let begins = |word: &str| text.get(..word.len()).is_some_and(|part| part.eq_ignore_ascii_case(word.as_bytes()));
    // DWG: AC1015 and its kin.
    if begins("AC10") && text.get(4..6).is_some_and(|digits| digits.iter().all(u8::is_ascii_digit)) {
        return found("an AutoCAD drawing (.dwg)");
    }
    if begins("ISO-10303-21") {
        return found(if holds("IFC") { "an IFC model" } else { "a STEP model" });
    }
    if begins("<") {
        let page = begins("<!doctype html") || begins("<html");
        return match page {
            true => Some(("a web page", "download the file itself")),
            false => found(if holds("<COLLADA") { "a COLLADA model (.dae)" } else { "an XML file" }),
        };
    }
    match text {
        [b'{', ..] => found(if holds("\"asset\"") { "a glTF model (.gltf)" } else { "a JSON file" }),
        [b'p', b'l', b'y', b'\r' | b'\n', ..] if holds("format ") => found("a PLY model"),
        [b'0', b'\r' | b'\n', ..] | [b'9', b'9', b'9', b'\r' | b'\n', ..] if holds("SECTION") => found("a DXF drawing"),
        _ if begins("solid") && holds("facet normal") => found("an STL model"),
        _ => None,
    }
}

/// Text in UTF-16 without a mark: every other byte is 0, as that of plain letters.
fn is_utf_16(head: &[u8]) -> bool {
    let start = &head[..head.len().min(64)];
    let zeros = |first: usize| start.iter().skip(first).step_by(2).all(|&byte| byte == 0);
    let letters = |first: usize| start.iter().skip(first).step_by(2).all(|byte| matches!(byte, b'\t'..=b'~'));
    start.len() >= 8 && ((zeros(1) && letters(0)) || (zeros(0) && letters(1)))
}

/// Refuses a file of another format, where `expected` is wanted.
pub(crate) fn refuse(path: &Path, head: &[u8], length: u64, expected: &str) -> Result<(), InputError> {
    let head = &head[..head.len().min(HEAD)];
    match kind(head, length) {
        Some((what, cure)) => Err(InputError::new(Location::file(path), what, expected).hint(cure)),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(bytes: &[u8]) -> &'static str {
        kind(bytes, bytes.len() as u64).map_or("", |(what, _)| what)
    }

    #[test]
    fn other_formats_are_named() {
        let utf_16 = |text: &str| text.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>();
        let big_endian = |text: &str| text.encode_utf16().flat_map(u16::to_be_bytes).collect::<Vec<u8>>();
        let stl = [&[b' '; 80][..], &2_u32.to_le_bytes(), &[7; 100]].concat();
        let studio = [b"MM".as_slice(), &16_u32.to_le_bytes(), &[2; 10]].concat();
        for (bytes, what) in [
            (utf_16("\u{feff}v 0 0 0\n"), "text in UTF-16"),
            (utf_16("v 0 0 0\nv 1 0 0\n"), "text in UTF-16"),
            (big_endian("v 0 0 0\nv 1 0 0\n"), "text in UTF-16"),
            (stl, "an STL model"),
            (studio, "a 3D Studio model (.3ds)"),
            (b"solid room\n facet normal 0 0 1\n".to_vec(), "an STL model"),
            (b"ply\r\nformat ascii 1.0\r\n".to_vec(), "a PLY model"),
            (b"  0\nSECTION\n  2\nHEADER\n".to_vec(), "a DXF drawing"),
            (b"ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('IFC4'));\n".to_vec(), "an IFC model"),
            (b"{\"asset\": {\"version\": \"2.0\"}}".to_vec(), "a glTF model (.gltf)"),
            (b"<?xml version=\"1.0\"?>\n<COLLADA>".to_vec(), "a COLLADA model (.dae)"),
            (b"<!DOCTYPE html>\n".to_vec(), "a web page"),
            (b"AC1032\0\0".to_vec(), "an AutoCAD drawing (.dwg)"),
            (b"\x1f\x8b\x08\0".to_vec(), "a file compressed by gzip"),
        ] {
            assert_eq!(named(&bytes), what);
        }
    }

    #[test]
    fn what_may_be_an_obj_file_is_not() {
        for text in [
            "",
            "v 0 0 0\n",
            "solid\nv 0 0 0\n",
            "# <html>\n",
            "MM 1\n",
            "0 1\nf 1 2 3\n",
            "ply 3\n",
            "\u{feff}# {\n",
            "# PK",
        ] {
            assert_eq!(named(text.as_bytes()), "", "{text}");
        }
        // As long as an STL file with 0x30302030 triangles would be, was it that long.
        assert_eq!(named(format!("{}0 00", "v 0 0 0\n".repeat(10)).as_bytes()), "");
    }
}
