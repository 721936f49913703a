//! A scenario and its programs, checked against each other. All runs of a scenario share this data.

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bittybuzz_compiler::check::outside::called_flag;
use bittybuzz_compiler::refusal;
use bittybuzz_robot_spec::NumberProfile;
use bittybuzz_toml_reader::Place;
use bittybuzz_vm_core::message::FULL_FRAME;
use bittybuzz_vm_core::{ImageError, SLOTS_MAX};

use crate::engine::LinkSettings;
use crate::robot::checks::Costs;
use crate::robot::{
    GroupContext, News, ProgramId, QUEUED_MAX, RobotModel, SimRobot, common_effect,
};
use crate::scenario::{
    Backend, Condition, Group, GroupId, Load, Quantity, Scenario, ScenarioCause, ScenarioError,
    Selection, WorldChange, each_group_of, groups_of,
};

use super::asked::AskedPrograms;
use super::expectation::Bound;
use super::firmware::Firmware;
use super::group::{group_of, id, joining_order};
use super::measure::BoundMeasure;
use super::program::{Compiler, LoadedProgram, Program};
use super::quantity::QuantityProbe;
use super::settings::{media, media_of};
use super::tick_at;

mod initial_globals;
mod questions;

use initial_globals::check_globals;
use questions::check_question;

/// The reason why a program with a question is there.
const ASKED: &str = "the program of a question stays in the list";

/// The most mistakes that are reported. Each lists the names that would be right.
const MISTAKES_MAX: usize = 100;

/// A reason why a scenario cannot be run with these programs.
#[derive(Debug)]
pub enum SetupError {
    /// The scenario needs something that the programs do not have.
    Scenario(Vec<ScenarioError>),
    /// The virtual machine refuses the image of a group.
    Refused {
        /// The program.
        program: ProgramId,
        /// The reason.
        cause: ImageError,
    },
}

/// The data that all runs of a scenario share.
#[derive(Clone)]
pub struct Setup {
    /// The scenario.
    pub scenario: Arc<Scenario>,
    /// The programs of [`Scenario::programs`], then those that commands have loaded, indexed by
    /// [`ProgramId`].
    programs: Vec<LoadedProgram>,
    /// The emulator programs that replace the usual one of a model, by the model's name.
    emulators: Vec<(String, PathBuf)>,
    /// The data flashed to emulated robots, for each model.
    #[cfg_attr(not(feature = "emulators"), expect(dead_code, reason = "nothing is emulated"))]
    pub(super) firmware: Arc<[Firmware]>,
    expects: Vec<Bound>,
    measures: Vec<BoundMeasure>,
    /// The ticks at which quantities need the places of the robots.
    place_ticks: BTreeSet<u64>,
    plots: Vec<QuantityProbe>,
    /// The instruction costs of each group, indexed by [`GroupId`], where they are known. `None` if
    /// scripts are not checked.
    checks: Option<Vec<Option<Arc<Costs>>>>,
    /// Compiles the scripts that commands load.
    compiler: Option<Compiler>,
    /// The programs that events and commands load, by script and group.
    loaded_scripts: HashMap<PathBuf, HashMap<GroupId, ProgramId>>,
    /// Programs with questions at their ends.
    asked: Arc<AskedPrograms>,
}

