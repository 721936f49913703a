//! BittyBuzz for the Bitcraze Crazyflie 2.x: runs a Buzz script on the STM32F405, with the nRF51822
//! as its radio.
//!
//! **Not tried on hardware**: the image is tested in emulation (`emulation/`) only.
//!
//! # Tasks
//! | task | function |
//! |---|---|
//! | [`run_script`] | the virtual machine at 10 Hz, in slices of at most 500 µs |
//! | [`drive_motors`] | applies the script's set-points, and stops the motors when they expire |
//! | [`link::receive`] | handles frames of the nRF51: radio, battery, shutdown |
//! | [`link::send`] | sends frames to the nRF51 |
//! | [`link::station`] | executes the packets of a ground station |
//! | [`link::swarm`] | sends swarm messages to all other robots |
//! | [`battery::watch_battery`] | warns of an empty battery, stops the motors, switches off |
//! | [`leds::show_status`] | drives the two LEDs of the firmware |
//! | [`decks::find_decks`] | reads the memories of the decks |
//! | [`decks::ranging`], [`decks::flow`] | read the sensors of the decks |
//! | [`flight::report`] | writes the log of the flight task |
//! | [`flight::pilot_desk`] | makes the plans that the flight task needs |
//! | [`feed_watchdog`] | feeds the watchdog while all tasks live that it observes |
//!
//! One task runs above these, in the [`flight`] executor: 1,000 times per second it reads gyroscope and
//! accelerometer, estimates the state of the robot, and drives the motors.
//!
//! # Flight
//! The script's functions command the [`pilot`], which needs the permission of a person. The robot's
//! position comes from a ground station. `set_motor` turns single motors on the ground, with at most
//! 30 % of full power.

#![no_std]
#![no_main]

mod battery;
mod board;
mod bus;
mod clock;
mod complete;
mod configuration;
mod critical;
mod decks;
mod failure;
mod flight;
mod functions;
mod leds;
mod link;
mod motors;
mod pilot;
mod readiness;
mod section;
mod settings;
mod watchdog;

mod robot {
    //! Generated from `robots/crazyflie/robot.toml`.
    #![allow(dead_code, reason = "the robot file has more than this firmware uses")]
    include!(concat!(env!("OUT_DIR"), "/robot.rs"));
}

use core::cell::RefCell;

use bittybuzz_board::log;
use bittybuzz_comms::syslink::SWARM_MESSAGE_MAX;
use bittybuzz_crazyflie_machine::SLOTS;
use bittybuzz_crtp::Identity;
use bittybuzz_runtime::id::Id;
use bittybuzz_runtime::liveness::{CHECK_PERIOD, Liveness, Pulse};
use bittybuzz_runtime::script;
use bittybuzz_runtime::setpoint::{self, SetpointWriter};
use bittybuzz_station::Station;
use bittybuzz_vm_core::{ByteCode, Image, Part, Vm};
use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_stm32::peripherals::{DMA2_CH0, DMA2_CH3};
use embassy_stm32::{bind_interrupts, dma};
use embassy_time::{Duration, Timer};
use static_cell::{ConstStaticCell, StaticCell};

use bus::Bus;
use decks::flow::FlowDevice;
use flight::data_ready::DataReady;
use functions::Crazyflie;
use leds::{ScriptLeds, Status, StatusChannel, StatusLeds};
use link::uart::Interrupts;
use motors::{GroundMotors, Powers};
use robot::Numbers;

bind_interrupts!(struct Irqs {
    USART6 => Interrupts;
    EXTI4 => Interrupts;
    USART1 => Interrupts;
    I2C3_EV => bus::Interrupts;
    I2C3_ER => bus::Interrupts;
    DMA1_STREAM2 => bus::Interrupts;
    I2C1_EV => bus::Interrupts;
    I2C1_ER => bus::Interrupts;
    DMA1_STREAM0 => bus::Interrupts;
    DMA2_STREAM0 => dma::InterruptHandler<DMA2_CH0>;
    DMA2_STREAM3 => dma::InterruptHandler<DMA2_CH3>;
    EXTI15_10 => flight::data_ready::Interrupts;
    UART5 => flight::Interrupts;
});

