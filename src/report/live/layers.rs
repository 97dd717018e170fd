//! Numbers of layers, made small.
//!
//! A value is rounded to a multiple of the layer's step. What is kept is how far it lies from what its neighbours
//! before it let expect: left + above − above left, but within left and above (the predictor of lossless JPEG, LOCO-I,
//! Weinberger, Seroussi and Sapiro 2000). Differences are written as zigzag numbers in bytes of seven bits, lowest
//! first, all of it is deflated (zlib) and put into base64.

use std::io::Write as _;

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use flate2::Compression;
use flate2::write::ZlibEncoder;

/// The step with which the sum of so many layers, none more than full, is within `error`.
pub(super) fn step(error: f64, layers: usize) -> f64 {
    2.0 * error / layers.max(1) as f64
}

/// Layers one after the other.
#[derive(Default)]
pub(super) struct Packer {
    bytes: Vec<u8>,
}

impl Packer {
    /// Adds values in rows of `columns`; those that aren't `known` are whatever costs least.
    pub(super) fn add(&mut self, values: &[f64], columns: usize, step: f64, known: impl Fn(usize) -> bool) {
        let mut steps = vec![0_i64; values.len()];
        for (cell, value) in values.iter().enumerate() {
            let expected = expected(&steps, cell, columns);
            steps[cell] = if known(cell) { (value / step).round() as i64 } else { expected };
            self.number(steps[cell] - expected);
        }
    }

    /// Zigzag: 0, −1, 1, −2 … become 0, 1, 2, 3 …
    fn number(&mut self, difference: i64) {
        let mut rest = ((difference << 1) ^ (difference >> 63)) as u64;
        while rest > 127 {
            self.bytes.push(rest as u8 | 128);
            rest >>= 7;
        }
        self.bytes.push(rest as u8);
    }

    /// All of it, deflated, in base64.
    pub(super) fn finish(self) -> String {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
        let deflated = encoder.write_all(&self.bytes).and_then(|()| encoder.finish());
        BASE64.encode(deflated.expect("memory takes what is written"))
    }
}

/// What the cells before let expect.
fn expected(steps: &[i64], cell: usize, columns: usize) -> i64 {
    match (cell % columns, cell / columns) {
        (0, 0) => 0,
        (_, 0) => steps[cell - 1],
        (0, _) => steps[cell - columns],
        _ => {
            let (left, above, corner) = (steps[cell - 1], steps[cell - columns], steps[cell - columns - 1]);
            (left + above - corner).clamp(left.min(above), left.max(above))
        }
    }
}

/// Cells put together.
pub(super) struct Blocks<'a> {
    /// Columns and rows there are.
    pub(super) cells: [usize; 2],
    /// Columns and rows there will be.
    pub(super) blocks: [usize; 2],
    /// Which cells have a value.
    pub(super) mask: &'a [bool],
}

impl Blocks<'_> {
    /// Which blocks have a value: those with a cell that has one.
    pub(super) fn mask(&self) -> Vec<bool> {
        self.all().map(|block| self.known(block).next().is_some()).collect()
    }

    /// The sum of some layers, mean over the cells of each block that have a value.
    pub(super) fn means(&self, layers: &[&[f32]]) -> Vec<f64> {
        let at = |cell: usize| layers.iter().map(|layer| f64::from(layer[cell])).sum::<f64>();
        let mean = |block| {
            let (sum, count) = self.known(block).fold((0.0, 0), |(sum, count), cell| (sum + at(cell), count + 1));
            if count > 0 { sum / f64::from(count) } else { 0.0 }
        };
        self.all().map(mean).collect()
    }

    fn all(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let [columns, rows] = self.blocks;
        (0..rows).flat_map(move |row| (0..columns).map(move |column| [column, row]))
    }

    /// Cells of a block that have a value.
    fn known(&self, block: [usize; 2]) -> impl Iterator<Item = usize> + '_ {
        let span = |i: usize| {
            let edge = |at: usize| at * self.cells[i] / self.blocks[i];
            edge(block[i])..edge(block[i] + 1)
        };
        let (columns, rows) = (span(0), span(1));
        let cells = rows.flat_map(move |row| columns.clone().map(move |column| row * self.cells[0] + column));
        cells.filter(|&cell| self.mask[cell])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read as _;

    /// Reads what [`Packer::add`] wrote, as the page's script does.
    fn unpacked(bytes: &[u8], columns: usize, step: f64) -> Vec<f64> {
        let (mut steps, mut rest, mut shift) = (Vec::new(), 0_u64, 0);
        for byte in bytes {
            rest |= u64::from(byte & 127) << shift;
            shift += 7;
            if byte & 128 == 0 {
                let difference = (rest >> 1) as i64 ^ -((rest & 1) as i64);
                let expected = expected(&steps, steps.len(), columns);
                steps.push(expected + difference);
                (rest, shift) = (0, 0);
            }
        }
        steps.into_iter().map(|steps| steps as f64 * step).collect()
    }

    /// Layers of any size come back within half a step, so that n of them, dimmed, sum up within the error.
    #[test]
    fn layers_come_back_within_the_error() {
        let (columns, rows) = (17, 9);
        let layer =
            |scale: f64| move |i: usize| scale * (1.3 + (0.37 * i as f64).sin() + (0.011 * (i * i) as f64).cos());
        for scale in [1e-3, 1.0, 500.0, 120_000.0, -3.0] {
            let step = step(super::super::MAP_ERROR, 300);
            let values: Vec<f64> = (0..columns * rows).map(layer(scale)).collect();
            let mut packer = Packer::default();
            packer.add(&values, columns, step, |_| true);
            let mut bytes = Vec::new();
            let deflated = BASE64.decode(packer.finish()).expect("base64");
            flate2::read::ZlibDecoder::new(deflated.as_slice()).read_to_end(&mut bytes).expect("zlib");
            let found = unpacked(&bytes, columns, step);
            assert_eq!(found.len(), values.len());
            for (found, value) in found.iter().zip(&values) {
                assert!((found - value).abs() <= step / 2.0 * (1.0 + 1e-9), "{found} for {value}");
            }
        }
    }

    /// Blocks are means over cells with a value, edges included, so the plane's sum stays.
    #[test]
    fn blocks_are_means_of_what_has_a_value() {
        let layer: Vec<f32> = (0..15).map(|i| i as f32).collect();
        let mut mask = vec![true; 15];
        mask[0] = false;
        mask[4] = false;
        mask[9] = false;
        let blocks = Blocks { cells: [5, 3], blocks: [3, 2], mask: &mask };
        // Columns 0 | 1 2 | 3 4, rows 0 | 1 2.
        assert_eq!(blocks.mask(), [false, true, true, true, true, true]);
        let means = blocks.means(&[&layer]);
        assert_eq!(means[1], 1.5);
        assert_eq!(means[2], 3.0);
        assert_eq!(means[5], (8.0 + 13.0 + 14.0) / 3.0);
    }
}
