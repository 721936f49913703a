//! Pairs of floats that a chip's instructions compute like integers and like this computer.

use crate::Verdict;
use anyhow::Result;
use bittybuzz_builds::on_chip::FLOATS;

/// Path prefixes of the files that the evidence is about.
pub const MADE_OF: &[&str] =
    &["targets/cortex-m/", "tests/on-chip/", "tests/soak/src/floats.rs", "vm-core/src/"];

/// Blocks of the sweep, each of 100,000 pairs.
const BLOCKS: std::ops::Range<u64> = 0..100;
/// Blocks of one item.
const ITEM: u64 = 25;

pub fn items() -> Vec<String> {
    BLOCKS.step_by(ITEM as usize).map(|start| format!("{start}..{}", start + ITEM)).collect()
}

pub fn run(blocks: &str) -> Result<Verdict> {
    Ok(match FLOATS.compare_floats(blocks) {
        Ok(evidence) => Verdict::Shown(evidence),
        Err(failure) => Verdict::Missing(failure.to_string()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_items_are_all_blocks() {
        assert_eq!(items(), ["0..25", "25..50", "50..75", "75..100"]);
    }
}
