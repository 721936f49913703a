//! Behaviour of the nRF51's firmware (crazyflie2-nrf-firmware: src/main.c, src/uart.c, src/esb.c, src/shutdown.c).
//!
//! One loop does everything in turn: it passes on a packet of the radio, reads one frame of the STM32, sends its reports. It
//! sends a frame byte by byte and waits for each, and meanwhile reads nothing. The STM32's bytes get into the UART's FIFO, from
//! where an interrupt moves it to a queue. RTS, which is PA4 of the STM32, follows the FIFO, not the queue: bytes that find the
//! queue full are lost without a sign.

use std::collections::VecDeque;

use super::link::Line;
use super::radio::{Radio, RadioCounts};
use super::syslink::{Arrived, Parser};
use super::{Battery, Link, LinkFrame, P2pFrame};
use crate::serial::{self, FRAME_BITS};
use crate::{Event, Led, Time};

/// Rate of the serial link.
pub const BAUD: u64 = 1_000_000;
/// Bytes in the UART's FIFO (nRF51 reference manual, 29.4).
const FIFO: usize = 6;
/// Bytes in the queue after it: one of its 128 places stays empty.
const QUEUE: usize = 127;
/// Between two reports of battery and signal strength.
const REPORT_PERIOD: Time = Time::from_millis(10);
/// The first report comes no earlier after its reset.
const REPORTS_AFTER: Time = Time::from_millis(1_000);
/// From its reset until it listens to the STM32: 100 ms and somewhat more. With whole milliseconds its reports would come at the
/// very moments at which the STM32's timers expire.
const BOOT: Time = Time::from_micros(103_700);
/// Radio reception starts at this time after its start, or when the firmware reports that it is
/// ready.
const READY_AFTER: Time = Time::from_millis(3_000);
/// Time that the firmware has to acknowledge a shutdown: 1000 ticks of 1 ms (the comment there says 100 ms).
const SHUTDOWN_AFTER: Time = Time::from_millis(1_000);
/// Signal strength that is reported, in -dBm.
const RSSI: u8 = 50;

/// The properties of an nRF51 that differ from one firmware to the next, or that no document states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Nrf51Settings {
    /// False for firmware from before 2025-10-09, which ignores RADIO_READY and listens from its start.
    pub knows_ready: bool,
    /// Bytes in the UART's FIFO from which on RTS is high: 1 to [`Nrf51Settings::MOST_RTS_BYTES`].
    pub rts_bytes: u8,
    /// Duration of Bluetooth's shutdown, before the first packet that the radio sends or receives. The loop stops meanwhile.
    pub ble_shutdown: Time,
    /// True if no interrupt is served during that shutdown: the FIFO fills, and RTS rises.
    pub ble_masks: bool,
}

impl Nrf51Settings {
    /// The STM32 has two bytes under way when it sees RTS.
    pub const MOST_RTS_BYTES: u8 = 4;
}

impl Default for Nrf51Settings {
    /// The firmware of today. RTS rises when there is room for four bytes, as Nordic's manuals say; of the shutdown no
    /// figure is known.
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
    pub const NRF_VERSION: u8 = 0x30;
    pub const DEBUG_PROBE: u8 = 0xf0;
}

/// An action of the nRF51 at its end of the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// It begins to send a byte.
    Begin,
    /// A byte has arrived at the other end.
    Byte(u8),
}

/// The parts of the loop's turn that may take time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// A packet of the radio goes to the STM32.
    Radio,
    /// A frame of the STM32 is read, and answered.
    Read,
    /// Battery and signal strength are reported.
    Report,
}

/// The processor at its end of the line.
pub struct Nrf51 {
    settings: Nrf51Settings,
    battery: Battery,
    line: Line,
    powered: bool,
    state: VolatileState,
    events: Vec<(Time, Event)>,
    /// Bytes received from the STM32.
    pub received: u64,
    /// Bytes with a wrong stop bit among these.
    pub framing_errors: u64,
    /// Frames dropped for their first checksum byte, and for their second.
    pub bad_sums: [u64; 2],
    /// Bytes that the UART lost: the firmware ignored flow control.
    pub overruns: u64,
    /// Bytes lost because the queue of frames was full.
    pub dropped: u64,
    /// Frames for the STM32 while the processor is still silent.
    pub not_sent: u64,
}

