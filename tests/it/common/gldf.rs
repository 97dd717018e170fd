//! GLDF files made up: archives, and what their `product.xml` says.
#![allow(dead_code, unreachable_pub, reason = "each test file uses its own part")]

use std::io::{Cursor, Write as _};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// An archive of files with these names.
pub fn archive(files: &[(&str, &[u8])], method: CompressionMethod) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, content) in files {
        zip.start_file(*name, SimpleFileOptions::default().compression_method(method)).expect("memory takes it");
        zip.write_all(content).expect("memory takes it");
    }
    zip.finish().expect("memory takes it").into_inner()
}

/// A product: its files (id, content type, name), emitters (id and what is in them) and variants (id, name, geometry).
pub fn product(
    files: &[(&str, &str, &str)],
    emitters: &[(&str, &str)],
    variants: &[(&str, &str, &str)],
    light_sources: &str,
) -> String {
    let files = |form: fn(&(&str, &str, &str)) -> String| files.iter().map(form).collect::<String>();
    let named = files(|(id, kind, name)| {
        format!("<File id=\"{id}\" contentType=\"{kind}\" type=\"localFileName\">{name}</File>")
    });
    let photometries =
        files(|(id, ..)| format!("<Photometry id=\"p_{id}\"><PhotometryFileReference fileId=\"{id}\"/></Photometry>"));
    let emitters: String =
        emitters.iter().map(|(id, inner)| format!("<Emitter id=\"{id}\">{inner}</Emitter>")).collect();
    let variants: String = variants
        .iter()
        .map(|(id, name, geometry)| {
            format!(
                "<Variant id=\"{id}\"><Name><Locale language=\"en\">{name}</Locale></Name>\
                 <Geometry>{geometry}</Geometry></Variant>"
            )
        })
        .collect();
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<Root><Header><Manufacturer>Maker</Manufacturer></Header>\
         <GeneralDefinitions><Files>{named}</Files><Photometries>{photometries}</Photometries>{light_sources}\
         <Emitters>{emitters}</Emitters></GeneralDefinitions><ProductDefinitions><ProductMetaData><Name>\
         <Locale language=\"en\">Product</Locale></Name></ProductMetaData><Variants>{variants}</Variants>\
         </ProductDefinitions></Root>"
    )
}

/// A fixed emitter of a photometry, with its rated flux.
pub fn fixed(photometry: &str, flux: f64) -> String {
    format!(
        "<FixedLightEmitter><PhotometryReference photometryId=\"p_{photometry}\"/>\
         <RatedLuminousFlux>{flux}</RatedLuminousFlux></FixedLightEmitter>"
    )
}

/// A geometry that shows an emitter.
pub fn shows(emitter: &str) -> String {
    format!("<EmitterReference emitterId=\"{emitter}\"/>")
}
