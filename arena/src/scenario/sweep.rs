//! `[sweep]`: the runs of a study, with several values of some keys.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use bittybuzz_toml_reader::{Place, TomlError, number_text};
use toml::de::DeValue;

use crate::sweep::{Axis, Chance, Dimension, Draw, ParameterValue, Range, draw, expand};

use super::column::{ColumnNames, OWN_COLUMNS};
use super::error::ScenarioCause;
use super::keys::{SWEEP, SWEEP_PARAMETER};
use super::read::{Entry, Section};

/// The runs of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepSection {
    /// The values of the parameters; all rows of the axes are combined.
    pub axes: Vec<Axis>,
    /// The parameters, by their keys.
    pub parameters: BTreeMap<String, SweepParameter>,
    /// The number of runs of each point; `None` if the command says it.
    pub seeds: Option<u32>,
    pub chance: Chance,
}

/// A parameter of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepParameter {
    /// The name of its column, if the file says one.
    pub name: Option<String>,
    /// The place of its key in the file.
    pub place: Place,
}

/// A rule that makes points of the values of parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Design {
    /// All combinations.
    Grid,
    /// The first values of all parameters, then the second ones, and so on.
    List,
    /// Drawn points.
    Drawn(Draw),
}

const DESIGNS: [(&str, Design); 4] = [
    ("grid", Design::Grid),
    ("list", Design::List),
    ("random", Design::Drawn(Draw::Random)),
    ("latin-hypercube", Design::Drawn(Draw::LatinHypercube)),
];

/// The numbers of runs of a point, and of drawn points.
const COUNT: RangeInclusive<u32> = 1..=1_000_000;

/// Reads the study of a file, if there is one.
pub fn read(root: &Section<'_>) -> Option<SweepSection> {
    let section = root.section("sweep", SWEEP)?;
    let design = match section.get("design") {
        None => Some(Design::Grid),
        Some(_) => section.word("design", &DESIGNS),
    };
    let seeds = section.integer("seeds", COUNT);
    // The design of a study says it, because results depend on it and no value suits all studies.
    let chance = section.required("chance").and_then(|entry| entry.word(&Chance::WORDS));
    let draw = match design {
        Some(Design::Drawn(by)) => {
            let points = section.required("points").and_then(|entry| entry.integer(COUNT));
            let seed = section.integer("seed", 0..=u32::MAX).unwrap_or(1);
            points.map(|points| (by, points, seed))
        }
        _ => {
            for key in ["points", "seed"] {
                if let Some(entry) = section.get(key).filter(|_| design.is_some()) {
                    let needs = "design = \"random\" or \"latin-hypercube\"";
                    entry.fail(ScenarioCause::Without { key, needs });
                }
            }
            None
        }
    };
    let sections = section.sections("parameter", SWEEP_PARAMETER);
    if sections.is_empty() {
        section.fail(ScenarioCause::NoParameters);
    }
    let mut parameters = BTreeMap::new();
    let mut names = ColumnNames::new("a parameter");
    let mut axes = Vec::new();
    let mut dimensions = Vec::new();
    for parameter in &sections {
        let key = key(parameter, &mut parameters, &mut names);
        let range = match design {
            Some(Design::Drawn(_)) => range(parameter),
            _ => values(parameter).map(Range::Choice),
        };
        let (Some(key), Some(range)) = (key, range) else { continue };
        match range {
            Range::Choice(values) if draw.is_none() => {
                let rows = values.into_iter().map(|value| vec![value]).collect();
                axes.push(Axis { keys: vec![key], rows });
            }
            range => dimensions.push(Dimension { key, range }),
        }
    }
    match (design, draw) {
        (Some(Design::List), _) => axes = together(&section, axes)?,
        (_, Some((by, points, seed))) => axes = vec![self::draw(by, &dimensions, points, seed)],
        _ => {}
    }
    Some(SweepSection { axes, parameters, seeds, chance: chance? })
}

