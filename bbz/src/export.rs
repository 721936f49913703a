//! `bbz export`: converts a recording to a table of robots.

use std::path::PathBuf;

use bittybuzz_arena::output::recording::{RecordedRobot, RecordingReader, RobotStatus};
use bittybuzz_toml_reader::file;

use crate::data::{Cell, DataFiles, RunData, count, integer, text};
use crate::exit::ExitStatus;
use crate::file_error::FileError;
use crate::problem::Problem;
use crate::recording_error::RecordingProblem;
use crate::whole_file::Inputs;

const EXAMPLES: &str = "\
Examples:
  bbz sim swarm.toml --record swarm.bbr    make a recording
  bbz export swarm.bbr swarm               tables for Python, R or a database
  bbz export swarm.bbr swarm.csv           for a spreadsheet";

/// Arguments of `bbz export`.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct ExportArguments {
    /// Recording of `bbz sim --record`
    recording: PathBuf,
    /// New folder for Parquet, or file for CSV
    #[arg(value_name = "DIR|OUT.csv")]
    output: PathBuf,
}

/// Carries out the command.
pub fn execute(arguments: &ExportArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let path = &arguments.recording;
    let mut inputs = Inputs::default();
    inputs.add(path);
    let bytes = file::read(path, file::RECORDING_BYTES_MAX)
        .map_err(|error| FileError::reading(path, error))?;
    let damaged = |error| RecordingProblem::new("convert", path, error);
    let mut reader = RecordingReader::new(&bytes).map_err(damaged)?;
    let lengths = ["x_tenths_mm", "y_tenths_mm", "z_tenths_mm"];
    let columns = ["run", "tick", "robot"].into_iter().chain(lengths);
    let columns = columns.chain(["heading_tenths_deg", "led"]).map(integer);
    let mut robots = RunData::new("robots", columns.chain([text("state")]).collect());
    let mut files = DataFiles::create(&arguments.output, &robots, &inputs)?;
    let ids: Vec<u16> = reader.header().bodies.iter().map(|body| body.id).collect();
    while let Some(tick) = reader.advance().map_err(damaged)? {
        for (id, robot) in ids.iter().zip(reader.robots()) {
            // A robot that has not joined has no state.
            let Some(robot) = robot else { continue };
            let numbers = [0, count(tick), i32::from(*id)].into_iter().chain(numbers(robot));
            let state = Cell::OptionalText(Some(state(robot.state).to_owned()));
            robots.push(numbers.map(Cell::Integer).chain([state]));
        }
        if files.is_due(robots.rows()) {
            files.take(&mut robots, [].into_iter(), false)?;
        }
    }
    files.take(&mut robots, [].into_iter(), true)?;
    Ok(ExitStatus::Success)
}

/// Returns pose and LED. The heading is in (-1800, 1800] tenths of a degree.
fn numbers(robot: &RecordedRobot) -> [i32; 5] {
    let tenths = (f64::from(robot.heading) * 3600.0 / 65_536.0).round() as i32;
    let heading = if tenths > 1800 { tenths - 3600 } else { tenths };
    [robot.x, robot.y, robot.z, heading, robot.led.into()]
}

fn state(state: RobotStatus) -> &'static str {
    match state {
        RobotStatus::Running => "running",
        RobotStatus::Stopped => "stopped",
        RobotStatus::Failed => "failed",
        RobotStatus::Faulted => "faulted",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_are_those_of_the_quantity() {
        let degrees = |heading| {
            let state = RobotStatus::Running;
            numbers(&RecordedRobot { x: 1, y: 2, z: 3, heading, led: 7, state })[3]
        };
        assert_eq!([0, 16_384, 32_768, 49_152, 65_535].map(degrees), [0, 900, 1800, -900, 0]);
    }
}
