//! Are the standard errors true? Many seeds of several rooms against long runs: which share of all errors is within one,
//! two and three claimed standard errors, for every kind of result. `make honesty`; writes docs/HONESTY.md and
//! docs/honesty.svg. `cargo bench --bench honesty -- 40` takes 40 seeds instead of 200.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use luxmap::render::plan::{Method, Plan};
use luxmap::render::{Settings, Stop, render};
use luxmap::results::Results;
use luxmap::scene::Scene;
use luxmap::study::check::scenes::room;

/// Seeds, unless said otherwise.
const SEEDS: u64 = 200;
/// What the seeds' runs ask for, %: the default.
const ERROR: f64 = 1.0;
/// Cells of each plane that are held against the long run.
const CELLS: usize = 48;
/// Passes and rays of the long run, all of whose points send rays for themselves.
const LONG: (u32, u32) = (60, 64);
/// Shares of a normal law within 1, 2, 3 standard errors, %.
const NORMAL: [f64; 3] = [68.27, 95.45, 99.73];

/// A room of the study.
struct Case {
    name: &'static str,
    /// What is in it besides measuring planes.
    toml: String,
    planes: Vec<Plane>,
    /// Sensors of all kinds, cameras.
    extra: String,
    /// Files beside the scene.
    files: Vec<(String, Vec<u8>)>,
}

struct Plane {
    name: &'static str,
    corner: [f64; 3],
    along: [f64; 3],
    across: [f64; 3],
    cells: [usize; 2],
    on: &'static str,
}

impl Plane {
    fn toml(&self) -> String {
        let Self { name, corner, along, across, cells, on } = self;
        format!(
            "[[plane]]\nname = \"{name}\"\ncorner = {corner:?}\nalong = {along:?}\nacross = {across:?}\ncells = {cells:?}\n\
             on = \"{on}\"\n"
        )
    }

    /// Cells spread over the plane.
    fn chosen(&self) -> Vec<usize> {
        let all = self.cells[0] * self.cells[1];
        (0..CELLS).map(|i| ((i as f64 * 0.618_033_988_75).fract() * all as f64) as usize).collect()
    }

    /// A sensor at the middle of a cell.
    fn sensor(&self, cell: usize) -> String {
        let Self { name, corner, along, across, cells, .. } = self;
        let share = [cell % cells[0], cell / cells[0]].map(|index| index as f64 + 0.5);
        let share = [share[0] / cells[0] as f64, share[1] / cells[1] as f64];
        let at: [f64; 3] = std::array::from_fn(|i| corner[i] + along[i] * share[0] + across[i] * share[1]);
        let normal: [f64; 3] = std::array::from_fn(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            along[j] * across[k] - along[k] * across[j]
        });
        format!("[[sensor]]\nname = \"{name} {cell}\"\nposition = {at:?}\nnormal = {normal:?}\n")
    }
}

