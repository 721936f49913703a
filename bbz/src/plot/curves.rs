//! Collects the numbers of a figure from the tables.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use bittybuzz_arena::output::{CURVES_MAX, Figure, Panel};
use bittybuzz_arena::run::TICKS_PER_SECOND;
use bittybuzz_tables::{Values, Wanted};

use crate::problem::Problem;
use crate::report;

use super::files::TableFiles;
use super::problem::PlotError;
use super::quantity::PlotQuantity;
use super::samples::{Samples, Units, caption};
use super::tables::{ROBOT, RUN, TICK, Tables};

/// The values of a parameter, of which each has a curve.
struct ParameterValues {
    /// Each value once: numbers by size, texts by the alphabet.
    names: Vec<String>,
    /// The place in `names` of the value of each row of the table of runs.
    of_rows: Vec<usize>,
}

impl ParameterValues {
    fn read(runs: &TableFiles, parameter: &str) -> Result<Self, Box<dyn Problem>> {
        // A value of many runs is kept once.
        let mut places: BTreeMap<String, usize> = BTreeMap::new();
        let mut of_rows = Vec::new();
        runs.read(&[(parameter, Wanted::Texts)], |piece| {
            for value in texts(&piece[0]) {
                let value = value.as_deref().unwrap_or("none");
                let next = places.len();
                of_rows.push(match places.get(value) {
                    Some(place) => *place,
                    None => *places.entry(value.to_owned()).or_insert(next),
                });
            }
            Ok(())
        })?;
        if places.len() > CURVES_MAX {
            let (parameter, count) = (parameter.to_owned(), places.len());
            return Err(PlotError::ManyCurves { parameter, count }.into());
        }
        let number = |text: &str| text.parse::<f64>().unwrap_or(f64::NAN);
        let mut sorted: Vec<(String, usize)> = places.into_iter().collect();
        sorted.sort_by(|(one, _), (other, _)| number(one).total_cmp(&number(other)));
        let mut curves = vec![0; sorted.len()];
        for (curve, (_, place)) in sorted.iter().enumerate() {
            curves[*place] = curve;
        }
        of_rows.iter_mut().for_each(|place| *place = curves[*place]);
        Ok(ParameterValues { names: sorted.into_iter().map(|(name, _)| name).collect(), of_rows })
    }
}

/// Returns the parameters with several values that a figure does not show: each curve has the runs of
/// all these values.
fn pooled(tables: &Tables, shown: &[Option<&str>]) -> Result<Vec<String>, Box<dyn Problem>> {
    let mut parameters = tables.parameters();
    parameters.retain(|name| !shown.contains(&Some(name.as_str())));
    let wanted: Vec<_> = parameters.iter().map(|name| (name.as_str(), Wanted::Texts)).collect();
    if wanted.is_empty() || shown.contains(&Some(RUN)) {
        return Ok(Vec::new());
    }
    let mut first: Vec<Option<Option<String>>> = vec![None; wanted.len()];
    let mut varies = vec![false; wanted.len()];
    tables.runs()?.read(&wanted, |piece| {
        for ((values, first), varies) in piece.iter().zip(&mut first).zip(&mut varies) {
            for value in texts(values) {
                *varies |= first.get_or_insert_with(|| value.clone()) != value;
            }
        }
        Ok(())
    })?;
    let varying = parameters.into_iter().zip(varies).filter(|(_, varies)| *varies);
    Ok(varying.map(|(name, _)| name).collect())
}

/// The key by which rows of a table over time go to curves.
enum Grouping {
    /// All rows are of one curve.
    None,
    /// A column of the table itself.
    Column(&'static str),
    /// A parameter: the curve of each run.
    Parameter { names: Vec<String>, curves: BTreeMap<u64, u64> },
}

impl Grouping {
    fn new(tables: &Tables, by: Option<&str>) -> Result<Self, Box<dyn Problem>> {
        let Some(by) = by else { return Ok(Grouping::None) };
        if let Some(column) = [RUN, ROBOT].into_iter().find(|column| *column == by) {
            return Ok(Grouping::Column(column));
        }
        tables.check_parameter(by, &[RUN, ROBOT])?;
        let runs = tables.runs()?;
        let values = ParameterValues::read(runs, by)?;
        let mut places = values.of_rows.into_iter();
        let mut curves = BTreeMap::new();
        runs.read(&[(RUN, Wanted::Numbers)], |piece| {
            for (run, place) in numbers(&piece[0]).iter().zip(&mut places) {
                curves.insert(*run as u64, place as u64);
            }
            Ok(())
        })?;
        Ok(Grouping::Parameter { names: values.names, curves })
    }

