//! Tests of the model with `rf24-rs`, an independent driver of the chip.

use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{ErrorType as PinError, OutputPin};
use embedded_hal::spi::{ErrorType as SpiError, Operation, SpiDevice};
use rf24::radio::prelude::*;
use rf24::radio::{RF24, RadioConfig};
use rf24::{CrcLength, DataRate, FifoState, StatusFlags};

use super::{CLOCK_HZ, Nrf24, POWER_ON};
use crate::Time;

/// The time of a byte at 6 MHz.
const BYTE: Time = Time::from_nanos(1_333);

/// Two radios in range of each other.
struct Bench {
    now: Time,
    radios: [Nrf24; 2],
}

impl Bench {
    fn new() -> Rc<RefCell<Bench>> {
        let mut radios = [Nrf24::new(), Nrf24::new()];
        for radio in &mut radios {
            radio.set_clock(CLOCK_HZ, Time::ZERO);
        }
        Rc::new(RefCell::new(Bench { now: POWER_ON, radios }))
    }

    fn wait(&mut self, span: Time) {
        let to = self.now + span;
        loop {
            let next = self.radios.iter().filter_map(Nrf24::next_event).min();
            let Some(at) = next.filter(|at| *at <= to) else { break };
            for radio in &mut self.radios {
                radio.advance(at);
            }
            for sender in 0..2 {
                for sent in self.radios[sender].take_transmissions() {
                    let receiver = &mut self.radios[1 - sender];
                    receiver.sense(sent.packet.channel(), sent.begin, sent.end, Time::ZERO);
                    receiver.receive(sent, true);
                }
            }
        }
        self.now = to;
    }
}

/// A driver's access to a radio.
#[derive(Clone)]
struct Port {
    bench: Rc<RefCell<Bench>>,
    radio: usize,
}

impl SpiError for Port {
    type Error = Infallible;
}

impl SpiDevice for Port {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        let mut bench = self.bench.borrow_mut();
        let mut exchange = |byte: u8| {
            bench.wait(BYTE);
            let now = bench.now;
            bench.radios[self.radio].select(true, now);
            bench.radios[self.radio].transfer(byte, now)
        };
        for operation in operations {
            match operation {
                Operation::Read(bytes) => bytes.iter_mut().for_each(|byte| *byte = exchange(0)),
                Operation::Write(bytes) => bytes.iter().for_each(|byte| {
                    exchange(*byte);
                }),
                Operation::TransferInPlace(bytes) => {
                    bytes.iter_mut().for_each(|byte| *byte = exchange(*byte));
                }
                Operation::Transfer(_, _) | Operation::DelayNs(_) => unreachable!("rf24 has none"),
            }
        }
        let now = bench.now;
        bench.radios[self.radio].select(false, now);
        Ok(())
    }
}

impl PinError for Port {
    type Error = Infallible;
}

impl OutputPin for Port {
    fn set_low(&mut self) -> Result<(), Infallible> {
        let mut bench = self.bench.borrow_mut();
        let now = bench.now;
        bench.radios[self.radio].enable(false, now);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        let mut bench = self.bench.borrow_mut();
        let now = bench.now;
        bench.radios[self.radio].enable(true, now);
        Ok(())
    }
}

impl DelayNs for Port {
    fn delay_ns(&mut self, ns: u32) {
        self.bench.borrow_mut().wait(Time::from_nanos(u64::from(ns)));
    }
}

type Driver = RF24<Port, Port, Port>;

/// Returns a sender and a receiver with this configuration; the receiver listens on pipe 1.
fn pair(config: &RadioConfig) -> (Rc<RefCell<Bench>>, Driver, Driver) {
    let bench = Bench::new();
    let driver = |radio| {
        let port = Port { bench: bench.clone(), radio };
        let mut driver = RF24::new(port.clone(), port.clone(), port);
        driver.init().unwrap();
        driver.with_config(config).unwrap();
        driver
    };
    let (mut sender, mut receiver) = (driver(0), driver(1));
    sender.as_tx(Some(b"robot")).unwrap();
    receiver.open_rx_pipe(1, b"robot").unwrap();
    receiver.as_rx().unwrap();
    bench.borrow_mut().wait(Time::from_millis(1));
    (bench, sender, receiver)
}

fn read(receiver: &mut Driver) -> Option<(u8, Vec<u8>)> {
    let mut pipe = 0;
    if !receiver.available_pipe(&mut pipe).unwrap() {
        return None;
    }
    let mut bytes = [0; 32];
    let length = receiver.read(&mut bytes, None).unwrap();
    Some((pipe, bytes[..usize::from(length)].to_vec()))
}

