//! Parameters: port 2. Sources: param_task.c and param_logic.c of crazyflie-firmware.
//!
//! The answer to a write contains the value that is in force after it. So a ground station sees
//! that a write was refused, while Bitcraze's firmware repeats the value of the request.

mod table;

pub use table::{Access, Parameter};

use crate::fields::Fields;
use crate::packet::{Packet, Port, RawPacket};
use crate::refusal::Refusal;
use crate::toc;
use crate::value::Value;

/// The channels.
const TABLE: u8 = 0;
const READ: u8 = 1;
const WRITE: u8 = 2;
const OTHER: u8 = 3;

/// The commands of channel 3.
mod command {
    pub const SET_BY_NAME: u8 = 0;
    pub const EXTENDED_TYPE: u8 = 2;
    pub const PERSISTENT_STORE: u8 = 3;
    pub const PERSISTENT_STATE: u8 = 4;
    pub const PERSISTENT_CLEAR: u8 = 5;
    /// The answer to this old command shows the value 2 as an error.
    pub const DEFAULT_VALUE: u8 = 6;
    pub const EXTENDED_TYPE_2: u8 = 7;
    pub const DEFAULT_VALUE_2: u8 = 8;
}

/// Numbers of errors in answers: the errno of newlib.
mod errno {
    pub const NO_ENTRY: u8 = 2;
    pub const NO_ACCESS: u8 = 13;
    pub const INVALID: u8 = 22;
}

/// A value that a ground station wrote, within its range and its access.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterChange {
    pub parameter: Parameter,
    pub value: Value,
}

/// The values of the parameters.
#[derive(Clone, Debug)]
pub struct Parameters {
    values: [Value; Parameter::COUNT],
    /// The least and the greatest value that a ground station may write.
    ranges: [(f32, f32); Parameter::COUNT],
}

impl Default for Parameters {
    fn default() -> Self {
        let mut parameters = Parameters {
            values: [Value::Float(0.0); Parameter::COUNT],
            ranges: [(0.0, 0.0); Parameter::COUNT],
        };
        for parameter in Parameter::ALL {
            if let Some(range) = parameters.ranges.get_mut(*parameter as usize) {
                *range = parameter.range();
            }
            parameters.set(*parameter, Value::Float(parameter.first()));
        }
        parameters
    }
}

/// Returns a value in the type of a parameter.
fn converted(parameter: Parameter, value: Value) -> Value {
    let wire = parameter.wire();
    let bytes = wire.encode(value);
    bytes.get(..wire.bytes()).and_then(|bytes| wire.decode(bytes)).unwrap_or(value)
}

impl Parameters {
    /// Returns the value of a parameter, in its type.
    pub fn get(&self, parameter: Parameter) -> Value {
        self.values.get(parameter as usize).copied().unwrap_or(Value::Float(0.0))
    }

    /// Changes a parameter for the robot, whatever its access. The value becomes one of its type.
    pub fn set(&mut self, parameter: Parameter, value: Value) {
        if let Some(slot) = self.values.get_mut(parameter as usize) {
            *slot = converted(parameter, value);
        }
    }

    /// Gives a limit of the flight a bound of the robot's owner. No ground station loosens it, also on
    /// the ground. A bound outside of the parameter's range counts as the nearest in it.
    ///
    /// Parameters that are no limits stay as they are.
    pub fn bound(&mut self, parameter: Parameter, bound: f32) {
        let (least, most) = parameter.range();
        let bound = bound.max(least).min(most);
        let range = match parameter.access() {
            Access::UpperLimit => (least, bound),
            Access::LowerLimit => (bound, most),
            Access::ReadOnly | Access::Always | Access::OnGround => return,
        };
        if let Some(slot) = self.ranges.get_mut(parameter as usize) {
            *slot = range;
        }
        self.set(parameter, self.first(parameter));
    }

