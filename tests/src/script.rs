//! Scripts whose expectations stand in their own comments. README.md of this crate describes the format.

use crate::bbz::{self, Outcome};
use crate::diagnostics;
use crate::diff;
use crate::files;
use crate::report::Failure;

/// The two number profiles.
const PROFILES: [&str; 2] = ["full", "tiny"];

/// A line of output that is expected in one profile or, without one, in both.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Output {
    profile: Option<&'static str>,
    text: String,
}

/// Everything that the comments of a script say.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Script {
    path: String,
    /// `None`: under each.
    profile: Option<&'static str>,
    arguments: Vec<String>,
    environment: Vec<(String, String)>,
    output: Vec<Output>,
    /// Line and code, without warnings if those are not checked.
    diagnostics: Vec<(usize, String)>,
    any_warnings: bool,
    /// Line, 0 for one in another file, and part of the message.
    fault: Option<(usize, String)>,
    messages: Vec<String>,
}

impl Script {
    /// Reads a script of the repository. The error says which line cannot be understood.
    pub fn load(path: &str) -> Result<Script, Failure> {
        Script::parse(path, &files::read(path))
    }

    fn parse(path: &str, text: &str) -> Result<Script, Failure> {
        let mut script = Script { path: path.to_string(), ..Script::default() };
        let mut says_something = false;
        for (index, line) in text.lines().enumerate() {
            let number = index + 1;
            if let Some(at) = line.find("# expect") {
                script
                    .expectation(number, &line[at + "# expect".len()..])
                    .map_err(|e| format!("{path}:{number}: {e}"))?;
                says_something = true;
            } else {
                script.setting(line).map_err(|e| format!("{path}:{number}: {e}"))?;
            }
        }
        if says_something {
            Ok(script)
        } else {
            Err(format!("{path}:1: expects nothing, so it cannot fail\n"))
        }
    }

    /// What follows `# expect`.
    fn expectation(&mut self, line: usize, text: &str) -> Result<(), String> {
        if text == " nothing" {
            return Ok(());
        }
        let (subject, value) = text.split_once(':').ok_or("no colon after `# expect`\n")?;
        let value = value.strip_prefix(' ').unwrap_or(value);
        match subject {
            "" => self.output.push(Output { profile: None, text: value.to_string() }),
            " full" | " tiny" => {
                let profile = Some(profile_named(subject.trim_start())?);
                self.output.push(Output { profile, text: value.to_string() });
            }
            " runtime error" | " runtime error elsewhere" if self.fault.is_some() => {
                return Err("a run has one run-time error at most\n".to_string());
            }
            " runtime error" => self.fault = Some((line, value.to_string())),
            " runtime error elsewhere" => self.fault = Some((0, value.to_string())),
            " compile error" => self.codes(line, value, 'E')?,
            " warning" => self.codes(line, value, 'W')?,
            " message" => self.messages.push(value.to_string()),
            other => return Err(format!("unknown expectation `{}`\n", other.trim_start())),
        }
        Ok(())
    }

    fn codes(&mut self, line: usize, codes: &str, kind: char) -> Result<(), String> {
        for code in codes.split_whitespace() {
            if code.len() != 5 || !code.starts_with(kind) {
                return Err(format!("`{code}` is no code of the form {kind}0000\n"));
            }
            self.diagnostics.push((line, code.to_string()));
        }
        Ok(())
    }

    /// A comment line that says how to run the script.
    fn setting(&mut self, line: &str) -> Result<(), String> {
        if let Some(arguments) = line.strip_prefix("# args: ") {
            self.arguments.extend(arguments.split_whitespace().map(str::to_string));
        } else if let Some(profile) = line.strip_prefix("# profile: ") {
            self.profile = Some(profile_named(profile.trim_end())?);
        } else if let Some(variable) = line.strip_prefix("# env: ") {
            let (name, value) = variable.split_once('=').ok_or("`# env: NAME=VALUE`\n")?;
            self.environment.push((name.to_string(), value.to_string()));
        } else if line == "# warnings: any" {
            self.any_warnings = true;
        }
        Ok(())
    }

