//! Reads a robot file and checks everything that it says.

use bittybuzz_vm_core::message::{FULL_FRAME, TINY_FRAME};
use bittybuzz_vm_core::{Parts, Periods};

use crate::error::{Cause, Place, RobotError};
use crate::generate::constant;
use crate::layout::{Layout, Region};
use crate::signature::{self, Parameter, Type};
use crate::{Budget, Function, Profile, Robot, SensorTable, Setting, VmSizes, name_hash};
use bittybuzz_vm_core::builtin::{self, Library};
use std::ops::{Range, RangeInclusive};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Words that a script cannot use as a name. `include` is one before a string only, but would confuse.
const KEYWORDS: &[&str] = &[
    "var", "if", "else", "function", "return", "for", "while", "and", "or", "not", "nil", "include",
];

/// The global that holds the robot's id.
const ID: &str = "id";

pub fn robot(text: &str, path: &str) -> Result<Robot, RobotError> {
    let file = File { text, path };
    let document = DeTable::parse(text).map_err(|error| {
        let message = error.message().to_owned();
        file.fail(error.span().unwrap_or(0..0), Cause::Syntax { message })
    })?;
    let root = Section { file, name: "the file", span: 0..0, table: document.get_ref() };
    root.only(&[
        "name",
        "title",
        "chip",
        "profile",
        "tick_hz",
        "message_bytes",
        "vm",
        "budget",
        "layout",
        "function",
        "table",
        "setting",
    ])?;

    let name = root.line("name")?;
    if !is_robot_name(name.text) {
        return Err(name.fail(Cause::BadRobotName { name: name.text.to_owned() }));
    }
    let mut functions = Vec::new();
    let mut tables = Vec::new();
    let mut names = Names::default();
    for section in root.array_of_tables("table")? {
        let table = sensor_table(&section)?;
        names.add_table(&section, &table.name)?;
        tables.push(table);
    }
    for section in root.array_of_tables("function")? {
        let function = function(&section)?;
        names.add_function(&section, &function.name)?;
        functions.push(function);
    }
    let mut settings = Vec::new();
    for section in root.array_of_tables("setting")? {
        let setting = setting(&section)?;
        names.add(&section, &setting.name, false)?;
        settings.push(setting);
    }
    let vm = root.section("vm", "[vm]")?;
    let robot = Robot {
        name: name.text.to_owned(),
        title: root.line("title")?.text.to_owned(),
        chip: root.optional("chip", |root, key| Ok(root.line(key)?.text.to_owned()))?,
        profile: root.profile("profile")?,
        tick_hz: root.integer("tick_hz", 1..=100)?,
        message_bytes: root
            .integer("message_bytes", message_bytes(root.profile("profile")?)..=255)?,
        vm: vm_sizes(&vm)?,
        parts: Parts::ALL,
        budget: root.optional("budget", |root, key| budget(&root.section(key, "[budget]")?))?,
        layout: root.optional("layout", |root, key| layout(&root.section(key, "[layout]")?))?,
        functions,
        tables,
        settings,
    };
    if !robot.settings.is_empty()
        && let Some(layout) = robot.layout
        && layout.settings.is_none()
    {
        root.section("layout", "[layout]")?.required("settings")?;
    }
    let (slots, most) = (robot.vm.slots, robot.most_slots());
    if slots > most {
        let (slot_bytes, memory) = (robot.slot_bytes(), robot.vm.memory);
        let cause = Cause::TooManySlots { slots, slot_bytes, memory, most };
        return Err(vm.required("slots")?.fail(cause));
    }
    Ok(robot)
}

fn vm_sizes(vm: &Section<'_>) -> Result<VmSizes, RobotError> {
    vm.only(&[
        "memory",
        "slots",
        "neighbors",
        "bearings",
        "in_queue",
        "out_queue",
        "stigmergy_entries",
        "swarms",
        "maths",
        "beacon_steps",
        "forget_steps",
        "advertise_steps",
    ])?;
    let steps = |key, range: RangeInclusive<u32>, usual: u8| {
        let given = vm.optional(key, |section, key| section.integer(key, range.clone()))?;
        Ok(given.unwrap_or(u32::from(usual)))
    };
    Ok(VmSizes {
        memory: vm.integer("memory", 256..=262_144)?,
        slots: vm.integer("slots", 32..=65_520)?,
        neighbors: vm.integer("neighbors", 0..=255)?,
        bearings: vm.optional("bearings", Section::boolean)?.unwrap_or(true),
        in_queue: vm.integer("in_queue", 1..=255)?,
        out_queue: vm.integer("out_queue", 1..=255)?,
        stigmergy_entries: vm.integer("stigmergy_entries", 0..=100)?,
        swarms: vm.integer("swarms", 0..=8)?,
        maths: vm.optional("maths", Section::boolean)?.unwrap_or(true),
        beacon_steps: steps("beacon_steps", 1..=255, Periods::DEFAULT.beacon)?,
        forget_steps: steps("forget_steps", 1..=126, Periods::DEFAULT.forget)?,
        advertise_steps: steps("advertise_steps", 2..=150, Periods::DEFAULT.advertise)?,
    })
}

