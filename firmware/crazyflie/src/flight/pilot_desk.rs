//! The copy of the flight controller on which tasks of the thread executor give commands and make plans.
//!
//! A plan takes up to 0.8 ms, and a flight that waited for it would be late. The copy is a single
//! one. It lies with the flight task's last content ([`lend`]), or with a task's commands for the
//! flight task; whoever works on it has taken it, so nobody waits for anybody. The flight task runs
//! in an interrupt and never while it would have to wait for a copy in use: it leaves that one to its
//! user, and flies on.

use core::sync::atomic::AtomicBool;

use bittybuzz_flight::FlightState;
use bittybuzz_flight::stack::FlightStack;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;

type Place = Channel<CriticalSectionRawMutex, &'static mut FlightStack, 1>;

/// The copy with the flight task's content.
static LENT: Place = Channel::new();
/// The copy with commands.
static RETURNED: Place = Channel::new();

/// Set when a plan is due that only a task of the thread executor makes.
pub static PLAN_DUE: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// True when a person disarmed the robot, until the flight task has stopped the motors.
pub static DISARM: AtomicBool = AtomicBool::new(false);

/// True once a person stopped the motors until power-on.
pub static EMERGENCY_STOP: AtomicBool = AtomicBool::new(false);

/// The state that a robot on the ground adopts, since a ground station asked for it.
pub static ADOPTED: Signal<CriticalSectionRawMutex, FlightState> = Signal::new();

/// Takes the copy with commands, for the flight task.
pub(super) fn take_returned() -> Option<&'static mut FlightStack> {
    RETURNED.try_receive().ok()
}

/// Takes the copy that no task uses, for the flight task.
pub(super) fn take_unused() -> Option<&'static mut FlightStack> {
    LENT.try_receive().ok()
}

/// Gives the copy to the tasks.
pub(super) fn lend(copy: &'static mut FlightStack) {
    // There is one copy, so its place is free.
    let _ = LENT.try_send(copy);
}

/// Lets a task of the thread executor look at the copy, and act on it if `act` returns true with its
/// result.
pub fn look<R>(act: impl FnOnce(&mut FlightStack) -> (R, bool)) -> Option<R> {
    let (copy, has_commands) = match RETURNED.try_receive() {
        Ok(copy) => (copy, true),
        Err(_) => (LENT.try_receive().ok()?, false),
    };
    let (result, acts) = act(copy);
    let place = if has_commands || acts { &RETURNED } else { &LENT };
    let _ = place.try_send(copy);
    Some(result)
}

/// Lets a task of the thread executor act on the copy; the flight task takes its commands within a
/// millisecond while the sensors run. Returns `None` before the flight task was started.
pub fn command<R>(act: impl FnOnce(&mut FlightStack) -> R) -> Option<R> {
    // Commands that the flight task has not taken yet are completed.
    look(|copy| (act(copy), true))
}

/// Runs the task that makes the plans that are due.
#[embassy_executor::task]
pub async fn make_plans() -> ! {
    loop {
        PLAN_DUE.wait().await;
        command(FlightStack::plan_what_is_due);
    }
}
