//! The core: Unicorn, its memory map, and the reasons why it stops.

use bittybuzz_chips::{Board, CoreKind, MemoryMap, Time, Width};
use bittybuzz_cortex_m::Masks;
use bittybuzz_emulation::MachineError;
use unicorn_engine::{
    Arch, HookType, MemType, Mode, Prot, RegisterARM as Register, TlbEntry, TlbType, Unicorn,
    uc_error,
};

use crate::blocks::CodeBlock;
use crate::memory::is_within;
use crate::system::System;

pub const FLASH: u32 = 0x0800_0000;
/// The flash is also mapped at address 0 when the chip boots from it (RM0090 2.4).
pub const FLASH_ALIAS: u32 = 0;
pub const SRAM: u32 = 0x2000_0000;
/// Core-coupled memory, which cannot hold code.
pub const CCM: u32 = 0x1000_0000;
/// First address and size of the private bus.
const PRIVATE: (u32, u64) = (0xe000_0000, 0x10_0000);
/// The Thumb bit of xPSR.
pub const XPSR_T: u32 = 1 << 24;
/// An address at which nothing ever runs. Unicorn requires an address at which to stop.
const NOWHERE: u64 = 0x0fff_fffe;

/// The reason why Unicorn stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnicornStop {
    /// The deadline was reached.
    Deadline,
    WaitForEvent,
    WaitForInterrupt,
    /// An exception return, with the value that was branched to.
    Return(u32),
    SupervisorCall,
    Breakpoint,
    Undefined,
    InvalidState,
    NoCoprocessor,
    Unaligned,
    /// A fetch from an address without executable memory.
    BadFetch,
    BadAccess,
    /// A write of a halfword to the flash.
    FlashWrite,
}

/// A Cortex-M4F or Cortex-M0, as the board requires.
pub struct UnicornCore<'a, B: Board + 'static> {
    pub(crate) uc: Unicorn<'a, System<B>>,
}

/// Wraps an error of Unicorn that no firmware can cause.
pub fn failed(error: uc_error) -> MachineError {
    MachineError::Emulation(format!("Unicorn: {error:?}"))
}

