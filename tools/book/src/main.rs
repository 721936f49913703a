//! The command line: `build-book FOLDER` writes the book into the folder.

use std::env;
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(folder) = env::args_os().nth(1) else {
        eprintln!("usage: build-book FOLDER");
        return ExitCode::from(3);
    };
    match bittybuzz_book::build(Path::new(&folder)) {
        Ok(page) => {
            println!("{}", page.display());
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("build-book: {error:#}");
            ExitCode::FAILURE
        }
    }
}
