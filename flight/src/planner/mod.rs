//! The planner: from commands to references.
