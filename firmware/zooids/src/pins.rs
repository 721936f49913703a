//! The pins of the peripherals with drivers of this firmware's own (board v1.3), and the clocks of
//! these peripherals. A driver knows its pins by the numbers here. Each of these drivers states the
//! cost of embassy-stm32's driver.
//!
//! The other pins use embassy-stm32's [`Input`](embassy_stm32::gpio::Input) and
//! [`Output`](embassy_stm32::gpio::Output): the radio's CSN and CE, the charger, and the change
//! line of the touch sensor. These four take 0.5 kB more than rows in the table below. Receiving
//! eight messages takes 37,900 cycles instead of 36,200, since CSN goes low and high twice for
//! each.

use Use::{Alternate, Bus, Captured, Fast, Input};
use embassy_stm32::pac;
use embassy_stm32::pac::gpio::Gpio;

/// The use of a pin.
#[derive(Clone, Copy)]
enum Use {
    /// An input with an external driver.
    Input,
    /// An output of a peripheral; the number is that of the alternate function (data sheet of the
    /// STM32F051, tables 14 and 15).
    Alternate(u32),
    /// An output of a peripheral for more than 2 MHz.
    Fast(u32),
    /// An open-drain output of a peripheral, which only pulls low.
    Bus(u32),
    /// An input of a peripheral, with a pull-up resistor.
    Captured(u32),
}

/// The radio's interrupt line on port A, low when there is an event.
pub const RADIO_IRQ: usize = 15;
/// The photodiodes on port B, high when lit.
pub const RIGHT: usize = 9;
pub const LEFT: usize = 1;
/// The bus of the touch sensor on port B.
pub const SCL: usize = 10;
pub const SDA: usize = 11;
/// The inputs of the motors' bridges on port A, in order.
pub const MOTORS: core::ops::Range<usize> = 0..4;

const PORT_A: Port = Port::of(&[
    // TIM2, channels 1 to 4.
    (MOTORS.start, Alternate(2)),
    (MOTORS.start + 1, Alternate(2)),
    (MOTORS.start + 2, Alternate(2)),
    (MOTORS.start + 3, Alternate(2)),
    // SPI1: SCK, MISO, MOSI.
    (5, Fast(0)),
    (6, Fast(0)),
    (7, Fast(0)),
    // The radio's clock, MCO.
    (8, Fast(0)),
    // TIM1, channels 2 to 4: blue, red, green.
    (9, Alternate(2)),
    (10, Alternate(2)),
    (11, Alternate(2)),
    (RADIO_IRQ, Input),
]);

const PORT_B: Port = Port::of(&[
    // TIM3, channel 4.
    (LEFT, Captured(1)),
    // TIM17, channel 1.
    (RIGHT, Captured(2)),
    // I2C2.
    (SCL, Bus(1)),
    (SDA, Bus(1)),
]);

/// The values of a port's registers (RM0091 8.4).
struct Port {
    moder: u32,
    otyper: u32,
    ospeedr: u32,
    pupdr: u32,
    afr: [u32; 2],
    /// A mask with two bits for each pin that is used.
    used: u32,
}

impl Port {
    const fn of(pins: &[(usize, Use)]) -> Port {
        let mut port = Port { moder: 0, otyper: 0, ospeedr: 0, pupdr: 0, afr: [0; 2], used: 0 };
        let mut index = 0;
        while index < pins.len() {
            let (pin, usage) = pins[index];
            let two = 2 * pin;
            port.used |= 3 << two;
            match usage {
                Input => {}
                Alternate(number) | Fast(number) | Bus(number) | Captured(number) => {
                    port.moder |= 2 << two;
                    port.afr[pin / 8] |= number << (4 * (pin % 8));
                    if matches!(usage, Fast(_)) {
                        port.ospeedr |= 3 << two;
                    }
                    if matches!(usage, Bus(_)) {
                        port.otyper |= 1 << pin;
                    }
                    if matches!(usage, Captured(_)) {
                        port.pupdr |= 1 << two;
                    }
                }
            }
            index += 1;
        }
        port
    }

    /// Writes the registers. Pins that are not in the table, such as the debugger's, stay as they
    /// are.
    fn set(&self, gpio: Gpio) {
        gpio.otyper().modify(|w| w.0 |= self.otyper);
        gpio.ospeedr().modify(|w| w.0 |= self.ospeedr);
        gpio.pupdr().modify(|w| w.0 |= self.pupdr);
        for (index, functions) in self.afr.into_iter().enumerate() {
            gpio.afr(index).modify(|w| w.0 |= functions);
        }
        gpio.moder().modify(|w| w.0 = w.0 & !self.used | self.moder);
    }
}

/// Connects all pins of the tables, and turns the peripherals' clocks on. The clocks of the ports
/// are on already.
pub fn connect() {
    pac::RCC.ahbenr().modify(|w| w.set_dmaen(true));
    pac::RCC.apb1enr().modify(|w| {
        w.set_tim2en(true);
        w.set_i2c2en(true);
    });
    pac::RCC.apb2enr().modify(|w| {
        w.set_syscfgen(true);
        w.set_adcen(true);
        w.set_tim1en(true);
        w.set_spi1en(true);
        w.set_tim17en(true);
    });
    PORT_A.set(pac::GPIOA);
    PORT_B.set(pac::GPIOB);
}

/// Returns true if a pin is high.
pub fn is_high(gpio: Gpio, pin: usize) -> bool {
    gpio.idr().read().0 & 1 << pin != 0
}
