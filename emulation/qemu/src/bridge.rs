//! The robot as the protocol sees it.

use std::time::Duration;

use bittybuzz_chips::Board;
use bittybuzz_emulation::message::{CoreStatistics, TimedEvent};
use bittybuzz_emulation::{Control, Image, Machine, MachineError, Pause};

use crate::memory::FLASH;
use crate::robot::{Robot, RobotError};

/// A board, and the core on it once an image is loaded.
pub struct Bridge<B> {
    board: B,
    robot: Option<Robot>,
}

impl<B: Board> Bridge<B> {
    /// Without an image.
    pub fn new() -> Self {
        Bridge { board: B::power_on(0), robot: None }
    }

    fn parts(&mut self) -> Result<(&mut Robot, &mut B), MachineError> {
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

impl<B: Control> Machine for Bridge<B> {
    type Board = B;

    fn load(&mut self, image: &Image) -> Result<(), MachineError> {
        self.robot = None;
        self.board = B::power_on(0);
        let mut flash = vec![0xff; FLASH.len()];
        for (address, bytes) in image.segments() {
            let place = address
                .checked_sub(FLASH.start)
                .and_then(|start| flash.get_mut(start as usize..)?.get_mut(..bytes.len()))
                .ok_or(MachineError::NoMemory { address, length: bytes.len() })?;
            place.copy_from_slice(bytes);
        }
        self.robot = Some(Robot::new(B::CORE, &mut self.board, flash, image.vectors())?);
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

    fn board(&mut self) -> &mut B {
        &mut self.board
    }
}
