//! BittyBuzz for Kilobots: runs a Buzz script on the ATmega328P, with infrared light as its radio.
//!
//! **Not tried on hardware**: the image is tested in emulation (`emulation/`) only.
//!
//! One loop does all work in turn and never waits: it handles a received message, follows the
//! overhead controller, runs a slice of the script, and sends a message when it is time. Interrupts
//! only record pulses of light and the time. Sending takes 4.4 ms and blocks everything else, as in
//! kilolib.
//!
//! # Memory
//! The virtual machine and its queues take at most [`toml::MEMORY`] of the 2,048 bytes, all static.
//! The rest is for drivers and stack.
//!
//! # Not included
//! `log` does nothing, since no debug probe reads it. The robot's boot loader receives programs,
//! not this firmware.

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
    #![allow(dead_code, reason = "the robot file has more than this firmware uses")]
    include!(concat!(env!("OUT_DIR"), "/robot.rs"));
}

use core::arch::global_asm;
use core::mem::offset_of;

use bittybuzz_comms::infrared::{self, FaultReport};
use bittybuzz_comms::queue::is_followed;
use bittybuzz_kilobot::calibration::{self, DUTIES, ID, TRANSMITTERS};
use bittybuzz_kilobot::controller;
use bittybuzz_kilobot::distance::distance;
use bittybuzz_kilobot::light::{Blinker, Color, of_battery};
use bittybuzz_kilobot::mode::{Act, RobotMode};
use bittybuzz_kilobot::sender::Sender;
use bittybuzz_vm_core::Vm;
use bittybuzz_vm_core::message::Topics;

use chip::registers;
use robot::KilobotHost;
use script::{Machine, ScriptSchedule};

// avr-libc's float and memory functions are smaller and faster than those of compiler_builtins.
#[link(name = "m", kind = "static", modifiers = "-bundle")]
unsafe extern "C" {}

#[link(name = "c", kind = "static", modifiers = "-bundle")]
unsafe extern "C" {}

const SLOTS: usize = toml::SLOTS + toml::SIZES.slots();

/// The virtual machine takes no more memory than the robot file promises.
const _: () = assert!(size_of::<Machine>() <= toml::MEMORY - toml::QUEUE_MEMORY);

/// Makes the link fail if the program contains a panic.
/// True if the script of this image needs long messages.
const HAS_LONG: bool = toml::IN_LONG != 0;

/// Returns the low byte of timer 1 as a random number, since the timers of two robots soon differ.
fn random() -> u8 {
    registers().TC1.tcnt1().read().bits() as u8
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    unsafe extern "C" {
        fn the_program_contains_a_panic() -> !;
    }
    // SAFETY: the function does not exist, so this never links.
    unsafe { the_program_contains_a_panic() }
}

static mut BODY: App = App::new();

// A symbol at the script's phase (`bittybuzz_kilobot::phase`), for emulators. It adds nothing to
// the image.
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
    // SAFETY: these are the only references to the statics, and main runs once.
    let (vm, body) = unsafe { (&mut *vm, &mut *body) };
    body.begin(was_stuck);
    // SAFETY: everything that the handlers need is set up.
    unsafe { avr_device::interrupt::enable() };
    loop {
        power::feed();
        if !body.turn(vm) {
            power::doze(&registers());
        }
    }
}

/// The state of the program, except the virtual machine.
struct App {
    robot: KilobotHost,
    script: ScriptSchedule,
    sender: Sender<HAS_LONG>,
    /// The number of sent messages, modulo 256.
    sent: u8,
    blinker: Blinker,
    /// The pins of port B that drive the infrared diodes.
    transmitters: u8,
    /// True if the watchdog has reset the robot. No script then runs until the controller resets
    /// the robot.
    was_stuck: bool,
}

impl App {
    /// Returns the initial state, all zeros, which takes no flash.
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

    /// Sets the hardware up and reads the calibration at power-on.
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
        // The id delays the first message, so that robots that are switched on together send one
        // after the other.
        self.sender = Sender::start(0, id as u8);
    }

    /// Does the pending work, for a few ms at most. Returns true if there is more.
    #[inline(never)]
    fn turn(&mut self, vm: &mut Machine) -> bool {
        let has_heard = hear::has_message();
        if has_heard {
            self.hear(vm.unwanted_topics());
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

    /// Handles the received message.
    #[inline(never)] // Inlined, each turn would reserve room for the message: 300 cycles.
    fn hear(&mut self, unwanted: Topics) {
        // Moving the message out of the option would copy it once more, in 20 bytes of flash.
        let Some(heard) = &hear::take() else { return };
        let Some((kind, data)) = infrared::opened(&heard.message) else { return };
        let robot = &mut self.robot;
        if kind < controller::FIRST {
            let mm = distance(heard.amplitudes, |gain, index| {
                calibration::entry(gain, index, |address| eeprom::read(&registers(), address))
            });
            // The inbox accepts only swarm frames.
            robot.inbox.push_except(&infrared::frame(kind, data), mm.unwrap_or(0), unwanted);
            if HAS_LONG && is_followed(kind) && !robot.outbox.is_within_message() {
                self.sender.defer(clock::now(&registers()), random());
            }
            return;
        }
        let was = robot.mode.state;
        match robot.mode.handle(kind, data) {
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

    /// Stores id and duties in the EEPROM.
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

    /// Does the work of the robot's state, and returns the LED's color.
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
                let is_lit = number == 0 || self.blinker.blink(number, now);
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

    /// Sleeps for eight seconds, then listens for ten ms, and for longer if another robot sends.
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

    /// Sends the next message or the report of a fault. During the pause before a restart every
    /// second message is the report; if the script does not run again, every message is. A
    /// contained fault is reported in every 16th message.
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
        let mut frame = [0; infrared::FRAME];
        let message = match if is_turn { None } else { robot.outbox.pop(&mut frame) } {
            Some(_) => {
                let [kind, data @ ..] = &frame;
                infrared::sealed(*kind, data)
            }
            // During a pause the report also replaces messages that are missing.
            None if is_turn || !is_on => robot.report,
            None => return,
        };
        if speak::speak(&registers(), self.transmitters, &message) {
            self.sender.sent(now, robot.outbox.is_within_message());
            self.sent = self.sent.wrapping_add(1);
        } else {
            self.sender.collided(now, random());
            let [data @ .., kind, _, _] = &message;
            robot.outbox.unpop(&infrared::frame(*kind, data));
        }
    }
}
