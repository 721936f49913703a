//! A scenario and its programs, checked against each other. All runs of a scenario share this data.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use bittybuzz_compiler::refusal;
use bittybuzz_robot_spec::NumberProfile;
use bittybuzz_vm_core::ImageError;
use bittybuzz_vm_core::message::FULL_FRAME;

use crate::robot::checks::Costs;
use crate::robot::{
    GroupContext, MOST_QUEUED, MOST_SLOTS, News, ProgramId, RobotModel, SimRobot, common_effect,
};
use crate::scenario::{
    Backend, Group, Load, Quantity, Scenario, ScenarioCause, ScenarioError, Selection, WorldChange,
    groups_of,
};

use super::expectation::Bound;
use super::firmware::Firmware;
use super::group::{group_of, id, joining_order};
use super::program::{Compiler, Program};
use super::quantity::QuantityProbe;

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
    /// The programs of [`Scenario::programs`], then those that commands have loaded.
    pub programs: Arc<[Program]>,
    /// The group and the script of each program that follows those of the groups.
    loads: Vec<Load>,
    /// The emulator programs that replace the usual one of a model, by the model's name.
    emulators: Vec<(String, PathBuf)>,
    /// The data flashed to emulated robots, for each model.
    #[cfg_attr(not(feature = "emulators"), expect(dead_code, reason = "nothing is emulated"))]
    pub(super) firmware: Arc<[Firmware]>,
    /// The data that robots with each program share.
    pub(super) contexts: Vec<Arc<GroupContext>>,
    expects: Vec<Bound>,
    plots: Vec<QuantityProbe>,
    /// The instruction costs of each group, where they are known. `None` if scripts are not
    /// checked.
    pub(super) checks: Option<Vec<Option<Arc<Costs>>>>,
    /// Compiles the scripts that commands load.
    compiler: Option<Compiler>,
}

