//! Makes a library of a newer system fit an older one, so that the older system's own loader takes it; for `build.rs`.
//!
//! Debian 12 has no Embree 4, and Debian 13's asks for three functions that came with glibc 2.38 and GCC 13. Debian 12
//! has the like of them under older names: a copy of the library asks for those. The copy runs on newer systems too.

use std::ops::Range;

/// Functions that a compiler of Debian 13 has libraries ask for, and what does the same in older systems.
const OLDER_NAMES: [(&str, Option<&str>); 3] = [
    // As `strtol` before it, except that C23 also reads "0b11" where the base is 0 or 2.
    ("__isoc23_strtol", Some("strtol")),
    // Called where an exception would leave a function that throws none: ends the program, as `std::terminate()` does.
    ("__cxa_call_terminate", Some("_ZSt9terminatev")),
    // Never called: asking for it tells that the library relies on streams that are ready (`load.rs` makes them ready).
    ("_ZSt21ios_base_library_initv", None),
];

/// Kinds of sections: symbols, the version of each, and the versions needed of other libraries.
const SYMBOLS: u64 = 11;
const VERSIONS: u64 = 0x6fff_ffff;
const NEEDS: u64 = 0x6fff_fffe;
/// The section of a symbol that another library has.
const UNDEFINED: u64 = 0;
/// Binding of a symbol that need not be found.
const WEAK_SYMBOL: u64 = 2 << 4;
/// Version of a symbol that asks for none.
const NO_VERSION: u64 = 1;
/// Flag of a version that need not be found.
const WEAK_VERSION: u64 = 2;

/// Changes a library's bytes as told above. Returns for how many functions; `None`, and nothing is changed, where the
/// bytes are no 64-bit little-endian ELF library with versions of symbols, or a damaged one.
pub(crate) fn fit(library: &mut Vec<u8>) -> Option<usize> {
    let mut fitted = library.clone();
    let changed = Elf { bytes: &mut fitted }.fit()?;
    *library = fitted;
    Some(changed)
}

struct Elf<'a> {
    bytes: &'a mut [u8],
}

/// A part of the file, and the number of the section that it belongs with.
#[derive(Clone)]
struct FilePart {
    kind: u64,
    place: Range<usize>,
    link: usize,
}

