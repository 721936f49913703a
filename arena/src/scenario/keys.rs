//! Every key of a scenario file. Files and the document are checked against these tables.

use std::ops::RangeInclusive;

/// A key of a section.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SectionKey {
    pub name: &'static str,
    /// The form of the value.
    pub takes: &'static str,
    /// The value that applies without the key; empty if the key is required, or if there is no such
    /// value.
    pub default: &'static str,
    /// The meaning of the value, with its unit.
    pub help: &'static str,
}

/// A section and its keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SectionKeys {
    /// The name of the section in errors.
    pub name: &'static str,
    /// The keys, in the order of the document.
    pub keys: &'static [SectionKey],
}

/// The top level of the file.
pub const ROOT: &str = "the file";
/// The ground, light and time.
pub const WORLD: &str = "[world]";
/// A painted part of the ground.
pub const PATCH: &str = "this patch of the ground";
/// An obstacle of the world.
pub const OBSTACLE: &str = "this obstacle";
/// A lamp.
pub const LIGHT: &str = "this light";
/// A group of robots.
pub const ROBOTS: &str = "this [[robots]]";
/// The models of the robots.
pub const BODY: &str = "[body]";
/// The media.
pub const MEDIUM: &str = "[medium]";
/// Infrared light.
pub const IR: &str = "[medium.ir]";
/// nRF24L01+ radio.
pub const NRF24: &str = "[medium.nrf24]";
/// Peer-to-peer packets of the nRF51.
pub const P2P: &str = "[medium.p2p]";
/// Range and bearing, the link of robots that their file describes.
pub const RAB: &str = "[medium.rab]";
/// The station that forwards messages between media.
pub const BRIDGE: &str = "[bridge]";
/// An adversary.
pub const ADVERSARY: &str = "this [[adversary]]";
/// An event.
pub const EVENT: &str = "this [[event]]";
/// A command: an event without its time.
pub const COMMAND: &str = "the command";
/// An expectation.
pub const EXPECT: &str = "this [[expect]]";
/// A measure.
pub const MEASURE: &str = "this [[measure]]";
/// The runs of a study.
pub const SWEEP: &str = "[sweep]";
/// A parameter of a study.
pub const SWEEP_PARAMETER: &str = "this [[sweep.parameter]]";
/// The results of a run that are kept.
pub const OUTPUT: &str = "[output]";
/// The tables of a run.
pub const DATA: &str = "[output.data]";
/// A file that stands in the scenario.
pub const FILE: &str = "this [[file]]";
/// The task for a class.
pub const ASSIGNMENT: &str = "[assignment]";
/// The task in French.
pub const ASSIGNMENT_FR: &str = "[assignment.fr]";

/// Makes a table of keys from the name, value, default and help of each.
#[macro_export]
macro_rules! scenario_keys {
    ($($name:literal $takes:literal $default:literal $help:literal),* $(,)?) => {
        &[$($crate::scenario::keys::SectionKey { name: $name, takes: $takes, default: $default, help: $help }),*]
    };
}

/// Radii of bodies in mm.
pub const RADIUS: RangeInclusive<f64> = 1.0..=10_000.0;

/// Standard deviations of motors' gains.
pub const GAIN_ERROR: RangeInclusive<f64> = 0.0..=1.0;

/// The keys of infrared, which measures distances and has a rate.
const IR_KEYS: &[SectionKey] = scenario_keys![
    "preset" "word" "that of the bodies" "experiment that gives range, edge and loss: ants2018, ants2018-long or icra2012",
    "range" "number" "117" "distance between the rims at which half of the frames are bright enough, in mm",
    "edge" "0 to 1000" "10" "half of the width of the range's edge in mm, over which reception falls from 90 % to a half; 0: the range ends sharply",
    "loss" "0 to 1 or [near, far]" "0.042" "share of lost frames on each link: one value for all distances, or for robots that touch and for the largest distance",
    "duplication" "0 to 1" "0" "share of frames that arrive twice",
    "reordering" "0 to 1" "0" "share of frames that arrive up to half a second late",
    "rate" "number" "2" "frames per second that a robot can send",
    "distance_error" "number" "2" "standard deviation of measured distances in mm",
    "clock_error" "0 to 10" "0.5" "standard deviation of the robots' oscillators in percent, by which scripts and frames count time",
];

