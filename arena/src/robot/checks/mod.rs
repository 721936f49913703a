//! Checks of a running script: numbers that do not fit its profile, and the memory and time that it needs.
//!
//! # Method
//! A [`MachineChecker`] runs the machine one instruction at a time. Before an arithmetic instruction it
//! reads the operands from the stack, computes the result in 64 bits, and compares it with the
//! result of the machine. The alternative is a number profile that counts. This would be a third
//! profile, with messages and queues of its own. It would not know the place in the script, and it
//! would count the arithmetic of random numbers and messages, which wraps by design.
//!
//! # Same results
//! The machine may stop between any two instructions, and its results do not depend on the place.
//! The checker only reads. It takes the same amount from the budget as the machine: one for an
//! instruction, plus the work on text, which the machine reports to
//! [`Host::has_worked`](bittybuzz_vm_core::Host::has_worked). A slice therefore ends at the same
//! instruction with and without the checker.
//!
//! # Limits
//! The checker does not see operands that no instruction of the script puts on the stack, such as
//! those of a built-in function that another built-in calls, as in `map(t, math.exp)`. Numbers that
//! come from outside, such as distances and results of robot functions, are already rounded to the
//! profile. Robots in emulators are not checked.

mod checker;
mod costs;
mod findings;
mod operation;
mod watch;

pub(crate) use checker::TextMeter;
pub use checker::{MachineChecker, RunSlice};
pub use costs::Costs;
pub use findings::{FailedOperation, Findings, Occurrences, Peak, RobotMoment, StepCosts};
pub use operation::{Anomaly, Exact, Operation, Operator};
pub use watch::{Watch, WatchStop, WatchedStatement, WatchedTick};
