//! The board of a Kilobot: an ATmega328P, an infrared LED and receiver, a LED of three colors, two
//! vibration motors.
//!
//! Pins, gains and rates are those of kilolib; a value without that source is marked as a choice.
//! Light is modeled as pulses: [`Edge`]s are changes of the robot's own LED, [`LightChange`]s those of
//! its neighbors. The emulator carries light between robots, because it knows their positions.

mod infrared;

use std::collections::VecDeque;

use bittybuzz_chips::atmega328p::{
    AdcSample, Atmega328p, AvrBoard, B, BOOT_SECTION, C, Change, D, EEPROM_SIZE, Mistake, Sent,
    Signal, Sleep,
};
use bittybuzz_chips::{BoardEvent, HardwareError, MemoryContent, Random, ResetCause, Time};
use bittybuzz_emulation::message;

pub use self::infrared::{Amplitude, DIAMETER_MM, infrared_checksum};
use self::infrared::{PulseDecoder, PulseOutcome, is_intact, tables};

/// The value of OSCCAL at which the oscillator has its nominal frequency, and the value after a
/// reset, one step higher. A choice.
const BEST_OSCCAL: u8 = 0x9c;
const FACTORY_OSCCAL: u8 = 0x9d;

/// Addresses of calibration and configuration data in the EEPROM.
mod cell {
    pub const OSCCAL: usize = 0x01;
    pub const TURN_LEFT: usize = 0x05;
    pub const TURN_RIGHT: usize = 0x09;
    pub const STRAIGHT_LEFT: usize = 0x0c;
    pub const STRAIGHT_RIGHT: usize = 0x14;
    pub const LOW_GAIN: usize = 0x20;
    pub const HIGH_GAIN: usize = 0x50;
    pub const TX_MASK: usize = 0x90;
    pub const UID: usize = 0xb0;
}

/// Motor duties after calibration, in the middle of the usual range. A choice.
const DUTIES: [(usize, u8); 4] = [
    (cell::TURN_LEFT, 77),
    (cell::TURN_RIGHT, 77),
    (cell::STRAIGHT_LEFT, 70),
    (cell::STRAIGHT_RIGHT, 70),
];

/// Pins of port B to which the infrared LED may be connected; it is at pin 0 if the EEPROM names
/// another.
const LED_PINS: u8 = 0b1100_0111;
/// Pins of port D: the charger's signal, and the power of the infrared receiver.
const CHARGING: u8 = 0;
const RECEIVER: u8 = 2;
/// The LED's three colors, each with a weak and a strong segment: port and pin. A segment shines
/// while its pin is an output at 0.
const COLORS: [[(usize, u8); 2]; 3] = [[(D, 5), (D, 4)], [(C, 3), (C, 2)], [(C, 5), (C, 4)]];
/// Pins of OC2A and OC2B, the outputs for the left and the right motor.
const MOTORS: [(usize, u8); 2] = [(B, 3), (D, 3)];

/// The time for which the amplifier holds a pulse, which is shorter than the converter's sampling
/// time. A choice: less than a bit.
const HELD: Time = Time::from_micros(10);
/// The longest pulse of the robot's own LED that is accepted. A longer one is an error: it exceeds
/// a bit, and the LED would burn.
const PULSE_MAX: Time = Time::from_micros(100);
/// Full scale of the battery's divider in V: with it, kilolib's levels are 4.0, 3.8 and 3.6 V. A
/// choice.
const BATTERY_FULL_SCALE: f64 = 6.0;
/// AREF and AVCC in mV. A choice that matches `BATTERY_FULL_SCALE`.
const SUPPLY_MV: f64 = 3000.0;
const BANDGAP_MV: f64 = 1100.0;
/// Temperatures in °C and the sensor's voltages in mV, from table 24-2 of the data sheet: 314 mV at
/// 25 °C, 242 at -45, 380 at 85.
const THERMOMETER: [(f64, f64); 3] = [(-45.0, 242.0), (25.0, 314.0), (85.0, 380.0)];
/// The largest error of readings of battery, light and temperature, in steps of the converter;
/// kilolib derives its random numbers from this noise. A choice.
const NOISE: u64 = 2;
/// The debug line's baud rate, and the relative error of the rate that a receiver tolerates (20.10
/// of the data sheet, rounded).
const SERIAL_HZ: f64 = 38_400.0;
const SERIAL_TOLERANCE: f64 = 0.04;

