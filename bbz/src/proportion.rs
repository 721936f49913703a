//! Tests that memory and work of every reader of files are in proportion to the file.
//!
//! Files are exchanged between people. A small file that takes all memory is a defect, and so is time
//! that grows with the square of the length. The tests count bytes of memory: the most that are in
//! use at once, and all that are ever reserved as a measure of the work. Both are the same on every
//! computer and under any load. Work without memory does not show here: `cargo xtask bench readers`
//! counts the instructions of the same readers.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

mod assignment_tests;
mod firmware_tests;
mod others;
mod programs;
mod recordings;
mod scenario_tests;

use std::borrow::Borrow;
use std::env;
use std::hint::black_box;

use allocation_counter::{AllocationInfo, measure};

/// Memory that a reader may take whatever the file: tables of fixed size, and messages.
const CONSTANT: u64 = 1 << 20;

/// The largest growth of the work when the input doubles. Sorting takes a little more than 2.
const GROWTH_MAX: f64 = 2.3;

/// The variable with which `cargo xtask bench readers` runs these tests, under Callgrind.
const COUNTED: &str = "BITTYBUZZ_COUNTED";

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

/// The limits of a reader.
struct Limits {
    /// Bytes of memory for each byte of the input.
    per_byte: u64,
    /// Bytes of memory for any input.
    constant: u64,
}

/// The limits of most readers.
const LIMITS: Limits = Limits { per_byte: 64, constant: CONSTANT };

impl Limits {
    /// Reads inputs of three sizes, each about twice as long as the one before. `make` returns the
    /// input of a size.
    fn check<I: Borrow<T>, T: ?Sized + AsRef<[u8]>>(
        &self,
        shape: &str,
        size: usize,
        make: impl Fn(usize) -> I,
        read: impl Fn(&T),
    ) {
        // Tables that are made once, such as those of the robots, are no part of a measurement.
        read(make(1).borrow());
        if env::var_os(COUNTED).is_some() {
            for size in [size, 2 * size] {
                let input = make(size);
                counted(&mut || read(input.borrow()));
                write_counts();
                println!("counted {} {shape}", input.borrow().as_ref().len());
            }
            return;
        }
        let mut before: Option<AllocationInfo> = None;
        for size in [size, 2 * size, 4 * size] {
            let input = make(size);
            let input = input.borrow();
            let length = input.as_ref().len() as u64;
            let info = measure(|| read(input));
            let (peak, work) = (info.bytes_max, info.bytes_total);
            println!("{shape}: {length} bytes, {peak} at once, {work} in total");
            let most = self.per_byte * length + self.constant;
            assert!(peak <= most, "{shape}: {length} bytes take {peak} bytes of memory");
            if let Some(before) = before {
                let most = GROWTH_MAX * before.bytes_total as f64 + self.constant as f64;
                let less = before.bytes_total;
                assert!(work as f64 <= most, "{shape}: the work grows from {less} to {work}");
            }
            before = Some(info);
        }
    }
}
