//! Running images.

use bittybuzz_vm_core::number::{Number, Profile};
use bittybuzz_vm_core::{ByteCode, Entry, Fault, Image, Outcome, Vm};

use crate::ROBOT_ID;
use crate::batch::{Batch, Header};
use crate::recorder::{Event, Recorder};
use crate::report::{End, Report};

/// What `rand` begins with.
const SEED: u32 = 7;
/// How often `step` is called.
const STEPS: u8 = 3;

/// Runs every image of a batch, and tells what it did.
pub fn run_batch<P: Profile, B: Batch, const SLOTS: usize>(
    vm: &mut Vm<P, B::Code, SLOTS>,
    batch: &B,
    mut tell: impl FnMut(&Report),
) {
    let mut at = 0;
    while let Some((header, image)) = batch.image(at) {
        tell(&run(vm, image, header));
        at += Header::LENGTH + usize::from(header.length);
    }
}

/// Runs every entry of an image.
#[inline(never)]
pub fn run<P: Profile, C: ByteCode, const SLOTS: usize>(
    vm: &mut Vm<P, C, SLOTS>,
    image: C,
    header: Header,
) -> Report {
    let mut run = Run { header, slices: 0, recorder: Recorder::default() };
    let end = match vm.load(Image::new(image), |_| true) {
        Err(error) => {
            let (cause, value) = error.to_code();
            run.recorder.event(Event::End, u32::from(cause) << 16 | u32::from(value));
            End::Refused(error)
        }
        Ok(()) => {
            vm.set_robot_id(ROBOT_ID, SEED);
            run.entries(vm)
        }
    };
    Report { hash: run.recorder.trace.hash(), slices: run.slices, end }
}

struct Run {
    header: Header,
    slices: u32,
    recorder: Recorder,
}

impl Run {
    fn entries<P: Profile, C: ByteCode, const SLOTS: usize>(
        &mut self,
        vm: &mut Vm<P, C, SLOTS>,
    ) -> End {
        for number in 0..4 + STEPS {
            // Not an array, which the AVR would keep in RAM.
            let entry = match number {
                0 => Entry::Global,
                1 => Entry::Init,
                _ if number < 2 + STEPS => Entry::Step,
                _ if number == 2 + STEPS => Entry::Reset,
                _ => Entry::Destroy,
            };
            let end = self.entry(vm, entry);
            self.globals(vm);
            if let Some(end) = end {
                return end;
            }
        }
        End::Complete
    }

    /// `None` if the next may follow.
    fn entry<P: Profile, C: ByteCode, const SLOTS: usize>(
        &mut self,
        vm: &mut Vm<P, C, SLOTS>,
        entry: Entry,
    ) -> Option<End> {
        if !vm.begin(entry) {
            self.recorder.event(Event::NoEntry, entry as u32);
            return None;
        }
        self.recorder.event(Event::Entry, entry as u32);
        loop {
            if self.slices == self.header.slices {
                return Some(End::GivenUp);
            }
            self.slices += 1;
            let outcome = vm.run(&mut self.recorder, self.header.budget);
            self.slice(vm, outcome);
            match outcome {
                Outcome::Done => return None,
                Outcome::Pending | Outcome::Waiting => {}
                Outcome::Fault(fault) => {
                    self.fault(fault);
                    return Some(End::Fault(fault));
                }
            }
        }
    }

    fn slice<P: Profile, C: ByteCode, const SLOTS: usize>(
        &mut self,
        vm: &Vm<P, C, SLOTS>,
        outcome: Outcome,
    ) {
        let kind = match outcome {
            Outcome::Pending => 0,
            Outcome::Waiting => 1,
            Outcome::Done => 2,
            Outcome::Fault(_) => 3,
        };
        self.recorder.event(Event::Slice, kind);
        if outcome != Outcome::Done {
            for position in vm.calls() {
                self.recorder.trace.add(u32::from(position));
            }
        }
    }

    fn fault(&mut self, Fault { code, position, operands, detail }: Fault) {
        self.recorder.event(Event::End, code as u32);
        let [first, second] = operands;
        for word in [u32::from(position), first as u32, second as u32, u32::from(detail)] {
            self.recorder.trace.add(word);
        }
    }

    /// Their types, and the content of those that are no tables or functions.
    fn globals<P: Profile, C: ByteCode, const SLOTS: usize>(&mut self, vm: &Vm<P, C, SLOTS>) {
        let mut number = 0;
        while let Some(value) = vm.global(number) {
            self.recorder.event(Event::Global, value.type_of() as u32);
            self.recorder.trace.add(match value.as_number() {
                Some(Number::Int(integer)) => integer as u32,
                Some(Number::Float(float)) => float.to_bits(),
                None => value.as_string().map_or(0, u32::from),
            });
            number += 1;
        }
    }
}
