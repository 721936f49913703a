//! Asynchronous serial frames between two clocks that may disagree.

/// A start bit, eight data bits and a stop bit.
pub(crate) const FRAME_BITS: u64 = 10;
/// The receivers of the STM32 tolerate 3.33 to 3.75 % (RM0090 30.3.5), those of the nRF51 no more.
const TOLERANCE_PER_MILLE: u64 = 30;
/// The extra distance of a sample from the middle of a bit, in addition to the drift, in
/// thousandths of a bit. It is chosen such that at the limit of the tolerance the sample of the
/// stop bit, 9.5 bits after the start, falls on its edge.
const SLACK: u64 = 500 - 95 * TOLERANCE_PER_MILLE / 10;

/// The receiver's result for a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Received {
    pub byte: u8,
    pub framing_error: bool,
}

/// Receives `byte`, sent at `sender` baud, with a receiver at `receiver` baud. The receiver samples
/// the line in the middle of each bit by its own clock. After the frame the line is high.
pub(crate) fn receive(byte: u8, sender: u64, receiver: u64) -> Received {
    if sender.abs_diff(receiver) * 1000 <= receiver * TOLERANCE_PER_MILLE {
        return Received { byte, framing_error: false };
    }
    if sender == 0 || receiver == 0 {
        return Received { byte: 0, framing_error: true };
    }
    let wire = u32::from(byte) << 1 | 1 << 9;
    let sample = |bit: u64| {
        // The middle of the receiver's bit, in thousandths of the sender's bits.
        let middle = (2 * bit + 1) * 500 * sender / receiver;
        let late = sender > receiver;
        let at = if late { middle + SLACK } else { middle.saturating_sub(SLACK) } / 1000;
        at >= FRAME_BITS || wire >> at & 1 != 0
    };
    let byte = (0..8).fold(0, |byte, bit| byte | u8::from(sample(bit + 1)) << bit);
    Received { byte, framing_error: !sample(9) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_percent_are_tolerated() {
        for receiver in [970_874, 1_000_000, 1_030_000] {
            for byte in [0x00, 0x55, 0xbc, 0xff] {
                let received = receive(byte, 1_000_000, receiver);
                assert_eq!(received, Received { byte, framing_error: false });
            }
        }
        let intact = Received { byte: 0x55, framing_error: false };
        assert_ne!(receive(0x55, 1_000_000, 960_000), intact);
        assert_ne!(receive(0x55, 1_000_000, 1_040_000), intact);
    }

    #[test]
    fn far_too_fast_a_receiver_takes_data_for_the_stop_bit() {
        assert!(receive(0x00, 1_000_000, 2_000_000).framing_error);
        assert_eq!(receive(0b0000_1010, 1_000_000, 2_000_000).byte, 0b1001_1000);
    }

    #[test]
    fn half_the_rate_sees_every_other_bit() {
        // The line from the start bit on is 0 1010 1010 1 1111...; the samples are at 3, 5, 7, 9,
        // ... of the sender's bits.
        assert_eq!(receive(0b0101_0101, 1_000_000, 500_000).byte, 0b1111_1111);
        assert_eq!(receive(0b1010_1010, 1_000_000, 500_000).byte, 0b1111_1000);
    }
}
