//! Bringing the radio up: what the nRF51 has to be told, and whether it has heard.

use super::packet::{DataRate, Packet};

/// How the radio works. All robots of a swarm use the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Radio {
    /// 0 to 125: 2400 + n MHz.
    pub channel: u8,
    /// Data rate.
    pub data_rate: DataRate,
    /// Address, least significant byte first.
    pub address: [u8; 5],
    /// dBm
    pub power: i8,
}

impl Radio {
    /// What a Crazyflie without a valid configuration uses, at 0 dBm.
    pub const DEFAULT: Radio =
        Radio { channel: 80, data_rate: DataRate::Megabits2, address: [0xe7; 5], power: 0 };
}

/// Steps that the nRF51 echoes.
const ECHOED: usize = 5;

/// Which steps are done. The nRF51 echoes what it has understood; what it has not echoed is sent again.
#[derive(Debug, Clone)]
pub struct Setup {
    radio: Radio,
    echoed: [bool; ECHOED],
}

impl Setup {
    /// Nothing is done yet.
    pub fn new(radio: Radio) -> Self {
        Setup { radio, echoed: [false; ECHOED] }
    }

    /// The nRF51 has to be told everything again.
    pub fn restart(&mut self) {
        self.echoed = [false; ECHOED];
    }

    /// Whether the radio works as wanted.
    pub fn is_done(&self) -> bool {
        self.echoed.iter().all(|echoed| *echoed)
    }

    /// What has to be sent, in this order. The request for battery and signal strength has no echo; it goes with every
    /// attempt.
    pub fn missing(&self) -> impl Iterator<Item = Packet<'static>> {
        let steps = self.steps();
        let missing = steps.into_iter().zip(self.echoed).filter(|(_, echoed)| !echoed);
        let updates = if self.is_done() { None } else { Some(Packet::BatteryAutoupdate) };
        updates.into_iter().chain(missing.map(|(step, _)| step))
    }

    /// Takes note of a packet that may be an echo.
    pub fn hear(&mut self, packet: &Packet<'_>) {
        for (step, echoed) in self.steps().iter().zip(&mut self.echoed) {
            if step == packet {
                *echoed = true;
            }
        }
    }

    /// Ready comes last: from then on the radio receives.
    fn steps(&self) -> [Packet<'static>; ECHOED] {
        [
            Packet::Channel(self.radio.channel),
            Packet::DataRate(self.radio.data_rate),
            Packet::Address(self.radio.address),
            Packet::Power(self.radio.power),
            Packet::Ready,
        ]
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use std::vec::Vec;

    fn sent(setup: &Setup) -> Vec<Packet<'static>> {
        setup.missing().collect()
    }

    #[test]
    fn everything_is_sent_until_it_is_echoed() {
        let mut setup = Setup::new(Radio::DEFAULT);
        assert_eq!(
            sent(&setup),
            [
                Packet::BatteryAutoupdate,
                Packet::Channel(80),
                Packet::DataRate(DataRate::Megabits2),
                Packet::Address([0xe7; 5]),
                Packet::Power(0),
                Packet::Ready,
            ]
        );
        setup.hear(&Packet::DataRate(DataRate::Megabits2));
        setup.hear(&Packet::Ready);
        setup.hear(&Packet::Power(0));
        // An echo of something else: the request was damaged, or an old one.
        setup.hear(&Packet::Channel(81));
        assert_eq!(
            sent(&setup),
            [Packet::BatteryAutoupdate, Packet::Channel(80), Packet::Address([0xe7; 5])]
        );
        setup.hear(&Packet::Channel(80));
        setup.hear(&Packet::Address([0xe7; 5]));
        assert!(setup.is_done() && sent(&setup).is_empty());
        setup.restart();
        assert_eq!(sent(&setup).len(), 6);
    }
}
