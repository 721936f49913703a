//! Conformance scripts and generated programs on every chip.

use crate::Verdict;
use anyhow::Result;
use bittybuzz_builds::on_chip::TARGETS;

/// Generated programs of each target. One in a hundred is too long for the AVR, where 10,000 run as well.
const SEEDS: std::ops::Range<u64> = 0..11_000;
/// Seeds of one run.
const BLOCK: u64 = 1000;
/// In place of seeds.
const CONFORMANCE: &str = "conformance";

pub fn items() -> Vec<String> {
    let blocks = SEEDS.step_by(BLOCK as usize).map(|start| format!("{start}..{}", start + BLOCK));
    let what: Vec<String> = [CONFORMANCE.to_owned()].into_iter().chain(blocks).collect();
    let of = |name: &'static str| what.iter().map(move |what| format!("{name} {what}"));
    TARGETS.iter().flat_map(|target| of(target.name)).collect()
}

pub fn run(item: &str) -> Result<Verdict> {
    let found = item
        .split_once(' ')
        .and_then(|(name, what)| Some((TARGETS.iter().find(|target| target.name == name)?, what)));
    let Some((target, what)) = found else {
        return Ok(Verdict::Missing("there is no such target".to_owned()));
    };
    Ok(match target.compare((what != CONFORMANCE).then_some(what)) {
        Ok(evidence) => Verdict::Shown(evidence),
        Err(failure) => Verdict::Missing(failure.to_string()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_target_has_every_seed() {
        let items = items();
        for name in ["avr", "avr-qemu", "thumbv7em-full"] {
            let own: Vec<&str> = items.iter().filter_map(|i| i.strip_prefix(name)).collect();
            let own: Vec<&str> = own.iter().filter_map(|i| i.strip_prefix(' ')).collect();
            assert_eq!(own[..3], [CONFORMANCE, "0..1000", "1000..2000"]);
            assert_eq!(own.last(), Some(&"10000..11000"));
        }
    }
}
