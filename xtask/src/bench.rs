//! What a step of each benchmark script costs on each target, beside the C BittyBuzz and beside what it cost before.
//!
//! The rules of counting stand in bench/README.md. Nothing here depends on the time of day or the load of the computer:
//! every number is counted by an emulator.

mod avr;
mod catalogue;
mod cortex_m;
mod costs;
mod error;
mod figures;
mod host;
mod images;
mod marks;
mod program;
mod report;
mod target;

pub use error::BenchError;

use crate::failure::Failure;
use catalogue::Catalogue;
use figures::{Counts, Figure};
use images::Compiled;
use program::Program;
use target::Target;

/// The programs' own workspaces.
pub const WORKSPACES: [&str; 3] = ["bench/host", "bench/avr", "bench/cortex-m"];

/// Calls of `fib` in a step of the script fib10.
const FIB_CALLS: u64 = 177;
/// The rows that are computed from scripts.
const FIB: &str = "fib";
const COLLECTION: &str = "collection";
const NO_COLLECTION: &str = "no_collection";
const VERIFICATION: &str = "verification";

/// What the command line asks for.
#[derive(Debug, Default, PartialEq, Eq)]
struct Wanted {
    /// Not scripts but instructions.
    costs: bool,
    json: bool,
    update: bool,
    target: Option<Target>,
}

/// `bench [costs] [--json] [--update] [TARGET]`
pub fn run(arguments: &[String]) -> Result<(), Failure> {
    let wanted = read(arguments)?;
    if wanted.costs {
        let targets = wanted.target.map_or(costs::TARGETS.to_vec(), |target| vec![target]);
        return costs::run(&targets, wanted.update);
    }
    let targets = wanted.target.map_or(Target::ALL.to_vec(), |target| vec![target]);
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
pub fn check() -> Result<(), Failure> {
    let catalogue = Catalogue::load()?;
    let before = figures::load()?;
    let mut grown = Vec::new();
    for target in Target::ALL {
        let counts = measure(target, &catalogue)?;
        let before = before.get(target.name());
        println!("{}", report::table(target, &catalogue, &counts, before));
        grown.extend(figures::grown(target, &counts, before));
    }
    // Of each instruction on one chip: it takes seconds there, minutes on all.
    grown.extend(costs::check(Target::Avr)?);
    if grown.is_empty() { Ok(()) } else { Err(Failure::Bench(BenchError::Grown(grown))) }
}

fn read(arguments: &[String]) -> Result<Wanted, Failure> {
    let mut wanted = Wanted::default();
    for argument in arguments {
        match (argument.as_str(), Target::find(argument)) {
            ("costs", _) => wanted.costs = true,
            ("--json", _) => wanted.json = true,
            ("--update", _) => wanted.update = true,
            (_, Some(target)) if wanted.target.is_none() => wanted.target = Some(target),
            _ => {
                let names = Target::ALL.map(Target::name).join(", ");
                let message = format!("`bench` cannot use `{argument}`; TARGET is one of {names}");
                return Err(Failure::Usage(message));
            }
        }
    }
    let on_host = wanted.target == Some(Target::Host);
    if wanted.costs && (wanted.json || on_host) {
        let message = "`bench costs` takes `--update` and a chip's target".to_owned();
        return Err(Failure::Usage(message));
    }
    Ok(wanted)
}

/// Every script that the target's machine can run.
fn measure(target: Target, catalogue: &Catalogue) -> Result<figures::Scripts, Failure> {
    eprintln!("bench: {}", target.name());
    let program = Program::build(target)?;
    let mut counts = figures::Scripts::new();
    let mut verification = None;
    for script in catalogue.scripts.iter().filter(|script| script.is_for(target)) {
        let compiled = Compiled::script(&script.name, target.profile())?;
        let told = program.run(&compiled)?;
        let result = told.result(target, script).map_err(Failure::Bench)?;
        if script.name == VERIFICATION {
            // The last partial byte of a count means nothing.
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

    fn wanted(line: &str) -> Result<Wanted, Failure> {
        let arguments: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
        read(&arguments)
    }

    #[test]
    fn arguments_in_any_order() {
        let avr = Wanted { json: true, target: Some(Target::Avr), ..Wanted::default() };
        assert_eq!(wanted("--json avr").unwrap(), avr);
        assert_eq!(wanted("avr --json").unwrap(), avr);
        assert_eq!(wanted("").unwrap(), Wanted::default());
        let costs = Wanted { costs: true, update: true, ..Wanted::default() };
        assert_eq!(wanted("costs --update").unwrap(), costs);
        for line in ["avr host", "arm", "--jason", "costs --json", "costs host"] {
            assert!(matches!(wanted(line), Err(Failure::Usage(_))), "{line}");
        }
    }

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
