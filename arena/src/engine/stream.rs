//! Random numbers: one stream for each purpose, robot and tick, so that no draw depends on the
//! order of others.

use bittybuzz_random::Random;

/// The purpose of a stream. Streams of different purposes are independent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(not(feature = "emulators"), expect(dead_code, reason = "nothing is emulated"))]
pub(crate) enum StreamPurpose {
    /// Differences between robots of one kind.
    Build = 1,
    /// The loss and errors of received frames.
    Receive = 2,
    /// The time of the first attempt at a frame.
    Send = 3,
    /// The time of each further attempt.
    BackOff = 6,
    /// Errors of the position estimate.
    Estimate = 4,
    /// The random numbers of brains.
    Brain = 5,
    /// The random numbers of intruders.
    Intruder = 7,
    /// The robots' clocks.
    Clock = 8,
    /// The ticks in which robots lose their power.
    BrownOut = 9,
    /// The loss of frames between robots in emulators.
    Emulated = 10,
    /// The brightness of frames in the edge of a range.
    Brightness = 11,
}

/// A stream of random numbers, which is identical on every machine.
#[derive(Clone, Debug)]
pub struct Stream(Random);

impl Stream {
    /// Returns the stream of one robot for one purpose in one tick.
    pub(crate) fn new(seed: u64, purpose: StreamPurpose, robot: u16, tick: u64) -> Self {
        let purpose = ((purpose as u64) << 56) ^ (u64::from(robot) << 40) ^ tick;
        Stream(Random::for_purpose(seed, purpose))
    }

    /// Returns the stream of a robot's brain.
    #[must_use]
    pub fn for_brain(seed: u64, robot: u16) -> Self {
        Stream::new(seed, StreamPurpose::Brain, robot, 0)
    }

    /// Returns the stream of a robot's clock.
    #[must_use]
    pub fn for_clock(seed: u64, robot: u16) -> Self {
        Stream::new(seed, StreamPurpose::Clock, robot, 0)
    }

    /// Returns the stream of a robot's power in one tick.
    #[must_use]
    pub fn for_power(seed: u64, robot: u16, tick: u64) -> Self {
        Stream::new(seed, StreamPurpose::BrownOut, robot, tick)
    }

    /// Returns the stream of a radio channel between robots in emulators.
    #[cfg(feature = "emulators")]
    #[must_use]
    pub(crate) fn for_emulated(seed: u64) -> Self {
        Stream::new(seed, StreamPurpose::Emulated, 0, 0)
    }

    /// Returns a new stream that is independent of later draws from this one.
    #[must_use]
    pub fn fork(&mut self) -> Stream {
        Stream(self.0.fork())
    }

    /// Returns the seed of another generator, which is independent of later draws from this one.
    #[must_use]
    pub fn seed(&mut self) -> u64 {
        self.0.bits()
    }

    /// Returns a number in [0, 1).
    pub fn unit(&mut self) -> f32 {
        self.0.unit_f32()
    }

    /// Returns true with this probability.
    pub fn chance(&mut self, probability: f32) -> bool {
        probability > 0.0 && self.unit() < probability
    }

    /// Returns a number in 0..end.
    pub fn below(&mut self, end: u32) -> u32 {
        self.0.below(end)
    }

    /// Returns a normally distributed number with mean 0 and deviation 1.
    pub fn normal(&mut self) -> f32 {
        self.0.normal() as f32
    }

    /// Returns a factor around 1 that is limited to three deviations and never negative.
    pub fn gain(&mut self, sigma: f32) -> f32 {
        (1.0 + sigma * self.normal().clamp(-3.0, 3.0)).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Correlation of the first numbers of two rows of streams.
    fn correlation(one: impl Fn(u64) -> Stream, other: impl Fn(u64) -> Stream) -> f32 {
        const COUNT: u64 = 20_000;
        let product = |i| (one(i).unit() - 0.5) * (other(i).unit() - 0.5);
        // A uniform number has a variance of one twelfth.
        12.0 * (0..COUNT).map(product).sum::<f32>() / COUNT as f32
    }

    /// Streams that differ in one input only are uncorrelated: three deviations of 20,000 are
    /// 0.021.
    #[test]
    fn streams_are_independent() {
        let of = |seed, purpose, robot, tick| Stream::new(seed, purpose, robot, tick);
        let one = |i| of(1, StreamPurpose::Receive, (i % 200) as u16, i / 200);
        let seeds = correlation(one, |i| of(2, StreamPurpose::Receive, (i % 200) as u16, i / 200));
        let purposes = correlation(one, |i| of(1, StreamPurpose::Send, (i % 200) as u16, i / 200));
        let robots =
            correlation(one, |i| of(1, StreamPurpose::Receive, (i % 200) as u16 + 1, i / 200));
        let ticks =
            correlation(one, |i| of(1, StreamPurpose::Receive, (i % 200) as u16, i / 200 + 1));
        for (name, found) in
            [("seeds", seeds), ("purposes", purposes), ("robots", robots), ("ticks", ticks)]
        {
            assert!(found.abs() < 0.021, "{name}: {found}");
        }
        assert!(correlation(one, one) > 0.95);
    }

    #[test]
    fn first_numbers_are_spread_evenly() {
        let mut parts = [0_u32; 20];
        for i in 0..20_000 {
            let mut stream = Stream::new(7, StreamPurpose::Receive, (i % 1000) as u16, i / 1000);
            parts[stream.below(20) as usize] += 1;
        }
        // Chi squared of 19 degrees of freedom is below 43.8 in 999 of 1,000 cases.
        let chi = parts.map(|count| (count as f32 - 1000.0).powi(2) / 1000.0).iter().sum::<f32>();
        assert!(chi < 43.8, "{chi}");
    }

    #[test]
    fn gains_end_at_three_deviations() {
        let mut stream = Stream::for_brain(3, 3);
        let gains: Vec<f32> = (0..10_000).map(|_| stream.gain(0.1)).collect();
        assert!(gains.iter().all(|gain| (0.7..=1.3).contains(gain)));
        assert!(gains.iter().any(|gain| *gain > 1.28) && gains.iter().any(|gain| *gain < 0.72));
    }
}
