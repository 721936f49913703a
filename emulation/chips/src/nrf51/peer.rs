//! The behavior of the nRF51's firmware (crazyflie2-nrf-firmware: src/main.c, src/uart.c,
//! src/esb.c, src/shutdown.c).
//!
//! The firmware has one loop, each turn of which passes on one packet of the radio, reads one frame
//! of the STM32 and sends the reports that are due. The loop sends a frame byte by byte, waits for
//! each byte, and reads nothing meanwhile. The STM32's bytes enter the UART's FIFO; an interrupt
//! moves them to a queue. RTS, which is PA4 of the STM32, follows the FIFO, not the queue: bytes
//! that arrive while the queue is full are lost without notice.

use std::collections::VecDeque;

use super::link::SerialLine;
use super::radio::{Radio, RadioCounts};
use super::syslink::{Arrived, Nrf51Parser};
use super::{Battery, LineQuality, LinkFrame, P2pFrame};
use crate::devices::one_wire::DeckMemories;
use crate::serial::{self, FRAME_BITS};
use crate::{BoardEvent, BoardLed, Time};

/// The rate of the serial link in bits per second.
pub const BAUD: u64 = 1_000_000;
/// The shortest time for a byte: the sender's clock is fast by 3 %, the most that the UART tolerates
/// (serial.rs).
pub const BYTE_TIME_MIN: Time = Time::from_nanos(9_700);
/// The shortest time from the STM32's decision to transmit a P2P frame to that of the nRF51: the
/// frame's port and the six bytes around it.
pub const P2P_COMMAND_TIME_MIN: Time = Time::from_nanos(7 * BYTE_TIME_MIN.nanos());
/// Capacity of the UART's FIFO in bytes (nRF51 reference manual, 29.4).
const FIFO: usize = 6;
/// Capacity in bytes of the queue after the FIFO: one of its 128 places stays empty.
const QUEUE: usize = 127;
/// The time between two reports of battery and signal strength.
const REPORT_PERIOD: Time = Time::from_millis(10);
/// The first report comes at least this long after the reset.
const REPORTS_AFTER: Time = Time::from_millis(1_000);
/// The time from the nRF51's reset until it listens to the STM32: 100 ms and somewhat more. With
/// whole milliseconds the reports would come exactly when the STM32's timers expire.
const BOOT: Time = Time::from_micros(103_700);
/// Radio reception starts this long after the start, or when the firmware reports that it is ready.
const READY_AFTER: Time = Time::from_millis(3_000);
/// The time that the firmware has to acknowledge a shutdown: 1000 ticks of 1 ms (the comment in the
/// nRF51's source says 100 ms).
const SHUTDOWN_AFTER: Time = Time::from_millis(1_000);
/// The signal strength that is reported, in -dBm.
const RSSI: u8 = 50;

/// The properties of an nRF51 that depend on its firmware, or that no document states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Nrf51Settings {
    /// False for firmware from before 2025-10-09, which ignores RADIO_READY and listens from its
    /// start.
    pub knows_ready: bool,
    /// RTS is high while the UART's FIFO holds at least this number of bytes: 1 to
    /// [`Nrf51Settings::RTS_BYTES_MAX`].
    pub rts_bytes: u8,
    /// Duration of Bluetooth's shutdown, which precedes the first packet that the radio transmits
    /// or receives. The loop stops meanwhile.
    pub ble_shutdown: Time,
    /// True if no interrupt is served during that shutdown. The FIFO then fills, and RTS rises.
    pub ble_masks: bool,
}

impl Nrf51Settings {
    /// The largest value of `rts_bytes`: the STM32 may still send two bytes after RTS rises.
    pub const RTS_BYTES_MAX: u8 = 4;
}

impl Default for Nrf51Settings {
    /// Returns the settings of the current firmware. RTS rises when there is room for four more
    /// bytes, as Nordic's manuals say. The duration of the shutdown is not documented.
    fn default() -> Self {
        let ble_shutdown = Time::from_millis(5);
        Nrf51Settings { knows_ready: true, rts_bytes: 2, ble_shutdown, ble_masks: false }
    }
}

