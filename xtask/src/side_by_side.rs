//! Runs a script on this computer and on an emulated robot with its real firmware, and prints both
//! outputs side by side.

use anyhow::{Result, bail};
use bittybuzz_builds::board::CRAZYFLIE;
use bittybuzz_builds::shell::{Invocation, cargo, target};
use bittybuzz_robot_spec::Robot;
use std::path::Path;

/// A script that logs and uses LEDs.
const SCRIPT: &str = "examples/scheduler.bzz";
/// The number of steps: three seconds at 10 Hz.
const STEPS: &str = "30";
/// The simulated time, which includes the last step and half of the next tick.
const SECONDS: &str = "3.05";

/// A line of output.
#[derive(Clone, Debug, PartialEq, Eq)]
struct PrintedLine {
    text: String,
    /// True if the script logged the line, which should then be in both outputs.
    is_log: bool,
}

/// Builds the firmware and boots it in emulation. Fails if its log differs from that of this
/// computer.
pub fn run(bbz: &Path) -> Result<()> {
    println!("\n== {SCRIPT} on the firmware of the Crazyflie, in emulation");
    let image = CRAZYFLIE.build(None, false)?.display().to_string();
    // The emulator is optimized, because it emulates a processor of 168 MHz.
    cargo(&["build", "--release", "--package", "bittybuzz-emulate-stm32"])?;
    let emulator = target()?.join("release/bbz-emulate-stm32").display().to_string();
    let robot = ["--robot", CRAZYFLIE.robot];
    let here = [&["run", SCRIPT, "--steps", STEPS][..], &robot].concat();
    let there = ["trace", image.as_str(), "--script", SCRIPT, "--seconds", SECONDS];
    let there = [&there[..], &robot, &["--emulate", "--emulator", emulator.as_str()]].concat();
    let output = |arguments: &[&str]| {
        let output = Invocation::named("bbz", bbz, arguments).output(0)?;
        anyhow::Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let robot = bittybuzz_robot_files::find(CRAZYFLIE.robot)?;
    let here = lines_of_run(&robot, &output(&here)?);
    let shown = lines_of_trace(&output(&[&there[..], &["--outputs"]].concat())?);
    let logged = output(&[&there[..], &["--plain"]].concat())?;
    println!("\n{}", columns(&here, &shown));
    let expected: Vec<&str> = logs(&here).collect();
    let logged: Vec<&str> = logged.lines().collect();
    if logged.is_empty() || logged != expected {
        bail!("the emulated robot logs something else than `bbz run {SCRIPT}`");
    }
    println!("The {} log lines are the same. Not tried on hardware.", logged.len());
    Ok(())
}

/// Returns the lines of `bbz run`: calls of robot functions, and log lines.
fn lines_of_run(robot: &Robot, output: &str) -> Vec<PrintedLine> {
    let is_call =
        |text: &str| text.split_once('(').is_some_and(|(name, _)| robot.function(name).is_some());
    let line = |text: &str| PrintedLine { text: text.to_owned(), is_log: !is_call(text) };
    output.lines().map(line).collect()
}

/// Returns the lines of `bbz trace`: time, subject, text.
fn lines_of_trace(output: &str) -> Vec<PrintedLine> {
    let is_log = |text: &str| text.split_whitespace().nth(1) == Some("step");
    let line = |text: &str| PrintedLine { text: text.to_owned(), is_log: is_log(text) };
    output.lines().map(line).collect()
}

fn logs(lines: &[PrintedLine]) -> impl Iterator<Item = &str> {
    lines.iter().filter(|line| line.is_log).map(|line| line.text.as_str())
}

/// Returns both outputs as two columns, in which corresponding log lines are in one row.
fn columns(here: &[PrintedLine], there: &[PrintedLine]) -> String {
    let mut rows = vec![("bbz run", "bbz trace --emulate"), ("", "")];
    let (mut here, mut there) = (here.iter().peekable(), there.iter().peekable());
    while here.peek().is_some() || there.peek().is_some() {
        // The rows hold the lines before the next log line of either side, then that log line.
        loop {
            let left = here.next_if(|line| !line.is_log);
            let right = there.next_if(|line| !line.is_log);
            if left.is_none() && right.is_none() {
                break;
            }
            rows.push((text(left), text(right)));
        }
        if here.peek().is_some() || there.peek().is_some() {
            rows.push((text(here.next()), text(there.next())));
        }
    }
    let width = rows.iter().map(|(left, _)| left.chars().count()).max().unwrap_or(0);
    let lines = rows.iter().map(|(left, right)| format!("{left:<width$} |{right}"));
    lines.map(|line| line.trim_end().to_owned() + "\n").collect()
}

fn text(line: Option<&PrintedLine>) -> &str {
    line.map_or("", |line| line.text.as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRACE: &str = "    0.000610 output    led green_right on
    0.100942 output    led red_left on
    0.201000 step 1    1: checked
    0.300942 output    led red_left off
";

    #[test]
    fn calls_of_robot_functions_are_no_log_lines() {
        let robot = bittybuzz_robot_files::find("crazyflie").unwrap();
        let lines = lines_of_run(&robot, "led(1)\n1: checked\nlamp(1)\n");
        assert_eq!(logs(&lines).collect::<Vec<_>>(), ["1: checked", "lamp(1)"]);
    }

    #[test]
    fn log_lines_stand_in_one_row() {
        let robot = bittybuzz_robot_files::find("crazyflie").unwrap();
        let table =
            columns(&lines_of_run(&robot, "led(1)\n1: checked\nled(2)\n"), &lines_of_trace(TRACE));
        let rows: Vec<&str> = table.lines().skip(2).collect();
        assert_eq!(
            rows,
            [
                "led(1)     |    0.000610 output    led green_right on",
                "           |    0.100942 output    led red_left on",
                "1: checked |    0.201000 step 1    1: checked",
                "led(2)     |    0.300942 output    led red_left off",
            ]
        );
    }

    #[test]
    fn a_log_line_that_is_missing_leaves_its_place_empty() {
        let robot = bittybuzz_robot_files::find("crazyflie").unwrap();
        let table = columns(&lines_of_run(&robot, "a\nb\n"), &lines_of_trace("0.1 step 0 a\n"));
        assert_eq!(
            table.lines().skip(2).collect::<Vec<_>>(),
            ["a       |0.1 step 0 a", "b       |"]
        );
    }
}
