//! simavr: records the cycle at which the program writes each mark.
//!
//! The record is a value change dump (IEEE 1364, section 18): `$var wire 8 ! GPIOR0 $end` assigns a
//! sign to a register, `#12` is a time, `b00000001 !` the new value of a register.

use crate::error::BenchError;
use crate::marks::{MarkRecord, ReportedMark};
use anyhow::Result;
use bittybuzz_bench::Mark;
use bittybuzz_builds::shell::Invocation;
use fs_err as fs;
use std::path::Path;

pub const RUNNER: &str = "simavr";

/// The file name of simavr's record.
const RECORD: &str = "gtkwave_trace.vcd";
/// The unit of the record is 10 ns: at 1 MHz a cycle has a hundred units, so no time is rounded.
const FREQUENCY: &str = "1000000";
const UNITS_PER_CYCLE: u64 = 100;
/// The ATmega1284P has a program counter of 16 bits like the ATmega328P and takes the same cycles
/// for every instruction, but it has four times the flash: the complete machine with its test
/// program does not fit the ATmega328P.
const CHIP: &str = "atmega1284p";
/// The registers of the mark, and of the low and high byte of its value.
const REGISTERS: [&str; 3] = ["GPIOR0", "GPIOR1", "GPIOR2"];

/// Runs a program.
pub fn run(program: &Path, folder: &Path) -> Result<ReportedMark> {
    let (program, folder_text) = (program.display().to_string(), folder.display().to_string());
    let arguments = ["-m", CHIP, "-f", FREQUENCY, &program];
    // simavr writes its record to the working folder.
    Invocation::new(RUNNER, &arguments).in_workspace(&folder_text).unannounced().output(0)?;
    let path = folder.join(RECORD);
    let record = fs::read_to_string(&path)?;
    let told = events(&record).and_then(|events| ReportedMark::from_events(&events));
    let what = path.display().to_string();
    told.ok_or(BenchError::Record { what }.into())
}

/// Reads the marks of a record; `None` if it cannot be read.
fn events(record: &str) -> Option<Vec<MarkRecord>> {
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
                // The registers are unknown until they are written.
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

fn event(at: u64, mark: Mark, [_, low, high]: [u8; 3]) -> MarkRecord {
    let value = u16::from_le_bytes([low, high]);
    // An integer of the 16-bit machine has a sign.
    let value = match mark {
        Mark::Integer => i32::from(value as i16) as u32,
        // The value is the upper half of a binary32; the lower half of a tiny float is zero.
        Mark::Float => u32::from(value) << 16,
        _ => u32::from(value),
    };
    MarkRecord { at: at / UNITS_PER_CYCLE, mark, value }
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
            MarkRecord { at: 15_568, mark: Mark::Begin, value: 0 },
            MarkRecord { at: 15_572, mark: Mark::End, value: 0 },
            MarkRecord { at: 15_575, mark: Mark::Integer, value: -2_i32 as u32 },
        ];
        assert_eq!(events(RECORD).as_deref(), Some(&expected[..]));
        assert_eq!(events("b00000001 !"), None);
    }
}
