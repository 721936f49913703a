//! The board of a Crazyflie 2: an STM32F405, an nRF51822, LEDs and motors.

mod body;
mod bootloader;
#[cfg(test)]
mod bus_tests;
mod buses;
mod control;
mod decks;
#[cfg(test)]
mod tests;

use bittybuzz_chips::f405::{F405, PinAction};
use bittybuzz_chips::nrf51::{BAUD, BYTE_TIME_MIN, Nrf51, PeerAction};
use bittybuzz_chips::stm32::{Pin, Pwm};
use bittybuzz_chips::{
    Battery, Board, BoardEvent, BoardLed, ChipProperties, CoreKind, CoreStart, ExternalPose,
    FlashChange, LineQuality, Lines, LinkFrame, MemoryContent, MemoryMap, Nrf51Settings, P2pFrame,
    Random, ResetCause, Time, Transfer, Width,
};
use bittybuzz_emulation::message::DeviceFault;

use crate::body::FlightBody;
pub use crate::body::{BodySettings, PoseSource};
use crate::bootloader::FIRMWARE;
use crate::buses::Buses;
use crate::decks::Decks;
pub use crate::decks::{AttachedDeck, RangesMm};

/// The LEDs: port, pin, and true if the LED shines while the pin is high.
const LEDS: [(BoardLed, usize, u8, bool); 5] = [
    (BoardLed::BlueLeft, 3, 2, true),
    (BoardLed::RedLeft, 2, 0, false),
    (BoardLed::GreenLeft, 2, 1, false),
    (BoardLed::GreenRight, 2, 2, false),
    (BoardLed::RedRight, 2, 3, false),
];

/// The connections of motors 1 to 4: port, pin, and the channel of a timer that the alternate
/// function connects to the pin.
const MOTORS: [Motor; 4] = [
    Motor { port: 0, pin: 1, function: 1, timer: 2, channel: 1 },
    Motor { port: 1, pin: 11, function: 1, timer: 2, channel: 3 },
    Motor { port: 0, pin: 15, function: 1, timer: 2, channel: 0 },
    Motor { port: 1, pin: 9, function: 2, timer: 4, channel: 3 },
];

struct Motor {
    port: usize,
    pin: u8,
    function: u8,
    timer: usize,
    channel: u32,
}

/// First addresses of its memories (RM0090 2.3).
const RAM: u32 = 0x2000_0000;
const CCM: u32 = 0x1000_0000;

/// Port and pin of the radio's flow control.
const FLOW_CONTROL: (usize, u8) = (0, 4);

/// The differences between one Crazyflie and another.
#[derive(Clone, Debug)]
pub struct CrazyflieVariation {
    /// The chip's 96-bit unique id (RM0090 39.1).
    pub unique_id: [u8; 12],
    /// The device type that Bitcraze writes to the one-time programmable area.
    pub device_type: String,
    /// The decks on the expansion port.
    pub decks: Vec<AttachedDeck>,
}

impl Default for CrazyflieVariation {
    fn default() -> Self {
        CrazyflieVariation {
            unique_id: *b"\x2a\x00\x1b\x00CF21-001",
            device_type: "0;CF21".into(),
            decks: Vec::new(),
        }
    }
}

/// The counters since power-on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Longest time from a byte's arrival at USART6 until it was read.
    pub receive_latency: Time,
    /// Bytes that USART6 lost because the byte before had not been read.
    pub overruns: u64,
    /// Bytes that USART6 received with a wrong stop bit.
    pub framing_errors: u64,
    /// Bytes that the radio's processor received.
    pub peer_received: u64,
    /// The number of these with a wrong stop bit.
    pub peer_framing_errors: u64,
    /// Frames that the radio's processor dropped because of their checksum.
    pub peer_bad_checksums: u64,
    /// Bytes that the radio's processor lost because its queue was full; the line for flow control
    /// does not show this.
    pub peer_dropped: u64,
    /// Bytes that the UART of the radio's processor lost because the firmware ignored flow control.
    pub peer_overruns: u64,
    /// Frames that were not sent to the firmware because the radio's processor was still silent.
    pub peer_unsent: u64,
    /// P2P frames that came while the radio was transmitting.
    pub radio_unheard: u64,
    /// P2P frames for which the radio's processor had no room, because they came faster than the
    /// line to the firmware takes them.
    pub radio_overflown: u64,
    /// Own P2P frames that were cut off on the air, by the next one or by a change of the radio's
    /// settings.
    pub radio_cut: u64,
    /// Bytes that the line lost because of [`CrazyflieBoard::set_link`], in both directions.
    pub link_lost: u64,
    /// Bytes that the line changed because of [`CrazyflieBoard::set_link`], in both directions.
    pub link_corrupted: u64,
    /// Frequencies of the core, of APB1 and of APB2, as they are now.
    pub clocks_hz: [u64; 3],
    /// Accesses to peripherals whose clock is off.
    pub accesses_without_clock: u64,
    /// For each block without a model, which is plain storage, the first address that was used.
    pub unknown: Vec<u32>,
}

