//! `[[robots]]`: the groups of robots, with their models, start poses and scripts.

use std::collections::{HashMap, HashSet};
use std::ffi::OsStr;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bittybuzz_compiler::include::Files;
use bittybuzz_robot_files::find;
use bittybuzz_robot_spec::{NumberProfile, OnFault, Robot, RobotError, RobotErrors};
use bittybuzz_toml_reader::TomlError;
use toml::de::DeValue;

use crate::robot::{Emulation, HeldRobot, Models, RobotModel, common_effect, step_rates};

use super::backend::{self, Backend};
use super::body;
use super::error::ScenarioCause;
use super::folder::{Folder, read_text};
use super::globals;
use super::group::{Group, Heading, ListedPlace, Placement};
use super::keys::ROBOTS;
use super::medium;
use super::read::{Entry, Section};
use super::select::{self, EmulatorLimits, RobotIndex};
use super::world::{WorldSection, inside, point_inside};

/// Stores the robot files of all groups in every group.
pub(super) fn introduce(groups: &mut [Group]) {
    let mut known = HashSet::new();
    let first = groups.iter().filter(|group| known.insert(group.robot.name.as_str()));
    let robots: Arc<[Robot]> = first.map(|group| (*group.robot).clone()).collect();
    for group in groups {
        group.robots_of_scenario = Arc::clone(&robots);
    }
}

/// Numbers the robots of the scenario in the order of its groups.
pub(super) fn number(groups: &mut [Group]) {
    let mut first = 0u32;
    for group in groups {
        group.first_robot = first;
        first = group.end();
    }
}

/// The number of robots in a group: at most one for each id.
const COUNT: RangeInclusive<u32> = 1..=0x1_0000;

/// The valid spacings in mm. Robots at a smaller distance would overlap.
const SPACING: RangeInclusive<f64> = 1.0..=1e6;

/// Reads the groups of the file; `None` stands for a group with a mistake.
pub fn read(
    root: &Section<'_>,
    folder: Folder<'_>,
    world: &WorldSection,
    models: &Models,
    robot_index: &mut RobotIndex,
) -> Vec<Option<Group>> {
    let mut robot_files = RobotFiles::default();
    let sections = root.sections("robots", ROBOTS);
    if sections.is_empty() && root.get("robots").is_none() {
        root.fail(ScenarioCause::NoRobots);
    }
    let robot_files = &mut robot_files;
    let read = |section| group(section, folder, world, models, robot_index, robot_files);
    sections.iter().map(read).collect()
}

/// The robot files of a scenario. Many groups may have one file, which is read once.
#[derive(Default)]
struct RobotFiles {
    /// The content of each file by the value of `robot`, or the mistakes without a place in the
    /// file, which are reported at each group.
    read: HashMap<String, Result<Arc<Robot>, Vec<RobotError>>>,
    /// The robots whose group sets another profile or another consequence of faults than the file.
    changed: HashMap<(String, NumberProfile, OnFault), Arc<Robot>>,
}

impl RobotFiles {
    /// Returns the robot of a file, if it has no mistake.
    fn get(
        &mut self,
        entry: &Entry<'_>,
        file: Option<&Path>,
        folder: Folder<'_>,
    ) -> Option<Arc<Robot>> {
        let name = entry.string()?;
        let fail = |error: RobotError| entry.fail(ScenarioCause::Robot { error: Box::new(error) });
        match self.read.get(name) {
            Some(Ok(robot)) => return Some(robot.clone()),
            Some(Err(errors)) => {
                errors.iter().cloned().for_each(fail);
                return None;
            }
            None => {}
        }
        let robot = match robot(name, file, folder) {
            Ok(robot) => Ok(Arc::new(robot)),
            Err(errors) => {
                let mut without_place = Vec::new();
                for error in errors.0 {
                    match error.place.clone() {
                        // The mistake has its place in the robot file.
                        Some(place) => {
                            let cause = ScenarioCause::Robot { error: Box::new(error) };
                            entry.reader.fail_at(&place, cause);
                        }
                        None => without_place.push(error),
                    }
                }
                without_place.iter().cloned().for_each(fail);
                Err(without_place)
            }
        };
        self.read.insert(name.to_owned(), robot.clone());
        robot.ok()
    }

