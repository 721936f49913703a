//! Sizes, places, headings, ids and links of imported experiments.

use super::{ROBOT, experiment, folder, foot_bot, import, robots};
use crate::support::Folder;

/// The center of the arena, (10, 5) m, becomes (0, 0).
const MOVED: &str = r#"<argos-configuration>
  <framework><experiment length="12.5" ticks_per_second="10" random_seed="3"/></framework>
  <controllers>
    <buzz_controller_footbot id="walk">
      <params bytecode_file="walk.bo" debug_file="walk.bdb" />
    </buzz_controller_footbot>
  </controllers>
  <arena size="4, 2, 1" center="10,5,0.5">
    <box id="north" size="4,0.1,0.5" movable="false"><body position="10,6,0" orientation="0,0,0"/></box>
    <box id="upright" size="0.4,0.2,0.5" movable="false"><body position="9,5,0" orientation="90,0,0"/></box>
    <box id="half turn" size=".4,.2,.5" movable="false"><body position="9.5,5,-0.2" orientation="-180,0,0"/></box>
    <cylinder id="pole" radius="0.15" height="0.3" movable="false"><body position="11.255,4.275,0"/></cylinder>
    <light id="lamp" position="11,5.5,1" orientation="0,0,0" color="yellow" intensity="1.0" medium="leds"/>
    <light id="off" position="9,4.5,1" orientation="0,0,0" color="yellow" intensity="0" medium="leds"/>
    <foot-bot id="fb0"><body position="10,5,0" orientation="450,0,0"/><controller config="walk"/></foot-bot>
  </arena>
</argos-configuration>
"#;

const MOVED_SCENARIO: &str = r#"# The experiment field.argos, imported by `bbz import`.
# docs/argos.md describes the import, and docs/scenario.md all keys.

[world]
size = [4000, 2000]
duration = 12.5
seed = 3
obstacles = [
    { at = [0, 1000], size = [4000, 100], height = 500 }, # north
    { at = [-1000, 0], size = [200, 400], height = 500 }, # upright
    { at = [-500, 0], size = [400, 200], height = 300 }, # half turn
    { at = [1255, -725], radius = 150, height = 300 }, # pole
]
lights = [
    { at = [1000, 500], brightness = 1023 }, # lamp
    { at = [-1000, -500], brightness = 0 }, # off
]

[[robots]]
name = "fb0"
robot = "rover.toml"
script = "walk.bzz"
positions = [[0, 0]]
heading = 90
"#;

#[test]
fn the_center_of_the_arena_becomes_the_origin() {
    let folder = folder("import_moved", "");
    folder.write("field.argos", MOVED);
    import(&folder).succeeds_with(MOVED_SCENARIO);
    let written = ["import", "field.argos", "-o", "field.toml", "--robot", ROBOT];
    folder.bbz(&written).succeeds_with("");
    assert_eq!(String::from_utf8(folder.read("field.toml")).unwrap(), MOVED_SCENARIO);
    let run = folder.bbz(&["sim", "field.toml"]);
    assert_eq!((run.status, run.stderr.as_str()), (Some(0), ""));
    assert!(run.stdout.contains("1 robots, 12.5 s, seed 3"), "{}", run.stdout);
}

/// Half a turn leaves a box as it is: 211.3 degrees are 31.3.
#[test]
fn turned_boxes_have_a_heading() {
    for orientation in ["31.3", "211.3", "-148.7"] {
        let entities = foot_bot("fb0", "-1,0,0")
            + "<box id=\"b\" size=\"0.4,0.2,0.5\" movable=\"false\"><body position=\"1,0,0\" orientation=\""
            + orientation
            + ",0,0\"/></box>";
        let outcome = import(&folder("import_turned", &entities));
        let line = "    { at = [1000, 0], size = [400, 200], heading = 31.3, height = 500 }, # b\n";
        assert!(outcome.stdout.contains(line), "{}", outcome.stdout);
        assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    }
}

