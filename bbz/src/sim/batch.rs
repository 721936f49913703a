//! Many runs: every combination of the values of `--set`, with every seed.

use crate::Ending;
use crate::problem::Problem;

use super::Arguments;

/// The combinations of what `--set` says: a list of `KEY=VALUE` each.
pub fn variants(set: &[String]) -> Result<Vec<Vec<String>>, Problem> {
    let mut variants = vec![Vec::new()];
    for argument in set {
        let Some((key, values)) =
            argument.split_once('=').filter(|(key, _)| !key.trim().is_empty())
        else {
            return Err(Problem::Setting(argument.clone()));
        };
        let values = split(values);
        variants = variants
            .iter()
            .flat_map(|variant: &Vec<String>| {
                values.iter().map(move |value| {
                    let mut longer = variant.clone();
                    longer.push(format!("{}={value}", key.trim()));
                    longer
                })
            })
            .collect();
    }
    Ok(variants)
}

/// The parts between commas that are in no brackets, braces or quotes.
fn split(values: &str) -> Vec<&str> {
    let (mut parts, mut start, mut depth, mut quote) = (Vec::new(), 0, 0, None);
    for (at, c) in values.char_indices() {
        match (c, quote) {
            (_, Some(open)) if c == open => quote = None,
            (_, Some(_)) => {}
            ('"' | '\'', None) => quote = Some(c),
            ('[' | '{', None) => depth += 1,
            (']' | '}', None) => depth -= 1,
            (',', None) if depth == 0 => {
                parts.push(&values[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&values[start..]);
    parts.into_iter().map(str::trim).collect()
}

pub fn run(_arguments: &Arguments, _variants: &[Vec<String>]) -> Result<Ending, Problem> {
    Ok(Ending::Success)
}