/// Types of frames.
mod kind {
    pub const RADIO_RAW: u8 = 0x00;
    pub const RADIO_CHANNEL: u8 = 0x01;
    pub const RADIO_DATARATE: u8 = 0x02;
    pub const RADIO_RSSI: u8 = 0x04;
    pub const RADIO_ADDRESS: u8 = 0x05;
    pub const RADIO_RAW_BROADCAST: u8 = 0x06;
    pub const RADIO_POWER: u8 = 0x07;
    pub const P2P: u8 = 0x08;
    pub const P2P_BROADCAST: u8 = 0x0a;
    pub const RADIO_READY: u8 = 0x0b;
    pub const SWITCH_OFF: u8 = 0x11;
    pub const BATTERY_STATE: u8 = 0x13;
    pub const BATTERY_AUTOUPDATE: u8 = 0x14;
    pub const SHUTDOWN_REQUEST: u8 = 0x15;
    pub const SHUTDOWN_ACK: u8 = 0x16;
    pub const LED_ON: u8 = 0x17;
    pub const LED_OFF: u8 = 0x18;
    pub const ONE_WIRE_SCAN: u8 = 0x20;
    pub const ONE_WIRE_WRITE: u8 = 0x23;
    pub const NRF_VERSION: u8 = 0x30;
    pub const DEBUG_PROBE: u8 = 0xf0;
}

/// An action of the nRF51 at its end of the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PeerAction {
    /// The nRF51 begins to send a byte.
    Begin,
    /// A byte arrived at the STM32.
    Byte(u8),
}

/// The stages of the loop's turn that may take time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Passes a packet of the radio to the STM32.
    Radio,
    /// Reads and answers a frame of the STM32.
    Read,
    /// Reports battery and signal strength.
    Report,
}

/// The nRF51 and its end of the serial line.
pub struct Nrf51 {
    settings: Nrf51Settings,
    battery: Battery,
    /// The memories of the decks, behind the nRF51's one-wire bus.
    pub decks: DeckMemories,
    line: SerialLine,
    powered: bool,
    state: VolatileState,
    events: Vec<(Time, BoardEvent)>,
    /// Bytes received from the STM32.
    pub received: u64,
    /// Received bytes with a wrong stop bit.
    pub framing_errors: u64,
    /// Frames dropped because the first checksum byte was wrong, or only the second.
    pub bad_sums: [u64; 2],
    /// Bytes that the UART lost because the firmware ignored flow control.
    pub overruns: u64,
    /// Bytes lost because the queue was full.
    pub dropped: u64,
    /// Frames for the STM32 that were dropped because the processor does not send yet.
    pub not_sent: u64,
}

/// The state that a restart discards.
struct VolatileState {
    /// The nRF51 listens to the STM32 from this time on.
    start: Time,
    stage: Stage,
    /// True if this turn of the loop did any work.
    worked: bool,
    /// The loop waits until this time.
    resumes: Time,
    ble_is_on: bool,
    parser: Nrf51Parser,
    radio: Radio,
    /// A P2P frame to be transmitted once Bluetooth is off: port and data.
    outgoing: Option<Vec<u8>>,
    /// Packets that were injected from outside for the radio to receive.
    from_world: VecDeque<LinkFrame>,
    /// The bytes in the UART's FIFO.
    fifo: VecDeque<u8>,
    /// True if the UART receives nothing and keeps RTS high.
    stopped: bool,
    /// No interrupt is served until this time.
    masked: Time,
    /// Bytes that the interrupt received and the loop did not read yet.
    queue: VecDeque<u8>,
    /// Bytes to be sent, with true if the loop waits for them. `sending` is the byte on the wire
    /// (none if the line loses it), with the time of its end.
    unsent: VecDeque<(u8, bool)>,
    sending: Option<(Time, Option<u8>, bool)>,
    /// True once a valid frame was received. The nRF51 sends nothing before.
    talks: bool,
    ready: bool,
    next_report: Option<Time>,
    shutdown_at: Option<Time>,
}

