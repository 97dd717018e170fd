//! Measured surfaces as CSV, and as PLY for programs that show meshes.

use std::io::{self, Write};

use glam::DVec3;

use crate::error::invalid;
use crate::results::SurfaceMap;
use crate::text::number::round_to;

/// Columns of a surface's CSV.
const COLUMNS: &str = "x_m,y_m,z_m,nx,ny,nz,area_m2,E_lx,standard_error_lx";

/// One line for each sample: its middle, its normal, its area, E and its standard error (1 σ), both empty where no
/// light can arrive.
///
/// # Errors
/// Where `out` fails, and where a value isn't finite.
pub fn write_csv(map: &SurfaceMap, out: &mut impl Write) -> io::Result<()> {
    map.check()?;
    writeln!(out, "{COLUMNS}")?;
    let micro = |x: f64| (x * 1e6).round() / 1e6 + 0.0;
    for sample in 0..map.corners.len() {
        let at = map.corners[sample].iter().sum::<DVec3>() / 3.0;
        let normal = map.cross(sample).normalize();
        for x in at.to_array().into_iter().chain(normal.to_array()) {
            write!(out, "{},", micro(x))?;
        }
        write!(out, "{}", round_to(map.area(sample), 6))?;
        if map.has_value[sample] {
            let [lux, error] = [map.illuminance[sample], map.standard_error[sample]].map(|lux| round_to(lux, 6));
            writeln!(out, ",{lux},{error}")?;
        } else {
            writeln!(out, ",,")?;
        }
    }
    Ok(())
}

/// Colour of samples without a value.
const GREY: [u8; 3] = [128; 3];

/// The samples as a mesh (PLY, binary, little endian): faces with `illuminance` and `standard_error` in lx, `has_value`
/// 0 where no light can arrive, and a false colour from 0 to E_max. Each face has vertices of its own, which carry its
/// colour and illuminance too, as some programs read colours at vertices only.
///
/// # Errors
/// Where `out` fails, and where a value isn't finite.
pub fn write_ply(map: &SurfaceMap, out: &mut impl Write) -> io::Result<()> {
    map.check()?;
    let faces = map.corners.len();
    let colours = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment luxmap {}: illuminance in lx, metres\n\
         element vertex {}\nproperty double x\nproperty double y\nproperty double z\n{colours}\
         property float illuminance\n\
         element face {faces}\nproperty list uchar int vertex_indices\n{colours}\
         property float illuminance\nproperty float standard_error\nproperty uchar has_value\nend_header\n",
        env!("CARGO_PKG_VERSION"),
        3 * faces,
    )?;
    let brightest = map.figures().max.0.max(f64::MIN_POSITIVE);
    let colour = |lux: f64| colorous::VIRIDIS.eval_continuous((lux / brightest).clamp(0.0, 1.0)).as_array();
    let look = |face: usize| {
        if map.has_value[face] {
            (colour(map.illuminance[face]), map.illuminance[face] as f32, map.standard_error[face] as f32)
        } else {
            (GREY, 0.0, 0.0)
        }
    };
    for (face, corners) in map.corners.iter().enumerate() {
        let (colour, lux, _) = look(face);
        for corner in corners {
            for x in corner.to_array() {
                out.write_all(&x.to_le_bytes())?;
            }
            out.write_all(&colour)?;
            out.write_all(&lux.to_le_bytes())?;
        }
    }
    for face in 0..faces {
        let (colour, lux, error) = look(face);
        out.write_all(&[3])?;
        for corner in 0..3 {
            let index = i32::try_from(3 * face + corner).map_err(|_| invalid("more than 2³¹ vertices".into()))?;
            out.write_all(&index.to_le_bytes())?;
        }
        out.write_all(&colour)?;
        out.write_all(&lux.to_le_bytes())?;
        out.write_all(&error.to_le_bytes())?;
        out.write_all(&[u8::from(map.has_value[face])])?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use glam::dvec3;

    use super::*;
    use crate::gather::reach::Standing;
    use crate::results::SurfaceFigures;

    /// Two triangles of 2 m² and 1 m², far from the origin; the third has no value.
    fn map() -> SurfaceMap {
        let at = |x: f64, y: f64| dvec3(1e6 + x, y, 0.5);
        SurfaceMap {
            name: "two".into(),
            spacing: 1.0,
            corners: vec![
                [at(0.0, 0.0), at(2.0, 0.0), at(0.0, 2.0)],
                [at(0.0, 0.0), at(1.0, 0.0), at(0.0, 2.0)],
                [at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)],
            ],
            illuminance: vec![100.0, 400.0, 0.0],
            rgb: None,
            standard_error: vec![1.0, 4.0, 0.0],
            has_value: vec![true, true, false],
            standing: vec![Standing::Place, Standing::Place, Standing::Dark],
            extremes: None,
        }
    }

    /// (100 lx · 2 m² + 400 lx · 1 m²) / 3 m² = 200 lx.
    #[test]
    fn figures_weigh_samples_by_area() {
        let found = map().figures();
        assert_eq!((found.samples, found.samples_without_value), (2, 1));
        assert!((found.area - 3.0).abs() < 1e-9 && (found.flux.0 - 600.0).abs() < 1e-6);
        assert!((found.mean.0 - 200.0).abs() < 1e-6 && (found.mean_standard_error.0 - 2.0).abs() < 1e-6);
        assert_eq!((found.min.0, found.max.0, found.diversity), (100.0, 400.0, 0.25));
        let dark = SurfaceMap { has_value: vec![false; 3], ..map() }.figures();
        assert_eq!(dark, SurfaceFigures { samples_without_value: 3, ..SurfaceFigures::default() });
    }

    /// The bytes behind the header are those the header announces, world coordinates in double precision among them.
    #[test]
    fn ply_holds_what_its_header_says() {
        let mut bytes = Vec::new();
        write_ply(&map(), &mut bytes).expect("memory takes all");
        let end = bytes.windows(11).position(|window| window == b"end_header\n").expect("a header") + 11;
        let header = String::from_utf8(bytes[..end].to_vec()).expect("ASCII");
        assert!(header.starts_with("ply\nformat binary_little_endian 1.0\n"));
        assert!(header.contains("element vertex 9\n") && header.contains("element face 3\n"));
        let (vertex, face) = (3 * 8 + 3 + 4, 1 + 3 * 4 + 3 + 4 + 4 + 1);
        assert_eq!(bytes.len(), end + 9 * vertex + 3 * face);
        let x = f64::from_le_bytes(bytes[end + vertex..end + vertex + 8].try_into().expect("eight bytes"));
        assert_eq!(x, 1e6 + 2.0);
        let second = end + 9 * vertex + face;
        assert_eq!(bytes[second], 3);
        let index = i32::from_le_bytes(bytes[second + 1..second + 5].try_into().expect("four bytes"));
        let lux = f32::from_le_bytes(bytes[second + 16..second + 20].try_into().expect("four bytes"));
        assert_eq!((index, lux), (3, 400.0));
    }

    #[test]
    fn csv_leaves_out_what_has_no_value_and_refuses_what_is_no_number() {
        let mut text = Vec::new();
        write_csv(&map(), &mut text).expect("memory takes all");
        let text = String::from_utf8(text).expect("UTF-8");
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[1], "1000000.666667,0.666667,0.5,0,0,1,2,100,1");
        assert!(lines[3].ends_with(",0.5,,") && lines.len() == 4);
        let bad = SurfaceMap { illuminance: vec![f64::NAN; 3], ..map() };
        assert!(write_csv(&bad, &mut Vec::new()).is_err() && write_ply(&bad, &mut Vec::new()).is_err());
    }
}
