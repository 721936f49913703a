//! Reads and checks a robot file. All mistakes are found in one pass.

mod body;
mod effect;
mod value;

use std::collections::{HashMap, HashSet};
use std::ops::RangeInclusive;

use bittybuzz_toml_reader::{self as toml_reader, SourceText};
use bittybuzz_vm_core::builtin::{self, Library};
use bittybuzz_vm_core::message::{FULL_FRAME, TINY_FRAME};
use bittybuzz_vm_core::{Parts, Periods};

use crate::error::{RobotErrors, RobotFileCause};
use crate::generate::constant;
use crate::layout::{Layout, PLACE, Region};
use crate::signature::{self, Parameter, SignatureType};
use crate::value::{ValuePath, table_of};
use crate::{
    Budget, Indicator, LONG_MAX, Medium, NumberProfile, OnFault, Robot, RobotFunction, SensorTable,
    Setting, VmSizes, name_hash,
};
use body::{BODY, SENSOR, STEERING, SensorNames};
use effect::{SETS, STEERS};

/// Words that a script cannot use as a name. `include` is a keyword only before a string, but would
/// be confusing.
const KEYWORDS: &[&str] = &[
    "var", "if", "else", "function", "return", "for", "while", "and", "or", "not", "nil", "include",
];

/// The global that holds the robot's id.
const ID: &str = "id";

type Section<'a> = toml_reader::Section<'a, RobotFileCause>;
type Entry<'a> = toml_reader::TomlEntry<'a, RobotFileCause>;

const ROOT: &str = "the file";
const VM: &str = "[vm]";
const BUDGET: &str = "[budget]";
const LAYOUT: &str = "[layout]";
const REGION: &str = "the region";
const FUNCTION: &str = "this [[function]]";
const TABLE: &str = "this [[table]]";
const SETTING: &str = "this [[setting]]";
const INDICATOR: &str = "this [[indicator]]";
const VALUE: &str = "this [[value]]";

/// The keys of each section.
fn keys(section: &'static str) -> Vec<&'static str> {
    let keys: &[&str] = match section {
        BODY => return body::body_keys(),
        SENSOR => return body::sensor_keys(),
        SETS => return effect::sets_keys(),
        STEERING => &body::STEERING_KEYS,
        STEERS => &effect::STEERS_KEYS,
        ROOT => &[
            "name",
            "title",
            "chip",
            "profile",
            "tick_hz",
            "message_bytes",
            "link",
            "on_fault",
            "vm",
            "budget",
            "layout",
            "function",
            "table",
            "setting",
            "indicator",
            "value",
            "body",
            "sensor",
        ],
        VM => &[
            "memory",
            "slots",
            "neighbors",
            "bearings",
            "in_queue",
            "out_queue",
            "in_long",
            "out_long",
            "stigmergy_entries",
            "swarms",
            "maths",
            "beacon_steps",
            "forget_steps",
            "advertise_steps",
        ],
        BUDGET => &["flash_bytes", "ram_bytes"],
        LAYOUT => &[
            "application",
            "script",
            "script_log",
            "script_sealed",
            "ram",
            "stack",
            "id",
            "settings",
        ],
        REGION => &["address", "size"],
        FUNCTION => {
            &["name", "accepts", "returns", "waits", "help", "sets", "steers", "reads", "logs"]
        }
        TABLE => &["name", "fields", "help"],
        SETTING => &["name", "least", "most", "help"],
        INDICATOR => &["shows", "means"],
        VALUE => &["name", "is", "reads", "curve", "returns", "count", "help"],
        _ => &[],
    };
    keys.to_vec()
}

/// The keys, words and quantities that describe a robot for the simulator.
#[cfg(test)]
pub fn simulator_keys() -> Vec<&'static str> {
    let keys = [BODY, STEERING, SENSOR, SETS, STEERS, VALUE].into_iter().flat_map(keys);
    keys.chain(body::words()).collect()
}

/// Reads the text of a robot file.
pub fn robot(text: &str, path: &str) -> Result<Robot, RobotErrors> {
    let source = SourceText::new(path, text);
    toml_reader::read(&source, &[], (ROOT, &keys), root).map_err(RobotErrors)
}

