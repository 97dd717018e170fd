//! What no input may do, however it came about: one function for each kind of file, which reads it as luxmap does and goes on
//! from there as far as is quick. Each holds luxmap to its promise: a refusal in one line, or a result without a NaN.
//!
//! Both `tests/it/hostile.rs` and the targets in `fuzz/` call these functions.
#![allow(dead_code, unreachable_pub, reason = "each fuzz target uses its own part")]

#[path = "gldf.rs"]
pub mod gldf;

use std::fmt::Display;
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes, LineOrder,
    Vec2, WritableImage as _, f16,
};
use glam::DVec3;
use luxmap::luminaire::photometry::Photometry;
use luxmap::luminaire::web::Web;
use luxmap::render::plan::{Method, Plan};
use luxmap::render::{Keeping, Settings, memory, render_and_keep};
use luxmap::report::ExtraLayers;
use luxmap::scene::{MeasuringPlane, PlaneKind, Scene, read_obj_both_ways};
use luxmap::study::convergence::reference::Reference;
use sha2::{Digest, Sha256};
use zip::CompressionMethod;

/// What became of an input: a refusal, in its own words, or something of use.
pub type Outcome = Result<(), String>;

/// Before the first input of a fuzz target: rayon works on the calling thread only, as coverage of one input must not depend
/// on others, and inputs to begin with are written to the folder that the variable `LUXMAP_SEEDS` names.
pub fn begin(target: &str) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread();
    pool.build_global().expect("no pool is there yet");
    if let Some(folder) = std::env::var_os("LUXMAP_SEEDS") {
        for (number, seed) in made_up(target).iter().enumerate() {
            write(Path::new(&folder), &format!("made-up-{number}"), seed);
        }
    }
}

/// Inputs to begin with that no file holds.
pub fn made_up(target: &str) -> Vec<Vec<u8>> {
    match target {
        "scene" => sound_scenes(),
        "reference" => images(),
        "gldf" => archives(),
        "tm33" => documents(),
        "checkpoint" => (0..KNOWN.len()).flat_map(|which| [sound_sums(which), sound_state(which)]).collect(),
        _ => Vec::new(),
    }
}

/// Scenes that are sound, each of a few sections.
fn sound_scenes() -> Vec<Vec<u8>> {
    let whole = include_str!("../../hostile/scene/every-key.toml");
    let sections: Vec<&str> = whole.split("\n\n").collect();
    let with = |heads: &[&str]| -> Vec<u8> {
        let wanted = |section: &&&str| heads.iter().any(|head| section.starts_with(head));
        sections.iter().filter(wanted).copied().collect::<Vec<_>>().join("\n").into_bytes()
    };
    vec![
        with(&["[[luminaire]]", "[[sensor]]", "[render]"]),
        with(&["[[luminaire]]", "[[plane]]", "[[plane.task]]", "name"]),
        with(&["[[mesh]]", "[material", "[[luminaire]]", "[[surface]]"]),
        with(&["[[mesh]]", "[[luminaire]]", "[[camera]]"]),
    ]
}

/// EXR files of 4 × 3 cells: every compression, scan lines and tiles, whole and half numbers, with and without σ.
fn images() -> Vec<Vec<u8>> {
    let kinds = [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::B44A,
    ];
    let tiles = Blocks::Tiles(Vec2(2, 2));
    let all = kinds.into_iter().flat_map(|kind| [(kind, Blocks::ScanLines), (kind, tiles)]);
    let image = |(number, (compression, blocks)): (usize, (Compression, Blocks))| {
        let cells = || (0..12).map(|cell| 100.0 + cell as f32);
        let samples = match number % 3 {
            0 => FlatSamples::F32(cells().collect()),
            1 => FlatSamples::F16(cells().map(f16::from_f32).collect()),
            _ => FlatSamples::U32(cells().map(|cell| cell as u32).collect()),
        };
        let names: &[&str] = if number % 2 == 0 { &["A", "Y", "stderr.Y"] } else { &["B", "G", "R"] };
        let channels = names.iter().map(|name| AnyChannel::new(*name, samples.clone())).collect();
        let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
        let layer = Layer::new((4, 3), LayerAttributes::default(), encoding, AnyChannels::sort(channels));
        let mut out = Cursor::new(Vec::new());
        Image::from_layer(layer).write().to_buffered(&mut out).expect("memory takes it");
        out.into_inner()
    };
    all.enumerate().map(image).collect()
}

