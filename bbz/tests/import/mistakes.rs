//! Mistakes of an experiment have a place and a cure, and hostile files end in time.

use super::{ROBOT, experiment, folder, foot_bot, import};
use crate::support::Folder;

/// Imports a text, which must be refused without a scenario.
#[track_caller]
fn refused(text: &str, parts: &[&str]) {
    let folder = folder("import_refused", "");
    folder.write("field.argos", text);
    import(&folder).fails_with(2, parts);
    let written = folder.bbz(&["import", "field.argos", "-o", "field.toml", "--robot", ROBOT]);
    written.fails_with(2, parts);
    assert!(!folder.path("field.toml").exists());
}

#[test]
fn mistakes_of_xml_have_a_place() {
    let text = experiment(&foot_bot("fb0", "0,0,0"));
    for (old, new, place, message, cure) in [
        (
            "</arena>",
            "</area>",
            "16:3",
            "expected 'arena' tag, not 'area'",
            "each <tag> needs its </tag>",
        ),
        ("</argos-configuration>", "", "17:", "never closed", "each <tag> needs its </tag>"),
        (
            "size=\"4, 2, 1\"",
            "size=\"4, 2, 1\" size=\"5\"",
            "14:25",
            "'size' is already defined",
            "keep one",
        ),
        ("config=\"walk\"", "config=\"a & b\"", "15:67", "malformed entity", "&amp;"),
        ("a comment", "a -- comment", "2:1", "comment", "`--` may only end a comment"),
        (
            "<argos",
            "<!DOCTYPE a [<!ENTITY b \"c\">]><argos",
            "3:1",
            "it has a document type",
            "delete the document type",
        ),
    ] {
        let text = text.replacen(old, new, 1);
        refused(
            &text,
            &[
                "this is not the XML of an experiment",
                message,
                &format!("field.argos:{place}"),
                cure,
            ],
        );
    }
    refused(
        "",
        &["this is not the XML of an experiment", "field.argos:1:1", "<argos-configuration>"],
    );
    refused("{}", &["this is not the XML of an experiment", "field.argos:1:1"]);
}

