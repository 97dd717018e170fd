//! The library tree: kiddo's immutable kd-tree. (Its mutable one refuses photons that share a coordinate, as all the
//! photons of a floor do.)

use std::num::NonZero;

use ::kiddo::{Eytzinger, ImmutableKdTree, QueryScratch, SquaredEuclidean};

use super::NearestPhotons;

/// kiddo's `ImmutableKdTree` with its scratch memory reused.
pub struct Kiddo {
    /// `None` for the empty map.
    tree: Option<ImmutableKdTree<f32, 3>>,
}

impl NearestPhotons for Kiddo {
    type Scratch = QueryScratch<Eytzinger, f32, 3>;

    fn build(positions: &[[f32; 3]]) -> Self {
        let tree = (!positions.is_empty())
            .then(|| ImmutableKdTree::new_from_slice(positions).expect("finite positions make an immutable tree"));
        Self { tree }
    }

    fn scratch(&self) -> Self::Scratch {
        QueryScratch::new()
    }

    fn visit_nearest(
        &self,
        at: [f32; 3],
        k: usize,
        radius: f32,
        scratch: &mut Self::Scratch,
        mut visit: impl FnMut(usize, f32),
    ) {
        let Some(tree) = &self.tree else { return };
        let Some(k) = NonZero::new(k.min(tree.size())) else { return };
        let found = tree
            .query(&at)
            .nearest_n::<SquaredEuclidean<f32>>(k)
            .within(radius * radius)
            .unsorted()
            .with_scratch(scratch)
            .execute();
        found.into_iter().for_each(|photon| visit(photon.item as usize, photon.distance));
    }

    fn visit_within(&self, at: [f32; 3], radius: f32, scratch: &mut Self::Scratch, mut visit: impl FnMut(usize, f32)) {
        let Some(tree) = &self.tree else { return };
        tree.query(&at)
            .within::<SquaredEuclidean<f32>>(radius * radius)
            .unsorted()
            .with_scratch(scratch)
            .visit(|photon| visit(photon.item as usize, photon.distance));
    }
}
