//! This computer in the role of a robot, as `bbz run --steps` has it: robot functions and `log`
//! append lines to a text, and delays take no time.

use bittybuzz_arena::robot::{LoneCall, LoneRobot};
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_robot_spec::Robot;
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{Axis, ByteCode, CallArguments, Calls, Fault, Host, Reply, RobotFault};

/// The host of a script, which stands for all robots that the script may run on.
pub struct TextHost<'a> {
    robot: LoneRobot<'a>,
    /// Calls and log lines, each with a line feed.
    pub text: Vec<u8>,
    /// The reason why the last robot function refused its arguments.
    pub refusal: Option<String>,
}

impl<'a> TextHost<'a> {
    pub fn new(robots: &'a [Robot], symbols: &'a Symbols) -> Self {
        // The symbols have all strings of a program that was compiled just now.
        let robot = LoneRobot::new(robots.iter(), Some(symbols), false);
        TextHost { robot, text: Vec::new(), refusal: None }
    }

    fn add_line(&mut self, mut line: Vec<u8>) {
        self.text.append(&mut line);
        self.text.push(b'\n');
    }
}

impl<P: Profile> Host<P> for TextHost<'_> {
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: CallArguments<'_, P, C, SLOTS>,
        _again: bool,
    ) -> Result<Reply<P>, RobotFault> {
        match self.robot.call(function, &arguments) {
            Ok(LoneCall { line, reply }) => {
                line.into_iter().for_each(|line| self.add_line(line));
                Ok(reply)
            }
            Err(refusal) => {
                self.refusal = Some(refusal.accepted);
                Err(refusal.fault)
            }
        }
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, arguments: CallArguments<'_, P, C, SLOTS>) {
        self.add_line(self.robot.log_line(&arguments));
    }

    fn delay_is_over(&mut self, _ms: i32, _again: bool) -> bool {
        true
    }

    fn position(&mut self, axis: Axis) -> Option<f32> {
        self.robot.position(axis)
    }

    /// Ends the run, as with any other fault. No listener runs here, because no frame arrives.
    fn contain<C: ByteCode, const SLOTS: usize>(
        &mut self,
        _fault: &Fault,
        _calls: Calls<'_, P, C, SLOTS>,
    ) -> bool {
        false
    }
}
