//! All integration tests in one program: luxmap is linked once, and all tests share the machine's cores.
//!
//! Each module is one subject. Tests run at the same time in one process, so none may change what belongs to the process:
//! its current folder, its environment, its signals, rayon's global pool. What needs these, or measures the memory of a
//! process, starts the command `luxmap` as a process of its own.

mod common;

mod bands;
mod batch;
mod cameras;
mod caustics;
mod cie171;
mod cli;
mod control;
mod converge;
mod dimming;
mod documents;
mod embree;
mod examples;
mod extremes;
mod faults;
mod floors;
mod glazing;
mod groups;
mod honesty;
mod hostile;
mod keeping;
mod licences;
mod live;
mod luminaire_sheet;
mod luminaires;
mod material_files;
mod materials;
mod measured;
mod methods;
mod mpi;
mod mtl_foreign;
mod obj_foreign;
mod office;
mod photometry;
mod photometry_foreign;
mod physics;
mod places;
mod reachable;
mod reference;
mod same_seed;
mod scale;
mod scene_errors;
mod scene_geometry;
mod stability;
mod surfaces;
mod trees;
mod trees_agree;
