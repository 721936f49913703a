//! Measures are the numbers that their definitions give, worked out by hand or computed here from
//! the robots' places.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use bittybuzz_arena::output::metrics::{self, MetricKind};
use bittybuzz_arena::run::{Setup, Simulation, Summary};
use bittybuzz_arena::scenario::{OWN_COLUMNS, Quantity, Scenario};

use crate::script::{folder, read, run, run_with, setup_errors};

/// Robots that stand still. `v` is the square of the id, `w` is nil in odd robots, and `word` is a
/// string.
const STILL: &str = "v = id * id\nword = \"odd\"\nn = 0\n\
    if(id % 2 == 0) { w = id\n word = \"even\" }\n\
    function step() { n = n + 1 }\n";

/// Five robots 100 mm apart, and two at other distances; ids 0 to 6.
const ROBOTS: &str = "[[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\nheading = 0\n\
    positions = [[0, 0], [100, 0], [200, 0], [300, 0], [400, 0], [0, 300], [60, 300]]\n";

fn measured(text: &str, summary: &Summary, folder: &Path) -> BTreeMap<String, Option<f64>> {
    let (scenario, _) = read(folder, text);
    let names = scenario.measures.iter().map(|measure| measure.name.clone());
    names.zip(summary.measures.iter().copied()).collect()
}

/// The measures of a run of two seconds, by name.
#[track_caller]
fn of(test: &str, more: &str) -> BTreeMap<String, Option<f64>> {
    let folder = folder(&format!("measures_{test}"), &[("s.bzz", STILL)]);
    let text = format!("[world]\nsize = [2000, 2000]\nduration = 2\n{ROBOTS}{more}");
    let summary = run(&folder, &text);
    measured(&text, &summary, &folder)
}

#[track_caller]
fn close(found: Option<f64>, expected: f64) {
    let found = found.unwrap();
    assert!((found - expected).abs() < 1e-9 * expected.abs().max(1.0), "{found}, not {expected}");
}

fn measure(name: &str, keys: &str) -> String {
    format!("[[measure]]\nname = \"{name}\"\n{keys}\n")
}

#[test]
fn aggregates_of_known_values() {
    // v is 0, 1, 4, 9, 16, 25, 36 (sum 91, mean 13); w is 0, 2, 4, 6 in four robots.
    let cases = [
        ("mean(global.v)", 13.0),
        ("sum(global.v)", 91.0),
        ("min(global.v)", 0.0),
        ("max(global.v)", 36.0),
        ("spread(global.v)", 36.0),
        ("different(global.word)", 2.0),
        ("median(global.v)", 9.0),
        // numpy.quantile([0, 1, 4, 9, 16, 25, 36], [0.25, 0.75, 0.9])
        ("lower_quartile(global.v)", 2.5),
        ("upper_quartile(global.v)", 20.5),
        ("quantile(0.9, global.v)", 29.4),
        // The deviations from 13 are -13, -12, -9, -4, 3, 12, 23: the squares sum up to 1092.
        ("sd(global.v)", (1092.0_f64 / 6.0).sqrt()),
        // 0, 1, 16, 81, 256, 625, 1296
        ("mean_square(global.v)", 2275.0 / 7.0),
        // Robots without a value are left out.
        ("mean(global.w)", 3.0),
        ("share(global.w > 2)", 0.5),
        ("count(global.w > 2)", 2.0),
        ("share(global.v >= 9)", 4.0 / 7.0),
        ("share(global.v == 9)", 1.0 / 7.0),
        ("share(global.v != 9)", 6.0 / 7.0),
        ("share(global.word == 'even')", 4.0 / 7.0),
        ("share(global.v > 8 where global.word == 'odd')", 2.0 / 3.0),
        ("mean(global.v where x <= 100)", (0.0 + 1.0 + 25.0 + 36.0) / 4.0),
        ("count(running where led)", 0.0),
        ("share(running)", 1.0),
        // The edges belong to the area.
        ("count(inside(200, 0, 100))", 3.0),
        ("count(inside(200, 0, 200, 10))", 3.0),
        ("share(inside(0, 300, 60))", 2.0 / 7.0),
        ("count(inside(900, 900, 5))", 0.0),
    ];
    let sections: Vec<String> = cases
        .iter()
        .enumerate()
        .map(|(index, (value, _))| measure(&format!("m{index}"), &format!("value = \"{value}\"")))
        .collect();
    let found = of("aggregates", &sections.concat());
    for (index, (value, expected)) in cases.iter().enumerate() {
        println!("{value}");
        close(found[&format!("m{index}")], *expected);
    }
}

