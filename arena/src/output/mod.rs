//! The output of runs: recordings, pictures, tables.

mod backdrop;
mod chart;
mod history;
pub mod metrics;
mod movie;
pub mod recorder;
pub mod recording;
mod svg;
mod table;
mod trajectories;

pub use chart::chart;
pub use history::History;
pub use movie::Movie;
pub use table::{RunRow, RunTable, csv_line};
pub use trajectories::trajectories;