impl Setup {
    /// Checks `programs`, one for each of [`Scenario::programs`], against the scenario.
    ///
    /// # Panics
    /// If the numbers of programs differ.
    pub fn new(
        scenario: impl Into<Arc<Scenario>>,
        programs: impl Into<Arc<[Program]>>,
    ) -> Result<Self, SetupError> {
        let scenario = scenario.into();
        let programs = loaded(&scenario, &programs.into());
        let mut errors = Vec::new();
        for group in &scenario.groups {
            if let Some(needs) = capacity_error(group) {
                let cause = ScenarioCause::CapacityError { robot: group.robot.name.clone(), needs };
                let place = Some(Box::new(group.place.clone()));
                errors.push(ScenarioError { cause, place });
            }
        }
        let mut expects = Vec::new();
        for expect in &scenario.expects {
            if errors.len() >= MISTAKES_MAX {
                break;
            }
            match probe_of(&expect.condition, &scenario, &programs) {
                Ok(probe) => expects.push(Bound::new(expect, probe, &scenario)),
                Err(error) => errors.push(error),
            }
        }
        let mut measures = Vec::new();
        for measure in &scenario.measures {
            if errors.len() >= MISTAKES_MAX {
                break;
            }
            match probe_of(&measure.condition, &scenario, &programs) {
                Ok(probe) => measures.push(BoundMeasure::new(measure, probe)),
                Err(error) => errors.push(error),
            }
        }
        for (group, loaded) in scenario.groups.iter().zip(&programs) {
            check_globals(&scenario, &programs, (group, loaded), &mut errors);
        }
        for event in &scenario.events {
            if errors.len() >= MISTAKES_MAX {
                break;
            }
            // Only these events name something of a script.
            let (checked, place) = match &event.action {
                WorldChange::Set { robots, global, place, .. } => {
                    (check_global(&scenario, &programs, robots, global), place)
                }
                WorldChange::Call { robots, function, place } => {
                    (check_function(&scenario, &programs, robots, function), place)
                }
                WorldChange::Ask { robots, question, place } => {
                    (check_question(&scenario, &programs, robots, question), place)
                }
                _ => continue,
            };
            if let Err(cause) = checked {
                errors.push(ScenarioError { cause, place: Some(Box::new(place.clone())) });
            }
        }
        let all = Selection::all(scenario.robot_count() as u32);
        let mut resolve = |quantities: &[(Quantity, Place)]| {
            let mut probes = Vec::new();
            for (quantity, place) in quantities {
                match QuantityProbe::new(quantity, &scenario.groups, &programs, &all) {
                    Ok(probe) => probes.push(probe),
                    Err(cause) => {
                        errors.push(ScenarioError { cause, place: Some(Box::new(place.clone())) });
                    }
                }
            }
            probes
        };
        let plots = resolve(&scenario.output.plot);
        // Tables are written for a few runs only, and resolve their quantities by themselves.
        resolve(scenario.output.data.quantities.as_deref().unwrap_or_default());
        let firmware = Firmware::for_scenario(&scenario, &programs);
        let firmware = firmware.unwrap_or_else(|error| {
            errors.push(error);
            Vec::new()
        });
        if !errors.is_empty() {
            return Err(SetupError::Scenario(errors));
        }
        for (number, loaded) in programs.iter().enumerate() {
            let model = &*scenario.group(loaded.group).model;
            let robot = SimRobot::new(model, &loaded.context, News::default(), 0, 0);
            robot.map_err(|cause| SetupError::Refused { program: ProgramId(number), cause })?;
        }
        let mut loaded_scripts: HashMap<PathBuf, HashMap<GroupId, ProgramId>> = HashMap::new();
        for (load, number) in scenario.loads.iter().zip(scenario.groups.len()..) {
            let of_script = loaded_scripts.entry(load.script.clone()).or_default();
            of_script.insert(load.group, ProgramId(number));
        }
        let conditions = scenario.expects.iter().map(|expect| &expect.condition);
        let conditions = conditions.chain(scenario.measures.iter().map(|one| &one.condition));
        let quantities = conditions.map(|condition| &condition.value);
        let quantities =
            quantities.chain(scenario.output.plot.iter().map(|(quantity, _)| quantity));
        let place_ticks = quantities.flat_map(Quantity::times_of_places).map(tick_at).collect();
        Ok(Setup {
            scenario,
            programs,
            emulators: Vec::new(),
            firmware: firmware.into(),
            expects,
            measures,
            place_ticks,
            plots,
            checks: None,
            compiler: None,
            loaded_scripts,
            asked: Arc::default(),
        })
    }

    /// Sets the program that emulates robots of a model: a path, or a name to be found in PATH. The
    /// default is that of the model.
    #[must_use]
    pub fn emulated_by(mut self, model: &str, emulator: PathBuf) -> Self {
        self.emulators.push((model.to_owned(), emulator));
        self
    }

