//! The position in a recording, and the values that are read there.

use std::mem;

use super::error::RecordingError;
use super::{
    BLOCK, DISC, HEADING, HEIGHT, PLACE, ROBOTS_MAX, RecordedBody, RecordedMovable,
    RecordedObstacle, RecordedOutline, RecordedPatch, RecordedRobot, RecordedShape,
    RecordingHeader, RobotStatus, SHOWN, WALL,
};

/// The fewest bytes of a robot in the header: its id and its radius.
const BODY_BYTES_MIN: usize = 2;
/// The fewest bytes of a patch: a form, the three numbers of a disc, and the brightness.
const PATCH_BYTES_MIN: usize = 5;
/// The fewest bytes of an obstacle: a form, the three numbers of a disc, and the height.
const OBSTACLE_BYTES_MIN: usize = 5;
/// The fewest bytes of a movable disc: two coordinates, the radius and the height.
const MOVABLE_BYTES_MIN: usize = 4;

/// A position in the bytes of a recording. Reading moves it forward.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cursor<'a> {
    pub bytes: &'a [u8],
    pub at: usize,
}

impl Cursor<'_> {
    /// Reads the header after the version.
    pub fn header(&mut self) -> Result<RecordingHeader, RecordingError> {
        Ok(RecordingHeader {
            size: [self.get_as()?, self.get_as()?],
            tick_ms: self.get_as()?,
            bodies: self.bodies()?,
            ground: self.list(PATCH_BYTES_MIN, Self::patch)?,
            obstacles: self.list(OBSTACLE_BYTES_MIN, Self::obstacle)?,
            movables: self.list(MOVABLE_BYTES_MIN, Self::movable)?,
        })
    }

    fn bodies(&mut self) -> Result<Vec<RecordedBody>, RecordingError> {
        let count: u32 = self.get_as()?;
        if count > ROBOTS_MAX {
            return Err(RecordingError::TooManyRobots(count));
        }
        let count = self.count(count, BODY_BYTES_MIN)?;
        let mut bodies = Vec::with_capacity(count);
        let mut is_taken = vec![false; if count == 0 { 0 } else { ROBOTS_MAX as usize }];
        let mut last = 0;
        for _ in 0..count {
            let id: u16 = self.get_difference(&mut last)?;
            if mem::replace(&mut is_taken[usize::from(id)], true) {
                return Err(RecordingError::EqualIds(id));
            }
            bodies.push(RecordedBody { id, radius: 0 });
        }
        let mut last = 0;
        for body in &mut bodies {
            body.radius = self.get_difference(&mut last)?;
        }
        Ok(bodies)
    }

    /// Reads a count and as many items, each of at least `bytes_min` bytes.
    fn list<T>(
        &mut self,
        bytes_min: usize,
        item: fn(&mut Self) -> Result<T, RecordingError>,
    ) -> Result<Vec<T>, RecordingError> {
        let count = self.get_as()?;
        let mut items = Vec::with_capacity(self.count(count, bytes_min)?);
        for _ in 0..count {
            items.push(item(self)?);
        }
        Ok(items)
    }

    /// Returns a count for which memory may be reserved: the items fit into the bytes that are left.
    fn count(&self, count: u32, bytes_min: usize) -> Result<usize, RecordingError> {
        let left = self.bytes.len() - self.at;
        let count = usize::try_from(count).ok().filter(|count| *count <= left / bytes_min);
        count.ok_or(RecordingError::Truncated)
    }

    fn movable(&mut self) -> Result<RecordedMovable, RecordingError> {
        Ok(RecordedMovable { at: self.numbers()?, radius: self.get_as()?, height: self.height()? })
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

    /// Reads a number that is stored as its difference from the number before, `last`.
    fn get_difference<T: TryFrom<i64>>(&mut self, last: &mut i64) -> Result<T, RecordingError> {
        let malformed = RecordingError::Malformed(self.at);
        *last = last.checked_add(self.get_signed()?).ok_or(malformed)?;
        T::try_from(*last).map_err(|_| malformed)
    }

    /// Reads the change of a movable disc, which only has another place.
    pub fn push(&mut self, from: [i32; 2]) -> Result<[i32; 2], RecordingError> {
        let malformed = RecordingError::Malformed(self.at);
        if self.byte()? != PLACE {
            return Err(malformed);
        }
        self.moved(from)
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

    /// Reads the change of a robot.
    pub fn change(&mut self, mut robot: RecordedRobot) -> Result<RecordedRobot, RecordingError> {
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

    /// Reads a number of seven bits per byte (LEB128).
    pub fn get(&mut self) -> Result<u64, RecordingError> {
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
