//! Everything that a scenario lacks is listed on standard error and in its comments.

use super::{ROBOT, experiment, folder, foot_bot, import};

/// Entities and parts of an experiment, each with its line of the list.
#[test]
fn each_omission_names_line_and_cure() {
    let bot = foot_bot("fb0", "0,0,0");
    let distribute = |position: &str, orientation: &str, entity: &str| {
        format!(
            "{bot}\n<distribute><position {position}/><orientation {orientation}/><entity quantity=\"3\" max_trials=\"9\">{entity}</entity></distribute>"
        )
    };
    let uniform = r#"method="uniform" min="-1,-0.5,0" max="1,0.5,0""#;
    let still = r#"method="constant" values="0,0,0""#;
    let more = r#"<foot-bot id="more_1"><controller config="walk"/></foot-bot>"#;
    for (entities, expected) in [
        (
            bot.clone()
                + "\n<box id=\"b\" size=\"0.2,0.2,0.2\" movable=\"true\" mass=\"1\"><body position=\"1,0,0\"/></box>",
            "16: boxes that robots can push; they stand still here; only a disc",
        ),
        (
            bot.clone()
                + "\n<cylinder id=\"c\" radius=\"0.1\" height=\"0.2\" movable=\"true\" mass=\"1\"><body position=\"1,0,0\"/></cylinder>",
            "16: `mass` of cylinders that robots can push; a robot pushes one as it pushes another robot",
        ),
        (
            bot.clone()
                + "\n<box id=\"b\" size=\"0.2,0.2,0.2\" movable=\"false\"><body position=\"1,0,0\"/><leds medium=\"leds\"/></box>",
            "16: LEDs of boxes and cylinders; add lamps to `lights`",
        ),
        (
            bot.clone()
                + "\n<box id=\"b\" size=\"0.2,0.2,0.2\" movable=\"false\"><body position=\"1,0,1\"/></box>",
            "16: obstacles above the ground; write them into `obstacles`",
        ),
        (
            bot.clone()
                + "\n<box id=\"b\" size=\"0.2,0.2,0.2\" movable=\"false\"><body position=\"1,0,-1\"/></box>",
            "16: obstacles below the ground; ",
        ),
        (
            bot.clone()
                + "\n<box id=\"b\" size=\"0.2,0.0005,0.2\" movable=\"false\"><body position=\"1,0,0\"/></box>",
            "16: sides below 1 mm; they have 1 mm here",
        ),
        (
            bot.clone()
                + "\n<box id=\"b\" size=\"0.2,0.2,0.2\" movable=\"false\"><body position=\"1,0,0\" orientation=\"0,30,0\"/></box>",
            "16: rotations around y and x; only the one around z",
        ),
        (
            bot.clone()
                + "\n<light id=\"l\" position=\"1,0,1\" intensity=\"3.0\" color=\"yellow\" medium=\"leds\"/>",
            "16: `intensity` of lamps; they have the greatest `brightness` here",
        ),
        (
            bot.clone() + "\n<floor id=\"f\" source=\"image\" path=\"nest.png\"/>",
            "16: the floor with the picture `nest.png`; write its areas into `ground`",
        ),
        (
            bot.clone() + "\n<floor id=\"f\" source=\"loop_functions\" pixels_per_meter=\"50\"/>",
            "16: the floor that loop functions paint; write its areas into `ground`",
        ),
        (
            bot.clone()
                + "\n<spiri id=\"s1\"><body position=\"1,0,0\"/><controller config=\"walk\"/></spiri>\n<spiri id=\"s2\"><body/><controller config=\"walk\"/></spiri>",
            "16: robots of kind `spiri` (also line 17); import with --robot spiri=FILE.toml",
        ),
        (
            bot.clone() + "\n<ball id=\"b\" radius=\"1\"/>",
            "16: <ball> `b`; write an obstacle if robots can touch it",
        ),
        (
            foot_bot("fb0", "0,0,1.5"),
            "15: start positions above the ground; robots start on the ground",
        ),
        (
            foot_bot("fb0", "0,0,0").replacen('>', " rab_data_size=\"50\">", 1),
            "15: `rab_data_size` = 50 bytes in each step; long messages take several frames",
        ),
        (
            bot.replace("<controller", "<battery model=\"time\"/><controller"),
            "15: <battery>; the file of a robot may have a sensor of kind `battery`",
        ),
        (
            foot_bot("fb0", "1x,0,0"),
            "15: `position` is \"1x,0,0\", of which ARGoS reads 1,0,0; the same is read here",
        ),
        (
            distribute(r#"method="gaussian" mean="0,0,0" std_dev="0.5,0.2,0""#, still, more),
            "16: Gaussian start positions; they are uniform in a rectangle",
        ),
        (
            distribute(uniform, r#"method="uniform" min="-20,0,0" max="20,0,0""#, more),
            "16: headings from -20 to 20 degrees; they are random in all directions here",
        ),
        (
            distribute(uniform, r#"method="gaussian" mean="90,0,0" std_dev="10,0,0""#, more),
            "16: headings around 90 with a deviation of 10 degrees; they are random",
        ),
        (
            distribute(uniform, still, &format!("{more}<box/>")),
            "16: further elements in <entity>; ARGoS distributes only the first, too",
        ),
        (
            distribute(
                r#"method="grid" center="0,0,0" distances="0.5,1,1" layout="2,1,2""#,
                still,
                more,
            )
            .replace(&bot, ""),
            "16: 1 robots in upper layers of a grid; robots start on the ground",
        ),
        (
            distribute(uniform, still, r#"<box id="b" size="3,1.5,1" movable="false"/>"#),
            "16: 3 of 3 <box> `b`: no free place was found; add them to `obstacles`",
        ),
    ] {
        let outcome = import(&folder("import_omission", &entities));
        assert_eq!(outcome.status, Some(0), "{entities}\n{}", outcome.stderr);
        outcome.reports(&["left out or changed:\n", &format!("field.argos:{expected}")]);
        let comment = format!("# line {expected}");
        assert!(outcome.stdout.contains(&comment), "{comment}\n{}", outcome.stdout);
    }
}

/// Changes of the rest of an experiment, each with its line of the list.
#[test]
fn omissions_outside_of_the_arena() {
    let text = experiment(&(foot_bot("fb0", "0,0,0") + &foot_bot("fb1", "1,0,0")));
    for (old, new, expected) in [
        (
            "length=\"30\"",
            "length=\"0\"",
            "6: a run without an end (`length` = 0); `duration` = 60 is a choice",
        ),
        ("length=\"30\"", "length=\"0.26\"", "6: `length` = 0.26; `duration` = 0.3 is the nearest"),
        (
            "random_seed=\"7\"",
            "random_seed=\"0\"",
            "6: a seed from the clock (`random_seed` = 0); `seed` = 1 is a choice",
        ),
        (
            "ticks_per_second=\"10\"",
            "ticks_per_second=\"30\"",
            "6: `ticks_per_second` = 30: `rover.toml` makes 10 steps; times that its script counts in steps last 3 times as long",
        ),
        (
            "check_occlusions=\"false\"",
            "",
            "17: obstacles and robots that block messages; messages pass through them",
        ),
        (
            "</media>",
            "<simple_radio id=\"r\"/></media>",
            "17: the medium <simple_radio>; no robot has it here",
        ),
        (
            "</media>",
            "</media><loop_functions library=\"libx\" label=\"paint\"/>",
            "17: loop functions `paint`; write [[event]] and [[expect]]",
        ),
        (
            "</media>",
            "</media><visualization><qt-opengl><user_functions label=\"draw\"/></qt-opengl></visualization>",
            "17: drawing functions `draw`; `bbz sim --view` colors robots",
        ),
        (
            "medium=\"rab\" />",
            "medium=\"rab\" noise_std_dev=\"0.1\" />",
            "10: noise of <range_and_bearing>: noise_std_dev = 0.1; give a copy of the robot's file `noise`",
        ),
        (
            "build/walk.bo",
            "build/fly.bo",
            "9: there is no script for `build/fly.bo` of controller `walk`; copy it to `fly.bzz`",
        ),
        (
            "bytecode_file=\"build/walk.bo\"",
            "",
            // The file that stands in the folder is that of the controller's name.
            "9: ",
        ),
        (
            "walk.bdb\" />",
            "walk.bdb\" map=\"m.txt\" ><state rest=\"0.5\"/><wheel_turning hard_turn_angle_threshold=\"90\" max_speed=\"50\"/></params>",
            "11: parameters of controller `walk`: map = m.txt, state.rest = 0.5; make them globals of its script",
        ),
        (
            "walk.bdb\" />",
            "walk.bdb\" ><wheel_turning hard_turn_angle_threshold=\"90\" max_speed=\"50\"/></params>",
            "11: <wheel_turning> of controller `walk`: max_speed = 50 (usual 10); give a copy of the robot's file such limits",
        ),
        (
            "buzz_controller_footbot",
            "my_buzz_controller",
            "9: functions that `my_buzz_controller` adds to Buzz; write a robot file",
        ),
        (
            "</controllers>",
            "<lua_controller id=\"spare\"/></controllers>",
            "13: controller `spare`, which no imported robot has; add [[robots]] with its script",
        ),
    ] {
        let folder = folder("import_omitted", "");
        let text = text.replace(old, new);
        folder.write("field.argos", &text);
        let outcome = import(&folder);
        assert_eq!(outcome.status, Some(0), "{new}\n{}", outcome.stderr);
        if expected == "9: " {
            // `walk.bzz` exists, so nothing is missing.
            assert_eq!(outcome.stderr, "");
            continue;
        }
        outcome.reports(&[&format!("field.argos:{expected}")]);
        assert!(outcome.stdout.contains(&format!("# line {expected}")), "{}", outcome.stdout);
    }
}

/// Controllers of other languages need a script, whose name is that of the controller.
#[test]
fn controllers_that_are_not_buzz() {
    for (controller, expected) in [
        (
            "<lua_controller id=\"lua one\"><params script=\"a.lua\"/></lua_controller>",
            "controller `lua one` (lua_controller) runs the program `a.lua`; write its behavior as the script `lua-one.bzz`",
        ),
        (
            "<footbot_diffusion_controller id=\"fdc\" library=\"build/libx\"><params alpha=\"7.5\"/></footbot_diffusion_controller>",
            "controller `fdc` (footbot_diffusion_controller) runs code of the library `build/libx`; write its behavior as the script `fdc.bzz`",
        ),
        (
            "<kilobot_controller id=\"kbc\"><params behavior=\"build/blinky\"/></kilobot_controller>",
            "controller `kbc` (kilobot_controller) runs the Kilobot program `build/blinky`; write its behavior as the script `kbc.bzz`",
        ),
        (
            "<e_puck_controller id=\"walk\"/>",
            "controller `walk` (e_puck_controller) runs code of a plug-in; `walk.bzz` takes its place",
        ),
        (
            "<buzz_controller_footbot id=\"bcf\"><params/></buzz_controller_footbot>",
            "controller `bcf` has no `bytecode_file`; write the script `bcf.bzz`",
        ),
    ] {
        let id = controller.split_once("id=\"").unwrap().1.split_once('"').unwrap().0;
        let bot = foot_bot("fb0", "0,0,0").replace("config=\"walk\"", &format!("config=\"{id}\""));
        let text = experiment(&bot);
        let (before, rest) = text.split_once("    <buzz_controller").unwrap();
        let (_, after) = rest.split_once("</buzz_controller_footbot>\n").unwrap();
        let folder = folder("import_controller", "");
        folder.write("field.argos", format!("{before}{controller}\n{after}"));
        let outcome = import(&folder);
        assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
        outcome.reports(&[&format!("field.argos:9: {expected}")]);
    }
}

/// Parameters of a robot replace those of its controller.
#[test]
fn a_robot_may_have_a_script_of_its_own() {
    let own = foot_bot("fb1", "1,0,0").replace(
        "config=\"walk\" />",
        "config=\"walk\"><params bytecode_file=\"run.bo\"/></controller>",
    );
    let folder = folder("import_params", &(foot_bot("fb0", "0,0,0") + &own));
    folder.write("run.bzz", "function step() {}\n");
    let outcome = import(&folder);
    outcome.succeeds_with(&outcome.stdout);
    let scripts: Vec<&str> =
        outcome.stdout.lines().filter(|line| line.starts_with("script")).collect();
    assert_eq!(scripts, ["script = \"walk.bzz\"", "script = \"run.bzz\""]);
}

/// The kinds of the table need no option, and their robots run.
#[test]
fn the_kinds_of_the_table() {
    for (kind, robot) in [
        ("foot-bot", "footbot"),
        ("e-puck", "epuck"),
        ("kheperaiv", "khepera"),
        ("kilobot", "kilobot"),
    ] {
        let bot = foot_bot("fb0", "0,0,0").replace("foot-bot", kind);
        let folder = folder("import_kinds", &bot);
        folder.bbz(&["import", "field.argos", "-o", "field.toml"]).succeeds_with("");
        let text = String::from_utf8(folder.read("field.toml")).unwrap();
        assert!(text.contains(&format!("robot = \"{robot}\"\n")), "{text}");
        let run = folder.bbz(&["sim", "field.toml", "--headless"]);
        assert_eq!((run.status, run.stderr.as_str()), (Some(0), ""));
    }
}

/// Robots of any kind are imported with a robot file. A scenario without robots is not complete.
#[test]
fn other_kinds_need_a_robot_file() {
    let spiri = foot_bot("s1", "0,0,0").replace("foot-bot", "spiri");
    let folder = folder("import_spiri", &spiri);
    folder
        .bbz(&["import", "field.argos", "-o", "field.toml", "--robot", "spiri=rover.toml"])
        .succeeds_with("");
    assert_eq!(folder.bbz(&["sim", "field.toml", "--headless"]).status, Some(0));
    let without = folder.bbz(&["import", "field.argos", "-o", "none.toml", "--robot", ROBOT]);
    without.fails_with(2, &["robots of kind `spiri`", "the scenario has no robots", "none.toml:1"]);
    assert!(folder.path("none.toml").exists(), "the user adds robots to it");
    folder.bbz(&["import", "field.argos", "--robot", "spiri"]).fails_with(3, &["KIND=NAME"]);
    folder
        .bbz(&["import", "field.argos", "--robot", "spiri=rovr.toml"])
        .fails_with(3, &["rovr.toml"]);
    folder
        .bbz(&["import", "field.argos", "--robot", "spiri=kilobto"])
        .fails_with(3, &["kilobto", "kilobot"]);
}

/// Text of the experiment can neither end a comment nor a string, nor control the terminal.
#[test]
fn control_characters_do_not_reach_scenario_and_terminal() {
    let entities = foot_bot("a&#10;[world]&#10;", "0,0,0")
        + "<box id=\"x&#10;y = 1\" size=\"0.1,0.1,0.1\" movable=\"false\"><body position=\"1,0,0\"/></box>"
        + "<ball id=\"&#10;&quot;&#x85;\"/>";
    let folder = folder("import_control", &entities);
    let outcome = folder.bbz(&["import", "field.argos", "-o", "field.toml", "--robot", ROBOT]);
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    let text = String::from_utf8(folder.read("field.toml")).unwrap();
    assert!(text.contains("}, # x?y = 1\n") && text.contains("<ball> `?\"?`"), "{text}");
    assert!(text.contains("name = \"a\\u000a[world]\\u000a\"\n"), "{text}");
    assert!(!outcome.stderr.contains("\u{85}"), "{}", outcome.stderr);
    assert_eq!(folder.bbz(&["sim", "field.toml", "--headless"]).status, Some(0));
}

#[test]
fn an_output_never_replaces_an_input() {
    let folder = folder("import_output", &foot_bot("fb0", "0,0,0"));
    for input in ["field.argos", "walk.bzz"] {
        let to = ["import", "field.argos", "-o", input, "--robot", ROBOT];
        folder.bbz(&to).fails_with(3, &["is read by this command"]);
    }
    folder
        .bbz(&["import", "f1eld.argos"])
        .fails_with(3, &["no file `f1eld.argos`", "did you mean `field.argos`?"]);
    folder
        .bbz(&["import", "field.argos", "-o", "no/f.toml", "--robot", ROBOT])
        .fails_with(3, &["no/f.toml"]);
    folder.write("latin.argos", [b'<', 0xe9, b'>']);
    folder.bbz(&["import", "latin.argos"]).fails_with(3, &["latin.argos", "UTF-8"]);
}
