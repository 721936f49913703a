//! Places and LEDs of the robots, in the bytes of a recording.

use bittybuzz_arena::output::recording::{Header, RecordedRobot, Writer};

/// A stream of samples: each has only the changes since the last one that was taken.
pub struct Samples {
    /// `None` before a beginning.
    writer: Option<Writer<Vec<u8>>>,
    /// Tick of the last sample.
    tick: u64,
}

impl Samples {
    /// Nothing has been taken yet.
    pub const NEW: Samples = Samples { writer: None, tick: 0 };

    /// Returns the next piece: all robots as they are at a tick. `header` is asked for at a beginning.
    pub fn take(
        &mut self,
        tick: u64,
        robots: &[Option<RecordedRobot>],
        header: impl FnOnce() -> Header,
    ) -> Vec<u8> {
        // Ticks of a recording ascend.
        if tick < self.tick {
            self.writer = None;
        }
        self.tick = tick;
        let bytes = match &mut self.writer {
            Some(writer) => writer.write(tick, robots).map(|()| writer),
            None => Writer::new(Vec::new(), &header()).and_then(|mut writer| {
                writer.write(tick, robots)?;
                Ok(self.writer.insert(writer))
            }),
        };
        // A vector takes everything.
        bytes.map(|writer| std::mem::take(writer.output_mut())).unwrap_or_default()
    }

    /// The next piece begins anew, for another client.
    pub fn restart(&mut self) {
        self.writer = None;
    }
}
