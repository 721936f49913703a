//! Runs an image in every way that must make no difference: in small slices, with a collection at every allocation, in the
//! smallest memory that works; with less, and when an allocation fails, it stops cleanly.

use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{FaultCode, ImageError, Torture, Vm};

use crate::machine::{self, End, Settings, Trace};

/// An image, and how it runs if nothing is in its way.
struct Case<'v, 'i, P: Profile, const SLOTS: usize> {
    vm: &'v mut Vm<P, &'i [u8], SLOTS>,
    image: &'i [u8],
    unlimited: Settings,
    expected: Trace,
}

/// Runs an image with all memory that the machine has, then in every other way; what it did is the same. A run that is
/// given up after `most` instructions, or for which that memory is not enough, is not compared in all of them.
/// Of the allocations at most `failures`, evenly spread, are made to fail, one for each run.
///
/// # Errors
/// In which way what differs.
///
/// # Panics
/// If the machine breaks one of its promises, whatever the script does.
pub fn in_every_way<'i, P: Profile, const SLOTS: usize>(
    vm: &mut Vm<P, &'i [u8], SLOTS>,
    image: &'i [u8],
    most: u64,
    failures: u32,
) -> Result<Trace, String> {
    let unlimited = Settings {
        slots: SLOTS,
        budget: u16::MAX,
        torture: Torture::default(),
        audit: false,
        most,
    };
    let expected = machine::run(vm, image, &unlimited);
    let allocations = vm.torture.allocations;
    // Slices that were not used up did not count, of which there were more than there will be.
    let unlimited = Settings { most: 10 * most, ..unlimited };
    let mut case = Case { vm, image, unlimited, expected };
    match case.expected.end {
        End::GivenUp | End::Refused(_) => {}
        End::Fault(fault) if is_memory(fault.code) => case.slices()?,
        End::Complete | End::Fault(_) => {
            case.slices()?;
            case.collections()?;
            let enough = case.little_memory()?;
            case.failing_allocations(enough, allocations, failures)?;
        }
    }
    Ok(case.expected)
}

/// Whether a fault is for want of memory.
pub fn is_memory(code: FaultCode) -> bool {
    matches!(code, FaultCode::OutOfMemory | FaultCode::StackOverflow)
}

impl<P: Profile, const SLOTS: usize> Case<'_, '_, P, SLOTS> {
    fn run(&mut self, settings: &Settings) -> Trace {
        machine::run(self.vm, self.image, settings)
    }

    fn run_the_same(&mut self, way: &str, settings: &Settings) -> Result<(), String> {
        let trace = self.run(settings);
        same(&self.expected, &trace).map_err(|problem| format!("{way}: {problem}"))
    }

    fn slices(&mut self) -> Result<(), String> {
        [1, 7].into_iter().try_for_each(|budget| {
            let settings = Settings { budget, ..self.unlimited };
            self.run_the_same(&format!("budget {budget}"), &settings)
        })
    }

    fn collections(&mut self) -> Result<(), String> {
        let torture = Torture { collect_always: true, ..Torture::default() };
        let looked_at = Settings { budget: 61, audit: true, ..self.unlimited };
        let ways = [
            ("memory looked at", looked_at),
            ("a collection at every allocation", Settings { torture, ..self.unlimited }),
            ("both", Settings { torture, ..looked_at }),
        ];
        self.pauses()?;
        ways.iter().try_for_each(|(way, settings)| self.run_the_same(way, settings))
    }

    /// Collections that stop and go on between slices. Each pause counts as a slice.
    fn pauses(&mut self) -> Result<(), String> {
        let torture = Torture { pauses_collections: true, ..Torture::default() };
        let always = Torture { collect_always: true, ..torture };
        let paused = Settings { torture, most: 100 * self.unlimited.most, ..self.unlimited };
        let ways = [
            ("pauses", Settings { budget: 7, ..paused }),
            ("pauses after every allocation", Settings { torture: always, budget: 500, ..paused }),
            ("pauses after every step", Settings { torture: always, budget: 1, ..paused }),
            (
                "memory looked at in pauses",
                Settings { torture: always, budget: 5, audit: true, ..paused },
            ),
        ];
        ways.iter().try_for_each(|(way, settings)| self.run_the_same(way, settings))
    }

