//! Best of two after Valentini, Ferrante, Hamann, Dorigo (JAAMAS 30:553-580, 2016). Only abstracts are known here, so only the
//! directions are compared.

use std::fmt::Write;
use std::sync::Arc;

use super::check;
use crate::script::{folder, read};
use bittybuzz_arena::run::{Setup, Simulation};

const SCRIPT: &str = include_str!("../../../examples/study/best_of_n.bzz");

const SEEDS: u32 = 10;
const SECONDS: u64 = 900;

/// Runs that end with most robots for the better option, runs that agree, and the median time in s until they do, where a run
/// that does not counts as longer than all others.
#[derive(Clone, Copy, Debug)]
struct Outcome {
    better: f64,
    agreed: f64,
    median: Option<f64>,
}

fn run(rule: u32, group: u32, quality: u32) -> Outcome {
    let folder = folder("opinions", &[("best_of_n.bzz", SCRIPT)]);
    let event = |global: &str, number: u32| {
        format!("[[event]]\nat = 0\nset = \"all\"\nglobal = \"{global}\"\nnumber = {number}\n")
    };
    let text = format!(
        "[world]\nsize = [700, 700]\nduration = {SECONDS}\n[[robots]]\nrobot = \"kilobot\"\nscript = \"best_of_n.bzz\"\n\
         count = 100\n[output]\nplot = [\"global.opinion\"]\n{}{}{}",
        event("RULE", rule),
        event("GROUP", group),
        event("QB", quality)
    );
    let (scenario, programs) = read(&folder, &text);
    let setup = Arc::new(Setup::new(scenario, programs).unwrap());
    let (mut better, mut times) = (0, Vec::new());
    for seed in 1..=SEEDS {
        let mut simulation = Simulation::new(setup.clone(), seed, 2).unwrap();
        let opinions = |simulation: &Simulation| -> f64 {
            let probe = &simulation.setup().plots()[0];
            simulation.numbers(probe).into_iter().flatten().sum()
        };
        while !simulation.is_over() {
            simulation.tick().unwrap();
            let for_a = opinions(&simulation);
            if simulation.now() > 10 && (for_a == 0.0 || for_a == 100.0) {
                times.push(simulation.now() as f64 / 10.0);
                break;
            }
        }
        better += u32::from(opinions(&simulation) > 50.0);
    }
    times.sort_by(f64::total_cmp);
    let share = |count: u32| f64::from(count) / f64::from(SEEDS);
    Outcome {
        better: share(better),
        agreed: share(times.len() as u32),
        median: times.get(SEEDS as usize / 2).copied(),
    }
}

#[test]
#[ignore = "takes ten minutes"]
fn majority_is_faster_and_less_accurate_than_the_voter() {
    let mut table =
        "| rule | neighbors asked | quality of B | majority for A | agree | median time, s |\n\
                     |---|---|---|---|---|---|\n"
            .to_owned();
    for quality in [70, 90] {
        let [voters, majorities] = [(0, "voter"), (1, "majority")].map(|(rule, name)| {
            [3, 9].map(|group| {
                let outcome = run(rule, group, quality);
                let median = outcome
                    .median
                    .map_or(format!("over {SECONDS}"), |seconds| format!("{seconds:.0}"));
                writeln!(
                    table,
                    "| {name} | {group} | 0.{} | {:.2} | {:.0} % | {median} |",
                    quality / 10,
                    outcome.better,
                    100.0 * outcome.agreed
                )
                .unwrap();
                outcome
            })
        });
        for (voter, majority) in voters.iter().zip(&majorities) {
            let time = |outcome: &Outcome| outcome.median.unwrap_or(f64::INFINITY);
            assert!(time(majority) < time(voter), "{table}");
            assert!(majority.agreed >= voter.agreed, "{table}");
            assert!(majority.better <= voter.better, "{table}");
        }
    }
    check("opinions", &table);
}
