//! The folder of a sweep.

use std::path::{Path, PathBuf};

use bittybuzz_chunks::{Folder, Store};

use crate::chunks::StoreProblem;
use crate::problem::Problem;

/// A folder without a plan.
#[derive(Debug, thiserror::Error)]
#[error("`{0}` has no plan of a sweep")]
struct NoPlan(PathBuf);

impl Problem for NoPlan {
    fn help(&self) -> Option<String> {
        Some("`bbz sweep plan SCENARIO.toml` makes a folder with one".to_owned())
    }
}

/// Opens the folder of a sweep.
pub fn open(path: &Path) -> Result<Store<Folder>, Box<dyn Problem>> {
    let store = Store::open(Folder(path.to_owned())).map_err(StoreProblem)?;
    Ok(store.ok_or_else(|| NoPlan(path.to_owned()))?)
}
