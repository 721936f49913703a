//! Poses and LEDs of the robots and the places of the discs that they push, in the format of a
//! recording.

use bittybuzz_arena::output::recording::{RecordedRobot, RecordingHeader, RecordingWriter};

/// A stream of samples. Each contains only the changes since the previous one.
pub struct Samples {
    /// `None` if the next sample starts a new recording.
    writer: Option<RecordingWriter<Vec<u8>>>,
    /// The tick of the last sample.
    tick: u64,
}

impl Samples {
    /// A stream before its first sample.
    pub const NEW: Samples = Samples { writer: None, tick: 0 };

    /// Returns the next piece, with the state of all robots and movable discs at a tick. `header` is called when the
    /// piece starts a new recording.
    pub fn take(
        &mut self,
        tick: u64,
        robots: &[Option<RecordedRobot>],
        movables: &[[i32; 2]],
        header: impl FnOnce() -> RecordingHeader,
    ) -> Vec<u8> {
        // The ticks of a recording must ascend, so an earlier tick starts a new one.
        if tick < self.tick {
            self.writer = None;
        }
        self.tick = tick;
        let bytes = match &mut self.writer {
            Some(writer) => writer.write(tick, robots, movables).map(|()| writer),
            None => RecordingWriter::new(Vec::new(), &header()).and_then(|mut writer| {
                writer.write(tick, robots, movables)?;
                Ok(self.writer.insert(writer))
            }),
        };
        std::mem::take(bytes.expect("writing to a vector cannot fail").output_mut())
    }

    /// Makes the next piece start a new recording, for another client.
    pub fn restart(&mut self) {
        self.writer = None;
    }
}
