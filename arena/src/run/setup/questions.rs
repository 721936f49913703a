//! The programs with questions at their ends.

use std::sync::Arc;

use bittybuzz_compiler::compile::Options;
use bittybuzz_compiler::question::{self, QuestionError};
use bittybuzz_vm_core::image::ImageHeader;
use bittybuzz_vm_core::{Image, ImageError};

use crate::robot::ProgramId;
use crate::run::asked::AskedProgram;
use crate::run::program::{LoadedProgram, Program};
use crate::scenario::{Group, Scenario, ScenarioCause, Selection, each_group_of};

use super::{ASKED, Setup, joining_ids, new_context};

impl Setup {
    /// Returns the number of the program `base` with a question at its end.
    pub(in crate::run) fn asked(
        &self,
        base: ProgramId,
        question: &str,
    ) -> Result<ProgramId, QuestionError> {
        let before = base.asked_place().map(|place| self.asked.get(place).expect(ASKED));
        let script = before.map_or(base, |before| before.script);
        let LoadedProgram { program, group, context, .. } = self.loaded(script);
        // A run that began again may have loaded another script, which then has the number of the first.
        let known = self.asked.find(|asked| {
            let is_last = asked.questions.last().is_some_and(|last| last == question);
            asked.base == base && is_last && asked.loaded.context.extends(context)
        });
        if let Some(known) = known {
            return Ok(known);
        }
        let before = before.map_or(&[][..], |before| &before.questions);
        let questions = [before, &[question.to_owned()]].concat();
        let of = self.scenario.group(*group);
        let program = questioned(of, program, &questions)?;
        let is_kept = match (header(&program), header(&self.loaded(base).program)) {
            (Ok(header), Ok(known)) => header.names_more_than(&known),
            _ => false,
        };
        Ok(self.asked.add(|number| {
            let extended = new_context(of, (number, &program), joining_ids(&self.scenario));
            let context = Arc::new(extended.extending(context));
            let loaded = LoadedProgram { program, group: *group, script: None, context };
            AskedProgram { base, script, questions, is_kept, loaded }
        }))
    }

    /// Returns true if a robot keeps the program of a question after the answer.
    pub(in crate::run) fn is_kept(&self, asked: ProgramId) -> bool {
        let asked = asked.asked_place().and_then(|place| self.asked.get(place));
        asked.is_some_and(|asked| asked.is_kept)
    }
}

fn header(program: &Program) -> Result<ImageHeader, ImageError> {
    Image::new(&*program.image).header()
}

/// Returns the program of a group's robots with questions at its end.
fn questioned(
    group: &Group,
    Program { image, sources, .. }: &Program,
    questions: &[String],
) -> Result<Program, QuestionError> {
    let options = Options {
        robot: Some((*group.robot).clone()),
        robots: group.robots_of_scenario.to_vec(),
        profile: None,
        outside: (*group.outside).clone(),
    };
    let questions: Vec<&str> = questions.iter().map(String::as_str).collect();
    let extended = question::extend(sources, image, &options, &questions)?;
    let (symbols, sources) = (Some(extended.symbols), Arc::new(extended.sources));
    Ok(Program::new(extended.image, symbols, sources))
}

/// Fails if a question is a mistake in all programs of some of these robots.
pub fn check_question(
    scenario: &Scenario,
    programs: &[LoadedProgram],
    robots: &Selection,
    question: &str,
) -> Result<(), ScenarioCause> {
    for group in each_group_of(&scenario.groups, robots) {
        let of = scenario.group(group);
        let own = programs.iter().filter(|loaded| loaded.group == group);
        let mut tried = own.map(|loaded| {
            questioned(of, &loaded.program, std::slice::from_ref(&question.to_owned()))
        });
        let Some(Err(error)) = tried.next() else { continue };
        if !tried.any(|tried| tried.is_ok()) {
            return Err(ScenarioCause::Question { error });
        }
    }
    Ok(())
}
