//! Loads an image and runs it within bounds.

use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{
    Arguments, Axis, ByteCode, Entry, Host, Image, ImageError, Item, Outcome, Reply, RobotFault,
    Value, Vm,
};

/// Enough for most scripts, and quickly filled.
const SLOTS: usize = 700;
/// Instructions that all entries together get.
const INSTRUCTIONS: u32 = 4000;

/// Runs an image in the profile that it names.
pub fn run_both(image: &[u8]) -> Result<(), ImageError> {
    match run::<Full>(image) {
        Err(ImageError::Profile) => run::<Tiny>(image),
        result => result,
    }
}

fn run<P: Profile>(image: &[u8]) -> Result<(), ImageError> {
    let mut vm: Box<Vm<P, &[u8], SLOTS>> = Box::new(Vm::new(3));
    // Any robot function is known, so that calls of them are reached.
    if let Err(error) = vm.load(Image::new(image), |_| true) {
        assert!(!vm.begin(Entry::Global), "a refused image runs");
        return Err(error);
    }
    let mut left = INSTRUCTIONS;
    let mut host = Player { looks: 0 };
    let entries = [Entry::Global, Entry::Init, Entry::Step, Entry::Step, Entry::Destroy];
    for (number, entry) in entries.into_iter().enumerate() {
        if !vm.begin(entry) {
            continue;
        }
        // A slice of one instruction and one of many take the same way.
        let budget = [1, 7, 1000][number % 3];
        loop {
            if left == 0 {
                return Ok(());
            }
            left = left.saturating_sub(u32::from(budget));
            match vm.run(&mut host, budget) {
                Outcome::Pending | Outcome::Waiting => {}
                Outcome::Done => break,
                Outcome::Fault(_) => {
                    assert!(vm.calls().count() <= SLOTS, "more calls than memory");
                    assert!(!vm.begin(Entry::Step), "a stopped script runs");
                    return Ok(());
                }
            }
        }
    }
    Ok(())
}

/// Answers whatever it is asked, and looks at every argument.
struct Player {
    looks: usize,
}

impl Player {
    fn look<P: Profile, C: ByteCode, const N: usize>(
        &mut self,
        arguments: &Arguments<'_, P, C, N>,
    ) {
        for index in 0..arguments.count() {
            self.looks += match arguments.item(index) {
                Item::String(text) => text.bytes().count(),
                Item::Table(size) => size,
                _ => 1,
            };
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
        self.look(&arguments);
        match function % 4 {
            0 if !again => Ok(Reply::Wait),
            1 => Ok(Reply::Value(arguments.value(0))),
            2 if function.is_multiple_of(64) => Err(RobotFault::Refused(function)),
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
