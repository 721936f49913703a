//! Reasons why a packet has no effect, and their counts.

/// A reason why a packet of a ground station has no effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Refusal {
    /// The packet is longer than 31 bytes or has no header.
    NoPacket,
    /// The robot has no such port, channel or command.
    Unknown,
    /// Bitcraze's firmware knows the command, and this robot does not execute it.
    Unsupported,
    /// The data has another length than the command.
    Length,
    /// A number is infinite or not a number.
    NotFinite,
    /// A number is finite, and no robot can do that.
    OutOfRange,
    /// A quaternion is not of length 1.
    NotUnit,
    /// There is no such parameter or log variable.
    NoVariable,
    /// The value has another type than the parameter.
    WrongType,
    /// Only the robot changes this parameter.
    ReadOnly,
    /// This parameter changes only while the robot does not fly.
    InFlight,
    /// The limit can only be tightened while the robot flies.
    Loosened,
    /// There is no such memory, or the address is beyond its end.
    Address,
    /// The trajectory is not defined, or its memory holds none.
    NoTrajectory,
    /// There is no such log block, there is one already, or there is no room for it.
    LogBlock,
}

impl Refusal {
    /// All reasons.
    pub const ALL: [Refusal; 15] = [
        Refusal::NoPacket,
        Refusal::Unknown,
        Refusal::Unsupported,
        Refusal::Length,
        Refusal::NotFinite,
        Refusal::OutOfRange,
        Refusal::NotUnit,
        Refusal::NoVariable,
        Refusal::WrongType,
        Refusal::ReadOnly,
        Refusal::InFlight,
        Refusal::Loosened,
        Refusal::Address,
        Refusal::NoTrajectory,
        Refusal::LogBlock,
    ];
}

/// The number of packets that were refused for each reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RefusalCounts {
    counts: [u32; Refusal::ALL.len()],
}

impl RefusalCounts {
    /// Returns the number of packets that were refused for this reason.
    pub fn of(&self, reason: Refusal) -> u32 {
        self.counts.get(reason as usize).copied().unwrap_or(0)
    }

    /// Returns the number of packets that were refused.
    pub fn total(&self) -> u32 {
        self.counts.iter().fold(0, |sum: u32, count| sum.saturating_add(*count))
    }

    pub(crate) fn add(&mut self, reason: Refusal) {
        if let Some(count) = self.counts.get_mut(reason as usize) {
            *count = count.saturating_add(1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_reason_has_a_count() {
        let mut counts = RefusalCounts::default();
        for (number, reason) in Refusal::ALL.into_iter().enumerate() {
            assert_eq!(reason as usize, number);
            counts.add(reason);
            assert_eq!((counts.of(reason), counts.total()), (1, 1 + number as u32));
        }
    }
}
