//! Log records at their greatest length, from the arguments of a script's `log(...)`.

use bittybuzz_comms::trace::{self, Encoded, PrintedValue, RECORD_MAX, Record};
use bittybuzz_testkit::Program;
use bittybuzz_vm_core::number::Full;
use bittybuzz_vm_core::{
    Axis, ByteCode, CallArguments, Entry, Host, Image, Outcome, Reply, RobotFault, Value, Vm,
};

/// A robot that keeps the record of the last `log(...)`.
#[derive(Default)]
struct Robot {
    /// The time that is added to the record.
    ms: Option<i32>,
    record: Encoded,
}

impl Host<Full> for Robot {
    fn call<C: ByteCode, const N: usize>(
        &mut self,
        _: u16,
        _: CallArguments<'_, Full, C, N>,
        _: bool,
    ) -> Result<Reply<Full>, RobotFault> {
        Ok(Reply::Value(Value::nil()))
    }

    fn log<C: ByteCode, const N: usize>(&mut self, arguments: CallArguments<'_, Full, C, N>) {
        self.record = match self.ms {
            Some(ms) => trace::log_with_time(0, &arguments, ms),
            None => trace::log(0, &arguments),
        };
    }

    fn delay_is_over(&mut self, _: i32, _: bool) -> bool {
        true
    }

    fn position(&mut self, _: Axis) -> Option<f32> {
        None
    }
}

/// Returns the record of a script's `log(...)`, with a time if there is one.
fn record(script: &str, ms: Option<i32>) -> Encoded {
    let program = Program::new::<Full>(script);
    let mut vm: Box<Vm<Full, &[u8], 900>> = Box::new(Vm::new());
    vm.load(Image::new(program.image.as_slice()), |_| true).expect("the image is sound");
    let mut robot = Robot { ms, ..Robot::default() };
    assert!(vm.begin(Entry::Global));
    loop {
        match vm.run(&mut robot, u16::MAX) {
            Outcome::Done => return robot.record,
            Outcome::Pending | Outcome::Waiting => {}
            Outcome::Fault(fault) => panic!("{fault:?}"),
        }
    }
}

/// Returns the record of `nils` nils, then `ints` times 7, and then `rest`.
fn numbers(nils: usize, ints: usize, rest: &[&str], ms: Option<i32>) -> Encoded {
    let values = [&vec!["nil"; nils][..], &vec!["7"; ints], rest].concat();
    record(&format!("log({})", values.join(",")), ms)
}

/// Returns the record of a text of this length that was made at run time.
fn text(length: usize) -> Encoded {
    let script = format!(
        "log(string.concat(\"{}\", \"{}\"))",
        "a".repeat(length / 2),
        "b".repeat(length - length / 2)
    );
    record(&script, None)
}

fn items(record: &Encoded) -> Vec<PrintedValue<'_>> {
    let Ok(Record::Log { step: 0, items }) = Record::decode(record) else {
        panic!("no log record: {record:?}")
    };
    items.map(|item| item.expect("it was encoded here")).collect()
}

/// Five bytes precede the items. A nil takes one byte and an integer five.
#[test]
fn a_full_record_has_room_to_report_the_rest() {
    // 90 bytes are taken, so a last integer leaves one byte free.
    let fits = numbers(0, 18, &[], None);
    assert_eq!((fits.len(), items(&fits).len()), (RECORD_MAX - 1, 18));
    let full = numbers(0, 18, &["nil"], None);
    assert_eq!((full.len(), items(&full).len()), (RECORD_MAX, 19));
    assert_eq!(items(&full).last(), Some(&PrintedValue::Rest));
    // 91 bytes are taken: a further integer would take the byte for the tag of the rest.
    let full = numbers(1, 17, &["7", "7"], None);
    assert_eq!((full.len(), items(&full).len()), (RECORD_MAX - 4, 19));
    assert_eq!(items(&full).last(), Some(&PrintedValue::Rest));
}

/// A text has a tag and a length before its bytes.
#[test]
fn a_long_text_is_cut() {
    for (length, kept) in [(87, 87), (88, 88), (89, 88), (200, 88)] {
        let record = text(length);
        let items = items(&record);
        let [PrintedValue::Text(text), rest @ ..] = &items[..] else { panic!("{items:?}") };
        assert_eq!(text.len(), kept, "{length}");
        let is_cut = kept < length;
        assert_eq!(rest, &[PrintedValue::Rest][..usize::from(is_cut)], "{length}");
        assert_eq!(record.len(), 5 + 2 + kept + usize::from(is_cut), "{length}");
    }
}

/// A robot counts the entries of a table only once in a line.
#[test]
fn a_table_that_is_named_often_has_the_same_size_each_time() {
    let script = "t = { .a = 1, .b = 2 } u = { .c = nil, .d = 4 } f = function() { }
        log(nil, t, 7, u, t, \"text\", f, u, t, 7, {})";
    let [two, one, none] = [2, 1, 0].map(PrintedValue::Table);
    let record = record(script, None);
    let items = items(&record).into_iter();
    let sizes: Vec<_> = items.filter(|item| matches!(item, PrintedValue::Table(_))).collect();
    assert_eq!(sizes, [two, one, two, one, two, none]);
}

/// The items of a time take 19 bytes: a text of seven, an integer and a text of three.
#[test]
fn a_time_is_left_out_if_it_does_not_fit() {
    let fits = numbers(2, 14, &[], Some(-5));
    assert_eq!(fits.len(), RECORD_MAX);
    let time = [PrintedValue::Text(b" after "), PrintedValue::Int(-5), PrintedValue::Text(b" ms")];
    assert_eq!(items(&fits)[16..], time);
    let full = numbers(3, 14, &[], Some(-5));
    assert_eq!((full.len(), items(&full).len()), (RECORD_MAX - 18, 17));
}
