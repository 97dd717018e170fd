//! NumPy's format, version 1.0: a header that is a Python dictionary, then the numbers as they lie in memory.
//! Source: NumPy's documentation of `numpy.lib.format`.

use std::io::{self, Write};

/// Length of the header in bytes is a multiple of this.
const ALIGNMENT: usize = 64;

/// Writes rows of single-precision numbers, little-endian; one number a row makes a one-dimensional array.
///
/// # Errors
/// Where `out` fails.
pub(crate) fn write<const N: usize>(
    rows: impl ExactSizeIterator<Item = [f32; N]>,
    out: &mut impl Write,
) -> io::Result<()> {
    let shape = if N == 1 { format!("({},)", rows.len()) } else { format!("({}, {N})", rows.len()) };
    write_header("<f4", &shape, out)?;
    rows.flatten().try_for_each(|number| out.write_all(&number.to_le_bytes()))
}

/// Writes a matrix of double-precision numbers, row by row, little-endian.
///
/// # Errors
/// Where `out` fails.
pub(crate) fn write_matrix(rows: &[Vec<f64>], columns: usize, out: &mut impl Write) -> io::Result<()> {
    write_header("<f8", &format!("({}, {columns})", rows.len()), out)?;
    rows.iter().flatten().try_for_each(|number| out.write_all(&number.to_le_bytes()))
}

pub(crate) fn write_header(kind: &str, shape: &str, out: &mut impl Write) -> io::Result<()> {
    let dictionary = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    let prefix = b"\x93NUMPY\x01\x00";
    let length = (prefix.len() + 2 + dictionary.len() + 1).next_multiple_of(ALIGNMENT) - prefix.len() - 2;
    out.write_all(prefix)?;
    let short = u16::try_from(length).expect("two numbers fit into a header");
    out.write_all(&short.to_le_bytes())?;
    writeln!(out, "{dictionary:<0$}", length - 1)
}
