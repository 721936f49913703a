//! The arithmetic of the machine as functions of binary32.

use std::cmp::Ordering;

use bittybuzz_vm_core::number::{Float, Number, Profile, Rounding};

/// A number as the machine of the full profile computes with it.
pub fn unpack(value: f32) -> Float {
    Float::from_f32(value)
}

/// A number as the machine of a profile computes with it: the nearest float.
pub fn unpack_in<P: Profile>(value: f32) -> Float<P> {
    P::unpack(P::float_from_f32(value))
}

/// The nearest float of the profile.
pub fn pack<P: Profile>(number: &Float<P>) -> f32 {
    P::float_to_f32(P::pack(number))
}

pub fn compare(a: Number, b: Number) -> Option<Ordering> {
    a.unpack().compare(&b.unpack())
}

pub fn to_int(number: Number) -> i32 {
    number.unpack().to_int(Rounding::Truncate) as i32
}

pub fn floor(x: f32) -> i32 {
    unpack(x).to_int(Rounding::Floor) as i32
}

pub fn ceil(x: f32) -> i32 {
    unpack(x).to_int(Rounding::Ceil) as i32
}

pub fn round(x: f32) -> i32 {
    unpack(x).to_int(Rounding::Nearest) as i32
}

pub fn abs(x: f32) -> f32 {
    let mut number = unpack(x);
    number.abs();
    number.to_f32()
}

/// The form in which a float is a table key.
pub fn normalize_key<P: Profile>(float: f32) -> Number {
    match unpack_in::<P>(float).as_int() {
        Some(int) => Number::Int(P::int_to_i32(int)),
        None => Number::Float(float),
    }
}

pub fn float_modulo<P: Profile>(a: f32, b: f32) -> f32 {
    P::float_to_f32(unpack_in::<P>(a).modulo(&unpack_in(b)))
}

pub fn power(x: f32, y: f32) -> f32 {
    maths::of::<bittybuzz_vm_core::number::Full>(maths::MathFunction::Power, x, y)
}

pub mod maths {
    pub use bittybuzz_vm_core::number::maths::MathFunction;
    use bittybuzz_vm_core::number::maths::function;

    use bittybuzz_vm_core::number::Full;

    use super::{Profile, pack, unpack_in};

    pub fn of<P: Profile>(which: MathFunction, x: f32, y: f32) -> f32 {
        let mut number = unpack_in::<P>(x);
        function::<P, &[u8]>(which as u8, &mut number, &unpack_in(y));
        pack(&number)
    }

    macro_rules! functions {
        ($($name:ident $function:ident)+) => {
            $(pub fn $name(x: f32) -> f32 {
                of::<Full>(MathFunction::$function, x, 0.0)
            })+
        };
    }

    functions! {
        sqrt Sqrt exp Exp log Log log2 Log2 log10 Log10 sin Sin cos Cos tan Tan asin Asin acos Acos
    }

    pub fn atan2(y: f32, x: f32) -> f32 {
        of::<Full>(MathFunction::Atan2, y, x)
    }
}
