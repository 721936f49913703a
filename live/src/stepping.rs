//! Statements of a robot's script while the world waits: the debugger's view of a tick.
//!
//! The position is the tick of the run and the number of a statement in the tick that follows. The
//! run is never in half a tick: a copy of it simulates that tick with a watch on the robot.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use bittybuzz_arena::robot::checks::{WatchStop, WatchedStatement};
use bittybuzz_arena::run::{Program, Setup, Simulation};
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_inspect::{Inspection, Limits};
use serde::Deserialize;

use crate::edit;
use crate::workshop::Drafts;

/// The end of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum StepTo {
    /// The first statement of the tick, or of a later tick if it has none.
    First,
    /// The next statement, also in a function that this one calls.
    Next,
    /// The next statement of the same function, or of a caller.
    Over,
    /// The next statement of a caller.
    Out,
    /// The statement before.
    Back,
    /// The last statement of the tick, or of an earlier tick if it has none.
    Last,
    /// The statement with this number in the tick.
    At(usize),
}

impl StepTo {
    /// Returns true if a step that finds no such statement in the tick goes to an earlier tick.
    pub fn is_backward(self) -> bool {
        matches!(self, StepTo::Back | StepTo::Last)
    }
}

/// The statement before which a robot's script is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct StepPosition {
    /// The tick of the run.
    pub tick: u64,
    pub robot: usize,
    /// The number of the statement in the tick that follows.
    pub number: usize,
}

/// The statements that a robot begins in a tick.
pub struct WatchedRobot {
    pub statements: Vec<WatchedStatement>,
    /// The machine before the statement that was asked for.
    pub content: Option<Arc<Inspection>>,
    /// The program that the robot runs in this tick: a command may load another one.
    pub program: Program,
    pub setup: Arc<Setup>,
}

/// Simulates the next tick in a copy of the run, and returns the statements that these robots begin
/// in it. Returns `None` if robots run in emulators, whose state cannot be copied.
pub fn watch(
    run: &Simulation,
    robots: impl Iterator<Item = usize> + Clone,
    at: Option<(usize, Limits)>,
) -> Option<Vec<(usize, WatchedRobot)>> {
    let mut copy = run.snapshot()?;
    for robot in robots.clone() {
        let stop =
            at.map_or(WatchStop::Never, |(number, limits)| WatchStop::Number(number, limits));
        copy.watch_statements(robot, stop);
    }
    // Only emulators can fail, and a run with emulators has no copy.
    copy.tick().ok()?;
    let watched = robots.map(|robot| {
        let tick = copy.take_statements(robot).unwrap_or_default();
        let (program, setup) = (copy.program(robot).clone(), copy.setup().clone());
        let (statements, content) = (tick.statements, tick.content);
        (robot, WatchedRobot { statements, content, program, setup })
    });
    Some(watched.collect())
}

/// Returns the number of the statement at which a step ends; `None` if it leaves the tick. `at` is
/// `None` before the first statement.
pub fn target(statements: &[WatchedStatement], at: Option<usize>, to: StepTo) -> Option<usize> {
    let last = statements.len().checked_sub(1)?;
    let Some(at) = at.filter(|at| *at <= last) else {
        return match to {
            StepTo::Back => None,
            StepTo::Last => Some(last),
            StepTo::First | StepTo::Next | StepTo::Over | StepTo::Out => Some(0),
            StepTo::At(number) => (number <= last).then_some(number),
        };
    };
    let depth = statements[at].depth;
    let later = |ends: &dyn Fn(usize) -> bool| {
        (at + 1..=last).find(|number| ends(statements[*number].depth))
    };
    match to {
        StepTo::First => Some(0),
        StepTo::Next => later(&|_| true),
        StepTo::Over => later(&|now| now <= depth),
        StepTo::Out => later(&|now| now < depth),
        StepTo::Back => at.checked_sub(1),
        StepTo::Last => Some(last),
        StepTo::At(number) => (number <= last).then_some(number),
    }
}

/// The lines of scripts before which the run pauses.
#[derive(Debug, Clone, Default)]
pub struct Breakpoints {
    /// The lines of each script, which all have statements.
    lines: BTreeMap<String, BTreeSet<u32>>,
    /// The only robot for which the run pauses; `None` stands for all.
    robot: Option<usize>,
    /// The tick from which the run goes on without a pause: it has paused there already.
    pub passed: Option<u64>,
}

impl Breakpoints {
    /// Returns breakpoints at these lines, or at the next lines with statements, and these lines. A
    /// line is `None` if no statement follows.
    pub fn new(
        drafts: &Drafts,
        setup: &Setup,
        wanted: &BTreeMap<String, BTreeSet<u32>>,
        robot: Option<usize>,
    ) -> (Breakpoints, Vec<(String, u32, Option<u32>)>) {
        let mut known: BTreeMap<String, BTreeSet<u32>> = BTreeMap::new();
        for symbols in setup.programs().filter_map(|program| program.symbols.as_deref()) {
            let names = names(drafts, setup, symbols);
            for statement in &symbols.statements {
                if let Some(Some(name)) = names.get(statement.place.file as usize) {
                    known.entry(name.clone()).or_default().insert(statement.place.line);
                }
            }
        }
        let (mut lines, mut found) = (BTreeMap::<String, BTreeSet<u32>>::new(), Vec::new());
        for (script, wanted) in wanted {
            for line in wanted {
                let all = known.get(script);
                let at = all.and_then(|all| all.range(line..).next().copied());
                if let Some(at) = at {
                    lines.entry(script.clone()).or_default().insert(at);
                }
                found.push((script.clone(), *line, at));
            }
        }
        (Breakpoints { lines, robot, passed: None }, found)
    }

