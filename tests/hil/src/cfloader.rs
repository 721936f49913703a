//! A ground station that flashes a Crazyflie by radio with the packets of cfloader, and the robot's
//! two processors at the other end.
//!
//! The packets, their order and the number of attempts are those of cflib 0.1.34
//! (cflib/bootloader/cloader.py), which cfloader and cfclient use. `tests/radio_flash.rs` compares
//! them with recorded packets, and runs cflib itself.

use std::collections::VecDeque;

use bittybuzz_chips::Random;

use crate::loader::{BUFFER_PAGES, FLASH_BYTES, Loader, PAGE, PROGRAM_PAGE, StartedProgram};

const HEADER: u8 = 0xff;
const STM32: u8 = 0xff;
const NRF51: u8 = 0xfe;
/// Bytes in a packet that loads the buffer.
const LOAD_BYTES: usize = 25;
/// Attempts at a write and at a read.
const ATTEMPTS: usize = 6;
/// Attempts of Crazyradio's driver to send a packet.
const SEND_ATTEMPTS: usize = 100;

/// A Crazyflie that is flashed: the radio's processor in front of the loader.
///
/// Commands for the target 0xfe are for the radio's processor: prepare a reset (0xff), reset (0xf0)
/// to the loader (0) or to the firmware (1), sizes of its own flash (0x10). The values are those of
/// crazyflie2-nrf-bootloader, commit f4e3dc1.
pub struct FlashedRobot {
    /// The loader and the flash.
    pub loader: Loader,
    /// The program that runs on the STM32.
    pub started: StartedProgram,
}

impl FlashedRobot {
    /// Creates a robot with this content of the flash, switched on by a short press of its button.
    pub fn new(flash: Vec<u8>) -> Self {
        let mut loader = Loader::new(flash);
        let started = loader.reset(false);
        FlashedRobot { loader, started }
    }

    /// Switches the robot on again. A press of three seconds (`is_long_press`) starts the loader.
    pub fn switch_on(&mut self, is_long_press: bool) {
        self.started = self.loader.reset(is_long_press);
    }

    /// Receives a CRTP packet, and returns the reply.
    pub fn receive(&mut self, packet: &[u8]) -> Option<Vec<u8>> {
        match *packet {
            _ if self.loader.is_off() => None,
            // The reply has the radio's address while the robot is in the loader.
            [HEADER, NRF51, 0xff, ..] => {
                Some(vec![HEADER, NRF51, 0xff, 0x12, 0x34, 0x56, 0x78, 0x9a, 0xbc])
            }
            [HEADER, NRF51, 0xf0, program, ..] => {
                self.started = self.loader.reset(program == 0);
                None
            }
            _ if self.started == StartedProgram::Firmware => None,
            [HEADER, NRF51, 0x10, ..] => {
                let pages = [1024_u16, 1, 232, 108].map(u16::to_le_bytes).concat();
                Some([&[HEADER, NRF51, 0x10], &pages[..], &[0; 12], &[0x10]].concat())
            }
            _ => self.loader.receive(packet),
        }
    }
}

/// The radio between the ground station and the robot.
///
/// Crazyradio's driver sends a packet again until it is acknowledged. So a lost packet arrives
/// later, and a packet whose acknowledgement is lost arrives twice. A reply comes with the
/// acknowledgement of a later packet, and is lost with it.
pub struct Radio {
    /// Probability that a packet or an acknowledgement is lost.
    pub loss: f64,
    /// Probability that a packet is lost between the robot's two processors, where nothing is sent
    /// again.
    pub line_loss: f64,
    random: Random,
}

impl Radio {
    /// Creates a radio that loses packets and acknowledgements with this probability.
    pub fn new(loss: f64, seed: u64) -> Self {
        Radio { loss, line_loss: 0.0, random: Random::new(seed) }
    }

    /// Sends a packet until it is acknowledged, and returns the replies that arrive.
    fn send(
        &mut self,
        robot: &mut FlashedRobot,
        packet: &[u8],
    ) -> Result<VecDeque<Vec<u8>>, RadioFlashError> {
        let mut replies = VecDeque::new();
        for _ in 0..SEND_ATTEMPTS {
            if self.random.chance(self.loss) || robot.loader.is_off() {
                continue;
            }
            if !self.random.chance(self.line_loss) {
                replies.extend(robot.receive(packet));
            }
            if !self.random.chance(self.loss) {
                replies.retain(|_| !self.random.chance(self.loss));
                return Ok(replies);
            }
        }
        Err(RadioFlashError::NoRobot)
    }
}

