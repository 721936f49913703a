//! BittyBuzz for Zooids: runs a Buzz script on the STM32F051, with the nRF24L01+ as its radio and a
//! projector as its positioning system.
//!
//! **Not tried on hardware**: the image is tested in emulation (`emulation/`) only.
//!
//! # Tasks
//! | task | function |
//! |---|---|
//! | [`run_script`] | the virtual machine at 10 Hz, in slices of at most 500 µs |
//! | [`drive_motors`] | finds positions, drives the motors, and stops them when set-points expire |
//! | [`radio::talk`] | exchanges swarm messages with all other robots |
//! | [`sensors::sense`] | reads battery, charger and touch sensor |
//! | [`leds::shine`] | shows the script's color or a failure on the LED |
//! | [`watchdog::feed`] | feeds the watchdog while all other tasks live |

#![no_std]
#![no_main]

mod clock;
mod edges;
mod eyes;
mod failure;
mod functions;
mod i2c;
mod integers;
mod leds;
mod memory;
mod motors;
mod pins;
mod radio;
mod section;
mod sensors;
mod settings;
mod time;
mod touch;
mod watchdog;

mod robot {
    //! Generated from `robots/zooids/robot.toml`.
    #![allow(dead_code, reason = "the robot file has more than this firmware uses")]
    include!(concat!(env!("OUT_DIR"), "/robot.rs"));
}

use bittybuzz_board::log::{error, info, warning};
use bittybuzz_comms::nrf24::MESSAGE_MAX;
use bittybuzz_motion::drive::Pilot;
use bittybuzz_runtime::battery::Charge;
use bittybuzz_runtime::id::Id;
use bittybuzz_runtime::liveness::{Liveness, Pulse};
use bittybuzz_runtime::script;
use bittybuzz_runtime::setpoint::{self, SetpointWriter};
use bittybuzz_vm_core::number::Tiny;
use bittybuzz_vm_core::seal::{self, SealedImage};
use bittybuzz_vm_core::{ByteCode, Part, Vm, features};
#[cfg(feature = "defmt")]
use defmt_rtt as _;
use embassy_executor::{SpawnError, SpawnToken, Spawner};
use embassy_stm32::gpio::{Input, Pull};
use embassy_time::Duration;
use static_cell::{ConstStaticCell, StaticCell};

use eyes::Eyes;
use failure::Failure;
use functions::Zooid;
use leds::{Led, Light, LightChannel};

use motors::{Drive, Motors};
use radio::nrf24::Nrf24;
use settings::setting;
use touch::Touch;

/// The room for the lines that the script prints in a slice, in bytes. Only defmt reads it.
const LOG_BYTES: usize = if cfg!(feature = "defmt") { 256 } else { 0 };

bittybuzz_runtime::tasks! {
    /// The tasks that the watchdog observes. The log prints their names.
    #[cfg_attr(feature = "defmt", derive(defmt::Format))]
    pub enum Task { Script, Leds, Motors, Radio, Sensors }
}

static TASKS: Liveness<Task> = Liveness::new();
static SETPOINTS: setpoint::Channel<Drive> = setpoint::Channel::new();
static LIGHT: LightChannel = LightChannel::new();

const SLOTS: usize = robot::SLOTS + robot::SIZES.slots();
type Machine = Vm<Tiny, section::Section, SLOTS>;
type ScriptTask = script::ScriptTask<Tiny, section::Section, Zooid, SLOTS>;

/// The number that stands for everything that the robot offers to scripts. A sealed image must
/// match it.
const OFFERED: u16 = seal::robot::<Tiny>(
    features::<Tiny>(),
    robot::SIZES,
    section::Section::PARTS,
    robot::FUNCTIONS,
);

