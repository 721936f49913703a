//! Mistakes that tests have found, kept between runs.

use super::TESTS;
use crate::Record;
use crate::sources::Sources;
use anyhow::Result;

/// Mistakes that were found, with the fingerprints of their files. A mistake counts
/// as found until its file or a test changes.
pub struct Found {
    sources: Sources,
    record: Record,
}

impl Found {
    pub fn open(group: &str) -> Result<Found> {
        let sources = Sources::list()?;
        let tests = sources.under(TESTS).fingerprint()?;
        Ok(Found { record: Record::open(&format!("protocol/found/{group}"), tests)?, sources })
    }

    /// The key of a mistake as its file is today.
    fn key(&self, name: &str) -> Result<String> {
        let file = name.split(':').next().unwrap_or_default();
        Ok(format!("{:016x} {name}", self.sources.under(&[file]).fingerprint()?))
    }

    pub fn evidence(&self, name: &str) -> Result<Option<&str>> {
        Ok(self.record.shown.get(&self.key(name)?).map(String::as_str))
    }

    pub fn keep(&mut self, name: &str, evidence: &str) -> Result<()> {
        self.record.keep(&self.key(name)?, evidence)
    }
}
