//! The arithmetic of the machine as functions of binary32.
#![allow(dead_code, reason = "no test needs all of it")]

use std::cmp::Ordering;

use bittybuzz_vm_core::number::{Float, Number, Profile, Rounding};

/// A number as the machine computes with it.
pub fn unpack(value: f32) -> Float {
    Float::from_f32(value)
}

pub fn compare(a: Number, b: Number) -> Option<Ordering> {
    a.unpack().compare(&b.unpack())
}

pub fn to_int(number: Number) -> i32 {
    number.unpack().to_int(Rounding::Truncate)
}

pub fn floor(x: f32) -> i32 {
    unpack(x).to_int(Rounding::Floor)
}

pub fn ceil(x: f32) -> i32 {
    unpack(x).to_int(Rounding::Ceil)
}

pub fn round(x: f32) -> i32 {
    unpack(x).to_int(Rounding::Nearest)
}

pub fn abs(x: f32) -> f32 {
    let mut number = unpack(x);
    number.abs();
    number.to_f32()
}

/// The form in which a float is a table key.
pub fn normalize_key<P: Profile>(float: f32) -> Number {
    match unpack(float).as_int() {
        Some(int) if int >= P::INT_MIN && int <= P::INT_MAX => Number::Int(int),
        _ => Number::Float(float),
    }
}

pub fn float_modulo<P: Profile>(a: f32, b: f32) -> f32 {
    let mut number = unpack(a);
    number.modulo::<P>(&unpack(b));
    number.to_f32()
}

#[cfg(feature = "maths")]
pub fn power(x: f32, y: f32) -> f32 {
    maths::of(maths::Function::Power, x, y)
}

#[cfg(feature = "maths")]
pub mod maths {
    pub use bittybuzz_vm_core::number::maths::Function;
    use bittybuzz_vm_core::number::maths::function;

    use super::unpack;

    pub fn of(which: Function, x: f32, y: f32) -> f32 {
        let mut number = unpack(x);
        function::<&[u8]>(which as u8, &mut number, &unpack(y));
        number.to_f32()
    }

    macro_rules! functions {
        ($($name:ident $function:ident)+) => {
            $(pub fn $name(x: f32) -> f32 {
                of(Function::$function, x, 0.0)
            })+
        };
    }

    functions! {
        sqrt Sqrt exp Exp log Log log2 Log2 log10 Log10 sin Sin cos Cos tan Tan asin Asin acos Acos
    }

    pub fn atan2(y: f32, x: f32) -> f32 {
        of(Function::Atan2, y, x)
    }
}
