//! The radio's set-up: the packets that the STM32 sends to the nRF51, and the echoes that confirm
//! them.

use super::p2p::{Ping, SWARM_PORT};
use super::packet::{DataRate, P2P_MAX, SyslinkPacket};

/// The settings of the radio, which are equal for all robots of a swarm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RadioSettings {
    /// The channel n from 0 to 125, at 2400 + n MHz.
    pub channel: u8,
    /// Data rate.
    pub data_rate: DataRate,
    /// Address, least significant byte first.
    pub address: [u8; 5],
    /// The transmit power in dBm.
    pub power: i8,
}

impl RadioSettings {
    /// The settings of a Crazyflie without a valid configuration, at 0 dBm.
    pub const DEFAULT: RadioSettings =
        RadioSettings { channel: 80, data_rate: DataRate::Megabits2, address: [0xe7; 5], power: 0 };
}

/// The number of steps that every nRF51 echoes.
const ECHOED: usize = 4;

/// The number of requests after which an nRF51 counts as one that does not know RADIO_READY, if it
/// has echoed all other steps. Firmware from before 2025-10-09 ignores that request, and its radio
/// receives from the start. A line that loses every third frame loses ten requests or their echoes
/// once in a thousand set-ups. Even then the radio receives, since the nRF51 starts to receive
/// unasked 3 s after its start.
const READY_TRIES: u8 = 10;

/// The state of the radio's set-up. The nRF51 echoes each step that it accepted; the other steps
/// are sent again.
#[derive(Debug, Clone)]
pub struct Setup {
    radio: RadioSettings,
    hello: [u8; 3],
    echoed: [bool; ECHOED],
    ready: Ready,
}

/// The state of the last step, RADIO_READY.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ready {
    /// The number of requests without an echo, since all other steps were echoed.
    Asked(u8),
    /// The nRF51 echoed the request.
    Known,
    /// The nRF51 left [`READY_TRIES`] requests without an echo.
    Unknown,
}

impl Setup {
    /// Returns the state in which no step is done.
    pub fn new(radio: RadioSettings, robot: u16) -> Self {
        let hello = Ping { robot, is_answer: true, data: &[] };
        let mut room = [0; P2P_MAX];
        let hello = hello.write(&mut room).and_then(|bytes| bytes.first_chunk().copied());
        let hello = hello.unwrap_or_default();
        Setup { radio, hello, echoed: [false; ECHOED], ready: Ready::Asked(0) }
    }

    /// Restarts the set-up: all requests are sent again.
    pub fn restart(&mut self) {
        self.echoed = [false; ECHOED];
        self.ready = Ready::Asked(0);
    }

    /// Returns true if the nRF51 has echoed something.
    pub fn has_begun(&self) -> bool {
        self.echoed.contains(&true) || self.ready == Ready::Known
    }

    /// Returns true if the radio sends with these settings. Bluetooth is then off, and the nRF51
    /// reads at full speed.
    pub fn can_send(&self) -> bool {
        self.echoed.iter().all(|echoed| *echoed)
    }

    /// Returns true if the radio also receives.
    pub fn is_done(&self) -> bool {
        self.can_send() && !matches!(self.ready, Ready::Asked(_))
    }

    /// Returns true for an nRF51 that does not know RADIO_READY.
    pub fn is_old(&self) -> bool {
        self.ready == Ready::Unknown
    }

