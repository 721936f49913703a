//! The chip's core in QEMU: runs for a number of instructions, then stops so that its registers can
//! be read.
//!
//! QEMU counts instructions (`-icount`), and its SysTick runs on that count. SysTick stops a busy
//! core: its exception meets a breakpoint at the handler's first instruction, and returns from
//! there. So the core stops after the same instruction in every run, independently of the host's
//! clock. To the firmware a stop is an interrupt whose handler does nothing.

use bittybuzz_chips::CoreKind;
use bittybuzz_cortex_m::registers::{ICSR, VTOR};

use crate::gdb::{GdbError, GdbStop};
use crate::memory::{self, MemoryLayout};
use crate::qemu::{Qemu, QemuError};
use crate::qtest::QtestError;
use crate::registers::CoreRegisters;
use crate::sites;

/// A machine of QEMU that emulates a robot's core: a board, of which only the chip is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct QemuMachine {
    name: &'static str,
    chip: &'static str,
    /// Rate of QEMU's SysTick in MHz; QEMU's own clock has 1 GHz.
    systick_mhz: u64,
}

impl QemuMachine {
    /// Returns the machine whose core executes the instructions of `core`, with memory at the same
    /// addresses.
    pub const fn with(core: CoreKind) -> Self {
        match core {
            CoreKind::CortexM4F => {
                QemuMachine { name: "netduinoplus2", chip: "stm32f405-soc", systick_mhz: 168 }
            }
            // A Cortex-M3, which executes all instructions of a Cortex-M0; 128 KiB of flash and, as
            // on the Zooid, 8 KiB of RAM.
            CoreKind::CortexM0 => {
                QemuMachine { name: "stm32vldiscovery", chip: "stm32f100-soc", systick_mhz: 24 }
            }
        }
    }

    /// Returns the size of the machine's flash in bytes.
    const fn flash(self) -> usize {
        if self.has_ccm() { 1024 * 1024 } else { 128 * 1024 }
    }

    /// Returns true if the chip has core-coupled memory, even if QEMU does not model it.
    const fn has_ccm(self) -> bool {
        self.systick_mhz == 168
    }
}

/// Registers of the core (ARMv7-M manual, B3.2.2 and B3.3.2).
const SYST_CSR: u32 = 0xe000_e010;
/// The reload register; after it comes the counter, SYST_CVR, which any write clears.
const SYST_RVR: u32 = 0xe000_e014;
/// SYST_CSR: on, with interrupt, from the processor clock.
const SYSTICK_ON: u32 = 0b111;
const ICSR_PENDSTCLR: u32 = 1 << 25;
const SYSTICK_EXCEPTION: u32 = 15;
/// MHz of QEMU's clock.
const CLOCK_MHZ: u64 = 1000;
/// The longest run in instructions: less than the 2^24 ticks of SysTick.
const RUN_MAX: u64 = 50_000_000;
/// Reset value of the program status: Thumb state.
const XPSR_THUMB: u32 = 1 << 24;
/// The number of timeouts of the debugger's client after which QEMU is considered stuck.
const TRIES: u32 = 10;

/// An image without a bootloader gets a vector table with only SysTick's entry, and a handler, in
/// its place; they are used until the firmware has set VTOR. Only the BX LR of the handler is ever
/// executed.
const EARLY_VECTOR: u32 = 0x0800_003c;
const EARLY_RETURN: u32 = 0x0800_0042;
/// The handler's address, 0x0800_0040, with the Thumb bit; NOP; BX LR.
const EARLY_CODE: [u8; 8] = [0x41, 0x00, 0x00, 0x08, 0x00, 0xbf, 0x70, 0x47];

/// Address after the flash of the STM32F051, for a BX LR.
const SPARE_RETURN: u32 = 0x0801_0000;
const RETURN: [u8; 2] = [0x70, 0x47];

/// The reason why the core stopped, and its progress.
pub struct CoreStopped {
    /// The reason.
    pub cause: StopCause,
    /// Number of instructions that the core executed.
    pub instructions: u64,
}

/// The reason why the core stopped.
pub enum StopCause {
    /// The requested number of instructions is reached.
    Time,
    /// The core is about to access a trapped address.
    Access,
    /// The core is about to execute an instruction with a breakpoint.
    Breakpoint,
}

/// A core in QEMU.
pub struct QemuProcessor {
    machine: QemuMachine,
    qemu: Qemu,
    /// Path of the core with its interrupt controller in QEMU's object model.
    path: String,
    layout: MemoryLayout,
    /// The registers' values in QEMU.
    registers: CoreRegisters,
    /// The registers' values when the core continues.
    pub next: CoreRegisters,
    /// Instructions since QEMU's start.
    executed: u64,
    /// True if the next instruction is the return from SysTick, which is not the firmware's.
    returning: bool,
    lines: u128,
    handler: Option<u32>,
    /// Address of an instruction that returns from an exception.
    exit: u32,
}

