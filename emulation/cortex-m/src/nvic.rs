//! Exceptions: the pending, active and enabled ones, and the selection of the next one (ARMv7-M
//! B1.5, B3.4).

use bittybuzz_chips::CoreKind;

/// Numbers of exceptions; interrupt n is exception 16 + n.
#[allow(missing_docs, reason = "the manual's names")]
pub mod number {
    pub const NMI: u8 = 2;
    pub const HARD_FAULT: u8 = 3;
    pub const MEM_MANAGE: u8 = 4;
    pub const BUS_FAULT: u8 = 5;
    pub const USAGE_FAULT: u8 = 6;
    pub const SV_CALL: u8 = 11;
    pub const DEBUG_MONITOR: u8 = 12;
    pub const PEND_SV: u8 = 14;
    pub const SYS_TICK: u8 = 15;
    pub const FIRST_INTERRUPT: u8 = 16;
}

const ICSR_PENDSTCLR: u32 = 1 << 25;
const ICSR_PENDSTSET: u32 = 1 << 26;
const ICSR_PENDSVCLR: u32 = 1 << 27;
const ICSR_PENDSVSET: u32 = 1 << 28;
const ICSR_NMIPENDSET: u32 = 1 << 31;

/// The interrupts of the STM32F405, rounded up to whole registers; the Cortex-M0 has 32.
const INTERRUPTS: usize = 96;
/// The priority of thread mode, which is below all others.
const THREAD: i16 = 256;

/// The special registers that mask exceptions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Masks {
    /// PRIMASK: masks all exceptions of configurable priority.
    pub primask: bool,
    /// FAULTMASK: masks all exceptions except NMI.
    pub faultmask: bool,
    /// BASEPRI: masks exceptions of this priority and less urgent ones; 0 masks none.
    pub basepri: u8,
}

impl Masks {
    /// Returns true if some interrupt could be masked.
    pub fn any(self) -> bool {
        self.primask || self.faultmask || self.basepri != 0
    }
}

/// The interrupt controller, and the stack of active exceptions.
#[derive(Clone)]
pub struct Nvic {
    core: CoreKind,
    enabled: u128,
    pending: u128,
    lines: u128,
    priorities: [u8; INTERRUPTS],
    /// The priorities of exceptions 0 to 15; those before 4 are fixed.
    system_priorities: [u8; 16],
    system_pending: u16,
    /// Exceptions that were entered and have not returned, innermost last.
    active: Vec<u8>,
    /// AIRCR.PRIGROUP.
    group: u8,
}

impl Nvic {
    /// Returns the state after a reset.
    pub fn new(core: CoreKind) -> Self {
        Nvic {
            core,
            enabled: 0,
            pending: 0,
            lines: 0,
            priorities: [0; INTERRUPTS],
            system_priorities: [0; 16],
            system_pending: 0,
            active: Vec::new(),
            group: 0,
        }
    }

    /// Returns the bits of a priority that are implemented, which are the upper ones.
    fn priority_bits(&self) -> u8 {
        match self.core {
            CoreKind::CortexM0 => 0xc0,
            CoreKind::CortexM4F => 0xf0,
        }
    }

    fn interrupts(&self) -> u32 {
        match self.core {
            CoreKind::CortexM0 => 32,
            CoreKind::CortexM4F => INTERRUPTS as u32,
        }
    }

    /// Sets the levels of the interrupt lines. The interrupt of a rising line becomes pending.
    #[inline]
    pub fn set_lines(&mut self, lines: u128) {
        self.pending |= lines & !self.lines;
        self.lines = lines;
    }

    /// Makes an exception pending.
    pub fn pend(&mut self, exception: u8) {
        match exception.checked_sub(number::FIRST_INTERRUPT) {
            Some(interrupt) => self.pending |= 1 << interrupt,
            None => self.system_pending |= 1 << exception,
        }
    }

    /// Pends an interrupt by its own number; those that the chip does not have are ignored.
    pub fn pend_interrupt(&mut self, interrupt: u32) {
        if interrupt < self.interrupts() {
            self.pending |= 1 << interrupt;
        }
    }

    /// Makes an exception no longer pending.
    pub fn unpend(&mut self, exception: u8) {
        match exception.checked_sub(number::FIRST_INTERRUPT) {
            Some(interrupt) => self.pending &= !(1 << interrupt),
            None => self.system_pending &= !(1 << exception),
        }
    }

