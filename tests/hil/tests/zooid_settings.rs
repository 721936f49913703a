//! What people write to a Zooid's flash, beside script and id.

use bittybuzz_hil::{EmulatorEvent, Place, Table};
use bittybuzz_robot_spec::Layout;

/// Writes settings as `bbz flash --set` does.
fn set(table: &mut Table, robot: usize, values: &[(&str, u16)]) {
    let zooid = bittybuzz_robot_files::find("zooids").unwrap();
    let mut section = vec![None; zooid.settings.len()];
    for (name, value) in values {
        let place = zooid.settings.iter().position(|setting| setting.name == *name).unwrap();
        section[place] = Some(*value);
    }
    let region = zooid.layout.unwrap().settings.unwrap();
    table.write(robot, region.address, &Layout::settings_section(&section));
}

const LISTEN: &str = "\
function init() {
  heard = 0
  neighbors.listen(\"a\", function(topic, value, robot) { heard = heard + 1 })
}
function step() {
  neighbors.broadcast(\"a\", 1)
  log(heard, neighbors.count())
}
";

/// Robots 200 mm apart; without the setting, and with one that is far enough or not.
#[test]
fn messages_from_beyond_the_range_are_discarded() {
    for (range, hears) in [(None, true), (Some(205), true), (Some(195), false)] {
        let mut table = Table::new(LISTEN, &[1, 2]);
        if let Some(range) = range {
            set(&mut table, 0, &[("range_mm", range)]);
        }
        table.put(0, Place::at(-60.0, 80.0, 70.0));
        table.put(1, Place::at(60.0, -80.0, -20.0));
        table.run_ms(2000);
        let logged = table.zooids()[0].last_logged().unwrap();
        assert_eq!(logged != ["0", "0"], hears, "{range:?}: {logged:?}");
        // The other one has no such setting.
        assert_ne!(table.zooids()[1].last_logged().unwrap(), ["0", "0"]);
        // Who does not know where the other is hears everything.
        table.execute_on(1, &bittybuzz_hil::Command::Remove);
        table.run_ms(2000);
        assert_ne!(table.zooids()[0].last_logged().unwrap(), ["0", "0"]);
    }
}

/// Duties of the first half second of the way to a goal, in percent.
fn first_duties(minimum: Option<u16>) -> Vec<f64> {
    let mut table = Table::new("function step() { goto(200, 0) }", &[7]);
    if let Some(duty) = minimum {
        set(&mut table, 0, &[("minimum_duty", duty)]);
    }
    table.put(0, Place::at(-200.0, 0.0, 0.0));
    table.drive_ms(600);
    let duties = table.zooids()[0].events.iter().filter_map(|event| match event.event {
        // Forwards the first input of a motor is high while the other one does not pull.
        EmulatorEvent::Motor { number: 1, duty, .. } if duty < 1.0 => {
            Some(((1.0 - duty) * 100.0).round())
        }
        _ => None,
    });
    // Off before the first step.
    duties.filter(|duty| *duty < 100.0).collect()
}

/// The wheels of the model turn from 22 percent on: one that is told so drives at once, another one tries.
#[test]
fn the_minimum_duty_is_set_or_measured() {
    let set = first_duties(Some(22));
    assert!(set[0] > 40.0, "{set:?}");
    let found = first_duties(None);
    assert!((22.0..=26.0).contains(&found[0]), "{found:?}");
    assert!(found.iter().any(|duty| *duty > 40.0), "{found:?}");
}