impl Setup {
    /// Checks `programs`, one for each of [`Scenario::programs`], against the scenario.
    pub fn new(
        scenario: impl Into<Arc<Scenario>>,
        programs: impl Into<Arc<[Program]>>,
    ) -> Result<Self, SetupError> {
        let (scenario, programs) = (scenario.into(), programs.into());
        let mut errors = Vec::new();
        for group in &scenario.groups {
            if let Some(needs) = capacity_error(group) {
                let cause = ScenarioCause::CapacityError { robot: group.robot.name.clone(), needs };
                let place = Some(Box::new(group.place.clone()));
                errors.push(ScenarioError { cause, place });
            }
        }
        let scripts = (&scenario.groups[..], &scenario.loads[..]);
        let mut expects = Vec::new();
        for expect in &scenario.expects {
            match QuantityProbe::new(&expect.value, scripts, &programs, &expect.robots) {
                Ok(probe) => expects.push(Bound::new(expect, probe, &scenario)),
                Err(cause) => errors.push(ScenarioError {
                    cause,
                    place: Some(Box::new(expect.value_place.clone())),
                }),
            }
        }
        for event in &scenario.events {
            let WorldChange::Set { robots, global, place, .. } = &event.action else { continue };
            if let Err(cause) = QuantityProbe::new(&global_of(global), scripts, &programs, robots) {
                errors.push(ScenarioError { cause, place: Some(Box::new(place.clone())) });
            }
        }
        let all = Selection::all(scenario.robot_count() as u32);
        let mut plots = Vec::new();
        for (quantity, place) in &scenario.output.plot {
            match QuantityProbe::new(quantity, scripts, &programs, &all) {
                Ok(probe) => plots.push(probe),
                Err(cause) => {
                    errors.push(ScenarioError { cause, place: Some(Box::new(place.clone())) });
                }
            }
        }
        let firmware = Firmware::of(&scenario, &programs);
        let firmware = firmware.unwrap_or_else(|error| {
            errors.push(error);
            Vec::new()
        });
        if !errors.is_empty() {
            return Err(SetupError::Scenario(errors));
        }
        let contexts = contexts(&scenario, &programs);
        for (number, ((group, _), context)) in scenario.programs().zip(&contexts).enumerate() {
            let robot = SimRobot::new(&*group.model, context, News::default(), 0, 0);
            robot.map_err(|cause| SetupError::Refused { program: ProgramId(number), cause })?;
        }
        let (loads, firmware) = (scenario.loads.clone(), firmware.into());
        Ok(Setup {
            scenario,
            programs,
            loads,
            emulators: Vec::new(),
            firmware,
            contexts,
            expects,
            plots,
            checks: None,
            compiler: None,
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

    /// Returns a program.
    pub fn program(&self, ProgramId(number): ProgramId) -> Option<&Program> {
        self.programs.get(number)
    }

    /// Returns the group and the script of each program: those of the scenario, then those that
    /// commands have loaded.
    pub fn scripts(&self) -> impl Iterator<Item = (&Group, &Path)> {
        let groups = &self.scenario.groups;
        let own = groups.iter().map(|group| (group, &*group.script));
        let loads = self.loads.iter();
        own.chain(loads.filter_map(|load| Some((groups.get(load.group)?, &*load.script))))
    }

    /// Returns the program that robots of a group run for a script.
    pub(super) fn program_of(&self, group: usize, script: &Path) -> Option<ProgramId> {
        if self.scenario.groups.get(group)?.script == script {
            return Some(ProgramId(group));
        }
        let is_it = |load: &Load| load.group == group && load.script == script;
        let loaded = self.loads.iter().position(is_it)?;
        Some(ProgramId(self.scenario.groups.len() + loaded))
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
            let Some(group) = self.scenario.groups.get(number) else { continue };
            let program = compiler(script, group)
                .map_err(|report| ScenarioCause::NotCompiled { script: shown(), report })?;
            match self.program_of(number, script).and_then(|known| self.program(known)) {
                Some(known) if known.image == program.image => {}
                Some(_) => return Err(ScenarioCause::ScriptChanged { script: shown() }),
                None => {
                    let load = Load { group: number, script: script.to_owned() };
                    setup.add(load, group, program).map_err(|cause| ScenarioCause::NotLoaded {
                        script: shown(),
                        reason: refusal::sentence(&cause),
                    })?;
                }
            }
        }
        Ok(setup)
    }

    /// Adds a program, or fails if the virtual machine of the group's robots rejects it.
    fn add(&mut self, load: Load, group: &Group, program: Program) -> Result<(), ImageError> {
        let ids = joining_ids(&self.scenario);
        let context = context(group, (ProgramId(self.programs.len()), &program), ids);
        SimRobot::new(&*group.model, &context, News::default(), 0, 0)?;
        for bound in &mut self.expects {
            bound.probe.learn(&bound.expect.value, &program);
        }
        for (plot, (quantity, _)) in self.plots.iter_mut().zip(&self.scenario.output.plot) {
            plot.learn(quantity, &program);
        }
        self.contexts.push(context);
        self.programs = self.programs.iter().cloned().chain([program]).collect();
        self.loads.push(load);
        Ok(())
    }

    /// Returns the program that emulates robots of a model.
    #[cfg(feature = "emulators")]
    pub(super) fn emulator(&self, model: &dyn RobotModel) -> &Path {
        let mut named = self.emulators.iter().filter(|(of, _)| of == model.name());
        let usual = model.emulation().map_or("", |emulation| emulation.program());
        named.next_back().map_or(Path::new(usual), |(_, path)| path)
    }

    /// Returns the expectations with their names resolved.
    pub fn expects(&self) -> &[Bound] {
        &self.expects
    }

    /// Resolves a quantity of all robots in all programs, including those that commands have
    /// loaded.
    pub fn probe(&self, quantity: &Quantity) -> Result<QuantityProbe, ScenarioError> {
        let all = Selection::all(self.scenario.robot_count() as u32);
        let scripts = (&self.scenario.groups[..], &self.loads[..]);
        let probe = QuantityProbe::new(quantity, scripts, &self.programs, &all);
        probe.map_err(|cause| ScenarioError { cause, place: None })
    }

    /// Fails if no program of these robots has a global of that name.
    pub(super) fn check_global(&self, robots: &Selection, name: &str) -> Result<(), ScenarioCause> {
        let scripts = (&self.scenario.groups[..], &self.loads[..]);
        QuantityProbe::new(&global_of(name), scripts, &self.programs, robots).map(|_| ())
    }

    /// Returns the quantities that are drawn over time.
    pub fn plots(&self) -> &[QuantityProbe] {
        &self.plots
    }

    /// Returns the group of a robot by its number.
    pub fn group(&self, number: usize) -> usize {
        group_of(&self.scenario, number).0
    }

    /// Returns the id of a robot by its number.
    pub fn id(&self, number: usize) -> u16 {
        id(&self.scenario, number)
    }
}

fn global_of(name: &str) -> Quantity {
    Quantity::Global { name: name.to_owned(), keys: Vec::new() }
}

/// Returns the data that robots with each program share.
fn contexts(scenario: &Scenario, programs: &[Program]) -> Vec<Arc<GroupContext>> {
    let ids = joining_ids(scenario);
    let programs = scenario.programs().zip(programs).enumerate();
    programs
        .map(|(number, ((group, _), program))| {
            context(group, (ProgramId(number), program), ids.clone())
        })
        .collect()
}

/// Returns the data that robots of a group with that program share.
fn context(
    Group { robot, model, .. }: &Group,
    (id, program): (ProgramId, &Program),
    ids: Arc<[u16]>,
) -> Arc<GroupContext> {
    let effect = |function: &_| model.effect(function).or_else(|| common_effect(function));
    Arc::new(GroupContext::new(robot, (id, &program.image), model.budget(), ids, effect))
}

/// Returns the robots' ids in the order in which they enter the world.
fn joining_ids(scenario: &Scenario) -> Arc<[u16]> {
    joining_order(scenario).into_iter().map(|number| id(scenario, number)).collect()
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
    } else if slots > MOST_SLOTS {
        Some(format!(
            "at most {MOST_SLOTS} slots for the script and what it knows of others, not {slots}"
        ))
    } else if queued > MOST_QUEUED {
        Some(format!("queues of at most {MOST_QUEUED} messages, not {queued}"))
    } else {
        None
    }
}
