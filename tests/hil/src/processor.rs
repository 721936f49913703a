//! The processor of a test.
//!
//! A test and its emulators wait for each other thousands of times per second of a robot. On one
//! processor such a turn costs a switch between two tasks. On two it costs a wake-up of the other
//! one, which takes ten times as long in a virtual machine. Tests of several robots took twice the
//! processor time without this module.

/// Keeps the calling thread, and the programs that it starts from now on, on one processor until the
/// thread ends. Threads share the processors evenly. Without effect on systems other than Linux.
#[cfg(not(target_os = "linux"))]
pub fn stay() {}

#[cfg(target_os = "linux")]
pub use linux::stay;

#[cfg(target_os = "linux")]
mod linux {
    use std::cell::OnceCell;
    use std::collections::BTreeMap;
    use std::sync::{Mutex, MutexGuard, PoisonError};

    use nix::sched::{CpuSet, sched_getaffinity, sched_setaffinity};
    use nix::unistd::Pid;

    /// The calling thread.
    const THIS: Pid = Pid::from_raw(0);

    /// The number of threads on each processor.
    static THREADS: Mutex<BTreeMap<usize, usize>> = Mutex::new(BTreeMap::new());

    thread_local! {
        static SEAT: OnceCell<Option<Seat>> = const { OnceCell::new() };
    }

    /// The place of a thread on a processor.
    struct Seat(usize);

    pub fn stay() {
        SEAT.with(|seat| {
            seat.get_or_init(Seat::take);
        });
    }

    /// A test that failed has left the numbers whole.
    fn threads() -> MutexGuard<'static, BTreeMap<usize, usize>> {
        THREADS.lock().unwrap_or_else(PoisonError::into_inner)
    }

    impl Seat {
        /// Returns `None` if the system does not allow it; the tests are slower then.
        fn take() -> Option<Seat> {
            let allowed = sched_getaffinity(THIS).ok()?;
            let mut threads = threads();
            let on = |processor: usize| threads.get(&processor).copied().unwrap_or(0);
            let processor = (0..CpuSet::count())
                .filter(|processor| allowed.is_set(*processor) == Ok(true))
                .min_by_key(|processor| on(*processor))?;
            let mut one = CpuSet::new();
            one.set(processor).ok()?;
            sched_setaffinity(THIS, &one).ok()?;
            *threads.entry(processor).or_default() += 1;
            Some(Seat(processor))
        }
    }

    impl Drop for Seat {
        fn drop(&mut self) {
            if let Some(count) = threads().get_mut(&self.0) {
                *count -= 1;
            }
        }
    }
}