impl Elf<'_> {
    fn fit(&mut self) -> Option<usize> {
        let is_elf_64 = self.bytes.get(..6)? == [0x7f, b'E', b'L', b'F', 2, 1];
        let sections = if is_elf_64 { self.sections()? } else { return None };
        let is_whole = |section: &&FilePart| self.bytes.get(section.place.clone()).is_some();
        let of_kind = |kind| sections.iter().find(|section| section.kind == kind).filter(is_whole);
        let (symbols, versions, needs) = (of_kind(SYMBOLS)?, of_kind(VERSIONS)?, of_kind(NEEDS)?);
        let names = sections.get(symbols.link)?.place.clone();
        let symbols: Vec<usize> = symbols.place.clone().step_by(24).collect();
        let version = |i: usize| versions.place.start + 2 * i;

        let mut changed = 0;
        for (i, &symbol) in symbols.iter().enumerate() {
            let name = self.name(&names, symbol)?;
            let known = OLDER_NAMES.iter().find(|(newer, _)| self.bytes[name.clone()] == *newer.as_bytes());
            let Some((_, older)) = known.filter(|_| self.must_be_found(symbol)) else { continue };
            let renamed = older.is_some_and(|older| self.rename(&names, &symbols, symbol, older.as_bytes()).is_some());
            if !renamed {
                let kind = self.get(symbol + 4, 1)? & 0xf;
                self.set(symbol + 4, 1, WEAK_SYMBOL | kind)?;
            }
            self.set(version(i), 2, NO_VERSION)?;
            changed += 1;
        }
        // A version that no symbol has any more need not be found.
        let used: Vec<u64> = (0..symbols.len()).map(|i| self.get(version(i), 2)).collect::<Option<_>>()?;
        if changed > 0 {
            self.loosen(needs.place.start, &used)?;
        }
        Some(changed)
    }

    fn sections(&self) -> Option<Vec<FilePart>> {
        let [first, size, count] = [self.get(0x28, 8)?, self.get(0x3a, 2)?, self.get(0x3c, 2)?];
        let section = |i: u64| {
            let header = usize::try_from(first.checked_add(i * size)?).ok()?;
            let at = |offset: usize| header.checked_add(offset);
            let [start, length] =
                [self.get(at(24)?, 8)?, self.get(at(32)?, 8)?].map(|n| usize::try_from(n).unwrap_or(usize::MAX));
            let place = start..start.checked_add(length)?;
            Some(FilePart { kind: self.get(at(4)?, 4)?, place, link: self.get(at(40)?, 4)? as usize })
        };
        (0..count).map(section).collect()
    }

    /// Whether some other library has to have a symbol.
    fn must_be_found(&self, symbol: usize) -> bool {
        self.get(symbol + 6, 2) == Some(UNDEFINED)
            && self.get(symbol + 4, 1).is_some_and(|info| info & 0xf0 != WEAK_SYMBOL)
    }

    /// Where a symbol's name lies, without the 0 behind it.
    fn name(&self, names: &Range<usize>, symbol: usize) -> Option<Range<usize>> {
        let start = names.start.checked_add(self.get(symbol, 4)? as usize)?;
        let length = self.bytes.get(start..names.end)?.iter().position(|&byte| byte == 0)?;
        Some(start..start + length)
    }

    /// Gives a symbol another name: the end of its own, or one written over its own if nothing else reads that.
    fn rename(&mut self, names: &Range<usize>, symbols: &[usize], symbol: usize, older: &[u8]) -> Option<()> {
        let name = self.name(names, symbol)?;
        let shorter = name.len().checked_sub(older.len())?;
        if self.bytes[name.clone()].ends_with(older) {
            let start = self.get(symbol, 4)? + shorter as u64;
            return self.set(symbol, 4, start);
        }
        let reads = |&other: &usize| other != symbol && self.name(names, other).is_some_and(|at| at.end == name.end);
        if symbols.iter().any(reads) {
            return None;
        }
        self.bytes[name.clone()].fill(0);
        self.bytes[name.start..name.start + older.len()].copy_from_slice(older);
        Some(())
    }

    /// Marks the versions needed that are none of `used`.
    fn loosen(&mut self, mut need: usize, used: &[u64]) -> Option<()> {
        loop {
            let mut version = need.checked_add(self.get(need.checked_add(8)?, 4)? as usize)?;
            loop {
                let [flags, number, next] =
                    [self.get(version + 4, 2)?, self.get(version + 6, 2)?, self.get(version + 12, 4)?];
                if !used.iter().any(|used| used & 0x7fff == number & 0x7fff) {
                    self.set(version + 4, 2, flags | WEAK_VERSION)?;
                }
                if next == 0 {
                    break;
                }
                version = version.checked_add(next as usize)?;
            }
            match self.get(need.checked_add(12)?, 4)? {
                0 => return Some(()),
                next => need = need.checked_add(next as usize)?,
            }
        }
    }

    /// A number of `size` bytes.
    fn get(&self, at: usize, size: usize) -> Option<u64> {
        let bytes = self.bytes.get(at..at.checked_add(size)?)?;
        Some(bytes.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte)))
    }

    fn set(&mut self, at: usize, size: usize, number: u64) -> Option<()> {
        let bytes = self.bytes.get_mut(at..at.checked_add(size)?)?;
        bytes.copy_from_slice(&number.to_le_bytes()[..size]);
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::embree::folders::{TBB, library_under};
    use std::env;
    use std::fs;
    use std::path::Path;

    /// TBB's library beside the Embree that was set up, which is much the smaller one.
    fn tbb() -> Option<Vec<u8>> {
        let project = Path::new(env!("CARGO_MANIFEST_DIR"));
        let named = env::var_os("EMBREE_DIR").map(|folder| project.join(folder));
        let folders = named.into_iter().chain([project.join(".embree/usr"), "/usr".into()]);
        let tbb = folders.filter_map(|folder| fs::read(library_under(&folder)?.with_file_name(TBB)).ok()).next();
        tbb.filter(|bytes| bytes.starts_with(b"\x7fELF\x02\x01")).or_else(|| {
            eprintln!("left out: no TBB of 64-bit ELF beside Embree");
            None
        })
    }

    /// Undefined symbols that have to be found, by the newer names.
    fn asked_for(library: &mut [u8]) -> Vec<&'static str> {
        let elf = Elf { bytes: library };
        let sections = elf.sections().unwrap();
        let symbols = sections.iter().find(|section| section.kind == SYMBOLS).unwrap();
        let names = sections[symbols.link].place.clone();
        let of = |symbol: usize| {
            let name = &elf.bytes[elf.name(&names, symbol).unwrap()];
            OLDER_NAMES
                .iter()
                .map(|&(newer, _)| newer)
                .find(|newer| elf.must_be_found(symbol) && name == newer.as_bytes())
        };
        symbols.place.clone().step_by(24).filter_map(of).collect()
    }

    #[test]
    fn a_fitted_library_asks_for_nothing_new() {
        let Some(before) = tbb() else { return };
        let mut after = before.clone();
        let asked = asked_for(&mut after.clone()).len();
        assert_eq!(fit(&mut after), Some(asked));
        assert_eq!(asked_for(&mut after.clone()), Vec::<&str>::new());
        assert_eq!(after.len(), before.len());
        // Of a function 20 bytes of its name at most, 1 of its binding, 2 of its version; 1 of a version that is lost.
        let differ = before.iter().zip(&after).filter(|(before, after)| before != after).count();
        assert!(differ <= asked * (20 + 1 + 2 + 1), "{differ} bytes for {asked} functions");
        assert!(asked == 0 || differ >= 2 * asked, "{differ} bytes for {asked} functions");
        let fitted = after.clone();
        assert_eq!((fit(&mut after), after == fitted), (Some(0), true), "there is nothing left to do");
    }

    /// Cut short anywhere, or with any byte of its tables replaced, a library is refused and left as it was, or fitted.
    #[test]
    fn a_damaged_library_is_no_reason_to_stop() {
        let Some(whole) = tbb() else { return };
        let sections = Elf { bytes: &mut whole.clone() }.sections().unwrap();
        let symbols = sections.iter().find(|section| section.kind == SYMBOLS).unwrap();
        for cut in (0..64).chain((64..whole.len()).step_by(4099)) {
            let mut part = whole[..cut].to_vec();
            assert_eq!(fit(&mut part), None, "the sections' table is at the end");
            assert!(part == whole[..cut]);
        }
        let tables =
            (0..64).chain(symbols.place.clone().step_by(37)).chain((whole.len() - 2048..whole.len()).step_by(11));
        for at in tables {
            let mut damaged = whole.clone();
            damaged[at] ^= 0xff;
            let before = damaged.clone();
            assert!(fit(&mut damaged).is_some() || damaged == before);
        }
    }
}
