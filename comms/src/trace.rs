//! A robot's reports about its script: records, small enough for a debug probe, that the host turns into text with the
//! script's symbols.
//!
//! A record is one kind byte and the fields below, least significant byte first. On STM32 robots it travels as the
//! defmt message `bbz {=[u8]}`, so that it keeps its place among the firmware's own messages.
//!
//! | kind | fields |
//! |---|---|
//! | 1 start | robot id `u16`, script hash `u32` |
//! | 2 log | step `u32`, items up to the end |
//! | 3 fault | step `u32`, cause `u8`, operand types `u8` `u8`, detail `u16`, positions `u16` of the calls, innermost first |
//! | 4 refused | why the image cannot run: cause `u8`, value `u16` |
//! | 5 overrun | step `u32`, ticks missed since the start `u32` |
//! | 6 expired | step `u32`: the set-points have expired, the robot has stopped |
//! | 7 lost | log lines `u32` that were printed faster than they could be told |
//! | 8 unused | messages that came to nothing since the start, `u16` each: no room for heard ones, for own ones; of another script, without sense, with the robot's own id, entries not kept, incomplete, undecided, failed |
//! | 9 contained | the fields of 3: a fault that ended a listener or a handler of conflicts; the script goes on |
//! | 10 restart | step `u32`, ticks `u16` until the script starts again after a fault; 0: it starts now |
//!
//! An item is a tag and its payload: 0 nil, 1 integer `i32`, 2 float `f32`, 3 string by number `u16`, 4 text (length
//! `u8`, bytes), 5 table (entries `u16`), 6 function, 7 the rest did not fit.

use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{
    Argument, Arguments, ByteCode, Counters, Fault, FaultCode, ImageError, Type,
};
use heapless::Vec;

/// Most bytes of a record.
pub const RECORD_MAX: usize = 96;

/// A record as it travels.
pub type Encoded = Vec<u8, RECORD_MAX>;

const START: u8 = 1;
const LOG: u8 = 2;
const FAULT: u8 = 3;
const REFUSED: u8 = 4;
const OVERRUN: u8 = 5;
const EXPIRED: u8 = 6;
const LOST: u8 = 7;
const UNUSED: u8 = 8;
const CONTAINED: u8 = 9;
const RESTART: u8 = 10;

const NIL: u8 = 0;
const INT: u8 = 1;
const FLOAT: u8 = 2;
const STRING: u8 = 3;
const TEXT: u8 = 4;
const TABLE: u8 = 5;
const FUNCTION: u8 = 6;
const REST: u8 = 7;

/// Bytes of the longest item that has one length.
const ITEM_MAX: usize = 5;

/// The text that `show` prints before the ms of the stopwatch.
const BEFORE_TIME: &[u8] = b" after ";
/// The text after them.
const AFTER_TIME: &[u8] = b" ms";
/// Bytes of the items with the time.
const TIME_BYTES: usize = 2 + BEFORE_TIME.len() + ITEM_MAX + 2 + AFTER_TIME.len();

/// A record, read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Record<'a> {
    /// A script begins.
    Start {
        /// The robot that reports.
        robot_id: u16,
        /// The hash of the script that runs.
        script_hash: u32,
    },
    /// `log(...)`
    Log {
        /// Steps completed before.
        step: u32,
        /// The printed items.
        items: Items<'a>,
    },
    /// The script has stopped.
    Fault {
        /// Steps completed before.
        step: u32,
        /// The fault.
        fault: Fault,
        /// The calls that led there, innermost first: positions in the code.
        calls: Calls<'a>,
    },
    /// The image in flash cannot run.
    Refused(ImageError),
    /// A step took longer than a tick.
    Overrun {
        /// Steps completed before.
        step: u32,
        /// Ticks missed since the start.
        missed: u32,
    },
    /// No step was completed for long enough that the robot has stopped.
    Expired {
        /// Steps completed before.
        step: u32,
    },
    /// This number of log lines was printed faster than they could be sent.
    Lost(u32),
    /// Messages came to nothing; all of them since the start.
    Unused(Unused),
    /// A fault ended a listener or a handler of conflicts. The script goes on.
    Contained {
        /// Steps completed before.
        step: u32,
        /// The fault.
        fault: Fault,
        /// Positions in the code of the calls that led there, innermost first.
        calls: Calls<'a>,
    },
    /// The script starts again after a fault that stopped it.
    Restart {
        /// Steps completed before.
        step: u32,
        /// Ticks of a tenth of a second until the start; 0 if it starts now.
        pause: u16,
    },
}

