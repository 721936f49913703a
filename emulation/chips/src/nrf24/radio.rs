//! Modes of operation (product specification, 6.1), sending and receiving (7).

use super::packet::PacketFormat;
use super::registers::{
    DYNPD, EN_AA, EN_RXADDR, FEATURE_EN_DPL, MAX_RT, PIPES, RF_CH, RX_DR, RX_PW_P0, SETUP_RETR,
    TX_DS,
};
use super::{FIFO, Nrf24, Nrf24Packet, Outgoing, PowerDetector, Transmission};
use crate::Time;

/// The time from power-down to standby with an external clock (6.1.7, Tpd2stby).
const START_UP: Time = Time::from_micros(150);
/// The shortest CE pulse that starts a transmission (Thce).
const PULSE: Time = Time::from_micros(10);
/// The time from standby to transmission or reception, and between the two (Tstby2a).
const SETTLING: Time = Time::from_micros(130);
/// The time after which a signal is detected (6.4).
const DETECTION: Time = Time::from_micros(40);

/// The radio's state and the time at which it ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RadioState {
    PoweredDown,
    Starting(Time),
    Standby,
    /// CE is high, but not yet long enough to start a transmission.
    Pulse(Time),
    /// A packet is announced; its first bit is transmitted at this time.
    SendSettling(Time),
    Sending(Time),
    /// The radio waits for an acknowledgement until this time.
    AwaitingAck(Time),
    ReceiveSettling(Time),
    /// The radio receives since this time.
    Receiving(Time),
    /// An acknowledgement is announced and starts at this time.
    AckSettling(Time),
    Acknowledging(Time),
}

impl Nrf24 {
    /// Sets the level of CE.
    pub fn enable(&mut self, enabled: bool, now: Time) {
        if enabled == self.enabled {
            return;
        }
        self.enabled = enabled;
        if !enabled {
            match self.state {
                RadioState::Pulse(_) => {
                    self.statistics.short_pulses += 1;
                    self.state = RadioState::Standby;
                }
                RadioState::ReceiveSettling(_) | RadioState::Receiving(_) => {
                    self.end_receiving(now)
                }
                _ => {}
            }
            self.has_received = false;
        }
        self.proceed(now);
    }

    /// Ends reception. RPD keeps its present value (6.4).
    fn end_receiving(&mut self, now: Time) {
        self.power_detected = self.detects_power(now);
        self.state = RadioState::Standby;
    }

    /// Sets the frequency at XC1.
    pub fn set_clock(&mut self, hz: u64, now: Time) {
        let has_clock = hz == super::CLOCK_HZ;
        if has_clock != self.has_clock {
            self.has_clock = has_clock;
            self.control(now);
        }
    }

    /// Returns true if the radio transmits, receives, or is about to.
    pub(super) fn is_active(&self) -> bool {
        !matches!(
            self.state,
            RadioState::PoweredDown | RadioState::Starting(_) | RadioState::Standby
        )
    }

    /// Updates the state after a change of CONFIG or of the clock.
    pub(super) fn control(&mut self, now: Time) {
        if !self.is_powered_up() || !self.has_clock {
            self.state = RadioState::PoweredDown;
        } else if self.state == RadioState::PoweredDown {
            self.state = RadioState::Starting(now + START_UP);
        } else if !self.is_receiver()
            && matches!(self.state, RadioState::ReceiveSettling(_) | RadioState::Receiving(_))
        {
            self.end_receiving(now);
            self.has_received = false;
        }
        self.proceed(now);
    }

    /// Moves from standby to the state that pins and registers select.
    pub(super) fn proceed(&mut self, now: Time) {
        if self.state != RadioState::Standby || !self.enabled {
            return;
        }
        if self.is_receiver() {
            self.state = RadioState::ReceiveSettling(now + SETTLING);
        } else if self.raised & MAX_RT == 0 && self.outgoing().is_some() {
            self.state = RadioState::Pulse(now + PULSE);
        }
    }

    fn outgoing(&self) -> Option<(&[u8], bool)> {
        match self.transmit.front()? {
            Outgoing::Payload { bytes, no_ack } => Some((bytes, *no_ack)),
            Outgoing::Acknowledgement { .. } => None,
        }
    }

    /// Returns the time of the next internal event.
    pub fn next_event(&self) -> Option<Time> {
        let state = match self.state {
            RadioState::Starting(at)
            | RadioState::Pulse(at)
            | RadioState::SendSettling(at)
            | RadioState::Sending(at)
            | RadioState::AwaitingAck(at)
            | RadioState::ReceiveSettling(at)
            | RadioState::AckSettling(at)
            | RadioState::Acknowledging(at) => Some(at),
            RadioState::PoweredDown | RadioState::Standby | RadioState::Receiving(_) => None,
        };
        self.arriving.iter().map(|(transmission, _)| transmission.end).chain(state).min()
    }