fn budget(section: &Section<'_>) -> Result<Budget, RobotError> {
    section.only(&["flash_bytes", "ram_bytes"])?;
    Ok(Budget {
        flash_bytes: section.integer("flash_bytes", 1024..=16_777_216)?,
        ram_bytes: section.integer("ram_bytes", 256..=16_777_216)?,
    })
}

/// Bytes of the longest message behind its type.
fn message_bytes(profile: Profile) -> u32 {
    let frame = match profile {
        Profile::Tiny => TINY_FRAME,
        Profile::Full => FULL_FRAME,
    };
    frame as u32 - 1
}

/// Vector tables of ARM's M profile are aligned to the power of two that holds them, here 128 words (ARMv7-M B3.2.5,
/// register VTOR). It is enough for the other regions.
const ALIGNMENT: u32 = 512;

fn layout(section: &Section<'_>) -> Result<Layout, RobotError> {
    section.only(&["application", "script", "ram", "stack", "id", "settings"])?;
    let layout = Layout {
        application: region(section, "application")?,
        script: region(section, "script")?,
        ram: region(section, "ram")?,
        stack: section.optional("stack", region)?,
        id: section.optional("id", region)?,
        settings: section.optional("settings", region)?,
    };
    let Layout { application, script, ram, stack, id, settings } = layout;
    let always = [("application", application), ("script", script), ("ram", ram)];
    let sometimes = [("stack", stack), ("id", id), ("settings", settings)].into_iter();
    let sometimes = sometimes.filter_map(|(key, region)| Some((key, region?)));
    let regions: Vec<_> = always.into_iter().chain(sometimes).collect();
    for (index, (key, region)) in regions.iter().enumerate() {
        let mut before = regions.iter().take(index);
        if let Some((other, _)) = before.find(|(_, other)| other.overlaps(*region)) {
            return Err(section.required(key)?.fail(Cause::Overlap { key, other }));
        }
    }
    Ok(layout)
}

fn region(section: &Section<'_>, key: &'static str) -> Result<Region, RobotError> {
    let region = section.section(key, "the region")?;
    region.only(&["address", "size"])?;
    let address = region.integer("address", 0..=u32::MAX - ALIGNMENT)?;
    if !address.is_multiple_of(ALIGNMENT) {
        return Err(region.required("address")?.fail(Cause::Unaligned { address, to: ALIGNMENT }));
    }
    Ok(Region { address, size: region.integer("size", ALIGNMENT..=u32::MAX - address)? })
}

/// Settings are 16 bits.
const MOST_SETTING: u32 = u16::MAX as u32;

fn function(section: &Section<'_>) -> Result<Function, RobotError> {
    section.only(&["name", "accepts", "returns", "waits", "help"])?;
    Ok(Function {
        name: section.identifier("name")?,
        accepts: section.argument_lists("accepts")?,
        returns: section.optional("returns", |section, key| {
            let text = section.string(key)?;
            Type::from_name(text.text).map_err(|cause| text.fail(cause))
        })?,
        waits: section.optional("waits", Section::boolean)?.unwrap_or(false),
        help: section.line("help")?.text.to_owned(),
    })
}

fn sensor_table(section: &Section<'_>) -> Result<SensorTable, RobotError> {
    section.only(&["name", "fields", "help"])?;
    let fields = section.string("fields")?;
    let list = fields.list()?;
    if list.is_empty() {
        return Err(fields.fail(Cause::NoFields));
    }
    Ok(SensorTable {
        name: section.identifier("name")?,
        fields: list,
        help: section.line("help")?.text.to_owned(),
    })
}

fn setting(section: &Section<'_>) -> Result<Setting, RobotError> {
    section.only(&["name", "least", "most", "help"])?;
    let least = section.integer("least", 0..=MOST_SETTING)?;
    Ok(Setting {
        name: section.identifier("name")?,
        least: least as u16,
        most: section.integer("most", least..=MOST_SETTING)? as u16,
        help: section.line("help")?.text.to_owned(),
    })
}

fn is_robot_name(name: &str) -> bool {
    name.starts_with(|first: char| first.is_ascii_lowercase())
        && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-')
}

/// The names that a robot has defined so far, and where.
#[derive(Default)]
struct Names {
    defined: Vec<(String, usize)>,
    functions: Vec<String>,
}

