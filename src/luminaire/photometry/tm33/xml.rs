//! TM-33 as XML.

use std::path::Path;

use roxmltree::{Document as Xml, Node, ParsingOptions};

use super::super::formats;
use super::super::text::{label, quoted};
use super::super::{Choice, Photometry};
use super::{Document, Raw, Tm33Emitter, number, plain};
use crate::error::{InputError, Location};
use crate::files::limits::MOST_NODES;

/// Reads text that begins as XML.
pub(in super::super) fn parse(path: &Path, text: &str, choice: &Choice) -> Result<Photometry, InputError> {
    let xml = tree(path, text)?;
    let reader = XmlReader { path, xml: &xml };
    let root = xml.root_element();
    match plain(root.tag_name().name()).as_str() {
        "iestm3322" | "iestm33" | "luminaireopticaldata" => reader.document(root)?.photometry(path, choice),
        name if name.starts_with("iestm33") => reader.document(root)?.photometry(path, choice),
        "html" => {
            let error = formats::refuse(path, "a page of HTML");
            Err(error.hint("it was likely saved in place of the file that it links to"))
        }
        "root" if reader.child(root, "generaldefinitions").is_some() => {
            let error = formats::refuse(path, "the product.xml of a GLDF file");
            Err(error.hint("give the .gldf itself"))
        }
        _ => Err(formats::refuse(path, &format!("XML that begins with {}", quoted(root.tag_name().name())))),
    }
}

/// Text as a tree of elements. The library neither calls itself for elements in elements nor resolves entities without
/// end; a declared type of document is refused.
pub(in super::super) fn tree<'a>(path: &Path, text: &'a str) -> Result<Xml<'a>, InputError> {
    // Web pages declare a type of document; what they are is told by their first element.
    let is_page = text.trim_start().get(..14).is_some_and(|start| start.eq_ignore_ascii_case("<!doctype html"));
    if is_page {
        let error = formats::refuse(path, "a page of HTML");
        return Err(error.hint("it was likely saved in place of the file that it links to"));
    }
    let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    Xml::parse_with_options(text, options).map_err(|error| {
        let at = Location::line(path, error.pos().row.max(1) as usize);
        let why: String = error.to_string().chars().map(|c| if c.is_control() { ' ' } else { c }).take(200).collect();
        InputError::new(at, format!("broken XML ({why})"), "XML of a photometric file")
    })
}

struct XmlReader<'a> {
    path: &'a Path,
    xml: &'a Xml<'a>,
}

type Element<'a> = Node<'a, 'a>;

impl<'a> XmlReader<'a> {
    fn line(&self, node: Element) -> usize {
        self.xml.text_pos_at(node.range().start).row as usize
    }

