//! Light straight from luminaires, cut exactly where luminaires are flat or bodies: no pass makes it better.

use super::{LightOrigin, LightPart};
use crate::gather::density::Estimate;
use crate::gather::direct::{DirectGroups, DirectLight};

/// Bytes that a point takes, by channels.
pub fn bytes_per_point(channels: u64) -> u64 {
    8 * channels + 16
}

impl<const C: usize> LightPart<C> for DirectLight<C> {
    fn source(&self) -> LightOrigin {
        LightOrigin::Luminaires
    }

    fn straight(&self, point: usize) -> Estimate<C> {
        Estimate { value: self.value[point], variance: self.variance[point] }
    }

    fn straight_groups(&self) -> Option<&DirectGroups> {
        self.groups.as_ref()
    }

    fn variance_of_sum(&self, weighted: &[(usize, f64)]) -> Option<f64> {
        Some(weighted.iter().map(|&(point, weight)| weight * weight * self.variance[point]).sum())
    }

    fn left_out_share(&self) -> Option<[f64; 2]> {
        Some(DirectLight::left_out_share(self))
    }
}
