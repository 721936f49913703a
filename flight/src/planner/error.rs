//! Reasons why a planner refuses a command.

/// A reason why a planner refused a command. The plan before the command stays in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlanError {
    /// A number is not finite.
    NotFinite,
    /// The duration is not positive, not a number or longer than 1800 s.
    Duration,
    /// The limits permit no flight to the goal within 1800 s.
    TooFar,
    /// A limit is not finite or not positive.
    Limits,
    /// The robot flies already.
    Flying,
    /// The robot does not fly.
    NotFlying,
    /// The robot lands already.
    Landing,
    /// The robot does not land.
    NotLanding,
    /// The start is outside the fence, seen from above, or above its top.
    OutsideFence,
    /// The height of a take-off is not above its start.
    Height,
    /// The trajectory has no piece.
    NoPiece,
    /// The trajectory has more pieces than the planner can store.
    TooManyPieces,
    /// A piece of the trajectory cannot be flown.
    Piece {
        /// Position of the piece, from 0.
        piece: usize,
        /// The first fault found.
        fault: PieceFault,
    },
}

/// A reason why a piece of a trajectory cannot be flown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PieceFault {
    /// The piece starts at another position than the one before ends, or than the reference.
    Position,
    /// The piece starts with another velocity.
    Velocity,
    /// The piece starts with another acceleration.
    Acceleration,
    /// The piece starts with another yaw or rate of yaw.
    Yaw,
    /// The piece exceeds the horizontal or the vertical speed.
    SpeedLimit,
    /// The piece exceeds the acceleration.
    AccelerationLimit,
    /// The piece exceeds the jerk.
    JerkLimit,
    /// The piece exceeds the rate of yaw.
    YawRateLimit,
    /// The piece leaves the fence.
    Fence,
    /// The last piece does not end at rest.
    EndsInMotion,
}
