//! An open-plan office of any size, made up by rule: large, realistic scenes that anybody can make again, byte by byte.
//!
//! [`plan`] says where everything stands, [`furniture`] what it looks like, [`shapes`] how that becomes triangles,
//! [`write`](mod@write) how those become files. Furniture is made once for all that look alike, so memory grows with
//! the detail, and hardly with the number of workstations.
//!
//! All is computed by + − × ÷ and √, which every machine rounds alike, and from [`Seed`](crate::random::Seed):
//! the same parameters give the same bytes.
//!
//! Triangles: each workstation has about 2200 of them at detail 1, 13 000 at 2, 94 000 at 5 and 560 000 at 16: the
//! finest edges stop at 1.5 mm, and the keys of keyboards come in at detail 3. [`Office::triangles`] counts them
//! exactly.

pub mod exact;
pub mod furniture;
pub mod plan;
pub mod shapes;
pub mod write;

use std::ops::RangeInclusive;

pub use self::plan::Office;
use crate::error::{Error, OptionError};

/// What the windows are at night.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Windows {
    /// Dark panes that mirror 8 % and reflect 2 % diffusely; nothing comes through.
    #[default]
    Glass,
    /// Dull panes, reflectance 0.1: the scene needs no caustics.
    Matte,
    /// Plain walls.
    None,
}

impl Windows {
    /// All, by the names that the command knows.
    pub const ALL: [(&'static str, Self); 3] = [("glass", Self::Glass), ("matte", Self::Matte), ("none", Self::None)];

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, windows)| *windows == self).map_or("", |(name, _)| name)
    }
}

/// What an office is made from.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameters {
    /// Workstations; the floor grows with them, by 34.56 m² for six.
    pub workstations: u32,
    /// How finely curves and faces are cut: triangles grow with its square at first, more slowly later.
    pub detail: u32,
    /// Of what stands on the desks, and how chairs are turned.
    pub seed: u64,
    /// Clear height of the room, m.
    pub height: f64,
    /// What the windows are.
    pub windows: Windows,
    /// About how many panel luminaires; `None`: six for six workstations, 2.4 m apart.
    pub luminaires: Option<u32>,
    /// Mean illuminance that the flux is chosen for, at 0.75 m, lx.
    pub illuminance: f64,
    /// Grid step of the measuring planes, m, about.
    pub cell: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            workstations: 24,
            detail: 2,
            seed: 0,
            height: 2.8,
            windows: Windows::Glass,
            luminaires: None,
            illuminance: 500.0,
            cell: 0.1,
        }
    }
}

impl Parameters {
    /// Allowed numbers of workstations.
    pub const WORKSTATIONS: RangeInclusive<u32> = 1..=10_000;
    /// Allowed details.
    pub const DETAIL: RangeInclusive<u32> = 1..=32;
    /// Allowed heights, m.
    pub const HEIGHT: RangeInclusive<f64> = 2.4..=6.0;
    /// Allowed illuminances, lx.
    pub const ILLUMINANCE: RangeInclusive<f64> = 1.0..=10_000.0;
    /// Allowed grid steps, m.
    pub const CELL: RangeInclusive<f64> = 0.01..=1.2;

    /// Refuses what no office can be made of.
    pub fn check(&self) -> Result<(), Error> {
        fn within<T: PartialOrd + std::fmt::Display>(
            option: &'static str,
            value: T,
            allowed: &RangeInclusive<T>,
        ) -> Result<(), Error> {
            if allowed.contains(&value) {
                return Ok(());
            }
            let (least, most) = (allowed.start(), allowed.end());
            let (found, expected) = (value.to_string(), format!("a number from {least} to {most}"));
            Err(OptionError::Value { option, found, expected }.into())
        }
        within("workstations", self.workstations, &Self::WORKSTATIONS)?;
        within("detail", self.detail, &Self::DETAIL)?;
        within("height", self.height, &Self::HEIGHT)?;
        within("illuminance", self.illuminance, &Self::ILLUMINANCE)?;
        within("cell", self.cell, &Self::CELL)?;
        within("luminaires", self.luminaires.unwrap_or(1), &(1..=1_000_000))
    }

    /// The detail whose office comes nearest to so many triangles, as a ratio. Cost: making the furniture of some six
    /// offices.
    pub fn with_triangles(mut self, triangles: u64) -> Result<Self, Error> {
        let count = |detail: u32| Ok::<_, Error>(Office::new(Self { detail, ..self.clone() })?.triangles());
        let (mut low, mut high) = (*Self::DETAIL.start(), *Self::DETAIL.end());
        // Highest detail with at most so many triangles, if any.
        while low < high {
            let middle = (low + high).div_ceil(2);
            if count(middle)? <= triangles { low = middle } else { high = middle - 1 }
        }
        let next = (low + 1).min(*Self::DETAIL.end());
        let (below, above) = (count(low)? as f64, count(next)? as f64);
        let target = triangles as f64;
        self.detail = if target * target > below * above { next } else { low };
        Ok(self)
    }
}
