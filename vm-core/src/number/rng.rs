//! The generator of `rand` and `math.rng`: SplitMix of Steele, Lea and Flood, with words of 32 bits
//! and the finalizer of MurmurHash3.
//!
//! The generator returns the same numbers on every target. It needs two 32-bit multiplications per
//! number, no table and 8 bytes of state, and every value of the state is valid. A step, modulo
//! 2^32:
//!
//! ```text
//! state = state + increment
//! result = mix(state)
//!
//! mix(x):  x = (x ^ x >> 16) * 0x85EBCA6B
//!          x = (x ^ x >> 13) * 0xC2B2AE35
//!          x ^ x >> 16
//! ```
//!
//! The increment is odd, so the period is 2^32, which lasts for years of a script. Seed and robot
//! id determine both words, so that robots have different sequences instead of parts of the same
//! one:
//!
//! ```text
//! state = mix(seed ^ mix(id + 0x9E3779B9))
//! increment = mix(state + 0x9E3779B9) | 1
//! ```

use core::cmp::Ordering;

use super::calculator::calculate;
use super::float::Float;
use super::profile::Profile;
use super::tables::program;
use super::word::Word;
use super::word::multiply_halves;
use crate::bytecode::ByteCode;

/// 2^32 divided by the golden ratio: any constant with irregular bits would do.
const GOLDEN: u32 = 0x9E37_79B9;

/// The state of the generator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Rng {
    state: u32,
    /// The increment, except for its lowest bit, which counts as set.
    increment: u32,
}

impl Rng {
    /// The generator with all bits zero.
    pub(crate) const ZERO: Rng = Rng { state: 0, increment: 0 };

    /// Returns the generator of a robot in a run. Robots with the same seed get different numbers.
    pub const fn new(seed: u32, robot_id: u16) -> Rng {
        let state = mix(seed ^ mix((robot_id as u32).wrapping_add(GOLDEN)));
        Rng { state, increment: mix(state.wrapping_add(GOLDEN)) }
    }

    /// Returns the generator after `math.rng.setseed(seed)`, which is the same on every robot.
    pub const fn from_seed(seed: u32) -> Rng {
        Rng::new(seed, 0)
    }

    /// Returns 32 random bits.
    #[one_copy]
    pub fn next_u32(&mut self) -> u32 {
        self.state = self.state.wrapping_add(self.increment | 1);
        mix(self.state)
    }

    /// Returns the result of `rand()`, an integer in 0..=32767.
    pub fn rand(&mut self) -> i32 {
        (self.next_u32() >> 17) as i32
    }

    /// Returns an integer from `a` up to but not including `b`; in `b..a` if `b` is less, `a` if
    /// they are equal.
    ///
    /// Scaling 32 random bits makes some of `n` integers likelier than others, by at most `n /
    /// 2^32` of their probability. This is imperceptible in the tiny profile, where `n` is below
    /// 2^16.
    pub fn uniform_int<P: Profile>(&mut self, a: P::Raw, b: P::Raw) -> P::Raw {
        let (low, high) = if P::int_less(b, a) { (b, a) } else { (a, b) };
        P::add(low, P::sub(high, low).scale(self.next_u32()))
    }

    /// Sets `a` to a float of the profile from `a` up to but not including `b`; in `b..a` if `b` is
    /// less, `a` if they are equal.
    ///
    /// The result is one of 2^24 equally spaced numbers, rounded to the profile's floats. A number
    /// that rounds to `b` becomes `a`, which makes up for the numbers below `a` that would round to
    /// it.
    pub fn uniform_float<P: Profile>(&mut self, a: &mut Float<P>, b: &Float<P>) {
        let first = *a;
        let swapped = b.compare(&first) == Some(Ordering::Less);
        let (low, high) = if swapped { (b, &first) } else { (&first, b) };
        let part = self.next_u32() >> 8;
        // Unlike low + part * (high - low) this does not overflow.
        let mut sum = Float::from_fraction((1_u32 << 24).wrapping_sub(part), 8);
        sum.mul(low);
        *a = Float::from_fraction(part, 8);
        a.mul(high);
        a.add(&sum);
        *a = P::unpack(P::pack(a));
        // NaN is not below `high`.
        let is_inside =
            a.compare(high) == Some(Ordering::Less) && a.compare(low) != Some(Ordering::Less);
        if !is_inside {
            *a = *low;
        }
    }

    /// Sets `deviation` to a normally distributed float.
    ///
    /// This is the polar method of Marsaglia, on points whose coordinates are 16-bit integers: no
    /// result is farther from the mean than 6.5 standard deviations. It tries 1.3 points on
    /// average, and always ends, since the generator reaches every number.
    pub fn gaussian<P: Profile, C: ByteCode>(&mut self, deviation: &mut Float<P>, mean: &Float<P>) {
        let radius: u32 = 1 << 30;
        loop {
            let bits = self.next_u32();
            let (x, y) = (bits as i16, (bits >> 16) as i16);
            let square = square(x).wrapping_add(square(y));
            if x != 0 && square < radius {
                // x / 2^15 * sqrt(-2 ln(s) / s), where s = square / radius
                let mut normal = Float::from_fraction(square, 2);
                let x = Float::from_int(P::int_from_i32(x.into()));
                calculate::<P, C>(program::NORMAL, &mut normal, &x);
                deviation.mul(&normal);
                deviation.add(mean);
                return;
            }
        }
    }

    /// Sets `mean` to an exponentially distributed float.
    pub fn exponential<P: Profile, C: ByteCode>(&mut self, mean: &mut Float<P>) {
        // 0 has no logarithm.
        let mut number = Float::from_fraction((self.next_u32() >> 8).max(1), 8);
        calculate::<P, C>(program::MINUS_LN, &mut number, mean);
        mean.mul(&number);
    }
}

fn square(number: i16) -> u32 {
    let magnitude = number.unsigned_abs();
    multiply_halves(magnitude, magnitude)
}

/// Applies the finalizer of MurmurHash3: a bijection that spreads every bit of the argument over
/// all bits of the result.
#[one_copy]
const fn mix(bits: u32) -> u32 {
    let bits = (bits ^ bits >> 16).wrapping_mul(0x85EB_CA6B);
    let bits = (bits ^ bits >> 13).wrapping_mul(0xC2B2_AE35);
    bits ^ bits >> 16
}
