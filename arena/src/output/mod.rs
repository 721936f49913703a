//! The output of runs: recordings, pictures, tables.

mod axes;
mod backdrop;
mod chart;
mod figure;
mod heat_map;
mod history;
pub mod metrics;
mod movie;
pub mod recorder;
pub mod recording;
mod svg;
mod table;
mod trajectories;

pub use chart::chart;
pub use figure::{CURVES_MAX, CurvePoint, Figure, Panel};
pub use heat_map::{CELLS_MAX, HeatMap};
pub use history::History;
pub use movie::Movie;
pub use svg::escape;
pub use table::{RunRow, RunTable, csv_line};
pub use trajectories::trajectories;
