//! The batch file: TOML in, a list of runs out, every mistake named with its line.

use std::path::{Path, PathBuf};

use toml::de::DeTable;

use super::{Arity, BatchOptions, BatchRun};
use crate::error::{InputError, Location};
use crate::files::stems;
use crate::scene::fields::{Fields, Placed, Source, Word};
use crate::text::quoted;

/// Most runs of one batch.
const MOST_RUNS: usize = 100_000;

/// An option and what it is set to: of a sweep, one after the other.
struct Setting<'a> {
    name: &'a str,
    /// Whether the runs are named by it.
    swept: bool,
    /// Each: its value in words, and its arguments.
    values: Vec<(String, Vec<String>)>,
}

/// A run whose name may be another's too.
struct Draft {
    name: String,
    scene: PathBuf,
    options: Vec<String>,
}

/// Whether a text is a batch file rather than a scene file.
pub fn is_batch(text: &str) -> bool {
    let heads = ["[[run]]", "[defaults]"];
    text.lines().any(|line| {
        let line: String = line.split('#').next().unwrap_or("").split_whitespace().collect();
        heads.contains(&line.as_str()) || line.starts_with("run=[")
    })
}

/// Reads the text of the batch file at `path`.
pub fn parse(path: &Path, text: &str, options: &BatchOptions<'_>) -> Result<Vec<BatchRun>, InputError> {
    let source = Source::new(path, text);
    let table = source.table(text)?;
    let top = Fields::new(&source, "the batch file", Location::file(path), table.get_ref(), &["defaults", "run"])?;
    let names: Vec<&str> = options.known.iter().map(|(name, _)| name.as_str()).collect();
    let defaults = match top.table("defaults", "a section [defaults]", &names)? {
        Some(section) => settings(&section, options)?,
        None => Vec::new(),
    };
    let sections = top.sections("run")?;
    if sections.is_empty() {
        return Err(InputError::new(Location::file(path), "no [[run]]", "at least one of them"));
    }
    let mut drafts = Vec::new();
    for (at, section) in sections {
        add_runs(&source, at, section, &defaults, options, &mut drafts)?;
    }
    Ok(unlike(drafts))
}

/// A batch of scenes without options of their own.
pub fn plain(scenes: &[PathBuf]) -> Vec<BatchRun> {
    let draft = |scene: &PathBuf| Draft { name: stem(scene), scene: scene.clone(), options: Vec::new() };
    unlike(scenes.iter().map(draft).collect())
}

/// Gives each a name of its own that is also a folder's.
fn unlike(drafts: Vec<Draft>) -> Vec<BatchRun> {
    let names: Vec<&str> = drafts.iter().map(|draft| draft.name.as_str()).collect();
    let names = stems(&names);
    drafts
        .into_iter()
        .zip(names)
        .map(|(Draft { scene, options, .. }, name)| BatchRun { name, scene, options })
        .collect()
}

/// The runs of a `[[run]]`: each of its scenes with each combination of what is swept.
fn add_runs(
    source: &Source,
    at: Location,
    section: &DeTable,
    defaults: &[Setting],
    options: &BatchOptions<'_>,
    drafts: &mut Vec<Draft>,
) -> Result<(), InputError> {
    let known: Vec<&str> = ["scene", "name"].into_iter().chain(options.known.iter().map(|(name, _)| &**name)).collect();
    let fields = Fields::new(source, "[[run]]", at, section, &known)?;
    let scenes = scenes(source, &fields)?;
    let name = fields.name("name")?.map(|name| name.value);
    let own = settings(&fields, options)?;
    let inherited = defaults.iter().filter(|default| own.iter().all(|setting| setting.name != default.name));
    let all: Vec<&Setting> = inherited.chain(&own).collect();
    let combinations = all.iter().try_fold(scenes.len(), |count, setting| count.checked_mul(setting.values.len()));
    if combinations.and_then(|count| count.checked_add(drafts.len())).is_none_or(|count| count > MOST_RUNS) {
        let found = format!("a batch of more than {MOST_RUNS} runs");
        return Err(InputError::new(fields.at.clone(), found, "fewer: several lists make a run for each combination"));
    }
    for scene in &scenes {
        let base = match &name {
            Some(name) if scenes.len() > 1 => format!("{name}-{}", stem(scene)),
            Some(name) => name.clone(),
            None => stem(scene),
        };
        let mut combined = vec![Draft { name: base, scene: scene.clone(), options: Vec::new() }];
        for setting in &all {
            let with = |draft: &Draft| {
                let (scene, options) = (&draft.scene, &draft.options);
                let each = setting.values.iter().map(|(words, arguments)| Draft {
                    name: match setting.swept {
                        true => format!("{}-{}-{words}", draft.name, setting.name),
                        false => draft.name.clone(),
                    },
                    scene: scene.clone(),
                    options: [options.as_slice(), arguments].concat(),
                });
                each.collect::<Vec<_>>()
            };
            combined = combined.iter().flat_map(with).collect();
        }
        drafts.extend(combined);
    }
    Ok(())
}