/// The first robot of a grid stands at the greatest x and y, and x changes first.
#[test]
fn the_methods_of_distribute() {
    for (method, orientation, expected) in [
        (
            r#"method="uniform" min="-1,-0.5,0" max="0.5,0.5,0""#,
            r#"method="gaussian" mean="0,0,0" std_dev="360,0,0""#,
            "count = 6\nat = [-250, 0]\narea = [1500, 1000]\n",
        ),
        (
            r#"method="grid" center="0.5,0,0" distances="0.5,0.4,0" layout="3,2,1""#,
            r#"method="constant" values="-90,0,0""#,
            "positions = [[1000, 200], [500, 200], [0, 200], [1000, -200], [500, -200], [0, -200]]\nheading = -90\n",
        ),
        // A deviation of 0.1 m in x is that of a width of 0.3464 m.
        (
            r#"method="gaussian" mean="1,0,0" std_dev="0.1,0.2,0""#,
            r#"method="uniform" min="0,0,0" max="360,0,0""#,
            "count = 6\nat = [1000, 0]\narea = [346.41, 692.82]\n",
        ),
    ] {
        let entities = format!(
            "<distribute><position {method}/><orientation {orientation}/>\
             <entity quantity=\"6\" max_trials=\"100\"><foot-bot id=\"fb\"><controller config=\"walk\"/></foot-bot></entity></distribute>"
        );
        let robots = robots(&import(&folder("import_distribute", &entities)));
        let start = "[[robots]]\nname = \"fb\"\nrobot = \"rover.toml\"\nscript = \"walk.bzz\"\n";
        assert_eq!(robots, format!("{start}{expected}"), "{method}");
    }
}

#[test]
fn one_place_without_chance_is_a_list() {
    let entities = r#"<distribute>
      <position method="constant" values="-1,0.25,0"/><orientation method="constant" values="0,0,0"/>
      <entity quantity="1" max_trials="1"><foot-bot id="a_"><controller config="walk"/></foot-bot></entity>
    </distribute>"#;
    let robots = robots(&import(&folder("import_constant", entities)));
    assert!(robots.contains("positions = [[-1000, 250]]\nheading = 0\n"), "{robots}");
}

/// Neighbors in the file with the same script, heading and link and with ids that count up are a group.
#[test]
fn robots_one_by_one_become_groups() {
    let turned =
        foot_bot("fb3", "0.5,0,0").replace("/><controller", " orientation=\"45,0,0\"/><controller");
    let robots_of_file = [
        foot_bot("fb1", "-1,0,0"),
        foot_bot("fb2", "-0.5,0,0"),
        turned,
        foot_bot("leader", "1,0,0"),
    ];
    let outcome = import(&folder("import_single", &robots_of_file.join("\n")));
    let expected = r#"[[robots]]
robot = "rover.toml"
script = "walk.bzz"
positions = [[-1000, 0], [-500, 0]]
heading = 0
first_id = 1

[[robots]]
name = "fb3"
robot = "rover.toml"
script = "walk.bzz"
positions = [[500, 0]]
heading = 45

[[robots]]
name = "leader"
robot = "rover.toml"
script = "walk.bzz"
positions = [[1000, 0]]
heading = 0
"#;
    assert_eq!(robots(&outcome), expected);
    // Buzz finds no id in the name of the leader.
    outcome.reports(&["field.argos:18: ids of the robots `leader`"]);
}

