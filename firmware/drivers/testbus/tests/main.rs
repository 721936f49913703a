//! The buses keep the contract of embedded-hal-async.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

use std::cell::RefCell;
use std::rc::Rc;

use bittybuzz_chips::{SpiDevice as Chip, Time};
use bittybuzz_testbus::{
    BusError, Event, RegisterFile, Registers, TestDelay, TestI2c, TestSpi, Wires, check_failures,
    run,
};
use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::i2c::{I2c, Operation};
use embedded_hal_async::spi::{Operation as SpiOperation, SpiDevice};

/// Registers that keep their values, at address 0x42 from 1 ms on.
struct Memory([u8; 8]);

impl RegisterFile for Memory {
    fn write(&mut self, register: u16, value: u8, _now: Time) {
        self.0[usize::from(register)] = value;
    }

    fn read(&mut self, register: u16, _now: Time) -> u8 {
        self.0[usize::from(register)]
    }

    fn address(&self, now: Time) -> Option<u8> {
        (now >= Time::from_millis(1)).then_some(0x42)
    }
}

fn bus(wires: &Wires, number_bytes: usize) -> TestI2c {
    let chip = Rc::new(RefCell::new(Registers::new(Memory([0; 8]), number_bytes)));
    TestI2c::new(wires).with(&chip)
}

#[test]
fn registers_count_upwards() {
    for (number_bytes, register) in [(1, &[3][..]), (2, &[0, 3])] {
        let wires = Wires::new();
        let mut bus = bus(&wires, number_bytes);
        let mut read = [0; 3];
        run(async {
            TestDelay(wires.clone()).delay_ms(1).await;
            bus.write(0x42, &[register, &[7, 8, 9]].concat()).await.unwrap();
            bus.write_read(0x42, register, &mut read).await.unwrap();
        });
        assert_eq!(read, [7, 8, 9]);
        let expected = [
            Event::wait_us(1_000),
            Event::write(0x42, &[register, &[7, 8, 9]].concat()),
            Event::read(0x42, register, &[7, 8, 9]),
        ];
        assert_eq!(wires.take_events(), expected);
    }
}

#[test]
fn operations_of_one_direction_follow_each_other() {
    let wires = Wires::new();
    let mut bus = bus(&wires, 1);
    run(async {
        TestDelay(wires.clone()).delay_ms(1).await;
        let mut operations = [Operation::Write(&[2]), Operation::Write(&[5, 6])];
        bus.transaction(0x42, &mut operations).await.unwrap();
    });
    assert_eq!(wires.take_events().last(), Some(&Event::write(0x42, &[2, 5, 6])));
}

#[test]
fn a_chip_that_is_not_there_does_not_acknowledge() {
    let wires = Wires::new();
    let mut bus = bus(&wires, 1);
    assert_eq!(run(bus.write(0x42, &[0, 0])), Err(BusError::Nack), "before its time");
    run(TestDelay(wires.clone()).delay_ms(1));
    assert_eq!(run(bus.write(0x42, &[0, 0])), Ok(()));
    assert_eq!(run(bus.write(0x43, &[0, 0])), Err(BusError::Nack), "another address");
}

#[test]
fn each_transaction_can_fail() {
    let driver = |wires: &Wires| {
        let mut bus = bus(wires, 1);
        run(async {
            TestDelay(wires.clone()).delay_ms(1).await;
            bus.write(0x42, &[0]).await?;
            bus.write(0x42, &[1]).await
        })
    };
    assert_eq!(check_failures(driver, |error| error), 2);
}

/// A chip that answers with the previous byte.
struct Echo(u8);

impl Chip for Echo {
    fn select(&mut self, _selected: bool, _now: Time) {
        self.0 = 0xff;
    }

    fn exchange(&mut self, byte: u8, _now: Time) -> u8 {
        std::mem::replace(&mut self.0, byte)
    }
}

#[test]
fn an_spi_device_is_selected_during_its_transaction() {
    let wires = Wires::new();
    let mut spi = TestSpi::new(&wires, &Rc::new(RefCell::new(Echo(0))));
    let (mut read, mut both, mut place) = ([1; 2], [0; 2], [5, 6]);
    let mut operations = [
        SpiOperation::Write(&[1, 2]),
        SpiOperation::DelayNs(50_000),
        SpiOperation::Read(&mut read),
        SpiOperation::Transfer(&mut both, &[3]),
        SpiOperation::TransferInPlace(&mut place),
    ];
    run(spi.transaction(&mut operations)).unwrap();
    assert_eq!((read, both, place), ([2, 0], [0, 3], [0, 5]));
    let events = wires.take_events();
    assert_eq!(events[0], Event::Select);
    assert_eq!(events[1], Event::Spi { written: vec![1, 2], read: vec![0xff, 1] });
    assert_eq!(events[2], Event::wait_us(50));
    assert_eq!(events.last(), Some(&Event::Release));
}
