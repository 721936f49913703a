//! The registers of the core: the system control block and its neighbors (ARMv7-M B3.2).

use bittybuzz_chips::{Board, CoreKind, Width};
use bittybuzz_cortex_m::registers::{
    AIRCR, CCR, CPUID, ICSR, NVIC, NVIC_END, SCR, SHPR1, SHPR2, SHPR3, SYST, SYST_END,
    VECTKEY_READ, VTOR, cpuid, has_key, requests_reset,
};

use crate::system::System;

const DWT_CTRL: u32 = 0xe000_1000;
const DWT_CYCCNT: u32 = 0xe000_1004;
const SHCSR: u32 = 0xe000_ed24;
const CFSR: u32 = 0xe000_ed28;
const HFSR: u32 = 0xe000_ed2c;
const MMFAR: u32 = 0xe000_ed34;
const BFAR: u32 = 0xe000_ed38;
const CPACR: u32 = 0xe000_ed88;
const MPU_TYPE: u32 = 0xe000_ed90;
const MPU_CTRL: u32 = 0xe000_ed94;
const DHCSR: u32 = 0xe000_edf0;
const DEMCR: u32 = 0xe000_edfc;
const STIR: u32 = 0xe000_ef00;
const FPCCR: u32 = 0xe000_ef34;
/// DBGMCU belongs to the chip, not to the core.
const DBGMCU: u32 = 0xe004_2000;
const DBGMCU_END: u32 = 0xe004_2400;

const DWT_CTRL_CYCCNTENA: u32 = 1 << 0;
/// Vector tables are aligned to 128 bytes at least.
const VTOR_BITS: u32 = 0xffff_ff80;

/// Registers that only hold values that the firmware wrote or a fault set.
pub struct PrivateRegisters {
    pub vtor: u32,
    pub scr: u32,
    pub ccr: u32,
    pub shcsr: u32,
    pub cfsr: u32,
    pub hfsr: u32,
    pub mmfar: u32,
    pub bfar: u32,
    cpacr: u32,
    demcr: u32,
    dwt_ctrl: u32,
    /// The value of `cycles` at which CYCCNT was zero.
    dwt_zero: u64,
    fpccr: u32,
    pub reset_requested: bool,
}

impl PrivateRegisters {
    pub const SCR_SEVONPEND: u32 = 1 << 4;
    pub const SCR_SLEEPONEXIT: u32 = 1 << 1;

    pub fn new() -> Self {
        PrivateRegisters {
            vtor: 0,
            scr: 0,
            // STKALIGN: frames are aligned to eight bytes.
            ccr: 1 << 9,
            shcsr: 0,
            cfsr: 0,
            hfsr: 0,
            mmfar: 0,
            bfar: 0,
            cpacr: 0,
            demcr: 0,
            dwt_ctrl: 0x4000_0000,
            dwt_zero: 0,
            // ASPEN and LSPEN.
            fpccr: 0xc000_0000,
            reset_requested: false,
        }
    }
}

/// Returns true if a Cortex-M0 has this register. It has no vector table offset, no fault status
/// and no cycle counter (ARMv6-M B3.2.2).
fn is_in_armv6m(address: u32) -> bool {
    matches!(
        address,
        SYST..SYST_END
            | NVIC..NVIC_END
            | CPUID
            | ICSR
            | AIRCR
            | SCR
            | CCR
            | SHPR2..=SHPR3
            | SHCSR
    )
}

impl<B: Board> System<B> {
    /// Performs a read of the core from its private bus, 0xe000_0000 to 0xe00f_ffff.
    pub fn read_private(&mut self, address: u32, width: Width) -> u32 {
        if (DBGMCU..DBGMCU_END).contains(&address) {
            return self.board.read(address, width);
        }
        self.read_private_word(address & !3) >> ((address & 3) * 8)
    }

