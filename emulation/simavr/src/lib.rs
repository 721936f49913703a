//! The core of emulated AVR robots: [`AvrCore`] uses simavr to decode and execute instructions, with a
//! board of this project at every register.
//!
//! simavr's structure is filled in by hand instead of by its `avr_init`. simavr's own interrupts,
//! sleep and peripherals are not used, and [`AvrCore::new`] sets every field that the decoder reads.
//! Data space and flash cover all 16-bit addresses, because the decoder continues after an access
//! beyond the end.

#![allow(unsafe_code, reason = "C is called")]

use std::ffi::{c_char, c_int, c_void};
use std::ops::Range;
use std::ptr;

use bittybuzz_chips::atmega328p::{AvrBoard, Change, PAGE, RAM};

#[allow(
    clippy::all,
    clippy::undocumented_unsafe_blocks,
    dead_code,
    non_camel_case_types,
    non_snake_case,
    non_upper_case_globals,
    unsafe_op_in_unsafe_fn,
    reason = "as bindgen writes it"
)]
mod ffi {
    include!(concat!(env!("OUT_DIR"), "/simavr.rs"));
}

/// The type of chip, which decides about the size of the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SimavrChip {
    /// The chip of Kilobots.
    Atmega328p,
    /// A chip for programs that are too large for a Kilobot. Its registers and interrupts are
    /// assumed to be those of the smaller chip.
    Atmega1284p,
}

impl SimavrChip {
    /// Returns the size of the flash in bytes. Addresses beyond it wrap around to the same flash,
    /// because the program counter has only the bits that the size needs. For the larger chip, only
    /// the half that `lpm` can address is modeled.
    pub const fn flash_size(self) -> usize {
        match self {
            SimavrChip::Atmega328p => 0x8000,
            SimavrChip::Atmega1284p => REACH,
        }
    }
}

/// The addresses of the core's general registers in the data space.
pub const REGISTERS: Range<usize> = 0..0x20;
/// Bytes of data space: registers and RAM.
pub const DATA: usize = 0x900;
/// The number of bytes that a 16-bit address can address.
const REACH: usize = 0x1_0000;

const FIRST_REGISTER: u16 = 0x20;
/// Addresses of the stack pointer and the flags, which belong to the core.
const STACK_POINTER: u16 = 0x5d;
const STATUS: u16 = 0x5f;
const Z: usize = 30;

/// Registers in which `sbi` sets one bit only: PINB, PINC, PIND, and flags (1.2.1 of the
/// instruction set manual: SBI). simavr reads the register, sets the bit and writes all bits.
const ONE_BIT: [u16; 8] = [0x23, 0x26, 0x29, 0x35, 0x36, 0x37, 0x3b, 0x3c];
const SBI: u16 = 0x9a00;

/// simavr's codes for the instructions `spm` and `wdr`.
const SPM: u32 = u32::from_be_bytes(*b"fspm");
const WDR: u32 = u32::from_be_bytes(*b"wdtr");

/// Data for callbacks, independent of the type of the board.
struct Common {
    change: Option<Change>,
    is_bad: bool,
    chip: SimavrChip,
}

/// Data for callbacks. It begins with `Common`, because simavr's logger serves all cores and cannot
/// know the type of the board.
#[repr(C)]
struct CallbackData<B> {
    common: Common,
    /// Null while no instruction is executed.
    board: *mut B,
}

/// An AVR core with its data space and flash.
pub struct AvrCore<B> {
    avr: Box<ffi::avr_t>,
    /// This and `shared` are boxed because simavr keeps pointers to them.
    _module: Box<ffi::avr_io_t>,
    shared: Box<CallbackData<B>>,
}

/// A saved state of a core, without the flash.
pub struct AvrCoreState {
    data: [u8; DATA],
    flags: [u8; 8],
    pc: u32,
    cycle: u64,
    is_delayed: bool,
}

// SAFETY: the core owns everything that its pointers refer to. Of the data that simavr shares
// between cores only the logger is used, which is set once.
unsafe impl<B: Send> Send for AvrCore<B> {}

