//! The events that are visible from outside a board.

use std::fmt;

use crate::Time;

/// An action of the robot that an observer could notice.
#[derive(Clone, Debug, PartialEq)]
pub enum BoardEvent {
    /// A LED goes on or off.
    Led {
        led: BoardLed,
        /// True when the LED goes on.
        on: bool,
    },
    /// The signal at a motor changes.
    Motor {
        /// For a Crazyflie, motors 1 to 4 as numbered on its board. For a Zooid, 1 to 4 are the
        /// bridge inputs IN1 and IN2 of motor 1, then those of motor 2.
        number: u8,
        /// The fraction of time that the motor is on, 0 to 1.
        duty: f64,
        /// The frequency of the pulses in Hz; 0 for a constant level.
        frequency_hz: f64,
    },
    /// The body of a flying robot moved.
    Motion(BodyMotion),
    /// The firmware sent a frame to the radio's processor.
    Syslink {
        /// Type byte of the frame.
        kind: u8,
        /// The bytes of the packet.
        payload: Vec<u8>,
        /// True if the frame arrived with a good checksum; otherwise the peer dropped it.
        intact: bool,
    },
    /// The nRF24L01+ begins to transmit a packet.
    Radio {
        /// The packet is sent at 2400 + `channel` MHz.
        channel: u8,
        /// The bytes of the packet.
        payload: Vec<u8>,
        /// The time on the air, up to the end of the last bit.
        air: Time,
    },
    /// The radio begins to transmit a P2P frame to all other robots. It receives nothing meanwhile.
    P2p {
        /// 0 to 15
        port: u8,
        /// The bytes of the packet.
        payload: Vec<u8>,
        /// The time on the air, up to the end of the last bit.
        air: Time,
    },
    /// The color of a Kilobot's LED changes. Each of its components is 0 to 3.
    Color {
        /// Red component, 0 to 3.
        red: u8,
        green: u8,
        blue: u8,
    },
    /// A Kilobot sent a frame by infrared light; its last pulse begins now.
    Infrared {
        /// Data, type and checksum.
        payload: Vec<u8>,
        /// The time since the first pulse of the frame.
        air: Time,
    },
    /// A Kilobot sent bytes on its debug line.
    Serial {
        /// The bytes in the order in which they were sent.
        bytes: Vec<u8>,
    },
    /// The radio's processor cuts the power of the STM32.
    PowerOff {
        /// True if the firmware acknowledged the request in time.
        acknowledged: bool,
    },
    /// The bootloader starts a loader instead of the firmware. The chip then waits for new
    /// firmware.
    Loader(Bootloader),
    /// The firmware performs an action that the chip does not allow.
    HardwareError(HardwareError),
}

/// The true motion of a robot's body, and its battery.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyMotion {
    /// Position of the center of mass in the world frame, in m; z is up.
    pub position_m: [f64; 3],
    /// Velocity in the world frame, in m/s.
    pub velocity_m_s: [f64; 3],
    /// Rotation from the body frame to the world frame: x, y, z and w of a quaternion.
    pub attitude: [f64; 4],
    /// True once the robot crashed.
    pub has_crashed: bool,
    /// Voltage of the battery under load, in V.
    pub battery_volts: f64,
    /// Remaining charge of the battery, 0 to 1; `None` while a command fixes the voltage.
    pub battery_charge: Option<f64>,
}

/// A program that receives new firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bootloader {
    /// The loader in the chip's ROM, which receives over USB (ST AN2606).
    Dfu,
    /// Bitcraze's loader, which receives over the radio.
    Crtp,
}

impl Bootloader {
    /// Returns the name in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Bootloader::Dfu => "dfu",
            Bootloader::Crtp => "crtp",
        }
    }
}

