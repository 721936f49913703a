//! Operations on numbers, and the ways in which their results can be wrong.

use std::fmt;

use bittybuzz_vm_core::builtin::{self, Library};
use bittybuzz_vm_core::number::{Number, Profile};
use bittybuzz_vm_core::opcode::{self, DROP_RESULT};
use bittybuzz_vm_core::{ByteCode, Callee, Instruction, Vm};

/// A way in which a result differs from the mathematical one by more than its rounding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Anomaly {
    /// An integer lost its upper bits.
    Wrapped,
    /// A float became infinite, although no operand was infinite.
    Infinite,
    /// A float became NaN, although no operand was NaN.
    NotANumber,
    /// A float became zero, although the exact result is not zero.
    Flushed,
    /// A conversion to an integer gave the nearest one, or 0 for NaN.
    Saturated,
    /// A sum or a difference is one of its operands, although the other one is not zero: the bits of
    /// a float do not reach to it.
    NoEffect,
}

/// The operator of an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operator {
    /// An operator between two operands, by the opcode of its plain instruction.
    Binary(u8),
    /// The change of the sign.
    Negate,
    /// A built-in function, by its number.
    Function(u8),
}

/// An operation with its operands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Operation {
    pub operator: Operator,
    /// The first operand.
    pub first: Number,
    /// The second operand, if there are two.
    pub second: Option<Number>,
}

/// The mathematical result of an operation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exact {
    /// An integer.
    Int(i64),
    /// A real number, rounded to binary64; NaN where there is no result.
    Real(f64),
    /// Unknown, because the function is random.
    Unknown,
}

/// The place where the machine puts the result of an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ResultSlot {
    Stack,
    Local(i16),
}

/// The operation of the next instruction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Upcoming {
    pub operation: Operation,
    target: ResultSlot,
}

impl Upcoming {
    /// Returns the operation of the machine's next instruction; `None` if the instruction computes
    /// nothing, drops the result, or stops with a fault.
    pub fn from_instruction<P: Profile, C: ByteCode, const SLOTS: usize>(
        vm: &Vm<P, C, SLOTS>,
        instruction: &Instruction,
    ) -> Option<Self> {
        let Instruction { opcode, operand, trailer, .. } = *instruction;
        let number = |below| vm.operand(below).as_number();
        let mut target = ResultSlot::Stack;
        let operation = match opcode {
            opcode::ADD
            | opcode::SUB
            | opcode::MUL
            | opcode::DIV
            | opcode::MOD
            | opcode::POW
            | opcode::SHL => Operation::binary(opcode, number(2)?, number(1)?),
            opcode::ADD_INT => {
                Operation::binary(opcode::ADD, number(1)?, Number::Int(operand.into()))
            }
            opcode::LOCAL_ADD => {
                target = ResultSlot::Local(operand);
                let first = vm.frame_local(operand).as_number()?;
                Operation::binary(opcode::ADD, first, Number::Int((trailer as i8).into()))
            }
            opcode::NEG => {
                Operation { operator: Operator::Negate, first: number(1)?, second: None }
            }
            // A result that is dropped does not matter.
            opcode::CALL_BUILTIN if trailer & DROP_RESULT == 0 => {
                Operation::function(vm, operand as u8, trailer)?
            }
            opcode::CALL | opcode::CALL_METHOD => {
                let count = operand as u8;
                match vm.callee(vm.operand(count.checked_add(1)?)) {
                    Callee::Builtin(function) => Operation::function(vm, function, count)?,
                    _ => return None,
                }
            }
            _ => return None,
        };
        (!operation.is_fault::<P>()).then_some(Upcoming { operation, target })
    }

    /// Compares the exact result with that of the machine, which has executed the instruction.
    /// Returns the anomaly, if there is one, with the exact result and the machine's result.
    pub fn judge<P: Profile, C: ByteCode, const SLOTS: usize>(
        &self,
        vm: &Vm<P, C, SLOTS>,
    ) -> Option<(Anomaly, Exact, Number)> {
        if let Some(exact) = self.operation.exact_integer() {
            let fits = (i64::from(P::INT_MIN)..=i64::from(P::INT_MAX)).contains(&exact);
            // The machine keeps the low bits.
            let kept = P::int_to_i32(P::int_from_i32(exact as i32));
            return (!fits).then_some((Anomaly::Wrapped, Exact::Int(exact), Number::Int(kept)));
        }
        let value = match self.target {
            ResultSlot::Stack => vm.operand(1),
            ResultSlot::Local(number) => vm.frame_local(number),
        };
        let result = value.as_number()?;
        let exact = self.operation.exact_real()?;
        let anomaly = match result {
            Number::Int(_) => self.operation.is_saturated::<P>(exact).then_some(Anomaly::Saturated),
            Number::Float(result) => self.operation.float_anomaly(result, exact),
        };
        Some((anomaly?, exact, result))
    }
}

