//! Luminaires of the scene file: arrays spread out, openings set up in space.

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::sync::Arc;

use glam::DVec3;

use super::Dimming;
use super::fields::{FARTHEST, Placed};
use super::file::{LuminaireSection, OpeningShape, duplicate};
use crate::error::{InputError, Location};
use crate::files::limits::{MOST_LUMINAIRES, MOST_OPENING_TRIANGLES};
use crate::geometry::body::Body;
use crate::luminaire::web::{Measured, Web};
use crate::luminaire::{Distribution, Luminaire, Opening, Supply, frame};
use crate::units::Lumens;

/// Corners of the polygon that stands for a disc. Its corners lie outside of the disc (by 0.08 % of the radius) so that
/// its area is the disc's.
const DISC_CORNERS: u32 = 64;

/// What a [[luminaire]] and its photometric file say together.
pub(crate) struct FixtureLight {
    pub(crate) shape: OpeningShape,
    pub(crate) spread: LampSpread,
    /// At full output, maintained, lm.
    pub(crate) flux: f64,
}

/// How light spreads, up to how a luminaire is turned.
pub(crate) enum LampSpread {
    Isotropic,
    Lambertian,
    Web(Arc<Web>),
}

/// One luminaire: a [[luminaire]], or a member of its array.
pub(crate) struct Fixture<'a> {
    pub(crate) section: &'a LuminaireSection,
    pub(crate) lamp: &'a FixtureLight,
    pub(crate) name: String,
    /// Dimming level, 0 … 1.
    pub(crate) level: f64,
    /// Middle of the opening, m.
    position: DVec3,
}

/// Every luminaire of the file, arrays row by row: along x first.
pub(crate) fn spread<'a>(
    sections: &'a [LuminaireSection],
    lamps: &'a [FixtureLight],
    dimming: &Dimming,
) -> Result<Vec<Fixture<'a>>, InputError> {
    let mut fixtures = Vec::new();
    let mut taken: HashMap<String, Location> = HashMap::new();
    let mut triangles = 0;
    for (section, lamp) in sections.iter().zip(lamps) {
        let count = section.array.as_ref().map_or([1, 1], |array| array.count);
        if fixtures.len() as u64 + count[0] * count[1] > MOST_LUMINAIRES {
            let found = format!("more than {MOST_LUMINAIRES} luminaires in all");
            return Err(InputError::new(section.name.at.clone(), found, format!("at most {MOST_LUMINAIRES}")));
        }
        triangles += member(section, lamp, 0, 0)?.body().1.len() * (count[0] * count[1]) as usize;
        if triangles > MOST_OPENING_TRIANGLES {
            let found = format!("openings of {triangles} triangles and more in all");
            let error = InputError::new(section.name.at.clone(), found, format!("at most {MOST_OPENING_TRIANGLES}"));
            return Err(error.hint("a rectangle has 2, a disc 62, a ball 320; a point has none"));
        }
        for row in 0..count[1] {
            for column in 0..count[0] {
                let mut fixture = member(section, lamp, column, row)?;
                fixture.level = dimming.level(&fixture.name, fixture.level);
                let name = Placed { value: fixture.name.clone(), at: section.name.at.clone() };
                if let Some(first) = taken.insert(fixture.name.clone(), section.name.at.clone()) {
                    return Err(duplicate("luminaire", &name, &first));
                }
                fixtures.push(fixture);
            }
        }
    }
    Ok(fixtures)
}

/// The member of a luminaire's array in `column` and `row`, or the luminaire itself.
fn member<'a>(
    section: &'a LuminaireSection,
    lamp: &'a FixtureLight,
    column: u64,
    row: u64,
) -> Result<Fixture<'a>, InputError> {
    let (name, level) = (section.name.value.clone(), section.supply.level);
    let Some(array) = &section.array else {
        return Ok(Fixture { section, lamp, name, level, position: section.position });
    };
    let position = section.position + DVec3::new(column as f64 * array.pitch[0], row as f64 * array.pitch[1], 0.0);
    let name = format!("{name}[{},{}]", column + 1, row + 1);
    if position.abs().max_element() > FARTHEST {
        let found = format!("luminaire {name} farther out than 1e9 m");
        return Err(InputError::new(array.at.clone(), found, "an array within 1e9 m of the origin"));
    }
    Ok(Fixture { section, lamp, name, level, position })
}