/// The virtual machine takes no more memory than the robot file promises.
const _: () = assert!(size_of::<Machine>() <= robot::MEMORY - robot::QUEUE_MEMORY);
/// A message with its sender and position fits a payload of the radio.
const _: () = assert!(robot::FRAME_BYTES <= MESSAGE_MAX);
/// The virtual machine has the parts for which scripts are compiled.
const _: () = assert!(robot::MATHS == section::Section::PARTS.has(Part::Maths));

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let failure = failure::take();
    let watchdog = watchdog::start();
    if failure.is_some() {
        leds::light_red();
    }
    let chip = embassy_stm32::init(clock::config());
    time::start();
    pins::connect();
    clock::feed_radio();

    // The cast is safe, since the robot file limits this setting to 60.
    let minimum = setting(robot::setting::MINIMUM_DUTY).map(|duty| duty as u8);
    let motors = Motors::new(Pilot::new(minimum), Eyes::open());
    let led = Led::new();
    let radio = Nrf24::new(chip.PA4, chip.PB0);
    let charger = Input::new(chip.PB13, Pull::None);
    let touch = Touch::new(chip.PB2);
    sensors::begin(&charger);
    edges::watch();

    let id = settings::id();
    let robot_id = id.number();
    info!("BittyBuzz on {=str}, not tried on hardware", robot::NAME);
    match id {
        Id::Assigned(_id) => info!("robot id {=u16}", _id),
        Id::OfChip(_id) => warning!(
            "robot id {=u16}, from the chip's unique id: `bbz flash --id` assigns one",
            _id
        ),
    }

    let zooid = Zooid::new(&LIGHT, SetpointWriter::new(&SETPOINTS));
    let pulse = |task| TASKS.pulse(task);
    static LOG: ConstStaticCell<[u8; LOG_BYTES]> = ConstStaticCell::new([0; LOG_BYTES]);
    static VM: ConstStaticCell<Machine> = ConstStaticCell::new(Vm::new());
    static SCRIPT: StaticCell<ScriptTask> = StaticCell::new();
    let vm = VM.take();
    vm.set_network_capacity(robot::SIZES);
    let script = SCRIPT.init(ScriptTask::new(vm, robot_id, zooid, pulse(Task::Script), LOG.take()));
    // After any other failure the charger must not restart the robot.
    let watches_battery = matches!(failure, None | Some(Failure::FlatBattery));
    match failure {
        None => {}
        Some(Failure::FlatBattery) => {
            sensors::set_charge(Charge::Flat);
            error!("the battery is flat: the robot does nothing until it is charged, or power-on");
        }
        Some(_failure) => {
            error!("restarted after {}: no script runs until power-on", _failure);
            LIGHT.signal(Light::Stopped);
        }
    }
    start(spawner, run_script(script, failure.is_none()));
    start(spawner, leds::shine(&LIGHT, led, pulse(Task::Leds)));
    start(spawner, drive_motors(motors, pulse(Task::Motors)));
    start(spawner, radio::talk(radio, robot_id, pulse(Task::Radio)));
    start(spawner, sensors::sense(charger, touch, watches_battery, pulse(Task::Sensors)));
    start(spawner, watchdog::feed(watchdog, &TASKS));
}

/// Starts a task. Each one is started once, so a place for it is free. If there were none, the
/// watchdog would reset the robot.
fn start<S>(spawner: Spawner, task: Result<SpawnToken<S>, SpawnError>) {
    if let Ok(task) = task {
        spawner.spawn(task);
    }
}

#[embassy_executor::task]
async fn run_script(script: &'static mut ScriptTask, may_run: bool) -> ! {
    if may_run {
        let load = |vm: &mut Machine| vm.load_sealed(SealedImage::new(section::image()), OFFERED);
        let period = Duration::from_hz(robot::TICK_HZ as u64);
        // The robot's id makes the random numbers of robots differ.
        let _ = script.run(load, 0, period).await;
        info!("the script has stopped");
    }
    script.rest().await
}

#[embassy_executor::task]
async fn drive_motors(mut motors: Motors, pulse: Pulse) -> ! {
    setpoint::drive(&SETPOINTS, &mut motors, pulse).await
}