/// Messages that came to nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Unused {
    /// Frames for which queues had no room: heard, and to be sent.
    pub dropped: [u16; 2],
    /// The messages that the script's machine discarded.
    pub messages: Counters,
}

/// A value that a script printed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PrintedValue<'a> {
    /// nil
    Nil,
    /// An integer.
    Int(i32),
    /// A float.
    Float(f32),
    /// A string of the script, by number.
    String(u16),
    /// A string made at run time.
    Text(&'a [u8]),
    /// A table with this number of entries.
    Table(u16),
    /// A function.
    Function,
    /// More was printed than a record holds.
    Rest,
}

/// Bytes that are no record: of another version, or damaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordError {
    /// No such kind of record.
    Kind(u8),
    /// It ends too early or too late.
    Length,
    /// A field has a value that means nothing.
    Value,
}

/// A script begins.
pub fn start(robot_id: u16, script_hash: u32) -> Encoded {
    let mut record = Encoded::new();
    put(&mut record, &[START]);
    put(&mut record, &robot_id.to_le_bytes());
    put(&mut record, &script_hash.to_le_bytes());
    record
}

/// `log(...)`, in a script that has completed `step` steps.
pub fn log<P: Profile, C: ByteCode, const SLOTS: usize>(
    step: u32,
    arguments: &Arguments<'_, P, C, SLOTS>,
) -> Encoded {
    let mut record = with_step(LOG, step);
    for index in 0..arguments.count() {
        // One byte stays free, to say that there was more.
        let room = RECORD_MAX - 1 - record.len();
        let argument = arguments.item(index);
        if room < ITEM_MAX {
            put(&mut record, &[REST]);
            break;
        }
        match argument {
            Argument::Nil => put(&mut record, &[NIL]),
            Argument::Int(value) => put_item(&mut record, INT, &value.to_le_bytes()),
            Argument::Float(value) => put_item(&mut record, FLOAT, &value.to_le_bytes()),
            Argument::Table(size) => {
                let size = u16::try_from(size).unwrap_or(u16::MAX);
                put_item(&mut record, TABLE, &size.to_le_bytes());
            }
            Argument::Function => put(&mut record, &[FUNCTION]),
            Argument::String(text) => match text.number() {
                Some(number) => put_item(&mut record, STRING, &number.to_le_bytes()),
                // The tiny profile has none.
                None if !P::FULL => put(&mut record, &[REST]),
                None => {
                    let length = text.bytes().count();
                    let kept = length.min(room - 2);
                    put_item(&mut record, TEXT, &[kept as u8]);
                    text.bytes().take(kept).for_each(|byte| put(&mut record, &[byte]));
                    if kept < length {
                        put(&mut record, &[REST]);
                        break;
                    }
                }
            },
        }
    }
    record
}

/// Values with the ms on a stopwatch.
pub fn log_with_time<P: Profile, C: ByteCode, const SLOTS: usize>(
    step: u32,
    arguments: &Arguments<'_, P, C, SLOTS>,
    ms: i32,
) -> Encoded {
    let mut record = log(step, arguments);
    if record.len() + TIME_BYTES <= RECORD_MAX {
        put_item(&mut record, TEXT, &[BEFORE_TIME.len() as u8]);
        put(&mut record, BEFORE_TIME);
        put_item(&mut record, INT, &ms.to_le_bytes());
        put_item(&mut record, TEXT, &[AFTER_TIME.len() as u8]);
        put(&mut record, AFTER_TIME);
    }
    record
}

/// The script has stopped. The record has the innermost calls, as many as fit.
pub fn fault(step: u32, fault: &Fault, calls: impl Iterator<Item = u16>) -> Encoded {
    with_fault(FAULT, step, fault, calls)
}

