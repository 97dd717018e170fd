//! Exact answers in closed form.

use std::f64::consts::PI;

/// E (lx), the mean over all surfaces of a closed enclosure of uniform reflectance ρ and area S (m²) in which Φ (lm) is
/// sent out: what surfaces absorb, (1 − ρ) E S, is Φ. In a cube with the source in the middle it is every face's mean,
/// by symmetry. CIE 171:2006, case 5.8, eq. 16, with the direct part.
pub fn closed_room(flux: f64, rho: f64, area: f64) -> f64 {
    flux / ((1.0 - rho) * area)
}

/// Relative standard error of that mean over one of a cube's six faces, found with so many photons: a photon lands L
/// times (mean 1/(1 − ρ), variance ρ/(1 − ρ)²), each time on that face with probability 1/6.
pub fn closed_room_noise(rho: f64, photons: f64) -> f64 {
    let (landings, spread) = (1.0 / (1.0 - rho), rho / (1.0 - rho).powi(2));
    (5.0 / 36.0 * landings + spread / 36.0).sqrt() / (landings / 6.0) / photons.sqrt()
}

/// E (lx) at every point of a closed enclosure whose surfaces all glow with the exitance M (lx) and reflect ρ, whatever
/// its shape: the exitance M + ρ E is the same everywhere, and a point that sees nothing else receives it: E = M + ρ E.
pub fn glowing_room(exitance: f64, rho: f64) -> f64 {
    exitance / (1.0 - rho)
}

/// E (lx) by a source without extent that sends out Φ (lm) alike all about, at distance d (m) under an angle of
/// incidence with cosine c: I c/d², I = Φ/4π.
pub fn point_source(flux: f64, distance: f64, cosine: f64) -> f64 {
    flux / (4.0 * PI) * cosine / (distance * distance)
}

/// The part of a hemisphere's light that comes from a rectangle a × b (m) at distance c (m), parallel to the receiver,
/// which is opposite one of its corners: Howell's catalogue of configuration factors, C-11.
pub fn parallel_corner(a: f64, b: f64, c: f64) -> f64 {
    let (x, y) = (a / c, b / c);
    let half = |x: f64, y: f64| x / x.hypot(1.0) * (y / x.hypot(1.0)).atan();
    (half(x, y) + half(y, x)) / (2.0 * PI)
}

/// E (lx) below a Lambertian rectangle with sides `size` (m) that sends out Φ (lm), parallel to the receiver at
/// distance c (m) and displaced from it by `away` (m, along each side): M F, F of four corners with their signs.
pub fn parallel_panel(flux: f64, size: [f64; 2], away: [f64; 2], c: f64) -> f64 {
    let edges = [0, 1].map(|axis| [away[axis] - size[axis] / 2.0, away[axis] + size[axis] / 2.0]);
    let signed = |a: f64, b: f64| parallel_corner(a.abs(), b.abs(), c) * a.signum() * b.signum();
    let corner = |i: usize, j: usize| signed(edges[0][i], edges[1][j]);
    flux / (size[0] * size[1]) * (corner(1, 1) - corner(0, 1) - corner(1, 0) + corner(0, 0))
}

/// The share of light sent out in the middle of a cube of clear glass that can't leave it: within the angle of total
/// reflection of a face lies 1 − √(1 − 1/n²) of a hemisphere; reflections in a cube only change the signs of a
/// direction's components, so whatever is not within it of one of the six axes stays for ever. From n = √2 on the six
/// cones don't meet.
pub fn trapped_in_cube(n: f64) -> f64 {
    1.0 - 3.0 * (1.0 - (1.0 - 1.0 / (n * n)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// CIE 171:2006, case 5.3: a square metre of 1000 cd/m² in a ceiling 3 m up, points of the floor.
    #[test]
    fn panel_of_case_5_3() {
        for (y, expected) in [(0.25, 61.424), (0.75, 79.255), (1.25, 95.667), (1.75, 105.778)] {
            let found = parallel_panel(1000.0 * PI, [1.0, 1.0], [0.0, y - 2.0], 3.0);
            assert!((found / expected - 1.0).abs() < 1e-5, "{y}: {found}");
        }
    }

    /// By counting directions: those of which no component is above √(1 − 1/n²).
    #[test]
    fn trapped_share_by_counting() {
        let (n, steps) = (1.5_f64, 1000);
        let most = (1.0 - 1.0 / (n * n)).sqrt();
        let mut kept = 0;
        for i in 0..steps {
            let z = (f64::from(i) + 0.5) / f64::from(steps);
            for j in 0..steps {
                let (sin, cos) = (0.5 * PI * (f64::from(j) + 0.5) / f64::from(steps)).sin_cos();
                let radius = (1.0 - z * z).sqrt();
                kept += i32::from(z < most && radius * sin < most && radius * cos < most);
            }
        }
        let found = f64::from(kept) / f64::from(steps * steps);
        assert!((found - trapped_in_cube(n)).abs() < 1e-3, "{found}, {}", trapped_in_cube(n));
    }
}
