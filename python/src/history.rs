//! The past of a run: quantities at equal intervals from its beginning.

use std::sync::Arc;
use std::time::{Duration, Instant};

use bittybuzz_arena::run::{QuantityProbe, Setup, Simulation as Run, TICKS_PER_SECOND};
use pyo3::prelude::*;

use crate::error::{Error, NotReplayable, of_scenario};

/// The longest time between two checks for Ctrl-C.
const CHECK_EVERY: Duration = Duration::from_millis(10);

/// Samples of quantities.
pub struct History {
    /// Seconds since the run began.
    pub times: Vec<f64>,
    /// For each quantity a list of samples, each with a number of each robot.
    pub values: Vec<Vec<Vec<Option<f64>>>>,
}

/// The beginning of a run and its commands, from which it can be repeated.
pub struct Past {
    setup: Arc<Setup>,
    seed: u32,
    commands: Vec<(u64, String)>,
    end: u64,
    digest: u64,
}

impl Past {
    /// Returns the past of a run that began with a setup.
    pub fn of(run: &Run, setup: Arc<Setup>) -> Self {
        let commands = run.command_list().map(|(tick, text)| (tick, text.to_owned()));
        Past {
            setup,
            seed: run.seed(),
            commands: commands.collect(),
            end: run.now(),
            digest: run.digest(),
        }
    }

    /// Runs the world again to the present, and samples quantities every `every` ticks.
    pub fn sample(
        &self,
        py: Python<'_>,
        probes: &[QuantityProbe],
        every: u64,
    ) -> PyResult<History> {
        let run = py.detach(|| Run::new(self.setup.clone(), self.seed, 1));
        let mut run = run.map_err(|error| of_scenario(py, &[error]))?;
        for (tick, text) in &self.commands {
            run.command_at(*tick, text).map_err(|errors| of_scenario(py, &errors))?;
        }
        let mut history = History { times: Vec::new(), values: vec![Vec::new(); probes.len()] };
        loop {
            let is_there = py.detach(|| history.advance(&mut run, probes, every, self.end))?;
            py.check_signals()?;
            if is_there {
                break;
            }
        }
        match run.digest() == self.digest {
            true => Ok(history),
            false => Err(NotReplayable::new_err(
                "this run does not repeat from its beginning: it was changed other than by commands",
            )),
        }
    }
}

impl History {
    /// Runs the world until it is time for a check for Ctrl-C. Returns true once it is at the end.
    fn advance(
        &mut self,
        run: &mut Run,
        probes: &[QuantityProbe],
        every: u64,
        end: u64,
    ) -> PyResult<bool> {
        let begin = Instant::now();
        loop {
            if run.now().is_multiple_of(every) {
                self.times.push(run.now() as f64 / TICKS_PER_SECOND);
                for (samples, probe) in self.values.iter_mut().zip(probes) {
                    samples.push(run.numbers(probe));
                }
            }
            if run.now() >= end {
                return Ok(true);
            }
            run.tick().map_err(|error| Error::new_err(error.to_string()))?;
            run.take_log();
            if begin.elapsed() >= CHECK_EVERY {
                return Ok(false);
            }
        }
    }
}