bittybuzz_runtime::tasks! {
    /// The tasks that the watchdog observes. The log prints their names.
    #[derive(defmt::Format)]
    enum Task { Script, Motors, Receive, Send, Swarm, Battery, Leds, Sensors }
}

static TASKS: Liveness<Task> = Liveness::new();
static SETPOINTS: setpoint::Channel<Powers> = setpoint::Channel::new();
static STATUS: StatusChannel = StatusChannel::new();

/// The room for the lines that the script prints in a slice, in bytes.
const LOG_BYTES: usize = 1024;

/// The machine has the type of which another crate has the quick loop.
const _: () = assert!(SLOTS == robot::SLOTS + robot::SIZES.slots());
type Machine = Vm<Numbers, section::Section, SLOTS>;
type ScriptTask = script::ScriptTask<Numbers, section::Section, Crazyflie, SLOTS>;

/// The virtual machine takes no more memory than the robot file promises.
const _: () = assert!(size_of::<Machine>() <= robot::MEMORY - robot::QUEUE_MEMORY);
const _: () = assert!(size_of_val(&link::swarm::MAIL) <= robot::QUEUE_MEMORY);
/// A message with its sender and position fits a frame of the radio.
const _: () = assert!(robot::FRAME_BYTES <= SWARM_MESSAGE_MAX);
/// The virtual machine has the parts for which scripts are compiled.
const _: () = assert!(robot::MATHS == section::Section::PARTS.has(Part::Maths));

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    // The watchdog starts before anything waits. If the crystal never oscillates, it resets the
    // robot.
    watchdog::start();
    let failure = failure::take();
    if failure.is_some() {
        leds::light_red();
    }
    let mut core = defmt::unwrap!(cortex_m::Peripherals::take());
    critical::set_priorities(&mut core.NVIC);
    let mut config = clock::config();
    // The default is 0, which critical sections do not mask.
    config.dma_interrupt_priority = critical::DMA;
    let p = embassy_stm32::init(config);

    let board = board::check();
    if board.is_ok() {
        let pins = motors::Pins { m1: p.PA1, m2: p.PB11, m3: p.PA15, m4: p.PB9 };
        motors::set_up(p.TIM2, p.TIM4, pins);
    }
    let script_leds = ScriptLeds::new(p.PC0, p.PC1, p.PD2);
    let status_leds = StatusLeds::new(p.PC2, p.PC3);
    let (receiver, sender) = link::uart::open(p.USART6, p.PC6, p.PC7, p.PA4, Irqs);
    let bus = Bus::sensors(p.I2C3, p.DMA1_CH2, p.PA8, p.PC9, Irqs);
    let mut expansion = Bus::expansion(p.I2C1, p.DMA1_CH0, p.PB6, p.PB7, Irqs);
    let flow = FlowDevice::new(p.SPI1, p.PA5, p.PA6, p.PA7, p.PB4, p.DMA2_CH3, p.DMA2_CH0, Irqs);
    let data_ready = DataReady::new(p.PC14, Irqs);

    let id = settings::id();
    let robot_id = id.number();
    log::info!("BittyBuzz on {=str}, not tried on hardware", robot::NAME);
    log::info!("set_motor gives motors at most {=u8} of 255", motors::POWER_MAX);
    match id {
        Id::Assigned(id) => log::info!("robot id {=u16}", id),
        Id::OfChip(id) => log::warning!(
            "robot id {=u16}, from the chip's unique id: `bbz flash --id` assigns one",
            id
        ),
    }

    // The other tasks begin afterwards: this takes a millisecond, and 15 ms with a bus that is held.
    let configuration = configuration::load(&mut expansion).await;

    let may_run = failure.is_none() && board.is_ok();
    static STATION: StaticCell<RefCell<Station>> = StaticCell::new();
    let [radio_id, ..] = configuration.radio.address;
    let identity = Identity { id: radio_id, firmware: link::station::FIRMWARE, device: "CF21" };
    let station: &'static RefCell<Station> =
        STATION.init_with(|| RefCell::new(Station::new(identity)));
    settings::limit(&mut station.borrow_mut());
    let setpoint = SetpointWriter::new(&SETPOINTS);
    let crazyflie = Crazyflie::new(script_leds, setpoint, &STATUS, station, robot_id);
    let pulse = |task| TASKS.pulse(task);
    static LOG: ConstStaticCell<[u8; LOG_BYTES]> = ConstStaticCell::new([0; LOG_BYTES]);
    static VM: ConstStaticCell<Machine> = ConstStaticCell::new(Vm::new());
    static SCRIPT: StaticCell<ScriptTask> = StaticCell::new();
    let vm = VM.take();
    vm.set_network_capacity(robot::SIZES);
    let script =
        SCRIPT.init(ScriptTask::new(vm, robot_id, crazyflie, pulse(Task::Script), LOG.take()));
    if let Some(failure) = failure {
        log::error!("restarted after {}: no script runs until power-on", failure);
        STATUS.signal(Status::Stopped);
    }
    if let Err(other) = board {
        log::error!("this is {}: its motors differ, none turns and no script runs", other);
        STATUS.signal(Status::Stopped);
    }
    // Each task is spawned once, so a place for it is free.
    spawner.spawn(defmt::unwrap!(run_script(script, may_run)));
    spawner.spawn(defmt::unwrap!(drive_motors(pulse(Task::Motors))));
    spawner.spawn(defmt::unwrap!(link::receive::receive_frames(
        receiver,
        configuration.radio,
        robot_id,
        pulse(Task::Receive)
    )));
    spawner.spawn(defmt::unwrap!(link::station::serve(station, may_run)));
    spawner.spawn(defmt::unwrap!(link::send::send_frames(sender, pulse(Task::Send))));
    spawner.spawn(defmt::unwrap!(link::swarm::broadcast_messages(robot_id, pulse(Task::Swarm))));
    spawner.spawn(defmt::unwrap!(battery::watch_battery(pulse(Task::Battery))));
    spawner.spawn(defmt::unwrap!(leds::show_status(&STATUS, status_leds, pulse(Task::Leds))));
    spawner.spawn(defmt::unwrap!(decks::find_decks()));
    spawner.spawn(defmt::unwrap!(decks::ranging::measure_ranges(expansion)));
    spawner.spawn(defmt::unwrap!(decks::flow::measure_flow(flow)));
    spawner.spawn(defmt::unwrap!(flight::report::write_reports()));
    spawner.spawn(defmt::unwrap!(flight::pilot_desk::make_plans()));
    spawner.spawn(defmt::unwrap!(feed_watchdog()));
    let limits = station.borrow().limits();
    flight::start(bus, data_ready, limits, pulse(Task::Sensors), Irqs);
}

#[embassy_executor::task]
async fn run_script(script: &'static mut ScriptTask, may_run: bool) -> ! {
    if may_run {
        let load = |vm: &mut Machine| vm.load(Image::new(section::image()), robot::is_function);
        let period = Duration::from_hz(robot::TICK_HZ as u64);
        // The robot's id makes the random numbers of robots differ.
        let _ = script.run(load, 0, period).await;
        log::info!("the script has stopped");
    }
    script.rest().await
}

#[embassy_executor::task]
async fn drive_motors(pulse: Pulse) -> ! {
    setpoint::drive(&SETPOINTS, &mut GroundMotors, pulse).await
}

#[embassy_executor::task]
async fn feed_watchdog() -> ! {
    watchdog::feed();
    loop {
        Timer::after(CHECK_PERIOD).await;
        if TASKS.all_live() {
            watchdog::feed();
        } else {
            for task in TASKS.missing() {
                log::error!("no sign of life from task {}", task);
            }
        }
    }
}
