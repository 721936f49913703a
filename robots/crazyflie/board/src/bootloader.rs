//! A model of Bitcraze's bootloader of the STM32, which runs before the firmware after every reset
//! (crazyflie2-stm-bootloader, commit c79feab). The model has the bootloader's effects, not its
//! code, which has another license.
//!
//! The bootloader's start-up code copies `.data` and clears `.bss`. `SystemInit` then turns on
//! crystal and PLL. `main` samples two pins that the radio's processor drives, decides which
//! program runs, resets the two ports and sets VTOR. On the chip this takes about 3 ms, most of
//! them for the crystal; here it takes no time.

use bittybuzz_chips::f405::F405;
use bittybuzz_chips::{Bootloader, Random, Width};

/// First address of the flash sector after the bootloader, where the firmware begins.
pub(crate) const FIRMWARE: u32 = 0x0800_4000;

/// Start of `.data`, start of `.bss`, and the end of both in the bootloader's ELF file. From there
/// to the first stack pointer, the bootloader's stack may have left any content.
const DATA: u32 = 0x2000_0000;
const BSS: u32 = 0x2000_0014;
const BSS_END: u32 = 0x2000_2878;
const STACK_END: u32 = 0x2000_5000;

const RCC_CR: u32 = 0x4002_3800;
const RCC_PLLCFGR: u32 = 0x4002_3804;
const RCC_CFGR: u32 = 0x4002_3808;
const RCC_APB1ENR: u32 = 0x4002_3840;
const PWR_CR: u32 = 0x4000_7000;
const FLASH_ACR: u32 = 0x4002_3c00;

const CR_HSEON: u32 = 1 << 16;
const CR_HSERDY: u32 = 1 << 17;
const CR_PLLON: u32 = 1 << 24;
const APB1ENR_PWREN: u32 = 1 << 28;
const PWR_CR_VOS: u32 = 1 << 14;
/// APB1 / 4, APB2 / 2.
const CFGR_PRESCALERS: u32 = 0b101 << 10 | 0b100 << 13;
const CFGR_SW_PLL: u32 = 2;
/// PLL: 8 MHz / 8 * 336 / 2 for the core, and / 7 for USB.
const PLLCFGR: u32 = 8 | 336 << 6 | 1 << 22 | 7 << 24;
/// Instruction and data cache on, five wait states.
const ACR: u32 = 1 << 9 | 1 << 10 | 5;

/// Returns the memory that the bootloader overwrites, with the new content.
pub(crate) fn overwritten(noise: &mut Random) -> Vec<(u32, Vec<u8>)> {
    let mut random = |length: u32| (0..length).map(|_| noise.bits() as u8).collect();
    vec![
        (DATA, random(BSS - DATA)),
        (BSS, vec![0; (BSS_END - BSS) as usize]),
        (BSS_END, random(STACK_END - BSS_END)),
    ]
}

/// Applies the effects of `SystemInit`, which waits for the crystal for a limited time. Without a
/// crystal the core stays at HSI's 16 MHz.
pub(crate) fn set_clocks(f405: &mut F405) {
    let set = |f405: &mut F405, address: u32, bits: u32| {
        let value = f405.read(address, Width::Word);
        f405.write(address, Width::Word, value | bits);
    };
    set(f405, RCC_CR, CR_HSEON);
    if f405.read(RCC_CR, Width::Word) & CR_HSERDY == 0 {
        return;
    }
    set(f405, RCC_APB1ENR, APB1ENR_PWREN);
    set(f405, PWR_CR, PWR_CR_VOS);
    set(f405, RCC_CFGR, CFGR_PRESCALERS);
    f405.write(RCC_PLLCFGR, Width::Word, PLLCFGR);
    set(f405, RCC_CR, CR_PLLON);
    f405.write(FLASH_ACR, Width::Word, ACR);
    set(f405, RCC_CFGR, CFGR_SW_PLL);
}

/// Returns the loader that starts instead of the firmware, for the levels of PC7, the radio
/// processor's line, and PA4, its flow control. Both pins are pulled down, so that an unconnected
/// processor reads as low.
pub(crate) fn loader(line_is_high: bool, flow_control_is_high: bool) -> Option<Bootloader> {
    match (line_is_high, flow_control_is_high) {
        (true, false) => None,
        (false, false) => Some(Bootloader::Dfu),
        (_, true) => Some(Bootloader::Crtp),
    }
}
