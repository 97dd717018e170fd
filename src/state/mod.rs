//! What a run knows after some passes, kept so that it can be continued, and added to what other runs know.
//!
//! Everything that passes leave behind is a [`Sum`], a count, or a list of photons that knows its pass. So states of
//! different passes add up to what one run of all of them would hold, to the bit, in any order: a run that was killed
//! goes on from its [`mod@file`], jobs of a cluster are merged, and processes that share a run send their parts as a
//! [`tape`].

pub mod file;
mod passes;
mod sum;
pub mod tape;

pub use passes::{PassRange, Passes};
pub use sum::Sum;
