//! Runs of a script on this computer.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use bittybuzz_compiler::compile::Compiled;
use bittybuzz_compiler::source::SourceMap;
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_fault::{Backtrace, FaultDescription, FaultReport, KnownProgram};
use bittybuzz_inspect::ScriptMemory;
use bittybuzz_robot_files::all_shipped;
use bittybuzz_robot_spec::{NumberProfile, Robot};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{Entry, Image, Outcome, Sizes, Vm};
use pyo3::prelude::*;

use crate::arguments::{Source, integer, robot};
use crate::diagnostic::{Diagnostic, text_of};
use crate::error::{RunError, border, with_diagnostics};
use crate::host::TextHost;
use crate::script::{compiled, diagnostics, refused};

/// Slots of the machine that stands for every robot: the most that a machine can have.
const SLOTS: usize = 65_520;

/// The capacities for neighbors, stigmergy entries and swarms if no robot is named.
const SIZES_MAX: Sizes = Sizes { neighbors: 255, bearings: true, entries: 100, swarms: 8 };

/// Instructions between two looks at the clock.
const SLICE: u16 = 50_000;

/// Instructions after which an entry counts as endless.
const INSTRUCTIONS_MAX: u32 = 100_000_000;

/// The most bytes of a log: a script that logs in an endless loop would take all memory.
const TEXT_BYTES_MAX: usize = 64 << 20;

/// The longest time between two checks for Ctrl-C.
const CHECK_EVERY: Duration = Duration::from_millis(20);

/// A reason why a run has ended before its last step.
enum Ended {
    /// A run-time error.
    Fault(Box<FaultDescription>),
    /// The global code, `init`, a step or `destroy` did not end by itself.
    Endless(String),
    /// The script has logged too much.
    TooLong,
    /// Ctrl-C, or the exception of another signal.
    Interrupted(PyErr),
    /// The machine refuses the image.
    Refused(String),
}

/// The settings of a run.
struct Settings {
    id: u16,
    seed: u32,
    steps: i64,
    destroy: bool,
    slots: usize,
    sizes: Sizes,
    profile: NumberProfile,
}

/// Runs a script on this computer: the global code, `init()`, and `steps` steps.
///
/// Returns its log, with a line for each call of a robot function, such as `led(3)`. `destroy`
/// calls `destroy()` after the last step. `id` is that of the robot, and `seed` that of its random
/// numbers. A run-time error raises `RunError`, which has the log until then.
#[pyfunction]
#[pyo3(signature = (source, *, robot = None, steps = None, destroy = false, id = None, seed = None, include = Vec::new()))]
#[expect(clippy::too_many_arguments, reason = "these are keywords in Python")]
pub fn run(
    py: Python<'_>,
    source: &Bound<'_, PyAny>,
    robot: Option<&Bound<'_, PyAny>>,
    steps: Option<&Bound<'_, PyAny>>,
    destroy: bool,
    id: Option<&Bound<'_, PyAny>>,
    seed: Option<&Bound<'_, PyAny>>,
    include: Vec<PathBuf>,
) -> PyResult<String> {
    let (source, robot) = (Source::new(source)?, self::robot(robot)?);
    let named = robot.as_ref();
    let settings = Settings {
        id: id.map_or(Ok(1), |id| integer("id", id, 0..=i64::from(u16::MAX)))? as u16,
        seed: seed.map_or(Ok(0), |seed| integer("seed", seed, 0..=i64::from(u32::MAX)))? as u32,
        steps: steps.map_or(Ok(0), |steps| integer("steps", steps, 0..=i64::MAX))?,
        destroy,
        slots: named.map_or(SLOTS, |robot| robot.vm.slots as usize),
        sizes: named.map_or(SIZES_MAX, Robot::sizes),
        profile: named.map_or(NumberProfile::Full, |robot| robot.profile),
    };
    border(|| {
        let robots = robot.clone().map_or_else(all_shipped, |robot| vec![robot]);
        let compiled = py.detach(|| compiled(&source, robot, include));
        let found = diagnostics(&compiled);
        let Compiled { image: Some(image), symbols: Some(symbols), sources, .. } = &compiled else {
            return Err(refused(py, found));
        };
        let mut host = TextHost::new(&robots, symbols);
        let parts = (image.as_slice(), symbols, sources);
        let ended = py.detach(|| match settings.profile {
            NumberProfile::Tiny => drive::<Tiny>(parts, &settings, &mut host, &robots),
            NumberProfile::Full => drive::<Full>(parts, &settings, &mut host, &robots),
        });
        let text = String::from_utf8_lossy(&host.text).into_owned();
        ended.map_or_else(|ended| Err(exception(py, ended, &text)), |()| Ok(text.clone()))
    })
}

