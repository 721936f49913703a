//! Tests of worlds that are built by hand: each edit changes the text where it must, and the scenario
//! only in the thing that was wanted.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

use bittybuzz_arena::run::start_poses;
use bittybuzz_arena::scenario::{Outline, Scenario, ScenarioError, Shape};
use bittybuzz_compiler::include::MemoryFiles;
use proptest::prelude::*;
use serde_json::{Value, json};

use super::{BuildError, BuiltText, Thing, ThingKind, WorldEdit, apply};

fn parse(text: &str) -> Result<Scenario, Vec<ScenarioError>> {
    let files = MemoryFiles::default().with("s.bzz", "function step() { }");
    let models = bittybuzz_robot_models::all();
    Scenario::parse_in(&files, text, "s.toml".as_ref(), &[], &models)
}

fn built(text: &str, edit: Value) -> Result<BuiltText, BuildError> {
    let edit: WorldEdit = serde_json::from_value(edit).unwrap();
    apply(text, &edit, &parse)
}

/// Returns the text after an edit.
fn after(text: &str, edit: Value) -> String {
    built(text, edit).unwrap().text
}

fn change(kind: &str, number: usize, values: Value) -> Value {
    json!({ "change": { "thing": { "kind": kind, "number": number }, "values": values } })
}

fn copy(kind: &str, number: usize, values: Value) -> Value {
    json!({ "copy": { "thing": { "kind": kind, "number": number }, "values": values } })
}

fn delete(kind: &str, number: usize) -> Value {
    json!({ "delete": { "thing": { "kind": kind, "number": number } } })
}

fn add(kind: &str, values: Value) -> Value {
    json!({ "add": { "kind": kind, "values": values } })
}

fn add_robot(group: usize, values: Value) -> Value {
    json!({ "add": { "kind": "robot", "group": group, "values": values } })
}

/// The start poses of all robots: x, y and degrees.
fn starts(text: &str) -> Vec<[f32; 3]> {
    let scenario = parse(text).unwrap();
    let poses = start_poses(&scenario, scenario.world.seed.into()).unwrap();
    poses.iter().map(|pose| [pose.x, pose.y, pose.heading.to_degrees()]).collect()
}

fn are_close(one: &[f32; 3], other: &[f32; 3]) -> bool {
    let turn = (one[2] - other[2]).rem_euclid(360.0);
    (one[0] - other[0]).abs() < 0.02
        && (one[1] - other[1]).abs() < 0.02
        && turn.min(360.0 - turn) < 0.02
}

/// Checks the starts after an edit: those before, without some, and with others at the end of a group.
fn assert_starts(text: &str, expected: &[[f32; 3]]) {
    let found = starts(text);
    let is_same = found.len() == expected.len()
        && found.iter().zip(expected).all(|(found, expected)| are_close(found, expected));
    assert!(is_same, "{found:?} instead of {expected:?}:\n{text}");
}

const GROUP: &str = "[[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\n";

/// The world of most tests.
fn world(keys: &str, groups: &[&str]) -> String {
    let groups: String = groups.iter().map(|keys| format!("\n{GROUP}{keys}")).collect();
    format!(
        "# A world.\n[world] # of a test\nsize = [1000, 800]\nduration = 10 # s\n{keys}{groups}"
    )
}

const LISTED: &str = "positions = [[0, 0], [100, 0, 90]] # two\nheading = 0\n";

#[test]
fn only_numbers_that_change_are_written() {
    let text = world(
        "obstacles = [{ at = [1.50, 0x10], radius = 2e1 }] # a post\n",
        &["positions = [[100, 100]]\n"],
    );
    let moved = after(&text, change("obstacle", 0, json!({ "at": [1.5, 20.127], "radius": 20.0 })));
    assert_eq!(moved, text.replace("0x10", "20.13"));
    // Nothing changes, so that the text stays.
    assert_eq!(after(&text, change("obstacle", 0, json!({ "at": [1.5, 16.0] }))), text);
}

