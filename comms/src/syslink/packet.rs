//! Typed packets: the frame types that a robot's firmware needs.

use super::frame::{FrameError, MTU, SyslinkFrame};

/// Type bytes of frames, as Bitcraze names them. The nRF51 echoes a packet that is marked "echoed".
pub mod kind {
    /// A CRTP packet from or to the ground station.
    pub const RADIO_RAW: u8 = 0x00;
    /// The radio channel, echoed.
    pub const RADIO_CHANNEL: u8 = 0x01;
    /// Data rate, echoed.
    pub const RADIO_DATARATE: u8 = 0x02;
    /// Signal strength of the last packet.
    pub const RADIO_RSSI: u8 = 0x04;
    /// The radio address, echoed.
    pub const RADIO_ADDRESS: u8 = 0x05;
    /// Transmit power, echoed.
    pub const RADIO_POWER: u8 = 0x07;
    /// A frame from or to all other robots.
    pub const RADIO_P2P_BROADCAST: u8 = 0x0a;
    /// The STM32 is ready to receive, echoed.
    pub const RADIO_READY: u8 = 0x0b;
    /// A request to cut all power.
    pub const PM_ONOFF_SWITCHOFF: u8 = 0x11;
    /// State of the battery.
    pub const PM_BATTERY_STATE: u8 = 0x13;
    /// A request for battery state and signal strength every 10 ms.
    pub const PM_BATTERY_AUTOUPDATE: u8 = 0x14;
    pub const PM_SHUTDOWN_REQUEST: u8 = 0x15;
    /// The answer to a shutdown request: the power may be cut.
    pub const PM_SHUTDOWN_ACK: u8 = 0x16;
    /// Switches the blue LED of the nRF51 on.
    pub const PM_LED_ON: u8 = 0x17;
    /// Switches the blue LED of the nRF51 off.
    pub const PM_LED_OFF: u8 = 0x18;
}

/// The maximum payload of a P2P frame, in bytes.
pub const P2P_MAX: usize = 60;

/// Data rate of the radio.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum DataRate {
    /// 250 kbit/s
    Kilobits250 = 0,
    /// 1 Mbit/s
    Megabit1 = 1,
    /// 2 Mbit/s
    Megabits2 = 2,
}

/// State of the battery.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Battery {
    /// True while the charger works.
    pub charging: bool,
    /// True while USB supplies power.
    pub usb_powered: bool,
    pub volts: f32,
}

/// The content of a frame, parsed and within its limits.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SyslinkPacket<'a> {
    /// A CRTP packet: header and at most 30 bytes.
    Raw(&'a [u8]),
    /// Radio channel n from 0 to 125, at 2400 + n MHz.
    Channel(u8),
    /// Data rate.
    DataRate(DataRate),
    /// Address, least significant byte first.
    Address([u8; 5]),
    /// Transmit power in dBm.
    Power(i8),
    /// Signal strength of the last packet in dBm, never positive.
    Rssi(i16),
    /// The radio may receive.
    Ready,
    /// A message to be sent to all other robots.
    P2pSend {
        /// The P2P port, 0 to 15.
        port: u8,
        /// The payload, at most [`P2P_MAX`] bytes.
        data: &'a [u8],
    },
    /// A message that was received from another robot.
    P2pReceived {
        /// The P2P port, 0 to 15.
        port: u8,
        /// Signal strength in dBm, never positive.
        rssi: i16,
        /// The payload, at most [`P2P_MAX`] bytes.
        data: &'a [u8],
    },
    /// A request to cut all power at once.
    SwitchOff,
    /// State of the battery.
    Battery(Battery),
    /// A request for battery state and signal strength every 10 ms.
    BatteryAutoupdate,
    /// The announcement that the power will be cut. The answer is [`SyslinkPacket::ShutdownAck`], as soon
    /// as the robot is ready.
    ShutdownRequest,
    /// The power may be cut.
    ShutdownAck,
    /// The state of the nRF51's blue LED: true switches it on.
    RadioLed(bool),
}

/// A reason why a frame is not a valid packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PacketError {
    /// The firmware does not use this type.
    UnknownKind(u8),
    /// The length of the data does not fit this type.
    Length(u8),
    /// A value is out of range in a frame of this type.
    Value(u8),
}

