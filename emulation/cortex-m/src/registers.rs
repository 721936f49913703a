//! Addresses of the core's registers (ARMv7-M B3.2), and the values that are equal in all
//! emulators.

use bittybuzz_chips::CoreKind;

/// First address of SysTick.
pub const SYST: u32 = 0xe000_e010;
/// The first address beyond SysTick.
pub const SYST_END: u32 = 0xe000_e020;
/// Address of NVIC_ISER; offsets in [`Nvic::read`](crate::Nvic::read) count from here.
pub const NVIC: u32 = 0xe000_e100;
/// The first address beyond NVIC_IPR.
pub const NVIC_END: u32 = 0xe000_e4f0;
/// CPUID: processor and revision.
pub const CPUID: u32 = 0xe000_ed00;
/// Interrupt control and state register.
pub const ICSR: u32 = 0xe000_ed04;
/// Vector table offset register, which a Cortex-M0 lacks.
pub const VTOR: u32 = 0xe000_ed08;
/// Application interrupt and reset control register.
pub const AIRCR: u32 = 0xe000_ed0c;
/// System control register.
pub const SCR: u32 = 0xe000_ed10;
/// Configuration and control register.
pub const CCR: u32 = 0xe000_ed14;
/// Priorities of exceptions 4 to 7, which a Cortex-M0 lacks.
pub const SHPR1: u32 = 0xe000_ed18;
/// Priorities of exceptions 8 to 11.
pub const SHPR2: u32 = 0xe000_ed1c;
/// Priorities of exceptions 12 to 15.
pub const SHPR3: u32 = 0xe000_ed20;

/// The value of a read of AIRCR, without the priority grouping.
pub const VECTKEY_READ: u32 = 0xfa05 << 16;
const VECTKEY: u32 = 0x05fa << 16;
const SYSRESETREQ: u32 = 1 << 2;

/// Returns true if a write to AIRCR has the key; a write without it has no effect.
pub const fn has_key(aircr: u32) -> bool {
    aircr & 0xffff_0000 == VECTKEY
}

/// Returns true if a write to AIRCR resets the chip.
pub const fn requests_reset(aircr: u32) -> bool {
    has_key(aircr) && aircr & SYSRESETREQ != 0
}

/// Returns CPUID: Cortex-M0, revision r0p0 (DDI 0432 4.1.1); Cortex-M4, revision r0p1.
pub const fn cpuid(core: CoreKind) -> u32 {
    match core {
        CoreKind::CortexM0 => 0x410c_c200,
        CoreKind::CortexM4F => 0x410f_c241,
    }
}