fn root(root: &Section<'_>) -> Option<Robot> {
    let name = robot_name(root);
    let chip = root.get("chip").map(|entry| one_line(&entry));
    // A robot without a chip exists only as a description. Its memory costs nothing, so there are
    // sensible defaults.
    let may_lack = |key| chip.is_none() && root.get(key).is_none();
    let title = if may_lack("title") { name.clone() } else { line(root, "title") };
    let profile = match may_lack("profile") {
        true => Some(NumberProfile::Full),
        false => root.required("profile").and_then(|entry| entry.word(&PROFILES)),
    };
    let tick_hz = match may_lack("tick_hz") {
        true => Some(DEFAULT_TICK_HZ),
        false => integer(root, "tick_hz", 1..=100),
    };
    let least_bytes = message_bytes(profile.unwrap_or(NumberProfile::Tiny));
    let message_bytes = match may_lack("message_bytes") {
        true => Some(least_bytes),
        false => integer(root, "message_bytes", least_bytes..=255),
    };
    let link = match may_lack("link") {
        true => Some(Some(Medium::RangeAndBearing)),
        false => root.get("link").map(|entry| entry.word(&Medium::WORDS)),
    };
    let on_fault = root.get("on_fault").map(|entry| entry.word(&OnFault::WORDS));
    let vm_section = match may_lack("vm") {
        true => None,
        false => required_section(root, "vm", VM),
    };
    let has_memory = |section: &Section<'_>| section.get("memory").is_some();
    let has_default_sizes = chip.is_none() && !vm_section.as_ref().is_some_and(has_memory);
    let vm = match &vm_section {
        None => has_default_sizes.then_some(DEFAULT_SIZES),
        Some(section) if has_default_sizes => Some(sizes_of_computer(section)),
        Some(section) => vm_sizes(section),
    };
    let budget = root.section("budget", BUDGET).map(|section| budget(&section));
    let layout_section = root.section("layout", LAYOUT);
    let layout = layout_section.as_ref().map(layout);

    let mut names = Names::default();
    let tables = root.sections("table", TABLE);
    let tables: Vec<_> = tables.iter().map(|section| sensor_table(section, &mut names)).collect();
    let body_section = root.section("body", BODY);
    let drive = body_section.as_ref().map(body::drive);
    let mut sensor_names = SensorNames::default();
    let sensors = root.sections("sensor", SENSOR);
    if let (None, Some(sensor)) = (&drive, sensors.first()) {
        sensor.fail(RobotFileCause::NoBody { key: "sensor" });
    }
    let sensors: Vec<_> =
        sensors.iter().map(|section| body::sensor(section, &mut sensor_names)).collect();
    let functions = root.sections("function", FUNCTION);
    let function = |section| {
        let mut function = function(section, &mut names)?;
        match drive {
            Some(drive) => {
                function.effect = Some(effect::effect(section, &function, drive, &sensors)?);
            }
            None => effect::refuse(section),
        }
        Some(function)
    };
    let functions: Vec<_> = functions.iter().map(function).collect();
    let values = root.sections("value", VALUE);
    if let (None, Some(value)) = (&drive, values.first()) {
        value.fail(RobotFileCause::NoBody { key: "value" });
    }
    let mut lists = value::Lists::default();
    let values: Vec<_> = values
        .iter()
        .map(|section| value::value(section, &mut names, &mut lists, &sensors))
        .collect();
    let settings = root.sections("setting", SETTING);
    let settings: Vec<_> = settings.iter().map(|section| setting(section, &mut names)).collect();
    if let Some(layout) = &layout_section
        && !settings.is_empty()
    {
        layout.required("settings");
    }

    let indicators = root.sections("indicator", INDICATOR);
    let indicators: Vec<_> = indicators.iter().map(indicator).collect();

    let body = body_section.map(|section| body::body(&section, drive.flatten()));
    let (values, readers): (Vec<_>, Vec<_>) =
        values.into_iter().collect::<Option<Vec<_>>>()?.into_iter().unzip();
    let mut functions: Vec<RobotFunction> = functions.into_iter().collect::<Option<_>>()?;
    functions.extend(readers.into_iter().flatten());
    let mut robot = Robot {
        name: name?,
        title: title?,
        chip: given(chip)?,
        profile: profile?,
        tick_hz: tick_hz?,
        message_bytes: message_bytes?,
        link: given(link)?,
        on_fault: given(on_fault)?.unwrap_or_default(),
        vm: vm?,
        parts: Parts::ALL,
        budget: given(budget)?,
        layout: given(layout)?,
        functions,
        values,
        tables: tables.into_iter().collect::<Option<_>>()?,
        settings: settings.into_iter().collect::<Option<_>>()?,
        indicators: indicators.into_iter().collect::<Option<_>>()?,
        body: given(body)?,
        sensors: sensors.into_iter().collect::<Option<_>>()?,
    };
    if has_default_sizes {
        robot.vm.memory = robot.least_memory();
    }
    let (slots, most) = (robot.vm.slots, robot.most_slots());
    if slots > most {
        let (slot_bytes, memory, least) =
            (robot.slot_bytes(), robot.vm.memory, robot.least_memory());
        let cause = RobotFileCause::TooManySlots { slots, slot_bytes, memory, most, least };
        vm_section?.get("slots")?.fail(cause);
        return None;
    }
    Some(robot)
}