/// A reason why flashing by radio fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RadioFlashError {
    /// No packet is acknowledged: the robot is off or too far away.
    #[error("the robot acknowledges no packet: switch it on, or bring it nearer")]
    NoRobot,
    /// The loader does not answer this command.
    #[error("the loader does not answer command {0:#04x}: start the robot in its loader")]
    NoReply(u8),
    /// The loader reports an error.
    #[error("the loader refuses the write with error {0}: does the file fit into the flash?")]
    Refused(u8),
}

/// A session of the ground station with one robot.
pub struct Cfloader<'a> {
    /// The robot.
    pub robot: &'a mut FlashedRobot,
    /// The radio in between.
    pub radio: &'a mut Radio,
    /// All packets that the ground station gave to the radio, if they are recorded.
    pub recorded: Option<Vec<Vec<u8>>>,
}

impl Cfloader<'_> {
    /// Restarts the robot in its loader, as a warm boot does.
    pub fn enter_loader(&mut self) -> Result<(), RadioFlashError> {
        self.restart(0)
    }

    /// Restarts the robot in its firmware.
    pub fn leave_loader(&mut self) -> Result<(), RadioFlashError> {
        self.restart(1)
    }

    fn restart(&mut self, program: u8) -> Result<(), RadioFlashError> {
        self.ask(0xff, &[HEADER, NRF51, 0xff], 3)?;
        self.send(&[HEADER, NRF51, 0xf0, program]).map(|_| ())
    }

    /// Flashes a file from the first page of the firmware on.
    pub fn flash(&mut self, file: &[u8]) -> Result<(), RadioFlashError> {
        self.ask(0x10, &[HEADER, STM32, 0x10], 3)?;
        self.ask(0x12, &[HEADER, STM32, 0x12], 3)?;
        self.ask(0x10, &[HEADER, NRF51, 0x10], 3)?;
        for (number, pages) in file.chunks(BUFFER_PAGES * PAGE).enumerate() {
            for (page, bytes) in pages.chunks(PAGE).enumerate() {
                self.load(page as u16, bytes)?;
            }
            let flash_page = PROGRAM_PAGE + number * BUFFER_PAGES;
            self.write(flash_page as u16, pages.len().div_ceil(PAGE) as u16)?;
        }
        Ok(())
    }

    /// Reads the flash from the first page of the firmware on. cflib can, but cfloader does not.
    pub fn read_back(&mut self, bytes: usize) -> Result<Vec<u8>, RadioFlashError> {
        let mut content = Vec::new();
        for page in PROGRAM_PAGE..(PROGRAM_PAGE + bytes.div_ceil(PAGE)).min(FLASH_BYTES / PAGE) {
            let start = content.len();
            for offset in (0..PAGE).step_by(LOAD_BYTES) {
                let [page, offset] = [page as u16, offset as u16].map(u16::to_le_bytes);
                let request = [&[HEADER, STM32, 0x1c], &page[..], &offset].concat();
                content.extend(&self.ask(0x1c, &request, request.len())?[request.len()..]);
            }
            content.truncate(start + PAGE);
        }
        content.truncate(bytes);
        Ok(content)
    }

    fn load(&mut self, page: u16, bytes: &[u8]) -> Result<(), RadioFlashError> {
        for (number, part) in bytes.chunks(LOAD_BYTES).enumerate() {
            let [page, offset] = [page, (number * LOAD_BYTES) as u16].map(u16::to_le_bytes);
            self.send(&[&[HEADER, STM32, 0x14], &page[..], &offset, part].concat())?;
        }
        Ok(())
    }

    fn write(&mut self, flash_page: u16, pages: u16) -> Result<(), RadioFlashError> {
        let fields = [0, flash_page, pages].map(u16::to_le_bytes).concat();
        let reply = self.ask(0x18, &[&[HEADER, STM32, 0x18], &fields[..]].concat(), 3)?;
        match reply[3] {
            1 => Ok(()),
            _ => Err(RadioFlashError::Refused(reply[4])),
        }
    }

    /// Sends a request until a reply comes that begins with the same bytes.
    fn ask(
        &mut self,
        command: u8,
        request: &[u8],
        same: usize,
    ) -> Result<Vec<u8>, RadioFlashError> {
        for _ in 0..ATTEMPTS {
            let replies = self.send(request)?;
            let is_answer = |reply: &Vec<u8>| reply.starts_with(&request[..same]);
            if let Some(reply) = replies.into_iter().find(is_answer) {
                return Ok(reply);
            }
        }
        Err(RadioFlashError::NoReply(command))
    }

    fn send(&mut self, packet: &[u8]) -> Result<VecDeque<Vec<u8>>, RadioFlashError> {
        if let Some(recorded) = &mut self.recorded {
            recorded.push(packet.to_vec());
        }
        self.radio.send(self.robot, packet)
    }
}