/// Archives, and what `product.xml` may say; see [`gldf`].
fn archives() -> Vec<Vec<u8>> {
    let files = [("a", "ldc/eulumdat", "lamp.ldt"), ("b", "ldc/ies", "lamp.ies")];
    let (fixed, shows) = (gldf::fixed("a", 4000.0), gldf::shows("e"));
    let one = gldf::product(&files, &[("e", &fixed)], &[("v1", "White", &shows)], "");
    let sources = "<LightSources><ChangeableLightSource id=\"s\"><RatedLuminousFlux>500</RatedLuminousFlux>\
                   </ChangeableLightSource></LightSources><Equipments><Equipment id=\"q\"><LightSourceReference \
                   changeableLightSourceId=\"s\" lightSourceCount=\"2\"/></Equipment></Equipments>";
    let changeable = "<ChangeableLightEmitter><Rotation><X>0</X></Rotation><PhotometryReference photometryId=\"p_b\"/>\
                      <EquipmentReference equipmentId=\"q\"/></ChangeableLightEmitter>";
    let other = gldf::product(&files, &[("e", changeable)], &[("v1", "A", &shows), ("v2", "B", &shows)], sources);
    let archive = |product: &str, method| {
        let files = [("product.xml", product.as_bytes()), ("ldc/lamp.ldt", LDT), ("ldc/lamp.ies", IES)];
        gldf::archive(&files, method)
    };
    let stored = archive(&one, CompressionMethod::Stored);
    let deflated = archive(&other, CompressionMethod::Deflated);
    vec![one.into_bytes(), other.into_bytes(), stored, deflated]
}

/// TM-33 in its dialects.
fn documents() -> Vec<Vec<u8>> {
    let points = |element: &str, [h, v]: [&str; 2]| -> String {
        let all = [0, 90].into_iter().flat_map(|plane| [(plane, 0, 300), (plane, 45, 200), (plane, 90, 0)]);
        all.map(|(c, g, cd)| format!("<{element} {h}=\"{c}\" {v}=\"{g}\">{cd}</{element}>\n")).collect()
    };
    let new = format!(
        "<?xml version=\"1.0\"?>\n<IESTM33-22><Version>1.1</Version><Header><Description>Lamp</Description></Header>\
         <Luminaire><Dimensions><Length>600</Length><Width>300</Width><Height>50</Height></Dimensions></Luminaire>\
         <Emitter><Quantity>2</Quantity><Description>LED</Description><RatedLumens>700</RatedLumens><BallastFactor>0.9\
         </BallastFactor><LuminousData><LuminousIntensity><Symm>Symm _ Quad</Symm><Multiplier>1.5</Multiplier>{}\
         </LuminousIntensity><LuminousFlux>450</LuminousFlux></LuminousData><SpectralData/></Emitter></IESTM33-22>",
        points("IntData", ["h", "v"])
    );
    let old = format!(
        "<LuminaireOpticalData version=\"1.0\" xmlns=\"http://www.ies.org/tm-33\"><Header/><Emitter><ID>a</ID>\
         <IntensityDistribution><PhotometryType>C</PhotometryType><Units>cd/klm</Units>{}</IntensityDistribution>\
         <RatedLumens>700</RatedLumens></Emitter></LuminaireOpticalData>",
        points("IntensityData", ["horz", "vert"])
    );
    let json = "{\"header\": {\"description\": \"Lamp\"}, \"luminaire\": {\"dimensions\": {\"length\": 600, \"width\": 300}}, \
                \"emitters\": [{\"id\": \"a\", \"quantity\": 1, \"ratedLumens\": 700, \"intensityDistribution\": \
                {\"photometryType\": \"C\", \"horizontalAngles\": [0, 90], \"verticalAngles\": [0, 45, 90], \
                \"intensities\": [300, 200, 0, 300, 100, 0]}}]}";
    vec![new.into_bytes(), old.into_bytes(), json.as_bytes().to_vec()]
}

/// A refusal as it is printed: one line that a terminal can show, and not a page of it.
fn refusal(error: impl Display) -> String {
    let line = error.to_string();
    assert!(!line.is_empty() && !line.contains(char::is_control), "not one line: {line:?}");
    assert!(line.chars().count() < 2000, "not a line one reads: {line:?}");
    line
}

/// A folder for the files of this process.
fn folder(target: &str) -> PathBuf {
    let folder = match option_env!("CARGO_TARGET_TMPDIR") {
        Some(folder) => Path::new(folder).join("hostile-inputs").join(target),
        None => std::env::temp_dir().join(format!("luxmap-hostile-{}-{target}", std::process::id())),
    };
    fs::create_dir_all(&folder).expect("the folder for temporary files is writable");
    folder
}

fn write(folder: &Path, name: &str, content: &[u8]) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, content).expect("the folder for temporary files is writable");
    path
}