    /// Returns true if there are none.
    pub fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// Returns the robots of which the script has a breakpoint.
    pub fn robots(&self, drafts: &Drafts, run: &Simulation) -> Vec<usize> {
        let mut positions = KnownPositions::new(self, drafts, run.setup());
        let all = 0..run.robot_count();
        let all = all.filter(|robot| self.robot.is_none_or(|only| only == *robot));
        all.filter(|robot| !positions.of(run.program(*robot)).is_empty()).collect()
    }

    /// Returns the positions of the statements with a breakpoint. Of several statements of a function
    /// on a line it is the first, so that a loop of one line pauses once.
    fn positions(&self, drafts: &Drafts, setup: &Setup, symbols: &Symbols) -> BTreeSet<u32> {
        let names = names(drafts, setup, symbols);
        let mut firsts: BTreeMap<(u32, u32, Option<u32>), u32> = BTreeMap::new();
        for statement in &symbols.statements {
            let (file, line) = (statement.place.file, statement.place.line);
            let name = names.get(file as usize).and_then(Option::as_ref);
            if name.and_then(|name| self.lines.get(name)).is_some_and(|all| all.contains(&line)) {
                let function = symbols.function(statement.offset).map(|function| function.offset);
                firsts.entry((file, line, function)).or_insert(statement.offset);
            }
        }
        firsts.into_values().collect()
    }
}

/// The positions of statements with a breakpoint in programs, of which robots share a few.
pub struct KnownPositions<'a> {
    breakpoints: &'a Breakpoints,
    drafts: &'a Drafts,
    setup: &'a Setup,
    known: Vec<(Option<Arc<Symbols>>, BTreeSet<u32>)>,
}

impl<'a> KnownPositions<'a> {
    /// Returns the positions in programs of this setup.
    pub fn new(breakpoints: &'a Breakpoints, drafts: &'a Drafts, setup: &'a Setup) -> Self {
        KnownPositions { breakpoints, drafts, setup, known: Vec::new() }
    }

    /// Returns the positions in a program.
    pub fn of(&mut self, program: &Program) -> &BTreeSet<u32> {
        let is_same = |known: &Option<Arc<Symbols>>| match (known, &program.symbols) {
            (Some(known), Some(symbols)) => Arc::ptr_eq(known, symbols),
            (known, symbols) => known.is_none() && symbols.is_none(),
        };
        let number = self.known.iter().position(|(known, _)| is_same(known)).unwrap_or_else(|| {
            let symbols = program.symbols.as_deref();
            let positions = |symbols| self.breakpoints.positions(self.drafts, self.setup, symbols);
            let positions = symbols.map(positions).unwrap_or_default();
            self.known.push((program.symbols.clone(), positions));
            self.known.len() - 1
        });
        &self.known[number].1
    }
}

/// Returns the names of the scripts to which the files of a program belong.
fn names(drafts: &Drafts, setup: &Setup, symbols: &Symbols) -> Vec<Option<String>> {
    let name = |file: &String| edit::name_of_source(drafts, setup, Path::new(file));
    symbols.files.iter().map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn statements(depths: &[usize]) -> Vec<WatchedStatement> {
        let statement = |depth: &usize| WatchedStatement { position: 0, depth: *depth };
        depths.iter().map(statement).collect()
    }

    #[test]
    fn steps_follow_calls() {
        let all = statements(&[1, 1, 2, 3, 2, 1]);
        let ends = |at, to| target(&all, Some(at), to);
        assert_eq!((ends(1, StepTo::Next), ends(1, StepTo::Over)), (Some(2), Some(5)));
        assert_eq!((ends(2, StepTo::Over), ends(2, StepTo::Out)), (Some(4), Some(5)));
        assert_eq!((ends(3, StepTo::Out), ends(5, StepTo::Out)), (Some(4), None));
        assert_eq!((ends(3, StepTo::Back), ends(0, StepTo::Back)), (Some(2), None));
        assert_eq!((ends(3, StepTo::First), ends(3, StepTo::Last)), (Some(0), Some(5)));
        assert_eq!((ends(3, StepTo::At(4)), ends(3, StepTo::At(6))), (Some(4), None));
        assert_eq!(ends(5, StepTo::Next), None);
    }

    #[test]
    fn a_step_begins_before_the_first_statement() {
        let all = statements(&[2, 1]);
        let ends = |to| target(&all, None, to);
        assert_eq!((ends(StepTo::Next), ends(StepTo::Out)), (Some(0), Some(0)));
        assert_eq!((ends(StepTo::Back), ends(StepTo::Last)), (None, Some(1)));
        assert_eq!((ends(StepTo::At(1)), ends(StepTo::At(2))), (Some(1), None));
        assert_eq!(target(&[], None, StepTo::Next), None);
    }
}