/// A value and its standard error, by kind and name.
type Values = BTreeMap<(&'static str, String), [f64; 2]>;

/// Coverage and bias of one kind of result in one room.
#[derive(Clone, Copy, Default)]
struct Tally {
    count: f64,
    within: [f64; 3],
    /// Σ of (found − true)/true, and of its square, and of the claim's.
    off: f64,
    square: f64,
    claimed: f64,
}

fn main() {
    let seeds = std::env::args().find_map(|word| word.parse().ok()).unwrap_or(SEEDS);
    let mut tallies: Vec<(&'static str, &'static str, Tally)> = Vec::new();
    for case in cases() {
        eprintln!("{}: the long run", case.name);
        let truth = long_run(&case);
        let scene = case.scene(&case.planes.iter().map(Plane::toml).collect::<String>(), "seeds");
        let mut of_kind: BTreeMap<&'static str, Tally> = BTreeMap::new();
        for seed in 1..=seeds {
            let plan = Plan::new(&scene, Method::Gather);
            let settings = Settings { stop: Stop::at_error(ERROR), seed, ..Settings::for_plan(&plan) };
            let results = render(&scene, &plan, &settings, &()).expect("the scene is good");
            for ((kind, name), [found, sigma]) in values(&case, &results) {
                if let Some([true_value, error]) = truth.get(&(kind, name)) {
                    of_kind.entry(kind).or_default().add([found, sigma], [*true_value, *error]);
                }
            }
            eprint!("\r{}: seed {seed} of {seeds}", case.name);
        }
        eprintln!();
        for (kind, tally) in of_kind {
            println!("{:<14} {kind:<18} {}", case.name, tally.line());
            tallies.push((case.name, kind, tally));
        }
    }
    write(seeds, &tallies);
}

impl Case {
    fn scene(&self, planes: &str, purpose: &str) -> Scene {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("out/honesty").join(self.name.replace(' ', "-"));
        fs::create_dir_all(&folder).expect("out/ is writable");
        for (name, bytes) in &self.files {
            fs::write(folder.join(name), bytes).expect("out/ is writable");
        }
        let file = folder.join(format!("{purpose}.toml"));
        fs::write(&file, format!("{}\n{planes}\n{}", self.toml, self.extra)).expect("out/ is writable");
        Scene::load(&file).unwrap_or_else(|error| panic!("{error}"))
    }
}

/// The truth: single points, each of which sends rays for itself, so that nothing is smoothed.
fn long_run(case: &Case) -> Values {
    let points: String =
        case.planes.iter().flat_map(|plane| plane.chosen().into_iter().map(|cell| plane.sensor(cell))).collect();
    let scene = case.scene(&points, "truth");
    let plan = Plan::new(&scene, Method::Gather);
    let (passes, rays) = LONG;
    let settings = Settings { stop: Stop::after(passes), rays, seed: 0, smooth: false, ..Settings::for_plan(&plan) };
    let results = render(&scene, &plan, &settings, &()).expect("the scene is good");
    let mut truth = values(case, &results);
    for sensor in results.sensors.iter().filter(|sensor| sensor.has_value) {
        truth.insert(("cells", sensor.name.clone()), [sensor.illuminance, sensor.standard_error]);
    }
    truth
}

/// All that a run says, by kind.
fn values(case: &Case, results: &Results) -> Values {
    let mut values = Values::new();
    for (plane, map) in case.planes.iter().zip(&results.maps) {
        for cell in plane.chosen().into_iter().filter(|&cell| map.has_value[cell]) {
            let found = [map.illuminance[cell], map.standard_error[cell]];
            values.insert(("cells", format!("{} {cell}", plane.name)), found);
        }
    }
    for sensor in results.sensors.iter().filter(|sensor| sensor.has_value) {
        let kind = if sensor.name.starts_with("around") { "cylindrical meters" } else { "sensors" };
        values.insert((kind, sensor.name.clone()), [sensor.illuminance, sensor.standard_error]);
        for (number, group) in sensor.groups.iter().enumerate().filter(|_| kind == "sensors") {
            let name = format!("{} of {number}", sensor.name);
            values.insert(("groups at sensors", name), [group.illuminance, group.standard_error]);
        }
    }
    for image in &results.images {
        for pixel in (0..image.len()).step_by(7) {
            let of = |value: f64, sigma: f32| [value, f64::from(sigma)];
            let e = of(image.illuminance.photometric(pixel), image.standard_error[pixel]);
            values.insert(("pixels, E", pixel.to_string()), e);
            let l = of(image.luminance.photometric(pixel), image.luminance_standard_error[pixel]);
            values.insert(("pixels, luminance", pixel.to_string()), l);
        }
    }
    values
}

impl Tally {
    fn add(&mut self, [found, sigma]: [f64; 2], [true_value, error]: [f64; 2]) {
        if true_value <= 0.0 {
            return;
        }
        let (off, claimed) = (found - true_value, sigma.hypot(error));
        self.count += 1.0;
        (0..3).for_each(|i| self.within[i] += f64::from(u8::from(off.abs() <= (i + 1) as f64 * claimed)));
        self.off += off / true_value;
        self.square += (off / true_value).powi(2);
        self.claimed += (claimed / true_value).powi(2);
    }

    fn covered(&self) -> [f64; 3] {
        self.within.map(|within| 100.0 * within / self.count)
    }

    /// Root mean square of the errors and of the claims, and the mean error, %.
    fn errors(&self) -> [f64; 3] {
        let [square, claimed] = [self.square, self.claimed].map(|sum| 100.0 * (sum / self.count).sqrt());
        [square, claimed, 100.0 * self.off / self.count]
    }

    fn line(&self) -> String {
        let ([one, two, three], [rms, claim, mean]) = (self.covered(), self.errors());
        format!("{one:5.1} {two:5.1} {three:5.1} %   RMS {rms:.3} %, claimed {claim:.3} %, mean {mean:+.3} %")
    }
}

fn write(seeds: u64, tallies: &[(&'static str, &'static str, Tally)]) {
    let mut text = format!(
        "# Are the standard errors true?\n\n\
         Every number of luxmap comes with a standard error σ. Here {seeds} seeds of each room, run as a user would \
         (`--error {ERROR}`), are held against a long run of single points without smoothing ({} passes of {} rays; its own \
         error is added to the claim). Of a normal law 68.3, 95.5 and 99.7 % of all errors are within 1, 2 and 3 σ. \
         `make honesty` makes this page anew.\n\n![coverage](honesty.svg)\n\n\
         | room | result | within 1 σ, % | 2 σ | 3 σ | RMS error, % | claimed, % | mean error, % |\n|---|---|--:|--:|--:|--:|--:|--:|\n",
        LONG.0, LONG.1
    );
    for (room, kind, tally) in tallies {
        let ([one, two, three], [rms, claim, mean]) = (tally.covered(), tally.errors());
        let _ = writeln!(
            text,
            "| {room} | {kind} | {one:.1} | {two:.1} | {three:.1} | {rms:.2} | {claim:.2} | {mean:+.2} |"
        );
    }
    text.push_str(
        "\nA cell's claim is pooled over its neighbours: it holds for the map as a whole, and single cells beside sharp edges \
         may be off by more. Errors are relative to each true value, so dark places weigh as much as bright ones.\n",
    );
    let docs = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("docs");
    fs::write(docs.join("HONESTY.md"), text).expect("docs/ is writable");
    fs::write(docs.join("honesty.svg"), picture(tallies)).expect("docs/ is writable");
}

/// Coverage of every row: a dot for each of 1, 2, 3 σ, and lines where a normal law has them.
fn picture(tallies: &[(&'static str, &'static str, Tally)]) -> String {
    let (left, width, line) = (270.0, 420.0, 20.0);
    let height = 50.0 + line * tallies.len() as f64;
    let x = |percent: f64| left + width * (percent - 40.0) / 60.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {height}\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
        left + width + 30.0
    );
    let colours = ["#1b9e77", "#7570b3", "#d95f02"];
    for ((percent, colour), sigma) in NORMAL.iter().zip(colours).zip(1..) {
        let at = x(*percent);
        let _ = writeln!(
            svg,
            "<line x1=\"{at}\" x2=\"{at}\" y1=\"24\" y2=\"{}\" stroke=\"{colour}\"/>\
             <text x=\"{at}\" y=\"16\" text-anchor=\"middle\" fill=\"{colour}\">{sigma} σ</text>",
            height - 20.0
        );
    }
    for (row, (room, kind, tally)) in tallies.iter().enumerate() {
        let y = 40.0 + line * row as f64;
        let _ = writeln!(svg, "<text x=\"8\" y=\"{}\">{room}: {kind}</text>", y + 4.0);
        for (percent, colour) in tally.covered().iter().zip(colours) {
            let at = x(percent.max(40.0));
            let _ = writeln!(svg, "<circle cx=\"{at}\" cy=\"{y}\" r=\"5\" fill=\"{colour}\"/>");
        }
    }
    for percent in [40, 50, 60, 70, 80, 90, 100] {
        let at = x(f64::from(percent));
        let _ = writeln!(svg, "<text x=\"{at}\" y=\"{}\" text-anchor=\"middle\">{percent} %</text>", height - 4.0);
    }
    svg + "</svg>\n"
}

