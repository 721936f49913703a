//! The kinds of bad inputs.

mod compiled;
mod scenarios;
mod scripts;
mod surroundings;
mod texts;

use bittybuzz_random::Random;

use crate::bases::Bases;
use crate::case::Case;

/// The number of inputs of each kind in a full run.
pub const PER_KIND: u64 = 50;

/// A kind of bad inputs.
pub struct Kind {
    pub name: &'static str,
    /// Makes an input from random numbers. Kinds with few inputs choose by the seed, so that seeds
    /// in a row have all of them.
    pub(crate) make: fn(&Bases, &mut Random, u64) -> Case,
}

impl Kind {
    /// Returns a number for the random numbers of this kind: the FNV-1a hash of its name, so that
    /// the inputs stay the same when kinds are added.
    pub(crate) fn number(&self) -> u64 {
        self.name.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3)
        })
    }
}

/// Returns all kinds.
pub fn kinds() -> Vec<Kind> {
    let groups =
        [scripts::KINDS, scenarios::KINDS, compiled::KINDS, texts::KINDS, surroundings::KINDS];
    let kinds = groups.into_iter().flatten();
    kinds.map(|(name, make)| Kind { name, make: *make }).collect()
}

/// The name of a kind and its generator.
type Entry = (&'static str, fn(&Bases, &mut Random, u64) -> Case);

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn there_are_enough_kinds_with_names_of_their_own() {
        let names: BTreeSet<&str> = kinds().iter().map(|kind| kind.name).collect();
        assert_eq!(names.len(), kinds().len());
        assert!(names.len() >= 30, "{}", names.len());
        assert!(names.len() as u64 * PER_KIND >= 2_000);
    }
}