    /// The smallest memory that works, and what happens with less.
    fn little_memory(&mut self) -> Result<usize, String> {
        let (mut too_few, mut enough) = (0, SLOTS);
        while enough - too_few > 1 {
            // Few programs need much.
            let slots = ((too_few + enough) / 2).min(2 * too_few + 64);
            let settings = Settings { slots, ..self.unlimited };
            let trace = self.run(&settings);
            if trace == self.expected {
                enough = slots;
            } else {
                out_of_memory(&self.expected, &trace)
                    .map_err(|problem| format!("{slots} slots: {problem}"))?;
                too_few = slots;
            }
        }
        for (budget, audit) in [(u16::MAX, false), (1, false), (7, true)] {
            let settings = Settings { slots: enough, budget, audit, ..self.unlimited };
            let trace = self.run(&settings);
            if audit {
                // Looking at memory collects, so that it is used in another way.
                out_of_memory(&self.expected, &trace).or_else(|_| same(&self.expected, &trace))
            } else {
                same(&self.expected, &trace)
            }
            .map_err(|problem| format!("{enough} slots, budget {budget}: {problem}"))?;
        }
        let torture = Torture { pauses_collections: true, ..Torture::default() };
        let most = 100 * self.unlimited.most;
        for budget in [1, 50] {
            let settings = Settings { slots: enough, budget, torture, most, ..self.unlimited };
            let trace = self.run(&settings);
            // Collections come at other times, so memory is used in another way.
            out_of_memory(&self.expected, &trace)
                .or_else(|_| same(&self.expected, &trace))
                .map_err(|problem| format!("{enough} slots, pauses, budget {budget}: {problem}"))?;
            let slots = (2 * enough + 64).min(SLOTS);
            self.run_the_same(
                &format!("twice {enough} slots, pauses"),
                &Settings { slots, ..settings },
            )?;
        }
        // A little more need not be enough, as garbage then lies in other places; twice as much is.
        let settings = Settings { slots: (2 * enough + 64).min(SLOTS), ..self.unlimited };
        self.run_the_same(&format!("twice {enough} slots"), &settings)?;
        Ok(enough)
    }

    /// An allocation fails: a clean fault, after which the machine works as before.
    fn failing_allocations(
        &mut self,
        slots: usize,
        allocations: u32,
        failures: u32,
    ) -> Result<(), String> {
        let settings = Settings { slots, ..self.unlimited };
        let count = allocations.min(failures);
        for number in 0..count {
            let fail_at = (u64::from(number) * u64::from(allocations) / u64::from(count)) as u32;
            let torture = Torture { fail_at: Some(fail_at), ..Torture::default() };
            let trace = self.run(&Settings { torture, ..settings });
            match trace.end {
                End::Fault(fault) if fault.code == FaultCode::OutOfMemory => {
                    out_of_memory(&self.expected, &trace)
                }
                end => Err(format!("ends with {end:?}")),
            }
            .map_err(|problem| format!("allocation {fail_at} fails: {problem}"))?;
            if number % 16 == 0 {
                self.run_the_same(&format!("after allocation {fail_at} failed"), &settings)?;
            }
        }
        Ok(())
    }
}

/// A clean end for want of memory, after nothing but what is expected.
fn out_of_memory(expected: &Trace, trace: &Trace) -> Result<(), String> {
    match trace.end {
        End::Fault(fault) if is_memory(fault.code) => {}
        End::Refused(ImageError::TooManyGlobals(_) | ImageError::TooManyJumps(_)) => {}
        end => return Err(format!("ends with {end:?}{}", difference(expected, trace))),
    }
    if expected.output.starts_with(&trace.output) {
        Ok(())
    } else {
        Err(format!("other output before the fault{}", difference(expected, trace)))
    }
}

/// Whether two runs did the same.
///
/// # Errors
/// What differs.
pub fn same(expected: &Trace, trace: &Trace) -> Result<(), String> {
    if trace == expected {
        return Ok(());
    }
    let ends = format!("{:?} instead of {:?}", trace.end, expected.end);
    let globals = if trace.globals == expected.globals { "" } else { ", other globals" };
    Err(format!("{ends}{globals}{}", difference(expected, trace)))
}

fn difference(expected: &Trace, trace: &Trace) -> String {
    let pairs = expected.output.lines().zip(trace.output.lines());
    let Some((number, (a, b))) = pairs.enumerate().find(|(_, (a, b))| a != b) else {
        let (a, b) = (expected.output.lines().count(), trace.output.lines().count());
        return format!("; {b} lines of output instead of {a}");
    };
    format!("; line {}: `{b}` instead of `{a}`", number + 1)
}