/// `base_num` numbers the entities of two elements, whose ids are unique then.
#[test]
fn ids_are_those_of_buzz() {
    let distribute = |id: &str, base: u32| {
        format!(
            "<distribute><position method=\"uniform\" min=\"-1,-1,0\" max=\"1,1,0\"/>\
             <orientation method=\"constant\" values=\"0,0,0\"/>\
             <entity quantity=\"3\" max_trials=\"9\" base_num=\"{base}\"><foot-bot id=\"{id}\"><controller config=\"walk\"/></foot-bot></entity></distribute>"
        )
    };
    let ids = |entities: String| {
        let outcome = import(&folder("import_ids", &entities));
        let text = robots(&outcome);
        let sections = text.split("[[robots]]\n").skip(1);
        let id = |section: &str| {
            let key = section.lines().find_map(|line| line.strip_prefix("first_id = "));
            key.map(|id| id.parse::<u32>().unwrap())
        };
        (sections.map(id).collect::<Vec<_>>(), outcome.stderr.contains("ids of the robots"))
    };
    // 10, 11, 12, and after them 13, 14, 15.
    assert_eq!(ids(distribute("fb", 10) + &distribute("fb", 13)), (vec![Some(10), None], false));
    assert_eq!(ids(distribute("fb", 0) + &distribute("fb", 20)), (vec![None, Some(20)], false));
    // Both have 0, 1 and 2 in ARGoS; robots of a scenario have ids of their own.
    assert_eq!(ids(distribute("fb", 0) + &distribute("kiv", 0)), (vec![None, None], true));
    // fb18, fb19 and fb110: the number after the name is not the id alone.
    assert_eq!(ids(distribute("fb1", 8)), (vec![None], true));
}

#[test]
fn range_and_loss_of_messages() {
    let bot =
        |id: &str, range: &str, x: &str| foot_bot(id, x).replacen('>', &format!(" {range}>"), 1);
    let link = |first: &str, second: &str| {
        let entities = bot("fb0", first, "0,0,0") + &bot("fb1", second, "1,0,0");
        let folder = folder("import_link", &entities);
        let lossy = experiment(&entities).replace(
            "medium=\"rab\" /></sensors>",
            "medium=\"rab\" packet_drop_prob=\"0.25\"/></sensors>",
        );
        folder.write("field.argos", lossy);
        robots(&import(&folder))
    };
    let shared = link("rab_range=\"6\"", "rab_range=\"6\"");
    assert!(
        shared.starts_with("[medium.rab]\nrange = 6000\nloss = 0.25\n\n[[robots]]\n"),
        "{shared}"
    );
    assert!(!shared.contains("link"), "{shared}");
    // Without `rab_range`, robots have the range of their file.
    let own = link("rab_range=\"0.5\"", "");
    assert!(!own.contains("[medium"), "{own}");
    assert!(own.contains("link = { range = 500, loss = 0.25 }\n"), "{own}");
    assert!(own.contains("link = { loss = 0.25 }\n"), "{own}");
    // A range above 1 km reaches every robot of the largest world that people use.
    let far = link("rab_range=\"100000\"", "rab_range=\"100000\"");
    assert!(far.contains("range = 1000000\n"), "{far}");
}

/// Kilobots of ARGoS measure between middles, those of a scenario between rims, which are 33 mm less.
#[test]
fn kilobots_have_the_numbers_of_their_plugin() {
    let folder = folder("import_kilobots", "");
    let kilobots = experiment(
        r#"<kilobot id="kb0" communication_range="0.2"><body position="0.1,0,0"/><controller config="walk"/></kilobot>"#,
    )
    .replace("<media>", "<media><kilobot_communication id=\"k\" message_drop_prob=\"0.1\" />");
    folder.write("field.argos", kilobots);
    let text = robots(&folder.bbz(&["import", "field.argos"]));
    let start = "# The speed, the turn rate and the range of ARGoS's Kilobot plugin.\n[body.kilobot]\npreset = \"argos\"\n\n\
                 [medium.ir]\nrange = 167\nloss = 0.1\n\n[[robots]]\nname = \"kb0\"\nrobot = \"kilobot\"\n";
    assert!(text.starts_with(start), "{text}");
}

/// ARGoS has no wall around its arena, so robots may stand at its edge and entities outside.
#[test]
fn a_world_has_room_for_all() {
    let entities = foot_bot("fb0", "1.95,0,0")
        + "<cylinder id=\"c\" radius=\"0.1\" height=\"1\" movable=\"false\"><body position=\"0,-1.5,0\"/></cylinder>";
    let outcome = import(&folder("import_grown", &entities));
    // 2 * (1950 + 85) mm, and 2 * 1500 mm.
    assert!(outcome.stdout.contains("\nsize = [4070, 3000]\n"), "{}", outcome.stdout);
    outcome.reports(&["field.argos:14: robots, obstacles or lamps outside of the arena or at its edge; the world has 4070 mm by 3000 mm"]);
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
}

