//! The tests of the page in browsers, which take ten minutes. A file that is committed has the day on which all
//! passed and a fingerprint of what they test, so that CI runs all of them only after a change.

use crate::Verdict;
use crate::sources::Sources;
use anyhow::{Context, Result};
use bittybuzz_builds::page_tests::{PageTests, page_tests};
use bittybuzz_builds::shell::{Invocation, root};
use fs_err as fs;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The file, from the root.
pub const FILE: &str = "tests/soak/page.toml";

const HEAD: &str = "\
# The last run of all tests of the page, and a fingerprint of what they test. `cargo xtask soak page` writes this file.
";

/// The only item.
const BROWSERS: &str = "browsers";

/// Path prefixes of the files that only the page uses: its own, what it serves, its lessons, and its tests. A
/// change of the simulator below it is tested by the sample.
const PAGE: &[&str] = &[
    "bbz/page/",
    "bbz/src/sim/desk",
    "bbz/src/sim/live",
    "bbz/src/sim/unsaved",
    "bbz/src/sim/view",
    "bbz/src/trace/view",
    "bbz/src/view",
    "docs/lessons/",
    "examples/lessons/",
    "live/src/",
    "playground/",
    "tests/page/",
];

/// Path prefixes of the files that the tests are about.
pub const MADE_OF: &[&str] = &[
    "Cargo",
    "arena/src/",
    "bbz/page/",
    "bbz/src/",
    "compiler/src/",
    "docs/lessons/",
    "examples/",
    "live/src/",
    "playground/",
    "robots/",
    "tests/page/",
    "vm-core/src/",
];

/// A run of all tests.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Run {
    /// The day, as `YYYY-MM-DD`.
    date: String,
    /// The fingerprint of the page, in hexadecimal digits.
    page: String,
}

/// Returns the day on which all tests passed, if the page is as it was then.
pub fn passed_on() -> Result<Option<String>> {
    let run = Run::parse(&fs::read_to_string(root().join(FILE))?)?;
    Ok((run.page == fingerprint()?).then_some(run.date))
}

fn fingerprint() -> Result<String> {
    Ok(format!("{:016x}", Sources::list()?.under(PAGE).fingerprint_with_documents()?))
}

impl Run {
    fn parse(text: &str) -> Result<Run> {
        toml::from_str(text).with_context(|| format!("{FILE} is not as `soak page` writes it"))
    }

    fn text(&self) -> Result<String> {
        Ok(format!("{HEAD}\n{}", toml::to_string(self)?))
    }
}

pub fn items() -> Vec<String> {
    vec![BROWSERS.to_owned()]
}

pub fn run(_: &str) -> Result<Verdict> {
    // A file that changes during the run is another page.
    let page = fingerprint()?;
    let site = Invocation::cargo(&["run", "--quiet", "--package", "xtask", "--", "site"]);
    let printed = String::from_utf8(site.output(0)?.stdout)?;
    // The last lines are the folder of the site and its zip.
    let site = printed.lines().rev().nth(1).context("`xtask site` prints a folder and a file")?;
    let tests = page_tests(Path::new(site), PageTests::All)?;
    let output = tests.output_if(|output| output.status.code().is_some())?;
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    if !output.status.success() {
        return Ok(Verdict::Missing(printed));
    }
    let date = Invocation::new("date", &["+%F"]).unannounced().output(0)?;
    let date = String::from_utf8(date.stdout)?.trim().to_owned();
    fs::write(root().join(FILE), Run { date, page }.text()?)?;
    Ok(Verdict::Shown(printed.lines().last().context("pytest prints a line")?.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_is_read() {
        let text = fs::read_to_string(root().join(FILE)).unwrap();
        assert_eq!(Run::parse(&text).unwrap().text().unwrap(), text);
        passed_on().unwrap();
    }

    #[test]
    fn the_page_is_a_part_of_what_its_tests_are_about() {
        let all = Sources::list().unwrap();
        let about = all.under(MADE_OF).fingerprint_with_documents().unwrap();
        let both = [MADE_OF, PAGE].concat();
        assert_eq!(all.under(&both).fingerprint_with_documents().unwrap(), about);
    }
}
