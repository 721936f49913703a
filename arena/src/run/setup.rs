//! A scenario and its programs, checked against each other: what every run of them shares.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use bittybuzz_robot_spec::{Function, OnFault, Profile, Robot as RobotFile};
use bittybuzz_vm_core::{ImageError, Periods, Sizes};

use crate::scenario::{Action, Backend, Body, Cause, Scenario, ScenarioError};

use super::expectation::Bound;
use super::firmware::Firmware;
use super::program::Program;
use super::quantity::Probe;
use super::robot::{CRAZYFLIE_SLOTS, Duties, KILOBOT_SLOTS, Robot, ZOOIDS_SLOTS};
use super::settings::Numbers;

/// Why a scenario cannot be run with these programs.
#[derive(Debug)]
pub enum SetupError {
    /// The scenario asks for what the programs do not have.
    Scenario(Vec<ScenarioError>),
    /// The virtual machine refuses the image of a group.
    Refused {
        /// Number of the group.
        group: usize,
        /// Why.
        cause: ImageError,
    },
}

/// What all runs of a scenario share.
pub struct Setup<'p> {
    /// The scenario.
    pub scenario: &'p Scenario,
    /// The program of each group.
    pub programs: &'p [Program],
    /// The programs that emulate robots of a kind, where they are not the usual ones.
    emulators: Vec<(Body, PathBuf)>,
    /// What is flashed to emulated robots, for each kind.
    pub(super) firmware: Vec<Firmware>,
    /// The id that scripts see, by the order in which robots come into the world.
    ids: Vec<u16>,
    expects: Vec<Bound>,
    plots: Vec<Probe>,
}

/// What the robots of a group share in a run.
pub struct Cast<'p> {
    pub(super) body: Body,
    pub(super) profile: Profile,
    pub(super) image: &'p [u8],
    pub(super) slots: usize,
    pub(super) sizes: Sizes,
    pub(super) duties: Duties,
    pub(super) ids: &'p [u16],
    pub(super) periods: Periods,
    pub(super) on_fault: OnFault,
    functions: Vec<(u16, &'p Function)>,
    /// A robot has logged something.
    news: AtomicBool,
}

impl<'p> Cast<'p> {
    /// The function of that name hash.
    pub fn function(&self, hash: u16) -> Option<&'p Function> {
        let found = self.functions.binary_search_by_key(&hash, |(hash, _)| *hash).ok()?;
        self.functions.get(found).map(|(_, function)| *function)
    }

    /// Whether robots have a function of that name hash.
    pub fn has_function(&self, hash: u16) -> bool {
        self.function(hash).is_some()
    }

    /// Tells the run that there is something to be looked at.
    pub fn note(&self) {
        self.news.store(true, Ordering::Relaxed);
    }

    /// Whether there is, since the last question.
    pub fn take_news(&self) -> bool {
        self.news.swap(false, Ordering::Relaxed)
    }
}

impl<'p> Setup<'p> {
    /// Checks `programs`, one for each group, against the scenario.
    pub fn new(scenario: &'p Scenario, programs: &'p [Program]) -> Result<Self, SetupError> {
        let mut errors = Vec::new();
        for group in &scenario.groups {
            let robot = &group.robot;
            let (profile, slots) = machine(group.body, robot.profile);
            let total = |robot: &RobotFile| robot.vm.slots as usize + robot.sizes().slots();
            let misfit = match robot {
                _ if robot.profile != profile => {
                    Some(format!("profile {}, not {}", profile.name(), robot.profile.name()))
                }
                _ if total(robot) > slots => Some(format!(
                    "at most {slots} slots for the script and what it knows of others, not {}",
                    total(robot)
                )),
                _ => None,
            };
            if let Some(needs) = misfit {
                let cause = Cause::Misfit { robot: robot.name.clone(), needs };
                let place = Some(Box::new(group.place.clone()));
                errors.push(ScenarioError { cause, place });
            }
        }
        let mut expects = Vec::new();
        for expect in &scenario.expects {
            match Probe::new(&expect.value, scenario, programs, &expect.robots) {
                Ok(probe) => expects.push(Bound::new(expect, probe, scenario)),
                Err(cause) => errors.push(ScenarioError {
                    cause,
                    place: Some(Box::new(expect.value_place.clone())),
                }),
            }
        }
        let all = crate::scenario::Selection::all(scenario.robot_count() as u32);
        let mut plots = Vec::new();
        for (quantity, place) in &scenario.output.plot {
            match Probe::new(quantity, scenario, programs, &all) {
                Ok(probe) => plots.push(probe),
                Err(cause) => {
                    errors.push(ScenarioError { cause, place: Some(Box::new(place.clone())) });
                }
            }
        }
        let firmware = Firmware::of(scenario, programs);
        let firmware = firmware.unwrap_or_else(|error| {
            errors.push(error);
            Vec::new()
        });
        if !errors.is_empty() {
            return Err(SetupError::Scenario(errors));
        }
        let ids = joining_order(scenario).into_iter().map(|number| id(scenario, number)).collect();
        let setup =
            Setup { scenario, programs, emulators: Vec::new(), firmware, ids, expects, plots };
        for (group, cast) in setup.casts().iter().enumerate() {
            Robot::new(cast, 0, 0).map_err(|cause| SetupError::Refused { group, cause })?;
        }
        Ok(setup)
    }

