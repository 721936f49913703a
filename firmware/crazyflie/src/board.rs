//! The check of the board. Bitcraze sells several boards with the same chip, bootloader and radio.
//! On some of them the same pins drive other motors, which this firmware must not drive.
//!
//! The device type is in the chip's one-time programmable memory: a text such as `0;CF21`, in the
//! first of 16 slots that was not overwritten with zeros. A chip without a device type is that of
//! an early Crazyflie 2.0 (crazyflie-firmware, platform_stm32f4.c and platform.c).

use core::hint::black_box;

use defmt::intern;

/// The slots of the one-time programmable memory (RM0090 3.8).
const SLOTS: *const [[u8; SLOT]; 16] = 0x1fff_7800 as _;
const SLOT: usize = 32;

/// The maximum length of a reported device type, in bytes.
const DEVICE_TYPE_MAX: usize = 8;

/// A board whose motors this firmware does not know.
#[derive(Clone, Copy)]
pub struct OtherBoard {
    device_type: &'static [u8],
}

impl defmt::Format for OtherBoard {
    fn format(&self, f: defmt::Formatter<'_>) {
        // The names are those of crazyflie-firmware (platform_bolt.c, platform_cf21bl.c and
        // platform_tag.c).
        let name = match self.device_type {
            b"C21B" => intern!("a Crazyflie 2.1 Brushless"),
            b"CB10" | b"RZ10" => intern!("a Crazyflie Bolt"),
            b"CB11" => intern!("a Crazyflie Bolt 1.1"),
            b"RR10" => intern!("a Roadrunner"),
            _ => intern!("an unknown board"),
        };
        let shown = self.device_type.get(..DEVICE_TYPE_MAX).unwrap_or(self.device_type);
        defmt::write!(f, "{=istr} (device type {=[u8]:a})", name, shown);
    }
}

/// Returns an error if the board has other motors than a Crazyflie 2.0, 2.1 or 2.1+, or is unknown.
pub fn check() -> Result<(), OtherBoard> {
    // SAFETY: this is memory of the chip, which is not written while the program runs.
    let slots: &'static [[u8; SLOT]; 16] = unsafe { &*black_box(SLOTS) };
    let slot = slots.iter().find(|slot| slot.first() != Some(&0));
    let Some(slot) = slot.filter(|slot| slot.first() != Some(&0xff)) else {
        return Ok(());
    };
    let until =
        |text: &'static [u8], end: u8| text.split(|byte| *byte == end).next().unwrap_or(text);
    let text = until(slot, 0);
    match text.strip_prefix(b"0;").map_or(text, |rest| until(rest, b';')) {
        b"CF20" | b"CF21" => Ok(()),
        device_type => Err(OtherBoard { device_type }),
    }
}
