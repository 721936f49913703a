//! A sweep of one parameter, whose results are a function of the run.

use std::collections::BTreeMap;

use bittybuzz_chunks::{Chance, Experiment, Outcome, Parameter, Plan, RunKey};

pub fn experiment() -> Experiment {
    Experiment {
        program: "1.0 abc".to_owned(),
        scenario: "5ce0".to_owned(),
        options: BTreeMap::new(),
        metrics: ["success", "time"].map(str::to_owned).to_vec(),
    }
}

/// A plan of so many points with so many replicates each.
pub fn plan(points: usize, replicates: u32, chunk: u32) -> Plan {
    Plan {
        experiment: experiment(),
        scenario: "../s.toml".to_owned(),
        include: Vec::new(),
        files: BTreeMap::from([("s.bzz".to_owned(), "f11e".to_owned())]),
        seed: None,
        world_seed: 1,
        chance: Chance::Common,
        replicates,
        chunk,
        parameters: vec![Parameter { key: "a".to_owned(), column: "a".to_owned() }],
        points: (0..points).map(|point| vec![point.to_string()]).collect(),
    }
}

/// A number of a run that does not depend on the plan.
pub fn identity(replicates: u32, run: usize) -> usize {
    let replicates = replicates as usize;
    run / replicates * 1000 + run % replicates
}

/// The number of a run in a plan; that of a replicate that the plan does not have is too large.
pub fn number(replicates: u32, identity: usize) -> usize {
    let (point, replicate, replicates) = (identity / 1000, identity % 1000, replicates as usize);
    if replicate < replicates { point * replicates + replicate } else { usize::MAX }
}

pub fn key(replicates: u32, run: usize) -> RunKey {
    let identity = identity(replicates, run);
    RunKey::new(vec![format!("a={}", identity / 1000)], 1 + (identity % 1000) as u32)
}

pub fn outcome(replicates: u32, run: usize) -> Outcome {
    let identity = identity(replicates, run);
    match identity % 5 {
        4 => Outcome::Failed(format!("no room, \"really\"\n{identity}")),
        rest => Outcome::Complete {
            metrics: vec![Some(1.0 / (1 + identity) as f64), (rest > 0).then_some(f64::NAN)],
            digest: 0xd165_7000_0000_0000 | identity as u64,
        },
    }
}