/// Turns an optional result inside out. `Some(None)` stands for a key that was left out,
/// `Some(Some(_))` for a correct value, and `None` for a mistake.
fn given<T>(value: Option<Option<T>>) -> Option<Option<T>> {
    match value {
        None => Some(None),
        Some(None) => None,
        right => Some(right.flatten()),
    }
}

const DEFAULT_TICK_HZ: u32 = 10;

/// Sizes of the machine of a robot that has neither a chip nor a `memory`. They are those of a
/// computer, whose memory is used on demand, and the `memory` is computed from them.
const DEFAULT_SIZES: VmSizes = VmSizes {
    memory: 0,
    slots: 10_000,
    neighbors: NEIGHBORS_MAX,
    bearings: true,
    in_queue: QUEUED_MAX,
    out_queue: QUEUED_MAX,
    in_long: LONG_MAX,
    out_long: LONG_MAX,
    stigmergy_entries: 4000,
    swarms: SWARMS_MAX,
    maths: true,
    beacon_steps: Periods::DEFAULT.beacon as u32,
    forget_steps: Periods::DEFAULT.forget as u32,
    advertise_steps: Periods::DEFAULT.advertise as u32,
};

const PROFILES: [(&str, NumberProfile); 2] = [
    (NumberProfile::Tiny.name(), NumberProfile::Tiny),
    (NumberProfile::Full.name(), NumberProfile::Full),
];

fn robot_name(root: &Section<'_>) -> Option<String> {
    let entry = root.required("name")?;
    let name = one_line(&entry)?;
    if !is_robot_name(&name) {
        entry.fail(RobotFileCause::BadRobotName { name });
        return None;
    }
    Some(name)
}

/// The largest number of slots of a machine.
const SLOTS_MAX: u32 = bittybuzz_vm_core::SLOTS_MAX as u32;
const NEIGHBORS_MAX: u32 = u8::MAX as u32;
const SWARMS_MAX: u32 = 8;
/// The longest queue of a robot without a chip, and of a simulated robot.
const QUEUED_MAX: u32 = crate::QUEUED_MAX;
/// The largest number of entries of a robot with a chip, and of one without.
const CHIP_ENTRIES_MAX: u32 = 255;
const ENTRIES_MAX: u32 = bittybuzz_vm_core::ENTRIES_MAX as u32;

/// Reads the sizes of a machine on a computer, where every key may be left out.
fn sizes_of_computer(vm: &Section<'_>) -> VmSizes {
    let usual = DEFAULT_SIZES;
    let size = |key, range: RangeInclusive<u32>, usual| vm.integer(key, range).unwrap_or(usual);
    VmSizes {
        memory: usual.memory,
        slots: size("slots", 32..=SLOTS_MAX, usual.slots),
        neighbors: size("neighbors", 0..=NEIGHBORS_MAX, usual.neighbors),
        bearings: vm.boolean("bearings").unwrap_or(usual.bearings),
        in_queue: size("in_queue", 1..=QUEUED_MAX, usual.in_queue),
        out_queue: size("out_queue", 1..=QUEUED_MAX, usual.out_queue),
        in_long: size("in_long", 0..=LONG_MAX, usual.in_long),
        out_long: size("out_long", 0..=LONG_MAX, usual.out_long),
        stigmergy_entries: size("stigmergy_entries", 0..=ENTRIES_MAX, usual.stigmergy_entries),
        swarms: size("swarms", 0..=SWARMS_MAX, usual.swarms),
        maths: vm.boolean("maths").unwrap_or(usual.maths),
        beacon_steps: size("beacon_steps", BEACON_STEPS, usual.beacon_steps),
        forget_steps: size("forget_steps", FORGET_STEPS, usual.forget_steps),
        advertise_steps: size("advertise_steps", ADVERTISE_STEPS, usual.advertise_steps),
    }
}

