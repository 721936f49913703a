//! The board of a Zooid (PCB version 1.3): an STM32F051, an nRF24L01+, photodiodes, touch, motion sensor, LED, motors.

mod control;
mod device;
mod i2c;
mod motion;
mod projector;
#[cfg(test)]
mod tests;
mod touch;

use bittybuzz_chips::f051::{F051, FLASH_SIZE, PinAction};
use bittybuzz_chips::nrf24::{Nrf24, PowerDetector, RadioStatistics, SPI_LIMIT_HZ, Transmission};
use bittybuzz_chips::stm32::{Pin, Pwm};
use bittybuzz_chips::{
    Board, BoardEvent, BoardLed, BusAction, ChipProperties, CoreKind, CoreStart, FlashChange,
    HardwareError, Lines, MemoryContent, MemoryMap, ReceptionEvent, ResetCause, Time, Transfer,
    Width,
};

use self::i2c::Devices;
use self::projector::Diodes;
pub use self::projector::{LightDisturbance, STEP_MM, TablePose};

const A: usize = 0;
const B: usize = 1;
/// Ports and pins of the radio's control lines.
const CSN: (usize, u8) = (A, 4);
const CE: (usize, u8) = (B, 0);
const IRQ: (usize, u8) = (A, 15);
/// SCK, MISO and MOSI, alternate function 0.
const SPI: [u8; 3] = [5, 6, 7];
const PHOTODIODES: [(usize, u8); 2] = [(B, 9), (B, 1)];
const TOUCH_CHANGE: (usize, u8) = (B, 2);
const MOTION_INT1: (usize, u8) = (B, 12);
/// First address of the RAM (RM0091 2.2.2).
const RAM: u32 = 0x2000_0000;
/// The charger's signal, low while charging.
const CHARGING: (usize, u8) = (B, 13);
/// SCL and SDA, alternate function 1.
const I2C: [u8; 2] = [10, 11];
/// The LED's pins of port A and channels of TIM1, with alternate function 2. The anode is common,
/// so a color shines while its pin is low.
const LEDS: [(BoardLed, u8, u32); 3] =
    [(BoardLed::Red, 10, 2), (BoardLed::Green, 11, 3), (BoardLed::Blue, 9, 1)];
/// Alternate function of the pins of LEDs and motors. For the motors, pin n of port A is channel n
/// of TIM2 and input n of the bridges.
const TIMER_FUNCTION: u8 = 2;
const MOTOR_INPUTS: u8 = 4;

/// The counters of a Zooid since its first power-on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ZooidStatistics {
    /// The counters of the radio.
    pub radio: RadioStatistics,
    /// The number of times that the touch controller was addressed on I2C.
    pub touch_addressed: u64,
    /// The number of times that the motion sensor was addressed.
    pub motion_addressed: u64,
    /// The highest duty cycle of any color of the LED: 0 to 1.
    pub brightest: f64,
    /// Frequencies of the core and of the peripherals' bus, as they are now.
    pub clocks_hz: [u64; 2],
    /// Accesses to peripherals whose clock is off.
    pub accesses_without_clock: u64,
    /// For each block without a model, which is plain storage, the first address that was used.
    pub unknown: Vec<u32>,
}

/// A Zooid without the core of its STM32.
pub struct ZooidBoard {
    now: Time,
    /// The time of the next internal event.
    next: Option<Time>,
    f051: F051,
    radio: Nrf24,
    devices: Devices,
    diodes: Diodes,
    /// The robot's pose, and the time of that pose; `None` outside the projector's light.
    pose: Option<(Time, TablePose)>,
    leds: [bool; LEDS.len()],
    brightest: f64,
    motors: [Pwm; MOTOR_INPUTS as usize],
    /// True while CSN is low (`selected`), and while CE is high (`enabled`).
    selected: bool,
    enabled: bool,
    /// Levels of IRQ and CHANGE.
    irq: bool,
    change: bool,
    /// Level of SCL, as far as the program drives it.
    scl: bool,
    spi_was_too_fast: bool,
    reset_request: Option<ResetCause>,
    /// Properties of the chip from the next reset on.
    next_chip: Option<ChipProperties>,
    /// The content of the RAM after a brown-out.
    memory: MemoryContent,
    last_reset: ResetCause,
    has_power: bool,
    transmissions: Vec<Transmission>,
    events: Vec<(Time, BoardEvent)>,
}

