//! Nothing that a chip answers panics the driver.

use std::cell::RefCell;
use std::rc::Rc;

use bittybuzz_chips::Time;
use bittybuzz_testbus::{RegisterFile, Registers, TestDelay, TestI2c, Wires, run};
use bittybuzz_vl53l1x::{DEFAULT_ADDRESS, Mode, RangeFinder};
use proptest::prelude::*;

/// A chip that takes the configuration, and answers other registers with a sequence of bytes, again
/// and again.
struct Noise {
    bytes: Vec<u8>,
    next: usize,
    values: [u8; 0x88],
}

impl RegisterFile for Noise {
    fn write(&mut self, register: u16, value: u8, _now: Time) {
        if let Some(place) = self.values.get_mut(usize::from(register)) {
            *place = value;
        }
    }

    fn read(&mut self, register: u16, _now: Time) -> u8 {
        match (register, self.values.get(usize::from(register))) {
            (0x10f, _) => 0xea,
            (0x110, _) => 0xcc,
            (register, Some(value)) if register != 0x31 => *value,
            _ => {
                self.next = (self.next + 1) % self.bytes.len();
                self.bytes[self.next]
            }
        }
    }

    fn address(&self, _now: Time) -> Option<u8> {
        Some(DEFAULT_ADDRESS)
    }
}

proptest! {
    #[test]
    fn no_answer_panics(bytes in prop::collection::vec(any::<u8>(), 1..60)) {
        let wires = Wires::new();
        let noise = Noise { bytes, next: 0, values: [0; 0x88] };
        let chip = Rc::new(RefCell::new(Registers::new(noise, 2)));
        let mut bus = TestI2c::new(&wires).with(&chip);
        let mut delay = TestDelay(wires.clone());
        run(async {
            let start = RangeFinder::start(&mut bus, &mut delay, DEFAULT_ADDRESS).await;
            if let Ok(finder) = start
                && finder.begin(&mut bus, Mode::Short20Ms).await.is_ok()
            {
                for _ in 0..40 {
                    if let Some(reading) = finder.poll(&mut bus).await.unwrap() {
                        let is_plausible =
                            reading.distance().is_ok_and(|distance| distance.meters <= 65.535);
                        prop_assert!(is_plausible == (reading.status == 9));
                    }
                }
            }
            Ok(())
        })?;
    }
}