fn cases() -> Vec<Case> {
    vec![seed_office(), furnace(), gallery(), classroom(), coves()]
}

/// A file of scenes/.
fn shipped(name: &str) -> (String, Vec<u8>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    (name.to_owned(), fs::read(path).expect("a shipped file"))
}

/// What a shipped scene has before its first measuring plane.
fn before_planes(name: &str) -> String {
    let (_, bytes) = shipped(name);
    let text = String::from_utf8(bytes).expect("text");
    text.split("[[plane]]").next().unwrap_or_default().to_owned()
}

fn sensors(at: &[[f64; 3]]) -> String {
    let sensor = |(number, at): (usize, &[f64; 3])| {
        format!("[[sensor]]\nname = \"desk {number}\"\nposition = {at:?}\nnormal = [0, 0, 1]\n")
    };
    at.iter().enumerate().map(sensor).collect()
}

fn meters(at: &[[f64; 3]]) -> String {
    let meter = |(number, at): (usize, &[f64; 3])| {
        format!(
            "[[sensor]]\nname = \"around {number}\"\nposition = {at:?}\nnormal = [0, 0, 1]\nmeasure = \"cylindrical\"\n"
        )
    };
    at.iter().enumerate().map(meter).collect()
}

fn camera(eye: [f64; 3], look_at: [f64; 3]) -> String {
    format!("[[camera]]\nname = \"view\"\neye = {eye:?}\nlook_at = {look_at:?}\nfov = 60\npixels = [40, 24]\n")
}