impl<B: Board> UnicornCore<'_, B> {
    /// Creates the core of robot `number` of several, with erased flash.
    pub(crate) fn new(number: usize) -> Result<Self, MachineError> {
        let mode = Mode::THUMB | Mode::MCLASS;
        let mut uc =
            Unicorn::new_with_data(Arch::ARM, mode, System::<B>::new(number)).map_err(failed)?;
        map(&mut uc).and_then(|()| hook(&mut uc)).map_err(failed)?;
        let mut core = UnicornCore { uc };
        let erased = vec![0xff; B::MEMORY.flash as usize];
        core.write_bytes(FLASH, &erased)?;
        Ok(core)
    }

    /// Copies the read-only memory from the board, which changes it only at a reset.
    pub(crate) fn copy_read_only(&mut self) -> Result<(), MachineError> {
        for (base, size) in B::MEMORY.read_only {
            let board = &mut self.system().board;
            let words = (0..*size / 4).map(|word| board.read(base + 4 * word, Width::Word));
            let bytes: Vec<u8> = words.flat_map(u32::to_le_bytes).collect();
            self.uc.mem_write(u64::from(*base), &bytes).map_err(failed)?;
        }
        Ok(())
    }

    pub(crate) fn system(&mut self) -> &mut System<B> {
        self.uc.get_data_mut()
    }

    pub(crate) fn register(&self, register: Register) -> Result<u32, MachineError> {
        self.uc.reg_read(register).map(|value| value as u32).map_err(failed)
    }

    pub(crate) fn set_register(
        &mut self,
        register: Register,
        value: u32,
    ) -> Result<(), MachineError> {
        self.uc.reg_write(register, u64::from(value)).map_err(failed)
    }

    pub(crate) fn masks(&self) -> Result<Masks, MachineError> {
        read_masks(&self.uc).map_err(failed)
    }

    /// Writes memory; the flash is written through both of its addresses.
    pub(crate) fn write_bytes(&mut self, address: u32, bytes: &[u8]) -> Result<(), MachineError> {
        Self::check_memory(address, bytes.len())?;
        let flash = (FLASH..FLASH + B::MEMORY.flash).contains(&address);
        self.uc.mem_write(u64::from(address), bytes).map_err(failed)?;
        if flash {
            let alias = address - FLASH + FLASH_ALIAS;
            self.uc.mem_write(u64::from(alias), bytes).map_err(failed)?;
            self.uc.ctl_flush_tb().map_err(failed)?;
            self.system().blocks.clear();
        }
        Ok(())
    }

    pub(crate) fn read_bytes(&self, address: u32, bytes: &mut [u8]) -> Result<(), MachineError> {
        Self::check_memory(address, bytes.len())?;
        self.uc.mem_read(u64::from(address), bytes).map_err(failed)
    }

    /// Reads a word as the core does when it takes an exception; none where there is no memory.
    pub(crate) fn read_word(&self, address: u32) -> Option<u32> {
        if !is_within(address, 4, FLASH_ALIAS, B::MEMORY.flash) {
            Self::check_memory(address, 4).ok()?;
        }
        let mut bytes = [0; 4];
        self.uc.mem_read(u64::from(address), &mut bytes).ok()?;
        Some(u32::from_le_bytes(bytes))
    }

    /// Executes from the present PC until the core stops, at the latest at `deadline`.
    pub(crate) fn emulate(&mut self, deadline: Time) -> Result<UnicornStop, MachineError> {
        self.system().begin(deadline);
        let pc = self.register(Register::PC)?;
        let result = self.uc.emu_start(u64::from(pc | 1), NOWHERE, 0, 0);
        let system = self.uc.get_data();
        if let Some(interrupt) = system.interrupt {
            return self.interrupted(interrupt);
        }
        match result {
            Ok(()) if system.undefined => Ok(UnicornStop::Undefined),
            Ok(()) if system.stopped => Ok(UnicornStop::Deadline),
            Ok(()) => Ok(UnicornStop::WaitForInterrupt),
            // Unicorn reports WFE as an invalid instruction, after its execution. It also reports
            // any instruction without the Thumb bit as invalid.
            Err(uc_error::INSN_INVALID) => {
                let done = self.register(Register::PC)? == system.block_end;
                Ok(if done && system.block.waits_for_event {
                    UnicornStop::WaitForEvent
                } else if self.register(Register::XPSR)? & XPSR_T == 0 {
                    UnicornStop::InvalidState
                } else {
                    UnicornStop::Undefined
                })
            }
            Err(uc_error::FETCH_UNMAPPED | uc_error::FETCH_PROT) => Ok(UnicornStop::BadFetch),
            Err(uc_error::WRITE_PROT) if self.is_flash_write() => Ok(UnicornStop::FlashWrite),
            Err(
                uc_error::READ_UNMAPPED
                | uc_error::READ_PROT
                | uc_error::WRITE_UNMAPPED
                | uc_error::WRITE_PROT,
            ) => Ok(UnicornStop::BadAccess),
            Err(uc_error::READ_UNALIGNED | uc_error::WRITE_UNALIGNED) => Ok(UnicornStop::Unaligned),
            Err(error) => Err(failed(error)),
        }
    }

    fn interrupted(&self, interrupt: u32) -> Result<UnicornStop, MachineError> {
        // The numbers are those of QEMU's target/arm/cpu.h.
        Ok(match interrupt {
            2 => UnicornStop::SupervisorCall,
            3 => UnicornStop::BadFetch,
            4 => UnicornStop::BadAccess,
            7 => UnicornStop::Breakpoint,
            // Bit 0 of the branch's target has become the Thumb bit; it is always 1 in these
            // values.
            8 => UnicornStop::Return(self.register(Register::PC)? | 1),
            17 => UnicornStop::NoCoprocessor,
            22 => UnicornStop::Unaligned,
            _ => UnicornStop::Undefined,
        })
    }

    /// Sets the core's registers to their values after a reset, for the program whose vectors are
    /// at `vectors`.
    pub(crate) fn reset_registers(&mut self, vectors: u32) -> Result<(), MachineError> {
        self.set_register(Register::CONTROL, 0)?;
        self.set_register(Register::XPSR_NZCVQG, XPSR_T)?;
        for register in [Register::PRIMASK, Register::BASEPRI, Register::FAULTMASK] {
            self.set_register(register, 0)?;
        }
        self.set_register(Register::LR, 0xffff_ffff)?;
        // The addresses are mapped, because Image::vectors is in flash.
        self.set_register(Register::MSP, self.read_word(vectors).unwrap_or(0) & !3)?;
        self.set_register(Register::PC, self.read_word(vectors + 4).unwrap_or(0) | 1)
    }
}

