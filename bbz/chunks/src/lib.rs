//! Finished runs of a sweep, in a folder that any number of processes fill.
//!
//! A [`Plan`] lists the runs of a sweep and cuts them into chunks. A process carries out a chunk and
//! writes its rows with [`Store::write`]. The processes need neither each other nor a server: a shared
//! drive is enough, and so are folders that are copied together later.
//!
//! # Principles
//! * **A run is named by its inputs.** Its [`RunKey`] has the settings and the seed. It does not
//!   depend on the numbers of points, replicates and chunks, so more of them keep every finished run.
//! * **A folder is an experiment, not a place.** Names of files are relative, and hashes of their
//!   contents decide if rows belong together. The folder may move to another computer.
//! * **No lock.** A file is written under a name of its own, synced, renamed, and the folder is synced.
//!   Two processes with the same chunk write the same bytes.
//! * **A reported chunk is not lost.** [`Store::write`] returns when the rows survive a loss of power.
//! * **A damaged file is no result.** Each file ends with a checksum. [`Store::chunk`] moves a damaged file
//!   aside and names it, and the runs count as missing.
//! * **Nothing is mixed in silence.** Rows of other sources, scripts or scenarios, and two different
//!   results of one run, are errors that name the files.
//!
//! # Cost
//! A row takes about 100 bytes and 20 for each metric. A process that carries out one chunk reads the
//! plan and the files of that chunk, unless the folder holds files of an earlier plan.
//!
//! # What it will not do
//! It runs nothing and schedules nothing, and it does not know what settings and metrics mean.

mod disk;
mod file;
mod plan;
mod row;
mod store;

pub use disk::{Disk, Folder};
pub use plan::{Chance, Experiment, Parameter, Plan, RUNS_MAX};
pub use row::{Outcome, Row, RunKey};
pub use store::{Aside, FileKind, Found, PLAN, Store, StoreError, file_kind};
