//! Grading: the scripts of hand-ins run again in the scenario of the teacher.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bittybuzz_arena::output::csv_line;
use bittybuzz_arena::run::{Setup, Simulation};
use bittybuzz_compiler::image::without_script_hash;
use bittybuzz_compiler::include::{LIBRARY_FOLDER, normal};
use serde::Serialize;

use crate::compiler_message::CompilerMessage;
use crate::hand_in::{ExpectationVerdict, HandIn, TextFile};
use crate::scenario_files::text_of;
use crate::set_up::set_up;
use crate::workshop::Workshop;

/// The most errors of a hand-in that are listed.
const ERRORS_MAX: usize = 5;

/// The scenario of the teacher, and the files that belong to it.
pub struct Assignment<'a> {
    workshop: &'a dyn Workshop,
    text: &'a str,
    /// The scripts of the scenario and the files that they include.
    files: BTreeSet<PathBuf>,
}

impl<'a> Assignment<'a> {
    /// Compiles the scenario with the scripts of the teacher.
    ///
    /// # Errors
    /// The mistakes of the scenario and its scripts, a line or two for each.
    pub fn new(workshop: &'a dyn Workshop, text: &'a str) -> Result<Self, String> {
        let setup = set_up(workshop, text, &[], &[]).map_err(|errors| text_of(&errors))?;
        let mut files: BTreeSet<PathBuf> = sources(&setup).collect();
        files.extend(setup.scenario.scripts().map(|(_, script)| normal(script)));
        Ok(Assignment { workshop, text, files })
    }

    /// Returns the scripts of the scenario and the files that they include.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        self.files.iter().map(PathBuf::as_path)
    }

    /// Compiles the scripts of a hand-in. `content` is the text of its file.
    ///
    /// # Errors
    /// A sentence for people: the file is no hand-in, was changed, has a script that the assignment
    /// does not have, or two for one; its scripts do not compile, or include a file that does not belong
    /// to the assignment.
    pub fn prepare(&self, content: &str) -> Result<Prepared, String> {
        let handed_in = HandIn::read(content)
            .map_err(|error| format!("it is no result of an assignment: {error}"))?;
        if handed_in.scripts.is_empty() {
            return Err("it has no script".to_owned());
        }
        let changed = handed_in.scripts.iter().find(|script| !script.is_whole());
        if let Some(TextFile { name, .. }) = changed {
            return Err(format!("its script `{name}` was changed after it was handed in"));
        }
        let scenario = self.workshop.scenario();
        let folder = scenario.parent().expect("a path of a file that was read has a name");
        let path = |script: &TextFile| folder.join(&script.name);
        // Of two spellings of one file one would run, and people may read the other.
        let mut paths = BTreeSet::new();
        let again = handed_in.scripts.iter().find(|script| !paths.insert(normal(&path(script))));
        if let Some(TextFile { name, .. }) = again {
            return Err(format!("it has the script `{name}` twice"));
        }
        let scripts: Vec<(PathBuf, String)> =
            handed_in.scripts.iter().map(|script| (path(script), script.text.clone())).collect();
        let setup =
            set_up(self.workshop, self.text, &[], &scripts).map_err(|errors| first(&errors))?;
        let own: Vec<&Path> = setup.scenario.scripts().map(|(_, script)| script).collect();
        if let Some((other, _)) = scripts.iter().find(|(path, _)| !own.contains(&path.as_path())) {
            return Err(format!("no robot of the assignment has the script `{}`", other.display()));
        }
        if let Some(file) = sources(&setup).find(|file| !self.may_include(file)) {
            let shown = file.display();
            return Err(format!("it includes `{shown}`, which is no part of the assignment"));
        }
        Ok(Prepared { handed_in, text: self.text.to_owned(), setup: Arc::new(setup) })
    }

    /// Returns true if a script may include a file: one of the assignment, of the library, or of the
    /// folders that the teacher has named. A hand-in that includes a solution or another hand-in is no
    /// work of its own.
    fn may_include(&self, file: &Path) -> bool {
        let folders = self.workshop.include_folders();
        self.files.contains(file)
            || file.starts_with(LIBRARY_FOLDER)
            || folders.iter().any(|folder| file.starts_with(normal(folder)))
    }
}