const ROOM: &str = "mtllib room.mtl\nv 0 0 0\nv 4 0 0\nv 4 3 0\nv 0 3 0\nv 0 0 2.5\nv 4 0 2.5\nv 4 3 2.5\nv 0 3 2.5\n\
    usemtl floor\ng flat\nf 1 2 3 4\nusemtl wall\ng round\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\nusemtl lamp\nf 5 8 7 6\n";
const MTL: &str = "newmtl floor\nKd 0.2 0.2 0.2\nnewmtl wall\nKd 0.5 0.5 0.5\nnewmtl lamp\nKd 0.8 0.8 0.8\n";
const IES: &[u8] = include_bytes!("../../material/photometric-viewer/ellipsoid_opening_along_width.ies");
const LDT: &[u8] = include_bytes!("../../material/photometric-viewer/multiple_lamp_sets.ldt");

/// A scene file, beside a mesh `room.obj` and photometric files `lamp.ies` and `lamp.ldt`; then what every method plans to do
/// with it, and how much memory that takes.
pub fn scene(input: &[u8]) -> Outcome {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = folder("scene");
        write(&folder, "room.obj", ROOM.as_bytes());
        write(&folder, "room.mtl", MTL.as_bytes());
        write(&folder, "lamp.ies", IES);
        write(&folder, "lamp.ldt", LDT);
        folder
    });
    let scene = Scene::load(&write(folder, "scene.toml", input)).map_err(refusal)?;
    check_scene(&scene);
    Ok(())
}

/// What may be relied on once a scene is loaded.
fn check_scene(scene: &Scene) {
    scene.warnings.iter().for_each(|warning| drop(refusal(warning)));
    let vertices = scene.mesh.vertices.as_flattened();
    assert!(vertices.iter().all(|number| number.is_finite()), "a vertex");
    let corners = scene.mesh.triangles.as_flattened();
    assert!(corners.iter().all(|&corner| (corner as usize) < scene.mesh.vertices.len()), "a corner");
    for luminaire in &scene.luminaires {
        assert!(luminaire.flux.0 > 0.0 && luminaire.flux.0.is_finite(), "{}: {:?}", luminaire.name, luminaire.flux);
        assert!(luminaire.colour.iter().all(|part| part.is_finite() && *part >= 0.0), "{:?}", luminaire.colour);
        assert!(luminaire.opening.middle().is_finite());
    }
    for material in &scene.materials {
        let shares = [material.reflectance, material.specular, material.transmittance];
        let sums = [0, 1, 2].map(|channel| shares.iter().map(|share| share[channel]).sum::<f64>());
        assert!(sums.iter().all(|sum| (0.0..=1.0 + 1e-9).contains(sum)), "{material:?}");
    }
    for plane in &scene.planes {
        assert!(plane.normal().is_finite() && plane.point(plane.len() - 1).is_finite(), "{plane:?}");
    }
    assert!(scene.sensors.iter().all(|sensor| sensor.position.is_finite() && sensor.normal.is_normalized()));
    for surface in &scene.surfaces {
        assert!(surface.samples.iter().all(|sample| sample.centre().is_finite() && sample.area() > 0.0));
    }
    for figure in [scene.diagonal(), scene.half_extent(), scene.measured_share()] {
        assert!(figure.is_finite() && figure >= 0.0, "{figure}");
    }
    assert!(scene.smallest_detail() > 0.0);
    // All methods plan alike for many luminaires.
    let methods = if scene.luminaires.len() > 1000 { 1 } else { Method::ALL.len() };
    for (_, method) in Method::ALL.into_iter().take(methods) {
        let plan = Plan::new(scene, method);
        assert!(!plan.to_string().contains("NaN"));
        let mut settings = Settings::for_plan(&plan);
        if let Err(error) = memory::fit(scene, &plan, &mut settings, Some(1.0)) {
            refusal(error);
        }
    }
}

/// An OBJ file, by both readers.
pub fn obj(input: &[u8]) -> Outcome {
    read_obj_both_ways(input).0.map(drop).map_err(refusal)
}

/// An MTL file, which begins within a material that a mesh uses.
pub fn mtl(input: &[u8]) -> Outcome {
    static SCENE: OnceLock<PathBuf> = OnceLock::new();
    let scene = SCENE.get_or_init(|| {
        let folder = folder("mtl");
        write(&folder, "mesh.obj", b"mtllib mesh.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl a\nf 1 2 3\n");
        let scene = "[[mesh]]\nfile = \"mesh.obj\"\n[[luminaire]]\nname = \"L\"\nposition = [0, 0, 2]\nflux = 1\n\
                     [[sensor]]\nname = \"s\"\nposition = [0, 0, 1]\nnormal = [0, 0, 1]\n";
        write(&folder, "scene.toml", scene.as_bytes())
    });
    let folder = scene.parent().expect("it is in a folder");
    write(folder, "mesh.mtl", &[b"newmtl a\n", input].concat());
    check_scene(&Scene::load(scene).map_err(refusal)?);
    Ok(())
}

