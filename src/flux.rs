//! Flux in one channel or in three: colourless scenes pay for one.

/// Luminous flux of a photon, lm: `C` = 1 photometric, `C` = 3 linear Rec. 709 channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flux<const C: usize>(pub [f32; C]);

impl<const C: usize> Flux<C> {
    /// No light.
    pub const DARK: Self = Self([0.0; C]);

    /// This flux through a filter: each channel times its share.
    #[inline]
    pub fn filtered(self, shares: [f32; C]) -> Self {
        Self(std::array::from_fn(|c| self.0[c] * shares[c]))
    }

    /// Every channel times `factor`.
    #[inline]
    pub fn scaled(self, factor: f32) -> Self {
        Self(self.0.map(|channel| channel * factor))
    }

    /// The largest channel.
    #[inline]
    pub fn brightest(self) -> f32 {
        self.0.iter().copied().fold(0.0, f32::max)
    }
}

/// Channels of a photometric or RGB quantity given as linear Rec. 709: itself, or its luminance.
pub fn channels<const C: usize>(rgb: [f64; 3]) -> [f64; C] {
    std::array::from_fn(|c| if C == 1 { crate::units::luminance(rgb) } else { rgb[c] })
}

/// Photometric value of a quantity in `C` channels.
pub fn photometric<const C: usize>(value: [f64; C]) -> f64 {
    if C == 1 { value[0] } else { crate::units::luminance(std::array::from_fn(|c| value[c])) }
}

/// Adds `value` times `weight` to a sum kept in double precision.
#[inline]
pub fn accumulate<const C: usize>(sum: &mut [f64; C], value: Flux<C>, weight: f64) {
    for (total, channel) in sum.iter_mut().zip(value.0) {
        *total += f64::from(channel) * weight;
    }
}