/// Returns the normal paths of the files from which programs were compiled.
fn sources(setup: &Setup) -> impl Iterator<Item = PathBuf> {
    let files = setup.programs().flat_map(|program| program.sources.files());
    files.map(|(_, source)| normal(&source.path))
}

/// Returns the first errors as text, and the number of the others.
fn first(errors: &[CompilerMessage]) -> String {
    let listed = errors.len().min(ERRORS_MAX);
    let text = text_of(&errors[..listed]);
    match errors.len() - listed {
        0 => text,
        more => format!("{text}and {more} more\n"),
    }
}

/// A hand-in whose scripts were compiled.
pub struct Prepared {
    handed_in: HandIn,
    /// The scenario of the teacher.
    text: String,
    setup: Arc<Setup>,
}

impl Prepared {
    /// Returns the scenario with the programs of the hand-in.
    pub fn setup(&self) -> &Arc<Setup> {
        &self.setup
    }

    /// Runs the scripts to the end of the scenario.
    ///
    /// # Errors
    /// The reason why the run cannot go on.
    pub fn run(self) -> Result<Graded, String> {
        let seed = self.setup.scenario.world.seed;
        let run = Simulation::new(self.setup.clone(), seed, 0);
        let mut run = run.map_err(|error| error.to_string())?;
        while !run.is_over() {
            run.tick().map_err(|error| error.to_string())?;
            run.take_log();
        }
        Ok(self.result(&mut run))
    }

    /// Returns the result of a run of [`setup`](Self::setup) with the seed of the scenario, which has
    /// ended.
    pub fn result(&self, run: &mut Simulation) -> Graded {
        let mut here = self.handed_in.clone();
        here.complete(run);
        let lines = |text: &str| text.lines().map(str::to_owned).collect::<Vec<String>>();
        let differs = if lines(&self.handed_in.scenario.text) != lines(&self.text) {
            Some("it was handed in with another scenario".to_owned())
        } else if self.handed_in.digest != here.digest {
            let by = &self.handed_in.bittybuzz;
            let version = (by != env!("CARGO_PKG_VERSION")).then(|| format!(", by version {by}"));
            let version = version.unwrap_or_default();
            Some(format!("it went another way where it was handed in{version}"))
        } else {
            None
        };
        let images =
            self.setup.programs().map(|program| without_script_hash(program.image.to_vec()));
        Graded { here, differs, images: images.collect() }
    }
}

/// The result of a hand-in that ran.
pub struct Graded {
    /// The hand-in, with the results of this run.
    here: HandIn,
    /// The reason why the results differ from those of the file, if they do.
    differs: Option<String>,
    /// The programs of all groups, which are equal if scripts differ in comments and spaces alone.
    images: Vec<Vec<u8>>,
}

/// The mark of a hand-in.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Mark {
    /// The name of the file.
    pub file: String,
    /// True if its scripts ran.
    pub runs: bool,
    /// The reason why the scripts do not run, or why the results differ from those of the file.
    pub reason: Option<String>,
    /// The results; `None` if the scripts do not run.
    pub ran: Option<RanMark>,
}

/// The mark of a hand-in whose scripts ran.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct RanMark {
    /// The name of the person who handed it in.
    pub by: String,
    /// True if every expectation held, and no script had an unexpected fault.
    pub success: bool,
    /// The expectations, in the order of the scenario.
    pub expectations: Vec<ExpectationVerdict>,
    /// The digest at the end of the run, in hexadecimal.
    pub digest: String,
    /// True if the results are those of the file.
    pub as_handed_in: bool,
    /// The other files whose scripts are compiled to the same programs.
    pub same_scripts: Vec<String>,
}

