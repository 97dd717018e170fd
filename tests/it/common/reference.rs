//! The converged maps in `tests/reference`, read without luxmap's own reader.

use std::path::Path;

use luxmap::results::IlluminanceMap;

use super::claim;

/// Converged E and its standard error (lx) of each cell of a plane of the seed office; none inside furniture.
pub fn converged(plane: &str) -> Vec<Option<[f64; 2]>> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/reference/seed-office.{plane}.csv"));
    let mut reader = csv::Reader::from_path(file).expect("the reference is in the repository");
    let cell = |row: Result<csv::StringRecord, csv::Error>| {
        let row = row.expect("a row");
        let found = [2, 3].map(|column| row[column].parse::<f64>().expect("a number"));
        found[0].is_finite().then_some(found)
    };
    reader.records().map(cell).collect()
}

/// A map of the seed office against its converged map; all in % of the converged mean.
#[derive(Debug)]
pub struct Found {
    /// Mean over the converged mean, less one.
    pub bias: f64,
    /// Root of the mean square of the differences, less the converged map's own noise.
    pub rmse: f64,
    /// The map's claim: √(mean σ²).
    pub claimed: f64,
    /// Shares of the cells (0 to 1) whose difference is within one and two standard errors.
    pub within: [f64; 2],
}

/// Compares a map with the converged map of the plane of its name; both have values at the same cells.
pub fn compare(map: &IlluminanceMap) -> Found {
    let expected = converged(&map.name);
    assert_eq!(expected.len(), map.illuminance.len());
    let [mut count, mut sum, mut difference, mut square, mut one, mut two] = [0.0; 6];
    for (cell, expected) in expected.into_iter().enumerate() {
        assert_eq!(map.has_value[cell], expected.is_some(), "disagreement on what is inside furniture: cell {cell}");
        let Some([expected, noise]) = expected else { continue };
        let off = map.illuminance[cell] - expected;
        count += 1.0;
        sum += expected;
        difference += off;
        square += off * off - noise * noise;
        let sigma = map.standard_error[cell].hypot(noise);
        one += f64::from(u8::from(off.abs() <= sigma));
        two += f64::from(u8::from(off.abs() <= 2.0 * sigma));
    }
    assert!(count > 17_000.0, "{count} cells");
    let percent = 100.0 * count / sum;
    Found {
        bias: percent * difference / count,
        rmse: percent * (square / count).sqrt(),
        claimed: percent * claim(map),
        within: [one / count, two / count],
    }
}
