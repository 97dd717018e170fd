//! luxmap computes how bright a room is: illuminance in lux, by photon mapping, from a scene file to EXR.
//!
//! ```
//! # std::env::set_current_dir(env!("CARGO_MANIFEST_DIR")).expect("the folder of the crate");
//! let results = luxmap::Job::load("scenes/box.toml")?.error(5.0).run()?;
//! results.write("out/box")?;
//! println!("{} passes, ± {:.1} %", results.run.passes, 100.0 * results.run.claim);
//! # Ok::<(), luxmap::Error>(())
//! ```
//!
//! # The front door
//!
//! A [`Job`] is a [`Scene`] and what was chosen for its run: [`Method`], photons, seed, light groups, dimming levels, a
//! checkpoint, and when to [`Stop`]. [`Job::load`] reads a scene file; [`SceneBuilder`] makes a scene in memory, by the
//! same rules. [`Job::run`] returns [`Results`]: a map of each measuring plane, readings of sensors, images of cameras,
//! with the standard error of each value. [`Results::write`] leaves EXR, PNG, CSV, JSON and HTML in a folder.
//! [`Job::influence`] tells what each luminaire brings to each sensor, [`Job::dim`] which levels reach every target at
//! least power. A mistake is an [`Error`]; where a file is to blame, it says at which [`Location`]. The folder
//! `examples` has a program for each of these.
//!
//! Everything that is not listed here serves the command, tests and benches, and may change without notice.
//!
//! # A tour of the source
//!
//! The modules follow the path of the light.
//!
//! 1. A scene file is read (`scene`): meshes, materials, luminaires, measuring planes; validated, in metres, recentred.
//! 2. A plan (`render::plan`) says what this scene needs and what can be left out.
//! 3. The luminaires (`luminaire`) emit photons, shared among them by their flux.
//! 4. Photons (`photon`) fly through the mesh, which Embree holds (`embree`), from bounce to bounce until roulette ends
//!    them.
//! 5. Where they land, or cross a measuring plane, is kept: on patches of surfaces, in a [`photon_map`].
//! 6. Every point of a plane gathers (`gather`): direct light cut exactly, bounced light by rays to the patches or from
//!    the photons nearest to it.
//! 7. `render` runs these steps in order and keeps the books on time, flux and error.
//! 8. `report` writes EXR, PNG, CSV, JSON and HTML; `job` is the front door, `cli` the command around it all.
//!
//! Passes add up in a `state`, which can be kept, continued and merged; a `batch` is a list of runs that survives what
//! may befall it. `study` asks how right results are for their time, whether extreme cases break them, and which
//! kd-tree is the quickest; an `office` is made up where none is at hand.

#[doc(hidden)]
pub mod batch;
#[doc(hidden)]
pub mod cli;
#[doc(hidden)]
pub mod control;
#[doc(hidden)]
pub mod dimming;
#[doc(hidden)]
pub mod embree;
#[doc(hidden)]
pub mod error;
#[doc(hidden)]
pub mod files;
#[doc(hidden)]
pub mod flux;
#[doc(hidden)]
pub mod gather;
#[doc(hidden)]
pub mod geometry;
#[doc(hidden)]
pub mod job;
#[doc(hidden)]
pub mod luminaire;
#[doc(hidden)]
pub mod office;
#[doc(hidden)]
pub mod options;
#[doc(hidden)]
pub mod photon;
pub mod photon_map;
#[doc(hidden)]
pub mod progress;
#[doc(hidden)]
pub mod random;
#[doc(hidden)]
pub mod render;
#[doc(hidden)]
pub mod report;
#[doc(hidden)]
pub mod results;
#[doc(hidden)]
pub mod scene;
mod sets;
#[doc(hidden)]
pub mod state;
#[doc(hidden)]
pub mod study;
mod text;
#[doc(hidden)]
pub mod units;

pub use dimming::{Goal, Influence};
pub use error::{Error, InputError, Location, OptionError};
pub use job::{Dimmed, Job};
pub use options::{Method, Options};
pub use photon_map::Tree;
pub use progress::Progress;
pub use render::Stop;
pub use render::plan::Plan;
pub use results::{CameraImage, IlluminanceMap, Results, SensorReading, SurfaceMap};
pub use scene::{Dimming, Lamp, Levels, LoadOptions, PlaneKind, Reflectance, Scene, SceneBuilder};
