//! What a surface does with light: Lambertian, mirror, rough mirror, translucent sheet, clear sheet, solid of glass.
//!
//! Every share is that of the light that arrives, at any angle and in every channel: `reflectance` + `specular` +
//! `transmittance` ≤ 1, and the rest is absorbed. All surfaces are reciprocal (lamp and meter may change places).
//!
//! ```toml
//! [material.floor]                      # the OBJ's name for it; what stands here wins over its MTL file
//! reflectance = 0.2                     # Lambertian ρ, a number or [r, g, b] (linear Rec. 709)
//! specular = 0.04                       # share that is mirrored, a number or [r, g, b]
//! roughness = 0.3                       # 0 (default): a perfect mirror; else GGX's α, up to 1
//! [material.blind]
//! reflectance = 0.5
//! transmittance = 0.2                   # Lambertian, to the other side; a number or [r, g, b]
//! [material.backdrop]
//! reflectance = 0.8
//! sides = "one"                         # the back absorbs all; "two" (default): both sides are alike
//! [material.pane]
//! glazing = 0.88                        # a thin sheet of clear glass; see [`glazing`](super::glazing)
//! [material.lens]
//! dielectric = { ior = 1.5, absorption = [4.0, 1.0, 3.0] }   # a solid of glass; 1/m, a number or [r, g, b]
//! ```
//!
//! A rough mirror reflects `specular` of the light at every angle, whatever its roughness: Fresnel's rise towards
//! grazing angles is not modelled. `photon::rough` tells how light goes about among its facets.
//!
//! From MTL files come `Kd` (reflectance; times the mean colour of `map_Kd`, if it names a PNG or JPEG file), `Ks` with
//! `illum` 3 or 5 (specular) and `Ns` (roughness), `d`, `Tr`, `Tf` and `Ni` (glazing, dielectric) and `Ke` (luminance,
//! cd/m²). Programs mean different things by them: `dialect` tells how they are read. The rest is left out.
//!
//! A face that is drawn twice, once for each side, is one face whose [back](Material::back) is the other's material;
//! `double_faces` tells how they are found.

use std::sync::Arc;

use super::glazing::Glazing;

/// Rough mirrors below this GGX α reflect as sharply as perfect ones: what they throw is a caustic, and left to
/// photons. Above, rays find it.
pub const SHARP: f64 = 0.2;

/// A surface. What is neither reflected, transmitted nor refracted is absorbed.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name, as `usemtl` gives it.
    pub name: String,
    /// Lambertian reflectance ρ of each channel, linear Rec. 709, 0 ≤ ρ ≤ 1.
    pub reflectance: [f64; 3],
    /// Mirror reflectance of each channel; reflectance + specular + transmittance ≤ 1.
    pub specular: [f64; 3],
    /// GGX's α of the mirror, 0 (perfect) to 1.
    pub roughness: f64,
    /// Share of each channel that leaves the other side by Lambert's law.
    pub transmittance: [f64; 3],
    /// Which sides are so; the other absorbs all. Sheets and glass have two.
    pub sides: Sides,
    /// Smooth glass: overrides all of the above.
    pub dielectric: Option<Dielectric>,
    /// A thin sheet of clear glass: overrides all of the above.
    pub glazing: Option<Arc<Glazing>>,
    /// What the back is, where that is another material: one without a back of its own, opaque as the front is.
    pub back: Option<Arc<Material>>,
}

/// On which sides a material is what it says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sides {
    /// The front, where vertices run counter-clockwise; the back absorbs all.
    One,
    /// Both.
    #[default]
    Two,
}

/// A smooth clear solid; its outside is where its normals point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Index of refraction, relative to air.
    pub ior: f64,
    /// Absorption coefficient inside for each channel, 1/m (Beer–Lambert).
    pub absorption: [f64; 3],
}

impl Material {
    /// A surface that absorbs all it meets.
    pub fn black(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            reflectance: [0.0; 3],
            specular: [0.0; 3],
            roughness: 0.0,
            transmittance: [0.0; 3],
            sides: Sides::Two,
            dielectric: None,
            glazing: None,
            back: None,
        }
    }

    /// The front, and the back where that is another material.
    fn faces(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(self.back.as_deref())
    }

    /// Whether a mirror, perfect or rough, is part of its front.
    pub fn mirrors(&self) -> bool {
        self.specular.iter().any(|&part| part > 0.0)
    }

    /// Whether light leaves this surface in a mirrored or refracted direction, or nearly so: what makes caustics.
    pub fn is_specular(&self) -> bool {
        let pane = self.glazing.as_ref().is_some_and(|pane| pane.reflectance != [0.0; 3]);
        let sharp = |face: &Self| face.mirrors() && face.roughness < SHARP;
        pane || self.dielectric.is_some() || self.faces().any(sharp)
    }

    /// Whether light passes it, straight or refracted.
    pub fn is_clear(&self) -> bool {
        self.dielectric.is_some() || self.glazing.is_some()
    }

    /// Whether light leaves its other side by Lambert's law.
    pub fn is_translucent(&self) -> bool {
        self.transmittance.iter().any(|&part| part > 0.0)
    }

    /// Whether light leaves this surface by Lambert's law, on either side.
    pub fn is_diffuse(&self) -> bool {
        self.is_translucent() || self.faces().any(|face| face.reflectance.iter().any(|&part| part > 0.0))
    }

    /// Whether no light leaves this surface at all.
    pub fn is_black(&self) -> bool {
        !self.is_clear() && !self.is_diffuse() && !self.faces().any(Self::mirrors)
    }

    /// Whether the three channels differ anywhere.
    pub fn is_coloured(&self) -> bool {
        let absorption = self.dielectric.map_or([0.0; 3], |glass| glass.absorption);
        let pane = self.glazing.as_ref().map_or([[0.0; 3]; 2], |pane| [pane.transmittance, pane.reflectance]);
        let differ = |rgb: &[f64; 3]| rgb[0] != rgb[1] || rgb[1] != rgb[2];
        let own = |face: &Self| [face.reflectance, face.specular, face.transmittance].iter().any(differ);
        self.faces().any(own) || [absorption, pane[0], pane[1]].iter().any(differ)
    }
}