/// A reason why the core cannot continue.
#[derive(Debug, thiserror::Error)]
pub enum CoreError {
    /// QEMU failed.
    #[error(transparent)]
    Qemu(#[from] QemuError),
    /// QEMU does not stop the core.
    #[error("QEMU does not stop the core")]
    Stuck,
    /// QEMU's machine has another chip than expected.
    #[error("the machine {0} of this QEMU does not have the chip that it had in version 7.2")]
    NoChip(&'static str),
    /// The image has no instruction that returns from SysTick.
    #[error("the image has no BX LR instruction, which this bridge needs to return from SysTick")]
    NoReturn,
}

impl CoreError {
    /// Returns true if QEMU has ended.
    pub fn is_end(&self) -> bool {
        matches!(
            self,
            CoreError::Qemu(
                QemuError::Gdb(GdbError::Closed) | QemuError::Qtest(QtestError::Closed)
            )
        )
    }
}

impl From<GdbError> for CoreError {
    fn from(error: GdbError) -> Self {
        CoreError::Qemu(error.into())
    }
}

impl From<QtestError> for CoreError {
    fn from(error: QtestError) -> Self {
        CoreError::Qemu(error.into())
    }
}

impl QemuProcessor {
    /// Creates a core with `flash` as content of the flash. The caller starts it with
    /// [`reset`](Self::reset).
    pub fn new(machine: QemuMachine, flash: &[u8]) -> Result<Self, CoreError> {
        let mut qemu = Qemu::start(machine.name, &[])?;
        let chip = qemu.find(machine.chip)?.ok_or(CoreError::NoChip(machine.name))?;
        let has_ccm = !machine.has_ccm() || qemu.gdb.read_memory(memory::CCM.start, &mut [0])?;
        let mut core = QemuProcessor {
            machine,
            qemu,
            path: format!("{chip}/armv7m"),
            layout: if has_ccm { MemoryLayout::Chip } else { MemoryLayout::CcmBehindSram },
            registers: CoreRegisters::default(),
            next: CoreRegisters::default(),
            executed: 0,
            returning: false,
            lines: 0,
            handler: None,
            exit: EARLY_RETURN,
        };
        let room = flash.len().min(machine.flash());
        core.qemu.gdb.write_memory(memory::FLASH.start, &flash[..room])?;
        let bootloader = &flash[..(EARLY_RETURN + 2 - memory::FLASH.start) as usize];
        if !machine.has_ccm() {
            // QEMU's chip has more flash than the robot's, so the instruction fits after the
            // robot's flash.
            core.qemu.gdb.write_memory(SPARE_RETURN, &RETURN)?;
            core.exit = SPARE_RETURN;
        } else if bootloader.iter().all(|&byte| byte == 0xff) {
            core.qemu.gdb.write_memory(EARLY_VECTOR, &EARLY_CODE)?;
        } else {
            core.exit =
                sites::find_return(memory::FLASH.start, flash).ok_or(CoreError::NoReturn)?;
        }
        Ok(core)
    }

    /// Returns the layout of the chip's memory in QEMU.
    pub fn layout(&self) -> MemoryLayout {
        self.layout
    }

    /// Makes the core stop before accesses to the `length` bytes at `address`.
    pub fn trap_accesses(&mut self, address: u32, length: u32) -> Result<(), CoreError> {
        Ok(self.qemu.gdb.watch_accesses(address, length)?)
    }

    /// Makes the core stop before writes to the `length` bytes at `address`.
    pub fn trap_writes(&mut self, address: u32, length: u32) -> Result<(), CoreError> {
        Ok(self.qemu.gdb.watch_writes(address, length)?)
    }

    /// Makes the core stop before the instruction at `address`.
    pub fn trap_instruction(&mut self, address: u32) -> Result<(), CoreError> {
        Ok(self.qemu.gdb.set_breakpoint(address)?)
    }

    /// Resets the core, which will start at `pc` with the stack pointer `sp` and this vector table.
    pub fn reset(&mut self, sp: u32, pc: u32, vector_table: u32) -> Result<(), CoreError> {
        self.set_lines(0);
        self.qemu.qtest.flush()?;
        self.qemu.gdb.monitor("system_reset")?;
        self.returning = false;
        self.refresh()?;
        self.next = CoreRegisters { xpsr: XPSR_THUMB, ..CoreRegisters::default() };
        self.next.r[usize::from(CoreRegisters::SP)] = self.layout.relocate(sp) & !3;
        self.next.r[usize::from(CoreRegisters::LR)] = u32::MAX;
        self.next.r[usize::from(CoreRegisters::PC)] = pc & !1;
        self.set_vector_table(vector_table)
    }

    /// Sets the vector table's address to `table` from now on (B3.2.5).
    pub fn set_vector_table(&mut self, table: u32) -> Result<(), CoreError> {
        self.qemu.qtest.write_words(VTOR, &[table]);
        let mut handler = [0; 4];
        let address = table.wrapping_add(4 * SYSTICK_EXCEPTION);
        self.qemu.gdb.read_memory(address, &mut handler)?;
        if let Some(old) = self.handler.take() {
            self.qemu.gdb.remove_breakpoint(old)?;
        }
        // A vector never has an address in the flash's alias at 0. The early table is written by
        // `new`.
        let handler = u32::from_le_bytes(handler) & !1;
        self.qemu.gdb.set_breakpoint(handler)?;
        self.handler = Some(handler);
        Ok(())
    }

    /// Sets interrupt lines to the levels `lines`, bit n for interrupt n. Returns true if any of
    /// them rose.
    pub fn set_lines(&mut self, lines: u128) -> bool {
        let changed = lines ^ self.lines;
        for line in (0..128).filter(|line| changed >> line & 1 != 0) {
            self.qemu.qtest.set_line(&self.path, line, lines >> line & 1 != 0);
        }
        self.lines = lines;
        changed & lines != 0
    }

    /// Returns true if an exception is pending and enabled, masked or not (ICSR.VECTPENDING,
    /// B3.2.4).
    pub fn is_exception_pending(&mut self) -> Result<bool, CoreError> {
        Ok(self.qemu.qtest.read_word(ICSR)? >> 12 & 0x1ff != 0)
    }

    /// Writes a register of the core that QEMU keeps itself.
    pub fn write_register(&mut self, address: u32, value: u32) {
        self.qemu.qtest.write_words(address, &[value]);
    }

    /// Reads memory at an address of QEMU's layout; returns false if there is none.
    pub fn read_memory(&mut self, address: u32, bytes: &mut [u8]) -> Result<bool, CoreError> {
        Ok(self.qemu.gdb.read_memory(address, bytes)?)
    }

    /// Writes memory at an address of QEMU's layout; returns false if there is none.
    pub fn write_memory(&mut self, address: u32, bytes: &[u8]) -> Result<bool, CoreError> {
        Ok(self.qemu.gdb.write_memory(address, bytes)?)
    }

    /// Lets the core run until something stops it, for about `instructions` at most.
    pub fn run(&mut self, instructions: u64) -> Result<CoreStopped, CoreError> {
        self.arm(instructions.min(RUN_MAX))?;
        self.qemu.gdb.resume(&self.registers, &self.next)?;
        let stop = self.wait()?;
        let before = self.executed;
        self.refresh()?;
        let returned = u64::from(std::mem::take(&mut self.returning));
        let instructions = (self.executed - before).saturating_sub(returned);
        let in_handler = self.registers.exception() == SYSTICK_EXCEPTION;
        let cause = match stop {
            GdbStop::Watchpoint => StopCause::Access,
            GdbStop::Breakpoint if in_handler && Some(self.registers.pc()) == self.handler => {
                self.return_at_once();
                self.returning = true;
                StopCause::Time
            }
            GdbStop::Breakpoint => StopCause::Breakpoint,
            GdbStop::Interrupted => StopCause::Time,
        };
        Ok(CoreStopped { cause, instructions })
    }

    /// Makes the core return at once from the function at whose first instruction it stands: it
    /// continues with a BX LR.
    pub fn return_at_once(&mut self) {
        self.next.r[usize::from(CoreRegisters::PC)] = self.exit;
    }

    /// Returns QEMU's output after it ended.
    pub fn last_words(self) -> String {
        self.qemu.last_words()
    }

    /// Waits until the core stops. The interrupt by the debugger is needed only for firmware that
    /// for a long time neither allows interrupts nor accesses a peripheral: the longest run takes a
    /// fraction of the client's timeout.
    fn wait(&mut self) -> Result<GdbStop, CoreError> {
        for attempt in 0..TRIES {
            if let Some(stop) = self.qemu.gdb.wait()? {
                return Ok(stop);
            }
            if attempt == 0 {
                self.qemu.gdb.interrupt()?;
            }
        }
        Err(CoreError::Stuck)
    }

    fn refresh(&mut self) -> Result<(), CoreError> {
        let (registers, executed) = self.qemu.registers_and_count()?;
        self.executed = executed;
        self.next = registers.clone();
        self.registers = registers;
        Ok(())
    }

    /// Sets SysTick to stop the core after `instructions`. From a cleared counter SysTick fires
    /// after two periods, because QEMU takes one until it reloads. This is needed before each run,
    /// because QEMU's clock jumps at a stop.
    fn arm(&mut self, instructions: u64) -> Result<(), CoreError> {
        let ticks = (instructions * self.machine.systick_mhz).div_ceil(CLOCK_MHZ);
        let period = ticks.div_ceil(2).max(2);
        // The order matters: started with a reload value of 0, as after a reset, QEMU's SysTick
        // stays off. The last write clears an exception that may be pending from the stop before.
        let reload = (period - 1) as u32;
        self.qemu.qtest.write_words(SYST_RVR, &[reload, 0]);
        self.qemu.qtest.write_words(SYST_CSR, &[SYSTICK_ON]);
        self.qemu.qtest.write_words(ICSR, &[ICSR_PENDSTCLR]);
        self.qemu.qtest.flush()?;
        Ok(())
    }
}
