//! Syslink: frames between the STM32F405 and the nRF51822 of a Crazyflie, 1 Mbaud 8N1.
//!
//! ```text
//! bc cf | type | length | data (0 to 64 bytes) | check A | check B
//! ```
//! The check bytes are Fletcher's over type, length and data, modulo 256. Source: Bitcraze's
//! `crazyflie-firmware` (`src/hal/src/syslink.c`) and `crazyflie2-nrf-firmware` (`src/syslink.c`,
//! `src/main.c`).

mod crtp;
mod frame;
mod p2p;
mod packet;
mod parser;
mod setup;

pub use crtp::{Crtp, ExternalPose};
pub use frame::{Bytes, FRAME_MAX, FrameError, MTU, SyslinkFrame};
pub use p2p::{PING_MAX, Ping, Position, SWARM_MESSAGE_MAX, SWARM_PORT, SwarmFrame};
pub use packet::{Battery, DataRate, P2P_MAX, PacketError, SyslinkPacket, kind};
pub use parser::SyslinkParser;
pub use setup::{RadioSettings, Setup};
