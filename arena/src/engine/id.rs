//! Numbers of robots.

/// The number of a robot: its place in the order of joining, and its id in frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RobotId(pub u16);