/// Bodies with a radius of 85 mm are 170 mm apart at least. The nearest free places are those in whole
/// halves of the radius: 42.5, 85, 127.5, 170 mm along x.
#[test]
fn robots_in_each_other_are_moved_apart() {
    let entities = foot_bot("fb0", "0,0,0")
        + &foot_bot("fb1", "0.1,0,0")
        + &foot_bot("fb2", "1,0.5,0")
        + r#"<box id="b" size="0.2,0.2,0.5" movable="false"><body position="1,0.5,0"/></box>"#;
    let outcome = import(&folder("import_apart", &entities));
    // 100 + 2 * 42.5 mm, and 1000 + 185 mm: 5 * 42.5 is the first multiple above.
    let places = "positions = [[0, 0], [185, 0], [1212.5, 500]]\n";
    assert!(outcome.stdout.contains(places), "{}", outcome.stdout);
    outcome.reports(&[
        "field.argos:15: start places in other robots or in obstacles; `positions` has",
    ]);
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    // As many robots at one place as an experiment whose loop functions place them.
    let heap: String = (0..300).map(|number| foot_bot(&format!("fb{number}"), "0,0,0")).collect();
    let outcome = import(&folder("import_heap", &heap));
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
}

/// The third disc overlaps with the box, and the fourth with the fifth. The second one touches the edge of the arena, 2 m from its
/// center, and the last one reaches 50 mm beyond it.
#[test]
fn movable_cylinders_become_movable_discs() {
    let cylinder = |id: &str, at: &str| {
        format!(
            "<cylinder id=\"{id}\" radius=\"0.1\" height=\"0.5\" movable=\"true\" mass=\"2\"><body position=\"{at},0\"/></cylinder>\n"
        )
    };
    let entities = foot_bot("fb0", "0,0,0")
        + "\n<box id=\"b\" size=\"0.2,0.2,0.5\" movable=\"false\"><body position=\"1,0,0\"/></box>\n"
        + &cylinder("free", "-1,0")
        + &cylinder("edge", "1.9,0")
        + &cylinder("in box", "1.15,0")
        + &cylinder("one", "0,0.5")
        + &cylinder("other", "0.15,0.5")
        + &cylinder("beyond", "-1.95,0");
    let folder = folder("import_movable", &entities);
    let outcome = import(&folder);
    let discs: Vec<&str> =
        outcome.stdout.lines().filter(|line| line.contains("radius = ")).map(str::trim).collect();
    assert_eq!(
        discs,
        [
            "{ at = [-1000, 0], radius = 100, height = 500, movable = true }, # free",
            "{ at = [1900, 0], radius = 100, height = 500, movable = true }, # edge",
            "{ at = [1150, 0], radius = 100, height = 500 }, # in box",
            "{ at = [0, 500], radius = 100, height = 500 }, # one",
            "{ at = [150, 500], radius = 100, height = 500 }, # other",
            "{ at = [-1950, 0], radius = 100, height = 500, movable = true }, # beyond",
        ]
    );
    assert!(outcome.stdout.contains("size = [4100, "), "{}", outcome.stdout);
    outcome.reports(&[
        "cylinders that robots can push, in each other or in obstacles (also lines 20, 21); they stand still here",
    ]);
    folder.write("field.toml", &outcome.stdout);
    let run = folder.bbz(&["sim", "field.toml"]);
    assert_eq!((run.status, run.stderr.as_str()), (Some(0), ""));
}