/// A change of a robot's infrared LED.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// The time of the change.
    pub at: Time,
    /// True if the LED goes on.
    pub on: bool,
    /// The time of the first pulse of the burst.
    pub burst: Time,
}

/// A change of a neighbor's light at the receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightChange {
    /// The time of the change.
    pub at: Time,
    /// True if the LED goes on.
    pub on: bool,
    /// Number of the sender.
    pub from: u16,
    /// The strength of the light.
    pub amplitude: Amplitude,
}

/// The surroundings of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surroundings {
    /// Reading of the light sensor: 0 to 1023.
    pub light: u16,
    /// Temperature in degrees Celsius.
    pub celsius: f64,
}

/// The counters of a Kilobot since power-on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KilobotStatistics {
    /// Frames that the robot sent.
    pub sent: u64,
    /// Bursts that the robot ended early because it received another sender.
    pub aborted: u64,
    /// Frames that reached the robot's receiver with a good checksum.
    pub arrived: u64,
    /// Bursts of a single neighbor that were no frame with a good checksum.
    pub damaged: u64,
    /// Bursts with pulses of several neighbors.
    pub collided: u64,
    /// Pulses that came while the receiver was off.
    pub unheard: u64,
    /// Addresses of registers that the firmware used although they have no model and are plain
    /// storage.
    pub unknown: Vec<u32>,
}

/// A Kilobot without the core of its processor.
#[derive(Clone, Debug)]
pub struct Kilobot {
    chip: Atmega328p,
    /// Pins of port B at which the infrared LED is connected, as a mask.
    led_pins: u8,
    /// The cycle since which the infrared LED is on.
    lit: Option<u64>,
    edges: Vec<Edge>,
    sending: PulseDecoder,
    burst: Time,
    /// Changes of neighbors' light that are still to come, in order.
    coming: VecDeque<LightChange>,
    /// The cycle of the next change of light; `u64::MAX` if none is known.
    next_light: u64,
    /// Neighbors whose LED is on now.
    seen: Vec<(u16, Amplitude)>,
    held: Amplitude,
    held_until: u64,
    receiving: PulseDecoder,
    /// The first sender of the current burst, and true if other senders' pulses came in it as well.
    burst_sender: Option<(u16, bool)>,
    color: [u8; 3],
    motors: [(f64, f64); 2],
    battery: u16,
    surroundings: Surroundings,
    seed: u64,
    serial: Vec<u8>,
    errors: u32,
    events: Vec<(Time, BoardEvent)>,
    statistics: KilobotStatistics,
}

impl Kilobot {
    /// Creates robot `number` of several, whose power was just turned on. The robot is calibrated,
    /// and its id is `number`.
    pub fn new(number: u16) -> Self {
        let mut cells = [0xff; EEPROM_SIZE];
        cells[cell::OSCCAL] = BEST_OSCCAL;
        for (at, duty) in DUTIES {
            cells[at] = duty;
        }
        for (at, table) in [cell::LOW_GAIN, cell::HIGH_GAIN].into_iter().zip(tables()) {
            cells[at..at + table.len()].copy_from_slice(&table);
        }
        cells[cell::TX_MASK] = 1;
        cells[cell::UID..cell::UID + 2].copy_from_slice(&number.to_le_bytes());
        let mut robot = Kilobot {
            chip: Atmega328p::new(BEST_OSCCAL, FACTORY_OSCCAL, cells),
            led_pins: 1,
            lit: None,
            edges: Vec::new(),
            sending: PulseDecoder::default(),
            burst: Time::ZERO,
            coming: VecDeque::new(),
            next_light: u64::MAX,
            seen: Vec::new(),
            held: Amplitude::default(),
            held_until: 0,
            receiving: PulseDecoder::default(),
            burst_sender: None,
            color: [0; 3],
            motors: [(0.0, 0.0); 2],
            battery: 0,
            surroundings: Surroundings { light: 300, celsius: 25.0 },
            seed: u64::from(number),
            serial: Vec::new(),
            errors: 0,
            events: Vec::new(),
            statistics: KilobotStatistics::default(),
        };
        robot.set_battery(3.9, false);
        robot
    }