/// A fault ended a listener or a handler of conflicts, and the script goes on. The calls are cut as in [`fault`].
pub fn contained(step: u32, fault: &Fault, calls: impl Iterator<Item = u16>) -> Encoded {
    with_fault(CONTAINED, step, fault, calls)
}

/// The script starts again in `pause` ticks of a tenth of a second, or now if `pause` is 0.
pub fn restart(step: u32, pause: u16) -> Encoded {
    let mut record = with_step(RESTART, step);
    put(&mut record, &pause.to_le_bytes());
    record
}

/// The image in flash cannot run.
pub fn refused(error: ImageError) -> Encoded {
    let mut record = Encoded::new();
    let (cause, value) = error.to_code();
    put(&mut record, &[REFUSED, cause]);
    put(&mut record, &value.to_le_bytes());
    record
}

/// A step took longer than a tick; `missed` ticks since the start.
pub fn overrun(step: u32, missed: u32) -> Encoded {
    let mut record = with_step(OVERRUN, step);
    put(&mut record, &missed.to_le_bytes());
    record
}

/// The set-points have expired.
pub fn expired(step: u32) -> Encoded {
    with_step(EXPIRED, step)
}

/// `count` log lines were printed faster than they could be sent.
pub fn lost(count: u32) -> Encoded {
    with_step(LOST, count)
}

/// Messages came to nothing.
pub fn unused(unused: &Unused) -> Encoded {
    let Unused { dropped: [unread, unsent], messages } = *unused;
    let Counters { foreign, malformed, own_id, not_kept, incomplete, undecided, failed } = messages;
    let mut record = Encoded::new();
    put(&mut record, &[UNUSED]);
    for count in
        [unread, unsent, foreign, malformed, own_id, not_kept, incomplete, undecided, failed]
    {
        put(&mut record, &count.to_le_bytes());
    }
    record
}

fn with_step(kind: u8, step: u32) -> Encoded {
    let mut record = Encoded::new();
    put(&mut record, &[kind]);
    put(&mut record, &step.to_le_bytes());
    record
}

fn with_fault(kind: u8, step: u32, fault: &Fault, calls: impl Iterator<Item = u16>) -> Encoded {
    let mut record = with_step(kind, step);
    let [first, second] = fault.operands;
    put(&mut record, &[fault.code as u8, first as u8, second as u8]);
    put(&mut record, &fault.detail.to_le_bytes());
    // The machine's own position is that of the innermost call.
    for position in calls.take((RECORD_MAX - record.len()) / 2) {
        put(&mut record, &position.to_le_bytes());
    }
    record
}

fn put_item(record: &mut Encoded, tag: u8, payload: &[u8]) {
    put(record, &[tag]);
    put(record, payload);
}

/// Records are built so that everything fits; the rest is left out.
fn put(record: &mut Encoded, bytes: &[u8]) {
    let _ = record.extend_from_slice(bytes);
}

impl<'a> Record<'a> {
    /// Reads a record.
    pub fn decode(bytes: &'a [u8]) -> Result<Self, RecordError> {
        let mut reader = ByteReader { rest: bytes };
        let record = match reader.byte()? {
            START => Record::Start { robot_id: reader.u16()?, script_hash: reader.u32()? },
            LOG => {
                let step = reader.u32()?;
                let items = Items { rest: reader.take_rest() };
                items.clone().try_for_each(|item| item.map(|_| ()))?;
                Record::Log { step, items }
            }
            FAULT => {
                let (step, fault, calls) = reader.fault()?;
                Record::Fault { step, fault, calls }
            }
            REFUSED => {
                let (cause, value) = (reader.byte()?, reader.u16()?);
                Record::Refused(ImageError::from_code(cause, value).ok_or(RecordError::Value)?)
            }
            OVERRUN => Record::Overrun { step: reader.u32()?, missed: reader.u32()? },
            EXPIRED => Record::Expired { step: reader.u32()? },
            LOST => Record::Lost(reader.u32()?),
            UNUSED => Record::Unused(Unused {
                dropped: [reader.u16()?, reader.u16()?],
                messages: Counters {
                    foreign: reader.u16()?,
                    malformed: reader.u16()?,
                    own_id: reader.u16()?,
                    not_kept: reader.u16()?,
                    incomplete: reader.u16()?,
                    undecided: reader.u16()?,
                    failed: reader.u16()?,
                },
            }),
            CONTAINED => {
                let (step, fault, calls) = reader.fault()?;
                Record::Contained { step, fault, calls }
            }
            RESTART => Record::Restart { step: reader.u32()?, pause: reader.u16()? },
            kind => return Err(RecordError::Kind(kind)),
        };
        if reader.rest.is_empty() { Ok(record) } else { Err(RecordError::Length) }
    }
}

