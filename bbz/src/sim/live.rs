//! A single run with progress, log lines, pictures and a recording.

use std::sync::Arc;
use std::time::Duration;

use annotate_snippets::{Group, Level};
use bittybuzz_arena::robot::LogLine;
use bittybuzz_arena::run::{Setup, Simulation, Summary};

use crate::costs;
use crate::exit::ExitStatus;
use crate::interrupt::{self, Interrupt};
use crate::output::ScriptOutput;
use crate::problem::Problem;
use crate::report;

use super::arguments::SimArguments;
use super::data::SingleData;
use super::open;
use super::progress::Progress;
use super::recorder::Recorder;
use super::{checks, doors, summary};

/// The longest time from the end of an emulator by Ctrl-C until this process handles Ctrl-C.
pub const PATIENCE: Duration = Duration::from_millis(200);

/// Runs a scenario once.
pub fn run(arguments: &SimArguments, set: &[String]) -> Result<ExitStatus, Box<dyn Problem>> {
    let Some(opened) = open::open(arguments, set)? else {
        return Ok(ExitStatus::CompileError);
    };
    let Some(mut setup) = opened.setup() else { return Ok(ExitStatus::CompileError) };
    if arguments.checks {
        setup = setup.checked(|group| costs::of(&group.robot, group.robot.profile));
    }
    let setup = Arc::new(setup);
    let seed = arguments.seed.unwrap_or(opened.scenario.world.seed);
    let mut simulation = match Simulation::new(setup.clone(), seed, arguments.threads.unwrap_or(0))
    {
        Ok(simulation) => simulation,
        Err(error) => {
            open::print(&[error]);
            return Ok(ExitStatus::CompileError);
        }
    };
    doors::print(&opened.scenario);
    let mut interrupt = Interrupt::install()?;
    let mut output = ScriptOutput::new();
    let is_quiet = arguments.headless || arguments.json;
    let mut progress = Progress::new(simulation.end(), is_quiet);
    let robots = simulation.robot_count() as f64;
    let mut recorder = Recorder::new(arguments, &simulation, &opened.inputs())?;
    recorder.sample(&simulation)?;
    let mut data = match &arguments.data {
        Some(path) => Some(SingleData::create(path, &setup, &opened.inputs())?),
        None => None,
    };
    if let Some(data) = &mut data {
        data.read(&simulation)?;
    }
    let mut failure = None;
    while !simulation.is_over() && !interrupt.is_raised() && !output.has_failed() {
        let ticked = match &mut data {
            Some(data) => simulation.tick_observed(data.observer()),
            None => simulation.tick(),
        };
        if let Err(error) = ticked {
            // The terminal sends Ctrl-C to emulators, too, and an emulator may end first.
            failure = (!interrupt.is_raised_within(PATIENCE)).then_some(error);
            break;
        }
        recorder.sample(&simulation)?;
        if let Some(data) = &mut data {
            data.read(&simulation)?;
        }
        // The lines are taken even if they are not printed, because they would accumulate.
        let lines = simulation.take_log();
        if !lines.is_empty() && !is_quiet {
            progress.aside(|| {
                for (robot, line) in &lines {
                    output.line(&text(&setup, *robot, line));
                }
                output.flush();
            });
        }
        let now = simulation.now();
        progress.set(now, |elapsed| {
            let seconds = now as f64 / 10.0;
            let rate = robots * seconds / elapsed.as_secs_f64();
            format!("{seconds:.0} s simulated, {rate:.0} robot-seconds per second")
        });
    }
    let elapsed = progress.finish();
    let result = simulation.summary();
    recorder.finish(&setup)?;
    if let Some(data) = data {
        data.finish(&setup, &result, simulation.digest())?;
    }
    output.flush();
    if interrupt.is_raised() {
        let end = opened.scenario.world.duration;
        let title = format!(
            "stopped by {} at {} s of {end} s",
            interrupt::NAME,
            simulation.now() as f64 / 10.0
        );
        report::print(Group::with_title(Level::NOTE.primary_title(title)));
    }
    summary::faults(&setup, &opened.programs, &result);
    if arguments.json {
        let mut object = summary::json(&setup, &opened.programs, &result);
        object["digest"] = format!("{:016x}", simulation.digest()).into();
        if arguments.checks {
            object["checks"] = checks::json(&opened, &result);
        }
        output.line(object.to_string().as_bytes());
    } else {
        for line in summary::text(&setup, &result, elapsed) {
            output.line(line.as_bytes());
        }
        for line in opened.long_messages() {
            output.line(line.as_bytes());
        }
        if arguments.checks {
            for line in checks::text(&opened, &result) {
                output.line(line.as_bytes());
            }
        }
    }
    output.finish()?;
    if let Some(error) = failure {
        let seconds = simulation.now() as f64 / 10.0;
        report::mistake(&format!("the run has ended after {seconds} s: {error}"), None, None);
        return Ok(ExitStatus::RuntimeError);
    }
    Ok(ending(&result))
}

/// Returns the exit status of a run.
fn ending(summary: &Summary) -> ExitStatus {
    if summary.is_success() { ExitStatus::Success } else { ExitStatus::RuntimeError }
}

/// Returns a log line: time in seconds, id of the robot, text.
fn text(setup: &Setup, robot: usize, line: &LogLine) -> Vec<u8> {
    let id = setup.id(robot);
    let mut text = format!("{:>8.1} {id:>5}  ", line.tick as f64 / 10.0).into_bytes();
    let symbols = setup.program(line.program).and_then(|program| program.symbols.as_deref());
    line.pieces.iter().for_each(|piece| piece.append_to(symbols, &mut text));
    text
}
