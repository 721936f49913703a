//! Collision avoidance between robots that know each other's positions.