impl ZooidBoard {
    /// Processes the events that are due: of the buses, the radio, the photodiodes and the
    /// watchdog.
    fn step(&mut self) {
        while let Some(signal) = self.f051.advance(self.now) {
            match signal {
                PinAction::Spi(end, byte) => self.exchange(byte, end),
                PinAction::I2c(end, action) => self.talk(action, end),
            }
        }
        self.radio.advance(self.now);
        self.settle_radio();
        while self.diodes.next_event() <= self.now {
            if let Some((diode, level)) = self.diodes.advance(self.now, self.pose) {
                let (port, pin) = PHOTODIODES[diode];
                self.f051.drive(port, pin, level);
            }
        }
        if self.f051.take_watchdog_expiry() {
            self.reset_request = Some(ResetCause::IndependentWatchdog);
        }
        self.next = self.find_next();
    }

    /// Exchanges a byte on SPI. It reaches the radio only if the pins are connected to the
    /// peripheral.
    fn exchange(&mut self, byte: u8, end: Time) {
        if self.f051.spi_bit_rate() > SPI_LIMIT_HZ && !self.spi_was_too_fast {
            self.spi_was_too_fast = true;
            let error = HardwareError::RadioSpiTooFast {
                hz: self.f051.spi_bit_rate(),
                limit_hz: SPI_LIMIT_HZ,
            };
            self.events.push((self.now, BoardEvent::HardwareError(error)));
        }
        let connected = SPI.iter().all(|pin| self.f051.ports[A].pin(*pin) == Pin::Alternate(0));
        let answer = if connected { self.radio.transfer(byte, end) } else { 0 };
        self.f051.spi_received(answer, end);
    }

    fn talk(&mut self, action: BusAction, end: Time) {
        let connected = I2C.iter().all(|pin| self.f051.ports[B].pin(*pin) == Pin::Alternate(1));
        match action {
            BusAction::Start { address, read } => {
                let answers = self.devices.start(address, read, end) && connected;
                self.f051.i2c_acknowledge(answers, end);
            }
            BusAction::Write(byte) => {
                let answers = connected && self.devices.write(byte, end);
                self.f051.i2c_acknowledge(answers, end);
            }
            BusAction::Read => {
                let byte = if connected { self.devices.read(end) } else { 0xff };
                self.f051.i2c_received(byte, end);
            }
            BusAction::Stop => self.devices.stop(),
        }
        self.settle_touch();
    }

    /// Passes the radio's IRQ level to the pin, and collects the packets that the radio announces.
    fn settle_radio(&mut self) {
        let irq = self.radio.irq();
        if irq != std::mem::replace(&mut self.irq, irq) {
            self.f051.drive(IRQ.0, IRQ.1, irq);
        }
        for transmission in self.radio.take_transmissions() {
            let Transmission { begin, end, packet } = &transmission;
            let (channel, payload) = (packet.channel(), packet.payload().to_vec());
            self.events.push((*begin, BoardEvent::Radio { channel, payload, air: *end - *begin }));
            self.transmissions.push(transmission);
        }
    }

    fn settle_touch(&mut self) {
        let change = self.devices.touch.change();
        if change != std::mem::replace(&mut self.change, change) {
            self.f051.drive(TOUCH_CHANGE.0, TOUCH_CHANGE.1, change);
        }
    }

    /// Shows the devices that the master let the bus go, if it did.
    fn release_bus(&mut self) {
        if let Some(release) = self.f051.take_i2c_release() {
            self.devices.leave(release, self.now);
            self.settle_bus();
        }
    }

    /// Applies the level that the devices give to SDA.
    fn settle_bus(&mut self) {
        let is_held = self.devices.holds();
        self.f051.drive(B, I2C[1], !is_held);
        self.f051.set_i2c_held(is_held);
    }

