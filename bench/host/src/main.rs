//! The benchmark program of the host, see `bittybuzz_bench`: `bench-host FILE`, where the file has
//! the bytes that other programs contain.
//!
//! Callgrind counts the instructions that are executed in [`counted`], and writes a file at each
//! [`write_counts`]. The program prints the number and the value of the last mark.

use std::hint::black_box;
use std::process::ExitCode;

use bittybuzz_bench::{Mark, Meter, run, slots, split};
use bittybuzz_vm_core::number::Tiny;
use bittybuzz_vm_core::{Image, Vm};

struct Callgrind;

impl Meter for Callgrind {
    fn mark(&mut self, mark: Mark, value: u32) {
        println!("{} {value}", mark as u32);
    }

    fn count<R>(&mut self, work: impl FnOnce() -> R) -> R {
        let mut work = Some(work);
        let mut result = None;
        counted(&mut || result = work.take().map(|work| work()));
        write_counts();
        result.expect("it was called")
    }
}

/// Runs the work. Callgrind counts only in this function.
#[inline(never)]
fn counted(work: &mut dyn FnMut()) {
    black_box(work)();
}

/// Does nothing: Callgrind writes and clears its counts when this function is called.
#[inline(never)]
fn write_counts() {
    black_box(());
}

fn main() -> ExitCode {
    let Some(path) = std::env::args_os().nth(1) else {
        eprintln!("usage: bench-host FILE");
        return ExitCode::from(2);
    };
    let script = match std::fs::read(&path) {
        Ok(script) => script,
        Err(error) => {
            eprintln!("{}: {error}", path.display());
            return ExitCode::FAILURE;
        }
    };
    let (global, image) = split(&script);
    let mut vm: Vm<Tiny, &[u8], { slots::KILOBOT }> = Vm::new();
    run(&mut vm, Image::new(image), global, &mut Callgrind);
    ExitCode::SUCCESS
}