    /// Enables the checks of scripts, for all robots that are not emulated. `costs` returns the
    /// instruction costs of a group's robots.
    #[must_use]
    pub fn checked(mut self, costs: impl Fn(&Group) -> Option<Arc<Costs>>) -> Self {
        self.checks = Some(self.scenario.groups.iter().map(costs).collect());
        self
    }

    /// Allows commands to load scripts, which `compiler` compiles.
    #[must_use]
    pub fn with_compiler(mut self, compiler: Compiler) -> Self {
        self.compiler = Some(compiler);
        self
    }

    /// Returns the parameters of the link between the robots of a group, at the beginning of a run.
    pub fn link(&self, group: &Group) -> LinkSettings {
        let media = media_of(&self.scenario, media(&self.scenario), group);
        *media.link(group.medium())
    }

    /// Returns a program; `None` if the setup has none of that number.
    pub fn program(&self, id: ProgramId) -> Option<&Program> {
        let loaded = match id.asked_place() {
            Some(place) => self.asked.get(place).map(|asked| &asked.loaded),
            None => self.programs.get(id.0),
        };
        loaded.map(|loaded| &loaded.program)
    }

    /// Returns a program with the data of the robots that run it.
    pub(super) fn loaded(&self, id: ProgramId) -> &LoadedProgram {
        match id.asked_place() {
            Some(place) => &self.asked.get(place).expect(ASKED).loaded,
            None => &self.programs[id.0],
        }
    }

    /// Returns all programs: those of [`Scenario::programs`], then those that commands have loaded.
    pub fn programs(&self) -> impl Iterator<Item = &Program> {
        self.programs.iter().map(|loaded| &loaded.program)
    }

    /// Returns each script with the group that runs it: those of the scenario, then those that
    /// commands have loaded.
    pub fn scripts(&self) -> impl Iterator<Item = (&Group, &Path)> {
        let programs = self.programs.iter();
        programs.filter_map(|loaded| {
            Some((self.scenario.group(loaded.group), loaded.script.as_deref()?))
        })
    }

    /// Returns the program that robots of a group run for a script, if it is loaded.
    pub(super) fn program_of(&self, group: GroupId, script: &Path) -> Option<ProgramId> {
        // The program of a group from the start has the group's number.
        let is_own = self.programs[group.0].script.as_deref() == Some(script);
        let own = is_own.then_some(ProgramId(group.0));
        own.or_else(|| self.loaded_scripts.get(script)?.get(&group).copied())
    }

    /// Returns true if scripts are checked.
    pub(super) fn is_checked(&self) -> bool {
        self.checks.is_some()
    }

    /// Returns the instruction costs of a group's robots, if they are checked and the costs are
    /// known.
    pub(super) fn costs(&self, GroupId(number): GroupId) -> Option<Arc<Costs>> {
        self.checks.as_ref()?[number].clone()
    }

    /// Returns a copy of this setup with the programs for a script that a command loads into
    /// robots.
    pub(super) fn with_script(
        &self,
        robots: &Selection,
        script: &Path,
    ) -> Result<Self, ScenarioCause> {
        let shown = || script.display().to_string();
        let Some(compiler) = &self.compiler else {
            return Err(ScenarioCause::NoCompiler { script: shown() });
        };
        let mut setup = self.clone();
        for number in groups_of(&self.scenario.groups, robots) {
            let program = compiler(script, self.scenario.group(number))
                .map_err(|report| ScenarioCause::NotCompiled { script: shown(), report })?;
            match self.program_of(number, script).map(|known| &self.loaded(known).program) {
                Some(known) if known.image == program.image => {}
                Some(_) => return Err(ScenarioCause::ScriptChanged { script: shown() }),
                None => {
                    let load = Load { group: number, script: script.to_owned() };
                    setup.add(load, program).map_err(|cause| ScenarioCause::NotLoaded {
                        script: shown(),
                        reason: refusal::sentence(&cause),
                    })?;
                }
            }
        }
        Ok(setup)
    }

