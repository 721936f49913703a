//! Squeezes assembly files and proves the result: `cargo run --locked --release --example prove -- FILE...`

use std::process::ExitCode;

use bittybuzz_squeeze::{LOOP, is_hot, proof, squeeze};

fn main() -> ExitCode {
    for path in std::env::args().skip(1) {
        let text = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) => {
                eprintln!("error: `{path}`: {error}");
                return ExitCode::FAILURE;
            }
        };
        let squeezed = squeeze(&text, |symbol| is_hot(symbol, LOOP));
        match proof::prove(&text, &squeezed.text, &squeezed.contracts) {
            Ok(report) => print!("{path}: {report}"),
            Err(refusal) => {
                println!("refused: {path}: {refusal}");
                return ExitCode::FAILURE;
            }
        }
    }
    ExitCode::SUCCESS
}
