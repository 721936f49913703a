//! Scenario files: a world, the robots in it, events during the run, and expected results.
//!
//! The reader rejects a file with a mistake instead of guessing. It finds all mistakes in one pass,
//! each with its place and remedy. `docs/scenario.md` describes every key, and [`keys`] is the
//! table against which files are checked.

mod adversary;
mod aggregate;
mod assignment;
mod backend;
mod body;
mod bridge;
mod column;
mod condition;
mod describe;
mod error;
mod event;
mod expect;
mod files;
mod folder;
mod globals;
mod group;
pub mod keys;
mod load;
mod measure;
mod medium;
mod mix;
mod output;
mod read;
mod robots;
mod select;
mod space;
mod sweep;
mod time;
mod value;
mod world;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use bittybuzz_compiler::include::{DiskFiles, Files};
use bittybuzz_toml_reader::{self as toml_reader, Override, SourceText};

use crate::engine::Medium;
use crate::robot::{DESCRIBED_LINK, Models, RobotModel};
use crate::sweep::{KeyNames, UnknownName};
use folder::Folder;

pub(crate) use adversary::first_too_many;
pub use adversary::{ADVERSARIES_MAX, Adversary, AdversaryKind};
pub use aggregate::{Aggregate, AggregateRule, FORMS as AGGREGATES, Filter};
pub use assignment::{Assignment, Task};
pub use backend::{Backend, DoorSection, ImageSection};
pub use bridge::BridgeSection;
pub use column::OWN_COLUMNS;
pub use condition::{Condition, ExpectedValue, Of, Reduction, Test};
pub(crate) use error::settings_error;
pub use error::{ScenarioCause, ScenarioError};
pub use event::{MoveTarget, NewNumbers, ScheduledEvent, WorldChange};
pub use expect::{Expect, When};
pub use files::{EmbeddedFiles, sections as file_sections, without_files};
pub use globals::InitialGlobal;
pub(crate) use group::Standing;
pub use group::{Group, GroupId, Heading, ListedPlace, Placement};
pub use load::Load;
pub(crate) use load::{each_group_of, groups_of};
pub use measure::{Measure, MeasureTime};
pub use medium::{LossSetting, MediaSettings, MediumSettings};
pub use output::{DataSection, OutputSection};
pub use read::{Entry, Section};
pub use select::Selection;
pub(crate) use space::{Space, length_up};
pub use sweep::{SweepParameter, SweepSection};
pub use value::{FORMS as QUANTITIES, GroundArea, Key, Quantity, Swarm};
pub use world::{
    LampSection, MovableSection, ObstacleSection, Outline, PatchSection, Shape, WorldSection,
};

/// A scenario that can be run.
#[derive(Debug, Clone)]
pub struct Scenario {
    /// The ground, light and time.
    pub world: WorldSection,
    /// The robots; at least one group.
    pub groups: Vec<Group>,
    /// The models of robots that are available, with the file's settings for each.
    pub models: Vec<Arc<dyn RobotModel>>,
    /// The media that carry their frames.
    pub media: MediaSettings,
    /// The station that forwards frames between different media.
    pub bridge: Option<BridgeSection>,
    /// Changes by time; those at the same time in the order of the file.
    pub events: Vec<ScheduledEvent>,
    /// Conditions that must hold.
    pub expects: Vec<Expect>,
    /// Numbers and times of a run, which become columns.
    pub measures: Vec<Measure>,
    /// The results of a run that are kept.
    pub output: OutputSection,
    /// The runs of a study, if the scenario is one.
    pub sweep: Option<SweepSection>,
    /// The task for a class, if the scenario is an assignment.
    pub assignment: Option<Assignment>,
    /// The scripts that events load into robots.
    pub loads: Vec<Load>,
    /// The files that stand in the scenario itself.
    pub embedded: Arc<EmbeddedFiles>,
    /// The folder of the file. The scripts that commands name are relative to it.
    pub folder: PathBuf,
    /// The robots by name and id. Commands need this index.
    robot_index: Arc<select::RobotIndex>,
    used: Vec<Medium>,
}

impl Scenario {
    /// Reads a scenario file on disk. The values in `set` (`medium.ir.loss=0.1`) override those of
    /// the file. `models` are the available models of robots.
    pub fn open(
        path: &Path,
        set: &[String],
        models: &Models,
    ) -> Result<Scenario, Vec<ScenarioError>> {
        Scenario::open_in(&DiskFiles, path, set, models)
    }