const BEACON_STEPS: RangeInclusive<u32> = 1..=255;
const FORGET_STEPS: RangeInclusive<u32> = 1..=126;
const ADVERTISE_STEPS: RangeInclusive<u32> = 2..=150;

fn vm_sizes(vm: &Section<'_>) -> Option<VmSizes> {
    let steps = |key, range: RangeInclusive<u32>, usual: u8| {
        vm.integer(key, range).unwrap_or(u32::from(usual))
    };
    let memory = integer(vm, "memory", 256..=262_144);
    let slots = integer(vm, "slots", 32..=SLOTS_MAX);
    let neighbors = integer(vm, "neighbors", 0..=NEIGHBORS_MAX);
    let in_queue = integer(vm, "in_queue", 1..=255);
    let out_queue = integer(vm, "out_queue", 1..=255);
    let long = |key| vm.integer(key, 0..=LONG_MAX).unwrap_or(1);
    let stigmergy_entries = integer(vm, "stigmergy_entries", 0..=CHIP_ENTRIES_MAX);
    let swarms = integer(vm, "swarms", 0..=SWARMS_MAX);
    let bearings = vm.boolean("bearings").unwrap_or(true);
    let maths = vm.boolean("maths").unwrap_or(true);
    let beacon_steps = steps("beacon_steps", BEACON_STEPS, Periods::DEFAULT.beacon);
    let forget_steps = steps("forget_steps", FORGET_STEPS, Periods::DEFAULT.forget);
    let advertise_steps = steps("advertise_steps", ADVERTISE_STEPS, Periods::DEFAULT.advertise);
    Some(VmSizes {
        memory: memory?,
        slots: slots?,
        neighbors: neighbors?,
        bearings,
        in_queue: in_queue?,
        out_queue: out_queue?,
        in_long: long("in_long"),
        out_long: long("out_long"),
        stigmergy_entries: stigmergy_entries?,
        swarms: swarms?,
        maths,
        beacon_steps,
        forget_steps,
        advertise_steps,
    })
}

fn budget(section: &Section<'_>) -> Option<Budget> {
    let flash_bytes = integer(section, "flash_bytes", 1024..=16_777_216);
    let ram_bytes = integer(section, "ram_bytes", 256..=16_777_216);
    Some(Budget { flash_bytes: flash_bytes?, ram_bytes: ram_bytes? })
}

/// Returns the bytes of the longest message after its type.
fn message_bytes(profile: NumberProfile) -> u32 {
    let frame = match profile {
        NumberProfile::Tiny => TINY_FRAME,
        NumberProfile::Full => FULL_FRAME,
    };
    frame as u32 - 1
}

/// Vector tables of ARM's M profile are aligned to the next power of two of their size, here 128
/// words (ARMv7-M B3.2.5, register VTOR). This is enough for the other regions.
const ALIGNMENT: u32 = 512;

