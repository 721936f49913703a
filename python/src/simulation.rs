//! Runs of a scenario.

use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread::{self, ThreadId};

use bittybuzz_arena::run::TICKS_PER_SECOND;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::{PyKeyError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyFloat, PyInt, PyList};

use crate::arguments::{integer, path};
use crate::arrays::{array_1, array_2, numpy};
use crate::error::{Busy, Defect, Error, border, of_scenario};
use crate::expectation::{self, Expectation};
use crate::log_line::LogLine;
use crate::recording::{Recorder, Recording};
use crate::snapshot::Snapshot;
use crate::state::State;
use crate::{stigmergy, toml_text};

/// A run of a scenario, which advances in ticks of 0.1 s.
#[pyclass(frozen, module = "bittybuzz")]
pub struct Simulation {
    state: Mutex<State>,
    /// The thread that is in `step`, whose callbacks may use the simulation between two ticks.
    stepping: Mutex<Option<ThreadId>>,
}

/// The right of a thread to step, until it is dropped.
struct Turn<'a>(&'a Simulation);

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        *self.0.stepping() = None;
    }
}

impl Simulation {
    pub fn new(state: State) -> Self {
        Simulation { state: Mutex::new(state), stepping: Mutex::new(None) }
    }

    /// Locks the owner of the turn. No code runs Python or waits while it holds this lock.
    fn stepping(&self) -> MutexGuard<'_, Option<ThreadId>> {
        self.stepping.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins a call of `step`.
    fn turn(&self) -> PyResult<Turn<'_>> {
        let mut stepping = self.stepping();
        match *stepping {
            None => {
                *stepping = Some(thread::current().id());
                Ok(Turn(self))
            }
            Some(owner) if owner == thread::current().id() => {
                Err(Busy::new_err("a callback of `step` cannot step or restore its simulation"))
            }
            Some(_) => Err(in_use()),
        }
    }

    /// Calls a function with the state, unless another thread uses it. A panic makes the simulation
    /// unusable, because its state may be half changed.
    pub fn with<T>(&self, act: impl FnOnce(&mut State) -> PyResult<T>) -> PyResult<T> {
        border(|| {
            if self.stepping().is_some_and(|owner| owner != thread::current().id()) {
                return Err(in_use());
            }
            match self.state.try_lock() {
                Ok(mut state) => act(&mut state),
                Err(TryLockError::WouldBlock) => Err(in_use()),
                Err(TryLockError::Poisoned(_)) => {
                    Err(Defect::new_err("an earlier defect has made this simulation unusable"))
                }
            }
        })
    }
}

fn in_use() -> PyErr {
    Busy::new_err(
        "this simulation is in use: by another thread, or by the tick that calls this callback",
    )
}

#[pymethods]
impl Simulation {
    /// Simulates `n` ticks of 0.1 s, at most to the end of the run.
    ///
    /// Returns the number of ticks. `each` is called with the simulation after each tick.
    #[pyo3(signature = (n = None, each = None))]
    fn step(
        slf: &Bound<'_, Self>,
        n: Option<&Bound<'_, PyAny>>,
        each: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<u64> {
        let py = slf.py();
        let n = n.map_or(Ok(1), |n| integer("n", n, 0..=i64::MAX))?.unsigned_abs();
        if let Some(each) = each.filter(|each| !each.is_callable()) {
            let kind = each.get_type().name()?;
            return Err(PyTypeError::new_err(format!("`each` must be callable, not a {kind}")));
        }
        let simulation = slf.get();
        let _turn = simulation.turn()?;
        let mut done = 0;
        while done < n {
            let most = if each.is_some() { 1 } else { n - done };
            let ticks = simulation.with(|state| py.detach(|| state.advance(most)))?;
            done += ticks;
            py.check_signals()?;
            if ticks == 0 {
                break;
            }
            if let Some(each) = each {
                each.call1((slf,))?;
            }
        }
        Ok(done)
    }

    /// Seconds since the run began.
    #[getter]
    fn time(&self) -> PyResult<f64> {
        self.with(|state| Ok(state.run.now() as f64 / TICKS_PER_SECOND))
    }

    /// True if the duration of the scenario is over.
    #[getter]
    fn is_over(&self) -> PyResult<bool> {
        self.with(|state| Ok(state.run.is_over()))
    }

    /// The seed of the run.
    #[getter]
    fn seed(&self) -> PyResult<u32> {
        self.with(|state| Ok(state.run.seed()))
    }

    /// The ids of the robots, in the order of the rows of arrays.
    #[getter]
    fn ids(&self) -> PyResult<Vec<u16>> {
        self.with(|state| {
            let setup = state.run.setup();
            Ok((0..state.run.robot_count()).map(|number| setup.id(number)).collect())
        })
    }

    /// Returns the poses of all robots: shape (N, 4), float32; x, y and z in mm, heading in rad.
    ///
    /// A robot that has not joined has NaN.
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        self.with(|state| {
            let pose = |number| match state.run.view(number) {
                Some(view) => [view.pose.x, view.pose.y, view.pose.z, view.pose.heading],
                None => [f32::NAN; 4],
            };
            array_2(py, (0..state.run.robot_count()).map(pose).collect())
        })
    }

