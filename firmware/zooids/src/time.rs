//! The time driver: TIM3 counts µs, and its channel 2 is the alarm (RM0091 18.3.8).
//!
//! The driver of embassy-stm32 0.6.0 takes 0.7 kB more. Whenever a task begins to wait, that driver
//! examines all waiting tasks and sets the alarm, which was a third of the instructions of a
//! driving robot. This driver examines all tasks only when the alarm comes, and otherwise sets the
//! alarm only to an earlier time.

use core::cell::RefCell;
use core::sync::atomic::{AtomicU32, Ordering};
use core::task::Waker;

use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::pac;
use embassy_stm32::pac::timer::regs::SrGp16;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_time_driver::{Driver, TICK_HZ, time_driver_impl};
use embassy_time_queue_utils::Queue;

const PRESCALER: u16 = 48;
const _: () = assert!(48_000_000 / PRESCALER as u64 == TICK_HZ);

/// The bits of half of the counter's period. Channel 1 marks the end of the first half, and the
/// overflow that of the second.
const HALF_BITS: u32 = 15;
/// The indices of the channels in the register crate, which counts from 0.
const MIDDLE: usize = 0;
const ALARM: usize = 1;

/// The clock.
struct Clock {
    /// The number of halves of the counter's period that have passed.
    halves: AtomicU32,
    alarm: Mutex<CriticalSectionRawMutex, RefCell<Alarm>>,
}

time_driver_impl!(static CLOCK: Clock = Clock {
    halves: AtomicU32::new(0),
    alarm: Mutex::new(RefCell::new(Alarm { queue: Queue::new(), at: u64::MAX })),
});

/// The waiting tasks, and the time of the alarm, which is at or before the earliest of their times.
struct Alarm {
    queue: Queue,
    at: u64,
}

impl Alarm {
    /// Sets the alarm. The hardware compares only the low 16 bits of the time, so the alarm may
    /// come too early; such an alarm does nothing.
    ///
    /// Inlined because the interrupt calls it where the stack is deepest.
    #[inline(always)]
    fn set(&mut self, at: u64) {
        self.at = at;
        pac::TIM3.ccr(ALARM).write(|w| w.set_ccr(at as u16));
        // The counter no longer matches a time in the past, so the program triggers the event
        // (18.4.6).
        if at <= CLOCK.now() {
            pac::TIM3.egr().write(|w| w.set_ccg(ALARM, true));
        }
    }

    /// Wakes the tasks whose time has come, and sets the next alarm.
    fn wake(&mut self, now: u64) {
        if self.at <= now {
            let next = self.queue.next_expiration(now);
            self.set(next);
        }
    }
}

impl Driver for Clock {
    fn now(&self) -> u64 {
        let halves = self.halves.load(Ordering::Relaxed);
        // The counter is read after the halves. Its highest bit gives the current half, because the
        // interrupt that counts halves may be pending.
        let count = u32::from(pac::TIM3.cnt().read().cnt());
        let halves = halves.wrapping_add((count >> HALF_BITS ^ halves) & 1);
        u64::from(halves) << HALF_BITS | u64::from(count & ((1 << HALF_BITS) - 1))
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        self.alarm.lock(|alarm| {
            // Only one task holds the alarm at a time, so the borrow always succeeds.
            if let Ok(mut alarm) = alarm.try_borrow_mut()
                && alarm.queue.schedule_wake(at, waker)
                && at < alarm.at
            {
                alarm.set(at);
            }
        });
    }
}

/// Returns the time in µs, modulo 65536.
#[inline(always)]
pub fn clock_us() -> u16 {
    pac::TIM3.cnt().read().cnt()
}

/// Starts the clock.
pub fn start() {
    let timer = pac::TIM3;
    pac::RCC.apb1enr().modify(|w| w.set_tim3en(true));
    timer.psc().write_value(PRESCALER - 1);
    timer.arr().write(|w| w.set_arr(u16::MAX));
    timer.ccr(MIDDLE).write(|w| w.set_ccr(1 << HALF_BITS));
    timer.egr().write(|w| w.set_ug(true));
    timer.sr().write_value(SrGp16(0));
    timer.dier().write(|w| {
        w.set_uie(true);
        w.set_ccie(MIDDLE, true);
        w.set_ccie(ALARM, true);
    });
    timer.cr1().write(|w| w.set_cen(true));
    // SAFETY: everything that the handler needs exists from the start, and no code relies on the
    // interrupt being off.
    unsafe { interrupt::TIM3.enable() };
}

#[embassy_stm32::interrupt]
fn TIM3() {
    let timer = pac::TIM3;
    let flags = timer.sr().read();
    // Ones leave flags unchanged: those that were set meanwhile, and those of captures, which
    // belong to the DMA controller.
    let mut seen = SrGp16(u32::MAX);
    seen.set_uif(!flags.uif());
    seen.set_ccif(MIDDLE, !flags.ccif(MIDDLE));
    seen.set_ccif(ALARM, !flags.ccif(ALARM));
    timer.sr().write_value(seen);
    let halves = u32::from(flags.uif()) + u32::from(flags.ccif(MIDDLE));
    if halves != 0 {
        CLOCK
            .halves
            .store(CLOCK.halves.load(Ordering::Relaxed).wrapping_add(halves), Ordering::Relaxed);
    }
    CLOCK.alarm.lock(|alarm| {
        if let Ok(mut alarm) = alarm.try_borrow_mut() {
            alarm.wake(CLOCK.now());
        }
    });
}
