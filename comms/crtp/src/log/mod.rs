//! Logs: port 5. A ground station makes blocks of variables, and the robot sends each in its
//! period. Source: log.c of crazyflie-firmware.

mod table;

pub use table::LogVariable;

use heapless::Vec;

use crate::packet::{Packet, Port, RawPacket};
use crate::refusal::Refusal;
use crate::toc;
use crate::value::{Value, WireType};

/// Blocks and variables in all of them, as many as cflib assumes (cflib/crazyflie/log.py).
const BLOCKS_MAX: usize = 16;
const ITEMS_MAX: usize = 128;
/// Bytes of the values of a block: those of a packet without the block's id and the time.
const VALUES_MAX: usize = 26;

/// The channels.
const TABLE: u8 = 0;
const CONTROL: u8 = 1;
const DATA: u8 = 2;

/// The commands of channel 1.
mod command {
    pub const DELETE: u8 = 2;
    /// The period is in units of 10 ms.
    pub const START: u8 = 3;
    pub const STOP: u8 = 4;
    pub const RESET: u8 = 5;
    pub const CREATE: u8 = 6;
    pub const APPEND: u8 = 7;
    /// The period is in ms.
    pub const START_MS: u8 = 8;
}

/// A variable whose address a station names instead of an id. The robot does not serve those.
const RAW_MEMORY: u16 = 0xffff;

/// Numbers of errors in answers: the errno of newlib, which cflib translates.
mod errno {
    pub const OK: u8 = 0;
    pub const NO_ENTRY: u8 = 2;
    pub const TOO_BIG: u8 = 7;
    pub const NO_EXEC: u8 = 8;
    pub const NO_MEMORY: u8 = 12;
    pub const EXISTS: u8 = 17;
}

/// A variable of a block, in the type that the station asked for.
#[derive(Clone, Copy, Debug)]
struct Item {
    variable: LogVariable,
    wire: WireType,
}

/// The times at which a block is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Schedule {
    Stopped,
    Once { due_ms: u64 },
    Every { period_ms: u16, due_ms: u64 },
}

#[derive(Clone, Debug)]
struct Block {
    id: u8,
    items: Vec<Item, VALUES_MAX>,
    schedule: Schedule,
}

impl Block {
    fn bytes(&self) -> usize {
        self.items.iter().map(|item| item.wire.bytes()).sum()
    }

    fn due_ms(&self) -> Option<u64> {
        match self.schedule {
            Schedule::Stopped => None,
            Schedule::Once { due_ms } | Schedule::Every { due_ms, .. } => Some(due_ms),
        }
    }
}

/// The blocks of the ground station.
#[derive(Clone, Debug, Default)]
pub(crate) struct LogBlocks {
    blocks: Vec<Block, BLOCKS_MAX>,
}

impl LogBlocks {
    /// Answers a packet of port 5. A refusal counts and may have an answer all the same.
    pub fn receive(
        &mut self,
        packet: &RawPacket<'_>,
        now_ms: u64,
    ) -> (Result<(), Refusal>, Option<Packet>) {
        let data = packet.data();
        match packet.channel() {
            TABLE => {
                let limits = [BLOCKS_MAX as u8, ITEMS_MAX as u8];
                let count = LogVariable::ALL.len() as u16;
                let entry = |id| LogVariable::of_id(id).map(LogVariable::entry);
                match toc::answer(Port::Log, data, table::CRC, count, &limits, entry) {
                    Ok(answer) => (Ok(()), Some(answer)),
                    Err(refusal) => (Err(refusal), None),
                }
            }
            CONTROL => self.control(data, now_ms),
            _ => (Err(Refusal::Unknown), None),
        }
    }

    /// Deletes all blocks.
    pub fn reset(&mut self) {
        self.blocks.clear();
    }

    /// Returns the packet of the block that is due for the longest time, if one is.
    pub fn poll(
        &mut self,
        now_ms: u64,
        mut read: impl FnMut(LogVariable) -> Value,
    ) -> Option<Packet> {
        let due = self.blocks.iter_mut().filter(|block| block.due_ms().is_some());
        let block = due.min_by_key(|block| block.due_ms())?;
        block.due_ms().filter(|due_ms| *due_ms <= now_ms)?;
        block.schedule = match block.schedule {
            Schedule::Every { period_ms, due_ms } => {
                // Packets that are late by a period and more are left out.
                let next_ms = due_ms + u64::from(period_ms);
                let due_ms = if next_ms > now_ms { next_ms } else { now_ms + u64::from(period_ms) };
                Schedule::Every { period_ms, due_ms }
            }
            Schedule::Once { .. } | Schedule::Stopped => Schedule::Stopped,
        };
        let [a, b, c, ..] = now_ms.to_le_bytes();
        let mut packet = Packet::new(Port::Log, DATA).with(&[block.id, a, b, c]);
        for item in &block.items {
            let bytes = item.wire.encode(read(item.variable));
            packet = packet.with(bytes.get(..item.wire.bytes()).unwrap_or(&[]));
        }
        Some(packet)
    }

