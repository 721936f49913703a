//! Nothing that a chip answers panics the driver.

use std::cell::RefCell;
use std::rc::Rc;

use bittybuzz_bmi088::{Accelerometer, Address, DataReady, Error, Gyroscope};
use bittybuzz_chips::Time;
use bittybuzz_testbus::{RegisterFile, Registers, TestDelay, TestI2c, Wires, run};
use proptest::prelude::*;

/// A chip at any of the addresses that answers with a sequence of bytes, again and again.
struct Noise {
    address: u8,
    bytes: Vec<u8>,
    next: usize,
}

impl RegisterFile for Noise {
    fn write(&mut self, _register: u16, _value: u8, _now: Time) {}

    fn read(&mut self, register: u16, _now: Time) -> u8 {
        // With the right identity the driver goes on.
        if register == 0 {
            return if self.address == 0x69 { 0x0f } else { 0x1e };
        }
        self.next = (self.next + 1) % self.bytes.len();
        self.bytes[self.next]
    }

    fn address(&self, _now: Time) -> Option<u8> {
        Some(self.address)
    }
}

proptest! {
    #[test]
    fn no_answer_panics(bytes in prop::collection::vec(any::<u8>(), 1..80)) {
        let wires = Wires::new();
        let noise = |address| {
            let noise = Noise { address, bytes: bytes.clone(), next: 0 };
            Rc::new(RefCell::new(Registers::new(noise, 1)))
        };
        let mut bus = TestI2c::new(&wires).with(&noise(0x69)).with(&noise(0x18));
        let mut delay = TestDelay(wires.clone());
        run(async {
            let bus = &mut bus;
            let start =
                Gyroscope::start(bus, &mut delay, Address::SdoHigh, DataReady::Int3).await;
            if let Ok(gyroscope) = start {
                let rate = gyroscope.read(bus).await.unwrap().rad_per_s();
                assert!(rate.rad_per_s.iter().all(|rate| rate.abs() < 35.0));
            }
            let test = Gyroscope::self_test(bus, &mut delay, Address::SdoHigh).await;
            assert!(!matches!(test, Err(Error::Bus(_) | Error::WrongId { .. })));
            if let Ok(accelerometer) =
                Accelerometer::start(bus, &mut delay, Address::SdoLow).await
            {
                let acceleration = accelerometer.read(bus).await.unwrap().m_per_s2();
                assert!(acceleration.m_per_s2.iter().all(|value| value.abs() < 236.0));
            }
            let _ = Accelerometer::self_test(bus, &mut delay, Address::SdoLow).await;
        });
    }
}
