//! Functions that are equal up to the last byte.

use crate::renumber::Functions;
use std::collections::HashMap;

/// Returns for each function the number of the first one with the same type, locals and instructions.
pub fn firsts(functions: &Functions<'_>) -> Vec<usize> {
    let mut known = HashMap::new();
    let all = functions.types.iter().zip(&functions.bodies).enumerate();
    all.map(|(number, function)| *known.entry(function).or_insert(number)).collect()
}
