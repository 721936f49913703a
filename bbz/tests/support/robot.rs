//! A robot that runs an image and reports as firmware does. The machine and the records are those
//! of the firmware; the rest of the firmware is missing. The records are encoded from the machine's
//! own arguments, which the recorder of `bittybuzz-testkit` does not keep.

use bittybuzz_comms::trace;
use bittybuzz_vm_core::number::{Full, Profile};
use bittybuzz_vm_core::{
    Axis, ByteCode, CallArguments, Entry, Host, Image, Outcome, Refusal, Reply, RobotFault, Value,
    Vm,
};

/// Slots of the Crazyflie's machine.
const SLOTS: usize = 640;

pub const ID: u16 = 7;

struct Robot {
    records: Vec<Vec<u8>>,
    step: u32,
}

impl<P: Profile> Host<P> for Robot {
    /// Every function returns nil; `led` requires one argument or two.
    fn call<C: ByteCode, const N: usize>(
        &mut self,
        function: u16,
        arguments: CallArguments<'_, P, C, N>,
        _again: bool,
    ) -> Result<Reply<P>, RobotFault> {
        let is_led = function == bittybuzz_vm_core::hash::name_hash("led");
        if is_led && !(1..=2).contains(&arguments.count()) {
            return Err(RobotFault::Refused(Refusal::ArgumentCount));
        }
        Ok(Reply::Value(Value::nil()))
    }

    fn log<C: ByteCode, const N: usize>(&mut self, arguments: CallArguments<'_, P, C, N>) {
        self.records.push(trace::log(self.step, &arguments).to_vec());
    }

    fn delay_is_over(&mut self, _ms: i32, _again: bool) -> bool {
        true
    }

    fn position(&mut self, _axis: Axis) -> Option<f32> {
        Some(0.0)
    }
}

/// Returns the records of a run: the start, then those of the global code, `init` and `steps`
/// steps.
pub fn records(image: &[u8], steps: u32) -> Vec<Vec<u8>> {
    let mut robot = Robot { records: Vec::new(), step: 0 };
    let mut vm: Box<Vm<Full, &[u8], SLOTS>> = Box::new(Vm::new());
    vm.set_robot_id(ID, 0);
    if let Err(error) = vm.load(Image::new(image), |_| true) {
        return vec![trace::refused(error).to_vec()];
    }
    let hash = Image::new(image).header().unwrap().hash();
    robot.records.push(trace::start(ID, hash).to_vec());
    let entries = [Entry::Global, Entry::Init].into_iter();
    for (count, entry) in entries.chain((0..steps).map(|_| Entry::Step)).enumerate() {
        robot.step = u32::try_from(count).unwrap().saturating_sub(2);
        if !vm.begin(entry) {
            continue;
        }
        loop {
            match vm.run(&mut robot, u16::MAX) {
                Outcome::Done => break,
                Outcome::Pending | Outcome::Waiting => {}
                Outcome::Fault(fault) => {
                    let record = trace::fault(robot.step, &fault, vm.calls());
                    robot.records.push(record.to_vec());
                    return robot.records;
                }
            }
        }
    }
    robot.records
}

/// Formats records as probe-rs prints them, a second apart.
pub fn lines(records: &[Vec<u8>]) -> String {
    let lines = records.iter().enumerate();
    lines.map(|(second, record)| format!("{second}.000000 INFO  bbz {record:?}\n")).collect()
}
