//! Studies of luxmap itself: is it right for the time it takes, does it break, which tree is the quickest.

pub mod check;
pub mod convergence;
pub mod trees;
