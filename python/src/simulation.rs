//! Runs of a scenario.

use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread::{self, ThreadId};

use bittybuzz_arena::output::{Movie, chart};
use bittybuzz_arena::run::TICKS_PER_SECOND;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::{PyKeyError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyFloat, PyInt, PyList};

use crate::arguments::{integer, path};
use crate::arrays::{array_1, array_2, numpy, table};
use crate::error::{Busy, Defect, Error, border, of_scenario};
use crate::expectation::{self, Expectation};
use crate::history::History;
use crate::live_session::LiveSession;
use crate::log_line::LogLine;
use crate::picture::Picture;
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
    /// Samples quantities from the beginning of the run, by default at the interval of the scenario.
    fn sampled(
        &self,
        py: Python<'_>,
        quantities: &[String],
        every: Option<f64>,
    ) -> PyResult<History> {
        let (past, probes, usual) = self.with(|state| {
            let probes = quantities.iter().map(|name| state.probe(py, name).cloned());
            let probes = probes.collect::<PyResult<Vec<_>>>()?;
            Ok((state.past()?, probes, state.run.setup().scenario.output.every))
        })?;
        let every = ticks_of_interval(every.unwrap_or(usual))?;
        border(|| past.sample(py, &probes, every))
    }

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

    /// Returns quantities from the beginning of the run to now, sampled every `every` seconds.
    ///
    /// The dictionary has the times in s as "time", shape (T,), and each quantity by its name, shape
    /// (T, N), float64. The run is repeated for this, so quantities need not be chosen before.
    #[pyo3(signature = (*quantities, every = None))]
    fn history<'py>(
        &self,
        py: Python<'py>,
        quantities: Vec<String>,
        every: Option<f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let history = self.sampled(py, &quantities, every)?;
        let table = PyDict::new(py);
        table.set_item("time", array_1(py, history.times)?)?;
        for (name, samples) in quantities.iter().zip(history.values) {
            table.set_item(name, array_of_samples(py, samples)?)?;
        }
        Ok(table)
    }

    /// Draws a quantity from the beginning of the run to now, sampled every `every` seconds.
    ///
    /// Without a quantity it is the first one of `[output] plot` in the scenario.
    #[pyo3(signature = (quantity = None, every = None))]
    fn plot(
        &self,
        py: Python<'_>,
        quantity: Option<String>,
        every: Option<f64>,
    ) -> PyResult<Picture> {
        let named = |state: &mut State| {
            let plots = &state.run.setup().scenario.output.plot;
            let first = plots.first().map(|(quantity, _)| quantity.to_string());
            first.ok_or_else(|| {
                PyValueError::new_err(
                    "the scenario has no `[output] plot`\n  help: name a quantity, such as \"x\"",
                )
            })
        };
        let quantity = quantity.map_or_else(|| self.with(named), Ok)?;
        let history = self.sampled(py, std::slice::from_ref(&quantity), every)?;
        border(|| Ok(Picture::new(chart(&quantity, &history.times, &history.values[0]))))
    }

    /// Draws the world and its robots, filled with the color of their LEDs, as seen from above.
    fn picture(&self) -> PyResult<Picture> {
        self.with(|state| {
            let mut movie = Movie::default();
            movie.add(&state.run);
            Ok(Picture::new(movie.draw(&state.run.setup().scenario.world, 1.0)))
        })
    }

    /// Simulates `seconds`, at most to the end of the run, and draws the world every `every` seconds.
    ///
    /// Returns a picture that moves, `speed` times as fast as the robots.
    #[pyo3(signature = (seconds, every = 0.5, speed = 1.0))]
    fn movie(slf: &Bound<'_, Self>, seconds: f64, every: f64, speed: f64) -> PyResult<Picture> {
        let py = slf.py();
        let ticks = ticks("seconds", seconds)?;
        let every = ticks_of_interval(every)?;
        if !(speed.is_finite() && speed > 0.0) {
            return Err(PyValueError::new_err(format!("`speed` must be above 0, not {speed}")));
        }
        let simulation = slf.get();
        let _turn = simulation.turn()?;
        let mut movie = Movie::default();
        let mut done = 0;
        loop {
            if done % every == 0 {
                simulation.with(|state| {
                    movie.add(&state.run);
                    Ok(())
                })?;
            }
            let most = (every - done % every).min(ticks - done);
            let advanced = simulation.with(|state| py.detach(|| state.advance(most)))?;
            py.check_signals()?;
            done += advanced;
            if advanced == 0 {
                break;
            }
        }
        simulation
            .with(|state| Ok(Picture::new(movie.draw(&state.run.setup().scenario.world, speed))))
    }

    /// Opens the page of `bbz sim --view` in a notebook, with a run of its own from now on.
    ///
    /// It needs anywidget: `pip install "bittybuzz[notebook]"`. `height` is in pixels.
    #[pyo3(signature = (height = 640))]
    pub fn view<'py>(&self, py: Python<'py>, height: u32) -> PyResult<Bound<'py, PyAny>> {
        let session = self.with(|state| {
            state.check_replayable()?;
            let run = &mut state.run;
            let copy = py.detach(move || run.snapshot());
            let copy = copy.ok_or_else(|| Error::new_err("this run has no copies"))?;
            Ok(LiveSession::new(copy, state.source()?.clone()))
        })?;
        PyModule::import(py, "bittybuzz.notebook")?.getattr("View")?.call1((session, height))
    }

    /// Returns the lines that scripts have logged since the last call, at most the last 100,000.
    fn logs(&self) -> PyResult<Vec<LogLine>> {
        self.with(|state| Ok(state.take_log()))
    }

    /// Returns the measures of the scenario by their names, as they are now. `None` stands for a time that
    /// was not reached yet, and for a number that does not exist.
    fn measures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let measures: Vec<(String, Option<f64>)> = self.with(|state| {
            let values = state.run.summary().measures;
            let names = state.run.setup().scenario.measures.iter().map(|one| one.name.clone());
            Ok(names.zip(values).collect())
        })?;
        let named = PyDict::new(py);
        measures.into_iter().try_for_each(|(name, value)| named.set_item(name, value))?;
        Ok(named)
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

/// Returns the number of ticks in a time.
fn ticks(name: &str, seconds: f64) -> PyResult<u64> {
    let ticks = (seconds * TICKS_PER_SECOND).round();
    if ticks.is_finite() && (0.0..1e15).contains(&ticks) {
        return Ok(ticks as u64);
    }
    Err(PyValueError::new_err(format!("`{name}` must be a time in seconds, not {seconds}")))
}

/// Returns the number of ticks in an interval, which is at least one.
fn ticks_of_interval(every: f64) -> PyResult<u64> {
    let count = ticks("every", every)?;
    match count > 0 {
        true => Ok(count),
        false => Err(PyValueError::new_err(format!("`every` must be at least 0.1 s, not {every}"))),
    }
}

/// Returns samples as an array with a row for each.
fn array_of_samples(
    py: Python<'_>,
    samples: Vec<Vec<Option<f64>>>,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let columns = samples.first().map_or(0, Vec::len);
    let numbers = samples.iter().flatten().map(|number| number.unwrap_or(f64::NAN));
    table(py, columns, numbers.collect())
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