    fn control(&mut self, data: &[u8], now_ms: u64) -> (Result<(), Refusal>, Option<Packet>) {
        let Some((&command, rest)) = data.split_first() else {
            return (Err(Refusal::Length), None);
        };
        let id = rest.first().copied();
        let result = match (command, id) {
            (command::RESET, _) => {
                self.reset();
                Ok(())
            }
            (_, None) => Err((Refusal::Length, errno::NO_EXEC)),
            (_, Some(id)) => self.change(command, id, rest.get(1..).unwrap_or(&[]), now_ms),
        };
        let (result, error) = match result {
            Ok(()) => (Ok(()), errno::OK),
            Err((refusal, error)) => (Err(refusal), error),
        };
        let answer = Packet::new(Port::Log, CONTROL);
        (result, Some(answer.with(&[command, id.unwrap_or(0), error])))
    }

    /// Executes a command about one block.
    fn change(
        &mut self,
        command: u8,
        id: u8,
        arguments: &[u8],
        now_ms: u64,
    ) -> Result<(), (Refusal, u8)> {
        const MISSING: (Refusal, u8) = (Refusal::LogBlock, errno::NO_ENTRY);
        let place = self.blocks.iter().position(|block| block.id == id);
        let period = match (command, arguments) {
            (command::CREATE, _) => return self.create(id, arguments),
            (command::APPEND, _) => {
                place.ok_or(MISSING)?;
                return self.append(id, arguments);
            }
            (command::DELETE, []) => {
                place.ok_or(MISSING)?;
                self.blocks.retain(|block| block.id != id);
                return Ok(());
            }
            (command::STOP, []) => None,
            (command::START, [tens]) => Some(u16::from(*tens) * 10),
            (command::START_MS, [low, high]) => Some(u16::from_le_bytes([*low, *high])),
            (command::DELETE | command::STOP | command::START | command::START_MS, _) => {
                return Err((Refusal::Length, errno::NO_EXEC));
            }
            _ => return Err((Refusal::Unknown, errno::NO_EXEC)),
        };
        let block = place.and_then(|place| self.blocks.get_mut(place)).ok_or(MISSING)?;
        block.schedule = match period {
            None => Schedule::Stopped,
            Some(0) => Schedule::Once { due_ms: now_ms },
            Some(period_ms) => Schedule::Every { period_ms, due_ms: now_ms + u64::from(period_ms) },
        };
        Ok(())
    }

    fn create(&mut self, id: u8, variables: &[u8]) -> Result<(), (Refusal, u8)> {
        if self.blocks.iter().any(|block| block.id == id) {
            return Err((Refusal::LogBlock, errno::EXISTS));
        }
        let block = Block { id, items: Vec::new(), schedule: Schedule::Stopped };
        self.blocks.push(block).map_err(|_| (Refusal::LogBlock, errno::NO_MEMORY))?;
        self.append(id, variables)
    }

    /// Adds variables, each a type and an id. cflib leaves the type of the variable that does not
    /// fit at the end of a full packet (`_setup_log_elements`), so a rest of that length is ignored.
    fn append(&mut self, id: u8, variables: &[u8]) -> Result<(), (Refusal, u8)> {
        let count: usize = self.blocks.iter().map(|block| block.items.len()).sum();
        let Some(block) = self.blocks.iter_mut().find(|block| block.id == id) else {
            return Err((Refusal::LogBlock, errno::NO_ENTRY));
        };
        let (settings, _) = variables.as_chunks::<3>();
        for (number, [wire, id @ ..]) in settings.iter().enumerate() {
            let id = u16::from_le_bytes(*id);
            if id == RAW_MEMORY {
                return Err((Refusal::Unsupported, errno::NO_ENTRY));
            }
            // The upper half is the type in which the variable is stored, which the robot knows.
            let wire = WireType::of_log(wire & 0x0f).ok_or((Refusal::Unknown, errno::NO_ENTRY))?;
            let variable = LogVariable::of_id(id).ok_or((Refusal::NoVariable, errno::NO_ENTRY))?;
            if block.bytes() + wire.bytes() > VALUES_MAX {
                return Err((Refusal::LogBlock, errno::TOO_BIG));
            }
            if count + number >= ITEMS_MAX || block.items.push(Item { variable, wire }).is_err() {
                return Err((Refusal::LogBlock, errno::NO_MEMORY));
            }
        }
        Ok(())
    }
}
