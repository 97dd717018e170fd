//! Light groups: luminaires for which results are kept apart.

use std::collections::HashMap;

use super::Luminaire;

/// The light groups of a scene, numbered in the order in which the luminaires name them first.
///
/// Light of all groups lies in rows of numbers, one row for each point: channel by channel within a group, group by
/// group, filled up to whole vectors.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LightGroups {
    names: Vec<String>,
    of_luminaire: Vec<u32>,
}

/// Numbers in a row are a multiple of this: a vector of the least processor.
const VECTOR: usize = 4;

impl LightGroups {
    /// Those of the luminaires given, which are numbered in this order.
    pub fn of(luminaires: &[Luminaire]) -> Self {
        let mut names = Vec::new();
        let mut numbers: HashMap<&str, u32> = HashMap::new();
        let of_luminaire = luminaires
            .iter()
            .map(|luminaire| {
                *numbers.entry(&luminaire.group).or_insert_with(|| {
                    names.push(luminaire.group.clone());
                    names.len() as u32 - 1
                })
            })
            .collect();
        Self { names, of_luminaire }
    }

    /// Their names.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.names.len()
    }

    /// Whether nothing shines.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    /// The group of a luminaire.
    #[inline]
    pub fn group(&self, luminaire: u32) -> u32 {
        self.of_luminaire[luminaire as usize]
    }

    /// Numbers in a row of light in `C` channels.
    pub fn width<const C: usize>(&self) -> usize {
        (self.len() * C).next_multiple_of(VECTOR)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::luminaire::{Distribution, Opening};
    use crate::units::Lumens;
    use glam::DVec3;

    #[test]
    fn groups_are_numbered_by_first_appearance() {
        let luminaire = |group: &&str| Luminaire {
            name: format!("lamp of {group}"),
            group: (*group).into(),
            flux: Lumens(1.0),
            colour: [1.0; 3],
            opening: Opening::Point { position: DVec3::ZERO, aim: DVec3::NEG_Z },
            distribution: Distribution::Isotropic,
            body: Vec::new(),
            supply: Default::default(),
        };
        let luminaires: Vec<Luminaire> = ["row 1", "wall", "row 1", "row 2", "wall"].iter().map(luminaire).collect();
        let groups = LightGroups::of(&luminaires);
        assert_eq!(groups.names(), ["row 1", "wall", "row 2"]);
        let numbers: Vec<u32> = (0..5).map(|luminaire| groups.group(luminaire)).collect();
        assert_eq!(numbers, [0, 1, 0, 2, 1]);
        assert_eq!((groups.width::<1>(), groups.width::<3>()), (4, 12));
    }
}
