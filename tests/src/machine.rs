//! The virtual machine in this process, under stress, with everything that a script does written down.

use std::fmt::Write;

use bittybuzz_testkit::{Answer, Call, Event, RecordedArgument, Recorder};
use bittybuzz_vm_core::hash::name_hash;
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{
    ByteCode, Entry, Fault, Image, ImageError, Outcome, Refusal, RobotFault, Torture, Type, Vm,
};

/// The entries that a run begins, in this order.
pub const ENTRIES: [Entry; 7] = [
    Entry::Global,
    Entry::Init,
    Entry::Step,
    Entry::Step,
    Entry::Step,
    Entry::Reset,
    Entry::Destroy,
];

/// How to run.
#[derive(Debug, Clone, Copy)]
pub struct Settings {
    /// Slots that the script may use.
    pub slots: usize,
    /// Instructions of one slice.
    pub budget: u16,
    /// What happens to allocations.
    pub torture: Torture,
    /// Whether memory is looked at after every slice.
    pub audit: bool,
    /// Instructions after which a run is given up.
    pub most: u64,
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// Every entry returned.
    Complete,
    /// A run-time error.
    Fault(Fault),
    /// The image does not load.
    Refused(ImageError),
    /// Longer than the settings allow.
    GivenUp,
}

/// What a run did.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Trace {
    /// Everything that the host saw, in order.
    pub output: String,
    /// How it ended.
    pub end: End,
    /// The globals at the end; what they refer to, scripts print themselves.
    pub globals: String,
}

/// Loads an image and runs every entry.
///
/// # Panics
/// If the machine breaks one of its promises, whatever the script does.
pub fn run<'i, P: Profile, const SLOTS: usize>(
    vm: &mut Vm<P, &'i [u8], SLOTS>,
    image: &'i [u8],
    settings: &Settings,
) -> Trace {
    vm.torture = settings.torture;
    if let Err(error) = vm.load_limited(Image::new(image), settings.slots, |_| true) {
        assert!(vm.header().is_none() && vm.calls().next().is_none(), "a refused image is held");
        assert!(ENTRIES.iter().all(|entry| !vm.begin(*entry)), "a refused image begins");
        return Trace { output: String::new(), end: End::Refused(error), globals: String::new() };
    }
    vm.set_robot_id(1, 7);
    let mut recorder = recorder();
    let mut output = String::new();
    let mut left = settings.most;
    let mut run_next = |entry: &Entry| {
        let has = vm.begin(*entry);
        let _ = writeln!(output, "== {entry:?} {}", if has { "" } else { "is missing" });
        let end = has.then(|| run_entry(vm, *entry, settings, &mut recorder, &mut left)).flatten();
        write_events(&mut output, std::mem::take(&mut recorder.events));
        end
    };
    let end = ENTRIES.iter().find_map(&mut run_next).unwrap_or(End::Complete);
    if let End::Fault(fault) = end {
        let size = vm.header().map_or(0, |header| image.len() - usize::from(header.code_at()));
        assert!(usize::from(fault.position) < size, "{fault:?} is not in the code");
        assert!(!vm.begin(Entry::Step), "a script runs after its fault");
        assert_eq!(vm.run(&mut recorder, 1), Outcome::Fault(fault), "a fault is forgotten");
    }
    Trace { output, end, globals: globals(vm) }
}

/// `None` if the run may go on.
fn run_entry<P: Profile, C: ByteCode, const SLOTS: usize>(
    vm: &mut Vm<P, C, SLOTS>,
    entry: Entry,
    settings: &Settings,
    recorder: &mut Recorder,
    left: &mut u64,
) -> Option<End> {
    loop {
        let outcome = vm.run(recorder, settings.budget);
        if settings.audit {
            assert_eq!(vm.audit(), Ok(()), "after {outcome:?} in {entry:?}");
        }
        match outcome {
            Outcome::Done => return None,
            // A slice that ends in waiting may have been a short one.
            Outcome::Waiting => *left = left.saturating_sub(1),
            Outcome::Pending => *left = left.saturating_sub(u64::from(settings.budget)),
            Outcome::Fault(fault) => return Some(End::Fault(fault)),
        }
        if *left == 0 {
            return Some(End::GivenUp);
        }
    }
}

fn globals<P: Profile, C: ByteCode, const SLOTS: usize>(vm: &Vm<P, C, SLOTS>) -> String {
    let mut text = String::new();
    for number in 0.. {
        let Some(value) = vm.global(number) else { return text };
        let kind = value.type_of().name();
        let payload = value.as_f32().map_or(0, f32::to_bits);
        let _ = write!(text, "{number}: {kind} {payload:x} {:?}; ", value.as_string());
    }
    text
}

/// A robot that answers the same on every run. What a script waits for is over after none to three questions.
fn recorder() -> Recorder {
    const LED: u16 = name_hash("led");
    const GO_TO: u16 = name_hash("goto");
    const SET_MOTOR: u16 = name_hash("set_motor");
    let answer = |call: &Call<'_>| match (call.function, call.arguments.first()) {
        (LED, Some(RecordedArgument::Int(_))) => Answer::Nil,
        (LED, other) => {
            Answer::Fault(RobotFault::WrongType(other.map_or(Type::Nil, RecordedArgument::type_of)))
        }
        (SET_MOTOR, _) => Answer::Fault(RobotFault::Refused(Refusal::NotBuiltIn)),
        (GO_TO, _) if call.polls < call.number % 4 => Answer::Wait,
        _ => Answer::Int(call.number as i32),
    };
    let mut recorder = Recorder::answering(answer);
    recorder.delay_polls = Box::new(|ms| ms as u32 % 4);
    recorder.position = [Some(1.5), Some(-2.0), None, Some(90.0)];
    recorder
}

/// Writes a line for each event: its name and its arguments, with spaces between them.
fn write_events(output: &mut String, events: Vec<Event>) {
    for event in events {
        let arguments = match event {
            Event::Call { function, arguments } => {
                let _ = write!(output, "robot {function:x}");
                arguments
            }
            Event::Log(arguments) => {
                output.push_str("log");
                arguments
            }
            Event::Delay(ms) => {
                let _ = write!(output, "delay {ms}");
                Vec::new()
            }
        };
        for argument in arguments {
            let _ = match argument {
                // No byte of it gets lost.
                RecordedArgument::Text(bytes) => write!(output, " '{}'", bytes.escape_ascii()),
                other => write!(output, " {other}"),
            };
        }
        output.push('\n');
    }
}