/// A Crazyflie 2 without the core of its STM32.
pub struct CrazyflieBoard {
    now: Time,
    /// The time of the next internal event.
    next: Option<Time>,
    f405: F405,
    chip: ChipProperties,
    /// Properties of the chip from the next reset on.
    next_chip: ChipProperties,
    /// New one-time programmable bytes for the next reset, if they change.
    next_otp: Option<Vec<u8>>,
    /// The cause of the last reset.
    last_reset: ResetCause,
    noise: Random,
    nrf51: Nrf51,
    /// The nRF51's next event. Only [`CrazyflieBoard::settle`] lets the nRF51 act, so an access of the
    /// firmware does not change it.
    nrf51_next: Option<Time>,
    buses: Buses,
    body: Option<FlightBody>,
    /// True once the state of the battery was set, which then does not follow the body.
    battery_is_set: bool,
    leds: [bool; LEDS.len()],
    motors: [Pwm; MOTORS.len()],
    reset_request: Option<ResetCause>,
    power_is_off: bool,
    events: Vec<(Time, BoardEvent)>,
}

impl CrazyflieBoard {
    /// Creates a Crazyflie whose power was just turned on.
    pub fn new(settings: CrazyflieVariation) -> Self {
        let chip = ChipProperties::default();
        let mut f405 = F405::new(settings.unique_id, &settings.device_type, chip.lsi_hz);
        let mut board = CrazyflieBoard {
            now: Time::ZERO,
            next: None,
            buses: Buses::new(&mut f405, Time::ZERO),
            f405,
            chip,
            next_chip: chip,
            next_otp: None,
            last_reset: ResetCause::PowerOn,
            noise: Random::new(0),
            nrf51: Nrf51::new(),
            nrf51_next: None,
            body: None,
            battery_is_set: false,
            leds: [false; LEDS.len()],
            motors: [Pwm::LOW; MOTORS.len()],
            reset_request: None,
            power_is_off: false,
            events: Vec::new(),
        };
        board.set_decks(settings.decks);
        board.settle();
        board
    }

    /// Passes the output of the radio's processor to the STM32's USART and pins, and handles a loss
    /// of power.
    fn settle(&mut self) {
        for output in self.nrf51.advance(self.now) {
            match output {
                PeerAction::Begin => self.f405.begin_byte(),
                PeerAction::Byte(byte) => self.f405.receive(byte, BAUD),
            }
        }
        let (port, pin) = FLOW_CONTROL;
        self.f405.drive(port, pin, self.nrf51.is_full(self.now));
        let was_powered = !self.power_is_off;
        self.power_is_off = !self.nrf51.is_powered();
        self.events.extend(self.nrf51.take_events());
        if was_powered && self.power_is_off {
            self.f405.reset(ResetCause::PowerOn);
            self.observe();
        }
        self.nrf51_next = self.nrf51.next_event(self.now);
        self.next = self.find_next_event();
    }

    fn find_next_event(&self) -> Option<Time> {
        let chips = self.f405.next_event().into_iter().chain(self.nrf51_next);
        let body = self.body.as_ref().map(FlightBody::next_step);
        let events = chips.chain(self.buses.next_event()).chain(body);
        // An event that needs a stopped clock never comes.
        events.min().filter(|at| *at < Time::NEVER)
    }

    fn after_access(&mut self) {
        let errors = self.f405.take_errors();
        self.events
            .extend(errors.into_iter().map(|error| (self.now, BoardEvent::HardwareError(error))));
        self.next = self.find_next_event();
    }

