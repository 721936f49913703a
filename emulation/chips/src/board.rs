//! The interface between a core and the robot around it.

use crate::{
    BoardEvent, FlashChange, Lines, ReceptionEvent, ResetCause, Time, Transfer, Transmission, Width,
};

/// The type of the core that executes the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CoreKind {
    /// ARMv6-M: two bits of priority, 32 interrupts, no mask register but PRIMASK.
    CortexM0,
    /// ARMv7E-M with single precision: four bits of priority.
    CortexM4F,
}

/// The content of the core's address space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryMap {
    /// Bytes of flash at 0x0800_0000, also seen at 0.
    pub flash: u32,
    /// Bytes of RAM at 0x2000_0000.
    pub ram: u32,
    /// Bytes of core-coupled memory at 0x1000_0000; 0 for none.
    pub ccm: u32,
    /// First addresses and sizes, in whole pages of 4 KiB, of the peripherals of the board.
    pub peripherals: &'static [(u32, u32)],
    /// First addresses and sizes of the board's constant memory; a write to it is a fault.
    pub read_only: &'static [(u32, u32)],
}

/// First addresses of flash, of RAM and of core-coupled memory.
const FLASH: u32 = 0x0800_0000;
const RAM: u32 = 0x2000_0000;
const CCM: u32 = 0x1000_0000;

impl MemoryMap {
    /// Returns the first address and the size of the RAM and of the core-coupled memory.
    pub fn rams(&self) -> impl Iterator<Item = (u32, u32)> {
        [(RAM, self.ram), (CCM, self.ccm)].into_iter()
    }

    /// Returns the first address and the size of the flash and of each RAM.
    pub fn regions(&self) -> impl Iterator<Item = (u32, u32)> {
        self.rams().chain([(FLASH, self.flash)])
    }

    /// Returns true if `length` bytes from `address` on are RAM.
    pub fn is_ram(&self, address: u32, length: usize) -> bool {
        let is_in = |start: u32, size: u32| {
            address.checked_sub(start).is_some_and(|at| at as usize + length <= size as usize)
        };
        self.rams().any(|(start, size)| is_in(start, size))
    }

    /// Returns true if the core may write at this address and the board handles the access.
    pub fn is_peripheral(&self, address: u32) -> bool {
        is_in(self.peripherals, address)
    }

    /// Returns true if the core may read at this address and the board handles the access.
    pub fn is_readable(&self, address: u32) -> bool {
        self.is_peripheral(address) || is_in(self.read_only, address)
    }

    /// Returns the first address and the initial content of each RAM. Static RAM is not zero at
    /// power-on. The content here is pseudo-random and always the same.
    pub fn ram_at_power_on(&self) -> Vec<(u32, Vec<u8>)> {
        let mut state = 1_u32;
        let mut noise = |size| {
            let next = || {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 24) as u8
            };
            std::iter::repeat_with(next).take(size as usize).collect()
        };
        [(RAM, self.ram), (CCM, self.ccm)]
            .into_iter()
            .filter(|(_, size)| *size != 0)
            .map(|(start, size)| (start, noise(size)))
            .collect()
    }
}

fn is_in(regions: &[(u32, u32)], address: u32) -> bool {
    regions.iter().any(|(base, size)| address.wrapping_sub(*base) < *size)
}

/// The state of the core and its memory when the program starts after a reset.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CoreStart {
    /// Memory that changed since the reset: first addresses and new contents, to be written in this
    /// order.
    pub memory: Vec<(u32, Vec<u8>)>,
    /// Content of the register VTOR.
    pub vector_table: u32,
    /// True if the chip runs a loader, not the program, until the next reset.
    pub is_in_loader: bool,
}

/// Everything in a robot except the core of its STM32.
pub trait Board: Sized {
    /// The core that this board needs.
    const CORE: CoreKind;
    /// The memory map of that core.
    const MEMORY: MemoryMap;

    /// Creates robot `number` of several, at the moment of its power-on.
    fn power_on(number: usize) -> Self;

