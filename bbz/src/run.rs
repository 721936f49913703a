//! `bbz run`: runs a script on this computer.

use std::path::PathBuf;
use std::time::Duration;

use annotate_snippets::{Group, Level};
use bittybuzz_arena::robot::checks::MachineChecker;
use bittybuzz_compiler::diagnostic::Diagnostic;
use bittybuzz_compiler::source::SourceMap;
use bittybuzz_fault::{Backtrace, FaultReport};
use bittybuzz_robot_spec::{NumberProfile, Robot};
use bittybuzz_vm_core::number::{Full, Tiny};
use bittybuzz_vm_core::{Entry, Sizes};
use clap::Args;
use serde_json::{Value, json};

use crate::checks::CheckFindings;
use crate::costs;
use crate::drive::{self, Ended, INSTRUCTIONS_MAX, InSight, RunEnd, RunSettings, SLOTS};
use crate::exit::ExitStatus;
use crate::host::{HostClock, HostRobot};
use crate::interrupt::{self, Interrupt};
use crate::json;
use crate::output::{self, OutputForm};
use crate::problem::Problem;
use crate::program::LoadedProgram;
use crate::program::RefusedImage;
use crate::report;
use crate::selection::SelectionArguments;

/// Steps per second if no robot is named.
const TICK_HZ: u32 = 10;

/// The capacities for neighbors, stigmergy entries and swarms if no robot is named.
const SIZES_MAX: Sizes = Sizes { neighbors: 255, bearings: true, entries: 100, swarms: 8 };

const EXAMPLES: &str = "\
Examples:
  bbz run hello.bzz                      global code and init(), then step() at 10 Hz until Ctrl-C
  bbz run hello.bzz --steps 100          100 steps at full speed; a step without end is an error
  bbz run hello.bzz --steps 9 --destroy  9 steps, then destroy()
  bbz run blink.bzz --robot kilobot      with functions, profile and memory of the Kilobot
  bbz run near.bzz --neighbor 2,50,0.7,0  with robot 2 in sight: 50 mm away, 0.7 rad to the left, level
  bbz run walk.bzz --id 3 --seed 7       as robot 3, with other random numbers
  bbz run gradient.bzz --robot kilobot --checks --steps 100    also report numbers that wrapped, memory and cycles
  bbz run follow.bzz -I behaviors       search behaviors/ for included files
  bbz run blink.bbi                      what `bbz build` has made
  bbz run hello.bzz --steps 9 --json     for other programs

Robot functions print their calls, such as led(3). They are finished at once and return 0, 0.0 or nil.
A delay takes its time in real time, none at full speed.

Exit status: 0, or 1 run-time error, 2 compile error, 3 wrong command line or file.";

/// Arguments of `bbz run`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct RunArguments {
    /// Script (.bzz), Buzz object file (.bo) or image (.bbi)
    file: PathBuf,
    #[command(flatten)]
    selection: SelectionArguments,
    /// Number of steps, at full speed [default: 10 steps per second until Ctrl-C]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    steps: Option<u64>,
    /// Call destroy() after the last step, as Ctrl-C does without --steps
    #[arg(long, requires = "steps")]
    destroy: bool,
    /// Id of the robot
    #[arg(long, value_name = "N", default_value_t = 1)]
    id: u16,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,
    /// A robot in sight: distance in mm, azimuth and elevation in radians [default: 0]; may be given several times
    #[arg(long = "neighbor", value_name = "ID,DISTANCE[,AZIMUTH[,ELEVATION]]", value_parser = neighbor, allow_hyphen_values = true)]
    neighbors: Vec<InSight>,
    /// Report numbers that did not fit their type, and the memory and cycles that the script needed, after the run
    #[arg(long)]
    checks: bool,
    /// Folder to search for included files; may be given several times
    #[arg(short = 'I', value_name = "DIR")]
    include: Vec<PathBuf>,
    /// Write standard output as JSON objects, one on a line
    #[arg(long)]
    json: bool,
}

/// Reads the value of `--neighbor`.
fn neighbor(text: &str) -> Result<InSight, String> {
    let fields: Vec<&str> = text.split(',').map(str::trim).collect();
    let [id, place @ ..] = fields.as_slice() else { return Err("it is empty".to_owned()) };
    let id = id.parse().map_err(|_| format!("the id `{id}` is not a number from 0 to 65535"))?;
    if place.len() > 3 {
        return Err("there are more than four numbers".to_owned());
    }
    let mut numbers = [0.0; 3];
    for (number, field) in numbers.iter_mut().zip(place) {
        *number = field.parse().map_err(|_| format!("`{field}` is not a number"))?;
    }
    if place.is_empty() || !numbers.iter().all(|number: &f32| number.is_finite()) {
        return Err("give an id and a distance, and perhaps azimuth and elevation".to_owned());
    }
    Ok(InSight { id, place: numbers })
}

/// Returns the message about an entry that did not end.
fn endless(entry: Entry, steps: u64) -> String {
    let place = match entry {
        Entry::Global => "the global code".to_owned(),
        Entry::Init => "`init()`".to_owned(),
        Entry::Step => format!("step {steps}"),
        Entry::Reset => "`reset()`".to_owned(),
        Entry::Destroy => "`destroy()`".to_owned(),
    };
    format!("{place} did not end within {} million instructions", INSTRUCTIONS_MAX / 1_000_000)
}

