//! Robots in the simulator: their models and the execution of their scripts.
//!
//! Each robot that ships has a crate with its model (`robots/NAME/model`), which implements
//! [`RobotModel`]. Programs take the list of all models from `robots/models` and pass it to the
//! reader of scenarios. This crate depends on none of them.

mod brain;
mod call;
pub mod checks;
mod content;
mod context;
mod described;
mod effect;
mod emulation;
mod faults;
mod held;
mod log;
mod lone;
mod machine;
mod model;
mod overruns;
mod platform;
mod post_mortem;
mod program;
mod question;
mod queue;
mod seen;
mod state;

pub use brain::SimRobot;
pub use call::{
    Autopilot, BatteryState, CallNumbers, Done, Effect, FunctionMemory, PoseError, RobotCall,
};
pub use content::{ScriptNumber, VariableContent};
pub use context::GroupContext;
pub(crate) use context::step_rates;
pub use described::{DescribedRobot, LINK as DESCRIBED_LINK};
pub use effect::{common as common_effect, led};
pub use emulation::{Emulation, FlashJob, layout_section};
pub use faults::{Consequence, FaultCounts, FaultRecord};
pub use held::HeldRobot;
pub use log::{LineKind, LogLine, News, Piece};
pub use lone::{LoneCall, LoneRefusal, LoneRobot};
pub use model::{Glyph, ModelKeys, Models, RobotModel, SurroundingsKey};
pub use overruns::{Overrun, Overruns};
pub use post_mortem::PostMortem;
pub use program::ProgramId;
pub(crate) use question::{Answer, Question};
pub(crate) use queue::QUEUED_MAX;
pub(crate) use seen::SeenEvent;
pub use seen::{CallResult, FunctionCall, Interest};
