//! A station that forwards messages between Kilobots, Zooids and Crazyflies. It could be built, and
//! was **not tried on hardware**.
//!
//! ```text
//! Kilobots ─light─▶ a Kilobot that listens ─debug line─▶ computer ─▶ nRF24 dongle ─▶ Zooids
//!          ◀─light─ overhead controller    ◀─serial────           ─▶ Crazyradio   ─▶ Crazyflies
//! ```
//! A Kilobot has no serial input: its receive pin is the one that shows charging. So the computer
//! sends to Kilobots through the overhead controller, which every lab with Kilobots has. The
//! listening Kilobot is emulated with its image (`firmware/kilobot-avr/src/bin/ear.rs`); computer,
//! dongles and controller are modeled here only by their delays.
//!
//! Messages for infrared wait in a queue like that of a robot, which drops stale and duplicate
//! ones. The infrared channel has little capacity, so the computer sends its messages [`LIGHT_PAUSE`]
//! apart, which leaves time for the Kilobots' own messages.

use std::collections::VecDeque;
use std::time::Duration;

use bittybuzz_comms::infrared;
use bittybuzz_comms::nrf24::{PAYLOAD_MAX, Payload};
use bittybuzz_comms::queue::{Inbox, Outbox};
use bittybuzz_comms::syslink::{P2P_MAX, SWARM_PORT, SwarmFrame};
use bittybuzz_emulation::message::Command;
use bittybuzz_vm_core::message::{FRAGMENT_HEAD, FRAGMENTS_MAX, Fragment, FrameKind, TINY_FRAME};
use bittybuzz_vm_core::number::Tiny;

use crate::engine::Medium;

/// The delay between the computer and a dongle or a line, in each direction: one USB frame, and as
/// long again for the program.
const USB_DELAY: Duration = Duration::from_millis(3);
/// The time between two packets of a dongle.
const DONGLE_PERIOD: Duration = Duration::from_millis(1);
/// The duration of a packet on the controller's serial line: 132 bytes of ten bits at 38,400 baud
/// (kilogui, serialconn.cpp).
const SERIAL_TIME: Duration = Duration::from_micros(34_375);
/// The period with which the controller repeats its last message, approximately (kilogui, ohc.c).
/// The controller goes on repeating; the model sends each message three times.
const REPEAT_PERIOD: Duration = Duration::from_micros(10_400);
const REPEATS: u32 = 3;
/// The time between two messages to Kilobots.
const LIGHT_PAUSE: Duration = Duration::from_millis(200);
/// The time after a message of the controller within which a report of the listening Kilobot counts
/// as its echo.
const ECHO_TIME_MAX: Duration = Duration::from_millis(500);
/// The number of messages that can wait for infrared.
const WAITING_MAX: usize = 32;
/// The number of long messages that can arrive at once, or wait for infrared, and the bytes of the
/// longest one.
const LONG_MAX: usize = 16;
const CONTENT_BYTES: usize = FRAGMENTS_MAX as usize * (TINY_FRAME - FRAGMENT_HEAD);
/// Strength of the Crazyradio's signal, in -dBm.
const RSSI: u8 = 50;

/// A timed message for a dongle or the controller to send.
pub struct Sending {
    pub medium: Medium,
    pub command: Command,
}

/// The state of a bridge.
pub struct Bridge {
    /// The sender id for messages that do not name their sender.
    id: u16,
    /// The bytes of an incomplete line.
    line: Vec<u8>,
    for_light: Inbox<Tiny, (), TINY_FRAME, WAITING_MAX, 0>,
    /// Long messages for the light: those that are not yet complete, and those that wait.
    arriving: Inbox<Tiny, (), TINY_FRAME, 1, LONG_MAX>,
    long_for_light: Outbox<Tiny, TINY_FRAME, 1, LONG_MAX>,
    /// The time when the controller is free for the next message.
    light_free: Duration,
    /// The time when each dongle is free to send.
    radio_free: [Duration; 2],
    /// Frames on their way to a radio, with the time of their arrival there.
    for_radio: VecDeque<(Duration, Medium, Vec<u8>)>,
    /// The controller's latest messages and their times, for the recognition of echoes.
    sent: VecDeque<(Duration, [u8; infrared::FRAME])>,
}

const RADIOS: [Medium; 2] = [Medium::Nrf24, Medium::P2p];

impl Bridge {
    /// Returns an idle bridge. No robot may have its `id`.
    pub fn new(id: u16) -> Self {
        Bridge {
            id,
            line: Vec::new(),
            for_light: Inbox::new(()),
            arriving: Inbox::new(()),
            long_for_light: Outbox::new(),
            light_free: Duration::ZERO,
            radio_free: [Duration::ZERO; 2],
            for_radio: VecDeque::new(),
            sent: VecDeque::new(),
        }
    }

