//! The scripts, their results, and their cost in the reference: bench/reference.toml.

use crate::error::BenchError;
use crate::target::BenchTarget;
use anyhow::Result;
use bittybuzz_builds::shell::root;
use bittybuzz_robot_spec::NumberProfile;
use fs_err as fs;
use serde::Deserialize;

const FILE: &str = "bench/reference.toml";

/// The whole file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Catalogue {
    #[serde(rename = "script")]
    pub scripts: Vec<BenchScript>,
}

/// A benchmark script.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BenchScript {
    pub name: String,
    /// The global `r` after the third step: an integer or a float.
    pub result: serde_json::Number,
    /// True if the script only runs in the profile `full`.
    #[serde(default)]
    full: bool,
    host: Option<u64>,
    avr: Option<u64>,
    thumbv6m: Option<u64>,
    thumbv7em: Option<u64>,
}

impl Catalogue {
    pub fn load() -> Result<Catalogue> {
        let path = root().join(FILE);
        let text = fs::read_to_string(&path)?;
        toml::from_str(&text).map_err(|error| {
            BenchError::Table { path: FILE.into(), reason: error.to_string() }.into()
        })
    }
}

impl BenchScript {
    /// Returns true if the script runs in the profile of the target.
    pub fn is_for(&self, target: BenchTarget) -> bool {
        !self.full || target.profile() == NumberProfile::Full
    }

    /// Returns the cost in the reference, which has no profiles.
    pub fn reference(&self, target: BenchTarget) -> Option<u64> {
        match target {
            BenchTarget::Host => self.host,
            BenchTarget::Avr => self.avr,
            BenchTarget::Thumbv6m | BenchTarget::Thumbv6mFull => self.thumbv6m,
            BenchTarget::Thumbv7em | BenchTarget::Thumbv7emFull => self.thumbv7em,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_script_is_there() {
        let catalogue = Catalogue::load().unwrap();
        for script in &catalogue.scripts {
            let path = format!("bench/scripts/{}.bzz", script.name);
            assert!(root().join(&path).is_file(), "{path}");
        }
        let folder = fs::read_dir(root().join("bench/scripts")).unwrap();
        assert_eq!(folder.count(), catalogue.scripts.len());
    }
}
