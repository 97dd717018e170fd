//! Whether a mesh was read in the wrong unit: a room is from 2 to 6 m high.

/// Units of `[[mesh]]`, m.
const UNITS: [(&str, f64); 5] = [("m", 1.0), ("mm", 0.001), ("cm", 0.01), ("in", 0.0254), ("ft", 0.3048)];
/// Heights of rooms, m.
const ROOM: [f64; 2] = [2.0, 6.0];
/// Meshes larger than this, m, are looked at twice, and those higher than [`TALL`].
const LARGE: f64 = 500.0;
const TALL: f64 = 100.0;
/// As are those smaller than this, m.
const SMALL: f64 = 0.5;

/// The unit in which a mesh of this size (m, z is the height) would be as high as a room, where it is far too large or
/// small for one in the unit that it was read in.
pub(crate) fn likely_unit(size: [f64; 3], metres_per_unit: f64) -> Option<&'static str> {
    let largest = size.iter().fold(0.0, |most: f64, side| most.max(*side));
    if largest <= LARGE && size[2] <= TALL && largest >= SMALL {
        return None;
    }
    let fits = |(_, metres): &&(&str, f64)| {
        let times = metres / metres_per_unit;
        (ROOM[0]..=ROOM[1]).contains(&(size[2] * times)) && (SMALL..=LARGE).contains(&(largest * times))
    };
    UNITS.iter().find(fits).map(|(name, _)| *name)
}

/// A question about the unit of the mesh `file`, if there is one.
pub(crate) fn unit_in_doubt(file: &str, size: [f64; 3], metres_per_unit: f64) -> Option<String> {
    let unit = likely_unit(size, metres_per_unit)?;
    let [x, y, z] = size.map(|side| if side >= 10.0 { format!("{side:.0}") } else { format!("{side:.2}") });
    let height = size[2] / metres_per_unit * UNITS.iter().find(|(name, _)| *name == unit)?.1;
    Some(format!(
        "{file} is {x} × {y} m and {z} m high: is it in {unit}? unit = \"{unit}\" in its [[mesh]] makes it {height:.2} m high"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A room of 4 × 5 × 2.7 m written in each unit and read in each other is found out where it is beyond doubt.
    #[test]
    fn a_room_read_in_the_wrong_unit_is_found_out() {
        let room = [4.0, 5.0, 2.7];
        for (written, read, found) in [
            ("mm", "m", Some("mm")),
            ("cm", "m", Some("cm")),
            ("in", "m", Some("in")),
            ("m", "mm", Some("m")),
            ("m", "cm", Some("m")),
            // 27 m high: a large hall.
            ("mm", "cm", None),
            ("m", "m", None),
            ("mm", "mm", None),
            // 8.9 m high: it may be a hall.
            ("ft", "m", None),
        ] {
            let metres = |unit| UNITS.iter().find(|(name, _)| *name == unit).unwrap().1;
            let size = room.map(|side| side / metres(written) * metres(read));
            assert_eq!(likely_unit(size, metres(read)), found, "{written} read as {read}");
        }
        assert_eq!(likely_unit([20_000.0, 20_000.0, 2.7], 1.0), None, "a room on a wide ground");
        assert_eq!(likely_unit([60.0, 90.0, 97.0], 1.0), None, "a tall building");
        assert_eq!(likely_unit([0.3, 0.3, 0.1], 1.0), None, "a lamp");
        assert_eq!(likely_unit([0.0, 0.0, 0.0], 1.0), None);
    }
}