/// Reads the key of a parameter, and adds the parameter.
fn key(
    section: &Section<'_>,
    parameters: &mut BTreeMap<String, SweepParameter>,
    names: &mut ColumnNames,
) -> Option<String> {
    let name = names.read(section);
    if let (Some(name), Some(entry)) = (&name, section.get("name"))
        && OWN_COLUMNS.contains(&name.as_str())
    {
        entry.fail(ScenarioCause::TakenColumn { name: name.clone() });
    }
    let entry = section.required("key")?;
    let key = entry.string()?.trim().to_owned();
    if key.is_empty() || key == "sweep" || key.starts_with("sweep.") || key.contains('=') {
        entry.fail(ScenarioCause::BadParameter { key });
        return None;
    }
    let place = entry.place();
    if let Some(known) = parameters.get(&key) {
        let (line, of) = (known.place.line, "a parameter");
        entry.fail(ScenarioCause::DuplicateColumn { of, name: key, line });
        return None;
    }
    parameters.insert(key.clone(), SweepParameter { name, place });
    Some(key)
}

/// Reads the values of a parameter: a list, or a range as a string.
fn values(section: &Section<'_>) -> Option<Vec<ParameterValue>> {
    for key in ["from", "to"] {
        if let Some(entry) = section.get(key) {
            let needs = "design = \"random\" or \"latin-hypercube\"";
            entry.fail(ScenarioCause::Without { key, needs });
        }
    }
    listed(&section.required("values")?)
}

fn listed(entry: &Entry<'_>) -> Option<Vec<ParameterValue>> {
    if let DeValue::String(text) = entry.value {
        return match expand(text) {
            Ok(values) => Some(values),
            Err(error) => {
                entry.fail(ScenarioCause::BadRange { error });
                None
            }
        };
    }
    let items = entry.list()?;
    if items.is_empty() {
        let expected = "a list of one value or more";
        entry.fail(TomlError::Length { key: entry.key.clone(), expected, found: 0 });
        return None;
    }
    let value = |item: &Entry<'_>| match item.value {
        DeValue::String(text) => ParameterValue::Text(text.to_string()),
        _ => ParameterValue::parse(item.text()),
    };
    Some(items.iter().map(value).collect())
}

/// Reads the values from which those of a parameter are drawn.
fn range(section: &Section<'_>) -> Option<Range> {
    if let Some(entry) = section.get("values") {
        if section.get("from").is_some() {
            entry.fail(TomlError::Both { key: "values", other: "from" });
            return None;
        }
        return listed(&entry).map(Range::Choice);
    }
    let (from, to) = (section.required("from")?, section.required("to")?);
    let bounds = (ParameterValue::parse(from.text()), ParameterValue::parse(to.text()));
    let finite = f64::MIN..=f64::MAX;
    let (low, high) = (from.number(finite.clone())?, to.number(finite)?);
    if high < low {
        let range = format!("a number from {} on", number_text(low));
        let value = number_text(high);
        to.fail(TomlError::OutOfRange { key: "to".to_owned(), value, range });
        return None;
    }
    Some(match bounds {
        (ParameterValue::Integer(low), ParameterValue::Integer(high)) => Range::Integers(low, high),
        _ => Range::Floats(low, high),
    })
}

/// Returns one axis on which all parameters vary together.
fn together(section: &Section<'_>, axes: Vec<Axis>) -> Option<Vec<Axis>> {
    let mut axes = axes.into_iter();
    let Some(mut all) = axes.next() else { return Some(Vec::new()) };
    for axis in axes {
        if axis.rows.len() != all.rows.len() {
            let (first, other) = (all.keys.first(), axis.keys.first());
            let (first, other) = (first.cloned()?, other.cloned()?);
            let counts = [all.rows.len(), axis.rows.len()];
            section.fail(ScenarioCause::UnlikeLists { keys: [first, other], counts });
            return None;
        }
        all.keys.extend(axis.keys);
        all.rows.iter_mut().zip(axis.rows).for_each(|(row, more)| row.extend(more));
    }
    Some(vec![all])
}