/// The LEDs of a Crazyflie 2, and the colors of a Zooid's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BoardLed {
    /// PD2, next to the charger.
    BlueLeft,
    /// PC0.
    RedLeft,
    /// PC1.
    GreenLeft,
    /// PC2.
    GreenRight,
    /// PC3.
    RedRight,
    /// The LED that the radio's processor drives.
    BlueRight,
    /// The red part of a Zooid's LED.
    Red,
    /// The green part of a Zooid's LED.
    Green,
    /// The blue part of a Zooid's LED.
    Blue,
}

impl BoardLed {
    /// Returns the name in messages.
    pub const fn name(self) -> &'static str {
        match self {
            BoardLed::BlueLeft => "blue_left",
            BoardLed::RedLeft => "red_left",
            BoardLed::GreenLeft => "green_left",
            BoardLed::GreenRight => "green_right",
            BoardLed::RedRight => "red_right",
            BoardLed::BlueRight => "blue_right",
            BoardLed::Red => "red",
            BoardLed::Green => "green",
            BoardLed::Blue => "blue",
        }
    }
}

/// The reason why the chip restarts (RM0090 6.3.21, RCC_CSR).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ResetCause {
    /// Power was applied.
    PowerOn,
    /// Power is cut; the chip is held in reset until it comes back.
    PowerOff,
    /// The supply fell below the threshold of the brown-out detector, but not below that of
    /// power-on.
    BrownOut,
    /// The reset pin was pulled.
    Pin,
    /// The firmware set AIRCR.SYSRESETREQ.
    Software,
    /// The independent watchdog expired.
    IndependentWatchdog,
}

impl ResetCause {
    /// Returns the name in messages.
    pub const fn name(self) -> &'static str {
        match self {
            ResetCause::PowerOn => "power_on",
            ResetCause::PowerOff => "power_off",
            ResetCause::BrownOut => "brown_out",
            ResetCause::Pin => "pin",
            ResetCause::Software => "software",
            ResetCause::IndependentWatchdog => "independent_watchdog",
        }
    }
}

/// An action that the chip does not allow. Each is reported once per cause, not once per access.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum HardwareError {
    /// A clock is above its limit (RM0090 6.2, RM0091 6.2).
    ClockTooFast {
        /// SYSCLK, AHB, APB1 or APB2.
        clock: &'static str,
        /// The frequency that the registers set.
        hz: u64,
        /// The highest frequency allowed.
        limit_hz: u64,
    },
    /// FLASH_ACR.LATENCY is too small for the core clock (RM0090 3.5.1).
    FlashTooSlow {
        /// The frequency of the core.
        hz: u64,
        /// The wait states that the firmware set.
        wait_states: u32,
        /// The wait states that this frequency needs.
        needed: u32,
    },
    /// The system clock was switched to a source that does not run, or the PLL's input or output is
    /// out of range (RM0090 6.3.2).
    PllOutOfRange {
        /// Frequency at the PLL's input.
        input_hz: u64,
        /// Frequency of the oscillator within the PLL.
        vco_hz: u64,
    },
    /// SPI clocks the nRF24L01+ faster than it allows (product specification, 8.3.2).
    RadioSpiTooFast {
        /// The frequency of SCK.
        hz: u64,
        /// The highest frequency allowed.
        limit_hz: u64,
    },
    /// A Kilobot's debug line does not use 38400 baud with eight data bits.
    SerialFormat {
        /// The rate that the registers set.
        baud: u64,
    },
    /// A Kilobot's infrared LED shines longer than any valid pulse.
    LongPulse,
    /// `spm` was executed below the boot loader's section, where it does nothing (DS40002061B
    /// 27.3).
    StoreOutside {
        /// The program counter.
        pc: u16,
    },
    /// `spm` was executed too late after SPMCSR was written, or while a page is written
    /// (DS40002061B 27.9.1).
    StoreLocked {
        /// The program counter.
        pc: u16,
    },
    /// An interrupt's vector lies in flash that cannot be read while it is written (DS40002061B
    /// 27.6).
    ReadWhileWrite {
        /// The address of the vector.
        address: u16,
    },
    /// The stack pointer left the RAM.
    Stack {
        /// The stack pointer.
        pointer: u16,
    },
    /// A Kilobot's core executed an unknown instruction, or accessed an address beyond all memory.
    BadInstruction {
        /// The program counter shortly before the error.
        after: u16,
    },
    /// A peripheral was used while its clock is off: reads return 0, and writes are lost.
    NoClock {
        /// The first address of its registers.
        base: u32,
    },
    /// The firmware wrote to the flash like to RAM, which changes nothing. Only the first address
    /// after a reset is reported.
    FlashWrite {
        /// The address, which is below the size of the flash if it was an alias.
        address: u32,
    },
    /// The firmware changes the registers of a DMA stream that is on (RM0090 10.5.5 to 10.5.10).
    DmaLocked {
        /// The first address of the controller's registers.
        base: u32,
    },
    /// A DMA stream was to move data from or to memory that the controller cannot reach, such as
    /// core-coupled memory (RM0090 2.1).
    DmaOutOfReach {
        /// The address in memory.
        address: u32,
    },
}

