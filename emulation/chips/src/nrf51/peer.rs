//! Behaviour of the nRF51's firmware.

use std::collections::VecDeque;

use super::link::Line;
use super::radio::Radio;
use super::syslink::{Arrived, Parser};
use super::{Battery, Frame, Link, P2pFrame};
use crate::serial::{self, FRAME_BITS};
use crate::{Event, Led, Time};

/// Rate of the serial link.
pub(crate) const BAUD: u64 = 1_000_000;
/// Bytes that the receive queue holds, and how many make it say "full": the sender may still be busy with a
/// few when it notices.
const QUEUE: usize = 128;
const QUEUE_FULL: usize = QUEUE - 3;
/// Between two reports of battery and signal strength.
const REPORT_PERIOD: Time = Time::from_millis(10);
/// Radio reception starts then, or when the firmware says that it is ready.
const READY_AFTER: Time = Time::from_millis(3_000);
/// How long the firmware may take to acknowledge a shutdown.
const SHUTDOWN_AFTER: Time = Time::from_millis(100);
/// Signal strength that is reported, in -dBm.
const RSSI: u8 = 50;

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

/// What the nRF51 does at its end of the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Output {
    /// It begins to send a byte.
    Begin,
    /// A byte has arrived at the other end.
    Byte(u8),
}

pub(crate) struct Nrf51 {
    parser: Parser,
    radio: Radio,
    battery: Battery,
    /// Received and not yet looked at.
    queue: VecDeque<u8>,
    /// Told to let the queue wait.
    stalled: bool,
    /// Bytes to be sent, and the one on the wire (none if the wire loses it) until its end.
    unsent: VecDeque<u8>,
    sending: Option<(Time, Option<u8>)>,
    /// Whether a valid frame was received: nothing is sent before.
    talks: bool,
    ready: bool,
    next_report: Option<Time>,
    shutdown_at: Option<Time>,
    powered: bool,
    line: Line,
    events: Vec<(Time, Event)>,
    pub received: u64,
    pub framing_errors: u64,
    pub bad_sums: [u64; 2],
    pub dropped: u64,
    pub not_sent: u64,
}

impl Nrf51 {
    pub fn new() -> Self {
        Nrf51 {
            parser: Parser::default(),
            radio: Radio::new(),
            battery: Battery::default(),
            queue: VecDeque::new(),
            stalled: false,
            unsent: VecDeque::new(),
            sending: None,
            talks: false,
            ready: false,
            next_report: None,
            shutdown_at: None,
            powered: true,
            line: Line::default(),
            events: Vec::new(),
            received: 0,
            framing_errors: 0,
            bad_sums: [0; 2],
            dropped: 0,
            not_sent: 0,
        }
    }

    pub fn is_powered(&self) -> bool {
        self.powered
    }

    pub fn lost(&self) -> u64 {
        self.line.lost
    }

    pub fn corrupted(&self) -> u64 {
        self.line.corrupted
    }

    pub fn unheard(&self) -> u64 {
        self.radio.unheard
    }

    pub fn overflown(&self) -> u64 {
        self.radio.overflown
    }

    pub fn take_events(&mut self) -> Vec<(Time, Event)> {
        std::mem::take(&mut self.events)
    }

    pub fn set_link(&mut self, link: Link) {
        self.line.set(link);
    }

    pub fn set_battery(&mut self, battery: Battery) {
        self.battery = battery;
    }

    pub fn set_stalled(&mut self, stalled: bool, now: Time) {
        self.stalled = stalled;
        self.process(now);
    }

    /// The level of the flow-control pin: high when no more bytes should come.
    pub fn is_full(&self) -> bool {
        self.stalled || self.queue.len() >= QUEUE_FULL
    }

    /// The level of its line to the STM32, bit by bit; high while it sends nothing (serial.rs: start bit, eight bits, the
    /// least significant first, stop bit).
    pub fn line_is_high(&self, now: Time) -> bool {
        let Some((end, Some(byte))) = self.sending else {
            return true;
        };
        match (Time::of_ticks(FRAME_BITS, BAUD) - (end - now)).ticks(BAUD) {
            0 => false,
            bit @ 1..=8 => byte >> (bit - 1) & 1 != 0,
            _ => true,
        }
    }

    pub fn request_shutdown(&mut self, now: Time) {
        self.send(kind::SHUTDOWN_REQUEST, &[]);
        self.shutdown_at = Some(now + SHUTDOWN_AFTER);
    }

    /// When [`advance`](Self::advance) has something to do; what was just given to be sent needs a call at
    /// once.
    pub fn next_event(&self) -> Option<Time> {
        let sent = self.sending.map(|(end, _)| end);
        let work = (!self.queue.is_empty() && !self.stalled).then_some(self.radio.busy_until());
        let heard = self.radio.next_arrival();
        [sent, work, heard, self.next_report, self.shutdown_at].into_iter().flatten().min()
    }