impl<B: AvrBoard> AvrCore<B> {
    /// Creates a core with erased flash.
    pub fn new(chip: SimavrChip) -> Self {
        static LOGGER: std::sync::Once = std::sync::Once::new();
        // SAFETY: the function has the type that simavr calls.
        LOGGER.call_once(|| unsafe { ffi::avr_global_logger_set(Some(on_message)) });
        let board = ptr::null_mut();
        let mut shared =
            Box::new(CallbackData { common: Common { change: None, is_bad: false, chip }, board });
        // SAFETY: both are plain C structures. All zeros are valid for them: null pointers, numbers
        // and no callbacks.
        let (mut avr, mut module): (Box<ffi::avr_t>, Box<ffi::avr_io_t>) =
            unsafe { (Box::new(std::mem::zeroed()), Box::new(std::mem::zeroed())) };
        let parameter = ptr::from_mut(&mut *shared).cast::<c_void>();
        let (flash, data): (Box<[u8]>, Box<[u8]>) =
            (vec![0xff; REACH + 2].into(), vec![0; REACH].into());
        avr.flash = Box::into_raw(flash).cast();
        avr.data = Box::into_raw(data).cast();
        avr.flashend = REACH as u32 - 1;
        avr.codeend = avr.flashend;
        avr.ramend = DATA as u16 - 1;
        avr.address_size = 2;
        avr.vector_size = 4;
        avr.set_log(ffi::LOG_ERROR as u8);
        avr.custom.data = parameter;
        module.avr = &raw mut *avr;
        module.ioctl = Some(on_instruction::<B>);
        avr.io_port = &raw mut *module;
        for address in
            (FIRST_REGISTER..RAM).filter(|address| !(STACK_POINTER..=STATUS).contains(address))
        {
            let register = &mut avr.io[usize::from(address - FIRST_REGISTER)];
            register.r.c = Some(on_read::<B>);
            register.r.param = parameter;
            register.w.c = Some(on_write::<B>);
            register.w.param = parameter;
        }
        let mut core = AvrCore { avr, _module: module, shared };
        core.reset();
        core
    }

    /// Resets the core, which starts at address 0, because BOOTRST is not programmed. RAM keeps its
    /// content.
    pub fn reset(&mut self) {
        self.avr.pc = 0;
        self.avr.sreg = [0; 8];
        self.avr.interrupt_state = 0;
        self.avr.state = ffi::cpu_Running as c_int;
        self.set_stack_pointer(DATA as u16 - 1);
    }

    /// Returns the cycles since power-on.
    pub fn cycle(&self) -> u64 {
        self.avr.cycle
    }

    /// Advances to `cycle` without executing instructions.
    pub fn wait_until(&mut self, cycle: u64) {
        self.avr.cycle = self.avr.cycle.max(cycle);
    }

    /// Returns the program counter, in bytes.
    pub fn pc(&self) -> u16 {
        self.avr.pc as u16
    }

    /// Returns the data space: registers and RAM.
    pub fn data(&mut self) -> &mut [u8] {
        // SAFETY: the allocation has at least this size, and no other code uses it while no
        // instruction is executed.
        unsafe { std::slice::from_raw_parts_mut(self.avr.data, DATA) }
    }

    /// Returns the flash.
    pub fn flash(&self) -> &[u8] {
        // SAFETY: as above; only `write_flash` changes the flash, and it borrows the core
        // exclusively.
        unsafe { std::slice::from_raw_parts(self.avr.flash, self.shared.common.chip.flash_size()) }
    }

    /// Writes to the flash, at each address at which the program counter sees the byte.
    pub fn write_flash(&mut self, at: usize, bytes: &[u8]) {
        // SAFETY: as above.
        let all = unsafe { std::slice::from_raw_parts_mut(self.avr.flash, REACH) };
        let size = self.shared.common.chip.flash_size();
        let bytes = &bytes[..bytes.len().min(size.saturating_sub(at))];
        for start in (at..REACH).step_by(size) {
            all[start..start + bytes.len()].copy_from_slice(bytes);
        }
    }

    /// Returns the stack pointer.
    pub fn stack_pointer(&mut self) -> u16 {
        let at = usize::from(STACK_POINTER);
        u16::from_le_bytes([self.data()[at], self.data()[at + 1]])
    }