    /// Reports changes of LEDs and motors.
    fn observe(&mut self) {
        for ((led, port, pin, active), was_on) in LEDS.into_iter().zip(&mut self.leds) {
            let on = self.f405.ports[port].pin(pin) == Pin::Level(active);
            if on != *was_on {
                *was_on = on;
                self.events.push((self.now, BoardEvent::Led { led, on }));
            }
        }
        for (number, (motor, last)) in (1..).zip(MOTORS.iter().zip(&mut self.motors)) {
            let signal = match self.f405.ports[motor.port].pin(motor.pin) {
                // The transistor's gate is pulled down.
                Pin::Floating | Pin::Level(false) => Pwm::LOW,
                Pin::Level(true) => Pwm::HIGH,
                Pin::Alternate(function) if function == motor.function => {
                    self.f405.timer(motor.timer).output(motor.channel).unwrap_or(Pwm::LOW)
                }
                Pin::Alternate(_) => Pwm::LOW,
            };
            if signal != *last {
                *last = signal;
                let Pwm { duty, frequency_hz } = signal;
                self.events.push((self.now, BoardEvent::Motor { number, duty, frequency_hz }));
            }
        }
    }

    /// Gives the robot a body in the physics from now on. Before, its sensors measure a robot at rest.
    pub fn set_body(&mut self, settings: &BodySettings) {
        self.body = Some(FlightBody::new(settings, self.now));
        self.next = self.find_next_event();
    }

    /// Returns the body, if the robot has one.
    pub(crate) fn body_mut(&mut self) -> Option<&mut FlightBody> {
        self.body.as_mut()
    }

    /// Moves the body up to now, and passes the measurements to the sensors.
    fn move_body(&mut self) {
        let Some(body) = &mut self.body else { return };
        if body.next_step() > self.now {
            return;
        }
        let sensed = body.step(self.motors.map(|signal| signal.duty));
        if !self.battery_is_set {
            self.nrf51.set_volts(body.battery_volts() as f32);
        }
        if let Some(counts) = sensed.inertial {
            self.buses.set_motion(counts.gyro, counts.accel, self.now);
        }
        if let Some(pressure_pa) = sensed.pressure_pa {
            self.buses.set_pressure(pressure_pa, self.now);
        }
        if let Some(flow) = sensed.flow {
            self.buses.decks.add_flow(flow);
        }
        self.buses.decks.set_height(sensed.distance, self.now);
        if let Some(pose) = sensed.pose {
            self.nrf51.send_frame(&pose.frame(), self.now);
        }
        self.events.extend(sensed.motion.map(|motion| (self.now, BoardEvent::Motion(motion))));
    }

    /// Returns the counters since power-on.
    pub fn statistics(&self) -> Statistics {
        let (usart, peer) = (&self.f405.usart, &self.nrf51);
        Statistics {
            receive_latency: usart.longest_unread,
            overruns: usart.overruns,
            framing_errors: usart.framing_errors,
            peer_received: peer.received,
            peer_framing_errors: peer.framing_errors,
            peer_bad_checksums: peer.bad_sums.iter().sum(),
            peer_dropped: peer.dropped,
            peer_overruns: peer.overruns,
            peer_unsent: peer.not_sent,
            radio_unheard: peer.radio().unheard,
            radio_overflown: peer.radio().overflown,
            radio_cut: peer.radio().cut,
            link_lost: peer.lost(),
            link_corrupted: peer.corrupted(),
            clocks_hz: self.f405.clocks_hz(),
            accesses_without_clock: self.f405.accesses_without_clock(),
            unknown: self.f405.unknown.values().copied().collect(),
        }
    }

    /// Sends a frame from the radio's processor to the firmware, after those that still wait. The
    /// processor sends nothing before it has received a good frame, and nothing from the radio
    /// before the firmware is ready or 3 s have passed; such frames are lost and counted.
    pub fn send(&mut self, frame: &LinkFrame) {
        self.nrf51.send_frame(frame, self.now);
        self.settle();
    }

    /// Puts another robot's P2P frame on the air. Its last bit comes at `end`, or now if that is
    /// past. The caller decides which robots are in range and which frames collide.
    pub fn add_frame(&mut self, frame: &P2pFrame, end: Time) {
        self.nrf51.add_frame(frame, end.max(self.now));
        self.settle();
    }

    /// Sends the robot's pose from a positioning system to the firmware, as a ground station does.
    pub fn send_pose(&mut self, pose: ExternalPose) {
        self.send(&pose.frame());
    }

    /// Sends raw bytes from the radio's processor, back to back after those that wait.
    pub fn send_bytes(&mut self, bytes: &[u8]) {
        self.nrf51.send_bytes(bytes);
        self.settle();
    }

    /// Sets the error rates of the line from now on.
    pub fn set_link(&mut self, link: LineQuality) {
        self.nrf51.set_link(link);
    }