    /// Names the program that emulates robots of a kind: a path, or a name that PATH knows. It is that of [`emulator`] otherwise.
    #[must_use]
    pub fn emulated_by(mut self, body: Body, emulator: PathBuf) -> Self {
        self.emulators.push((body, emulator));
        self
    }

    /// The program that emulates robots of a kind.
    pub(super) fn emulator(&self, body: Body) -> &Path {
        let mut named = self.emulators.iter().filter(|(of, _)| *of == body);
        named.next_back().map_or(Path::new(emulator(body)), |(_, path)| path)
    }

    /// What the groups of a run share.
    pub fn casts(&self) -> Vec<Cast<'_>> {
        let model = Numbers::new(self.scenario).kilobot;
        let duties = Duties { straight: model.straight_duty, turn: model.turn_duty };
        let groups = self.scenario.groups.iter().zip(self.programs);
        groups
            .map(|(group, program)| {
                let mut functions: Vec<_> =
                    group.robot.functions.iter().map(|known| (known.hash(), known)).collect();
                functions.sort_by_key(|(hash, _)| *hash);
                Cast {
                    body: group.body,
                    profile: group.robot.profile,
                    image: &program.image,
                    slots: group.robot.vm.slots as usize,
                    sizes: group.robot.sizes(),
                    duties,
                    ids: &self.ids,
                    periods: Periods {
                        beacon: steps(group.robot.vm.beacon_steps),
                        forget: steps(group.robot.vm.forget_steps),
                        advertise: steps(group.robot.vm.advertise_steps),
                    },
                    on_fault: group.robot.on_fault,
                    functions,
                    news: AtomicBool::new(false),
                }
            })
            .collect()
    }

    /// The expectations, with what their names mean.
    pub fn expects(&self) -> &[Bound] {
        &self.expects
    }

    /// What is drawn over time.
    pub fn plots(&self) -> &[Probe] {
        &self.plots
    }

    /// The group of a robot by its number.
    pub fn group(&self, number: usize) -> usize {
        group_of(self.scenario, number).0
    }

    /// The id of a robot by its number.
    pub fn id(&self, number: usize) -> u16 {
        id(self.scenario, number)
    }
}

/// The emulator that is taken if none is named: the fastest that plays these robots.
pub fn emulator(body: Body) -> &'static str {
    match body {
        Body::Kilobot => "bbz-emulate-avr",
        Body::Zooid => "bbz-emulate-m0",
        Body::Crazyflie => "bbz-emulate-stm32",
    }
}

/// The kinds of robots that run their firmware in a scenario.
pub fn emulated(scenario: &Scenario) -> Vec<Body> {
    let mut bodies = Vec::new();
    for group in scenario.groups.iter().filter(|group| group.backend != Backend::Vm) {
        if !bodies.contains(&group.body) {
            bodies.push(group.body);
        }
    }
    bodies
}

/// Robot files have no more than a byte holds.
fn steps(count: u32) -> u8 {
    u8::try_from(count).unwrap_or(u8::MAX)
}

/// Profile and most slots of the machine in a body, which shall be of a profile if it can.
fn machine(body: Body, wanted: Profile) -> (Profile, usize) {
    match body {
        Body::Kilobot => (Profile::Tiny, KILOBOT_SLOTS),
        Body::Zooid => (Profile::Tiny, ZOOIDS_SLOTS),
        Body::Crazyflie => (wanted, CRAZYFLIE_SLOTS),
    }
}

fn id(scenario: &Scenario, number: usize) -> u16 {
    let (group, within) = group_of(scenario, number);
    scenario.groups.get(group).map_or(0, |group| group.first_id + within as u16)
}

/// The group of a robot, and its number in it.
pub fn group_of(scenario: &Scenario, number: usize) -> (usize, usize) {
    let mut within = number;
    for (index, group) in scenario.groups.iter().enumerate() {
        if within < group.count as usize {
            return (index, within);
        }
        within -= group.count as usize;
    }
    (scenario.groups.len(), within)
}

/// The robots' numbers in the order in which they come into the world: whoever is there, then who joins.
pub fn joining_order(scenario: &Scenario) -> Vec<usize> {
    let mut order = Vec::new();
    let mut is_there = Vec::new();
    for group in &scenario.groups {
        for _ in 0..group.count {
            if group.present {
                order.push(is_there.len());
            }
            is_there.push(group.present);
        }
    }
    for event in &scenario.events {
        let Action::Join(robots) = &event.action else { continue };
        for number in robots.iter() {
            if let Some(is_there) = is_there.get_mut(number).filter(|is_there| !**is_there) {
                *is_there = true;
                order.push(number);
            }
        }
    }
    order
}
