//! `<controllers>`: the scripts of robots, the loss of their messages, and parts that are not Buzz.

use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap, HashSet};

use super::document::Element;
use super::mistake::{Allowed, Mistake};
use super::script::{self, ScriptFolders};

/// The controllers that come with Buzz. Others add functions in C++.
const BUZZ: [&str; 4] = [
    "buzz_controller_footbot",
    "buzz_controller_kheperaiv",
    "buzz_controller_eyebot",
    "buzz_controller_spiri",
];

/// The limits of the Buzz controllers in degrees, and in cm/s, with the values of every example.
const TURNING: [(&str, f64); 4] = [
    ("hard_turn_angle_threshold", 90.0),
    ("soft_turn_angle_threshold", 70.0),
    ("no_turn_angle_threshold", 10.0),
    ("max_speed", 10.0),
];

/// The largest number and length of names that a misspelled name is compared with.
const KNOWN_MAX: usize = 100;
const KNOWN_BYTES_MAX: usize = 60;

/// The largest number of parameters that the list names.
const PARAMETERS_MAX: usize = 12;

/// A program of robots.
#[derive(Debug, Clone)]
pub struct Program {
    /// The path of the script from the folder of the scenario.
    pub script: String,
    /// True if ARGoS runs Buzz: only then has a robot an id.
    pub is_buzz: bool,
    /// The share of messages that a robot does not receive.
    pub loss: Option<f64>,
}

/// The controllers of an experiment.
pub struct Controllers<'a> {
    elements: BTreeMap<&'a str, Element<'a>>,
    folders: &'a ScriptFolders,
    /// The programs that robots have asked for, by their elements.
    programs: RefCell<HashMap<usize, Option<Program>>>,
    used: RefCell<HashSet<&'a str>>,
}

impl<'a> Controllers<'a> {
    pub fn read(root: Element<'a>, folders: &'a ScriptFolders) -> Self {
        let elements = root.first("controllers").into_iter().flat_map(Element::elements);
        let elements =
            elements.filter_map(|element| Some((element.required_name("id")?, element))).collect();
        Controllers { elements, folders, programs: RefCell::default(), used: RefCell::default() }
    }

    /// Returns the program of a robot; `None` after a mistake.
    pub fn program(&self, robot: Element<'a>) -> Option<Program> {
        let reference = robot.required("controller")?;
        let name = reference.required_name("config")?;
        let Some(controller) = self.elements.get(name) else {
            let known = self.elements.keys().filter(|name| name.len() <= KNOWN_BYTES_MAX);
            let known = known.take(KNOWN_MAX).map(|name| (*name).to_owned()).collect();
            let mistake = Mistake::NoController { name: name.to_owned(), known };
            reference.fail_at("config", mistake);
            return None;
        };
        self.used.borrow_mut().insert(name);
        // Parameters of the robot replace those of its controller.
        let params = reference.first("params");
        let key = params.unwrap_or(*controller).key();
        if let Some(known) = self.programs.borrow().get(&key) {
            return known.clone();
        }
        let params = params.or_else(|| controller.first("params"));
        let program = self.read_one(name, *controller, params);
        self.programs.borrow_mut().insert(key, program.clone());
        program
    }

    /// Lists the controllers of no robot: loop functions may place their robots.
    pub fn omit_unused(&self) {
        let used = self.used.borrow();
        for (name, controller) in self.elements.iter().filter(|(name, _)| !used.contains(*name)) {
            let bytecode =
                controller.all("params").find_map(|params| params.name_in("bytecode_file"));
            let script = bytecode.map(|bytecode| self.folders.script_of(bytecode).text);
            controller.omit(
                format!("controller `{name}`, which no imported robot has"),
                match script {
                    Some(script) => {
                        format!("add [[robots]] with the script `{script}` if it is needed")
                    }
                    None => "add [[robots]] with its script if it is needed".to_owned(),
                },
            );
        }
    }

    fn read_one(
        &self,
        name: &str,
        controller: Element<'a>,
        params: Option<Element<'a>>,
    ) -> Option<Program> {
        let kind = controller.name();
        let bytecode = params.and_then(|params| params.name_in("bytecode_file"));
        let is_buzz = bytecode.is_some() || kind.contains("buzz");
        let script = match bytecode.filter(|path| !path.trim().is_empty()) {
            Some(bytecode) => {
                let script = self.folders.script_of(bytecode);
                if !script.exists {
                    controller.omit(
                        format!("there is no script for `{bytecode}` of controller `{name}`"),
                        format!("copy it to `{}`, or change `script`", script.text),
                    );
                }
                script.text
            }
            None => self.unwritten(name, controller, params, is_buzz),
        };
        if is_buzz && !BUZZ.contains(&kind) {
            controller.omit(
                format!("functions that `{kind}` adds to Buzz"),
                "write a robot file with them: `bbz stubs` begins one from the script",
            );
        }
        if let Some(params) = params {
            omit_parameters(name, params, is_buzz);
        }
        let devices = ["sensors", "actuators"];
        let devices = devices.into_iter().filter_map(|part| controller.first(part));
        devices.flat_map(Element::elements).for_each(omit_noise);
        Some(Program { script, is_buzz, loss: loss(controller)? })
    }

