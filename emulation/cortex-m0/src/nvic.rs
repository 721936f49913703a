//! Exceptions: which are pending, active and enabled, and which comes next (ARMv6-M B1.5, B3.4).

pub const HARD_FAULT: u8 = 3;
pub const SV_CALL: u8 = 11;
pub const PEND_SV: u8 = 14;
/// Interrupt n is exception 16 + n.
pub const FIRST_INTERRUPT: u8 = 16;
/// Priority of code that no exception runs: below all.
const THREAD: i16 = 256;

pub struct Nvic {
    pub enabled: u32,
    pub pending: u32,
    lines: u32,
    pub priorities: [u8; 32],
    /// Of SVCall and PendSV.
    pub sv_call_priority: u8,
    pub pend_sv_priority: u8,
    pub sv_call_pending: bool,
    pub pend_sv_pending: bool,
    /// Exceptions that have begun and not returned, innermost last.
    active: Vec<u8>,
}

impl Nvic {
    pub fn new() -> Self {
        Nvic {
            enabled: 0,
            pending: 0,
            lines: 0,
            priorities: [0; 32],
            sv_call_priority: 0,
            pend_sv_priority: 0,
            sv_call_pending: false,
            pend_sv_pending: false,
            active: Vec::new(),
        }
    }

    /// The levels of the interrupt lines: one that rises becomes pending.
    pub fn set_lines(&mut self, lines: u32) {
        self.pending |= lines & !self.lines;
        self.lines = lines;
    }

    /// NVIC_ICPR: a line that is high keeps its interrupt pending, unless that runs already.
    pub fn clear_pending(&mut self, bits: u32) {
        let running = self.active.iter().fold(0_u32, |running, active| {
            let interrupt = active.checked_sub(FIRST_INTERRUPT);
            running | interrupt.map_or(0, |interrupt| 1 << interrupt)
        });
        self.pending &= !bits | self.lines & !running;
    }

    /// Whether anything is pending that is enabled.
    pub fn any_pending(&self) -> bool {
        self.pending & self.enabled != 0 || self.sv_call_pending || self.pend_sv_pending
    }

    /// The exception that runs; 0 in thread mode.
    pub fn current(&self) -> u8 {
        self.active.last().copied().unwrap_or(0)
    }

    pub fn is_active(&self, exception: u8) -> bool {
        self.active.contains(&exception)
    }

    pub fn active_count(&self) -> usize {
        self.active.len()
    }

    pub fn activate(&mut self, exception: u8) {
        match exception {
            SV_CALL => self.sv_call_pending = false,
            PEND_SV => self.pend_sv_pending = false,
            FIRST_INTERRUPT.. => self.pending &= !(1 << (exception - FIRST_INTERRUPT)),
            _ => {}
        }
        self.active.push(exception);
    }

    /// The exception returns; an interrupt whose line is still high becomes pending again.
    pub fn deactivate(&mut self, exception: u8) {
        self.active.retain(|active| *active != exception);
        if let Some(interrupt) = exception.checked_sub(FIRST_INTERRUPT) {
            self.pending |= self.lines & 1 << interrupt;
        }
    }

    fn priority(&self, exception: u8) -> i16 {
        match exception {
            HARD_FAULT => -1,
            SV_CALL => i16::from(self.sv_call_priority),
            PEND_SV => i16::from(self.pend_sv_priority),
            FIRST_INTERRUPT.. => {
                i16::from(self.priorities[usize::from(exception - FIRST_INTERRUPT)])
            }
            _ => THREAD,
        }
    }

    /// Whether `exception` would be taken now.
    pub fn preempts(&self, exception: u8, primask: bool) -> bool {
        let active = self.active.iter().map(|active| self.priority(*active)).min();
        let running = active.unwrap_or(THREAD).min(if primask { 0 } else { THREAD });
        self.priority(exception) < running
    }

    /// The exception to be taken now: the most urgent, among equals the lowest number.
    pub fn next(&self, primask: bool) -> Option<u8> {
        let mut best = None;
        let mut consider = |exception: u8| {
            let candidate = (self.priority(exception), exception);
            if best.is_none_or(|best| candidate < best) {
                best = Some(candidate);
            }
        };
        if self.sv_call_pending {
            consider(SV_CALL);
        }
        if self.pend_sv_pending {
            consider(PEND_SV);
        }
        let mut interrupts = self.pending & self.enabled;
        while interrupts != 0 {
            consider(interrupts.trailing_zeros() as u8 + FIRST_INTERRUPT);
            interrupts &= interrupts - 1;
        }
        let (_, exception) = best?;
        self.preempts(exception, primask).then_some(exception)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_urgent_comes_first_and_preempts_only_less_urgent() {
        let mut nvic = Nvic::new();
        nvic.enabled = !0;
        for (interrupt, priority) in [(5, 0x40), (7, 0x40), (16, 0x00)] {
            nvic.priorities[interrupt] = priority;
        }
        nvic.set_lines(1 << 7 | 1 << 5);
        assert_eq!(nvic.next(true), None, "PRIMASK");
        assert_eq!(nvic.next(false), Some(16 + 5));
        nvic.activate(16 + 5);
        assert_eq!(nvic.next(false), None, "equal priority does not preempt");
        nvic.set_lines(1 << 7 | 1 << 5 | 1 << 16);
        assert_eq!(nvic.next(false), Some(16 + 16));
        nvic.deactivate(16 + 5);
        assert_ne!(nvic.pending & 1 << 5, 0, "a line that stays high asks again");
    }
}