    /// Returns true if this exception is pending, enabled or not.
    pub fn is_pending(&self, exception: u8) -> bool {
        match exception.checked_sub(number::FIRST_INTERRUPT) {
            Some(interrupt) => self.pending >> interrupt & 1 != 0,
            None => self.system_pending >> exception & 1 != 0,
        }
    }

    /// Returns true if any enabled exception is pending.
    #[inline]
    pub fn any_pending(&self) -> bool {
        self.system_pending != 0 || self.pending & self.enabled != 0
    }

    /// Returns the exception that runs; 0 in thread mode.
    pub fn current(&self) -> u8 {
        self.active.last().copied().unwrap_or(0)
    }

    /// Returns true if the exception was entered and has not returned.
    pub fn is_active(&self, exception: u8) -> bool {
        self.active.contains(&exception)
    }

    /// Returns the number of exceptions that were entered and have not returned.
    pub fn active_count(&self) -> usize {
        self.active.len()
    }

    /// Marks the exception as active and no longer pending.
    pub fn activate(&mut self, exception: u8) {
        self.unpend(exception);
        self.active.push(exception);
    }

    /// Marks the exception as no longer active. An interrupt whose line is still high becomes
    /// pending again.
    pub fn deactivate(&mut self, exception: u8) {
        self.active.retain(|active| *active != exception);
        if let Some(interrupt) = exception.checked_sub(number::FIRST_INTERRUPT) {
            self.pending |= self.lines & 1 << interrupt;
        }
    }

    /// Returns the full priority. Fixed priorities are negative.
    fn priority(&self, exception: u8) -> i16 {
        match exception {
            number::NMI => -2,
            number::HARD_FAULT => -1,
            0..number::FIRST_INTERRUPT => i16::from(self.system_priorities[usize::from(exception)]),
            _ => i16::from(self.priorities[usize::from(exception - number::FIRST_INTERRUPT)]),
        }
    }

    /// Returns the part of a priority that decides about preemption (B1.5.4).
    fn group_of(&self, priority: i16) -> i16 {
        if priority < 0 { priority } else { priority & !((2 << self.group) - 1) }
    }

    /// Returns the priority of the code that runs now, boosted by the masks.
    fn execution_priority(&self, masks: Masks) -> i16 {
        let active = self.active.iter().map(|active| self.group_of(self.priority(*active)));
        let basepri = (masks.basepri != 0).then(|| self.group_of(i16::from(masks.basepri)));
        let primask = masks.primask.then_some(0);
        let faultmask = masks.faultmask.then_some(-1);
        active.chain(basepri).chain(primask).chain(faultmask).min().unwrap_or(THREAD)
    }

    /// Returns true if `exception` would be taken now.
    pub fn preempts(&self, exception: u8, masks: Masks) -> bool {
        self.group_of(self.priority(exception)) < self.execution_priority(masks)
    }

    /// Returns the exception to be taken now: the most urgent one, and among equals the one with
    /// the lowest number.
    pub fn next(&self, masks: Masks) -> Option<u8> {
        let system = (2..16_u8).filter(|n| self.system_pending >> n & 1 != 0);
        let mut interrupts = self.pending & self.enabled;
        let interrupts = std::iter::from_fn(|| {
            let next = (interrupts != 0).then(|| interrupts.trailing_zeros() as u8)?;
            interrupts &= interrupts - 1;
            Some(next + number::FIRST_INTERRUPT)
        });
        system
            .chain(interrupts)
            .min_by_key(|exception| (self.priority(*exception), *exception))
            .filter(|exception| self.preempts(*exception, masks))
    }

    /// Returns AIRCR.PRIGROUP.
    pub fn group(&self) -> u8 {
        self.group
    }

    /// Sets AIRCR.PRIGROUP.
    pub fn set_group(&mut self, group: u8) {
        self.group = group & 7;
    }

    /// Returns true if the core has this exception and its priority is configurable.
    fn has_priority(&self, exception: usize) -> bool {
        let exception = exception as u8;
        match exception {
            number::SV_CALL | number::PEND_SV | number::SYS_TICK => true,
            number::MEM_MANAGE..=number::USAGE_FAULT | number::DEBUG_MONITOR => {
                self.core == CoreKind::CortexM4F
            }
            _ => false,
        }
    }

    /// Reads SHPR1 to SHPR3; `first` is the number of the first exception in the register.
    pub fn read_priorities(&self, first: usize) -> u32 {
        u32::from_le_bytes(std::array::from_fn(|n| self.system_priorities[first + n]))
    }

