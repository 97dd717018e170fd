//! From photons to lux: every point of every measuring plane, one query each.

pub mod bandwidth;
pub mod bodies;
pub mod counts;
pub mod density;
pub mod direct;
pub mod gates;
pub mod lamps;
pub mod patches;
pub mod reach;
pub mod receiver;
pub mod sight;
pub mod smooth;
pub mod surroundings;

pub use receiver::Receiver;