    /// Returns the time that all peripherals have reached.
    fn now(&self) -> Time;

    /// Advances time to `to`; does nothing if `to` is in the past.
    fn advance(&mut self, to: Time);

    /// Returns the earliest time at which an interrupt line may change without an access, or a DMA
    /// transfer is due.
    fn next_event(&self) -> Option<Time>;

    /// Performs a read of the core. `address` is aligned to `width` and within
    /// [`MemoryMap::peripherals`].
    fn read(&mut self, address: u32, width: Width) -> u32;

    /// Returns true if a read at this address may have a side effect. Otherwise the emulator need
    /// not trap it.
    fn reading_acts(&self, _address: u32) -> bool {
        true
    }

    /// Performs a write of the core to a peripheral.
    fn write(&mut self, address: u32, width: Width, value: u32);

    /// Returns the levels of the interrupt lines.
    fn interrupts(&self) -> Lines;

    /// Returns the frequency of the core in Hz, as the RCC registers set it.
    fn core_clock_hz(&self) -> u64;

    /// Returns the cause if the chip requests a reset; the core then calls [`reset`](Self::reset).
    fn take_reset_request(&mut self) -> Option<ResetCause>;

    /// Resets the STM32. The rest of the robot keeps its state.
    fn reset(&mut self, cause: ResetCause);

    /// Does the work of a bootloader: called after power-on or a reset, before the program with its
    /// vectors at `vectors` starts.
    fn start(&mut self, _vectors: u32) -> CoreStart {
        CoreStart::default()
    }

    /// Returns true if a debugger has control of the core (DHCSR.C_DEBUGEN).
    fn is_debugged(&self) -> bool {
        false
    }

    /// Called when a debugger halts the core or resumes it. Peripherals that DBGMCU stops stand
    /// still meanwhile.
    fn set_halted(&mut self, _halted: bool) {}

    /// Returns true if the watchdog runs, so that it will reset a chip whose firmware hangs.
    fn watchdog_runs(&self) -> bool;

    /// Returns true if the STM32 has power.
    fn is_powered(&self) -> bool;

    /// Returns the events since the last call, in order.
    fn take_events(&mut self) -> Vec<(Time, BoardEvent)>;

    /// Returns true if [`next_transfer`](Self::next_transfer) or
    /// [`take_flash_change`](Self::take_flash_change) has something to return.
    fn wants_memory(&self) -> bool {
        false
    }

    /// Returns the data item that the DMA controller moves now, if any. The core performs the
    /// transfer, because it owns the memory.
    fn next_transfer(&mut self) -> Option<Transfer> {
        None
    }

    /// Handles a write of the core to the flash: of the halfword `new` over `old`, or of the lower
    /// half of a word. Returns the change, if there is one.
    fn program(&mut self, _address: u32, _old: u16, _new: u16) -> Option<FlashChange> {
        None
    }

    /// Returns the time up to which nothing changes while the core sleeps.
    fn quiet_until(&self) -> Time {
        self.next_event().unwrap_or(Time::NEVER)
    }

    /// Returns the time before which the robot does not decide to transmit to robots of other
    /// programs, if neither the core nor the board acts before `acts`.
    fn silent_until(&self, acts: Time) -> Time {
        acts
    }

    /// Returns the packets that the robot begins to transmit on a channel shared with others; see
    /// [`Air`](crate::Air).
    fn take_transmissions(&mut self) -> Vec<Transmission> {
        Vec::new()
    }

    /// Reports a signal or packet on the shared channel. It does not begin in the past.
    fn receive(&mut self, _received: ReceptionEvent) {}

    /// Returns a packet with this payload as this robot would send it from `begin` on; none without
    /// such a radio.
    fn packet_of(&self, _payload: &[u8], _begin: Time) -> Option<Transmission> {
        None
    }

    /// Returns the change of the flash that the firmware started.
    fn take_flash_change(&mut self) -> Option<FlashChange> {
        None
    }
}
