//! The answers of a machine to questions.

use std::mem;

use bittybuzz_compiler::refusal;
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{ByteCode, Outcome, Vm};

use crate::engine::Io;
use crate::robot::checks::TextMeter;
use crate::robot::context::KeptImage;
use crate::robot::platform::Platform;
use crate::robot::question::{Answer, Question};
use crate::robot::queue::{InQueue, OutQueue};
use crate::robot::state::{RobotContext, ScriptStage};

use super::{Scripted, load_program};

impl<P: Profile, C, I, O, const SLOTS: usize> Scripted<P, C, I, O, SLOTS>
where
    C: ByteCode + From<KeptImage> + 'static,
    I: InQueue + Clone + 'static,
    O: OutQueue + Clone + 'static,
    Self: Send,
{
    /// Answers all questions, unless a part of the script runs that has to end before.
    #[cold] // Most runs have no questions.
    pub(super) fn answer(&mut self, state: &mut RobotContext, io: &mut Io<'_>) {
        let is_faulted = state.is_faulted();
        if !is_faulted && (state.is_running || state.stage != ScriptStage::Step) {
            return;
        }
        for question in mem::take(&mut state.questions) {
            let answer = match is_faulted {
                true => Answer::Stopped,
                false => self.evaluate(&question, state, io),
            };
            state.log(answer.line(&question.text, io.now, question.context.program));
        }
    }

    /// Evaluates a question, within the instructions of a step.
    fn evaluate(
        &mut self,
        question: &Question,
        state: &mut RobotContext,
        io: &mut Io<'_>,
    ) -> Answer {
        let Question { context, .. } = question;
        let mut extended: Box<Vm<P, C, SLOTS>> = Box::new(Vm::new());
        if let Err(cause) = load_program(&mut extended, context) {
            return Answer::Refused(format!(
                "the program with the question {}",
                refusal::sentence(&cause)
            ));
        }
        let own = mem::replace(&mut state.context, context.clone());
        state.memory.program = context.program;
        state.asked = Some(Vec::new());
        let budget = context.budget;
        let Scripted { vm, inbox, outbox, has_mail, has_unsent } = self;
        let mut platform = Platform { io, state, inbox, outbox, has_mail, has_unsent };
        let outcome = vm.call_added(&extended, &mut TextMeter::new(&mut platform), budget);
        let Platform { io, state, .. } = platform;
        let mut lines = state.asked.take().unwrap_or_default();
        let answer = match outcome {
            // The last line is the answer.
            Some(Outcome::Done) => {
                Answer::Value(lines.pop().map_or_else(Vec::new, |line| line.pieces))
            }
            Some(Outcome::Fault(fault)) => {
                let record = state.record(io.now, fault, vec![fault.position], None);
                state.add_fault(record, None);
                Answer::Fault
            }
            Some(Outcome::Waiting) => Answer::Waits,
            Some(Outcome::Pending) => Answer::Endless(budget),
            None => {
                Answer::Refused("the program with the question does not fit the script".to_owned())
            }
        };
        lines.into_iter().for_each(|line| state.log(line));
        // The machine keeps the longer program if it may have values that only this one names.
        if vm.header() != extended.header() {
            state.context = own;
        }
        state.memory.program = state.context.program;
        answer
    }
}
