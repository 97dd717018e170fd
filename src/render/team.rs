//! Processes that share the passes of a run.

use std::io;

/// A run's processes. Each does its own passes; the leader adds up, decides, and tells the others how to go on.
pub trait Team: Sync {
    /// Number of processes.
    fn size(&self) -> u32;

    /// Number of this one; 0 leads.
    fn rank(&self) -> u32;

    /// Sends what this process found to the leader, which gets that of all others, one after the other, by `hear`.
    fn hand_in(&self, found: &[u8], hear: &mut dyn FnMut(&[u8]) -> io::Result<()>) -> io::Result<()>;

    /// The leader's instruction, sent to all; whoever doesn't lead gives any of the same length.
    fn broadcast(&self, instruction: Instruction) -> Instruction;
}

/// The leader's instruction how the run goes on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Instruction {
    /// It ends.
    pub over: bool,
    /// Passes that are done.
    pub done: u32,
    /// Number of passes after which the error is asked for.
    pub next_check: u32,
    /// Images that are good enough.
    pub rest: Vec<bool>,
}

/// Processes that an MPI launcher says it started together; 1 where none says so.
pub fn launched() -> u32 {
    let told = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"].iter().find_map(|name| std::env::var(name).ok()?.parse().ok());
    told.unwrap_or(1)
}

/// One process.
pub struct Alone;

impl Team for Alone {
    fn size(&self) -> u32 {
        1
    }

    fn rank(&self) -> u32 {
        0
    }

    fn hand_in(&self, _: &[u8], _: &mut dyn FnMut(&[u8]) -> io::Result<()>) -> io::Result<()> {
        Ok(())
    }

    fn broadcast(&self, instruction: Instruction) -> Instruction {
        instruction
    }
}
