//! Tables of numbers and texts, in the two forms that other programs read without options: Parquet and CSV.
//!
//! A [`Schema`] names the columns, each with a kind and, for numbers, a unit. A [`TableWriter`] takes a
//! [`Block`] of rows at a time, and a [`TableReader`] gives back some columns of a file, piece by piece.
//!
//! # Principles
//! * **Integers of small units.** A pose in tenths of a millimeter takes half of the bytes of a floating-point
//!   number, and the name of the column says the unit. Neighboring rows differ little, so that
//!   differences take less than values: sort a block by the robot first.
//! * **One file is one table.** A file is complete only when [`TableWriter::finish`] has returned; a program that is
//!   killed before leaves a Parquet file that nobody can read, and a CSV file that ends early.
//! * **Files may come from others.** A damaged file is an error, or a panic of the library for Parquet, which
//!   the caller stops.
//! * **The same rows give the same bytes.** Files contain neither times nor names of computers.
//!
//! # Cost
//! 600,000 rows with run, tick, robot, x, y, heading, LED and state take 675 million instructions, about 0.08 s
//! of a processor, and 3.3 bytes each as Parquet (`examples/cost.rs`, 2026-11-30). The crate `parquet` without
//! Arrow adds 1.7 MB to a program.
//!
//! # What it will not do
//! It has no nested columns and no dates, it writes no 64-bit integers, and it reads no compression other than
//! Snappy.

mod block;
mod csv;
mod csv_reader;
mod parquet;
mod parquet_reader;
mod read_error;
mod reader;
mod schema;
mod values;
mod writer;

pub use block::{Block, BlockError, Cells};
pub use read_error::TableReadError;
pub use reader::{Pieces, TableReader};
pub use schema::{Column, Kind, Schema, SchemaError};
pub use values::{Values, Wanted};
pub use writer::{Form, TableError, TableWriter};
