//! Makes a mistake in squeeze and sees the build of the Kilobot's image refuse the result.
//!
//! The image's assembly is taken from a build without a mistake; each mistake is made in a copy of the repository, which squeezes
//! and compares that assembly. Functions of cases that this image does not have come first, so most mistakes show in a second.

use super::mutants::{Mutant, copy_with, in_copy};
use crate::Verdict;
use crate::sources;
use anyhow::{Context, Result};
use bittybuzz_builds::board::KILOBOT;
use bittybuzz_builds::copy::{BUILT, Copy};
use bittybuzz_builds::shell::{Invocation, root, target};
use fs_err as fs;
use std::path::PathBuf;

/// Path prefixes of the compared sources.
pub const MADE_OF: &[&str] = &["tools/squeeze/", "tests/soak/src/squeeze.rs"];
/// Squeeze as it is: it must not be refused, or everything would be.
const UNCHANGED: &str = "unchanged";
/// Functions that no image has.
const FUNCTIONS: &str = "tools/squeeze/tests/functions.s";
/// A script that needs most parts of the machine.
const SCRIPT: &str = "examples/swarm/barrier.bzz";

/// Names of all, in the order in which they are tried.
pub fn items() -> Vec<String> {
    let names = MUTANTS.iter().map(|mutant| mutant.name);
    [UNCHANGED].into_iter().chain(names).map(str::to_owned).collect()
}

/// Builds squeeze with the mistake of that name, and lets the proof judge it.
pub fn run(name: &str) -> Result<Verdict> {
    let mutant = MUTANTS.iter().find(|mutant| mutant.name == name);
    println!("\n== {name}: {}", mutant.map_or("nothing", |mutant| mutant.breaks));
    let output = prove(&copy_with(mutant)?, &[root().join(FUNCTIONS), assembly()?])?;
    let refused = output.lines().find(|line| line.starts_with("refused: "));
    Ok(match (mutant, refused) {
        (Some(_), Some(refusal)) => Verdict::Shown(refusal.to_owned()),
        (Some(_), None) => Verdict::Missing("it is not refused".to_owned()),
        (None, None) => Verdict::Shown(output.trim().replace('\n', " ")),
        (None, Some(refusal)) => Verdict::Missing(refusal.to_owned()),
    })
}

/// The assembly of the Kilobot's image, as LLVM writes it. It is built once.
fn assembly() -> Result<PathBuf> {
    let kept = target()?.join("soak/squeeze/image.s");
    if kept.exists() {
        return Ok(kept);
    }
    Invocation::cargo(&["build", "--release"])
        .env("BBZ_SCRIPT", &root().join(SCRIPT).display().to_string())
        .env("BBZ_PARTS", "used")
        .in_workspace(KILOBOT.folder)
        .run()?;
    let is_image = |path: &PathBuf| {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or("");
        name.starts_with("bittybuzz_kilobot_avr-")
            && name.ends_with(".s")
            && !name.ends_with(".squeezed.s")
    };
    let made = root().join(BUILT).join("avr-none/release/deps");
    let images = fs::read_dir(made)?.flatten().map(|entry| entry.path()).filter(is_image);
    // Builds of older compilers may be left there.
    let newest = images.max_by_key(|path| path.metadata().and_then(|file| file.modified()).ok());
    sources::write(&kept, &fs::read(newest.context("the build left no assembly")?)?)?;
    Ok(kept)
}

/// The output of the example that squeezes and compares. A refusal is a result; a squeeze that cannot be built is none.
fn prove(copy: &Copy, assembly: &[PathBuf]) -> Result<String> {
    let files: Vec<String> = assembly.iter().map(|path| path.display().to_string()).collect();
    let mut arguments =
        vec!["run", "--release", "-p", "bittybuzz-squeeze", "--example", "prove", "--"];
    arguments.extend(files.iter().map(String::as_str));
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let output = in_copy(Invocation::cargo(&arguments), copy, "").output_if(|output| {
        output.status.success()
            || text(&output.stdout).lines().any(|line| line.starts_with("refused: "))
    })?;
    Ok(text(&output.stdout))
}

