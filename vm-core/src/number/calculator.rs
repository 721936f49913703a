//! The calculator: runs the programs of the mathematical functions.
//!
//! A function is a dozen bytes in flash instead of several hundred bytes of calls, of which an AVR needs ten each for its
//! operands alone.

use core::mem::swap;

use super::exponential::{exp2_product, simple_power, split};
use super::float::Float;
use super::tables::operand::{REGISTERS, T, Y};
use super::tables::{
    ARC_TANGENT, LARGEST_SQUARE, LOGARITHM, SINE, constant, evaluate, instruction, instruction_at,
};
use super::trigonometry::turn;
use crate::bytecode::ByteCode;

/// Runs a program of [`super::tables::program`]: `x` is its first argument and becomes the result, `y` its second argument.
#[inline(never)]
pub(super) fn calculate<C: ByteCode>(start: u8, x: &mut Float, y: &Float) {
    let mut registers = [*y; REGISTERS as usize];
    let (mut sign, mut steep, mut left) = (false, false, false);
    let (mut at, mut back) = (start, 0);
    loop {
        let instruction = instruction_at::<C>(at);
        at = at.wrapping_add(1);
        let number = instruction & 0x0F;
        match instruction & 0xF0 {
            ..=instruction::ROOT => x.operate(instruction >> 4, &operand::<C>(&registers, number)),
            instruction::LOAD => *x = operand::<C>(&registers, number),
            instruction::STORE => set(&mut registers, number, x),
            instruction::EXP2 => exp2_product::<C>(x, &operand::<C>(&registers, number)),
            instruction::SERIES => {
                let mut square = x.square();
                let (series, exponent) = match number {
                    0 => (SINE, 1),
                    1 => (ARC_TANGENT, 0),
                    _ => {
                        square = LARGEST_SQUARE.wrapping_sub(square);
                        (LOGARITHM, 2)
                    }
                };
                x.mul(&Float::new(evaluate::<C>(series, square), exponent));
            }
            instruction::TURN => {
                if x.is_endless() {
                    x.set_nan();
                    return;
                }
                sign = turn::<C>(x, number);
            }
            _ => match instruction {
                instruction::IF_STEEP => at = at.wrapping_add(u8::from(!steep)),
                instruction::IF_LEFT => at = at.wrapping_add(u8::from(!left)),
                instruction::SPLIT => match split(x) {
                    Some(power) => set(&mut registers, T, &Float::from_int(i32::from(power))),
                    None => (at, back) = (back, 0),
                },
                instruction::POWER => {
                    let done;
                    (done, sign) = simple_power(x, &registers[usize::from(Y)]);
                    if done {
                        x.negative = sign;
                        return;
                    }
                }
                instruction::POINT => {
                    let y = &mut registers[usize::from(Y)];
                    if x.is_nan() || y.is_nan() {
                        x.set_nan();
                        return;
                    }
                    (sign, left) = (x.negative, y.negative);
                    x.negative = false;
                    y.negative = false;
                    steep = y.is_smaller(x);
                    if x.is_special() && x.exponent == y.exponent {
                        // Two infinities have the ratio 1, two zeros 0.
                        y.exponent = 0;
                        if x.is_endless() {
                            x.exponent = 0;
                        }
                    }
                }
                instruction::SIGN => x.negative = sign,
                instruction::MINUS => x.negative = true,
                instruction::SWAP => swap(x, &mut registers[usize::from(Y)]),
                instruction::JUMP => at = instruction_at::<C>(at),
                instruction::CALL => {
                    back = at.wrapping_add(1);
                    at = instruction_at::<C>(at);
                }
                _ => {
                    (at, back) = (back, 0);
                }
            },
        }
        if at == 0 {
            return;
        }
    }
}

/// A register or a constant.
#[inline(never)]
fn operand<C: ByteCode>(registers: &[Float; REGISTERS as usize], number: u8) -> Float {
    match registers.get(usize::from(number)) {
        Some(register) => *register,
        None => constant::<C>(number),
    }
}

fn set(registers: &mut [Float; REGISTERS as usize], number: u8, value: &Float) {
    if let Some(register) = registers.get_mut(usize::from(number)) {
        *register = *value;
    }
}