    /// Returns the EEPROM's cells. A caller that changes them calls [`wire`](Self::wire)
    /// afterwards.
    pub fn eeprom(&mut self) -> &mut [u8; EEPROM_SIZE] {
        &mut self.chip.eeprom.cells
    }

    /// Connects the infrared LED to the pins that the calibration in the EEPROM names.
    pub fn wire(&mut self) {
        let mask = self.chip.eeprom.cells[cell::TX_MASK];
        self.led_pins = if mask & !LED_PINS == 0 && mask != 0 { mask } else { 1 };
    }

    /// Sets the battery's voltage in volts, and charging on or off.
    pub fn set_battery(&mut self, volts: f64, charging: bool) {
        self.battery = (volts / BATTERY_FULL_SCALE * 1024.0).clamp(0.0, 1023.0) as u16;
        self.chip.drive(D, CHARGING, !charging);
    }

    /// Sets the error of the robot's oscillator from now on, in ppm; a positive value means too
    /// fast.
    pub fn set_clock_error(&mut self, ppm: f64) {
        let now = self.chip.now();
        self.chip.clock.set_error(now, ppm);
        self.plan_light();
    }

    /// Sets the robot's surroundings from now on.
    pub fn set_surroundings(&mut self, surroundings: Surroundings) {
        self.surroundings = surroundings;
    }

    /// Sets the seed of the pseudo-random errors of readings.
    pub fn set_seed(&mut self, seed: u64) {
        self.seed = seed;
    }

    /// Returns the time at which a cycle of the core begins.
    pub fn time(&self, cycle: u64) -> Time {
        self.chip.clock.time(cycle)
    }

    /// Returns the first cycle of the core at or after `time`.
    pub fn cycle(&self, time: Time) -> u64 {
        self.chip.clock.cycle(time)
    }

    /// Adds changes of neighbors' LEDs, in order, after all that were added before.
    pub fn will_see(&mut self, lights: impl IntoIterator<Item = LightChange>) {
        self.coming.extend(lights);
        self.plan_light();
    }

    fn plan_light(&mut self) {
        let now = self.chip.now();
        let next = self.coming.front().map(|light| self.chip.clock.cycle(light.at).max(now));
        self.next_light = next.unwrap_or(u64::MAX);
    }

    /// Returns true if the robot's infrared LED is on.
    pub fn is_lit(&self) -> bool {
        self.lit.is_some()
    }

    /// Returns the changes of the robot's own LED since the last call.
    pub fn take_edges(&mut self) -> Vec<Edge> {
        std::mem::take(&mut self.edges)
    }

    fn advance_chip(&mut self, cycle: u64) {
        while let Some(signal) = self.chip.advance(cycle) {
            match signal {
                Signal::Sample(sample) => {
                    let value = self.measure(sample);
                    self.chip.measured(value);
                }
                Signal::Sent(sent) => self.note_serial(sent),
            }
        }
    }

    fn is_listening(&self) -> bool {
        self.chip.ports[D].direction & self.chip.ports[D].port & 1 << RECEIVER != 0
    }

    fn add_light(&mut self, light: LightChange, cycle: u64) {
        self.seen.retain(|(from, _)| *from != light.from);
        if light.on {
            self.seen.push((light.from, light.amplitude));
            if self.is_listening() {
                let held = if cycle < self.held_until { self.held } else { Amplitude::default() };
                self.held = held.plus(light.amplitude);
                self.held_until = cycle + self.chip.clock.cycles_of(HELD);
                self.count_pulse(light.from, cycle);
            } else {
                self.statistics.unheard += 1;
            }
        }
        self.settle_comparator();
    }

