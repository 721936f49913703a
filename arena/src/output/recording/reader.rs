//! Reads recordings.

use std::fmt;

use super::{
    BLOCK, DISC, HEADING, HEIGHT, MAGIC, ORIGIN, PLACE, RecordedBody, RecordedMovable,
    RecordedObstacle, RecordedOutline, RecordedPatch, RecordedRobot, RecordedShape,
    RecordingHeader, RecordingSample, RobotStatus, SHOWN, VERSION, WALL,
};

/// A reason why a recording cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordingError {
    /// The data do not begin like a recording.
    NotARecording,
    /// The recording has another version of the format.
    Version(u8),
    /// The recording has no samples.
    Empty,
    /// The data end before the end of the recording.
    Truncated,
    /// The content at this byte is not valid.
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

/// Reads a recording, sample by sample. A clone continues at the same place.
#[derive(Debug, Clone)]
pub struct RecordingReader<'a> {
    bytes: &'a [u8],
    at: usize,
    header: RecordingHeader,
    robots: Vec<Option<RecordedRobot>>,
    movables: Vec<[i32; 2]>,
    tick: u64,
    samples: u64,
    is_over: bool,
}

impl<'a> RecordingReader<'a> {
    /// Reads the header.
    pub fn new(bytes: &'a [u8]) -> Result<Self, RecordingError> {
        let rest = bytes.strip_prefix(MAGIC).ok_or(RecordingError::NotARecording)?;
        match rest.first() {
            Some(&VERSION) => {}
            Some(version) => return Err(RecordingError::Version(*version)),
            None => return Err(RecordingError::Truncated),
        }
        let header = RecordingHeader {
            size: [0; 2],
            tick_ms: 0,
            bodies: Vec::new(),
            ground: Vec::new(),
            obstacles: Vec::new(),
            movables: Vec::new(),
        };
        let mut reader = RecordingReader {
            bytes,
            at: MAGIC.len() + 1,
            header,
            robots: Vec::new(),
            movables: Vec::new(),
            tick: 0,
            samples: 0,
            is_over: false,
        };
        reader.header.size = [reader.get_as()?, reader.get_as()?];
        reader.header.tick_ms = reader.get_as()?;
        let count: u32 = reader.get_as()?;
        let ids: Vec<u16> = reader.get_differences(count)?;
        let radii: Vec<u32> = reader.get_differences(count)?;
        reader.header.bodies =
            ids.into_iter().zip(radii).map(|(id, radius)| RecordedBody { id, radius }).collect();
        let count: u32 = reader.get_as()?;
        for _ in 0..count {
            let patch = reader.patch()?;
            reader.header.ground.push(patch);
        }
        let count: u32 = reader.get_as()?;
        for _ in 0..count {
            let obstacle = reader.obstacle()?;
            reader.header.obstacles.push(obstacle);
        }
        let count: u32 = reader.get_as()?;
        for _ in 0..count {
            let (at, radius) = (reader.numbers()?, reader.get_as()?);
            let height = reader.height()?;
            reader.header.movables.push(RecordedMovable { at, radius, height });
        }
        reader.movables = reader.header.movables.iter().map(|movable| movable.at).collect();
        reader.robots = vec![None; reader.header.bodies.len()];
        Ok(reader)
    }

    /// Returns the data that hold for the whole recording.
    pub fn header(&self) -> &RecordingHeader {
        &self.header
    }

    fn patch(&mut self) -> Result<RecordedPatch, RecordingError> {
        let at = self.at;
        let form = self.byte()?;
        let shape = self.shape(form)?.ok_or(RecordingError::Malformed(at))?;
        let at = self.at;
        let brightness = self.get_as()?;
        let is_valid = brightness <= 1000;
        is_valid.then_some(RecordedPatch { shape, brightness }).ok_or(RecordingError::Malformed(at))
    }

    /// Reads the numbers of a shape; `None` if the form is not one.
    fn shape(&mut self, form: u8) -> Result<Option<RecordedShape>, RecordingError> {
        Ok(match form {
            DISC => Some(RecordedShape::Disc(self.numbers()?)),
            BLOCK => Some(RecordedShape::Block(self.numbers()?)),
            _ => None,
        })
    }