impl Operation {
    fn binary(opcode: u8, first: Number, second: Number) -> Self {
        Operation { operator: Operator::Binary(opcode), first, second: Some(second) }
    }

    /// Returns the call of a numeric function whose `count` arguments are on top of the stack.
    fn function<P: Profile, C: ByteCode, const SLOTS: usize>(
        vm: &Vm<P, C, SLOTS>,
        function: u8,
        count: u8,
    ) -> Option<Self> {
        let wanted: u8 = match function {
            builtin::ATAN => 2,
            builtin::UNIFORM | builtin::GAUSSIAN => count.min(2),
            builtin::TO_INT
            | builtin::ABS..=builtin::ROUND
            | builtin::SQRT..=builtin::ACOS
            | builtin::EXPONENTIAL => 1,
            _ => return None,
        };
        if count < wanted {
            return None;
        }
        let argument = |index: u8| vm.operand(count - index).as_number();
        let second = if wanted == 2 { Some(argument(1)?) } else { None };
        let first = if wanted == 0 { return None } else { argument(0)? };
        Some(Operation { operator: Operator::Function(function), first, second })
    }

    /// Returns true for a float among the operands.
    pub fn has_float(&self) -> bool {
        let is_float = |number: Number| matches!(number, Number::Float(_));
        is_float(self.first) || self.second.is_some_and(is_float)
    }

    /// Returns the operands if all are integers; 0 stands for a missing second operand.
    fn integers(&self) -> Option<[i64; 2]> {
        match (self.first, self.second.unwrap_or(Number::Int(0))) {
            (Number::Int(first), Number::Int(second)) => Some([first.into(), second.into()]),
            _ => None,
        }
    }

    /// Returns true if the machine stops with a fault: a division of integers by 0, or a shift of a
    /// float or by too many bits.
    fn is_fault<P: Profile>(&self) -> bool {
        match (self.operator, self.integers()) {
            (Operator::Binary(opcode::DIV | opcode::MOD), Some([_, divisor])) => divisor == 0,
            (Operator::Binary(opcode::SHL), Some([_, count])) => {
                !(0..i64::from(P::INT_BITS)).contains(&count)
            }
            (Operator::Binary(opcode::SHL), None) => true,
            _ => false,
        }
    }

    /// Returns the exact result of an operation on integers that has an integer result.
    fn exact_integer(&self) -> Option<i64> {
        let [first, second] = self.integers()?;
        Some(match self.operator {
            Operator::Binary(opcode::ADD) => first + second,
            Operator::Binary(opcode::SUB) => first - second,
            Operator::Binary(opcode::MUL) => first * second,
            Operator::Binary(opcode::DIV) => first.checked_div(second)?,
            Operator::Binary(opcode::MOD) => first.checked_rem_euclid(second)?,
            Operator::Binary(opcode::SHL) => first.checked_shl(u32::try_from(second).ok()?)?,
            Operator::Negate => -first,
            Operator::Function(builtin::ABS) => first.abs(),
            Operator::Function(builtin::TO_INT | builtin::FLOOR..=builtin::ROUND) => first,
            _ => return None,
        })
    }

    /// Returns the exact result of an operation with a float among its operands, or with a float as its result.
    fn exact_real(&self) -> Option<Exact> {
        let first = real(self.first);
        let second = self.second.map_or(0.0, real);
        Some(Exact::Real(match self.operator {
            Operator::Binary(opcode::ADD) => first + second,
            Operator::Binary(opcode::SUB) => first - second,
            Operator::Binary(opcode::MUL) => first * second,
            Operator::Binary(opcode::DIV) => first / second,
            Operator::Binary(opcode::MOD) => first.rem_euclid(second),
            Operator::Binary(opcode::POW) => libm::pow(first, second),
            Operator::Function(function) => match function {
                builtin::TO_INT => first.trunc(),
                builtin::FLOOR => first.floor(),
                builtin::CEIL => first.ceil(),
                builtin::ROUND => first.round(),
                builtin::SQRT => first.sqrt(),
                builtin::EXP => libm::exp(first),
                builtin::LN => libm::log(first),
                builtin::LOG2 => libm::log2(first),
                builtin::LOG10 => libm::log10(first),
                builtin::SIN => libm::sin(first),
                builtin::COS => libm::cos(first),
                builtin::TAN => libm::tan(first),
                builtin::ASIN => libm::asin(first),
                builtin::ACOS => libm::acos(first),
                builtin::ATAN => libm::atan2(first, second),
                builtin::UNIFORM | builtin::GAUSSIAN | builtin::EXPONENTIAL => {
                    return Some(Exact::Unknown);
                }
                _ => return None,
            },
            // The change of a sign is exact.
            Operator::Binary(_) | Operator::Negate => return None,
        }))
    }