    /// Advances time to `now`, which is not beyond the next event.
    pub fn advance(&mut self, now: Time) {
        while let Some(arrived) = self.arriving.iter().position(|(packet, _)| packet.end <= now) {
            let (transmission, intact) = self.arriving.remove(arrived);
            self.arrive(transmission, intact);
        }
        match self.state {
            RadioState::Starting(at) if at <= now => {
                self.state = RadioState::Standby;
                self.proceed(now);
            }
            RadioState::Pulse(at) if at <= now => {
                let begin = at + (SETTLING - PULSE);
                self.retries = 0;
                if !self.reuses {
                    self.id = (self.id + 1) & 3;
                }
                self.announce(begin);
            }
            RadioState::SendSettling(at) if at <= now => {
                self.state = RadioState::Sending(self.transmissions_end);
            }
            RadioState::Sending(at) if at <= now => self.sent(at),
            RadioState::AwaitingAck(at) if at <= now => self.retry(at),
            RadioState::ReceiveSettling(at) if at <= now => self.state = RadioState::Receiving(at),
            RadioState::AckSettling(at) if at <= now => {
                self.state = RadioState::Acknowledging(self.transmissions_end);
            }
            RadioState::Acknowledging(at) if at <= now => {
                self.state = RadioState::Standby;
                self.proceed(at);
            }
            _ => {}
        }
    }

    fn format(&self) -> PacketFormat {
        PacketFormat {
            channel: self.registers.get(RF_CH),
            bits_per_second: self.registers.bits_per_second(),
            crc_bytes: self.registers.crc_bytes(),
            enhanced: self.registers.is_enhanced(),
        }
    }

    /// Returns a packet with this payload as this radio would transmit it now, without
    /// acknowledgement.
    pub fn packet_of(&self, payload: &[u8]) -> Nrf24Packet {
        let payload = payload.iter().take(super::PAYLOAD_MAX).copied().collect();
        let address = self.registers.transmit_address();
        // Senders other than robots do not number their packets.
        Nrf24Packet { format: self.format(), address, id: 0, no_ack: true, payload }
    }

    /// Returns the packet at the head of the transmit FIFO.
    fn packet(&self) -> Option<Nrf24Packet> {
        let (bytes, no_ack) = self.outgoing()?;
        let payload = bytes.to_vec();
        let address = self.registers.transmit_address();
        Some(Nrf24Packet { format: self.format(), address, id: self.id, no_ack, payload })
    }

    /// Announces the next packet, which begins at `begin`.
    fn announce(&mut self, begin: Time) {
        let Some(packet) = self.packet() else {
            self.state = RadioState::Standby;
            return;
        };
        self.state = RadioState::SendSettling(begin);
        self.transmit_at(begin, packet);
    }

    fn transmit_at(&mut self, begin: Time, packet: Nrf24Packet) {
        let end = begin + packet.air_time();
        self.transmissions_end = end;
        self.statistics.sent += 1;
        self.transmissions.push(Transmission { begin, end, packet });
    }

    /// Handles the end of a transmission.
    fn sent(&mut self, now: Time) {
        let Some((_, no_ack)) = self.outgoing() else {
            // The FIFO was flushed meanwhile.
            self.state = RadioState::Standby;
            return;
        };
        if no_ack || !self.registers.is_set(EN_AA, 0) {
            self.delivered(now);
            return;
        }
        let delay = u64::from(self.registers.get(SETUP_RETR) >> 4) + 1;
        self.state = RadioState::AwaitingAck(now + Time::from_micros(250 * delay) - SETTLING);
    }

    fn delivered(&mut self, now: Time) {
        self.raised |= TX_DS;
        if !self.reuses {
            self.transmit.pop_front();
        }
        self.state = RadioState::Standby;
        self.proceed(now);
    }

    /// Handles a missing acknowledgement (7.4.2): the settling before the next try begins at `now`.
    fn retry(&mut self, now: Time) {
        if self.retries < self.registers.get(SETUP_RETR) & 0xf {
            self.retries += 1;
            self.announce(now + SETTLING);
        } else {
            self.raised |= MAX_RT;
            self.lost = (self.lost + 1).min(15);
            self.state = RadioState::Standby;
        }
    }

