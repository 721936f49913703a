//! The robot functions that scripts call: one entry in `robots/zooids.toml` and one arm here.

use bittybuzz_runtime::script::{Console, Counts, Robot, Stopped};
use bittybuzz_vm_core::number::Tiny;
use bittybuzz_vm_core::{
    Arguments, Axis, ByteCode, Item, Periods, Refusal, Reply, RobotFault, Type, Value,
};

use crate::leds::{Light, LightChannel};
use crate::log::info;
use crate::robot::{self, function};

/// Steps between two status lines.
const STATUS_STEPS: u32 = 10 * robot::TICK_HZ as u32;

/// What scripts can reach.
pub struct Zooid {
    light: &'static LightChannel,
    told_at: u32,
}

type Result = core::result::Result<Reply<Tiny>, RobotFault>;

impl Zooid {
    /// The robot.
    pub fn new(light: &'static LightChannel) -> Self {
        Zooid { light, told_at: 0 }
    }
}

impl Robot<Tiny> for Zooid {
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: Arguments<'_, Tiny, C, SLOTS>,
        _again: bool,
        _console: &mut Console<'_>,
    ) -> Result {
        match function {
            function::LED => {
                expect_count(&arguments, 1)?;
                match u8::try_from(integer(&arguments, 0)?) {
                    Ok(color @ 0..=7) => self.light.signal(Light::Script(color)),
                    _ => return Err(RobotFault::Refused(Refusal::OutOfRange)),
                }
                nothing()
            }
            _ => Err(RobotFault::Refused(Refusal::NotBuiltIn)),
        }
    }

    fn position(&mut self, _axis: Axis) -> Option<f32> {
        None
    }

    fn periods(&self) -> Periods {
        // At most 255: robots/src/read.rs.
        Periods {
            beacon: robot::BEACON_STEPS as u8,
            forget: robot::FORGET_STEPS as u8,
            advertise: robot::ADVERTISE_STEPS as u8,
        }
    }

    fn report(&mut self, _record: &[u8]) {
        #[cfg(feature = "defmt")]
        defmt::println!("bbz {=[u8]}", _record);
    }

    fn renew(&mut self, counts: Counts) {
        if counts.steps.wrapping_sub(self.told_at) >= STATUS_STEPS {
            self.told_at = counts.steps;
            info!(
                "{=u32} steps, {=u32} ticks missed, longest slice {=u32} us",
                counts.steps, counts.missed, counts.longest_slice_us
            );
        }
    }

    fn expire(&mut self) -> bool {
        false
    }

    fn stop(&mut self, reason: Stopped) {
        if let Some(light) = Light::of(reason) {
            self.light.signal(light);
        }
    }
}

/// Whether there is a function of this name hash.
pub fn is_function(hash: u16) -> bool {
    robot::FUNCTIONS.iter().any(|(known, _)| *known == hash)
}

fn nothing() -> Result {
    Ok(Reply::Value(Value::nil()))
}

fn expect_count<C: ByteCode, const N: usize>(
    arguments: &Arguments<'_, Tiny, C, N>,
    count: usize,
) -> core::result::Result<(), RobotFault> {
    if arguments.count() == count {
        Ok(())
    } else {
        Err(RobotFault::Refused(Refusal::ArgumentCount))
    }
}

fn integer<C: ByteCode, const N: usize>(
    arguments: &Arguments<'_, Tiny, C, N>,
    index: usize,
) -> core::result::Result<i32, RobotFault> {
    match arguments.item(index) {
        Item::Int(value) => Ok(value),
        Item::Nil => Err(RobotFault::WrongType(Type::Nil)),
        _ => Err(RobotFault::WrongType(arguments.value(index).type_of())),
    }
}
