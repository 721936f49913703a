//! A processor's instructions for floats give the bits of the machine's integers, and those of this computer.

use crate::elf::Linked;
use crate::target::Target;
use crate::{SUMMARY, line, range, variable};
use bittybuzz_on_chip::{BLOCK_PAIRS, header_of_block, sweep};
use bittybuzz_tests::{files, report};

#[test]
#[ignore = "needs the chips' programs: `cargo xtask soak floats`"]
fn a_chip_computes_floats_like_integers_and_the_host() {
    let target = Target::find(&variable("BITTYBUZZ_TARGET"));
    let program = std::fs::read(variable("BITTYBUZZ_PROGRAM"));
    let chip = Linked::new(program.expect("the chip's program can be read"));
    let blocks: Vec<u32> = range(&variable("BITTYBUZZ_SEEDS")).map(|block| block as u32).collect();
    let folder =
        tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("the build folder is writable");
    let failures = files::in_parallel(&blocks, |block| {
        let header = header_of_block(*block);
        let file = folder.path().join(block.to_string());
        let printed = target.emulator.run(&chip.with(&header.to_bytes()), &file, 1);
        let expected = line(&sweep(header).expect("the header asks for a sweep"));
        (printed != [expected.clone()])
            .then(|| format!("block {block}: {printed:?} instead of `{expected}`\n"))
    });
    let failures: Vec<String> = failures.into_iter().flatten().collect();
    let pairs = u64::from(BLOCK_PAIRS) * blocks.len() as u64;
    println!("{SUMMARY}{pairs} pairs of floats in {} blocks", blocks.len());
    report::conclude(target.name, blocks.len(), 1, &failures);
}
