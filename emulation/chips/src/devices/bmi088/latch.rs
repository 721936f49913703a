//! The data registers of three axes.

/// A sample of three axes, of which each has a register for its low byte and one for its high byte.
/// Reading a low byte locks the high byte of the same axis until it is read (data sheet 5.3.4 and
/// 5.5.2). Different axes may therefore belong to different samples.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct AxisLatch {
    sample: [i16; 3],
    locked: [Option<u8>; 3],
}

impl AxisLatch {
    pub(super) fn set(&mut self, sample: [i16; 3]) {
        self.sample = sample;
    }

    /// Returns the byte of a register, counted from the low byte of the first axis.
    pub(super) fn read(&mut self, index: usize) -> u8 {
        let axis = index / 2;
        let [low, high] = self.sample[axis].to_le_bytes();
        if index.is_multiple_of(2) {
            self.locked[axis] = Some(high);
            low
        } else {
            self.locked[axis].take().unwrap_or(high)
        }
    }
}
