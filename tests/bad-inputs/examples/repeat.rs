//! Runs some inputs of a kind, or of all: `cargo run --locked -p bittybuzz-bad-inputs --example
//! repeat -- target/debug/bbz KIND 7 8` runs that with the seed 7.

#[cfg(unix)]
fn main() -> std::io::Result<()> {
    use std::path::Path;
    use std::time::Instant;

    use bittybuzz_bad_inputs::{PER_KIND, Runner, kinds};

    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let bbz = arguments.first().map_or("target/debug/bbz", String::as_str);
    let bbz = std::fs::canonicalize(bbz)?;
    let number = |at: usize| arguments.get(at).and_then(|text| text.parse().ok());
    let seeds = number(2).unwrap_or(0)..number(3).unwrap_or(PER_KIND);
    let kept = Path::new("target/bad_inputs");
    let runner = Runner::new(&bbz, Path::new("."), kept)?;
    let (mut inputs, mut broken) = (0, 0);
    for kind in kinds() {
        if arguments.get(1).is_some_and(|name| name != kind.name && name != "all") {
            continue;
        }
        let start = Instant::now();
        for seed in seeds.clone() {
            inputs += 1;
            if let Some(found) = runner.run(&kind, seed)? {
                broken += 1;
                println!(
                    "{} {seed}: {} ({})",
                    kind.name,
                    found.rules.join(", "),
                    found.kept.display()
                );
            }
        }
        println!("{}: {} ms", kind.name, start.elapsed().as_millis());
    }
    println!("{broken} of {inputs} inputs broke a rule");
    Ok(())
}

#[cfg(not(unix))]
fn main() {}
