//! Emulated chips: the peripherals of microcontrollers, and the other chips that boards connect to
//! them.
//!
//! An emulator executes instructions and hands every access to a peripheral to a [`Board`]. The
//! board owns time, the interrupt lines and the rest of the robot; it is assembled from these chips
//! in the robot's own folder (robots/*/board). One model therefore serves every core: Unicorn,
//! QEMU, or any other that runs a robot's image.
//!
//! # Principles
//! 1. **The registers decide.** Clocks, baud rates, timer rates and the watchdog follow what the
//!    firmware wrote, as the reference manual (RM0090 for the STM32F405, RM0091 for the STM32F051;
//!    the data sheet DS40002061B for the ATmega328P) says. The output of a pin depends on its mode.
//! 2. **A mistake must show.** A clock beyond its limit, too few flash wait states, a peripheral
//!    without its clock or a wrong baud rate causes an event, or garbage on the wire, as on the
//!    robot.
//! 3. **Event-driven and deterministic.** Time is in picoseconds since power-on and jumps from
//!    event to event. Equal inputs give equal outputs, bit for bit.
//!
//! # Limits
//! This crate does not execute instructions. It does not model the core's own peripherals (NVIC and
//! SysTick, which belong to the core) or electrical effects. A register that no robot here needs is
//! plain storage, and its first use is recorded. The models are written from the manuals; they were
//! not compared with hardware.

mod air;
pub mod atmega328p;
mod board;
mod chip;
mod clock;
mod device;
pub mod devices;
mod event;
pub mod f051;
pub mod f405;
mod i2c_bus;
mod memory;
pub mod nrf24;
pub mod nrf51;
mod serial;
pub mod stm32;
mod time;

pub use air::{Air, AirStatistics, LOOKAHEAD, PacketSource, ReceptionEvent};
pub use bittybuzz_random::Random;
pub use board::{Board, CoreKind, CoreStart, MemoryMap};
pub use chip::ChipProperties;
pub use clock::CoreClock;
pub use device::{I2cDevice, SpiDevice};
pub use event::{BoardEvent, BoardLed, BodyMotion, Bootloader, HardwareError, ResetCause};
pub use f051::{FlashChange, FlashContent};
pub use i2c_bus::{BusAction, BusAnswer, BusRelease, I2cBus};
pub use memory::MemoryContent;
pub use nrf24::{
    Nrf24Packet, PAYLOAD_MAX as RADIO_MAX, PowerDetector, RadioStatistics, Transmission,
};
pub use nrf51::{
    Battery, ExternalPose, FRAME_PAYLOAD_MAX, LineQuality, LinkFrame, Nrf51Settings, P2P_MAX,
    P2pFrame,
};
pub use stm32::{Lines, Transfer, Width};
pub use time::Time;
