//! The tests, and the steps that CI runs.

use crate::python;
use crate::site;
use crate::sizes;
use crate::vendor;
use anyhow::Result;
use bittybuzz_bench_harness as bench;
use bittybuzz_builds::board::{BOARDS, CRAZYFLIE, KILOBOT, ZOOIDS};
use bittybuzz_builds::cargo_test::{
    BOOK, CHECK, FEATURES, FIGURES, SKIP_SLOW, all_but_emulators, all_tests, cargo_test, emulators,
    guides, shared_packages,
};
use bittybuzz_builds::page_tests::{PageTests, page_tests};
use bittybuzz_builds::shell::{Invocation, at_once, cargo, keep_lock_files};
use bittybuzz_builds::test_programs::Variables;
use bittybuzz_builds::{chip, on_chip, setup, test_programs};
use bittybuzz_guides::Runs;
use bittybuzz_soak as soak;
use clap::ValueEnum;
use fs_err as fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Minutes that `test` takes the first time, on two cores.
const MINUTES: u32 = 21;

/// Seeds of the random programs that are tested for every change.
const SEEDS: &str = "0..100";

/// Runs the tests on this computer, and those of the robots' firmware on the faster emulated
/// processor, but for the longest.
pub fn test() -> Result<()> {
    println!(
        "The tests take {MINUTES} minutes on two cores the first time, with all that is built."
    );
    let settings = [("BITTYBUZZ_SEEDS", SEEDS), (FIGURES, CHECK)];
    let packages = shared_packages();
    test_programs::run(&packages, &SKIP_SLOW, &settings, setup::run, build_images)?;
    let skipped = SKIP_SLOW.iter().filter(|word| **word != "--skip");
    let skipped: Vec<&str> = skipped.copied().collect();
    println!("left out: {}, which `cargo xtask ci tests` runs", skipped.join(", "));
    Ok(())
}

/// Builds the robots' images from the current sources. Returns the variables that pass them to the
/// tests.
fn build_images() -> Result<Variables> {
    let text = |path: PathBuf| path.display().to_string();
    Ok(vec![
        ("BITTYBUZZ_CRAZYFLIE", text(CRAZYFLIE.build(None, false)?)),
        ("BITTYBUZZ_CRAZYFLIE_TINY", text(CRAZYFLIE.build_tiny(None)?)),
        ("BITTYBUZZ_ZOOIDS", text(ZOOIDS.build(None, false)?)),
        ("BITTYBUZZ_BEHAVIORS", text(KILOBOT.build_behaviors(false)?)),
        ("BITTYBUZZ_KILOBOT", text(KILOBOT.build(None, false)?)),
    ])
}

/// A part of the checks that a change must pass before it is merged, in the order of a whole run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Step {
    /// Lock files, spelling, format and lints of every workspace
    Lint,
    /// Documentation of every crate, in which no link leads nowhere
    Doc,
    /// The book of docs/: its links, scripts, commands and generated tables
    Book,
    /// Flash and RAM of each image against its budget and its record; nothing in the virtual machine panics
    Sizes,
    /// Cycles and instructions of the benchmark scripts against the baseline
    Bench,
    /// Programs with equal results on every emulated chip and on this computer
    OnChip,
    /// The emulators' own tests, optimized as they are used
    Emulators,
    /// All other tests, with the images of all robots
    Tests,
    /// Guides whose files have changed since their recorded run, in a copy of the repository
    Guides,
    /// Scenarios in the WebAssembly module with the same results as natively
    Wasm,
    /// The page of `bbz sim --view` and the playground in a browser
    Page,
    /// The Python module: its wheel in a Python of its own, tests, types, and the code of its guide
    Python,
    /// Samples of the long tests
    Soak,
}

/// Runs everything that must pass before a change is merged, or one step of it.
pub fn ci(step: Option<Step>) -> Result<()> {
    keep_lock_files();
    match step {
        Some(step) => {
            setup::run()?;
            step.run()
        }
        None => all_steps(),
    }
}

/// Runs all steps. Steps that keep one processor busy have others next to them: images are linked and
/// emulators count while the tests are compiled and the emulators tested, and the sample of the long tests
/// and the module of Python are next to the browsers. The lints of host programs need no package, and run
/// while packages come from the network and next to the other lints. The tests include the comparison with
/// WebAssembly, for which the step `wasm` would run the worlds once more.
fn all_steps() -> Result<()> {
    let start = Instant::now();
    at_once(lint_host, || {
        setup::run()?;
        lint_others()
    })?;
    Step::Lint.report(start);
    let run = |steps: &[Step]| steps.iter().try_for_each(|step| step.run());
    run(Step::between(Step::Doc, Step::Sizes))?;
    let compile = || {
        test_programs::compile(&shared_packages())?;
        let module = site::module()?;
        run(&[Step::Emulators])?;
        Ok(module)
    };
    let ((), module) = at_once(|| run(Step::between(Step::Sizes, Step::Emulators)), compile)?;
    let tests = Instant::now();
    all_other_tests(Some(&module))?;
    Step::Tests.report(tests);
    Step::Wasm.report(tests);
    run(&[Step::Guides])?;
    // The samples build images where the tests find those of the robots, and so are last. The module of Python
    // follows whatever ends sooner: a sample of the page's tests, or else the samples of the long ones.
    let (browsers, others): (&[Step], &[Step]) = match soak::page_passed_on()? {
        Some(_) => (&[Step::Page, Step::Python], &[Step::Soak]),
        None => (&[Step::Page], &[Step::Soak, Step::Python]),
    };
    at_once(|| run(browsers), || run(others))?;
    Ok(())
}