    /// Returns the value of a parameter after power-on.
    fn first(&self, parameter: Parameter) -> Value {
        let (least, most) = self.range(parameter);
        converted(parameter, Value::Float(parameter.first().max(least).min(most)))
    }

    fn range(&self, parameter: Parameter) -> (f32, f32) {
        self.ranges.get(parameter as usize).copied().unwrap_or_else(|| parameter.range())
    }

    /// Handles a packet of port 2.
    pub(crate) fn receive(&mut self, packet: &RawPacket<'_>, is_flying: bool) -> ParameterReaction {
        let data = packet.data();
        match packet.channel() {
            TABLE => {
                let count = Parameter::COUNT as u16;
                let entry = |id| Parameter::of_id(id).map(Parameter::entry);
                match toc::answer(Port::Parameter, data, table::CRC, count, &[], entry) {
                    Ok(answer) => ParameterReaction::answer(answer),
                    Err(refusal) => ParameterReaction::refused(refusal, None),
                }
            }
            READ => self.read(data),
            WRITE => self.write(data, is_flying),
            OTHER => self.other(data, is_flying),
            _ => ParameterReaction::refused(Refusal::Unknown, None),
        }
    }

    fn read(&self, data: &[u8]) -> ParameterReaction {
        let mut fields = Fields::new(data);
        let id = match fields.u16().and_then(|id| fields.end().map(|()| id)) {
            Ok(id) => id,
            Err(refusal) => return ParameterReaction::refused(refusal, None),
        };
        let answer = Packet::new(Port::Parameter, READ).with(&id.to_le_bytes());
        match Parameter::of_id(id) {
            Some(parameter) => {
                let answer = answer.with(&[0]);
                ParameterReaction::answer(with_value(answer, parameter, self.get(parameter)))
            }
            None => {
                let answer = answer.with(&[errno::NO_ENTRY]);
                ParameterReaction::refused(Refusal::NoVariable, Some(answer))
            }
        }
    }

    fn write(&mut self, data: &[u8], is_flying: bool) -> ParameterReaction {
        let mut fields = Fields::new(data);
        let id = match fields.u16() {
            Ok(id) => id,
            Err(refusal) => return ParameterReaction::refused(refusal, None),
        };
        let answer = Packet::new(Port::Parameter, WRITE).with(&id.to_le_bytes());
        let Some(parameter) = Parameter::of_id(id) else {
            let answer = answer.with(&[errno::NO_ENTRY]);
            return ParameterReaction::refused(Refusal::NoVariable, Some(answer));
        };
        let change = self.change(parameter, fields.rest(), is_flying);
        let answer = with_value(answer, parameter, self.get(parameter));
        match change {
            Ok(change) => ParameterReaction { change: Ok(Some(change)), answer: Some(answer) },
            Err(refusal) => ParameterReaction::refused(refusal, Some(answer)),
        }
    }

    /// Takes a value that a ground station wrote.
    fn change(
        &mut self,
        parameter: Parameter,
        bytes: &[u8],
        is_flying: bool,
    ) -> Result<ParameterChange, Refusal> {
        let value = parameter.wire().decode(bytes).ok_or(Refusal::Length)?;
        let (number, before) = (value.as_f32(), self.get(parameter).as_f32());
        if !number.is_finite() {
            return Err(Refusal::NotFinite);
        }
        match parameter.access() {
            Access::ReadOnly => return Err(Refusal::ReadOnly),
            Access::OnGround if is_flying => return Err(Refusal::InFlight),
            Access::UpperLimit if is_flying && number > before => return Err(Refusal::Loosened),
            Access::LowerLimit if is_flying && number < before => return Err(Refusal::Loosened),
            _ => {}
        }
        let (least, most) = self.range(parameter);
        if !(least..=most).contains(&number) {
            return Err(Refusal::OutOfRange);
        }
        self.set(parameter, value);
        Ok(ParameterChange { parameter, value })
    }

