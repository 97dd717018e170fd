//! Shapes: triangle meshes, polygons, and the solids that luminaires have.

pub mod body;
pub(crate) mod mesh;
pub(crate) mod polygon;

pub use mesh::Mesh;

/// Sine and cosine of an angle in degrees, exact at quarter turns.
pub(crate) fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    let turned = degrees.rem_euclid(360.0);
    match turned {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        _ => turned.to_radians().sin_cos(),
    }
}
