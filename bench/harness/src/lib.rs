//! Measures the cost of a step of each benchmark script on each target, and compares it with the C
//! BittyBuzz and with its earlier cost.
//!
//! bench/README.md has the rules of counting. No figure depends on the time of day or the load of
//! the computer: an emulator counts every figure.

mod avr;
mod catalogue;
mod cortex_m;
mod costs;
mod error;
mod figures;
mod flight;
mod host;
mod images;
mod marks;
mod program;
mod readers;
mod report;
mod slices;
mod target;
mod watch;

use anyhow::{Result, ensure};
use catalogue::Catalogue;
use error::BenchError;
use figures::{Counts, Figure};
use images::CompiledScript;
use program::LinkedProgram;
use target::BenchTarget;

pub use program::HOST;

/// Calls of `fib` in a step of the script fib10.
const FIB_CALLS: u64 = 177;
/// The rows that are computed from scripts.
const FIB: &str = "fib";
const COLLECTION: &str = "collection";
const NO_COLLECTION: &str = "no_collection";
const VERIFICATION: &str = "verification";

/// Options of `bench`.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct BenchArguments {
    #[command(subcommand)]
    subject: Option<Subject>,
    /// Prints an object for each target
    #[arg(long)]
    json: bool,
    /// Makes the counts the baseline
    #[arg(long)]
    update: bool,
    /// Only this one
    target: Option<BenchTarget>,
}

/// A subject other than the scripts.
#[derive(Debug, clap::Subcommand)]
enum Subject {
    /// Counts each instruction instead of scripts
    Costs {
        /// Makes the counts the baseline
        #[arg(long)]
        update: bool,
        /// Only this chip
        target: Option<BenchTarget>,
    },
    /// Counts the flight controller on a Cortex-M4F instead of scripts
    Flight {
        /// Makes the counts the baseline
        #[arg(long)]
        update: bool,
    },
    /// Counts a tick that a page watches, next to one that nothing observes
    Watch,
    /// Counts the work of readers of files, for inputs of two lengths
    Readers,
    /// Measures the longest slices of scripts on the robots' images, and other figures, in emulation
    Slices {
        /// Records the figures of today in `bench/hil.json`
        #[arg(long)]
        update: bool,
    },
}

/// Measures, and prints the counts next to the baseline and the C BittyBuzz.
pub fn run(wanted: &BenchArguments) -> Result<()> {
    match wanted.subject {
        Some(Subject::Costs { update, target }) => {
            ensure!(
                target != Some(BenchTarget::Host),
                "`bench costs` counts on chips, not on this computer"
            );
            let targets = target.map_or(costs::TARGETS.to_vec(), |target| vec![target]);
            return costs::run(&targets, update);
        }
        Some(Subject::Flight { update }) => return flight::run(update),
        Some(Subject::Watch) => return watch::run(),
        Some(Subject::Readers) => return readers::run(),
        Some(Subject::Slices { update }) => return slices::run(update),
        None => {}
    }
    let targets = wanted.target.map_or(BenchTarget::ALL.to_vec(), |target| vec![target]);
    let catalogue = Catalogue::load()?;
    let before = figures::load()?;
    let mut all = Counts::new();
    for target in targets {
        let counts = measure(target, &catalogue)?;
        if !wanted.json {
            println!("{}", report::table(target, &catalogue, &counts, before.get(target.name())));
        }
        all.insert(target.name().to_owned(), counts);
    }
    if wanted.json {
        println!("{}", figures::to_json(&all));
    }
    if wanted.update {
        figures::save(before.into_iter().chain(all).collect())?;
    }
    Ok(())
}

/// Measures everything; fails if anything costs more than the committed baseline allows.
pub fn check() -> Result<()> {
    let catalogue = Catalogue::load()?;
    let before = figures::load()?;
    let mut grown = Vec::new();
    for target in BenchTarget::ALL {
        let counts = measure(target, &catalogue)?;
        let before = before.get(target.name());
        println!("{}", report::table(target, &catalogue, &counts, before));
        grown.extend(figures::grown(target, &counts, before));
    }
    // Instructions are checked on only one chip: that takes seconds, on all chips it takes minutes.
    grown.extend(costs::check(BenchTarget::Avr)?);
    grown.extend(flight::check()?);
    grown.extend(watch::check()?);
    grown.extend(readers::check()?);
    if grown.is_empty() { Ok(()) } else { Err(BenchError::Grown(grown).into()) }
}

/// Measures every script that the target's machine can run.
fn measure(target: BenchTarget, catalogue: &Catalogue) -> Result<figures::Scripts> {
    eprintln!("bench: {}", target.name());
    let program = LinkedProgram::build(target)?;
    let mut counts = figures::Scripts::new();
    let mut verification = None;
    for script in catalogue.scripts.iter().filter(|script| script.is_for(target)) {
        let compiled = CompiledScript::script(&script.name, target.profile())?;
        let told = program.run(&compiled)?;
        let result = told.result(target, script)?;
        if script.name == VERIFICATION {
            // The division discards a fraction, which is not significant.
            verification = Some(told.load() * 1024 / compiled.image.len() as u64);
        }
        counts.insert(script.name.clone(), Figure { count: told.step(), result });
    }
    derive(&mut counts, verification);
    Ok(counts)
}

/// Adds the rows that are computed from scripts.
fn derive(counts: &mut figures::Scripts, verification: Option<u64>) {
    if let Some(fib10) = counts.get("fib10") {
        let fib = Figure { count: fib10.count / FIB_CALLS, ..fib10.clone() };
        counts.insert(FIB.to_owned(), fib);
    }
    if let (Some(without), Some(with)) = (counts.remove(NO_COLLECTION), counts.get_mut(COLLECTION))
    {
        with.count = with.count.saturating_sub(without.count);
    }
    if let (Some(count), Some(row)) = (verification, counts.get_mut(VERIFICATION)) {
        row.count = count;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_computed_from_scripts() {
        let figure = |count| Figure { count, result: 1.into() };
        let rows = [("fib10", 1770), (COLLECTION, 900), (NO_COLLECTION, 200), (VERIFICATION, 1)];
        let rows = rows.map(|(name, count)| (name.to_owned(), figure(count)));
        let mut counts = figures::Scripts::from(rows);
        derive(&mut counts, Some(77));
        let count = |name| counts.get(name).map(|figure: &Figure| figure.count);
        assert_eq!(count(FIB), Some(10));
        assert_eq!(count(COLLECTION), Some(700));
        assert_eq!(count(VERIFICATION), Some(77));
        assert_eq!(count(NO_COLLECTION), None);
    }
}
