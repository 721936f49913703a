//! The RGB LED. A lamp is on while its pin is an output (low), and off while the pin is an input.

use bittybuzz_kilobot::light::Color;

use crate::chip::Chip;

/// Shows a color: green at PC3 and PC2, blue at PC5 and PC4, red at PD5 and PD4.
#[inline(never)]
pub fn show(chip: &Chip, color: Color) {
    let bits = swapped(color.bits);
    // SAFETY: the pins belong to the lamps.
    unsafe {
        chip.PORTC.ddrc().modify(|r, w| w.bits(r.bits() & !0b0011_1100 | bits & 0b0011_1100));
        chip.PORTD.ddrd().modify(|r, w| w.bits(r.bits() & !0b0011_0000 | (bits & 0b0011) << 4));
    }
}

/// Swaps the bits of each pair, since the lower bit lights the higher pin.
fn swapped(bits: u8) -> u8 {
    (bits & 0b0101_0101) << 1 | (bits >> 1) & 0b0101_0101
}