#[test]
fn mistakes_of_an_experiment_have_a_place_and_a_cure() {
    let bot = foot_bot("fb0", "0,0,0");
    let distribute = |position: &str, quantity: &str| {
        format!(
            "<distribute><position {position}/><orientation method=\"constant\" values=\"0,0,0\"/>\n\
             <entity quantity=\"{quantity}\" max_trials=\"9\"><foot-bot id=\"f\"><controller config=\"walk\"/></foot-bot></entity></distribute>"
        )
    };
    let uniform = "method=\"uniform\" min=\"-1,-1,0\" max=\"1,1,0\"";
    let boxed = |attributes: &str| {
        format!(
            "{bot}<box id=\"b\" {attributes} movable=\"false\"><body position=\"1,0,0\"/></box>"
        )
    };
    for (entities, parts) in [
        (boxed("size=\"1,x,1\""), ["`size` needs a number, not \"x\"", "field.argos:15:", "such as 0.5"]),
        (boxed("size=\"1,1\""), ["`size` has too few numbers: 2 instead of 3", "field.argos:15:", "\"2,0.5,0\""]),
        (boxed("size=\"1,-1,1\""), ["`size` cannot be -1", "field.argos:15:", "a number above 0"]),
        (boxed("size=\"1,2000,1\""), ["`size` does not fit into a world", "field.argos:15:", "1000 m"]),
        (boxed(""), ["<box> has no `size`", "field.argos:15:", "add size="]),
        (
            bot.clone() + "<cylinder id=\"c\" radius=\"-0.1\" height=\"1\" movable=\"false\"><body/></cylinder>",
            ["`radius` cannot be -0.1", "field.argos:15:", "a number above 0"],
        ),
        (
            bot.clone() + "<box id=\"b\" size=\"1,1,1\" movable=\"false\"/>",
            ["<box> has no <body>", "field.argos:15:", "add <body ...>"],
        ),
        (
            bot.clone() + "<light id=\"l\" position=\"0,0,0\" intensity=\"-1\"/>",
            ["`intensity` cannot be -1", "field.argos:15:", "a number from 0 on"],
        ),
        (
            bot.replace("config=\"walk\"", "config=\"wlk\""),
            ["there is no controller `wlk`", "field.argos:15:", "did you mean `walk`?"],
        ),
        (
            bot.replace("<controller config=\"walk\" />", ""),
            ["<foot-bot> has no <controller>", "field.argos:15:1", "add <controller ...>"],
        ),
        (
            bot.replace("id=\"fb0\"", ""),
            ["<foot-bot> has no `id`", "field.argos:15:1", "add id="],
        ),
        (
            bot.replace("fb0", &"fb".repeat(501)),
            ["`id` is too long", "field.argos:15:", "at most 1000 bytes"],
        ),
        (
            bot.replacen('>', " rab_range=\"-3\">", 1),
            ["`rab_range` cannot be -3", "field.argos:15:", "a number from 0 on"],
        ),
        (
            foot_bot("fb0", "600,0,0"),
            ["`position` does not fit into a world", "field.argos:15:1", "500 m from its center"],
        ),
        (distribute("", "3"), ["<position> has no `method`", "field.argos:15:", "add method="]),
        (
            distribute("method=\"uniformly\"", "3"),
            ["there is no distribution `uniformly`", "field.argos:15:", "did you mean `uniform`?"],
        ),
        (
            distribute("method=\"uniform\" min=\"1,0,0\" max=\"0,1,0\"", "3"),
            ["`min` is greater than `max`", "field.argos:15:", "exchange the numbers"],
        ),
        (
            distribute("method=\"gaussian\" mean=\"0,0,0\" std_dev=\"-1,0,0\"", "3"),
            ["`std_dev` cannot be -1", "field.argos:15:", "a number from 0 on"],
        ),
        (
            distribute("method=\"grid\" center=\"0,0,0\" distances=\"1,1,0\" layout=\"2,0,1\"", "2"),
            ["`layout` cannot be 0", "field.argos:15:", "a whole number from 1"],
        ),
        (
            distribute("method=\"grid\" center=\"0,0,0\" distances=\"1,1,0\" layout=\"2,1,1\"", "3"),
            ["3 entities do not fit into the 2 places of the grid", "field.argos:16:", "enlarge `layout`"],
        ),
        (distribute(uniform, "-3"), ["`quantity` cannot be -3", "field.argos:16:", "a whole number from 0 to 4294967295"]),
        (distribute(uniform, "1.5"), ["`quantity` cannot be 1.5", "field.argos:16:", "a whole number"]),
        (distribute(uniform, "4e9"), ["`quantity` = 4000000000 is too much", "field.argos:16:", "65536 robots"]),
        (
            distribute(uniform, "40000") + &distribute(uniform, "30000"),
            ["`quantity` = 30000 is too much", "field.argos:17:", "65536 robots"],
        ),
        (
            distribute(uniform, "3000").replace("<foot-bot id=\"f\"><controller config=\"walk\"/></foot-bot>", "<cylinder/>"),
            ["`quantity` = 3000 is too much", "field.argos:16:", "2000 obstacles and lamps"],
        ),
        (
            "<distribute><position method=\"constant\" values=\"0,0,0\"/><orientation method=\"constant\" values=\"0,0,0\"/>\n<entity quantity=\"1\"/></distribute>".to_owned(),
            ["<entity> has no entity to distribute", "field.argos:16:1", "<foot-bot id="],
        ),
        (
            "<distribute><position method=\"constant\" values=\"0,0,0\"/></distribute>".to_owned(),
            ["<distribute> has no <orientation>", "field.argos:15:1", "add <orientation ...>"],
        ),
    ] {
        refused(&experiment(&entities), &parts);
    }
}