#[test]
fn walls_are_added_moved_copied_and_deleted() {
    let text = world("", &[LISTED]);
    let wall = json!({ "from": [-200, 100], "to": [200, 100] });
    let one = after(&text, add("obstacle", wall));
    let line = "duration = 10 # s\nobstacles = [{ from = [-200, 100], to = [200, 100] }]\n";
    assert_eq!(one, text.replace("duration = 10 # s\n", line));
    let two = after(&one, copy("obstacle", 0, json!({ "from": [-200, 120], "to": [200, 120] })));
    let both = ", { from = [-200, 120], to = [200, 120] }]";
    assert_eq!(two, one.replace(" }]\n", &format!(" }}{both}\n")));
    let turned = after(&two, change("obstacle", 1, json!({ "from": [0, 120], "to": [0, 300] })));
    assert_eq!(turned, two.replace("[-200, 120]", "[0, 120]").replace("[200, 120]", "[0, 300]"));
    assert_eq!(after(&two, delete("obstacle", 1)), one);
    assert_eq!(after(&one, delete("obstacle", 0)), text.replace("# s\n", "# s\nobstacles = []\n"));
    // An empty list takes the next one.
    let empty = after(&one, delete("obstacle", 0));
    assert_eq!(
        after(&empty, add("obstacle", json!({ "from": [-200, 100], "to": [200, 100] }))),
        one
    );
}

#[test]
fn lists_keep_their_layout_and_their_comments() {
    let ground = "ground = [\n  { at = [0, 0], radius = 50 }, # the nest\n  # A line.\n  \
                  { at = [100, 0], size = [10, 20] } # short\n]\n";
    let text = world(ground, &[LISTED]);
    let added = after(&text, add("patch", json!({ "at": [9, 9], "radius": 5 })));
    let expected = "{ at = [100, 0], size = [10, 20] }, # short\n  { at = [9, 9], radius = 5 },\n]";
    assert_eq!(added, text.replace("{ at = [100, 0], size = [10, 20] } # short\n]", expected));
    let gone = after(&text, delete("patch", 0));
    assert_eq!(gone, text.replace("  { at = [0, 0], radius = 50 }, # the nest\n", ""));
    let gone = after(&text, delete("patch", 1));
    assert_eq!(gone, text.replace("  { at = [100, 0], size = [10, 20] } # short\n", ""));
    let turned = after(&text, change("patch", 1, json!({ "heading": 30, "brightness": 0.5 })));
    let keys = "size = [10, 20], heading = 30, brightness = 0.5 }";
    assert_eq!(turned, text.replace("size = [10, 20] }", keys));
}

#[test]
fn sections_are_lists_too() {
    let text = format!(
        "[world]\nsize = [1000, 800]\nduration = 10\n\n[[world.lights]]\nat = [1, 2] # one\n\n\
         # Another one.\n[[world.lights]]\nat = [3, 4]\nbrightness = 500\n\n{GROUP}{LISTED}"
    );
    let added = after(&text, add("lamp", json!({ "at": [5, 6], "brightness": 9 })));
    let section = "brightness = 500\n\n[[world.lights]]\nat = [5, 6]\nbrightness = 9\n";
    assert_eq!(added, text.replace("brightness = 500\n", section));
    let dim = after(&text, change("lamp", 0, json!({ "brightness": 7 })));
    assert_eq!(dim, text.replace("# one\n", "# one\nbrightness = 7\n"));
    let copied = after(&text, copy("lamp", 1, json!({ "at": [5, 6] })));
    let section = "brightness = 500\n\n[[world.lights]]\nat = [5, 6]\nbrightness = 500\n";
    assert_eq!(copied, text.replace("brightness = 500\n", section));
    let gone = after(&text, delete("lamp", 0));
    assert_eq!(gone, text.replace("[[world.lights]]\nat = [1, 2] # one\n\n#", "#"));
    // Keys of the table itself stand before its sections.
    let wall = after(&text, add("obstacle", json!({ "at": [300, 300], "radius": 9 })));
    let line = "duration = 10\nobstacles = [{ at = [300, 300], radius = 9 }]\n";
    assert_eq!(wall, text.replace("duration = 10\n", line));
}