#[test]
fn the_word_of_is_the_same_as_the_text() {
    let found = of(
        "of",
        &[
            measure("key", "value = \"global.v\"\nof = \"median\"\nrobots = \"1..4\""),
            measure("text", "value = \"median(global.v)\"\nrobots = \"1..4\""),
            measure("swarm", "value = \"swarm.spread\"\nrobots = [0, 1]"),
        ]
        .concat(),
    );
    close(found["key"], 6.5);
    close(found["text"], 6.5);
    close(found["swarm"], 50.0);
}

#[test]
fn a_group_without_values_has_no_number() {
    let found = of(
        "empty",
        &[
            measure("mean", "value = \"mean(x where led)\""),
            measure("share", "value = \"share(running where led)\""),
            measure("count", "value = \"count(x > 0 where led)\""),
            measure("sd", "value = \"sd(x)\"\nrobots = 3"),
            measure("cluster", "value = \"swarm.cluster(100)\"\nrobots = 3"),
            measure("strings", "value = \"mean(global.word)\""),
        ]
        .concat(),
    );
    let expected = [
        ("mean", None),
        ("share", None),
        ("count", Some(0.0)),
        ("sd", None),
        ("cluster", Some(1.0)),
        ("strings", None),
    ];
    for (name, number) in expected {
        assert_eq!(found[name], number, "{name}");
    }
}

/// 0.0 / 0.0 is a float that is no number.
#[test]
fn nan_is_no_number() {
    let script = "z = 0.0\nv = 2.0\nif(id == 0) v = z / z\nfunction step() {}\n";
    let folder = folder("measures_nan", &[("s.bzz", script)]);
    let text = format!(
        "[world]\nsize = [2000, 2000]\nduration = 1\n{ROBOTS}{}{}{}{}",
        measure("mean", "value = \"mean(global.v)\""),
        measure("median", "value = \"median(global.v)\""),
        measure("share", "value = \"share(global.v == 2)\""),
        measure("below", "value = \"count(global.v < 3)\"")
    );
    let found = measured(&text, &run(&folder, &text), &folder);
    close(found["mean"], 2.0);
    close(found["median"], 2.0);
    // The robot has a value, which is not 2.
    close(found["share"], 6.0 / 7.0);
    close(found["below"], 6.0);
}

#[test]
fn the_largest_cluster_is_connected_by_the_distance() {
    let sections: Vec<String> = [59, 60, 99, 100, 299, 300]
        .iter()
        .map(|distance| {
            measure(&format!("d{distance}"), &format!("value = \"swarm.cluster({distance})\""))
        })
        .collect();
    let found = of("cluster", &sections.concat());
    // The pair is 60 mm apart, the row 100 mm, and 300 mm are between them.
    for (name, robots) in
        [("d59", 1.0), ("d60", 2.0), ("d99", 2.0), ("d100", 5.0), ("d299", 5.0), ("d300", 7.0)]
    {
        assert_eq!(found[name], Some(robots), "{name}");
    }
}

#[test]
fn robots_that_failed_and_robots_that_are_absent() {
    let more = "[[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\npresent = false\n\
        positions = [[500, 500]]\n[[event]]\nat = 1\nfail = [0, 1]\n";
    let found = of(
        "failed",
        &[
            more.to_owned(),
            // The absent robot has no value. A failed robot keeps its place and its globals.
            measure("running", "value = \"share(running)\""),
            measure("all", "value = \"share(global.v < 2)\""),
            measure("among", "value = \"share(global.v < 10 where running)\""),
            measure("here", "value = \"count(inside(0, 0, 1000))\""),
        ]
        .concat(),
    );
    close(found["running"], 5.0 / 7.0);
    close(found["all"], 2.0 / 7.0);
    close(found["among"], 2.0 / 5.0);
    close(found["here"], 7.0);
}

