//! The time that tasks wait by: TIM3 counts µs, and its channel 2 is the alarm (RM0091 18.3.8).
//!
//! embassy-stm32 0.6.0 has a driver, too, which takes 0.7 kB more. Whenever a task begins to wait, that driver looks at all tasks that
//! wait and sets the alarm anew, which was a third of what a robot executes that drives. Here all are looked at when the alarm
//! comes, and the alarm is set anew only to be earlier.

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

/// Half of the counter's period; channel 1 marks its end, the overflow that of the other half.
const HALF_BITS: u32 = 15;
/// Channels in the model of the registers.
const MIDDLE: usize = 0;
const ALARM: usize = 1;

/// The clock.
struct Clock {
    /// Halves of the counter's period that are over.
    halves: AtomicU32,
    alarm: Mutex<CriticalSectionRawMutex, RefCell<Alarm>>,
}

time_driver_impl!(static CLOCK: Clock = Clock {
    halves: AtomicU32::new(0),
    alarm: Mutex::new(RefCell::new(Alarm { queue: Queue::new(), at: u64::MAX })),
});

/// The waiting tasks, and a time not after the one at which the first of them is to be woken.
struct Alarm {
    queue: Queue,
    at: u64,
}

impl Alarm {
    /// Only the lower half of the time is compared: before that comes, other alarms may, which do nothing.
    fn set(&mut self, at: u64) {
        self.at = at;
        pac::TIM3.ccr(ALARM).write(|w| w.set_ccr(at as u16));
        // A time that is over does not match any more, so that the program sets the event (18.4.6).
        if at <= CLOCK.now() {
            pac::TIM3.egr().write(|w| w.set_ccg(ALARM, true));
        }
    }

    /// Wakes those for whom it is time.
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
        // The counter is read after it. Its highest bit gives the half; the interrupt that counts
        // halves may be pending.
        let count = u32::from(pac::TIM3.cnt().read().cnt());
        let halves = halves.wrapping_add((count >> HALF_BITS ^ halves) & 1);
        u64::from(halves) << HALF_BITS | u64::from(count & ((1 << HALF_BITS) - 1))
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        self.alarm.lock(|alarm| {
            // Only one task holds it at a time.
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

/// From now on time passes.
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
    // SAFETY: everything that the handler needs is there from the start, and nothing relies on it
    // being off.
    unsafe { interrupt::TIM3.enable() };
}

#[embassy_stm32::interrupt]
fn TIM3() {
    let timer = pac::TIM3;
    let flags = timer.sr().read();
    // Writing ones leaves flags that came meanwhile, and captures, which are the DMA controller's.
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
