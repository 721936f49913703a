//! Loads an image and runs it within bounds.

use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{
    Arguments, Axis, ByteCode, Entry, Fault, Host, Image, ImageError, Item, Outcome, Refusal,
    Reply, RobotFault, Value, Vm,
};

/// The most slots that a run gets.
const SLOTS: usize = 1044;
/// Instructions that all entries together get.
const INSTRUCTIONS: u32 = 4000;

/// How to run. The script hash decides, as nothing else depends on it, and the fuzzer can change it.
#[derive(Clone, Copy)]
struct Settings {
    slots: usize,
    budget: u16,
    instructions: u32,
    #[cfg(feature = "torture")]
    torture: bittybuzz_vm_core::Torture,
    /// Whether to look at memory on the way.
    audit: bool,
}

/// How a run ended, and what the host saw.
#[derive(Debug, PartialEq, Eq)]
struct Trace {
    end: End,
    seen: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    Complete,
    Fault(Fault),
    /// It would go on.
    Cut,
}

/// Runs an image in the profile that it names.
pub fn run_both(image: &[u8]) -> Result<(), ImageError> {
    match run_twice::<Full>(image) {
        Err(ImageError::Profile) => run_twice::<Tiny>(image),
        result => result,
    }
}

/// Runs an image in large and in small slices, which makes no difference, and at times looks at its memory.
fn run_twice<P: Profile>(image: &[u8]) -> Result<(), ImageError> {
    let byte = |at: usize| image.get(at).copied().unwrap_or(0);
    let settings = Settings {
        slots: 24 + 4 * usize::from(byte(3)),
        budget: 1000,
        instructions: INSTRUCTIONS,
        #[cfg(feature = "torture")]
        torture: bittybuzz_vm_core::Torture {
            collect_always: byte(4) & 1 != 0,
            fail_at: (byte(4) & 6 == 6).then_some(byte(5).into()),
            allocations: 0,
        },
        audit: false,
    };
    let once = run::<P>(image, settings)?;
    let budget = 1 + u16::from(byte(6) % 8);
    let again = run::<P>(image, Settings { budget, instructions: 4 * INSTRUCTIONS, ..settings })?;
    if once.end != End::Cut && again.end != End::Cut {
        assert_eq!(once, again, "a slice of {budget} instructions makes a difference");
    }
    if byte(4) & 8 != 0 {
        run::<P>(image, Settings { budget, audit: true, ..settings })?;
    }
    Ok(())
}

fn run<P: Profile>(image: &[u8], settings: Settings) -> Result<Trace, ImageError> {
    let mut vm: Box<Vm<P, &[u8], SLOTS>> = Box::new(Vm::new(3));
    #[cfg(feature = "torture")]
    {
        vm.torture = settings.torture;
    }
    // Any robot function is known, so that calls of them are reached.
    if let Err(error) = vm.load_limited(Image::new(image), settings.slots, |_| true) {
        assert!(vm.header().is_none() && !vm.begin(Entry::Global), "a refused image runs");
        return Err(error);
    }
    let mut player = Player { seen: 0xcbf2_9ce4_8422_2325 };
    let mut left = settings.instructions;
    let entries =
        [Entry::Global, Entry::Init, Entry::Step, Entry::Step, Entry::Reset, Entry::Destroy];
    for entry in entries {
        if !vm.begin(entry) {
            continue;
        }
        loop {
            left = left.saturating_sub(settings.budget.into());
            if left == 0 {
                return Ok(Trace { end: End::Cut, seen: player.seen });
            }
            let outcome = vm.run(&mut player, settings.budget);
            audit(&mut vm, settings.audit && (outcome == Outcome::Done || left.is_multiple_of(16)));
            match outcome {
                Outcome::Pending | Outcome::Waiting => {}
                Outcome::Done => break,
                Outcome::Fault(fault) => {
                    assert!(vm.calls().count() <= SLOTS, "more calls than memory");
                    assert!(usize::from(fault.position) < image.len(), "{fault:?} is nowhere");
                    assert!(!vm.begin(Entry::Step), "a stopped script runs");
                    return Ok(Trace { end: End::Fault(fault), seen: player.seen });
                }
            }
        }
    }
    Ok(Trace { end: End::Complete, seen: player.seen })
}

#[cfg(feature = "torture")]
fn audit<P: Profile>(vm: &mut Vm<P, &[u8], SLOTS>, wanted: bool) {
    if wanted {
        assert_eq!(vm.audit(), Ok(()));
    }
}

#[cfg(not(feature = "torture"))]
fn audit<P: Profile>(_: &mut Vm<P, &[u8], SLOTS>, _: bool) {}

/// Answers whatever it is asked, and looks at every argument.
struct Player {
    /// A hash of everything that was to be seen.
    seen: u64,
}

impl Player {
    fn see(&mut self, what: u64) {
        self.seen = (self.seen ^ what).wrapping_mul(0x100_0000_01b3);
    }

    fn look<P: Profile, C: ByteCode, const N: usize>(
        &mut self,
        arguments: &Arguments<'_, P, C, N>,
    ) {
        for index in 0..arguments.count() {
            match arguments.item(index) {
                Item::Nil => self.see(1),
                Item::Int(value) => self.see(value as u64),
                Item::Float(value) => self.see(value.to_bits().into()),
                Item::String(text) => text.bytes().for_each(|byte| self.see(byte.into())),
                Item::Table(size) => self.see(size as u64),
                Item::Function => self.see(2),
            }
        }
    }
}

impl<P: Profile> Host<P> for Player {
    fn call<C: ByteCode, const N: usize>(
        &mut self,
        function: u16,
        arguments: Arguments<'_, P, C, N>,
        again: bool,
    ) -> Result<Reply<P>, RobotFault> {
        self.see(function.into());
        self.look(&arguments);
        match function % 4 {
            0 if !again => Ok(Reply::Wait),
            1 => Ok(Reply::Value(arguments.value(0))),
            2 if function.is_multiple_of(64) => Err(RobotFault::Refused(Refusal::OutOfRange)),
            _ => Ok(Reply::Value(Value::int(i32::from(function)))),
        }
    }

    fn log<C: ByteCode, const N: usize>(&mut self, arguments: Arguments<'_, P, C, N>) {
        self.look(&arguments);
    }

    fn delay_is_over(&mut self, _: i32, again: bool) -> bool {
        again
    }

    fn position(&mut self, axis: Axis) -> Option<f32> {
        (axis == Axis::X).then_some(1.5)
    }
}
