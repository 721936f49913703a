//! Finds inputs that lead through all branches of a function.
//!
//! Random inputs reach most places. For the others, the bytes of the tape on which a branch
//! depended are changed one by one, or set to the values that they were compared with (Aschermann
//! et al., "REDQUEEN", NDSS 2019; Chen, Chen, "Angora", S&P 2018). A branch whose condition no
//! value meets is steered, so that no outcome is missed by chance.

use std::collections::{HashMap, HashSet};

use super::run::{Execution, InitialState, Passed, Steer, Tape, mix, run};
use super::trail::Hint;

/// Random inputs that are tried first.
const RANDOM: u64 = 48;
/// The most inputs that are kept for each outcome that was not seen.
const EXAMPLES: usize = 2;
/// Random changes of the inputs that reach a branch whose other outcome has not been seen.
const CHANGES: u64 = 200;
/// Random inputs that are kept even if they lead nowhere else.
const KEPT: usize = 6;
/// Places on the tape that hold registers.
const REGISTERS: usize = 32;
/// Inputs with small numbers that are tried if the values on which a branch depends are unknown.
const SMALL: u64 = 64;
/// Rounds without a new outcome after which the search ends.
const PATIENCE: u32 = 2;

/// An outcome of a conditional instruction.
pub type Outcome = (usize, bool);

/// An input of a function.
#[derive(Clone)]
pub struct Input {
    /// The values that the function reads.
    pub tape: Tape,
    /// The outcomes of the first conditional instructions, independent of the values.
    pub outcomes: Vec<bool>,
}

/// Inputs that reach all outcomes.
pub struct FoundInputs {
    /// Some random inputs, and others that each reach an outcome that the earlier ones do not.
    pub inputs: Vec<Input>,
    /// The number of outcomes that were reached.
    pub outcomes: usize,
    /// The number of reached outcomes whose conditions were never met.
    pub steered: usize,
}

/// An input that reaches a conditional instruction.
struct Example {
    tape: Tape,
    /// The outcomes before that instruction.
    outcomes: Vec<bool>,
    tag: u128,
    hints: Vec<Hint>,
}

impl Example {
    /// Returns an input with other values on the same path.
    fn with(&self, tape: Tape) -> Input {
        Input { tape, outcomes: self.outcomes.clone() }
    }
}

struct Search<'a> {
    start: &'a InitialState<'a>,
    reached: &'a mut [bool],
    seen: HashSet<Outcome>,
    /// For each outcome that was not seen, inputs that reach its instruction.
    open: HashMap<Outcome, Vec<Example>>,
    inputs: Vec<Input>,
}

/// Finds inputs of a function.
pub fn search(start: &InitialState<'_>, seed: u64, reached: &mut [bool]) -> FoundInputs {
    let mut search =
        Search { start, reached, seen: HashSet::new(), open: HashMap::new(), inputs: Vec::new() };
    for number in 0..RANDOM {
        let seed = mix(seed ^ mix(number));
        let tape = if number % 4 == 0 { small(seed) } else { Tape { bytes: Vec::new(), seed } };
        search.attempt(Input { tape, outcomes: Vec::new() });
    }
    let mut steered = 0;
    while !search.open.is_empty() {
        search.approach_all();
        steered += search.steer_all();
    }
    FoundInputs { inputs: search.inputs, outcomes: search.seen.len(), steered }
}

/// Returns an input with small numbers in all registers: loops end soon, and later conditions
/// depend on the tracked part of the tape.
fn small(seed: u64) -> Tape {
    let mut tape = Tape { bytes: Vec::new(), seed };
    (0..REGISTERS).for_each(|place| tape.put(place, tape.at(place) & 3));
    tape
}

