//! The chip's registers.

use avr_device::atmega328p::{AC, ADC, CPU, EEPROM, PORTB, PORTC, PORTD, TC0, TC1, TC2, USART0};

/// The registers that the programs use. A value of this type takes no memory.
///
/// avr-device's `Peripherals` would record in memory that they are taken.
#[allow(non_snake_case, reason = "the data sheet's names")]
#[allow(dead_code, reason = "each program uses others")]
pub struct Chip {
    pub AC: AC,
    pub ADC: ADC,
    pub CPU: CPU,
    pub EEPROM: EEPROM,
    pub PORTB: PORTB,
    pub PORTC: PORTC,
    pub PORTD: PORTD,
    pub TC0: TC0,
    pub TC1: TC1,
    pub TC2: TC2,
    pub USART0: USART0,
}

/// Returns access to the chip's registers.
#[inline(always)]
pub fn registers() -> Chip {
    // SAFETY: one module uses each register. Registers that interrupts use as well are only
    // accessed with interrupts off.
    unsafe {
        Chip {
            AC: AC::steal(),
            ADC: ADC::steal(),
            CPU: CPU::steal(),
            EEPROM: EEPROM::steal(),
            PORTB: PORTB::steal(),
            PORTC: PORTC::steal(),
            PORTD: PORTD::steal(),
            TC0: TC0::steal(),
            TC1: TC1::steal(),
            TC2: TC2::steal(),
            USART0: USART0::steal(),
        }
    }
}