fn layout(section: &Section<'_>) -> Option<Layout> {
    let required = |key| required_section(section, key, REGION).map(|found| region(&found));
    let optional = |key| section.section(key, REGION).map(|found| region(&found));
    let [application, script, ram] = ["application", "script", "ram"].map(required);
    let [stack, id, settings] = ["stack", "id", "settings"].map(optional);
    let regions = [
        ("application", application),
        ("script", script),
        ("ram", ram),
        ("stack", stack),
        ("id", id),
        ("settings", settings),
    ];
    let regions = regions.into_iter().filter_map(|(key, region)| Some((key, region.flatten()?)));
    let regions: Vec<(&'static str, Region)> = regions.collect();
    for (index, (key, region)) in regions.iter().copied().enumerate() {
        let mut before = regions.iter().take(index);
        if let Some((other, _)) = before.find(|(_, other)| other.overlaps(region)) {
            section.get(key)?.fail(RobotFileCause::Overlap { key, other });
        }
    }
    let script_log = section.boolean("script_log").unwrap_or(false);
    if let (true, Some(Some(Region { size, .. }))) = (script_log, script)
        && !size.is_multiple_of(2 * PLACE)
    {
        section.get("script_log")?.fail(RobotFileCause::BadLog { size, unit: 2 * PLACE });
    }
    Some(Layout {
        application: application??,
        script: script??,
        script_log,
        script_sealed: section.boolean("script_sealed").unwrap_or(false),
        ram: ram??,
        stack: given(stack)?,
        id: given(id)?,
        settings: given(settings)?,
    })
}

fn region(region: &Section<'_>) -> Option<Region> {
    let address = integer(region, "address", 0..=u32::MAX - ALIGNMENT);
    if let Some(address) = address
        && !address.is_multiple_of(ALIGNMENT)
    {
        region.get("address")?.fail(RobotFileCause::Unaligned { address, to: ALIGNMENT });
        return None;
    }
    let size = integer(region, "size", ALIGNMENT..=u32::MAX - address.unwrap_or(0));
    Some(Region { address: address?, size: size? })
}

/// The largest value of a setting, which has 16 bits.
const SETTING_MAX: u32 = u16::MAX as u32;

fn function(section: &Section<'_>, names: &mut Names) -> Option<RobotFunction> {
    let name = section.required("name").and_then(|entry| {
        let name = function_name(&entry)?;
        names.add_function(&entry, &name).then_some(name)
    });
    let accepts = section.required("accepts").and_then(|entry| argument_lists(&entry));
    let returns = section.get("returns").map(|entry| {
        let found = SignatureType::from_name(entry.string()?);
        found.map_err(|cause| entry.fail(cause)).ok()
    });
    let waits = section.boolean("waits").unwrap_or(false);
    let help = line(section, "help");
    Some(RobotFunction {
        name: name?,
        accepts: accepts?,
        returns: given(returns)?,
        waits,
        help: help?,
        effect: None,
    })
}

fn sensor_table(section: &Section<'_>, names: &mut Names) -> Option<SensorTable> {
    let name = section.required("name").and_then(|entry| {
        let name = name_of(&entry)?;
        names.add_table(&entry, &name).then_some(name)
    });
    let fields = section.required("fields").and_then(|entry| {
        let fields = parameters(&entry)?;
        if fields.is_empty() {
            entry.fail(RobotFileCause::NoFields);
            return None;
        }
        if let Some(field) = fields.last().filter(|field| field.is_repeated) {
            entry.fail(RobotFileCause::RepeatedField { field: field.to_string() });
            return None;
        }
        if let Some(field) = fields.iter().find(|field| field.range.is_some()) {
            entry.fail(RobotFileCause::RangeOfField { field: field.to_string() });
            return None;
        }
        Some(fields)
    });
    let help = line(section, "help");
    Some(SensorTable { name: name?, fields: fields?, help: help? })
}

fn setting(section: &Section<'_>, names: &mut Names) -> Option<Setting> {
    let name = section.required("name").and_then(|entry| {
        let name = name_of(&entry)?;
        names.add(&entry, &name, false).then_some(name)
    });
    let least = integer(section, "least", 0..=SETTING_MAX);
    let most = integer(section, "most", least.unwrap_or(0)..=SETTING_MAX);
    let help = line(section, "help");
    Some(Setting { name: name?, least: least? as u16, most: most? as u16, help: help? })
}

fn indicator(section: &Section<'_>) -> Option<Indicator> {
    let [shows, means] = ["shows", "means"].map(|key| line(section, key));
    Some(Indicator { shows: shows?, means: means? })
}

/// Returns true for a lower-case word that is valid as the name of a robot on the command line.
pub fn is_robot_name(name: &str) -> bool {
    name.starts_with(|first: char| first.is_ascii_lowercase())
        && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-')
}

fn integer(section: &Section<'_>, key: &'static str, range: RangeInclusive<u32>) -> Option<u32> {
    section.required(key)?.integer(range)
}

fn required_section<'a>(
    section: &Section<'a>,
    key: &'static str,
    name: &'static str,
) -> Option<Section<'a>> {
    section.required(key)?.section(name)
}

fn line(section: &Section<'_>, key: &'static str) -> Option<String> {
    one_line(&section.required(key)?)
}

/// Reads a string of one line that is not blank.
fn one_line(entry: &Entry<'_>) -> Option<String> {
    let text = entry.string()?;
    if text.trim().is_empty() || text.contains(char::is_control) {
        entry.fail(RobotFileCause::NotOneLine { key: entry.key.clone() });
        return None;
    }
    Some(text.to_owned())
}

/// Reads a name that is an identifier in scripts.
fn name_of(entry: &Entry<'_>) -> Option<String> {
    let name = entry.string()?.to_owned();
    if !signature::is_identifier(&name) {
        entry.fail(RobotFileCause::BadIdentifier { name });
        return None;
    }
    Some(name)
}

/// Reads the name of a function, which may stand in tables: `debug.print`.
fn function_name(entry: &Entry<'_>) -> Option<String> {
    let name = entry.string()?.to_owned();
    if !name.split('.').all(signature::is_identifier) {
        entry.fail(RobotFileCause::BadIdentifier { name });
        return None;
    }
    Some(name)
}

