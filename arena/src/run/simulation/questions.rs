//! Questions to robots.

use std::sync::Arc;

use bittybuzz_compiler::question::QuestionError;

use crate::engine::RobotState;
use crate::robot::{Answer, ProgramId, Question};
use crate::scenario::{ScenarioCause, Selection};

use super::{JOINED, Simulation};

impl Simulation {
    /// Returns true if a question is asked in the next tick.
    pub fn has_waiting_questions(&self) -> bool {
        self.event_queue.has_waiting_questions(self.now())
    }

    /// Fails if a question is a mistake in the present program of one of these robots.
    pub(super) fn check_question(
        &self,
        robots: &Selection,
        question: &str,
    ) -> Result<(), ScenarioCause> {
        let mut known: Vec<ProgramId> =
            robots.iter().map(|robot| self.program_now(robot)).collect();
        known.sort_unstable();
        known.dedup();
        for program in known {
            let asked = self.setup.asked(program, question);
            asked.map_err(|error| ScenarioCause::Question { error })?;
        }
        Ok(())
    }

    /// Returns the program that a robot runs when it gets to the next question, with the questions that it
    /// keeps, or that it will run when it joins.
    fn program_now(&self, number: usize) -> ProgramId {
        let Some(robot) = self.robot(number) else { return self.event_queue.program(number) };
        let waiting = robot.state().questions.iter().rev();
        let mut waiting = waiting.map(|question| question.context.program);
        let kept = waiting.find(|asked| self.setup.is_kept(*asked));
        kept.unwrap_or(robot.state().context.program)
    }

    /// Asks robots. One that has not joined is left out, and one that cannot answer logs the reason.
    pub(super) fn ask(&mut self, robots: &Selection, question: &str) {
        let (now, text) = (self.now(), Arc::<str>::from(question));
        // Many robots run one program.
        let mut last: Option<(ProgramId, Result<ProgramId, QuestionError>)> = None;
        for number in robots.iter() {
            let Some(id) = self.event_queue.id(number) else { continue };
            let base = self.program_now(number);
            if last.as_ref().is_none_or(|(program, _)| *program != base) {
                last = Some((base, self.setup.asked(base, question)));
            }
            let Some((_, asked)) = &last else { continue };
            let state = self.world.robot(id).map(|view| view.state);
            let brain = self.world.brain_mut(id).expect(JOINED);
            let reason = match (asked, state) {
                (Ok(asked), Some(RobotState::Running)) => {
                    let context = self.setup.loaded(*asked).context.clone();
                    brain.ask(Question { text: text.clone(), context });
                    continue;
                }
                (Ok(_), Some(RobotState::Stopped)) => "the robot is stopped".to_owned(),
                (Ok(_), _) => "the robot has failed".to_owned(),
                (Err(error), _) => error.to_string(),
            };
            brain.answer(question, now, Answer::Refused(reason));
        }
    }
}