/// A photometric file whose content tells its format, else `.ies`.
pub fn ies(input: &[u8]) -> Outcome {
    photometry("lamp.ies", input)
}

/// The same, else `.ldt`.
pub fn ldt(input: &[u8]) -> Outcome {
    photometry("lamp.ldt", input)
}

/// A GLDF: a zip archive as it is, and anything else as the `product.xml` of one that holds `lamp.ldt` and `lamp.ies`.
pub fn gldf(input: &[u8]) -> Outcome {
    if input.starts_with(b"PK") {
        return photometry("lamp.gldf", input);
    }
    let files = [("product.xml", input), ("ldc/lamp.ldt", LDT), ("ldc/lamp.ies", IES)];
    photometry("lamp.gldf", &gldf::archive(&files, CompressionMethod::Stored))
}

/// A file of TM-33, XML or JSON.
pub fn tm33(input: &[u8]) -> Outcome {
    photometry("lamp.xml", input)
}

/// Read, asked for its intensity all around, and directions drawn from it.
fn photometry(name: &str, input: &[u8]) -> Outcome {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = folder("photometry");
        write(&folder, "tilt", b"1\n3\n0 45 90\n1 0.9 0.8\n");
        folder
    });
    let found = Photometry::parse(&folder.join(name), input).map_err(refusal)?;
    found.notes.iter().for_each(|note| drop(refusal(note)));
    let opening = &found.opening;
    let sizes = [opening.c0, opening.c90, opening.height];
    assert!(sizes.iter().all(|size| size.is_finite() && *size >= 0.0), "{opening:?}");
    let flux = found.intensity.flux();
    assert!(flux.is_finite(), "{flux} lm");
    for c in 0..24 {
        for gamma in 0..=12 {
            let candela = found.intensity.at(15.0 * f64::from(c), 15.0 * f64::from(gamma));
            assert!(candela.is_finite() && candela >= 0.0, "{candela} cd");
        }
    }
    let Some(web) = Web::new(found.intensity) else { return Err("no light".to_owned()) };
    assert!(web.flux() > 0.0 && web.most().is_finite() && web.scale() > 0.0, "{} {}", web.most(), web.scale());
    for i in 0..64 {
        let part = |by: f64| (f64::from(i) * by + 0.1).fract();
        let direction = web.sample([part(0.618), part(0.755), part(0.570)]);
        assert!(direction.is_normalized(), "{direction}");
        assert!(web.at(direction).is_finite());
    }
    Ok(())
}

/// A reference map: an EXR file where it begins as one, else CSV.
pub fn reference(input: &[u8]) -> Outcome {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| folder("reference"));
    let name = if input.starts_with(b"\x76\x2f\x31\x01") { "floor.exr" } else { "floor.csv" };
    let reference = Reference::read(&write(folder, name, input), &plane_of_references()).map_err(refusal)?;
    let numbers = [&reference.illuminance, &reference.standard_error];
    assert!(numbers.iter().all(|numbers| numbers.len() == 12 && numbers.iter().all(|number| number.is_finite())));
    assert!(reference.has_value.len() == 12 && reference.standard_error.iter().all(|&error| error >= 0.0));
    Ok(())
}

/// The plane whose references are read: 4 × 3 cells.
pub fn plane_of_references() -> MeasuringPlane {
    MeasuringPlane {
        name: "floor".into(),
        corner: DVec3::ZERO,
        along: 4.0 * DVec3::X,
        across: 3.0 * DVec3::Y,
        cells: [4, 3],
        kind: PlaneKind::Surface,
        areas: Default::default(),
    }
}

/// A scene whose states are read, and one of its states.
struct Known {
    scene: Scene,
    plan: Plan,
    settings: Settings,
    /// Up to where the sums begin.
    words: Vec<u8>,
    sums: Vec<u8>,
}

/// What a state begins with.
const MAGIC: &[u8] = b"luxmap state 4\n";

/// Methods, and whether the scene has a mirror and a camera, of the states that are read.
const KNOWN: [(Method, bool); 4] =
    [(Method::Gather, false), (Method::Split, true), (Method::Photons, false), (Method::Gather, true)];