    /// Counts the frames that a program could receive, even if this one does not receive them.
    fn count_pulse(&mut self, from: u16, cycle: u64) {
        let is_going_on = self.receiving.is_busy(cycle);
        match &mut self.burst_sender {
            Some((one, more)) if is_going_on => *more |= *one != from,
            sender => *sender = Some((from, false)),
        }
        let is_mixed = self.burst_sender.is_some_and(|(_, more)| more);
        match self.receiving.pulse(cycle) {
            Some(PulseOutcome::Frame(frame, _)) if is_intact(&frame) && !is_mixed => {
                self.statistics.arrived += 1;
            }
            Some(PulseOutcome::Frame(..) | PulseOutcome::Broken) => {
                let counter = if is_mixed {
                    &mut self.statistics.collided
                } else {
                    &mut self.statistics.damaged
                };
                *counter += 1;
            }
            Some(PulseOutcome::Begin) | None => {}
        }
    }

    /// Updates the comparator. The receiver also sees the robot's own LED.
    fn settle_comparator(&mut self) {
        let light = !self.seen.is_empty() || self.lit.is_some();
        self.chip.compare(light && self.is_listening());
    }

    /// Returns the converter's reading for a sample.
    fn measure(&self, sample: AdcSample) -> u16 {
        let noise = || {
            let mut random = Random::for_item(self.seed, sample.at);
            (random.bits() % (2 * NOISE + 1)) as i32 - NOISE as i32
        };
        let noisy = |reading: f64| (reading as i32 + noise()).clamp(0, 1023) as u16;
        let reference = if sample.reference == 3 { BANDGAP_MV } else { SUPPLY_MV };
        let reading = |millivolts: f64| millivolts / reference * 1024.0;
        let scaled = |of_supply: u16| f64::from(of_supply) * SUPPLY_MV / reference;
        let is_held = self.is_listening() && self.chip.now() < self.held_until;
        match sample.channel {
            0 if is_held => scaled(self.held.high).min(1023.0) as u16,
            1 if is_held => scaled(self.held.low).min(1023.0) as u16,
            6 => noisy(scaled(self.battery)),
            7 => noisy(scaled(self.surroundings.light)),
            8 => noisy(reading(thermometer(self.surroundings.celsius))),
            14 => reading(BANDGAP_MV).min(1023.0) as u16,
            _ => 0,
        }
    }

    fn note_serial(&mut self, sent: Sent) {
        let rate = self.chip.clock.hz() / f64::from(sent.bit);
        if (rate / SERIAL_HZ - 1.0).abs() > SERIAL_TOLERANCE || !sent.is_plain {
            self.fail(HardwareError::SerialFormat { baud: rate as u64 });
        }
        self.serial.push(sent.byte);
    }

    /// Reports a mistake of the firmware, once per kind of mistake.
    pub fn fail(&mut self, error: HardwareError) {
        let bit = match &error {
            HardwareError::SerialFormat { .. } => 1 << 0,
            HardwareError::LongPulse => 1 << 1,
            HardwareError::StoreOutside { .. } => 1 << 2,
            HardwareError::StoreLocked { .. } => 1 << 3,
            HardwareError::ReadWhileWrite { .. } => 1 << 4,
            HardwareError::Stack { .. } => 1 << 5,
            _ => 1 << 6,
        };
        if self.errors & bit == 0 {
            self.errors |= bit;
            let at = self.time(self.chip.now());
            self.events.push((at, BoardEvent::HardwareError(error)));
        }
    }

    /// Returns the next cycle at which the caller must ask again for an interrupt.
    pub fn next_event(&mut self) -> u64 {
        self.chip.next_event().min(self.next_light)
    }

    /// Returns the interrupt that is served first, if any is pending.
    pub fn interrupt(&mut self) -> Option<u8> {
        self.chip.interrupt()
    }

    /// Acknowledges an interrupt that the core enters; returns the address of its vector.
    pub fn acknowledge(&mut self, vector: u8) -> u16 {
        let address = self.chip.acknowledge(vector);
        if self.chip.is_application_busy() && address < BOOT_SECTION {
            self.fail(HardwareError::ReadWhileWrite { address });
        }
        address
    }

