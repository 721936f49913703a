//! Tests of the memories, with contents that Bitcraze's cflib wrote.

mod configurations;
mod contents;
mod contents_any;
mod scans;
