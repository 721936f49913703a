//! The flight executor: tasks that interrupt the script and the link's tasks.
//!
//! A sample of the inertial sensors is due every millisecond, and a slice of the script takes up to
//! half of one. The tasks here therefore run in an interrupt of their own, that of the unused UART5,
//! which preempts the thread executor. Its priority is below the sensors' interrupts and above all
//! others (see [`crate::critical`]).
//!
//! * [`sensors`] reads gyroscope and accelerometer at each data-ready pulse, and the barometer after
//!   every 20th, once the motors are set.
//! * [`mod@start`] tests and starts the sensors, [`frozen`] detects those that repeat their values, and
//!   [`fault`] has the reasons why they are not fit for flight.
//! * [`control`] estimates, controls and drives the motors after each sample.
//! * [`pilot_desk`] hands commands and plans of the thread executor over.
//! * [`data_ready`] is the event of that pulse.
//! * [`state`] holds the last sample and the counters, for tasks of both executors.
//! * [`report`] writes to the log for the tasks here: they interrupt those that write to it, and the
//!   log checks its room before it writes, so they must not do it themselves.
//!
//! **Not tried on hardware.**

mod control;
pub mod data_ready;
pub mod fault;
mod frozen;
pub mod pilot_desk;
pub mod report;
mod sensors;
mod start;
pub mod state;

use embassy_executor::InterruptExecutor;
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::typelevel::{Binding, Handler, Interrupt, UART5};

use crate::bus::Bus;
use bittybuzz_flight::FlightState;
use bittybuzz_flight::pilot::PilotSettings;
use bittybuzz_flight::planner::{FlightLimits, PositionFence};
use bittybuzz_flight::stack::{FlightStack, StackSettings};
use bittybuzz_runtime::liveness::Pulse;
use control::Controller;
use data_ready::DataReady;
use static_cell::StaticCell;

/// The interrupt of the executor, that of an unused peripheral.
pub const INTERRUPT: interrupt::Interrupt = UART5::IRQ;

static EXECUTOR: InterruptExecutor = InterruptExecutor::new();

/// The interrupt of the executor.
pub struct Interrupts;

impl Handler<UART5> for Interrupts {
    unsafe fn on_interrupt() {
        state::count_wake_up();
        // SAFETY: this is the handler of the executor's interrupt, which only `start` enables.
        unsafe { EXECUTOR.on_interrupt() };
    }
}

/// Starts the executor and its task. Call this function once.
///
/// # Parameters
/// `limits`: the limits of the flight and its fence; the pilot's own and none without them.
pub fn start(
    bus: Bus,
    data_ready: DataReady,
    limits: Option<(FlightLimits, PositionFence)>,
    pulse: Pulse,
    _irq: impl Binding<UART5, Interrupts>,
) {
    static STACK: StaticCell<FlightStack> = StaticCell::new();
    static COPY: StaticCell<FlightStack> = StaticCell::new();
    let own = (PilotSettings::CRAZYFLIE.limits, PositionFence::WIDE);
    let (limits, fence) = limits.unwrap_or(own);
    let settings = StackSettings { limits, fence, ..StackSettings::CRAZYFLIE_2_1_PLUS };
    // A robot that stands elsewhere adopts the place of its poses.
    let stack = || FlightStack::new(settings, &FlightState::default());
    let controller = Controller::new(STACK.init_with(stack));
    pilot_desk::lend(COPY.init_with(stack));
    let spawner = EXECUTOR.start(INTERRUPT);
    spawner.spawn(defmt::unwrap!(sensors::read_sensors(bus, data_ready, controller, pulse)));
}