    /// Applies the firmware's outputs to the radio's pins. A pin without a driver has no effect.
    fn settle_pins(&mut self) {
        let selected = self.f051.ports[CSN.0].pin(CSN.1) == Pin::Level(false);
        if selected != std::mem::replace(&mut self.selected, selected) {
            self.radio.select(selected, self.now);
        }
        let enabled = self.f051.ports[CE.0].pin(CE.1) == Pin::Level(true);
        if enabled != std::mem::replace(&mut self.enabled, enabled) {
            self.radio.enable(enabled, self.now);
        }
        self.radio.set_clock(self.f051.mco_hz(), self.now);
        self.settle_radio();
        let scl = self.f051.ports[B].pin(I2C[0]) != Pin::Level(false);
        if scl != std::mem::replace(&mut self.scl, scl) && !scl {
            self.devices.clock();
            self.settle_bus();
        }
    }

    fn find_next(&self) -> Option<Time> {
        let radio = self.radio.next_event();
        let events = self.f051.next().into_iter().chain(radio);
        events.chain([self.diodes.next_event()]).min().filter(|at| *at < Time::NEVER)
    }

    fn after_access(&mut self) {
        let errors = self.f051.take_errors();
        self.events
            .extend(errors.into_iter().map(|error| (self.now, BoardEvent::HardwareError(error))));
        self.next = self.find_next();
    }

    /// Returns the signal at a pin of port A, to which channel `channel` of a timer may be
    /// connected; `None` if nothing drives the pin.
    fn signal(&self, pin: u8, timer: usize, channel: u32) -> Option<Pwm> {
        match self.f051.ports[A].pin(pin) {
            Pin::Floating => None,
            Pin::Level(level) => Some(if level { Pwm::HIGH } else { Pwm::LOW }),
            Pin::Alternate(TIMER_FUNCTION) => self.f051.timer(timer).output(channel),
            Pin::Alternate(_) => None,
        }
    }

    /// Reports changes of the LED and of the motors' inputs.
    fn observe(&mut self) {
        for (index, (led, pin, channel)) in LEDS.into_iter().enumerate() {
            let light = self.signal(pin, 1, channel).map_or(0.0, |signal| 1.0 - signal.duty);
            self.brightest = self.brightest.max(light);
            let on = light > 0.0;
            if on != std::mem::replace(&mut self.leds[index], on) {
                self.events.push((self.now, BoardEvent::Led { led, on }));
            }
        }
        for input in 0..MOTOR_INPUTS {
            // The bridge's inputs are pulled down.
            let signal = self.signal(input, 2, u32::from(input)).unwrap_or(Pwm::LOW);
            if signal != std::mem::replace(&mut self.motors[usize::from(input)], signal) {
                let Pwm { duty, frequency_hz } = signal;
                let event = BoardEvent::Motor { number: input + 1, duty, frequency_hz };
                self.events.push((self.now, event));
            }
        }
    }

    /// Sets the robot's pose from now on; `None` is a place that the projector does not reach.
    pub fn place(&mut self, pose: Option<TablePose>) {
        self.pose = pose.map(|pose| (self.now, pose));
        // The sensor's z axis points up, but the table's headings grow clockwise: the sign changes.
        self.devices.motion.turn_degrees_s = pose.map_or(0.0, |pose| -pose.turn_degrees_s);
    }

    /// Sets the properties of the STM32 from the next reset on; the debugger has no effect here. A
    /// brown-out that keeps the memory was too short for radio and sensors to notice. No data sheet
    /// gives the voltage below which they restart.
    pub fn set_chip(&mut self, chip: ChipProperties) {
        self.next_chip = Some(chip);
    }

    /// Requests a reset of the STM32 with this cause.
    pub fn request_reset(&mut self, cause: ResetCause) {
        self.reset_request = Some(cause);
    }

    /// Sets the faults of the projector's light from now on.
    pub fn set_light(&mut self, light: LightDisturbance) {
        self.diodes.set_light(light);
    }

    /// Selects the interpretation of the radio's register RPD from now on.
    pub fn set_power_detector(&mut self, power_detector: PowerDetector) {
        self.radio.set_power_detector(power_detector);
    }

    /// Puts fingers on these electrodes from now on: bit 0 is KEY1.
    pub fn press(&mut self, keys: u8) {
        self.devices.touch.press(keys);
        self.settle_touch();
        self.next = self.find_next();
    }

