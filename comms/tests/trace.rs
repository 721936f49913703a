//! The records of a script's life, written by hand from the table in the module's documentation.

use bittybuzz_comms::trace::{self, PrintedValue, RECORD_MAX, Record, RecordError, Unused};
use bittybuzz_vm_core::{Fault, FaultCode, ImageError, NetworkCounters, Type};
use proptest::prelude::*;

#[test]
fn start() {
    let bytes = [1, 0x34, 0x12, 0x78, 0x56, 0x34, 0x12];
    assert_eq!(trace::start(0x1234, 0x1234_5678).as_slice(), bytes);
    let record = Record::Start { robot_id: 0x1234, script_hash: 0x1234_5678 };
    assert_eq!(Record::decode(&bytes), Ok(record));
}

#[test]
fn log_lines() {
    let bytes = [
        2, 7, 0, 0, 0, 0, 1, 0xfe, 0xff, 0xff, 0xff, 2, 0, 0, 0xc0, 0x3f, 3, 9, 0, 4, 2, b'h',
        b'i', 5, 3, 0, 6, 7,
    ];
    let Ok(Record::Log { step: 7, items }) = Record::decode(&bytes) else { panic!("no log line") };
    let items: Result<Vec<PrintedValue<'_>>, RecordError> = items.collect();
    let expected = [
        PrintedValue::Nil,
        PrintedValue::Int(-2),
        PrintedValue::Float(1.5),
        PrintedValue::String(9),
        PrintedValue::Text(b"hi"),
        PrintedValue::Table(3),
        PrintedValue::Function,
        PrintedValue::Rest,
    ];
    assert_eq!(items.as_deref(), Ok(&expected[..]));
}

#[test]
fn unused_messages() {
    let bytes = [8, 1, 2, 3, 0, 4, 0, 5, 0, 6, 0, 7, 0, 8, 0, 9, 0, 10, 0];
    let messages = NetworkCounters {
        foreign: 4,
        malformed: 5,
        own_id: 6,
        not_kept: 7,
        incomplete: 8,
        undecided: 9,
        failed: 10,
    };
    let unused = Unused { dropped: [0x0201, 3], messages };
    assert_eq!(trace::unused(&unused).as_slice(), bytes);
    assert_eq!(Record::decode(&bytes), Ok(Record::Unused(unused)));
    assert_eq!(Record::decode(&bytes[..16]), Err(RecordError::Length));
}

#[test]
fn faults() {
    let fault = Fault {
        code: FaultCode::WrongType,
        position: 0x0102,
        operands: [Type::Nil, Type::Int],
        detail: 5,
    };
    let bytes = [3, 9, 0, 0, 0, 1, 0, 1, 5, 0, 0x02, 0x01, 0x40, 0x00];
    assert_eq!(trace::fault(9, &fault, [0x0102, 0x0040].into_iter()).as_slice(), bytes);
    let Ok(Record::Fault { step: 9, fault: read, calls }) = Record::decode(&bytes) else {
        panic!("no fault")
    };
    assert_eq!((read, calls.collect::<Vec<_>>()), (fault, vec![0x0102, 0x0040]));
}

/// The record of a listener's fault has the fields of other faults, and another kind.
#[test]
fn contained_faults() {
    let fault = Fault {
        code: FaultCode::WrongType,
        position: 0x0102,
        operands: [Type::Nil, Type::Int],
        detail: 5,
    };
    let bytes = [9, 9, 0, 0, 0, 1, 0, 1, 5, 0, 0x02, 0x01, 0x40, 0x00];
    assert_eq!(trace::contained(9, &fault, [0x0102, 0x0040].into_iter()).as_slice(), bytes);
    let Ok(Record::Contained { step: 9, fault: read, calls }) = Record::decode(&bytes) else {
        panic!("no contained fault")
    };
    assert_eq!((read, calls.collect::<Vec<_>>()), (fault, vec![0x0102, 0x0040]));
}

#[test]
fn restarts() {
    let bytes = [10, 9, 1, 0, 0, 0x58, 0x02];
    assert_eq!(trace::restart(265, 600).as_slice(), bytes);
    assert_eq!(Record::decode(&bytes), Ok(Record::Restart { step: 265, pause: 600 }));
    assert_eq!(Record::decode(&trace::restart(0, 0)), Ok(Record::Restart { step: 0, pause: 0 }));
    assert_eq!(Record::decode(&bytes[..6]), Err(RecordError::Length));
}

/// A stack can have more calls than fit in a record, which then has the innermost ones.
#[test]
fn deep_faults_are_cut() {
    let fault =
        Fault { code: FaultCode::StackOverflow, position: 3, operands: [Type::Nil; 2], detail: 0 };
    let bytes = trace::fault(1, &fault, (0..500).map(|call| 3 + call));
    let Ok(Record::Fault { calls, .. }) = Record::decode(&bytes) else { panic!("no fault") };
    let calls: Vec<u16> = calls.collect();
    // Ten bytes precede the calls, and each call takes two of the other 86.
    assert_eq!(calls, (3..46).collect::<Vec<_>>());
    assert_eq!(bytes.len(), RECORD_MAX);
}

#[test]
fn every_refusal() {
    let all: Vec<ImageError> =
        (0..=u8::MAX).filter_map(|cause| ImageError::from_code(cause, 0x21)).collect();
    assert!(all.len() >= 17, "{all:?}");
    for error in all {
        assert_eq!(Record::decode(&trace::refused(error)), Ok(Record::Refused(error)));
    }
}

#[test]
fn overruns_and_expiry() {
    assert_eq!(
        Record::decode(&[5, 1, 0, 0, 0, 2, 1, 0, 0]),
        Ok(Record::Overrun { step: 1, missed: 258 })
    );
    assert_eq!(
        Record::decode(&trace::overrun(1, 258)),
        Ok(Record::Overrun { step: 1, missed: 258 })
    );
    assert_eq!(Record::decode(&trace::expired(4)), Ok(Record::Expired { step: 4 }));
    assert_eq!(Record::decode(&[7, 3, 0, 0, 0]), Ok(Record::Lost(3)));
    assert_eq!(Record::decode(&trace::lost(3)), Ok(Record::Lost(3)));
}

#[test]
fn damaged_records_are_errors() {
    assert_eq!(Record::decode(&[]), Err(RecordError::Length));
    assert_eq!(Record::decode(&[99]), Err(RecordError::Kind(99)));
    assert_eq!(Record::decode(&[6, 1, 2, 3]), Err(RecordError::Length));
    assert_eq!(Record::decode(&[6, 1, 2, 3, 4, 5]), Err(RecordError::Length));
    assert_eq!(Record::decode(&[3, 0, 0, 0, 0, 77, 0, 0, 0, 0]), Err(RecordError::Value));
    assert_eq!(Record::decode(&[3, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]), Err(RecordError::Length));
    assert_eq!(Record::decode(&[2, 0, 0, 0, 0, 4, 9, b'x']), Err(RecordError::Length));
    assert_eq!(Record::decode(&[2, 0, 0, 0, 0, 8]), Err(RecordError::Value));
    assert_eq!(Record::decode(&[4, 200, 0, 0]), Err(RecordError::Value));
}

proptest! {
    #[test]
    fn any_bytes_are_read_without_harm(bytes in prop::collection::vec(any::<u8>(), 0..120)) {
        if let Ok(Record::Log { items, .. }) = Record::decode(&bytes) {
            prop_assert!(items.count() <= bytes.len());
        }
    }
}