    /// Returns a robot with another profile and another consequence of faults.
    fn with(
        &mut self,
        robot: Arc<Robot>,
        file: &str,
        profile: NumberProfile,
        on_fault: OnFault,
    ) -> Arc<Robot> {
        if (robot.profile, robot.on_fault) == (profile, on_fault) {
            return robot;
        }
        let changed = self.changed.entry((file.to_owned(), profile, on_fault));
        changed.or_insert_with(|| Arc::new(Robot { profile, on_fault, ..(*robot).clone() })).clone()
    }
}

fn group(
    section: &Section<'_>,
    folder: Folder<'_>,
    world: &WorldSection,
    models: &Models,
    robot_index: &mut RobotIndex,
    robot_files: &mut RobotFiles,
) -> Option<Group> {
    let place = section.place();
    let robot_entry = section.required("robot");
    let robot_file = robot_entry.as_ref().and_then(|entry| robot_file(entry, folder));
    let named = robot_entry.as_ref().and_then(|entry| entry.value.as_str()).unwrap_or_default();
    let mut robot = robot_entry
        .as_ref()
        .and_then(|entry| robot_files.get(entry, robot_file.as_deref(), folder));
    let profiles =
        [NumberProfile::Tiny, NumberProfile::Full].map(|profile| (profile.name(), profile));
    let (profile, on_fault) =
        (section.word("profile", &profiles), section.word("on_fault", &OnFault::WORDS));
    if let Some(of_file) = robot {
        let profile = profile.unwrap_or(of_file.profile);
        let on_fault = on_fault.unwrap_or(of_file.on_fault);
        robot = Some(robot_files.with(of_file, named, profile, on_fault));
    }
    check_rate(section, robot.as_deref());
    let model = robot.as_ref().and_then(|robot| body::of_group(section, robot, models));
    let link = model.as_ref().map(|model| medium::link(section, model.keys().link));
    // Robots with a foreign image have no script.
    let script = match section.get("image") {
        Some(_) => Some(None),
        None => section.required("script").and_then(|entry| script(&entry, folder)).map(Some),
    };
    let count = section.integer("count", COUNT);
    let listed = section.get("positions").and_then(|entry| entry.list());
    let is_sized = count.is_some() || section.get("count").is_none();
    // The number of places replaces an invalid count, so that no further errors follow from it.
    let count = count.unwrap_or(listed.map_or(1, |listed| listed.len() as u32));
    let backend = backend::of_group(section, model.as_deref(), robot.as_deref(), folder, count);
    if let (Some(robot), Some(model), Some(Backend::Vm)) = (&robot, &model, &backend) {
        check_effects(section, robot, &**model);
    }
    let settings = settings(section, robot.as_deref());
    let profile = robot.as_ref().map(|robot| robot.profile);
    let globals = globals::read(section, profile);
    let model = match (model, &robot, settings.is_empty()) {
        (Some(model), Some(robot), false) => {
            let with = model.with_settings(&robot.named_settings(&settings));
            if with.is_none() && matches!(backend, Some(Backend::Vm)) {
                section
                    .get("settings")
                    .expect("the settings are not empty")
                    .fail(ScenarioCause::NoSettings);
            }
            Some(with.unwrap_or(model))
        }
        (model, ..) => model,
    };
    // The emulator moves the bodies of robots that fly in it.
    let has_flight = |model: &dyn RobotModel| model.emulation().is_some_and(|own| own.flies());
    let is_image = matches!(backend, Some(Backend::Image(_)));
    let flies = matches!(backend, Some(Backend::Firmware { .. }))
        && model.as_deref().is_some_and(has_flight);
    let model = model.map(|model| -> Arc<dyn RobotModel> {
        match (is_image, flies) {
            (true, _) => Arc::new(HeldRobot::new(model)),
            (_, true) => Arc::new(HeldRobot::that_crash(model)),
            _ => model,
        }
    });
    let name = name(section, robot.as_deref(), robot_index);
    let first_id = section.integer("first_id", 0..=0xffff).unwrap_or(robot_index.next_id());
    // Many groups of many robots have more ids than there are numbers.
    let ids = first_id..first_id.saturating_add(count);
    let pointed = |cause| match section.get("first_id") {
        Some(entry) => entry.fail(cause),
        None => section.fail(cause),
    };
    if ids.end > 0x1_0000 {
        pointed(ScenarioCause::IdsExhausted { last: ids.end - 1 });
    } else if let Some((id, line)) = robot_index.taken(&ids) {
        pointed(ScenarioCause::DuplicateId { id, line });
    }
    let limits = |emulation: Arc<dyn Emulation>| EmulatorLimits {
        counts_steps: emulation.counts_steps(),
        has_switch: emulation.has_switch(),
        can_be_moved: !is_image && !flies,
    };
    let is_emulated = matches!(backend, Some(Backend::Firmware { .. } | Backend::Image(_)));
    let emulation = model.as_ref().filter(|_| is_emulated).and_then(|model| model.emulation());
    let has_right_ids = is_sized && ids.end <= 0x1_0000;
    let numbers = (first_id, count);
    robot_index.add(name.clone(), numbers, has_right_ids, emulation.map(limits), &place);
    if robot_index.count() > *COUNT.end() {
        // The mistakes in the ids are recorded. Each further group could have 65,536 places to check.
        return None;
    }
    let placement = placement(section, count, world);
    let heading = match section.get("heading") {
        None => Some(Heading::Random),
        Some(entry) if entry.value.as_str() == Some("random") => Some(Heading::Random),
        Some(entry) => heading(&entry).map(Heading::Degrees),
    };
    Some(Group {
        name,
        robot: robot?,
        robots_of_scenario: Arc::default(),
        outside: Arc::default(),
        embedded: Arc::default(),
        robot_file,
        script: script?,
        backend: backend?,
        first_robot: 0,
        count: is_sized.then_some(count)?,
        // An id beyond 16 bits was reported above.
        first_id: u16::try_from(first_id).ok()?,
        placement: placement?,
        heading: heading?,
        present: section.boolean("present").unwrap_or(true),
        clock_skew: match section.get("clock_skew") {
            Some(entry) => Some(clock_skew(&entry)?),
            None => None,
        },
        brown_out_every: section.number("brown_out_every", 0.1..=1e9),
        model: model?,
        link: link?,
        settings,
        globals,
        place,
    })
}