    /// Executes the instruction `sleep`; returns the depth of sleep, or `None` if the core stays
    /// awake.
    pub fn sleep(&mut self) -> Option<Sleep> {
        self.chip.sleep()
    }

    /// Wakes the core for an interrupt, after `slept` cycles of sleep.
    pub fn wake(&mut self, slept: u64) {
        self.chip.wake(slept);
        self.settle_comparator();
    }

    /// Returns true if the watchdog has expired.
    pub fn is_expired(&self) -> bool {
        self.chip.is_expired()
    }

    /// Resets the chip. Unless the watchdog is the cause, the supply fell, and `memory` decides
    /// about a byte that was being written to the EEPROM: with [`MemoryContent::Kept`] the write is
    /// complete, with [`MemoryContent::Zeroed`] the byte is erased, as in the first phase of a write
    /// (table 8-1), and with [`MemoryContent::Noise`] it is random.
    pub fn reset(&mut self, cause: ResetCause, memory: MemoryContent) {
        if cause != ResetCause::IndependentWatchdog {
            match memory {
                MemoryContent::Kept => {}
                MemoryContent::Zeroed => self.chip.eeprom.cut(0xff),
                MemoryContent::Noise { .. } => self.chip.eeprom.cut(memory.noise().bits() as u8),
            }
        }
        self.chip.reset(FACTORY_OSCCAL, cause);
        self.settle();
        self.plan_light();
    }

    /// Returns the number of times that the chip has executed `wdr` since its last reset.
    pub fn watchdog_restarts(&self) -> u64 {
        self.chip.watchdog_restarts()
    }

    /// Applies the state of the pins to LEDs and motors, and reports changes.
    fn settle(&mut self) {
        let cycle = self.chip.now();
        let port = self.chip.ports[B];
        let is_lit = port.direction & port.port & self.led_pins != 0;
        if is_lit != self.lit.is_some() {
            let at = self.time(cycle);
            if is_lit {
                self.lit = Some(cycle);
                self.note_pulse(cycle, at);
            } else if let Some(since) = self.lit.take()
                && at - self.time(since) > PULSE_MAX
            {
                self.fail(HardwareError::LongPulse);
            }
            self.edges.push(Edge { at, on: is_lit, burst: self.burst });
        }
        self.settle_comparator();
        self.observe_motors();
        let color = COLORS.map(|[weak, strong]| {
            let shines = |(port, pin): (usize, u8)| {
                let port = self.chip.ports[port];
                u8::from(port.direction & !port.port & 1 << pin != 0)
            };
            shines(weak) | shines(strong) << 1
        });
        if color != std::mem::replace(&mut self.color, color) {
            let [red, green, blue] = color;
            self.events.push((self.time(cycle), BoardEvent::Color { red, green, blue }));
        }
    }

    fn note_pulse(&mut self, cycle: u64, at: Time) {
        match self.sending.pulse(cycle) {
            Some(PulseOutcome::Begin) => {
                self.burst = at;
                self.statistics.aborted += 1;
            }
            Some(PulseOutcome::Frame(frame, begin)) => {
                self.statistics.sent += 1;
                self.statistics.aborted -= 1;
                let air = at - self.time(begin);
                let event = BoardEvent::Infrared { payload: frame.to_vec(), air };
                self.events.push((at, event));
            }
            Some(PulseOutcome::Broken) | None => {}
        }
    }

