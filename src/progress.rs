//! How far a run has come, for a program that wants to show it.

/// Hears how far a run has come.
pub trait Progress: Sync {
    /// A stage of `steps` steps begins.
    fn stage(&self, name: &'static str, steps: u64);
    /// `steps` more are done.
    fn advance(&self, steps: u64);
    /// A pass is over; the worst map's claimed standard error is now `percent` of its mean.
    fn pass(&self, _passes: u32, _percent: f64) {}
    /// Whether the run is to end after the current pass.
    fn interrupted(&self) -> bool {
        false
    }
}

/// Reports to nobody.
impl Progress for () {
    fn stage(&self, _: &'static str, _: u64) {}
    fn advance(&self, _: u64) {}
}