    fn other(&mut self, data: &[u8], is_flying: bool) -> ParameterReaction {
        match data {
            [command::SET_BY_NAME, rest @ ..] => self.set_by_name(rest, is_flying),
            [command @ (command::DEFAULT_VALUE | command::DEFAULT_VALUE_2), low, high] => {
                let parameter = Parameter::of_id(u16::from_le_bytes([*low, *high]));
                let answer = Packet::new(Port::Parameter, OTHER).with(&[*command, *low, *high]);
                let known = parameter.filter(|known| known.access() != Access::ReadOnly);
                let Some(parameter) = known else {
                    let answer = answer.with(&[errno::NO_ENTRY]);
                    return ParameterReaction::refused(Refusal::NoVariable, Some(answer));
                };
                let is_new = *command == command::DEFAULT_VALUE_2;
                let answer = if is_new { answer.with(&[0]) } else { answer };
                ParameterReaction::answer(with_value(answer, parameter, self.first(parameter)))
            }
            // No parameter has an extended type, and none is kept over power-off.
            [
                command @ (command::EXTENDED_TYPE
                | command::EXTENDED_TYPE_2
                | command::PERSISTENT_STORE
                | command::PERSISTENT_STATE
                | command::PERSISTENT_CLEAR),
                low,
                high,
            ] => {
                let answer = Packet::new(Port::Parameter, OTHER);
                let answer = answer.with(&[*command, *low, *high, errno::NO_ENTRY]);
                ParameterReaction::refused(Refusal::Unsupported, Some(answer))
            }
            [command::EXTENDED_TYPE..=command::DEFAULT_VALUE_2, ..] | [] => {
                ParameterReaction::refused(Refusal::Length, None)
            }
            _ => ParameterReaction::refused(Refusal::Unknown, None),
        }
    }

    /// Handles a write by name: group and name with a zero after each, the type and the value.
    fn set_by_name(&mut self, rest: &[u8], is_flying: bool) -> ParameterReaction {
        let mut parts = rest.splitn(3, |byte| *byte == 0);
        let (Some(group), Some(name), Some([code, value @ ..])) =
            (parts.next(), parts.next(), parts.next())
        else {
            return ParameterReaction::refused(Refusal::Length, None);
        };
        let known = Parameter::ALL
            .iter()
            .copied()
            .find(|known| known.group().as_bytes() == group && known.name().as_bytes() == name);
        let change = match known {
            None => Err(Refusal::NoVariable),
            Some(known) if known.wire().parameter_code() != *code => Err(Refusal::WrongType),
            Some(known) => self.change(known, value, is_flying),
        };
        let error = match change {
            Ok(_) => 0,
            Err(Refusal::NoVariable) => errno::NO_ENTRY,
            Err(Refusal::ReadOnly | Refusal::InFlight | Refusal::Loosened) => errno::NO_ACCESS,
            Err(_) => errno::INVALID,
        };
        let answer = Packet::new(Port::Parameter, OTHER).with(&[command::SET_BY_NAME]);
        let answer = Some(answer.with(group).with(&[0]).with(name).with(&[0, error]));
        ParameterReaction { change: change.map(Some), answer }
    }
}

fn with_value(answer: Packet, parameter: Parameter, value: Value) -> Packet {
    let bytes = parameter.wire().encode(value);
    answer.with(bytes.get(..parameter.wire().bytes()).unwrap_or(&[]))
}

/// The reaction to a packet of port 2.
pub(crate) struct ParameterReaction {
    pub change: Result<Option<ParameterChange>, Refusal>,
    pub answer: Option<Packet>,
}

impl ParameterReaction {
    fn answer(answer: Packet) -> Self {
        ParameterReaction { change: Ok(None), answer: Some(answer) }
    }

    fn refused(refusal: Refusal, answer: Option<Packet>) -> Self {
        ParameterReaction { change: Err(refusal), answer }
    }
}