    /// Adds a program, or fails if the virtual machine of the group's robots rejects it.
    fn add(&mut self, load: Load, program: Program) -> Result<(), ImageError> {
        let Load { group, script } = load;
        let ids = joining_ids(&self.scenario);
        let of = self.scenario.group(group);
        let context = context(of, (ProgramId(self.programs.len()), &program), ids);
        SimRobot::new(&*of.model, &context, News::default(), 0, 0)?;
        for bound in &mut self.expects {
            bound.probe.learn(&bound.expect.condition.value, &program);
        }
        for bound in &mut self.measures {
            bound.probe.learn(&bound.measure.condition.value, &program);
        }
        for (plot, (quantity, _)) in self.plots.iter_mut().zip(&self.scenario.output.plot) {
            plot.learn(quantity, &program);
        }
        let number = ProgramId(self.programs.len());
        self.loaded_scripts.entry(script.clone()).or_default().insert(group, number);
        self.programs.push(LoadedProgram { program, group, script: Some(script), context });
        Ok(())
    }

    /// Returns the program that emulates robots of a model.
    #[cfg(feature = "emulators")]
    pub(super) fn emulator(&self, model: &dyn RobotModel) -> &Path {
        let mut named = self.emulators.iter().filter(|(of, _)| of == model.name());
        let emulation = model.emulation().expect("a model with firmware has an emulator");
        named.next_back().map_or(Path::new(emulation.program()), |(_, path)| path)
    }

    /// Returns the expectations with their names resolved.
    pub fn expects(&self) -> &[Bound] {
        &self.expects
    }

    /// Returns the measures with their names resolved.
    pub fn measures(&self) -> &[BoundMeasure] {
        &self.measures
    }

    /// Returns true if a quantity needs the places of the robots at that tick.
    pub(super) fn keeps_places_at(&self, tick: u64) -> bool {
        self.place_ticks.contains(&tick)
    }

    /// Resolves a quantity of all robots in all programs, including those that commands have
    /// loaded.
    pub fn probe(&self, quantity: &Quantity) -> Result<QuantityProbe, ScenarioError> {
        if !quantity.times_of_places().all(|time| self.keeps_places_at(tick_at(time))) {
            let cause = ScenarioCause::PlacesNotKept { quantity: quantity.to_string() };
            return Err(ScenarioError { cause, place: None });
        }
        let all = Selection::all(self.scenario.robot_count() as u32);
        let groups = &self.scenario.groups;
        let probe = QuantityProbe::new(quantity, groups, &self.programs, &all);
        probe.map_err(|cause| ScenarioError { cause, place: None })
    }

    /// Fails if no program of these robots has a global of that name.
    pub(super) fn check_global(&self, robots: &Selection, name: &str) -> Result<(), ScenarioCause> {
        check_global(&self.scenario, &self.programs, robots, name)
    }

    /// Fails if no program of these robots was compiled to call a function of that name.
    pub(super) fn check_function(
        &self,
        robots: &Selection,
        name: &str,
    ) -> Result<(), ScenarioCause> {
        check_function(&self.scenario, &self.programs, robots, name)
    }

    /// Returns the quantities that are drawn over time.
    pub fn plots(&self) -> &[QuantityProbe] {
        &self.plots
    }

    /// Returns the group of a robot by its number.
    ///
    /// # Panics
    /// If the scenario has no robot of that number.
    pub fn group(&self, number: usize) -> GroupId {
        group_of(&self.scenario, number).0
    }

    /// Returns the id of a robot by its number.
    ///
    /// # Panics
    /// If the scenario has no robot of that number.
    pub fn id(&self, number: usize) -> u16 {
        id(&self.scenario, number)
    }
}

/// Resolves the quantity of a condition.
fn probe_of(
    condition: &Condition,
    scenario: &Scenario,
    programs: &[LoadedProgram],
) -> Result<QuantityProbe, ScenarioError> {
    let Condition { value, robots, value_place, .. } = condition;
    let probe = QuantityProbe::new(value, &scenario.groups, programs, robots);
    let place = || Some(Box::new(value_place.clone()));
    probe.map_err(|cause| ScenarioError { cause, place: place() })
}

