//! `bbz robots`: lists the robots that `--robot` knows, or describes one robot for authors of
//! scripts, with its part in `bbz sim`.

use bittybuzz_robot_files::{all_shipped, find};
use bittybuzz_robot_spec::{
    BodySpec, Budget, FunctionEffect, Indicator, OnFault, Robot, Sensor, SensorKind, Setting,
};
use clap::Args;

use crate::exit::ExitStatus;
use crate::output;
use crate::problem::Problem;

const EXAMPLES: &str = "\
Examples:
  bbz robots                  a list of all robots
  bbz robots kilobot          functions, tables and limits of one
  bbz robots my-robot.toml    the same of a robot file of your own";

/// Arguments of `bbz robots`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct RobotsArguments {
    /// Robot: its name or the path of a robot file (*.toml); without, all are listed
    #[arg(value_name = "NAME|PATH.toml")]
    robot: Option<String>,
}

/// Carries out the command.
pub fn execute(arguments: &RobotsArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let text = match &arguments.robot {
        Some(robot) => describe(&find(robot)?),
        None => list(&all_shipped()),
    };
    output::write(&text)?;
    Ok(ExitStatus::Success)
}

/// Returns a line for each robot.
fn list(robots: &[Robot]) -> String {
    let mut text =
        format!("{:<12}{:<18}{:<9}{:<15}functions\n", "name", "robot", "profile", "chip");
    for robot in robots {
        let names: Vec<&str> = robot.functions.iter().map(|function| &*function.name).collect();
        let chip = robot.chip.as_deref().unwrap_or("-");
        let (name, title, profile) = (&robot.name, &robot.title, robot.profile.name());
        let line = format!("{name:<12}{title:<18}{profile:<9}{chip:<15}{}", names.join(", "));
        text += &(line + "\n");
    }
    text
}

/// Describes functions, tables, settings, signals of the lights, and limits of a robot.
pub fn describe(robot: &Robot) -> String {
    let chip = robot.chip.as_deref().unwrap_or("never flashed");
    let mut lines = vec![format!("{} (`--robot {}`): {chip}", robot.title, robot.name)];
    lines.extend(limits(robot).map(|limit| format!("  {limit}")));
    lines.extend(robot.body.as_ref().map(|body| format!("  {}", body_text(body))));
    lines.extend(robot.sensors.iter().map(|sensor| format!("  {}", sensor_text(sensor))));
    for function in &robot.functions {
        lines.push(String::new());
        lines.extend(function.forms());
        let waits = if function.waits { "; the script waits until that is done" } else { "" };
        lines.push(format!("    {}{waits}", function.help));
        if let Some(effect) = &function.effect {
            lines.push(format!("    in bbz sim: {}", effect_text(effect, &robot.sensors)));
        }
    }
    for table in &robot.tables {
        let fields: Vec<String> = table.fields.iter().map(ToString::to_string).collect();
        lines.push(format!("\n{} = {{ {} }}", table.name, fields.join(", ")));
        lines.push(format!("    {}", table.help));
    }
    for Setting { name, least, most, help } in &robot.settings {
        lines.push(format!("\nbbz flash --set {name}={least} to {name}={most}\n    {help}"));
    }
    for Indicator { shows, means } in &robot.indicators {
        lines.push(format!("\nlight: {shows}\n    {means}"));
    }
    lines.join("\n") + "\n"
}

fn limits(robot: &Robot) -> impl Iterator<Item = String> {
    let (profile, hz, vm) = (robot.profile.name(), robot.tick_hz, &robot.vm);
    let after_fault = match robot.on_fault {
        OnFault::Restart => "starts again after a pause",
        OnFault::Stop => "stops until power-on",
    };
    let firmware = robot.budget.as_ref().map(|budget| {
        let Budget { flash_bytes, ram_bytes } = budget;
        format!("firmware and script: at most {flash_bytes} bytes of flash, {ram_bytes} of RAM")
    });
    let bearings = (!vm.bearings).then(|| "azimuth and elevation of neighbors are nil".to_owned());
    let all = [
        format!("profile {profile}, {hz} steps per second; after a fault the script {after_fault}"),
        format!("{} bytes of memory; {} slots for globals, tables and calls", vm.memory, vm.slots),
        format!(
            "at most {} neighbors, {} entries of stigmergies, {} swarms",
            vm.neighbors, vm.stigmergy_entries, vm.swarms
        ),
        format!("{} messages can wait to be read, {} to be sent", vm.in_queue, vm.out_queue),
        format!(
            "{} long messages can be received at once, {} can wait to be sent",
            vm.in_long, vm.out_long
        ),
        format!("one frame carries {} bytes of a message", robot.message_bytes),
    ];
    all.into_iter().chain(bearings).chain(firmware)
}

/// Returns a text such as `body in bbz sim: differential, radius 40 mm, height 80 mm; at most 150
/// mm/s forward, 286 deg/s turn`.
fn body_text(body: &BodySpec) -> String {
    let BodySpec { drive, radius_mm, height_mm, .. } = body;
    let most = drive.quantities().iter().filter_map(|quantity| {
        let most = drive.most(*quantity)?;
        Some(format!("{} {most:.0} {}", quantity.name(), quantity.unit()))
    });
    format!(
        "body in bbz sim: {}, radius {radius_mm} mm, height {height_mm} mm; at most {}",
        drive.name(),
        most.collect::<Vec<_>>().join(", ")
    )
}

/// Returns a text such as `sensor ring: proximity, 8 beams up to 300 mm`.
fn sensor_text(sensor: &Sensor) -> String {
    let kind = sensor.kind.name();
    let limits = match &sensor.kind {
        SensorKind::Proximity { directions_deg, range_mm, .. } => match directions_deg.len() {
            1 => format!(", up to {range_mm} mm"),
            beams => format!(", {beams} beams up to {range_mm} mm"),
        },
        SensorKind::RangeAndBearing { range_mm, .. } => format!(", up to {range_mm} mm"),
        SensorKind::Battery { full_mv, empty_mv, minutes } => {
            format!(", {full_mv} to {empty_mv} mV in {minutes} minutes")
        }
        SensorKind::Ground { at_mm: [ahead, left] } if (*ahead, *left) != (0.0, 0.0) => {
            format!(" at [{ahead}, {left}] mm, 0 to 1023")
        }
        SensorKind::Light { .. } | SensorKind::Ground { .. } => ", 0 to 1023".to_owned(),
    };
    format!("sensor {}: {kind}{limits}", sensor.name)
}

/// Returns a text such as `sets forward = 0 mm/s; reads ring.0 (mm)`.
fn effect_text(effect: &FunctionEffect, sensors: &[Sensor]) -> String {
    let mut parts = Vec::new();
    if !effect.sets.is_empty() {
        let sets: Vec<String> = effect.sets.iter().map(ToString::to_string).collect();
        parts.push(format!("sets {}", sets.join(", ")));
    }
    if effect.logs {
        parts.push("logs its arguments".to_owned());
    }
    if let Some(reading) = effect.reads {
        let sensor = &sensors[reading.sensor];
        let (value, unit) = (reading.value.suffix(), reading.value.unit(&sensor.kind));
        parts.push(format!("reads {}{value} ({unit})", sensor.name));
    }
    parts.join("; ")
}