fn known(which: usize) -> &'static Known {
    static ALL: [OnceLock<Known>; KNOWN.len()] = [const { OnceLock::new() }; KNOWN.len()];
    ALL[which].get_or_init(|| {
        let (method, shines) = KNOWN[which];
        let folder = folder(&format!("checkpoint-{which}"));
        write(&folder, "room.obj", ROOM.replace("mtllib room.mtl\n", "").as_bytes());
        let camera = "[[camera]]\nname = \"view\"\neye = [0.3, 0.3, 1.6]\nlook_at = [4, 2, 0.8]\nfov = 60\npixels = [2, 2]\n";
        let toml = format!(
            "[[mesh]]\nfile = \"room.obj\"\n[material.wall]\nreflectance = [0.7, 0.5, 0.4]\n[material.lamp]\n\
             reflectance = 0.4\n[material.floor]\nreflectance = 0.2\n{}[render]\ngroups = true\n\
             [[luminaire]]\nname = \"a\"\nposition = [1, 1.5, 2.4]\nopening = {{ rectangle = [0.6, 0.6] }}\nflux = 3000\n\
             [[luminaire]]\nname = \"b\"\nposition = [3, 0.5, 1.5]\nopening = \"point\"\nflux = 800\n\
             [[plane]]\nname = \"floor\"\ncorner = [0, 0, 0]\nalong = [4, 0, 0]\nacross = [0, 3, 0]\ncells = [2, 2]\n\
             [[sensor]]\nname = \"s\"\nposition = [2, 2, 1]\nnormal = [0, 0, 1]\n{}",
            if shines { "specular = 0.5\n" } else { "" },
            if shines { camera } else { "" },
        );
        let scene = Scene::load(&write(&folder, "scene.toml", toml.as_bytes())).expect("a sound scene");
        let plan = Plan::new(&scene, method);
        let settings = Settings { photons: 40, rays: 1, smooth: false, groups: true, ..Settings::of(method) };
        let checkpoint = folder.join("known.state");
        let _ = fs::remove_file(&checkpoint); // of an earlier run of the tests
        let keeping = Keeping { checkpoint: Some(&checkpoint), ..Default::default() };
        render_and_keep(&scene, &plan, &settings, &(), &keeping).expect("a sound run");
        let state = fs::read(checkpoint).expect("it was written");
        let length = u64::from_le_bytes(state[MAGIC.len()..][..8].try_into().expect("eight bytes")) as usize;
        let (words, sums) = state[..state.len() - 32].split_at(MAGIC.len() + 8 + length);
        Known { words: words.to_vec(), sums: sums.to_vec(), scene, plan, settings }
    })
}

/// Sums of a sound state as an input of [`checkpoint`].
pub fn sound_sums(which: usize) -> Vec<u8> {
    [&[which as u8][..], &known(which).sums].concat()
}

/// A sound state as an input of [`checkpoint`].
pub fn sound_state(which: usize) -> Vec<u8> {
    [&[which as u8 | 4][..], &known(which).words[MAGIC.len()..], &known(which).sums].concat()
}

/// A state, merged as `luxmap merge` does it. The first byte tells of which scene, and what follows: sums (0 … 3), all behind
/// the format's name (4 … 7), both with the checksum that they need; or the file as it is (8 and up).
pub fn checkpoint(input: &[u8]) -> Outcome {
    let Some((&kind, rest)) = input.split_first() else { return Err("nothing".into()) };
    let which = usize::from(kind % 4);
    let known = known(which);
    let mut state = match kind / 4 {
        0 => [&known.words, rest].concat(),
        1 => [MAGIC, rest].concat(),
        _ => rest.to_vec(),
    };
    if kind < 8 {
        let checksum = Sha256::digest(&state);
        state.extend_from_slice(&checksum);
    }
    let folder = known.scene.file.parent().expect("it is in a folder");
    let states = [write(folder, "input.state", &state)];
    let keeping = Keeping { states: &states, ..Default::default() };
    let results = render_and_keep(&known.scene, &known.plan, &known.settings, &(), &keeping).map_err(refusal)?;
    let results = results.expect("who is alone leads");
    let maps = results.maps.iter().flat_map(|map| map.illuminance.iter().chain(&map.standard_error));
    let sensors = results.sensors.iter().flat_map(|sensor| [&sensor.illuminance, &sensor.standard_error]);
    if maps.chain(sensors).any(|number| !number.is_finite()) {
        // Sums that are finite may make a result that isn't: it is not written.
        return match luxmap::report::write(&results, &folder.join("out"), &ExtraLayers::default()) {
            Ok(_) => panic!("a result that is not finite was written"),
            Err(error) => Err(refusal(error)),
        };
    }
    Ok(())
}