impl Search<'_> {
    /// Executes with an input and keeps it if it is useful. An execution that was cut is continued
    /// after its last new outcome until it finds no other one; otherwise the instructions there,
    /// and the branches among them, might never be executed.
    fn attempt(&mut self, input: Input) {
        let mut next = Some(input);
        while let Some(input) = next.take() {
            next = self.execute(input);
        }
    }

    /// Executes with an input and keeps it if it is useful. Returns the input that continues the
    /// same path.
    fn execute(&mut self, input: Input) -> Option<Input> {
        let steer = Steer::Outcomes(&input.outcomes);
        let Execution { path, is_cut, .. } =
            run(self.start, &input.tape, steer, self.reached, true);
        let outcomes: Vec<bool> = path.iter().map(|passed| passed.is_taken).collect();
        // Conditional instructions up to the last one with a new outcome.
        let mut known = 0;
        for (number, Passed { step, is_taken, tag, hints }) in path.into_iter().enumerate() {
            let outcome = (step, is_taken);
            if self.seen.insert(outcome) {
                known = number + 1;
                self.open.remove(&outcome);
            }
            let other = (step, !is_taken);
            if !self.seen.contains(&other) {
                let examples = self.open.entry(other).or_default();
                // An example without known dependencies is replaced by one that has some.
                let poor = examples.iter().position(|example| example.tag == 0 && tag != 0);
                if let (EXAMPLES, Some(poor)) = (examples.len(), poor) {
                    examples.remove(poor);
                }
                if examples.len() < EXAMPLES {
                    let outcomes = outcomes[..number].to_vec();
                    examples.push(Example { tape: input.tape.clone(), outcomes, tag, hints });
                }
            }
        }
        if known == 0 && self.inputs.len() >= KEPT {
            return None;
        }
        let steered = input.outcomes.len();
        let kept = Input { tape: input.tape, outcomes: outcomes[..known].to_vec() };
        self.inputs.push(kept.clone());
        (is_cut && known > steered).then_some(kept)
    }

    /// Searches for values that meet the conditions, on the paths on which the conditional
    /// instructions were reached.
    fn approach_all(&mut self) {
        let mut idle = 0;
        let mut round = 0;
        while idle < PATIENCE && !self.open.is_empty() {
            let before = self.seen.len();
            for outcome in self.open_outcomes() {
                self.approach(outcome, round);
            }
            round += 1;
            idle = if self.seen.len() == before { idle + 1 } else { 0 };
        }
    }

    fn open_outcomes(&self) -> Vec<Outcome> {
        let mut open: Vec<Outcome> = self.open.keys().copied().collect();
        open.sort_unstable();
        open
    }

    /// Reaches all open outcomes against their conditions. Returns their number.
    ///
    /// An outcome is only open if its instruction was executed, and this function then reaches the
    /// outcome. All targets of branches are therefore reached.
    fn steer_all(&mut self) -> usize {
        let mut steered = 0;
        for outcome in self.open_outcomes() {
            let Some(examples) = self.open.remove(&outcome) else { continue };
            let shortest = examples.into_iter().min_by_key(|example| example.outcomes.len());
            let Some(Example { tape, mut outcomes, .. }) = shortest else { continue };
            outcomes.push(outcome.1);
            self.attempt(Input { tape, outcomes });
            steered += 1;
        }
        steered
    }

    /// Changes inputs that reach the instruction of an outcome, until the outcome is seen.
    fn approach(&mut self, outcome: Outcome, round: u64) {
        let Some(examples) = self.open.remove(&outcome) else { return };
        for example in &examples {
            self.equal(example);
            if self.seen.contains(&outcome) {
                return;
            }
        }
        // The examples depend on a part of the tape that is not tracked.
        if examples.iter().all(|example| example.tag == 0) {
            for number in 0..SMALL {
                let tape = small(mix(number ^ round << 32 ^ (outcome.0 as u64) << 40));
                self.attempt(examples[number as usize % examples.len()].with(tape));
            }
        }
        for example in examples.iter().filter(|_| round == 0) {
            for place in (0..128).filter(|place| example.tag & 1 << place != 0).take(8) {
                for value in 0..=255 {
                    let mut tape = example.tape.clone();
                    tape.put(place, value);
                    self.attempt(example.with(tape));
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
            self.attempt(examples[which].with(tape));
            if self.seen.contains(&outcome) {
                return;
            }
        }
        self.open.entry(outcome).or_insert(examples);
    }

    /// Makes compared values equal, one too low and one too high; then sets all bytes on which the
    /// outcome depends to common numbers.
    fn equal(&mut self, example: &Example) {
        for (first, change) in (0..example.hints.len()).flat_map(|n| [(n, 0), (n, 1), (n, 0xff)]) {
            // If both values changed, they would not be equal.
            for side in [0, 1] {
                let mut tape = example.tape.clone();
                for (number, hint) in example.hints[first..].iter().enumerate() {
                    if let Some((place, value)) = hint[side].or(hint[1 - side]) {
                        tape.put(place, value.wrapping_add(if number == 0 { change } else { 0 }));
                    }
                }
                self.attempt(example.with(tape));
            }
        }
        // Small numbers of several bytes are tried too, for loops that count.
        for (first, others) in
            [(0, 0), (1, 0), (2, 0), (0xff, 0xff), (0xfe, 0xff), (0x80, 0x80), (0x7f, 0x7f)]
        {
            let mut tape = example.tape.clone();
            let places = (0..128).filter(|place| example.tag & 1 << place != 0);
            for (number, place) in places.enumerate() {
                tape.put(place, if number == 0 { first } else { others });
            }
            self.attempt(example.with(tape));
        }
    }
}
