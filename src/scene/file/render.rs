//! `[render]`: options of `luxmap render` that a scene brings along.

use super::super::plan::Method;
use super::keys::{Key, Section, Table};
use super::kinds::{Number, Range, Several, Switch, Whole, Word};
use crate::error::InputError;
use crate::render::Tree;

/// Options of `luxmap render` that a scene file may set in `[render]`; the command line wins over them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderDefaults {
    /// Name of the [`Method`](super::super::plan::Method).
    pub method: Option<String>,
    /// Photons a pass.
    pub photons: Option<u64>,
    /// Rays from each grid point a pass.
    pub rays: Option<u32>,
    /// Whether neighbouring grid points help each other.
    pub smooth: Option<bool>,
    /// k, nearest photons of an estimate.
    pub nearest: Option<usize>,
    /// Largest search radius, m.
    pub radius: Option<f64>,
    /// Largest standard error of a map to stop at, % of its mean.
    pub error: Option<f64>,
    /// Time to stop before, s.
    pub time: Option<f64>,
    /// Independent photon maps.
    pub passes: Option<u32>,
    /// Most memory to take, GB.
    pub memory: Option<f64>,
    /// Name of the [`Tree`](crate::render::Tree).
    pub tree: Option<String>,
    /// Seed of the random streams.
    pub seed: Option<u64>,
    /// Whether light groups are told apart.
    pub groups: Option<bool>,
}

static METHOD: Key<Word<Method>> =
    Key::optional("method", Word(&Method::ALL), "\"gather\"", "How illuminance is computed.");
static PHOTONS: Key<Whole> = Key::optional(
    "photons",
    Whole::between(1, 1 << 40),
    "gather 200000, with mirrors or glass 1000000; split and photons 1000000; seed 30000",
    "Photons a pass.",
);
static RAYS: Key<Whole> = Key::optional(
    "rays",
    Whole::between(1, 65_536),
    "8",
    "Rays from each grid point a pass, with methods gather and path; a camera's pixel sends four times as many.",
);
static SMOOTH: Key<Several<bool>> = Key::optional(
    "smooth",
    Several { unit: "", forms: ON_OFF, tables: &[], read: on_off },
    "true for gather, false for path",
    "Whether neighbouring grid points help each other to what rays found.",
);
static NEAREST: Key<Whole> = Key::optional(
    "nearest",
    Whole::between(2, 1_000_000_000),
    "grows with the photons; seed: 100",
    "k, nearest photons of an estimate: more is smoother and less sharp.",
);
static RADIUS: Key<Number> = Key::optional(
    "radius",
    Number::of(Range::above(0.0), "m"),
    "a tenth of the scene's diagonal",
    "Largest search radius of an estimate.",
);
static ERROR: Key<Number> = Key::optional(
    "error",
    Number::of(Range::above(0.0), "%"),
    "1, with only cameras 5, unless passes or time is given; seed: one pass",
    "Stop when the standard error of every map is at most this share of its mean.",
);
static TIME: Key<Number> = Key::optional(
    "time",
    Number::of(Range::above(0.0), "s"),
    "no limit",
    "Stop before this time is over; the first pass is always done.",
);
static PASSES: Key<Whole> = Key::optional(
    "passes",
    Whole::between(1, u32::MAX as u64),
    "as many as the error takes",
    "Stop after so many passes: independent photons and rays.",
);
static MEMORY: Key<Number> = Key::optional(
    "memory",
    Number::of(Range::above(0.0), "GB"),
    "planes of more than 4 million cells in bands",
    "Take no more memory than this: large planes are computed in bands, and passes have fewer photons.",
);
static TREE: Key<Word<Tree>> = Key::optional("tree", Word(&Tree::ALL), "\"kd\"", "Tree of the photon map.");
static SEED: Key<Whole> =
    Key::optional("seed", Whole::between(0, u64::MAX), "0", "Same seed, same bits, whatever the number of threads.");
static GROUPS: Key<Switch> =
    Key::optional("groups", Switch, "false", "Whether light groups are told apart, as with `--groups`.");

pub(super) static RENDER: Table = Table {
    head: "[render]",
    about: "Options of `luxmap render` for this scene. The command line wins over them; `luxmap render --help` \
         tells more.",
    keys: &[
        &METHOD, &PHOTONS, &RAYS, &SMOOTH, &NEAREST, &RADIUS, &ERROR, &TIME, &PASSES, &MEMORY, &TREE, &SEED, &GROUPS,
    ],
    rules: &[
        "Where several of `error`, `time` and `passes` are given, a run stops at the first that is reached.",
        "An option of the command line replaces the key of its own name, no other.",
    ],
    example: "\
[render]
method = \"gather\"
error = 0.5
time = 600
seed = 1
",
};

const ON_OFF: &str = "true, false, \"on\" or \"off\"";

fn on_off(section: &Section<'_>, key: &str) -> Result<Option<bool>, InputError> {
    if !section.fields.is_text(key) {
        let on = section.fields.switch(key).map_err(|error| InputError { expected: ON_OFF.to_owned(), ..error });
        return Ok(on?.map(|on| on.value));
    }
    match section.fields.text(key)?.as_ref().map(|word| word.value.as_str()) {
        Some("on") => Ok(Some(true)),
        Some("off") => Ok(Some(false)),
        _ => Err(section.fields.refusal(key, ON_OFF)),
    }
}

pub(super) fn read(section: &Section<'_>) -> Result<RenderDefaults, InputError> {
    Ok(RenderDefaults {
        method: section.get(&METHOD)?.map(|method| method.name().to_owned()),
        photons: section.get(&PHOTONS)?,
        rays: section.get(&RAYS)?.and_then(|n| u32::try_from(n).ok()),
        smooth: section.get(&SMOOTH)?,
        nearest: section.get(&NEAREST)?.and_then(|n| usize::try_from(n).ok()),
        radius: section.get(&RADIUS)?,
        error: section.get(&ERROR)?,
        time: section.get(&TIME)?,
        passes: section.get(&PASSES)?.and_then(|n| u32::try_from(n).ok()),
        memory: section.get(&MEMORY)?,
        tree: section.get(&TREE)?.map(|tree| tree.name().to_owned()),
        seed: section.get(&SEED)?,
        groups: section.get(&GROUPS)?,
    })
}
