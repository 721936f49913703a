//! Reasons why no figure can be drawn.

use std::path::{Path, PathBuf};

use bittybuzz_arena::output::CURVES_MAX;
use bittybuzz_tables::TableReadError;

use crate::problem::Problem;

/// The similarity from which on a name is suggested, of 0 to 1.
const SIMILARITY_MIN: f64 = 0.8;

/// The most names that a message lists.
const NAMES_MAX: usize = 20;

/// A reason why no figure can be drawn.
#[derive(Debug, thiserror::Error)]
pub enum PlotError {
    /// A folder without a table.
    #[error("`{0}` has no tables")]
    NoTables(PathBuf),
    /// The folder of one table.
    #[error("`{0}` is a single table")]
    SingleTable(PathBuf),
    /// All files of a table are still written.
    #[error("`{0}` has no complete file")]
    Unfinished(PathBuf),
    /// An input that can be read only once.
    #[error("`{0}` is a stream, and a table is read more than once")]
    Stream(PathBuf),
    /// A file of another kind.
    #[error("`{0}` is no table of `bbz sim`")]
    OtherFile(PathBuf),
    /// Options for the runs of a scenario, with tables of runs that have ended.
    #[error("`{0}` has tables already, and `--runs` and `--set` are for a scenario")]
    NoScenario(PathBuf),
    /// A figure of a form that cannot be written.
    #[error("`{0}` would be no SVG")]
    OtherPicture(PathBuf),
    #[error("cannot read `{path}`: {error}")]
    Table { path: PathBuf, error: TableReadError },
    /// The library that reads the file has stopped at its content.
    #[error("cannot read `{0}`: it is damaged")]
    Damaged(PathBuf),
    /// A file that comes from another batch than the others of its table, or is no table of `bbz`.
    #[error("`{path}` has no column `{column}`, which the figure needs")]
    OtherColumns { path: PathBuf, column: String },
    /// A row without time or run.
    #[error("`{path}` has a row without `{column}`")]
    NoKey { path: PathBuf, column: String },
    #[error("`{path}` has no quantity `{name}`")]
    UnknownQuantity { path: PathBuf, name: String, known: Vec<String>, place: OtherPlace },
    #[error("`{path}` has no parameter `{name}`")]
    UnknownParameter { path: PathBuf, name: String, known: Vec<String> },
    /// The table of runs, which has the parameters, is missing.
    #[error("`{0}` has no table of runs, and so no parameters")]
    NoRuns(PathBuf),
    /// Several parameters, none of which was chosen.
    #[error("the runs of `{path}` have {}", counted(.known.len()))]
    ParameterNeeded { path: PathBuf, known: Vec<String> },
    /// A parameter that orders no axis.
    #[error("the values of `{parameter}` are no numbers: `{value}`")]
    NotAnAxis { parameter: String, value: String },
    #[error("`{parameter}` has {count} values, and a figure shows at most {CURVES_MAX} curves")]
    ManyCurves { parameter: String, count: usize },
    #[error("`{quantity}` has no number in `{path}`")]
    NoNumbers { quantity: String, path: PathBuf },
    #[error("`{0}` has more than {ROWS_MAX} rows")]
    ManyRows(PathBuf),
}

fn counted(parameters: usize) -> String {
    match parameters {
        0 => "no parameter".to_owned(),
        count => format!("{count} parameters"),
    }
}

/// The most rows of a table: a quantity takes 800 MB of memory then.
pub const ROWS_MAX: usize = 100_000_000;

/// The place of a quantity that another figure shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OtherPlace {
    Nowhere,
    /// Among the numbers of runs.
    Runs,
    /// Among the quantities over time.
    Time,
}

/// Returns the path of a table's folder without the last name, for messages.
fn parent(path: &Path) -> String {
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    parent.unwrap_or(Path::new(".")).display().to_string()
}

/// Returns a sentence with the name that was probably meant, and the names that can be.
fn names(name: &str, known: &[String]) -> String {
    let scored = known.iter().map(|known| (strsim::jaro_winkler(name, known), known));
    let likely = scored.max_by(|a, b| a.0.total_cmp(&b.0));
    let likely = match likely.filter(|(score, _)| *score > SIMILARITY_MIN) {
        Some((_, likely)) => format!("did you mean `{likely}`? "),
        None => String::new(),
    };
    format!("{likely}it has {}", list(known))
}