    /// Returns the colors of the LEDs: shape (N,), uint8; 0 (off) to 7 (white).
    ///
    /// The bits are red (1), green (2) and blue (4). A robot that has not joined has 0.
    fn leds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u8>>> {
        self.with(|state| {
            let led = |number| state.run.view(number).map_or(0, |view| view.led);
            array_1(py, (0..state.run.robot_count()).map(led).collect())
        })
    }

    /// Returns a quantity of all robots: shape (N,), float64; shape (1,) for one of the swarm.
    ///
    /// The quantities and their units are those of `plot` in scenarios, such as "global.hops".
    /// NaN stands for a value that is no number, and for a robot that has not joined.
    fn read<'py>(&self, py: Python<'py>, quantity: &str) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.with(|state| array_1(py, state.numbers(py, quantity)?))
    }

    /// Sets a global in the scripts of all robots, before the next tick.
    ///
    /// `values` is one number, or an array of shape (N,). Integers stay integers, and floats stay
    /// floats. NaN leaves the value of a robot as it is. The change is a command of the run.
    fn write(&self, py: Python<'_>, quantity: &str, values: &Bound<'_, PyAny>) -> PyResult<()> {
        let name = quantity.strip_prefix("global.").filter(|name| !name.contains('.'));
        let Some(name) = name else {
            let text = format!(
                "`{quantity}` cannot be written\n  help: only a global can, such as \"global.hops\""
            );
            return Err(PyValueError::new_err(text));
        };
        let count = self.with(|state| Ok(state.run.robot_count()))?;
        let numbers = numbers_text(py, values, count)?;
        let command = format!("set = \"all\"\nglobal = {}\n{numbers}", toml_text::string(name));
        self.command(py, &command)
    }

    /// Gives a command, which acts before the next tick: the keys of an `[[event]]` without `at`.
    fn command(&self, py: Python<'_>, text: &str) -> PyResult<()> {
        self.with(|state| state.run.command(text).map_err(|errors| of_scenario(py, &errors)))
    }

    /// All commands as `[[event]]`s. A scenario that ends with this text replays the run.
    #[getter]
    fn commands(&self) -> PyResult<String> {
        self.with(|state| {
            state.check_replayable()?;
            Ok(state.run.commands())
        })
    }

    /// Returns the stigmergies that a robot knows: a dictionary of entries for each, by its number.
    fn stigmergy<'py>(
        &self,
        py: Python<'py>,
        robot: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let id = integer("robot", robot, 0..=i64::from(u16::MAX))?;
        self.with(|state| {
            let setup = state.run.setup();
            let mut numbers = 0..state.run.robot_count();
            match numbers.find(|number| i64::from(setup.id(*number)) == id) {
                Some(number) => stigmergy::of_robot(py, &state.run, number),
                None => Err(PyKeyError::new_err(format!("no robot has the id {id}"))),
            }
        })
    }

    /// Returns a copy of the state, to which `restore` returns.
    fn snapshot(&self, py: Python<'_>) -> PyResult<Snapshot> {
        self.with(|state| {
            state.check_replayable()?;
            // The run can be sent to another thread, but not shared.
            let run = &mut state.run;
            let copy = py.detach(move || run.snapshot());
            let copy = copy.ok_or_else(|| Error::new_err("this run has no snapshots"))?;
            Ok(Snapshot::new(copy, state.ground.clone()))
        })
    }

    /// Returns to the state of a snapshot of this simulation, or of another one of the same scenario.
    fn restore(&self, snapshot: &Snapshot) -> PyResult<()> {
        let _turn = self.turn()?;
        self.with(|state| {
            if state.recorder.is_some() {
                return Err(Error::new_err(
                    "a run that is recorded cannot be restored\n  help: close the recording first",
                ));
            }
            let (run, ground) = snapshot.copy_for(&state.run)?;
            state.replace(run, ground);
            Ok(())
        })
    }

    /// Returns the digest of the run, 16 hexadecimal digits: that of `bbz sim --json`.
    fn digest(&self) -> PyResult<String> {
        self.with(|state| Ok(format!("{:016x}", state.run.digest())))
    }

    /// Begins a recording of this run, which `bbz sim --view` shows.
    ///
    /// It has samples at the interval of the scenario, and is complete when it is closed: use it in
    /// a `with` statement.
    fn record(slf: &Bound<'_, Self>, path: &Bound<'_, PyAny>) -> PyResult<Recording> {
        let path = self::path("path", path)?;
        slf.get().with(|state| {
            if state.recorder.is_some() {
                return Err(Error::new_err(
                    "this run is being recorded\n  help: close the recording first",
                ));
            }
            let recorder = state.recorder.insert(Recorder::new(&path, &state.run)?);
            Ok(Recording::new(slf.clone().unbind(), recorder))
        })
    }

    /// Returns the lines that scripts have logged since the last call, at most the last 100,000.
    fn logs(&self) -> PyResult<Vec<LogLine>> {
        self.with(|state| Ok(state.take_log()))
    }

    /// Returns the expectations of the scenario with their current outcomes.
    fn expectations(&self) -> PyResult<Vec<Expectation>> {
        self.with(|state| Ok(expectation::all(&state.run)))
    }

    fn __repr__(&self) -> String {
        let described = self.with(|state| {
            let seconds = state.run.now() as f64 / TICKS_PER_SECOND;
            Ok(format!("<Simulation of {} robots at {seconds} s>", state.run.robot_count()))
        });
        described.unwrap_or_else(|_| "<Simulation in use>".to_owned())
    }
}