    /// Runs the script under each of its profiles; the number of runs, and what went wrong.
    pub fn run(&self) -> (usize, Vec<Failure>) {
        let profiles: Vec<&'static str> =
            PROFILES.into_iter().filter(|p| self.profile.is_none_or(|only| only == *p)).collect();
        let mut failures = Vec::new();
        for profile in &profiles {
            let mut arguments = vec!["run", "--profile", profile];
            arguments.extend(self.arguments.iter().map(String::as_str));
            arguments.push(&self.path);
            let outcome = bbz::run(&arguments, &self.environment);
            let problems = self.judge(profile, &outcome);
            if !problems.is_empty() {
                failures.push(format!(
                    "{}:{}: profile {profile}\n{}",
                    self.path,
                    problems[0].0,
                    problems.iter().map(|(_, text)| text.as_str()).collect::<String>()
                ));
            }
        }
        (profiles.len(), failures)
    }

    /// Compares a run with the expectations: line of the script and description of each difference.
    fn judge(&self, profile: &str, outcome: &Outcome) -> Vec<(usize, String)> {
        let mut problems = Vec::new();
        let expected_status = self.status();
        if outcome.status != Some(expected_status) {
            let status = outcome.status.map_or("none".to_string(), |s| s.to_string());
            problems.push((1, format!("    exit status {status} instead of {expected_status}\n")));
        }
        let expected: Vec<&str> = self
            .output
            .iter()
            .filter(|output| output.profile.is_none_or(|only| only == profile))
            .map(|output| output.text.as_str())
            .collect();
        let actual: Vec<&str> = outcome.stdout.lines().collect();
        if let Some(difference) = diff::lines(&expected, &actual) {
            problems.push((1, difference));
        }
        self.judge_diagnostics(outcome, &mut problems);
        for message in self.messages.iter().filter(|m| !outcome.stderr.contains(m.as_str())) {
            problems.push((1, format!("    standard error does not say `{message}`\n")));
        }
        if !problems.is_empty() && !outcome.stderr.is_empty() {
            let stderr: String = outcome.stderr.lines().map(|l| format!("    | {l}\n")).collect();
            problems.push((1, stderr));
        }
        problems
    }

    fn judge_diagnostics(&self, outcome: &Outcome, problems: &mut Vec<(usize, String)>) {
        let mut missing = self.diagnostics.clone();
        let mut fault = self.fault.as_ref();
        for found in diagnostics::parse(&outcome.stderr) {
            let line = match &found.place {
                Some((file, line)) if *file == self.path => *line,
                _ => 0,
            };
            if let Some(code) = &found.code
                && let Some(at) = missing.iter().position(|(l, c)| *l == line && c == code)
            {
                missing.remove(at);
            } else if let Some((expected, part)) = fault
                && found.error
                && *expected == line
                && found.message.contains(part)
            {
                fault = None;
            } else if found.error || !self.any_warnings {
                let code = found.code.map_or(String::new(), |code| format!(" {code}"));
                problems.push((line, format!("    unexpected{code}: {}\n", found.message)));
            }
        }
        for (line, code) in missing {
            problems.push((line, format!("    {code} is missing in line {line}\n")));
        }
        if let Some((line, part)) = fault {
            problems
                .push((*line, format!("    run-time error `{part}` is missing in line {line}\n")));
        }
    }

    fn status(&self) -> i32 {
        if self.diagnostics.iter().any(|(_, code)| code.starts_with('E')) {
            2
        } else if self.fault.is_some() {
            1
        } else {
            0
        }
    }
}

