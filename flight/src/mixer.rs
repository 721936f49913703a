//! The mixer: from thrust and torque to the thrust of each motor, with priorities.
