//! Stored states of simulations.

use std::sync::{Arc, Mutex};

use bittybuzz_arena::run::{Simulation as Run, TICKS_PER_SECOND};
use pyo3::prelude::*;

use crate::error::Busy;
use crate::state::Ground;

/// A state of a simulation, to which it can return any number of times.
#[pyclass(frozen, module = "bittybuzz")]
pub struct Snapshot {
    run: Mutex<Run>,
    ground: Option<Ground>,
    #[pyo3(get)]
    time: f64,
}

impl Snapshot {
    pub fn new(run: Run, ground: Option<Ground>) -> Self {
        let time = run.now() as f64 / TICKS_PER_SECOND;
        Snapshot { run: Mutex::new(run), ground, time }
    }

    /// Returns a copy of the state, if it is one of a run of the scenario.
    pub fn copy_for(&self, other: &Run) -> PyResult<(Run, Option<Ground>)> {
        let Ok(run) = self.run.try_lock() else {
            return Err(Busy::new_err("another thread restores this snapshot"));
        };
        if !Arc::ptr_eq(&run.setup().scenario, &other.setup().scenario) {
            return Err(crate::error::Error::new_err(
                "this snapshot is one of another scenario\n  help: restore it in a simulation that the same `Scenario` has started",
            ));
        }
        let copy = run.snapshot().expect("a copy can be copied");
        Ok((copy, self.ground.clone()))
    }
}

#[pymethods]
impl Snapshot {
    fn __repr__(&self) -> String {
        format!("<Snapshot at {} s>", self.time)
    }
}
