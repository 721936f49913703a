//! The media that carry the frames of robots, and the time that a frame takes.

/// A medium that carries frames. Robots on different media cannot exchange frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Medium {
    /// Infrared light of the Kilobots.
    Infrared = 0,
    /// nRF24 radio of the Zooids.
    Nrf24 = 1,
    /// Peer-to-peer broadcast of the Crazyflies' nRF51.
    P2p = 2,
    /// The link of robots that are described by their file alone. It measures the distance and
    /// direction of the sender.
    RangeAndBearing = 3,
}

impl Medium {
    /// The number of media.
    pub const COUNT: usize = 4;

    /// All media.
    pub const ALL: [Medium; Self::COUNT] =
        [Medium::Infrared, Medium::Nrf24, Medium::P2p, Medium::RangeAndBearing];

    /// The words of robot files and scenarios.
    pub const WORDS: [(&str, Medium); Self::COUNT] = [
        ("ir", Medium::Infrared),
        ("nrf24", Medium::Nrf24),
        ("p2p", Medium::P2p),
        ("rab", Medium::RangeAndBearing),
    ];

    /// Returns the word of robot files and scenarios.
    #[must_use]
    pub const fn word(self) -> &'static str {
        Self::WORDS[self as usize].0
    }

    /// Returns the length of the longest frame in bytes: its type byte and `message_bytes` of the
    /// robot's file.
    #[must_use]
    pub const fn frame_bytes(self) -> usize {
        match self {
            Medium::Infrared => 10,
            Medium::Nrf24 => 25,
            Medium::P2p | Medium::RangeAndBearing => 49,
        }
    }

    /// Returns the time that a frame takes on the air, in microseconds.
    #[must_use]
    pub const fn air_time_us(self) -> u32 {
        match self {
            // Measured on kilolib's own code: 4.41 ms from the first pulse until it listens again.
            Medium::Infrared => 4410,
            // 32 bytes, 9 of preamble, address and check, at 2 Mb/s, and 130 us of settling; rounded.
            Medium::Nrf24 => 200,
            // P2P takes 0.29 to 0.42 ms: 62 bytes at 2 Mb/s and settling. For range and bearing,
            // the same time is a choice.
            Medium::P2p | Medium::RangeAndBearing => 400,
        }
    }

    /// Returns the mean time from one frame of a robot to its next in microseconds, if frames wait.
    #[must_use]
    pub const fn frame_period_us(self) -> u32 {
        match self {
            // kilolib sends two messages per second (`kilo_tx_period`).
            Medium::Infrared => 500_000,
            // The firmware pauses 2 to 18 ms before a frame. For range and bearing, the same time
            // is a choice.
            Medium::Nrf24 | Medium::P2p | Medium::RangeAndBearing => 10_000 + self.air_time_us(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_in_the_order_of_the_media() {
        assert!(Medium::ALL.into_iter().eq(Medium::WORDS.into_iter().map(|(_, medium)| medium)));
    }
}
