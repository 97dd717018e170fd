//! What a run keeps of its passes: in a checkpoint, and out of the states of other runs.

use std::io;
use std::path::{Path, PathBuf};

use super::place::Place;
use super::team::{Alone, Team};
use super::views::View;
use super::warning::Warning;
use super::{Rendering, Settings};
use crate::error::{Error, InputError, Location};
use crate::render::plan::Plan;
use crate::scene::Scene;
use crate::state::file::{Kept, Recipe, StateHeader};
use crate::state::tape::Tape;
use crate::state::{PassRange, file};

/// What a run keeps, and goes on from.
pub struct Keeping<'a> {
    /// A file that holds the state after each pass. Where it is there already, the run goes on from it, unless it
    /// merges others.
    pub checkpoint: Option<&'a Path>,
    /// States of other runs: they are added up, and no pass is run.
    pub states: &'a [PathBuf],
    /// The processes that share the passes.
    pub team: &'a dyn Team,
}

impl Default for Keeping<'_> {
    fn default() -> Self {
        Self { checkpoint: None, states: &[], team: &Alone }
    }
}

/// When the error is asked for.
pub(super) struct Schedule {
    /// Number of passes after which it is asked for next.
    pub(super) next_check: u32,
    /// Whether there are no passes to come.
    pub(super) closed: bool,
}

/// What makes the state of a run: such states add up.
pub fn recipe(scene: &Scene, plan: &Plan, settings: &Settings) -> Recipe {
    let planes = scene.planes.iter().map(|plane| &plane.name);
    Recipe {
        luxmap: env!("CARGO_PKG_VERSION").into(),
        scene_sha256: scene.hash.clone(),
        planes: planes.chain(scene.surfaces.iter().map(|surface| &surface.name)).cloned().collect(),
        cameras: scene.cameras.iter().map(|camera| camera.name.clone()).collect(),
        method: plan.method.name().into(),
        tree: settings.tree.name().into(),
        photons: settings.photons,
        rays: settings.rays,
        smooth: settings.smooth,
        nearest: settings.nearest,
        radius: settings.radius,
        groups: settings.groups,
    }
}

/// An error on the way from one process to another.
pub(super) fn lost(error: io::Error) -> Error {
    Error::Usage(format!("what a process found did not arrive whole: {error}"))
}

impl<const C: usize> Rendering<'_, C> {
    /// Reads the checkpoint, or adds up the states to merge.
    pub(super) fn restore(
        &mut self,
        places: &mut [Place<C>],
        views: &mut [View<'_, C>],
        keeping: &Keeping<'_>,
    ) -> Result<Schedule, Error> {
        let mut schedule =
            Schedule { next_check: self.settings.least_passes.max(1), closed: !keeping.states.is_empty() };
        for path in keeping.states {
            self.add(places, views, path, Kept::open(path)?)?;
        }
        if let Some(path) =
            keeping.checkpoint.filter(|path| keeping.team.rank() == 0 && !schedule.closed && path.exists())
        {
            let kept = Kept::open(path)?;
            let StateHeader { passes, next_check, .. } = &kept.words;
            let PassRange { seed, first, count } = match passes.ranges() {
                [range] => *range,
                _ => return Err(refuse(path, format!("passes {passes}"), "passes without a gap")),
            };
            let (own_seed, own_first) = (self.settings.seed, self.settings.first_pass);
            if (seed, first) != (own_seed, own_first) {
                let expected = format!("passes from {own_first} on of seed {own_seed}");
                return Err(refuse(path, format!("passes {passes}"), expected));
            }
            schedule.next_check = match (next_check, self.settings.stop.error()) {
                (Some((error, next)), Some(wanted)) if *error == wanted => *next,
                _ => count,
            };
            self.add(places, views, path, kept)?;
        }
        Ok(schedule)
    }

    /// Adds the state of a file.
    fn add(
        &mut self,
        places: &mut [Place<C>],
        views: &mut [View<'_, C>],
        path: &Path,
        kept: Kept,
    ) -> Result<(), Error> {
        if let Some((name, here, there)) = recipe(self.scene, self.plan, self.settings).difference(&kept.words.recipe) {
            let found = format!("a state of {name} {there}");
            let error = InputError::new(Location::file(path), found, here);
            return Err(error.hint("only states of the same scene and settings add up").into());
        }
        let passes = kept.words.passes.clone();
        self.done.add(&passes).map_err(|(seed, pass)| {
            refuse(path, format!("pass {pass} of seed {seed} a second time"), "passes that no other state holds")
        })?;
        kept.add_to(&mut |tape| self.exchange(places, views, tape))
    }

    /// Keeps what the passes so far have left. A disk that takes no more does not end the run, but what it would lose
    /// is said.
    pub(super) fn save(
        &mut self,
        places: &mut [Place<C>],
        views: &mut [View<'_, C>],
        schedule: &Schedule,
        keeping: &Keeping<'_>,
    ) {
        let Some(path) = keeping.checkpoint.filter(|_| keeping.team.rank() == 0) else { return };
        let words = StateHeader {
            scene: std::path::absolute(&self.scene.file).unwrap_or_else(|_| self.scene.file.clone()),
            recipe: recipe(self.scene, self.plan, self.settings),
            passes: self.done.clone(),
            next_check: self.settings.stop.error().map(|error| (error, schedule.next_check)),
        };
        let written = self
            .timed("checkpoint", 1, |this| file::write(path, &words, &mut |tape| this.exchange(places, views, tape)));
        if let Err(error) = written {
            self.record.warn_once(Warning::Checkpoint(error.to_string()));
        }
    }

    /// Reads or writes all that passes leave behind: a checkpoint, another run's state, or another process's part.
    pub(super) fn exchange(
        &mut self,
        places: &mut [Place<C>],
        views: &mut [View<'_, C>],
        tape: &mut Tape<'_>,
    ) -> io::Result<()> {
        self.record.exchange(tape)?;
        tape.same(places.len(), "receivers")?;
        for place in places {
            place.exchange(tape)?;
        }
        tape.same(views.len(), "cameras")?;
        views.iter_mut().try_for_each(|view| view.exchange(tape))
    }
}

fn refuse(path: &Path, found: impl Into<String>, expected: impl Into<String>) -> Error {
    InputError::new(Location::file(path), found, expected).into()
}
