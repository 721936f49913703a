//! The nRF51's radio, limited to P2P frames. The radio receives nothing while it transmits, does
//! not check for other signals before a transmission, and stores a few received packets until its
//! processor has passed them on (crazyflie2-nrf-firmware, src/esb.c). It transmits at once, from
//! its only buffer. A new transmission, or a change of the radio's settings, cuts off a frame that
//! is still on the air.
//!
//! The code that connects the radios decides which robots are in range, and which frames collide on
//! the air.

use std::collections::VecDeque;

use super::LinkFrame;
use crate::Time;

/// The time from reception to transmission (nRF51 reference manual, tRXEN and tTXEN with fast
/// ramp-up off).
const RAMP: Time = Time::from_micros(130);
/// Bytes on the air in addition to a P2P frame's port and data: preamble, address, header (nine
/// bits: the length and three bits more; `HEADER_BITS` is the ninth), the marker before the port,
/// checksum.
const OVERHEAD: u64 = 1 + 5 + 1 + 1 + 2;
const HEADER_BITS: u64 = 1;
/// The number of received packets that can wait for the processor. One of its 8 places stays empty.
const QUEUE: usize = 7;

/// Counters of frames that were lost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RadioCounts {
    /// Frames that arrived while the radio was transmitting.
    pub unheard: u64,
    /// Frames for which there was no room in the queue.
    pub overflown: u64,
    /// Own frames that were cut off on the air.
    pub cut: u64,
}

/// The settings that the firmware made, and the frames on the air.
pub(super) struct Radio {
    pub channel_set: bool,
    /// The data rate: 0, 1 and 2 are 250 kb/s, 1 Mb/s and 2 Mb/s.
    pub rate: u8,
    pub rate_set: bool,
    pub address_set: bool,
    /// Begin and end of the last transmission, during which the radio received nothing.
    deaf: (Time, Time),
    /// Frames whose last bit is still to come, and the time of that bit, in ascending order.
    arriving: VecDeque<(Time, LinkFrame)>,
    received: VecDeque<LinkFrame>,
    pub counted: RadioCounts,
}

impl Radio {
    pub fn new() -> Self {
        Radio {
            channel_set: false,
            rate: 2,
            rate_set: false,
            address_set: false,
            deaf: (Time::ZERO, Time::ZERO),
            arriving: VecDeque::new(),
            received: VecDeque::new(),
            counted: RadioCounts::default(),
        }
    }

    /// Begins to transmit a frame of `bytes` bytes, its port included, and returns its time on the
    /// air.
    pub fn transmit(&mut self, bytes: usize, now: Time) -> Time {
        self.reset(now);
        let air = RAMP + self.on_air(bytes);
        self.deaf = (now, now + air);
        air
    }

    /// Cuts off the frame that is on the air, if one is.
    pub fn reset(&mut self, now: Time) {
        if now < self.deaf.1 {
            self.counted.cut += 1;
            self.deaf.1 = now;
        }
    }

    /// Returns the time on the air of a frame of `bytes` bytes, its port included.
    fn on_air(&self, bytes: usize) -> Time {
        let bits_per_second = [250_000, 1_000_000, 2_000_000][usize::from(self.rate)];
        Time::of_ticks(8 * (OVERHEAD + bytes as u64) + HEADER_BITS, bits_per_second)
    }

    /// Adds a frame, in the form that is passed to the STM32. Its last bit arrives at `end`.
    pub fn expect(&mut self, frame: LinkFrame, end: Time) {
        let place = self.arriving.partition_point(|(other, _)| *other <= end);
        self.arriving.insert(place, (end, frame));
    }

    /// Returns the time at which the next frame is complete.
    pub fn next_arrival(&self) -> Option<Time> {
        self.arriving.front().map(|(end, _)| *end)
    }

    /// Receives complete frames. A radio that `listens` stores them, unless it was transmitting
    /// meanwhile. Returns the number of frames that arrived while it did not listen.
    pub fn take_arrived(&mut self, listens: bool, now: Time) -> u64 {
        let mut ignored = 0;
        while let Some((end, frame)) = self.arriving.pop_front_if(|(end, _)| *end <= now) {
            // The frame holds a byte for the signal strength, which was not on the air.
            let begin = end - self.on_air(frame.payload().len() - 1);
            if !listens {
                ignored += 1;
            } else if begin < self.deaf.1 && self.deaf.0 < end {
                self.counted.unheard += 1;
            } else if self.received.len() == QUEUE {
                self.counted.overflown += 1;
            } else {
                self.received.push_back(frame);
            }
        }
        ignored
    }

    /// Returns true if a received frame waits for the processor.
    pub fn has_received(&self) -> bool {
        !self.received.is_empty()
    }

    /// Removes and returns the oldest received frame.
    pub fn take(&mut self) -> Option<LinkFrame> {
        self.received.pop_front()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(bytes: usize) -> LinkFrame {
        LinkFrame::new(0x0a, vec![0; bytes]).unwrap()
    }

    /// At 2 Mb/s a bit takes half a microsecond. The bits are those of the data sheet's packet
    /// layout.
    #[test]
    fn times_on_the_air() {
        let mut radio = Radio::new();
        // Port and 60 bytes: 71 bytes and a bit, after the ramp.
        assert_eq!(radio.transmit(61, Time::ZERO).nanos(), 130_000 + (8 * 71 + 1) * 500);
        radio.rate = 0;
        assert_eq!(radio.transmit(61, Time::ZERO).nanos(), 130_000 + (8 * 71 + 1) * 4000);
    }

    /// Port, signal strength and 10 bytes take 21 bytes and a bit on the air, 84.5 µs.
    #[test]
    fn receives_nothing_while_transmitting() {
        for (end_us, heard) in [(999, true), (1000, true), (1001, false), (1250, false)] {
            let mut radio = Radio::new();
            radio.expect(frame(12), Time::from_micros(end_us));
            let sent = Time::from_micros(1000);
            let air = radio.transmit(11, sent);
            assert_eq!(air.nanos(), 214_500);
            assert_eq!(radio.take_arrived(true, Time::from_millis(2)), 0);
            assert_eq!(
                (radio.take().is_some(), radio.counted.unheard == 0),
                (heard, heard),
                "{end_us}"
            );
        }
        // It began after the transmission had ended.
        let mut radio = Radio::new();
        radio.transmit(11, Time::ZERO);
        radio.expect(frame(12), Time::from_nanos(214_500 + 84_500));
        radio.take_arrived(true, Time::from_millis(1));
        assert!(radio.take().is_some());
    }

    #[test]
    fn the_queue_holds_seven() {
        let mut radio = Radio::new();
        (0..10).for_each(|n| radio.expect(frame(2 + n), Time::from_micros(100 * n as u64)));
        assert_eq!(radio.next_arrival(), Some(Time::ZERO));
        radio.take_arrived(true, Time::from_micros(850));
        assert_eq!(
            (radio.next_arrival(), radio.counted.overflown),
            (Some(Time::from_micros(900)), 2)
        );
        assert_eq!(radio.take().map(|frame| frame.payload().len()), Some(2), "the oldest first");
        assert_eq!(radio.take_arrived(false, Time::from_millis(1)), 1);
        assert_eq!(radio.next_arrival(), None);
    }
}
