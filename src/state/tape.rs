//! Sums on their way into a file or another process, and back.

use std::io::{self, Read, Write};

use super::Sum;
use crate::error::invalid;

/// Bytes moved at once.
const BLOCK: usize = 1 << 16;

/// A stream that sums are written to, or added from. What is kept describes itself once, by what it gives to the tape
/// in which order, and so can't be read otherwise than it was written.
pub enum Tape<'a> {
    /// Everything is written.
    Out(&'a mut dyn Write),
    /// Everything is read, and added to what is there.
    In(&'a mut dyn Read),
    /// Everything is set to nothing.
    Clear,
}

impl Tape<'_> {
    /// A number: written, or replaced by what was written.
    pub fn number(&mut self, number: &mut u64) -> io::Result<()> {
        match self {
            Self::Out(out) => out.write_all(&number.to_le_bytes()),
            Self::In(from) => {
                let mut bytes = [0; 8];
                from.read_exact(&mut bytes)?;
                *number = u64::from_le_bytes(bytes);
                Ok(())
            }
            Self::Clear => {
                *number = 0;
                Ok(())
            }
        }
    }

    /// A number that reader and writer have in common; `what` names it.
    pub fn same(&mut self, number: usize, what: &str) -> io::Result<()> {
        let mut there = number as u64;
        self.number(&mut there)?;
        if there == number as u64 || matches!(self, Self::Clear) {
            Ok(())
        } else {
            Err(invalid(format!("found {there} {what}, expected {number}")))
        }
    }

    /// A count: written, or added to.
    pub fn count(&mut self, count: &mut u64) -> io::Result<()> {
        let mut there = *count;
        self.number(&mut there)?;
        *count = match self {
            Self::In(_) => count.checked_add(there).ok_or_else(|| invalid(format!("found a count of {there}")))?,
            _ => there,
        };
        Ok(())
    }

    /// A sum: written, or added to.
    pub fn sum(&mut self, sum: &mut Sum) -> io::Result<()> {
        match self {
            Self::Out(out) => sum.parts().iter().try_for_each(|part| out.write_all(&part.to_le_bytes())),
            Self::In(from) => {
                let mut bytes = [[0; 8]; 2];
                from.read_exact(bytes.as_flattened_mut())?;
                if add(sum, bytes) { Ok(()) } else { Err(not_finite()) }
            }
            Self::Clear => {
                *sum = Sum::ZERO;
                Ok(())
            }
        }
    }

    /// Sums: written, or added to.
    pub fn sums(&mut self, sums: &mut [Sum]) -> io::Result<()> {
        if matches!(self, Self::Clear) {
            sums.fill(Sum::ZERO);
            return Ok(());
        }
        self.same(sums.len(), "sums")?;
        self.blocks(sums, |sum| sum.parts().map(f64::to_le_bytes), add)
    }

    /// A plain sum of parts that need no rounding: written, or added to.
    pub fn exact(&mut self, sum: &mut f64) -> io::Result<()> {
        let mut bits = sum.to_bits();
        self.number(&mut bits)?;
        *sum = if matches!(self, Self::In(_)) { *sum + f64::from_bits(bits) } else { f64::from_bits(bits) };
        if sum.is_finite() { Ok(()) } else { Err(not_finite()) }
    }

    /// A list of rows: written, or replaced by what was written.
    pub fn rows<const N: usize>(&mut self, rows: &mut Vec<[f32; N]>) -> io::Result<()> {
        self.list(
            rows,
            [0.0; N],
            |row| row.map(f32::to_le_bytes),
            |row, bytes| {
                *row = bytes.map(f32::from_le_bytes);
                row.iter().all(|number| number.is_finite())
            },
        )
    }

    /// A list of numbers: written, or replaced by what was written.
    pub fn numbers(&mut self, numbers: &mut Vec<u32>) -> io::Result<()> {
        self.list(
            numbers,
            0,
            |number| [number.to_le_bytes()],
            |number, [bytes]| {
                *number = u32::from_le_bytes(bytes);
                true
            },
        )
    }

    fn list<T: Copy, const N: usize, const B: usize>(
        &mut self,
        list: &mut Vec<T>,
        empty: T,
        to: impl Fn(&T) -> [[u8; B]; N],
        from: impl Fn(&mut T, [[u8; B]; N]) -> bool,
    ) -> io::Result<()> {
        let mut length = list.len() as u64;
        self.number(&mut length)?;
        match self {
            Self::Out(_) => return self.blocks(list, to, from),
            Self::Clear => length = 0,
            Self::In(_) => {}
        }
        // What a length promises is believed only as far as bytes follow.
        list.clear();
        let mut left = usize::try_from(length).map_err(|_| invalid(format!("found a list of {length}")))?;
        while left > 0 {
            let (start, part) = (list.len(), left.min(BLOCK));
            list.resize(start + part, empty);
            self.blocks(&mut list[start..], &to, &from)?;
            left -= part;
        }
        Ok(())
    }

    /// Items of N parts of B bytes each. `from` tells whether what it read is a number.
    fn blocks<T, const N: usize, const B: usize>(
        &mut self,
        items: &mut [T],
        to: impl Fn(&T) -> [[u8; B]; N],
        from: impl Fn(&mut T, [[u8; B]; N]) -> bool,
    ) -> io::Result<()> {
        let mut bytes = vec![0; (items.len() * N * B).min(BLOCK / (N * B) * (N * B))];
        for items in items.chunks_mut((BLOCK / (N * B)).max(1)) {
            let bytes = &mut bytes[..items.len() * N * B];
            let parts = |at: usize| at * N * B..(at + 1) * N * B;
            match self {
                Self::Out(out) => {
                    for (at, item) in items.iter().enumerate() {
                        bytes[parts(at)].copy_from_slice(to(item).as_flattened());
                    }
                    out.write_all(bytes)?;
                }
                Self::In(source) => {
                    source.read_exact(bytes)?;
                    for (at, item) in items.iter_mut().enumerate() {
                        let mut read = [[0; B]; N];
                        read.as_flattened_mut().copy_from_slice(&bytes[parts(at)]);
                        if !from(item, read) {
                            return Err(not_finite());
                        }
                    }
                }
                Self::Clear => {}
            }
        }
        Ok(())
    }
}