    /// Reads a scenario file as [`open`](Self::open) does. The scenario file and the files that it
    /// names come from `files`, on disk or in memory. Errors name the same files and lines.
    pub fn open_in(
        files: &dyn Files,
        path: &Path,
        set: &[String],
        models: &Models,
    ) -> Result<Scenario, Vec<ScenarioError>> {
        let shown = path.to_string_lossy();
        let text = folder::read_text(files, path).map_err(|error| {
            let cause =
                ScenarioCause::Unreadable { path: shown.to_string(), reason: error.to_string() };
            vec![ScenarioError { cause, place: None }]
        })?;
        Scenario::parse_in(files, &text, path, set, models)
    }

    /// Reads a text as if it were the scenario file at `path`, as [`open_in`](Self::open_in) does.
    /// The files that it names come from `files`.
    pub fn parse_in(
        files: &dyn Files,
        text: &str,
        path: &Path,
        set: &[String],
        models: &Models,
    ) -> Result<Scenario, Vec<ScenarioError>> {
        let folder = Folder { files, path: path.parent().unwrap_or(Path::new("")) };
        parse(text, &path.to_string_lossy(), folder, set, models)
    }

    /// Reads the text of a scenario file. `path` is only its name in errors. Scripts and robot
    /// files are on disk, relative to `folder`.
    pub fn parse(
        text: &str,
        path: &str,
        folder: &Path,
        set: &[String],
        models: &Models,
    ) -> Result<Scenario, Vec<ScenarioError>> {
        parse(text, path, Folder { files: &DiskFiles, path: folder }, set, models)
    }

