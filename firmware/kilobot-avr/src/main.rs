//! BittyBuzz for Kilobots: a Buzz script on the ATmega328P, with infrared light as its radio.
//!
//! **Not tried on hardware**: the image is tested in emulation (`emulation/`).
//!
//! One loop does everything in turn, and never waits: it takes the message that has come in, does what the overhead controller
//! wants, runs a slice of the script, sends a message when it is time. Interrupts only note pulses of light and the time. While
//! it sends, 4.4 ms, everything else stands still, as in kilolib.
//!
//! # Memory
//! Of 2,048 bytes the machine and its queues take at most [`toml::MEMORY`], all static; the rest is for drivers and stack.
//!
//! # What it will not do
//! `log`: nobody is there to read it. Receive programs: the robot's boot loader does.

#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

mod adc;
mod chip;
mod clock;
mod eeprom;
mod hear;
mod light;
mod motors;
mod power;
mod robot;
mod script;
mod section;
mod speak;

mod toml {
    //! Generated from `robots/kilobot/robot.toml`.
    #![allow(dead_code, reason = "the robot file tells more than this firmware uses")]
    include!(concat!(env!("OUT_DIR"), "/robot.rs"));
}

use core::arch::global_asm;
use core::mem::offset_of;

use bittybuzz_comms::infrared::{self, FaultReport};
use bittybuzz_kilobot::calibration::{self, DUTIES, ID, TRANSMITTERS};
use bittybuzz_kilobot::controller;
use bittybuzz_kilobot::distance::distance;
use bittybuzz_kilobot::light::{Blinker, Color, of_battery};
use bittybuzz_kilobot::mode::{Act, RobotMode};
use bittybuzz_kilobot::sender::Sender;
use bittybuzz_vm_core::{Sizes, Vm};

use chip::registers;
use robot::KilobotHost;
use script::{Machine, ScriptSchedule};

// avr-libc's float and memory functions are smaller and faster than those of compiler_builtins.
#[link(name = "m", kind = "static", modifiers = "-bundle")]
unsafe extern "C" {}

#[link(name = "c", kind = "static", modifiers = "-bundle")]
unsafe extern "C" {}

/// The machine's memory for other robots.
const SIZES: Sizes = Sizes {
    neighbors: toml::NEIGHBORS as u8,
    bearings: toml::BEARINGS != 0,
    entries: toml::STIGMERGY_ENTRIES as u8,
    swarms: toml::SWARMS as u8,
};
const SLOTS: usize = toml::SLOTS + SIZES.slots();

/// The machine takes no more memory than the robot file promises.
const _: () = assert!(size_of::<Machine>() <= toml::MEMORY - toml::QUEUE_MEMORY);

/// Nothing panics: with a panic left in it the program does not link.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    unsafe extern "C" {
        fn the_program_contains_a_panic() -> !;
    }
    // SAFETY: it does not exist, so this never links.
    unsafe { the_program_contains_a_panic() }
}

static mut BODY: App = App::new();

// A name for what the script is doing (`bittybuzz_kilobot::phase`), for emulators: nothing is added to the image.
global_asm!(
    ".global bbz_phase",
    ".set bbz_phase, {body} + {phase}",
    body = sym BODY,
    phase = const offset_of!(App, script.phase),
);

#[avr_device::entry]
fn main() -> ! {
    let was_stuck = power::was_stuck();
    static mut VM: Machine = Vm::new();
    let (vm, body) = (&raw mut VM, &raw mut BODY);
    // SAFETY: the only references to them; main runs once.
    let (vm, body) = unsafe { (&mut *vm, &mut *body) };
    body.begin(was_stuck);
    // SAFETY: what the handlers need is there.
    unsafe { avr_device::interrupt::enable() };
    loop {
        power::feed();
        if !body.turn(vm) {
            power::doze(&registers());
        }
    }
}

/// Everything but the machine.
struct App {
    robot: KilobotHost,
    script: ScriptSchedule,
    sender: Sender,
    /// Messages sent, modulo 256.
    sent: u8,
    blinker: Blinker,
    /// Pins of port B that send.
    transmitters: u8,
    /// The watchdog has reset the robot: no script runs until the controller resets it.
    was_stuck: bool,
}

impl App {
    /// Zeros, which take no flash.
    const fn new() -> Self {
        App {
            robot: KilobotHost::new(),
            script: ScriptSchedule::new(),
            sender: Sender::start(0, 0),
            sent: 0,
            blinker: Blinker::start(0),
            transmitters: 0,
            was_stuck: false,
        }
    }

    /// The robot is switched on.
    #[inline(never)]
    fn begin(&mut self, was_stuck: bool) {
        self.was_stuck = was_stuck;
        let chip = &registers();
        power::start(chip);
        clock::start(chip);
        motors::start(chip);
        hear::start(chip);
        let id = u16::from_le_bytes([eeprom::read(chip, ID), eeprom::read(chip, ID + 1)]);
        self.transmitters = calibration::transmitters(eeprom::read(chip, TRANSMITTERS));
        let [left, right, straight_left, straight_right] = DUTIES;
        let mode = &mut self.robot.mode;
        mode.id = id;
        mode.duties = [
            eeprom::read(chip, left),
            eeprom::read(chip, right),
            eeprom::read(chip, straight_left),
            eeprom::read(chip, straight_right),
        ];
        // Robots that are switched on together send one after the other.
        self.sender = Sender::start(0, id as u8);
    }