impl VolatileState {
    fn new(start: Time) -> Self {
        VolatileState {
            start,
            stage: Stage::Radio,
            worked: false,
            resumes: start,
            ble_is_on: true,
            parser: Nrf51Parser::default(),
            radio: Radio::new(),
            outgoing: None,
            from_world: VecDeque::new(),
            fifo: VecDeque::new(),
            stopped: false,
            masked: start,
            queue: VecDeque::new(),
            unsent: VecDeque::new(),
            sending: None,
            talks: false,
            ready: false,
            next_report: None,
            shutdown_at: None,
        }
    }

    /// Returns true while the loop waits for a byte to be sent.
    fn is_sending(&self) -> bool {
        let on_wire = self.sending.is_some_and(|(_, _, waits)| waits);
        on_wire || self.unsent.front().is_some_and(|(_, waits)| *waits)
    }
}

impl Default for Nrf51 {
    fn default() -> Self {
        Self::new()
    }
}

impl Nrf51 {
    /// Creates an nRF51 that has started and given the STM32 its power.
    pub fn new() -> Self {
        Nrf51 {
            settings: Nrf51Settings::default(),
            battery: Battery::default(),
            decks: DeckMemories::default(),
            line: SerialLine::default(),
            powered: true,
            state: VolatileState::new(Time::ZERO),
            events: Vec::new(),
            received: 0,
            framing_errors: 0,
            bad_sums: [0; 2],
            overruns: 0,
            dropped: 0,
            not_sent: 0,
        }
    }

    /// Sets the properties that depend on the nRF51's firmware.
    pub fn set(&mut self, settings: Nrf51Settings) {
        self.settings = settings;
    }

    /// Restarts the nRF51, which loses its state. The STM32 keeps its power.
    pub fn restart(&mut self, now: Time) {
        let counted = self.state.radio.counted;
        self.state = VolatileState::new(now + BOOT);
        self.state.radio.counted = counted;
    }

    /// Returns true while the STM32 has power.
    pub fn is_powered(&self) -> bool {
        self.powered
    }

    /// Returns the number of bytes that the line lost on request, in both directions.
    pub fn lost(&self) -> u64 {
        self.line.lost
    }

    /// Returns the number of bytes that the line changed on request, in both directions.
    pub fn corrupted(&self) -> u64 {
        self.line.corrupted
    }

    /// Returns the counters of the radio since power-on.
    pub fn radio(&self) -> RadioCounts {
        self.state.radio.counted
    }

    /// Returns the events since the last call, in order.
    pub fn take_events(&mut self) -> Vec<(Time, BoardEvent)> {
        std::mem::take(&mut self.events)
    }

    /// Sets the quality of the line.
    pub fn set_link(&mut self, link: LineQuality) {
        self.line.set(link);
    }

    /// Sets the state of the battery.
    pub fn set_battery(&mut self, battery: Battery) {
        self.battery = battery;
    }

    /// Sets the voltage of the battery.
    pub fn set_volts(&mut self, volts: f32) {
        self.battery.volts = volts;
    }

    /// Stops the UART's reception (`true`) or resumes it.
    pub fn set_stopped(&mut self, stopped: bool, now: Time) {
        self.state.stopped = stopped;
        self.empty_fifo(now);
        self.run(now);
    }

    /// Returns the level of RTS, which is high when no more bytes should come. Before the UART is
    /// set up only the STM32's pull-up drives the line.
    pub fn is_full(&self, now: Time) -> bool {
        let state = &self.state;
        let is_full = state.fifo.len() >= usize::from(self.settings.rts_bytes);
        now < state.start || state.stopped || is_full
    }

    /// Returns the level of the nRF51's line to the STM32, bit by bit; high while it sends nothing
    /// (serial.rs: start bit, eight bits, the least significant first, stop bit).
    pub fn line_is_high(&self, now: Time) -> bool {
        let Some((end, Some(byte), _)) = self.state.sending else {
            return true;
        };
        match (Time::of_ticks(FRAME_BITS, BAUD) - (end - now)).ticks(BAUD) {
            0 => false,
            bit @ 1..=8 => byte >> (bit - 1) & 1 != 0,
            _ => true,
        }
    }