/// Drawn obstacles stand in their area, apart from each other, from other obstacles and from robots,
/// and a second import gives the same places.
#[test]
fn distributed_obstacles_are_drawn_once() {
    let entities = foot_bot("fb0", "0,0,0")
        + r#"<box id="wall" size="0.1,2,0.5" movable="false"><body position="-0.9,0,0"/></box>
      <distribute><position method="uniform" min="-1,-1,0" max="1,1,0"/><orientation method="constant" values="0,0,0"/>
      <entity quantity="12" max_trials="100"><cylinder id="c" radius="0.1" height="0.5" movable="false"/></entity></distribute>"#;
    let folder = folder("import_drawn", &entities);
    let first = import(&folder);
    assert_eq!(first.stdout, import(&folder).stdout);
    let discs: Vec<[f64; 2]> = first
        .stdout
        .lines()
        .filter(|line| line.contains("radius"))
        .map(|line| {
            let at = line.split_once("at = [").unwrap().1.split_once(']').unwrap().0;
            let (x, y) = at.split_once(", ").unwrap();
            [x.parse().unwrap(), y.parse().unwrap()]
        })
        .collect();
    assert_eq!(discs.len(), 12);
    let distance = |one: [f64; 2], other: [f64; 2]| (one[0] - other[0]).hypot(one[1] - other[1]);
    for (number, disc) in discs.iter().enumerate() {
        // The wall ends at x = -850 mm, the robot has a radius of 85 mm.
        assert!(disc[0] >= -750.0 && disc[0] <= 1000.0 && disc[1].abs() <= 1000.0, "{disc:?}");
        assert!(distance(*disc, [0.0; 2]) >= 185.0, "{disc:?}");
        assert!(discs[..number].iter().all(|other| distance(*disc, *other) >= 200.0), "{disc:?}");
    }
    first.reports(&["field.argos:17: <cylinder> `c` at places that ARGoS draws for each seed"]);
}

#[test]
fn lamps_and_grids_of_obstacles() {
    let entities = r#"<distribute><position method="grid" center="0,0,0" distances="1,1,0" layout="2,1,1"/>
      <orientation method="constant" values="90,0,0"/>
      <entity quantity="2" max_trials="1"><box id="b" size="0.4,0.2,0.5" movable="false"/></entity></distribute>
      <distribute><position method="constant" values="1,-0.5,1"/><orientation method="constant" values="0,0,0"/>
      <entity quantity="1" max_trials="1" base_num="4"><light id="lamp" color="red" intensity="1" medium="leds"/></entity></distribute>"#;
    let outcome = import(&folder("import_grid", &(foot_bot("fb0", "0,0,0") + entities)));
    for line in [
        "    { at = [500, 0], size = [200, 400], height = 500 }, # b0\n",
        "    { at = [-500, 0], size = [200, 400], height = 500 }, # b1\n",
        "    { at = [1000, -500], brightness = 1023 }, # lamp4\n",
    ] {
        assert!(outcome.stdout.contains(line), "{}", outcome.stdout);
    }
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
}

#[test]
fn scripts_are_found_from_the_folder_of_the_scenario() {
    let folder = Folder::new("import_scripts");
    for name in ["worlds", "scripts", "out"] {
        std::fs::create_dir(folder.path(name)).unwrap();
    }
    folder.write("rover.toml", super::ROVER);
    folder.write("scripts/walk.bzz", "function step() {}\n");
    let text = experiment(&foot_bot("fb0", "0,0,0")).replace("build/walk.bo", "scripts/walk.bo");
    folder.write("worlds/field.argos", text);
    let to = |output| ["import", "worlds/field.argos", "-o", output, "--robot", ROBOT];
    for (output, script, robot) in [
        ("out/f.toml", "../scripts/walk.bzz", "../rover.toml"),
        ("f.toml", "scripts/walk.bzz", "rover.toml"),
    ] {
        folder.bbz(&to(output)).succeeds_with("");
        let text = String::from_utf8(folder.read(output)).unwrap();
        let keys = format!("robot = \"{robot}\"\nscript = \"{script}\"\n");
        assert!(text.contains(&keys), "{text}");
        assert_eq!(folder.bbz(&["sim", output, "--headless"]).status, Some(0));
    }
}