fn read_masks<B: Board>(uc: &Unicorn<'_, System<B>>) -> Result<Masks, uc_error> {
    Ok(Masks {
        primask: uc.reg_read(Register::PRIMASK)? != 0,
        faultmask: uc.reg_read(Register::FAULTMASK)? != 0,
        basepri: uc.reg_read(Register::BASEPRI)? as u8,
    })
}

fn map<B: Board>(uc: &mut Unicorn<'_, System<B>>) -> Result<(), uc_error> {
    for start in [FLASH, FLASH_ALIAS] {
        uc.mem_map(u64::from(start), u64::from(B::MEMORY.flash), Prot::READ | Prot::EXEC)?;
    }
    uc.mem_map(u64::from(SRAM), u64::from(B::MEMORY.ram), Prot::ALL)?;
    if B::MEMORY.ccm > 0 {
        uc.mem_map(u64::from(CCM), u64::from(B::MEMORY.ccm), Prot::READ | Prot::WRITE)?;
    }
    for (base, size) in B::MEMORY.peripherals.iter().copied() {
        uc.mmio_map(
            u64::from(base),
            u64::from(size),
            Some(move |uc: &mut Unicorn<'_, System<B>>, offset: u64, size: usize| {
                let width = Width::from_bytes(size).unwrap_or(Width::Word);
                u64::from(uc.get_data_mut().read(base + offset as u32, width))
            }),
            Some(move |uc: &mut Unicorn<'_, System<B>>, offset: u64, size: usize, value: u64| {
                let width = Width::from_bytes(size).unwrap_or(Width::Word);
                uc.get_data_mut().write(base + offset as u32, width, value as u32);
            }),
        )?;
    }
    for (base, size) in B::MEMORY.read_only {
        uc.mem_map(u64::from(*base), u64::from(*size), Prot::READ)?;
    }
    let (base, size) = PRIVATE;
    uc.mmio_map(
        u64::from(base),
        size,
        Some(move |uc: &mut Unicorn<'_, System<B>>, offset: u64, size: usize| {
            let width = Width::from_bytes(size).unwrap_or(Width::Word);
            u64::from(uc.get_data_mut().read_private(base + offset as u32, width))
        }),
        Some(move |uc: &mut Unicorn<'_, System<B>>, offset: u64, size: usize, value: u64| {
            let width = Width::from_bytes(size).unwrap_or(Width::Word);
            let system = uc.get_data_mut();
            system.write_private(base + offset as u32, width, value as u32);
            system.after_access();
        }),
    )
}

fn hook<B: Board>(uc: &mut Unicorn<'_, System<B>>) -> Result<(), uc_error> {
    uc.add_block_hook(1, 0, |uc, address, size| begin_block(uc, address as u32, size))?;
    uc.add_intr_hook(|uc, interrupt| {
        uc.get_data_mut().interrupt = Some(interrupt);
        let _ = uc.emu_stop();
    })?;
    // Unicorn's own page table makes all data executable, and then checks every write.
    uc.ctl_set_tlb_type(TlbType::VIRTUAL)?;
    uc.add_tlb_hook(1, 0, enter_page)?;
    for (first, last) in not_ram(&B::MEMORY) {
        uc.add_mem_hook(
            HookType::MEM_INVALID,
            first,
            last,
            |uc, kind: MemType, address, size, value| {
                let address = address as u32;
                if kind == MemType::WRITE_PROT && writes_ignored_flash::<B>(address) {
                    write_flash(uc, address, value as u16);
                    return true;
                }
                let system = uc.get_data_mut();
                system.failed_address = address;
                system.failed_write = (size, value as u32);
                false
            },
        )?;
    }
    Ok(())
}