    /// Stops (`true`) or restarts (`false`) the receiver of the radio processor's UART; the line
    /// for flow control shows it.
    pub fn set_flow_control(&mut self, full: bool) {
        self.nrf51.set_stopped(full, self.now);
        self.settle();
    }

    /// Sets or ends the fault of a device. Without a Flow deck, faults of its sensors have no effect.
    pub fn set_fault(&mut self, fault: DeviceFault) {
        match fault {
            DeviceFault::DeckMemories(fault) => self.nrf51.decks.set_fault(fault.map(Into::into)),
            fault => self.buses.set_fault(&mut self.f405, fault, self.now),
        }
        self.settle();
    }

    /// Sets the distances that the range finders of the decks measure from now on, in mm: `None` for
    /// no echo. A body replaces the one downwards.
    pub fn set_ranges(&mut self, ranges: RangesMm) {
        self.buses.decks.set_ranges(ranges, self.now);
    }

    /// Sets the first bytes of the EEPROM, which has as many at least. The others are erased.
    pub fn set_eeprom(&mut self, bytes: &[u8]) {
        self.buses.set_memory(bytes);
    }

    /// Plugs these decks in instead of those that the robot had. Their power is on from now on. A
    /// firmware that has looked for decks before does not find them.
    pub fn set_decks(&mut self, decks: Vec<AttachedDeck>) {
        self.buses.decks = Decks::new(decks, self.now);
        self.nrf51.decks = self.buses.decks.memories();
    }

    /// Returns true if a Flow deck is attached.
    pub fn has_flow_deck(&self) -> bool {
        self.buses.decks.has_flow()
    }

    /// Configures the radio's processor from now on.
    pub fn set_nrf51(&mut self, settings: Nrf51Settings) {
        self.nrf51.set(settings);
    }

    /// Restarts the radio's processor; the STM32 continues to run.
    pub fn restart_nrf51(&mut self) {
        self.nrf51.restart(self.now);
        self.settle();
    }

    /// Sets the properties of the STM32 from the next reset on.
    pub fn set_chip(&mut self, chip: ChipProperties) {
        self.next_chip = chip;
    }

    /// Sets the content of the one-time programmable memory, of [`OTP`](bittybuzz_chips::f405::OTP)
    /// bytes, from the next reset on. The bytes after `content` are erased.
    pub fn set_otp(&mut self, content: Vec<u8>) {
        self.next_otp = Some(content);
    }

    /// Requests a reset of the STM32 with this cause.
    pub fn request_reset(&mut self, cause: ResetCause) {
        self.reset_request = Some(cause);
    }

    /// Sets the state of the battery from now on, also of a robot with a body, whose motors get this
    /// voltage.
    pub fn set_battery(&mut self, battery: Battery) {
        self.battery_is_set = true;
        self.nrf51.set_battery(battery);
        if let Some(body) = &mut self.body {
            body.set_battery_volts(battery.volts.into());
        }
    }

    /// Presses the power button: the radio's processor asks the firmware to shut down, and cuts the
    /// power when the firmware has acknowledged, after a second at the latest.
    pub fn request_shutdown(&mut self) {
        self.nrf51.request_shutdown(self.now);
        self.settle();
    }
}

/// Reads reach the peripherals, the one-time programmable and unique-id area, and DBGMCU. A reset
/// does not affect the radio's processor, which also controls the power.
impl Board for CrazyflieBoard {
    const CORE: CoreKind = CoreKind::CortexM4F;
    const MEMORY: MemoryMap = F405::MEMORY;

    fn power_on(number: usize) -> Self {
        let mut settings = CrazyflieVariation::default();
        // Only the last digit of the default id differs between robots.
        settings.unique_id[11] = settings.unique_id[11].wrapping_add(number as u8);
        CrazyflieBoard::new(settings)
    }

    fn now(&self) -> Time {
        self.now
    }

    fn advance(&mut self, to: Time) {
        while let Some(at) = self.next.filter(|at| *at <= to) {
            self.now = self.now.max(at);
            match self.f405.advance(self.now) {
                Some(PinAction::Usart(sent)) => {
                    self.nrf51.receive(sent.byte, sent.baud, self.now);
                }
                Some(PinAction::Spi(end, byte)) => self.buses.exchange(&mut self.f405, byte, end),
                Some(PinAction::I2c(bus, end, action)) => {
                    self.buses.perform(&mut self.f405, bus, action, end);
                }
                None => {}
            }
            self.move_body();
            self.buses.advance(&mut self.f405, self.now);
            if self.f405.take_watchdog_expiry() {
                self.reset_request = Some(ResetCause::IndependentWatchdog);
            }
            self.settle();
        }
        if to > self.now {
            self.now = to;
            self.f405.set_now(to);
        }
    }

