//! What `product.xml` of a GLDF says about light.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use roxmltree::{Document, Node};

use super::super::text::{label, quoted};
use super::super::{Choice, Chosen};
use crate::error::{InputError, Location};
use crate::text::listed;

type Element<'a> = Node<'a, 'a>;

/// A product.
#[derive(Default)]
pub(super) struct Product {
    pub(super) name: String,
    pub(super) maker: String,
    /// File of each photometry, or why there is none in the archive, by the photometry's id.
    files: HashMap<String, Result<String, String>>,
    /// Photometries in the order of the file.
    photometries: Vec<String>,
    /// Light of each emitter, by its id; alternatives.
    emitters: HashMap<String, Vec<EmitterMode>>,
    variants: Vec<Variant>,
}

/// One way in which an emitter shines.
#[derive(Clone, Debug, PartialEq)]
struct EmitterMode {
    /// Ids of photometries: one, or one for each channel.
    photometries: Vec<String>,
    /// Of the luminaire, lm.
    flux: Option<f64>,
    /// Of the lamps, lm.
    lamp_flux: Option<f64>,
    only_emergency: bool,
    turned: bool,
}

/// A variant of the product.
struct Variant {
    /// In every language; then its number and id.
    names: Vec<String>,
    /// Emitters' ids, one for each light output.
    outputs: Vec<String>,
}

/// What is read of the archive.
#[derive(Clone, Debug)]
pub(super) struct ArchiveContent {
    pub(super) file: String,
    /// Of the luminaire, lm.
    pub(super) flux: Option<f64>,
    /// Of the lamps, lm.
    pub(super) lamp_flux: Option<f64>,
    /// Whether the choice of a set of lamps chose among the emitter's alternatives.
    pub(super) set_is_chosen: bool,
    /// Name of the variant.
    pub(super) variant: String,
    pub(super) notes: Vec<String>,
}

impl ArchiveContent {
    fn is_same_as(&self, other: &Self, flux_counts: bool) -> bool {
        self.file == other.file && (!flux_counts || (self.flux, self.lamp_flux) == (other.flux, other.lamp_flux))
    }
}

fn children<'a>(node: Element<'a>, name: &'static str) -> impl Iterator<Item = Element<'a>> {
    node.children().filter(move |child| child.tag_name().name() == name)
}

fn child<'a>(node: Element<'a>, name: &'static str) -> Option<Element<'a>> {
    children(node, name).next()
}

/// Elements of that name anywhere below.
fn below<'a>(node: Element<'a>, name: &'static str) -> impl Iterator<Item = Element<'a>> {
    node.descendants().filter(move |node| node.tag_name().name() == name)
}

fn text<'a>(node: Element<'a>, name: &'static str) -> Option<&'a str> {
    child(node, name).and_then(|child| child.text()).map(str::trim).filter(|text| !text.is_empty())
}

/// Names in every language, without repetition.
fn locales(node: Option<Element>) -> Vec<String> {
    let mut seen = HashSet::new();
    let names = node.into_iter().flat_map(|node| below(node, "Locale")).filter_map(|locale| locale.text());
    names.map(label).filter(|name| !name.is_empty() && seen.insert(name.clone())).collect()
}

fn id(node: Element) -> String {
    node.attribute("id").unwrap_or_default().trim().to_owned()
}

impl Product {
    /// Reads the tree of `product.xml`.
    pub(super) fn read(path: &Path, tree: &Document) -> Result<Self, InputError> {
        let root = tree.root_element();
        let (Some(general), Some(definitions)) = (child(root, "GeneralDefinitions"), child(root, "ProductDefinitions"))
        else {
            let found = format!("product.xml that begins with {}", quoted(root.tag_name().name()));
            let expected = "Root with GeneralDefinitions and ProductDefinitions";
            return Err(InputError::new(Location::file(path), found, expected));
        };
        let meta = child(definitions, "ProductMetaData");
        let mut product = Self {
            name: locales(meta.and_then(|meta| child(meta, "Name"))).into_iter().next().unwrap_or_default(),
            maker: child(root, "Header").and_then(|header| text(header, "Manufacturer")).map(label).unwrap_or_default(),
            ..Self::default()
        };
        product.read_files(general);
        product.read_emitters(path, tree, general)?;
        for variant in below(definitions, "Variant") {
            let mut names = locales(child(variant, "Name"));
            names.extend(locales(child(variant, "ProductNumber")));
            names.push(id(variant));
            let outputs = child(variant, "Geometry").map(|geometry| product.outputs(geometry)).unwrap_or_default();
            product.variants.push(Variant { names, outputs });
        }
        Ok(product)
    }

