//! From photons to lux: every point of every measuring plane, one query each.

pub mod density;
pub mod direct;
pub mod reach;
pub mod receiver;
pub mod surroundings;

pub use receiver::Receiver;