/// Reads the settings in the robots' flash. Returns none after an error.
fn settings(section: &Section<'_>, robot: Option<&Robot>) -> Vec<Option<u16>> {
    let (Some(entry), Some(robot)) = (section.get("settings"), robot) else { return Vec::new() };
    let assignments = entry.list().and_then(|list| {
        list.iter().map(|one| one.string().map(str::to_owned)).collect::<Option<Vec<_>>>()
    });
    let values = robot.setting_values(&assignments.unwrap_or_default());
    values.unwrap_or_else(|error| {
        entry.fail(ScenarioCause::Setting { error: Box::new(error) });
        Vec::new()
    })
}

/// The valid clock skews in percent. An RC oscillator without calibration is within 10 %.
const CLOCK_SKEW: RangeInclusive<f64> = -20.0..=20.0;

/// Reads one percentage for all robots, or the least and the greatest one.
fn clock_skew(entry: &Entry<'_>) -> Option<[f64; 2]> {
    if let DeValue::Array(_) = entry.value {
        let [one, other]: [f64; 2] =
            entry.numbers("a number or two as [least, most]", CLOCK_SKEW)?;
        return Some([one.min(other), one.max(other)]);
    }
    entry.number(CLOCK_SKEW).map(|skew| [skew; 2])
}

/// Reports a robot file with steps that are not a whole number of ticks apart.
fn check_rate(section: &Section<'_>, robot: Option<&Robot>) {
    // A missing or wrong robot was reported before.
    let (Some(robot), Some(entry)) = (robot, section.get("robot")) else { return };
    if !step_rates().any(|rate| rate == robot.tick_hz) {
        entry.fail(ScenarioCause::StepRate { robot: robot.name.clone(), rate: robot.tick_hz });
    }
}

