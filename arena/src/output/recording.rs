//! Recordings: where every robot was and what it showed, sample by sample. `docs/recording.md` has the format.
//!
//! ```
//! use bittybuzz_arena::output::recording::{Header, Reader, Robot, State, Writer};
//!
//! let header = Header { size: [2000, 1000], tick_ms: 100, ids: vec![0, 1] };
//! let mut file = Vec::new();
//! let mut writer = Writer::new(&mut file, &header)?;
//! let robot = Robot { x: -120, y: 5, z: 0, heading: 0x4000, led: 4, state: State::Running };
//! writer.write(0, &[Some(robot), None])?;
//! writer.finish()?;
//!
//! let mut reader = Reader::new(&file)?;
//! assert_eq!(reader.header(), &header);
//! let sample = reader.next().unwrap()?;
//! assert_eq!((sample.tick, sample.robots[0]), (0, Some(robot)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::fmt;
use std::io::{self, Write};

/// What a recording begins with.
const MAGIC: &[u8; 6] = b"bbzrec";

/// Version of the format.
pub const VERSION: u8 = 1;

/// What holds for a whole recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Header {
    /// Width and height of the world in mm.
    pub size: [u32; 2],
    /// Length of a tick in ms.
    pub tick_ms: u32,
    /// The robots' ids.
    pub ids: Vec<u16>,
}

/// A robot in a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Robot {
    /// Tenths of mm, to the right of the middle of the world.
    pub x: i32,
    /// Tenths of mm, up from the middle.
    pub y: i32,
    /// Tenths of mm over the ground.
    pub z: i32,
    /// 1/65536 of a full turn, 0 along x, anticlockwise.
    pub heading: u16,
    /// Colour: the sum of 1 red, 2 green, 4 blue.
    pub led: u8,
    /// Whether it works.
    pub state: State,
}

/// Whether a robot works.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Its script runs.
    Running = 0,
    /// Stopped by an event.
    Stopped = 1,
    /// Failed.
    Failed = 2,
    /// Its script had an error.
    Faulted = 3,
}

/// All robots at a time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sample {
    /// When.
    pub tick: u64,
    /// Each robot, in the order of the header's ids; `None` before it joins.
    pub robots: Vec<Option<Robot>>,
}

/// What a robot is taken for before its first sample.
const ORIGIN: Robot = Robot { x: 0, y: 0, z: 0, heading: 0, led: 0, state: State::Running };

/// Bits of a change: which fields follow.
const PLACE: u8 = 1;
const HEIGHT: u8 = 2;
const HEADING: u8 = 4;
const SHOWN: u8 = 8;

/// Writes a recording.
pub struct Writer<W: Write> {
    output: W,
    last: Vec<Option<Robot>>,
    tick: u64,
    samples: u64,
}

impl<W: Write> Writer<W> {
    /// Writes the header.
    pub fn new(mut output: W, header: &Header) -> io::Result<Self> {
        let mut bytes = MAGIC.to_vec();
        bytes.push(VERSION);
        put(&mut bytes, u64::from(header.size[0]));
        put(&mut bytes, u64::from(header.size[1]));
        put(&mut bytes, u64::from(header.tick_ms));
        put(&mut bytes, header.ids.len() as u64);
        let mut last = 0;
        for id in &header.ids {
            put_signed(&mut bytes, i64::from(*id) - last);
            last = i64::from(*id);
        }
        output.write_all(&bytes)?;
        Ok(Writer { output, last: vec![None; header.ids.len()], tick: 0, samples: 0 })
    }

    /// Writes a sample; ticks ascend. Robots that are not in the header are left out.
    pub fn write(&mut self, tick: u64, robots: &[Option<Robot>]) -> io::Result<()> {
        let mut changes = Vec::new();
        let mut unchanged = 0;
        for (last, robot) in self.last.iter_mut().zip(robots) {
            // Whoever has joined stays.
            let Some(robot) = robot.filter(|robot| *last != Some(*robot)) else {
                unchanged += 1;
                continue;
            };
            put(&mut changes, unchanged);
            unchanged = 0;
            change(&mut changes, last.unwrap_or(ORIGIN), robot);
            *last = Some(robot);
        }
        let mut head = Vec::new();
        // 0 is the end of the recording.
        put(&mut head, 1 + changes.len() as u64);
        put(&mut head, tick.saturating_sub(self.tick));
        self.output.write_all(&head)?;
        self.output.write_all(&changes)?;
        self.tick = tick;
        self.samples += 1;
        Ok(())
    }