    /// Returns true if a float does not fit the integer that it is to become.
    fn is_saturated<P: Profile>(&self, exact: Exact) -> bool {
        let is_conversion = matches!(
            self.operator,
            Operator::Function(builtin::TO_INT | builtin::FLOOR..=builtin::ROUND)
        );
        // Only a random function has no known result, and it converts nothing.
        let Exact::Real(exact) = exact else { return false };
        is_conversion && !(f64::from(P::INT_MIN)..=f64::from(P::INT_MAX)).contains(&exact)
    }

    fn float_anomaly(&self, result: f32, exact: Exact) -> Option<Anomaly> {
        let operands = [real(self.first), self.second.map_or(0.0, real)];
        let any = |is: fn(f64) -> bool| operands.into_iter().any(is);
        if result.is_nan() {
            return (!any(f64::is_nan)).then_some(Anomaly::NotANumber);
        }
        if result.is_infinite() {
            return (!any(f64::is_infinite)).then_some(Anomaly::Infinite);
        }
        if operands.into_iter().any(|operand| !operand.is_finite()) {
            return None;
        }
        if self.has_no_effect(result) {
            return Some(Anomaly::NoEffect);
        }
        (result == 0.0 && self.is_nonzero(exact)).then_some(Anomaly::Flushed)
    }

    /// Returns true for a sum or difference that is one of its operands, and the other one is not
    /// zero.
    fn has_no_effect(&self, result: f32) -> bool {
        let (first, second) = (real(self.first), self.second.map_or(0.0, real));
        let second = match self.operator {
            Operator::Binary(opcode::ADD) => second,
            Operator::Binary(opcode::SUB) => -second,
            _ => return false,
        };
        let result = f64::from(result);
        first != 0.0 && second != 0.0 && (result == first || result == second)
    }

    /// Returns true if the exact result with finite operands is not zero.
    fn is_nonzero(&self, exact: Exact) -> bool {
        match (self.operator, exact) {
            // These results may be too small even for binary64.
            (Operator::Function(builtin::EXP), _) => true,
            (Operator::Binary(opcode::POW), _) => real(self.first) != 0.0,
            (_, Exact::Real(exact)) => exact != 0.0,
            (_, Exact::Int(_) | Exact::Unknown) => false,
        }
    }
}

/// Returns the value with which the machine computes. The full profile first converts an integer to
/// the nearest float. The integers of the tiny profile are floats of binary32, too.
fn real(number: Number) -> f64 {
    match number {
        Number::Int(value) => f64::from(value as f32),
        Number::Float(value) => value.into(),
    }
}

/// Writes a number in the syntax of scripts.
fn write(number: Number, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match number {
        Number::Int(value) => write!(f, "{value}"),
        Number::Float(value) => write!(f, "{value:?}"),
    }
}

impl fmt::Display for Operation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Operation { operator, first, second } = *self;
        match operator {
            Operator::Binary(opcode) => {
                let symbol = match opcode {
                    opcode::ADD => "+",
                    opcode::SUB => "-",
                    opcode::MUL => "*",
                    opcode::DIV => "/",
                    opcode::MOD => "%",
                    opcode::POW => "^",
                    _ => "<<",
                };
                // The compiler turns the difference with a small number into a sum.
                let (symbol, second) = match (symbol, second) {
                    ("+", Some(Number::Int(negative))) if negative < 0 && negative > i32::MIN => {
                        ("-", Some(Number::Int(-negative)))
                    }
                    other => other,
                };
                write(first, f)?;
                write!(f, " {symbol} ")?;
                second.map_or(Ok(()), |second| write(second, f))
            }
            Operator::Negate => {
                f.write_str("-(")?;
                write(first, f)?;
                f.write_str(")")
            }
            Operator::Function(number) => {
                if let Some(info) = builtin::info(number) {
                    match (info.library, info.library.global_name()) {
                        (Library::Rng, _) => f.write_str("math.rng.")?,
                        (_, Some(library)) => write!(f, "{library}.")?,
                        (_, None) => {}
                    }
                    f.write_str(info.name)?;
                }
                f.write_str("(")?;
                write(first, f)?;
                if let Some(second) = second {
                    f.write_str(", ")?;
                    write(second, f)?;
                }
                f.write_str(")")
            }
        }
    }
}
