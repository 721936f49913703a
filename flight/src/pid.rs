//! A PID controller.
