//! When a run ends.

use std::num::NonZeroU32;
use std::time::Duration;

use crate::error::OptionError;

/// When a run ends: after so many passes, at an error, before a time is over, whichever comes first. A run without any
/// of them goes on until it is interrupted, so it has to be asked for: [`Stop::when_interrupted`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    passes: Option<NonZeroU32>,
    error: Option<f64>,
    time: Option<Duration>,
}

impl Stop {
    /// After so many passes; at least one is run.
    pub const fn after(passes: u32) -> Self {
        Self::when_interrupted().or_after(passes)
    }

    /// When the claimed standard error of every map, or of every sensor where there is no map, is at most so many % of
    /// its mean; where there are only cameras, that of every image. It is above 0, or the run is refused.
    pub const fn at_error(percent: f64) -> Self {
        Self::when_interrupted().or_at_error(percent)
    }

    /// Before this wall time is over, but for the first pass.
    pub const fn within(time: Duration) -> Self {
        Self::when_interrupted().or_within(time)
    }

    /// Never by itself: when [`Progress::interrupted`](crate::progress::Progress::interrupted) says so.
    pub const fn when_interrupted() -> Self {
        Self { passes: None, error: None, time: None }
    }

    /// Also after so many passes; at least one is run.
    pub const fn or_after(self, passes: u32) -> Self {
        let passes = match NonZeroU32::new(passes) {
            Some(passes) => passes,
            None => NonZeroU32::MIN,
        };
        Self { passes: Some(passes), ..self }
    }

    /// Also at an error; see [`Stop::at_error`].
    pub const fn or_at_error(self, percent: f64) -> Self {
        Self { error: Some(percent), ..self }
    }

    /// Also before this wall time is over; see [`Stop::within`].
    pub const fn or_within(self, time: Duration) -> Self {
        Self { time: Some(time), ..self }
    }

    /// By what is given; `None` where nothing is.
    pub(crate) fn by(passes: Option<NonZeroU32>, error: Option<f64>, time: Option<Duration>) -> Option<Self> {
        let given = passes.is_some() || error.is_some() || time.is_some();
        given.then_some(Self { passes, error, time })
    }

    /// Passes at most.
    pub fn passes(&self) -> Option<u32> {
        self.passes.map(NonZeroU32::get)
    }

    /// Standard error that is enough, % of the mean.
    pub fn error(&self) -> Option<f64> {
        self.error
    }

    /// Wall time at most, but for the first pass.
    pub fn time(&self) -> Option<Duration> {
        self.time
    }

    /// Refuses an error that can't be reached: a run for it would never end.
    pub(crate) fn check(&self) -> Result<(), OptionError> {
        match self.error {
            Some(percent) if !(percent > 0.0 && percent.is_finite()) => Err(OptionError::Value {
                option: "error",
                found: percent.to_string(),
                expected: "a number above 0, %".into(),
            }),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_add_up_and_nothing_is_no_limit() {
        let stop = Stop::after(3).or_at_error(0.5).or_within(Duration::from_secs(2));
        assert_eq!((stop.passes(), stop.error(), stop.time()), (Some(3), Some(0.5), Some(Duration::from_secs(2))));
        assert_eq!(Stop::after(0).passes(), Some(1));
        assert_eq!(Stop::by(None, None, None), None);
        assert_eq!(Stop::by(NonZeroU32::new(3), Some(0.5), Some(Duration::from_secs(2))), Some(stop));
    }

    #[test]
    fn an_error_that_is_never_reached_is_refused() {
        for percent in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let error = Stop::at_error(percent).check().expect_err("a run without end").to_string();
            assert_eq!(error, format!("error: found {percent}, expected a number above 0, %"));
        }
        assert_eq!(Stop::at_error(1e-6).check(), Ok(()));
    }
}
