//! Firmware files, and what firmware reports.

use std::sync::Arc;

use bittybuzz_robot_files::find;
use bittybuzz_trace_reader::{MessageContent, Table, TraceMessage, TraceReader};

use super::LIMITS;
use crate::firmware;
use crate::probe_rs;

#[path = "../../tests/support/elf.rs"]
mod elf;

use elf::Segment;

#[test]
fn firmware_of_any_shape() {
    let robot = find("crazyflie").unwrap();
    let layout = probe_rs::layout(&robot).unwrap();
    let read = |bytes: &[u8]| drop(firmware::check_bytes(bytes, &layout));
    let at = layout.application.address;
    fn segment(at: u32, bytes: &[u8]) -> Segment<'_> {
        Segment { at, runs_at: at, bytes }
    }
    LIMITS.check("segments", 1000, |n| elf::arm(&vec![segment(at, &[1, 2, 3, 4]); n]), read);
    LIMITS.check("a long segment", 100_000, |n| elf::arm(&[segment(at, &vec![0; n])]), read);
    let cut = |n| elf::arm(&vec![segment(at, &[1, 2, 3, 4]); n])[..40 * n].to_vec();
    LIMITS.check("segments without content", 1000, cut, read);
}

/// Texts of messages, in the firmware's file.
#[test]
fn messages_of_any_shape() {
    let read = |bytes: &[u8]| drop(Table::parse(bytes));
    let many = |n: usize| {
        let texts: Vec<String> = (0..n).map(|i| format!("message {i}")).collect();
        let messages = texts.iter().enumerate();
        let messages: Vec<_> =
            messages.map(|(i, text)| (i as u16, "defmt_info", text.as_str())).collect();
        elf::with_messages("rzcobs", &messages)
    };
    LIMITS.check("messages", 500, many, read);
    let long = |n| elf::with_messages("raw", &[(1, "defmt_info", &"x".repeat(n))]);
    LIMITS.check("a long message", 20_000, long, read);
    let values = |n| elf::with_messages("raw", &[(1, "defmt_info", &"{=u8}".repeat(n))]);
    LIMITS.check("a message with many values", 5000, values, read);
}

/// Returns a table of three messages.
fn table(encoding: &str) -> Arc<Table> {
    let messages =
        [(1, "defmt_info", "x"), (2, "defmt_info", "bbz {=[u8]}"), (3, "defmt_info", "{=str}")];
    Arc::new(Table::parse(&elf::with_messages(encoding, &messages)).unwrap().unwrap())
}

/// Bytes that firmware writes. Emulators pass them in pieces.
#[test]
fn reports_of_any_shape() {
    const MESSAGES: [(u16, &str, &str); 3] =
        [(1, "defmt_info", "x"), (2, "defmt_info", "bbz {=[u8]}"), (3, "defmt_info", "{=str}")];
    for encoding in ["raw", "rzcobs"] {
        let table = Table::parse(&elf::with_messages(encoding, &MESSAGES)).unwrap().unwrap();
        let table = Arc::new(table);
        let read = |bytes: &[u8]| {
            let mut reader = TraceReader::new(table.clone());
            bytes.chunks(64).for_each(|piece| drop(reader.read(piece)));
        };
        let check = |shape: &str, unit: &[u8]| {
            LIMITS.check(&format!("{encoding}: {shape}"), 20_000, |n| unit.repeat(n), read);
        };
        check("zeros", &[0]);
        check("ones", &[0xff]);
        check("short messages", &[1, 0]);
        check("bytes that end nothing", &[7]);
        // A text of 16 MB begins.
        let long = |n| [&[3, 0, 0, 0, 0, 1], &*vec![b'a'; n]].concat();
        LIMITS.check(&format!("{encoding}: an open text"), 20_000, long, read);
    }
}

#[test]
fn a_message_after_one_without_an_end_is_read() {
    let mut reader = TraceReader::new(table("rzcobs"));
    let contents = |messages: Vec<TraceMessage>| {
        messages.into_iter().map(|message| message.content).collect::<Vec<_>>()
    };
    let endless = vec![7; 4096];
    let read: Vec<_> = (0..20).flat_map(|_| contents(reader.read(&endless))).collect();
    assert_eq!(read, [MessageContent::Undecodable]);
    // Its end, and the first message: number 1 as two bytes, and the bitmap of the zeros after it.
    assert_eq!(contents(reader.read(&[7, 0, 1])), []);
    assert_eq!(contents(reader.read(&[0x7e, 0])), [MessageContent::Text("x".to_owned())]);
}