    /// Does the pending work, for a few ms at most. Returns true if there is more.
    #[inline(never)]
    fn turn(&mut self, vm: &mut Machine) -> bool {
        let has_heard = hear::has_message();
        if has_heard {
            self.hear();
        }
        let now = clock::now(&registers());
        let color = self.live(vm, now);
        light::show(&registers(), color);
        let duties = self.robot.motors.duties(now);
        motors::drive(&registers(), duties);
        if self.robot.mode.state == RobotMode::Running && self.sender.is_due(now) {
            self.send(now);
        }
        let is_running = self.robot.mode.state == RobotMode::Running;
        has_heard || (is_running && self.script.goes_on())
    }

    /// Takes the message that has come in.
    #[inline(never)] // Else each turn would make room for the message: 300 cycles.
    fn hear(&mut self) {
        // Moved out of the option it would be copied once more, in 20 bytes of flash.
        let Some(heard) = &hear::take() else { return };
        let Some((kind, data)) = infrared::opened(&heard.message) else { return };
        let robot = &mut self.robot;
        if kind < controller::FIRST {
            let mm = distance(heard.amplitudes, |gain, index| {
                calibration::entry(gain, index, |address| eeprom::read(&registers(), address))
            });
            // It takes no others than those of swarms.
            return robot.inbox.push(&infrared::frame(kind, data), mm.unwrap_or(0));
        }
        let was = robot.mode.state;
        match robot.mode.obey(kind, data) {
            Act::None => {}
            Act::Boot => power::boot(&registers()),
            Act::Reset => power::reset(&registers()),
            Act::Store => self.store(),
        }
        if was != self.robot.mode.state {
            let now = clock::now(&registers());
            self.blinker = Blinker::start(now);
            self.script.resume(now);
        }
    }

    /// Keeps id and duties.
    #[inline(never)]
    fn store(&mut self) {
        let mode = &self.robot.mode;
        let [low, high] = mode.id.to_le_bytes();
        eeprom::write(&registers(), ID, low);
        eeprom::write(&registers(), ID + 1, high);
        let [left, right, straight_left, straight_right] = DUTIES;
        eeprom::write(&registers(), left, mode.duties[0]);
        eeprom::write(&registers(), right, mode.duties[1]);
        eeprom::write(&registers(), straight_left, mode.duties[2]);
        eeprom::write(&registers(), straight_right, mode.duties[3]);
    }

    /// Does the work of the robot's state; returns the LED's colour.
    #[inline(never)]
    fn live(&mut self, vm: &mut Machine, now: u16) -> Color {
        let robot = &mut self.robot;
        match robot.mode.state {
            RobotMode::Running if self.was_stuck => return Color::RED,
            RobotMode::Running => {
                self.script.run(vm, robot, now);
                if self.script.is_on() {
                    self.blinker = Blinker::start(now);
                    return robot.color;
                }
                let number = FaultReport::number(&robot.report);
                let is_lit = number == 0 || self.blinker.tell(number, now);
                return if is_lit { Color::RED } else { Color::DARK };
            }
            RobotMode::Moving => {
                robot.motors.set(robot.mode.shown, now);
                return Color::DARK;
            }
            _ => robot.motors.set([0, 0], now),
        }
        let flash = self.blinker.flash(now);
        match robot.mode.state {
            RobotMode::Waiting if flash => Color::GREEN,
            RobotMode::Uncalibrated => Color::MAGENTA,
            RobotMode::Battery if !hear::is_busy() => {
                of_battery(adc::read(&registers(), adc::Sensor::Battery))
            }
            RobotMode::Charging if flash && power::is_charging(&registers()) => Color::DIM_RED,
            RobotMode::Asleep => {
                self.sleep();
                Color::DARK
            }
            _ => Color::DARK,
        }
    }

    /// Sleeps for eight seconds; then listens for ten ms, and for longer if another robot sends.
    #[inline(never)]
    fn sleep(&mut self) {
        let chip = &registers();
        motors::drive(chip, [0, 0]);
        power::sleep(chip);
        light::show(chip, Color::WHITE);
        power::pause(10_000);
        if hear::is_busy() {
            light::show(chip, Color::RED);
            for _ in 0..10_u8 {
                power::pause(10_000);
            }
        }
    }

    /// Sends the next message, or the report of a fault: in the pause after it every second time, for good if the script does
    /// not run again. A contained fault is reported every 16th time.
    #[inline(never)]
    fn send(&mut self, now: u16) {
        if hear::is_busy() {
            self.sender.wait(now);
            return;
        }
        let robot = &mut self.robot;
        let is_on = self.script.is_on();
        let is_turn = match is_on {
            true => robot.has_contained() && self.sent.is_multiple_of(16),
            false => self.script.is_over() || self.sent.is_multiple_of(2),
        };
        let message = match if is_turn { None } else { robot.outbox.pop() } {
            Some(next) => {
                let mut frame = [0; infrared::FRAME];
                next.copy_to(&mut frame);
                let [kind, data @ ..] = &frame;
                infrared::sealed(*kind, data)
            }
            // In a pause the report also takes the turn of messages that are not there.
            None if is_turn || !is_on => robot.report,
            None => return,
        };
        if speak::speak(&registers(), self.transmitters, &message) {
            self.sender.sent(now);
            self.sent = self.sent.wrapping_add(1);
        } else {
            // The timers of two robots are never the same for long.
            let random = registers().TC1.tcnt1().read().bits() as u8;
            self.sender.collided(now, random);
            let [data @ .., kind, _, _] = &message;
            robot.outbox.push(&infrared::frame(*kind, data));
        }
    }
}
