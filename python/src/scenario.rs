//! Scenarios with their scripts.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use bittybuzz_arena::run::{Setup, Simulation as Run};
use bittybuzz_live::{CompilerMessage, ScenarioFiles};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arguments::{THREADS_MAX, integer, path};
use crate::error::{border, of_messages, of_scenario};
use crate::ground::PythonGround;
use crate::simulation::Simulation;
use crate::state::{Ground, State};
use crate::toml_text::settings;

/// The name of a text that is in no file, for messages.
const TEXT: &str = "<text>";

/// The text of a scenario, and its path.
#[derive(Clone, Debug)]
pub struct ScenarioText {
    pub path: PathBuf,
    pub text: String,
}

/// A scenario with its compiled scripts, from which any number of simulations start.
#[pyclass(frozen, module = "bittybuzz")]
pub struct Scenario {
    setup: Arc<Setup>,
    source: Arc<ScenarioText>,
}

impl Scenario {
    /// Opens a scenario without the interpreter's lock.
    fn opened(
        py: Python<'_>,
        source: impl FnOnce(&ScenarioFiles) -> Result<ScenarioText, String> + Send,
        set: &[String],
    ) -> PyResult<Self> {
        let open = || {
            let files = ScenarioFiles::on_disk();
            let source = source(&files).map_err(|text| vec![CompilerMessage::error(text)])?;
            let setup = files.parse(&source.text, &source.path, set)?;
            Ok(Scenario { setup: Arc::new(setup), source: Arc::new(source) })
        };
        border(|| py.detach(open).map_err(|messages| of_messages(py, messages)))
    }
}

#[pymethods]
impl Scenario {
    /// Opens a scenario file and compiles its scripts.
    ///
    /// `set` overrides values of the file, as in {"medium.ir.loss": 0.1}.
    #[staticmethod]
    #[pyo3(signature = (path, set = None))]
    fn load(
        py: Python<'_>,
        path: &Bound<'_, PyAny>,
        set: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let (path, set) = (self::path("path", path)?, settings(set)?);
        Scenario::opened(py, |files| Ok(ScenarioText { text: files.read_text(&path)?, path }), &set)
    }

    /// Parses the text of a scenario and compiles its scripts, which are relative to `folder`.
    #[staticmethod]
    #[pyo3(signature = (text, folder = None, set = None))]
    fn parse(
        py: Python<'_>,
        text: &str,
        folder: Option<&Bound<'_, PyAny>>,
        set: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let folder = folder.map_or(Ok(PathBuf::new()), |folder| path("folder", folder))?;
        let set = settings(set)?;
        let source = ScenarioText { path: folder.join(Path::new(TEXT)), text: text.to_owned() };
        Scenario::opened(py, |_| Ok(source), &set)
    }

    /// Starts a simulation: the world before its first tick.
    ///
    /// `seed` is that of the scenario by default. The result does not depend on `threads`; 0 uses
    /// one per core. `ground` is called once per tick with the places of all ground sensors, shape
    /// (M, 2), float32, in mm, and returns their brightness, shape (M,), 0 (black) to 1 (white).
    /// `pure` declares that its values depend on the places alone.
    #[pyo3(signature = (seed = None, threads = None, *, ground = None, pure = false))]
    fn start(
        &self,
        py: Python<'_>,
        seed: Option<&Bound<'_, PyAny>>,
        threads: Option<&Bound<'_, PyAny>>,
        ground: Option<Bound<'_, PyAny>>,
        pure: bool,
    ) -> PyResult<Simulation> {
        let setup = self.setup.clone();
        let seed = match seed {
            None => setup.scenario.world.seed,
            Some(seed) => integer("seed", seed, 0..=i64::from(u32::MAX))? as u32,
        };
        let threads = threads.map_or(Ok(1), |count| integer("threads", count, 0..=THREADS_MAX))?;
        if let Some(ground) = ground.as_ref().filter(|ground| !ground.is_callable()) {
            let kind = ground.get_type().name()?;
            return Err(PyTypeError::new_err(format!("`ground` must be callable, not a {kind}")));
        }
        border(|| {
            let run = py.detach(|| Run::new(setup, seed, threads.unsigned_abs() as usize));
            let mut run = run.map_err(|error| of_scenario(py, &[error]))?;
            let ground = ground.map(|callback| {
                let failure = Arc::new(Mutex::new(None));
                run.set_ground(PythonGround::new(callback.unbind(), failure.clone()));
                Ground { failure, is_pure: pure }
            });
            Ok(Simulation::new(State::new(run, ground).of_scenario(self.source.clone())))
        })
    }

    /// Opens the page of `bbz sim --view` in a notebook, with a run of its own.
    ///
    /// It needs anywidget: `pip install "bittybuzz[notebook]"`. `height` is in pixels.
    #[pyo3(signature = (seed = None, height = 640))]
    fn view<'py>(
        &self,
        py: Python<'py>,
        seed: Option<&Bound<'_, PyAny>>,
        height: u32,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.start(py, seed, None, None, false)?.view(py, height)
    }

    /// The seed of the scenario.
    #[getter]
    fn seed(&self) -> u32 {
        self.setup.scenario.world.seed
    }

    /// The duration of a run in seconds.
    #[getter]
    fn duration(&self) -> f64 {
        self.setup.scenario.world.duration
    }

    /// The number of robots, absent ones included.
    #[getter]
    fn robot_count(&self) -> usize {
        self.setup.scenario.robot_count()
    }

    fn __repr__(&self) -> String {
        format!("<Scenario of {} robots, {} s>", self.robot_count(), self.duration())
    }
}