/// The items that a `log` printed, one by one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Items<'a> {
    rest: &'a [u8],
}

impl<'a> Iterator for Items<'a> {
    type Item = Result<PrintedValue<'a>, RecordError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let mut reader = ByteReader { rest: self.rest };
        let item = reader.item();
        // After an error nothing can be trusted.
        self.rest = if item.is_ok() { reader.rest } else { &[] };
        Some(item)
    }
}

/// The calls of a fault, innermost first: positions in the code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Calls<'a> {
    rest: &'a [u8],
}

impl Iterator for Calls<'_> {
    type Item = u16;

    fn next(&mut self) -> Option<u16> {
        let (position, rest) = self.rest.split_first_chunk()?;
        self.rest = rest;
        Some(u16::from_le_bytes(*position))
    }
}

struct ByteReader<'a> {
    rest: &'a [u8],
}

impl<'a> ByteReader<'a> {
    fn array<const N: usize>(&mut self) -> Result<[u8; N], RecordError> {
        let (bytes, rest) = self.rest.split_first_chunk().ok_or(RecordError::Length)?;
        self.rest = rest;
        Ok(*bytes)
    }

    fn byte(&mut self) -> Result<u8, RecordError> {
        self.array().map(|[byte]| byte)
    }

    fn u16(&mut self) -> Result<u16, RecordError> {
        self.array().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Result<u32, RecordError> {
        self.array().map(u32::from_le_bytes)
    }

    fn kind_of_value(&mut self) -> Result<Type, RecordError> {
        let number = self.byte()?;
        Type::ALL.into_iter().find(|kind| *kind as u8 == number).ok_or(RecordError::Value)
    }

    /// The fields of a fault.
    fn fault(&mut self) -> Result<(u32, Fault, Calls<'a>), RecordError> {
        let step = self.u32()?;
        let code = self.byte()?;
        let code = FaultCode::ALL.iter().find(|known| **known as u8 == code);
        let operands = [self.kind_of_value()?, self.kind_of_value()?];
        let detail = self.u16()?;
        let calls = Calls { rest: self.take_rest() };
        if !calls.rest.len().is_multiple_of(2) {
            return Err(RecordError::Length);
        }
        let position = calls.clone().next().unwrap_or(0);
        let code = *code.ok_or(RecordError::Value)?;
        Ok((step, Fault { code, position, operands, detail }, calls))
    }

    fn take_rest(&mut self) -> &'a [u8] {
        core::mem::take(&mut self.rest)
    }

    fn item(&mut self) -> Result<PrintedValue<'a>, RecordError> {
        Ok(match self.byte()? {
            NIL => PrintedValue::Nil,
            INT => PrintedValue::Int(self.array().map(i32::from_le_bytes)?),
            FLOAT => PrintedValue::Float(self.array().map(f32::from_le_bytes)?),
            STRING => PrintedValue::String(self.u16()?),
            TEXT => {
                let length = usize::from(self.byte()?);
                let text = self.rest.get(..length).ok_or(RecordError::Length)?;
                self.rest = self.rest.get(length..).unwrap_or(&[]);
                PrintedValue::Text(text)
            }
            TABLE => PrintedValue::Table(self.u16()?),
            FUNCTION => PrintedValue::Function,
            REST => PrintedValue::Rest,
            _ => return Err(RecordError::Value),
        })
    }
}
