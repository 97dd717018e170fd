//! Who lights what, and what to do with it: the influence of every luminaire on every sensor, dimming levels that reach
//! what workers ask for at least power, and control loops that look for them.

pub mod influence;
pub mod page;
pub mod report;
mod solve;
pub mod sure;
pub mod verify;

pub use influence::Influence;
pub use solve::{Answer, Goal, solve};