    fn set_stack_pointer(&mut self, value: u16) {
        let at = usize::from(STACK_POINTER);
        self.data()[at..at + 2].copy_from_slice(&value.to_le_bytes());
    }

    /// Returns true if interrupts are enabled.
    pub fn interrupts_are_on(&self) -> bool {
        self.avr.sreg[ffi::S_I as usize] != 0
    }

    /// Returns true if one more instruction is executed before any interrupt, as after `sei` and
    /// `reti`.
    pub fn is_delayed(&self) -> bool {
        self.avr.interrupt_state != 0
    }

    /// Enters an interrupt, which takes four cycles (7.7.1 of the data sheet).
    pub fn enter(&mut self, vector: u16) {
        let [low, high] = (self.pc() / 2).to_le_bytes();
        let stack = self.stack_pointer();
        for (byte, below) in [(low, 0), (high, 1)] {
            let at = usize::from(stack.wrapping_sub(below));
            // Below the RAM are registers. Bytes that are lost here are lost on the chip, too.
            if (usize::from(RAM)..DATA).contains(&at) {
                self.data()[at] = byte;
            }
        }
        self.set_stack_pointer(stack.wrapping_sub(2));
        self.avr.sreg[ffi::S_I as usize] = 0;
        self.avr.pc = vector.into();
        self.avr.cycle += 4;
    }

    /// Executes instructions for at least `cycles` cycles, or until an interrupt may be due.
    pub fn run(&mut self, board: &mut B, cycles: u64) -> DecodeStop {
        self.shared.board = board;
        self.avr.interrupt_state = 0;
        self.avr.run_cycle_count = cycles.max(1);
        // SAFETY: every field that the decoder uses is set, and the board outlives the call.
        let pc = unsafe { ffi::avr_run_one(&raw mut *self.avr) };
        self.avr.pc = pc % self.shared.common.chip.flash_size() as u32;
        self.shared.board = ptr::null_mut();
        self.avr.cycle += board.take_halt();
        let state = std::mem::replace(&mut self.avr.state, ffi::cpu_Running as c_int);
        if std::mem::take(&mut self.shared.common.is_bad) || state == ffi::cpu_Crashed as c_int {
            DecodeStop::Bad
        } else if let Some(change) = self.shared.common.change.take() {
            DecodeStop::Store(change)
        } else if state == ffi::cpu_Sleeping as c_int {
            DecodeStop::Sleep
        } else {
            DecodeStop::Due
        }
    }

    /// Saves the core's state to `state`.
    pub fn save(&mut self, state: &mut AvrCoreState) {
        state.data.copy_from_slice(self.data());
        (state.flags, state.pc, state.cycle) = (self.avr.sreg, self.avr.pc, self.avr.cycle);
        state.is_delayed = self.is_delayed();
    }

    /// Restores the core's state from `state`.
    pub fn restore(&mut self, state: &AvrCoreState) {
        self.data().copy_from_slice(&state.data);
        (self.avr.sreg, self.avr.pc, self.avr.cycle) = (state.flags, state.pc, state.cycle);
        self.avr.interrupt_state = if state.is_delayed { -2 } else { 0 };
    }
}

impl Default for AvrCoreState {
    fn default() -> Self {
        AvrCoreState { data: [0; DATA], flags: [0; 8], pc: 0, cycle: 0, is_delayed: false }
    }
}

impl<B> Drop for AvrCore<B> {
    fn drop(&mut self) {
        // SAFETY: both are boxed slices of these lengths, and no other code uses them any more.
        unsafe {
            drop(Box::from_raw(ptr::slice_from_raw_parts_mut(self.avr.flash, REACH + 2)));
            drop(Box::from_raw(ptr::slice_from_raw_parts_mut(self.avr.data, REACH)));
        }
    }
}

/// The reason why the execution of instructions ended.
#[derive(Debug)]
pub enum DecodeStop {
    /// The cycles are over, or an interrupt may be due.
    Due,
    /// The core executed `sleep`.
    Sleep,
    /// `spm` changes the flash.
    Store(Change),
    /// The core executed an unknown instruction, or accessed an address beyond all memory.
    Bad,
}

