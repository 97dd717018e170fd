//! Files: read with bounds, written whole or not at all.

pub mod limits;
pub(crate) mod read;
pub(crate) mod write;

pub(crate) use read::*;
pub(crate) use write::*;
pub use write::{Claim, stems, stems_with_cameras};