fn floor(name: &'static str, size: [f64; 2], height: f64, cells: [usize; 2]) -> Plane {
    let on = if height > 0.0 { "air" } else { "surface" };
    Plane { name, corner: [0.0, 0.0, height], along: [size[0], 0.0, 0.0], across: [0.0, size[1], 0.0], cells, on }
}

fn seed_office() -> Case {
    let desks = [[1.5, 1.6, 0.76], [4.5, 1.6, 0.76], [1.5, 3.6, 0.76], [4.5, 3.6, 0.76], [3.0, 6.8, 0.3]];
    Case {
        name: "seed office",
        toml: before_planes("seed-office.toml"),
        planes: vec![floor("floor", [6.0, 7.2], 0.0, [120, 144]), floor("work", [6.0, 7.2], 0.75, [120, 144])],
        extra: sensors(&desks)
            + &meters(&[[3.0, 3.0, 1.2], [1.0, 6.5, 1.2]])
            + &camera([0.3, 0.3, 1.6], [4.0, 5.0, 0.8]),
        files: ["seed-office.obj", "seed-office.mtl"].map(shipped).to_vec(),
    }
}

fn furnace() -> Case {
    Case {
        name: "furnace",
        toml: before_planes("furnace.toml"),
        planes: vec![floor("floor", [4.0, 4.0], 0.0, [40, 40])],
        extra: sensors(&[[1.0, 1.0, 0.5], [3.0, 2.0, 1.0]]) + &meters(&[[1.0, 3.0, 1.0]]),
        files: vec![shipped("furnace.obj")],
    }
}

fn gallery() -> Case {
    Case {
        name: "gallery",
        toml: before_planes("gallery.toml"),
        planes: vec![floor("floor", [5.0, 2.4], 0.0, [100, 48]), floor("at 1.2 m", [3.0, 4.0], 1.2, [60, 80])],
        extra: sensors(&[[1.0, 1.0, 0.8], [4.0, 1.0, 0.8], [1.0, 3.5, 1.2]]),
        files: ["gallery.obj", "wall-washer.ies"].map(shipped).to_vec(),
    }
}

const MATERIALS: &str = "[material.floor]\nreflectance = 0.3\n[material.wall]\nreflectance = 0.6\n\
                         [material.ceiling]\nreflectance = 0.8\n[material.wood]\nreflectance = 0.5\n";

/// A panel in the ceiling, or one that shines up.
fn panel(name: &str, at: [f64; 3], aim: f64, size: [f64; 2], flux: f64) -> String {
    format!(
        "[[luminaire]]\nname = \"{name}\"\nposition = {at:?}\naim = [0, 0, {aim}]\nflux = {flux}\n\
         opening = {{ rectangle = {size:?} }}\n"
    )
}