    fn observe_motors(&mut self) {
        for (output, (port, pin)) in MOTORS.into_iter().enumerate() {
            let port = self.chip.ports[port];
            let is_output = port.direction >> pin & 1 != 0;
            let signal = match self.chip.motor(output).filter(|_| is_output) {
                Some(wave) if wave.prescaler != 0 => {
                    let duty = f64::from(wave.high) / f64::from(wave.period.max(1));
                    let cycles = f64::from(wave.period) * f64::from(wave.prescaler);
                    let is_constant = wave.high == 0 || wave.high == wave.period;
                    (duty, if is_constant { 0.0 } else { self.chip.clock.hz() / cycles })
                }
                Some(_) => (0.0, 0.0),
                None => (f64::from(u8::from(is_output && port.port >> pin & 1 != 0)), 0.0),
            };
            if signal != std::mem::replace(&mut self.motors[output], signal) {
                let (duty, frequency_hz) = signal;
                let event = BoardEvent::Motor { number: output as u8 + 1, duty, frequency_hz };
                self.events.push((self.time(self.chip.now()), event));
            }
        }
    }

    /// Reports an infrared LED that stays on for longer than any pulse.
    fn check_led(&mut self) {
        if let Some(since) = self.lit
            && self.time(self.chip.now()) - self.time(since) > PULSE_MAX
        {
            self.fail(HardwareError::LongPulse);
        }
    }

    /// Returns the events since the last call, in order.
    pub fn take_events(&mut self) -> Vec<(Time, BoardEvent)> {
        self.check_led();
        if !self.serial.is_empty() {
            let at = self.time(self.chip.now());
            let bytes = std::mem::take(&mut self.serial);
            self.events.push((at, BoardEvent::Serial { bytes }));
        }
        std::mem::take(&mut self.events)
    }

    /// Returns the counters since power-on.
    pub fn statistics(&self) -> KilobotStatistics {
        KilobotStatistics { unknown: self.chip.take_unknown(), ..self.statistics.clone() }
    }
}

impl AvrBoard for Kilobot {
    fn advance(&mut self, cycle: u64) {
        while self.next_light <= cycle {
            let at = self.next_light;
            self.advance_chip(at);
            while let Some(light) = self.coming.front().copied()
                && self.chip.clock.cycle(light.at) <= at
            {
                self.coming.pop_front();
                self.add_light(light, at);
            }
            self.plan_light();
        }
        self.advance_chip(cycle);
    }

    fn read(&mut self, address: u16, cycle: u64) -> u8 {
        self.advance(cycle);
        self.chip.read(address)
    }

    fn write(&mut self, address: u16, value: u8, cycle: u64) -> bool {
        self.advance(cycle);
        self.chip.write(address, value);
        // Only ports, timer 2 and the clock's registers affect LEDs, motors and the times of light.
        match address {
            0x23..=0x2b => {
                self.settle();
                false
            }
            0xb0 | 0xb1 | 0xb3 | 0xb4 => {
                self.observe_motors();
                true
            }
            0x61 | 0x66 => {
                self.plan_light();
                true
            }
            _ => true,
        }
    }

    fn restart_watchdog(&mut self) {
        self.chip.restart_watchdog();
    }

    fn store_program(&mut self, pc: u16, z: u16, word: u16) -> Option<Change> {
        match self.chip.store_program(pc, z, word) {
            Ok(change) => change,
            Err(Mistake::Outside) => {
                self.fail(HardwareError::StoreOutside { pc });
                None
            }
            Err(Mistake::Locked) => {
                self.fail(HardwareError::StoreLocked { pc });
                None
            }
        }
    }

    fn take_halt(&mut self) -> u64 {
        self.chip.take_halt()
    }
}

/// Returns the temperature sensor's voltage in mV.
fn thermometer(celsius: f64) -> f64 {
    let [(cold, at_cold), (middle, at_middle), (hot, at_hot)] = THERMOMETER;
    if celsius < middle {
        at_middle - (middle - celsius) * (at_middle - at_cold) / (middle - cold)
    } else {
        at_middle + (celsius - middle) * (at_hot - at_middle) / (hot - middle)
    }
}

impl From<KilobotStatistics> for message::KilobotStatistics {
    fn from(s: KilobotStatistics) -> Self {
        message::KilobotStatistics {
            infrared_sent: s.sent,
            infrared_aborted: s.aborted,
            infrared_arrived: s.arrived,
            infrared_damaged: s.damaged,
            infrared_collided: s.collided,
            pulses_unheard: s.unheard,
            unknown: s.unknown,
        }
    }
}