#[test]
fn a_copy_has_no_comments() {
    let section =
        "[[world.ground]] # the nest\n# In the middle.\nat = [0, 0]\nradius = 20 # small\n";
    for newline in ["\n", "\r\n"] {
        let text = world(section, &[LISTED]).replace('\n', newline);
        let copied = after(&text, copy("patch", 0, json!({ "at": [90, 0] })));
        let added = "small\n\n[[world.ground]]\nat = [90, 0]\nradius = 20\n".replace('\n', newline);
        assert_eq!(copied, text.replace(&format!("small{newline}"), &added));
    }
}

#[test]
fn a_lamp_may_be_a_position() {
    let text = world("lights = [[750, 0x1], [1, 1]]\n", &[LISTED]).replace("1000,", "2000,");
    assert_eq!(
        after(&text, change("lamp", 0, json!({ "at": [700, 1] }))),
        text.replace("750", "700")
    );
    let dim = after(&text, change("lamp", 0, json!({ "brightness": 100 })));
    assert_eq!(dim, text.replace("[750, 0x1]", "{ at = [750, 0x1], brightness = 100 }"));
    assert_eq!(after(&text, delete("lamp", 0)), text.replace("[750, 0x1], ", ""));
    assert_eq!(after(&text, delete("lamp", 1)), text.replace(", [1, 1]", ""));
    assert_eq!(
        after(&text, copy("lamp", 1, json!({ "at": [2, 3] }))),
        text.replace("1]]", "1], [2, 3]]")
    );
}

#[test]
fn movable_discs_are_counted_by_themselves() {
    let text = world(
        "obstacles = [{ at = [0, 300], radius = 9, movable = true }, { at = [0, -300], radius = 9 }]\n",
        &[LISTED],
    );
    let moved = after(&text, change("movable", 0, json!({ "at": [9, 300] })));
    assert_eq!(moved, text.replace("[0, 300]", "[9, 300]"));
    let moved = after(&text, change("obstacle", 0, json!({ "at": [9, -300] })));
    assert_eq!(moved, text.replace("[0, -300]", "[9, -300]"));
    let two = built(&text, copy("movable", 0, json!({ "at": [100, 300] }))).unwrap();
    assert_eq!(two.thing, Some(Thing { kind: ThingKind::Movable, number: 1 }));
    let three = built(&two.text, add("movable", json!({ "at": [0, 200], "radius": 20 }))).unwrap();
    assert_eq!(three.thing, Some(Thing { kind: ThingKind::Movable, number: 2 }));
    assert_eq!(parse(&three.text).unwrap().world.movables.len(), 3);
    assert_eq!(parse(&two.text).unwrap().world.movables.len(), 2);
}

#[test]
fn a_listed_robot_changes_alone() {
    let text = world("", &[LISTED]);
    let moved = after(&text, change("robot", 0, json!({ "at": [-50.5, 7] })));
    assert_eq!(moved, text.replace("[0, 0]", "[-50.5, 7]"));
    let turned = after(&text, change("robot", 0, json!({ "heading": 45 })));
    assert_eq!(turned, text.replace("[0, 0]", "[0, 0, 45]"));
    assert_eq!(
        after(&text, change("robot", 1, json!({ "heading": 45 }))),
        text.replace("90", "45")
    );
    let added = built(&text, add_robot(0, json!({ "at": [200, 0], "heading": 5 }))).unwrap();
    assert_eq!(added.text, text.replace("90]]", "90], [200, 0, 5]]"));
    assert_eq!(added.thing, Some(Thing { kind: ThingKind::Robot, number: 2 }));
    assert_eq!(after(&text, delete("robot", 1)), text.replace(", [100, 0, 90]", ""));
    assert_eq!(after(&text, delete("robot", 0)), text.replace("[0, 0], ", ""));
}

#[test]
fn the_count_follows_the_list() {
    let text =
        world("", &["count = 2 # robots\npositions = [\n  [0, 0],\n  [100, 0],\n]\nheading = 0\n"]);
    let added = after(&text, add_robot(0, json!({ "at": [200, 0] })));
    let expected =
        text.replace("count = 2", "count = 3").replace("[100, 0],\n", "[100, 0],\n  [200, 0],\n");
    assert_eq!(added, expected);
    assert_eq!(after(&added, delete("robot", 2)), text);
}