impl Step {
    /// Returns the steps from one to before another, in their order.
    fn between(first: Step, end: Step) -> &'static [Step] {
        &Step::value_variants()[first as usize..end as usize]
    }

    fn run(self) -> Result<()> {
        let start = Instant::now();
        match self {
            Step::Lint => lint()?,
            Step::Doc => document()?,
            Step::Book => cargo_test(&["--package", BOOK, "--package", FEATURES]).run()?,
            Step::Sizes => sizes::check_record()?,
            Step::Bench => bench::check()?,
            Step::OnChip => on_chip::sample()?,
            Step::Emulators => {
                // The emulated processor is compiled once for the lints, these tests and the later
                // steps.
                cargo(&[&["test", "--release"], &emulators()[..]].concat())?;
            }
            Step::Tests => all_other_tests(None)?,
            Step::Guides => carry_out_guides()?,
            Step::Wasm => wasm()?,
            Step::Page => page()?,
            Step::Python => python::check()?,
            Step::Soak => Step::sample()?,
        }
        self.report(start);
        Ok(())
    }

    /// Runs the samples of the long tests.
    fn sample() -> Result<()> {
        soak::sample_mistakes()?;
        soak::sample_runs()
    }

    fn report(self, start: Instant) {
        println!("ci {self:?}: passed after {} s", start.elapsed().as_secs());
    }
}

/// Returns the folders of all workspaces, from the root.
fn workspaces() -> impl Iterator<Item = &'static str> {
    let boards = BOARDS.map(|board| board.folder);
    ["", bench::HOST].into_iter().chain(chip::WORKSPACES).chain(boards)
}

/// Carries out the guides whose files have changed. The robots' images are built only if there are
/// any: that takes longer than all other tests of the guides.
fn carry_out_guides() -> Result<()> {
    let runs = Runs::load()?;
    let due = runs.due()?;
    println!(
        "guides whose files have changed: {}",
        if due.is_empty() { "none".to_owned() } else { due.join(", ") }
    );
    let images = if due.is_empty() { Variables::new() } else { build_images()? };
    let tests = guides("changed", &[]);
    images.iter().fold(tests, |tests, (name, path)| tests.env(name, path)).run()
}

/// The variable that names the module of the playground for the test that compares its runs in node with
/// native ones.
const MODULE: &str = "BITTYBUZZ_PLAYGROUND";

/// Runs the tests of all packages that share a build, with the images of all robots. With a module of
/// the playground, its runs are compared with native ones.
fn all_other_tests(module: Option<&Path>) -> Result<()> {
    let module = module.map(|path| path.display().to_string());
    let module = module.as_deref().map(|path| (MODULE, path));
    let settings: Vec<_> = [(FIGURES, CHECK)].into_iter().chain(module).collect();
    let variables = || {
        let cflib = setup::cflib()?.display().to_string();
        Ok([build_images()?, vec![("BITTYBUZZ_CFLIB", cflib)]].concat())
    };
    test_programs::run(&shared_packages(), &[], &settings, || Ok(()), variables)
}

/// Builds the module of the playground and compares its runs in node with native ones.
fn wasm() -> Result<()> {
    let module = site::module()?;
    all_tests(&["--test", "everywhere"], &[]).env(MODULE, &module.display().to_string()).run()
}

/// Tests the page of `bbz sim --view` and the playground in a headless browser. After a run of `soak page` that has
/// passed, a sample of the tests runs until the page changes.
fn page() -> Result<()> {
    vendor::check()?;
    let tests = match soak::page_passed_on()? {
        Some(day) => {
            println!("the page is as it was when all its tests passed, {day}: a sample of them");
            PageTests::Sample
        }
        None => PageTests::Usual,
    };
    page_tests(&site::build()?, tests)?.run()
}

/// Fails if a lock file does not match its manifests.
fn locks() -> Result<()> {
    for folder in workspaces() {
        let arguments = ["metadata", "--locked", "--format-version", "1"];
        Invocation::new("cargo", &arguments).in_workspace(folder).output(0)?;
    }
    Ok(())
}