impl Names {
    fn add_table(&mut self, section: &Section<'_>, name: &str) -> Result<(), RobotError> {
        // `pos` is known to the language as the table that some robots keep.
        let position = Library::Position.global_name() == Some(name);
        self.add(section, name, is_reserved(name) && !position)
    }

    fn add_function(&mut self, section: &Section<'_>, name: &str) -> Result<(), RobotError> {
        self.add(section, name, is_reserved(name))?;
        for other in &self.functions {
            let cause = if name_hash(other) == name_hash(name) {
                Cause::HashCollision { name: name.to_owned(), other: other.clone() }
            } else if constant(other) == constant(name) {
                let constant = constant(name);
                Cause::ConstantCollision { name: name.to_owned(), other: other.clone(), constant }
            } else {
                continue;
            };
            return Err(section.required("name")?.fail(cause));
        }
        self.functions.push(name.to_owned());
        Ok(())
    }

    fn add(&mut self, section: &Section<'_>, name: &str, reserved: bool) -> Result<(), RobotError> {
        let entry = section.required("name")?;
        if reserved {
            return Err(entry.fail(Cause::Reserved { name: name.to_owned() }));
        }
        if let Some((_, line)) = self.defined.iter().find(|(other, _)| other == name) {
            return Err(entry.fail(Cause::DuplicateName { name: name.to_owned(), line: *line }));
        }
        self.defined.push((name.to_owned(), entry.place().line));
        Ok(())
    }
}

fn is_reserved(name: &str) -> bool {
    KEYWORDS.contains(&name)
        || name == ID
        || builtin::find(Library::Global, name).is_some()
        || Library::ALL.iter().any(|library| library.global_name() == Some(name))
}

/// The file that is read, for the places of errors.
#[derive(Clone, Copy)]
struct File<'a> {
    text: &'a str,
    path: &'a str,
}

impl File<'_> {
    fn fail(&self, span: Range<usize>, cause: Cause) -> RobotError {
        RobotError { cause, place: Some(Box::new(Place::new(self.path, self.text, span))) }
    }
}

/// A value of the file and where it stands.
struct Entry<'a> {
    file: File<'a>,
    span: Range<usize>,
    key: String,
    value: &'a DeValue<'a>,
}

impl<'a> Entry<'a> {
    fn new(file: File<'a>, key: &str, value: &'a Spanned<DeValue<'a>>) -> Self {
        Entry { file, span: value.span(), key: key.to_owned(), value: value.get_ref() }
    }

    fn fail(&self, cause: Cause) -> RobotError {
        self.file.fail(self.span.clone(), cause)
    }

    fn wrong_type(&self, expected: &'static str) -> RobotError {
        let found = match self.value {
            DeValue::String(_) => "a string",
            DeValue::Integer(_) => "an integer",
            DeValue::Float(_) => "a float",
            DeValue::Boolean(_) => "true or false",
            DeValue::Datetime(_) => "a date",
            DeValue::Array(_) => "an array",
            DeValue::Table(_) => "a table",
        };
        self.fail(Cause::WrongType { key: self.key.clone(), expected, found })
    }

    fn place(&self) -> Place {
        Place::new(self.file.path, self.file.text, self.span.clone())
    }

    fn string(self) -> Result<Text<'a>, RobotError> {
        match self.value {
            DeValue::String(text) => Ok(Text { file: self.file, span: self.span, text }),
            _ => Err(self.wrong_type("a string")),
        }
    }

    fn table(self, name: &'static str) -> Result<Section<'a>, RobotError> {
        match self.value {
            DeValue::Table(table) => Ok(Section { file: self.file, name, span: self.span, table }),
            _ => Err(self.wrong_type("a table")),
        }
    }
}

/// A string of the file and where it stands, quotation marks included.
struct Text<'a> {
    file: File<'a>,
    span: Range<usize>,
    text: &'a str,
}

impl Text<'_> {
    fn fail(&self, cause: Cause) -> RobotError {
        self.file.fail(self.span.clone(), cause)
    }

    fn list(&self) -> Result<Vec<Parameter>, RobotError> {
        signature::parse_list(self.text).map_err(|(part, cause)| {
            // Point at the part, unless escapes or triple quotes make its place unclear.
            let inner = self.span.start + 1..self.span.end.saturating_sub(1);
            let span = match self.file.text.get(inner.clone()) {
                Some(source) if source == self.text => {
                    inner.start + part.start..inner.start + part.end
                }
                _ => self.span.clone(),
            };
            self.file.fail(span, cause)
        })
    }
}

/// A table of the file and where it stands.
struct Section<'a> {
    file: File<'a>,
    name: &'static str,
    span: Range<usize>,
    table: &'a DeTable<'a>,
}

