//! A Kilobot that listens for a computer: what it hears comes out of its debug line.

use std::io::Write;
use std::process::{Command, Stdio};

use bittybuzz_comms::infrared::{self, FaultReport, MESSAGE};
use bittybuzz_hil::{Command as Tell, EmulatorEvent, Kilobots, ScriptFile, ear};
use bittybuzz_tests::bbz;
use bittybuzz_vm_core::{Fault, FaultCode, Type};

/// What came out of the line.
fn lines(robots: &Kilobots) -> Vec<String> {
    let bytes: Vec<u8> = robots.events[0]
        .iter()
        .filter_map(|event| match &event.event {
            EmulatorEvent::Serial { bytes } => Some(bytes.clone()),
            _ => None,
        })
        .flatten()
        .collect();
    String::from_utf8(bytes).unwrap().lines().map(str::to_owned).collect()
}

fn line(message: &[u8; MESSAGE]) -> String {
    let digits: String = message.iter().map(|byte| format!("{byte:02x}")).collect();
    format!("ir {digits}")
}

/// Somebody sends these, one right after the other, at 4.4 ms each.
fn send(robots: &mut Kilobots, messages: &[[u8; MESSAGE]]) {
    for message in messages {
        robots.execute_on(0, &Tell::Radio { at: robots.now(), payload: message.to_vec() });
    }
    robots.run_ms(10 * messages.len() as u64 + 50);
}

#[test]
fn every_message_is_printed_unchanged() {
    let mut robots = Kilobots::with_program(&ear(), 1);
    robots.run_ms(20);
    let mut messages: Vec<[u8; MESSAGE]> =
        (0..12).map(|number| infrared::sealed(8 + number, &[0xf0 | number; 9])).collect();
    // Damaged on the way: whoever reads the line finds out.
    messages[5][2] ^= 4;
    send(&mut robots, &messages);
    assert_eq!(lines(&robots), messages.iter().map(line).collect::<Vec<_>>());
    for message in &messages {
        assert_eq!(infrared::from_line(line(message).as_bytes()), Some(*message));
    }
}

/// The receiver reads 40 messages that follow each other without a gap, and tells what it has room for.
#[test]
fn a_flood_leaves_whole_lines() {
    let mut robots = Kilobots::with_program(&ear(), 1);
    robots.run_ms(20);
    let messages: Vec<[u8; MESSAGE]> =
        (0..40).map(|number| infrared::sealed(8, &[number; 9])).collect();
    send(&mut robots, &messages);
    let printed = lines(&robots);
    assert!((30..=40).contains(&printed.len()), "{}", printed.len());
    let known: Vec<String> = messages.iter().map(line).collect();
    let places: Vec<Option<usize>> =
        printed.iter().map(|line| known.iter().position(|known| known == line)).collect();
    assert!(places.is_sorted() && !places.contains(&None), "{printed:?}");
}

/// KiloGUI can give it another program: it goes to the boot loader, which is not there in emulation.
#[test]
fn the_controller_starts_programming() {
    let mut robots = Kilobots::with_program(&ear(), 1);
    robots.execute_on(0, &Tell::Write { address: 0x7000, bytes: vec![0xff, 0xcf] });
    robots.run_ms(20);
    send(&mut robots, &[infrared::sealed(0x80, &[0; 9])]);
    let before = lines(&robots).len();
    send(&mut robots, &[infrared::sealed(8, &[0; 9])]);
    assert_eq!(lines(&robots).len(), before, "it does not listen any more");
}

#[test]
fn a_trace_of_its_lines_names_file_and_line() {
    let script = ScriptFile::new("ear", "function step() {\n  x = 1 / (x0 - x0)\n}\nx0 = 1\n");
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("ear").display().to_string();
    let built = bbz::run(&["build", script.path(), "--robot", "kilobot", "-o", &out], &[]);
    assert_eq!(built.status, Some(0), "{}", built.stderr);
    let text = std::fs::read_to_string(format!("{out}.sym")).unwrap();
    let known = bittybuzz_compiler::symbols::Symbols::from_json(&text).unwrap();
    let position = (0..200).rev().find(|at| known.position(*at).is_some_and(|at| at.line == 2));
    let fault = Fault {
        code: FaultCode::DivisionByZero,
        position: position.unwrap() as u16,
        operands: [Type::Int; 2],
        detail: 0,
    };
    let script_hash = known.script_hash as u16;
    let report =
        FaultReport { robot: 9, script: script_hash, fault: Some(fault), is_contained: false };
    let mut robots = Kilobots::with_program(&ear(), 1);
    robots.run_ms(20);
    let other = infrared::sealed(8, &[1; 9]);
    send(&mut robots, &[other, report.message(), other, report.message()]);
    let mut child = Command::new(bbz::path())
        .args(["trace", "-", "--robot", "kilobot", "--script", script.path()])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let lines = lines(&robots).join("\r\n") + "\r\n";
    child.stdin.take().unwrap().write_all(lines.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    let printed = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{printed}");
    assert_eq!(printed.matches("error[R0005]").count(), 1, "{printed}");
    assert!(printed.contains(&format!("{}:2:", script.path())), "{printed}");
    assert_eq!(String::from_utf8(output.stdout).unwrap(), "");
}
