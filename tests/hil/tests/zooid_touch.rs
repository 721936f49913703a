//! The touch sensor after a reset of the microcontroller in the middle of a transfer. The sensor does not notice the
//! reset, and may hold the bus.

use std::time::Duration;

use bittybuzz_emulation::message::ResetCause;
use bittybuzz_hil::{Command, Table};

const SCRIPT: &str = "function step() { log(touched()) }";
/// A bit of the bus at 400 kHz takes 2.5 us, and a transfer of two bytes about 50 bits.
const BETWEEN_RESETS: Duration = Duration::from_nanos(1250);
const TRANSFER: Duration = Duration::from_micros(160);

fn touch(table: &mut Table, keys: u8, ms: u64) -> Option<String> {
    table.execute_on(0, &Command::Touch { keys });
    table.run_ms(ms);
    table.zooids()[0].last_logged().map(|items| items.join(" "))
}

/// A robot whose touch sensor reports a finger from now on.
fn touched() -> Table {
    let mut table = Table::new(SCRIPT, &[7]);
    table.run_ms(1000);
    table.execute_on(0, &Command::Touch { keys: 0b010 });
    table
}

#[test]
fn a_reset_in_a_transfer_does_not_block_the_touch_sensor() {
    let mut table = touched();
    let before = table.board(0).touch_addressed;
    while table.board(0).touch_addressed == before {
        table.run(Duration::from_micros(10));
    }
    // The transfer began at most ten bits and one of these spans ago.
    let begin = table.now() - Duration::from_micros(40);
    let mut at = begin;
    while at < begin + TRANSFER {
        let mut table = touched();
        table.run(at - table.now());
        table.execute_on(0, &Command::Reset { cause: ResetCause::BrownOut });
        table.run_ms(600);
        for (keys, expected) in [(0, "0"), (0b010, "1"), (0, "0")] {
            let logged = touch(&mut table, keys, 300);
            assert_eq!(logged.as_deref(), Some(expected), "reset at {at:?}");
        }
        at += BETWEEN_RESETS;
    }
}
