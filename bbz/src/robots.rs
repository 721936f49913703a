//! `bbz robots`: lists the robots that `--robot` knows, or describes one robot for authors of
//! scripts, with its part in `bbz sim`.

use bittybuzz_robot_files::{all_shipped, find};
use bittybuzz_robot_spec::{
    BodySpec, Budget, DistanceUnit, FunctionEffect, Indicator, OnFault, Robot, RobotFunction,
    Sensor, SensorKind, SensorReading, Setting, Steering, TableValue, ValueScale, ValueSource,
};
use bittybuzz_toml_reader::number_text;
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
        let called = robot.functions.iter().filter(|function| !function.is_reader());
        let names: Vec<&str> = called.map(|function| &*function.name).collect();
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
    let steering = robot.body.as_ref().and_then(|body| body.drive.steering());
    lines.extend(steering.map(|rule| format!("  {}", steering_text(&rule))));
    lines.extend(robot.sensors.iter().map(|sensor| format!("  {}", sensor_text(sensor))));
    for function in robot.functions.iter().filter(|function| !function.is_reader()) {
        lines.push(String::new());
        lines.extend(function.forms());
        let waits = if function.waits { "; the script waits until that is done" } else { "" };
        lines.push(format!("    {}{waits}", function.help));
        if let Some(effect) = &function.effect {
            lines
                .push(format!("    in bbz sim: {}", effect_text(function, effect, &robot.sensors)));
        }
    }
    for table in &robot.tables {
        let fields: Vec<String> = table.fields.iter().map(ToString::to_string).collect();
        lines.push(format!("\n{} = {{ {} }}", table.name, fields.join(", ")));
        lines.push(format!("    {}", table.help));
    }
    for value in &robot.values {
        lines.push(format!("\n{}{}", value.path, count_text(value)));
        lines.push(format!("    {}", value.help));
        lines.push(format!("    in bbz sim: {}", value_text(value, &robot.sensors)));
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

/// Returns a text about the rule by which the robot follows vectors.
fn steering_text(rule: &Steering) -> String {
    let Steering { hard_turn_deg, soft_turn_deg, no_turn_deg, speed_mm_s } = rule;
    format!(
        "along a vector: at most {speed_mm_s} mm/s; straight up to {no_turn_deg} degrees off, on the spot \
         above {hard_turn_deg} until {soft_turn_deg}, else in a curve"
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
        SensorKind::RangeAndBearing { range_mm, unit: DistanceUnit::Millimeter, .. } => {
            format!(", up to {range_mm} mm")
        }
        SensorKind::RangeAndBearing { range_mm, unit, .. } => {
            format!(", up to {range_mm} mm; scripts get distances in {}", unit.name())
        }
        SensorKind::Battery { full_mv, empty_mv, minutes } => {
            format!(", {full_mv} to {empty_mv} mV in {minutes} minutes")
        }
        SensorKind::Light { directions_deg } if directions_deg.len() > 1 => {
            format!(", {} directions, 0 to 1023", directions_deg.len())
        }
        SensorKind::Ground { at_mm: [ahead, left] } if (*ahead, *left) != (0.0, 0.0) => {
            format!(" at [{ahead}, {left}] mm, 0 to 1023")
        }
        SensorKind::Light { .. } | SensorKind::Ground { .. } => ", 0 to 1023".to_owned(),
        SensorKind::Positioning { .. } => String::new(),
    };
    format!("sensor {}: {kind}{limits}", sensor.name)
}

/// Returns a text such as `sets forward = 0 mm/s; reads ring.0 (mm)`.
fn effect_text(function: &RobotFunction, effect: &FunctionEffect, sensors: &[Sensor]) -> String {
    let mut parts = Vec::new();
    if !effect.sets.is_empty() {
        let sets: Vec<String> = effect.sets.iter().map(ToString::to_string).collect();
        parts.push(format!("sets {}", sets.join(", ")));
    }
    if let Some(vector) = &effect.steers {
        parts.push(format!("steers along {vector}"));
    }
    if effect.logs {
        let mut last = function.accepts.iter().filter_map(|list| list.last());
        let is_like_log = last.any(|parameter| parameter.is_repeated);
        let logged = if is_like_log { "logs its arguments" } else { "logs the call" };
        parts.push(logged.to_owned());
    }
    parts.extend(effect.reads.map(|reading| format!("reads {}", reading_text(reading, sensors))));
    parts.join("; ")
}

/// Returns a text such as `ring.0 (mm)`.
fn reading_text(reading: SensorReading, sensors: &[Sensor]) -> String {
    let sensor = &sensors[reading.sensor];
    let (value, unit) = (reading.value.suffix(), reading.value.unit(&sensor.kind));
    format!("{}{value} ({unit})", sensor.name)
}

/// Returns a text such as `, 8 elements`; nothing for a single value.
fn count_text(value: &TableValue) -> String {
    value.elements.map_or(String::new(), |count| match count {
        1 => ", 1 element".to_owned(),
        _ => format!(", {count} elements"),
    })
}

/// Returns a text such as `0.001 * gps.x (mm)` or `always 0.0`.
fn value_text(value: &TableValue, sensors: &[Sensor]) -> String {
    match &value.source {
        ValueSource::Constant(all) => {
            let all: Vec<String> = all.iter().map(ToString::to_string).collect();
            format!("always {}", all.join(", "))
        }
        ValueSource::Reading(reading) => {
            let readings = reading.readings.iter().map(|one| reading_text(*one, sensors));
            let readings = readings.collect::<Vec<_>>().join(", ");
            match &reading.scale {
                ValueScale::Factor(1.0) => readings,
                ValueScale::Factor(factor) => format!("{} * {readings}", number_text(*factor)),
                ValueScale::Curve(points) => {
                    format!("{readings}, by a curve of {} points", points.len())
                }
            }
        }
    }
}
