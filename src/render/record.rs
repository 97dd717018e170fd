//! What a run books on the way: times, rays, photons, flux and warnings.

use std::io;
use std::time::Instant;

use super::Stages;
use super::warning::Warning;
use crate::photon::trace::{Tally, TallySum};
use crate::state::tape::Tape;

/// What a run books on the way.
pub(super) struct Record<const C: usize> {
    /// When the run began.
    pub(super) started: Instant,
    /// Wall time of each stage.
    pub(super) seconds: Stages,
    /// Rays before the first pass.
    pub(super) prepared_rays: u64,
    /// Rays in passes.
    pub(super) gather_rays: u64,
    /// Photons sent out, all passes together.
    pub(super) photons_emitted: u64,
    /// Photons kept where they are measured, all passes together.
    pub(super) photons_stored: u64,
    /// Where their flux went.
    pub(super) flux: TallySum<C>,
    /// What a user ought to know.
    pub(super) warnings: Vec<Warning>,
}

impl<const C: usize> Record<C> {
    /// Of a run that begins now, in a scene whose file gave these warnings.
    pub(super) fn new(warnings: &[String]) -> Self {
        Self {
            started: Instant::now(),
            seconds: Vec::new(),
            prepared_rays: 0,
            gather_rays: 0,
            photons_emitted: 0,
            photons_stored: 0,
            flux: TallySum::default(),
            warnings: warnings.iter().cloned().map(Warning::InWords).collect(),
        }
    }

    /// Adds wall time to a stage, s; stages stand in the order of their first time.
    pub(super) fn book(&mut self, stage: &'static str, seconds: f64) {
        match self.seconds.iter_mut().find(|(known, _)| *known == stage) {
            Some((_, sum)) => *sum += seconds,
            None => self.seconds.push((stage, seconds)),
        }
    }

    /// Photons of a round, and where their flux went.
    pub(super) fn book_photons(&mut self, photons: u64, flux: &Tally<C>) {
        self.flux.add(flux);
        self.photons_emitted += photons;
    }

    pub(super) fn warn(&mut self, warning: Warning) {
        self.warnings.push(warning);
    }

    /// Warns, unless it has done so before.
    pub(super) fn warn_once(&mut self, warning: Warning) {
        if !self.warnings.contains(&warning) {
            self.warnings.push(warning);
        }
    }

    /// Moves what passes add up to or from a checkpoint, another run's state or another process.
    pub(super) fn exchange(&mut self, tape: &mut Tape<'_>) -> io::Result<()> {
        tape.count(&mut self.photons_emitted)?;
        tape.count(&mut self.photons_stored)?;
        tape.count(&mut self.gather_rays)?;
        self.flux.exchange(tape)
    }
}
