//! Robot functions: linked by name, checked against the robot's file, and left out where a robot lacks them.

use bittybuzz_compiler::compile::{Compiled, Options};
use bittybuzz_robot_files::all_shipped;
use bittybuzz_robot_spec::Robot;
use bittybuzz_vm_core::hash::name_hash;
use bittybuzz_vm_core::image::Image;

use crate::back::machine::{FULL, TINY, build_for, build_with, image, listing, output, run};

fn codes(compiled: &Compiled) -> Vec<&'static str> {
    compiled.diagnostics.iter().map(|diagnostic| diagnostic.code.text()).collect()
}

#[test]
fn imports_are_name_hashes_in_order_of_use() {
    let (bytes, symbols) = image("motors(1, 2) f = led led(1) f(2)", TINY);
    assert_eq!(symbols.imports, ["motors", "led"]);
    let at = usize::from(Image::new(bytes.as_slice()).header().unwrap().imports_at());
    let hashes = [name_hash("motors"), name_hash("led")].map(u16::to_le_bytes).concat();
    assert_eq!(bytes[at..at + 4], hashes);
}

#[test]
fn robot_functions_are_called_and_are_values() {
    let script = "led(1) x = led x(2) foreach({ .a = 3 }, function(k, v) { led(v) }) y = goto(1, 2.5) log(y)";
    let run = run(script, FULL);
    assert_eq!(run.output, "led(1)\nled(2)\nled(3)\ngoto(1, 2.5)\nnil\n");
}

#[test]
fn a_guard_leaves_out_what_the_robot_lacks() {
    let guards = [
        "if(goto) goto(1, 2)",
        "if(not isnil(goto)) { goto(1, 2) }",
        "if(isnil(goto)) log(1) else goto(1, 2)",
        "if(goto != nil) goto(1, 2)",
        "x = goto and goto(1, 2)",
        "if(id and goto and goto(1, 2)) log(1)",
        "if(not (isnil(goto) or id == 3)) goto(1, 2)",
        "while(goto) goto(1, 2)",
        "if(goto) { f = function() { goto(1, 2) } f() }",
    ];
    for guard in guards {
        let kilobot = build_for(guard, TINY, Some("kilobot"));
        assert_eq!(codes(&kilobot), [""; 0], "{guard}");
        let symbols = kilobot.symbols.unwrap();
        assert_eq!(symbols.imports, [""; 0], "{guard}");
        let zooid = build_for(guard, TINY, Some("zooids"));
        assert_eq!(zooid.symbols.unwrap().imports, ["goto"], "{guard}");
    }
}

#[test]
fn other_conditions_do_not_hide_the_error() {
    let scripts = [
        "goto(1, 2)",
        "if(isnil(goto)) goto(1, 2)",
        "if(not goto) goto(1, 2)",
        "if(goto) log(1) else goto(1, 2)",
        "if(goto or id) goto(1, 2)",
        "x = goto or goto(1, 2)",
        "if(goto) log(1) goto(1, 2)",
        "if(led) goto(1, 2)",
    ];
    for script in scripts {
        assert!(codes(&build_for(script, TINY, Some("kilobot"))).contains(&"E0402"), "{script}");
        assert!(build_for(script, TINY, Some("zooids")).image.is_some(), "{script}");
    }
}

#[test]
fn a_guard_helps_with_names_that_no_known_robot_has() {
    let script = "if(fly_to) fly_to(1)";
    assert_eq!(codes(&build_for(script, TINY, Some("kilobot"))), ["W0201"]);
}