impl Fixture<'_> {
    /// The same luminaire moved `distance` along its aim if it has an area, and as seen from `origin`.
    pub(crate) fn shifted(&self, distance: f64, origin: DVec3) -> Self {
        let distance = if self.lamp.shape == OpeningShape::Point { 0.0 } else { distance };
        let position = self.position - origin + self.section.aim * distance;
        Self { section: self.section, lamp: self.lamp, name: self.name.clone(), level: self.level, position }
    }

    /// Directions of the opening's two sizes; their cross product is the aim.
    fn axes(&self) -> [DVec3; 2] {
        let c0 = frame::c0_direction(self.section.aim, self.section.rotation);
        [c0, self.section.aim.cross(c0)]
    }

    /// The opening in space.
    fn opening(&self) -> Opening {
        let (centre, aim, [u, v]) = (self.position, self.section.aim, self.axes());
        match self.lamp.shape {
            OpeningShape::Point => Opening::Point { position: centre, aim },
            OpeningShape::Rectangle([a, b]) => {
                Opening::Rectangle { centre, half_width: u * (a / 2.0), half_depth: v * (b / 2.0) }
            }
            OpeningShape::Disc { diameter } => Opening::Disc { centre, aim, radius: diameter / 2.0 },
            OpeningShape::Ellipse([a, b]) => {
                Opening::Ellipse { centre, half_width: u * (a / 2.0), half_depth: v * (b / 2.0) }
            }
            OpeningShape::Upright([a, b]) => {
                Opening::Ellipse { centre, half_width: v * (a / 2.0), half_depth: aim * (b / 2.0) }
            }
            OpeningShape::Solid(solid, [a, b, c], along) => {
                let mut half_axes = [u * (a / 2.0), v * (b / 2.0), aim * (c / 2.0)];
                half_axes.rotate_left((along + 1) % 3);
                Opening::Body(Body { solid, centre, half_axes })
            }
        }
    }

    /// Points that bound the opening.
    pub(crate) fn extremes(&self) -> Vec<DVec3> {
        let around = |centre: DVec3, a: DVec3, b: DVec3| vec![centre + a, centre - a, centre + b, centre - b];
        match self.opening() {
            Opening::Rectangle { centre, half_width: w, half_depth: d } => around(centre, w + d, w - d),
            Opening::Ellipse { centre, half_width, half_depth } => around(centre, half_width, half_depth),
            Opening::Disc { centre, radius, .. } => around(centre, self.axes()[0] * radius, self.axes()[1] * radius),
            Opening::Body(body) => body.bounds().to_vec(),
            Opening::Point { .. } | Opening::Triangles(_) => vec![self.position],
        }
    }

    /// Corners and triangles of the opening, counter-clockwise seen from where light goes; nothing for a point.
    pub(crate) fn body(&self) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let round = |centre: DVec3, u: DVec3, v: DVec3, half: f64| -> Vec<DVec3> {
            let step = TAU / f64::from(DISC_CORNERS);
            // (n/2) R² sin(2π/n) = π r²
            let radius = half * (step / step.sin()).sqrt();
            let corner =
                |i: u32| u * (radius * (step * f64::from(i)).cos()) + v * (radius * (step * f64::from(i)).sin());
            (0..DISC_CORNERS).map(|i| centre + corner(i)).collect()
        };
        let corners: Vec<DVec3> = match self.opening() {
            Opening::Point { .. } | Opening::Triangles(_) => return (Vec::new(), Vec::new()),
            Opening::Rectangle { centre, half_width: u, half_depth: v } => {
                [-u - v, u - v, u + v, v - u].map(|corner| centre + corner).to_vec()
            }
            Opening::Disc { centre, radius, .. } => round(centre, self.axes()[0], self.axes()[1], radius),
            Opening::Ellipse { centre, half_width, half_depth } => round(centre, half_width, half_depth, 1.0),
            Opening::Body(body) => {
                let facets = body.facets();
                return (facets.corners.iter().map(|&corner| body.point(corner)).collect(), facets.triangles.clone());
            }
        };
        let last = corners.len() as u32 - 1;
        (corners, (1..last).map(|i| [0, i, i + 1]).collect())
    }

    /// What the tracer gets to see of it; `body` are its triangles in the scene's mesh.
    pub(crate) fn luminaire(&self, body: Vec<u32>) -> Luminaire {
        let section = self.section;
        Luminaire {
            name: self.name.clone(),
            group: section.group.clone().unwrap_or_else(|| self.name.clone()),
            flux: Lumens(self.lamp.flux * self.level),
            colour: section.colour,
            opening: self.opening(),
            distribution: match &self.lamp.spread {
                LampSpread::Isotropic => Distribution::Isotropic,
                LampSpread::Lambertian => Distribution::Lambertian,
                LampSpread::Web(web) => {
                    Distribution::Measured(Measured::new(Arc::clone(web), section.aim, section.rotation))
                }
            },
            body,
            supply: Supply { level: self.level, ..section.supply.clone() },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    use crate::scene::file::{Array, SpreadKey};

    fn lamp(shape: OpeningShape) -> FixtureLight {
        FixtureLight { shape, spread: LampSpread::Lambertian, flux: 3000.0 }
    }

    fn section(array: Option<Array>) -> LuminaireSection {
        LuminaireSection {
            name: Placed { value: "L".to_owned(), at: Location::file("test.toml".as_ref()) },
            position: DVec3::new(1.0, 2.0, 3.0),
            aim: DVec3::NEG_Z,
            rotation: 0.0,
            shape: None,
            spread: SpreadKey::Lambertian,
            flux: None,
            supply: Supply::default(),
            maintenance: None,
            colour: [1.0; 3],
            group: None,
            array,
        }
    }

    fn area((corners, triangles): (Vec<DVec3>, Vec<[u32; 3]>), aim: DVec3) -> f64 {
        let corner = |i: u32| corners[i as usize];
        let cross = |&[a, b, c]: &[u32; 3]| (corner(b) - corner(a)).cross(corner(c) - corner(a));
        triangles.iter().map(|triangle| cross(triangle).dot(aim) / 2.0).sum()
    }

    #[test]
    fn bodies_have_the_area_of_their_opening_and_face_where_it_shines() {
        let section = section(None);
        for (shape, expected) in [
            (OpeningShape::Disc { diameter: 2.0 }, PI),
            (OpeningShape::Ellipse([2.0, 3.0]), 1.5 * PI),
            (OpeningShape::Rectangle([0.6, 1.2]), 0.72),
        ] {
            let found = area(member(&section, &lamp(shape), 0, 0).unwrap().body(), section.aim);
            assert!((found / expected - 1.0).abs() < 1e-12, "{shape:?}: {found}");
        }
        let (corners, triangles) = member(&section, &lamp(OpeningShape::Upright([2.0, 3.0])), 0, 0).unwrap().body();
        assert!((area((corners, triangles), DVec3::X) / (1.5 * PI) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_sides_of_a_rectangle_span_its_aim_and_the_first_runs_along_c0() {
        let (section, lamp) = (section(None), lamp(OpeningShape::Rectangle([0.6, 1.2])));
        let Opening::Rectangle { half_width, half_depth, .. } =
            member(&section, &lamp, 0, 0).unwrap().luminaire(Vec::new()).opening
        else {
            panic!("a rectangle stays one");
        };
        assert!((half_width - DVec3::X * 0.3).length() < 1e-15);
        assert!((half_width.cross(half_depth).normalize() - DVec3::NEG_Z).length() < 1e-15);
    }

    #[test]
    fn an_array_counts_from_1_and_starts_at_the_position() {
        let array = Array { count: [3, 2], pitch: [2.0, -1.5], at: Location::file("test.toml".as_ref()) };
        let (sections, lamps) = ([section(Some(array))], [lamp(OpeningShape::Point)]);
        let fixtures = spread(&sections, &lamps, &Dimming::AsWritten).unwrap();
        let names: Vec<&str> = fixtures.iter().map(|fixture| fixture.name.as_str()).collect();
        assert_eq!(names, ["L[1,1]", "L[2,1]", "L[3,1]", "L[1,2]", "L[2,2]", "L[3,2]"]);
        assert_eq!(fixtures[0].position, DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(fixtures[5].position, DVec3::new(5.0, 0.5, 3.0));
        assert_eq!(fixtures[5].luminaire(Vec::new()).group, "L[3,2]");
    }
}
