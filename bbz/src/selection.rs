//! The robots and the profile that the command line selects.

use std::sync::Arc;

use bittybuzz_arena::scenario::{EmbeddedFiles, Group};
use bittybuzz_compiler::check::outside::OutsideUses;
use bittybuzz_compiler::compile::Options;
use bittybuzz_robot_files::{all_shipped, find};
use bittybuzz_robot_spec::{NumberProfile, Robot, RobotErrors};
use clap::{Args, ValueEnum};

use crate::problem::{Problem, ProblemMessage};

/// `--robot` names no robot, or the robot file is wrong: a message for each mistake of the file.
impl Problem for RobotErrors {
    fn messages(&self) -> Vec<ProblemMessage<'_>> {
        let RobotErrors(errors) = self;
        let messages = errors.iter().map(|error| ProblemMessage {
            text: error.to_string(),
            place: error.place.as_deref(),
            help: error.help(),
        });
        messages.collect()
    }
}

/// `--robot` and `--profile`.
#[derive(Debug, Args)]
pub struct SelectionArguments {
    /// Robot: its name (see `bbz robots`) or the path of a robot file (*.toml)
    #[arg(long, value_name = "NAME|PATH.toml")]
    robot: Option<String>,
    /// Number profile: 16-bit or 32-bit numbers [default: the robot's, else full]
    #[arg(long)]
    profile: Option<ProfileName>,
}

// No comments on the variants: they would be printed as help.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ProfileName {
    Tiny,
    Full,
}

/// The robots of a command.
pub struct RobotChoice {
    /// The robot that `--robot` names.
    pub robot: Option<Robot>,
    /// All shipped robots, and those of the scenario.
    pub known: Vec<Robot>,
    /// The profile that `--profile` names.
    pub profile: Option<NumberProfile>,
    /// The names that a scenario uses in the script.
    outside: OutsideUses,
    /// The files that stand in the scenario itself.
    pub embedded: Arc<EmbeddedFiles>,
}

impl SelectionArguments {
    /// Finds the robot.
    pub fn select(&self) -> Result<RobotChoice, RobotErrors> {
        RobotChoice::new(self.robot.as_deref(), self.profile)
    }
}

impl RobotChoice {
    /// Selects the robot of that name or path.
    pub fn new(robot: Option<&str>, profile: Option<ProfileName>) -> Result<Self, RobotErrors> {
        let robot = robot.map(find).transpose()?;
        let profile = profile.map(|name| match name {
            ProfileName::Tiny => NumberProfile::Tiny,
            ProfileName::Full => NumberProfile::Full,
        });
        let (outside, embedded) = (OutsideUses::default(), Arc::default());
        Ok(RobotChoice { robot, known: all_shipped(), profile, outside, embedded })
    }

    /// Selects the robot of a group. The other robots of its scenario are known too, because one
    /// script may be for all of them.
    pub fn of_group(group: &Group) -> Self {
        let mut known = all_shipped();
        let others = group.robots_of_scenario.iter();
        let others: Vec<Robot> = others.filter(|robot| !known.contains(robot)).cloned().collect();
        known.extend(others);
        let outside = (*group.outside).clone();
        let (robot, embedded) = (Some((*group.robot).clone()), Arc::clone(&group.embedded));
        RobotChoice { robot, known, profile: None, outside, embedded }
    }

    /// Returns the options of the compiler.
    pub fn options(&self) -> Options {
        Options {
            profile: self.profile,
            robot: self.robot.clone(),
            robots: self.known.clone(),
            outside: self.outside.clone(),
        }
    }

    /// Returns the profile to compile for.
    pub fn effective_profile(&self) -> NumberProfile {
        let of_robot = self.robot.as_ref().map(|robot| robot.profile);
        self.profile.or(of_robot).unwrap_or(NumberProfile::Full)
    }

    /// Returns the robots whose functions a script may call: the named one, else all.
    pub fn playable(&self) -> impl Iterator<Item = &Robot> + Clone {
        let all: &[Robot] = if self.robot.is_some() { &[] } else { &self.known };
        self.robot.iter().chain(all)
    }

    /// Returns true if one of the playable robots has a function of that name hash.
    pub fn has_function(&self, hash: u16) -> bool {
        let mut functions = self.playable().flat_map(|robot| &robot.functions);
        functions.any(|function| function.hash() == hash)
    }
}