#[test]
fn a_grid_becomes_a_list() {
    let grid =
        "count = 4 # robots\nplacement = \"grid\" # a square\nspacing = 60\nheading = 0\n# end\n";
    let text = world("", &[grid]);
    let moved = after(&text, change("robot", 3, json!({ "at": [100, 100] })));
    let list = "positions = [[-30, -30], [30, -30], [-30, 30], [100, 100]]\nheading = 0\n# end\n";
    assert_eq!(moved, text.replace(grid, list));
    let added = after(&text, add_robot(0, json!({ "at": [100, 100] })));
    assert_starts(&added, &[&starts(&text)[..], &[[100.0, 100.0, 0.0]]].concat());
}

#[test]
fn random_robots_stay_where_they_are() {
    let groups = [
        "count = 30\narea = [500, 500]\n",
        "count = 3\n",
        "count = 2\nplacement = \"line\"\nat = [400, 380]\nspacing = 50\n",
    ];
    let text = world("", &groups);
    let before = starts(&text);
    let expected = |at: usize, with: Option<[f32; 3]>| {
        let mut expected = before.clone();
        expected.splice(at..=at, with);
        expected
    };
    let moved = after(&text, change("robot", 7, json!({ "at": [-400, 380] })));
    let [_, _, heading] = before[7];
    assert_starts(&moved, &expected(7, Some([-400.0, 380.0, heading])));
    // The long list is broken into lines.
    assert!(moved.lines().all(|line| line.len() <= 100), "{moved}");
    for robot in [0, 7, 29, 31, 33] {
        assert_starts(&after(&text, delete("robot", robot)), &expected(robot, None));
    }
    // A place at which a robot of another group happens to start is taken.
    let [x, y, _] = before[31];
    let error = built(&text, change("robot", 3, json!({ "at": [x, y] }))).unwrap_err();
    assert!(error.to_string().contains("overlap"), "{error}");
}

#[test]
fn the_last_robot_of_a_group_takes_it_along() {
    let other = "positions = [[200, 0]]\n[robots.model]\nspeed_error = 0 # exact\n";
    let text = world("", &[LISTED, other, "count = 3\n"]);
    let before = starts(&text);
    let gone = after(&text, delete("robot", 2));
    assert!(
        !gone.contains("exact") && gone.starts_with("# A world.\n[world] # of a test\n"),
        "{gone}"
    );
    // Random numbers of the third group are now those of the second one.
    assert_starts(&gone, &[&before[..2], &before[3..]].concat());
    let one = world("", &["positions = [[0, 0]]\n"]);
    assert!(matches!(built(&one, delete("robot", 0)), Err(BuildError::LastRobot)));
}

#[test]
fn inline_groups_are_changed_too() {
    let text = "[world]\nsize = [1000, 800]\nduration = 10\n".to_owned();
    let group = "{ robot = \"kilobot\", script = \"s.bzz\", count = 2, placement = \"line\", spacing = 50, heading = 0 }";
    let text = format!("robots = [{group}]\n{text}");
    let moved = after(&text, change("robot", 1, json!({ "at": [80, 0] })));
    let list =
        "{ robot = \"kilobot\", script = \"s.bzz\", heading = 0, positions = [[0, 0], [80, 0]] }";
    assert_eq!(moved, text.replace(group, list));
}

#[test]
fn windows_line_breaks_stay() {
    let text =
        world("lights = [\n  [1, 1],\n]\n", &["count = 2\nplacement = \"line\"\nspacing = 50\n"])
            .replace('\n', "\r\n");
    for edit in [
        add("lamp", json!({ "at": [5, 5] })),
        add("obstacle", json!({ "from": [-300, 300], "to": [300, 300] })),
        change("robot", 0, json!({ "at": [-100, 0] })),
        delete("lamp", 0),
    ] {
        let text = after(&text, edit);
        assert_eq!(text.matches('\n').count(), text.matches("\r\n").count(), "{text:?}");
    }
}