#[test]
fn times_numbers_and_truths() {
    let found = of(
        "times",
        &[
            // The first tick runs the global code, so n is 1 after the second one, at 0.2 s.
            measure("reached", "value = \"global.n\"\nabove = 4"),
            measure("never", "value = \"global.n\"\nabove = 400"),
            measure("one", "value = \"global.v\"\nof = \"one\"\nequals = 36"),
            measure("agree", "value = \"global.n\"\nof = \"agree\""),
            measure("share", "value = \"share(global.n >= 3)\"\nabove = 0.5"),
            measure("at_start", "value = \"mean(x)\"\nat = 0"),
            measure("nil", "value = \"mean(global.n)\"\nat = 0"),
            measure("at", "value = \"mean(global.n)\"\nat = 1.5"),
            measure("end", "value = \"mean(global.n)\"\nat = \"end\""),
            measure("true_then", "value = \"global.n\"\nabove = 4\nat = 1.5"),
            measure("false_then", "value = \"global.n\"\nabove = 4\nat = 0.3"),
            measure("true_at_end", "value = \"global.n\"\nequals = 19\nat = \"end\""),
        ]
        .concat(),
    );
    let mean_x = (100.0 + 200.0 + 300.0 + 400.0 + 60.0) / 7.0;
    for (name, number) in [
        ("reached", Some(0.6)),
        ("never", None),
        ("one", Some(0.1)),
        ("agree", Some(0.1)),
        ("share", Some(0.4)),
        ("nil", None),
        ("at", Some(14.0)),
        ("end", Some(19.0)),
        ("true_then", Some(1.0)),
        ("false_then", Some(0.0)),
        ("true_at_end", Some(1.0)),
    ] {
        assert_eq!(found[name], number, "{name}");
    }
    close(found["at_start"], mean_x);
}

/// The mean squared displacement is that of the places that an observer of the run sees.
#[test]
fn the_mean_squared_displacement_is_that_of_the_places() {
    let walk = "function step() { if(rand() % 3 == 0) left() else forward() }\n";
    let folder = folder("measures_msd", &[("s.bzz", walk)]);
    let text = format!(
        "[world]\nsize = [4000, 4000]\nduration = 30\n{ROBOTS}{}{}{}\
         [output]\nplot = [\"mean_square(displacement)\", \"max(displacement(20))\"]\n",
        measure("msd", "value = \"mean_square(displacement)\""),
        measure("later", "value = \"displacement(12.5)\"\nof = \"mean_square\""),
        measure("before", "value = \"mean(displacement(12.5))\"\nat = 12.4"),
    );
    let places = |run: &Simulation| -> Vec<[f64; 2]> {
        let views = (0..run.robot_count()).map(|robot| run.view(robot).unwrap().pose);
        views.map(|pose| [pose.x, pose.y].map(f64::from)).collect()
    };
    let (mut seen, mut curve) = (Vec::new(), Vec::new());
    let quantity = Quantity::parse("mean_square(displacement)").unwrap();
    let summary = run_with(&folder, &text, 1, |run| {
        seen.push(places(run));
        let probe = run.setup().probe(&quantity).unwrap();
        curve.push(run.numbers(&probe));
    });
    let msd = |from: &[[f64; 2]], to: &[[f64; 2]]| {
        let squared =
            from.iter().zip(to).map(|(a, b)| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2));
        squared.sum::<f64>() / from.len() as f64
    };
    let start = [[0, 0], [100, 0], [200, 0], [300, 0], [400, 0], [0, 300], [60, 300]]
        .map(|at| at.map(f64::from));
    let found = measured(&text, &summary, &folder);
    let last = seen.last().unwrap();
    // Robots that walked for half a minute are somewhere else.
    assert!(msd(&start, last) > 1000.0, "{}", msd(&start, last));
    close(found["msd"], msd(&start, last));
    // The first tick ends at 0.1 s.
    close(found["later"], msd(&seen[124], last));
    assert_eq!(found["before"], None);
    assert_eq!(curve.len(), seen.len());
    for (numbers, places) in curve.iter().zip(&seen) {
        assert_eq!(numbers.len(), 1);
        close(numbers[0], msd(&start, places));
    }
    // In the picture and in the table it is one curve.
    assert_eq!(summary.values[0].map(|[mean, ..]| mean), found["msd"]);
    let (scenario, _) = read(&folder, &text);
    let names: Vec<String> =
        metrics::metrics(&scenario).into_iter().map(|metric| metric.name).collect();
    assert!(names.contains(&"max(displacement(20))".to_owned()), "{names:?}");
}

