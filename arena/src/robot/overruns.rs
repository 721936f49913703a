//! Steps that take longer than the time between two steps.

use super::program::ProgramId;

/// The overruns of a robot since power-on. Most robots have none, so it is allocated at the first one.
#[derive(Debug, Clone)]
pub struct Overruns {
    /// Steps that were due while the script still executed the one before.
    pub missed: u64,
    /// The first overrun.
    pub first: Overrun,
}

/// A step that was due while the script still executed the one before.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Overrun {
    /// The tick at which the step was due.
    pub tick: u64,
    /// The program of the robot.
    pub program: ProgramId,
    /// Position in the code of the instruction that the script was executing; `None` if only the
    /// firmware knows it.
    pub position: Option<u16>,
}