/// Carries out the command.
pub fn execute(arguments: &RunArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let selection = arguments.selection.select()?;
    let print = |sources: &SourceMap, diagnostics: &[Diagnostic]| {
        if !arguments.json {
            report::diagnostics(sources, diagnostics);
            return Ok(());
        }
        let (errors, warnings) = report::count(diagnostics);
        let messages = json::messages(&json::diagnostics(sources, diagnostics), errors, warnings);
        Ok(output::write(&format!("{messages}\n"))?)
    };
    let opened =
        LoadedProgram::open_reporting(&arguments.file, &arguments.include, &selection, print)?;
    let Some(program) = opened else { return Ok(ExitStatus::CompileError) };
    let robot = selection.robot.as_ref();
    let tick_hz = robot.map_or(TICK_HZ, |robot| robot.tick_hz);
    let costs = robot.filter(|_| arguments.checks);
    let costs = costs.and_then(|robot| costs::of(robot, program.profile));
    let settings = RunSettings {
        id: arguments.id,
        seed: arguments.seed,
        slots: robot.map_or(SLOTS, |robot| robot.vm.slots as usize),
        sizes: robot.map_or(SIZES_MAX, Robot::sizes),
        steps: arguments.steps,
        destroy: arguments.destroy,
        neighbors: arguments.neighbors.clone(),
        period: Duration::from_secs(1) / tick_hz,
        checker: arguments.checks.then(|| MachineChecker::new(arguments.id, costs.clone())),
        symbols: program.symbols.as_ref(),
    };
    let clock = match arguments.steps {
        Some(_) => HostClock::Simulated,
        None => HostClock::Real { until: None },
    };
    let form = if arguments.json { OutputForm::Json } else { OutputForm::Lines };
    let mut host = HostRobot::new(selection.playable(), &program, clock, form);
    let mut interrupt = Interrupt::install()?;
    let drive = match program.profile {
        NumberProfile::Tiny => drive::drive::<Tiny>,
        NumberProfile::Full => drive::drive::<Full>,
    };
    let is_known = |hash| selection.has_function(hash);
    let Ended { end, positions, entry, steps, checker, memory, content } =
        drive(&program.image, &settings, &is_known, &mut host, &mut interrupt)
            .map_err(|cause| RefusedImage::new(&arguments.file, cause))?;
    let refusal = host.refusal.take();
    let backtrace = Backtrace::new(program.known(), positions, Some(entry));
    let checked = checker.as_ref().map(|checker| CheckFindings {
        findings: checker.findings(),
        program: &program,
        slots: settings.slots,
        entries: settings.sizes.entries.into(),
        costs: costs.as_deref(),
        ticks_per_second: tick_hz.into(),
        has_robots: false,
    });
    if arguments.json {
        let calls = (end == RunEnd::Endless).then(|| backtrace.places());
        let (ended, fault) = match &end {
            RunEnd::Complete | RunEnd::OutputClosed => ("complete", Value::Null),
            RunEnd::Interrupted => ("interrupted", Value::Null),
            RunEnd::Endless => ("endless", Value::Null),
            RunEnd::Fault(fault) => {
                let report = FaultReport::new(fault, backtrace, refusal.as_deref());
                ("fault", report.with_content(content.as_ref()).json())
            }
        };
        let mut object = json!({ "ended": ended, "steps": steps, "fault": fault });
        if let Some(calls) = calls {
            object["calls"] = calls.into();
        }
        if let Some(checked) = checked {
            object["checks"] = checked.json();
        }
        host.output.plain(object.to_string().as_bytes());
        host.output.finish()?;
        return Ok(match end {
            RunEnd::Fault(_) | RunEnd::Endless => ExitStatus::RuntimeError,
            RunEnd::Complete | RunEnd::OutputClosed | RunEnd::Interrupted => ExitStatus::Success,
        });
    }
    host.output.finish()?;
    let ending = match end {
        RunEnd::Complete | RunEnd::OutputClosed => ExitStatus::Success,
        RunEnd::Interrupted => {
            let title = Level::NOTE.primary_title(format!("stopped by {}", interrupt::NAME));
            report::print(Group::with_title(title).elements(backtrace.elements()));
            ExitStatus::Success
        }
        RunEnd::Endless => {
            let title = Level::ERROR.primary_title(endless(entry, steps));
            let help = Level::HELP.message(
                "a loop needs a condition that becomes false; without --steps, Ctrl-C ends it",
            );
            report::print(Group::with_title(title).elements(backtrace.elements()).element(help));
            ExitStatus::RuntimeError
        }
        RunEnd::Fault(fault) => {
            let step = (entry == Entry::Step).then(|| format!("in step {steps}"));
            let report = FaultReport::new(&fault, backtrace, refusal.as_deref());
            let report = report.with_memory(memory.as_ref());
            report::print(report.message(&step.into_iter().collect::<Vec<_>>()));
            ExitStatus::RuntimeError
        }
    };
    if let Some(checked) = checked {
        report::lines(&checked.text());
    }
    Ok(ending)
}