/// A copy of a run, and one that is taken back, have the same measures.
#[test]
fn a_snapshot_has_the_measures_so_far() {
    let folder =
        folder("measures_snapshot", &[("s.bzz", "n = 0\nfunction step() { n = n + 1 forward() }")]);
    let text = format!(
        "[world]\nsize = [4000, 4000]\nduration = 4\n{ROBOTS}{}{}{}",
        measure("first", "value = \"global.n\"\nabove = 4"),
        measure("at", "value = \"mean(x)\"\nat = 1"),
        measure("moved", "value = \"max(displacement(1))\""),
    );
    let (scenario, programs) = read(&folder, &text);
    let setup = Arc::new(Setup::new(scenario, programs).unwrap());
    let mut run = Simulation::new(setup, 1, 1).unwrap();
    (0..20).for_each(|_| run.tick().unwrap());
    let mut copy = run.snapshot().unwrap();
    for run in [&mut run, &mut copy] {
        (0..20).for_each(|_| run.tick().unwrap());
    }
    let measures = run.summary().measures;
    assert!(measures.iter().all(Option::is_some), "{measures:?}");
    assert_eq!(copy.summary().measures, measures);
}

#[test]
fn an_expectation_takes_an_aggregate() {
    let folder = folder("measures_expect", &[("s.bzz", STILL)]);
    let text = format!(
        "[world]\nsize = [2000, 2000]\nduration = 2\n{ROBOTS}\
         [[expect]]\nat = 1\nvalue = \"share(global.v > 8 where running)\"\nabove = 0.5\n\
         [[expect]]\nat = 1\nvalue = \"global.v\"\nof = \"median\"\nequals = 9\n\
         [[expect]]\nat = 1\nvalue = \"median(global.v)\"\nrobots = \"0..2\"\nequals = 1\n"
    );
    let (scenario, _) = read(&folder, &text);
    let texts: Vec<String> = scenario.expects.iter().map(ToString::to_string).collect();
    assert_eq!(
        texts,
        [
            "share(global.v > 8 where running) above 0.5, at 1 s",
            "median of global.v equals 9, at 1 s",
            "median(global.v) of robots 0 to 2 equals 1, at 1 s",
        ]
    );
    assert!(run(&folder, &text).is_success());
}

#[test]
fn the_columns_of_measures_have_a_meaning() {
    let folder = folder("measures_columns", &[("s.bzz", STILL)]);
    let text = format!(
        "[world]\nsize = [2000, 2000]\nduration = 2\n{ROBOTS}{}{}{}[[expect]]\nwithin = 1\n\
         value = \"x\"\nbelow = -5\n",
        measure("m1", "value = \"mean(x)\""),
        measure("m2", "value = \"x\"\nabove = 3"),
        measure("m3", "value = \"x\"\nabove = 3\nat = \"end\""),
    );
    let (scenario, _) = read(&folder, &text);
    let columns = metrics::metrics(&scenario);
    let kinds: Vec<(&str, MetricKind)> =
        columns.iter().map(|column| (column.name.as_str(), column.kind)).take(8).collect();
    use MetricKind::{Held, Number, Success, Time, Truth};
    assert_eq!(
        kinds,
        [
            ("success", Success),
            ("failed", Number),
            ("m1", Number),
            ("m2", Time),
            ("m3", Truth),
            ("held.0", Held),
            ("first.0", Time),
            ("since.0", Time),
        ]
    );
    let values = metrics::values(&scenario, &run(&folder, &text));
    assert_eq!(values.len(), columns.len());
    // The expectation does not hold.
    assert_eq!(values[..2], [Some(0.0), Some(1.0)]);
    // A measure cannot have the name of a column that every table has, as CSV or as one of `--data`.
    let others = ["run", "seed", "ticks", "robots", "digest", "error"];
    let names = others.into_iter().chain(columns.iter().map(|column| &*column.name));
    let mut own: Vec<&str> = names
        .filter(|name| !name.starts_with('m') || *name == "malformed")
        .filter(|name| !name.contains('.'))
        .collect();
    own.sort_unstable();
    let mut known = OWN_COLUMNS.to_vec();
    known.sort_unstable();
    assert_eq!(own, known);
}

