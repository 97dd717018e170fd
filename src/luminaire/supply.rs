//! What a luminaire draws, and how far it dims.

use serde::{Deserialize, Serialize};

/// The electrical side of a luminaire: level 1 is full output, 0 is off.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Supply {
    /// Dimming level, 0 … 1.
    pub level: f64,
    /// Lowest level above off; 0 where it dims steplessly.
    pub least: f64,
    /// Power when off, W.
    pub off: f64,
    /// Power over level, W, straight between these points: levels ascend from `least` to 1. None where nothing is
    /// given.
    pub power: Option<Vec<[f64; 2]>>,
}

impl Default for Supply {
    fn default() -> Self {
        Self { level: 1.0, least: 0.0, off: 0.0, power: None }
    }
}

impl Supply {
    /// Power at a level, W: nothing where none is given.
    pub fn power_at(&self, level: f64) -> Option<f64> {
        let points = self.power.as_ref()?;
        if level <= 0.0 {
            return Some(self.off);
        }
        Some(along(points, level))
    }
}

/// A curve of straight pieces at a level; beyond its ends as at them.
pub(crate) fn along(points: &[[f64; 2]], level: f64) -> f64 {
    let upper = points.partition_point(|[at, _]| *at < level).clamp(1, points.len().max(2) - 1);
    match (points.get(upper - 1), points.get(upper)) {
        (Some([a, from]), Some([b, to])) => from + (to - from) * ((level - a) / (b - a)).clamp(0.0, 1.0),
        (Some([_, only]), None) => *only,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_runs_straight_between_its_points_and_jumps_when_off() {
        let supply =
            Supply { least: 0.1, off: 0.5, power: Some(vec![[0.1, 5.0], [0.5, 9.0], [1.0, 30.0]]), level: 1.0 };
        for (level, power) in [(0.0, 0.5), (0.1, 5.0), (0.3, 7.0), (0.5, 9.0), (0.75, 19.5), (1.0, 30.0)] {
            let found = supply.power_at(level).expect("it is given");
            assert!((found - power).abs() < 1e-12, "{level}: {found} W");
        }
        assert_eq!(Supply::default().power_at(0.5), None);
    }
}