/// Returns the numbers of a command `set` as TOML: one for all robots, or a list.
fn numbers_text(py: Python<'_>, values: &Bound<'_, PyAny>, count: usize) -> PyResult<String> {
    // An integer or float needs no NumPy.
    if values.is_instance_of::<PyInt>() || values.is_instance_of::<PyFloat>() {
        return Ok(format!("number = {}", number_text(values)?));
    }
    let array = numpy(py)?.call_method1("asarray", (values,))?;
    let items = array.call_method0("tolist")?;
    let Ok(items) = items.cast::<PyList>() else {
        return Ok(format!("number = {}", number_text(&items)?));
    };
    let shape = array.getattr("shape")?;
    if shape.len()? != 1 || items.len() != count {
        let text =
            format!("`values` must be a number or an array of shape ({count},), not {shape}");
        return Err(PyValueError::new_err(text));
    }
    let numbers = items.iter().map(|item| number_text(&item));
    Ok(format!("numbers = [{}]", numbers.collect::<PyResult<Vec<String>>>()?.join(", ")))
}

/// Returns a number of Python as TOML.
fn number_text(value: &Bound<'_, PyAny>) -> PyResult<String> {
    if let Ok(number) = value.cast::<PyFloat>() {
        return Ok(toml_text::float(number.value()));
    }
    match value.call_method0("__index__").map(|index| index.str()) {
        Ok(digits) => Ok(digits?.to_string_lossy().into_owned()),
        Err(_) => {
            let kind = value.get_type().name()?;
            Err(PyTypeError::new_err(format!("`values` must be numbers, not a {kind}")))
        }
    }
}