    /// Returns the packets to be sent now, in this order; none once the set-up is done. The request
    /// for battery and signal strength has no echo, so each attempt includes it.
    ///
    /// The first packet is a P2P frame, which makes the nRF51 turn Bluetooth off. Meanwhile the
    /// nRF51 reads nothing, for a time that no document states. Therefore no other packets may be
    /// sent until it has echoed the ones that follow. A whole attempt fits into its queue.
    pub fn attempt(&mut self) -> impl Iterator<Item = SyslinkPacket<'_>> {
        let can_send = self.can_send();
        if can_send && let Ready::Asked(times) = self.ready {
            self.ready = if times < READY_TRIES { Ready::Asked(times + 1) } else { Ready::Unknown };
        }
        let begins = !self.is_done();
        let asks = matches!(self.ready, Ready::Asked(_));
        let hello = SyslinkPacket::P2pSend { port: SWARM_PORT, data: &self.hello };
        let missing = self.steps().into_iter().zip(self.echoed);
        (begins && !can_send)
            .then_some(hello)
            .into_iter()
            .chain(begins.then_some(SyslinkPacket::BatteryAutoupdate))
            .chain(missing.filter(|(_, echoed)| !echoed).map(|(step, _)| step))
            .chain(asks.then_some(SyslinkPacket::Ready))
    }

    /// Records a packet that may be an echo.
    pub fn process(&mut self, packet: &SyslinkPacket<'_>) {
        for (step, echoed) in self.steps().iter().zip(&mut self.echoed) {
            if step == packet {
                *echoed = true;
            }
        }
        if *packet == SyslinkPacket::Ready {
            self.ready = Ready::Known;
        }
    }

    fn steps(&self) -> [SyslinkPacket<'static>; ECHOED] {
        [
            SyslinkPacket::Channel(self.radio.channel),
            SyslinkPacket::DataRate(self.radio.data_rate),
            SyslinkPacket::Address(self.radio.address),
            SyslinkPacket::Power(self.radio.power),
        ]
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::syslink::MTU;
    use std::vec::Vec;

    const HELLO: SyslinkPacket<'static> =
        SyslinkPacket::P2pSend { port: 11, data: &[0xb3, 0x34, 0x12] };
    const STEPS: [SyslinkPacket<'static>; 4] = [
        SyslinkPacket::Channel(80),
        SyslinkPacket::DataRate(DataRate::Megabits2),
        SyslinkPacket::Address([0xe7; 5]),
        SyslinkPacket::Power(0),
    ];

    fn setup() -> Setup {
        Setup::new(RadioSettings::DEFAULT, 0x1234)
    }

    fn sent(setup: &mut Setup) -> Vec<SyslinkPacket<'_>> {
        setup.attempt().collect()
    }

    #[test]
    fn everything_is_sent_until_it_is_echoed() {
        let mut setup = setup();
        let all = [&[HELLO, SyslinkPacket::BatteryAutoupdate], &STEPS[..], &[SyslinkPacket::Ready]]
            .concat();
        assert_eq!(sent(&mut setup), all);
        assert!(!setup.has_begun());
        setup.process(&SyslinkPacket::DataRate(DataRate::Megabits2));
        setup.process(&SyslinkPacket::Ready);
        setup.process(&SyslinkPacket::Power(0));
        // This echo does not match: the request was damaged, or it is an old echo.
        setup.process(&SyslinkPacket::Channel(81));
        assert!(setup.has_begun() && !setup.can_send());
        let missing = [
            HELLO,
            SyslinkPacket::BatteryAutoupdate,
            SyslinkPacket::Channel(80),
            SyslinkPacket::Address([0xe7; 5]),
        ];
        assert_eq!(sent(&mut setup), missing);
        setup.process(&SyslinkPacket::Channel(80));
        setup.process(&SyslinkPacket::Address([0xe7; 5]));
        assert!(setup.can_send() && setup.is_done() && !setup.is_old());
        assert_eq!(sent(&mut setup), []);
        setup.restart();
        assert_eq!(sent(&mut setup), all);
    }

    /// An old nRF51 echoes all steps except RADIO_READY.
    #[test]
    fn an_old_nrf51_is_asked_ten_times() {
        let mut setup = setup();
        // Attempts without any echo do not count.
        (0..20).for_each(|_| assert_eq!(sent(&mut setup).len(), 7));
        STEPS.iter().for_each(|step| setup.process(step));
        for _ in 0..10 {
            assert!(setup.can_send() && !setup.is_done());
            assert_eq!(sent(&mut setup), [SyslinkPacket::BatteryAutoupdate, SyslinkPacket::Ready]);
        }
        assert!(!setup.is_done());
        assert_eq!(sent(&mut setup), []);
        assert!(setup.is_done() && setup.is_old());
        // The nRF51 knows RADIO_READY after all; its echoes had been lost.
        setup.process(&SyslinkPacket::Ready);
        assert!(!setup.is_old());
        setup.restart();
        assert!(!setup.is_done());
    }

    /// The nRF51's queue holds 127 bytes.
    #[test]
    fn an_attempt_fits_the_queue() {
        let mut room = [0; MTU];
        let mut setup = setup();
        let length =
            |packet: SyslinkPacket<'_>| packet.frame(&mut room).unwrap().bytes().as_slice().len();
        let bytes: usize = setup.attempt().map(length).sum();
        assert_eq!(bytes, 10 + 6 + 7 + 7 + 11 + 7 + 6);
    }
}