fn parameters(entry: &Entry<'_>) -> Option<Vec<Parameter>> {
    let list = signature::parse_list(entry.string()?);
    list.map_err(|(part, cause)| entry.fail_within(part, cause)).ok()
}

fn argument_lists(entry: &Entry<'_>) -> Option<Vec<Vec<Parameter>>> {
    let items = entry.list()?;
    if items.is_empty() {
        entry.fail(RobotFileCause::AcceptsNothing);
        return None;
    }
    let mut kinds = HashSet::new();
    let lists = items.iter().map(|item| {
        let list = parameters(item)?;
        let types = list.iter().map(|parameter| (parameter.kind, parameter.is_repeated));
        if !kinds.insert(types.collect::<Vec<_>>()) {
            item.fail(RobotFileCause::RepeatedList);
            return None;
        }
        Some(list)
    });
    // All lists are read, so that every mistake is found.
    let lists: Vec<Option<Vec<Parameter>>> = lists.collect();
    lists.into_iter().collect()
}

/// The names that the file has defined up to here.
#[derive(Default)]
struct Names {
    /// The line of each name.
    defined: HashMap<String, usize>,
    /// The tables that names stand in, with the line of the first.
    tables: HashMap<String, usize>,
    /// The functions by their name hash; `constants` has them by their constant in generated code.
    hashes: HashMap<u16, String>,
    constants: HashMap<String, String>,
}

impl Names {
    fn add_table(&mut self, entry: &Entry<'_>, name: &str) -> bool {
        // The language reserves `pos` for the table that some robots keep.
        let position = Library::Position.global_name() == Some(name);
        self.add(entry, name, is_reserved(name) && !position)
    }

    fn add_function(&mut self, entry: &Entry<'_>, name: &str) -> bool {
        if !self.add_in_table(entry, name) {
            return false;
        }
        let constant = constant(name);
        let cause = if let Some(other) = self.hashes.get(&name_hash(name)) {
            RobotFileCause::HashCollision { name: name.to_owned(), other: other.clone() }
        } else if let Some(other) = self.constants.get(&constant) {
            RobotFileCause::ConstantCollision {
                name: name.to_owned(),
                other: other.clone(),
                constant,
            }
        } else {
            self.hashes.insert(name_hash(name), name.to_owned());
            self.constants.insert(constant, name.to_owned());
            return true;
        };
        entry.fail(cause);
        false
    }

    /// Adds a value. A value that changes is also the name of the function that reads it.
    fn add_value(&mut self, entry: &Entry<'_>, path: &ValuePath, changes: bool) -> bool {
        match changes {
            true => self.add_function(entry, path.text()),
            false => self.add_in_table(entry, path.text()),
        }
    }

    /// Adds a name that may stand in a table, such as `debug.print`. A table that holds names is no
    /// name of anything else.
    fn add_in_table(&mut self, entry: &Entry<'_>, name: &str) -> bool {
        if !self.add(entry, name, is_reserved(table_of(name))) {
            return false;
        }
        let line = entry.place().line;
        let ends = name.match_indices(['.', '[']).map(|(end, _)| &name[..end]);
        for table in ends {
            if let Some(line) = self.defined.get(table) {
                let cause = RobotFileCause::NameIsTable { name: table.to_owned(), line: *line };
                entry.fail(cause);
                return false;
            }
            self.tables.entry(table.to_owned()).or_insert(line);
        }
        true
    }

    /// Adds a name. Reports a name that cannot be used, and then returns false.
    fn add(&mut self, entry: &Entry<'_>, name: &str, reserved: bool) -> bool {
        if reserved {
            entry.fail(RobotFileCause::Reserved { name: name.to_owned() });
            return false;
        }
        if let Some(line) = self.defined.get(name) {
            entry.fail(RobotFileCause::DuplicateName { name: name.to_owned(), line: *line });
            return false;
        }
        if let Some(line) = self.tables.get(name) {
            entry.fail(RobotFileCause::NameIsTable { name: name.to_owned(), line: *line });
            return false;
        }
        self.defined.insert(name.to_owned(), entry.place().line);
        true
    }
}

fn is_reserved(name: &str) -> bool {
    KEYWORDS.contains(&name)
        || name == ID
        || builtin::find(Library::Global, name).is_some()
        || Library::ALL.iter().any(|library| library.global_name() == Some(name))
}
