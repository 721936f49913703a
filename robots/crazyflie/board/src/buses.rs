//! The buses to the sensors and the expansion port.

use bittybuzz_chips::devices::bmi088::{Bmi088, Bmi088Settings};
use bittybuzz_chips::devices::bmp388::{Bmp388, Bmp388Settings};
use bittybuzz_chips::devices::eeprom_24aa64::{CAPACITY, Eeprom24aa64};
use bittybuzz_chips::f405::F405;
use bittybuzz_chips::stm32::Pin;
use bittybuzz_chips::{BusAction, I2cBus, I2cDevice, Random, Time};
use bittybuzz_emulation::message::DeviceFault;

use crate::decks::{self, Decks};

/// Port and pin.
type PinName = (usize, u8);

/// SCL and SDA of I2C1, on the expansion port with the configuration memory, and of I2C3 with the
/// sensors. All have pull-up resistors on the board.
const I2C_PINS: [[PinName; 2]; 2] = [[(1, 6), (1, 7)], [(0, 8), (2, 9)]];
/// The alternate function that connects these pins to I2C.
const I2C_FUNCTION: u8 = 4;
/// SCK, MISO and MOSI of SPI1, on the expansion port, and the alternate function that connects them.
const SPI_PINS: [PinName; 3] = [(0, 5), (0, 6), (0, 7)];
const SPI_FUNCTION: u8 = 5;
/// INT3 of the BMI088, which reports a sample of the gyroscope.
const DATA_READY: PinName = (2, 14);

/// Temperature of the barometer in °C (choice).
const TEMPERATURE_C: f64 = 25.0;

/// The motion of a robot that stands on the ground, in counts of ±2000 °/s and of ±24 g: an offset
/// of the gyroscope, which is never exactly zero, and 1 g upwards.
const AT_REST: ([i16; 3], [i16; 3]) = ([5, -3, 2], [0, 0, 1365]);
/// The noise of both sensors: 0.014 °/s/√Hz with a bandwidth of 116 Hz, and 190 µg/√Hz with 145 Hz
/// (data sheet BST-BMI088-DS001).
const NOISE_COUNTS: [f64; 2] = [2.6, 3.1];
/// The pressure around a robot at rest, and the noise of the barometer (data sheet BST-BMP388-DS001,
/// pressure eightfold oversampled).
const PRESSURE_PA: f64 = 101_325.0;
const NOISE_PA: f64 = 1.0;

/// The two I2C buses and SPI1, with the chips on them.
pub(crate) struct Buses {
    i2c: [I2cBus; 2],
    /// True for each I2C bus whose SDA a chip holds low.
    held: [bool; 2],
    imu: Bmi088,
    barometer: Bmp388,
    memory: Eeprom24aa64,
    pub decks: Decks,
    /// The noise of the sensors of a robot at rest; `None` once the robot has a body.
    noise: Option<Random>,
    /// The level of [`DATA_READY`].
    data_ready: bool,
    /// The time of its next change, stored because it is read much more often than it changes.
    next_change: Option<Time>,
}

impl Buses {
    /// Creates the chips, whose power is turned on at `now`, and pulls the lines of the I2C buses
    /// up.
    pub fn new(f405: &mut F405, now: Time) -> Self {
        for (port, pin) in I2C_PINS.into_iter().flatten() {
            f405.drive(port, pin, true);
        }
        let (port, pin) = DATA_READY;
        f405.drive(port, pin, false);
        let mut imu = Bmi088::new(Bmi088Settings::default(), now);
        imu.set_motion(AT_REST.0, AT_REST.1, now);
        Buses {
            i2c: Default::default(),
            held: [false; 2],
            imu,
            barometer: Bmp388::new(Bmp388Settings::default(), now),
            memory: Eeprom24aa64::erased(),
            decks: Decks::default(),
            noise: Some(Random::new(0)),
            data_ready: false,
            next_change: None,
        }
    }

    /// Turns the power of all chips off and on again. Only the memory keeps its content.
    pub fn restart(&mut self, f405: &mut F405, now: Time) {
        let memory = Eeprom24aa64::new(Box::new(*self.memory.content()));
        let mut decks = std::mem::take(&mut self.decks);
        decks.restart(now);
        let noise = self.noise.take();
        *self = Buses { memory, decks, noise, ..Buses::new(f405, now) };
    }

    /// Sets the motion that the inertial sensors measure from now on, in counts of their largest ranges.
    pub fn set_motion(&mut self, rate_counts: [i16; 3], force_counts: [i16; 3], now: Time) {
        self.noise = None;
        self.imu.sample_motion(rate_counts, force_counts, now);
    }

    /// Changes the measurements of a robot at rest by the noise of the sensors.
    fn measure_at_rest(&mut self, now: Time) {
        let Some(noise) = &mut self.noise else { return };
        let mut add =
            |counts: i16, deviation: f64| counts + (noise.normal() * deviation).round() as i16;
        let (rate, force) = AT_REST;
        let rate = rate.map(|counts| add(counts, NOISE_COUNTS[0]));
        let force = force.map(|counts| add(counts, NOISE_COUNTS[1]));
        self.imu.set_motion(rate, force, now);
        let pressure_pa = PRESSURE_PA + noise.normal() * NOISE_PA;
        self.barometer.set_air(pressure_pa, TEMPERATURE_C, now);
    }

