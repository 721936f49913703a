//! The board of a Crazyflie 2: an STM32F405, an nRF51822, LEDs and motors.

use crate::{Battery, Event, Frame, Lines, Link, ResetCause, Time, Width};

/// What differs from one Crazyflie to the next.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The chip's 96-bit unique id (RM0090 39.1).
    pub unique_id: [u8; 12],
    /// The device type that Bitcraze writes to the one-time programmable area.
    pub device_type: String,
}

impl Default for Settings {
    fn default() -> Self {
        Settings { unique_id: *b"\x2a\x00\x1b\x00CF21-001", device_type: "0;CF21".into() }
    }
}

/// What was counted since power-on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Longest time from a byte's arrival at USART6 to its being read.
    pub receive_latency: Time,
    /// Bytes lost because the one before had not been read.
    pub overruns: u64,
    /// Bytes that USART6 received with a wrong stop bit.
    pub framing_errors: u64,
    /// Bytes that the radio's processor received.
    pub peer_received: u64,
    /// Of these, the ones with a wrong stop bit.
    pub peer_framing_errors: u64,
    /// Frames that the radio's processor dropped for their checksum.
    pub peer_bad_checksums: u64,
    /// Bytes that the radio's processor lost because its queue was full: the firmware ignored flow control.
    pub peer_dropped: u64,
    /// Frames that were to be sent to the firmware while the radio's processor is still silent.
    pub peer_unsent: u64,
    /// Bytes that the line lost on request, in both directions.
    pub link_lost: u64,
    /// Bytes that the line changed on request, in both directions.
    pub link_corrupted: u64,
    /// Accesses to peripherals whose clock is off.
    pub accesses_without_clock: u64,
    /// First addresses that were used of what has no model and is plain storage.
    pub unknown: Vec<u32>,
}

/// A Crazyflie 2 without the core of its STM32.
pub struct Crazyflie {
    now: Time,
}

impl Crazyflie {
    /// A Crazyflie whose power was just turned on.
    pub fn new(_settings: Settings) -> Self {
        Crazyflie { now: Time::ZERO }
    }

    /// The time that all peripherals have reached.
    pub fn now(&self) -> Time {
        self.now
    }

    /// Lets time pass until `to`; does nothing if that is past.
    pub fn advance(&mut self, to: Time) {
        self.now = self.now.max(to);
    }

    /// When something will next change by itself: an interrupt line, a pin, a byte on the wire.
    pub fn next_event(&self) -> Option<Time> {
        None
    }

    /// The core reads. `address` is aligned to `width`; the ranges are the peripherals, 0x4000_0000 to
    /// 0x5fff_ffff, and the one-time programmable and unique-id area, 0x1fff_7000 to 0x1fff_7fff.
    pub fn read(&mut self, _address: u32, _width: Width) -> u32 {
        0
    }

    /// The core writes to a peripheral.
    pub fn write(&mut self, _address: u32, _width: Width, _value: u32) {}

    /// The levels of the interrupt lines.
    pub fn interrupts(&self) -> Lines {
        Lines::default()
    }

    /// Frequency of the core, as the RCC registers say.
    pub fn core_clock_hz(&self) -> u64 {
        16_000_000
    }

    /// Whether the chip wants to be reset, and why; the core then calls [`reset`](Self::reset).
    pub fn take_reset_request(&mut self) -> Option<ResetCause> {
        None
    }

    /// Resets the STM32. The radio's processor goes on, and RCC_CSR keeps the causes.
    pub fn reset(&mut self, _cause: ResetCause) {}

    /// Whether the radio's processor still powers the STM32.
    pub fn is_powered(&self) -> bool {
        true
    }

    /// What happened since the last call, in order.
    pub fn take_events(&mut self) -> Vec<(Time, Event)> {
        Vec::new()
    }

    /// Counters since power-on.
    pub fn statistics(&self) -> Statistics {
        Statistics::default()
    }

    /// The radio's processor sends a frame, after those that still wait.
    pub fn send(&mut self, _frame: &Frame) {}

    /// Bytes come from the radio's processor, whatever they mean, back to back after those that wait.
    pub fn send_bytes(&mut self, _bytes: &[u8]) {}

    /// The line loses and corrupts bytes from now on.
    pub fn set_link(&mut self, _link: Link) {}

    /// The radio's processor stops to read its queue and says so (`true`), or goes on (`false`).
    pub fn set_flow_control(&mut self, _full: bool) {}

    /// The battery is in this state from now on.
    pub fn set_battery(&mut self, _battery: Battery) {}

    /// The button was pressed: the radio's processor asks the firmware to shut down and cuts the power when
    /// that has acknowledged, after 100 ms at the latest.
    pub fn request_shutdown(&mut self) {}
}
