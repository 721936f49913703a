//! Checks the 16-bit float for every operand, against the exact model of the tests.
//!
//! `cargo run --locked --release -p bittybuzz-vm-core --example f16_exhaustive -- [FIRST] [COUNT]` checks
//! sum, difference, product, quotient and order of the left operands FIRST.. (0..65536, default all)
//! with all 65,536 right operands. The conversion of every binary32 number is checked once, when FIRST
//! is 0. The exit status is 1 if a result is wrong.

#[path = "../tests/number/float16_model.rs"]
mod model;

use std::process::ExitCode;
use std::thread;

use bittybuzz_vm_core::number::F16;

/// Runs `check` on every number of the range, on all processors; the sum of what it returns.
fn count_failures(first: u32, last: u32, check: impl Fn(u32) -> u64 + Sync) -> u64 {
    let workers = thread::available_parallelism().map_or(1, |count| count.get());
    thread::scope(|scope| {
        let check = &check;
        let started: Vec<_> = (0..workers)
            .map(|worker| {
                scope.spawn(move || (first..=last).skip(worker).step_by(workers).map(check).sum())
            })
            .collect();
        started.into_iter().map(|worker| worker.join().unwrap_or(1)).sum::<u64>()
    })
}

fn wrong_results(a: u32) -> u64 {
    let a = a as u16;
    let mut wrong = 0;
    for b in 0..=u16::MAX {
        let (expected, computed) = (model::expected(a, b), model::computed(a, b));
        if expected != computed {
            eprintln!("{a:#06x} {b:#06x}: {computed:04x?}, right is {expected:04x?}");
            wrong += 1;
        }
        let (expected, computed) = (model::expected_order(a, b), model::computed_order(a, b));
        if expected != computed {
            eprintln!("{a:#06x} {b:#06x}: {computed:?}, right is {expected:?}");
            wrong += 1;
        }
    }
    wrong
}

fn wrong_conversions(high: u32) -> u64 {
    let mut wrong = 0;
    for low in 0..=0xFFFF {
        let value = f32::from_bits(high << 16 | low);
        let packed = F16::from_f32(value);
        if packed.0 != model::from_f32(value) || F16::pack(&packed.unpack()) != packed {
            eprintln!("{value:e} becomes {:#06x}", packed.0);
            wrong += 1;
        }
    }
    wrong
}

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1).map(|argument| argument.parse::<u32>());
    let (Ok(first), Ok(count)) =
        (arguments.next().unwrap_or(Ok(0)), arguments.next().unwrap_or(Ok(65536)))
    else {
        eprintln!("usage: f16_exhaustive [FIRST] [COUNT]");
        return ExitCode::from(3);
    };
    if first > 65535 || count == 0 {
        eprintln!("FIRST is in 0..65536, COUNT at least 1");
        return ExitCode::from(3);
    }
    let last = first.saturating_add(count - 1).min(65535);
    let mut wrong = count_failures(first, last, wrong_results);
    println!("left operands {first}..={last}: {wrong} pairs wrong");
    if first == 0 {
        let conversions = count_failures(0, 65535, wrong_conversions);
        println!("conversion of all binary32 numbers: {conversions} wrong");
        wrong += conversions;
    }
    if wrong == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