/// Returns the first of some names, and the number of the others.
fn list(known: &[String]) -> String {
    let shown: Vec<String> = known.iter().take(NAMES_MAX).map(|name| format!("`{name}`")).collect();
    let mut text = match &shown[..] {
        [] => return "none".to_owned(),
        [one] => return one.clone(),
        [others @ .., last] if known.len() <= NAMES_MAX => {
            return format!("{} and {last}", others.join(", "));
        }
        shown => shown.join(", "),
    };
    text += &format!(" and {} others", known.len() - NAMES_MAX);
    text
}

impl Problem for PlotError {
    fn help(&self) -> Option<String> {
        Some(match self {
            PlotError::NoTables(_) => "name the folder that `bbz sim --data` wrote; while a run goes \
                on, its first tables come after at most a minute"
                .to_owned(),
            PlotError::SingleTable(path) => format!("name the folder of all tables: `{}`", parent(path)),
            PlotError::Unfinished(_) => {
                "wait until the command that writes it has ended; after at most a minute it completes \
                 the first file"
                    .to_owned()
            }
            PlotError::Stream(_) => "write it to a file first".to_owned(),
            PlotError::OtherFile(path) => match path.extension().and_then(|end| end.to_str()) {
                Some("bbr") => "convert the recording by `bbz export`".to_owned(),
                Some("parquet") => "name the folder that `bbz sim --data` wrote".to_owned(),
                _ => "name a folder or file of `--data`, or a file of `--csv`".to_owned(),
            },
            PlotError::NoScenario(_) => "leave them out, or name the scenario".to_owned(),
            PlotError::OtherPicture(path) => format!(
                "name `{}`; browsers, Inkscape and LaTeX's package svg convert it",
                path.with_extension("svg").display()
            ),
            PlotError::Table { error, .. } => match error {
                TableReadError::Compression { .. } => {
                    "write it with compression=\"snappy\", which pandas and polars have".to_owned()
                }
                TableReadError::Column(_) | TableReadError::Text { .. } => {
                    "name a quantity with numbers".to_owned()
                }
                TableReadError::Cut => "wait until the command that writes it has ended; if it has, \
                    simulate again"
                    .to_owned(),
                TableReadError::LongText { .. } => "choose another parameter".to_owned(),
                TableReadError::Input(_) => return None,
                _ => "simulate again with `bbz sim`".to_owned(),
            },
            PlotError::Damaged(_) | PlotError::NoKey { .. } => {
                "simulate again with `bbz sim`".to_owned()
            }
            PlotError::OtherColumns { .. } => {
                "name a folder with the tables of one run or batch".to_owned()
            }
            PlotError::UnknownQuantity { name, known, place, .. } => match place {
                OtherPlace::Runs => {
                    "it is a number of each run: draw it against a parameter with --x PARAMETER".to_owned()
                }
                OtherPlace::Time => "it is a quantity over time: leave out --x".to_owned(),
                OtherPlace::Nowhere => format!(
                    "{}; `quantities` in [output.data] of the scenario chooses those over time",
                    names(name, known)
                ),
            },
            PlotError::UnknownParameter { name, known, .. } => names(name, known),
            PlotError::NoRuns(_) => "name a folder of `bbz sim --data`, whose last table has the \
                runs, or a file of `--csv`"
                .to_owned(),
            PlotError::ParameterNeeded { known, .. } if known.is_empty() => {
                "vary one with `--set KEY=V1,V2` or [sweep], or choose --x seed".to_owned()
            }
            PlotError::ParameterNeeded { known, .. } => {
                format!("choose one with --x, and another with --by if needed: {}", list(known))
            }
            PlotError::NotAnAxis { parameter, .. } => {
                format!("--by {parameter} draws a curve for each")
            }
            PlotError::ManyCurves { parameter, .. } if ["run", "robot"].contains(&parameter.as_str()) => {
                "leave out --by: median and quartiles show all of them".to_owned()
            }
            PlotError::ManyCurves { parameter, .. } => {
                format!("draw a number of runs with --x {parameter}, or simulate fewer values")
            }
            PlotError::NoNumbers { .. } => "name a quantity with numbers".to_owned(),
            PlotError::ManyRows(_) => {
                "simulate again with a larger `every` in [output.data], or fewer runs".to_owned()
            }
        })
    }
}
