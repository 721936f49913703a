//! Emulators as child processes: they are given a program, and write what it tells.

use crate::elf;
use bittybuzz_on_chip::Report;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

/// How to start an emulator.
pub struct Emulator {
    pub program: &'static str,
    pub machine: [&'static str; 2],
    /// The last is followed by the file.
    pub arguments: &'static [&'static str],
    pub feed: Feed,
}

/// What it takes as its file.
#[derive(Clone, Copy)]
pub enum Feed {
    Elf,
    /// The content of the flash: an ELF file must be linked for the very chip.
    Flash,
}

/// How long it may say nothing: many times what the longest program takes.
const PATIENCE: Duration = Duration::from_secs(60);

impl Emulator {
    /// The lines that a program tells, up to so many; fewer if it ends or falls silent.
    pub fn run(&self, elf: &[u8], file: &Path, lines: usize) -> Vec<String> {
        let content = match self.feed {
            Feed::Elf => elf,
            Feed::Flash => &elf::flash(elf),
        };
        fs::write(file, content).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let mut command = Command::new(self.program);
        command.args(self.machine).args(self.arguments).arg(file);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let child = command.spawn();
        let child = child.unwrap_or_else(|error| panic!("{}: {error}", self.program));
        let printed = listen(Running(child), lines);
        let _ = fs::remove_file(file);
        printed
    }
}

/// Some emulators go on after the program's end: ended when it is dropped.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn listen(mut child: Running, lines: usize) -> Vec<String> {
    let (sender, receiver) = mpsc::channel();
    // simavr tells on the standard error.
    let output: Box<dyn Read + Send> = Box::new(child.0.stdout.take().expect("it is piped"));
    let error: Box<dyn Read + Send> = Box::new(child.0.stderr.take().expect("it is piped"));
    let readers = [output, error].map(|stream| {
        let sender = sender.clone();
        thread::spawn(move || {
            let lines = BufReader::new(stream).lines().map_while(Result::ok);
            for report in lines.filter_map(|line| report(&line)) {
                // Nobody listens any more once there are enough.
                let _ = sender.send(report);
            }
        })
    });
    // Silence is then the end of both.
    drop(sender);
    let printed = (0..lines).map_while(|_| receiver.recv_timeout(PATIENCE).ok()).collect();
    drop(child);
    for reader in readers {
        let _ = reader.join();
    }
    printed
}

/// The report in a line. simavr puts colors around it and a point in place of the newline.
fn report(line: &str) -> Option<String> {
    const LENGTH: usize = Report::LENGTH - 1;
    let is_report = |part: &&[u8]| {
        part.iter().enumerate().all(|(at, byte)| match at {
            8 | 17 => *byte == b' ',
            _ => byte.is_ascii_hexdigit(),
        })
    };
    let found = line.as_bytes().windows(LENGTH).find(is_report)?;
    Some(String::from_utf8_lossy(found).into_owned())
}

#[test]
fn a_report_is_found() {
    let expected = Some("0a1b2c3d 000000ff 209".to_owned());
    assert_eq!(report("0a1b2c3d 000000ff 209"), expected);
    assert_eq!(report("\u{1b}[32m0a1b2c3d 000000ff 209.\u{1b}[0m"), expected);
    assert_eq!(report("Loaded 52306 .text at address 0x0"), None);
}