    fn next_event(&self) -> Option<Time> {
        self.next
    }

    fn read(&mut self, address: u32, width: Width) -> u32 {
        let value = self.f405.read(address, width);
        if F405::reading_acts(address) || self.f405.has_errors() {
            self.after_access();
        }
        value
    }

    fn write(&mut self, address: u32, width: Width, value: u32) {
        self.f405.write(address, width, value);
        // The lines of the buses depend on I2C1, I2C3, the ports A to C and resets.
        if matches!(address >> 10, 0x10_0015 | 0x10_0017 | 0x10_0080..=0x10_0082 | 0x10_008e) {
            self.buses.after_write(&mut self.f405, self.now);
        }
        self.after_access();
        // LEDs and motors depend on TIM2, TIM4, the ports and the clocks.
        if matches!(address >> 10, 0x10_0000 | 0x10_0002 | 0x10_0080..=0x10_008e) {
            self.observe();
        }
    }

    fn interrupts(&self) -> Lines {
        self.f405.lines()
    }

    fn core_clock_hz(&self) -> u64 {
        self.f405.core_clock_hz()
    }

    fn wants_memory(&self) -> bool {
        self.f405.wants_memory()
    }

    fn silent_until(&self, acts: Time) -> Time {
        let next_byte = self.f405.usart.sent_at().unwrap_or(acts + BYTE_TIME_MIN);
        self.nrf51.silent_until(next_byte, self.now)
    }

    fn next_transfer(&mut self) -> Option<Transfer> {
        let transfer = self.f405.next_transfer();
        self.after_access();
        transfer
    }

    fn program(&mut self, address: u32, _old: u16, _new: u16) -> Option<FlashChange> {
        self.f405.program(address);
        self.after_access();
        None
    }

    fn take_reset_request(&mut self) -> Option<ResetCause> {
        self.reset_request.take()
    }

    fn reset(&mut self, cause: ResetCause) {
        self.chip = self.next_chip;
        self.last_reset = cause;
        if let Some(otp) = self.next_otp.take() {
            self.f405.set_otp(&otp);
        }
        self.f405.set_oscillators(self.chip.lsi_hz, self.chip.has_crystal);
        self.f405.reset(cause);
        self.buses.after_write(&mut self.f405, self.now);
        if let MemoryContent::Noise { seed } = self.chip.memory {
            self.noise = Random::new(seed);
        }
        if cause == ResetCause::PowerOn {
            self.buses.restart(&mut self.f405, self.now);
            match self.chip.memory {
                MemoryContent::Kept => {}
                MemoryContent::Zeroed => self.f405.fill_backup(|| 0),
                MemoryContent::Noise { .. } => self.f405.fill_backup(|| self.noise.bits() as u32),
            }
        }
        self.observe();
        self.settle();
    }

    /// Models the bootloader. A firmware in the bootloader's place starts at once.
    fn start(&mut self, vectors: u32) -> CoreStart {
        let MemoryMap { ram, ccm, .. } = Self::MEMORY;
        let mut memory = Vec::new();
        // After a power-on the core has filled its memory with noise already.
        if self.last_reset != ResetCause::PowerOn {
            for (address, length) in [(RAM, ram), (CCM, ccm)] {
                let content = self.chip.memory.content(length, &mut self.noise);
                memory.extend(content.map(|content| (address, content)));
            }
        }
        if vectors != FIRMWARE {
            return CoreStart { memory, ..CoreStart::default() };
        }
        memory.extend(bootloader::overwritten(&mut self.noise));
        bootloader::set_clocks(&mut self.f405);
        let loader =
            bootloader::loader(self.nrf51.line_is_high(self.now), self.nrf51.is_full(self.now));
        self.events.extend(loader.map(|loader| (self.now, BoardEvent::Loader(loader))));
        self.after_access();
        CoreStart { memory, vector_table: FIRMWARE, is_in_loader: loader.is_some() }
    }

    fn is_debugged(&self) -> bool {
        self.chip.is_debugged
    }

    fn set_halted(&mut self, halted: bool) {
        self.f405.set_halted(halted);
    }

    fn watchdog_runs(&self) -> bool {
        self.f405.watchdog_runs()
    }

    fn is_powered(&self) -> bool {
        !self.power_is_off
    }

    fn take_events(&mut self) -> Vec<(Time, BoardEvent)> {
        std::mem::take(&mut self.events)
    }
}