    /// Reads a command to a running world and returns its action. The text has the keys of an
    /// `[[event]]` without `at`, such as `fail = 3`.
    pub fn command(&self, text: &str) -> Result<WorldChange, Vec<ScenarioError>> {
        let schema = |section| match section {
            keys::COMMAND => {
                keys::names_in(keys::EVENT).into_iter().filter(|key| *key != "at").collect()
            }
            section => keys::names_in(section),
        };
        let format = (keys::COMMAND, &schema as toml_reader::Schema<'_>);
        toml_reader::read(&SourceText::new(keys::COMMAND, text), &[], format, |section| {
            let (robot_index, groups) = (&self.robot_index, &self.groups);
            // The compiler reports a script that is missing.
            let script = |entry: &Entry<'_>| Some(self.folder.join(entry.string()?));
            let action =
                event::action(section, robot_index, &self.world, groups, &self.used, &script)?;
            space::check_move(section, &self.world, &self.groups, &action);
            Some(action)
        })
    }

    /// Returns a group.
    pub fn group(&self, id: GroupId) -> &Group {
        &self.groups[id.0]
    }

    /// Returns the number of robots, absent ones included.
    pub fn robot_count(&self) -> usize {
        self.groups.last().map_or(0, |last| last.end() as usize)
    }
}

/// Reads the text of a scenario file. `path` is only its name in errors. The files that it names
/// are relative to `folder`.
fn parse(
    text: &str,
    path: &str,
    folder: Folder<'_>,
    set: &[String],
    models: &Models,
) -> Result<Scenario, Vec<ScenarioError>> {
    let mut sets: Vec<(String, String, &str)> = set.iter().map(|set| split(set)).collect();
    // Most keys need no names.
    if sets.iter().any(|(key, ..)| key.starts_with("robots.")) {
        let names = KeyNames::of(text);
        for (key, shown, value) in &mut sets {
            *key = names.indexed(key).map_err(|UnknownName { name, groups }| {
                let place = SourceText::new(shown, value).place(0..value.len());
                let cause = ScenarioCause::UnknownGroup { name, groups };
                vec![ScenarioError { cause, place: Some(Box::new(place)) }]
            })?;
        }
    }
    let overrides: Vec<Override<'_>> = sets
        .iter()
        .map(|(key, shown, value)| Override::new(key, SourceText::new(shown, value)))
        .collect();
    let schema = |section| keys_of(section, models);
    let format = (keys::ROOT, &schema as toml_reader::Schema<'_>);
    toml_reader::read(&SourceText::new(path, text), &overrides, format, |root| {
        scenario(root, folder, models)
    })
}

/// Reads all sections even after an error, so that every mistake is found. Returns `None` if a
/// required part is missing.
fn scenario(root: &Section<'_>, folder: Folder<'_>, models: &Models) -> Option<Scenario> {
    let world = world::read(root).map(|(world, movables)| {
        space::check_movables(&world, &movables);
        world
    });
    // Without a valid `[world]`, places and times cannot be checked: an unbounded world accepts
    // all.
    let boundless = WorldSection {
        size: [f64::MAX; 2],
        ground: Vec::new(),
        obstacles: Vec::new(),
        movables: Vec::new(),
        lights: Vec::new(),
        ambient: 0.0,
        seed: 0,
        duration: f64::MAX,
    };
    let known = world.as_ref().unwrap_or(&boundless);
    let mut robot_index = select::RobotIndex::default();
    let models = body::read(root, models);
    let embedded = Arc::new(files::read(root, folder.path));
    let overlaid = embedded.over(folder.files);
    let folder = Folder { files: &overlaid, path: folder.path };
    let groups = robots::read(root, folder, known, &models, &mut robot_index);
    let is_complete = groups.iter().all(Option::is_some);
    let mut groups: Vec<Group> = groups.into_iter().flatten().collect();
    robots::introduce(&mut groups);
    robots::number(&mut groups);
    let mut used = Vec::new();
    // A group with a mistake may have any medium, so the media in use are unknown.
    for group in groups.iter().filter(|_| is_complete) {
        let medium = group.model.medium();
        if !used.contains(&medium) {
            used.push(medium);
        }
    }
    if is_complete {
        mix::check(root, &groups);
    }
    let emulated = groups.iter().filter(|group| group.backend != Backend::Vm);
    let emulated: Vec<Medium> = emulated.map(|group| group.model.medium()).collect();
    let media = medium::read(root, &used, &emulated);
    let bridge = bridge::read(root, folder, known, &groups);
    let sections = root.sections("event", keys::EVENT);
    let script = |entry: &Entry<'_>| robots::script(entry, folder);
    let mut events: Vec<ScheduledEvent> = Vec::new();
    let mut begun = Vec::new();
    for section in &sections {
        let event = event::read(section, &robot_index, known, &groups, &used, &script);
        // The reader has reported the mistake of the event.
        let Some(event) = event else { continue };
        if is_complete && world.is_some() {
            space::check_move(section, known, &groups, &event.action);
        }
        if let WorldChange::Adversary(adversary) = &event.action {
            begun.push((event.at, adversary.until, section.place()));
        }
        events.push(event);
    }
    let loads = load::loads(&events, &groups);
    let outside = Arc::new(load::outside_uses(&events, &groups));
    for group in &mut groups {
        group.outside = Arc::clone(&outside);
        group.embedded = Arc::clone(&embedded);
    }
    let adversaries = adversary::read_all(root, &robot_index, known, &groups).into_iter();
    events.extend(adversaries.map(|(at, adversary, place)| {
        begun.push((at, adversary.until, place));
        let action = WorldChange::Adversary(Box::new(adversary));
        ScheduledEvent { at, action }
    }));
    adversary::check_count(root, begun);
    events.sort_by(|one, other| one.at.total_cmp(&other.at));
    if is_complete && world.is_some() {
        space::check_starts(root, known, &groups, &events);
    }
    let expects = expect::read_all(root, &robot_index, known.duration);
    let measures = measure::read_all(root, &robot_index, known.duration);
    let output = output::read(root, &robot_index, known.duration);
    let sweep = sweep::read(root);
    let assignment = assignment::read(root);
    let robot_index = Arc::new(robot_index);
    Some(Scenario {
        world: world?,
        groups,
        models,
        media,
        bridge,
        events,
        expects,
        measures,
        output,
        sweep,
        assignment,
        loads,
        embedded: Arc::clone(&embedded),
        folder: folder.path.to_owned(),
        robot_index,
        used,
    })
}

/// Returns the names of the keys of a section, either of scenarios or of one of the models.
fn keys_of(section: &str, models: &Models) -> Vec<&'static str> {
    if section == keys::BODY {
        return models.iter().map(|model| model.name()).collect();
    }
    let of_model = models.iter().find_map(|model| {
        let keys = model.keys();
        keys.names_in(section).or_else(|| {
            let of_link = || keys::names_in(keys::of_medium(model.medium().word()));
            (section == keys.link).then(of_link)
        })
    });
    of_model.unwrap_or_else(|| match section {
        _ if section == DESCRIBED_LINK => keys::names_in(keys::RAB),
        _ => keys::names_in(section),
    })
}

/// The beginning of the name of a setting's place in errors, which its key follows.
pub const SET: &str = "--set";

/// Returns the key and the value of `medium.ir.loss=0.1`, and between them the name of its place in
/// errors.
fn split(set: &str) -> (String, String, &str) {
    let (key, value) = set.split_once('=').unwrap_or((set, ""));
    (key.trim().to_owned(), format!("{SET} {}", key.trim()), value.trim())
}
