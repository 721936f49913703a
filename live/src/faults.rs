//! Run-time errors of robots, as events for clients.

use std::path::{Path, PathBuf};

use bittybuzz_arena::robot::{Consequence, FaultRecord, PostMortem};
use bittybuzz_arena::run::{Program, Setup};
use bittybuzz_fault::{Backtrace, FaultPlace, FaultReport, KnownProgram, accepted};
use bittybuzz_inspect::Inspection;
use bittybuzz_robot_spec::Robot;

use crate::edit;
use crate::inspection::{self, MemoryDescription};
use crate::page_event::{FaultConsequence, FaultEvent, StoppedEvent};
use crate::relative::relative;
use crate::workshop::Drafts;

/// The beginning of a lambda's name, before its place.
const LAMBDA: &str = "lambda at ";

/// Describes a fault of a robot. With drafts, its places name the scripts that the client can edit.
pub fn describe(
    setup: &Setup,
    drafts: Option<&Drafts>,
    robot: usize,
    PostMortem { fault, content }: &PostMortem,
) -> FaultEvent {
    let consequence = match fault.consequence {
        Consequence::Contained => FaultConsequence::Contained,
        Consequence::Pause(_) => FaultConsequence::Pause,
        Consequence::Stop => FaultConsequence::Stop,
    };
    let of = &setup.scenario.group(setup.group(robot)).robot;
    let report = report(setup.program(fault.program), of, fault);
    let mut description = report.with_content(content.as_deref()).description();
    for place in description.places.iter_mut().flatten() {
        name(setup, drafts, place);
    }
    FaultEvent { tick: fault.tick, robot, consequence, description }
}

fn report<'a>(program: Option<&'a Program>, of: &Robot, fault: &FaultRecord) -> FaultReport<'a> {
    let program = match program {
        Some(Program { image, symbols, sources }) => {
            let (symbols, sources) = (symbols.as_deref(), &**sources);
            KnownProgram { image, profile: of.profile, symbols, sources }
        }
        None => KnownProgram::UNKNOWN,
    };
    let backtrace = Backtrace::new(program, fault.positions.clone(), fault.entry);
    // Firmware does not report the accepted arguments.
    let refusal = fault.refusal.clone().or_else(|| accepted(&fault.fault, program, Some(of)));
    let report = FaultReport::new(&fault.fault, backtrace, refusal.as_deref());
    report.with_memory(fault.memory.as_ref())
}

/// Returns the place of the statement that begins at a position in the program of a robot. With
/// drafts, it names the script that the client can edit.
pub fn place(
    setup: &Setup,
    drafts: Option<&Drafts>,
    robot: usize,
    Program { image, symbols, sources }: &Program,
    position: u32,
) -> Option<FaultPlace> {
    let (symbols, sources) = (symbols.as_deref(), &**sources);
    let profile = setup.scenario.group(setup.group(robot)).robot.profile;
    let program = KnownProgram { image, profile, symbols, sources };
    let mut place = FaultPlace::new(program, position, symbols?.statement(position)?)?;
    name(setup, drafts, &mut place);
    Some(place)
}

/// Makes the file of a place relative to the folder of the scenario, and names its script if the
/// client can edit it.
fn name(setup: &Setup, drafts: Option<&Drafts>, place: &mut FaultPlace) {
    let path = PathBuf::from(&place.file);
    place.script = drafts.and_then(|drafts| edit::name_of_source(drafts, setup, &path));
    place.file = relative(&setup.scenario.folder, &path);
    if let Some(function) = &mut place.function {
        *function = name_of_function(&setup.scenario.folder, function);
    }
}

/// Describes the content of a machine, with files relative to the folder of the scenario.
pub fn content(setup: &Setup, content: &Inspection) -> MemoryDescription {
    let folder = &setup.scenario.folder;
    let mut memory = inspection::describe(content);
    for frame in &mut memory.frames {
        frame.function = name_of_function(folder, &frame.function);
        if let Some(source) = &mut frame.source {
            source.file = relative(folder, Path::new(&source.file));
        }
    }
    memory
}

/// Returns the event about the run that stops because of one of these faults, if there is one: the
/// first that stopped a script, or else the first.
pub fn stop(faults: &[FaultEvent]) -> Option<StoppedEvent> {
    let stopped = faults.iter().find(|fault| fault.consequence != FaultConsequence::Contained);
    let fault = stopped.or(faults.first())?.clone();
    let others = faults.iter().filter(|other| other.robot != fault.robot).count();
    Some(StoppedEvent { fault, others })
}

/// Returns the name of a function; that of a lambda has its place.
fn name_of_function(folder: &Path, name: &str) -> String {
    match name.strip_prefix(LAMBDA) {
        Some(place) => format!("{LAMBDA}{}", relative(folder, Path::new(place))),
        None => name.to_owned(),
    }
}