    fn read_files(&mut self, general: Element) {
        let mut files = HashMap::new();
        for file in below(general, "File") {
            let name = file.text().unwrap_or_default().trim().to_owned();
            let is_elsewhere = file.attribute("type") == Some("url");
            let found = if is_elsewhere { Err(format!("at {}", quoted(&name))) } else { Ok(name) };
            files.insert(id(file), found);
        }
        for photometry in below(general, "Photometry") {
            let reference = child(photometry, "PhotometryFileReference").and_then(|node| node.attribute("fileId"));
            let file = match reference.and_then(|id| files.get(id.trim())) {
                Some(Ok(name)) => Ok(name.clone()),
                Some(Err(place)) => Err(format!("a photometry that isn't in the archive but {place}")),
                None => Err("a photometry without a file".to_owned()),
            };
            self.photometries.push(id(photometry));
            self.files.insert(id(photometry), file);
        }
    }

    fn read_emitters(&mut self, path: &Path, tree: &Document, general: Element) -> Result<(), InputError> {
        let number = |node: Element, name| -> Result<Option<f64>, InputError> {
            let Some(text) = text(node, name) else { return Ok(None) };
            let value = text.parse().ok().filter(|value: &f64| (0.0..=1e12).contains(value));
            let refuse = || {
                let line = tree.text_pos_at(node.range().start).row as usize;
                InputError::new(Location::line(path, line), format!("{name} {}", quoted(text)), "lm, from 0 up")
            };
            value.map(Some).ok_or_else(refuse)
        };
        // Channels of light sources, flux of light sources, and that of equipments.
        let (mut channels, mut sources, mut equipments) = (HashMap::new(), HashMap::new(), HashMap::new());
        for source in below(general, "MultiChannelLightSource") {
            let references = below(source, "PhotometryReference").filter_map(|node| node.attribute("photometryId"));
            channels.insert(id(source), references.map(str::to_owned).collect::<Vec<_>>());
        }
        for source in below(general, "ChangeableLightSource") {
            sources.insert(id(source), number(source, "RatedLuminousFlux")?);
        }
        for equipment in below(general, "Equipment") {
            let Some(reference) = child(equipment, "LightSourceReference") else { continue };
            let count: f64 = reference.attribute("lightSourceCount").and_then(|text| text.parse().ok()).unwrap_or(1.0);
            let flux = reference.attribute("changeableLightSourceId").and_then(|id| *sources.get(id)?);
            let flux = flux.map(|flux: f64| flux * count).filter(|flux| *flux > 0.0 && *flux <= 1e12);
            equipments.insert(id(equipment), flux);
        }
        for emitter in below(general, "Emitter") {
            let mut lights = Vec::new();
            for node in emitter.children().filter(|node| node.is_element() && node.tag_name().name() != "SensorEmitter")
            {
                let own = node.attribute("photometryId");
                let own = own.or_else(|| child(node, "PhotometryReference")?.attribute("photometryId"));
                let source = child(node, "LightSourceReference");
                let source = source.and_then(|node| channels.get(node.attribute("multiChannelLightSourceId")?));
                let photometries = own.map(|id| vec![id.to_owned()]).or_else(|| source.cloned()).unwrap_or_default();
                if photometries.is_empty() {
                    continue;
                }
                let equipment = child(node, "EquipmentReference").and_then(|node| node.attribute("equipmentId"));
                let turn = child(node, "Rotation");
                let angles = turn.into_iter().flat_map(|turn| turn.children().filter_map(|node| node.text()));
                lights.push(EmitterMode {
                    photometries,
                    flux: number(node, "RatedLuminousFlux")?.filter(|flux| *flux > 0.0),
                    lamp_flux: equipment.and_then(|id| *equipments.get(id)?),
                    only_emergency: node.attribute("emergencyBehaviour") == Some("EmergencyOnly"),
                    turned: angles.filter_map(|text| text.trim().parse::<f64>().ok()).any(|angle| angle % 360.0 != 0.0),
                });
            }
            lights.sort_by_key(|light| light.only_emergency);
            lights.dedup();
            self.emitters.insert(id(emitter), lights);
        }
        Ok(())
    }