#[track_caller]
fn fails(more: &str, parts: &[&str]) {
    let folder = folder("measures_mistakes", &[("s.bzz", STILL)]);
    let text = format!("[world]\nsize = [2000, 2000]\nduration = 2\n{ROBOTS}{more}");
    let read = Scenario::parse(&text, "test.toml", &folder, &[], &bittybuzz_robot_models::all());
    let errors = match read {
        Err(errors) => errors,
        Ok(_) => setup_errors(&folder, &text),
    };
    let described: Vec<String> = errors
        .iter()
        .map(|error| {
            let line = error.place.as_ref().map_or(0, |place| place.line);
            format!("{line}: {error}; {}", error.help().unwrap_or_default())
        })
        .collect();
    let described = described.join("\n");
    for part in parts {
        assert!(described.contains(part), "{part}\n{described}");
    }
}

#[test]
fn mistakes_name_place_and_remedy() {
    let of = |keys: &str| measure("m", keys);
    // The section is in lines 9 to 11.
    fails("[[measure]]\nvalue = \"x\"\n", &["9: this [[measure]] has no `name`"]);
    fails(&measure("seed", "value = \"mean(x)\""), &["10: the table of runs has a column `seed`"]);
    fails(&measure("2x", "value = \"mean(x)\""), &["\"2x\" cannot be the name of a measure"]);
    fails(
        &[of("value = \"mean(x)\""), of("value = \"mean(y)\"")].concat(),
        &["13: a measure `m` is defined a second time; the first is in line 10"],
    );
    fails(&of("value = \"x\""), &["11: each robot has a `x`", "of = \"mean\"", "share(x == 1)"]);
    fails(&of("value = \"x\"\nof = \"any\""), &["12: each robot has a `x`"]);
    fails(&of("value = \"mean(x)\"\nof = \"mean\""), &["12: `of` means nothing here"]);
    fails(&of("value = \"mean(x)\"\nat = 3"), &["12: `at` is not within the run"]);
    fails(
        &of("value = \"mean(x)\"\nat = \"start\""),
        &["12: `at` cannot be \"start\"; one of end"],
    );
    fails(&of("value = \"mean(x)\"\nwithin = 1"), &["12: unknown key `within`"]);
    fails(&of("value = \"mean(x)\"\ntolerance = 1"), &["12: `tolerance` means nothing without"]);
    fails(&of("value = \"mean(displacement(3))\""), &["11: `displacement` is not within the run"]);
    fails(&of("value = \"mean(displacement(0.55))\""), &["11: ", "0.5 and 0.6 are the nearest"]);
    fails(&of("value = \"mean(global.u)\""), &["11: no script has a global `u`"]);
    fails(&of("value = \"mean(x where global.u > 1)\""), &["11: no script has a global `u`"]);
    fails(&of("value = \"share(x = 1)\""), &["11: there is no quantity", "share(CONDITION)", "=="]);
    fails(&of("value = \"quantile(x)\""), &["11: there is no quantity", "quantile(0.9, x"]);
    fails(&of("value = \"meen(x)\""), &["11: there is no quantity `meen(x)`; did you mean `mean("]);
    fails(&of("value = 3"), &["11: `value` must be a string"]);
    fails("[output]\nplot = [\"mean(swarm.spread)\"]\n", &["10: there is no quantity", "mean("]);
    fails("[measure]\nname = \"m\"\n", &["`measure` must be a list"]);
}

/// A quantity that is asked for during a run cannot need places from before.
#[test]
fn a_displacement_from_a_time_that_no_section_names_is_refused() {
    let folder = folder("measures_places", &[("s.bzz", STILL)]);
    let text = format!("[world]\nsize = [2000, 2000]\nduration = 2\n{ROBOTS}");
    let (scenario, programs) = read(&folder, &text);
    let setup = Setup::new(scenario, programs).unwrap();
    let probe = |text: &str| setup.probe(&Quantity::parse(text).unwrap());
    assert!(probe("mean(displacement)").is_ok());
    let error = probe("mean(displacement(1))").unwrap_err();
    assert!(error.to_string().contains("places of robots that this run does not keep"), "{error}");
    assert!(error.help().unwrap().contains("[[measure]]"));
}