/// The options that a section sets.
fn settings<'a>(fields: &Fields<'a>, options: &BatchOptions<'_>) -> Result<Vec<Setting<'a>>, InputError> {
    let mut settings = Vec::new();
    for name in fields.keys() {
        let Some((_, kind)) = options.known.iter().find(|(known, _)| known == name) else { continue };
        let Some((is_list, words)) = fields.words(name)? else { continue };
        let swept = is_list && *kind != Arity::List;
        if swept && words.is_empty() {
            return Err(fields.refusal(name, "a value, or a list of them"));
        }
        let refuse = |word: &Placed<Word>, expected: String| InputError {
            at: word.at.clone(),
            ..fields.refusal(name, expected)
        };
        let each = words.iter().map(|word| match (&word.value, kind) {
            (Word::Switch(on), Arity::Switch) => Ok((on.to_string(), on.then(|| format!("--{name}")))),
            (_, Arity::Switch) => Err(refuse(word, "true or false".into())),
            (Word::Text(text) | Word::Number(text), _) => Ok((text.clone(), Some(format!("--{name}={text}")))),
            (Word::Switch(on), _) => {
                let text = if *on { "on" } else { "off" };
                Ok((text.to_owned(), Some(format!("--{name}={text}"))))
            }
        });
        let mut values = Vec::new();
        for (word, value) in words.iter().zip(each) {
            let (text, argument) = value?;
            if let Some(argument) = &argument {
                (options.check)(argument).map_err(|expected| refuse(word, expected))?;
            }
            values.push((text, argument.into_iter().collect::<Vec<_>>()));
        }
        if !swept {
            let arguments = values.into_iter().flat_map(|(_, arguments)| arguments).collect();
            values = vec![(String::new(), arguments)];
        }
        settings.push(Setting { name, swept, values });
    }
    Ok(settings)
}

/// The scenes of a `[[run]]`: paths, and what patterns find, in the order of the alphabet.
fn scenes(source: &Source, fields: &Fields) -> Result<Vec<PathBuf>, InputError> {
    let (_, words) = fields.words("scene")?.ok_or_else(|| fields.missing("scene", "\"room.toml\""))?;
    if words.is_empty() {
        return Err(fields.refusal("scene", "a path, a pattern such as \"rooms/*.toml\", or a list of such"));
    }
    let folder = source.path().parent().unwrap_or(Path::new(""));
    let mut scenes = Vec::new();
    for Placed { value, at } in words {
        let Word::Text(text) = value else {
            return Err(InputError { at, ..fields.refusal("scene", "a path in quotes, or a list of such") });
        };
        let path = folder.join(&text);
        if !text.contains(['*', '?', '[']) || path.is_file() {
            scenes.push(path);
            continue;
        }
        let refuse =
            |expected: String| InputError::new(at.clone(), format!("scene = {} in [[run]]", quoted(&text)), expected);
        // The folder's own name is no pattern.
        let pattern = Path::new(&glob::Pattern::escape(&folder.to_string_lossy())).join(&text);
        let found =
            glob::glob(&pattern.to_string_lossy()).map_err(|error| refuse(format!("a pattern ({})", error.msg)))?;
        let own = source.path().canonicalize().ok();
        let is_scene = |path: &PathBuf| path.is_file() && path.canonicalize().ok() != own;
        let before = scenes.len();
        scenes.extend(found.filter_map(Result::ok).filter(is_scene));
        if scenes.len() == before {
            return Err(refuse("a pattern that finds a file".into()));
        }
    }
    Ok(scenes)
}

