//! `[sweep]` of scenarios: points of parameters.

use bittybuzz_arena::scenario::{Scenario, ScenarioError, SweepSection};
use bittybuzz_arena::sweep::{Chance, ParameterValue, cross};

use crate::script::folder;

fn parse(sweep: &str) -> Result<Option<SweepSection>, Vec<ScenarioError>> {
    let folder = folder("sweeps", &[("s.bzz", "GROUP = 5\nfunction step() {}\n")]);
    let text = format!(
        "[world]\nsize = [600, 600]\nduration = 20\n\
         [[robots]]\nname = \"walkers\"\nrobot = \"kilobot\"\nscript = \"s.bzz\"\n{sweep}"
    );
    let read = Scenario::parse(&text, "test.toml", &folder, &[], &bittybuzz_robot_models::all());
    read.map(|scenario| scenario.sweep)
}

/// The points, each as text, and the number of runs of each.
fn points(sweep: &str) -> (Vec<String>, Option<u32>, Chance) {
    let sweep = parse(sweep).unwrap_or_else(|errors| panic!("{errors:#?}")).unwrap();
    let points = cross(&sweep.axes, 1, 1_000_000).unwrap();
    let text = |point: &Vec<ParameterValue>| {
        point.iter().map(ToString::to_string).collect::<Vec<String>>().join(" ")
    };
    (points.iter().map(text).collect(), sweep.seeds, sweep.chance)
}

fn parameter(key: &str, more: &str) -> String {
    format!("[[sweep.parameter]]\nkey = \"{key}\"\n{more}\n")
}

#[test]
fn a_grid_has_all_combinations() {
    let (points, seeds, chance) = points(&format!(
        "[sweep]\nseeds = 30\nchance = \"common\"\n{}{}",
        parameter("robots.walkers.globals.GROUP", "values = \"3:9:3\""),
        parameter("medium.ir.loss", "name = \"loss\"\nvalues = [0.1, [0.1, 0.2]]"),
    ));
    assert_eq!(points, ["3 0.1", "3 [0.1, 0.2]", "6 0.1", "6 [0.1, 0.2]", "9 0.1", "9 [0.1, 0.2]"]);
    assert_eq!((seeds, chance), (Some(30), Chance::Common));
}

#[test]
fn the_values_of_a_list_vary_together() {
    let (points, seeds, chance) = points(&format!(
        "[sweep]\ndesign = \"list\"\nchance = \"independent\"\n{}{}",
        parameter("robots.walkers.globals.GROUP", "values = [3, 5, 9]"),
        parameter("robots.0.script", "values = [\"s.bzz\", \"t.bzz\", \"3\"]"),
    ));
    assert_eq!(points, ["3 s.bzz", "5 t.bzz", "9 3"]);
    assert_eq!((seeds, chance), (None, Chance::Independent));
}

#[test]
fn points_are_drawn_from_ranges() {
    let of = |design: &str, count: u32| {
        points(&format!(
            "[sweep]\ndesign = \"{design}\"\npoints = {count}\nchance = \"common\"\n{}{}{}",
            parameter("a", "from = 1\nto = 4"),
            parameter("b", "from = 0\nto = 1.0"),
            parameter("c", "values = [\"u\", \"v\"]"),
        ))
        .0
    };
    for design in ["random", "latin-hypercube"] {
        let points = of(design, 40);
        assert_eq!(points.len(), 40);
        for point in &points {
            let words: Vec<&str> = point.split(' ').collect();
            assert!((1..=4).contains(&words[0].parse::<i32>().unwrap()), "{point}");
            let share: f64 = words[1].parse().unwrap();
            assert!((0.0..1.0).contains(&share) && words[1].contains('.'), "{point}");
            assert!(["u", "v"].contains(&words[2]), "{point}");
        }
        assert_eq!(points, of(design, 40));
    }
    assert_eq!(of("random", 60)[..40], of("random", 40));
    let latin = of("latin-hypercube", 40);
    assert_eq!(latin.iter().filter(|point| point.starts_with("3 ")).count(), 10);
}

