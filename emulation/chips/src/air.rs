//! The radio channel that several nRF24L01+ share.

use std::collections::{BTreeMap, BTreeSet};

use crate::Time;
use crate::nrf24::Transmission;
use bittybuzz_random::Random;

/// The time between a radio's announcement of a packet and the packet's first bit. Robots can be
/// emulated independently for this long.
pub const LOOKAHEAD: Time = Time::from_micros(120);

/// The sender of a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PacketSource {
    /// The robot with this number.
    Robot(usize),
    /// A sender that is no robot and reaches all robots.
    Stranger,
}

/// The counters of the radio channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AirStatistics {
    /// Packets, counted once for each robot that could have received them.
    pub carried: u64,
    /// Packets among these that overlapped with another one on the same channel.
    pub collided: u64,
    /// Packets among these that were lost at random.
    pub lost: u64,
}

/// An event at a robot's receiver.
#[derive(Clone, Debug, PartialEq)]
pub enum ReceptionEvent {
    /// A signal on this channel, with its begin and end. The packet is not complete yet.
    Signal(u8, Time, Time),
    /// A complete packet; true if it arrived undamaged.
    Packet(Transmission, bool),
}

/// The radio channel between robots on one table. Every robot receives every other one, except
/// those that were cut off. Two packets that overlap on a channel are both lost; further packets
/// are lost at random, independently for each receiver.
pub struct Air {
    on_air: Vec<OnAir>,
    loss: f64,
    random: Random,
    /// For each robot that was cut off, the robots that it cannot receive.
    deaf: BTreeMap<usize, BTreeSet<usize>>,
    /// Robots without power.
    off: BTreeSet<usize>,
    /// The counters so far.
    pub statistics: AirStatistics,
}

struct OnAir {
    sender: PacketSource,
    transmission: Transmission,
    is_sensed: bool,
    has_arrived: bool,
}

impl Default for Air {
    fn default() -> Self {
        Self::new()
    }
}

impl Air {
    /// Creates a radio channel on which only overlapping packets are lost.
    pub fn new() -> Self {
        let (on_air, random) = (Vec::new(), Random::new(0));
        let (deaf, off) = (BTreeMap::new(), BTreeSet::new());
        Air { on_air, loss: 0.0, random, deaf, off, statistics: AirStatistics::default() }
    }

    /// Isolates `robot` from the robots in `from` from now on, as if there were walls: `robot`
    /// neither receives nor senses them, and they disturb no packet on its way to `robot`.
    pub fn cut_off(&mut self, robot: usize, from: BTreeSet<usize>) {
        self.deaf.insert(robot, from);
    }

    /// Switches a robot on or off. A robot without power receives nothing.
    pub fn set_power(&mut self, robot: usize, on: bool) {
        if on {
            self.off.remove(&robot);
        } else {
            self.off.insert(robot);
        }
    }

    /// Returns true if a sender reaches a robot.
    fn reaches(&self, robot: usize, sender: PacketSource) -> bool {
        match sender {
            PacketSource::Robot(number) => {
                number != robot && self.deaf.get(&robot).is_none_or(|from| !from.contains(&number))
            }
            PacketSource::Stranger => true,
        }
    }

    /// Sets the probability with which a packet is lost from now on. Equal seeds lose the same
    /// packets.
    pub fn lose(&mut self, loss: f64, seed: u64) {
        (self.loss, self.random) = (loss, Random::new(seed));
    }

    /// Adds a transmission in the future.
    pub fn add(&mut self, sender: PacketSource, transmission: Transmission) {
        let (is_sensed, has_arrived) = (false, false);
        self.on_air.push(OnAir { sender, transmission, is_sensed, has_arrived });
    }

    /// Reports the events before `until` to `robots` robots through the callback. All transmissions
    /// up to then must be known.
    pub fn carry(
        &mut self,
        until: Time,
        robots: usize,
        mut tell: impl FnMut(usize, ReceptionEvent),
    ) {
        if self.on_air.is_empty() {
            return;
        }
        for number in 0..self.on_air.len() {
            let OnAir { sender, ref transmission, is_sensed, has_arrived } = self.on_air[number];
            let receivers: Vec<usize> = (0..robots)
                .filter(|robot| !self.off.contains(robot) && self.reaches(*robot, sender))
                .collect();
            let (begin, end) = (transmission.begin, transmission.end);
            let channel = transmission.packet.channel();
            if !is_sensed && begin < until {
                self.on_air[number].is_sensed = true;
                for receiver in &receivers {
                    tell(*receiver, ReceptionEvent::Signal(channel, begin, end));
                }
            }
            if has_arrived || end > until {
                continue;
            }
            self.on_air[number].has_arrived = true;
            for receiver in receivers {
                let overlaps = |other: &OnAir| {
                    let (sent, by) = (&other.transmission, other.sender);
                    // A receiver cannot receive its own transmission.
                    !std::ptr::eq(other, &self.on_air[number])
                        && self.reaches(receiver, by)
                        && sent.packet.channel() == channel
                        && sent.begin < end
                        && begin < sent.end
                };
                let collides = self.on_air.iter().any(overlaps);
                let is_lost = !collides && self.random.chance(self.loss);
                self.statistics.carried += 1;
                self.statistics.collided += u64::from(collides);
                self.statistics.lost += u64::from(is_lost);
                let packet = self.on_air[number].transmission.clone();
                tell(receiver, ReceptionEvent::Packet(packet, !collides && !is_lost));
            }
        }
        // A packet that may overlap with one still on the air is kept: the longest packet, at 250
        // kb/s, is on the air for 1.4 ms.
        let old = until - Time::from_millis(2);
        self.on_air.retain(|packet| !packet.has_arrived || packet.transmission.end > old);
    }
}