/// The keys of radios, and of the link of described robots.
const RADIO_KEYS: &[SectionKey] = scenario_keys![
    "range" "number" "nrf24, p2p: no limit; rab: of the robot file" "largest distance of reception in mm, between the centers",
    "loss" "0 to 1 or [near, far]" "nrf24: [0.01, 0.02]; p2p: [0.01, 0.05]; rab: of the robot file" "share of lost frames on each link: one value for all distances, or for robots that touch and for the largest distance",
    "duplication" "0 to 1" "0" "share of frames that arrive twice",
    "reordering" "0 to 1" "0" "share of frames that arrive up to half a second late",
];

/// Every section.
pub const SECTIONS: &[SectionKeys] = &[
    SectionKeys {
        name: ROOT,
        keys: scenario_keys![
            "world" "table" "" "size of the ground, its paint, duration, obstacles and lights",
            "robots" "tables" "" "groups of robots; at least one",
            "body" "table" "of the models" "models of the bodies, for each kind of robot",
            "medium" "table" "of the models" "carriers of frames",
            "bridge" "table" "none" "station that forwards messages between different media",
            "adversary" "tables" "none" "senders that disturb or deceive the swarm",
            "event" "tables" "none" "changes during the run",
            "expect" "tables" "none" "conditions that must hold",
            "measure" "tables" "none" "numbers and times that tables have as columns",
            "output" "table" "" "data for pictures and recordings",
            "sweep" "table" "none" "values of keys that a batch of runs compares",
            "assignment" "table" "none" "task for a class",
            "file" "tables" "none" "files that stand in the scenario itself",
        ],
    },
    SectionKeys {
        name: WORLD,
        keys: scenario_keys![
            "size" "[width, height]" "" "size of the ground in mm; (0, 0) is its center, x points to the right, y up",
            "duration" "number" "" "simulated time in seconds",
            "seed" "integer" "1" "seed of all random numbers",
            "ground" "list of tables" "white" "painted discs and boxes, later ones over earlier ones",
            "obstacles" "list of tables" "none" "discs, boxes and walls that block robots, infrared and light",
            "lights" "list of lights" "none" "lamps: tables, or only their positions as [x, y]",
            "ambient" "0 to 1023" "0" "light everywhere, as a reading of the light sensor",
        ],
    },
    SectionKeys {
        name: PATCH,
        keys: scenario_keys![
            "at" "[x, y]" "" "center in mm",
            "radius" "number" "" "radius of a disc, in mm",
            "size" "[width, height]" "" "size of a box, in mm",
            "heading" "degrees" "0" "direction of the width of a box, counterclockwise from x",
            "brightness" "0 to 1" "0" "0 is black, 1 is white",
        ],
    },
    SectionKeys {
        name: OBSTACLE,
        keys: scenario_keys![
            "at" "[x, y]" "" "center of a disc or box, in mm",
            "radius" "number" "" "radius of a disc, in mm",
            "size" "[width, height]" "" "size of a box, in mm",
            "heading" "degrees" "0" "direction of the width of a box, counterclockwise from x",
            "from" "[x, y]" "" "start of a thin wall, in mm",
            "to" "[x, y]" "" "end of the wall, in mm",
            "height" "number" "unlimited" "height in mm; robots at this height or above pass over the obstacle",
            "movable" "true or false" "false" "true: robots push the obstacle, which must be a disc",
        ],
    },
    SectionKeys {
        name: LIGHT,
        keys: scenario_keys![
            "at" "[x, y]" "" "position in mm",
            "brightness" "0 to 1023" "1023" "reading of a robot that is next to the lamp and faces it",
        ],
    },
    SectionKeys {
        name: ROBOTS,
        keys: scenario_keys![
            "robot" "name or path" "" "name of a shipped robot, or path of a robot file (*.toml)",
            "script" "path" "" "script of these robots: .bzz, .bo or .bbi; none with `image`",
            "backend" "word" "vm" "vm: a virtual machine runs the script; firmware: the robot's own image runs it in an emulator",
            "firmware" "path" "output of cargo" "backend = \"firmware\": the image to flash (ELF; for an AVR also Intel HEX)",
            "image" "path" "none" "backend = \"firmware\": a foreign image for the robot's chip (ELF), which runs without a script",
            "door" "1 to 65535" "none" "image: UDP port at which ground stations reach the first robot; the others have the next ports",
            "profile" "word" "that of the robot" "for robots with both profiles: tiny, if the swarm also has smaller robots, or full",
            "on_fault" "word" "that of the robot" "after an error of the script: restart, it starts again after a pause; stop, it stops until power-on",
            "clock_skew" "percent or [least, most]" "random by `clock_error` on infrared, else 0" "error of the robots' clocks: positive is fast; with two numbers each robot has an error between them",
            "brown_out_every" "number" "never" "mean time between two brown-outs of a robot, in seconds",
            "count" "integer" "1" "number of robots; with `positions`, the number of positions",
            "name" "string" "name of the robot" "name of the group in events and expectations",
            "first_id" "0 to 65535" "after the last" "id of the first robot; the others follow",
            "placement" "word" "random" "grid, hexagonal, line, circle, random or list",
            "at" "[x, y]" "middle of the world" "center of the grid, hexagonal rows, circle or area; start of the line; in mm",
            "spacing" "number" "" "grid, hexagonal, line: distance between neighboring robots in mm",
            "columns" "integer" "a square" "grid, hexagonal: robots per row",
            "direction" "degrees" "0" "line: direction of the row",
            "radius" "number" "" "circle: radius in mm",
            "area" "[width, height]" "the world" "random: the rectangle around `at`, in mm",
            "positions" "list of [x, y] or [x, y, degrees]" "" "list: start position of each robot in mm, and its own heading instead of `heading`",
            "heading" "degrees or \"random\"" "random" "initial heading: 0 along x, counterclockwise",
            "body" "word" "that of the robot" "for a robot file: name of the model ([body.NAME]) for motion and messages",
            "present" "true or false" "true" "false: the robots are absent until they `join`",
            "model" "table" "see [body]" "settings of these robots that differ from [body]",
            "link" "table" "see [medium]" "settings of these robots' frames that differ from [medium]",
            "globals" "table of numbers" "those of the script" "numbers with which globals of the script begin, as { GROUP = 3 }",
            "settings" "list of words" "" "settings in the robots' flash, as `bbz flash --set` takes them: \"NAME=NUMBER\"",
        ],
    },
    SectionKeys {
        name: MEDIUM,
        keys: scenario_keys![
            "ir" "table" "" "infrared",
            "nrf24" "table" "" "nRF24L01+",
            "p2p" "table" "" "peer-to-peer packets of the nRF51",
            "rab" "table" "" "range and bearing, for robots that a robot file describes",
        ],
    },
    SectionKeys { name: IR, keys: IR_KEYS },
    SectionKeys { name: NRF24, keys: RADIO_KEYS },
    SectionKeys { name: P2P, keys: RADIO_KEYS },
    SectionKeys { name: RAB, keys: RADIO_KEYS },
    SectionKeys {
        name: BRIDGE,
        keys: scenario_keys![
            "at" "[x, y]" "middle of the world" "position of the listening robot, in mm",
            "firmware" "path" "output of cargo" "image to flash to the listening robot (ELF)",
            "id" "0 to 65535" "65535" "sender id for messages that do not name their sender",
        ],
    },
    SectionKeys {
        name: ADVERSARY,
        keys: scenario_keys![
            "kind" "word" "" "jam, babble, replay, forged-clock, poison, invented-ids, held-fragments or same-id",
            "at" "[x, y]" "" "position in mm",
            "height" "number" "0" "height over the ground in mm",
            "group" "string" "the first" "name of the group whose link it uses and whose script it knows",
            "range" "number" "that of the group" "largest distance of reception of its frames, in mm",
            "rate" "number" "10; jam: without a pause" "frames per second that it sends",
            "id" "0 to 65535" "" "same-id: id of the robot that it impersonates",
            "from" "number" "0" "start time in seconds",
            "until" "number" "the end" "end time in seconds",
        ],
    },
    SectionKeys {
        name: EVENT,
        keys: scenario_keys![
            "at" "number" "" "time in seconds; the event acts before the robots act at that time",
            "fail" "robots" "" "these robots fail: no motor, no frame and no step until a `restart`",
            "stop" "robots" "" "these robots stop: no motor, no frame and no step until a `resume`",
            "resume" "robots" "" "these stopped robots continue from their state",
            "restart" "robots" "" "these robots are switched off and on at their place: their scripts start again",
            "brown_out" "robots" "" "short failure of the power supply of these robots: those that run are restarted",
            "load" "robots" "" "these robots get another `script`, and are switched off and on at their place",
            "script" "path" "" "load: the script, .bzz, .bo or .bbi",
            "keep" "boolean" "false" "load: true keeps the value of a global that is a number in the old and the new script",
            "set" "robots" "" "these robots' scripts get another `number` in a `global`",
            "global" "string" "" "set: name of the global",
            "number" "number" "" "set: the new value; an integer, or a float with a decimal point",
            "numbers" "list of numbers" "" "set: instead of `number`, a new value for each robot, in the order of the scenario; `nan` keeps a robot's value",
            "call" "robots" "" "these robots' scripts call a `function` of theirs before the next step",
            "function" "string" "" "call: name of the function, which gets no arguments",
            "ask" "string" "" "`robots` evaluate this expression or call of their scripts between two steps, and log its value",
            "robots" "robots" "" "ask: the robots that evaluate it",
            "join" "robots" "" "these robots, which were not `present`, enter and start their scripts",
            "move" "robots" "" "these robots move to another place at once",
            "to" "[x, y]" "" "move: new center of these robots, in mm",
            "by" "[x, y]" "" "move: displacement of each robot, in mm; displace: that of their poses",
            "heading" "degrees" "unchanged" "move: new heading",
            "displace" "robots" "" "poses from outside of these robots are displaced `by` that much from now on",
            "relabel" "[robot, robot]" "" "the cameras take each of these two robots of one group, present from the start, for the other; a second time ends it",
            "battery" "robots" "" "the batteries of these robots have a constant voltage from now on",
            "volts" "0 to 5" "" "battery: the voltage in V",
            "light" "light or list" "" "these lights replace all earlier lights",
            "loss" "0 to 1 or [near, far]" "" "share of all frames that the medium loses from now on",
            "medium" "word" "the only one" "loss: ir, nrf24, p2p or rab",
            "block" "[robots, robots]" "" "no frame passes between the two lists of robots, in either direction",
            "restore" "[robots, robots]" "" "the blocked links between the two lists work again",
            "partition" "list of parts" "" "frames pass only within each part; [[0, 1], \"3..5\"] has two",
            "heal" "true" "" "the partition ends",
            "adversary" "table" "" "an adversary begins, with the keys of [[adversary]] except `from`",
        ],
    },
    SectionKeys {
        name: EXPECT,
        keys: scenario_keys![
            "name" "string" "its number" "name in columns of tables: letters, digits and _",
            "at" "number" "" "the condition must hold at this time, in seconds",
            "within" "number" "" "it must hold at some time up to this one",
            "always" "number or [from, to]" "" "it must hold from this time on, or from one time to another",
            "robots" "robots" "all" "robots whose values are checked",
            "value" "quantity" "" "quantity that is compared",
            "of" "word or integer" "all" "combination of the values of several robots",
            "equals" "number or string" "" "the value is equal to this one",
            "differs" "number or string" "" "the value differs from this one",
            "below" "number" "" "the value is less than this one",
            "above" "number" "" "the value is greater than this one",
            "between" "[low, high]" "" "the value lies between these two or equals one of them",
            "exists" "true or false" "" "true: the value is not nil; false: it is nil",
            "tolerance" "number" "0" "largest difference between numbers that count as equal",
        ],
    },
    SectionKeys {
        name: MEASURE,
        keys: scenario_keys![
            "name" "string" "" "name of the column: letters, digits and _",
            "value" "quantity" "" "quantity that is measured, or compared",
            "of" "word or integer" "all" "combination of the values of several robots",
            "at" "number or \"end\"" "see below" "time of the measure, in seconds",
            "robots" "robots" "all" "robots whose values are measured",
            "equals" "number or string" "" "the value is equal to this one",
            "differs" "number or string" "" "the value differs from this one",
            "below" "number" "" "the value is less than this one",
            "above" "number" "" "the value is greater than this one",
            "between" "[low, high]" "" "the value lies between these two or equals one of them",
            "exists" "true or false" "" "true: the value is not nil; false: it is nil",
            "tolerance" "number" "0" "largest difference between numbers that count as equal",
        ],
    },
    SectionKeys {
        name: OUTPUT,
        keys: scenario_keys![
            "every" "number" "1" "seconds between two samples of recordings and pictures",
            "plot" "list of quantities" "none" "quantities whose curves `--svg` and the page draw, and that `--csv` and the summary print",
            "data" "table" "as without keys" "columns of the tables that `--data` writes",
        ],
    },
    SectionKeys {
        name: DATA,
        keys: scenario_keys![
            "quantities" "list of quantities" "[\"x\", \"y\", \"heading\", \"led\", \"running\"]" "columns of the table of robots",
            "every" "number" "that of [output]" "seconds between two rows of a robot",
            "messages" "true or false" "false" "true: also a table of all frames and their fates, which may be large",
        ],
    },
    SectionKeys {
        name: SWEEP,
        keys: scenario_keys![
            "design" "word" "grid" "points of the values: grid, all combinations; list, values of equal position; random or latin-hypercube, drawn",
            "chance" "word" "" "random numbers: common, all points have the same seeds; independent, each point has its own",
            "seeds" "integer" "1" "runs of each point; `--runs` replaces it",
            "points" "integer" "" "random, latin-hypercube: number of points",
            "seed" "integer" "1" "random, latin-hypercube: seed of the draws",
            "parameter" "tables" "" "keys that vary; at least one",
        ],
    },
    SectionKeys {
        name: SWEEP_PARAMETER,
        keys: scenario_keys![
            "key" "string" "" "key of this file, as `--set` takes it",
            "name" "string" "see below" "name of the column: letters, digits and _",
            "values" "list or \"FIRST:LAST:STEP\"" "" "values; of random and latin-hypercube, those to draw from",
            "from" "number" "" "random, latin-hypercube: smallest value; integers are drawn if both ends are integers",
            "to" "number" "" "random, latin-hypercube: largest value",
        ],
    },
    SectionKeys {
        name: ASSIGNMENT,
        keys: scenario_keys![
            "title" "string" "" "title of the task",
            "text" "string" "empty" "description of the task; an empty line begins a paragraph",
            "fr" "table" "none" "the task in French, for readers whose page is in French",
        ],
    },
    SectionKeys {
        name: ASSIGNMENT_FR,
        keys: scenario_keys![
            "title" "string" "" "title of the task in French",
            "text" "string" "empty" "description of the task in French",
        ],
    },
    SectionKeys {
        name: FILE,
        keys: scenario_keys![
            "path" "path" "" "path of a script, an included file or a robot file, from the folder of the scenario",
            "text" "string" "" "content of the file",
        ],
    },
];

/// Returns the name of the section `[medium.NAME]`.
pub(super) fn of_medium(name: &str) -> &'static str {
    let known = [("ir", IR), ("nrf24", NRF24), ("p2p", P2P), ("rab", RAB)];
    let (_, section) =
        known.into_iter().find(|(known, _)| *known == name).expect("a medium's name");
    section
}

/// Returns the names of the keys of a section; none for a section that only models have.
pub fn names_in(section: &str) -> Vec<&'static str> {
    let keys = SECTIONS.iter().find(|keys| keys.name == section).map_or(&[][..], |of| of.keys);
    keys.iter().map(|key| key.name).collect()
}
