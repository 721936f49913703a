//! Zooids on their firmware: a hundred runs of the consensus at a loss of one half, and thirty of one scenario with both
//! backends.

use crate::Verdict;
use crate::simulator::Build;
use crate::sources::clear_table;
use anyhow::Result;
use bittybuzz_builds::board::ZOOIDS;
use bittybuzz_builds::cargo_test::image_tests;
use bittybuzz_builds::shell::{Invocation, target};
use fs_err as fs;

const CONSENSUS: &str = "examples/zooids/consensus.toml";
const SEEDS: std::ops::Range<u32> = 1..101;
/// Seeds of one item.
const BLOCK: u32 = 10;
/// The simulated seconds. The scenario allows a minute, but an agreement does not change any more, so
/// a run that agrees earlier need not go on.
const SECONDS: &str = "15";

/// The item that compares the backends.
const BACKENDS: &str = "both backends, 30 seeds";

pub fn items() -> Vec<String> {
    let blocks = SEEDS.step_by(BLOCK as usize);
    let blocks = blocks.map(|start| format!("consensus {start}..{}", start + BLOCK));
    blocks.chain([BACKENDS.to_owned()]).collect()
}

pub fn run(item: &str) -> Result<Verdict> {
    if item == BACKENDS {
        return backends();
    }
    let first = item.strip_prefix("consensus ").and_then(|seeds| seeds.split_once(".."));
    match first {
        Some((first, _)) => consensus(first),
        None => Ok(Verdict::Missing("there is no such item".to_owned())),
    }
}

/// A block of seeds, from the first on.
fn consensus(first: &str) -> Result<Verdict> {
    let firmware = ZOOIDS.build(None, false)?;
    let bbz = Build::Optimized.simulator()?;
    let csv = target()?.join("soak/zooids").join(format!("{first}.csv"));
    clear_table(&csv)?;
    let (runs, table) = (BLOCK.to_string(), csv.display().to_string());
    let firmware = format!("robots.0.firmware={}", firmware.display());
    let (duration, at) = (format!("world.duration={SECONDS}"), format!("expect.0.at={SECONDS}"));
    let set = ["robots.0.backend=firmware", &firmware, &duration, &at];
    let set = set.map(|set| ["--set", set]).concat();
    let seeds = ["--seed", first, "--runs", &runs, "--csv", &table];
    let arguments = [&["sim", CONSENSUS, "--headless"], &set[..], &seeds].concat();
    // The status is 1 if a run could not go on, which the table reports as well.
    Invocation::named("bbz", &bbz, &arguments)
        .output_if(|output| matches!(output.status.code(), Some(0 | 1)))?;
    Ok(match agreed_since(&fs::read_to_string(&csv)?) {
        Some(times) => Verdict::Shown(describe(times)),
        None => Verdict::Missing(format!("not all robots agree within {SECONDS} s")),
    })
}

/// Returns the time in seconds since which all robots agree, for each run of a table that `bbz sim
/// --csv` writes; `None` if some run failed or is missing.
fn agreed_since(csv: &str) -> Option<Vec<f64>> {
    let mut lines = csv.lines();
    let names: Vec<&str> = lines.next()?.split(',').collect();
    let success = names.iter().position(|name| *name == "success")?;
    let since = names.iter().position(|name| name.starts_with("since."))?;
    let times = lines.map(|line| {
        let fields: Vec<&str> = line.split(',').collect();
        let agreed = *fields.get(success)? == "1";
        fields.get(since).filter(|_| agreed)?.parse().ok()
    });
    let times: Vec<f64> = times.collect::<Option<_>>()?;
    (times.len() == BLOCK as usize).then_some(times)
}

fn describe(mut times: Vec<f64>) -> String {
    times.sort_by(f64::total_cmp);
    let (middle, last) = (times.get(times.len() / 2), times.last());
    let [median, longest] = [middle, last].map(|time| time.copied().unwrap_or_default());
    format!("median {median:.1} s, longest {longest:.1} s")
}

fn backends() -> Result<Verdict> {
    let firmware = ZOOIDS.build(None, false)?;
    let line = image_tests(&["backends::", "--ignored", "--nocapture"])?;
    let line = line.env("BITTYBUZZ_ZOOIDS", &firmware.display().to_string());
    let output = line.output_if(|output| output.status.code().is_some())?;
    let printed = String::from_utf8_lossy(&output.stdout);
    // The line that the test prints itself.
    let evidence = printed.lines().find_map(|line| Some(&line[line.find("ends: median")?..]));
    Ok(match evidence {
        Some(evidence) if output.status.success() => Verdict::Shown(evidence.to_owned()),
        _ => Verdict::Missing(printed.into_owned()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_seed_is_in_one_block() {
        let items = items();
        assert_eq!(items.len(), 11);
        assert_eq!(items.first().map(String::as_str), Some("consensus 1..11"));
        assert_eq!(items.get(9).map(String::as_str), Some("consensus 91..101"));
    }

    #[test]
    fn a_run_that_failed_or_is_missing_shows_nothing() {
        let head = "seed,success,held.0,first.0,since.0,mean led\n";
        let run = |success: u8, since: &str| format!("1,{success},{success},1.5,{since},1\n");
        let good = run(1, "2.5");
        let times = agreed_since(&(head.to_owned() + &good.repeat(10))).unwrap();
        assert_eq!(describe(times), "median 2.5 s, longest 2.5 s");
        for last in ["".to_owned(), run(0, ""), run(1, "")] {
            assert_eq!(agreed_since(&(head.to_owned() + &good.repeat(9) + &last)), None);
        }
        assert_eq!(agreed_since(""), None);
    }
}