    fn read_private_word(&mut self, address: u32) -> u32 {
        if B::CORE == CoreKind::CortexM0 && !is_in_armv6m(address) {
            return 0;
        }
        let registers = &mut self.registers;
        match address {
            DWT_CTRL => registers.dwt_ctrl,
            DWT_CYCCNT if registers.dwt_ctrl & DWT_CTRL_CYCCNTENA != 0 => {
                self.cycles.wrapping_sub(registers.dwt_zero) as u32
            }
            SYST..SYST_END => {
                self.advance_systick();
                self.systick.read(address - SYST)
            }
            NVIC..NVIC_END => self.nvic.read(address - NVIC),
            CPUID => cpuid(B::CORE),
            ICSR => self.nvic.read_icsr(),
            VTOR => registers.vtor,
            AIRCR => VECTKEY_READ | u32::from(self.nvic.group()) << 8,
            SCR => registers.scr,
            CCR => registers.ccr,
            SHPR1..=SHPR3 => self.nvic.read_priorities(4 + (address - SHPR1) as usize),
            SHCSR => registers.shcsr,
            CFSR => registers.cfsr,
            HFSR => registers.hfsr,
            MMFAR => registers.mmfar,
            BFAR => registers.bfar,
            CPACR => registers.cpacr,
            // The MPU has eight regions.
            MPU_TYPE => 0x800,
            // C_DEBUGEN.
            DHCSR => u32::from(self.board.is_debugged()),
            DEMCR => registers.demcr,
            FPCCR => registers.fpccr,
            _ => 0,
        }
    }

    /// Performs a write of the core to its private bus.
    pub fn write_private(&mut self, address: u32, width: Width, value: u32) {
        if (DBGMCU..DBGMCU_END).contains(&address) {
            return self.board.write(address, width, value);
        }
        let shift = (address & 3) * 8;
        let mask = match width {
            Width::Byte => 0xff << shift,
            Width::Half => 0xffff << shift,
            Width::Word => !0,
        };
        self.write_private_word(address & !3, value << shift, mask);
    }

    fn write_private_word(&mut self, address: u32, value: u32, mask: u32) {
        if B::CORE == CoreKind::CortexM0 && !is_in_armv6m(address) {
            return;
        }
        let registers = &mut self.registers;
        let merge = |old: u32| old & !mask | value & mask;
        match address {
            DWT_CTRL => {
                // The counter starts from zero whenever it is turned on.
                if registers.dwt_ctrl & DWT_CTRL_CYCCNTENA == 0 {
                    registers.dwt_zero = self.cycles;
                }
                registers.dwt_ctrl = merge(registers.dwt_ctrl);
            }
            DWT_CYCCNT => registers.dwt_zero = self.cycles.wrapping_sub(u64::from(value)),
            SYST..SYST_END => {
                self.advance_systick();
                self.systick.write(address - SYST, value);
            }
            NVIC..NVIC_END => self.nvic.write(address - NVIC, value, mask),
            ICSR => self.nvic.write_icsr(value),
            VTOR => registers.vtor = value & VTOR_BITS,
            AIRCR if has_key(value) => {
                self.nvic.set_group((value >> 8 & 7) as u8);
                registers.reset_requested |= requests_reset(value);
            }
            SCR => registers.scr = merge(registers.scr),
            CCR => registers.ccr = merge(registers.ccr),
            SHPR1..=SHPR3 => {
                self.nvic.write_priorities(4 + (address - SHPR1) as usize, value, mask);
            }
            SHCSR => registers.shcsr = merge(registers.shcsr),
            // Flags are cleared by writing ones.
            CFSR => registers.cfsr &= !(value & mask),
            HFSR => registers.hfsr &= !(value & mask),
            CPACR => registers.cpacr = merge(registers.cpacr),
            MPU_CTRL if value & mask & 1 != 0 => self.note_mpu(),
            DEMCR => registers.demcr = merge(registers.demcr),
            STIR => self.nvic.pend_interrupt(value & 0x1ff),
            FPCCR => registers.fpccr = merge(registers.fpccr),
            _ => {}
        }
    }
}
