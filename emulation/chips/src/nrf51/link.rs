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
