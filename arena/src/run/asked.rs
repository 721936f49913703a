//! Programs with questions at their ends.
//!
//! All runs of a setup share the list, and add to it when they get to a new question. So a line of a
//! log, or a fault, finds the names of its program also in the setup from before the tick.

use std::sync::{Mutex, OnceLock, PoisonError};

use crate::robot::ProgramId;

use super::program::LoadedProgram;

/// Places of the first part of the list. Each further part is twice as long.
const FIRST_PLACES: usize = 64;

/// The number of parts: far more places than there is memory for.
const PARTS: usize = 24;

/// A program with questions at its end.
pub struct AskedProgram {
    /// The program without the last question.
    pub base: ProgramId,
    /// The program of the script.
    pub script: ProgramId,
    pub questions: Vec<String>,
    /// True if a robot keeps the program after the last question.
    pub is_kept: bool,
    pub loaded: LoadedProgram,
}

/// A list that only grows, so that a reference to a program stays valid.
#[derive(Default)]
pub struct AskedPrograms {
    parts: [OnceLock<Box<[OnceLock<AskedProgram>]>>; PARTS],
    length: Mutex<usize>,
}

impl AskedPrograms {
    /// Returns a program by its place.
    pub fn get(&self, place: usize) -> Option<&AskedProgram> {
        let (part, place) = part_of(place);
        self.parts.get(part)?.get()?.get(place)?.get()
    }

    /// Returns the number of the first program for which `is_it` returns true.
    pub fn find(&self, is_it: impl FnMut(&AskedProgram) -> bool) -> Option<ProgramId> {
        let found = (0..).map_while(|place| self.get(place)).position(is_it)?;
        Some(ProgramId::asked(found))
    }

    /// Adds the program that `make` returns for its number.
    pub fn add(&self, make: impl FnOnce(ProgramId) -> AskedProgram) -> ProgramId {
        // The length is valid even if its last user panicked.
        let mut length = self.length.lock().unwrap_or_else(PoisonError::into_inner);
        let id = ProgramId::asked(*length);
        let (part, place) = part_of(*length);
        let places = || (0..FIRST_PLACES << part).map(|_| OnceLock::new()).collect();
        self.parts[part].get_or_init(places)[place].get_or_init(|| make(id));
        *length += 1;
        id
    }
}

/// Returns the number of the part that a place is in, and the place in this part.
fn part_of(place: usize) -> (usize, usize) {
    let part = (place / FIRST_PLACES + 1).ilog2() as usize;
    (part, place - FIRST_PLACES * ((1 << part) - 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_follow_each_other() {
        let mut next = (0, 0);
        for place in 0..2000 {
            assert_eq!(part_of(place), next);
            next.1 += 1;
            if next.1 == FIRST_PLACES << next.0 {
                next = (next.0 + 1, 0);
            }
        }
    }
}
