//! The reader of the log: up channel 0 of SEGGER's Real Time Transfer.

use crate::{Core, EmulatedRobot, FirmwareImage, MachineError};

/// The first 16 bytes of the control block once the firmware has set it up: the id, padded with
/// zeros.
const ID: &[u8; 16] = b"SEGGER RTT\0\0\0\0\0\0";
/// Offset of the first up channel's descriptor: it follows the id and the numbers of up and down
/// channels.
const UP_CHANNEL: u32 = 24;
/// Offset of the flags within the descriptor, and the mode in which the firmware waits for space in
/// a full buffer.
const FLAGS_OFFSET: u32 = 20;
const BLOCK_IF_FULL: u32 = 2;
/// Offset of RdOff within the descriptor: it follows name, buffer, size and WrOff.
const READ_OFFSET: u32 = 16;
/// Upper limit of a plausible buffer size: no supported chip has more RAM.
const BUFFER_MAX: u32 = 128 * 1024;

/// Reads the firmware's log as a debug probe does: it reads the control block in RAM, and writes
/// nothing except the read offset.
pub struct Rtt {
    control_block: u32,
}

impl Rtt {
    /// Creates the reader of `image`'s log; returns `None` if the image has no RTT control block.
    pub fn new(image: &FirmwareImage) -> Option<Self> {
        image.symbol("_SEGGER_RTT").map(|control_block| Rtt { control_block })
    }

    /// Switches the channel to blocking mode, as probe-rs does: the firmware then waits for a
    /// reader. Does nothing before the control block is set up.
    pub fn block<C: Core>(&self, robot: &mut EmulatedRobot<C>) -> Result<(), MachineError> {
        let mut id = [0; ID.len()];
        robot.read_memory(self.control_block, &mut id)?;
        if id == *ID {
            let flags = self.control_block + UP_CHANNEL + FLAGS_OFFSET;
            robot.write_memory(flags, &BLOCK_IF_FULL.to_le_bytes())?;
        }
        Ok(())
    }

    /// Returns the bytes that were logged since the last call.
    pub fn poll<C: Core>(&self, robot: &mut EmulatedRobot<C>) -> Result<Vec<u8>, MachineError> {
        let mut block = [0; UP_CHANNEL as usize + 24];
        robot.read_memory(self.control_block, &mut block)?;
        let (id, rest) = block.split_at(ID.len());
        if id != ID {
            return Ok(Vec::new());
        }
        let word =
            |at: usize| u32::from_le_bytes([rest[at], rest[at + 1], rest[at + 2], rest[at + 3]]);
        let [buffer, size, write, read] = [12, 16, 20, 24].map(word);
        if write == read || size > BUFFER_MAX || write >= size || read >= size {
            return Ok(Vec::new());
        }
        let parts = if write > read { [(read, write), (0, 0)] } else { [(read, size), (0, write)] };
        let mut bytes = Vec::new();
        for (from, to) in parts {
            let start = bytes.len();
            bytes.resize(start + (to - from) as usize, 0);
            robot.read_memory(buffer.wrapping_add(from), &mut bytes[start..])?;
        }
        let read_offset = self.control_block + UP_CHANNEL + READ_OFFSET;
        robot.write_memory(read_offset, &write.to_le_bytes())?;
        Ok(bytes)
    }
}
