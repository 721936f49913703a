//! An order in which each function stands next to those that it resembles.

use std::collections::{BTreeSet, HashMap};

/// The length in bytes of the pieces by which functions are compared: about two instructions.
const PIECE: usize = 4;

/// The largest number of functions that a piece may be in. One in more functions says little about their likeness, and comparing all
/// of them takes long.
const HOLDERS_MAX: usize = 8000;

/// Returns the numbers of the functions in an order that compresses well. The function after another one is the one that shares the
/// largest part of its pieces with it, of those that have no place yet. If none shares a piece, the first in the old order comes next.
pub fn neighbors(bodies: &[&[u8]]) -> Vec<usize> {
    let pieces = pieces(bodies);
    let mut holders = holders(&pieces);
    let mut has_place = vec![false; bodies.len()];
    // The number of pieces that each function shares with the last one.
    let mut shared = vec![0; bodies.len()];
    let mut order = Vec::new();
    for first in 0..bodies.len() {
        let mut next = (!has_place[first]).then_some(first);
        while let Some(last) = next {
            has_place[last] = true;
            order.push(last);
            next = nearest(last, &pieces, &mut holders, &has_place, &mut shared);
        }
    }
    order
}

/// Returns the function without a place that is most like `last`; `None` if no function shares a piece with it.
fn nearest(
    last: usize,
    pieces: &[Vec<usize>],
    holders: &mut [Vec<usize>],
    has_place: &[bool],
    shared: &mut [usize],
) -> Option<usize> {
    let mut met = Vec::new();
    for piece in &pieces[last] {
        // A function with a place is not met again.
        holders[*piece].retain(|function| !has_place[*function]);
        for function in &holders[*piece] {
            if shared[*function] == 0 {
                met.push(*function);
            }
            shared[*function] += 1;
        }
    }
    // The part that both share, of the pieces that either has. Products compare fractions without rounding.
    let likeness = |function: usize| {
        (shared[function], pieces[last].len() + pieces[function].len() - shared[function])
    };
    let better = |one: usize, other: usize| {
        let ((part, all), (other_part, other_all)) = (likeness(one), likeness(other));
        match (part * other_all).cmp(&(other_part * all)).then(other.cmp(&one)) {
            std::cmp::Ordering::Less => other,
            _ => one,
        }
    };
    let nearest = met.iter().copied().reduce(better);
    met.iter().for_each(|function| shared[*function] = 0);
    nearest
}

/// Returns the numbers of the pieces of each function, each once.
fn pieces(bodies: &[&[u8]]) -> Vec<Vec<usize>> {
    let mut numbers: HashMap<&[u8], usize> = HashMap::new();
    let mut pieces = Vec::new();
    for body in bodies {
        let all = body.windows(PIECE).map(|piece| {
            let next = numbers.len();
            *numbers.entry(piece).or_insert(next)
        });
        let unique: BTreeSet<usize> = all.collect();
        pieces.push(unique.into_iter().collect());
    }
    pieces
}

/// Returns the functions that have each piece; none for a piece that too many have.
fn holders(pieces: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let count = pieces.iter().flatten().max().map_or(0, |last| last + 1);
    let mut holders = vec![Vec::new(); count];
    for (function, pieces) in pieces.iter().enumerate() {
        for piece in pieces {
            holders[*piece].push(function);
        }
    }
    holders.iter_mut().filter(|all| all.len() > HOLDERS_MAX).for_each(Vec::clear);
    holders
}
