//! The parts of a program: the registration of the named functions, the global code, and one chunk
//! per function and lambda.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::bo::error::{BoCause, BoError};
use crate::bo::instruction::BoAction;
use crate::bo::read::Bo;

/// The code of a function or lambda, or the global code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Chunk {
    /// The range of its instructions, without the `done` or `ret0` at the end.
    pub code: Range<usize>,
    /// The chunk whose code creates this lambda; `None` for the global code and named functions.
    pub creator: Option<usize>,
}

/// A named function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Registration {
    /// The number of the string with the function's name.
    pub name: usize,
    /// Number of the instruction that pushes the name.
    pub at: usize,
    /// Number of the function's chunk.
    pub chunk: usize,
}

/// The parts of a program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Chunks {
    /// Named functions, in order. If two have one name, the last one counts.
    pub registrations: Vec<Registration>,
    /// The chunks. Number 0 is the global code; the others follow in the order of the file, so a
    /// lambda follows its creator.
    pub chunks: Vec<Chunk>,
    /// Maps the first instruction of each chunk to the chunk's number.
    starts: BTreeMap<usize, usize>,
}

impl Chunks {
    /// Finds the parts of a program.
    pub fn find(bo: &Bo) -> Result<Chunks, BoError> {
        let (registered, global) = registrations(bo)?;
        let mut starts = BTreeMap::from([(global, 0)]);
        for &(_, at, start) in &registered {
            if starts.insert(start, 0).is_some() {
                return Err(bo.error(at, BoCause::SharedFunction));
            }
        }
        let mut creations = BTreeMap::new();
        for at in global..bo.code.len() {
            match bo.action(at) {
                BoAction::PushL(start) => {
                    if starts.insert(start, 0).is_some() {
                        return Err(bo.error(at, BoCause::SharedFunction));
                    }
                    creations.insert(start, at);
                }
                BoAction::PushCn(_) => return Err(bo.error(at, BoCause::MisplacedFunction)),
                _ => {}
            }
        }
        let mut bounds: Vec<usize> = Vec::with_capacity(starts.len());
        for (number, (start, slot)) in starts.iter_mut().enumerate() {
            *slot = number;
            bounds.push(*start);
        }
        if let Some(early) = bounds.first().filter(|first| **first < global) {
            return Err(bo.error(*early, BoCause::FunctionInGlobalCode));
        }
        bounds.push(bo.code.len());
        let mut chunks = Vec::with_capacity(bounds.len());
        for (number, bound) in bounds.windows(2).enumerate() {
            let (start, end) = (bound[0], bound[1]);
            let creator = match creations.get(&start) {
                None => None,
                Some(at) => Some(creator(bo, &bounds, number, *at)?),
            };
            chunks.push(Chunk { code: start..body_end(bo, number, start, end)?, creator });
        }
        let registrations = registered
            .into_iter()
            .map(|(name, at, start)| Registration { name, at, chunk: starts[&start] })
            .collect();
        Ok(Chunks { registrations, chunks, starts })
    }

    /// Returns the first instruction of a chunk.
    pub fn start(&self, number: usize) -> usize {
        self.chunks[number].code.start
    }

    /// Returns the `done` or `ret0` at the end of a chunk.
    pub fn end(&self, number: usize) -> usize {
        self.chunks[number].code.end
    }

    /// Returns the chunk that starts at an instruction, to which a `pushl` refers.
    pub fn starting_at(&self, at: usize) -> usize {
        self.starts[&at]
    }
}

/// Returns the name, the registering instruction and the start of each named function, and the
/// start of the global code.
#[allow(clippy::type_complexity, reason = "the three numbers are taken apart at once")]
fn registrations(bo: &Bo) -> Result<(Vec<(usize, usize, usize)>, usize), BoError> {
    let mut found = Vec::new();
    let mut at = 0;
    while bo.action(at) != BoAction::Nop {
        match (bo.action(at), bo.action(at + 1), bo.action(at + 2)) {
            (BoAction::PushS(name), BoAction::PushCn(start), BoAction::Gstore) => {
                found.push((name, at, start))
            }
            _ => return Err(bo.error(at, BoCause::NoRegistrationEnd)),
        }
        at += 3;
    }
    if at >= bo.code.len() {
        return Err(bo.error(at, BoCause::NoRegistrationEnd));
    }
    Ok((found, at + 1))
}

/// Returns the chunk that creates lambda `number`; `at` is the creating instruction.
fn creator(bo: &Bo, bounds: &[usize], number: usize, at: usize) -> Result<usize, BoError> {
    let creator = bounds.partition_point(|start| *start <= at).saturating_sub(1);
    if creator < number { Ok(creator) } else { Err(bo.error(at, BoCause::LambdaBeforeCreator)) }
}

/// Returns the end of a chunk's code, which is the position of its final `done` or `ret0`.
fn body_end(bo: &Bo, number: usize, start: usize, end: usize) -> Result<usize, BoError> {
    // The Buzz compiler writes no `done` for a script without statements.
    if number == 0 && start == bo.code.len() && bo.strings.is_empty() {
        return Ok(start);
    }
    let last = end.saturating_sub(1).max(start);
    let (ending, cause) = match number {
        0 => (BoAction::Done, BoCause::MisplacedDone),
        _ => (BoAction::Ret0, BoCause::NoReturn),
    };
    if end == start || bo.action(last) != ending {
        return Err(bo.error(last, cause));
    }
    match (start..last).find(|at| bo.action(*at) == BoAction::Done) {
        Some(at) => Err(bo.error(at, BoCause::MisplacedDone)),
        None => Ok(last),
    }
}
