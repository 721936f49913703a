//! A Zooid whose supply falls for a moment: whatever it does then, it starts as after power-on. Its chip has no brown-out detector:
//! the one of power-down resets it, with the flags of power-on (RM0091 5.2.1 and 6.4.10). So the script runs again, from its beginning.

use std::time::Duration;

use bittybuzz_chips::Random;
use bittybuzz_emulation::message::{Memory, ResetCause};
use bittybuzz_hil::flash::{Reading, Writing};
use bittybuzz_hil::supply::Doing;
use bittybuzz_hil::table::{layout, script_section};
use bittybuzz_hil::{Command, EmulatorEvent, Place, Table, TimedEvent, is_lit, resets};
use bittybuzz_robot_spec::Layout;

/// The script that the robot has; the one that is written over it differs in the number that it logs first.
const OLD: &str = "\
function init() { n = 0 }
function step() {
  n = n + 1
  log(number(), n)
  neighbors.broadcast(\"x\", n)
  set_motor(40, 40)
}
function number() { return 300 }
";
const NUMBERS: [&str; 2] = ["300", "1300"];

const OLD_ID: u16 = 0x0107;
const NEW_ID: u16 = 0x3258;

/// Bytes of a page, and of what is programmed at once (RM0091 3.2.1 and 3.2.2).
const PAGE: usize = 1024;
const HALFWORD: usize = 2;

/// The first step comes a tenth of a second after the script has started.
const FIRST_STEP: Duration = Duration::from_millis(100);
/// The inputs of a bridge change one after the other.
const BETWEEN_INPUTS: Duration = Duration::from_micros(50);

fn chip(memory: Memory, seed: u64, crystal: bool) -> Command {
    Command::Chip { lsi_hz: 40_000, crystal, memory, seed, debugger: false }
}

fn run_us(table: &mut Table, us: u64) {
    table.run(Duration::from_micros(us));
}

/// Lets the supply fall for a moment, and returns when.
fn brown_out(table: &mut Table) -> Duration {
    let at = table.now();
    table.execute_on(0, &Command::Reset { cause: ResetCause::BrownOut });
    run_us(table, 1);
    at
}

/// The events since `from`.
fn since(table: &Table, from: Duration) -> &[TimedEvent] {
    let events = &table.zooids()[0].events;
    &events[events.partition_point(|event| event.at < from)..]
}

/// Motors stand from the first of these events on until `end`: both inputs of a bridge have the same level.
fn assert_stands(events: &[TimedEvent], end: Duration) {
    // Every reset lets the inputs go.
    let mut inputs = [0.0; 4];
    let mut last = Duration::MAX;
    for TimedEvent { at, event } in events.iter().filter(|event| event.at < end) {
        let stands = inputs[0] == inputs[1] && inputs[2] == inputs[3];
        assert!(stands || *at <= last + BETWEEN_INPUTS, "a motor turns at {last:?}: {inputs:?}");
        if let EmulatorEvent::Motor { number, duty, .. } = event {
            inputs[usize::from(*number) - 1] = *duty;
            last = *at;
        }
    }
}

/// A probe writes `new` where the flash holds something, and is cut short.
fn cut_short(table: &mut Table, address: u32, new: &[u8], random: &mut Random) {
    let pages = new.len().div_ceil(PAGE) * PAGE;
    let old = table.read(0, address, pages as u32);
    let writing = Writing { old: &old, new, sector: PAGE, unit: HALFWORD };
    // The last operation is the one after which least is missing.
    let last = writing.operations() - 1;
    let operation = if random.chance(0.25) { last } else { random.bits() as usize % (last + 1) };
    let reading = [Reading::Partial, Reading::Anything][random.bits() as usize % 2];
    table.write(0, address, &writing.cut_at(operation, reading, random));
}

/// Lets the supply fall at a random moment and looks at the robot.
fn survives(number: u64) {
    let doing = Doing::of(number);
    let memory = [Memory::Kept, Memory::Zeroed, Memory::Noise][(number / 7 % 3) as usize];
    let mut random = Random::for_item(2028, number);
    let seed = random.bits();
    println!("number {number}, {doing:?}, {memory:?}");

    let mut table = Table::new(OLD, &[OLD_ID]);
    table.put(0, Place::at(0.0, 0.0, 0.0));
    table.execute_on(0, &chip(memory, seed, doing != Doing::WaitingForTheCrystal));
    table.execute_on(0, &Command::Power { on: false });
    run_us(&mut table, 1_000);
    table.execute_on(0, &Command::Power { on: true });
    let message = |number: u64| [0xb0, 9, 0, 8, number as u8];
    match doing {
        Doing::Starting => run_us(&mut table, random.bits() % 20_000),
        // Less than the watchdog waits.
        Doing::WaitingForTheCrystal => {
            run_us(&mut table, random.bits() % 200_000);
            table.execute_on(0, &chip(memory, seed, true));
        }
        Doing::RunningTheScript => run_us(&mut table, 500_000 + random.bits() % 200_000),
        // A packet is sent within 10 ms after the step.
        Doing::Sending => {
            run_us(&mut table, 450_000);
            let sent = table.board(0).radio_sent;
            while table.board(0).radio_sent == sent {
                run_us(&mut table, 20 + random.bits() % 100);
            }
        }
        Doing::Receiving => {
            run_us(&mut table, 500_000 + random.bits() % 100_000);
            for number in 0..8 {
                let at = table.now() + Duration::from_micros(500 * number + 1);
                table.radio(at, &message(number));
            }
            run_us(&mut table, random.bits() % 4_000);
        }
        Doing::TakingAScript => {
            run_us(&mut table, 500_000);
            let new = OLD.replace(NUMBERS[0], NUMBERS[1]);
            let section = script_section(&new);
            assert!(section.len().is_multiple_of(HALFWORD), "the seal's check is the last one");
            cut_short(&mut table, layout().script.address, &section, &mut random);
        }
        Doing::TakingAnId => {
            run_us(&mut table, 500_000);
            let address = layout().id.unwrap().address;
            cut_short(&mut table, address, &Layout::id_section(NEW_ID), &mut random);
        }
    }

    let logged = table.zooids()[0].trace_log.log.len();
    let first = brown_out(&mut table);
    // A supply that is too weak falls again and again.
    run_us(&mut table, random.bits() % 20_000);
    let printed = table.zooids()[0].trace_log.firmware.len();
    let second = brown_out(&mut table);
    table.run_ms(1_000);
    let causes: Vec<&str> = resets(since(&table, first)).iter().map(|(_, cause)| *cause).collect();
    assert_eq!(causes, ["brown_out"; 2]);
    assert_stands(since(&table, first), second);
    assert_stands(since(&table, second), second + FIRST_STEP);

    let zooid = &table.zooids()[0];
    let says =
        |text: &str| zooid.trace_log.firmware[printed..].iter().any(|line| line.contains(text));
    assert!(!says("restarted"), "{:?}", zooid.trace_log.firmware);
    let known = [OLD_ID, NEW_ID].map(|id| says(&format!("robot id {id}")) && !says("unique id"));
    match doing {
        Doing::TakingAnId => {
            let is_known = known[0] || known[1] || says("from the chip's unique id");
            assert!(is_known, "{:?}", zooid.trace_log.firmware);
        }
        _ => assert!(known[0], "{:?}", zooid.trace_log.firmware),
    }
    let steps: Vec<&[String]> =
        zooid.trace_log.log[logged..].iter().map(|(_, values)| &values[..]).collect();
    if doing == Doing::TakingAScript && steps.is_empty() {
        assert!(zooid.trace_log.records.iter().any(|record| record.contains("Refused")));
        assert!(is_lit(since(&table, second), "red"));
        assert_stands(since(&table, second), table.now());
        return;
    }
    // From its beginning, and always the same one.
    let script = steps.first().map(|values| values[0].clone()).expect("the script runs");
    let known = script == NUMBERS[0] || script == NUMBERS[1] && doing == Doing::TakingAScript;
    assert!(known, "no script runs in parts: {steps:?}");
    for (number, values) in (1..).zip(&steps) {
        assert_eq!(**values, [script.clone(), number.to_string()]);
    }
    assert!(steps.len() >= 7, "{steps:?}");
    assert!(zooid.motors()[0] > 0.3);
    // The radio may have kept its settings, or lost them.
    let (sent, received) = (table.board(0).radio_sent, table.board(0).radio_received);
    for number in 0..8 {
        let at = table.now() + Duration::from_millis(10 * number + 1);
        table.radio(at, &message(number));
    }
    table.run_ms(500);
    assert!(table.board(0).radio_sent >= sent + 4);
    // While it sends itself it receives nothing.
    assert!(table.board(0).radio_received >= received + 6);
}

/// All of a script is written but one bit of its last halfword, which is the check of its seal: it is refused.
#[test]
fn a_script_without_its_last_bit_does_not_run() {
    let whole = script_section(OLD);
    let last = whole.len() - HALFWORD;
    for bit in 0..8 * HALFWORD {
        let mut section = whole.clone();
        section[last + bit / 8] |= 1 << (bit % 8);
        let is_whole = section == whole;
        let mut table = Table::new(OLD, &[OLD_ID]);
        table.put(0, Place::at(0.0, 0.0, 0.0));
        table.write(0, layout().script.address, &section);
        table.execute_on(0, &Command::Reset { cause: ResetCause::BrownOut });
        table.run_ms(500);
        let zooid = &table.zooids()[0];
        assert_eq!(
            zooid.trace_log.log.is_empty(),
            !is_whole,
            "bit {bit}: {:?}",
            zooid.trace_log.log
        );
        assert_eq!(is_lit(&zooid.events, "red"), !is_whole);
        assert_eq!(zooid.motors() == [0.0; 2], !is_whole);
    }
}

#[test]
fn a_brown_out_at_any_moment_is_like_power_on() {
    for number in 0..42 {
        survives(number);
    }
}

#[test]
#[ignore = "soak"]
fn a_brown_out_at_a_thousand_moments_is_like_power_on() {
    for number in 0..1_000 {
        survives(number);
    }
}
