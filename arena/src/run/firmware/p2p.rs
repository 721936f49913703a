//! The radio channel between Crazyflies. It decides which robots receive which P2P frames.
//!
//! A frame reaches the others with its last bit, and frames that overlap are both lost. A robot that
//! transmits receives nothing; the emulators model this themselves. The caller passes frames in time
//! ([`RadioTurns`](super::RadioTurns)).

use std::time::Duration;

use bittybuzz_emulation::message::Command;

use crate::engine::Stream;

/// The time from reception to transmission (nRF51 reference manual).
pub const RAMP: Duration = Duration::from_micros(130);
/// The strength of every signal, in -dBm.
const RSSI: u8 = 60;
/// A bound on the duration of a frame. The longest one takes 0.3 ms.
const FRAME_TIME_MAX: Duration = Duration::from_millis(1);

/// The radio channel, and its counters.
#[derive(Debug)]
pub struct P2pAir {
    frames: Vec<OnAir>,
    loss: f32,
    stream: Stream,
    /// The number of frames on the channel, once for each robot that could have received it.
    pub carried: u64,
    /// The number of these that were lost at random.
    pub lost: u64,
    /// The number of these that overlapped with another frame.
    pub collided: u64,
}

/// A frame on the channel.
#[derive(Debug)]
struct OnAir {
    sender: usize,
    begin: Duration,
    end: Duration,
    port: u8,
    payload: Vec<u8>,
    has_arrived: bool,
}

impl Default for P2pAir {
    /// Returns an empty channel without loss.
    fn default() -> Self {
        let stream = Stream::for_emulated(0);
        P2pAir { frames: Vec::new(), loss: 0.0, stream, carried: 0, lost: 0, collided: 0 }
    }
}

impl P2pAir {
    /// Loses frames with this probability from now on, independently for each receiver. Equal seeds
    /// lose the same frames.
    pub fn lose(&mut self, probability: f64, seed: u64) {
        self.loss = probability as f32;
        self.stream = Stream::for_emulated(seed);
    }

    /// Adds a frame that robot number `sender` decided to transmit at the time `at`. The robot's
    /// radio has one buffer, so a previous frame that is still being transmitted is cut off.
    pub fn send(&mut self, sender: usize, at: Duration, air: Duration, port: u8, payload: Vec<u8>) {
        let (begin, end) = (at + RAMP, at + air);
        self.frames.retain(|frame| frame.sender != sender || frame.end <= at || frame.has_arrived);
        self.frames.push(OnAir { sender, begin, end, port, payload, has_arrived: false });
    }

    /// Puts the frames into the order of their last bits, in which they are lost at random, so that
    /// the order does not depend on the turns.
    pub fn sort(&mut self) {
        self.frames.sort_by_key(|frame| (frame.end, frame.sender));
    }

    /// Returns the end of the frame that ends next.
    pub fn next_end(&self, now: Duration) -> Option<Duration> {
        self.frames.iter().map(|frame| frame.end).filter(|end| *end > now).min()
    }

    /// Returns the frames that end by `until`, with the number of each receiver. The caller has
    /// passed all frames that begin before `until`. `receives` returns true if its first robot can
    /// receive the second one.
    pub fn carry(
        &mut self,
        until: Duration,
        robots: usize,
        receives: impl Fn(usize, usize) -> bool,
    ) -> Vec<(usize, Command)> {
        let mut received = Vec::new();
        for number in 0..self.frames.len() {
            let OnAir { sender, begin, end, port, has_arrived, .. } = self.frames[number];
            if end > until || has_arrived {
                continue;
            }
            self.frames[number].has_arrived = true;
            for receiver in (0..robots).filter(|other| *other != sender && receives(*other, sender))
            {
                self.carried += 1;
                // A receiver's own frames need no check: the emulator receives nothing while it
                // transmits.
                let overlaps = |other: &OnAir| {
                    ![sender, receiver].contains(&other.sender)
                        && receives(receiver, other.sender)
                        && other.begin < end
                        && begin < other.end
                };
                if self.frames.iter().any(overlaps) {
                    self.collided += 1;
                } else if self.stream.chance(self.loss) {
                    self.lost += 1;
                } else {
                    let payload = self.frames[number].payload.clone();
                    received.push((receiver, Command::P2p { at: end, port, rssi: RSSI, payload }));
                }
            }
        }
        received
    }