/// Returns true if a write at this address is one to the flash of an STM32F4. On that chip the flash
/// interface ignores it with an error flag, and the core continues (RM0090 3.6.1). The flash of an
/// STM32F0 takes halfwords, and a write of another width is a fault.
fn writes_ignored_flash<B: Board>(address: u32) -> bool {
    B::CORE == CoreKind::CortexM4F
        && [FLASH, FLASH_ALIAS].iter().any(|start| is_within(address, 1, *start, B::MEMORY.flash))
}

/// Reports a write to the flash to its interface. Unicorn discards the write itself.
fn write_flash<B: Board>(uc: &mut Unicorn<'_, System<B>>, address: u32, new: u16) {
    let mut old = [0xff; 2];
    // The flash is mapped. Only its last byte has no successor, and then the rest is erased.
    let _ = uc.mem_read(u64::from(address), &mut old);
    let system = uc.get_data_mut();
    system.catch_up();
    system.board.program(address, u16::from_le_bytes(old), new);
    system.after_access();
}

/// Returns the first and last addresses of the ranges outside RAM. A hook there reports failed
/// accesses. A hook that also covered RAM would make every access to RAM slow.
fn not_ram(memory: &MemoryMap) -> Vec<(u64, u64)> {
    let mut ranges = Vec::new();
    let mut start = 0;
    for (first, size) in [(CCM, memory.ccm), (SRAM, memory.ram)] {
        if size > 0 {
            ranges.push((start, u64::from(first) - 1));
            start = u64::from(first) + u64::from(size);
        }
    }
    ranges.push((start, 0xffff_ffff));
    ranges
}

/// Allows an access to a page that is not in Unicorn's TLB. A forbidden access is detected when it
/// happens.
fn enter_page<B: Board>(
    uc: &mut Unicorn<'_, System<B>>,
    address: u64,
    kind: MemType,
) -> Option<TlbEntry> {
    if kind == MemType::FETCH {
        return Some(TlbEntry { paddr: address, perms: Prot::ALL });
    }
    // Before this call, Unicorn sets the if-then state to that of the instruction, as if the core
    // left the block. The block continues and assumes that the state is cleared; the instructions
    // after it would be skipped.
    uc.reg_write(Register::EPSR, u64::from(XPSR_T)).ok()?;
    Some(TlbEntry { paddr: address, perms: Prot::READ | Prot::WRITE })
}

/// Counts the instructions of the block that is about to run, or stops before it.
fn begin_block<B: Board>(uc: &mut Unicorn<'_, System<B>>, address: u32, size: u32) {
    if std::mem::take(&mut uc.get_data_mut().masks_touched)
        && let Ok(masks) = read_masks(uc)
    {
        let system = uc.get_data_mut();
        system.observe_masks(masks);
        if system.nvic.any_pending() && system.nvic.next(masks).is_some() {
            system.deadline = 0;
        }
    }
    let system = uc.get_data_mut();
    if system.cycles >= system.deadline {
        system.stopped = true;
        // The call fails only if nothing runs.
        let _ = uc.emu_stop();
        return;
    }
    let block = match system.blocks.get(address, size) {
        Some(block) => block,
        None => {
            let mut code = vec![0; size as usize];
            let block = match uc.mem_read(u64::from(address), &mut code) {
                Ok(()) => CodeBlock::parse(&code),
                Err(_) => CodeBlock::default(),
            };
            let system = uc.get_data_mut();
            // Blocks in RAM are not stored, because such code may change without notice.
            if !(SRAM..SRAM + B::MEMORY.ram).contains(&address) {
                system.blocks.insert(address, size, block);
            }
            block
        }
    };
    let system = uc.get_data_mut();
    if block.beyond_armv6m && B::CORE == CoreKind::CortexM0 {
        system.undefined = true;
        let _ = uc.emu_stop();
        return;
    }
    system.instructions += u64::from(block.instructions);
    system.cycles += u64::from(block.instructions);
    system.event |= block.sends_event;
    system.masks_touched = block.masks;
    system.block = block;
    system.block_end = address + size;
}