#[test]
fn robots_of_one_source_agree_on_hash_and_strings() {
    let script = "
        if(goto) { goto(1, 2) p = pos log(p.x, \"only here\") }
        neighbors.broadcast(\"topic\", 1)
        t = { .field = 2 }";
    let [kilobot, zooid] = ["kilobot", "zooids"].map(|name| build_for(script, TINY, Some(name)));
    let [kilobot, zooid] = [kilobot, zooid].map(|compiled| compiled.symbols.expect("compiles"));
    assert_eq!(kilobot.script_hash, zooid.script_hash);
    assert_eq!(kilobot.strings, zooid.strings);
    let full = build_for(script, FULL, Some("zooids")).symbols.unwrap();
    assert_ne!(full.script_hash, zooid.script_hash);
}

#[test]
fn the_robot_chooses_the_profile_unless_one_is_named() {
    let robots = all_shipped();
    let kilobot = robots.iter().find(|robot| robot.name == "kilobot").cloned();
    let profile = |options: Options| build_with("x = 1", &options).symbols.unwrap().profile;
    assert_eq!(profile(Options::default()), "full");
    assert_eq!(profile(Options { robot: kilobot.clone(), ..Options::default() }), "tiny");
    assert_eq!(
        profile(Options { robot: kilobot, profile: Some(FULL), ..Options::default() }),
        "full"
    );
}

#[test]
fn a_script_can_define_the_name_of_a_robot_function() {
    assert_eq!(output("led = function(x) { log(\"my \", x) } led(1)"), "my 1\n");
    // Until it is assigned it is the robot's.
    assert_eq!(output("old = led led = function(x) { old(x + 1) } led(1)"), "led(2)\n");
    assert_eq!(
        codes(&build_for(
            "function led(a, _b, _c) { return a } led(1, 2, 3)",
            TINY,
            Some("kilobot")
        )),
        ["W0202"]
    );
}

#[test]
fn without_a_named_robot_the_argument_lists_of_all_robots_are_accepted() {
    assert_eq!(codes(&build_for("led(1, 1)", FULL, None)), [""; 0]);
    assert_eq!(codes(&build_for("led(1, 1)", FULL, Some("crazyflie"))), [""; 0]);
    assert_eq!(codes(&build_for("led(1, 1)", TINY, Some("kilobot"))), ["E0404"]);
    assert_eq!(codes(&build_for("led(1, 1, 1)", TINY, Some("kilobot"))), [""; 0]);
    assert_eq!(codes(&build_for("led(1, 1, 1, 1)", FULL, None)), ["E0404"]);
}

#[test]
fn literal_arguments_have_the_right_type() {
    let wrong = ["led(\"red\")", "led(1.5)", "led(nil)", "led({})", "led(log)", "led(2 / 4.0)"];
    for script in wrong {
        assert_eq!(codes(&build_for(script, TINY, Some("kilobot"))), ["E0405"], "{script}");
    }
    let right = ["led(1)", "led(2 * 3)", "x = 1.5 led(x)", "led(id)", "led(rand())", "led(1 == 2)"];
    for script in right {
        assert_eq!(codes(&build_for(script, TINY, Some("kilobot"))), [""; 0], "{script}");
    }
    assert_eq!(codes(&build_for("hover(1) hover(1.5)", FULL, Some("crazyflie"))), [""; 0]);
    assert_eq!(codes(&build_for("hover(\"up\")", FULL, Some("crazyflie"))), ["E0405"]);
}

#[test]
fn tables_of_the_robot() {
    assert_eq!(codes(&build_for("log(pos.z)", TINY, Some("zooids"))), ["W0208"]);
    assert_eq!(codes(&build_for("log(pos.z)", FULL, Some("crazyflie"))), [""; 0]);
    assert_eq!(codes(&build_for("log(pos.x)", TINY, Some("kilobot"))), ["W0201"]);
    let guarded = build_for("if(pos) log(pos.x)", TINY, Some("kilobot"));
    assert_eq!(codes(&guarded), [""; 0]);
    let (image, symbols) = (guarded.image.unwrap(), guarded.symbols.unwrap());
    assert!(!listing(&image, &symbols).contains("LIBRARY"));
}

/// A robot with functions that take any number of arguments.
const VARIADIC: &str = r#"
name = "talker"

[[function]]
name = "say"
accepts = ["values: any..."]
help = "say the values"

[[function]]
name = "play"
accepts = ["instrument: string, notes: int..."]
returns = "int"
help = "play the notes"
"#;

fn build_for_talker(script: &str) -> Compiled {
    let talker = Robot::parse(VARIADIC, "talker.toml").expect("it is right");
    build_with(script, &Options { robot: Some(talker), ..Options::default() })
}

#[test]
fn a_repeated_parameter_accepts_any_number_of_arguments() {
    let many = format!("say({})", ["1"; 127].join(", "));
    let right = ["say()", "say(1)", "say(1, \"a\", {}, nil)", "play(\"drum\")", &many];
    for script in right {
        let compiled = build_for_talker(script);
        assert_eq!(codes(&compiled), [""; 0], "{script}");
        assert!(compiled.image.is_some(), "{script}");
    }
    let right = "x = play(\"horn\", 1, 2, 3, 4, 5, 6, 7, 8, 9) log(x)";
    assert_eq!(build_for_talker(right).symbols.unwrap().imports, ["play"]);
    let too_many = format!("say({})", ["1"; 128].join(", "));
    assert!(build_for_talker(&too_many).image.is_none());
}

#[test]
fn arguments_for_a_repeated_parameter_have_its_type() {
    assert_eq!(codes(&build_for_talker("play()")), ["E0404"]);
    for wrong in ["play(1)", "play(\"drum\", \"a\")", "play(\"drum\", 1, 2, 3, nil, 5)"] {
        let compiled = build_for_talker(wrong);
        assert_eq!(codes(&compiled), ["E0405"], "{wrong}");
        let help = compiled.diagnostics[0].help.clone().unwrap();
        let form = "write `play(instrument: string, notes: int...)`: play the notes";
        assert_eq!(help, form, "{wrong}");
    }
    let compiled = build_for_talker("play(\"drum\", 1, 2, \"three\")");
    let message = &compiled.diagnostics[0].message;
    assert_eq!(message, "`notes` of `play` is an integer, not a string");
    assert_eq!(compiled.sources.text(compiled.diagnostics[0].span), "\"three\"");
}
