//! The calculator: runs the programs of the mathematical functions.
//!
//! A function is a program of a dozen bytes in flash. Written as calls it would take several
//! hundred bytes, since an AVR needs ten bytes per call for the operands alone.

use super::exponential::{exp2_product, simple_power, split};
use super::float::Float;
use super::profile::Profile;
use super::tables::operand::{REGISTERS, T, Y};
use super::tables::{constant, evaluate, instruction, instruction_at, largest_square};
use super::trigonometry::turn;
use super::word::Word;
use crate::bytecode::ByteCode;

/// Runs a program of [`super::tables::program`]: `argument` is its first argument and becomes the
/// result, `y` is its second argument.
#[one_copy]
pub(super) fn calculate<P: Profile, C: ByteCode>(start: u8, argument: &mut Float<P>, y: &Float<P>) {
    let mut x = *argument;
    let mut registers = [*y; REGISTERS as usize];
    let (mut sign, mut steep, mut left) = (false, false, false);
    let (mut at, mut back) = (start, 0);
    loop {
        let instruction = instruction_at::<P, C>(at);
        at = at.wrapping_add(1);
        let number = instruction & 0x0F;
        let other = operand::<P, C>(&registers, number);
        match instruction & 0xF0 {
            ..=instruction::ROOT => x.operate(instruction >> 4, &other),
            instruction::LOAD => x = other,
            instruction::STORE | instruction::SWAP => {
                if let Some(register) = registers.get_mut(usize::from(number)) {
                    *register = x;
                }
                if instruction >= instruction::SWAP {
                    x = other;
                }
            }
            instruction::EXP2 => exp2_product::<P, C>(&mut x, &other),
            instruction::SERIES => {
                let mut square = x.square();
                let series = match number {
                    0 => P::POLYNOMIALS.arc_tangent,
                    1 => P::POLYNOMIALS.sine,
                    _ => {
                        square = largest_square::<P>().sub(square);
                        P::POLYNOMIALS.logarithm
                    }
                };
                x.mul(&Float::new(evaluate::<P, C>(series, square), i16::from(number)));
            }
            instruction::TURN => {
                sign = x.negative && number == 0;
                x.negative = false;
                steep = x.exponent < 0;
                if x.is_endless() {
                    x.set_nan();
                } else if !steep {
                    sign ^= turn::<P, C>(&mut x, number);
                }
            }
            _ => match instruction {
                instruction::IF_STEEP => at = at.wrapping_add(u8::from(!steep)),
                instruction::IF_LEFT => at = at.wrapping_add(u8::from(!left)),
                instruction::POWER => {
                    let done;
                    (done, sign) = simple_power(&mut x, &registers[usize::from(Y)]);
                    if done {
                        at = 0;
                    }
                }
                instruction::POINT => {
                    let y = &mut registers[usize::from(Y)];
                    (sign, left) = (x.negative, y.negative);
                    x.negative = false;
                    y.negative = false;
                    steep = y.is_smaller(&x);
                    if x.is_special() && x.exponent == y.exponent {
                        // Two infinities have the ratio 1, and two zeros the ratio 0.
                        y.exponent = 0;
                        if x.is_endless() {
                            x.exponent = 0;
                        }
                    }
                }
                instruction::SIGN => x.negative = sign,
                instruction::MINUS => x.negative = true,
                instruction::CALL => {
                    back = at.wrapping_add(1);
                    at = instruction_at::<P, C>(at);
                }
                _ => {
                    if instruction == instruction::SPLIT
                        && let Some(power) = split(&mut x)
                    {
                        let power = P::int_from_i32(i32::from(power));
                        registers[usize::from(T)] = Float::from_int(power);
                    } else {
                        (at, back) = (back, 0);
                    }
                }
            },
        }
        if at == 0 {
            break;
        }
    }
    *argument = x;
}

/// Returns a register or a constant.
#[one_copy]
fn operand<P: Profile, C: ByteCode>(
    registers: &[Float<P>; REGISTERS as usize],
    number: u8,
) -> Float<P> {
    match registers.get(usize::from(number)) {
        Some(register) => *register,
        None => constant::<P, C>(number),
    }
}
