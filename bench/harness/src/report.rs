//! Prints the figures as a table for people.

use crate::catalogue::{BenchScript, Catalogue};
use crate::figures::{Figure, Scripts};
use crate::target::BenchTarget;
use crate::{COLLECTION, FIB, NO_COLLECTION, VERIFICATION};
use std::fmt::Write;

/// The computed rows that follow the scripts, with their titles.
const DERIVED: [(&str, &str); 3] = [
    (FIB, "fib, per call"),
    (COLLECTION, "collection of a full heap"),
    (VERIFICATION, "verification, per 1024 bytes"),
];

/// Returns a target's figures next to those of the reference and the committed ones.
pub fn table(
    target: BenchTarget,
    catalogue: &Catalogue,
    now: &Scripts,
    before: Option<&Scripts>,
) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = write_table(&mut out, target, catalogue, now, before);
    out
}

fn write_table(
    out: &mut String,
    target: BenchTarget,
    catalogue: &Catalogue,
    now: &Scripts,
    before: Option<&Scripts>,
) -> std::fmt::Result {
    let (name, profile, unit) = (target.name(), target.profile().name(), target.unit());
    writeln!(out, "{name}: {unit}; profile {profile}")?;
    writeln!(
        out,
        "{:<30}{:>14}{:>16}{:>10}{:>12}",
        "one step", "here", "C BittyBuzz", "times", "committed"
    )?;
    let mut ratios = Vec::new();
    let is_row = |script: &&BenchScript| {
        script.is_for(target) && ![COLLECTION, NO_COLLECTION, VERIFICATION].contains(&&*script.name)
    };
    for script in catalogue.scripts.iter().filter(is_row) {
        let reference = script.reference(target);
        let shown = reference.map(grouped).unwrap_or_default();
        let Some(Figure { count, .. }) = now.get(&script.name) else {
            writeln!(out, "{:<30}{:>14}{shown:>16}", script.name, "failed")?;
            continue;
        };
        let ratio = reference.map(|reference| reference as f64 / *count as f64);
        ratios.extend(ratio);
        let ratio = ratio.map(|ratio| format!("{ratio:.1}")).unwrap_or_default();
        let change = change(*count, before, &script.name);
        let count = grouped(*count);
        writeln!(out, "{:<30}{count:>14}{shown:>16}{ratio:>10}{change:>12}", script.name)?;
    }
    writeln!(out, "{:<60}{:>10.1}", "geometric mean", geometric_mean(&ratios))?;
    for (name, title) in DERIVED {
        if let Some(Figure { count, .. }) = now.get(name) {
            let (change, count) = (change(*count, before, name), grouped(*count));
            writeln!(out, "{title:<30}{count:>14}{change:>38}")?;
        }
    }
    Ok(())
}

/// Returns the change from the committed count, in percent.
fn change(now: u64, before: Option<&Scripts>, name: &str) -> String {
    match before.and_then(|before| before.get(name)).map(|figure| figure.count) {
        None => "new".to_owned(),
        Some(before) if before == now => "same".to_owned(),
        Some(before) => format!("{:+.1} %", (now as f64 / before as f64 - 1.0) * 100.0),
    }
}

fn geometric_mean(ratios: &[f64]) -> f64 {
    (ratios.iter().map(|ratio| ratio.ln()).sum::<f64>() / ratios.len() as f64).exp()
}

/// Formats a number with a comma between thousands.
pub fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut out = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_grouped() {
        for (number, text) in [(0, "0"), (999, "999"), (1000, "1,000"), (1_234_567, "1,234,567")] {
            assert_eq!(grouped(number), text);
        }
    }

    #[test]
    fn the_mean_is_geometric() {
        assert!((geometric_mean(&[1.0, 100.0]) - 10.0).abs() < 1e-9);
    }

    #[test]
    fn a_row_has_reference_ratio_and_change() {
        let catalogue = Catalogue::load().unwrap();
        let figures =
            |count| Scripts::from([("empty".to_owned(), Figure { count, result: 0.into() })]);
        let text = table(BenchTarget::Avr, &catalogue, &figures(2661), Some(&figures(2700)));
        let row: Vec<&str> = text
            .lines()
            .find(|line| line.starts_with("empty"))
            .unwrap()
            .split_whitespace()
            .collect();
        assert_eq!(row, ["empty", "2,661", "26,610", "10.0", "-1.4", "%"]);
        assert!(text.contains("failed"), "{text}");
        // In the profile full only.
        assert!(!text.contains("float"), "{text}");
    }
}