/// # Safety
/// simavr must call this with the arguments that [`AvrCore::new`] registered.
unsafe extern "C" fn on_read<B: AvrBoard>(
    avr: *mut ffi::avr_t,
    address: u16,
    parameter: *mut c_void,
) -> u8 {
    // SAFETY: called from within `Core::run`, which owns all of these.
    let (avr, board) = unsafe { (&*avr, (*parameter.cast::<CallbackData<B>>()).board.as_mut()) };
    board.map_or(0, |board| board.read(address, avr.cycle))
}

/// # Safety
/// simavr must call this with the arguments that [`AvrCore::new`] registered.
unsafe extern "C" fn on_write<B: AvrBoard>(
    avr: *mut ffi::avr_t,
    address: u16,
    value: u8,
    parameter: *mut c_void,
) {
    // SAFETY: called from within `Core::run`, which owns all of these.
    let (avr, board) =
        unsafe { (&mut *avr, (*parameter.cast::<CallbackData<B>>()).board.as_mut()) };
    let Some(board) = board else { return };
    let mut value = value;
    if ONE_BIT.contains(&address) {
        // SAFETY: the flash is larger than any program counter.
        let word = unsafe { avr.flash.add(avr.pc as usize).cast::<u16>().read_unaligned() };
        if word.to_le() & 0xff00 == SBI {
            value = 1 << (word.to_le() & 7);
        }
    }
    if board.write(address, value, avr.cycle) {
        // Interrupts may be due.
        avr.run_cycle_count = 0;
    }
}

/// # Safety
/// simavr must call this with the arguments that [`AvrCore::new`] registered.
unsafe extern "C" fn on_instruction<B: AvrBoard>(
    module: *mut ffi::avr_io_t,
    instruction: u32,
    _: *mut c_void,
) -> c_int {
    // SAFETY: called from within `Core::run`, which owns all of these. The registers are the first
    // bytes of the data space.
    let (avr, shared, registers) = unsafe {
        let avr = (*module).avr;
        let shared = &mut *(*avr).custom.data.cast::<CallbackData<B>>();
        (&mut *avr, shared, std::slice::from_raw_parts((*avr).data, 32))
    };
    // SAFETY: as above.
    let Some(board) = (unsafe { shared.board.as_mut() }) else { return -1 };
    board.advance(avr.cycle);
    match instruction {
        WDR => board.restart_watchdog(),
        SPM => {
            let z = u16::from_le_bytes([registers[Z], registers[Z + 1]]);
            let word = u16::from_le_bytes([registers[0], registers[1]]);
            let pc = avr.pc % shared.common.chip.flash_size() as u32;
            shared.common.change = board.store_program(pc as u16, z, word);
        }
        _ => return -1,
    }
    avr.run_cycle_count = 0;
    0
}

/// Handles a message of simavr. Only errors are reported: an unknown instruction, or an address
/// beyond all memory.
///
/// # Safety
/// simavr must call this with the arguments that [`AvrCore::new`] registered. The arguments of the
/// message are not read.
unsafe extern "C" fn on_message(
    avr: *mut ffi::avr_t,
    level: c_int,
    _: *const c_char,
    _: *mut ffi::__va_list_tag,
) {
    // SAFETY: simavr calls this function from within `Core::run`, which owns both, or without a
    // core.
    let reached = unsafe {
        avr.as_mut().and_then(|avr| Some((avr.custom.data.cast::<Common>().as_mut()?, avr)))
    };
    if level == ffi::LOG_ERROR as c_int
        && let Some((common, avr)) = reached
    {
        common.is_bad = true;
        avr.run_cycle_count = 0;
    }
}

/// Returns the address and the new content of the page that a [`Change`] concerns.
pub fn changed(flash: &[u8], change: &Change) -> (u16, [u8; PAGE as usize]) {
    let (Change::Erase(page) | Change::Program(page, _)) = change;
    let mut bytes = [0xff; PAGE as usize];
    if let Change::Program(_, new) = change {
        let start = usize::from(*page);
        for ((byte, old), new) in bytes.iter_mut().zip(&flash[start..]).zip(new.iter()) {
            *byte = old & new;
        }
    }
    (*page, bytes)
}

#[cfg(test)]
mod tests;
