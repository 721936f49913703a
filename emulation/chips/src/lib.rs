//! The chips around the core and the boards around the chips.
//!
//! An emulator executes instructions and hands every access to a peripheral to a board of this crate; the
//! board owns time, interrupt lines and the rest of the robot. So one model serves every core: Unicorn,
//! QEMU, or whatever runs a robot's image next.
//!
//! # Principles
//! 1. **The registers decide.** Clocks, baud rates, timer rates and the watchdog follow what the firmware
//!    wrote, as the reference manual (RM0090 for the STM32F405, RM0091 for the STM32F051; the data sheet
//!    DS40002061B for the ATmega328P) says; a pin shows what its mode lets through.
//! 2. **A mistake must show.** A clock beyond its limit, too few flash wait states, a peripheral without its
//!    clock, a wrong baud rate: each is an event, or garbage on the wire, as on the robot.
//! 3. **Only what happens.** Time is in picoseconds since power-on and jumps from event to event; the same
//!    inputs give the same outputs, bit for bit.
//!
//! # What it will not do
//! Execute instructions, model the core's own peripherals (NVIC, SysTick: they belong to the core), or
//! electrical effects. A register that no robot here needs is plain storage, and its first use is recorded.
//! The models are written from the manuals; they were not compared with hardware.

mod air;
mod atmega328p;
mod board;
mod bootloader;
mod clock;
mod crazyflie;
mod event;
mod f051;
mod f405;
mod kilobot;
mod memory;
mod nrf24;
mod nrf51;
mod random;
mod serial;
mod stm32;
mod time;
mod zooid;

pub use air::{Air, AirStatistics, Heard, LOOKAHEAD, Sender};
pub use atmega328p::{Change, EEPROM_SIZE, PAGE, RAM, Sleep};
pub use board::{Board, CoreKind, MemoryMap, Start};
pub use clock::Clock;
pub use crazyflie::{Chip, Crazyflie, Settings, Statistics};
pub use event::{Event, HardwareError, Led, Loader, ResetCause};
pub use f051::{FlashChange, FlashContent, Transfer};
pub use f405::OTP;
pub use kilobot::{Amplitude, DIAMETER_MM, Edge, Kilobot, KilobotStatistics, Surroundings};
pub use kilobot::{Light as Infrared, infrared_checksum};
pub use memory::Memory;
pub use nrf24::{MAX_PAYLOAD as RADIO_MAX, Packet, PowerDetector, RadioStatistics, Transmission};
pub use nrf51::{Battery, Frame, Link, MAX_PAYLOAD, Nrf51Settings, P2P_MAX, P2pFrame, Pose};
pub use random::Random;
pub use stm32::{Lines, Width};
pub use time::Time;
pub use zooid::{Light, STEP_MM, TablePose, Zooid, ZooidStatistics};