/// Reports functions of a robot that have no effect in the simulator.
fn check_effects(section: &Section<'_>, robot: &Robot, model: &dyn RobotModel) {
    for function in &robot.functions {
        if model.effect(function).is_none() && common_effect(function).is_none() {
            let (robot, function) = (robot.name.clone(), function.name.clone());
            let cause = ScenarioCause::NoEffect { robot, function };
            match section.get("robot") {
                Some(entry) => entry.fail(cause),
                None => section.fail(cause),
            }
        }
    }
}

/// Reads a heading in degrees.
pub fn heading(entry: &Entry<'_>) -> Option<f64> {
    if let DeValue::String(_) = entry.value {
        entry.wrong_type("a number of degrees or \"random\"");
        return None;
    }
    entry.number(-360.0..=360.0)
}

/// Returns the path of the robot file, if the value is one.
fn robot_file(entry: &Entry<'_>, folder: Folder<'_>) -> Option<PathBuf> {
    let path = Path::new(entry.value.as_str()?);
    (path.extension() == Some(OsStr::new("toml"))).then(|| folder.path.join(path))
}

/// Reads a robot: a file, or one that ships.
fn robot(name: &str, file: Option<&Path>, folder: Folder<'_>) -> Result<Robot, RobotErrors> {
    let Some(file) = file else { return find(name) };
    let shown = file.to_string_lossy();
    match read_text(folder.files, file) {
        Ok(text) => Robot::parse(&text, &shown),
        Err(error) => Err(RobotErrors::unreadable(&shown, &error)),
    }
}

/// Returns the name of a group: its own, or else the name of its robot, with a number if that name
/// is taken.
fn name(section: &Section<'_>, robot: Option<&Robot>, robot_index: &mut RobotIndex) -> String {
    if let Some(entry) = section.get("name") {
        let name = entry.string().unwrap_or_default();
        if name.is_empty() || select::means_others(name) {
            entry.fail(ScenarioCause::BadGroupName { name: name.to_owned() });
        } else if let Some(line) = robot_index.line_of(name) {
            entry.fail(ScenarioCause::DuplicateGroup { name: name.to_owned(), line });
        }
        return name.to_owned();
    }
    robot_index.unused_name(robot.map_or("", |robot| robot.name.as_str()))
}

/// Reads the path of a script, relative to the folder.
pub fn script(entry: &Entry<'_>, folder: Folder<'_>) -> Option<PathBuf> {
    let text = entry.string()?;
    match folder.file(text, None) {
        Ok(path) => Some(path),
        Err(reason) => {
            let likely = similar_file(&folder.path.join(text), folder.files);
            let likely = likely.map(|name| Path::new(text).with_file_name(name));
            let likely = likely.map(|likely| likely.to_string_lossy().into_owned());
            entry.fail(ScenarioCause::NoScript { path: text.to_owned(), reason, likely });
            None
        }
    }
}