    /// Sets the pressure that the barometer measures from now on, in Pa.
    pub fn set_pressure(&mut self, pressure_pa: f64, now: Time) {
        self.barometer.set_air(pressure_pa, TEMPERATURE_C, now);
    }

    /// Sets or ends the fault of a device on the buses. Without a Flow deck, faults of its sensors have
    /// no effect.
    pub fn set_fault(&mut self, f405: &mut F405, fault: DeviceFault, now: Time) {
        match fault {
            DeviceFault::Imu(fault) => self.imu.set_fault(fault.map(Into::into), now),
            DeviceFault::Barometer(fault) => self.barometer.set_fault(fault.map(Into::into), now),
            DeviceFault::Eeprom(fault) => self.memory.set_fault(fault.map(Into::into)),
            DeviceFault::Flow(fault) => self.decks.set_flow_fault(fault.map(Into::into)),
            DeviceFault::Distance(fault) => {
                self.decks.set_distance_fault(fault.map(Into::into), now);
            }
            // The nRF51 reads these memories.
            DeviceFault::DeckMemories(_) => {}
        }
        self.settle_data_ready(f405);
        // The fault may hold or release a line.
        self.after_write(f405, now);
    }

    /// Sets the first bytes of the memory. The others are erased.
    pub fn set_memory(&mut self, bytes: &[u8]) {
        let mut content = Box::new([0xff; CAPACITY]);
        content[..bytes.len()].copy_from_slice(bytes);
        self.memory = Eeprom24aa64::new(content);
    }

    /// Calls `action` with an I2C bus and its devices.
    fn with_bus<R>(
        &mut self,
        bus: usize,
        action: impl FnOnce(&mut I2cBus, &mut [&mut dyn I2cDevice]) -> R,
    ) -> R {
        let line = &mut self.i2c[bus];
        if bus == 0 && self.decks.is_empty() {
            action(line, &mut [&mut self.memory])
        } else if bus == 0 {
            let memory = &mut self.memory as &mut dyn I2cDevice;
            let mut devices: Vec<_> =
                [memory].into_iter().chain(self.decks.i2c_devices()).collect();
            action(line, &mut devices)
        } else {
            action(line, &mut [&mut self.imu, &mut self.barometer])
        }
    }

    /// Performs an action of the STM32 on I2C1 (0) or I2C3 (1), and returns its answer to the STM32.
    pub fn perform(&mut self, f405: &mut F405, bus: usize, action: BusAction, end: Time) {
        let is_connected = I2C_PINS[bus]
            .iter()
            .all(|(port, pin)| f405.ports[*port].pin(*pin) == Pin::Alternate(I2C_FUNCTION));
        let answer = if is_connected {
            self.with_bus(bus, |line, devices| line.perform(action, devices, end))
        } else {
            I2cBus::default().perform(action, &mut [], end)
        };
        f405.i2c_answered(bus, action, answer, end);
        self.decks.settle(end);
        self.settle_data_ready(f405);
    }

    /// Exchanges a byte of SPI1. Without a selected chip, MISO has the level of its pin.
    pub fn exchange(&mut self, f405: &mut F405, byte: u8, end: Time) {
        let is_connected = SPI_PINS
            .iter()
            .all(|(port, pin)| f405.ports[*port].pin(*pin) == Pin::Alternate(SPI_FUNCTION));
        let answer = if is_connected { self.decks.exchange(byte, end) } else { None };
        let answer = answer.unwrap_or_else(|| {
            let (port, pin) = SPI_PINS[1];
            if f405.ports[port].level(pin) { 0xff } else { 0 }
        });
        f405.spi_received(answer, end);
    }

    /// Returns the time of the next change at a pin of a chip.
    pub fn next_event(&self) -> Option<Time> {
        self.next_change
    }

    /// Handles the changes at the pins of the chips until `now`.
    pub fn advance(&mut self, f405: &mut F405, now: Time) {
        if self.next_change.is_some_and(|at| at <= now) {
            self.imu.advance(now);
            self.measure_at_rest(now);
            self.settle_data_ready(f405);
        }
    }

    fn settle_data_ready(&mut self, f405: &mut F405) {
        // The pin of the STM32 has neither pull-up nor pull-down; it reads as low until the chip
        // drives it.
        self.next_change = self.imu.next_event();
        let level = self.imu.int3().unwrap_or(false);
        if level != std::mem::replace(&mut self.data_ready, level) {
            let (port, pin) = DATA_READY;
            f405.drive(port, pin, level);
        }
    }

    /// Applies what a write of the firmware has changed at the pins of the buses.
    pub fn after_write(&mut self, f405: &mut F405, now: Time) {
        for (bus, lines) in I2C_PINS.into_iter().enumerate() {
            // The lines are open drain: nothing drives them high.
            let [scl, sda] =
                lines.map(|(port, pin)| f405.ports[port].pin(pin) != Pin::Level(false));
            let release = f405.take_i2c_release(bus);
            let is_held = self.with_bus(bus, |line, devices| {
                if let Some(release) = release {
                    line.release(release, devices, now);
                }
                line.set_lines(scl, sda, devices, now);
                line.is_held(devices)
            });
            if is_held != std::mem::replace(&mut self.held[bus], is_held) {
                let (port, pin) = lines[1];
                f405.drive(port, pin, !is_held);
                f405.set_i2c_held(bus, is_held);
            }
        }
        let (port, pin) = decks::SELECT;
        self.decks.set_select(f405.ports[port].pin(pin) != Pin::Level(false), now);
    }
}
