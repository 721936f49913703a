//! The robot as the protocol sees it.

use std::time::Duration;

use bittybuzz_chips::{Crazyflie, Settings};
use bittybuzz_emulation::message::{CoreStatistics, TimedEvent};
use bittybuzz_emulation::{Image, Machine, MachineError, Pause};

use crate::memory::FLASH;
use crate::robot::{Robot, RobotError};

/// A board, and the core on it once an image is loaded.
pub struct Bridge {
    board: Crazyflie,
    robot: Option<Robot>,
}

impl Bridge {
    /// Without an image.
    pub fn new() -> Self {
        Bridge { board: Crazyflie::new(Settings::default()), robot: None }
    }

    fn parts(&mut self) -> Result<(&mut Robot, &mut Crazyflie), MachineError> {
        match &mut self.robot {
            Some(robot) => Ok((robot, &mut self.board)),
            None => Err(MachineError::Emulation("no image is loaded".into())),
        }
    }
}

impl From<RobotError> for MachineError {
    fn from(error: RobotError) -> Self {
        MachineError::Emulation(error.to_string())
    }
}

impl Machine for Bridge {
    type Board = Crazyflie;

    fn load(&mut self, image: &Image) -> Result<(), MachineError> {
        self.robot = None;
        self.board = Crazyflie::new(Settings::default());
        let mut flash = vec![0xff; FLASH.len()];
        for (address, bytes) in image.segments() {
            let place = address
                .checked_sub(FLASH.start)
                .and_then(|start| flash.get_mut(start as usize..)?.get_mut(..bytes.len()))
                .ok_or(MachineError::NoMemory { address, length: bytes.len() })?;
            place.copy_from_slice(bytes);
        }
        self.robot = Some(Robot::new(flash, image.vectors())?);
        Ok(())
    }

    fn run(&mut self, until: Duration) -> Result<Pause, MachineError> {
        let (robot, board) = self.parts()?;
        Ok(robot.run(board, until)?)
    }

    fn write_memory(&mut self, address: u32, bytes: &[u8]) -> Result<(), MachineError> {
        let (robot, _) = self.parts()?;
        match robot.write_memory(address, bytes)? {
            true => Ok(()),
            false => Err(MachineError::NoMemory { address, length: bytes.len() }),
        }
    }

    fn read_memory(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), MachineError> {
        let (robot, _) = self.parts()?;
        match robot.read_memory(address, bytes)? {
            true => Ok(()),
            false => Err(MachineError::NoMemory { address, length: bytes.len() }),
        }
    }

    fn skip(&mut self, address: u32) -> Result<(), MachineError> {
        let (robot, _) = self.parts()?;
        Ok(robot.skip(address)?)
    }

    fn take_events(&mut self) -> Vec<TimedEvent> {
        match &mut self.robot {
            Some(robot) => robot.take_events(&mut self.board),
            None => Vec::new(),
        }
    }

    fn statistics(&self) -> CoreStatistics {
        self.robot.as_ref().map(Robot::statistics).unwrap_or_default()
    }

    fn board(&mut self) -> &mut Crazyflie {
        &mut self.board
    }
}