    /// Returns the script that has to be written for a controller without one.
    fn unwritten(
        &self,
        name: &str,
        controller: Element<'a>,
        params: Option<Element<'a>>,
        is_buzz: bool,
    ) -> String {
        let script = self.folders.missing(&script::name_for(name));
        if is_buzz {
            if !script.exists {
                controller.omit(
                    format!("controller `{name}` has no `bytecode_file`"),
                    format!("write the script `{}`, or change `script`", script.text),
                );
            }
            return script.text;
        }
        let param = |attribute| params.and_then(|params| params.text(attribute));
        let source = match (param("behavior"), param("script"), controller.text("library")) {
            (Some(behavior), ..) => format!("the Kilobot program `{behavior}`"),
            (_, Some(script), _) => format!("the program `{script}`"),
            (.., Some(library)) => format!("code of the library `{library}`"),
            _ => "code of a plug-in".to_owned(),
        };
        let cure = match script.exists {
            true => format!("`{}` takes its place", script.text),
            false => format!("write its behavior as the script `{}`", script.text),
        };
        controller.omit(format!("controller `{name}` ({}) runs {source}", controller.name()), cure);
        script.text
    }
}

/// Returns the share of messages that a robot misses; `Some(None)` if the controller does not state
/// it, and `None` after a mistake.
fn loss(controller: Element<'_>) -> Option<Option<f64>> {
    let sensor = controller.first("sensors").and_then(|sensors| sensors.first("range_and_bearing"));
    let Some(sensor) = sensor else { return Some(None) };
    let names = ["packet_drop_prob", "loss_probability"];
    match names.into_iter().find(|name| sensor.text(name).is_some()) {
        Some(name) => sensor.optional_number(name, Allowed::Share),
        None => Some(None),
    }
}

/// Lists the parameters of a controller, except those that have a place in a scenario.
fn omit_parameters(name: &str, params: Element<'_>, is_buzz: bool) {
    let read = ["bytecode_file", "debug_file", "behavior", "script"];
    let own = params.attributes().filter(|(key, _)| !read.contains(key));
    let mut parameters: Vec<String> = own.map(|(key, value)| format!("{key} = {value}")).collect();
    for element in params.elements() {
        if is_buzz && element.name() == "wheel_turning" {
            omit_turning(name, element);
            continue;
        }
        let within = element.attributes();
        parameters.extend(within.map(|(key, value)| format!("{}.{key} = {value}", element.name())));
    }
    if parameters.is_empty() {
        return;
    }
    let further = parameters.len().saturating_sub(PARAMETERS_MAX);
    parameters.truncate(PARAMETERS_MAX);
    let further = if further > 0 { format!(" and {further} more") } else { String::new() };
    params.omit(
        format!("parameters of controller `{name}`: {}{further}", parameters.join(", ")),
        "make them globals of its script, which [[event]] and --set can change",
    );
}

fn omit_turning(name: &str, turning: Element<'_>) {
    let is_usual = |(key, usual): &(&'static str, f64)| match turning.number(key, Allowed::Any) {
        Some(number) => number == *usual,
        None => true,
    };
    let others = TURNING.iter().filter(|limit| !is_usual(limit));
    let others: Vec<String> = others
        .map(|(key, usual)| {
            format!("{key} = {} (usual {usual})", turning.text(key).unwrap_or_default())
        })
        .collect();
    if !others.is_empty() {
        turning.omit(
            format!("<wheel_turning> of controller `{name}`: {}", others.join(", ")),
            "give a copy of the robot's file such limits, and import with --robot KIND=FILE.toml",
        );
    }
}

/// Lists noise and bias of a sensor or an actuator, which the file of a robot states.
fn omit_noise(device: Element<'_>) {
    let is_zero = |value: &str| {
        value == "false" || value.split([':', ',']).all(|part| part.trim().parse() == Ok(0.0))
    };
    let noise = device
        .attributes()
        .filter(|(key, value)| (key.contains("noise") || key.contains("bias")) && !is_zero(value));
    let noise: Vec<String> = noise.map(|(key, value)| format!("{key} = {value}")).collect();
    if !noise.is_empty() {
        device.omit(
            format!("noise of <{}>: {}", device.name(), noise.join(", ")),
            "give a copy of the robot's file `noise`, and import with --robot KIND=FILE.toml",
        );
    }
}
