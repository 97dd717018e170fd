//! Photons: how their randomness is dealt, what they carry, how they travel.

pub mod flux;
pub(crate) mod media;
pub mod random;
pub(crate) mod rough;
pub(crate) mod surface;
pub mod trace;
pub mod trial;

pub use flux::Flux;
pub use random::{Seed, Stream};
pub use trace::{Tally, Tracer};