    /// Writes the bytes of `value` that are in `mask` to SHPR1 to SHPR3; `first` is the number of
    /// the first exception in the register.
    pub fn write_priorities(&mut self, first: usize, value: u32, mask: u32) {
        for byte in (0..4).filter(|byte| mask >> (8 * byte) & 0xff != 0) {
            if self.has_priority(first + byte) {
                let priority = (value >> (8 * byte)) as u8 & self.priority_bits();
                self.system_priorities[first + byte] = priority;
            }
        }
    }

    /// Reads ICSR (B3.2.4).
    pub fn read_icsr(&self) -> u32 {
        let pending = |exception, bit: u32| if self.is_pending(exception) { bit } else { 0 };
        // RETTOBASE does not exist on a Cortex-M0.
        let is_outermost = self.core == CoreKind::CortexM4F && self.active.len() <= 1;
        u32::from(self.current())
            | u32::from(is_outermost) << 11
            | u32::from(self.next(Masks::default()).unwrap_or(0)) << 12
            | pending(number::SYS_TICK, ICSR_PENDSTSET)
            | pending(number::PEND_SV, ICSR_PENDSVSET)
            | pending(number::NMI, ICSR_NMIPENDSET)
    }

    /// Writes ICSR (B3.2.4).
    pub fn write_icsr(&mut self, value: u32) {
        for (bit, exception) in [
            (ICSR_PENDSTSET, number::SYS_TICK),
            (ICSR_PENDSVSET, number::PEND_SV),
            (ICSR_NMIPENDSET, number::NMI),
        ] {
            if value & bit != 0 {
                self.pend(exception);
            }
        }
        for (bit, exception) in
            [(ICSR_PENDSTCLR, number::SYS_TICK), (ICSR_PENDSVCLR, number::PEND_SV)]
        {
            if value & bit != 0 {
                self.unpend(exception);
            }
        }
    }

    /// Reads a word of NVIC_ISER to NVIC_IPR; `offset` counts from 0xe000e100.
    pub fn read(&self, offset: u32) -> u32 {
        let word = |bits: u128| match offset & 0x7f {
            index @ 0..=0xc => (bits >> (8 * index)) as u32,
            _ => 0,
        };
        match offset {
            0x000..0x100 => word(self.enabled),
            0x100..0x200 => word(self.pending),
            // A Cortex-M0 has no NVIC_IABR.
            0x200..0x280 if self.core == CoreKind::CortexM4F => {
                word(self.active.iter().fold(0, |bits, active| {
                    let interrupt = active.checked_sub(number::FIRST_INTERRUPT);
                    bits | interrupt.map_or(0, |interrupt| 1 << interrupt)
                }))
            }
            0x300..0x360 => {
                let first = (offset - 0x300) as usize;
                let bytes = &self.priorities[first..first + 4];
                u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
            }
            _ => 0,
        }
    }