/// Returns the name of the script in the same folder that is most similar to a missing one.
fn similar_file(path: &Path, files: &dyn Files) -> Option<String> {
    let wanted = path.file_name()?.to_str()?;
    let is_script = |name: &String| [".bzz", ".bo", ".bbi"].iter().any(|end| name.ends_with(end));
    let names = files.names(path.parent().unwrap_or(Path::new(""))).into_iter().filter(is_script);
    let scored = names.map(|name| (strsim::jaro_winkler(wanted, &name), name));
    let best = scored.max_by(|a, b| a.0.total_cmp(&b.0).then_with(|| b.1.cmp(&a.1)))?;
    (best.0 > 0.85).then_some(best.1)
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Form {
    Grid,
    Hexagonal,
    Line,
    Circle,
    Random,
    List,
}

const FORMS: [(&str, Form); 6] = [
    ("grid", Form::Grid),
    ("hexagonal", Form::Hexagonal),
    ("line", Form::Line),
    ("circle", Form::Circle),
    ("random", Form::Random),
    ("list", Form::List),
];

/// The keys of placements. Each has the placements that use it, and the text for an error that
/// names them.
const KEYS: [(&str, &[Form], &str); 7] = [
    (
        "at",
        &[Form::Grid, Form::Hexagonal, Form::Line, Form::Circle, Form::Random],
        "another placement",
    ),
    (
        "spacing",
        &[Form::Grid, Form::Hexagonal, Form::Line],
        "placement = \"grid\", \"hexagonal\" or \"line\"",
    ),
    ("columns", &[Form::Grid, Form::Hexagonal], "placement = \"grid\" or \"hexagonal\""),
    ("direction", &[Form::Line], "placement = \"line\""),
    ("radius", &[Form::Circle], "placement = \"circle\""),
    ("area", &[Form::Random], "placement = \"random\""),
    ("positions", &[Form::List], "placement = \"list\""),
];

fn placement(section: &Section<'_>, count: u32, world: &WorldSection) -> Option<Placement> {
    let form = match section.get("placement") {
        Some(_) => section.word("placement", &FORMS)?,
        None if section.get("positions").is_some() => Form::List,
        None => Form::Random,
    };
    for (key, forms, needs) in KEYS {
        if let Some(entry) = section.get(key).filter(|_| !forms.contains(&form)) {
            entry.fail(ScenarioCause::Without { key, needs });
        }
    }
    let at = match section.get("at") {
        Some(entry) => point_inside(&entry, world)?,
        None => [0.0; 2],
    };
    let spacing = || section.required("spacing").and_then(|entry| entry.number(SPACING));
    let columns = || match section.get("columns") {
        Some(entry) => entry.integer(COUNT),
        None => Some(f64::from(count).sqrt().ceil() as u32),
    };
    let placement = match form {
        Form::Grid => Placement::Grid { at, spacing: spacing()?, columns: columns()? },
        Form::Hexagonal => Placement::Hexagonal { at, spacing: spacing()?, columns: columns()? },
        Form::Line => Placement::Line {
            at,
            spacing: spacing()?,
            direction: section.get("direction").map_or(Some(0.0), |entry| heading(&entry))?,
        },
        Form::Circle => {
            let radius = section.required("radius").and_then(|entry| entry.number(SPACING))?;
            Placement::Circle { at, radius }
        }
        Form::Random => {
            let area = section
                .get("area")
                .map(|entry| entry.numbers("two numbers as [width, height]", 1.0..=1e6));
            // Without an area, the whole world is used, whatever `at` is.
            Placement::Random { at, area: area.unwrap_or(Some(world.size))? }
        }
        Form::List => return list(section, count, world),
    };
    for (index, point) in placement.points(count).enumerate() {
        if !world.contains(point) {
            let [x, y] = point.map(f64::round);
            let cause = world.outside(format!("robot {index} of this group at ({x}, {y})"));
            match section.get("placement") {
                Some(entry) => entry.fail(cause),
                None => section.fail(cause),
            }
            return None;
        }
    }
    Some(placement)
}

fn list(section: &Section<'_>, count: u32, world: &WorldSection) -> Option<Placement> {
    let entry = section.required("positions")?;
    let items = entry.list()?;
    if items.is_empty() {
        let expected = "a list of one place [x, y] or more";
        entry.fail(TomlError::Length { key: "positions".to_owned(), expected, found: 0 });
        return None;
    }
    if items.len() != count as usize {
        let expected = "as long as `count` says";
        entry.fail(TomlError::Length { key: "positions".to_owned(), expected, found: items.len() });
        return None;
    }
    // All places are read before a mistake ends it, so that every mistake is found.
    let places: Vec<Option<ListedPlace>> =
        items.iter().map(|item| listed_place(item, world)).collect();
    places.into_iter().collect::<Option<Vec<_>>>().map(Placement::List)
}

/// Reads a start place: a point, or a point and a heading.
fn listed_place(entry: &Entry<'_>, world: &WorldSection) -> Option<ListedPlace> {
    let expected = "two numbers as [x, y], or three as [x, y, degrees]";
    let any = f64::MIN..=f64::MAX;
    match entry.value {
        DeValue::Array(numbers) if numbers.len() == 3 => {
            let [x, y, _] = entry.numbers(expected, any)?;
            let at = inside(entry, [x, y], world)?;
            Some(ListedPlace { at, heading: Some(heading(&entry.list()?[2])?) })
        }
        _ => inside(entry, entry.numbers(expected, any)?, world).map(ListedPlace::from),
    }
}