fn stem(scene: &Path) -> String {
    scene.file_stem().map_or_else(|| "scene".into(), |stem| stem.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn runs(text: &str) -> Result<Vec<(String, String)>, String> {
        let known = [("error", Arity::One), ("seed", Arity::One), ("groups", Arity::Switch), ("layers", Arity::List)];
        let check = |argument: &str| match argument.split_once("--error=") {
            Some((_, value)) => value.parse::<f64>().map(|_| ()).map_err(|_| "a number of percent".into()),
            None => Ok(()),
        };
        let known = known.map(|(name, kind)| (name.to_owned(), kind)).to_vec();
        let runs = parse(Path::new("b.toml"), text, &BatchOptions { known, check: &check });
        let each = |run: BatchRun| (run.name, run.options.join(" "));
        runs.map(|runs| runs.into_iter().map(each).collect()).map_err(|error| error.to_string())
    }

    #[test]
    fn lists_are_swept_and_runs_override_defaults() {
        let text = "[defaults]\nerror = 2\nlayers = [\"direct\", \"stderr\"]\n\
                    [[run]]\nscene = \"rooms/a.toml\"\nseed = [1, 1e3]\ngroups = [true, false]\n\
                    [[run]]\nscene = [\"a.toml\", \"b.toml\"]\nerror = 0.5\nlayers = []\nname = \"x\"\n\
                    [[run]]\nscene = \"a.toml\"\nname = \"x-a\"";
        let both = "--error=2 --layers=direct --layers=stderr";
        let expected = [
            ("a-seed-1-groups-true", format!("{both} --seed=1 --groups")),
            ("a-seed-1-groups-false", format!("{both} --seed=1")),
            ("a-seed-1000-groups-true", format!("{both} --seed=1000 --groups")),
            ("a-seed-1000-groups-false", format!("{both} --seed=1000")),
            ("x-a", "--error=0.5".into()),
            ("x-b", "--error=0.5".into()),
            ("x-a-2", both.into()),
        ];
        assert_eq!(runs(text), Ok(expected.map(|(name, options)| (name.to_owned(), options)).to_vec()));
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        for (text, message) in [
            ("[defaults]\nerror = 1", "b.toml: found no [[run]], expected at least one of them"),
            (
                "[[run]]\nscene = \"a\"\n\n[defaults]\nerorr = 1",
                "b.toml:5: found unknown key \"erorr\" in defaults of the batch file, expected one of error, seed, groups, \
                 layers",
            ),
            ("[[run]]\nseed = 1", "b.toml:1: found [[run]] without scene, expected scene = \"room.toml\""),
            (
                "[[run]]\nscene = \"a\"\nerror = [1,\n\"x\"]",
                "b.toml:4: found error = [1, \"x\"] in [[run]], expected a number of percent",
            ),
            ("[[run]]\nscene = \"a\"\ngroups = 1", "b.toml:3: found groups = 1 in [[run]], expected true or false"),
            (
                "[[run]]\nscene = \"a\"\nseed = []",
                "b.toml:3: found seed = [] in [[run]], expected a value, or a list of them",
            ),
            (
                "[[run]]\nscene = \"nowhere/*.toml\"",
                "b.toml:2: found scene = \"nowhere/*.toml\" in [[run]], expected a pattern that finds a file",
            ),
            ("[[run]\nscene = 1", "b.toml:1: found broken TOML (unclosed array table), expected `]`"),
        ] {
            assert_eq!(runs(text), Err(message.into()), "{text}");
        }
    }

    #[test]
    fn a_batch_file_is_known_by_its_sections() {
        assert!(is_batch("# runs\n [[ run ]] # first\nscene = \"a\"") && is_batch("[defaults]\n"));
        assert!(!is_batch("# [[run]]\n[[mesh]]\nfile = \"a.obj\"\n[render]\npasses = 2"));
    }
}