    /// Writes the bits of `value` that are in `mask` to NVIC_ISER to NVIC_IPR.
    pub fn write(&mut self, offset: u32, value: u32, mask: u32) {
        let shift = 8 * (offset & 0x7f).min(0x8);
        // Only interrupts that exist have bits.
        let bits = match offset & 0x7f {
            offset @ 0..=0x8 if 8 * offset < self.interrupts() => u128::from(value & mask) << shift,
            _ => 0,
        };
        match offset {
            0x000..0x080 => self.enabled |= bits,
            0x080..0x100 => self.enabled &= !bits,
            0x100..0x180 => self.pending |= bits,
            // A line that is high keeps its interrupt pending, unless the interrupt is active.
            0x180..0x200 => {
                let running = self.active.iter().fold(0_u128, |running, active| {
                    let interrupt = active.checked_sub(number::FIRST_INTERRUPT);
                    running | interrupt.map_or(0, |interrupt| 1 << interrupt)
                });
                self.pending &= !bits | self.lines & !running;
            }
            0x300..0x360 => {
                let first = (offset - 0x300) as usize;
                let bits = self.priority_bits();
                for (index, priority) in self.priorities[first..first + 4].iter_mut().enumerate() {
                    if mask >> (8 * index) & 0xff != 0 {
                        *priority = (value >> (8 * index)) as u8 & bits;
                    }
                }
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NO_MASKS: Masks = Masks { primask: false, faultmask: false, basepri: 0 };

    fn enabled(priorities: &[(u8, u8)]) -> Nvic {
        let mut nvic = Nvic::new(CoreKind::CortexM4F);
        for (interrupt, priority) in priorities {
            nvic.enabled |= 1 << interrupt;
            nvic.priorities[usize::from(*interrupt)] = *priority;
        }
        nvic
    }

    #[test]
    fn the_most_urgent_comes_first_and_preempts_only_less_urgent() {
        let mut nvic = enabled(&[(28, 0x40), (50, 0x40), (71, 0x20)]);
        nvic.set_lines(1 << 50 | 1 << 28);
        assert_eq!(nvic.next(NO_MASKS), Some(16 + 28), "equal priority: lower number");
        nvic.activate(16 + 28);
        assert_eq!(nvic.next(NO_MASKS), None, "equal priority does not preempt");
        nvic.set_lines(1 << 50 | 1 << 28 | 1 << 71);
        assert_eq!(nvic.next(NO_MASKS), Some(16 + 71));
    }

    #[test]
    fn masks_block_their_exceptions() {
        let mut nvic = enabled(&[(28, 0x40), (71, 0x20)]);
        nvic.set_lines(1 << 28 | 1 << 71);
        let basepri = |basepri| Masks { basepri, ..NO_MASKS };
        assert_eq!(nvic.next(basepri(0x40)), Some(16 + 71));
        assert_eq!(nvic.next(basepri(0x20)), None);
        let primask = Masks { primask: true, ..NO_MASKS };
        assert_eq!(nvic.next(primask), None);
        nvic.pend(number::NMI);
        assert_eq!(nvic.next(primask), Some(number::NMI));
        nvic.unpend(number::NMI);
        nvic.pend(number::HARD_FAULT);
        assert_eq!(nvic.next(primask), Some(number::HARD_FAULT));
        assert_eq!(nvic.next(Masks { faultmask: true, ..NO_MASKS }), None);
    }

    #[test]
    fn a_priority_group_preempts_as_one() {
        let mut nvic = enabled(&[(28, 0x50), (71, 0x40)]);
        nvic.set_group(3);
        nvic.activate(16 + 28);
        nvic.set_lines(1 << 71);
        assert_eq!(nvic.next(NO_MASKS), Some(16 + 71), "bit 4 is the lowest of the subpriority");
        nvic.set_group(4);
        assert_eq!(nvic.next(NO_MASKS), None, "0x40 and 0x50 are one group");
    }

    #[test]
    fn a_line_that_stays_high_pends_again() {
        let mut nvic = enabled(&[(28, 0)]);
        nvic.set_lines(1 << 28);
        nvic.activate(16 + 28);
        assert_eq!(nvic.next(NO_MASKS), None);
        nvic.deactivate(16 + 28);
        assert_eq!(nvic.next(NO_MASKS), Some(16 + 28));
        nvic.set_lines(0);
        assert_eq!(nvic.next(NO_MASKS), Some(16 + 28), "pending exceptions stay pending");
        nvic.write(0x180, 1 << 28, !0);
        assert_eq!(nvic.next(NO_MASKS), None);
    }

    #[test]
    fn registers_have_the_manuals_addresses() {
        let mut nvic = Nvic::new(CoreKind::CortexM4F);
        nvic.write(0x008, 1 << 7, !0); // NVIC_ISER2: USART6
        assert_eq!(nvic.read(0x008), 1 << 7);
        assert_eq!(nvic.read(0x088), 1 << 7, "NVIC_ICER2 reads the same");
        nvic.write(0x344, 0x5f00_0000, 0xff00_0000); // NVIC_IPR17, byte 3: interrupt 71
        assert_eq!(nvic.read(0x344), 0x5000_0000, "four bits");
        nvic.write(0x088, 1 << 7, !0);
        assert_eq!(nvic.read(0x008), 0);
    }

    #[test]
    fn a_cortex_m0_has_32_interrupts_and_two_bits_of_priority() {
        let mut nvic = Nvic::new(CoreKind::CortexM0);
        nvic.write(0x000, !0, !0);
        nvic.write(0x004, !0, !0);
        assert_eq!([nvic.read(0x000), nvic.read(0x004)], [!0, 0]);
        nvic.write(0x300, 0xffff_ffff, !0);
        assert_eq!(nvic.read(0x300), 0xc0c0_c0c0);
        nvic.pend_interrupt(32);
        assert_eq!(nvic.next(NO_MASKS), None);
    }

    #[test]
    fn interrupts_that_do_not_exist_are_ignored() {
        let mut nvic = Nvic::new(CoreKind::CortexM4F);
        nvic.write(0x00c, !0, !0);
        nvic.write(0x10c, !0, !0);
        nvic.pend_interrupt(96);
        assert_eq!(nvic.next(NO_MASKS), None);
    }
}
