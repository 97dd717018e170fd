//! What a surface does with light: Lambertian, mirror, glass.

/// A surface. What is neither reflected nor refracted is absorbed.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name, as `usemtl` gives it.
    pub name: String,
    /// Lambertian reflectance ρ of each channel, linear Rec. 709, 0 ≤ ρ ≤ 1.
    pub reflectance: [f64; 3],
    /// Mirror reflectance of each channel; reflectance + specular ≤ 1.
    pub specular: [f64; 3],
    /// Smooth glass: overrides the two above.
    pub dielectric: Option<Dielectric>,
}

/// A smooth clear solid; its outside is where its normals point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Index of refraction, relative to air.
    pub ior: f64,
    /// Absorption coefficient inside, 1/m (Beer–Lambert).
    pub absorption: f64,
}

impl Material {
    /// A surface that absorbs all it meets.
    pub fn black(name: impl Into<String>) -> Self {
        Self { name: name.into(), reflectance: [0.0; 3], specular: [0.0; 3], dielectric: None }
    }

    /// Whether light leaves this surface in a mirrored or refracted direction.
    pub fn is_specular(&self) -> bool {
        self.dielectric.is_some() || self.specular.iter().any(|&part| part > 0.0)
    }

    /// Whether light leaves this surface at all.
    pub fn is_black(&self) -> bool {
        !self.is_specular() && self.reflectance.iter().all(|&part| part == 0.0)
    }

    /// Whether the three channels differ anywhere.
    pub fn is_coloured(&self) -> bool {
        [self.reflectance, self.specular].iter().any(|rgb| rgb[0] != rgb[1] || rgb[1] != rgb[2])
    }
}