#[test]
fn mistakes_outside_of_the_arena() {
    let text = experiment(&foot_bot("fb0", "0,0,0"));
    let (before, rest) = text.split_once("  <arena").unwrap();
    let (_, after) = rest.split_once("</arena>\n").unwrap();
    refused(
        &format!("{before}{after}"),
        &["there is no <arena>", "field.argos:3:1", "<arena size="],
    );
    let second = text.replace("</arena>", "</arena>\n<arena size=\"1,1,1\"/>");
    refused(
        &second,
        &["a second <arena>", "field.argos:17:1", "the first is in line 14", "delete the other"],
    );
    for (old, new, parts) in [
        ("size=\"4, 2, 1\" ", "", ["<arena> has no `size`", "field.argos:14:", "add size="]),
        (
            "size=\"4, 2, 1\"",
            "size=\"-4, 2, 1\"",
            ["`size` cannot be -4", "field.argos:14:", "a number above 0"],
        ),
        (
            "size=\"4, 2, 1\"",
            "size=\"4000, 2, 1\"",
            ["`size` does not fit", "field.argos:14:", "0.01 m to 1000 m"],
        ),
        (
            "size=\"4, 2, 1\"",
            "size=\"@X@,2,1\"",
            ["`size` needs a number, not \"@X@\"", "field.argos:14:", "a template"],
        ),
        (
            "center=\"0,0,0.5\"",
            "center=\"0\"",
            ["`center` has too few numbers: 1", "field.argos:14:", "x, y and z"],
        ),
        (
            "length=\"30\"",
            "length=\"-1\"",
            ["`length` cannot be -1", "field.argos:6:", "a number from 0 on"],
        ),
        (
            "random_seed=\"7\"",
            "random_seed=\"1e10\"",
            ["`random_seed` cannot be 10000000000", "field.argos:6:", "4294967295"],
        ),
        (
            "ticks_per_second=\"10\"",
            "ticks_per_second=\"0\"",
            ["`ticks_per_second` cannot be 0", "field.argos:6:", "from 1"],
        ),
        (
            "ticks_per_second=\"10\"",
            "",
            ["<experiment> has no `ticks_per_second`", "field.argos:6:", "add ticks_per_second="],
        ),
        (
            "framework",
            "frame",
            ["<argos-configuration> has no <framework>", "field.argos:3:1", "add <framework ...>"],
        ),
        (
            "id=\"walk\"",
            "",
            ["<buzz_controller_footbot> has no `id`", "field.argos:9:5", "add id="],
        ),
        (
            "medium=\"rab\" />",
            "medium=\"rab\" packet_drop_prob=\"2\" />",
            ["`packet_drop_prob` cannot be 2", "field.argos:10:", "from 0 to 1"],
        ),
    ] {
        refused(&text.replace(old, new), &parts);
    }
}

/// One run finds all mistakes, in the order of the file.
#[test]
fn all_mistakes_are_found_at_once() {
    let entities = format!(
        "{}\n{}\n<box id=\"b\" size=\"a,1,1\" movable=\"false\"/>",
        foot_bot("fb0", "x,0,0"),
        "<distribute><position method=\"no\"/><orientation method=\"constant\" values=\"y,0,0\"/><entity quantity=\"z\"><light id=\"l\"/></entity></distribute>"
    );
    let folder = folder("import_all", &entities);
    let text = experiment(&entities).replace("length=\"30\"", "length=\"none\"");
    folder.write("field.argos", text);
    let stderr = import(&folder).stderr;
    let places: Vec<&str> = stderr
        .lines()
        .filter_map(|line| line.trim_start().strip_prefix("--> field.argos:"))
        .map(|place| place.split_once(':').unwrap().0)
        .collect();
    assert_eq!(places, ["6", "15", "16", "16", "16", "17", "17"], "{stderr}");
}

