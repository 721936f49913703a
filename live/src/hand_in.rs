//! The result of an assignment: a file that a page writes and that `bbz grade` runs again.

use std::path::PathBuf;

use bittybuzz_arena::run::{Simulation, TICKS_PER_SECOND, Verdict};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// Characters of a name that a file name may have.
const LONGEST_NAME: usize = 40;

/// A text, and the path that the scenario has for it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TextFile {
    /// The path from the folder of the scenario.
    pub name: String,
    /// SHA-256 of the text in hexadecimal, as `sha256sum` prints it.
    pub sha256: String,
    /// The text.
    pub text: String,
}

impl TextFile {
    /// A text with its hash.
    pub fn new(name: String, text: String) -> Self {
        TextFile { name, sha256: sha256(&text), text }
    }

    /// Returns true if the hash is that of the text.
    pub fn is_whole(&self) -> bool {
        self.sha256 == sha256(&self.text)
    }
}

fn sha256(text: &str) -> String {
    Sha256::digest(text).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The verdict on an expectation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// The expectation in words.
    pub text: String,
    /// It held.
    pub held: bool,
    /// The second from which on it was true for good.
    pub since: Option<f64>,
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
    /// The scenario.
    pub scenario: TextFile,
    /// The scripts that were edited.
    pub scripts: Vec<TextFile>,
    /// The seed of the run.
    pub seed: u32,
    /// Its length in seconds.
    pub seconds: f64,
    /// The digest of its end in hexadecimal.
    pub digest: String,
    /// Every expectation held, and no script had an error that none expects.
    pub success: bool,
    /// The expectations, in the order of the scenario.
    pub expectations: Vec<Outcome>,
}

impl HandIn {
    /// Scripts that have not run.
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

    /// Reads a file. An error is a reason for people.
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
            .map(|(expect, convergence)| Outcome {
                text: expect.to_string(),
                held: convergence.verdict == Verdict::Held,
                since: convergence.since.map(seconds),
            })
            .collect();
    }

    /// The text of the file.
    pub fn text(&self) -> String {
        // A structure of texts and numbers is always written.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// A name for the file, of letters that every file system has.
    pub fn file_name(&self) -> PathBuf {
        let letters = |text: &str| -> String {
            let known = |c: char| if c.is_alphanumeric() { c } else { '-' };
            let text: String = text.trim().chars().take(LONGEST_NAME).map(known).collect();
            text.trim_matches('-').to_lowercase()
        };
        let name = [letters(&self.assignment), letters(&self.by)].join("-");
        match name.trim_matches('-') {
            "" => "result.json".into(),
            name => format!("{name}.json").into(),
        }
    }
}

/// Ticks as seconds.
pub fn seconds(ticks: u64) -> f64 {
    ticks as f64 / TICKS_PER_SECOND
}
