//! A serial line that loses and corrupts bytes.

/// How bad the line is, in both directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Link {
    /// Probability that a byte is lost, 0 to 1.
    pub lose: f64,
    /// Probability that a byte arrives as another one, 0 to 1.
    pub corrupt: f64,
    /// Start of the pseudo-random sequence that decides: equal seeds, equal faults.
    pub seed: u64,
}

/// A line and what it has done.
#[derive(Default)]
pub(crate) struct Line {
    link: Link,
    state: u64,
    pub lost: u64,
    pub corrupted: u64,
}

impl Line {
    pub fn set(&mut self, link: Link) {
        self.link = link;
        self.state = link.seed;
    }

    /// What arrives when `byte` is sent, if anything.
    pub fn pass(&mut self, byte: u8) -> Option<u8> {
        if self.link.lose == 0.0 && self.link.corrupt == 0.0 {
            return Some(byte);
        }
        if self.chance(self.link.lose) {
            self.lost += 1;
            return None;
        }
        if self.chance(self.link.corrupt) {
            self.corrupted += 1;
            // Any byte but the one that was sent.
            return Some(byte ^ (1 + (self.next() % 255) as u8));
        }
        Some(byte)
    }

    fn chance(&mut self, probability: f64) -> bool {
        // 53 bits, as many as the number has.
        ((self.next() >> 11) as f64) < probability * (1_u64 << 53) as f64
    }

    /// SplitMix64.
    fn next(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splitmix64_as_published() {
        // First outputs for seed 1234567 in the reference implementation's test.
        let mut line = Line { state: 1_234_567, ..Line::default() };
        assert_eq!(line.next(), 6_457_827_717_110_365_317);
        assert_eq!(line.next(), 3_203_168_211_198_807_973);
    }

    #[test]
    fn faults_come_as_often_as_asked_and_always_the_same() {
        let run = || {
            let mut line = Line::default();
            line.set(Link { lose: 0.1, corrupt: 0.2, seed: 7 });
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
        let mut line = Line::default();
        assert!((0..=255).all(|byte| line.pass(byte) == Some(byte)));
    }
}