    /// Emitters' ids, one for each light output of a variant. Models of several kinds show the same outputs: one
    /// counts.
    fn outputs(&self, geometry: Element) -> Vec<String> {
        let mut models: Vec<(String, Vec<(String, String)>)> = Vec::new();
        for node in geometry.descendants().filter(Node::is_element) {
            let Some(emitter) = node.attribute("emitterId").map(str::trim) else { continue };
            if self.emitters.get(emitter).is_none_or(Vec::is_empty) {
                continue;
            }
            let holder = node.parent().map_or("", |node| node.tag_name().name());
            let model =
                format!("{} {holder} {}", node.tag_name().name(), node.attribute("targetModelType").unwrap_or(""));
            let object = text(node, "EmitterObjectExternalName").unwrap_or_default();
            let output = (emitter.to_owned(), object.to_owned());
            let index = models.iter().position(|(known, _)| *known == model).unwrap_or_else(|| {
                models.push((model, Vec::new()));
                models.len() - 1
            });
            if !models[index].1.contains(&output) {
                models[index].1.push(output);
            }
        }
        let most = models.into_iter().map(|(_, outputs)| outputs).max_by_key(Vec::len).unwrap_or_default();
        most.into_iter().map(|(emitter, _)| emitter).collect()
    }

    /// The file to read, and what else counts.
    pub(super) fn choose(&self, path: &Path, choice: &Choice) -> Result<ArchiveContent, InputError> {
        match &choice.variant {
            Some(variant) => self.named(path, variant, choice),
            None => self.only(path, choice),
        }
    }

    /// Variants that shine.
    fn lit(&self) -> impl Iterator<Item = &Variant> {
        self.variants.iter().filter(|variant| !variant.outputs.is_empty())
    }

    /// Names by which variants can be told apart.
    fn list(&self) -> String {
        let first = |variant: &Variant| variant.names.first().cloned().unwrap_or_default();
        let unique = |name: &str| self.lit().filter(|variant| first(variant) == name).count() == 1;
        let name = |variant: &Variant| {
            let name = first(variant);
            if unique(&name) { name } else { variant.names.last().cloned().unwrap_or_default() }
        };
        let names: Vec<String> = self.lit().map(name).collect();
        listed(names.iter().map(String::as_str))
    }

    fn named(&self, path: &Path, wanted: &Chosen<String>, choice: &Choice) -> Result<ArchiveContent, InputError> {
        let name = wanted.value.trim();
        let matches = |same: fn(&str, &str) -> bool| {
            self.lit().filter(|variant| variant.names.iter().any(|own| same(own, name))).collect::<Vec<_>>()
        };
        let mut found = matches(|own, name| own == name);
        if found.is_empty() {
            found = matches(|own, name| own.to_lowercase() == name.to_lowercase());
        }
        let refuse = |expected: String| {
            let found = format!("variant = {}", quoted(name));
            Err(InputError::new(wanted.at.clone(), found, expected))
        };
        let Some((first, others)) = found.split_first() else {
            let files = self.files.values().filter_map(|file| file.as_deref().ok());
            return match files.into_iter().find(|file| file.eq_ignore_ascii_case(name)) {
                Some(file) => Ok(ArchiveContent {
                    file: file.to_owned(),
                    flux: None,
                    lamp_flux: None,
                    set_is_chosen: false,
                    variant: String::new(),
                    notes: Vec::new(),
                }),
                None if self.lit().next().is_none() => refuse(format!("a file of the archive: {}", self.file_list())),
                None => refuse(format!("one of {}", self.list())),
            };
        };
        let output = self.output(path, first, choice)?;
        for other in others {
            if !self.output(path, other, choice)?.is_same_as(&output, !choice.flux_is_told) {
                let ids = listed(found.iter().filter_map(|variant| variant.names.last()).map(String::as_str));
                return refuse(format!("a name of one variant; {} have this one, of ids {ids}", found.len()));
            }
        }
        Ok(output)
    }