    /// Does what is due at `now`; the outputs are in order.
    pub fn advance(&mut self, now: Time) -> Vec<Output> {
        let mut outputs = Vec::new();
        if let Some((end, byte)) = self.sending
            && end <= now
        {
            outputs.extend(byte.map(Output::Byte));
            self.sending = None;
        }
        if self.next_report.is_some_and(|at| at <= now) {
            self.report(now);
        }
        if self.shutdown_at.is_some_and(|at| at <= now) {
            self.power_off(false, now);
        }
        self.process(now);
        self.not_sent += self.radio.hear(self.listens(now), now);
        if self.unsent.is_empty()
            && self.radio.has_received()
            && let Some(frame) = self.radio.take()
        {
            self.send(frame.kind(), frame.payload());
        }
        if self.sending.is_none()
            && let Some(byte) = self.unsent.pop_front()
        {
            let byte = self.line.pass(byte);
            self.sending = Some((now + Time::of_ticks(FRAME_BITS, BAUD), byte));
            outputs.extend(byte.map(|_| Output::Begin));
        }
        outputs
    }

    /// A byte arrives from the STM32, sent at `baud`.
    pub fn receive(&mut self, byte: u8, baud: u64, now: Time) {
        let Some(byte) = self.line.pass(byte) else {
            return;
        };
        self.received += 1;
        let received = serial::receive(byte, baud, BAUD);
        self.framing_errors += u64::from(received.framing_error);
        if self.queue.len() == QUEUE {
            self.dropped += 1;
        } else {
            self.queue.push_back(received.byte);
        }
        self.process(now);
    }

    /// Sends a frame on behalf of the world outside, if the nRF51 would.
    pub fn send_frame(&mut self, frame: &Frame, now: Time) {
        let from_radio = matches!(
            frame.kind(),
            kind::RADIO_RAW | kind::RADIO_RAW_BROADCAST | kind::P2P | kind::P2P_BROADCAST
        );
        if from_radio && !self.listens(now) {
            self.not_sent += 1;
        } else {
            self.send(frame.kind(), frame.payload());
        }
    }

    /// Another robot's P2P frame is on the air; its last bit comes at `end`.
    pub fn hear(&mut self, frame: &P2pFrame, end: Time) {
        self.radio.expect(frame.received(), end);
    }

    /// Whether the radio receives.
    fn listens(&self, now: Time) -> bool {
        self.ready || now >= READY_AFTER
    }

    /// Puts bytes on the wire, whatever they are.
    pub fn send_bytes(&mut self, bytes: &[u8]) {
        self.unsent.extend(bytes);
    }

    fn send(&mut self, kind: u8, payload: &[u8]) {
        match Frame::new(kind, payload) {
            Some(frame) if self.talks => self.unsent.extend(frame.to_bytes()),
            _ => self.not_sent += 1,
        }
    }

    fn report(&mut self, now: Time) {
        let Battery { volts, charging, usb_powered } = self.battery;
        let mut payload = vec![u8::from(charging) | u8::from(usb_powered) << 1];
        payload.extend(volts.to_le_bytes());
        let charge_current: f32 = if charging { 500.0 } else { 0.0 };
        payload.extend(charge_current.to_le_bytes());
        self.send(kind::BATTERY_STATE, &payload);
        self.send(kind::RADIO_RSSI, &[RSSI]);
        self.next_report = Some(now + REPORT_PERIOD);
    }

    fn power_off(&mut self, acknowledged: bool, now: Time) {
        self.shutdown_at = None;
        self.powered = false;
        self.events.push((now, Event::PowerOff { acknowledged }));
    }

    /// Looks at the queue until it is empty or the radio is busy.
    fn process(&mut self, now: Time) {
        while !self.stalled && self.radio.busy_until() <= now {
            let Some(byte) = self.queue.pop_front() else {
                return;
            };
            if let Some(arrived) = self.parser.push(byte) {
                self.handle(arrived, now);
            }
        }
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
        self.talks = true;
        match (frame.kind(), payload) {
            (kind::RADIO_CHANNEL, [_]) => self.radio.channel_set = true,
            (kind::RADIO_DATARATE, [rate @ 0..=2]) => {
                self.radio.rate = *rate;
                self.radio.rate_set = true;
            }
            (kind::RADIO_ADDRESS, [_, _, _, _, _]) => self.radio.address_set = true,
            (kind::RADIO_POWER, [_]) => {}
            (kind::RADIO_READY, _) => self.ready = true,
            (kind::P2P_BROADCAST, [port, data @ ..]) => {
                let air = self.radio.transmit(payload.len(), now);
                let (port, payload) = (port & 0x0f, data.to_vec());
                return self.events.push((now, Event::P2p { port, payload, air }));
            }
            (kind::BATTERY_AUTOUPDATE, _) => {
                self.next_report = self.next_report.or(Some(now + REPORT_PERIOD));
                return;
            }
            (kind::SHUTDOWN_ACK, _) => {
                if self.shutdown_at.is_some() {
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
        // What sets the radio up is echoed.
        self.send(frame.kind(), payload);
    }

    fn set_led(&mut self, on: bool, now: Time) {
        self.events.push((now, Event::Led { led: Led::BlueRight, on }));
    }

    fn answer_probe(&mut self) {
        let count = |n: u64| n.min(255) as u8;
        let payload = [
            u8::from(self.radio.address_set),
            u8::from(self.radio.channel_set),
            u8::from(self.radio.rate_set),
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