    /// Sets the battery's voltage in volts, and charging on or off.
    pub fn set_battery(&mut self, volts: f64, charging: bool) {
        self.f051.set_battery_volts(volts);
        self.f051.drive(CHARGING.0, CHARGING.1, !charging);
        self.next = self.find_next();
    }

    /// Connects or disconnects the battery. The flash keeps its content, and light and fingers stay
    /// as they are.
    pub fn set_power(&mut self, on: bool) {
        if on != self.has_power {
            self.has_power = on;
            self.reset_request = Some(if on { ResetCause::PowerOn } else { ResetCause::PowerOff });
        }
    }

    /// Returns the counters since the first power-on.
    pub fn statistics(&self) -> ZooidStatistics {
        let [touch_addressed, motion_addressed] = self.devices.addressed;
        ZooidStatistics {
            touch_addressed,
            motion_addressed,
            brightest: self.brightest,
            radio: self.radio.statistics.clone(),
            clocks_hz: self.f051.clocks_hz(),
            accesses_without_clock: self.f051.accesses_without_clock(),
            unknown: self.f051.unknown.values().copied().collect(),
        }
    }
}

/// Voltage of a half full battery.
const BATTERY_VOLTS: f64 = 3.8;

impl Board for ZooidBoard {
    const CORE: CoreKind = CoreKind::CortexM0;
    const MEMORY: MemoryMap = MemoryMap {
        flash: FLASH_SIZE,
        ram: 8 * 1024,
        ccm: 0,
        peripherals: &[(0x4000_0000, 0x3_0000), (0x4800_0000, 0x2000)],
        // The memory below the RAM is not writable, so that a stack that overflows causes a fault.
        read_only: &[(0x1fff_e000, 0x2000)],
    };

    fn power_on(number: usize) -> Self {
        let mut unique_id = *b"\x29\x00\x1d\x00ZOOID-00";
        unique_id[10..].copy_from_slice(&(number as u16).to_be_bytes());
        let mut board = ZooidBoard {
            now: Time::ZERO,
            next: None,
            f051: F051::new(unique_id, BATTERY_VOLTS),
            radio: Nrf24::new(),
            devices: Devices::new(),
            diodes: Diodes::new(),
            pose: None,
            leds: [false; LEDS.len()],
            brightest: 0.0,
            motors: [Pwm::LOW; MOTOR_INPUTS as usize],
            selected: false,
            enabled: false,
            irq: true,
            change: true,
            scl: true,
            spi_was_too_fast: false,
            reset_request: None,
            next_chip: None,
            memory: MemoryContent::Kept,
            last_reset: ResetCause::PowerOn,
            has_power: true,
            transmissions: Vec::new(),
            events: Vec::new(),
        };
        for ((port, pin), level) in
            [(IRQ, true), (TOUCH_CHANGE, true), (CHARGING, true), (MOTION_INT1, false)]
        {
            board.f051.drive(port, pin, level);
        }
        // Resistors pull the bus up.
        for pin in I2C {
            board.f051.drive(B, pin, true);
        }
        for (port, pin) in PHOTODIODES {
            board.f051.drive(port, pin, false);
        }
        board.next = board.find_next();
        board
    }

    fn now(&self) -> Time {
        self.now
    }

    fn advance(&mut self, to: Time) {
        while let Some(at) = self.next.filter(|at| *at <= to) {
            self.now = self.now.max(at);
            self.step();
        }
        if to > self.now {
            self.now = to;
            self.f051.set_now(to);
        }
    }

    fn next_event(&self) -> Option<Time> {
        let radio = self.radio.next_event();
        let events = self.f051.next_event().into_iter().chain(radio);
        events.chain([self.diodes.next_event()]).min().filter(|at| *at < Time::NEVER)
    }

    fn read(&mut self, address: u32, width: Width) -> u32 {
        let value = self.f051.read(address, width);
        if self.reading_acts(address) || self.f051.has_errors() {
            self.after_access();
        }
        value
    }

    fn reading_acts(&self, address: u32) -> bool {
        !F051::is_only_looked_at(address)
    }