impl fmt::Display for HardwareError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            HardwareError::ClockTooFast { clock, hz, limit_hz } => {
                write!(
                    f,
                    "{clock} runs at {hz} Hz, the chip allows {limit_hz} Hz: check RCC_PLLCFGR and RCC_CFGR"
                )
            }
            HardwareError::FlashTooSlow { hz, wait_states, needed } => write!(
                f,
                "flash has {wait_states} wait states, a core at {hz} Hz needs {needed}: set FLASH_ACR before the clock"
            ),
            HardwareError::PllOutOfRange { input_hz, vco_hz } => write!(
                f,
                "the PLL gets {input_hz} Hz and oscillates at {vco_hz} Hz; allowed are 0.95 to 2.1 MHz and 100 to 432 MHz \
                 on the STM32F405, 1 to 24 MHz and 16 to 48 MHz on the STM32F051"
            ),
            HardwareError::RadioSpiTooFast { hz, limit_hz } => write!(
                f,
                "SPI runs at {hz} Hz, the radio allows {limit_hz} Hz: divide by more in SPI_CR1"
            ),
            HardwareError::SerialFormat { baud } => write!(
                f,
                "the debug line sends at {baud} baud, or not 8 data bits without parity: a terminal expects 38400 8N1"
            ),
            HardwareError::LongPulse => {
                write!(f, "the infrared LED shines for more than 100 us: a pulse takes 1 us")
            }
            HardwareError::StoreOutside { pc } => write!(
                f,
                "spm at {pc:#06x} does nothing: it works in the boot loader's section only, from 0x7000 on"
            ),
            HardwareError::StoreLocked { pc } => write!(
                f,
                "spm at {pc:#06x} does nothing: write SPMCSR in the four cycles before, and wait until the page before is written"
            ),
            HardwareError::ReadWhileWrite { address } => write!(
                f,
                "an interrupt's vector at {address:#06x} is read while the flash is written: set IVSEL, or mask interrupts"
            ),
            HardwareError::Stack { pointer } => {
                write!(f, "the stack pointer is {pointer:#06x}, which is below the RAM")
            }
            HardwareError::BadInstruction { after } => write!(
                f,
                "after {after:#06x} came what is no instruction, or an access beyond all memory: a lost stack, or a jump into data"
            ),
            HardwareError::NoClock { base } => {
                write!(
                    f,
                    "the peripheral at {base:#010x} is used while its clock is off: set its bit in RCC first"
                )
            }
            HardwareError::FlashWrite { address } => write!(
                f,
                "a write to {address:#010x} in the flash changes nothing: a pointer is null or points to a constant"
            ),
            HardwareError::DmaLocked { base } => write!(
                f,
                "the DMA controller at {base:#010x} has locked the registers of a stream that is on: clear EN and wait until it reads 0"
            ),
            HardwareError::DmaOutOfReach { address } => write!(
                f,
                "DMA cannot reach {address:#010x}: place the buffer at 0x20000000 or above, not in core-coupled memory"
            ),
        }
    }
}