    /// Forgets the frames that overlap with none that is decided after `now`.
    pub fn forget(&mut self, now: Duration) {
        self.frames.retain(|frame| frame.end + FRAME_TIME_MAX > now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn us(us: u64) -> Duration {
        Duration::from_micros(us)
    }

    fn send(air: &mut P2pAir, sender: usize, at: u64) {
        air.send(sender, us(at), us(330), 11, vec![sender as u8]);
    }

    fn receivers(received: &[(usize, Command)]) -> Vec<usize> {
        received.iter().map(|(receiver, _)| *receiver).collect()
    }

    #[test]
    fn a_frame_reaches_all_others_with_its_last_bit() {
        let mut air = P2pAir::default();
        send(&mut air, 1, 20);
        assert_eq!(air.carry(us(130) + RAMP, 3, |_, _| true), []);
        let received = air.carry(us(260) + RAMP, 3, |_, _| true);
        assert_eq!(receivers(&received), [0, 2]);
        let Command::P2p { at, port: 11, rssi: RSSI, payload } = &received[0].1 else { panic!() };
        assert_eq!((*at, payload), (us(350), &vec![1]));
        assert_eq!(air.carry(us(390) + RAMP, 3, |_, _| true), []);
        assert_eq!((air.carried, air.collided, air.lost), (2, 0, 0));
    }

    #[test]
    fn overlapping_frames_are_lost_to_receivers_of_both() {
        let mut air = P2pAir::default();
        send(&mut air, 0, 20);
        send(&mut air, 1, 200);
        // Robot 2 receives both frames, robot 3 only the first. Both senders receive nothing while
        // they transmit, which is not modeled here.
        let receives = |receiver: usize, sender: usize| receiver != 3 || sender == 0;
        let mut received = receivers(&air.carry(us(390) + RAMP, 4, receives));
        received.extend(receivers(&air.carry(us(520) + RAMP, 4, receives)));
        assert_eq!(received, [1, 3, 0]);
        assert_eq!(air.collided, 2);
        // Two frames that follow one another both arrive.
        let mut air = P2pAir::default();
        send(&mut air, 0, 0);
        send(&mut air, 1, 330);
        let received = air.carry(us(780) + RAMP, 3, |_, _| true);
        assert_eq!(receivers(&received), [1, 2, 0, 2]);
    }

    #[test]
    fn a_frame_is_cut_off_by_the_next_of_its_sender() {
        let mut air = P2pAir::default();
        send(&mut air, 0, 20);
        send(&mut air, 0, 340);
        let received = air.carry(us(700) + RAMP, 2, |_, _| true);
        let [(1, Command::P2p { at, .. })] = &received[..] else { panic!("{received:?}") };
        assert_eq!(*at, us(670));
        send(&mut air, 0, 670);
        assert_eq!(air.carry(us(1000) + RAMP, 2, |_, _| true).len(), 1, "the one before had ended");
    }

    #[test]
    fn the_given_share_of_frames_is_lost() {
        let mut air = P2pAir::default();
        air.lose(0.3, 7);
        let mut received = 0;
        for number in 0..10_000 {
            send(&mut air, 0, 1000 * number);
            received += air.carry(us(1000 * number + 400) + RAMP, 2, |_, _| true).len();
        }
        assert!((6_700..7_300).contains(&received), "{received}");
        assert_eq!(air.lost as usize, 10_000 - received);
    }
}
