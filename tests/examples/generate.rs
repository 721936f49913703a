//! Prints the random program of a seed: `cargo run --locked -p bittybuzz-tests --example generate 19 tiny`, with `hidden` behind
//! it the one that reads its literals from variables.

use bittybuzz_tests::generator::{Options, program};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let seed = arguments.first().and_then(|seed| seed.parse().ok());
    let full = match arguments.get(1).map(String::as_str) {
        Some("tiny") => Some(false),
        None | Some("full") => Some(true),
        Some(_) => None,
    };
    let hide_literals = arguments.get(2).is_some_and(|word| word == "hidden");
    match (seed, full) {
        (Some(seed), Some(full)) => {
            print!("{}", program(Options { seed, full, hide_literals }));
        }
        _ => {
            eprintln!("usage: generate SEED [tiny|full [hidden]]");
            std::process::exit(3);
        }
    }
}