    /// Requests a shutdown, as a press of the button does.
    pub fn request_shutdown(&mut self, now: Time) {
        self.send(kind::SHUTDOWN_REQUEST, &[]);
        self.state.shutdown_at = Some(now + SHUTDOWN_AFTER);
    }

    /// Returns the time at which [`advance`](Self::advance) has work to do. A frame that was just
    /// passed in needs a call at once.
    pub fn next_event(&self, now: Time) -> Option<Time> {
        let state = &self.state;
        let sent = state.sending.map(|(end, _, _)| end);
        let resumed = (now < state.resumes).then_some(state.resumes);
        let unmasked = (now < state.masked).then_some(state.masked);
        let heard = state.radio.next_arrival();
        // A report that is already due waits for the loop.
        let report = state.next_report.filter(|at| now < *at);
        let events = [sent, resumed, unmasked, heard, report, state.shutdown_at];
        events.into_iter().flatten().min()
    }

    /// Executes the actions that are due at `now` and returns the outputs in order.
    pub fn advance(&mut self, now: Time) -> Vec<PeerAction> {
        let mut outputs = Vec::new();
        if let Some((end, byte, _)) = self.state.sending
            && end <= now
        {
            outputs.extend(byte.map(PeerAction::Byte));
            self.state.sending = None;
        }
        if self.state.shutdown_at.is_some_and(|at| at <= now) {
            self.power_off(false, now);
        }
        self.empty_fifo(now);
        self.not_sent += self.state.radio.take_arrived(self.listens(now), now);
        self.run(now);
        if self.state.sending.is_none()
            && let Some((byte, waits)) = self.state.unsent.pop_front()
        {
            let byte = self.line.pass(byte);
            self.state.sending = Some((now + Time::of_ticks(FRAME_BITS, BAUD), byte, waits));
            outputs.extend(byte.map(|_| PeerAction::Begin));
        }
        outputs
    }

    /// Receives a byte that the STM32 sent at `baud`.
    pub fn receive(&mut self, byte: u8, baud: u64, now: Time) {
        let Some(byte) = self.line.pass(byte) else {
            return;
        };
        if now < self.state.start {
            return;
        }
        self.received += 1;
        let received = serial::receive(byte, baud, BAUD);
        self.framing_errors += u64::from(received.framing_error);
        if self.state.fifo.len() == FIFO {
            self.overruns += 1;
        } else {
            self.state.fifo.push_back(received.byte);
        }
        self.empty_fifo(now);
        self.run(now);
    }

    /// Sends a frame from outside to the STM32, if the nRF51 would send it in its present state.
    pub fn send_frame(&mut self, frame: &LinkFrame, now: Time) {
        let from_radio = matches!(
            frame.kind(),
            kind::RADIO_RAW | kind::RADIO_RAW_BROADCAST | kind::P2P | kind::P2P_BROADCAST
        );
        if !from_radio {
            self.send(frame.kind(), frame.payload());
        } else if self.listens(now) {
            self.state.from_world.push_back(frame.clone());
        } else {
            self.not_sent += 1;
        }
    }

    /// Returns the time before which the nRF51 does not decide to transmit a P2P frame, if the next
    /// byte of the STM32 arrives at `next_byte` at the earliest.
    pub fn silent_until(&self, next_byte: Time, now: Time) -> Time {
        let VolatileState { outgoing, fifo, queue, parser, .. } = &self.state;
        if outgoing.is_some() || !fifo.is_empty() || !queue.is_empty() {
            return now;
        }
        let bytes_after = parser.bytes_to(kind::P2P_BROADCAST) - 1;
        next_byte + Time::from_nanos(BYTE_TIME_MIN.nanos() * bytes_after as u64)
    }

    /// Adds another robot's P2P frame that is on the air. Its last bit arrives at `end`.
    pub fn add_frame(&mut self, frame: &P2pFrame, end: Time) {
        self.state.radio.expect(frame.received(), end);
    }