    fn obstacle(&mut self) -> Result<RecordedObstacle, RecordingError> {
        let malformed = RecordingError::Malformed(self.at);
        let outline = match self.byte()? {
            WALL => RecordedOutline::Wall(self.numbers()?),
            form => RecordedOutline::Shape(self.shape(form)?.ok_or(malformed)?),
        };
        Ok(RecordedObstacle { outline, height: self.height()? })
    }

    fn height(&mut self) -> Result<Option<u32>, RecordingError> {
        let malformed = RecordingError::Malformed(self.at);
        self.get()?.checked_sub(1).map(u32::try_from).transpose().map_err(|_| malformed)
    }

    fn numbers<const COUNT: usize>(&mut self) -> Result<[i32; COUNT], RecordingError> {
        let mut numbers = [0; COUNT];
        for number in &mut numbers {
            let malformed = RecordingError::Malformed(self.at);
            *number = i32::try_from(self.get_signed()?).map_err(|_| malformed)?;
        }
        Ok(numbers)
    }

    /// Reads numbers that are stored as differences from the number before.
    fn get_differences<T: TryFrom<i64>>(&mut self, count: u32) -> Result<Vec<T>, RecordingError> {
        let mut last = 0i64;
        // No capacity is reserved: a damaged count would take all memory.
        let mut numbers = Vec::new();
        for _ in 0..count {
            let malformed = RecordingError::Malformed(self.at);
            last = last.checked_add(self.get_signed()?).ok_or(malformed)?;
            numbers.push(T::try_from(last).map_err(|_| malformed)?);
        }
        Ok(numbers)
    }

    fn sample(&mut self) -> Result<Option<RecordingSample>, RecordingError> {
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
            match self.robots.get(number).copied() {
                Some(last) => {
                    self.robots[number] = Some(self.change(last.unwrap_or(ORIGIN))?);
                }
                None => self.push(number - self.robots.len(), at)?,
            }
            next = number + 1;
        }
        if self.at != end {
            return Err(RecordingError::Malformed(end));
        }
        self.tick = tick;
        self.samples += 1;
        let (robots, movables) = (self.robots.clone(), self.movables.clone());
        Ok(Some(RecordingSample { tick, robots, movables }))
    }

    /// Reads the change of a movable disc, which only has another place. `start` is the first byte
    /// of the change.
    fn push(&mut self, number: usize, start: usize) -> Result<(), RecordingError> {
        let at = *self.movables.get(number).ok_or(RecordingError::Malformed(start))?;
        let malformed = RecordingError::Malformed(self.at);
        if self.byte()? != PLACE {
            return Err(malformed);
        }
        self.movables[number] = self.moved(at)?;
        Ok(())
    }

    /// Reads a place as its difference from another one.
    fn moved(&mut self, from: [i32; 2]) -> Result<[i32; 2], RecordingError> {
        let [x, y] = from;
        Ok([self.moved_along(x)?, self.moved_along(y)?])
    }

    fn moved_along(&mut self, from: i32) -> Result<i32, RecordingError> {
        let malformed = RecordingError::Malformed(self.at);
        let to = i64::from(from).checked_add(self.get_signed()?).ok_or(malformed)?;
        i32::try_from(to).map_err(|_| malformed)
    }

    fn change(&mut self, mut robot: RecordedRobot) -> Result<RecordedRobot, RecordingError> {
        let at = self.at;
        let malformed = RecordingError::Malformed(at);
        let fields = self.byte()?;
        if fields & !(PLACE | HEIGHT | HEADING | SHOWN) != 0 {
            return Err(malformed);
        }
        if fields & PLACE != 0 {
            [robot.x, robot.y] = self.moved([robot.x, robot.y])?;
        }
        if fields & HEIGHT != 0 {
            robot.z = self.moved_along(robot.z)?;
        }
        if fields & HEADING != 0 {
            let turn = i16::try_from(self.get_signed()?).map_err(|_| malformed)?;
            robot.heading = robot.heading.wrapping_add_signed(turn);
        }
        if fields & SHOWN != 0 {
            let shown = self.byte()?;
            robot.led = shown & 7;
            robot.state = match shown >> 3 {
                0 => RobotStatus::Running,
                1 => RobotStatus::Stopped,
                2 => RobotStatus::Failed,
                3 => RobotStatus::Faulted,
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

impl Iterator for RecordingReader<'_> {
    type Item = Result<RecordingSample, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_over {
            return None;
        }
        let sample = self.sample();
        // The data after an error cannot be interpreted.
        self.is_over |= sample.is_err();
        sample.transpose()
    }
}
