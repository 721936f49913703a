//! Measures the speed of ten emulated Zooids relative to real time, in the dark and under the
//! projector.
//!
//! ```sh
//! cargo xtask build zooids
//! cargo run --locked --release -p bittybuzz-emulate-m0 --example m0_speed -- \
//!     firmware/zooids/target/thumbv6m-none-eabi/release/bittybuzz-zooids
//! ```
//!
//! The result is in simulated seconds per second of processor time (Linux), which other programs
//! disturb less than wall-clock time. Under `valgrind --tool=callgrind` the run counts instructions
//! of the host.

use std::error::Error;
use std::fmt::Write;
use std::path::Path;
use std::{env, fs, io};

use bittybuzz_cortex_m0::CortexM0;
use bittybuzz_zooids_board::ZooidBoard;

const ROBOTS: usize = 10;
const SECONDS: u64 = 60;

fn main() -> Result<(), Box<dyn Error>> {
    let elf = env::args_os().nth(1).ok_or("which image? the path of its ELF file")?;
    for (name, is_tracked) in [("in the dark", false), ("tracked", true)] {
        let commands = commands(Path::new(&elf), is_tracked)?;
        let mut replies = Vec::new();
        let before = processor_seconds()?;
        bittybuzz_emulation::serve::<CortexM0<ZooidBoard>>(
            ROBOTS,
            commands.as_bytes(),
            &mut replies,
        )?;
        let took = processor_seconds()? - before;
        let replies = String::from_utf8_lossy(&replies);
        if let Some(error) = replies.lines().find(|line| line.contains(r#""reply":"error""#)) {
            return Err(error.into());
        }
        println!("{ROBOTS} Zooids {name}: {:.1} times real time", SECONDS as f64 / took);
    }
    Ok(())
}

/// Returns the commands for a run, in the protocol of docs/emulation.md.
fn commands(elf: &Path, is_tracked: bool) -> Result<String, Box<dyn Error>> {
    let elf = elf.to_str().ok_or("the path is no text")?.replace('\\', "\\\\").replace('"', "\\\"");
    let mut commands = format!("{{\"command\":\"load\",\"elf\":\"{elf}\"}}\n");
    for robot in (0..ROBOTS).filter(|_| is_tracked) {
        let (x, heading) = (300 + 40 * robot, 10 * robot);
        writeln!(
            commands,
            r#"{{"robot":{robot},"command":"place","x_mm":{x},"y_mm":400,"heading_degrees":{heading}}}"#
        )?;
    }
    writeln!(commands, r#"{{"command":"run","until_ns":{}}}"#, SECONDS * 1_000_000_000)?;
    Ok(commands)
}

/// Returns the processor time of this program in seconds.
fn processor_seconds() -> io::Result<f64> {
    let times = fs::read_to_string("/proc/self/schedstat")?;
    let nanos = times.split_whitespace().next().and_then(|nanos| nanos.parse::<f64>().ok());
    nanos.map(|nanos| nanos * 1e-9).ok_or_else(|| io::Error::other("no time in schedstat"))
}
