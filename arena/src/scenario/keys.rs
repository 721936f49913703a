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
/// The results of a run that are kept.
pub const OUTPUT: &str = "[output]";
/// The task for a class.
pub const ASSIGNMENT: &str = "[assignment]";

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

/// The keys of infrared, which measures distances and has a rate. The last two keys do not apply to
/// radios.
const IR_KEYS: &[SectionKey] = scenario_keys![
    "range" "number" "of the model" "largest distance at which a frame is heard, in mm; ir: from rim to rim, radio: from middle to middle",
    "loss" "0 to 1 or [near, far]" "of the model" "share of frames lost on each link: everywhere, or where robots touch and at the end of the range",
    "duplication" "0 to 1" "0" "share of frames that arrive twice",
    "reordering" "0 to 1" "0" "share of frames that come up to half a second later",
    "rate" "number" "of the preset" "frames that a robot can send in a second",
    "distance_error" "number" "of the preset" "standard deviation of measured distances in mm",
];

const RADIO_KEYS: &[SectionKey] = IR_KEYS.split_at(IR_KEYS.len() - 2).0;

/// Every section.
pub const SECTIONS: &[SectionKeys] = &[
    SectionKeys {
        name: ROOT,
        keys: scenario_keys![
            "world" "table" "" "the ground, light and time",
            "robots" "tables" "" "groups of robots; at least one",
            "body" "table" "of the models" "how the robots of a kind move",
            "medium" "table" "of the models" "what carries frames",
            "bridge" "table" "none" "what passes messages on between unlike media",
            "adversary" "tables" "none" "senders that disturb the swarm or deceive it",
            "event" "tables" "none" "what happens during the run",
            "expect" "tables" "none" "what must hold",
            "output" "table" "" "what is kept for pictures and recordings",
            "assignment" "table" "none" "what a class is to reach",
        ],
    },
    SectionKeys {
        name: WORLD,
        keys: scenario_keys![
            "size" "[width, height]" "" "the ground in mm; (0, 0) is its middle, x to the right, y up",
            "duration" "number" "" "seconds that are simulated",
            "seed" "integer" "1" "from which all chance comes",
            "obstacles" "list of tables" "none" "what no robot gets through",
            "lights" "list of lights" "none" "lamps: tables, or only their places as [x, y]",
            "ambient" "0 to 1023" "0" "light that is everywhere, as the sensor reads it",
        ],
    },
    SectionKeys {
        name: OBSTACLE,
        keys: scenario_keys![
            "at" "[x, y]" "" "centre of disc or box, in mm",
            "radius" "number" "" "a disc of that radius in mm",
            "size" "[width, height]" "" "a box along the axes, in mm",
            "from" "[x, y]" "" "a thin wall from here, in mm",
            "to" "[x, y]" "" "to here",
            "height" "number" "unlimited" "in mm; robots at this height or above get over it",
        ],
    },
    SectionKeys {
        name: LIGHT,
        keys: scenario_keys![
            "at" "[x, y]" "" "place in mm",
            "brightness" "0 to 1023" "1023" "reading of a robot next to it that looks at it",
        ],
    },
    SectionKeys {
        name: ROBOTS,
        keys: scenario_keys![
            "robot" "name or path" "" "name of a robot that ships, or a robot file (*.toml)",
            "script" "path" "" "what they run: .bzz, .bo or .bbi",
            "backend" "word" "vm" "what runs the script: vm, a virtual machine; firmware, the robot's own image in an emulator",
            "firmware" "path" "where cargo puts it" "backend = \"firmware\": what would be flashed (ELF; of an AVR also Intel hex)",
            "profile" "word" "that of the robot" "tiny, for a swarm with smaller robots in it, or full, on robots that have both",
            "on_fault" "word" "that of the robot" "an error of the script: restart, it starts again after a pause; stop, it stops until power-on",
            "clock_skew" "percent or [least, most]" "0" "by how much the clocks of their scripts are fast, or slow with a minus sign; with two numbers each robot has one between them",
            "brown_out_every" "number" "never" "mean time in seconds from one brown-out of a robot to the next",
            "count" "integer" "1" "how many; with `positions` as many as there are",
            "name" "string" "that of the robot" "how events and expectations name the group",
            "first_id" "0 to 65535" "after the last" "id of the first robot; the others follow",
            "placement" "word" "random" "grid, hexagonal, line, circle, random or list",
            "at" "[x, y]" "middle of the world" "centre of grid, hexagonal rows, circle or area, start of a line, in mm",
            "spacing" "number" "" "grid, hexagonal, line: from robot to robot in mm",
            "columns" "integer" "a square" "grid, hexagonal: robots in a row",
            "direction" "degrees" "0" "line: where it goes",
            "radius" "number" "" "circle: in mm",
            "area" "[width, height]" "the world" "random: the rectangle around `at`, in mm",
            "positions" "list of [x, y]" "" "list: where each robot starts, in mm",
            "heading" "degrees or \"random\"" "random" "where they look: 0 along x, anticlockwise",
            "body" "word" "that of the robot" "for a robot file: the name of the body ([body.NAME]) with which it moves and talks",
            "present" "true or false" "true" "false: they are not there until they `join`",
            "model" "table" "as [body] says" "how these robots move, where others of their kind move otherwise",
            "link" "table" "as [medium] says" "what becomes of the frames that these robots send",
        ],
    },
    SectionKeys {
        name: MEDIUM,
        keys: scenario_keys![
            "ir" "table" "" "infrared",
            "nrf24" "table" "" "nRF24L01+",
            "p2p" "table" "" "peer-to-peer packets of the nRF51",
            "rab" "table" "" "range and bearing, of robots that their file describes",
        ],
    },
    SectionKeys { name: IR, keys: IR_KEYS },
    SectionKeys { name: NRF24, keys: RADIO_KEYS },
    SectionKeys { name: P2P, keys: RADIO_KEYS },
    SectionKeys { name: RAB, keys: RADIO_KEYS },
    SectionKeys {
        name: BRIDGE,
        keys: scenario_keys![
            "at" "[x, y]" "middle of the world" "where its listening robot lies, in mm",
            "firmware" "path" "where cargo puts it" "what would be flashed to that robot (ELF)",
            "id" "0 to 65535" "65535" "as whom it passes on what does not say who sends it",
        ],
    },
    SectionKeys {
        name: ADVERSARY,
        keys: scenario_keys![
            "kind" "word" "" "jam, babble, replay, forged-clock, poison, invented-ids, held-fragments or same-id",
            "at" "[x, y]" "" "its place in mm",
            "height" "number" "0" "its height over the ground in mm",
            "group" "string" "the first" "name of the group whose link it uses and whose script it knows",
            "range" "number" "that of the group" "largest distance at which its frames are heard, in mm",
            "rate" "number" "10; jam: without a pause" "frames that it sends in a second",
            "id" "0 to 65535" "" "same-id: id of the robot in whose name it sends",
            "from" "number" "0" "when it begins, in seconds",
            "until" "number" "the end" "when it falls silent, in seconds",
        ],
    },
    SectionKeys {
        name: EVENT,
        keys: scenario_keys![
            "at" "number" "" "when, in seconds; before the robots act at that time",
            "fail" "robots" "" "they fail: no motor, no frame, no step, until they are restarted",
            "stop" "robots" "" "no motor, no frame, no step, until they resume",
            "resume" "robots" "" "stopped robots go on where they were",
            "restart" "robots" "" "they are switched off and on where they are: their scripts start again",
            "brown_out" "robots" "" "the supply of those that run fails for a moment: they are restarted",
            "load" "robots" "" "they get another `script`, and are switched off and on where they are",
            "script" "path" "" "load: .bzz, .bo or .bbi",
            "keep" "boolean" "false" "load: globals that hold numbers keep them, where the new script has numbers, too",
            "set" "robots" "" "a `global` of their scripts gets a `number`",
            "global" "string" "" "set: its name",
            "number" "number" "" "set: an integer, or a float with a point",
            "join" "robots" "" "robots that were not `present` come and start their scripts",
            "move" "robots" "" "they are moved",
            "to" "[x, y]" "" "move: where their middle comes to, in mm",
            "by" "[x, y]" "" "move: by how much, in mm",
            "heading" "degrees" "as before" "move: where they look then",
            "battery" "robots" "" "their batteries have this voltage from now on, whatever they do",
            "volts" "0 to 5" "" "battery: how many",
            "light" "light or list" "" "these lights take the place of those before",
            "loss" "0 to 1 or [near, far]" "" "the medium loses that share of all frames from now on",
            "medium" "word" "the only one" "loss: ir, nrf24, p2p or rab",
            "block" "[robots, robots]" "" "no frame gets from the ones to the others, nor back",
            "restore" "[robots, robots]" "" "the blocked links work again",
            "partition" "list of robots" "" "frames only get through inside of each part",
            "heal" "true" "" "the partition is over",
            "adversary" "table" "" "an adversary begins, with the keys of [[adversary]] but `from`",
        ],
    },
    SectionKeys {
        name: EXPECT,
        keys: scenario_keys![
            "name" "string" "its number" "what columns of tables call it: letters, digits and _",
            "at" "number" "" "must hold at that second",
            "within" "number" "" "must hold at some time up to that second",
            "always" "number or [from, to]" "" "must hold from that second on, or from one to another",
            "robots" "robots" "all" "which robots are looked at",
            "value" "quantity" "" "what of them",
            "of" "word or integer" "all" "how their values count together",
            "equals" "number or string" "" "the value is this",
            "differs" "number or string" "" "the value is not this",
            "below" "number" "" "the value is less",
            "above" "number" "" "the value is more",
            "between" "[low, high]" "" "the value is one of these or between",
            "exists" "true or false" "" "the value is not nil, or is nil",
            "tolerance" "number" "0" "by how much equal numbers may differ",
        ],
    },
    SectionKeys {
        name: OUTPUT,
        keys: scenario_keys![
            "every" "number" "1" "seconds between two samples of recordings and pictures",
            "plot" "list of quantities" "none" "quantities that `--svg` draws over time, and that `--csv` and the summary print",
        ],
    },
    SectionKeys {
        name: ASSIGNMENT,
        keys: scenario_keys![
            "title" "string" "" "its name",
            "text" "string" "empty" "what is to be done; an empty line begins a paragraph",
        ],
    },
];

/// Returns the name of the section `[medium.NAME]`.
pub(super) fn of_medium(name: &str) -> &'static str {
    [("ir", IR), ("nrf24", NRF24), ("p2p", P2P), ("rab", RAB)]
        .into_iter()
        .find(|(known, _)| *known == name)
        .map_or(MEDIUM, |(_, section)| section)
}

/// Returns the names of the keys of a section.
pub fn of(section: &str) -> Vec<&'static str> {
    let keys = SECTIONS.iter().find(|keys| keys.name == section).map_or(&[][..], |of| of.keys);
    keys.iter().map(|key| key.name).collect()
}
