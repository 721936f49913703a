//! Loads an image and runs it within bounds.

use bittybuzz_testkit::{Answer, Event, Recorder};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{
    Entry, Fault, FaultCode, Image, ImageError, Outcome, Refusal, RobotFault, Torture, Vm,
};

/// The most slots that a run gets.
const SLOTS: usize = 1044;
/// Instructions that all entries together get.
const INSTRUCTIONS: u32 = 2000;

/// How to run.
#[derive(Clone, Copy)]
struct Settings {
    slots: usize,
    budget: u16,
    instructions: u32,
    torture: Torture,
    /// Whether to look at memory on the way.
    audit: bool,
}

/// How a run ended, and what the host saw.
#[derive(Debug, PartialEq, Eq)]
struct Trace {
    end: End,
    seen: Vec<Event>,
}

impl Trace {
    /// It ended, and not for want of memory.
    fn is_conclusive(&self) -> bool {
        match self.end {
            End::Complete => true,
            End::Fault(fault) => !is_memory(fault.code),
            End::Cut => false,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    Complete,
    Fault(Fault),
    /// It would go on.
    Cut,
}

fn is_memory(code: FaultCode) -> bool {
    matches!(code, FaultCode::OutOfMemory | FaultCode::StackOverflow)
}

/// Whether the verifier lets an image pass, in the profile that it names.
pub fn verify(image: &[u8]) -> Result<(), ImageError> {
    match load::<Full>(image, SLOTS) {
        Err(ImageError::Profile) => load::<Tiny>(image, SLOTS).map(|_| ()),
        result => result.map(|_| ()),
    }
}

/// Runs an image in the profile that it names.
pub fn run_both(image: &[u8]) -> Result<(), ImageError> {
    match run_twice::<Full>(image) {
        Err(ImageError::Profile) => run_twice::<Tiny>(image),
        result => result,
    }
}

type Machine<'i, P> = Box<Vm<P, &'i [u8], SLOTS>>;

fn load<P: Profile>(image: &[u8], slots: usize) -> Result<Machine<'_, P>, ImageError> {
    let mut vm = Box::new(Vm::new());
    // Any robot function is known, so that calls of them are reached.
    match vm.load_limited(Image::new(image), slots, |_| true) {
        Ok(()) => Ok(vm),
        Err(error) => {
            assert!(vm.header().is_none() && !vm.begin(Entry::Global), "a refused image runs");
            Err(error)
        }
    }
}

/// Runs an image once without interference; and once in another way, which makes no difference. The script hash
/// decides how, as nothing else depends on it and the fuzzer can change it.
fn run_twice<P: Profile>(image: &[u8]) -> Result<(), ImageError> {
    let byte = |at: usize| image.get(at).copied().unwrap_or(0);
    let [slots, way, number, budget] = [3, 4, 5, 6].map(byte);
    let settings = Settings {
        slots: 24 + 4 * usize::from(slots),
        budget: 500,
        instructions: INSTRUCTIONS,
        torture: Torture::default(),
        audit: false,
    };
    let mut vm = load::<P>(image, settings.slots)?;
    let once = run(&mut vm, image.len(), settings);
    let slices =
        Settings { budget: 1 + u16::from(budget % 8), instructions: 2 * INSTRUCTIONS, ..settings };
    let collecting = Torture { collect_always: true, ..Torture::default() };
    let other = match way % 4 {
        0 => slices,
        1 => Settings { torture: collecting, ..slices },
        2 => Settings { torture: collecting, audit: true, ..slices },
        _ => {
            let allocations = vm.torture.allocations;
            return fail::<P>(image, &settings, &once, u32::from(number), allocations);
        }
    };
    let again = run(&mut load::<P>(image, settings.slots)?, image.len(), other);
    let same = match way % 4 {
        0 => once.end == End::Cut || again.end == End::Cut || once == again,
        // Collections at other times leave other gaps.
        _ => !once.is_conclusive() || !again.is_conclusive() || once == again,
    };
    assert!(same, "{once:?} in one slice, {again:?} in slices of {}", slices.budget);
    Ok(())
}

/// An allocation fails: a clean fault, after which the machine works as before.
fn fail<P: Profile>(
    image: &[u8],
    settings: &Settings,
    once: &Trace,
    number: u32,
    allocations: u32,
) -> Result<(), ImageError> {
    let Some(fail_at) = number.checked_rem(allocations) else { return Ok(()) };
    let torture = Torture { fail_at: Some(fail_at), ..Torture::default() };
    let mut vm = load::<P>(image, settings.slots)?;
    let trace = run(&mut vm, image.len(), Settings { torture, ..*settings });
    let is_clean = matches!(trace.end, End::Fault(fault) if fault.code == FaultCode::OutOfMemory);
    assert!(is_clean, "allocation {fail_at} of {allocations} fails, and {trace:?}");
    vm.load_limited(Image::new(image), settings.slots, |_| true)?;
    assert_eq!(run(&mut vm, image.len(), *settings), *once, "after an allocation failed");
    Ok(())
}

fn run<P: Profile>(vm: &mut Machine<'_, P>, length: usize, settings: Settings) -> Trace {
    vm.torture = settings.torture;
    vm.set_robot_id(3, 7);
    let mut player = player();
    let mut left = settings.instructions;
    let entries =
        [Entry::Global, Entry::Init, Entry::Step, Entry::Step, Entry::Reset, Entry::Destroy];
    for entry in entries {
        if !vm.begin(entry) {
            continue;
        }
        loop {
            let outcome = vm.run(&mut player, settings.budget);
            if settings.audit && (outcome == Outcome::Done || left.is_multiple_of(16)) {
                assert_eq!(vm.audit(), Ok(()));
            }
            match outcome {
                Outcome::Pending => left = left.saturating_sub(settings.budget.into()),
                Outcome::Waiting => left = left.saturating_sub(settings.budget.min(50).into()),
                Outcome::Done => break,
                Outcome::Fault(fault) => {
                    assert!(vm.calls().count() <= SLOTS, "more calls than memory");
                    assert!(usize::from(fault.position) < length, "{fault:?} is nowhere");
                    assert!(!vm.begin(Entry::Step), "a stopped script runs");
                    return Trace { end: End::Fault(fault), seen: player.events };
                }
            }
            if left == 0 {
                return Trace { end: End::Cut, seen: player.events };
            }
        }
    }
    Trace { end: End::Complete, seen: player.events }
}

/// Answers whatever it is asked.
fn player() -> Recorder {
    let mut player = Recorder::answering(|call| match call.function % 4 {
        0 if call.polls == 0 => Answer::Wait,
        1 => Answer::First,
        2 if call.function.is_multiple_of(64) => {
            Answer::Fault(RobotFault::Refused(Refusal::OutOfRange))
        }
        _ => Answer::Int(i32::from(call.function)),
    });
    player.position = [Some(1.5), None, None, None];
    player
}