#[test]
fn mistakes_are_refused() {
    let text = world("obstacles = [{ at = [300, 0], radius = 50 }]\n", &[LISTED]);
    let error = |edit| built(&text, edit).unwrap_err().to_string();
    assert!(error(change("robot", 0, json!({ "at": [100, 0] }))).contains("overlap"));
    assert!(
        error(change("robot", 0, json!({ "at": [300, 0] }))).contains("would stand in an obstacle")
    );
    assert!(error(change("robot", 0, json!({ "at": [5000, 0] }))).contains("outside the world"));
    assert!(
        error(add("obstacle", json!({ "from": [0, -50], "to": [0, 50] })))
            .contains("in an obstacle")
    );
    assert!(error(add_robot(0, json!({}))).contains("needs a place"));
    assert!(error(add_robot(5, json!({ "at": [0, 200] }))).contains("no such thing"));
    assert!(error(delete("lamp", 0)).contains("no such thing"));
    assert!(error(change("robot", 2, json!({ "at": [0, 200] }))).contains("no such thing"));
    assert!(error(add("lamp", json!({ "at": [0, 0], "brightness": 5000 }))).contains("brightness"));
    // The ids of the robots after it are one less, and an event names the last one.
    let events = format!("{text}[[event]]\nat = 1\nfail = 1\n");
    assert!(
        built(&events, delete("robot", 0)).unwrap_err().to_string().contains("there is no robot 1")
    );
}

/// A scenario with comments, and with things in the notations that the file may have.
fn scenarios() -> impl Strategy<Value = String> {
    let lists = prop::sample::select(vec![
        "",
        "obstacles = []\nlights = []\nground = []\n",
        "obstacles = [{ from = [-400, 350], to = [400, 350] }] # c0\nlights = [[1, 2], { at = [3, 4] }] # c1\n",
        "ground = [\n  # c2\n  { at = [0, 0], radius = 50 },\n  { at = [9, 9], size = [50, 9] }, # c3\n]\n",
        "lights = [ [1, 2], # c4\n  [3, 4] ]\nobstacles = [\n  { at = [0, 380], radius = 9 },\n  # c5\n  { at = [300, 380], radius = 9, movable = true }\n  # c6\n]\n",
        "\n[[world.ground]] # c7\nat = [0, 0]\nradius = 20\n\n[[world.lights]]\nat = [5, 5]\n",
    ]);
    let group = prop::sample::select(vec![
        "count = 5\n",
        "# c8\ncount = 3\nname = \"a\" # c9\narea = [300, 300]\nheading = 20\n",
        "placement = \"circle\"\nradius = 150\ncount = 6\n",
        "positions = [[-300, -300], [-200, -300, 30]] # c10\n",
        "positions = [\n  [-300, -300], # c11\n  [-200, -300, 30],\n]\ncount = 2\nheading = \"random\"\n",
    ]);
    (lists, prop::collection::vec(group, 1..3), 0u32..50).prop_filter_map(
        "the scenario is valid",
        |(lists, groups, seed)| {
            let text = world(&format!("seed = {seed}\n{lists}"), &groups);
            let scenario = parse(&text).ok()?;
            start_poses(&scenario, seed.into()).ok().map(|_| text)
        },
    )
}

fn edits() -> impl Strategy<Value = Value> {
    let kinds = prop::sample::select(vec!["robot", "obstacle", "movable", "lamp", "patch"]);
    (kinds, 0..4, 0usize..9, -480..480, -380..380, -180..180).prop_map(
        |(kind, act, number, x, y, heading)| {
            let values = match kind {
                "robot" => json!({ "at": [x, y], "heading": heading }),
                "patch" | "lamp" => json!({ "at": [x, y], "brightness": 0.5 }),
                _ => json!({ "at": [x, y] }),
            };
            match (act, kind) {
                (0, "robot") => add_robot(number % 2, values),
                (0, "patch") => {
                    add(kind, json!({ "at": [x, y], "size": [30, 20], "heading": heading }))
                }
                (0, "obstacle") => add(kind, json!({ "from": [x, y], "to": [y, x] })),
                (0, _) => add("lamp", values),
                (1, _) => delete(kind, number),
                (2, _) => copy(kind, number, values),
                (_, _) => change(kind, number, values),
            }
        },
    )
}