/// The scenario is loaded, so its mistakes appear at once: no robot makes 7 steps per second.
#[test]
fn a_scenario_that_would_be_refused_is_reported() {
    let folder = folder("import_loaded", &foot_bot("fb0", "0,0,0"));
    folder.write("odd.toml", super::ROVER.replace("\n\n[body]", "\ntick_hz = 7\n\n[body]"));
    let to = ["import", "field.argos", "-o", "field.toml", "--robot", "foot-bot=odd.toml"];
    folder.bbz(&to).fails_with(2, &["its file asks for 7 steps per second", "field.toml:"]);
    assert_eq!(folder.bbz(&["sim", "field.toml"]).status, Some(2));
}

#[test]
fn entities_of_a_document_type_are_not_expanded() {
    let levels: String = (1..10)
        .map(|level| format!("<!ENTITY l{level} \"{}\">", format!("&l{};", level - 1).repeat(10)))
        .collect();
    let text = experiment(&foot_bot("&l9;", "0,0,0"))
        .replace("<argos", &format!("<!DOCTYPE a [<!ENTITY l0 \"lol\">{levels}]><argos"));
    refused(&text, &["this is not the XML of an experiment", "delete the document type"]);
}

/// Files of a few MiB that take long if any part of the reader is not linear, or recurses.
#[test]
fn hostile_files_end_in_time() {
    let folder = Folder::new("import_hostile");
    folder.write("rover.toml", super::ROVER);
    folder.write("walk.bzz", "function step() {}\n");
    let import = |entities: &str| {
        folder.write("field.argos", experiment(entities));
        super::import(&folder)
    };
    let bot = foot_bot("fb0", "1.8,0.8,0");
    let deep = |count: usize| bot.clone() + &"<a>".repeat(count) + &"</a>".repeat(count);
    let outcome = import(&deep(400_000));
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    // Kinds that nothing knows, all in one line.
    let many: String = (0..100_000).map(|number| format!("<k{number}/>")).collect();
    let outcome = import(&(bot.clone() + &many));
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    outcome.reports(&["<k0> `k0`", "99900 more are not shown"]);
    // Mistakes in each of many entities.
    let outcome = import(&(bot.clone() + &"<box/>\n".repeat(100_000)));
    assert_eq!((outcome.status, outcome.stderr.matches("error:").count()), (Some(2), 100));
    // Long names in many places.
    let (long, longest) = ("n".repeat(1000), "n".repeat(1_000_000));
    let named = "<distribute><position method=\"uniform\" min=\"-1,-1,0\" max=\"1,1,0\"/><orientation method=\"constant\" values=\"0,0,0\"/><entity quantity=\"";
    let things = format!(
        "{named}60000\"><foot-bot id=\"{long}\"><controller config=\"walk\"/></foot-bot></entity></distribute>\
         {named}2000\"><light id=\"{longest}\"/></entity></distribute>\
         <{longest}/><foot-bot id=\"fb0\"><body position=\"{longest}\"/><controller config=\"{long}\"/></foot-bot>"
    );
    let outcome = import(&things);
    assert_eq!(outcome.status, Some(2), "{}", outcome.stderr);
    assert!(outcome.stderr.len() < 10_000, "{}", outcome.stderr.len());
    // Robots each of which is a group.
    let groups: String = (0..10_000)
        .map(|number| {
            let [x, y] = [number % 100, number / 100].map(|place| f64::from(place) * 0.2);
            let turn = format!("{x},{y},0\" orientation=\"{},0,0", number % 2);
            foot_bot(&format!("fb{number}"), &turn)
        })
        .collect();
    let outcome = import(&groups);
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    assert_eq!(outcome.stdout.matches("[[robots]]").count(), 10_000);
    // Obstacles that find no place among many.
    let crowd = "<cylinder radius=\"0.001\" height=\"1\"><body/></cylinder>".repeat(20_000)
        + "<distribute><position method=\"uniform\" min=\"-1,-1,0\" max=\"1,1,0\"/><orientation method=\"constant\" values=\"0,0,0\"/>\
           <entity quantity=\"2000\"><cylinder id=\"c\" radius=\"2\" height=\"1\"/></entity></distribute>";
    let outcome = import(&(bot + &crowd));
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    outcome.reports(&["2000 of 2000 <cylinder> `c`: no free place was found"]);
}
