//! Reads recordings.
//!
//! Recordings are exchanged between people, so the length of a file bounds memory and time.
//! [`RecordingReader::advance`] changes one state in place: a sample costs as much as its changes,
//! however many robots there are.

use std::sync::Arc;

use super::cursor::Cursor;
use super::error::RecordingError;
use super::{MAGIC, ORIGIN, RecordedRobot, RecordingHeader, RecordingSample, VERSION};

/// Reads a recording, sample by sample. A clone continues at the same place and shares the header.
///
/// The iterator copies the state of all robots for each sample; [`advance`](Self::advance) does
/// not.
#[derive(Debug, Clone)]
pub struct RecordingReader<'a> {
    /// The start of the next sample.
    cursor: Cursor<'a>,
    header: Arc<RecordingHeader>,
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
        let mut cursor = Cursor { bytes, at: MAGIC.len() + 1 };
        let header = cursor.header()?;
        Ok(RecordingReader {
            cursor,
            robots: vec![None; header.bodies.len()],
            movables: header.movables.iter().map(|movable| movable.at).collect(),
            header: Arc::new(header),
            tick: 0,
            samples: 0,
            is_over: false,
        })
    }

    /// Returns the data that hold for the whole recording.
    pub fn header(&self) -> &RecordingHeader {
        &self.header
    }

    /// Returns the tick of the last sample that was read; 0 before the first.
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// Returns each robot in the last sample that was read, in the order of the header; `None`
    /// before it joins.
    pub fn robots(&self) -> &[Option<RecordedRobot>] {
        &self.robots
    }

    /// Returns the center of each movable disc in the last sample that was read.
    pub fn movables(&self) -> &[[i32; 2]] {
        &self.movables
    }

    /// Returns the number of samples that were read.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Returns the bytes of memory that a clone takes.
    pub fn clone_bytes(&self) -> usize {
        size_of_val(self) + size_of_val(&*self.robots) + size_of_val(&*self.movables)
    }

    /// Returns the tick of the next sample, without reading its changes; `None` at the end, or
    /// where the data are damaged.
    pub fn next_tick(&self) -> Option<u64> {
        let mut cursor = self.cursor;
        let is_sample = !self.is_over && cursor.get().ok()? != 0;
        is_sample.then(|| self.tick.checked_add(cursor.get().ok()?)).flatten()
    }

    /// Reads the next sample and returns its tick; `None` at the end. After an error nothing more
    /// can be read, and some robots may have changed.
    pub fn advance(&mut self) -> Result<Option<u64>, RecordingError> {
        if self.is_over {
            return Ok(None);
        }
        let tick = self.sample();
        // The data after an error cannot be interpreted.
        self.is_over = !matches!(tick, Ok(Some(_)));
        tick
    }

    fn sample(&mut self) -> Result<Option<u64>, RecordingError> {
        let cursor = &mut self.cursor;
        let at = cursor.at;
        let length = cursor.get()?;
        let Some(length) = length.checked_sub(1) else {
            let at = cursor.at;
            let is_right = cursor.get()? == self.samples && cursor.at == cursor.bytes.len();
            return if is_right { Ok(None) } else { Err(RecordingError::Malformed(at)) };
        };
        let tick = self.tick.checked_add(cursor.get()?).ok_or(RecordingError::Malformed(at))?;
        let end = usize::try_from(length).ok().and_then(|length| cursor.at.checked_add(length));
        let end = end.filter(|end| *end <= cursor.bytes.len()).ok_or(RecordingError::Truncated)?;
        let mut next = 0usize;
        while cursor.at < end {
            let at = cursor.at;
            let skipped = usize::try_from(cursor.get()?).unwrap_or(usize::MAX);
            let number = next.saturating_add(skipped);
            // The discs are numbered after the robots.
            if let Some(robot) = self.robots.get_mut(number) {
                *robot = Some(cursor.change(robot.unwrap_or(ORIGIN))?);
            } else {
                let disc = self.movables.get_mut(number - self.robots.len());
                let disc = disc.ok_or(RecordingError::Malformed(at))?;
                *disc = cursor.push(*disc)?;
            }
            next = number + 1;
        }
        if cursor.at != end {
            return Err(RecordingError::Malformed(end));
        }
        self.tick = tick;
        self.samples += 1;
        Ok(Some(tick))
    }
}

impl Iterator for RecordingReader<'_> {
    type Item = Result<RecordingSample, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        let tick = self.advance().transpose()?;
        Some(tick.map(|tick| RecordingSample {
            tick,
            robots: self.robots.clone(),
            movables: self.movables.clone(),
        }))
    }
}
