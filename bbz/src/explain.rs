//! `bbz explain`: the meaning of a code, and the cure.

use bittybuzz_compiler::codes::DiagnosticCode;
use bittybuzz_compiler::explain;
use bittybuzz_fault::{code, title};
use bittybuzz_vm_core::FaultCode;
use clap::Args;

use crate::exit::ExitStatus;
use crate::output;
use crate::problem::Problem;

/// The most characters by which two similar codes differ.
const DIFFERENCES_MAX: usize = 1;

/// `bbz explain` was asked for a code that does not exist.
#[derive(Debug, thiserror::Error)]
#[error("there is no code `{code}`")]
struct UnknownCode {
    code: String,
    /// The code that was probably meant.
    likely: Option<String>,
}

impl Problem for UnknownCode {
    fn help(&self) -> Option<String> {
        Some(match &self.likely {
            Some(likely) => format!("did you mean {likely}? `bbz explain` lists all codes"),
            None => "`bbz explain` lists all codes".to_owned(),
        })
    }
}

const EXAMPLES: &str = "\
Examples:
  bbz explain E0201    an error of the compiler
  bbz explain W0102    a warning
  bbz explain R0005    a run-time error
  bbz explain          a list of all codes";

/// Arguments of `bbz explain`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct ExplainArguments {
    /// Code of a message, such as E0201; without, all are listed
    code: Option<String>,
}

/// Carries out the command.
pub fn execute(arguments: &ExplainArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let Some(code) = &arguments.code else {
        let lines = codes().map(|(code, title)| format!("{code}  {title}\n"));
        output::write(&lines.collect::<String>())?;
        return Ok(ExitStatus::Success);
    };
    let wanted = code.to_uppercase();
    let section = explain::explain(&wanted);
    let Some(section) = section else {
        return Err(UnknownCode { code: code.clone(), likely: likely(&wanted) }.into());
    };
    output::write(&format!("{section}\n"))?;
    Ok(ExitStatus::Success)
}

/// Returns every code with its title.
pub fn codes() -> impl Iterator<Item = (String, &'static str)> {
    let compiler = DiagnosticCode::ALL.iter().map(|code| (code.text().to_owned(), code.title()));
    let run_time = FaultCode::ALL.iter().map(|cause| (code(*cause), title(*cause)));
    compiler.chain(run_time)
}

/// Returns the code that was probably meant.
fn likely(wanted: &str) -> Option<String> {
    let compared = codes().map(|(code, _)| (strsim::damerau_levenshtein(wanted, &code), code));
    compared.min().filter(|(differences, _)| *differences <= DIFFERENCES_MAX).map(|(_, code)| code)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_run_time_error_has_a_section_with_its_title_and_an_example() {
        for cause in FaultCode::ALL {
            let code = code(cause);
            let section = explain::explain(&code).unwrap_or_else(|| panic!("{code} is missing"));
            let heading = format!("## {code} — {}\n", title(cause));
            assert!(section.starts_with(&heading), "{section}");
            assert!(section.contains("\n```buzz\n"), "{code} has no example");
        }
        let sections = explain::run_time_sections().count();
        assert_eq!(sections, FaultCode::ALL.len(), "a section of no code");
    }

    #[test]
    fn a_slip_of_the_finger_has_a_suggestion() {
        for (wanted, expected) in [
            ("R005", Some("R0005")),
            ("E020", Some("E0201")),
            ("R00050", Some("R0005")),
            ("X", None),
            ("", None),
        ] {
            assert_eq!(likely(wanted).as_deref(), expected, "{wanted}");
        }
    }
}
