//! The steps from a module to one that compresses better.

use anyhow::{Context, Result};

use crate::renumber::{Functions, renumbered};
use crate::{equal, order};

/// Returns a module that does the same and compresses better.
pub fn tightened(mut module: Vec<u8>) -> Result<Vec<u8>> {
    // Functions that call equal ones are equal from the next round on.
    loop {
        let functions = Functions::of(&module)?;
        let firsts = equal::firsts(&functions);
        let count = firsts.iter().enumerate().filter(|(number, first)| number == *first).count();
        if count == firsts.len() {
            break;
        }
        let stays: Vec<usize> =
            (0..firsts.len()).filter(|number| firsts[*number] == *number).collect();
        module = renumbered(&module, &functions, &stays, &firsts)?;
    }
    let functions = Functions::of(&module)?;
    let order = order::neighbors(&functions.bodies);
    let same: Vec<usize> = (0..functions.bodies.len()).collect();
    let tight = renumbered(&module, &functions, &order, &same)?;
    wasmparser::validate(&tight).context("the module is not valid any more")?;
    Ok(tight)
}