/// A room with a sloped ceiling and rows of desks.
fn classroom() -> Case {
    let mut obj = String::from(
        "v 0 0 0\nv 8 0 0\nv 8 6 0\nv 0 6 0\nv 0 0 2.6\nv 8 0 2.6\nv 8 6 4\nv 0 6 4\n\
         usemtl floor\nf 1 2 3 4\nusemtl ceiling\nf 5 8 7 6\nusemtl wall\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n",
    );
    let mut vertices = 8;
    for (x, y) in [(1.5, 1.5), (4.0, 1.5), (6.5, 1.5), (1.5, 3.5), (4.0, 3.5), (6.5, 3.5)] {
        for (dx, dy, dz) in [(-0.7, -0.3, 0.7), (0.7, -0.3, 0.7), (0.7, 0.3, 0.7), (-0.7, 0.3, 0.7)] {
            let _ = writeln!(obj, "v {} {} {dz}", x + dx, y + dy);
        }
        let [a, b, c, d] = [1, 2, 3, 4].map(|i| vertices + i);
        let _ = writeln!(obj, "usemtl wood\nf {a} {b} {c} {d}");
        vertices += 4;
    }
    let lamps = [(2.0, 1.5, 2.6), (6.0, 1.5, 2.6), (2.0, 4.5, 3.2), (6.0, 4.5, 3.2)];
    let lamp = |(number, (x, y, z)): (usize, &(f64, f64, f64))| {
        panel(&format!("l{number}"), [*x, *y, *z], -1.0, [1.2, 0.3], 4000.0)
    };
    Case {
        name: "classroom",
        toml: format!(
            "[[mesh]]\nfile = \"room.obj\"\n{MATERIALS}{}",
            lamps.iter().enumerate().map(lamp).collect::<String>()
        ),
        planes: vec![floor("floor", [8.0, 6.0], 0.0, [80, 60]), floor("work", [8.0, 6.0], 0.75, [80, 60])],
        extra: sensors(&[[1.5, 1.5, 0.75], [4.0, 3.5, 0.75], [7.0, 5.5, 0.75]])
            + &meters(&[[4.0, 5.0, 1.2]])
            + &camera([0.5, 0.5, 1.6], [6.0, 4.0, 0.8]),
        files: vec![("room.obj".into(), obj.into_bytes())],
    }
}

/// A room lit only by way of its ceiling.
fn coves() -> Case {
    let lamps = [0.5, 5.5].map(|y| (0..3).map(move |i| (1.5 + 2.5 * f64::from(i), y)));
    let lamp =
        |(number, (x, y)): (usize, (f64, f64))| panel(&format!("c{number}"), [x, y, 2.5], 1.0, [2.0, 0.05], 3000.0);
    let shelf = |y: f64| {
        let [a, b] = [y - 0.2, y + 0.2];
        format!("v 0 {a} 2.45\nv 8 {a} 2.45\nv 8 {b} 2.45\nv 0 {b} 2.45\nusemtl wood\nf -4 -3 -2 -1\n")
    };
    let obj = room([0.0; 3], [8.0, 6.0, 3.0], ["floor", "ceiling", "wall", "wall", "wall", "wall"]);
    Case {
        name: "coves",
        toml: format!(
            "[[mesh]]\nfile = \"room.obj\"\n{MATERIALS}{}",
            lamps.into_iter().flatten().enumerate().map(lamp).collect::<String>()
        ),
        planes: vec![floor("floor", [8.0, 6.0], 0.0, [80, 60]), floor("work", [8.0, 6.0], 0.75, [80, 60])],
        extra: sensors(&[[1.5, 1.5, 0.75], [4.0, 3.5, 0.75], [7.0, 5.5, 0.75]]) + &meters(&[[4.0, 3.0, 1.2]]),
        files: vec![("room.obj".into(), (obj + &shelf(0.5) + &shelf(5.5)).into_bytes())],
    }
}
