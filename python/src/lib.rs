//! The Python module `bittybuzz`: the compiler and the simulator for programs and notebooks.
//!
//! # Purpose
//! Researchers run scenarios, read and write the robots' state as NumPy arrays, and take measures
//! that a scenario file cannot express. `docs/python.md` is the guide, and `bittybuzz/__init__.pyi`
//! declares the types, shapes and units.
//!
//! # Principles
//! 1. **The same run**: digests and recordings are those of `bbz sim`, bit for bit. The module only
//!    calls the arena; a change of a run is a command, as in a page.
//! 2. **Python goes on**: the interpreter's lock is released while a world runs, and no call waits
//!    for another thread. A simulation in use raises `Busy`.
//! 3. **Mistakes are exceptions** with file, line, column and help. A panic, which is a defect of
//!    this project, becomes the exception `Defect` (`error::border`).
//! 4. **NumPy on request**: it is imported when the first array is asked for.
//!
//! # Cost
//! The library is one shared object for all versions of CPython from 3.10 on, with the tool `bbz` and
//! its page in it (`python -m bittybuzz`). The crate is no default member of the workspace, so that all others build without Python.
//!
//! # What it will not do
//! Run robots in emulators other than by the tool, and write files other than recordings and pictures.

mod arguments;
mod arrays;
mod diagnostic;
mod error;
mod expectation;
mod ground;
mod history;
mod host;
mod live_session;
mod log_line;
mod picture;
mod recording;
mod run;
mod scenario;
mod script;
mod simulation;
mod snapshot;
mod state;
mod stigmergy;
mod toml_text;
mod tool;

use pyo3::prelude::*;

#[pymodule]
mod _bittybuzz {
    #[pymodule_export]
    use crate::diagnostic::Diagnostic;
    #[pymodule_export]
    use crate::expectation::Expectation;
    #[pymodule_export]
    use crate::live_session::{LiveSession, single_page};
    #[pymodule_export]
    use crate::log_line::LogLine;
    #[pymodule_export]
    use crate::picture::Picture;
    #[pymodule_export]
    use crate::recording::Recording;
    #[pymodule_export]
    use crate::run::run;
    #[pymodule_export]
    use crate::scenario::Scenario;
    #[pymodule_export]
    use crate::script::{Script, check, compile};
    #[pymodule_export]
    use crate::simulation::Simulation;
    #[pymodule_export]
    use crate::snapshot::Snapshot;
    #[pymodule_export]
    use crate::tool::main;
}