impl<'a> Section<'a> {
    /// Refuses keys other than these.
    fn only(&self, known: &'static [&'static str]) -> Result<(), RobotError> {
        let unknown = self.table.keys().filter(|key| !known.contains(&key.get_ref().as_ref()));
        match unknown.min_by_key(|key| key.span().start) {
            None => Ok(()),
            Some(key) => {
                let cause =
                    Cause::UnknownKey { key: key.get_ref().to_string(), section: self.name, known };
                Err(self.file.fail(key.span(), cause))
            }
        }
    }

    fn get(&self, key: &str) -> Option<Entry<'a>> {
        self.table.get(key).map(|value| Entry::new(self.file, key, value))
    }

    fn required(&self, key: &'static str) -> Result<Entry<'a>, RobotError> {
        let missing = || Cause::MissingKey { key, section: self.name };
        self.get(key).ok_or_else(|| self.file.fail(self.span.clone(), missing()))
    }

    fn optional<T>(
        &self,
        key: &'static str,
        read: impl Fn(&Self, &'static str) -> Result<T, RobotError>,
    ) -> Result<Option<T>, RobotError> {
        match self.get(key) {
            None => Ok(None),
            Some(_) => read(self, key).map(Some),
        }
    }

    fn string(&self, key: &'static str) -> Result<Text<'a>, RobotError> {
        self.required(key)?.string()
    }

    /// A string of one line that is not blank.
    fn line(&self, key: &'static str) -> Result<Text<'a>, RobotError> {
        let text = self.string(key)?;
        if text.text.trim().is_empty() || text.text.contains(char::is_control) {
            return Err(text.fail(Cause::NotOneLine { key }));
        }
        Ok(text)
    }

    fn identifier(&self, key: &'static str) -> Result<String, RobotError> {
        let text = self.string(key)?;
        if !signature::is_identifier(text.text) {
            return Err(text.fail(Cause::BadIdentifier { name: text.text.to_owned() }));
        }
        Ok(text.text.to_owned())
    }

    fn boolean(&self, key: &'static str) -> Result<bool, RobotError> {
        let entry = self.required(key)?;
        match entry.value {
            DeValue::Boolean(value) => Ok(*value),
            _ => Err(entry.wrong_type("true or false")),
        }
    }

    fn integer(&self, key: &'static str, range: RangeInclusive<u32>) -> Result<u32, RobotError> {
        let entry = self.required(key)?;
        let DeValue::Integer(number) = entry.value else {
            return Err(entry.wrong_type("an integer"));
        };
        match u32::from_str_radix(number.as_str(), number.radix()) {
            Ok(value) if range.contains(&value) => Ok(value),
            _ => Err(entry.fail(Cause::OutOfRange {
                key,
                value: number.to_string(),
                min: *range.start(),
                max: *range.end(),
            })),
        }
    }

    fn profile(&self, key: &'static str) -> Result<Profile, RobotError> {
        let text = self.string(key)?;
        Profile::from_name(text.text)
            .ok_or_else(|| text.fail(Cause::UnknownProfile { name: text.text.to_owned() }))
    }

    fn section(&self, key: &'static str, name: &'static str) -> Result<Section<'a>, RobotError> {
        self.required(key)?.table(name)
    }

    fn array(&self, key: &'static str) -> Result<Vec<Entry<'a>>, RobotError> {
        let entry = self.required(key)?;
        match entry.value {
            DeValue::Array(items) => {
                Ok(items.iter().map(|item| Entry::new(self.file, key, item)).collect())
            }
            _ => Err(entry.wrong_type("an array")),
        }
    }

    /// The tables written as `[[key]]`; none if there are none.
    fn array_of_tables(&self, key: &'static str) -> Result<Vec<Section<'a>>, RobotError> {
        let name = match key {
            "function" => "this [[function]]",
            "setting" => "this [[setting]]",
            _ => "this [[table]]",
        };
        let items = self.optional(key, Section::array)?.unwrap_or_default();
        items.into_iter().map(|item| item.table(name)).collect()
    }

    fn argument_lists(&self, key: &'static str) -> Result<Vec<Vec<Parameter>>, RobotError> {
        let mut lists: Vec<Vec<Parameter>> = Vec::new();
        for item in self.array(key)? {
            let text = item.string()?;
            let list = text.list()?;
            let same = |other: &Vec<Parameter>| {
                other.iter().map(|p| p.kind).eq(list.iter().map(|p| p.kind))
            };
            if lists.iter().any(same) {
                return Err(text.fail(Cause::RepeatedList));
            }
            lists.push(list);
        }
        match lists.is_empty() {
            true => Err(self.required(key)?.fail(Cause::AcceptsNothing)),
            false => Ok(lists),
        }
    }
}
