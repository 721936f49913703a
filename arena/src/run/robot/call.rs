//! Robot functions: arguments are checked as on the robot, then the body carries them out.

use bittybuzz_robot_spec::{accepted_lists, accepting, idle_result};
use bittybuzz_vm_core::hash::name_hash;
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{Arguments, ByteCode, Item, Refusal, Reply, RobotFault, Value};

use crate::robots::kilobot::KilobotMotors;
use crate::robots::zooid::Drive;
use crate::scenario::Body;

use super::platform::Deck;
use super::{crazyflie, kilobot, zooid};

/// What a function did.
pub enum Done {
    /// It is finished and returns nil.
    Nil,
    /// It is finished and returns an integer.
    Int(i32),
    /// It goes on.
    Wait,
    /// The body does not have it.
    Unknown,
    /// An argument is outside what the robot can do.
    OutOfRange,
}

/// The numbers that a call passes; 0 where there are fewer, or where it is no number.
pub struct Numbers {
    pub count: usize,
    values: [f32; 4],
}

impl Numbers {
    pub fn float(&self, index: usize) -> f32 {
        self.values.get(index).copied().unwrap_or(0.0)
    }

    /// An integer argument. All that functions take are exact in a float.
    pub fn int(&self, index: usize) -> i32 {
        self.float(index) as i32
    }
}

pub fn call<P: Profile, C: ByteCode, const SLOTS: usize>(
    deck: &mut Deck<'_, '_, '_>,
    hash: u16,
    arguments: &Arguments<'_, P, C, SLOTS>,
    again: bool,
) -> Result<Reply<P>, RobotFault> {
    const LED: u16 = name_hash("led");
    const LIGHT: u16 = name_hash("light");
    const PRINT: u16 = name_hash("print");
    const SHOW: u16 = name_hash("show");

    let cast = deck.state.cast;
    let Some(function) = cast.function(hash) else {
        return Err(RobotFault::Refused(Refusal::NotBuiltIn));
    };
    if let Err(fault) = accepting(&[function], arguments) {
        deck.state.refusal = Some(accepted_lists(&[function]));
        return Err(fault);
    }
    let mut numbers = Numbers { count: arguments.count(), values: [0.0; 4] };
    for (index, value) in numbers.values.iter_mut().enumerate() {
        *value = match arguments.item(index) {
            Item::Int(value) => value as f32,
            Item::Float(value) => value,
            _ => 0.0,
        };
    }
    let done = match hash {
        LED if numbers.count == 1 => {
            *deck.io.led = (numbers.int(0) & 7) as u8;
            Done::Nil
        }
        // How bright each colour is.
        LED if numbers.count == 3 => {
            let lit = (0..3).filter(|index| numbers.int(*index) > 0);
            *deck.io.led = lit.map(|index| 1 << index).sum();
            Done::Nil
        }
        LIGHT => Done::Int(i32::from(deck.io.sensors.light())),
        PRINT => {
            deck.write(Vec::new(), arguments);
            Done::Nil
        }
        SHOW => {
            let time = deck.state.pilot.stopwatch(deck.milliseconds());
            deck.write(time, arguments);
            Done::Nil
        }
        _ => match cast.body {
            Body::Kilobot => match deck.io.controls::<KilobotMotors>() {
                Some(motors) => kilobot::call(motors, cast.duties, hash, &numbers),
                None => Done::Unknown,
            },
            Body::Zooid => {
                let (here, battery) = (deck.io.sensors.estimate(), deck.state.battery);
                match deck.io.controls::<Drive>() {
                    Some(drive) => zooid::call(drive, here, battery, hash, &numbers),
                    None => Done::Unknown,
                }
            }
            Body::Crazyflie => crazyflie::call(deck, hash, &numbers, again),
        },
    };
    Ok(match done {
        Done::Nil => Reply::Value(Value::nil()),
        Done::Int(value) => Reply::Value(Value::int(value)),
        Done::Wait => Reply::Wait,
        // As `bbz run` plays functions of which nothing is known but their result.
        Done::Unknown => Reply::Value(idle_result(function)),
        Done::OutOfRange => return Err(RobotFault::Refused(Refusal::OutOfRange)),
    })
}
