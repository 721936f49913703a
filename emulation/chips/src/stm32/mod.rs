//! Peripherals that several types of STM32 share, and the types of an access by the core.

mod bus;
mod errors;
mod exti;
mod gpio;
pub(crate) mod rcc;
mod timer;
mod transfer;
pub(crate) mod watchdog;

pub(crate) use self::bus::Write;
pub use self::bus::{Lines, Width};
pub(crate) use self::errors::ErrorLog;
pub(crate) use self::exti::Exti;
pub(crate) use self::gpio::PortReset;
pub use self::gpio::{GpioPort, Pin};
pub(crate) use self::timer::TimerKind;
pub use self::timer::{Pwm, Timer};
pub use self::transfer::Transfer;
pub(crate) use self::watchdog::Watchdog;
