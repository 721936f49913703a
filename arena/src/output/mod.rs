//! The output of runs: recordings, pictures, tables.

mod chart;
mod history;
pub mod metrics;
pub mod recorder;
pub mod recording;
mod svg;
mod table;
mod trajectories;

pub use chart::chart;
pub use history::History;
pub use table::{RunRow, RunTable, csv_line, quartiles};
pub use trajectories::trajectories;
