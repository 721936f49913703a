//! The plan of a sweep.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// Everything that decides the rows, except the settings and the seed of each run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// The version of the program, with a hash of its sources.
    pub program: String,
    /// A hash of the scenario without its comments and without the list of points, which the plan has.
    pub scenario: String,
    /// Other options that decide the rows, by their names.
    pub options: BTreeMap<String, String>,
    /// Names of the metrics of a row.
    pub metrics: Vec<String>,
}

/// A key of the scenario that has several values.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    pub key: String,
    /// The name of its column.
    pub column: String,
}

/// The random numbers of different points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Chance {
    /// All points have the same seeds.
    Common,
    /// Each point has seeds of its own.
    Independent,
}

/// The most runs of a plan.
pub const RUNS_MAX: u32 = 1_000_000;

/// The runs of a sweep. Run `point * replicates + replicate` is that replicate of that point.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    pub experiment: Experiment,
    /// The path of the scenario from the folder of the plan, with `/` between its parts.
    pub scenario: String,
    /// Folders that are searched for included files, as the scenario's path.
    pub include: Vec<String>,
    /// SHA-256 of all files that the runs read, by their paths from the scenario's folder.
    pub files: BTreeMap<String, String>,
    /// The seed of the first replicate, if it is not the scenario's.
    pub seed: Option<u32>,
    /// The seed of the scenario.
    pub world_seed: u32,
    pub chance: Chance,
    /// Runs of each point.
    pub replicates: u32,
    /// Runs of a chunk, at least 1.
    pub chunk: u32,
    pub parameters: Vec<Parameter>,
    /// The points, each with a value of every parameter, as `--set` takes it.
    pub points: Vec<Vec<String>>,
}

impl Experiment {
    /// Returns the names of all that another experiment has otherwise.
    pub fn differences(&self, other: &Experiment) -> Vec<String> {
        let pairs = [
            ("the scenario", self.scenario == other.scenario),
            ("the metrics", self.metrics == other.metrics),
        ];
        let names =
            pairs.into_iter().filter(|(_, is_same)| !is_same).map(|(name, _)| name.to_owned());
        names.chain(different(&self.options, &other.options)).collect()
    }
}

/// Returns the keys whose values differ, or that only one of two maps has.
fn different(one: &BTreeMap<String, String>, other: &BTreeMap<String, String>) -> Vec<String> {
    let keys: BTreeSet<&String> = one.keys().chain(other.keys()).collect();
    keys.into_iter().filter(|key| one.get(*key) != other.get(*key)).cloned().collect()
}

impl Plan {
    /// Returns the number of runs.
    pub fn runs(&self) -> usize {
        self.points.len() * self.replicates as usize
    }

    /// Returns the number of chunks.
    pub fn chunks(&self) -> usize {
        self.runs().div_ceil(self.chunk as usize)
    }

    /// Returns the runs of a chunk, which must be one of the plan's.
    pub fn runs_of(&self, chunk: usize) -> Range<usize> {
        let size = self.chunk as usize;
        chunk * size..self.runs().min((chunk + 1) * size)
    }

    /// Returns the name of the plan: a hash of all that decides the rows of each chunk.
    pub fn id(&self) -> String {
        let text = serde_json::to_string(self).expect("strings and numbers are valid JSON");
        hash(text.as_bytes())[..16].to_owned()
    }

    /// Returns the plan as the text of its file.
    pub(crate) fn to_text(&self) -> String {
        let text = serde_json::to_string_pretty(self).expect("strings and numbers are valid JSON");
        text + "\n"
    }

    /// Parses the text of a file. Returns the mistake if it is not a plan.
    pub(crate) fn parse(bytes: &[u8]) -> Result<Plan, String> {
        let plan: Plan = serde_json::from_slice(bytes).map_err(|error| error.to_string())?;
        let has_all = |point: &Vec<String>| point.len() == plan.parameters.len();
        match plan {
            Plan { chunk: 0, .. } => Err("`chunk` is 0".to_owned()),
            Plan { replicates: 0, .. } => Err("`replicates` is 0".to_owned()),
            Plan { ref experiment, .. } if experiment.metrics.is_empty() => {
                Err("there are no metrics".to_owned())
            }
            Plan { ref points, .. } if points.is_empty() => Err("there are no points".to_owned()),
            Plan { ref points, .. } if !points.iter().all(has_all) => {
                Err("a point does not have a value of each parameter".to_owned())
            }
            plan if plan.runs() > RUNS_MAX as usize => {
                Err(format!("it has more than {RUNS_MAX} runs"))
            }
            plan => Ok(plan),
        }
    }
}

/// Returns the SHA-256 of some bytes, in hexadecimal.
pub(crate) fn hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}
