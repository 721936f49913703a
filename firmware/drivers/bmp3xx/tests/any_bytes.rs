//! Nothing that a chip answers panics the driver, and no counts do.

use std::cell::RefCell;
use std::rc::Rc;

use bittybuzz_bmp3xx::{Address, Barometer, BarometerCounts};
use bittybuzz_chips::Time;
use bittybuzz_testbus::{RegisterFile, Registers, TestDelay, TestI2c, Wires, run};
use proptest::prelude::*;

/// A chip with any calibration that takes the configuration, and answers anything else with a
/// sequence of bytes, again and again.
struct Noise {
    bytes: Vec<u8>,
    next: usize,
    values: [u8; 0x80],
}

impl RegisterFile for Noise {
    fn write(&mut self, register: u16, value: u8, _now: Time) {
        self.values[usize::from(register)] = value;
    }

    fn read(&mut self, register: u16, _now: Time) -> u8 {
        match register {
            0x00 => 0x50,
            0x1b..=0x1f => self.values[usize::from(register)],
            _ => {
                self.next = (self.next + 1) % self.bytes.len();
                self.bytes[self.next]
            }
        }
    }

    fn address(&self, _now: Time) -> Option<u8> {
        Some(0x77)
    }
}

proptest! {
    #[test]
    fn no_answer_panics(
        bytes in prop::collection::vec(any::<u8>(), 1..60),
        pressure: u32,
        temperature: u32,
    ) {
        let wires = Wires::new();
        let noise = Noise { bytes, next: 0, values: [0; 0x80] };
        let chip = Rc::new(RefCell::new(Registers::new(noise, 1)));
        let mut bus = TestI2c::new(&wires).with(&chip);
        let mut delay = TestDelay(wires.clone());
        run(async {
            let start = Barometer::start(&mut bus, &mut delay, Address::SdoHigh).await;
            if let Ok(barometer) = start {
                let _ = barometer.self_test(&mut bus, &mut delay).await;
                let counts = barometer.read(&mut bus).await.unwrap().counts;
                prop_assert!(counts.pressure < 1 << 24 && counts.temperature < 1 << 24);
                barometer.air(counts);
                barometer.air(BarometerCounts { pressure, temperature });
            }
            Ok(())
        })?;
    }
}
