//! The virtual machine in this process, under stress, with everything that a script does written down.

use std::fmt::Write;

use bittybuzz_vm_core::link::name_hash;
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{
    Arguments, Axis, ByteCode, Entry, Fault, Host, Image, ImageError, Item, Outcome, Refusal,
    Reply, RobotFault, Torture, Value, Vm,
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
    vm.identify(1, 7);
    let mut recorder = Recorder::default();
    let mut left = settings.most;
    let end = ENTRIES
        .iter()
        .find_map(|entry| run_entry(vm, *entry, settings, &mut recorder, &mut left))
        .unwrap_or(End::Complete);
    if let End::Fault(fault) = end {
        let size = vm.header().map_or(0, |header| image.len() - usize::from(header.code_at()));
        assert!(usize::from(fault.position) < size, "{fault:?} is not in the code");
        assert!(!vm.begin(Entry::Step), "a script runs after its fault");
        assert_eq!(vm.run(&mut recorder, 1), Outcome::Fault(fault), "a fault is forgotten");
    }
    Trace { output: recorder.output, end, globals: globals(vm) }
}

/// `None` if the run may go on.
fn run_entry<P: Profile, C: ByteCode, const SLOTS: usize>(
    vm: &mut Vm<P, C, SLOTS>,
    entry: Entry,
    settings: &Settings,
    recorder: &mut Recorder,
    left: &mut u64,
) -> Option<End> {
    let has = vm.begin(entry);
    recorder.line(format_args!("== {entry:?} {}", if has { "" } else { "is missing" }));
    if !has {
        return None;
    }
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

/// Writes down what a script asks for, and answers the same on every run.
#[derive(Debug, Default)]
struct Recorder {
    output: String,
    /// How often the pending robot function or delay was asked.
    polls: u32,
    calls: u32,
}

impl Recorder {
    fn line(&mut self, text: std::fmt::Arguments<'_>) {
        let _ = self.output.write_fmt(text);
        self.output.push('\n');
    }

    fn items<P: Profile, C: ByteCode, const SLOTS: usize>(
        &mut self,
        arguments: &Arguments<'_, P, C, SLOTS>,
    ) {
        for index in 0..arguments.count() {
            self.output.push(' ');
            let _ = match arguments.item(index) {
                Item::Nil => write!(self.output, "nil"),
                Item::Int(value) => write!(self.output, "{value}"),
                Item::Float(value) => write!(self.output, "{value:?}f"),
                Item::String(text) => match text.number() {
                    Some(number) => write!(self.output, "string {number}"),
                    None => {
                        let bytes: Vec<u8> = text.bytes().collect();
                        write!(self.output, "'{}'", bytes.escape_ascii())
                    }
                },
                Item::Table(size) => write!(self.output, "table of {size}"),
                Item::Function => write!(self.output, "function"),
            };
        }
        self.output.push('\n');
    }

    /// Whether what is pending is over: after one to three questions.
    fn is_over(&mut self, again: bool, asked: u32) -> bool {
        self.polls = if again { self.polls + 1 } else { 0 };
        self.polls >= asked % 4
    }
}

impl<P: Profile> Host<P> for Recorder {
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: Arguments<'_, P, C, SLOTS>,
        again: bool,
    ) -> Result<Reply<P>, RobotFault> {
        const LED: u16 = name_hash("led");
        const GO_TO: u16 = name_hash("goto");
        const SET_MOTOR: u16 = name_hash("set_motor");
        if !again {
            self.calls += 1;
            let _ = write!(self.output, "robot {function:x}");
            self.items(&arguments);
        }
        Ok(match function {
            LED => match arguments.item(0) {
                Item::Int(_) => Reply::Value(Value::nil()),
                _ => return Err(RobotFault::WrongType(arguments.value(0).type_of())),
            },
            SET_MOTOR => return Err(RobotFault::Refused(Refusal::NotBuiltIn)),
            GO_TO if !self.is_over(again, self.calls) => Reply::Wait,
            _ => Reply::Value(Value::int(self.calls as i32)),
        })
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, arguments: Arguments<'_, P, C, SLOTS>) {
        self.output.push_str("log");
        self.items(&arguments);
    }

    fn delay_is_over(&mut self, ms: i32, again: bool) -> bool {
        if !again {
            self.line(format_args!("delay {ms}"));
        }
        self.is_over(again, ms as u32)
    }

    fn position(&mut self, axis: Axis) -> Option<f32> {
        match axis {
            Axis::X => Some(1.5),
            Axis::Y => Some(-2.0),
            Axis::Z => None,
            Axis::Orientation => Some(90.0),
        }
    }
}
