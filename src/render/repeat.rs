//! Passes, one after the other, until the map is known well enough.

use std::time::Instant;

use super::engine::Engine;
use super::keeping::{self, Keeping, Schedule};
use super::place::{Cell, Place, worst_of};
use super::settings::LEAST_PASSES;
use super::team::Instruction;
use super::views::View;
use super::warning::Warning;
use super::{IMAGE_ERROR, Rendering};
use crate::embree::RayCaster;
use crate::error::Error;
use crate::results::CameraImage;
use crate::state::tape::Tape;
use crate::state::{PassRange, Passes};

/// The next check comes after so many times the passes done, at least and at most: asking costs as much as a pass or two, and
/// an error known from few passes is a poor guide to many.
const NEXT_CHECK: [f64; 2] = [1.4, 2.0];

impl<const C: usize> Rendering<'_, C> {
    /// Passes until one of the limits is met; returns the images of the cameras.
    pub(super) fn passes(
        &mut self,
        places: &mut [Place<C>],
        caster: &RayCaster,
        keeping: &Keeping<'_>,
    ) -> Result<Vec<CameraImage>, Error> {
        let engine = Engine::new(self, places, caster);
        let (scene, mut views) = (self.scene, Vec::new());
        if let (Some(sight), false) = (&engine.sight, scene.cameras.is_empty()) {
            let view = |camera| View::new(camera, scene.centre, sight, caster);
            views = self.timed("camera rays", 1, |_| scene.cameras.iter().map(view).collect());
        }
        self.repeat(&engine, places, &mut views, keeping)?;
        Ok(views.iter().map(|view| view.image(scene.centre)).collect())
    }

    /// Passes, each kept as soon as it is done, until the error is small enough or a limit is met.
    fn repeat(
        &mut self,
        engine: &Engine<'_, C>,
        places: &mut [Place<C>],
        views: &mut [View<'_, C>],
        keeping: &Keeping<'_>,
    ) -> Result<(), Error> {
        let mut schedule = self.restore(places, views, keeping)?;
        if !self.done.is_empty() {
            self.list_stages();
        }
        let mut taken = 0.0;
        loop {
            let over = keeping.team.rank() == 0 && self.is_enough(places, views, &mut schedule, taken);
            let rest = views.iter().map(|view| view.rests).collect();
            let instruction = Instruction { over, done: self.done.len(), next_check: schedule.next_check, rest };
            let instruction = keeping.team.broadcast(instruction);
            if instruction.over {
                if schedule.closed {
                    self.save(places, views, &schedule, keeping);
                }
                if keeping.team.rank() == 0 && self.plan.bounces {
                    self.read_extremes(engine, places);
                }
                return Ok(());
            }
            schedule.next_check = instruction.next_check;
            if keeping.team.rank() > 0 {
                self.done = self.own_passes(instruction.done);
            }
            views.iter_mut().zip(instruction.rest).for_each(|(view, rests)| view.rests = rests);
            let started = Instant::now();
            self.share_passes(engine, places, views, &schedule, keeping)?;
            taken = started.elapsed().as_secs_f64();
            self.save(places, views, &schedule, keeping);
        }
    }

    /// Books the stages of passes even if none is left to run, so that a run that goes on lists what any run does.
    fn list_stages(&mut self) {
        for stage in self.composition.stages {
            self.record.book(stage, 0.0);
        }
    }

    /// Passes that are done before an error is believed: points without neighbours (sensors, samples of surfaces), and
    /// pixels where there is nothing else, know it by the scatter of their own batches.
    fn least_passes(&self, places: &[Place<C>]) -> u32 {
        let alone = self.composition.rays.is_some() && places.iter().any(|place| place.site.receiver.grid.is_none());
        let least = if alone || places.is_empty() { LEAST_PASSES } else { 1 };
        least.max(self.settings.least_passes)
    }

    /// The first `count` passes of this run.
    fn own_passes(&self, count: u32) -> Passes {
        Passes::of(PassRange { seed: self.settings.seed, first: self.settings.first_pass, count })
    }

    /// One pass for each process of the team, but none too many; what they found is the leader's in the end.
    fn share_passes(
        &mut self,
        engine: &Engine<'_, C>,
        places: &mut [Place<C>],
        views: &mut [View<'_, C>],
        schedule: &Schedule,
        keeping: &Keeping<'_>,
    ) -> Result<(), Error> {
        let done = self.done.len();
        let most = self.settings.stop.passes().unwrap_or(u32::MAX);
        let until_check = if self.settings.stop.error().is_some() { schedule.next_check.min(most) } else { most };
        let count = until_check.saturating_sub(done).clamp(1, keeping.team.size());
        let first = self.settings.first_pass + done;
        let leads = keeping.team.rank() == 0;
        if !leads {
            self.exchange(places, views, &mut Tape::Clear).map_err(keeping::lost)?;
        }
        if keeping.team.rank() < count {
            self.pass(engine, places, views, first + keeping.team.rank());
        }
        let mut found = Vec::new();
        if !leads {
            self.exchange(places, views, &mut Tape::Out(&mut found)).map_err(keeping::lost)?;
        }
        let add = &mut |mut part: &[u8]| self.exchange(places, views, &mut Tape::In(&mut part));
        keeping.team.hand_in(&found, add).map_err(keeping::lost)?;
        self.done = self.own_passes(done + count);
        Ok(())
    }

    /// Whether the passes so far are enough. Where it is time to ask, what they say is worked out.
    fn is_enough(
        &mut self,
        places: &mut [Place<C>],
        views: &mut [View<'_, C>],
        schedule: &mut Schedule,
        taken: f64,
    ) -> bool {
        let done = self.done.len();
        if done == 0 {
            return schedule.closed;
        }
        let enough = self.settings.stop.passes().is_some_and(|most| done >= most);
        let limit = self.settings.stop.time();
        let late = limit.is_some_and(|limit| self.record.started.elapsed().as_secs_f64() + taken > limit.as_secs_f64());
        let last = enough || late || schedule.closed || self.progress.interrupted();
        if !last && (self.settings.stop.error().is_none() || done < schedule.next_check) {
            return false;
        }
        if self.plan.bounces {
            let known = self.known();
            self.timed("smooth", 1, |_| places.iter_mut().for_each(|place| place.conclude(known)));
        }
        let claim = match places {
            [] => views.iter().map(View::claim).fold(0.0, f64::max),
            _ => worst_of(places, Cell::of),
        };
        self.progress.pass(done, 100.0 * claim);
        let Some(percent) = self.settings.stop.error() else { return true };
        let target = percent / 100.0;
        let fewest = self.least_passes(places);
        if last || (claim <= target && done >= fewest) || !(self.plan.bounces || places.is_empty()) {
            return true;
        }
        let floor = worst_of(places, Cell::of_direct);
        if floor > target {
            self.record.warn(Warning::DirectUncertain { wanted: percent, error: 100.0 * floor });
            return true;
        }
        // An image that is good enough rests while maps and sensors ask for more.
        let goal = if places.is_empty() { target } else { IMAGE_ERROR / 100.0 };
        if self.settings.stop.passes().is_none() {
            views.iter_mut().for_each(|view| view.rests |= view.claim() <= goal);
        }
        if claim <= target {
            schedule.next_check = fewest;
            return false;
        }
        // The error falls as 1/√passes at best: no use in asking earlier. Asking costs as much as a pass or two.
        let passes = f64::from(done);
        let needed = (passes * (claim / target).powi(2)).clamp(NEXT_CHECK[0] * passes, NEXT_CHECK[1] * passes);
        schedule.next_check = done.max(needed as u32 - 1) + 1;
        false
    }
}