    fn children(&self, node: Element<'a>, name: &'static str) -> impl Iterator<Item = Element<'a>> {
        node.children().filter(move |child| child.is_element() && plain(child.tag_name().name()) == name)
    }

    fn child(&self, node: Element<'a>, name: &'static str) -> Option<Element<'a>> {
        self.children(node, name).next()
    }

    /// Text of the first child of one of those names; none where it is empty.
    fn text(&self, node: Element<'a>, names: &[&'static str]) -> Option<&'a str> {
        let texts = names.iter().filter_map(|name| self.child(node, name)).filter_map(|child| child.text());
        texts.map(str::trim).find(|text| !text.is_empty())
    }

    fn label(&self, node: Element<'a>, names: &[&'static str]) -> String {
        self.text(node, names).map(label).unwrap_or_default()
    }

    fn number(&self, node: Element<'a>, names: &[&'static str]) -> Result<Option<f64>, InputError> {
        let children = names.iter().filter_map(|name| self.child(node, name));
        let Some(child) = children.into_iter().find(|child| child.text().is_some_and(|text| !text.trim().is_empty()))
        else {
            return Ok(None);
        };
        let what = child.tag_name().name();
        child.text().map(|text| number(self.path, self.line(child), text, what)).transpose()
    }

    fn document(&self, root: Element<'a>) -> Result<Document, InputError> {
        let mut document = Document { line: self.line(root), ..Document::default() };
        if let Some(header) = self.child(root, "header") {
            document.name = self.label(header, &["description"]);
            document.catalogue = self.label(header, &["catalognumber"]);
            document.manufacturer = self.label(header, &["manufacturer"]);
            let known = ["description", "catalognumber", "manufacturer"];
            for child in header.children().filter(Node::is_element) {
                let text = label(child.text().unwrap_or_default());
                if !known.contains(&plain(child.tag_name().name()).as_str()) && !text.is_empty() {
                    document.remarks.push((label(child.tag_name().name()).to_lowercase(), text));
                }
            }
        }
        if let Some(luminaire) = self.child(root, "luminaire") {
            if let Some(sizes) = self.child(luminaire, "dimensions") {
                let size = |name| Ok(self.number(sizes, &[name])?.unwrap_or(0.0));
                document.dimensions = Some([size("length")?, size("width")?, size("height")?]);
            }
            let openings: Vec<_> = self.children(luminaire, "luminousopening").collect();
            self.areas(&openings, &mut document)?;
        }
        if let Some(equipment) = self.child(root, "equipment") {
            let goniometer = self.child(equipment, "gonioradiometer").or_else(|| self.child(equipment, "goniometer"));
            document.goniometer =
                goniometer.and_then(|node| self.text(node, &["type", "goniometertype"])).map(str::to_owned);
        }
        for emitter in self.children(root, "emitter") {
            document.emitters.push(self.emitter(emitter)?);
            if let Some(faces) = self.child(emitter, "emissionareas") {
                let areas: Vec<_> = faces
                    .descendants()
                    .filter(|node| node.is_element() && plain(node.tag_name().name()).ends_with("area"))
                    .collect();
                self.areas(&areas, &mut document)?;
            }
        }
        Ok(document)
    }

    /// Keeps the luminous area in the bottom face, or the first.
    fn areas(&self, areas: &[Element<'a>], document: &mut Document) -> Result<(), InputError> {
        let bottom = areas.iter().find(|area| plain(area.tag_name().name()) == "bottomarea");
        let Some(&area) = bottom.or(areas.first()) else { return Ok(()) };
        let size = |names: &[&'static str]| Ok::<_, InputError>(self.number(area, names)?.unwrap_or(0.0));
        let sizes = [size(&["length", "diameter"])?, size(&["width", "diameter"])?];
        let shape = plain(self.text(area, &["circular", "shape"]).unwrap_or_default());
        let round = ["true", "1", "circular", "circle", "round", "disc", "disk", "ellipse"].contains(&shape.as_str())
            || self.child(area, "diameter").is_some();
        document.more_areas |= areas.len() > 1 || document.area.is_some_and(|known| known != (sizes, round));
        document.area = document.area.or(Some((sizes, round)));
        Ok(())
    }

    fn emitter(&self, node: Element<'a>) -> Result<Tm33Emitter, InputError> {
        let has = |name| self.child(node, name).is_some();
        let names = ["description", "id", "catalognumber"].map(|name| self.label(node, &[name]));
        let temperature = self.child(node, "colortemperature").unwrap_or(node);
        let rendering = self.child(node, "colorrendering");
        let rendering = rendering.map(|node| self.child(node, "ciecri").unwrap_or(node));
        let table = [("luminousdata", Some("luminousintensity")), ("intensitydistribution", None)]
            .into_iter()
            .find_map(|(name, inner)| {
                let data = self.child(node, name)?;
                Some((data, inner.and_then(|inner| self.child(data, inner)).unwrap_or(data)))
            });
        Ok(Tm33Emitter {
            line: self.line(node),
            names: names.into_iter().filter(|name| !name.is_empty()).collect(),
            quantity: self.number(node, &["quantity"])?,
            rated: self.number(node, &["ratedlumens", "measuredlumens"])?,
            power: self.number(node, &["inputwattage", "inputwatts"])?,
            ballast: self.number(node, &["ballastfactor"])?,
            colour: self.label(temperature, &["fixedcct", "cct"]),
            rendering: rendering.map(|node| self.label(node, &["ra"])).unwrap_or_default(),
            has_tilt: has("tiltangles"),
            has_spectrum: ["spectraldata", "spectraldistribution", "angularspectral", "angularcolor", "radiantdata"]
                .into_iter()
                .any(has),
            table: table.map(|(data, inner)| self.table(data, inner)).transpose()?,
        })
    }

    /// Intensities; `data` is what holds `inner`, which lists them.
    fn table(&self, data: Element<'a>, inner: Element<'a>) -> Result<Raw, InputError> {
        let line = self.line(inner);
        let text = |names: &[&'static str]| self.text(inner, names).or_else(|| self.text(data, names));
        let owned = |names: &[&'static str]| text(names).map(str::to_owned);
        let mut points = Vec::new();
        let is_point =
            |node: &Element| node.is_element() && matches!(node.tag_name().name(), "IntensityData" | "IntData");
        for node in inner.children().filter(is_point) {
            let attribute = |names: [&str; 3]| names.iter().find_map(|name| node.attribute(*name));
            let [h, v] = [["horz", "h", "horizontal"], ["vert", "v", "vertical"]].map(attribute);
            let part = |text: Option<&str>, what: &str| {
                let text = text.unwrap_or_default();
                match text.trim().parse().ok().filter(|number: &f64| number.is_finite()) {
                    Some(number) => Ok(number),
                    None => number(self.path, self.line(node), text, what),
                }
            };
            let point = [part(h, "a horizontal angle")?, part(v, "a vertical angle")?];
            points.push([point[0], point[1], part(node.text(), "an intensity")?]);
        }
        let absolute = text(&["absolutephotometry"]).map(plain);
        Ok(Raw {
            line,
            kind: owned(&["photometrytype"]),
            metric: owned(&["metric"]),
            units: owned(&["units"]),
            symmetry: owned(&["symmtype", "symm"]),
            absolute: absolute.map(|word| word == "true" || word == "1"),
            multiplier: self.number(inner, &["multiplier"])?,
            flux: self.number(data, &["luminousflux"])?,
            points,
        })
    }
}