fn check_global(
    scenario: &Scenario,
    programs: &[LoadedProgram],
    robots: &Selection,
    name: &str,
) -> Result<(), ScenarioCause> {
    // There may be thousands of events and groups, and mostly the first program has the global.
    let mut own = each_group_of(&scenario.groups, robots);
    if own.any(|GroupId(number)| programs[number].program.global(name).is_some()) {
        return Ok(());
    }
    let global = Quantity::Global { name: name.to_owned(), keys: Vec::new() };
    QuantityProbe::new(&global, &scenario.groups, programs, robots).map(|_| ())
}

fn check_function(
    scenario: &Scenario,
    programs: &[LoadedProgram],
    robots: &Selection,
    name: &str,
) -> Result<(), ScenarioCause> {
    let unknown = |_| ScenarioCause::UnknownFunction { name: name.to_owned() };
    check_global(scenario, programs, robots, &called_flag(name)).map_err(unknown)
}

/// Returns the programs of a scenario with the data of the robots that run them.
fn loaded(scenario: &Scenario, programs: &[Program]) -> Vec<LoadedProgram> {
    let ids = joining_ids(scenario);
    let own = (0..).map(GroupId).zip(&scenario.groups);
    let own = own.map(|(id, group)| (id, group.script.as_ref()));
    let loads = scenario.loads.iter().map(|load| (load.group, Some(&load.script)));
    let scripts: Vec<(GroupId, Option<&PathBuf>)> = own.chain(loads).collect();
    assert_eq!(scripts.len(), programs.len(), "a scenario needs a program for each script");
    let loaded = scripts.into_iter().zip(programs).enumerate();
    let loaded = loaded.map(|(number, ((group, script), program))| {
        let of = scenario.group(group);
        let context = context(of, (ProgramId(number), program), ids.clone());
        LoadedProgram { program: program.clone(), group, script: script.cloned(), context }
    });
    loaded.collect()
}

/// Returns the data that robots of a group with that program share.
fn context(of: &Group, program: (ProgramId, &Program), ids: Arc<[u16]>) -> Arc<GroupContext> {
    Arc::new(new_context(of, program, ids))
}

fn new_context(
    Group { robot, model, globals, .. }: &Group,
    (id, program): (ProgramId, &Program),
    ids: Arc<[u16]>,
) -> GroupContext {
    let effect = |function: &_| model.effect(function).or_else(|| common_effect(function));
    let (image, symbols) = ((id, &*program.image), program.symbols.clone());
    // A script that an event loads may lack some of the globals.
    let globals = globals.iter().filter_map(|of| Some((program.global(&of.name)?, of.number)));
    GroupContext::new(robot, image, symbols, model.budget(), ids, effect)
        .with_globals(globals.collect())
}

/// Returns the robots' ids in the order in which they enter the world.
fn joining_ids(scenario: &Scenario) -> Arc<[u16]> {
    let id = |number| id(scenario, number);
    joining_order(scenario).into_iter().map(id).collect()
}

/// Returns the models of the scenario's robots that run their firmware.
pub fn emulated(scenario: &Scenario) -> Vec<Arc<dyn RobotModel>> {
    let mut models: Vec<Arc<dyn RobotModel>> = Vec::new();
    for group in scenario.groups.iter().filter(|group| group.backend != Backend::Vm) {
        if !models.iter().any(|known| known.name() == group.model.name()) {
            models.push(group.model.clone());
        }
    }
    models
}

/// Returns the requirement that the group's robot file exceeds, in words; `None` if its robots can
/// be simulated.
fn capacity_error(Group { robot, model, .. }: &Group) -> Option<String> {
    let slots = robot.vm.slots as usize + robot.sizes().slots();
    let queued = robot.vm.in_queue.max(robot.vm.out_queue) as usize;
    if robot.profile == NumberProfile::Full && model.medium().frame_bytes() < FULL_FRAME {
        Some("profile tiny, not full".to_owned())
    } else if slots > SLOTS_MAX {
        Some(format!(
            "at most {SLOTS_MAX} slots for the script and what it knows of others, not {slots}"
        ))
    } else if queued > QUEUED_MAX {
        Some(format!("queues of at most {QUEUED_MAX} messages, not {queued}"))
    } else {
        None
    }
}
