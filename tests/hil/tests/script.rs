//! The script on the robot: ticks, values, log lines and faults as people see them.

use bittybuzz_emulation::ElfSymbol;
use bittybuzz_hil::{Core, ScriptFile, Trace, crazyflie, text, time, trace};
use bittybuzz_runtime::script::SLICE_MAX;
use bittybuzz_tests::bbz;

/// Step `n` (from 1) begins `n` ticks after the start; the start itself takes less than this.
const START: f64 = 0.02;

const BLINK: &str = "\
function init() { n = 0 log(\"robot \", isnil(id)) }
function step() {
  n = n + 1
  led(n % 8)
  if(n == 3) set_motor(0, 64)
  if(n == 5) { set_motor(1, 32) set_motor(2, 255) }
  if(n == 7) { set_motor(0, 0) set_motor(3, 1) }
  if(n % 4 == 0) log(n, \" \", n / 2, \" \", n / 2.0, \" \", n == 4, \" \", {.a = n}, \" \", nil, math.sqrt(2.0))
}
";

/// The name of a generic function ends with that of the crate in which it was compiled, whose level it has.
#[test]
fn the_quick_loop_is_compiled_in_a_crate_of_its_own() {
    let image = std::fs::read(crazyflie()).unwrap();
    let found = |crate_name: &str| {
        ElfSymbol::find(&image, |name| name.contains("run_quickly") && name.contains(crate_name))
    };
    assert!(found("bittybuzz_crazyflie_machine").is_some());
    assert!(found("19bittybuzz_crazyflie").is_none());
}

/// LEDs and motors have the values of step `n` from the tick of that step to the next.
fn outputs_follow_the_script(core: Core, steps: u32) {
    let script = ScriptFile::new(&format!("blink-{core:?}"), BLINK);
    let trace = trace(core, script.path(), f64::from(steps) / 10.0 + 0.05);
    for n in 1..=steps {
        // In the middle between this tick and the next.
        let at = START + f64::from(n) * 0.1 + 0.025;
        let colors = [(1, "led red_left"), (2, "led green_left"), (4, "led blue_left")];
        for (bit, name) in colors {
            let expected = if (n % 8) & bit == 0 { "off" } else { "on" };
            assert_eq!(trace.output_at(name, at), expected, "{name} in step {n}");
        }
        // Power of 256; more than 76 is not given.
        let powers = [
            if (3..7).contains(&n) { 64 } else { 0 },
            if n >= 5 { 32 } else { 0 },
            if n >= 5 { 76 } else { 0 },
            if n >= 7 { 1 } else { 0 },
        ];
        for (motor, power) in powers.into_iter().enumerate() {
            let found = trace.output_at(&format!("motor {}", motor + 1), at);
            let expected = format!("{:.1} %", f64::from(power) / 2.56);
            match power {
                0 => assert!(found == "off" || found.starts_with("0.0 %"), "{found} in step {n}"),
                _ => assert_eq!(found, format!("{expected} at 328.1 kHz"), "motor in step {n}"),
            }
        }
    }
    ticks_are_regular(&trace, steps);
    same_log_as_on_the_host(&trace, script.path(), steps);
}

/// The red LED changes with every step: ten steps a second, and never two in one tick.
fn ticks_are_regular(trace: &Trace, steps: u32) {
    let red = trace.output("led red_left");
    assert_eq!(red.len(), steps as usize, "{red:?}");
    for (n, (at, _)) in red.iter().enumerate() {
        let due = (n + 1) as f64 * 0.1;
        assert!((due..due + START).contains(at), "step {} at {at} s", n + 1);
    }
}

fn same_log_as_on_the_host(trace: &Trace, script: &str, steps: u32) {
    let steps = steps.to_string();
    let host = bbz::run(&["run", script, "--robot", "crazyflie", "--steps", &steps], &[]);
    assert_eq!(host.status, Some(0), "{host:?}");
    let calls = ["led(", "set_motor("];
    let is_log = |line: &&str| !calls.iter().any(|call| line.starts_with(call));
    let host: Vec<&str> = host.stdout.lines().filter(is_log).collect();
    let robot: Vec<&str> = trace.log().into_iter().map(|(_, text)| text).collect();
    assert_eq!(robot, host);
    assert!(robot.len() > steps.parse::<usize>().unwrap() / 4);
    // Each line is in the tick of its step: `step` counts those before.
    for line in trace.of("log").skip(1) {
        let (step, at) = (line["step"].as_u64().unwrap(), time(line));
        let due = (step + 1) as f64 * 0.1;
        assert!((due..due + 0.1).contains(&at), "{line}");
    }
}

#[test]
fn outputs_follow_the_script_on_unicorn() {
    outputs_follow_the_script(Core::Unicorn, 100);
}

#[test]
fn outputs_follow_the_script_on_qemu() {
    outputs_follow_the_script(Core::Qemu, 12);
}

fn a_fault_stops_the_motors_and_names_its_place(core: Core) {
    let source = "function limp(t) {\n  return t.leg + 1\n}\n\
        function init() { n = 0 }\n\
        function step() {\n  n = n + 1\n  set_motor(2, 50)\n  if(n == 4)\n    limp(nil)\n}\n";
    let script = ScriptFile::new(&format!("fault-{core:?}"), source);
    let trace = trace(core, script.path(), 1.0);
    assert_eq!(trace.status, Some(1));
    let faults: Vec<_> = trace.of("fault").collect();
    assert_eq!(faults.len(), 1);
    let fault = faults[0];
    assert_eq!(fault["code"], "R0002");
    assert_eq!(text(&fault["message"]), "cannot read field `leg` of nil: `t` is nil");
    assert_eq!(fault["step"], 3);
    let calls: Vec<(&str, u64)> = fault["calls"]
        .as_array()
        .unwrap()
        .iter()
        .map(|call| (text(&call["function"]), call["line"].as_u64().unwrap()))
        .collect();
    assert_eq!(calls, [("limp", 2), ("step", 9)]);
    assert_eq!(text(&fault["calls"][0]["file"]), script.path());
    // The motor has stopped when the fault is told. The log counts whole ms.
    let motor = trace.output("motor 3");
    let (stopped, state) = motor.last().unwrap();
    assert!(state.starts_with("0.0 %") || *state == "off", "{motor:?}");
    assert!((0.4..0.41).contains(stopped) && *stopped < time(fault) + 0.001, "{motor:?}");
    // A number of blinks tells the cause to people without a probe: 2.
    let blinks = trace.output("led red_right");
    let lit = blinks.iter().filter(|(at, state)| *state == "on" && *at < 1.0).count();
    assert_eq!(lit, 2, "{blinks:?}");
}

#[test]
fn a_fault_stops_the_motors_and_names_its_place_on_unicorn() {
    a_fault_stops_the_motors_and_names_its_place(Core::Unicorn);
}

#[test]
fn a_fault_stops_the_motors_and_names_its_place_on_qemu() {
    a_fault_stops_the_motors_and_names_its_place(Core::Qemu);
}

fn a_step_without_end_is_reported_and_stops_the_motors(core: Core) {
    let source = "function init() { n = 0 }\n\
        function step() { n = n + 1 set_motor(0, 30 + n) if(n == 3) while(1) { } }";
    let script = ScriptFile::new(&format!("forever-{core:?}"), source);
    // QEMU takes a hundred times as long for a busy second as Unicorn.
    let seconds = if core == Core::Qemu { 1.0 } else { 1.6 };
    let trace = trace(core, script.path(), seconds);
    // The step of 0.2 s is the last that is completed.
    let motor = trace.output("motor 1");
    let (stopped, state) = motor.last().unwrap();
    assert!(state.starts_with("0.0 %"), "{motor:?}");
    assert!((0.7..0.7 + START).contains(stopped), "{motor:?}");
    let expired: Vec<f64> = trace.of("expired").map(time).collect();
    assert_eq!(expired.len(), 1);
    assert!((0.7..0.7 + 2.0 * START).contains(&expired[0]), "{expired:?}");
    let overruns: Vec<f64> = trace.of("overrun").map(time).collect();
    assert!((0.4..0.4 + 2.0 * START).contains(&overruns[0]), "{overruns:?}");
    assert_eq!(trace.of("reset").count(), 0);
}

#[test]
fn a_step_without_end_is_reported_and_stops_the_motors_on_unicorn() {
    a_step_without_end_is_reported_and_stops_the_motors(Core::Unicorn);
}

#[test]
#[ignore = "soak"]
fn a_step_without_end_is_reported_and_stops_the_motors_on_qemu() {
    a_step_without_end_is_reported_and_stops_the_motors(Core::Qemu);
}

/// No slice takes longer than [`SLICE_MAX`], whatever the script does with its own functions and with text. `slices.rs` has more.
#[test]
fn slices_are_short() {
    let scripts = [
        (
            "tables",
            "function init() { t = {} var i = 0 while(i < 150) { t[i] = i i = i + 1 } }\n\
             function step() { foreach(t, function(k, v) { t[k] = v + 1 }) var u = map(t, function(k, v) { return v }) u = nil }",
        ),
        (
            "text",
            "function init() { s = \"\" var i = 0 while(i < 60) { s = string.concat(s, \"abcdefgh\") i = i + 1 } }\n\
             function step() { var i = 0 while(i < 200) { var u = string.sub(s, i, 450) string.length(u) i = i + 1 } }",
        ),
    ];
    for (name, source) in scripts {
        let script = ScriptFile::new(&format!("slices-{name}"), source);
        let trace = trace(Core::Unicorn, script.path(), 8.0);
        assert_eq!(trace.status, Some(0), "{name}: {:?}", trace.lines.last());
        // The firmware prints its longest slice after the first twenty steps.
        let printed = trace.of("firmware").filter_map(|line| {
            let (_, rest) = text(&line["text"]).split_once("longest slice ")?;
            rest.split(' ').next()?.parse::<u64>().ok()
        });
        let longest = printed.last().unwrap_or_else(|| panic!("{name}: no status line"));
        println!("{name}: longest slice {longest} us");
        assert!((1..=SLICE_MAX.as_micros()).contains(&longest), "{name}: {longest} us");
    }
}

/// A script for another robot or profile is refused in words, and nothing moves.
#[test]
fn an_image_for_another_robot_is_refused() {
    let mut image = bittybuzz_hil::image("function step() { set_motor(0, 50) }");
    // The profile bit: tiny.
    image[1] ^= 0x80;
    let mut robot = bittybuzz_hil::Robot::crazyflie(Core::Unicorn, "function step() { }");
    let section = bittybuzz_hil::layout().script_section(&image).expect("a short script");
    robot.write(SECTORS[0], &section);
    let events = robot.run_ms(1000);
    assert_eq!(bittybuzz_hil::motors(&events), [0.0; 4]);
    let lit = events.iter().any(|event| {
        matches!(&event.event, bittybuzz_hil::EmulatorEvent::Led { name, on: true } if name == "red_right")
    });
    assert!(lit, "no sign of the refusal");
}

#[test]
fn the_longest_image_that_tools_accept_runs() {
    let most = bittybuzz_hil::layout().most_script() as usize;
    let script = "function step() { set_motor(0, 60) }";
    let longest = bittybuzz_hil::image_of("crazyflie", script, most);
    let section = |image: &[u8]| bittybuzz_hil::layout().script_section(image);
    assert_eq!(section(&[&longest[..], &[0]].concat()), None);
    let mut robot = bittybuzz_hil::Robot::crazyflie(Core::Unicorn, "function step() { }");
    robot.write(SECTORS[0], &section(&longest).expect("it fits"));
    robot.run_ms(500);
    let duty = bittybuzz_hil::motors(&robot.events)[0];
    assert!((duty - 60.0 / 256.0).abs() < 0.01, "{duty}");
}

/// Whatever is in the script's section of flash, the robot stays still, keeps its link and says that no script runs.
#[test]
fn a_section_without_a_script_is_safe() {
    let image = bittybuzz_hil::image("function step() { set_motor(0, 50) led(1) }");
    let whole = bittybuzz_hil::layout().script_section(&image).expect("a short script");
    let sections = [
        ("erased", vec![0xff; 4096]),
        ("empty", vec![0; 4096]),
        ("longer than its place", [&0x0002_0000_u32.to_le_bytes()[..], &whole[4..]].concat()),
        ("cut off", [&10_u32.to_le_bytes()[..], &whole[4..]].concat()),
        ("without a mark", [&whole[..4088], &[0xff; 8]].concat()),
        ("noise", whole.iter().map(|byte| byte.wrapping_mul(167) ^ 0x5a).collect()),
    ];
    for (name, section) in sections {
        let mut robot = bittybuzz_hil::Robot::crazyflie(Core::Unicorn, "function step() { }");
        for sector in SECTORS {
            robot.write(sector, &section);
        }
        let events = robot.run_ms(1000);
        assert_eq!(bittybuzz_hil::motors(&events), [0.0; 4], "{name}");
        assert!(bittybuzz_hil::resets(&events).is_empty(), "{name}");
        let leds = events.iter().filter_map(|event| match &event.event {
            bittybuzz_hil::EmulatorEvent::Led { name, on: true } => Some(name.as_str()),
            _ => None,
        });
        assert_eq!(
            leds.filter(|led| *led != "green_right").collect::<Vec<_>>(),
            ["red_right"],
            "{name}"
        );
        assert!(robot.ping(1, 10).is_some(), "{name}");
    }
}

/// Beginnings of the two sectors of the log of scripts.
const SECTORS: [u32; 2] = [0x0808_0000, 0x080a_0000];

/// While `bbz flash` writes one sector, the other one has a whole script: the old one, until the mark of the new one is there.
#[test]
fn half_a_script_leaves_the_old_one() {
    let section = |power: u8| {
        let image = bittybuzz_hil::image(&format!("function step() {{ set_motor(0, {power}) }}"));
        bittybuzz_hil::layout().script_section(&image).expect("a short script")
    };
    let (old, new) = (section(20), section(60));
    for (written, power) in [(0, 20.0), (4, 20.0), (40, 20.0), (4092, 20.0), (4096, 60.0)] {
        let mut robot = bittybuzz_hil::Robot::crazyflie(Core::Unicorn, "function step() { }");
        robot.write(SECTORS[1], &old);
        robot.write(SECTORS[0], &[&new[..written], &[0xff; 4096][written..]].concat());
        robot.run_ms(500);
        let duty = bittybuzz_hil::motors(&robot.events)[0];
        assert!((duty - power / 256.0).abs() < 0.01, "{written} bytes: {duty}");
    }
}

/// A script later in the log is newer if its number is greater.
#[test]
fn the_newest_script_of_the_log_runs() {
    let image = bittybuzz_hil::image("function step() { set_motor(0, 60) }");
    let mut place = bittybuzz_hil::layout().script_section(&image).expect("a short script");
    place[4088] = 2;
    let content = [&place[..4 + image.len()], &place[4088..4092]].concat();
    let check =
        content.iter().fold(0xffff, |check, byte| bittybuzz_vm_core::message::crc16(check, *byte));
    place[4092..4094].copy_from_slice(&check.to_le_bytes());
    place[4094..].copy_from_slice(&(!check).to_le_bytes());
    let mut robot =
        bittybuzz_hil::Robot::crazyflie(Core::Unicorn, "function step() { set_motor(0, 20) }");
    // The last place of the first sector.
    robot.write(SECTORS[1] - 4096, &place);
    robot.run_ms(500);
    let duty = bittybuzz_hil::motors(&robot.events)[0];
    assert!((duty - 60.0 / 256.0).abs() < 0.01, "{duty}");
}