    /// Returns the output, from which the caller may take the bytes that are written already.
    pub fn output_mut(&mut self) -> &mut W {
        &mut self.output
    }

    /// Writes the end, and returns the output.
    pub fn finish(mut self) -> io::Result<W> {
        let mut end = vec![0];
        put(&mut end, self.samples);
        self.output.write_all(&end)?;
        self.output.flush()?;
        Ok(self.output)
    }
}

fn change(bytes: &mut Vec<u8>, from: Robot, to: Robot) {
    let mut fields = 0;
    for (field, differs) in [
        (PLACE, (from.x, from.y) != (to.x, to.y)),
        (HEIGHT, from.z != to.z),
        (HEADING, from.heading != to.heading),
        (SHOWN, (from.led, from.state) != (to.led, to.state)),
    ] {
        if differs {
            fields |= field;
        }
    }
    bytes.push(fields);
    let difference = |to: i32, from: i32| i64::from(to) - i64::from(from);
    if fields & PLACE != 0 {
        put_signed(bytes, difference(to.x, from.x));
        put_signed(bytes, difference(to.y, from.y));
    }
    if fields & HEIGHT != 0 {
        put_signed(bytes, difference(to.z, from.z));
    }
    if fields & HEADING != 0 {
        // The shorter way round.
        put_signed(bytes, i64::from(to.heading.wrapping_sub(from.heading) as i16));
    }
    if fields & SHOWN != 0 {
        bytes.push(to.led & 7 | (to.state as u8) << 3);
    }
}

/// Seven bits in a byte, the lowest first; the top bit says that more follow (LEB128).
fn put(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

/// With the sign in the lowest bit.
fn put_signed(bytes: &mut Vec<u8>, value: i64) {
    put(bytes, (value << 1 ^ value >> 63) as u64);
}

/// Why a recording cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordingError {
    /// It does not begin like one.
    NotARecording,
    /// It is of another version.
    Version(u8),
    /// It has no samples.
    Empty,
    /// It ends before its end.
    Truncated,
    /// What stands at this byte makes no sense.
    Malformed(usize),
}

impl fmt::Display for RecordingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RecordingError::NotARecording => f.write_str("it is not a recording"),
            RecordingError::Version(version) => {
                let age = if *version < VERSION { "older" } else { "newer" };
                write!(
                    f,
                    "it is a recording of version {version}, {age} than version {VERSION}, which this program reads: \
                     record the run again"
                )
            }
            RecordingError::Empty => f.write_str("it has no samples"),
            RecordingError::Truncated => f.write_str("it is cut off"),
            RecordingError::Malformed(at) => write!(f, "it is damaged at byte {at}"),
        }
    }
}

impl std::error::Error for RecordingError {}

/// Reads a recording, sample by sample. A copy reads on from the same place.
#[derive(Debug, Clone)]
pub struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    header: Header,
    robots: Vec<Option<Robot>>,
    tick: u64,
    samples: u64,
    is_over: bool,
}

impl<'a> Reader<'a> {
    /// Reads the header.
    pub fn new(bytes: &'a [u8]) -> Result<Self, RecordingError> {
        let rest = bytes.strip_prefix(MAGIC).ok_or(RecordingError::NotARecording)?;
        match rest.first() {
            Some(&VERSION) => {}
            Some(version) => return Err(RecordingError::Version(*version)),
            None => return Err(RecordingError::Truncated),
        }
        let header = Header { size: [0; 2], tick_ms: 0, ids: Vec::new() };
        let at = MAGIC.len() + 1;
        let (robots, tick, samples) = (Vec::new(), 0, 0);
        let mut reader = Reader { bytes, at, header, robots, tick, samples, is_over: false };
        reader.header.size = [reader.get_as()?, reader.get_as()?];
        reader.header.tick_ms = reader.get_as()?;
        let count: u32 = reader.get_as()?;
        let mut last = 0i64;
        for _ in 0..count {
            let malformed = RecordingError::Malformed(reader.at);
            last = last.checked_add(reader.get_signed()?).ok_or(malformed)?;
            reader.header.ids.push(u16::try_from(last).map_err(|_| malformed)?);
        }
        reader.robots = vec![None; reader.header.ids.len()];
        Ok(reader)
    }