/// Adds a sum as it was kept; whether the whole is a number.
fn add(sum: &mut Sum, bytes: [[u8; 8]; 2]) -> bool {
    sum.merge(Sum::from_parts(bytes.map(f64::from_le_bytes)));
    sum.parts().iter().all(|part| part.is_finite())
}

fn not_finite() -> io::Error {
    invalid("found a number that is not finite".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sums(seed: u32) -> Vec<Sum> {
        let of = |i: u32| {
            let mut sum = Sum::ZERO;
            (0..9).for_each(|part| sum.add(f64::from(seed * 31 + i * 7 + part).sqrt()));
            sum
        };
        (0..20_000).map(of).collect()
    }

    #[test]
    fn what_was_written_is_added() {
        let (mut one, mut other) = (sums(1), sums(2));
        let mut bytes = Vec::new();
        Tape::Out(&mut bytes).sums(&mut other).expect("memory takes it");
        Tape::In(&mut bytes.as_slice()).sums(&mut one).expect("it is whole");
        for ((found, a), b) in one.iter().zip(sums(1)).zip(sums(2)) {
            let mut expected = a;
            expected.merge(b);
            assert_eq!(*found, expected);
        }
    }

    #[test]
    fn lists_come_back_and_lengths_are_not_believed() {
        let mut rows: Vec<[f32; 3]> = (0..70_000).map(|i| [i as f32, 0.5, -1.0]).collect();
        let mut bytes = Vec::new();
        Tape::Out(&mut bytes).rows(&mut rows).expect("memory takes it");
        let mut back = vec![[9.0; 3]];
        Tape::In(&mut bytes.as_slice()).rows(&mut back).expect("it is whole");
        assert_eq!(rows, back);
        // A list of 2⁶² rows is promised; none follows.
        let promise = (1_u64 << 62).to_le_bytes();
        assert!(Tape::In(&mut promise.as_slice()).rows(&mut back).is_err());
        assert!(back.capacity() < 1 << 20);
    }

    #[test]
    fn another_layout_and_nan_are_refused() {
        let mut bytes = Vec::new();
        Tape::Out(&mut bytes).sums(&mut [Sum::ZERO; 3]).expect("memory takes it");
        assert!(Tape::In(&mut bytes.as_slice()).sums(&mut [Sum::ZERO; 4]).is_err());
        assert!(Tape::In(&mut f64::NAN.to_le_bytes().as_slice()).exact(&mut 0.0).is_err());
        let sum = [f64::INFINITY.to_le_bytes(), [0; 8]];
        assert!(Tape::In(&mut sum.as_flattened()).sum(&mut Sum::default()).is_err());
    }
}