impl<'a> SyslinkPacket<'a> {
    /// Parses a frame that the nRF51 sent.
    pub fn received(frame: SyslinkFrame<'a>) -> Result<Self, PacketError> {
        let kind = frame.kind();
        let data = frame.data();
        match (kind, data) {
            (kind::RADIO_RAW, data) if !data.is_empty() && data.len() <= 31 => {
                Ok(SyslinkPacket::Raw(data))
            }
            (kind::RADIO_CHANNEL, [channel @ 0..=125]) => Ok(SyslinkPacket::Channel(*channel)),
            (kind::RADIO_DATARATE, [0]) => Ok(SyslinkPacket::DataRate(DataRate::Kilobits250)),
            (kind::RADIO_DATARATE, [1]) => Ok(SyslinkPacket::DataRate(DataRate::Megabit1)),
            (kind::RADIO_DATARATE, [2]) => Ok(SyslinkPacket::DataRate(DataRate::Megabits2)),
            (kind::RADIO_CHANNEL | kind::RADIO_DATARATE, [_]) => Err(PacketError::Value(kind)),
            (kind::RADIO_RSSI, [rssi]) => Ok(SyslinkPacket::Rssi(-i16::from(*rssi))),
            (kind::RADIO_ADDRESS, [a, b, c, d, e]) => {
                Ok(SyslinkPacket::Address([*a, *b, *c, *d, *e]))
            }
            (kind::RADIO_POWER, [power]) => Ok(SyslinkPacket::Power(*power as i8)),
            (kind::RADIO_READY, []) => Ok(SyslinkPacket::Ready),
            (kind::RADIO_P2P_BROADCAST, [port, rssi, data @ ..]) if data.len() <= P2P_MAX => {
                Ok(SyslinkPacket::P2pReceived { port: port & 0x0f, rssi: -i16::from(*rssi), data })
            }
            (kind::PM_ONOFF_SWITCHOFF, []) => Ok(SyslinkPacket::SwitchOff),
            // Charger current and, on newer boards, temperature follow; the firmware does not use
            // them.
            (kind::PM_BATTERY_STATE, [flags, v0, v1, v2, v3, rest @ ..])
                if matches!(rest.len(), 4 | 8) =>
            {
                let volts = f32::from_le_bytes([*v0, *v1, *v2, *v3]);
                // The robot acts upon the voltage, so a value that no battery has is rejected.
                if !(0.0..=6.0).contains(&volts) {
                    return Err(PacketError::Value(kind));
                }
                let (charging, usb_powered) = (flags & 1 != 0, flags & 2 != 0);
                Ok(SyslinkPacket::Battery(Battery { charging, usb_powered, volts }))
            }
            (kind::PM_BATTERY_AUTOUPDATE, []) => Ok(SyslinkPacket::BatteryAutoupdate),
            (kind::PM_SHUTDOWN_REQUEST, []) => Ok(SyslinkPacket::ShutdownRequest),
            (kind::PM_SHUTDOWN_ACK, []) => Ok(SyslinkPacket::ShutdownAck),
            (kind::PM_LED_ON, []) => Ok(SyslinkPacket::RadioLed(true)),
            (kind::PM_LED_OFF, []) => Ok(SyslinkPacket::RadioLed(false)),
            (
                kind::RADIO_RAW..=kind::RADIO_DATARATE
                | kind::RADIO_RSSI..=kind::RADIO_ADDRESS
                | kind::RADIO_POWER
                | kind::RADIO_P2P_BROADCAST..=kind::RADIO_READY
                | kind::PM_ONOFF_SWITCHOFF
                | kind::PM_BATTERY_STATE..=kind::PM_LED_OFF,
                _,
            ) => Err(PacketError::Length(kind)),
            _ => Err(PacketError::UnknownKind(kind)),
        }
    }

    /// Writes the packet's data to `buffer` and returns the frame to be sent.
    pub fn frame<'b>(&self, buffer: &'b mut [u8; MTU]) -> Result<SyslinkFrame<'b>, FrameError> {
        let mut length = 0;
        let mut put = |bytes: &[u8]| {
            for byte in bytes {
                if let Some(slot) = buffer.get_mut(length) {
                    *slot = *byte;
                }
                length += 1;
            }
        };
        let kind = match self {
            SyslinkPacket::Raw(data) => {
                put(data);
                kind::RADIO_RAW
            }
            SyslinkPacket::Channel(channel) => {
                put(&[*channel]);
                kind::RADIO_CHANNEL
            }
            SyslinkPacket::DataRate(rate) => {
                put(&[*rate as u8]);
                kind::RADIO_DATARATE
            }
            SyslinkPacket::Address(address) => {
                put(address);
                kind::RADIO_ADDRESS
            }
            SyslinkPacket::Power(power) => {
                put(&power.to_le_bytes());
                kind::RADIO_POWER
            }
            SyslinkPacket::Rssi(rssi) => {
                put(&[rssi.unsigned_abs().min(255) as u8]);
                kind::RADIO_RSSI
            }
            SyslinkPacket::Ready => kind::RADIO_READY,
            SyslinkPacket::P2pSend { port, data } => {
                put(&[*port]);
                put(data);
                kind::RADIO_P2P_BROADCAST
            }
            SyslinkPacket::P2pReceived { port, rssi, data } => {
                put(&[*port, rssi.unsigned_abs().min(255) as u8]);
                put(data);
                kind::RADIO_P2P_BROADCAST
            }
            SyslinkPacket::SwitchOff => kind::PM_ONOFF_SWITCHOFF,
            SyslinkPacket::Battery(battery) => {
                put(&[u8::from(battery.charging) | u8::from(battery.usb_powered) << 1]);
                put(&battery.volts.to_le_bytes());
                put(&0f32.to_le_bytes());
                kind::PM_BATTERY_STATE
            }
            SyslinkPacket::BatteryAutoupdate => kind::PM_BATTERY_AUTOUPDATE,
            SyslinkPacket::ShutdownRequest => kind::PM_SHUTDOWN_REQUEST,
            SyslinkPacket::ShutdownAck => kind::PM_SHUTDOWN_ACK,
            SyslinkPacket::RadioLed(true) => kind::PM_LED_ON,
            SyslinkPacket::RadioLed(false) => kind::PM_LED_OFF,
        };
        match buffer.get(..length) {
            Some(data) => SyslinkFrame::new(kind, data),
            None => Err(FrameError::TooLong),
        }
    }
}
