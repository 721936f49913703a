//! Inputs that lead through all branches of a function.
//!
//! Random inputs reach most places. For the others the bytes of the tape on which a branch depended are changed one by one, or set
//! to what they were compared with (Aschermann et al., "REDQUEEN", NDSS 2019; Chen, Chen, "Angora", S&P 2018).

use std::collections::{HashMap, HashSet};

use super::run::{Hint, Passed, Run, Start, Tape, mix, run};

/// Random inputs that are tried first.
const RANDOM: u64 = 48;
/// Inputs that are kept of those that reach a branch.
const EXAMPLES: usize = 2;
/// Random changes of the inputs that reach a branch whose other outcome has not been seen.
const CHANGES: u64 = 200;
/// Random inputs that are kept even if they lead nowhere else.
const KEPT: usize = 6;
/// Places on the tape that hold registers.
const REGISTERS: usize = 32;
/// Inputs with small numbers that are tried where nothing is known of a branch.
const SMALL: u64 = 64;
/// Rounds without a new outcome before the search ends.
const PATIENCE: u32 = 2;

/// An outcome of a conditional instruction.
pub type Outcome = (usize, bool);

/// Inputs, and what they do not reach.
pub struct Found {
    /// Some random inputs, and others of which each reaches an outcome that those before do not.
    pub tapes: Vec<Tape>,
    /// Outcomes that were reached.
    pub seen: HashSet<Outcome>,
}

/// An input that reaches a branch.
struct Example {
    tape: Tape,
    tag: u128,
    hints: Vec<Hint>,
}

struct Search<'a> {
    start: &'a Start<'a>,
    reached: &'a mut [bool],
    seen: HashSet<Outcome>,
    /// For each outcome that was not seen, inputs that reach its instruction.
    open: HashMap<Outcome, Vec<Example>>,
    tapes: Vec<Tape>,
}

/// Looks for inputs of a function.
pub fn search(start: &Start<'_>, seed: u64, reached: &mut [bool]) -> Found {
    let mut search =
        Search { start, reached, seen: HashSet::new(), open: HashMap::new(), tapes: Vec::new() };
    for number in 0..RANDOM {
        let seed = mix(seed ^ mix(number));
        let tape = if number % 4 == 0 { small(seed) } else { Tape { bytes: Vec::new(), seed } };
        search.attempt(tape);
    }
    let mut idle = 0;
    let mut round = 0;
    while idle < PATIENCE && !search.open.is_empty() {
        let before = search.seen.len();
        let mut open: Vec<Outcome> = search.open.keys().copied().collect();
        open.sort_unstable();
        for outcome in open {
            search.approach(outcome, round);
        }
        round += 1;
        idle = if search.seen.len() == before { idle + 1 } else { 0 };
    }
    Found { tapes: search.tapes, seen: search.seen }
}

/// An input with small numbers in all registers: loops end soon, and what comes then depends on a part of the tape that is followed.
fn small(seed: u64) -> Tape {
    let mut tape = Tape { bytes: Vec::new(), seed };
    (0..REGISTERS).for_each(|place| tape.put(place, tape.at(place) & 3));
    tape
}

impl Search<'_> {
    /// Executes with an input and keeps it if it is of use.
    fn attempt(&mut self, tape: Tape) {
        let Run { path, .. } = run(self.start, &tape, self.reached, true);
        let mut is_new = self.tapes.len() < KEPT;
        for Passed { step, is_taken, tag, hints } in path {
            let outcome = (step, is_taken);
            if self.seen.insert(outcome) {
                is_new = true;
                self.open.remove(&outcome);
            }
            let other = (step, !is_taken);
            if !self.seen.contains(&other) {
                let examples = self.open.entry(other).or_default();
                // One that does not say on what the outcome depends gives way to one that does.
                let poor = examples.iter().position(|example| example.tag == 0 && tag != 0);
                if let (EXAMPLES, Some(poor)) = (examples.len(), poor) {
                    examples.remove(poor);
                }
                if examples.len() < EXAMPLES {
                    examples.push(Example { tape: tape.clone(), tag, hints });
                }
            }
        }
        if is_new {
            self.tapes.push(tape);
        }
    }

    /// Changes inputs that come near an outcome, until it is seen.
    fn approach(&mut self, outcome: Outcome, round: u64) {
        let Some(examples) = self.open.remove(&outcome) else { return };
        for example in &examples {
            self.equal(example);
            if self.seen.contains(&outcome) {
                return;
            }
        }
        // They depend on what is too far behind on the tape.
        if examples.iter().all(|example| example.tag == 0) {
            for number in 0..SMALL {
                self.attempt(small(mix(number ^ round << 32 ^ (outcome.0 as u64) << 40)));
            }
        }
        for example in examples.iter().filter(|_| round == 0) {
            for place in (0..128).filter(|place| example.tag & 1 << place != 0).take(8) {
                for value in 0..=255 {
                    let mut tape = example.tape.clone();
                    tape.put(place, value);
                    self.attempt(tape);
                    if self.seen.contains(&outcome) {
                        return;
                    }
                }
            }
        }
        let places: Vec<Vec<usize>> = examples
            .iter()
            .map(|example| (0..128).filter(|place| example.tag & 1 << place != 0).collect())
            .collect();
        for number in 0..CHANGES {
            let noise = |n: u64| mix(number ^ n << 32 ^ round << 48 ^ (outcome.0 as u64) << 8);
            let which = noise(1) as usize % examples.len();
            let mut tape = examples[which].tape.clone();
            tape.seed = if noise(2) & 1 == 0 { tape.seed } else { noise(3) };
            for change in 0..1 + noise(4) % 4 {
                let places = &places[which];
                let value = super::run::noise(noise(5 + change), number);
                if let Some(place) = places.get(noise(20 + change) as usize % places.len().max(1)) {
                    tape.put(*place, value);
                }
            }
            self.attempt(tape);
            if self.seen.contains(&outcome) {
                return;
            }
        }
        self.open.entry(outcome).or_insert(examples);
    }

    /// Makes what was compared equal, one too low and one too high; then all bytes on which the outcome depends the same.
    fn equal(&mut self, example: &Example) {
        for (first, change) in (0..example.hints.len()).flat_map(|n| [(n, 0), (n, 1), (n, 0xff)]) {
            // If both values changed they would not be equal.
            for side in [0, 1] {
                let mut tape = example.tape.clone();
                for (number, hint) in example.hints[first..].iter().enumerate() {
                    if let Some((place, value)) = hint[side].or(hint[1 - side]) {
                        tape.put(place, value.wrapping_add(if number == 0 { change } else { 0 }));
                    }
                }
                self.attempt(tape);
            }
        }
        // Also small numbers of several bytes, for loops that count.
        for (first, others) in
            [(0, 0), (1, 0), (2, 0), (0xff, 0xff), (0xfe, 0xff), (0x80, 0x80), (0x7f, 0x7f)]
        {
            let mut tape = example.tape.clone();
            let places = (0..128).filter(|place| example.tag & 1 << place != 0);
            for (number, place) in places.enumerate() {
                tape.put(place, if number == 0 { first } else { others });
            }
            self.attempt(tape);
        }
    }
}