#[track_caller]
fn fails(sweep: &str, parts: &[&str]) {
    let errors = parse(sweep).expect_err("the sweep has a mistake");
    let lines = errors.iter().map(|error| {
        let line = error.place.as_ref().map_or(0, |place| place.line);
        format!("{line}: {error}; {}\n", error.help().unwrap_or_default())
    });
    let text: String = lines.collect();
    for part in parts {
        assert!(text.contains(part), "{part}\n{text}");
    }
}

#[test]
fn mistakes_name_place_and_remedy() {
    assert_eq!(parse(""), Ok(None));
    let grid = |more: &str| format!("[sweep]\nchance = \"common\"\n{more}");
    fails(
        "[sweep]\n",
        &["8: [sweep] has no `chance`", "8: [sweep] has no parameter; write a [[sweep"],
    );
    fails(
        "[sweep]\nchance = \"comon\"\n",
        &["9: `chance` cannot be \"comon\"; did you mean `common`?"],
    );
    fails(&grid("sedes = 3\n"), &["10: unknown key `sedes` in [sweep]; did you mean `seeds`?"]);
    fails(&grid("seeds = 0\n"), &["10: `seeds` cannot be 0; a whole number from 1 to 1000000"]);
    fails(&grid("points = 3\n"), &["10: `points` means nothing without `design = \"random\""]);
    fails(
        &grid("[[sweep.parameter]]\nvalues = [1]\n"),
        &["10: this [[sweep.parameter]] has no `key`"],
    );
    fails(&grid(&parameter("a", "")), &["10: this [[sweep.parameter]] has no `values`"]);
    fails(
        &grid(&parameter("a", "values = []")),
        &["12: `values` must be a list of one value or more"],
    );
    fails(&grid(&parameter("a", "values = 3")), &["12: `values` must be a list, not an integer"]);
    fails(
        &grid(&parameter("a", "values = \"9:1\"")),
        &["12: the range `9:1` steps away", "FIRST:LAST:STEP"],
    );
    fails(
        &grid(&parameter("a", "values = [1]\nfrom = 3")),
        &["13: `from` means nothing without `design"],
    );
    fails(
        &grid(&parameter("sweep.seeds", "values = [1]")),
        &["11: `sweep.seeds` cannot vary; write a key"],
    );
    fails(&grid(&parameter("", "values = [1]")), &["11: `` cannot vary"]);
    let twice = parameter("a", "values = [1]") + &parameter("a", "values = [2]");
    fails(
        &grid(&twice),
        &["14: a parameter `a` is defined a second time; the first is in line 11"],
    );
    fails(
        &grid(&parameter("a", "name = \"seed\"\nvalues = [1]")),
        &["12: the table of runs has a column `seed`"],
    );
    fails(
        &grid(&parameter("a", "name = \"b c\"\nvalues = [1]")),
        &["12: \"b c\" cannot be the name of a parameter"],
    );
    let lists = parameter("a", "values = [1, 2]") + &parameter("b", "values = [1]");
    fails(
        &format!("[sweep]\nchance = \"common\"\ndesign = \"list\"\n{lists}"),
        &["8: `a` has 2 values and `b` has 1"],
    );
    let drawn = |more: &str| format!("[sweep]\nchance = \"common\"\ndesign = \"random\"\n{more}");
    fails(&drawn(&parameter("a", "from = 1\nto = 2")), &["8: [sweep] has no `points`"]);
    let drawn = |more: &str| drawn(&format!("points = 3\n{}", parameter("a", more)));
    fails(&drawn("from = 1"), &["12: this [[sweep.parameter]] has no `to`"]);
    fails(&drawn("from = 1\nto = 0"), &["15: `to` cannot be 0; a number from 1 on"]);
    fails(&drawn("from = \"a\"\nto = 0"), &["14: `from` must be a number"]);
    fails(&drawn("from = 1\nvalues = [3]"), &["15: `values` and `from` cannot stand together"]);
}
