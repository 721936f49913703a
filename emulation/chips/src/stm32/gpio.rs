//! General-purpose inputs and outputs (RM0090 8, RM0091 8).

use super::bus::Write;

const MODER: u32 = 0x00;
const OTYPER: u32 = 0x04;
const OSPEEDR: u32 = 0x08;
const PUPDR: u32 = 0x0c;
const IDR: u32 = 0x10;
const ODR: u32 = 0x14;
const BSRR: u32 = 0x18;
const LCKR: u32 = 0x1c;
const AFRL: u32 = 0x20;
const AFRH: u32 = 0x24;
/// A register of the STM32F0 only; it is reserved and unused on the STM32F4.
const BRR: u32 = 0x28;

/// The registers of a port that are not zero after a reset.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PortReset {
    pub moder: u32,
    pub ospeedr: u32,
    pub pupdr: u32,
}

/// The output of a pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pin {
    /// The pin drives nothing: it is an input, analog, or an open drain that is off.
    Floating,
    /// The pin drives this level.
    Level(bool),
    /// The pin belongs to this alternate function.
    Alternate(u8),
}

/// A port of 16 pins.
pub struct GpioPort {
    after_reset: PortReset,
    moder: u32,
    otyper: u32,
    ospeedr: u32,
    pupdr: u32,
    odr: u32,
    lckr: u32,
    afr: [u32; 2],
    /// The pins that the board drives, and their levels.
    driven: u16,
    levels: u16,
}

impl GpioPort {
    pub(crate) fn new(after_reset: PortReset) -> Self {
        let PortReset { moder, ospeedr, pupdr } = after_reset;
        GpioPort {
            after_reset,
            moder,
            otyper: 0,
            ospeedr,
            pupdr,
            odr: 0,
            lckr: 0,
            afr: [0; 2],
            driven: 0,
            levels: 0,
        }
    }

    /// Sets the registers to their reset values; inputs that the board drives stay.
    pub(crate) fn reset(&mut self) {
        *self = GpioPort {
            driven: self.driven,
            levels: self.levels,
            ..GpioPort::new(self.after_reset)
        };
    }

    /// Drives `pin` from the board with this level.
    pub(crate) fn drive(&mut self, pin: u8, high: bool) {
        self.driven |= 1 << pin;
        self.levels = self.levels & !(1 << pin) | u16::from(high) << pin;
    }

    /// Returns the output of a pin.
    pub fn pin(&self, pin: u8) -> Pin {
        match self.moder >> (2 * pin) & 3 {
            1 => {
                let high = self.odr >> pin & 1 != 0;
                let open_drain = self.otyper >> pin & 1 != 0;
                if open_drain && high { Pin::Floating } else { Pin::Level(high) }
            }
            2 => Pin::Alternate((self.afr[usize::from(pin / 8)] >> (4 * (pin % 8)) & 0xf) as u8),
            _ => Pin::Floating,
        }
    }

    /// Returns the level at `pin`, as IDR and EXTI see it.
    pub fn level(&self, pin: u8) -> bool {
        match self.pin(pin) {
            Pin::Level(high) => high,
            _ if self.driven >> pin & 1 != 0 => self.levels >> pin & 1 != 0,
            // A pin that nothing drives is high with its pull-up and otherwise reads as low here.
            _ => self.pupdr >> (2 * pin) & 3 == 1,
        }
    }

    pub(crate) fn read(&self, offset: u32) -> u32 {
        match offset {
            MODER => self.moder,
            OTYPER => self.otyper,
            OSPEEDR => self.ospeedr,
            PUPDR => self.pupdr,
            // An analog pin reads 0 (8.3.12).
            IDR => (0..16)
                .filter(|pin| self.moder >> (2 * pin) & 3 != 3 && self.level(*pin))
                .fold(0, |levels, pin| levels | 1 << pin),
            ODR => self.odr,
            LCKR => self.lckr,
            AFRL => self.afr[0],
            AFRH => self.afr[1],
            _ => 0,
        }
    }

    pub(crate) fn write(&mut self, offset: u32, write: Write) {
        match offset {
            MODER => self.moder = write.merge(self.moder),
            OTYPER => self.otyper = write.merge(self.otyper) & 0xffff,
            OSPEEDR => self.ospeedr = write.merge(self.ospeedr),
            PUPDR => self.pupdr = write.merge(self.pupdr),
            ODR => self.odr = write.merge(self.odr) & 0xffff,
            // Setting has priority over resetting (8.4.7).
            BSRR => self.odr = self.odr & !(write.ones() >> 16) | write.ones() & 0xffff,
            BRR => self.odr &= !write.ones(),
            LCKR => self.lckr = write.merge(self.lckr),
            AFRL => self.afr[0] = write.merge(self.afr[0]),
            AFRH => self.afr[1] = write.merge(self.afr[1]),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Width;

    fn write(port: &mut GpioPort, offset: u32, value: u32) {
        port.write(offset, Write::new(offset, Width::Word, value));
    }

    /// A port whose pins are all inputs.
    fn port() -> GpioPort {
        GpioPort::new(PortReset { moder: 0, ospeedr: 0, pupdr: 0 })
    }

    #[test]
    fn a_pin_follows_its_mode() {
        let mut port = port();
        write(&mut port, BSRR, 1 << 3);
        assert_eq!(port.pin(3), Pin::Floating, "an input drives nothing");
        write(&mut port, MODER, 1 << 6);
        assert_eq!(port.pin(3), Pin::Level(true));
        write(&mut port, OTYPER, 1 << 3);
        assert_eq!(port.pin(3), Pin::Floating, "open drain");
        write(&mut port, BSRR, 1 << 19);
        assert_eq!(port.pin(3), Pin::Level(false));
        write(&mut port, MODER, 2 << 6);
        write(&mut port, AFRL, 8 << 12);
        assert_eq!(port.pin(3), Pin::Alternate(8));
    }

    #[test]
    fn set_wins_over_reset_and_bytes_leave_the_rest() {
        let mut port = port();
        write(&mut port, BSRR, 0x00ff_00ff);
        assert_eq!(port.read(ODR), 0xff);
        port.write(ODR, Write::new(ODR + 1, Width::Byte, 0x81));
        assert_eq!(port.read(ODR), 0x81ff);
        write(&mut port, BRR, 0x8001);
        assert_eq!(port.read(ODR), 0x01fe);
    }

    #[test]
    fn inputs_show_the_boards_level_or_the_pull_up() {
        let mut port = port();
        assert_eq!(port.read(IDR) >> 4 & 1, 0);
        write(&mut port, PUPDR, 1 << 8);
        assert_eq!(port.read(IDR) >> 4 & 1, 1);
        port.drive(4, false);
        assert_eq!(port.read(IDR) >> 4 & 1, 0);
    }
}
