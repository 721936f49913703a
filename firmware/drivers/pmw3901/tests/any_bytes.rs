//! Nothing that a chip answers panics the driver.

use std::cell::RefCell;
use std::rc::Rc;

use bittybuzz_chips::{SpiDevice, Time};
use bittybuzz_pmw3901::{Error, FlowSensor};
use bittybuzz_testbus::{BusError, TestDelay, TestSpi, Wires, run};
use proptest::prelude::*;

/// A chip that has the right identity for the first readings, and then answers with a sequence of
/// bytes, again and again.
struct Noise {
    bytes: Vec<u8>,
    next: usize,
    /// The bytes that were exchanged since the select line went low.
    position: usize,
    accesses: usize,
    right_accesses: usize,
}

impl SpiDevice for Noise {
    fn select(&mut self, selected: bool, _now: Time) {
        self.position = 0;
        self.accesses += usize::from(selected);
    }

    fn exchange(&mut self, _byte: u8, _now: Time) -> u8 {
        self.position += 1;
        self.next = (self.next + 1) % self.bytes.len();
        // The first access only moves the select line.
        match self.accesses {
            2 if self.position == 2 => 0x49,
            3 if self.position == 2 => 0xb6,
            access if access > self.right_accesses => self.bytes[self.next],
            access if access % 2 == 0 => 0x49,
            _ => 0xb6,
        }
    }
}

fn bench(bytes: Vec<u8>, right_accesses: usize) -> (TestSpi<Noise>, TestDelay) {
    let wires = Wires::new();
    let noise = Noise { bytes, next: 0, position: 0, accesses: 0, right_accesses };
    (TestSpi::new(&wires, &Rc::new(RefCell::new(noise))), TestDelay(wires))
}

fn start(bytes: Vec<u8>, right_accesses: usize) -> Result<FlowSensor, Error<BusError>> {
    let (mut spi, mut delay) = bench(bytes, right_accesses);
    run(FlowSensor::start(&mut spi, &mut delay))
}

#[test]
fn an_identity_that_is_gone_at_the_end_is_an_error() {
    let refused = Error::ConfigurationRefused { found: 7, found_inverse: 7 };
    assert_eq!(start(vec![7], 3), Err(refused));
    assert!(start(vec![7], 87).is_ok());
}

proptest! {
    #[test]
    fn no_answer_panics(bytes in prop::collection::vec(any::<u8>(), 1..60)) {
        let _ = start(bytes.clone(), 0);
        let (mut spi, mut delay) = bench(bytes, 87);
        run(async {
            let sensor = FlowSensor::start(&mut spi, &mut delay).await.unwrap();
            let motion = sensor.read(&mut spi, &mut delay).await.unwrap();
            let angles = motion.angles();
            prop_assert!(angles.x_rad.abs() < 70.0 && angles.y_rad.abs() < 70.0);
            Ok(())
        })?;
    }
}
