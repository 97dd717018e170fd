//! Which tree holds the photons: a choice by name.

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