fn profile_named(name: &str) -> Result<&'static str, String> {
    PROFILES.into_iter().find(|p| *p == name).ok_or_else(|| format!("no profile `{name}`\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(status: i32, stdout: &str, stderr: &str) -> Outcome {
        Outcome { status: Some(status), stdout: stdout.into(), stderr: stderr.into() }
    }

    fn problems(script: &str, profile: &str, outcome: &Outcome) -> usize {
        Script::parse("s.bzz", script).unwrap().judge(profile, outcome).len()
    }

    #[test]
    fn output_is_compared_exactly_and_by_profile() {
        let script = "log(1) # expect: 1\n# expect full: 2\n# expect tiny: 3\n# expect:\n";
        assert_eq!(problems(script, "full", &outcome(0, "1\n2\n\n", "")), 0);
        assert_eq!(problems(script, "tiny", &outcome(0, "1\n3\n\n", "")), 0);
        assert_eq!(problems(script, "tiny", &outcome(0, "1\n2\n\n", "")), 1);
        assert_eq!(problems(script, "tiny", &outcome(0, "1\n3\n", "")), 1);
        assert_eq!(problems(script, "tiny", &outcome(0, "1 \n3\n\n", "")), 1);
        assert_eq!(problems(script, "full", &outcome(1, "1\n2\n\n", "")), 1);
    }

    #[test]
    fn a_fault_needs_line_text_and_status() {
        let script = "\nx = 1 / y # expect runtime error: division\n";
        let stderr = "error: division by zero\n --> s.bzz:2:7\n";
        assert_eq!(problems(script, "full", &outcome(1, "", stderr)), 0);
        assert_ne!(problems(script, "full", &outcome(0, "", "")), 0);
        let elsewhere = "error: division by zero\n --> s.bzz:3:7\n";
        assert_ne!(problems(script, "full", &outcome(1, "", elsewhere)), 0);
        let included = "error: division by zero\n --> t.bzz:2:7\n";
        assert_ne!(problems(script, "full", &outcome(1, "", included)), 0);
        let script_elsewhere = "# expect runtime error elsewhere: division\n";
        assert_eq!(problems(script_elsewhere, "full", &outcome(1, "", included)), 0);
        assert_ne!(problems(script_elsewhere, "full", &outcome(1, "", stderr)), 0);
        let other = "error: nil\n --> s.bzz:2:7\n";
        assert_ne!(problems(script, "full", &outcome(1, "", other)), 0);
    }

    #[test]
    fn codes_need_their_line_and_every_one_counts() {
        let script = "x = # expect compile error: E0201 E0202\n";
        let one = "error[E0201]: a\n --> s.bzz:1:5\n";
        let both = format!("{one}error[E0202]: b\n --> s.bzz:1:6\n");
        assert_eq!(problems(script, "full", &outcome(2, "", &both)), 0);
        assert_ne!(problems(script, "full", &outcome(2, "", one)), 0);
        let third = format!("{both}error[E0203]: c\n --> s.bzz:1:7\n");
        assert_ne!(problems(script, "full", &outcome(2, "", &third)), 0);
    }

    #[test]
    fn a_warning_must_be_expected_unless_any_will_do() {
        let stderr = "warning[W0101]: odd\n --> s.bzz:1:1\n";
        assert_ne!(problems("log(1) # expect: 1\n", "full", &outcome(0, "1\n", stderr)), 0);
        let any = "# warnings: any\nlog(1) # expect: 1\n";
        assert_eq!(problems(any, "full", &outcome(0, "1\n", stderr)), 0);
        let script = "log(1) # expect warning: W0101\n# expect: 1\n";
        assert_eq!(problems(script, "full", &outcome(0, "1\n", stderr)), 0);
        assert_ne!(problems(script, "full", &outcome(0, "1\n", "")), 0);
    }

    #[test]
    fn a_script_without_expectation_is_refused() {
        assert!(Script::parse("s.bzz", "log(1)\n").is_err());
        assert!(Script::parse("s.bzz", "# expect nothing\n").is_ok());
        assert!(Script::parse("s.bzz", "# expects: 1\n").is_err());
        assert!(Script::parse("s.bzz", "# expect output: 1\n").is_err());
        assert!(Script::parse("s.bzz", "# expect compile error: 201\n").is_err());
    }
}