    /// The one light that all variants have.
    fn only(&self, path: &Path, choice: &Choice) -> Result<ArchiveContent, InputError> {
        if self.lit().next().is_none() {
            return self.only_photometry(path);
        }
        let mut outputs = self.lit().map(|variant| self.output(path, variant, choice));
        let first = outputs.next().transpose();
        let alike = |output: Result<ArchiveContent, InputError>| match (&first, output) {
            (Ok(Some(first)), Ok(output)) => output.is_same_as(first, !choice.flux_is_told),
            _ => false,
        };
        if outputs.all(alike) {
            if let Some(mut output) = first? {
                if self.lit().count() > 1 {
                    output.variant = String::new();
                }
                return Ok(output);
            }
            return self.only_photometry(path);
        }
        let found = format!("{} variants of different light", self.lit().count());
        let error = InputError::new(Location::file(path), found, format!("a choice of one: {}", self.list()));
        Err(error.hint("variant = \"…\" in [[luminaire]] chooses"))
    }

    /// The one photometry of a product without variants that shine.
    fn only_photometry(&self, path: &Path) -> Result<ArchiveContent, InputError> {
        let refuse = |found: String, expected: String| Err(InputError::new(Location::file(path), found, expected));
        let mut files = self.photometries.iter().filter_map(|id| self.files.get(id));
        match (files.next(), files.next()) {
            (Some(Ok(file)), None) => Ok(ArchiveContent {
                file: file.clone(),
                flux: None,
                lamp_flux: None,
                set_is_chosen: false,
                variant: String::new(),
                notes: Vec::new(),
            }),
            (Some(Err(why)), None) => refuse(why.clone(), "a file in the archive".into()),
            (None, _) => refuse("a product without photometry".into(), "a GLDF file of a luminaire".into()),
            _ => refuse(format!("{} photometries", self.photometries.len()), format!("a choice: {}", self.file_list())),
        }
    }

    fn file_list(&self) -> String {
        let files =
            self.photometries.iter().filter_map(|id| self.files.get(id)).filter_map(|file| file.as_deref().ok());
        listed(files)
    }

    /// What a variant's light is.
    fn output(&self, path: &Path, variant: &Variant, choice: &Choice) -> Result<ArchiveContent, InputError> {
        let name = variant.names.first().cloned().unwrap_or_default();
        let refuse = |found: String, expected: &str| {
            let error = InputError::new(Location::file(path), format!("variant {}, {found}", quoted(&name)), expected);
            let files = self.file_list();
            let hint = format!("variant may name one of the files, which then counts as it stands: {files}");
            Err(if files.is_empty() { error } else { error.hint(hint) })
        };
        let [emitter] = variant.outputs.as_slice() else {
            let found = format!("which has {} light outputs in places of its 3D model", variant.outputs.len());
            return refuse(found, "one");
        };
        let lights = self.emitters.get(emitter).map(Vec::as_slice).unwrap_or_default();
        let mut notes = Vec::new();
        let (set, set_is_chosen) = match (&choice.lamp_set, lights.len()) {
            (Some(set), more) if more > 1 => (set.within(more, path)?, true),
            (None, more) if more > 1 => {
                notes.push(format!(
                    "{more} light emitters of variant {}, alternatives; the first is taken",
                    quoted(&name)
                ));
                (0, false)
            }
            _ => (0, false),
        };
        let Some(light) = lights.get(set) else { return refuse("without light".into(), "a light emitter") };
        if light.turned {
            return refuse("whose emitter is turned".into(), "an emitter that isn't turned");
        }
        let [photometry] = light.photometries.as_slice() else {
            return refuse(format!("with a light source of {} channels", light.photometries.len()), "one channel");
        };
        match self.files.get(photometry) {
            Some(Ok(file)) => Ok(ArchiveContent {
                file: file.clone(),
                flux: light.flux,
                lamp_flux: light.lamp_flux,
                set_is_chosen,
                variant: name,
                notes,
            }),
            Some(Err(why)) => refuse(format!("with {why}"), "a file in the archive"),
            None => refuse(format!("whose photometry {} is missing", quoted(photometry)), "one of the product's"),
        }
    }
}
