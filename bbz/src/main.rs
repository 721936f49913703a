//! The program `bbz`, which is all in the library of this package.

use std::process::ExitCode;

use bbz::Launch;

fn main() -> ExitCode {
    bbz::main(Launch::of_program()).into()
}