/// Mistakes that change this image or those functions, and that have to be refused.
const MUTANTS: &[Mutant] = &[
    Mutant {
        name: "carry-of-cpc",
        file: "tools/squeeze/src/effect.rs",
        find: "two().and_then(|(one, other)| effect(one.or(other).or(with_carry), Set::FLAGS))",
        put: "two().and_then(|(one, other)| effect(one.or(other), Set::FLAGS))",
        breaks: "a comparison before `cpc` counts as unread",
    },
    Mutant {
        name: "carry-of-rol",
        file: "tools/squeeze/src/effect.rs",
        find: "\"rol\" | \"ror\" => effect(one()?.or(Set::C),",
        put: "\"rol\" | \"ror\" => effect(one()?,",
        breaks: "the carry before `rol` counts as unread",
    },
    Mutant {
        name: "pointer-register",
        file: "tools/squeeze/src/effect.rs",
        find: "'Z' => Set::pair(30),",
        put: "'Z' => Set::pair(28),",
        breaks: "Z is another pair of registers",
    },
    Mutant {
        name: "high-byte-of-mul",
        file: "tools/squeeze/src/effect.rs",
        find: "let result = Set::pair(0).or(Set::C)",
        put: "let result = Set::register(0).or(Set::C)",
        breaks: "the high byte of a product stays unknown",
    },
    Mutant {
        name: "pair-of-movw",
        file: "tools/squeeze/src/effect.rs",
        find: "\"movw\" => effect(Set::pair(register(second)?),",
        put: "\"movw\" => effect(Set::register(register(second)?),",
        breaks: "`movw` reads one register",
    },
    Mutant {
        name: "loads-go",
        file: "tools/squeeze/src/effect.rs",
        find: "acts(reads, writes.or(one()?))",
        put: "effect(reads, writes.or(one()?))",
        breaks: "loads are taken to be unneeded",
    },
    Mutant {
        name: "arguments",
        file: "tools/squeeze/src/flow.rs",
        find: "after.without(Set::CALL_USED).or(callee.arguments).or(Set::register(1))",
        put: "after.without(Set::CALL_USED).or(Set::register(1))",
        breaks: "a call reads no arguments",
    },
    Mutant {
        name: "results",
        file: "tools/squeeze/src/flow.rs",
        find: "let read = callee.results.or(after.and(Set::RESULTS));",
        put: "let read = callee.results;",
        breaks: "results are taken to be unread",
    },
    Mutant {
        name: "branch-targets",
        file: "tools/squeeze/src/flow.rs",
        find: "Some(target) => next.push(target),",
        put: "Some(_) => {}",
        breaks: "nothing is read where a branch leads",
    },
    Mutant {
        name: "labels-forgotten",
        file: "tools/squeeze/src/value.rs",
        find: "\n                    values = Values::unknown(has_zero);",
        put: "",
        breaks: "what is known stays known behind a label",
    },
    Mutant {
        name: "calls-forgotten",
        file: "tools/squeeze/src/value.rs",
        find: "{ Set::CALL_USED } else { Set::ALL }",
        put: "{ Set::EMPTY } else { Set::ALL }",
        breaks: "a call changes no register",
    },
    Mutant {
        name: "zeros",
        file: "tools/squeeze/src/value.rs",
        find: "zero(first) && zero(second)",
        put: "zero(first) || zero(second)",
        breaks: "a comparison goes if one of both is zero",
    },
    Mutant {
        name: "mov-sets-zero",
        file: "tools/squeeze/src/tidy.rs",
        find: "            | \"lsl\"\n",
        put: "            | \"lsl\"\n            | \"mov\"\n            | \"lds\"\n",
        breaks: "loads and copies count as comparisons",
    },
    Mutant {
        name: "opposite-of-brlo",
        file: "tools/squeeze/src/branch.rs",
        find: "(\"brlo\", \"brsh\")",
        put: "(\"brlo\", \"brge\")",
        breaks: "an unsigned condition becomes a signed one",
    },
    Mutant {
        name: "opposite-of-breq",
        file: "tools/squeeze/src/branch.rs",
        find: "(\"breq\", \"brne\")",
        put: "(\"breq\", \"brcc\")",
        breaks: "a condition is turned into another one",
    },
    Mutant {
        name: "target-of-branch",
        file: "tools/squeeze/src/branch.rs",
        find: "                code.operands = jump.operands;\n",
        put: "",
        breaks: "a branch keeps its old target",
    },
    Mutant {
        name: "jump-stays",
        file: "tools/squeeze/src/branch.rs",
        find: "            listing.remove(jump);\n",
        put: "",
        breaks: "the jump behind a chained branch stays",
    },
    Mutant {
        name: "any-chain",
        file: "tools/squeeze/src/layout.rs",
        find: "*other != number && begins_with(&chains[*other], target))",
        put: "*other != number && !begins_with(&chains[*other], target))",
        breaks: "other code is moved behind a jump",
    },
    Mutant {
        name: "order-of-restore",
        file: "tools/squeeze/src/frame.rs",
        find: "for register in (first..=17).rev() {",
        put: "for register in first..=17 {",
        breaks: "registers are restored in the wrong order",
    },
    Mutant {
        name: "carry-of-room",
        file: "tools/squeeze/src/frame.rs",
        find: "\\tsub\\tr28, r26\\n\\tsbc\\tr29, r1\\n",
        put: "\\tsub\\tr28, r26\\n\\tsbc\\tr29, r26\\n",
        breaks: "the frame is elsewhere",
    },
    Mutant {
        name: "r17-not-saved",
        file: "tools/squeeze/src/frame.rs",
        find: "for register in (2..=17).chain([28, 29]) {",
        put: "for register in (2..=16).chain([28, 29]) {",
        breaks: "a register is not saved",
    },
    Mutant {
        name: "order-of-y",
        file: "tools/squeeze/src/frame.rs",
        find: "\\tpop\\tr29\\n\\tpop\\tr28\\n",
        put: "\\tpop\\tr28\\n\\tpop\\tr29\\n",
        breaks: "Y is restored with its bytes exchanged",
    },
    Mutant {
        name: "room",
        file: "tools/squeeze/src/frame.rs",
        find: "&format!(\"r26, {room}\")",
        put: "&format!(\"r26, {}\", room.wrapping_add(1))",
        breaks: "variables have a byte more",
    },
    Mutant {
        name: "no-return",
        file: "tools/squeeze/src/outline.rs",
        find: "text.push_str(\"\\tret\\n\");",
        put: "text.push_str(\"\\tnop\\n\");",
        breaks: "a shared sequence does not return",
    },
    Mutant {
        name: "first-dropped",
        file: "tools/squeeze/src/outline.rs",
        find: "for line in &best[0] {",
        put: "for line in &best[0][1..] {",
        breaks: "a shared sequence lacks its first instruction",
    },
    Mutant {
        name: "stack-moves",
        file: "tools/squeeze/src/outline.rs",
        find: "        && !uses_stack\n",
        put: "",
        breaks: "sequences that use the stack are shared",
    },
    Mutant {
        name: "one-more",
        file: "tools/squeeze/src/tail.rs",
        find: "(from + pairs).min(left.whole)",
        put: "(from + pairs + 1).min(left.whole)",
        breaks: "an end is shared with an instruction that is not common",
    },
    Mutant {
        name: "label-too-late",
        file: "tools/squeeze/src/tail.rs",
        find: "labels.push((first, label));",
        put: "labels.push((first + 1, label));",
        breaks: "a shared end lacks its first instruction",
    },
    Mutant {
        name: "interrupts-forgotten",
        file: "tools/squeeze/src/fixed.rs",
        find: "code.name == \"cli\" ||",
        put: "code.name == \"sei\" ||",
        breaks: "code with interrupts off is shared",
    },
    Mutant {
        name: "assembly-forgotten",
        file: "tools/squeeze/src/fixed.rs",
        find: "*mark |= by_hand;",
        put: "*mark |= false;",
        breaks: "asm! blocks are shared",
    },
    Mutant {
        name: "carry-of-adc",
        file: "tools/squeeze/src/effect.rs",
        find: "effect(to.or(from).or(Set::C), to.or(Set::FLAGS))",
        put: "effect(to.or(from), to.or(Set::FLAGS))",
        breaks: "the carry before `adc` counts as unread",
    },
    Mutant {
        name: "carry-of-sbci",
        file: "tools/squeeze/src/effect.rs",
        find: "\"sbci\" => effect(one()?.or(with_carry),",
        put: "\"sbci\" => effect(one()?,",
        breaks: "the borrow before `sbci` counts as unread",
    },
    Mutant {
        name: "flag-of-brcs",
        file: "tools/squeeze/src/effect.rs",
        find: "\"brcs\" | \"brcc\" | \"brlo\" | \"brsh\" => acts(Set::C, Set::EMPTY),",
        put: "\"brlo\" | \"brsh\" => acts(Set::C, Set::EMPTY),\n            \"brcs\" | \"brcc\" => acts(Set::Z, Set::EMPTY),",
        breaks: "`brcs` reads another flag",
    },
    Mutant {
        name: "half-of-movw",
        file: "tools/squeeze/src/effect.rs",
        find: "\"movw\" => effect(Set::pair(register(second)?), Set::pair(register(first)?)),",
        put: "\"movw\" => effect(Set::pair(register(second)?), Set::register(register(first)?)),",
        breaks: "`movw` writes one register",
    },
    Mutant {
        name: "and-as-or",
        file: "tools/squeeze/src/value.rs",
        find: "\"andi\" if held < 256 => held & number()?,",
        put: "\"andi\" if held < 256 => held | number()?,",
        breaks: "a known value and a constant give another value",
    },
    Mutant {
        name: "no-branch-between",
        file: "tools/squeeze/src/tidy.rs",
        find: "\n                        && !listing.is_branch_behind_branch(line, function.end)",
        put: "",
        breaks: "a comparison goes of which a second branch reads another flag",
    },
    Mutant {
        name: "skips-forgotten",
        file: "tools/squeeze/src/tidy.rs",
        find: "if skipped || by_hand {",
        put: "if by_hand {",
        breaks: "what may have been skipped counts as done",
    },
    Mutant {
        name: "pushed-arguments",
        file: "tools/squeeze/src/flow.rs",
        find: "\n                && effect.is_some_and(|effect| effect.reads.is_apart(Set::CALL_USED));",
        put: ";",
        breaks: "the first instructions read no arguments",
    },
    Mutant {
        name: "zero-in-handlers",
        file: "tools/squeeze/src/value.rs",
        find: "let has_zero = !is_interrupt(listing, function);",
        put: "let has_zero = true;",
        breaks: "handlers of interrupts find zero in r1",
    },
    Mutant {
        name: "timed-pairs",
        file: "tools/squeeze/src/fixed.rs",
        find: "marks[*line..=*second].fill(true);",
        put: "marks[*line..=*second].fill(false);",
        breaks: "writes that belong together are drawn apart",
    },
    Mutant {
        name: "assembly-released",
        file: "tools/squeeze/src/fixed.rs",
        find: ".all(is_inward)",
        put: ".any(is_inward)",
        breaks: "asm! blocks that touch I/O registers are code as any other",
    },
];

/// Those that CI tries: one of liveness and one of sequences.
pub const SAMPLE: [&str; 2] = ["arguments", "stack-moves"];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mutants::mutate;
    use std::collections::BTreeSet;

    #[test]
    fn every_mutant_can_be_made() {
        for mutant in MUTANTS {
            let text = std::fs::read_to_string(root().join(mutant.file)).unwrap();
            let mutated = mutate(mutant, &text).unwrap_or_else(|failure| panic!("{failure}"));
            assert_ne!(mutated, text, "{}", mutant.name);
        }
    }

    #[test]
    fn names_are_unique_and_the_sample_exists() {
        let names: BTreeSet<&str> = MUTANTS.iter().map(|mutant| mutant.name).collect();
        assert_eq!(names.len(), MUTANTS.len());
        assert!(SAMPLE.iter().all(|name| names.contains(name)));
    }
}
