//! Photons: how their randomness is dealt, what they carry, how they travel.

pub mod emit;
pub(crate) mod media;
pub(crate) mod optics;
pub(crate) mod rough;
pub(crate) mod surface;
pub mod trace;
pub mod trial;

pub use trace::{Tally, Tracer};
