//! A serial line that loses and corrupts bytes.

use bittybuzz_random::Random;

/// The quality of the line, in both directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LineQuality {
    /// Probability that a byte is lost, 0 to 1.
    pub lose: f64,
    /// Probability that a byte arrives as another one, 0 to 1.
    pub corrupt: f64,
    /// Seed of the pseudo-random faults. Equal seeds give equal faults.
    pub seed: u64,
}

/// A serial line and its counters.
#[derive(Default)]
pub(crate) struct SerialLine {
    link: LineQuality,
    random: Random,
    pub lost: u64,
    pub corrupted: u64,
}

impl SerialLine {
    pub fn set(&mut self, link: LineQuality) {
        self.link = link;
        self.random = Random::new(link.seed);
    }

    /// Returns the byte that arrives when `byte` is sent; none if it is lost.
    pub fn pass(&mut self, byte: u8) -> Option<u8> {
        if self.link.lose == 0.0 && self.link.corrupt == 0.0 {
            return Some(byte);
        }
        if self.random.chance(self.link.lose) {
            self.lost += 1;
            return None;
        }
        if self.random.chance(self.link.corrupt) {
            self.corrupted += 1;
            // Any byte but the one that was sent.
            return Some(byte ^ (1 + (self.random.bits() % 255) as u8));
        }
        Some(byte)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_have_the_set_rate_and_repeat() {
        let run = || {
            let mut line = SerialLine::default();
            line.set(LineQuality { lose: 0.1, corrupt: 0.2, seed: 7 });
            let arrived: Vec<Option<u8>> = (0..10_000).map(|n| line.pass(n as u8)).collect();
            (arrived, line.lost, line.corrupted)
        };
        let (arrived, lost, corrupted) = run();
        assert_eq!(run(), (arrived.clone(), lost, corrupted));
        assert!((900..1100).contains(&lost), "{lost}");
        assert!((1650..1950).contains(&corrupted), "{corrupted} of the rest");
        let changed = arrived
            .iter()
            .enumerate()
            .filter(|(sent, arrived)| arrived.is_some_and(|byte| byte != *sent as u8))
            .count();
        assert_eq!(changed as u64, corrupted);
    }

    #[test]
    fn a_good_line_changes_nothing() {
        let mut line = SerialLine::default();
        assert!((0..=255).all(|byte| line.pass(byte) == Some(byte)));
    }
}
