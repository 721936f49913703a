//! The program `bbz`, which is all in the library of this package.

use std::process::ExitCode;

use bbz_tool::Launch;

fn main() -> ExitCode {
    bbz_tool::main(Launch::of_program()).into()
}
