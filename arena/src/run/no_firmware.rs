//! The substitute for the module `firmware` in a build without the feature `emulators`. Its types
//! have no values, so no robot can be emulated.

use std::fmt;

use crate::engine::{LinkStatistics, Loss, Medium, RobotId, World};
use crate::robot::{BatteryState, SimRobot};
use crate::scenario::{Scenario, ScenarioError};

use super::event_queue::EventQueue;
use super::program::LoadedProgram;
use super::setup::Setup;

/// The firmware of emulated robots.
pub enum Firmware {}

impl Firmware {
    /// Returns an empty list: the reader of scenarios rejects groups with firmware.
    pub fn for_scenario(_: &Scenario, _: &[LoadedProgram]) -> Result<Vec<Self>, ScenarioError> {
        Ok(Vec::new())
    }
}

/// All emulated robots of a run.
pub enum Fleets {}

impl Fleets {
    pub fn start(
        _: &Setup,
        _: &World<SimRobot>,
        _: &EventQueue,
        _: u32,
    ) -> Result<Option<Self>, ScenarioError> {
        Ok(None)
    }

    pub fn lose(&mut self, _: Medium, _: Loss) -> Result<(), FirmwareError> {
        match *self {}
    }

    pub fn set_battery(&mut self, _: RobotId, _: u16) -> Result<(), FirmwareError> {
        match *self {}
    }

    pub fn battery(&self, _: RobotId) -> Option<BatteryState> {
        match *self {}
    }

    pub fn switch_off(&mut self, _: RobotId) -> Result<(), FirmwareError> {
        match *self {}
    }

    pub fn settle(&mut self, _: &World<SimRobot>) -> Result<(), FirmwareError> {
        match *self {}
    }

    pub fn advance(&mut self, _: &mut World<SimRobot>) -> Result<(), FirmwareError> {
        match *self {}
    }

    pub fn links(&mut self) -> Result<Vec<(Medium, LinkStatistics, u64)>, FirmwareError> {
        match *self {}
    }
}

/// The error of a run with emulated robots, which this build does not have.
#[derive(Debug)]
pub enum FirmwareError {}

impl fmt::Display for FirmwareError {
    fn fmt(&self, _: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {}
    }
}

impl std::error::Error for FirmwareError {}
