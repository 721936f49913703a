//! Flash whose writing a loss of power has cut short.
//!
//! A debug probe erases all sectors that it needs, and then programs them from the first address on. If the chip is reset while it
//! erases or programs, the content is not guaranteed (RM0090 3.6, RM0091 3.2.2). No manual limits it, so there are two
//! readings: [`Reading::Partial`] and [`Reading::Anything`].

use bittybuzz_chips::Random;

/// The content of the sector or unit at which the writer was cut short.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// Each bit has its old or its new value.
    Partial,
    /// Any value.
    Anything,
}

/// The writing of new content over old: whole sectors are erased, then units are programmed.
pub struct Writing<'a> {
    /// Content before, in whole sectors.
    pub old: &'a [u8],
    /// Content afterwards, shorter than that or as long.
    pub new: &'a [u8],
    /// Bytes of a sector.
    pub sector: usize,
    /// Bytes that are programmed at once.
    pub unit: usize,
}

impl Writing<'_> {
    /// Operations that can be cut short: the erasing of each sector, the programming of each unit.
    pub fn operations(&self) -> usize {
        self.sectors() + self.new.len().div_ceil(self.unit)
    }

    fn sectors(&self) -> usize {
        self.old.len() / self.sector
    }

    /// The content if this operation is cut short.
    pub fn cut_at(&self, operation: usize, reading: Reading, random: &mut Random) -> Vec<u8> {
        let mut content = self.old.to_vec();
        let erased = operation.min(self.sectors()) * self.sector;
        content[..erased].fill(u8::MAX);
        let (range, wanted) = if let Some(programmed) = operation.checked_sub(self.sectors()) {
            let done = (programmed * self.unit).min(self.new.len());
            content[..done].copy_from_slice(&self.new[..done]);
            let end = (done + self.unit).min(self.new.len());
            (done..end, self.new[done..end].to_vec())
        } else {
            (erased..erased + self.sector, vec![u8::MAX; self.sector])
        };
        for (byte, wanted) in content[range].iter_mut().zip(wanted) {
            let noise = random.bits() as u8;
            *byte = match reading {
                Reading::Partial => *byte & !noise | wanted & noise,
                Reading::Anything => noise,
            };
        }
        content
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OLD: [u8; 8] = [1, 2, 3, 4, 5, 6, 7, 8];
    const WRITING: Writing<'static> = Writing { old: &OLD, new: &[0x10; 6], sector: 4, unit: 2 };

    fn cut_at(operation: usize, reading: Reading) -> Vec<u8> {
        WRITING.cut_at(operation, reading, &mut Random::new(7))
    }

    #[test]
    fn all_is_erased_before_anything_is_programmed() {
        assert_eq!(WRITING.operations(), 2 + 3);
        for reading in [Reading::Partial, Reading::Anything] {
            assert_eq!(cut_at(0, reading)[4..], OLD[4..]);
            assert_eq!(cut_at(1, reading)[..4], [0xff; 4]);
            assert_eq!(cut_at(2, reading)[2..], [0xff; 6]);
            let last = cut_at(4, reading);
            assert_eq!((&last[..4], &last[6..]), (&[0x10; 4][..], &[0xff; 2][..]));
        }
    }

    #[test]
    fn a_partial_operation_only_moves_bits_its_way() {
        for operation in 0..WRITING.operations() {
            let partial = cut_at(operation, Reading::Partial);
            if operation < 2 {
                let sector = 4 * operation..4 * operation + 4;
                assert!(
                    partial[sector.clone()]
                        .iter()
                        .zip(&OLD[sector])
                        .all(|(is, was)| is & was == *was)
                );
            } else {
                assert!(partial[..6].iter().all(|byte| byte & 0x10 != 0), "{partial:x?}");
            }
        }
        assert_ne!(cut_at(2, Reading::Partial), cut_at(2, Reading::Anything));
    }
}
