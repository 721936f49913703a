//! The records in which a robot reports on its script. They are small enough for a debug probe; the
//! host turns them into text with the script's symbols.
//!
//! A record is one kind byte and the fields below, least significant byte first. On STM32 robots it
//! travels as the defmt message `bbz {=[u8]}`, which keeps its place among the firmware's own
//! messages.
//!
//! | kind | fields |
//! |---|---|
//! | 1 start | robot id `u16`, script hash `u32` |
//! | 2 log | step `u32`, items up to the end |
//! | 3 fault | step `u32`, cause `u8`, operand types `u8` `u8`, detail `u16`, calls (see below) |
//! | 4 refused | the reason why the image cannot run: cause `u8`, value `u16` |
//! | 5 overrun | step `u32`, ticks missed since the start `u32` |
//! | 6 expired | step `u32`: the set-points have expired and the robot has stopped |
//! | 7 lost | log lines `u32` that were lost since they were printed faster than the link sends |
//! | 8 unused | nine counts `u16` of discarded messages since the start (see below) |
//! | 9 contained | the fields of 3; the fault ended a listener or conflict handler only |
//! | 10 restart | step `u32`, ticks `u16` until the script restarts after a fault; 0: now |
//!
//! The calls are positions in the code, `u16` each, innermost first, up to the end of the record.
//!
//! The counts of an `unused` record are, in this order: no room in the queue of received frames, no
//! room in the queue of frames to be sent, another script, malformed, the robot's own id, entries
//! not kept, incomplete, undecided conflicts, failed handlers.
//!
//! An item is a tag and its payload: 0 nil, 1 integer `i32`, 2 float `f32`, 3 string by number
//! `u16`, 4 text (length `u8`, bytes), 5 table (entries `u16`), 6 function, 7 the remaining items
//! did not fit.

use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{
    Argument, ByteCode, CallArguments, Fault, FaultCode, ImageError, NetworkCounters, Type,
};
use heapless::Vec;

/// The maximum length of a record, in bytes.
pub const RECORD_MAX: usize = 96;

/// The bytes of a record as it is sent.
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

/// The bytes of a log record before its items: its kind and the step.
const BEFORE_ITEMS: usize = 1 + size_of::<u32>();

/// The length of the longest item of fixed size, in bytes.
const ITEM_MAX: usize = 5;

/// The text before the milliseconds of a [`log_with_time`].
const BEFORE_TIME: &[u8] = b" after ";
/// The text after the milliseconds.
const AFTER_TIME: &[u8] = b" ms";
/// The bytes that the three items of a time need at most.
const TIME_BYTES: usize = 2 + BEFORE_TIME.len() + ITEM_MAX + 2 + AFTER_TIME.len();

/// A decoded record.
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
        /// The steps that the script completed before.
        step: u32,
        items: Items<'a>,
    },
    /// A fault stopped the script.
    Fault {
        /// The steps that the script completed before.
        step: u32,
        fault: Fault,
        /// The positions in the code of the calls that led to the fault, innermost first.
        calls: CallTrace<'a>,
    },
    /// The image in flash cannot run.
    Refused(ImageError),
    /// A step took longer than a tick.
    Overrun {
        /// The steps that the script completed before.
        step: u32,
        /// Ticks missed since the start.
        missed: u32,
    },
    /// The robot stopped, since the script completed no step until the set-points expired.
    Expired {
        /// The steps that the script completed before.
        step: u32,
    },
    /// The number of log lines that were lost since the script printed faster than the link sends.
    Lost(u32),
    /// The messages that were discarded since the start.
    Unused(Unused),
    /// A fault ended a listener or a handler of conflicts. The script goes on.
    Contained {
        /// The steps that the script completed before.
        step: u32,
        fault: Fault,
        /// The positions in the code of the calls that led to the fault, innermost first.
        calls: CallTrace<'a>,
    },
    /// The script starts again after a fault that stopped it.
    Restart {
        /// The steps that the script completed before.
        step: u32,
        /// The pause before the restart, in ticks of a tenth of a second; 0 if the script restarts
        /// now.
        pause: u16,
    },
}

/// The counts of discarded messages since the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Unused {
    /// The frames that a full queue dropped: received ones, and ones to be sent.
    pub dropped: [u16; 2],
    /// The messages that the script's virtual machine discarded.
    pub messages: NetworkCounters,
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
    /// The number of a string of the script.
    String(u16),
    /// The bytes of a string that was made at run time.
    Text(&'a [u8]),
    /// The number of entries of a table.
    Table(u16),
    /// A function.
    Function,
    /// The remaining items did not fit into the record.
    Rest,
}

/// A reason why bytes are not a record: another version sent them, or they were damaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordError {
    /// The kind byte is unknown.
    Kind(u8),
    /// The record is shorter or longer than its fields.
    Length,
    /// A field has an undefined value.
    Value,
}

/// Returns the record of the start of a script.
pub fn start(robot_id: u16, script_hash: u32) -> Encoded {
    let mut record = Encoded::new();
    put(&mut record, &[START]);
    put(&mut record, &robot_id.to_le_bytes());
    put(&mut record, &script_hash.to_le_bytes());
    record
}