impl RanMark {
    /// Returns the number of expectations that held.
    pub fn held(&self) -> usize {
        self.expectations.iter().filter(|one| one.held).count()
    }
}

/// The results of hand-ins, by the names of their files.
#[derive(Default)]
pub struct Results(Vec<(String, Result<Graded, String>)>);

impl Results {
    /// Adds the result of a file, or the reason why it does not run.
    pub fn add(&mut self, file: String, result: Result<Graded, String>) {
        self.0.push((file, result));
    }

    /// Returns the marks, in the order in which results were added.
    pub fn marks(&self) -> Vec<Mark> {
        let mark = |(file, result): &(String, Result<Graded, String>)| match result {
            Err(reason) => {
                let (file, reason) = (file.clone(), Some(reason.clone()));
                Mark { file, runs: false, reason, ran: None }
            }
            Ok(graded) => {
                let Graded { here, differs, .. } = graded;
                let ran = RanMark {
                    by: here.by.clone(),
                    success: here.success,
                    expectations: here.expectations.clone(),
                    digest: here.digest.clone(),
                    as_handed_in: differs.is_none(),
                    same_scripts: self.doubles(file, &graded.images),
                };
                Mark { file: file.clone(), runs: true, reason: differs.clone(), ran: Some(ran) }
            }
        };
        self.0.iter().map(mark).collect()
    }

    /// Returns the other files with these programs.
    fn doubles(&self, file: &str, images: &[Vec<u8>]) -> Vec<String> {
        let is_double = |(other, result): &&(String, Result<Graded, String>)| {
            other != file && result.as_ref().is_ok_and(|graded| graded.images == images)
        };
        self.0.iter().filter(is_double).map(|(other, _)| other.clone()).collect()
    }
}

/// Returns the table of marks as CSV (RFC 4180), with a line for each file and a column for each
/// expectation.
pub fn marks_csv(marks: &[Mark]) -> String {
    let ran = || marks.iter().find_map(|mark| mark.ran.as_ref());
    let expectations = ran().map_or(&[][..], |ran| &ran.expectations);
    let titles = expectations.iter().map(|one| text_cell(one.name.as_ref().unwrap_or(&one.text)));
    let start = ["file", "by", "runs", "success", "held", "expectations"].map(str::to_owned);
    let end = ["digest", "as_handed_in", "same_scripts", "reason"].map(str::to_owned);
    let mut csv = csv_line(start.into_iter().chain(titles).chain(end));
    for Mark { file, runs, reason, ran } in marks {
        let reason = text_cell(reason.as_deref().unwrap_or_default().trim_end());
        let file = text_cell(file);
        let cells = match ran {
            None => {
                let start = [file, String::new(), runs.to_string()];
                let empty = vec![String::new(); 6 + expectations.len()];
                start.into_iter().chain(empty).chain([reason]).collect::<Vec<_>>()
            }
            Some(ran) => {
                let (held, count) = (ran.held().to_string(), ran.expectations.len().to_string());
                let success = ran.success.to_string();
                let start = [file, text_cell(&ran.by), runs.to_string(), success, held, count];
                let verdicts = ran.expectations.iter().map(|one| one.held.to_string());
                let same = text_cell(&ran.same_scripts.join("; "));
                let end = [ran.digest.clone(), ran.as_handed_in.to_string(), same, reason];
                start.into_iter().chain(verdicts).chain(end).collect()
            }
        };
        csv += &csv_line(cells.into_iter());
    }
    csv
}

/// Returns a text of others as a cell that no spreadsheet takes for a formula.
fn text_cell(text: &str) -> String {
    let text = text.replace(['\t', '\r', '\n'], " ");
    match text.starts_with(['=', '+', '-', '@']) {
        true => format!("'{text}"),
        false => text,
    }
}