/// Returns the exception for a run that has ended early.
fn exception(py: Python<'_>, ended: Ended, log: &str) -> PyErr {
    let diagnostic = |message: String, help: &str| Diagnostic {
        severity: "error",
        code: None,
        message,
        label: None,
        help: (!help.is_empty()).then(|| help.to_owned()),
        file: None,
        line: None,
        column: None,
        end_line: None,
        end_column: None,
    };
    let found = match ended {
        Ended::Interrupted(error) => return error,
        Ended::Endless(message) => {
            diagnostic(message, "a loop needs a condition that becomes false")
        }
        Ended::TooLong => {
            let mega = TEXT_BYTES_MAX >> 20;
            diagnostic(format!("the log has more than {mega} MiB"), "log less")
        }
        Ended::Refused(message) => diagnostic(message, ""),
        Ended::Fault(fault) => of_fault(*fault),
    };
    let error = RunError::new_err(text_of(std::slice::from_ref(&found)));
    let error = with_diagnostics(py, error, vec![found]);
    error.value(py).setattr("log", log).err().unwrap_or(error)
}

fn of_fault(fault: FaultDescription) -> Diagnostic {
    let place = fault.places.into_iter().flatten().next();
    let at = place.as_ref();
    Diagnostic {
        severity: "error",
        code: Some(fault.code),
        message: fault.message,
        label: None,
        help: fault.help,
        file: at.map(|place| place.file.clone()),
        line: at.map(|place| place.line as usize),
        column: at.map(|place| place.column as usize),
        end_line: at.map(|place| place.end_line as usize),
        end_column: at.map(|place| place.end_column as usize),
    }
}

/// Runs a program to its last step, without the interpreter's lock.
fn drive<P: Profile>(
    (image, symbols, sources): (&[u8], &Symbols, &SourceMap),
    settings: &Settings,
    host: &mut TextHost<'_>,
    robots: &[Robot],
) -> Result<(), Ended> {
    let profile = settings.profile;
    let program = KnownProgram { image, profile, symbols: Some(symbols), sources };
    let mut vm: Box<Vm<P, &[u8], SLOTS>> = Box::new(Vm::new());
    vm.set_network_capacity(settings.sizes);
    let has_function = |hash: u16| {
        robots.iter().flat_map(|robot| &robot.functions).any(|function| function.hash() == hash)
    };
    let loaded = vm.load_limited(Image::new(image), settings.slots, has_function);
    loaded.map_err(|cause| {
        Ended::Refused(format!("the script {}", bittybuzz_compiler::refusal::sentence(&cause)))
    })?;
    vm.set_robot_id(settings.id, settings.seed);
    let mut checked = Instant::now();
    let mut call = |vm: &mut Vm<P, &[u8], SLOTS>, entry, name: &dyn Fn() -> String| {
        if !vm.begin(entry) {
            return Ok(false);
        }
        for _ in 0..INSTRUCTIONS_MAX / u32::from(SLICE) {
            let outcome = vm.run(host, SLICE);
            if host.text.len() > TEXT_BYTES_MAX {
                return Err(Ended::TooLong);
            }
            if checked.elapsed() >= CHECK_EVERY {
                Python::attach(|py| py.check_signals()).map_err(Ended::Interrupted)?;
                checked = Instant::now();
            }
            match outcome {
                Outcome::Done => return Ok(true),
                Outcome::Pending | Outcome::Waiting => {}
                Outcome::Fault(fault) => {
                    let backtrace = Backtrace::new(program, vm.calls().collect(), Some(entry));
                    let report = FaultReport::new(&fault, backtrace, host.refusal.as_deref());
                    let memory = ScriptMemory::after(&fault, vm, settings.slots);
                    let report = report.with_memory(memory.as_ref());
                    return Err(Ended::Fault(Box::new(report.description())));
                }
            }
        }
        let millions = INSTRUCTIONS_MAX / 1_000_000;
        Err(Ended::Endless(format!(
            "{} did not end within {millions} million instructions",
            name()
        )))
    };
    call(&mut vm, Entry::Global, &|| "the global code".to_owned())?;
    call(&mut vm, Entry::Init, &|| "`init()`".to_owned())?;
    for step in 1..=settings.steps {
        // A script without a step has nothing to do in any number of steps.
        if !call(&mut vm, Entry::Step, &|| format!("step {step}"))? {
            break;
        }
    }
    if settings.destroy {
        call(&mut vm, Entry::Destroy, &|| "`destroy()`".to_owned())?;
    }
    Ok(())
}
