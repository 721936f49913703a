//! The supervisor, which alone decides if the motors may turn.
