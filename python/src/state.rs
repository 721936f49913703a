//! The state of a simulation, which one caller at a time uses.

use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use bittybuzz_arena::run::{QuantityProbe, Setup, Simulation as Run};
use bittybuzz_arena::scenario::{AGGREGATES, QUANTITIES, Quantity};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::error::{Error, of_scenario};
use crate::history::Past;
use crate::log_line::LogLine;
use crate::recording::Recorder;
use crate::scenario::ScenarioText;

/// The longest time between two checks for Ctrl-C. A tick ends before a check.
const CHECK_EVERY: Duration = Duration::from_millis(10);

/// The most log lines that are kept. Older ones are discarded.
const LINES_MAX: usize = 100_000;

/// The exception of a callback that the world called, until it is raised.
pub type Failure = Arc<Mutex<Option<PyErr>>>;

/// The ground of the caller.
#[derive(Clone)]
pub struct Ground {
    pub failure: Failure,
    /// True if the caller has declared that values depend on places alone.
    pub is_pure: bool,
}

/// A run, and the data that its users need.
pub struct State {
    pub run: Run,
    pub ground: Option<Ground>,
    pub recorder: Option<Recorder>,
    /// The setup with which the run began.
    begun: Arc<Setup>,
    /// The text of the scenario; `None` for a copy of a page's run, whose text may have been edited.
    source: Option<Arc<ScenarioText>>,
    lines: VecDeque<LogLine>,
    /// The quantities that were read before, with the setup in which their names were resolved.
    probes: HashMap<String, QuantityProbe>,
    probed: Arc<Setup>,
}

impl State {
    pub fn new(run: Run, ground: Option<Ground>) -> Self {
        let probed = run.setup().clone();
        let (lines, probes) = (VecDeque::new(), HashMap::new());
        let (begun, source, recorder) = (probed.clone(), None, None);
        State { run, ground, recorder, begun, source, lines, probes, probed }
    }

    /// Sets the text of the scenario.
    pub fn of_scenario(self, source: Arc<ScenarioText>) -> Self {
        State { source: Some(source), ..self }
    }

    /// Returns the text of the scenario.
    pub fn source(&self) -> PyResult<&ScenarioText> {
        self.source.as_deref().ok_or_else(|| {
            Error::new_err("this run is a copy of a page's, which has the text of its scenario")
        })
    }

    /// Returns the past of the run.
    pub fn past(&self) -> PyResult<Past> {
        self.check_replayable()?;
        Ok(Past::of(&self.run, self.begun.clone()))
    }

    /// Replaces the run by another state of it. Log lines of ticks that have not come yet are
    /// discarded.
    pub fn replace(&mut self, run: Run, ground: Option<Ground>) {
        (self.run, self.ground) = (run, ground);
        let now = self.run.now() as f64 / bittybuzz_arena::run::TICKS_PER_SECOND;
        self.lines.retain(|line| line.time < now);
    }

    /// Simulates at most `most` ticks, until the time for a check for Ctrl-C has come or the run is
    /// over. Returns the number of ticks.
    pub fn advance(&mut self, most: u64) -> PyResult<u64> {
        let begin = Instant::now();
        let mut ticks = 0;
        while ticks < most && !self.run.is_over() {
            self.run.tick().map_err(|error| Error::new_err(error.to_string()))?;
            ticks += 1;
            self.take_lines();
            if let Some(recorder) = &mut self.recorder {
                recorder.sample(&self.run)?;
            }
            if let Some(error) = self.ground.as_ref().and_then(Ground::take_failure) {
                return Err(error);
            }
            if begin.elapsed() >= CHECK_EVERY {
                break;
            }
        }
        Ok(ticks)
    }

    /// Takes the lines of a tick, which would accumulate in the robots.
    fn take_lines(&mut self) {
        let lines = self.run.take_log();
        let setup = self.run.setup();
        self.lines.extend(lines.iter().map(|(robot, line)| LogLine::new(setup, *robot, line)));
        let surplus = self.lines.len().saturating_sub(LINES_MAX);
        self.lines.drain(..surplus);
    }

    /// Returns the log lines since the last call.
    pub fn take_log(&mut self) -> Vec<LogLine> {
        self.lines.drain(..).collect()
    }

    /// Returns a quantity whose names are resolved.
    pub fn probe(&mut self, py: Python<'_>, quantity: &str) -> PyResult<&QuantityProbe> {
        if !Arc::ptr_eq(&self.probed, self.run.setup()) {
            self.probes.clear();
            self.probed = self.run.setup().clone();
        }
        if !self.probes.contains_key(quantity) {
            let Some(parsed) = Quantity::parse(quantity) else {
                let known = [QUANTITIES, AGGREGATES].concat().join(", ");
                let text = format!("`{quantity}` is no quantity\n  help: one of {known}");
                return Err(PyValueError::new_err(text));
            };
            let probe = self.probed.probe(&parsed);
            let probe = probe.map_err(|error| of_scenario(py, &[error]))?;
            self.probes.insert(quantity.to_owned(), probe);
        }
        Ok(&self.probes[quantity])
    }

    /// Returns the current numbers of a quantity; NaN stands for a value that is not a number.
    pub fn numbers(&mut self, py: Python<'_>, quantity: &str) -> PyResult<Vec<f64>> {
        self.probe(py, quantity)?;
        let numbers = self.run.numbers(&self.probes[quantity]);
        Ok(numbers.into_iter().map(|number| number.unwrap_or(f64::NAN)).collect())
    }

    /// Fails if the run cannot be repeated from its commands.
    pub fn check_replayable(&self) -> PyResult<()> {
        match self.ground.as_ref().is_none_or(|ground| ground.is_pure) {
            true => Ok(()),
            false => Err(crate::error::NotReplayable::new_err(
                "the ground of this run is a callback that may return other values each time\n  help: start with `pure=True` if its values depend on the places alone",
            )),
        }
    }
}

impl Ground {
    fn take_failure(&self) -> Option<PyErr> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}