    /// What holds for the whole recording.
    pub fn header(&self) -> &Header {
        &self.header
    }

    fn sample(&mut self) -> Result<Option<Sample>, RecordingError> {
        let at = self.at;
        let length = self.get()?;
        let Some(length) = length.checked_sub(1) else {
            self.is_over = true;
            let at = self.at;
            let is_right = self.get()? == self.samples && self.at == self.bytes.len();
            return if is_right { Ok(None) } else { Err(RecordingError::Malformed(at)) };
        };
        let tick = self.tick.checked_add(self.get()?).ok_or(RecordingError::Malformed(at))?;
        let end = usize::try_from(length).ok().and_then(|length| self.at.checked_add(length));
        let end = end.filter(|end| *end <= self.bytes.len()).ok_or(RecordingError::Truncated)?;
        let mut next = 0usize;
        while self.at < end {
            let at = self.at;
            let skipped = usize::try_from(self.get()?).unwrap_or(usize::MAX);
            let number = next.saturating_add(skipped);
            let Some(last) = self.robots.get(number).copied() else {
                return Err(RecordingError::Malformed(at));
            };
            self.robots[number] = Some(self.change(last.unwrap_or(ORIGIN))?);
            next = number + 1;
        }
        if self.at != end {
            return Err(RecordingError::Malformed(end));
        }
        self.tick = tick;
        self.samples += 1;
        Ok(Some(Sample { tick, robots: self.robots.clone() }))
    }

    fn change(&mut self, mut robot: Robot) -> Result<Robot, RecordingError> {
        let at = self.at;
        let malformed = RecordingError::Malformed(at);
        let fields = self.byte()?;
        if fields & !(PLACE | HEIGHT | HEADING | SHOWN) != 0 {
            return Err(malformed);
        }
        let moved = |from: i32, by: i64| {
            let to = i64::from(from).checked_add(by).ok_or(malformed)?;
            i32::try_from(to).map_err(|_| malformed)
        };
        if fields & PLACE != 0 {
            robot.x = moved(robot.x, self.get_signed()?)?;
            robot.y = moved(robot.y, self.get_signed()?)?;
        }
        if fields & HEIGHT != 0 {
            robot.z = moved(robot.z, self.get_signed()?)?;
        }
        if fields & HEADING != 0 {
            let turn = i16::try_from(self.get_signed()?).map_err(|_| malformed)?;
            robot.heading = robot.heading.wrapping_add_signed(turn);
        }
        if fields & SHOWN != 0 {
            let shown = self.byte()?;
            robot.led = shown & 7;
            robot.state = match shown >> 3 {
                0 => State::Running,
                1 => State::Stopped,
                2 => State::Failed,
                3 => State::Faulted,
                _ => return Err(malformed),
            };
        }
        Ok(robot)
    }

    fn byte(&mut self) -> Result<u8, RecordingError> {
        let byte = self.bytes.get(self.at).ok_or(RecordingError::Truncated)?;
        self.at += 1;
        Ok(*byte)
    }

    fn get(&mut self) -> Result<u64, RecordingError> {
        let at = self.at;
        let mut value = 0u64;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            let bits = u64::from(byte & 0x7f);
            if bits << shift >> shift != bits {
                break;
            }
            value |= bits << shift;
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(RecordingError::Malformed(at))
    }

    fn get_as<T: TryFrom<u64>>(&mut self) -> Result<T, RecordingError> {
        let at = self.at;
        T::try_from(self.get()?).map_err(|_| RecordingError::Malformed(at))
    }

    fn get_signed(&mut self) -> Result<i64, RecordingError> {
        let value = self.get()?;
        Ok((value >> 1) as i64 ^ -((value & 1) as i64))
    }
}

impl Iterator for Reader<'_> {
    type Item = Result<Sample, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_over {
            return None;
        }
        let sample = self.sample();
        // What is behind a mistake cannot be understood.
        self.is_over |= sample.is_err();
        sample.transpose()
    }
}
