//! simavr: records with the cycle when the program writes a mark.
//!
//! Its record is a value change dump (IEEE 1364, section 18): `$var wire 8 ! GPIOR0 $end` gives a register a sign,
//! `#12` is a time, `b00000001 !` the new value of a register.

use crate::error::BenchError;
use crate::marks::{Event, ReportedMark};
use anyhow::Result;
use bittybuzz_bench::Mark;
use bittybuzz_builds::shell::Line;
use fs_err as fs;
use std::path::Path;

pub const RUNNER: &str = "simavr";

/// The name of simavr's record.
const RECORD: &str = "gtkwave_trace.vcd";
/// The record's unit is 10 ns: at 1 MHz a cycle is a hundred of them, and nothing is rounded.
const FREQUENCY: &str = "1000000";
const UNITS_PER_CYCLE: u64 = 100;
/// Like the ATmega328P it has a program counter of 16 bits and takes the same cycles for every instruction, but it has four
/// times the flash: the machine with everything that it can have, and the program around it, does not fit the smaller one.
const CHIP: &str = "atmega1284p";
/// Mark, low byte and high byte of the value.
const REGISTERS: [&str; 3] = ["GPIOR0", "GPIOR1", "GPIOR2"];

/// Runs a program.
pub fn run(program: &Path, folder: &Path) -> Result<ReportedMark> {
    let (program, folder_text) = (program.display().to_string(), folder.display().to_string());
    let arguments = ["-m", CHIP, "-f", FREQUENCY, &program];
    // It writes its record where it runs.
    Line::new(RUNNER, &arguments).in_workspace(&folder_text).unannounced().output(0)?;
    let path = folder.join(RECORD);
    let record = fs::read_to_string(&path)?;
    let told = events(&record).and_then(|events| ReportedMark::from_events(&events));
    let what = path.display().to_string();
    told.ok_or(BenchError::Record { what }.into())
}

/// The marks of a record; `None` if it cannot be read.
fn events(record: &str) -> Option<Vec<Event>> {
    let mut signs = [""; 3];
    let mut values = [0; 3];
    let mut events = Vec::new();
    let mut at = 0;
    for line in record.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["$var", _, _, sign, name, ..] => {
                let register = REGISTERS.iter().position(|register| register == name)?;
                signs[register] = sign;
            }
            [time] if time.starts_with('#') => at = time[1..].parse().ok()?,
            [bits, sign] if bits.starts_with('b') => {
                // All are unknown before the first is written.
                let Ok(value) = u8::from_str_radix(&bits[1..], 2) else { continue };
                let register = signs.iter().position(|known| known == sign)?;
                values[register] = value;
                if register == 0 {
                    let mark = Mark::numbered(u32::from(value))?;
                    events.push(event(at, mark, values));
                }
            }
            _ => {}
        }
    }
    Some(events)
}

fn event(at: u64, mark: Mark, [_, low, high]: [u8; 3]) -> Event {
    let value = u16::from_le_bytes([low, high]);
    // What the machine of 16 bits calls an integer has a sign.
    let value = match mark {
        Mark::Integer => i32::from(value as i16) as u32,
        // The upper half of a binary32; the lower half of a tiny float is zero.
        Mark::Float => u32::from(value) << 16,
        _ => u32::from(value),
    };
    Event { at: at / UNITS_PER_CYCLE, mark, value }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A record in the form of simavr 1.6.
    const RECORD: &str = "$timescale 10ns $end\n$scope module logic $end\n\
        $var wire 8 ! GPIOR0 $end\n$var wire 8 \" GPIOR1 $end\n$var wire 8 # GPIOR2 $end\n\
        $upscope $end\n$enddefinitions $end\n$dumpvars\nbxxxxxxxx !\nbxxxxxxxx \"\nbxxxxxxxx #\n$end\n\
        #1556800\nb00000001 !\n#1557200\nb00000010 !\n\
        #1557300\nb11111110 \"\n#1557400\nb11111111 #\n#1557500\nb00000011 !\n";

    #[test]
    fn a_record_is_read() {
        let expected = [
            Event { at: 15_568, mark: Mark::Begin, value: 0 },
            Event { at: 15_572, mark: Mark::End, value: 0 },
            Event { at: 15_575, mark: Mark::Integer, value: -2_i32 as u32 },
        ];
        assert_eq!(events(RECORD).as_deref(), Some(&expected[..]));
        assert_eq!(events("b00000001 !"), None);
    }
}
