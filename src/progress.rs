//! How far a run has come, told to whoever listens.

/// Hears how far a run has come.
pub trait Progress: Sync {
    /// A stage of `steps` steps begins.
    fn stage(&self, name: &'static str, steps: u64);
    /// `steps` more are done.
    fn advance(&self, steps: u64);
    /// A pass is over; the worst map's claimed standard error is now `percent` of its mean.
    fn pass(&self, _passes: u32, _percent: f64) {}
    /// Whether the run shall end after the pass in hand.
    fn interrupted(&self) -> bool {
        false
    }
}

/// Hears nothing.
impl Progress for () {
    fn stage(&self, _: &'static str, _: u64) {}
    fn advance(&self, _: u64) {}
}
