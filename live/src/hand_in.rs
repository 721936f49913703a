//! The result of an assignment: a file that a page writes and that `bbz grade` verifies by running
//! it again.

use std::path::PathBuf;

use bittybuzz_arena::run::{Simulation, TICKS_PER_SECOND, Verdict};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// The number of characters of a name that a file name keeps.
const NAME_CHARACTERS_MAX: usize = 40;

/// A text, and the path by which the scenario refers to it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TextFile {
    /// The path relative to the folder of the scenario.
    pub name: String,
    /// SHA-256 of the text in hexadecimal, as `sha256sum` prints it.
    pub sha256: String,
    pub text: String,
}

impl TextFile {
    /// Returns a text with its hash.
    pub fn new(name: String, text: String) -> Self {
        TextFile { name, sha256: sha256(&text), text }
    }

    /// Returns true if the hash matches the text.
    pub fn is_whole(&self) -> bool {
        self.sha256 == sha256(&self.text)
    }
}

/// Returns the SHA-256 of a text or of bytes in hexadecimal, as `sha256sum` prints it.
pub fn sha256(content: impl AsRef<[u8]>) -> String {
    Sha256::digest(content).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The result of an expectation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ExpectationVerdict {
    /// The name of the expectation, if it has one.
    pub name: Option<String>,
    /// The expectation in words.
    pub text: String,
    /// True if the expectation held.
    pub held: bool,
    /// The time in seconds since which its condition was true until the end; `None` if it was false
    /// at the end.
    pub since: Option<f64>,
    /// The time in seconds at which it was decided that the expectation held; `None` if it failed.
    pub held_at: Option<f64>,
}

/// Scripts that are handed in, and the results of their run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HandIn {
    /// The version of BittyBuzz that ran them.
    pub bittybuzz: String,
    /// The name of the person who hands them in.
    pub by: String,
    /// The title of the assignment.
    pub assignment: String,
    pub scenario: TextFile,
    /// The scripts that were edited.
    pub scripts: Vec<TextFile>,
    /// The seed of the run.
    pub seed: u32,
    /// The length of the run in seconds.
    pub seconds: f64,
    /// The digest at the end of the run, in hexadecimal.
    pub digest: String,
    /// True if every expectation held, and no script had an unexpected fault.
    pub success: bool,
    /// The expectations, in the order of the scenario.
    pub expectations: Vec<ExpectationVerdict>,
}

impl HandIn {
    /// Returns a hand-in without results.
    pub fn new(by: String, assignment: String, scenario: TextFile, scripts: Vec<TextFile>) -> Self {
        let bittybuzz = env!("CARGO_PKG_VERSION").to_owned();
        let (digest, expectations) = (String::new(), Vec::new());
        HandIn {
            bittybuzz,
            by,
            assignment,
            scenario,
            scripts,
            seed: 0,
            seconds: 0.0,
            digest,
            success: false,
            expectations,
        }
    }

    /// Parses the text of a file. An error is a text for users.
    pub fn read(text: &str) -> Result<Self, String> {
        serde_json::from_str(text).map_err(|error| error.to_string())
    }

    /// Adds the results of a run.
    pub fn complete(&mut self, run: &mut Simulation) {
        let summary = run.summary();
        self.seed = run.seed();
        self.seconds = seconds(run.now());
        self.digest = format!("{:016x}", run.digest());
        self.success = summary.is_success();
        let expects = run.setup().scenario.expects.iter().zip(&summary.convergences);
        self.expectations = expects
            .map(|(expect, convergence)| ExpectationVerdict {
                name: expect.name.clone(),
                text: expect.to_string(),
                held: convergence.verdict == Verdict::Held,
                since: convergence.since.map(seconds),
                held_at: convergence.held_at.map(seconds),
            })
            .collect();
    }

    /// Returns the text of the file.
    pub fn text(&self) -> String {
        let text = serde_json::to_string_pretty(self);
        text.expect("strings, numbers and lists have a form in JSON") + "\n"
    }

    /// Returns a name for the file, with only letters, digits and `-` from the names in it.
    pub fn file_name(&self) -> PathBuf {
        let letters = |text: &str| -> String {
            let known = |c: char| if c.is_alphanumeric() { c } else { '-' };
            let text: String = text.trim().chars().take(NAME_CHARACTERS_MAX).map(known).collect();
            text.trim_matches('-').to_ascii_lowercase()
        };
        let name = [letters(&self.assignment), letters(&self.by)].join("-");
        match name.trim_matches('-') {
            "" => "result.json".into(),
            name => format!("{name}.json").into(),
        }
    }
}

/// Converts ticks to seconds.
pub fn seconds(ticks: u64) -> f64 {
    ticks as f64 / TICKS_PER_SECOND
}