#[test]
fn it_takes_the_model_for_an_nrf24l01_plus() {
    let bench = Bench::new();
    let port = Port { bench, radio: 0 };
    let mut driver = RF24::new(port.clone(), port.clone(), port);
    driver.init().unwrap();
    assert!(driver.is_plus_variant());
    driver.set_channel(88).unwrap();
    assert_eq!(driver.get_channel().unwrap(), 88);
    for rate in [DataRate::Mbps1, DataRate::Kbps250, DataRate::Mbps2] {
        driver.set_data_rate(rate).unwrap();
        assert_eq!(driver.get_data_rate().unwrap(), rate);
    }
    driver.set_crc_length(CrcLength::Bit8).unwrap();
    assert_eq!(driver.get_crc_length().unwrap(), CrcLength::Bit8);
    driver.set_address_length(3).unwrap();
    assert_eq!(driver.get_address_length().unwrap(), 3);
}

#[test]
fn acknowledged_packets_of_every_length_arrive() {
    let (_bench, mut sender, mut receiver) =
        pair(&RadioConfig::default().with_dynamic_payloads(true));
    for length in 1..=32_u8 {
        let payload: Vec<u8> = (0..length).map(|byte| byte ^ length).collect();
        assert!(sender.send(&payload, false).unwrap(), "{length} bytes");
        assert_eq!(sender.get_last_arc().unwrap(), 0);
        assert_eq!(read(&mut receiver), Some((1, payload)));
        assert_eq!(read(&mut receiver), None);
    }
}

#[test]
fn payloads_of_fixed_length_are_filled_up() {
    let (_bench, mut sender, mut receiver) = pair(&RadioConfig::default().with_payload_length(8));
    assert!(sender.send(&[1, 2, 3], false).unwrap());
    assert_eq!(read(&mut receiver), Some((1, vec![1, 2, 3, 0, 0, 0, 0, 0])));
}

#[test]
fn an_unacknowledged_packet_is_resent_on_request() {
    let config = RadioConfig::default().with_auto_retries(1, 5);
    let (_bench, mut sender, mut receiver) = pair(&config);
    receiver.power_down().unwrap();
    assert!(!sender.send(&[1], false).unwrap(), "MAX_RT");
    assert_eq!(sender.get_last_arc().unwrap(), 5);
    assert_eq!(sender.get_fifo_state(true).unwrap(), FifoState::Occupied);
    receiver.power_up(None).unwrap();
    receiver.as_rx().unwrap();
    assert!(sender.resend().unwrap());
    assert!(read(&mut receiver).is_some());
}

#[test]
fn broadcast_without_acknowledgement() {
    let config = RadioConfig::default().with_dynamic_payloads(true).with_ask_no_ack(true);
    let (bench, mut sender, mut receiver) = pair(&config);
    assert!(sender.send(b"hello", true).unwrap());
    bench.borrow_mut().wait(Time::from_millis(1));
    assert_eq!(read(&mut receiver), Some((1, b"hello".to_vec())));
    assert_eq!(bench.borrow().radios[1].statistics.sent, 0, "no acknowledgement");
}

#[test]
fn acknowledgements_carry_payloads() {
    let config = RadioConfig::default().with_dynamic_payloads(true).with_ack_payloads(true);
    let (_bench, mut sender, mut receiver) = pair(&config);
    assert!(receiver.write_ack_payload(1, b"status").unwrap());
    assert!(sender.send(b"poll", false).unwrap());
    assert_eq!(read(&mut sender), Some((0, b"status".to_vec())));
    assert_eq!(read(&mut receiver), Some((1, b"poll".to_vec())));
}

#[test]
fn irq_follows_the_flags_that_are_not_masked() {
    let (bench, mut sender, mut receiver) = pair(&RadioConfig::default());
    receiver.set_status_flags(StatusFlags::new()).unwrap();
    assert!(bench.borrow().radios[1].irq());
    assert!(sender.send(&[1], false).unwrap());
    assert!(!bench.borrow().radios[1].irq());
    read(&mut receiver);
    assert!(bench.borrow().radios[1].irq());
}

#[test]
fn three_packets_wait_and_the_fourth_is_repeated_until_there_is_room() {
    let config = RadioConfig::default().with_auto_retries(1, 2);
    let (_bench, mut sender, mut receiver) = pair(&config);
    for number in 0..3 {
        assert!(sender.send(&[number], false).unwrap());
    }
    assert_eq!(receiver.get_fifo_state(false).unwrap(), FifoState::Full);
    assert!(!sender.send(&[3], false).unwrap());
    for number in 0..3 {
        assert_eq!(read(&mut receiver).unwrap().1[0], number);
    }
    assert!(sender.resend().unwrap());
    assert_eq!(read(&mut receiver).unwrap().1[0], 3);
}
