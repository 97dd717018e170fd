//! Which tree holds the photons: a choice by name, and a photon map in the tree chosen.

use super::{BruteForce, KdTree, Kiddo, Paper, PhotonMap};
use crate::flux::Flux;

/// Which tree holds the photons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tree {
    /// luxmap's own kd-tree.
    Kd,
    /// kiddo's immutable kd-tree.
    Kiddo,
    /// The paper's tree.
    Paper,
    /// No tree: every photon is looked at.
    Brute,
}

impl Tree {
    /// Every tree, by name.
    pub const ALL: [(&'static str, Self); 4] =
        [("kd", Self::Kd), ("kiddo", Self::Kiddo), ("paper", Self::Paper), ("brute", Self::Brute)];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Kd => "kd",
            Self::Kiddo => "kiddo",
            Self::Paper => "paper",
            Self::Brute => "brute",
        }
    }
}

/// A photon map in the tree that was chosen while the program ran; [`with_tree`] asks it.
pub enum ChosenMap<const C: usize> {
    /// In luxmap's own kd-tree.
    Kd(PhotonMap<KdTree, C>),
    /// In kiddo's.
    Kiddo(PhotonMap<Kiddo, C>),
    /// In the paper's.
    Paper(PhotonMap<Paper, C>),
    /// In none.
    Brute(PhotonMap<BruteForce, C>),
}

/// The same expression for a [`ChosenMap`] in whichever tree: `with_tree!(map, |map| map.len())`.
macro_rules! with_tree {
    ($chosen:expr, |$map:ident| $ask:expr) => {
        match $chosen {
            $crate::photon_map::ChosenMap::Kd($map) => $ask,
            $crate::photon_map::ChosenMap::Kiddo($map) => $ask,
            $crate::photon_map::ChosenMap::Paper($map) => $ask,
            $crate::photon_map::ChosenMap::Brute($map) => $ask,
        }
    };
}
pub(crate) use with_tree;

impl<const C: usize> ChosenMap<C> {
    /// Builds the tree over photons at `positions` (m, finite) that carry `flux` (lm); each with a mark, if there are
    /// marks.
    pub fn build(
        tree: Tree,
        positions: Vec<[f32; 3]>,
        flux: Vec<Flux<C>>,
        marks: Option<impl Iterator<Item = u32>>,
    ) -> Self {
        macro_rules! build {
            ($variant:ident) => {
                Self::$variant(match marks {
                    None => PhotonMap::build(positions, flux),
                    Some(marks) => PhotonMap::build_marked(positions, flux, marks),
                })
            };
        }
        match tree {
            Tree::Kd => build!(Kd),
            Tree::Kiddo => build!(Kiddo),
            Tree::Paper => build!(Paper),
            Tree::Brute => build!(Brute),
        }
    }

    /// No photon, so no tree either.
    pub fn empty() -> Self {
        Self::Brute(PhotonMap::build(Vec::new(), Vec::new()))
    }

    /// Whether no photon is stored.
    pub fn is_empty(&self) -> bool {
        with_tree!(self, |map| map.is_empty())
    }
}