    /// Returns true if the radio receives.
    fn listens(&self, now: Time) -> bool {
        let VolatileState { start, ready, .. } = self.state;
        start <= now && (ready || !self.settings.knows_ready || now >= start + READY_AFTER)
    }

    /// Puts arbitrary bytes on the wire. The loop does not wait for them.
    pub fn send_bytes(&mut self, bytes: &[u8]) {
        self.state.unsent.extend(bytes.iter().map(|byte| (*byte, false)));
    }

    fn send(&mut self, kind: u8, payload: &[u8]) {
        match LinkFrame::new(kind, payload) {
            Some(frame) if self.state.talks => {
                self.state.unsent.extend(frame.to_bytes().into_iter().map(|byte| (byte, true)));
            }
            _ => self.not_sent += 1,
        }
    }

    /// Moves the FIFO's bytes to the queue, as the UART's interrupt does.
    fn empty_fifo(&mut self, now: Time) {
        let state = &mut self.state;
        if state.stopped || now < state.masked {
            return;
        }
        for byte in state.fifo.drain(..) {
            if state.queue.len() == QUEUE {
                self.dropped += 1;
            } else {
                state.queue.push_back(byte);
            }
        }
    }

    /// Runs the loop until it has to wait, or until a turn did no work.
    fn run(&mut self, now: Time) {
        while self.powered && self.state.resumes <= now && !self.state.is_sending() {
            if let Some(payload) = self.state.outgoing.take() {
                self.transmit(&payload, now);
            }
            match self.state.stage {
                Stage::Radio => self.pass_on(now),
                Stage::Read => {
                    self.state.stage = Stage::Report;
                    self.read_frame(now);
                }
                Stage::Report => {
                    self.state.stage = Stage::Radio;
                    if self.state.next_report.is_some_and(|at| at <= now) {
                        self.report(now);
                    }
                    if !std::mem::take(&mut self.state.worked) {
                        return;
                    }
                }
            }
        }
    }

    /// Passes on a packet of the radio, if one waits and the line is free.
    fn pass_on(&mut self, now: Time) {
        let state = &mut self.state;
        let waits = state.radio.has_received() || !state.from_world.is_empty();
        if !waits || !state.unsent.is_empty() {
            state.stage = Stage::Read;
        } else if state.ble_is_on {
            self.shut_ble_down(now);
        } else {
            state.stage = Stage::Read;
            state.worked = true;
            let packet = state.from_world.pop_front().or_else(|| state.radio.take());
            if let Some(packet) = packet {
                self.send(packet.kind(), packet.payload());
            }
        }
    }

    fn shut_ble_down(&mut self, now: Time) {
        self.state.ble_is_on = false;
        self.state.resumes = now + self.settings.ble_shutdown;
        if self.settings.ble_masks {
            self.state.masked = self.state.resumes;
        }
    }

    /// Reads bytes from the queue up to the end of a frame.
    fn read_frame(&mut self, now: Time) {
        while let Some(byte) = self.state.queue.pop_front() {
            self.state.worked = true;
            if let Some(arrived) = self.state.parser.push(byte) {
                return self.handle(arrived, now);
            }
        }
    }

    /// Transmits the port and data of a P2P frame to all robots. There is one buffer: a frame that
    /// is still on the air is cut off.
    fn transmit(&mut self, payload: &[u8], now: Time) {
        let [port, data @ ..] = payload else { return };
        let air = self.state.radio.transmit(payload.len(), now);
        let (port, payload) = (port & 0x0f, data.to_vec());
        self.events.push((now, BoardEvent::P2p { port, payload, air }));
    }

    fn report(&mut self, now: Time) {
        let Battery { volts, charging, usb_powered } = self.battery;
        let mut payload = vec![u8::from(charging) | u8::from(usb_powered) << 1];
        payload.extend(volts.to_le_bytes());
        let charge_current: f32 = if charging { 500.0 } else { 0.0 };
        payload.extend(charge_current.to_le_bytes());
        self.send(kind::BATTERY_STATE, &payload);
        self.send(kind::RADIO_RSSI, &[RSSI]);
        self.state.next_report = Some(now + REPORT_PERIOD);
    }