    /// Reads bytes from the debug line of the listening Kilobot.
    pub fn read_line(&mut self, at: Duration, bytes: &[u8]) {
        for byte in bytes {
            if *byte != b'\n' {
                self.line.push(*byte);
                continue;
            }
            let message = infrared::from_line(&self.line);
            self.line.clear();
            // Noise on the line is no message.
            let Some(frame) = message.as_ref().and_then(infrared::frame_of) else { continue };
            let is_echo = |(then, sent): &(Duration, [u8; infrared::FRAME])| {
                *sent == frame && at < *then + ECHO_TIME_MAX
            };
            if !self.sent.iter().any(is_echo) {
                self.pass_on(at, Medium::Infrared, &frame);
            }
        }
    }

    /// Forwards a packet that a dongle received from Zooids.
    pub fn receive_nrf24(&mut self, at: Duration, payload: &[u8]) {
        if let Some(Payload { message, .. }) = Payload::parse(payload) {
            self.pass_on(at, Medium::Nrf24, message);
        }
    }

    /// Forwards a P2P frame that a dongle received from Crazyflies.
    pub fn receive_p2p(&mut self, at: Duration, port: u8, data: &[u8]) {
        if let Some(SwarmFrame { message, .. }) = SwarmFrame::parse(data)
            && port == SWARM_PORT
        {
            self.pass_on(at, Medium::P2p, message);
        }
    }

    fn pass_on(&mut self, at: Duration, from: Medium, frame: &[u8]) {
        if frame.len() > TINY_FRAME {
            return;
        }
        if from != Medium::Infrared {
            self.queue_for_light(frame);
        }
        for radio in RADIOS.into_iter().filter(|radio| *radio != from) {
            self.for_radio.push_back((at + USB_DELAY, radio, frame.to_owned()));
        }
    }

    /// Queues a frame for the controller. Fragments wait until their message is complete, since the
    /// light is slower than the radios.
    fn queue_for_light(&mut self, frame: &[u8]) {
        let Some(Fragment { robot, .. }) = Fragment::parse(frame) else {
            self.for_light.push(frame, ());
            return;
        };
        self.arriving.push(frame, ());
        if self.arriving.pop(&mut [0; TINY_FRAME]).is_some() {
            let mut content = [0; CONTENT_BYTES];
            let length = self.arriving.take_content(&mut content);
            self.long_for_light.push_content(robot, &content[..length]);
        }
    }

    fn next_for_light(&mut self, frame: &mut [u8; TINY_FRAME]) -> Option<usize> {
        if !self.long_for_light.is_within_message()
            && let Some((length, ())) = self.for_light.pop(frame)
        {
            return Some(length);
        }
        self.long_for_light.pop(frame)
    }

    /// Returns the messages to send now. None of them begins before `now`, in the time of the
    /// robots.
    pub fn send(&mut self, now: Duration) -> Vec<Sending> {
        let mut sendings = Vec::new();
        while let Some((ready, medium, frame)) = self.for_radio.pop_front() {
            let number = usize::from(medium == Medium::P2p);
            let at = ready.max(self.radio_free[number]).max(now);
            self.radio_free[number] = at + DONGLE_PERIOD;
            sendings
                .extend(self.packet(medium, at, &frame).map(|command| Sending { medium, command }));
        }
        let mut frame = [0; TINY_FRAME];
        while self.light_free <= now
            && let Some(length) = self.next_for_light(&mut frame)
        {
            // A script may send a frame that infrared cannot carry.
            let Some(message) = infrared::message_of(&frame[..length]) else { continue };
            self.light_free = now + LIGHT_PAUSE;
            let begin = now + SERIAL_TIME;
            for repeat in 0..REPEATS {
                let (at, payload) = (begin + REPEAT_PERIOD * repeat, message.to_vec());
                let (medium, command) = (Medium::Infrared, Command::Radio { at, payload });
                sendings.push(Sending { medium, command });
            }
            self.sent.extend(infrared::frame_of(&message).map(|frame| (begin, frame)));
            while self.sent.front().is_some_and(|(then, _)| *then + ECHO_TIME_MAX < now) {
                self.sent.pop_front();
            }
        }
        sendings
    }

    fn packet(&self, medium: Medium, at: Duration, message: &[u8]) -> Option<Command> {
        let robot = sender(message).unwrap_or(self.id);
        if medium == Medium::Nrf24 {
            let mut room = [0; PAYLOAD_MAX];
            let length = Payload { robot, position: None, message }.write(&mut room)?;
            return Some(Command::Radio { at, payload: room[..length].to_vec() });
        }
        let mut room = [0; P2P_MAX];
        let data = SwarmFrame { robot, position: None, message }.write(&mut room)?;
        Some(Command::P2p { at, port: SWARM_PORT, rssi: RSSI, payload: data.to_vec() })
    }
}

/// Returns the sender of a frame, if the frame names it. An entry does not: it names the robot that
/// wrote its value.
fn sender(frame: &[u8]) -> Option<u16> {
    // A shorter frame has no room for an id.
    let [kind, low, high, ..] = frame else { return None };
    let names_sender = FrameKind::of(*kind).is_some_and(|kind| kind != FrameKind::Entry);
    names_sender.then(|| u16::from_le_bytes([*low, *high]))
}
