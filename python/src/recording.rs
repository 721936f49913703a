//! Recordings of runs, as `bbz sim --record` writes them.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bittybuzz_arena::output::recorder;
use bittybuzz_arena::output::recording::RecordingWriter;
use bittybuzz_arena::run::{Simulation as Run, TICKS_PER_SECOND};
use pyo3::prelude::*;
use tempfile::{Builder, TempPath};

use crate::simulation::Simulation;

/// A recording that is written under a temporary name, and gets its name when it is complete.
pub struct Recorder {
    writer: RecordingWriter<BufWriter<File>>,
    aside: TempPath,
    path: PathBuf,
    /// Ticks between two samples.
    every: u64,
    /// The identity of the recording, for its handle.
    token: Arc<()>,
}

impl Recorder {
    /// Begins a recording at the current tick, with the interval of the scenario.
    pub fn new(path: &Path, run: &Run) -> PyResult<Self> {
        let failed = |error| unwritable(path, &error);
        if path.is_dir() {
            return Err(failed(io::ErrorKind::IsADirectory.into()));
        }
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let mut builder = Builder::new();
        builder.prefix(".recording");
        // A temporary file is readable by its owner alone, unlike other files that programs write.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let file = builder.tempfile_in(folder.unwrap_or(Path::new(".")));
        // The error names the temporary file, of which users know nothing.
        let file = file.map_err(|error| failed(error.kind().into()))?;
        let (file, aside) = file.into_parts();
        let writer = RecordingWriter::new(BufWriter::new(file), &recorder::header(run));
        let writer = writer.map_err(failed)?;
        let every = (run.setup().scenario.output.every * TICKS_PER_SECOND).round() as u64;
        let (path, every) = (path.to_owned(), every.max(1));
        let mut recorder = Recorder { writer, aside, path, every, token: Arc::new(()) };
        recorder.sample(run)?;
        Ok(recorder)
    }

    /// Takes a sample, if one is due.
    pub fn sample(&mut self, run: &Run) -> PyResult<()> {
        if !run.now().is_multiple_of(self.every) {
            return Ok(());
        }
        let (robots, movables) = (recorder::robots(run), recorder::movables(run));
        let written = self.writer.write(run.now(), &robots, &movables);
        written.map_err(|error| unwritable(&self.path, &error))
    }

    /// Completes the recording and gives it its name.
    fn finish(self) -> PyResult<()> {
        let Recorder { writer, aside, path, .. } = self;
        let finished = writer.finish().and_then(|file| {
            file.into_inner().map_err(|error| error.into_error())?.sync_all()?;
            Ok(aside.persist(&path)?)
        });
        finished.map_err(|error| unwritable(&path, &error))
    }
}

/// Returns the exception for a failure, which is a subclass of `OSError` for its kind.
pub fn unwritable(path: &Path, error: &io::Error) -> PyErr {
    let text = format!("cannot write `{}`: {error}", path.display());
    io::Error::new(error.kind(), text).into()
}

/// A recording in progress. It is a context manager, which closes itself.
#[pyclass(frozen, module = "bittybuzz")]
pub struct Recording {
    simulation: Py<Simulation>,
    token: Arc<()>,
}

impl Recording {
    pub fn new(simulation: Py<Simulation>, recorder: &Recorder) -> Self {
        Recording { simulation, token: recorder.token.clone() }
    }
}

#[pymethods]
impl Recording {
    /// Completes the file. A recording that was closed stays as it is.
    fn close(&self) -> PyResult<()> {
        self.simulation.get().with(|state| {
            let is_own = |recorder: &mut Recorder| Arc::ptr_eq(&recorder.token, &self.token);
            state.recorder.take_if(is_own).map_or(Ok(()), Recorder::finish)
        })
    }

    fn __enter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    #[pyo3(signature = (*_exception))]
    fn __exit__(&self, _exception: &Bound<'_, PyAny>) -> PyResult<()> {
        self.close()
    }
}
