//! The traffic on the bus, compared with that of crazyflie-firmware 2a18fc29 (pmw3901.c).

use bittybuzz_testbus::{Event, Wires, run};

use crate::chip::{Bench, Defect};

/// The list of registers of that file, in the order of its calls; a number alone is a pause in
/// milliseconds.
const LIST: &str = "7F=00 61=AD 7F=03 40=00 7F=05 41=B3 43=F1 45=14 5B=32 5F=34 7B=08 7F=06 44=1B \
    40=BF 4E=3F 7F=08 65=20 6A=18 7F=09 4F=AF 5F=40 48=80 49=80 57=77 60=78 61=78 62=08 63=50 \
    7F=0A 45=60 7F=00 4D=11 55=80 74=1F 75=1F 4A=78 4B=78 44=08 45=50 64=FF 65=1F 7F=14 65=67 \
    66=08 63=70 7F=15 48=48 7F=07 41=0D 43=14 4B=0E 45=0F 44=42 4C=80 7F=10 5B=02 7F=07 40=41 \
    70=00 10 32=44 7F=07 40=40 7F=06 62=F0 63=00 7F=0D 48=C0 6F=D5 7F=00 5B=A0 4E=A8 5A=50 40=80 \
    7F=00 5A=10 54=00";

/// Returns the events of a reading.
fn read(register: u8, value: u8) -> Vec<Event> {
    vec![
        Event::Select,
        Event::wait_us(50),
        Event::Spi { written: vec![register], read: vec![0xff] },
        Event::wait_us(500),
        Event::Spi { written: vec![0x00], read: vec![value] },
        Event::wait_us(50),
        Event::Release,
        Event::wait_us(200),
    ]
}

/// Returns the events of a write.
fn write(register: u8, value: u8) -> Vec<Event> {
    vec![
        Event::Select,
        Event::wait_us(50),
        Event::Spi { written: vec![register | 0x80], read: vec![0xff] },
        Event::wait_us(50),
        Event::Spi { written: vec![value], read: vec![0xff] },
        Event::wait_us(50),
        Event::Release,
        Event::wait_us(200),
    ]
}

fn list() -> Vec<Event> {
    let byte = |text: &str| u8::from_str_radix(text, 16).unwrap();
    let entry = |text: &str| match text.split_once('=') {
        Some((register, value)) => write(byte(register), byte(value)),
        None => vec![Event::wait_us(text.parse::<u32>().unwrap() * 1_000)],
    };
    LIST.split_whitespace().flat_map(entry).collect()
}

#[test]
fn the_chip_starts_as_in_bitcrazes_firmware() {
    let wires = Wires::new();
    let mut bench = Bench::new(&wires, Defect::None);
    bench.start().unwrap();
    let select = vec![
        Event::wait_us(40_000),
        Event::wait_us(2_000),
        Event::Select,
        Event::wait_us(2_000),
        Event::Release,
        Event::wait_us(2_000),
    ];
    let expected = [
        select,
        read(0x00, 0x49),
        read(0x5f, 0xb6),
        write(0x3a, 0x5a),
        vec![Event::wait_us(5_000)],
        read(0x02, 0x00),
        read(0x03, 0x00),
        read(0x04, 0x00),
        read(0x05, 0x00),
        read(0x06, 0x00),
        vec![Event::wait_us(1_000)],
        list(),
        // Bitcraze's driver does not check the identity again.
        read(0x00, 0x49),
        read(0x5f, 0xb6),
    ];
    assert_eq!(wires.take_events(), expected.concat());
    assert!(wires.now().nanos() < 110_000_000, "{:?}", wires.now());
    let chip = bench.chip.borrow();
    assert_eq!(chip.values.get(&(0x09, 0x57)), Some(&0x77), "a register in a bank");
}

#[test]
fn a_reading_is_one_burst() {
    let wires = Wires::new();
    let mut bench = Bench::new(&wires, Defect::None);
    let sensor = bench.start().unwrap();
    let burst = [0xb0, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12];
    bench.chip.borrow_mut().burst = burst;
    wires.take_events();
    let before = wires.now();
    run(sensor.read(&mut bench.spi, &mut bench.delay)).unwrap();
    let expected = [
        Event::Select,
        Event::wait_us(50),
        Event::Spi { written: vec![0x16], read: vec![0xff] },
        Event::wait_us(50),
        Event::Spi { written: vec![0; 12], read: burst.to_vec() },
        Event::wait_us(50),
        Event::Release,
        Event::wait_us(50),
    ];
    assert_eq!(wires.take_events(), expected);
    // The chip is selected for 0.24 ms, as the documentation says.
    let selected = (wires.now() - before).nanos() - 50_000;
    assert!((225_000..245_000).contains(&selected), "{selected}");
}
