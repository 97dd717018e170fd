//! luxmap computes how bright a room is: illuminance in lux, by photon mapping, from a scene file to EXR.
//!
//! The modules follow the path of the light.
//!
//! 1. A [`scene`] file is read: meshes, materials, luminaires, measuring planes; validated, in metres, recentred.
//! 2. A [`scene::plan`] says what this scene needs and what can be left out.
//! 3. The [`luminaire`]s emit photons, shared among them by their flux.
//! 4. [`photon`]s fly through the mesh, which [`embree`] holds, from bounce to bounce until roulette ends them.
//! 5. Where they land, or cross a measuring plane, is kept: on patches of surfaces, in a [`photon_map`].
//! 6. Every point of a plane [`gather`]s: direct light cut exactly, bounced light by rays to the patches or from the
//!    photons nearest to it.
//! 7. [`render`](mod@render) runs these steps in order and keeps the books on time, flux and error.
//! 8. A [`report`] writes EXR, PNG, CSV, JSON and HTML; the [`cli`] is the command around it all.
//!
//! Passes add up in a [`state`], which can be kept, continued and merged; a [`batch`] is a list of runs that survives what
//! may befall it. [`convergence`] asks how right the result is for the time it takes, [`check`] whether extreme cases break it,
//! [`trees`] which kd-tree is the quickest;
//! an [`office`] is made up where none is at hand.

pub mod batch;
pub mod cli;
pub mod control;
pub mod dimming;
pub mod embree;
pub mod error;
pub mod files;
pub mod flux;
pub mod gather;
pub mod geometry;
pub mod job;
pub mod luminaire;
pub mod office;
pub mod options;
pub mod photon;
pub mod photon_map;
pub mod progress;
pub mod random;
pub mod render;
pub mod report;
pub mod results;
pub mod scene;
mod sets;
pub mod state;
pub mod study;
mod text;
pub mod units;