    /// Adds the signal of another sender, which is on the air or will be. A packet that can be
    /// received is also passed to [`Self::receive`].
    pub fn sense(&mut self, channel: u8, begin: Time, end: Time, now: Time) {
        self.carriers.retain(|(_, _, other)| *other > now);
        self.carriers.push((channel, begin, end));
    }

    /// Adds a packet that is on its way to this radio. `intact` is false if another signal overlaps
    /// with it.
    pub fn receive(&mut self, transmission: Transmission, intact: bool) {
        self.arriving.push((transmission, intact));
    }

    /// Returns RPD (6.4): the present signal while the radio receives, and its last value
    /// afterwards.
    pub(super) fn detects_power(&self, now: Time) -> bool {
        let RadioState::Receiving(since) = self.state else { return self.power_detected };
        if self.has_received && self.power_detector == PowerDetector::Latched {
            return true;
        }
        let channel = self.registers.get(RF_CH);
        self.carriers.iter().any(|(on, begin, end)| {
            *on == channel && since.max(*begin) + DETECTION <= now && now < *end
        })
    }

    fn arrive(&mut self, Transmission { begin, end, packet }: Transmission, intact: bool) {
        if packet.format != self.format() {
            return;
        }
        match self.state {
            RadioState::Receiving(since) if since <= begin => {}
            RadioState::AwaitingAck(_) => {
                if intact && packet.address == self.registers.pipe_address(0) {
                    self.acknowledged(packet, end);
                }
                return;
            }
            _ => {
                self.statistics.unheard += 1;
                return;
            }
        }
        if !intact {
            self.statistics.damaged += 1;
            return;
        }
        let pipe = (0..PIPES).find(|pipe| {
            self.registers.is_set(EN_RXADDR, *pipe)
                && self.registers.pipe_address(*pipe) == packet.address
        });
        let Some(pipe) = pipe.filter(|pipe| self.fits(*pipe, packet.payload.len())) else { return };
        self.power_detected = true;
        self.has_received = true;
        let seen = Some((packet.id, packet.payload.clone()));
        let is_repeated = packet.format.enhanced && self.last[pipe] == seen;
        if !is_repeated {
            if self.receive.len() == FIFO {
                self.statistics.overflown += 1;
                return;
            }
            self.last[pipe] = seen;
            self.receive.push_back((pipe, packet.payload.clone()));
            self.raised |= RX_DR;
            self.statistics.received += 1;
        }
        if packet.format.enhanced && !packet.no_ack && self.registers.is_set(EN_AA, pipe) {
            self.acknowledge(pipe, &packet, is_repeated, end);
        }
    }

    fn is_dynamic(&self, pipe: usize) -> bool {
        self.registers.has_feature(FEATURE_EN_DPL) && self.registers.is_set(DYNPD, pipe)
    }

    /// Returns true if a pipe expects a payload of this length. With a wrong length the checksum is
    /// at another position and does not match.
    fn fits(&self, pipe: usize, length: usize) -> bool {
        self.is_dynamic(pipe) || usize::from(self.registers.get(RX_PW_P0 + pipe as u8)) == length
    }

    /// Acknowledges a packet, with the payload that waits for this pipe. A new packet confirms that
    /// the payload sent before has arrived (7.4.1).
    fn acknowledge(&mut self, pipe: usize, packet: &Nrf24Packet, is_repeated: bool, end: Time) {
        if !is_repeated {
            let has_arrived = |outgoing: &Outgoing| matches!(outgoing, Outgoing::Acknowledgement { pipe: on, sent: true, .. } if *on == pipe);
            let before = self.transmit.len();
            self.transmit.retain(|outgoing| !has_arrived(outgoing));
            if self.transmit.len() < before {
                self.raised |= TX_DS;
            }
        }
        let mut payload = Vec::new();
        let waiting = self.transmit.iter_mut().find(|outgoing| {
            matches!(outgoing, Outgoing::Acknowledgement { pipe: on, .. } if *on == pipe)
        });
        if let Some(Outgoing::Acknowledgement { bytes, sent, .. }) = waiting {
            payload.clone_from(bytes);
            *sent = true;
        }
        let answer = Nrf24Packet { payload, no_ack: true, ..packet.clone() };
        self.state = RadioState::AckSettling(end + SETTLING);
        self.transmit_at(end + SETTLING, answer);
    }

    /// Handles an acknowledgement, which may carry a payload.
    fn acknowledged(&mut self, packet: Nrf24Packet, now: Time) {
        if !packet.payload.is_empty() && self.receive.len() < FIFO {
            self.receive.push_back((0, packet.payload));
            self.raised |= RX_DR;
            self.statistics.received += 1;
        }
        self.delivered(now);
    }
}