/// The comments that have a line of their own.
fn own_comments(text: &str) -> Vec<&str> {
    text.lines().map(str::trim).filter(|line| line.starts_with('#')).collect()
}

fn center(outline: Outline) -> [f64; 2] {
    match outline {
        Outline::Shape(Shape::Disc { at, .. } | Shape::Block { at, .. }) => at,
        Outline::Wall(from, _) => from,
    }
}

proptest! {
    #[test]
    fn an_edit_changes_the_scenario_only_in_the_thing(text in scenarios(), edit in edits()) {
        let parsed: WorldEdit = serde_json::from_value(edit.clone()).unwrap();
        let Ok(BuiltText { text: built, .. }) = apply(&text, &parsed, &parse) else { return Ok(()) };
        let (old, new) = (parse(&text).unwrap(), parse(&built).unwrap());
        let (mut one, mut other) = (old.world.clone(), new.world.clone());
        let (kind, number) = match parsed {
            WorldEdit::Add { kind, .. } => (kind, usize::MAX),
            WorldEdit::Copy { thing, .. } => (thing.kind, usize::MAX),
            WorldEdit::Change { thing, .. } | WorldEdit::Delete { thing } => (thing.kind, thing.number),
        };
        let (is_change, is_deletion) = (edit.get("change").is_some(), edit.get("delete").is_some());
        // Both without the thing are the same; an addition comes last.
        fn leave_out<T>(one: &mut Vec<T>, other: &mut Vec<T>, number: usize, [is_change, is_deletion]: [bool; 2]) {
            if is_change || is_deletion {
                one.remove(number);
            }
            match is_deletion {
                true => {}
                false if is_change => drop(other.remove(number)),
                false => drop(other.pop()),
            }
        }
        let way = [is_change, is_deletion];
        let at = edit.pointer("/change/values/at").map(|at| {
            [at[0].as_f64().unwrap(), at[1].as_f64().unwrap()]
        });
        match kind {
            ThingKind::Robot => {
                let mut starts_before = starts(&text);
                let mut starts_after = starts(&built);
                let sizes: Vec<usize> = old.groups.iter().map(|group| group.count as usize).collect();
                let added_to = match parsed {
                    WorldEdit::Add { group, .. } => group,
                    WorldEdit::Copy { thing, .. } => super::robots::group_of(&old, thing.number),
                    _ => None,
                };
                if let Some(group) = added_to {
                    starts_after.remove(sizes[..=group].iter().sum());
                } else {
                    starts_before.remove(number);
                    if is_change {
                        starts_after.remove(number);
                    }
                }
                prop_assert_eq!(starts_before.len(), starts_after.len());
                for (before, after) in starts_before.iter().zip(&starts_after) {
                    prop_assert!(are_close(before, after), "{:?} {:?}\n{}\n{}", before, after, text, built);
                }
            }
            ThingKind::Obstacle => {
                if let Some(at) = at.filter(|_| is_change) {
                    prop_assert!(matches!(one.obstacles[number].outline, Outline::Wall(..)) || center(other.obstacles[number].outline) == at);
                }
                leave_out(&mut one.obstacles, &mut other.obstacles, number, way);
            }
            ThingKind::Movable => leave_out(&mut one.movables, &mut other.movables, number, way),
            ThingKind::Lamp => {
                if let Some(at) = at {
                    prop_assert_eq!(other.lights[number].at, at);
                }
                leave_out(&mut one.lights, &mut other.lights, number, way);
            }
            ThingKind::Patch => leave_out(&mut one.ground, &mut other.ground, number, way),
        }
        prop_assert_eq!(one, other);
        // Comments stay, except on lines that were removed and in a group or section that is gone.
        if !is_deletion {
            prop_assert_eq!(own_comments(&text), own_comments(&built), "{}", built);
        }
        if kind != ThingKind::Robot && !is_deletion {
            prop_assert_eq!(text.matches('#').count(), built.matches('#').count());
        }
    }
}