/// Returns the record of a `log(...)` in a script that has completed `step` steps.
pub fn log<P: Profile, C: ByteCode, const SLOTS: usize>(
    step: u32,
    arguments: &CallArguments<'_, P, C, SLOTS>,
) -> Encoded {
    let mut record = with_step(LOG, step);
    for index in 0..arguments.count() {
        // One byte stays free for the tag `REST`.
        let room = RECORD_MAX - 1 - record.len();
        if room < ITEM_MAX {
            put(&mut record, &[REST]);
            break;
        }
        if let Some(size) = size_before(&record, arguments, index) {
            put_item(&mut record, TABLE, &size.to_le_bytes());
            continue;
        }
        match arguments.item(index) {
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
                // The tiny profile makes no strings at run time.
                None if !P::FULL => put(&mut record, &[REST]),
                None => {
                    // Counting all bytes of a long text would take too long for a slice.
                    let length = text.bytes().take(room - 1).count();
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

/// Returns the number of entries of argument `index`, if it is a table that an earlier argument names
/// too. To count the entries may take as long as a slice. A function of its own, so that its variables
/// are not on the stack during the count.
#[inline(never)]
fn size_before<P: Profile, C: ByteCode, const SLOTS: usize>(
    record: &Encoded,
    arguments: &CallArguments<'_, P, C, SLOTS>,
    index: usize,
) -> Option<u16> {
    let parts = |index| arguments.value(index).parts();
    let earlier = (0..index).find(|earlier| parts(*earlier) == parts(index))?;
    let mut items = Items { rest: record.get(BEFORE_ITEMS..)? };
    match items.nth(earlier) {
        Some(Ok(PrintedValue::Table(size))) => Some(size),
        _ => None,
    }
}

/// Returns the record of a `log` followed by ` after {ms} ms`. The time is left out if it does not
/// fit.
pub fn log_with_time<P: Profile, C: ByteCode, const SLOTS: usize>(
    step: u32,
    arguments: &CallArguments<'_, P, C, SLOTS>,
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

/// Returns the record of a fault that stopped the script, with as many of the innermost calls as
/// fit.
pub fn fault(step: u32, fault: &Fault, calls: impl Iterator<Item = u16>) -> Encoded {
    with_fault(FAULT, step, fault, calls)
}

/// Returns the record of a fault that ended a listener or a conflict handler. The calls are cut as
/// in [`fault`].
pub fn contained(step: u32, fault: &Fault, calls: impl Iterator<Item = u16>) -> Encoded {
    with_fault(CONTAINED, step, fault, calls)
}

/// Returns the record of a restart in `pause` ticks of a tenth of a second, or now if `pause` is 0.
pub fn restart(step: u32, pause: u16) -> Encoded {
    let mut record = with_step(RESTART, step);
    put(&mut record, &pause.to_le_bytes());
    record
}

/// Returns the record of an image in flash that cannot run.
pub fn refused(error: ImageError) -> Encoded {
    let mut record = Encoded::new();
    let (cause, value) = error.to_code();
    put(&mut record, &[REFUSED, cause]);
    put(&mut record, &value.to_le_bytes());
    record
}

/// Returns the record of a step that took longer than a tick. `missed` counts the ticks that were
/// missed since the start.
pub fn overrun(step: u32, missed: u32) -> Encoded {
    let mut record = with_step(OVERRUN, step);
    put(&mut record, &missed.to_le_bytes());
    record
}

/// Returns the record of expired set-points.
pub fn expired(step: u32) -> Encoded {
    with_step(EXPIRED, step)
}

/// Returns the record of `count` log lines that were lost.
pub fn lost(count: u32) -> Encoded {
    with_step(LOST, count)
}

/// Returns the record of discarded messages.
pub fn unused(unused: &Unused) -> Encoded {
    let Unused { dropped: [unread, unsent], messages } = *unused;
    let NetworkCounters { foreign, malformed, own_id, not_kept, incomplete, undecided, failed } =
        messages;
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
    // The fault's own position is that of the innermost call, so it has no field.
    for position in calls.take((RECORD_MAX - record.len()) / 2) {
        put(&mut record, &position.to_le_bytes());
    }
    record
}

fn put_item(record: &mut Encoded, tag: u8, payload: &[u8]) {
    put(record, &[tag]);
    put(record, payload);
}

/// Appends bytes. The callers leave enough room; `extend_from_slice` adds nothing if the bytes do
/// not fit.
fn put(record: &mut Encoded, bytes: &[u8]) {
    let _ = record.extend_from_slice(bytes);
}

impl<'a> Record<'a> {
    /// Decodes a record and checks all of its fields.
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
                messages: NetworkCounters {
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

/// The items of a log record.
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
        // The bytes after an error cannot be interpreted.
        self.rest = if item.is_ok() { reader.rest } else { &[] };
        Some(item)
    }
}

/// The positions in the code of a fault's calls, innermost first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CallTrace<'a> {
    rest: &'a [u8],
}

impl Iterator for CallTrace<'_> {
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

    /// Reads the fields of a fault record.
    fn fault(&mut self) -> Result<(u32, Fault, CallTrace<'a>), RecordError> {
        let step = self.u32()?;
        let code = self.byte()?;
        let code = FaultCode::ALL.iter().find(|known| **known as u8 == code);
        let operands = [self.kind_of_value()?, self.kind_of_value()?];
        let detail = self.u16()?;
        let calls = CallTrace { rest: self.take_rest() };
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