/// Everything that a restart forgets.
struct VolatileState {
    /// It listens to the STM32 from then on.
    start: Time,
    stage: Stage,
    /// Something was done in this turn of the loop.
    worked: bool,
    /// The loop stands still until then.
    resumes: Time,
    ble_is_on: bool,
    parser: Parser,
    radio: Radio,
    /// A P2P frame to be transmitted when Bluetooth is off: port and data.
    outgoing: Option<Vec<u8>>,
    /// Packets that the radio receives according to the world outside.
    from_world: VecDeque<LinkFrame>,
    /// Received by the UART.
    fifo: VecDeque<u8>,
    /// The UART receives nothing, and says so.
    stopped: bool,
    /// No interrupt is served until then.
    masked: Time,
    /// Received and not yet looked at.
    queue: VecDeque<u8>,
    /// Bytes to be sent, with true if the loop waits for them, and the one on the wire (none if the wire loses it) until its end.
    unsent: VecDeque<(u8, bool)>,
    sending: Option<(Time, Option<u8>, bool)>,
    /// True if a valid frame was received: nothing is sent before.
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
            parser: Parser::default(),
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

    /// True while the loop waits for a byte to be sent.
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
    /// An nRF51 that has started and given the STM32 its power.
    pub fn new() -> Self {
        Nrf51 {
            settings: Nrf51Settings::default(),
            battery: Battery::default(),
            line: Line::default(),
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

    /// Sets the differences between two firmwares of this processor.
    pub fn set(&mut self, settings: Nrf51Settings) {
        self.settings = settings;
    }

    /// Forgets everything and starts; the STM32 keeps its power.
    pub fn restart(&mut self, now: Time) {
        let counted = self.state.radio.counted;
        self.state = VolatileState::new(now + BOOT);
        self.state.radio.counted = counted;
    }

    /// Returns true while the STM32 has power.
    pub fn is_powered(&self) -> bool {
        self.powered
    }

    /// Bytes that the line lost on request, in both directions.
    pub fn lost(&self) -> u64 {
        self.line.lost
    }

    /// Bytes that the line changed on request, in both directions.
    pub fn corrupted(&self) -> u64 {
        self.line.corrupted
    }

    /// Counters of the radio since power-on.
    pub fn radio(&self) -> RadioCounts {
        self.state.radio.counted
    }

    /// Events since the last call, in order.
    pub fn take_events(&mut self) -> Vec<(Time, Event)> {
        std::mem::take(&mut self.events)
    }

    /// The line loses and corrupts bytes from now on.
    pub fn set_link(&mut self, link: Link) {
        self.line.set(link);
    }

    /// The battery is in this state from now on.
    pub fn set_battery(&mut self, battery: Battery) {
        self.battery = battery;
    }

    /// The UART receives nothing (`true`), or goes on.
    pub fn set_stopped(&mut self, stopped: bool, now: Time) {
        self.state.stopped = stopped;
        self.empty_fifo(now);
        self.run(now);
    }

    /// The level of RTS: high when no more bytes should come. Before the UART is set up only the STM32's pull-up drives the
    /// line.
    pub fn is_full(&self, now: Time) -> bool {
        let state = &self.state;
        let is_full = state.fifo.len() >= usize::from(self.settings.rts_bytes);
        now < state.start || state.stopped || is_full
    }

    /// The level of its line to the STM32, bit by bit; high while it sends nothing (serial.rs: start bit, eight bits, the
    /// least significant first, stop bit).
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

    /// The button was pressed.
    pub fn request_shutdown(&mut self, now: Time) {
        self.send(kind::SHUTDOWN_REQUEST, &[]);
        self.state.shutdown_at = Some(now + SHUTDOWN_AFTER);
    }

    /// Returns the time at which [`advance`](Self::advance) has something to do; a frame that was
    /// just given needs a call at once.
    pub fn next_event(&self, now: Time) -> Option<Time> {
        let state = &self.state;
        let sent = state.sending.map(|(end, _, _)| end);
        let resumed = (now < state.resumes).then_some(state.resumes);
        let unmasked = (now < state.masked).then_some(state.masked);
        let heard = state.radio.next_arrival();
        // A report that is due already waits for the loop.
        let report = state.next_report.filter(|at| now < *at);
        let events = [sent, resumed, unmasked, heard, report, state.shutdown_at];
        events.into_iter().flatten().min()
    }

    /// Executes the actions that are due at `now`; the outputs are in order.
    pub fn advance(&mut self, now: Time) -> Vec<Output> {
        let mut outputs = Vec::new();
        if let Some((end, byte, _)) = self.state.sending
            && end <= now
        {
            outputs.extend(byte.map(Output::Byte));
            self.state.sending = None;
        }
        if self.state.shutdown_at.is_some_and(|at| at <= now) {
            self.power_off(false, now);
        }
        self.empty_fifo(now);
        self.not_sent += self.state.radio.hear(self.listens(now), now);
        self.run(now);
        if self.state.sending.is_none()
            && let Some((byte, waits)) = self.state.unsent.pop_front()
        {
            let byte = self.line.pass(byte);
            self.state.sending = Some((now + Time::of_ticks(FRAME_BITS, BAUD), byte, waits));
            outputs.extend(byte.map(|_| Output::Begin));
        }
        outputs
    }

    /// A byte arrives from the STM32, sent at `baud`.
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

    /// Sends a frame on behalf of the world outside, if the nRF51 would.
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

    /// Another robot's P2P frame is on the air; its last bit comes at `end`.
    pub fn hear(&mut self, frame: &P2pFrame, end: Time) {
        self.state.radio.expect(frame.received(), end);
    }

    /// Returns true if the radio receives.
    fn listens(&self, now: Time) -> bool {
        let VolatileState { start, ready, .. } = self.state;
        start <= now && (ready || !self.settings.knows_ready || now >= start + READY_AFTER)
    }

    /// Puts bytes on the wire, whatever they are. The loop does not wait for them.
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

    /// The UART's interrupt.
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

    /// The loop: turns until it has to wait, or until a turn has done nothing.
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

    /// Takes bytes from the queue up to the end of a frame.
    fn read_frame(&mut self, now: Time) {
        while let Some(byte) = self.state.queue.pop_front() {
            self.state.worked = true;
            if let Some(arrived) = self.state.parser.push(byte) {
                return self.handle(arrived, now);
            }
        }
    }

    /// The port and data of a P2P frame go to all. There is one buffer: a frame that is still on the air is cut off.
    fn transmit(&mut self, payload: &[u8], now: Time) {
        let [port, data @ ..] = payload else { return };
        let air = self.state.radio.transmit(payload.len(), now);
        let (port, payload) = (port & 0x0f, data.to_vec());
        self.events.push((now, Event::P2p { port, payload, air }));
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
        self.events.push((now, Event::PowerOff { acknowledged }));
    }

    fn handle(&mut self, arrived: Arrived, now: Time) {
        let Arrived { frame, first_sum_good, second_sum_good } = arrived;
        let intact = first_sum_good && second_sum_good;
        let payload = frame.payload();
        self.events
            .push((now, Event::Syslink { kind: frame.kind(), payload: payload.to_vec(), intact }));
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
                // Counted from the reset.
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
            // No deck is attached.
            (kind::ONE_WIRE_SCAN, _) => return self.send(kind::ONE_WIRE_SCAN, &[0]),
            (kind::NRF_VERSION, _) => {
                let version = concat!("bittybuzz-chips ", env!("CARGO_PKG_VERSION"));
                return self.send(kind::NRF_VERSION, version.as_bytes());
            }
            (kind::DEBUG_PROBE, _) => return self.answer_probe(),
            _ => return,
        }
        // Frames that set the radio up are echoed.
        self.send(frame.kind(), payload);
    }

    fn set_led(&mut self, on: bool, now: Time) {
        self.events.push((now, Event::Led { led: Led::BlueRight, on }));
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