    fn name(&self, curve: u64) -> String {
        match self {
            Grouping::Parameter { names, .. } => names[curve as usize].clone(),
            _ => curve.to_string(),
        }
    }
}

/// The numbers of each curve, for each of some quantities.
type Collected = BTreeMap<u64, Vec<Samples>>;

/// Draws quantities over time.
pub fn over_time(
    tables: &Tables,
    names: &[String],
    by: Option<&str>,
) -> Result<Figure, Box<dyn Problem>> {
    let found = names.iter().map(|name| tables.quantity_over_time(name));
    let found = found.collect::<Result<Vec<_>, _>>()?;
    let grouping = Grouping::new(tables, by)?;
    let mut unknown = BTreeSet::new();
    let mut collect = |is_of_robots: bool| {
        let quantities: Vec<&PlotQuantity> = found
            .iter()
            .filter(|(of_robots, _)| *of_robots == is_of_robots)
            .map(|(_, q)| q)
            .collect();
        match quantities.is_empty() {
            true => Ok(Collected::new()),
            false => {
                let table = tables.over_time(is_of_robots);
                rows_over_time(tables, table, &quantities, &grouping, &mut unknown)
            }
        }
    };
    let [mut robots, mut swarm] = [collect(true)?, collect(false)?];
    if !unknown.is_empty() {
        let runs = report::counted(unknown.len(), "run");
        report::warning(
            &format!("{runs} of `{}` not in the table of runs: left out", tables.path.display()),
            Some("the batch was stopped, or still goes on"),
        );
    }
    let keys: BTreeSet<u64> = robots.keys().chain(swarm.keys()).copied().collect();
    let pooled = pooled(tables, &[by])?;
    let panels = found.iter().rev().map(|(is_of_robots, quantity)| {
        let collected = if *is_of_robots { &mut robots } else { &mut swarm };
        // The last quantity comes first.
        let curves = keys.iter().map(|key| collected.get_mut(key).and_then(Vec::pop));
        let curves: Vec<Samples> = curves.map(Option::unwrap_or_default).collect();
        let units = if *is_of_robots { Units::Robots } else { Units::RunsOverTime };
        let path = &tables.over_time(*is_of_robots).path;
        panel(quantity, &curves, |curves| caption(curves, units, &pooled), path)
    });
    let mut panels = panels.collect::<Result<Vec<_>, _>>()?;
    panels.reverse();
    Ok(Figure {
        x_label: "time in s".to_owned(),
        parameter: by.map(str::to_owned),
        curves: keys.into_iter().map(|key| grouping.name(key)).collect(),
        panels,
        has_marks: false,
    })
}

/// Reads the rows of robots, or those of the swarm. `unknown` collects runs without parameters.
fn rows_over_time(
    tables: &Tables,
    table: &TableFiles,
    quantities: &[&PlotQuantity],
    grouping: &Grouping,
    unknown: &mut BTreeSet<u64>,
) -> Result<Collected, Box<dyn Problem>> {
    let key = match grouping {
        Grouping::Column(column) => *column,
        _ => RUN,
    };
    if !table.has(key) {
        let (path, known) = (table.path.clone(), tables.parameters());
        return Err(PlotError::UnknownParameter { path, name: key.to_owned(), known }.into());
    }
    let mut wanted = vec![(TICK, Wanted::Numbers), (RUN, Wanted::Numbers), (key, Wanted::Numbers)];
    wanted.extend(quantities.iter().map(|quantity| (quantity.column.as_str(), Wanted::Numbers)));
    let mut collected = Collected::new();
    let mut others = BTreeSet::new();
    table.read(&wanted, |piece| {
        let [ticks, runs, keys] = [0, 1, 2].map(|column| numbers(&piece[column]));
        for row in 0..ticks.len() {
            if let Some(column) = [0, 1, 2].into_iter().find(|n| numbers(&piece[*n])[row].is_nan())
            {
                let (path, column) = (table.path.clone(), wanted[column].0.to_owned());
                return Err(PlotError::NoKey { path, column });
            }
            let run = runs[row] as u64;
            let curve = match grouping {
                Grouping::None => 0,
                Grouping::Column(_) => keys[row] as u64,
                Grouping::Parameter { curves, .. } => match curves.get(&run) {
                    Some(curve) => *curve,
                    None => {
                        unknown.insert(run);
                        continue;
                    }
                },
            };
            if collected.len() == CURVES_MAX && !collected.contains_key(&curve) {
                others.insert(curve);
                continue;
            }
            let empty = || vec![Samples::default(); quantities.len()];
            let curves = collected.entry(curve).or_insert_with(empty);
            for ((values, quantity), samples) in piece[3..].iter().zip(quantities).zip(curves) {
                let value = numbers(values)[row] * quantity.factor;
                samples.add(ticks[row] / TICKS_PER_SECOND, value, run);
            }
        }
        Ok(())
    })?;
    match others.is_empty() {
        true => Ok(collected),
        false => {
            let count = CURVES_MAX + others.len();
            Err(PlotError::ManyCurves { parameter: key.to_owned(), count }.into())
        }
    }
}

/// Draws quantities of runs against a parameter.
pub fn against(
    tables: &Tables,
    names: &[String],
    x: &str,
    by: Option<&str>,
) -> Result<Figure, Box<dyn Problem>> {
    let runs = tables.runs()?;
    for parameter in [x].into_iter().chain(by) {
        tables.check_parameter(parameter, &[])?;
    }
    let quantities = names.iter().map(|name| tables.quantity_of_runs(name));
    let quantities = quantities.collect::<Result<Vec<_>, _>>()?;
    let values = by.map(|by| ParameterValues::read(runs, by)).transpose()?;
    let names = values.as_ref().map_or(Vec::new(), |values| values.names.clone());
    let count = names.len().max(1);
    let mut curves: Vec<Vec<Samples>> = vec![vec![Samples::default(); count]; quantities.len()];
    let mut wanted = vec![(x, Wanted::Texts)];
    wanted.extend(quantities.iter().map(|quantity| (quantity.column.as_str(), Wanted::Numbers)));
    let mut run = 0;
    runs.read(&wanted, |piece| {
        let places = texts(&piece[0]);
        for (row, place) in places.iter().enumerate() {
            let place = place.as_deref().unwrap_or("none");
            let x = place.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(|| {
                PlotError::NotAnAxis { parameter: x.to_owned(), value: place.to_owned() }
            })?;
            let curve = values.as_ref().and_then(|values| values.of_rows.get(run)).unwrap_or(&0);
            for ((values, quantity), curves) in piece[1..].iter().zip(&quantities).zip(&mut curves)
            {
                curves[*curve].add(x, numbers(values)[row] * quantity.factor, run as u64);
            }
            run += 1;
        }
        Ok(())
    })?;
    let panels = quantities.iter().zip(&curves);
    let pooled = pooled(tables, &[Some(x), by])?;
    let caption = |curves: &[Samples]| caption(curves, Units::Runs, &pooled);
    let panels = panels.map(|(quantity, curves)| panel(quantity, curves, caption, &runs.path));
    Ok(Figure {
        x_label: x.to_owned(),
        parameter: by.map(str::to_owned),
        curves: names,
        panels: panels.collect::<Result<_, _>>()?,
        has_marks: true,
    })
}

fn panel(
    quantity: &PlotQuantity,
    curves: &[Samples],
    caption: impl Fn(&[Samples]) -> String,
    path: &Path,
) -> Result<Panel, PlotError> {
    let points: Vec<_> = curves.iter().map(Samples::points).collect();
    if points.iter().flatten().all(|point| point.quartiles.is_none()) {
        let (quantity, path) = (quantity.name.clone(), path.to_owned());
        return Err(PlotError::NoNumbers { quantity, path });
    }
    Ok(Panel { y_label: quantity.label(), caption: caption(curves), curves: points })
}

/// Returns the values of a column that was read as numbers.
fn numbers(values: &Values) -> &[f64] {
    match values {
        Values::Numbers(numbers) => numbers,
        Values::Texts(_) => unreachable!("the column was read as numbers"),
    }
}

/// Returns the values of a column that was read as texts.
fn texts(values: &Values) -> &[Option<String>] {
    match values {
        Values::Texts(texts) => texts,
        Values::Numbers(_) => unreachable!("the column was read as texts"),
    }
}