    fn write(&mut self, address: u32, width: Width, value: u32) {
        self.f051.write(address, width, value);
        let block = address >> 10;
        self.release_bus();
        // RCC, and ports A and B.
        if matches!(block, 0x10_0084 | 0x12_0000 | 0x12_0001) {
            self.settle_pins();
        }
        // TIM2 and TIM1, RCC, port A.
        if matches!(block, 0x10_0000 | 0x10_004b | 0x10_0084 | 0x12_0000) {
            self.observe();
        }
        self.after_access();
    }

    fn interrupts(&self) -> Lines {
        self.f051.lines()
    }

    fn core_clock_hz(&self) -> u64 {
        if self.has_power { self.f051.core_clock_hz() } else { 0 }
    }

    fn take_reset_request(&mut self) -> Option<ResetCause> {
        self.reset_request.take()
    }

    fn reset(&mut self, cause: ResetCause) {
        if let Some(chip) = self.next_chip.take() {
            self.f051.set_oscillators(chip.lsi_hz, chip.has_crystal);
            self.memory = chip.memory;
        }
        self.last_reset = cause;
        self.f051.reset(cause);
        let has_noticed = match cause {
            ResetCause::PowerOn | ResetCause::PowerOff => true,
            ResetCause::BrownOut => self.memory != MemoryContent::Kept,
            ResetCause::Pin | ResetCause::Software | ResetCause::IndependentWatchdog => false,
        };
        if has_noticed {
            self.radio.restart(self.now);
            self.devices.restart(self.now);
            self.settle_touch();
        }
        self.release_bus();
        self.settle_pins();
        self.observe();
        self.next = self.find_next();
    }

    fn set_halted(&mut self, halted: bool) {
        self.f051.set_halted(halted);
    }

    fn start(&mut self, _vectors: u32) -> CoreStart {
        let is_brown_out = self.last_reset == ResetCause::BrownOut;
        let content = self.memory.content(Self::MEMORY.ram, &mut self.memory.noise());
        let content = content.filter(|_| is_brown_out).map(|content| (RAM, content));
        CoreStart { memory: content.into_iter().collect(), ..CoreStart::default() }
    }

    fn watchdog_runs(&self) -> bool {
        self.f051.watchdog_runs()
    }

    fn is_powered(&self) -> bool {
        // A robot that is switched off can be switched on again; until then its core clock is 0.
        true
    }

    fn take_events(&mut self) -> Vec<(Time, BoardEvent)> {
        std::mem::take(&mut self.events)
    }

    fn wants_memory(&self) -> bool {
        self.f051.wants_memory()
    }

    fn next_transfer(&mut self) -> Option<Transfer> {
        self.f051.next_transfer()
    }

    /// Returns the time up to which nothing changes while the core sleeps. The photodiodes' edges
    /// count only if a timer's capture interrupts; otherwise they are recorded during the sleep.
    fn quiet_until(&self) -> Time {
        if self.reset_request.is_some() {
            return self.now;
        }
        if self.f051.interrupts_on_capture() {
            return self.next.unwrap_or(Time::NEVER);
        }
        let radio = self.radio.next_event();
        self.f051.next().into_iter().chain(radio).min().unwrap_or(Time::NEVER)
    }

    fn take_transmissions(&mut self) -> Vec<Transmission> {
        std::mem::take(&mut self.transmissions)
    }

    fn receive(&mut self, received: ReceptionEvent) {
        match received {
            ReceptionEvent::Signal(channel, begin, end) => {
                self.radio.sense(channel, begin, end, self.now)
            }
            ReceptionEvent::Packet(transmission, intact) => {
                self.radio.receive(transmission, intact);
                self.next = self.find_next();
            }
        }
    }

    fn packet_of(&self, payload: &[u8], begin: Time) -> Option<Transmission> {
        let packet = self.radio.packet_of(payload);
        Some(Transmission { begin, end: begin + packet.air_time(), packet })
    }

    fn program(&mut self, address: u32, old: u16, new: u16) -> Option<FlashChange> {
        self.f051.program(address, old, new)
    }

    fn take_flash_change(&mut self) -> Option<FlashChange> {
        self.f051.take_flash_change()
    }
}