    fn power_off(&mut self, acknowledged: bool, now: Time) {
        self.state.shutdown_at = None;
        self.powered = false;
        self.events.push((now, BoardEvent::PowerOff { acknowledged }));
    }

    fn handle(&mut self, arrived: Arrived, now: Time) {
        let Arrived { frame, first_sum_good, second_sum_good } = arrived;
        let intact = first_sum_good && second_sum_good;
        let payload = frame.payload();
        self.events.push((
            now,
            BoardEvent::Syslink { kind: frame.kind(), payload: payload.to_vec(), intact },
        ));
        if !intact {
            self.bad_sums[usize::from(first_sum_good)] += 1;
            return;
        }
        self.state.talks = true;
        let radio = &mut self.state.radio;
        match (frame.kind(), payload) {
            (kind::RADIO_CHANNEL, [_]) => {
                radio.channel_set = true;
                radio.reset(now);
            }
            (kind::RADIO_DATARATE, [rate @ 0..=2]) => {
                radio.rate = *rate;
                radio.rate_set = true;
                radio.reset(now);
            }
            (kind::RADIO_ADDRESS, [_, _, _, _, _]) => {
                radio.address_set = true;
                radio.reset(now);
            }
            (kind::RADIO_POWER, [_]) => radio.reset(now),
            (kind::RADIO_READY, _) if self.settings.knows_ready => self.state.ready = true,
            (kind::P2P_BROADCAST, _) => {
                self.state.outgoing = Some(payload.to_vec());
                if self.state.ble_is_on {
                    self.shut_ble_down(now);
                }
                return;
            }
            (kind::BATTERY_AUTOUPDATE, _) => {
                // The minimum counts from the reset, which was `BOOT` before the start.
                let earliest = self.state.start + (REPORTS_AFTER - BOOT);
                let first = earliest.max(now + REPORT_PERIOD);
                self.state.next_report = self.state.next_report.or(Some(first));
                return;
            }
            (kind::SHUTDOWN_ACK, _) => {
                if self.state.shutdown_at.is_some() {
                    self.power_off(true, now);
                }
                return;
            }
            (kind::SWITCH_OFF, _) => return self.power_off(true, now),
            (kind::LED_ON, _) => return self.set_led(true, now),
            (kind::LED_OFF, _) => return self.set_led(false, now),
            (kind::ONE_WIRE_SCAN..=kind::ONE_WIRE_WRITE, _) => {
                self.decks.set_bluetooth(self.state.ble_is_on);
                if let Some(answer) = self.decks.answer(frame.kind(), payload) {
                    self.send(frame.kind(), &answer);
                }
                return;
            }
            (kind::NRF_VERSION, _) => {
                let version = concat!("bittybuzz-chips ", env!("CARGO_PKG_VERSION"));
                return self.send(kind::NRF_VERSION, version.as_bytes());
            }
            (kind::DEBUG_PROBE, _) => return self.answer_probe(),
            _ => return,
        }
        // Frames that configure the radio are echoed.
        self.send(frame.kind(), payload);
    }

    fn set_led(&mut self, on: bool, now: Time) {
        self.events.push((now, BoardEvent::Led { led: BoardLed::BlueRight, on }));
    }

    fn answer_probe(&mut self) {
        let count = |n: u64| n.min(255) as u8;
        let payload = [
            u8::from(self.state.radio.address_set),
            u8::from(self.state.radio.channel_set),
            u8::from(self.state.radio.rate_set),
            count(self.dropped),
            // Last error code of the UART: bit 2 is framing.
            if self.framing_errors > 0 { 4 } else { 0 },
            count(self.framing_errors),
            count(self.bad_sums[0]),
            count(self.bad_sums[1]),
        ];
        self.send(kind::DEBUG_PROBE, &payload);
    }
}

#[cfg(test)]
#[path = "peer_tests.rs"]
mod tests;
