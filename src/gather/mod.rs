//! From photons to lux: every point of every measuring plane, every pixel of every camera.

pub mod bandwidth;
pub mod camera;
pub mod caustics;
pub mod cell_counts;
pub mod counts;
pub mod density;
pub mod direct;
pub mod gates;
pub mod lamps;
pub mod meter;
pub mod parts;
pub mod patches;
pub mod reach;
pub mod receiver;
pub mod sight;
pub mod smooth;
pub mod visible;
pub mod witness;

pub use receiver::Receiver;

/// Part of the way to a luminaire without extent that a shadow ray goes: short of what the luminaire may be mounted on.
const JUST_BEFORE: f64 = 1.0 - 1e-5;
