//! Numbers: the two number profiles and everything that is computed with them.
//!
//! Scripts must compute the same on every robot of a swarm, whatever its processor. Nothing here
//! therefore calls a platform's mathematical library, uses binary64 or contracts `a * b + c`. The
//! code uses integers and, in the full profile, IEEE binary32 `+ - * /`, which hardware and
//! soft-float libraries round alike. Nothing here panics: integer operations wrap, and no table is
//! indexed by a computed value.

mod arithmetic;
mod binary32;
mod calculator;
mod exponential;
mod float;
mod float16;
mod format;
pub mod maths;
#[cfg(target_pointer_width = "64")]
pub(crate) mod memo;
mod mixed;
mod profile;
mod rng;
pub(crate) mod tables;
mod trigonometry;
pub(crate) mod wide;
mod word;

pub use arithmetic::operation;
pub use binary32::compute;
pub use float::{Float, Rounding};
pub use float16::F16;
pub use format::{format_float, format_int, parse_float, parse_int};
pub use mixed::Number;
pub use profile::{Full, Profile, TextWork, Tiny};
pub use rng::Rng;
pub(crate) use word::Word;