/// Builds the documentation of all crates. That of firmware includes private items, because
/// firmware has no others.
fn document() -> Result<()> {
    const MACHINE: &str = "bittybuzz-vm-core";
    let strict = |line: Invocation| line.env("RUSTDOCFLAGS", "-D warnings");
    // Profiles, targets and wrapper are those of the lints, which have checked all crates already. The
    // features of tests are among them only if examples are documented, too.
    let targets = ["doc", "--no-deps", "--lib", "--bins", "--examples"];
    let others = [&targets[..], &["--exclude", MACHINE], &all_but_emulators()].concat();
    as_linted(strict(without_python(Invocation::cargo(&others))))?.run()?;
    let emulated = [&targets[..], &["--release"], &emulators()].concat();
    as_linted(strict(Invocation::cargo(&emulated)))?.run()?;
    // The tables of opcodes describe instructions with brackets that are no links.
    Invocation::cargo(&["doc", "--package", MACHINE, "--no-deps"])
        .env("RUSTDOCFLAGS", "-D warnings -A rustdoc::broken-intra-doc-links")
        .run()?;
    for board in BOARDS {
        let arguments = ["doc", "--release", "--no-deps", "--document-private-items"];
        strict(Invocation::cargo(&arguments)).in_workspace(board.folder).run()?;
    }
    Ok(())
}

/// The variables by which the Python module is checked without a Python, which is not installed yet.
const NO_PYTHON: [(&str, &str); 2] =
    [("PYO3_NO_PYTHON", "1"), ("PYO3_BUILD_EXTENSION_MODULE", "1")];

fn without_python(line: Invocation) -> Invocation {
    NO_PYTHON.iter().fold(line, |line, (name, value)| line.env(name, value))
}

/// The lints of a workspace, in the profile of its tests, which use the same build scripts and macros.
const CLIPPY: [&str; 2] = ["clippy", "--all-targets"];

/// The feature of the fuzz targets, which other builds leave out.
const FUZZ_TARGETS: [&str; 2] = ["--features", "bittybuzz-fuzz/run"];

/// Options of the lints that make every warning an error.
const DENY: [&str; 3] = ["--", "-D", "warnings"];

/// Lets cargo use crates of the workspace as [`CLIPPY`] has checked them: clippy is a wrapper of the
/// compiler, with its options in a variable. With another path or other options cargo checks these
/// crates again, and the result is the same.
fn as_linted(line: Invocation) -> Result<Invocation> {
    let output = Invocation::new("rustup", &["which", "clippy-driver"]).unannounced().output(0)?;
    // Cargo's command follows the links of its own path.
    let driver = fs::canonicalize(String::from_utf8(output.stdout)?.trim_end())?;
    let options = DENY[1..].iter().map(|option| format!("{option}__CLIPPY_HACKERY__"));
    Ok(line
        .env("RUSTC_WORKSPACE_WRAPPER", &driver.display().to_string())
        .env("CLIPPY_ARGS", &options.collect::<String>()))
}

/// Checks lock files, spelling, format and lints of every workspace. The profiles of the two chores differ,
/// so that both run: firmware has long chains of crates, which keep one processor busy.
fn lint() -> Result<()> {
    at_once(lint_host, lint_others)?;
    Ok(())
}

/// Checks lock files, spelling and format, and lints firmware and emulators.
fn lint_others() -> Result<()> {
    locks()?;
    Invocation::named("typos", &setup::typos()?, &[]).run()?;
    cargo(&["fmt", "--all", "--check"])?;
    // With `--all`, these would format the crates of the root once more.
    let boards = BOARDS.map(|board| board.folder);
    for folder in [bench::HOST].into_iter().chain(chip::WORKSPACES).chain(boards) {
        Invocation::cargo(&["fmt", "--check"]).in_workspace(folder).run()?;
    }
    for board in BOARDS {
        let arguments = [&["clippy", "--release"], &DENY[..]].concat();
        Invocation::cargo(&arguments).in_workspace(board.folder).run()?;
    }
    chip::lint(&DENY)?;
    cargo(&[&CLIPPY[..], &["--release"], &emulators(), &DENY].concat())?;
    let all = [&CLIPPY[..], &["--release", "--workspace"], &DENY].concat();
    Invocation::cargo(&all).in_workspace(bench::HOST).run()
}

/// Lints what runs on this computer, but for the emulators.
fn lint_host() -> Result<()> {
    let all = [&CLIPPY[..], &FUZZ_TARGETS, &all_but_emulators(), &DENY].concat();
    // Nothing is linked, so the build script of the fuzz targets need not compile libFuzzer, which takes longer than
    // the lints.
    without_python(Invocation::cargo(&all))
        .env("CUSTOM_LIBFUZZER_PATH", "unused/libfuzzer.a")
        .run()?;
    // Users build the tool alone, so that its crates have only the features that they ask for.
    cargo(&[&["clippy", "--package", "bbz"], &DENY[..]].concat())
}
